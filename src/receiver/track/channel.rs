//! One channel: numerically controlled oscillators, the order of its states, and what it reports.
//!
//! A strong signal is pulled in by a frequency loop, then an assisted phase loop locks and searches for
//! symbol edges, then integrations and updates keep to the symbols. Of a weak one a batch of prompts is
//! collected while the carrier's oscillator runs free; frequency, phase and the probable edges follow from it
//! ([`super::pull_in`]), integrations keep to these edges at once, and symbols are given out when the edges
//! are beyond doubt. Every correlation spans one code period of the replica, from the first sample of the
//! period on; samples of an unfinished period are shown again or kept, so that results do not depend on
//! blocks.

use num_complex::Complex64;

use super::bits::BitSync;
use super::closed::{Loops, Mode, Update};
use super::cn0::Cn0;
use super::halves::Halves;
use super::lock::{LockState, PhaseLock, Rotation, SymbolLock};
use super::long::LongCode;
use super::loops::CodeShape;
use super::model::ReplicaModel;
use super::pull_in::Batch;
use super::secondary_code::{SecondaryCodePhase, SecondaryCodeSync};
use super::side::SidePeaks;
use super::sides::Sides;
use super::sync::SymbolSync;
use super::{Report, Symbol, TrackingSettings};
use crate::acquire::Acquired;
use crate::correlate::fixed::FixedSamples;
use crate::correlate::sums::{RunningSums, Samples};
use crate::correlate::{Arithmetic, Replica, chips_to_units, units_to_chips};
use crate::lead::{followed_db, lead};
use crate::parting::Phases;
use crate::source::Block;
use gnss::samples::{Format, IfMetadata};
use gnss::satellite::Sv;
use gnss::signal::{Component, Link, Signal};
use gnss::time::{Rate, tone_turns};

mod integrate;
mod long;
mod measure;
mod oscillators;
mod pilot;
mod reseat;
mod side;
mod sides;
mod supervise;

use pilot::Data;
pub use supervise::pilot_group;

pub use reseat::Glance;
use reseat::Glances;

/// Prompts over which phase lock is averaged before symbols are known.
const LOCK_PERIODS: f64 = 100.0;
/// Time constants 1/(4B) of the code's pull-in, times four, until its first error has decayed to 2 %.
const SETTLED: f64 = 1.0;
/// Signals that the search found weaker than this are pulled in by a batch of prompts: T·C/N0 is then below
/// ten, and a frequency loop's discriminator, ±250 Hz wide, scatters by more than 40 Hz.
const WEAK_DBHZ: f64 = 40.0;

/// Samples that a channel is given, in the forms that were made.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Number of the first sample.
    pub first: u64,
    /// All that are shown, those that were shown before among them.
    pub samples: Samples<'a>,
    /// Number of the first sample that was not shown before.
    pub from: u64,
}

impl Shown<'_> {
    /// Number of the sample after the last one.
    fn end(&self) -> u64 {
        self.first + self.samples.count() as u64
    }
}

/// Samples of an unfinished code period, and room for what is made of them.
#[derive(Clone, Debug, Default)]
struct Kept {
    first: u64,
    i: Vec<f32>,
    q: Vec<f32>,
    sums: RunningSums,
    fixed: FixedSamples,
}

/// Stage of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The carrier's oscillator runs free.
    Open,
    Frequency,
    Assisted,
    /// Symbols begin at code periods of this residue, beyond doubt if `confirmed`.
    Tracking(u64),
}

impl Stage {
    fn mode(self) -> Mode {
        match self {
            Self::Open | Self::Frequency => Mode::Frequency,
            Self::Assisted => Mode::Assisted,
            Self::Tracking(_) => Mode::Phase,
        }
    }
}

