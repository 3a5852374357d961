//! Senders of motion: one of them is heard at a time, and its slot is free after a silence.
//!
//! A rig that starts again comes from another port. What others send meanwhile is ignored, and they are
//! named.

use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::cli::scenario;

/// Silence after which another sender is heard.
pub const SILENCE: Duration = Duration::from_secs(2);
/// Ignored senders that are named.
const MOST_NAMED: usize = 8;
/// TCP clients at one time; a further one takes the slot of the one that was silent longest.
const MOST_CLIENTS: usize = 16;

/// Answer to something that came in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Message of the sender that is heard.
    Same,
    /// Message of a sender that takes a free slot.
    First,
    /// Message of a sender that takes the slot of a silent one.
    Instead,
    /// Message that is ignored: another sender is heard.
    Ignored,
}

/// The senders, and the one that is heard.
#[derive(Default)]
pub struct Peers {
    heard: Option<(SocketAddr, Instant)>,
    named: Vec<SocketAddr>,
    clients: Vec<Client>,
}

struct Client {
    peer: SocketAddr,
    stream: Arc<TcpStream>,
    /// Time of its last line, or of its coming.
    last: Instant,
}

impl Peers {
    /// Decides on something that `peer` sent at `now`.
    pub fn hear(&mut self, peer: SocketAddr, now: Instant) -> Heard {
        if let Some(client) = self.clients.iter_mut().find(|client| client.peer == peer) {
            client.last = now;
        }
        let Some((own, last)) = self.heard else {
            self.heard = Some((peer, now));
            return Heard::First;
        };
        if own == peer {
            self.heard = Some((peer, now));
            return Heard::Same;
        }
        if now.saturating_duration_since(last) < SILENCE {
            if !self.named.contains(&peer) && self.named.len() < MOST_NAMED {
                self.named.push(peer);
                scenario::warn(&format!(
                    "motion: what {peer} sends is ignored: {own} is heard until it says goodbye or is silent for {} s",
                    SILENCE.as_secs()
                ));
            }
            return Heard::Ignored;
        }
        scenario::warn(&format!("motion: {peer} is heard from now on: {own} is silent"));
        self.named.retain(|named| *named != peer);
        self.heard = Some((peer, now));
        Heard::Instead
    }

    /// Frees the slot of a sender, if it has it; true if so.
    pub fn leave(&mut self, peer: SocketAddr) -> bool {
        self.clients.retain(|client| client.peer != peer);
        let has_slot = self.heard.is_some_and(|(own, _)| own == peer);
        if has_slot {
            self.heard = None;
        }
        has_slot
    }

    /// Adds a TCP client; of too many, the one that was silent longest is disconnected.
    pub fn enter(&mut self, peer: SocketAddr, stream: Arc<TcpStream>, now: Instant) {
        if self.clients.len() >= MOST_CLIENTS
            && let Some(silent) = (0..self.clients.len()).min_by_key(|k| self.clients.get(*k).map(|client| client.last))
        {
            let client = self.clients.swap_remove(silent);
            scenario::warn(&format!(
                "motion: client {} is disconnected: {MOST_CLIENTS} clients are connected, and it was silent longest",
                client.peer
            ));
            // One that is gone already needs no more.
            let _ = client.stream.shutdown(Shutdown::Both);
        }
        self.clients.push(Client { peer, stream, last: now });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sender_keeps_its_slot_while_it_sends_and_a_silent_one_gives_it_up() {
        let [one, two] = [1, 2].map(|port| SocketAddr::from(([127, 0, 0, 1], port)));
        let (mut peers, begun) = (Peers::default(), Instant::now());
        let ms = Duration::from_millis;
        assert_eq!(peers.hear(one, begun), Heard::First);
        // A second one never gets in while the first sends every 1.9 s.
        for k in 1..10 {
            assert_eq!(peers.hear(two, begun + ms(1900 * k - 1)), Heard::Ignored);
            assert_eq!(peers.hear(one, begun + ms(1900 * k)), Heard::Same);
        }
        let last = begun + ms(1900 * 9);
        assert_eq!(peers.hear(two, last + SILENCE), Heard::Instead);
        assert_eq!(peers.hear(one, last + SILENCE + ms(1)), Heard::Ignored);
        // a goodbye frees the slot at once, and only that of the one who says it.
        assert!(!peers.leave(one) && peers.leave(two));
        assert_eq!(peers.hear(one, last + SILENCE + ms(2)), Heard::First);
    }
}
