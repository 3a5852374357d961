//! One front end at work: what is searched for and followed in its samples.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::predict::{Missed, Near};
use super::shared::Shared;
use super::step::{Counted, Step, Tick};
use super::{gap, plan, suited};
use crate::acquire::{self, AcquireError, Acquired, Searcher};
use crate::correlate::correlator::{Shown, Span};
use crate::correlate::fixed::FixedSamples;
use crate::correlate::sums::{RunningSums, Samples};
use crate::decode::Decoder;
use crate::followed;
use crate::interference::{Followed, Watch};
use crate::lead::{lead, other_side};
use crate::looks::Looks;
use crate::outcome::{Interfered, ReceiveError};
use crate::output::{Record, Sink};
use crate::parting::{Estimate, Line, Offset};
use crate::position::CodeNoise;
use crate::settings::Settings;
use crate::source::{Gathered, Lookback, Packed, Planes, Stretch};
use crate::track::loops::CodeShape;
use crate::track::{Channel, ReplicaModel, Report};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{EventRow, LineRow};
use gnss::samples::IfMetadata;
use gnss::signal::{Link, Signal};

/// Least length of the parts of a block that channels process one after the other, in samples. It is 512 KiB
/// in planar `f32` with running sums, a core's own cache.
const PART_SAMPLES: usize = 1 << 15;
/// Least length of those parts in periods of the longest code. The code period at a part's end is unpacked
/// again.
const PART_PERIODS: f64 = 4.0;

/// Forms of the samples that the channels of a front end need.
#[derive(Clone, Copy)]
struct Wanted {
    sums: bool,
    fixed: bool,
    planes: bool,
}

/// Samples of a part of a block, unpacked and summed up.
#[derive(Default)]
struct Room {
    planes: Planes,
    sums: RunningSums,
    fixed: FixedSamples,
}

/// One channel and its decoder.
pub(super) struct Track {
    pub channel: Channel,
    pub line: Line,
    pub watched: gap::Watched,
    pub decoder: Option<Decoder>,
    pub report: Report,
    pub since: u64,
    pub cn0_dbhz: f64,
    /// C/N0 that the search estimated, in dB-Hz.
    pub found_dbhz: f64,
    /// Doppler that the search estimated, in hertz.
    pub found_hz: f64,
    pub symbols: u64,
    pub wrong_time: u32,
    pub dropped: bool,
}

impl Track {
    /// Description of the channel's code for the spectrum's own-code model.
    fn followed(&self) -> Followed {
        let phases = self.channel.phases();
        Followed {
            link: self.channel.link(),
            cn0_hz: libm::pow(10.0, self.cn0_dbhz / 10.0),
            doppler_hz: self.channel.doppler_hz(),
            sample: phases.sample,
            chips: phases.chips,
        }
    }
}

/// Samples collected for a search.
pub(super) struct Window {
    pub samples: Gathered,
    /// Satellites that are searched for; all where there is none.
    pub near: Option<Near>,
}

/// The state of one front end between blocks. Samples are its own.
pub(super) struct FrontEnd {
    pub step: Step,
    pub metadata: IfMetadata,
    /// Settings with the front end's own signals.
    pub settings: Settings,
    /// The signals that are received here; none where other front ends receive all.
    pub signals: Vec<&'static Signal>,
    pub candidates: Vec<Link>,
    pub searcher: Searcher,
    /// Dopplers that the search covers, and true if they are those after the first search.
    pub aimed: Option<(plan::Sweep, bool)>,
    pub widenings: usize,
    /// Centre of the expected Dopplers in hertz while the clock is unknown.
    pub sky_hz: f64,
    pub looks: Looks,
    pub mirrored: Option<Estimate>,
    /// Median Doppler of the search that found most, with how many it found.
    pub found: (usize, f64),
    pub needed: u64,
    pub searched: bool,
    pub next_search: u64,
    /// Sample of the next search for predicted satellites.
    pub next_foreseen: u64,
    pub window: Option<Window>,
    pub tracks: Vec<Track>,
    /// Work buffers, one for each share of the tracks.
    rooms: Vec<Room>,
    /// Samples of code periods that the last block's end has cut.
    lookback: Lookback,
    pub lost: BTreeMap<Link, u64>,
    pub refused: BTreeMap<Link, u64>,
    /// Hits that were taken for another satellite's signal: at its delay and Doppler, and weaker.
    pub doubles: BTreeMap<Link, Link>,
    /// The first samples, for the search at the end of a short recording.
    pub opening: Option<Gathered>,
    /// Hits of searches in the first samples.
    pub opened: Vec<Acquired>,
    pub missed: BTreeMap<Link, Missed>,
    pub offset: Offset,
    /// Channels that measure it.
    pub lines: usize,
    /// Code loops are on their way to a new offset until this sample.
    pub offset_moved: u64,
    pub gap: gap::Gap,
    /// Samples of the running block at which channels report.
    pub ticks: Vec<Tick>,
    watch: Watch,
    /// Median C/N0 of the satellites when the spectrum last had no line.
    quiet_dbhz: Option<f64>,
    pub interfered: Option<Interfered>,
}

