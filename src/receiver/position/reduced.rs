//! Reduced elements: a substitute until a satellite's complete ephemeris is decoded.
//!
//! Their ranges are weighted by the error of the elements, found by comparison with complete ephemerides: of
//! the real words of an hour of 2025 and of what is sent for the ephemerides of 2020-11-29, below. Elements
//! without group delays have that of single-frequency users in their error as well. Limits: the error is the
//! same from epoch to epoch, though counted as independent; nothing shows whose elements they are but the
//! code, as the word names no satellite.

use super::Solver;
use gnss::broadcast::Ephemeris;
use gnss::galileo::inav::REDUCED_VALID_S;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Standard deviation of a range by the elements.
const ELEMENTS_M: f64 = 2.0;
/// Standard deviation in metres of a group delay that is not known yet.
const DELAY_M: f64 = 1.5;

/// Reduced elements of a satellite.
#[derive(Clone, Debug)]
pub(super) struct InShort {
    pub set: Ephemeris,
    /// Standard deviation of a range by it.
    pub sigma_m: f64,
}

impl InShort {
    /// True if it describes the orbit at a time, and the clock of some signals.
    pub(super) fn serves(&self, signals: &[&'static Signal], at: Epoch) -> bool {
        let holds = (0.0..=REDUCED_VALID_S).contains(&at.since(self.set.toe));
        holds && signals.iter().all(|signal| (self.set.form.serves)(signal))
    }
}

impl Solver {
    /// Takes reduced elements, if the settings want them: they serve until a complete ephemeris does. Whether
    /// they are the satellite's first ones.
    pub fn take_reduced(&mut self, set: Ephemeris, with_delays: bool) -> bool {
        let sigma_m = if with_delays { ELEMENTS_M } else { libm::hypot(ELEMENTS_M, DELAY_M) };
        self.settings.reduced_elements && self.reduced.insert(set.sv, InShort { set, sigma_m }).is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::position::{CodeNoise, PositionSettings, Sets};
    use crate::track::CodeDiscriminator;
    use crate::track::loops::CodeShape;
    use gnss::galileo::e1::E1;
    use gnss::record::Observation;
    use gnss::rinex;
    use gnss::satellite::System;
    use gnss::time::Rate;

    #[test]
    fn elements_in_short_serve_for_ten_minutes_until_the_whole_set_does_and_only_if_wanted() {
        let all = rinex::embedded_two_systems().unwrap().ephemerides;
        let set = all.into_iter().find(|set| set.sv.system == System::Galileo && set.is_healthy()).unwrap();
        let noise = CodeNoise {
            chip_m: 293.0,
            share: 1.0,
            shape: CodeShape::triangle(0.5),
            discriminator: CodeDiscriminator::EarlyMinusLate,
            bandwidth_hz: 1.0,
            integration_s: 4e-3,
        };
        let solver = |reduced_elements: bool| {
            let settings = PositionSettings { reduced_elements, ..PositionSettings::default() };
            Solver::new(&settings, vec![(&E1, noise)], Rate::from_hz(1e6).unwrap())
        };
        let sent = |after_s: f64| Observation {
            sample: 0,
            sv: set.sv,
            signal: &E1,
            sent_s: set.toe.plus_s(after_s).seconds(),
            sent_fraction_s: 0.0,
            pseudorange_m: 2.5e7,
            carrier_cycles: 0.0,
            doppler_hz: 0.0,
            cn0_dbhz: 45.0,
            locked_s: 1.0,
        };
        let none = Sets::default();
        let mut wants = solver(true);
        assert!(wants.ranges(&[sent(60.0)], &none).plain.is_empty());
        assert!(wants.take_reduced(set.clone(), false) && !wants.take_reduced(set.clone(), false));
        let noise_m = |solver: &mut Solver, after_s: f64, whole: &Sets| -> Vec<f64> {
            solver.ranges(&[sent(after_s)], whole).plain.iter().map(|range| range.noise_m).collect()
        };
        // 2 m of elements and 1.5 m of a delay that is not known; code noise is 0.4 m.
        assert!(matches!(noise_m(&mut wants, 60.0, &none)[..], [sigma_m] if (2.5..2.7).contains(&sigma_m)));
        assert!(noise_m(&mut wants, 601.0, &none).is_empty() && noise_m(&mut wants, -1.0, &none).is_empty());
        assert!(!wants.take_reduced(set.clone(), true));
        assert!(matches!(noise_m(&mut wants, 60.0, &none)[..], [sigma_m] if (2.0..2.2).contains(&sigma_m)));
        let whole: Sets = [set.clone()].into_iter().collect();
        assert!(matches!(noise_m(&mut wants, 60.0, &whole)[..], [sigma_m] if sigma_m < 1.0));
        let mut other = solver(false);
        assert!(!other.take_reduced(set.clone(), true) && noise_m(&mut other, 60.0, &none).is_empty());
    }
}
