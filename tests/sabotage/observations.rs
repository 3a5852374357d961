//! Damage to observations: code, carrier, Doppler, C/N0, lock times and rows, of one satellite or of all.

use gnss::earth::SPEED_OF_LIGHT_MPS;

use crate::Kind;
use crate::fixes::kind;
use crate::run::{Rx, Scene};
use crate::table::{Table, normal};

const ONE: &str = "G13";
const OTHER: &str = "G23";
const WAVELENGTH_M: f64 = SPEED_OF_LIGHT_MPS / 1_575.42e6;
const CODE: [&str; 3] = ["code bias", "code error, largest", "DLL jitter over theory, largest"];
const CARRIER: [&str; 4] =
    ["carrier bias", "carrier error, largest", "PLL jitter over theory, largest", "unexpected cycle slips"];
const DOPPLER: [&str; 3] = ["Doppler bias", "Doppler error, largest", "FLL jitter over theory, largest"];
const CN0: [&str; 3] = ["C/N0 bias", "C/N0 error, largest", "C/N0 bias, magnitude"];

fn one(table: &Table, row: usize) -> bool {
    table.text(row, "sv") == ONE
}

fn all(_: &Table, _: usize) -> bool {
    true
}

/// Makes codes late: the time sent and the pseudorange.
fn late(rx: &mut Rx, chosen: impl Fn(&Table, usize) -> bool + Copy, metres: impl Fn(usize) -> f64 + Copy) {
    let table = rx.table("observations");
    table.map_where("sent_fraction_s", chosen, |row, sent| sent - metres(row) / SPEED_OF_LIGHT_MPS);
    table.map_where("pseudorange_m", chosen, |row, range| range + metres(row));
}

fn change(rx: &mut Rx, column: &str, chosen: impl Fn(&Table, usize) -> bool, of: impl Fn(usize, f64) -> f64) {
    rx.table("observations").map_where(column, chosen, of);
}

/// Index of a row's epoch.
fn epoch(table: &Table, row: usize) -> usize {
    (table.get(row, "sample") / 2.6e5) as usize
}

/// Adds to a column of one satellite a function of the epoch.
fn by_epoch(rx: &mut Rx, column: &str, of: impl Fn(usize) -> f64) {
    let table = rx.table("observations");
    for row in table.of(ONE) {
        let value = table.get(row, column) + of(epoch(table, row));
        table.put(row, column, value);
    }
}

pub fn kinds() -> Vec<Kind> {
    [codes(), carriers(), dopplers(), strengths(), rows()].into_iter().flatten().collect()
}

fn codes() -> Vec<Kind> {
    vec![
        kind!("code of one satellite late", "m", Some(0.15), 2.0, &CODE, AtRest, |rx, m| late(rx, one, |_| m)),
        kind!("codes of all satellites late", "m", Some(0.15), 2.0, &CODE, AtRest, |rx, m| late(rx, all, |_| m)),
        kind!("noisy code of one satellite", "m, 1σ", Some(0.1), 1.5, &CODE, AtRest, |rx, m| late(rx, one, |row| m
            * normal(row, 11))),
        kind!("one code value off", "m", Some(0.5), 8.0, &CODE, AtRest, |rx, m| {
            let row = rx.table("observations").of(ONE)[200];
            late(rx, |_, other| other == row, |_| m);
        }),
        kind!("code that swings as by a reflection", "m", Some(0.2), 3.0, &CODE, AtRest, |rx, m| {
            late(rx, one, |row| m * libm::sin(row as f64 / 600.0));
        }),
        kind!("code that lags behind more and more", "m at the end", Some(0.2), 5.0, &CODE, AtRest, |rx, m| {
            late(rx, one, |row| m * row as f64 / 6228.0);
        }),
        kind!(
            "code quantised",
            "m",
            Some(0.3),
            8.0,
            &["code error, largest", "DLL jitter over theory, largest"],
            AtRest,
            |rx, step| {
                let table = rx.table("observations");
                for row in table.of(ONE) {
                    let range = table.get(row, "pseudorange_m");
                    let by = (range / step).round() * step - range;
                    let sent = table.get(row, "sent_fraction_s") - by / SPEED_OF_LIGHT_MPS;
                    table.put(row, "pseudorange_m", range + by);
                    table.put(row, "sent_fraction_s", sent);
                }
            }
        ),
        kind!(
            "too smooth a code",
            "share of the noise kept",
            Some(0.9),
            0.2,
            &["DLL jitter over theory, smallest"],
            AtRest,
            |rx, share| {
                flatten(rx, share);
            }
        ),
        kind!(
            "pseudoranges against the time sent",
            "m",
            Some(2e-5),
            0.01,
            &["pseudorange against time sent, largest"],
            AtRest,
            |rx, m| {
                change(rx, "pseudorange_m", one, |_, range| range + m);
            }
        ),
        kind!("a code period too much", "ms", None, 1.0, &CODE, AtRest, |rx, ms| late(rx, one, |_| 1e-3
            * ms
            * SPEED_OF_LIGHT_MPS)),
    ]
}

