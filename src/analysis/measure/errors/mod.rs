//! Estimate minus truth, row by row.
//!
//! Observations are joined on (sample, satellite, signal), fixes on the sample. Code errors are
//! differences of [`gnss::time::Epoch`]s, exact to 1e-16 s; a carrier is compared after one
//! constant, a multiple of half a cycle, is taken from each uninterrupted arc. What the receiver
//! reports where the truth has no row (a satellite that is not there) is counted, not measured.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use crate::error::JudgeError;
use crate::expect::due::satellite::is_stepping;
use crate::expect::multiple_access::MultipleAccess;
use crate::read::numbers::Pooled;
use crate::read::spill_store::{Finder, SpillRow, SpillStore, Words};
use crate::read::{Numbers, Run, Table};
use crate::statistics::median;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::facts::Fault;
use gnss::record::{Event, EventRow, Observation};

use gnss::signal::Signal;

pub use gnss::signal::Link;

/// Errors of one observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalError {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Positive when the code is measured late: −c × (time sent as measured − as it was).
    pub code_m: f64,
    /// Carrier error in cycles after the arc's constant is removed.
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
    /// Time since the carrier locked, as the receiver states it, seconds.
    pub locked_s: f64,
    /// The time sent in truth, after a whole second.
    pub sent_fraction_s: f64,
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
    /// True offset of the receiver's clock from GPS time, seconds.
    pub true_clock_s: f64,
    /// Error of the velocity east, north and up, m/s.
    pub velocity_enu_mps: Vector3<f64>,
}

impl SpillRow<Link> for SignalError {
    const WORDS: usize = 11;

    fn put(&self, words: &mut Vec<u64>) {
        words.push(self.sample);
        let errors = [self.time_s, self.code_m, self.carrier_cycles, self.raw_cycles, self.doppler_hz];
        words.extend(errors.map(f64::to_bits));
        words.extend([self.cn0_dbhz, self.cn0_true_dbhz, self.cn0_effective_dbhz].map(f64::to_bits));
        words.extend([self.locked_s, self.sent_fraction_s].map(f64::to_bits));
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
            sent_fraction_s: words.number(),
        }
    }
}

impl SpillRow<()> for PositionError {
    const WORDS: usize = 10;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.time_s.to_bits()]);
        words.extend(self.enu_m.iter().map(|value| value.to_bits()));
        words.extend([self.clock_m, self.true_clock_s].map(f64::to_bits));
        words.extend(self.velocity_enu_mps.iter().map(|value| value.to_bits()));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let (sample, time_s) = (words.word(), words.number());
        let enu_m = Vector3::from_fn(|_, _| words.number());
        let (clock_m, true_clock_s) = (words.number(), words.number());
        let velocity_enu_mps = Vector3::from_fn(|_, _| words.number());
        Self { sample, time_s, enu_m, clock_m, true_clock_s, velocity_enu_mps }
    }
}

/// Sum and number of a signal's code errors at an epoch.
struct EpochSum {
    sample: u64,
    sum_m: f64,
    count: u64,
}

impl SpillRow<&'static Signal> for EpochSum {
    const WORDS: usize = 3;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.sum_m.to_bits(), self.count]);
    }

    fn take(_: &'static Signal, words: &mut Words<'_>) -> Self {
        Self { sample: words.word(), sum_m: words.number(), count: words.word() }
    }
}

/// Common code error of a signal, by the samples of its epochs.
pub struct Common<'e>(Finder<'e, &'static Signal, EpochSum>);

impl Common<'_> {
    /// Mean of the code errors at an epoch, and how many they are.
    pub fn get(&mut self, sample: u64) -> Option<(f64, u64)> {
        self.0.get(sample).map(|EpochSum { sum_m, count, .. }| (sum_m / count as f64, count))
    }

    /// Common code error of a signal where several satellites are observed.
    pub fn of_several(&mut self, sample: u64) -> Option<f64> {
        self.get(sample).filter(|(_, count)| *count > 1).map(|(mean_m, _)| mean_m)
    }
}

