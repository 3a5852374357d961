//! Client of NTRIP: `ntrip://[USER:PASSWORD@]HOST:PORT/MOUNT` instead of a file.
//!
//! A stream without an end is ended by a signal, as if the caster had ended it.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::cli::address::{connect, peer_address};
use crate::cli::error::CliError;
use crate::cli::interrupt;
use crate::cli::platform::LOOK;
use logs::ntrip::{Body, Chunks, Request, answered, head};

/// Time after which a caster that is silent has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// True if a path names a stream of a caster.
pub fn is_stream(path: &Path) -> bool {
    path.to_str().is_some_and(|text| text.starts_with("ntrip://"))
}

/// Parts of an address: name and password, host with port, mount point.
fn parts(text: &str) -> Result<(Option<&str>, String, &str), String> {
    let rest = text.strip_prefix("ntrip://").unwrap_or(text);
    let expected = || format!("'{text}': expected ntrip://[USER:PASSWORD@]HOST:PORT/MOUNT");
    let (place, mount) = rest.split_once('/').ok_or_else(expected)?;
    let (user, host) = place.rsplit_once('@').map_or((None, place), |(user, host)| (Some(user), host));
    if host.is_empty() || mount.is_empty() || mount.contains(|char: char| char.is_whitespace() || char.is_control()) {
        return Err(expected());
    }
    let host = if host.contains(':') { host.to_owned() } else { format!("{host}:2101") };
    Ok((user, peer_address(&host).map_err(|_| expected())?, mount))
}

/// Stream of the caster that an address names.
pub fn open(path: &Path) -> Result<Box<dyn Read>, CliError> {
    let (user, host, mount) = parts(path.to_str().unwrap_or_default()).map_err(CliError::usage)?;
    let name = format!("ntrip://{host}/{mount}");
    let failed = |error: io::Error| CliError::passing(format!("cannot read {name}: {error}"));
    let mut stream = connect(&host).map_err(failed)?;
    stream.set_read_timeout(Some(LOOK)).map_err(failed)?;
    stream.write_all(Request::text(mount, &host, user).as_bytes()).map_err(failed)?;
    interrupt::ends_work();
    let mut patient = Patient { stream, heard: Instant::now() };
    let head = head(&mut patient).map_err(failed)?;
    let body = answered(&head).map_err(|what| CliError::input(format!("{name}: {what}")))?;
    Ok(match body {
        Body::Plain => Box::new(patient),
        Body::Chunked => Box::new(Chunks::new(patient)),
    })
}

/// Reader that looks for signals while it waits.
struct Patient {
    stream: TcpStream,
    heard: Instant,
}

impl Read for Patient {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.stream.read(into) {
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    if interrupt::ending().is_some() {
                        return Ok(0);
                    }
                    if self.heard.elapsed() > PATIENCE {
                        return Err(ErrorKind::TimedOut.into());
                    }
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                other => {
                    self.heard = Instant::now();
                    return other;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_host_and_a_mount_point() {
        assert_eq!(parts("ntrip://a.org/M"), Ok((None, "a.org:2101".to_owned(), "M")));
        assert_eq!(parts("ntrip://u:p@x@a.org:80/M"), Ok((Some("u:p@x"), "a.org:80".to_owned(), "M")));
        for text in ["ntrip://a.org", "ntrip://a.org/", "ntrip://a.org:x/M", "ntrip:///M", "ntrip://a/M\r\nX"] {
            assert!(parts(text).unwrap_err().contains("expected ntrip://"), "{text}");
        }
    }
}
