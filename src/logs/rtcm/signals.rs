//! Satellites and signals in the masks of Multiple Signal Messages.
//!
//! Source: RTCM 10403.3, tables 3.5-91 to 3.5-108; numbers of messages by 3.5.16. A list of bits with RINEX
//! codes is read in both directions. Limits: signals that the tables leave open, such as NavIC's on S and
//! L1, have no bit.

use gnss::glonass::fdma;
use gnss::satellite::{Sv, System};
use gnss::signal::band_hz;

/// Systems by the tens of their messages' numbers, with the names of MSM4 to MSM7.
pub const SYSTEMS: [(u64, System, [&str; 4]); 7] = [
    (107, System::Gps, ["1074", "1075", "1076", "1077"]),
    (108, System::Glonass, ["1084", "1085", "1086", "1087"]),
    (109, System::Galileo, ["1094", "1095", "1096", "1097"]),
    (110, System::Sbas, ["1104", "1105", "1106", "1107"]),
    (111, System::Qzss, ["1114", "1115", "1116", "1117"]),
    (112, System::BeiDou, ["1124", "1125", "1126", "1127"]),
    (113, System::Navic, ["1134", "1135", "1136", "1137"]),
];

/// Number of satellites in the mask of a system, and how much a satellite's number is above its bit.
fn satellites(system: System) -> (u8, u8) {
    match system {
        System::Gps => (32, 0),
        System::Glonass => (24, 0),
        System::Galileo => (36, 0),
        // PRN 120 is S20.
        System::Sbas => (39, 19),
        System::Qzss => (10, 0),
        System::BeiDou => (63, 0),
        System::Navic => (14, 0),
    }
}

/// Satellite of a bit of the mask, counted from 1.
pub fn satellite(system: System, bit: u8) -> Option<Sv> {
    let (last, more) = satellites(system);
    (bit <= last).then_some(Sv { system, number: bit + more })
}

/// Bit of a satellite in the mask, counted from 1.
pub fn satellite_bit(sv: Sv) -> Option<u8> {
    let (last, more) = satellites(sv.system);
    sv.number.checked_sub(more).filter(|bit| (1..=last).contains(bit))
}

/// Bit of a RINEX code in the signal mask, counted from 1, with the code.
pub fn signal_bit(system: System, code: &str) -> Option<(u8, &'static str)> {
    codes(system).iter().find(|(_, known)| *known == code).copied()
}

/// RINEX code of a bit of the signal mask, counted from 1.
pub fn code(system: System, bit: u8) -> Option<&'static str> {
    codes(system).iter().find(|(known, _)| *known == bit).map(|(_, code)| *code)
}

/// Bits with their RINEX codes.
fn codes(system: System) -> &'static [(u8, &'static str)] {
    match system {
        System::Gps => GPS,
        System::Glonass => &[(2, "1C"), (3, "1P"), (8, "2C"), (9, "2P")],
        System::Galileo => GALILEO,
        System::Sbas => &[(2, "1C"), (22, "5I"), (23, "5Q"), (24, "5X")],
        System::Qzss => QZSS,
        System::BeiDou => BEIDOU,
        System::Navic => &[(22, "5A")],
    }
}

#[rustfmt::skip]
const GPS: &[(u8, &str)] = &[
    (2, "1C"), (3, "1P"), (4, "1W"), (8, "2C"), (9, "2P"), (10, "2W"), (15, "2S"), (16, "2L"), (17, "2X"),
    (22, "5I"), (23, "5Q"), (24, "5X"), (30, "1S"), (31, "1L"), (32, "1X"),
];
#[rustfmt::skip]
const GALILEO: &[(u8, &str)] = &[
    (2, "1C"), (3, "1A"), (4, "1B"), (5, "1X"), (6, "1Z"), (8, "6C"), (9, "6A"), (10, "6B"), (11, "6X"),
    (12, "6Z"), (14, "7I"), (15, "7Q"), (16, "7X"), (18, "8I"), (19, "8Q"), (20, "8X"), (22, "5I"), (23, "5Q"),
    (24, "5X"),
];
#[rustfmt::skip]
const QZSS: &[(u8, &str)] = &[
    (2, "1C"), (9, "6S"), (10, "6L"), (11, "6X"), (15, "2S"), (16, "2L"), (17, "2X"), (22, "5I"), (23, "5Q"),
    (24, "5X"), (30, "1S"), (31, "1L"), (32, "1X"),
];
#[rustfmt::skip]
const BEIDOU: &[(u8, &str)] = &[
    (2, "2I"), (3, "2Q"), (4, "2X"), (8, "6I"), (9, "6Q"), (10, "6X"), (14, "7I"), (15, "7Q"), (16, "7X"),
    (22, "5D"), (23, "5P"), (24, "5X"), (25, "7D"), (30, "1D"), (31, "1P"), (32, "1X"),
];

/// Carrier of a signal, Hz; of GLONASS that of a channel, or of the slot's (RINEX 4.02, table 23).
pub fn carrier_hz(sv: Sv, code: &str, channel: Option<i8>) -> Option<f64> {
    band_hz(sv.system, *code.as_bytes().first()?, channel.or_else(|| fdma::channel(sv.number)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_names_are_each_other() {
        for (_, system, _) in SYSTEMS {
            for bit in 1..=64 {
                if let Some(sv) = satellite(system, bit) {
                    assert_eq!(satellite_bit(sv), Some(bit), "{sv}");
                }
                if let Some(code) = code(system, bit) {
                    assert_eq!(signal_bit(system, code), Some((bit, code)), "{system} {code}");
                }
            }
        }
        assert_eq!(satellite_bit(Sv { system: System::Sbas, number: 19 }), None);
        assert_eq!(satellite_bit(Sv::gps(33)), None);
    }
}
