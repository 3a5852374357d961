//! The files of a run: tables row by row, and JSON; a file that is missing is named together with what would
//! write it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::error::JudgeError;

pub(super) fn missing(path: &Path, remedy: &'static str) -> JudgeError {
    JudgeError::Missing { path: path.to_owned(), remedy }
}

/// Gives every row of a CSV file to `take`, with the number of its line; a file without even a header has
/// none.
pub(crate) fn each<T: DeserializeOwned>(
    path: &Path,
    remedy: &'static str,
    take: impl FnMut(u64, T) -> Result<(), JudgeError>,
) -> Result<(), JudgeError> {
    each_of(fs::File::open(path).map_err(|source| open_error(path, remedy, source))?, path, take)
}

/// Gives every row of a CSV file to `take`, if the run has that file.
pub(crate) fn each_of_any<T: DeserializeOwned>(
    path: &Path,
    take: impl FnMut(u64, T) -> Result<(), JudgeError>,
) -> Result<(), JudgeError> {
    match each(path, "", take) {
        Err(JudgeError::Missing { .. }) => Ok(()),
        other => other,
    }
}

fn each_of<T: DeserializeOwned>(
    input: impl io::Read,
    path: &Path,
    mut take: impl FnMut(u64, T) -> Result<(), JudgeError>,
) -> Result<(), JudgeError> {
    let failed = |error: csv::Error| {
        let path = path.to_owned();
        if !error.is_io_error() {
            return JudgeError::Row { path, source: error };
        }
        match error.into_kind() {
            csv::ErrorKind::Io(source) => JudgeError::Read { path, source },
            other => JudgeError::Read { path, source: io::Error::other(format!("{other:?}")) },
        }
    };
    let mut reader = csv::ReaderBuilder::new().buffer_capacity(1 << 16).from_reader(input);
    // Rows alone would take a header that cannot be read for one that is not there.
    reader.headers().map_err(failed)?;
    let header = reader.headers().map_err(failed)?.clone();
    // The header is line 1.
    (2..).zip(reader.into_records()).try_for_each(|(line, row)| {
        let row = row.map_err(failed)?;
        finite(path, line, &header, &row)?;
        take(line, row.deserialize(Some(&header)).map_err(failed)?)
    })
}

/// Refuses a row with a number that is none or endless: comparisons with it would be silent.
fn finite(path: &Path, line: u64, header: &csv::StringRecord, row: &csv::StringRecord) -> Result<(), JudgeError> {
    let odd = |text: &&str| text.parse::<f64>().is_ok_and(|number| !number.is_finite());
    // Only a letter or an exponent of three digits makes such a number.
    let suspect = |text: &str| text.len() > 2 && text.bytes().any(|byte| matches!(byte, b'n' | b'N' | b'e' | b'E'));
    let Some((column, text)) = row.iter().enumerate().find(|(_, text)| suspect(text) && odd(text)) else {
        return Ok(());
    };
    let name = header.get(column).unwrap_or("");
    let what = format!("{name} = {text}, expected a finite number");
    Err(JudgeError::Line { path: path.to_owned(), line, what })
}

/// All rows of a CSV file.
pub(super) fn rows<T: DeserializeOwned>(path: &Path, remedy: &'static str) -> Result<Vec<T>, JudgeError> {
    let mut rows = Vec::new();
    each(path, remedy, |_, row| {
        rows.push(row);
        Ok(())
    })?;
    Ok(rows)
}

/// Whole GPS seconds that a row may bear: 1980 to 2296, far from where arithmetic on them ends.
const SECONDS: std::ops::RangeInclusive<i64> = 0..=10_000_000_000;

/// Refuses a row whose GPS time is not believable.
pub(super) fn believable(path: &Path, line: u64, seconds: i64) -> Result<(), JudgeError> {
    if SECONDS.contains(&seconds) {
        return Ok(());
    }
    let what = format!("its GPS time is not within {} to {} s", SECONDS.start(), SECONDS.end());
    Err(JudgeError::Line { path: path.to_owned(), line, what })
}

/// All rows of a CSV file that a run may lack.
pub(super) fn optional<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, JudgeError> {
    let mut rows = Vec::new();
    each_of_any(path, |_, row| {
        rows.push(row);
        Ok(())
    })?;
    Ok(rows)
}

fn open_error(path: &Path, remedy: &'static str, source: io::Error) -> JudgeError {
    match source.kind() {
        io::ErrorKind::NotFound => missing(path, remedy),
        _ => JudgeError::Read { path: path.to_owned(), source },
    }
}

/// A JSON file, or `None` if there is none.
pub(super) fn json<T: DeserializeOwned>(path: &PathBuf) -> Result<Option<T>, JudgeError> {
    match fs::read(path) {
        Ok(bytes) => {
            serde_json::from_slice(&bytes).map(Some).map_err(|source| JudgeError::Json { path: path.clone(), source })
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(JudgeError::Read { path: path.clone(), source }),
    }
}

/// A text file, or `None` if there is none.
pub(super) fn text(path: &Path) -> Result<Option<String>, JudgeError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(String::from_utf8_lossy(&bytes).into_owned())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(JudgeError::Read { path: path.to_owned(), source }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails at one of its calls, and goes on as if nothing had been.
    struct Flaky<'a> {
        text: &'a [u8],
        calls: usize,
        fails: usize,
    }

    impl io::Read for Flaky<'_> {
        fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
            self.calls += 1;
            if self.calls == self.fails {
                return Err(io::ErrorKind::OutOfMemory.into());
            }
            let most = to.len().min(3);
            self.text.read(&mut to[..most])
        }
    }

    #[test]
    fn a_read_that_fails_is_told_wherever_it_is() {
        let text = b"frequency_hz,density_db\n1,2\n3,4\n";
        let mut refused = 0;
        for fails in 1..20 {
            let mut rows = Vec::new();
            let read = each_of(Flaky { text, calls: 0, fails }, Path::new("psd.csv"), |line, row: (f64, f64)| {
                rows.push((line, row));
                Ok(())
            });
            match read {
                Ok(()) => assert_eq!(rows, [(2, (1.0, 2.0)), (3, (3.0, 4.0))], "at call {fails}"),
                Err(error) => {
                    assert!(matches!(error, JudgeError::Read { .. }), "{error}");
                    refused += 1;
                }
            }
        }
        // Twelve pieces of three bytes, and the end.
        assert!(refused >= 12, "{refused}");
    }
}
