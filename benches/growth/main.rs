//! Growth of cost and memory: `cargo bench --bench growth` prints tables of whole processes against
//! satellites, signals, rate, duration, rays, rows of motion and taps. Each is beside its expected straight
//! line. With `-- --write` they go into `reports/performance.md`, and the curves into `reports/growth.png`.
//!
//! Cost is processor time of the whole process on one thread, with all of its files, per second of signal.
//! The kernel counts it in hundredths of a second. Memory is the process's largest resident set, sampled
//! every few milliseconds. `--only WORDS` measures the ladders whose title holds these words.

mod ladder;
#[path = "../shared/machine.rs"]
mod machine;
#[path = "../shared/page.rs"]
mod page;
#[path = "../shared/process.rs"]
mod process;
mod scenes;
mod taps;

use std::path::Path;
use std::process::ExitCode;

use ladder::Ladder;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let only = arguments.iter().position(|one| one == "--only").and_then(|at| arguments.get(at + 1));
    let is_wanted = |title: &str| only.is_none_or(|words| title.contains(words.as_str()));
    let all = measure(&is_wanted).and_then(|ladders| {
        let text = section(&ladders);
        println!("{text}");
        let is_kept = arguments.iter().any(|argument| argument == "--write");
        if is_kept { publish(&text, &ladders) } else { Ok(()) }
    });
    match all {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("growth: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(is_wanted: &dyn Fn(&str) -> bool) -> Result<Vec<Ladder>, String> {
    let room = tempfile::tempdir().map_err(|error| format!("no directory for samples: {error}"))?;
    let mut ladders = scenes::ladders(room.path(), is_wanted)?;
    ladders.extend(taps::ladders(is_wanted));
    Ok(ladders)
}

fn section(ladders: &[Ladder]) -> String {
    let tables: String = ladders.iter().map(Ladder::table).collect();
    format!("{}.\n{tables}", machine::machine())
}

fn publish(text: &str, ladders: &[Ladder]) -> Result<(), String> {
    page::put("growth", text)?;
    ladder::draw(Path::new("reports/growth.png"), ladders)
}
