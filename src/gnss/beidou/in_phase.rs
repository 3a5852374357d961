//! BeiDou's open in-phase signals B1I, B2I and B3I, whose message is D1, or D2 of geostationary satellites.
//!
//! Source: BDS-SIS-ICD-B1I 3.0 and BDS-SIS-ICD 2.1, section 4 (codes of B1I and B2I); BDS-SIS-ICD-B3I 1.0,
//! section 4. Each is one BPSK code of a millisecond.
//!
//! A satellite's number decides between D1, 50 bit/s under a Neuman-Hofman code of 20 chips, and D2, 500
//! bit/s without it. Both are whole code periods a bit, so that here a symbol is what one code period
//! carries: in D1 a bit times a chip of that code, in D2 half a bit. The message makes and reads them
//! ([`super::d1d2`]), and one signal of one name serves all satellites. Limits: receivers that know the bit
//! integrate over 20 ms, ours over one code period; below some 38 dB-Hz its phase detector declares slips
//! that are none.

use crate::beidou::d1d2::D1_D2;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal, always};
use crate::time::BDT;

/// B1I: 763 times 2.046 MHz.
pub static B1I: Signal = Signal {
    name: "BeiDou B1I",
    rinex: "2I",
    system: System::BeiDou,
    time: &BDT,
    constellation: [1, 63],
    carrier: Carrier::Common(1_561.098e6),
    sent: always,
    minimum_power_dbw: Some(-163.0),
    components: &[SHORT],
};

/// B2I, of satellites of the second generation: the codes of B1I on another carrier.
pub static B2I: Signal = Signal {
    name: "BeiDou B2I",
    rinex: "7I",
    constellation: [1, SECOND_GENERATION],
    carrier: Carrier::Common(1_207.14e6),
    sent: |number, _| number <= SECOND_GENERATION,
    ..B1I
};

/// The last number of that generation; those beyond it send B2b on the carrier.
const SECOND_GENERATION: u8 = 18;

/// B3I, to which the satellites' clocks refer.
pub static B3I: Signal = Signal {
    name: "BeiDou B3I",
    rinex: "6I",
    carrier: Carrier::Common(1_268.52e6),
    components: &[Component { chip_rate_hz: 10.23e6, code_chips: 10_230, code: &long, ..SHORT }],
    ..B1I
};

const SHORT: Component = Component {
    power_share: 1.0,
    phase_cycles: 0.0,
    chip_rate_hz: 2.046e6,
    code_chips: 2046,
    code: &short,
    layers: &[Layer::BPSK],
    secondary_code: SecondaryCode::None,
    message: Some(&D1_D2),
};

/// Stages of G2 whose sum is a satellite's output, of PRN 1 to 63.
#[rustfmt::skip]
const G2_OUTPUTS: [&[u32]; 63] = [
    &[1, 3], &[1, 4], &[1, 5], &[1, 6], &[1, 8], &[1, 9], &[1, 10], &[1, 11],
    &[2, 7], &[3, 4], &[3, 5], &[3, 6], &[3, 8], &[3, 9], &[3, 10], &[3, 11],
    &[4, 5], &[4, 6], &[4, 8], &[4, 9], &[4, 10], &[4, 11], &[5, 6], &[5, 8],
    &[5, 9], &[5, 10], &[5, 11], &[6, 8], &[6, 9], &[6, 10], &[6, 11], &[8, 9],
    &[8, 10], &[8, 11], &[9, 10], &[9, 11], &[10, 11], &[1, 2, 7], &[1, 3, 4], &[1, 3, 6],
    &[1, 3, 8], &[1, 3, 10], &[1, 3, 11], &[1, 4, 5], &[1, 4, 9], &[1, 5, 6], &[1, 5, 8], &[1, 5, 10],
    &[1, 5, 11], &[1, 6, 9], &[1, 8, 9], &[1, 9, 10], &[1, 9, 11], &[2, 3, 7], &[2, 5, 7], &[2, 7, 9],
    &[3, 4, 5], &[3, 4, 9], &[3, 5, 6], &[3, 5, 8], &[3, 5, 10], &[3, 5, 11], &[3, 6, 9],
];