/// Takes a share of the code's noise away: what lies about a straight line through code minus carrier.
fn flatten(rx: &mut Rx, share: f64) {
    let table = rx.table("observations");
    let rows = table.of(ONE);
    let parted: Vec<f64> = rows
        .iter()
        .map(|row| table.get(*row, "pseudorange_m") - WAVELENGTH_M * table.get(*row, "carrier_cycles"))
        .collect();
    let middle = parted.iter().sum::<f64>() / parted.len() as f64;
    for (row, value) in rows.into_iter().zip(parted) {
        let by = (share - 1.0) * (value - middle);
        let (range, sent) = (table.get(row, "pseudorange_m"), table.get(row, "sent_fraction_s"));
        table.put(row, "pseudorange_m", range + by);
        table.put(row, "sent_fraction_s", sent - by / SPEED_OF_LIGHT_MPS);
    }
}

fn carriers() -> Vec<Kind> {
    vec![
        kind!("carrier that drifts from the code", "cycles/s", Some(2e-4), 0.005, &CARRIER, AtRest, |rx, rate| {
            by_epoch(rx, "carrier_cycles", |epoch| rate * 0.1 * epoch as f64);
        }),
        kind!("noisy carrier", "cycles, 1σ", Some(0.001), 0.03, &CARRIER, AtRest, |rx, cycles| {
            by_epoch(rx, "carrier_cycles", |epoch| cycles * normal(epoch, 12));
        }),
        kind!("carrier jump without an event", "cycles", Some(0.01), 0.5, &CARRIER, AtRest, |rx, cycles| {
            by_epoch(rx, "carrier_cycles", |epoch| if epoch > 300 { cycles } else { 0.0 });
        }),
        kind!("whole cycle slipped without an event", "cycles", None, 1.0, &CARRIER, AtRest, |rx, cycles| {
            by_epoch(rx, "carrier_cycles", |epoch| if epoch > 450 { cycles } else { 0.0 });
        }),
        kind!("one carrier value off", "cycles", Some(0.005), 0.2, &CARRIER, AtRest, |rx, cycles| {
            by_epoch(rx, "carrier_cycles", |epoch| if epoch == 300 { cycles } else { 0.0 });
        }),
        kind!("carrier off by a part of a half cycle", "cycles", Some(0.005), 0.1, &CARRIER, AtRest, |rx, cycles| {
            by_epoch(rx, "carrier_cycles", |_| cycles);
        }),
        kind!("carrier with its sign turned", "", None, 1.0, &CARRIER, AtRest, |rx, _| change(
            rx,
            "carrier_cycles",
            one,
            |_, value| -value
        )),
        kind!("carrier scaled", "", Some(1e-8), 1e-5, &CARRIER, AtRest, |rx, part| change(
            rx,
            "carrier_cycles",
            one,
            |_, value| value * (1.0 + part)
        )),
    ]
}

