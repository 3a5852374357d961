//! Cases of whole scenes: one stream of samples from the generator feeds every receiver that takes it, in
//! memory. Where the scene's level makes no samples, the model answers each receiver by itself.
//!
//! Cases that differ in `receiver.…` alone share their signal, so it is generated once. Figures are those of
//! `summary.json` by their path, the first search's detections, those of single fixes ([`super::fixes`]), and
//! what theory predicts of the loops under thermal noise. Limits: truth and records pass through files in a
//! scratch directory, samples never do.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::Value as Json;
use toml::Value;

use super::axis::{self, Axis};
use super::fixes::{self, Fixes};
use super::model::SNR;
use super::spec::{Level, SCENARIO_KEY, Study};
use super::{StudyError, temporary};
use crate::correlator::Case;
use crate::{expect, limits};
use analysis::JudgeError;
use analysis::Summary;
use analysis::expect::spectrum::edge_cost_db;
use analysis::expect::theory::pll;
use analysis::measure::clock::Clock;
use analysis::measure::errors::Errors;
use analysis::read::Run;
use analysis::statistics::mean;
use generator::scenario::{Overrides, Scenario, put};
use generator::scene::{Grade, Scene};
use generator::{GenerateError, truth};
use gnss::signal::Signal;
use receiver::Reception;
use receiver::output::Output;
use receiver::settings::Settings;
use receiver::track::closed::Mode;
use twin::{Halting, TwinError};

/// A scene that a study is based on.
#[derive(Clone, Debug)]
pub struct Base {
    /// Path of the scene in the study's text.
    pub written: PathBuf,
    /// Directory of the scene's files.
    pub directory: PathBuf,
    /// Name of the file without its ending.
    pub name: String,
    /// The scene as written.
    pub document: toml::Table,
    /// Level of each front end.
    pub grades: Vec<Grade>,
}

/// True if a key changes the received signal, and not only its processing in the receiver.
pub fn changes_signal(key: &str) -> bool {
    !key.starts_with("receiver.")
}

/// True if a key changes what satellites, channel and receiver's hardware do, which levels of fidelity do
/// not.
pub fn changes_world(key: &str) -> bool {
    changes_signal(key) && !key.starts_with("fidelity.")
}

/// True if a key names a scene's level of fidelity.
pub fn changes_level(key: &str) -> bool {
    key == "fidelity.level" || key.starts_with("fidelity.budget")
}

/// Figures that a study may keep. `acquisition.…` count the first search alone. `theory.…` predict for
/// thermal noise alone, the mean C/N0 of the run and the closed loop.
pub const FIGURES: &[&str] = &[
    "acquisition.detected_share",
    "acquisition.false",
    "satellites.in_view",
    "satellites.acquired",
    "satellites.used",
    "satellites.false_acquired",
    "position.fixes",
    "position.first_fix_s",
    "position.horizontal_mean_m",
    "position.horizontal_p95_m",
    "position.vertical_p95_m",
    "position.error_3d_p95_m",
    "position.bias_enu_m.0",
    "position.bias_enu_m.1",
    "position.bias_enu_m.2",
    "position.velocity_p95_mps",
    "clock.bias_mean_s",
    "clock.bias_sigma_s",
    "clock.drift",
    "clock.true_drift",
    "clock.oadev_1s",
    "clock.mdev_1s",
    "clock.true_oadev_1s",
    "observables.pseudorange_rms_m",
    "observables.pseudorange_bias_m",
    "observables.carrier_rms_cycles",
    "observables.doppler_rms_hz",
    "observables.cn0_bias_db",
    "tracking.losses_of_lock",
    "tracking.cycle_slips",
    "tracking.dll_sigma_chips",
    "theory.tracking.dll_sigma_chips",
    "tracking.pll_sigma_deg",
    "theory.tracking.pll_sigma_deg",
    SNR,
    "tracking.fll_sigma_hz",
    "navigation.parameters_checked",
    "navigation.parameters_wrong",
    "spoofing.displacement_max_m",
    "spoofing.captured_share",
    "spoofing.from_claim_p95_m",
];

/// The scene's document with the values of a case in it.
///
/// # Errors
/// A key that leads nowhere.
pub fn patched(base: &Base, values: &[(&Axis, &Value)]) -> Result<toml::Table, String> {
    let mut document = base.document.clone();
    for (axis, value) in values.iter().filter(|(axis, _)| axis.key != SCENARIO_KEY) {
        put(&mut document, &axis.key, value).map_err(|reason| format!("{}: {reason}", axis.key))?;
    }
    Ok(document)
}

