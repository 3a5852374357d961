//! Sources of samples for `receive` while they are made: a FIFO, a TCP server, a server of rtl_tcp.
//!
//! A sender that breaks off ends the stream: the samples before count, and the reason is kept
//! ([`Stream::broken`]). [`Ahead`] continues to read while the receiver is busy, and ends on a signal. Source
//! of rtl_tcp's framing: see `sink::rtl_tcp`.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;

use crate::cli::address::{connect, peer_address};
use crate::cli::error::{CliError, shown};
use crate::cli::interrupt;
use crate::cli::platform::{self, LOOK};
use crate::cli::scenario;
use gnss::samples::IfMetadata;

/// A source as the command line names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Spec {
    /// `fifo:PATH`: a FIFO that is there, made by `mkfifo`.
    Fifo(PathBuf),
    /// `tcp:ADDR`: a server that sends the bytes and nothing else.
    Tcp(String),
    /// `rtl-tcp:ADDR`: a server of rtl_tcp, which is set to a rate and a frequency.
    RtlTcp(String),
}

/// Time limit for the first twelve bytes of an rtl_tcp server.
const GREETING: Duration = Duration::from_secs(10);

impl Spec {
    /// The stream that `receive`'s argument names; `None` of a path or `-`.
    ///
    /// # Errors
    /// A prefix with something behind it that it does not take.
    pub fn of_file(file: &Path) -> Result<Option<Self>, CliError> {
        let Some((prefix, rest)) = file.to_str().and_then(|text| text.split_once(':')) else { return Ok(None) };
        let refuse = |error: String| CliError::usage(format!("{}: {error}", shown(file)));
        match prefix {
            "fifo" if rest.is_empty() => Err(refuse("expected a path".to_owned())),
            "fifo" => Ok(Some(Self::Fifo(rest.into()))),
            "tcp" => peer_address(rest).map(|peer| Some(Self::Tcp(peer))).map_err(refuse),
            "rtl-tcp" => peer_address(rest).map(|peer| Some(Self::RtlTcp(peer))).map_err(refuse),
            _ => Ok(None),
        }
    }

    /// Opens the source of samples that are as `metadata` says: waits for a FIFO's writer, sets a server of
    /// rtl_tcp.
    ///
    /// # Errors
    /// No such FIFO, nobody who answers, a server of another kind, a rate that rtl_tcp cannot express.
    pub fn open(&self, metadata: &IfMetadata) -> Result<Stream, CliError> {
        match self {
            Self::Fifo(path) => {
                let name = shown(path);
                let about = fs::metadata(path).map_err(|error| CliError::read(&name, &error))?;
                if !platform::is_fifo(&about) {
                    return Err(CliError::input(format!("{name} is no FIFO: name a file without fifo:")));
                }
                scenario::note(&format!("samples: waiting for a writer of {name}"));
                let file = File::open(path).map_err(|error| CliError::read(&name, &error))?;
                Ok(Stream::new(name, Box::new(file)))
            }
            Self::Tcp(peer) => Ok(Stream::new(format!("tcp:{peer}"), Box::new(reached(peer)?))),
            Self::RtlTcp(peer) => {
                let wanted = Wanted::new(metadata)?;
                let mut server = reached(peer)?;
                wanted.agree(&mut server, peer)?;
                Ok(Stream::new(format!("rtl-tcp:{peer}"), Box::new(server)))
            }
        }
    }
}

fn reached(peer: &str) -> Result<TcpStream, CliError> {
    connect(peer).map_err(|error| match error.kind() {
        io::ErrorKind::ConnectionRefused | io::ErrorKind::TimedOut => {
            CliError::passing(format!("cannot connect to {peer}: {error}: is the sender listening there?"))
        }
        _ => CliError::read(format!("from {peer}"), &error),
    })
}

/// Settings for a server of rtl_tcp, in whole hertz.
struct Wanted {
    rate_hz: u32,
    center_hz: u32,
}

impl Wanted {
    fn new(metadata: &IfMetadata) -> Result<Self, CliError> {
        let whole = |what: &str, hz: f64| {
            let good = hz.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&hz);
            let refuse =
                || CliError::usage(format!("rtl-tcp takes whole hertz, 1 to {}, and {what} is {hz} Hz", u32::MAX));
            if good { Ok(hz as u32) } else { Err(refuse()) }
        };
        Ok(Self {
            rate_hz: whole("the rate", metadata.rate.hz())?,
            center_hz: whole("the frequency", metadata.center_hz)?,
        })
    }

    /// Reads the server's first bytes and sends it rate and frequency.
    fn agree(&self, server: &mut TcpStream, peer: &str) -> Result<(), CliError> {
        let mut greeting = [0; 12];
        let refuse = |what: String| {
            CliError::input(format!(
                "{peer} is no server of rtl_tcp: {what}, expected 12 bytes that begin with RTL0 (tcp:{peer} takes \
                 samples alone)"
            ))
        };
        server.set_read_timeout(Some(GREETING)).map_err(|error| CliError::read(peer, &error))?;
        server.read_exact(&mut greeting).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => refuse("it ended at once".to_owned()),
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => refuse("it is silent".to_owned()),
            _ => CliError::read(format!("from {peer}"), &error),
        })?;
        if !greeting.starts_with(b"RTL0") {
            return Err(refuse(format!("it begins with {:?}", String::from_utf8_lossy(&greeting[..4]))));
        }
        let command = |number: u8, value: u32| [&[number][..], &value.to_be_bytes()].concat();
        let commands = [command(2, self.rate_hz), command(1, self.center_hz)].concat();
        let sent = server.write_all(&commands).and_then(|()| server.set_read_timeout(None));
        sent.map_err(|error| CliError::output(format!("commands to {peer}"), &error))
    }
}

