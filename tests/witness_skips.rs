//! Not a test: the last lines of `cargo test`, which say what the witnesses did not see.
//!
//! Reads the notes that the tests of `tests/witness` leave about files outside of the repository
//! (`tests/witness/data.rs`). Its name sorts behind theirs, and it has no harness that would capture what it
//! prints. Limits: notes are those of each test's latest run; tests that run one at a time, on the main
//! thread, leave none.

use std::collections::BTreeMap;
use std::path::Path;

fn main() {
    if std::env::args().any(|argument| argument == "--list") {
        return;
    }
    let notes = Path::new(env!("CARGO_TARGET_TMPDIR")).join("witness");
    let Ok(entries) = std::fs::read_dir(&notes) else {
        println!("witnesses: none has run that compares with data outside of the repository");
        return;
    };
    let mut tests: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let Some((test, file)) = name.split_once(' ') else { continue };
        let absent = std::fs::read_to_string(entry.path()).is_ok_and(|text| text == "absent");
        let missed = tests.entry(test.to_owned()).or_default();
        missed.extend(absent.then(|| file.replace('%', "/")));
    }
    let asked = tests.len();
    tests.retain(|_, missed| !missed.is_empty());
    if tests.is_empty() {
        println!("witnesses: all {asked} tests that compare with data outside of the repository found them");
        return;
    }
    for (test, missed) in &mut tests {
        missed.sort();
        println!("witness skipped, in part or whole: {}: {} absent", test.replace('.', "::"), missed.join(", "));
    }
    println!(
        "witnesses: {} of {asked} tests that compare with data outside of the repository skipped some or all of them. \
         GNSS_TWIN_DATA (default ../shared/data) names the directory; no licence allows real GPS subframes or an \
         antenna recording to be shipped (data/README.md)",
        tests.len()
    );
}
