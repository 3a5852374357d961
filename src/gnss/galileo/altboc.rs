//! Galileo E5 as one signal: AltBOC(15,10) on 1191.795 MHz. Its lower sideband is E5a and its upper one E5b.
//!
//! Source: Galileo OS SIS ICD 2.1, 2.3.1 (eq. 3 to 7, tables 6 and 7). Each side is data and pilot at right
//! angles, times S(t) ∓ jS(t − Ts/4) with a sub-carrier of 15.345 MHz in four levels, constant over eighths
//! of its period Ts: the phase turns by an eighth of a cycle a step, down on E5a, up on E5b. A chip has
//! twelve eighths, one and a half periods, so that the sub-carrier is inverted on every second chip: that
//! sign is in the codes here ([`code`]). S is a sum of two sequences of signs, which are layers. Secondary
//! codes and messages are those of E5a and E5b ([`super::e5`]), and no group delay of both together is
//! broadcast (`status`). Limits: the products of three codes, which make the envelope constant and have (2 −
//! √2)/4 of the power (14.6 %), are left out, as is their power. Their sub-carrier has harmonics 3, 5, 11, 13
//! and on and no fundamental: they lie 46 MHz and more from the middle, and 0.7 % of them, 0.1 % of the
//! whole, within ±32.5 MHz.

use super::e5::{self, Code};
use crate::signal::{Carrier, Codes, Component, Layer, Signal};

/// Definition of E5 with I/NAV on its upper and F/NAV on its lower sideband.
pub static E5: Signal = Signal {
    name: "Galileo E5",
    rinex: "8Q",
    carrier: Carrier::Common(1_191.795e6), // 2.1, table 2
    minimum_power_dbw: Some(-152.24),      // 2.7.1, table 12: −155.25 on either side
    components: &[
        side(&UP, &e5::E5B.components[0], &|number| code(Code::E5bData, number)),
        side(&UP, &e5::E5B.components[1], &|number| code(Code::E5bPilot, number)),
        side(&DOWN, &e5::E5A.components[0], &|number| code(Code::E5aData, number)),
        side(&DOWN, &e5::E5A.components[1], &|number| code(Code::E5aPilot, number)),
    ],
    ..e5::E5A
};

/// A component of E5a or E5b on the sub-carrier's side, with a quarter of the power.
const fn side(layers: &'static [Layer], alone: &Component, code: &'static Codes) -> Component {
    Component {
        power_share: 0.25,
        phase_cycles: alone.phase_cycles,
        chip_rate_hz: alone.chip_rate_hz,
        code_chips: alone.code_chips,
        code,
        layers,
        secondary_code: alone.secondary_code,
        message: alone.message,
    }
}

/// S(t) over the twelve eighths of an even chip, (√2+1)/2, 1/2, −1/2, −(√2+1)/2 and on, is a sum of its
/// signs, (2+√2)/4 of them, and of √2/4 times these with the smaller level inverted.
const SIGNS: Layer = Layer { weight: WEIGHTS[0], ..pulse(&[1, 1, -1, -1, -1, -1, 1, 1, 1, 1, -1, -1]) };
const LEVELS: Layer = Layer { weight: WEIGHTS[1], ..pulse(&[1, -1, 1, -1, -1, 1, -1, 1, 1, -1, 1, -1]) };
/// Subcarrier signs a quarter of the period later.
const SIGNS_LATER: Layer = Layer { weight: WEIGHTS[0], ..pulse(&[1, 1, 1, 1, -1, -1, -1, -1, 1, 1, 1, 1]) };
const LEVELS_LATER: Layer = Layer { weight: WEIGHTS[1], ..pulse(&[-1, 1, 1, -1, 1, -1, -1, 1, -1, 1, 1, -1]) };

/// (2+√2)/4 and √2/4 over the root of the whole's power, 1 + √2/2: cos(π/8)/√2 and sin(π/8)/√2.
const WEIGHTS: [f64; 2] = [0.653_281_482_438_188_3, 0.270_598_050_073_098_5];

const fn pulse(pulse: &'static [i8]) -> Layer {
    Layer { pulse, ..Layer::BPSK }
}

/// Layers of the lower sideband, S(t) − jS(t − Ts/4).
pub static DOWN: [Layer; 4] =
    [SIGNS, LEVELS, Layer { phase_cycles: -0.25, ..SIGNS_LATER }, Layer { phase_cycles: -0.25, ..LEVELS_LATER }];

/// Layers of the upper sideband, S(t) + jS(t − Ts/4).
pub static UP: [Layer; 4] =
    [SIGNS, LEVELS, Layer { phase_cycles: 0.25, ..SIGNS_LATER }, Layer { phase_cycles: 0.25, ..LEVELS_LATER }];

/// Chips of a satellite by its number, 1 to 50, as ±1; `None` beyond. Every second chip has the sign of the
/// subcarrier, which has one and a half periods in a chip.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let sign = |index: usize| planted!("gnss.altboc.odd_chips", if index % 2 == 1 { -1 } else { 1 }, 1);
    let chips = e5::code(which, number)?;
    Some(chips.into_iter().enumerate().map(|(index, chip)| sign(index) * chip).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_and_shares_are_those_of_the_printed_sub_carrier() {
        let root = f64::sqrt(2.0);
        // Table 6: eight levels of S(t), in halves.
        let printed = [root + 1.0, 1.0, -1.0, -root - 1.0, -root - 1.0, -1.0, 1.0, root + 1.0];
        let whole = (1.0 + 0.5 * root).sqrt();
        let level = |layers: &[Layer; 2], step: usize| -> f64 {
            layers.iter().map(|layer| whole * layer.weight * f64::from(layer.pulse[step])).sum()
        };
        for step in 0..12 {
            let near = |found: f64, eighth: usize| assert!((found - 0.5 * printed[eighth % 8]).abs() < 1e-12, "{step}");
            near(level(&[SIGNS, LEVELS], step), step);
            near(level(&[SIGNS_LATER, LEVELS_LATER], step), step + 6);
        }
        // 1/8 of the whole signal's power times 1 + √2/2 for each of four, 85.36 % together.
        assert!((4.0 * whole * whole / 8.0 - (2.0 + root) / 4.0).abs() < 1e-12);
    }
}
