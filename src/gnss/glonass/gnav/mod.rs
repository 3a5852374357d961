//! The message of GLONASS with frequency division: strings of two seconds, encoded and decoded.
//!
//! Source: GLONASS ICD L1, L2 5.1, sections 3.3.2.2 (what modulates the carrier) and 4. A string is 85 bits
//! of 20 ms, the last eight a Hamming code's, and a time mark of 30 chips of 10 ms; fifteen strings are a
//! frame, which begins at whole half minutes of GLONASS time. Bits are coded relative to the one before, and
//! multiplied with a meander: each is a chip of 10 ms and its opposite. A symbol here is such a chip. Strings
//! 1 to 4 carry an ephemeris: a state vector at a quarter of an hour, to whose middle half hour the ephemeris
//! belongs, and the clock; string 5 has the date's four years. An ephemeris is numbered by that quarter.
//!
//! The document's time mark has one sign against the meander, which shows whether symbols are inverted.
//! Bits do not depend on it.
//!
//! Limits: strings 6 to 15, almanacs, are empty but for their numbers. GLONASS time is sent as UTC(SU) and as
//! GPS time, whole seconds apart. How a leap second is sent is not settled by a document at hand: one second
//! is sent twice. A failed check is not corrected. Ephemerides that refer to midnight are read within half a
//! day of when they were sent.

mod fields;
mod reader;

use std::ops::RangeInclusive;

use crate::bits::{FieldError, Store, bits_of, integers, soft, write_all};
use crate::broadcast::{Ephemeris, SetForm};
use crate::ionosphere::Model;
use crate::message::{IonosphereForm, Message, Raw, Records, Sender};
use crate::satellite::Sv;
use crate::set_tables::SetTables;
use crate::time::Epoch;
pub use fields::{GlonassString, STRING_BITS, tables};
use fields::{STRING_1, STRING_2, STRING_3, STRING_4, STRING_5, SystemTime, date, midnight};
pub use reader::GnavReader;

/// Definition of the message GNAV.
pub static GNAV: Message = Message {
    name: "GNAV",
    symbol_s: 0.01,
    bit: |_| &[1],
    unit_s: STRING_S,
    decided_after: 0,
    set_s: STRING_S,
    first_s: 0,
    sender: |_| Ok(Box::new(Strings)),
    number: string_at,
    timed: &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
    dated: &[1, 4, 5],
    set: &[1, 2, 3, 4, 5],
    reduced: &[],
    // It says nothing of it.
    ionosphere: IonosphereForm { model: Model::Klobuchar, unit: |_| false, coefficients: |_| None },
    fields: &OF_SET,
    parameters: |symbols| {
        let string = decode_soft(&soft(symbols))?;
        let found = parameters(&string);
        (!found.is_empty()).then(|| (id(&string) <= 4, found))
    },
    reader: |sv| Box::new(GnavReader::new(sv)),
    form: Ephemeris::clone,
    sets: &GNAV_SETS,
    alert: None,
    rinex: Some(Records { set: |_| "FDMA", common: "FDMA", fields: Vec::new, lines: None }),
};

/// Meaning of clock and health in ephemerides of GNAV. The clock is that of G1, and G2 leaves the antenna
/// later by a parameter (4.4, Δτ). Health is the first bit of B and the flag l; users ignore the other bits
/// of B.
pub static GNAV_SETS: SetForm = SetForm {
    name: "GNAV",
    group_delay_s: |set, signal| {
        let later_s = planted!("gnss.glonass.delta_tau", set.tgd_s, -set.tgd_s);
        if signal.centre_hz() < BETWEEN_HZ { later_s } else { 0.0 }
    },
    serves: |_| true,
    given_delay_s: |_| 0.0,
    is_healthy,
    healthy: |set, _| Some(is_healthy(set)),
    rinex_sources: None,
};

