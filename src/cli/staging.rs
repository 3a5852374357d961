//! Outputs appear under their names only when they are whole.
//!
//! A directory is written as `.<name>.part` beside its final place and renamed at the end. What
//! a killed run left behind is swept by the next one.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::analysis::show::staged::{Staged, present};
use crate::cli::error::CliError;

/// Files that mark a directory as one of ours, which may be replaced.
const MARKERS: [&str; 4] = ["truth/scene.json", "rx/receiver.json", "receiver.json", "scene.json"];

/// A directory or file in the making; dropped without [`Staging::commit`], it vanishes.
pub struct Staging {
    making: Staged,
    file: Option<File>,
    target: PathBuf,
}

impl Staging {
    /// Starts a directory that will be `target`. An existing target is replaced only if it is empty or one of
    /// ours.
    pub fn directory(target: &Path) -> Result<Self, CliError> {
        let error = |error: io::Error| CliError::create(target.display(), &error);
        if present(target).map_err(error)? && !replaceable(target).map_err(error)? {
            return Err(CliError::refused_output(format!(
                "{} exists and is not the result of a run: name another directory with --out, or remove it",
                target.display()
            )));
        }
        let making = Staged::directory(part(target)?).map_err(error)?;
        Ok(Self { making, file: None, target: target.to_owned() })
    }

    /// Starts a file that will be `target`.
    pub fn file(target: &Path) -> Result<Self, CliError> {
        let error = |error: io::Error| CliError::create(target.display(), &error);
        // What is renamed over a device or a pipe takes its place.
        let about = match fs::metadata(target) {
            Err(missing) if missing.kind() == io::ErrorKind::NotFound => None,
            other => Some(other.map_err(error)?),
        };
        if let Some(kind) = about.map(|metadata| metadata.file_type())
            && !kind.is_file()
        {
            let what = if kind.is_dir() { "is a directory" } else { "is not an ordinary file" };
            return Err(CliError::refused_output(format!("{} {what}: name a file with --out", target.display())));
        }
        let (making, file) = Staged::file(part(target)?).map_err(error)?;
        Ok(Self { making, file: Some(file), target: target.to_owned() })
    }

    /// The directory to write in.
    pub fn path(&self) -> &Path {
        self.making.path()
    }

    /// What takes the contents of a file.
    pub fn writer(&self) -> impl Write + '_ {
        Writer(self.file.as_ref())
    }

    /// Writes all contents of a file.
    pub fn write(&self, bytes: &[u8]) -> Result<(), CliError> {
        self.writer().write_all(bytes).map_err(|error| CliError::output(self.target.display(), &error))
    }

    /// [`Self::commit`] of a file, where what fails is a writer's concern.
    pub fn finish(self) -> io::Result<()> {
        self.file.as_ref().map_or(Ok(()), File::sync_all)?;
        self.making.finish(&self.target)
    }

    /// Gives the finished work its name.
    pub fn commit(self) -> Result<(), CliError> {
        if let Some(file) = &self.file {
            file.sync_all().map_err(|error| CliError::output(self.target.display(), &error))?;
        }
        self.making.finish(&self.target).map_err(|error| CliError::create(self.target.display(), &error))
    }
}

/// A file's contents; a directory takes none.
struct Writer<'a>(Option<&'a File>);

impl Write for Writer<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.map_or(Err(io::ErrorKind::IsADirectory.into()), |mut file| file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Where it is made: beside its place, which is created.
fn part(target: &Path) -> Result<PathBuf, CliError> {
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
    Ok(parent.join(part))
}

/// Whether a directory is there that is empty or one of ours.
fn replaceable(target: &Path) -> io::Result<bool> {
    if !fs::metadata(target)?.is_dir() {
        return Ok(false);
    }
    if fs::read_dir(target)?.next().transpose()?.is_none() {
        return Ok(true);
    }
    for marker in MARKERS {
        if present(&target.join(marker))? {
            return Ok(true);
        }
    }
    Ok(false)
}
