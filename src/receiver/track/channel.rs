//! One channel: its parts, the order in which they work, and what it reports.
//!
//! A strong signal is pulled in by a frequency loop, then an assisted phase loop locks and searches for
//! symbol edges, then integrations and updates keep to the symbols. Of a weak one a batch of prompts is
//! collected while the carrier's oscillator runs free; frequency, phase and the probable edges follow from it
//! ([`super::pull_in`]), integrations keep to these edges at once, and symbols are given out when the edges
//! are beyond doubt. Every correlation spans one code period of the replica, from the first sample of the
//! period on; samples of an unfinished period are shown again or kept, so that results do not depend on
//! blocks. Correlations come from a [`Correlator`], and the channel cannot tell which.

use super::closed::{Loops, Update};
use super::cn0::Cn0;
use super::loops::CodeShape;
use super::model::ReplicaModel;
use super::pull_in::Batch;
use super::{Report, TrackingSettings};
use crate::acquire::Acquired;
use crate::correlate::correlator::{Correlator, Interval, Shown};
use crate::correlate::fixed::FixedSamples;
use crate::correlate::sums::{RunningSums, Samples};
use crate::lead::lead;
use crate::parting::Phases;
use crate::source::Block;
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::{Component, Link, Signal};

mod accumulator;
mod change;
mod companions;
mod detectors;
mod integrate;
mod measure;
mod oscillators;
mod past;
mod reseat;
mod signs;
mod stage;
mod supervise;

use accumulator::{Accumulator, Period};
use companions::Companions;
use detectors::Detectors;
use oscillators::Oscillators;
use reseat::Glances;
use signs::Signs;
use stage::Stage;

pub use past::Past;
pub use reseat::Glance;
pub use supervise::pilot_group;

/// Time constants 1/(4B) of the code's pull-in, times four, until its first error has decayed to 2 %.
const SETTLED: f64 = 1.0;
/// Signals that the search found weaker than this are pulled in by a batch of prompts: T·C/N0 is then below
/// ten, and a frequency loop's discriminator, ±250 Hz wide, scatters by more than 40 Hz.
const WEAK_DBHZ: f64 = 40.0;

/// Samples of an unfinished code period, and room for what is made of them.
#[derive(Clone, Debug, Default)]
struct Kept {
    first: u64,
    i: Vec<f32>,
    q: Vec<f32>,
    sums: RunningSums,
    fixed: FixedSamples,
}

/// Times and kind of a pull-in.
#[derive(Clone, Copy, Debug)]
struct PullIn {
    /// Sample at which it began.
    since: u64,
    /// Sample at which the running stage began.
    stage_since: u64,
    /// True if it is that of a weak signal, by a batch of prompts.
    is_batched: bool,
    /// True while the code loop has the bandwidth of its pull-in.
    is_wide: bool,
}

/// One signal of one satellite being followed.
#[derive(Clone, Debug)]
pub struct Channel {
    settings: TrackingSettings,
    hit: Acquired,
    /// Length of a code period, in seconds.
    period_s: f64,
    /// Carrier phase of what is followed against the signal's.
    phase_cycles: f64,
    /// Sample at which tracking began; `None` before.
    start: Option<u64>,
    nco: Oscillators,
    accumulator: Accumulator,
    companions: Companions,
    loops: Loops,
    last: Update,
    pull_in: PullIn,
    stage: Stage,
    signs: Signs,
    detectors: Detectors,
    glances: Glances,
    kept: Kept,
    /// True if the running code period is correlated from its beginning.
    whole: bool,
    /// Detectors sleep: the code has jumped, and nobody knows yet by how many periods.
    held: bool,
    /// The code was moved: integrations are not in step with symbols.
    moved: bool,
    lost: bool,
}

