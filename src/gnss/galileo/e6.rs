//! Galileo E6: data (E6-B) and pilot (E6-C) with codes of 5115 chips at 5.115 Mchip/s, BPSK(5) on 1278.75
//! MHz.
//!
//! Source: Galileo E6-B/C codes technical note (modulation, codes; secondary codes are those of E5a's pilot,
//! CS100 of the satellite's number), by tables of other programs that agree. The codes have no generator, and
//! `e6_codes.bin` holds the chips. Its message states neither time nor orbit ([`super::cnav`]), and no group
//! delay of E6 is broadcast (`status`). Limits: the pilot's minus sign is the document's and has not been
//! measured; E6-A is left out.

use crate::galileo::cnav::CNAV;
use crate::galileo::e5;
pub use crate::galileo::memory::Code;
use crate::galileo::memory::{self, COUNT};
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal, always};
use crate::time::GST;

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 5115;

/// Definition of the signal: s = (e_B − e_C) / √2.
pub static E6: Signal = Signal {
    name: "Galileo E6",
    rinex: "6C",
    system: System::Galileo,
    time: &GST,
    constellation: [1, 36],
    carrier: Carrier::Common(1_278.75e6),
    sent: always,
    minimum_power_dbw: Some(-155.25), // both components
    components: &[
        Component {
            power_share: 0.5,
            phase_cycles: 0.0,
            chip_rate_hz: 5.115e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Data, number),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::None,
            message: Some(&CNAV),
        },
        Component {
            power_share: 0.5,
            phase_cycles: 0.5,
            chip_rate_hz: 5.115e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Pilot, number),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::PerSatellite { chips: 100, of: e5::secondary_code },
            message: None,
        },
    ],
};

/// The codes of numbers 1 to 50: those of E6-B, then those of E6-C, each in 640 bytes.
static CODES: &[u8; 2 * COUNT * 640] = include_bytes!("e6_codes.bin");

/// Chips of a satellite by its number, 1 to 50, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    memory::chips(CODES, CODE_CHIPS, which, planted!("gnss.e6.codes", number, number ^ 1))
}