/// A frequency between G1 and G2, in Hz.
const BETWEEN_HZ: f64 = 1.4e9;
/// Bits of [`Ephemeris::health`] that the user regards, and of them the flag l.
const UNHEALTHY: u16 = 0b1100;
const UNHEALTHY_OF_STRING_3: u16 = 3;
/// Seconds of a string and of a frame, and strings of it.
const STRING_S: i64 = 2;
const FRAME_S: i64 = 30;
const STRINGS: u64 = 15;
/// Frames of a superframe, which counts from midnight; all but the last have almanacs of five satellites
/// (4.3.1).
const FRAMES: i64 = 5;
/// Symbols of a string, of them those of the bits.
const STRING_SYMBOLS: usize = 200;
const DATA_SYMBOLS: usize = 2 * STRING_BITS;
/// The time mark (3.3.2.2): a shortened pseudorandom sequence.
const MARK: u32 = 0b11_1110_0011_0111_0101_0000_1001_0110;
const MARK_SYMBOLS: usize = 30;
/// Bits before the checks, and checks.
const DATA_BITS: usize = 77;
const CHECKS: usize = 8;
/// Positions of what is in no table: number of the string, interval between ephemerides, time of the frame's
/// beginning (hours, minutes, half minutes), whether the reference time is odd, satellites of an almanac's
/// frame, kind of satellite, day, slot.
const ID: (u16, u8) = (1, 4);
const INTERVAL: (u16, u8) = (7, 2);
const TIME: [(u16, u8); 3] = [(9, 5), (14, 6), (20, 1)];
const ODD: (u16, u8) = (8, 1);
const FIVE: (u16, u8) = (5, 1);
const KIND: (u16, u8) = (75, 2);
const DAY: (u16, u8) = (59, 11);
const SLOT: (u16, u8) = (70, 5);
/// The flag l of string 3 once more, in strings 5, 7, 9, 11, 13 and 15 (4.4, l_n).
const UNHEALTHY_AGAIN: (u16, u8) = (76, 1);
/// Thirty minutes between ephemerides, a GLONASS-M satellite.
const HALF_AN_HOUR: u32 = 1;
const MODERNISED: u32 = 1;

fn is_healthy(set: &Ephemeris) -> bool {
    set.health & UNHEALTHY == 0
}

/// Number of the string that begins at a time.
fn string_at(start: Epoch) -> u8 {
    (start.seconds().rem_euclid(FRAME_S) / STRING_S + 1) as u8
}

/// Number of a string, as it states it.
pub fn id(string: &GlonassString) -> u8 {
    string.piece(ID) as u8
}

/// Makes the strings of satellites.
struct Strings;

impl Sender for Strings {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        GNAV.check_start(start, "an even second of GLONASS time")?;
        let mut string = GlonassString::default();
        let number = string_at(start);
        let frame = Epoch::new(start.seconds() - i64::from(number - 1) * STRING_S, 0.0);
        match number {
            1 => {
                write_all(&STRING_1, ephemeris, &mut string)?;
                string.set_piece(INTERVAL, HALF_AN_HOUR);
                let half_minutes = frame.seconds().rem_euclid(86_400) / FRAME_S;
                let half_minutes = planted!("gnss.glonass.frame_sent", half_minutes, half_minutes + 1);
                let parts = [half_minutes / 120, half_minutes / 2 % 60, half_minutes % 2];
                TIME.into_iter().zip(parts).for_each(|(place, part)| string.set_piece(place, part as u32));
            }
            2 => {
                write_all(&STRING_2, ephemeris, &mut string)?;
                string.set_piece(ODD, u32::from(ephemeris.toe.seconds().rem_euclid(1800) >= 900));
            }
            3 => {
                write_all(&STRING_3, ephemeris, &mut string)?;
                let frame_of_five = frame.seconds().rem_euclid(FRAMES * FRAME_S) / FRAME_S;
                string.set_piece(FIVE, u32::from(frame_of_five < FRAMES - 1));
            }
            4 => {
                ephemeris.with_one_reference()?;
                write_all(&STRING_4, ephemeris, &mut string)?;
                string.set_piece(DAY, date(frame).1 as u32);
                string.set_piece(KIND, MODERNISED);
            }
            5 => {
                let system = SystemTime { four_years: date(frame).0 as f64, ..SystemTime::default() };
                write_all(&STRING_5, &system, &mut string)?;
            }
            _ => {}
        }
        if number % 2 == 1 && number >= 5 {
            let unhealthy = ephemeris.health >> UNHEALTHY_OF_STRING_3 & 1;
            string.set_piece(UNHEALTHY_AGAIN, u32::from(unhealthy));
        }
        string.set_piece(ID, u32::from(number));
        Ok(encode(&string))
    }
}

