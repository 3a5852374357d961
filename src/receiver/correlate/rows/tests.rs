use super::*;
use crate::correlate::fixed::FixedSamples;
use crate::correlate::sums::Samples;
use crate::correlate::{Arithmetic, Edge, Replica, chips_to_units};
use gnss::gps::l1ca::L1_CA;
use gnss::signal::Layers;

const CHIP_HZ: f64 = 1.023e6;

/// 33 LSB of both components.
fn noise(count: usize, seed: u64) -> Vec<f32> {
    super::super::noise::noise(count, seed, 0.0)
}

fn step(rate_hz: f64) -> u64 {
    chips_to_units(CHIP_HZ / rate_hz) as u64
}

fn nco(rate_hz: f64, doppler_hz: f64, code_chips: f64) -> Nco {
    Nco {
        carrier: 0x3456_789a_bcde_f012,
        carrier_step: (doppler_hz / rate_hz * TURN) as i64 as u64,
        code: chips_to_units(code_chips),
        // The code's Doppler, and 10 ppm of the clock.
        code_step: chips_to_units(CHIP_HZ / rate_hz * (1.0 + doppler_hz / 1.575_42e9 + 1e-5)) as u64,
    }
}

fn prepared(rate_hz: f64) -> Replica {
    let mut replica = Replica::made(&L1_CA.components[0], 7, Layers::Strongest, Edge::Area).unwrap();
    replica.prepare(step(rate_hz));
    replica
}

/// Sums by rows at every level, which have to be the same, and those of the twin in `f64`.
fn both<const T: usize>(
    replica: &Replica,
    (i, q): (&[f32], &[f32]),
    nco: &Nco,
    taps: &[i64; T],
) -> ([Complex64; T], [Complex64; T]) {
    let rows = replica.rows.as_ref().unwrap();
    let mut room = FixedSamples::default();
    let samples = room.of(i, q);
    let baseline = rows.correlate(Level::Baseline, samples, nco, taps);
    for level in Level::all() {
        assert_eq!(rows.correlate(level, samples, nco, taps), baseline, "{level:?} {} samples", i.len());
    }
    (baseline, replica.slow(i, q, nco, taps))
}

