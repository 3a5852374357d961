//! A pilot that has been recognised: its secondary code is taken off the prompts, and the data beside it are
//! read.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::supervise::pilot_group;
use super::{Channel, Stage, Symbol};
use crate::correlate::sums::Samples;
use crate::correlate::{Arithmetic, Nco, Replica, TURN, Wave};
use crate::lead::beside;
use crate::track::TrackingSettings;
use crate::track::cn0::Cn0;
use crate::track::model::ReplicaModel;
use crate::track::secondary_code::{SecondaryCodePhase, SecondaryCodeSync};
use gnss::satellite::Sv;
use gnss::signal::{Component, Signal};

/// Data component that is read beside a pilot.
#[derive(Clone, Debug)]
pub(super) struct Data {
    replica: Replica,
    /// Turns its prompts to the phase of the pilot's.
    turn: Complex64,
    /// Deviation of the noise in its correlations over that in the pilot's.
    deviation: f64,
    periods_per_symbol: u64,
    secondary_code: SecondaryCodeSync,
    sum: (Complex64, u64),
}

impl Data {
    /// The data of `signal` beside `pilot`, if they are in periods of the same length.
    pub(super) fn beside(
        pilot: &'static Component,
        (signal, sv): (&'static Signal, Sv),
        settings: &TrackingSettings,
        (rate_hz, sense): (f64, f64),
    ) -> Option<Self> {
        Self::new(beside(pilot, signal)?, pilot, sv.number, settings, (rate_hz, sense))
    }

    /// The data of `component`, whose symbols are whole periods, beside `pilot`.
    pub(super) fn new(
        component: &'static Component,
        pilot: &'static Component,
        number: u8,
        settings: &TrackingSettings,
        (rate_hz, sense): (f64, f64),
    ) -> Option<Self> {
        let model = |component| ReplicaModel::new(settings, component, rate_hz);
        let made = (settings.waveform, settings.replica);
        let replica = Replica::made_in(component, number, made, sense < 0.0)?;
        let share = replica.share() * model(component)?.power;
        let own = Wave::new(pilot, number)?.share * model(pilot)?.power;
        let (sin, cos) = libm::sincos(TAU * sense * (pilot.phase_cycles - component.phase_cycles));
        Some(Self {
            replica,
            turn: Complex64::new(cos, sin),
            deviation: (share / own).sqrt(),
            periods_per_symbol: u64::from(component.periods_per_symbol()?),
            secondary_code: SecondaryCodeSync::new(component.secondary_code.of(number)?),
            sum: (Complex64::ZERO, 0),
        })
    }

    /// Replica of the data component.
    pub(super) fn replica(&self) -> &Replica {
        &self.replica
    }

    /// Correlates the data of code period `number`, which ends before sample `end`, and gives the symbol that
    /// ends with it; `scale` brings the pilot's noise to unit variance a component.
    pub(super) fn read(
        &mut self,
        samples: Samples,
        arithmetic: Arithmetic,
        nco: &Nco,
        (number, phase, end): (u64, SecondaryCodePhase, u64),
        scale: f64,
    ) -> Option<Symbol> {
        let [sum] = self.replica.correlate_in(arithmetic, samples, nco, &[0]);
        let chip = self.secondary_code.chip(phase, number);
        let at = (number + phase.shift) % self.periods_per_symbol;
        if at == 0 {
            self.sum = (Complex64::ZERO, 0);
        }
        self.sum.0 += sum * self.turn * (scale * chip / self.deviation);
        self.sum.1 += 1;
        let whole = at + 1 == self.periods_per_symbol && self.sum.1 == self.periods_per_symbol;
        let soft = (self.sum.0.re / (self.periods_per_symbol as f64).sqrt()) as f32;
        whole.then(|| Symbol { first_period: number + 1 - self.periods_per_symbol, end, soft })
    }
}

impl Channel {
    /// The sign of the secondary code in a code period, or of the code under a bit; one while it is unknown.
    pub(super) fn secondary_code_chip(&self, number: u64) -> f64 {
        match (&self.secondary_code, self.secondary_code_phase, &self.bits, self.bit_begin) {
            (Some(secondary_code), Some(phase), ..) => secondary_code.chip(phase, number),
            (_, _, Some(bits), Some(begin)) => bits.sign(number, begin),
            _ => 1.0,
        }
    }

    /// Looks for the code under bits, and takes it off from their next beginning on: integrations are within
    /// bits then.
    pub(super) fn find_bits(&mut self, number: u64, prompt: Complex64) {
        let (prompt, sought) = (self.whitened(prompt), self.bit_begin.is_none() && self.is_true);
        let Some(bits) = self.bits.as_mut().filter(|_| sought) else { return };
        let Some(begin) = bits.add(number, prompt) else { return };
        self.group = bits.periods();
        self.bit_begin = Some(begin);
        self.cn0 = self.cn0.wiped(self.group);
        (self.previous, self.previous_sum) = (None, None);
        self.enter(Stage::Tracking(begin));
    }

    /// Bits have to be sought again: every code period is a symbol by itself.
    pub(super) fn forget_bits(&mut self) {
        let Some(bits) = &mut self.bits else { return };
        bits.clear();
        if self.bit_begin.take().is_none() {
            return;
        }
        self.group = 1;
        self.cn0 = Cn0::of_single_periods(self.period_s, self.settings.cn0_average_s);
        (self.previous, self.previous_sum) = (None, None);
        if matches!(self.stage, Stage::Tracking(_)) {
            self.enter(Stage::Tracking(0));
        }
    }

    /// Removes the secondary code from the next code period on. The carrier gets the right half cycle.
    pub(super) fn wipe(&mut self, phase: SecondaryCodePhase) {
        if phase.inverted {
            self.carrier += (0.5 * TURN) as i128;
        }
        self.secondary_code_phase = Some(phase);
        self.group = pilot_group(self.period_s);
        self.has_symbols = false;
        self.loops.wipe();
        self.cn0 = self.cn0.wiped(self.group);
        self.join_sides();
        self.previous = None;
        self.previous_sum = None;
        self.watch_secondary_code();
    }
}
