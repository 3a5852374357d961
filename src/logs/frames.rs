//! Frames of receivers' protocols in a stream of bytes: UBX, RTCM 3, SBF and NMEA 0183, also mixed.
//!
//! Sources: u-blox F9 HPG 1.32 interface description, 3.2 and 3.4 (checksum); RTCM 10403.3, 4.1; Septentrio
//! SBF reference guide, 4.1; NMEA 0183. A frame counts by its own check alone. Where a check fails, the
//! search goes on with the byte behind the first one, so one damaged frame costs no other. A stream may begin
//! and end within a frame. Memory is one buffer of [`BUFFER_BYTES`]. Limits: UBX payloads above 8 KiB and SBF
//! blocks above 16 KiB, which no message that is read here needs, are taken for damage.

use std::io::{self, ErrorKind, Read};

use gnss::crc::crc24q;

/// A protocol of receivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Protocol {
    /// u-blox's own.
    Ubx,
    /// RTCM 10403, version 3.
    Rtcm,
    /// Septentrio Binary Format.
    Sbf,
    /// Sentences of text.
    Nmea,
}

impl Protocol {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Ubx, Self::Rtcm, Self::Sbf, Self::Nmea];

    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ubx => "UBX",
            Self::Rtcm => "RTCM 3",
            Self::Sbf => "SBF",
            Self::Nmea => "NMEA",
        }
    }
}

/// Frames of one protocol.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Frames whose check holds.
    pub frames: u64,
    /// Beginnings of frames whose check fails, or that the end of the stream cuts off.
    pub damaged: u64,
}

/// A frame whose check holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The protocol.
    pub protocol: Protocol,
    /// Bytes of the stream before it.
    pub offset: u64,
    /// All its bytes, with frame and check.
    pub bytes: Vec<u8>,
}

/// Size of the buffer in bytes.
pub const BUFFER_BYTES: usize = 1 << 16;
const LARGEST_UBX: usize = 8192;
const LARGEST_SBF: usize = 16_384;
const LONGEST_NMEA: usize = 512;

/// Frames of a stream, in their order.
pub struct Frames<R> {
    input: R,
    buffer: Vec<u8>,
    /// First byte of the buffer that is not done with.
    from: usize,
    /// Bytes of the stream before that.
    offset: u64,
    has_ended: bool,
    /// Counts by protocol, in the order of [`Protocol::ALL`].
    pub counts: [Count; 4],
    /// Bytes that belong to no frame.
    pub skipped_bytes: u64,
}

impl<R: Read> Frames<R> {
    /// Frames of a stream from its beginning.
    pub fn new(input: R) -> Self {
        Self {
            input,
            buffer: Vec::with_capacity(BUFFER_BYTES),
            from: 0,
            offset: 0,
            has_ended: false,
            counts: [Count::default(); 4],
            skipped_bytes: 0,
        }
    }

    /// Counts of one protocol.
    pub fn count_of(&self, protocol: Protocol) -> Count {
        self.counts[protocol as usize]
    }

    fn pass(&mut self, bytes: usize) {
        self.from += bytes;
        self.offset += bytes as u64;
    }

    /// Reads more bytes behind those that are not done with.
    fn fill(&mut self) -> io::Result<()> {
        self.buffer.drain(..self.from);
        self.from = 0;
        let have = self.buffer.len();
        self.buffer.resize(BUFFER_BYTES, 0);
        let read = loop {
            match self.input.read(&mut self.buffer[have..]) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                other => break other,
            }
        };
        self.buffer.truncate(have + read.as_ref().copied().unwrap_or(0).min(BUFFER_BYTES - have));
        self.has_ended = matches!(read, Ok(0));
        read.map(|_| ())
    }
}

impl<R: Read> Iterator for Frames<R> {
    type Item = io::Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let rest = self.buffer.get(self.from..).unwrap_or_default();
            let found = match rest.first() {
                Some(_) => look(rest, self.has_ended),
                None if self.has_ended => return None,
                None => Found::Unfinished(None),
            };
            match found {
                Found::Unfinished(_) if !self.has_ended => {
                    if let Err(error) = self.fill() {
                        // Later calls end.
                        self.has_ended = true;
                        self.buffer.clear();
                        self.from = 0;
                        return Some(Err(error));
                    }
                }
                Found::Whole(protocol, length) => {
                    let frame = Frame { protocol, offset: self.offset, bytes: rest[..length].to_vec() };
                    self.counts[protocol as usize].frames += 1;
                    self.pass(length);
                    return Some(Ok(frame));
                }
                Found::Damaged(protocol) | Found::Unfinished(Some(protocol)) => {
                    self.counts[protocol as usize].damaged += 1;
                    self.skipped_bytes += 1;
                    self.pass(1);
                }
                Found::Nothing | Found::Unfinished(None) => {
                    let is_start = |byte: &u8| matches!(byte, 0xb5 | 0xd3 | b'$');
                    let next = rest.iter().skip(1).position(is_start).map_or(rest.len(), |at| at + 1);
                    self.skipped_bytes += next as u64;
                    self.pass(next);
                }
            }
        }
    }
}

