use std::io::Cursor;

use super::*;

/// NAV-EOE and ACK-ACK by hand: class, number, length, payload, and Fletcher's sums over these.
const EOE: [u8; 12] = [0xb5, 0x62, 0x01, 0x61, 0x04, 0x00, 0x01, 0x00, 0x00, 0x00, 0x67, 0xcb];
const ACK: [u8; 10] = [0xb5, 0x62, 0x05, 0x01, 0x02, 0x00, 0x06, 0x01, 0x0f, 0x38];
/// Sentence of NMEA 0183 whose check is widely printed.
const GGA: &[u8] = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n";
/// RTCM 3's message 1005 as printed in the standard's example (RTCM 10403.3, 4.2).
const STATION: &[u8] = &[
    0xd3, 0x00, 0x13, 0x3e, 0xd7, 0xd3, 0x02, 0x02, 0x98, 0x0e, 0xde, 0xef, 0x34, 0xb4, 0xbd, 0x62, 0xac, 0x09, 0x41,
    0x98, 0x6f, 0x33, 0x36, 0x0b, 0x98,
];

/// Reader that gives so many bytes at a time.
struct Slow<'a>(&'a [u8], usize);

impl Read for Slow<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.1.min(into.len()).min(self.0.len());
        into[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        Ok(count)
    }
}

type Read3 = (Vec<(Protocol, u64)>, [Count; 4], u64);

fn all(input: impl Read) -> Read3 {
    let mut frames = Frames::new(input);
    let found = frames.by_ref().map(|frame| frame.unwrap()).map(|frame| (frame.protocol, frame.offset)).collect();
    (found, frames.counts, frames.skipped_bytes)
}

#[test]
fn frames_of_all_protocols_are_found_among_each_other() {
    let stream = [&EOE[..], GGA, STATION, &ACK].concat();
    let (found, counts, skipped) = all(Cursor::new(&stream));
    let station = (EOE.len() + GGA.len()) as u64;
    let expected = [
        (Protocol::Ubx, 0),
        (Protocol::Nmea, 12),
        (Protocol::Rtcm, station),
        (Protocol::Ubx, station + STATION.len() as u64),
    ];
    assert_eq!(found, expected);
    assert_eq!((counts.iter().map(|count| count.damaged).sum::<u64>(), skipped), (0, 0));
}

#[test]
fn a_damaged_byte_costs_one_frame_and_is_counted() {
    let clean = [&EOE[..], &ACK, &EOE, GGA, STATION].concat();
    for at in EOE.len() + 2..EOE.len() + ACK.len() {
        let mut stream = clean.clone();
        stream[at] ^= 0x10;
        let (found, counts, skipped) = all(Cursor::new(&stream));
        // A length that grows reaches into the next frame; its own frame is lost, no other.
        assert_eq!(found.len(), 4, "{at}");
        assert_eq!((counts[0], skipped), (Count { frames: 2, damaged: 1 }, ACK.len() as u64), "{at}");
    }
}

#[test]
fn a_stream_may_begin_and_end_within_a_frame() {
    let stream = [&EOE[5..], &ACK, &EOE[..9]].concat();
    let (found, counts, skipped) = all(Cursor::new(&stream));
    assert_eq!(found, [(Protocol::Ubx, 7)]);
    assert_eq!((counts[0].damaged, skipped), (1, 16));
}

#[test]
fn pieces_of_the_stream_do_not_change_what_is_found() {
    let stream = [&EOE[3..], b"$GPXX,nothing\xff", GGA, STATION, b"\xb5", &ACK, &GGA[..66]].concat();
    let whole = all(Cursor::new(&stream));
    assert_eq!(whole.0.len(), 4);
    for piece in [1, 2, 3, 7, 50] {
        assert_eq!(all(Slow(&stream, piece)), whole, "{piece}");
    }
}

#[test]
fn a_block_of_sbf_is_known_by_its_crc() {
    // CRC-16/XMODEM of the catalogue has the same polynomial and start.
    assert_eq!(crc_ccitt(b"123456789"), 0x31c3);
    let body = [0x8e, 0x17, 12, 0, 1, 2, 3, 4];
    let crc = crc_ccitt(&body).to_le_bytes();
    let block = [&b"$@"[..], &crc, &body].concat();
    assert_eq!(all(Cursor::new(&block)).0, [(Protocol::Sbf, 0)]);
    let mut broken = block.clone();
    broken[9] ^= 1;
    assert_eq!(all(Cursor::new(&broken)).1[2], Count { frames: 0, damaged: 1 });
}

#[test]
fn an_error_of_the_source_is_handed_on_once() {
    struct Broken;
    impl Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("unplugged"))
        }
    }
    let mut frames = Frames::new(Broken);
    assert!(frames.next().is_some_and(|frame| frame.is_err()));
    assert!(frames.next().is_none());
}
