//! Generator and receiver in one loop, from a scene to records, truth and verdict.
//!
//! [`feed`] gives the samples of scenes to anything that takes them, such as a receiver of one's own:
//!
//! ```
//! use gnss_twin::generator::GenerateError;
//! use gnss_twin::prelude::*;
//! use gnss_twin::twin::{Fed, Listen, feed};
//!
//! let scene = Scenario::builder("fed")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?
//!     .scene()?;
//! let mut bytes = 0;
//! let listen: &mut Listen<'_, GenerateError> = &mut |_front_end, samples| {
//!     bytes += samples.len();
//!     Ok(())
//! };
//! let fed: Fed = feed(std::slice::from_ref(&scene), &mut (), listen)?;
//! assert_eq!((fed.generated[0].samples, bytes), (260_000, 520_000));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::{Path, PathBuf};

use thiserror::Error;

use ::generator::scenario::{Overrides, Scenario, ScenarioError};
use ::generator::scene::Scene;
use ::generator::stream::{GenerateError, Generated};
use ::generator::truth::{self, TruthError};
use ::gnss::record::Fix;
use ::receiver::output::{self, Output, OutputError};
use ::receiver::settings::{Settings, SettingsError};
use ::receiver::{Outcome, ReceiveError};
use ::twin::Refused;
#[doc(inline)]
pub use ::twin::{Done, Fed, Listen, feed};
use ::twin::{TwinError, run, settle};

#[cfg(feature = "analysis")]
use ::analysis::judge::limits::Limits;
#[cfg(feature = "analysis")]
use ::analysis::{JudgeError, Summary, assess};

/// Error of a [`Twin`]: of the scene, the settings, either side of the loop, the judge, or a directory.
#[derive(Debug, Error)]
pub enum Error {
    /// Scenario that is refused.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// Settings of the receiver that are refused.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Scene that cannot be generated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// Effect of a scene of which its level has no model.
    #[error(transparent)]
    Refused(#[from] Refused),
    /// Samples that cannot be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// Files of the truth that cannot be made.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// Files of the receiver that cannot be made.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Run that cannot be judged.
    #[cfg(feature = "analysis")]
    #[error(transparent)]
    Judge(#[from] JudgeError),
    /// Directory that cannot be made.
    #[error("{}: {error}", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
}

impl From<TwinError> for Error {
    fn from(error: TwinError) -> Self {
        match error {
            TwinError::Generate(error) => Self::Generate(error),
            TwinError::Receive(error) => Self::Receive(error),
            TwinError::Refused(error) => Self::Refused(error),
        }
    }
}

/// Scene and receiver, ready to run.
///
/// ```
/// use gnss_twin::Twin;
///
/// let run = Twin::from_toml(
///     r#"
///     name = "first"
///     start = 2010-07-01T08:06:00
///     duration_s = 0.3
///     motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
///     noise = {}
///     "#,
/// )?
/// .run()?;
/// assert_eq!(run.outcome.acquired, run.generated[0].satellites);
/// # Ok::<(), gnss_twin::Error>(())
/// ```
///
/// The receiver has the settings of the scenario's table `[receiver]`, or those of [`Twin::with_settings`]:
///
/// ```
/// use gnss_twin::prelude::*;
///
/// let scenario = Scenario::builder("set")
///     .start(Epoch::parse("2010-07-01T08:06:00")?)
///     .duration_s(0.3)
///     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
///     .set("receiver.tracking.pll_bandwidth_hz", 12.0)
///     .build()?;
/// let twin = Twin::new(&scenario)?;
/// assert_eq!(twin.settings().tracking.pll_bandwidth_hz, 12.0);
/// assert_eq!(twin.with_settings(Settings::default()).settings(), &Settings::default());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Twin {
    scenes: Vec<Scene>,
    settings: Settings,
    warnings: Vec<String>,
}

impl Twin {
    /// Composes a scenario with all its front ends, at the level of each. With a budget the level is
    /// `correlations` where that keeps it.
    ///
    /// ```
    /// use gnss_twin::Twin;
    ///
    /// let scene = |fidelity: &str| {
    ///     let text = format!(
    ///         r#"
    ///         name = "levels"
    ///         start = 2010-07-01T08:06:00
    ///         duration_s = 0.3
    ///         motion = {{ kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }}
    ///         noise = {{}}
    ///         fidelity = {{ {fidelity} }}
    ///         "#
    ///     );
    ///     Twin::from_toml(&text)?.run()
    /// };
    /// let [sampled, modelled, kept] =
    ///     [scene("")?, scene("level = 'correlations'")?, scene("budget = { code_m = 1, cn0_db = 1 }")?];
    /// let samples = [&sampled, &modelled, &kept].map(|run| run.generated[0].samples);
    /// assert_eq!(samples, [780_000, 0, 0]);
    /// assert!(modelled.outcome.acquired.len() >= 4, "{:?}", modelled.outcome.acquired);
    /// # Ok::<(), gnss_twin::Error>(())
    /// ```
    ///
    /// # Errors
    /// Values that are impossible together, files that cannot be read, settings that are refused.
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        let (mut scenes, warnings) = scenario.compose_all(&scenario.directory, &Overrides::default())?;
        settle(&mut scenes)?;
        let settings = match &scenario.receiver {
            Some(table) => Settings::from_table(table.clone(), "receiver")?,
            None => Settings::default(),
        };
        Ok(Self { scenes, settings, warnings })
    }

