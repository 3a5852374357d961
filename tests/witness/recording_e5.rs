//! Tests of both sidebands of Galileo's E5 and GPS L5 in one band of 50 MHz, as an antenna received them in
//! January 2016, and of the relation that makes the two sidebands of E5 one signal.

use std::f64::consts::TAU;

use gnss::galileo::e5::{self, E5A, E5B};
use gnss::gps::l5::L5;
use gnss::samples::{Format, IfMetadata};
use gnss::signal::{Link, Signal};
use gnss::time::Rate;
use num_complex::Complex64;
use receiver::acquire::{Acquired, AcquisitionSettings, Searcher};
use receiver::source::Block;

use super::recording::two_bits;

pub const FILE: &str = "if-signals/ifen_e5_2016-01-19_100msps_r2bit.bin";
pub const RATE_HZ: f64 = 100e6;
/// The middle of E5, and where it is in the samples.
pub const CENTRE_HZ: f64 = 1_191.795e6;
pub const IF_HZ: f64 = 74_999_467.6;
/// Cycles of E5's subcarrier a chip (Galileo OS SIS ICD 2.1, table 5): sides are that far from the middle.
const CYCLES_PER_CHIP: f64 = 1.5;
pub const CHIPS: f64 = 10_230.0;

pub fn search(i: &[f32], signal: &'static Signal, doppler_max_hz: f64) -> Vec<Acquired> {
    let metadata = IfMetadata {
        format: Format::Ri8,
        rate: Rate::from_hz(RATE_HZ).unwrap(),
        center_hz: CENTRE_HZ - IF_HZ,
        inverted: false,
        start: None,
    };
    let settings = AcquisitionSettings {
        signals: vec![signal.name.to_owned()],
        noncoherent_sums: 15,
        doppler_max_hz,
        ..AcquisitionSettings::default()
    };
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let links: Vec<Link> = signal.satellites().map(|sv| signal.link(sv)).filter(|l| l.is_of_constellation()).collect();
    let q = vec![0.0; i.len()];
    let rows = searcher.search(&Block { first: 0, i, q: &q }, &links).unwrap();
    for (row, _) in rows.iter().filter(|(row, _)| row.statistic > 0.9 * row.threshold) {
        println!(
            "{} {} {} {:9.1} Hz {:9.2} chips {:5.1} dB-Hz  {:.1}/{:.1}",
            row.sv,
            signal,
            row.acquired,
            row.doppler_hz,
            row.code_phase_chips,
            row.cn0_dbhz,
            row.statistic,
            row.threshold
        );
    }
    rows.into_iter().filter_map(|(_, hit)| hit).collect()
}

/// Exactly these satellites, each where another program found it to a chip; where the list has no delay, the
/// number alone.
pub fn assert_found(found: &[Acquired], listed: &[(u8, Option<f64>)]) {
    let numbers: Vec<u8> = found.iter().map(|hit| hit.sv.number).collect();
    assert_eq!(numbers, listed.iter().map(|(number, _)| *number).collect::<Vec<_>>());
    for (hit, (_, delay_chips)) in found.iter().zip(listed) {
        // The list counts the chips that are missing to the next beginning of the code.
        let apart = delay_chips.map(|chips| libm::remainder(hit.code_phase_chips + chips, CHIPS).abs());
        assert!(apart.is_none_or(|apart| apart < 1.0), "{hit:?}, listed at {delay_chips:?}");
    }
}

#[test]
fn a_band_of_fifty_megahertz_holds_the_satellites_with_l5_that_others_found_in_it_and_no_other() {
    let Some(i) = two_bits(FILE) else { return };
    assert_found(&search(&i, &L5, 4000.0), &[(1, None), (3, None), (6, None), (9, None)]);
}

/// Prompt, early and late of each code period on both sides of E5, each by its subcarrier from the code's
/// epoch on.
fn periods(i: &[f32], hit: &Acquired, [code_a, code_b]: [&[i8]; 2]) -> Vec<[[Complex64; 3]; 2]> {
    let share = 1.0 + hit.doppler_hz / CENTRE_HZ;
    let chips_a_sample = 10.23e6 * share / RATE_HZ;
    let carrier = (IF_HZ + hit.doppler_hz) / RATE_HZ;
    let first = (CHIPS - hit.code_phase_chips) / chips_a_sample;
    let count = ((i.len() as f64 - first) * chips_a_sample / CHIPS) as usize;
    let mut all = vec![[[Complex64::default(); 3]; 2]; count];
    for (n, &value) in i.iter().enumerate() {
        let chips = (n as f64 - first) * chips_a_sample;
        if chips < 1.0 {
            continue;
        }
        let Some(own) = all.get_mut((chips / CHIPS) as usize) else { break };
        let chips = chips % CHIPS;
        let turn = |cycles: f64| {
            let (sin, cos) = libm::sincos(TAU * cycles.fract());
            Complex64::new(cos, sin)
        };
        let mixed = turn(-carrier * n as f64) * f64::from(value);
        let sub = turn(CYCLES_PER_CHIP * chips);
        for (side, (code, sub)) in own.iter_mut().zip([(code_a, sub), (code_b, sub.conj())]) {
            for (tap, offset) in side.iter_mut().zip([0.0, 0.5, -0.5]) {
                let place = (chips + offset).rem_euclid(CHIPS) as usize;
                *tap += mixed * sub * f64::from(code[place % code.len()]);
            }
        }
    }
    all
}

