//! Protection levels of fixes, spilled.

use crate::read::spill_store::{SpillRow, Words};
use gnss::record::IntegrityRow;

/// Protection levels of one fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Sample number of the fix.
    pub sample: u64,
    /// Horizontal level in metres.
    pub hpl_m: Option<f64>,
    /// Vertical level in metres.
    pub vpl_m: Option<f64>,
    /// True if the receiver states that the fix is available for its operation.
    pub available: bool,
    /// True if one of its tests showed a fault.
    pub detected: bool,
}

impl From<IntegrityRow> for Level {
    fn from(row: IntegrityRow) -> Self {
        let IntegrityRow { sample, hpl_m, vpl_m, available, detected, .. } = row;
        Self { sample, hpl_m, vpl_m, available, detected }
    }
}

/// A level that there is not: files refuse what is no number.
const NONE: f64 = f64::NAN;

impl SpillRow<()> for Level {
    const WORDS: usize = 4;

    fn put(&self, words: &mut Vec<u64>) {
        words.push(self.sample);
        words.extend([self.hpl_m, self.vpl_m].map(|level_m| level_m.unwrap_or(NONE).to_bits()));
        words.push(u64::from(self.available) | u64::from(self.detected) << 1);
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let sample = words.word();
        let [hpl_m, vpl_m] = [words.number(), words.number()].map(|level_m| (!level_m.is_nan()).then_some(level_m));
        let flags = words.word();
        Self { sample, hpl_m, vpl_m, available: flags & 1 == 1, detected: flags & 2 == 2 }
    }
}
