//! Navigation files: what is accepted is what stands in the file, in the columns where its format has it;
//! nothing is lost unsaid.

use std::io::{Read, Write};

use gnss::broadcast::Ephemeris;
use gnss::rinex::{Navigation, read};
use gnss::time::Epoch;

use crate::damage::{CLASSES, Random, damaged};
use crate::tally::{End, Tally, cases};

const FAMILY: &str = "Navigation files";
const DAY: &[u8] = include_bytes!("../../src/gnss/data/brdc1820-2010.n.gz");

/// Three records of the embedded day as a file of each version.
pub fn bases() -> [(u8, String); 3] {
    let mut text = String::new();
    flate2::read::GzDecoder::new(DAY).read_to_string(&mut text).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let two: String = lines[..8 + 24].iter().flat_map(|line| [*line, "\n"]).collect();
    let label = |text: &str, label: &str| format!("{text:<60}{label:<20}\n");
    let head = |version: &str| {
        label(&format!("{version:>9}{:11}{:<20}{:<20}", "", "N: GNSS NAV DATA", "G: GPS"), "RINEX VERSION / TYPE")
            + &label("made from brdc1820.10n", "PGM / RUN BY / DATE")
            + &label("    15", "LEAP SECONDS")
    };
    let mut three = head("3.04")
        + &label("GPSA   4.6570e-09  1.4900e-08 -5.9600e-08 -1.1920e-07", "IONOSPHERIC CORR")
        + &label("GPSB   8.1920e+04  6.5540e+04 -6.5540e+04 -5.2430e+05", "IONOSPHERIC CORR")
        + &label("", "END OF HEADER");
    let mut four = head("4.00") + &label("", "END OF HEADER");
    for record in lines[8..32].chunks(8) {
        let title =
            format!("G{:02} 2010 07 01 00 00 00{}\n", record[0][..2].trim().parse::<u8>().unwrap(), &record[0][22..]);
        let orbit: String = record[1..].iter().map(|line| format!(" {line}\n")).collect();
        three += &format!("{title}{orbit}");
        four += &format!("> EPH {} LNAV\n{title}{orbit}", &title[..3]);
    }
    [(2, two), (3, three), (4, four)]
}

/// A record as it stands in the columns of its format, read without the product's help.
#[derive(Clone, Debug, PartialEq)]
struct Written {
    number: u8,
    title: String,
    toc: String,
    /// Three of the clock and 28 of the orbit; blank is no number.
    values: Vec<Option<f64>>,
}

fn written(version: u8, bytes: &[u8]) -> Vec<Written> {
    let ascii: String = bytes
        .iter()
        .map(|byte| if byte.is_ascii() { char::from(*byte) } else { '?' })
        .collect::<String>()
        .replace('\r', "\n");
    let cut = !ascii.ends_with('\n');
    let lines: Vec<&str> = ascii.lines().filter(|line| !line.trim().is_empty()).collect();
    let margin = if version == 2 { 3 } else { 4 };
    let orbit = |line: &str| line.len() > margin && line.get(..margin).is_some_and(|m| m.trim().is_empty());
    let last = lines.len().saturating_sub(1);
    (0..lines.len())
        .filter_map(|at| {
            let record = lines.get(at..at + 8)?;
            // No line more or less.
            if orbit(record[0])
                || !record[1..].iter().all(|line| orbit(line))
                || lines.get(at + 8).is_some_and(|l| orbit(l))
            {
                return None;
            }
            if cut && at + 7 == last && (record[7].trim_end().len() - margin) % 19 != 0 {
                return None;
            }
            let title = record[0].get(..margin + 19)?;
            let number = title.get(usize::from(version > 2)..margin - 1)?.trim().parse().ok()?;
            if version > 2 && !title.starts_with('G') {
                return None;
            }
            let parts: Vec<f64> =
                title.get(margin..)?.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
            let [year, month, day, hour, minute, second] = parts.as_slice() else { return None };
            let century = if *year < 80.0 {
                2000.0
            } else if *year < 100.0 {
                1900.0
            } else {
                0.0
            };
            let toc = format!(
                "{:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}",
                if version == 2 { year + century } else { *year }
            );
            let mut values = fields(record[0], margin + 19, 3)?;
            for line in &record[1..] {
                values.extend(fields(line, margin, 4)?);
            }
            Some(Written { number, title: title.to_owned(), toc, values })
        })
        .collect()
}

