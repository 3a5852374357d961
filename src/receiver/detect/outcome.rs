//! Outcome of the detectors of a reception: tests, alarms and the first alarm of each.

use std::fmt;

use serde::Serialize;

use gnss::record::Detector;

/// Count of one detector.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Counted {
    /// The detector.
    pub detector: Detector,
    /// Tests that were made.
    pub tests: u64,
    /// Tests above their threshold.
    pub alarms: u64,
    /// Time of the first of those, in seconds.
    pub first_alarm_s: Option<f64>,
}

/// Tests and alarms of the detectors of jamming and spoofing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Detected {
    /// Probability that one test raises a false alarm.
    pub false_alarm: f64,
    /// Each detector that tested anything.
    pub detectors: Vec<Counted>,
}

impl fmt::Display for Detected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tests: u64 = self.detectors.iter().map(|counted| counted.tests).sum();
        let alarms: Vec<&Counted> = self.detectors.iter().filter(|counted| counted.alarms > 0).collect();
        write!(f, "detection: ")?;
        if alarms.is_empty() {
            return write!(f, "no alarm in {tests} tests");
        }
        for (place, counted) in alarms.iter().enumerate() {
            let Counted { detector, tests, alarms, first_alarm_s } = counted;
            let comma = if place > 0 { ", " } else { "" };
            write!(f, "{comma}{} {alarms} of {tests}", detector.name())?;
            first_alarm_s.map_or(Ok(()), |s| write!(f, " (first at {s:.1} s)"))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alarms_are_named_with_their_first_time() {
        let counted = |detector, alarms, first_alarm_s| Counted { detector, tests: 40, alarms, first_alarm_s };
        let mut detected = Detected { false_alarm: 1e-3, detectors: vec![counted(Detector::Level, 0, None)] };
        assert_eq!(detected.to_string(), "detection: no alarm in 40 tests");
        detected.detectors.push(counted(Detector::Cn0Fall, 3, Some(31.0)));
        detected.detectors.push(counted(Detector::Raim, 1, Some(35.0)));
        let text = "detection: cn0_fall 3 of 40 (first at 31.0 s), raim 1 of 40 (first at 35.0 s)";
        assert_eq!(detected.to_string(), text);
    }
}
