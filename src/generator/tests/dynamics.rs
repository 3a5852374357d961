//! The motion along lines of sight of the shipped scenes.

use std::path::Path;

use crate::dynamics::*;
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use crate::stream::{Options, generate_with};
use crate::truth;
use gnss::satellite::Sv;

fn lines(text: &str) -> (Scene, Vec<LineOfSight>) {
    let scenario = Scenario::parse(text, "lines").unwrap();
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let (scene, _) = scenario.compose(&directory, &Overrides::default()).unwrap();
    let lines = lines_of_sight(&scene).unwrap();
    (scene, lines)
}

#[test]
fn a_rocket_s_lines_of_sight_have_its_thrust_and_its_ramp_and_a_place_at_rest_has_neither() {
    let (_, lines) = lines(include_str!("../../../scenarios/high_dynamics.toml"));
    // The rocket flies towards G23: jerk 196 m/s³ along the line of sight within the cosine of 10°, and
    // of its thrust, 225 m/s², gravity (9.8) and drag take at most 30.
    let line = lines.iter().find(|line| line.sv == Sv::gps(23)).unwrap();
    assert!((190.0..206.0).contains(&line.jerk_mps3), "{line:?}");
    assert!((195.0..225.0).contains(&line.acceleration_mps2), "{line:?}");
    assert!(line.swing_mps2 >= line.acceleration_mps2 && (39.9..46.3).contains(&line.jerk_s), "{line:?}");
    // No other line of sight has more than the motion itself, 196 m/s³ and the drag's growth.
    assert!(lines.len() > 8 && lines.iter().all(|other| other.jerk_mps3 < 210.0), "{lines:?}");
    let (_, rest) = self::lines(include_str!("../../../scenarios/static.toml"));
    // A GPS satellite's range accelerates by at most 0.18 m/s².
    assert!(rest.len() > 8 && rest.iter().all(|line| line.jerk_mps3 == 0.0 && line.acceleration_mps2 < 0.18));
}

#[test]
fn the_satellites_share_is_the_second_difference_of_the_true_range() {
    let (scene, lines) = lines(include_str!("../../../scenarios/static.toml"));
    let middle_s = 0.5 * scene.clock.rate.elapsed_s(scene.samples);
    for line in lines.iter().take(4) {
        let range_m = |t_s: f64| {
            let local = scene.clock.start.plus_s(t_s);
            let seen = truth::seen(&scene, line.sv, scene.signals[0], local).unwrap().unwrap();
            seen.emission.sight.range_m
        };
        let h_s = 10.0;
        let second = (range_m(middle_s + h_s) - 2.0 * range_m(middle_s) + range_m(middle_s - h_s)) / (h_s * h_s);
        // Light time lengthens the range by 1e-5, gravity is that of a point (1e-3 m/s²), and over a
        // minute the acceleration itself moves by 2e-5 m/s³ · 30 s.
        assert!((line.acceleration_mps2 - second.abs()).abs() < 2e-3, "{line:?} {second}");
    }
}

#[test]
fn rows_by_the_thousand_describe_the_same_signal_as_few() {
    let directory = tempfile::tempdir().unwrap();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let scene = include_str!("../../../scenarios/trajectory_file.toml").replace("duration_s = 60", "duration_s = 1.5");
    // 30 m/s along a straight line. Nodes of a satellite's curve are as dense as rows, and beyond five a
    // second its orbit is a polynomial that they share.
    let samples = |rows_a_second: u32| {
        let rows = (0..=4 * rows_a_second).map(|row| {
            let t_s = f64::from(row) / f64::from(rows_a_second) - 1.0;
            format!("{t_s},{},{},{}\n", 970_500.0 + 18.0 * t_s, 5_628_000.0 - 24.0 * t_s, 2_830_200.0)
        });
        let file = directory.path().join(format!("{rows_a_second}.csv"));
        std::fs::write(&file, format!("time_s,x_m,y_m,z_m\n{}", rows.collect::<String>())).unwrap();
        let scenario = Scenario::parse(&scene.replace("ride.csv", file.to_str().unwrap()), "rows").unwrap();
        let overrides = Overrides { allow_outside: true, ..Overrides::default() };
        let (scene, _) = scenario.compose(&shipped, &overrides).unwrap();
        let truths = tempfile::tempdir().unwrap();
        let mut truth = truth::Writer::create(truths.path()).unwrap();
        let mut bytes = Vec::new();
        generate_with(&scene, &mut bytes, &mut truth, &mut |_| (), &Options::default()).unwrap();
        bytes
    };
    let few = samples(1);
    for rows_a_second in [50, 1000] {
        let many = samples(rows_a_second);
        let steps = || few.iter().zip(&many).map(|(a, b)| (*a as i8).abs_diff(*b as i8)).filter(|step| *step > 0);
        println!("{rows_a_second} rows a second: {} of {} bytes differ", steps().count(), few.len());
        // A phase is right to 2e-5 cycles by either, and 1e-4 of the amplitude brings few values over a
        // step's edge: noise of ten steps lies that near one in a share of 1e-4 at most.
        assert!(many.len() == few.len() && steps().count() < few.len() / 10_000, "{rows_a_second}");
        assert!(steps().all(|step| step == 1), "{rows_a_second}");
    }
}
