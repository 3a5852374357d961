//! The state of a reception between blocks: channels, what they decoded, the receiver's clock, the solver.
//!
//! [`search`] starts and ends channels, [`decode`] takes in messages, [`measure`] observes and solves,
//! [`gap`] watches for lost samples.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::record::{EventRow, LineRow};
use crate::gnss::samples::IfMetadata;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{Component, Link, Signal};
use crate::gnss::time::Epoch;
use crate::receiver::acquire::{self, Searcher};
use crate::receiver::decode::Decoder;
use crate::receiver::diagnosis::Stage;
use crate::receiver::interference::Watch;
use crate::receiver::lead::{lead, refusal};
use crate::receiver::looks::Looks;
use crate::receiver::observe::Timebase;
use crate::receiver::output::{Record, Sink};
use crate::receiver::parting::{Estimate, Line, Offset};
use crate::receiver::position::least_squares::{LARGEST_CONDITION, UNKNOWNS};
use crate::receiver::position::{CodeNoise, NoFix, Noises, Solver};
use crate::receiver::run::{Conditioning, Interfered, Outcome, ReceiveError, candidates, warnings};
use crate::receiver::settings::Settings;
use crate::receiver::source::{Block, Packed, Planes};
use crate::receiver::track::loops::CodeShape;
use crate::receiver::track::{Channel, LoopMargin, ReplicaModel, Report};

mod decode;
mod gap;
mod measure;
mod part;
mod plan;
mod search;

/// So many fixes in a row have to show a channel's wrong time.
const WRONG_TIME_FIXES: u32 = 10;

/// Years in 1024 weeks.
const ERA_YEARS: f64 = 19.6;

/// Channels go over a block in parts of so many samples at least: 512 KiB in planar `f32`, a core's own cache …
const PART_SAMPLES: usize = 1 << 16;
/// … and so long at least, as a code period that a part's end cuts is copied.
const PART_S: f64 = 0.01;

/// One channel and its decoder.
struct Track {
    channel: Channel,
    line: Line,
    watched: gap::Watched,
    decoder: Option<Decoder>,
    report: Report,
    since: u64,
    cn0_dbhz: f64,
    /// By the search that found it.
    found_dbhz: f64,
    symbols: u64,
    wrong_time: u32,
    dropped: bool,
}

/// Samples collected for a search.
struct Window {
    first: u64,
    samples: Planes,
}

impl Window {
    fn block(&self) -> Block<'_> {
        Block { first: self.first, i: &self.samples.i, q: &self.samples.q }
    }
}

/// What became of a satellite, for the diagnosis.
#[derive(Clone, Default)]
struct Progress {
    symbols: bool,
    frame: bool,
    missing: Vec<u8>,
}

pub(super) struct Session {
    metadata: IfMetadata,
    settings: Settings,
    week_reference: Epoch,
    /// The signals that are received; of the first one samples are watched for being lost.
    signals: Vec<&'static Signal>,
    candidates: Vec<Link>,
    searcher: Searcher,
    /// Where it looks, and whether as after the first search.
    aimed: Option<(plan::Sweep, bool)>,
    widenings: usize,
    looks: Looks,
    mirrored: Option<Estimate>,
    /// Median Doppler of the search that found most, with how many it found.
    found: (usize, f64),
    needed: u64,
    searched: bool,
    next_search: u64,
    window: Option<Window>,
    tracks: Vec<Track>,
    /// Of each share of the tracks.
    planes: Vec<Planes>,
    lost: BTreeMap<Link, u64>,
    refused: BTreeMap<Link, u64>,
    timebase: Timebase,
    solver: Solver,
    noises: Noises,
    offset: Offset,
    /// Channels that measure it.
    lines: usize,
    /// Code loops are on their way to a new offset until this sample.
    offset_moved: u64,
    gap: gap::Gap,
    ephemerides: BTreeMap<Sv, Ephemeris>,
    klobuchar: Option<Klobuchar>,
    next_tick: u64,
    strongest: Option<(Sv, f64, f64)>,
    progress: BTreeMap<Sv, Progress>,
    acquired: BTreeSet<Sv>,
    used: BTreeSet<Sv>,
    fixes: u64,
    first_fix_s: Option<f64>,
    clock_drift: Option<f64>,
    losses: u64,
    reason: Option<NoFix>,
    watch: Watch,
    /// Median C/N0 of the satellites when the spectrum last had no line.
    quiet_dbhz: Option<f64>,
    interfered: Option<Interfered>,
    worst_condition: Option<f64>,
    loops: [LoopMargin; 5],
}

