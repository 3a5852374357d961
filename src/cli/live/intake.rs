//! Motion and events on their way in: a UDP socket, a TCP listener or standard input, on a thread of its own.
//!
//! What arrives is data from outside: lengths are bounded before anything is read of them, and nothing is
//! reserved by their word. Of UDP the first sender counts until it says goodbye; of TCP one client at a time.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use super::account::Intake;
use crate::cli::address::{listen, listen_address};
use crate::cli::error::CliError;
use crate::cli::scenario;
use live::wire::{MOST_BYTES, MOST_DATAGRAM_BYTES, Message, Reader, WireError, pieces};

/// Messages that wait for the next tick at most; older ones give way.
const MOST_WAITING: usize = 4096;
/// Bytes that are shown of a message that is none.
const SHOWN_BYTES: usize = 82;
/// Stack of the thread.
const STACK_BYTES: usize = 1 << 18;

/// Origin of the motion on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    Stdin,
    Udp(SocketAddr),
    Tcp(SocketAddr),
}

impl FromStr for Origin {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            _ if text == "-" => Ok(Self::Stdin),
            Some(("udp", address)) => listen_address(address).map(Self::Udp),
            Some(("tcp", address)) => listen_address(address).map(Self::Tcp),
            _ => Err(format!("'{text}': expected udp:ADDR, tcp:ADDR or -")),
        }
    }
}

/// Messages that came and were not yet used.
#[derive(Default)]
pub struct Inbox {
    inside: Mutex<Inside>,
}

#[derive(Default)]
struct Inside {
    messages: VecDeque<(Instant, Message)>,
    intake: Intake,
}

impl Inbox {
    fn inside(&self) -> MutexGuard<'_, Inside> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Everything that came since the last call, and the counts so far.
    pub fn drain(&self, messages: &mut Vec<(Instant, Message)>) -> Intake {
        let mut inside = self.inside();
        messages.clear();
        messages.extend(inside.messages.drain(..));
        inside.intake.clone()
    }

    /// Takes what came in some bytes, or why it is no message; the first of these goes to the screen.
    fn take(&self, bytes: &[u8], came: Result<Message, WireError>) {
        let mut inside = self.inside();
        inside.intake.messages += 1;
        match came {
            Err(error) => {
                inside.intake.malformed += 1;
                if inside.intake.first_malformed.is_none() {
                    let what = format!("'{}': {error}", shown(bytes));
                    scenario::warn(&format!("motion: the first message that is none: {what}"));
                    inside.intake.first_malformed = Some(what);
                }
            }
            Ok(message) => {
                if inside.messages.len() >= MOST_WAITING {
                    inside.messages.pop_front();
                    inside.intake.dropped += 1;
                }
                inside.messages.push_back((Instant::now(), message));
            }
        }
    }
}

/// Begins to listen; every sender has a `reader` of its own.
///
/// # Errors
/// An address that cannot be listened on, a thread that cannot be started.
pub fn begin(origin: Origin, reader: Reader) -> Result<Arc<Inbox>, CliError> {
    let inbox = Arc::new(Inbox::default());
    let own = Arc::clone(&inbox);
    let work: Box<dyn FnOnce() + Send> = match origin {
        Origin::Stdin => Box::new(move || lines(io::stdin().lock(), &own, reader)),
        Origin::Tcp(address) => {
            let (listener, _) = listen(address, "motion")?;
            Box::new(move || clients(&listener, &own, &reader))
        }
        Origin::Udp(address) => {
            let fail = |error| CliError::refused_output(format!("cannot listen on udp:{address}: {error}"));
            let socket = UdpSocket::bind(address).map_err(fail)?;
            let bound = socket.local_addr().map_err(fail)?;
            if !bound.ip().is_loopback() {
                scenario::warn(&format!("motion: whoever reaches udp:{bound} can move the vehicle"));
            }
            scenario::note(&format!("motion: listening on udp:{bound}"));
            Box::new(move || datagrams(&socket, &own, &reader))
        }
    };
    let thread = thread::Builder::new().name("motion".to_owned()).stack_size(STACK_BYTES).spawn(work);
    thread.map_err(|error| CliError::passing(format!("cannot start a thread: {error}")))?;
    Ok(inbox)
}

fn datagrams(socket: &UdpSocket, inbox: &Inbox, fresh: &Reader) {
    let mut reader = fresh.clone();
    let mut buffer = [0; MOST_DATAGRAM_BYTES + 1];
    let mut known: Option<SocketAddr> = None;
    loop {
        // A failed receive is one of an earlier answer on this socket; there are none.
        let Ok((length, sender)) = socket.recv_from(&mut buffer) else { continue };
        if *known.get_or_insert(sender) != sender {
            let mut inside = inbox.inside();
            inside.intake.messages += 1;
            inside.intake.strangers += 1;
            continue;
        }
        let bytes = buffer.get(..length).unwrap_or_default();
        if length > MOST_DATAGRAM_BYTES {
            inbox.take(bytes, Err(WireError::Long));
            continue;
        }
        for piece in pieces(bytes) {
            let came = reader.datagram(piece);
            let ends = came == Ok(Message::Bye);
            inbox.take(piece, came);
            if ends {
                (known, reader) = (None, fresh.clone());
                break;
            }
        }
    }
}

