//! Last lines of `cargo test`, which list skipped tests; this is not a test itself.
//!
//! It reads the notes that tests leave about data outside of the repository (`tests/witness/data.rs`) and
//! about parts that take minutes (`tests/common/long.rs`). Cargo runs packages in the order of their names,
//! so this belongs to the last of them. It has no harness that would capture its output. Limits: notes are
//! those of each test's latest run. Tests that run one at a time, on the main thread, leave none.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn main() {
    if std::env::args().any(|argument| argument == "--list") {
        return;
    }
    let notes = Path::new(env!("CARGO_TARGET_TMPDIR"));
    say_what_data_were_absent(&noted(&notes.join("witness")));
    say_what_takes_long(&noted(&notes.join("long")));
}

/// Notes of a folder: two words of their names, and what they say.
fn noted(folder: &Path) -> Vec<(String, String, String)> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<_> = entries
        .flatten()
        .filter_map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            let (first, second) = name.split_once(' ')?;
            Some((first.to_owned(), second.to_owned(), fs::read_to_string(entry.path()).ok()?))
        })
        .collect();
    found.sort();
    found
}

fn say_what_data_were_absent(notes: &[(String, String, String)]) {
    let mut tests: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (test, file, said) in notes {
        let missed = tests.entry(test).or_default();
        missed.extend((said == "absent").then(|| file.replace('%', "/")));
    }
    let asked = tests.len();
    tests.retain(|_, missed| !missed.is_empty());
    if asked == 0 {
        println!("witnesses: none has run that compares with data outside of the repository");
    } else if tests.is_empty() {
        println!("witnesses: all {asked} tests that compare with data outside of the repository found them");
    } else {
        for (test, missed) in &tests {
            println!("witness skipped, in part or whole: {}: {} absent", test.replace('.', "::"), missed.join(", "));
        }
        println!(
            "witnesses: {} of {asked} tests that compare with data outside of the repository skipped some or all of \
             them. GNSS_TWIN_DATA (default ../shared/data) names the directory; no licence allows real GPS subframes \
             or an antenna recording to be shipped (data/README.md)",
            tests.len()
        );
    }
}

fn say_what_takes_long(notes: &[(String, String, String)]) {
    let skipped: Vec<&(String, String, String)> = notes.iter().filter(|(_, _, said)| said == "skipped").collect();
    for (program, test, _) in &skipped {
        println!("long, skipped in part or whole: {program}: {}", test.replace('.', "::"));
    }
    println!(
        "long tests: {} of {} that have run left their long part out; GNSS_TWIN_LONG=1 runs them, as .ci/long does",
        skipped.len(),
        notes.len()
    );
}
