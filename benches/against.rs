//! This program against another build of it: `cargo bench --bench against -- --against PATH [--rounds N]`.
//!
//! Both take turns at the same work, so that a disturbance of the machine meets both: `generate` and `run` of
//! the static scene, and `receive` of its samples at 2.6 and 20 Msps. Times are those of the processor, of
//! the whole process and all its threads, as the kernel counts them in hundredths of a second; the table has
//! medians, their ratio, and the range of the ratios round by round.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// Ticks a second of `/proc/self/stat`, whatever the machine.
const TICKS: f64 = 100.0;
/// Rounds unless others are asked for.
const ROUNDS: usize = 5;
const STATIC: &str = "scenarios/static.toml";

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
    let quick = room.path().join("static20.toml");
    let scene = std::fs::read_to_string(STATIC).map_err(|error| format!("{STATIC}: {error}"))?;
    let faster = scene.replace("2.6e6", "20e6").replace("duration_s = 60", "duration_s = 30");
    std::fs::write(&quick, faster).map_err(|error| format!("{}: {error}", quick.display()))?;
    let work = work(own, room.path(), &quick)?;
    let mut table = String::from(
        "|work, CPU time of the whole process|this (s)|other (s)|this over other|each round|\n|---|---|---|---|---|\n",
    );
    for work in work {
        let mut times: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        for _ in 0..rounds.max(1) {
            for (program, times) in [own, other].into_iter().zip(&mut times) {
                times.push(cpu_s(program, &work)?);
            }
        }
        let mut ratios: Vec<f64> = times[0].iter().zip(&times[1]).map(|(a, b)| a / b).collect();
        ratios.sort_by(f64::total_cmp);
        let (least, most) = (ratios.first().unwrap_or(&f64::NAN), ratios.last().unwrap_or(&f64::NAN));
        let [this, that] = times.map(median);
        table += &format!("|{}|{this:.2}|{that:.2}|{:.3}|{least:.3} to {most:.3}|\n", work.name, this / that);
    }
    Ok(table)
}

/// What both do; samples to be received are made here.
fn work(own: &Path, room: &Path, quick: &Path) -> Result<Vec<Work>, String> {
    let text = |path: &Path| path.display().to_string();
    let samples = |name: &str| room.join(format!("{name}.sigmf-data"));
    for (scene, name) in [(Path::new(STATIC), "slow"), (quick, "fast")] {
        cpu_s(
            own,
            &Work {
                name: "samples",
                arguments: ["generate", &text(scene), "--out", &text(&samples(name))].map(str::to_owned).to_vec(),
                out: PathBuf::new(),
            },
        )?;
    }
    let one = |name, arguments: &[&str], out: PathBuf| Work {
        name,
        arguments: arguments.iter().map(|one| (*one).to_owned()).chain([text(&out)]).collect(),
        out,
    };
    Ok(vec![
        one("generate, static scene, 60 s, 2.6 Msps", &["generate", STATIC, "--out"], room.join("made.sigmf-data")),
        one("receive, static scene, 60 s, 2.6 Msps", &["receive", &text(&samples("slow")), "--out"], room.join("rx")),
        one("receive, static scene, 30 s, 20 Msps", &["receive", &text(&samples("fast")), "--out"], room.join("rx")),
        one("run, static scene, report and pictures too", &["run", STATIC, "--out"], room.join("run")),
    ])
}

/// Processor time of one run, its children's threads and all.
fn cpu_s(program: &Path, work: &Work) -> Result<f64, String> {
    let before = of_children_s()?;
    let status = Command::new(program)
        .args(&work.arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .map_err(|error| format!("{}: {error}", program.display()))?;
    let spent_s = of_children_s()? - before;
    // A result stands under its name until it is taken away.
    let sidecars = [work.out.clone(), work.out.with_extension("sigmf-meta"), work.out.with_extension("truth")];
    for path in sidecars.iter().filter(|path| path.exists()) {
        let gone = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
        gone.map_err(|error| format!("{}: {error}", path.display()))?;
    }
    if status.success() {
        Ok(spent_s)
    } else {
        Err(format!("{} {}: {status}", program.display(), work.arguments.join(" ")))
    }
}

/// Processor time of all children so far, user's and kernel's.
fn of_children_s() -> Result<f64, String> {
    let stat = std::fs::read_to_string("/proc/self/stat").map_err(|error| format!("/proc/self/stat: {error}"))?;
    // Fields are counted behind the program's name, which may hold anything.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |at: usize| fields.get(at).and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN);
    Ok((ticks(13) + ticks(14)) / TICKS)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
