//! Motion and events as they come in: datagrams of Skydel's hardware-in-the-loop layout, lines of text, NMEA.
//!
//! A datagram that begins with 1 to 8 is binary, little-endian, by its first byte: 1 hello, 2 bye, 3 a
//! request (passed over), 5 a position, 6 with attitude, 7 and 8 the same with a byte for the derivatives
//! that follow (0 velocity, 1 and acceleration, 2 and jerk). Then the time in milliseconds since the start,
//! the position and its derivatives, ECEF in metres, each with its angles' in 6 and 8; at the end a name, a
//! 32-bit length before it. Angles are yaw, pitch and roll of nose, right and down against north, east and
//! down, in radians, and their derivatives in 8. Everything else is lines, one or more: `t x y z` with
//! velocity, acceleration and jerk where known (seconds, metres, ECEF) and `ypr` with the angles and their
//! rates where known, a sentence of NMEA (`nmea`), or an event. Limits: the order of angles in 8 is as its
//! vendor's clients send it, by description and not seen on a wire; of their derivatives the first is used.

mod nmea;

use nalgebra::Vector3;
use thiserror::Error;

use generator::event::{Event, EventError};
use generator::vehicle::joining::Push;
use generator::vehicle::turn::PushedTurn;
use gnss::time::Epoch;

/// Bytes of a binary message or a line at most.
pub const MOST_BYTES: usize = 512;
/// Bytes of a datagram at most: what an epoch of NMEA fills, and more than a frame of Ethernet holds.
pub const MOST_DATAGRAM_BYTES: usize = 4096;

/// The word before angles.
const TURNED: &str = "ypr";

/// Something that came in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// A state.
    Push(Push),
    /// Half of a state, whose other half another sentence brings.
    Half,
    /// Something to switch.
    Event(Event),
    /// A sender says that it begins, or asks something.
    Hello,
    /// A sender says that it ends.
    Bye,
}

/// Reason why bytes are not a message.
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
    /// Wrong number of angles after their word.
    #[error("{TURNED} and {0} numbers: expected yaw, pitch and roll in radians, then their rates where known: 3 or 6")]
    Angles(usize),
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

/// Reads what one sender sends.
#[derive(Clone, Debug)]
pub struct Reader {
    nmea: nmea::Reader,
}

impl Reader {
    /// A reader of states of a scene that starts at `start`, which completes times of day. The height is
    /// `height_m` metres until a state brings one.
    pub fn new(start: Epoch, height_m: f64) -> Self {
        Self { nmea: nmea::Reader::new(start, height_m) }
    }

    /// Reads a message of a datagram, one of its [`pieces`].
    ///
    /// # Errors
    /// A description of the fault.
    pub fn datagram(&mut self, bytes: &[u8]) -> Result<Message, WireError> {
        if bytes.len() > MOST_BYTES {
            return Err(WireError::Long);
        }
        match bytes.split_first() {
            Some((kind, rest)) if (1..=8).contains(kind) => binary(*kind, rest),
            _ => self.line(std::str::from_utf8(bytes).map_err(|_| WireError::NotText)?),
        }
    }

    /// Reads a line of text.
    ///
    /// # Errors
    /// A description of the fault.
    pub fn line(&mut self, text: &str) -> Result<Message, WireError> {
        if text.len() > MOST_BYTES {
            return Err(WireError::Long);
        }
        let text = text.trim();
        match text.chars().next() {
            Some('$') => self.nmea.sentence(text),
            Some(c) if c.is_ascii_alphabetic() => match text {
                "hello" => Ok(Message::Hello),
                "bye" => Ok(Message::Bye),
                event => Ok(Message::Event(event.parse()?)),
            },
            _ => state(text),
        }
    }
}

/// The messages of a datagram: itself where it is binary, else its lines but for blank ones, of which it has
/// one where it is empty.
pub fn pieces(datagram: &[u8]) -> impl Iterator<Item = &[u8]> {
    let is_binary = datagram.first().is_some_and(|kind| (1..=8).contains(kind));
    let ends = move |byte: &u8| !is_binary && (*byte == b'\n' || *byte == b'\r');
    let is_blank = |line: &[u8]| line.iter().all(u8::is_ascii_whitespace);
    let nothing = is_blank(datagram);
    datagram.split(ends).filter(move |line| nothing || !is_blank(line)).take(if nothing { 1 } else { usize::MAX })
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
    let mut three = || [(); 3].map(|()| values.next().unwrap_or(f64::NAN));
    let mut vector = || (Vector3::from(three()), attitude.then(&mut three));
    let (position_m, angles) = vector();
    let mut next = |order: usize| (derivatives >= order).then(&mut vector).unzip();
    let ((velocity_mps, rates), (acceleration_mps2, _), (jerk_mps3, _)) = (next(1), next(2), next(3));
    let turn = angles.map(|angles_rad| PushedTurn { angles_rad, rates_radps: rates.flatten() });
    Ok(Message::Push(Push { t_s, position_m, velocity_mps, acceleration_mps2, jerk_mps3, turn }))
}

