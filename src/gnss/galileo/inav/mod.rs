//! The Galileo integrity navigation message (I/NAV) as E1-B and E5b-I send it: pages of two seconds, encoded
//! and decoded.
//!
//! Source: Galileo OS SIS ICD 2.1, 4.3 and 5.1. A page is an even and an odd part of a second each; a part is
//! a pattern of ten symbols and 120 bits, coded ([`Convolutional`]) and interleaved ([`Interleaver`]). Both
//! parts carry one word of 128 bits and a check. Limits: Of almanacs (words 7 to 10) only the offset of GPS
//! time is read. Alert pages keep their position and state nothing. The bits reserved for authentication on
//! E1-B are those of the scene's provider, or zero; those of the return link are zero.

pub(super) mod almanac;
mod e5b;
pub(super) mod fields;
mod reader;
mod reduced;
mod redundancy;

use crate::bits::{Element, FieldError, Store, bits_of, integers, number, read_all, soft, write_all};
use crate::broadcast::{Ephemeris, SetForm};
use crate::crc::{CHECK_BITS, crc24q};
use crate::fec::convolutional::Convolutional;
use crate::fec::interleaver::Interleaver;
use crate::galileo::cnav::CNAV;
use crate::galileo::fnav::FNAV_SETS;
use crate::galileo::status::{self, Band};
use crate::ionosphere::{Coefficients, Model};
use crate::message::{Common, IonosphereForm, Message, Records, Sender, raw_of};
use crate::satellite::Sv;
use crate::set_tables::SetTables;
use crate::time::{Epoch, WEEK_S};
pub use almanac::gps_offset;
use almanac::{GPS_OFFSET, Triple, WORD_7, WORD_8, WORD_9, WORD_10};
pub use e5b::INAV_E5B;
use fields::{FIXED, Orbit, Utc, WORD_1, WORD_2, WORD_3, WORD_4, WORD_5, WORD_6, coefficients};
pub use fields::{GST_WEEK, sisa_index, tables};
pub use reader::InavReader;
pub use reduced::VALID_S as REDUCED_VALID_S;
use reduced::{Reduced, WORD_16};
use redundancy::REDUNDANT;
pub use redundancy::redundancy;

/// Definition of I/NAV.
pub static INAV: Message = Message {
    name: "I/NAV",
    symbol_s: 0.004,
    bit: |_| &[1],
    unit_s: PAGE_S,
    decided_after: 0,
    set_s: PAGE_S,
    // The even part begins at an odd second on E1-B (4.3.2.2).
    first_s: 1,
    sender: |common| Ok(Box::new(Pages { common: common.clone(), carrier: &ON_E1B })),
    number: word_at,
    timed: &[SPARE, 5, 6],
    dated: &[],
    set: &[1, 2, 3, 4, 5],
    reduced: &[REDUCED],
    ionosphere: IonosphereForm { model: Model::NequickG, unit: |start| word_at(start) == 5, coefficients: ionosphere },
    fields: &OF_SET,
    parameters: opened,
    reader: |sv| Box::new(InavReader::new(sv)),
    form,
    sets: &INAV_SETS,
    alert: Some(alerted),
    rinex: Some(Records { set: |_| "INAV", common: "IFNV", fields: tables, lines: None }),
};

/// The ephemeris as I/NAV has it, of either message.
fn form(set: &Ephemeris) -> Ephemeris {
    let ahead_s = if *set.form == FNAV_SETS { status::fnav_ahead_s(set) } else { 0.0 };
    Ephemeris { form: &INAV_SETS, af0_s: set.af0_s - ahead_s, ..set.clone() }
}

/// Ephemerides of I/NAV, on either carrier: the clock of E1 and E5b.
pub static INAV_SETS: SetForm = SetForm {
    name: "I/NAV",
    group_delay_s: status::against_inav_s,
    serves: |signal| [&INAV, &INAV_E5B, &CNAV].into_iter().any(|message| signal.carries(message)),
    given_delay_s: |set| set.tgd_s,
    is_healthy: |set| status::E1B.is_good(set),
    healthy: |set, signal| status::healthy(set, signal, &[Band::E1, Band::E5b]),
    // Of E1-B, the clock that of E5b and E1 (RINEX 3.05, table A8).
    rinex_sources: Some(513.0),
};

/// Differences between the two carriers of I/NAV.
struct On {
    message: &'static Message,
    /// Type of the word that begins at a time.
    word_at: fn(Epoch) -> u8,
    /// The bits of the odd part before the check and after it, by the time of the page.
    rest: fn(Epoch) -> (u64, u8),
}

