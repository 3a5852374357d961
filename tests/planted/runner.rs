//! Runs the check of every fault in a process of its own.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::faults::{FAULTS, Fault, LOOP};
use crate::{judge, loops};

/// A child that takes longer hangs; the slowest check takes seconds.
const LONGEST: Duration = Duration::from_secs(600);

/// Result of a fault.
struct Outcome {
    fault: &'static Fault,
    /// The first line of what failed.
    caught: Result<String, String>,
    /// The check passed without data from outside of the repository, which it looked for: it says nothing.
    blind: bool,
    seconds: f64,
}

fn child(fault: &Fault, run: &Path, output: &fs::File) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", fault.check, "--test-threads", "1"])
        .env(gnss::plant::VARIABLE, fault.name)
        .env(judge::RUN, run)
        .env("RAYON_NUM_THREADS", "1")
        .env("RUST_BACKTRACE", "0")
        .stdin(Stdio::null())
        .stdout(output.try_clone().unwrap())
        .stderr(output.try_clone().unwrap())
        .spawn()
        .unwrap()
}

fn outcome(fault: &'static Fault, run: &Path) -> Outcome {
    let file = tempfile::NamedTempFile::new().unwrap();
    let begun = Instant::now();
    let mut child = child(fault, run, file.as_file());
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break Some(status),
            None if begun.elapsed() > LONGEST => {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    let mut bytes = Vec::new();
    fs::File::open(file.path()).unwrap().read_to_end(&mut bytes).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let caught = match status {
        None => Err(format!("{} took longer than {LONGEST:?}", fault.check)),
        Some(_) if text.contains("0 passed; 1 failed") => Ok(reason(&text)),
        Some(_) if text.contains("1 passed; 0 failed") => Err("survives".to_owned()),
        Some(status) => Err(format!("{} did not run: {status}: {text}", fault.check)),
    };
    let blind = text.contains("1 passed; 0 failed") && text.contains("skipped: ");
    Outcome { fault, caught, blind, seconds: begun.elapsed().as_secs_f64() }
}

/// The line after the first panic.
fn reason(text: &str) -> String {
    let after = text.split_once("panicked at ").map_or("", |(_, after)| after);
    let line = after.lines().nth(1).unwrap_or("").trim();
    let end = line.char_indices().nth(160).map_or(line.len(), |(end, _)| end);
    line[..end].to_owned()
}

#[test]
fn every_planted_fault_is_noticed() {
    let run = tempfile::tempdir().unwrap();
    loops::run_and_keep(loops::OPEN_SKY, run.path());
    let only = std::env::var("GNSS_TWIN_PLANTED_ONLY").unwrap_or_default();
    // The whole chain takes seconds for each: every third of those each day, all with `GNSS_TWIN_LONG`.
    let is_long = std::env::var_os("GNSS_TWIN_LONG").is_some();
    let mut chained = 0..;
    let is_due = |fault: &&Fault| fault.check != LOOP || chained.next().is_some_and(|n| is_long || n % 3 == 0);
    let mut chosen: Vec<&Fault> = FAULTS.iter().filter(is_due).collect();
    chosen.retain(|fault| fault.name.contains(&only));
    let (queue, outcomes) = (Mutex::new(chosen.iter().rev().copied().collect::<Vec<_>>()), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(2, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let Some(fault) = queue.lock().unwrap().pop() else { break };
                    let outcome = outcome(fault, run.path());
                    outcomes.lock().unwrap().push(outcome);
                }
            });
        }
    });
    let mut outcomes = outcomes.into_inner().unwrap();
    outcomes.sort_by_key(|outcome| FAULTS.iter().position(|fault| fault.name == outcome.fault.name));
    for outcome in &outcomes {
        let (Ok(text) | Err(text)) = &outcome.caught;
        println!("{:6.1} s  {:40} {text}", outcome.seconds, outcome.fault.name);
    }
    if let Some(path) = std::env::var_os("GNSS_TWIN_WRITE_PLANTED") {
        fs::write(path, report(&outcomes)).unwrap();
    }
    let (blind, seeing): (Vec<&Outcome>, Vec<&Outcome>) = outcomes.iter().partition(|outcome| outcome.blind);
    for outcome in blind {
        // Past the capture of output: a fault that nobody looked for is no fault that was noticed.
        let _ = writeln!(std::io::stderr(), "not looked for: {}, whose check lacks data", outcome.fault.name);
    }
    let missed: Vec<String> = seeing
        .iter()
        .filter_map(|outcome| outcome.caught.as_ref().err().map(|why| format!("{}: {why}", outcome.fault.name)))
        .collect();
    assert!(missed.is_empty(), "{} of {}:\n{}", missed.len(), outcomes.len(), missed.join("\n"));
}

