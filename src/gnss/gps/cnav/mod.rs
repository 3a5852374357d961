//! The civil navigation message (CNAV): messages of six seconds on L5 and of twelve on L2C, encoded and
//! decoded.
//!
//! Source: IS-GPS-705J, 20.3, and IS-GPS-200N, 30.3, of L2C the same bits at half the rate ([`CNAV_L2C`]). A
//! message is 300 bits with their check, coded without a break from one to the next ([`Convolutional`]). Sent
//! are messages 10 and 11 (orbit), 30 (clock, group delays, ionosphere) and 33 (clock, UTC) in turn. Limits:
//! no almanacs, no offsets of other systems, no Earth orientation, no corrections; of UTC nothing is used. A
//! ephemeris of LNAV is carried to the nearest reference time that CNAV can express, and to its steps, by
//! which the orbit differs by 3 cm (`tests/witness`). T_GD and the corrections between signals are those that
//! a file has of the satellite's own CNAV; without them the one delay of LNAV gives all, as delays that are
//! as 1/f². L1 C/A is sent with the delay of LNAV, its own message, so that its correction here is what T_GD
//! of both messages leave. A signal is sent with the delay of its pilot; the correction of I5 is the
//! satellite's, and who follows I5 alone meets what real satellites have between the two. Health is that of
//! all signals, where real satellites call L5 unhealthy until it is declared operational.

mod fields;
mod on_l2c;
mod reader;

use crate::bits::{Element, FieldError, integers, number, read_all, soft};
use crate::broadcast::{Ephemeris, GPS_CLOCK_CODE, SetForm};
use crate::crc::{self, CHECK_BITS, is_checked};
use crate::exchange::modern;
use crate::fec::convolutional::Convolutional;
use crate::fec::running::MARGIN;
use crate::gps::lnav::LNAV;
use crate::ionosphere::{Coefficients, Model};
use crate::klobuchar::Klobuchar;
use crate::message::{Common, IonosphereForm, Message, Parameters, Raw, RecordLine, Records, Sender, UtcNumbers};
use crate::satellite::Sv;
use crate::set_tables::SetTables;
use crate::signal::Signal;
use crate::time::{Epoch, GPST};
pub use fields::tables;
use fields::{CLOCKS, DELAY, HEADER, ORBIT_1, ORBIT_2, TIME};
pub(super) use fields::{L1, L2, L5, REFERENCE_NODE_RADPS, STEP_S, reference_axis_m};
pub use on_l2c::CNAV_L2C;
pub use reader::CnavReader;

/// Definition of CNAV for L5.
pub static CNAV: Message = Message {
    name: "CNAV",
    symbol_s: 0.01,
    bit: |_| &[1],
    unit_s: MESSAGE_S,
    decided_after: MARGIN,
    set_s: MESSAGE_S,
    first_s: 0,
    sender: |common| Ok(sender(common, &CNAV)),
    number: |start| type_at(&CNAV, start),
    timed: &ORDER,
    dated: &[],
    set: &[10, 11, 30],
    reduced: &[],
    ionosphere: IonosphereForm {
        model: Model::Klobuchar,
        unit: |start| type_at(&CNAV, start) == IONOSPHERE,
        coefficients: ionosphere,
    },
    fields: &OF_SET,
    parameters: opened,
    reader: |sv| Box::new(CnavReader::of(&CNAV, sv)),
    form,
    sets: &CNAV_SETS,
    alert: None,
    rinex: Some(Records { set: |_| "CNAV", common: "CNVX", fields: tables, lines: Some(record_lines) }),
};

/// Ephemerides of CNAV: a correction for each signal beside the group delay, and a bit of health for each
/// carrier.
pub static CNAV_SETS: SetForm = SetForm {
    name: "CNAV",
    group_delay_s,
    serves: |signal| [&CNAV, &CNAV_L2C, &LNAV].iter().any(|message| signal.carries(message)),
    given_delay_s: |set| set.tgd_s - set.isc_s[0],
    is_healthy: |set| set.health & L1 == 0,
    healthy: |set, signal| {
        let bit = match signal.centre_hz() {
            hz if hz < BETWEEN_L5_L2_HZ => L5,
            hz if hz < BETWEEN_L2_L1_HZ => L2,
            _ => L1,
        };
        Some(set.health & bit == 0)
    },
    rinex_sources: None,
};

/// The lines of a record of RINEX, where health has L1 in the highest of three bits.
fn record_lines(set: &Ephemeris, raw: Raw<'_>) -> Vec<RecordLine> {
    let bit = |carrier: u16, place: u16| u16::from(set.health & carrier > 0) << place;
    modern::of_gps(set, raw, bit(L1, 2) | bit(L2, 1) | bit(L5, 0), &[0, 1, 2, 3])
}

