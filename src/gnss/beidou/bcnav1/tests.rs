//! Error rates of the two codes in noise, and the printed words of subframe 1.

use super::*;

#[test]
fn words_of_number_and_time_are_the_printed_ones() {
    // BDS-SIS-ICD-B1C 1.0, 6.2.1: numbers 1 to 3 and times 1 and 2 in hexadecimal.
    let word = |bits: &[bool]| number(bits) as u64;
    for (prn, expected) in [(1, 0x00_A4CB), (2, 0x01_4996), (3, 0x01_ED5D)] {
        assert_eq!(word(&first_symbols(prn, 0)[..21]), expected);
    }
    for (time, expected) in [(1, 0x0F3A_905B_4BE3), (2, 0x114F_B0ED_DC25)] {
        assert_eq!(word(&first_symbols(1, time)[21..]), expected);
    }
}

#[test]
fn both_codes_fulfil_their_checks_and_fail_between_shannon_s_limit_and_two_decibels_above_it() {
    let mut state = 3_u64;
    // Sums of twelve uniform numbers (Knuth's multiplier).
    let mut normal = || {
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1_u64 << 24) as f32
        };
        (0..12).map(|_| uniform()).sum::<f32>() - 6.0
    };
    for (code, half) in [(&*CODE_2, BITS_2), (&*CODE_3, BITS_3)] {
        let sent: Vec<bool> = (0..half).map(|_| normal() > 0.0).collect();
        let word = code.encode(&sent);
        assert_eq!((code.checks().len(), word.len()), (half / 6, 2 * half));
        let element = |place: usize| number(&word[6 * place..6 * place + 6]) as u8;
        let sum = |row: &Vec<(usize, u8)>| {
            row.iter().fold(0, |sum, (place, factor)| sum ^ crate::gnss::fec::ldpc64::product(*factor, element(*place)))
        };
        assert!(code.checks().iter().all(|row| sum(row) == 0));
        // As the test of the binary codes has it: nothing is reliable at 0.19 dB; short words of this field
        // lose little against the best there are, 0.9 dB (1200 symbols) and 1.6 dB (528) for one in a
        // hundred.
        let mut failing = |ebn0_db: f64, words: u32| {
            let amplitude = libm::pow(10.0, ebn0_db / 20.0) as f32;
            let failed = (0..words).filter(|_| {
                let sent: Vec<bool> = (0..half).map(|_| normal() > 0.0).collect();
                let received = code.encode(&sent).into_iter().map(|one| if one { -amplitude } else { amplitude });
                let received: Vec<f32> = received.map(|value| value + normal()).collect();
                code.decode(&received).as_ref() != Some(&sent)
            });
            failed.count() as f64 / f64::from(words)
        };
        let (never, often) = (failing(0.19, 12), failing(2.2, 60));
        println!("{half}: {never} at 0.19 dB, {often} at 2.2 dB");
        assert!(never > 0.5 && often < 0.04, "{half}: {never} {often}");
    }
}
