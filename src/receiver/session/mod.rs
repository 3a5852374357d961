//! The state of a reception between blocks: front ends at work, what their channels decoded, clock and
//! solver.
//!
//! Every [`FrontEnd`] searches and follows in its own samples: [`search`] starts and ends channels,
//! [`plan`] aims, [`part`] measures how code and carrier part, [`gap`] watches for lost samples,
//! [`detect`] tests for jamming and spoofing, [`compare`] looks at an array's elements. What they find is
//! [`Shared`]: [`decode`] takes in messages, [`measure`] observes and solves with the signals of all.
//! Records count samples of the first front end ([`step`]).

use crate::array::compass::Compass;
use crate::authentic::Authentic;
use crate::correlate::layers_refusal;
use crate::detect::Detection;
use crate::diagnosis::Stage;
use crate::lead::{lead, refusal};
use crate::outcome::{Outcome, ReceiveError};
use crate::output::Sink;
use crate::position::Noises;
use crate::settings::{Settings, SettingsError};
use crate::source::Stretch;
use crate::track::LoopMargin;
use front_end::{FrontEnd, Track, Window};
use gnss::samples::IfMetadata;
use gnss::signal::Signal;
use gnss::time::Epoch;
pub use navigation::Given;
pub(super) use navigation::Navigation;
use shared::Shared;
use step::{Step, Tick};
pub(super) use suited::held;

mod compare;
mod decode;
mod detect;
mod front_end;
mod gap;
mod hear;
mod measure;
mod navigation;
mod part;
mod plan;
mod predict;
mod search;
mod shared;
mod step;
mod suited;

/// Number of consecutive fixes that have to show a channel's wrong time.
const WRONG_TIME_FIXES: u32 = 10;

/// Signals that each front end receives, and the noise of their code loops.
fn assign(metadata: &[IfMetadata], settings: &Settings) -> Result<(Vec<Vec<&'static Signal>>, Noises), ReceiveError> {
    week_reference(settings)?;
    if metadata.is_empty() {
        return Err(ReceiveError::NoFrontEnd);
    }
    let assigned = suited::assigned(metadata, &settings.acquisition.signals());
    let all = assigned.iter().flatten();
    if let Some((signal, reason)) = all.filter_map(|signal| Some((signal, refusal(signal)?))).next() {
        return Err(ReceiveError::Unsupported { signal: signal.name, reason });
    }
    let mut noises = Noises::new();
    for (metadata, signals) in metadata.iter().zip(&assigned) {
        for signal in signals {
            if let Some(reason) = layers_refusal(settings.tracking.waveform, signal, metadata.rate.hz()) {
                return Err(ReceiveError::Unsupported { signal: signal.name, reason });
            }
            noises.push((*signal, front_end::noise(signal, metadata, settings)));
        }
    }
    Ok((assigned, noises))
}

/// GPS time near which the settings resolve weeks.
fn week_reference(settings: &Settings) -> Result<Epoch, ReceiveError> {
    let stated = settings.week_reference();
    let error = |source| SettingsError::Week { origin: "settings".to_owned(), above: String::new(), source };
    Ok(stated.map_err(error)?)
}

/// State of what front ends share, and the margins of their loops.
fn share(
    metadata: &[IfMetadata],
    settings: &Settings,
    noises: Noises,
) -> Result<(Shared, [LoopMargin; 5]), ReceiveError> {
    let Some(first) = metadata.first() else { return Err(ReceiveError::NoFrontEnd) };
    let start = metadata.iter().find_map(|metadata| metadata.start);
    let authentic = match &settings.osnma {
        Some(osnma) => Some(Authentic::new(osnma, &settings.acquisition.signals(), start, first.rate)?),
        None => None,
    };
    let detection = Detection::new(settings, noises.clone(), first.rate, metadata.len());
    let loops = settings.tracking.least_margins(noises.iter().filter_map(|(signal, _)| lead(signal)));
    let times = (start, week_reference(settings)?);
    Ok((Shared::new(settings, noises, first.rate, times, (authentic, detection)), loops))
}

