//! Elements at the bounds of their fields and one unit beyond, in the last of the twelve digits that a file
//! holds; and times of files and messages against tables from outside.

use gnss::rinex::read;
use gnss::time::Epoch;

use crate::damage::Random;
use crate::navigation::{bases, with_field};
use crate::tally::{End, Tally, cases};

/// Field of a record, the name that refusals give it, and its bounds (IS-GPS-200N, tables 20-I and 20-III, as
/// RINEX rounds them: two's complement of the field's bits times its scale; angles of any turn up to two).
const FIELDS: [(usize, &str, f64, f64); 22] = [
    (0, "af0", -9.766e-4, 9.766e-4),
    (1, "af1", -3.726e-9, 3.726e-9),
    (2, "af2", -3.553e-15, 3.553e-15),
    (3, "iode", 0.0, 255.0),
    (4, "crs", -1024.001, 1024.001),
    (5, "deltaN", -1.171e-8, 1.171e-8),
    (6, "m0", -12.566370614359172, 12.566370614359172),
    (7, "cuc", -6.104e-5, 6.104e-5),
    (8, "e", 0.0, 0.1),
    (9, "cus", -6.104e-5, 6.104e-5),
    (10, "sqrta", 5000.0, 5300.0),
    (11, "toe", 0.0, 604_800.0),
    (12, "cic", -6.104e-5, 6.104e-5),
    (13, "omega0", -12.566370614359172, 12.566370614359172),
    (14, "cis", -6.104e-5, 6.104e-5),
    (15, "i0", 0.0, std::f64::consts::PI),
    (16, "crc", -1024.001, 1024.001),
    (17, "omega", -12.566370614359172, 12.566370614359172),
    (18, "omegaDot", -2.997e-6, 2.997e-6),
    (19, "idot", -2.927e-9, 2.927e-9),
    (24, "health", 0.0, 63.0),
    (25, "tgd", -5.961e-8, 5.961e-8),
];

/// The twelve-digit numbers next to a bound: the one that it holds, and the one beyond it, away from the
/// other bound.
fn beside(bound: f64, outwards: f64) -> (String, String) {
    let text = |digits: i64, power: i32| {
        let sign = if digits < 0 { "-" } else { "" };
        format!("{sign}0.{:012}D{power:+03}", digits.abs())
    };
    if bound == 0.0 {
        return (text(0, 0), text(outwards as i64 * 100_000_000_000, -11));
    }
    let power = libm::log10(bound.abs()).floor() as i32 + 1;
    // Digits as a whole number; rounding may have gone beyond the bound.
    let value = |digits: i64| text(digits, power).replace('D', "e").parse::<f64>().unwrap();
    let step = outwards as i64;
    let mut digits = (bound / 10_f64.powi(power - 12)).round() as i64;
    while (value(digits) - bound) * outwards > 0.0 {
        digits -= step;
    }
    while (value(digits + step) - bound) * outwards <= 0.0 {
        digits += step;
    }
    (text(digits, power), text(digits + step, power))
}

#[test]
fn elements_at_their_bounds_pass_and_a_unit_beyond_are_refused_by_name() {
    let mut tally = Tally::new("Navigation files", "5. at the bounds and a unit beyond");
    // Whole numbers step by one.
    let whole = |name: &str| ["iode", "health"].contains(&name);
    let (version, text) = &bases()[1];
    for (field, name, low, high) in FIELDS {
        for (bound, outwards) in [(low, -1.0), (high, 1.0)] {
            let (inside, outside) = beside(bound, outwards);
            let outside = if whole(name) { beside(bound + outwards, outwards).0 } else { outside };
            let at = with_field(*version, text, field, |_| inside.clone());
            tally.case(
                || format!("{name} = {inside}"),
                || match read(at.as_bytes(), "at") {
                    Ok(found) if found.ephemerides.len() == 3 && found.skipped.is_empty() => Ok(End::Accepted),
                    other => Err(format!("{other:?}").chars().take(300).collect()),
                },
            );
            let beyond = with_field(*version, text, field, |_| outside.clone());
            tally.case(
                || format!("{name} = {outside}"),
                || match read(beyond.as_bytes(), "beyond") {
                    Ok(found)
                        if found.ephemerides.len() == 2
                            && found.skipped.len() == 1
                            && found.skipped[0].contains(&format!("{name} = "))
                            && found.skipped[0].contains("expected") =>
                    {
                        Ok(End::Reported)
                    }
                    other => Err(format!("{other:?}").chars().take(300).collect()),
                },
            );
        }
    }
    for (number, name) in [("00", "G00"), ("33", "G33"), ("99", "G99"), ("x7", "Gx7")] {
        let second = text.match_indices("\nG0").nth(1).unwrap().0 + 1;
        let mut changed = text.clone();
        changed.replace_range(second + 1..second + 3, number);
        tally.case(
            || name.to_owned(),
            || match read(changed.as_bytes(), "changed") {
                Ok(found) if found.ephemerides.len() == 2 && found.skipped[0].contains("1 to 32") => Ok(End::Reported),
                other => Err(format!("{other:?}").chars().take(300).collect()),
            },
        );
    }
    tally.finish();
}

/// First days (UTC) with a new number of leap seconds, and GPS time minus UTC from then on: IERS Bulletin C 1
/// to 52.
const LEAPS: [(i64, u8, u8, i64); 18] = [
    (1981, 7, 1, 1),
    (1982, 7, 1, 2),
    (1983, 7, 1, 3),
    (1985, 7, 1, 4),
    (1988, 1, 1, 5),
    (1990, 1, 1, 6),
    (1991, 1, 1, 7),
    (1992, 7, 1, 8),
    (1993, 7, 1, 9),
    (1994, 7, 1, 10),
    (1996, 1, 1, 11),
    (1997, 7, 1, 12),
    (1999, 1, 1, 13),
    (2006, 1, 1, 14),
    (2009, 1, 1, 15),
    (2012, 7, 1, 16),
    (2015, 7, 1, 17),
    (2017, 1, 1, 18),
];