/// Seconds of a message on L5; counts of time are in these on L2C too (IS-GPS-200N, 30.3.3).
const MESSAGE_S: i64 = 6;
/// The messages in the order in which satellites send them, and that of the ionosphere.
const ORDER: [u8; 4] = [10, 11, 30, 33];
const IONOSPHERE: u8 = 30;
/// Bits of a message without and with its check.
const DATA_BITS: usize = 276;
const BITS: usize = DATA_BITS + CHECK_BITS;
const PREAMBLE: f64 = 139.0;
/// Bits of the message before that the code remembers.
const MEMORY_BITS: usize = 6;
const BETWEEN_L5_L2_HZ: f64 = 1_200e6;
const BETWEEN_L2_L1_HZ: f64 = 1_400e6;

const CODE: Convolutional = Convolutional { second_inverted: false };

/// Content of all messages together.
#[derive(Clone, Debug)]
struct Content {
    set: Ephemeris,
    preamble: f64,
    kind: f64,
    tow_count: f64,
    alert: f64,
    week: f64,
    top: f64,
    ned: [f64; 3],
    flags: f64,
    op_week: f64,
    klobuchar: Klobuchar,
    utc: UtcNumbers,
}

/// The parameters of a unit's symbols; every message has some of an ephemeris.
fn opened(symbols: &[bool]) -> Option<(bool, Parameters)> {
    let bits = checked(CODE.decode_open(&soft(symbols)))?;
    parameters(&bits).map(|found| (true, found))
}

/// Type of the message that begins at a time.
pub fn type_at(message: &Message, start: Epoch) -> u8 {
    let turn = start.tow_whole_s().div_euclid(planted!("gnss.cnav.l2c_order", message.unit_s, MESSAGE_S))
        + planted!("gnss.cnav.order", 0, 1);
    ORDER.get(turn.rem_euclid(4) as usize).copied().unwrap_or(10)
}

/// The ephemeris as CNAV has it: carried to the nearest multiple of 300 s, with the corrections between
/// signals that the ephemeris has of it, or that agree with the one delay of LNAV, whose delays are as 1/f².
pub(super) fn form(set: &Ephemeris) -> Ephemeris {
    if *set.form == CNAV_SETS {
        return set.clone();
    }
    let toe_s = (set.toe.seconds() as f64 / STEP_S as f64).round() as i64 * STEP_S;
    let toe = Epoch::new(toe_s, 0.0);
    let issue = (toe.tow_whole_s() / STEP_S) as u16;
    let tgd_s = set.delay_of_code_s(GPS_CLOCK_CODE).unwrap_or(set.tgd_s);
    let isc_s = |code: &str, hz: f64| tgd_s - delay_s(set, code, hz);
    Ephemeris {
        form: &CNAV_SETS,
        iode: issue,
        iodc: issue,
        health: if set.health == 0 { 0 } else { L1 | L2 | L5 },
        tgd_s,
        isc_s: [tgd_s - set.tgd_s, isc_s("2L", L2_HZ), isc_s("5I", L5_HZ), isc_s("5Q", L5_HZ), 0.0, 0.0],
        signal_delays_s: Vec::new(),
        ..set.carried_to(toe)
    }
}

/// The delay of a code in an ephemeris of LNAV: its own, or T_GD as 1/f².
pub(super) fn delay_s(set: &Ephemeris, code: &str, hz: f64) -> f64 {
    let ratio = L1_HZ / hz;
    set.delay_of_code_s(code).unwrap_or(set.tgd_s * ratio * ratio)
}

pub(super) const L1_HZ: f64 = 1_575.42e6;
const L2_HZ: f64 = 1_227.60e6;
const L5_HZ: f64 = 1_176.45e6;

/// T_GD less the correction of the signal, in seconds (20.3.3.3.1.1.1); of L5 that of the pilot, which
/// receivers follow.
fn group_delay_s(set: &Ephemeris, signal: &Signal) -> f64 {
    let [l1ca_s, l2c_s, _, l5q_s, ..] = set.isc_s;
    let own_s = match signal.centre_hz() {
        hz if hz < BETWEEN_L5_L2_HZ => l5q_s,
        hz if hz < BETWEEN_L2_L1_HZ => l2c_s,
        _ => l1ca_s,
    };
    set.tgd_s - planted!("gnss.cnav.isc", own_s, -own_s)
}

/// A sender of one of the messages that are sent as CNAV.
pub(crate) fn sender(common: &Common, message: &'static Message) -> Box<dyn Sender> {
    Box::new(Messages { common: common.clone(), message })
}

/// Makes the messages of satellites.
struct Messages {
    common: Common,
    message: &'static Message,
}

impl Sender for Messages {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        self.unit_after(ephemeris, ephemeris, start)
    }

    fn unit_after(&self, before: &Ephemeris, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        self.message.check_start(start, "the beginning of a message")?;
        let past = self.message(before, start.plus_s(-self.message.unit_s as f64))?;
        let memory = past.get(BITS - MEMORY_BITS..).unwrap_or_default();
        Ok(encode(memory, &self.message(set, start)?))
    }
}