impl Channel {
    /// A channel that begins at what the search found. The code phase is carried from the hit's sample to the
    /// first sample of the first block with the code rate that belongs to the hit's Doppler. Settings are
    /// taken as validated.
    pub fn start(hit: &Acquired, metadata: &IfMetadata, settings: &TrackingSettings) -> Self {
        let component = lead(hit.signal);
        let settings = component.map_or(settings.clone(), |c| settings.fitted(c));
        let companions = component.map(|c| Companions::beside(c, hit.link(), &settings, metadata)).unwrap_or_default();
        // One sideband has the triangle of its chips.
        let wider = component.filter(|_| companions.sides.is_some()).map_or(1.0, |c| settings.narrower(c));
        let alone = TrackingSettings { spacing_chips: wider * settings.spacing_chips, ..settings.clone() };
        let model = component.and_then(|c| ReplicaModel::new(&alone, c, metadata.rate.hz()));
        let model_power = model.map_or(1.0, |model| model.power);
        let accumulator = Accumulator::new(component, hit.link(), &alone, metadata, model_power);
        let chip_rate_hz = component.map_or(1.0, |c| c.chip_rate_hz);
        let nco = Oscillators::new(hit, metadata, chip_rate_hz, accumulator.length());
        let period_s = component.map_or(1.0, Component::period_s);
        let signs = Signs::new(component, hit.sv, period_s);
        let shape = model.map_or(CodeShape::triangle(alone.spacing_chips), |model| model.shape);
        let loops = Loops::new(&settings, shape, signs.has_symbols, nco.sense * hit.doppler_hz);
        let detectors = Detectors::new(component, hit, &settings, first_cn0(&signs, period_s, settings.cn0_average_s));
        let is_batched = hit.cn0_dbhz + detectors.followed_db < WEAK_DBHZ;
        let batch = supervise::batch(&settings, signs.group, period_s);
        let mut channel = Self {
            hit: *hit,
            period_s,
            phase_cycles: component.map_or(0.0, |c| c.phase_cycles),
            start: None,
            nco,
            lost: accumulator.coded.is_none(),
            accumulator,
            companions,
            loops,
            last: Update::default(),
            pull_in: PullIn { since: 0, stage_since: 0, is_batched, is_wide: true },
            stage: if is_batched { Stage::Open(batch) } else { Stage::frequency() },
            glances: Glances::new(signs.group),
            signs,
            detectors,
            kept: Kept::default(),
            whole: false,
            held: false,
            moved: false,
            settings,
        };
        channel.design();
        channel.set_steps();
        channel
    }

    /// True if the signal was lost; the channel is then inactive.
    pub fn is_lost(&self) -> bool {
        self.lost
    }

    /// Renames the channel's satellite to `sv`, whose carrier and code equal those of the satellite that was
    /// searched for.
    pub fn rename(&mut self, sv: Sv) {
        self.hit.sv = sv;
    }

    /// The satellite that is followed.
    pub fn sv(&self) -> Sv {
        self.hit.sv
    }

