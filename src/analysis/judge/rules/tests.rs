//! A sound run made by hand, damaged one way at a time: the right row fails and no other.

use std::fs;

use super::*;
use crate::hand_made::planted;
use crate::judge::judgement::{Bound, Status};
use crate::judge::limits::Limits;
use crate::judge_against;
use crate::measure::errors::{Errors, Link};
use crate::read::spill_store::SpillStore;
use gnss::facts::{Expect, Fixes, Interval, Losses, Terms};
use gnss::record::{Event, EventRow, Observation};
use gnss::satellite::Sv;

/// Tenths of a second: channels are observed from 10 s on, fixes come from 30 s on.
const OBSERVED: u64 = 100;
const TICK: u64 = 260_000;

/// The planted run with observations as they truly were, and every satellite used.
fn sound(directory: &std::path::Path) -> Run {
    let mut run = Run::read(directory).unwrap();
    observe(&mut run, |_, row| row.sample >= OBSERVED * TICK);
    run.fixes.change(|all| all.iter_mut().for_each(|fix| fix.satellites = 9));
    run.acquisition.retain(|row| run.truth.keys().any(|Link { sv, .. }| sv == row.sv));
    run.events.clear();
    run
}

/// Observations: those of the truth that are kept.
fn observe(run: &mut Run, keep: impl Fn(Sv, &Observation) -> bool) {
    let mut kept = SpillStore::new(run.truth.directory());
    for link in run.truth.keys().collect::<Vec<Link>>() {
        for row in run.truth.rows(link).unwrap().iter().filter(|row| keep(link.sv, row)) {
            kept.push(link, row).unwrap();
        }
    }
    run.observations = kept;
}

fn verdict(run: &Run) -> Verdict {
    let expected = Expectations::of(run, Receiver::of(run), run).unwrap();
    let mut verdict = Verdict::default();
    verdict.satellites(run, &expected).unwrap();
    verdict.availability(run.scene.duration_s, &run.scene.expect, &expected, &Came::of(run).unwrap());
    let errors = Errors::measure(run).unwrap();
    verdict.losses(run, &expected.receiver, &Slips::find(run, &errors).unwrap()).unwrap();
    verdict
}

/// Figures of the rows that fail.
fn failed(run: &Run) -> Vec<String> {
    let verdict = verdict(run);
    let failed = verdict.rows.iter().filter(|row| row.status == Status::Fail);
    failed.map(|row| row.figure.clone()).collect()
}

#[test]
fn a_sound_run_passes_and_its_first_fix_is_due_by_the_message_s_timetable() {
    let directory = planted();
    let run = sound(directory.path());
    assert_eq!(failed(&run), Vec::<String>::new());
    let verdict = verdict(&run);
    let first = verdict.rows.iter().find(|row| row.figure == "time to first fix").unwrap();
    // The scene starts with a frame: locked at 4 s, subframe 1 comes whole at 36 s; a quarter second of
    // light, a second each to use and to solve.
    assert!(matches!(first.bound, Bound::Max(limit_s) if (38.2..38.5).contains(&limit_s)), "{:?}", first.bound);
    assert!(verdict.rows.len() >= 8, "{:?}", verdict.rows);
}

#[test]
fn satellites_that_are_not_found_or_not_observed_fail_by_name() {
    let directory = planted();
    let mut run = sound(directory.path());
    run.acquisition.retain(|row| row.sv.number > 7);
    observe(&mut run, |sv, row| sv.number > 7 && row.sample >= OBSERVED * TICK);
    assert_eq!(failed(&run), ["satellites in view never acquired", "satellites observed too little"]);
    let verdict = verdict(&run);
    let why = verdict.rows[0].why.join(" ");
    assert!(why.contains("G05:") && why.contains("dB-Hz") && !why.contains("G12"), "{why}");
    assert!(verdict.rows[1].why.join(" ").contains("G05: 0 of"), "{:?}", verdict.rows[1].why);
    let mut run = sound(directory.path());
    observe(&mut run, |_, row| (OBSERVED * TICK..200 * TICK).contains(&row.sample));
    assert_eq!(failed(&run), ["satellites observed too little"]);
    let mut run = sound(directory.path());
    // Eight must be used: the ninth is so weak that its searches may miss it for half a minute.
    run.fixes.change(|all| all.iter_mut().for_each(|fix| fix.satellites = 6));
    assert_eq!(failed(&run), ["required satellites left out of fixes"]);
}

