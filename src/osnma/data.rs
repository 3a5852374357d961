//! Navigation data under the tags, and the rule which sub-frame's data a tag covers.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6.5.1. ADKD 0 and 12 cover words 1 to 5 (549 bits), ADKD 4 words 6 and
//! 10 (141 bits), without their types and reserved bits. A tag covers the data as they stood at the end of
//! the sub-frame before the tag's own. Its field COP counts the sub-frames since they changed: words received
//! in that many sub-frames may be used, older ones may not. COP 0 says that the sender had no data: the tag
//! covers zeros. Limits: words 1 to 4 of two issues are not mixed.

use std::collections::BTreeMap;

use crate::bits::{Row, part};
use crate::fields::Adkd;
use crate::time::{Gst, SUBFRAME_S};

/// Words of ephemeris, clock and status, with the first bit and the length that are covered.
const EPHEMERIS: &[(u8, u32, u32)] = &[(1, 6, 120), (2, 6, 120), (3, 6, 122), (4, 6, 120), (5, 6, 67)];
/// Words of timing parameters.
const TIMING: &[(u8, u32, u32)] = &[(6, 6, 99), (10, 86, 42)];

/// Words that one kind of tag covers.
fn words_of(kind: Adkd) -> Option<&'static [(u8, u32, u32)]> {
    match kind {
        Adkd::Ephemeris | Adkd::SlowMac => Some(EPHEMERIS),
        Adkd::Timing => Some(TIMING),
        Adkd::Reserved(_) => None,
    }
}

/// Bits that a tag without data covers: zeros.
pub fn zeros(kind: Adkd) -> Option<Row> {
    let mut row = Row::default();
    words_of(kind)?.iter().for_each(|(_, _, count)| row.push_zeros(*count as usize));
    Some(row)
}

/// Words 1 to 5 whose covered bits are those of a tag of the ephemeris, or `None` for a row of another
/// length. Week and second in word 5, which no tag covers, are those of `sent`; other bits that no tag covers
/// are zero.
pub fn words_under(row: &Row, sent: Gst) -> Option<[u128; 5]> {
    if row.len() != EPHEMERIS.iter().map(|(_, _, count)| *count as usize).sum::<usize>() {
        return None;
    }
    let bit = |index: usize| row.bytes().get(index / 8).is_some_and(|byte| byte >> (7 - index % 8) & 1 == 1);
    let mut begin = 0;
    let mut words = [0; 5];
    for (word, &(kind, first, count)) in words.iter_mut().zip(EPHEMERIS) {
        let bits = (begin..begin + count as usize).fold(0_u128, |all, index| all << 1 | u128::from(bit(index)));
        *word = u128::from(kind) << 122 | bits << (128 - first - count);
        begin += count as usize;
    }
    // OS SIS ICD 2.1, 4.3.5, table 46: week of 12 bits from bit 73 on, second of 20 bits behind it.
    words[4] |= u128::from(sent.week()) << 43 | u128::from(sent.tow_s()) << 23;
    Some(words)
}

/// Reason for which there are no data to hold a tag to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataGap {
    /// A word that was never received.
    Missing,
    /// A word that is older than the tag allows.
    Old,
    /// Words of two issues of the ephemeris.
    Mixed,
}

/// Newest words of all satellites, each with its sub-frame.
#[derive(Clone, Debug, Default)]
pub struct Words {
    all: BTreeMap<(u8, u8), (u128, Gst)>,
}

impl Words {
    /// Takes the words of a satellite's sub-frame, by type.
    pub fn put(&mut self, satellite: u8, start: Gst, words: &BTreeMap<u8, u128>) {
        for (&kind, &word) in words {
            if EPHEMERIS.iter().chain(TIMING).any(|(own, _, _)| *own == kind) {
                self.all.insert((satellite, kind), (word, start));
            }
        }
    }

