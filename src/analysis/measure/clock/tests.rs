//! The clock of a run made by hand: an oscillator of known noise, and a receiver of known error.

use super::*;
use crate::expect::theory::clock::PowerLaw;
use crate::hand_made::{Draw, PLANTED, RATE_HZ, planted_run, write};
use crate::judge;
use gnss::record::{Fix, TrajectoryRow};
use std::fs;
use std::path::Path;

#[test]
fn the_longest_stretch_without_a_gap_is_taken_though_an_interval_is_no_whole_number_of_samples() {
    assert_eq!(longest_even(&[0, 3, 7, 10, 20, 23, 27, 30, 33, 50]), 4..9);
    assert_eq!(longest_even(&[5, 10, 15, 20]), 0..4);
    assert_eq!((longest_even(&[]), longest_even(&[9])), (0..0, 0..1));
}

#[test]
fn a_line_goes_through_the_middle_with_the_slope_of_least_squares() {
    let line = Line::through(&[0.0, 1.0, 2.0], &[1.0, 2.0, 6.0]).unwrap();
    assert!((line.slope - 2.5).abs() < 1e-15 && (line.at(1.0) - 3.0).abs() < 1e-15);
    assert_eq!(Line::through(&[1.0], &[1.0]), None);
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Vec<T> {
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

/// White frequency noise alone: 1e-10 at 1 s.
const H0: f64 = 2e-20;
const DRIFT: f64 = 3e-7;
/// Error of the receiver's time, independent from fix to fix.
const ERROR_S: f64 = 2e-12;

/// A run whose clock drifts and walks, with a fix missing at tick 400.
fn walking_run() -> tempfile::TempDir {
    let run = planted_run(&PLANTED);
    let (truth, rx) = (run.path().join("truth"), run.path().join("rx"));
    let mut draw = Draw(4);
    let mut trajectory: Vec<TrajectoryRow> = read(&truth.join("trajectory.csv"));
    // A step of the phase over τ₀ has the variance h₀ τ₀/2.
    let mut walk_s = 0.0;
    for (tick, row) in trajectory.iter_mut().enumerate() {
        row.clock_bias_s = 0.011 + DRIFT * 0.1 * tick as f64 + walk_s;
        walk_s += (H0 * 0.1 / 2.0_f64).sqrt() * draw.normal();
    }
    write(&truth.join("trajectory.csv"), &trajectory);
    let mut fixes: Vec<Fix> = read(&rx.join("fixes.csv"));
    for fix in &mut fixes {
        let true_row = &trajectory[(fix.sample * 10 / RATE_HZ) as usize];
        let time = true_row.time().plus_s(ERROR_S * draw.normal() - 5e-9);
        (fix.gps_s, fix.gps_fraction_s) = (time.seconds(), time.fraction());
    }
    fixes.retain(|fix| fix.sample != 400 * RATE_HZ / 10);
    write(&rx.join("fixes.csv"), &fixes);
    let path = truth.join("scene.json");
    let mut scene: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    scene["oscillator"] = serde_json::json!({"kind": "named", "h": [0.0, 0.0, H0, 0.0, 0.0]});
    fs::write(&path, scene.to_string()).unwrap();
    run
}

#[test]
fn the_clock_that_was_planted_is_found_and_told_from_the_receiver_s_error() {
    let directory = walking_run();
    let summary = judge(directory.path()).unwrap();
    let clock = &summary.clock;
    // Ticks 401 to 599: longer than 300 to 399.
    assert_eq!(clock.fixes, 199);
    // Five standard deviations of a mean of 199; a time that is 5 ns early is a clock 5 ns fast. Epochs
    // resolve 1.1e-16 s.
    assert!((clock.bias_mean_s.unwrap() - 5e-9).abs() < 5.0 * ERROR_S / 199.0_f64.sqrt());
    assert!((clock.bias_sigma_s.unwrap() / ERROR_S - 1.0).abs() < 5.0 / (2.0 * 199.0_f64).sqrt());
    // The mean frequency of white frequency noise over 20 s is known to √(h₀/2/20 s) = 2.2e-11; a fit's slope
    // is 6/5 of that in variance. The receiver finds the same walk, to √12 ERROR_S/(20 s √199) = 2.5e-14.
    let (drift, true_drift) = (clock.drift.unwrap(), clock.true_drift.unwrap());
    assert!((true_drift - DRIFT).abs() < 5.0 * 2.5e-11, "{true_drift:e}");
    assert!((drift - true_drift).abs() < 5.0 * 2.5e-14, "{drift:e} {true_drift:e}");
    // The oscillator's theory lies within the interval of what the truth shows: 95 %, and this seed's six
    // points are in.
    let read = Run::read(directory.path()).unwrap();
    let measured = Clock::measure(&read, &Errors::measure(&read).unwrap()).unwrap();
    let law = measured.oscillator.unwrap();
    assert_eq!(law, PowerLaw { h: [0.0, 0.0, H0, 0.0, 0.0] });
    let truth = measured.series(Of::Truth).unwrap();
    let points = truth.curve(Deviation::Oadev);
    // 600 phases 0.1 s apart: to a quarter of a minute.
    assert_eq!(points.iter().map(|point| point.m).collect::<Vec<_>>(), [1, 2, 4, 10, 20, 40, 100]);
    for point in points {
        let (low, high) = point.interval.unwrap();
        let expected = law.allan_variance(point.tau_s, truth.cutoff_hz()).sqrt();
        assert!((low..high).contains(&expected), "{} s: {low:e} {expected:e} {high:e}", point.tau_s);
    }
    // σ² of 0.1 s is known to 1/√(edf/2) = 1/√200; four times that.
    let h = clock.true_h.unwrap();
    assert!((h[2] / H0 - 1.0).abs() < 0.28 && h.iter().filter(|h| **h > 0.0).count() == 1, "{h:?}");
    // Phases of the error are independent: √3 ERROR_S/1 s, known to 1/√(2 edf) with edf ≈ 199/2: four times
    // that.
    let error = measured.series(Of::Error).unwrap().at(Deviation::Oadev, 1.0).unwrap();
    assert!((error.deviation / (3.0_f64.sqrt() * ERROR_S) - 1.0).abs() < 0.28, "{:e}", error.deviation);
    assert_eq!(error.alpha, None, "20 phases that are 1 s apart do not show a noise");
}

#[test]
fn the_clock_s_files_hold_every_fix_and_every_deviation() {
    let directory = walking_run();
    let summary = judge(directory.path()).unwrap();
    let text = |name: &str| fs::read_to_string(directory.path().join(name)).unwrap();
    let clock = text("clock.csv");
    assert_eq!(clock.lines().next(), Some("sample,time_s,estimate_s,truth_s,error_s,detrended_s"));
    assert_eq!(clock.lines().count(), 1 + summary.clock.fixes);
    let allan = text("allan.csv");
    assert_eq!(allan.lines().next(), Some("series,deviation,tau_s,value,low,high,terms,alpha,freedom"));
    for series in ["estimate", "truth", "error"] {
        for deviation in Deviation::ALL {
            assert!(allan.lines().any(|line| line.starts_with(&format!("{series},{},0.1,", deviation.name()))));
        }
    }
    let report = summary.to_string();
    assert!(report.contains("clock         drift +") && report.contains("Allan, 1 s"), "{report}");
}
