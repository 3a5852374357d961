//! Cases 59 to 61: weeks, days and leap years of every system's time as its messages count them.
//!
//! The truth is the documents' alone: the civil date on which a scale begins, days by the Gregorian rule and
//! leap seconds as IERS Bulletin C lists them, in 128-bit integers of nanoseconds or seconds.

use std::collections::{BTreeMap, BTreeSet};

use generator::message::{self, Senders, Slot};
use gnss::broadcast::Ephemeris;
use gnss::gps::lnav::UtcData;
use gnss::message::{Common, Message, Read};
use gnss::satellite::System;
use gnss::signal::{SIGNALS, Signal};
use gnss::time::{Epoch, TimeScale, UTC};

use crate::figures::{self, NONE, case};
use crate::skies;

const DAY_S: i128 = 86_400;
const WEEK_S: i128 = 604_800;

/// Days from 1970-01-01 to a date of the Gregorian calendar, by counting whole years from 1 March.
fn days([year, month, day]: [i128; 3]) -> i128 {
    let (years, months) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leaps = years.div_euclid(4) - years.div_euclid(100) + years.div_euclid(400);
    365 * years + leaps + (153 * months + 2) / 5 + day - 1 - 719_468
}

/// Seconds from 1980-01-06T00:00:00 to midnight of a date in a calendar of days of 86 400 s.
fn reading(date: [i128; 3]) -> i128 {
    (days(date) - days([1980, 1, 6])) * DAY_S
}

/// Dates at whose beginning UTC fell a second further behind GPS time, of which it had been abreast (IERS
/// Bulletin C).
const LEAPS: [[i128; 3]; 18] = [
    [1981, 7, 1],
    [1982, 7, 1],
    [1983, 7, 1],
    [1985, 7, 1],
    [1988, 1, 1],
    [1990, 1, 1],
    [1991, 1, 1],
    [1992, 7, 1],
    [1993, 7, 1],
    [1994, 7, 1],
    [1996, 1, 1],
    [1997, 7, 1],
    [1999, 1, 1],
    [2006, 1, 1],
    [2009, 1, 1],
    [2012, 7, 1],
    [2015, 7, 1],
    [2017, 1, 1],
];

/// Seconds of GPS time at which UTC reads a midnight.
fn gpst_of_utc(date: [i128; 3]) -> i128 {
    reading(date) + LEAPS.iter().filter(|leap| **leap <= date).count() as i128
}

/// UTC at a second of GPS time, as seconds of its calendar; during an inserted second the one after it.
fn utc_of_gpst(seconds: i128) -> i128 {
    // A second is inserted before its date: by then the old count has run a second over.
    let passed = |leap: &&[i128; 3]| seconds >= gpst_of_utc(**leap);
    seconds - LEAPS.iter().filter(passed).count() as i128
}

/// Time numbering of a system's documents.
struct Numbers {
    /// GPS seconds at which its week 0, or its first day, begins.
    begins: i128,
    /// Calendar time at that beginning.
    reads: i128,
}

/// Beginning of each scale.
fn numbers(system: System) -> Numbers {
    match system {
        // IS-GPS-200N, 3.3.4, IS-QZSS-PNT-005, 3.1.4 and DO-229, A.4.4.15: midnight of 1980-01-05/06 of UTC.
        System::Gps | System::Qzss | System::Sbas => Numbers { begins: 0, reads: reading([1980, 1, 6]) },
        // Galileo OS SIS ICD 2.1, 5.1.2 and IRNSS SIS ICD for SPS 1.1, 6: 1999-08-22T00:00:00 UTC, when the
        // scale is 13 s ahead; its week has begun 13 s earlier.
        System::Galileo | System::Navic => {
            Numbers { begins: gpst_of_utc([1999, 8, 22]) - 13, reads: reading([1999, 8, 22]) }
        }
        // BDS-SIS-ICD-B1I 3.0, 3.3: 2006-01-01T00:00:00 UTC.
        System::BeiDou => Numbers { begins: gpst_of_utc([2006, 1, 1]), reads: reading([2006, 1, 1]) },
        // GLONASS ICD L1, L2 5.1, 4.4: days from 1996-01-01T00:00:00 of Moscow, three hours ahead of UTC.
        System::Glonass => Numbers { begins: gpst_of_utc([1996, 1, 1]) - 10_800, reads: reading([1996, 1, 1]) },
    }
}

/// Calendar time of a system at a second of GPS time.
pub fn reads(system: System, seconds: i128) -> i128 {
    match system {
        System::Glonass => utc_of_gpst(seconds) + 10_800,
        _ => numbers(system).reads + seconds - numbers(system).begins,
    }
}

