//! A server of rtl_tcp: any program that takes such a dongle takes the twin for one.
//!
//! Source: librtlsdr's rtl_tcp. The server begins with twelve bytes, `RTL0`, the tuner's number and the count
//! of its gains, both as big-endian 32 bits; then come samples of 8 bits, I and Q in turn, zero at 127.5. The
//! client sends commands of five bytes, a number and a big-endian 32-bit value. The scene decides: another
//! rate or frequency is reported and not obeyed, everything else (gains, corrections) is passed over.
//! Limits: 8-bit samples alone. Byte 255 is never sent, since a client's table (GNSS-SDR's) has 255 entries.

use std::collections::BTreeSet;
use std::io::{self, Read};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::Sink;
use super::plain::{Client, PARTING, is_silence};
use crate::cli::error::CliError;
use crate::cli::scenario;
use gnss::samples::{Format, IfMetadata};

/// `RTL0`, tuner 5 (R820T), 29 gains: what such a dongle says of itself.
const GREETING: [u8; 12] = *b"RTL0\0\0\0\x05\0\0\0\x1d";
/// Commands that are looked at.
const SET_FREQUENCY: u8 = 1;
const SET_RATE: u8 = 2;
/// Different requests that are reported; a client that floods is not repeated.
const MOST_REPORTS: usize = 16;
/// Stack of the thread that reads commands.
const STACK_BYTES: usize = 1 << 18;

/// The client, and the thread that reads its commands.
pub(super) struct RtlTcp {
    client: Client,
    stream: IfMetadata,
    packed: Vec<u8>,
    commands: Option<(JoinHandle<()>, Arc<AtomicBool>)>,
}

impl RtlTcp {
    pub fn open(address: SocketAddr, stream: &IfMetadata, returning: bool) -> Result<Self, CliError> {
        if !matches!(stream.format, Format::Ci8 | Format::Cu8) {
            return Err(CliError::usage(format!(
                "rtl-tcp carries complex samples of 8 bits, not {}: use --format cu8",
                stream.format
            )));
        }
        let client = Client::wait(address, "rtl_tcp", returning)?;
        let mut own = Self { client, stream: stream.clone(), packed: Vec::new(), commands: None };
        own.greet().map_err(|error| CliError::output(format!("rtl_tcp client {}", own.client.peer), &error))?;
        Ok(own)
    }

    /// Greets a client and begins to read its commands.
    fn greet(&mut self) -> io::Result<()> {
        let (reader, done) = (Arc::clone(&self.client.stream), Arc::new(AtomicBool::new(false)));
        let ear = Commands { peer: self.client.peer, fixed: Fixed::new(&self.stream), done: Arc::clone(&done) };
        let thread = thread::Builder::new().name("rtl_tcp".to_owned()).stack_size(STACK_BYTES);
        self.commands = Some((thread.spawn(move || ear.read(&reader))?, done));
        self.client.send(&GREETING)
    }

    /// Lets the thread that reads commands end, with the client or soon after that.
    fn hear_no_more(&mut self) -> Option<JoinHandle<()>> {
        let (thread, done) = self.commands.take()?;
        done.store(true, Ordering::Relaxed);
        Some(thread)
    }
}

impl Sink for RtlTcp {
    fn write(&mut self, block: &[u8]) -> io::Result<()> {
        offset_binary(self.stream.format, block, &mut self.packed);
        self.client.send(&self.packed)
    }

    fn is_returning(&self) -> bool {
        self.client.is_returning()
    }

    fn again(&mut self, patience: Duration) -> io::Result<bool> {
        if !self.client.again(patience)? {
            return Ok(false);
        }
        drop(self.hear_no_more());
        self.greet().map(|()| true)
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.client.end()?;
        let _ = self.hear_no_more().map(JoinHandle::join);
        Ok(())
    }
}

/// 8-bit samples with their zero at 127.5, none of them 255. That of `ci8` comes to lie at 127, half a step
/// below: 128 would need 255 for 127.
fn offset_binary(format: Format, block: &[u8], out: &mut Vec<u8>) {
    out.clear();
    match format {
        Format::Cu8 => out.extend(block.iter().map(|byte| (*byte).min(254))),
        _ => out.extend(block.iter().map(|byte| (*byte as i8).max(-127).wrapping_add(127) as u8)),
    }
}

