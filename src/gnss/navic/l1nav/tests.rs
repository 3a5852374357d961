//! The codes of the message: their matrices, error rates in noise, and words of the time.

use sha2::{Digest, Sha256};

use super::*;
use crate::fec::reliability::is_as_codes_of_its_length;

#[test]
fn both_codes_have_the_printed_matrices_and_fail_between_shannon_s_limit_and_one_decibel_and_a_half_above_it() {
    // SHA-256 of "rows columns" and a line for every row with the positions of its ones, in their order, as
    // another program has the matrices; those of tables 30 to 41 of the document are the same, as a third
    // says.
    for (code, half, digest) in [
        (&CODE_2, BITS_2, "b16b192a52fc0acf63a2b4635f69c667c5f224a33edfc06421d2f1fa72e3222d"),
        (&CODE_3, BITS_3, "d8326d7ffe877974e2b967c2a1182e34bd19ba597e5f55e2e81656791fee775a"),
    ] {
        let rows = code.checks().iter().map(|row| {
            let places: Vec<String> = row.iter().map(usize::to_string).collect();
            places.join(" ") + "\n"
        });
        let text = format!("{half} {}\n", 2 * half) + &rows.collect::<String>();
        let found: String = Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(found, digest);
        is_as_codes_of_its_length(code, half);
    }
}

#[test]
fn words_of_the_time_are_twenty_symbols_apart_and_upside_down_none_is_another() {
    // BCH(52,9), least distance 20.
    let words: Vec<Vec<bool>> = (1..=400).map(|time| FRAME.time_word(time)).collect();
    let apart = |a: &[bool], b: &[bool]| a.iter().zip(b).filter(|(one, other)| one != other).count();
    let mut all: Vec<usize> = Vec::new();
    for (index, word) in words.iter().enumerate() {
        assert_eq!(number(&word[..9]) as usize, index + 1);
        // The recurrence of the generator x⁹ + x⁸ + x⁷ + x⁶ + x⁵ + x⁴ + x² + x + 1, from the highest power
        // on.
        for k in 0..43 {
            let sum = [0, 1, 2, 3, 4, 5, 7, 8].iter().fold(false, |sum, ahead| sum ^ word[k + ahead]);
            assert_eq!(word[k + 9], sum, "{index} {k}");
        }
        all.extend(words.iter().skip(index + 1).map(|other| apart(word, other)));
    }
    assert_eq!(all.iter().min(), Some(&20));
    // An inverted word of 52 bits differs from another in 52 less the bits in which they differ otherwise.
    assert_eq!(all.iter().max(), Some(&36));
}
