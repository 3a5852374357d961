//! Cases 6, 31, 33 and 65: the same phases from a seek as from a stream, in one front end as in another, at
//! rates that fit no code, and in single as in double precision.

use generator::scene::Scene;
use generator::synth::Edge;
use generator::synth::waveform::Waveform;
use generator::transmit::Transmitter;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::Sv;
use gnss::signal::{Layers, SIGNALS, Signal};
use rayon::prelude::*;

use crate::codes::{DAY_S, IF_HZ, RATE_HZ, RUN, below, late, senders};
use crate::exact::{Exact, ONE, signed};
use crate::figures::{ALL, Worst, case};
use crate::{run, skies};

fn transmitter(scene: &Scene, sv: Sv, signal: &'static Signal) -> Option<Transmitter> {
    Transmitter::new(scene, sv, signal, Edge::Nearest).unwrap()
}

/// Places at which a stream and a seek have the same phases, of how many.
fn same(signal: &'static Signal) -> [usize; 2] {
    // 2^40 samples of 65 Msps are 4 h 42 min.
    let (mut scene, _) = late(signal, RATE_HZ, IF_HZ, 16_916);
    let first = 1_u64 << 40;
    let at = scene.clock.epoch(first);
    let mut found = [0; 2];
    for sv in senders(&scene, signal) {
        if found[1] == 16 || !below(&mut scene, sv, at) {
            continue;
        }
        let Some(mut streamed) = transmitter(&scene, sv, signal) else { continue };
        // From 4 s before, across a boundary of the grid, in batches of 0.1 s.
        for from in (first - (1 << 28)..first + RUN).step_by(1600 * RUN as usize) {
            streamed.prepare(&scene, from, from + 1600 * RUN).unwrap();
        }
        let mut sought = transmitter(&scene, sv, signal).unwrap();
        sought.prepare(&scene, first, first + 8 * RUN).unwrap();
        for n in (0..8).map(|k| first + k * RUN) {
            assert!(streamed.in_view(&scene, n) && sought.in_view(&scene, n), "{signal} of {sv}");
            assert!(sought.phases(&scene, n).is_some(), "{signal} of {sv}");
            found[0] += usize::from(streamed.phases(&scene, n) == sought.phases(&scene, n));
            found[1] += 1;
        }
    }
    assert!(found[1] > 0, "{signal}");
    found
}

#[test]
fn at_sample_two_to_the_fortieth_a_stream_from_nearby_and_a_seek_have_the_same_phases() {
    let found: Vec<[usize; 2]> = SIGNALS.par_iter().map(|signal| same(signal)).collect();
    let sum = |which: usize| found.iter().map(|found| found[which]).sum();
    let the = case(6, "start at any sample", ALL);
    the.all("phases at sample 2^40, sought against streamed", sum(0), sum(1));
}

/// The other front end's rate, which has no factor of 65 Msps but 10.
const OTHER_HZ: f64 = 12_345_670.0;