fn fields(line: &str, from: usize, count: usize) -> Option<Vec<Option<f64>>> {
    (0..count)
        .map(|k| {
            let start = (from + 19 * k).min(line.len());
            let text = line.get(start..line.len().min(start + 19))?.trim();
            if text.is_empty() {
                return Some(None);
            }
            if !text.bytes().all(|b| b.is_ascii_digit() || b"+-.dDeE".contains(&b)) {
                return None;
            }
            text.to_lowercase().replace('d', "e").parse().ok().filter(|x: &f64| x.is_finite()).map(Some)
        })
        .collect()
}

/// Elements of a set by their place among the values, each with the range of its field (IS-GPS-200N, tables
/// 20-I and 20-III).
fn elements(set: &Ephemeris) -> [(usize, f64, f64, f64); 25] {
    let tau2 = 12.57;
    [
        (0, set.af0_s, -9.77e-4, 9.77e-4),
        (1, set.af1_sps, -3.73e-9, 3.73e-9),
        (2, set.af2_sps2, -3.56e-15, 3.56e-15),
        (3, f64::from(set.iode), 0.0, 255.0),
        (4, set.crs_m, -1025.0, 1025.0),
        (5, set.delta_n_radps, -1.18e-8, 1.18e-8),
        (6, set.m0_rad, -tau2, tau2),
        (7, set.cuc_rad, -6.11e-5, 6.11e-5),
        (8, set.eccentricity, 0.0, 0.1),
        (9, set.cus_rad, -6.11e-5, 6.11e-5),
        (10, set.sqrt_a_sqrtm, 5000.0, 5300.0),
        (12, set.cic_rad, -6.11e-5, 6.11e-5),
        (13, set.omega0_rad, -tau2, tau2),
        (14, set.cis_rad, -6.11e-5, 6.11e-5),
        (15, set.i0_rad, 0.0, 3.15),
        (16, set.crc_m, -1025.0, 1025.0),
        (17, set.omega_rad, -tau2, tau2),
        (18, set.omega_dot_radps, -3.0e-6, 3.0e-6),
        (19, set.idot_radps, -2.93e-9, 2.93e-9),
        (20, f64::from(set.l2_codes), 0.0, 3.0),
        (24, f64::from(set.health), 0.0, 63.0),
        (25, set.tgd_s, -5.97e-8, 5.97e-8),
        (26, f64::from(set.iodc), 0.0, 1023.0),
        (11, set.toe.tow_s(), 0.0, 604_800.0),
        (21, set.toe.week() as f64, 0.0, 9999.0),
    ]
}

/// True if a set equals the record. A blank optional field and a week that begins meanwhile are accepted.
fn same(set: &Ephemeris, record: &Written) -> bool {
    set.sv.number == record.number
        && Epoch::parse(&record.toc).is_ok_and(|toc| toc == set.toc)
        && elements(set).iter().all(|(place, value, ..)| match (place, record.values[*place]) {
            // An epoch is whole seconds and a fraction: a sum of two numbers below 2^20, each rounded to
            // 2^-33 s.
            (11, Some(tow_s)) => (tow_s.rem_euclid(604_800.0) - *value).abs() < 1e-9,
            (21, Some(week)) => [0.0, 1.0, 1023.0].contains(&((week - value).abs() % 1024.0)),
            (20 | 26, None) => true,
            (_, Some(found)) => found == *value,
            (_, None) => false,
        })
}

/// Checks that every value read from a file lies in its range.
fn within(bytes: &[u8]) -> Result<End, String> {
    let Ok(found) = read(bytes, "damaged") else { return Ok(End::Refused) };
    ranges(&found)?;
    Ok(if found.skipped.is_empty() { End::Accepted } else { End::Reported })
}