static ON_E1B: On = On { message: &INAV, word_at, rest: |start| (0, pattern(start)) };

/// The secondary synchronisation pattern, by the time within six seconds (4.3.2.3, table 41).
fn pattern(start: Epoch) -> u8 {
    match start.tow_whole_s().rem_euclid(6) {
        1 => 0x04,
        3 => 0x2B,
        _ => 0x2F,
    }
}

/// Seconds of a page.
const PAGE_S: i64 = 2;
/// Seconds of a sub-frame, in which the words have their positions.
const SUBFRAME_S: i64 = 30;
/// Symbols of the pattern with which a page part begins (4.3.2.1), of a part, and of a page.
const PATTERN: [bool; 10] = [false, true, false, true, true, false, false, false, false, false];
const PART_SYMBOLS: usize = 250;
const PAGE_SYMBOLS: usize = 2 * PART_SYMBOLS;
/// Bits of a part before coding, and of them the tail of zeros.
const PART_BITS: usize = 120;
const TAIL_BITS: usize = 6;
/// Bits of the word in the even part, and the first of them; the odd part has the rest.
const WORD_BITS: usize = 128;
const EVEN_WORD_BITS: usize = 112;
const WORD_BEGIN: usize = 2;
/// First bit of the check in the odd part (5.1.9.4). The check covers everything before it.
const CHECK_BEGIN: usize = 82;
/// First bit in the odd part of the bits before the check, and of those after it (4.3.2.3).
const RESERVED_BEGIN: usize = 18;
const RESERVED_BITS: usize = 64;
/// Reserved bits after the 40 of authentication: return link and spare (4.3.2.3).
const AFTER_AUTHENTICATION_BITS: u32 = 24;
const LAST_BEGIN: usize = 106;
const LAST_BITS: usize = 8;
/// Types of the spare word (5.1.9.11), the word with reduced elements, and the words of an ephemeris.
const SPARE: u8 = 0;
const REDUCED: u8 = 16;
const WORDS_OF_SET: [u8; 4] = [1, 2, 3, 4];

/// The code of a part (4.1.4).
pub(super) fn code() -> Convolutional {
    Convolutional { second_inverted: planted!("gnss.inav.second_symbol", true, false) }
}

const INTERLEAVER: Interleaver = Interleaver { columns: 30, rows: 8 };

/// First week in which satellites send redundancy. The document has it since January 2021, and satellites
/// sent it later. The real words that it was compared with are of 2025.
const REDUNDANT_SINCE_WEEK: i64 = 2243;

