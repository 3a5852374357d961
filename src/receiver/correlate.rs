//! Correlation of samples with a replica: carrier wipe-off and any number of code taps in one pass.
//!
//! The replica's phases are exact integers: carrier in 2⁻⁶⁴ turns, code in 2⁻⁴⁷ chips. A replica sample is
//! the chip at the sample's instant ([`Edge::Nearest`]) or the mean of the chips over the interval of one
//! sample centred on that instant ([`Edge::Area`]). Sums come in four arithmetics: for samples of 8 bits
//! products with a table (`rows`) or pieces of equal sign by running sums (`pieces`), integers of 16 bits for
//! such samples ([`Replica::correlate_short`]), `f32` for any ([`Replica::correlate`]) and the obvious twin
//! of all in `f64` ([`Replica::slow`]). A chip has the steps of its pulse ([`Wave`]); phases count chips,
//! kernels see steps. A replica is a weighted sum of patterns of signs, each of which takes a pass: steps of
//! zero are the mean of +1 and −1, and a waveform of several layers has a pattern for each. Limits: area
//! edges are exact up to one step a sample; beyond that they leave steps out. A period has fewer than 2¹⁶
//! steps.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::{Component, Layers, Shape, Tone};

pub mod ahead;
mod carrier;
pub mod correlator;
pub mod fixed;
mod kernel;
#[cfg(test)]
mod noise;
mod pattern;
mod pieces;
mod rows;
mod short;
#[cfg(test)]
mod sides_tests;
mod single;
pub mod sums;
pub mod wave;

pub use carrier::phasor;
use pattern::Pattern;
use pieces::Pieces;
use rows::Rows;
use sums::Samples;
pub use wave::{Wave, fits, layers_refusal, steps_of_chip};

/// Rule that assigns a replica's chips to the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// Mean of the chip waveform over the sample's interval: code bias 0.1 m rms at 2.6 Msps at the worst
    /// phase.
    Area,
    /// Chip at the sample's instant: 0.7 to 1.5 m rms at 2.6 Msps, and a dead zone at multiples of the chip
    /// rate.
    Nearest,
}

/// Arithmetic of the correlations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arithmetic {
    /// Fast sums for samples of 8 bits. A table of the replica is multiplied where a chip has few samples.
    /// Otherwise running sums are used, with a difference for each sign change of the code. [`Self::I16`]
    /// replaces both where neither applies, for example with a carrier far from zero.
    Sums,
    /// Integers of 16 bits where samples have 8, `f32` where they have more.
    I16,
    /// Floating point of 32 bits.
    F32,
    /// One sample after the other: the exact twin, thirty times slower and more.
    F64,
}

/// Fraction bits of a code phase.
pub const CODE_BITS: u32 = 47;

/// Chips to code phase units.
pub fn chips_to_units(chips: f64) -> i64 {
    (chips * (1_u64 << CODE_BITS) as f64).round() as i64
}

/// Code phase units to chips.
pub fn units_to_chips(units: i64) -> f64 {
    units as f64 / (1_u64 << CODE_BITS) as f64
}

/// One period of a code, ready to be correlated with.
#[derive(Clone, Debug)]
pub struct Replica {
    wave: Wave,
    patterns: Vec<Pattern>,
    /// Tables for the correlation by pieces, one per pattern. Empty for nearest edges and where the pieces
    /// cannot be counted.
    pieces: Vec<Pieces>,
    /// Tables for the correlation by rows, present where a chip has few samples.
    rows: Option<Rows>,
}

/// Steps from which on a period cannot be counted in 64 bits.
const MOST_STEPS: usize = 1 << (63 - CODE_BITS);

/// Phases of the replica at the first sample and their steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nco {
    /// Carrier phase in 2⁻⁶⁴ turns.
    pub carrier: u64,
    /// Turns a sample; negative frequencies wrap.
    pub carrier_step: u64,
    /// Code phase in 2⁻⁴⁷ chips from the start of a period; outside [0, period) it is taken modulo the
    /// period.
    pub code: i64,
    /// Code phase units a sample.
    pub code_step: u64,
}

