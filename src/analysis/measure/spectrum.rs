//! Deviation of the samples' spectrum from the expected one, with the limits that its scatter sets.
//!
//! Three figures describe the ratio of measured to expected density: its mean over all bins (the level), the
//! mean over each thirty-second of the band over the level (broad shape), and each bin over the level (narrow
//! shape). Each is a mean of squares with a relative variance v, the sum of three:
//! - the variance of Welch's estimate of Gaussian samples ([`welch::variance`]), times a factor for
//!   an unsteady density;
//! - the variance of lines of codes, which are taken as random. A band B of a component of period T has B·T
//!   lines, each with a standard deviation of its mean. It has half as many where B spans the carrier, about
//!   which a real code's lines are alike;
//! - the variance of the number of pulses of interference within the looks, and of the phase at which they
//!   meet a slow sweep.
//!
//! A mean of squares is near gamma with shape 1/v, whose quantiles are (1 − v/9 ± z·√v/3)³ (Wilson and
//! Hilferty 1931); z is that of the false alarm over the number of slices or bins. Nothing is added for an
//! error of the expectation. Bins that a line or the edge of a noise's band fills, those 40 dB below the
//! peak, and of real samples the ends of the band are left out. Limits: [`excuse`] names what is not judged,
//! and sweeps longer than `sweep::SEGMENTS` segments are not.

use crate::error::JudgeError;
use crate::expect::front_end::FrontEnd;
use crate::expect::quantile::largest;
use crate::expect::samples::{Expected, Sent};
use crate::expect::sweep;
use crate::expect::welch;
use crate::read::{PsdRow, Run};
use gnss::facts::Interference;

/// Slices of the band.
const SLICES: usize = 32;
/// Fewest bins that are a slice.
const LEAST_BINS: usize = 8;
/// Segments below which quantiles say little.
const LEAST_SEGMENTS: u64 = 16;
/// Density over its peak below which a bin does not count: side lobes of filters and of the window.
const LOWEST: f64 = 1e-4;
/// Deviations of a component that an integer format must hold for clipping to stay below 1e-3 of the power.
const HEADROOM: f64 = 3.5;

/// A figure and its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure {
    /// Measured over expected, dB.
    pub off_db: f64,
    /// Largest size that scatter makes of it, on the side on which it is, dB.
    pub limit_db: f64,
    /// Middle of the slice or bin, frequency in the samples, Hz.
    pub at_hz: f64,
}

/// Deviations of a front end's spectrum from the expected one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departures {
    /// Deviation of the whole; `None` where the truth does not state the level.
    pub level: Option<Departure>,
    /// Deviation of the worst slice.
    pub broad: Departure,
    /// Deviation of the worst bin. `None` where sweeps or pulses make bins that are no mean of squares.
    pub narrow: Option<Departure>,
}

impl Departure {
    fn new(ratio: f64, variance: f64, count: usize, at_hz: f64) -> Self {
        let (shift, reach) = (1.0 - variance / 9.0, largest(1, count) * variance.sqrt() / 3.0);
        let off_db = 10.0 * libm::log10(ratio.max(1e-30));
        let cube = |x: f64| 10.0 * libm::log10(x * x * x);
        let limit_db = match (ratio >= 1.0, shift - reach > 0.0) {
            (true, _) => cube(shift + reach),
            (false, true) => -cube(shift - reach),
            // However little there is, it may be scatter.
            (false, false) => f64::INFINITY,
        };
        Self { off_db, limit_db, at_hz }
    }

    fn worse(self, other: Self) -> Self {
        let over = |one: &Self| one.off_db.abs() / one.limit_db;
        if over(&other) > over(&self) { other } else { self }
    }
}

/// Bins that count, each with its ratio.
struct Bins<'a> {
    rows: &'a [PsdRow],
    expected: &'a Expected,
    ratios: Vec<Option<f64>>,
    carriers_hz: Vec<f64>,
    bin_hz: f64,
    segments: f64,
}

impl Bins<'_> {
    /// Mean ratio of some bins, its relative variance and their number; `None` of too few.
    fn mean(&self, range: std::ops::Range<usize>) -> Option<(f64, f64, usize)> {
        let (mut sum, mut codes_hz, mut unsteady, mut pulses, mut count) = (0.0, 0.0, 0.0, 0.0, 0_usize);
        let inside = self.rows.get(range.clone())?;
        let (from_hz, to_hz) = (inside.first()?.frequency_hz, inside.last()?.frequency_hz);
        for index in range {
            let Some(ratio) = self.ratios.get(index).copied().flatten() else { continue };
            let of = |values: &[f64]| values.get(index).copied().unwrap_or(0.0);
            (sum, count) = (sum + ratio, count + 1);
            codes_hz += of(&self.expected.codes_hz);
            unsteady += of(&self.expected.unsteady);
            pulses += of(&self.expected.pulses);
        }
        let n = count as f64;
        if count == 0 {
            return None;
        }
        let alike = if self.carriers_hz.iter().any(|hz| (from_hz..=to_hz).contains(hz)) { 2.0 } else { 1.0 };
        let band_hz = if count == 1 { welch::WIDTH_BINS } else { n } * self.bin_hz;
        let noise = welch::variance(count, self.segments) * unsteady / n;
        Some((sum / n, noise + alike * codes_hz / n / band_hz + pulses / n, count))
    }
}

