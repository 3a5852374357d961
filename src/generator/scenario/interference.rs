//! Tables `[[interference]]` and `[[spoofer]]` as written: waves that reach the antenna besides the
//! satellites.

use std::path::PathBuf;

use super::keys::motion::PLACE_IF_ANY;
use super::motion::{MotionSpec, place};
use super::osnma::{Spoofed, spoofed};
use super::read::Table;
use super::{ScenarioError, moved_to, satellite_list};
use crate::spoof::Advantage;
use gnss::earth::Geodetic;
use gnss::gps::l1ca::L1_CA;
use gnss::samples::Format;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Strength of an interferer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Power relative to the satellites at the antenna. The reference is `power.cn0_dbhz`, or with a link
    /// budget the strongest satellite at the scene's start.
    OverSignal {
        /// Power over the strongest satellite's.
        db: f64,
    },
    /// Power at the antenna's port.
    Received {
        /// Power in dBW.
        dbw: f64,
    },
    /// Radiated towards the antenna, from the source's position, or from a distance that stays.
    Radiated {
        /// Power in dBW.
        dbw: f64,
        /// Distance from the antenna; absent where the source has a position.
        distance_m: Option<f64>,
    },
}

impl Strength {
    /// Key of the strength in a scenario.
    pub fn key(&self) -> &'static str {
        match self {
            Self::OverSignal { .. } => "js_db",
            Self::Received { .. } => "power_dbw",
            Self::Radiated { .. } => "eirp_dbw",
        }
    }
}

/// Waveform of an interferer, as written.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A continuous wave.
    Cw,
    /// A frequency that rises linearly and jumps back.
    Chirp {
        /// Width of the sweep, in Hz.
        sweep_hz: f64,
        /// Period of the sweep, in seconds.
        sweep_s: f64,
    },
    /// A frequency that rises and falls linearly.
    Fmcw {
        /// Width of the sweep, in Hz.
        sweep_hz: f64,
        /// Period of the sweep, in seconds.
        sweep_s: f64,
    },
    /// A frequency that follows a cosine.
    SineFm {
        /// Largest deviation from the carrier, in Hz.
        deviation_hz: f64,
        /// Periods a second.
        rate_hz: f64,
    },
    /// A carrier that is on for short times.
    Pulse {
        /// Length of a pulse, in seconds.
        width_s: f64,
        /// Pulses a second.
        rate_hz: f64,
        /// Largest delay of a pulse, as a share of the period.
        jitter: f64,
    },
    /// Random chips at the rate of the signal's code.
    Matched,
    /// Gaussian noise of a band.
    Noise {
        /// Width of the band, in Hz.
        bandwidth_hz: f64,
    },
    /// Samples of a file.
    Recording {
        /// The file.
        path: PathBuf,
        /// Packing of the file's samples.
        format: Format,
        /// Sample rate of the file, in Hz.
        rate_hz: f64,
        /// True if the file restarts at its end.
        repeat: bool,
    },
}

impl Kind {
    /// Name of the waveform in a scenario.
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
    /// Waveform of the source.
    pub kind: Kind,
    /// Radio frequency of the centre, in Hz.
    pub center_hz: f64,
    /// Strength of the source.
    pub strength: Strength,
    /// Position of the source; absent for a source without one.
    pub place: Option<Geodetic>,
    /// True time since the scene's start; to the scene's end if absent.
    pub on_s: f64,
    /// Time of switching off, in seconds; absent means never.
    pub off_s: Option<f64>,
}

/// `[spoofer.drag]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DragSpec {
    /// Start of the drag, in true seconds since the scene's start.
    pub start_s: f64,
    /// Azimuth of the drag's direction in radians, clockwise from north.
    pub azimuth_rad: f64,
    /// Elevation of the drag's direction in radians, positive upwards.
    pub elevation_rad: f64,
    /// Final speed, in m/s.
    pub speed_mps: f64,
    /// Acceleration until that speed, in m/s².
    pub acceleration_mps2: f64,
}

