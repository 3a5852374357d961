//! B-CNAV1, the message of B1C: frames of eighteen seconds, encoded and decoded.
//!
//! Source: BDS-SIS-ICD-B1C 1.0, 6.2 (structure, codes, interleaver) and 7. A frame is 1800 symbols: subframe
//! 1, the satellite's number and the second of the hour in 72 symbols; subframe 2, orbit and clock in 600
//! bits; subframe 3, one of several pages in 264. The last two have checks, are coded over GF(64) and
//! interleaved together. The matrices of the codes are those of the document's section 6.2.2, packed in
//! `ldpc_2.bin` and `ldpc_3.bin`.
//!
//! Of subframe 3 page 1 (ionosphere, UTC) is sent where BDGIM's coefficients are known, and pages 2 and 4
//! (almanacs) of the satellites that are known: odd frames are page 1, where that is sent, and the others go
//! through the almanacs.
//!
//! Limits: those of [`super::bcnav`]; predicted accuracies are sent as zeros. Page 3 has the Earth's
//! orientation, of which a scene knows nothing, and is not sent. Of other pages than 1 health and predicted
//! accuracies alone are read.

pub(super) mod almanac;
mod fields;
mod reader;

use std::sync::LazyLock;

use crate::beidou::b1c::{B1C, CARRIER_HZ as B1C_HZ};
use crate::beidou::b2a::B2A;
use crate::beidou::bcnav::blocks::Content;
use crate::beidou::bcnav::{self, OfSet, Tables, blank, integers_in, record_lines, sent_at};
use crate::beidou::bcnav2::B_CNAV2;
use crate::bits::{FieldError, number, read_all};
use crate::broadcast::{Ephemeris, SetForm};
use crate::crc::{checked, is_checked};
use crate::fec::interleaver::Interleaver;
use crate::fec::ldpc64::Ldpc64;
use crate::fec::register::RegisterCode;
use crate::fec::subframes::Blocks;
use crate::message::{Common, Message, Parameters, Records, Sender, UtcNumbers};
use crate::satellite::Sv;
use crate::signal::Signal;
use crate::time::{BDT, BDT_WEEK, Epoch, WEEK_S};
use almanac::{Almanacs, OF_ACCURACIES, OF_MEDIUM, OF_REDUCED, is_first};
pub use fields::tables;
use fields::{BESIDE, SET, THREE, TWO};
pub use reader::BCnav1Reader;

/// Definition of B-CNAV1 for B1C.
pub static B_CNAV1: Message = Message {
    name: "B-CNAV1",
    symbol_s: 0.01,
    bit: |_| &[1],
    unit_s: FRAME_S,
    decided_after: 0,
    set_s: FRAME_S,
    first_s: 0,
    sender: |common| {
        bcnav::check(common)?;
        Ok(Box::new(Frames { common: common.clone(), almanacs: Almanacs::of(common) }))
    },
    number: |_| 1,
    timed: &[1],
    dated: &[],
    set: &[1],
    reduced: &[],
    ionosphere: bcnav::ionosphere(is_first),
    fields: &FIELDS,
    parameters: opened,
    reader: |sv| Box::new(BCnav1Reader::new(sv)),
    form,
    sets: &B_CNAV1_SETS,
    alert: None,
    rinex: Some(Records {
        set: |_| "CNV1",
        common: "CNVX",
        fields: tables,
        lines: Some(|set, raw| record_lines(set, raw, [Some(set.isc_s[0]), None, Some(set.tgd_s), Some(set.tgd2_s)])),
    }),
};

/// Ephemerides of B-CNAV1: T_GD of B1C's pilot in the field of the first group delay, of B2a's in that of the
/// second; health of the satellite. They serve both signals, as do those of B-CNAV2.
pub static B_CNAV1_SETS: SetForm = SetForm {
    name: "B-CNAV1",
    group_delay_s,
    serves,
    given_delay_s: |set| set.tgd_s,
    is_healthy: |set| set.health == 0,
    healthy: |set, signal| serves(signal).then_some(set.health == 0),
    rinex_sources: None,
};

/// The signals whose delays the ephemerides have.
fn serves(signal: &Signal) -> bool {
    signal.carries(&B_CNAV1) || signal.carries(&B_CNAV2)
}

/// T_GD of a signal's pilot, which receivers follow (7.6).
fn group_delay_s(set: &Ephemeris, signal: &Signal) -> f64 {
    if signal.carries(&B_CNAV2) {
        planted!("gnss.bcnav.delays", set.tgd2_s, set.tgd_s)
    } else {
        set.group_delay_on_s(B1C_HZ, signal.carrier_hz(set.sv))
    }
}

