//! Several front ends at one time: the bytes of each are those that it has alone, and the truth is written
//! once.

use std::collections::BTreeSet;
use std::path::Path;

use crate::fast_phase::{FastPhase, FastPhases};
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use crate::stream::*;
use crate::truth;
use gnss::record::{InterferenceRow, Observation, PassRow};
use gnss::signal::register;
use gnss::signal::synthetic::QUADRATURE;

/// Two bands, each with its own rate, format and stages; everything that is random is there.
const TWO: &str = r#"
name = "fronts"
start = 2010-07-01T08:12:30
duration_s = 0.13
seed = 11
signals = ["GPS L1 C/A", "synthetic B"]
[motion]
kind = "static"
latitude_deg = 26.5
longitude_deg = 80.2
height_m = 130
[power]
cn0_dbhz = 50
[noise]
[receiver_clock]
bias_s = 2e-5
drift_sps = 1e-7
oscillator = "tcxo"
[scintillation]
s4 = 0.6
decorrelation_s = 0.3
[[satellite_fault]]
kind = "clock_noise"
satellites = ["G13"]
oscillator = "rubidium1"
[[satellite_fault]]
kind = "clock_step"
satellites = ["G23"]
step_s = 1e-7
on_s = 0.05
[[interference]]
kind = "noise"
js_db = 20
bandwidth_hz = 2e6
offset_hz = -398.97e6
[[interference]]
kind = "chirp"
js_db = 20
sweep_hz = 1e6
sweep_s = 1e-4
on_s = 0.03
[truth]
interval_s = 0.01
"#;

const UPPER: &str = r#"
[[front_end]]
name = "upper"
center_hz = 1575.52e6
sample_rate_hz = 10e6
format = "ci8"
[front_end.local_oscillator]
offset_hz = 20
phase_noise_rad = 0.05
phase_noise_bandwidth_hz = 2000
[front_end.filter]
kind = "butterworth"
order = 3
bandwidth_hz = 4e6
[front_end.adc]
bits = 2
agc_window_s = 0.001
"#;

fn lower(rate_hz: f64) -> String {
    format!(
        "[[front_end]]\nname = \"lower\"\ncenter_hz = 1176.45e6\nsample_rate_hz = {rate_hz}\nformat = \"ci16\"\n\
         [front_end.local_oscillator]\nphase_noise_rad = 0.05\nphase_noise_bandwidth_hz = 2000\n"
    )
}

fn scenes(fronts: &[&str]) -> Vec<Scene> {
    register(&QUADRATURE).unwrap();
    let scenario = Scenario::parse(&format!("{TWO}{}", fronts.concat()), "fronts").unwrap();
    scenario.compose_all(Path::new("scenarios"), &Overrides::default()).unwrap().0
}

/// The bytes of every front end, what was done, and the directory of the truth.
fn made(scenes: &[Scene], options: &Options) -> (Vec<Vec<u8>>, Vec<Generated>, tempfile::TempDir) {
    let directory = tempfile::tempdir().unwrap();
    let mut truth = truth::Writer::create(directory.path()).unwrap();
    let (mut bytes, mut packed) = (vec![Vec::new(); scenes.len()], Vec::new());
    let mut fronts = Fronts::new(scenes, &mut truth, options).unwrap();
    let mut sink = |number: usize, piece: &[u8]| {
        bytes[number].extend_from_slice(piece);
        Ok(())
    };
    while fronts.next(&mut truth, &mut packed, &mut sink).unwrap() {}
    let done = fronts.finish(&mut truth).unwrap();
    (bytes, done, directory)
}

/// Generates like [`made`], but a scene of one front end by the stream for single front ends.
fn alone(scenes: &[Scene], options: &Options) -> (Vec<u8>, Generated, tempfile::TempDir) {
    let [scene] = scenes else { panic!("{}", scenes.len()) };
    let directory = tempfile::tempdir().unwrap();
    let mut truth = truth::Writer::create(directory.path()).unwrap();
    let mut bytes = Vec::new();
    let done = generate_with(scene, &mut bytes, &mut truth, &mut |_| (), options).unwrap();
    (bytes, done, directory)
}

fn rows<T: serde::de::DeserializeOwned>(directory: &tempfile::TempDir, name: &str) -> Vec<T> {
    let mut file = csv::Reader::from_path(directory.path().join(name)).unwrap();
    file.deserialize().map(Result::unwrap).collect()
}

