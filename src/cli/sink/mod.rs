//! Sinks of samples while they are made: standard output, a FIFO, a TCP client, a client of rtl_tcp, a file.
//!
//! A write blocks until the reader has taken the block, so that the reader sets the pace. A listener takes
//! one client and disconnects later ones by name; a live run takes another one in place of one that left. It
//! is on loopback unless another address is named. Limits: a FIFO is not made here, and its reader cannot
//! come back.

mod door;
mod plain;
mod rtl_tcp;

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use crate::cli::address::{listen_address, path};
use crate::cli::error::{CliError, shown};
use gnss::samples::IfMetadata;

/// A sink as the command line names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Spec {
    /// `-`: standard output, samples and nothing else.
    Stdout,
    /// `fifo:PATH`: a FIFO that is there, made by `mkfifo`.
    Fifo(PathBuf),
    /// `tcp:ADDR`: a listener that hands the first client the bytes and nothing else.
    Tcp(SocketAddr),
    /// `rtl-tcp:ADDR`: a listener that speaks rtl_tcp to the first client.
    RtlTcp(SocketAddr),
    /// `file:PATH`: a file that has its name once it is whole.
    File(PathBuf),
}

impl Spec {
    /// The stream that an `--out` names; `None` of a path.
    ///
    /// # Errors
    /// A prefix with something behind it that it does not take.
    pub fn of_out(out: &Path) -> Result<Option<Self>, CliError> {
        let Some(text) = out.to_str() else { return Ok(None) };
        let prefixes = ["fifo:", "tcp:", "rtl-tcp:", "file:"];
        if text != "-" && !prefixes.iter().any(|prefix| text.starts_with(prefix)) {
            return Ok(None);
        }
        text.parse().map(Some).map_err(|error: String| CliError::usage(format!("--out {}: {error}", shown(out))))
    }

    /// Opens the sink for samples as `stream` describes them: waits until there is a reader. With `returning`
    /// a listener takes another client after one that left.
    ///
    /// # Errors
    /// An output that cannot be made or listened on, a format that it cannot carry.
    pub fn open(&self, stream: &IfMetadata, returning: bool) -> Result<Box<dyn Sink>, CliError> {
        Ok(match self {
            Self::Stdout => Box::new(plain::Pipe::stdout()?),
            Self::Fifo(path) => Box::new(plain::Pipe::fifo(path)?),
            Self::Tcp(address) => Box::new(plain::Tcp::open(*address, returning)?),
            Self::RtlTcp(address) => Box::new(rtl_tcp::RtlTcp::open(*address, stream, returning)?),
            Self::File(path) => Box::new(plain::StagedFile::open(path)?),
        })
    }
}

impl FromStr for Spec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            _ if text == "-" => Ok(Self::Stdout),
            Some(("fifo", rest)) => path(rest).map(Self::Fifo),
            Some(("file", rest)) => path(rest).map(Self::File),
            Some(("tcp", rest)) => listen_address(rest).map(Self::Tcp),
            Some(("rtl-tcp", rest)) => listen_address(rest).map(Self::RtlTcp),
            _ => Err(format!("'{text}': expected -, fifo:PATH, tcp:ADDR, rtl-tcp:ADDR or file:PATH")),
        }
    }
}

/// Form of the specification on the command line.
impl fmt::Display for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stdout => f.write_str("-"),
            Self::Fifo(path) => write!(f, "fifo:{}", shown(path)),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::RtlTcp(address) => write!(f, "rtl-tcp:{address}"),
            Self::File(path) => write!(f, "file:{}", shown(path)),
        }
    }
}

/// Takes samples as bytes, cut anywhere.
pub trait Sink: Send {
    /// Hands over all bytes of `block`, however long the reader takes.
    ///
    /// # Errors
    /// [`io::ErrorKind::BrokenPipe`] of a pipe whose reader is gone, which ends the program quietly; what the
    /// system says otherwise.
    fn write(&mut self, block: &[u8]) -> io::Result<()>;

    /// True if another client may take the slot of one that left.
    fn is_returning(&self) -> bool {
        false
    }

    /// Takes a client in place of one that left, within `patience`; true once there is one.
    ///
    /// # Errors
    /// A client that left already.
    fn again(&mut self, _patience: Duration) -> io::Result<bool> {
        Ok(false)
    }

    /// Ends the stream: what is buffered goes out, a reader sees the end, a file gets its name.
    ///
    /// # Errors
    /// Errors of [`Sink::write`].
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// A sink where the library wants a writer.
pub struct Through<'a>(pub &'a mut dyn Sink);

impl io::Write for Through<'_> {
    fn write(&mut self, block: &[u8]) -> io::Result<usize> {
        self.0.write(block).map(|()| block.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sink_reads_as_it_is_written_and_anything_else_is_refused() {
        for text in ["-", "fifo:/tmp/if", "tcp:127.0.0.1:5000", "rtl-tcp:0.0.0.0:1234", "file:a b.bin"] {
            assert_eq!(text.parse::<Spec>().unwrap().to_string(), text);
        }
        assert_eq!("tcp:5000".parse::<Spec>().unwrap().to_string(), "tcp:127.0.0.1:5000");
        for text in ["", "udp:1", "fifo:", "file:", "tcp:", "rtl_tcp:1234", "out.bin"] {
            assert!(text.parse::<Spec>().unwrap_err().contains("expected"), "{text}");
        }
    }

    #[test]
    fn an_output_without_a_prefix_is_a_file() {
        for text in ["a.sigmf-data", "./-", "./tcp:1"] {
            assert_eq!(Spec::of_out(Path::new(text)).unwrap(), None, "{text}");
        }
        assert_eq!(Spec::of_out(Path::new("-")).unwrap(), Some(Spec::Stdout));
        assert!(Spec::of_out(Path::new("tcp:nowhere")).is_err());
    }
}