/// A reception of one or several front ends that share a clock.
pub(super) struct Session {
    front_ends: Vec<FrontEnd>,
    shared: Shared,
    /// Comparison of an array's elements.
    compass: Option<Compass>,
    next_tick: u64,
    loops: [LoopMargin; 5],
}

impl Session {
    /// A cold start. Every signal is received in the first front end whose band holds its main lobes, or else
    /// its carrier.
    pub fn new(metadata: &[IfMetadata], settings: &Settings) -> Result<Self, ReceiveError> {
        let (assigned, noises) = assign(metadata, settings)?;
        let Some(first) = metadata.first() else { return Err(ReceiveError::NoFrontEnd) };
        let mut front_ends: Vec<FrontEnd> = Vec::new();
        for (number, (metadata, signals)) in metadata.iter().zip(&assigned).enumerate() {
            let mut own = settings.clone();
            if assigned.len() > 1 && !signals.is_empty() {
                own.acquisition.signals = signals.iter().map(|signal| signal.name.to_owned()).collect();
            }
            let step = Step::new(number, metadata.rate, first.rate);
            front_ends.push(FrontEnd::new(step, metadata, own, signals.clone())?);
        }
        let (shared, loops) = share(metadata, settings, noises)?;
        let array = settings.array.as_ref();
        let compass = array.and_then(|array| Compass::new(array, first.rate, first.inverted));
        Ok(Self { front_ends, shared, compass, next_tick: 0, loops })
    }

    /// Ends of a block in the samples of every front end, for a block that ends at `main` in those of the
    /// first.
    pub fn ends(&self, main: u64) -> Vec<u64> {
        self.front_ends.iter().map(|front_end| front_end.step.own(main)).collect()
    }

    /// First sample of each front end about which a model can still be asked, where samples before number
    /// `main` of the first front end were taken.
    pub fn needs(&self, main: u64) -> Vec<u64> {
        let needed = |front_end: &FrontEnd| {
            let next = front_end.step.own(main);
            front_end.needs().map_or(next, |needed| needed.min(next))
        };
        self.front_ends.iter().map(needed).collect()
    }

    /// Ends the verification of authentication: tags that still wait for their keys are given as they are.
    pub fn end_verification(&mut self, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        Ok(self.shared.authentic.as_mut().map_or(Ok(()), |authentic| authentic.finish(sink))?)
    }

    /// Takes the next blocks, one a front end over the same time, through the whole chain.
    pub fn process(&mut self, blocks: &[Stretch], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let Some(first) = blocks.first() else { return Ok(()) };
        let measured = self.plan_ticks(first, blocks);
        for (front_end, block) in self.front_ends.iter_mut().zip(blocks) {
            front_end.process(block, &mut self.shared, sink)?;
        }
        self.keep_step();
        for tick in measured {
            self.decode(Some(tick), sink)?;
            // Nothing is right while codes are not where they were to be.
            if !self.front_ends.iter().any(|front_end| front_end.gap.is_busy()) {
                self.measure(tick, sink)?;
            }
        }
        self.decode(None, sink)?;
        self.detect(blocks, sink)?;
        for (front_end, block) in self.front_ends.iter_mut().zip(blocks) {
            front_end.close(block, &mut self.shared, sink)?;
        }
        Ok(())
    }

    /// Lets all front ends know what the first has lost.
    fn keep_step(&mut self) {
        let behind = self.front_ends.first().map_or(0, |first| first.step.behind());
        self.front_ends.iter_mut().for_each(|front_end| front_end.step.follow(behind));
    }

