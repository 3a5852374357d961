//! B-CNAV1, the message of B1C: frames of eighteen seconds, encoded and decoded.
//!
//! Source: BDS-SIS-ICD-B1C 1.0, 6.2 (structure, codes, interleaver) and 7. A frame is 1800 symbols: subframe
//! 1, the satellite's number and the second of the hour in 72 symbols; subframe 2, orbit and clock in 600
//! bits; subframe 3, one of several pages in 264. The last two have checks, are coded over GF(64) and
//! interleaved together. The matrices of the codes are those of the document's section 6.2.2, packed in
//! `ldpc_2.bin` and `ldpc_3.bin`.
//!
//! Limits: subframe 3 is always page 2, whose almanacs are empty (number 0): nothing of the ionosphere (the
//! document's own model, BDGIM, is left out), of UTC, of other systems and of the Earth's orientation. Of
//! other pages health alone is read. A set of D1 is carried to the nearest reference time that B-CNAV1 can
//! express, and to its steps; its two group delays are against B3I, and those of B1C and B2a follow as delays
//! that are as 1/f².

mod fields;
mod reader;

use std::sync::LazyLock;

use crate::gnss::beidou::d1d2::{BDT_WEEK, issue};
use crate::gnss::bits::{Element, FieldError, add_to, bits_of, integers, number, quantise_all, read_all, write_all};
use crate::gnss::broadcast::{Ephemeris, PLAIN, SetForm};
use crate::gnss::crc::crc24q;
use crate::gnss::fec::interleaver::Interleaver;
use crate::gnss::fec::ldpc64::Ldpc64;
use crate::gnss::fec::register::RegisterCode;
use crate::gnss::ionosphere::Model;
use crate::gnss::message::{IonosphereForm, Message, Parameters, Raw, Sender};
use crate::gnss::satellite::Sv;
use crate::gnss::time::{BDT, Epoch, WEEK_S};
pub use fields::tables;
use fields::{HEADER, SET, STEP_S, kind};
pub use reader::BCnav1Reader;

/// B-CNAV1 as B1C names it.
pub static B_CNAV1: Message = Message {
    name: "B-CNAV1",
    symbol_s: 0.01,
    unit_s: FRAME_S,
    first_s: 0,
    sender: |_| Ok(Box::new(Frames)),
    number: |_| 1,
    timed: &[1],
    dated: &[],
    set: &[1],
    reduced: &[],
    // Never sent and never read.
    ionosphere: IonosphereForm { model: Model::KlobucharBeidou, unit: |_| false, coefficients: |_| None },
    set_parameters,
    elements: of_integers,
    parameters: opened,
    reader: |sv| Box::new(BCnav1Reader::new(sv)),
    form: |set| carried(set, &B_CNAV1_SETS),
    sets: &B_CNAV1_SETS,
    quantised,
    adjustable,
    alert: None,
    adjust,
    rinex: None,
};

/// Sets of B-CNAV1: T_GD of B1C's pilot in the place of the first group delay, of B2a's in that of the
/// second; health of the satellite.
pub static B_CNAV1_SETS: SetForm = SetForm {
    name: "B-CNAV1",
    group_delay_s: |set, _| set.tgd_s,
    serves: |signal| signal.carries(&B_CNAV1),
    given_delay_s: |set| set.tgd_s,
    is_healthy: |set| set.health == 0,
    healthy: |set, signal| signal.carries(&B_CNAV1).then_some(set.health == 0),
    rinex_sources: None,
};

/// Seconds of a frame, and of the hours in which frames are counted.
const FRAME_S: i64 = 18;
const HOUR_S: i64 = 3600;
/// Bits of subframes 2 and 3 with their checks, and of a check.
const BITS_2: usize = 600;
const BITS_3: usize = 264;
const CHECK_BITS: usize = 24;
/// Symbols of the number and of the time in subframe 1, of it, and of a frame.
const NUMBER_SYMBOLS: usize = 21;
const SYMBOLS_1: usize = 72;
const SYMBOLS: usize = SYMBOLS_1 + 2 * BITS_2 + 2 * BITS_3;
/// The page that is sent: almanacs, of no satellite.
const PAGE: f64 = 2.0;

/// The codes of subframe 1 (6.2.1).
const NUMBER_CODE: RegisterCode = RegisterCode { stages: 6, feedback: 0b11_1010, symbols: NUMBER_SYMBOLS };
const TIME_CODE: RegisterCode = RegisterCode { stages: 8, feedback: 0b1111_1001, symbols: SYMBOLS_1 - NUMBER_SYMBOLS };
/// 36 rows of 48 written, columns of 36 sent (6.2.3).
const INTERLEAVER: Interleaver = Interleaver { columns: 36, rows: 48 };

static CODE_2: LazyLock<Ldpc64> = LazyLock::new(|| Ldpc64::packed(BITS_2 / 6, include_bytes!("ldpc_2.bin")));
static CODE_3: LazyLock<Ldpc64> = LazyLock::new(|| Ldpc64::packed(BITS_3 / 6, include_bytes!("ldpc_3.bin")));