/// One signal of one satellite being followed.
#[derive(Clone, Debug)]
pub struct Channel {
    settings: TrackingSettings,
    least_cn0_hz: f64,
    sv: Sv,
    signal: &'static Signal,
    hit: Acquired,
    rate: Rate,
    if_hz: f64,
    /// Turns a sample at the nominal IF, in 2⁻⁶⁴ turns.
    if_step: u64,
    /// Sense of Doppler in the samples: +1, or −1 where the spectrum is inverted.
    sense: f64,
    /// Chip rate of the code, in hertz.
    chip_rate_hz: f64,
    /// Excess of the carrier's Doppler over the code's now, in hertz.
    carrier_offset_hz: f64,
    /// Excess from the next code period on, in hertz.
    next_offset_hz: f64,
    /// Length of a code period, in seconds.
    period_s: f64,
    /// Code periods per symbol, or periods that are summed where there are no symbols. It is 1 while a
    /// secondary code is unknown.
    group: u32,
    has_symbols: bool,
    /// Bit synchronisation for symbols of one period that build a bit by known signs.
    bits: Option<BitSync>,
    /// Code period at which bits begin, once it is known. `group` is then the number of periods per bit.
    bit_begin: Option<u64>,
    secondary_code: Option<SecondaryCodeSync>,
    secondary_code_phase: Option<SecondaryCodePhase>,
    data: Option<Data>,
    /// Pilot with a code too long for the search.
    long: Option<LongCode>,
    /// Index of the long code's segment that is the replica.
    segment: Option<u64>,
    side_peaks: Option<SidePeaks>,
    /// The other sideband of the sub-carrier of which what is followed is one.
    sides: Option<Sides>,
    /// C/N0 of what is followed over that of the whole signal.
    followed_db: f64,
    /// Carrier phase of what is followed against the signal's.
    phase_cycles: f64,
    /// Replica of the code. `None` where the documents assign no code: such a channel is lost from the start.
    replica: Option<Replica>,
    arithmetic: Arithmetic,
    replica_power: f64,
    taps: [i64; 3],
    /// Delays at which the code does not correlate with itself.
    noise_taps: Vec<i64>,

    /// Sample at which tracking began; `None` before.
    start: Option<u64>,
    /// Sample at which the current code period begins.
    first: u64,
    code: i64,
    period: u64,
    /// Carrier without the nominal IF, in 2⁻⁶⁴ turns, never wrapped.
    carrier: i128,
    code_step: i64,
    carrier_step: i128,
    kept: Kept,
    whole: bool,

    loops: Loops,
    wide: bool,
    stage: Stage,
    stage_since: u64,
    update_since: u64,
    /// Sample at which the pull-in began.
    pull_in_since: u64,
    /// Prompts of the pull-in.
    batch: Batch,
    /// True if the pull-in is that of a weak signal, by a batch.
    is_batched: bool,
    confirmed: bool,

    sums: [Complex64; 3],
    summed: u32,
    previous: Option<Complex64>,
    /// Prompt sum of the last update.
    previous_sum: Option<Complex64>,
    symbol: (Complex64, u32),
    rotation: Rotation,
    /// Rotation of the carrier within code periods. `is_true` is true if no false lock was seen since the
    /// last pull-in.
    halves: Halves,
    is_true: bool,
    power: Option<f64>,
    cn0: Cn0,
    phase_lock: PhaseLock,
    symbol_lock: SymbolLock,
    sync: SymbolSync,
    pending: Option<u64>,
    lock: LockState,
    polarity: Option<bool>,
    lost: bool,
    /// Detectors sleep: the code has jumped, and nobody knows yet by how many periods.
    held: bool,
    /// The code was moved: integrations are not in step with symbols.
    moved: bool,
    glances: Glances,
    last: Update,
}

