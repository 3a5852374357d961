//! Lock step: a step of motion in, samples, truth and what the receiver makes of them out, in virtual time.
//!
//! No clock of the machine is asked, so a simulation with the twin in its loop is the same bits again. The
//! receiver is optional. It takes the samples of a step while the next one is made, and works on blocks of
//! its own length: its records come some steps after the samples that they are about, and each says its
//! sample.

use thiserror::Error;

use crate::drive::{Driver, Made};
use generator::event::{Event, EventError};
use generator::scene::Scene;
use generator::stream::{GenerateError, Generated};
use generator::truth;
use generator::vehicle::joining::{Push, Refusal};
use receiver::output;
use receiver::settings::Settings;
use receiver::{Outcome, ReceiveError, Receiver};
use twin::settings_for;

/// Error that prevents a step.
#[derive(Debug, Error)]
pub enum StepError {
    /// The scene's motion is not pushed.
    #[error("the scene's motion is known before: expected [motion] kind = \"pushed\", and a scene not yet driven")]
    NotPushed,
    /// A step after the scene's last sample.
    #[error("the scene is over")]
    Over,
    /// A state that is not taken.
    #[error("a pushed state is refused: {0}")]
    Refused(#[from] Refusal),
    /// An event that is not applied.
    #[error("an event is refused: {0}")]
    Event(#[from] EventError),
    /// The scene cannot be generated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// The samples cannot be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
}

/// Results of a step.
#[derive(Clone, Debug)]
pub struct Step {
    /// The tick that was made, with the motion at its end.
    pub made: Made,
    /// Truth records of the step's samples.
    pub truth: Vec<truth::Record>,
    /// Records of the receiver during the step.
    pub received: Vec<output::Record>,
}

/// Results at the end.
#[derive(Clone, Debug)]
pub struct Finished {
    /// Result of the generator.
    pub generated: Generated,
    /// The receiver's last records.
    pub received: Vec<output::Record>,
    /// Outcome of the reception.
    pub outcome: Option<Outcome>,
}

/// Generator and receiver in step with a simulation.
pub struct Lockstep<'a> {
    driver: Driver<'a>,
    receiver: Option<Receiver>,
    /// Samples of the last step; the receiver has taken those before.
    samples: Vec<u8>,
    /// Samples of the current step.
    next: Vec<u8>,
}

impl<'a> Lockstep<'a> {
    /// The scene from its first sample on, received with `settings` where there are any.
    ///
    /// # Errors
    /// A scene whose motion is known before, and what generator and receiver refuse.
    pub fn new(scene: &'a Scene, settings: Option<&Settings>) -> Result<Self, StepError> {
        let driver = Driver::new(scene, &mut ())?;
        if !driver.is_pushed() {
            return Err(StepError::NotPushed);
        }
        let own = |settings| settings_for(std::slice::from_ref(scene), settings);
        let receiver = settings.map(|settings| Receiver::new(&scene.metadata, &own(settings))).transpose()?;
        Ok(Self { driver, receiver, samples: Vec::new(), next: Vec::new() })
    }

    /// True seconds since the scene's start at the end of the next step: the time of the state to push.
    pub fn next_s(&self) -> f64 {
        self.driver.scene().elapsed_s((self.driver.next_tick() + 1) * self.driver.tick_samples())
    }

    /// True if the scene's last sample was made.
    pub fn is_done(&self) -> bool {
        self.driver.is_done()
    }

    /// Samples of the last step, as the scene's metadata describe them.
    pub fn samples(&self) -> &[u8] {
        &self.samples
    }

    /// Applies an event from the next step on; its first sample.
    ///
    /// # Errors
    /// Reason for which it is not applied.
    pub fn switch(&mut self, event: &Event) -> Result<u64, StepError> {
        Ok(self.driver.switch(event)?)
    }

    /// Makes the next step with what is pushed of the motion.
    ///
    /// # Errors
    /// Reason for which it is not made.
    pub fn step(&mut self, push: Option<&Push>) -> Result<Step, StepError> {
        if let Some(push) = push {
            self.driver.offer(push)?;
        }
        let mut truth = Vec::new();
        if self.driver.is_done() {
            return Err(StepError::Over);
        }
        let Self { driver, receiver, samples, next } = self;
        let (made, received) = rayon::join(
            || driver.tick(&mut truth, next),
            || receiver.as_mut().map_or(Ok(Vec::new()), |receiver| receiver.push(samples)),
        );
        let (made, received) = (made?.ok_or(StepError::Over)?, received?);
        std::mem::swap(samples, next);
        Ok(Step { made, truth, received })
    }

    /// Ends the run, and gives `truth` what is known at the end alone.
    ///
    /// # Errors
    /// Errors of [`Self::step`].
    pub fn finish(self, truth: &mut dyn truth::Sink) -> Result<Finished, StepError> {
        let generated = self.driver.finish(truth)?;
        let Some(mut receiver) = self.receiver else {
            return Ok(Finished { generated, received: Vec::new(), outcome: None });
        };
        let mut received = receiver.push(&self.samples)?;
        let (rest, outcome) = receiver.finish()?;
        received.extend(rest);
        Ok(Finished { generated, received, outcome: Some(outcome) })
    }
}