/// Days since 1980-01-06 of a date of the Gregorian calendar, by counting leap years.
fn days(year: i64, month: u8, day: u8) -> i64 {
    let is_leap = |year: i64| year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let lengths = |year: i64| [31, if is_leap(year) { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let years: i64 = (1980..year).map(|year| if is_leap(year) { 366 } else { 365 }).sum();
    let months: i64 = lengths(year)[..usize::from(month) - 1].iter().sum();
    years + months + i64::from(day) - 6
}

#[test]
fn leap_seconds_week_rollovers_and_ends_of_years_are_those_of_tables_from_outside() {
    let mut tally = Tally::new("Navigation files", "27. leap seconds, weeks, years");
    let mut check = |name: String, found: Result<i64, String>, expected: i64| {
        let run = || match &found {
            Ok(found) if *found == expected => Ok(End::Accepted),
            other => Err(format!("{other:?}, expected {expected}")),
        };
        tally.case(|| name.clone(), run);
    };
    let seconds = |text: &str| Epoch::parse(text).map(Epoch::seconds).map_err(|e| e.to_string());
    for (year, month, day, after) in LEAPS {
        let midnight = days(year, month, day) * 86_400;
        let (last_year, last_month, last_day) = if month == 1 { (year - 1, 12, 31) } else { (year, 6, 30) };
        let before = format!("{last_year:04}-{last_month:02}-{last_day:02}");
        let first = format!("{year:04}-{month:02}-{day:02}T00:00:00Z");
        check(format!("{before}T23:59:59Z"), seconds(&format!("{before}T23:59:59Z")), midnight - 1 + after - 1);
        check(format!("{before}T23:59:60Z"), seconds(&format!("{before}T23:59:60Z")), midnight + after - 1);
        check(first.clone(), seconds(&first), midnight + after);
        let text = Epoch::new(midnight + after - 1, 0.0).to_utc_text();
        let same = i64::from(text.starts_with(&format!("{before}T23:59:60")));
        check(format!("the inserted second as {text}"), Ok(same), 1);
        check(format!("leap seconds at {first}"), Ok(Epoch::new(midnight + after, 0.0).leap_seconds()), after);
        check(
            format!("leap seconds before {first}"),
            Ok(Epoch::new(midnight + after - 2, 0.0).leap_seconds()),
            after - 1,
        );
    }
    // The 10-bit week began again on these days (GPS time).
    for (year, month, day, week) in [(1999, 8, 22, 1024), (2019, 4, 7, 2048), (2038, 11, 21, 3072)] {
        let text = format!("{year}-{month:02}-{day:02}T00:00:00");
        let start = Epoch::parse(&text).unwrap();
        check(format!("week of {text}"), Ok(start.week()), week);
        check(format!("time of week of {text}"), Ok(start.tow_whole_s()), 0);
        check(format!("week before {text}"), Ok(start.plus_s(-1.0).week()), week - 1);
        check(format!("time of week before {text}"), Ok(start.plus_s(-1.0).tow_whole_s()), 604_799);
        // A record at the rollover, its week whole, of ten bits, and of the week before.
        let base = &bases()[1].1;
        for (written, taken) in [(week, true), (week % 1024, true), (week - 1, true), (week + 40, false)] {
            let title = format!("{year} {month:02} {day:02} 00 00 00");
            let changed = base.replace("2010 07 01 00 00 00", &title);
            let changed = changed.replace("0.345600000000D+06", "0.000000000000D+00");
            let changed =
                changed.replace("0.159000000000D+04", &format!("{:.12e}", written as f64).replace('e', "D+0"));
            let found = read(changed.as_bytes(), "rollover").map(|found| found.ephemerides.len()).unwrap_or(0);
            check(format!("a record of {title} with week {written}"), Ok((found > 0).into()), taken.into());
        }
    }
    for year in 1981..2081 {
        let text = format!("{year}-01-01T00:00:00");
        check(text.clone(), seconds(&text), days(year, 1, 1) * 86_400);
        let last = format!("{}-12-31T23:59:59", year - 1);
        check(last.clone(), seconds(&last), days(year, 1, 1) * 86_400 - 1);
    }
    let mut random = Random::new(27);
    for _ in 0..cases(100, 10_000) {
        let (year, month, day) =
            (1981 + random.below(190) as i64, 1 + random.below(12) as u8, 1 + random.below(28) as u8);
        let of_day = random.below(86_400) as i64;
        let text =
            format!("{year}-{month:02}-{day:02}T{:02}:{:02}:{:02}", of_day / 3600, of_day / 60 % 60, of_day % 60);
        check(text.clone(), seconds(&text), days(year, month, day) * 86_400 + of_day);
    }
    for bad in [
        "2010-02-29T00:00:00",
        "1900-01-01T00:00:00",
        "2010-13-01T00:00:00",
        "2010-00-01T00:00:00",
        "2010-01-32T00:00:00",
        "2010-01-01T24:00:00",
        "2010-01-01T00:60:00",
        "2010-01-01T00:00:61",
        "2100-02-29T00:00:00",
        "1980-01-05T23:59:59",
    ] {
        check(bad.to_owned(), Ok(i64::from(Epoch::parse(bad).is_err())), 1);
    }
    tally.finish();
}
