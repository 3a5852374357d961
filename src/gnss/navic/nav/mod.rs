//! NavIC's message on L5 and S: subframes of twelve seconds, encoded and decoded.
//!
//! Source: IRNSS SIS ICD for SPS 1.1, data structure. A subframe is a pattern of 16 symbols and 292 bits, the
//! last six of them zeros, coded ([`Convolutional`]) and interleaved ([`Interleaver`]); four of them are a
//! frame. Subframes 1 and 2 carry an ephemeris, subframes 3 and 4 a message each: here 11 (ionosphere)
//! and 26 (UTC) in turn in subframe 3, and 7 (almanac) in subframe 4, for the document leaves their order
//! open. An ephemeris has its issue in subframe 1 alone: what shows that both subframes are of one ephemeris
//! is that their reference times agree, as they do in all real ones that were looked at. Limits: earth
//! orientation is sent as zeros, and so is the second model of type 26, another system's time; types 5
//! (ionosphere by a grid), 9, 14 and 18 are not sent, and not read. Flags of alert and of autonomous
//! navigation are zero.

mod fields;
mod reader;

use crate::bits::{Bits, FieldError, Store, integers, read_all, soft, write_all};
use crate::broadcast::{Ephemeris, PLAIN};
use crate::fec::convolutional::Convolutional;
use crate::fec::interleaver::Interleaver;
use crate::fec::pages::Form;
use crate::ionosphere::{Coefficients, Model};
use crate::klobuchar::Klobuchar;
use crate::message::{Common, IonosphereForm, Message, Records, Sender, raw_of};
use crate::satellite::{Sv, System};
use crate::set_tables::SetTables;
use crate::time::{Epoch, WEEK_S};
use fields::{Almanac, MESSAGE_7, MESSAGE_11, MESSAGE_26, SUBFRAME_1, SUBFRAME_2, Utc};
pub use fields::{DATA_BITS, Subframe, tables};
pub use reader::NavReader;

/// Definition of NavIC's message.
pub static SPS_NAV: Message = Message {
    name: "SPS NAV",
    symbol_s: 0.02,
    bit: |_| &[1],
    unit_s: SUBFRAME_S,
    decided_after: 0,
    // Subframes 1 and 2 have no issue in common: an ephemeris goes on the air with a frame.
    set_s: FRAME_S,
    first_s: 0,
    sender: |common| Ok(Box::new(Subframes { common: common.clone() })),
    number: subframe_at,
    timed: &[1, 2, 3, 4],
    dated: &[],
    set: &[1, 2],
    reduced: &[],
    ionosphere: IonosphereForm {
        model: Model::KlobucharNavic,
        unit: |start| subframe_at(start) == 3 && message_at(start) == ELECTRONS,
        coefficients: |raw| {
            let mut page = blank();
            for field in MESSAGE_11.iter().map(|element| &element.field) {
                field.write(&mut page, raw(field.name)?);
            }
            Some(coefficients(&page))
        },
    },
    fields: &OF_SET,
    parameters: |symbols| {
        let subframe = decode_soft(&soft(symbols))?;
        let found = parameters(&subframe);
        (!found.is_empty()).then(|| (matches!(id(&subframe), 1 | 2), found))
    },
    reader: |sv| Box::new(NavReader::new(sv)),
    form: Ephemeris::clone,
    sets: &PLAIN,
    alert: None,
    rinex: Some(Records { set: |_| "LNAV", common: "LNAV", fields: tables, lines: None }),
};

/// Continuous GPS week of week 0 of NavIC's time, which began on 1999-08-22.
pub const NAVIC_WEEK: i64 = 1024;
/// Seconds of a subframe, and of a frame.
const SUBFRAME_S: i64 = 12;
const FRAME_S: i64 = 48;
/// Subframes of a week: the count of the next one's beginning runs below it.
const TOW_COUNTS: i64 = WEEK_S / SUBFRAME_S;
/// Symbols of the pattern with which a subframe begins, EB90 in hexadecimal, and of a subframe.
const PATTERN: u128 = 0xEB90;
const PATTERN_SYMBOLS: usize = 16;
const SUBFRAME_SYMBOLS: usize = 600;
/// Content of the telemetry word as real satellites send it.
const TELEMETRY: u32 = 0x8B;
/// Message types of subframes 3 and 4.
const NOTHING: u32 = 0;
const ALMANAC: u32 = 7;
const ELECTRONS: u32 = 11;
const UTC: u32 = 26;

