//! Every chip of every code against digests that another program computed from the same tables.

use gnss::galileo::e1::{self, Code};
use gnss::galileo::e5;
use gnss::galileo::e6;
use gnss::gps::l1ca::{CODE_CHIPS, L1_CA, code};
use gnss::gps::{l1c, l2c, l5};
use gnss::qzss;
use gnss::signal::{SecondaryCode, Signal};
use sha2::{Digest, Sha256};

/// PRN, ones, first and last 24 chips in hexadecimal, SHA-256 of a byte 0 or 1 for each chip.
const CODES: &str = include_str!("../../data/witness/l1ca_codes.csv");

#[test]
fn all_chips_of_all_codes_are_those_of_another_program() {
    let mut codes = 0;
    for line in CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let chips: Vec<u8> = code(column[0].parse().unwrap()).unwrap().into_iter().map(u8::from).collect();
        assert_eq!(chips.len(), CODE_CHIPS as usize);
        holds(&chips, &column[1..], line);
        codes += 1;
    }
    assert_eq!(codes, 86);
    assert!([0, 38, 119, 159, 192, 203].into_iter().all(|prn| code(prn).is_none()));
}

/// Code, number, ones, first and last 24 chips in hexadecimal, SHA-256 of a byte 0 or 1 for each chip.
const MEMORY_CODES: &str = include_str!("../../data/witness/e1_codes.csv");

#[test]
fn all_chips_of_all_memory_codes_are_those_of_another_program() {
    let mut codes = 0;
    for line in MEMORY_CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let which = if column[0] == "E1B" { Code::Data } else { Code::Pilot };
        let signs = e1::code(which, column[1].parse().unwrap()).unwrap();
        let chips: Vec<u8> = signs.into_iter().map(|sign| u8::from(sign < 0)).collect();
        assert_eq!(chips.len(), e1::CODE_CHIPS as usize);
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 100);
}

/// Code, number, ones, first and last 24 chips and SHA-256 of the register codes; the secondary codes of 100
/// chips are named `CS100`.
const REGISTER_CODES: &str = include_str!("../../data/witness/e5_codes.csv");

#[test]
fn all_chips_of_all_codes_and_secondary_codes_of_e5_are_those_of_another_program() {
    let mut codes = 0;
    for line in REGISTER_CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let number = column[1].parse().unwrap();
        let signs = match column[0] {
            "E5AI" => e5::code(e5::Code::E5aData, number),
            "E5AQ" => e5::code(e5::Code::E5aPilot, number),
            "E5BI" => e5::code(e5::Code::E5bData, number),
            "E5BQ" => e5::code(e5::Code::E5bPilot, number),
            _ => e5::secondary_code(number),
        };
        let chips: Vec<u8> = signs.unwrap().into_iter().map(|sign| u8::from(sign < 0)).collect();
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 300);
    assert!(e5::code(e5::Code::E5aData, 0).is_none() && e5::code(e5::Code::E5aData, 51).is_none());
    assert!(e5::secondary_code(0).is_none() && e5::secondary_code(101).is_none());
    // Which satellite has which secondary code, and those of the data (Galileo OS SIS ICD 2.1, tables 17 to
    // 19).
    let chips = |secondary_code: &SecondaryCode, number| secondary_code.of(number).unwrap();
    for number in [1, 17, 50] {
        assert_eq!(chips(&e5::E5A.components[1].secondary_code, number), e5::secondary_code(number).unwrap());
        assert_eq!(chips(&e5::E5B.components[1].secondary_code, number), e5::secondary_code(number + 50).unwrap());
    }
    let word = |chips: Vec<i8>| chips.iter().fold(0, |word, chip| word << 1 | u32::from(*chip < 0));
    assert_eq!(word(chips(&e5::E5A.components[0].secondary_code, 1)), 0x842E9);
    assert_eq!(word(chips(&e5::E5B.components[0].secondary_code, 1)), 0xE);
}

/// Code, number, ones, first and last 24 chips and SHA-256 of E6-B and E6-C.
const E6_CODES: &str = include_str!("../../data/witness/e6_codes.csv");

#[test]
fn all_chips_of_all_codes_of_e6_are_those_of_another_program() {
    let mut codes = 0;
    for line in E6_CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let which = if column[0] == "E6B" { Code::Data } else { Code::Pilot };
        let signs = e6::code(which, column[1].parse().unwrap()).unwrap();
        let chips: Vec<u8> = signs.into_iter().map(|sign| u8::from(sign < 0)).collect();
        assert_eq!(chips.len(), e6::CODE_CHIPS as usize);
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 100);
    assert!([0, 51].into_iter().all(|number| e6::code(Code::Pilot, number).is_none()));
    // The pilot's secondary code is that of E5a's (E6-B/C codes technical note).
    assert_eq!(e6::E6.components[1].secondary_code.of(17), e5::secondary_code(17));
}

/// Code, number, ones, first and last 24 chips and SHA-256 of I5 and Q5.
const L5_CODES: &str = include_str!("../../data/witness/l5_codes.csv");

