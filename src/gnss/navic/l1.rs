//! NavIC L1: a pilot and data in synthesised BOC with codes of 10 230 chips at 1.023 Mchip/s on 1575.42 MHz,
//! the pilot under a secondary code of 1800 chips of the satellite's own.
//!
//! Source: NavIC SPS ICD for L1 1.0 (ISRO, August 2023). Codes and secondary codes are interleaved Z4-linear:
//! two registers, of which the second is fed back with what adding seven cells of the first carries.
//! Secondary code and message begin together, every 18 s of the week. Satellites of the second generation
//! send it: of those in orbit NVS-01 alone, number 10, at the latest since the day of the record of its
//! message that RINEX 4.02 prints.
//!
//! Limits, all for want of a second source: weights, signs and the quarter of a cycle between pilot and data
//! are as in the literature on the signal; the least power is unchecked; the product that keeps the envelope
//! constant is the data's code on BOC(6,1), and counts as part of the data.

use crate::navic::l1nav::L1_NAV;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal};
use crate::time::{Epoch, IRNSST};

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 10_230;
/// Chips of a secondary code, one per code period.
pub const SECONDARY_CODE_CHIPS: u32 = 1800;

/// Definition of the signal: the pilot, and data with the message of L1.
pub static L1: Signal = Signal {
    name: "NavIC L1",
    rinex: "1P",
    system: System::Navic,
    time: &IRNSST,
    constellation: [1, 14],
    carrier: Carrier::Common(1_575.42e6),
    sent,
    minimum_power_dbw: Some(-159.0),
    components: &[
        Component {
            power_share: 64.0 / 110.0,
            phase_cycles: 0.0,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Pilot, number),
            // √(60/64) and √(4/64): of the whole 6/11 and 4/110.
            layers: &[
                Layer { weight: 0.968_245_836_551_854_2, ..Layer::BOC11 },
                Layer { weight: -0.25, ..Layer::BOC61 },
            ],
            secondary_code: SecondaryCode::PerSatellite { chips: SECONDARY_CODE_CHIPS, of: secondary_code },
            message: None,
        },
        Component {
            power_share: 46.0 / 110.0,
            phase_cycles: 0.25,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Data, number),
            // √(40/46) and √(6/46): of the whole 4/11, and 6/110 of the product.
            layers: &[
                Layer { weight: 0.932_504_808_240_313_8, ..Layer::BOC11 },
                Layer { weight: 0.361_157_559_257_307_6, ..Layer::BOC61 },
            ],
            secondary_code: SecondaryCode::None,
            message: Some(&L1_NAV),
        },
    ],
};

/// True if the satellite with this number sends the signal at a time.
pub fn sent(number: u8, at: Epoch) -> bool {
    number == 10 && Epoch::parse("2023-06-24T00:00:00").is_ok_and(|since| at.since(since) >= 0.0)
}

/// Component to which a code of a satellite belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Code of the data component.
    Data,
    /// Code of the pilot.
    Pilot,
}

/// Chips of a satellite by its number, 1 to 14, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let (data, pilot, _) = *STARTS.get(usize::from(number).checked_sub(1)?)?;
    let [first, second, turning] = match which {
        Code::Data => data,
        Code::Pilot => pilot,
    };
    // A third register of five cells turns.
    let turn = |chip: usize| turning >> (4 - chip % 5) & 1 == 1;
    let chips = RANGING.chips([first, second]).enumerate().map(|(chip, one)| one ^ turn(chip));
    Some(chips.take(CODE_CHIPS as usize).map(sign).collect())
}

/// Secondary code of a satellite by its number, 1 to 14, as ±1; `None` beyond.
pub fn secondary_code(number: u8) -> Option<Vec<i8>> {
    let (.., starts) = *STARTS.get(usize::from(number).checked_sub(1)?)?;
    Some(SECONDARY_CODES.chips(starts).take(SECONDARY_CODE_CHIPS as usize).map(sign).collect())
}

fn sign(one: bool) -> i8 {
    if one { -1 } else { 1 }
}

/// Two registers of as many cells; cell 0, the output, is the most significant of their bits.
struct Registers {
    cells: u32,
    /// Cells of each register whose sum is fed back to the register itself.
    fed: u64,
    /// Cells of the first register whose sum goes to the second, beside the carry of the others.
    across: u64,
}

const RANGING: Registers =
    Registers { cells: 55, fed: cells(55, &[50, 45, 40, 20, 10, 5, 0]), across: cells(55, &[40, 35, 30, 25, 15, 0]) };
const SECONDARY_CODES: Registers =
    Registers { cells: 10, fed: cells(10, &[5, 2, 1, 0]), across: cells(10, &[6, 3, 2, 0]) };

/// The bits of some cells of a register.
const fn cells(of: u32, places: &[u32]) -> u64 {
    let (mut bits, mut at) = (0, 0);
    while at < places.len() {
        bits |= 1 << (of - 1 - places[at]);
        at += 1;
    }
    bits
}

