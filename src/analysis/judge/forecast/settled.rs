//! Sums and lists of errors of a satellite's observations, by which its loops are judged. They cover the
//! observations past their pull-in, without interference and with a steady C/N0.

use std::collections::VecDeque;

use crate::error::JudgeError;
use crate::expect::due::satellite::is_stepping;
use crate::expect::loops::{Places, Theory};
use crate::expect::multipath::Rays;
use crate::expect::multiple_access::MultipleAccess;
use crate::expect::stated::Stated;
use crate::measure::errors::{Errors, PULL_IN_S, SignalError};
use crate::read::{Numbers, Run};
use gnss::signal::Link;

/// Largest loss of C/N0 by interference, in decibels, for which thermal theory still describes the loops.
const JAMMED_DB: f64 = 1.0;
/// Largest change of the true C/N0 within [`STEADY_S`] that averages follow.
const STEADY_DB: f64 = 1.0;
const STEADY_S: f64 = 3.0;

/// A satellite's settled observations.
pub(super) struct Settled {
    /// Number of observations where the scene expects no errors.
    pub count: usize,
    /// Number of all observations.
    all: usize,
    /// Times of the first and the last.
    pub ends_s: (f64, f64),
    /// First and last samples of what is uninterrupted.
    pub spans: Vec<(u64, u64)>,
    locked_s: f64,
    /// Errors without what rays make of them, metres.
    pub code: Numbers,
    /// Positions of the observations in the loops' update intervals.
    pub places: Places,
    /// Largest part that rays have in one.
    pub ray_m: f64,
    /// Errors, cycles.
    pub carrier: Numbers,
    /// Errors, Hz.
    pub doppler: Numbers,
    /// Sum of one over C/N0.
    pub inverse_hz: f64,
    /// Sum of C/N0 in units of the samples' own power.
    pub white_hz: f64,
    /// Sum of C/N0 in decibels.
    pub dbhz: f64,
    /// Sum of the share that other satellites have in the noise.
    pub others: f64,
    /// Sum of the errors of C/N0, dB.
    pub off_db: f64,
    /// Largest error of C/N0, dB.
    pub most_off_db: f64,
}

impl Settled {
    /// Settled observations of a satellite. The front end lowers its C/N0. Other losses of the stated C/N0
    /// are in theory's share of the power or do not disturb loops.
    ///
    /// # Errors
    ///
    /// [`JudgeError`] where rows cannot be read or numbers cannot be stored.
    pub fn of(
        (run, access): (&Run, &MultipleAccess<'_>),
        errors: &Errors,
        link: Link,
        theory: &Theory,
        stated: &Stated,
    ) -> Result<Self, JudgeError> {
        let cost_db = stated.front_end_db(link.signal);
        let jammed = |row: &SignalError| row.cn0_true_dbhz - row.cn0_effective_dbhz;
        let mut least = f64::INFINITY;
        errors.signals.each(link, |row| least = least.min(jammed(&row)))?;
        let mut found = Self::none(errors);
        let (mut rays, mut window) = (Rays::of(run, link, theory.chip_m)?, VecDeque::new());
        for row in errors.signals.cursor(link) {
            let row = row?;
            window.push_back((row.time_s, row.cn0_effective_dbhz));
            while window.front().is_some_and(|(old_s, _)| row.time_s - old_s > STEADY_S) {
                window.pop_front();
            }
            let (low, high) = window
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, dbhz)| (low.min(*dbhz), high.max(*dbhz)));
            let is_steady = high - low <= STEADY_DB && jammed(&row) - least <= JAMMED_DB;
            if row.locked_s < PULL_IN_S || !is_steady {
                continue;
            }
            found.all += 1;
            if !run.scene.expect.bounded(row.time_s) || is_stepping(&run.scene.faults, link.sv, row.time_s) {
                continue;
            }
            let ray_m = theory.ray_m(rays.at(row.sample)?);
            let own_hz = libm::pow(10.0, row.cn0_true_dbhz / 10.0);
            let white_hz = access.white_hz(row.sample, link, own_hz) / libm::pow(10.0, cost_db / 10.0);
            let lacks_db = stated.cost_db(link, row.cn0_effective_dbhz - cost_db);
            found.places.add(row.sent_fraction_s, theory.update_s);
            found.add(&row, (ray_m, white_hz), [cost_db, lacks_db])?;
        }
        Ok(found)
    }

    fn none(errors: &Errors) -> Self {
        let [code, carrier, doppler] = std::array::from_fn(|_| Numbers::new(errors.signals.directory()));
        Self {
            count: 0,
            all: 0,
            ends_s: (0.0, 0.0),
            spans: Vec::new(),
            locked_s: 0.0,
            code,
            places: Places::default(),
            ray_m: 0.0,
            carrier,
            doppler,
            // As sums of iterators begin.
            inverse_hz: -0.0,
            white_hz: -0.0,
            dbhz: -0.0,
            others: -0.0,
            off_db: -0.0,
            most_off_db: 0.0,
        }
    }

    fn add(
        &mut self,
        row: &SignalError,
        (ray_m, white_hz): (f64, f64),
        [cost_db, lacks_db]: [f64; 2],
    ) -> Result<(), JudgeError> {
        let goes_on = row.locked_s > self.locked_s && row.time_s - self.ends_s.1 < 1.0;
        match self.spans.last_mut() {
            Some(span) if goes_on => span.1 = row.sample,
            _ => self.spans.push((row.sample, row.sample)),
        }
        let first_s = if self.count == 0 { row.time_s } else { self.ends_s.0 };
        (self.count, self.ends_s, self.locked_s) = (self.count + 1, (first_s, row.time_s), row.locked_s);
        self.code.push(row.code_m - ray_m)?;
        self.ray_m = self.ray_m.max(ray_m.abs());
        self.carrier.push(row.carrier_cycles)?;
        self.doppler.push(row.doppler_hz)?;
        self.inverse_hz += 1.0 / libm::pow(10.0, (row.cn0_effective_dbhz - cost_db) / 10.0);
        self.white_hz += white_hz;
        self.dbhz += row.cn0_effective_dbhz - cost_db - lacks_db;
        self.others += libm::pow(10.0, (row.cn0_true_dbhz - row.cn0_effective_dbhz) / 10.0) - 1.0;
        let off_db = row.cn0_dbhz - row.cn0_effective_dbhz + cost_db + lacks_db;
        self.off_db += off_db;
        self.most_off_db = self.most_off_db.max(off_db.abs());
        Ok(())
    }

    /// Whole and half cycles in a carrier whose level was found with rows that are left out.
    ///
    /// # Errors
    /// Errors of [`Numbers::each`].
    pub fn level_cycles(&self) -> Result<f64, JudgeError> {
        if self.count == self.all {
            return Ok(0.0);
        }
        Ok(0.5 * (2.0 * self.carrier.percentile(0.5)?.unwrap_or(0.0)).round())
    }
}
