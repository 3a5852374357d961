//! The state of a reception between blocks: channels, what they decoded, the receiver's clock, the solver.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::record::{Event, EventRow, LineRow, Observation};
use crate::gnss::samples::IfMetadata;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{SIGNALS, Signal};
use crate::gnss::time::Epoch;
use crate::receiver::acquire::{self, Searcher};
use crate::receiver::decode::{Decoder, News};
use crate::receiver::diagnosis::Stage;
use crate::receiver::interference::Watch;
use crate::receiver::observe::{Reading, Timebase};
use crate::receiver::output::Output;
use crate::receiver::position::least_squares::{LARGEST_CONDITION, UNKNOWNS};
use crate::receiver::position::{CodeNoise, NoFix, Solver};
use crate::receiver::run::{Conditioning, Interfered, Outcome, ReceiveError, candidates, warnings};
use crate::receiver::settings::Settings;
use crate::receiver::source::{Block, Packed, Planes};
use crate::receiver::track::{Channel, LoopMargin, Report, code_shape};

/// A satellite that was lost is searched for eagerly so long.
const EAGER_S: f64 = 30.0;
/// A channel that was dropped for what it said is not followed again so long.
const REFUSED_S: f64 = 120.0;
/// A C/A code shows 21 dB down in another's correlator; what is this much weaker than the strongest is not followed when
/// it was found beside tracked satellites. A search cannot tell it from an echo.
const ECHO_DB: f64 = 20.0;
/// Residuals beyond this are no noise: the channel has the wrong time.
const WRONG_TIME_M: f64 = 10_000.0;
/// So many fixes in a row have to say so.
const WRONG_TIME_FIXES: u32 = 10;

/// Channels go over a block in parts of so many samples at least: 512 KiB in planar `f32`, a core's own cache …
const PART_SAMPLES: usize = 1 << 16;
/// … and so long at least, as a code period that a part's end cuts is copied.
const PART_S: f64 = 0.01;

/// One channel and its decoder.
struct Track {
    channel: Channel,
    decoder: Option<Decoder>,
    report: Report,
    since: u64,
    cn0_dbhz: f64,
    symbols: u64,
    wrong_time: u32,
    dropped: bool,
}

