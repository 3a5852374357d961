//! Frames on their way to browsers: a bounded queue for each, and a thinned history for those that come
//! later.
//!
//! A full queue loses its oldest frame for the newest, and counts it. Publishing never waits for a browser.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Text of a frame: one JSON object.
pub type Frame = Arc<str>;

/// Browsers that are served at one time.
pub const MOST_BROWSERS: usize = 16;
/// Frames that wait for one browser at most.
const MOST_FRAMES: usize = 16;
/// Frames of the history at most; every second one is removed then.
const MOST_HISTORY: usize = 300;

/// Frames that wait for one browser.
#[derive(Default)]
pub struct Queue {
    inside: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Default)]
struct Waiting {
    frames: VecDeque<Frame>,
    /// True once no more will come.
    ended: bool,
    /// True once the browser left.
    left: bool,
}

/// Next item of a queue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Next {
    Frame(Frame),
    /// Nothing came in time.
    Nothing,
    End,
}

impl Queue {
    fn inside(&self) -> MutexGuard<'_, Waiting> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the next frame.
    pub fn next(&self, patience: Duration) -> Next {
        let empty = |waiting: &mut Waiting| waiting.frames.is_empty() && !waiting.ended;
        let waited = self.changed.wait_timeout_while(self.inside(), patience, empty);
        let mut waiting = waited.unwrap_or_else(PoisonError::into_inner).0;
        match waiting.frames.pop_front() {
            Some(frame) => Next::Frame(frame),
            None if waiting.ended => Next::End,
            None => Next::Nothing,
        }
    }

    /// Says that the browser left.
    pub fn leave(&self) {
        self.inside().left = true;
    }

    /// Adds a frame; true if an older one gave way.
    fn push(&self, frame: &Frame) -> bool {
        let mut waiting = self.inside();
        let full = waiting.frames.len() >= MOST_FRAMES;
        if full {
            waiting.frames.pop_front();
        }
        waiting.frames.push_back(Arc::clone(frame));
        drop(waiting);
        self.changed.notify_one();
        full
    }
}

/// All browsers.
#[derive(Default)]
pub struct Hub {
    inside: Mutex<Inside>,
    dropped: AtomicU64,
}

#[derive(Default)]
struct Inside {
    queues: Vec<Arc<Queue>>,
    history: Vec<Frame>,
    ended: bool,
}

impl Hub {
    fn inside(&self) -> MutexGuard<'_, Inside> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A queue for one more browser, and the frames so far; `None` where there are enough.
    pub fn join(&self) -> Option<(Vec<Frame>, Arc<Queue>)> {
        let mut inside = self.inside();
        inside.queues.retain(|queue| !queue.inside().left);
        if inside.queues.len() >= MOST_BROWSERS {
            return None;
        }
        let queue = Arc::new(Queue::default());
        queue.inside().ended = inside.ended;
        inside.queues.push(Arc::clone(&queue));
        Some((inside.history.clone(), queue))
    }

    /// Hands a frame to every browser.
    pub fn publish(&self, frame: &Frame) {
        let mut inside = self.inside();
        inside.queues.retain(|queue| !queue.inside().left);
        let dropped = inside.queues.iter().filter(|queue| queue.push(frame)).count();
        self.dropped.fetch_add(dropped as u64, Ordering::Relaxed);
        if inside.history.len() >= MOST_HISTORY {
            let mut keep = false;
            inside.history.retain(|_| {
                keep = !keep;
                keep
            });
        }
        inside.history.push(Arc::clone(frame));
    }

    /// Says that no more frames will come, and gives browsers some time to take theirs.
    pub fn end(&self, patience: Duration) {
        let mut inside = self.inside();
        inside.ended = true;
        let queues = inside.queues.clone();
        drop(inside);
        for queue in &queues {
            queue.inside().ended = true;
            queue.changed.notify_all();
        }
        let step = Duration::from_millis(5);
        let mut left = patience;
        let waits = |queue: &Arc<Queue>| {
            let waiting = queue.inside();
            !waiting.left && !waiting.frames.is_empty()
        };
        while !left.is_zero() && queues.iter().any(waits) {
            std::thread::sleep(step);
            left = left.saturating_sub(step);
        }
    }

    /// Number of browsers at this time.
    pub fn browsers(&self) -> usize {
        self.inside().queues.len()
    }

    /// Number of frames that gave way so far.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(number: usize) -> Frame {
        number.to_string().into()
    }

    #[test]
    fn a_browser_that_does_not_read_loses_the_oldest_frames_and_holds_nobody_up() {
        let hub = Hub::default();
        let ((_, slow), (_, good)) = (hub.join().unwrap(), hub.join().unwrap());
        for number in 0..100 {
            hub.publish(&frame(number));
            assert_eq!(good.next(Duration::ZERO), Next::Frame(frame(number)));
        }
        assert_eq!(hub.dropped(), 100 - MOST_FRAMES as u64);
        for number in 100 - MOST_FRAMES..100 {
            assert_eq!(slow.next(Duration::ZERO), Next::Frame(frame(number)));
        }
        assert_eq!(slow.next(Duration::ZERO), Next::Nothing);
        slow.leave();
        hub.publish(&frame(100));
        assert_eq!(hub.browsers(), 1);
        hub.end(Duration::ZERO);
        assert_eq!((good.next(Duration::ZERO), good.next(Duration::ZERO)), (Next::Frame(frame(100)), Next::End));
        let (history, late) = hub.join().unwrap();
        assert_eq!((history.len(), late.next(Duration::ZERO)), (101, Next::End));
    }

    #[test]
    fn browsers_are_bounded_and_a_place_is_free_again() {
        let hub = Hub::default();
        let queues: Vec<_> = (0..MOST_BROWSERS).map(|_| hub.join().unwrap().1).collect();
        assert!(hub.join().is_none());
        queues[3].leave();
        assert!(hub.join().is_some() && hub.join().is_none());
    }

    #[test]
    fn the_history_is_bounded_and_reaches_from_the_first_frame_to_the_last() {
        let hub = Hub::default();
        (0..100_000).for_each(|number| hub.publish(&frame(number)));
        let (history, _) = hub.join().unwrap();
        assert!((MOST_HISTORY / 2..=MOST_HISTORY).contains(&history.len()), "{}", history.len());
        assert_eq!((history.first(), history.last()), (Some(&frame(0)), Some(&frame(99_999))));
    }
}
