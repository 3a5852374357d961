//! I/NAV as E5b-I sends it: the words of E1-B in another order, a second earlier.
//!
//! Source: Galileo OS SIS ICD 2.1, 4.3.2.2 (even parts begin at even seconds), 4.3.5, table 38 (order) and
//! table 37: instead of authentication, return link and secondary pattern are reserved bits. Those here are
//! what satellites sent in 2025 (`tests/witness`).

use super::reader::InavReader;
use super::{INAV, On, Pages, SPARE, SUBFRAME_S};
use crate::message::{IonosphereForm, Message};
use crate::time::Epoch;

/// I/NAV as E5b names it. Its ephemerides are those of I/NAV on E1-B.
pub static INAV_E5B: Message = Message {
    name: "I/NAV on E5b",
    first_s: 0,
    sender: |common| Ok(Box::new(Pages { common: common.clone(), carrier: &ON_E5B })),
    number: word_at,
    reduced: &[],
    ionosphere: IonosphereForm { unit: |start| word_at(start) == 5, ..INAV.ionosphere },
    reader: |sv| Box::new(InavReader::on(&INAV_E5B, sv)),
    ..INAV
};

/// The last 24 of the reserved bits before the check are ones and zeros in turn.
static ON_E5B: On = On { message: &INAV_E5B, word_at, rest: |_| (0xAA_AAAA, 0xFD) };

/// Type of the word that begins at a time: the nominal sequence of E5b.
pub(super) fn word_at(start: Epoch) -> u8 {
    // Words 7 and 8 alternate with 9 and 10 from sub-frame to sub-frame.
    let second_half = 2 * (start.tow_whole_s().div_euclid(SUBFRAME_S).rem_euclid(2)) as u8;
    match start.tow_whole_s().rem_euclid(SUBFRAME_S) + planted!("gnss.inav.word_order_e5b", 0, 2) {
        0 => 1,
        2 => 3,
        4 => 5,
        6 => 7 + second_half,
        8 => 8 + second_half,
        20 => 2,
        22 => 4,
        24 => 6,
        _ => SPARE,
    }
}
