//! Errors of fixes against the protection levels that the receiver states: Stanford diagram, availability and
//! continuity.
//!
//! An error beyond its level is misleading information, and hazardous where it is beyond the alert limit of
//! an available fix too. The number of misleading fixes among all is compared with the promised probability
//! by its exact binomial interval (Clopper and Pearson 1934). Limits: fixes of one run are correlated, so
//! that they say less than as many independent ones; no run of this size can confirm 1e-7, but one exceedance
//! in it can refute it.

use serde::Serialize;
use serde_json::Value;
use statrs::distribution::{Beta, ContinuousCDF};

use crate::error::JudgeError;
use crate::measure::errors::Errors;
use crate::read::spill_store::{SpillRow, Words};
use crate::read::{Run, Table};

/// Probability with which the interval holds the true share.
pub const CONFIDENCE: f64 = 0.95;
/// Length of the windows of continuity, seconds: that of DO-229D's requirement.
pub const WINDOW_S: f64 = 15.0;

/// One fix: a row of `protection.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Protected {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Horizontal error, metres.
    pub horizontal_m: f64,
    /// Size of the vertical error, metres.
    pub vertical_m: f64,
    /// Horizontal protection level, metres.
    pub hpl_m: Option<f64>,
    /// Vertical protection level, metres.
    pub vpl_m: Option<f64>,
    /// True if the receiver states that the fix is available.
    pub available: bool,
    /// True if one of its tests showed a fault.
    pub detected: bool,
}

impl SpillRow<()> for Protected {
    const WORDS: usize = 7;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.time_s.to_bits(), self.horizontal_m.to_bits(), self.vertical_m.to_bits()]);
        words.extend([self.hpl_m, self.vpl_m].map(|level_m| level_m.unwrap_or(f64::NAN).to_bits()));
        words.push(u64::from(self.available) | u64::from(self.detected) << 1);
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let (sample, time_s, horizontal_m, vertical_m) = (words.word(), words.number(), words.number(), words.number());
        let [hpl_m, vpl_m] = [words.number(), words.number()].map(|level_m| (!level_m.is_nan()).then_some(level_m));
        let flags = words.word();
        let (available, detected) = (flags & 1 == 1, flags & 2 == 2);
        Self { sample, time_s, horizontal_m, vertical_m, hpl_m, vpl_m, available, detected }
    }
}

/// Stanford diagram of one axis, as counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stanford {
    /// Fixes that have a level.
    pub fixes: usize,
    /// Available, with an error within its level.
    pub nominal: usize,
    /// Available, with an error beyond its level and within the alert limit.
    pub misleading: usize,
    /// Available, with an error beyond level and alert limit.
    pub hazardous: usize,
    /// Not available, with an error within its level.
    pub unavailable: usize,
    /// Not available, with an error beyond its level.
    pub unavailable_misleading: usize,
    /// Share of errors beyond their level, and the ends of its interval.
    pub exceeded: f64,
    /// Lower end.
    pub exceeded_low: f64,
    /// Upper end.
    pub exceeded_high: f64,
    /// Probability that the receiver promises; null where its settings name none.
    pub promised: Option<f64>,
    /// Alert limit, metres; null where the settings name none.
    pub alert_limit_m: Option<f64>,
    /// Mean of the levels, metres.
    pub level_mean_m: f64,
    /// Largest error over its level.
    pub ratio_max: f64,
}

/// `protection` in `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Method of the levels.
    pub method: Option<String>,
    /// Fixes with a true position.
    pub fixes: usize,
    /// Fixes without a row of levels.
    pub without_row: usize,
    /// Share of the fixes that are available.
    pub available_share: f64,
    /// Fixes in which a test showed a fault.
    pub detected: usize,
    /// Times that an available fix was followed by one that is not.
    pub interruptions: usize,
    /// Windows of 15 s that begin with an available fix.
    pub windows: usize,
    /// Share of them in which every fix is available; null without a window.
    pub continuity: Option<f64>,
    /// Horizontal diagram; null without a level.
    pub horizontal: Option<Stanford>,
    /// Vertical diagram; null without a level.
    pub vertical: Option<Stanford>,
}

/// Protection levels of a run against its errors.
#[derive(Debug)]
pub struct Protection {
    /// Every fix that has a row of levels.
    pub rows: Table<Protected>,
    /// The figures; `None` of a receiver without levels.
    pub figures: Option<Figures>,
}

