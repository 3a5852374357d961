//! Tests that take minutes run with `GNSS_TWIN_LONG=1` alone; `skipped.rs` counts those that did not.

use std::path::Path;

/// True if the long part of the running test is requested. If it is not, that is noted under the test's name.
pub fn is_asked_for() -> bool {
    let is_long = std::env::var_os("GNSS_TWIN_LONG").is_some();
    let thread = std::thread::current();
    if let Some(test) = thread.name() {
        let notes = Path::new(env!("CARGO_TARGET_TMPDIR")).join("long");
        let note = notes.join(format!("{} {}", env!("CARGO_CRATE_NAME"), test.replace("::", ".")));
        // A note that cannot be written is missed in the count; no test depends on it.
        let _ = std::fs::create_dir_all(&notes);
        let _ = std::fs::write(note, if is_long { "run" } else { "skipped" });
    }
    is_long
}