/// Position of a secondary code among code periods, and the ratio of the sum that finds it to the next.
pub fn secondary_code_place(prompts: &[Complex64], secondary_code: &[i8]) -> (usize, f64) {
    let sum = |first: usize, hz: f64| -> Complex64 {
        let one = |(k, prompt): (usize, &Complex64)| {
            let (sin, cos) = libm::sincos(-TAU * hz * 1e-3 * k as f64);
            prompt * Complex64::new(cos, sin) * f64::from(secondary_code[(first + k) % secondary_code.len()])
        };
        prompts.iter().enumerate().map(one).sum()
    };
    let best = |first: usize| (-8..=8).map(|step| sum(first, 5.0 * f64::from(step)).norm()).fold(0.0, f64::max);
    let mut places: Vec<(usize, f64)> = (0..secondary_code.len()).map(|first| (first, best(first))).collect();
    places.sort_by(|a, b| b.1.total_cmp(&a.1));
    (places[0].0, places[0].1 / places[1].1)
}

#[test]
fn both_sides_of_e5_are_found_where_others_found_them_and_are_one_signal_with_secondary_codes_and_subcarrier_in_step() {
    let Some(i) = two_bits(FILE) else { return };
    let listed = [(11, Some(9037.0)), (12, Some(4605.0)), (19, Some(9418.0)), (30, None)];
    let [lower, upper] = [&E5A, &E5B].map(|signal| search(&i, signal, 4000.0));
    for side in [&lower, &upper] {
        assert_found(side, &listed);
    }
    for (one, other) in lower.iter().zip(&upper) {
        let number = one.sv.number;
        let apart = libm::remainder(one.code_phase_chips - other.code_phase_chips, CHIPS);
        let dopplers_hz = [one.doppler_hz / E5A.centre_hz(), other.doppler_hz / E5B.centre_hz()].map(|f| f * CENTRE_HZ);
        assert!(apart.abs() < 0.1 && (dopplers_hz[0] / dopplers_hz[1] - 1.0).abs() < 0.01, "{one:?} {other:?}");
        let codes = [e5::Code::E5aPilot, e5::Code::E5bPilot].map(|which| e5::code(which, number).unwrap());
        let secondary_codes = [e5::secondary_code(number), e5::secondary_code(number + 50)].map(Option::unwrap);
        let doppler_hz = 0.5 * (dopplers_hz[0] + dopplers_hz[1]);
        let mut hit = Acquired { code_phase_chips: one.code_phase_chips - 0.5 * apart, doppler_hz, ..*one };
        let early_and_late = periods(&i, &hit, [&codes[0], &codes[1]]);
        let power = |tap: usize| -> f64 { early_and_late.iter().flatten().map(|side| side[tap].norm()).sum() };
        // Amplitudes of a triangle half a chip to either side.
        hit.code_phase_chips += 0.5 * (power(1) - power(2)) / (power(1) + power(2));
        let all = periods(&i, &hit, [&codes[0], &codes[1]]);
        let prompts = [0, 1].map(|side| all.iter().map(|own| own[side][0]).collect::<Vec<_>>());
        let places = [0, 1].map(|side| secondary_code_place(&prompts[side], &secondary_codes[side]));
        let signed =
            |k: usize, side: usize| prompts[side][k] * f64::from(secondary_codes[side][(places[side].0 + k) % 100]);
        let product: Complex64 = (0..all.len()).map(|k| signed(k, 0) * signed(k, 1).conj()).sum();
        let size: f64 = (0..all.len()).map(|k| prompts[0][k].norm() * prompts[1][k].norm()).sum();
        let (coherence, cycles) = (product.norm() / size, product.arg() / TAU);
        println!(
            "{number}: {apart:.3} chips apart, secondary codes {places:.2?}, {coherence:.3} at {cycles:.3} cycles"
        );
        // Secondary codes of both sides begin together. 41 of 100 chips agree, by chance not two thirds of
        // them.
        assert!(places[0].0 == places[1].0 && places.iter().all(|(_, lead)| *lead > 1.5), "{number}: {places:?}");
        // Their pilots have one phase where code and subcarrier begin: an error of the code of a thirtieth of
        // a chip turns one against the other by a tenth of a cycle. By chance all four do so once in 625
        // times.
        assert!(coherence > 0.9 && cycles.abs() < 0.1, "{number}: {coherence} {cycles}");
    }
}
