//! Galileo's E5 as one signal: its waveform against the printed table of phases, its spectrum against the
//! printed formula, and a recording of both sides.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use gnss::galileo::altboc::E5;
use gnss::galileo::e5::{self, Code, E5A, E5B};
use gnss::signal::{Component, Layer, Layers, Shape};
use num_complex::Complex64;
use receiver::correlate::{Edge, Nco, Replica, chips_to_units};

use super::recording::two_bits;
use super::recording_e5::{CENTRE_HZ, CHIPS, FILE, IF_HZ, RATE_HZ, assert_found, search, secondary_code_place};

/// Signs of e_a-I, e_b-I, e_a-Q and e_b-Q, then the phase in eighths of a cycle, 1 to 8, in each eighth of
/// the sub-carrier's period (Galileo OS SIS ICD 2.1, table 7).
const PHASES: &str = include_str!("../../data/witness/galileo_e5_phases.csv");

/// Power of the four codes by themselves: (2 + √2)/4.
fn linear_power() -> f64 {
    (2.0 + 2_f64.sqrt()) / 4.0
}

/// Phasors of each code state in each eighth, from the printed table.
fn phases() -> BTreeMap<[i8; 4], Vec<Complex64>> {
    let row = |line: &str| {
        let values: Vec<i8> = line.split(',').map(|value| value.parse().unwrap()).collect();
        let phase = |eighths: &i8| Complex64::from_polar(1.0, TAU * f64::from(*eighths) / 8.0);
        ([values[0], values[1], values[2], values[3]], values[4..].iter().map(phase).collect())
    };
    PHASES.lines().skip(1).map(row).collect()
}

#[test]
fn the_waveform_of_e5_is_what_the_table_of_phases_has_of_its_four_codes() {
    let table = phases();
    assert_eq!(table.len(), 16);
    // The part of each code: the mean of its sign times the whole, over all states of the others.
    let part = |code: usize, eighth: usize| -> Complex64 {
        table.iter().map(|(signs, phases)| phases[eighth] * f64::from(signs[code]) / 16.0).sum()
    };
    let number = 11;
    let codes = [Code::E5aData, Code::E5bData, Code::E5aPilot, Code::E5bPilot].map(|which| e5::code(which, number));
    let codes = codes.map(Option::unwrap);
    let own: Vec<Vec<i8>> = E5.components.iter().map(|component| (component.code)(number).unwrap()).collect();
    for chip in (0..300).chain(10_000..10_230) {
        for step in 0..12 {
            let eighth = (12 * chip + step) % 8;
            let printed: Complex64 = (0..4).map(|code| part(code, eighth) * f64::from(codes[code][chip])).sum();
            let value = |(component, code): (&Component, &Vec<i8>)| -> Complex64 {
                let layer = |layer: &Layer| {
                    let cycles = component.phase_cycles + layer.phase_cycles;
                    Complex64::from_polar(layer.weight, TAU * cycles) * f64::from(layer.pulse[step])
                };
                let wave: Complex64 = component.layers.iter().map(layer).sum();
                wave * (component.power_share.sqrt() * f64::from(code[chip]))
            };
            let found: Complex64 = E5.components.iter().zip(&own).map(value).sum();
            let error = (found * linear_power().sqrt() - printed).norm();
            assert!(error < 1e-12, "chip {chip}, step {step}: {found} for {printed}");
        }
    }
    // Whole periods of the sub-carrier in a code period: the table begins again where the codes do.
    assert_eq!(12 * e5::CODE_CHIPS % 8, 0);
}

#[test]
fn the_spectrum_of_e5_is_the_printed_one_once_the_products_are_added() {
    // S and P have the same sequences with weights that have changed places, one of them with its sign.
    let swapped = |layers: &[Layer]| -> Vec<Layer> {
        let pairs = layers.chunks_exact(2).flat_map(|pair| [(pair[0], pair[1].weight), (pair[1], -pair[0].weight)]);
        pairs.map(|(layer, weight)| Layer { weight, ..layer }).collect()
    };
    let codes = E5.components[0].shape();
    let layers = swapped(E5.components[0].layers);
    let products = Shape::between(&layers, &layers, 10.23e6);
    let (chip_hz, sub_hz) = (10.23e6, 15.345e6);
    for k in 1..600 {
        let hz = 123_457.0 * f64::from(k);
        let found = linear_power() * codes.density(hz) + (1.0 - linear_power()) * products.density(hz);
        // AltBOC(15,10) of constant envelope, 2·15/10 odd (E. Rebeyrol et al., "BOC power spectrum
        // densities", ION NTM 2005).
        let half = PI * hz / (2.0 * sub_hz);
        let bracket =
            libm::cos(half) * libm::cos(half) - libm::cos(half) - 2.0 * libm::cos(half) * libm::cos(0.5 * half) + 2.0;
        let ratio = libm::cos(PI * hz / chip_hz) / libm::cos(half);
        let printed = chip_hz / (2.0 * PI * PI * hz * hz) * ratio * ratio * bracket;
        // Rounding near the zeros of the denominator.
        assert!((found - printed).abs() < 1e-9 / chip_hz, "{hz}: {found} {printed}");
    }
}

