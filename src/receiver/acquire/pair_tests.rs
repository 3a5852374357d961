use std::f64::consts::TAU;

use num_complex::Complex;

use super::dwells::Dwells;
use super::tests::Noise;
use super::*;
use crate::threshold::{of_one_cell, threshold};
use gnss::galileo::e1::{self, E1};
use gnss::samples::Format;
use gnss::satellite::System;
use gnss::time::Rate;

fn metadata(rate_hz: f64, if_hz: f64, inverted: bool) -> IfMetadata {
    let offset_hz = if inverted { if_hz } else { -if_hz };
    let rate = Rate::from_hz(rate_hz).unwrap();
    IfMetadata { format: Format::Ci8, rate, center_hz: E1.centre_hz() + offset_hz, inverted, start: None }
}

fn galileo() -> AcquisitionSettings {
    AcquisitionSettings { signals: vec![E1.name.to_owned()], ..Default::default() }
}

fn link(number: u8) -> Link {
    E1.link(Sv { system: System::Galileo, number })
}

/// Noise of unit variance, and a satellite of this C/N0 with CBOC on both components.
fn record(rate_hz: f64, samples: usize, sent: Option<(u8, f64, f64, f64)>, random: &mut Noise) -> [Vec<f32>; 2] {
    let mut out = [Vec::with_capacity(samples), Vec::with_capacity(samples)];
    let codes =
        sent.map(|(number, ..)| [e1::Code::Data, e1::Code::Pilot].map(|which| e1::code(which, number).unwrap()));
    let signs: Vec<[f64; 2]> =
        (0..64).map(|_| [0, 1].map(|_| if random.uniform() < 0.5 { -1.0 } else { 1.0 })).collect();
    let amplitude = sent.map_or(0.0, |(_, cn0_dbhz, ..)| (libm::pow(10.0, cn0_dbhz / 10.0) / rate_hz / 2.0).sqrt());
    for n in 0..samples {
        let (a, b) = random.pair();
        let mut x = Complex::new(a, b) * 0.5_f64.sqrt();
        if let (Some((.., doppler_hz, phase)), Some([data, pilot])) = (sent, &codes) {
            let chips = phase + n as f64 * 1.023e6 / rate_hz * (1.0 + doppler_hz / E1.centre_hz());
            let square = |rate: f64| if ((chips * rate * 2.0) as u64).is_multiple_of(2) { 1.0 } else { -1.0 };
            let (one, six) = ((10.0_f64 / 11.0).sqrt() * square(1.0), (1.0_f64 / 11.0).sqrt() * square(6.0));
            let (chip, [d, p]) = (chips as usize % 4092, signs[chips as usize / 4092]);
            let value = d * f64::from(data[chip]) * (one + six) - p * f64::from(pilot[chip]) * (one - six);
            let (sin, cos) = libm::sincos(TAU * (doppler_hz * n as f64 / rate_hz + 0.3).fract());
            x += Complex::new(cos, sin) * (amplitude * value);
        }
        out[0].push(x.re as f32);
        out[1].push(x.im as f32);
    }
    out
}

#[test]
fn a_spectrum_that_is_read_from_another_bin_on_is_that_of_the_turned_samples() {
    // At the last rate the band is less than half of what is transformed, at an offset of many bins.
    for (rate_hz, if_hz, inverted) in
        [(2.6e6, 0.0, false), (5.456_321e6, 38_412.0, true), (4e6, -7001.0, false), (13e6, 2e6, false)]
    {
        let metadata = metadata(rate_hz, if_hz, inverted);
        let settings = AcquisitionSettings { noncoherent_sums: 2, doppler_max_hz: 1000.0, ..Default::default() };
        let of = |pair| {
            Grid::new((lead(&E1).unwrap(), pair, E1.centre_hz()), &metadata, &settings, 0.0, &mut Planner::<f32>::new())
                .unwrap()
        };
        let (grid, alone) = (of(true), of(false));
        let [i, q] = record(rate_hz, grid.samples_needed() as usize, None, &mut Noise(4));
        let block = Block { first: 0, i: &i, q: &q };
        for &doppler_hz in &grid.dopplers_hz {
            for dwell in 0..2 {
                let fast = grid.spectrum_of_dwell(&block, doppler_hz, dwell);
                let slow = alone.spectrum_of_period(&block, doppler_hz, dwell as u32);
                // But for a constant phase.
                let energy: f32 = slow.iter().map(|x| x.norm_sqr()).sum();
                let common: Complex<f32> =
                    fast.iter().zip(&slow).map(|(a, b)| a * b.conj()).sum::<Complex<f32>>() / energy;
                let error: f32 = fast.iter().zip(&slow).map(|(a, b)| (a - b * common).norm_sqr()).sum();
                // Half of a 64th of a bin turns by 0.05 over a period, half of a sample of different cuts
                // shows at the ends.
                let case = format!("{rate_hz} {doppler_hz} {dwell}: {} {common}", error / energy);
                assert!((common.norm() - 1.0).abs() < 1e-3 && error < 3e-4 * energy, "{case}");
            }
        }
    }
}

#[test]
fn leaving_dopplers_brings_no_more_false_alarms_than_designed() {
    let metadata = metadata(2.6e6, 0.0, false);
    let probability = 0.1;
    let settings = AcquisitionSettings { doppler_max_hz: 500.0, false_alarm_probability: probability, ..galileo() };
    let samples = samples_needed(&metadata, &settings).unwrap() as usize;
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let candidates: Vec<Link> = (1..=36).map(link).collect();
    let (mut searches, mut alarms) = (0, 0);
    for seed in 0..25 {
        let [i, q] = record(2.6e6, samples, None, &mut Noise(600 + seed));
        let rows = searcher.search(&Block { first: 0, i: &i, q: &q }, &candidates).unwrap();
        searches += rows.len();
        alarms += rows.iter().filter(|(row, _)| row.acquired).count();
    }
    let deviation = (probability * (1.0 - probability) / searches as f64).sqrt();
    let rate = alarms as f64 / searches as f64;
    println!("{rate:.4} measured, {probability} ± {deviation:.4} designed");
    // Of noise that would pass in the end a part was left before; a threshold of another law finds none.
    assert!((0.1 * probability..probability + 2.0 * deviation).contains(&rate), "{alarms} of {searches}");
}

