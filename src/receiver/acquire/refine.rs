//! Refinement of a cell of the search to a start for tracking: Doppler to some hertz, code phase to a few
//! hundredths of a chip, C/N0.
//!
//! Prompt sums over single code periods are squared, which removes data signs (Costas). The frequency of the
//! squares is read from a padded FFT. Then an early-minus-late comparison of powers, half a chip to either
//! side, centres the code phase. The noise power comes from correlators at code phases where the
//! code's own autocorrelation is small.

use fft::Planner;
use num_complex::Complex;

use super::grid::Grid;
use super::settings::sign_turns_often;
use crate::correlate::correlator::{Coded, Correlator, Interval};
use crate::correlate::{Arithmetic, Nco, TURN, chips_to_units, steps_of_chip, units_to_chips};
use gnss::signal::{Component, Layer, Shape};

/// Correlators that measure the noise.
const NOISE_TAPS: usize = 16;
/// The FFT of the squares is padded by this factor at least, then a parabola takes over.
const PADDING: usize = 8;

/// A satellite's position after refinement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined {
    /// Code phase at the first sample of the block, in [0, code length).
    pub code_phase_chips: f64,
    pub doppler_hz: f64,
    pub cn0_hz: f64,
    /// Power of a code period's sum less that of its noise, in the samples' own units: compares hits whatever
    /// noise each met.
    pub power: f64,
}

/// One satellite's correlators over the samples that the search saw.
struct Correlators<'a, C> {
    grid: &'a Grid,
    correlator: &'a C,
    /// Number of the first sample.
    first: u64,
    coded: &'a Coded,
    code_chips: f64,
    periods: usize,
}

/// Refines what the search made of a satellite; its C/N0 is kept if the refined power does not exceed the
/// noise.
pub(super) fn refine<C: Correlator>(
    grid: &Grid,
    correlator: &C,
    component: &Component,
    coded: &Coded,
    coarse: Refined,
    periods: usize,
) -> Refined {
    let code_chips = f64::from(component.code_chips);
    let correlators = Correlators { grid, correlator, first: correlator.fresh(), coded, code_chips, periods };
    let mut phase = coarse.code_phase_chips.rem_euclid(code_chips);
    let doppler_hz = if sign_turns_often(component) {
        correlators.unsplit_doppler_hz(phase, coarse.doppler_hz)
    } else {
        coarse.doppler_hz
    };
    let doppler_hz = correlators.fine_doppler_hz(phase, doppler_hz);

    let shape = searched_shape(component);
    let quiet_chips: Vec<f64> = coded.replica.quiet_taps(NOISE_TAPS).into_iter().map(units_to_chips).collect();
    // Taps of one pass share the carrier.
    let (fours, rest) = quiet_chips.as_chunks::<4>();
    let of_fours = fours.iter().flat_map(|offsets| correlators.powers(phase, doppler_hz, offsets));
    let noises: Vec<f64> =
        of_fours.chain(rest.iter().map(|&offset| correlators.powers(phase, doppler_hz, &[offset])[0])).collect();
    let noise = mean(noises.into_iter());
    // The difference of the early and the late power is four times value, slope and error, times the prompt
    // power. Roots of powers near the noise would be zero as often as not, and no measure of the error.
    let steps = steps_of_chip(component);
    let reach = if steps > 1 { 0.25 / steps as f64 } else { 0.5 };
    let correlation = |chips: f64| shape.correlation(chips / component.chip_rate_hz);
    // Beside the peak it falls in a straight line.
    let slope = (correlation(0.5 * reach) - correlation(reach)) / (0.5 * reach);
    let scale = 0.25 * correlation(0.0).powi(2) / (correlation(reach) * slope);
    let mut power = 0.0;
    for _ in 0..3 {
        let [early, prompt, late] = correlators.powers(phase, doppler_hz, &[reach, 0.0, -reach]);
        power = prompt;
        if power > noise {
            phase += (scale * (early - late) / (power - noise)).clamp(-0.5 * reach, 0.5 * reach);
        }
    }
    let measured = if noise > 0.0 { (power / noise - 1.0) / component.period_s() } else { 0.0 };
    Refined {
        code_phase_chips: phase.rem_euclid(code_chips),
        doppler_hz,
        cn0_hz: if measured > 0.0 { measured } else { coarse.cn0_hz },
        power: (power - noise).max(0.0),
    }
}