/// Position of a bit of the data, counted from the first sent, in the Hamming code (4.7): those of the
/// document's bits 9 to 85 are the numbers from 3 on that are no powers of two.
fn positions() -> impl Iterator<Item = u32> {
    let mut all: Vec<u32> = (3_u32..).filter(|place| !place.is_power_of_two()).take(DATA_BITS).collect();
    all.reverse();
    all.into_iter()
}

/// The eight checks of a string's data, the document's bit 8 first.
fn checks(string: &GlonassString) -> [bool; CHECKS] {
    let (mut sums, mut all) = (0_u32, false);
    for (bit, position) in string.0.iter().zip(positions()) {
        if *bit {
            sums ^= planted!("gnss.glonass.hamming", position, position & 0b11_1111);
            all = !all;
        }
    }
    let whole = all ^ (sums.count_ones() % 2 == 1);
    let mut checks = [whole; CHECKS];
    let own = checks.iter_mut().skip(1).zip((0..7).rev());
    own.for_each(|(check, bit)| *check = sums >> bit & 1 == 1);
    checks
}

/// The symbols of a string, with its checks and the time mark.
pub fn encode(string: &GlonassString) -> Vec<bool> {
    let data = string.0.iter().take(DATA_BITS).copied();
    let mut coded = false;
    let mut symbols = Vec::with_capacity(STRING_SYMBOLS);
    for bit in data.chain(checks(string)) {
        coded ^= bit;
        symbols.extend([coded, !coded]);
    }
    symbols.extend(bits_of(u128::from(MARK), MARK_SYMBOLS));
    symbols
}

/// The string in soft symbols, normal or inverted, its mark among them; `None` where its checks fail.
pub fn decode_soft(symbols: &[f32]) -> Option<GlonassString> {
    let mut string = GlonassString::default();
    let mut before = None;
    for (place, pair) in string.0.iter_mut().zip(symbols.get(..DATA_SYMBOLS)?.chunks_exact(2)) {
        let [one, opposite] = pair else { return None };
        let coded = one - opposite < 0.0;
        // The first bit is an idle one, zero.
        *place = before.is_some_and(|before| before != coded);
        before = Some(coded);
    }
    let sent = string.0.get(DATA_BITS..)?;
    (checks(&string) == sent && (1..=STRINGS as u8).contains(&id(&string))).then_some(string)
}

/// The raw integers of all parameters of a string; none for those that are not read.
pub fn parameters(string: &GlonassString) -> Vec<(&'static str, i64)> {
    match id(string) {
        1 => integers(&STRING_1, string),
        2 => integers(&STRING_2, string),
        3 => integers(&STRING_3, string),
        4 => integers(&STRING_4, string),
        5 => integers(&STRING_5, string),
        _ => Vec::new(),
    }
}

/// Parameters by which ephemerides and senders are distinguished, and the health, which has a fault of its
/// own, are fixed.
static OF_SET: SetTables<Ephemeris, GlonassString> = SetTables {
    fixed: &[&["health", "tb_quarters", "unhealthy", "day", "slot"]],
    elements: of_integers,
    quantised: |own, set| own.rounded(set.with_one_reference()?.clone()),
    ..SetTables::of(
        &GNAV_SETS,
        &[&STRING_1, &STRING_2, &STRING_3, &STRING_4],
        GlonassString::default,
        (|set| set, |set| set),
    )
};

/// The elements that raw integers give, as if they had been sent in the frame nearest to `near`.
fn of_integers(tables: &SetTables<Ephemeris, GlonassString>, sv: Sv, raw: Raw<'_>, near: Epoch) -> Option<Ephemeris> {
    let found = tables.of_integers(sv, raw, near)?;
    // Sent in a frame of the ephemeris's own half hour.
    let half_s = 0.5 * found.fit_interval_s();
    let late_s = near.since(found.toe).clamp(-half_s, half_s - FRAME_S as f64);
    let sent = found.toe.plus_s(late_s).seconds().div_euclid(FRAME_S) * FRAME_S;
    Some(Ephemeris { transmitted: Epoch::new(sent, 0.0), ..found })
}

