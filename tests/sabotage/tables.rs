//! Damage to searches, messages, events and `receiver.json`.

use serde_json::json;

use crate::Kind;
use crate::fixes::kind;
use crate::run::{Rx, Scene};
use crate::table::Table;

const ONE: &str = "G13";

fn found(table: &Table, row: usize) -> bool {
    table.text(row, "acquired") == "true"
}

/// Row of an event of a satellite.
fn event(rx: &mut Rx, sv: &str, name: &str) -> usize {
    let table = rx.table("events");
    table.of(sv).into_iter().find(|row| table.text(*row, "event") == name).unwrap()
}

pub fn kinds() -> Vec<Kind> {
    [searches(), messages(), events(), sums()].into_iter().flatten().collect()
}

fn searches() -> Vec<Kind> {
    const CONTRADICTS: [&str; 1] = ["searches whose verdict contradicts their statistic"];
    vec![
        kind!(
            "Doppler found off",
            "Hz",
            Some(100.0),
            500.0,
            &["Doppler found over half a bin of the search, largest"],
            AtRest,
            |rx, hz| {
                rx.table("acquisition").map_where("doppler_hz", found, |_, value| value + hz);
            }
        ),
        kind!(
            "Doppler found with its sign turned",
            "",
            None,
            1.0,
            &["Doppler found over half a bin of the search, largest"],
            AtRest,
            |rx, _| {
                rx.table("acquisition").map_where("doppler_hz", found, |_, value| -value);
            }
        ),
        kind!(
            "code phase found off",
            "chips",
            Some(0.05),
            1.0,
            &["code phase found over two thirds of a cell of the search, largest"],
            AtRest,
            |rx, chips| {
                rx.table("acquisition").map_where("code_phase_chips", found, |_, value| value + chips);
            }
        ),
        kind!(
            "C/N0 found off",
            "dB",
            Some(1.5),
            10.0,
            &["C/N0 found against the true one, largest"],
            AtRest,
            |rx, db| {
                rx.table("acquisition").map_where("cn0_dbhz", found, |_, value| value + db);
            }
        ),
        kind!(
            "statistics of found satellites smaller",
            "times",
            Some(0.95),
            0.2,
            &CONTRADICTS,
            AtRest,
            |rx, factor| {
                rx.table("acquisition").map_where("statistic", found, |_, value| value * factor);
            }
        ),
        kind!("thresholds larger", "times", Some(1.3), 4.0, &CONTRADICTS, AtRest, |rx, factor| {
            rx.table("acquisition").map("threshold", |_, value| value * factor);
        }),
        kind!(
            "a tracked satellite said not to be found",
            "",
            None,
            1.0,
            &["satellites tracked that were never found"],
            AtRest,
            |rx, _| {
                let row = rx.table("acquisition").of(ONE)[0];
                rx.table("acquisition").put(row, "acquired", false);
            }
        ),
        kind!("a satellite found that is not there", "", None, 1.0, &["false acquisitions"], AtRest, |rx, _| {
            let row = rx.table("acquisition").of("G01")[0];
            rx.table("acquisition").put(row, "acquired", true);
        }),
        kind!("searches doubled", "rows", None, 1.0, &["rows doubled"], AtRest, |rx, _| {
            let table = rx.table("acquisition");
            let row = table.rows[3].clone();
            table.rows.insert(4, row);
        }),
        kind!(
            "two satellites' searches exchanged",
            "",
            None,
            1.0,
            &["code phase found over two thirds of a cell of the search, largest"],
            AtRest,
            |rx, _| {
                rx.table("acquisition").swap_satellites(ONE, "G23", 1);
            }
        ),
    ]
}

fn messages() -> Vec<Kind> {
    const WRONG: [&str; 1] = ["wrong navigation parameters"];
    const MISSING: [&str; 1] = ["parameters missing of complete messages"];
    vec![
        kind!("a parameter off by one", "", None, 1.0, &WRONG, AtRest, |rx, by| {
            let row = rx.table("navigation").of(ONE)[14];
            let raw = rx.table("navigation").get(row, "raw") + by;
            rx.table("navigation").put(row, "raw", raw as i64);
        }),
        kind!("a parameter with its sign turned", "", None, 1.0, &WRONG, AtRest, |rx, _| {
            let row = rx.table("navigation").of(ONE)[14];
            let raw = -rx.table("navigation").get(row, "raw");
            rx.table("navigation").put(row, "raw", raw as i64);
        }),
        kind!("an orbit's parameters missing", "rows", None, 3.0, &MISSING, AtRest, |rx, count| {
            let rows = rx.table("navigation").of(ONE);
            let table = rx.table("navigation");
            let orbit: Vec<usize> =
                rows.into_iter().filter(|row| table.get(*row, "issue") > 0.0).take(count as usize).collect();
            table.keep(|_, row| !orbit.contains(&row));
        }),
        kind!(
            "the ionosphere's parameters missing of all but so many satellites",
            "satellites",
            Some(1.0),
            0.0,
            &MISSING,
            AtRest,
            |rx, left| {
                let table = rx.table("navigation");
                let kept = table.clone();
                table.keep(|table, row| {
                    let name = table.text(row, "parameter");
                    let ionosphere = name.starts_with("alpha") || name.starts_with("beta");
                    !ionosphere || (left > 0.0 && kept.text(row, "sv") == ONE)
                });
            }
        ),
        kind!("parameters doubled", "rows", None, 1.0, &["rows doubled"], AtRest, |rx, _| {
            let table = rx.table("navigation");
            let row = table.rows[20].clone();
            table.rows.push(row);
        }),
        kind!("messages of two satellites exchanged", "rows", None, 1.0, &WRONG, AtRest, |rx, _| {
            let table = rx.table("navigation");
            for row in 0..table.rows.len() {
                let other = match table.text(row, "sv") {
                    ONE => "G23",
                    "G23" => ONE,
                    _ => continue,
                };
                table.put(row, "sv", other);
            }
        }),
        kind!("another issue of data", "", None, 1.0, &WRONG, AtRest, |rx, by| {
            let table = rx.table("navigation");
            for row in table.of(ONE) {
                let issue = table.get(row, "issue");
                table.put(row, "issue", if issue > 0.0 { issue + by } else { issue });
            }
        }),
    ]
}