impl Protection {
    /// Measures it.
    ///
    /// # Errors
    /// [`JudgeError`] where rows cannot be read or put away.
    pub fn measure(run: &Run, errors: &Errors) -> Result<Self, JudgeError> {
        let mut rows = Table::new(errors.positions.directory());
        if run.levels.is_empty() {
            return Ok(Self { rows, figures: None });
        }
        let stated = Stated::of(run);
        let mut levels = run.levels.finder()?;
        let (mut flat, mut up) = (Counts::default(), Counts::default());
        let (mut fixes, mut available, mut detected, mut continuity) = (0, 0, 0, Continuity::default());
        for error in errors.positions.cursor() {
            let error = error?;
            fixes += 1;
            let Some(level) = levels.get(error.sample) else { continue };
            let row = Protected {
                sample: error.sample,
                time_s: error.time_s,
                horizontal_m: libm::hypot(error.enu_m.x, error.enu_m.y),
                vertical_m: error.enu_m.z.abs(),
                hpl_m: level.hpl_m,
                vpl_m: level.vpl_m,
                available: level.available,
                detected: level.detected,
            };
            available += usize::from(row.available);
            detected += usize::from(row.detected);
            continuity.add(row.time_s, row.available);
            flat.add(row.horizontal_m, row.hpl_m, stated.hal_m, row.available);
            up.add(row.vertical_m, row.vpl_m, stated.val_m, row.available);
            rows.push(row)?;
        }
        let (windows, kept) = continuity.finish();
        let figures = Figures {
            method: stated.method,
            fixes,
            without_row: fixes - rows.len(),
            available_share: available as f64 / fixes.max(1) as f64,
            detected,
            interruptions: continuity.interruptions,
            windows,
            continuity: (windows > 0).then(|| kept as f64 / windows as f64),
            horizontal: flat.diagram(stated.promised_horizontal, stated.hal_m),
            vertical: up.diagram(stated.promised_vertical, stated.val_m),
        };
        Ok(Self { rows, figures: Some(figures) })
    }
}

/// Settings of the receiver about its levels.
#[derive(Debug, Default)]
struct Stated {
    method: Option<String>,
    promised_horizontal: Option<f64>,
    promised_vertical: Option<f64>,
    hal_m: Option<f64>,
    val_m: Option<f64>,
}

impl Stated {
    fn of(run: &Run) -> Self {
        let settings = run.receiver.get("settings").unwrap_or(&run.receiver);
        let Some(own) = settings.get("integrity") else { return Self::default() };
        let number = |key: &str| own.get(key).and_then(Value::as_f64);
        let word = |key: &str| own.get(key).and_then(Value::as_str);
        let (promised_horizontal, promised_vertical) = match (word("method"), word("operation")) {
            // The factors 6.18 of a Rayleigh variable, 6.0 and 5.33 of two sides (DO-229D, J.2.1).
            (Some("sbas"), Some("en_route")) => (Some(5e-9), None),
            (Some("sbas"), _) => (Some(2e-9), Some(1e-7)),
            _ => (number("phmi_horizontal"), number("phmi_vertical")),
        };
        let method = word("method").map(str::to_owned);
        Self { method, promised_horizontal, promised_vertical, hal_m: number("hal_m"), val_m: number("val_m") }
    }
}

/// Fixes of one axis by their region.
#[derive(Debug, Default)]
struct Counts {
    /// Available and not; within the level, beyond it, and beyond the alert limit too.
    regions: [[usize; 3]; 2],
    level_sum_m: f64,
    ratio_max: f64,
}

impl Counts {
    fn add(&mut self, error_m: f64, level_m: Option<f64>, limit_m: Option<f64>, available: bool) {
        let Some(level_m) = level_m else { return };
        let is_beyond = error_m > level_m;
        let region = match (is_beyond, limit_m) {
            (false, _) => 0,
            (true, Some(limit_m)) if error_m > limit_m => 2,
            (true, _) => 1,
        };
        self.regions[usize::from(!available)][region] += 1;
        self.level_sum_m += level_m;
        self.ratio_max = self.ratio_max.max(error_m / level_m.max(f64::MIN_POSITIVE));
    }

