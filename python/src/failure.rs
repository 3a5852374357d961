//! Errors of the library as exceptions of Python, with the library's own words.

use std::io;

use analysis::JudgeError;
use generator::GenerateError;
use generator::event::EventError;
use generator::scenario::ScenarioError;
use generator::truth::TruthError;
use gnss::sigmf::SigmfError;
use live::lockstep::StepError;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyRuntimeError};
use pyo3::prelude::*;
use receiver::ReceiveError;
use receiver::output::OutputError;
use receiver::settings::SettingsError;
use study::sweep::StudyError;
use twin::TwinError;

create_exception!(gnss_twin, Error, PyException, "What this package refuses; the message names key, value and cure.");
create_exception!(gnss_twin, ScenarioError_, Error, "A scenario that is refused.");
create_exception!(gnss_twin, SettingsError_, Error, "Settings of a receiver that are refused.");
create_exception!(gnss_twin, GenerateError_, Error, "A scene that cannot be generated.");
create_exception!(gnss_twin, ReceiveError_, Error, "Samples that cannot be received.");
create_exception!(gnss_twin, StepError_, Error, "A step of a live scene that is not made.");
create_exception!(gnss_twin, StudyError_, Error, "A study that cannot be planned or run.");
create_exception!(gnss_twin, JudgeError_, Error, "A run that cannot be judged.");

/// Python's exception for an error.
#[derive(Clone, Copy)]
enum Kind {
    Other,
    Scenario,
    Settings,
    Generate,
    Receive,
    Step,
    Study,
    Judge,
    File(io::ErrorKind),
    Bug,
}

/// An error of the library on its way to Python.
pub struct Failure {
    kind: Kind,
    text: String,
}

impl Failure {
    /// Ended by a signal: the exception that the signal raises replaces it.
    pub fn halted() -> Self {
        Self { kind: Kind::Other, text: "interrupted".to_owned() }
    }

    /// A fault of this package.
    pub fn bug(text: &str) -> Self {
        Self { kind: Kind::Bug, text: text.to_owned() }
    }

    /// Failure that fits no other kind.
    pub fn other(text: impl Into<String>) -> Self {
        Self { kind: Kind::Other, text: text.into() }
    }

    /// A file, with what the system reports of it.
    pub fn file(path: &std::path::Path, error: &io::Error) -> Self {
        Self { kind: Kind::File(error.kind()), text: format!("{}: {error}", path.display()) }
    }

    /// A scenario that is in no file as it was read: its line numbers mean nothing.
    pub fn of_table(error: &ScenarioError) -> Self {
        Self { kind: Kind::Scenario, text: error.without_place() }
    }
}

/// Failure for an error that may be one of the file system.
fn with_file(kind: Kind, text: String, source: Option<&io::Error>) -> Failure {
    Failure { kind: source.map_or(kind, |source| Kind::File(source.kind())), text }
}

impl From<ScenarioError> for Failure {
    fn from(error: ScenarioError) -> Self {
        let source = match &error {
            ScenarioError::Open { error, .. } | ScenarioError::Read { error, .. } => Some(error),
            _ => None,
        };
        with_file(Kind::Scenario, error.to_string(), source)
    }
}

impl From<GenerateError> for Failure {
    fn from(error: GenerateError) -> Self {
        match error {
            GenerateError::Truth(error) => error.into(),
            error => Self { kind: Kind::Generate, text: error.to_string() },
        }
    }
}

impl From<TruthError> for Failure {
    fn from(error: TruthError) -> Self {
        let source = if let TruthError::File { source, .. } = &error { Some(source) } else { None };
        with_file(Kind::Generate, error.to_string(), source)
    }
}

impl From<ReceiveError> for Failure {
    fn from(error: ReceiveError) -> Self {
        match error {
            ReceiveError::Output(error) => error.into(),
            ReceiveError::Settings(error) => error.into(),
            error => Self { kind: Kind::Receive, text: error.to_string() },
        }
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        let source = match &error {
            OutputError::Create { error, .. } | OutputError::Write { error, .. } => Some(error),
            OutputError::Refused(_) => None,
        };
        with_file(Kind::Receive, error.to_string(), source)
    }
}

impl From<TwinError> for Failure {
    fn from(error: TwinError) -> Self {
        match error {
            TwinError::Generate(error) => error.into(),
            TwinError::Receive(error) => error.into(),
            TwinError::Refused(error) => Self { kind: Kind::Scenario, text: error.to_string() },
        }
    }
}

impl From<StepError> for Failure {
    fn from(error: StepError) -> Self {
        match error {
            StepError::Generate(error) => error.into(),
            StepError::Receive(error) => error.into(),
            error => Self { kind: Kind::Step, text: error.to_string() },
        }
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let source = match &error {
            StudyError::Read { source, .. } | StudyError::Create { source, .. } | StudyError::Write { source, .. } => {
                Some(source)
            }
            _ => None,
        };
        with_file(Kind::Study, error.to_string(), source)
    }
}

impl From<JudgeError> for Failure {
    fn from(error: JudgeError) -> Self {
        let source = match &error {
            JudgeError::File { source, .. } | JudgeError::Read { source, .. } => Some(source),
            _ => None,
        };
        with_file(Kind::Judge, error.to_string(), source)
    }
}

/// Errors with one meaning.
macro_rules! plain {
    ($($error:ty => $kind:ident),*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self { kind: Kind::$kind, text: error.to_string() }
            }
        }
    )*};
}

plain!(SettingsError => Settings, SigmfError => Other, EventError => Step);

impl From<Failure> for PyErr {
    fn from(Failure { kind, text }: Failure) -> Self {
        match kind {
            Kind::Other => Error::new_err(text),
            Kind::Scenario => ScenarioError_::new_err(text),
            Kind::Settings => SettingsError_::new_err(text),
            Kind::Generate => GenerateError_::new_err(text),
            Kind::Receive => ReceiveError_::new_err(text),
            Kind::Step => StepError_::new_err(text),
            Kind::Study => StudyError_::new_err(text),
            Kind::Judge => JudgeError_::new_err(text),
            // FileNotFoundError, PermissionError and their kin.
            Kind::File(kind) => io::Error::new(kind, text).into(),
            Kind::Bug => PyRuntimeError::new_err(text),
        }
    }
}

/// Names the exceptions in the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let all = [
        ("Error", py.get_type::<Error>()),
        ("ScenarioError", py.get_type::<ScenarioError_>()),
        ("SettingsError", py.get_type::<SettingsError_>()),
        ("GenerateError", py.get_type::<GenerateError_>()),
        ("ReceiveError", py.get_type::<ReceiveError_>()),
        ("StepError", py.get_type::<StepError_>()),
        ("StudyError", py.get_type::<StudyError_>()),
        ("JudgeError", py.get_type::<JudgeError_>()),
    ];
    for (name, kind) in all {
        kind.setattr("__name__", name)?;
        kind.setattr("__qualname__", name)?;
        module.add(name, kind)?;
    }
    Ok(())
}
