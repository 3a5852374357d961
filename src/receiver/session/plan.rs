//! Which Dopplers the next search looks at.
//!
//! The first search takes the settings' range around zero. Once a fix knows the clock, searches are centred
//! on its drift: a satellite's own Doppler stays within ±5 kHz, a clock of 2.5 ppm moves all of them by 3.9
//! kHz. Before that an offset of the carrier from the code may be a mixer's or the sample rate's, and the
//! range is stretched to hold both. While too few satellites are found for a fix, every search is wider than
//! the one before, then the widths begin anew.

use super::FrontEnd;
use super::shared::Shared;
use crate::receiver::acquire::{AcquireError, Searcher, samples_needed};
use crate::receiver::position::least_squares::UNKNOWNS;

/// Widths of searches that find too little, in those of the settings.
const WIDTHS: [f64; 3] = [1.0, 2.0, 5.0];
/// Seconds from one of these to the next.
const WIDEN_S: f64 = 1.0;
/// Centres lie on this grid, so that a small drift changes nothing.
const CENTRE_STEP_HZ: f64 = 500.0;
/// An offset before the first fix stretches the range by this at most.
const STRETCH_HZ: f64 = 30_000.0;

/// The Dopplers of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sweep {
    pub centre_hz: f64,
    pub half_hz: f64,
}

impl FrontEnd {
    /// Where to look now.
    pub(super) fn sweep(&self, shared: &Shared) -> Sweep {
        let half_hz = self.settings.acquisition.doppler_max_hz;
        let carrier_hz = self.signal().map_or(0.0, |signal| signal.centre_hz());
        let offset_hz = self.offset.hz();
        let grid = |hz: f64| (hz / CENTRE_STEP_HZ).round() * CENTRE_STEP_HZ;
        if let Some(drift) = shared.clock_drift {
            return Sweep { centre_hz: grid(offset_hz - drift * carrier_hz), half_hz };
        }
        let width = WIDTHS.get(self.widenings % WIDTHS.len()).copied().unwrap_or(1.0);
        let stretch_hz = 0.5 * offset_hz.clamp(-STRETCH_HZ, STRETCH_HZ);
        Sweep { centre_hz: grid(stretch_hz), half_hz: width * half_hz + grid(stretch_hz).abs() }
    }

    /// Takes note of how many satellites there are after a search.
    pub(super) fn widen(&mut self, shared: &Shared) {
        let enough = self.tracks.len() >= UNKNOWNS || shared.clock_drift.is_some();
        self.widenings = if enough { 0 } else { self.widenings + 1 };
    }

    /// Searches soon when there is another place to look at than last time.
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