fn dopplers() -> Vec<Kind> {
    vec![
        kind!("Doppler of one satellite off", "Hz", Some(0.01), 0.2, &DOPPLER, AtRest, |rx, hz| change(
            rx,
            "doppler_hz",
            one,
            |_, value| value + hz
        )),
        kind!("Doppler of all satellites off", "Hz", Some(0.01), 0.2, &DOPPLER, AtRest, |rx, hz| change(
            rx,
            "doppler_hz",
            all,
            |_, value| value + hz
        )),
        kind!("noisy Doppler", "Hz, 1σ", Some(0.01), 0.2, &DOPPLER, AtRest, |rx, hz| change(
            rx,
            "doppler_hz",
            one,
            |row, value| value + hz * normal(row, 13)
        )),
        kind!("Doppler with its sign turned", "", None, 1.0, &DOPPLER, AtRest, |rx, _| change(
            rx,
            "doppler_hz",
            one,
            |_, value| -value
        )),
        kind!("Doppler scaled", "", Some(5e-6), 1e-3, &DOPPLER, AtRest, |rx, part| change(
            rx,
            "doppler_hz",
            one,
            |_, value| value * (1.0 + part)
        )),
        kind!("one Doppler off", "Hz", Some(0.05), 2.0, &DOPPLER, AtRest, |rx, hz| by_epoch(
            rx,
            "doppler_hz",
            |epoch| if epoch == 300 { hz } else { 0.0 }
        )),
        kind!("Doppler of an earlier time", "s", Some(0.002), 1.0, &DOPPLER, InMotion, |rx, seconds| {
            let table = rx.table("observations");
            let rows = table.of(ONE);
            let old: Vec<f64> = rows.iter().map(|row| table.get(*row, "doppler_hz")).collect();
            for (index, row) in rows.into_iter().enumerate() {
                let at = (index as f64 - 10.0 * seconds).max(0.0);
                let below = at.floor() as usize;
                let next = *old.get(below + 1).unwrap_or(&old[below]);
                table.put(row, "doppler_hz", old[below] + (next - old[below]) * at.fract());
            }
        }),
    ]
}

fn strengths() -> Vec<Kind> {
    vec![
        kind!("C/N0 of all satellites high", "dB", Some(0.4), 2.0, &CN0, AtRest, |rx, db| change(
            rx,
            "cn0_dbhz",
            all,
            |_, value| value + db
        )),
        kind!("C/N0 of all satellites low", "dB", Some(0.4), 2.0, &CN0, AtRest, |rx, db| change(
            rx,
            "cn0_dbhz",
            all,
            |_, value| value - db
        )),
        kind!("C/N0 of one satellite high", "dB", Some(0.4), 2.0, &CN0, AtRest, |rx, db| change(
            rx,
            "cn0_dbhz",
            one,
            |_, value| value + db
        )),
        kind!("spikes of C/N0", "dB", Some(1.0), 8.0, &CN0, AtRest, |rx, db| {
            by_epoch(rx, "cn0_dbhz", |epoch| if epoch % 100 == 50 { db } else { 0.0 });
        }),
        kind!("noisy C/N0", "dB, 1σ", Some(0.2), 2.0, &CN0, AtRest, |rx, db| by_epoch(rx, "cn0_dbhz", |epoch| db
            * normal(epoch, 14))),
        kind!("C/N0 in other decibels", "times", Some(1.005), 1.1, &CN0, AtRest, |rx, factor| change(
            rx,
            "cn0_dbhz",
            all,
            |_, value| value * factor
        )),
        kind!("C/N0 of one satellite frozen at a value", "dB off", None, 3.0, &CN0, AtRest, |rx, db| {
            let table = rx.table("observations");
            let rows = table.of(ONE);
            let value = rows.iter().map(|row| table.get(*row, "cn0_dbhz")).sum::<f64>() / rows.len() as f64;
            rows.into_iter().for_each(|row| table.put(row, "cn0_dbhz", value + db));
        }),
    ]
}

