//! Outputs of text lines while a receiver runs: standard output, a file, a FIFO, TCP clients.
//!
//! A TCP client gets the lines written after its connection. One that does not take its lines in time is
//! disconnected, so that no client delays the receiver.

use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use crate::cli::address::{accept, listen, listen_address, path};
use crate::cli::error::{CliError, shown};
use crate::cli::scenario;
use crate::cli::staging::{InSight, Staging};

/// An output of lines as the command line names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Spec {
    /// `-`.
    Stdout,
    /// `tcp:ADDR`: a listener.
    Tcp(SocketAddr),
    /// `fifo:PATH`: a FIFO that is there.
    Fifo(PathBuf),
    /// `file:PATH`, or a path.
    File(PathBuf),
}

impl FromStr for Spec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            _ if text == "-" => Ok(Self::Stdout),
            Some(("tcp", rest)) => listen_address(rest).map(Self::Tcp),
            Some(("fifo", rest)) => path(rest).map(Self::Fifo),
            Some(("file", rest)) => path(rest).map(Self::File),
            _ => path(text).map(Self::File),
        }
    }
}

/// Form of the specification on the command line.
impl fmt::Display for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stdout => f.write_str("standard output"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Fifo(path) | Self::File(path) => f.write_str(&shown(path)),
        }
    }
}

/// An open output: what takes the lines, and what becomes of it at the end.
pub struct Lines {
    pub writer: Box<dyn Write>,
    pub made: Made,
}

/// Final form of an output.
pub enum Made {
    /// Nothing more.
    Nothing,
    /// A file that gets its name then.
    Staged(Staging),
    /// A file that could be read meanwhile, and gets its name then.
    InSight(InSight),
}

impl Made {
    /// Gives a file its name.
    pub fn commit(self) -> Result<(), CliError> {
        match self {
            Self::Nothing => Ok(()),
            Self::Staged(staging) => staging.commit(),
            Self::InSight(file) => file.commit(),
        }
    }
}

impl Spec {
    /// Opens it; a file of a live reception can be read while it grows.
    ///
    /// # Errors
    /// A file that cannot be made, or an address that cannot be listened on.
    pub fn open(&self, what: &str, live: bool) -> Result<Lines, CliError> {
        let nothing = |writer: Box<dyn Write>| Lines { writer, made: Made::Nothing };
        Ok(match self {
            Self::Stdout => nothing(Box::new(io::stdout())),
            Self::Tcp(address) => nothing(Box::new(Clients::listen(*address, what)?)),
            Self::Fifo(path) => nothing(Box::new(fifo(path, what)?)),
            Self::File(path) if live => {
                let (made, file) = InSight::file(path)?;
                Lines { writer: Box::new(file), made: Made::InSight(made) }
            }
            Self::File(path) => {
                let made = Staging::file(path)?;
                let file = made.handle().map_err(|error| CliError::create(shown(path), &error))?;
                Lines { writer: Box::new(file), made: Made::Staged(made) }
            }
        })
    }
}

fn fifo(path: &Path, what: &str) -> Result<File, CliError> {
    scenario::note(&format!("{what}: waiting for a reader of {}", shown(path)));
    File::options().write(true).open(path).map_err(|error| CliError::create(shown(path), &error))
}

/// Clients at one time; others are turned away.
const MOST_CLIENTS: usize = 16;
/// Stack of the thread that waits for them.
const STACK_BYTES: usize = 1 << 18;

/// The clients of a listener.
struct Clients {
    what: String,
    streams: Arc<Mutex<Vec<TcpStream>>>,
}

impl Clients {
    fn listen(address: SocketAddr, what: &str) -> Result<Self, CliError> {
        let (listener, own) = listen(address, what)?;
        let streams = Arc::new(Mutex::new(Vec::new()));
        let waiting = Arc::clone(&streams);
        let thread = thread::Builder::new().name("clients".to_owned()).stack_size(STACK_BYTES);
        // It ends with the process.
        thread
            .spawn(move || take_clients(&listener, &waiting))
            .map_err(|error| CliError::create(format!("a listener on {own}"), &error))?;
        Ok(Self { what: what.to_owned(), streams })
    }
}

fn take_clients(listener: &TcpListener, streams: &Mutex<Vec<TcpStream>>) {
    loop {
        let (stream, _) = accept(listener, "lines");
        let ready = stream.set_nonblocking(true).and_then(|()| stream.set_nodelay(true));
        let mut streams = streams.lock().unwrap_or_else(PoisonError::into_inner);
        if ready.is_ok() && streams.len() < MOST_CLIENTS {
            streams.push(stream);
        }
    }
}

impl Write for Clients {
    /// Never fails: a client that left, or did not take all at once, is none any more.
    fn write(&mut self, lines: &[u8]) -> io::Result<usize> {
        let mut streams = self.streams.lock().unwrap_or_else(PoisonError::into_inner);
        streams.retain_mut(|stream| match stream.write(lines) {
            Ok(count) if count == lines.len() => true,
            taken => {
                let slow = match taken {
                    Ok(_) => true,
                    Err(error) => error.kind() == io::ErrorKind::WouldBlock,
                };
                if slow {
                    let peer = stream.peer_addr().map_or_else(|_| "a client".to_owned(), |peer| peer.to_string());
                    scenario::warn(&format!("{}: {peer} takes its lines too slowly and is sent away", self.what));
                }
                false
            }
        });
        Ok(lines.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Clients {
    fn drop(&mut self) {
        let streams = self.streams.lock().unwrap_or_else(PoisonError::into_inner);
        // What fails here is a client that left.
        streams.iter().for_each(|stream| _ = stream.shutdown(Shutdown::Write));
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use super::*;

    #[test]
    fn an_output_of_lines_is_a_path_unless_it_has_a_prefix() {
        assert_eq!("-".parse(), Ok(Spec::Stdout));
        assert_eq!("fixes.nmea".parse(), Ok(Spec::File("fixes.nmea".into())));
        assert_eq!("file:-".parse(), Ok(Spec::File("-".into())));
        assert_eq!("tcp:10110".parse::<Spec>().unwrap().to_string(), "tcp:127.0.0.1:10110");
        assert!("tcp:away".parse::<Spec>().is_err() && "".parse::<Spec>().is_err());
    }

    #[test]
    fn clients_that_leave_or_do_not_read_never_hold_the_writer_up() {
        let mut clients = Clients { what: "lines".to_owned(), streams: Arc::default() };
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let streams = Arc::clone(&clients.streams);
        thread::spawn(move || take_clients(&listener, &streams));
        let [mut good, idle, gone] = [(); 3].map(|()| TcpStream::connect(address).unwrap());
        while clients.streams.lock().unwrap().len() < 3 {
            thread::yield_now();
        }
        drop(gone);
        let reader = thread::spawn(move || {
            let (mut text, mut some) = (Vec::new(), [0; 4096]);
            while text.len() < 1000 {
                let count = good.read(&mut some).unwrap();
                text.extend_from_slice(&some[..count]);
            }
            text
        });
        let line = [b'x'; 1000];
        clients.write_all(&line).unwrap();
        assert_eq!(reader.join().unwrap(), line);
        // The idle one's buffers fill up at some time.
        for _ in 0..100_000 {
            clients.write_all(&line).unwrap();
        }
        assert!(clients.streams.lock().unwrap().is_empty());
        drop(idle);
    }
}