/// Values that a client cannot change, in its own units: whole hertz.
struct Fixed {
    rate_hz: f64,
    center_hz: f64,
    reported: BTreeSet<(u8, u32)>,
}

impl Fixed {
    fn new(stream: &IfMetadata) -> Self {
        Self { rate_hz: stream.rate.hz(), center_hz: stream.center_hz, reported: BTreeSet::new() }
    }

    /// Report on a command, if it contradicts the stream.
    fn contradicted(&mut self, command: u8, value: u32) -> Option<String> {
        let (what, own) = match command {
            SET_FREQUENCY => ("centre frequency", self.center_hz),
            SET_RATE => ("rate", self.rate_hz),
            _ => return None,
        };
        if (f64::from(value) - own).abs() <= 1.0 || self.reported.len() > MOST_REPORTS {
            return None;
        }
        if !self.reported.insert((command, value)) {
            return None;
        }
        if self.reported.len() > MOST_REPORTS {
            return Some("asks for yet other rates and frequencies; that is not reported any more".to_owned());
        }
        Some(format!("asks for a {what} of {value} Hz: the scene's {own} Hz stays"))
    }
}

/// Reads a client's commands.
struct Commands {
    peer: SocketAddr,
    fixed: Fixed,
    done: Arc<AtomicBool>,
}

impl Commands {
    /// Reads commands until the client closes its side, or for a while after the stream has ended.
    fn read(mut self, mut stream: &TcpStream) {
        let (mut words, mut have) = ([0_u8; 5], 0);
        let mut parting: Option<Instant> = None;
        loop {
            if self.done.load(Ordering::Relaxed) && parting.get_or_insert_with(Instant::now).elapsed() > PARTING {
                return;
            }
            match stream.read(words.get_mut(have..).unwrap_or_default()) {
                Ok(0) => return,
                Ok(count) => have += count,
                Err(error) if is_silence(&error) => {}
                Err(_) => return,
            }
            let [command, value @ ..] = words;
            if have < words.len() {
                continue;
            }
            have = 0;
            if let Some(report) = self.fixed.contradicted(command, u32::from_be_bytes(value)) {
                scenario::warn(&format!("the rtl_tcp client {} {report}", self.peer));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::time::Rate;

    #[test]
    fn samples_lie_around_127_5_and_255_never_comes() {
        let mut out = Vec::new();
        let all: Vec<u8> = (0..=255).collect();
        offset_binary(Format::Ci8, &all, &mut out);
        let of = |value: i8| out[usize::from(value as u8)];
        assert_eq!([of(-128), of(-127), of(-1), of(0), of(1), of(127)], [0, 0, 126, 127, 128, 254]);
        assert!(!out.contains(&255));
        offset_binary(Format::Cu8, &all, &mut out);
        assert_eq!((&out[..255], out[255]), (&all[..255], 254));
    }

    #[test]
    fn a_contradicting_rate_or_frequency_is_reported_once_and_a_flood_of_them_a_few_times() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        let stream = IfMetadata { format: Format::Cu8, rate, center_hz: 1575.42e6, inverted: false, start: None };
        let mut fixed = Fixed::new(&stream);
        assert_eq!(fixed.contradicted(SET_FREQUENCY, 1_575_420_000), None);
        assert_eq!(fixed.contradicted(SET_RATE, 2_600_000), None);
        assert_eq!(fixed.contradicted(4, 7), None);
        let report = fixed.contradicted(SET_RATE, 2_048_000).unwrap();
        assert!(report.contains("2048000") && report.contains("2600000"), "{report}");
        assert_eq!(fixed.contradicted(SET_RATE, 2_048_000), None);
        let reports = (0..10_000).filter(|hz| fixed.contradicted(SET_FREQUENCY, *hz).is_some()).count();
        assert_eq!(reports, MOST_REPORTS);
    }
}
