//! QZSS L2C: the signal of GPS, CM with CNAV and CL in turn, with codes of PRN 193 to 202.
//!
//! Source: IS-QZSS-PNT-005, 3.1 and 3.2.2. Limits: the power is that of the document's Block I.

use crate::gps::l2c::{self, Code, placed};
use crate::qzss::civil::CNAV_L2C;
use crate::qzss::satellites::{self, SATELLITES, prn};
use crate::satellite::System;
use crate::signal::{Component, Signal};
use crate::time::QZSST;

/// Definition of the signal: CM with CNAV, and CL.
pub static L2C: Signal = Signal {
    name: "QZSS L2C",
    system: System::Qzss,
    time: &QZSST,
    constellation: [1, SATELLITES],
    sent: satellites::sends_l2c,
    minimum_power_dbw: Some(-160.0), // 3.1: both components
    components: &[
        Component {
            code: &|number| placed(Code::Moderate, prn(number)?),
            message: Some(&CNAV_L2C),
            ..l2c::L2C.components[0]
        },
        Component { code: &|number| placed(Code::Long, prn(number)?), ..l2c::L2C.components[1] },
    ],
    ..l2c::L2C
};