/// The lines of a table that hold a word.
fn lines(directory: &tempfile::TempDir, name: &str, word: &str) -> Vec<String> {
    let text = std::fs::read_to_string(directory.path().join(name)).unwrap();
    text.lines().filter(|line| line.contains(word)).map(str::to_owned).collect()
}

#[test]
fn the_bytes_of_a_front_end_are_those_that_it_has_alone_however_the_work_is_cut() {
    // Rates alike, and rates with nothing in common.
    for rate_hz in [10e6, 7.654_321e6] {
        let lower = lower(rate_hz);
        let expected = [[UPPER], [lower.as_str()]].map(|fronts| alone(&scenes(&fronts), &Options::default()));
        for (threads, block_runs, batch_blocks) in [(1, 8, 16), (3, 1, 2), (2, 64, 3)] {
            let options = Options { block_runs, batch_blocks, ..Options::default() };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let both = scenes(&[UPPER, &lower]);
            let (bytes, done, _) = pool.install(|| made(&both, &options));
            for (number, (expected, own, _)) in expected.iter().enumerate() {
                assert!(bytes[number] == *expected, "{rate_hz} {threads} {block_runs}: {number}");
                assert_eq!(done[number], *own, "{rate_hz} {threads} {block_runs}: {number}");
            }
        }
        // Nor does the position in the list matter.
        let (bytes, ..) = made(&scenes(&[&lower, UPPER]), &Options::default());
        assert!(bytes[0] == expected[1].0 && bytes[1] == expected[0].0, "{rate_hz}");
    }
}

#[test]
fn the_truth_has_every_signal_once_by_the_samples_of_the_first_front_end() {
    let lower = lower(10e6);
    let (_, _, both) = made(&scenes(&[UPPER, &lower]), &Options::default());
    let (_, _, of_upper) = alone(&scenes(&[UPPER]), &Options::default());
    let (_, _, of_lower) = alone(&scenes(&[&lower]), &Options::default());
    let observations: Vec<Observation> = rows(&both, "observations.csv");
    let keys: BTreeSet<_> = observations.iter().map(|row| (row.sample, row.sv, row.signal.name)).collect();
    assert!(keys.len() == observations.len() && keys.len() > 200, "{} of {}", keys.len(), observations.len());
    // At one rate samples have one number: the rows are those of each front end.
    for (signal, own) in [("GPS L1 C/A", &of_upper), ("synthetic B", &of_lower)] {
        assert_eq!(lines(&both, "observations.csv", signal), lines(own, "observations.csv", signal), "{signal}");
    }
    for name in ["trajectory.csv", "navigation.csv", "passes.csv"] {
        assert_eq!(lines(&both, name, ""), lines(&of_upper, name, ""), "{name}");
    }
    // The noise is received below, the chirp above, and each has its rows.
    let received: Vec<InterferenceRow> = rows(&both, "interference.csv");
    let sources: BTreeSet<_> = received.iter().map(|row| row.source).collect();
    assert_eq!(sources.len(), 2);
    let scene = std::fs::read_to_string(both.path().join("scene.json")).unwrap();
    for word in ["\"front_ends\"", "\"upper\"", "\"lower\"", "synthetic B", "\"chirp\"", "\"noise\""] {
        assert!(scene.contains(word), "{word}: {scene}");
    }
    assert!(!std::fs::read_to_string(of_upper.path().join("scene.json")).unwrap().contains("front_ends"));
}

