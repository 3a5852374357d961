//! B-CNAV3, the message of B2b: messages of a second, encoded and decoded.
//!
//! Source: BDS-SIS-ICD-B2b 1.0, 6.2 (structure, code) and 7. A message is 1000 symbols: 16 of a preamble, six
//! of the satellite's number and six reserved ones, then 486 bits with their check, coded over GF(64) by the
//! matrix of 6.2.2, packed in `ldpc.bin`. Sent are messages 10 (orbit) and 30 (clock, group delay,
//! ionosphere, UTC) in turn; the document leaves the order open. Ephemerides have no issue but their
//! reference times, which are those of orbit and clock alike.
//!
//! Limits: those of [`super::bcnav`]; message 30 has zeros for the Earth's orientation and predicted
//! accuracies. Message 40 (almanacs, other systems' times) is neither sent nor read, nor are those of
//! PPP-B2b.

use std::sync::LazyLock;

use crate::beidou::b2b::{B2B, CARRIER_HZ};
use crate::beidou::bcnav::blocks::{self, Of};
use crate::beidou::bcnav::typed::{Layout, Messages, TypedReader};
use crate::beidou::bcnav::{self, OfSet, Tables, record_lines_of_b2b};
use crate::beidou::bcnav1::B_CNAV1;
use crate::beidou::d1d2::issue;
use crate::bits::Kind::{Signed, Whole};
use crate::bits::{Field, plain};
use crate::broadcast::{Ephemeris, SetForm};
use crate::fec::ldpc64::Ldpc64;
use crate::message::{Message, Records};

/// Definition of B-CNAV3 for B2b.
pub static B_CNAV3: Message = Message {
    name: "B-CNAV3",
    symbol_s: 0.001,
    unit_s: MESSAGE_S,
    set_s: MESSAGE_S * ORDER.len() as i64,
    sender: |common| bcnav::check(common).map(|()| Box::new(Messages { layout: &LAYOUT, common: common.clone() }) as _),
    number: |start| LAYOUT.type_at(start),
    timed: &ORDER,
    set: &ORDER,
    ionosphere: bcnav::ionosphere(|start| LAYOUT.type_at(start) == 30),
    fields: &FIELDS,
    parameters: |symbols| LAYOUT.opened(symbols),
    reader: |sv| Box::new(TypedReader::new(&LAYOUT, sv)),
    form,
    sets: &B_CNAV3_SETS,
    rinex: Some(Records { set: |_| "CNV3", common: "CNVX", fields: tables, lines: Some(record_lines_of_b2b) }),
    ..B_CNAV1
};

/// Ephemerides of B-CNAV3: T_GD of B2b in the field of the first group delay; health of the satellite.
pub static B_CNAV3_SETS: SetForm = SetForm {
    name: "B-CNAV3",
    group_delay_s: |set, signal| set.group_delay_on_s(CARRIER_HZ, signal.carrier_hz(set.sv)),
    serves: |signal| signal.carries(&B_CNAV3),
    given_delay_s: |set| set.tgd_s,
    is_healthy: |set| set.health == 0,
    healthy: |set, signal| signal.carries(&B_CNAV3).then_some(set.health == 0),
    rinex_sources: None,
};

/// Seconds of a message, in which time is counted too.
const MESSAGE_S: i64 = 1;
const ORDER: [u8; 2] = [10, 30];
/// Bits of a message with its check.
const BITS: usize = 486;

pub(super) static CODE: LazyLock<Ldpc64> = LazyLock::new(|| Ldpc64::packed(BITS / 6, include_bytes!("ldpc.bin")));

const HEAD: &str = "6.2.1";
const DELAYS: &str = "7.6";

/// Layout of the B-CNAV3 messages.
static LAYOUT: Layout = Layout {
    message: &B_CNAV3,
    preamble: (0xEB90, 16),
    plain: 12,
    bits: BITS,
    code: &CODE,
    number: None,
    kind: Field::new("type", &[(0, 6)], Whole, 0, HEAD),
    second: Field::new("sow_s", &[(6, 20)], Whole, 0, HEAD),
    order: &ORDER,
    tables: &[(10, TEN), (30, THIRTY)],
    set: &ORDER,
    issues: &["toe_5min", "toc_5min"],
    issue_bits: 0x7FF,
    number_of: |fives| issue(300.0 * fives as f64),
    complete: numbered,
};

static FIRST_HALF: [Of; 9] = blocks::first_half::<30>();
static SECOND_HALF: [Of; 10] = blocks::second_half::<233>();
static STATUS: [Of; 2] = [blocks::flags::<455>(), blocks::sismai::<458>()];
static TIME: [Of; 1] = [blocks::week::<26>()];
static ELECTRONS: [Of; 9] = blocks::electrons::<124>();
static CLOCK: [Of; 4] = blocks::clock::<43>();
static DELAY: [Of; 1] = [plain!("tgd_b2bi_s", [(112, 12)], Signed, -34, DELAYS, set.tgd_s)];
static UTC: [Of; 9] = blocks::utc::<198>();
static ACCURACIES: [Of; 4] = blocks::accuracies::<433>();
static ALONG: [Of; 1] = [blocks::accuracy_along::<455>()];
static HEALTH: [Of; 1] = [blocks::health::<460>()];

static TEN: &Tables = &[&FIRST_HALF, &SECOND_HALF, &STATUS];
static THIRTY: &Tables = &[&TIME, &CLOCK, &DELAY, &ELECTRONS, &UTC, &ACCURACIES, &ALONG, &HEALTH];
/// Fields of the messages that carry parameters of an ephemeris.
static SET: &Tables = &[&FIRST_HALF, &SECOND_HALF, &STATUS, &TIME, &CLOCK, &DELAY, &HEALTH];

/// The ephemeris with the number of its reference time, if that is the clock's too.
fn numbered(set: Ephemeris) -> Option<Ephemeris> {
    let issue = issue(set.toe.tow_s());
    (set.toe == set.toc).then_some(Ephemeris { iode: issue, iodc: issue, ..set })
}

/// An ephemeris as B-CNAV3 has it.
fn form(set: &Ephemeris) -> Ephemeris {
    bcnav::carried(set, &B_CNAV3_SETS, &[&B2B], None)
}

/// Tables of the ephemeris.
static FIELDS: OfSet = OfSet {
    elements: |own, sv, raw, near| own.of_integers(sv, raw, near).and_then(numbered),
    ..bcnav::set_tables(&B_CNAV3_SETS, SET, |own, set| bcnav::rounded(own, form(set)))
};

/// The symbols of a satellite's message of 486 bits with their check.
pub fn encode(number: u8, bits: &[bool]) -> Vec<bool> {
    LAYOUT.encode(number, bits)
}

/// The bits of a message in its 1000 soft symbols, positive for a logical 0, and whether they are
/// inverted; `None` where its check fails.
pub fn decode(soft: &[f32]) -> Option<(Vec<bool>, bool)> {
    LAYOUT.decode(soft)
}

/// Lists every field by the message that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    bcnav::fields(&[("message 10", TEN), ("message 30", THIRTY)])
}
