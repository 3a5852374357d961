//! Blocks on their way to a sink: a bounded queue between the generator and the thread that writes.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The samples of a tick.
pub struct Block {
    pub bytes: Vec<u8>,
    /// Number of its first sample in the scene.
    pub first: u64,
    /// Arrival of the push that the block is the first to show.
    pub shows: Option<Instant>,
}

/// The queue to one sink.
pub struct Ring {
    blocks: Mutex<Inside>,
    changed: Condvar,
    capacity: usize,
}

#[derive(Default)]
struct Inside {
    blocks: VecDeque<Arc<Block>>,
    /// True once the generator is done.
    ended: bool,
    /// True once the sink is gone.
    gone: bool,
}

/// Result of adding a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Put {
    Done,
    Full,
    Gone,
}

impl Ring {
    pub fn new(capacity: usize) -> Self {
        Self { blocks: Mutex::default(), changed: Condvar::new(), capacity: capacity.max(1) }
    }

    fn inside(&self) -> MutexGuard<'_, Inside> {
        self.blocks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// True if there is room, or none will be needed, after a wait of at most `patience`.
    pub fn has_room(&self, patience: Duration) -> bool {
        let full = |inside: &mut Inside| !inside.gone && inside.blocks.len() >= self.capacity;
        let waited = self.changed.wait_timeout_while(self.inside(), patience, full);
        !full(&mut waited.unwrap_or_else(PoisonError::into_inner).0)
    }

    pub fn put(&self, block: &Arc<Block>) -> Put {
        let mut inside = self.inside();
        if inside.gone {
            return Put::Gone;
        }
        if inside.blocks.len() >= self.capacity {
            return Put::Full;
        }
        inside.blocks.push_back(Arc::clone(block));
        drop(inside);
        self.changed.notify_all();
        Put::Done
    }

    /// The next block, and whether it had to be waited for; `None` after the last one.
    pub fn take(&self) -> Option<(Arc<Block>, bool)> {
        let mut inside = self.inside();
        let dry = inside.blocks.is_empty();
        while inside.blocks.is_empty() && !inside.ended {
            inside = self.changed.wait(inside).unwrap_or_else(PoisonError::into_inner);
        }
        let block = inside.blocks.pop_front();
        drop(inside);
        self.changed.notify_all();
        block.map(|block| (block, dry))
    }

    /// No more blocks will come.
    pub fn end(&self) {
        self.inside().ended = true;
        self.changed.notify_all();
    }

    /// True once no more blocks will come.
    pub fn has_ended(&self) -> bool {
        self.inside().ended
    }

    /// Drops what waits; the number of blocks.
    pub fn clear(&self) -> u64 {
        let dropped = std::mem::take(&mut self.inside().blocks).len() as u64;
        self.changed.notify_all();
        dropped
    }

    /// No more blocks will be taken.
    pub fn leave(&self) {
        self.inside().gone = true;
        self.changed.notify_all();
    }

    /// Blocks that wait.
    pub fn waiting(&self) -> usize {
        self.inside().blocks.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_is_bounded_keeps_the_order_and_ends() {
        let ring = Ring::new(2);
        let block = |first| Arc::new(Block { bytes: Vec::new(), first, shows: None });
        assert_eq!([0, 1, 2].map(|first| ring.put(&block(first))), [Put::Done, Put::Done, Put::Full]);
        assert!(!ring.has_room(Duration::ZERO));
        assert_eq!(ring.take().map(|(block, dry)| (block.first, dry)), Some((0, false)));
        assert!(ring.has_room(Duration::ZERO));
        ring.end();
        assert_eq!(ring.take().map(|(block, _)| block.first), Some(1));
        assert!(ring.take().is_none());
        ring.leave();
        assert_eq!(ring.put(&block(3)), Put::Gone);
        assert!(ring.has_room(Duration::ZERO));
    }
}
