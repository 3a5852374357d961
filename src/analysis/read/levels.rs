//! A number an epoch for each of several keys, made from the rows of an epoch while they are read.
//!
//! Tables come epoch by epoch, so that one epoch's numbers are held and the rest is spilled. Limits: in a
//! table whose samples fall all numbers are held from there on.

use std::collections::{BTreeMap, HashMap};
use std::hash::Hash;
use std::path::Path;

use crate::error::JudgeError;
use crate::read::spill_store::{Finder, SpillRow, SpillStore, Words};

/// One number.
struct Level {
    sample: u64,
    value: f64,
}

impl<K> SpillRow<K> for Level {
    const WORDS: usize = 2;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.value.to_bits()]);
    }

    fn take(_: K, words: &mut Words<'_>) -> Self {
        Self { sample: words.word(), value: words.number() }
    }
}

/// Numbers by key and sample.
pub struct Levels<K> {
    store: SpillStore<K, Level>,
    /// The epoch that is being read.
    sample: u64,
    open: BTreeMap<K, f64>,
    /// All numbers, where samples fall.
    all: Option<HashMap<(u64, K), f64>>,
}

impl<K: Copy + Ord + Hash> Levels<K> {
    /// An empty list, which spills to a file in that directory.
    pub(crate) fn new(directory: &Path) -> Self {
        Self { store: SpillStore::new(directory), sample: 0, open: BTreeMap::new(), all: None }
    }

    /// Makes another number of the one at a sample, which is 0 at first.
    pub(crate) fn change(&mut self, sample: u64, key: K, of: impl FnOnce(f64) -> f64) -> Result<(), JudgeError> {
        if sample < self.sample && self.all.is_none() {
            self.close()?;
            let mut all = HashMap::new();
            for key in self.store.keys() {
                self.store.each(key, |level| {
                    all.insert((level.sample, key), level.value);
                })?;
            }
            self.all = Some(all);
        }
        let value = match &mut self.all {
            Some(all) => all.entry((sample, key)).or_insert(0.0),
            None => {
                if sample > self.sample {
                    self.close()?;
                    self.sample = sample;
                }
                self.open.entry(key).or_insert(0.0)
            }
        };
        *value = of(*value);
        Ok(())
    }

    /// Puts away what is held of the last epoch.
    pub(crate) fn close(&mut self) -> Result<(), JudgeError> {
        for (key, value) in std::mem::take(&mut self.open) {
            self.store.push(key, &Level { sample: self.sample, value })?;
        }
        Ok(())
    }

    /// The numbers by their samples.
    pub fn finder(&self) -> LevelFinder<'_, K> {
        LevelFinder { levels: self, found: BTreeMap::new() }
    }

    /// Checks that all rows could be read, like [`SpillStore::sound`].
    ///
    /// # Errors
    ///
    /// Same as there.
    pub fn sound(&self) -> Result<(), JudgeError> {
        self.store.sound()
    }
}

/// Numbers by their samples, as [`Finder`] has rows.
pub struct LevelFinder<'l, K> {
    levels: &'l Levels<K>,
    found: BTreeMap<K, Finder<'l, K, Level>>,
}

impl<K: Copy + Ord + Hash> LevelFinder<'_, K> {
    /// The number of a key at a sample.
    pub fn get(&mut self, sample: u64, key: K) -> Option<f64> {
        if let Some(all) = &self.levels.all {
            return all.get(&(sample, key)).copied();
        }
        let finder = match self.found.entry(key) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            // Rows of an epoch that ascends are not read before they are asked for.
            std::collections::btree_map::Entry::Vacant(entry) => entry.insert(self.levels.store.finder(key).ok()?),
        };
        finder.get(sample).map(|level| level.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_all_rows_of_an_epoch_in_whatever_order_they_come() {
        let place = tempfile::tempdir().unwrap();
        let rows = |by_epoch: bool| {
            let all = (0..2000_u64).flat_map(|sample| (0..3_u64).map(move |one| (sample, one)));
            let mut all: Vec<(u64, u64)> = all.collect();
            if !by_epoch {
                all.sort_by_key(|(sample, one)| (*one, *sample));
            }
            all
        };
        for by_epoch in [true, false] {
            let mut levels = Levels::new(place.path());
            for (sample, one) in rows(by_epoch) {
                let key = if one == 2 { 'b' } else { 'a' };
                levels.change(sample, key, |sum| sum + (sample * 10 + one) as f64).unwrap();
            }
            levels.close().unwrap();
            assert_eq!(levels.all.is_none(), by_epoch);
            let mut found = levels.finder();
            for sample in 0..2000 {
                let expected = (Some((20 * sample + 1) as f64), Some((10 * sample + 2) as f64));
                assert_eq!((found.get(sample, 'a'), found.get(sample, 'b')), expected);
            }
            assert_eq!((found.get(2000, 'a'), found.get(0, 'c')), (None, None));
            levels.sound().unwrap();
        }
    }
}
