//! CNAV as L2 CM sends it: the messages of L5 at half the rate, twelve seconds each.
//!
//! Source: IS-GPS-200N, 3.2.2 and 30.3.3 (25 bit/s, coded to 50 symbols per second, in step with twelve
//! seconds of the week). The order of messages is that of satellites in 2025 (`tests/witness`).

use super::reader::CnavReader;
use super::{CNAV, IONOSPHERE, MESSAGE_S, sender, type_at};
use crate::message::{IonosphereForm, Message};

/// CNAV as L2C names it. Its ephemerides are those of CNAV on L5.
pub static CNAV_L2C: Message = Message {
    name: "CNAV on L2C",
    symbol_s: 2.0 * CNAV.symbol_s,
    bit: |_| &[1],
    unit_s: MESSAGE_S * 2,
    set_s: MESSAGE_S * 2,
    sender: |common| Ok(sender(common, &CNAV_L2C)),
    number: |start| type_at(&CNAV_L2C, start),
    ionosphere: IonosphereForm { unit: |start| type_at(&CNAV_L2C, start) == IONOSPHERE, ..CNAV.ionosphere },
    reader: |sv| Box::new(CnavReader::of(&CNAV_L2C, sv)),
    ..CNAV
};
