//! Jammers against an array with a spatial filter and against its first element alone, attitude and phases of
//! channels by the elements' carriers, and a spoofer's direction: through samples, receiver and judge.

use std::collections::HashMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Runs a scene, and returns its verdict and the times of its fixes in seconds.
fn run(scenario: &Path, directory: &Path) -> (String, Vec<f64>, Value) {
    let output = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
        .arg("run")
        .arg(scenario)
        .args(["--out", "run"])
        .current_dir(directory)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let run = directory.join("run");
    let mut fixes = csv::Reader::from_path(run.join("rx/fixes.csv")).unwrap();
    let times_s = fixes.deserialize().map(|row| {
        let row: HashMap<String, String> = row.unwrap();
        row["sample"].parse::<f64>().unwrap() / 2.6e6
    });
    let times_s = times_s.collect();
    let receiver = serde_json::from_slice(&std::fs::read(run.join("rx/receiver.json")).unwrap()).unwrap();
    (std::fs::read_to_string(run.join("verdict.csv")).unwrap(), times_s, receiver)
}

#[test]
fn a_spatial_filter_holds_the_fix_under_jammers_that_take_every_satellite_from_one_element() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/array_jammed.toml");
    let directory = tempfile::tempdir().unwrap();
    let (verdict, times_s, receiver) = run(&scenario, directory.path());
    assert!(!verdict.lines().any(|line| line.contains(",fail,")), "{verdict}");
    // What the weights leave of every satellite is what the exact covariance says.
    let bias = verdict.lines().find(|line| line.starts_with("\"C/N0 bias") || line.starts_with("C/N0 bias")).unwrap();
    assert!(bias.contains(",pass,"), "{bias}");
    let within = |times_s: &[f64], from_s: f64, to_s: f64| {
        times_s.iter().filter(|time_s| (from_s..to_s).contains(*time_s)).count()
    };
    // Ten fixes a second, with one jammer and with three.
    assert!(within(&times_s, 30.0, 45.0) >= 149 && within(&times_s, 55.0, 70.0) >= 149, "{}", times_s.len());
    let number = |pointer: &str| receiver.pointer(pointer).and_then(Value::as_f64).unwrap();
    assert_eq!([number("/array/elements"), number("/array/blocks")], [7.0, 7500.0]);
    assert!(number("/array/rejected_db") > 25.0);
    assert!(directory.path().join("run/array.png").is_file());

    let text = std::fs::read_to_string(&scenario).unwrap();
    let alone = text.replacen("filter = \"power_inversion\"", "filter = \"none\"", 1);
    // As long as the first jammer is on.
    let alone = alone.replacen("duration_s = 75", "duration_s = 45", 1);
    let alone = alone.split("[[interference]] # the same position again").next().unwrap();
    let directory = tempfile::tempdir().unwrap();
    let scenario = directory.path().join("alone.toml");
    std::fs::write(&scenario, alone).unwrap();
    let (_, times_s, receiver) = run(&scenario, directory.path());
    assert!(within(&times_s, 25.0, 30.0) >= 49 && within(&times_s, 30.5, 45.0) == 0, "{}", times_s.len());
    assert_eq!(receiver.pointer("/array/filter").and_then(Value::as_str), Some("none"));
}

/// Rows of a table as numbers by their columns; what is no number is left out.
fn rows(path: &Path) -> Vec<HashMap<String, f64>> {
    let mut table = csv::Reader::from_path(path).unwrap();
    let numbers = |row: HashMap<String, String>| {
        let number = |(key, value): (String, String)| Some((key, value.parse::<f64>().ok()?));
        row.into_iter().filter_map(number).collect()
    };
    table.deserialize().map(|row| numbers(row.unwrap())).collect()
}

