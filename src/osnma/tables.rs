//! MAC look-up tables: which kind of tag each slot of a sub-frame has.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, annex C. The first slot is always the satellite's own ephemeris (00S)
//! and is not listed. `E` is a tag about any satellite, `S` about the sender; a flexible slot (FLX) states
//! its kind itself, and MACSEQ covers the statement.

use crate::fields::Adkd;

/// Slot of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// Kind of data, and true where the data are the sender's own.
    Fixed(Adkd, bool),
    /// Slot whose kind the tag states.
    Flexible,
}

const S00: Slot = Slot::Fixed(Adkd::Ephemeris, true);
const E00: Slot = Slot::Fixed(Adkd::Ephemeris, false);
const S04: Slot = Slot::Fixed(Adkd::Timing, true);
const S12: Slot = Slot::Fixed(Adkd::SlowMac, true);
const E12: Slot = Slot::Fixed(Adkd::SlowMac, false);
const FLX: Slot = Slot::Flexible;

/// Slots after the first, in the first and in the second half of a GST minute.
type Halves = [&'static [Slot]; 2];

/// All tables with their numbers.
const TABLES: [(u8, Halves); 12] = [
    (27, [&[E00, E00, E00, S12, E00], &[E00, E00, S04, S12, E00]]),
    (28, [&[E00, E00, E00, S00, E00, E00, S12, E00, E00], &[E00, E00, S00, E00, E00, S04, S12, E00, E00]]),
    (31, [&[E00, E00, S12, E00], &[E00, E00, S12, S04]]),
    (33, [&[E00, S04, E00, S12, E00], &[E00, E00, S12, E00, E12]]),
    (34, [&[FLX, S04, FLX, S12, E00], &[FLX, E00, S12, E00, E12]]),
    (35, [&[FLX, S04, FLX, S12, FLX], &[FLX, FLX, S12, FLX, FLX]]),
    (36, [&[FLX, S04, FLX, S12], &[FLX, E00, S12, E12]]),
    (37, [&[E00, S04, E00, S12], &[E00, E00, S12, E12]]),
    (38, [&[FLX, S04, FLX, S12], &[FLX, FLX, S12, FLX]]),
    (39, [&[FLX, S04, FLX], &[FLX, E00, S12]]),
    (40, [&[E00, S04, S12], &[E00, E00, E12]]),
    (41, [&[FLX, S04, FLX], &[FLX, FLX, S12]]),
];

/// Slots of a sub-frame after the first one, or `None` for a table that does not exist.
pub fn slots(table: u8, half: usize) -> Option<&'static [Slot]> {
    let (_, halves) = TABLES.iter().find(|(number, _)| *number == table)?;
    halves.get(half).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_halves_of_a_table_have_as_many_tags_and_one_of_time_and_of_the_slow_mac() {
        for (number, [first, second]) in TABLES {
            assert_eq!(first.len(), second.len(), "{number}");
            let all = || first.iter().chain(second);
            let has = |kind| all().any(|slot| matches!(slot, Slot::Fixed(own, _) if *own == kind));
            assert!(has(Adkd::Timing) && has(Adkd::SlowMac), "{number}");
            // Timing parameters are those of the sender.
            assert!(all().all(|slot| !matches!(slot, Slot::Fixed(Adkd::Timing, false))), "{number}");
        }
        assert_eq!(slots(34, 0), Some(&[FLX, S04, FLX, S12, E00][..]));
        assert_eq!(slots(34, 1), Some(&[FLX, E00, S12, E00, E12][..]));
        assert_eq!((slots(26, 0), slots(34, 2)), (None, None));
    }
}
