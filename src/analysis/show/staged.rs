//! Staged files and directories: written under a temporary name, renamed when they are complete, else
//! removed.
//!
//! The process keeps a list of all of them, so that the interrupt handler can remove them at any moment
//! ([`abandon`]). Beginning, finishing and abandoning exclude each other. Limits: what is in a directory is
//! its writer's concern. A process that is killed leaves its staged file, which the next one of that name
//! removes.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

// A signal has no other way to what the threads are at.
static KNOWN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Rounds in which what is abandoned may be filled again by threads that are still at work.
const ROUNDS: usize = 1000;

type Known = MutexGuard<'static, BTreeSet<PathBuf>>;

fn known() -> Known {
    // What a panicking thread was making is still known.
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A staged file or directory; dropped before it is finished, it is removed.
#[derive(Debug)]
pub struct Staged {
    path: PathBuf,
}

impl Staged {
    /// Begins a file, in place of what is there: links are removed and never followed.
    ///
    /// # Errors
    /// Files that cannot be removed or created.
    pub fn file(path: PathBuf) -> io::Result<(Self, File)> {
        let mut known = known();
        remove(&path)?;
        let file = File::options().write(true).create_new(true).open(&path)?;
        known.insert(path.clone());
        Ok((Self { path }, file))
    }

    /// Begins a directory, in place of what is there.
    ///
    /// # Errors
    /// Errors of [`Self::file`].
    pub fn directory(path: PathBuf) -> io::Result<Self> {
        let mut known = known();
        remove(&path)?;
        fs::create_dir(&path)?;
        known.insert(path.clone());
        Ok(Self { path })
    }

    /// Path of the file or directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Takes over the file or directory at `path`, which was made without staging.
    pub fn adopt(path: PathBuf) -> Self {
        known().insert(path.clone());
        Self { path }
    }

    /// Gives it its name. What bears that name is replaced, or stays if this fails.
    ///
    /// # Errors
    /// Errors of renaming.
    pub fn finish(self, target: &Path) -> io::Result<()> {
        let mut known = known();
        let old = aside(&self.path);
        remove(&old)?;
        // A directory cannot be renamed over a full one, and removing that piece by piece would leave half of
        // it.
        let replaces = fs::symlink_metadata(&self.path)?.is_dir() && present(target)?;
        if replaces {
            fs::rename(target, &old)?;
        }
        let renamed = fs::rename(&self.path, target);
        if replaces {
            // Nothing better can be done with a second failure: what is left is swept by the next one.
            let _ = if renamed.is_ok() { remove(&old) } else { fs::rename(&old, target) };
        }
        if renamed.is_ok() {
            known.remove(&self.path);
        }
        drop(known);
        renamed
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        let mut known = known();
        if known.remove(&self.path) {
            // Nothing better can be done with a failure here.
            let _ = remove(&self.path);
        }
    }
}

/// Removes everything that is staged, and lets nothing be begun or finished from then on: the caller ends the
/// process.
pub fn abandon() {
    let known = known();
    for _ in 0..ROUNDS {
        let there: Vec<&PathBuf> = known.iter().filter(|path| fs::symlink_metadata(path).is_ok()).collect();
        if there.is_empty() {
            break;
        }
        for path in there {
            let _ = remove(path);
        }
    }
    // Never unlocked.
    std::mem::forget(known);
}

/// Path of a replaced directory's old content, beside the new one; it is removed with the staged part.
fn aside(part: &Path) -> PathBuf {
    let mut name = part.as_os_str().to_owned();
    name.push(".old");
    PathBuf::from(name)
}

/// True if a file exists at the path, also for a dangling link.
///
/// # Errors
///
/// Errors of the file system.
pub fn present(path: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(path) {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Removes what is there, if anything is.
///
/// # Errors
/// A file that cannot be removed.
pub fn remove(path: &Path) -> io::Result<()> {
    let removed = match fs::symlink_metadata(path) {
        Ok(about) if about.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(error) => Err(error),
    };
    match removed {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn what_is_finished_has_its_name_and_what_is_dropped_is_gone() {
        let here = tempfile::tempdir().unwrap();
        let at = |name: &str| here.path().join(name);
        for content in ["old", "new"] {
            let making = Staged::directory(at(".x.part")).unwrap();
            fs::write(making.path().join(content), content).unwrap();
            making.finish(&at("x")).unwrap();
            assert_eq!((names(here.path()), names(&at("x"))), (vec!["x".to_owned()], vec![content.to_owned()]));
        }
        drop(Staged::directory(at(".x.part")).unwrap());
        let (making, _) = Staged::file(at(".y.part")).unwrap();
        // A file takes no directory's place.
        assert!(making.finish(&at("x")).is_err());
        assert_eq!((names(here.path()), names(&at("x"))), (vec!["x".to_owned()], vec!["new".to_owned()]));
    }

    #[test]
    fn a_link_under_the_name_of_a_part_is_removed_and_not_followed() {
        let here = tempfile::tempdir().unwrap();
        let (mine, part) = (here.path().join("mine"), here.path().join(".x.part"));
        fs::write(&mine, "mine").unwrap();
        std::os::unix::fs::symlink(&mine, &part).unwrap();
        let (making, file) = Staged::file(part).unwrap();
        io::Write::write_all(&mut &file, b"theirs").unwrap();
        making.finish(&here.path().join("x")).unwrap();
        assert_eq!(fs::read_to_string(mine).unwrap(), "mine");
    }
}
