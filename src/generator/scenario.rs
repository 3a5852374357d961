//! Scenario as written: TOML in which a table is present only if the scene has the feature.
//!
//! [`Scenario::parse`] holds each key and each value against its declaration ([`keys::SCENARIO`]) and
//! collects what is wrong; [`Scenario::compose`] checks what concerns several of them, loads files and makes
//! a [`Scene`](crate::scene::Scene). Units are in the names of the keys: degrees and dB here,
//! radians and ratios from here on. `[receiver]` is kept as written for the receiver's own settings.

mod array;
mod attitude;
mod augmentation;
mod band;
mod builder;
mod city;
mod compose;
mod expect;
mod fidelity;
mod files;
mod front_end;
mod hardware;
mod inertial;
pub mod interference;
pub mod keys;
mod link;
mod motion;
mod multipath;
mod obstruction;
mod osnma;
mod own_sky;
mod parts;
mod propagation;
mod pushed;
pub mod read;
mod receiver;
mod satellite;
pub mod schema;
mod scintillation;
mod signal_file;
mod spoofing_and_jamming;
mod stages;
mod station;
#[cfg(test)]
mod tests;
mod trajectory;

use std::io::Read;
use std::path::{Path, PathBuf};

use thiserror::Error;
use toml::de::DeTable;

pub use array::ElementSpec;
pub use augmentation::SbasSpec;
pub use builder::{Builder, put};
pub use city::CitySpec;
pub use compose::Overrides;
use files::Files;
pub use front_end::{FrontEnd, Tuned};
pub use hardware::ClockSpec;
pub use interference::{InterferenceSpec, SpooferSpec};
pub use link::{AntennaSpec, Power, Transmit};
pub use motion::{FileKind, MotionSpec};
pub use osnma::{OsnmaSpec, Spoofed};
pub use propagation::{Electrons, Ionosphere, MappingKind, NeutralAtmosphere};
pub use read::Place;
use read::{Refusals, Source, Table};
pub use satellite::{MessageKind, MessageSpec, OrbitsSpec, SatelliteFault};
pub use signal_file::described_signal;
use stages::PlaybackSpec;
pub use station::text_of as text_of_station;

use crate::effect::multipath::Echo;
use crate::effect::obstruction::Obstacle;
use crate::fast_phase::scintillation::Strength;
use crate::fidelity::allowed_m;
use crate::vehicle::attitude::Attitude;
use gnss::facts::{Expect, InertialFacts};
use gnss::place::hint;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Elevation mask in degrees if `[satellites]` is absent. A test compares the constants with the declared
/// defaults.
const MASK_DEG: f64 = 5.0;
const TRUTH_INTERVAL_S: f64 = 0.1;
/// Largest scenario text that is read.
const MAX_BYTES: usize = 1 << 20;

/// Reason for which a scenario is refused.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// A text that is no TOML, or cannot be read at all.
    #[error("{place}: {message}")]
    Toml {
        /// Position in the text.
        place: Place,
        /// Message of the parser.
        message: String,
    },
    /// A key that no table has.
    #[error("{place}: unknown key '{key}'{}; known here: {known}", hint(key, nearest.as_deref()))]
    UnknownKey {
        /// Position in the text.
        place: Place,
        /// The key, with the tables that it is in.
        key: String,
        /// The known key that is spelled most alike.
        nearest: Option<String>,
        /// The keys that the table has.
        known: String,
    },
    /// A value out of its range or of another type.
    #[error("{place}: {key} = {value}: expected {expected}")]
    Value {
        /// Position in the text.
        place: Place,
        /// The key, with the tables that it is in.
        key: String,
        /// The value as written.
        value: String,
        /// Values that are expected.
        expected: String,
    },
    /// Things that cannot be together.
    #[error("{origin}: {key}: {reason}")]
    Conflict {
        /// Path of the scenario, for error messages.
        origin: String,
        /// The key that is at fault.
        key: &'static str,
        /// Description of the error.
        reason: String,
    },
    /// A file that the scenario names and that cannot be used.
    #[error("{origin}: {key} = {path:?}: {reason}")]
    File {
        /// Path of the scenario, for error messages.
        origin: String,
        /// The key that names it.
        key: &'static str,
        /// The file as written.
        path: PathBuf,
        /// Description of the error.
        reason: String,
    },
    /// A file that the scenario names and that cannot be read.
    #[error("{origin}: {key} = {path:?}: cannot be read: {error}")]
    Read {
        /// Path of the scenario, for error messages.
        origin: String,
        /// The key that names it.
        key: &'static str,
        /// The file as written.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// A scenario that [`Scenario::open`] cannot read.
    #[error("{}: cannot be read: {error}", path.display())]
    Open {
        /// The scenario.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// All that is wrong, in the order of the text: two at least.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<ScenarioError>),
}

impl ScenarioError {
    /// The message without its position, for a document that is in no file as it was read.
    pub fn without_place(&self) -> String {
        let whole = self.to_string();
        let place = match self {
            Self::Toml { place, .. } | Self::UnknownKey { place, .. } | Self::Value { place, .. } => place.to_string(),
            Self::Conflict { origin, .. } | Self::File { origin, .. } | Self::Read { origin, .. } => origin.clone(),
            Self::Open { path, .. } => path.display().to_string(),
            Self::Several(errors) => return errors.iter().map(Self::without_place).collect::<Vec<_>>().join("; "),
        };
        whole.strip_prefix(&format!("{place}: ")).map_or(whole.clone(), str::to_owned)
    }

    /// Returns the position in the text, if the error has one.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Self::Toml { place, .. } | Self::UnknownKey { place, .. } | Self::Value { place, .. } => Some(place),
            _ => None,
        }
    }

    /// The key and its position, if it is about one.
    fn key_at(&self) -> Option<(&Place, &str)> {
        match self {
            Self::UnknownKey { place, key, .. } | Self::Value { place, key, .. } => Some((place, key)),
            _ => None,
        }
    }

    /// Lists the single errors.
    pub fn each(&self) -> &[Self] {
        match self {
            Self::Several(errors) => errors,
            one => std::slice::from_ref(one),
        }
    }
}

