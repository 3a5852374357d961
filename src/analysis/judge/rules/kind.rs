//! One kind of error in three rows: its mean, its 95th percentile, and the largest against the limit of its
//! own epoch, which may be smaller than errors of epochs with wider limits; in a fourth, whether it has the
//! noise that nobody can avoid; and a stated sigma in two.
//!
//! Limits are quantiles of theory's σ for a stated probability of a false alarm, widened by what theory
//! itself may err, with known biases taken out.

use nalgebra::Vector3;

use crate::error::JudgeError;
use crate::expect::quantile::{largest, mean_square};
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::read::spill_store::SpillRow;
use crate::read::{Numbers, Table};

/// Factor by which theory's σ may be too small: 1 dB of C/N0 (1.12), and 7 % between the linear loop and a
/// real one.
pub(super) const THEORY: f64 = 1.2;
/// Factor within which a stated sigma lies about the expected one: 1 dB of C/N0 (1.12) and 12 % of theory and
/// smoothing.
pub(super) const SIGMA: f64 = 1.25;

/// Independent values from which on their mean square has a lower limit that says something: half of
/// theory's.
const ENOUGH: f64 = 100.0;

/// One kind of error of the rows `C`.
pub(super) struct Kind<'a, C> {
    pub name: &'a str,
    /// Path of its 95th percentile in `summary.json`; empty without one.
    pub path: &'a str,
    pub unit: &'a str,
    pub axes: u32,
    /// Independent values among them.
    pub independent: f64,
    /// True if the error has noise that must be there: an error smaller than theory was not measured.
    pub must_scatter: bool,
    /// Words for what the values are without; empty where they are the measured errors.
    pub without: String,
    /// Value of a row, where it counts.
    pub of: &'a dyn Fn(&C) -> Option<Value>,
}

/// An error less its known bias, theory's σ along its longest axis, and what may come on top.
pub(super) struct Value {
    pub time_s: f64,
    pub error: Vector3<f64>,
    pub sigma: f64,
    pub allowed: f64,
}

impl Value {
    fn limit(&self, factor: f64) -> f64 {
        factor * THEORY * self.sigma + self.allowed
    }
}

impl Verdict {
    /// Mean, 95th percentile and largest of a kind of error.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub(super) fn kind<C>(&mut self, kind: &Kind<'_, C>, cases: &Table<C>) -> Result<(), JudgeError>
    where
        C: SpillRow<()> + Clone,
    {
        let Kind { name, path, unit, axes, ref without, .. } = *kind;
        let (mut lengths, mut limits) = (Numbers::new(cases.directory()), Numbers::new(cases.directory()));
        let mut sum: Vector3<f64> = Vector3::zeros();
        // As sums of iterators begin.
        let (mut squares, mut allowed) = (-0.0, -0.0);
        for case in cases.cursor() {
            let Some(value) = (kind.of)(&case?) else { continue };
            lengths.push(value.error.norm())?;
            // More than a twentieth beyond a limit has twenty times the probability of one beyond, at most
            // (Markov).
            limits.push(value.limit(largest(axes, 20)))?;
            sum += value.error;
            squares += value.sigma * value.sigma;
            allowed += value.allowed;
        }
        if lengths.is_empty() {
            return Ok(());
        }
        let count = lengths.len() as f64;
        let limit = largest(axes, 1) * THEORY * (squares / count / kind.independent).sqrt() + allowed / count;
        let source = format!("theory of C/N0, geometry and loops; {:.0} independent", kind.independent);
        self.judge(&format!("{name} error, mean"), "", sum.norm() / count, unit, Bound::Max(limit), &source);
        self.without(without);
        if kind.must_scatter && kind.independent >= ENOUGH {
            let least = (mean_square(kind.independent).0 * squares / count).sqrt() / THEORY;
            let value = lengths.rms()?;
            self.judge(
                &format!("{name} error, rms"),
                "",
                value,
                unit,
                Bound::Min(least),
                "as much noise as theory has",
            );
        }
        if let Some(limit) = limits.percentile(0.95)? {
            let (value, source) = (lengths.percentile(0.95)?, "theory of C/N0, geometry and loops");
            self.judge(&format!("{name} error, 95 %"), path, value, unit, Bound::Max(limit), source);
            self.without(without);
        }
        let factor = largest(axes, lengths.len());
        let over = |value: &Value| value.error.norm() / value.limit(factor);
        let mut worst: Option<Value> = None;
        cases.each(|case| {
            let new = (kind.of)(&case);
            let farther = |new: &Value| worst.as_ref().is_none_or(|old| over(old).total_cmp(&over(new)).is_le());
            if let Some(new) = new.filter(farther) {
                worst = Some(new);
            }
        })?;
        if let Some(worst) = worst {
            let source =
                format!("theory at {:.1} s, where it is nearest to its limit or farthest beyond", worst.time_s);
            let bound = Bound::Max(worst.limit(factor));
            self.judge(
                &format!("{name} error, largest against its limit"),
                "",
                worst.error.norm(),
                unit,
                bound,
                &source,
            );
            self.without(without);
        }
        Ok(())
    }

    /// The smallest and the largest ratio of a stated sigma to the one that should be stated.
    pub(super) fn sigma_ends(&mut self, name: &str, (low, high): (f64, f64)) {
        let source = "1 dB of C/N0, and 12 % of theory and smoothing";
        let figure = |end: &str| format!("{name} sigma over the expected one, {end}");
        self.judge(&figure("largest"), "", high, "of 1", Bound::Max(SIGMA), source);
        self.judge(&figure("smallest"), "", low, "of 1", Bound::Min(1.0 / SIGMA), source);
    }
}
