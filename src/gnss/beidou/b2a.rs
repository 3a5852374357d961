//! BeiDou B2a: data and pilot in quadrature with codes of 10 230 chips at 10.23 Mchip/s, BPSK(10) on
//! 1176.45 MHz.
//!
//! Source: BDS-SIS-ICD-B2a 1.0, 4.2 (modulation: the pilot leads by a quarter of a cycle), 5.2 and 5.3
//! (codes and secondary codes, tables 5-2 to 5-4). Codes are those of two registers of thirteen stages, as
//! that of B3I; the data's secondary code is five chips, the pilot's a piece of a Weil code of length 1021.
//! The satellites are those of B1C. Limits: power is that of medium orbits, 2 dB less of inclined ones.

use std::sync::LazyLock;

use crate::beidou::b1c::{THIRD_GENERATION, piece, sent};
use crate::beidou::bcnav2::B_CNAV2;
use crate::beidou::in_phase::registers;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal};
use crate::time::BDT;
use crate::weil::Legendre;

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 10_230;
/// Chips of the pilot's secondary code, one per code period.
pub const SECONDARY_CODE_CHIPS: u32 = 100;

/// Definition of the signal: the pilot, and data with B-CNAV2. Satellites that send B1C send it.
pub static B2A: Signal = Signal {
    name: "BeiDou B2a",
    rinex: "5P",
    system: System::BeiDou,
    time: &BDT,
    constellation: THIRD_GENERATION,
    carrier: Carrier::Common(1_176.45e6), // 4.1
    sent,
    minimum_power_dbw: Some(-156.0), // 4.5: both components
    components: &[
        Component {
            power_share: 0.5,
            phase_cycles: 0.0,
            chip_rate_hz: 10.23e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Data, number),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::Shared(&[1, 1, 1, -1, 1]), // 00010
            message: Some(&B_CNAV2),
        },
        Component {
            power_share: 0.5,
            phase_cycles: 0.25,
            chip_rate_hz: 10.23e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Pilot, number),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::PerSatellite { chips: SECONDARY_CODE_CHIPS, of: secondary_code },
            message: None,
        },
    ],
};

/// Component to which a code of a satellite belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Code of the data component.
    Data,
    /// Code of the pilot.
    Pilot,
}

static LEGENDRE: LazyLock<Legendre> = LazyLock::new(|| Legendre::new(1021));

/// Chips of a satellite by its number, 1 to 63, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let (data, pilot, _) = *CODES.get(usize::from(number).checked_sub(1)?)?;
    let chips = match which {
        Code::Data => registers([1, 5, planted!("gnss.b2a.register", 11, 10), 13], &[3, 5, 9, 11, 12, 13], data),
        Code::Pilot => registers([3, 6, 7, 13], &[1, 5, 7, 8, 12, 13], pilot),
    };
    Some(chips)
}

/// Secondary code of a satellite's pilot by its number, 1 to 63, as ±1; `None` beyond.
pub fn secondary_code(number: u8) -> Option<Vec<i8>> {
    let (.., own) = *CODES.get(usize::from(number).checked_sub(1)?)?;
    Some(piece(&LEGENDRE, own, SECONDARY_CODE_CHIPS))
}

