//! Damage to what a receiver says of authentication: false tags accepted, true ones refused, rows cut off.

use crate::Kind;
use crate::fixes::kind;
use crate::run::{FORGED, Rx, Scene};
use crate::table::Table;

/// Gives rows of the table another result, as many as said, and moves the receiver's own counts with them.
fn turn(rx: &mut Rx, chosen: fn(&Table, usize) -> bool, to: &'static str, most: f64) {
    let table = rx.table("osnma");
    let rows: Vec<usize> = (0..table.rows.len()).filter(|row| chosen(table, *row)).take(most as usize).collect();
    assert!(!rows.is_empty(), "no row to turn");
    let was: Vec<String> = rows.iter().map(|row| table.text(*row, "result").to_owned()).collect();
    rows.iter().for_each(|row| table.put(*row, "result", to));
    let counts = &mut rx.receiver()["osnma"]["tags"]["all"];
    for result in was {
        counts[&result] = (counts[&result].as_u64().unwrap() - 1).into();
        counts[to] = (counts[to].as_u64().unwrap() + 1).into();
    }
}

pub fn kinds() -> Vec<Kind> {
    const CUT: [&str; 1] = ["tags in the table against the receiver's own counts"];
    vec![
        kind!(
            "false tags called authentic",
            "tags",
            None,
            1.0,
            &["false tags taken for authentic"],
            Verified,
            |rx, n| {
                let is_false =
                    |t: &Table, row: usize| t.text(row, "result") == "refused" && t.text(row, "satellite") == FORGED;
                turn(rx, is_false, "authentic", n);
            }
        ),
        kind!("true tags refused", "tags", None, 1.0, &["true tags refused"], Verified, |rx, n| {
            let is_true =
                |t: &Table, row: usize| t.text(row, "result") == "authentic" && t.text(row, "satellite") != FORGED;
            turn(rx, is_true, "refused", n);
        }),
        kind!("rows of tags cut off", "rows", None, 1.0, &CUT, Verified, |rx, n| {
            let table = rx.table("osnma");
            table.rows.truncate(table.rows.len() - n as usize);
        }),
        kind!("tags twice", "rows", None, 1.0, &CUT, Verified, |rx, n| {
            let table = rx.table("osnma");
            let again: Vec<Vec<String>> = table.rows.iter().take(n as usize).cloned().collect();
            table.rows.extend(again);
        }),
        kind!(
            "first authentic data later",
            "s",
            Some(0.2),
            40.0,
            &["time to first authentic data"],
            Verified,
            |rx, s| {
                let first = &mut rx.receiver()["osnma"]["first_authentic_s"];
                *first = (first.as_f64().unwrap() + s).into();
            }
        ),
    ]
}
