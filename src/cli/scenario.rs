//! Finding the scene that the user named.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use crate::cli::error::{CliError, escaped, shown};
use crate::cli::scenes;
use generator::scenario::{Overrides, Scenario, ScenarioError, described_signal, text_of_station};
use generator::scene::Scene;
use receiver::settings::{Settings, SettingsError};

/// The scene that runs when none is named.
const EMBEDDED: &str = include_str!("../../scenarios/two_systems.toml");

/// Largest scenario, limits, settings or metadata that is read.
pub const LARGEST_BYTES: u64 = 4 << 20;

/// A scenario as written, and the directory that its paths are relative to.
#[derive(Clone)]
pub struct Named {
    pub scenario: Scenario,
    /// Text of the scenario.
    pub text: String,
    /// Name of the scenario in messages.
    pub name: String,
    pub directory: PathBuf,
}

impl Named {
    /// The scenario with the front end of that name alone, if there is a name.
    pub fn choose(self, front_end: Option<&str>) -> Result<Self, CliError> {
        let Some(name) = front_end else { return Ok(self) };
        let known = self.scenario.front_end_names();
        let known = if known.is_empty() { "its one has no name".to_owned() } else { known.join(", ") };
        let refuse = |_| CliError::usage(format!("--front-end {name}: {}: expected one of {known}", self.name));
        let scenario = self.scenario.with_front_end(name).map_err(refuse)?;
        Ok(Self { scenario, ..self })
    }
}

impl Named {
    /// The scenario of the station of that name, if there is a name. Its text is that of the station alone.
    pub fn at_station(self, station: Option<&str>) -> Result<Self, CliError> {
        let Some(name) = station else { return Ok(self) };
        let known = self.scenario.station_names();
        let known = if known.is_empty() { "it has no [[station]]".to_owned() } else { known.join(", ") };
        let refuse = |_| CliError::usage(format!("--station {name}: {}: expected one of {known}", self.name));
        let scenario = self.scenario.with_station(name).map_err(refuse)?;
        let text = text_of_station(&self.text, name).ok_or_else(|| CliError::bug("a station without a text"))?;
        Ok(Self { name: format!("{}, station {name}", self.name), scenario, text, directory: self.directory })
    }

    /// The scenario of each station with its name, in order; the scenario itself, without a name, if it has
    /// none or one.
    pub fn each_station(self) -> Result<Vec<(Option<String>, Self)>, CliError> {
        if self.scenario.stations.is_empty() {
            return Ok(vec![(None, self)]);
        }
        let names: Vec<String> = self.scenario.station_names().into_iter().map(str::to_owned).collect();
        let at = |name: String| self.clone().at_station(Some(&name)).map(|named| (Some(name), named));
        names.into_iter().map(at).collect()
    }
}

/// Reads the scenario at `path`, or the embedded one.
pub fn read(path: Option<&Path>, allow_outside: bool) -> Result<Named, CliError> {
    let Some(path) = path else {
        let name = "the embedded scene of two systems".to_owned();
        let scenario = Scenario::parse(EMBEDDED, &name).map_err(CliError::bug)?;
        return Ok(Named { scenario, text: EMBEDDED.to_owned(), name, directory: PathBuf::from(".") });
    };
    let (name, text) = text(path).map_err(|error| {
        let hint = if path.exists() { None } else { scenes::hint(path) };
        hint.map_or(error, |hint| CliError::input(format!("{}: no such file: {hint}", shown(path))))
    })?;
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let scenario = Scenario::parse_in(&text, &name, directory, allow_outside).map_err(|error| {
        if matches!(error, ScenarioError::Read { .. }) {
            return scenario_error(error);
        }
        // What is wrong with the receiver's own table is said with the rest.
        let syntax = matches!(error, ScenarioError::Toml { .. });
        let settings = if syntax { None } else { Settings::of_scenario(&text, &name).err() };
        let settings = settings.iter().flat_map(SettingsError::each).map(ToString::to_string);
        all(error.each().iter().map(ToString::to_string).chain(settings))
    })?;
    Ok(Named { scenario, text, name, directory: directory.to_owned() })
}