/// One `[[spoofer]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct SpooferSpec {
    /// Power advantage over the true signals.
    pub advantage: Advantage,
    /// Time of switching on, in true seconds since the scene's start.
    pub on_s: f64,
    /// Time of switching off, in seconds; absent means never.
    pub off_s: Option<f64>,
    /// Satellites that it imitates; absent means all in view of the claimed position.
    pub satellites: Option<Vec<Sv>>,
    /// Clock minus GPS time at the scene's start, in seconds.
    pub clock_bias_s: f64,
    /// Gain of its clock, in seconds per second.
    pub clock_drift: f64,
    /// Seconds by which its time and its messages lie behind the true ones.
    pub replay_s: f64,
    /// Whole seconds by which the time that it claims is ahead of the true one.
    pub ahead_s: i64,
    /// Navigation files of its own; empty means the scene's.
    pub navigation: Vec<PathBuf>,
    /// Day to which they are moved.
    pub moved_to: Option<Epoch>,
    /// GPS time minus UTC in its messages, in seconds; absent means the true number.
    pub leap_s: Option<i64>,
    /// Authentication in its messages.
    pub osnma: Spoofed,
    /// Claimed motion; absent means that of the antenna.
    pub motion: Option<MotionSpec>,
    /// Drag of the claimed position; absent means that it stays.
    pub drag: Option<DragSpec>,
    /// Position from which its signals come; absent means that they have no direction.
    pub transmitter: Option<Geodetic>,
}

/// The times between which something is on.
pub(super) fn times(table: &Table<'_>) -> Result<(f64, Option<f64>), ScenarioError> {
    let on_s = table.need("on_s")?;
    let off_s = table.number("off_s")?;
    match off_s {
        Some(off_s) if off_s <= on_s => Err(table.bad("off_s", format!("a number from {on_s} s (on_s) upwards"))),
        _ => Ok((on_s, off_s)),
    }
}

pub(super) fn interference(table: &Table<'_>) -> Result<InterferenceSpec, ScenarioError> {
    let kind = kind(table)?;
    let placed = PLACE_IF_ANY.iter().any(|key| table.has(key.name));
    let strength = strength(table, placed)?;
    let (on_s, off_s) = times(table)?;
    Ok(InterferenceSpec {
        kind,
        center_hz: center_hz(table)?,
        strength,
        place: if placed { Some(place(table)?) } else { None },
        on_s,
        off_s,
    })
}

/// Radio frequency of a source's centre, in Hz: as written, or by its offset from GPS L1.
fn center_hz(table: &Table<'_>) -> Result<f64, ScenarioError> {
    match table.number("center_hz")? {
        Some(_) if table.has("offset_hz") => {
            Err(table.bad("offset_hz", "nothing beside center_hz, which is the radio frequency of the centre"))
        }
        Some(center_hz) => Ok(center_hz),
        None => Ok(L1_CA.centre_hz() + table.need("offset_hz")?),
    }
}

/// Reads the one of three keys that states the strength of the source.
fn strength(table: &Table<'_>, placed: bool) -> Result<Strength, ScenarioError> {
    const ONE: &str = "exactly one of js_db, power_dbw and eirp_dbw";
    let distance_m = table.number("distance_m")?;
    let strengths = [
        table.number("js_db")?.map(|db| Strength::OverSignal { db }),
        table.number("power_dbw")?.map(|dbw| Strength::Received { dbw }),
        table.number("eirp_dbw")?.map(|dbw| Strength::Radiated { dbw, distance_m }),
    ];
    let mut given = strengths.into_iter().flatten();
    let Some(strength) = given.next() else { return Err(table.bad("js_db", ONE)) };
    let first = strength.key();
    if let Some(second) = given.next() {
        return Err(table.bad(second.key(), format!("nothing, because {first} is given: {ONE}")));
    }
    match (strength, distance_m, placed) {
        (Strength::Radiated { distance_m: None, .. }, _, false) => {
            Err(table.bad("eirp_dbw", "a position with it (latitude_deg, longitude_deg and height_m), or distance_m"))
        }
        (_, Some(_), true) => Err(table.bad("distance_m", "nothing, because a position is given")),
        (Strength::OverSignal { .. } | Strength::Received { .. }, Some(_), _) => {
            Err(table.bad("distance_m", format!("nothing with {first}: only eirp_dbw needs it")))
        }
        _ => Ok(strength),
    }
}