/// The scene says yaw 137, pitch 4, roll −6 degrees; phases of 70 and −155 degrees; 0.2 ns late; nothing.
#[test]
fn carriers_of_the_elements_give_the_attitude_and_the_phases_of_cables() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/array_calibration.toml");
    let directory = tempfile::tempdir().unwrap();
    let (verdict, times_s, _) = run(&scenario, directory.path());
    assert!(!verdict.lines().any(|line| line.contains(",fail,")), "{verdict}");
    for figure in ["attitude error over its deviation", "stated deviation of the attitude over theory"] {
        assert!(verdict.lines().any(|line| line.contains(figure) && line.contains(",pass,")), "{figure}: {verdict}");
    }
    let attitudes = rows(&directory.path().join("run/rx/attitude.csv"));
    assert!(attitudes.len() as f64 >= (50.0 - times_s[0]).floor(), "{} from {} s on", attitudes.len(), times_s[0]);
    for row in &attitudes {
        let off_deg = [row["yaw_deg"] - 137.0, row["pitch_deg"] - 4.0, row["roll_deg"] + 6.0];
        assert!(off_deg.iter().all(|off| off.abs() < 0.15), "{row:?}");
    }
    let late_deg = -360.0 * 0.2e-9 * 1_575.42e6;
    let channels_deg = [70.0, late_deg, -155.0, 0.0];
    let elements = rows(&directory.path().join("run/rx/elements.csv"));
    assert_eq!(elements.len(), 4 * attitudes.len());
    for row in elements {
        let off_deg = row["phase_deg"] - channels_deg[row["element"] as usize - 2];
        assert!(off_deg.abs() < 2.0, "{row:?}");
    }

    // A receiver that states what is not so does not pass.
    let directory = directory.path();
    for (table, change, figure) in SABOTAGED {
        let path = directory.join("run/rx").join(table);
        let sound = std::fs::read_to_string(&path).unwrap();
        let changed = |(number, line): (usize, &str)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            (number == 0 || change(number, &mut cells)).then(|| cells.join(",") + "\n")
        };
        std::fs::write(&path, sound.lines().enumerate().filter_map(changed).collect::<String>()).unwrap();
        let judged = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
            .args(["analyze", "run"])
            .current_dir(directory)
            .output()
            .unwrap();
        assert!(judged.status.success(), "{}", String::from_utf8_lossy(&judged.stderr));
        std::fs::write(&path, sound).unwrap();
        let verdict = std::fs::read_to_string(directory.join("run/verdict.csv")).unwrap();
        let is_refused = |line: &str| line.contains(figure) && line.contains(",fail,");
        assert!(verdict.lines().any(is_refused), "{figure}: {verdict}");
    }
}

/// Change of the cells of a row, by its number; false leaves the row out.
type Change = fn(usize, &mut [String]) -> bool;

/// Tables with changes of their rows, and the figure that refuses each.
const SABOTAGED: [(&str, Change, &str); 4] = [
    ("attitude.csv", |_, cells| add(cells, 1, 0.2), "attitude error over its deviation"),
    ("attitude.csv", |_, cells| (4..7).all(|column| times(cells, column, 1.3)), "stated deviation of the attitude"),
    ("attitude.csv", |number, _| number % 4 != 0, "intervals with an attitude"),
    ("elements.csv", |_, cells| add(cells, 3, 3.0), "phases of the elements' channels over their deviation"),
];

fn add(cells: &mut [String], column: usize, more: f64) -> bool {
    cells[column] = (cells[column].parse::<f64>().unwrap() + more).to_string();
    true
}

fn times(cells: &mut [String], column: usize, factor: f64) -> bool {
    cells[column] = (cells[column].parse::<f64>().unwrap() * factor).to_string();
    true
}

/// The spoofer begins at 55 s, 20 dB below the true signals, and is 6 dB above them 4 s later.
#[test]
fn signals_of_one_direction_raise_an_alarm_and_those_of_satellites_do_not() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/array_spoofed.toml");
    let directory = tempfile::tempdir().unwrap();
    let (verdict, _, _) = run(&scenario, directory.path());
    assert!(!verdict.lines().any(|line| line.contains(",fail,")), "{verdict}");
    let text = std::fs::read_to_string(directory.path().join("run/rx/detection.csv")).unwrap();
    let tests = text.lines().filter(|line| line.contains(",directions,")).map(|line| {
        let (sample, rest) = line.split_once(',').unwrap();
        (sample.parse::<f64>().unwrap() / 2.6e6, rest.ends_with(",true"))
    });
    let tests: Vec<(f64, bool)> = tests.collect();
    let count = |from_s: f64, to_s: f64, alarm: bool| {
        tests.iter().filter(|(time_s, own)| (from_s..to_s).contains(time_s) && *own == alarm).count()
    };
    assert!(count(0.0, 56.0, false) >= 30 && count(0.0, 56.0, true) == 0, "{tests:?}");
    assert!(count(59.0, 76.0, true) >= 16 && count(59.0, 76.0, false) == 0, "{tests:?}");
    // Nothing is stated of a body that the signals do not show.
    let attitudes = rows(&directory.path().join("run/rx/attitude.csv"));
    assert!(attitudes.iter().all(|row| row["sample"] / 2.6e6 < 59.0 && (row["yaw_deg"] - 20.0).abs() < 2.0));
}
