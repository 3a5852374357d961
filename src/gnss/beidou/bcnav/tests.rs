//! Error rates in noise of the codes over GF(64) of all three messages.

use crate::beidou::bcnav1::{CODE_2, CODE_3};
use crate::beidou::{bcnav2, bcnav3};
use crate::bits::number;
use crate::fec::ldpc64::product;

#[test]
fn all_codes_fulfil_their_checks_and_fail_between_shannon_s_limit_and_two_decibels_above_it() {
    let mut state = 3_u64;
    // Sums of twelve uniform numbers (Knuth's multiplier).
    let mut normal = || {
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1_u64 << 24) as f32
        };
        (0..12).map(|_| uniform()).sum::<f32>() - 6.0
    };
    for code in [&*CODE_2, &*CODE_3, &*bcnav2::CODE, &*bcnav3::CODE] {
        let half = 6 * code.checks().len();
        let sent: Vec<bool> = (0..half).map(|_| normal() > 0.0).collect();
        let word = code.encode(&sent);
        assert_eq!(word.len(), 2 * half);
        let element = |place: usize| number(&word[6 * place..6 * place + 6]) as u8;
        let sum =
            |row: &Vec<(usize, u8)>| row.iter().fold(0, |sum, (place, factor)| sum ^ product(*factor, element(*place)));
        assert!(code.checks().iter().all(|row| sum(row) == 0));
        // As the test of the binary codes has it: nothing is reliable at 0.19 dB; short words of this field
        // lose little against the best there are, 0.9 dB (1200 symbols) to 1.6 dB (528) for one in a hundred.
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
