//! GPS L1 C/A: Gold codes of 1023 chips at 1.023 Mchip/s on 1575.42 MHz.
//!
//! Source: IS-GPS-200N, 3.3.2.3 and table 3-Ia. The codes of PRN 1 to 37 are made from the two printed
//! registers and the G2 delays; PRN 34 and 37 share a code, as the table states. Those of PRN 120 to 158 are
//! of augmentation systems and those of PRN 193 to 202 of QZSS (IS-GPS-200N, table 6-I).

use crate::gps::lnav::LNAV;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal, always};
use crate::time::GPST;

/// Chips in a C/A code period.
pub const CODE_CHIPS: u32 = 1023;

/// Definition of the signal.
pub static L1_CA: Signal = Signal {
    name: "GPS L1 C/A",
    rinex: "1C",
    system: System::Gps,
    time: &GPST,
    constellation: [1, 32], // IS-GPS-200N, table 3-Ia, note: 33 to 37 are reserved for other uses
    carrier: Carrier::Common(1_575.42e6), // IS-GPS-200N, 3.3.1.1
    sent: always,
    minimum_power_dbw: Some(-158.5), // IS-GPS-200N, table 3-Va
    components: &[Component {
        power_share: 1.0,
        phase_cycles: 0.0,
        chip_rate_hz: 1.023e6, // IS-GPS-200N, 3.3.2.3
        code_chips: CODE_CHIPS,
        code: &|prn| Some(gps(prn).and_then(code)?.iter().map(|&one| if one { -1 } else { 1 }).collect()),
        layers: &[Layer::BPSK],
        secondary_code: SecondaryCode::None,
        message: Some(&LNAV),
    }],
};

/// Delay of G2 in chips for PRN 1 to 37 (IS-GPS-200N, table 3-Ia, "G2 delay").
const G2_DELAY_CHIPS: [usize; 37] = [
    5, 6, 7, 8, 17, 18, 139, 140, 141, 251, 252, 254, 255, 256, 257, 258, 469, 470, 471, 472, 473, 474, 509, 512, 513,
    514, 515, 516, 859, 860, 861, 862, 863, 950, 947, 948, 950,
];

/// Delay of G2 in chips for PRN 120 to 158, of augmentation systems (IS-GPS-200N, table 6-I).
const SBAS_G2_DELAY_CHIPS: [usize; 39] = [
    145, 175, 52, 21, 237, 235, 886, 657, 634, 762, 355, 1012, 176, 603, 130, 359, 595, 68, 386, 797, 456, 499, 883,
    307, 127, 211, 121, 118, 163, 628, 853, 484, 289, 811, 202, 1021, 463, 568, 904,
];
const FIRST_OF_SBAS: u8 = 120;

/// Delay of G2 in chips for PRN 193 to 202, of QZSS (IS-GPS-200N, table 6-I; IS-QZSS-PNT-005, table 3.2.2-1).
const QZSS_G2_DELAY_CHIPS: [usize; 10] = [339, 208, 711, 189, 263, 537, 663, 942, 173, 900];
const FIRST_OF_QZSS: u8 = 193;

/// Numbers of GPS satellites; the others are those of other systems.
fn gps(prn: u8) -> Option<u8> {
    (usize::from(prn) <= G2_DELAY_CHIPS.len()).then_some(prn)
}

/// The C/A code of a PRN from 1 to 37, 120 to 158 or 193 to 202 (IS-GPS-200N, 3.3.2.3, figures 3-8 to 3-10).
pub fn code(prn: u8) -> Option<Vec<bool>> {
    let delay = match prn {
        FIRST_OF_QZSS.. => *QZSS_G2_DELAY_CHIPS.get(usize::from(prn - FIRST_OF_QZSS))?,
        FIRST_OF_SBAS.. => *SBAS_G2_DELAY_CHIPS.get(usize::from(prn - FIRST_OF_SBAS))?,
        _ => *G2_DELAY_CHIPS.get(usize::from(prn).checked_sub(1)?)?,
    };
    let delay = planted!("gnss.sbas.codes", delay, delay + usize::from(prn == 131));
    let delay = planted!("gnss.qzss.codes", delay, delay + usize::from(prn > FIRST_OF_QZSS));
    let delay = planted!("gnss.code.g2_delay", delay, delay + usize::from(prn == 32));
    let g1 = register(&[3, 10]);
    let g2 = register(planted!("gnss.code.g2_taps", &[2, 3, 6, 8, 9, 10][..], &[2, 3, 6, 8, 10][..]));
    let length = CODE_CHIPS as usize;
    let late = |i: usize| planted!("gnss.code.chips_beyond_512", i, i + usize::from(i > 512));
    let delayed = |i: usize| late(i).checked_sub(delay).unwrap_or(late(i) + length - delay);
    Some((0..length).map(|i| g1[i] ^ g2[delayed(i)]).collect())
}

/// One period of a ten-stage register that starts with all ones; `taps` are the stages fed back.
fn register(taps: &[usize]) -> Vec<bool> {
    // Stage 1 in the lowest bit.
    let fed_back = taps.iter().fold(0, |mask, stage| mask | 1_u16 << (stage - 1));
    let mut stages = 0x3ff_u16;
    (0..CODE_CHIPS)
        .map(|_| {
            let output = stages >> 9 & 1 == 1;
            let feedback = (stages & fed_back).count_ones() as u16 & 1;
            stages = (stages << 1 | feedback) & 0x3ff;
            output
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_ten_chips_are_the_printed_octal_of_every_prn() {
        // IS-GPS-200N, table 3-Ia, "first 10 chips octal".
        const FIRST_TEN: [u32; 37] = [
            0o1440, 0o1620, 0o1710, 0o1744, 0o1133, 0o1455, 0o1131, 0o1454, 0o1626, 0o1504, 0o1642, 0o1750, 0o1764,
            0o1772, 0o1775, 0o1776, 0o1156, 0o1467, 0o1633, 0o1715, 0o1746, 0o1763, 0o1063, 0o1706, 0o1743, 0o1761,
            0o1770, 0o1774, 0o1127, 0o1453, 0o1625, 0o1712, 0o1745, 0o1713, 0o1134, 0o1456, 0o1713,
        ];
        for (index, expected) in FIRST_TEN.iter().enumerate() {
            let code = code(index as u8 + 1).unwrap();
            let first = code[..10].iter().fold(0, |word, &chip| word << 1 | u32::from(chip));
            assert_eq!(first, *expected, "PRN {}", index + 1);
        }
        assert!(code(0).is_none() && code(38).is_none());
    }

    #[test]
    fn autocorrelation_takes_only_the_values_of_a_gold_code() {
        for prn in 1..=37 {
            let code = code(prn).unwrap();
            for shift in 1..1023 {
                let agreements = (0..1023).filter(|&i| code[i] == code[(i + shift) % 1023]).count() as i32;
                assert!([-65, -1, 63].contains(&(2 * agreements - 1023)), "PRN {prn} shift {shift}");
            }
        }
    }
}