impl Replica {
    /// A BPSK replica of that code (`true` for a logical 1, sent as −1); `None` below 64 chips.
    pub fn new(chips: Vec<bool>, edge: Edge) -> Option<Self> {
        let values = chips.into_iter().map(|one| if one { -1 } else { 1 }).collect();
        Self::of(Wave { values, steps_per_chip: 1, share: 1.0 }, edge)
    }

    /// A replica of those steps; `None` below 64 of them and from 2¹⁶ on.
    pub fn of(wave: Wave, edge: Edge) -> Option<Self> {
        let patterns = Pattern::of(&wave, Complex64::ONE, edge)?;
        let pieces = by_pieces(&[(&wave, Complex64::ONE)], edge);
        Some(Self { wave, patterns, pieces, rows: None })
    }

    /// A replica of a satellite's component in that waveform; `None` where the documents assign it no code,
    /// or the code is too long.
    pub fn made(component: &Component, number: u8, waveform: Layers, edge: Edge) -> Option<Self> {
        let wave = Wave::new(component, number)?;
        if let Some(tone) = component.tone() {
            return Self::of_side(wave, edge, tone);
        }
        if waveform == Layers::Strongest {
            return Self::of(wave, edge);
        }
        let layers = component.layers.iter().map(|layer| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * layer.phase_cycles);
            Some((Wave::of(component, layer, number)?, layer.weight * Complex64::new(cos, -sin)))
        });
        let layers = layers.collect::<Option<Vec<_>>>()?;
        let patterns = layers.iter().map(|(wave, gain)| Pattern::of(wave, *gain, edge));
        let patterns = patterns.collect::<Option<Vec<_>>>()?.concat();
        let pieces = by_pieces(&layers.iter().map(|(wave, gain)| (wave, *gain)).collect::<Vec<_>>(), edge);
        Some(Self { wave, patterns, pieces, rows: None })
    }

    /// A replica as [`Self::made`] builds it, for samples whose spectrum may be inverted.
    pub fn made_in(component: &Component, number: u8, (made, edge): (Layers, Edge), inverted: bool) -> Option<Self> {
        let replica = Self::made(component, number, made, edge)?;
        Some(if inverted && component.tone().is_some() { replica.mirrored() } else { replica })
    }

    /// One sideband of a sub-carrier: its chips times the tone. Taps have the tone's phase at the prompt.
    fn of_side(wave: Wave, edge: Edge, tone: Tone) -> Option<Self> {
        let patterns = Pattern::of(&wave, tone.gain.conj() / tone.gain.norm(), edge)?;
        let toned = |pattern| Pattern { half_cycles: tone.half_cycles, ..pattern };
        Some(Self { wave, patterns: patterns.into_iter().map(toned).collect(), pieces: Vec::new(), rows: None })
    }

    /// Converts the replica to its form for an inverted spectrum.
    fn mirrored(mut self) -> Self {
        for pattern in &mut self.patterns {
            (pattern.half_cycles, pattern.gain) = (-pattern.half_cycles, pattern.gain.conj());
        }
        self
    }

    /// A replica of both sidebands of a sub-carrier with equal parts and the noise of one. Every tap has the
    /// tones' phases at its own position. `None` unless each is one sideband.
    pub fn joined(first: &Self, second: &Self) -> Option<Self> {
        let [first_pattern] = first.patterns.as_slice() else { return None };
        let [second_pattern] = second.patterns.as_slice() else { return None };
        let part = |pattern: &Pattern| Pattern {
            gain: pattern.gain * std::f64::consts::FRAC_1_SQRT_2,
            turns_at_taps: true,
            ..pattern.clone()
        };
        let patterns = vec![part(first_pattern), part(second_pattern)];
        Some(Self { wave: first.wave.clone(), patterns, pieces: Vec::new(), rows: None })
    }

    /// Inverts the second sideband, or does not.
    pub fn set_second(&mut self, inverted: bool) {
        if let [_, second] = self.patterns.as_mut_slice() {
            second.is_inverted = inverted;
        }
    }

    /// The oscillators with the sub-carrier of its first pattern.
    pub fn beside_carrier(&self, nco: &Nco) -> Nco {
        self.patterns.first().map_or(*nco, |pattern| pattern.beside_carrier(nco))
    }

    /// Makes what is quicker by a table for a code that moves by about `code_step` phase units a sample.
    pub fn prepare(&mut self, code_step: u64) {
        let alone = matches!(self.pieces.as_slice(), [alone] if alone.gain() == Complex64::ONE);
        self.rows = if alone { Rows::of(&self.wave, code_step) } else { None };
    }

    /// Length of the period in code phase units.
    pub fn period(&self) -> i64 {
        ((self.wave.values.len() / self.wave.steps_per_chip) as i64) << CODE_BITS
    }

    /// The share of chips that are this code's turn.
    pub fn share(&self) -> f64 {
        self.wave.share
    }

    /// Delays at which the code's correlation with itself is smallest, up to `places` of them, spread over
    /// the period. A chip to either side is included. A correlator at such a delay measures noise.
    pub fn quiet_taps(&self, places: usize) -> Vec<i64> {
        let (steps, each) = (&self.wave.values, self.wave.steps_per_chip);
        let length = steps.len();
        let correlation = |shift: usize| {
            let (before, behind) = steps.split_at(shift % length);
            let products = |a: &[i8], b: &[i8]| a.iter().zip(b).map(|(a, b)| i32::from(a * b)).sum::<i32>();
            (products(steps, behind) + products(&steps[behind.len()..], before)).abs()
        };
        let candidates = 4 * places;
        let chips = length / each;
        let mut ranked: Vec<(i32, usize)> = (1..=candidates)
            .map(|n| n * chips / (candidates + 1))
            .filter(|chip| (4..chips.saturating_sub(4)).contains(chip))
            .map(|chip| ((each * (chip - 1)..=each * (chip + 1)).map(correlation).max().unwrap_or(0), chip))
            .collect();
        ranked.sort_unstable();
        ranked.into_iter().take(places).map(|(_, chip)| (chip as i64) << CODE_BITS).collect()
    }

    /// Σ x·conj(replica) with the replica at each of `taps` (code phase units ahead of the prompt), in `f32`.
    /// The sums do not depend on the processor: sixteen fixed lanes, each 1024 samples added in one order.
    pub fn correlate<const T: usize>(&self, i: &[f32], q: &[f32], nco: &Nco, taps: &[i64; T]) -> [Complex64; T] {
        self.at_speed(kernel::Fast::Single, (i, q), nco, taps)
    }

    /// Correlation in integers of 16 bits, for samples of 8 bits within ±127.5 in steps of 2⁻⁷ or more. Falls
    /// back to [`Self::correlate`] at code steps that do not suit 16 bits (C/A: below 1.06 and above 65
    /// Msps).
    pub fn correlate_short<const T: usize>(&self, i: &[f32], q: &[f32], nco: &Nco, taps: &[i64; T]) -> [Complex64; T] {
        self.at_speed(kernel::Fast::Short, (i, q), nco, taps)
    }

    fn at_speed<const T: usize>(
        &self,
        fast: kernel::Fast,
        samples: (&[f32], &[f32]),
        nco: &Nco,
        taps: &[i64; T],
    ) -> [Complex64; T] {
        let level = kernel::Level::best();
        self.sum(nco, taps, |pattern, nco, taps| kernel::correlate(level, fast, pattern, samples, nco, taps))
    }

    /// The sums of all patterns, by phases of their steps, with their gains.
    fn sum<const T: usize>(
        &self,
        nco: &Nco,
        taps: &[i64; T],
        one: impl Fn(&Pattern, &Nco, &[i64; T]) -> [Complex64; T],
    ) -> [Complex64; T] {
        let of = |pattern: &Pattern| {
            let (nco, taps) = pattern.in_steps(nco, taps);
            one(pattern, &nco, &taps)
        };
        match self.patterns.as_slice() {
            [alone] if alone.gain == Complex64::ONE => of(alone),
            several => several.iter().fold([Complex64::ZERO; T], |mut sums, pattern| {
                let own = taps.iter().zip(of(pattern));
                sums.iter_mut().zip(own).for_each(|(sum, (tap, own))| *sum += pattern.factor(*tap) * own);
                sums
            }),
        }
    }

    /// One of the four. [`Arithmetic::Sums`] and [`Arithmetic::I16`] are for samples that
    /// [`Self::correlate_short`] can take; without running sums the former is the latter.
    pub fn correlate_in<'a, const T: usize>(
        &self,
        arithmetic: Arithmetic,
        samples: impl Into<Samples<'a>>,
        nco: &Nco,
        taps: &[i64; T],
    ) -> [Complex64; T] {
        let samples = samples.into();
        match arithmetic {
            Arithmetic::Sums => {
                let by_rows = self.correlate_rows(samples, nco, taps);
                let found = by_rows.or_else(|| self.correlate_sums(samples, nco, taps));
                found.unwrap_or_else(|| samples.by_planes(|i, q| self.correlate_short(i, q, nco, taps)))
            }
            Arithmetic::I16 => samples.by_planes(|i, q| self.correlate_short(i, q, nco, taps)),
            Arithmetic::F32 => samples.by_planes(|i, q| self.correlate(i, q, nco, taps)),
            Arithmetic::F64 => samples.by_planes(|i, q| self.slow(i, q, nco, taps)),
        }
    }

    /// Correlation by rows. `None` without fixed-point samples, or where the steps of carrier and code do not
    /// suit them.
    fn correlate_rows<const T: usize>(&self, samples: Samples, nco: &Nco, taps: &[i64; T]) -> Option<[Complex64; T]> {
        let (rows, fixed) = (self.rows.as_ref()?, samples.fixed?);
        rows.suit(nco).then(|| rows.correlate(kernel::Level::best(), fixed, nco, taps))
    }

    /// True if [`Arithmetic::Sums`] uses fixed-point samples at these steps of carrier and code.
    pub fn takes_fixed(&self, nco: &Nco) -> bool {
        self.rows.as_ref().is_some_and(|rows| rows.suit(nco))
    }

    /// Correlation by pieces. `None` without running sums, or where the steps of carrier and code do not suit
    /// them.
    fn correlate_sums<const T: usize>(&self, samples: Samples, nco: &Nco, taps: &[i64; T]) -> Option<[Complex64; T]> {
        let sums = samples.sums?;
        if self.pieces.is_empty() || !self.pieces.iter().all(|pieces| pieces.suit(nco)) {
            return None;
        }
        let level = kernel::Level::best();
        let mut totals = [Complex64::ZERO; T];
        for pieces in &self.pieces {
            let found = pieces.correlate(level, sums, nco, taps);
            totals.iter_mut().zip(found).for_each(|(total, sum)| *total += pieces.gain() * sum);
        }
        Some(totals)
    }

    /// True if [`Arithmetic::Sums`] uses running sums at these steps of carrier and code.
    pub fn takes_sums(&self, nco: &Nco) -> bool {
        !self.takes_fixed(nco) && !self.pieces.is_empty() && self.pieces.iter().all(|pieces| pieces.suit(nco))
    }

    /// Reference correlation: `f64`, one sample after the other.
    pub fn slow<const T: usize>(&self, i: &[f32], q: &[f32], nco: &Nco, taps: &[i64; T]) -> [Complex64; T] {
        self.sum(nco, taps, |pattern, nco, taps| pattern.slow((i, q), nco, taps))
    }

    /// The replica's sample, of its part in phase, when its code phase is `code`.
    pub(crate) fn value(&self, code: i64, step: u64) -> f64 {
        let one = |pattern: &Pattern| {
            let each = pattern.steps_per_chip;
            pattern.gain.re * pattern.value(code.rem_euclid(self.period()) * each as i64, step * each as u64)
        };
        self.patterns.iter().map(one).sum()
    }
}

