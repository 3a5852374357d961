//! Words of NTRIP, by which streams of corrections are asked for and given over HTTP: of a caster and of a
//! client.
//!
//! Source: RTCM 10410.1 (NTRIP 2.0), with what it says of version 1.0. A request is read and answered as a
//! text; who calls has the connection. Version 1 answers `ICY 200 OK` and sends bytes as they are, version 2
//! HTTP/1.1 in chunks. Limits: one mount point of a caster, no uploads, no RTSP and no UDP; passwords go
//! over the line unencrypted, as NTRIP has it.

use std::io::{self, ErrorKind, Read};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Longest head of a request or an answer, in bytes.
pub const LONGEST_HEAD: usize = 8192;
/// Name of the program in heads; version 1 wants it to begin with NTRIP.
const AGENT: &str = concat!("NTRIP gnss-twin/", env!("CARGO_PKG_VERSION"));

/// Request of a client.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// Name of the mount point; empty for the source table.
    pub mount: String,
    /// True for version 2.
    pub is_second: bool,
    /// Name and password as they were encoded.
    pub credentials: Option<String>,
}

/// Value of a line of a head, without regard to the case of its name.
fn header<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    let lines = head.lines().skip(1).filter_map(|line| line.split_once(':'));
    lines.into_iter().find(|(own, _)| own.trim().eq_ignore_ascii_case(name)).map(|(_, value)| value.trim())
}

impl Request {
    /// Reads the head of a request; none if it asks for nothing that a caster has.
    pub fn read(head: &str) -> Option<Self> {
        let mut words = head.lines().next()?.split_ascii_whitespace();
        let (method, path, version) = (words.next()?, words.next()?, words.next()?);
        if method != "GET" || !version.starts_with("HTTP/1.") {
            return None;
        }
        let mount = path.strip_prefix('/')?.split('?').next()?.to_owned();
        let is_second = header(head, "Ntrip-Version").is_some_and(|value| value.eq_ignore_ascii_case("Ntrip/2.0"));
        let basic = |value: &str| {
            let (scheme, rest) = value.split_once(' ')?;
            scheme.eq_ignore_ascii_case("Basic").then(|| rest.trim().to_owned())
        };
        Some(Self { mount, is_second, credentials: header(head, "Authorization").and_then(basic) })
    }

    /// Head of a request for a stream of version 2, which a caster of version 1 answers too.
    pub fn text(mount: &str, host: &str, user: Option<&str>) -> String {
        let authorization =
            user.map_or_else(String::new, |user| format!("Authorization: Basic {}\r\n", STANDARD.encode(user)));
        format!(
            "GET /{mount} HTTP/1.1\r\nHost: {host}\r\nNtrip-Version: Ntrip/2.0\r\nUser-Agent: {AGENT}\r\n\
             {authorization}Connection: close\r\n\r\n"
        )
    }

    /// True if the request bears this name and password, written with a colon between them.
    pub fn is_of(&self, user: &str) -> bool {
        let sent = self.credentials.as_ref().and_then(|sent| STANDARD.decode(sent).ok());
        sent.is_some_and(|sent| sent == user.as_bytes())
    }
}

/// Caster with one mount point.
#[derive(Clone, Debug, Default)]
pub struct Caster {
    /// Name of the mount point.
    pub mount: String,
    /// Name and password with a colon between them; none lets everyone in.
    pub user: Option<String>,
    /// Messages of the stream, as `1006(10)`.
    pub messages: String,
    /// Systems of the stream, joined by `+`.
    pub systems: String,
    /// Latitude and longitude in degrees.
    pub place_deg: [f64; 2],
}

/// Answer to a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Bytes to send first.
    pub text: String,
    /// Form of the stream that follows; none where the answer is all.
    pub stream: Option<Body>,
}

/// Form of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// Bytes as they are.
    Plain,
    /// Chunks, each after its length (RFC 9112, 7.1).
    Chunked,
}

impl Caster {
    /// Answer to a request, which may be none that can be read.
    pub fn answer(&self, request: Option<&Request>) -> Answer {
        let all = |text: String| Answer { text, stream: None };
        let Some(request) = request else { return all(status("HTTP/1.1 400 Bad Request")) };
        if request.mount.is_empty() || request.mount != self.mount && !request.is_second {
            // Version 1 answers with the table where the mount point does not exist.
            return all(self.table(request.is_second));
        }
        if request.mount != self.mount {
            return all(status("HTTP/1.1 404 Not Found"));
        }
        if self.user.as_ref().is_some_and(|user| !request.is_of(user)) {
            let version = if request.is_second { "1.1" } else { "1.0" };
            return all(format!(
                "HTTP/{version} 401 Unauthorized\r\nServer: {AGENT}\r\nWWW-Authenticate: Basic realm=\"/{}\"\r\n\
                 Connection: close\r\n\r\n",
                self.mount
            ));
        }
        if request.is_second {
            let text = format!(
                "HTTP/1.1 200 OK\r\nNtrip-Version: Ntrip/2.0\r\nServer: {AGENT}\r\nCache-Control: no-store, no-cache, \
                 max-age=0\r\nPragma: no-cache\r\nConnection: close\r\nContent-Type: gnss/data\r\n\
                 Transfer-Encoding: chunked\r\n\r\n"
            );
            return Answer { text, stream: Some(Body::Chunked) };
        }
        Answer { text: "ICY 200 OK\r\n\r\n".to_owned(), stream: Some(Body::Plain) }
    }