/// Initial states of B3I's register G2, stage 1 to stage 13, for PRN 1 to 63.
#[rustfmt::skip]
const G2_STARTS: [u16; 63] = [
    0b1_0101_1111_1111, 0b1_1110_0010_1011, 0b1_0111_1000_1010, 0b1_1111_1111_1011, 0b1_1001_0001_1111,
    0b1_0010_0110_0100, 0b1_1111_1101_0010, 0b1_1101_1111_1101, 0b1_0100_0000_0010, 0b0_0100_0001_1011,
    0b1_1101_0111_0000, 0b0_0101_1001_1110, 0b0_1100_1001_0101, 0b0_1110_0010_0110, 0b1_0001_1000_1001,
    0b1_1100_0111_1100, 0b0_0100_1100_0101, 0b0_0000_1110_1100, 0b1_0001_0101_0111, 0b0_0010_1101_1110,
    0b0_0100_0010_1101, 0b0_0101_1000_1010, 0b0_0010_1100_1111, 0b0_0110_0110_0010, 0b0_0111_0100_1000,
    0b0_1001_0010_1001, 0b1_0110_1101_0011, 0b1_0101_1110_0010, 0b0_0010_1111_0101, 0b0_1111_1111_1111,
    0b0_1101_1000_1111, 0b1_0101_1000_1001, 0b1_0010_1010_1011, 0b1_1001_1010_0101, 0b1_1010_0101_1101,
    0b1_1111_0111_0100, 0b0_0101_0110_0111, 0b1_1101_0001_0000, 0b1_1011_1001_0000, 0b1_1010_1100_1110,
    0b1_0000_0011_0100, 0b0_1011_1101_1001, 0b0_1101_1011_1100, 0b1_1010_0111_0001, 0b0_0111_0010_0010,
    0b0_1010_1100_0101, 0b1_0011_1110_0110, 0b1_1111_0100_1000, 0b0_0001_0100_1001, 0b1_0000_1010_1100,
    0b1_1110_0100_1100, 0b0_1001_1000_1111, 0b0_0000_0001_1000, 0b1_0000_0000_0100, 0b0_0110_1010_0110,
    0b1_0110_0100_0110, 0b0_1110_0111_1000, 0b0_0101_1100_1010, 0b1_1001_1111_0110, 0b1_0010_0100_0101,
    0b0_1110_0010_0000, 0b0_0110_0100_0010, 0b0_0100_0100_1110,
];

/// The code of B1I and B2I: two registers of eleven stages that begin with 01010101010, cut after 2046 chips.
fn short(number: u8) -> Option<Vec<i8>> {
    let output = stages(G2_OUTPUTS.get(usize::from(number).checked_sub(1)?)?);
    let output = planted!("gnss.beidou.g2_output", output, output ^ u16::from(number == 7) << 3);
    // Stage n is bit n − 1.
    let begin = 0b010_1010_1010;
    let (first, second) = (stages(&[1, 7, 8, 9, 10, 11]), stages(&[1, 2, 3, 4, 5, 8, 9, 11]));
    let (mut g1, mut g2) = (begin, begin);
    let chips = (0..2046).map(|_| {
        let chip = g1 >> 10 & 1 ^ odd(g2 & output);
        (g1, g2) = (step(g1, first, 11), step(g2, second, 11));
        sign(chip)
    });
    Some(chips.collect())
}

/// The code of B3I.
fn long(number: u8) -> Option<Vec<i8>> {
    let start = *G2_STARTS.get(usize::from(number).checked_sub(1)?)?;
    Some(registers([1, 3, 4, 13], &[1, 5, 6, 7, 9, 10, 12, 13], start))
}

/// The code of two registers of thirteen stages, which feed back those stages: the first begins again after
/// 8190 chips, the second begins with `start`, from stage 1 on.
pub(super) fn registers(first: [u32; 4], second: &[u32], start: u16) -> Vec<i8> {
    let (first, second) = (stages(&first), stages(second));
    // Printed from stage 1 on, which is the lowest bit here.
    let (mut g1, mut g2) = (0x1FFF, start.reverse_bits() >> 3);
    let chips = (0..10_230).map(|index| {
        if index == planted!("gnss.beidou.g1_reset", 8190, 8191) {
            g1 = 0x1FFF;
        }
        let chip = (g1 ^ g2) >> 12 & 1;
        (g1, g2) = (step(g1, first, 13), step(g2, second, 13));
        sign(chip)
    });
    chips.collect()
}

fn stages(numbers: &[u32]) -> u16 {
    numbers.iter().fold(0, |all, number| all | 1 << (number - 1))
}

fn odd(bits: u16) -> u16 {
    bits.count_ones() as u16 & 1
}

/// The next state of a register of `length` stages whose stages of `taps` are fed back.
fn step(state: u16, taps: u16, length: u32) -> u16 {
    (state << 1 | odd(state & taps)) & ((1 << length) - 1)
}

fn sign(chip: u16) -> i8 {
    if chip == 1 { -1 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_63_numbers_and_b2i_has_those_of_b1i() {
        for signal in [&B1I, &B2I, &B3I] {
            assert!(signal.code(0).is_none() && signal.code(64).is_none());
            assert_eq!(signal.satellites().count(), 63);
        }
        assert!((1..=63).all(|number| B1I.code(number) == B2I.code(number)));
    }
}
