//! Outputs appear under their names only when they are whole.
//!
//! A directory is written as `.<name>.part` beside its final place and renamed at the end. What
//! a killed run left behind is swept by the next one.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::cli::error::CliError;

/// Files that mark a directory as one of ours, which may be replaced.
const MARKERS: [&str; 4] = ["truth/scene.json", "rx/receiver.json", "receiver.json", "scene.json"];

/// A directory or file in the making; dropped without [`Staging::commit`], it vanishes.
pub struct Staging {
    part: PathBuf,
    target: PathBuf,
    committed: bool,
}

impl Staging {
    /// Starts a directory that will be `target`. An existing target is replaced only if it is empty or one of ours.
    pub fn directory(target: &Path) -> Result<Self, CliError> {
        if target.exists() && !replaceable(target) {
            return Err(CliError::refused_output(format!(
                "{} exists and is not the result of a run: name another directory with --out, or remove it",
                target.display()
            )));
        }
        let staging = Self::beside(target)?;
        remove(&staging.part).map_err(|error| CliError::create(staging.part.display(), &error))?;
        fs::create_dir(&staging.part).map_err(|error| CliError::create(staging.part.display(), &error))?;
        Ok(staging)
    }

    /// Starts a file that will be `target`; the caller creates [`Staging::path`].
    pub fn file(target: &Path) -> Result<Self, CliError> {
        // What is renamed over a device or a pipe takes its place.
        if let Ok(kind) = fs::metadata(target).map(|metadata| metadata.file_type())
            && !kind.is_file()
        {
            let what = if kind.is_dir() { "is a directory" } else { "is not an ordinary file" };
            return Err(CliError::refused_output(format!("{} {what}: name a file with --out", target.display())));
        }
        let staging = Self::beside(target)?;
        remove(&staging.part).map_err(|error| CliError::create(staging.part.display(), &error))?;
        Ok(staging)
    }

    fn beside(target: &Path) -> Result<Self, CliError> {
        let name = target
            .file_name()
            .ok_or_else(|| CliError::usage(format!("--out {}: expected a name to write to", target.display())))?;
        let parent = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        fs::create_dir_all(&parent).map_err(|error| CliError::create(parent.display(), &error))?;
        let mut part = std::ffi::OsString::from(".");
        part.push(name);
        part.push(".part");
        Ok(Self { part: parent.join(part), target: target.to_owned(), committed: false })
    }

    /// Where to write.
    pub fn path(&self) -> &Path {
        &self.part
    }

    /// Gives the finished work its name.
    pub fn commit(mut self) -> Result<(), CliError> {
        let error = |error: io::Error| CliError::create(self.target.display(), &error);
        if self.part.is_file() {
            fs::File::open(&self.part).and_then(|file| file.sync_all()).map_err(error)?;
        } else if self.target.exists() {
            // A directory cannot be renamed over a full one.
            fs::remove_dir_all(&self.target).map_err(error)?;
        }
        fs::rename(&self.part, &self.target).map_err(error)?;
        self.committed = true;
        Ok(())
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        if !self.committed {
            // Nothing better can be done with a failure here; the next run sweeps.
            let _ = remove(&self.part);
        }
    }
}

fn replaceable(target: &Path) -> bool {
    let empty = fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_none());
    target.is_dir() && (empty || MARKERS.iter().any(|marker| target.join(marker).is_file()))
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}
