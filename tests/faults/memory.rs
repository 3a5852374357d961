//! Memory over time: what ten minutes hold beyond a short run.
//!
//! Generator and receiver hold the same; the judge reads all rows of a run into memory and says how much a row takes.

use std::fs;
use std::path::Path;
use std::process::Stdio;

use crate::machine::{scene, twin};
use crate::tally::{End, Tally, long};

const FAMILY: &str = "A machine that fails";

/// Peak of the memory of a run in KiB: what the system last says of it before it ends.
fn peak_kib(words: &str, place: &Path) -> Result<f64, String> {
    let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
    let mut child =
        twin(&words, place).stdout(Stdio::null()).stderr(Stdio::null()).spawn().map_err(|e| e.to_string())?;
    let mut peak = 0.0;
    loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        if let Some(kib) = line.and_then(|line| line.split_whitespace().next()).and_then(|word| word.parse().ok()) {
            peak = kib;
        }
        match child.try_wait().map_err(|e| e.to_string())? {
            Some(status) if status.success() => return Ok(peak),
            Some(status) => return Err(format!("{words:?}: {status}")),
            None => std::thread::sleep(std::time::Duration::from_millis(5)),
        }
    }
}

/// Lines of the tables below a directory.
fn rows(place: &Path) -> usize {
    let Ok(entries) = fs::read_dir(place) else { return 0 };
    let of = |entry: fs::DirEntry| {
        let bytes = fs::read(entry.path()).unwrap_or_default();
        bytes.iter().filter(|byte| **byte == b'\n').count()
    };
    entries.flatten().map(of).sum()
}

#[test]
fn ten_minutes_take_the_memory_of_a_short_run_and_the_judge_that_of_its_rows() {
    if !long() {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    for duration_s in [10, 20, 600] {
        fs::write(place.join(format!("{duration_s}.toml")), scene(f64::from(duration_s), 1)).unwrap();
    }
    let mut tally = Tally::new(FAMILY, "22. memory of a run of 10 min over a short one");
    for (command, short_s) in [
        ("generate D.toml --out D.sigmf-data --threads 2", 10),
        // The search at 15 s is the first one beside channels that track.
        ("receive D.sigmf-data --out rxD --threads 2", 20),
        ("run D.toml --out runD --threads 2", 10),
        ("analyze runD", 10),
    ] {
        tally.case(
            || command.to_owned(),
            || {
                let of = |duration_s: i32| peak_kib(&command.replace('D', &duration_s.to_string()), place);
                if short_s == 20 {
                    peak_kib("generate 20.toml --out 20.sigmf-data", place)?;
                }
                let (short, long) = (of(short_s)?, of(600)?);
                println!("{command}: {short_s} s {short} KiB, 600 s {long} KiB");
                if !command.contains("run") {
                    let flat = (long / short - 1.0).abs() <= 0.05;
                    return if flat { Ok(End::Accepted) } else { Err(format!("{short} KiB, {long} KiB")) };
                }
                // The judge holds all rows of a run: at most 27 numbers of 8 bytes, and what it joins them to once more.
                let rows = rows(&place.join("run600/rx")) + rows(&place.join("run600/truth"));
                let row_bytes = 1024.0 * (long - short) / rows.max(1) as f64;
                println!("{row_bytes:.0} bytes a row of {rows}");
                if row_bytes <= 2.0 * 27.0 * 8.0 { Ok(End::Reported) } else { Err(format!("{row_bytes} bytes a row")) }
            },
        );
    }
    tally.finish();
}
