//! Files as they are stored: plain, or packed by gzip (RFC 1952), within a bound.

use std::io::Read;

use thiserror::Error;

const MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Why bytes do not unpack.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum InflateError {
    /// More bytes than allowed, which are these.
    #[error("more than {0} bytes after decompression")]
    TooLarge(u64),
    /// Data that are no gzip, with what was wrong.
    #[error("damaged gzip data ({0})")]
    Damaged(String),
}

/// The plain bytes of a file, at most `largest` of them.
///
/// # Errors
/// [`InflateError`].
pub fn inflate(bytes: &[u8], largest: u64) -> Result<Vec<u8>, InflateError> {
    let mut plain = Vec::new();
    if bytes.starts_with(&MAGIC) {
        flate2::read::MultiGzDecoder::new(bytes)
            .take(largest + 1)
            .read_to_end(&mut plain)
            .map_err(|e| InflateError::Damaged(e.to_string()))?;
    } else if bytes.len() as u64 <= largest {
        plain.extend_from_slice(bytes);
    } else {
        return Err(InflateError::TooLarge(largest));
    }
    if plain.len() as u64 > largest { Err(InflateError::TooLarge(largest)) } else { Ok(plain) }
}