/// The name that messages give a file, and its text: at most `LARGEST_BYTES`, so that a device without end is
/// refused.
pub fn text(path: &Path) -> Result<(String, String), CliError> {
    let name = shown(path);
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LARGEST_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|error| CliError::read(&name, &error))?;
    if bytes.len() as u64 > LARGEST_BYTES {
        return Err(CliError::input(format!(
            "{name}: more than {LARGEST_BYTES} bytes: expected a text of at most that"
        )));
    }
    let text = String::from_utf8(bytes)
        .map_err(|error| CliError::input(format!("{name}: not UTF-8 at byte {}", error.utf8_error().valid_up_to())))?;
    Ok((name, text))
}

/// Limits the threads that the work may use.
pub fn use_threads(threads: Option<u16>) -> Result<(), CliError> {
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(threads) = threads {
        pool = pool.num_threads(threads.into());
    }
    pool.build_global().map_err(|error| CliError::passing(format!("cannot start threads: {error}")))
}

/// The scenes of all front ends of the scenario.
pub fn compose_all(named: &Named, overrides: &Overrides) -> Result<(Vec<Scene>, Vec<String>), CliError> {
    named.scenario.compose_all(&named.directory, overrides).map_err(scenario_error)
}

/// Registers the signals that files describe, for names in settings and flags.
pub fn describe_signals(files: &[PathBuf]) -> Result<(), CliError> {
    files.iter().try_for_each(|path| {
        let (name, text) = text(path)?;
        let described = described_signal(&text, &name).map(|_| ());
        described.map_err(|error| all(error.each().iter().map(ToString::to_string)))
    })
}

/// The exit that a refused scenario means.
pub fn scenario_error(error: ScenarioError) -> CliError {
    match error {
        ScenarioError::Read { origin, key, path, error } => {
            CliError::read(format!("{origin}: {key} = {path:?}"), &error)
        }
        other => CliError::input(other),
    }
}

/// The receiver's settings that the scenario carries for it.
pub fn receiver_settings(named: &Named) -> Result<Settings, CliError> {
    let settings = Settings::of_scenario(&named.text, &named.name).map_err(|error| refused(&error))?;
    with_keys(settings, Some(&named.directory), &named.name, "receiver.")
}

/// The settings with the keys of authentication in place of the files that have them, which are relative to a
/// directory.
pub fn with_keys(
    mut settings: Settings,
    directory: Option<&Path>,
    origin: &str,
    above: &str,
) -> Result<Settings, CliError> {
    if let Some(osnma) = &mut settings.osnma {
        let directory = directory.unwrap_or(Path::new("."));
        osnma.read_files(directory, origin, above).map_err(|error| refused(&error))?;
    }
    Ok(settings)
}

/// Error that lists all errors of receiver's settings, each as one of its own.
pub fn refused(error: &SettingsError) -> CliError {
    all(error.each().iter().map(ToString::to_string))
}

/// Error that lists several messages, each as one of its own.
pub fn all(messages: impl Iterator<Item = String>) -> CliError {
    CliError::input(messages.collect::<Vec<_>>().join("\nerror: "))
}

/// A directory's name made of a scene's name.
pub fn file_name(scene: &str) -> String {
    scene.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}

/// Prints on standard output.
pub fn print(text: &str) -> Result<(), CliError> {
    let mut stdout = std::io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| CliError::output("standard output", &error))
}

/// Prints a warning on standard error; a failure to do so is silent.
pub fn warn(text: &str) {
    let _ = writeln!(std::io::stderr(), "warning: {}", escaped(text));
}

/// Prints on standard error what is neither result nor warning; a failure to do so is silent.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", escaped(text));
}
