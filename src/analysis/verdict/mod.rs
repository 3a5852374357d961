//! What passed, what is marginal, what failed, and by how much.
//!
//! Every figure is held against one limit whose origin is stated: a threshold of theory, the receiver's own
//! covariance, or a user's file ([`super::limits`]). A figure within a tenth of its limit is marginal. A
//! figure that a scene cannot have is named with the reason why it is not judged. Limits: the thresholds are
//! rules of thumb, not the points at which a receiver fails; several figures of one run share their causes.

mod availability;
mod hints;
mod interference;
mod judgement;
mod links;
mod losses;
mod motion;
mod position;
mod reception;
mod tables;
#[cfg(test)]
mod tests;
mod tracking;
mod values;

use serde::Serialize;
use serde_json::Value;

use crate::analysis::JudgeError;
use crate::analysis::due::Expectations;
use crate::analysis::due::receiver::Receiver;
use crate::analysis::errors::Errors;
use crate::analysis::load::Run;
use crate::analysis::slips::Slips;
use crate::analysis::summary::Summary;
pub(crate) use availability::Came;
pub(crate) use judgement::digits;
#[cfg(feature = "pdf")]
pub(crate) use judgement::number;
pub use judgement::{Bound, Judgement, MARGINAL_SHARE, Status};

/// Every figure of a run that is judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    pub rows: Vec<Judgement>,
    /// How many of the first rows hold a user's limits.
    pub of_user: usize,
    /// Figures that are not judged, each with the reason.
    pub not_judged: Vec<String>,
}

impl Verdict {
    /// How many have a status.
    pub fn count(&self, status: Status) -> usize {
        self.rows.iter().filter(|row| row.status == status).count()
    }

    /// The worst status.
    pub fn status(&self) -> Status {
        self.rows.iter().map(|row| row.status).max().unwrap_or(Status::Pass)
    }

    /// Its counts in words.
    pub fn in_words(&self) -> String {
        let [pass, marginal, fail] = [Status::Pass, Status::Marginal, Status::Fail].map(|status| self.count(status));
        format!("{pass} passed, {marginal} marginal, {fail} failed")
    }

    /// The user's limits that are broken.
    pub fn broken(&self) -> impl Iterator<Item = &Judgement> {
        self.rows.iter().take(self.of_user).filter(|row| row.status == Status::Fail)
    }

    /// A run against the limits that need no user: those of theory and of the receiver's own covariance.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where rows that were put by cannot be read.
    pub fn of(run: &Run, errors: &Errors, slips: &Slips, summary: &Summary) -> Result<Self, JudgeError> {
        let mut verdict = Self::default();
        let expected = Expectations::of(run, Receiver::of(run), run)?;
        verdict.satellites(run, &expected);
        verdict.availability(run.scene.duration_s, &run.scene.expect, &expected, &Came::of(run));
        verdict.values(run, errors, summary)?;
        verdict.tracking(run, summary);
        verdict.links(run, errors)?;
        verdict.losses(run, &expected.receiver, slips)?;
        verdict.reception(summary);
        verdict.cn0(run, summary);
        verdict.interference(summary);
        verdict.spoofing(run, summary);
        verdict.tables(run, errors)?;
        verdict.hint(run);
        Ok(verdict)
    }

    /// Puts a user's judgements first; they replace what is otherwise judged of the same figures.
    pub fn with_user(mut self, rows: Vec<Judgement>) -> Self {
        self.rows.retain(|row| rows.iter().all(|user| user.path != row.path || row.path.is_none()));
        self.of_user = rows.len();
        self.rows.splice(0..0, rows);
        self
    }

    fn judge(&mut self, figure: &str, path: &str, value: impl Into<Value>, unit: &str, bound: Bound, source: &str) {
        let row = Judgement::new(figure, value.into(), unit, bound, MARGINAL_SHARE, source);
        self.rows.push(if path.is_empty() { row } else { row.at(path) });
    }

    /// Says what is behind the row that was judged last.
    fn explain(&mut self, why: Vec<String>) {
        if let Some(row) = self.rows.last_mut() {
            row.why = why;
        }
    }

    /// Rows of `verdict.csv`.
    pub(crate) fn csv_rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|row| Row {
            figure: &row.figure,
            path: row.path.as_deref().unwrap_or(""),
            value: row.value_text(),
            unit: &row.unit,
            limit: row.bound.to_string(),
            margin_share: row.margin,
            status: row.status,
            source: &row.source,
            why: row.why.join("; "),
        })
    }
}

/// One row of `verdict.csv`.
#[derive(Serialize)]
pub(crate) struct Row<'a> {
    figure: &'a str,
    path: &'a str,
    value: String,
    unit: &'a str,
    limit: String,
    margin_share: Option<f64>,
    status: Status,
    source: &'a str,
    why: String,
}
