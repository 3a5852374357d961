//! A pilot whose code is many periods of the followed one long: which of its segments is sent.
//!
//! Both codes begin together, so each period of the followed code has one segment of the long one. What a
//! period correlates to with every segment is summed for every position that the first period may have in the
//! long code, until one is beyond doubt. Source of the scheme: IS-GPS-200N, 3.2.1.5 (L2 CL has 75 periods of
//! CM). Limits: chips of one rectangular step; a segment's replica is cyclic, so its first and last chip lack
//! their true neighbours, two of 20 460.

use super::secondary_code::{SecondaryCodePhase, Shifts};
use crate::correlate::correlator::{Code, Coded};
use crate::correlate::{Edge, Replica, Wave};
use crate::lead::long_beside;
use gnss::signal::{Component, Signal};

/// Code periods before a decision is tried.
const LEAST_PERIODS: u32 = 4;
/// Code periods after which a search begins again.
const MOST_PERIODS: u32 = 200;

/// Search for the segment of a code period, and the segments' replicas.
#[derive(Clone, Debug)]
pub struct LongCode {
    component: &'static Component,
    number: u8,
    edge: Edge,
    /// Chips of a segment.
    length: usize,
    /// Number of segments of the code.
    segments: u64,
    /// The whole code; made when it is asked for.
    chips: Vec<i8>,
    shifts: Shifts,
}

impl LongCode {
    /// The pilot of such a code beside `lead`, if the signal has one.
    pub fn beside(lead: &'static Component, signal: &'static Signal, number: u8, edge: Edge) -> Option<Self> {
        let component = long_beside(lead, signal)?;
        let segments = component.code_chips / lead.code_chips;
        let shifts = Shifts::new(segments as usize);
        let length = lead.code_chips as usize;
        Some(Self { component, number, edge, length, segments: u64::from(segments), chips: Vec::new(), shifts })
    }

    /// The pilot.
    pub fn component(&self) -> &'static Component {
        self.component
    }

    /// The segment of code period `number`.
    pub fn segment(&self, phase: SecondaryCodePhase, number: u64) -> u64 {
        (number + phase.shift) % self.segments
    }

    /// The replica of a segment beside a code; `None` where the documents assign no code.
    pub fn coded(&mut self, segment: u64, beside: &Code) -> Option<Coded> {
        if self.chips.is_empty() {
            self.chips = (self.component.code)(self.number)?;
        }
        let values = self.chips.chunks_exact(self.length).nth(segment as usize)?.to_vec();
        let sent = values.iter().filter(|&&chip| chip != 0).count();
        let share = sent as f64 / values.len().max(1) as f64;
        let replica = Replica::of(Wave { values, steps_per_chip: 1, share }, self.edge)?;
        Some(Coded { replica, code: Code { component: self.component, segment: Some(segment), ..*beside } })
    }

    /// Forgets what was taken.
    pub fn clear(&mut self) {
        self.shifts.clear();
    }

    /// Takes code period `number`, in phase lock; `prompt` gives what it correlates to with a replica, in
    /// phase (noise of unit variance). Gives the phase when it is beyond doubt.
    pub fn add(&mut self, number: u64, beside: &Code, prompt: impl Fn(&Coded) -> f64) -> Option<SecondaryCodePhase> {
        let all: Vec<f64> = (0..self.segments)
            .map(|shift| self.coded((number + shift) % self.segments, beside).map_or(0.0, |coded| prompt(&coded)))
            .collect();
        let taken = self.shifts.add(all.into_iter());
        let found = if taken < LEAST_PERIODS { None } else { self.shifts.decide() };
        if taken >= MOST_PERIODS {
            self.clear();
        }
        found
    }
}
