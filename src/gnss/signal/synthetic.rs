//! Synthetic signals for tests, which no satellite sends. Together they have every property that signals may
//! have.
//!
//! Their codes are random. What assumes one BPSK component of 1 ms, one carrier, a code of ±1 or one time
//! scale goes wrong with one of them.

use super::{Carrier, Component, Layer, SecondaryCode, Signal, always};
use crate::galileo::altboc::{DOWN, UP};
use crate::galileo::fnav::FNAV;
use crate::galileo::inav::{INAV, INAV_E5B};
use crate::gps::lnav::LNAV;
use crate::satellite::System;
use crate::time::{GPST, GST, TimeScale};

/// All of them.
pub static SYNTHETIC: [&Signal; 6] = [&LONG_BOC, &QUADRATURE, &CHANNELS, &MULTIPLEXED, &MIXED, &SIDES];

/// Three seconds behind GPS time.
pub static OWN_TIME: TimeScale = TimeScale { name: "synthetic", behind_gpst_s: 3, has_leap_seconds: false };

/// Base of most of the signals.
const SIGNAL: Signal = Signal {
    name: "synthetic",
    rinex: "1X",
    system: System::Gps,
    time: &GPST,
    constellation: [1, 32],
    carrier: Carrier::Common(1_575.42e6),
    sent: always,
    minimum_power_dbw: None,
    components: &[],
};

/// Base of most of their components.
const COMPONENT: Component = Component {
    power_share: 0.5,
    phase_cycles: 0.0,
    chip_rate_hz: 1.023e6,
    code_chips: 0,
    code: &|_| None,
    layers: &[Layer::BPSK],
    secondary_code: SecondaryCode::None,
    message: None,
};

/// Test signal of two components with codes of 4 ms in BOC(1,1), in a time scale of its own. One has a coded
/// message of one symbol per period, the other a secondary code of 25 chips.
pub static LONG_BOC: Signal = Signal {
    name: "synthetic A",
    rinex: "1X",
    system: System::Galileo,
    time: &OWN_TIME,
    constellation: [1, 36],
    components: &[
        Component {
            code_chips: 4092,
            code: &|number| assigned(number, 36, || random(4092, u64::from(number))),
            layers: &[Layer::BOC11],
            message: Some(&INAV),
            ..COMPONENT
        },
        Component {
            phase_cycles: 0.5,
            code_chips: 4092,
            code: &|number| assigned(number, 36, || random(4092, 100 + u64::from(number))),
            layers: &[Layer::BOC11],
            secondary_code: SecondaryCode::Shared(&[
                1, 1, -1, -1, 1, 1, 1, 1, 1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, -1, 1, -1, -1, 1, -1,
            ]),
            ..COMPONENT
        },
    ],
    ..SIGNAL
};

/// Test signal with ten chips per microsecond, data and pilot in quadrature, and a secondary code on each, on
/// another carrier.
pub static QUADRATURE: Signal = Signal {
    name: "synthetic B",
    rinex: "5X",
    carrier: Carrier::Common(1_176.45e6),
    components: &[
        Component {
            chip_rate_hz: 10.23e6,
            code_chips: 10_230,
            code: &|number| assigned(number, 32, || random(10_230, 200 + u64::from(number))),
            secondary_code: SecondaryCode::Shared(&[1, 1, 1, 1, -1, -1, 1, -1, 1, -1]),
            ..COMPONENT
        },
        Component {
            phase_cycles: -0.25,
            chip_rate_hz: 10.23e6,
            code_chips: 10_230,
            code: &|number| assigned(number, 32, || random(10_230, 300 + u64::from(number))),
            secondary_code: SecondaryCode::PerSatellite {
                chips: 20,
                of: |number| assigned(number, 32, || random(20, 400 + u64::from(number))),
            },
            ..COMPONENT
        },
    ],
    ..SIGNAL
};

/// Test signal with quadrature data whose symbols begin where the secondary codes do.
pub static QUADRATURE_DATA: Signal = Signal {
    name: "synthetic B with data",
    components: &[
        Component { message: Some(&LNAV), ..QUADRATURE.components[0] },
        Component { ..QUADRATURE.components[1] },
    ],
    ..QUADRATURE
};

/// Test signal with one code for all satellites, each on its own carrier.
pub static CHANNELS: Signal = Signal {
    name: "synthetic C",
    rinex: "1P",
    system: System::Glonass,
    constellation: [1, 24],
    carrier: Carrier::Channels {
        centre_hz: 1_602e6,
        step_hz: 562_500.0,
        channel: |number| (1..=24).contains(&number).then(|| (number % 14) as i8 - 7),
    },
    components: &[Component {
        power_share: 1.0,
        chip_rate_hz: 0.511e6,
        code_chips: 511,
        code: &|number| assigned(number, 24, || random(511, 500)),
        ..COMPONENT
    }],
    ..SIGNAL
};

