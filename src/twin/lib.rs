//! Generator and receiver in one loop, with samples passed in memory.
//!
//! [`run`] composes one generator and one receiver; [`feed`] gives the samples of a generator to anything
//! that takes them, such as several receivers. While a batch of samples is received, the next one is
//! generated: two batches are in memory at a time. Results go to sinks on both sides: files
//! ([`truth::Writer`], [`Output`](receiver::output::Output)), a `Vec` of records, or for the truth
//! `()`. They do not depend on the number of threads.
//!
//! The receiver gets metadata and samples alone; the truth never passes through it.
//!
//! ```
//! use generator::scenario::Scenario;
//! use receiver::output::Record;
//! use receiver::settings::Settings;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scenario = r#"
//!     name = "second"
//!     start = 2010-07-01T08:06:00
//!     duration_s = 0.3
//!     motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
//!     noise = {}
//! "#;
//! let scene = Scenario::from_toml(scenario)?.scene()?;
//! let mut found: Vec<Record> = Vec::new();
//! let done = twin::run(std::slice::from_ref(&scene), &Settings::default(), &mut (), &mut found)?;
//! let acquired = |record: &&Record| matches!(record, Record::Acquisition(row) if row.acquired);
//! assert_eq!(found.iter().filter(acquired).count(), done.outcome.acquired.len());
//! assert_eq!(done.outcome.acquired, done.generated[0].satellites);
//! # Ok(())
//! # }
//! ```
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

#![cfg(all(feature = "generator", feature = "receiver"))]

pub mod correlations;
pub mod observations;
mod refusal;

use std::time::{Duration, Instant};

use thiserror::Error;

use generator::scene::{Grade, Scene};
use generator::stream::{Fronts, GenerateError, Generated, Options, Stream};
use generator::truth;
use gnss::samples::IfMetadata;
use gnss::signal::Signal;
use receiver::output;
use receiver::settings::Settings;
use receiver::{Outcome, ReceiveError, Reception};
pub use refusal::Refused;

/// Error that ends a run of the twin early.
#[derive(Debug, Error)]
pub enum TwinError {
    /// The scene cannot be generated, or its truth is not taken.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// The scene has an effect of which a level without samples has no model.
    #[error(transparent)]
    Refused(#[from] Refused),
    /// The samples cannot be received, or the records are not taken.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
}

/// Results of a run of the twin.
#[derive(Clone, Debug)]
pub struct Done {
    /// Results of the generator, for each front end.
    pub generated: Vec<Generated>,
    /// Outcome of the receiver.
    pub outcome: Outcome,
}

/// Generates a scene and receives its samples with `settings`, from the first to the last. `scenes` are its
/// front ends, one or several ([`settings_for`]); a reference to one [`Scene`] is made such a slice by
/// [`std::slice::from_ref`]. Scenes with a budget make samples, unless [`settle`] has found that they need
/// none.
///
/// # Errors
/// The first error of either side; what the sinks took before stays.
pub fn run(
    scenes: &[Scene],
    settings: &Settings,
    truth: &mut (dyn truth::Sink + Send),
    records: &mut (dyn output::Sink + Send),
) -> Result<Done, TwinError> {
    if let Some(done) = modelled(scenes, settings, (truth, records), &mut |_| ())? {
        return Ok(done);
    }
    let metadata: Vec<IfMetadata> = scenes.iter().map(|scene| scene.metadata.clone()).collect();
    let mut reception = Reception::of_several(&metadata, &settings_for(scenes, settings))?;
    let fed =
        feed(scenes, truth, &mut |number, samples| Ok::<_, TwinError>(reception.take_of(number, samples, records)?))?;
    Ok(Done { generated: fed.generated, outcome: reception.finish(records)? })
}

/// Receives a scene at a level without samples; `None` where samples are made. `progress` gets the number of
/// samples of the first front end that have been passed.
///
/// # Errors
/// Errors of [`run`].
pub fn modelled(
    scenes: &[Scene],
    settings: &Settings,
    sinks: (&mut (dyn truth::Sink + Send), &mut (dyn output::Sink + Send)),
    progress: &mut dyn FnMut(u64),
) -> Result<Option<Done>, TwinError> {
    match unsampled(scenes) {
        Some(Grade::Correlations) => correlations::run(scenes, settings, (sinks.0, sinks.1), progress).map(Some),
        Some(_) => observations::run(scenes, settings, sinks, progress).map(Some),
        None => Ok(None),
    }
}

/// Refuses the first effect of front ends that their level has no model of. Samples have all.
///
/// # Errors
/// [`Refused`] with the name of the effect.
pub fn refuse(scenes: &[Scene]) -> Result<(), Refused> {
    match unsampled(scenes) {
        Some(Grade::Correlations) => correlations::refuse(scenes),
        Some(_) => observations::refuse(scenes),
        None => Ok(()),
    }
}

/// Level without samples at which scenes are received; `None` where samples are made.
fn unsampled(scenes: &[Scene]) -> Option<Grade> {
    let is_any = |grade: &Grade| scenes.iter().any(|scene| scene.fidelity.grade == *grade);
    [Grade::Correlations, Grade::Observations].into_iter().find(is_any)
}

/// Sink that refuses a record, and thereby ends a run, once `halt` says so.
pub struct Halting<'a> {
    /// Sink of the records until then.
    pub records: &'a mut (dyn output::Sink + Send),
    /// True if the run is to end.
    pub halt: &'a (dyn Fn() -> bool + Sync),
}