/// Share of satellites that a search finds, by a model of one cell: signs that turn at random at a random
/// position, a Doppler anywhere in its bin, a lag anywhere in its cell. `dwells` are `None` for as many as
/// `asked` by the pilot alone that begin at one position of the code.
fn share_found(cn0_dbhz: f64, asked: u32, dwells: Option<&Dwells>, random: &mut Noise) -> f64 {
    const TRIALS: u32 = 4000;
    const CELLS: f64 = 29_600.0;
    let sums = dwells.map_or(asked, Dwells::sums);
    let bar = threshold(of_one_cell(1e-6, 81.0 * CELLS), 2 * sums);
    let begins = dwells.map_or(vec![0.0; asked as usize], |dwells| dwells.begins().to_vec());
    let mut found = 0;
    for _ in 0..TRIALS {
        let (turn_at, cycles) = (random.uniform(), 0.5 * random.uniform() - 0.25);
        // Eight cells a chip with those between, power around 1 MHz, and what CBOC and the band leave.
        let lag_loss = libm::cos(TAU * (random.uniform() - 0.5) / 8.0 / 1.023);
        let amplitude = (2.0 * libm::pow(10.0, (cn0_dbhz - 0.85) / 10.0) * 0.5 * 4e-3).sqrt() * lag_loss;
        let part = |from: f64, to: f64| {
            let turns = |x: f64| Complex::new(0.0, TAU * cycles * x).exp() / Complex::new(0.0, TAU * cycles);
            turns(to) - turns(from)
        };
        let (mut power, mut stays) = (0.0, true);
        for (dwell, begin) in begins.iter().enumerate() {
            let at = (turn_at - begin).rem_euclid(1.0);
            for _ in 0..if dwells.is_some() { 2 } else { 1 } {
                let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
                let (a, b) = random.pair();
                power += ((part(0.0, at) + part(at, 1.0) * sign) * amplitude + Complex::new(a, b)).norm_sqr();
            }
            let least = dwells.and_then(|dwells| dwells.stay().get(dwell).copied()).unwrap_or(0.0);
            stays &= dwell + 1 == begins.len() || power > least;
        }
        found += u32::from(stays && power > bar);
    }
    f64::from(found) / f64::from(TRIALS)
}

#[test]
fn eight_dwells_by_both_find_as_many_as_ten_by_the_pilot_alone() {
    // Weak signals ask for many and show late.
    for (asked, weakest_dbhz) in [(10, 34), (20, 32), (50, 29)] {
        let dwells = Dwells::of_pair(asked, 29_600);
        let mut random = Noise(12);
        for cn0_dbhz in weakest_dbhz..=weakest_dbhz + 8 {
            let [alone, both] =
                [None, Some(&dwells)].map(|dwells| share_found(f64::from(cn0_dbhz), asked, dwells, &mut random));
            println!("{asked}: {cn0_dbhz} dB-Hz: {alone:.3} by the pilot alone, {both:.3} by both");
            // Two deviations of the difference of two counts, 0.02 at most.
            let deviation = ((alone * (1.0 - alone) + both * (1.0 - both)) / 4000.0).sqrt();
            assert!(both > alone - 2.0 * deviation - 0.002, "{asked}: {cn0_dbhz} dB-Hz: {alone} and {both}");
        }
    }
}

#[test]
fn satellites_are_found_where_they_are_no_less_often_than_the_model_says() {
    let rate_hz = 6.5e6;
    let metadata = metadata(rate_hz, 0.0, false);
    let settings = AcquisitionSettings { doppler_max_hz: 500.0, ..galileo() };
    let samples = samples_needed(&metadata, &settings).unwrap() as usize;
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let mut random = Noise(31);
    let expected = share_found(38.0, 10, Some(&Dwells::of_pair(10, 29_600)), &mut random);
    let (mut found, trials) = (0, 60);
    for trial in 0..trials {
        let (doppler_hz, phase) = (900.0 * random.uniform() - 450.0, 4092.0 * random.uniform());
        let number = 1 + trial % 36;
        let [i, q] = record(rate_hz, samples, Some((number, 38.0, doppler_hz, phase)), &mut random);
        let (_, hit) = searcher.search(&Block { first: 0, i: &i, q: &q }, &[link(number)]).unwrap()[0];
        // Beside the peak lie those of half a chip, a quarter as high.
        let apart = |hit: &Acquired| (hit.code_phase_chips - phase + 2046.0).rem_euclid(4092.0) - 2046.0;
        let right = |hit: &Acquired| apart(hit).abs() < 0.25 && (hit.doppler_hz - doppler_hz).abs() < 30.0;
        found += u32::from(hit.as_ref().is_some_and(right));
    }
    let share = f64::from(found) / f64::from(trials);
    println!("38 dB-Hz: {share:.3} found, {expected:.3} by the model");
    // Three deviations. Fewer Dopplers have a lower threshold, and of the cells around the peak any may pass.
    let bar = 3.0 * (expected * (1.0 - expected) / f64::from(trials)).sqrt();
    assert!(share > expected - bar, "{share} found, {expected} by the model");
}