/// The elements in strings 1 to 4, of which the first was sent at `sent`.
pub fn elements(sv: Sv, strings: [&GlonassString; 4], sent: Epoch) -> Ephemeris {
    let found = OF_SET.decoded(sv, strings, sent);
    // The day is that of sending, and midnight may be between.
    let days = (sent.since(found.toe) / 86_400.0).round();
    let toe = found.toe.plus_s(days * 86_400.0);
    Ephemeris { toe, toc: toe, ..found }
}

/// Start time of the frame with these strings 1, 4 and 5. If string 5 lacks the four-year interval, a time
/// that is known to within a year supplies it.
///
/// # Errors
/// Values that are no time or date.
pub fn frame_began(
    one: &GlonassString,
    four: &GlonassString,
    five: &GlonassString,
    known: Option<Epoch>,
) -> Result<Epoch, String> {
    let [hours, minutes, halves] = TIME.map(|place| i64::from(one.piece(place)));
    let sent = integers(&STRING_5, five).into_iter().find(|(name, _)| *name == "four_years").map(|(_, raw)| raw);
    let day = i64::from(four.piece(DAY));
    let away_s = |four_years: i64, near: Epoch| midnight((four_years, day)).since(near).abs();
    let nearest = |near: Epoch| INTERVALS.min_by(|a, b| away_s(*a, near).total_cmp(&away_s(*b, near)));
    let four_years = sent.filter(|sent| *sent > 0).or_else(|| known.and_then(nearest)).unwrap_or_default();
    for (string, name, value, possible) in [
        (1, "the hour of t_k", hours, 0..=23),
        (1, "the minute of t_k", minutes, 0..=59),
        (4, "N_T", day, 1..=1461),
        (5, "N_4", four_years, INTERVALS),
    ] {
        if !possible.contains(&value) {
            let (first, last) = (possible.start(), possible.end());
            return Err(format!("{name} in string {string} is {value}, where {first} to {last} makes a date"));
        }
    }
    let half_minutes = planted!("gnss.glonass.frame_read", halves, halves + 1);
    let of_day_s = hours * 3600 + minutes * 60 + half_minutes * FRAME_S;
    Ok(Epoch::new(midnight((four_years, day)).seconds() + of_day_s, 0.0))
}

/// Numbers of the intervals of four years from 1996 on, of five bits (ICD L1, L2 5.1, table 4.9).
const INTERVALS: RangeInclusive<i64> = 1..=31;