/// Result of a look at bytes.
#[derive(Debug, PartialEq, Eq)]
enum Found {
    /// A frame of so many bytes.
    Whole(Protocol, usize),
    /// A beginning whose check fails.
    Damaged(Protocol),
    /// More bytes are needed; of a protocol where the beginning is one.
    Unfinished(Option<Protocol>),
    Nothing,
}

/// Looks whether bytes, of which the last may be the stream's, begin with a frame.
fn look(bytes: &[u8], has_ended: bool) -> Found {
    match bytes {
        [0xb5, 0x62, ..] => ubx(bytes),
        [0xd3, top, ..] if top & 0xfc == 0 => rtcm(bytes),
        [b'$', b'@', ..] => sbf(bytes),
        [b'$', b'A'..=b'Z', ..] => nmea(bytes, has_ended),
        [0xb5 | 0xd3 | b'$'] => Found::Unfinished(None),
        _ => Found::Nothing,
    }
}

/// A frame of so many bytes whose check is looked at once they are there.
fn checked(protocol: Protocol, bytes: &[u8], length: usize, holds: impl FnOnce(&[u8]) -> bool) -> Found {
    match bytes.get(..length) {
        None => Found::Unfinished(Some(protocol)),
        Some(frame) if holds(frame) => Found::Whole(protocol, length),
        Some(_) => Found::Damaged(protocol),
    }
}

fn ubx(bytes: &[u8]) -> Found {
    let Some(length) = bytes.get(4..6).map(|two| usize::from(two[0]) | usize::from(two[1]) << 8) else {
        return Found::Unfinished(Some(Protocol::Ubx));
    };
    if length > LARGEST_UBX {
        return Found::Damaged(Protocol::Ubx);
    }
    checked(Protocol::Ubx, bytes, length + 8, |frame| {
        let (body, check) = frame.split_at(frame.len() - 2);
        fletcher(&body[2..]) == check
    })
}

/// Checksum of UBX: Fletcher's of 8 bits, over class, number, length and payload (3.4).
pub fn fletcher(bytes: &[u8]) -> [u8; 2] {
    bytes.iter().fold([0, 0], |[a, b], byte| {
        let a = byte.wrapping_add(a);
        [a, a.wrapping_add(b)]
    })
}

fn rtcm(bytes: &[u8]) -> Found {
    let Some(length) = bytes.get(1..3).map(|two| usize::from(two[0] & 3) << 8 | usize::from(two[1])) else {
        return Found::Unfinished(Some(Protocol::Rtcm));
    };
    let bits = |bytes: &[u8]| crc24q(bytes.iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1 == 1)));
    // A frame followed by its own check leaves zero.
    checked(Protocol::Rtcm, bytes, length + 6, |frame| bits(frame) == 0)
}

fn sbf(bytes: &[u8]) -> Found {
    let Some(head) = bytes.get(..8) else { return Found::Unfinished(Some(Protocol::Sbf)) };
    let word = |at: usize| u16::from_le_bytes([head[at], head[at + 1]]);
    let length = usize::from(word(6));
    if length < 8 || length % 4 != 0 || length > LARGEST_SBF {
        return Found::Damaged(Protocol::Sbf);
    }
    checked(Protocol::Sbf, bytes, length, |block| crc_ccitt(&block[4..]) == word(2))
}

/// CRC of SBF: CCITT's of 16 bits, polynomial 0x1021, from zero (4.1).
pub fn crc_ccitt(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| if crc & 0x8000 != 0 { crc << 1 ^ 0x1021 } else { crc << 1 })
    })
}

fn nmea(bytes: &[u8], has_ended: bool) -> Found {
    let is_text = |byte: &u8| (0x20..0x7f).contains(byte) && *byte != b'$';
    let line = bytes.iter().skip(1).take(LONGEST_NMEA).take_while(|byte| is_text(byte)).count() + 1;
    // A line ends with two bytes.
    if bytes.len() < line + 2 && line <= LONGEST_NMEA && !has_ended {
        return Found::Unfinished(Some(Protocol::Nmea));
    }
    let text = &bytes[1..line];
    let Some((body, [high, low])) = text.split_last_chunk::<2>() else { return Found::Nothing };
    let Some((b'*', body)) = body.split_last() else { return Found::Nothing };
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let check = body.iter().fold(0, |sum, byte| sum ^ u32::from(*byte));
    if digit(*high).zip(digit(*low)).is_none_or(|(high, low)| 16 * high + low != check) {
        return Found::Damaged(Protocol::Nmea);
    }
    let ends = bytes[line..].iter().take(2).take_while(|byte| matches!(byte, b'\r' | b'\n')).count();
    Found::Whole(Protocol::Nmea, line + ends)
}

#[cfg(test)]
#[path = "frames_tests.rs"]
mod tests;
