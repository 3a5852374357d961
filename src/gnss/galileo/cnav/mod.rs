//! Galileo's C/NAV, the message of E6-B: pages of a second, encoded and decoded.
//!
//! Source: Galileo HAS SIS ICD 1.0 (C/NAV's page with code and interleaver, header and encoded page of the
//! high accuracy service), by other programs that agree and by real pages (`tests/witness`). A page is a
//! pattern of sixteen symbols and 492 bits, coded ([`Convolutional`]) and interleaved ([`Interleaver`]): 14
//! reserved bits, a page of the service of 448, a check and a tail of zeros. It states neither its time nor
//! where the satellite is. Its second is known by another signal of the satellite, and ephemerides are
//! those of I/NAV.
//!
//! Limits: pages of the service are carried, not applied. Those sent are dummies at multiples of ten seconds
//! and after them a message of type 1 of one page, which states its time of the hour and that no corrections
//! follow, in test mode. Those read are reported by header and by pieces of what they encode; parts of longer
//! messages are not put together, so the Reed-Solomon code over pages is left out.
//!
//! [`Convolutional`]: crate::fec::convolutional::Convolutional

mod reader;

use crate::bits::Kind::Whole;
use crate::bits::{Field, FieldError, Store, bits_of, soft};
use crate::broadcast::Ephemeris;
use crate::fec::interleaver::Interleaver;
use crate::fec::pages::Form;
use crate::galileo::inav::{INAV, INAV_SETS, code};
use crate::ionosphere::Model;
use crate::message::{IonosphereForm, Message, Parameters, Sender, SetFields};
use crate::time::Epoch;
pub use reader::CnavReader;

/// Definition of C/NAV for E6.
pub static CNAV: Message = Message {
    name: "C/NAV",
    symbol_s: 0.001,
    bit: |_| &[1],
    unit_s: PAGE_S,
    decided_after: 0,
    set_s: PAGE_S,
    first_s: 0,
    sender: |_| Ok(Box::new(Pages)),
    number: |start| u8::from(!is_dummy_at(start)),
    timed: &[],
    dated: &[],
    set: &[],
    reduced: &[],
    ionosphere: IonosphereForm { model: Model::NequickG, unit: |_| false, coefficients: |_| None },
    fields: &NoFields,
    parameters: |symbols| decode_soft(&soft(symbols)).map(|(page, _)| (false, parameters(&page))),
    reader: |sv| Box::new(CnavReader::new(sv)),
    form: |set| (INAV.form)(set),
    sets: &INAV_SETS,
    alert: None,
    rinex: None,
};

/// Fields of ephemerides where there are none.
struct NoFields;

impl SetFields for NoFields {}

/// Seconds of a page.
const PAGE_S: i64 = 1;
/// Symbols of the pattern with which a page begins, and of a page.
const PATTERN: u128 = 0b1011_0111_0111_0000;
const PATTERN_SYMBOLS: usize = 16;
const PAGE_SYMBOLS: usize = 1000;
/// Bits of a page without its check and the tail of six zeros.
const DATA_BITS: usize = 462;

const FORM: Form = Form {
    pattern: (PATTERN, PATTERN_SYMBOLS),
    data_bits: DATA_BITS,
    tail_bits: 6,
    code,
    interleaver: Interleaver { columns: 123, rows: 8 },
};

/// Seconds from one message of the service to the next, as satellites sent them in 2025.
const ROUND_S: i64 = 10;
/// Messages have numbers of five bits.
const NUMBERS: i64 = 32;
/// The header of a dummy page.
const DUMMY_HEADER: u32 = 0xAF_3BC3;
/// Reserved bits and what follows the header on satellites that had no message in February 2025.
const DUMMY_RESERVED: u32 = 0x0AC9;
const DUMMY: [i64; 8] = [
    0x00_27B3_88DF_C309,
    0x17_086A_12C1_4F87,
    0x18_0F69_8D54_9BC0,
    0x12_F3AE_184B_0D31,
    0x14_8DFD_5E76_75C3,
    0x0B_CED4_F851_BFB0,
    0x18_0E98_D0C2_6C09,
    0x0F_FD21_1234_CD21,
];
/// Bits that nobody reads.
const RESERVED: u32 = 0x3FFF;
/// Bit pattern that fills a message up to whole pages.
const FILLING: u32 = 0x5555_5555;

/// Positions of the reserved bits, and of the page of the service.
const RESERVED_PLACE: (u16, u8) = (0, 14);
const HEADER_PLACE: (u16, u8) = (14, 24);

const HEADER: &str = "HAS page header";
const ENCODED: &str = "HAS encoded page";

