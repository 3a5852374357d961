//! NavIC's message on L1: frames of eighteen seconds, encoded and decoded.
//!
//! Source: NavIC SPS ICD for L1 1.0 (ISRO, August 2023), which was not at hand itself: positions and lengths
//! as the open decoder `cssrlib` 1.2.1 (MIT) reads them, frame, codes and times as `PocketSDR` (BSD 2-clause)
//! does. A frame is that of CNAV-2 with matrices of its own ([`Subframes`], `ldpc_2.bin`, `ldpc_3.bin`):
//! subframe 1, the count of frames in two hours, 1 to 400, at the end of this one; subframe 2, orbit and
//! clock in 600 bits; subframe 3, one of several messages in 274. What a real record shows beside is in
//! `tests/witness`.
//!
//! Sent and read is message type 10 (ionosphere) alone in subframe 3, type 0 where no coefficients are known,
//! for the document leaves the order open. Limits: the Earth's orientation in type 10 is zeros; types 5
//! (grid), 6 (almanac), 8 (NeQuick-N) and 17 (times of other systems, UTC) are not sent and not read.
//! Coefficients are taken as those of L5, as in the other message ([`super::nav`]), and for all positions,
//! not only those of their region. An ephemeris of that message is carried to the nearest five minutes; its
//! clock stays that of S and L5, and the correction of L1 makes of its one group delay what goes with 1/f².

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
use crate::ionosphere::{Coefficients, Model};
use crate::klobuchar::Klobuchar;
use crate::message::{Common, IonosphereForm, Message, Parameters, Raw, RecordLine, Records, Sender};
use crate::navic::l1::L1;
use crate::navic::nav::NAVIC_WEEK;
use crate::navic::sps::L5;
use crate::satellite::Sv;
use crate::set_tables::SetTables;
use crate::signal::Signal;
use crate::time::{Epoch, WEEK_S};
pub use fields::tables;
use fields::{HEADER, IONOSPHERE, SET, STEP_S};
pub use reader::L1NavReader;

/// Definition of NavIC's message on L1.
pub static L1_NAV: Message = Message {
    name: "L1 NAV",
    symbol_s: 0.01,
    bit: |_| &[1],
    unit_s: FRAME_S,
    decided_after: 0,
    set_s: FRAME_S,
    first_s: 0,
    sender: |common| Ok(Box::new(Frames(common.clone()))),
    number: |_| 1,
    timed: &[1],
    dated: &[],
    set: &[1],
    reduced: &[],
    ionosphere: IonosphereForm { model: Model::KlobucharNavic, unit: |_| true, coefficients: ionosphere },
    fields: &OF_SET,
    parameters: opened,
    reader: |sv| Box::new(L1NavReader::new(sv)),
    form,
    sets: &L1_NAV_SETS,
    alert: None,
    rinex: Some(Records { set: |_| "L1NV", common: "L1NV KLOB", fields: tables, lines: Some(record_lines) }),
};

/// Ephemerides of this message: health of L1 alone, and a clock of two carriers that a flag names.
pub static L1_NAV_SETS: SetForm = SetForm {
    name: "L1 NAV",
    group_delay_s,
    serves: |_| true,
    given_delay_s: |set| set.tgd_s,
    is_healthy: |set| set.health == 0,
    healthy: |set, signal| signal.carries(&L1_NAV).then_some(set.health == 0),
    rinex_sources: None,
};

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
/// Message types of subframe 3.
const NOTHING: f64 = 0.0;
const ELECTRONS: f64 = 10.0;
/// The region of real coefficients: 50° to 110° East, 0° to 50° North, in steps of five degrees (RINEX 4.02,
/// table A41).
const REGION_5DEG: [f64; 4] = [10.0, 22.0, 0.0, 10.0];

static CODE_2: LazyLock<Ldpc> = LazyLock::new(|| Ldpc::packed(BITS_2, include_bytes!("ldpc_2.bin")));
static CODE_3: LazyLock<Ldpc> = LazyLock::new(|| Ldpc::packed(BITS_3, include_bytes!("ldpc_3.bin")));