/// Positions of the fields that all subframes and all messages have.
const COUNT: (u16, u8) = (8, 17);
const ID: (u16, u8) = (27, 2);
const MESSAGE: (u16, u8) = (30, 6);
const SENDER: (u16, u8) = (256, 6);

const FORM: Form = Form {
    pattern: (PATTERN, PATTERN_SYMBOLS),
    data_bits: DATA_BITS,
    tail_bits: 6,
    code: || Convolutional { second_inverted: false },
    interleaver: Interleaver { columns: 73, rows: 8 },
};

fn blank() -> Subframe {
    Subframe::default()
}

/// Number of the subframe that begins at a time.
fn subframe_at(start: Epoch) -> u8 {
    (start.tow_whole_s() / SUBFRAME_S % 4 + 1) as u8
}

/// Type of the message in subframe 3 or 4 that begins at a time.
fn message_at(start: Epoch) -> u32 {
    let frame = start.tow_whole_s() / FRAME_S;
    match subframe_at(start) {
        3 if frame % 2 == 0 => ELECTRONS,
        3 => UTC,
        _ => ALMANAC,
    }
}

/// Number of a subframe, as it states it.
pub fn id(subframe: &Subframe) -> u8 {
    subframe.piece(ID) as u8 + 1
}

/// Type of the message that a subframe carries; 0 also for subframes 1 and 2.
pub fn message_type(subframe: &Subframe) -> u32 {
    if id(subframe) > 2 { subframe.piece(MESSAGE) } else { NOTHING }
}

/// Seconds of the week at which a subframe began; `None` for a count that no week has.
fn began_s(subframe: &Subframe) -> Option<i64> {
    let count = i64::from(subframe.piece(COUNT));
    let ahead = planted!("gnss.navic.time_read", 1, 0);
    (count < TOW_COUNTS).then(|| (count - ahead).rem_euclid(TOW_COUNTS) * SUBFRAME_S)
}

/// Makes the subframes of satellites.
struct Subframes {
    common: Common,
}

impl Sender for Subframes {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        SPS_NAV.check_start(start, "a multiple of 12 s")?;
        let mut subframe = blank();
        let on_air = Ephemeris { transmitted: start, ..ephemeris.clone() };
        match subframe_at(start) {
            1 => {
                ephemeris.with_one_reference()?;
                write_all(&SUBFRAME_1, &on_air, &mut subframe)?;
            }
            2 => write_all(&SUBFRAME_2, &on_air, &mut subframe)?,
            _ => self.message(&mut subframe, ephemeris.sv, start)?,
        }
        subframe.set_piece((0, 8), TELEMETRY);
        let ahead = planted!("gnss.navic.time_sent", 1, 0);
        subframe.set_piece(COUNT, ((start.tow_whole_s() / SUBFRAME_S + ahead) % TOW_COUNTS) as u32);
        subframe.set_piece(ID, u32::from(subframe_at(start) - 1));
        Ok(encode(&subframe))
    }
}

impl Subframes {
    /// Puts the message of the time into subframe 3 or 4; type 0, which states nothing, where nothing is
    /// known.
    fn message(&self, subframe: &mut Subframe, sender: Sv, start: Epoch) -> Result<(), FieldError> {
        let own: Vec<&Ephemeris> = self.common.almanac.iter().filter(|set| set.sv.system == System::Navic).collect();
        let frame = (start.tow_whole_s() / FRAME_S) as usize;
        let next = own.get(frame % own.len().max(1));
        let kind = match (message_at(start), self.common.klobuchar_navic, next) {
            (ELECTRONS, Some(klobuchar), _) => {
                write_all(&MESSAGE_11, &klobuchar, subframe)?;
                ELECTRONS
            }
            (UTC, ..) => {
                write_all(&MESSAGE_26, &Utc::of(&self.common, start), subframe)?;
                UTC
            }
            (ALMANAC, _, Some(set)) => {
                let reference = self.common.reference.unwrap_or(start);
                write_all(&MESSAGE_7, &Almanac::of(set, reference), subframe)?;
                ALMANAC
            }
            _ => NOTHING,
        };
        subframe.set_piece(MESSAGE, kind);
        subframe.set_piece(SENDER, u32::from(sender.number));
        Ok(())
    }
}

