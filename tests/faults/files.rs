//! Trajectories, metadata, settings, limits and other receivers' files: damaged in every class, refused with the line.

use gnss_twin::analysis::foreign::{nmea, rinex_obs};
use gnss_twin::analysis::limits::Limits;
use gnss_twin::generator::vehicle::file::{Options, read_csv, read_nmea};
use gnss_twin::gnss::sigmf;
use gnss_twin::gnss::time::Epoch;
use gnss_twin::receiver::settings::Settings;

use crate::damage::Random;
use crate::tally::{End, Tally, cases};

const FAMILY: &str = "Other files";

fn options() -> Options {
    Options { start: Epoch::parse("2010-07-01T08:05:58").unwrap(), max_gap_s: 2.0 }
}

/// Rows of a walk; `damage` changes the fields of one of them, or all rows.
fn walk() -> Vec<String> {
    (0..50)
        .map(|n| format!("{n},{:.7},80.2329,{:.2}", 26.5123 + 1e-6 * f64::from(n), 130.0 + 0.1 * f64::from(n)))
        .collect()
}

const HEADER: &str = "time_s,latitude_deg,longitude_deg,height_m";

#[test]
fn a_damaged_trajectory_is_refused_at_its_row() {
    // What becomes of a row, and whether the row after it is the one that shows it.
    let row = |row: &str, field: usize, value: &str| {
        let mut fields: Vec<&str> = row.split(',').collect();
        fields[field] = value;
        fields.join(",")
    };
    type Change<'a> = (&'a str, Box<dyn Fn(&mut Vec<String>, usize) + 'a>);
    let set = |field: usize, value: &'static str| {
        move |rows: &mut Vec<String>, at: usize| rows[at] = row(&rows[at], field, value)
    };
    let classes: Vec<Change> = vec![
        ("rows swapped", Box::new(|rows, at| rows.swap(at, at + 1))),
        ("row doubled", Box::new(|rows, at| rows.insert(at, rows[at].clone()))),
        ("gap", Box::new(|rows, at| drop(rows.drain(at..at + 2)))),
        ("NaN", Box::new(set(1, "NaN"))),
        ("infinite", Box::new(set(3, "inf"))),
        ("blank", Box::new(set(2, ""))),
        ("decimal comma", Box::new(set(1, "26,5123"))),
        ("semicolons", Box::new(|rows, at| rows[at] = rows[at].replace(',', ";"))),
        ("tabs", Box::new(|rows, at| rows[at] = rows[at].replace(',', "\t"))),
        ("a field more", Box::new(|rows, at| rows[at] += ",1")),
        ("a field less", Box::new(|rows, at| rows[at] = rows[at].rsplit_once(',').unwrap().0.to_owned())),
        ("latitude 90.1", Box::new(set(1, "90.1"))),
        ("longitude 361", Box::new(set(2, "361"))),
        ("unit", Box::new(set(3, "130 m"))),
        ("1e308", Box::new(set(3, "1e308"))),
        ("faster than a tenth of light", Box::new(set(2, "-99"))),
        ("a jump", Box::new(set(3, "9e5"))),
        ("text", Box::new(|rows, at| rows[at] = "the end".to_owned())),
    ];
    let mut tally = Tally::new(FAMILY, "13. trajectories, 18 classes");
    for (class, change) in &classes {
        for at in (1..46).step_by(cases(9, 1)) {
            let mut rows = walk();
            change(&mut rows, at);
            let text = format!("{HEADER}\n{}\n", rows.join("\n"));
            tally.case(
                || format!("{class} at row {at}"),
                || match read_csv(text.as_bytes(), "ride.csv", &options()) {
                    // The header is line 1; what is wrong between two rows shows at the later one. A spline
                    // swings a few rows before and after.
                    Err(error) if (at as u64 - 1..at as u64 + 6).contains(&error.line) => Ok(End::Refused),
                    Err(error) => Err(error.to_string()),
                    Ok(_) => Err("accepted".to_owned()),
                },
            );
        }
    }
    let good = format!("{HEADER}\n{}\n", walk().join("\n"));
    let whole = read_csv(good.as_bytes(), "ride.csv", &options()).unwrap().0;
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
                Ok((found, _)) if found.at(20.3).position_m == whole.at(20.3).position_m => Ok(End::Accepted),
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

fn checksummed(body: &str) -> String {
    format!("${body}*{:02X}\n", body.bytes().fold(0, |x, b| x ^ b))
}