impl FrontEnd {
    /// State before the first sample. `settings` name the signals of this front end, which are `signals` as
    /// far as its samples hold them.
    pub fn new(
        step: Step,
        metadata: &IfMetadata,
        settings: Settings,
        signals: Vec<&'static Signal>,
    ) -> Result<Self, AcquireError> {
        Ok(Self {
            step,
            metadata: metadata.clone(),
            candidates: if signals.is_empty() {
                Vec::new()
            } else {
                suited::candidates(metadata, &settings.acquisition)
            },
            searcher: Searcher::new(metadata, &settings.acquisition)?,
            aimed: None,
            widenings: 0,
            sky_hz: 0.0,
            looks: Looks::default(),
            mirrored: None,
            found: (0, 0.0),
            needed: acquire::samples_needed(metadata, &settings.acquisition)?,
            searched: false,
            next_search: 0,
            next_foreseen: 0,
            window: None,
            tracks: Vec::new(),
            rooms: Vec::new(),
            lookback: Lookback::default(),
            lost: BTreeMap::new(),
            refused: BTreeMap::new(),
            doubles: BTreeMap::new(),
            opening: None,
            opened: Vec::new(),
            missed: BTreeMap::new(),
            offset: Offset::default(),
            lines: 0,
            offset_moved: 0,
            gap: gap::Gap::default(),
            ticks: Vec::new(),
            watch: Watch::new(metadata),
            quiet_dbhz: None,
            interfered: None,
            settings,
            signals,
        })
    }

    /// The first signal, by whose band offsets are reported.
    pub fn signal(&self) -> Option<&'static Signal> {
        self.signals.first().copied()
    }

    /// Samples in so many seconds.
    pub fn samples(&self, seconds: f64) -> u64 {
        (seconds * self.metadata.rate.hz()) as u64
    }

    /// Takes the next block as far as every front end goes by itself: search, channels, lost samples.
    pub fn process(&mut self, block: &Stretch, shared: &mut Shared, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let ticks = std::mem::take(&mut self.ticks);
        let sink = &mut Counted { sink, step: self.step, ticks: &ticks };
        self.search(block, shared, sink)?;
        self.advance(block, &ticks);
        self.record(sink)?;
        self.leap(block, shared, sink)?;
        if !self.gap.is_busy() {
            self.part(block.end(), shared);
        }
        self.announce(shared);
        self.ticks = ticks;
        Ok(())
    }

    /// Takes every channel through the block, on every core its share of them.
    ///
    /// Each share unpacks the samples for itself, in parts that stay in its core's cache: to read what
    /// another core has written takes longer than to unpack it again.
    fn advance(&mut self, block: &Stretch, ticks: &[Tick]) {
        let ticks: Vec<u64> = ticks.iter().map(|tick| tick.own).collect();
        let block = match block {
            Stretch::Packed(block) => block,
            Stretch::Modelled(span) => return self.advance_by(span, &ticks),
            Stretch::Planes(_) => return,
        };
        let share = self.tracks.len().div_ceil(rayon::current_num_threads()).max(1);
        self.rooms.resize_with(self.tracks.len().div_ceil(share), Room::default);
        let longest_s = self.tracks.iter().map(|track| track.channel.period_s()).fold(0.0, f64::max);
        let part = PART_SAMPLES.max(self.samples(PART_PERIODS * longest_s) as usize);
        let stream = (&self.lookback, block);
        // For all or none: results must not depend on who shares a core with whom.
        let wanted = self.wanted();
        self.tracks.par_chunks_mut(share).zip(&mut self.rooms).for_each(|(tracks, room)| {
            tracks.iter_mut().for_each(|track| clear(&mut track.report));
            for start in (0..block.samples()).step_by(part) {
                let (from, to) = (block.first + start as u64, block.end().min(block.first + (start + part) as u64));
                follow(tracks, stream, (room, wanted), (from, to), within(&ticks, from, to));
            }
        });
        let needed = self.tracks.iter().filter_map(|track| track.channel.needs()).min();
        self.lookback.keep(block, needed.unwrap_or(block.end()));
    }

    /// Takes every channel through an interval in which a model answers.
    fn advance_by(&mut self, span: &Span, ticks: &[u64]) {
        self.tracks.par_iter_mut().for_each(|track| {
            clear(&mut track.report);
            track.channel.follow(span, ticks, &mut track.report);
        });
    }

    /// First sample about which a model can still be asked: of a running code period, or of what is collected
    /// for a search. `None` where there is neither.
    pub fn needs(&self) -> Option<u64> {
        let window = self.window.as_ref().map(|window| window.samples.first());
        self.tracks.iter().filter_map(|track| track.channel.needs()).chain(window).min()
    }

    /// Forms of the samples that the channels need.
    fn wanted(&self) -> Wanted {
        let channels = || self.tracks.iter().map(|track| &track.channel);
        let sums = channels().any(Channel::takes_sums);
        let fixed = channels().all(|channel| channel.takes_sums() || channel.takes_fixed());
        let also_fixed = channels().any(Channel::takes_fixed);
        Wanted { sums, fixed: fixed || also_fixed, planes: !fixed }
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

    /// Actions after a block has been measured: the spectrum, the channels that end, the next search.
    pub fn close(&mut self, block: &Stretch, shared: &mut Shared, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let sink = &mut Counted { sink, step: self.step, ticks: &[] };
        if let Some(block) = block.packed() {
            self.watch(Some(block), sink)?;
        }
        self.retire(block.end(), shared, sink)?;
        self.hasten(block.end(), shared);
        Ok(())
    }

    /// Looks for continuous waves in a block, or at the end in what there is of less than a second, and
    /// reports those that are none of the satellites' own lines.
    pub fn watch(&mut self, block: Option<&Packed>, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let mut followed: Vec<f64> = self.tracks.iter().map(|track| track.cn0_dbhz).collect();
        followed.sort_by(f64::total_cmp);
        // A channel's first estimates may be low; the search's is not.
        let found = self.tracks.iter().map(|track| track.found_dbhz);
        let strongest_hz = found
            .chain(followed.last().copied())
            .max_by(f64::total_cmp)
            .map_or(0.0, |dbhz| libm::pow(10.0, dbhz / 10.0));
        let known: Vec<Followed> = self.tracks.iter().map(Track::followed).collect();
        let mut reported = Vec::new();
        let mut report = |_, row| reported.push(row);
        match block {
            Some(block) => self.watch.take(block, (strongest_hz, &known), &mut report),
            None => self.watch.rest((strongest_hz, &known), &mut report),
        }
        for row in reported {
            let Some(row) = row else {
                self.quiet_dbhz = followed.get(followed.len() / 2).copied().or(self.quiet_dbhz);
                continue;
            };
            let row = LineRow { js_db: self.quiet_dbhz.map(|dbhz| row.jn0_dbhz - dbhz), ..row };
            sink.take(Record::Interference { front_end: self.step.number, row: row.clone() })?;
            let seen = self.interfered.get_or_insert_with(|| Interfered { spectra: 0, strongest: row.clone() });
            seen.spectra += 1;
            if row.jn0_dbhz > seen.strongest.jn0_dbhz {
                seen.strongest = row;
            }
        }
        Ok(())
    }
}