/// Slot by string 4.
pub fn slot(four: &GlonassString) -> u8 {
    four.piece(SLOT) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Common, Read};
    use crate::satellite::System;

    /// Results of a reader for two frames from `start` on whose strings 5 state the four-year interval
    /// `sent`.
    fn read_with(sent: i64, start: Epoch, known: Option<Epoch>) -> Vec<Read> {
        let sender = (GNAV.sender)(&Common::default()).unwrap();
        let sv = Sv { system: System::Glonass, number: 5 };
        let set = Ephemeris { form: &GNAV_SETS, ..Ephemeris::blank(sv, start) };
        let mut reader = (GNAV.reader)(sv);
        known.into_iter().for_each(|known| reader.know(known));
        let far = Epoch::parse("2011-01-01T00:00:00").unwrap();
        let mut news = Vec::new();
        for second in (0..60).step_by(2) {
            let mut symbols = sender.unit(&set, start.plus_s(f64::from(second))).unwrap();
            if second % 30 == 8 {
                let mut string = decode_soft(&soft(&symbols)).unwrap();
                write_all(&STRING_5, &SystemTime { four_years: sent as f64, ..SystemTime::default() }, &mut string)
                    .unwrap();
                symbols = encode(&string);
            }
            news.extend(symbols.into_iter().flat_map(|one| reader.take(if one { -1.0 } else { 1.0 }, far)));
        }
        news
    }

    #[test]
    fn a_frame_without_its_four_years_is_refused_by_name_or_dated_by_a_known_time() {
        let start = Epoch::parse("2023-09-19T11:45:00").unwrap();
        let times = |news: &[Read]| -> Vec<Epoch> {
            news.iter().filter_map(|read| if let Read::Time(at) = read { Some(*at) } else { None }).collect()
        };
        let refused = read_with(0, start, None);
        assert!(times(&refused).is_empty());
        assert!(refused.contains(&Read::Refused("N_4 in string 5 is 0, where 1 to 31 makes a date".to_owned())));
        let whole = read_with(7, start, None);
        assert_eq!(times(&whole), [start.plus_s(8.0), start.plus_s(38.0)]);
        assert!(!whole.iter().any(|read| matches!(read, Read::Refused(_))));
        // A year off is as good as exact: the nearest day of that number is within two years of it.
        for known in ["2022-10-01T00:00:00", "2023-09-19T11:45:07", "2024-09-01T00:00:00"] {
            let dated = read_with(0, start, Some(Epoch::parse(known).unwrap()));
            assert_eq!(times(&dated), times(&whole), "{known}");
        }
        // What is said is believed rather than what was known.
        let other = read_with(6, start, Some(start));
        assert_eq!(times(&other).first(), Some(&start.plus_s(8.0 - 1461.0 * 86_400.0)));
    }

    #[test]
    fn strings_of_two_sets_make_none_where_one_follows_the_other() {
        let sender = (GNAV.sender)(&Common::default()).unwrap();
        let sv = Sv { system: System::Glonass, number: 5 };
        // By the time of GLONASS less three hours: from 12:30 on the ephemeris of 12:45 is sent.
        let change = Epoch::parse("2020-11-29T12:30:00").unwrap();
        let sets = [-900.0, 900.0].map(|from_s| {
            let toe = change.plus_s(from_s);
            let mut set = Ephemeris { form: &GNAV_SETS, toe, toc: toe, ..Ephemeris::blank(sv, toe) };
            assert!(["x_km", "y_km", "z_km"].into_iter().all(|name| GNAV.fields.adjust(&mut set, name, from_s)));
            set
        });
        let mut reader = (GNAV.reader)(sv);
        let mut read = Vec::new();
        for second in (-60..60).step_by(2) {
            let set = &sets[usize::from(second >= 0)];
            let symbols = sender.unit(set, change.plus_s(f64::from(second))).unwrap();
            let news = symbols.into_iter().flat_map(|one| reader.take(if one { -1.0 } else { 1.0 }, change));
            read.extend(news.filter_map(|read| if let Read::Ephemeris(set) = read { Some(*set) } else { None }));
        }
        assert_eq!(read.iter().map(|set| set.toe).collect::<Vec<_>>(), sets.each_ref().map(|set| set.toe));
        for (read, set) in read.iter().zip(&sets) {
            let raw = |of: &Ephemeris| {
                let string = |table: &&'static [_]| {
                    let mut string = GlonassString::default();
                    write_all(table, of, &mut string).unwrap();
                    string
                };
                OF_SET.parts.iter().map(string).collect::<Vec<_>>()
            };
            assert_eq!(raw(read), raw(set));
        }
    }

    #[test]
    fn all_odd_strings_from_the_fifth_on_repeat_the_flag_of_the_third() {
        let near = Epoch::parse("2023-09-19T11:45:00").unwrap();
        let sender = (GNAV.sender)(&Common::default()).unwrap();
        for health in [0, 0b1000] {
            let set = Ephemeris {
                form: &GNAV_SETS,
                health,
                ..Ephemeris::blank(Sv { system: System::Glonass, number: 5 }, near)
            };
            for number in 1..=15 {
                let symbols = sender.unit(&set, near.plus_s(f64::from(2 * (number - 1)))).unwrap();
                let string = decode_soft(&soft(&symbols)).unwrap();
                // Numbered from the last bit on, bit 65 of string 3 and bit 9 of the others (ICD 5.1, table
                // 4.6).
                let bit = |number: usize| string.0[STRING_BITS - number];
                let said = match number {
                    3 => Some(bit(65)),
                    5 | 7 | 9 | 11 | 13 | 15 => Some(bit(9)),
                    _ => None,
                };
                assert!(said.is_none_or(|ill| ill == (health != 0)), "string {number}");
            }
        }
    }
}