/// Scenario in which every value is within its range. What is absent is `None`, and is not in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Path of the scenario, for error messages.
    pub origin: String,
    /// Directory in which [`Scenario::scene`] looks for the files that the scenario names.
    pub directory: PathBuf,
    /// Name of the scene: letters, digits, '-' and '_'.
    pub name: String,
    /// Time of sample 0 by the receiver's clock, from which the scene's true time also counts.
    pub start: Epoch,
    /// Length of the scene by the receiver's clock, in seconds.
    pub duration_s: f64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Name of the station whose scenario this is; absent where the scene has no stations.
    pub station: Option<String>,
    /// Scenarios of the stations, if there are several. The other fields are then those of the first.
    pub stations: Vec<Scenario>,
    /// Signals that satellites send.
    pub signals: Vec<&'static Signal>,
    /// Navigation files, relative to the scenario's directory; empty means the embedded file.
    pub navigation: Vec<PathBuf>,
    /// Day to which the first day of the files is moved; absent leaves them as they are.
    pub moved_to: Option<Epoch>,
    /// Offset of Galileo's time ahead of GPS time, in seconds. Absent means the value of the navigation file,
    /// or zero.
    pub galileo_ahead_s: Option<f64>,
    /// Elevation mask in radians.
    pub mask_rad: f64,
    /// Satellites that alone are computed; absent means all of the navigation files.
    pub only: Option<Vec<Sv>>,
    /// Satellites that are left out.
    pub excluded: Vec<Sv>,
    /// True if satellites that report themselves unhealthy are transmitted too.
    pub include_unhealthy: bool,
    /// True orbits and clocks; absent means the broadcast ones.
    pub orbits: Option<OrbitsSpec>,
    /// Content of augmentation messages about other satellites; absent means none.
    pub sbas: Option<SbasSpec>,
    /// Authentication of Galileo's messages; absent means zeros in its bits.
    pub osnma: Option<OsnmaSpec>,
    /// Faults of satellites' clocks and orbits.
    pub satellite_faults: Vec<SatelliteFault>,
    /// Faults of navigation messages.
    pub message_faults: Vec<MessageSpec>,
    /// Motion of the antenna.
    pub motion: MotionSpec,
    /// Attitude of the body that carries the antenna; absent means an antenna that points up.
    pub attitude: Option<Attitude>,
    /// Elements of an array on that body; absent means one antenna.
    pub array: Option<Vec<ElementSpec>>,
    /// Inertial sensors on that body; absent means none.
    pub imu: Option<InertialFacts>,
    /// One at least; one for each element of an array.
    pub front_ends: Vec<FrontEnd>,
    /// Power of the signals.
    pub power: Power,
    /// Reflections.
    pub multipath: Vec<Echo>,
    /// Ionosphere; absent means none.
    pub ionosphere: Option<Ionosphere>,
    /// Troposphere; absent means none.
    pub troposphere: Option<NeutralAtmosphere>,
    /// Obstructions. Buildings are measured from the position where the motion starts.
    pub obstacles: Vec<Obstacle>,
    /// Scintillation; absent means none.
    pub scintillation: Option<Strength>,
    /// Walls and roofs; absent means none.
    pub city: Option<CitySpec>,
    /// The receiver's clock.
    pub receiver_clock: ClockSpec,
    /// True if there is thermal noise.
    pub noise: bool,
    /// Playback of a scene with one front end.
    pub playback: Option<PlaybackSpec>,
    /// Sources of interference.
    pub interference: Vec<InterferenceSpec>,
    /// Spoofers.
    pub spoofers: Vec<SpooferSpec>,
    /// Interval of the truth's ticks, in seconds.
    pub truth_interval_s: f64,
    /// Expectations about a receiver, for the judge.
    pub expect: Expect,
    /// Settings for the receiver's own parser.
    pub receiver: Option<toml::Table>,
}

