//! Row store grouped by satellite that spills to disk: a long run takes no more memory than a short one.
//!
//! Tables come epoch by epoch and are needed satellite by satellite. A [`SpillStore`] collects the rows of
//! each key until there are 256 of them, then appends them as plain words to a file without a name, which the
//! system removes when the process ends, however it ends. Groups under 256 rows stay in memory. Limits: the
//! rows of one key are read all at once; rows of a key keep their order, rows of different keys do not.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::analysis::error::JudgeError;

/// Rows of a key that are kept in memory.
const MOST_ROWS: usize = 256;

/// What a store can take: a row as words of 64 bits, its key left out.
pub trait SpillRow<K>: Sized {
    /// Words of a row.
    const WORDS: usize;

    /// Appends its words.
    fn put(&self, words: &mut Vec<u64>);

    /// The row of those words.
    fn take(key: K, words: &mut Words<'_>) -> Self;
}

/// The words of a row on their way back.
pub struct Words<'a>(std::slice::Iter<'a, u64>);

impl Words<'_> {
    /// The next one; a row takes as many as it has put.
    pub fn word(&mut self) -> u64 {
        self.0.next().copied().unwrap_or(0)
    }

    /// The next one as the number whose bits it holds.
    pub fn number(&mut self) -> f64 {
        f64::from_bits(self.word())
    }
}

/// Rows by key.
#[derive(Debug)]
pub struct SpillStore<K, T> {
    /// Where the file is made once it is needed.
    directory: PathBuf,
    file: Option<Mutex<File>>,
    /// Words in the file.
    filed: u64,
    stacks: BTreeMap<K, Stack>,
    kind: std::marker::PhantomData<T>,
}

#[derive(Debug, Default)]
struct Stack {
    /// Where its full lots begin in the file, in words.
    lots: Vec<u64>,
    /// What is not in the file yet.
    words: Vec<u64>,
}

impl<K: Copy + Ord, T: SpillRow<K>> SpillStore<K, T> {
    /// An empty one, whose file is made in that directory.
    pub fn new(directory: &Path) -> Self {
        let (file, stacks) = (None, BTreeMap::new());
        Self { directory: directory.to_owned(), file, filed: 0, stacks, kind: std::marker::PhantomData }
    }

    /// Where its file is made.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Adds a row behind those of its key.
    ///
    /// # Errors
    /// [`JudgeError::File`] where the file cannot be made or written.
    pub fn push(&mut self, key: K, row: &T) -> Result<(), JudgeError> {
        let stack = self.stacks.entry(key).or_default();
        row.put(&mut stack.words);
        if stack.words.len() < MOST_ROWS * T::WORDS {
            return Ok(());
        }
        let failed = |source| JudgeError::File { path: self.directory.clone(), source };
        if self.file.is_none() {
            self.file = Some(Mutex::new(tempfile::tempfile_in(&self.directory).map_err(failed)?));
        }
        if let Some(file) = &mut self.file {
            let bytes: Vec<u8> = stack.words.iter().flat_map(|word| word.to_le_bytes()).collect();
            let file = file.get_mut().unwrap_or_else(PoisonError::into_inner);
            // Reading has left the place where it ends.
            file.seek(SeekFrom::Start(8 * self.filed)).and_then(|_| file.write_all(&bytes)).map_err(failed)?;
        }
        stack.lots.push(self.filed);
        self.filed += stack.words.len() as u64;
        stack.words.clear();
        Ok(())
    }

