//! Motion and events on their way in: a UDP socket, a TCP listener or standard input, on a thread of its own.
//!
//! What arrives is data from outside: lengths are bounded before anything is read of them, and nothing is
//! reserved by their word. One sender is heard at a time ([`Peers`]); others are ignored and named.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use super::account::Intake;
use super::peers::{Heard, Peers};
use crate::cli::address::{RETRY, accept, listen, listen_address};
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
                    if inside.intake.dropped == 0 {
                        scenario::warn(&format!(
                            "motion: over {MOST_WAITING} messages within a tick: older ones are dropped, counted"
                        ));
                    }
                    inside.intake.dropped += 1;
                }
                inside.messages.push_back((Instant::now(), message));
            }
        }
    }

    /// True if something counts, by the answer to it. The end of a sender that was silent is put in.
    fn admits(&self, heard: Heard) -> bool {
        match heard {
            Heard::Same | Heard::First => {}
            Heard::Instead => self.end(),
            Heard::Ignored => {
                let mut inside = self.inside();
                inside.intake.messages += 1;
                inside.intake.strangers += 1;
            }
        }
        heard != Heard::Ignored
    }

    /// A sender ended without a word.
    fn end(&self) {
        let mut inside = self.inside();
        if inside.messages.len() < MOST_WAITING {
            inside.messages.push_back((Instant::now(), Message::Bye));
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
        Origin::Stdin => Box::new(move || lines(io::stdin().lock(), &own, &reader, || Heard::Same)),
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
    let mut peers = Peers::default();
    loop {
        let Ok((length, sender)) = socket.recv_from(&mut buffer) else {
            thread::sleep(RETRY);
            continue;
        };
        let heard = peers.hear(sender, Instant::now());
        if !inbox.admits(heard) {
            continue;
        }
        if heard != Heard::Same {
            reader = fresh.clone();
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
                peers.leave(sender);
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

/// Takes clients, each on a thread of its own, so that one that is silent holds up no other.
fn clients(listener: &TcpListener, inbox: &Arc<Inbox>, fresh: &Reader) {
    let peers = Arc::new(Mutex::new(Peers::default()));
    loop {
        let (client, peer) = accept(listener, "motion");
        let client = Arc::new(client);
        locked(&peers).enter(peer, Arc::clone(&client), Instant::now());
        let (own, inbox, fresh) = (Arc::clone(&peers), Arc::clone(inbox), fresh.clone());
        let work = move || {
            let hear = || locked(&own).hear(peer, Instant::now());
            lines(BufReader::with_capacity(4096, &*client), &inbox, &fresh, hear);
            if locked(&own).leave(peer) {
                inbox.end();
            }
        };
        let thread = thread::Builder::new().name("motion client".to_owned()).stack_size(STACK_BYTES).spawn(work);
        if let Err(error) = thread {
            scenario::warn(&format!("motion: client {peer} is disconnected: cannot start a thread: {error}"));
            locked(&peers).leave(peer);
            thread::sleep(RETRY);
        }
    }
}

fn locked(peers: &Mutex<Peers>) -> MutexGuard<'_, Peers> {
    peers.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes lines to the end of the input, those that `hear` admits; what is beyond the longest line is passed
/// over to the next.
fn lines(mut input: impl BufRead, inbox: &Inbox, fresh: &Reader, mut hear: impl FnMut() -> Heard) {
    let mut reader = fresh.clone();
    let mut line = Vec::with_capacity(MOST_BYTES + 1);
    loop {
        line.clear();
        match input.by_ref().take(MOST_BYTES as u64 + 1).read_until(b'\n', &mut line) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        if line.trim_ascii().is_empty() {
            continue;
        }
        let heard = hear();
        let counts = inbox.admits(heard);
        if matches!(heard, Heard::First | Heard::Instead) {
            reader = fresh.clone();
        }
        if line.len() > MOST_BYTES && !line.ends_with(b"\n") {
            if counts {
                inbox.take(&line, Err(WireError::Long));
            }
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
        if counts {
            let text = std::str::from_utf8(&line).map_err(|_| WireError::NotText);
            inbox.take(&line, text.and_then(|text| reader.line(text.trim())));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::TcpStream;

    use super::super::peers::SILENCE;
    use super::*;
    use gnss::time::Epoch;

    #[test]
    fn lines_of_any_length_are_bounded_and_the_next_one_counts() {
        let inbox = Inbox::default();
        let mut text = vec![b'x'; 5000];
        text.extend_from_slice(b"\n1 2 3 4\n\nhello\nnonsense 1\n\xff\xfe\n5 6 7 8");
        lines(text.as_slice(), &inbox, &Reader::new(Epoch::new(0, 0.0), 0.0), || Heard::Same);
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

    /// All messages, once there are so many.
    fn at_least(inbox: &Inbox, count: usize) -> Vec<Message> {
        let (mut all, mut messages) = (Vec::new(), Vec::new());
        while all.len() < count {
            inbox.drain(&mut messages);
            all.extend(messages.iter().map(|(_, message)| *message));
            thread::yield_now();
        }
        all
    }

    #[test]
    fn a_rig_that_restarts_with_another_port_is_heard_after_the_silence_of_the_first() {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let (address, inbox) = (socket.local_addr().unwrap(), Arc::new(Inbox::default()));
        let own = Arc::clone(&inbox);
        thread::spawn(move || datagrams(&socket, &own, &Reader::new(Epoch::new(0, 0.0), 0.0)));
        let [first, second] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
        first.send_to(b"1 2 3 4", address).unwrap();
        at_least(&inbox, 1);
        second.send_to(b"2 2 3 4", address).unwrap();
        // Longer than the silence by a tenth of a second, which it takes at most to be scheduled.
        thread::sleep(SILENCE + RETRY);
        second.send_to(b"3 2 3 4", address).unwrap();
        let came = at_least(&inbox, 2);
        assert!(matches!(came.as_slice(), [Message::Bye, Message::Push(push)] if push.t_s == 3.0), "{came:?}");
        assert_eq!(inbox.drain(&mut Vec::new()).strangers, 1);
    }

    #[test]
    fn clients_that_are_silent_hold_up_none_that_sends_however_many_they_are() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (address, inbox) = (listener.local_addr().unwrap(), Arc::new(Inbox::default()));
        let own = Arc::clone(&inbox);
        thread::spawn(move || clients(&listener, &own, &Reader::new(Epoch::new(0, 0.0), 0.0)));
        let silent: Vec<_> = (0..40).map(|_| TcpStream::connect(address).unwrap()).collect();
        let mut rig = TcpStream::connect(address).unwrap();
        rig.write_all(b"1 2 3 4\n").unwrap();
        assert!(matches!(at_least(&inbox, 1).as_slice(), [Message::Push(push)] if push.t_s == 1.0));
        // What another one sends is ignored and counted, until the rig leaves.
        let mut other = TcpStream::connect(address).unwrap();
        other.write_all(b"2 2 3 4\n").unwrap();
        while inbox.drain(&mut Vec::new()).strangers == 0 {
            thread::yield_now();
        }
        drop(rig);
        assert_eq!(at_least(&inbox, 1), [Message::Bye]);
        other.write_all(b"3 2 3 4\n").unwrap();
        assert!(matches!(at_least(&inbox, 1).as_slice(), [Message::Push(push)] if push.t_s == 3.0));
        drop(silent);
    }

    #[test]
    fn a_flood_keeps_the_newest() {
        let inbox = Inbox::default();
        let text: String = (0..10_000).map(|k| format!("{k} 0 0 0\n")).collect();
        lines(text.as_bytes(), &inbox, &Reader::new(Epoch::new(0, 0.0), 0.0), || Heard::Same);
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
