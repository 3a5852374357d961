//! Tables with a row an epoch: rows in the order in which they came, spilled like those of satellites.

use std::path::Path;

use crate::error::JudgeError;
use crate::read::spill_store::{Cursor, Finder, SpillRow, SpillStore};

/// A table of which the first and the last row are held.
#[derive(Debug)]
pub struct Table<T> {
    rows: SpillStore<(), T>,
    first: Option<T>,
    last: Option<T>,
}

impl<T: SpillRow<()> + Clone> Table<T> {
    /// An empty one, which spills to a file in that directory.
    pub fn new(directory: &Path) -> Self {
        Self { rows: SpillStore::new(directory), first: None, last: None }
    }

    /// Adds a row.
    ///
    /// # Errors
    /// [`JudgeError::File`] where the file cannot be made or written.
    pub fn push(&mut self, row: T) -> Result<(), JudgeError> {
        self.rows.push((), &row)?;
        if self.first.is_none() {
            self.first = Some(row.clone());
        }
        self.last = Some(row);
        Ok(())
    }

    /// Directory of the file.
    pub fn directory(&self) -> &Path {
        self.rows.directory()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.count(&())
    }

    /// True if there is no row.
    pub fn is_empty(&self) -> bool {
        self.first.is_none()
    }

    /// The first row.
    pub fn first(&self) -> Option<&T> {
        self.first.as_ref()
    }

    /// The last row.
    pub fn last(&self) -> Option<&T> {
        self.last.as_ref()
    }

    /// Shows each row to `see`.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where the file cannot be read.
    pub fn each(&self, see: impl FnMut(T)) -> Result<(), JudgeError> {
        self.rows.each((), see)
    }

    /// Values of `of` for each row.
    ///
    /// # Errors
    ///
    /// Same as [`Self::each`].
    pub fn map<U>(&self, of: impl FnMut(T) -> U) -> Result<Vec<U>, JudgeError> {
        self.rows.map((), of)
    }

    /// The rows one after the other.
    pub fn cursor(&self) -> Cursor<'_, (), T> {
        self.rows.cursor(())
    }

    /// The rows by their samples.
    ///
    /// # Errors
    /// Errors of [`SpillStore::finder`].
    pub fn finder(&self) -> Result<Finder<'_, (), T>, JudgeError> {
        self.rows.finder(())
    }

    /// True if the samples of the rows ascend.
    pub fn ascends(&self) -> bool {
        self.rows.ascends(&())
    }

    /// Checks that all rows could be read, like [`SpillStore::sound`].
    ///
    /// # Errors
    ///
    /// Same as there.
    pub fn sound(&self) -> Result<(), JudgeError> {
        self.rows.sound()
    }
}
