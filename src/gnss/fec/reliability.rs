//! Error rates of binary codes of rate one half in noise, with which tests of messages compare.

use super::ldpc::Ldpc;

/// Normal numbers: sums of twelve uniform ones (Knuth's multiplier).
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f32 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1_u64 << 24) as f32
        };
        (0..12).map(|_| uniform()).sum::<f32>() - 6.0
    }
}

/// Share of code words that come wrong or not at all at a ratio of the energy of a bit to the noise.
fn failing(code: &Ldpc, half: usize, ebn0_db: f64, words: u32) -> f64 {
    let mut normal = Normal(7 + half as u64);
    // Rate one half: the energy of a symbol is half of that of a bit; noise of unit variance.
    let amplitude = libm::pow(10.0, ebn0_db / 20.0) as f32;
    let failed = (0..words).filter(|_| {
        let sent: Vec<bool> = (0..half).map(|_| normal.next() > 0.0).collect();
        let received = code.encode(&sent).into_iter().map(|one| if one { -amplitude } else { amplitude });
        let received: Vec<f32> = received.map(|value| value + normal.next()).collect();
        code.decode(&received).as_ref() != Some(&sent)
    });
    failed.count() as f64 / f64::from(words)
}

/// Asserts that words of a code of `half` information bits fulfil their checks, and fail between Shannon's
/// limit and a decibel and a half above it.
///
/// Binary symbols carry half a bit each at 0.19 dB (Proakis, Digital Communications, 5th ed., 6.5-4): no code
/// is reliable there. At that rate a word of 1200 symbols can fail once in a hundred from 0.9 dB on, one of
/// 548 from 1.2 dB on (normal approximation, Polyanskiy, Poor and Verdu 2010, eq. 296); min-sum and a
/// structured code cost a decibel more at most.
pub(crate) fn is_as_codes_of_its_length(code: &Ldpc, half: usize) {
    let mut normal = Normal(5);
    let sent: Vec<bool> = (0..half).map(|_| normal.next() > 0.0).collect();
    let word = code.encode(&sent);
    assert_eq!((code.checks().len(), word.len()), (half, 2 * half));
    assert!(code.checks().iter().all(|row| row.iter().filter(|place| word[**place]).count() % 2 == 0));
    let (never, often) = (failing(code, half, 0.19, 60), failing(code, half, 2.2, 300));
    println!("{half}: {never} at 0.19 dB, {often} at 2.2 dB");
    // Once in a hundred, and three sigma of so many words: 300 · 0.01 · 0.99 is the variance of their count.
    let most = 0.01 + 3.0 * (0.01 * 0.99 / 300.0_f64).sqrt();
    assert!(never > 0.5 && often < most, "{half}: {never} {often}");
}
