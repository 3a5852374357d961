//! An issue that names two sets: numbers of four bits come again after hours, here after minutes.

use std::fs;
use std::path::Path;
use std::process::Command;

/// GPS, and the one satellite of NavIC that sends L1, without samples.
const SCENE: &str = r#"
name = "again"
start = 2026-03-09T10:02:00
duration_s = 1000
seed = 1
signals = ["GPS L1 C/A", "NavIC L1"]
motion = { kind = "static", latitude_deg = 26.5123, longitude_deg = 80.2329, height_m = 130 }
navigation = { file = ["sky.rnx", "again.rnx"] }
satellites = { mask_deg = 5 }
truth = { interval_s = 1 }
noise = {}
receiver_clock = { bias_s = 1.3e-4, drift_sps = 5e-8 }
fidelity = { level = "observations" }
[receiver.position]
ionosphere = "none"
troposphere = "none"
[receiver.operation]
measurement_interval_ms = 1000
tracking_interval_ms = 1000
[front_end]
center_hz = 1575.42e6
sample_rate_hz = 5.2e6
format = "ci8"
"#;

const RATE_HZ: f64 = 5.2e6;

/// Times in seconds of the satellite's rows in a table, each once, with their issues.
fn sets(table: &str) -> Vec<(f64, u32)> {
    let of = |line: &str| {
        let mut cells = line.split(',');
        let (sample, sv, issue) = (cells.next()?, cells.next()?, cells.next()?);
        (sv == "I10").then_some((sample.parse::<f64>().ok()? / RATE_HZ, issue.parse().ok()?))
    };
    let mut sets: Vec<(f64, u32)> = table.lines().filter_map(of).filter(|(_, issue)| *issue != 0).collect();
    sets.sort_by(|a, b| a.0.total_cmp(&b.0));
    sets.dedup();
    sets
}

/// Rows of the verdict that failed.
fn failed(directory: &Path, arguments: &[&str]) -> Vec<String> {
    let done = Command::new(env!("CARGO_BIN_EXE_gnss-twin")).args(arguments).current_dir(directory).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let verdict = fs::read_to_string(directory.join("run/verdict.csv")).unwrap();
    verdict.lines().filter(|line| line.contains(",fail,")).map(str::to_owned).collect()
}

/// The second set has the first one's issue and a clock that is 1 µs ahead, 300 m.
#[test]
fn of_two_sets_of_one_issue_the_newest_that_was_due_counts() {
    let shipped = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name);
        fs::read_to_string(path).unwrap()
    };
    let sound = shipped("navic_2026-03-09_10h_12h.rnx");
    let second =
        "I10 2026 03 09 10 05 36 6.586313247681e-05 3.251443558838e-11 0.000000000000e+00\n     2.010000000000e+02";
    let again =
        "I10 2026 03 09 10 05 36 6.686313247681e-05 3.251443558838e-11 0.000000000000e+00\n     2.000000000000e+02";
    assert!(sound.contains(second));
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    fs::write(directory.join("again.rnx"), sound.replace(second, again)).unwrap();
    fs::write(directory.join("sky.rnx"), shipped("full_sky_2026-03-09_10h_12h.rnx")).unwrap();
    fs::write(directory.join("again.toml"), SCENE).unwrap();
    let run = ["run", "again.toml", "--out", "run", "--report", "none", "--quiet"];
    assert_eq!(failed(directory, &run), Vec::<String>::new());

    // By the file the second set is sent from 10:09:00 on; each is read within a sub-frame's repetition of
    // 18 s.
    let path = directory.join("run/truth/navigation.csv");
    let truth = fs::read_to_string(&path).unwrap();
    assert_eq!(sets(&truth), [(0.0, 8), (420.0, 8)]);
    let read = sets(&fs::read_to_string(directory.join("run/rx/navigation.csv")).unwrap());
    let (times_s, issues): (Vec<f64>, Vec<u32>) = read.into_iter().unzip();
    assert_eq!(issues, [8, 8], "{times_s:?}");
    assert!(times_s[0] < 60.0 && (420.0..460.0).contains(&times_s[1]), "{times_s:?}");

    // A truth that says the second set to be due at the end leaves the first, which is 300 m off.
    let due = (420.0 * RATE_HZ) as u64;
    let late = (1000.0 * RATE_HZ) as u64 - 1;
    assert!(truth.contains(&format!("\n{due},I10,")));
    fs::write(&path, truth.replace(&format!("\n{due},I10,"), &format!("\n{late},I10,"))).unwrap();
    let found = failed(directory, &["analyze", "run"]);
    assert!(found.iter().any(|line| line.contains("offset error")), "{found:?}");
}
