//! D1 and D2, the messages of B1I, B2I and B3I: frames encoded and decoded.
//!
//! Source: BDS-SIS-ICD-B1I 3.0, section 5. A subframe is ten words of thirty bits: code words of
//! BCH(15,11,1), two of them interleaved bit by bit, but for the first fifteen bits. In D1 (satellites in
//! medium and inclined orbits) five subframes of 6 s are a frame; subframes 1 to 3 carry an ephemeris.
//! In D2 (geostationary ones) subframes last 0.6 s, and pages 1 to 10 of subframe 1 carry the ephemeris, one
//! a frame of 3 s.
//!
//! A unit here is what repeats the ephemeris: 30 s of either, one frame of D1 or ten of D2. A symbol is what
//! a code period of a millisecond carries: in D1 a bit times a chip of the Neuman-Hofman code, in D2 half a
//! bit. A ephemeris is numbered by its reference time, as its ages of data repeat ([`issue`]).
//!
//! Limits: subframes 4 and 5 of D1 and 2 to 5 of D2 have their headers and page numbers alone: no almanac, no
//! UTC, no integrity or grid. Parities detect errors and correct none. Coefficients of the ionosphere that
//! are all zero count as none.

mod fields;
mod reader;

use crate::bits::{Bits, FieldError, Store, integers, read_all, write_all};
use crate::broadcast::{Ephemeris, PLAIN, SetForm};
use crate::ionosphere::{Coefficients, Model};
use crate::klobuchar::Klobuchar;
use crate::message::{IonosphereForm, Message, Records, Sender};
use crate::satellite::Sv;
use crate::set_tables::SetTables;
use crate::time::{BDT_WEEK, Epoch, WEEK_S};
use fields::{D1_PARTS, D1_SET, D1Set, D2_PARTS, D2_SET, D2Set, Orbit};
pub use fields::{SUBFRAME_BITS, tables};
pub use reader::D1D2Reader;

/// D1 and D2 as signals name them.
pub static D1_D2: Message = Message {
    name: "D1/D2",
    symbol_s: 0.001,
    bit: |sv| if sv.is_geostationary() { &[1; D2_SYMBOLS] } else { &NEUMAN_HOFMAN_SIGNS },
    unit_s: UNIT_S,
    decided_after: 0,
    set_s: UNIT_S,
    first_s: 0,
    sender: |common| Ok(Box::new(Frames { klobuchar: common.klobuchar_beidou })),
    number: |_| 1,
    timed: &[1],
    dated: &[],
    set: &[1],
    reduced: &[],
    ionosphere: IonosphereForm {
        model: Model::KlobucharBeidou,
        unit: |_| true,
        coefficients: |raw| Klobuchar::named(|name| OF_SET.value(name, raw)).and_then(given),
    },
    fields: &OF_SET,
    parameters: |symbols| parameters(symbols).map(|found| (true, found)),
    reader: |sv| Box::new(D1D2Reader::new(sv)),
    form,
    sets: &D1_SETS,
    alert: None,
    rinex: Some(Records {
        set: |sv| if sv.is_geostationary() { "D2" } else { "D1" },
        common: "D1D2",
        fields: tables,
        lines: None,
    }),
};

/// Ephemerides of D1 and D2: two group delays against B3I, of B1I and B2I (BDS-SIS-ICD-B1I 3.0, 5.2.4.8).
pub static D1_SETS: SetForm = SetForm { name: "D1/D2", serves: |signal| signal.carries(&D1_D2), ..PLAIN };

/// An ephemeris as D1 and D2 have it.
fn form(set: &Ephemeris) -> Ephemeris {
    Ephemeris { form: &D1_SETS, signal_delays_s: Vec::new(), ..set.clone() }
}

