//! A case at correlator level: the receiver's own loops on modelled correlations, thousands of times real
//! time.
//!
//! The base is `[signal]`, `[motion]`, `[loop]`, `[measure]` and `[receiver.tracking]`; figures are in
//! [`FIGURES`], those of theory under `theory.`. Limits are those of [`crate::correlator`]: one
//! satellite in steady tracking, constant C/N0, no multipath. Where the signal was lost, spreads have no
//! value.

use super::keys;
use crate::correlation::Correlation;
use crate::correlator::{Case, Outcome, run, signals};
use crate::expect::{self, Jitter};
use crate::motion::{Motion, Step};
use analysis::expect::theory::clock::PowerLaw;
use analysis::expect::theory::{dll, fll, oscillator, pll};
use analysis::waveform::Waveform;
use generator::clock::oscillator::PowerLaw as Levels;
use generator::scenario::ScenarioError;
use generator::scenario::read::{Source, Table};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::gps::l1ca::L1_CA;
use gnss::signal::{Component, Signal};
use receiver::lead::lead;
use receiver::settings::Settings;
use receiver::track::TrackingSettings;
use receiver::track::closed::Mode;

/// Standard gravity (CGPM 1901).
const GRAVITY_MPS2: f64 = 9.80665;

/// The base of a case, its axes applied.
#[derive(Clone, Debug)]
pub struct Model {
    signal: &'static Signal,
    component: &'static Component,
    cn0_dbhz: Option<f64>,
    band_hz: Option<f64>,
    oscillator: Option<PowerLaw>,
    doppler_hz: f64,
    acceleration_g: f64,
    jerk_g_per_s: f64,
    jerk_s: f64,
    mode: Mode,
    watched: bool,
    start_chips: f64,
    settle_s: f64,
    duration_s: f64,
    tracking: TrackingSettings,
}

/// True if a key changes the received signal, and not only its processing in the receiver.
pub fn changes_signal(key: &str) -> bool {
    !["receiver.", "loop.", "measure."].iter().any(|start| key.starts_with(start))
}

impl Model {
    /// Reads the tables that make a base; others are left alone.
    pub(super) fn read(root: &Table<'_>) -> Result<Self, ScenarioError> {
        let open = |name: &str| -> Result<Option<Table<'_>>, ScenarioError> {
            let table = root.table(name)?;
            table.as_ref().map_or(Ok(()), Table::allow_own)?;
            Ok(table)
        };
        let (signal, motion) = (open("signal")?, open("motion")?);
        let (closed, measure) = (open("loop")?, open("measure")?);
        let receiver = root.table("receiver")?;
        receiver.as_ref().map_or(Ok(()), |table| table.allow(&["tracking"]))?;
        let number = |table: &Option<Table<'_>>, name: &str| match table {
            Some(table) => table.number(name),
            None => Ok(None),
        };
        let names: Vec<(&str, &'static Signal)> = signals().into_iter().map(|signal| (signal.name, signal)).collect();
        let modes = [("phase", Mode::Phase), ("assisted", Mode::Assisted), ("frequency", Mode::Frequency)];
        let chosen = |table: &Option<Table<'_>>, name, choices: &[(&str, Mode)]| match table {
            Some(table) => table.choice(name, choices),
            None => Ok(None),
        };
        let place = root.place("receiver");
        let settings = receiver.map(|table| table.whole()).transpose()?.unwrap_or_default();
        let settings = Settings::from_table(settings, "receiver")
            .map_err(|e| ScenarioError::Toml { place, message: e.to_string() })?;
        let named = match &signal {
            Some(table) => table.choice("name", &names)?.unwrap_or(&L1_CA),
            None => &L1_CA,
        };
        let component = match &signal {
            Some(table) => component(table, named)?,
            None => &L1_CA.components[0],
        };
        if let Some(table) = signal.as_ref().filter(|_| component.layers.len() > 1)
            && table.number("bandwidth_hz")?.is_some()
        {
            let reason =
                format!("nothing for {}, whose pulses of several layers are modelled without a front end", named.name);
            return Err(table.bad("bandwidth_hz", reason));
        }
        Ok(Self {
            signal: named,
            component,
            cn0_dbhz: number(&signal, "cn0_dbhz")?,
            band_hz: number(&signal, "bandwidth_hz")?,
            oscillator: signal.as_ref().map(law).transpose()?.flatten(),
            doppler_hz: number(&motion, "doppler_hz")?.unwrap_or(0.0),
            acceleration_g: number(&motion, "acceleration_g")?.unwrap_or(0.0),
            jerk_g_per_s: number(&motion, "jerk_g_per_s")?.unwrap_or(0.0),
            jerk_s: number(&motion, "jerk_s")?.unwrap_or(f64::INFINITY),
            mode: chosen(&closed, "mode", &modes)?.unwrap_or(Mode::Phase),
            watched: closed.as_ref().map(|table| table.flag("detectors")).transpose()?.flatten().unwrap_or(false),
            start_chips: number(&closed, "start_chips")?.unwrap_or(0.0),
            settle_s: number(&measure, "settle_s")?.unwrap_or(5.0),
            duration_s: number(&measure, "duration_s")?.unwrap_or(60.0),
            tracking: settings.tracking,
        })
    }

    /// Reads a document that is in no file.
    pub(super) fn of(document: &toml::Table, origin: &str) -> Result<Self, ScenarioError> {
        let text = toml::to_string(document).unwrap_or_default();
        let source = Source { origin, text: &text };
        let refuse =
            |e: toml::de::Error| ScenarioError::Toml { place: source.place(0), message: e.message().to_owned() };
        let document = toml::de::DeTable::parse(&text).map_err(refuse)?;
        Self::read(&Table::new(&source, "", 0, document.get_ref(), keys::STUDY))
    }

    /// Time that a case simulates.
    pub fn simulated_s(&self) -> f64 {
        self.settle_s + self.duration_s
    }

    fn case(&self, seed: u64) -> Case {
        let per_g = GRAVITY_MPS2 * self.signal.centre_hz() / SPEED_OF_LIGHT_MPS;
        let (rate_step_hz_s, jerk_hz_s2) = (self.acceleration_g * per_g, self.jerk_g_per_s * per_g);
        let mut motion = Motion { doppler_hz: self.doppler_hz, ..Motion::default() };
        if rate_step_hz_s != 0.0 || jerk_hz_s2 != 0.0 {
            // Into loops that have settled: what they make of it is measured from its first moment on.
            motion.steps.push(Step { at_s: self.settle_s, rate_step_hz_s, jerk_hz_s2 });
            let end_s = self.settle_s + self.jerk_s;
            if end_s.is_finite() {
                motion.steps.push(Step { at_s: end_s, rate_step_hz_s: 0.0, jerk_hz_s2: 0.0 });
            }
        }
        Case {
            signal: self.signal,
            component: self.component,
            settings: self.tracking.fitted(self.component),
            mode: self.mode,
            cn0_dbhz: self.cn0_dbhz,
            motion,
            oscillator: self.oscillator,
            correlation: match self.band_hz {
                Some(band_hz) => {
                    let code = Waveform::of_shape(self.component.shape(), self.component.chip_rate_hz);
                    Correlation::of(code, Some(band_hz))
                }
                None => Correlation::of_component(self.component, self.tracking.waveform),
            },
            watched: self.watched,
            start_chips: self.start_chips,
            settle_s: self.settle_s,
            duration_s: self.duration_s,
            seed,
        }
    }

    /// Runs a case and gives the figures asked for, in their order.
    pub fn figures(&self, seed: u64, keep: &[String]) -> Vec<Option<f64>> {
        let case = self.case(seed);
        let outcome = run(&case);
        let of =
            |name: &String| FIGURES.iter().find(|figure| figure.name == name).and_then(|f| (f.of)(&case, &outcome));
        keep.iter().map(of).map(|value| value.filter(|x| x.is_finite())).collect()
    }
}