#[test]
fn a_front_end_at_another_rate_is_told_of_at_the_instants_of_the_first() {
    let (first, lower) = (scenes(&[UPPER]), lower(7.654_321e6));
    let (_, _, both) = made(&scenes(&[UPPER, &lower]), &Options::default());
    let (_, _, own) = alone(&scenes(&[&lower]), &Options::default());
    let of = |directory| -> Vec<Observation> {
        let all: Vec<Observation> = rows(directory, "observations.csv");
        all.into_iter().filter(|row| row.signal.name == QUADRATURE.name).collect()
    };
    let (beside, alone) = (of(&both), of(&own));
    assert!(beside.len() == alone.len() && beside.len() > 100, "{} {}", beside.len(), alone.len());
    for (beside, alone) in beside.iter().zip(&alone) {
        let apart_s = beside.sample as f64 / 10e6 - alone.sample as f64 / 7.654_321e6;
        assert!(beside.sv == alone.sv && apart_s.abs() < 1.4e-7, "{} {}", beside.sample, alone.sample);
        // A sample apart at most: 0.13 us, in which the carrier turns by less than 0.002 cycles at 10 kHz.
        let moved = beside.carrier_cycles - alone.carrier_cycles;
        assert!(moved.abs() < 0.002, "{} {}: {moved}", beside.sample, beside.sv);
    }
    // Views are counted by the first front end's samples too.
    let passes: Vec<PassRow> = rows(&both, "passes.csv");
    assert!(passes.iter().all(|row| row.sample == 0 && row.until_sample == first[0].samples));
}

#[test]
fn one_oscillator_moves_every_carrier_in_proportion_to_its_frequency() {
    let both = scenes(&[UPPER, &lower(7.654_321e6)]);
    let mut largest_s = 0.0_f64;
    for k in 0..400 {
        let t_s = 0.0003 * f64::from(k);
        let [upper, lower] = [(&both[0], 1575.42e6), (&both[1], 1176.45e6)].map(|(scene, carrier_hz)| {
            (scene.fast_phases().at(None, carrier_hz, t_s * scene.clock.rate.hz()), carrier_hz)
        });
        let moved_s = |(fast, carrier_hz): (FastPhase, f64)| fast.carrier_cycles / carrier_hz;
        // Positions among nodes are rounded to 2^-53 of them, on slopes of less than a picosecond from node
        // to node.
        assert!((upper.0.delay_s - lower.0.delay_s).abs() < 1e-24, "{k}");
        assert!((moved_s(upper) - upper.0.delay_s).abs() < 1e-24 && (moved_s(lower) - lower.0.delay_s).abs() < 1e-24);
        largest_s = largest_s.max(upper.0.delay_s.abs());
    }
    // A TCXO wanders by picoseconds in a tenth of a second.
    assert!((1e-13..1e-9).contains(&largest_s), "{largest_s}");
}

#[test]
fn runs_between_nodes_that_are_no_samples_follow_the_truth() {
    let both = scenes(&[UPPER, &lower(7.654_321e6)]);
    for scene in &both {
        let (rate, last) = (scene.clock.rate, scene.samples - 1);
        let truth = |n: u64| scene.fast_phases().at(None, 1575.42e6, n as f64).delay_s;
        let mut fast = FastPhases::default();
        fast.prepare(scene.fast_phases(), None, 1575.42e6, 0, last);
        let (mut n, mut runs) = (0, 0);
        while let Some(to) = fast.until(n).filter(|to| *to < last) {
            let [first, end] = fast.ends(n, to);
            assert!((first.delay_s - truth(n)).abs() < 1e-24, "{n}");
            // The line goes on behind its node for less than a sample: what the slope changes there counts so
            // long.
            let step = to - n;
            let bend_s = (truth(to + step / 2) - truth(to)).abs() * 2.0 + (truth(to) - truth(n)).abs();
            let beyond = scene.nodes.at(rate, to).1;
            assert!((end.delay_s - truth(to)).abs() <= 2.0 * beyond * bend_s + 1e-24, "{n} {to}");
            (n, runs) = (to, runs + 1);
        }
        // 0.13 s of nodes 0.512 ms apart.
        assert!((250..=254).contains(&runs), "{runs}");
    }
}

#[test]
fn one_source_is_one_source_for_every_front_end_but_noise_is_each_ones_own() {
    let near = UPPER.replace("upper", "near").replace("1575.52e6", "1575.42e6");
    let both = scenes(&[UPPER, &near]);
    let [one, other] = [&both[0], &both[1]];
    assert_eq!(one.interference[0].seed, other.interference[0].seed);
    assert_ne!(one.noise_seed(), other.noise_seed());
    assert!(one.noise_seed() != one.seed && one.signals == other.signals);
    assert_eq!(crate::scene::sources(both.iter()).len(), 1);
    // The clock is one object.
    let clock = |scene: &Scene| std::sync::Arc::as_ptr(scene.receiver_clock.oscillator.as_ref().unwrap());
    assert_eq!(clock(one), clock(other));
}
