//! BeiDou B2b, its in-phase component: a code of 10 230 chips at 10.23 Mchip/s, BPSK(10) on 1207.14 MHz, with
//! B-CNAV3.
//!
//! Source: BDS-SIS-ICD-B2b 1.0, 4.2 and 5.2 (codes of two registers of thirteen stages, table 5-1:
//! numbers 6 to 58). A symbol is what one code period carries. The satellites are those of B1C and B2a.
//! Limits: geostationary satellites (numbers 59 to 61) send PPP-B2b, corrections, in the same position,
//! which is left out; so is the component in quadrature, of which no document is public. Power is that of
//! medium orbits, 2 dB less of inclined ones. Below some 38 dB-Hz the phase detector of single periods
//! declares slips that are none.

use crate::beidou::b1c::{THIRD_GENERATION, sent};
use crate::beidou::bcnav3::B_CNAV3;
use crate::beidou::in_phase::registers;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal};
use crate::time::BDT;

/// 4.1.
pub const CARRIER_HZ: f64 = 1_207.14e6;
/// Chips in a code period.
pub const CODE_CHIPS: u32 = 10_230;

/// Definition of the signal: data with B-CNAV3.
pub static B2B: Signal = Signal {
    name: "BeiDou B2b",
    rinex: "7D",
    system: System::BeiDou,
    time: &BDT,
    constellation: THIRD_GENERATION,
    carrier: Carrier::Common(CARRIER_HZ),
    sent,
    minimum_power_dbw: Some(-160.0), // 4.5
    components: &[Component {
        power_share: 1.0,
        phase_cycles: 0.0,
        chip_rate_hz: 10.23e6,
        code_chips: CODE_CHIPS,
        code: &code,
        layers: &[Layer::BPSK],
        secondary_code: SecondaryCode::None,
        message: Some(&B_CNAV3),
    }],
};

/// The first number that has a code.
const FIRST: u8 = 6;

/// Chips of a satellite by its number, 6 to 58, as ±1; `None` beyond.
pub fn code(number: u8) -> Option<Vec<i8>> {
    let start = *G2_STARTS.get(usize::from(number.checked_sub(FIRST)?))?;
    let last = planted!("gnss.b2b.register", 10, 11);
    Some(registers([1, 9, last, 13], &[3, 4, 6, 9, 12, 13], start))
}

/// Initial states of the second register, stage 1 to stage 13, for numbers 6 to 58.
#[rustfmt::skip]
const G2_STARTS: [u16; 53] = [
    0b1_0001_1010_1110, 0b1_0001_1110_1110, 0b1_0001_1111_1011, 0b1_0011_0010_1001, 0b1_0011_1101_1010,
    0b1_0100_0011_0101, 0b1_0100_0100_0100, 0b1_0100_0101_0101, 0b1_0100_0101_1011, 0b1_0100_0101_1100,
    0b1_0100_1010_0011, 0b1_0100_1111_0111, 0b1_0101_0000_0001, 0b1_0101_0011_1110, 0b1_0101_1010_1011,
    0b1_0101_1011_0001, 0b1_0110_0101_0011, 0b1_0110_0110_0010, 0b1_0110_1001_1000, 0b1_0110_1011_0110,
    0b1_0110_1111_0010, 0b1_0110_1111_1111, 0b1_0111_0001_0010, 0b1_0111_0011_1100, 0b1_0111_1010_0001,
    0b1_0111_1100_1000, 0b1_0111_1101_0100, 0b1_0111_1110_1011, 0b1_0111_1111_0011, 0b1_1000_0101_0001,
    0b1_1000_1001_0100, 0b1_1000_1011_0111, 0b1_1001_0001_0001, 0b1_1001_0001_1001, 0b1_1001_1010_1011,
    0b1_1001_1011_0001, 0b1_1001_1101_0010, 0b1_1010_0101_0101, 0b1_1010_0111_0100, 0b1_1010_1100_1011,
    0b1_1011_0101_0111, 0b1_1100_0011_0100, 0b1_1100_1000_0011, 0b1_1100_1000_1011, 0b1_1100_1010_0011,
    0b1_1100_1010_1000, 0b1_1101_0011_1011, 0b1_1101_1001_0111, 0b1_1110_0100_1000, 0b1_1110_1001_0100,
    0b1_1110_1001_1001, 0b1_1110_1101_1010, 0b1_1110_1111_1000,
];
