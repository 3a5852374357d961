//! Samples as the receiver meets them: blocks of planar `f32` with the number of their first sample.
//!
//! A [`Source`] reads packed bytes from any reader in blocks of a fixed number of samples, so that
//! memory stays flat however long the recording is. Short reads and interruptions are absorbed; a
//! sample cut off at the end of the stream is left out and its bytes are counted.

use std::io::{ErrorKind, Read};

use thiserror::Error;

use crate::gnss::samples::Format;

/// Consecutive samples; `q` is all zeros for a real recording.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    /// Number of the first sample since the start of the recording.
    pub first: u64,
    pub i: &'a [f32],
    pub q: &'a [f32],
}

/// Why samples could not be read.
#[derive(Debug, Error)]
pub enum SourceError {
    /// A block must hold at least one sample.
    #[error("a block of 0 samples was asked for: expected at least 1")]
    EmptyStride,
    /// The reader failed.
    #[error("cannot read the samples after sample {sample}: {error}")]
    Read { sample: u64, error: std::io::Error },
}

/// Packed samples of one format, read block by block.
#[derive(Debug)]
pub struct Source<R> {
    reader: R,
    format: Format,
    bytes: Vec<u8>,
    i: Vec<f32>,
    q: Vec<f32>,
    samples: u64,
    cut_bytes: usize,
    ended: bool,
}

impl<R: Read> Source<R> {
    /// Samples of `format` from `reader`, in blocks of `stride_samples`.
    ///
    /// # Errors
    /// [`SourceError::EmptyStride`] if `stride_samples` is 0.
    pub fn new(reader: R, format: Format, stride_samples: usize) -> Result<Self, SourceError> {
        let mut source = Self {
            reader,
            format,
            bytes: Vec::new(),
            i: Vec::new(),
            q: Vec::new(),
            samples: 0,
            cut_bytes: 0,
            ended: false,
        };
        source.set_stride(stride_samples)?;
        Ok(source)
    }

    /// Makes the next blocks `stride_samples` long.
    ///
    /// # Errors
    /// [`SourceError::EmptyStride`] if `stride_samples` is 0.
    pub fn set_stride(&mut self, stride_samples: usize) -> Result<(), SourceError> {
        if stride_samples == 0 {
            return Err(SourceError::EmptyStride);
        }
        self.bytes.resize(stride_samples * self.format.bytes(), 0);
        Ok(())
    }

    /// The next block: exactly one stride of samples, fewer only at the end; `None` after the last one.
    ///
    /// # Errors
    /// [`SourceError::Read`] as the reader reports it; an interruption is tried again.
    pub fn next_block(&mut self) -> Result<Option<Block<'_>>, SourceError> {
        let mut filled = 0;
        while filled < self.bytes.len() && !self.ended {
            match self.reader.read(&mut self.bytes[filled..]) {
                Ok(0) => self.ended = true,
                Ok(count) => filled += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(SourceError::Read { sample: self.samples, error }),
            }
        }
        // Only the end of the stream leaves a block unfilled, so a cut sample happens at most once.
        let whole = filled - filled % self.format.bytes();
        self.cut_bytes += filled - whole;
        self.format.unpack(&self.bytes[..whole], &mut self.i, &mut self.q);
        if self.i.is_empty() {
            return Ok(None);
        }
        let first = self.samples;
        self.samples += self.i.len() as u64;
        Ok(Some(Block { first, i: &self.i, q: &self.q }))
    }

    /// Whole samples given out so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Bytes of a sample that the end of the stream cut off: not 0 usually means a wrong format.
    pub fn cut_bytes(&self) -> usize {
        self.cut_bytes
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    /// Gives one to three bytes a call and is interrupted every fourth call.
    struct Stutter<'a> {
        bytes: &'a [u8],
        calls: usize,
    }

    impl Read for Stutter<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.calls += 1;
            if self.calls.is_multiple_of(4) {
                return Err(ErrorKind::Interrupted.into());
            }
            let count = (1 + self.calls % 3).min(buffer.len()).min(self.bytes.len());
            let (head, tail) = self.bytes.split_at(count);
            buffer[..count].copy_from_slice(head);
            self.bytes = tail;
            Ok(count)
        }
    }

    #[test]
    fn blocks_do_not_depend_on_how_the_bytes_arrive() {
        for (format, _) in Format::NAMES {
            let bytes: Vec<u8> = (0..1003_u32).map(|n| (n * 37 % 251) as u8).collect();
            let (mut all_i, mut all_q) = (Vec::new(), Vec::new());
            format.unpack(&bytes, &mut all_i, &mut all_q);
            let mut source = Source::new(Stutter { bytes: &bytes, calls: 0 }, format, 7).unwrap();
            let (mut i, mut q) = (Vec::new(), Vec::new());
            while let Some(block) = source.next_block().unwrap() {
                assert_eq!(block.first, i.len() as u64);
                assert!(block.i.len() == 7 || i.len() + block.i.len() == all_i.len());
                i.extend_from_slice(block.i);
                q.extend_from_slice(block.q);
            }
            assert!(source.next_block().unwrap().is_none());
            assert_eq!((&i, &q), (&all_i, &all_q), "{format}");
            assert_eq!(source.samples(), i.len() as u64);
            assert_eq!(source.cut_bytes(), 1003 % format.bytes(), "{format}");
        }
    }

    #[test]
    fn a_failing_reader_and_an_empty_stride_are_errors() {
        struct Broken;
        impl Read for Broken {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("unplugged"))
            }
        }
        let error = Source::new(Broken, Format::Ci8, 8).unwrap().next_block().unwrap_err().to_string();
        assert!(error.contains("sample 0") && error.contains("unplugged"), "{error}");
        assert!(matches!(Source::new(Broken, Format::Ci8, 0), Err(SourceError::EmptyStride)));
    }
}
