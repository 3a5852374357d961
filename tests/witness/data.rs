//! Where the outside data are, and which tests missed them.

use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The path of a file under `GNSS_TWIN_DATA`, or `None` where it is not there. `tests/witness_skips.rs` reports at the end of
/// the run what was missed: a line goes past the capture of test output at once, and a note to the build's directory.
pub fn external(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GNSS_TWIN_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = root.join(name);
    let there = path.exists();
    note(name, there);
    if !there {
        let _ = writeln!(std::io::stderr(), "skipped: {} is absent", path.display());
    }
    there.then_some(path)
}

/// Remembers whether this test found that file; other targets that include these modules leave the notes alone.
fn note(name: &str, there: bool) {
    if env!("CARGO_CRATE_NAME") != "witness" {
        return;
    }
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("main").replace("::", ".");
    let notes = Path::new(env!("CARGO_TARGET_TMPDIR")).join("witness");
    let note = notes.join(format!("{test} {}", name.replace('/', "%")));
    // A note that cannot be written is missed in the tally; no test depends on it.
    let _ = std::fs::create_dir_all(&notes);
    let _ = std::fs::write(note, if there { "found" } else { "absent" });
}