impl output::Sink for Halting<'_> {
    fn take(&mut self, record: output::Record) -> Result<(), output::OutputError> {
        if (self.halt)() { Err(output::OutputError::Refused("stopped".into())) } else { self.records.take(record) }
    }

    fn finish(&mut self, summary: &serde_json::Value) -> Result<(), output::OutputError> {
        self.records.finish(summary)
    }
}

/// Takes the level of correlations for front ends with a budget, if it keeps that; true if it does.
///
/// # Errors
/// Errors of orbits.
pub fn settle(scenes: &mut [Scene]) -> Result<bool, TwinError> {
    let has_budget = scenes.iter().any(|scene| matches!(scene.fidelity.grade, Grade::Budget(_)));
    let is_kept = has_budget && correlations::broken(scenes)?.is_none();
    if is_kept {
        scenes.iter_mut().for_each(|scene| scene.fidelity = correlations::knobs(scene));
    }
    Ok(is_kept)
}

/// The settings with which a scene is received: where they name no signals to search for, those of the scene,
/// and where they ask for authentication without a key, those that the scene publishes.
pub fn settings_for(scenes: &[Scene], settings: &Settings) -> Settings {
    let signals: Vec<&'static Signal> = scenes.iter().flat_map(|scene| scene.signals.iter().copied()).collect();
    let mut own = settings.clone();
    own.acquisition.or_signals(&signals);
    let published = || {
        let scene = scenes.iter().find(|scene| scene.osnma.is_some())?;
        scene.osnma.as_ref()?.anchor(scene.clock.start)
    };
    if let Some(osnma) = &mut own.osnma
        && let Some(keys) = published()
    {
        osnma.or_keys(&keys.root, &keys.key, &keys.kroot);
    }
    own
}

/// Takes a batch of samples of a front end by its index.
pub type Listen<'a, E> = dyn FnMut(usize, &[u8]) -> Result<(), E> + Send + 'a;

/// Results of [`feed`].
#[derive(Clone, Debug)]
pub struct Fed {
    /// Results of the generator, for each front end.
    pub generated: Vec<Generated>,
    /// Wall-clock time for which the generator was at work.
    pub busy: Duration,
}

/// Generates a scene and gives its samples to `listen`, batch by batch in their order, for each front end by
/// its index; the first call comes with none, while the first batch is generated. Whichever side is done
/// first helps the other's threads.
///
/// # Errors
/// The generator's, and what `listen` returns: the loop ends with it.
pub fn feed<E: From<GenerateError> + Send>(
    scenes: &[Scene],
    truth: &mut (dyn truth::Sink + Send),
    listen: &mut Listen<'_, E>,
) -> Result<Fed, E> {
    // Inside the pool, so that no batch has to wake its threads.
    rayon::scope(|_| {
        let mut maker = Maker::new(scenes, truth)?;
        let (mut made, mut taken) = (vec![Vec::new(); scenes.len()], vec![Vec::new(); scenes.len()]);
        let (mut busy, mut more) = (Duration::ZERO, true);
        while more {
            let (generated, listened) = rayon::join(
                || {
                    let start = Instant::now();
                    let more = maker.next(truth, &mut made);
                    busy += start.elapsed();
                    more
                },
                || taken.iter().enumerate().try_for_each(|(number, samples)| listen(number, samples)),
            );
            listened?;
            more = generated?;
            std::mem::swap(&mut made, &mut taken);
        }
        Ok(Fed { generated: maker.finish(truth)?, busy })
    })
}

