//! Elements in short: what a satellite may be used by until its whole set is decoded.
//!
//! Their ranges are weighted by the error of the elements, found by comparison with whole sets: of the real
//! words of an hour of 2025 and of what is sent for the sets of 2020-11-29, below. A set without group
//! delays has that of single-frequency users in its error as well. Limits: the error is the same from epoch
//! to epoch, though counted as independent; nothing shows whose elements they are but the code, as the word
//! names no satellite.

use super::Solver;
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::galileo::inav::REDUCED_VALID_S;
use crate::gnss::time::Epoch;

/// Standard deviation of a range by the elements.
const ELEMENTS_M: f64 = 2.0;
/// Of a group delay that is not known yet.
const DELAY_M: f64 = 1.5;

/// A set in short.
#[derive(Clone, Debug)]
pub(super) struct InShort {
    pub set: Ephemeris,
    /// Standard deviation of a range by it.
    pub sigma_m: f64,
}

impl InShort {
    /// Whether it describes the orbit at a time.
    pub(super) fn holds(&self, at: Epoch) -> bool {
        (0.0..=REDUCED_VALID_S).contains(&at.since(self.set.toe))
    }
}

impl Solver {
    /// Takes elements in short, if the settings want them: they serve until a whole set does. Whether they
    /// are the satellite's first ones.
    pub fn take_reduced(&mut self, set: Ephemeris, with_delays: bool) -> bool {
        let sigma_m = if with_delays { ELEMENTS_M } else { libm::hypot(ELEMENTS_M, DELAY_M) };
        self.settings.reduced_elements && self.reduced.insert(set.sv, InShort { set, sigma_m }).is_none()
    }
}