/// The symbols of a subframe, with check and tail.
pub fn encode(subframe: &Subframe) -> Vec<bool> {
    FORM.pattern().chain(FORM.coded(&subframe.0)).collect()
}

/// The subframe in soft symbols not inverted, its pattern among them; `None` where its check fails.
pub fn decode_soft(symbols: &[f32]) -> Option<Subframe> {
    let data = FORM.data(symbols.get(PATTERN_SYMBOLS..SUBFRAME_SYMBOLS)?)?;
    data.try_into().ok().map(Bits)
}

/// The raw integers of all parameters of a subframe; none for messages that are not read.
pub fn parameters(subframe: &Subframe) -> Vec<(&'static str, i64)> {
    match (id(subframe), message_type(subframe)) {
        (1, _) => integers(&SUBFRAME_1, subframe),
        (2, _) => integers(&SUBFRAME_2, subframe),
        (_, ALMANAC) => integers(&MESSAGE_7, subframe),
        (_, ELECTRONS) => integers(&MESSAGE_11, subframe),
        (_, UTC) => integers(&MESSAGE_26, subframe),
        _ => Vec::new(),
    }
}

/// Ionosphere coefficients of message type 11.
fn coefficients(subframe: &Subframe) -> Coefficients {
    let mut found = Klobuchar::ZERO;
    read_all(&MESSAGE_11, subframe, &mut found);
    Coefficients::KlobucharNavic(found)
}

/// Parameters by which ephemerides are distinguished, and the health, which has a fault of its own, are
/// fixed.
static OF_SET: SetTables<Ephemeris, Subframe> = SetTables {
    fixed: &[&["week", "iodec", "toc_s", "toe_s", "health"]],
    elements: |own, sv, raw, near| own.of_integers(sv, raw, near).filter(is_whole),
    quantised: |own, set| own.rounded(set.with_one_reference()?.clone()),
    ..SetTables::of(&PLAIN, &[&SUBFRAME_1, &SUBFRAME_2], blank, (|set| set, |set| set))
};

/// Equal reference times show that subframes 1 and 2 are of one ephemeris.
fn is_whole(set: &Ephemeris) -> bool {
    set.toe == set.toc
}

/// The elements in subframes 1 and 2 with the time at which subframe 1 was sent; `None` where they are not of
/// one ephemeris.
pub fn elements(sv: Sv, one: &Subframe, two: &Subframe, near: Epoch) -> Option<Ephemeris> {
    Some(OF_SET.decoded(sv, [one, two], sent_at(one, near)?)).filter(is_whole)
}

/// Start time of subframe 1 from its own week, which is near `near`.
pub fn sent_at(one: &Subframe, near: Epoch) -> Option<Epoch> {
    let week = raw_of(&integers(&SUBFRAME_1, one), "week")?;
    let week = near.nearest_week(week + NAVIC_WEEK, 1024);
    Some(Epoch::new(week * WEEK_S + began_s(one)?, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_goes_on_the_air_with_a_frame_as_those_of_real_satellites_do() {
        // Transmission times of I02 in a file of 2026-03-09: each is where subframe 1 ends, whose count says
        // it.
        for at_s in [126_540, 127_452] {
            assert_eq!(at_s % FRAME_S, SUBFRAME_S);
        }
        let first = 127_440 / SUBFRAME_S;
        let chosen = [-1, 0, 1, 2, 3, 4].map(|more| SPS_NAV.unit_of_set(first + more));
        assert_eq!(chosen, [first - 4, first, first, first, first, first + 4]);
    }
}
