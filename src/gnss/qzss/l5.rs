//! QZSS L5: the signal of GPS, I5 with CNAV and Q5, with codes of PRN 193 to 202.
//!
//! Source: IS-QZSS-PNT-005, 3.1 and 3.2.2. Limits: the power is that of the document's Block I.

use crate::gps::l5::{self, Code, code};
use crate::qzss::civil::CNAV;
use crate::qzss::satellites::{SATELLITES, prn};
use crate::satellite::System;
use crate::signal::{Component, Signal, always};
use crate::time::QZSST;

/// Definition of the signal: I5 with CNAV, and Q5.
pub static L5: Signal = Signal {
    name: "QZSS L5",
    system: System::Qzss,
    time: &QZSST,
    constellation: [1, SATELLITES],
    sent: always,
    minimum_power_dbw: Some(-154.9), // 3.1: -157.9 dBW a component
    components: &[
        Component { code: &|number| code(Code::Data, prn(number)?), message: Some(&CNAV), ..l5::L5.components[0] },
        Component { code: &|number| code(Code::Pilot, prn(number)?), ..l5::L5.components[1] },
    ],
    ..l5::L5
};
