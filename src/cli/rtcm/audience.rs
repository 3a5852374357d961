//! Clients of a stream: those of a TCP listener, and those of a caster that ask for its mount point.
//!
//! Each client has a thread and a queue. One whose queue is full takes its stream too slowly and is sent
//! away, so that no client delays the others. A client gets what is sent after it has come.

use std::io::{self, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::args::Rtcm;
use crate::cli::address::{accept, listen};
use crate::cli::error::CliError;
use crate::cli::interrupt;
use crate::cli::platform::LOOK;
use crate::cli::scenario;
use logs::ntrip::{self, Body, Caster, Request};

/// Epochs that wait for a client at most.
const QUEUE: usize = 256;
/// Time for a request and for a write.
const PATIENCE: Duration = Duration::from_secs(10);

/// Frames of one epoch.
type Frames = Arc<[u8]>;

/// Clients of all listeners.
pub struct Audience {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    inside: Mutex<Inside>,
    changed: Condvar,
}

#[derive(Default)]
struct Inside {
    queues: Vec<(SocketAddr, SyncSender<Frames>)>,
    threads: Vec<JoinHandle<()>>,
    /// Clients so far.
    count: u64,
}

impl Shared {
    fn inside(&self) -> MutexGuard<'_, Inside> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets a client in whose stream begins here.
    fn enter(self: &Arc<Self>, stream: TcpStream, peer: SocketAddr, body: Body) {
        let (queue, frames) = sync_channel(QUEUE);
        let thread = thread::Builder::new().name("rtcm client".to_owned()).spawn(move || serve(stream, body, &frames));
        match thread {
            Ok(thread) => {
                let mut inside = self.inside();
                inside.queues.push((peer, queue));
                inside.threads.push(thread);
                inside.count += 1;
                drop(inside);
                self.changed.notify_all();
            }
            Err(error) => scenario::warn(&format!("client {peer} is sent away: {error}")),
        }
    }
}

/// Writes what comes until the client or the stream ends.
fn serve(mut stream: TcpStream, body: Body, frames: &Receiver<Frames>) {
    for epoch in frames {
        let written = match body {
            Body::Plain => stream.write_all(&epoch),
            Body::Chunked => stream.write_all(&ntrip::chunk(&epoch)),
        };
        if written.is_err() {
            return;
        }
    }
    if body == Body::Chunked {
        // The client may be gone by now.
        let _ = stream.write_all(b"0\r\n\r\n");
    }
}

impl Audience {
    /// Opens the listeners that are asked for; none if there are none.
    pub fn open(arguments: &Rtcm, caster: impl FnOnce(&str) -> Caster) -> Result<Option<Self>, CliError> {
        if arguments.serve.is_none() && arguments.caster.is_none() {
            return Ok(None);
        }
        interrupt::ends_work();
        let own = Self { shared: Arc::default() };
        if let Some(address) = arguments.serve {
            let (listener, _) = listen(address, "rtcm")?;
            own.keep(listener, "rtcm", |stream, _| Ok(Some((stream, Body::Plain))))?;
        }
        if let Some((address, mount)) = &arguments.caster {
            let caster = caster(mount);
            let (listener, _) = listen(*address, &format!("caster of /{mount}"))?;
            own.keep(listener, "caster", move |stream, _| admitted(stream, &caster))?;
        }
        Ok(Some(own))
    }

    /// Takes clients for ever, each in a thread of its own while it asks.
    fn keep(
        &self,
        listener: TcpListener,
        what: &'static str,
        admit: impl Fn(TcpStream, SocketAddr) -> io::Result<Option<(TcpStream, Body)>> + Send + Sync + 'static,
    ) -> Result<(), CliError> {
        let (shared, admit) = (Arc::clone(&self.shared), Arc::new(admit));
        let wait = move || loop {
            let (stream, peer) = accept(&listener, what);
            let (shared, admit) = (Arc::clone(&shared), Arc::clone(&admit));
            let ask = move || {
                let limits = stream.set_read_timeout(Some(PATIENCE)).and(stream.set_write_timeout(Some(PATIENCE)));
                match limits.and_then(|()| admit(stream, peer)) {
                    Ok(Some((stream, body))) => shared.enter(stream, peer, body),
                    Ok(None) => {}
                    Err(error) => scenario::warn(&format!("{what}: client {peer}: {error}")),
                }
            };
            if let Err(error) = thread::Builder::new().name("rtcm request".to_owned()).spawn(ask) {
                scenario::warn(&format!("client {peer} is sent away: {error}"));
            }
        };
        let spawned = thread::Builder::new().name(what.to_owned()).spawn(wait);
        spawned.map(drop).map_err(|error| CliError::passing(format!("cannot start a thread: {error}")))
    }

    /// Waits for the first client, or a signal.
    pub fn wait(&self) {
        let mut inside = self.shared.inside();
        while inside.count == 0 && interrupt::ending().is_none() {
            let waited = self.shared.changed.wait_timeout(inside, LOOK);
            inside = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Hands an epoch to every client.
    pub fn send(&self, frames: &[u8]) {
        if frames.is_empty() {
            return;
        }
        let frames: Frames = frames.into();
        self.shared.inside().queues.retain(|(peer, queue)| match queue.try_send(Arc::clone(&frames)) {
            Ok(()) => true,
            Err(TrySendError::Disconnected(_)) => false,
            Err(TrySendError::Full(_)) => {
                scenario::warn(&format!("client {peer} is sent away: it has not taken {QUEUE} epochs"));
                false
            }
        });
    }

    /// Ends the stream: clients get what waits for them. Returns how many clients there were.
    pub fn end(self) -> u64 {
        let mut inside = self.shared.inside();
        inside.queues.clear();
        let (threads, count) = (std::mem::take(&mut inside.threads), inside.count);
        drop(inside);
        threads.into_iter().for_each(|thread| drop(thread.join()));
        count
    }
}

/// Answers a request; the stream with its form if it was granted.
fn admitted(mut stream: TcpStream, caster: &Caster) -> io::Result<Option<(TcpStream, Body)>> {
    let head = ntrip::head(&mut stream)?;
    let answer = caster.answer(Request::read(&head).as_ref());
    stream.write_all(answer.text.as_bytes())?;
    Ok(answer.stream.map(|body| (stream, body)))
}
