//! Tests of both sidebands of a sub-carrier in one replica, against their definition sample by sample.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use super::*;
use gnss::galileo::altboc::E5;

const NUMBER: u8 = 11;
const SAMPLES: usize = 4000;

/// Whole samples within ±64.
fn bytes(seed: u64) -> Vec<f32> {
    let mut state = seed;
    let next = |_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 57) as f32) - 64.0
    };
    (0..SAMPLES).map(next).collect()
}

#[test]
fn both_sides_together_are_chips_and_tones_at_the_place_of_every_tap_and_every_arithmetic_agrees() {
    let pilots = [&E5.components[1], &E5.components[3]];
    let (i, q) = (bytes(1), bytes(2));
    let taps_chips = [0.0625, 0.0, -0.0625, 0.32, -0.32];
    let taps = taps_chips.map(chips_to_units);
    for (edge, inverted, opposed) in
        [(Edge::Nearest, false, false), (Edge::Area, false, true), (Edge::Area, true, true)]
    {
        let made = |component| Replica::made_in(component, NUMBER, (Layers::Strongest, edge), inverted).unwrap();
        let mut both = Replica::joined(&made(pilots[0]), &made(pilots[1])).unwrap();
        both.set_second(opposed);
        // Close to a period's end, so that chips and tones begin again.
        let (code_chips, step_chips, carrier, turns) = (10_000.3, 10.23 / 65.0, 0.3, 0.01);
        let nco = Nco {
            carrier: (carrier * TURN) as u64,
            carrier_step: (turns * TURN) as u64,
            code: chips_to_units(code_chips),
            code_step: chips_to_units(step_chips) as u64,
        };
        let slow = both.slow(&i, &q, &nco, &taps);
        if edge == Edge::Nearest {
            let codes = pilots.map(e5_code);
            for (tap, found) in taps_chips.iter().zip(&slow) {
                let mut sum = Complex64::ZERO;
                for n in 0..SAMPLES {
                    let chips = (code_chips + tap + n as f64 * step_chips).rem_euclid(10_230.0);
                    let tone = Complex64::from_polar(FRAC_1_SQRT_2, 3.0 * PI * chips);
                    let [upper, lower] = codes.each_ref().map(|code| f64::from(code[chips as usize]));
                    let replica = tone * upper + tone.conj() * lower;
                    let wiped = Complex64::from_polar(1.0, -TAU * (carrier + n as f64 * turns));
                    sum += Complex64::new(f64::from(i[n]), f64::from(q[n])) * wiped * replica.conj();
                }
                // A sample of a few may lie on the other side of an edge.
                assert!((sum - found).norm() < 100.0, "{tap}: {sum} {found}");
            }
        }
        // Two nearest samples of up to 90 may take the chip on the other side of an edge; means of chips err
        // by what 16 bits leave of them, a sample in a thousand.
        let allowed = if edge == Edge::Nearest { 300.0 } else { 60.0 };
        for fast in [both.correlate(&i, &q, &nco, &taps), both.correlate_short(&i, &q, &nco, &taps)] {
            fast.iter().zip(&slow).for_each(|(a, b)| assert!((a - b).norm() < allowed, "{edge:?}: {a} {b}"));
        }
    }
}

/// Chips of a sideband as they are when it is received alone.
fn e5_code(pilot: &Component) -> Vec<i8> {
    let chips = (pilot.code)(NUMBER).unwrap();
    chips.into_iter().enumerate().map(|(index, chip)| if index % 2 == 1 { -chip } else { chip }).collect()
}