/// The parameters in the symbols of a page, and whether they are an ephemeris's.
fn opened(symbols: &[bool]) -> Option<(bool, Vec<(&'static str, i64)>)> {
    let (bits, _) = decode_page(symbols)?;
    let word = word_of(&bits);
    parameters(&word).map(|found| (WORDS_OF_SET.contains(&word_type(&word)), found))
}

/// Type of the word that begins at a time, by the nominal sequence of E1-B (4.3.5, table 38). Before 2023,
/// spare words replace the redundancy words.
pub fn word_at(start: Epoch) -> u8 {
    let redundant = start.week() >= REDUNDANT_SINCE_WEEK;
    // Almanac words 7 and 8 alternate with 9 and 10 from sub-frame to sub-frame.
    let second_half = 2 * (start.tow_whole_s().div_euclid(SUBFRAME_S).rem_euclid(2)) as u8;
    match start.tow_whole_s().rem_euclid(SUBFRAME_S) + planted!("gnss.inav.word_order", 0, 2) {
        1 => 2,
        3 => 4,
        5 => 6,
        7 => 7 + second_half,
        9 => 8 + second_half,
        11 if redundant => 17 + u8::from(second_half > 0),
        13 if redundant => 19 + u8::from(second_half > 0),
        15 | 29 => REDUCED,
        21 => 1,
        23 => 3,
        25 => 5,
        _ => SPARE,
    }
}

/// Type of a word, as it states it.
pub fn word_type(word: &u128) -> u8 {
    word.piece((0, 6)) as u8
}

/// Makes the pages of satellites.
struct Pages {
    common: Common,
    carrier: &'static On,
}

impl Sender for Pages {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        let On { message, word_at, rest } = self.carrier;
        message
            .check_start(start, if message.first_s == 1 { "an odd whole second" } else { "an even whole second" })?;
        let word = self.word(word_at(start), ephemeris, start)?;
        Ok(encode_page(&page_with(&word, self.signed(ephemeris.sv, start, rest(start)))))
    }

    fn restored(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<Vec<bool>>, FieldError> {
        let On { word_at, rest, .. } = self.carrier;
        if !REDUNDANT.contains(&word_at(start)) {
            return Ok(Vec::new());
        }
        let words = self.words_of_set(ephemeris, start)?;
        let rest = self.signed(ephemeris.sv, start, rest(start));
        Ok(words.iter().map(|word| encode_page(&page_with(word, rest))).collect())
    }
}

/// Words that satellites send on E1-B, without the pages around them.
pub struct Words(Pages);

impl Words {
    /// Creates the words of satellites that send `common` besides their own elements.
    pub fn new(common: &Common) -> Self {
        Self(Pages { common: common.clone(), carrier: &ON_E1B })
    }

    /// Word of the page that begins at `start`, of 128 bits.
    ///
    /// # Errors
    /// A value that the message cannot carry.
    pub fn at(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<u128, FieldError> {
        self.0.word(word_at(start), ephemeris, start)
    }
}

impl Pages {
    /// The remaining bits of the odd part with the satellite's authentication, which E1-B alone carries.
    fn signed(&self, sv: Sv, start: Epoch, (reserved, last): (u64, u8)) -> (u64, u8) {
        let own = self.common.authentication.as_ref().filter(|_| self.carrier.message == &INAV);
        (own.map_or(reserved, |own| reserved | own.bits(sv, start) << AFTER_AUTHENTICATION_BITS), last)
    }

    /// The part of the almanac that is sent in the minute of `start`.
    fn triple(&self, start: Epoch) -> Triple {
        Triple::at(start, &self.common.almanac, self.common.reference.unwrap_or(start), self.common.galileo)
    }

    /// Words 1 to 4 as they would leave at `start`.
    fn words_of_set(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<[u128; 4], FieldError> {
        let mut four = [0; 4];
        for (word, number) in four.iter_mut().zip(WORDS_OF_SET) {
            *word = self.word(number, ephemeris, start)?;
        }
        Ok(four)
    }

    /// A word as it leaves at `start`.
    fn word(&self, number: u8, ephemeris: &Ephemeris, start: Epoch) -> Result<u128, FieldError> {
        let mut word = 0;
        word.set_piece((0, 6), u32::from(number));
        let on_air = Ephemeris { transmitted: start, ..ephemeris.clone() };
        let orbit = Orbit { ephemeris: on_air, nequick: self.common.nequick.unwrap_or_default() };
        match number {
            1 => write_all(&WORD_1, &orbit, &mut word)?,
            2 => write_all(&WORD_2, &orbit, &mut word)?,
            3 => write_all(&WORD_3, &orbit, &mut word)?,
            4 => write_all(&WORD_4, &orbit, &mut word)?,
            5 => {
                write_all(&WORD_5, &orbit, &mut word)?;
                alternate(&mut word, 105, WORD_BITS);
            }
            6 => write_all(&WORD_6, &Utc::of(&self.common, start), &mut word)?,
            7..=10 => {
                let triple = self.triple(start);
                let table: &[Element<Triple>] = match number {
                    7 => &WORD_7,
                    8 => &WORD_8,
                    9 => &WORD_9,
                    _ => &WORD_10,
                };
                write_all(table, &triple, &mut word)?;
                if number == 10 {
                    write_all(&GPS_OFFSET, &triple, &mut word)?;
                }
            }
            17..=20 => {
                word = redundancy(self.words_of_set(ephemeris, start)?.each_ref())[usize::from(number - 17)];
            }
            REDUCED => match Reduced::of(ephemeris, start) {
                Some(reduced) => write_all(&WORD_16, &reduced, &mut word)?,
                // Two satellites were left on orbits that are no reduced elements, and send the spare word.
                None => return self.word(SPARE, ephemeris, start),
            },
            _ => {
                // "10": week and time of week are valid (5.1.9.11).
                word.set_piece((6, 2), 2);
                alternate(&mut word, 8, 96);
                write_all(&fields::WORD_0, &orbit, &mut word)?;
            }
        }
        Ok(word)
    }
}

/// Fills spare bits with ones and zeros in turn.
fn alternate(word: &mut u128, from: usize, to: usize) {
    for place in from..to {
        word.set_piece((place as u16, 1), u32::from((place - from).is_multiple_of(2)));
    }
}

/// The two parts of a nominal page of E1-B around a word, checked and with their tails.
pub fn page(word: &u128, start: Epoch) -> [Vec<bool>; 2] {
    page_with(word, (ON_E1B.rest)(start))
}

/// The two parts of a page around a word, with the given remaining bits of the odd part.
fn page_with(word: &u128, (reserved, last): (u64, u8)) -> [Vec<bool>; 2] {
    let mut even = vec![false; PART_BITS];
    let mut odd = vec![false; PART_BITS];
    odd[0] = true;
    let put = |part: &mut [bool], from: usize, bits: &mut dyn Iterator<Item = bool>| {
        part.iter_mut().skip(from).zip(bits).for_each(|(slot, bit)| *slot = bit);
    };
    let mut bits = bits_of(*word, WORD_BITS);
    put(&mut even, WORD_BEGIN, &mut bits.by_ref().take(EVEN_WORD_BITS));
    put(&mut odd, WORD_BEGIN, &mut bits);
    put(&mut odd, RESERVED_BEGIN, &mut bits_of(u128::from(reserved), RESERVED_BITS));
    let check = crc24q(covered(&even, &odd));
    put(&mut odd, CHECK_BEGIN, &mut bits_of(u128::from(check), CHECK_BITS));
    put(&mut odd, LAST_BEGIN, &mut bits_of(u128::from(last), LAST_BITS));
    [even, odd]
}

/// Bits that the check covers.
fn covered<'a>(even: &'a [bool], odd: &'a [bool]) -> impl Iterator<Item = bool> + 'a {
    even.iter().take(PART_BITS - TAIL_BITS).chain(odd.iter().take(CHECK_BEGIN)).copied()
}

/// The symbols of a page's two parts of 120 bits.
pub fn encode_page(parts: &[Vec<bool>; 2]) -> Vec<bool> {
    let part = |bits: &Vec<bool>| {
        PATTERN.into_iter().chain(INTERLEAVER.interleave(&code().encode(bits))).collect::<Vec<bool>>()
    };
    parts.iter().flat_map(part).collect()
}

/// The parts of 120 bits in the 500 symbols of a page without errors.
fn decode_page(symbols: &[bool]) -> Option<([Vec<bool>; 2], bool)> {
    decode_soft(&soft(symbols))
}

/// The parts of 120 bits in the 500 soft symbols of a page, and whether they are inverted; `None` where
/// they are no nominal page of a right check.
pub fn decode_soft(symbols: &[f32]) -> Option<([Vec<bool>; 2], bool)> {
    decode_any(symbols).filter(|(parts, _)| !is_alert(parts))
}

/// True if the page type is that of an alert, whose content is reserved (4.3.2.3).
fn is_alert(parts: &[Vec<bool>; 2]) -> bool {
    parts.iter().any(|part| part[1])
}

/// An alert page instead of a nominal one, its data ones and zeros in turn.
fn alerted(symbols: &[bool]) -> Option<Vec<bool>> {
    let ([mut even, mut odd], _) = decode_page(symbols)?;
    (even[1], odd[1]) = (true, true);
    let data = even[WORD_BEGIN..WORD_BEGIN + EVEN_WORD_BITS].iter_mut();
    let data = data.chain(odd[WORD_BEGIN..WORD_BEGIN + WORD_BITS - EVEN_WORD_BITS].iter_mut());
    data.enumerate().for_each(|(place, bit)| *bit = place.is_multiple_of(2));
    let check = crc24q(covered(&even, &odd));
    let bits = bits_of(u128::from(check), CHECK_BITS);
    odd[CHECK_BEGIN..].iter_mut().zip(bits).for_each(|(slot, bit)| *slot = bit);
    Some(encode_page(&[even, odd]))
}

/// The parts of any page of a right check, nominal or alert.
fn decode_any(symbols: &[f32]) -> Option<([Vec<bool>; 2], bool)> {
    if symbols.len() != PAGE_SYMBOLS {
        return None;
    }
    // The sum over both patterns: its sign is the polarity.
    let sum = |part: &[f32]| part.iter().zip(PATTERN).map(|(soft, bit)| if bit { -soft } else { *soft }).sum::<f32>();
    let inverted = symbols.chunks(PART_SYMBOLS).map(sum).sum::<f32>() < 0.0;
    let sense = if inverted { -1.0 } else { 1.0 };
    let part = |from: usize| {
        let coded: Vec<f32> = symbols[from + PATTERN.len()..from + PART_SYMBOLS].iter().map(|s| s * sense).collect();
        code().decode(&INTERLEAVER.deinterleave(&coded))
    };
    let [even, odd] = [part(0), part(PART_SYMBOLS)];
    let check = number(&odd[CHECK_BEGIN..CHECK_BEGIN + CHECK_BITS]) as u32;
    let in_order = !even[0] && odd[0] && even[1] == odd[1];
    (in_order && crc24q(covered(&even, &odd)) == check).then_some(([even, odd], inverted))
}

/// The word of 128 bits in a page's parts.
pub fn word_of(parts: &[Vec<bool>; 2]) -> u128 {
    let [even, odd] = parts;
    let rest = WORD_BITS - EVEN_WORD_BITS;
    number(&even[WORD_BEGIN..WORD_BEGIN + EVEN_WORD_BITS]) << rest | number(&odd[WORD_BEGIN..WORD_BEGIN + rest])
}

/// The raw integers of all parameters of a word but its time; `None` for words without any that are read.
pub fn parameters(word: &u128) -> Option<Vec<(&'static str, i64)>> {
    let found = match word_type(word) {
        1 => Some(integers(&WORD_1, word)),
        2 => Some(integers(&WORD_2, word)),
        3 => Some(integers(&WORD_3, word)),
        4 => Some(integers(&WORD_4, word)),
        5 => Some(integers(&WORD_5, word)),
        6 => Some(integers(&WORD_6, word)),
        10 => Some(integers(&GPS_OFFSET, word)),
        _ => None,
    };
    found.map(|all| all.into_iter().filter(|(name, _)| *name != "tow_s").collect())
}

/// The coefficients of the ionosphere that raw integers of word 5 give.
fn ionosphere(raw: &dyn Fn(&str) -> Option<i64>) -> Option<Coefficients> {
    coefficients(|name| OF_SET.value(name, raw))
}

/// Tables of the ephemeris.
static OF_SET: SetTables<Orbit, u128> = SetTables {
    // Word 5 has no issue.
    issued: 4,
    // The week and time of word 5 are those of its sending, which the ephemeris has already.
    passing: &["tow_s"],
    fixed: &[&FIXED],
    ..SetTables::of(
        &INAV_SETS,
        &[&WORD_1, &WORD_2, &WORD_3, &WORD_4, &WORD_5],
        || 0,
        (Orbit::of, |orbit| orbit.ephemeris),
    )
};

/// The elements in short in word 16, sent at `start`, with the group delays and the health of word 5 where it
/// was read.
fn elements_in_short(sv: Sv, (word, start): (&u128, Epoch), five: Option<&u128>) -> Ephemeris {
    let mut reduced = Reduced::default();
    read_all(&WORD_16, word, &mut reduced);
    let mut orbit = Orbit::of(reduced.ephemeris(sv, start));
    if let Some(five) = five {
        read_all(&WORD_5, five, &mut orbit);
    }
    orbit.ephemeris
}

/// The elements in words 1 to 5 with the time at which word 5 was sent; `None` where the issues differ or
/// word 4 is another satellite's.
fn elements(sv: Sv, words: [&u128; 5], near: Epoch) -> Option<Ephemeris> {
    let [one, two, three, four, five] = words;
    let issue = |word: &u128| word.piece((6, 10));
    let same = [two, three, four].iter().all(|word| issue(word) == issue(one));
    if !same || four.piece((16, 6)) != u32::from(sv.number) {
        return None;
    }
    Some(OF_SET.decoded(sv, words, sent_at(five, near)?))
}

/// Ephemeris of words 1 to 5, as their bits state it; `None` if they are not of one issue and of this
/// satellite. `near` resolves the week of word 5.
pub fn ephemeris_of(sv: Sv, words: &[u128; 5], near: Epoch) -> Option<Ephemeris> {
    elements(sv, words.each_ref(), near)
}

/// Coefficients of the ionosphere in a word 5.
pub fn ionosphere_of(word: &u128) -> Option<Coefficients> {
    let all = parameters(word)?;
    ionosphere(&|name: &str| raw_of(&all, name))
}

/// The start of the page by its own week and time of week, the week near `near`; `None` for words without
/// them.
fn sent_at(word: &u128, near: Epoch) -> Option<Epoch> {
    let week = match word_type(word) {
        0 if word.piece((6, 2)) == 2 => word.piece((96, 12)),
        5 => word.piece((73, 12)),
        _ => return None,
    };
    let tow_s = i64::from(time_of_week(word)?);
    let week = near.nearest_week(i64::from(week) + GST_WEEK, 4096);
    Some(Epoch::new(week * WEEK_S + tow_s, 0.0))
}

/// Seconds of the week at which the page began, of words that state them.
fn time_of_week(word: &u128) -> Option<u32> {
    let tow_s = match word_type(word) {
        0 if word.piece((6, 2)) == 2 => word.piece((108, 20)),
        5 => word.piece((85, 20)),
        6 => word.piece((105, 20)),
        _ => return None,
    };
    (i64::from(tow_s) < WEEK_S).then_some(tow_s)
}
