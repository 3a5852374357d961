//! The receiver's hardware as written: sampling, and the clock behind it.

use std::sync::Arc;

use super::ScenarioError;
use super::read::Table;
use crate::generator::clock::ReceiverClock;
use crate::generator::random::Stream;
use crate::generator::ripple::oscillator::{Oscillator, PowerLaw};
use crate::generator::vehicle::Trajectory;
use crate::generator::vehicle::shaking::Shaking;
use crate::gnss::samples::Format;
use crate::gnss::time::Rate;

/// The sampling of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    pub rate: Rate,
    /// Where GPS L1 appears in the samples.
    pub if_hz: f64,
    pub inverted: bool,
    pub format: Format,
    /// The gain, if the scenario sets it.
    pub noise_lsb: Option<f32>,
}

pub(super) fn front_end(table: Option<&Table<'_>>) -> Result<FrontEnd, ScenarioError> {
    let default_rate = Rate::from_hz(2.6e6);
    let Some(table) = table else {
        let rate = default_rate.ok_or_else(|| ScenarioError::Conflict {
            origin: String::new(),
            key: "front_end",
            reason: "no sample rate".to_owned(),
        })?;
        return Ok(FrontEnd { rate, if_hz: 0.0, inverted: false, format: Format::Ci8, noise_lsb: None });
    };
    let rate_hz = table.need("sample_rate_hz")?;
    let rate = Rate::from_hz(rate_hz).ok_or_else(|| table.bad("sample_rate_hz", "a rate"))?;
    let format = match table.text("format")? {
        Some(text) => text.parse().map_err(|_| table.bad("format", "one of ci8, cu8, ci16, cf32, ri8, ri16"))?,
        None => Format::Ci8,
    };
    let half = 0.5 * rate.hz();
    let if_hz = table.need("if_hz")?;
    if format.is_complex() && if_hz.abs() >= half {
        return Err(table.bad("if_hz", format!("less than half of sample_rate_hz in size, {half} Hz")));
    }
    // Above half the rate real samples hold a band folded, as bandpass sampling does; on a multiple of it,
    // one over itself.
    if !format.is_complex() && (if_hz <= 0.0 || (if_hz / half).fract() == 0.0) {
        return Err(table.bad(
            "if_hz",
            format!(
                "more than 0 and no multiple of half of sample_rate_hz, {half} Hz, because format = {format} is real"
            ),
        ));
    }
    Ok(FrontEnd {
        rate,
        if_hz,
        inverted: table.flag("spectrum_inverted")?.unwrap_or(false),
        format,
        noise_lsb: table.number("noise_lsb")?.map(|x| x as f32),
    })
}

/// The receiver's clock as written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockSpec {
    pub bias_s: f64,
    pub drift: f64,
    pub ageing_per_s: f64,
    /// Fractional frequency a g of acceleration.
    pub per_g: f64,
    pub noise: Option<PowerLaw>,
}

impl ClockSpec {
    /// The clock of a scene with samples at `rate` and an antenna on `trajectory`.
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
