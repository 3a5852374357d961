//! A sink and the thread that writes to it, at the pace of the machine's clock or of the sink itself.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

use super::account::Handed;
use super::ring::{Block, Ring};
use crate::cli::args::{self, Clock};
use crate::cli::error::CliError;
use crate::cli::platform::LOOK;
use crate::cli::scenario;
use crate::cli::sink::{Sink, Spec};
use gnss::time::Rate;

/// Blocks that a ring holds at most, however short ticks are.
const MOST_BLOCKS: usize = 4096;
/// A write that takes so much longer than its samples is a stall.
const STALL: Duration = Duration::from_millis(100);
/// Time by which the first tick is made earlier, to fill tables. It does not count in any age.
const WARM_UP: Duration = Duration::from_millis(250);
/// Stack of the thread.
const STACK_BYTES: usize = 1 << 19;

/// Times at which samples are made and handed over.
#[derive(Clone, Copy)]
pub struct Pace {
    clock: Clock,
    rate: Rate,
    /// Earliest time at which sample 0 is handed over.
    start: Instant,
    ahead: Duration,
    /// Time for which the first sink waits for a client in place of one that left.
    reconnect: Duration,
}

impl Pace {
    /// Pace by the arguments; sample 0 is at `at`, where that is given.
    pub fn new(arguments: &args::Live, rate: Rate, at: Option<SystemTime>) -> Self {
        let ahead = Duration::from_secs_f64(arguments.latency * 1e-3);
        let now = Instant::now();
        let wait = at.and_then(|at| at.duration_since(SystemTime::now()).ok());
        let least = ahead + WARM_UP;
        let start = now + wait.unwrap_or(least).max(least);
        let reconnect = Duration::from_secs(arguments.reconnect);
        Self { clock: arguments.clock, rate, start, ahead, reconnect }
    }

    /// Time at which a sample is due by the machine's clock.
    fn due(&self, sample: u64) -> Instant {
        self.start + Duration::from_secs_f64(self.rate.elapsed_s(sample))
    }

    /// Time until the tick that begins with a sample has to be made.
    pub fn until_made(&self, first: u64) -> Duration {
        let at = match (first, self.clock) {
            (0, _) => self.start - self.ahead - WARM_UP,
            (_, Clock::Host) => self.due(first) - self.ahead,
            (_, Clock::Sink | Clock::Free) => return Duration::ZERO,
        };
        at.saturating_duration_since(Instant::now())
    }

    /// Blocks in a ring: those that the latency holds, and by the machine's clock the one being made.
    fn blocks(&self, tick_s: f64) -> usize {
        let held = (self.ahead.as_secs_f64() / tick_s).ceil() as usize;
        (held + usize::from(self.clock == Clock::Host)).clamp(1, MOST_BLOCKS)
    }
}

/// A sink at work.
pub struct Output {
    pub ring: Arc<Ring>,
    name: String,
    handed: Arc<Mutex<Handed>>,
    thread: JoinHandle<io::Result<()>>,
}

impl Output {
    /// Starts to write what comes into the ring; the sink of number 0 is the one that counts.
    pub fn begin(
        (number, spec): (usize, &Spec),
        sink: Box<dyn Sink>,
        pace: Pace,
        tick_s: f64,
    ) -> Result<Self, CliError> {
        let ring = Arc::new(Ring::new(pace.blocks(tick_s)));
        let handed = Arc::new(Mutex::default());
        let (name, first) = (spec.to_string(), number == 0);
        let work =
            Work { ring: Arc::clone(&ring), handed: Arc::clone(&handed), pace, tick_s, first, name: name.clone() };
        let thread = thread::Builder::new().name(format!("sink {number}")).stack_size(STACK_BYTES);
        let thread = thread.spawn(move || work.run(sink));
        let thread = thread.map_err(|error| CliError::passing(format!("cannot start a thread: {error}")))?;
        Ok(Self { ring, name, handed, thread })
    }

    /// True if the output is complete or failed, and takes nothing any more.
    pub fn is_done(&self) -> bool {
        self.thread.is_finished()
    }

