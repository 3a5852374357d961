//! Codes of few words that a shift register makes, decoded by trying all words.
//!
//! A register of so many stages begins with the word, gives its oldest stage and takes the sum of some
//! stages: a cyclic code (BCH) in its systematic form. Source: IS-GPS-800J, 3.2.3.2 (time of interval of
//! CNAV-2); BDS-SIS-ICD-B1C 1.0, 6.2.1 (subframe 1 of B-CNAV1).

/// A code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegisterCode {
    /// Number of stages: bits of a word.
    pub stages: u32,
    /// Stages whose sum is fed back; the oldest is the most significant bit.
    pub feedback: u32,
    /// Number of symbols in a code word.
    pub symbols: usize,
}

impl RegisterCode {
    /// Encodes a word to symbols.
    pub fn encode(self, word: u32) -> impl Iterator<Item = bool> {
        let mut state = word;
        (0..self.symbols).map(move |_| {
            let out = state >> (self.stages - 1) & 1 == 1;
            let back = (state & self.feedback).count_ones() % 2;
            state = (state << 1 | back) & ((1 << self.stages) - 1);
            out
        })
    }

    /// Correlation of soft symbols, positive for a logical 0, with the symbols of a word.
    pub fn correlation(self, word: u32, soft: &[f32]) -> f32 {
        self.encode(word).zip(soft).map(|(one, value)| if one { -value } else { *value }).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_bose_codes_are_as_far_apart_as_is_printed_and_the_sums_of_words_are_words() {
        // (51,8) of CNAV-2 and B-CNAV1 and (21,6) of B-CNAV1 are cyclic; their least distances are 24 and 8.
        for (code, least) in [
            (RegisterCode { stages: 8, feedback: 0b1111_1001, symbols: 51 }, 24),
            (RegisterCode { stages: 6, feedback: 0b11_1010, symbols: 21 }, 8),
        ] {
            let word = |word| code.encode(word).fold(0_u64, |all, one| all << 1 | u64::from(one));
            let weights = (1..1 << code.stages).map(|one| word(one).count_ones());
            assert_eq!(weights.min(), Some(least));
            for one in 0..1 << code.stages {
                assert_eq!(word(one) >> (code.symbols - code.stages as usize), u64::from(one));
                assert_eq!(word(one) ^ word(one / 3), word(one ^ (one / 3)));
            }
        }
    }
}