/// An ephemeris as B-CNAV1 has it.
fn form(set: &Ephemeris) -> Ephemeris {
    bcnav::carried(set, &B_CNAV1_SETS, &[&B1C, &B2A], Some(["1D", "1P"]))
}

/// Seconds of a frame, and of the hours in which frames are counted.
const FRAME_S: i64 = 18;
const HOUR_S: i64 = 3600;
/// Bits of subframes 2 and 3 with their checks, and of a check.
const BITS_2: usize = 600;
const BITS_3: usize = 264;
/// Symbols of the number and of the time in subframe 1, of it, and of a frame.
const NUMBER_SYMBOLS: usize = 21;
const SYMBOLS_1: usize = 72;
const SYMBOLS: usize = SYMBOLS_1 + 2 * BITS_2 + 2 * BITS_3;
/// Pages of subframe 3: of the ionosphere and UTC, of four almanacs, and of one.
const WITH_ELECTRONS: u8 = 1;
const WITH_ALMANACS: u8 = 2;
const WITH_ONE: u8 = 4;

/// The codes of subframe 1 (6.2.1).
const NUMBER_CODE: RegisterCode = RegisterCode { stages: 6, feedback: 0b11_1010, symbols: NUMBER_SYMBOLS };
const TIME_CODE: RegisterCode = RegisterCode { stages: 8, feedback: 0b1111_1001, symbols: SYMBOLS_1 - NUMBER_SYMBOLS };
/// 36 rows of 48 written, columns of 36 sent (6.2.3).
const INTERLEAVER: Interleaver = Interleaver { columns: 36, rows: 48 };

pub(super) static CODE_2: LazyLock<Ldpc64> = LazyLock::new(|| Ldpc64::packed(BITS_2 / 6, include_bytes!("ldpc_2.bin")));
pub(super) static CODE_3: LazyLock<Ldpc64> = LazyLock::new(|| Ldpc64::packed(BITS_3 / 6, include_bytes!("ldpc_3.bin")));

/// Decoded frame with correct checks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame(pub Blocks);

impl Frame {
    /// Seconds of the week of BDT at which it began.
    pub fn of_week_s(&self) -> i64 {
        let count = i64::from(self.0.time) - planted!("gnss.bcnav1.time", 0, 1);
        (self.0.interval() * HOUR_S + count * FRAME_S).rem_euclid(WEEK_S)
    }

    /// Start time of the frame, with its week near `near`.
    pub fn sent_at(&self, near: Epoch) -> Epoch {
        sent_at(self.0.week(), self.of_week_s(), near)
    }
}

/// Encodes a satellite's number and a time to 72 symbols.
pub fn first_symbols(number: u8, time: u32) -> Vec<bool> {
    NUMBER_CODE.encode(u32::from(number)).chain(TIME_CODE.encode(time)).collect()
}

/// Index of an interleaver row among the rows of 48 symbols of subframe 2 followed by subframe 3. Rows come
/// in turn, two of subframe 2 and one of subframe 3, then the rest of subframe 2 (6.2.3, figure 6-4).
fn row_of(row: usize) -> usize {
    const ROWS_2: usize = 2 * BITS_2 / 48;
    match (row / 3, row % 3) {
        (11.., _) => row - 11,
        (round, 2) => ROWS_2 + round,
        (round, place) => 2 * round + place,
    }
}

/// Encodes a frame, from bits with their checks to symbols as they are sent.
pub fn encoded(number: u8, time: u32, two: &[bool], three: &[bool]) -> Vec<bool> {
    let both = [CODE_2.encode(two), CODE_3.encode(three)].concat();
    let rows = (0..36).flat_map(|row| both.iter().copied().skip(48 * row_of(row)).take(48));
    let written: Vec<bool> = rows.collect();
    first_symbols(number, time).into_iter().chain(INTERLEAVER.interleave(&written)).collect()
}

/// Likeliest time of a frame from 72 soft symbols and a satellite's number, with their agreement, −1 to 1.
/// The agreement is negative if the symbols are inverted.
pub fn likely_time(number: u8, soft: &[f32]) -> (u32, f32) {
    let (first, rest) = soft.split_at(NUMBER_SYMBOLS.min(soft.len()));
    let number = NUMBER_CODE.correlation(u32::from(number), first);
    let sums = (0..(HOUR_S / FRAME_S) as u32).map(|time| (time, number + TIME_CODE.correlation(time, rest)));
    let (time, sum) = sums.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or((0, 0.0));
    let all: f32 = soft.iter().map(|value| value.abs()).sum();
    (time, sum / all.max(f32::MIN_POSITIVE))
}

/// The likeliest number in the first symbols.
fn likely_number(soft: &[f32], inverted: bool) -> u32 {
    let sign = if inverted { -1.0 } else { 1.0 };
    let sum = |number: &u32| sign * NUMBER_CODE.correlation(*number, soft);
    (0..64).max_by(|a, b| sum(a).total_cmp(&sum(b))).unwrap_or(0)
}