/// What frames say.
#[derive(Clone, Debug)]
struct Content {
    set: Ephemeris,
    /// When the frame is sent.
    sent: Epoch,
    kind: f64,
    page: f64,
    flags: f64,
    reserved: f64,
}

/// A frame as decoded: its checks are right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Eighteen seconds of the hour at its beginning.
    pub time: u32,
    /// Whether symbols were upside down.
    pub inverted: bool,
    /// Bits of subframe 2 with their check.
    pub two: Vec<bool>,
    /// Those of subframe 3; `None` where it fails its check.
    pub three: Option<Vec<bool>>,
}

impl Frame {
    /// Seconds of the week of BDT at which it began.
    pub fn of_week_s(&self) -> i64 {
        let hour = number(self.two.get(13..21).unwrap_or_default()) as i64;
        let count = i64::from(self.time) - planted!("gnss.bcnav1.time", 0, 1);
        (hour * HOUR_S + count * FRAME_S).rem_euclid(WEEK_S)
    }

    /// When it began, its week near `near`.
    pub fn sent_at(&self, near: Epoch) -> Epoch {
        let week = number(self.two.get(..13).unwrap_or_default()) as i64 + BDT_WEEK;
        Epoch::new(near.nearest_week(week, 8192) * WEEK_S + self.of_week_s(), 0.0)
    }
}

/// The 72 symbols of a satellite's number and a time.
pub fn first_symbols(number: u8, time: u32) -> Vec<bool> {
    NUMBER_CODE.encode(u32::from(number)).chain(TIME_CODE.encode(time)).collect()
}

/// Where a row of the interleaver is among the rows of 48 symbols of both subframes, one after the other: two
/// of subframe 2, one of subframe 3, in turn, and what is left of subframe 2 (6.2.3, figure 6-4).
fn row_of(row: usize) -> usize {
    const ROWS_2: usize = 2 * BITS_2 / 48;
    match (row / 3, row % 3) {
        (11.., _) => row - 11,
        (round, 2) => ROWS_2 + round,
        (round, place) => 2 * round + place,
    }
}

/// The symbols of a frame as they are sent, of bits with their checks.
pub fn encoded(number: u8, time: u32, two: &[bool], three: &[bool]) -> Vec<bool> {
    let both = [CODE_2.encode(two), CODE_3.encode(three)].concat();
    let rows = (0..36).flat_map(|row| both.iter().copied().skip(48 * row_of(row)).take(48));
    let written: Vec<bool> = rows.collect();
    first_symbols(number, time).into_iter().chain(INTERLEAVER.interleave(&written)).collect()
}

/// How much of what 72 soft symbols say is for a satellite's number and a time, the likeliest, and that time;
/// below zero where they are upside down.
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

/// The frame of a satellite in 1800 soft symbols, positive for a logical 0, whichever way up; `None` where
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
    let of = |code: &Ldpc64, soft| code.decode(soft).filter(|bits| crc24q(bits.iter().copied()) == 0);
    Some(Frame { time, inverted, two: of(&CODE_2, two)?, three: of(&CODE_3, three) })
}

/// Makes the frames of satellites.
struct Frames;

impl Sender for Frames {
    fn unit(&self, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        if start.tow_whole_s() % FRAME_S != 0 || start.fraction() != 0.0 {
            let expected = "a multiple of 18 s of BDT";
            return Err(FieldError::Start { message: B_CNAV1.name, start_s: start.tow_s(), expected });
        }
        let [two, three] = subframes(set, start)?.map(checked);
        let time = start.tow_whole_s() % HOUR_S / FRAME_S;
        Ok(encoded(set.sv.number, time as u32, &two, &three))
    }
}

/// The bits of subframes 2 and 3 of a set without their checks.
pub(super) fn subframes(set: &Ephemeris, start: Epoch) -> Result<[Vec<bool>; 2], FieldError> {
    let content = Content { sent: start, ..blank(set.clone()) };
    let [mut two, mut three] = empty();
    write_all(&SET, &content, &mut two)?;
    write_all(&HEADER, &content, &mut three)?;
    Ok([two, three])
}

/// Both subframes with nothing in them.
pub(super) fn empty() -> [Vec<bool>; 2] {
    [BITS_2, BITS_3].map(|bits| vec![false; bits - CHECK_BITS])
}

/// The bits of a subframe with their check.
fn checked(mut bits: Vec<bool>) -> Vec<bool> {
    let check = crc24q(bits.iter().copied());
    bits.extend(bits_of(u128::from(check), CHECK_BITS));
    bits
}

