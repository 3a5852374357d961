//! Memory over time: what ten minutes hold beyond a short run.
//!
//! Generator and receiver hold the same. The judge holds what has a row an epoch, and its pictures fill in
//! their first minute.

use std::fs;
use std::path::Path;
use std::process::Stdio;

use crate::machine::{NO_FIX, scene, twin};
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
            // Too short for a fix.
            Some(status) if words[0] == "receive" && status.code() == Some(NO_FIX) => return Ok(peak),
            Some(status) => return Err(format!("{words:?}: {status}")),
            None => std::thread::sleep(std::time::Duration::from_millis(5)),
        }
    }
}

/// What the judge holds of an epoch of a tenth of a second, in bytes: its place (88), fix (264), error (96),
/// honesty (72), clock (48) and phases (24), two sums by sample (80), a list of one number of twelve
/// satellites and its sorted copy (192); lists grow by doubling. What theory expects of a fix: sums over its
/// satellites (930), covariances (640), these beside fix and error (680), five kinds of error (280), each
/// list of a known length.
const EPOCH_BYTES: f64 =
    2.0 * (88.0 + 264.0 + 96.0 + 72.0 + 48.0 + 24.0 + 80.0 + 192.0) + 930.0 + 640.0 + 680.0 + 280.0;

#[test]
fn ten_minutes_take_the_memory_of_a_short_run_and_the_judge_that_of_its_epochs() {
    if !long() {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    for duration_s in [10, 20, 60, 600] {
        fs::write(place.join(format!("{duration_s}.toml")), scene(f64::from(duration_s), 1)).unwrap();
    }
    let mut tally = Tally::new(FAMILY, "22. memory of a run of 10 min over a short one");
    for (command, short_s) in [
        ("generate D.toml --out D.sigmf-data --threads 2", 10),
        // The search at 15 s is the first one beside channels that track.
        ("receive D.sigmf-data --out rxD --threads 2", 20),
        // From a minute on pictures have all the points that are drawn.
        ("run D.toml --out runD --threads 2", 60),
        ("analyze runD", 60),
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
                let epoch_bytes = 1024.0 * (long - short) / (10.0 * f64::from(600 - short_s));
                println!("{epoch_bytes:.0} bytes an epoch");
                if epoch_bytes <= EPOCH_BYTES {
                    Ok(End::Reported)
                } else {
                    Err(format!("{epoch_bytes} bytes an epoch"))
                }
            },
        );
    }
    tally.finish();
}
