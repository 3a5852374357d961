//! Measurements of a channel: the state of its replica at a sample.

use super::Channel;
use crate::correlate::{Replica, TURN, units_to_chips};
use crate::track::{Measurement, Report};
use gnss::record::TrackingRow;

impl Channel {
    /// The replica's state at `tick`, in the running period.
    pub(super) fn measure(&self, tick: u64, replica: &Replica, report: &mut Report) {
        let samples = i128::from(tick) - i128::from(self.first);
        let length = i128::from(replica.period());
        let code = i128::from(self.code) + samples * i128::from(self.code_step);
        let periods = i128::from(self.period) + code.div_euclid(length);
        let fraction = units_to_chips(code.rem_euclid(length) as i64) / units_to_chips(replica.period());
        let carrier = self.carrier + samples * planted!("receiver.nco.carrier_between_updates", self.carrier_step, 0);
        let turns = (carrier >> 64) as f64 + carrier as u64 as f64 / TURN;
        let half = if self.polarity == Some(true) { 0.5 } else { 0.0 } + self.phase_cycles;
        let passed_s = tick.saturating_sub(self.update_since) as f64 / self.rate.hz();
        let offset_hz = self.loops.carrier.rate + self.loops.carrier.acceleration * passed_s;
        let cn0_dbhz = 10.0 * libm::log10(self.cn0_hz()) - self.followed_db;
        report.measurements.push(Measurement {
            sample: tick,
            code_periods: periods.max(0) as u64,
            code_fraction: fraction,
            carrier_cycles: half - planted!("receiver.measure.carrier_sign", self.sense, -self.sense) * turns,
            half_cycle_known: self.polarity.is_some() || self.secondary_code_phase.is_some(),
            doppler_hz: planted!("receiver.measure.doppler_sign", self.sense, -self.sense) * offset_hz,
            cn0_dbhz,
            locked_s: self.lock.locked_since().map_or(0.0, |since| tick.saturating_sub(since) as f64 / self.rate.hz()),
            locked: self.lock.is_locked(),
        });
        report.rows.push(TrackingRow {
            sample: tick,
            sv: self.sv,
            signal: self.signal,
            prompt_i: self.last.prompt.re,
            prompt_q: self.last.prompt.im,
            dll_discriminator_chips: self.last.dll_chips,
            pll_discriminator_cycles: self.last.pll_cycles,
            fll_discriminator_hz: self.last.fll_hz,
            cn0_dbhz,
            phase_lock: self.lock_value(),
            integration_s: self.last.integration_s,
        });
    }
}
