//! The page's server: one thread accepts, one serves each connection, and none of them ever waits for
//! another.
//!
//! Connections, requests and browsers are bounded; what is refused is counted and shown on the page.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::http::{self, Method, Refusal, Request};
use super::hub::{Hub, Next};
use crate::cli::address::accept;

/// Connections at one time, requests that are not whole yet included.
const MOST_CONNECTIONS: usize = 64;
/// Time in which a request has to be whole.
const DEADLINE: Duration = Duration::from_secs(3);
/// Time for which a browser may take nothing.
const STUCK: Duration = Duration::from_secs(10);
/// Time after which a sign of life is sent.
const SILENCE: Duration = Duration::from_secs(5);
/// Time for one read of what a refused client still sends.
const PAUSE: Duration = Duration::from_millis(100);
/// Reads of what a refused client still sends.
const MOST_UNREAD: usize = 16;
/// Stack of a thread.
const STACK_BYTES: usize = 1 << 18;

/// Takes the line of an event, or states why not.
pub type Events = dyn Fn(&str) -> Result<(), String> + Send + Sync;

/// Number of refused requests, by reason.
#[derive(Default)]
pub struct Refused {
    unfinished: AtomicU64,
    long: AtomicU64,
    malformed: AtomicU64,
    hosts: AtomicU64,
    tokens: AtomicU64,
    crowded: AtomicU64,
    events: AtomicU64,
}

impl Refused {
    fn count(&self, refusal: Refusal) {
        let counter = match refusal {
            Refusal::Unfinished => &self.unfinished,
            Refusal::Long => &self.long,
            Refusal::Malformed | Refusal::Method | Refusal::Path => &self.malformed,
            Refusal::Host => &self.hosts,
            Refusal::Token => &self.tokens,
            Refusal::Crowded => &self.crowded,
            Refusal::Event => &self.events,
        };
        counter.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts as JSON.
    pub fn json(&self) -> Value {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        json!({
            "unfinished": of(&self.unfinished), "long": of(&self.long), "malformed": of(&self.malformed),
            "hosts": of(&self.hosts), "tokens": of(&self.tokens), "crowded": of(&self.crowded),
            "events": of(&self.events),
        })
    }
}

/// Content that is served, and to whom.
pub struct Server {
    pub port: u16,
    pub token: String,
    /// The page.
    pub html: String,
    /// Content security policy of the page.
    pub policy: String,
    pub hub: Arc<Hub>,
    /// Taker of events; `None` where there are none.
    pub events: Option<Box<Events>>,
    pub refused: Refused,
    pub connections: AtomicUsize,
}

impl Server {
    /// Serves to the end of the process.
    pub fn run(self: Arc<Self>, listener: &TcpListener) {
        loop {
            let (stream, _) = accept(listener, "page");
            if self.connections.fetch_add(1, Ordering::AcqRel) >= MOST_CONNECTIONS {
                self.turn_away(stream);
                continue;
            }
            let own = Arc::clone(&self);
            let work = move || {
                // A client that breaks off is no fault.
                let _ = own.serve(stream);
                own.connections.fetch_sub(1, Ordering::AcqRel);
            };
            if thread::Builder::new().name("browser".to_owned()).stack_size(STACK_BYTES).spawn(work).is_err() {
                self.refused.count(Refusal::Crowded);
                self.connections.fetch_sub(1, Ordering::AcqRel);
            }
        }
    }

    /// Refuses a connection without a wait.
    fn turn_away(&self, mut stream: TcpStream) {
        self.refused.count(Refusal::Crowded);
        if stream.set_nonblocking(true).is_ok() {
            let _ = stream.write(answer(Refusal::Crowded.status(), "", "").as_bytes());
        }
        self.connections.fetch_sub(1, Ordering::AcqRel);
    }

