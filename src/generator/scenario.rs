//! A scenario as written: TOML in which a table is present only when the scene has the thing.
//!
//! [`Scenario::parse`] checks each key against the list of its table ([`KEYS`]) and each value against its range;
//! [`Scenario::compose`] checks what concerns several of them, loads files and makes a
//! [`Scene`](crate::generator::scene::Scene). Units stand in the names of the keys: degrees and dB here, radians and
//! ratios from here on. `[receiver]` is kept as written for the receiver's own settings.

mod compose;
mod motion;
mod parts;
mod read;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use thiserror::Error;
use toml::de::DeTable;

pub use compose::Overrides;
pub use motion::{FileKind, MotionSpec};
pub use read::Place;
use read::{Source, Table};

use crate::generator::clock::ReceiverClock;
use crate::generator::effect::link::{Antenna, LinkBudget};
use crate::generator::effect::troposphere::Weather;
use crate::generator::scene::{Arithmetic, CodeEdge, Fidelity, Grade};
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::samples::Format;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{SIGNALS, Signal};
use crate::gnss::time::{Epoch, Rate};

/// Every table and the keys that it may hold. `[power.satellites]` holds satellites, `[receiver]` anything.
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
            "motion",
            "front_end",
            "power",
            "ionosphere",
            "troposphere",
            "receiver_clock",
            "noise",
            "fidelity",
            "truth",
            "receiver",
        ],
    ),
    ("navigation", &["file"]),
    ("satellites", &["mask_deg", "exclude", "include_unhealthy"]),
    ("motion", motion::KEYS),
    ("front_end", &["sample_rate_hz", "if_hz", "spectrum_inverted", "format", "noise_lsb"]),
    ("power", &["kind", "cn0_dbhz", "satellites", "antenna", "noise_figure_db", "loss_db"]),
    ("ionosphere", &["model", "alpha", "beta"]),
    ("troposphere", &["model", "height_m", "pressure_hpa", "temperature_c", "relative_humidity"]),
    ("receiver_clock", &["bias_s", "drift_sps"]),
    ("noise", &[]),
    ("fidelity", &["level", "code_edge", "carrier", "noise", "knot_tolerance_cycles"]),
    ("truth", &["interval_s"]),
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
}

/// The sampling of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    pub rate: Rate,
    /// Where GPS L1 appears in the samples.
    pub if_hz: f64,
    pub inverted: bool,
    pub format: Format,
    /// The gain, if the scenario sets it.
    pub noise_lsb: Option<f32>,
}

/// How strong the satellites are.
#[derive(Clone, Debug, PartialEq)]
pub enum Power {
    /// The same for all but those listed.
    Fixed { cn0_dbhz: f64, satellites: Vec<(Sv, f64)> },
    /// From range, elevation and antennas.
    LinkBudget { antenna: Antenna, noise_figure_db: f64, loss_db: f64 },
}

