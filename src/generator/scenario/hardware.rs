//! The receiver's clock as written, and the noise of oscillators.

use std::sync::Arc;

use super::ScenarioError;
use super::read::Table;
use crate::clock::ReceiverClock;
use crate::clock::oscillator::{Oscillator, PowerLaw};
use crate::random::Stream;
use crate::vehicle::Trajectory;
use crate::vehicle::shaking::Shaking;
use gnss::time::Rate;

/// Receiver's clock as written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockSpec {
    /// Clock minus GPS time at the scene's start, in seconds.
    pub bias_s: f64,
    /// Gain at the start, in seconds per second.
    pub drift: f64,
    /// Growth of the drift per second, in 1/s.
    pub ageing_per_s: f64,
    /// Fractional frequency shift for 1 g of acceleration.
    pub per_g: f64,
    /// Noise of the oscillator; absent means none.
    pub noise: Option<PowerLaw>,
}

impl ClockSpec {
    /// The clock of a scene whose noise is drawn at nodes of `rate`, with an antenna on `trajectory`.
    pub(super) fn clock(&self, seed: u64, rate: Rate, trajectory: &Trajectory) -> ReceiverClock {
        let oscillator = |law| Arc::new(Oscillator::new(law, rate, Stream::new(seed, "receiver clock")));
        let shaken = self.per_g != 0.0 && !trajectory.is_static();
        ReceiverClock {
            bias_s: self.bias_s,
            drift: self.drift,
            ageing_per_s: self.ageing_per_s,
            shaking: shaken.then(|| Arc::new(Shaking::new(self.per_g, trajectory.clone()))),
            oscillator: self.noise.map(oscillator),
        }
    }
}

/// An oscillator's noise by `oscillator` or `power_law`.
pub(super) fn power_law(table: &Table<'_>) -> Result<Option<PowerLaw>, ScenarioError> {
    let preset = table.choice("oscillator", &PowerLaw::PRESETS)?;
    match (preset, table.numbers("power_law")?) {
        (Some(_), Some(_)) => Err(table.bad("power_law", "nothing beside oscillator, which names a power law")),
        (preset, None) => Ok(preset),
        (None, Some(h)) if h.iter().all(|level| *level >= 0.0) && h.iter().any(|level| *level > 0.0) => {
            let [h2, h1, h0, hm1, hm2] = h;
            Ok(Some(PowerLaw { h2, h1, h0, hm1, hm2 }))
        }
        (None, Some(_)) => Err(table.bad("power_law", "levels [h2, h1, h0, h-1, h-2], none negative, not all zero")),
    }
}

const DAY_S: f64 = 86_400.0;

pub(super) fn receiver_clock(table: Option<&Table<'_>>) -> Result<ClockSpec, ScenarioError> {
    let Some(table) = table else { return Ok(ClockSpec::default()) };
    let noise = power_law(table)?;
    Ok(ClockSpec {
        bias_s: table.need("bias_s")?,
        drift: table.need("drift_sps")?,
        ageing_per_s: table.need("ageing_per_day")? / DAY_S,
        per_g: table.need("sensitivity_per_g")?,
        noise,
    })
}