    /// Keys in order.
    pub fn keys(&self) -> impl DoubleEndedIterator<Item = K> + '_ {
        self.stacks.keys().copied()
    }

    /// Whether a key has rows.
    pub fn contains(&self, key: &K) -> bool {
        self.stacks.contains_key(key)
    }

    /// Rows of a key.
    pub fn count(&self, key: &K) -> usize {
        self.stacks.get(key).map_or(0, |stack| stack.lots.len() * MOST_ROWS + stack.words.len() / T::WORDS)
    }

    /// Rows of all keys.
    pub fn len(&self) -> usize {
        self.stacks.keys().map(|key| self.count(key)).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.stacks.is_empty()
    }

    /// The rows of a key, in the order in which they came; none of one that has none.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where the file cannot be read.
    pub fn rows(&self, key: K) -> Result<Vec<T>, JudgeError> {
        self.map(key, |row| row)
    }

    /// What `of` makes of each row of a key, which is all that is held of them.
    ///
    /// # Errors
    /// As [`Self::rows`].
    pub fn map<U>(&self, key: K, of: impl Fn(T) -> U) -> Result<Vec<U>, JudgeError> {
        let mut found = Vec::with_capacity(self.count(&key));
        self.each(key, |row| found.push(of(row)))?;
        Ok(found)
    }

    /// Shows each row of a key to `see`.
    ///
    /// # Errors
    /// As [`Self::rows`].
    pub fn each(&self, key: K, mut see: impl FnMut(T)) -> Result<(), JudgeError> {
        let Some(stack) = self.stacks.get(&key) else { return Ok(()) };
        let mut show = |words: &[u64]| words.chunks(T::WORDS).for_each(|row| see(T::take(key, &mut Words(row.iter()))));
        let mut lot = Vec::new();
        for start in &stack.lots {
            self.lot(*start, &mut lot).map_err(|source| JudgeError::Read { path: self.directory.clone(), source })?;
            show(&lot);
        }
        show(&stack.words);
        Ok(())
    }

    /// A lot of the file.
    fn lot(&self, start: u64, words: &mut Vec<u64>) -> io::Result<()> {
        let Some(file) = &self.file else { return Ok(()) };
        let mut bytes = vec![0; 8 * MOST_ROWS * T::WORDS];
        {
            let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
            file.seek(SeekFrom::Start(8 * start))?;
            file.read_exact(&mut bytes)?;
        }
        words.clear();
        let word = |bytes: &[u8]| bytes.try_into().map_or(0, u64::from_le_bytes);
        words.extend(bytes.chunks_exact(8).map(word));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Pair(u64, f64);

    impl SpillRow<u8> for Pair {
        const WORDS: usize = 2;

        fn put(&self, words: &mut Vec<u64>) {
            words.extend([self.0, self.1.to_bits()]);
        }

        fn take(_: u8, words: &mut Words<'_>) -> Self {
            Self(words.word(), words.number())
        }
    }

    #[test]
    fn rows_come_back_in_their_order_whether_they_were_filed_or_not() {
        let place = tempfile::tempdir().unwrap();
        let mut store = SpillStore::new(place.path());
        // Keys 0, 1, 2 get 2000, 1000 and 3 rows: below, at and beyond whole lots.
        let row = |n: u64| Pair(n, -1.0 / n as f64);
        let key = |n: u64| if n >= 3000 { 2 } else { u8::from(n % 3 == 2) };
        for n in 0..3003 {
            store.push(key(n), &row(n)).unwrap();
            // Reading in between moves nothing.
            if n % 700 == 0 {
                assert!(!store.rows(0).unwrap().is_empty());
            }
        }
        for (of, count) in [(0, 2000), (1, 1000), (2, 3)] {
            let expected: Vec<Pair> = (0..3003).filter(|n| key(*n) == of).map(row).collect();
            assert_eq!((store.count(&of), expected.len()), (count, count));
            assert_eq!(store.rows(of).unwrap(), expected);
        }
        assert_eq!((store.len(), store.rows(9).unwrap().len(), store.is_empty()), (3003, 0, false));
        assert_eq!(store.keys().collect::<Vec<_>>(), [0, 1, 2]);
        // What is held beyond the file is less than a lot a key.
        assert!(store.stacks.values().all(|stack| stack.words.len() < 2 * MOST_ROWS) && store.filed > 2 * 2500);
        // The file bears no name.
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn few_rows_need_no_place_and_many_say_which_one_is_missing() {
        let mut store = SpillStore::new(Path::new("/nowhere/at/all"));
        (0..255).for_each(|n| store.push(1, &Pair(n, 0.0)).unwrap());
        assert_eq!(store.rows(1).unwrap().len(), 255);
        let error = store.push(1, &Pair(255, 0.0)).unwrap_err().to_string();
        assert!(error.contains("/nowhere/at/all"), "{error}");
    }
}
