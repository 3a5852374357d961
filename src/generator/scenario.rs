//! A scenario as written: TOML in which a table is present only when the scene has the thing.
//!
//! [`Scenario::parse`] checks each key against the list of its table ([`KEYS`]) and each value against its range;
//! [`Scenario::compose`] checks what concerns several of them, loads files and makes a
//! [`Scene`](crate::generator::scene::Scene). Units stand in the names of the keys: degrees and dB here, radians and
//! ratios from here on. `[receiver]` is kept as written for the receiver's own settings.

mod attitude;
mod compose;
mod expect;
mod hardware;
mod hostile;
pub mod interference;
mod link;
mod motion;
mod multipath;
mod obstruction;
mod parts;
mod propagation;
pub(crate) mod read;
mod satellite;
mod scintillation;
mod stages;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use thiserror::Error;
use toml::de::DeTable;

pub use compose::Overrides;
pub use hardware::{ClockSpec, FrontEnd};
pub use interference::{InterferenceSpec, SpooferSpec};
pub use link::{AntennaSpec, Power, Transmit};
pub use motion::{FileKind, MotionSpec};
pub use propagation::{Electrons, Ionosphere, MappingKind, NeutralAtmosphere};
pub use read::Place;
use read::{Source, Table};
pub use satellite::{MessageKind, MessageSpec, OrbitsSpec, SatelliteFault};
use stages::Stages;

use crate::generator::effect::multipath::Echo;
use crate::generator::effect::obstruction::Obstacle;
use crate::generator::fidelity::allowed_m;
use crate::generator::ripple::scintillation::Strength;
use crate::generator::scene::{Arithmetic, CodeEdge, Fidelity, Grade};
use crate::generator::vehicle::attitude::Attitude;
use crate::gnss::facts::Expect;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{SIGNALS, Signal};
use crate::gnss::time::{Epoch, Rate};

/// Every table and the keys that it may hold. `[power.satellites]`, `[power.blocks]` and `[orbits.antenna_offsets_m]` hold
/// satellites, `[receiver]` anything; the keys of lists of tables are in their families' files.
pub const KEYS: &[(&str, &[&str])] = &[
    (
        "",
        &[
            "name",
            "start",
            "duration_s",
            "seed",
            "signals",
            "navigation",
            "satellites",
            "orbits",
            "satellite_fault",
            "message_fault",
            "motion",
            "attitude",
            "front_end",
            "power",
            "multipath",
            "ionosphere",
            "troposphere",
            "obstruction",
            "scintillation",
            "receiver_clock",
            "noise",
            "playback",
            "local_oscillator",
            "filter",
            "iq",
            "adc",
            "interference",
            "spoofer",
            "fidelity",
            "truth",
            "expect",
            "receiver",
        ],
    ),
    ("navigation", &["file"]),
    ("satellites", &["mask_deg", "exclude", "include_unhealthy"]),
    ("orbits", satellite::ORBITS_KEYS),
    ("satellite_fault", satellite::FAULT_KEYS),
    ("message_fault", satellite::MESSAGE_KEYS),
    ("motion", motion::KEYS),
    ("attitude", attitude::KEYS),
    ("front_end", &["sample_rate_hz", "if_hz", "spectrum_inverted", "format", "noise_lsb"]),
    ("power", link::KEYS),
    ("ionosphere", propagation::IONOSPHERE_KEYS),
    ("troposphere", propagation::TROPOSPHERE_KEYS),
    ("scintillation", &["s4", "sigma_phi_rad", "decorrelation_s", "satellites"]),
    ("receiver_clock", &["bias_s", "drift_sps", "ageing_per_day", "sensitivity_per_g", "oscillator", "power_law"]),
    ("noise", &[]),
    ("playback", &["bits", "load_sigma", "attenuation_db"]),
    ("local_oscillator", &["offset_hz", "phase_noise_rad", "phase_noise_bandwidth_hz"]),
    ("filter", &["kind", "order", "bandwidth_hz"]),
    ("iq", &["gain_db", "phase_deg", "dc_i_lsb", "dc_q_lsb"]),
    ("adc", &["bits", "step_sigma", "agc_window_s"]),
    ("interference", interference::KEYS),
    ("spoofer", interference::SPOOFER_KEYS),
    ("fidelity", &["level", "code_edge", "carrier", "noise", "knot_tolerance_cycles"]),
    ("truth", &["interval_s"]),
    ("expect", expect::KEYS),
];

