//! A spoofer that takes the receiver along, through samples, receiver and judge.

use serde_json::Value;

use super::ran_shipped;

#[test]
fn a_drag_off_is_followed_while_the_truth_says_otherwise() {
    let (_directory, run, summary) = ran_shipped("spoofed");
    let number = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN);
    // 5 m/s from 35 s on, half a second lost to the acceleration, to the end at 75 s.
    let claimed_m = number("/spoofing/claimed_displacement_max_m");
    assert!((claimed_m - 187.5).abs() < 1.0, "{claimed_m}");
    // The fixes go there: their own error is a metre, the carrier smoothing lags by none.
    assert!((number("/spoofing/displacement_max_m") - claimed_m).abs() < 5.0, "{summary}");
    assert!(number("/spoofing/captured_share") > 0.99, "{summary}");
    assert!(number("/spoofing/from_claim_p95_m") < 5.0, "{summary}");
    // The authentic truth stays where it is, and the judge says how far the receiver went.
    assert!(number("/position/horizontal_p95_m") > 100.0, "{summary}");
    assert_eq!(number("/tracking/losses_of_lock"), 0.0, "{summary}");
    assert!(run.join("spoofing.png").is_file() && run.join("truth/spoofed.csv").is_file());
    // The report's first page has the measured errors, and beside them those of the fixes that are judged.
    let page = std::fs::read_to_string(run.join("report.html")).unwrap();
    for (name, pointer) in [
        ("horizontal error, 95 %", "/position/horizontal_p95_m"),
        ("vertical error, 95 %", "/position/vertical_p95_m"),
        ("velocity error, 95 %", "/position/velocity_p95_mps"),
    ] {
        let (_, row) = page.split_once(&format!("<td>{name}</td>")).unwrap();
        let cells = row.split("<td").skip(1).filter_map(|cell| cell.split_once('>')?.1.split([' ', '<']).next());
        let values: Vec<f64> = cells.take(2).map(|text| text.parse().unwrap()).collect();
        // Four digits are printed.
        assert!((values[0] / number(pointer) - 1.0).abs() < 1e-3, "{name}: {values:?}");
        assert!(values[1] < 0.1 * values[0] || name != "horizontal error, 95 %", "{name}: {values:?}");
    }
    assert!(page.contains("whose errors may have any size"));
}

#[test]
fn a_time_pushed_off_is_captured_at_a_place_that_nobody_pushed() {
    // The spoofer's clock meets the true one where it comes on, and gains 1.41e-6 s until the end.
    let pushed = include_str!("../../scenarios/spoofed.toml");
    let (before, _) = pushed.split_once("[spoofer.drag]").unwrap();
    let push = "clock_bias_s = -8.4e-7\nclock_drift_sps = 3e-8\n";
    let text = format!("{before}{push}");
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("pushed.toml");
    std::fs::write(&scene, text).unwrap();
    let ran = super::ran(&scene);
    let run = ran.path().join("reports/spoofed");
    let summary: Value = serde_json::from_slice(&std::fs::read(run.join("summary.json")).unwrap()).unwrap();
    let number = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN);
    // 47 s at 3e-8 s/s, 9 m/s.
    let claimed_m = number("/spoofing/claimed_clock_max_m");
    assert!((claimed_m - 422.7).abs() < 1.0, "{claimed_m}");
    assert_eq!(number("/spoofing/claimed_displacement_max_m"), 0.0, "{summary}");
    // While the channels go over one by one, within the ramp of 4 s, a fix mixes two clocks. After it nothing
    // moves the place: 5 m are four sigma of a fix.
    let position = std::fs::read_to_string(run.join("position.csv")).unwrap();
    assert!(position.starts_with("sample,time_s,east_m,north_m,up_m,"), "{position}");
    let rows =
        position.lines().skip(1).map(|line| line.split(',').skip(1).take(4).map(|cell| cell.parse::<f64>().unwrap()));
    let settled: Vec<f64> = rows
        .map(|row| row.collect::<Vec<_>>())
        .filter(|row| row[0] > 36.0)
        .map(|row| libm::hypot(libm::hypot(row[1], row[2]), row[3]))
        .collect();
    assert!(settled.len() > 350 && settled.iter().all(|error_m| *error_m < 5.0), "{settled:?}");
    assert!(number("/spoofing/captured_share") > 0.9, "{summary}");
    // Codes are off by as much, and no more than the claim explains.
    let verdict = std::fs::read_to_string(run.join("verdict.csv")).unwrap();
    let row = verdict.lines().find(|line| line.contains("code error where any is expected")).unwrap();
    assert!(row.contains(",pass,"), "{row}");
}
