//! The receiver's clock over a run: its estimate against the truth, and how stable both are.
//!
//! Bias is the clock's reading minus GPS time. The receiver's error of it is minus the error of the GPS time
//! that it gives, so that it does not matter how the receiver set its clock; truth plus error is the
//! estimate. Deviations need an even grid: the longest segment of fixes without a gap is taken, and of the
//! truth the whole run. Expected beside them: the white phase noise of a clock solved from independent code
//! or carrier measurements, TDOP × σ. Limits: the code loop's bandwidth and carrier smoothing correlate
//! fixes, so the estimate lies below the code's line; its noise is no oscillator's.

use std::ops::Range;

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::theory::clock::PowerLaw;
use crate::measure::allan::{self, Deviation, Point, decades, fit, octaves};
use crate::measure::errors::Errors;
use crate::read::spill_store::{SpillRow, Words};
use crate::read::{Run, Table};
use crate::statistics::{mean, median};
use gnss::earth::SPEED_OF_LIGHT_MPS;

/// Probability with which an interval contains the true deviation.
pub const CONFIDENCE: f64 = 0.95;

/// The clock at one fix: a row of `clock.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockRow {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Reading minus GPS time as the receiver found it.
    pub estimate_s: f64,
    /// Bias of the truth, seconds; positive where the clock is ahead.
    pub truth_s: f64,
    /// Estimate minus truth.
    pub error_s: f64,
    /// The estimate without its straight line.
    pub detrended_s: f64,
}

impl SpillRow<()> for ClockRow {
    const WORDS: usize = 6;

    fn put(&self, words: &mut Vec<u64>) {
        words.push(self.sample);
        words.extend([self.time_s, self.estimate_s, self.truth_s, self.error_s, self.detrended_s].map(f64::to_bits));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        Self {
            sample: words.word(),
            time_s: words.number(),
            estimate_s: words.number(),
            truth_s: words.number(),
            error_s: words.number(),
            detrended_s: words.number(),
        }
    }
}

/// A straight line through a series, by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Time and value in the middle.
    middle: (f64, f64),
    /// Per second.
    pub slope: f64,
}

impl Line {
    /// `None` without two different times.
    fn through(times: &[f64], values: &[f64]) -> Option<Self> {
        let middle = (mean(times)?, mean(values)?);
        let about = || times.iter().zip(values).map(|(time, value)| (time - middle.0, value - middle.1));
        let square: f64 = about().map(|(time, _)| time * time).sum();
        let product: f64 = about().map(|(time, value)| time * value).sum();
        (square > 0.0).then(|| Self { middle, slope: product / square })
    }

    /// Value of the line at a time in seconds.
    pub fn at(&self, time_s: f64) -> f64 {
        self.middle.1 + self.slope * (time_s - self.middle.0)
    }
}

/// Clock whose phase a deviation describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Of {
    /// The receiver's estimate: clock and noise of position together.
    Estimate,
    /// The clock.
    Truth,
    /// Difference of both: the noise of position alone.
    Error,
}

/// Phases on an even grid, with their deviations over decades of τ.
#[derive(Clone, Debug)]
pub struct Series {
    /// Clock that the series describes.
    pub of: Of,
    phases_s: Vec<f64>,
    tau0_s: f64,
    /// Each deviation at its averaging times.
    pub curves: Vec<(Deviation, Vec<Point>)>,
}

impl Series {
    fn new(of: Of, phases_s: Vec<f64>, tau0_s: f64) -> Self {
        let curve =
            |deviation| (deviation, allan::curve(deviation, &phases_s, tau0_s, decades(phases_s.len()), CONFIDENCE));
        let curves = Deviation::ALL.map(curve).to_vec();
        Self { of, phases_s, tau0_s, curves }
    }

    /// The curve of one deviation.
    pub fn curve(&self, deviation: Deviation) -> &[Point] {
        self.curves.iter().find(|(which, _)| *which == deviation).map_or(&[], |(_, points)| points)
    }

    /// A deviation at an averaging time that is a multiple of the grid's interval.
    pub fn at(&self, deviation: Deviation, tau_s: f64) -> Option<Point> {
        let steps = tau_s / self.tau0_s;
        let m = steps.round();
        // A sample more or less in the interval is no other averaging time.
        if (steps - m).abs() > 1e-3 * m {
            return None;
        }
        allan::curve(deviation, &self.phases_s, self.tau0_s, [m as usize], CONFIDENCE).into_iter().next()
    }

