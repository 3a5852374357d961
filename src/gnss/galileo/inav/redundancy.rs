//! Redundancy words 17 to 20: octets from which missing ones of words 1 to 4 are recovered.
//!
//! Source: Galileo OS SIS ICD 2.1, 5.1.13. The 58 octets of the code's information are the type of word 1
//! with the two low bits of the issue of data, its other eight bits, and the 112 bits that follow the issue
//! in words 1 to 4. Each of words 17 to 20 carries 15 of 60 parity octets, and the two low bits of the issue.

use super::word_type;
use crate::bits::Store;
use crate::fec::reed_solomon::{PARITY, parity, recovered};

/// The words with redundancy, by type.
pub(super) const REDUNDANT: [u8; 4] = [17, 18, 19, 20];
/// Octets of one of them, and of what it replaces in one of words 1 to 4.
const SHARE: usize = 15;
const DATA: usize = 14;
/// Octets of type and issue before those of the words.
const HEAD: usize = 2;
const WHOLE: usize = HEAD + 4 * DATA;

/// Octets of a word from its 17th bit on.
fn octets(word: &u128) -> [u8; DATA] {
    std::array::from_fn(|place| word.piece((16 + 8 * place as u16, 8)) as u8)
}

/// The issue of data in one of words 1 to 4.
pub(super) fn issue(word: &u128) -> u32 {
    word.piece((6, 10))
}

/// The low bits of the issue of data that one of words 17 to 20 names.
pub(super) fn low_issue(word: &u128) -> u32 {
    word.piece((14, 2))
}

fn head(issue: u32) -> [u8; HEAD] {
    [(1 << 2 | issue & 0b11) as u8, (issue >> 2) as u8]
}

/// Computes words 17 to 20 from words 1 to 4.
pub fn redundancy(words: [&u128; 4]) -> [u128; 4] {
    let issue = issue(words[0]);
    let information: Vec<u8> = head(issue).into_iter().chain(words.into_iter().flat_map(octets)).collect();
    let all = parity(&information);
    std::array::from_fn(|number| {
        let mut word = 0_u128;
        word.set_piece((0, 6), u32::from(REDUNDANT[number]));
        word.set_piece((14, 2), issue & 0b11);
        let own = &all[SHARE * number..SHARE * (number + 1)];
        word.set_piece((6, 8), u32::from(own[0]));
        for (place, octet) in (0..).zip(&own[1..]) {
            word.set_piece((16 + 8 * place, 8), u32::from(*octet));
        }
        word
    })
}

/// Words 1 to 4 of an issue, those that lack found from words 17 to 20; `None` where these are too few.
pub(super) fn completed(issue: u32, words: [Option<&u128>; 4], redundant: [Option<&u128>; 4]) -> Option<[u128; 4]> {
    let lacking = words.iter().filter(|word| word.is_none()).count();
    if lacking > redundant.iter().flatten().count() {
        return None;
    }
    let mut information: Vec<Option<u8>> = head(issue).map(Some).to_vec();
    information.extend(words.iter().flat_map(|word| word.map_or([None; DATA], |word| octets(word).map(Some))));
    let mut parts = [None; PARITY];
    for (word, slots) in redundant.iter().zip(parts.chunks_mut(SHARE)) {
        let Some(word) = word else { continue };
        let own = [word.piece((6, 8)) as u8].into_iter().chain(octets(word));
        slots.iter_mut().zip(own).for_each(|(slot, octet)| *slot = Some(octet));
    }
    let whole = recovered(&information, &parts).filter(|whole| whole.len() == WHOLE)?;
    Some(std::array::from_fn(|number| {
        let mut word = 0_u128;
        word.set_piece((0, 6), number as u32 + 1);
        word.set_piece((6, 10), issue);
        for (place, octet) in (0..).zip(&whole[HEAD + DATA * number..HEAD + DATA * (number + 1)]) {
            word.set_piece((16 + 8 * place, 8), u32::from(*octet));
        }
        word
    }))
}

/// True if a word is one of those with redundancy.
pub(super) fn is_redundant(word: &u128) -> bool {
    REDUNDANT.contains(&word_type(word))
}