impl Session {
    pub(super) fn new(metadata: &IfMetadata, settings: &Settings) -> Result<Self, ReceiveError> {
        let week_reference = settings.week_reference().map_err(|source| {
            crate::receiver::settings::SettingsError::Week { origin: "settings".to_owned(), source }
        })?;
        let asked = settings.acquisition.signals();
        let mut signals = asked.clone();
        signals.retain(|signal| acquire::can_hold(metadata, signal));
        // Samples that hold none of them are searched all the same: that nothing is found has a diagnosis.
        if signals.is_empty() {
            signals.extend(asked.first());
        }
        if let Some((signal, reason)) = signals.iter().find_map(|signal| Some((signal, refusal(signal)?))) {
            return Err(ReceiveError::Unsupported { signal: signal.name, reason });
        }
        let noises: Noises = signals.iter().map(|signal| (*signal, noise(signal, metadata, settings))).collect();
        let period_s = signals.first().and_then(|signal| lead(signal)).map_or(1.0, Component::period_s);
        Ok(Self {
            metadata: metadata.clone(),
            settings: settings.clone(),
            signals,
            week_reference,
            candidates: candidates(metadata, &settings.acquisition),
            searcher: Searcher::new(metadata, &settings.acquisition)?,
            aimed: None,
            widenings: 0,
            looks: Looks::default(),
            mirrored: None,
            found: (0, 0.0),
            needed: acquire::samples_needed(metadata, &settings.acquisition)?,
            searched: false,
            next_search: 0,
            window: None,
            tracks: Vec::new(),
            planes: Vec::new(),
            lost: BTreeMap::new(),
            refused: BTreeMap::new(),
            timebase: Timebase::new(metadata.rate, metadata.start),
            solver: Solver::new(&settings.position, noises.clone(), metadata.rate),
            noises,
            offset: Offset::default(),
            lines: 0,
            offset_moved: 0,
            gap: gap::Gap::default(),
            ephemerides: BTreeMap::new(),
            klobuchar: None,
            next_tick: 0,
            strongest: None,
            progress: BTreeMap::new(),
            acquired: BTreeSet::new(),
            used: BTreeSet::new(),
            fixes: 0,
            first_fix_s: None,
            clock_drift: None,
            losses: 0,
            reason: None,
            watch: Watch::new(metadata),
            quiet_dbhz: None,
            interfered: None,
            worst_condition: None,
            loops: settings.tracking.margins(period_s),
        })
    }