    /// Strengths of its power-law noises below half its rate, from octaves, so that no segment of τ counts
    /// more.
    pub fn power_law(&self) -> Option<PowerLaw> {
        let octaves = octaves(self.phases_s.len());
        fit::power_law(
            &allan::curve(Deviation::Oadev, &self.phases_s, self.tau0_s, octaves, CONFIDENCE),
            self.cutoff_hz(),
        )
    }

    /// Half its rate.
    pub fn cutoff_hz(&self) -> f64 {
        0.5 / self.tau0_s
    }

    /// Interval of its grid.
    pub fn tau0_s(&self) -> f64 {
        self.tau0_s
    }
}

/// The clock over a run.
#[derive(Debug)]
pub struct Clock {
    /// The longest segment of fixes without a gap.
    pub rows: Table<ClockRow>,
    /// Straight line of the estimate.
    pub estimate_line: Option<Line>,
    /// Straight line of the truth.
    pub truth_line: Option<Line>,
    /// Straight line of the error.
    pub error_line: Option<Line>,
    /// Series that have an interval.
    pub series: Vec<Series>,
    /// Standard deviation of a clock solved from independent code measurements of this run's scatter.
    pub code_sigma_s: Option<f64>,
    /// Standard deviation in seconds of a clock solved from independent carrier measurements of this run's
    /// scatter.
    pub carrier_sigma_s: Option<f64>,
    /// The oscillator that the scene names.
    pub oscillator: Option<PowerLaw>,
}

impl Clock {
    /// Measures it.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn measure(run: &Run, errors: &Errors) -> Result<Self, JudgeError> {
        let samples = errors.positions.map(|error| error.sample)?;
        let stretch = longest_even(&samples);
        let tau0_s = interval_s(run, &samples[stretch.clone()]);
        drop(samples);
        let each = |see: &mut dyn FnMut(ClockRow)| {
            let mut number = 0;
            errors.positions.each(|error| {
                number += 1;
                if stretch.contains(&(number - 1)) {
                    let error_s = -error.clock_m / SPEED_OF_LIGHT_MPS;
                    let (truth_s, estimate_s) = (error.true_clock_s, error.true_clock_s + error_s);
                    let (sample, time_s) = (error.sample, error.time_s);
                    see(ClockRow { sample, time_s, estimate_s, truth_s, error_s, detrended_s: 0.0 });
                }
            })
        };
        let of_rows = |of: fn(&ClockRow) -> f64| {
            let mut found = Vec::with_capacity(stretch.len());
            each(&mut |row| found.push(of(&row)))?;
            Ok::<_, JudgeError>(found)
        };
        let times = of_rows(|row| row.time_s)?;
        let (estimate, error) = (of_rows(|row| row.estimate_s)?, of_rows(|row| row.error_s)?);
        let line = |values: &[f64]| Line::through(&times, values);
        let (estimate_line, error_line) = (line(&estimate), line(&error));
        let truth_line = line(&of_rows(|row| row.truth_s)?);
        drop(times);
        let mut rows = Table::new(errors.positions.directory());
        let mut put = Ok(());
        each(&mut |mut row| {
            row.detrended_s = row.estimate_s - estimate_line.map_or(row.estimate_s, |line| line.at(row.time_s));
            if put.is_ok() {
                put = rows.push(row);
            }
        })?;
        put?;
        let mut series = Vec::new();
        if let Some(tau0_s) = tau0_s {
            series.push(Series::new(Of::Estimate, estimate, tau0_s));
            series.push(Series::new(Of::Error, error, tau0_s));
        }
        series.extend(truth(run)?);
        let tdop = tdop(run, &rows)?;
        let sigma_s = |sigma_m: Option<f64>| Some(tdop? * sigma_m? / SPEED_OF_LIGHT_MPS);
        let code_m = errors.settled_std(None, |_, row| row.code_m)?;
        let carrier_m = errors.settled_std(None, |link, row| row.carrier_cycles * link.wavelength_m())?;
        Ok(Self {
            estimate_line,
            truth_line,
            error_line,
            series,
            code_sigma_s: sigma_s(code_m),
            carrier_sigma_s: sigma_s(carrier_m),
            oscillator: run.scene.oscillator.map(|oscillator| PowerLaw { h: oscillator.h }),
            rows,
        })
    }

    /// Gives the phases of its series back; what was found of them stays.
    pub(crate) fn forget_phases(&mut self) {
        self.series.iter_mut().for_each(|series| series.phases_s = Vec::new());
    }

    /// One of its series.
    pub fn series(&self, of: Of) -> Option<&Series> {
        self.series.iter().find(|series| series.of == of)
    }

    /// Every point of every curve.
    pub(crate) fn stability(&self) -> impl Iterator<Item = AllanRow> + '_ {
        self.series.iter().flat_map(|series| {
            let of_one = |(deviation, points): &(Deviation, Vec<Point>)| {
                let name = deviation.name();
                points.iter().map(|point| AllanRow::new(series.of, name, point)).collect::<Vec<_>>()
            };
            series.curves.iter().flat_map(of_one)
        })
    }
}