/// Initial states of the second register, stage 1 to stage 13, for the data's code and the pilot's, numbers 1
/// to 63. The pair is the Weil index and the truncation point of the secondary code.
#[rustfmt::skip]
const CODES: [(u16, u16, [u16; 2]); 63] = [
    (0b1_0000_0010_0101, 0b1_0000_0010_0101, [123, 138]), (0b1_0000_0011_0100, 0b1_0000_0011_0100, [55, 570]),
    (0b1_0000_1010_1101, 0b1_0000_1010_1101, [40, 351]), (0b1_0001_0100_1111, 0b1_0001_0100_1111, [139, 77]),
    (0b1_0001_0101_0101, 0b1_0001_0101_0101, [31, 885]), (0b1_0001_1010_1110, 0b1_0001_1010_1110, [175, 247]),
    (0b1_0001_1110_1110, 0b1_0001_1110_1110, [350, 413]), (0b1_0001_1111_1011, 0b1_0001_1111_1011, [450, 180]),
    (0b1_0011_0010_1001, 0b1_0011_0010_1001, [478, 3]), (0b1_0011_1101_1010, 0b1_0011_1101_1010, [8, 26]),
    (0b1_0100_0011_0101, 0b1_0100_0011_0101, [73, 17]), (0b1_0100_0100_0100, 0b1_0100_0100_0100, [97, 172]),
    (0b1_0100_0101_0101, 0b1_0100_0101_0101, [213, 30]), (0b1_0100_0101_1011, 0b1_0100_0101_1011, [407, 1008]),
    (0b1_0100_0101_1100, 0b1_0100_0101_1100, [476, 646]), (0b1_0100_1010_0011, 0b1_0100_1010_0011, [4, 158]),
    (0b1_0100_1111_0111, 0b1_0100_1111_0111, [15, 170]), (0b1_0101_0000_0001, 0b1_0101_0000_0001, [47, 99]),
    (0b1_0101_0011_1110, 0b1_0101_0011_1110, [163, 53]), (0b1_0101_1010_1011, 0b1_0101_1010_1011, [280, 179]),
    (0b1_0101_1011_0001, 0b1_0101_1011_0001, [322, 925]), (0b1_0110_0101_0011, 0b1_0110_0101_0011, [353, 114]),
    (0b1_0110_0110_0010, 0b1_0110_0110_0010, [375, 10]), (0b1_0110_1001_1000, 0b1_0110_1001_1000, [510, 584]),
    (0b1_0110_1011_0110, 0b1_0110_1011_0110, [332, 60]), (0b1_0110_1111_0010, 0b1_0110_1111_0010, [7, 3]),
    (0b1_0110_1111_1111, 0b1_0110_1111_1111, [13, 684]), (0b1_0111_0001_0010, 0b1_0111_0001_0010, [16, 263]),
    (0b1_0111_0011_1100, 0b1_0111_0011_1100, [18, 545]), (0b1_0111_1010_0001, 0b1_0111_1010_0001, [25, 22]),
    (0b1_0111_1100_1000, 0b1_0111_1100_1000, [50, 546]), (0b1_0111_1101_0100, 0b1_0111_1101_0100, [81, 190]),
    (0b1_0111_1110_1011, 0b1_0111_1110_1011, [118, 303]), (0b1_0111_1111_0011, 0b1_0111_1111_0011, [127, 234]),
    (0b1_1000_0101_0001, 0b1_1000_0101_0001, [132, 38]), (0b1_1000_1001_0100, 0b1_1000_1001_0100, [134, 822]),
    (0b1_1000_1011_0111, 0b1_1000_1011_0111, [164, 57]), (0b1_1001_0001_0001, 0b1_1001_0001_0001, [177, 668]),
    (0b1_1001_0001_1001, 0b1_1001_0001_1001, [208, 697]), (0b1_1001_1010_1011, 0b1_1001_1010_1011, [249, 93]),
    (0b1_1001_1011_0001, 0b1_1001_1011_0001, [276, 18]), (0b1_1001_1101_0010, 0b1_1001_1101_0010, [349, 66]),
    (0b1_1010_0101_0101, 0b1_1010_0101_0101, [439, 318]), (0b1_1010_0111_0100, 0b1_1010_0111_0100, [477, 133]),
    (0b1_1010_1100_1011, 0b1_1010_1100_1011, [498, 98]), (0b1_1011_0101_0111, 0b1_1011_0101_0111, [88, 70]),
    (0b1_1100_0011_0100, 0b1_1100_0011_0100, [155, 132]), (0b1_1100_1000_0011, 0b1_1100_1000_0011, [330, 26]),
    (0b1_1100_1000_1011, 0b1_1100_1000_1011, [3, 354]), (0b1_1100_1010_0011, 0b1_1100_1010_0011, [21, 58]),
    (0b1_1100_1010_1000, 0b1_1100_1010_1000, [84, 41]), (0b1_1101_0011_1011, 0b1_1101_0011_1011, [111, 182]),
    (0b1_1101_1001_0111, 0b1_1101_1001_0111, [128, 944]), (0b1_1110_0100_1000, 0b1_1110_0100_1000, [153, 205]),
    (0b1_1110_1001_0100, 0b1_1110_1001_0100, [197, 23]), (0b1_1110_1001_1001, 0b1_1110_1001_1001, [199, 1]),
    (0b1_1110_1101_1010, 0b1_1110_1101_1010, [214, 792]), (0b1_1110_1111_1000, 0b1_1110_1111_1000, [256, 641]),
    (0b1_1110_1111_1111, 0b1_1110_1111_1111, [265, 83]), (0b1_1111_1011_0101, 0b1_1111_1011_0101, [291, 7]),
    (0b0_0100_0000_0010, 0b1_0100_1000_0110, [324, 111]), (0b1_1011_1111_0101, 0b0_0101_1111_1000, [326, 96]),
    (0b0_0011_1101_0010, 0b0_0011_0101_0101, [340, 92]),
];