/// Checks that every element lies in its range.
pub fn ranges(found: &Navigation) -> Result<(), String> {
    for set in &found.ephemerides {
        for (place, value, low, high) in elements(set) {
            if !(low..=high).contains(&value) {
                return Err(format!("{} value {place} = {value}: not from {low} to {high}", set.sv));
            }
        }
    }
    Ok(())
}

/// Conditions on a file that was `whole` before its damage.
fn check(version: u8, whole: &[Written], bytes: &[u8]) -> Result<End, String> {
    let Navigation { ephemerides, skipped, .. } = match read(bytes, "damaged") {
        Err(error) if error.to_string().starts_with("damaged: ") => return Ok(End::Refused),
        Err(error) => return Err(format!("an error without the file's name: {error}")),
        Ok(found) => found,
    };
    within(bytes)?;
    let stands = written(version, bytes);
    for set in &ephemerides {
        if !stands.iter().any(|record| same(set, record)) {
            return Err(format!("this is not what stands in the file: {set:?}"));
        }
    }
    if !skipped.is_empty() {
        return if skipped.iter().all(|reason| !reason.is_empty()) {
            Ok(End::Reported)
        } else {
            Err("a record is left out without a reason".to_owned())
        };
    }
    // Nothing was left out: no record that stands there may be missing, and of none only a part may stand
    // there.
    if let Some(lost) = stands.iter().find(|record| !ephemerides.iter().any(|set| same(set, record))) {
        return Err(format!("'{}' is lost and not named", lost.title));
    }
    let text = String::from_utf8_lossy(bytes);
    for record in whole {
        let there = stands.iter().any(|other| other.title == record.title);
        if text.contains(&record.title) && !there {
            return Err(format!("'{}' is there in part, and not named", record.title));
        }
    }
    Ok(End::Accepted)
}

#[test]
fn a_file_cut_anywhere_gives_its_whole_records_and_names_the_cut_one() {
    let mut tally = Tally::new(FAMILY, "1. cut at every byte");
    for (version, text) in bases() {
        let whole = written(version, text.as_bytes());
        assert_eq!(
            (whole.len(), read(text.as_bytes(), "whole").unwrap().ephemerides.len()),
            (3, 3),
            "version {version}"
        );
        for cut in (0..text.len()).step_by(cases(37, 1)) {
            let name = || format!("version {version} cut at byte {cut}");
            tally.case(name, || check(version, &whole, &text.as_bytes()[..cut]));
        }
    }
    tally.finish();
}