impl Channel {
    /// A channel that begins at what the search found. The code phase is carried from the hit's sample to the
    /// first sample of the first block with the code rate that belongs to the hit's Doppler. Settings are
    /// taken as validated.
    pub fn start(hit: &Acquired, metadata: &IfMetadata, settings: &TrackingSettings) -> Self {
        let component = lead(hit.signal);
        let chip_rate_hz = component.map_or(1.0, |c| c.chip_rate_hz);
        let period_s = component.map_or(1.0, |c| c.period_s());
        let message = component.and_then(|c| c.message);
        let settings = &component.map_or(settings.clone(), |c| settings.fitted(c));
        let codes =
            component.filter(|c| c.secondary_code.periods() > 1).and_then(|c| c.secondary_code.of(hit.sv.number));
        let secondary_code = codes.map(SecondaryCodeSync::new);
        // Signs of prompts are anyone's guess until the secondary code's are known.
        let group = match message {
            _ if secondary_code.is_some() => 1,
            Some(_) => component.and_then(Component::periods_per_symbol).unwrap_or(1),
            None => pilot_group(period_s),
        };
        let has_symbols = message.is_some() || secondary_code.is_some();
        let waveform = settings.waveform;
        let (number, made) = (hit.sv.number, (waveform, settings.replica));
        let replica = component.and_then(|c| Replica::made_in(c, number, made, metadata.inverted));
        let sense = if metadata.inverted { -1.0 } else { 1.0 };
        let rates = (metadata.rate.hz(), sense);
        let sides = component.and_then(|c| Sides::beside(c, (hit.signal, number), settings, rates));
        // One sideband has the triangle of its chips.
        let wider = component.filter(|_| sides.is_some()).map_or(1.0, |c| settings.narrower(c));
        let alone = TrackingSettings { spacing_chips: wider * settings.spacing_chips, ..settings.clone() };
        let model = component.and_then(|c| ReplicaModel::new(&alone, c, metadata.rate.hz()));
        let half = 0.5 * alone.spacing_chips;
        let shape = model.map_or(CodeShape::triangle(alone.spacing_chips), |model| model.shape);
        let share = replica.as_ref().map_or(1.0, Replica::share);
        let followed = component.map_or(0.0, |c| followed_db(c, waveform));
        let loops = Loops::new(settings, shape, has_symbols, sense * hit.doppler_hz);
        let if_hz = metadata.if_hz(hit.link().carrier_hz());
        let is_batched = hit.cn0_dbhz + followed < WEAK_DBHZ;
        let mut channel = Self {
            settings: settings.clone(),
            least_cn0_hz: settings.least_cn0_hz(),
            sv: hit.sv,
            signal: hit.signal,
            hit: *hit,
            rate: metadata.rate,
            if_hz,
            if_step: tone_turns(if_hz, metadata.rate, 1),
            sense,
            chip_rate_hz,
            carrier_offset_hz: 0.0,
            next_offset_hz: 0.0,
            period_s,
            group,
            has_symbols,
            data: component
                .filter(|_| secondary_code.is_some())
                .and_then(|c| Data::beside(c, (hit.signal, hit.sv), settings, rates)),
            bits: message
                .map(|message| (message.bit)(hit.sv))
                .filter(|signs| signs.len() > 1 && has_symbols && group == 1)
                .map(BitSync::new),
            bit_begin: None,
            secondary_code,
            secondary_code_phase: None,
            long: component.and_then(|c| LongCode::beside(c, hit.signal, hit.sv.number, settings.replica)),
            segment: None,
            side_peaks: component.and_then(|c| SidePeaks::new(c, waveform)),
            sides,
            followed_db: followed,
            phase_cycles: component.map_or(0.0, |c| c.phase_cycles),
            lost: replica.is_none(),
            replica,
            arithmetic: match (settings.arithmetic, metadata.format) {
                (Arithmetic::F64, _) => Arithmetic::F64,
                (arithmetic, Format::Ci8 | Format::Cu8 | Format::Ri8) => arithmetic,
                (_, Format::Ci16Le | Format::Ri16Le | Format::Cf32Le) => Arithmetic::F32,
            },
            replica_power: share * model.map_or(1.0, |model| model.power),
            taps: [chips_to_units(half), 0, -chips_to_units(half)],
            noise_taps: Vec::new(),
            start: None,
            first: 0,
            code: 0,
            period: 0,
            carrier: 0,
            code_step: 0,
            carrier_step: 0,
            kept: Kept::default(),
            whole: false,
            loops,
            wide: true,
            stage: if is_batched { Stage::Open } else { Stage::Frequency },
            stage_since: 0,
            update_since: 0,
            pull_in_since: 0,
            batch: supervise::batch(settings, group, period_s),
            is_batched,
            confirmed: false,
            sums: [Complex64::ZERO; 3],
            summed: 0,
            previous: None,
            previous_sum: None,
            symbol: (Complex64::ZERO, 0),
            rotation: Rotation::default(),
            halves: Halves::default(),
            is_true: false,
            power: None,
            cn0: if has_symbols && group == 1 {
                Cn0::of_single_periods(period_s, settings.cn0_average_s)
            } else {
                Cn0::new(if has_symbols { group } else { 1 }, period_s, settings.cn0_average_s)
            },
            phase_lock: PhaseLock::new(LOCK_PERIODS),
            symbol_lock: SymbolLock::new(period_s * f64::from(group)),
            sync: SymbolSync::new(group),
            pending: None,
            lock: LockState::default(),
            polarity: None,
            held: false,
            moved: false,
            glances: Glances::new(group),
            last: Update::default(),
        };
        channel.design();
        channel.set_steps();
        if channel.arithmetic == Arithmetic::Sums
            && let Some(replica) = &mut channel.replica
        {
            replica.prepare(chips_to_units(chip_rate_hz / metadata.rate.hz()).max(1) as u64);
        }
        channel
    }

