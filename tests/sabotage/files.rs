//! Damage to what is written for people and other programs, and to the clocks against time scales.

use crate::Kind;
use crate::fixes::kind;
use crate::run::{Rx, Scene};
use gnss::time::Epoch;

pub fn kinds() -> Vec<Kind> {
    [columns(), rinex(), nmea(), scales()].into_iter().flatten().collect()
}

fn columns() -> Vec<Kind> {
    const PLACE: [&str; 1] = ["fixes whose latitude, longitude and height are another position than x, y and z"];
    const TIME: [&str; 1] = ["UTC of fixes against GPS time, largest difference"];
    vec![
        kind!("latitude beside a right position", "°", Some(1e-7), 1.0, &PLACE, AtRest, |rx, by| {
            rx.table("fixes").map("latitude_deg", |_, value| value + by);
        }),
        kind!(
            "longitude of every tenth fix beside a right position",
            "°",
            Some(1e-7),
            -0.001,
            &PLACE,
            InMotion,
            |rx, by| {
                rx.table("fixes").map("longitude_deg", |row, value| value + if row % 10 == 7 { by } else { 0.0 });
            }
        ),
        kind!("height above the sea in place of the ellipsoid", "m", Some(0.01), 53.0, &PLACE, AtRest, |rx, by| {
            rx.table("fixes").map("height_m", |_, value| value - by);
        }),
        kind!("UTC without leap seconds", "s", Some(0.0), 18.0, &TIME, AtRest, |rx, by| {
            let table = rx.table("fixes");
            for row in 0..table.rows.len() {
                let utc = Epoch::parse(table.text(row, "utc")).unwrap();
                table.put(row, "utc", utc.plus_s(by).to_utc_text());
            }
        }),
    ]
}

/// Changes the lines of GPS satellites behind the header of an observation file.
fn lines(text: &mut String, change: impl Fn(&str) -> Option<String>) {
    let (header, body) = text.split_once("END OF HEADER\n").unwrap();
    let line = |line: &str| match change(line) {
        Some(changed) if line.starts_with('G') => changed + "\n",
        _ => format!("{line}\n"),
    };
    *text = format!("{header}END OF HEADER\n{}", body.lines().map(line).collect::<String>());
}

/// Changes a column of F14.3 in all satellites' lines.
fn column(text: &mut String, from: usize, of: impl Fn(f64) -> f64) {
    lines(text, |line| {
        let value = line.get(from..from + 14)?.trim().parse().ok()?;
        Some(format!("{}{:14.3}{}", &line[..from], of(value), &line[from + 14..]))
    });
}

fn rinex() -> Vec<Kind> {
    const CODE: [&str; 1] = ["pseudoranges of observations.rnx, largest difference"];
    const DOPPLER: [&str; 1] = ["Dopplers of observations.rnx, largest difference"];
    const CN0: [&str; 1] = ["C/N0 of observations.rnx, largest difference"];
    const LACKS: [&str; 1] = ["observations that observations.rnx lacks"];
    const FLAGS: [&str; 1] = ["losses of lock flagged wrongly in observations.rnx"];
    const LINES: [&str; 1] = ["lines of observations.rnx that cannot be read"];
    const CARRIERS: [&str; 1] = ["carriers of observations.rnx, largest difference of an interval"];
    vec![
        kind!("pseudoranges of RINEX", "m", Some(0.01), 1000.0, &CODE, AtRest, |rx, m| {
            column(rx.text("observations.rnx"), 3, |value| value + m);
        }),
        kind!("Dopplers of RINEX", "Hz", Some(0.01), 5.0, &DOPPLER, AtRest, |rx, hz| {
            column(rx.text("observations.rnx"), 35, |value| value + hz);
        }),
        kind!("C/N0 of RINEX", "dB", Some(0.05), 8.0, &CN0, AtRest, |rx, db| {
            column(rx.text("observations.rnx"), 51, |value| value + db);
        }),
        kind!("carriers of RINEX that turn back", "", None, 1.0, &CARRIERS, AtRest, |rx, _| {
            column(rx.text("observations.rnx"), 19, |value| -value);
        }),
        kind!("RINEX an hour late", "h", Some(0.0), 1.0, &LACKS, AtRest, |rx, hours| {
            let text = rx.text("observations.rnx");
            *text = text.replace("> 2010 07 01 08", &format!("> 2010 07 01 {:02}", 8 + hours as u32));
        }),
        kind!("every lock of RINEX lost", "", None, 1.0, &FLAGS, AtRest, |rx, _| {
            lines(rx.text("observations.rnx"), |line| Some(format!("{}1{}", line.get(..33)?, line.get(34..)?)));
        }),
        kind!("a satellite too many in an epoch's count", "", None, 1.0, &LINES, AtRest, |rx, _| {
            let text = rx.text("observations.rnx");
            *text = text.replacen("  0 12", "  0 13", 1);
        }),
    ]
}