/// Where the ionosphere's coefficients come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ionosphere {
    /// The navigation file's.
    Broadcast,
    Given(Klobuchar),
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
    pub motion: MotionSpec,
    pub front_end: FrontEnd,
    pub power: Power,
    pub ionosphere: Option<Ionosphere>,
    pub troposphere: Option<Weather>,
    pub receiver_clock: ReceiverClock,
    pub noise: bool,
    pub fidelity: Fidelity,
    pub truth_interval_s: f64,
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
        let front_end = front_end(open("front_end")?.as_ref())?;
        let motion = open("motion")?.ok_or_else(|| root.bad("motion", "a table with kind = \"static\", …"))?;
        let start = root.instant("start")?.ok_or_else(|| root.bad("start", "GPS time like \"2010-07-01T08:12:30\""))?;
        let file = open("navigation")?.map(|t| t.text("file", "a path")).transpose()?.flatten();
        let noise = open("noise")?.is_some();
        Ok(Self {
            origin: origin.to_owned(),
            name: name(&root)?,
            start: Epoch::parse(&start).map_err(|e| root.bad("start", e))?,
            duration_s: root.required("duration_s", 0.01..=2_678_400.0, "s")?,
            seed: root.integer("seed")?.unwrap_or(1),
            signals: signals(&root)?,
            navigation: file.map(PathBuf::from),
            mask_rad,
            excluded,
            include_unhealthy,
            motion: MotionSpec::read(&motion)?,
            front_end,
            power: power(open("power")?.as_ref())?,
            ionosphere: open("ionosphere")?.map(|t| ionosphere(&t)).transpose()?,
            troposphere: open("troposphere")?.map(|t| troposphere(&t)).transpose()?,
            receiver_clock: receiver_clock(open("receiver_clock")?.as_ref())?,
            noise,
            fidelity: fidelity(open("fidelity")?.as_ref(), front_end.rate)?,
            truth_interval_s: match open("truth")? {
                Some(table) => table.number("interval_s", 0.001..=3600.0, "s")?.unwrap_or(0.1),
                None => 0.1,
            },
            receiver: receiver(&root, text).map_err(|e| refuse(&e))?,
        })
    }
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
    let expected = "an array of satellites like [\"G01\", \"G12\"]";
    let words = table.words("exclude", expected)?.unwrap_or_default();
    let excluded: Result<Vec<Sv>, _> = words.iter().map(|word| word.parse::<Sv>()).collect();
    let excluded = excluded.map_err(|_| table.bad("exclude", expected))?;
    Ok((mask_deg.to_radians(), excluded, table.flag("include_unhealthy")?.unwrap_or(false)))
}

fn front_end(table: Option<&Table<'_>>) -> Result<FrontEnd, ScenarioError> {
    let default_rate = Rate::from_hz(2.6e6);
    let Some(table) = table else {
        let rate = default_rate.ok_or_else(|| ScenarioError::Conflict {
            origin: String::new(),
            key: "front_end",
            reason: "no sample rate".to_owned(),
        })?;
        return Ok(FrontEnd { rate, if_hz: 0.0, inverted: false, format: Format::Ci8, noise_lsb: None });
    };
    let rate_hz = table.number("sample_rate_hz", 1.5e6..=60e6, "Hz")?.unwrap_or(2.6e6);
    let rate = Rate::from_hz(rate_hz).ok_or_else(|| table.bad("sample_rate_hz", "a rate"))?;
    let expected = "one of ci8, cu8, ci16, cf32, ri8, ri16";
    let format = match table.text("format", expected)? {
        Some(text) => text.parse().map_err(|_| table.bad("format", expected))?,
        None => Format::Ci8,
    };
    let half = 0.5 * rate.hz();
    let if_hz = table.number("if_hz", -60e6..=60e6, "Hz")?.unwrap_or(0.0);
    if if_hz.abs() >= half {
        return Err(table.bad("if_hz", format!("less than half of sample_rate_hz in size, {half} Hz")));
    }
    if !format.is_complex() && if_hz <= 0.0 {
        return Err(
            table.bad("if_hz", format!("more than 0 and less than {half} Hz, because format = {format} is real"))
        );
    }
    Ok(FrontEnd {
        rate,
        if_hz,
        inverted: table.flag("spectrum_inverted")?.unwrap_or(false),
        format,
        noise_lsb: table.number("noise_lsb", 0.01..=32_767.0, "LSB")?.map(|x| x as f32),
    })
}

