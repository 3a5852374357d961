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
    /// Cycles by which the phase loop lags behind the motion.
    pub lag_cycles: f64,
    /// Amplitude of each ray in the root of its C/N0, its carrier's phasor against the first one's, and its
    /// delay behind that in chips.
    rays: Vec<(Complex64, f64)>,
}

impl Sight {
    /// Rays at an instant `later_s` before sample `own` of the front end; `None` where the satellite is not
    /// received.
    pub fn new(scene: &Scene, transmitter: &Transmitter, law: &Law, (own, later_s): (u64, f64)) -> Option<Self> {
        let rays = transmitter.rays(scene, own)?;
        let rate_hz = scene.clock.rate.hz();
        let first = rays.at(0, own)?;
        let (delay_rate, carrier_hz) = rates(&rays, own, rate_hz)?;
        let lag_cycles = if scene.trajectory.is_static() { 0.0 } else { lag_cycles(&rays, law, (own, rate_hz)) };
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
            lag_cycles,
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

/// Rates of a first ray's delay, and of its carrier in cycles a second.
fn rates(rays: &Rays<'_>, sample: u64, rate_hz: f64) -> Option<(f64, f64)> {
    let span = ((RATE_S * rate_hz) as u64).max(1);
    let before = sample.saturating_sub(span);
    let (a, b) = (rays.at(0, before)?, rays.at(0, sample + span)?);
    let seconds = (sample + span - before) as f64 / rate_hz;
    Some(((b.delay_s - a.delay_s) / seconds, (b.carrier_cycles - a.carrier_cycles) / seconds))
}

/// Lag of the phase loop behind the motion of the last quarters of its bandwidth's inverse.
fn lag_cycles(rays: &Rays<'_>, law: &Law, (sample, rate_hz): (u64, f64)) -> f64 {
    let span = ((0.25 / law.tracking.pll_bandwidth_hz * rate_hz) as u64).max(1);
    let at = |count: u64| rays.at(0, sample.saturating_sub(count * span)).map(|ray| ray.carrier_cycles);
    let [Some(a), Some(b), Some(c), Some(d)] = [0, 1, 2, 3].map(at) else { return 0.0 };
    let seconds = span as f64 / rate_hz;
    let acceleration = (a - 2.0 * b + c) / (seconds * seconds);
    let jerk = (a - 3.0 * b + 3.0 * c - d) / (seconds * seconds * seconds);
    law.lag_cycles(acceleration, jerk)
}
