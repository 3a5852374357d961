//! Observations of a channel about a jump of all codes at once, and the move of its oscillators by a jump.

use num_complex::Complex64;

use super::pilot::Data;
use super::{Channel, Stage};
use crate::correlate::{Nco, Replica, TURN, chips_to_units};
use crate::gap::Edges;
use crate::track::Report;
use crate::track::lock::{LockState, PhaseLock, Rotation, SymbolLock};
use crate::track::loops::Rates;
use crate::track::secondary_code::SecondaryCodeSync;
use crate::track::sync::SymbolSync;

use super::LOCK_PERIODS;

/// Means over the code periods since the last glance.
#[derive(Clone, Copy, Debug)]
pub struct Glance {
    /// Position of the signal's code in chips, relative to the code that the carrier's aid alone would give.
    /// It is the loop's total move plus the discriminator's current error. It does not depend on the loop,
    /// and its noise is white.
    pub code_chips: f64,
    /// Position of the replica's code in chips, in the same sense.
    pub moved_chips: f64,
    /// Power of the prompts over that of their noise's two components, less that: T·C/N0 of a code period.
    pub power: f64,
    /// Code periods in the means.
    pub periods: u32,
    /// Rates of carrier (Hz) and code (chips a second).
    pub rates: [Rates; 2],
}

/// Sums for a glance, and where the signs of prompts turn.
#[derive(Clone, Debug)]
pub(super) struct Glances {
    moved_chips: f64,
    code: (f64, u32),
    power: (f64, u32),
    edges: Edges,
}

impl Glances {
    pub(super) fn new(group: u32) -> Self {
        Self { moved_chips: 0.0, code: (0.0, 0), power: (0.0, 0), edges: Edges::new(group) }
    }

    /// Takes the prompt of code period `number`, and the one before.
    pub(super) fn add(&mut self, number: u64, prompt: Complex64, before: Option<Complex64>) {
        self.power.0 += prompt.norm_sqr();
        self.power.1 += 1;
        if let Some(before) = before {
            self.edges.add(number, (prompt * before.conj()).re);
        }
    }

    /// Takes an update of the loops: what the discriminator showed, and by how much the code moves for it.
    pub(super) fn close(&mut self, discriminator_chips: f64, jump_chips: f64) {
        self.code.0 += self.moved_chips + discriminator_chips;
        self.code.1 += 1;
        self.moved_chips += jump_chips;
    }

    pub(super) fn move_by(&mut self, chips: f64) {
        self.moved_chips += chips;
    }
}

impl Channel {
    /// Observations since the last call; `None` without any.
    pub fn glance(&mut self) -> Option<Glance> {
        let (code, updates) = std::mem::take(&mut self.glances.code);
        let (power, periods) = std::mem::take(&mut self.glances.power);
        let noise = self.noise();
        (updates > 0 && periods > 0 && noise > 0.0).then(|| Glance {
            code_chips: code / f64::from(updates),
            moved_chips: self.glances.moved_chips,
            power: power / f64::from(periods) / noise - 1.0,
            periods,
            rates: [self.loops.carrier, self.loops.code],
        })
    }

    /// The code period modulo a symbol's in which symbols begin, where that is beyond doubt; 0 where a
    /// secondary code or the code under bits is known, which numbers periods itself.
    pub fn symbols_begin(&self) -> Option<u64> {
        match self.stage {
            Stage::Tracking(_) if self.has_secondary_code() || self.bit_begin.is_some() => Some(0),
            Stage::Tracking(begin) if self.confirmed && self.has_symbols => Some(begin),
            _ => None,
        }
    }

    /// Edges at which the signs of prompts have turned since the code was last reseated, or
    /// [`Self::forget_edges`] was called.
    pub fn edges(&self) -> &Edges {
        &self.glances.edges
    }

    /// Restarts the search for the positions at which signs change.
    pub fn forget_edges(&mut self) {
        self.take_edges();
    }

    /// Edges of the signs so far. The collection starts again afterwards.
    pub fn take_edges(&mut self) -> Edges {
        let emptied = self.glances.edges.emptied();
        std::mem::replace(&mut self.glances.edges, emptied)
    }

    /// True if a secondary code has been recognised, and is removed from the prompts.
    pub fn has_secondary_code(&self) -> bool {
        self.secondary_code_phase.is_some()
    }

    /// Signs turn where a secondary code has them turn.
    pub(super) fn watch_secondary_code(&mut self) {
        let periods = self.secondary_code.as_ref().map_or(0, SecondaryCodeSync::periods);
        let chips: Vec<f64> = (0..periods as u64).map(|number| self.secondary_code_chip(number)).collect();
        self.glances.edges = Edges::of_secondary_code(&chips);
    }

    /// The carrier's Doppler at these rates, less what the code does not share.
    pub fn code_doppler_hz(&self, rates: &[Rates; 2]) -> f64 {
        self.sense * rates[0].rate - self.carrier_offset_hz
    }

