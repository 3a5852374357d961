//! Table of the GPS satellites that send civil signals newer than L1 C/A, with the date of each beginning.
//!
//! A number sends L2C with CNAV from the day on which a satellite of Block IIR-M, IIF or III took it, and L5
//! from that of Block IIF or III: these are the days on which they were set healthy (notices of the
//! constellation, NANU), of those before 2014-04-28, when CNAV began, that day. Of PRN 20 and 21 it is the
//! day of a broadcast file in which they have corrections for both; they may have sent them before. PRN 1
//! passed from Block IIF to III; it sends L1C from the day of that file on. L1C is sent by Block III from the
//! day on which a satellite was set healthy. Witnessed are seven days of 2020 to 2026 (`tests/witness`), for
//! L1C one recording alone. Limits: outages, changes after 2026-03-09.

use crate::time::Epoch;

/// Set of signals that a satellite can send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sends {
    /// L2C: Block IIR-M.
    L2,
    /// L5 too: Block IIF.
    L2AndL5,
    /// L1C too: Block III.
    L1CToo,
}
use Sends::{L1CToo, L2, L2AndL5};

const CNAV_BEGAN: &str = "2014-04-28T00:00:00";

/// Satellite number, date of the first transmission, and set of signals. For a number with several entries,
/// the newest comes first.
#[rustfmt::skip]
const SINCE: [(u8, &str, Sends); 28] = [
    (1, "2026-03-09T00:00:00", L1CToo),
    (1, CNAV_BEGAN, L2AndL5),
    (3, "2014-12-12T00:00:00", L2AndL5),
    (4, "2020-01-13T00:00:00", L1CToo),
    (5, CNAV_BEGAN, L2),
    (6, "2014-06-10T00:00:00", L2AndL5),
    (7, CNAV_BEGAN, L2),
    (8, "2015-08-12T00:00:00", L2AndL5),
    (9, "2014-09-17T00:00:00", L2AndL5),
    (10, "2015-12-09T00:00:00", L2AndL5),
    (11, "2022-05-25T00:00:00", L1CToo),
    (12, CNAV_BEGAN, L2),
    (14, "2020-12-02T00:00:00", L1CToo),
    (15, CNAV_BEGAN, L2),
    (17, CNAV_BEGAN, L2),
    (18, "2020-04-01T00:00:00", L1CToo),
    (20, "2026-03-09T00:00:00", L1CToo),
    (21, "2026-03-09T00:00:00", L1CToo),
    (23, "2020-10-01T00:00:00", L1CToo),
    (24, CNAV_BEGAN, L2AndL5),
    (25, CNAV_BEGAN, L2AndL5),
    (26, "2015-04-20T00:00:00", L2AndL5),
    (27, CNAV_BEGAN, L2AndL5),
    (28, "2023-02-16T00:00:00", L1CToo),
    (29, CNAV_BEGAN, L2),
    (30, "2014-05-30T00:00:00", L2AndL5),
    (31, CNAV_BEGAN, L2),
    (32, "2016-03-09T00:00:00", L2AndL5),
];

/// Returns the set of signals that the satellite with this number sends at a time.
fn of(number: u8, at: Epoch) -> Option<Sends> {
    let own = SINCE.iter().filter(|(known, ..)| *known == number);
    let mut begun = own.filter(|(_, since, _)| Epoch::parse(since).is_ok_and(|since| at.since(since) >= 0.0));
    begun.next().map(|(.., sends)| *sends)
}

/// True if a satellite sends L2C with CNAV at a time.
pub fn sends_l2c(number: u8, at: Epoch) -> bool {
    of(number, at).is_some()
}

/// True if a satellite sends L5 at a time.
pub fn sends_l5(number: u8, at: Epoch) -> bool {
    matches!(of(number, at), Some(L2AndL5 | L1CToo))
}

/// True if a satellite sends L1C with CNAV-2 at a time.
pub fn sends_l1c(number: u8, at: Epoch) -> bool {
    of(number, at) == Some(L1CToo)
}