static FRAME: Subframes = Subframes {
    // BCH(52,9) of least distance 20.
    time: RegisterCode { stages: 9, feedback: 0b1_1111_1011, symbols: SYMBOLS_1 },
    has_high_bit: false,
    times: 1..=FRAMES as u32,
    two: (&CODE_2, BITS_2),
    three: (&CODE_3, BITS_3),
    interleaver: Interleaver { columns: 38, rows: 46 },
    is_right: is_checked,
};

/// Content of the frames.
#[derive(Clone, Debug)]
struct Content {
    set: Ephemeris,
    week: f64,
    itow: f64,
    alert: f64,
    kind: f64,
    invalid: f64,
    klobuchar: Klobuchar,
    /// Western, eastern, southern and northern border.
    region_5deg: [f64; 4],
    iodk: f64,
}

/// Decoded frame with correct checks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame(pub Blocks);

impl Frame {
    /// Seconds of the week at which it began.
    pub fn of_week_s(&self) -> i64 {
        let before = i64::from(self.0.time) - planted!("gnss.navic.l1_time", 1, 0);
        (self.0.interval() * INTERVAL_S + before * FRAME_S).rem_euclid(WEEK_S)
    }

    /// Start time of the frame, with its week near `near`.
    pub fn sent_at(&self, near: Epoch) -> Epoch {
        Epoch::new(near.nearest_week(self.0.week() + NAVIC_WEEK, 8192) * WEEK_S + self.of_week_s(), 0.0)
    }

    /// The bits of message type 10, if subframe 3 is that.
    fn electrons(&self) -> Option<&Vec<bool>> {
        self.0.three.as_ref().filter(|bits| bits.get(..7).map(number) == Some(2 * ELECTRONS as u128))
    }

    /// The satellite's number.
    fn prn(&self) -> Option<u128> {
        self.0.two.get(570..576).map(number)
    }
}

/// The frame in 1800 soft symbols, positive for a logical 0, normal or inverted; `None` where its checks
/// fail.
pub fn decode(soft: &[f32]) -> Option<Frame> {
    FRAME.decode(soft).map(Frame)
}

/// Encodes a frame to symbols as they are sent, from its count and from bits with their checks.
pub fn sent(time: u32, two: &[bool], three: &[bool]) -> Vec<bool> {
    FRAME.interleaved(&FRAME.coded(time, two, three))
}

/// Makes the frames of satellites.
struct Frames(Common);

impl Sender for Frames {
    fn unit(&self, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        L1_NAV.check_start(start, "a multiple of 18 s")?;
        let known = self.0.klobuchar_navic;
        let content = Content {
            week: (start.week() - NAVIC_WEEK).rem_euclid(8192) as f64,
            itow: (start.tow_whole_s() / INTERVAL_S) as f64,
            kind: if known.is_some() { ELECTRONS } else { NOTHING },
            klobuchar: known.unwrap_or(Klobuchar::ZERO),
            region_5deg: REGION_5DEG,
            ..blank(set.clone())
        };
        let two = checked(&[&SET], &content, BITS_2)?;
        let tables: &[&[Element<Content>]] = if known.is_some() { &[&HEADER, &IONOSPHERE] } else { &[&HEADER] };
        let three = checked(tables, &content, BITS_3)?;
        let time = start.tow_whole_s() / FRAME_S % FRAMES + 1;
        Ok(sent(time as u32, &two, &three))
    }
}

/// The ephemeris as this message has it.
fn form(set: &Ephemeris) -> Ephemeris {
    if *set.form == L1_NAV_SETS {
        return set.clone();
    }
    let toe_s = (set.toe.seconds() as f64 / STEP_S as f64).round() as i64 * STEP_S;
    let issue = set.iode % 16;
    let correction_s = set.tgd_s - set.group_delay_s(&L1);
    Ephemeris {
        form: &L1_NAV_SETS,
        iode: issue,
        iodc: issue,
        health: u16::from(set.health != 0),
        isc_s: [0.0, 0.0, 0.0, 0.0, correction_s, correction_s],
        reference_flag: 1,
        ..set.carried_to(Epoch::new(toe_s, 0.0))
    }
}

