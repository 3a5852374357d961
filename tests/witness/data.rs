//! Where the outside data are.

use std::path::PathBuf;

/// The path of a file under `GNSS_TWIN_DATA`, or `None` with one line printed when it is not there.
pub fn external(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GNSS_TWIN_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = root.join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not here (set GNSS_TWIN_DATA to the witness data)", path.display());
    None
}
