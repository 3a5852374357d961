//! CNAV-2, the message of L1C: frames of eighteen seconds, encoded and decoded.
//!
//! Source: IS-GPS-800J, 3.2.3 (structure, codes, interleaver) and 3.5. A frame is 1800 symbols: subframe 1,
//! nine bits of time in 52 symbols; subframe 2, orbit and clock in 600 bits; subframe 3, one of many pages in
//! 274. The last two have checks, are coded at rate one half and interleaved together. The matrices of the
//! codes are those of 6.2, packed in `ldpc_2.bin` and `ldpc_3.bin`.
//!
//! Sent are page 1 (UTC, ionosphere, corrections between signals), 3 and 4 (almanacs) of subframe 3: two of
//! three frames are page 1, the third goes through the almanacs. An ephemeris is whole once page 1 has come,
//! and changes with a frame that has it. Limits: left out are page 2, which has the Earth's orientation, of
//! which a scene knows nothing, beside other systems' times, 5 (corrections), 6 (text) and those that QZSS
//! alone sends. Almanacs are not read. Of UTC nothing is used. Ephemerides of LNAV become those of CNAV-2 as
//! they become those of CNAV ([`super::cnav`]), with delays of both parts of L1C that are those of L1 where
//! the file has none.

mod almanac;
mod fields;
mod reader;

use std::sync::LazyLock;

use crate::bits::{Element, FieldError, integers, number, read_all, soft};
use crate::broadcast::{Ephemeris, SetForm};
use crate::crc::{checked, is_checked};
use crate::exchange::modern;
use crate::fec::interleaver::Interleaver;
use crate::fec::ldpc::Ldpc;
use crate::fec::register::RegisterCode;
use crate::fec::subframes::{Blocks, Subframes};
use crate::gps::cnav::{self, CNAV_SETS, STEP_S};
use crate::ionosphere::{Coefficients, Model};
use crate::klobuchar::Klobuchar;
use crate::message::{Common, IonosphereForm, Message, Parameters, Raw, RecordLine, Records, Sender, UtcNumbers};
use crate::satellite::Sv;
use crate::set_tables::SetTables;
use crate::signal::Signal;
use crate::time::{Epoch, GPST, WEEK_S};
use almanac::{Almanacs, Entry, MEDIUM, OF_MEDIUM, OF_REDUCED, PACKETS, REDUCED, ROUND, is_first};
pub use fields::tables;
use fields::{DELAY, HEADER, OF_UTC, SET};
pub use reader::Cnav2Reader;

/// Definition of CNAV-2 for L1C.
pub static CNAV2: Message = Message {
    name: "CNAV-2",
    symbol_s: 0.01,
    bit: |_| &[1],
    unit_s: FRAME_S,
    decided_after: 0,
    // A new ephemeris begins with page 1, after the frame of almanacs.
    set_s: ROUND * FRAME_S,
    first_s: 2 * FRAME_S,
    sender: |common| Ok(Box::new(Frames { common: common.clone(), almanacs: Almanacs::of(common) })),
    number: |start| if is_first(start) { 1 } else { 2 },
    timed: &[1, 2],
    dated: &[],
    set: &[1],
    reduced: &[],
    ionosphere: IonosphereForm { model: Model::Klobuchar, unit: is_first, coefficients: ionosphere },
    fields: &OF_SET,
    parameters: opened,
    reader: |sv| Box::new(Cnav2Reader::new(sv)),
    form,
    sets: &CNAV2_SETS,
    alert: None,
    rinex: Some(Records { set: |_| "CNV2", common: "CNVX", fields: tables, lines: Some(record_lines) }),
};

/// Ephemerides of CNAV-2: those of CNAV with corrections for L1C, and health of L1C alone.
pub static CNAV2_SETS: SetForm = SetForm {
    name: "CNAV-2",
    group_delay_s,
    serves: |signal| signal.carries(&CNAV2) || (CNAV_SETS.serves)(signal),
    given_delay_s: |set| set.tgd_s - set.isc_s[0],
    is_healthy: |set| set.health == 0,
    healthy: |set, signal| signal.carries(&CNAV2).then_some(set.health == 0),
    rinex_sources: None,
};

/// The lines of a record of RINEX; corrections of the data come before those of the pilot.
fn record_lines(set: &Ephemeris, raw: Raw<'_>) -> Vec<RecordLine> {
    modern::of_gps(set, raw, set.health, &[0, 1, 2, 3, 5, 4])
}

