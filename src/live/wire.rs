//! Motion and events as they come in: datagrams of Skydel's hardware-in-the-loop layout, lines of text, NMEA.
//!
//! A datagram that begins with 1 to 8 is binary, little-endian, by its first byte: 1 hello, 2 bye, 3 a
//! request (passed over), 5 a place, 6 with attitude, 7 and 8 the same with a byte for the derivatives that
//! follow (0 velocity, 1 and acceleration, 2 and jerk). Then the time in milliseconds since the start, the
//! place and its derivatives, ECEF in metres, each with its angles' in 6 and 8; at the end a name, a 32-bit
//! length before it. Everything else is a line: `t x y z` with velocity, acceleration and jerk where known
//! (seconds, metres, ECEF), a GGA sentence, or an event. Limits: a pushed attitude is counted and not used;
//! the order of angles in 8 is as its vendor's clients send it, by description and not seen on a wire.

use nalgebra::Vector3;
use thiserror::Error;

use crate::generator::event::{Event, EventError};
use crate::generator::vehicle::file::gga;
use crate::generator::vehicle::joining::Push;
use crate::gnss::time::Epoch;

/// Bytes of a datagram or a line at most.
pub const MOST_BYTES: usize = 512;

/// Something that came in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// A state, and whether an attitude came with it.
    Push(Push, bool),
    /// Something to switch.
    Event(Event),
    /// A sender says that it begins, or asks something.
    Hello,
    /// A sender says that it ends.
    Bye,
}

/// Why bytes are no message.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WireError {
    /// Too long for any message.
    #[error("more than {MOST_BYTES} bytes")]
    Long,
    /// A number of the first byte that has no meaning.
    #[error("message {0}: expected 1, 2, 3 or 5 to 8")]
    Unknown(u8),
    /// A length that does not fit the kind.
    #[error("message {kind} of {length} bytes: expected {expected}, and a name with its length")]
    Length {
        /// The first byte.
        kind: u8,
        /// Bytes that came.
        length: usize,
        /// Bytes without a name.
        expected: usize,
    },
    /// A line with a count of numbers that makes no state.
    #[error("{0} numbers: expected t x y z, then velocity, acceleration and jerk as far as known: 4, 7, 10 or 13")]
    Count(usize),
    /// A word of a line that is no number.
    #[error("'{0}': expected a number")]
    NotNumber(String),
    /// A line that is no text.
    #[error("not UTF-8")]
    NotText,
    /// An NMEA sentence that is not used, or wrong.
    #[error("NMEA: {0}")]
    Nmea(String),
    /// A line that is no event.
    #[error(transparent)]
    Event(#[from] EventError),
}

/// Reads a datagram; `start` is the scene's, for times of day.
///
/// # Errors
/// What is wrong with it.
pub fn datagram(bytes: &[u8], start: Epoch) -> Result<Message, WireError> {
    if bytes.len() > MOST_BYTES {
        return Err(WireError::Long);
    }
    match bytes.split_first() {
        Some((kind, rest)) if (1..=8).contains(kind) => binary(*kind, rest),
        _ => line(std::str::from_utf8(bytes).map_err(|_| WireError::NotText)?, start),
    }
}

fn binary(kind: u8, rest: &[u8]) -> Result<Message, WireError> {
    let (attitude, dynamic) = match kind {
        1 | 3 => return Ok(Message::Hello),
        2 => return Ok(Message::Bye),
        5 => (false, false),
        6 => (true, false),
        7 => (false, true),
        8 => (true, true),
        other => return Err(WireError::Unknown(other)),
    };
    let (derivatives, body) = match rest.split_first() {
        Some((count, body)) if dynamic && *count <= 2 => (usize::from(*count) + 1, body),
        _ if dynamic => return Err(WireError::Length { kind, length: rest.len() + 1, expected: 1 + 1 + 8 + 24 }),
        _ => (0, rest),
    };
    let vectors = (1 + derivatives) * if attitude { 2 } else { 1 };
    let length = 8 + 24 * vectors;
    let expected = Err(WireError::Length { kind, length: rest.len() + 1, expected: 1 + usize::from(dynamic) + length });
    let Some((numbers, name)) = body.split_at_checked(length) else { return expected };
    let named = match name.split_first_chunk::<4>() {
        Some((count, name)) => u32::from_le_bytes(*count) as usize == name.len(),
        None => name.is_empty(),
    };
    if !named {
        return expected;
    }
    let values = numbers.chunks_exact(8).map(|chunk| f64::from_le_bytes(chunk.try_into().unwrap_or_default()));
    let mut values = values.collect::<Vec<f64>>().into_iter();
    let t_s = values.next().unwrap_or(f64::NAN) / 1e3;
    let mut vector = || -> Vector3<f64> {
        let found = Vector3::from_fn(|_, _| values.next().unwrap_or(f64::NAN));
        if attitude {
            values.by_ref().take(3).for_each(drop);
        }
        found
    };
    let position_m = vector();
    let mut next = |order: usize| (derivatives >= order).then(&mut vector);
    let (velocity_mps, acceleration_mps2, jerk_mps3) = (next(1), next(2), next(3));
    Ok(Message::Push(Push { t_s, position_m, velocity_mps, acceleration_mps2, jerk_mps3 }, attitude))
}

