//! Completeness and consistency of a receiver's tables.
//!
//! A value may be right and its row still be wrong: doubled, out of order, repeated, missing, or of another
//! time. `tables` checks the rows of one table, and `clocks` the columns about time. `acquisition` checks
//! searches against truth and events. `claims` checks messages, events and `receiver.json` against the
//! tables. `files` checks the files for people and other programs. Each finding is a count or a measure with
//! its limit and its first occurrence.

mod acquisition;
mod claims;
mod clocks;
mod files;
mod tables;

use crate::error::JudgeError;
use crate::measure::errors::Errors;
use crate::read::Run;

/// One law of the tables and how far it is broken.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Name of the measured figure, in words.
    pub figure: &'static str,
    /// The value.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
    /// Largest value of a sound receiver.
    pub limit: f64,
    /// Reason for the limit, and the position of the first or worst occurrence.
    pub source: String,
}

impl Finding {
    /// A count that ought to be nothing.
    fn none(figure: &'static str, found: Found, source: &str) -> Self {
        let source = found.first.map_or_else(|| source.to_owned(), |first| format!("{source}; first: {first}"));
        Self { figure, value: found.count as f64, unit: "", limit: 0.0, source }
    }

    /// A measure.
    fn most(figure: &'static str, value: f64, unit: &'static str, limit: f64, source: &str) -> Self {
        Self { figure, value, unit, limit, source: source.to_owned() }
    }
}

/// Number of occurrences, and the first one.
#[derive(Clone, Debug, Default)]
struct Found {
    count: usize,
    first: Option<String>,
}

impl Found {
    fn add(&mut self, at: impl FnOnce() -> String) {
        self.count += 1;
        if self.first.is_none() {
            self.first = Some(at());
        }
    }
}

/// Every law.
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read.
pub fn findings(run: &Run, errors: &Errors) -> Result<Vec<Finding>, JudgeError> {
    let mut all = tables::findings(run, errors)?;
    all.extend(clocks::findings(run)?);
    all.extend(acquisition::findings(run)?);
    all.extend(claims::findings(run)?);
    all.extend(files::findings(run)?);
    Ok(all)
}