/// Seconds of a frame, and of the intervals in which frames are counted.
const FRAME_S: i64 = 18;
const INTERVAL_S: i64 = 7200;
const FRAMES: i64 = INTERVAL_S / FRAME_S;
/// Bits of subframes 2 and 3 with their checks, and of a check.
const BITS_2: usize = 600;
const BITS_3: usize = 274;
/// Symbols of subframe 1, and of a frame.
const SYMBOLS_1: usize = 52;
const SYMBOLS: usize = SYMBOLS_1 + 2 * BITS_2 + 2 * BITS_3;
/// The page that is read.
const PAGE: f64 = 1.0;

static CODE_2: LazyLock<Ldpc> = LazyLock::new(|| Ldpc::packed(BITS_2, include_bytes!("ldpc_2.bin")));
static CODE_3: LazyLock<Ldpc> = LazyLock::new(|| Ldpc::packed(BITS_3, include_bytes!("ldpc_3.bin")));

static FRAME: Subframes = Subframes {
    // Of the eight lower bits (3.2.3.2, figure 3.2-7).
    time: RegisterCode { stages: 8, feedback: 0b1111_1001, symbols: SYMBOLS_1 - 1 },
    has_high_bit: true,
    times: 0..=FRAMES as u32 - 1,
    two: (&CODE_2, BITS_2),
    three: (&CODE_3, BITS_3),
    // Rows of 46 written, columns of 38 sent (3.2.3.5).
    interleaver: Interleaver { columns: 38, rows: 46 },
    is_right: is_checked,
};

/// Content of the frames.
#[derive(Clone, Debug)]
struct Content {
    set: Ephemeris,
    week: f64,
    itow: f64,
    top: f64,
    ned: [f64; 3],
    flag: f64,
    op_week: f64,
    page: f64,
    klobuchar: Klobuchar,
    utc: UtcNumbers,
    toa: Epoch,
    /// Satellites of page 3; the first is that of page 4.
    entries: [Entry; PACKETS],
}

/// Decoded frame with correct checks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame(pub Blocks);

impl Frame {
    /// Seconds of the week at which it began.
    pub fn of_week_s(&self) -> i64 {
        // The count is that of the frame after, the interval that of this one.
        let before = i64::from(self.0.time) + planted!("gnss.cnav2.time", FRAMES - 1, FRAMES);
        (self.0.interval() * INTERVAL_S + before.rem_euclid(FRAMES) * FRAME_S).rem_euclid(WEEK_S)
    }

    /// Start time of the frame, with its week near `near`.
    pub fn sent_at(&self, near: Epoch) -> Epoch {
        Epoch::new(near.nearest_week(self.0.week(), 8192) * WEEK_S + self.of_week_s(), 0.0)
    }

    /// The bits of page 1, if subframe 3 has that.
    fn page_1(&self) -> Option<&Vec<bool>> {
        self.0.three.as_ref().filter(|bits| page(bits) == PAGE)
    }

    /// The number of the satellite's codes that subframe 3 states.
    fn prn(&self) -> Option<u128> {
        self.0.three.as_ref().and_then(|bits| bits.get(..8)).map(number)
    }
}

fn page(bits: &[bool]) -> f64 {
    bits.get(8..14).map_or(0.0, |bits| number(bits) as f64)
}

/// Encodes a frame from a time and from bits with their checks, without interleaving.
pub fn coded(time: u32, two: &[bool], three: &[bool]) -> Vec<bool> {
    FRAME.coded(time, two, three)
}

/// Interleaves the symbols of a frame for transmission.
pub fn interleaved(coded: &[bool]) -> Vec<bool> {
    FRAME.interleaved(coded)
}

/// The frame in 1800 soft symbols, positive for a logical 0, normal or inverted; `None` where its checks
/// fail.
pub fn decode(soft: &[f32]) -> Option<Frame> {
    FRAME.decode(soft).map(Frame)
}

/// Makes the frames of satellites.
struct Frames {
    common: Common,
    almanacs: Almanacs,
}

impl Sender for Frames {
    fn unit(&self, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        CNAV2.check_start(start, "a multiple of 18 s")?;
        let (page, entries) = self.almanacs.page_at(set.sv.system, start);
        let content = Content {
            page,
            entries,
            toa: self.almanacs.toa,
            week: start.week().rem_euclid(8192) as f64,
            itow: (start.tow_whole_s() / INTERVAL_S) as f64,
            // Predicted for the reference time itself.
            top: set.toe.tow_s() / STEP_S as f64,
            op_week: set.toe.week().rem_euclid(256) as f64,
            klobuchar: self.common.klobuchar.unwrap_or(Klobuchar::ZERO),
            utc: UtcNumbers::of(&self.common, start, &GPST, (0, 1)),
            ..blank(set.clone())
        };
        let two = checked(&[&SET], &content, BITS_2)?;
        let three = checked(&of_page(page), &content, BITS_3)?;
        let time = (start.tow_whole_s() / FRAME_S + 1) % FRAMES;
        Ok(interleaved(&coded(time as u32, &two, &three)))
    }
}