fn sentences() -> String {
    (43..60)
        .map(|s| checksummed(&format!("GPGGA,0805{s}.00,2630.7380,N,08013.9740,E,1,08,0.9,180.0,M,-50.0,M,,")))
        .collect()
}

const OBSERVATIONS: &str = concat!(
    "     3.04           OBSERVATION DATA    G: GPS              RINEX VERSION / TYPE\n",
    "G    4 C1C L1C D1C S1C                                      SYS / # / OBS TYPES\n",
    "                                                            END OF HEADER\n",
    "> 2010 07 01 08 05 58.0000000  0  2\n",
    "G01  20000000.000   105100000.000         1000.000          45.000\n",
    "G02  21000000.000   110300000.000        -1000.000          44.000\n",
    "> 2010 07 01 08 05 59.0000000  0  1\n",
    "G01  20000100.000   105100500.000         1000.000          45.000\n",
);

const LIMITS: &str =
    "marginal_share = 0.1\n\"position.horizontal_p95_m\" = { max = 1.0 }\n[satellites]\nused = { min = 8 }\n";

/// One to four bytes replaced, deleted or inserted, or a run of them overwritten.
fn bent(base: &[u8], seed: u64) -> Vec<u8> {
    let mut random = Random::new(seed);
    let mut bytes = base.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let byte = random.next() as u8;
        match random.below(6) {
            0 => bytes[at] ^= 1 << (byte % 8),
            1 => bytes[at] = byte,
            2 => drop(bytes.remove(at)),
            3 => bytes.insert(at, byte),
            4 => bytes.truncate(at.max(1)),
            _ => {
                let end = (at + 1 + random.below(40)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

#[test]
fn any_bytes_are_read_or_refused_with_the_file_s_name() {
    type Reader = (&'static str, Vec<u8>, fn(&[u8]) -> Result<(), String>);
    let meta = "{\"global\": {\"core:datatype\": \"ci8\", \"core:sample_rate\": 4000000, \"core:version\": \"1.2.0\"},\n\
                \"captures\": [{\"core:sample_start\": 0, \"core:frequency\": 1575420000, \"core:datetime\": \
                \"2010-07-01T08:05:43.000000Z\"}], \"annotations\": []}\n";
    let settings = "[tracking]\npll_order = 3\n[position]\nmask_deg = 5\n[operation]\nsearch_interval_s = 15.0\n";
    let ride = format!("{HEADER}\n{}\n", walk()[..8].join("\n"));
    let readers: [Reader; 7] = [
        ("trajectory (CSV)", ride.into_bytes(), |b| {
            read_csv(b, "file", &options()).map(drop).map_err(|e| e.to_string())
        }),
        ("trajectory (NMEA)", sentences().into_bytes(), |b| {
            read_nmea(b, "file", &options()).map(drop).map_err(|e| e.to_string())
        }),
        ("SigMF metadata", meta.into(), |b| {
            sigmf::parse(&String::from_utf8_lossy(b), "file").map(drop).map_err(|e| e.to_string())
        }),
        ("receiver's settings", settings.into(), |b| {
            Settings::parse(&String::from_utf8_lossy(b), "file").map(drop).map_err(|e| e.to_string())
        }),
        ("limits", LIMITS.into(), |b| {
            Limits::parse(&String::from_utf8_lossy(b), "file").map(drop).map_err(|e| e.to_string())
        }),
        ("observations (RINEX)", OBSERVATIONS.into(), |b| {
            rinex_obs::read(b).map(drop).map_err(|f| format!("file: line {}: {}", f.line, f.what))
        }),
        ("positions (NMEA)", sentences().into_bytes(), |b| {
            nmea::read(b, "2010-07-01").map(drop).map_err(|f| format!("file: line {}: {}", f.line, f.what))
        }),
    ];
    let mut failures = Vec::new();
    for (kind, base, read) in readers {
        if let Err(message) = read(&base) {
            panic!("{kind}: the undamaged file is refused: {message}");
        }
        let mut tally = Tally::new(FAMILY, format!("8. any bytes: {kind}"));
        for seed in 0..cases(300, 20_000) as u64 {
            let bytes = bent(&base, seed);
            tally.case(
                || format!("{kind}, seed {seed}"),
                || match read(&bytes) {
                    Ok(()) => Ok(End::Accepted),
                    Err(message) if message.starts_with("file") => Ok(End::Refused),
                    Err(message) => Err(message),
                },
            );
        }
        failures.extend(tally.close().err());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
