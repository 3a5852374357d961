//! The receiver at work: search, channels side by side, decoding, observations and fixes at common epochs.
//!
//! Blocks of samples come in order; channels are independent and run on as many threads as there are, and what they
//! report is merged in the order of satellites, so that the result does not depend on threads.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::Read;

use rayon::prelude::*;
use thiserror::Error;

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::record::{AcquisitionRow, Event, EventRow, Observation};
use crate::gnss::samples::IfMetadata;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{SIGNALS, Signal};
use crate::gnss::time::{Epoch, SampleClock, WEEK_S};
use crate::receiver::acquire::{AcquireError, Acquired, Searcher, samples_needed};
use crate::receiver::decode::{Decoder, Found};
use crate::receiver::diagnosis::{Diagnosis, Stage};
use crate::receiver::observe;
use crate::receiver::output::{Output, OutputError};
use crate::receiver::position::solve::NoFix;
use crate::receiver::position::{Knowledge, LoopNoise, Solver};
use crate::receiver::settings::Settings;
use crate::receiver::source::{Block, Source, SourceError};
use crate::receiver::track::{Channel, Measurement, Report};

/// Length of the blocks that channels work on.
const BLOCK_S: f64 = 0.05;
/// Samples in a block at most: 1 MiB in planar `f32`, which stays in a core's cache while all channels go over it.
const BLOCK_SAMPLES: usize = 1 << 17;
/// Lost satellites are searched again this often.
const LOST_SEARCH_S: f64 = 2.0;

/// Why receiving ended early.
#[derive(Debug, Error)]
pub enum ReceiveError {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Acquire(#[from] AcquireError),
    #[error("no known signal lies in the band: {rate_hz} Hz of samples around {center_hz} Hz")]
    NoSignal { rate_hz: f64, center_hz: f64 },
}

/// What a run of the receiver came to.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub samples: u64,
    pub seconds: f64,
    pub acquired: usize,
    /// Largest number of satellites in a fix.
    pub used: u32,
    pub fixes: u64,
    pub first_fix_s: Option<f64>,
    /// Bytes of a sample cut off at the end.
    pub cut_bytes: usize,
    /// Why there is no fix, if there is none.
    pub diagnosis: Option<Diagnosis>,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} s of samples, {} satellites acquired, ", self.seconds, self.acquired)?;
        match self.first_fix_s {
            Some(first) => {
                write!(f, "{} fixes with up to {} satellites, the first after {first:.1} s", self.fixes, self.used)?
            }
            None => write!(f, "no fix")?,
        }
        if self.cut_bytes > 0 {
            write!(f, "; the last {} bytes are not a whole sample (is the format right?)", self.cut_bytes)?;
        }
        Ok(())
    }
}

/// Receives `samples` from a cold start and writes everything found to `output`; `progress` hears the samples done.
///
/// # Errors
/// Reading, writing, or settings that do not fit the samples. Finding nothing is no error: see [`Outcome::diagnosis`].
pub fn receive<R: Read>(
    metadata: &IfMetadata,
    samples: R,
    settings: &Settings,
    output: &mut Output,
    progress: &mut dyn FnMut(u64),
) -> Result<Outcome, ReceiveError> {
    output.describe(metadata, settings)?;
    let mut receiver = Receiver::new(metadata, settings)?;
    let stride = ((metadata.rate.hz() * BLOCK_S) as usize).clamp(1, BLOCK_SAMPLES);
    let mut source = Source::new(samples, metadata.format, stride)?;
    while let Some(block) = source.next_block()? {
        receiver.take(&block, output)?;
        progress(block.first + block.i.len() as u64);
    }
    output.finish()?;
    Ok(receiver.outcome(source.samples(), source.cut_bytes()))
}

/// A satellite that is being followed.
struct Tracked {
    channel: Channel,
    decoder: Option<Decoder>,
    report: Report,
    found: Vec<Found>,
    /// Whether a whole subframe came from it.
    confirmed: bool,
}

/// Samples kept until there are enough for a search.
#[derive(Default)]
struct Window {
    first: u64,
    i: Vec<f32>,
    q: Vec<f32>,
    /// Whether channels must be given these samples too: nothing has run on them yet.
    replay: bool,
}