fn kind(table: &Table<'_>) -> Result<Kind, ScenarioError> {
    let names = super::keys::spoofing_and_jamming::kinds();
    let names: Vec<(&str, &str)> = names.into_iter().map(|name| (name, name)).collect();
    let sweep = || -> Result<(f64, f64), ScenarioError> {
        let sweep_hz = table.need("sweep_hz")?;
        Ok((sweep_hz, table.need("sweep_s")?))
    };
    match table.need_choice("kind", &names)? {
        "cw" => Ok(Kind::Cw),
        "chirp" => sweep().map(|(sweep_hz, sweep_s)| Kind::Chirp { sweep_hz, sweep_s }),
        "fmcw" => sweep().map(|(sweep_hz, sweep_s)| Kind::Fmcw { sweep_hz, sweep_s }),
        "sine_fm" => {
            let deviation_hz = table.need("deviation_hz")?;
            Ok(Kind::SineFm { deviation_hz, rate_hz: table.need("rate_hz")? })
        }
        "pulse" => {
            let width_s = table.need("width_s")?;
            let rate_hz = table.need("rate_hz")?;
            let jitter = table.need("jitter")?;
            if width_s * rate_hz + jitter > 1.0 {
                let most_s = (1.0 - jitter) / rate_hz;
                return Err(table.bad("width_s", format!("at most {most_s:e} s, the period less the jitter")));
            }
            Ok(Kind::Pulse { width_s, rate_hz, jitter })
        }
        "matched" => Ok(Kind::Matched),
        "noise" => Ok(Kind::Noise { bandwidth_hz: table.need("bandwidth_hz")? }),
        _ => {
            let format = table.need_text("format")?.parse::<Format>().ok();
            Ok(Kind::Recording {
                path: PathBuf::from(table.need_text("file")?),
                format: format
                    .filter(|f| f.is_complex())
                    .ok_or_else(|| table.bad("format", "one of ci8, cu8, ci16, cf32"))?,
                rate_hz: table.need("sample_rate_hz")?,
                repeat: table.flag("repeat")?.unwrap_or(true),
            })
        }
    }
}

pub(super) fn spoofer(table: &Table<'_>) -> Result<SpooferSpec, ScenarioError> {
    let (on_s, off_s) = times(table)?;
    let end_db = table.need("power_db")?;
    let start_db = table.number("power_start_db")?;
    let ramp_s = table.number("ramp_s")?;
    if start_db.is_some() != ramp_s.is_some() {
        return Err(table.bad("ramp_s", "both or none of power_start_db and ramp_s"));
    }
    let satellites = satellite_list(table, "satellites")?;
    if satellites.as_ref().is_some_and(Vec::is_empty) {
        return Err(table.bad("satellites", "an array of satellites like [\"G01\", \"G12\"]"));
    }
    let whole = |key: &str, value: f64| match value.fract() {
        0.0 => Ok(value as i64),
        _ => Err(table.bad(key, "a whole number of seconds")),
    };
    let ahead_s = whole("time_offset_s", table.need("time_offset_s")?)?;
    if ahead_s != 0 && table.need("replay_s")? > 0.0 {
        return Err(table.bad("time_offset_s", "0, because replay_s is given: a replay has the time of its recording"));
    }
    let leap_s = table.number("leap_seconds")?.map(|value| whole("leap_seconds", value)).transpose()?;
    let files = table.texts("navigation")?.unwrap_or_default();
    let motion = table.table("motion")?;
    let motion = motion.map(|motion| MotionSpec::read(&motion));
    Ok(SpooferSpec {
        advantage: Advantage { start_db: start_db.unwrap_or(end_db), end_db, ramp_s: ramp_s.unwrap_or(0.0) },
        on_s,
        off_s,
        satellites,
        clock_bias_s: table.need("clock_bias_s")?,
        clock_drift: table.need("clock_drift_sps")?,
        replay_s: table.need("replay_s")?,
        ahead_s,
        navigation: files.into_iter().map(PathBuf::from).collect(),
        moved_to: moved_to(table, "navigation_moved_to")?,
        leap_s,
        osnma: spoofed(table)?,
        motion: motion.transpose()?,
        drag: table.table("drag")?.map(|drag| read_drag(&drag)).transpose()?,
        transmitter: table.table("transmitter")?.map(|table| place(&table)).transpose()?,
    })
}

fn read_drag(table: &Table<'_>) -> Result<DragSpec, ScenarioError> {
    Ok(DragSpec {
        start_s: table.need("start_s")?,
        azimuth_rad: table.need("azimuth_deg")?.to_radians(),
        elevation_rad: table.need("elevation_deg")?.to_radians(),
        speed_mps: table.need("speed_mps")?,
        acceleration_mps2: table.need("acceleration_mps2")?,
    })
}