/// The pieces of waves whose sum is a replica; none unless all can be counted.
fn by_pieces(waves: &[(&Wave, Complex64)], edge: Edge) -> Vec<Pieces> {
    match edge {
        Edge::Area => {
            waves.iter().map(|(wave, gain)| Pieces::of(wave, *gain)).collect::<Option<_>>().unwrap_or_default()
        }
        Edge::Nearest => Vec::new(),
    }
}

/// Σ |x|² of samples.
pub fn power(i: &[f32], q: &[f32]) -> f64 {
    kernel::power(kernel::Level::best(), i, q)
}

/// Error of the code, root mean square, while every chip meets the same few positions between samples: at
/// whole ratios of sample and chip rate, or ratios of small numbers, and a satellite whose code does not move
/// against the samples. In metres.
///
/// With `q` positions in turn nearest edges know the code to a sample in `q` (uniform: over √12). Area edges
/// against a signal limited to half the rate err by 5.1, 1.61 and 0.11 m at 2, 4 and 10 samples a chip; the
/// law is the second's, with the square.
pub fn standing_bias_m(edge: Edge, rate_hz: f64, component: &Component) -> f64 {
    let chips = f64::from(component.code_chips);
    // Positions drift apart within a code period when the ratio misses by more than this.
    let meets = |q: u32| {
        let samples = f64::from(q) * rate_hz / component.chip_rate_hz;
        (samples - samples.round()).abs() < 1.0 / chips
    };
    let Some(q) = (1..=32).find(|q| meets(*q)) else { return 0.0 };
    let samples_per_chip = f64::from(q) * rate_hz / component.chip_rate_hz;
    let chip_m = SPEED_OF_LIGHT_MPS / component.chip_rate_hz;
    match edge {
        Edge::Nearest => chip_m / samples_per_chip / 12_f64.sqrt(),
        Edge::Area => 0.0055 * chip_m * (4.0 / samples_per_chip) * (4.0 / samples_per_chip),
    }
}

