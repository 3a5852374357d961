use super::*;
use crate::correlate::sums::{RunningSums, Samples};
use crate::correlate::{Arithmetic, Edge, Replica, chips_to_units};
use gnss::galileo::e1::E1;
use gnss::gps::l1ca::L1_CA;
use gnss::signal::Layers;
use gnss::signal::synthetic::{LONG_BOC, MIXED, MULTIPLEXED};

/// Noise with a constant offset.
fn noise(count: usize, seed: u64) -> Vec<f32> {
    super::super::noise::noise(count, seed, 2.0)
}

fn nco(rate_hz: f64, chip_hz: f64, doppler_hz: f64, code_chips: f64) -> Nco {
    Nco {
        carrier: 0x3456_789a_bcde_f012,
        carrier_step: (doppler_hz / rate_hz * TURN) as i64 as u64,
        code: chips_to_units(code_chips),
        code_step: chips_to_units(chip_hz / rate_hz) as u64,
    }
}

/// Sums by pieces at every level, which have to be the same, and those of the twin in `f64`.
fn both<const T: usize>(
    replica: &Replica,
    (i, q): (&[f32], &[f32]),
    nco: &Nco,
    taps: &[i64; T],
) -> ([Complex64; T], [Complex64; T]) {
    let mut room = RunningSums::default();
    let sums = room.of(i, q).unwrap();
    let of = |level| {
        let one = |pieces: &Pieces| pieces.correlate(level, sums, nco, taps).map(|sum| pieces.gain() * sum);
        let add = |a: [Complex64; T], b: [Complex64; T]| std::array::from_fn(|t| a[t] + b[t]);
        replica.pieces.iter().map(one).fold([Complex64::ZERO; T], add)
    };
    let baseline = of(Level::Baseline);
    for level in Level::all() {
        assert_eq!(of(level), baseline, "{level:?} {} samples", i.len());
    }
    (baseline, replica.slow(i, q, nco, taps))
}