/// A row of `allan.csv`.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct AllanRow {
    series: Of,
    deviation: &'static str,
    tau_s: f64,
    /// Dimensionless; in seconds for the time deviation.
    value: f64,
    /// Ends of the interval of [`CONFIDENCE`].
    low: Option<f64>,
    high: Option<f64>,
    /// Differences that went into it.
    terms: usize,
    /// Exponent of the noise that dominates.
    alpha: Option<i32>,
    /// Equivalent degrees of freedom.
    freedom: Option<f64>,
}

impl AllanRow {
    fn new(series: Of, deviation: &'static str, point: &Point) -> Self {
        Self {
            series,
            deviation,
            tau_s: point.tau_s,
            value: point.deviation,
            low: point.interval.map(|ends| ends.0),
            high: point.interval.map(|ends| ends.1),
            terms: point.terms,
            alpha: point.alpha,
            freedom: point.freedom,
        }
    }
}

/// The clock as it was, over the whole run.
fn truth(run: &Run) -> Result<Option<Series>, JudgeError> {
    let samples = run.trajectory.map(|row| row.sample)?;
    let stretch = longest_even(&samples);
    let tau0_s = interval_s(run, &samples[stretch.clone()]);
    drop(samples);
    let Some(tau0_s) = tau0_s else { return Ok(None) };
    let mut phases_s = Vec::with_capacity(stretch.len());
    let mut number = 0;
    run.trajectory.each(|row| {
        phases_s.extend(stretch.contains(&number).then_some(row.clock_bias_s));
        number += 1;
    })?;
    Ok(Some(Series::new(Of::Truth, phases_s, tau0_s)))
}

/// The longest run of samples at their usual distance, within one: an interval need not be a whole number of
/// samples.
fn longest_even(samples: &[u64]) -> Range<usize> {
    let steps: Vec<f64> = samples.windows(2).map(|pair| pair[1].abs_diff(pair[0]) as f64).collect();
    let Some(usual) = median(&steps) else { return 0..samples.len() };
    let (mut best, mut start) = (0..1, 0);
    for (index, step) in steps.iter().enumerate() {
        if (step - usual).abs() > 1.0 {
            start = index + 1;
        } else if index + 2 - start > best.len() {
            best = start..index + 2;
        }
    }
    best
}

/// Mean interval of samples on an even grid; `None` of fewer than two.
fn interval_s(run: &Run, samples: &[u64]) -> Option<f64> {
    let (first, last) = (samples.first()?, samples.last()?);
    // One division, so that a tenth of a second is 0.1.
    (last > first).then(|| (last - first) as f64 / (run.scene.sample_rate_hz * (samples.len() - 1) as f64))
}

/// Median time dilution of the fixes in a segment.
fn tdop(run: &Run, rows: &Table<ClockRow>) -> Result<Option<f64>, JudgeError> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(None) };
    let mut found = Vec::new();
    run.fixes.each(|fix| found.extend((first.sample..=last.sample).contains(&fix.sample).then_some(fix.tdop)))?;
    Ok(median(&found))
}

#[cfg(test)]
mod tests;
