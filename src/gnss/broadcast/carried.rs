//! A set of elements at another reference time: the same orbit and clock.
//!
//! Limits: a rate of the mean motion's correction and of the axis is left as it is, which sets without them
//! have as zero.

use super::Ephemeris;
use crate::time::Epoch;

impl Ephemeris {
    /// The set with `at`, of the same week, as the reference time of orbit and clock; issues stay.
    pub(crate) fn carried_to(&self, at: Epoch) -> Self {
        let (since_toe_s, since_toc_s) = (at.since(self.toe), at.since(self.toc));
        Self {
            toe: at,
            toc: at,
            m0_rad: self.m0_rad + self.mean_motion_radps() * since_toe_s,
            omega0_rad: self.omega0_rad + self.omega_dot_radps * since_toe_s,
            i0_rad: self.i0_rad + self.idot_radps * since_toe_s,
            af0_s: self.af0_s + since_toc_s * (self.af1_sps + since_toc_s * self.af2_sps2),
            af1_sps: self.af1_sps + 2.0 * since_toc_s * self.af2_sps2,
            ..self.clone()
        }
    }
}