#[test]
fn with_the_carrier_at_rest_sums_are_those_of_the_slow_twin_at_any_length_place_and_rate() {
    let (i, q) = (noise(30_000, 1), noise(30_000, 2));
    let taps = [0.25, 0.0, -0.25].map(chips_to_units);
    let far = [0.25, 0.0, -0.25, 411.0, 0.5, -0.5].map(chips_to_units);
    for rate_hz in [2.6e6, 4.0e6, 4.092e6, 10e6, 25e6, 50e6] {
        let replica = Replica::made(&L1_CA.components[0], 7, Layers::Strongest, Edge::Area).unwrap();
        let period = (rate_hz * 1e-3) as usize;
        let lengths = [0, 1, 2, 3, 7, 40, period / 2, period, period + 1].map(|count| count.min(30_000));
        for (turn, length) in lengths.into_iter().chain([30_000]).enumerate() {
            for code in [-3.7, 0.0, 0.01, 0.39, 300.5, 1022.9, 5000.0] {
                let nco = nco(rate_hz, 1.023e6, 0.0, code + 0.001 * turn as f64);
                let samples = (&i[..length], &q[..length]);
                // Products of a chunk reach 1e5 (an offset of 2 in 12 000 samples), and 300 sums of them in
                // f32 err by 0.1; positions have 2⁻¹⁷ sample at each of 600 changes a millisecond; phasors
                // 5e-6 of the sum.
                let bound = 0.02 + 2e-4 * (length as f64).sqrt() * 23.0;
                if length == 0 {
                    continue;
                }
                let (found, slow) = both(&replica, samples, &nco, &taps);
                for (a, b) in found.iter().zip(&slow) {
                    assert!((a - b).norm() < bound, "{rate_hz} {length} {code}: {a} {b}");
                }
                let (found, slow) = both(&replica, samples, &nco, &far);
                for (a, b) in found.iter().zip(&slow) {
                    assert!((a - b).norm() < bound, "far {rate_hz} {length} {code}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn every_waveform_has_the_sums_of_its_slow_twin() {
    let (i, q) = (noise(60_000, 3), noise(60_000, 4));
    let cases = [
        (&E1.components[1], Layers::Strongest, 10e6),
        (&E1.components[1], Layers::Whole, 25e6),
        (&LONG_BOC.components[0], Layers::Strongest, 12e6),
        (&MIXED.components[0], Layers::Strongest, 12e6),
        (&MULTIPLEXED.components[0], Layers::Strongest, 12e6),
    ];
    for (component, waveform, rate_hz) in cases {
        let replica = Replica::made(component, 3, waveform, Edge::Area).unwrap();
        let taps = [0.1, 0.0, -0.1].map(chips_to_units);
        for code in [0.0, 0.2, 20.3] {
            let nco = nco(rate_hz, component.chip_rate_hz, 0.0, code);
            let (found, slow) = both(&replica, (&i, &q), &nco, &taps);
            for (a, b) in found.iter().zip(&slow) {
                // A chunk of 500 changes errs by 0.2 in f32; up to 80 of them, in up to four layers: three
                // sigma.
                assert!((a - b).norm() < 3.0 * 0.2 * 80_f64.sqrt(), "{waveform:?} {rate_hz} {code}: {a} {b}");
            }
        }
    }
}

#[test]
fn a_carrier_that_turns_costs_what_is_stated_and_biases_nothing() {
    // A signal without noise: its power in the prompt against that of the slow twin, and its phase.
    let rate_hz = 4e6;
    let replica = Replica::made(&L1_CA.components[0], 7, Layers::Strongest, Edge::Area).unwrap();
    for doppler_hz in [-10e3, -5e3, 100.0, 5e3, 10e3] {
        let nco = nco(rate_hz, 1.023e6, doppler_hz, 0.37);
        assert!(replica.pieces[0].suit(&nco));
        let sample = |k: usize| {
            let code = nco.code + k as i64 * nco.code_step as i64;
            let value = 100.0 * replica.value(code.rem_euclid(replica.period()), nco.code_step);
            let carrier = nco.carrier.wrapping_add(nco.carrier_step.wrapping_mul(k as u64));
            let (sin, cos) = libm::sincos(carrier as f64 / TURN * std::f64::consts::TAU);
            ((value * cos).round() as f32, (value * sin).round() as f32)
        };
        let (i, q): (Vec<f32>, Vec<f32>) = (0..4000).map(sample).unzip();
        let ([early, prompt, late], [slow_early, slow, slow_late]) =
            both(&replica, (&i, &q), &nco, &[0.25, 0.0, -0.25].map(chips_to_units));
        // Amplitude: (πfL)²/6 with pieces' mean of L³ over that of L below 8 chips², and 2e-5 of phasors.
        let turned = std::f64::consts::PI * doppler_hz / 1.023e6;
        let most = turned.powi(2) * 8.0 / 6.0 + 2e-5;
        let less = 1.0 - prompt.norm() / slow.norm();
        assert!((-2e-5..most).contains(&less), "{doppler_hz}: {less}");
        // Phase: a sample at a piece's end is shared by two, which puts the middle of what a piece holds off
        // by a sample or less; on 580 of them 0.006 sample of 4000, and four times that. 1e-5 of phasors.
        let apart = 0.024 * std::f64::consts::TAU * doppler_hz.abs() / rate_hz + 1e-5;
        assert!((prompt / slow).arg().abs() < apart, "{doppler_hz}: {}", (prompt / slow).arg());
        // Early and late lose the same but for such positions, a tenth of it.
        let balance = |early: Complex64, late: Complex64| (early.norm() - late.norm()) / (early.norm() + late.norm());
        let moved = balance(early, late) - balance(slow_early, slow_late);
        assert!(moved.abs() < 0.1 * most + 1e-5, "{doppler_hz}: {moved}");
    }
}

#[test]
fn pieces_are_left_where_products_are_quicker_or_the_carrier_turns_too_far() {
    let replica = Replica::made(&L1_CA.components[0], 7, Layers::Strongest, Edge::Area).unwrap();
    let suit = |rate_hz, doppler_hz| replica.pieces[0].suit(&nco(rate_hz, 1.023e6, doppler_hz, 0.0));
    assert!(suit(2.6e6, 5e3) && suit(50e6, -5e3) && suit(2.6e6, 10e3));
    assert!(!suit(1.5e6, 0.0) && !suit(2.6e6, 11e3) && !suit(2.6e6, -1e6) && !suit(70e6, 0.0));
    let boc = Replica::made(&E1.components[1], 7, Layers::Strongest, Edge::Area).unwrap();
    assert!(!boc.pieces[0].suit(&nco(2.6e6, 1.023e6, 0.0, 0.0)) && boc.pieces[0].suit(&nco(6.5e6, 1.023e6, 0.0, 0.0)));
    // Nearest edges have none, and what is not asked for by sums goes another way.
    let nearest = Replica::made(&L1_CA.components[0], 7, Layers::Strongest, Edge::Nearest).unwrap();
    assert!(nearest.pieces.is_empty());
    let (i, q) = (noise(2600, 5), noise(2600, 6));
    let mut room = RunningSums::default();
    let samples = Samples { i: &i, q: &q, sums: room.of(&i, &q), fixed: None };
    let at = nco(2.6e6, 1.023e6, 20e3, 0.0);
    let taps = [0];
    let by = |arithmetic| replica.correlate_in(arithmetic, samples, &at, &taps);
    assert_eq!(by(Arithmetic::Sums), by(Arithmetic::I16));
}
