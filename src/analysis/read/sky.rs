//! Satellites of a run in the sky, and a spoofer's signals.

use std::collections::{BTreeMap, BTreeSet};

use super::files::{each_of_any, rows};
use super::run::RECEIVER;
use crate::error::JudgeError;
use crate::read::run::Run;
use crate::read::spill_store::Finder;
use gnss::galileo::e1::E1;
use gnss::record::{Observation, SkyRow, TagRow};
use gnss::satellite::Sv;
use gnss::signal::Link;

impl Run {
    /// Satellites that are in the sky at some time.
    pub fn in_the_sky(&self) -> BTreeSet<Sv> {
        self.sky.keys().map(|link| link.sv).collect()
    }

    /// Values of `of` for the rows of a satellite in the sky. The rows are those of its signal that is there
    /// longest. A satellite's direction is equal for all of its signals.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn seen<U>(&self, sv: Sv, of: impl FnMut(SkyRow) -> U) -> Result<Vec<U>, JudgeError> {
        self.seen_longest(sv).map_or(Ok(Vec::new()), |link| self.sky.map(link, of))
    }

    /// Rows of a satellite in the sky, found by their samples.
    ///
    /// # Errors
    ///
    /// Same as [`crate::read::spill_store::SpillStore::finder`].
    pub fn seen_at(&self, sv: Sv) -> Result<Option<Finder<'_, Link, SkyRow>>, JudgeError> {
        self.seen_longest(sv).map(|link| self.sky.finder(link)).transpose()
    }

    fn seen_longest(&self, sv: Sv) -> Option<Link> {
        let own = self.sky.keys().filter(|link| link.sv == sv);
        // Of equal ones the first.
        own.rev().max_by_key(|link| self.sky.count(link))
    }

    /// Results of the tags of a receiver that verifies Galileo's authentication.
    ///
    /// # Errors
    /// A table that is missing or cannot be read.
    pub fn tags(&self) -> Result<Vec<TagRow>, JudgeError> {
        self.rx.as_ref().map_or(Ok(Vec::new()), |rx| rows(&rx.join("osnma.csv"), RECEIVER))
    }

    /// Observations of a spoofer's signals on E1 alone, by satellite and sample; spoofers count from 1.
    ///
    /// # Errors
    /// A table that cannot be read.
    pub fn spoofed(&self, number: usize) -> Result<BTreeMap<(Sv, u64), Observation>, JudgeError> {
        let suffix = if number > 1 { format!("_{number}") } else { String::new() };
        let mut all = BTreeMap::new();
        each_of_any(&self.truth_place.join(format!("spoofed{suffix}.csv")), |_, row: Observation| {
            if row.signal == &E1 {
                all.insert((row.sv, row.sample), row);
            }
            Ok(())
        })?;
        Ok(all)
    }
}