/// Seconds of a unit, of a subframe of D1 and of a frame of D2.
const UNIT_S: i64 = 30;
const D1_SUBFRAME_S: i64 = 6;
const D2_FRAME_S: i64 = 3;
/// Symbols of a bit, and subframes of a unit.
const D1_SYMBOLS: usize = 20;
const D2_SYMBOLS: usize = 2;
const D1_SUBFRAMES: usize = 5;
const D2_SUBFRAMES: usize = 50;
/// First bits of every subframe, and bits of a word.
const PREAMBLE: u32 = 0b111_0001_0010;
const WORD_BITS: usize = 30;
/// Positions of the subframe's number, of the second of the week in two pieces, and of the page's number in
/// subframes of D1 and in D2's subframe 1.
const FRAME_ID: (u16, u8) = (15, 3);
const SECOND: [(u16, u8); 2] = [(18, 8), (30, 12)];
const D1_PAGE: (u16, u8) = (43, 7);
const D2_PAGE: (u16, u8) = (42, 4);

/// The Neuman-Hofman code (5.1.1): 0000 0100 1101 0100 1110, first chip in the highest of twenty bits.
const NEUMAN_HOFMAN: u32 = 0b0000_0100_1101_0100_1110;

/// Neuman-Hofman code as signs, +1 for a logical 0.
const NEUMAN_HOFMAN_SIGNS: [i8; D1_SYMBOLS] = {
    let (mut signs, mut place) = ([1; D1_SYMBOLS], 0);
    while place < D1_SYMBOLS {
        if NEUMAN_HOFMAN >> (D1_SYMBOLS - 1 - place) & 1 == 1 {
            signs[place] = -1;
        }
        place += 1;
    }
    signs
};

/// A subframe without its interleaving.
pub type Subframe = Bits<SUBFRAME_BITS>;

/// Chip of the Neuman-Hofman code.
fn chip(index: usize) -> bool {
    planted!("gnss.beidou.neuman_hofman", NEUMAN_HOFMAN, NEUMAN_HOFMAN ^ 1) >> (19 - index) & 1 == 1
}

/// Number of an ephemeris by its reference time, in 12 min (RTKLIB's, for the message has none that differs
/// from ephemeris to ephemeris).
pub fn issue(toe_of_week_s: f64) -> u16 {
    ((toe_of_week_s / 720.0) as u16) % 240
}

impl Orbit {
    fn blank(sv: Sv, near: Epoch) -> Self {
        Self { ephemeris: form(&Ephemeris::blank(sv, near)), klobuchar: Klobuchar::ZERO }
    }
}

/// An ephemeris with the number that its reference time gives it.
fn numbered(set: Ephemeris) -> Ephemeris {
    Ephemeris { iode: issue(set.toe.tow_s()), ..set }
}

/// Coefficients that are not all zero.
fn given(found: Klobuchar) -> Option<Coefficients> {
    let is_given = found.alpha.iter().chain(&found.beta).any(|value| *value != 0.0);
    is_given.then_some(Coefficients::KlobucharBeidou(found))
}

/// Makes the frames of satellites.
struct Frames {
    klobuchar: Option<Klobuchar>,
}

impl Sender for Frames {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        D1_D2.check_start(start, "a multiple of 30 s of BDT")?;
        let on_air = Ephemeris { transmitted: start, ..ephemeris.clone() };
        let klobuchar = self.klobuchar.unwrap_or(Klobuchar::ZERO);
        let orbit = Orbit { ephemeris: on_air, klobuchar };
        if ephemeris.sv.is_geostationary() { d2(&orbit, start) } else { d1(&orbit, start) }
    }
}

/// A frame of D1.
fn d1(orbit: &Orbit, start: Epoch) -> Result<Vec<bool>, FieldError> {
    let mut set = D1Set::default();
    write_all(&D1_SET, orbit, &mut set)?;
    let mut symbols = Vec::with_capacity(D1_SUBFRAMES * SUBFRAME_BITS * D1_SYMBOLS);
    for index in 0..D1_SUBFRAMES {
        let mut subframe: Subframe = set.part(index * SUBFRAME_BITS);
        let begin_s = start.tow_whole_s() + index as i64 * D1_SUBFRAME_S;
        if index >= D1_PARTS {
            subframe.set_piece(D1_PAGE, (start.tow_whole_s() / UNIT_S % 24 + 1) as u32);
        }
        for bit in finished(subframe, index + 1, begin_s) {
            symbols.extend((0..D1_SYMBOLS).map(|place| bit ^ chip(place)));
        }
    }
    Ok(symbols)
}

