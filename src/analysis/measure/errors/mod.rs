//! Estimate minus truth, row by row.
//!
//! Observations are joined on (sample, satellite, signal), fixes on the sample. Code errors are
//! differences of [`crate::gnss::time::Epoch`]s, exact to 1e-16 s; a carrier is compared after one
//! constant, a multiple of half a cycle, is taken from each uninterrupted arc. What the receiver
//! reports where the truth has no row (a satellite that is not there) is counted, not measured.

use std::collections::{BTreeMap, HashMap};

use nalgebra::Vector3;

use crate::analysis::error::JudgeError;
use crate::analysis::expect::multiple_access::MultipleAccess;
use crate::analysis::read::Run;
use crate::analysis::read::spill_store::{SpillRow, SpillStore, Words};
use crate::analysis::statistics::median;
use crate::gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use crate::gnss::record::{Event, EventRow, Observation};

use crate::gnss::signal::Signal;

pub use crate::gnss::signal::Link;

/// Errors of one observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalError {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Positive when the code is measured late: −c × (time sent as measured − as it was).
    pub code_m: f64,
    /// After the arc's constant is removed, and with it.
    pub carrier_cycles: f64,
    /// The error with the arc's constant, cycles.
    pub raw_cycles: f64,
    /// Measured minus true Doppler, Hz.
    pub doppler_hz: f64,
    /// C/N0 as measured, dB-Hz.
    pub cn0_dbhz: f64,
    /// C/N0 that the scene sets, dB-Hz.
    pub cn0_true_dbhz: f64,
    /// The true one with the other satellites counted as noise.
    pub cn0_effective_dbhz: f64,
    /// Since the carrier locked, as the receiver says.
    pub locked_s: f64,
}

/// Errors of one fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionError {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// East, north, up about the true position.
    pub enu_m: Vector3<f64>,
    /// Speed of light times the error of GPS time.
    pub clock_m: f64,
    /// What the receiver's clock read minus GPS time, in truth.
    pub true_clock_s: f64,
    /// Error of the velocity east, north and up, m/s.
    pub velocity_enu_mps: Vector3<f64>,
}

impl SpillRow<Link> for SignalError {
    const WORDS: usize = 10;

    fn put(&self, words: &mut Vec<u64>) {
        words.push(self.sample);
        let errors = [self.time_s, self.code_m, self.carrier_cycles, self.raw_cycles, self.doppler_hz];
        words.extend(errors.map(f64::to_bits));
        words.extend([self.cn0_dbhz, self.cn0_true_dbhz, self.cn0_effective_dbhz, self.locked_s].map(f64::to_bits));
    }

    fn take(_: Link, words: &mut Words<'_>) -> Self {
        Self {
            sample: words.word(),
            time_s: words.number(),
            code_m: words.number(),
            carrier_cycles: words.number(),
            raw_cycles: words.number(),
            doppler_hz: words.number(),
            cn0_dbhz: words.number(),
            cn0_true_dbhz: words.number(),
            cn0_effective_dbhz: words.number(),
            locked_s: words.number(),
        }
    }
}

/// Every error of a run.
#[derive(Debug)]
pub struct Errors {
    /// In the order of their samples.
    pub signals: SpillStore<Link, SignalError>,
    /// Sum and number of the code errors of each epoch, signal by signal: what signals differ by is no error
    /// of a satellite.
    epochs: BTreeMap<(u64, &'static Signal), (f64, usize)>,
    /// Errors of all fixes that have a truth.
    pub positions: Vec<PositionError>,
    /// Changes of the carrier's constant: those declared by the receiver's events after a satellite's first
    /// observation, and jumps of at least [`SLIP_CYCLES`] that stay and that it did not declare.
    pub cycle_slips: usize,
    /// Observations of satellites or samples that the truth does not have.
    pub unmatched: usize,
}

/// Phase lock is a fading mean over six symbols of 20 ms. When a satellite has gone, what it held fades as
/// (5/6)ⁿ and noise leaves a deviation of 0.21: it falls below 0.4 after five symbols in the mean, and after
/// twenty where noise delays it as it does once in a thousand times. A tick of 0.1 s comes on top.
const DETECTION_S: f64 = 0.5;

/// Whether a sample that the truth has for other satellites follows so closely on this one's last row that no
/// receiver can know yet that the signal is gone.
fn has_just_gone(run: &Run, link: Link, sample: u64, truth: &HashMap<u64, Observation>) -> bool {
    let last = truth.keys().copied().filter(|before| *before < sample).max();
    run.cn0_most_hz.contains_key(&(sample, link.signal.name))
        && last.is_some_and(|last| run.time_s(sample) - run.time_s(last) <= DETECTION_S)
}

/// Time after a lock that loop jitter leaves out as pull-in.
pub const PULL_IN_S: f64 = 3.0;
/// A lasting jump of the carrier error from here on is a cycle slip: below the half cycle of a Costas loop.
pub const SLIP_CYCLES: f64 = 0.4;
/// Epochs on either side of a jump that decide whether it stays.
const SIDE: usize = 5;

impl Errors {
    /// Joins and measures; rows that are too many for memory spill to a file beside those of the run.
    pub fn measure(run: &Run) -> Result<Self, JudgeError> {
        let mut errors = Self {
            signals: SpillStore::new(run.observations.directory()),
            epochs: BTreeMap::new(),
            positions: Vec::new(),
            cycle_slips: 0,
            unmatched: 0,
        };
        let access = MultipleAccess::new(run);
        for link in run.observations.keys() {
            errors.measure_signal(run, &access, link)?;
        }
        if errors.signals.is_empty() && !run.observations.is_empty() {
            return Err(JudgeError::NothingJoins { what: "observations", count: run.observations.len() });
        }
        errors.measure_positions(run)?;
        Ok(errors)
    }

