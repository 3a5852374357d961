//! The table of the book's page of signals against the signals themselves.

use std::collections::BTreeSet;

use super::{Carrier, SIGNALS, Signal};
use crate::satellite::Sv;

const PAGE: &str = include_str!("../../../book/src/signals.md");

/// Cells of the table below a heading, its head first.
fn table(heading: &str) -> Vec<Vec<&'static str>> {
    let section = PAGE.split(heading).nth(1).unwrap_or_else(|| panic!("no section {heading}"));
    let rows = section.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    rows.map(|line| line.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

/// A number of the page, which has a typographic minus and thin groups of digits.
fn number(text: &str) -> f64 {
    text.replace('−', "-").replace(' ', "").parse().unwrap_or_else(|_| panic!("{text:?} is no number"))
}

/// A carrier and the distance of its channels, in Hz.
fn carrier_hz(text: &str) -> (f64, f64) {
    let mega = |text: &str| 1e6 * number(text);
    match text.split_once(" + ") {
        Some((centre, step)) => (mega(centre), mega(step.strip_suffix(" k").unwrap())),
        None => (mega(text), 0.0),
    }
}

/// The first word of a share such as `3/4 of the power`, or zero.
fn share(text: &str) -> f64 {
    let fraction = text.split(' ').next().and_then(|word| word.split_once('/'));
    fraction.map_or(0.0, |(part, whole)| number(part) / number(whole))
}

/// Names of a signal's messages without the signals that share them, and their symbols a second. Under a code
/// of symbols they are bits.
fn messages(signal: &Signal) -> (BTreeSet<String>, BTreeSet<u32>) {
    let messages = || signal.components.iter().filter_map(|component| component.message);
    let name = |name: &str| name.split(" of ").flat_map(|part| part.split(" on ")).next().unwrap().to_owned();
    let [first, last] = signal.constellation;
    let rates = messages().flat_map(|message| {
        // A bit of GLONASS is two symbols of a meander (GLONASS ICD L1, L2 5.1, 3.3.2.2).
        let turns = if message.name == "GNAV" { 2 } else { 1 };
        (first..=last).map(move |number| {
            let symbols = turns * (message.bit)(Sv { system: signal.system, number }).len();
            (1.0 / (message.symbol_s * symbols as f64)).round() as u32
        })
    });
    (messages().map(|message| name(message.name)).collect(), rates.collect())
}

#[test]
fn the_book_s_table_of_signals_has_their_names_carriers_codes_messages_and_powers() {
    let rows = table(&format!("## All {} signals", SIGNALS.len()));
    assert!(PAGE.contains(&format!("The program has {} signals of", SIGNALS.len())));
    let head = [
        "signal",
        "carrier (MHz)",
        "modulation",
        "chip rate (Mchip/s)",
        "code (chips, ms)",
        "pilot",
        "message",
        "symbols/s",
        "least power (dBW)",
    ];
    assert_eq!(rows[0], head);
    let names: BTreeSet<&str> = rows[2..].iter().map(|row| row[0]).collect();
    assert_eq!((names, rows.len() - 2), (SIGNALS.iter().map(|signal| signal.name).collect(), SIGNALS.len()));
    for row in &rows[2..] {
        let signal = Signal::find(row[0]).unwrap();
        let near = |found: f64, own: f64, what: &str| {
            assert!((found - own).abs() <= 1e-9 * own.abs(), "{signal}: {what} {found}, the signal has {own}");
        };
        let (found, own) = (
            carrier_hz(row[1]),
            match signal.carrier {
                Carrier::Common(hz) => (hz, 0.0),
                Carrier::Channels { centre_hz, step_hz, .. } => (centre_hz, step_hz),
            },
        );
        near(found.0, own.0, "carrier");
        near(found.1, own.1, "distance of channels");
        for component in signal.components {
            near(1e6 * number(row[3]), component.chip_rate_hz, "chip rate");
        }
        // Two codes of L2C have their chips in turn: each has half of those that the program counts.
        let halves = if signal.name.ends_with("L2C") { 2 } else { 1 };
        let codes: BTreeSet<(u32, u32)> = (signal.components.iter())
            .map(|component| (component.code_chips / halves, (1e3 * component.period_s()).round() as u32))
            .collect();
        let text = if row[4] == "as GPS" { rows.iter().find(|row| row[0] == "GPS L2C").unwrap()[4] } else { row[4] };
        let found = text.split("; ").map(|code| {
            let (chips, ms) = code.trim_start_matches(char::is_alphabetic).split_once(", ").unwrap();
            (number(chips) as u32, number(ms) as u32)
        });
        assert_eq!(found.collect::<BTreeSet<_>>(), codes, "{signal}");
        let pilots = signal.components.iter().filter(|component| component.message.is_none());
        near(share(row[5]), pilots.map(|pilot| pilot.power_share).sum(), "share of pilots");
        let (own, rates) = messages(signal);
        let found: Vec<String> = row[6].split(" and ").map(|name| name.replace(" or ", "/")).collect();
        assert_eq!(found.len(), own.len(), "{signal}");
        for name in own {
            assert!(found.iter().any(|one| *one == name || one.starts_with(&format!("{name} "))), "{signal}: {name}");
        }
        let words = row[7].trim_end_matches(" bit/s").split(" and ").flat_map(|part| part.split(" or "));
        assert_eq!(words.map(|word| number(word) as u32).collect::<BTreeSet<_>>(), rates, "{signal}");
        near(number(row[8]), signal.minimum_power_dbw.unwrap(), "least power");
    }
}

#[test]
fn the_book_s_table_of_bands_has_every_signal_in_the_columns_of_its_carrier() {
    let rows = table("## System by band");
    let mut found = BTreeSet::new();
    for row in &rows[2..] {
        let system = row[0].trim_start_matches('[').split(']').next().unwrap();
        for (band, cell) in rows[0].iter().zip(row).skip(1) {
            let range: Vec<f64> = band.trim_end_matches(" MHz").split(" to ").map(number).collect();
            for name in cell.split(", ").filter(|name| !name.is_empty()) {
                let signal = Signal::find(&format!("{system} {name}")).unwrap_or_else(|| panic!("{system} {name}"));
                let (Carrier::Common(hz) | Carrier::Channels { centre_hz: hz, .. }) = signal.carrier;
                // E5 is in the bands of both of its halves, 15.345 MHz beside its centre.
                let beside_mhz = if signal.name == "Galileo E5" { 15.346 } else { 0.5 };
                let from = 1e-6 * hz - range[range.len() - 1];
                let to = 1e-6 * hz - range[0];
                assert!(from <= beside_mhz && to >= -beside_mhz, "{signal}: {band}");
                found.insert(signal.name);
            }
        }
    }
    assert_eq!(found, SIGNALS.iter().map(|signal| signal.name).collect());
}