    /// Bits of a satellite's data as a tag of the sub-frame `start` covers them, whose COP is not zero. The
    /// words that are held must be of sub-frames before it.
    ///
    /// # Errors
    /// [`DataGap`].
    pub fn covered(&self, satellite: u8, kind: Adkd, start: Gst, cop: u8) -> Result<Row, DataGap> {
        let mut row = Row::default();
        let mut issue = None;
        for &(word, first, count) in words_of(kind).ok_or(DataGap::Missing)? {
            let &(bits, received) = self.all.get(&(satellite, word)).ok_or(DataGap::Missing)?;
            if start.since_s(received) > SUBFRAME_S * i64::from(cop) {
                return Err(DataGap::Old);
            }
            if (1..=4).contains(&word) {
                let own = part(bits, 128, 6, 10);
                if issue.is_some_and(|issue| issue != own) {
                    return Err(DataGap::Mixed);
                }
                issue = Some(own);
            }
            row.push(part(bits, 128, first, count), count as usize);
        }
        Ok(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(issue: u128) -> BTreeMap<u8, u128> {
        (1..=10).map(|kind| (kind, u128::from(kind) << 122 | issue << 112 | 0x1234)).collect()
    }

    #[test]
    fn each_kind_covers_the_bits_that_the_document_counts() {
        let mut held = Words::default();
        held.put(3, Gst::new(1251, 0), &words(9));
        let covered = |kind| held.covered(3, kind, Gst::new(1251, 30), 1).unwrap();
        assert_eq!(covered(Adkd::Ephemeris).len(), 549);
        assert_eq!(covered(Adkd::Timing).len(), 141);
        assert_eq!(covered(Adkd::SlowMac), covered(Adkd::Ephemeris));
        assert_eq!((zeros(Adkd::Ephemeris).unwrap().len(), zeros(Adkd::Timing).unwrap().len()), (549, 141));
        assert_eq!(zeros(Adkd::Reserved(5)), None);
    }

    #[test]
    fn words_may_be_as_old_as_the_tag_counts_and_not_older() {
        let mut held = Words::default();
        held.put(3, Gst::new(1251, 0), &words(9));
        let covered = |cop| held.covered(3, Adkd::Ephemeris, Gst::new(1251, 90), cop);
        assert!(covered(3).is_ok());
        assert_eq!(covered(2), Err(DataGap::Old));
        assert_eq!(held.covered(4, Adkd::Ephemeris, Gst::new(1251, 90), 3), Err(DataGap::Missing));
    }

    #[test]
    fn covered_bits_give_their_words_back() {
        let mut held = Words::default();
        let sent: BTreeMap<u8, u128> = words(9).into_iter().map(|(kind, word)| (kind, word | 0x5A5A << 60)).collect();
        held.put(3, Gst::new(1251, 0), &sent);
        let row = held.covered(3, Adkd::Ephemeris, Gst::new(1251, 30), 1).unwrap();
        let back = words_under(&row, Gst::new(1251, 25)).unwrap();
        for (word, (kind, first, count)) in back.iter().zip(EPHEMERIS) {
            assert_eq!(part(*word, 128, 0, 6), u128::from(*kind));
            assert_eq!(part(*word, 128, *first, *count), part(sent[kind], 128, *first, *count));
        }
        assert_eq!((part(back[4], 128, 73, 12), part(back[4], 128, 85, 20)), (1251, 25));
        assert_eq!(words_under(&Row::default(), Gst::new(1251, 25)), None);
    }

    #[test]
    fn words_of_two_issues_are_not_mixed() {
        let mut held = Words::default();
        held.put(3, Gst::new(1251, 0), &words(9));
        held.put(3, Gst::new(1251, 30), &words(10).into_iter().filter(|(kind, _)| *kind != 2).collect());
        assert_eq!(held.covered(3, Adkd::Ephemeris, Gst::new(1251, 60), 15), Err(DataGap::Mixed));
        assert!(held.covered(3, Adkd::Timing, Gst::new(1251, 60), 15).is_ok());
    }
}