/// The component of a signal that a base names.
fn component(table: &Table<'_>, signal: &'static Signal) -> Result<&'static Component, ScenarioError> {
    let choices = [("leading", 0), ("data", 1), ("pilot", 2)];
    let found = match table.choice("component", &choices)?.unwrap_or(0) {
        0 => lead(signal),
        1 => signal.components.iter().find(|component| component.message.is_some()),
        _ => signal.components.iter().find(|component| component.message.is_none()),
    };
    found.ok_or_else(|| table.bad("component", format!("one that {} has", signal.name)))
}

/// The oscillator as a scene would write it; its phase noises are not modelled here.
fn law(table: &Table<'_>) -> Result<Option<PowerLaw>, ScenarioError> {
    let preset = table.choice("oscillator", &Levels::PRESETS)?.map(|law| law.levels());
    let given = table.numbers::<5>("power_law")?;
    let levels = match (preset, given) {
        (Some(_), Some(_)) => return Err(table.bad("power_law", "nothing beside oscillator, which names a power law")),
        (preset, given) => preset.or(given),
    };
    match levels {
        Some([h2, h1, h0, hm1, hm2]) if h2 == 0.0 && h1 == 0.0 && [h0, hm1, hm2].iter().all(|h| *h >= 0.0) => {
            Ok(Some(PowerLaw::of_frequency(h0, hm1, hm2)))
        }
        Some(_) => {
            Err(table.bad("power_law", "[0, 0, h0, h-1, h-2], none negative: this level has frequency noise only"))
        }
        None => Ok(None),
    }
}

/// A figure of a case.
#[derive(Clone, Copy)]
pub struct Figure {
    /// Name of the figure in a study.
    pub name: &'static str,
    of: fn(&Case, &Outcome) -> Option<f64>,
}

const fn figure(name: &'static str, of: fn(&Case, &Outcome) -> Option<f64>) -> Figure {
    Figure { name, of }
}

/// A spread, where the signal was not lost.
fn kept(outcome: &Outcome, value: Option<f64>) -> Option<f64> {
    value.filter(|_| outcome.lost.is_none())
}

