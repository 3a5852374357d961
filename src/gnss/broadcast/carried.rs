//! Propagation of an ephemeris to another reference time with the same orbit and clock, and to another day.
//!
//! Limits: a rate of the mean motion's correction and of the axis is left as it is, which ephemerides without
//! them have as zero.

use super::kepler::wrap;
use super::{Constants, Ephemeris};
use crate::satellite::System;
use crate::time::{Epoch, UTC};

/// Seconds of a day.
const DAY_S: i64 = 86_400;

impl Ephemeris {
    /// Returns the ephemeris of a satellite that passes whole days later over the same ground, with the same
    /// clock. The node refers to the beginning of the new week, and issues stay. Ephemerides of GLONASS keep
    /// their hour of UTC.
    pub fn moved(&self, days: i64) -> Self {
        let later = |at: Epoch| Epoch::new(at.seconds() + days * DAY_S, at.fraction());
        let moved = match self.sv.system {
            System::Glonass => self.clone().timed(|at| UTC.instant(later(UTC.label(at)))),
            _ => self.clone().timed(later),
        };
        let turned_s = moved.toe.tow_s() - self.toe.tow_s();
        let turned_rad = Constants::of(self.sv.system).rotation_radps * turned_s;
        let omega0_rad = if self.vector.is_some() { self.omega0_rad } else { wrap(self.omega0_rad + turned_rad) };
        Self { omega0_rad, ..moved }
    }

    /// The ephemeris with `at`, of the same week, as the reference time of orbit and clock; issues stay.
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

#[cfg(test)]
mod tests {
    use crate::rinex;
    use crate::time::Epoch;

    #[test]
    fn a_set_of_another_day_goes_over_the_same_ground_at_the_same_hour() {
        let sets = rinex::embedded_two_systems().unwrap().ephemerides;
        for set in sets.iter().step_by(3) {
            for days in [-4000, -7, 1, 3, 1000, 2200] {
                let moved = set.moved(days);
                let apart = moved.toe.since(set.toe);
                // GLONASS counts by UTC, which has fewer leap seconds in other years.
                let whole = days as f64 * 86_400.0;
                assert!((apart - whole).abs() <= if set.vector.is_some() { 10.0 } else { 0.0 }, "{} {apart}", set.sv);
                for minutes in [-60, 0, 47] {
                    let at = |toe: Epoch| toe.plus_s(f64::from(minutes) * 60.0);
                    let (here, there) = (set.state(at(set.toe)).unwrap(), moved.state(at(moved.toe)).unwrap());
                    // Rounding of the node, 1e-15 rad of 42 000 km, and of the elements' wrap: micrometres.
                    assert!((here.position_m - there.position_m).norm() < 1e-5, "{} {days}", set.sv);
                    assert!((here.velocity_mps - there.velocity_mps).norm() < 1e-8, "{} {days}", set.sv);
                    let clocks = [set.clock(at(set.toc)).unwrap(), moved.clock(at(moved.toc)).unwrap()];
                    assert!((clocks[0].offset_s - clocks[1].offset_s).abs() < 1e-17, "{} {days}", set.sv);
                }
                assert!(moved.is_healthy() == set.is_healthy() && moved.moved(-days).toe == set.toe);
            }
        }
    }
}