    /// True if the signal was lost; the channel is then inactive.
    pub fn is_lost(&self) -> bool {
        self.lost
    }

    /// Renames the channel's satellite to `sv`, whose carrier and code equal those of the satellite that was
    /// searched for.
    pub fn rename(&mut self, sv: Sv) {
        self.sv = sv;
        self.hit.sv = sv;
    }

    /// The satellite that is followed.
    pub fn sv(&self) -> Sv {
        self.sv
    }

    /// The signal that is followed.
    pub fn signal(&self) -> &'static Signal {
        self.signal
    }

    /// Satellite and signal that are tracked.
    pub fn link(&self) -> Link {
        Link { sv: self.sv, signal: self.signal }
    }

    /// States whether the message showed the symbols to be inverted: from now on, until the carrier is
    /// interrupted, measurements have the half cycle right. Symbols keep their polarity.
    pub fn resolve_half_cycle(&mut self, inverted: bool) {
        self.polarity = Some(inverted);
    }

    /// States by how much the carrier's Doppler exceeds the code's, in hertz of the carrier: the aid of the
    /// code leaves it out from the next code period on.
    pub fn set_carrier_offset(&mut self, hz: f64) {
        self.next_offset_hz = hz;
        if self.start.is_none() {
            self.carrier_offset_hz = hz;
            self.set_steps();
        }
    }

    /// Phases that the replica has counted at the beginning of the current code period.
    pub fn phases(&self) -> Phases {
        let carrier = if self.sense < 0.0 { -self.carrier } else { self.carrier };
        Phases { sample: self.first, periods: self.period, chips: units_to_chips(self.code), carrier }
    }

    /// Doppler of the carrier where the running code period begins, positive when approaching.
    pub fn doppler_hz(&self) -> f64 {
        self.sense * self.loops.carrier.rate
    }

    /// True if the carrier is locked, and the code loop has settled after the search.
    pub fn is_settled(&self) -> bool {
        let passed_s = self.start.map_or(0.0, |start| self.since_s(start));
        !self.lost && self.lock.is_locked() && passed_s >= SETTLED / self.settings.dll_pull_in_bandwidth_hz
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
        self.start.filter(|_| !self.lost).map(|_| self.first)
    }

    /// True if the channel uses running sums of the samples.
    pub fn takes_sums(&self) -> bool {
        self.arithmetic == Arithmetic::Sums
            && self.replica.as_ref().is_some_and(|replica| replica.takes_sums(&self.oscillators()))
    }

    /// True if the channel uses samples in 16 bits.
    pub fn takes_fixed(&self) -> bool {
        self.arithmetic == Arithmetic::Sums
            && self.replica.as_ref().is_some_and(|replica| replica.takes_fixed(&self.oscillators()))
    }

    /// [`Channel::advance`] on samples that the caller keeps as far as the channel [`Channel::needs`] them.
    pub fn follow(&mut self, shown: &Shown, ticks: &[u64], report: &mut Report) {
        if self.lost {
            return;
        }
        let Some(mut replica) = self.replica.take() else { return };
        if self.start.is_none() {
            self.begin(shown.from, &replica);
        }
        let mut ticks = ticks.iter().copied().peekable();
        let end = shown.end();
        while !self.lost {
            self.ready(&mut replica);
            let next = self.first + self.samples_left(&replica);
            while let Some(tick) = ticks.next_if(|&tick| tick < next.min(end)) {
                self.measure(tick, &replica, report);
            }
            let Some(from) = self.first.checked_sub(shown.first).filter(|_| next <= end) else { break };
            let period = shown.samples.part(from as usize, (next - shown.first) as usize);
            self.correlate(&replica, period, next, report);
        }
        self.replica = Some(replica);
    }

    /// The best estimate of C/N0: what the search found until there is one.
    fn cn0_hz(&self) -> f64 {
        self.cn0.hz().unwrap_or_else(|| libm::pow(10.0, (self.hit.cn0_dbhz + self.followed_db) / 10.0))
    }

    /// Power of a prompt's noise: two for white noise.
    fn noise(&self) -> f64 {
        self.cn0.noise().unwrap_or(2.0)
    }

    #[cfg(test)]
    pub(super) fn shift_frequency(&mut self, hz: f64) {
        self.loops.carrier.rate += hz;
        self.set_steps();
    }

    #[cfg(test)]
    pub(super) fn is_tracking(&self) -> bool {
        matches!(self.stage, Stage::Tracking(_))
    }
}