/// Test signal that alternates chips of codes of 10 230 and 767 250 chips.
pub static MULTIPLEXED: Signal = Signal {
    name: "synthetic D",
    rinex: "2X",
    carrier: Carrier::Common(1_227.60e6),
    components: &[
        Component {
            code_chips: 20_460,
            code: &|number| assigned(number, 32, || in_turn(10_230, 0, 600 + u64::from(number))),
            ..COMPONENT
        },
        Component {
            code_chips: 1_534_500,
            code: &|number| assigned(number, 32, || in_turn(767_250, 1, 700 + u64::from(number))),
            ..COMPONENT
        },
    ],
    ..SIGNAL
};

/// Test signal with multiplexed codes and data of one symbol per period on the shorter code.
pub static MULTIPLEXED_DATA: Signal = Signal {
    name: "synthetic D with data",
    components: &[
        Component { message: Some(&LNAV), ..MULTIPLEXED.components[0] },
        Component { ..MULTIPLEXED.components[1] },
    ],
    ..MULTIPLEXED
};

const SIX: [bool; 33] = chips_with_six(true);
const ONE: [bool; 33] = chips_with_six(false);

/// Test signal with a pilot in BOC(6,1) on four of 33 chips beside data in BOC(1,1), one to three in power.
pub static MIXED: Signal = Signal {
    name: "synthetic E",
    rinex: "1L",
    system: System::Qzss,
    constellation: [1, 10],
    components: &[
        Component {
            power_share: 0.75,
            code_chips: 10_230,
            code: &|number| assigned(number, 10, || random(10_230, 800 + u64::from(number))),
            layers: &[Layer { chips: &ONE, ..Layer::BOC11 }, Layer { chips: &SIX, ..Layer::BOC61 }],
            secondary_code: SecondaryCode::PerSatellite {
                chips: 1800,
                of: |number| assigned(number, 10, || random(1800, 900 + u64::from(number))),
            },
            ..COMPONENT
        },
        Component {
            power_share: 0.25,
            code_chips: 10_230,
            code: &|number| assigned(number, 10, || random(10_230, 1000 + u64::from(number))),
            layers: &[Layer::BOC11],
            ..COMPONENT
        },
    ],
    ..SIGNAL
};

/// Test signal with data and pilot on the two sidebands of a subcarrier, a tenth as fast as those of
/// Galileo's E5.
pub static SIDES: Signal = Signal {
    name: "synthetic F",
    rinex: "8X",
    system: System::Galileo,
    time: &GST,
    constellation: [1, 36],
    carrier: Carrier::Common(1_191.795e6),
    components: &[
        Component {
            phase_cycles: 0.0,
            code: &|number| assigned(number, 36, || random(2046, 1100 + u64::from(number))),
            secondary_code: SecondaryCode::Shared(&[1, -1]),
            message: Some(&INAV_E5B),
            ..UPPER_PILOT
        },
        UPPER_PILOT,
        Component {
            phase_cycles: 0.0,
            code: &|number| assigned(number, 36, || random(2046, 1400 + u64::from(number))),
            secondary_code: SecondaryCode::Shared(&[1, 1, -1, 1, -1, -1, -1, 1, 1, 1]),
            message: Some(&FNAV),
            ..LOWER_PILOT
        },
        LOWER_PILOT,
    ],
    ..SIGNAL
};

const UPPER_PILOT: Component = Component {
    power_share: 0.25,
    phase_cycles: 0.25,
    code_chips: 2046,
    code: &|number| assigned(number, 36, || random(2046, 1200 + u64::from(number))),
    layers: &UP,
    secondary_code: SecondaryCode::PerSatellite {
        chips: 20,
        of: |number| assigned(number, 36, || random(20, 1300 + u64::from(number))),
    },
    ..COMPONENT
};

const LOWER_PILOT: Component = Component {
    code: &|number| assigned(number, 36, || random(2046, 1500 + u64::from(number))),
    layers: &DOWN,
    secondary_code: SecondaryCode::PerSatellite {
        chips: 20,
        of: |number| assigned(number, 36, || random(20, 1600 + u64::from(number))),
    },
    ..UPPER_PILOT
};

const fn chips_with_six(six: bool) -> [bool; 33] {
    let mut chips = [!six; 33];
    (chips[0], chips[4], chips[6], chips[29]) = (six, six, six, six);
    chips
}

fn assigned(number: u8, last: u8, code: impl Fn() -> Vec<i8>) -> Option<Vec<i8>> {
    (1..=last).contains(&number).then(code)
}

/// Values of ±1 by a congruential generator (Knuth's multiplier).
fn random(length: usize, seed: u64) -> Vec<i8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let next = |_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if state >> 63 == 1 { -1 } else { 1 }
    };
    (0..length).map(next).collect()
}

/// `length` random chips at every other position from `first` on, zeros between.
fn in_turn(length: usize, first: usize, seed: u64) -> Vec<i8> {
    let mut chips = vec![0; 2 * length];
    chips.iter_mut().skip(first).step_by(2).zip(random(length, seed)).for_each(|(chip, value)| *chip = value);
    chips
}

#[cfg(test)]
mod tests {
    use super::super::tests::complete;
    use super::*;

    #[test]
    fn every_synthetic_signal_is_complete() {
        SYNTHETIC.into_iter().for_each(complete);
    }
}
