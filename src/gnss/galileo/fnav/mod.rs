//! The Galileo freely accessible navigation message (F/NAV) of E5a-I: pages of ten seconds, encoded and
//! decoded.
//!
//! Source: Galileo OS SIS ICD 2.1, 4.2 and 5.1. A page is a pattern of twelve symbols and 244 bits, coded
//! ([`Convolutional`]) and interleaved ([`Interleaver`]). Its clock is that of E1 and E5a. Limits: of
//! almanacs nothing is read. Flags of ionospheric storms are zero. Satellites begin their almanacs at
//! positions of their own; here all begin at the same one.
//!
//! [`Convolutional`]: crate::fec::convolutional::Convolutional

mod fields;
mod reader;

use crate::bits::{Element, FieldError, Store, integers, soft, write_all};
use crate::broadcast::{Ephemeris, SetForm};
use crate::fec::interleaver::Interleaver;
use crate::fec::pages::Form;
use crate::galileo::inav::almanac::{Offset, TRIPLES, Triple, offset_of};
use crate::galileo::inav::fields::{FIXED, Orbit, Utc, coefficients};
use crate::galileo::inav::{GST_WEEK, INAV, INAV_E5B, code};
use crate::galileo::status::{self, Band};
use crate::ionosphere::{Coefficients, Model};
use crate::message::{Common, IonosphereForm, Message, Parameters, Raw, Records, Sender};
use crate::satellite::Sv;
use crate::set_tables::SetTables;
use crate::time::{Epoch, TimePolynomial, WEEK_S};
pub use fields::tables;
use fields::{PAGE_1, PAGE_2, PAGE_3, PAGE_4, PAGE_4_GPS, PAGE_4_UTC, PAGE_5, PAGE_6};
pub use reader::FnavReader;

/// Definition of F/NAV.
pub static FNAV: Message = Message {
    name: "F/NAV",
    symbol_s: 0.02,
    bit: |_| &[1],
    unit_s: PAGE_S,
    decided_after: 0,
    set_s: PAGE_S,
    first_s: 0,
    sender: |common| Ok(Box::new(Pages { common: common.clone() })),
    number: page_at,
    timed: &PAGES_OF_SET,
    dated: &[],
    set: &PAGES_OF_SET,
    reduced: &[],
    ionosphere: IonosphereForm { model: Model::NequickG, unit: |start| page_at(start) == 1, coefficients: ionosphere },
    fields: &OF_SET,
    parameters: |symbols| {
        let (page, _) = decode_soft(&soft(symbols))?;
        parameters(&page).map(|found| (true, found))
    },
    reader: |sv| Box::new(FnavReader::new(sv)),
    form: |set| {
        let ahead_s = if *set.form == FNAV_SETS { 0.0 } else { status::fnav_ahead_s(set) };
        Ephemeris { form: &FNAV_SETS, af0_s: set.af0_s + ahead_s, ..set.clone() }
    },
    sets: &FNAV_SETS,
    alert: None,
    rinex: Some(Records { set: |_| "FNAV", common: "IFNV", fields: tables, lines: None }),
};

/// Ephemerides of F/NAV: its clock and its delay are those of E1 and E5a (5.1.5, table 66).
pub static FNAV_SETS: SetForm = SetForm {
    name: "F/NAV",
    group_delay_s: status::against_fnav_s,
    // E5 as one signal needs the delay of its upper side too, which I/NAV alone says.
    serves: |signal| signal.carries(&FNAV) && !signal.carries(&INAV_E5B) || signal.carries(&INAV),
    given_delay_s: |set| set.tgd2_s,
    is_healthy: |set| status::E5A.is_good(set),
    healthy: |set, signal| status::healthy(set, signal, &[Band::E5a]),
    // Of E5a-I, the clock that of E5a and E1 (RINEX 3.05, table A8).
    rinex_sources: Some(258.0),
};

/// Seconds of a page, and of the two sub-frames in which all pages have their positions (4.2.3).
const PAGE_S: i64 = 10;
const SUBFRAME_S: i64 = 50;
const PAIR_S: i64 = 2 * SUBFRAME_S;
/// Symbols of the pattern with which a page begins (4.2.2.1), and of a page.
const PATTERN: (u128, usize) = (0b1011_0111_0000, 12);
const PAGE_SYMBOLS: usize = 500;
/// Bits of a page without its check and the tail of six zeros (4.2.2.2).
const DATA_BITS: usize = 214;
/// The pages of an ephemeris, all of which state their time.
const PAGES_OF_SET: [u8; 4] = [1, 2, 3, 4];

const FORM: Form = Form {
    pattern: PATTERN,
    data_bits: DATA_BITS,
    tail_bits: 6,
    code,
    interleaver: Interleaver { columns: 61, rows: 8 },
};

/// Bits that nobody reads, as satellites sent them in 2025: ones and zeros in turn, by page with the first
/// position and the first bit.
const SPARE: [(u8, usize, bool); 4] = [(1, 188, true), (3, 206, false), (4, 209, false), (6, 211, false)];

/// Type of the page that begins at a time (4.2.3, table 28): pages 5 and 6 alternate from sub-frame to
/// sub-frame.
pub fn page_at(start: Epoch) -> u8 {
    let place = start.tow_whole_s().rem_euclid(PAIR_S) / PAGE_S + planted!("gnss.fnav.page_order", 0, 1);
    match place % 5 {
        4 => 5 + (place / 5 % 2) as u8,
        place => place as u8 + 1,
    }
}