impl Registers {
    /// Output of the second register for its two first states.
    fn chips(&self, [mut first, mut second]: [u64; 2]) -> impl Iterator<Item = bool> {
        let step = |register: u64, back: u64| (register << 1 | back & 1) & ((1 << self.cells) - 1);
        std::iter::repeat_with(move || {
            let out = second >> (self.cells - 1) & 1 == 1;
            // The sum of cells modulo 4: its lower bit goes back, its upper one to the other register.
            let ones = u64::from((first & self.fed).count_ones());
            let carry = planted!("gnss.navic.carry", ones >> 1, 0);
            let other = (first & self.across).count_ones() + (second & self.fed).count_ones();
            second = step(second, carry ^ u64::from(other));
            first = step(first, ones);
            out
        })
    }
}

/// First states of both registers and of the one that turns: of the data's code and of the pilot's, and of
/// the secondary code's registers; numbers 1 to 14.
#[rustfmt::skip]
const STARTS: [([u64; 3], [u64; 3], [u64; 2]); 14] = [
    ([0o0061727026503255544, 0o0377627103341647600, 0b10100], [0o0227743641272102303, 0o1667217344450257245, 0b01000],
        [0o0673, 0o0460]),
    ([0o1660130752435362260, 0o0047555332635133703, 0b10100], [0o0603070242564637717, 0o0300642746017221737, 0b00000],
        [0o0750, 0o0602]),
    ([0o0676457016477551225, 0o0570574070736102152, 0b00110], [0o0746325144437416120, 0o0474006332201753645, 0b01000],
        [0o1401, 0o1621]),
    ([0o1763467705267605701, 0o0511013576745450615, 0b10100], [0o0023763714573206044, 0o0613606702460402137, 0b00000],
        [0o0666, 0o0563]),
    ([0o1614265052776007236, 0o1216243446624447775, 0b10100], [0o0155575663373106723, 0o1465531713404064713, 0b01000],
        [0o0430, 0o1306]),
    ([0o1446113457553463523, 0o0176452272675511054, 0b00110], [0o0022277536552741033, 0o1063646422557130427, 0b01000],
        [0o0374, 0o1257]),
    ([0o1467417471470124574, 0o0151055342317137706, 0b10100], [0o0137757627072411730, 0o1066060465055002004, 0b00000],
        [0o0145, 0o1610]),
    ([0o0022513456555401603, 0o1127720116046071664, 0b00110], [0o0413034001670700216, 0o0225574416605070652, 0b01000],
        [0o1705, 0o0120]),
    ([0o0004420115402210365, 0o0514407436155575524, 0b00110], [0o0501123675324707024, 0o1733560674073230405, 0b00000],
        [0o0314, 0o1374]),
    ([0o0072276243316574510, 0o0253070462740453542, 0b00110], [0o0013727517464264567, 0o1116277147142260461, 0b00000],
        [0o1032, 0o0425]),
    ([0o1632356715721616750, 0o0573371306324706336, 0b10100], [0o0663351450332761127, 0o0152604753526345370, 0b00000],
        [0o0111, 0o1404]),
    ([0o1670164755420300763, 0o1315135317732077306, 0b00110], [0o1450710073416110356, 0o1110300535412261305, 0b01000],
        [0o0653, 0o0736]),
    ([0o1752127524253360255, 0o1170303027726635012, 0b10100], [0o1716542347100366110, 0o1046105227571557243, 0b01000],
        [0o0560, 0o1163]),
    ([0o0262220014044243135, 0o1637171270537414673, 0b00110], [0o0743601273016301212, 0o1020346561064461527, 0b00000],
        [0o0263, 0o1152]),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_envelope_is_constant_and_a_ninth_of_the_power_in_boc_1_1_is_in_boc_6_1() {
        let [pilot, data] = L1.components else { panic!() };
        let share = |component: &Component, layer: usize| {
            let weight = component.layers[layer].weight;
            component.power_share * weight * weight
        };
        let [one, six] = [0, 1].map(|layer| share(pilot, layer) + share(data, layer));
        assert!((one - 10.0 / 11.0).abs() < 1e-12 && (six - 1.0 / 11.0).abs() < 1e-12, "{one} {six}");
        // BOC(6,1) has the sign of BOC(1,1) or the other; chips of both codes only turn the whole.
        let power = |relative: f64| {
            let amplitude = |component: &Component| {
                let [one, six] = component.layers else { panic!() };
                component.power_share.sqrt() * (one.weight + relative * six.weight)
            };
            let [i, q] = [pilot, data].map(amplitude);
            i * i + q * q
        };
        assert!((power(1.0) - 1.0).abs() < 1e-12 && (power(-1.0) - 1.0).abs() < 1e-12);
        assert_eq!((pilot.phase_cycles, data.phase_cycles), (0.0, 0.25));
    }

    #[test]
    fn nvs_01_alone_sends_it_and_codes_are_those_of_fourteen_numbers() {
        let now = Epoch::parse("2026-03-09T10:00:00").unwrap();
        assert_eq!((1..=255).filter(|&number| sent(number, now)).collect::<Vec<u8>>(), [10]);
        assert!(!sent(10, Epoch::parse("2023-05-29T00:00:00").unwrap()));
        assert!(L1.code(0).is_none() && L1.code(15).is_none());
        assert_eq!(L1.satellites().count(), 14);
    }
}
