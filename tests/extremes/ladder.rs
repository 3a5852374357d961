//! The levels of fidelity and the accumulators over time, rate and dynamics: no error grows with time. And
//! how near to singular a position may be.

use std::fmt::Write;

use analysis::show::plot::canvas::{Axis, BLUE, COLOURS, Chart, GREEN, Mark, ORANGE, Series, figure};
use generator::fidelity::{Arithmetic, CodeEdge, Fidelity, Grade};
use generator::scene::Scene;
use generator::synth::band::Filter;
use generator::synth::isa::Level;
use generator::synth::{Edge, Kernel};
use generator::transmit::{Scratch, Transmitter};
use generator::vehicle::{Knot, Motion, Trajectory};
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;
use gnss::time::Epoch;
use receiver::correlate;

use crate::arithmetic::{sum_error, twin_error};
use crate::figures::{self, CA, Worst, case};
use crate::fuzz::{Period, phase_cycles};
use crate::run;

const LEVELS: [Grade; 3] = [Grade::Fast, Grade::Balanced, Grade::Reference];
const RUN: u64 = 4096;

/// Carrier error of a level at `places` code periods from `first` on, `apart_s` seconds from each to the
/// next: rms and worst.
fn carrier_error(scene: &Scene, grade: Grade, first: u64, places: u64, apart_s: f64) -> (f64, f64) {
    let sv = Sv::gps(23);
    let fidelity = Fidelity::of(grade);
    let filter = Filter::default();
    let edge = match fidelity.code_edge {
        CodeEdge::Nearest => Edge::Nearest,
        CodeEdge::Area => Edge::Area,
        CodeEdge::BandLimited => Edge::BandLimited(&filter),
    };
    let kernel = Kernel { edge, arithmetic: fidelity.carrier, level: Level::detect() };
    let mut transmitter = Transmitter::new(scene, sv, &L1_CA, edge).unwrap().unwrap();
    let (mut sum, mut worst) = (0.0, 0.0_f64);
    for k in 0..places {
        let near = first + (k as f64 * apart_s * scene.clock.rate.hz()) as u64;
        let period = Period::after(scene, sv, near).unwrap();
        let from = period.first / RUN * RUN;
        let count = (period.first + period.samples - from) as usize;
        transmitter.prepare(scene, from, from + count as u64).unwrap();
        let (mut i, mut q) = (vec![0.0_f32; count], vec![0.0_f32; count]);
        let mut scratch = Scratch::default();
        for (run, (i, q)) in (0_u64..).zip(i.chunks_mut(RUN as usize).zip(q.chunks_mut(RUN as usize))) {
            transmitter.arrange(scene, from + run * RUN, i.len(), &mut scratch);
            scratch.bank.render(kernel, i, q);
        }
        let lead = (period.first - from) as usize;
        let error = phase_cycles(period.prompt(scene, sv, &i[lead..], &q[lead..]));
        sum += error * error;
        worst = worst.max(error.abs());
    }
    ((sum / places as f64).sqrt(), worst)
}

/// The usual scene at a rate and a level, `before_s` seconds after its first sample when it is looked at.
fn scene(rate_hz: f64, grade: Grade, before_s: i64) -> (Scene, u64) {
    let tables = format!(
        "[front_end]\nsample_rate_hz = {rate_hz:e}\nformat = \"cf32\"\n[power]\ncn0_dbhz = 60\n[fidelity]\nlevel \
         = \"{}\"\n\
         [receiver_clock]\nbias_s = 1.3e-4\ndrift_sps = 5e-8\n",
        grade.name()
    );
    let mut scene = run::scene(60.0, &tables);
    scene.clock.start = Epoch::new(scene.clock.start.seconds() - before_s, 0.0);
    let first = (before_s as u64) * (rate_hz as u64);
    scene.samples += first;
    (scene, first)
}

/// A motion to and fro towards the north at 1 Hz with a largest acceleration.
fn shaken(acceleration_mps2: f64) -> Trajectory {
    let place = gnss::earth::Geodetic::from_degrees(26.5123, 80.2329, 130.0);
    let up = place.ecef_to_enu().transpose() * nalgebra::Vector3::z();
    let w = std::f64::consts::TAU;
    let knot = |k: u32| {
        let t_s = f64::from(k) * 0.005 - 0.1;
        let (sin, cos) = libm::sincos(w * t_s);
        Knot {
            t_s,
            motion: Motion {
                position_m: place.to_ecef() - up * (acceleration_mps2 / (w * w) * sin),
                velocity_mps: up * (-acceleration_mps2 / w * cos),
                acceleration_mps2: up * (acceleration_mps2 * sin),
            },
        }
    };
    Trajectory::through((0..8000).map(knot).collect(), Vec::new()).unwrap()
}

