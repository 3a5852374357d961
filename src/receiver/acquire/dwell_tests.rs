use std::f64::consts::TAU;

use num_complex::Complex;

use super::dwells::Dwells;
use super::tests::Noise;
use crate::threshold::{of_one_cell, threshold};

/// Independent cells of a code period at 2.6 Msps.
const CELLS: usize = 3120;
/// Number of Dopplers.
const DOPPLERS: f64 = 41.0;
/// Length of a coherent sum, seconds.
const SUM_S: f64 = 2e-3;
/// Length of a data bit, seconds.
const BIT_S: f64 = 20e-3;

/// The share of satellites that a search of C/A finds with all its sums and with those it makes, of the same
/// ones: bits that turn at random, a Doppler anywhere in its bin, a lag anywhere in its cell.
fn shares_found(dwells: &Dwells, dbhz: [f64; 2]) -> [f64; 2] {
    const TRIALS: u32 = 20_000;
    let mut random = Noise(8);
    let bar = threshold(of_one_cell(1e-6, DOPPLERS * CELLS as f64), 2 * dwells.sums());
    let mut found = [0; 2];
    for _ in 0..TRIALS {
        let (hz, first_bit_s) = (250.0 * random.uniform() - 125.0, BIT_S * random.uniform());
        // Two cells a chip, and what is left of a triangle's square on the way to the one between them,
        // which has three quarters wherever the code lies.
        let lag_loss = f64::max(libm::pow(1.0 - 0.25 * random.uniform(), 2.0), 0.75);
        let amplitudes = dbhz.map(|dbhz| (2.0 * libm::pow(10.0, dbhz / 10.0) * SUM_S * lag_loss).sqrt());
        let mut bit = (0.0, 1.0);
        let (mut powers, mut stays) = ([0.0; 2], true);
        for (dwell, (&period, least)) in dwells.begins().iter().zip(dwells.stay()).enumerate() {
            let mut mean = Complex::default();
            for part in 0..10 {
                let at_s = period * 1e-3 + (f64::from(part) + 0.5) * SUM_S / 10.0;
                let number = ((at_s + first_bit_s) / BIT_S).floor();
                if number > bit.0 {
                    bit = (number, if random.uniform() < 0.5 { -1.0 } else { 1.0 });
                }
                mean += Complex::new(0.0, TAU * hz * at_s).exp() * (bit.1 / 10.0);
            }
            let (a, b) = random.pair();
            for (power, amplitude) in powers.iter_mut().zip(amplitudes) {
                *power += (mean * amplitude + Complex::new(a, b)).norm_sqr();
            }
            stays &= dwell + 1 == dwells.begins().len() || powers[1] > *least;
        }
        found[0] += u32::from(powers[0] > bar);
        found[1] += u32::from(powers[1] > bar && stays);
    }
    found.map(|found| f64::from(found) / f64::from(TRIALS))
}

#[test]
fn leaving_costs_a_tenth_of_a_decibel_however_many_sums_are_asked_for() {
    for (asked, weakest_dbhz) in [(5, 35.0), (10, 33.0), (20, 31.0), (100, 26.5)] {
        let dwells = Dwells::alone(asked, 2, CELLS);
        for step in 0..5 {
            let dbhz = weakest_dbhz + f64::from(step);
            // The same satellites and noise are counted, so the shares differ by what is left alone.
            let [whole, leaving] = shares_found(&dwells, [dbhz, dbhz + 0.1]);
            let [_, same] = shares_found(&dwells, [dbhz, dbhz]);
            println!(
                "{asked}: {dbhz} dB-Hz: {whole:.4} by all sums, {same:.4} with leaving, {leaving:.4} by 0.1 dB more"
            );
            assert!(leaving > whole - 0.001, "{asked}: {dbhz} dB-Hz: {whole}, {leaving}");
            assert!(same <= whole && (same < whole || whole > 0.99), "{asked}: {dbhz} dB-Hz: nothing was left");
        }
    }
}

#[test]
fn few_sums_are_all_made() {
    for asked in 1..=4 {
        assert!(Dwells::alone(asked, 2, CELLS).stay().iter().all(|bar| *bar == 0.0), "{asked}");
    }
    let ten = Dwells::alone(10, 2, CELLS);
    // Chi-square of 10 degrees exceeds 35.6 in one case in 10 000, and the largest of 3120 in one of four.
    assert!((ten.stay()[4] - 35.7).abs() < 0.5 && ten.stay()[..4].iter().all(|bar| *bar == 0.0), "{:?}", ten.stay());
    assert!(ten.stay()[5..9].windows(2).all(|bars| bars[0] < bars[1]) && ten.stay()[9] == 0.0, "{:?}", ten.stay());
}