/// Scene and receiver of a document at the study's level, each as its own reader understands it.
///
/// # Errors
/// Refusals of the reader.
pub fn read(level: Level, base: &Base, document: &toml::Table) -> Result<(Scenario, Settings), String> {
    let text = toml::to_string(document).map_err(|e| e.to_string())?;
    let mut scenario = Scenario::parse_in(&text, "scene", &base.directory, false).map_err(|e| e.without_place())?;
    if let Some(grade) = level.grade() {
        let each = scenario.front_ends.iter_mut();
        each.for_each(|front_end| front_end.fidelity = front_end.fidelity.at(grade));
    }
    let settings = Settings::from_table(scenario.receiver.clone().unwrap_or_default(), "receiver");
    let settings = settings.map_err(|e| e.to_string());
    settings.map(|settings| (scenario, settings)).map_err(|e| format!("{}: {e}", base.written.display()))
}

/// Composes the scene of a case at the level at which it runs: with a budget, that which keeps it.
///
/// # Errors
/// Refusals of the scene, and an effect that its level has no model of.
pub fn composed(scenario: &Scenario, base: &Base, seed: Option<u64>) -> Result<Scene, String> {
    let overrides = Overrides { seed, ..Overrides::default() };
    let (mut scene, _) = scenario.compose(&base.directory, &overrides).map_err(|e| e.without_place())?;
    let front_ends = std::slice::from_mut(&mut scene);
    twin::settle(front_ends).map_err(|e| e.to_string())?;
    twin::refuse(front_ends).map_err(|e| e.to_string())?;
    Ok(scene)
}

/// One receiver at work.
struct Ear {
    directory: PathBuf,
    settings: Settings,
    output: Output,
}

/// Receives a scene's samples, which are made once.
fn receive(
    scene: &Scene,
    ears: &mut [Ear],
    truth: &mut truth::Writer,
    halt: &(dyn Fn() -> bool + Sync),
) -> Result<(), StudyError> {
    let receptions = ears.iter().map(|ear| Reception::new(&scene.metadata, &ear.settings));
    let receptions: Vec<Reception> = receptions.collect::<Result<_, _>>()?;
    let mut pairs: Vec<(&mut Ear, Reception)> = ears.iter_mut().zip(receptions).collect();
    twin::feed(std::slice::from_ref(scene), truth, &mut |_, samples| {
        if halt() {
            return Err(StudyError::Stopped);
        }
        let each = pairs.par_iter_mut();
        Ok(each.try_for_each(|(ear, reception)| reception.take(samples, &mut ear.output))?)
    })?;
    pairs.into_iter().try_for_each(|(ear, reception)| reception.finish(&mut ear.output).map(|_| ()))?;
    Ok(())
}

/// Receives a scene without samples, once for each receiver. The truth is the first one's.
fn model(
    scene: &Scene,
    ears: &mut [Ear],
    truth: &mut truth::Writer,
    halt: &(dyn Fn() -> bool + Sync),
) -> Result<(), TwinError> {
    let one = |ear: &mut Ear, truth: &mut (dyn truth::Sink + Send)| {
        let mut records = Halting { records: &mut ear.output, halt };
        let front_ends = std::slice::from_ref(scene);
        twin::modelled(front_ends, &ear.settings, (truth, &mut records), &mut |_| ()).map(|_| ())
    };
    let Some((first, others)) = ears.split_first_mut() else { return Ok(()) };
    let (first, others) =
        rayon::join(|| one(first, truth), || others.par_iter_mut().try_for_each(|ear| one(ear, &mut ())));
    first.and(others)
}

