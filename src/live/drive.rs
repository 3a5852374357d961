//! A scene tick by tick: pushed states and events in, samples and their truth out.
//!
//! [`Driver`] knows no clock. A tick is made of what was offered before it; what it became is returned with
//! it. A scene whose motion is known before goes out in ticks too, and takes neither states nor events.
//! Limits: one front end.

use generator::event::{Event, EventError};
use generator::scene::Scene;
use generator::stream::{GenerateError, Generated, Options, Stream};
use generator::synth::RUN_SAMPLES;
use generator::truth;
use generator::vehicle::Knot;
use generator::vehicle::joining::{Joiner, Push, Refusal, Tick};

/// A scene on its way to samples.
pub struct Driver<'a> {
    scene: &'a Scene,
    stream: Stream<'a>,
    /// Joiner of the pushed motion; `None` where motion is not pushed.
    joiner: Option<Joiner>,
    tick_samples: u64,
    /// Ticks made.
    ticks: u64,
}

/// A tick that was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Made {
    /// Number of the tick, from 0.
    pub number: u64,
    /// First sample of it, and the sample after its last one. The last tick of a scene may go on beyond the
    /// scene's samples.
    pub samples: (u64, u64),
    /// Tick of the motion, where motion is pushed.
    pub tick: Option<Tick>,
}

/// Length of a tick of a scene whose motion is known before.
const TICK_S: f64 = 0.01;

impl<'a> Driver<'a> {
    /// The scene from its first sample on.
    ///
    /// # Errors
    /// Errors of [`Stream::new`].
    pub fn new(scene: &'a Scene, truth: &mut dyn truth::Sink) -> Result<Self, GenerateError> {
        // Ticks that are there already are those of a record.
        let grown = scene.trajectory.grown().filter(|grown| grown.ticks() == 0);
        let rate_hz = scene.clock.rate.hz();
        let joiner = grown.and_then(|grown| {
            let joining = grown.joining();
            let tick_s = joining.tick_samples as f64 / rate_hz;
            grown.last().map(|first| Joiner::new(joining, tick_s, first.motion).turning(grown.last_turn()))
        });
        let own = (TICK_S * rate_hz).max(RUN_SAMPLES as f64) as u64;
        let tick_samples = scene.trajectory.tick_samples().unwrap_or(own);
        // Blocks of one tick: a slice for each of two threads.
        let options = Options { block_runs: 4, ..Options::default() };
        Ok(Self { scene, stream: Stream::new(scene, truth, &options)?, joiner, tick_samples, ticks: 0 })
    }

    /// True if the motion is pushed.
    pub fn is_pushed(&self) -> bool {
        self.joiner.is_some()
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Samples of a tick.
    pub fn tick_samples(&self) -> u64 {
        self.tick_samples
    }

    /// Number of the next tick.
    pub fn next_tick(&self) -> u64 {
        self.ticks
    }

    /// True if the scene's last sample was made.
    pub fn is_done(&self) -> bool {
        self.ticks.saturating_mul(self.tick_samples) >= self.scene.samples
    }

    /// Takes a state, and returns its number.
    ///
    /// # Errors
    /// Reason for which it is not taken.
    pub fn offer(&mut self, push: &Push) -> Result<u64, Refusal> {
        self.joiner.as_mut().map_or(Err(Refusal::Known), |joiner| joiner.offer(push))
    }

    /// Applies an event from the next tick on; its first sample.
    ///
    /// # Errors
    /// Reason for which it is not applied.
    pub fn switch(&mut self, event: &Event) -> Result<u64, EventError> {
        if self.joiner.is_none() {
            return Err(EventError::Known);
        }
        event.apply(self.scene, self.ticks).map(|()| self.ticks * self.tick_samples)
    }

    /// Makes the next tick: replaces what `packed` holds by its samples, and gives `truth` what is true of
    /// them. `None` after the last one.
    ///
    /// # Errors
    /// Errors of the generator.
    pub fn tick(&mut self, truth: &mut dyn truth::Sink, packed: &mut Vec<u8>) -> Result<Option<Made>, GenerateError> {
        if self.is_done() {
            packed.clear();
            return Ok(None);
        }
        let number = self.ticks;
        let (first, end) = (number * self.tick_samples, (number + 1) * self.tick_samples);
        let (from_s, to_s) = (self.scene.elapsed_s(first), self.scene.elapsed_s(end));
        let tick = self.joiner.as_mut().map(|joiner| joiner.tick(from_s, to_s));
        if let Some(tick) = tick {
            self.scene.trajectory.append(Knot { t_s: to_s, motion: tick.end }, tick.turn);
        }
        self.ticks += 1;
        self.stream.advance(end, truth, packed)?;
        Ok(Some(Made { number, samples: (first, end), tick }))
    }

    /// Gives `truth` the rest, and reports what was done.
    ///
    /// # Errors
    /// A sink that does not take the truth.
    pub fn finish(self, truth: &mut dyn truth::Sink) -> Result<Generated, GenerateError> {
        self.stream.finish(truth)
    }
}