/// Ten frames of D2.
fn d2(orbit: &Orbit, start: Epoch) -> Result<Vec<bool>, FieldError> {
    let mut set = D2Set::default();
    write_all(&D2_SET, orbit, &mut set)?;
    let mut symbols = Vec::with_capacity(D2_SUBFRAMES * SUBFRAME_BITS * D2_SYMBOLS);
    for index in 0..D2_SUBFRAMES {
        let (frame, number) = (index / 5, index % 5 + 1);
        let mut subframe = if number == 1 { set.part(frame * SUBFRAME_BITS) } else { Subframe::default() };
        if number == 1 {
            subframe.set_piece(D2_PAGE, frame as u32 + 1);
        }
        let begin_s = start.tow_whole_s() + frame as i64 * D2_FRAME_S;
        for bit in finished(subframe, number, begin_s) {
            symbols.extend([bit; D2_SYMBOLS]);
        }
    }
    Ok(symbols)
}

/// The bits of a subframe as they are sent: with its header, parities and interleaving.
fn finished(mut subframe: Subframe, number: usize, begin_s: i64) -> Vec<bool> {
    subframe.set_piece((0, 11), PREAMBLE);
    subframe.set_piece(FRAME_ID, number as u32);
    let second = (begin_s + planted!("gnss.beidou.second_sent", 0, D1_SUBFRAME_S)).rem_euclid(WEEK_S) as u32;
    subframe.set_piece(SECOND[0], second >> 12);
    subframe.set_piece(SECOND[1], second);
    encode(&subframe)
}

/// The bits of a subframe as they are sent: parities are computed again.
pub fn encode(subframe: &Subframe) -> Vec<bool> {
    let mut sent = Vec::with_capacity(SUBFRAME_BITS);
    for (index, word) in subframe.0.chunks_exact(WORD_BITS).enumerate() {
        if index == 0 {
            let info = word.get(15..26).unwrap_or_default();
            sent.extend(word.iter().take(26).copied().chain(parity(info)));
        } else {
            let of = |first: usize| {
                let info = word.get(first..first + 11).unwrap_or_default();
                info.iter().copied().chain(parity(info))
            };
            sent.extend(of(0).zip(of(11)).flat_map(|(one, other)| [one, other]));
        }
    }
    sent
}

/// The subframe in bits as they were sent; `None` where a preamble or a parity is wrong.
pub fn decode(sent: &[bool]) -> Option<Subframe> {
    let mut subframe = Subframe::default();
    let words = subframe.0.chunks_exact_mut(WORD_BITS).zip(sent.chunks_exact(WORD_BITS));
    for (index, (word, bits)) in words.enumerate() {
        if index == 0 {
            word.copy_from_slice(bits);
            let (info, check) = word.get(15..)?.split_at_checked(11)?;
            if parity(info) != check {
                return None;
            }
        } else {
            let of = |phase: usize| bits.iter().skip(phase).step_by(2).copied().collect::<Vec<bool>>();
            let (one, other) = (of(0), of(1));
            for (code, first) in [(&one, 0), (&other, 1)] {
                let (info, check) = code.split_at_checked(11)?;
                if parity(info) != check {
                    return None;
                }
                word.get_mut(11 * first..11 * first + 11)?.copy_from_slice(info);
                word.get_mut(22 + 4 * first..26 + 4 * first)?.copy_from_slice(check);
            }
        }
    }
    let whole = sent.len() == SUBFRAME_BITS && subframe.piece((0, 11)) == PREAMBLE;
    (whole && (1..=5).contains(&subframe.piece(FRAME_ID)) && i64::from(second(&subframe)) < WEEK_S).then_some(subframe)
}