impl Scenario {
    /// Reads a scenario from a text; files that it names are relative to the working directory.
    ///
    /// # Errors
    /// Errors of [`Scenario::parse`].
    pub fn from_toml(text: &str) -> Result<Self, ScenarioError> {
        Self::parse(text, "scenario")
    }

    /// Reads a scenario from a file; files that it names are relative to its directory.
    ///
    /// # Errors
    /// [`ScenarioError::Open`], and those of [`Scenario::parse`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, ScenarioError> {
        let path = path.as_ref();
        let mut text = String::new();
        // A byte more than is read, so that a longer text is refused as such.
        std::fs::File::open(path)
            .and_then(|file| file.take(MAX_BYTES as u64 + 1).read_to_string(&mut text))
            .map_err(|error| ScenarioError::Open { path: path.to_owned(), error })?;
        let directory = path.parent().unwrap_or(Path::new(".")).to_owned();
        Self::parse_in(&text, &path.display().to_string(), &directory, false)
    }

    /// Reads a scenario; `origin` names it in errors. Files that it names are relative to the working
    /// directory.
    ///
    /// # Errors
    /// Errors of [`Scenario::parse_in`].
    pub fn parse(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        Self::parse_in(text, origin, Path::new("."), false)
    }

    /// Reads a scenario whose files are relative to `directory`; `origin` names it in errors. Files that
    /// describe signals are read at once, and outside of the directory only if `allow_outside` is true.
    ///
    /// # Errors
    /// All that is wrong with the text, as [`ScenarioError::Several`] where that is more than one thing.
    pub fn parse_in(text: &str, origin: &str, directory: &Path, allow_outside: bool) -> Result<Self, ScenarioError> {
        let source = Source { origin, text };
        let document = signal_file::parsed(&source)?;
        let of = |document: &DeTable<'_>| Self::of_document(&source, document, (directory, allow_outside));
        station::scenario(&source, document.get_ref(), of)
    }

    /// Reads a document of that text; files are below a directory, or outside of it where that is allowed.
    fn of_document(source: &Source<'_>, document: &DeTable<'_>, files: (&Path, bool)) -> Result<Self, ScenarioError> {
        let (&Source { origin, text }, (directory, allow_outside)) = (source, files);
        let root = Table::new(source, "", 0, document, keys::SCENARIO);
        let mut refusals = Refusals::default();
        root.check(&mut refusals);
        let receiver = refusals.take(receiver::receiver(&root, text).map_err(|e| source.refused(&e))).flatten();
        let overrides = Overrides { allow_outside, ..Overrides::default() };
        // Signals of a file that is refused would be unknown.
        let described = signal_file::read(&root, origin, Files { directory, overrides: &overrides });
        let scenario = refusals.take(described).and_then(|()| Self::read(&root, &mut refusals));
        refusals.finish()?;
        scenario
            .map(|scenario| Self { origin: origin.to_owned(), directory: directory.to_owned(), receiver, ..scenario })
            .ok_or_else(|| ScenarioError::Toml { place: source.place(0), message: "cannot be read".to_owned() })
    }

    /// Reads every table, and goes on where one is refused; `None` where a scene has no sense without it.
    fn read(root: &Table<'_>, refusals: &mut Refusals) -> Option<Self> {
        let mut open = |name: &'static str| refusals.take(root.table(name)).flatten();
        let [navigation, of_satellites, orbits, sbas, osnma, motion, attitude, power] =
            ["navigation", "satellites", "orbits", "sbas", "osnma", "motion", "attitude", "power"].map(&mut open);
        let [ionosphere, troposphere, scintillation, receiver_clock, noise, truth, playback, expect] =
            ["ionosphere", "troposphere", "scintillation", "receiver_clock", "noise", "truth", "playback", "expect"]
                .map(&mut open);

        let name = refusals.take(name(root));
        let start = refusals.take(start(root));
        let duration_s = refusals.take(root.need("duration_s"));
        let seed = refusals.take(root.need_integer("seed"));
        let signals = refusals.take(signals(root));
        let ahead_ns = navigation.as_ref().map(|t| t.number("galileo_ahead_ns")).transpose();
        let ahead_ns = refusals.take(ahead_ns);
        let moved_to = navigation.as_ref().map(|t| moved_to(t, "moved_to")).transpose();
        let moved_to = refusals.take(moved_to).flatten().flatten();
        let files = navigation.map(|t| t.texts("file")).transpose();
        let files = refusals.take(files).flatten().flatten().unwrap_or_default();
        let chosen = refusals.take(satellites(of_satellites.as_ref()));
        // Its absence is refused by now.
        let motion = motion.and_then(|t| refusals.take(MotionSpec::read(&t)));
        let power = refusals.take(link::power(power.as_ref()));
        let clock = refusals.take(hardware::receiver_clock(receiver_clock.as_ref()));
        let sbas = refusals.take(sbas.map(|t| augmentation::sbas(&t)).transpose());
        let osnma = refusals.take(osnma.map(|t| osnma::osnma(&t)).transpose());
        let orbits = refusals.take(orbits.map(|t| satellite::orbits(&t)).transpose());
        let attitude = refusals.take(attitude.map(|t| attitude::attitude(&t)).transpose());
        let ionosphere = refusals.take(ionosphere.map(|t| propagation::ionosphere(&t)).transpose());
        let troposphere = refusals.take(troposphere.map(|t| propagation::troposphere(&t)).transpose());
        let scintillation = refusals.take(scintillation.map(|t| scintillation::scintillation(&t)).transpose());
        let interval_s = truth.map_or(Ok(TRUTH_INTERVAL_S), |t| t.need("interval_s"));
        let truth_interval_s = refusals.take(interval_s);
        let satellite_faults = each(root, "satellite_fault", satellite::satellite_fault, refusals);
        let message_faults = each(root, "message_fault", satellite::message_fault, refusals);
        let multipath = each(root, "multipath", multipath::echo, refusals);
        refusals.take(multipath::count(root, &multipath));
        let obstacles = each(root, "obstruction", obstruction::obstacle, refusals);
        let city = refusals.take(root.table("city")).flatten();
        let city = refusals.take(city.map(|t| city::city(&t)).transpose());
        let interference = each(root, "interference", interference::interference, refusals);
        let spoofers = each(root, "spoofer", interference::spoofer, refusals);
        let expect = expect.map(|t| expect::expect(&t, duration_s.unwrap_or(f64::INFINITY))).transpose();
        let expect = refusals.take(expect);
        let noise = noise.is_some();
        let allowed_m = allowed_m(power.as_ref().filter(|_| noise).map(Power::strongest_dbhz));
        let front_ends = front_end::front_ends(root, allowed_m, refusals);
        let (array, front_ends) = array::array(root, front_ends, refusals);
        let imu = refusals.take(root.table("imu")).flatten();
        let imu = refusals.take(imu.map(|t| inertial::imu(root, &t)).transpose());
        let playback = refusals.take(playback.map(|t| stages::playback(&t)).transpose()).flatten();
        let Choice { mask_rad, only, excluded, include_unhealthy } = chosen?;
        Some(Self {
            origin: String::new(),
            directory: PathBuf::from("."),
            name: name?,
            start: start?,
            duration_s: duration_s?,
            seed: seed?,
            station: None,
            stations: Vec::new(),
            signals: signals?,
            navigation: files.iter().map(PathBuf::from).collect(),
            moved_to,
            galileo_ahead_s: ahead_ns?.flatten().map(|ns: f64| ns * 1e-9),
            mask_rad,
            only,
            excluded,
            include_unhealthy,
            orbits: orbits?,
            sbas: sbas?,
            osnma: osnma?,
            satellite_faults,
            message_faults,
            motion: motion?,
            attitude: attitude?,
            array,
            imu: imu?,
            city: city?,
            front_ends: front_ends?,
            power: power?,
            multipath,
            ionosphere: ionosphere?,
            troposphere: troposphere?,
            obstacles,
            scintillation: scintillation?,
            receiver_clock: clock?,
            noise,
            playback,
            interference,
            spoofers,
            truth_interval_s: truth_interval_s?,
            expect: expect?.unwrap_or_default(),
            receiver: None,
        })
    }
}

