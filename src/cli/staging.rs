//! Outputs appear under their names only when they are whole.
//!
//! A directory is written as `.<name>.part` beside its final path and renamed at the end. What
//! a killed run left behind is swept by the next one. What is to be read while it grows, of a live reception,
//! is written as `<name>.unfinished` ([`InSight`]) and stays there if the program is stopped.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::cli::error::CliError;
use analysis::show::staged::{Staged, present, remove};

/// Files that mark a directory as one of ours, which may be replaced.
const MARKERS: [&str; 8] = [
    "truth/scene.json",
    "rx/receiver.json",
    "receiver.json",
    "scene.json",
    "stations.json",
    "log.json",
    "osnma.json",
    "baseline.json",
];

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
        refuse_others(target)?;
        let making = Staged::directory(part(target)?).map_err(|error| CliError::create(target.display(), &error))?;
        Ok(Self { making, file: None, target: target.to_owned() })
    }

    /// Starts a file that will be `target`.
    pub fn file(target: &Path) -> Result<Self, CliError> {
        refuse_special(target)?;
        let made = Staged::file(part(target)?);
        let (making, file) = made.map_err(|error| CliError::create(target.display(), &error))?;
        Ok(Self { making, file: Some(file), target: target.to_owned() })
    }

    /// The directory to write in.
    pub fn path(&self) -> &Path {
        self.making.path()
    }

    /// Writer of a file's contents.
    pub fn writer(&self) -> impl Write + '_ {
        Writer(self.file.as_ref())
    }

    /// A handle of a file of its own; a directory has none.
    pub fn handle(&self) -> io::Result<File> {
        self.file.as_ref().map_or(Err(io::ErrorKind::IsADirectory.into()), File::try_clone)
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

/// A directory or file that may be read while it grows: `<name>.unfinished` until it is whole. It stays there
/// where the program is stopped or fails, and the next one of that name replaces it.
pub struct InSight {
    path: PathBuf,
    target: PathBuf,
}

impl InSight {
    /// Starts a directory that will be `target`; both names are held to what [`Staging::directory`] asks.
    pub fn directory(target: &Path) -> Result<Self, CliError> {
        let (path, target) = (unfinished(target)?, target.to_owned());
        refuse_others(&target)?;
        let error = |error: io::Error| CliError::create(path.display(), &error);
        // What an earlier one of these left has no marker yet.
        if !ROWS.iter().any(|rows| path.join(rows).is_file()) {
            refuse_others(&path)?;
        }
        remove(&path).and_then(|()| fs::create_dir(&path)).map_err(error)?;
        Ok(Self { path, target })
    }

    /// Starts a directory that will be `target`, and keeps what an earlier one left unfinished if it has a
    /// file `proof`: that gets the first free name `<name>.unfinished-1` and on, which is returned.
    pub fn beside(target: &Path, proof: &str) -> Result<(Self, Option<PathBuf>), CliError> {
        let path = unfinished(target)?;
        if !path.join(proof).is_file() {
            return Ok((Self::directory(target)?, None));
        }
        let error = |error: io::Error| CliError::create(path.display(), &error);
        let mut number = 0_u32;
        let kept = loop {
            number += 1;
            let mut name = path.as_os_str().to_owned();
            name.push(format!("-{number}"));
            let name = PathBuf::from(name);
            if !present(&name).map_err(error)? {
                break name;
            }
        };
        fs::rename(&path, &kept).map_err(error)?;
        Ok((Self::directory(target)?, Some(kept)))
    }

    /// Starts a file that will be `target`.
    pub fn file(target: &Path) -> Result<(Self, File), CliError> {
        let (path, target) = (unfinished(target)?, target.to_owned());
        refuse_special(&target)?;
        refuse_special(&path)?;
        let made = remove(&path).and_then(|()| File::options().write(true).create_new(true).open(&path));
        let file = made.map_err(|error| CliError::create(path.display(), &error))?;
        Ok((Self { path, target }, file))
    }

    /// Path at which the directory is made.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the finished work its name.
    pub fn commit(self) -> Result<(), CliError> {
        let finished = Staged::adopt(self.path).finish(&self.target);
        finished.map_err(|error| CliError::create(self.target.display(), &error))
    }
}

/// Files that every reception and every record of a live run have from their beginning.
const ROWS: [&str; 2] = ["observations.csv", "inputs.csv"];

fn unfinished(target: &Path) -> Result<PathBuf, CliError> {
    let mut name = name(target)?.to_owned();
    name.push(".unfinished");
    Ok(parent(target)?.join(name))
}

/// Refuses a directory that is not ours to replace.
fn refuse_others(target: &Path) -> Result<(), CliError> {
    let error = |error: io::Error| CliError::create(target.display(), &error);
    if present(target).map_err(error)? && !replaceable(target).map_err(error)? {
        return Err(CliError::refused_output(format!(
            "{} exists and is not the result of a run: name another directory with --out, or remove it",
            target.display()
        )));
    }
    Ok(())
}

/// Refuses a file that is none: a file that is renamed over a device or a pipe replaces it.
fn refuse_special(target: &Path) -> Result<(), CliError> {
    let about = match fs::metadata(target) {
        Err(missing) if missing.kind() == io::ErrorKind::NotFound => return Ok(()),
        other => other.map_err(|error| CliError::create(target.display(), &error))?,
    };
    if about.is_file() {
        return Ok(());
    }
    let what = if about.is_dir() { "is a directory" } else { "is not an ordinary file" };
    Err(CliError::refused_output(format!("{} {what}: name a file", target.display())))
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

/// Path of the unfinished output, beside its final path. The parent directory is created.
fn part(target: &Path) -> Result<PathBuf, CliError> {
    let mut part = OsString::from(".");
    part.push(name(target)?);
    part.push(".part");
    Ok(parent(target)?.join(part))
}

fn name(target: &Path) -> Result<&OsStr, CliError> {
    let missing = || CliError::usage(format!("{}: expected a name to write to", target.display()));
    target.file_name().ok_or_else(missing)
}

/// The directory of a file's or directory's name, which is made where there is none.
fn parent(target: &Path) -> Result<PathBuf, CliError> {
    let parent = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    fs::create_dir_all(&parent).map_err(|error| CliError::create(parent.display(), &error))?;
    Ok(parent)
}

/// True if a directory exists that is empty or one of this program's.
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
