//! Comparison of this program with another build of it: `cargo bench --bench against -- --against PATH
//! [--rounds N]`.
//!
//! Both take turns at equal work, so that a disturbance of the machine affects both. The work is `generate`
//! and `run` of the static scene, and `receive` of its samples at 2.6 and 20 Msps. It is also `receive` of 50
//! ms alone, which is a cold search. Times are those of the processor, of the whole process and all its
//! threads, as the kernel counts them in hundredths of a second. The table has medians, their ratio, the
//! range of the ratios round by round, and the largest memory of either.

#[path = "shared/process.rs"]
mod process;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use analysis::statistics::median;
use process::{Spent, remove, spent};

/// Rounds unless others are asked for.
const ROUNDS: usize = 5;
const STATIC: &str = "scenarios/static.toml";
const HEAD: &str = "|work, CPU time of the whole process|this (s)|other (s)|this over other|each round|\
                    memory (MiB)|\n|---|---|---|---|---|---|\n";

/// One kind of work: its name, its arguments, and where they put what has to go before the next time.
struct Work {
    name: &'static str,
    arguments: Vec<String>,
    out: PathBuf,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |flag: &str| arguments.iter().position(|one| one == flag).and_then(|at| arguments.get(at + 1));
    let Some(other) = value("--against") else {
        println!("against: nothing was compared. Name another build: cargo bench --bench against -- --against PATH");
        return ExitCode::SUCCESS;
    };
    let rounds = value("--rounds").and_then(|text| text.parse().ok()).unwrap_or(ROUNDS);
    match compare(Path::new(other), rounds) {
        Ok(table) => {
            println!("{table}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("against: {error}");
            ExitCode::FAILURE
        }
    }
}

fn compare(other: &Path, rounds: usize) -> Result<String, String> {
    let own = Path::new(env!("CARGO_BIN_EXE_gnss-twin"));
    let room = tempfile::tempdir().map_err(|error| format!("no directory for samples: {error}"))?;
    let mut table = HEAD.to_owned();
    for work in work(own, room.path())? {
        let arguments: Vec<&str> = work.arguments.iter().map(String::as_str).collect();
        let mut found: [Vec<Spent>; 2] = [Vec::new(), Vec::new()];
        for _ in 0..rounds.max(1) {
            for (program, found) in [own, other].into_iter().zip(&mut found) {
                found.push(spent(program, &arguments)?);
                // A result stands under its name until it is taken away.
                remove(&work.out)?;
            }
        }
        let mut ratios: Vec<f64> = found[0].iter().zip(&found[1]).map(|(a, b)| a.cpu_s / b.cpu_s).collect();
        ratios.sort_by(f64::total_cmp);
        let (least, most) = (ratios.first().unwrap_or(&f64::NAN), ratios.last().unwrap_or(&f64::NAN));
        let time = |found: &Vec<Spent>| median(&found.iter().map(|one| one.cpu_s).collect::<Vec<_>>());
        let [this, that] = [&found[0], &found[1]].map(|found| time(found).unwrap_or(f64::NAN));
        let [mib, other_mib] = found.map(|found| found.iter().map(|one| one.peak_mib).fold(0.0, f64::max));
        table += &format!(
            "|{}|{this:.2}|{that:.2}|{:.3}|{least:.3} to {most:.3}|{mib:.0} / {other_mib:.0}|\n",
            work.name,
            this / that
        );
    }
    Ok(table)
}

/// Work of both programs; samples to be received are made here.
fn work(own: &Path, room: &Path) -> Result<Vec<Work>, String> {
    let text = |path: &Path| path.display().to_string();
    let scene = std::fs::read_to_string(STATIC).map_err(|error| format!("{STATIC}: {error}"))?;
    let mut samples = Vec::new();
    for (name, rate, duration) in [("slow", "2.6e6", "60"), ("fast", "20e6", "30"), ("cold", "2.6e6", "0.05")] {
        let own_scene = scene.replace("2.6e6", rate).replace("duration_s = 60", &format!("duration_s = {duration}"));
        let (path, made) = (room.join(format!("{name}.toml")), text(&room.join(format!("{name}.sigmf-data"))));
        std::fs::write(&path, own_scene).map_err(|error| format!("{}: {error}", path.display()))?;
        spent(own, &["generate", &text(&path), "--out", &made])?;
        samples.push(made);
    }
    let one = |name, arguments: &[&str], out: &str| {
        let out = room.join(out);
        let arguments = arguments.iter().map(|one| (*one).to_owned()).chain(["--out".to_owned(), text(&out)]).collect();
        Work { name, arguments, out }
    };
    let [slow, fast, cold] = [0, 1, 2].map(|place| samples[place].as_str());
    Ok(vec![
        one("generate, static scene, 60 s, 2.6 Msps", &["generate", STATIC], "made.sigmf-data"),
        one("receive, static scene, 60 s, 2.6 Msps", &["receive", slow], "rx"),
        one("receive, static scene, 30 s, 20 Msps", &["receive", fast], "rx"),
        one("receive, its first 50 ms: a search from cold", &["receive", cold], "rx"),
        one("run, static scene, report and pictures too", &["run", STATIC], "run"),
    ])
}
