//! `[[interference]]` and `[[spoofer]]`: what reaches the antenna besides the satellites, as written.

use std::path::PathBuf;

use super::motion::{MotionSpec, PLACE, place};
use super::read::Table;
use super::{ScenarioError, keys_of};
use crate::generator::spoof::Advantage;
use crate::gnss::earth::Geodetic;
use crate::gnss::samples::Format;
use crate::gnss::satellite::Sv;

/// Every key of `[[interference]]`; each kind knows some of them.
pub(super) const KEYS: &[&str] = &[
    "kind",
    "offset_hz",
    "js_db",
    "power_dbw",
    "eirp_dbw",
    "on_s",
    "off_s",
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "sweep_hz",
    "sweep_s",
    "deviation_hz",
    "rate_hz",
    "width_s",
    "jitter",
    "bandwidth_hz",
    "file",
    "format",
    "sample_rate_hz",
    "repeat",
];
const COMMON: [&str; 7] = ["kind", "offset_hz", "js_db", "power_dbw", "eirp_dbw", "on_s", "off_s"];
/// Keys of `[[spoofer]]`.
pub(super) const SPOOFER_KEYS: &[&str] = &[
    "power_db",
    "power_start_db",
    "ramp_s",
    "on_s",
    "off_s",
    "satellites",
    "clock_bias_s",
    "clock_drift_sps",
    "motion",
    "drag",
];
/// Keys of `[spoofer.drag]`.
pub(super) const DRAG_KEYS: &[&str] = &["start_s", "azimuth_deg", "elevation_deg", "speed_mps", "acceleration_mps2"];

/// How strong an interferer is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Over `power.cn0_dbhz`, at the antenna.
    OverSignal { db: f64 },
    /// At the antenna's port.
    Received { dbw: f64 },
    /// Radiated towards the antenna, from a place.
    Radiated { dbw: f64 },
}

/// What it sends, as written.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    Cw,
    Chirp { sweep_hz: f64, sweep_s: f64 },
    Fmcw { sweep_hz: f64, sweep_s: f64 },
    SineFm { deviation_hz: f64, rate_hz: f64 },
    Pulse { width_s: f64, rate_hz: f64, jitter: f64 },
    Matched,
    Noise { bandwidth_hz: f64 },
    Recording { path: PathBuf, format: Format, rate_hz: f64, repeat: bool },
}

impl Kind {
    /// Its name in a scenario.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cw => "cw",
            Self::Chirp { .. } => "chirp",
            Self::Fmcw { .. } => "fmcw",
            Self::SineFm { .. } => "sine_fm",
            Self::Pulse { .. } => "pulse",
            Self::Matched => "matched",
            Self::Noise { .. } => "noise",
            Self::Recording { .. } => "recording",
        }
    }
}

/// One `[[interference]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct InterferenceSpec {
    pub kind: Kind,
    /// From GPS L1.
    pub offset_hz: f64,
    pub strength: Strength,
    pub place: Option<Geodetic>,
    /// True time since the scene's start; to the scene's end if absent.
    pub on_s: f64,
    pub off_s: Option<f64>,
}

/// `[spoofer.drag]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DragSpec {
    pub start_s: f64,
    pub azimuth_rad: f64,
    pub elevation_rad: f64,
    pub speed_mps: f64,
    pub acceleration_mps2: f64,
}

/// One `[[spoofer]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct SpooferSpec {
    pub advantage: Advantage,
    pub on_s: f64,
    pub off_s: Option<f64>,
    pub satellites: Option<Vec<Sv>>,
    pub clock_bias_s: f64,
    pub clock_drift: f64,
    /// The claimed motion; absent means that of the antenna.
    pub motion: Option<MotionSpec>,
    pub drag: Option<DragSpec>,
}

pub(super) const SECONDS: std::ops::RangeInclusive<f64> = 0.0..=2_678_400.0;

/// The times between which something is on.
pub(super) fn times(table: &Table<'_>) -> Result<(f64, Option<f64>), ScenarioError> {
    let on_s = table.number("on_s", SECONDS, "s")?.unwrap_or(0.0);
    let off_s = table.number("off_s", SECONDS, "s")?;
    match off_s {
        Some(off_s) if off_s <= on_s => Err(table.bad("off_s", format!("a number from {on_s} s (on_s) upwards"))),
        _ => Ok((on_s, off_s)),
    }
}

pub(super) fn interference(table: &Table<'_>) -> Result<InterferenceSpec, ScenarioError> {
    table.allow(KEYS)?;
    let kind = kind(table)?;
    let placed = PLACE.iter().any(|key| table.has(key));
    let strengths = [
        table.number("js_db", -100.0..=120.0, "dB")?.map(|db| Strength::OverSignal { db }),
        table.number("power_dbw", -250.0..=0.0, "dBW")?.map(|dbw| Strength::Received { dbw }),
        table.number("eirp_dbw", -200.0..=60.0, "dBW")?.map(|dbw| Strength::Radiated { dbw }),
    ];
    let mut given = strengths.into_iter().flatten();
    let (Some(strength), None) = (given.next(), given.next()) else {
        return Err(table.bad("js_db", "exactly one of js_db, power_dbw and eirp_dbw"));
    };
    if matches!(strength, Strength::Radiated { .. }) && !placed {
        return Err(table.bad("eirp_dbw", "a place with it: latitude_deg, longitude_deg and height_m"));
    }
    let (on_s, off_s) = times(table)?;
    Ok(InterferenceSpec {
        kind,
        offset_hz: table.number("offset_hz", -1e8..=1e8, "Hz")?.unwrap_or(0.0),
        strength,
        place: if placed { Some(place(table)?) } else { None },
        on_s,
        off_s,
    })
}