/// Correlations of every code period of the recording at some delays, in chips, with signs of the second
/// side.
fn periods<const T: usize>(
    i: &[f32],
    (code_phase_chips, doppler_hz): (f64, f64),
    (replica, opposed): (&mut Replica, &dyn Fn(usize) -> bool),
    taps_chips: [f64; T],
) -> Vec<[Complex64; T]> {
    let turns = (IF_HZ + doppler_hz) / RATE_HZ;
    let step = (turns.fract() * 18_446_744_073_709_551_616.0) as u64;
    let chips_a_sample = 10.23e6 * (1.0 + doppler_hz / CENTRE_HZ) / RATE_HZ;
    let begin = |number: usize| (((number + 1) as f64 * CHIPS - code_phase_chips) / chips_a_sample).ceil() as usize;
    let mut all = Vec::new();
    for number in 0.. {
        let (from, to) = (begin(number), begin(number + 1));
        let Some(samples) = i.get(from..to) else { break };
        let chips = code_phase_chips + from as f64 * chips_a_sample - (number + 1) as f64 * CHIPS;
        let nco = Nco {
            carrier: step.wrapping_mul(from as u64),
            carrier_step: step,
            code: chips_to_units(chips),
            code_step: chips_to_units(chips_a_sample) as u64,
        };
        replica.set_second(opposed(number));
        all.push(replica.correlate(samples, &vec![0.0; samples.len()], &nco, &taps_chips.map(chips_to_units)));
    }
    all
}

#[test]
fn e5_as_one_signal_is_found_where_its_sides_are_and_both_pilots_make_the_narrow_peak_together() {
    let Some(i) = two_bits(FILE) else { return };
    let found = search(&i, &E5, 4000.0);
    assert_found(&found, &[(11, Some(9037.0)), (12, Some(4605.0)), (19, Some(9418.0)), (30, None)]);
    for hit in &found {
        let number = hit.sv.number;
        let pilots = [&E5.components[1], &E5.components[3]];
        let mut sides = pilots.map(|pilot| Replica::made(pilot, number, Layers::Whole, Edge::Area).unwrap());
        let secondary_codes = pilots.map(|pilot| pilot.secondary_code.of(number).unwrap());
        let at = (hit.code_phase_chips, hit.doppler_hz);
        let place = |side: usize, sides: &mut [Replica; 2]| {
            let prompts: Vec<Complex64> =
                periods(&i, at, (&mut sides[side], &|_| false), [0.0]).into_iter().map(|[prompt]| prompt).collect();
            secondary_code_place(&prompts, &secondary_codes[side])
        };
        let places = [place(0, &mut sides), place(1, &mut sides)];
        assert!(places[0].0 == places[1].0 && places.iter().all(|(_, lead)| *lead > 1.5), "{number}: {places:?}");
        let mut both = Replica::joined(&sides[0], &sides[1]).unwrap();
        let opposed = |number: usize| {
            let [upper, lower] = secondary_codes
                .each_ref()
                .map(|secondary_code| secondary_code[(places[0].0 + number) % secondary_code.len()]);
            upper != lower
        };
        // From half a chip behind to half a chip ahead, and far away.
        let taps: [f64; 51] = std::array::from_fn(|k| if k < 49 { (k as f64 - 24.0) / 48.0 } else { 40.0 * k as f64 });
        let mut shape = |opposed: &dyn Fn(usize) -> bool| -> Vec<f64> {
            let all = periods(&i, at, (&mut both, opposed), taps);
            let power = |k: usize| all.iter().map(|taps| taps[k].norm_sqr()).sum::<f64>();
            let noise = 0.5 * (power(49) + power(50));
            (0..49).map(|k| power(k) / noise - 1.0).collect()
        };
        let powers = shape(&opposed);
        let best = (8..41).max_by(|a, b| powers[*a].total_cmp(&powers[*b])).unwrap();
        let peak = powers[best];
        println!("{number}: {:+.3} chips, peak {peak:.2}: {powers:.2?}", (best as f64 - 24.0) / 48.0);
        // (1 − x)·cos(3πx): nothing at a sixth of a chip, 0.45 of the power at a third. Each period has noise
        // of its own: the deviation of a power is 1/√41 and twice the root of itself times that.
        let near = |shift: isize| {
            [best as isize - shift, best as isize + shift]
                .map(|k| powers.get(k as usize).map_or(0.0, |power| power / peak))
        };
        let sigma = (1.0 + 2.0 * peak).sqrt() / 41_f64.sqrt() / peak;
        assert!(near(8).iter().all(|share| *share < 0.1 + 4.0 * sigma), "{number}: {:?}", near(8));
        assert!(near(16).iter().any(|share| (share - 0.45).abs() < 0.15 + 4.0 * sigma), "{number}: {:?}", near(16));
        // Without the signs of the secondary codes the sides cancel in as many periods as they add in.
        let unsigned = shape(&|_| false);
        assert!(unsigned[best] < 0.75 * peak, "{number}: {} of {peak}", unsigned[best]);
    }
    assert_eq!([&E5A, &E5B].map(|side| E5.has_side(side)), [true, true]);
}
