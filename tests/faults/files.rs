//! Trajectories: damaged in every class, refused with the line.

use generator::vehicle::file::{Options, read_csv};
use gnss::time::Epoch;

use crate::tally::{End, Tally, cases};

const FAMILY: &str = "Other files";

fn options() -> Options {
    Options { start: Epoch::parse("2010-07-01T08:05:58").unwrap(), max_gap_s: 2.0, tolerance_m: None }
}

/// Rows of a walk; `damage` changes the fields of one of them, or all rows.
fn walk() -> Vec<String> {
    (0..54)
        .map(|n| format!("{n},{:.7},80.2329,{:.2}", 26.5123 + 1e-6 * f64::from(n), 130.0 + 0.1 * f64::from(n)))
        .collect()
}

const HEADER: &str = "time_s,latitude_deg,longitude_deg,height_m";

#[test]
fn a_damaged_trajectory_is_refused_at_its_row() {
    let row = |row: &str, field: usize, value: &str| {
        let mut fields: Vec<&str> = row.split(',').collect();
        fields[field] = value;
        fields.join(",")
    };
    type Change<'a> = (&'a str, u64, Box<dyn Fn(&mut Vec<String>, usize) + 'a>);
    let set = |field: usize, value: &'static str| {
        move |rows: &mut Vec<String>, at: usize| rows[at] = row(&rows[at], field, value)
    };
    // What becomes of the rows, and how many rows further on it shows: of two rows that do not follow each
    // other, the later.
    let classes: Vec<Change> = vec![
        ("rows swapped", 1, Box::new(|rows, at| rows.swap(at, at + 1))),
        ("row doubled", 1, Box::new(|rows, at| rows.insert(at, rows[at].clone()))),
        ("gap", 0, Box::new(|rows, at| drop(rows.drain(at..at + 2)))),
        ("NaN", 0, Box::new(set(1, "NaN"))),
        ("infinite", 0, Box::new(set(3, "inf"))),
        ("blank", 0, Box::new(set(2, ""))),
        ("decimal comma", 0, Box::new(set(1, "26,5123"))),
        ("semicolons", 0, Box::new(|rows, at| rows[at] = rows[at].replace(',', ";"))),
        ("tabs", 0, Box::new(|rows, at| rows[at] = rows[at].replace(',', "\t"))),
        ("a field more", 0, Box::new(|rows, at| rows[at] += ",1")),
        ("a field less", 0, Box::new(|rows, at| rows[at] = rows[at].rsplit_once(',').unwrap().0.to_owned())),
        ("latitude 90.1", 0, Box::new(set(1, "90.1"))),
        ("longitude 361", 0, Box::new(set(2, "361"))),
        ("unit", 0, Box::new(set(3, "130 m"))),
        ("1e308", 0, Box::new(set(3, "1e308"))),
        ("faster than a tenth of light", 0, Box::new(set(3, "5e8"))),
        ("a jump", 0, Box::new(set(3, "9e5"))),
        ("text", 0, Box::new(|rows, at| rows[at] = "the end".to_owned())),
    ];
    let mut tally = Tally::new(FAMILY, "13. trajectories, 18 classes");
    for (class, later, change) in &classes {
        for at in (1..51).step_by(cases(9, 1)) {
            let mut rows = walk();
            change(&mut rows, at);
            let text = format!("{HEADER}\n{}\n", rows.join("\n"));
            tally.case(
                || format!("{class} at row {at}"),
                || match read_csv(text.as_bytes(), "ride.csv", &options()) {
                    // The header is line 1.
                    Err(error) if error.line == at as u64 + later + 2 => Ok(End::Refused),
                    Err(error) => Err(error.to_string()),
                    Ok(_) => Err("accepted".to_owned()),
                },
            );
        }
    }
    let good = format!("{HEADER}\n{}\n", walk().join("\n"));
    let whole = read_csv(good.as_bytes(), "ride.csv", &options()).unwrap().trajectory;
    let forms: [(&str, Vec<u8>); 4] = [
        ("CRLF", good.replace('\n', "\r\n").into_bytes()),
        ("byte order mark", [b"\xef\xbb\xbf", good.as_bytes()].concat()),
        ("blanks round fields", good.replace(',', " , ").into_bytes()),
        (
            "columns permuted",
            good.lines()
                .map(|line| line.split(',').rev().collect::<Vec<_>>().join(",") + "\n")
                .collect::<String>()
                .into_bytes(),
        ),
    ];
    for (form, bytes) in forms {
        tally.case(
            || form.to_owned(),
            || match read_csv(bytes.as_slice(), "ride.csv", &options()) {
                Ok(found) if found.trajectory.at(20.3).position_m == whole.at(20.3).position_m => Ok(End::Accepted),
                other => Err(format!("{:?}", other.err())),
            },
        );
    }
    for (what, bytes) in [
        ("not UTF-8", [HEADER.as_bytes(), b"\n0,26.5,80.2,\xff\n"].concat()),
        ("no header", walk().join("\n").into_bytes()),
        ("one row", format!("{HEADER}\n{}\n", walk()[0]).into_bytes()),
        ("empty", Vec::new()),
        ("a column twice", good.replacen("height_m", "time_s", 1).into_bytes()),
        ("a column misspelt", good.replacen("height_m", "heigth_m", 1).into_bytes()),
    ] {
        tally.case(
            || what.to_owned(),
            || {
                read_csv(bytes.as_slice(), "ride.csv", &options())
                    .map_or(Ok(End::Refused), |_| Err("accepted".to_owned()))
            },
        );
    }
    tally.finish();
}
