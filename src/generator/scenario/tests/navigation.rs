//! Several navigation files, changes of UTC, records that cannot be sent, and spans that refusals name.

use super::*;
use crate::scenario::files::Files;
use crate::scenario::parts;
use gnss::inflate::inflate;
use gnss::message::Common;

/// A day of GPS in version 2.
const DAY: &[u8] = include_bytes!("../../../gnss/data/brdc1820-2010.n.gz");

fn day() -> String {
    String::from_utf8(inflate(DAY, 1 << 24).unwrap()).unwrap()
}

/// The day's first records, the header's leap seconds as given and its times later by whole days.
fn file(leap_s: Option<i64>, later_days: i64) -> String {
    let text = day();
    let (head, body) = text.split_once("END OF HEADER").unwrap();
    let line = leap_s.map_or(String::new(), |leap_s| format!("{leap_s:6}{:54}LEAP SECONDS\n", ""));
    let head: String =
        head.lines().filter(|line| !line.contains("LEAP SECONDS")).map(|line| format!("{line}\n")).collect();
    let head = head.strip_suffix('\n').unwrap().to_owned();
    let head = head.replacen("    0.4657", &format!("    0.{}657", 4 + later_days), 1);
    let body: Vec<&str> = body.lines().skip(1).collect();
    let mut records = String::new();
    for record in body.chunks_exact(8) {
        let day: i64 = record[0][9..11].trim().parse().unwrap();
        if day != 1 {
            continue;
        }
        records += &format!("{}{:2}{}\n", &record[0][..9], day + later_days, &record[0][11..]);
        for (row, line) in record.iter().enumerate().skip(1) {
            let toe: f64 = line[3..22].replace('D', "e").trim().parse().unwrap();
            let field = |value: f64| format!("{value:>19.12E}");
            let moved = match row {
                3 => format!("   {}{}", field(toe + 86_400.0 * later_days as f64), &line[22..]),
                7 => format!("   {}{}", field(toe + 86_400.0 * later_days as f64), &line[22..]),
                _ => (*line).to_owned(),
            };
            records += &(moved + "\n");
        }
    }
    let last = head.rfind('\n').unwrap() + 1;
    format!("{}{line}{}END OF HEADER\n{records}", &head[..last], &head[last..])
}

/// Parameters that a scene sends alike, or the error, and its warnings.
fn sent(text: &str, files: &[(&str, String)]) -> (Result<Common, String>, Vec<String>) {
    let room = tempfile::tempdir().unwrap();
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    files.iter().for_each(|(name, content)| std::fs::write(room.path().join(name), content).unwrap());
    let text = if names.is_empty() { text.to_owned() } else { format!("{text}\n[navigation]\nfile = {names:?}\n") };
    let (scenario, overrides, mut warnings) = (parse(&text).unwrap(), Overrides::default(), Vec::new());
    let all = parts::navigation(
        &scenario,
        scenario.start,
        &Files { directory: room.path(), overrides: &overrides },
        &mut warnings,
    )
    .unwrap();
    let here = Files { directory: room.path(), overrides: &overrides };
    let sky = parts::sky(&scenario, &all, &here, scenario.duration_s, &mut warnings);
    (sky.map(|sky| sky.common).map_err(|error| error.to_string()), warnings)
}

#[test]
fn what_all_satellites_say_alike_is_that_of_the_scene_s_day_whatever_the_order_of_its_files() {
    let [one, two] = [("one.10n", file(Some(15), 0)), ("two.10n", file(Some(17), 1))];
    let first = format!("{MINIMAL}{STATIC}");
    let second = replaced(&first, "", "start", "2010-07-02T10:00:00");
    for (text, leap_s, alpha) in [(&first, 15, 0.4657e-8), (&second, 17, 0.5657e-8)] {
        for files in [[one.clone(), two.clone()], [two.clone(), one.clone()]] {
            let common = sent(text, &files).0.unwrap();
            assert_eq!((common.utc.leap_s, common.klobuchar.unwrap().alpha[0]), (leap_s, alpha));
        }
        // What the day's own file does not have is in the other one.
        let other = sent(text, &[("one.10n", file(None, 0)), two.clone()]).0.unwrap();
        assert_eq!(other.utc.leap_s, 17);
    }
}

#[test]
fn a_change_of_utc_that_the_file_does_not_name_is_the_program_s_own() {
    let event = |start: &str, leap_s| {
        let text = replaced(&format!("{MINIMAL}{STATIC}"), "", "start", start);
        let scenario = parse(&text).unwrap();
        let navigation = gnss::rinex::Navigation { leap_seconds: leap_s, ..Default::default() };
        let utc = parts::utc(&scenario, &navigation);
        (utc.leap_s, utc.event.map(|event| (event.after_s, event.week, event.day)))
    };
    // Headers of real files of 2023 to 2026 read `18 18 1929 7`.
    let change = Some((18, 1929, 7));
    assert_eq!(event("2016-12-31T23:50:58", None), (17, change));
    assert_eq!(event("2016-08-01T00:00:00", Some(17)), (17, change));
    // A file of the day before the change, and one that was told.
    assert_eq!(event("2017-01-01T12:00:00", Some(17)), (17, change));
    assert_eq!(event("2017-01-01T12:00:00", Some(18)), (18, None));
    assert_eq!(event("2016-06-01T00:00:00", None), (17, None));
}