    fn diagram(&self, promised: Option<f64>, alert_limit_m: Option<f64>) -> Option<Stanford> {
        let [[nominal, misleading, hazardous], [unavailable, beyond, far_beyond]] = self.regions;
        let beyond = beyond + far_beyond;
        let exceedances = misleading + hazardous + beyond;
        let fixes = nominal + unavailable + exceedances;
        if fixes == 0 {
            return None;
        }
        let (low, high) = interval(exceedances, fixes);
        Some(Stanford {
            fixes,
            nominal,
            misleading,
            hazardous,
            unavailable,
            unavailable_misleading: beyond,
            exceeded: exceedances as f64 / fixes as f64,
            exceeded_low: low,
            exceeded_high: high,
            promised,
            alert_limit_m,
            level_mean_m: self.level_sum_m / fixes as f64,
            ratio_max: self.ratio_max,
        })
    }
}

/// Exact interval of a probability of which `count` of `all` trials were seen.
pub fn interval(count: usize, all: usize) -> (f64, f64) {
    interval_of(count as f64, all as f64)
}

/// [`interval`] of numbers of trials that need not be whole, as those that correlated trials are worth.
pub fn interval_of(count: f64, all: f64) -> (f64, f64) {
    let tail = 0.5 * (1.0 - CONFIDENCE);
    // In closed form at the ends, where the distribution's inverse is not defined.
    let low = match count {
        0.0 => 0.0,
        every if every == all => libm::exp(libm::log(tail) / all),
        _ => Beta::new(count, all - count + 1.0).map_or(0.0, |law| law.inverse_cdf(tail)),
    };
    let high = match count {
        0.0 => -libm::expm1(libm::log(tail) / all),
        every if every == all => 1.0,
        _ => Beta::new(count + 1.0, all - count).map_or(1.0, |law| law.inverse_cdf(1.0 - tail)),
    };
    (low, high)
}

/// Windows that begin with an available fix, and those of them without another.
#[derive(Debug, Default)]
struct Continuity {
    /// Begins of windows that are open.
    open_s: std::collections::VecDeque<f64>,
    whole: usize,
    broken: usize,
    interruptions: usize,
    was_available: bool,
}

impl Continuity {
    fn add(&mut self, time_s: f64, available: bool) {
        while self.open_s.front().is_some_and(|begin_s| time_s - begin_s >= WINDOW_S) {
            self.open_s.pop_front();
            self.whole += 1;
        }
        if available {
            self.open_s.push_back(time_s);
        } else {
            self.interruptions += usize::from(self.was_available);
            self.broken += self.open_s.len();
            self.open_s.clear();
        }
        self.was_available = available;
    }

    /// Windows that the run has whole, and those of them without an interruption.
    fn finish(&self) -> (usize, usize) {
        (self.whole + self.broken, self.whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clopper and Pearson's interval: 0 of 10, 1 of 10, and 10 of 10 at 95 %, as tables have it.
    #[test]
    fn intervals_are_those_of_the_tables() {
        for (count, all, low, high) in [(0, 10, 0.0, 0.3085), (1, 10, 0.0025, 0.4450), (10, 10, 0.6915, 1.0)] {
            let found = interval(count, all);
            assert!((found.0 - low).abs() < 1e-4 && (found.1 - high).abs() < 1e-4, "{count}: {found:?}");
        }
        // One fix of a thousand beyond a level that promises 1e-7 refutes it; none of a thousand does not.
        assert!(interval(1, 1000).0 > 1e-7 && interval(0, 1000).0 == 0.0);
    }

    #[test]
    fn every_fix_with_a_level_lies_in_one_region() {
        let mut counts = Counts::default();
        for (error_m, level_m, available) in [
            (1.0, 10.0, true),
            (12.0, 10.0, true),
            (60.0, 10.0, true),
            (1.0, 50.0, false),
            (60.0, 50.0, false),
            (45.0, 44.0, false),
        ] {
            counts.add(error_m, Some(level_m), Some(40.0), available);
        }
        counts.add(1.0, None, Some(40.0), false);
        let found = counts.diagram(Some(1e-7), Some(40.0)).unwrap();
        assert_eq!(
            [found.nominal, found.misleading, found.hazardous, found.unavailable, found.unavailable_misleading],
            [1, 1, 1, 1, 2]
        );
        assert_eq!((found.fixes, found.ratio_max), (6, 6.0));
        assert!(Counts::default().diagram(None, None).is_none());
    }

    #[test]
    fn a_window_is_broken_by_one_fix_that_is_not_available() {
        let mut continuity = Continuity::default();
        for second in 0..60 {
            continuity.add(f64::from(second), second != 40);
        }
        // Windows that begin in the first 26 s are whole, those of the next fourteen are broken, and of those
        // after it the four that end before the run does are whole.
        assert_eq!((continuity.interruptions, continuity.broken, continuity.whole), (1, 14, 26 + 4));
    }
}
