//! Slot of a listener's one client, and who may take it.
//!
//! A receiver that restarts may connect before the loss of its old connection is seen. A newcomer therefore
//! waits for a moment: it takes the slot of a client that leaves meanwhile, or that has taken nothing for so
//! long, and is sent away by name otherwise.

use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::cli::address;
use crate::cli::scenario;

/// Time for which a newcomer waits for the slot.
const WAIT: Duration = Duration::from_secs(2);
/// Clients sent away that are named.
const MOST_SAID: u32 = 5;

/// A client: its connection and its address.
type Client = (Arc<TcpStream>, SocketAddr);

/// The slot of a listener's client.
pub(super) struct Door {
    /// True if another client may take the slot.
    pub returning: bool,
    inside: Mutex<Inside>,
    changed: Condvar,
}

struct Inside {
    /// The client that has the slot.
    holder: Option<Client>,
    /// Time since which a block waits to be taken by it.
    writing: Option<Instant>,
    /// The client that comes next.
    next: Option<Client>,
}

impl Door {
    /// The slot with its first client.
    pub fn new(returning: bool, stream: Arc<TcpStream>, peer: SocketAddr) -> Self {
        let inside = Inside { holder: Some((stream, peer)), writing: None, next: None };
        Self { returning, inside: Mutex::new(inside), changed: Condvar::new() }
    }

    fn inside(&self) -> MutexGuard<'_, Inside> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A block begins to wait for the client, or was taken.
    pub fn write_begins(&self, at: Option<Instant>) {
        self.inside().writing = at;
    }

    /// The client left.
    pub fn lost(&self) {
        self.inside().holder = None;
        self.changed.notify_all();
    }

    /// Gives the slot to the client that comes next, within `patience`.
    pub fn next(&self, patience: Duration) -> Option<(Arc<TcpStream>, SocketAddr)> {
        let waited = self.changed.wait_timeout_while(self.inside(), patience, |inside| inside.next.is_none());
        let mut inside = waited.unwrap_or_else(PoisonError::into_inner).0;
        let next = inside.next.take()?;
        inside.holder = Some(next.clone());
        Some(next)
    }

    /// Takes clients for ever: lets them in, or sends them away and says why of the first ones.
    pub fn keep(&self, listener: &TcpListener, what: &str) {
        let mut said = 0;
        loop {
            let (stream, peer) = address::accept(listener, what);
            let Err(holder) = self.offer(Arc::new(stream), peer, what) else { continue };
            if said < MOST_SAID {
                said += 1;
                scenario::warn(&format!(
                    "client {peer} is sent away: {holder} has these samples; a sink takes one client, another needs \
                     a sink of its own (live takes several --to)"
                ));
            }
        }
    }

    /// Lets a newcomer in, or says who has the slot.
    fn offer(&self, stream: Arc<TcpStream>, peer: SocketAddr, what: &str) -> Result<(), SocketAddr> {
        let patience = if self.returning { WAIT } else { Duration::ZERO };
        let is_taken = |inside: &mut Inside| inside.holder.is_some() || inside.next.is_some();
        let waited = self.changed.wait_timeout_while(self.inside(), patience, is_taken);
        let mut inside = waited.unwrap_or_else(PoisonError::into_inner).0;
        if let Some((old, holder)) = inside.holder.as_ref().or(inside.next.as_ref()) {
            let is_stuck = inside.writing.is_some_and(|since| since.elapsed() >= WAIT);
            if !self.returning || !is_stuck || inside.next.is_some() {
                return Err(*holder);
            }
            scenario::warn(&format!(
                "{what}: client {peer} takes the slot of {holder}, which has taken nothing for {} s",
                WAIT.as_secs()
            ));
            // The write that waits fails by that.
            let _ = old.shutdown(Shutdown::Both);
        }
        inside.next = Some((stream, peer));
        drop(inside);
        self.changed.notify_all();
        Ok(())
    }
}