#[test]
fn a_record_that_cannot_be_sent_is_left_out_by_name_and_the_scene_goes_on() {
    let text = format!("{MINIMAL}{STATIC}");
    let whole = file(Some(15), 0);
    let (_, none) = sent(&text, &[("day.10n", whole.clone())]);
    // The sixth line ends with the issue of the clock: of the first record that of 63.
    let (head, body) = whole.split_once("END OF HEADER").unwrap();
    let mut lines: Vec<String> = body.lines().map(str::to_owned).collect();
    assert!(lines[7].ends_with("0.630000000000D+02"), "{}", lines[7]);
    let last = lines[7].len() - "0.630000000000D+02".len();
    lines[7].replace_range(last.., "0.640000000000D+02");
    let (common, warnings) = sent(&text, &[("day.10n", format!("{head}END OF HEADER{}\n", lines.join("\n")))]);
    assert!(common.is_ok());
    let own: Vec<&String> = warnings.iter().filter(|warning| !none.contains(warning)).collect();
    let [warning] = own.as_slice() else { panic!("{warnings:?}") };
    assert!(warning.starts_with("G01: left out the ephemeris of 2010-07-01T00:00:00"), "{warning}");
    assert!(warning.contains("iode = 63 contradicts iodc = 64"), "{warning}");
}

#[test]
fn refusals_name_spans_that_do_not_hold_what_is_refused() {
    let at = |start: &str| replaced(&format!("{MINIMAL}{STATIC}"), "", "start", start);
    let files = [("one.10n", file(Some(15), 0)), ("three.10n", file(Some(15), 2))];
    let refused = |text: &str| sent(text, &files).0.unwrap_err();
    // Between two days, of which each is sent from two hours before it to two after its last ephemeris.
    let gap = refused(&at("2010-07-02T12:00:00"));
    assert!(gap.contains("at 2010-07-02T12:00:00.000000, the start of the scene"), "{gap}");
    assert!(gap.contains("within 2010-06-30T22:00:00.000000 to 2010-07-02T0"), "{gap}");
    assert!(gap.contains(" or 2010-07-02T22:00:00.000000 to 2010-07-04T0"), "{gap}");
    let end = refused(&replaced(&at("2010-07-01T23:00:00"), "", "duration_s", "14400"));
    assert!(end.contains("at 2010-07-02T03:00:00.000000, the end of the scene of 14400 s"), "{end}");
    let none = refused(&format!("signals = [\"Galileo E1\"]\n{}", at("2010-07-01T12:00:00")));
    assert!(none.contains("has no ephemeris of Galileo") && !none.contains("nowhere"), "{none}");
}

#[test]
fn a_file_moved_to_another_day_has_the_same_sky_at_the_same_hour_and_says_the_new_week() {
    let base = format!("{MINIMAL}{STATIC}");
    let compose = |text: &str| parse(text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap();
    let (then, _) = compose(&base);
    let moved =
        format!("{}\n[navigation]\nmoved_to = 2031-03-05\n", replaced(&base, "", "start", "2031-03-05T10:00:00"));
    let (now, warnings) = compose(&moved);
    assert!(warnings.iter().all(|warning| warning.contains("left out")), "{warnings:?}");
    let starts = [then.clock.start, now.clock.start];
    let mut seen = 0;
    for sv in then.catalogue.satellites() {
        let [Some((was, clock)), Some((is, same))] =
            [(&then, starts[0]), (&now, starts[1])].map(|(scene, at)| scene.catalogue.truth(sv, at).unwrap())
        else {
            continue;
        };
        // Rounding of the node: 1e-15 rad of 26 560 km, and of times.
        assert!((was.position_m - is.position_m).norm() < 1e-5 && (was.velocity_mps - is.velocity_mps).norm() < 1e-8);
        assert!((clock.offset_s - same.offset_s).abs() < 1e-16, "{sv}");
        let sets =
            [(&then, starts[0]), (&now, starts[1])].map(|(scene, at)| scene.catalogue.sent_at(sv, at).unwrap().clone());
        assert_eq!(sets[1].toe.week() - starts[1].week(), sets[0].toe.week() - starts[0].week());
        seen += 1;
    }
    assert!(seen > 25, "{seen}");
    // UTC is that of the new day: 18 s, not the 15 s of the file.
    let leap_s = |text: &str| {
        let scenario = parse(text).unwrap();
        let overrides = Overrides::default();
        let files = Files { directory: Path::new("."), overrides: &overrides };
        let read = parts::navigation(&scenario, scenario.start, &files, &mut Vec::new());
        parts::utc(&scenario, &read.unwrap()).leap_s
    };
    assert_eq!((leap_s(&base), leap_s(&moved)), (15, 18));
    let refused = |text: &str| parse(text).map(|_| ()).unwrap_err().to_string();
    assert!(refused(&moved.replace("2031-03-05\n", "\"soon\"\n")).contains("moved_to"));
}
