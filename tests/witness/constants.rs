//! Constants between signals and between bands against the table of the book, which says what holds each:
//! phases, shares of power, delays and clocks. They are the same on both sides, so no closed loop sees an
//! error in one.

use std::collections::BTreeSet;
use std::path::Path;

use gnss::signal::{self, Component, Signal};

const PAGE: &str = include_str!("../../book/src/validation.md");

/// Phases in cycles that PocketSDR takes for those of components against the reference signal of their band:
/// it adds them to the phases that it measures (its source, `sdr_pvt.c`, by RINEX 3.05, table A23). Where it
/// adds half a cycle or nothing, the sign of its replica is part of the phase.
const POCKET_SDR: [(&str, &str, f64); 12] = [
    ("GPS L1C", "1, pilot", 0.25),
    ("GPS L1C", "2, data", 0.25),
    ("GPS L5", "2, pilot", -0.25),
    ("Galileo E5a", "2, pilot", 0.25),
    ("Galileo E5b", "2, pilot", 0.25),
    ("Galileo E5", "2, pilot", 0.25),
    ("Galileo E5", "4, pilot", 0.25),
    ("BeiDou B1C", "1, pilot", 0.25),
    ("BeiDou B2a", "2, pilot", 0.25),
    ("QZSS L1C", "1, pilot", 0.25),
    ("QZSS L1C", "2, data", 0.25),
    ("QZSS L5", "2, pilot", -0.25),
];

/// Cells of the rows of the table below a heading of that page.
fn table(heading: &str) -> Vec<Vec<String>> {
    let section = PAGE.split(heading).nth(1).unwrap_or_else(|| panic!("no section {heading}"));
    let rows = section.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
    rows.skip(2).map(cells).collect()
}

/// Names of a signal's components as the table has them, in the program's order.
fn names(signal: &Signal) -> Vec<String> {
    let kind = |component: &Component| if component.message.is_some() { "data" } else { "pilot" };
    signal.components.iter().zip(1..).map(|(component, number)| format!("{number}, {}", kind(component))).collect()
}

/// Panics unless the words say what holds a constant: an antenna or messages of satellites by a test, another
/// receiver, or a document.
fn is_held(row: &[String], by: &str) {
    assert!(["antenna", "satellites", "PocketSDR", "document"].iter().any(|word| by.contains(word)), "{row:?}");
    for file in by.split('`').filter(|word| word.ends_with(".rs")) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        assert!(path.exists(), "{row:?}: {file}");
    }
    // Antennas and satellites speak through a test.
    let by_test = by.contains("antenna") || by.contains("satellites");
    assert!(!by_test || by.contains(".rs`"), "{row:?}");
}

#[test]
fn each_component_has_the_phase_and_the_share_of_power_of_a_row_that_says_what_holds_them() {
    let rows = table("### Phases and shares of power");
    let mut own = Vec::new();
    for signal in signal::SIGNALS {
        for (name, component) in names(signal).into_iter().zip(signal.components) {
            let of = |row: &&Vec<String>| row[0] == signal.name && row[1] == name;
            let found: Vec<&Vec<String>> = rows.iter().filter(of).collect();
            let [row] = found[..] else { panic!("{} rows of {}, {name}", found.len(), signal.name) };
            assert_eq!(row[2].replace('−', "-").parse(), Ok(component.phase_cycles), "{row:?}");
            let fraction = row[4].split_once('/').map_or(row[4].parse().ok(), |(part, whole)| {
                Some(part.parse::<f64>().ok()? / whole.parse::<f64>().ok()?)
            });
            assert_eq!(fraction, Some(component.power_share), "{row:?}");
            is_held(row, &row[3]);
            is_held(row, &row[5]);
            let aligned =
                POCKET_SDR.iter().find(|(of, component, _)| (*of, *component) == (signal.name, name.as_str()));
            assert_eq!(aligned.is_some(), row[3].contains("PocketSDR"), "{row:?}");
            assert!(aligned.is_none_or(|(.., cycles)| *cycles == component.phase_cycles), "{row:?}");
            own.push((signal.name, name));
        }
    }
    assert_eq!(own.len(), rows.len(), "a row is of no component");
}

#[test]
fn each_signal_has_a_row_that_says_what_holds_its_delay_and_its_time() {
    let rows = table("### Delays and clocks");
    let named: Vec<&str> = rows.iter().flat_map(|row| row[0].split(", ")).collect();
    let signals: BTreeSet<&str> = signal::SIGNALS.iter().map(|signal| signal.name).collect();
    assert_eq!(named.len(), signals.len(), "{named:?}");
    assert_eq!(named.iter().copied().collect::<BTreeSet<_>>(), signals);
    for row in &rows {
        is_held(row, &row[2]);
        is_held(row, &row[4]);
        for signal in row[0].split(", ").filter_map(Signal::find) {
            assert_eq!(row[3], signal.time.name, "{row:?}");
        }
    }
}