    /// The signal that is followed.
    pub fn signal(&self) -> &'static Signal {
        self.hit.signal
    }

    /// Satellite and signal that are tracked.
    pub fn link(&self) -> Link {
        self.hit.link()
    }

    /// States whether the message showed the symbols to be inverted: from now on, until the carrier is
    /// interrupted, measurements have the half cycle right. Symbols keep their polarity.
    pub fn resolve_half_cycle(&mut self, inverted: bool) {
        self.signs.polarity = Some(inverted);
    }

    /// States by how much the carrier's Doppler exceeds the code's, in hertz of the carrier: the aid of the
    /// code leaves it out from the next code period on.
    pub fn set_carrier_offset(&mut self, hz: f64) {
        self.nco.next_offset_hz = hz;
        if self.start.is_none() {
            self.nco.offset_hz = hz;
            self.set_steps();
        }
    }

    /// Phases that the replica has counted at the beginning of the current code period.
    pub fn phases(&self) -> Phases {
        self.nco.phases()
    }

    /// Doppler of the carrier where the running code period begins, positive when approaching.
    pub fn doppler_hz(&self) -> f64 {
        self.nco.sense * self.loops.carrier.rate
    }

    /// True if the carrier is locked, and the code loop has settled after the search.
    pub fn is_settled(&self) -> bool {
        let passed_s = self.start.map_or(0.0, |start| self.nco.since_s(start));
        let is_locked = self.detectors.lock.is_locked();
        !self.lost && is_locked && passed_s >= SETTLED / self.settings.dll_pull_in_bandwidth_hz
    }

    /// Follows the signal through the next block. `ticks` are samples inside the block, ascending, at which
    /// to measure. Samples of a code period that the block cuts are kept.
    pub fn advance(&mut self, block: &Block, ticks: &[u64], report: &mut Report) {
        let mut kept = std::mem::take(&mut self.kept);
        if kept.i.is_empty() {
            kept.first = block.first;
        }
        kept.i.extend_from_slice(block.i);
        kept.q.extend_from_slice(block.q);
        let sums = if self.takes_sums() { kept.sums.of(&kept.i, &kept.q) } else { None };
        let fixed = self.takes_fixed().then(|| kept.fixed.of(&kept.i, &kept.q));
        let samples = Samples { i: &kept.i, q: &kept.q, sums, fixed };
        self.follow(&Shown { first: kept.first, samples, from: block.first }, ticks, report);
        let needed = self.needs().unwrap_or(u64::MAX).saturating_sub(kept.first);
        let done = usize::try_from(needed).unwrap_or(usize::MAX).min(kept.i.len());
        kept.i.drain(..done);
        kept.q.drain(..done);
        kept.first += done as u64;
        self.kept = kept;
    }

    /// Length of a code period.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The first sample of the running code period: what is shown next has to begin there or before. `None`
    /// while the channel has seen nothing, and when it is lost.
    pub fn needs(&self) -> Option<u64> {
        self.start.filter(|_| !self.lost).map(|_| self.nco.first)
    }

    /// True if the channel uses running sums of the samples.
    pub fn takes_sums(&self) -> bool {
        self.accumulator.takes_sums(&self.nco.nco())
    }

    /// True if the channel uses samples in 16 bits.
    pub fn takes_fixed(&self) -> bool {
        self.accumulator.takes_fixed(&self.nco.nco())
    }

    /// Follows the signal as far as `correlator` can be asked about whole code periods, from the first that
    /// the channel [`Channel::needs`] on. `ticks` are samples in what is new, ascending, at which to measure.
    pub fn follow<C: Correlator>(&mut self, correlator: &C, ticks: &[u64], report: &mut Report) {
        if self.lost {
            return;
        }
        if self.start.is_none() {
            self.begin(correlator.fresh());
        }
        let mut ticks = ticks.iter().copied().peekable();
        let end = correlator.end();
        while !self.lost {
            if let Some(coded) = &mut self.accumulator.coded {
                self.companions.ready(coded, self.signs.phase, self.nco.period);
            }
            let (from, to) = (self.nco.first, self.nco.next());
            while let Some(tick) = ticks.next_if(|&tick| tick < to.min(end)) {
                self.measure(tick, report);
            }
            if from < correlator.first() || to > end {
                break;
            }
            let (arithmetic, number) = (self.accumulator.arithmetic, self.nco.period);
            let interval = Interval { nco: self.nco.nco(), from, to, end: to };
            let (length, periods) = (self.nco.length, self.periods_to_come());
            self.correlate(&Period { correlator, arithmetic, number, interval, length, periods }, report);
        }
    }

    /// Begins at the first sample that the channel sees.
    fn begin(&mut self, first: u64) {
        self.nco.begin(first, &self.hit);
        self.accumulator.begin(first);
        self.start = Some(first);
        (self.pull_in.since, self.pull_in.stage_since) = (first, first);
    }

    /// Time between updates of the loops.
    fn update_s(&self) -> f64 {
        self.period_s * f64::from(self.periods_per_update())
    }

    fn periods_per_update(&self) -> u32 {
        self.stage.mode().periods_per_update(&self.settings, self.signs.group)
    }

    /// Code periods from the running one on with one replica, up to the next update of the loops.
    fn periods_to_come(&self) -> u32 {
        let running = self.periods_per_update().saturating_sub(self.accumulator.periods);
        if self.companions.keep_replica() { running } else { 1 }
    }

    /// Duration of what is summed like a symbol.
    fn symbol_s(&self) -> f64 {
        self.period_s * f64::from(self.signs.group)
    }

    /// Gains for the present stage.
    fn design(&mut self) {
        self.loops.design(&self.settings, self.stage.mode(), self.pull_in.is_wide, self.update_s());
    }

    /// Sets the oscillators to what the loops know.
    fn set_steps(&mut self) {
        self.nco.set_steps(&self.loops.carrier, &self.loops.code, self.update_s());
    }

    /// An empty batch of prompts for the pull-in of a weak signal.
    fn new_batch(&self) -> Batch {
        supervise::batch(&self.settings, self.signs.group, self.period_s)
    }

    #[cfg(test)]
    pub(super) fn shift_frequency(&mut self, hz: f64) {
        self.loops.carrier.rate += hz;
        self.set_steps();
    }

    #[cfg(test)]
    pub(super) fn is_tracking(&self) -> bool {
        self.stage.begin().is_some()
    }
}

/// Estimate of C/N0 before anything is known of the signs of prompts.
fn first_cn0(signs: &Signs, period_s: f64, average_s: f64) -> Cn0 {
    if signs.are_single() {
        return Cn0::of_single_periods(period_s, average_s);
    }
    Cn0::new(if signs.has_symbols { signs.group } else { 1 }, period_s, average_s)
}
