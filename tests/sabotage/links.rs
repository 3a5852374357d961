//! Damage to loop updates: discriminators, prompts, C/N0, integration times and rows.

use crate::Kind;
use crate::fixes::kind;
use crate::run::{Rx, Scene};
use crate::table::Table;

const ONE: &str = "G13";

fn settled(table: &Table, row: usize) -> bool {
    table.text(row, "sv") == ONE && table.get(row, "sample") > 2.6e7
}

fn change(rx: &mut Rx, column: &str, of: impl Fn(usize, f64) -> f64) {
    rx.table("tracking").map_where(column, settled, of);
}

pub fn kinds() -> Vec<Kind> {
    vec![
        kind!(
            "code discriminator larger",
            "times",
            Some(1.1),
            3.0,
            &["DLL discriminator over theory, largest"],
            AtRest,
            |rx, factor| {
                change(rx, "dll_discriminator_chips", |_, value| value * factor);
            }
        ),
        kind!(
            "code discriminator smaller",
            "times",
            Some(0.9),
            0.4,
            &["DLL discriminator over theory, smallest"],
            AtRest,
            |rx, factor| {
                change(rx, "dll_discriminator_chips", |_, value| value * factor);
            }
        ),
        kind!("code discriminator off", "chips", Some(5e-4), 0.02, &["DLL discriminator's bias"], AtRest, |rx, by| {
            change(rx, "dll_discriminator_chips", |_, value| value + by);
        }),
        kind!(
            "phase discriminator larger",
            "times",
            Some(1.1),
            3.0,
            &["PLL discriminator over theory, largest"],
            AtRest,
            |rx, factor| {
                change(rx, "pll_discriminator_cycles", |_, value| value * factor);
            }
        ),
        kind!(
            "phase discriminator smaller",
            "times",
            Some(0.9),
            0.4,
            &["PLL discriminator over theory, smallest"],
            AtRest,
            |rx, factor| {
                change(rx, "pll_discriminator_cycles", |_, value| value * factor);
            }
        ),
        kind!(
            "phase discriminator off",
            "cycles",
            Some(1e-4),
            0.005,
            &["PLL discriminator's bias"],
            AtRest,
            |rx, by| {
                change(rx, "pll_discriminator_cycles", |_, value| value + by);
            }
        ),
        kind!(
            "frequency discriminator larger",
            "times",
            Some(1.1),
            3.0,
            &["FLL discriminator over theory, largest"],
            AtRest,
            |rx, factor| {
                change(rx, "fll_discriminator_hz", |_, value| value * factor);
            }
        ),
        kind!(
            "frequency discriminator smaller",
            "times",
            Some(0.9),
            0.4,
            &["FLL discriminator over theory, smallest"],
            AtRest,
            |rx, factor| {
                change(rx, "fll_discriminator_hz", |_, value| value * factor);
            }
        ),
        kind!("frequency discriminator off", "Hz", Some(0.05), 2.0, &["FLL discriminator's bias"], AtRest, |rx, by| {
            change(rx, "fll_discriminator_hz", |_, value| value + by);
        }),
        kind!("prompts larger", "times", Some(1.04), 1.3, &["prompt's power against C/N0"], AtRest, |rx, factor| {
            change(rx, "prompt_i", |_, value| value * factor);
            change(rx, "prompt_q", |_, value| value * factor);
        }),
        kind!("prompts smaller", "times", Some(0.96), 0.7, &["prompt's power against C/N0"], AtRest, |rx, factor| {
            change(rx, "prompt_i", |_, value| value * factor);
            change(rx, "prompt_q", |_, value| value * factor);
        }),
        kind!("prompts turned", "°", Some(0.5), 10.0, &["prompt's share in quadrature"], AtRest, |rx, degrees| {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            let table = rx.table("tracking");
            for row in 0..table.rows.len() {
                if settled(table, row) {
                    let (i, q) = (table.get(row, "prompt_i"), table.get(row, "prompt_q"));
                    table.put(row, "prompt_i", cos * i - sin * q);
                    table.put(row, "prompt_q", sin * i + cos * q);
                }
            }
        }),
        kind!(
            "in-phase and quadrature exchanged",
            "",
            None,
            1.0,
            &["prompt's share in quadrature"],
            AtRest,
            |rx, _| {
                let rows = rx.table("tracking").of(ONE);
                rx.table("tracking").swap_columns("prompt_i", "prompt_q", |row| rows.binary_search(&row).is_ok());
            }
        ),
        kind!("C/N0 of loop updates high", "dB", Some(0.4), 2.5, &["C/N0 bias of loop updates"], AtRest, |rx, db| {
            change(rx, "cn0_dbhz", |_, value| value + db);
        }),
        kind!("loop updates missing", "rows", None, 4.0, &["rows missing within a lock"], AtRest, |rx, count| {
            let gone = rx.table("tracking").of(ONE)[1000..1000 + count as usize].to_vec();
            rx.table("tracking").keep(|_, row| !gone.contains(&row));
        }),
        kind!("loop updates doubled", "rows", None, 1.0, &["rows doubled"], AtRest, |rx, _| {
            let table = rx.table("tracking");
            let row = table.rows[5000].clone();
            table.rows.insert(5001, row);
        }),
        kind!("loop updates out of order", "pairs", None, 1.0, &["rows out of time order"], AtRest, |rx, _| {
            let rows = rx.table("tracking").of(ONE);
            rx.table("tracking").rows.swap(rows[500], rows[501]);
        }),
        kind!(
            "loop updates frozen",
            "rows",
            None,
            3.0,
            &["rows that repeat the values before"],
            AtRest,
            |rx, count| {
                let table = rx.table("tracking");
                let rows = table.of(ONE);
                for row in &rows[1000..1000 + count as usize] {
                    let sample = table.text(*row, "sample").to_owned();
                    table.rows[*row] = table.rows[rows[999]].clone();
                    table.put(*row, "sample", sample);
                }
            }
        ),
        kind!(
            "loop updates of a satellite never found",
            "rows",
            None,
            1.0,
            &["satellites tracked that were never found"],
            AtRest,
            |rx, _| {
                let row = rx.table("tracking").of(ONE)[1000];
                rx.table("tracking").put(row, "sv", "G31");
            }
        ),
    ]
}