impl Departures {
    /// Deviations of a front end's spectrum, or the reason why it is not judged.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &Run, front_end: &FrontEnd<'_>, rows: &[PsdRow]) -> Result<Result<Self, &'static str>, JudgeError> {
        if let Some(reason) = excuse(run, front_end) {
            return Ok(Err(reason));
        }
        let sent = Sent::of(run, front_end)?;
        let Some(expected) = Expected::of(run, front_end, &sent, rows) else {
            return Ok(Err("there is nothing in the samples"));
        };
        let carriers_hz = sent.iter().map(|one| front_end.place_hz(one.carrier_hz)).collect();
        Ok(Self::between(run, front_end, (rows, &expected), carriers_hz))
    }

    fn between(
        run: &Run,
        front_end: &FrontEnd<'_>,
        (rows, expected): (&[PsdRow], &Expected),
        carriers_hz: Vec<f64>,
    ) -> Result<Self, &'static str> {
        let one_sided = rows.first().is_some_and(|row| row.frequency_hz >= 0.0);
        let bins = if one_sided { 2 * (rows.len() - 1) } else { rows.len() };
        let bin_hz = front_end.rate_hz / bins as f64;
        let spacing_hz = rows.get(1).zip(rows.first()).map_or(0.0, |(b, a)| b.frequency_hz - a.frequency_hz);
        if (spacing_hz / bin_hz - 1.0).abs() > 1e-6 {
            return Err("its frequencies are not those of the samples");
        }
        let slow = |hz: f64| hz < bin_hz / sweep::SEGMENTS;
        if run.scene.interference.iter().filter_map(Interference::sweeps_hz).any(slow) {
            return Err("a sweep lasts longer than 16 segments of the spectrum");
        }
        let segments = front_end.looks(run).segments(front_end.samples, bins);
        if segments < LEAST_SEGMENTS {
            return Err("there are too few samples");
        }
        if front_end.clips(expected.density.iter().sum::<f64>() * bin_hz, HEADROOM) {
            return Err("the format clips the samples");
        }
        let peak = expected.density.iter().copied().fold(0.0, f64::max);
        let ends = if one_sided { 2 } else { 0 };
        let ratio = |(index, (row, density)): (usize, (&PsdRow, &f64))| {
            let inside = (ends..rows.len() - ends).contains(&index);
            let counts = inside && *density > LOWEST * peak && expected.line.get(index) == Some(&false);
            counts.then(|| libm::pow(10.0, row.density_db / 10.0) / density)
        };
        let ratios = rows.iter().zip(&expected.density).enumerate().map(ratio).collect();
        let found = Bins { rows, expected, ratios, carriers_hz, bin_hz, segments: segments as f64 };
        let middle_hz = |from: usize, to: usize| {
            let at = |index: usize| rows.get(index).map_or(0.0, |row| row.frequency_hz);
            0.5 * (at(from) + at(to - 1))
        };
        let (level, variance, _) = found.mean(0..rows.len()).ok_or("no bin counts")?;
        let width = rows.len() / SLICES;
        let slices: Vec<(f64, f64, f64)> = (0..SLICES)
            .filter_map(|slice| {
                let (from, to) = (slice * width, (slice + 1) * width);
                let (ratio, variance, count) = found.mean(from..to)?;
                (count >= LEAST_BINS).then(|| (ratio / level, variance, middle_hz(from, to)))
            })
            .collect();
        let of = |(ratio, variance, at_hz): &(f64, f64, f64), count| Departure::new(*ratio, *variance, count, *at_hz);
        let broad = slices.iter().map(|slice| of(slice, slices.len())).reduce(Departure::worse);
        let single = |index: usize| {
            found.mean(index..index + 1).map(|(ratio, v, _)| (ratio / level, v, middle_hz(index, index + 1)))
        };
        let single: Vec<(f64, f64, f64)> = (0..rows.len()).filter_map(single).collect();
        let narrow = single.iter().map(|bin| of(bin, single.len())).reduce(Departure::worse);
        Ok(Self {
            level: (expected.absolute && front_end.keeps_level())
                .then(|| Departure::new(level, variance, 1, middle_hz(0, rows.len()))),
            broad: broad.ok_or("no slice counts")?,
            narrow: narrow.filter(|_| expected.steady),
        })
    }
}

