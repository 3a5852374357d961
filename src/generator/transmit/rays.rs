//! Rays of a signal at single samples, for models that need no samples.
//!
//! Polynomials, fast phases, symbols and secondary codes are those from which samples are made; [`super`]
//! prepares them.

use super::Transmitter;
use crate::knots::Part;
use crate::scene::Scene;
use crate::synth::chips::CodeTime;
use gnss::signal::{Link, Signal};
use gnss::time::tone_turns;

/// 2^64 as a float.
const TURN: f64 = 18_446_744_073_709_551_616.0;

/// A ray at one sample.
#[derive(Clone, Copy, Debug)]
pub struct RayAt {
    /// Time of the receiver's clock minus the transmission time, by the code, in seconds.
    pub delay_s: f64,
    /// Pseudorange of the carrier in cycles, without a whole number of the part.
    pub carrier_cycles: f64,
    /// Carrier power over noise density of the whole signal, in Hz.
    pub cn0_hz: f64,
}

/// Rays of a signal about one sample.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    of: &'a Transmitter,
    part: &'a Part,
}

impl Transmitter {
    /// Rays about a sample of the prepared segment; `None` where the satellite is not received.
    pub fn rays(&self, scene: &Scene, sample: u64) -> Option<Rays<'_>> {
        let first = self.parts.partition_point(|part| part.end <= sample);
        let part = self.parts.get(first).filter(|part| part.start <= sample)?;
        self.in_view(scene, sample).then_some(Rays { of: self, part })
    }

    /// Satellite and signal.
    pub fn link(&self) -> Link {
        self.signal.link(self.sv)
    }

    /// Sign of a component's code period by message and secondary code, with the number of the component in
    /// the signal.
    pub fn sign(&self, component: usize, period: i64) -> f64 {
        let Some(sent) = self.sent.iter().find(|sent| sent.component == component) else { return 1.0 };
        let negative = self.symbols.negative(sent.data, period).0 ^ sent.spreading.is_overlaid(period);
        if negative { -1.0 } else { 1.0 }
    }

    /// Sign of a component's code period by its message alone.
    pub fn data_sign(&self, component: usize, period: i64) -> f64 {
        let data = self.sent.iter().find(|sent| sent.component == component).and_then(|sent| sent.data);
        if self.symbols.negative(data, period).0 { -1.0 } else { 1.0 }
    }

    /// Signs of a component's code periods from period `first` on, as [`Self::sign`] gives them, into
    /// `signs`.
    pub fn signs(&self, component: usize, first: i64, signs: &mut [f64]) {
        signs.fill(1.0);
        let Some(sent) = self.sent.iter().find(|sent| sent.component == component) else { return };
        let (mut negative, mut end) = (false, i64::MIN);
        for (period, sign) in (first..).zip(signs) {
            if period >= end {
                (negative, end) = self.symbols.negative(sent.data, period);
            }
            if negative ^ sent.spreading.is_overlaid(period) {
                *sign = -1.0;
            }
        }
    }

    /// True if phases or strength have parts that change within milliseconds, beside the polynomials.
    pub fn is_quick(&self) -> bool {
        self.fast.is_there()
    }

    /// First samples of the polynomials of the prepared segment, and the samples after their last ones.
    pub fn spans(&self) -> impl Iterator<Item = (u64, u64)> {
        self.parts.iter().map(|part| (part.start, part.end))
    }

    /// Rays of polynomial number `number` of [`Self::spans`].
    pub fn rays_of(&self, number: usize) -> Option<Rays<'_>> {
        self.parts.get(number).map(|part| Rays { of: self, part })
    }

    /// Position of a component's code at a sample, for a delay.
    pub fn code_at(&self, scene: &Scene, component: usize, sample: u64, delay_s: f64) -> Option<CodePhase> {
        let sent = self.sent.iter().find(|sent| sent.component == component)?;
        let at = sent.spreading.at(self.epoch(scene, sample), delay_s);
        Some(CodePhase { at, share: at.steps() / f64::from(sent.spreading.pace().steps) })
    }

    /// Phase of the carrier of a ray at a sample in 2^-64 turn, and the phase step of the nominal IF, for a
    /// spectrum that is not inverted.
    pub fn turns_at(&self, scene: &Scene, sample: u64, ray: &RayAt) -> (u64, u64) {
        let tone = tone_turns(self.if_hz, scene.clock.rate, sample);
        let cycles = ray.carrier_cycles - ray.carrier_cycles.floor();
        (tone.wrapping_sub((cycles * TURN) as u64), self.tone_step)
    }
}

/// Position of a code.
#[derive(Clone, Copy, Debug)]
pub struct CodePhase {
    /// Whole periods and steps.
    pub at: CodeTime,
    /// Share of the running period that has passed.
    pub share: f64,
}

impl Rays<'_> {
    /// Number of the rays.
    pub fn count(&self) -> usize {
        self.part.paths.len()
    }

    /// Signal of the rays.
    pub fn signal(&self) -> &'static Signal {
        self.of.signal
    }

    /// Carrier power over noise density of all rays at a sample, in Hz, without quick fading.
    pub fn cn0_hz(&self, sample: u64) -> f64 {
        let u = self.part.fraction(sample);
        self.part.paths.iter().map(|path| path.cn0_hz.at(u).max(0.0)).sum()
    }

    /// A ray at a sample. Beyond the end of its polynomial it goes on as there.
    pub fn at(&self, ray: usize, sample: u64) -> Option<RayAt> {
        let (path, u) = (self.part.paths.get(ray)?, self.part.fraction(sample));
        let [fast, _] = self.of.fast.ends(sample, sample);
        Some(RayAt {
            delay_s: path.delay.at(u) + fast.delay_s,
            carrier_cycles: path.carrier.at(u) + fast.carrier_cycles,
            cn0_hz: path.cn0_hz.at(u).max(0.0) * fast.gain * fast.gain,
        })
    }
}