    /// The replica and its oscillators at `sample`, as they would be had the loop moved the code by
    /// `moved_chips` and no other amount, and at these rates.
    pub fn predicted(&self, sample: u64, moved_chips: f64, rates: &[Rates; 2]) -> Option<(&Replica, Nco)> {
        // A segment of a long code is there once, and both sidebands of a sub-carrier have signs of their
        // own; the code beside comes in every period.
        let passes = self.segment.is_some() || self.sides.is_some();
        let beside = self.data.as_ref().filter(|_| passes).map(Data::replica);
        let replica = beside.or(self.replica.as_ref())?;
        let samples = i128::from(sample) - i128::from(self.first);
        let code = i128::from(self.code)
            + samples * i128::from(self.code_step)
            + i128::from(chips_to_units(moved_chips - self.glances.moved_chips));
        let carrier_step = (rates[0].rate / self.rate.hz() * TURN) as i128;
        let nco = Nco {
            carrier: 0,
            carrier_step: self.if_step.wrapping_add(carrier_step as u64),
            code: code.rem_euclid(i128::from(replica.period())) as i64,
            code_step: self.code_step as u64,
        };
        Some((replica, nco))
    }

    /// The oscillators run on to `next`.
    pub(super) fn pass(&mut self, next: u64) {
        let samples = next.saturating_sub(self.first);
        let update_s = self.period_s * f64::from(self.periods_per_update());
        self.glances.moved_chips += self.loops.code.mean(update_s) * samples as f64 / self.rate.hz();
        self.carrier += self.carrier_step * i128::from(samples);
        self.code += (i128::from(self.code_step) * i128::from(samples)) as i64;
        self.first = next;
    }

    /// Moves the replica at sample `now`, up to which the channel has come, to where the code is when it has
    /// jumped ahead by `ahead_chips` and the loop had moved it by `moved_chips` otherwise, or by what it did
    /// if that is `None`. The carrier's count is broken; detectors sleep until [`Self::resume`].
    pub fn reseat(
        &mut self,
        now: u64,
        ahead_chips: f64,
        moved_chips: Option<f64>,
        rates: Option<[Rates; 2]>,
        report: &mut Report,
    ) {
        if let Some([carrier, code]) = rates {
            (self.loops.carrier, self.loops.code) = (carrier, code);
        }
        let moved_chips = moved_chips.unwrap_or(self.glances.moved_chips);
        self.shift(now, ahead_chips + moved_chips - self.glances.moved_chips);
        self.glances.moved_chips = moved_chips;
        self.interrupt(report);
        self.lock = LockState::default();
        self.held = true;
        self.forget_edges();
    }

    /// Detectors wake up: the code is `chips` ahead of where it was taken to be with `moved_chips` of the
    /// loop's, and its count is short of `periods`. `begins` says whether symbols begin where they did.
    pub fn resume(&mut self, now: u64, chips: f64, moved_chips: Option<f64>, periods: i64, begins: bool) {
        let moved_chips = moved_chips.unwrap_or(self.glances.moved_chips);
        self.shift(now, chips + moved_chips - self.glances.moved_chips);
        self.glances.moved_chips = moved_chips;
        self.period = (i128::from(self.period) + i128::from(periods)).max(0) as u64;
        self.held = false;
        self.lock = LockState::default();
        self.pull_in_since = now;
        self.sync = SymbolSync::new(self.group);
        self.rotation = Rotation::default();
        self.symbol_lock = SymbolLock::new(self.period_s * f64::from(self.group));
        self.phase_lock = PhaseLock::new(LOCK_PERIODS);
        if !begins && matches!(self.stage, Stage::Tracking(_)) {
            // The frequency may be another after the gap.
            self.is_batched = false;
            self.enter(Stage::Assisted);
        }
        self.forget_edges();
    }

    /// Moves the code by `chips` at sample `now`. The running code period is not used.
    fn shift(&mut self, now: u64, chips: f64) {
        let Some(length) = self.replica.as_ref().map(Replica::period).filter(|_| self.start.is_some()) else { return };
        self.pass(now);
        let code = self.code + chips_to_units(chips);
        self.code = code.rem_euclid(length);
        self.period = (i128::from(self.period) + i128::from(code.div_euclid(length))).max(0) as u64;
        (self.whole, self.moved) = (false, true);
        self.update_since = now;
        (self.sums, self.summed) = ([Complex64::ZERO; 3], 0);
        (self.previous, self.previous_sum) = (None, None);
        self.symbol = (Complex64::ZERO, 0);
        self.set_steps();
    }

    /// Restarts integrations with the first symbol after the code was moved.
    pub(super) fn keep_to_symbols(&mut self, number: u64) {
        if !self.moved || self.held {
            return;
        }
        if let Stage::Tracking(begin) = self.stage {
            if (number + 1) % u64::from(self.group) != begin {
                return;
            }
            self.cn0.know_symbols();
        }
        self.moved = false;
        (self.sums, self.summed) = ([Complex64::ZERO; 3], 0);
        self.update_since = self.first;
    }
}