/// The beginning of some bytes as text; what does not print is escaped.
fn shown(bytes: &[u8]) -> String {
    let line = bytes.trim_ascii();
    let begun = line.get(..SHOWN_BYTES).unwrap_or(line).escape_ascii().to_string();
    if line.len() > SHOWN_BYTES { begun + "…" } else { begun }
}

fn clients(listener: &TcpListener, inbox: &Inbox, fresh: &Reader) {
    loop {
        if let Ok((client, _)) = listener.accept() {
            lines(BufReader::with_capacity(4096, client), inbox, fresh.clone());
        }
    }
}

/// Takes lines to the end of the input; what is beyond the longest line is passed over to the next.
fn lines(mut input: impl BufRead, inbox: &Inbox, mut reader: Reader) {
    let mut line = Vec::with_capacity(MOST_BYTES + 1);
    loop {
        line.clear();
        match input.by_ref().take(MOST_BYTES as u64 + 1).read_until(b'\n', &mut line) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        if line.len() > MOST_BYTES && !line.ends_with(b"\n") {
            inbox.take(&line, Err(WireError::Long));
            loop {
                line.clear();
                match input.by_ref().take(MOST_BYTES as u64).read_until(b'\n', &mut line) {
                    Ok(0) | Err(_) => return,
                    Ok(_) if line.ends_with(b"\n") => break,
                    Ok(_) => {}
                }
            }
            continue;
        }
        let text = std::str::from_utf8(&line).map(str::trim);
        if text == Ok("") {
            continue;
        }
        inbox.take(&line, text.map_err(|_| WireError::NotText).and_then(|text| reader.line(text)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::time::Epoch;

    #[test]
    fn lines_of_any_length_are_bounded_and_the_next_one_counts() {
        let inbox = Inbox::default();
        let mut text = vec![b'x'; 5000];
        text.extend_from_slice(b"\n1 2 3 4\n\nhello\nnonsense 1\n\xff\xfe\n5 6 7 8");
        lines(text.as_slice(), &inbox, Reader::new(Epoch::new(0, 0.0), 0.0));
        let mut messages = Vec::new();
        let intake = inbox.drain(&mut messages);
        assert_eq!((intake.messages, intake.malformed), (6, 3));
        assert!(matches!(
            messages.as_slice(),
            [(_, Message::Push(..)), (_, Message::Hello), (_, Message::Push(last))] if last.t_s == 5.0
        ));
    }

    #[test]
    fn a_datagram_of_two_sentences_is_two_messages_and_the_first_that_is_none_is_quoted() {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let (address, inbox) = (socket.local_addr().unwrap(), Arc::new(Inbox::default()));
        let own = Arc::clone(&inbox);
        let reader = Reader::new(Epoch::parse("2010-07-01T08:06:00").unwrap(), 0.0);
        thread::spawn(move || datagrams(&socket, &own, &reader));
        let sentence = |body: &str| format!("${body}*{:02X}\r\n", body.bytes().fold(0, |sum, byte| sum ^ byte));
        let rmc = sentence("GPRMC,080550.00,A,4806.0000,N,01136.0000,E,10.0,60.0,010710,,");
        let gga = sentence("GPGGA,080550.00,4806.0000,N,01136.0000,E,1,08,1.0,473.0,M,47.0,M,,");
        let other = UdpSocket::bind("127.0.0.1:0").unwrap();
        for text in [rmc + &gga, "1 2\u{7}\n9 8 x 7".to_owned(), "5 6 7 8\nbye".to_owned()] {
            other.send_to(text.as_bytes(), address).unwrap();
        }
        let (mut all, mut messages) = (Vec::new(), Vec::new());
        let intake = loop {
            let intake = inbox.drain(&mut messages);
            all.append(&mut messages);
            if all.iter().any(|(_, message)| *message == Message::Bye) {
                break intake;
            }
            thread::yield_now();
        };
        assert_eq!((intake.messages, intake.malformed, all.len()), (6, 2, 4));
        let quoted = intake.first_malformed.unwrap();
        assert!(quoted.starts_with(r"'1 2\x07': ") && quoted.contains("expected"), "{quoted}");
    }

    #[test]
    fn a_flood_keeps_the_newest() {
        let inbox = Inbox::default();
        let text: String = (0..10_000).map(|k| format!("{k} 0 0 0\n")).collect();
        lines(text.as_bytes(), &inbox, Reader::new(Epoch::new(0, 0.0), 0.0));
        let mut messages = Vec::new();
        assert_eq!(inbox.drain(&mut messages).dropped, 10_000 - MOST_WAITING as u64);
        assert!(matches!(messages.last(), Some((_, Message::Push(last))) if last.t_s == 9999.0));
    }

    #[test]
    fn an_origin_reads_as_documented() {
        assert_eq!("-".parse(), Ok(Origin::Stdin));
        assert_eq!("udp:4567".parse(), Ok(Origin::Udp("127.0.0.1:4567".parse().unwrap())));
        assert_eq!("tcp:0.0.0.0:9".parse(), Ok(Origin::Tcp("0.0.0.0:9".parse().unwrap())));
        for text in ["", "udp:", "tcp:host:1", "file:x"] {
            assert!(text.parse::<Origin>().unwrap_err().contains("expected"), "{text}");
        }
    }
}
