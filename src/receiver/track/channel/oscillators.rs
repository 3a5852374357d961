//! A channel's oscillators: where they begin, what they run at, and how many code periods an update has.

use super::Channel;
use crate::correlate::{Nco, Replica, TURN, chips_to_units};
use gnss::time::tone_turns;

/// Positions of the code at which the noise is measured, in turn.
const NOISE_PLACES: usize = 16;

impl Channel {
    /// Carries the hit's code phase to the first sample that the channel sees.
    pub(super) fn begin(&mut self, first: u64, replica: &Replica) {
        let samples = i128::from(first) - i128::from(self.hit.sample);
        let moved = samples * i128::from(self.code_step) + i128::from(chips_to_units(self.hit.code_phase_chips));
        self.code = moved.rem_euclid(i128::from(replica.period())) as i64;
        (self.start, self.first, self.stage_since, self.update_since) = (Some(first), first, first, first);
        self.pull_in_since = first;
        self.noise_taps = replica.quiet_taps(NOISE_PLACES);
    }

    /// The oscillators at the running period's first sample.
    pub(super) fn oscillators(&self) -> Nco {
        Nco {
            carrier: tone_turns(self.if_hz, self.rate, self.first).wrapping_add(self.carrier as u64),
            carrier_step: self.if_step.wrapping_add(self.carrier_step as u64),
            code: self.code,
            code_step: self.code_step as u64,
        }
    }

    /// Samples from the running period's first to the next one's.
    pub(super) fn samples_left(&self, replica: &Replica) -> u64 {
        let left = replica.period() - self.code;
        (left.max(1) as u64).div_ceil(self.code_step.max(1) as u64)
    }

    /// Sets the oscillators to what the loops know.
    pub(super) fn set_steps(&mut self) {
        let rate_hz = self.rate.hz();
        let update_s = self.period_s * f64::from(self.periods_per_update());
        let offset_hz = self.loops.carrier.mean(update_s);
        self.carrier_step = (offset_hz / rate_hz * TURN) as i128;
        let link = self.link();
        let carrier_hz = planted!("receiver.nco.channel", link.carrier_hz(), link.signal.centre_hz());
        let aid_hz = (self.sense * offset_hz - self.carrier_offset_hz) * self.chip_rate_hz / carrier_hz;
        let aid_hz = planted!("receiver.nco.carrier_aid", aid_hz, -aid_hz);
        self.code_step = chips_to_units((self.chip_rate_hz + aid_hz + self.loops.code.mean(update_s)) / rate_hz).max(1);
    }

    /// Takes over a new offset, and moves the code to where the loop would settle with it.
    pub(super) fn take_offset(&mut self) {
        let less_hz = self.carrier_offset_hz - self.next_offset_hz;
        if less_hz == 0.0 {
            return;
        }
        self.carrier_offset_hz = self.next_offset_hz;
        let update_s = self.period_s * f64::from(self.periods_per_update());
        let jump_chips = self.loops.aid_code(less_hz * self.chip_rate_hz / self.link().carrier_hz(), update_s);
        self.glances.move_by(jump_chips);
        self.code += chips_to_units(jump_chips);
    }

    pub(super) fn periods_per_update(&self) -> u32 {
        self.stage.mode().periods_per_update(&self.settings, self.group)
    }

    /// Gains for the present stage.
    pub(super) fn design(&mut self) {
        let update_s = self.period_s * f64::from(self.periods_per_update());
        self.loops.design(&self.settings, self.stage.mode(), self.wide, update_s);
    }

    pub(super) fn since_s(&self, sample: u64) -> f64 {
        self.first.saturating_sub(sample) as f64 / self.rate.hz()
    }
}
