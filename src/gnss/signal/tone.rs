//! Components that are one sideband of a subcarrier: their pulses turn the phase in one direction, step by
//! step.
//!
//! A square wave has the lines of both sides in equal parts, half its power each at most. Pulses at right
//! angles may leave one side alone, as those of AltBOC do: the phase turns by an eighth of a cycle from step
//! to step. The line then has most of the power, and what is left are lines that lie as many steps away.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::{Component, Layer, Shape, Signal, shape};

/// Spectral line of a component that is one sideband of a subcarrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Number of half cycles in a chip, negative below the carrier. If it is odd, the sign changes from chip
    /// to chip where the pulses begin again.
    pub half_cycles: i32,
    /// Amplitude and phase of the line at a chip's beginning, relative to the component's.
    pub gain: Complex64,
}

/// Share of the power above which a line is the only strong one.
const MOST: f64 = 0.5;

impl Component {
    /// Line with most of the component's power, if it is not at the carrier. `None` if the pulses do not turn
    /// the phase, or are not on every chip.
    pub fn tone(&self) -> Option<Tone> {
        let phase = self.layers.first()?.phase_cycles;
        let is_real = self.layers.iter().all(|layer| (2.0 * (layer.phase_cycles - phase)).fract() == 0.0);
        if is_real || self.layers.iter().any(|layer| !layer.chips.is_empty()) {
            return None;
        }
        let wave = shape::chip(self.layers, 0, self.steps_per_chip());
        let reach = wave.len() as i32;
        let lines = (-reach..=reach).map(|half_cycles| Tone { half_cycles, gain: line(&wave, half_cycles) });
        lines.into_iter().find(|tone| tone.gain.norm_sqr() > MOST && tone.half_cycles != 0)
    }

    /// Frequency of the spectrum's middle relative to the carrier, in Hz.
    pub fn side_hz(&self) -> f64 {
        self.tone().map_or(0.0, |tone| tone.side_hz(self.chip_rate_hz))
    }
}

impl Signal {
    /// Distance in Hz of the subcarrier's sidebands from the carrier; 0 without a subcarrier.
    pub fn sides_hz(&self) -> f64 {
        self.components.iter().map(|component| component.side_hz().abs()).fold(0.0, f64::max)
    }

    /// True if another signal is one of this signal's sidebands, received alone. A satellite that sends this
    /// signal also sends that one.
    pub fn has_side(&self, other: &Self) -> bool {
        let sides = self.components.iter().map(Component::side_hz).filter(|side_hz| *side_hz != 0.0);
        let at = |hz: f64| (self.centre_hz() + hz - other.centre_hz()).abs() < 1.0;
        self.system == other.system && sides.into_iter().any(at)
    }
}

impl Tone {
    /// The line's distance from the carrier, in Hz.
    pub fn side_hz(&self, chip_rate_hz: f64) -> f64 {
        0.5 * f64::from(self.half_cycles) * chip_rate_hz
    }

    /// True if both lines are opposite sidebands of one subcarrier.
    pub fn is_opposite(&self, other: &Self) -> bool {
        self.half_cycles == -other.half_cycles
    }

    /// Correlation of a component's chips with those of a replica that has the line alone, and correlation of
    /// the replica with itself.
    pub fn shapes(&self, chip_rate_hz: f64) -> [Shape; 2] {
        [self.gain.norm(), 1.0].map(|weight| {
            let found = [Layer { weight, ..Layer::BPSK }];
            Shape::between(&found, &[Layer::BPSK], chip_rate_hz)
        })
    }

    /// Correlation of both sidebands together at a delay of `chips`, relative to that of chips without a
    /// subcarrier.
    pub fn both_sides(&self, chips: f64) -> f64 {
        libm::cos(PI * f64::from(self.half_cycles) * chips)
    }

    /// The slope of [`Self::both_sides`], a chip.
    pub fn slope_of_both(&self, chips: f64) -> f64 {
        let rad_per_chip = PI * f64::from(self.half_cycles);
        -rad_per_chip * libm::sin(rad_per_chip * chips)
    }
}

/// A Fourier coefficient of equal steps of a chip: the mean of each times the turned phase, exactly.
fn line(wave: &[Complex64], half_cycles: i32) -> Complex64 {
    let length = wave.len().max(1) as f64;
    let step_cycles = 0.5 * f64::from(half_cycles) / length;
    let within = if half_cycles == 0 { 1.0 } else { libm::sin(PI * step_cycles) / (PI * step_cycles) };
    let turned = |(step, value): (usize, &Complex64)| {
        let (sin, cos) = libm::sincos(-TAU * step_cycles * (step as f64 + 0.5));
        value * Complex64::new(cos, sin)
    };
    wave.iter().enumerate().map(turned).sum::<Complex64>() * (within / length)
}

#[cfg(test)]
mod tests {
    use super::super::{Layer, SIGNALS};
    use super::*;
    use crate::galileo::altboc::E5;
    use crate::signal::synthetic::{SIDES, SYNTHETIC};

    #[test]
    fn pulses_that_turn_an_eighth_a_step_have_one_line_with_the_power_of_eight_steps() {
        // (sin(π/8) / (π/8))²: what is left of a tone that is held for an eighth of its cycle.
        let eighth = libm::pow(libm::sin(PI / 8.0) / (PI / 8.0), 2.0);
        for (component, half_cycles) in E5.components.iter().zip([3, 3, -3, -3]) {
            let tone = component.tone().unwrap();
            assert_eq!(tone.half_cycles, half_cycles);
            assert!((tone.gain.norm_sqr() - eighth).abs() < 1e-12 && tone.gain.im.abs() < 1e-12, "{tone:?}");
            assert!((component.side_hz() - 5.115e6 * f64::from(half_cycles)).abs() < 1e-3);
        }
        assert!((E5.sides_hz() - 15.345e6).abs() < 1e-3);
        let [upper, _, lower, _] = E5.components else { panic!("four components") };
        assert!(upper.tone().unwrap().is_opposite(&lower.tone().unwrap()));
    }

    #[test]
    fn no_other_signal_has_a_side_alone() {
        let others = SIGNALS.into_iter().chain(SYNTHETIC).filter(|signal| ![&E5, &SIDES].contains(signal));
        for component in others.flat_map(|signal| signal.components) {
            assert_eq!(component.tone(), None);
        }
        // A square wave has both sides, whatever its phase.
        let square = Component { layers: &[Layer { phase_cycles: 0.2, ..Layer::BOC11 }], ..E5.components[0] };
        assert_eq!(square.tone(), None);
    }
}