fn state(text: &str) -> Result<Message, WireError> {
    let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|word| !word.is_empty());
    let (mut values, mut count, mut turned) = ([f64::NAN; 13], 0, None);
    let (mut angles, mut turns) = ([f64::NAN; 6], 0);
    for word in words {
        if word == TURNED && turned.is_none() {
            turned = Some(());
            continue;
        }
        let shown = || WireError::NotNumber(word.chars().take(40).flat_map(char::escape_debug).collect());
        let value = word.parse().map_err(|_| shown())?;
        let (all, number): (&mut [f64], _) =
            if turned.is_some() { (&mut angles, &mut turns) } else { (&mut values, &mut count) };
        if let Some(place) = all.get_mut(*number) {
            *place = value;
        }
        *number += 1;
    }
    if ![4, 7, 10, 13].contains(&count) {
        return Err(WireError::Count(count));
    }
    if turned.is_some() && ![3, 6].contains(&turns) {
        return Err(WireError::Angles(turns));
    }
    let [t_s, x, y, z, vx, vy, vz, ax, ay, az, jx, jy, jz] = values;
    let [yaw, pitch, roll, yaw_radps, pitch_radps, roll_radps] = angles;
    let known = |least: usize, x: f64, y: f64, z: f64| (count >= least).then(|| Vector3::new(x, y, z));
    Ok(Message::Push(Push {
        t_s,
        position_m: Vector3::new(x, y, z),
        velocity_mps: known(7, vx, vy, vz),
        acceleration_mps2: known(10, ax, ay, az),
        jerk_mps3: known(13, jx, jy, jz),
        turn: turned.map(|()| PushedTurn {
            angles_rad: [yaw, pitch, roll],
            rates_radps: (turns == 6).then_some([yaw_radps, pitch_radps, roll_radps]),
        }),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> Epoch {
        Epoch::parse("2010-07-01T08:06:00").unwrap()
    }

    fn datagram(bytes: &[u8]) -> Result<Message, WireError> {
        Reader::new(start(), 0.0).datagram(bytes)
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
        let read = |bytes: Vec<u8>| datagram(&bytes).unwrap();
        let numbers: Vec<f64> = (0..25).map(|k| 1000.0 * f64::from(k) + 500.0).collect();
        let v = |first: usize| Vector3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
        let three = |first: usize| [numbers[first], numbers[first + 1], numbers[first + 2]];
        let turned_by = |angles: usize, rates: Option<usize>| {
            Some(PushedTurn { angles_rad: three(angles), rates_radps: rates.map(three) })
        };
        let place = Push::at(0.5, v(1));
        assert_eq!(read(packet(5, None, &numbers[..4], Some(b"car"))), Message::Push(place));
        assert_eq!(
            read(packet(6, None, &numbers[..7], None)),
            Message::Push(Push { turn: turned_by(4, None), ..place })
        );
        let moving = Push { velocity_mps: Some(v(4)), ..place };
        assert_eq!(read(packet(7, Some(0), &numbers[..7], Some(b""))), Message::Push(moving));
        let all = Push { acceleration_mps2: Some(v(7)), jerk_mps3: Some(v(10)), ..moving };
        assert_eq!(read(packet(7, Some(2), &numbers[..13], None)), Message::Push(all));
        let turn = turned_by(4, Some(10));
        let rates = (Some(v(7)), Some(v(13)), Some(v(19)));
        let turned = Push { velocity_mps: rates.0, acceleration_mps2: rates.1, jerk_mps3: rates.2, turn, ..place };
        assert_eq!(read(packet(8, Some(2), &numbers, Some(b"rocket"))), Message::Push(turned));
        assert_eq!((read(vec![1, 9, 9]), read(vec![2])), (Message::Hello, Message::Bye));
    }

    #[test]
    fn every_wrong_length_is_refused_and_no_length_is_believed() {
        for (kind, order, values) in [(5, None, 4), (6, None, 7), (7, Some(1), 10), (8, Some(0), 13)] {
            let whole = packet(kind, order, &vec![1.0; values], Some(b"name"));
            for cut in 0..whole.len() {
                let named = cut == whole.len() - 8;
                assert_eq!(datagram(&whole[..cut]).is_ok(), named, "{kind}: {cut} of {}", whole.len());
            }
            let mut lying = packet(kind, order, &vec![1.0; values], Some(b"name"));
            let at = lying.len() - 8;
            lying[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
            assert!(matches!(datagram(&lying), Err(WireError::Length { .. })));
        }
        assert!(matches!(datagram(&packet(7, Some(3), &[1.0; 16], None)), Err(WireError::Length { .. })));
        assert_eq!(datagram(&[4, 0]), Err(WireError::Unknown(4)));
        assert_eq!(datagram(&[b'1'; 513]), Err(WireError::Long));
        assert_eq!(datagram(&[200, 200]), Err(WireError::NotText));
    }

    #[test]
    fn lines_give_states_sentences_and_events() {
        let read = |text: &str| Reader::new(start(), 0.0).line(text);
        let place = Push::at(1.5, Vector3::new(1.0, 2.0, 3.0));
        assert_eq!(read("1.5 1 2 3\r\n"), Ok(Message::Push(place)));
        let moving = Push { velocity_mps: Some(Vector3::new(4.0, 5.0, 6.0)), ..place };
        assert_eq!(read("1.5,1,2,3, 4,5,6"), Ok(Message::Push(moving)));
        let turn = PushedTurn { angles_rad: [0.1, 0.2, 0.3], rates_radps: None };
        assert_eq!(read("1.5 1 2 3 ypr 0.1 0.2 0.3"), Ok(Message::Push(Push { turn: Some(turn), ..place })));
        let turn = Some(PushedTurn { rates_radps: Some([4.0, 5.0, 6.0]), ..turn });
        let both = Push { turn, ..moving };
        assert_eq!(read("1.5 1 2 3 4 5 6 ypr 0.1 0.2 0.3 4 5 6"), Ok(Message::Push(both)));
        assert_eq!(read("1.5 1 2 3 ypr 0.1 0.2"), Err(WireError::Angles(2)));
        assert_eq!(read("1.5 1 2 3 ypr ypr 1 2 3"), Err(WireError::NotNumber("ypr".to_owned())));
        assert_eq!(read("1 2 3"), Err(WireError::Count(3)));
        assert_eq!(read(""), Err(WireError::Count(0)));
        assert_eq!(read("1 2 x 4"), Err(WireError::NotNumber("x".to_owned())));
        assert_eq!(read("bye"), Ok(Message::Bye));
        assert!(matches!(read("jammer 1 off"), Ok(Message::Event(_))));
        assert!(matches!(read("$GPRMC,1"), Err(WireError::Nmea(_))));
        // 08:06:00 GPS time is 08:05:45 UTC that day.
        let body = "GPGGA,080550.00,4806.0000,N,01136.0000,E,1,08,1.0,473.0,M,47.0,M,,";
        let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
        let Ok(Message::Push(push)) = read(&format!("${body}*{sum:02X}")) else { panic!() };
        assert!((push.t_s - 5.0).abs() < 1e-6, "{push:?}");
        assert!((gnss::earth::Geodetic::from_ecef(&push.position_m).height_m - 520.0).abs() < 1e-6);
        assert!(matches!(read(&format!("${body}*{:02X}", sum ^ 1)), Err(WireError::Nmea(_))));
    }

    #[test]
    fn a_datagram_of_lines_is_one_message_a_line_and_a_binary_one_is_whole() {
        let lines = |bytes: &'static [u8]| pieces(bytes).collect::<Vec<_>>();
        assert_eq!(lines(b"$GPRMC,1\r\n$GPGGA,2\r\n"), [&b"$GPRMC,1"[..], b"$GPGGA,2"]);
        assert_eq!(lines(b"1 2 3 4\n\n5 6 7 8"), [&b"1 2 3 4"[..], b"5 6 7 8"]);
        assert_eq!((lines(b"bye"), lines(b""), lines(b"\r\n")), (vec![&b"bye"[..]], vec![&b""[..]], vec![&b""[..]]));
        // 10 and 13 are bytes of numbers there.
        let binary = packet(5, None, &[10.0, 13.0, 1.0, 2.0], Some(b"\n\r"));
        assert_eq!(pieces(&binary).collect::<Vec<_>>(), [binary.as_slice()]);
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
            taken += usize::from(datagram(&bytes).is_ok());
        }
        assert!(taken > 100, "{taken}");
    }
}