    /// The source table: a line about the stream.
    fn table(&self, is_second: bool) -> String {
        let [latitude_deg, longitude_deg] = self.place_deg;
        let login = if self.user.is_some() { "B" } else { "N" };
        // Carriers 2: L1 and L2; solution 0: one base; no GGA is needed; bits a second are not known.
        let line = format!(
            "STR;{};gnss-twin;RTCM 3.3;{};2;{};none;;{latitude_deg:.4};{longitude_deg:.4};0;0;gnss-twin;none;\
             {login};N;0;\r\n",
            self.mount, self.messages, self.systems
        );
        let body = line + "ENDSOURCETABLE\r\n";
        let (first, kind) = match is_second {
            true => ("HTTP/1.1 200 OK\r\nNtrip-Version: Ntrip/2.0", "gnss/sourcetable"),
            false => ("SOURCETABLE 200 OK", "text/plain"),
        };
        format!(
            "{first}\r\nServer: {AGENT}\r\nConnection: close\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n\r\n\
             {body}",
            body.len()
        )
    }
}

fn status(line: &str) -> String {
    format!("{line}\r\nServer: {AGENT}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
}

/// Bytes as a chunk.
pub fn chunk(bytes: &[u8]) -> Vec<u8> {
    let mut all = format!("{:x}\r\n", bytes.len()).into_bytes();
    all.extend(bytes);
    all.extend(b"\r\n");
    all
}

/// Form of the stream that follows the head of an answer.
///
/// # Errors
/// Words of the caster that are no stream.
pub fn answered(head: &str) -> Result<Body, String> {
    let first = head.lines().next().unwrap_or("").trim();
    let mut words = first.split_ascii_whitespace();
    let (protocol, code) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
    if code != "200" || protocol != "ICY" && !protocol.starts_with("HTTP/1.") {
        let shown: String = first.chars().take(80).collect();
        let what = match protocol {
            "SOURCETABLE" => "it has no such mount point, and answers with its source table".to_owned(),
            _ => format!("it answers '{shown}'"),
        };
        return Err(format!("{what}: expected ICY 200 OK or HTTP/1.1 200 OK"));
    }
    let is_chunked = header(head, "Transfer-Encoding").is_some_and(|value| value.eq_ignore_ascii_case("chunked"));
    Ok(if is_chunked { Body::Chunked } else { Body::Plain })
}

/// Reads a head up to its empty line, a byte at a time so that no byte of what follows is taken.
///
/// # Errors
/// Errors of the reader; a head that ends early or is too long. An answer of version 1 may end with its first
/// line, which nothing follows but bytes of a stream.
pub fn head(input: &mut impl Read) -> io::Result<String> {
    let mut bytes = Vec::new();
    while !bytes.ends_with(b"\r\n\r\n") {
        let mut one = [0];
        if bytes.len() >= LONGEST_HEAD || input.read(&mut one)? == 0 {
            return Err(io::Error::new(ErrorKind::InvalidData, "no head of HTTP or NTRIP"));
        }
        bytes.extend(one);
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Reader of a body in chunks.
#[derive(Debug)]
pub struct Chunks<R> {
    input: R,
    left: usize,
    /// True behind a chunk, whose line end is to come.
    is_behind: bool,
    has_ended: bool,
}

impl<R: Read> Chunks<R> {
    /// Reader of the body that begins here.
    pub fn new(input: R) -> Self {
        Self { input, left: 0, is_behind: false, has_ended: false }
    }

    /// One line of up to 64 bytes without its end; none where the body ends before it.
    fn line(&mut self) -> io::Result<Option<String>> {
        let mut bytes = Vec::new();
        while !bytes.ends_with(b"\r\n") {
            let mut one = [0];
            let count = self.input.read(&mut one)?;
            if count == 0 && bytes.is_empty() {
                return Ok(None);
            }
            if count == 0 || bytes.len() >= 64 {
                return Err(io::Error::new(ErrorKind::InvalidData, "no length of a chunk"));
            }
            bytes.extend(one);
        }
        Ok(Some(String::from_utf8_lossy(&bytes).trim().to_owned()))
    }
}

impl<R: Read> Read for Chunks<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.has_ended || into.is_empty() {
            return Ok(0);
        }
        if self.left == 0 {
            if std::mem::take(&mut self.is_behind) {
                self.line()?;
            }
            // A caster that goes away between two chunks ends the stream.
            let line = self.line()?.unwrap_or_else(|| "0".to_owned());
            let length = usize::from_str_radix(line.split(';').next().unwrap_or(""), 16);
            self.left = length.map_err(|_| io::Error::new(ErrorKind::InvalidData, "no length of a chunk"))?;
            if self.left == 0 {
                self.has_ended = true;
                return Ok(0);
            }
        }
        let most = self.left.min(into.len());
        let count = self.input.read(into.get_mut(..most).unwrap_or_default())?;
        if count == 0 {
            return Err(io::Error::new(ErrorKind::UnexpectedEof, "the body ends within a chunk"));
        }
        self.left -= count;
        self.is_behind = self.left == 0;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caster() -> Caster {
        Caster {
            mount: "TWIN".into(),
            user: Some("rover:secret".into()),
            messages: "1077(1)".into(),
            systems: "GPS+GLO".into(),
            place_deg: [48.1, 11.5],
        }
    }

    #[test]
    fn a_request_of_each_version_is_answered_in_its_own() {
        // As RTKLIB 2.4.3 writes it.
        let old =
            "GET /TWIN HTTP/1.0\r\nUser-Agent: NTRIP RTKLIB/2.4.3\r\nAuthorization: Basic cm92ZXI6c2VjcmV0\r\n\r\n";
        let request = Request::read(old).unwrap();
        assert_eq!((request.mount.as_str(), request.is_second, request.is_of("rover:secret")), ("TWIN", false, true));
        let answer = caster().answer(Some(&request));
        assert_eq!((answer.text.as_str(), answer.stream), ("ICY 200 OK\r\n\r\n", Some(Body::Plain)));
        assert_eq!(answered(&answer.text), Ok(Body::Plain));
        let request = Request::read(&Request::text("TWIN", "localhost:2101", Some("rover:secret"))).unwrap();
        assert!(request.is_second && request.is_of("rover:secret"));
        let answer = caster().answer(Some(&request));
        assert_eq!((answered(&answer.text), answer.stream), (Ok(Body::Chunked), Some(Body::Chunked)));
    }

    #[test]
    fn who_is_not_known_or_asks_for_another_mount_point_is_told_so() {
        let told = |mount: &str, user: Option<&str>| {
            caster().answer(Request::read(&Request::text(mount, "h", user)).as_ref()).text
        };
        assert!(told("TWIN", None).starts_with("HTTP/1.1 401 Unauthorized\r\n"));
        assert!(told("TWIN", Some("rover:wrong")).contains("WWW-Authenticate: Basic realm=\"/TWIN\""));
        assert!(told("OTHER", None).starts_with("HTTP/1.1 404 Not Found\r\n"));
        assert!(
            told("", None).contains("\r\n\r\nSTR;TWIN;gnss-twin;RTCM 3.3;1077(1);2;GPS+GLO;none;;48.1000;11.5000;")
        );
        let old = |path: &str| caster().answer(Request::read(&format!("GET {path} HTTP/1.0\r\n\r\n")).as_ref()).text;
        for path in ["/", "/OTHER"] {
            assert!(old(path).starts_with("SOURCETABLE 200 OK\r\n") && old(path).ends_with("\r\nENDSOURCETABLE\r\n"));
        }
        assert!(answered(&old("/")).unwrap_err().contains("source table"));
        assert!(answered(&told("TWIN", None)).unwrap_err().contains("401"));
        for nonsense in
            ["", "GET", "POST /TWIN HTTP/1.1\r\n\r\n", "GET TWIN HTTP/1.1\r\n\r\n", "SOURCE x /TWIN\r\n\r\n"]
        {
            assert_eq!(Request::read(nonsense), None, "{nonsense}");
        }
        assert!(caster().answer(None).text.starts_with("HTTP/1.1 400"));
    }

    #[test]
    fn chunks_are_joined_again_wherever_reads_end() {
        let parts: [&[u8]; 3] = [b"abc", &[0xd3; 300], b"\r\n0\r\n"];
        let mut body: Vec<u8> = parts.iter().flat_map(|part| chunk(part)).collect();
        let whole = parts.concat();
        for size in [1, 2, 7, 1000] {
            let mut all = body.clone();
            all.extend(b"0\r\n\r\nmore");
            let (mut reader, mut found) = (Chunks::new(all.as_slice()), Vec::<u8>::new());
            let mut buffer = vec![0; size];
            loop {
                match reader.read(&mut buffer).unwrap() {
                    0 => break,
                    count => found.extend(&buffer[..count]),
                }
            }
            assert_eq!(found, whole, "{size}");
        }
        body.truncate(200);
        assert!(Chunks::new(body.as_slice()).read_to_end(&mut Vec::new()).is_err());
        assert!(Chunks::new(&b"zz\r\n"[..]).read_to_end(&mut Vec::new()).is_err());
        assert!(head(&mut &b"GET / HTTP/1.0\r\n"[..]).is_err());
        assert!(head(&mut &[b'x'; 10_000][..]).is_err());
    }
}