fn events() -> Vec<Kind> {
    const ORDER: [&str; 1] = ["events out of their natural order"];
    vec![
        kind!(
            "a loss of lock that never was",
            "",
            None,
            1.0,
            &["unexpected losses of lock", "counts of receiver.json that the tables contradict"],
            AtRest,
            |rx, _| {
                let table = rx.table("events");
                let mut row = table.rows[table.of(ONE)[0]].clone();
                row[0] = "100000000".to_owned();
                row[3] = "loss_of_lock".to_owned();
                table.rows.push(row);
            }
        ),
        kind!("a cycle slip that never was", "", None, 1.0, &["unexpected cycle slips"], AtRest, |rx, _| {
            let table = rx.table("events");
            let mut row = table.rows[table.of(ONE)[0]].clone();
            row[0] = "100000000".to_owned();
            row[3] = "cycle_slip".to_owned();
            table.rows.push(row);
        }),
        kind!("no lock before the bits", "", None, 1.0, &ORDER, AtRest, |rx, _| {
            let row = event(rx, ONE, "phase_locked");
            rx.table("events").keep(|_, other| other != row);
        }),
        kind!("no frame before the observations", "", None, 1.0, &ORDER, AtRest, |rx, _| {
            let row = event(rx, ONE, "frame_synchronised");
            rx.table("events").keep(|_, other| other != row);
        }),
        kind!("a frame later than the observations", "s", Some(0.015), 5.0, &ORDER, AtRest, |rx, seconds| {
            let row = event(rx, ONE, "frame_synchronised");
            let sample = rx.table("events").get(row, "sample") + seconds * 2.6e6;
            rx.table("events").put(row, "sample", sample as u64);
        }),
        kind!(
            "a message complete later than used",
            "s",
            Some(5.0),
            15.0,
            &["fixes of other satellites than those observed"],
            AtRest,
            |rx, seconds| {
                let row = event(rx, ONE, "ephemeris_complete");
                let sample = rx.table("events").get(row, "sample") + seconds * 2.6e6;
                rx.table("events").put(row, "sample", sample as u64);
            }
        ),
        kind!("events doubled", "rows", None, 1.0, &["rows doubled"], AtRest, |rx, _| {
            let table = rx.table("events");
            let row = table.rows[5].clone();
            table.rows.insert(6, row);
        }),
        kind!(
            "a healthy satellite said to be unhealthy",
            "",
            None,
            1.0,
            &["fixes of other satellites than those observed"],
            AtRest,
            |rx, _| {
                let table = rx.table("events");
                let mut row = table.rows[table.of(ONE)[0]].clone();
                row[0] = "60000000".to_owned();
                row[3] = "unhealthy".to_owned();
                table.rows.push(row);
            }
        ),
    ]
}

fn sums() -> Vec<Kind> {
    const COUNTS: [&str; 1] = ["counts of receiver.json that the tables contradict"];
    vec![
        kind!("fixes counted otherwise", "fixes", None, 1.0, &COUNTS, AtRest, |rx, by| {
            let count = rx.receiver()["fixes"].as_u64().unwrap();
            rx.receiver()["fixes"] = json!(count + by as u64);
        }),
        kind!("first fix said earlier", "s", Some(1e-8), 0.1, &COUNTS, AtRest, |rx, by| {
            let first = rx.receiver()["first_fix_s"].as_f64().unwrap();
            rx.receiver()["first_fix_s"] = json!(first - by);
        }),
        kind!("a satellite said to be found", "", None, 1.0, &COUNTS, AtRest, |rx, _| {
            rx.receiver()["acquired"].as_array_mut().unwrap().push(json!("G01"));
        }),
        kind!("fewer satellites said to be used", "", None, 3.0, &COUNTS, AtRest, |rx, by| {
            let used = rx.receiver()["used"].as_array_mut().unwrap();
            used.truncate(used.len() - by as usize);
        }),
        kind!("losses counted otherwise", "", None, 1.0, &COUNTS, AtRest, |rx, _| rx.receiver()["losses"] = json!(1)),
    ]
}
