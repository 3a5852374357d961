//! Measurements of a channel: the state of its replica at a sample.

use super::Channel;
use crate::correlate::{TURN, units_to_chips};
use crate::track::{Measurement, Report};
use gnss::record::TrackingRow;

impl Channel {
    /// The replica's state at `tick`, in the running period.
    pub(super) fn measure(&self, tick: u64, report: &mut Report) {
        let (nco, polarity, lock) = (&self.nco, self.signs.polarity, &self.detectors.lock);
        let (code, length) = (nco.code_at(tick), i128::from(nco.length));
        let periods = i128::from(nco.period) + code.div_euclid(length);
        let fraction = units_to_chips(code.rem_euclid(length) as i64) / units_to_chips(nco.length);
        let step = planted!("receiver.nco.carrier_between_updates", nco.carrier_step, 0);
        let carrier = nco.carrier + nco.samples_to(tick) * step;
        let turns = (carrier >> 64) as f64 + carrier as u64 as f64 / TURN;
        let half = if polarity == Some(true) { 0.5 } else { 0.0 } + self.phase_cycles;
        let seconds_since = |sample: u64| tick.saturating_sub(sample) as f64 / nco.rate.hz();
        let rates = &self.loops.carrier;
        let offset_hz = rates.rate + rates.acceleration * seconds_since(self.accumulator.since);
        let cn0_dbhz = self.detectors.cn0_dbhz();
        report.measurements.push(Measurement {
            sample: tick,
            code_periods: periods.max(0) as u64,
            code_fraction: fraction,
            carrier_cycles: half - planted!("receiver.measure.carrier_sign", nco.sense, -nco.sense) * turns,
            half_cycle_known: polarity.is_some() || self.has_secondary_code(),
            doppler_hz: planted!("receiver.measure.doppler_sign", nco.sense, -nco.sense) * offset_hz,
            cn0_dbhz,
            locked_s: lock.locked_since().map_or(0.0, seconds_since),
            locked: lock.is_locked(),
        });
        let [early, late] = self.last.sides;
        report.rows.push(TrackingRow {
            sample: tick,
            sv: self.sv(),
            signal: self.signal(),
            prompt_i: self.last.prompt.re,
            prompt_q: self.last.prompt.im,
            dll_discriminator_chips: self.last.dll_chips,
            pll_discriminator_cycles: self.last.pll_cycles,
            fll_discriminator_hz: self.last.fll_hz,
            cn0_dbhz,
            phase_lock: self.stage.lock_value(),
            integration_s: self.last.integration_s,
            early_i: Some(early.re),
            early_q: Some(early.im),
            late_i: Some(late.re),
            late_q: Some(late.im),
            tap_spacing_chips: Some(units_to_chips(self.accumulator.taps[0] - self.accumulator.taps[2])),
        });
    }
}
