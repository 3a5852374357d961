//! Memory over time: what a long run holds beyond one half as long.
//!
//! Generator and receiver hold the same. The judge holds a few numbers an epoch. Both runs take ten minutes
//! and more: until then the allocator's arenas and the pictures' points fill, by some 2 MiB in all.

use std::fs;
use std::path::Path;
use std::process::Stdio;

use crate::machine::{NO_FIX, scene, twin};
use crate::tally::{End, Tally};

const FAMILY: &str = "A machine that fails";

/// Peak of the memory of a run in KiB: what the system last says of it before it ends.
fn peak_kib(words: &str, place: &Path) -> Result<f64, String> {
    let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
    let mut command = twin(&words, place);
    // A picture's pixels are 10 MB. Whether the judge draws two at once, and whether the allocator keeps the
    // pixels of the last one, is chance: one thread, and an allocator that gives large blocks back.
    if ["analyze", "run"].contains(&words[0].as_str()) {
        command.env("RAYON_NUM_THREADS", "1").env("MALLOC_MMAP_THRESHOLD_", "131072");
    }
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().map_err(|e| e.to_string())?;
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
            // The peak grows slowly; a look costs 0.1 ms of the time that a case may take.
            None => std::thread::sleep(std::time::Duration::from_millis(20)),
        }
    }
}

/// Largest memory of the judge for an epoch of a tenth of a second, in bytes. It keeps the gains of carriers
/// (24), phases of the clock (24) and requirements (64). It keeps in turn lists of a measurement (some 50),
/// and the data of one satellite's signal at a time (some 130). Lists grow by doubling. Five satellites took
/// 2400 when sums and expectations of every fix were held.
const EPOCH_BYTES: f64 = 400.0;
/// Lengths of the runs that are compared, in seconds.
const SHORT_S: i32 = 600;
const LONG_S: i32 = 1200;

#[test]
fn twenty_minutes_take_the_memory_of_ten_and_the_judge_that_of_its_epochs() {
    if !crate::long::is_asked_for() {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    for duration_s in [SHORT_S, LONG_S] {
        fs::write(place.join(format!("{duration_s}.toml")), scene(f64::from(duration_s), 1)).unwrap();
    }
    let mut tally = Tally::new(FAMILY, "22. memory of a run of 20 min over one of 10 min");
    for command in [
        "generate D.toml --out D.sigmf-data --threads 2",
        "receive D.sigmf-data --out rxD --threads 2",
        "run D.toml --out runD --threads 2",
        "analyze runD",
    ] {
        tally.case(
            || command.to_owned(),
            || {
                let of = |duration_s: i32| peak_kib(&command.replace('D', &duration_s.to_string()), place);
                let (short, long) = (of(SHORT_S)?, of(LONG_S)?);
                println!("{command}: {SHORT_S} s {short} KiB, {LONG_S} s {long} KiB");
                if !command.contains("run") {
                    let flat = (long / short - 1.0).abs() <= 0.05;
                    return if flat { Ok(End::Accepted) } else { Err(format!("{short} KiB, {long} KiB")) };
                }
                let epoch_bytes = 1024.0 * (long - short) / (10.0 * f64::from(LONG_S - SHORT_S));
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

/// Columns that go on where a run is made longer, and what a second adds to them.
const COLUMNS: [(&str, f64); 4] = [("sample", 2.6e6), ("gps_s", 1.0), ("sent_s", 1.0), ("locked_s", 1.0)];
/// The segment of the run that is repeated, seconds: a part with fixes.
const REPEATED_S: [f64; 2] = [28.0, 36.0];
/// Satellites of a longer run, and of how many loop updates one is kept.
const SATELLITES: [&str; 5] = ["G03", "G06", "G07", "G08", "G10"];
const UPDATES: usize = 25;

/// A table of fewer rows with its segment repeated so often, each time as late as in a longer run.
fn repeated(text: &str, times: usize, every: usize) -> String {
    let (header, rows) = text.split_once('\n').unwrap();
    let place = |column: &str| header.split(',').position(|name| name == column);
    let (sample, sv) = (place("sample").unwrap(), place("sv"));
    let cell = |row: &str, place: usize| row.split(',').nth(place).unwrap().to_owned();
    let kept = |row: &&str| sv.is_none_or(|sv| SATELLITES.contains(&cell(row, sv).as_str()));
    let time_s = |row: &str| cell(row, sample).parse::<f64>().unwrap() / 2.6e6;
    let rows = rows.lines().filter(kept).step_by(every).map(|row| (time_s(row), row));
    let rows: Vec<(f64, &str)> = rows.filter(|(time_s, _)| *time_s < REPEATED_S[1]).collect();
    let by = |name: &str| COLUMNS.iter().find(|(column, _)| *column == name).map_or(0.0, |(_, by)| *by);
    let shifts: Vec<f64> = header.split(',').map(by).collect();
    let mut all = format!("{header}\n");
    for repetition in 0..=times {
        let later_s = repetition as f64 * (REPEATED_S[1] - REPEATED_S[0]);
        for (_, row) in rows.iter().filter(|(time_s, _)| repetition == 0 || *time_s >= REPEATED_S[0]) {
            let later = |(cell, by): (&str, &f64)| match cell.parse::<f64>() {
                Ok(value) if *by != 0.0 => (value + by * later_s).to_string(),
                _ => cell.to_owned(),
            };
            all += &(row.split(',').zip(&shifts).map(later).collect::<Vec<_>>().join(",") + "\n");
        }
    }
    all
}

/// A run whose tables have its segment so often more.
fn longer(run: &Path, to: &Path, times: usize) {
    for part in ["truth", "rx"] {
        fs::create_dir_all(to.join(part)).unwrap();
        for entry in fs::read_dir(run.join(part)).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            let text = fs::read_to_string(entry.path()).unwrap_or_default();
            let text = match name.as_str() {
                "observations.csv" | "sky.csv" | "trajectory.csv" | "fixes.csv" => repeated(&text, times, 1),
                "tracking.csv" => repeated(&text, times, UPDATES),
                "scene.json" => {
                    let mut scene: serde_json::Value = serde_json::from_str(&text).unwrap();
                    scene["duration_s"] = (REPEATED_S[1] + times as f64 * (REPEATED_S[1] - REPEATED_S[0])).into();
                    scene.to_string()
                }
                _ => text,
            };
            fs::write(to.join(part).join(name), text).unwrap();
        }
    }
}

#[test]
fn the_judge_holds_a_few_numbers_of_an_epoch() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    fs::write(place.join("short.toml"), scene(REPEATED_S[1], 1)).unwrap();
    peak_kib("run short.toml --out short --threads 2", place).unwrap();
    let of = |times: usize| {
        let name = format!("longer{times}");
        longer(&place.join("short"), &place.join(&name), times);
        peak_kib(&format!("analyze {name}"), place).unwrap()
    };
    // Two and forty minutes.
    let (few, many) = (15, 300);
    let (short_kib, long_kib) = (of(few), of(many));
    let fixes = fs::read_to_string(place.join(format!("longer{many}/position.csv"))).unwrap();
    assert!(fixes.lines().count() > 80 * many, "{} fixes are judged", fixes.lines().count());
    let epochs = (many - few) as f64 * (REPEATED_S[1] - REPEATED_S[0]) * 10.0;
    let epoch_bytes = 1024.0 * (long_kib - short_kib) / epochs;
    println!("{short_kib} KiB, {long_kib} KiB: {epoch_bytes:.0} bytes an epoch");
    assert!(epoch_bytes <= EPOCH_BYTES, "{epoch_bytes} bytes an epoch");
}
