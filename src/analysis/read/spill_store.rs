//! Row store grouped by satellite that spills to disk: a long run takes no more memory than a short one.
//!
//! Tables come epoch by epoch and are needed satellite by satellite. A [`SpillStore`] collects the rows of
//! each key until there are 256 of them, then appends them as plain words to a file without a name, which the
//! system removes when the process ends, however it ends. Groups under 256 rows stay in memory. Rows of a key
//! are read one after the other ([`SpillStore::each`], [`Cursor`]) or by their sample ([`Finder`]); a
//! satellite's rows over a day are tens of megabytes, so that few should ask for all at once. Limits: rows of
//! a key keep their order, rows of different keys do not; by their sample only those are found without being
//! held whose samples ascend.

use std::collections::{BTreeMap, HashMap};
use std::io;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use crate::error::JudgeError;
use crate::read::word_file::WordFile;

/// Rows of a key that are kept in memory.
const MOST_ROWS: usize = 256;

/// Row that a store can take, as words of 64 bits without its key. The first word is its sample, by which it
/// is found.
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
    file: WordFile,
    stacks: BTreeMap<K, Stack>,
    /// Error of a [`Finder`] that could not read.
    failed: Mutex<Option<io::Error>>,
    kind: std::marker::PhantomData<fn() -> T>,
}

#[derive(Debug, Default)]
struct Stack {
    lots: Vec<Lot>,
    /// Words that are not in the file yet.
    words: Vec<u64>,
    /// Sample of the newest row, and whether one came with the sample of the row before, or with a smaller
    /// one.
    last: Option<u64>,
    repeats: bool,
    falls: bool,
}

impl Stack {
    fn ascends(&self) -> bool {
        !self.repeats && !self.falls
    }
}

/// A full lot of rows in the file.
#[derive(Clone, Copy, Debug)]
struct Lot {
    /// Beginning of the lot in the file, in words.
    start: u64,
    /// Sample of its first row.
    first: u64,
}

impl<K: Copy + Ord, T: SpillRow<K>> SpillStore<K, T> {
    /// An empty one, whose file is made in that directory.
    pub fn new(directory: &Path) -> Self {
        let (file, stacks, failed) = (WordFile::new(directory), BTreeMap::new(), Mutex::new(None));
        Self { file, stacks, failed, kind: std::marker::PhantomData }
    }

    /// Directory of the file.
    pub fn directory(&self) -> &Path {
        self.file.directory()
    }

    /// Adds a row behind those of its key.
    ///
    /// # Errors
    /// [`JudgeError::File`] where the file cannot be made or written.
    pub fn push(&mut self, key: K, row: &T) -> Result<(), JudgeError> {
        let stack = self.stacks.entry(key).or_default();
        let begin = stack.words.len();
        row.put(&mut stack.words);
        let sample = stack.words.get(begin).copied();
        stack.repeats |= stack.last == sample;
        stack.falls |= stack.last > sample;
        stack.last = sample;
        if stack.words.len() < MOST_ROWS * T::WORDS {
            return Ok(());
        }
        let start = self.file.append(&stack.words)?;
        stack.lots.push(Lot { start, first: stack.words.first().copied().unwrap_or(0) });
        stack.words.clear();
        Ok(())
    }