/// Every error of a run.
pub struct Errors {
    /// Errors of the satellites' signals, in the order of their samples.
    pub signals: SpillStore<Link, SignalError>,
    /// Code errors of each epoch together, signal by signal. Differences between signals are not errors of a
    /// satellite.
    epochs: SpillStore<&'static Signal, EpochSum>,
    /// Errors of all fixes that have a truth.
    pub positions: Table<PositionError>,
    /// Changes of the carrier's constant: those declared by the receiver's events after a satellite's first
    /// observation, and jumps of at least [`SLIP_CYCLES`] that stay and that it did not declare.
    pub cycle_slips: usize,
    /// Observations of satellites or samples that the truth does not have.
    pub unmatched: usize,
    /// Faults of the scene's satellites.
    faults: Vec<Fault>,
}

/// Phase lock is a fading mean over six symbols of 20 ms. When a satellite has gone, what it held fades as
/// (5/6)ⁿ and noise leaves a deviation of 0.21: it falls below 0.4 after five symbols in the mean, and after
/// twenty where noise delays it as it does once in a thousand times. A tick of 0.1 s comes on top.
const DETECTION_S: f64 = 0.5;

/// True if a sample of the truth for other satellites follows this one's last row so closely that no receiver
/// can know yet that the signal is gone.
fn has_just_gone(run: &Run, link: Link, sample: u64, truth: &mut Finder<'_, Link, Observation>) -> bool {
    let last = truth.before(sample);
    run.cn0_most_hz.finder().get(sample, link.signal).is_some()
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
        let directory = run.observations.directory();
        let mut errors = Self {
            signals: SpillStore::new(directory),
            epochs: SpillStore::new(directory),
            positions: Table::new(directory),
            cycle_slips: 0,
            unmatched: 0,
            faults: run.scene.faults.clone(),
        };
        let access = MultipleAccess::new(run);
        for link in run.observations.keys() {
            errors.measure_signal(run, &access, link)?;
        }
        if errors.signals.is_empty() && !run.observations.is_empty() {
            return Err(JudgeError::NothingJoins { what: "observations", count: run.observations.len() });
        }
        errors.sum_epochs()?;
        errors.measure_positions(run)?;
        Ok(errors)
    }

    fn measure_signal(&mut self, run: &Run, access: &MultipleAccess<'_>, link: Link) -> Result<(), JudgeError> {
        let mut truth = run.truth.finder(link)?;
        let mut rows = Vec::with_capacity(run.observations.count(&link));
        for estimate in run.observations.cursor(link) {
            let estimate = estimate?;
            let at = planted!(
                "analysis.errors.join",
                estimate.sample,
                run.observations.rows(link)?.first().map_or(0, |row| row.sample)
            );
            let Some(true_row) = truth.get(at) else {
                self.unmatched += usize::from(!has_just_gone(run, link, at, &mut truth));
                continue;
            };
            let common = &run.common;
            // A filter delays the carrier with the code; its cycles grow with the range.
            let delayed_cycles = true_row.doppler_hz * common.code_delay_s(link.signal);
            let true_cycles = true_row.carrier_cycles + delayed_cycles + common.carrier_cycles(estimate.sample);
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
                cn0_effective_dbhz: access.effective_dbhz(&true_row),
                locked_s: estimate.locked_s,
                sent_fraction_s: true_row.sent_fraction_s,
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
            self.signals.push(link, row)?;
        }
        Ok(())
    }

    /// Adds the code errors of each epoch and signal up: the satellites' rows, which are in the order of
    /// their samples, side by side.
    fn sum_epochs(&mut self) -> Result<(), JudgeError> {
        let signals: BTreeSet<&'static Signal> = self.signals.keys().map(|link| link.signal).collect();
        for signal in signals {
            let links = self.signals.keys().filter(|link| link.signal == signal);
            let mut rows: Vec<_> = links.map(|link| self.signals.cursor(link)).collect();
            let mut next = rows.iter_mut().map(|rows| rows.next().transpose()).collect::<Result<Vec<_>, _>>()?;
            while let Some(sample) = next.iter().flatten().map(|row| row.sample).min() {
                let mut epoch = EpochSum { sample, sum_m: 0.0, count: 0 };
                for (next, rows) in next.iter_mut().zip(&mut rows) {
                    while let Some(row) = next.filter(|row| row.sample == sample) {
                        (epoch.sum_m, epoch.count) = (epoch.sum_m + row.code_m, epoch.count + 1);
                        *next = rows.next().transpose()?;
                    }
                }
                self.epochs.push(signal, &epoch)?;
            }
        }
        Ok(())
    }

    fn measure_positions(&mut self, run: &Run) -> Result<(), JudgeError> {
        let mut truth = run.trajectory.finder()?;
        let mut fixes = run.fixes.cursor();
        while let Some(fix) = fixes.next().transpose()? {
            let Some(true_row) = truth.get(fix.sample) else { continue };
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
            })?;
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

    /// One number of every observation, of one signal or of all.
    ///
    /// # Errors
    /// [`JudgeError`] where rows cannot be read or numbers cannot be put away.
    pub fn pooled(&self, signal: Option<&Signal>, of: impl Fn(&SignalError) -> f64) -> Result<Numbers, JudgeError> {
        self.pooled_by(signal, |_, row| of(row))
    }

    /// Pool of a number of every observation that depends on the satellite's signal too.
    ///
    /// # Errors
    ///
    /// Same as [`Self::pooled`].
    pub fn pooled_by(
        &self,
        signal: Option<&Signal>,
        of: impl Fn(&Link, &SignalError) -> f64,
    ) -> Result<Numbers, JudgeError> {
        let mut all = Numbers::new(self.signals.directory());
        for link in self.of(signal) {
            for row in self.signals.cursor(link) {
                all.push(of(&link, &row?))?;
            }
        }
        Ok(all)
    }

    /// Shows `see` one number of every observation that is past its pull-in and not within a step of the
    /// satellite's clock, a list a satellite; of one signal, or of all.
    ///
    /// # Errors
    /// Errors of [`Self::pooled`].
    pub fn settled(
        &self,
        signal: Option<&Signal>,
        of: impl Fn(&Link, &SignalError) -> f64,
        mut see: impl FnMut(&Numbers) -> Result<(), JudgeError>,
    ) -> Result<(), JudgeError> {
        for link in self.of(signal) {
            let mut found = Numbers::new(self.signals.directory());
            for row in self.signals.cursor(link) {
                let row = row?;
                if row.locked_s >= PULL_IN_S && !is_stepping(&self.faults, link.sv, row.time_s) {
                    found.push(of(&link, &row))?;
                }
            }
            see(&found)?;
        }
        Ok(())
    }

    /// Standard deviation of those numbers, each satellite about its own mean.
    ///
    /// # Errors
    /// Errors of [`Self::pooled`].
    pub fn settled_std(
        &self,
        signal: Option<&Signal>,
        of: impl Fn(&Link, &SignalError) -> f64,
    ) -> Result<Option<f64>, JudgeError> {
        let mut pooled = Pooled::default();
        self.settled(signal, of, |group| pooled.add(group))?;
        Ok(pooled.std())
    }

    /// Code errors after the mean over the satellites of each epoch and signal is removed: receiver clock,
    /// time scale and the delay of the signal's own path. Epochs of one satellite are left out. With n
    /// satellites the mean takes 1/n of the variance with it. Of one signal, or of all.
    ///
    /// # Errors
    /// Errors of [`Self::pooled`].
    pub fn code_without_clock_m(&self, of: Option<&Signal>) -> Result<Numbers, JudgeError> {
        let mut all = Numbers::new(self.signals.directory());
        for link in self.of(of) {
            let mut common = self.common(link.signal)?;
            for row in self.signals.cursor(link) {
                let row = row?;
                if let Some(common_m) = common.of_several(row.sample) {
                    all.push(row.code_m - common_m)?;
                }
            }
        }
        Ok(all)
    }

    /// Common code error of a signal.
    ///
    /// # Errors
    ///
    /// Same as [`SpillStore::finder`].
    pub fn common(&self, signal: &'static Signal) -> Result<Common<'_>, JudgeError> {
        Ok(Common(self.epochs.finder(signal)?))
    }

    /// Checks that all rows which were looked up by their samples could be read.
    ///
    /// # Errors
    ///
    /// Same as [`SpillStore::sound`].
    pub fn sound(&self) -> Result<(), JudgeError> {
        self.signals.sound()?;
        self.epochs.sound()?;
        self.positions.sound()
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
/// stayed. A slip may occur during a measurement and show as two half steps.
fn first_jump(arc: &[SignalError]) -> Option<usize> {
    first_jump_of(&arc.iter().map(|row| row.carrier_cycles).collect::<Vec<_>>())
}

/// [`first_jump`] of carriers in cycles.
pub(crate) fn first_jump_of(carrier: &[f64]) -> Option<usize> {
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
