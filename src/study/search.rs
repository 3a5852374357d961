//! Probability that a search finds a satellite, from the joint statistics of the cells about its peak.
//!
//! A search takes the largest of neighbouring cells, whose noise is alike and of which two or four may share
//! the peak, so its detection probability exceeds that of one cell (`analysis::expect::theory::detection`)
//! and has no closed form. Here the correlations of a neighbourhood are drawn: mean from the folded spectrum
//! of the code averaged over a sample, sinc over frequency and symbols that turn within a sum; noise with the
//! covariance that the same two functions give. Limits: complex samples, one satellite, random codes beyond
//! the neighbourhood.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::leaving::Leaving;
use super::normal::{Normals, Purpose, uniform};
use analysis::waveform::Waveform;
use gnss::signal::{Signal, sinc_squared};

/// Cells to either side of the nearest one that are drawn, in code.
const SIDE_LAGS: i32 = 3;
/// Cells to either side of the nearest one that are drawn, in Doppler.
const SIDE_BINS: i32 = 2;
/// Number of lags of the neighbourhood.
const LAGS: usize = 2 * SIDE_LAGS as usize + 1;
/// Number of bins of the neighbourhood.
const BINS: usize = 2 * SIDE_BINS as usize + 1;
/// Lags, and those between them.
const CELLS: usize = 2 * LAGS - 1;
/// Steps of an integral over a sum in which symbols turn.
const STEPS: u32 = 40;

/// A search and the signal that it meets.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// Signal whose code is searched.
    pub signal: &'static Signal,
    /// Coherent sums whose powers are added, and the length of one.
    pub sums: u32,
    /// Coherent integration, seconds.
    pub coherent_s: f64,
    /// Threshold of the largest Σ|S|², in units of the noise of one component.
    pub threshold: f64,
    /// Distance of lags, chips. Between any two there is another cell, the sum of both.
    pub lag_chips: f64,
    /// Distance of frequencies, Hz.
    pub doppler_step_hz: f64,
    /// A sample's length.
    pub sample_chips: f64,
    /// Length of the code, chips.
    pub code_chips: f64,
    /// Length of a symbol, seconds.
    pub symbol_s: f64,
    /// The code is anywhere within this share of a lag about the nearest one: 1 where nothing is known of it.
    pub code_spread: f64,
    /// C/N0, dB-Hz.
    pub cn0_dbhz: f64,
}

/// Spectrum of a code averaged over samples, as a search by transforms meets it: folded into the
/// band of the samples, of which a part goes back to lags. A lag that is no whole number of samples turns
/// what was folded against the rest, so that the peak loses part of it: up to 0.11 dB at 2.54 samples a chip.
struct Folded {
    /// Frequency in turns a sample, and weight, from zero up: what was not folded, one side.
    own: Vec<(f64, f64)>,
    /// Frequency and weight of the first image above, for all frequencies of the band.
    image: Vec<(f64, f64)>,
    /// Share of the signal's power at the antenna that is within the band.
    share: f64,
}

/// Nodes of an integral over half the band: a correlation errs by less than 1e-5.
const NODES: u32 = 64;
/// Images on either side that are counted as noise; the signal's beyond the first are below 1e-3 of it.
const IMAGES: i32 = 8;

impl Folded {
    /// Densities for samples of `sample` chips and lags of `lag` samples.
    fn new(code: &Waveform, sample: f64, lag: f64) -> Self {
        let density = |turns: f64| {
            let chips = code.density(turns / sample * code.chip_rate_hz()) * code.chip_rate_hz();
            chips * sinc_squared(turns)
        };
        let folded = |turns: f64| -> f64 { (-IMAGES..=IMAGES).map(|k| density(turns + f64::from(k))).sum() };
        let half = 0.5 / lag.max(1.0);
        let middles = |half: f64, count: u32| {
            let step = half / f64::from(count);
            (0..count).map(move |k| ((f64::from(k) + 0.5) * step, step))
        };
        let within: f64 = middles(half, NODES).map(|(turns, step)| 2.0 * step * folded(turns)).sum();
        // Both sides of the spectrum at once, in units of what is within the band.
        let own = middles(half, NODES).map(|(turns, step)| (turns, 2.0 * step * density(turns) / within)).collect();
        let above = |turns: f64, step: f64| (turns + 1.0, 2.0 * step * density(turns + 1.0) / within);
        let image = middles(half, NODES).flat_map(|(turns, step)| [above(turns, step), above(-turns, step)]).collect();
        // Densities are of turns a sample; a chip of power one has `sample` of them.
        Self { own, image, share: within / sample }
    }