/// Every table of an array of tables that is not refused.
fn each<T>(
    root: &Table<'_>,
    name: &str,
    read: impl Fn(&Table<'_>) -> Result<T, ScenarioError>,
    refusals: &mut Refusals,
) -> Vec<T> {
    let tables = refusals.take(root.tables(name)).flatten().unwrap_or_default();
    tables.iter().filter_map(|table| refusals.take(read(table))).collect()
}

fn start(root: &Table<'_>) -> Result<Epoch, ScenarioError> {
    let text = root.instant("start")?.ok_or_else(|| root.bad("start", "GPS time like \"2010-07-01T08:12:30\""))?;
    Epoch::parse(&text).map_err(|e| root.bad("start", e))
}

/// A day alone, or a time in it.
/// Day to which navigation files are moved, by its key.
fn moved_to(table: &Table<'_>, key: &str) -> Result<Option<Epoch>, ScenarioError> {
    let Some(text) = table.instant(key)? else { return Ok(None) };
    let whole = if text.contains(['T', ' ']) { text } else { format!("{text}T00:00:00") };
    Epoch::parse(&whole).map(Some).map_err(|e| table.bad(key, e))
}

fn name(root: &Table<'_>) -> Result<String, ScenarioError> {
    let expected = "1 to 64 letters, digits, '-' and '_' (it names a directory)";
    let name = root.need_text("name")?;
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.len() <= 64 && name.chars().all(fits) { Ok(name.to_owned()) } else { Err(root.bad("name", expected)) }
}

fn signals(root: &Table<'_>) -> Result<Vec<&'static Signal>, ScenarioError> {
    let signals = signal_list(root, "signals")?.unwrap_or_else(|| vec![&gnss::gps::l1ca::L1_CA]);
    let sides =
        |whole: &'static Signal| signals.iter().filter(|side| whole.has_side(side)).map(move |side| (whole, *side));
    match signals.iter().copied().find_map(|whole| sides(whole).next()) {
        Some((whole, side)) => Err(root.bad("signals", format!("{whole} or {side}, which is a part of it, not both"))),
        None => Ok(signals),
    }
}

/// An array of different signals.
fn signal_list(table: &Table<'_>, key: &str) -> Result<Option<Vec<&'static Signal>>, ScenarioError> {
    let expected = keys::signals_expected();
    let Some(words) = table.words(key, &expected)? else { return Ok(None) };
    let mut signals: Vec<&'static Signal> = Vec::new();
    for word in words {
        match Signal::find(word) {
            Some(signal) if !signals.contains(&signal) => signals.push(signal),
            Some(_) => return Err(table.bad(key, expected)),
            None => return Err(table.bad(key, expected + &Signal::suggestion(word))),
        }
    }
    if signals.is_empty() { Err(table.bad(key, expected)) } else { Ok(Some(signals)) }
}

/// `[satellites]`: the satellites that are computed.
struct Choice {
    mask_rad: f64,
    only: Option<Vec<Sv>>,
    excluded: Vec<Sv>,
    include_unhealthy: bool,
}

fn satellites(table: Option<&Table<'_>>) -> Result<Choice, ScenarioError> {
    let Some(table) = table else {
        let mask_rad = MASK_DEG.to_radians();
        return Ok(Choice { mask_rad, only: None, excluded: Vec::new(), include_unhealthy: false });
    };
    let mask_rad = table.need("mask_deg")?.to_radians();
    let only = satellite_list(table, "only")?;
    let excluded = satellite_list(table, "exclude")?.unwrap_or_default();
    match &only {
        Some(only) if only.is_empty() => return Err(table.bad("only", "at least one satellite")),
        Some(_) if table.has("exclude") => {
            return Err(table.bad("exclude", "nothing beside only, which names all that are computed"));
        }
        _ => {}
    }
    Ok(Choice { mask_rad, only, excluded, include_unhealthy: table.flag("include_unhealthy")?.unwrap_or(false) })
}

/// An array of satellites.
fn satellite_list(table: &Table<'_>, key: &str) -> Result<Option<Vec<Sv>>, ScenarioError> {
    let expected = "an array of satellites like [\"G01\", \"G12\"]";
    let Some(words) = table.words(key, expected)? else { return Ok(None) };
    let satellites: Result<Vec<Sv>, _> = words.iter().map(|word| word.parse::<Sv>()).collect();
    satellites.map(Some).map_err(|_| table.bad(key, expected))
}