/// Takes channels through the samples `from` to `to` of a stream, which begins with those that they need
/// again.
fn follow(
    tracks: &mut [Track],
    (lookback, block): (&Lookback, &Packed),
    (room, wanted): (&mut Room, Wanted),
    (from, to): (u64, u64),
    ticks: &[u64],
) {
    let needed = tracks.iter().filter_map(|track| track.channel.needs()).min();
    let first = needed.unwrap_or(from).clamp(lookback.first(block), from);
    let fixed = wanted.fixed.then(|| lookback.fixed(block, (first, to), &mut room.fixed));
    let (mut i, mut q): (&[f32], &[f32]) = (&[], &[]);
    if wanted.planes {
        let samples = lookback.unpack(block, (first, to), &mut room.planes);
        (i, q) = (samples.i, samples.q);
    }
    let sums = match fixed.filter(|_| wanted.sums) {
        Some(fixed) => room.sums.of_fixed(fixed),
        None if wanted.sums => room.sums.of(i, q),
        None => None,
    };
    let shown = Shown { first, samples: Samples { i, q, sums, fixed }, from };
    for track in tracks.iter_mut() {
        track.channel.follow(&shown, ticks, &mut track.report);
    }
}

/// Noise of the code loops that follow a signal.
pub(super) fn noise(signal: &'static Signal, metadata: &IfMetadata, settings: &Settings) -> CodeNoise {
    let component = lead(signal);
    let tracking = component.map_or(settings.tracking.clone(), |component| settings.tracking.fitted(component));
    let (chip_rate_hz, period_s) = component.map_or((1.0, 1.0), |c| (c.chip_rate_hz, c.period_s()));
    let both = component.and_then(|component| other_side(component, signal));
    let model = component.and_then(|component| {
        let made = if both.is_some() { ReplicaModel::of_both_sides } else { ReplicaModel::new };
        made(&tracking, component, metadata.rate.hz())
    });
    let power_share: f64 = component.into_iter().chain(both).map(|one| one.power_share).sum();
    CodeNoise {
        chip_m: SPEED_OF_LIGHT_MPS / chip_rate_hz,
        share: power_share * model.as_ref().map_or(1.0, |model| model.efficiency),
        shape: model.map_or(CodeShape::triangle(tracking.spacing_chips), |model| model.shape),
        discriminator: tracking.dll_discriminator,
        bandwidth_hz: tracking.dll_bandwidth_hz,
        integration_s: followed::Followed::of(signal, settings)
            .map_or(period_s * f64::from(tracking.integration), |followed| followed.integration_s),
    }
}

