//! Parts of a plan: neighbouring shards that one task of an engine runs.
//!
//! An engine numbers its tasks, and caps that number (Slurm's `MaxArraySize`, 1001 by default, caps the
//! index). A plan may have more shards. Part k of n is a range that follows from the plan alone, so that a
//! script needs no list, and a task that runs again, later or elsewhere, finds in its part what is still
//! missing.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// One of several parts of about equal length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    number: u32,
    of: u32,
}

impl Part {
    /// Part `number` of `of`, counted from zero; nothing where there is no such part.
    pub fn new(number: u32, of: u32) -> Option<Self> {
        (number < of).then_some(Self { number, of })
    }

    /// Shards of the part, out of `all`.
    pub fn shards(self, all: u32) -> Range<u32> {
        let first = |number: u32| (u64::from(number) * u64::from(all) / u64::from(self.of)) as u32;
        first(self.number)..first(self.number + 1)
    }

    /// The parts, of so many, that hold any of these shards, which are in order.
    pub fn holding(shards: &[u32], all: u32, of: u32) -> Vec<u32> {
        let holds = |number: &u32| {
            let range = Self { number: *number, of }.shards(all);
            let next = shards.partition_point(|shard| *shard < range.start);
            shards.get(next).is_some_and(|shard| range.contains(shard))
        };
        (0..of).filter(holds).collect()
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let read = |(number, of): (&str, &str)| Self::new(number.parse().ok()?, of.parse().ok()?);
        text.split_once('/').and_then(read).ok_or_else(|| "expected K/N, part K of N, counted from 0: 3/100".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_each_shard_once_in_order_and_differ_by_one_at_most() {
        for (all, of) in [(1, 1), (24, 24), (24, 7), (2500, 1000), (10_000_000, 1001), (5, 9)] {
            let parts: Vec<Range<u32>> = (0..of).map(|number| Part { number, of }.shards(all)).collect();
            assert!(parts.first().is_some_and(|part| part.start == 0) && parts.last().is_some_and(|p| p.end == all));
            assert!(parts.windows(2).all(|two| two[0].end == two[1].start));
            let lengths: Vec<usize> = parts.iter().map(ExactSizeIterator::len).collect();
            let (least, most) = (lengths.iter().min().unwrap(), lengths.iter().max().unwrap());
            assert!(most - least <= 1, "{all} in {of}: {least} to {most}");
        }
    }

    #[test]
    fn only_parts_with_a_missing_shard_are_handed_out() {
        assert_eq!(Part::holding(&[0, 1, 7, 2499], 2500, 1000), vec![0, 3, 999]);
        assert_eq!(Part::holding(&(0..24).collect::<Vec<u32>>(), 24, 24), (0..24).collect::<Vec<u32>>());
        assert_eq!(Part::holding(&[], 24, 6), Vec::<u32>::new());
    }

    #[test]
    fn a_part_is_read_as_it_is_written() {
        assert_eq!("3/100".parse::<Part>().map(|part| part.to_string()), Ok("3/100".to_owned()));
        for wrong in ["", "3", "3/", "/3", "3/3", "4/3", "-1/3", "a/b", "1/0", "1/2/3"] {
            assert!(wrong.parse::<Part>().is_err(), "{wrong}");
        }
    }
}
