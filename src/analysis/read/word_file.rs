//! Words of 64 bits in a file without a name, which is gone with the process however that ends.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::error::JudgeError;

/// The file, made once there is something to write.
#[derive(Debug)]
pub(super) struct WordFile {
    /// Directory in which the file is made.
    directory: PathBuf,
    file: Option<Mutex<File>>,
    /// Words in it.
    words: u64,
}

impl WordFile {
    /// An empty list, whose file will be made in that directory.
    pub fn new(directory: &Path) -> Self {
        Self { directory: directory.to_owned(), file: None, words: 0 }
    }

    /// Directory in which the file is made.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Length of the file in words.
    pub fn len(&self) -> u64 {
        self.words
    }

    /// Writes words behind the others and says where they begin.
    ///
    /// # Errors
    /// [`JudgeError::File`] where the file cannot be made or written.
    pub fn append(&mut self, words: &[u64]) -> Result<u64, JudgeError> {
        let failed = |source| JudgeError::File { path: self.directory.clone(), source };
        if self.file.is_none() {
            self.file = Some(Mutex::new(tempfile::tempfile_in(&self.directory).map_err(failed)?));
        }
        let start = self.words;
        if let Some(file) = &mut self.file {
            let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            let file = file.get_mut().unwrap_or_else(PoisonError::into_inner);
            // Reading has left the position where it ends.
            file.seek(SeekFrom::Start(8 * start)).and_then(|_| file.write_all(&bytes)).map_err(failed)?;
        }
        self.words += words.len() as u64;
        Ok(start)
    }

    /// Reads so many words from one on, in place of those that are in `words`.
    ///
    /// # Errors
    /// Errors of the system, and of words that were never written.
    pub fn read(&self, start: u64, count: usize, words: &mut Vec<u64>) -> io::Result<()> {
        let Some(file) = &self.file else { return Ok(()) };
        let mut bytes = vec![0; 8 * count];
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

    /// Error of a read, with the file's directory.
    pub fn unreadable(&self, source: io::Error) -> JudgeError {
        JudgeError::Read { path: self.directory.clone(), source }
    }

    /// Takes away what lies behind so many words, as a disk may that is full.
    #[cfg(test)]
    pub fn cut(&mut self, words: u64) {
        self.file.as_mut().unwrap().get_mut().unwrap().set_len(8 * words).unwrap();
    }
}