/// Type of a page, as it states it.
pub fn page_type(page: &Vec<bool>) -> u8 {
    page.piece((0, 6)) as u8
}

/// Makes the pages of satellites.
struct Pages {
    common: Common,
}

impl Sender for Pages {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        FNAV.check_start(start, "a multiple of 10 s")?;
        Ok(encode_page(&self.page(page_at(start), ephemeris, start)?))
    }
}

impl Pages {
    /// A page as it leaves at `start`.
    fn page(&self, kind: u8, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        let mut page = vec![false; DATA_BITS];
        page.set_piece((0, 6), u32::from(kind));
        let common = &self.common;
        let on_air = Ephemeris { transmitted: start, ..ephemeris.clone() };
        let orbit = Orbit { ephemeris: on_air, nequick: common.nequick.unwrap_or_default() };
        match kind {
            1 => write_all(&PAGE_1, &orbit, &mut page)?,
            2 => write_all(&PAGE_2, &orbit, &mut page)?,
            3 => write_all(&PAGE_3, &orbit, &mut page)?,
            4 => {
                write_all(&PAGE_4, &orbit, &mut page)?;
                write_all(&PAGE_4_UTC, &Utc::of(common, start), &mut page)?;
                write_all(&PAGE_4_GPS, &Offset(common.galileo), &mut page)?;
            }
            _ => {
                let turn = start.tow_whole_s().div_euclid(PAIR_S).rem_euclid(TRIPLES) as u8;
                let reference = common.reference.unwrap_or(start);
                let triple = Triple::of(turn, &common.almanac, reference, common.galileo);
                let table: &[Element<Triple>] = if kind == 5 { &PAGE_5 } else { &PAGE_6 };
                write_all(table, &triple, &mut page)?;
            }
        }
        for (_, from, first) in SPARE.into_iter().filter(|(of, _, _)| *of == kind) {
            page.iter_mut().skip(from).enumerate().for_each(|(place, bit)| *bit = place.is_multiple_of(2) == first);
        }
        Ok(page)
    }
}

/// The symbols of a page of 214 bits: pattern, then the bits with check and tail, coded and interleaved.
pub fn encode_page(page: &[bool]) -> Vec<bool> {
    FORM.pattern().chain(FORM.coded(page)).collect()
}

/// The 214 bits in the 500 soft symbols of a page, and whether they are inverted; `None` where the check
/// is wrong.
pub fn decode_soft(symbols: &[f32]) -> Option<(Vec<bool>, bool)> {
    FORM.decode(symbols)
}

/// The raw integers of all parameters of a page but its time; `None` for almanacs.
pub fn parameters(page: &Vec<bool>) -> Option<Parameters> {
    let mut found = match page_type(page) {
        1 => integers(&PAGE_1, page),
        2 => integers(&PAGE_2, page),
        3 => integers(&PAGE_3, page),
        4 => [integers(&PAGE_4, page), integers(&PAGE_4_UTC, page), integers(&PAGE_4_GPS, page)].concat(),
        _ => return None,
    };
    found.retain(|(name, _)| *name != "tow_s");
    Some(found)
}

/// Tables of the ephemeris.
static OF_SET: SetTables<Orbit, Vec<bool>> = SetTables {
    passing: &["tow_s"],
    fixed: &[&FIXED],
    ..SetTables::of(
        &FNAV_SETS,
        &[&PAGE_1, &PAGE_2, &PAGE_3, &PAGE_4],
        || vec![false; DATA_BITS],
        (Orbit::of, |orbit| orbit.ephemeris),
    )
};

/// The coefficients of the ionosphere that raw integers of page 1 give.
fn ionosphere(raw: Raw<'_>) -> Option<Coefficients> {
    coefficients(|name| OF_SET.value(name, raw))
}

/// The elements in pages 1 to 4 with the time at which page 1 was sent; `None` where the issues differ or
/// page 1 is another satellite's.
fn elements(sv: Sv, pages: [&Vec<bool>; 4], near: Epoch) -> Option<Ephemeris> {
    let [one, two, three, four] = pages;
    let same = [two, three, four].iter().all(|page| page.piece((6, 10)) == one.piece((12, 10)));
    if !same || one.piece((6, 6)) != u32::from(sv.number) {
        return None;
    }
    Some(OF_SET.decoded(sv, pages, sent_at(one, near)?))
}

/// A page's own week and time of week, the week near `near`; `None` for pages without them.
fn sent_at(page: &Vec<bool>, near: Epoch) -> Option<Epoch> {
    let week = match page_type(page) {
        1 => page.piece((155, 12)),
        2 => page.piece((182, 12)),
        3 => page.piece((174, 12)),
        _ => return None,
    };
    let week = near.nearest_week(i64::from(week) + GST_WEEK, 4096);
    Some(Epoch::new(week * WEEK_S + time_of_week(page)?, 0.0))
}

/// Seconds of the week at which a page began, of pages that state them.
fn time_of_week(page: &Vec<bool>) -> Option<i64> {
    let first = match page_type(page) {
        1 => 167,
        2 => 194,
        3 => 186,
        4 => 189,
        _ => return None,
    };
    Some(i64::from(page.piece((first, 20)))).filter(|tow_s| *tow_s < WEEK_S)
}

/// Offset of the system's time ahead of GPS time, decoded from page 4.
fn gps_offset(page: &Vec<bool>, near: Epoch) -> Option<TimePolynomial> {
    offset_of(PAGE_4_GPS.each_ref().map(|element| (element.field, element.field.read(page))), near)
}
