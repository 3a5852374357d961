//! Rays of a satellite as channels follow them: where the code loop rests, and the carrier of their sum.
//!
//! E, P and L are the sums over the rays of amplitude, phase and correlation at the replica and half a
//! spacing to either side. A loop of early minus late power rests where |E|² = |L|², one of the dot product
//! where Re((E−L)·P*) = 0 (Braasch, in Global Positioning System: Theory and Applications I, 1996). Limits:
//! the loop's answer to rays whose phases turn is that of a low pass behind the position of rest.

use generator::scene::Scene;
use generator::transmit::{RayAt, Rays, Transmitter};
use num_complex::Complex64;
use receiver::track::CodeDiscriminator;

use super::law::Law;
use super::oscillator::{OscillatorError, OscillatorLoop};

/// Halvings of the interval in which a loop rests.
const HALVINGS: u32 = 28;
/// Samples on either side of an instant over which rates are taken, in seconds.
const RATE_S: f64 = 2e-3;

/// The rays of a satellite's signal at one instant.
pub(super) struct Sight {
    /// Delay of the first ray in seconds.
    pub delay_s: f64,
    /// Carrier of the first ray in cycles, without a whole number of its polynomial.
    pub carrier_cycles: f64,
    /// Rate of the first ray's carrier, in cycles a second.
    pub rate_hz: f64,
    /// Cycles by which the phase loop lags behind the motion and the oscillator.
    pub lag_cycles: f64,
    /// Seconds by which it lags behind the oscillator: the code's replica runs with the carrier's.
    pub oscillator_lag_s: f64,
    /// Amplitude of each ray in the root of its C/N0, its carrier's phasor against the first one's, and its
    /// delay behind that in chips.
    rays: Vec<(Complex64, f64)>,
}

impl Sight {
    /// Rays at an instant `later_s` before sample `own` of the front end; `None` where the satellite is not
    /// received.
    pub fn new(
        (scene, transmitter, law): (&Scene, &Transmitter, &Law),
        oscillator: Option<&OscillatorLoop>,
        (own, later_s): (u64, f64),
    ) -> Option<Self> {
        let calm =
            Calm { rays: transmitter.rays(scene, own)?, carrier_hz: transmitter.link().carrier_hz(), oscillator };
        let rays = &calm.rays;
        let rate_hz = scene.clock.rate.hz();
        let first = rays.at(0, own)?;
        let (delay_rate, calm_hz) = calm.rates(own, rate_hz)?;
        let error = oscillator.map_or_else(OscillatorError::default, |oscillator| oscillator.at(own));
        let carrier_hz = calm_hz + calm.carrier_hz * error.rate;
        let lag_cycles = if scene.trajectory.is_static() { 0.0 } else { calm.lag_cycles(law, (own, rate_hz)) };
        let one = |ray: RayAt| {
            let cycles = ray.carrier_cycles - first.carrier_cycles;
            let (sin, cos) = libm::sincos(-std::f64::consts::TAU * (cycles - cycles.floor()));
            let chips = (ray.delay_s - first.delay_s) * law.component.chip_rate_hz;
            (Complex64::new(cos, sin) * ray.cn0_hz.sqrt(), chips)
        };
        Some(Self {
            delay_s: first.delay_s - delay_rate * later_s,
            carrier_cycles: first.carrier_cycles - carrier_hz * later_s,
            rate_hz: carrier_hz,
            lag_cycles: lag_cycles + calm.carrier_hz * error.lag_s,
            oscillator_lag_s: error.lag_s,
            rays: (0..rays.count()).filter_map(|number| rays.at(number, own)).map(one).collect(),
        })
    }

    /// True if other rays than the first one arrive.
    pub fn is_reflected(&self) -> bool {
        self.rays.iter().skip(1).any(|(amplitude, _)| amplitude.norm_sqr() > 0.0)
    }

    /// Sum of the rays at a replica so many chips behind the first ray.
    pub fn sum(&self, law: &Law, chips: f64) -> Complex64 {
        self.rays.iter().map(|(amplitude, excess)| amplitude * law.found.value(chips - excess)).sum()
    }

    /// Position in chips behind the first ray at which the code loop rests.
    pub fn rest_chips(&self, law: &Law) -> f64 {
        let spacing = law.spacing_chips;
        let pair = |at: f64, apart: f64| [-0.5, 0.5].map(|side| self.sum(law, at + side * apart * spacing));
        let late = |at: f64| match law.code.discriminator {
            CodeDiscriminator::EarlyMinusLate => {
                let [early, late] = pair(at, 1.0);
                early.norm_sqr() > late.norm_sqr()
            }
            product @ (CodeDiscriminator::DotProduct | CodeDiscriminator::DoubleDelta) => {
                let difference = |(apart, weight): &(f64, f64)| {
                    let [early, late] = pair(at, *apart);
                    (early - late) * weight
                };
                let all: Complex64 = product.pairs().iter().map(difference).sum();
                (all * self.sum(law, at).conj()).re > 0.0
            }
        };
        let (mut low, mut high) = (-0.5 * spacing, spacing.min(law.reach_chips - 0.5 * spacing));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if late(middle) { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }
}

/// Carrier of a first ray without the oscillator's quick noise.
struct Calm<'a> {
    rays: Rays<'a>,
    carrier_hz: f64,
    oscillator: Option<&'a OscillatorLoop>,
}

impl Calm<'_> {
    fn carrier_cycles(&self, sample: u64) -> Option<f64> {
        let noise_s = self.oscillator.map_or(0.0, |oscillator| oscillator.noise_s(sample));
        Some(self.rays.at(0, sample)?.carrier_cycles - self.carrier_hz * noise_s)
    }

    /// Rates of the delay, and of the carrier in cycles a second.
    fn rates(&self, sample: u64, rate_hz: f64) -> Option<(f64, f64)> {
        let span = ((RATE_S * rate_hz) as u64).max(1);
        let (before, after) = (sample.saturating_sub(span), sample + span);
        let seconds = (after - before) as f64 / rate_hz;
        let delay_s = self.rays.at(0, after)?.delay_s - self.rays.at(0, before)?.delay_s;
        let cycles = self.carrier_cycles(after)? - self.carrier_cycles(before)?;
        Some((delay_s / seconds, cycles / seconds))
    }

    /// Lag of the phase loop behind the motion of the last quarters of its bandwidth's inverse.
    fn lag_cycles(&self, law: &Law, (sample, rate_hz): (u64, f64)) -> f64 {
        let span = ((0.25 / law.tracking.pll_bandwidth_hz * rate_hz) as u64).max(1);
        let at = |count: u64| self.carrier_cycles(sample.saturating_sub(count * span));
        let [Some(a), Some(b), Some(c), Some(d)] = [0, 1, 2, 3].map(at) else { return 0.0 };
        let seconds = span as f64 / rate_hz;
        let acceleration = (a - 2.0 * b + c) / (seconds * seconds);
        let jerk = (a - 3.0 * b + 3.0 * c - d) / (seconds * seconds * seconds);
        law.lag_cycles(acceleration, jerk)
    }
}