/// Correlation of the layer that a search looks for: of one sideband of a sub-carrier that of chips.
pub(super) fn searched_shape(component: &Component) -> Shape {
    let made = component.tone().map_or(component.strongest(), |_| Some(&Layer::BPSK));
    made.map_or_else(
        || component.shape(),
        |layer| {
            let layers = [*layer];
            Shape::between(&layers, &layers, component.chip_rate_hz)
        },
    )
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

/// Turns without their whole number, in 2⁻⁶⁴ turns.
fn fraction_of_turn(turns: f64) -> u64 {
    ((turns - turns.round()) * TURN) as i64 as u64
}

impl<C: Correlator> Correlators<'_, C> {
    /// Prompt sums over whole code periods with the replica ahead by `offsets` chips: `[offset][period]`.
    fn sums<const T: usize>(&self, phase_chips: f64, doppler_hz: f64, offsets: &[f64; T]) -> [Vec<Complex<f64>>; T] {
        let step = self.grid.received_chips_per_sample(doppler_hz);
        let turns = self.grid.frequency_hz(doppler_hz) / self.grid.rate_hz;
        let taps = offsets.map(chips_to_units);
        let mut sums = offsets.map(|_| Vec::with_capacity(self.periods));
        let begin = |period: usize| ((((period + 1) as f64) * self.code_chips - phase_chips) / step).ceil() as usize;
        for period in 0..self.periods {
            let (from, to) = (begin(period), begin(period + 1));
            let interval = |nco| {
                let [from, to] = [from, to].map(|sample| self.first + sample as u64);
                Interval { nco, from, to, end: to }
            };
            if from > to || self.first + to as u64 > self.correlator.end() {
                break;
            }
            let nco = Nco {
                carrier: fraction_of_turn(turns * from as f64),
                carrier_step: fraction_of_turn(turns),
                // Code phase within the period, so that its resolution does not fall with the length of the
                // block.
                code: chips_to_units(phase_chips + from as f64 * step - (period + 1) as f64 * self.code_chips),
                code_step: chips_to_units(step) as u64,
            };
            let taps = self.correlator.sums(&interval(nco), self.coded, Arithmetic::F32, &taps);
            sums.iter_mut().zip(taps).for_each(|(sum, tap)| sum.push(tap));
        }
        sums
    }

    fn powers<const T: usize>(&self, phase_chips: f64, doppler_hz: f64, offsets: &[f64; T]) -> [f64; T] {
        self.sums(phase_chips, doppler_hz, offsets).map(|sum| mean(sum.iter().map(|s| s.norm_sqr())))
    }

    /// The search's sums do not begin where code periods do. Where the sign turns in the middle of one its
    /// line splits in two, 0.74/T to either side, and a cell there may have won. Sums over whole code periods
    /// know better.
    fn unsplit_doppler_hz(&self, phase_chips: f64, coarse_hz: f64) -> f64 {
        let spacing_hz = 0.5 / (self.grid.period_samples / self.grid.rate_hz);
        let mut best = (f64::NEG_INFINITY, coarse_hz);
        // As far as the split and a cell's own half width.
        for alias in [0.0, -1.0, 1.0, -2.0, 2.0] {
            let doppler_hz = coarse_hz + alias * spacing_hz;
            let [power] = self.powers(phase_chips, doppler_hz, &[0.0]);
            if power > best.0 {
                best = (power, doppler_hz);
            }
        }
        best.1
    }

    fn fine_doppler_hz(&self, phase_chips: f64, coarse_hz: f64) -> f64 {
        let period_s = self.grid.period_samples / self.grid.rate_hz;
        let [prompts] = self.sums(phase_chips, coarse_hz, &[0.0]);
        if prompts.len() < 2 {
            return coarse_hz;
        }
        // The cell's neighbour may have won over it. Of a weak satellite the squares' largest line beyond
        // that is noise.
        let reach_hz = self.grid.step_hz;
        let residual_hz = square_frequency_cycles(&prompts, 2.0 * period_s * reach_hz) / (2.0 * period_s);
        // Squares repeat every 1/(2T), and one period's sum separates such neighbours by its own loss.
        let spacing_hz = 0.5 / period_s;
        let mut best = (f64::NEG_INFINITY, coarse_hz);
        for alias in [0.0, -1.0, 1.0] {
            let doppler_hz = coarse_hz + self.grid.doppler_sign() * (residual_hz + alias * spacing_hz);
            if (doppler_hz - coarse_hz).abs() <= reach_hz {
                let [power] = self.powers(phase_chips, doppler_hz, &[0.0]);
                if power > best.0 {
                    best = (power, doppler_hz);
                }
            }
        }
        best.1
    }
}

/// Frequency of the squared prompts in cycles a period, in [−½, ½) and within `reach` of zero.
fn square_frequency_cycles(prompts: &[Complex<f64>], reach: f64) -> f64 {
    let length = (prompts.len() * PADDING).next_power_of_two();
    let mut spectrum: Vec<Complex<f64>> = prompts.iter().map(|p| p * p).collect();
    spectrum.resize(length, Complex::default());
    Planner::<f64>::new().plan_fft_forward(length).process(&mut spectrum);
    let power = |n: usize| spectrum[n % length].norm();
    let within = |n: usize| n.min(length - n) as f64 <= reach * length as f64;
    let mut best = 0;
    for n in 1..length {
        if within(n) && power(n) > power(best) {
            best = n;
        }
    }
    let (before, at, after) = (power(best + length - 1), power(best), power(best + 1));
    let curvature = before - 2.0 * at + after;
    let vertex = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    let cycles = (best as f64 + vertex) / length as f64;
    if cycles >= 0.5 { cycles - 1.0 } else { cycles }
}