/// Reads a line of text; `start` is the scene's, for times of day.
///
/// # Errors
/// What is wrong with it.
pub fn line(text: &str, start: Epoch) -> Result<Message, WireError> {
    if text.len() > MOST_BYTES {
        return Err(WireError::Long);
    }
    let text = text.trim();
    match text.chars().next() {
        Some('$') => sentence(text, start),
        Some(c) if c.is_ascii_alphabetic() => match text {
            "hello" => Ok(Message::Hello),
            "bye" => Ok(Message::Bye),
            event => Ok(Message::Event(event.parse()?)),
        },
        _ => state(text),
    }
}

fn state(text: &str) -> Result<Message, WireError> {
    let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|word| !word.is_empty());
    let (mut values, mut count) = ([f64::NAN; 13], 0);
    for word in words {
        let shown = || WireError::NotNumber(word.chars().take(40).flat_map(char::escape_debug).collect());
        let value = word.parse().map_err(|_| shown())?;
        if let Some(place) = values.get_mut(count) {
            *place = value;
        }
        count += 1;
    }
    if ![4, 7, 10, 13].contains(&count) {
        return Err(WireError::Count(count));
    }
    let [t_s, x, y, z, vx, vy, vz, ax, ay, az, jx, jy, jz] = values;
    let known = |least: usize, x: f64, y: f64, z: f64| (count >= least).then(|| Vector3::new(x, y, z));
    let push = Push {
        t_s,
        position_m: Vector3::new(x, y, z),
        velocity_mps: known(7, vx, vy, vz),
        acceleration_mps2: known(10, ax, ay, az),
        jerk_mps3: known(13, jx, jy, jz),
    };
    Ok(Message::Push(push, false))
}

