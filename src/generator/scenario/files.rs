//! Files that a scenario names: their location, and the permission to read them.

use std::path::{Path, PathBuf};

use super::{Overrides, Scenario, ScenarioError};

/// Largest navigation file, packed.
const MAX_NAVIGATION_BYTES: u64 = 64 << 20;

/// Location of a scenario's files.
#[derive(Clone, Copy)]
pub(super) struct Files<'a> {
    pub directory: &'a Path,
    pub overrides: &'a Overrides,
}

/// A file as a scenario names it.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Path of the scenario, for error messages.
    pub origin: &'a str,
    /// The key that names the file.
    pub key: &'static str,
    /// The file as written.
    pub path: &'a Path,
}

impl Wanted<'_> {
    fn unreadable(&self, error: std::io::Error) -> ScenarioError {
        ScenarioError::Read { origin: self.origin.to_owned(), key: self.key, path: self.path.to_owned(), error }
    }

    pub(super) fn refused(&self, reason: String) -> ScenarioError {
        ScenarioError::File { origin: self.origin.to_owned(), key: self.key, path: self.path.to_owned(), reason }
    }

    /// The full path of the file; it must be a file below the scenario's directory.
    fn resolve(&self, files: Files<'_>) -> Result<PathBuf, ScenarioError> {
        let Files { directory, overrides } = files;
        let io = |e: std::io::Error| self.unreadable(e);
        // An empty directory is that of a scenario named without one.
        let directory = if directory.as_os_str().is_empty() { Path::new(".") } else { directory };
        let full = directory.join(self.path).canonicalize().map_err(io)?;
        if !overrides.allow_outside && !full.starts_with(directory.canonicalize().map_err(io)?) {
            let reason =
                "lies outside the scenario's directory (run, generate and plan permit it with --allow-outside)";
            return Err(self.refused(reason.to_owned()));
        }
        if !full.metadata().map_err(io)?.is_file() {
            return Err(self.refused("is not a file".to_owned()));
        }
        Ok(full)
    }

    /// The bytes of the file.
    pub(super) fn load(&self, files: Files<'_>) -> Result<Vec<u8>, ScenarioError> {
        let full = self.resolve(files)?;
        let bytes = full.metadata().map_err(|e| self.unreadable(e))?.len();
        if bytes > MAX_NAVIGATION_BYTES {
            return Err(self.refused(format!("{bytes} bytes: expected at most {MAX_NAVIGATION_BYTES}")));
        }
        std::fs::read(full).map_err(|e| self.unreadable(e))
    }
}

impl Scenario {
    fn wanted<'a>(&'a self, key: &'static str, path: &'a Path) -> Wanted<'a> {
        Wanted { origin: &self.origin, key, path }
    }

    pub(super) fn unreadable(&self, key: &'static str, path: &Path, error: std::io::Error) -> ScenarioError {
        self.wanted(key, path).unreadable(error)
    }

    /// The full path of a file that the scenario names; it must be a file below the scenario's directory.
    pub(super) fn resolve(
        &self,
        key: &'static str,
        directory: &Path,
        path: &Path,
        overrides: &Overrides,
    ) -> Result<PathBuf, ScenarioError> {
        self.wanted(key, path).resolve(Files { directory, overrides })
    }

    /// The bytes of a file that the scenario names.
    pub(super) fn load(
        &self,
        key: &'static str,
        directory: &Path,
        path: &Path,
        overrides: &Overrides,
    ) -> Result<Vec<u8>, ScenarioError> {
        self.wanted(key, path).load(Files { directory, overrides })
    }
}