/// The tables of a page of subframe 3.
fn of_page(page: f64) -> Vec<&'static [Element<Content>]> {
    let header: &[Element<Content>] = &HEADER;
    let rest: &[&[Element<Content>]] = match page {
        REDUCED => &OF_REDUCED,
        MEDIUM => &OF_MEDIUM,
        _ => &[&OF_UTC, &DELAY],
    };
    [&[header], rest].concat()
}

/// The ephemeris as CNAV-2 has it.
fn form(set: &Ephemeris) -> Ephemeris {
    if *set.form == CNAV2_SETS {
        return set.clone();
    }
    let civil = cnav::form(set);
    let delay_s = |code| cnav::delay_s(set, code, cnav::L1_HZ);
    let [l1ca_s, l2c_s, i5_s, q5_s, ..] = civil.isc_s;
    let isc_s = [l1ca_s, l2c_s, i5_s, q5_s, civil.tgd_s - delay_s("1L"), civil.tgd_s - delay_s("1S")];
    Ephemeris { form: &CNAV2_SETS, health: u16::from(civil.health != 0), isc_s, ..civil }
}

/// T_GD less the correction of the signal, in seconds (3.5.3.9.1); of L1C that of the pilot, which receivers
/// follow.
fn group_delay_s(set: &Ephemeris, signal: &Signal) -> f64 {
    if signal.carries(&CNAV2) {
        set.tgd_s - planted!("gnss.cnav2.isc", set.isc_s[4], set.isc_s[5])
    } else {
        (CNAV_SETS.group_delay_s)(set, signal)
    }
}

/// Parameters by which ephemerides are distinguished, that are no ephemeris's, or that all satellites state
/// alike, are fixed.
static OF_SET: SetTables<Content, Vec<bool>> = SetTables {
    passing: &["week", "itow_2h"],
    fixed: &[
        &[
            "week",
            "itow_2h",
            "toe_5min",
            "top_5min",
            "op_week",
            "l1c_health",
            "integrity_flag",
            "ura_ned0_index",
            "ura_ned1_index",
            "ura_ned2_index",
        ],
        &Klobuchar::PARAMETERS,
    ],
    quantised: |own, set| own.rounded(form(set)),
    ..SetTables::of(&CNAV2_SETS, &[&SET, &DELAY], || vec![false; BITS_2], (blank, |content| content.set))
};

/// The raw integers of the ephemeris in subframe 2.
fn of_two(two: &Vec<bool>) -> Parameters {
    let mut found = integers(&SET, two);
    found.retain(|(name, _)| !OF_SET.passing.contains(name));
    found
}

/// Raw integers of the ephemeris in subframe 2, together with those in page 1.
fn of_set_in(two: &Vec<bool>, page_1: &Vec<bool>) -> Parameters {
    let mut found = of_two(two);
    found.extend(integers(&DELAY, page_1));
    found
}

/// The parameters of a unit's symbols: of subframe 2, and of page 1 where that is there.
fn opened(symbols: &[bool]) -> Option<(bool, Parameters)> {
    let frame = decode(&soft(symbols))?;
    let mut found = of_two(&frame.0.two);
    if let Some(page_1) = frame.page_1() {
        found.extend(integers(&DELAY, page_1));
        found.extend(integers(&OF_UTC, page_1));
    }
    Some((true, found))
}

/// Creates content in which nothing has been decoded.
fn blank(set: Ephemeris) -> Content {
    Content {
        set: Ephemeris { form: &CNAV2_SETS, ..set },
        week: 0.0,
        itow: 0.0,
        top: 0.0,
        ned: [0.0; 3],
        flag: 0.0,
        op_week: 0.0,
        page: PAGE,
        klobuchar: Klobuchar::ZERO,
        utc: UtcNumbers::default(),
        toa: Epoch::new(0, 0.0),
        entries: [Entry::empty(); PACKETS],
    }
}

/// Content in which everything is blank, for a placeholder satellite.
fn nothing() -> Content {
    blank(Ephemeris::blank(Sv::gps(1), Epoch::new(0, 0.0)))
}

/// The coefficients of the ionosphere that raw integers of page 1 give.
fn ionosphere(raw: Raw<'_>) -> Option<Coefficients> {
    Klobuchar::named(|name| OF_SET.value(name, raw)).map(Coefficients::Klobuchar)
}

/// The coefficients in the bits of page 1.
fn klobuchar(page_1: &Vec<bool>) -> Klobuchar {
    let mut content = nothing();
    read_all(&DELAY, page_1, &mut content);
    content.klobuchar
}

#[cfg(test)]
mod tests;