impl Messages {
    /// The 300 bits of the message that begins at `start`.
    fn message(&self, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        let kind = type_at(self.message, start);
        let next = start.plus_s(self.message.unit_s as f64);
        let content = Content {
            preamble: PREAMBLE,
            kind: f64::from(kind),
            tow_count: (next.tow_whole_s() / MESSAGE_S) as f64,
            week: start.week().rem_euclid(8192) as f64,
            // Predicted for the reference time itself.
            top: set.toe.tow_s() / STEP_S as f64,
            op_week: set.toe.week().rem_euclid(256) as f64,
            klobuchar: self.common.klobuchar.unwrap_or(Klobuchar::ZERO),
            utc: UtcNumbers::of(&self.common, start, &GPST, (0, 1)),
            ..blank(set.clone())
        };
        crc::checked(&of_type(kind), &content, BITS)
    }
}

/// The tables of a message; none for a type that is not read.
fn of_type(kind: u8) -> Vec<&'static [Element<Content>]> {
    match kind {
        10 => vec![&HEADER, &ORBIT_1],
        11 => vec![&HEADER, &ORBIT_2],
        30 => vec![&HEADER, &CLOCKS, &DELAY],
        33 => vec![&HEADER, &CLOCKS, &TIME],
        _ => Vec::new(),
    }
}

/// The symbols of a message after the last bits of the one before.
pub fn encode(memory: &[bool], message: &[bool]) -> Vec<bool> {
    let all: Vec<bool> = memory.iter().chain(message).copied().collect();
    CODE.encode(&all).split_off(2 * memory.len())
}

/// The bits of a message if their check is right.
pub fn checked(bits: Vec<bool>) -> Option<Vec<bool>> {
    is_message(&bits).then_some(bits)
}

/// True if bits form a message: the preamble and the check over all bits are right.
fn is_message(bits: &[bool]) -> bool {
    let begins = bits.get(..8).is_some_and(|begin| number(begin) as f64 == PREAMBLE);
    begins && bits.len() == BITS && is_checked(bits)
}

/// Type of a message, as it states it.
pub fn message_type(bits: &[bool]) -> u8 {
    bits.get(14..20).map_or(0, |bits| number(bits) as u8)
}

/// Parameters that are of the message and not of the ephemeris.
const PASSING: [&str; 5] = ["preamble", "prn", "type", "tow_count", "alert"];

/// The raw integers of a message but those of its header; `None` for types that are not read.
pub fn parameters(bits: &Vec<bool>) -> Option<Parameters> {
    let tables = of_type(message_type(bits));
    let mut found: Parameters = tables.iter().flat_map(|table| integers(table, bits)).collect();
    found.retain(|(name, _)| !PASSING.contains(name));
    (!found.is_empty()).then_some(found)
}

/// Parameters by which ephemerides are distinguished, that are no ephemeris's, or that all satellites state
/// alike, are fixed.
static OF_SET: SetTables<Content, Vec<bool>> = SetTables {
    fixed: &[
        &[
            "week",
            "toe_5min",
            "top_5min",
            "op_week",
            "integrity_flags",
            "toc_5min",
            "ura_ned0_index",
            "ura_ned1_index",
            "ura_ned2_index",
        ],
        &Klobuchar::PARAMETERS,
    ],
    quantised: |own, set| own.rounded(form(set)),
    ..SetTables::of(
        &CNAV_SETS,
        &[&ORBIT_1, &ORBIT_2, &CLOCKS, &DELAY],
        || vec![false; DATA_BITS],
        (blank, |content| content.set),
    )
};

/// Creates content in which nothing has been decoded.
fn blank(set: Ephemeris) -> Content {
    Content {
        set: Ephemeris { form: &CNAV_SETS, ..set },
        preamble: PREAMBLE,
        kind: 0.0,
        tow_count: 0.0,
        alert: 0.0,
        week: 0.0,
        top: 0.0,
        ned: [0.0; 3],
        flags: 0.0,
        op_week: 0.0,
        klobuchar: Klobuchar::ZERO,
        utc: UtcNumbers::default(),
    }
}

/// The coefficients of the ionosphere that raw integers of message 30 give.
fn ionosphere(raw: Raw<'_>) -> Option<Coefficients> {
    Klobuchar::named(|name| OF_SET.value(name, raw)).map(Coefficients::Klobuchar)
}

/// The ephemeris in messages 10, 11 and 30 of the same reference time, the first sent at `sent`; `None` where
/// they do not belong together or name another satellite.
fn elements(sv: Sv, messages: [&Vec<bool>; 3], sent: Epoch) -> Option<Ephemeris> {
    let mut content = blank(Ephemeris::blank(sv, sent));
    let mut toes = Vec::new();
    for bits in messages {
        let tables = of_type(message_type(bits));
        let prn = number(bits.get(8..14)?);
        if prn != u128::from(sv.number) {
            return None;
        }
        tables.iter().for_each(|table| read_all(table, bits, &mut content));
        let reference = if message_type(bits) == 30 { content.set.toc } else { content.set.toe };
        toes.push(reference);
    }
    toes.windows(2).all(|pair| pair.first() == pair.last()).then_some(content.set)
}
