//! SigMF archives: the recording in a tar file, without unpacking it.
//!
//! Source: SigMF 1.2.0, "SigMF Archives"; POSIX.1-2017, pax, "ustar Interchange Format". Limits: sizes up to
//! the 8 GiB of ustar's eleven octal digits, and beyond as the binary number that GNU tar and Python write.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// A file in an archive.
pub struct Member {
    pub name: String,
    /// Offset of the member's contents in the archive, bytes.
    pub first: u64,
    /// Length of the contents, bytes.
    pub size: u64,
}

const BLOCK: u64 = 512;

/// The regular files of an archive, in their order.
pub fn members(file: &mut File) -> io::Result<Vec<Member>> {
    let (mut members, mut at) = (Vec::new(), 0);
    let end = file.seek(SeekFrom::End(0))?;
    let mut header = [0; BLOCK as usize];
    while at + BLOCK <= end {
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut header)?;
        if header.iter().all(|byte| *byte == 0) {
            break;
        }
        let part = |from: usize, to: usize| header.get(from..to).unwrap_or_default();
        let text = |from, to| String::from_utf8_lossy(part(from, to)).trim_end_matches('\0').to_owned();
        let wrong = |what| io::Error::new(io::ErrorKind::InvalidData, format!("no tar archive: {what} at byte {at}"));
        if checksum(&header) != octal(part(148, 156)) {
            return Err(wrong("a wrong checksum"));
        }
        let size = size(part(124, 136)).ok_or_else(|| wrong("a size that is no number"))?;
        if matches!(header.get(156), Some(0 | b'0' | b'7')) {
            let (prefix, name) = (text(345, 500), text(0, 100));
            let name = if prefix.is_empty() { name } else { format!("{prefix}/{name}") };
            if size > end.saturating_sub(at + BLOCK) {
                return Err(wrong("a file that goes on past the end"));
            }
            members.push(Member { name, first: at + BLOCK, size });
        }
        at = size.div_ceil(BLOCK).checked_mul(BLOCK).and_then(|size| size.checked_add(at + BLOCK)).unwrap_or(end);
    }
    Ok(members)
}

/// Sum of a header's bytes with blanks for the checksum's own.
fn checksum(header: &[u8; BLOCK as usize]) -> Option<u64> {
    let own = |place: usize, byte: &u8| if (148..156).contains(&place) { 32 } else { u64::from(*byte) };
    Some(header.iter().enumerate().map(|(place, byte)| own(place, byte)).sum())
}

fn octal(digits: &[u8]) -> Option<u64> {
    let text = std::str::from_utf8(digits).ok()?;
    u64::from_str_radix(text.trim_matches([' ', '\0']), 8).ok()
}

fn size(field: &[u8]) -> Option<u64> {
    match field {
        // The highest bit says that the rest is a binary number.
        [0x80, rest @ ..] => {
            let (high, low) = rest.split_at_checked(rest.len().checked_sub(8)?)?;
            high.iter().all(|byte| *byte == 0).then(|| low.iter().fold(0, |size, byte| size << 8 | u64::from(*byte)))
        }
        digits => octal(digits),
    }
}