/// Empties a report and keeps its room.
fn clear(report: &mut Report) {
    report.measurements.clear();
    report.symbols.clear();
    report.rows.clear();
    report.events.clear();
}

/// Ticks of the ascending `ticks` that lie in `first..end`.
fn within(ticks: &[u64], first: u64, end: u64) -> &[u64] {
    let of = |sample: u64| ticks.partition_point(|tick| *tick < sample);
    ticks.get(of(first)..of(end)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::CodeDiscriminator;
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::gps::l5::L5;
    use gnss::samples::Format;
    use gnss::time::Rate;

    fn of(signal: &'static Signal) -> CodeNoise {
        with(signal, CodeDiscriminator::EarlyMinusLate)
    }

    fn with(signal: &'static Signal, discriminator: CodeDiscriminator) -> CodeNoise {
        let (rate, center_hz) = (Rate::from_hz(25e6).unwrap(), signal.centre_hz());
        let metadata = IfMetadata { format: Format::Ci8, rate, center_hz, inverted: false, start: None };
        let mut settings = Settings::default();
        settings.tracking.dll_discriminator = discriminator;
        noise(signal, &metadata, &settings)
    }

    /// Shares of the pilots: half of L5's power (IS-GPS-705, 3.3.1.6), half of E1's (OS SIS ICD 2.1, 2.3.3)
    /// less the eleventh that BOC(6,1) has and a replica of BOC(1,1) has not.
    #[test]
    fn a_code_is_as_noisy_as_what_its_loop_follows_of_the_signal() {
        for (signal, share, within) in [(&L1_CA, 1.0, 0.01), (&L5, 0.5, 0.01), (&E1, 5.0 / 11.0, 0.05)] {
            let own = of(signal);
            assert!((own.share - share).abs() < within, "{}: {}", signal.name, own.share);
            let whole = CodeNoise { share: 1.0, ..own };
            let (found_m, expected_m) = (own.sigma_m(1e4), whole.sigma_m(1e4 * own.share));
            assert!((found_m / expected_m - 1.0).abs() < 1e-12, "{}", signal.name);
        }
    }

    /// Squaring adds 2/((2−d)·T·C/N0) on a triangle where early and late are squared, and 1/(T·C/N0) where
    /// they are multiplied by the prompt (Kaplan and Hegarty 2nd ed., eq. 5.23).
    #[test]
    fn a_code_is_as_noisy_as_its_loop_s_own_discriminator_makes_it() {
        let (shape, d, cn0_hz) = (CodeShape::triangle(0.5), 0.5, 1e3);
        let both = [CodeDiscriminator::EarlyMinusLate, CodeDiscriminator::DotProduct];
        let [early, dot] = both.map(|discriminator| CodeNoise { shape, ..with(&L1_CA, discriminator) });
        let snr = dot.integration_s * dot.share * cn0_hz;
        let found = (dot.sigma_m(cn0_hz) / early.sigma_m(cn0_hz)).powi(2);
        let expected = (1.0 + 1.0 / snr) / (1.0 + 2.0 / ((2.0 - d) * snr));
        assert!((found / expected - 1.0).abs() < 1e-12 && expected < 0.95, "{found}, {expected}");
    }

    /// Squaring in the discriminator adds as much noise as the integration is short: ranges of different
    /// symbols weigh differently.
    #[test]
    fn a_code_is_as_noisy_as_its_loop_s_own_integration_makes_it() {
        for (name, integration_s) in [("GPS L1 C/A", 0.004), ("GLONASS G1", 0.002), ("BeiDou B2b", 0.001)] {
            let own = of(Signal::find(name).unwrap());
            assert!((own.integration_s - integration_s).abs() < 1e-12, "{name}: {}", own.integration_s);
            let four = CodeNoise { integration_s: 0.004, ..own };
            // Below 30 dB-Hz a sum of 1 ms has less signal than noise.
            let ratio = own.sigma_m(1e3) / four.sigma_m(1e3);
            assert!(if integration_s < 0.004 { ratio > 1.05 } else { ratio == 1.0 }, "{name}: {ratio}");
        }
    }
}
