//! Dopplers of the next search.
//!
//! The first search takes the settings' range around zero. Once a fix knows the clock, searches are centred
//! on its drift. A satellite's own Doppler stays within ±5 kHz, and a clock of 2.5 ppm moves all of them by
//! 3.9 kHz. Before that the middle of the found Dopplers counts. It may be so far from the search's middle
//! that the search's edge cuts a sky of ±4 kHz. The next search then follows at once, with the same width
//! about it. So an offset of several kHz, of the clock or of a mixer, costs a tenth of a second. It does not
//! cost the satellites beyond the edge, or a subframe of theirs. While too few satellites are found for a
//! fix, every search is wider than the one before. After the widest one the widths begin again.

use super::FrontEnd;
use super::shared::Shared;
use crate::acquire::{AcquireError, Searcher, samples_needed};
use crate::position::least_squares::UNKNOWNS;

/// Widths of searches that find too little, in those of the settings.
pub(super) const WIDTHS: [f64; 3] = [1.0, 2.0, 5.0];
/// Seconds from one of these to the next.
pub(super) const WIDEN_S: f64 = 1.0;
/// Centres lie on this grid, so that a small drift changes nothing.
const CENTRE_STEP_HZ: f64 = 500.0;
/// A sky this far from zero extends the range, and no further.
const STRETCH_HZ: f64 = 30_000.0;
/// Dopplers of satellites about their middle, from near the Earth.
pub(super) const SKY_HZ: f64 = 4000.0;

/// The Dopplers of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sweep {
    pub centre_hz: f64,
    pub half_hz: f64,
}

impl FrontEnd {
    /// Dopplers to search now.
    pub(super) fn sweep(&self, shared: &Shared) -> Sweep {
        let half_hz = self.settings.acquisition.doppler_max_hz;
        let carrier_hz = self.signal().map_or(0.0, |signal| signal.centre_hz());
        let offset_hz = self.offset.hz();
        let grid = |hz: f64| (hz / CENTRE_STEP_HZ).round() * CENTRE_STEP_HZ;
        if let Some(drift) = shared.clock_drift {
            return Sweep { centre_hz: grid(offset_hz - drift * carrier_hz), half_hz };
        }
        let width = WIDTHS.get(self.widenings % WIDTHS.len()).copied().unwrap_or(1.0);
        // Zero too: what was found may be one side of a sound sky.
        let stretch_hz = grid(0.5 * self.sky_hz.clamp(-STRETCH_HZ, STRETCH_HZ));
        Sweep { centre_hz: stretch_hz, half_hz: width * half_hz + stretch_hz.abs() }
    }

    /// Moves the middle of the sky to that of the Dopplers at which channels were found, where the edge of
    /// the search may have cut it; whether it did.
    pub(super) fn follow_sky(&mut self, shared: &Shared) -> bool {
        let found = || self.tracks.iter().map(|track| track.found_hz);
        let (Some(lowest), Some(highest)) = (found().min_by(f64::total_cmp), found().max_by(f64::total_cmp)) else {
            return false;
        };
        let (middle_hz, half_hz) = (0.5 * (lowest + highest), self.settings.acquisition.doppler_max_hz);
        let cut = half_hz > SKY_HZ && (middle_hz - self.sky_hz).abs() > half_hz - SKY_HZ;
        if cut && shared.clock_drift.is_none() {
            self.sky_hz = middle_hz;
            return true;
        }
        false
    }

    /// Takes note of how many satellites there are after a search.
    pub(super) fn widen(&mut self, shared: &Shared) {
        let enough = self.tracks.len() >= UNKNOWNS || shared.clock_drift.is_some();
        self.widenings = if enough { 0 } else { self.widenings + 1 };
    }

    /// Searches soon when there is another position to look at than last time.
    pub(super) fn hasten(&mut self, now: u64, shared: &Shared) {
        let exhausted = self.widenings > 0 && self.widenings.is_multiple_of(WIDTHS.len());
        let Some((aimed, _)) = self.aimed else { return };
        if self.window.is_none() && !exhausted && aimed != self.sweep(shared) {
            self.next_search = self.next_search.min(now + self.samples(WIDEN_S));
        }
    }

    /// Makes ready to search there.
    pub(super) fn aim(&mut self, sweep: Sweep) -> Result<(), AcquireError> {
        let mut settings = self.settings.acquisition.clone();
        let share = if self.searched { self.settings.operation.repeated_false_alarm_share } else { 1.0 };
        settings.false_alarm_probability = (settings.false_alarm_probability * share).max(1e-12);
        settings.doppler_max_hz = sweep.half_hz;
        if self.aimed != Some((sweep, self.searched)) {
            self.searcher = Searcher::around(&self.metadata, &settings, sweep.centre_hz)?;
            self.aimed = Some((sweep, self.searched));
            settings.doppler_max_hz += sweep.centre_hz.abs();
            self.needed = samples_needed(&self.metadata, &settings)?;
        }
        Ok(())
    }
}