    /// Correlation of the signal at `offset` samples from a lag that is `place` samples past a whole one, in
    /// units of the noise's.
    fn signal(&self, offset: f64, place: f64) -> f64 {
        let sum = |nodes: &[(f64, f64)], turn: f64| -> f64 {
            nodes.iter().map(|(turns, weight)| weight * libm::cos(TAU * (turns * offset + turn))).sum()
        };
        sum(&self.own, 0.0) + sum(&self.image, place)
    }

    /// Correlation of the noise of two lags so many samples apart.
    fn noise(&self, apart: f64) -> f64 {
        let own: f64 = self.own.iter().map(|(turns, weight)| weight * libm::cos(TAU * turns * apart)).sum();
        let image = self.image.iter().map(|(turns, weight)| weight * libm::cos(TAU * (turns - 1.0) * apart));
        (own + image.sum::<f64>()) / self.noise_power()
    }

    fn noise_power(&self) -> f64 {
        self.own.iter().chain(&self.image).map(|(_, weight)| weight).sum()
    }
}

fn sinc(x: f64) -> f64 {
    let x = 0.5 * TAU * x;
    if x.abs() < 1e-9 { 1.0 } else { libm::sin(x) / x }
}

impl Model {
    /// Share of `draws` in which the satellite is found, its Doppler each of `doppler_hz` off the nearest
    /// bin in turn, the edges of its symbols anywhere. Of cells beyond the neighbourhood `leaving` knows
    /// what keeps a Doppler.
    pub fn probability(&self, doppler_hz: &[f64], leaving: &Leaving, draws: u32, seed: u64) -> f64 {
        let lags: Vec<f64> = (-SIDE_LAGS..=SIDE_LAGS).map(f64::from).collect();
        let bins: Vec<f64> = (-SIDE_BINS..=SIDE_BINS).map(f64::from).collect();
        let covariance = |places: &[f64], of: &dyn Fn(f64) -> f64| {
            DMatrix::from_fn(places.len(), places.len(), |a, b| of(places[a] - places[b]))
        };
        let lag = self.lag_chips / self.sample_chips;
        let Some(waveform) = Waveform::of(self.signal) else { return 0.0 };
        let chips = Folded::new(&waveform, self.sample_chips, lag);
        let across_code = covariance(&lags, &|d| chips.noise(d * lag));
        let between_power = 2.0 * (1.0 + chips.noise(lag));
        let across_doppler = covariance(&bins, &|d| sinc(d * self.doppler_step_hz * self.coherent_s));
        // Neighbours this close are never dependent, so both are positive definite; if not, nothing is found.
        let (Some(code), Some(doppler)) = (across_code.cholesky(), across_doppler.cholesky()) else { return 0.0 };
        let (code, doppler) = (Factor::<LAGS>::of(&code.l()), Factor::<BINS>::of(&doppler.l()));
        let cn0_hz = libm::pow(10.0, self.cn0_dbhz / 10.0);
        // Correlations of unit noise a component; the floor holds the sidelobes of the signal too.
        let amplitude = (2.0 * self.coherent_s * cn0_hz * chips.share).sqrt();
        let floor = 1.0 + self.coherent_s * cn0_hz * sidelobe(&waveform) / self.code_chips;
        let mut noise = Normals::new(seed, Purpose::Thermal);
        let mut found = 0;
        for draw in 0..draws {
            let place = |number: u64| uniform(seed, Purpose::Places, 3 * u64::from(draw) + number);
            let offset = (place(0) - 0.5) * self.code_spread;
            let edge_s = place(1) * self.symbol_s;
            // Where between two samples the nearest lag lies.
            let between = place(2);
            let doppler_hz = doppler_hz.get(draw as usize % doppler_hz.len().max(1)).copied().unwrap_or(0.0);
            let height = |number: &f64| chips.signal((offset - number) * lag, between + number * lag);
            let shape: Vec<f64> = lags.iter().map(height).collect();
            let mut powers = [[0.0; CELLS]; BINS];
            let mut largest = [const { Vec::new() }; BINS];
            for sum in 0..self.sums {
                let begin_s = f64::from(sum) * self.coherent_s;
                let symbols = Symbols { seed, first: u64::from(draw) << 16, edge_s, symbol_s: self.symbol_s };
                let across: Vec<Complex64> = (bins.iter())
                    .map(|bin| symbols.mean(begin_s, self.coherent_s, doppler_hz - bin * self.doppler_step_hz))
                    .collect();
                let mut coloured = [[Complex64::ZERO; LAGS]; BINS];
                coloured.iter_mut().flatten().for_each(|cell| *cell = noise.next());
                coloured.iter_mut().for_each(|column| *column = code.times(column));
                for row in 0..LAGS {
                    let across_bins = doppler.times(&coloured.map(|column| column[row]));
                    coloured.iter_mut().zip(across_bins).for_each(|(column, cell)| column[row] = cell);
                }
                for ((powers, coloured), mean) in powers.iter_mut().zip(&coloured).zip(&across) {
                    let sums: [Complex64; LAGS] =
                        std::array::from_fn(|lag| coloured[lag] + mean * shape[lag] * amplitude);
                    let (own, between) = powers.split_at_mut(LAGS);
                    own.iter_mut().zip(&sums).for_each(|(power, sum)| *power += sum.norm_sqr());
                    for (power, pair) in between.iter_mut().zip(sums.windows(2)) {
                        *power += (pair[0] + pair[1]).norm_sqr() / between_power;
                    }
                }
                for (largest, powers) in largest.iter_mut().zip(&powers) {
                    largest.push(powers.iter().fold(0.0, |a, b| f64::max(a, b / floor)));
                }
            }
            // Noise of every Doppler is another's.
            let stays = |(bin, largest): (usize, &Vec<f64>)| {
                largest.last().is_some_and(|last| *last > self.threshold)
                    && leaving.stays(largest.iter().copied(), BINS * draw as usize + bin)
            };
            found += u32::from(largest.iter().enumerate().any(stays));
        }
        f64::from(found) / f64::from(draws.max(1))
    }
}