/// Sentences changed field by field, with the right checksum.
fn sentences(text: &mut String, change: impl Fn(&mut Vec<String>)) {
    let line = |line: &str| {
        let body = line.trim_start_matches('$').split('*').next().unwrap();
        let mut fields: Vec<String> = body.split(',').map(str::to_owned).collect();
        change(&mut fields);
        let body = fields.join(",");
        format!("${body}*{:02X}\r\n", body.bytes().fold(0, |sum, byte| sum ^ byte))
    };
    *text = text.lines().map(line).collect();
}

fn nmea() -> Vec<Kind> {
    const LACKS: [&str; 1] = ["fixes that fixes.nmea lacks"];
    const PLACE: [&str; 1] = ["fixes that have another position in fixes.nmea"];
    const SPEED: [&str; 1] = ["velocity over ground of fixes.nmea, largest difference"];
    const LINES: [&str; 1] = ["sentences of fixes.nmea that cannot be read"];
    vec![
        kind!("NMEA an hour late", "h", Some(0.0), 1.0, &LACKS, AtRest, |rx, hours| {
            sentences(rx.text("fixes.nmea"), |fields| {
                if let Some(time) = fields.get_mut(1).filter(|time| time.starts_with("08")) {
                    *time = format!("{:02}{}", 8 + hours as u32, &time[2..]);
                }
            });
        }),
        kind!("heights of NMEA", "m", Some(0.01), 53.0, &PLACE, InMotion, |rx, m| {
            sentences(rx.text("fixes.nmea"), |fields| {
                if fields[0].ends_with("GGA") {
                    fields[9] = format!("{:.4}", fields[9].parse::<f64>().unwrap() + m);
                }
            });
        }),
        kind!("speeds of NMEA in km/h", "", Some(1.0), 1.852, &SPEED, InMotion, |rx, factor| {
            sentences(rx.text("fixes.nmea"), |fields| {
                if fields[0].ends_with("RMC") {
                    fields[7] = format!("{:.4}", fields[7].parse::<f64>().unwrap() * factor);
                }
            });
        }),
        kind!("a wrong checksum in NMEA", "", None, 1.0, &LINES, AtRest, |rx, _| {
            let text = rx.text("fixes.nmea");
            let at = text.find('*').unwrap();
            text.replace_range(at + 1..at + 3, "00");
        }),
    ]
}

/// Adds to the clock by Galileo's time.
fn ahead(rx: &mut Rx, m: f64) {
    let galileo = |table: &crate::table::Table, row: usize| table.text(row, "time_scale") == "GST";
    rx.table("clocks").map_where("clock_bias_s", galileo, |_, value| value + m / 299_792_458.0);
}

fn scales() -> Vec<Kind> {
    vec![
        kind!(
            "Galileo's clock off by as much",
            "m",
            Some(0.05),
            1.0,
            &["GST offset error, mean", "GST offset error, largest against its limit"],
            TwoSystems,
            ahead
        ),
        kind!(
            "sigma of Galileo's clock",
            "of 1",
            Some(1.1),
            1.5,
            &["GST clock sigma over the expected one, largest"],
            TwoSystems,
            |rx, factor| rx.table("clocks").map("sigma_clock_m", |_, value| factor * value)
        ),
        kind!(
            "a table of clocks without rows",
            "",
            None,
            1.0,
            &["fixes whose clocks are not all in clocks.csv"],
            TwoSystems,
            |rx, _| rx.table("clocks").rows.clear()
        ),
        kind!(
            "clocks of GPS time that fixes do not have",
            "m",
            Some(0.01),
            10.0,
            &["clock of a fix in clocks.csv and in fixes.csv, largest difference"],
            TwoSystems,
            |rx, m| rx.table("clocks").map("clock_bias_s", |_, value| value + m / 299_792_458.0)
        ),
    ]
}