    fn serve(&self, mut stream: TcpStream) -> io::Result<()> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(STUCK))?;
        let patience = |stream: &mut TcpStream, left: Duration| stream.set_read_timeout(Some(left));
        let request = http::read(&mut stream, Instant::now() + DEADLINE, patience);
        match request.and_then(|request| self.admit(&request).map(|()| request)) {
            Err(refusal) => self.refuse(&mut stream, refusal, ""),
            Ok(request) => match (request.method, request.path.as_str()) {
                (Method::Get, "/") => {
                    let policy = format!("Content-Security-Policy: {}; frame-ancestors 'none'\r\n", self.policy);
                    stream.write_all(
                        answer("200 OK", &(policy + "Content-Type: text/html; charset=utf-8\r\n"), &self.html)
                            .as_bytes(),
                    )
                }
                (Method::Get, "/favicon.ico") => stream.write_all(answer("204 No Content", "", "").as_bytes()),
                (Method::Get, "/stream") => self.stream(&mut stream),
                (Method::Post, "/event") => self.event(&mut stream, &request.body),
                _ => self.refuse(&mut stream, Refusal::Path, ""),
            },
        }
    }

    fn admit(&self, request: &Request) -> Result<(), Refusal> {
        request.check_host(self.port)?;
        // Browsers ask for an icon without being told to.
        if request.path == "/favicon.ico" { Ok(()) } else { request.check_token(&self.token) }
    }

    fn refuse(&self, stream: &mut TcpStream, refusal: Refusal, why: &str) -> io::Result<()> {
        self.refused.count(refusal);
        stream.write_all(answer(refusal.status(), "Content-Type: text/plain; charset=utf-8\r\n", why).as_bytes())?;
        stream.shutdown(Shutdown::Write)?;
        // An answer is lost where the connection is closed with bytes unread.
        stream.set_read_timeout(Some(PAUSE))?;
        let mut some = [0; 4096];
        for _ in 0..MOST_UNREAD {
            if !matches!(stream.read(&mut some), Ok(1..)) {
                break;
            }
        }
        Ok(())
    }

    /// Sends frames as server-sent events until the browser leaves.
    fn stream(&self, stream: &mut TcpStream) -> io::Result<()> {
        let Some((history, queue)) = self.hub.join() else { return self.refuse(stream, Refusal::Crowded, "") };
        let send = |stream: &mut TcpStream| {
            stream
                .write_all(format!("HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{COMMON}\r\n").as_bytes())?;
            for frame in &history {
                stream.write_all(event(frame).as_bytes())?;
            }
            loop {
                match queue.next(SILENCE) {
                    Next::Frame(frame) => stream.write_all(event(&frame).as_bytes())?,
                    Next::Nothing => stream.write_all(b":\n\n")?,
                    Next::End => return stream.write_all(b"event: end\ndata: {}\n\n"),
                }
            }
        };
        let sent = send(stream);
        queue.leave();
        sent
    }

    fn event(&self, stream: &mut TcpStream, body: &[u8]) -> io::Result<()> {
        let line = std::str::from_utf8(body).map(str::trim);
        let taken = match (&self.events, line) {
            (None, _) => Err("this page takes no events".to_owned()),
            (_, Err(_)) => Err("not UTF-8".to_owned()),
            (Some(events), Ok(line)) => events(line),
        };
        match taken {
            Ok(()) => stream.write_all(answer("202 Accepted", "", "").as_bytes()),
            Err(why) => self.refuse(stream, Refusal::Event, &why),
        }
    }
}

/// Head lines of every answer.
const COMMON: &str = "Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
                      Referrer-Policy: no-referrer\r\nX-Frame-Options: DENY\r\n\
                      Cross-Origin-Resource-Policy: same-origin\r\n";

fn answer(status: &str, lines: &str, body: &str) -> String {
    format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\n{lines}{COMMON}\r\n{body}", body.len())
}

/// A frame as a server-sent event. JSON text has no line breaks.
fn event(frame: &str) -> String {
    format!("data: {frame}\n\n")
}