fn epoch(seconds: i128) -> Epoch {
    Epoch::new(i64::try_from(seconds).unwrap(), 0.0)
}

/// The systems' scales, and UTC.
fn scales() -> Vec<(Option<System>, &'static TimeScale)> {
    let mut scales: Vec<(Option<System>, &'static TimeScale)> = vec![(None, &UTC)];
    for signal in SIGNALS {
        if !scales.contains(&(Some(signal.system), signal.time)) {
            scales.push((Some(signal.system), signal.time));
        }
    }
    scales
}

#[test]
fn every_scale_reads_what_its_calendar_does_at_its_rollovers_and_at_all_leap_seconds() {
    let the = case(59, "rollovers of every time scale", NONE);
    let (mut held, mut back, mut of) = (0, 0, 0);
    for (system, scale) in scales() {
        let begins = system.map_or(0, |system| numbers(system).begins);
        // Weeks of 8, 10, 12 and 13 bits and one more, the four years from 1996, and the leap seconds.
        let weeks = [0, 1, 256, 1023, 1024, 2047, 2048, 3072, 4096, 8191, 8192].map(|week| begins + week * WEEK_S);
        let years = (1996..2100).step_by(4).map(|year| gpst_of_utc([year, 1, 1]) - 10_800);
        let leaps = LEAPS.iter().map(|leap| gpst_of_utc(*leap));
        for edge in weeks.into_iter().chain(years).chain(leaps) {
            for away_s in [-302_400, -61, -14, -2, -1, 0, 1, 13, 61, 302_400] {
                let at = edge + away_s;
                if at < 0 {
                    continue;
                }
                let label = system.map_or_else(|| utc_of_gpst(at), |system| reads(system, at));
                of += 1;
                held += usize::from(i128::from(scale.label(epoch(at)).seconds()) == label);
                // An inserted second reads as the one after it, and that is the one that comes back.
                let again = i128::from(scale.instant(epoch(label)).seconds());
                let twice = LEAPS.iter().any(|leap| gpst_of_utc(*leap) == at + 1) && scale.has_leap_seconds;
                back += usize::from(again == if twice { at + 1 } else { at });
            }
        }
    }
    the.all("reading by the calendar from the document's first day", held, of);
    the.all("instant of that reading", back, of);
}

/// Bits of a message's number of the week.
fn week_bits(message: &Message) -> u32 {
    match message.name {
        // IS-GPS-200N, 20.3.3.3.1.1; IS-QZSS-PNT-005, 4.1.2.4; IRNSS SIS ICD for SPS 1.1, 6.2.1.1; DO-229.
        "LNAV" | "LNAV of QZSS" | "SPS NAV" | "SBAS" => 10,
        // Galileo OS SIS ICD 2.1, 5.1.2.
        "I/NAV" | "I/NAV on E5b" | "F/NAV" => 12,
        // IS-GPS-200N, 30.3.3.1.1.1; IS-GPS-800J, 3.5.3.1; BDS-SIS-ICD-B1I 3.0, 5.2.4.3; -B1C 1.0, 7.3; -B2a
        // 1.0; -B2b 1.0; NavIC SIS ICD for SPS in L1 1.0.
        _ => 13,
    }
}

/// A set with an issue of its own whose reference time is the nearest to `second` of the system's time that
/// keeps its place in the hour, or in the half of it where sets are of half hours.
fn near(set: &Ephemeris, signal: &Signal, second: i64) -> Ephemeris {
    let step_s = if signal.system == System::Glonass { 1800 } else { 3600 };
    let label = set.clone().timed(|at| signal.time.label(at));
    let ahead_s = (second - label.toe.seconds() + step_s / 2).div_euclid(step_s) * step_s;
    // NavIC's message on L1 counts in steps of five minutes, the shipped sets of L5 in others.
    let into_s = if signal.system == System::Navic { label.toe.seconds() % step_s } else { 0 };
    let ahead_s = ahead_s - into_s;
    let mut set = label.timed(|at| signal.time.instant(Epoch::new(at.seconds() + ahead_s, at.fraction())));
    if set.vector.is_none() {
        let issue = (set.toe.seconds() / 3600 % 16) as u16;
        (set.iode, set.iodc) = (issue, issue);
    }
    set
}

/// Every form of message of the catalogue that says its time, with a satellite's set of its system.
fn messages() -> Vec<(&'static Signal, &'static Message, Ephemeris)> {
    let mut found = BTreeMap::new();
    for signal in SIGNALS {
        let scene = skies::scene(&[signal], 0.01, &skies::front_end(signal, 65e6, 0.0));
        let up = skies::in_view(&scene, signal);
        let message = |component: &'static gnss::signal::Component| component.message;
        for message in signal.components.iter().filter_map(message).filter(|message| message.is_dated()) {
            // D1 and D2 are two messages in one form.
            for sv in &up {
                let set = scene.catalogue.sent_at(*sv, scene.clock.start).unwrap().clone();
                let is_d2 = message.name == "D1/D2" && sv.is_geostationary();
                found.entry((message.name, is_d2)).or_insert((signal, message, set));
            }
        }
    }
    found.into_values().collect()
}

/// Results of a message around an instant.
#[derive(Default)]
struct Heard {
    /// Units with a number of the week or of the day, and those whose number is the calendar's.
    numbers: [usize; 2],
    /// Units that were read, and those whose second of the week is right.
    units: [usize; 2],
    /// Sets of elements that were read, and those that have the reference times of one that was sent.
    sets: [usize; 2],
    /// Times that the reader told before and from the instant on, and those that are right.
    times: [usize; 3],
}

/// Sums over many messages.
#[derive(Default)]
struct Sum {
    heard: Heard,
    /// All, and those with times on both sides.
    rounds: [usize; 2],
}

impl Sum {
    fn add(&mut self, heard: &Heard) {
        let add = |sum: &mut [usize], part: &[usize]| sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        add(&mut self.heard.numbers, &heard.numbers);
        add(&mut self.heard.times, &heard.times);
        add(&mut self.heard.sets, &heard.sets);
        add(&mut self.heard.units, &heard.units);
        add(&mut self.rounds, &[1, usize::from(heard.times[0] > 0 && heard.times[1] > 0)]);
    }

    fn times(&self) -> usize {
        self.heard.times[0] + self.heard.times[1]
    }
}

/// Sends the units around a second of the system's time and reads them with a belief of the time by which
/// they are dated `aliased_s` late.
fn hear(
    (signal, message, set): &(&'static Signal, &'static Message, Ephemeris),
    second: i128,
    believed: i128,
    aliased_s: i128,
) -> Heard {
    let (second, believed) = (second as i64, epoch(believed));
    let utc = UtcData { leap_s: 18, ..UtcData::default() };
    let common = Common { utc, reference: Some(signal.time.instant(Epoch::new(second, 0.0))), ..Common::default() };
    let senders = Senders::new(&common, &[signal]).unwrap();
    let sender = senders.of(message).unwrap();
    // The longest wait for a time: a frame of LNAV or GLONASS, 30 s, and one just missed.
    let units = (66 / message.unit_s).max(2);
    let first = message.unit_at(second) - units;
    let mut reader = (message.reader)(set.sv);
    reader.know(believed);
    let (mut heard, mut fed, mut symbols_of_unit) = (Heard::default(), 0_u64, 0);
    let mut sent_at = BTreeSet::new();
    // Thousandths: no symbol is shorter.
    let symbol_ms = (message.symbol_s * 1e3).round() as i128;
    let first_ms = i128::from(message.unit_start(first).seconds()) * 1000;
    for unit in first..first + 2 * units + 1 {
        let slot = Slot { message, time: signal.time, unit };
        let set_at = |unit: i64| near(set, signal, message.unit_start(message.unit_of_set(unit)).seconds());
        let (before, now) = (set_at(unit - 1), set_at(unit));
        let sent = message::unit(&[], sender, [&before, &now], &slot)
            .unwrap_or_else(|e| panic!("{} at {second}: {e}", message.name));
        let [toe, toc] = [now.toe, now.toc].map(|at| i128::from(signal.time.label(at).seconds()) + aliased_s);
        sent_at.insert((toe, toc));
        let start = i128::from(message.unit_start(unit).seconds());
        for (name, raw) in (message.parameters)(&sent.symbols).map(|(_, all)| all).unwrap_or_default() {
            let due = match (signal.system, name) {
                (System::Glonass, "day") => {
                    Some((start - numbers(System::Glonass).reads).div_euclid(DAY_S).rem_euclid(1461) + 1)
                }
                (System::Glonass, "four_years") => {
                    Some((start - numbers(System::Glonass).reads).div_euclid(1461 * DAY_S) + 1)
                }
                (System::Glonass, _) => None,
                (system, "week") => {
                    let weeks = (start - numbers(system).reads).div_euclid(WEEK_S);
                    Some(weeks.rem_euclid(1 << week_bits(message)))
                }
                _ => None,
            };
            if let Some(due) = due {
                heard.numbers[0] += 1;
                heard.numbers[1] += usize::from(i128::from(raw) == due);
            }
        }
        for one in sent.symbols {
            fed += 1;
            for read in reader.take(if one { -9.0 } else { 9.0 }, believed) {
                match read {
                    Read::Unit { symbols, of_week_s, .. } => {
                        symbols_of_unit = symbols;
                        let into_ms = i128::from(fed - symbols) * symbol_ms;
                        // D2's subframes begin between seconds.
                        let due_s = (first_ms + into_ms).div_euclid(1000).rem_euclid(WEEK_S);
                        heard.units[0] += 1;
                        heard.units[1] += usize::from(i128::from(of_week_s) == due_s);
                    }
                    Read::Ephemeris(found) => {
                        heard.sets[0] += 1;
                        let at = (i128::from(found.toe.seconds()), i128::from(found.toc.seconds()));
                        heard.sets[1] += usize::from(sent_at.contains(&at));
                    }
                    Read::Time(label) => {
                        let due_ms = first_ms + i128::from(fed - symbols_of_unit) * symbol_ms;
                        let said_ms = i128::from(label.seconds()) * 1000 + (label.fraction() * 1e3).round() as i128;
                        heard.times[usize::from(due_ms >= i128::from(second) * 1000)] += 1;
                        heard.times[2] += usize::from(said_ms == due_ms + aliased_s * 1000);
                    }
                    _ => {}
                }
            }
        }
    }
    heard
}

#[test]
fn every_message_counts_over_its_rollovers_as_the_calendar_does() {
    let the = case(60, "messages at the rollovers of their weeks", "all 25 but GLONASS and Galileo E6");
    let days = case(61, "GLONASS days and four-year intervals", "GLONASS G1, G2");
    let messages = messages();
    let dated: Vec<&Signal> = (SIGNALS.iter().copied())
        .filter(|signal| signal.components.iter().any(|c| c.message.is_some_and(Message::is_dated)))
        .collect();
    assert_eq!(dated.len(), 24);
    let mut sum = Sum::default();
    let mut listed = BTreeSet::new();
    for sent in messages.iter().filter(|(signal, ..)| signal.system != System::Glonass) {
        let (signal, message, _) = sent;
        let whole = 1_i128 << week_bits(message);
        let mut weeks = vec![whole];
        if whole == 1024 || figures::long() {
            weeks.extend([256, 1023, 2048, 3072]);
        }
        for week in weeks {
            let second = numbers(signal.system).reads + week * WEEK_S;
            // What the receiver believes is off by up to half of what the number tells apart, and by more.
            for (away, aliased) in [(1 - whole / 2, 0), (0, 0), (whole / 2 - 1, 0), (whole / 2 + 2, whole)] {
                let believed = second + away * WEEK_S;
                if believed >= 0 {
                    let heard = hear(sent, second, believed, aliased * WEEK_S);
                    listed.extend((heard.numbers[0] > 0).then_some(message.name));
                    sum.add(&heard);
                }
            }
        }
    }
    the.all("rollovers with times read before and after", sum.rounds[1], sum.rounds[0]);
    the.all("times as read, or whole rounds on where the belief is", sum.heard.times[2], sum.times());
    the.all("seconds of the week of all units as read", sum.heard.units[1], sum.heard.units[0]);
    the.all("sets read around them, with the reference times sent", sum.heard.sets[1], sum.heard.sets[0]);
    assert_eq!(listed.len(), 11, "{listed:?}");
    // The other eight have theirs in what a unit says of itself, which the table of parameters leaves out.
    let figure = "numbers of the week as sent, of the 11 of 19 messages that list them, against the calendar";
    the.all(figure, sum.heard.numbers[1], sum.heard.numbers[0]);
    let mut sum = Sum::default();
    for sent in messages.iter().filter(|(signal, ..)| signal.system == System::Glonass) {
        // The ends of a day, of a year, of 29 February, and of all intervals of four years up to the year
        // 2100, which is no leap year.
        let years = (2000..=2096).step_by(4).map(|year| [year, 1, 1]);
        for date in years.chain([[2024, 2, 29], [2024, 3, 1], [2025, 1, 1], [2026, 5, 12], [2099, 12, 31]]) {
            // What is believed, to within a year, is off by 150 days.
            sum.add(&hear(sent, reading(date), reading(date) + 150 * DAY_S, 0));
        }
    }
    days.all("midnights with times read before and after", sum.rounds[1], sum.rounds[0]);
    days.all("times as read", sum.heard.times[2], sum.times());
    days.all("seconds of the week of all units as read", sum.heard.units[1], sum.heard.units[0]);
    days.all("sets read around them, with the reference times sent", sum.heard.sets[1], sum.heard.sets[0]);
    days.all("numbers of day and interval as sent, against the calendar", sum.heard.numbers[1], sum.heard.numbers[0]);
}