/// Group delay in seconds of a signal relative to the ephemeris clock. The carrier that shares the clock with
/// L5 has the transmitted delay, and L5 has this delay scaled to its carrier. The remaining carrier has the
/// delay less its correction. On L1 the correction is that of the pilot, which receivers track.
fn group_delay_s(set: &Ephemeris, signal: &Signal) -> f64 {
    let (shares, other_hz) = match set.reference_flag {
        0 => (signal.carries(&L1_NAV), L1.centre_hz()),
        _ => (!signal.carries(&L1_NAV), super::sps::S.centre_hz()),
    };
    if signal.centre_hz() == L5.centre_hz() {
        let ratio = other_hz / L5.centre_hz();
        return set.tgd_s * ratio * ratio;
    }
    let correction_s = planted!("gnss.navic.isc", set.isc_s[4], -set.isc_s[4]);
    if shares { set.tgd_s } else { set.tgd_s - correction_s }
}

/// Parameters by which ephemerides are distinguished, or that have a fault of their own, are fixed.
static OF_SET: SetTables<Content, Vec<bool>> = SetTables {
    passing: &["week", "itow_2h", "alert", "prn"],
    fixed: &[&["week", "itow_2h", "alert", "prn", "toe_5min", "iodec", "l1_health", "reference_flag"]],
    quantised: |own, set| own.rounded(form(set)),
    ..SetTables::of(&L1_NAV_SETS, &[&SET], || vec![false; BITS_2], (blank, |content| content.set))
};

/// The raw integers of the ephemeris in subframe 2.
fn of_set_in(two: &Vec<bool>) -> Parameters {
    let mut found = integers(&SET, two);
    found.retain(|(name, _)| !OF_SET.passing.contains(name));
    found
}

/// The raw integers of message type 10.
fn of_electrons_in(three: &Vec<bool>) -> Parameters {
    integers(&IONOSPHERE, three)
}

/// The parameters of a unit's symbols.
fn opened(symbols: &[bool]) -> Option<(bool, Parameters)> {
    let frame = decode(&soft(symbols))?;
    let mut found = of_set_in(&frame.0.two);
    found.extend(frame.electrons().map(of_electrons_in).unwrap_or_default());
    Some((true, found))
}

/// Creates content in which nothing has been decoded.
fn blank(set: Ephemeris) -> Content {
    Content {
        set: Ephemeris { form: &L1_NAV_SETS, ..set },
        week: 0.0,
        itow: 0.0,
        alert: 0.0,
        kind: NOTHING,
        invalid: 0.0,
        klobuchar: Klobuchar::ZERO,
        region_5deg: [0.0; 4],
        iodk: 0.0,
    }
}

/// The coefficients of the ionosphere that raw integers of message type 10 give.
fn ionosphere(raw: Raw<'_>) -> Option<Coefficients> {
    let mut bits = vec![false; BITS_3];
    let coefficients = IONOSPHERE.iter().map(|element| &element.field).take(8);
    for field in coefficients {
        field.write(&mut bits, raw(field.name)?);
    }
    Some(coefficients_in(&bits))
}

/// The coefficients in the bits of message type 10.
fn coefficients_in(three: &Vec<bool>) -> Coefficients {
    let mut content = blank(Ephemeris::blank(Sv::gps(1), Epoch::new(0, 0.0)));
    read_all(&IONOSPHERE, three, &mut content);
    Coefficients::KlobucharNavic(content.klobuchar)
}

/// The lines of a record (RINEX 4.02, table A32): of the two pairs of carriers that the clock may be of, the
/// delays of the other one are blank.
fn record_lines(set: &Ephemeris, raw: Raw<'_>) -> Vec<RecordLine> {
    let mut lines = modern::orbit(set, Some(f64::from(set.iode)));
    let flag = f64::from(set.reference_flag);
    lines.push([Some(set.idot_radps), Some(set.delta_n_rate_radps2), None, Some(flag)]);
    // Five bits, of which the highest is the sign.
    let accuracy = raw("ura_index").map(|raw| if raw >= 16 { raw - 32 } else { raw } as f64);
    let health = Some(f64::from(set.health));
    let [first, second] = [Some(set.isc_s[4]), Some(set.isc_s[5])];
    match set.reference_flag {
        0 => lines.extend([[accuracy, health, Some(set.tgd_s), None], [first, second, None, None]]),
        _ => lines.extend([[accuracy, health, None, Some(set.tgd_s)], [None, None, first, second]]),
    }
    lines.push([Some(modern::transmitted_s(set)), None, None, None]);
    lines
}

#[cfg(test)]
mod tests;