    /// Looks at what was handed over.
    pub fn with<T>(&self, look: impl FnOnce(&Handed) -> T) -> T {
        look(&self.handed.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Error of the output; `None` while it is still at work.
    pub fn failure(self) -> Option<CliError> {
        if !self.thread.is_finished() {
            return None;
        }
        match self.thread.join() {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(CliError::output(self.name, &error)),
            Err(_) => Some(CliError::bug("see above")),
        }
    }
}

struct Work {
    ring: Arc<Ring>,
    handed: Arc<Mutex<Handed>>,
    pace: Pace,
    tick_s: f64,
    first: bool,
    name: String,
}

impl Work {
    fn run(self, mut sink: Box<dyn Sink>) -> io::Result<()> {
        while let Some((block, dry)) = self.ring.take() {
            let written = self.write(sink.as_mut(), &block, dry);
            let written = written.or_else(|left| self.reconnect(sink.as_mut(), left));
            if written.is_err() {
                self.ring.leave();
                return written;
            }
        }
        sink.finish()
    }

    /// Waits for another client after one that `left`, with an error, and drops what is made meanwhile. Only
    /// where the first sink sets the pace, the scene waits too.
    fn reconnect(&self, sink: &mut dyn Sink, left: io::Error) -> io::Result<()> {
        if !sink.is_returning() || self.pace.reconnect.is_zero() {
            return Err(left);
        }
        let (since, waits) = (Instant::now(), self.first && self.pace.clock != Clock::Host);
        let meanwhile = if waits { "the scene waits" } else { "samples are lost" };
        scenario::warn(&format!("{}: {left}: {meanwhile} until another one comes", self.name));
        // The block that was under way is lost with its client.
        self.lose(1, 1);
        // One that left before it was greeted is none.
        while !sink.again(LOOK).unwrap_or(false) {
            let is_over = self.first && since.elapsed() > self.pace.reconnect;
            if is_over || self.ring.has_ended() {
                return Err(left);
            }
            if !waits {
                self.lose(0, self.ring.clear());
            }
        }
        let mut handed = self.handed.lock().unwrap_or_else(PoisonError::into_inner);
        // Rate and shortage are those of the new client.
        handed.since = Instant::now().checked_sub(Duration::from_secs_f64(self.pace.rate.elapsed_s(handed.samples)));
        Ok(())
    }

    /// Counts clients that left and blocks that were lost by that.
    fn lose(&self, clients: u64, blocks: u64) {
        let mut handed = self.handed.lock().unwrap_or_else(PoisonError::into_inner);
        handed.clients_left += clients;
        handed.lost_blocks += blocks;
    }

    fn write(&self, sink: &mut dyn Sink, block: &Block, dry: bool) -> io::Result<()> {
        let host = self.pace.clock == Clock::Host;
        if host || block.first == 0 {
            thread::sleep(self.pace.due(block.first).saturating_duration_since(Instant::now()));
        }
        let now = Instant::now();
        if self.first {
            let mut handed = self.handed.lock().unwrap_or_else(PoisonError::into_inner);
            let since = *handed.since.get_or_insert(now);
            // By the machine's clock a block is late when its time is over by a tick; a sink that found none
            // has starved if it has had less than the time that passed.
            let behind = |than: Instant| now.saturating_duration_since(than);
            let late = match self.pace.clock {
                Clock::Host => behind(self.pace.due(block.first)).as_secs_f64() > self.tick_s,
                Clock::Sink => dry && behind(since).as_secs_f64() > self.pace.rate.elapsed_s(handed.samples),
                Clock::Free => false,
            };
            handed.underruns += u64::from(late && block.first > 0);
            if let Some(arrived) = block.shows.filter(|_| block.first > 0) {
                handed.ages.add(now.saturating_duration_since(arrived));
            }
        }
        sink.write(&block.bytes)?;
        if self.first {
            let after = Instant::now();
            let mut handed = self.handed.lock().unwrap_or_else(PoisonError::into_inner);
            let took = after - now;
            handed.stalls += u64::from(took > STALL + Duration::from_secs_f64(self.tick_s));
            handed.longest_write = handed.longest_write.max(took);
            handed.samples = block.first + (self.tick_s * self.pace.rate.hz()).round() as u64;
            handed.until = Some(after);
        }
        Ok(())
    }
}
