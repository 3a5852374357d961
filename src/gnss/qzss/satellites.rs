//! Numbers of QZSS's satellites, and which of them send which signals since when.
//!
//! Source: IS-QZSS-PNT-005, 3.2.2 (PRN 193 to 202). L5 and L1C are sent by all. That J08 sends no L2C,
//! and that it and J04 have L1C/B instead of L1 C/A, is what satellites broadcast: health in files of
//! six days from 2020 to 2026, messages of two days on L2C (`tests/witness`). J04 had L1 C/A until some
//! day between 2025-02-15 and 2025-08-21; here until the latter. Limits: of J05, J06, J09 and J10 nothing
//! is known, they count as J08 does.

use crate::satellite::{Sv, System};
use crate::time::Epoch;

/// Numbers of satellites that have codes.
pub const SATELLITES: u8 = 10;

/// The PRN of a satellite's codes by its number.
pub fn prn(number: u8) -> Option<u8> {
    (1..=SATELLITES).contains(&number).then(|| Sv { system: System::Qzss, number }.prn())
}

/// The satellites before J08, the third at its position over the equator J07.
fn is_of_the_first_five(number: u8) -> bool {
    matches!(number, 1..=4 | 7)
}

/// True if a satellite sends L1 C/A at a time.
pub fn sends_l1ca(number: u8, at: Epoch) -> bool {
    let last = Epoch::parse("2025-08-21T00:00:00");
    let still = number != 4 || last.is_ok_and(|last| at.since(last) < 0.0);
    is_of_the_first_five(number) && planted!("gnss.qzss.l1cb", still, true)
}

/// True if a satellite sends L2C at a time.
pub fn sends_l2c(number: u8, _: Epoch) -> bool {
    is_of_the_first_five(number)
}
