//! Files that a scenario names: their location, and the permission to read them.

use std::path::{Path, PathBuf};

use super::{Overrides, Scenario, ScenarioError};

/// Largest navigation file, packed.
const MAX_NAVIGATION_BYTES: u64 = 64 << 20;

/// Location of a scenario's files.
pub(super) struct Files<'a> {
    pub directory: &'a Path,
    pub overrides: &'a Overrides,
}

impl Scenario {
    pub(super) fn unreadable(&self, key: &'static str, path: &Path, error: std::io::Error) -> ScenarioError {
        ScenarioError::Read { origin: self.origin.clone(), key, path: path.to_owned(), error }
    }

    /// The full path of a file that the scenario names; it must be a file below the scenario's directory.
    pub(super) fn resolve(
        &self,
        key: &'static str,
        directory: &Path,
        path: &Path,
        overrides: &Overrides,
    ) -> Result<PathBuf, ScenarioError> {
        let refuse = |reason: &str| ScenarioError::File {
            origin: self.origin.clone(),
            key,
            path: path.to_owned(),
            reason: reason.to_owned(),
        };
        let io = |e: std::io::Error| self.unreadable(key, path, e);
        // An empty directory is that of a scenario named without one.
        let directory = if directory.as_os_str().is_empty() { Path::new(".") } else { directory };
        let full = directory.join(path).canonicalize().map_err(io)?;
        if !overrides.allow_outside && !full.starts_with(directory.canonicalize().map_err(io)?) {
            return Err(refuse(
                "lies outside the scenario's directory (run, generate and plan permit it with --allow-outside)",
            ));
        }
        if !full.metadata().map_err(io)?.is_file() {
            return Err(refuse("is not a file"));
        }
        Ok(full)
    }

    /// The bytes of a file that the scenario names.
    pub(super) fn load(
        &self,
        key: &'static str,
        directory: &Path,
        path: &Path,
        overrides: &Overrides,
    ) -> Result<Vec<u8>, ScenarioError> {
        let full = self.resolve(key, directory, path, overrides)?;
        let bytes = full.metadata().map_err(|e| self.unreadable(key, path, e))?.len();
        if bytes > MAX_NAVIGATION_BYTES {
            return Err(ScenarioError::File {
                origin: self.origin.clone(),
                key,
                path: path.to_owned(),
                reason: format!("{bytes} bytes: expected at most {MAX_NAVIGATION_BYTES}"),
            });
        }
        std::fs::read(full).map_err(|e| self.unreadable(key, path, e))
    }
}