    /// Composes a scenario from its text; files that it names are relative to the working directory.
    ///
    /// # Errors
    /// Errors of [`Scenario::from_toml`] and [`Twin::new`].
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        Self::new(&Scenario::from_toml(text)?)
    }

    /// Composes the scenario of a file; files that it names are relative to its directory.
    ///
    /// ```
    /// use gnss_twin::{Error, Twin};
    ///
    /// let error: Error = Twin::open("no_such.toml").err().ok_or("no error")?;
    /// assert!(error.to_string().starts_with("no_such.toml: cannot be read"), "{error}");
    /// # Ok::<(), &str>(())
    /// ```
    ///
    /// # Errors
    /// Errors of [`Scenario::open`] and [`Twin::new`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::new(&Scenario::open(path)?)
    }

    /// Replaces the settings of the receiver. Where they name no signals, those of the scene are searched
    /// for.
    #[must_use]
    pub fn with_settings(self, settings: Settings) -> Self {
        Self { settings, ..self }
    }

    /// Settings of the receiver.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Scenes, one for each front end.
    pub fn scenes(&self) -> &[Scene] {
        &self.scenes
    }

    /// Scenes for changes: effects of one's own, other ephemerides.
    pub fn scenes_mut(&mut self) -> &mut [Scene] {
        &mut self.scenes
    }

    /// Warnings of the composition, in words.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Runs the scene from its first sample to its last; records and truth stay in memory.
    ///
    /// # Errors
    /// First error of either side.
    pub fn run(&self) -> Result<Run, Error> {
        let (mut truth, mut records) = (Vec::new(), Vec::new());
        let Done { generated, outcome } = self.run_to(&mut truth, &mut records)?;
        Ok(Run { truth, records, generated, outcome })
    }

    /// Runs the scene; sinks take records and truth.
    ///
    /// ```
    /// use gnss_twin::prelude::*;
    /// use gnss_twin::twin::Done;
    ///
    /// let scenario = Scenario::builder("sinks")
    ///     .start(Epoch::parse("2010-07-01T08:06:00")?)
    ///     .duration_s(0.3)
    ///     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
    ///     .build()?;
    /// let mut records: Vec<Record> = Vec::new();
    /// let Done { generated, .. } = Twin::new(&scenario)?.run_to(&mut (), &mut records)?;
    /// assert_eq!(generated[0].samples, 780_000);
    /// assert!(records.iter().any(|record| matches!(record, Record::Acquisition(_))));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// First error of either side; what the sinks took before stays.
    pub fn run_to(
        &self,
        truth: &mut (dyn truth::Sink + Send),
        records: &mut (dyn output::Sink + Send),
    ) -> Result<Done, Error> {
        Ok(run(&self.scenes, &self.settings, truth, records)?)
    }

    /// Runs the scene and writes the tables of truth and receiver into `truth` and `rx` of a directory, which
    /// is made if it is not there. The judge reads them.
    ///
    /// # Errors
    /// First error of either side, files that cannot be written.
    pub fn run_in(&self, directory: &Path) -> Result<Done, Error> {
        let (mut truth, mut records) = files(directory)?;
        self.run_to(&mut truth, &mut records)
    }

    /// Runs the scene in memory and judges it, also against limits of one's own. The judge's files are in a
    /// temporary directory and removed.
    ///
    /// ```
    /// use gnss_twin::judge::Status;
    /// use gnss_twin::prelude::*;
    ///
    /// let scenario = Scenario::builder("verdict")
    ///     .start(Epoch::parse("2010-07-01T08:06:00")?)
    ///     .duration_s(1.5)
    ///     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
    ///     .noise()
    ///     .build()?;
    /// let limits = Limits::parse("\"satellites.acquired\" = { min = 4 }\n", "limits")?;
    /// let (run, summary) = Twin::new(&scenario)?.run_judged(Some(&limits))?;
    /// assert_eq!(run.fixes().count(), summary.position.fixes);
    /// assert_ne!(summary.details.verdict.status(), Status::Fail, "{summary}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Errors of [`Twin::run_in`], a run that cannot be judged.
    #[cfg(feature = "analysis")]
    pub fn run_judged(&self, limits: Option<&Limits>) -> Result<(Run, Summary), Error> {
        let directory = tempfile::tempdir().map_err(|error| Error::Directory { path: std::env::temp_dir(), error })?;
        let (mut truth, mut records) = (Vec::new(), Vec::new());
        let (mut true_files, mut files) = files(directory.path())?;
        let Done { generated, outcome } =
            self.run_to(&mut (&mut truth, &mut true_files), &mut (&mut records, &mut files))?;
        let summary = assess(directory.path(), limits)?;
        Ok((Run { truth, records, generated, outcome }, summary))
    }
}

/// Sinks that write a run's tables.
fn files(directory: &Path) -> Result<(truth::Writer, Output), Error> {
    let made = |name: &str| {
        let path = directory.join(name);
        std::fs::create_dir_all(&path).map(|()| path.clone()).map_err(|error| Error::Directory { path, error })
    };
    Ok((truth::Writer::create(&made("truth")?)?, Output::create(&made("rx")?)?))
}

/// Results of a run in memory.
#[derive(Clone, Debug)]
pub struct Run {
    /// Truth, in the order of the samples.
    pub truth: Vec<truth::Record>,
    /// Records of the receiver, in the order in which it found them.
    pub records: Vec<output::Record>,
    /// Results of the generator, for each front end.
    pub generated: Vec<Generated>,
    /// Outcome of the receiver.
    pub outcome: Outcome,
}

impl Run {
    /// Position fixes, in the order of time.
    pub fn fixes(&self) -> impl Iterator<Item = &Fix> {
        self.records.iter().filter_map(|record| match record {
            output::Record::Fix(fix) => Some(fix),
            _ => None,
        })
    }
}
