use num_complex::Complex64;

use super::random::Normal;
use super::*;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;

/// Correlations of a second of updates of 4 ms.
fn shape(normal: &mut Normal, amplitude: f64) -> Shape {
    let mut shape = Shape::default();
    for _ in 0..250 {
        let mut noise = || Complex64::new(normal.draw(), normal.draw());
        shape.add(amplitude + noise(), [0.75 * amplitude + noise(), 0.75 * amplitude + noise()], 4e-3);
    }
    shape
}

/// Alarms of a detector, by the second at the end of its interval; `of` is the amplitude of a signal in a
/// second.
fn alarms(detector: Detector, of: impl Fn(u8, u64) -> f64) -> Vec<u64> {
    let settings = Settings { detection: Some(DetectionSettings::default()), ..Settings::default() };
    let rate = Rate::from_hz(2.6e6).unwrap();
    let mut detection = Detection::new(&settings, Noises::new(), rate, 1).unwrap();
    let mut normal = Normal::new(11);
    let mut records: Vec<Record> = Vec::new();
    for second in 1..=60 {
        let sample = second * 2_600_000;
        assert!(detection.is_due(sample) && !detection.is_due(sample - 1));
        for number in 1..=7 {
            let shape = shape(&mut normal, of(number, second));
            detection.take_shape(L1_CA.link(Sv::gps(number)), shape, 130.0 * f64::from(number));
        }
        detection.close(sample, &mut records).unwrap();
    }
    let row = |record: &Record| match record {
        Record::Detection(row) if row.detector == detector && row.alarm => Some(row.sample / 2_600_000),
        _ => None,
    };
    records.iter().filter_map(row).collect()
}

#[test]
fn a_fall_that_most_signals_share_is_reported_while_it_lasts_and_that_of_one_is_not() {
    let fallen = |second: u64| if (30..50).contains(&second) { 11.3 } else { 15.9 };
    let most = alarms(Detector::Cn0Fall, |number, second| if number < 5 { fallen(second) } else { 15.9 });
    assert_eq!(most, (30..50).collect::<Vec<_>>());
    let few = alarms(Detector::Cn0Fall, |number, second| if number < 2 { fallen(second) } else { 15.9 });
    assert!(few.is_empty(), "{few:?}");
}

#[test]
fn no_detection_is_asked_for_by_default() {
    let settings = Settings::default();
    assert!(Detection::new(&settings, Noises::new(), Rate::from_hz(1e6).unwrap(), 1).is_none());
}

#[test]
fn counts_are_those_of_the_rows() {
    let settings = Settings { detection: Some(DetectionSettings::default()), ..Settings::default() };
    let mut detection = Detection::new(&settings, Noises::new(), Rate::from_hz(1e6).unwrap(), 1).unwrap();
    let mut records: Vec<Record> = Vec::new();
    for (second, statistic) in [(1, 3.0), (2, 80.0), (3, 4.0)] {
        detection.take_residuals(Some((statistic, 5)));
        detection.take_residuals(None);
        detection.close(second * 1_000_000, &mut records).unwrap();
    }
    let found = detection.outcome().detectors;
    let raim = Counted { detector: Detector::Raim, tests: 3, alarms: 1, first_alarm_s: Some(2.0) };
    assert_eq!((found, records.len()), (vec![raim], 3));
    // A missing epoch is no test.
    detection.close(4_000_000, &mut records).unwrap();
    assert_eq!(records.len(), 3);
}