/// A lower triangle that gives independent numbers a covariance.
struct Factor<const N: usize>([[f64; N]; N]);

impl<const N: usize> Factor<N> {
    fn of(matrix: &DMatrix<f64>) -> Self {
        Self(std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)])))
    }

    fn times(&self, numbers: &[Complex64; N]) -> [Complex64; N] {
        std::array::from_fn(|row| {
            let parts = self.0[row].iter().zip(numbers).take(row + 1);
            parts.fold(Complex64::ZERO, |sum, (factor, number)| sum + number * *factor)
        })
    }
}

/// Mean square of a code's correlation away from its peak, in units of one over its chips: ∫R² over a chip,
/// of a polygon. Two thirds of rectangular chips.
fn sidelobe(code: &Waveform) -> f64 {
    let (step_s, chip_s) = code.scales_s();
    let steps = (chip_s / step_s).round() as i32;
    let value = |k: i32| code.correlation(f64::from(k) * step_s);
    let piece = |k: i32| (value(k) * value(k) + value(k) * value(k + 1) + value(k + 1) * value(k + 1)) / 3.0;
    2.0 * (0..steps).map(piece).sum::<f64>() / f64::from(steps)
}

/// Message symbols of one draw.
struct Symbols {
    seed: u64,
    first: u64,
    /// Time at which the second symbol begins, in seconds.
    edge_s: f64,
    symbol_s: f64,
}

