//! Paths, and addresses of listeners and of peers, as the command line takes them behind a word and a colon:
//! loopback unless another address is named.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use crate::cli::error::CliError;
use crate::cli::scenario;

const LOOPBACK: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

/// A path that is not empty.
///
/// # Errors
/// A message that states what was expected.
pub fn path(text: &str) -> Result<PathBuf, String> {
    if text.is_empty() { Err("expected a path".to_owned()) } else { Ok(text.into()) }
}

/// Parses the address of a listener. `PORT` and `localhost:PORT` are on this machine alone. `IP:PORT` is on
/// the interface that has this address. `0.0.0.0:PORT` and `[::]:PORT` are on all interfaces.
///
/// # Errors
///
/// Expected form, for any other text. Host names are refused, because their meaning changes from one
/// network to another.
pub fn listen_address(text: &str) -> Result<SocketAddr, String> {
    let port = text.strip_prefix("localhost:").or_else(|| text.strip_prefix(':')).unwrap_or(text);
    if let Ok(port) = port.parse() {
        return Ok(SocketAddr::new(LOOPBACK, port));
    }
    text.parse().map_err(|_| {
        format!(
            "'{text}': expected PORT for this machine alone (0 for a free one), or IP:PORT for one of its addresses, \
             0.0.0.0:PORT for all"
        )
    })
}

/// Address of a datagram's receiver: `udp:` and PORT on this machine, or IP:PORT.
///
/// # Errors
/// Something else, in words.
pub fn udp_address(text: &str) -> Result<SocketAddr, String> {
    let address = text.strip_prefix("udp:").and_then(|address| listen_address(address).ok());
    address
        .filter(|address| address.port() > 0)
        .ok_or_else(|| format!("'{text}': expected udp:PORT for this machine, or udp:IP:PORT"))
}

/// Begins to listen, says so, and warns where others than this machine can come in.
///
/// # Errors
/// An address that is taken, not this machine's, or not permitted.
pub fn listen(address: SocketAddr, what: &str) -> Result<(TcpListener, SocketAddr), CliError> {
    let fail = |error: io::Error| {
        let cure = match error.kind() {
            io::ErrorKind::AddrInUse => ": another program has it; name another port, or 0 for a free one",
            io::ErrorKind::AddrNotAvailable => ": this machine has no such address",
            _ => "",
        };
        CliError::refused_output(format!("cannot listen on {address}: {error}{cure}"))
    };
    let listener = TcpListener::bind(address).map_err(fail)?;
    let own = listener.local_addr().map_err(fail)?;
    if !own.ip().is_loopback() {
        scenario::warn(&format!("{own} is open to other machines, without a password"));
    }
    scenario::note(&format!("{what}: listening on {own}"));
    Ok((listener, own))
}

/// Pause before a failed call on a socket is tried again.
pub const RETRY: Duration = Duration::from_millis(100);

/// Takes the next client. While none can be taken, as without free file descriptors, it says so once and
/// tries again.
pub fn accept(listener: &TcpListener, what: &str) -> (TcpStream, SocketAddr) {
    let mut is_said = false;
    loop {
        match listener.accept() {
            Ok(client) => return client,
            // Gone before it was taken: the next one, then.
            Err(error) if matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::Interrupted) => {}
            Err(error) => {
                if !is_said {
                    scenario::warn(&format!("{what}: cannot take a client: {error}; trying again"));
                    is_said = true;
                }
                thread::sleep(RETRY);
            }
        }
    }
}

/// Text of a peer's address: `PORT` on this machine, or `HOST:PORT`.
///
/// # Errors
/// A message that states what was expected, for any other text.
pub fn peer_address(text: &str) -> Result<String, String> {
    let expected = || format!("'{text}': expected HOST:PORT, or PORT on this machine");
    let bare = text.strip_prefix(':').unwrap_or(text);
    if bare.parse::<u16>().is_ok() {
        return Ok(format!("{LOOPBACK}:{bare}"));
    }
    let (host, port) = text.rsplit_once(':').ok_or_else(expected)?;
    if host.is_empty() || port.parse::<u16>().is_err() {
        return Err(expected());
    }
    Ok(text.to_owned())
}

/// Connects to a peer.
///
/// # Errors
/// The last address that failed, or a host that has none.
pub fn connect(peer: &str) -> io::Result<TcpStream> {
    let mut failed = io::Error::new(io::ErrorKind::AddrNotAvailable, "the host has no address");
    for address in peer.to_socket_addrs()? {
        match TcpStream::connect(address) {
            Ok(stream) => return Ok(stream),
            Err(error) => failed = error,
        }
    }
    Err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listener_is_on_loopback_unless_another_address_is_named() {
        for text in ["1234", ":1234", "localhost:1234", "127.0.0.1:1234"] {
            assert_eq!(listen_address(text).unwrap().to_string(), "127.0.0.1:1234");
        }
        for text in ["0.0.0.0:1234", "192.168.7.1:1234", "[::1]:1234"] {
            assert_eq!(listen_address(text).unwrap().to_string(), text);
        }
        for text in ["", ":", "example.org:1234", "127.0.0.1", "65536", "-1", "1.2.3.4:x", "localhost"] {
            let error = listen_address(text).unwrap_err();
            assert!(error.contains("expected PORT"), "{error}");
        }
    }

    #[test]
    fn a_peer_is_a_host_and_a_port_or_a_port_of_this_machine() {
        assert_eq!(peer_address("1234").unwrap(), "127.0.0.1:1234");
        assert_eq!(peer_address(":1234").unwrap(), "127.0.0.1:1234");
        for text in ["dongle.local:1234", "10.0.0.1:1", "[::1]:1234"] {
            assert_eq!(peer_address(text).unwrap(), text);
        }
        for text in ["", "host", "host:", "host:99999", ":x"] {
            assert!(peer_address(text).unwrap_err().contains("expected HOST:PORT"), "{text}");
        }
    }
}
