//! Files as they are stored: plain, or packed by gzip (RFC 1952), within a bound.

use std::io::Read;

use thiserror::Error;

const MAGIC: [u8; 2] = [0x1f, 0x8b];
/// First bytes of files that other programs pack.
const OTHERS: [(&[u8], &str); 7] = [
    (b"\x1f\x9d", "compress (.Z)"),
    (b"PK\x03\x04", "zip"),
    (b"BZh", "bzip2"),
    (b"\xfd7zXZ\0", "xz"),
    (b"\x28\xb5\x2f\xfd", "zstd"),
    (b"7z\xbc\xaf\x27\x1c", "7-Zip"),
    (b"Rar!", "RAR"),
];

/// Reason for which compressed bytes cannot be unpacked.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum InflateError {
    /// More bytes than allowed, which are these.
    #[error("more than {0} bytes after decompression")]
    TooLarge(u64),
    /// Packed in another way, which is this one.
    #[error("packed by {0}, which is not read: expected the plain file, or one packed by gzip")]
    Packed(&'static str),
    /// Data that are not gzip, with a description of the error.
    #[error("damaged gzip data ({0})")]
    Damaged(String),
}

/// Returns the plain bytes of a file, at most `largest` of them.
///
/// # Errors
/// [`InflateError`].
pub fn inflate(bytes: &[u8], largest: u64) -> Result<Vec<u8>, InflateError> {
    if let Some((_, program)) = OTHERS.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return Err(InflateError::Packed(program));
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_other_programs_pack_is_refused_by_their_names() {
        // The first bytes of "hello" by compress, zip and xz.
        let z = b"\x1f\x9d\x90\x68\xca\xb0\x61\xf3\x06";
        for (bytes, name) in [(&z[..], "compress (.Z)"), (b"PK\x03\x04\x0a\0", "zip"), (b"\xfd7zXZ\0\0\x04", "xz")] {
            let refusal = inflate(bytes, 100).unwrap_err().to_string();
            assert!(refusal.contains(name) && refusal.contains("expected the plain file"), "{refusal}");
        }
        assert_eq!(inflate(b"PKU zip", 100), Ok(b"PKU zip".to_vec()));
    }
}
