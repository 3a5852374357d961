//! Side peaks of a channel: collection of the evidence, and the move to the main peak.

use num_complex::Complex64;

use super::{Channel, Report};
use crate::correlate::{TURN, units_to_chips};

impl Channel {
    /// Takes prompt and neighbours of a code period, and moves code and carrier where one of these is the
    /// main peak.
    pub(super) fn watch_side_peaks(&mut self, prompt: Complex64, neighbours: [Complex64; 2], report: &mut Report) {
        let snr = self.cn0_hz() * self.period_s;
        // Noise and C/N0 are those that were measured.
        let scale = if self.cn0.hz().is_some() { 2.0 / self.noise() } else { 1.0 };
        let powers = neighbours.map(|sum| scale * sum.norm_sqr());
        let Some(peaks) = &mut self.side_peaks else { return };
        let Some(units) = peaks.add(scale * prompt.norm_sqr(), powers, snr) else { return };
        let ratio = peaks.ratio();
        self.code += units;
        self.glances.move_by(units_to_chips(units));
        if ratio < 0.0 {
            self.carrier += (0.5 * TURN) as i128;
        }
        self.cn0.raise(1.0 / (ratio * ratio));
        self.interrupt(report);
    }
}
