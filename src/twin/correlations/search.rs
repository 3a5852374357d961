//! The largest cell of a search, drawn from the model.
//!
//! Cells about the true delay and Doppler have the expected sums and noise with the covariance of delays; all
//! others together have the largest of as many chi-square numbers. Limits: noise of neighbouring Dopplers
//! counts as independent, and the transforms' loss at the edge of their band is left out, 0.1 dB.

use num_complex::Complex64;
use receiver::correlate::correlator::{Cell, Code, Interval, Sought};
use receiver::correlate::{Nco, chips_to_units};
use receiver::threshold::threshold;

use super::Correlations;
use super::noise::Noise;
use super::ray::Question;

/// Dopplers on either side of the true one, and delays.
const NEAR: i64 = 2;
/// Part of the noise's streams that searches have.
const SEARCH: u64 = 1 << 50;
/// 2^64 as a float.
const TURN: f64 = 18_446_744_073_709_551_616.0;

pub(super) fn search(model: &Correlations, sought: &Sought) -> Cell {
    let own = own_cells(model, sought);
    let noise = other_cells(model, sought);
    own.into_iter().fold(noise, |best, cell| if cell.statistic > best.statistic { cell } else { best })
}

/// The largest of the cells in which there is noise alone.
fn other_cells(model: &Correlations, sought: &Sought) -> Cell {
    let stream = model.plan.noise.satellite(sought.code.link.sv).named(sought.code.link.signal.name).part(SEARCH);
    let uniform = |index: u64| (stream.part(sought.first).word(index) >> 11) as f64 / 9_007_199_254_740_992.0;
    let cells = (sought.cells * sought.dopplers_hz.len()).max(1) as f64;
    // A share u of searches stays below what a cell exceeds with 1 − u^(1/cells).
    let probability = -libm::expm1(libm::log(uniform(0).max(1e-300)) / cells);
    let codes = 1 + u32::from(sought.beside.is_some());
    let place = (uniform(1) * sought.dopplers_hz.len() as f64) as usize;
    Cell {
        statistic: threshold(probability, 2 * codes * sought.begins.len() as u32),
        doppler_hz: sought.dopplers_hz.get(place).copied().unwrap_or(0.0),
        code_phase_chips: uniform(2) * f64::from(sought.code.component.code_chips),
    }
}

/// The largest cell about the true delay and Doppler of each satellite that the code may be of.
fn own_cells(model: &Correlations, sought: &Sought) -> Vec<Cell> {
    let scene = model.plan.scene;
    let rate_hz = scene.clock.rate.hz();
    let [first_hz, second_hz, ..] = sought.dopplers_hz else { return Vec::new() };
    let step_hz = second_hz - first_hz;
    let mut found = Vec::new();
    let Some((made, _, place)) = model.made(&sought.code) else { return found };
    for sent in model.alike(place) {
        let transmitter = sent.transmitter;
        let middle = sought.first + (0.5 * sought.begins.iter().fold(0.0, |a: f64, b| a.max(*b))) as u64;
        let Some(rays) = transmitter.rays(scene, middle) else { continue };
        let later = middle + (1e-3 * rate_hz) as u64;
        let (Some(start), Some(here), Some(there)) = (rays.at(0, sought.first), rays.at(0, middle), rays.at(0, later))
        else {
            continue;
        };
        let doppler_hz = (here.carrier_cycles - there.carrier_cycles) / ((later - middle) as f64 / rate_hz);
        let Some(code) = transmitter.code_at(scene, made.index, sought.first, start.delay_s) else { continue };
        let phase = code.share * f64::from(made.component.code_chips);
        // Delays lie on a grid that knows nothing of the truth.
        let nearest = (phase / sought.lag_chips).round() * sought.lag_chips;
        let bin = ((doppler_hz - first_hz) / step_hz).round() as i64;
        for bin in (bin - NEAR..=bin + NEAR).filter(|bin| (0..sought.dopplers_hz.len() as i64).contains(bin)) {
            let doppler_hz = first_hz + bin as f64 * step_hz;
            found.extend(at_doppler(model, sought, nearest, doppler_hz, bin));
        }
    }
    found
}

/// The largest of five cells at one Doppler: three delays, and between them.
fn at_doppler(model: &Correlations, sought: &Sought, phase: f64, doppler_hz: f64, bin: i64) -> Option<Cell> {
    let offsets = [-sought.lag_chips, 0.0, sought.lag_chips];
    let mut powers = [0.0; 5];
    for code in std::iter::once(&sought.code).chain(&sought.beside) {
        for (dwell, begin) in sought.begins.iter().enumerate() {
            let sums = dwell_sums(model, sought, code, (phase, doppler_hz), (*begin, dwell as u64, bin), &offsets)?;
            let (made, ..) = model.made(code)?;
            let own = made.own(code.link.sv.number);
            let common = own.value(sought.lag_chips) / own.value(0.0);
            let between = |a: Complex64, b: Complex64| (a + b).norm_sqr() / (2.0 * (1.0 + common));
            let [a, b, c] = sums;
            let own = [a.norm_sqr(), between(a, b), b.norm_sqr(), between(b, c), c.norm_sqr()];
            powers.iter_mut().zip(own).for_each(|(power, own)| *power += own);
        }
    }
    let (place, statistic) = powers.into_iter().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let code_phase_chips = phase + (0.5 * place as f64 - 1.0) * sought.lag_chips;
    Some(Cell { statistic, doppler_hz, code_phase_chips })
}

/// Sums of one dwell at three delays, with noise of unit variance a component.
fn dwell_sums(
    model: &Correlations,
    sought: &Sought,
    code: &Code,
    (phase, doppler_hz): (f64, f64),
    (begin, dwell, bin): (f64, u64, i64),
    offsets: &[f64; 3],
) -> Option<[Complex64; 3]> {
    let (made, known, place) = model.made(code)?;
    let scene = model.plan.scene;
    let (rate_hz, carrier_hz) = (scene.clock.rate.hz(), code.link.carrier_hz());
    let from = sought.first + begin.ceil() as u64;
    let to = from + sought.samples.round() as u64;
    let step = code.component.chip_rate_hz / rate_hz * (1.0 + doppler_hz / carrier_hz);
    let turns = (scene.metadata.if_hz(carrier_hz) + doppler_hz) / rate_hz;
    let chips = phase + (from - sought.first) as f64 * step;
    let nco = Nco {
        carrier: 0,
        carrier_step: ((turns - turns.floor()) * TURN) as u64,
        code: chips_to_units(chips.rem_euclid(f64::from(code.component.code_chips))),
        code_step: chips_to_units(step) as u64,
    };
    let mut sums = [Complex64::ZERO; 3];
    let question = Question { interval: Interval { nco, from, to, end: to }, code, made, place };
    model.expect(&question, offsets, &mut sums);
    let deviation = known.deviations[0] * ((to - from) as f64).sqrt();
    if deviation <= 0.0 {
        // Without noise what is there exceeds any threshold.
        return Some(sums);
    }
    sums.iter_mut().for_each(|sum| *sum /= deviation);
    let stream = known.stream(code).part(SEARCH).part(sought.first).part(dwell).part(bin as u64);
    made.with_taps(code.link.sv.number, offsets, |taps| Noise { stream, share: 1.0 }.add(taps, 1.0, &mut sums));
    Some(sums)
}
