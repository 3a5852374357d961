//! The companions of the code that a channel follows: data beside a pilot, the long code of a pilot, the
//! other sideband of a sub-carrier.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::accumulator::Period;
use crate::correlate::ahead::Ahead;
use crate::correlate::correlator::{Code, Coded, Correlator};
use crate::correlate::{Replica, Wave};
use crate::lead::beside;
use crate::track::long::LongCode;
use crate::track::model::ReplicaModel;
use crate::track::secondary_code::{SecondaryCodePhase, SecondaryCodeSync};
use crate::track::sides::Sides;
use crate::track::{Symbol, TrackingSettings};
use gnss::samples::IfMetadata;
use gnss::signal::{Component, Link};

/// Codes beside the one that the search found.
#[derive(Clone, Debug, Default)]
pub(super) struct Companions {
    pub data: Option<Data>,
    /// Pilot with a code too long for the search.
    pub long: Option<LongCode>,
    /// Index of the long code's segment that is the replica.
    pub segment: Option<u64>,
    /// The other sideband of the sub-carrier of which what is followed is one.
    pub sides: Option<Sides>,
}

impl Companions {
    /// Companions of `component` in the signal of a link, with settings that are fitted to it.
    pub fn beside(
        component: &'static Component,
        link: Link,
        settings: &TrackingSettings,
        metadata: &IfMetadata,
    ) -> Self {
        let Link { sv, signal } = link;
        let rates = (metadata.rate.hz(), if metadata.inverted { -1.0 } else { 1.0 });
        let is_coded = component.secondary_code.periods() > 1 && component.secondary_code.of(sv.number).is_some();
        let data = if is_coded { beside(component, signal) } else { None };
        Self {
            data: data.and_then(|data| Data::new(data, component, link, settings, rates)),
            long: LongCode::beside(component, signal, sv.number, settings.replica),
            segment: None,
            sides: Sides::beside(component, (signal, sv.number), settings, rates),
        }
    }

    /// Makes the replica ready for code period `number`: with the segment of a long code, or with both
    /// sidebands of a sub-carrier once the secondary code is known, in the signs that they have.
    pub fn ready(&mut self, coded: &mut Coded, phase: Option<SecondaryCodePhase>, number: u64) {
        let Some(phase) = phase else { return };
        self.next_segment(coded, phase, number);
        let Some(sides) = &mut self.sides else { return };
        if let Some(both) = sides.replica() {
            coded.replica = both;
        }
        coded.replica.set_second(sides.are_opposed(phase, number));
    }

    /// Takes the long code's replica for code period `number`, where it is another than that of the period
    /// before.
    fn next_segment(&mut self, coded: &mut Coded, phase: SecondaryCodePhase, number: u64) {
        let Some(long) = &mut self.long else { return };
        let segment = Some(long.segment(phase, number));
        if self.segment == segment {
            return;
        }
        self.segment = segment;
        if let Some(next) = segment.and_then(|segment| long.coded(segment, &coded.code)) {
            *coded = next;
        }
    }

    /// True if what is followed has the same replica in every code period.
    pub fn keep_replica(&self) -> bool {
        self.segment.is_none() && self.sides.is_none()
    }

    /// The replica of a code that is the same in every code period; `None` where it is the one that is
    /// followed.
    pub fn constant_replica(&self) -> Option<&Replica> {
        // A segment of a long code is there once, and both sidebands of a sub-carrier have signs of their
        // own; the code beside comes in every period.
        let passes = self.segment.is_some() || self.sides.is_some();
        self.data.as_ref().filter(|_| passes).map(|data| &data.coded.replica)
    }
}

/// Data component that is read beside a pilot.
#[derive(Clone, Debug)]
pub(super) struct Data {
    coded: Coded,
    /// Sums of the code periods to come.
    ahead: Ahead,
    /// Turns its prompts to the phase of the pilot's.
    turn: Complex64,
    /// Deviation of the noise in its correlations over that in the pilot's.
    deviation: f64,
    periods_per_symbol: u64,
    secondary_code: SecondaryCodeSync,
    sum: (Complex64, u64),
}

impl Data {
    /// The data of `component`, whose symbols are whole periods, beside `pilot`.
    pub fn new(
        component: &'static Component,
        pilot: &'static Component,
        link: Link,
        settings: &TrackingSettings,
        (rate_hz, sense): (f64, f64),
    ) -> Option<Self> {
        let model = |component| ReplicaModel::new(settings, component, rate_hz);
        let made = (settings.waveform, settings.replica);
        let replica = Replica::made_in(component, link.sv.number, made, sense < 0.0)?;
        let share = replica.share() * model(component)?.power;
        let own = Wave::new(pilot, link.sv.number)?.share * model(pilot)?.power;
        let (sin, cos) = libm::sincos(TAU * sense * (pilot.phase_cycles - component.phase_cycles));
        Some(Self {
            coded: Coded { replica, code: Code::new(link, component, made) },
            ahead: Ahead::default(),
            turn: Complex64::new(cos, sin),
            deviation: (share / own).sqrt(),
            periods_per_symbol: u64::from(component.periods_per_symbol()?),
            secondary_code: SecondaryCodeSync::new(component.secondary_code.of(link.sv.number)?),
            sum: (Complex64::ZERO, 0),
        })
    }

    /// Correlates the data of a code period, and gives the symbol that ends with it; `scale` brings the
    /// pilot's noise to unit variance a component.
    pub fn read<C: Correlator>(&mut self, period: &Period<C>, phase: SecondaryCodePhase, scale: f64) -> Option<Symbol> {
        let sum = period.prompt_ahead(&mut self.ahead, &self.coded);
        let (number, end) = (period.number, period.interval.to);
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