/// Samples from somebody who may break off.
pub struct Stream {
    name: String,
    inner: Box<dyn Read + Send>,
    bytes: u64,
    broken: Arc<OnceLock<String>>,
}

impl Stream {
    /// A stream with this name in messages.
    pub fn new(name: String, inner: Box<dyn Read + Send>) -> Self {
        Self { name, inner, bytes: 0, broken: Arc::default() }
    }

    /// Cell that takes the reason if the sender breaks off.
    pub fn broken(&self) -> Arc<OnceLock<String>> {
        Arc::clone(&self.broken)
    }
}

impl Read for Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.inner.read(buffer) {
            Ok(count) => {
                self.bytes += count as u64;
                Ok(count)
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Err(error),
            Err(error) => {
                let what = format!("{} broke off after {} bytes: {error}", self.name, self.bytes);
                // Only the first end counts.
                let _ = self.broken.set(what);
                Ok(0)
            }
        }
    }
}

/// Bytes of a block that is read ahead.
const BLOCK_BYTES: usize = 1 << 16;
/// Number of blocks: 16 MiB together, which is 3 s of 8-bit samples at 2.6 Msps.
const BLOCKS: usize = 256;
/// Stack of the thread that reads.
const STACK_BYTES: usize = 1 << 18;

/// Reads on in a thread of its own while the receiver works, and ends with the source or with a signal.
pub struct Ahead {
    blocks: Receiver<io::Result<Vec<u8>>>,
    block: Vec<u8>,
    taken: usize,
}

impl Ahead {
    /// Begins to read.
    pub fn new(inner: Box<dyn Read + Send>) -> io::Result<Self> {
        let (sender, blocks) = sync_channel(BLOCKS);
        let thread = thread::Builder::new().name("samples".to_owned()).stack_size(STACK_BYTES);
        thread.spawn(move || read_on(inner, &sender))?;
        Ok(Self { blocks, block: Vec::new(), taken: 0 })
    }
}

/// Reads until the end, an error, or the end of the receiver.
fn read_on(mut inner: Box<dyn Read + Send>, sender: &SyncSender<io::Result<Vec<u8>>>) {
    loop {
        let mut block = vec![0; BLOCK_BYTES];
        let read = match inner.read(&mut block) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Ok(0) => return,
            Ok(count) => {
                block.truncate(count);
                Ok(block)
            }
            Err(error) => Err(error),
        };
        if sender.send(read).is_err() {
            return;
        }
    }
}

impl Read for Ahead {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.block.len() {
            if interrupt::ending().is_some() {
                return Ok(0);
            }
            match self.blocks.recv_timeout(LOOK) {
                Ok(block) => (self.block, self.taken) = (block?, 0),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(0),
            }
        }
        let left = self.block.get(self.taken..).unwrap_or_default();
        let count = left.len().min(buffer.len());
        if let (Some(to), Some(from)) = (buffer.get_mut(..count), left.get(..count)) {
            to.copy_from_slice(from);
        }
        self.taken += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_a_path_unless_it_has_a_prefix() {
        for text in ["-", "raw.bin", "./tcp:1", "a:b.bin"] {
            assert_eq!(Spec::of_file(Path::new(text)).unwrap(), None, "{text}");
        }
        assert_eq!(Spec::of_file(Path::new("tcp:77")).unwrap(), Some(Spec::Tcp("127.0.0.1:77".to_owned())));
        let dongle = Some(Spec::RtlTcp("roof:1234".to_owned()));
        assert_eq!(Spec::of_file(Path::new("rtl-tcp:roof:1234")).unwrap(), dongle);
        assert_eq!(Spec::of_file(Path::new("fifo:a")).unwrap(), Some(Spec::Fifo("a".into())));
        for text in ["tcp:", "tcp:here", "rtl-tcp:here:x", "fifo:"] {
            assert!(Spec::of_file(Path::new(text)).is_err(), "{text}");
        }
    }

    #[test]
    fn reading_ahead_gives_the_same_bytes_and_the_same_end() {
        let bytes: Vec<u8> = (0..200_003_u32).map(|n| (n % 251) as u8).collect();
        let mut read = Vec::new();
        Ahead::new(Box::new(io::Cursor::new(bytes.clone()))).unwrap().read_to_end(&mut read).unwrap();
        assert!(read == bytes);
    }

    #[test]
    fn what_came_before_a_break_counts_and_the_break_is_kept() {
        struct Gone;
        impl Read for Gone {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::ErrorKind::ConnectionReset.into())
            }
        }
        let mut stream = Stream::new("tcp:roof:1".to_owned(), Box::new([7_u8; 100].chain(Gone)));
        let (broken, mut read) = (stream.broken(), Vec::new());
        stream.read_to_end(&mut read).unwrap();
        let what = broken.get().unwrap();
        assert!(read.len() == 100 && what.contains("tcp:roof:1") && what.contains("after 100 bytes"), "{what}");
    }
}
