//! SBAS L1: C/A codes of PRN 120 to 158, the satellites S20 to S58, with 500 symbols per second.
//!
//! Source: RTCA DO-229D, appendix A.2 (signal), A.3.2 (codes), IS-GPS-200N, table 6-I (their delays).
//! Satellites are timed by the network, which keeps within 50 ns of GPS time: it is taken for GPS time.
//! Limits: the power is the least that is promised; only the message states which satellites may be used for
//! ranging.

use crate::gps::l1ca::{self, code};
use crate::satellite::{Sv, System};
use crate::sbas::message::SBAS;
use crate::signal::{Component, Signal, always};
use crate::time::GPST;

/// First and last number of SBAS satellites.
pub const SATELLITES: [u8; 2] = [20, 58];

/// Definition of the signal.
pub static L1: Signal = Signal {
    name: "SBAS L1",
    system: System::Sbas,
    time: &GPST,
    constellation: SATELLITES,
    sent: always,
    minimum_power_dbw: Some(-161.0), // A.2
    components: &[Component {
        code: &|number| Some(code(prn(number)?)?.iter().map(|&one| if one { -1 } else { 1 }).collect()),
        message: Some(&SBAS),
        ..l1ca::L1_CA.components[0]
    }],
    ..l1ca::L1_CA
};

fn prn(number: u8) -> Option<u8> {
    let [first, last] = SATELLITES;
    (first..=last).contains(&number).then(|| Sv { system: System::Sbas, number }.prn())
}
