//! QZSS L1 C/A: the signal of GPS with codes of PRN 193 to 202.
//!
//! Source: IS-QZSS-PNT-005, 3.1 and 3.2.2. Limits: L1C/B, which some satellites send instead, is not
//! there; the power is that of the document's Block I.

use crate::gps::l1ca::{self, code};
use crate::qzss::lnav::LNAV;
use crate::qzss::satellites::{self, SATELLITES, prn};
use crate::satellite::System;
use crate::signal::{Component, Signal};
use crate::time::QZSST;

/// Definition of the signal.
pub static L1_CA: Signal = Signal {
    name: "QZSS L1 C/A",
    system: System::Qzss,
    time: &QZSST,
    constellation: [1, SATELLITES],
    sent: satellites::sends_l1ca,
    minimum_power_dbw: Some(-158.5), // 3.1
    components: &[Component {
        code: &|number| Some(code(prn(number)?)?.iter().map(|&one| if one { -1 } else { 1 }).collect()),
        message: Some(&LNAV),
        ..l1ca::L1_CA.components[0]
    }],
    ..l1ca::L1_CA
};