    /// The first signal, by whose band offsets are reported.
    fn signal(&self) -> Option<&'static Signal> {
        self.signals.first().copied()
    }

    /// Noise of the code loop of a signal.
    fn noise(&self, signal: &Signal) -> Option<&CodeNoise> {
        self.noises.iter().find(|(of, _)| *of == signal).map(|(_, noise)| noise)
    }

    fn samples(&self, seconds: f64) -> u64 {
        (seconds * self.metadata.rate.hz()) as u64
    }

    /// Takes the next block through the whole chain.
    pub(super) fn process(&mut self, block: &Packed, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        self.search(block, sink)?;
        let (ticks, measured) = self.ticks(block);
        self.follow(block, &ticks);
        self.record(sink)?;
        self.leap(block, sink)?;
        if !self.gap.is_busy() {
            self.part(block.end());
        }
        self.decode(block.end(), sink)?;
        for tick in measured {
            // Nothing is right while codes are not where they were to be.
            if !self.gap.is_busy() {
                self.measure(tick, sink)?;
            }
        }
        self.watch(block, sink)?;
        self.retire(block.end(), sink)?;
        self.hasten(block.end());
        Ok(())
    }

    /// Takes every channel through the block, on every core its share of them.
    ///
    /// Each share unpacks the samples for itself, in parts that stay in its core's cache: to read what another core has
    /// written takes longer than to unpack it again.
    fn follow(&mut self, block: &Packed, ticks: &[u64]) {
        let share = self.tracks.len().div_ceil(rayon::current_num_threads()).max(1);
        self.planes.resize_with(self.tracks.len().div_ceil(share), Planes::default);
        let part = PART_SAMPLES.max(self.samples(PART_S) as usize);
        self.tracks.par_chunks_mut(share).zip(&mut self.planes).for_each(|(tracks, planes)| {
            tracks.iter_mut().for_each(|track| clear(&mut track.report));
            for start in (0..block.samples()).step_by(part) {
                let samples = block.unpack(start..start + part, planes);
                let ticks = within(ticks, samples.first, samples.first + samples.i.len() as u64);
                for track in tracks.iter_mut() {
                    track.channel.advance(&samples, ticks, &mut track.report);
                }
            }
        });
    }

    /// Looks for continuous waves, and tells of those that are none of the satellites' own lines.
    fn watch(&mut self, block: &Packed, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let mut followed: Vec<f64> = self.tracks.iter().map(|track| track.cn0_dbhz).collect();
        followed.sort_by(f64::total_cmp);
        // A channel's first estimates may be low; the search's is not.
        let found = self.tracks.iter().map(|track| track.found_dbhz);
        let strongest_hz = found
            .chain(followed.last().copied())
            .max_by(f64::total_cmp)
            .map_or(0.0, |dbhz| libm::pow(10.0, dbhz / 10.0));
        let mut told = Vec::new();
        self.watch.take(block, strongest_hz, |_, row| told.push(row));
        for row in told {
            let Some(row) = row else {
                self.quiet_dbhz = followed.get(followed.len() / 2).copied().or(self.quiet_dbhz);
                continue;
            };
            let row = LineRow { js_db: self.quiet_dbhz.map(|dbhz| row.jn0_dbhz - dbhz), ..row };
            sink.take(Record::Interference(row.clone()))?;
            let seen = self.interfered.get_or_insert_with(|| Interfered { spectra: 0, strongest: row.clone() });
            seen.spectra += 1;
            if row.jn0_dbhz > seen.strongest.jn0_dbhz {
                seen.strongest = row;
            }
        }
        Ok(())
    }

    /// Samples of this block at which channels report, and those of them at which the receiver measures.
    fn ticks(&mut self, block: &Packed) -> (Vec<u64>, Vec<u64>) {
        let operation = &self.settings.operation;
        let step_ms = u64::from(operation.tracking_interval_ms);
        let each = u64::from(operation.measurement_interval_ms / operation.tracking_interval_ms).max(1);
        let end = block.end();
        let (mut ticks, mut measured) = (Vec::new(), Vec::new());
        loop {
            let sample = self.metadata.rate.first_sample_at(self.next_tick * step_ms, 1000);
            if sample >= end {
                return (ticks, measured);
            }
            // Below 1000 samples a second several ticks would meet in one sample.
            if ticks.last() != Some(&sample) {
                ticks.push(sample);
            }
            if self.next_tick.is_multiple_of(each) && measured.last() != Some(&sample) {
                measured.push(sample);
            }
            self.next_tick += 1;
        }
    }

    /// Writes rows and events of all channels.
    fn record(&mut self, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        for track in &mut self.tracks {
            for row in &track.report.rows {
                sink.take(Record::Tracking(row.clone()))?;
            }
            for &(sample, event) in &track.report.events {
                let (sv, signal) = (track.channel.sv(), track.channel.signal());
                sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
            }
            if let Some(last) = track.report.measurements.last() {
                track.cn0_dbhz = last.cn0_dbhz;
            }
        }
        Ok(())
    }

    /// What came of it; the caller adds what it knows of the samples.
    pub(super) fn outcome(&self) -> Outcome {
        Outcome {
            samples: 0,
            seconds: 0.0,
            acquired: self.acquired.iter().copied().collect(),
            used: self.used.iter().copied().collect(),
            fixes: self.fixes,
            first_fix_s: self.first_fix_s,
            losses: self.losses,
            cut_bytes: 0,
            format_warning: None,
            diagnosis: None,
            interfered: self.interfered.clone(),
            parted: self.parted(),
            jumps: self.gap.jumps.clone(),
            warnings: [warnings(&self.metadata, &self.settings), self.assumed_era().into_iter().collect()].concat(),
            conditioning: Conditioning {
                geometry_worst: self.worst_condition,
                geometry_limit: LARGEST_CONDITION,
                loops: self.loops.to_vec(),
            },
        }
    }

    /// What to say of a week that was resolved without a start time.
    fn assumed_era(&self) -> Option<String> {
        let clock = self.timebase.clock().filter(|_| self.metadata.start.is_none())?;
        Some(format!(
            "the recording has no start time and the message counts weeks modulo 1024: of times {ERA_YEARS} years apart the one \
             nearest to operation.week_reference = {:?} was taken, {}; --start TIME or that setting takes another",
            self.settings.operation.week_reference, clock.start
        ))
    }

    /// The first stage that failed, where there was no fix.
    pub(super) fn failed_stage(&self) -> Stage {
        if self.acquired.is_empty() {
            return Stage::NothingAcquired { strongest: self.strongest };
        }
        let of = |test: fn(&Progress) -> bool| -> Vec<Sv> {
            self.progress.iter().filter(|(_, progress)| test(progress)).map(|(sv, _)| *sv).collect()
        };
        let with_symbols = of(|progress| progress.symbols);
        if with_symbols.is_empty() {
            return Stage::NoSymbols { acquired: self.acquired.iter().copied().collect() };
        }
        if of(|progress| progress.frame).is_empty() {
            return Stage::NoFrame { with_symbols };
        }
        let complete: Vec<Sv> = self.ephemerides.keys().copied().collect();
        if complete.len() < UNKNOWNS {
            let lacking = |(sv, progress): (&Sv, &Progress)| {
                (progress.frame && !progress.missing.is_empty()).then(|| (*sv, progress.missing.clone()))
            };
            return Stage::NoEphemeris { complete, missing: self.progress.iter().filter_map(lacking).collect() };
        }
        Stage::NoPosition { with_ephemeris: complete, reason: self.reason.clone() }
    }
}