    fn measure_signal(&mut self, run: &Run, access: &MultipleAccess<'_>, link: Link) -> Result<(), JudgeError> {
        let truth: HashMap<u64, Observation> = run.truth.map(link, |row| (row.sample, row))?.into_iter().collect();
        let mut rows = Vec::new();
        for estimate in run.observations.rows(link)? {
            let at = planted!(
                "analysis.errors.join",
                estimate.sample,
                run.observations.rows(link)?.first().map_or(0, |row| row.sample)
            );
            let Some(true_row) = truth.get(&at) else {
                self.unmatched += usize::from(!has_just_gone(run, link, at, &truth));
                continue;
            };
            let common = &run.common;
            let true_cycles = true_row.carrier_cycles + common.carrier_cycles(estimate.sample);
            let raw_cycles = estimate.carrier_cycles - true_cycles;
            rows.push(SignalError {
                sample: estimate.sample,
                time_s: run.time_s(estimate.sample),
                code_m: planted!("analysis.errors.code_scale", -SPEED_OF_LIGHT_MPS, -0.5 * SPEED_OF_LIGHT_MPS)
                    * (estimate.sent().since(true_row.sent()) + common.code_delay_s(link.signal)),
                carrier_cycles: raw_cycles,
                raw_cycles,
                doppler_hz: planted!(
                    "analysis.errors.doppler",
                    estimate.doppler_hz - true_row.doppler_hz - common.doppler_hz,
                    0.0
                ),
                cn0_dbhz: estimate.cn0_dbhz,
                cn0_true_dbhz: true_row.cn0_dbhz,
                cn0_effective_dbhz: access.effective_dbhz(true_row),
                locked_s: estimate.locked_s,
            });
        }
        rows.sort_by_key(|row| row.sample);
        let first = rows.first().map_or(0, |row| row.sample);
        let of = |row: &&EventRow| row.link() == link && row.event == Event::CycleSlip && row.sample > first;
        let declared: Vec<u64> = run.events.iter().filter(of).map(|row| row.sample).collect();
        if !rows.is_empty() {
            self.cycle_slips += declared.len() + level_carrier(&mut rows, &declared);
        }
        for row in &rows {
            let (sum_m, count) = self.epochs.entry((row.sample, link.signal)).or_default();
            (*sum_m, *count) = (*sum_m + row.code_m, *count + 1);
            self.signals.push(link, row)?;
        }
        Ok(())
    }

    fn measure_positions(&mut self, run: &Run) -> Result<(), JudgeError> {
        let truth: HashMap<u64, _> = run.trajectory.iter().map(|row| (row.sample, row)).collect();
        for fix in &run.fixes {
            let Some(true_row) = truth.get(&fix.sample) else { continue };
            let to_enu = Geodetic::from_ecef(&true_row.position_m()).ecef_to_enu();
            self.positions.push(PositionError {
                sample: fix.sample,
                time_s: run.time_s(fix.sample),
                enu_m: to_enu
                    * (fix.position_m() - true_row.position_m())
                    * planted!("analysis.errors.position_scale", 1.0, 0.5),
                // What the front end delays arrives late: the receiver takes the time for an earlier one.
                clock_m: planted!("analysis.errors.clock", 1.0, 0.1)
                    * SPEED_OF_LIGHT_MPS
                    * (fix.time().since(true_row.time()) + run.common.clock_delay_s()
                        - run.scene.ahead_s(&fix.time_scale)),
                true_clock_s: true_row.clock_bias_s,
                velocity_enu_mps: to_enu
                    * planted!(
                        "analysis.errors.velocity",
                        fix.velocity_mps() - true_row.velocity_mps(),
                        Vector3::zeros()
                    ),
            });
        }
        if self.positions.is_empty() && !run.fixes.is_empty() {
            return Err(JudgeError::NothingJoins { what: "fixes", count: run.fixes.len() });
        }
        Ok(())
    }

    /// Satellites that send a signal, or all.
    fn of(&self, signal: Option<&Signal>) -> impl Iterator<Item = Link> {
        self.signals.keys().filter(move |link| signal.is_none_or(|signal| link.signal == signal))
    }