fn chip_m(case: &Case) -> f64 {
    SPEED_OF_LIGHT_MPS / case.component.chip_rate_hz
}

/// Spread by theory, which is of loops in noise alone: there is none where the motion changes.
fn sigma(case: &Case, of: fn(&Case) -> Option<Jitter>) -> Option<f64> {
    of(case).filter(|_| is_steady(case)).map(|jitter| jitter.sigma)
}

fn is_steady(case: &Case) -> bool {
    case.motion.steps.is_empty()
}

/// Thermal jitter and the oscillator's, which add in square.
fn phase_theory_deg(case: &Case) -> Option<f64> {
    let thermal_deg = match case.cn0_dbhz {
        Some(_) => 360.0 * sigma(case, expect::phase_cycles)?,
        None if is_steady(case) => 0.0,
        None => return None,
    };
    let Some(noise) = &case.oscillator else { return Some(thermal_deg) };
    let update_s = case.update_s();
    let system = expect::carrier_loop(&case.settings, case.mode, update_s).linear();
    let oscillator_deg =
        oscillator::jitter_discrete_rad(noise, case.signal.centre_hz(), &system, update_s).to_degrees();
    Some(libm::hypot(thermal_deg, oscillator_deg))
}

/// T·C/N0: what the theory of loops in noise wants at least [`LEAST_SNR`](crate::proof::LEAST_SNR) of.
pub const SNR: &str = "theory.snr";

/// Figures that a study may keep. Spreads are of truth minus oscillator, mean over an integration, about
/// their mean; `raw_…` are of discriminator values. `theory.…` are the predictions of
/// `analysis::expect::theory` for the closed loop.
pub const FIGURES: &[Figure] = &[
    figure("held", |_, outcome| Some(f64::from(u8::from(outcome.lost.is_none())))),
    figure("slip_free", |_, outcome| Some(f64::from(u8::from(outcome.lost.is_none() && outcome.slips == 0)))),
    figure("lost_after_s", |_, outcome| outcome.lost.map(|(at_s, _)| at_s)),
    figure("interruptions", |_, outcome| Some(outcome.interruptions as f64)),
    figure("slips_per_hour", |case, outcome| {
        let hours = outcome.phase_cycles.count as f64 * case.update_s() / 3600.0;
        kept(outcome, Some(outcome.slips as f64 / hours))
    }),
    figure("on_main_peak", |_, outcome| outcome.lost.is_none().then(|| f64::from(u8::from(outcome.on_main)))),
    figure("off_main_peak_s", |_, outcome| kept(outcome, Some(outcome.off_main_s))),
    figure("phase_sigma_deg", |_, outcome| kept(outcome, outcome.phase_cycles.sigma().map(|x| 360.0 * x))),
    figure("theory.phase_sigma_deg", |case, _| phase_theory_deg(case)),
    figure("phase_mean_deg", |_, outcome| kept(outcome, outcome.phase_cycles.mean().map(|x| 360.0 * x))),
    figure("phase_peak_deg", |_, outcome| kept(outcome, Some(360.0 * outcome.phase_peak_cycles))),
    figure("frequency_sigma_hz", |_, outcome| kept(outcome, outcome.frequency_hz.sigma())),
    figure("theory.frequency_sigma_hz", |case, _| sigma(case, expect::frequency_hz)),
    figure("code_sigma_chips", |_, outcome| kept(outcome, outcome.code_chips.sigma())),
    figure("theory.code_sigma_chips", |case, _| sigma(case, expect::code_chips)),
    figure("code_sigma_m", |case, outcome| kept(outcome, outcome.code_chips.sigma().map(|x| x * chip_m(case)))),
    figure("theory.code_sigma_m", |case, _| sigma(case, expect::code_chips).map(|x| x * chip_m(case))),
    figure("code_mean_chips", |_, outcome| kept(outcome, outcome.code_chips.mean())),
    figure("raw_phase_sigma_deg", |_, outcome| kept(outcome, outcome.raw_phase_cycles.sigma().map(|x| 360.0 * x))),
    figure("raw_code_sigma_chips", |_, outcome| kept(outcome, outcome.raw_code_chips.sigma())),
    figure("raw_frequency_sigma_hz", |_, outcome| kept(outcome, outcome.raw_frequency_hz.sigma())),
    figure(SNR, |case, _| Some(case.update_s() * case.component_hz()?)),
    figure("pll_bandwidth_exact_hz", |case, _| expect::phase_cycles(case).map(|jitter| jitter.bandwidth_hz)),
    figure("dll_bandwidth_exact_hz", |case, _| expect::code_chips(case).map(|jitter| jitter.bandwidth_hz)),
    figure("phase_threshold_deg", |_, _| Some(pll::THRESHOLD_RAD.to_degrees())),
    figure("code_threshold_chips", |case, _| Some(dll::threshold_chips(case.settings.spacing_chips))),
    figure("frequency_threshold_hz", |case, _| Some(fll::threshold_hz(case.update_s()))),
];
