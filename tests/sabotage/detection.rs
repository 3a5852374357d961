//! Planted alarms of the receiver's detectors while nobody jams or spoofs.

use std::fmt::Write;

use crate::Kind;
use crate::fixes::kind;
use crate::run::{Rx, Scene};

const LEVEL: [&str; 1] = ["false alarms of level, at least"];

/// Adds 1000 tests of the level within the run, a share of which raise an alarm, evenly spaced.
fn plant(rx: &mut Rx, share: f64) {
    rx.receiver()["settings"]["detection"] =
        serde_json::json!({ "false_alarm": 1e-3, "interval_s": 0.05, "reference_s": 1.0 });
    let mut text = "sample,detector,sv,signal,statistic,threshold,alarm\n".to_owned();
    let alarms = (1000.0 * share).round() as usize;
    for row in 0..1000 {
        let is_alarm = row * alarms / 1000 != (row + 1) * alarms / 1000;
        let statistic = if is_alarm { 4.0 } else { 0.5 };
        writeln!(text, "{},level,,,{statistic},3.29,{is_alarm}", 130_000 * (row + 1)).unwrap();
    }
    rx.add("detection.csv", &text);
}

pub fn kinds() -> Vec<Kind> {
    vec![kind!("a share of false alarms of a detector", "of 1", Some(1e-3), 0.01, &LEVEL, AtRest, |rx, share| {
        plant(rx, share);
    })]
}