/// Parity of BCH(15,11,1), whose polynomial is x⁴ + x + 1 (5.1.3).
fn parity(info: &[bool]) -> [bool; 4] {
    let polynomial = planted!("gnss.beidou.bch", 0b0011, 0b1001);
    let register = info.iter().fold(0_u8, |register, &bit| {
        let feedback = (register >> 3 & 1 == 1) != bit;
        (register << 1 & 0b1111) ^ if feedback { polynomial } else { 0 }
    });
    [3, 2, 1, 0].map(|place| register >> place & 1 == 1)
}

/// Number of a subframe.
pub fn id(subframe: &Subframe) -> u8 {
    subframe.piece(FRAME_ID) as u8
}

/// Second of the week of BDT that a subframe states: in D1 when it began, in D2 when its frame did.
pub fn second(subframe: &Subframe) -> u32 {
    subframe.piece(SECOND[0]) << 12 | subframe.piece(SECOND[1])
}

/// Subframes of D1 or pages of D2 that make up an ephemeris: the parts, first to last.
fn orbit_of(sv: Sv, parts: &[Subframe], sent: Epoch) -> (Orbit, Vec<(&'static str, i64)>) {
    let mut orbit = Orbit::blank(sv, sent);
    if sv.is_geostationary() {
        let set = D2Set::joined(parts.iter().map(|part| &part.0));
        read_all(&D2_SET, &set, &mut orbit);
        (orbit, integers(&D2_SET, &set))
    } else {
        let set = D1Set::joined(parts.iter().map(|part| &part.0));
        read_all(&D1_SET, &set, &mut orbit);
        (orbit, integers(&D1_SET, &set))
    }
}

/// Transmission time of a part. The week is near `near`, or the first part states it.
fn sent_at(first: &Subframe, is_d2: bool, near: Epoch) -> Epoch {
    let week = first.piece(if is_d2 { (64, 13) } else { (60, 13) });
    let week = near.nearest_week(i64::from(week) + BDT_WEEK, 8192);
    Epoch::new(week * WEEK_S + i64::from(second(first)), 0.0)
}

/// The parameters in the symbols of a unit; `None` where one of the parts with an ephemeris fails its check.
fn parameters(symbols: &[bool]) -> Option<Vec<(&'static str, i64)>> {
    let bits = |per_bit: usize| -> Vec<bool> {
        let first = symbols.iter().step_by(per_bit);
        first.map(|one| one ^ (per_bit == D1_SYMBOLS && chip(0))).collect()
    };
    let subframes = |bits: Vec<bool>, every: usize, count: usize| -> Option<Vec<Subframe>> {
        bits.chunks(SUBFRAME_BITS).step_by(every).take(count).map(decode).collect()
    };
    if let Some(parts) = subframes(bits(D1_SYMBOLS), 1, D1_PARTS) {
        return Some(integers(&D1_SET, &D1Set::joined(parts.iter().map(|part| &part.0))));
    }
    let parts = subframes(bits(D2_SYMBOLS), 5, D2_PARTS)?;
    Some(integers(&D2_SET, &D2Set::joined(parts.iter().map(|part| &part.0))))
}

/// Parameters by which ephemerides are distinguished, what all satellites send alike, and the health, which
/// has a fault of its own, are fixed.
static OF_SET: SetTables<Orbit, D1Set> = SetTables {
    fixed: &[&["week", "toc_s", "toe_s", "health", "aodc", "aode"], &Klobuchar::PARAMETERS],
    elements: |own, sv, raw, near| own.of_integers(sv, raw, near).map(numbered),
    quantised: |own, set| own.rounded(form(set)),
    ..SetTables::of(
        &D1_SETS,
        &[&D1_SET],
        D1Set::default,
        (|ephemeris| Orbit { klobuchar: Klobuchar::ZERO, ephemeris }, |orbit| orbit.ephemeris),
    )
};