fn sentence(text: &str, start: Epoch) -> Result<Message, WireError> {
    if text.get(3..7) != Some("GGA,") {
        return Err(WireError::Nmea("expected GGA".to_owned()));
    }
    let row = gga(text, start, None).map_err(|fault| WireError::Nmea(fault.to_string()))?;
    let row = row.ok_or_else(|| WireError::Nmea("without a fix".to_owned()))?;
    Ok(Message::Push(Push::at(row.t_s, row.position_m), false))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> Epoch {
        Epoch::parse("2010-07-01T08:06:00").unwrap()
    }

    fn packet(kind: u8, order: Option<u8>, values: &[f64], name: Option<&[u8]>) -> Vec<u8> {
        let mut bytes = vec![kind];
        bytes.extend(order);
        values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        if let Some(name) = name {
            bytes.extend((name.len() as u32).to_le_bytes());
            bytes.extend(name);
        }
        bytes
    }

    #[test]
    fn each_kind_of_datagram_gives_its_vectors_in_their_places() {
        let read = |bytes: Vec<u8>| datagram(&bytes, start()).unwrap();
        let numbers: Vec<f64> = (0..25).map(|k| 1000.0 * f64::from(k) + 500.0).collect();
        let v = |first: usize| Vector3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
        let place = Push::at(0.5, v(1));
        assert_eq!(read(packet(5, None, &numbers[..4], Some(b"car"))), Message::Push(place, false));
        assert_eq!(read(packet(6, None, &numbers[..7], None)), Message::Push(place, true));
        let moving = Push { velocity_mps: Some(v(4)), ..place };
        assert_eq!(read(packet(7, Some(0), &numbers[..7], Some(b""))), Message::Push(moving, false));
        let all = Push { acceleration_mps2: Some(v(7)), jerk_mps3: Some(v(10)), ..moving };
        assert_eq!(read(packet(7, Some(2), &numbers[..13], None)), Message::Push(all, false));
        let turned = Push { velocity_mps: Some(v(7)), acceleration_mps2: Some(v(13)), jerk_mps3: Some(v(19)), ..place };
        assert_eq!(read(packet(8, Some(2), &numbers, Some(b"rocket"))), Message::Push(turned, true));
        assert_eq!((read(vec![1, 9, 9]), read(vec![2])), (Message::Hello, Message::Bye));
    }

    #[test]
    fn every_wrong_length_is_refused_and_no_length_is_believed() {
        for (kind, order, values) in [(5, None, 4), (6, None, 7), (7, Some(1), 10), (8, Some(0), 13)] {
            let whole = packet(kind, order, &vec![1.0; values], Some(b"name"));
            for cut in 0..whole.len() {
                let named = cut == whole.len() - 8;
                assert_eq!(datagram(&whole[..cut], start()).is_ok(), named, "{kind}: {cut} of {}", whole.len());
            }
            let mut lying = packet(kind, order, &vec![1.0; values], Some(b"name"));
            let at = lying.len() - 8;
            lying[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
            assert!(matches!(datagram(&lying, start()), Err(WireError::Length { .. })));
        }
        assert!(matches!(datagram(&packet(7, Some(3), &[1.0; 16], None), start()), Err(WireError::Length { .. })));
        assert_eq!(datagram(&[4, 0], start()), Err(WireError::Unknown(4)));
        assert_eq!(datagram(&[b'1'; 513], start()), Err(WireError::Long));
        assert_eq!(datagram(&[200, 200], start()), Err(WireError::NotText));
    }

    #[test]
    fn lines_give_states_sentences_and_events() {
        let read = |text: &str| line(text, start());
        let place = Push::at(1.5, Vector3::new(1.0, 2.0, 3.0));
        assert_eq!(read("1.5 1 2 3\r\n"), Ok(Message::Push(place, false)));
        let moving = Push { velocity_mps: Some(Vector3::new(4.0, 5.0, 6.0)), ..place };
        assert_eq!(read("1.5,1,2,3, 4,5,6"), Ok(Message::Push(moving, false)));
        assert_eq!(read("1 2 3"), Err(WireError::Count(3)));
        assert_eq!(read(""), Err(WireError::Count(0)));
        assert_eq!(read("1 2 x 4"), Err(WireError::NotNumber("x".to_owned())));
        assert_eq!(read("bye"), Ok(Message::Bye));
        assert!(matches!(read("jammer 1 off"), Ok(Message::Event(_))));
        assert!(matches!(read("$GPRMC,1"), Err(WireError::Nmea(_))));
        // 08:06:00 GPS time is 08:05:45 UTC that day.
        let body = "GPGGA,080550.00,4806.0000,N,01136.0000,E,1,08,1.0,473.0,M,47.0,M,,";
        let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
        let Ok(Message::Push(push, false)) = read(&format!("${body}*{sum:02X}")) else { panic!() };
        assert!((push.t_s - 5.0).abs() < 1e-6, "{push:?}");
        assert!((crate::gnss::earth::Geodetic::from_ecef(&push.position_m).height_m - 520.0).abs() < 1e-6);
        assert!(matches!(read(&format!("${body}*{:02X}", sum ^ 1)), Err(WireError::Nmea(_))));
    }

    #[test]
    fn no_bytes_panic() {
        // xorshift, so that each run is the same.
        let mut state = 88_172_645_463_325_252_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let mut taken = 0;
        for _ in 0..20_000 {
            let mut bytes: Vec<u8> = (0..next() % 240).map(|_| next() as u8).collect();
            if let Some(first) = bytes.first_mut() {
                *first %= 12;
            }
            taken += usize::from(datagram(&bytes, start()).is_ok());
        }
        assert!(taken > 100, "{taken}");
    }
}