/// 2⁶⁴ as a float.
pub(crate) const TURN: f64 = 18_446_744_073_709_551_616.0;

/// The mean correlation of a replica with a signal of the same edges, `offset` chips apart, and its slope for
/// positive offsets: that of ideal waveforms (`shape`), seen twice through the mean over `chips_per_sample`.
///
/// At offset 0 it is the power of the replica, below one for area edges.
pub fn correlation(shape: &Shape, edge: Edge, chips_per_sample: f64, offset: f64) -> (f64, f64) {
    let width = match edge {
        Edge::Nearest => 0.0,
        Edge::Area => chips_per_sample,
    };
    // Distribution function of the sum of two uniform variables on ±width/2.
    let below = |x: f64| {
        if width <= 0.0 {
            return if x > 0.0 {
                1.0
            } else if x < 0.0 {
                0.0
            } else {
                0.5
            };
        }
        let y = (x / width).clamp(-1.0, 1.0);
        if y < 0.0 { 0.5 * (1.0 + y) * (1.0 + y) } else { 1.0 - 0.5 * (1.0 - y) * (1.0 - y) }
    };
    // The ideal correlation is a polygon: its slope is a sum of steps at its corners.
    let step = shape.step_s() / shape.chip_s();
    let corners = (shape.chip_s() / shape.step_s()).round() as i32;
    let value = |corner: i32| shape.correlation(f64::from(corner) * shape.step_s());
    let bends: Vec<(f64, f64)> = (-corners..=corners)
        .rev()
        .map(|k| (f64::from(k) * step, (value(k + 1) - 2.0 * value(k) + value(k - 1)) / step))
        .filter(|(_, bend)| *bend != 0.0)
        .collect();
    let slope = |x: f64| bends.iter().map(|(at, bend)| bend * below(x - at)).sum::<f64>();
    // The slope integrates to the value from the far side, where the correlation is zero.
    let end = 1.0 + width;
    if offset >= end {
        return (0.0, 0.0);
    }
    const STEPS: u32 = 2000;
    let h = (end - offset) / f64::from(STEPS);
    let area: f64 = (0..STEPS).map(|k| slope(offset + h * (f64::from(k) + 0.5))).sum();
    (-area * h, slope(offset))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;

    fn noise(n: usize, seed: u64) -> Vec<f32> {
        let mut state = seed;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 40) as f32 / 16_777_216.0 - 0.5
            })
            .collect()
    }

    fn replica(edge: Edge) -> Replica {
        Replica::new(gnss::gps::l1ca::code(7).unwrap(), edge).unwrap()
    }

    /// Correlation at every instruction set of this processor. The results have to be equal.
    fn same_at_every_level<const T: usize>(
        fast: kernel::Fast,
        replica: &Replica,
        samples: (&[f32], &[f32]),
        nco: &Nco,
        taps: &[i64; T],
    ) -> [Complex64; T] {
        let of = |level| {
            let power = kernel::power(level, samples.0, samples.1);
            (kernel::correlate(level, fast, &replica.patterns[0], samples, nco, taps), power)
        };
        let (levels, baseline) = (kernel::Level::all(), of(kernel::Level::Baseline));
        for level in levels {
            assert_eq!(of(level), baseline, "{level:?}, {} samples", samples.0.len());
        }
        baseline.0
    }

    #[test]
    fn the_kernel_agrees_with_its_slow_twin_for_every_short_length_and_offset() {
        let (i, q) = (noise(200, 1), noise(200, 2));
        let taps = [chips_to_units(0.25), 0, chips_to_units(-0.25), chips_to_units(-31.0)];
        for edge in [Edge::Area, Edge::Nearest] {
            let replica = replica(edge);
            for length in 0..=130 {
                for offset in 0..32_usize {
                    let nco = Nco {
                        carrier: 0x1234_5678_9abc_def0_u64.wrapping_mul(offset as u64 + 1),
                        carrier_step: (0.173 * TURN) as u64,
                        code: chips_to_units(1023.0 - 1.37 * offset as f64),
                        code_step: chips_to_units(1.023 / 2.6) as u64,
                    };
                    let (i, q) = (&i[offset..offset + length], &q[offset..offset + length]);
                    let fast = same_at_every_level(kernel::Fast::Single, &replica, (i, q), &nco, &taps);
                    let slow = replica.slow(i, q, &nco, &taps);
                    // f32 rounding: 130 terms of size 0.7, each 6e-8, and the phasor 1e-6 after 9 turns.
                    for (a, b) in fast.iter().zip(&slow) {
                        assert!((a - b).norm() < 3e-5, "{edge:?} {length} {offset}: {a} {b}");
                    }
                    let energy: f64 = i.iter().chain(q).map(|&x| f64::from(x) * f64::from(x)).sum();
                    assert!((power(i, q) - energy).abs() < 1e-4);
                }
            }
        }
    }

    /// Samples of 8 bits, uniform within ±64.
    fn bytes(n: usize, seed: u64) -> Vec<f32> {
        noise(n, seed).into_iter().map(|x| (128.0 * x).round()).collect()
    }

    #[test]
    fn short_integers_agree_with_the_slow_twin_for_every_short_length_and_offset() {
        let (i, q) = (bytes(200, 5), bytes(200, 6));
        let taps = [chips_to_units(0.25), 0, chips_to_units(-0.25), chips_to_units(-31.0)];
        for (edge, rate) in [(Edge::Area, 2.6), (Edge::Nearest, 2.6), (Edge::Area, 1.1), (Edge::Area, 26.0)] {
            let replica = replica(edge);
            let step = chips_to_units(1.023 / rate);
            let steps = short::Steps::new(&replica.patterns[0], step as u64).unwrap();
            for length in 0..=130 {
                for offset in 0..32_usize {
                    let nco = Nco {
                        carrier: 0x1234_5678_9abc_def0_u64.wrapping_mul(offset as u64 + 1),
                        carrier_step: (0.173 * TURN) as u64,
                        code: chips_to_units(1023.0 - 1.37 * offset as f64),
                        code_step: step as u64,
                    };
                    let (i, q) = (&i[offset..offset + length], &q[offset..offset + length]);
                    let fast = same_at_every_level(kernel::Fast::Short, &replica, (i, q), &nco, &taps);
                    let slow = replica.slow(i, q, &nco, &taps);
                    for ((a, b), tap) in fast.iter().zip(&slow).zip(taps) {
                        // A sample of at most 90 LSB: its replica errs by half of 2⁻⁸ and, at an edge, by two
                        // halves of the phase's last bit times the slope of 2 a step; its rotation by 2⁻⁷ LSB
                        // and 2⁻¹⁶ of it.
                        let unit = 1.0 / f64::from(1_u32 << steps.fine);
                        let sample = 90.0 * (1.0 / 512.0 + 2.0 * unit / units_to_chips(step) + 2e-5) + 0.011;
                        // Errors have any sign: four standard deviations of the sum, were they all this
                        // large.
                        let mut bar = sample * (4.0 * (length as f64).sqrt()).min(length as f64);
                        if edge == Edge::Nearest {
                            // Within the phase's last bit of an edge either chip will do.
                            let near = |n: i64| {
                                let phase = units_to_chips((nco.code + tap + n * step).rem_euclid(1 << CODE_BITS));
                                phase.min(1.0 - phase) < unit
                            };
                            bar += 180.0 * (0..length as i64).filter(|&n| near(n)).count() as f64;
                        }
                        assert!((a - b).norm() <= bar, "{edge:?} {rate} {length} {offset}: {a} {b} {bar}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_replica_of_the_whole_waveform_has_every_layer_with_its_weight_to_the_end_of_the_period() {
        let pilot = &E1.components[1];
        let chips = (pilot.code)(11).unwrap();
        let replica = Replica::made(pilot, 11, Layers::Whole, Edge::Nearest).unwrap();
        let step = chips_to_units(1.023 / 13.0);
        for chip in [0, 1, 2000, 3000, 4091] {
            for sixth in 0..12 {
                // OS SIS ICD 2.1, 2.3.3: E1-C is √(10/11) BOC(1,1) less √(1/11) BOC(6,1).
                let slow = if sixth < 6 { 1.0 } else { -1.0 };
                let fast = if sixth % 2 == 0 { 1.0 } else { -1.0 };
                let sent = f64::from(chips[chip]) * ((10.0_f64 / 11.0).sqrt() * slow - (1.0_f64 / 11.0).sqrt() * fast);
                let code = chips_to_units(chip as f64 + (f64::from(sixth) + 0.5) / 12.0);
                assert!((replica.value(code, step as u64) - sent).abs() < 1e-12, "{chip} {sixth}");
            }
        }
        // A segment across the end of the period, 49 104 steps on.
        let (i, q) = (noise(2000, 8), noise(2000, 9));
        let taps = [chips_to_units(0.05), 0, chips_to_units(-0.05)];
        let nco = Nco {
            carrier: 99,
            carrier_step: (0.01 * TURN) as u64,
            code: chips_to_units(4092.0 - 80.0),
            code_step: step as u64,
        };
        for edge in [Edge::Area, Edge::Nearest] {
            let replica = Replica::made(pilot, 11, Layers::Whole, edge).unwrap();
            let (fast, slow) = (replica.correlate(&i, &q, &nco, &taps), replica.slow(&i, &q, &nco, &taps));
            // 2000 terms of size 0.7, each 6e-8 off, in lanes of 128.
            assert!(fast.iter().zip(&slow).all(|(a, b)| (a - b).norm() < 1e-3), "{edge:?}: {fast:?} {slow:?}");
        }
        assert!(layers_refusal(Layers::Whole, &E1, 12.2e6).unwrap().contains("12.276 Msps"));
        for (made, signal, rate_hz) in
            [(Layers::Whole, &E1, 12.3e6), (Layers::Strongest, &E1, 2e6), (Layers::Whole, &L1_CA, 2e6)]
        {
            assert_eq!(layers_refusal(made, signal, rate_hz), None);
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits_and_long_sums_stay_exact() {
        let single = (noise(30_011, 3), noise(30_011, 4));
        let short = (bytes(30_011, 3), bytes(30_011, 4));
        for (edge, rate) in [(Edge::Area, 26.0), (Edge::Nearest, 26.0), (Edge::Area, 2.6), (Edge::Area, 1.5)] {
            let replica = replica(edge);
            let nco = Nco {
                carrier: 77,
                carrier_step: (-0.01 * TURN) as i64 as u64,
                code: -chips_to_units(0.4),
                code_step: chips_to_units(1.023 / rate) as u64,
            };
            let taps = [chips_to_units(0.25), 0, chips_to_units(-0.25)];
            // Noise of the sum: √(30011/6) = 71 times the samples' width. Lanes of 64 terms keep 1e-4 of it
            // in f32; in 16 bits a sample errs by 2⁻⁹ to 2⁻⁸ of itself, and with nearest edges 2 in 10⁴
            // samples have the other chip.
            for (fast, (i, q), bar) in
                [(kernel::Fast::Single, &single, 7e-3), (kernel::Fast::Short, &short, 71.0 * 128.0 * 0.03)]
            {
                let all: Vec<_> = kernel::Level::all()
                    .into_iter()
                    .map(|level| {
                        let pattern = &replica.patterns[0];
                        let sums = kernel::correlate(level, fast, pattern, (i, q), &nco, &taps);
                        let [e, p, l] = taps;
                        let more = [e, p, l, chips_to_units(7.0), 2 * e];
                        let [early, prompt, late, noise, side] =
                            kernel::correlate(level, fast, pattern, (i, q), &nco, &more);
                        assert_eq!([early, prompt, late], sums, "{level:?} {edge:?} {rate} {fast:?}");
                        (sums, [noise, side], kernel::power(level, i, q))
                    })
                    .collect();
                assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{edge:?} {rate} {fast:?}");
                let slow = replica.slow(i, q, &nco, &taps);
                for (a, b) in all[0].0.iter().zip(&slow) {
                    assert!((a - b).norm() < bar, "{edge:?} {rate} {fast:?}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn full_scale_in_step_with_the_replica_does_not_overflow_short_integers() {
        let replica = replica(Edge::Nearest);
        let step = chips_to_units(1.023 / 2.6);
        let nco = Nco { carrier: 0, carrier_step: 0, code: 0, code_step: step as u64 };
        let i: Vec<f32> = (0..5000).map(|n| 127.5 * replica.value(n * step, step as u64) as f32).collect();
        let [sum] = replica.correlate_short(&i, &i, &nco, &[0]);
        // Within 2⁻¹³ chip of an edge either chip will do: about 5000 · 2⁻¹² samples.
        assert!((sum / (5000.0 * 127.5) - Complex64::new(1.0, 1.0)).norm() < 0.002, "{sum}");
    }

    #[test]
    fn taps_stand_anywhere_in_the_longest_code_with_the_code_anywhere_in_it() {
        let component = &gnss::signal::synthetic::MIXED.components[0];
        let replica = Replica::of(Wave::new(component, 4).unwrap(), Edge::Area).unwrap();
        let period = replica.period();
        let step = chips_to_units(1.023 / 5.3);
        let samples: Vec<f32> = (0..300).map(|n| ((n * n * 7 + n) % 17) as f32 - 8.0).collect();
        for code in [-chips_to_units(0.5), 0, period / 2, period - 1] {
            let nco = Nco { carrier: 1 << 61, carrier_step: 1 << 57, code, code_step: step as u64 };
            let taps = [chips_to_units(0.125), -chips_to_units(0.5), period - chips_to_units(5.0)];
            let (fast, slow) =
                (replica.correlate(&samples, &samples, &nco, &taps), replica.slow(&samples, &samples, &nco, &taps));
            // Three hundred products in f32 of values up to 8.
            fast.iter().zip(slow).for_each(|(a, b)| assert!((a - b).norm() < 0.01, "{code}: {a} {b}"));
        }
    }

    #[test]
    fn the_correlation_model_is_the_measured_one() {
        // Mean over many sub-sample phases of the replica's own products; sidelobes of a Gold code are below
        // 65/1023.
        for (edge, rate) in [(Edge::Area, 2.6007), (Edge::Nearest, 2.6007), (Edge::Area, 10.3007)] {
            let replica = replica(edge);
            let step = chips_to_units(1.023 / rate);
            let chips_per_sample = units_to_chips(step);
            for offset in [0.0, 0.05, 0.25, 0.5] {
                let tap = chips_to_units(offset);
                let n = 400_000_i64;
                let sum: f64 = (0..n)
                    .map(|k| (i128::from(k) * i128::from(step) % i128::from(replica.period())) as i64)
                    .map(|c| replica.value(c, step as u64) * replica.value(c + tap, step as u64))
                    .sum();
                let shape = L1_CA.components[0].shape();
                let (model, _) = correlation(&shape, edge, chips_per_sample, offset);
                // The code is not random: its correlation one chip away is up to 65/1023, of which area edges
                // see a sixth each side at offset 0 and up to half at 0.5.
                assert!(
                    (sum / n as f64 - model).abs() < 0.5 * 65.0 / 1023.0,
                    "{edge:?} {rate} {offset}: {} {model}",
                    sum / n as f64
                );
            }
        }
    }
}
