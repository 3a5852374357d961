//! Requests of browsers: one a connection, with bounds on every length and a deadline.
//!
//! A request names this machine by an address or as localhost, so that no page of another site reaches it
//! through a name of its own (DNS rebinding). A token in the query admits it. Limits: HTTP/1.1 without
//! continuation lines, chunked bodies and pipelining.

use std::io::{self, Read};
use std::net::IpAddr;
use std::time::{Duration, Instant};

/// Bytes of a request's head at most.
pub const MOST_HEAD_BYTES: usize = 8192;
/// Bytes of a request's body at most: an event is a line.
pub const MOST_BODY_BYTES: usize = 512;

/// Method of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    Get,
    Post,
}

/// A request that is whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    pub method: Method,
    /// Path without the query.
    pub path: String,
    /// Token of the query; empty without one.
    pub token: String,
    pub host: String,
    /// Origin of the page that asks, if a browser names it.
    pub origin: Option<String>,
    pub body: Vec<u8>,
}

/// Reason for which a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Not whole before the deadline, or broken off.
    Unfinished,
    /// Longer than its bound.
    Long,
    Malformed,
    Method,
    /// Host or origin of another site.
    Host,
    Token,
    Path,
    /// More browsers than are served.
    Crowded,
    /// A body that is not taken, with the reason elsewhere.
    Event,
}

impl Refusal {
    /// Status line of the answer.
    pub fn status(self) -> &'static str {
        match self {
            Self::Unfinished => "408 Request Timeout",
            Self::Long => "431 Request Header Fields Too Large",
            Self::Malformed => "400 Bad Request",
            Self::Method => "405 Method Not Allowed",
            Self::Host => "421 Misdirected Request",
            Self::Token => "403 Forbidden",
            Self::Path => "404 Not Found",
            Self::Crowded => "503 Service Unavailable",
            Self::Event => "422 Unprocessable Content",
        }
    }
}

/// Reads a request. `patience` sets the time that one read may take.
///
/// # Errors
/// [`Refusal`] of one that is too long, too late or malformed.
pub fn read<R: Read>(
    stream: &mut R,
    until: Instant,
    mut patience: impl FnMut(&mut R, Duration) -> io::Result<()>,
) -> Result<Request, Refusal> {
    let (mut bytes, mut some) = (Vec::new(), [0; 1024]);
    let mut more = |bytes: &mut Vec<u8>| {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() || patience(stream, left).is_err() {
            return Err(Refusal::Unfinished);
        }
        match stream.read(&mut some) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(()),
            Ok(0) | Err(_) => Err(Refusal::Unfinished),
            Ok(count) => {
                bytes.extend_from_slice(some.get(..count).unwrap_or_default());
                Ok(())
            }
        }
    };
    let end = loop {
        match bytes.windows(4).position(|four| four == b"\r\n\r\n") {
            Some(end) if end <= MOST_HEAD_BYTES => break end,
            None if bytes.len() <= MOST_HEAD_BYTES => more(&mut bytes)?,
            _ => return Err(Refusal::Long),
        }
    };
    let mut body = bytes.split_off(end + 4);
    bytes.truncate(end);
    let (mut request, length) = head(std::str::from_utf8(&bytes).map_err(|_| Refusal::Malformed)?)?;
    if length > MOST_BODY_BYTES {
        return Err(Refusal::Long);
    }
    while body.len() < length {
        more(&mut body)?;
    }
    body.truncate(length);
    request.body = body;
    Ok(request)
}

/// Head of a request, and the length of its body.
fn head(text: &str) -> Result<(Request, usize), Refusal> {
    let mut lines = text.split("\r\n");
    let words: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, target, "HTTP/1.1" | "HTTP/1.0"] = words.as_slice() else { return Err(Refusal::Malformed) };
    let method = match *method {
        "GET" => Method::Get,
        "POST" => Method::Post,
        _ => return Err(Refusal::Method),
    };
    let (path, query) = target.split_once('?').unwrap_or((*target, ""));
    let token = query.split('&').find_map(|pair| pair.strip_prefix("token=")).unwrap_or_default();
    let (mut host, mut origin, mut length) = (None, None, None);
    for line in lines {
        let (name, value) = line.split_once(':').ok_or(Refusal::Malformed)?;
        let value = value.trim();
        let known = match name.to_ascii_lowercase().as_str() {
            "host" => host.replace(value.to_owned()).is_some(),
            "origin" => origin.replace(value.to_owned()).is_some(),
            "content-length" => length.replace(value.parse().map_err(|_| Refusal::Malformed)?).is_some(),
            "transfer-encoding" => true,
            _ => false,
        };
        if known {
            return Err(Refusal::Malformed);
        }
    }
    let host = host.ok_or(Refusal::Malformed)?;
    let (path, token) = (path.to_owned(), token.to_owned());
    Ok((Request { method, path, token, host, origin, body: Vec::new() }, length.unwrap_or(0)))
}

impl Request {
    /// Checks that the request is meant for this listener and comes from its own page or none.
    ///
    /// # Errors
    /// [`Refusal::Host`].
    pub fn check_host(&self, port: u16) -> Result<(), Refusal> {
        let (name, named_port) = match self.host.rsplit_once(':') {
            Some((name, digits)) if !digits.ends_with(']') => (name, digits.parse().ok()),
            _ => (self.host.as_str(), Some(80)),
        };
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        let is_address = bare.parse::<IpAddr>().is_ok() || bare == "localhost";
        let own = format!("http://{}", self.host);
        let is_own = self.origin.as_ref().is_none_or(|origin| *origin == own);
        if is_address && named_port == Some(port) && is_own { Ok(()) } else { Err(Refusal::Host) }
    }

