//! Jammers against an array with a spatial filter and against its first element alone, through samples,
//! receiver and judge.

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
        let row: std::collections::HashMap<String, String> = row.unwrap();
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
