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