    /// Sets the samples of these blocks at which channels report, and gives those of the first front end at
    /// which the receiver measures.
    fn plan_ticks(&mut self, first: &Stretch, blocks: &[Stretch]) -> Vec<u64> {
        let operation = &self.shared.settings.operation;
        let step_ms = u64::from(operation.tracking_interval_ms);
        let each = u64::from(operation.measurement_interval_ms / operation.tracking_interval_ms).max(1);
        let rate = self.front_ends.first().map(|front_end| front_end.metadata.rate);
        let (mut ticks, mut measured): (Vec<u64>, Vec<u64>) = (Vec::new(), Vec::new());
        while let Some(rate) = rate {
            let sample = rate.first_sample_at(self.next_tick * step_ms, 1000);
            if sample >= first.end() {
                break;
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
        for (front_end, block) in self.front_ends.iter_mut().zip(blocks) {
            let Some(last) = block.end().checked_sub(1).filter(|last| *last >= block.first()) else {
                front_end.ticks.clear();
                continue;
            };
            // A front end that is in step has its tick within the block but for rounding.
            let own = |main: u64| front_end.step.own(main).clamp(block.first(), last);
            front_end.ticks = ticks.iter().map(|&main| Tick { main, own: own(main) }).collect();
            front_end.ticks.dedup_by_key(|tick| tick.own);
        }
        measured
    }

    /// Outcome of the session; the caller adds its own knowledge of the samples.
    pub fn outcome(&self) -> Outcome {
        let strongest = self.front_ends.iter().filter_map(|front_end| front_end.interfered.clone());
        Outcome {
            interfered: strongest.max_by(|a, b| a.strongest.jn0_dbhz.total_cmp(&b.strongest.jn0_dbhz)),
            parted: self.front_ends.iter().find_map(|front_end| front_end.parted(&self.shared)),
            jumps: self.front_ends.iter().flat_map(|front_end| front_end.gap.jumps.iter().copied()).collect(),
            warnings: self.warnings(),
            ..self.shared.outcome(&self.loops)
        }
    }

    fn warnings(&self) -> Vec<String> {
        let several = self.front_ends.len() > 1;
        let mut warnings = Vec::new();
        for front_end in &self.front_ends {
            if front_end.signals.is_empty() && several {
                warnings.push(format!(
                    "front end {}, {:.3} MHz, receives nothing: another front end holds every signal that its band \
                     does",
                    front_end.step.number + 1,
                    1e-6 * front_end.metadata.center_hz
                ));
                continue;
            }
            warnings.extend(suited::warnings(&front_end.metadata, &front_end.settings));
            warnings.extend(front_end.doubles.iter().map(|(weaker, stronger)| {
                format!(
                    "{weaker} was found at the delay and Doppler of {} and weaker: it is taken for that signal",
                    stronger.sv
                )
            }));
            if several && front_end.gap.unknown.is_some() {
                warnings.push(format!(
                    "front end {} lost samples, and no satellite shows how many: it is left out of fixes since",
                    front_end.step.number + 1
                ));
            }
        }
        warnings.extend(self.shared.warnings());
        warnings
    }

    /// The names of the signals that each front end receives.
    pub fn signals(&self) -> Vec<Vec<&'static str>> {
        let names = |front_end: &FrontEnd| front_end.signals.iter().map(|signal| signal.name).collect();
        self.front_ends.iter().map(names).collect()
    }

    /// Flags that fit these samples better, in words.
    pub fn findings(&self) -> Vec<String> {
        self.front_ends.iter().flat_map(|front_end| front_end.findings(&self.shared)).collect()
    }

    /// The first stage that failed, where there was no fix.
    pub fn failed_stage(&self) -> Stage {
        self.shared.failed_stage()
    }

    /// True if there were enough samples for a search.
    pub fn has_searched(&self) -> bool {
        self.front_ends.iter().any(|front_end| front_end.searched)
    }

    /// Searches recordings of so many samples of the first front end that ended before a second search.
    pub fn search_rest(&mut self, samples: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let each = &mut self.front_ends.iter_mut();
        each.try_for_each(|front_end| front_end.search_rest(front_end.step.own(samples), &mut self.shared, sink))
    }
}