#[test]
fn sums_are_those_of_the_slow_twin_at_any_length_place_and_rate() {
    let (i, q) = (noise(30_000, 1), noise(30_000, 2));
    let taps = [0.25, 0.0, -0.25, 411.0, 0.5, -0.5].map(chips_to_units);
    for rate_hz in [1.1e6, 2.6e6, 4.0e6, 4.092e6, 5.6e6] {
        let replica = prepared(rate_hz);
        let period = (rate_hz * 1e-3) as usize;
        for (turn, length) in [1, 2, 3, 15, 16, 17, 511, 512, 513, period, period + 1, 30_000].into_iter().enumerate() {
            for code in [-3.7, 0.0, 0.01, 0.39, 300.5, 1022.9, 5000.0] {
                let nco = nco(rate_hz, -5e3, code + 0.001 * turn as f64);
                let (found, slow) = both(&replica, (&i[..length], &q[..length]), &nco, &taps);
                // A sample at a change, half of all at the most, errs by 1/32 if a corner is between its two
                // rows, which two in sixteen are, and by 2⁻⁸ and 2⁻⁹ otherwise: 0.008 of a sample. Four
                // deviations of the sum, and one sample that errs by as much as any does.
                let bound = 33.0 * (4.0 * 0.008 * (length as f64).sqrt() + 0.05);
                for (a, b) in found.iter().zip(&slow) {
                    assert!((a - b).norm() < bound, "{rate_hz} {length} {code}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn rows_hold_the_means_of_a_samples_steps_at_every_level() {
    let wave = Wave::new(&L1_CA.components[0], 7).unwrap();
    let mean = |from: f64, to: f64| {
        // A step counts as far as the sample covers it.
        let steps = from.floor() as i64..=to.floor() as i64;
        let part = |n: i64| (to.min((n + 1) as f64) - from.max(n as f64)).max(0.0);
        steps.map(|n| part(n) * f64::from(wave.values[n.rem_euclid(1023) as usize])).sum::<f64>() / (to - from)
    };
    for step in [0.1, 0.3935, 0.999] {
        let stride = 3000;
        let first = -700.5 * step;
        let places = Places::new(&wave.values, (first, step / ROWS as f64), (stride + 2) * ROWS);
        let mut entries = vec![[0; 2]; stride * ROWS];
        kernel::fill(Level::Baseline, &mut entries, &places, step);
        for level in Level::all() {
            let mut others = vec![[1; 2]; stride * ROWS];
            kernel::fill(level, &mut others, &places, step);
            assert!(others == entries, "{level:?} {step}");
        }
        for (number, pair) in entries.iter().enumerate() {
            let (row, entry) = (number / stride, number % stride);
            for (later, value) in pair.iter().enumerate() {
                let from = first + (entry as f64 + (row + later) as f64 / ROWS as f64) * step;
                let exact = AMPLITUDE * mean(from, from + step);
                // Half for its own rounding, half for what one before owed.
                assert!((f64::from(*value) - exact).abs() <= 1.0 + 1e-6, "{step} {row} {entry}: {value} {exact}");
            }
        }
    }
}

#[test]
fn the_code_stands_where_that_of_the_slow_twin_does() {
    for (rate_hz, worst_m) in [(2.6e6, 0.04), (4.0e6, 0.02), (4.092e6, 0.02)] {
        let replica = prepared(rate_hz);
        let taps = [0.25, 0.0, -0.25].map(chips_to_units);
        let mut sum_m = 0.0;
        for turn in 0..100 {
            let nco = Nco { code_step: step(rate_hz), ..nco(rate_hz, 0.0, 10.2337 * f64::from(turn)) };
            let value = |k: usize| {
                let code = nco.code + k as i64 * nco.code_step as i64;
                (100.0 * replica.value(code.rem_euclid(replica.period()), nco.code_step)).round() as f32
            };
            let i: Vec<f32> = (0..(rate_hz * 1e-3) as usize).map(value).collect();
            let (found, slow) = both(&replica, (&i, &i), &nco, &taps);
            let balance = |of: [Complex64; 3]| 0.5 * (of[0].norm() - of[2].norm()) / of[1].norm() * 293.05;
            let apart_m = balance(found) - balance(slow);
            // Corners within two rows smooth edges on either side of a tap unevenly where few changes share
            // a position between samples.
            assert!(apart_m.abs() < worst_m, "{rate_hz} {turn}: {apart_m}");
            sum_m += apart_m;
        }
        assert!((sum_m / 100.0).abs() < 0.005, "{rate_hz}: {sum_m}");
    }
}

#[test]
fn a_carrier_that_turns_costs_what_is_stated_and_biases_nothing() {
    let rate_hz = 2.6e6;
    let replica = prepared(rate_hz);
    for doppler_hz in [-25e3, -5e3, 100.0, 5e3, 10e3] {
        let nco = nco(rate_hz, doppler_hz, 0.37);
        assert!(replica.takes_fixed(&nco));
        let sample = |k: usize| {
            let code = nco.code + k as i64 * nco.code_step as i64;
            let value = 100.0 * replica.value(code.rem_euclid(replica.period()), nco.code_step);
            let carrier = nco.carrier.wrapping_add(nco.carrier_step.wrapping_mul(k as u64));
            let (sin, cos) = libm::sincos(carrier as f64 / TURN * std::f64::consts::TAU);
            ((value * cos).round() as f32, (value * sin).round() as f32)
        };
        let (i, q): (Vec<f32>, Vec<f32>) = (0..2600).map(sample).unzip();
        let ([prompt], [slow]) = both(&replica, (&i, &q), &nco, &[0]);
        // Amplitude: ω²/4, and 0.001 of edges that are smoothed.
        let most = (std::f64::consts::TAU * doppler_hz / rate_hz).powi(2) / 4.0 + 1e-3;
        let less = 1.0 - prompt.norm() / slow.norm();
        assert!((-1e-4..most).contains(&less), "{doppler_hz}: {less}");
        assert!((prompt / slow).arg().abs() < 2e-4, "{doppler_hz}: {}", (prompt / slow).arg());
    }
}

#[test]
fn full_scale_in_step_with_the_replica_does_not_overflow() {
    let rate_hz = 2.6e6;
    let replica = prepared(rate_hz);
    for eighth in 0..8 {
        let nco = Nco { carrier: eighth << 61, carrier_step: 0, code: 0, code_step: step(rate_hz) };
        let sign = |k: i64| replica.value(k * nco.code_step as i64, nco.code_step).signum() as f32;
        let i: Vec<f32> = (0..2600).map(|k| 127.5 * sign(k)).collect();
        let ([found], [slow]) = both(&replica, (&i, &i), &nco, &[0]);
        assert!((found / slow - 1.0).norm() < 1e-3, "{eighth}: {found} {slow}");
    }
}

#[test]
fn rows_are_left_where_pieces_are_quicker_and_where_the_code_or_the_carrier_moves_otherwise() {
    let rows = |rate_hz: f64| prepared(rate_hz).rows;
    assert!(rows(2.6e6).is_some() && rows(1.1e6).is_some());
    assert!(rows(1e6).is_none() && rows(8e6).is_none());
    let at = |doppler_hz| nco(2.6e6, doppler_hz, 0.0);
    let replica = prepared(2.6e6);
    assert!(replica.takes_fixed(&at(-20e3)) && !replica.takes_sums(&at(5e3)));
    assert!(!replica.takes_fixed(&at(30e3)));
    let faster = Nco { code_step: step(2.6e6 / 1.0001), ..at(0.0) };
    assert!(!replica.takes_fixed(&faster) && replica.takes_sums(&faster));
    // Without rows, or without such samples, it goes another way.
    let (i, q) = (noise(2600, 5), noise(2600, 6));
    let mut room = FixedSamples::default();
    let by = |samples: Samples, arithmetic| replica.correlate_in(arithmetic, samples, &at(20.0), &[0]);
    let bare = Samples::from((&i[..], &q[..]));
    let with = Samples { fixed: Some(room.of(&i, &q)), ..bare };
    assert_eq!(by(bare, Arithmetic::Sums), by(bare, Arithmetic::I16));
    assert_ne!(by(with, Arithmetic::Sums), by(with, Arithmetic::I16));
}

#[test]
fn samples_of_8_bits_are_exact_in_16() {
    let all: Vec<f32> = (-255..=255).map(|half| 0.5 * half as f32).collect();
    for level in Level::all() {
        let mut fixed = vec![0; all.len()];
        kernel::fixed(level, &all, &mut fixed);
        assert!(all.iter().zip(&fixed).all(|(x, fixed)| 16.0 * x == f32::from(*fixed)), "{level:?}");
    }
}
