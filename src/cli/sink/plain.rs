//! Sinks that take bytes as they are: standard output, a FIFO, a TCP client, a file.

use std::fs::{self, File};
use std::io::{self, IsTerminal, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use super::Sink;
use crate::cli::address;
use crate::cli::error::{CliError, shown};
use crate::cli::scenario;
use crate::cli::staging::Staging;

/// Time limit for a client to close its side when the stream has ended. Closing a connection with unread data
/// would discard the last samples.
pub(super) const PARTING: Duration = Duration::from_secs(2);
/// Clients sent away that are named.
const MOST_SAID: u32 = 5;
/// Stack of the thread that sends them away.
const STACK_BYTES: usize = 1 << 17;
/// Polling interval for that.
pub(super) const LOOK: Duration = Duration::from_millis(100);

/// A pipe: standard output or a FIFO, without a buffer of its own.
pub(super) struct Pipe(File);

impl Pipe {
    /// Standard output, unless it is a terminal.
    pub fn stdout() -> Result<Self, CliError> {
        let stdout = io::stdout();
        if stdout.is_terminal() {
            return Err(CliError::usage(
                "standard output is a terminal: send the samples through a pipe or into a file, as in `--out - | \
                 hackrf_transfer -t -`",
            ));
        }
        // Beside the library's own, which looks for ends of lines.
        let own = stdout.as_fd().try_clone_to_owned().map_err(|error| CliError::output("standard output", &error))?;
        Ok(Self(own.into()))
    }

    /// A FIFO, once somebody reads it.
    pub fn fifo(path: &Path) -> Result<Self, CliError> {
        let name = shown(path);
        let about = fs::metadata(path).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => {
                CliError::refused_output(format!("no FIFO {name}: make one with `mkfifo {name}`"))
            }
            _ => CliError::create(&name, &error),
        })?;
        if !about.file_type().is_fifo() {
            return Err(CliError::refused_output(format!("{name} is no FIFO: expected one that `mkfifo` made")));
        }
        scenario::note(&format!("samples: waiting for a reader of {name}"));
        File::options().write(true).open(path).map(Self).map_err(|error| CliError::create(&name, &error))
    }
}

impl Sink for Pipe {
    fn write(&mut self, block: &[u8]) -> io::Result<()> {
        self.0.write_all(block)
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        Ok(())
    }
}

/// A client of a listener.
pub(super) struct Client {
    pub stream: TcpStream,
    pub peer: SocketAddr,
    sent: u64,
}

impl Client {
    /// The first that comes; later ones are sent away by name, as one stream has one pace.
    pub fn wait(address: SocketAddr, what: &str) -> Result<Self, CliError> {
        let (listener, own) = address::listen(address, what)?;
        let fail = |error: io::Error| CliError::create(format!("a connection on {own}"), &error);
        let (stream, peer) = loop {
            match listener.accept() {
                // Gone before it was taken: the next one, then.
                Err(error) if matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::Interrupted) => {
                }
                other => break other.map_err(fail)?,
            }
        };
        stream.set_nodelay(true).and_then(|()| stream.set_read_timeout(Some(LOOK))).map_err(fail)?;
        scenario::note(&format!("{what}: client {peer}"));
        let turned_away = thread::Builder::new().name("listener".to_owned()).stack_size(STACK_BYTES);
        let turned_away = turned_away.spawn(move || send_away(&listener, peer));
        turned_away.map_err(|error| CliError::passing(format!("cannot start a thread: {error}")))?;
        Ok(Self { stream, peer, sent: 0 })
    }

    /// Sends all of it; a client that left is no broken pipe but an error with its name.
    pub fn send(&mut self, block: &[u8]) -> io::Result<()> {
        self.stream.write_all(block).map_err(|error| match error.kind() {
            io::ErrorKind::BrokenPipe | io::ErrorKind::ConnectionReset | io::ErrorKind::ConnectionAborted => {
                io::Error::other(format!("the client {} left after {} bytes", self.peer, self.sent))
            }
            _ => error,
        })?;
        self.sent += block.len() as u64;
        Ok(())
    }

    /// No more comes from here.
    pub fn end(&self) -> io::Result<()> {
        match self.stream.shutdown(Shutdown::Write) {
            // It had all and left.
            Err(error) if error.kind() == io::ErrorKind::NotConnected => Ok(()),
            other => other,
        }
    }
}

/// Closes the connections of further clients, and says why of the first ones.
fn send_away(listener: &TcpListener, first: SocketAddr) {
    let mut said = 0;
    loop {
        match listener.accept() {
            Ok((_, peer)) if said < MOST_SAID => {
                said += 1;
                scenario::warn(&format!(
                    "client {peer} is sent away: {first} has these samples; a sink takes one client, another needs \
                     a sink of its own (live takes several --to)"
                ));
            }
            Ok(_) => {}
            // No more descriptors, or the like: not in a hurry.
            Err(_) => thread::sleep(LOOK),
        }
    }
}

/// A TCP client that is given the bytes and nothing else.
pub(super) struct Tcp(Client);

impl Tcp {
    pub fn open(address: SocketAddr) -> Result<Self, CliError> {
        Client::wait(address, "samples").map(Self)
    }
}

impl Sink for Tcp {
    fn write(&mut self, block: &[u8]) -> io::Result<()> {
        self.0.send(block)
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        let mut client = self.0;
        client.end()?;
        let (begun, mut words) = (Instant::now(), [0; 512]);
        while begun.elapsed() < PARTING {
            match client.stream.read(&mut words) {
                Ok(0) => break,
                Ok(_) => {}
                Err(error) if is_silence(&error) => {}
                Err(_) => break,
            }
        }
        Ok(())
    }
}

/// True if a read ended because no data came for a while.
pub(super) fn is_silence(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// A file that has its name once it is whole.
pub(super) struct StagedFile(Staging);

impl StagedFile {
    pub fn open(path: &Path) -> Result<Self, CliError> {
        Staging::file(path).map(Self)
    }
}

impl Sink for StagedFile {
    fn write(&mut self, block: &[u8]) -> io::Result<()> {
        self.0.writer().write_all(block)
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        self.0.finish()
    }
}