/// Samples collected for a search.
struct Window {
    first: u64,
    samples: Planes,
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
    candidates: Vec<(&'static Signal, Sv)>,
    first_search: Searcher,
    later_searches: Searcher,
    needed: u64,
    searched: bool,
    next_search: u64,
    window: Option<Window>,
    tracks: Vec<Track>,
    /// Of each share of the tracks.
    planes: Vec<Planes>,
    lost: BTreeMap<(&'static Signal, Sv), u64>,
    refused: BTreeMap<(&'static Signal, Sv), u64>,
    timebase: Timebase,
    solver: Solver,
    ephemerides: BTreeMap<Sv, Ephemeris>,
    klobuchar: Option<Klobuchar>,
    next_tick: u64,
    strongest: Option<(Sv, f64, f64)>,
    progress: BTreeMap<Sv, Progress>,
    acquired: BTreeSet<Sv>,
    used: BTreeSet<Sv>,
    fixes: u64,
    first_fix_s: Option<f64>,
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
        let mut later = settings.acquisition.clone();
        later.false_alarm_probability =
            (later.false_alarm_probability * settings.operation.repeated_false_alarm_share).max(1e-12);
        let week_reference = settings.week_reference().map_err(|source| {
            crate::receiver::settings::SettingsError::Week { origin: "settings".to_owned(), source }
        })?;
        let component = SIGNALS.first().and_then(|signal| signal.components.first());
        let (chip_rate_hz, period_s) = component.map_or((1.0, 1.0), |c| (c.chip_rate_hz, c.period_s()));
        let noise = CodeNoise {
            chip_m: SPEED_OF_LIGHT_MPS / chip_rate_hz,
            shape: code_shape(&settings.tracking, chip_rate_hz / metadata.rate.hz()),
            bandwidth_hz: settings.tracking.dll_bandwidth_hz,
            integration_s: period_s * f64::from(settings.tracking.integration),
        };
        Ok(Self {
            metadata: metadata.clone(),
            settings: settings.clone(),
            week_reference,
            candidates: candidates(metadata),
            first_search: Searcher::new(metadata, &settings.acquisition)?,
            later_searches: Searcher::new(metadata, &later)?,
            needed: acquire::samples_needed(metadata, &settings.acquisition)?,
            searched: false,
            next_search: 0,
            window: None,
            tracks: Vec::new(),
            planes: Vec::new(),
            lost: BTreeMap::new(),
            refused: BTreeMap::new(),
            timebase: Timebase::new(metadata.rate, metadata.start),
            solver: Solver::new(&settings.position, noise, metadata.rate),
            ephemerides: BTreeMap::new(),
            klobuchar: None,
            next_tick: 0,
            strongest: None,
            progress: BTreeMap::new(),
            acquired: BTreeSet::new(),
            used: BTreeSet::new(),
            fixes: 0,
            first_fix_s: None,
            losses: 0,
            reason: None,
            watch: Watch::new(metadata),
            quiet_dbhz: None,
            interfered: None,
            worst_condition: None,
            loops: settings.tracking.margins(period_s),
        })
    }

    fn samples(&self, seconds: f64) -> u64 {
        (seconds * self.metadata.rate.hz()) as u64
    }

    /// Takes the next block through the whole chain.
    pub(super) fn process(&mut self, block: &Packed, output: &mut Output) -> Result<(), ReceiveError> {
        self.search(block, output)?;
        let (ticks, measured) = self.ticks(block);
        self.follow(block, &ticks);
        self.record(output)?;
        self.decode(output)?;
        for tick in measured {
            self.measure(tick, output)?;
        }
        self.watch(block, output)?;
        self.retire(block.end(), output)
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
    fn watch(&mut self, block: &Packed, output: &mut Output) -> Result<(), ReceiveError> {
        let mut followed: Vec<f64> = self.tracks.iter().map(|track| track.cn0_dbhz).collect();
        followed.sort_by(f64::total_cmp);
        let strongest_hz = followed.last().map_or(0.0, |dbhz| libm::pow(10.0, dbhz / 10.0));
        let mut told = Vec::new();
        self.watch.take(block, strongest_hz, |_, row| told.push(row));
        for row in told {
            let Some(row) = row else {
                self.quiet_dbhz = followed.get(followed.len() / 2).copied().or(self.quiet_dbhz);
                continue;
            };
            let row = LineRow { js_db: self.quiet_dbhz.map(|dbhz| row.jn0_dbhz - dbhz), ..row };
            output.interference(&row)?;
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

    /// Collects samples while a search is due, searches when there are enough, starts channels.
    fn search(&mut self, block: &Packed, output: &mut Output) -> Result<(), ReceiveError> {
        let end = block.end();
        if self.window.is_none() {
            if end <= self.next_search {
                return Ok(());
            }
            self.window = Some(Window { first: block.first, samples: Planes::default() });
        }
        let Some(window) = &mut self.window else { return Ok(()) };
        let missing = (self.needed as usize).saturating_sub(window.samples.i.len());
        let mut planes = Planes::default();
        let samples = block.unpack(0..missing, &mut planes);
        window.samples.i.extend_from_slice(samples.i);
        window.samples.q.extend_from_slice(samples.q);
        if (window.samples.i.len() as u64) < self.needed {
            return Ok(());
        }
        let Some(window) = self.window.take() else { return Ok(()) };
        self.refused.retain(|_, until| *until > end);
        let followed: BTreeSet<(&'static Signal, Sv)> =
            self.tracks.iter().map(|track| (track.channel.signal(), track.channel.sv())).collect();
        // Satellites that are followed are searched for too: without them their cross-correlation
        // would pass for others.
        let all_found = self.candidates.iter().all(|candidate| followed.contains(candidate));
        if !all_found {
            let searcher = if self.searched { &mut self.later_searches } else { &mut self.first_search };
            let strongest_dbhz = self.tracks.iter().map(|track| track.cn0_dbhz).fold(f64::NEG_INFINITY, f64::max);
            let searched = Block { first: window.first, i: &window.samples.i, q: &window.samples.q };
            let results = searcher.search(&searched, &self.candidates)?;
            for (mut row, hit) in results {
                row.acquired &= hit.is_some_and(|hit| hit.cn0_dbhz > strongest_dbhz - ECHO_DB);
                let key = (row.signal, row.sv);
                if followed.contains(&key) || self.refused.contains_key(&key) {
                    continue;
                }
                if self.strongest.is_none_or(|(_, best, _)| row.statistic > best) {
                    self.strongest = Some((row.sv, row.statistic, row.threshold));
                }
                // Of later searches only what was found says anything new.
                if row.acquired || !self.searched {
                    output.acquisition(&row)?;
                }
                let Some(hit) = hit.filter(|hit| hit.cn0_dbhz > strongest_dbhz - ECHO_DB) else { continue };
                self.acquired.insert(hit.sv);
                self.lost.remove(&key);
                self.progress.entry(hit.sv).or_default();
                output.event(&EventRow {
                    sample: hit.sample,
                    sv: hit.sv,
                    signal: hit.signal,
                    event: Event::Acquired,
                })?;
                self.tracks.push(Track {
                    channel: Channel::start(&hit, &self.metadata, &self.settings.tracking),
                    decoder: Decoder::new(hit.signal, hit.sv),
                    report: Report::default(),
                    since: block.first,
                    cn0_dbhz: hit.cn0_dbhz,
                    symbols: 0,
                    wrong_time: 0,
                    dropped: false,
                });
            }
            self.tracks.sort_by_key(|track| (track.channel.signal(), track.channel.sv()));
        }
        self.searched = true;
        self.plan_search(end);
        Ok(())
    }

    fn plan_search(&mut self, now: u64) {
        let eager = self.samples(EAGER_S);
        self.lost.retain(|_, since| now < *since + eager);
        let operation = &self.settings.operation;
        let wait_s =
            if self.lost.is_empty() { operation.search_interval_s } else { operation.reacquisition_interval_s };
        self.next_search = now + self.samples(wait_s).max(1);
    }

    /// Writes rows and events of all channels.
    fn record(&mut self, output: &mut Output) -> Result<(), ReceiveError> {
        for track in &mut self.tracks {
            for row in &track.report.rows {
                output.tracking(row)?;
            }
            for &(sample, event) in &track.report.events {
                let (sv, signal) = (track.channel.sv(), track.channel.signal());
                output.event(&EventRow { sample, sv, signal, event })?;
            }
            if let Some(last) = track.report.measurements.last() {
                track.cn0_dbhz = last.cn0_dbhz;
            }
        }
        Ok(())
    }

    /// Gives every symbol to its decoder and takes in what comes out.
    fn decode(&mut self, output: &mut Output) -> Result<(), ReceiveError> {
        for index in 0..self.tracks.len() {
            let near = self.near();
            let Some(track) = self.tracks.get_mut(index) else { continue };
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            let Some(decoder) = &mut track.decoder else { continue };
            let slipped = track.report.events.iter().any(|(_, event)| *event == Event::CycleSlip);
            let sample = track.report.measurements.last().map_or(track.since, |last| last.sample);
            let mut all = Vec::new();
            for symbol in &track.report.symbols {
                track.symbols += 1;
                all.extend(decoder.take(symbol, near));
            }
            let progress = self.progress.entry(sv).or_default();
            progress.symbols |= track.symbols > 0;
            progress.frame |= decoder.is_synchronised();
            progress.missing = decoder.missing();
            for news in all {
                let event = match news {
                    News::FrameSynchronised => Some(Event::FrameSynchronised),
                    News::Polarity { inverted } => {
                        if !slipped {
                            track.channel.resolve_half_cycle(inverted);
                        }
                        None
                    }
                    News::Contradiction => None,
                    News::Time(time) => {
                        self.timebase.hear(time);
                        None
                    }
                    News::Klobuchar(klobuchar) => {
                        self.klobuchar = Some(klobuchar);
                        None
                    }
                    News::Parameters(rows) => {
                        output.navigation(&rows)?;
                        None
                    }
                    News::Ephemeris(ephemeris) => {
                        let sick = ephemeris.health != 0;
                        let before = self.ephemerides.insert(sv, *ephemeris).is_some_and(|set| set.health != 0);
                        output.event(&EventRow { sample, sv, signal, event: Event::EphemerisComplete })?;
                        match (before, sick) {
                            (false, true) => Some(Event::Unhealthy),
                            (true, false) => Some(Event::Healthy),
                            _ => None,
                        }
                    }
                };
                if let Some(event) = event {
                    output.event(&EventRow { sample, sv, signal, event })?;
                }
            }
        }
        self.drop_echoes();
        Ok(())
    }

    /// The time near which weeks are resolved.
    fn near(&self) -> Epoch {
        self.timebase.clock().map(|clock| clock.start).or(self.metadata.start).unwrap_or(self.week_reference)
    }

    /// Two satellites never send the same orbit: the weaker is the other's cross-correlation.
    fn drop_echoes(&mut self) {
        let content = |e: &Ephemeris| {
            [e.sqrt_a_sqrtm, e.m0_rad, e.omega0_rad, e.omega_rad, e.eccentricity, e.af0_s].map(f64::to_bits)
        };
        let known: Vec<(usize, Sv, f64, [u64; 6])> = self
            .tracks
            .iter()
            .enumerate()
            .filter_map(|(index, track)| {
                let ephemeris = self.ephemerides.get(&track.channel.sv())?;
                Some((index, track.channel.sv(), track.cn0_dbhz, content(ephemeris)))
            })
            .collect();
        for (place, a) in known.iter().enumerate() {
            for b in known.iter().skip(place + 1) {
                if a.1 != b.1 && a.3 == b.3 {
                    let weaker = if a.2 < b.2 { a } else { b };
                    self.ephemerides.remove(&weaker.1);
                    if let Some(track) = self.tracks.get_mut(weaker.0) {
                        track.dropped = true;
                    }
                }
            }
        }
    }

    /// Observes and solves at one tick.
    fn measure(&mut self, tick: u64, output: &mut Output) -> Result<(), ReceiveError> {
        let readings: Vec<Reading> = self
            .tracks
            .iter()
            .filter(|track| !track.dropped)
            .filter_map(|track| {
                let measurement = track.report.measurements.iter().find(|measurement| measurement.sample == tick)?;
                Reading::new(track.channel.sv(), track.channel.signal(), measurement, track.decoder.as_ref()?)
            })
            .collect();
        let observed = self.timebase.observe(tick, &readings);
        for one in observed.iter().filter(|one| one.half_cycle_known) {
            output.observation(&one.observation)?;
        }
        let Some(clock) = self.timebase.clock() else { return Ok(()) };
        let observations: Vec<Observation> = observed.into_iter().map(|one| one.observation).collect();
        match self.solver.solve(tick, clock, &observations, &self.ephemerides, self.klobuchar) {
            Ok(solved) => {
                output.fix(&solved.fix)?;
                let condition = solved.fix.condition;
                self.worst_condition = Some(self.worst_condition.map_or(condition, |worst| worst.max(condition)));
                self.fixes += 1;
                let at_s = self.metadata.rate.elapsed_s(tick);
                self.first_fix_s.get_or_insert(at_s);
                self.used.extend(solved.used);
                for track in &mut self.tracks {
                    let sv = track.channel.sv();
                    let wrong = solved.excluded.iter().any(|(out, miss_m)| *out == sv && miss_m.abs() > WRONG_TIME_M);
                    track.wrong_time = if wrong { track.wrong_time + 1 } else { 0 };
                    track.dropped |= track.wrong_time >= WRONG_TIME_FIXES;
                }
            }
            Err(reason) => self.reason = Some(reason),
        }
        Ok(())
    }

    /// Takes away channels that lost their signal, say what cannot be, or lead nowhere.
    fn retire(&mut self, now: u64, output: &mut Output) -> Result<(), ReceiveError> {
        let limit = self.samples(self.settings.operation.frame_limit_s);
        let refused = now + self.samples(REFUSED_S);
        let mut gone = false;
        let mut kept = Vec::with_capacity(self.tracks.len());
        for track in std::mem::take(&mut self.tracks) {
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            let synchronised = track.decoder.as_ref().is_some_and(Decoder::is_synchronised);
            let fruitless = !synchronised && now > track.since + limit;
            if track.channel.is_lost() {
                self.lost.insert((signal, sv), now);
            } else if track.dropped || fruitless {
                let event = Event::LossOfLock;
                output.event(&EventRow { sample: now.saturating_sub(1), sv, signal, event })?;
                // A wrong time may come right when the satellite is acquired anew; an echo does not.
                if track.wrong_time < WRONG_TIME_FIXES {
                    self.refused.insert((signal, sv), refused);
                }
                self.lost.insert((signal, sv), now);
            } else {
                kept.push(track);
                continue;
            }
            gone = true;
            self.losses += 1;
        }
        self.tracks = kept;
        if gone && self.window.is_none() {
            let soon = now + self.samples(self.settings.operation.reacquisition_interval_s).max(1);
            self.next_search = self.next_search.min(soon);
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
            warnings: warnings(&self.metadata, &self.settings),
            conditioning: Conditioning {
                geometry_worst: self.worst_condition,
                geometry_limit: LARGEST_CONDITION,
                loops: self.loops.to_vec(),
            },
        }
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