fn rows() -> Vec<Kind> {
    const LOCK: [&str; 3] =
        ["lock time against the samples", "breaks of lock without an event", "lock times longer than the run"];
    vec![
        kind!("lock times off", "s", Some(0.01), 10.0, &LOCK, AtRest, |rx, s| change(
            rx,
            "locked_s",
            one,
            |_, value| value + s
        )),
        kind!("lock time that begins again without an event", "s left", None, 0.1, &LOCK, AtRest, |rx, left| {
            let table = rx.table("observations");
            let rows = table.of(ONE);
            let from = table.get(rows[300], "locked_s");
            rows[300..].iter().for_each(|row| {
                let value = table.get(*row, "locked_s") - from + left;
                table.put(*row, "locked_s", value);
            });
        }),
        kind!("lock times frozen", "", None, 1.0, &LOCK, AtRest, |rx, _| change(rx, "locked_s", one, |_, _| 5.0)),
        kind!("lock times that run slow", "times", Some(0.999), 0.5, &LOCK, AtRest, |rx, factor| change(
            rx,
            "locked_s",
            one,
            |_, value| value * factor
        )),
        kind!(
            "observations missing within a lock",
            "rows",
            None,
            5.0,
            &["rows missing within a lock"],
            AtRest,
            |rx, count| {
                let rows = rx.table("observations").of(ONE);
                let gone = rows[200..200 + count as usize].to_vec();
                rx.table("observations").keep(|_, row| !gone.contains(&row));
            }
        ),
        kind!("observations doubled", "rows", None, 1.0, &["rows doubled"], AtRest, |rx, _| {
            let table = rx.table("observations");
            let row = table.rows[1000].clone();
            table.rows.insert(1001, row);
        }),
        kind!(
            "observations frozen",
            "epochs",
            None,
            5.0,
            &["rows that repeat the values before"],
            AtRest,
            |rx, count| {
                let table = rx.table("observations");
                let rows = table.of(ONE);
                for row in &rows[200..200 + count as usize] {
                    let sample = table.text(*row, "sample").to_owned();
                    table.rows[*row] = table.rows[rows[199]].clone();
                    table.put(*row, "sample", sample);
                }
            }
        ),
        kind!("two satellites exchanged", "epochs", None, 1.0, &CODE, AtRest, |rx, most| rx
            .table("observations")
            .swap_satellites(ONE, OTHER, most as usize + 100)),
        kind!(
            "two satellites of an epoch written in another order",
            "epochs",
            Some(50.0),
            51.0,
            &["rows out of time order"],
            AtRest,
            |rx, epochs| {
                let table = rx.table("observations");
                let step = if epochs > 50.0 { 12 * 3 } else { 1 };
                (0..epochs as usize).for_each(|k| table.rows.swap(3000 + 36 * k, 3000 + 36 * k + step));
                if epochs <= 50.0 {
                    table.rows.sort_by_key(|row| row[0].parse::<u64>().unwrap());
                }
            }
        ),
        kind!("an unknown satellite", "rows", None, 1.0, &["observations without a truth"], AtRest, |rx, _| {
            let row = rx.table("observations").of(ONE)[300];
            rx.table("observations").put(row, "sv", "G31");
        }),
        kind!("samples off by one", "samples", None, 1.0, &["observations without a truth"], AtRest, |rx, by| {
            let table = rx.table("observations");
            for row in table.of(ONE).into_iter().take(100) {
                let sample = table.get(row, "sample") + by;
                table.put(row, "sample", sample as u64);
            }
        }),
        kind!("observations labelled with a later sample", "epochs", None, 1.0, &CODE, AtRest, |rx, epochs| {
            let step = epochs * 2.6e5;
            rx.table("observations").map("sample", |_, sample| sample + step);
            rx.table("observations").keep(|table, row| table.get(row, "sample") < 1.56e8);
        }),
        kind!("a whole week in the time sent", "weeks", None, 1.0, &CODE, AtRest, |rx, weeks| {
            let table = rx.table("observations");
            for row in table.of(ONE) {
                let seconds: i64 = table.text(row, "sent_s").parse().unwrap();
                table.put(row, "sent_s", seconds + 604_800 * weeks as i64);
            }
        }),
    ]
}