/// The header's fields: status (1 operational, 0 in test), type, number and pages less one of the message,
/// and which page of its code this is.
const HEAD: [Field; 5] = [
    Field::new("has_status", &[(14, 2)], Whole, 0, HEADER),
    Field::new("has_type", &[(18, 2)], Whole, 0, HEADER),
    Field::new("has_message", &[(20, 5)], Whole, 0, HEADER),
    Field::new("has_pages_less_one", &[(25, 5)], Whole, 0, HEADER),
    Field::new("has_page", &[(30, 8)], Whole, 0, HEADER),
];

/// Encoded content of a page, 53 octets in eight fields.
const BODY: [Field; 8] = [
    Field::new("has_encoded_1", &[(38, 32), (70, 21)], Whole, 0, ENCODED),
    Field::new("has_encoded_2", &[(91, 32), (123, 21)], Whole, 0, ENCODED),
    Field::new("has_encoded_3", &[(144, 32), (176, 21)], Whole, 0, ENCODED),
    Field::new("has_encoded_4", &[(197, 32), (229, 21)], Whole, 0, ENCODED),
    Field::new("has_encoded_5", &[(250, 32), (282, 21)], Whole, 0, ENCODED),
    Field::new("has_encoded_6", &[(303, 32), (335, 21)], Whole, 0, ENCODED),
    Field::new("has_encoded_7", &[(356, 32), (388, 21)], Whole, 0, ENCODED),
    Field::new("has_encoded_8", &[(409, 32), (441, 21)], Whole, 0, ENCODED),
];

/// First field of a type 1 message, the time of the hour. [`FOLLOWING`] are the bits that state what follows,
/// with the numbers of the masks.
const TIME_OF_HOUR: Field = Field::new("has_time_of_hour_s", &[(38, 12)], Whole, 0, "HAS message type 1, header");
const FOLLOWING: (u16, u8) = (50, 20);

/// Lists every field by the part of the page that has it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![("header", HEAD.iter().collect()), ("encoded", BODY.iter().collect()), ("type 1", vec![&TIME_OF_HOUR])]
}

fn is_dummy_at(start: Epoch) -> bool {
    start.tow_whole_s().rem_euclid(ROUND_S) == 0
}

/// Makes the pages of satellites.
struct Pages;

impl Sender for Pages {
    fn unit(&self, _: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        CNAV.check_start(start, "a whole second")?;
        Ok(encode_page(&if is_dummy_at(start) { dummy() } else { without_corrections(start) }))
    }
}

/// The page of a satellite that has no message of the service.
fn dummy() -> Vec<bool> {
    let mut page = vec![false; DATA_BITS];
    page.set_piece(RESERVED_PLACE, DUMMY_RESERVED);
    page.set_piece(HEADER_PLACE, DUMMY_HEADER);
    BODY.iter().zip(DUMMY).for_each(|(field, piece)| field.write(&mut page, piece));
    page
}

/// The one page of the message of type 1 in the round in which a time lies, without corrections.
fn without_corrections(start: Epoch) -> Vec<bool> {
    let round = start.tow_whole_s().div_euclid(ROUND_S);
    let mut page = vec![false; DATA_BITS];
    page.set_piece(RESERVED_PLACE, RESERVED);
    let header = [0, 1, round.rem_euclid(NUMBERS), 0, 1];
    HEAD.iter().zip(header).for_each(|(field, value)| field.write(&mut page, value));
    for first in (38..DATA_BITS as u16).step_by(8) {
        page.set_piece((first, 8), FILLING);
    }
    TIME_OF_HOUR.write(&mut page, (round * ROUND_S).rem_euclid(3600));
    page.set_piece(FOLLOWING, 0);
    page
}

/// The symbols of a page of 462 bits: pattern, then the bits with check and tail, coded and interleaved.
pub fn encode_page(page: &[bool]) -> Vec<bool> {
    let pattern = planted!("gnss.galileo_cnav.pattern", PATTERN, !PATTERN);
    bits_of(pattern, PATTERN_SYMBOLS).chain(FORM.coded(page)).collect()
}

/// The 462 bits in the 1000 soft symbols of a page, and whether they are inverted; `None` where the check
/// is wrong.
pub fn decode_soft(symbols: &[f32]) -> Option<(Vec<bool>, bool)> {
    FORM.decode(symbols)
}

/// True if the page comes from a satellite that has no message of the service.
pub fn is_dummy(page: &Vec<bool>) -> bool {
    page.piece(HEADER_PLACE) == DUMMY_HEADER
}

/// Raw integers of a page's content; only those of the header for dummy pages.
pub fn parameters(page: &Vec<bool>) -> Parameters {
    let body = BODY.iter().filter(|_| !is_dummy(page));
    HEAD.iter().chain(body).map(|field| (field.name, field.read(page))).collect()
}
