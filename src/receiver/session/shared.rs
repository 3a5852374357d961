//! State that all front ends of a reception share: navigation data, the receiver's clock, the solver, and the
//! progress of the satellites.

use std::collections::{BTreeMap, BTreeSet};

use crate::authentic::Authentic;
use crate::decode::Decoder;
use crate::detect::Detection;
use crate::diagnosis::{Refusal, Stage};
use crate::observe::Timebase;
use crate::outcome::{Conditioning, Outcome};
use crate::position::least_squares::{LARGEST_CONDITION, UNKNOWNS};
use crate::position::{CodeNoise, NoFix, Noises, Sets, Solver};
use crate::settings::Settings;
use crate::track::LoopMargin;
use gnss::ionosphere::{Coefficients, Model};
use gnss::record::{Fix, SightRow};
use gnss::satellite::Sv;
use gnss::signal::{Link, Signal};
use gnss::time::{Epoch, Rate};

/// Years in 1024 weeks.
const ERA_YEARS: f64 = 19.6;

/// Progress of a satellite, for the diagnosis.
#[derive(Clone, Default)]
pub(super) struct Progress {
    pub symbols: bool,
    pub frame: bool,
    pub missing: Vec<u8>,
}

/// The last fix, by whose clock lost samples show that no channel lived through.
#[derive(Clone, Copy)]
pub(super) struct LastFix {
    pub sample: u64,
    pub bias_s: f64,
    pub drift: f64,
    pub sigma_s: f64,
}

/// The state that channels of all front ends feed.
pub(super) struct Shared {
    pub settings: Settings,
    pub week_reference: Epoch,
    /// Start time that the recording states.
    pub start: Option<Epoch>,
    pub noises: Noises,
    pub timebase: Timebase,
    pub solver: Solver,
    pub ephemerides: Sets,
    /// Model that corrects the ionosphere, if any.
    pub ionosphere_model: Option<Model>,
    /// Verification of Galileo's authentication, if the settings ask for it.
    pub authentic: Option<Authentic>,
    /// Detectors of jamming and spoofing, if the settings ask for them.
    pub detection: Option<Detection>,
    /// Coefficients of that model.
    pub ionosphere: Option<Coefficients>,
    pub last_fix: Option<LastFix>,
    /// Fix that predicts the satellites.
    pub latest: Option<Fix>,
    /// Directions of the satellites at that fix.
    pub sights: Vec<SightRow>,
    /// Dopplers that are followed, in parts of the carrier.
    pub dopplers: BTreeMap<Link, f64>,
    pub clock_drift: Option<f64>,
    pub fixes: u64,
    pub first_fix_s: Option<f64>,
    pub worst_condition: Option<f64>,
    pub reason: Option<NoFix>,
    /// The best that a search met: satellite, statistic and threshold.
    pub strongest: Option<(Sv, f64, f64)>,
    pub progress: BTreeMap<Sv, Progress>,
    /// Units that passed their checks and were not used, by satellite and reason, since its last ephemeris.
    pub refused: BTreeMap<Sv, BTreeMap<String, u64>>,
    pub acquired: BTreeSet<Sv>,
    pub used: BTreeSet<Sv>,
    pub losses: u64,
}

impl Shared {
    /// State before the first sample; `rate` is that of the first front end.
    pub fn new(
        settings: &Settings,
        noises: Noises,
        rate: Rate,
        (start, week_reference): (Option<Epoch>, Epoch),
        (authentic, detection): (Option<Authentic>, Option<Detection>),
    ) -> Self {
        let mut solver = Solver::new(&settings.position, noises.clone(), rate);
        if let Some(integrity) = &settings.integrity {
            solver.set_integrity(integrity);
        }
        Self {
            settings: settings.clone(),
            week_reference,
            start,
            timebase: Timebase::new(rate, start),
            solver,
            noises,
            ephemerides: Sets::default(),
            ionosphere_model: settings.position.ionosphere.model(&settings.acquisition.signals()),
            ionosphere: None,
            authentic,
            detection,
            last_fix: None,
            latest: None,
            sights: Vec::new(),
            dopplers: BTreeMap::new(),
            clock_drift: None,
            fixes: 0,
            first_fix_s: None,
            worst_condition: None,
            reason: None,
            strongest: None,
            progress: BTreeMap::new(),
            refused: BTreeMap::new(),
            acquired: BTreeSet::new(),
            used: BTreeSet::new(),
            losses: 0,
        }
    }