    /// Keys in order.
    pub fn keys(&self) -> impl DoubleEndedIterator<Item = K> + '_ {
        self.stacks.keys().copied()
    }

    /// True if a key has rows.
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

    /// True if there is no row.
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

    /// Values of `of` for each row of a key. Only these values are held in memory.
    ///
    /// # Errors
    ///
    /// Same as [`Self::rows`].
    pub fn map<U>(&self, key: K, mut of: impl FnMut(T) -> U) -> Result<Vec<U>, JudgeError> {
        let mut found = Vec::with_capacity(self.count(&key));
        self.each(key, |row| found.push(of(row)))?;
        Ok(found)
    }

    /// Shows each row of a key to `see`.
    ///
    /// # Errors
    /// Errors of [`Self::rows`].
    pub fn each(&self, key: K, mut see: impl FnMut(T)) -> Result<(), JudgeError> {
        let Some(stack) = self.stacks.get(&key) else { return Ok(()) };
        let mut show = |words: &[u64]| words.chunks(T::WORDS).for_each(|row| see(T::take(key, &mut Words(row.iter()))));
        let mut words = Vec::new();
        for lot in &stack.lots {
            self.lot(*lot, &mut words).map_err(|source| self.file.unreadable(source))?;
            show(&words);
        }
        show(&stack.words);
        Ok(())
    }

    /// The rows of a key one after the other.
    pub fn cursor(&self, key: K) -> Cursor<'_, K, T> {
        Cursor { store: self, key, lot: 0, words: Vec::new(), at: 0 }
    }

    /// The rows of a key by their samples.
    ///
    /// # Errors
    /// Errors of [`Self::rows`], of rows whose samples do not ascend: those are read here.
    pub fn finder(&self, key: K) -> Result<Finder<'_, K, T>, JudgeError> {
        let stack = self.stacks.get(&key);
        let mut finder = Finder { store: self, stack, key, lot: None, words: Vec::new(), all: None };
        if stack.is_some_and(|stack| !stack.ascends()) {
            let mut all = HashMap::new();
            let mut cursor = self.cursor(key);
            while let Some(row) = cursor.words().transpose()? {
                all.insert(row.first().copied().unwrap_or(0), row.to_vec());
            }
            finder.all = Some(all);
        }
        Ok(finder)
    }

    /// True if the samples of a key's rows ascend.
    pub fn ascends(&self, key: &K) -> bool {
        self.stacks.get(key).is_none_or(Stack::ascends)
    }

    /// True if no row of a key has a smaller sample than the one before.
    pub fn is_ordered(&self, key: &K) -> bool {
        self.stacks.get(key).is_none_or(|stack| !stack.falls)
    }

    /// Checks that every [`Finder`] could read the rows that it looked up.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where one could not.
    pub fn sound(&self) -> Result<(), JudgeError> {
        let failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner).take();
        failed.map_or(Ok(()), |source| Err(self.file.unreadable(source)))
    }

    /// A lot of the file.
    fn lot(&self, lot: Lot, words: &mut Vec<u64>) -> io::Result<()> {
        self.file.read(lot.start, MOST_ROWS * T::WORDS, words)
    }
}

/// The rows of a key one after the other, of which a lot is held.
pub struct Cursor<'s, K, T> {
    store: &'s SpillStore<K, T>,
    key: K,
    /// The lot that comes next.
    lot: usize,
    words: Vec<u64>,
    /// Words of this lot that have been shown.
    at: usize,
}

impl<K: Copy + Ord, T: SpillRow<K>> Cursor<'_, K, T> {
    /// The words of the next row.
    fn words(&mut self) -> Option<Result<&[u64], JudgeError>> {
        let stack = self.store.stacks.get(&self.key)?;
        if self.at == self.words.len() {
            (self.at, self.lot) = (0, self.lot + 1);
            match stack.lots.get(self.lot - 1) {
                Some(lot) => {
                    if let Err(source) = self.store.lot(*lot, &mut self.words) {
                        return Some(Err(self.store.file.unreadable(source)));
                    }
                }
                None if self.lot == stack.lots.len() + 1 => self.words.clone_from(&stack.words),
                None => return None,
            }
        }
        let begin = self.at;
        self.at = (begin + T::WORDS).min(self.words.len());
        self.words.get(begin..self.at).filter(|row| !row.is_empty()).map(Ok)
    }
}

impl<K: Copy + Ord, T: SpillRow<K>> Iterator for Cursor<'_, K, T> {
    type Item = Result<T, JudgeError>;

    fn next(&mut self) -> Option<Self::Item> {
        let key = self.key;
        Some(self.words()?.map(|words| T::take(key, &mut Words(words.iter()))))
    }
}

/// The rows of a key by their samples: the lot in which it found one is held, so that samples are best asked
/// for in their order. Of several rows of a sample it is the last.
pub struct Finder<'s, K, T> {
    store: &'s SpillStore<K, T>,
    stack: Option<&'s Stack>,
    key: K,
    /// The lot that is held.
    lot: Option<usize>,
    words: Vec<u64>,
    /// All rows, where samples do not ascend.
    all: Option<HashMap<u64, Vec<u64>>>,
}