/// The frame of a satellite in 1800 soft symbols, positive for a logical 0, normal or inverted; `None` where
/// it is another's or its checks fail.
pub fn decode(number: u8, soft: &[f32]) -> Option<Frame> {
    let (first, rest) = soft.split_at_checked(SYMBOLS_1)?;
    let (time, share) = likely_time(number, first);
    let inverted = share < 0.0;
    if likely_number(first.get(..NUMBER_SYMBOLS)?, inverted) != u32::from(number) {
        return None;
    }
    let written = INTERLEAVER.deinterleave(rest);
    let mut both = vec![0.0; 2 * (BITS_2 + BITS_3)];
    for (row, symbols) in written.chunks_exact(48).enumerate() {
        let places = both.iter_mut().skip(48 * row_of(row));
        places.zip(symbols).for_each(|(place, value)| *place = if inverted { -value } else { *value });
    }
    let (two, three) = both.split_at_checked(2 * BITS_2)?;
    let of = |code: &Ldpc64, soft| code.decode(soft).filter(|bits| is_checked(bits));
    Some(Frame(Blocks { time, inverted, two: of(&CODE_2, two)?, three: of(&CODE_3, three) }))
}

/// Makes the frames of satellites.
struct Frames {
    common: Common,
    almanacs: Almanacs,
}

impl Sender for Frames {
    fn unit(&self, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        B_CNAV1.check_start(start, "a multiple of 18 s of BDT")?;
        let [two, three] = self.subframes(set, start)?;
        let time = start.tow_whole_s() % HOUR_S / FRAME_S;
        Ok(encoded(set.sv.number, time as u32, &two, &three))
    }
}

impl Frames {
    /// The bits of subframes 2 and 3 of an ephemeris with their checks.
    fn subframes(&self, set: &Ephemeris, start: Epoch) -> Result<[Vec<bool>; 2], FieldError> {
        let common = &self.common;
        let (page, entries) = self.almanacs.page_at(common.bdgim.is_some(), start);
        let utc = UtcNumbers::of(common, start, &BDT, (BDT_WEEK, 0));
        let alpha_tecu = common.bdgim.map_or([0.0; 9], |model| model.alpha_tecu);
        let toa = self.almanacs.toa;
        let content =
            Content { sent: start, page: f64::from(page), utc, alpha_tecu, toa, entries, ..blank(set.clone()) };
        let beside: &Tables = match page {
            WITH_ELECTRONS => BESIDE,
            WITH_ONE => &OF_MEDIUM,
            _ => &OF_REDUCED,
        };
        Ok([checked(TWO, &content, BITS_2)?, checked(&[THREE, beside].concat(), &content, BITS_3)?])
    }
}

/// The parameters of a unit's symbols, whose satellite is the one that they name.
fn opened(symbols: &[bool]) -> Option<(bool, Parameters)> {
    let soft: Vec<f32> = symbols.iter().map(|&one| if one { -1.0 } else { 1.0 }).collect();
    let number = number(symbols.get(..6)?) as u8;
    let frame = decode(number, &soft)?;
    let three = frame.0.three?;
    let mut found = of_set_in(&frame.0.two, &three);
    found.extend(beside_in(&three));
    Some((true, found))
}

/// Tables of the ephemeris.
static FIELDS: OfSet = bcnav::set_tables(&B_CNAV1_SETS, SET, |own, set| bcnav::rounded(own, form(set)));

/// The raw integers of the ephemeris in subframes 2 and 3.
fn of_set_in(two: &Vec<bool>, three: &Vec<bool>) -> Parameters {
    let mut found = integers_in(TWO, two);
    found.extend(integers_in(THREE, three));
    found
}

/// The raw integers of a page that are of no ephemeris, but almanacs.
fn beside_in(three: &Vec<bool>) -> Parameters {
    match number(three.get(..6).unwrap_or_default()) as u8 {
        WITH_ELECTRONS => integers_in(BESIDE, three),
        WITH_ALMANACS | WITH_ONE => integers_in(&OF_ACCURACIES, three),
        _ => Parameters::new(),
    }
}

/// The ephemeris in subframes 2 and 3, sent at `sent`.
fn elements(sv: Sv, two: &Vec<bool>, three: &Vec<bool>, sent: Epoch) -> Ephemeris {
    let mut content = blank(Ephemeris { form: &B_CNAV1_SETS, ..Ephemeris::blank(sv, sent) });
    TWO.iter().for_each(|table| read_all(table, two, &mut content));
    THREE.iter().for_each(|table| read_all(table, three, &mut content));
    content.set
}

#[cfg(test)]
mod tests;
