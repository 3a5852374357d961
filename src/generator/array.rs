//! Element of an array: what one of several antennas on a body receives, against the wave at its position.
//!
//! Elements share the body, its clock and its sky; their positions are lever arms, and the geometry of each
//! is its own. Here is what the geometry does not have: errors of an element's channel (phase and delay),
//! and the mutual coupling of the antennas, a matrix that acts on the waves before the noise of the
//! amplifiers. With plane waves, element k receives `Σ C_kj exp(i 2π f/c u·(l_j − l_k))` times its own wave,
//! u the direction towards the source and l the lever arms (van Trees 2002, section 2.2 for the phases).
//! Limits: coupling has neither delay nor frequency; a delay turns the carrier as a cable at radio frequency
//! does.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::Vector3;
use num_complex::Complex64;

use crate::ray::{Effect, Ray, Sight};
use crate::vehicle::Trajectory;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Channel and coupling of one element.
#[derive(Clone, Debug)]
pub struct Element {
    /// Number of the element, from 0.
    pub number: usize,
    /// Scene's start, from which the body's time counts.
    pub start: Epoch,
    /// Motion of the body.
    pub body: Trajectory,
    /// Lever arms of all elements in body axes, in metres.
    pub lever_arms_m: Arc<[Vector3<f64>]>,
    /// Row of the coupling matrix; empty without coupling.
    pub coupling: Vec<Complex64>,
    /// Gain of the channel as a factor on amplitudes, which its noise has too. It is part of the samples'
    /// gain.
    pub gain: f64,
    /// Phase by which the channel is ahead, in cycles.
    pub phase_cycles: f64,
    /// Delay of the channel in seconds.
    pub delay_s: f64,
}

impl Element {
    /// True if the channel has no error and its antenna no coupling.
    pub fn is_ideal(&self) -> bool {
        self.coupling.is_empty() && self.phase_cycles == 0.0 && self.delay_s == 0.0
    }

    /// Factor on the power, and phase ahead in cycles, of a wave of `carrier_hz` that comes from direction
    /// `towards` (a unit vector in ECEF) `t_s` true seconds after the scene's start. The delay is not in it.
    pub fn response(&self, towards: &Vector3<f64>, t_s: f64, carrier_hz: f64) -> (f64, f64) {
        let (Some(axes), Some(own), Some(itself)) = (
            self.body.orientation(t_s),
            self.lever_arms_m.get(self.number),
            self.coupling.get(self.number).filter(|itself| itself.norm_sqr() > 0.0),
        ) else {
            return (1.0, self.phase_cycles);
        };
        let towards = axes.axes().inverse() * towards;
        let sum = self.coupling.iter().zip(self.lever_arms_m.iter()).fold(Complex64::ZERO, |sum, (factor, arm)| {
            let ahead_cycles = carrier_hz / SPEED_OF_LIGHT_MPS * towards.dot(&(arm - own));
            let (sin, cos) = libm::sincos(TAU * ahead_cycles);
            sum + factor * Complex64::new(cos, sin)
        });
        // The diagonal outweighs the rest of its row, so the ratio's phase never wraps.
        let ratio = sum / itself;
        let cycles = |x: Complex64| libm::atan2(x.im, x.re) / TAU;
        (sum.norm_sqr(), self.phase_cycles + cycles(ratio) + cycles(*itself))
    }
}

impl Effect for Element {
    fn name(&self) -> &'static str {
        "array"
    }

    fn describe(&self) -> String {
        let coupled = if self.coupling.is_empty() { "" } else { ", coupled with the others" };
        let (phase_deg, delay_ns) = (360.0 * self.phase_cycles, 1e9 * self.delay_s);
        format!("element {} of {}: {phase_deg} deg, {delay_ns} ns{coupled}", self.number + 1, self.lever_arms_m.len())
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let towards = (sight.satellite.position_m - sight.user_m) / sight.range_m;
        let t_s = sight.received.since(self.start);
        let (power, ahead_cycles) = self.response(&towards, t_s, signal.carrier_hz(sight.sv));
        for ray in rays {
            ray.cn0_hz *= power;
            ray.phase_cycles -= planted!("generator.array.phase", ahead_cycles, -ahead_cycles);
            ray.code_delay_s += self.delay_s;
            ray.carrier_delay_s += self.delay_s;
        }
    }
}
