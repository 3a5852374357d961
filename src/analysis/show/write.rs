//! Tables and other files of a judgement: a reader sees the old one or the whole new one, never a part.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::staged::Staged;
use crate::error::JudgeError;

/// A CSV file that is still being written.
pub struct Table {
    path: PathBuf,
    staged: Staged,
    rows: csv::Writer<File>,
    /// Names of the columns, with commas between; of a table that may have no row.
    columns: &'static str,
    has_rows: bool,
}

impl Table {
    /// Begins one, which gets its name when it is finished. Without rows it has the header of its `columns`.
    pub fn create(path: &Path, columns: &'static str) -> Result<Self, JudgeError> {
        let begun = Staged::file(part(path)).map_err(|source| JudgeError::File { path: path.to_owned(), source });
        let (staged, file) = begun?;
        Ok(Self { path: path.to_owned(), staged, rows: csv::Writer::from_writer(file), columns, has_rows: false })
    }

    /// Adds a row.
    pub fn row(&mut self, row: &impl Serialize) -> Result<(), JudgeError> {
        self.has_rows = true;
        self.rows.serialize(row).map_err(|error| self.failed(error))
    }

    fn failed(&self, error: csv::Error) -> JudgeError {
        let path = self.path.clone();
        if !error.is_io_error() {
            return JudgeError::Row { path, source: error };
        }
        match error.into_kind() {
            csv::ErrorKind::Io(source) => JudgeError::File { path, source },
            other => JudgeError::File { path, source: io::Error::other(format!("{other:?}")) },
        }
    }

    /// Gives it its name.
    pub fn finish(mut self) -> Result<(), JudgeError> {
        if !self.has_rows && !self.columns.is_empty() {
            self.rows.write_record(self.columns.split(',')).map_err(|error| self.failed(error))?;
        }
        let finished = self.rows.flush().and_then(|()| self.staged.finish(&self.path));
        finished.map_err(|source| JudgeError::File { path: self.path, source })
    }
}

/// Writes rows as a CSV file; `columns` are its header where there are none.
pub fn write_rows<T: Serialize>(
    path: &Path,
    columns: &'static str,
    mut rows: impl Iterator<Item = T>,
) -> Result<(), JudgeError> {
    let mut table = Table::create(path, columns)?;
    rows.try_for_each(|row| table.row(&row))?;
    table.finish()
}

/// Writes rows as a CSV file while they are read.
pub fn write_read_rows<T: Serialize>(
    path: &Path,
    columns: &'static str,
    mut rows: impl Iterator<Item = Result<T, JudgeError>>,
) -> Result<(), JudgeError> {
    let mut table = Table::create(path, columns)?;
    rows.try_for_each(|row| table.row(&row?))?;
    table.finish()
}

/// Removes a report of an earlier judgement. A file of that name that this program did not make stays.
///
/// # Errors
/// The file that cannot be read or removed.
pub fn retire(path: &Path) -> Result<(), JudgeError> {
    let failed = |source| JudgeError::File { path: path.to_owned(), source };
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(failed(error)),
    };
    let is_own = bytes.windows(MADE_BY.len()).any(|window| window == MADE_BY);
    if is_own { fs::remove_file(path).map_err(failed) } else { Ok(()) }
}

/// Words that every report has, in a PDF as its producer.
const MADE_BY: &[u8] = b"gnss-twin ";

/// The name under which a file is made.
fn part(path: &Path) -> PathBuf {
    let mut part = OsString::from(".");
    part.push(path.file_name().unwrap_or_default());
    part.push(".part");
    path.with_file_name(part)
}

/// Writes a file so that a reader sees the old one or the new one, never a part.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), JudgeError> {
    Staged::file(part(path))
        .and_then(|(staged, mut file)| {
            file.write_all(bytes)?;
            staged.finish(path)
        })
        .map_err(|source| JudgeError::File { path: path.to_owned(), source })
}
