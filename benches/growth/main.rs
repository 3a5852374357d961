//! How cost and memory grow: `cargo bench --bench growth` prints tables of whole processes against
//! satellites, signals, rate, duration, rays, rows of motion and taps, each beside the straight line that it
//! should be. With `-- --write` they go into `reports/performance.md`, and the curves into
//! `reports/growth.png`.
//!
//! Cost is processor time of the whole process on one thread, all of its files in, per second of signal (the
//! kernel counts it in hundredths of a second); memory is the process's largest resident set, asked for every
//! few milliseconds. `--only WORDS` measures the ladders whose title holds these words.

mod ladder;
mod process;
mod scenes;
mod taps;

use std::path::Path;
use std::process::{Command, ExitCode};

use ladder::Ladder;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let only = arguments.iter().position(|one| one == "--only").and_then(|at| arguments.get(at + 1));
    let is_wanted = |title: &str| only.is_none_or(|words| title.contains(words.as_str()));
    match measure(&is_wanted) {
        Ok(ladders) => {
            let text = page(&ladders);
            println!("{text}");
            if !arguments.iter().any(|argument| argument == "--write") {
                return ExitCode::SUCCESS;
            }
            match publish(&text, &ladders) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => failure(&error),
            }
        }
        Err(error) => failure(&error),
    }
}

fn failure(error: &str) -> ExitCode {
    eprintln!("growth: {error}");
    ExitCode::FAILURE
}

fn measure(is_wanted: &dyn Fn(&str) -> bool) -> Result<Vec<Ladder>, String> {
    let room = tempfile::tempdir().map_err(|error| format!("no directory for samples: {error}"))?;
    let mut ladders = scenes::ladders(room.path(), is_wanted)?;
    ladders.extend(taps::ladders(is_wanted));
    Ok(ladders)
}

fn page(ladders: &[Ladder]) -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model =
        cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("").trim_start_matches(['\t', ' ', ':']);
    let mut text = format!(
        "{model}; {}; release profile, instruction set chosen at run time; {}.\n",
        output_of("rustc", &["--version"]),
        output_of("date", &["-u", "+%F"]),
    );
    for ladder in ladders {
        text += &ladder.table();
    }
    text
}

fn output_of(program: &str, arguments: &[&str]) -> String {
    let found = Command::new(program).args(arguments).output().ok();
    found.map_or_else(String::new, |output| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Replaces what is between the marks of `reports/performance.md`, and the picture.
fn publish(text: &str, ladders: &[Ladder]) -> Result<(), String> {
    let path = Path::new("reports/performance.md");
    let page = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let (begin, end) = ("<!-- growth -->\n", "<!-- end of growth -->\n");
    let parts = page.split_once(begin).and_then(|(before, rest)| Some((before, rest.split_once(end)?.1)));
    let (before, after) = parts.ok_or_else(|| format!("{}: expected {begin:?} and {end:?}", path.display()))?;
    std::fs::write(path, format!("{before}{begin}{text}{end}{after}"))
        .map_err(|error| format!("{}: {error}", path.display()))?;
    ladder::draw(Path::new("reports/growth.png"), ladders)
}