impl<K: Copy + Ord, T: SpillRow<K>> Finder<'_, K, T> {
    /// The row of a sample; none where it cannot be read either, which [`SpillStore::sound`] reports.
    pub fn get(&mut self, sample: u64) -> Option<T> {
        let key = self.key;
        let take = |words: &[u64]| T::take(key, &mut Words(words.iter()));
        if let Some(all) = &self.all {
            return all.get(&sample).map(|words| take(words));
        }
        let (words, rows) = self.until(sample)?;
        let row = words.get((rows - 1) * T::WORDS..rows * T::WORDS)?;
        (row.first() == Some(&sample)).then(|| take(row))
    }

    /// The last row that is not after a sample.
    pub fn until_sample(&mut self, sample: u64) -> Option<T> {
        let last = self.before(sample.saturating_add(1))?;
        self.get(last)
    }

    /// Sample of the last row before that one.
    pub fn before(&mut self, sample: u64) -> Option<u64> {
        if let Some(all) = &self.all {
            return all.keys().copied().filter(|before| *before < sample).max();
        }
        let (words, rows) = self.until(sample.checked_sub(1)?)?;
        words.get((rows - 1) * T::WORDS).copied()
    }

    /// The lot in which a sample lies or ends, and how many of its rows, one at least, are not after it.
    fn until(&mut self, sample: u64) -> Option<(&[u64], usize)> {
        let stack = self.stack?;
        let words = if stack.words.first().is_some_and(|first| *first <= sample) {
            &stack.words
        } else {
            let lot = stack.lots.partition_point(|lot| lot.first <= sample).checked_sub(1)?;
            if self.lot != Some(lot) {
                self.lot = None;
                if let Err(source) = self.store.lot(*stack.lots.get(lot)?, &mut self.words) {
                    *self.store.failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(source);
                    return None;
                }
                self.lot = Some(lot);
            }
            &self.words
        };
        let at = |row: usize| words.get(row * T::WORDS).copied().unwrap_or(u64::MAX);
        let (mut low, mut high) = (0, words.len() / T::WORDS);
        while low < high {
            let middle = low.midpoint(high);
            (low, high) = if at(middle) <= sample { (middle + 1, high) } else { (low, middle) };
        }
        (low > 0).then_some((words.as_slice(), low))
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
        assert!(store.stacks.values().all(|stack| stack.words.len() < 2 * MOST_ROWS) && store.file.len() > 2 * 2500);
        // The file bears no name.
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn rows_are_found_by_their_samples_wherever_they_lie_and_in_whatever_order_they_came() {
        let place = tempfile::tempdir().unwrap();
        let row = |n: u64| Pair(3 * n, -1.0 / n as f64);
        for disordered in [false, true] {
            let mut store = SpillStore::new(place.path());
            (1..=1000).for_each(|n| store.push(0, &row(n)).unwrap());
            if disordered {
                store.push(0, &Pair(300, 7.0)).unwrap();
            }
            assert_eq!(store.ascends(&0), !disordered);
            let read: Vec<Pair> = store.cursor(0).map(Result::unwrap).collect();
            assert_eq!(read, store.rows(0).unwrap());
            let mut found = store.finder(0).unwrap();
            // Forward, and backward as well.
            for n in (1..=1000).chain((1..=1000).rev()) {
                let expected = if disordered && n == 100 { Pair(300, 7.0) } else { row(n) };
                assert_eq!((found.get(3 * n), found.get(3 * n + 1)), (Some(expected), None), "{n}");
                assert_eq!(found.before(3 * n), (n > 1).then(|| 3 * n - 3), "{n}");
            }
            assert_eq!((found.get(0), found.before(9999)), (None, Some(3000)));
            assert_eq!((store.finder(1).unwrap().get(3), store.cursor(1).count()), (None, 0));
            // No more than a lot is held of rows that ascend.
            assert!(disordered || found.words.len() <= 2 * MOST_ROWS && found.all.is_none());
            store.sound().unwrap();
        }
    }

    #[test]
    fn what_cannot_be_found_is_told_when_the_store_is_asked() {
        let place = tempfile::tempdir().unwrap();
        let mut store = SpillStore::new(place.path());
        (0..600).for_each(|n| store.push(0, &Pair(n, 0.0)).unwrap());
        store.file.cut(600);
        let mut found = store.finder(0).unwrap();
        assert!(found.get(100).is_some() && store.sound().is_ok());
        assert!(found.get(400).is_none());
        assert!(matches!(store.sound(), Err(JudgeError::Read { .. })));
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
