//! GLONASS in G1 and G2 with frequency division: one code of 511 chips for all satellites, each on the
//! carrier of its channel.
//!
//! Source: GLONASS ICD L1, L2 5.1, 3.3.1.1 (carriers), 3.3.2.1 (code), 3.3.2.2 (data). The number of a
//! satellite is its slot. No document states which slot has which channel, and no satellite states its own
//! but in almanacs: [`channel`] is the assignment that navigation files have had since 2010, the same in
//! those of 2020, 2023, 2025 and 2026 that were looked at. Satellites that are opposite each other share a
//! channel: a receiver on the ground meets one of both, and learns from the message which. Limits: slots 1 to
//! 24; a satellite on another channel is left out where a file has it. The code at high accuracy, in
//! quadrature, is not sent.

use crate::glonass::gnav::GNAV;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal, always};
use crate::time::GLONASST;

/// Definition of the signal in the band around 1602 MHz.
pub static G1: Signal = Signal {
    name: "GLONASS G1",
    rinex: "1C",
    system: System::Glonass,
    time: &GLONASST,
    constellation: [1, SLOTS],
    carrier: Carrier::Channels { centre_hz: 1_602e6, step_hz: 562_500.0, channel },
    sent: always,
    minimum_power_dbw: Some(-161.0), // 3.3.1.6
    components: &[Component {
        power_share: 1.0,
        phase_cycles: 0.0,
        chip_rate_hz: 0.511e6,
        code_chips: 511,
        code: &|number| channel(number).map(|_| code()),
        layers: &[Layer::BPSK],
        secondary_code: SecondaryCode::None,
        message: Some(&GNAV),
    }],
};

/// Definition of the signal in the band around 1246 MHz, with the same code and message.
pub static G2: Signal = Signal {
    name: "GLONASS G2",
    rinex: "2C",
    carrier: Carrier::Channels { centre_hz: 1_246e6, step_hz: 437_500.0, channel },
    minimum_power_dbw: Some(-167.0), // 3.3.1.6
    ..G1
};

/// Slots of the constellation.
pub const SLOTS: u8 = 24;

/// Channels of slots 1 to 24.
const CHANNELS: [i8; SLOTS as usize] =
    [1, -4, 5, 6, 1, -4, 5, 6, -2, -7, 0, -1, -2, -7, 0, -1, 4, -3, 3, 2, 4, -3, 3, 2];

/// Number of the channel on which the satellite of a slot sends.
pub fn channel(slot: u8) -> Option<i8> {
    CHANNELS.get(usize::from(slot).checked_sub(1)?).copied()
}

/// The code (3.3.2.1): a register of nine stages, all ones at first, that feeds stages 5 and 9 back and gives
/// out the seventh.
fn code() -> Vec<i8> {
    let output = planted!("gnss.glonass.output", 6, 8);
    let mut stages = 0x1FF_u16;
    let chips = (0..511).map(|_| {
        let chip = if stages >> output & 1 == 1 { -1 } else { 1 };
        // Stage n is bit n − 1.
        stages = (stages << 1 | (stages >> 4 ^ stages >> 8) & 1) & 0x1FF;
        chip
    });
    chips.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::satellite::Sv;

    #[test]
    fn opposite_slots_share_a_channel_and_every_channel_has_two_slots_at_most() {
        for slot in 1..=SLOTS {
            // Eight slots a plane, four steps of 45 degrees from one to its opposite.
            let plane = (slot - 1) / 8 * 8;
            let opposite = plane + (slot - 1 - plane + 4) % 8 + 1;
            assert_eq!(channel(slot), channel(opposite), "{slot} {opposite}");
            assert_eq!((1..=SLOTS).filter(|other| channel(*other) == channel(slot)).count(), 2);
        }
        assert_eq!((channel(0), channel(25)), (None, None));
        let sv = Sv { system: System::Glonass, number: 10 };
        // 3.3.1.1, table 3.1: channel -7.
        assert_eq!((G1.carrier_hz(sv), G2.carrier_hz(sv)), (1_598_062_500.0, 1_242_937_500.0));
    }
}
