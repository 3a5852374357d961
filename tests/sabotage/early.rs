//! Damage that wide limits would hide: before the ionosphere's parameters are known, of values that are
//! frozen, of fixes that do not come, and of what two bands show of the ionosphere.

use crate::Kind;
use crate::fixes::kind;
use crate::run::Scene;
use crate::table::Table;

const REPEATED: [&str; 1] = ["rows that repeat the values before"];
const OWN: [&str; 2] = [
    "epochs without a fix that its own observations allow",
    "epochs without a fix that its own observations allow, where errors of any size are expected",
];

/// Values of a column stay as they are in one row for the rows after it.
fn freeze(table: &mut Table, column: &str, from: usize, rows: usize) {
    let value = table.get(from, column);
    (from..(from + rows).min(table.rows.len())).for_each(|row| table.put(row, column, value));
}

pub fn kinds() -> Vec<Kind> {
    let mut all = before_the_page();
    all.extend(frozen());
    all.extend(dispersion());
    all
}

fn before_the_page() -> Vec<Kind> {
    const FLAT: [&str; 3] =
        ["horizontal error, mean", "horizontal error, 95 %", "horizontal error, largest against its limit"];
    const UP: [&str; 3] = ["vertical error, mean", "vertical error, 95 %", "vertical error, largest against its limit"];
    vec![
        kind!("positions east, ionosphere unknown", "m", Some(0.3), 10.0, &FLAT, Early, |rx, m| {
            crate::fixes::move_by(rx, [m, 0.0, 0.0]);
        }),
        kind!("positions up, ionosphere unknown", "m", Some(0.3), 20.0, &UP, Early, |rx, m| {
            crate::fixes::move_by(rx, [0.0, 0.0, m]);
        }),
        kind!(
            "sigma upwards, ionosphere unknown",
            "of 1",
            Some(1.1),
            1.5,
            &["vertical sigma over the expected one, largest"],
            Early,
            |rx, factor| rx.table("fixes").map("sigma_up_m", |_, value| factor * value)
        ),
    ]
}

fn frozen() -> Vec<Kind> {
    vec![
        kind!("position frozen", "rows", None, 30.0, &REPEATED, AtRest, |rx, rows| {
            for column in ["x_m", "y_m", "z_m"] {
                freeze(rx.table("fixes"), column, 100, rows as usize);
            }
        }),
        kind!("velocities times a factor", "of 1", Some(0.95), 0.3, &["velocity error, rms"], AtRest, |rx, factor| {
            for column in ["vx_mps", "vy_mps", "vz_mps"] {
                rx.table("fixes").map(column, |_, value| factor * value);
            }
        }),
        kind!("C/N0 of one satellite frozen", "rows", None, 30.0, &REPEATED, AtRest, |rx, rows| {
            let table = rx.table("observations");
            let own: Vec<usize> = table.of("G13").into_iter().take(rows as usize).collect();
            let value = table.get(own[0], "cn0_dbhz");
            own.into_iter().for_each(|row| table.put(row, "cn0_dbhz", value));
        }),
        kind!("no fix", "", None, 1.0, &OWN, AtRest, |rx, _| rx.table("fixes").keep(|_, _| false)),
        kind!("no fix, excused", "", None, 1.0, &OWN, Bounded, |rx, _| rx.table("fixes").keep(|_, _| false)),
    ]
}

fn dispersion() -> Vec<Kind> {
    const ERROR: [&str; 3] = [
        "ionosphere by two bands, error, mean",
        "ionosphere by two bands, error, 95 %",
        "ionosphere by two bands, error, largest against its limit",
    ];
    vec![
        kind!("ionosphere by two bands", "m", Some(0.1), 3.0, &ERROR, TwoBands, |rx, m| {
            rx.table("ionosphere").map("delay_m", |_, value| value + m);
        }),
        kind!("scale of the ionosphere by two bands", "of 1", Some(1.01), 1.6, &ERROR, TwoBands, |rx, factor| {
            rx.table("ionosphere").map("delay_m", |_, value| factor * value);
        }),
        kind!(
            "sigma of the ionosphere by two bands",
            "of 1",
            Some(0.95),
            0.5,
            &["ionosphere by two bands, sigma over the expected one, smallest"],
            TwoBands,
            |rx, factor| rx.table("ionosphere").map("sigma_m", |_, value| factor * value)
        ),
        kind!(
            "an empty table of the ionosphere",
            "",
            None,
            1.0,
            &["measurements of the ionosphere by two bands that are missing"],
            TwoBands,
            |rx, _| rx.table("ionosphere").keep(|_, _| false)
        ),
    ]
}
