//! NavIC's standard positioning service on L5 and S: Gold codes of 1023 chips at 1.023 Mchip/s with the same
//! message.
//!
//! Source: IRNSS SIS ICD for SPS 1.1, tables of carrier frequencies, received powers and code phase
//! assignments. Codes are those of GPS C/A but for where G2 begins, which is a satellite's own on each
//! carrier. Limits: the service has 2/9 of what is sent on a carrier; the restricted service beside it,
//! BOC(5,2), is not made, so that the rest is one BPSK(1) of constant envelope, and powers are the service's
//! alone.

use crate::navic::nav::SPS_NAV;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal, always};
use crate::time::IRNSST;

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 1023;

/// The signal on L5.
pub static L5: Signal = Signal {
    name: "NavIC L5",
    rinex: "5A",
    system: System::Navic,
    time: &IRNSST,
    constellation: [1, 14],
    carrier: Carrier::Common(1_176.45e6),
    sent: always,
    minimum_power_dbw: Some(-159.0),
    components: &[Component { code: &|number| signs(&L5_STARTS, number), ..SPS }],
};

/// The signal on S.
pub static S: Signal = Signal {
    name: "NavIC S",
    rinex: "9A",
    carrier: Carrier::Common(2_492.028e6),
    sent: always,
    minimum_power_dbw: Some(-162.3),
    components: &[Component { code: &|number| signs(&S_STARTS, number), ..SPS }],
    ..L5
};

/// Component that both carriers share, with the codes of L5.
const SPS: Component = Component {
    power_share: 1.0,
    phase_cycles: 0.0,
    chip_rate_hz: 1.023e6,
    code_chips: CODE_CHIPS,
    code: &|number| signs(&L5_STARTS, number),
    layers: &[Layer::BPSK],
    secondary_code: SecondaryCode::None,
    message: Some(&SPS_NAV),
};

/// Initial states of G2 on L5 for PRN 1 to 14: stage 10, whose chip comes first, to stage 1.
#[rustfmt::skip]
const L5_STARTS: [u16; 14] = [
    0b11_1010_0111, 0b00_0010_0110, 0b10_0011_0100, 0b01_0111_0010, 0b11_1011_0000, 0b00_0110_1011, 0b00_0001_0100,
    0b01_0011_0000, 0b00_1001_1000, 0b11_0110_0100, 0b00_0100_1100, 0b11_0111_1100, 0b10_1101_0010, 0b01_1110_1010,
];
/// Initial states of G2 on S for PRN 1 to 14: stage 10, whose chip comes first, to stage 1.
#[rustfmt::skip]
const S_STARTS: [u16; 14] = [
    0b00_1110_1111, 0b01_0111_1101, 0b10_0011_0001, 0b00_1010_1011, 0b10_1001_0001, 0b01_0010_1100, 0b00_1000_1110,
    0b01_0010_0110, 0b11_0000_1110, 0b10_1011_1110, 0b11_1001_0001, 0b11_0110_1001, 0b01_0100_0101, 0b01_0000_1101,
];

/// Chips of a PRN from 1 to 14 as ±1; `None` beyond.
fn signs(starts: &[u16; 14], number: u8) -> Option<Vec<i8>> {
    let start = *starts.get(usize::from(number).checked_sub(1)?)?;
    // Stage n is bit n − 1.
    let (mut g1, mut g2) = (0x3FF_u16, planted!("gnss.navic.g2_start", start, start ^ u16::from(number == 7)));
    let chips = (0..CODE_CHIPS).map(|_| {
        let chip = (g1 ^ g2) >> 9 & 1;
        g1 = step(g1, 0b10_0000_0100);
        g2 = step(g2, 0b11_1010_0110);
        if chip == 1 { -1 } else { 1 }
    });
    Some(chips.collect())
}

/// The next state of a register of ten stages whose stages of `taps` are fed back.
fn step(stages: u16, taps: u16) -> u16 {
    (stages << 1 | (stages & taps).count_ones() as u16 & 1) & 0x3FF
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_fourteen_numbers_and_differ_between_the_carriers() {
        for number in 1..=14 {
            let (l5, s) = (L5.code(number).unwrap(), S.code(number).unwrap());
            assert!(l5 != s && l5.len() == 1023 && s.len() == 1023);
        }
        for signal in [&L5, &S] {
            assert!(signal.code(0).is_none() && signal.code(15).is_none());
            assert_eq!(signal.satellites().count(), 14);
        }
    }

    #[test]
    fn the_carriers_are_those_of_the_document() {
        // 115 and 243.6 times 10.23 MHz.
        assert_eq!(L5.centre_hz(), 115.0 * 10.23e6);
        assert!((S.centre_hz() - 243.6 * 10.23e6).abs() < 1e-6);
    }
}
