//! Changes of the code that a channel follows, and of the signs that it takes off.
//!
//! The signs are those of a secondary code, or of the code under bits. A long code, or both sidebands of a
//! sub-carrier, replace the code that the search found. The code leaves a side peak.

use num_complex::Complex64;

use super::companions::Data;
use super::{Channel, pilot_group};
use crate::correlate::units_to_chips;
use crate::lead::{BOTH_SIDES, lead};
use crate::track::Report;
use crate::track::cn0::Cn0;
use crate::track::long::LongCode;
use crate::track::secondary_code::{SecondaryCodePhase, SecondaryCodeSync};

impl Channel {
    /// Looks for the code under bits, and takes it off from their next beginning on: integrations are within
    /// bits then.
    pub(super) fn find_bits(&mut self, number: u64, prompt: Complex64) {
        let sought = self.signs.bit_begin.is_none() && self.detectors.is_true;
        let Some(bits) = self.signs.bits.as_mut().filter(|_| sought) else { return };
        let Some(begin) = bits.add(number, self.detectors.whitened(prompt)) else { return };
        self.signs.group = bits.periods();
        self.signs.bit_begin = Some(begin);
        self.detectors.cn0 = self.detectors.cn0.wiped(self.signs.group);
        self.accumulator.forget();
        self.track(begin);
    }

    /// Forgets where bits begin. Gives whether it was known.
    pub(super) fn forget_bits(&mut self) -> bool {
        let was_known = self.signs.forget_bits();
        if was_known {
            self.detectors.cn0 = Cn0::of_single_periods(self.period_s, self.settings.cn0_average_s);
            self.accumulator.forget();
        }
        was_known
    }

    /// Removes the secondary code from the next code period on. The carrier gets the right half cycle.
    pub(super) fn wipe(&mut self, phase: SecondaryCodePhase) {
        if phase.inverted {
            self.nco.turn(0.5);
        }
        self.signs.phase = Some(phase);
        self.signs.group = pilot_group(self.period_s);
        self.signs.has_symbols = false;
        self.loops.wipe();
        self.detectors.cn0 = self.detectors.cn0.wiped(self.signs.group);
        self.join_sides();
        self.accumulator.forget();
        self.watch_secondary_code();
    }

    /// Tracks the long code from the next code period on; the code before is then that of the data beside it.
    /// The carrier gets the right half cycle.
    pub(super) fn follow_long(&mut self, phase: SecondaryCodePhase) {
        let Some(pilot) = self.companions.long.as_ref().map(LongCode::component) else { return };
        let rates = (self.nco.rate.hz(), self.nco.sense);
        let link = self.link();
        self.companions.data = lead(self.signal()).and_then(|data| Data::new(data, pilot, link, &self.settings, rates));
        // The segment takes the place of a secondary code: no signs are left.
        self.signs.secondary_code = Some(SecondaryCodeSync::new(vec![1]));
        self.signs.polarity = None;
        self.wipe(phase);
        self.track(0);
        self.signs.confirmed = true;
    }

    /// Tracks both sidebands from the next code period on: the noise is that of one, the power twice as
    /// large.
    fn join_sides(&mut self) {
        let Some(both) = self.companions.sides.as_ref().map(|sides| sides.both().clone()) else { return };
        self.accumulator.taps = both.taps;
        self.detectors.side_peaks = both.peaks;
        self.loops.reshape(&self.settings, both.shape);
        self.detectors.cn0.raise(BOTH_SIDES);
        self.detectors.followed_db += 10.0 * libm::log10(BOTH_SIDES);
    }

    /// Takes prompt and neighbours of a code period, and moves code and carrier where one of these is the
    /// main peak.
    pub(super) fn watch_side_peaks(&mut self, prompt: Complex64, neighbours: [Complex64; 2], report: &mut Report) {
        let detectors = &mut self.detectors;
        let snr = detectors.cn0_hz() * self.period_s;
        // Noise and C/N0 are those that were measured.
        let scale = if detectors.cn0.hz().is_some() { 2.0 / detectors.noise() } else { 1.0 };
        let powers = neighbours.map(|sum| scale * sum.norm_sqr());
        let Some(peaks) = &mut detectors.side_peaks else { return };
        let Some(units) = peaks.add(scale * prompt.norm_sqr(), powers, snr) else { return };
        let ratio = peaks.ratio();
        self.nco.code += units;
        self.glances.move_by(units_to_chips(units));
        if ratio < 0.0 {
            self.nco.turn(0.5);
        }
        detectors.cn0.raise(1.0 / (ratio * ratio));
        self.interrupt(report);
    }
}