    /// Decoder of a channel's message. With verification it keeps whole pages.
    pub fn decoder(&self, signal: &Signal, sv: Sv) -> Option<Decoder> {
        let decoder = Decoder::new(signal, sv);
        if self.authentic.is_some() { decoder.map(Decoder::with_pages) } else { decoder }
    }

    /// Noise of the code loop of a signal.
    pub fn noise(&self, signal: &Signal) -> Option<&CodeNoise> {
        self.noises.iter().find(|(of, _)| *of == signal).map(|(_, noise)| noise)
    }

    /// Renames a satellite that turned out to be another one.
    pub fn rename(&mut self, from: Sv, to: Sv) {
        self.acquired.remove(&from);
        self.acquired.insert(to);
        if let Some(progress) = self.progress.remove(&from) {
            self.progress.insert(to, progress);
        }
    }

    /// The time near which weeks are resolved.
    pub fn near(&self) -> Epoch {
        self.known().unwrap_or(self.week_reference)
    }

    /// The time where messages or the recording say it.
    pub fn known(&self) -> Option<Epoch> {
        self.timebase.clock().map(|clock| clock.start).or(self.start)
    }

    /// Counts a unit that passed its checks and was not used.
    pub fn refuse(&mut self, sv: Sv, why: String) {
        *self.refused.entry(sv).or_default().entry(why).or_default() += 1;
    }

    /// The reasons for which units were not used, each with its satellites and how many there were.
    pub fn refusals(&self) -> Vec<Refusal> {
        let mut all = BTreeMap::<&str, Refusal>::new();
        for (sv, reasons) in &self.refused {
            for (why, count) in reasons {
                let blank = || Refusal { why: why.clone(), svs: Vec::new(), units: 0 };
                let refusal = all.entry(why).or_insert_with(blank);
                refusal.svs.push(*sv);
                refusal.units += count;
            }
        }
        all.into_values().collect()
    }

    /// Outcome as far as navigation knows it, for loops with these margins.
    pub fn outcome(&self, loops: &[LoopMargin]) -> Outcome {
        Outcome {
            samples: 0,
            seconds: 0.0,
            acquired: self.acquired.iter().copied().collect(),
            used: self.used.iter().copied().collect(),
            fixes: self.fixes,
            first_fix_s: self.first_fix_s,
            last_fix: self.latest.clone(),
            losses: self.losses,
            cut_bytes: 0,
            format_warning: None,
            diagnosis: None,
            interfered: None,
            parted: None,
            osnma: self.authentic.as_ref().map(Authentic::outcome),
            detection: self.detection.as_ref().map(Detection::outcome),
            array: None,
            jumps: Vec::new(),
            warnings: Vec::new(),
            conditioning: Conditioning {
                geometry_worst: self.worst_condition,
                geometry_limit: LARGEST_CONDITION,
                loops: loops.to_vec(),
            },
        }
    }

    /// Conditions of clock, position and messages that make the results worse than necessary.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = self.assumed_era().into_iter().collect();
        warnings.extend(self.solver.other_troposphere().map(str::to_owned));
        warnings.extend(self.refusals().iter().map(ToString::to_string));
        warnings
    }

    /// Note on a week number that was resolved without a start time.
    fn assumed_era(&self) -> Option<String> {
        let clock = self.timebase.clock().filter(|_| self.start.is_none())?;
        Some(format!(
            "the recording has no start time and the message counts weeks modulo 1024: of times {ERA_YEARS} years \
             apart the one nearest to operation.week_reference = {:?} was taken, {}; --start TIME or that setting \
             takes another",
            self.settings.operation.week_reference, clock.start
        ))
    }

    /// The first stage that failed, where there was no fix.
    pub fn failed_stage(&self) -> Stage {
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
            let refused = self.refusals();
            return if refused.is_empty() { Stage::NoFrame { with_symbols } } else { Stage::Refused { refused } };
        }
        let complete: Vec<Sv> = self.ephemerides.satellites().collect();
        if complete.len() < UNKNOWNS {
            let lacking = |(sv, progress): (&Sv, &Progress)| {
                (progress.frame && !progress.missing.is_empty()).then(|| (*sv, progress.missing.clone()))
            };
            return Stage::NoEphemeris { complete, missing: self.progress.iter().filter_map(lacking).collect() };
        }
        Stage::NoPosition { with_ephemeris: complete, reason: self.reason.clone() }
    }
}