/// Noise of the code loops that follow a signal.
fn noise(signal: &'static Signal, metadata: &IfMetadata, settings: &Settings) -> CodeNoise {
    let component = lead(signal);
    let tracking = component.map_or(settings.tracking.clone(), |component| settings.tracking.fitted(component));
    let (chip_rate_hz, period_s) = component.map_or((1.0, 1.0), |c| (c.chip_rate_hz, c.period_s()));
    CodeNoise {
        chip_m: SPEED_OF_LIGHT_MPS / chip_rate_hz,
        shape: component
            .and_then(|c| ReplicaModel::new(&tracking, c, metadata.rate.hz()))
            .map_or(CodeShape::triangle(tracking.spacing_chips), |model| model.shape),
        bandwidth_hz: tracking.dll_bandwidth_hz,
        integration_s: period_s * f64::from(tracking.integration),
    }
}

/// Empties a report and keeps its room.
fn clear(report: &mut Report) {
    report.measurements.clear();
    report.symbols.clear();
    report.rows.clear();
    report.events.clear();
}

/// Those of the ascending `ticks` that lie in `first..end`.
fn within(ticks: &[u64], first: u64, end: u64) -> &[u64] {
    let of = |sample: u64| ticks.partition_point(|tick| *tick < sample);
    ticks.get(of(first)..of(end)).unwrap_or_default()
}