    /// Checks the token, in a time that does not depend on where it differs.
    ///
    /// # Errors
    /// [`Refusal::Token`].
    pub fn check_token(&self, token: &str) -> Result<(), Refusal> {
        let pairs = self.token.bytes().zip(token.bytes());
        let differs = pairs.fold(0, |differs, (a, b)| differs | (a ^ b)) != 0;
        if differs || self.token.len() != token.len() { Err(Refusal::Token) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &[u8]) -> Result<Request, Refusal> {
        let mut input = text;
        read(&mut input, Instant::now() + Duration::from_secs(5), |_, _| Ok(()))
    }

    #[test]
    fn a_request_is_read_in_pieces_of_any_length() {
        struct Slow<'a>(&'a [u8]);
        impl Read for Slow<'_> {
            fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
                self.0.read(into.get_mut(..1).unwrap_or_default())
            }
        }
        let text = b"POST /event?token=ab HTTP/1.1\r\nHOST: localhost:9\r\nContent-Length: 6\r\n\r\npower tail";
        let mut slow = Slow(text);
        let request = read(&mut slow, Instant::now() + Duration::from_secs(5), |_, _| Ok(())).unwrap();
        assert_eq!(request, parsed(text).unwrap());
        assert_eq!((request.method, request.path.as_str(), request.token.as_str()), (Method::Post, "/event", "ab"));
        assert_eq!((request.host.as_str(), request.body.as_slice()), ("localhost:9", b"power ".as_slice()));
    }

    #[test]
    fn lengths_are_bounded_to_the_byte_and_time_too() {
        let padded = |length: usize| {
            let begun = "GET / HTTP/1.1\r\nHost: localhost\r\nX: ";
            format!("{begun}{}\r\n\r\n", "x".repeat(length - begun.len()))
        };
        assert!(parsed(padded(MOST_HEAD_BYTES).as_bytes()).is_ok());
        assert_eq!(parsed(padded(MOST_HEAD_BYTES + 1).as_bytes()), Err(Refusal::Long));
        assert_eq!(parsed(&vec![b'x'; 1 << 20]), Err(Refusal::Long));
        let body = |length: usize| format!("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: {length}\r\n\r\n");
        assert_eq!(parsed((body(512) + &"x".repeat(512)).as_bytes()).unwrap().body.len(), 512);
        assert_eq!(parsed((body(513) + &"x".repeat(513)).as_bytes()), Err(Refusal::Long));
        assert_eq!(parsed(body(usize::MAX).as_bytes()), Err(Refusal::Long));
        assert_eq!(parsed(b"GET / HTTP/1.1\r\nHost:"), Err(Refusal::Unfinished));
        let late = read(&mut io::repeat(b'x'), Instant::now(), |_, _| Ok(()));
        assert_eq!(late, Err(Refusal::Unfinished));
    }

    #[test]
    fn what_is_no_request_is_refused() {
        for (text, refusal) in [
            ("\r\n\r\n", Refusal::Malformed),
            ("GET / HTTP/2\r\nHost: a\r\n\r\n", Refusal::Malformed),
            ("GET / HTTP/1.1\r\n\r\n", Refusal::Malformed),
            ("GET /  HTTP/1.1\r\nHost: a\r\n\r\n", Refusal::Malformed),
            ("PUT / HTTP/1.1\r\nHost: a\r\n\r\n", Refusal::Method),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", Refusal::Malformed),
            ("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n", Refusal::Malformed),
            ("POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n", Refusal::Malformed),
            ("GET / HTTP/1.1\r\nHost a\r\n\r\n", Refusal::Malformed),
            ("GET / HTTP/1.1\r\nHost: \u{1}\r\n no name\r\n\r\n", Refusal::Malformed),
        ] {
            assert_eq!(parsed(text.as_bytes()), Err(refusal), "{text}");
        }
        assert_eq!(parsed(b"GET /\xff HTTP/1.1\r\nHost: a\r\n\r\n"), Err(Refusal::Malformed));
    }

    #[test]
    fn no_name_of_another_site_and_no_page_of_one_is_let_in() {
        let of = |host: &str, origin: &str| {
            let origin = if origin.is_empty() { String::new() } else { format!("Origin: {origin}\r\n") };
            parsed(format!("GET / HTTP/1.1\r\nHost: {host}\r\n{origin}\r\n").as_bytes()).unwrap().check_host(8080)
        };
        for host in ["127.0.0.1:8080", "localhost:8080", "[::1]:8080", "192.168.1.7:8080"] {
            assert_eq!(of(host, ""), Ok(()), "{host}");
            assert_eq!(of(host, &format!("http://{host}")), Ok(()), "{host}");
            assert_eq!(of(host, "http://evil.example"), Err(Refusal::Host), "{host}");
            assert_eq!(of(host, "null"), Err(Refusal::Host), "{host}");
        }
        for host in
            ["evil.example:8080", "127.0.0.1:81", "127.0.0.1", "127.0.0.1.evil.example:8080", "", "[::1]", ":8080"]
        {
            assert_eq!(of(host, ""), Err(Refusal::Host), "{host}");
        }
    }

    #[test]
    fn only_the_whole_token_admits() {
        let with = |token: &str| {
            let text = format!("GET /?a=b&token={token} HTTP/1.1\r\nHost: a\r\n\r\n");
            parsed(text.as_bytes()).unwrap().check_token("0123abcd")
        };
        assert_eq!(with("0123abcd"), Ok(()));
        for token in ["", "0123abc", "0123abce", "0123abcd0", "1123abcd"] {
            assert_eq!(with(token), Err(Refusal::Token), "{token}");
        }
    }
}
