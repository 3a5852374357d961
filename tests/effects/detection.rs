//! A jammer and a spoofer against the receiver's detectors, through samples, receiver and judge.

use serde_json::Value;

use super::ran_shipped;

#[test]
fn a_jammer_and_a_spoofer_are_detected_and_a_clean_sky_raises_no_more_alarms_than_stated() {
    let (_directory, run, summary) = ran_shipped("detection");
    let number = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN);
    assert_eq!([number("/detection/attacks"), number("/detection/attacks_detected")], [2.0, 2.0], "{summary}");
    // The jammer has 1.9 times the power of the noise in 2.6 MHz, the spoofer half of it.
    assert_eq!(number("/detection/detectors/level/attacks_detected"), 2.0);
    assert!(number("/detection/detectors/level/roc_area") > 0.9);
    // 5 dB of C/N0 are noticed in the first whole second.
    assert!(number("/detection/detectors/cn0_fall/attacks_detected") >= 1.0);
    for file in ["detection.csv", "detection_labelled.csv", "roc.csv", "detection.png", "rx/detection.csv"] {
        assert!(run.join(file).is_file(), "{file}");
    }
    let verdict = std::fs::read_to_string(run.join("verdict.csv")).unwrap();
    let rows: Vec<&str> = verdict.lines().filter(|line| line.contains("false alarms of ")).collect();
    assert!(rows.len() >= 5 && rows.iter().all(|row| !row.contains("fail")), "{rows:?}");
    let table = std::fs::read_to_string(run.join("detection.csv")).unwrap();
    let signals = std::fs::read_to_string(run.join("detection_labelled.csv")).unwrap();
    for (label, numbered) in
        [(",clean", ",clean,"), (",jammed", ",jammed,1"), (",spoofed", ",spoofed,2"), (",after", ",after,")]
    {
        assert!(table.lines().any(|line| line.ends_with(label)), "{label}");
        assert!(signals.lines().any(|line| line.ends_with(numbered)), "{numbered}");
    }
}
