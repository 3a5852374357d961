//! B-CNAV2, the message of B2a: messages of three seconds, encoded and decoded.
//!
//! Source: BDS-SIS-ICD-B2a 1.0, 6.2 (structure, code) and 7. A message is 600 symbols: 24 of a preamble, then
//! 288 bits with their check, coded over GF(64) by the matrix of 6.2.2, packed in `ldpc.bin`. Sent are
//! messages 10 and 11 (orbit), 30 (clock, group delays, ionosphere) and 34 (clock, UTC) in turn; the document
//! leaves the order open. An ephemeris begins with message 10. Message 11 has no mark of its ephemeris: it is
//! of that of the message 10 right before it, or of another message right after it.
//!
//! Limits: those of [`super::bcnav`]; message 30 has zeros for what B2a's data are apart from its pilot.
//! Messages 31, 32, 33 and 40 (almanacs, the Earth's orientation, other systems' times) are neither sent nor
//! read.

use std::sync::LazyLock;

use crate::beidou::b1c::B1C;
use crate::beidou::b2a::B2A;
use crate::beidou::bcnav::blocks::{self, Of};
use crate::beidou::bcnav::typed::{Layout, Messages, TypedReader};
use crate::beidou::bcnav::{self, OfSet, Tables, record_lines};
use crate::beidou::bcnav1::{B_CNAV1, B_CNAV1_SETS};
use crate::bits::Kind::{Signed, Whole};
use crate::bits::{Field, plain};
use crate::broadcast::{Ephemeris, SetForm};
use crate::fec::ldpc64::Ldpc64;
use crate::message::{Message, Records};

/// Definition of B-CNAV2 for B2a.
pub static B_CNAV2: Message = Message {
    name: "B-CNAV2",
    symbol_s: 0.005,
    unit_s: MESSAGE_S,
    set_s: MESSAGE_S * ORDER.len() as i64,
    sender: |common| bcnav::check(common).map(|()| Box::new(Messages { layout: &LAYOUT, common: common.clone() }) as _),
    number: |start| LAYOUT.type_at(start),
    timed: &ORDER,
    set: &OF_SET,
    ionosphere: bcnav::ionosphere(|start| LAYOUT.type_at(start) == 30),
    fields: &FIELDS,
    parameters: |symbols| LAYOUT.opened(symbols),
    reader: |sv| Box::new(TypedReader::new(&LAYOUT, sv)),
    form,
    sets: &B_CNAV2_SETS,
    rinex: Some(Records {
        set: |_| "CNV2",
        common: "CNVX",
        fields: tables,
        lines: Some(|set, raw| record_lines(set, raw, [None, Some(set.isc_s[0]), Some(set.tgd_s), Some(set.tgd2_s)])),
    }),
    ..B_CNAV1
};

/// Ephemerides of B-CNAV2: as those of B-CNAV1.
pub static B_CNAV2_SETS: SetForm = SetForm { name: "B-CNAV2", ..B_CNAV1_SETS };

/// Seconds of a message, in which time is counted too.
const MESSAGE_S: i64 = 3;
const ORDER: [u8; 4] = [10, 11, 30, 34];
const OF_SET: [u8; 3] = [10, 11, 30];
/// Bits of a message with its check.
const BITS: usize = 288;

pub(super) static CODE: LazyLock<Ldpc64> = LazyLock::new(|| Ldpc64::packed(BITS / 6, include_bytes!("ldpc.bin")));

const HEAD: &str = "6.2.1";
const DELAYS: &str = "7.6, table 7-7";

/// Layout of the B-CNAV2 messages.
static LAYOUT: Layout = Layout {
    message: &B_CNAV2,
    preamble: (0xE2_4DE8, 24),
    plain: 0,
    bits: BITS,
    code: &CODE,
    number: Some(Field::new("prn", &[(0, 6)], Whole, 0, HEAD)),
    kind: Field::new("type", &[(6, 6)], Whole, 0, HEAD),
    second: Field::new("sow_3s", &[(12, 18)], Whole, 0, HEAD),
    order: &ORDER,
    tables: &[(10, TEN), (11, ELEVEN), (30, THIRTY), (34, THIRTY_FOUR)],
    set: &OF_SET,
    issues: &["iode", "iodc"],
    // The issue of the orbit is the low bits of the clock's (7.4.1).
    issue_bits: 0xFF,
    number_of: |iode| iode as u16,
    complete: Some,
};

static BEGIN: [Of; 5] = [
    blocks::week::<30>(),
    blocks::flags::<43>(),
    blocks::sismai::<46>(),
    blocks::flags_b1c::<50>(),
    blocks::iode::<53>(),
];
static FIRST_HALF: [Of; 9] = blocks::first_half::<61>();
/// Fields with which all messages except type 10 begin.
static HEADER: [Of; 4] =
    [blocks::health::<30>(), blocks::flags::<32>(), blocks::sismai::<35>(), blocks::flags_b1c::<39>()];
static SECOND_HALF: [Of; 10] = blocks::second_half::<42>();
static ELECTRONS: [Of; 9] = blocks::electrons::<145>();
static CLOCK: [Of; 4] = blocks::clock::<42>();
static DELAY: [Of; 4] = [
    blocks::iodc::<111>(),
    plain!("tgd_b2ap_s", [(121, 12)], Signed, -34, DELAYS, set.tgd2_s),
    plain!("isc_b2ad_s", [(133, 12)], Signed, -34, DELAYS, set.isc_s[0]),
    plain!("tgd_b1cp_s", [(219, 12)], Signed, -34, DELAYS, set.tgd_s),
];
static ACCURACIES_34: [Of; 4] = blocks::accuracies::<42>();
static CLOCK_34: [Of; 4] = blocks::clock::<64>();
static ISSUE_34: [Of; 1] = [blocks::iodc::<133>()];
static UTC: [Of; 9] = blocks::utc::<143>();

static TEN: &Tables = &[&BEGIN, &FIRST_HALF];
static ELEVEN: &Tables = &[&HEADER, &SECOND_HALF];
static THIRTY: &Tables = &[&HEADER, &CLOCK, &DELAY, &ELECTRONS];
static THIRTY_FOUR: &Tables = &[&HEADER, &ACCURACIES_34, &CLOCK_34, &ISSUE_34, &UTC];
/// Fields of the messages that carry parameters of an ephemeris.
static SET: &Tables = &[&BEGIN, &FIRST_HALF, &HEADER, &SECOND_HALF, &CLOCK, &DELAY];

/// An ephemeris as B-CNAV2 has it.
fn form(set: &Ephemeris) -> Ephemeris {
    bcnav::carried(set, &B_CNAV2_SETS, &[&B1C, &B2A], Some(["5D", "5P"]))
}

/// Tables of the ephemeris.
static FIELDS: OfSet = bcnav::set_tables(&B_CNAV2_SETS, SET, |own, set| bcnav::rounded(own, form(set)));

/// The symbols of a satellite's message of 288 bits with their check.
pub fn encode(bits: &[bool]) -> Vec<bool> {
    LAYOUT.encode(0, bits)
}

/// The bits of a message in its 600 soft symbols, positive for a logical 0, and whether they are inverted;
/// `None` where its check fails.
pub fn decode(soft: &[f32]) -> Option<(Vec<bool>, bool)> {
    LAYOUT.decode(soft)
}

/// Lists every field by the message that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    bcnav::fields(&[("message 10", TEN), ("message 11", ELEVEN), ("message 30", THIRTY), ("message 34", THIRTY_FOUR)])
}
