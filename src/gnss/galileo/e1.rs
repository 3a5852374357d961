//! Galileo E1 open service: data (E1-B) and pilot (E1-C) with codes of 4092 chips at 1.023 Mchip/s, in
//! CBOC(6,1,1/11) on 1575.42 MHz.
//!
//! Source: Galileo OS SIS ICD 2.1, 2.3.3 (modulation), 3.4 and annex C (codes), table 17 (secondary code).
//! The codes have no generator: the document prints them, and `e1_codes.bin` holds the same chips. Limits:
//! signals of infinite bandwidth; the document's reference receiver has 24.552 MHz.

use crate::galileo::inav::INAV;
pub use crate::galileo::memory::Code;
use crate::galileo::memory::{self, COUNT};
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal, always};
use crate::time::GST;

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 4092;

/// Definition of the signal: s = (e_B (a sc₁ + b sc₆) − e_C (a sc₁ − b sc₆)) / √2, with a² = 10/11 and b² =
/// 1/11.
pub static E1: Signal = Signal {
    name: "Galileo E1",
    rinex: "1C",
    system: System::Galileo,
    time: &GST,
    constellation: [1, 36],               // 3.6: 37 to 50 are not those of satellites
    carrier: Carrier::Common(1_575.42e6), // 2.1, table 2
    sent: always,
    minimum_power_dbw: Some(-157.25), // 2.7.1, table 12: both components
    components: &[
        Component {
            power_share: 0.5,
            phase_cycles: 0.0,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Data, number),
            layers: &[ONE, SIX],
            secondary_code: SecondaryCode::None,
            message: Some(&INAV),
        },
        Component {
            power_share: 0.5,
            phase_cycles: 0.5,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Pilot, number),
            layers: &[ONE, Layer { phase_cycles: 0.5, ..SIX }],
            secondary_code: SecondaryCode::Shared(&CS25),
            message: None,
        },
    ],
};

/// BOC(1,1) with 10/11 of the power.
const ONE: Layer = Layer { weight: 0.953_462_589_245_592_3, ..Layer::BOC11 };
/// BOC(6,1) with the rest.
const SIX: Layer = Layer { weight: 0.301_511_344_577_763_6, ..Layer::BOC61 };

/// The secondary code of the pilot, 380AD90 in the document's hexadecimal, one chip for each code period.
const CS25: [i8; 25] = secondary_code(0x380_AD90);

/// The 25 first bits of 28, a logical 1 as −1.
const fn secondary_code(word: u32) -> [i8; 25] {
    let mut chips = [1; 25];
    let mut index = 0;
    while index < chips.len() {
        if word >> (27 - index) & 1 == 1 {
            chips[index] = -1;
        }
        index += 1;
    }
    chips
}

/// The codes of numbers 1 to 50: those of E1-B, then those of E1-C, each in 512 bytes.
static CODES: &[u8; 2 * COUNT * 512] = include_bytes!("e1_codes.bin");

/// Chips of a satellite by its number, 1 to 50, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    memory::chips(CODES, CODE_CHIPS, which, number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_secondary_code_is_the_printed_one() {
        // Galileo OS SIS ICD 2.1, table 17 names its length and hexadecimal; the bits are written out here.
        let bits = "0011100000001010110110010";
        let written: Vec<i8> = bits.bytes().map(|bit| if bit == b'1' { -1 } else { 1 }).collect();
        assert_eq!(CS25.as_slice(), written);
    }

    #[test]
    fn the_two_waveforms_differ_in_the_sign_of_their_fast_layer() {
        // (11, 2.3.3): the data's chip begins with a + b, the pilot's with −(a − b).
        let value = |component: &Component| -> f64 {
            let sign = |cycles: f64| if cycles == 0.5 { -1.0 } else { 1.0 };
            let layers = component.layers.iter();
            let sum: f64 = layers.map(|l| l.weight * sign(l.phase_cycles) * f64::from(l.pulse[0])).sum();
            sum * sign(component.phase_cycles)
        };
        let (a, b) = ((10.0_f64 / 11.0).sqrt(), (1.0_f64 / 11.0).sqrt());
        assert!((value(&E1.components[0]) - (a + b)).abs() < 1e-15);
        assert!((value(&E1.components[1]) + (a - b)).abs() < 1e-15);
    }

    #[test]
    fn codes_are_those_of_fifty_numbers() {
        for which in [Code::Data, Code::Pilot] {
            assert!(code(which, 0).is_none() && code(which, 51).is_none());
            assert!((1..=50).all(|number| code(which, number).is_some_and(|chips| chips.len() == 4092)));
        }
    }
}