    /// One number of every observation.
    pub fn pooled(&self, of: impl Fn(&SignalError) -> f64) -> Result<Vec<f64>, JudgeError> {
        self.pooled_of(None, of)
    }

    /// The same of one signal, or of all.
    pub fn pooled_of(&self, signal: Option<&Signal>, of: impl Fn(&SignalError) -> f64) -> Result<Vec<f64>, JudgeError> {
        let mut all = Vec::with_capacity(self.signals.len());
        for link in self.of(signal) {
            self.signals.each(link, |row| all.push(of(&row)))?;
        }
        Ok(all)
    }

    /// One number of every observation that is past its pull-in, a list a satellite.
    pub fn settled(&self, of: impl Fn(&Link, &SignalError) -> f64) -> Result<Vec<Vec<f64>>, JudgeError> {
        self.settled_of(None, of)
    }

    /// The same of one signal, or of all.
    pub fn settled_of(
        &self,
        signal: Option<&Signal>,
        of: impl Fn(&Link, &SignalError) -> f64,
    ) -> Result<Vec<Vec<f64>>, JudgeError> {
        let one = |link: Link| {
            let mut found = Vec::with_capacity(self.signals.count(&link));
            self.signals.each(link, |row| found.extend((row.locked_s >= PULL_IN_S).then(|| of(&link, &row))))?;
            Ok(found)
        };
        self.of(signal).map(one).collect()
    }

    /// Code errors after the mean over the satellites of each epoch and signal is removed: receiver clock,
    /// time scale and the delay of the signal's own path. Epochs of one satellite are left out. With n
    /// satellites the mean takes 1/n of the variance with it. Of one signal, or of all.
    pub fn code_without_clock_m(&self, of: Option<&Signal>) -> Result<Vec<f64>, JudgeError> {
        let mut all = Vec::with_capacity(self.signals.len());
        for link in self.of(of) {
            let several = |row: &SignalError| self.common_m(link.signal, row.sample).filter(|(_, count)| *count > 1);
            self.signals.each(link, |row| all.extend(several(&row).map(|(common_m, _)| row.code_m - common_m)))?;
        }
        Ok(all)
    }

    /// Mean of a signal's code errors at an epoch, and how many they are.
    pub fn common_m(&self, signal: &'static Signal, sample: u64) -> Option<(f64, usize)> {
        self.epochs.get(&(sample, signal)).map(|(sum_m, count)| (sum_m / *count as f64, *count))
    }
}

/// Removes from each uninterrupted arc its constant, the multiple of half a cycle nearest to its median, and
/// returns the number of jumps that the receiver did not declare. An arc ends where `locked_s` falls, at a
/// declared slip, and at a jump.
fn level_carrier(rows: &mut [SignalError], declared: &[u64]) -> usize {
    let broken = |a: &SignalError, b: &SignalError| {
        b.locked_s < a.locked_s || declared.iter().any(|&slip| (a.sample + 1..=b.sample).contains(&slip))
    };
    let mut slips = 0;
    for arc in rows.chunk_by_mut(|a, b| !broken(a, b)) {
        let mut rest = arc;
        while let Some(jump) = first_jump(rest) {
            let (before, after) = rest.split_at_mut(jump);
            remove_constant(before);
            slips += 1;
            rest = after;
        }
        remove_constant(rest);
    }
    slips
}

/// The first row of an arc whose carrier jumped by [`SLIP_CYCLES`] or more against the rows before, and
/// stayed. A slip may take place during a measurement and show as two half steps.
fn first_jump(arc: &[SignalError]) -> Option<usize> {
    first_jump_of(&arc.iter().map(|row| row.carrier_cycles).collect::<Vec<_>>())
}

/// [`first_jump`] of carriers in cycles.
pub(in crate::analysis) fn first_jump_of(carrier: &[f64]) -> Option<usize> {
    (1..carrier.len().saturating_sub(1)).find(|&index| {
        let (before, after) = carrier.split_at(index);
        let (Some(last), Some(next)) = (before.last(), after.first()) else { return false };
        if (next - last).abs() < planted!("analysis.errors.slip_size", SLIP_CYCLES / 2.0, 2.0) {
            return false;
        }
        let before = median(&before[before.len().saturating_sub(SIDE)..]);
        let after = median(&after[..after.len().min(SIDE)]);
        before.zip(after).is_some_and(|(before, after)| (after - before).abs() >= SLIP_CYCLES)
    })
}

fn remove_constant(arc: &mut [SignalError]) {
    let carrier: Vec<f64> = arc.iter().map(|row| row.carrier_cycles).collect();
    let Some(middle) = median(&carrier) else { return };
    let constant = (2.0 * middle).round() / 2.0;
    arc.iter_mut().for_each(|row| row.carrier_cycles -= constant);
}

#[cfg(test)]
pub(super) mod tests;
