//! Cases 6 and 65: the same phases from a seek as from a stream, and in one front end as in another.

use gnss_twin::generator::scene::Scene;
use gnss_twin::generator::synth::Edge;
use gnss_twin::generator::transmit::Transmitter;
use gnss_twin::gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss_twin::gnss::satellite::Sv;
use gnss_twin::gnss::signal::{SIGNALS, Signal};
use rayon::prelude::*;

use crate::codes::{DAY_S, IF_HZ, RATE_HZ, RUN, below, late, senders};
use crate::exact::{Exact, signed};
use crate::figures::{ALL, Worst, case};

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
    let of: Vec<Worst> = SIGNALS
        .par_iter()
        .map(|signal| {
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
            worst
        })
        .collect();
    let mut worst = Worst::default();
    of.into_iter().for_each(|of| worst.merge(of));
    // Each is within a millionth of its cycle, 0.25 m at the most.
    the.at_most("carriers at one instant, off their integers by unlike lengths", worst, 5e-7, "m");
}