/// Largest scenario text that is read.
const MAX_BYTES: usize = 1 << 20;

/// Why a scenario is refused.
#[derive(Debug, Error)]
pub enum ScenarioError {
    #[error("{place}: {message}")]
    Toml { place: Place, message: String },
    #[error("{place}: unknown key '{key}'{}; known here: {known}", nearest.as_ref().map_or(String::new(), |n| format!(": did you mean '{n}'?")))]
    UnknownKey { place: Place, key: String, nearest: Option<String>, known: String },
    #[error("{place}: {key} = {value}: expected {expected}")]
    Value { place: Place, key: String, value: String, expected: String },
    #[error("{origin}: {key}: {reason}")]
    Conflict { origin: String, key: &'static str, reason: String },
    #[error("{origin}: {key} = {path:?}: {reason}")]
    File { origin: String, key: &'static str, path: PathBuf, reason: String },
    #[error("{origin}: {key} = {path:?}: cannot be read: {error}")]
    Read { origin: String, key: &'static str, path: PathBuf, error: std::io::Error },
}

impl ScenarioError {
    /// The message without its place, for a document that stands nowhere as it was read.
    pub fn without_place(&self) -> String {
        let whole = self.to_string();
        let place = match self {
            Self::Toml { place, .. } | Self::UnknownKey { place, .. } | Self::Value { place, .. } => place.to_string(),
            Self::Conflict { origin, .. } | Self::File { origin, .. } | Self::Read { origin, .. } => origin.clone(),
        };
        whole.strip_prefix(&format!("{place}: ")).map_or(whole.clone(), str::to_owned)
    }
}

/// A scenario whose every value is within its range. What is absent is `None` or not in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// What errors call it: its path.
    pub origin: String,
    pub name: String,
    /// What the receiver's clock reads at sample 0, and where the scene's true time counts from.
    pub start: Epoch,
    pub duration_s: f64,
    pub seed: u64,
    pub signals: Vec<&'static Signal>,
    /// Relative to the scenario's directory; absent means the embedded file.
    pub navigation: Option<PathBuf>,
    pub mask_rad: f64,
    pub excluded: Vec<Sv>,
    pub include_unhealthy: bool,
    /// True orbits and clocks; absent means those that are broadcast.
    pub orbits: Option<OrbitsSpec>,
    pub satellite_faults: Vec<SatelliteFault>,
    pub message_faults: Vec<MessageSpec>,
    pub motion: MotionSpec,
    pub attitude: Option<Attitude>,
    pub front_end: FrontEnd,
    pub power: Power,
    pub multipath: Vec<Echo>,
    pub ionosphere: Option<Ionosphere>,
    pub troposphere: Option<NeutralAtmosphere>,
    /// What stands in the way; buildings are measured from where the motion starts.
    pub obstacles: Vec<Obstacle>,
    pub scintillation: Option<Strength>,
    pub receiver_clock: ClockSpec,
    pub noise: bool,
    pub stages: Stages,
    pub interference: Vec<InterferenceSpec>,
    pub spoofers: Vec<SpooferSpec>,
    pub fidelity: Fidelity,
    pub truth_interval_s: f64,
    /// What the judge is to expect of a receiver.
    pub expect: Expect,
    /// For the receiver's own parser.
    pub receiver: Option<toml::Table>,
}

impl Scenario {
    /// Reads a scenario; `origin` names it in errors.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        let source = Source { origin, text };
        let refuse = |error: &toml::de::Error| ScenarioError::Toml {
            place: source.place(error.span().map_or(0, |span| span.start)),
            message: error.message().to_owned(),
        };
        if text.len() > MAX_BYTES {
            let message = format!("{} bytes: expected a scenario of at most {MAX_BYTES}", text.len());
            return Err(ScenarioError::Toml { place: source.place(0), message });
        }
        let document = DeTable::parse(text).map_err(|e| refuse(&e))?;
        let root = Table::new(&source, "", 0, document.get_ref());
        root.allow(keys_of(""))?;
        let open = |name: &'static str| -> Result<Option<Table<'_>>, ScenarioError> {
            let table = root.table(name)?;
            table.as_ref().map_or(Ok(()), |table| table.allow(keys_of(name)))?;
            Ok(table)
        };
        let (mask_rad, excluded, include_unhealthy) = satellites(open("satellites")?.as_ref())?;
        let front_end = hardware::front_end(open("front_end")?.as_ref())?;
        let motion = open("motion")?.ok_or_else(|| root.bad("motion", "a table with kind = \"static\", …"))?;
        let start = root.instant("start")?.ok_or_else(|| root.bad("start", "GPS time like \"2010-07-01T08:12:30\""))?;
        let file = open("navigation")?.map(|t| t.text("file", "a path")).transpose()?.flatten();
        let duration_s = root.required("duration_s", 0.01..=2_678_400.0, "s")?;
        let noise = open("noise")?.is_some();
        let power = link::power(open("power")?.as_ref())?;
        let allowed_m = allowed_m(noise.then(|| power.strongest_dbhz()));
        Ok(Self {
            origin: origin.to_owned(),
            name: name(&root)?,
            start: Epoch::parse(&start).map_err(|e| root.bad("start", e))?,
            duration_s,
            seed: root.integer("seed")?.unwrap_or(1),
            signals: signals(&root)?,
            navigation: file.map(PathBuf::from),
            mask_rad,
            excluded,
            include_unhealthy,
            orbits: open("orbits")?.map(|t| satellite::orbits(&t)).transpose()?,
            satellite_faults: each(&root, "satellite_fault", satellite::satellite_fault)?,
            message_faults: each(&root, "message_fault", satellite::message_fault)?,
            motion: MotionSpec::read(&motion)?,
            attitude: open("attitude")?.map(|t| attitude::attitude(&t)).transpose()?,
            front_end,
            power,
            multipath: multipath::echoes(&root.tables("multipath")?.unwrap_or_default())?,
            ionosphere: open("ionosphere")?.map(|t| propagation::ionosphere(&t)).transpose()?,
            troposphere: open("troposphere")?.map(|t| propagation::troposphere(&t)).transpose()?,
            obstacles: obstruction::obstacles(&root.tables("obstruction")?.unwrap_or_default())?,
            scintillation: open("scintillation")?.map(|t| scintillation::scintillation(&t)).transpose()?,
            receiver_clock: hardware::receiver_clock(open("receiver_clock")?.as_ref())?,
            noise,
            stages: Stages {
                playback: open("playback")?.map(|t| stages::playback(&t)).transpose()?,
                oscillator: open("local_oscillator")?.map(|t| stages::local_oscillator(&t)).transpose()?,
                filter: open("filter")?.map(|t| stages::filter(&t)).transpose()?,
                balance: open("iq")?.map(|t| stages::balance(&t, front_end.format)).transpose()?,
                converter: open("adc")?.map(|t| stages::converter(&t, front_end.format)).transpose()?,
            },
            interference: each(&root, "interference", interference::interference)?,
            spoofers: each(&root, "spoofer", interference::spoofer)?,
            fidelity: fidelity(open("fidelity")?.as_ref(), front_end.rate, allowed_m)?,
            truth_interval_s: match open("truth")? {
                Some(table) => table.number("interval_s", 0.001..=3600.0, "s")?.unwrap_or(0.1),
                None => 0.1,
            },
            expect: match open("expect")? {
                Some(table) => expect::expect(&table, duration_s)?,
                None => Expect::default(),
            },
            receiver: receiver(&root, text).map_err(|e| refuse(&e))?,
        })
    }
}

/// Every table of an array of tables.
fn each<T>(
    root: &Table<'_>,
    name: &str,
    read: impl Fn(&Table<'_>) -> Result<T, ScenarioError>,
) -> Result<Vec<T>, ScenarioError> {
    root.tables(name)?.unwrap_or_default().iter().map(read).collect()
}

/// The keys of a table.
fn keys_of(table: &str) -> &'static [&'static str] {
    KEYS.iter().find(|(name, _)| *name == table).map_or(&[], |(_, keys)| *keys)
}

fn name(root: &Table<'_>) -> Result<String, ScenarioError> {
    let expected = "1 to 64 letters, digits, '-' and '_' (it names a directory)";
    let name = root.text("name", expected)?.ok_or_else(|| root.bad("name", expected))?;
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.len() <= 64 && name.chars().all(fits) { Ok(name.to_owned()) } else { Err(root.bad("name", expected)) }
}

fn signals(root: &Table<'_>) -> Result<Vec<&'static Signal>, ScenarioError> {
    let known: Vec<String> = SIGNALS.iter().map(|signal| format!("{:?}", signal.name)).collect();
    let expected = format!("an array of different signals out of {}", known.join(", "));
    let Some(words) = root.words("signals", &expected)? else { return Ok(vec![&crate::gnss::gps::l1ca::L1_CA]) };
    let mut signals: Vec<&'static Signal> = Vec::new();
    for word in words {
        match Signal::find(word) {
            Some(signal) if !signals.contains(&signal) => signals.push(signal),
            _ => return Err(root.bad("signals", expected)),
        }
    }
    if signals.is_empty() { Err(root.bad("signals", expected)) } else { Ok(signals) }
}

fn satellites(table: Option<&Table<'_>>) -> Result<(f64, Vec<Sv>, bool), ScenarioError> {
    let Some(table) = table else { return Ok((5_f64.to_radians(), Vec::new(), false)) };
    let mask_deg = table.number("mask_deg", -10.0..=89.0, "deg")?.unwrap_or(5.0);
    let excluded = satellite_list(table, "exclude")?.unwrap_or_default();
    Ok((mask_deg.to_radians(), excluded, table.flag("include_unhealthy")?.unwrap_or(false)))
}

/// An array of satellites.
fn satellite_list(table: &Table<'_>, key: &str) -> Result<Option<Vec<Sv>>, ScenarioError> {
    let expected = "an array of satellites like [\"G01\", \"G12\"]";
    let Some(words) = table.words(key, expected)? else { return Ok(None) };
    let satellites: Result<Vec<Sv>, _> = words.iter().map(|word| word.parse::<Sv>()).collect();
    satellites.map(Some).map_err(|_| table.bad(key, expected))
}

/// A level's knobs, each overridden where the table names it.
fn fidelity(table: Option<&Table<'_>>, rate: Rate, allowed_m: f64) -> Result<Fidelity, ScenarioError> {
    let Some(table) = table else { return Ok(Fidelity::suited(Grade::Balanced, rate.hz(), allowed_m)) };
    let grade = table.choice("level", &Grade::NAMES)?.unwrap_or(Grade::Balanced);
    let level = Fidelity::suited(grade, rate.hz(), allowed_m);
    Ok(Fidelity {
        grade: level.grade,
        code_edge: table.choice("code_edge", &CodeEdge::NAMES)?.unwrap_or(level.code_edge),
        carrier: table.choice("carrier", &Arithmetic::NAMES)?.unwrap_or(level.carrier),
        noise: table.choice("noise", &Arithmetic::NAMES)?.unwrap_or(level.noise),
        knot_tolerance_cycles: table
            .number("knot_tolerance_cycles", 1e-7..=0.1, "cycles")?
            .unwrap_or(level.knot_tolerance_cycles),
        allowed_m,
    })
}

/// The receiver's table as it stands, through the ordinary parser.
fn receiver(root: &Table<'_>, text: &str) -> Result<Option<toml::Table>, toml::de::Error> {
    if !root.has("receiver") {
        return Ok(None);
    }
    let mut whole: toml::Table = toml::from_str(text)?;
    match whole.remove("receiver") {
        Some(toml::Value::Table(table)) => Ok(Some(table)),
        _ => Err(serde::de::Error::custom("receiver: expected a table")),
    }
}