fn report(outcomes: &[Outcome]) -> String {
    let caught = outcomes.iter().filter(|outcome| outcome.caught.is_ok()).count();
    let mut text = format!(
        "# Planted faults\n\n\
         Each row is one fault, planted in the code behind the feature `planted`, which only the package's own tests \
         turn on.\n\
         A process with that fault runs one check, and the check must fail; without a fault every check passes. The \
         last column is\n\
         what the check reported. `tests/planted` is part of `cargo test`; this file is written by `.ci/long`.\n\n\
         {caught} of {} faults are caught.\n\n| fault | what is wrong | caught by | how |\n| --- | --- | --- | --- |\n",
        outcomes.len()
    );
    for Outcome { fault, caught, .. } in outcomes {
        let (Ok(how) | Err(how)) = caught;
        let how = how.replace('|', "\\|");
        let check = fault.check.rsplit("::").next().unwrap_or("").replace('_', " ");
        let place = fault.check.split("::").next().unwrap_or("");
        let _ = writeln!(text, "| `{}` | {} | {place}: {check} | {how} |", fault.name, fault.what);
    }
    text
}

/// Names of `planted!` in all sources.
fn planted(directory: &Path, names: &mut Vec<String>) {
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            planted(&path, names);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let calls = text.split("planted!(").skip(1).filter_map(|call| call.trim_start().strip_prefix('"'));
            names.extend(calls.filter_map(|call| call.split_once('"')).map(|(name, _)| name.to_owned()));
        }
    }
}

#[test]
fn every_fault_in_the_list_is_planted_once_and_every_planted_one_is_in_the_list() {
    let mut names = Vec::new();
    planted(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut names);
    let found: BTreeSet<&str> = names.iter().map(String::as_str).collect();
    assert_eq!(found.len(), names.len(), "a name is planted twice");
    let listed: BTreeSet<&str> = FAULTS.iter().map(|fault| fault.name).collect();
    assert_eq!(listed.len(), FAULTS.len(), "a name is listed twice");
    assert_eq!(found.difference(&listed).collect::<Vec<_>>(), Vec::<&&str>::new(), "planted and not listed");
    assert_eq!(listed.difference(&found).collect::<Vec<_>>(), Vec::<&&str>::new(), "listed and not planted");
    assert!(FAULTS.len() >= 50);
}

#[test]
fn no_default_feature_plants_a_fault() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = fs::read_dir(root.join("src")).unwrap().map(|entry| entry.unwrap().path());
    let manifests = crates.map(|path| path.join("Cargo.toml")).filter(|path| path.exists());
    for path in manifests.chain([root.join("Cargo.toml"), root.join("python/Cargo.toml")]) {
        let manifest = fs::read_to_string(&path).unwrap();
        let used = manifest.split("[dev-dependencies]").next().unwrap();
        let lines = used.lines().filter(|line| !line.trim_start().starts_with('#') && line.contains("planted"));
        // Declared where the switches are; turned on by no dependency but those of tests.
        let declared: &[&str] = if path.ends_with("gnss/Cargo.toml") { &["planted = []"] } else { &[] };
        assert_eq!(lines.collect::<Vec<_>>(), declared, "{}", path.display());
    }
}
