//! Observations of a channel about a jump of all codes at once, and the move of its oscillators by a jump.

use num_complex::Complex64;

use super::{Channel, Stage};
use crate::correlate::{Nco, Replica};
use crate::gap::Edges;
use crate::track::Report;
use crate::track::lock::LockState;
use crate::track::loops::Rates;
use crate::track::secondary_code::SecondaryCodeSync;
use crate::track::sync::SymbolSync;

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
        let noise = self.detectors.noise();
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
        let begin = self.stage.begin()?;
        if self.has_secondary_code() || self.signs.bit_begin.is_some() {
            return Some(0);
        }
        (self.signs.confirmed && self.signs.has_symbols).then_some(begin)
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
        self.signs.phase.is_some()
    }

    /// Signs turn where a secondary code has them turn.
    pub(super) fn watch_secondary_code(&mut self) {
        let periods = self.signs.secondary_code.as_ref().map_or(0, SecondaryCodeSync::periods);
        let chips: Vec<f64> = (0..periods as u64).map(|number| self.signs.chip(number)).collect();
        self.glances.edges = Edges::of_secondary_code(&chips);
    }

    /// The carrier's Doppler at these rates, less what the code does not share.
    pub fn code_doppler_hz(&self, rates: &[Rates; 2]) -> f64 {
        self.nco.sense * rates[0].rate - self.nco.offset_hz
    }

    /// The replica and its oscillators at `sample`, as they would be had the loop moved the code by
    /// `moved_chips` and no other amount, and at these rates.
    pub fn predicted(&self, sample: u64, moved_chips: f64, rates: &[Rates; 2]) -> Option<(&Replica, Nco)> {
        let replica = self.companions.constant_replica().or(self.accumulator.replica())?;
        Some((replica, self.nco.predicted(sample, moved_chips - self.glances.moved_chips, rates[0].rate)))
    }

    /// The oscillators run on to `next`.
    pub(super) fn pass(&mut self, next: u64) {
        let samples = self.nco.pass(next);
        self.glances.moved_chips += self.loops.code.mean(self.update_s()) * samples as f64 / self.nco.rate.hz();
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
        self.detectors.lock = LockState::default();
        self.held = true;
        self.forget_edges();
    }

    /// Detectors wake up: the code is `chips` ahead of where it was taken to be with `moved_chips` of the
    /// loop's, and its count is short of `periods`. `begins` says whether symbols begin where they did.
    pub fn resume(&mut self, now: u64, chips: f64, moved_chips: Option<f64>, periods: i64, begins: bool) {
        let moved_chips = moved_chips.unwrap_or(self.glances.moved_chips);
        self.shift(now, chips + moved_chips - self.glances.moved_chips);
        self.glances.moved_chips = moved_chips;
        self.nco.count(i128::from(periods));
        self.held = false;
        self.detectors.lock = LockState::default();
        self.pull_in.since = now;
        self.signs.sync = SymbolSync::new(self.signs.group);
        let symbol_s = self.symbol_s();
        self.stage.restart(symbol_s);
        if !begins && self.stage.begin().is_some() {
            // The frequency may be another after the gap.
            self.pull_in.is_batched = false;
            self.enter(Stage::assisted());
        }
        self.forget_edges();
    }

    /// Moves the code by `chips` at sample `now`. The running code period is not used.
    fn shift(&mut self, now: u64, chips: f64) {
        if self.start.is_none() || self.accumulator.coded.is_none() {
            return;
        }
        self.pass(now);
        self.nco.shift(chips);
        (self.whole, self.moved) = (false, true);
        self.accumulator.clear(now);
        self.accumulator.forget();
        self.stage.forget_symbol();
        self.set_steps();
    }

    /// Restarts integrations with the first symbol after the code was moved.
    pub(super) fn keep_to_symbols(&mut self, number: u64) {
        if !self.moved || self.held {
            return;
        }
        if let Some(begin) = self.stage.begin() {
            if !self.signs.ends_symbol(number, begin) {
                return;
            }
            self.detectors.cn0.know_symbols();
        }
        self.moved = false;
        self.accumulator.clear(self.nco.first);
    }
}