#[test]
fn all_chips_of_all_codes_of_l5_are_those_of_another_program() {
    let mut codes = 0;
    for line in L5_CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let which = if column[0] == "L5I" { l5::Code::Data } else { l5::Code::Pilot };
        let signs = l5::code(which, column[1].parse().unwrap()).unwrap();
        let chips: Vec<u8> = signs.into_iter().map(|sign| u8::from(sign < 0)).collect();
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 420);
    assert!(l5::code(l5::Code::Data, 0).is_none() && l5::code(l5::Code::Pilot, 211).is_none());
    // IS-GPS-705J, 3.3.3.1.2: the Neuman-Hofman codes.
    let word = |secondary_code: &SecondaryCode| {
        secondary_code.of(1).unwrap().iter().fold(0, |word, chip| word << 1 | u32::from(*chip < 0))
    };
    assert_eq!(word(&l5::L5.components[0].secondary_code), 0b00_0011_0101);
    assert_eq!(word(&l5::L5.components[1].secondary_code), 0b0000_0100_1101_0100_1110);
}

/// Code, number, ones, first and last 24 chips and SHA-256 of CM and CL.
const L2C_CODES: &str = include_str!("../../data/witness/l2c_codes.csv");

#[test]
fn all_chips_of_all_codes_of_l2c_are_those_of_another_program_and_take_turns() {
    let mut codes = 0;
    for line in L2C_CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let (which, place) = if column[0] == "L2CM" { (l2c::Code::Moderate, 0) } else { (l2c::Code::Long, 1) };
        let number = column[1].parse().unwrap();
        let signs = l2c::code(which, number).unwrap();
        let chips: Vec<u8> = signs.iter().map(|sign| u8::from(*sign < 0)).collect();
        holds(&chips, &column[2..], line);
        codes += 1;
        // CM first (IS-GPS-200N, 3.2.1.5, figure 3-8).
        let sent = (l2c::L2C.components[place].code)(number).filter(|_| number <= 3);
        for (at, chip) in sent.into_iter().flatten().enumerate() {
            assert_eq!(chip, if at % 2 == place { signs[at / 2] } else { 0 }, "{line} {at}");
        }
    }
    assert_eq!(codes, 230);
    assert!([0, 64, 158, 211].iter().all(|number| l2c::code(l2c::Code::Long, *number).is_none()));
}

/// Code, number, ones, first and last 24 chips and SHA-256 of L1C-D and L1C-P; the secondary codes of 1800
/// chips are named `L1CO`.
const L1C_CODES: &str = include_str!("../../data/witness/l1c_codes.csv");

#[test]
fn all_chips_of_all_codes_and_secondary_codes_of_l1c_are_those_of_another_program() {
    let mut codes = 0;
    for line in L1C_CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let number = column[1].parse().unwrap();
        let signs = match column[0] {
            "L1CD" => l1c::code(l1c::Code::Data, number),
            "L1CP" => l1c::code(l1c::Code::Pilot, number),
            _ => l1c::secondary_code(number),
        };
        let chips: Vec<u8> = signs.unwrap().into_iter().map(|sign| u8::from(sign < 0)).collect();
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 219);
    let none = |number: &u8| l1c::code(l1c::Code::Data, *number).is_none() && l1c::secondary_code(*number).is_none();
    assert!([0, 64, 192, 203].iter().all(none));
}

/// RINEX 4.02, table 2: J01 is PRN 193. What codes PRN 193 to 202 have is held above.
#[test]
fn satellites_of_qzss_have_the_codes_of_the_prn_that_rinex_names_and_those_of_gps_do_not() {
    let all = [(&qzss::l1c::L1C, &l1c::L1C), (&qzss::l2c::L2C, &l2c::L2C), (&qzss::l5::L5, &l5::L5)];
    for number in 1..=10 {
        let prn = 192 + number;
        let signs: Vec<i8> = code(prn).unwrap().iter().map(|&one| if one { -1 } else { 1 }).collect();
        assert_eq!(qzss::l1ca::L1_CA.code(number).unwrap(), signs);
        let own = |signal: &Signal, place: usize| (signal.components[place].code)(number).unwrap();
        assert_eq!(own(&qzss::l1c::L1C, 0), l1c::code(l1c::Code::Pilot, prn).unwrap());
        assert_eq!(own(&qzss::l1c::L1C, 1), l1c::code(l1c::Code::Data, prn).unwrap());
        assert_eq!(qzss::l1c::L1C.components[0].secondary_code.of(number), l1c::secondary_code(prn));
        assert_eq!(own(&qzss::l5::L5, 0), l5::code(l5::Code::Data, prn).unwrap());
        assert_eq!(own(&qzss::l5::L5, 1), l5::code(l5::Code::Pilot, prn).unwrap());
        for (place, which) in [(0, l2c::Code::Moderate), (1, l2c::Code::Long)] {
            let of_turn: Vec<i8> = own(&qzss::l2c::L2C, place).into_iter().skip(place).step_by(2).collect();
            assert_eq!(of_turn, l2c::code(which, prn).unwrap());
        }
    }
    for (own, gps) in all {
        assert!(own.satellites().count() == 10 && gps.satellites().all(|sv| sv.number <= 63), "{own}");
    }
    assert!(L1_CA.satellites().all(|sv| sv.number <= 37));
}

/// The number of ones, the first and last 24 chips and the digest of a code.
pub fn holds(chips: &[u8], expected: &[&str], line: &str) {
    let word = |part: &[u8]| part.iter().fold(0_u32, |word, chip| word << 1 | u32::from(*chip));
    assert_eq!(chips.iter().map(|chip| usize::from(*chip)).sum::<usize>().to_string(), expected[0], "{line}");
    assert_eq!(format!("{:06X}", word(&chips[..24])), expected[1], "{line}");
    assert_eq!(format!("{:06X}", word(&chips[chips.len() - 24..])), expected[2], "{line}");
    let digest: String = Sha256::digest(chips).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(digest, expected[3], "{line}");
}