/// Reason why a spectrum has no expectation that it can be judged by.
pub fn excuse(run: &Run, front_end: &FrontEnd<'_>) -> Option<&'static str> {
    let scene = &run.scene;
    if !scene.spoofers.is_empty() {
        return Some("the truth does not state the power of a spoofer");
    }
    if front_end.is_coarse() && (!scene.noise || !scene.interference.is_empty()) {
        return Some("a converter of few levels makes other lines of what is not noise");
    }
    if scene.interference.is_empty() {
        return None;
    }
    let recording = |shape: &Interference| matches!(shape, Interference::Recording { .. });
    match () {
        () if scene.interference.iter().any(recording) => Some("a recording has a spectrum of its own"),
        () if scene.front_ends.len() > 1 => Some("interference is stated for one front end"),
        () if !run.rays.is_empty() => Some("echoes change while interference is looked at"),
        () => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::{Draw, planted};
    use crate::measure::psd::Psd;

    #[test]
    fn white_noise_is_within_its_limits_and_no_more_than_its_scatter_is_needed() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
        // A second of noise alone, of which a fifth is looked at; the planted scene's satellites are left
        // out.
        (run.scene.samples, run.scene.noise_lsb, run.scene.format) = (2_600_000, Some(10.0), "cf32_le".to_owned());
        let (mut worst, mut level) = ([0.0_f64; 3], 0.0);
        for seed in 1..=8 {
            let mut draw = Draw(seed);
            let mut plane = || (0..520_000).map(|_| (10.0 * draw.normal()) as f32).collect::<Vec<f32>>();
            let (i, q) = (plane(), plane());
            let mut psd = Psd::new(2.6e6, false, welch::BINS);
            psd.add(&i, &q);
            let (rows, front_end) = (psd.rows().unwrap(), FrontEnd::of(&run, 0));
            let expected = Expected::of(&run, &front_end, &[], &rows).unwrap();
            let found = Departures::between(&run, &front_end, (&rows, &expected), Vec::new()).unwrap();
            let share = |one: Departure| one.off_db.abs() / one.limit_db;
            let all = [found.level.unwrap(), found.broad, found.narrow.unwrap()];
            all.iter().zip(&mut worst).for_each(|(one, worst)| *worst = worst.max(share(*one)));
            level += found.level.unwrap().off_db / 8.0;
        }
        // The largest of 32 and of 2048 normal values are 2.1 to 3.2 and 3.4 to 4.4σ of the 5.1 and 5.8
        // allowed.
        assert!(worst.iter().all(|share| (0.15..0.9).contains(share)), "{worst:?}");
        // 1.03 of 1/520 000 is 0.0061 dB, an eighth of its square.
        assert!(level.abs() < 0.008, "{level}");
    }

    #[test]
    fn what_has_no_expectation_is_not_judged_and_the_reason_is_said() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
        assert_eq!(excuse(&run, &FrontEnd::of(&run, 0)), None);
        run.scene.interference = vec![Interference::Cw];
        assert_eq!(excuse(&run, &FrontEnd::of(&run, 0)), None);
        run.scene.interference = vec![Interference::Recording { width_hz: 1e6 }];
        assert!(excuse(&run, &FrontEnd::of(&run, 0)).unwrap().contains("recording"));
        run.scene.interference.clear();
        run.scene.spoofers.push("one".to_owned());
        assert!(excuse(&run, &FrontEnd::of(&run, 0)).unwrap().contains("spoofer"));
    }

    #[test]
    fn limits_are_quantiles_of_a_mean_of_squares() {
        // Chi-square of 200 degrees, shape 100: its upper 0.5e-5 quantile is 301.6 and its lower 122.6, over
        // 200.
        let [high, low] = [1.5, 0.6].map(|ratio| Departure::new(ratio, 0.01, 1, 0.0));
        let law = <statrs::distribution::ChiSquared>::new(200.0).unwrap();
        let of = |p: f64| 10.0 * libm::log10(statrs::distribution::ContinuousCDF::inverse_cdf(&law, p) / 200.0);
        assert!((high.limit_db - of(1.0 - 0.5e-5)).abs() < 0.01, "{high:?} {}", of(1.0 - 0.5e-5));
        assert!((low.limit_db + of(0.5e-5)).abs() < 0.02, "{low:?} {}", of(0.5e-5));
        // Of one line anything below its mean is scatter.
        assert_eq!(Departure::new(0.01, 1.0, 1, 0.0).limit_db, f64::INFINITY);
    }
}