#[test]
fn one_fix_of_a_minute_a_gap_and_none_at_all_fail() {
    let directory = planted();
    let mut run = sound(directory.path());
    run.fixes.change(|all| all.truncate(1));
    assert_eq!(failed(&run), ["epochs without a fix", "longest time without a fix"]);
    let mut run = sound(directory.path());
    run.fixes.change(Vec::clear);
    assert_eq!(failed(&run), ["time to first fix", "epochs without a fix", "longest time without a fix"]);
    let mut run = sound(directory.path());
    run.fixes.change(|all| all.retain(|fix| !(450 * TICK..465 * TICK).contains(&fix.sample)));
    assert_eq!(failed(&run), ["epochs without a fix", "longest time without a fix"]);
    // One epoch of three hundred is nobody's loss.
    let mut run = sound(directory.path());
    run.fixes.change(|all| all.retain(|fix| fix.sample != 450 * TICK));
    assert_eq!(failed(&run), Vec::<String>::new());
}

#[test]
fn a_scene_that_expects_no_fix_is_judged_by_that_before_during_and_after() {
    let directory = planted();
    let mut run = sound(directory.path());
    let terms = Terms { fix: Some(Fixes::None), reason: "jammer".to_owned(), ..Terms::default() };
    run.scene.expect = Expect { whole: None, intervals: vec![Interval { from_s: 40.0, to_s: 50.0, terms }] };
    assert_eq!(failed(&run), ["fixes, 40 to 50 s (jammer)"]);
    run.fixes.change(|all| all.retain(|fix| !(400 * TICK..500 * TICK).contains(&fix.sample)));
    assert_eq!(failed(&run), Vec::<String>::new());
    run.fixes.change(|all| all.retain(|fix| fix.sample < 500 * TICK));
    assert_eq!(failed(&run), ["epochs without a fix, 50 to 60 s", "longest time without a fix"]);
}

#[test]
fn a_loss_is_excused_for_its_own_satellite_when_that_sets_and_for_no_other() {
    let directory = planted();
    let mut run = sound(directory.path());
    let signal = run.truth.keys().next().unwrap().signal;
    let lost =
        |number: u8, tick: u64| EventRow { sample: tick * TICK, sv: Sv::gps(number), signal, event: Event::LossOfLock };
    // G05 sets at 50 s; the receiver notices 0.4 s later.
    let mut truth = SpillStore::new(run.truth.directory());
    for link in run.truth.keys().collect::<Vec<Link>>() {
        let there = |row: &&Observation| link.sv != Sv::gps(5) || row.sample < 500 * TICK;
        run.truth.rows(link).unwrap().iter().filter(there).for_each(|row| truth.push(link, row).unwrap());
    }
    run.truth = truth;
    observe(&mut run, |_, row| row.sample >= OBSERVED * TICK);
    run.events = vec![lost(5, 504)];
    assert_eq!(failed(&run), Vec::<String>::new());
    run.events = vec![lost(5, 504), lost(12, 504), lost(5, 450)];
    let verdict = verdict(&run);
    let row = verdict.rows.iter().find(|row| row.figure == "unexpected losses of lock").unwrap();
    assert_eq!((row.value.as_u64(), row.why.len()), (Some(2), 2));
    assert!(row.why[0].starts_with("G05 at 45.0 s") && row.why[1].starts_with("G12 at 50.4 s"), "{:?}", row.why);
    let terms = Terms { losses: Some(Losses::Any), reason: "shaken".to_owned(), ..Terms::default() };
    run.scene.expect = Expect { whole: Some(terms), intervals: Vec::new() };
    assert!(!failed(&run).contains(&"unexpected losses of lock".to_owned()));
}

