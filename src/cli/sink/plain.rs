//! Sinks that take bytes as they are: standard output, a FIFO, a TCP client, a file.

use std::fs::{self, File};
use std::io::{self, IsTerminal, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use super::Sink;
use super::door::Door;
use crate::cli::address;
use crate::cli::error::{CliError, shown};
use crate::cli::platform;
use crate::cli::scenario;
use crate::cli::staging::Staging;

/// Time limit for a client to close its side when the stream has ended. Closing a connection with unread data
/// would discard the last samples.
pub(super) const PARTING: Duration = Duration::from_secs(2);
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
        platform::own_output(&stdout).map(Self).map_err(|error| CliError::output("standard output", &error))
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
        if !platform::is_fifo(&about) {
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
    pub stream: Arc<TcpStream>,
    pub peer: SocketAddr,
    what: String,
    sent: u64,
    door: Arc<Door>,
}

impl Client {
    /// The first that comes. Later ones are sent away by name, as one stream has one pace; with `returning`
    /// the first of them takes the slot of a client that left or takes nothing.
    pub fn wait(address: SocketAddr, what: &str, returning: bool) -> Result<Self, CliError> {
        let (listener, own) = address::listen(address, what)?;
        let fail = |error: io::Error| CliError::create(format!("a connection on {own}"), &error);
        let (stream, peer) = address::accept(&listener, what);
        let stream = Arc::new(stream);
        ready(&stream).map_err(fail)?;
        scenario::note(&format!("{what}: client {peer}"));
        let door = Arc::new(Door::new(returning, Arc::clone(&stream), peer));
        let (own, name) = (Arc::clone(&door), what.to_owned());
        let thread = thread::Builder::new().name("listener".to_owned()).stack_size(STACK_BYTES);
        let thread = thread.spawn(move || own.keep(&listener, &name));
        thread.map_err(|error| CliError::passing(format!("cannot start a thread: {error}")))?;
        Ok(Self { stream, peer, what: what.to_owned(), sent: 0, door })
    }

    /// Sends all of it; a client that left is no broken pipe but an error with its name.
    pub fn send(&mut self, block: &[u8]) -> io::Result<()> {
        self.door.write_begins(Some(Instant::now()));
        let written = (&*self.stream).write_all(block);
        self.door.write_begins(None);
        written.map_err(|error| {
            self.door.lost();
            match error.kind() {
                io::ErrorKind::BrokenPipe | io::ErrorKind::ConnectionReset | io::ErrorKind::ConnectionAborted => {
                    io::Error::other(format!("the client {} left after {} bytes", self.peer, self.sent))
                }
                _ => error,
            }
        })?;
        self.sent += block.len() as u64;
        Ok(())
    }

    /// True if another client may take the slot of one that left.
    pub fn is_returning(&self) -> bool {
        self.door.returning
    }

    /// Takes the client that came after this one left, within `patience`; true once there is one.
    pub fn again(&mut self, patience: Duration) -> io::Result<bool> {
        let Some((stream, peer)) = self.door.next(patience) else { return Ok(false) };
        ready(&stream).inspect_err(|_| self.door.lost())?;
        scenario::note(&format!("{}: client {peer}", self.what));
        (self.stream, self.peer, self.sent) = (stream, peer, 0);
        Ok(true)
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

/// Sets what every client needs: no delay, and reads that end.
fn ready(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true).and_then(|()| stream.set_read_timeout(Some(LOOK)))
}

/// A TCP client that is given the bytes and nothing else.
pub(super) struct Tcp(Client);

impl Tcp {
    pub fn open(address: SocketAddr, returning: bool) -> Result<Self, CliError> {
        Client::wait(address, "samples", returning).map(Self)
    }
}

impl Sink for Tcp {
    fn write(&mut self, block: &[u8]) -> io::Result<()> {
        self.0.send(block)
    }

    fn is_returning(&self) -> bool {
        self.0.is_returning()
    }

    fn again(&mut self, patience: Duration) -> io::Result<bool> {
        self.0.again(patience)
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        let client = self.0;
        client.end()?;
        let (begun, mut words) = (Instant::now(), [0; 512]);
        while begun.elapsed() < PARTING {
            match (&*client.stream).read(&mut words) {
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