/// Runs cases that share their signal; gives the figures asked for, case by case.
///
/// # Errors
/// A case that its readers refuse, files that cannot be written; [`StudyError::Stopped`] once `halt` says so.
pub fn run(
    study: &Study,
    base: &Base,
    cases: &[axis::Case],
    scratch: &Path,
    halt: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Vec<Option<f64>>>, StudyError> {
    let Some(first) = cases.first() else { return Ok(Vec::new()) };
    let refused = |case: &axis::Case, reason: String| StudyError::Case {
        origin: study.origin.clone(),
        case: case.number,
        values: study.values_text(case),
        reason,
    };
    let of = |case: &axis::Case| {
        let document = patched(base, &study.values(case)).map_err(|reason| refused(case, reason))?;
        read(study.level, base, &document).map_err(|reason| refused(case, reason))
    };
    let (scenario, _) = of(first)?;
    let seed = study.seed_of(first, &base.name);
    let scene = composed(&scenario, base, Some(seed)).map_err(|reason| refused(first, reason))?;
    let here = temporary::directory(scratch)?;
    let below = |name: &str| {
        let path = here.path().join(name);
        match fs::create_dir(&path) {
            Ok(()) => Ok(path),
            Err(source) => Err(StudyError::Create { path, source }),
        }
    };
    let truth_path = below("truth")?;
    let mut truth = truth::Writer::create(&truth_path).map_err(GenerateError::Truth)?;
    let mut ears = Vec::new();
    for (number, case) in cases.iter().enumerate() {
        let (_, settings) = of(case)?;
        let settings = twin::settings_for(std::slice::from_ref(&scene), &settings);
        let directory = below(&format!("rx{number}"))?;
        let output = Output::create(&directory)?;
        ears.push(Ear { directory, settings, output });
    }
    if scene.fidelity.grade.is_sampled() {
        receive(&scene, &mut ears, &mut truth, halt)?;
    } else {
        model(&scene, &mut ears, &mut truth, halt).map_err(|error| match error {
            _ if halt() => StudyError::Stopped,
            TwinError::Refused(error) => refused(first, error.to_string()),
            TwinError::Generate(error) => error.into(),
            TwinError::Receive(error) => error.into(),
        })?;
    }
    drop(truth);
    ears.iter().map(|ear| figures(here.path(), &truth_path, ear, &study.keep)).collect()
}

fn figures(here: &Path, truth: &Path, ear: &Ear, keep: &[String]) -> Result<Vec<Option<f64>>, StudyError> {
    let run = Run::read_parts(here, truth, &ear.directory)?;
    let errors = Errors::measure(&run)?;
    let summary = Summary::new(&run, &errors, &Clock::measure(&run, &errors)?)?;
    let json = serde_json::to_value(&summary).map_err(|e| StudyError::Bug(e.to_string()))?;
    let places = places_s(&run)?;
    let fixes = Fixes::of(&run, &errors)?;
    // Theory is of one channel: where signals or components differ it has nothing to say.
    let channel = alone(&run).map(|signal| {
        let edges_db = edge_cost_db(&run, signal);
        let cn0_dbhz = summary.details.cn0_effective_dbhz.map(|dbhz| dbhz - edges_db);
        limits::channel_of(signal, &ear.settings.tracking, Mode::Phase, cn0_dbhz)
    });
    let of = |name: &String| match name.as_str() {
        "acquisition.detected_share" => first_search(&run).0,
        "acquisition.false" => Some(first_search(&run).1),
        "theory.tracking.pll_sigma_deg" => pll_theory_deg(&places, channel.as_ref()?),
        "theory.tracking.dll_sigma_chips" => expect::code_chips(channel.as_ref()?).map(|jitter| jitter.sigma),
        SNR => {
            let channel = channel.as_ref()?;
            channel.cn0_dbhz.map(|dbhz| channel.update_s() * libm::pow(10.0, dbhz / 10.0))
        }
        own if fixes::FIGURES.contains(&own) => fixes.figure(own),
        path => number(&json, path),
    };
    Ok(keep.iter().map(of).map(|value| value.filter(|x| x.is_finite())).collect())
}

/// A number of the summary by its path; `None` where the run has none.
fn number(json: &Json, path: &str) -> Option<f64> {
    json.pointer(&format!("/{}", path.replace('.', "/"))).and_then(Json::as_f64)
}

/// The truth's only signal, if it has one component.
fn alone(run: &Run) -> Option<&'static Signal> {
    let mut signals = run.signals.iter().copied();
    signals.next().filter(|signal| signals.next().is_none() && signal.components.len() == 1)
}

/// Share of the satellites in view at the start that the first search found, and how many it found that were
/// not there.
fn first_search(run: &Run) -> (Option<f64>, f64) {
    let there = &run.in_view_at_start;
    let first = run.acquisition.iter().map(|row| row.sample).min();
    let hits = || run.acquisition.iter().filter(|row| Some(row.sample) == first && row.acquired);
    let found = hits().filter(|row| there.contains(&row.sv)).map(|row| row.sv).collect::<BTreeSet<_>>().len();
    let strange = hits().filter(|row| !there.contains(&row.sv)).count();
    let share = first.filter(|_| !there.is_empty()).map(|_| found as f64 / there.len() as f64);
    (share, strange as f64)
}

/// Transmit times of the true observations within their second, seconds.
fn places_s(run: &Run) -> Result<Vec<f64>, JudgeError> {
    let mut places = Vec::with_capacity(run.truth.len());
    for link in run.truth.keys() {
        places.extend(run.truth.map(link, |row| row.sent_fraction_s)?);
    }
    Ok(places)
}

/// Jitter of the carrier as it is observed: at instants, where the discriminator sees means over an
/// integration. Where in the running integration an observation falls follows from the time sent, as
/// integrations begin with symbols.
fn pll_theory_deg(places_s: &[f64], channel: &Case) -> Option<f64> {
    let cn0_dbhz = channel.cn0_dbhz?;
    let update_s = channel.update_s();
    let closed = expect::carrier_loop(&channel.settings, Mode::Phase, update_s);
    let gain = |place: f64| closed.linear_at(place).noise_gain();
    let (start, middle, end) = (gain(0.0)?, gain(0.5)?, gain(1.0)?);
    // The variance is a quadratic of the position, here from -1/2 to 1/2.
    let (slope, curve) = (end - start, 2.0 * (start + end - 2.0 * middle));
    let gains: Vec<f64> = places_s
        .iter()
        .map(|sent_s| {
            let integrations = sent_s / update_s;
            let place = integrations - integrations.floor() - 0.5;
            middle + place * (slope + place * curve)
        })
        .collect();
    let raw_deg = pll::raw_rad(update_s, libm::pow(10.0, cn0_dbhz / 10.0)).to_degrees();
    Some(raw_deg * mean(&gains)?.sqrt())
}
