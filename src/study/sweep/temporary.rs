//! Names for work in progress: they say whose it is, so that what a dead run left behind can be swept and
//! nothing else.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use super::StudyError;
use analysis::show::staged::{Staged, remove};

pub(super) const PREFIX: &str = ".tmp";
/// Work of another machine whose processes cannot be seen is dead after so long.
const FOREIGN_AGE: Duration = Duration::from_secs(2 * 86_400);

fn host() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let fits = |c: &char| c.is_ascii_alphanumeric() || *c == '-';
    name.trim().chars().filter(fits).take(40).collect()
}

/// A name that nobody else takes: `.tmp.<host>.<process>.<number>`.
pub(super) fn name() -> String {
    // A process-wide count, as a name must differ from every other of this process.
    static COUNT: AtomicU64 = AtomicU64::new(0);
    format!("{PREFIX}.{}.{}.{}", host(), std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}

/// Removes what dead processes left in a directory; what belongs to a living one, or may, stays.
pub(super) fn sweep(directory: &Path) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let mut parts = name.split('.').skip(1);
        if parts.next() != PREFIX.get(1..) {
            continue;
        }
        let dead = match (parts.next(), parts.next()) {
            (Some(other), Some(process)) if other == host() => {
                matches!(Path::new("/proc").join(process).try_exists(), Ok(false))
            }
            _ => old(&entry),
        };
        if dead {
            // Failing to sweep harms nobody: these names are never read.
            let _ = remove(&entry.path());
        }
    }
}

fn old(entry: &fs::DirEntry) -> bool {
    let modified = entry.metadata().and_then(|about| about.modified());
    modified.is_ok_and(|then| SystemTime::now().duration_since(then).is_ok_and(|age| age > FOREIGN_AGE))
}

/// A directory that is removed with its owner.
pub(super) fn directory(parent: &Path) -> Result<Staged, StudyError> {
    let path = parent.join(name());
    Staged::directory(path.clone()).map_err(|source| StudyError::Create { path, source })
}