#[test]
fn an_oscillator_s_offset_and_a_front_end_s_delay_are_no_errors() {
    let directory = planted();
    let scene = directory.path().join("truth/scene.json");
    let text = std::fs::read_to_string(&scene).unwrap();
    let stages = r#""front_end": [{"stage": "local_oscillator", "offset_hz": 5.0},
        {"stage": "filter", "shape": "brick_wall", "bandwidth_hz": 1e9, "group_delay_s": 2.4e-7}],"#;
    std::fs::write(&scene, text.replace("{\"name\"", &format!("{{{stages} \"name\""))).unwrap();
    let mut run = Run::read(directory.path()).unwrap();
    let mut seen = SpillStore::new(run.truth.directory());
    for link in run.truth.keys().collect::<Vec<Link>>() {
        for row in run.truth.rows(link).unwrap().iter().filter(|row| row.sample >= OBSERVED * TICK) {
            let sent = row.sent().plus_s(-2.4e-7);
            let (sent_s, sent_fraction_s) = (sent.seconds(), sent.fraction());
            let carrier_cycles = row.carrier_cycles + 2.4e-7 * row.doppler_hz - 5.0 * run.time_s(row.sample);
            let row = Observation {
                sent_s,
                sent_fraction_s,
                carrier_cycles,
                doppler_hz: row.doppler_hz + 5.0,
                ..row.clone()
            };
            seen.push(link, &row).unwrap();
        }
    }
    run.observations = seen;
    let errors = Errors::measure(&run).unwrap();
    let worst = |of: fn(&crate::measure::errors::SignalError) -> f64| {
        let (all, mut most) = (errors.pooled(None, of).unwrap(), 0.0_f64);
        all.each(|value| most = most.max(value.abs())).unwrap();
        most
    };
    // An epoch's fraction resolves 1e-16 s, a carrier of 1e8 cycles 1.5e-8.
    assert!(
        worst(|row| row.code_m) < 1e-6 && worst(|row| row.carrier_cycles) < 1e-6 && worst(|row| row.doppler_hz) < 1e-9
    );
    assert_eq!(errors.cycle_slips, 0);
    // The planted clock is 3 m off; 72 m of delay come on top as long as nobody delayed the fixes.
    let clock_m = errors.positions.first().unwrap().clock_m;
    assert!((clock_m - 3.0 - 2.4e-7 * 299_792_458.0).abs() < 1e-3, "{clock_m}");
    assert!(
        (run.common.drift_mps(run.truth.rows(run.truth.keys().next().unwrap()).unwrap()[5].sample, 0.19) + 0.95).abs()
            < 0.05
    );
}

#[test]
fn the_verdict_names_what_was_planted_and_a_user_s_limits_come_first() {
    let run = planted();
    let limits = "\"position.horizontal_p95_m\" = { max = 5 }\n\"tracking.cycle_slips\" = { max = 0 }\n\
                  \"spoofing.captured_share\" = { max = 0 }\n";
    let limits = Limits::parse(limits, "lab.toml").unwrap();
    let verdict = judge_against(run.path(), Some(&limits)).unwrap().details.verdict;
    let status = |figure: &str| verdict.rows.iter().find(|row| row.figure == figure).map(|row| row.status);
    assert_eq!(verdict.of_user, 3);
    assert_eq!(status("position.horizontal_p95_m"), Some(Status::Pass));
    assert_eq!(status("horizontal error, 95 %"), None, "the user's limit replaces it");
    let mut broken: Vec<&str> = verdict.broken().map(|row| row.figure.as_str()).collect();
    broken.sort_unstable();
    assert_eq!(broken, ["spoofing.captured_share", "tracking.cycle_slips"], "the first is a figure that is missing");
    // Formal sigmas are 0.4 m like the planted ones, the bias of 0.5 m up comes on top.
    assert_eq!(status("vertical error, 95 %"), Some(Status::Fail));
    assert_eq!(status("false acquisitions"), Some(Status::Fail));
    assert_eq!(status("wrong navigation parameters"), Some(Status::Fail));
    assert_eq!(status("PLL jitter, 1σ"), Some(Status::Pass));
    // 31 was lost, but the truth never had it: a signal too weak to hold.
    assert_eq!(status("unexpected losses of lock"), Some(Status::Pass));
    assert_eq!(verdict.status(), Status::Fail);
    let table = fs::read_to_string(run.path().join("verdict.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + verdict.rows.len() + verdict.not_judged.len());
    assert_eq!(table.matches(",not_judged,").count(), verdict.not_judged.len(), "{table}");
}

#[test]
fn weights_within_a_factor_move_the_artanh_of_a_correlation_by_its_logarithm_at_most() {
    use nalgebra::{Matrix4, Vector4};
    let mut state = 5_u64;
    let mut draw = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let factor: f64 = 1.259;
    let artanh = |p: &Matrix4<f64>, a: usize, b: usize| libm::atanh(p[(a, b)] / (p[(a, a)] * p[(b, b)]).sqrt());
    let mut largest: f64 = 0.0;
    for _ in 0..2000 {
        // Five to nine rows anywhere, some geometries as poor as they come.
        let rows: Vec<Vector4<f64>> =
            (0..5 + (8.0 * (draw() + 0.5)) as usize / 2).map(|_| Vector4::new(draw(), draw(), draw(), 0.5)).collect();
        let of = |weights: &mut dyn FnMut() -> f64| {
            rows.iter()
                .fold(Matrix4::zeros(), |sum, row| sum + weights() * row * row.transpose())
                .try_inverse()
                .unwrap()
        };
        let (true_ones, stated) = (of(&mut || 1.0), of(&mut || if draw() < 0.0 { 1.0 / factor } else { factor }));
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            largest = largest.max((artanh(&true_ones, a, b) - artanh(&stated, a, b)).abs());
        }
    }
    // The bound holds, and geometries come near to it.
    assert!((0.7..=1.0).contains(&(largest / libm::log(factor))), "{largest}");
}