fn power(table: Option<&Table<'_>>) -> Result<Power, ScenarioError> {
    let ordinary = LinkBudget::default();
    let budget = |antenna: Option<Antenna>, noise_figure_db: Option<f64>, loss_db: Option<f64>| Power::LinkBudget {
        antenna: antenna.unwrap_or(ordinary.antenna),
        noise_figure_db: noise_figure_db.unwrap_or(ordinary.noise_figure_db),
        loss_db: loss_db.unwrap_or(ordinary.extra_loss_db),
    };
    let Some(table) = table else { return Ok(budget(None, None, None)) };
    let fixed = match table.choice("kind", &[("fixed", true), ("link_budget", false)])? {
        Some(fixed) => fixed,
        None => table.has("cn0_dbhz"),
    };
    if fixed {
        table.allow(&["kind", "cn0_dbhz", "satellites"])?;
        let cn0_dbhz = table.required("cn0_dbhz", 0.0..=100.0, "dB-Hz")?;
        let mut satellites = Vec::new();
        if let Some(each) = table.table("satellites")? {
            for name in each.names() {
                let sv = name.parse().map_err(|e| each.bad(name, e))?;
                satellites.push((sv, each.required(name, 0.0..=100.0, "dB-Hz")?));
            }
        }
        return Ok(Power::Fixed { cn0_dbhz, satellites });
    }
    table.allow(&["kind", "antenna", "noise_figure_db", "loss_db"])?;
    let antennas = [("isotropic", Antenna::Isotropic), ("patch", Antenna::Patch)];
    Ok(budget(
        table.choice("antenna", &antennas)?,
        table.number("noise_figure_db", 0.0..=30.0, "dB")?,
        table.number("loss_db", -20.0..=60.0, "dB")?,
    ))
}

fn ionosphere(table: &Table<'_>) -> Result<Ionosphere, ScenarioError> {
    table.choice("model", &[("klobuchar", ())])?.ok_or_else(|| table.bad("model", "one of klobuchar"))?;
    // Eight-bit integers times 2^-24 and 2^16 at most (IS-GPS-200N, table 20-X).
    match (table.numbers("alpha", 1e-4)?, table.numbers("beta", 1e7)?) {
        (None, None) => Ok(Ionosphere::Broadcast),
        (Some(alpha), Some(beta)) => Ok(Ionosphere::Given(Klobuchar { alpha, beta })),
        (None, _) => Err(table.bad("alpha", "four numbers, because beta is given")),
        (_, None) => Err(table.bad("beta", "four numbers, because alpha is given")),
    }
}

fn troposphere(table: &Table<'_>) -> Result<Weather, ScenarioError> {
    table.choice("model", &[("saastamoinen", ())])?.ok_or_else(|| table.bad("model", "one of saastamoinen"))?;
    let standard = Weather::STANDARD;
    let celsius = table.number("temperature_c", -90.0..=60.0, "C")?;
    Ok(Weather {
        height_m: table.number("height_m", -500.0..=9_000.0, "m")?.unwrap_or(standard.height_m),
        pressure_hpa: table.number("pressure_hpa", 1.0..=1100.0, "hPa")?.unwrap_or(standard.pressure_hpa),
        temperature_k: celsius.map_or(standard.temperature_k, |c| c + 273.15),
        relative_humidity: table
            .number("relative_humidity", 0.0..=1.0, "(a fraction)")?
            .unwrap_or(standard.relative_humidity),
    })
}

fn receiver_clock(table: Option<&Table<'_>>) -> Result<ReceiverClock, ScenarioError> {
    let Some(table) = table else { return Ok(ReceiverClock::PERFECT) };
    Ok(ReceiverClock {
        bias_s: table.number("bias_s", -1.0..=1.0, "s")?.unwrap_or(0.0),
        drift: table.number("drift_sps", -1e-4..=1e-4, "s/s")?.unwrap_or(0.0),
    })
}

/// A level's knobs, each overridden where the table names it.
fn fidelity(table: Option<&Table<'_>>, rate: Rate) -> Result<Fidelity, ScenarioError> {
    let Some(table) = table else { return Ok(Fidelity::suited(Grade::Balanced, rate.hz())) };
    let grade = table.choice("level", &Grade::NAMES)?.unwrap_or(Grade::Balanced);
    let level = Fidelity::suited(grade, rate.hz());
    Ok(Fidelity {
        grade: level.grade,
        code_edge: table.choice("code_edge", &CodeEdge::NAMES)?.unwrap_or(level.code_edge),
        carrier: table.choice("carrier", &Arithmetic::NAMES)?.unwrap_or(level.carrier),
        noise: table.choice("noise", &Arithmetic::NAMES)?.unwrap_or(level.noise),
        knot_tolerance_cycles: table
            .number("knot_tolerance_cycles", 1e-7..=0.1, "cycles")?
            .unwrap_or(level.knot_tolerance_cycles),
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