/// A curve a level.
type Curves = Vec<(&'static str, Vec<(f64, f64)>)>;

/// A table of curves over one column.
fn table(column: &str, curves: &Curves) -> String {
    let mut text = format!("| {column} |");
    for (name, _) in curves {
        let _ = write!(text, " {name} |");
    }
    text += "\n| --- |";
    text += &" --- |".repeat(curves.len());
    for (row, (x, _)) in curves[0].1.iter().enumerate() {
        let _ = write!(text, "\n| {x} |");
        for (_, points) in curves {
            let _ = write!(text, " {:.1e} |", points[row].1);
        }
    }
    text + "\n\n"
}

/// Names of the legend with their looks, for levels and for sums. Curves lie on each other, so that each has
/// a shape of its own: rings about what a line hides.
fn looks(curves: &Curves) -> Vec<Series> {
    let look = |(name, _): &(&str, Vec<(f64, f64)>)| {
        let (words, colour, mark) = match *name {
            "fast" => ("level fast", ORANGE, Mark::Rings),
            "balanced" => ("level balanced", BLUE, Mark::Line),
            "reference" => ("level reference", GREEN, Mark::Dashes(6, 4)),
            "f32" => ("sums in f32", COLOURS[3], Mark::Line),
            "f64" => ("sums in f64", COLOURS[4], Mark::Dashes(6, 4)),
            _ => ("sums in f32, a mean of 10 σ", COLOURS[6], Mark::Rings),
        };
        Series::new(words, colour, mark, Vec::new())
    };
    curves.iter().map(look).collect()
}

fn chart(title: &str, x_label: &str, y_label: &str, curves: &Curves) -> Chart {
    let place = |x: f64, y: f64| (libm::log10(x.max(1e-3)), libm::log10(y.max(1e-18)));
    let points = || curves.iter().flat_map(|(_, points)| points.iter().map(|(x, y)| place(*x, *y)));
    let x = Axis::around(x_label, points().map(|p| p.0), 1.0).logarithmic();
    let y = Axis::around(y_label, points().map(|p| p.1), 2.0).logarithmic();
    let series = curves
        .iter()
        .zip(looks(curves))
        .map(|((_, points), look)| Series { points: points.iter().map(|(x, y)| place(*x, *y)).collect(), ..look });
    let mut series: Vec<Series> = series.collect();
    // Rings come last, over lines.
    series.sort_by_key(|one| one.mark == Mark::Rings);
    Chart::new(title, x, y, series)
}

#[test]
fn every_curve_of_the_ladder_has_a_look_of_its_own_in_the_legend() {
    let of = |names: &[&'static str]| looks(&names.iter().map(|name| (*name, Vec::new())).collect());
    let levels: Vec<&'static str> = LEVELS.iter().map(|grade| grade.name()).collect();
    let all = [of(&levels), of(&["f32", "f32, DC 10 σ", "f64"])].concat();
    for (at, one) in all.iter().enumerate() {
        let is_same = |other: &Series| other.name == one.name || (other.colour, other.mark) == (one.colour, one.mark);
        assert!(!all[..at].iter().any(is_same), "{}", one.name);
    }
    assert_eq!(all.len(), 6);
}

#[test]
fn no_level_s_error_grows_with_time_rate_or_the_length_of_sums() {
    let the = case(57, "precision ladder", CA);
    let worst = |curve: &[(f64, f64)], unit: &str| {
        let mut worst = Worst::default();
        curve.iter().for_each(|(x, y)| worst.take(*y, || format!("{x} {unit}")));
        worst
    };
    let allowed = |grade: Grade| Fidelity::of(grade).knot_tolerance_cycles + 2e-5;
    let mut over_time: Curves = Vec::new();
    let mut over_rate: Curves = Vec::new();
    let mut over_dynamics: Curves = Vec::new();
    for grade in LEVELS {
        let mut curve = Vec::new();
        for before_s in [0, 3600, 6 * 3600, 86_400, 7 * 86_400, 30 * 86_400] {
            let (scene, first) = scene(2.6e6, grade, before_s);
            curve.push((before_s as f64, carrier_error(&scene, grade, first + 26_000, 40, 0.37).0));
        }
        let (now, later) = (curve[0].1, curve[curve.len() - 1].1);
        // An hour's places are others than the first second's; what is rounded late is a month's drift, 6e-8
        // cycle.
        the.at_most(
            &format!("{}: carrier after 30 d over that at first", grade.name()),
            (later, "rms of 40 code periods of G23"),
            1.5 * now + 2e-6,
            "cycle rms",
        );
        over_time.push((grade.name(), curve));
        let mut curve = Vec::new();
        for rate_hz in [2.046e6, 2.6e6, 5e6, 10e6, 25e6, 50e6] {
            let (scene, first) = scene(rate_hz, grade, 0);
            let (rms, most) = carrier_error(&scene, grade, first + 26_000, 12, 1.37);
            curve.push((rate_hz / 1e6, rms));
            assert!(most < allowed(grade), "{grade:?} at {rate_hz}: {most}");
        }
        the.at_most(
            &format!("{}: carrier at any rate", grade.name()),
            worst(&curve, "Msps"),
            allowed(grade),
            "cycle rms",
        );
        over_rate.push((grade.name(), curve));
        let mut curve = Vec::new();
        for g in [0.1, 1.0, 20.0, 100.0] {
            let (mut scene, first) = scene(2.6e6, grade, 0);
            scene.trajectory = shaken(g * 9.806_65);
            let (rms, _) = carrier_error(&scene, grade, first + 26_000, 25, 0.053);
            curve.push((g, rms));
        }
        the.at_most(
            &format!("{}: carrier shaken by up to 100 g at 1 Hz", grade.name()),
            worst(&curve, "g"),
            allowed(grade),
            "cycle rms",
        );
        over_dynamics.push((grade.name(), curve));
    }
    let counts = [1_000, 10_000, 100_000, 1_000_000];
    let mut over_length: Curves = Vec::new();
    for (name, dc) in [("f32", 0.0), ("f32, DC 10 σ", 10.0)] {
        let errors = counts.map(|count| sum_error(correlate::Arithmetic::F32, count, dc));
        let curve: Vec<_> = counts.iter().zip(&errors).map(|(count, w)| (*count as f64, w.value())).collect();
        let [.., longest] = errors;
        the.at_most(
            &format!("{name} sums: error of 1e6 samples over the noise, against that of 1e4"),
            longest,
            4.0 * curve[1].1 + 1e-12,
            "",
        );
        over_length.push((name, curve));
    }
    let errors = counts.map(twin_error);
    let curve: Vec<_> = counts.iter().zip(&errors).map(|(count, w)| (*count as f64, w.value())).collect();
    let [.., longest] = errors;
    // A partial sum of √n is rounded n times to 1.1e-16 of itself: √(n/6) of that over the noise, and four
    // sigma.
    the.at_most(
        "f64 sums: error of 1e6 samples over the noise, against pairs of doubles",
        longest,
        4.0 * 1.1e-16 * (1e6_f64 / 6.0).sqrt(),
        "",
    );
    over_length.push(("f64", curve));
    assert_eq!(Fidelity::of(Grade::Reference).carrier, Arithmetic::F64);
    if let Some(path) = figures::report() {
        let error = "carrier error, rms (cycles)";
        let charts = [
            chart("Carrier over time", "time since the first sample (s)", error, &over_time),
            chart("Carrier over sample rate", "sample rate (million samples a second)", error, &over_rate),
            chart("Carrier over dynamics", "acceleration, shaken at 1 Hz (g)", error, &over_dynamics),
            chart("Sums over their length", "samples in a sum", "error (of the noise)", &over_length),
        ];
        let legend = [looks(&over_time), looks(&over_length)].concat();
        figure(&path.with_extension("png"), (1280, 900), 2, &charts, &legend).unwrap();
        let name = path.with_extension("png").file_name().unwrap().to_string_lossy().into_owned();
        let text = format!(
            "The same scene at every level: carrier in the samples against the truth, over whole code periods.\n\n\
             ![Error curves]({name})\n\n{}{}{}{}",
            table("seconds since the first sample", &over_time),
            table("Msps", &over_rate),
            table("g at 1 Hz", &over_dynamics),
            table("samples in a sum", &over_length)
        );
        figures::section("The precision ladder", text);
    }
}