/// The samples of a scene on their way out: of its one front end, or of several in step.
enum Maker<'a> {
    One(Stream<'a>),
    Several(Fronts<'a>),
}

impl<'a> Maker<'a> {
    fn new(scenes: &'a [Scene], truth: &mut dyn truth::Sink) -> Result<Self, GenerateError> {
        match scenes {
            [scene] => Stream::new(scene, truth, &Options::default()).map(Self::One),
            several => Fronts::new(several, truth, &Options::default()).map(Self::Several),
        }
    }

    /// Replaces what `made` holds of each front end by the next batch; `false` after the last sample.
    fn next(&mut self, truth: &mut dyn truth::Sink, made: &mut [Vec<u8>]) -> Result<bool, GenerateError> {
        match self {
            Self::One(stream) => match made.first_mut() {
                Some(made) => stream.next(truth, made),
                None => Ok(false),
            },
            Self::Several(fronts) => {
                made.iter_mut().for_each(Vec::clear);
                let mut sink = |number: usize, bytes: &[u8]| {
                    made.iter_mut().skip(number).take(1).for_each(|made| made.extend_from_slice(bytes));
                    Ok(())
                };
                fronts.next(truth, &mut Vec::new(), &mut sink)
            }
        }
    }

    fn finish(self, truth: &mut dyn truth::Sink) -> Result<Vec<Generated>, GenerateError> {
        match self {
            Self::One(stream) => stream.finish(truth).map(|generated| vec![generated]),
            Self::Several(fronts) => fronts.finish(truth),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use generator::Generator;
    use generator::scenario::Scenario;
    use gnss::samples::Format;
    use receiver::Receiver;

    fn scene(duration_s: f64) -> Scene {
        let text = format!(
            "name = \"loop\"\nstart = 2010-07-01T08:06:00\nduration_s = {duration_s}\nnoise = {{}}\n\
             motion = {{ kind = \"static\", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }}\n"
        );
        Scenario::from_toml(&text).unwrap().scene().unwrap()
    }

    /// The loop in steps of one's own: the generator's iterator, and the receiver's records as values.
    #[test]
    fn a_run_gives_what_generator_and_receiver_give_one_after_the_other() {
        let scene = scene(0.5);
        let settings = Settings::default();
        let (mut truth, mut records) = (Vec::new(), Vec::new());
        let done = run(std::slice::from_ref(&scene), &settings, &mut truth, &mut records).unwrap();

        let own = settings_for(std::slice::from_ref(&scene), &settings);
        let mut receiver = Receiver::new(&scene.metadata, &own).unwrap();
        let (mut own_truth, mut own_records, mut bytes) = (Vec::new(), Vec::new(), 0);
        let mut generator = Generator::new(&scene).unwrap();
        for batch in &mut generator {
            let batch = batch.unwrap();
            assert_eq!(batch.first_sample as usize * Format::Ci8.bytes(), bytes);
            bytes += batch.samples.len();
            own_records.extend(receiver.push(&batch.samples).unwrap());
            own_truth.extend(batch.truth);
        }
        let (rest, outcome) = receiver.finish().unwrap();
        own_records.extend(rest);
        assert_eq!(bytes as u64, scene.samples * Format::Ci8.bytes() as u64);
        assert_eq!(generator.done(), done.generated.first());
        assert_eq!(outcome.acquired, done.outcome.acquired);
        assert_eq!(format!("{own_truth:?}"), format!("{truth:?}"));
        assert_eq!(format!("{own_records:?}"), format!("{records:?}"));
        assert!(truth.len() > 100 && records.len() > 32, "{} and {}", truth.len(), records.len());
    }

    #[test]
    fn an_error_of_who_listens_ends_the_loop() {
        let scene = scene(2.0);
        let mut calls = 0;
        let stopped = feed(std::slice::from_ref(&scene), &mut (), &mut |_, _| {
            calls += 1;
            if calls < 3 { Ok(()) } else { Err(GenerateError::NoFrontEnd) }
        });
        assert!(matches!(stopped, Err(GenerateError::NoFrontEnd)), "{stopped:?}");
        assert_eq!(calls, 3);
    }
}