#[test]
fn damage_of_any_kind_is_refused_or_named_or_is_what_the_file_says() {
    let mut failures = Vec::new();
    for (class, kind) in CLASSES.iter().enumerate() {
        let mut tally = Tally::new(FAMILY, format!("2. {kind}"));
        for (version, text) in bases() {
            let whole = written(version, text.as_bytes());
            for seed in 0..cases(20, 400) as u64 {
                let bytes = damaged(text.as_bytes(), class, seed);
                let name = || format!("version {version}, {kind}, seed {seed}");
                tally.case(name, || check(version, &whole, &bytes));
            }
        }
        failures.extend(tally.close().err());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The text with field `field` (0 to 30) of its second record in another form.
pub fn with_field(version: u8, text: &str, field: usize, form: impl Fn(&str) -> String) -> String {
    let margin = if version == 2 { 3 } else { 4 };
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let head = lines.iter().position(|line| line.contains("END OF HEADER")).unwrap() + 1;
    let titles: Vec<usize> = (head..lines.len()).filter(|i| !lines[*i].starts_with([' ', '>'])).collect();
    let first = if version == 2 { head + 8 } else { titles[1] };
    let (row, from) =
        if field < 3 { (0, margin + 19 * (field + 1)) } else { ((field - 3) / 4 + 1, margin + 19 * ((field - 3) % 4)) };
    let line = &mut lines[first + row];
    let old = line[from..from + 19].trim().to_owned();
    line.replace_range(from..from + 19, &format!("{:>19}", form(&old)));
    lines.join("\n") + "\n"
}

#[test]
fn a_number_is_the_same_in_every_legal_form_and_nothing_else_is_a_number() {
    let legal: [fn(&str) -> String; 8] = [
        |old| old.replace('D', "d"),
        |old| old.replace('D', "E"),
        |old| old.replace('D', "e"),
        |old| old.replace("0.", "."),
        |old| old.replace("D+0", "D+"),
        |old| old.replace("D+0", "D0"),
        |old| if old.starts_with('-') { old.to_owned() } else { old.replace("D-0", "D-00") },
        |old| if old.starts_with('-') { old.to_owned() } else { format!("+{old}") },
    ];
    let illegal = [
        "NaN", "nan", "Inf", "-inf", "infinity", "0.1D+999", "0.1D", "1.2.3", "--1", "0x1F", "1,5", "1_0", "1 2",
        "*****", "0.1D+-2", "0.1F+02", "0.1D+02x", "?", "0.5+02", "1e400",
    ];
    let mut tally = Tally::new(FAMILY, "3. number formats");
    for (version, text) in bases() {
        let whole = read(text.as_bytes(), "whole").unwrap();
        for field in (0..31).step_by(cases(5, 1)).filter(|field| *field < 29) {
            for (form, change) in legal.iter().enumerate() {
                let changed = with_field(version, &text, field, change);
                tally.case(
                    || format!("version {version}, field {field}, legal form {form}"),
                    || match read(changed.as_bytes(), "changed") {
                        Ok(found) if found == whole => Ok(End::Accepted),
                        other => Err(format!("{other:?}").chars().take(300).collect()),
                    },
                );
            }
            for word in illegal {
                let changed = with_field(version, &text, field, |_| word.to_owned());
                tally.case(
                    || format!("version {version}, field {field}: {word}"),
                    || match read(changed.as_bytes(), "changed") {
                        Ok(found) if found.ephemerides.len() == 2 && found.skipped.len() == 1 => Ok(End::Reported),
                        other => Err(format!("{other:?}").chars().take(300).collect()),
                    },
                );
            }
        }
    }
    tally.finish();
}

#[test]
fn line_ends_marks_and_blanks_change_nothing() {
    type Form = (&'static str, fn(&str) -> Vec<u8>);
    let forms: [Form; 9] = [
        ("CRLF", |t| t.replace('\n', "\r\n").into_bytes()),
        ("CR", |t| t.replace('\n', "\r").into_bytes()),
        ("byte order mark", |t| [b"\xef\xbb\xbf", t.as_bytes()].concat()),
        ("trailing blanks", |t| t.lines().map(|line| format!("{line:<100}\n")).collect::<String>().into_bytes()),
        ("short lines", |t| t.lines().map(|line| format!("{}\n", line.trim_end())).collect::<String>().into_bytes()),
        ("blank lines in the body", |t| {
            let (head, body) = t.split_once("END OF HEADER").unwrap();
            format!("{head}END OF HEADER{}", body.replace('\n', "\n\n")).into_bytes()
        }),
        ("no last line feed", |t| t.trim_end().as_bytes().to_vec()),
        ("lower case", |t| t.replace("D+", "d+").replace("D-", "d-").into_bytes()),
        ("gzip", |t| packed(t.as_bytes())),
    ];
    let mut tally = Tally::new(FAMILY, "4. line ends, marks, blanks");
    for (version, text) in bases() {
        let whole = read(text.as_bytes(), "whole").unwrap();
        for (form, change) in forms {
            for (other, then) in forms {
                let once = change(&text);
                let bytes = match std::str::from_utf8(&once) {
                    Ok(once) if form != "byte order mark" && form != "CR" => then(once),
                    _ => once,
                };
                tally.case(
                    || format!("version {version}, {form}, {other}"),
                    || match read(&bytes, "changed") {
                        Ok(found) if found == whole => Ok(End::Accepted),
                        other => Err(format!("{other:?}").chars().take(400).collect()),
                    },
                );
            }
        }
    }
    tally.finish();
}

#[test]
fn the_order_of_records_and_their_repetition_change_nothing() {
    let mut text = String::new();
    flate2::read::GzDecoder::new(DAY).read_to_string(&mut text).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let (head, body) =
        (lines[..8].join("\n"), lines[8..8 + 8 * 40].chunks(8).map(|r| r.join("\n")).collect::<Vec<_>>());
    let whole = read(format!("{head}\n{}\n", body.join("\n")).as_bytes(), "whole").unwrap();
    let mut tally = Tally::new(FAMILY, "6. shuffled and repeated records");
    for seed in 0..cases(20, 1000) as u64 {
        let mut random = Random::new(seed);
        let mut order: Vec<&str> = body.iter().map(String::as_str).collect();
        for k in (1..order.len()).rev() {
            order.swap(k, random.below(k + 1));
        }
        let again = order[random.below(order.len())];
        order.insert(random.below(order.len()), again);
        let text = format!("{head}\n{}\n", order.join("\n"));
        tally.case(
            || format!("seed {seed}"),
            || match read(text.as_bytes(), "shuffled") {
                Ok(found) if found == whole => Ok(End::Accepted),
                other => Err(format!("{other:?}").chars().take(300).collect()),
            },
        );
    }
    tally.finish();
}

pub fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    writer.write_all(bytes).unwrap();
    writer.finish().unwrap()
}

#[test]
fn packed_files_that_are_cut_damaged_or_swell_are_refused() {
    let mut tally = Tally::new(FAMILY, "7. gzip: cut, damaged, swelling");
    for cut in (1..DAY.len()).step_by(cases(DAY.len() / 30, 97)) {
        tally.case(
            || format!("cut at {cut}"),
            || match read(&DAY[..cut], "cut.gz") {
                Err(error) if error.to_string().starts_with("cut.gz: ") => Ok(End::Refused),
                other => Err(format!("{:?}", other.map(|found| found.ephemerides.len()))),
            },
        );
    }
    let whole = read(DAY, "whole").unwrap();
    for seed in 0..cases(10, 300) as u64 {
        let mut random = Random::new(seed);
        let mut bytes = DAY.to_vec();
        // Name, time and system in the header are none of the content.
        let at = 10 + random.below(bytes.len() - 10);
        bytes[at] ^= 1 << random.below(8);
        tally.case(
            || format!("seed {seed}, byte {at}"),
            || match read(&bytes, "bent.gz") {
                Err(_) => Ok(End::Refused),
                Ok(found) if found == whole => Ok(End::Accepted),
                Ok(_) => Err("another content passes".to_owned()),
            },
        );
    }
    let text = bases()[0].1.clone();
    let twice = [packed(&text.as_bytes()[..1000]), packed(&text.as_bytes()[1000..])].concat();
    tally.case(
        || "two members".to_owned(),
        || {
            if read(&twice, "two") == read(text.as_bytes(), "two") {
                Ok(End::Accepted)
            } else {
                Err("differs".to_owned())
            }
        },
    );
    tally.case(
        || "nested".to_owned(),
        || read(&packed(&packed(text.as_bytes())), "nested").map_or(Ok(End::Refused), |_| Err("accepted".to_owned())),
    );
    if crate::tally::long() {
        let zeros = vec![0; 1 << 20];
        let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        (0..300).for_each(|_| writer.write_all(&zeros).unwrap());
        let bomb = writer.finish().unwrap();
        tally.case(
            || format!("300 MiB of zeros in {} bytes", bomb.len()),
            || match read(&bomb, "bomb.gz") {
                Err(error) if error.to_string().contains("268435456") => Ok(End::Refused),
                other => Err(format!("{:?}", other.map(|found| found.ephemerides.len()))),
            },
        );
    }
    tally.finish();
}