fn kind(table: &Table<'_>) -> Result<Kind, ScenarioError> {
    let names = ["cw", "chirp", "fmcw", "sine_fm", "pulse", "matched", "noise", "recording"];
    let name = table.choice("kind", &names.map(|name| (name, name)))?;
    let allow = |own: &[&str]| table.allow(&[&COMMON, PLACE.as_slice(), own].concat());
    let sweep = || -> Result<(f64, f64), ScenarioError> {
        allow(&["sweep_hz", "sweep_s"])?;
        let sweep_hz = table.required("sweep_hz", -1e8..=1e8, "Hz")?;
        Ok((sweep_hz, table.required("sweep_s", 1e-6..=10.0, "s")?))
    };
    match name {
        Some("cw") => allow(&[]).map(|()| Kind::Cw),
        Some("chirp") => sweep().map(|(sweep_hz, sweep_s)| Kind::Chirp { sweep_hz, sweep_s }),
        Some("fmcw") => sweep().map(|(sweep_hz, sweep_s)| Kind::Fmcw { sweep_hz, sweep_s }),
        Some("sine_fm") => {
            allow(&["deviation_hz", "rate_hz"])?;
            let deviation_hz = table.required("deviation_hz", 0.0..=5e7, "Hz")?;
            Ok(Kind::SineFm { deviation_hz, rate_hz: table.required("rate_hz", 0.01..=1e6, "Hz")? })
        }
        Some("pulse") => {
            allow(&["width_s", "rate_hz", "jitter"])?;
            let width_s = table.required("width_s", 1e-8..=10.0, "s")?;
            let rate_hz = table.required("rate_hz", 0.01..=1e6, "Hz")?;
            let jitter = table.number("jitter", 0.0..=1.0, "of a period")?.unwrap_or(0.0);
            if width_s * rate_hz + jitter > 1.0 {
                let most_s = (1.0 - jitter) / rate_hz;
                return Err(table.bad("width_s", format!("at most {most_s:e} s, the period less the jitter")));
            }
            Ok(Kind::Pulse { width_s, rate_hz, jitter })
        }
        Some("matched") => allow(&[]).map(|()| Kind::Matched),
        Some("noise") => {
            allow(&["bandwidth_hz"])?;
            Ok(Kind::Noise { bandwidth_hz: table.required("bandwidth_hz", 100.0..=1e9, "Hz")? })
        }
        Some("recording") => {
            allow(&["file", "format", "sample_rate_hz", "repeat"])?;
            let expected = "one of ci8, cu8, ci16, cf32";
            let format = table.text("format", expected)?.and_then(|text| text.parse::<Format>().ok());
            Ok(Kind::Recording {
                path: PathBuf::from(table.text("file", "a path")?.ok_or_else(|| table.bad("file", "a path"))?),
                format: format.filter(|f| f.is_complex()).ok_or_else(|| table.bad("format", expected))?,
                rate_hz: table.required("sample_rate_hz", 1e3..=1e8, "Hz")?,
                repeat: table.flag("repeat")?.unwrap_or(true),
            })
        }
        _ => Err(table.bad("kind", format!("one of {}", names.join(", ")))),
    }
}

pub(super) fn spoofer(table: &Table<'_>) -> Result<SpooferSpec, ScenarioError> {
    table.allow(SPOOFER_KEYS)?;
    let (on_s, off_s) = times(table)?;
    let end_db = table.required("power_db", -60.0..=80.0, "dB")?;
    let start_db = table.number("power_start_db", -60.0..=80.0, "dB")?;
    let ramp_s = table.number("ramp_s", 0.1..=1e5, "s")?;
    if start_db.is_some() != ramp_s.is_some() {
        return Err(table.bad("ramp_s", "both or none of power_start_db and ramp_s"));
    }
    let expected = "an array of satellites like [\"G01\", \"G12\"]";
    let satellites = match table.words("satellites", expected)? {
        None => None,
        Some(words) => {
            let list: Result<Vec<Sv>, _> = words.iter().map(|word| word.parse::<Sv>()).collect();
            Some(list.ok().filter(|list| !list.is_empty()).ok_or_else(|| table.bad("satellites", expected))?)
        }
    };
    let motion = table.table("motion")?;
    let motion = motion.map(|motion| motion.allow(keys_of("motion")).and_then(|()| MotionSpec::read(&motion)));
    Ok(SpooferSpec {
        advantage: Advantage { start_db: start_db.unwrap_or(end_db), end_db, ramp_s: ramp_s.unwrap_or(0.0) },
        on_s,
        off_s,
        satellites,
        clock_bias_s: table.number("clock_bias_s", -1.0..=1.0, "s")?.unwrap_or(0.0),
        clock_drift: table.number("clock_drift_sps", -1e-5..=1e-5, "s/s")?.unwrap_or(0.0),
        motion: motion.transpose()?,
        drag: table.table("drag")?.map(|drag| read_drag(&drag)).transpose()?,
    })
}

fn read_drag(table: &Table<'_>) -> Result<DragSpec, ScenarioError> {
    table.allow(DRAG_KEYS)?;
    Ok(DragSpec {
        start_s: table.required("start_s", SECONDS, "s")?,
        azimuth_rad: table.required("azimuth_deg", -360.0..=360.0, "deg")?.to_radians(),
        elevation_rad: table.number("elevation_deg", -90.0..=90.0, "deg")?.unwrap_or(0.0).to_radians(),
        speed_mps: table.required("speed_mps", 0.001..=1e4, "m/s")?,
        acceleration_mps2: table.number("acceleration_mps2", 0.001..=1e4, "m/s2")?.unwrap_or(1.0),
    })
}
