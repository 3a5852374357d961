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
use crate::live::wire::{MOST_BYTES, Message, Reader, WireError};

/// Messages that wait for the next tick at most; older ones give way.
const MOST_WAITING: usize = 4096;
/// Stack of the thread.
const STACK_BYTES: usize = 1 << 18;

/// Where motion comes from, as the command line names it.
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
        inside.intake
    }

    /// Takes what came, or why it is no message.
    fn take<E>(&self, came: Result<Message, E>) {
        let mut inside = self.inside();
        inside.intake.messages += 1;
        match came {
            Err(_) => inside.intake.malformed += 1,
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
    let mut buffer = [0; MOST_BYTES + 1];
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
        let came = reader.datagram(buffer.get(..length).unwrap_or_default());
        if came == Ok(Message::Bye) {
            (known, reader) = (None, fresh.clone());
        }
        inbox.take(came);
    }
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
            inbox.take(Err(WireError::Long));
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
        inbox.take(text.map_err(|_| WireError::NotText).and_then(|text| reader.line(text)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::time::Epoch;

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