/// The set as B-CNAV1 has it, and B-CNAV2: carried to the nearest multiple of 300 s of BDT, with the delays
/// of B1C and B2a.
pub(super) fn carried(set: &Ephemeris, form: &'static SetForm) -> Ephemeris {
    if *set.form != PLAIN {
        return Ephemeris { form, ..set.clone() };
    }
    let label_s = BDT.label(set.toe).seconds() as f64;
    let toe = BDT.instant(Epoch::new((label_s / STEP_S as f64).round() as i64 * STEP_S, 0.0));
    let (since_toe_s, since_toc_s) = (toe.since(set.toe), toe.since(set.toc));
    let motion_radps = set.mean_motion_radps();
    let issue = issue(BDT.label(toe).tow_s());
    Ephemeris {
        form,
        toe,
        toc: toe,
        iode: issue,
        iodc: issue,
        aodo: 0,
        m0_rad: set.m0_rad + motion_radps * since_toe_s,
        omega0_rad: set.omega0_rad + set.omega_dot_radps * since_toe_s,
        i0_rad: set.i0_rad + set.idot_radps * since_toe_s,
        af0_s: set.af0_s + since_toc_s * (set.af1_sps + since_toc_s * set.af2_sps2),
        af1_sps: set.af1_sps + 2.0 * since_toc_s * set.af2_sps2,
        tgd_s: set.group_delay_on_s(B1C_HZ),
        tgd2_s: set.group_delay_on_s(B2A_HZ),
        ..set.clone()
    }
}

const B1C_HZ: f64 = 1_575.42e6;
const B2A_HZ: f64 = 1_176.45e6;

/// Tables with parameters of a set.
fn of_set() -> [&'static [Element<Content>]; 2] {
    [&SET, &HEADER]
}

/// Parameters that are of the frame and not of the set.
const PASSING: [&str; 3] = ["week", "how_1h", "page"];

fn set_parameters() -> Vec<&'static str> {
    let names = of_set().into_iter().flatten().map(|element| element.field.name);
    names.filter(|name| !PASSING.contains(name)).collect()
}

/// The raw integers of the set in subframes 2 and 3.
pub(super) fn of_set_in(two: &Vec<bool>, three: &Vec<bool>) -> Parameters {
    let mut found = integers(&SET, two);
    found.extend(integers(&HEADER, three));
    found.retain(|(name, _)| !PASSING.contains(name));
    found
}

/// The parameters of a unit's symbols, whose satellite is the one that they name.
fn opened(symbols: &[bool]) -> Option<(bool, Parameters)> {
    let soft: Vec<f32> = symbols.iter().map(|&one| if one { -1.0 } else { 1.0 }).collect();
    let number = number(symbols.get(..6)?) as u8;
    let frame = decode(number, &soft)?;
    Some((true, of_set_in(&frame.two, &frame.three?)))
}

/// Nothing read yet.
fn blank(set: Ephemeris) -> Content {
    let kind = kind(set.sv);
    let sent = set.toe;
    Content { set: Ephemeris { form: &B_CNAV1_SETS, ..set }, sent, kind, page: PAGE, flags: 0.0, reserved: 0.0 }
}

/// The elements that raw integers give, as if they had been sent at `near`.
fn of_integers(sv: Sv, raw: Raw<'_>, near: Epoch) -> Option<Ephemeris> {
    let mut content = blank(Ephemeris::blank(sv, near));
    for table in of_set() {
        let mut bits = vec![false; BITS_2];
        for field in table.iter().map(|element| &element.field).filter(|field| !PASSING.contains(&field.name)) {
            field.write(&mut bits, raw(field.name)?);
        }
        read_all(table, &bits, &mut content);
    }
    Some(content.set)
}

/// The elements that a receiver decodes when `ephemeris` is sent; `transmitted` stays.
///
/// # Errors
/// A value that the message cannot carry.
pub fn quantised(ephemeris: &Ephemeris) -> Result<Ephemeris, FieldError> {
    let mut content = blank(carried(ephemeris, &B_CNAV1_SETS).timed(|at| BDT.label(at)));
    of_set().into_iter().try_for_each(|table| quantise_all(table, &mut content))?;
    Ok(content.set.timed(|label| BDT.instant(label)))
}

/// Parameters by which sets are distinguished, or that are no set's.
const FIXED_PARAMETERS: [&str; 11] = [
    "week",
    "how_1h",
    "page",
    "iodc",
    "iode",
    "toe_5min",
    "toc_5min",
    "orbit_kind",
    "reserved",
    "health",
    "integrity_flags",
];

fn adjustable() -> Vec<&'static str> {
    let names = of_set().into_iter().flatten().map(|element| element.field.name);
    names.filter(|name| !FIXED_PARAMETERS.contains(name)).collect()
}

/// Adds `by` to a parameter in the unit of the tables; whether there is one.
fn adjust(ephemeris: &mut Ephemeris, parameter: &str, by: f64) -> bool {
    let mut content = blank(ephemeris.clone());
    let found = of_set().into_iter().any(|table| add_to(table, parameter, &mut content, by));
    *ephemeris = Ephemeris { form: ephemeris.form, ..content.set };
    found
}

/// The set in subframes 2 and 3, sent at `sent`.
pub(super) fn elements(sv: Sv, two: &Vec<bool>, three: &Vec<bool>, sent: Epoch) -> Ephemeris {
    let mut content = blank(Ephemeris::blank(sv, sent));
    read_all(&SET, two, &mut content);
    read_all(&HEADER, three, &mut content);
    content.set
}

#[cfg(test)]
mod tests;