/// Carrier of a satellite's signal at a whole second, in metres off its integers.
fn error_m(scene: &Scene, (sv, signal): (Sv, &'static Signal), second: u64) -> f64 {
    let n = second * scene.clock.rate.hz() as u64;
    let mut transmitter = transmitter(scene, sv, signal).unwrap();
    transmitter.prepare_alone(scene, n, n + RUN).unwrap();
    let (turns, _) = transmitter.phases(scene, n).unwrap();
    let exact = Exact::new(scene, sv, signal);
    let due = exact.carrier(n, exact.delay(n));
    // The first component's phase, and that of its first layer, are quarters of a turn.
    let quarters = 4.0 * signed(turns.wrapping_sub(due));
    (quarters - quarters.round()) / 4.0 * SPEED_OF_LIGHT_MPS / signal.carrier_hz(sv)
}

#[test]
fn between_bands_and_front_ends_of_unlike_rates_phases_stay_together_for_a_month() {
    let the = case(65, "phase between bands and front ends after thirty days", ALL);
    let [worst] = skies::worst(|signal| {
        // Against the first signal of its system, through a front end of 65 Msps.
        let first = SIGNALS.iter().find(|first| first.system == signal.system).unwrap();
        let (mut here, _) = late(signal, OTHER_HZ, -1_234_567.0, 30 * DAY_S);
        let (mut there, _) = late(first, RATE_HZ, IF_HZ, 30 * DAY_S);
        let both = senders(&there, first);
        let mut worst = Worst::default();
        let mut looked = 0;
        for sv in senders(&here, signal).into_iter().filter(|sv| both.contains(sv)) {
            for second in [30 * DAY_S, 30 * DAY_S + 1, 30 * DAY_S + 37] {
                let at = here.clock.start.plus_s(second as f64);
                if looked < 6 && below(&mut here, sv, at) && below(&mut there, sv, at) {
                    let apart_m = error_m(&here, (sv, signal), second) - error_m(&there, (sv, first), second);
                    let at = || format!("{signal} at 12.34567 Msps, {first} at 65, {sv}, second {second}");
                    worst.take(apart_m.abs(), at);
                    looked += 1;
                }
            }
        }
        assert!(!worst.value().is_nan(), "{signal}");
        [worst]
    });
    // Each is within a millionth of its cycle, 0.25 m at the most.
    the.at_most("carriers at one instant, off their integers by unlike lengths", worst, 5e-7, "m");
}

#[test]
fn rates_that_fit_no_code_keep_every_signal_s_phases() {
    let the = case(31, "fs = 1.1, 4.0009, 100 Msps", ALL);
    // 9 minutes after the first sample.
    const BEFORE_S: u64 = 540;
    let of: Vec<[Worst; 2]> = SIGNALS
        .par_iter()
        .map(|signal| {
            let (mut carrier_m, mut code_m) = (Worst::default(), Worst::default());
            for rate_hz in [4.0009e6, 12_345_670.0, 100e6] {
                // AltBOC has 122.76 million steps a second, and a sample 15 at most.
                if rate_hz < 8.2e6 && signal.sides_hz() > 0.0 {
                    continue;
                }
                let (mut scene, first) = late(signal, rate_hz, 1e6, BEFORE_S);
                let at = scene.clock.epoch(first);
                let sv = senders(&scene, signal).into_iter().find(|sv| below(&mut scene, *sv, at)).unwrap();
                let mut transmitter = transmitter(&scene, sv, signal).unwrap();
                transmitter.prepare_alone(&scene, first, first + rate_hz as u64).unwrap();
                let waveform = Waveform::new(signal.link(sv), 0).unwrap().unwrap();
                let voices = waveform.voices(Layers::Whole, Edge::Nearest, rate_hz).unwrap();
                let pace = voices[0].spreading.pace();
                let exact = Exact::new(&scene, sv, signal);
                for n in (0..97).map(|k| first + k * rate_hz as u64 / 100) {
                    let at = || format!("{signal} of {sv}, {rate_hz:e} sps, sample {n}");
                    let (turns, code) = transmitter.phases(&scene, n).unwrap();
                    let delay = exact.delay(n);
                    let quarters = 4.0 * signed(turns.wrapping_sub(exact.carrier(n, delay)));
                    let cycles = (quarters - quarters.round()) / 4.0;
                    carrier_m.take(cycles.abs() * signal.wavelength_m(sv), at);
                    let found = i128::from(code.period) * (i128::from(pace.steps) << 48) + code.phase() as i128;
                    let due = exact.steps(n, delay, (pace.step_rate_hz() * 1e3).round() as i128);
                    let apart_m = (found - due) as f64 / ONE / pace.step_rate_hz() * SPEED_OF_LIGHT_MPS;
                    code_m.take(apart_m.abs(), at);
                }
            }
            [carrier_m, code_m]
        })
        .collect();
    let mut worst = <[Worst; 2]>::default();
    for of in of {
        worst.iter_mut().zip(of).for_each(|(worst, of)| worst.merge(of));
    }
    let [carrier_m, code_m] = worst;
    // Knots of 1e-6 cycle are 2.6e-7 m at most; a fraction of a second and a delay resolve 3.3e-8 m each, and
    // the orbit 7.5e-9 m.
    the.at_most("carrier after 9 min, to integers", carrier_m, 4e-7, "m");
    the.at_most("code after 9 min, to integers", code_m, 4e-7, "m");
}

#[test]
fn single_precision_makes_every_signal_s_samples_to_a_hundred_thousandth() {
    let the = case(33, "f_IF = fs/4", ALL);
    let [worst] = skies::worst(|signal| {
        let front = skies::front_end(signal, 12.5e6, 3.125e6);
        let made = |carrier: &str| {
            let fidelity =
                format!("[fidelity]\nlevel = \"reference\"\ncode_edge = \"area\"\ncarrier = \"{carrier}\"\n");
            let scene = skies::scene(&[signal], 0.01, &format!("{front}{fidelity}"));
            let sv = skies::in_view(&scene, signal)[0];
            let scene = run::only(scene, &[sv]);
            let bytes = run::part(&scene, 5000..30_000, tempfile::tempdir().unwrap().path());
            (sv, run::planes(&scene, &bytes))
        };
        let ((sv, (i, q)), (_, (a, b))) = (made("f32"), made("f64"));
        let amplitude = i.iter().zip(&q).map(|(i, q)| i.hypot(*q)).fold(0.0, f32::max);
        let mut worst = Worst::default();
        for (n, (x, y)) in i.iter().zip(&a).chain(q.iter().zip(&b)).enumerate() {
            let at = || format!("{signal} of {sv}, sample {}", 5000 + n % i.len());
            worst.take(f64::from((x - y).abs() / amplitude), at);
        }
        [worst]
    });
    // Within a run the carrier of single precision is 1e-6 cycle off, 6.3e-6 rad, and rounded to 6e-8.
    the.at_most("fast against f64, of the amplitude", worst, 1e-5, "");
}
