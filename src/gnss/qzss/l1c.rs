//! QZSS L1C: the signal of GPS, a pilot in TMBOC under an overlay and data in BOC(1,1) with CNAV-2, with
//! codes of PRN 193 to 202.
//!
//! Source: IS-QZSS-PNT-005, 3.1 and 3.2.2. Data and pilot are in phase, and a quarter of a cycle ahead of L1
//! C/A as those of GPS, as J02, J03 and J07 have them in a recording. Limits: of J01, of Block I, the phase
//! may be another.

use crate::gps::l1c::{self, Code, SECONDARY_CODE_CHIPS, code, secondary_code};
use crate::qzss::civil::CNAV2;
use crate::qzss::satellites::{SATELLITES, prn};
use crate::satellite::System;
use crate::signal::{Component, SecondaryCode, Signal, always};
use crate::time::QZSST;

/// Definition of the signal: L1C-P, and L1C-D with CNAV-2.
pub static L1C: Signal = Signal {
    name: "QZSS L1C",
    system: System::Qzss,
    time: &QZSST,
    constellation: [1, SATELLITES],
    sent: always,
    minimum_power_dbw: Some(-157.0), // 3.1: both components
    components: &[
        Component {
            code: &|number| code(Code::Pilot, prn(number)?),
            secondary_code: SecondaryCode::PerSatellite {
                chips: SECONDARY_CODE_CHIPS,
                of: |number| secondary_code(prn(number)?),
            },
            ..l1c::L1C.components[0]
        },
        Component { code: &|number| code(Code::Data, prn(number)?), message: Some(&CNAV2), ..l1c::L1C.components[1] },
    ],
    ..l1c::L1C
};