impl Symbols {
    /// Mean over a sum of the symbols turning at `offset_hz`, as seen from the middle of the sum.
    fn mean(&self, begin_s: f64, length_s: f64, offset_hz: f64) -> Complex64 {
        let number = |t_s: f64| ((t_s - self.edge_s) / self.symbol_s).floor() + 1.0;
        let sign = |t_s: f64| super::normal::symbol(self.seed, self.first + number(t_s) as u64);
        if number(begin_s) == number(begin_s + length_s) {
            return Complex64::from(sinc(offset_hz * length_s));
        }
        let step_s = length_s / f64::from(STEPS);
        (0..STEPS)
            .map(|k| {
                let t_s = (f64::from(k) + 0.5) * step_s;
                let (sin, cos) = libm::sincos(TAU * offset_hz * (t_s - 0.5 * length_s));
                Complex64::new(cos, sin) * sign(begin_s + t_s) / f64::from(STEPS)
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use analysis::expect::theory::detection;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::synthetic::LONG_BOC;

    fn chips() -> Waveform {
        Waveform::of(&L1_CA).unwrap()
    }

    #[test]
    fn side_lobes_of_boc_are_half_of_those_of_bpsk() {
        // ∫R² is 2/3 of rectangular chips and 2·(1/8 + 1/24) of BOC(1,1).
        assert!((sidelobe(&chips()) - 2.0 / 3.0).abs() < 1e-15);
        assert!((sidelobe(&Waveform::of(&LONG_BOC).unwrap()) - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn at_whole_samples_the_correlation_is_that_of_two_triangles() {
        // ∫ Λ(τ − u s) Λ(u) du of chips and sample: 1 − s/3 at zero; from s to 1 − s chips both triangles are
        // straight.
        let s = 0.4;
        let folded = Folded::new(&chips(), s, 1.0);
        let at_zero = 1.0 - s / 3.0;
        // Images beyond the first hold 1e-3 of the power.
        assert!((folded.signal(0.0, 0.0) - 1.0).abs() < 2e-3, "{}", folded.signal(0.0, 0.0));
        let half = folded.signal(0.5 / s, 0.0);
        assert!((half - 0.5 / at_zero).abs() < 2e-3, "{half}");
        assert!(folded.signal((1.0 + s) / s, 0.0).abs() < 2e-3);
        assert!((folded.share - at_zero).abs() < 1e-4, "{}", folded.share);
    }

    #[test]
    fn a_lag_half_way_between_samples_loses_what_was_folded_twice() {
        let folded = Folded::new(&chips(), 1.023 / 2.6, 1.015_625);
        let (whole, half) = (folded.signal(0.0, 0.0), folded.signal(0.0, 0.5));
        let (mean, image) = (0.5 * (whole + half), 0.5 * (whole - half));
        // Integrated by another program: 0.98654/0.99870 of the power within the band was not folded.
        assert!((mean - 0.986_545 / 0.998_696).abs() < 2e-4, "{mean}");
        assert!((0.010..0.013).contains(&image), "{image}");
        // Of what means over samples leave at all.
        let share = 0.998_696 * (1.0 - 1.023 / 2.6 / 3.0);
        assert!((folded.share - share).abs() < 1e-4, "{}", folded.share);
    }

    #[test]
    fn a_lonely_cell_is_found_as_often_as_the_closed_form_says() {
        // Lags of five chips, 12.5 samples, apart, bins of whole cycles, a code on its lag and a symbol that
        // never turns leave one cell.
        const DRAWS: u32 = 20_000;
        let model = Model {
            signal: &L1_CA,
            sums: 10,
            coherent_s: 1e-3,
            threshold: detection::threshold(1e-7, 10),
            lag_chips: 5.0,
            doppler_step_hz: 1e3,
            sample_chips: 0.4,
            code_chips: f64::INFINITY,
            symbol_s: 1e3,
            code_spread: 0.0,
            cn0_dbhz: 38.0,
        };
        let none = Leaving::new(vec![0.0; 10], 1, 1);
        for cn0_dbhz in [35.0, 37.0, 38.0] {
            let lambda = detection::noncentrality(10, 1e-3, libm::pow(10.0, cn0_dbhz / 10.0), 1.0);
            let expected = detection::detection(model.threshold, 10, lambda);
            // Of the signal the lags hold what lies within the band that has as many of them.
            let share_db = 10.0 * libm::log10(Folded::new(&chips(), model.sample_chips, 12.5).share);
            let found = Model { cn0_dbhz: cn0_dbhz - share_db, ..model }.probability(&[0.0], &none, DRAWS, 1);
            // Four deviations of a count, and the other cells' own alarms: 34 of 1e-7.
            let scatter = 4.0 * (expected * (1.0 - expected) / f64::from(DRAWS)).sqrt() + 4e-6;
            assert!((found - expected).abs() < scatter, "{cn0_dbhz} dB-Hz: {found}, expected {expected}");
        }
        // Where the peak is shared, a neighbour may replace it: more are found than in the nearest cell
        // alone.
        let kept_db = 10.0 * libm::log10(1.0 - model.sample_chips / 3.0);
        let shared = Model { lag_chips: 0.4, doppler_step_hz: 500.0, cn0_dbhz: 36.0 - kept_db, ..model };
        let lambda = detection::noncentrality(10, 1e-3, libm::pow(10.0, 3.6), detection::frequency_loss(250.0, 1e-3));
        let alone = detection::detection(model.threshold, 10, lambda);
        let found = shared.probability(&[250.0], &none, DRAWS, 2);
        assert!(found > alone + 0.05, "{found}, one cell {alone}");
    }
}