struct Receiver<'a> {
    metadata: &'a IfMetadata,
    settings: &'a Settings,
    candidates: Vec<(&'static Signal, Sv)>,
    searcher: Searcher,
    needed: u64,
    window: Option<Window>,
    next_search: u64,
    searched: bool,
    tracked: BTreeMap<(&'static str, Sv), Tracked>,
    lost: BTreeSet<(&'static Signal, Sv)>,
    strongest: Option<AcquisitionRow>,
    acquired: BTreeSet<Sv>,
    lost_channels: usize,
    ephemerides: BTreeMap<Sv, Ephemeris>,
    klobuchar: Option<Klobuchar>,
    /// An instant within half a week of now, once known.
    near: Epoch,
    clock: Option<SampleClock>,
    solver: Solver,
    next_tick: u64,
    rows_per_tick: u64,
    fixes: u64,
    used: u32,
    first_fix_s: Option<f64>,
    last_failure: Option<NoFix>,
    /// Samples taken so far.
    now: u64,
}

impl<'a> Receiver<'a> {
    fn new(metadata: &'a IfMetadata, settings: &'a Settings) -> Result<Self, ReceiveError> {
        let half_band_hz = 0.5 * metadata.rate.hz();
        let candidates: Vec<_> = SIGNALS
            .into_iter()
            // A real recording may alias its IF into the band on purpose.
            .filter(|signal| !metadata.format.is_complex() || metadata.if_hz(signal).abs() < half_band_hz)
            .flat_map(|signal| signal.satellites().map(move |sv| (signal, sv)))
            .collect();
        if candidates.is_empty() {
            return Err(ReceiveError::NoSignal { rate_hz: metadata.rate.hz(), center_hz: metadata.center_hz });
        }
        let tracking = &settings.tracking;
        let noise = LoopNoise {
            spacing_chips: tracking.spacing_chips,
            code_bandwidth_hz: tracking.dll_bandwidth_hz,
            integration_s: f64::from(tracking.integration) * 1e-3,
            carrier_bandwidth_hz: tracking.pll_bandwidth_hz,
        };
        // Half the range of ten-bit weeks after the earliest one.
        let middle = Epoch::new((i64::from(settings.earliest_week) + 512) * WEEK_S, 0.0);
        Ok(Self {
            metadata,
            settings,
            candidates,
            searcher: Searcher::new(metadata, &settings.acquisition)?,
            needed: samples_needed(metadata, &settings.acquisition)?,
            window: Some(Window { replay: true, ..Window::default() }),
            next_search: 0,
            searched: false,
            tracked: BTreeMap::new(),
            lost: BTreeSet::new(),
            strongest: None,
            acquired: BTreeSet::new(),
            lost_channels: 0,
            ephemerides: BTreeMap::new(),
            klobuchar: None,
            near: metadata.start.unwrap_or(middle),
            clock: None,
            solver: Solver::new(settings.position.clone(), noise),
            next_tick: 0,
            rows_per_tick: (settings.tracking_row_interval_s / settings.interval_s).round().max(1.0) as u64,
            fixes: 0,
            used: 0,
            first_fix_s: None,
            last_failure: None,
            now: 0,
        })
    }

    /// The next block: into the search's window if one is open, and through the channels.
    fn take(&mut self, block: &Block, output: &mut Output) -> Result<(), ReceiveError> {
        self.now = block.first + block.i.len() as u64;
        if self.window.is_none() && block.first >= self.next_search {
            self.window = Some(Window::default());
        }
        let Some(window) = &mut self.window else { return self.advance(block, output) };
        if window.i.is_empty() {
            window.first = block.first;
        }
        window.i.extend_from_slice(block.i);
        window.q.extend_from_slice(block.q);
        let (replay, full) = (window.replay, window.i.len() as u64 >= self.needed);
        if full && let Some(window) = self.window.take() {
            let whole = Block { first: window.first, i: &window.i, q: &window.q };
            let hits = self.search(&whole, output)?;
            if !replay {
                // Channels already tracked go on first: new ones join with the next block.
                self.advance(block, output)?;
            }
            self.start(&hits, &whole, output)?;
            if replay {
                self.advance(&whole, output)?;
            }
            return Ok(());
        }
        if replay { Ok(()) } else { self.advance(block, output) }
    }

    /// Searches everything, so that strong signals that are tracked already do not pass for weak ones that are not, and
    /// returns hits that are new.
    fn search(&mut self, block: &Block, output: &mut Output) -> Result<Vec<Acquired>, ReceiveError> {
        let mut hits = Vec::new();
        for (row, hit) in self.searcher.search(block, &self.candidates)? {
            if self.tracked.contains_key(&(row.signal.name, row.sv)) {
                continue;
            }
            // Later searches leave rows of what they found only.
            if !self.searched || hit.is_some() {
                output.acquisition(&row)?;
            }
            if self.strongest.as_ref().is_none_or(|other| row.statistic > other.statistic) {
                self.strongest = Some(row);
            }
            if let Some(hit) = hit {
                self.lost.remove(&(hit.signal, hit.sv));
                hits.push(hit);
            }
        }
        self.searched = true;
        let interval_s = match self.settings.search_interval_s {
            _ if !self.lost.is_empty() => LOST_SEARCH_S,
            interval_s if interval_s > 0.0 => interval_s,
            _ => f64::MAX,
        };
        self.next_search = (block.first as f64 + interval_s * self.metadata.rate.hz()) as u64;
        Ok(hits)
    }

    fn start(&mut self, hits: &[Acquired], block: &Block, output: &mut Output) -> Result<(), ReceiveError> {
        for hit in hits {
            let channel = Channel::start(hit, self.metadata, &self.settings.tracking);
            let decoder = hit.signal.components.first().and_then(|component| Decoder::new(hit.sv, component));
            let tracked = Tracked { channel, decoder, report: Report::default(), found: Vec::new(), confirmed: false };
            self.tracked.insert((hit.signal.name, hit.sv), tracked);
            self.acquired.insert(hit.sv);
            output.event(&EventRow { sample: block.first, sv: hit.sv, signal: hit.signal, event: Event::Acquired })?;
        }
        Ok(())
    }

    /// Runs every channel over a block and makes observations and fixes at the epochs in it.
    fn advance(&mut self, block: &Block, output: &mut Output) -> Result<(), ReceiveError> {
        let ticks = self.ticks(block);
        let near = self.near;
        self.tracked.par_iter_mut().for_each(|(_, tracked)| tracked.advance(block, &ticks, near));
        self.merge(output)?;
        for tick in &ticks {
            self.epoch(*tick, output)?;
        }
        self.drop_lost();
        Ok(())
    }

    /// Samples of this block at which to measure, with the number of each epoch counted on.
    fn ticks(&mut self, block: &Block) -> Vec<u64> {
        let end = block.first + block.i.len() as u64;
        let mut ticks = Vec::new();
        loop {
            let sample = self.metadata.rate.first_sample_at(self.next_tick * self.settings.interval_ms(), 1000);
            if sample >= end {
                return ticks;
            }
            if sample >= block.first {
                ticks.push(sample);
            }
            self.next_tick += 1;
        }
    }

    /// Takes in what channels and decoders found, in the order of satellites.
    fn merge(&mut self, output: &mut Output) -> Result<(), ReceiveError> {
        let rate = self.metadata.rate;
        let now = self.now;
        for (&(_, sv), tracked) in &mut self.tracked {
            let signal = tracked.channel.signal();
            for &(sample, event) in &tracked.report.events {
                output.event(&EventRow { sample, sv, signal, event })?;
            }
            tracked.report.events.clear();
            for row in &tracked.report.rows {
                let tick = (rate.elapsed_s(row.sample) / self.settings.interval_s).round() as u64;
                if tick.is_multiple_of(self.rows_per_tick) {
                    output.tracking(row)?;
                }
            }
            tracked.report.rows.clear();
            for found in tracked.found.drain(..) {
                let mut event = |event| output.event(&EventRow { sample: now, sv, signal, event });
                match found {
                    Found::Frame { inverted } => {
                        tracked.channel.resolve_half_cycle(inverted);
                        tracked.confirmed = true;
                        event(Event::FrameSynchronised)?;
                    }
                    Found::Ephemeris(ephemeris) => {
                        self.near = ephemeris.transmitted;
                        event(Event::EphemerisComplete)?;
                        self.ephemerides.insert(sv, *ephemeris);
                    }
                    Found::Klobuchar(klobuchar) => self.klobuchar = Some(klobuchar),
                    Found::Rows(rows) => rows.iter().try_for_each(|row| output.navigation(row))?,
                }
            }
        }
        Ok(())
    }

    /// Observations of one epoch, and its fix.
    fn epoch(&mut self, sample: u64, output: &mut Output) -> Result<(), ReceiveError> {
        // The week is known from the recording's start or from an ephemeris.
        if self.metadata.start.is_none() && self.ephemerides.is_empty() {
            return Ok(());
        }
        let mut sent: Vec<(Sv, &'static Signal, Measurement, Epoch)> = Vec::new();
        for (&(_, sv), tracked) in &self.tracked {
            let signal = tracked.channel.signal();
            let measured = tracked.report.measurements.iter().find(|measurement| measurement.sample == sample);
            let tag = tracked.decoder.as_ref().and_then(Decoder::tag);
            if let (Some(measurement), Some(tag)) = (measured, tag)
                && measurement.locked
                && measurement.half_cycle_known
                && let Some(time) = observe::sent(measurement, tag, signal, self.near)
            {
                sent.push((sv, signal, *measurement, time));
            }
        }
        if self.clock.is_none() {
            let described = SampleClock { start: self.metadata.start.unwrap_or(self.near), rate: self.metadata.rate };
            let times: Vec<Epoch> = sent.iter().map(|entry| entry.3).collect();
            self.clock = observe::set_clock(described, self.metadata.start.is_some(), sample, &times);
        }
        let Some(clock) = self.clock else { return Ok(()) };
        let reading = clock.epoch(sample);
        let observations: Vec<Observation> = sent
            .iter()
            .map(|(sv, signal, measurement, time)| observe::observation(measurement, *sv, signal, *time, reading))
            .collect();
        for observation in &observations {
            output.observation(observation)?;
        }
        let knowledge = Knowledge {
            ephemerides: &self.ephemerides,
            klobuchar: self.klobuchar,
            reading,
            interval_s: self.settings.interval_s,
        };
        match self.solver.solve(&observations, &knowledge) {
            Ok(fix) => {
                self.near = fix.time();
                self.fixes += 1;
                self.used = self.used.max(fix.satellites);
                self.first_fix_s.get_or_insert(self.metadata.rate.elapsed_s(sample));
                output.fix(&fix)?;
            }
            Err(reason) => self.last_failure = Some(reason),
        }
        Ok(())
    }

    /// Takes channels that lost their signal out, to be searched again soon, and forgets this block's measurements.
    fn drop_lost(&mut self) {
        let soon = self.now + (LOST_SEARCH_S * self.metadata.rate.hz()) as u64;
        for tracked in self.tracked.values_mut() {
            tracked.report.measurements.clear();
            if tracked.channel.is_lost() {
                self.lost_channels += 1;
                // What never sent a whole subframe was perhaps never there: it waits for the next search of everything.
                if tracked.confirmed {
                    self.lost.insert((tracked.channel.signal(), tracked.channel.sv()));
                    self.next_search = self.next_search.min(soon);
                }
            }
        }
        self.tracked.retain(|_, tracked| !tracked.channel.is_lost());
    }

    fn outcome(self, samples: u64, cut_bytes: usize) -> Outcome {
        let seconds = self.metadata.rate.elapsed_s(samples);
        let diagnosis = (self.fixes == 0).then(|| self.diagnosis(samples, seconds));
        Outcome {
            samples,
            seconds,
            acquired: self.acquired.len(),
            used: self.used,
            fixes: self.fixes,
            first_fix_s: self.first_fix_s,
            cut_bytes,
            diagnosis,
        }
    }

    fn diagnosis(&self, samples: u64, seconds: f64) -> Diagnosis {
        let tagged = |tracked: &Tracked| tracked.decoder.as_ref().and_then(Decoder::tag).is_some();
        let following: Vec<Sv> = self.tracked.keys().map(|key| key.1).collect();
        let stage = if !self.searched {
            Stage::TooShort { have_s: seconds, need_s: self.metadata.rate.elapsed_s(self.needed.max(samples)) }
        } else if self.acquired.is_empty() {
            Stage::NothingAcquired { strongest: self.strongest.clone().map(Box::new) }
        } else if self.tracked.is_empty() {
            Stage::NoSymbols { acquired: self.acquired.iter().copied().collect(), lost: self.lost_channels }
        } else if !self.tracked.values().any(tagged) {
            Stage::NoFrame { tracked: following }
        } else if self.ephemerides.len() < 4 {
            let missing = self
                .tracked
                .iter()
                .filter(|(key, _)| !self.ephemerides.contains_key(&key.1))
                .map(|(key, tracked)| (key.1, tracked.decoder.as_ref().map_or(vec![1, 2, 3], Decoder::missing)))
                .collect();
            Stage::NoEphemeris { complete: self.ephemerides.len(), missing }
        } else {
            let reason = self.last_failure.clone().unwrap_or(NoFix::TooFew { have: 0, need: 4 });
            Stage::NoSolution { reason }
        };
        Diagnosis { stage, metadata: self.metadata.clone(), seconds }
    }
}

impl Tracked {
    fn advance(&mut self, block: &Block, ticks: &[u64], near: Epoch) {
        self.channel.advance(block, ticks, &mut self.report);
        for symbol in self.report.symbols.drain(..) {
            if let Some(decoder) = &mut self.decoder {
                decoder.push(&symbol, near, &mut self.found);
            }
        }
    }
}
