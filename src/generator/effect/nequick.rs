//! NeQuick-G as the true ionosphere: a group delay of the code, and an equal advance of the carrier.
//!
//! The model as its document has it steps at 0 h UT: by a day of the Sun's declination, up to 2 cm, and at
//! the end of a month by the next month's maps, by metres and at night severalfold. Nature does neither: here
//! one day passes into the next over [`MIDNIGHT_S`]. Limits: at the end of a month that is still faster than
//! any ionosphere; the F1 layer begins and ends at sunrise and sunset within seconds, as the document has it,
//! which bends a delay by up to 3 mm in ten seconds.

use nalgebra::Vector3;

use crate::effect::ionosphere::{MIDNIGHT_S, delay_groups, smooth};
use crate::ray::{Effect, Ray, Sight};
use gnss::earth::Geodetic;
use gnss::nequick::{NequickG, delay_s};
use gnss::signal::Signal;
use gnss::time::Epoch;

/// NeQuick-G with smooth midnights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NequickIonosphere {
    /// The model's coefficients.
    pub model: NequickG,
}

impl NequickIonosphere {
    /// Electrons along the line from `user` to `satellite_m` (earth-fixed) at GPS time `at`, in TECU.
    pub fn stec_tecu(&self, user: Geodetic, satellite_m: &Vector3<f64>, at: Epoch) -> f64 {
        let satellite = Geodetic::from_ecef(satellite_m);
        let of = |(month, ut_h): (u8, f64)| self.model.stec_tecu(user, satellite, month, ut_h);
        let (month, ut_h) = at.month_and_hour();
        let half_h = 0.5 * MIDNIGHT_S / 3600.0;
        // The hours of the neighbouring day go on beyond its end.
        let (before, after, since_h) = if ut_h < half_h {
            ((at.plus_s(-MIDNIGHT_S).month_and_hour().0, ut_h + 24.0), (month, ut_h), ut_h)
        } else if ut_h > 24.0 - half_h {
            ((month, ut_h), (at.plus_s(MIDNIGHT_S).month_and_hour().0, ut_h - 24.0), ut_h - 24.0)
        } else {
            return of((month, ut_h));
        };
        let new = smooth((since_h + half_h) / (2.0 * half_h));
        of(before) * (1.0 - new) + of(after) * new
    }
}

impl Effect for NequickIonosphere {
    fn name(&self) -> &'static str {
        "ionosphere"
    }

    fn describe(&self) -> String {
        "NeQuick-G: code delayed, carrier advanced".to_owned()
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let tecu = self.stec_tecu(sight.user, &sight.satellite.position_m, sight.received);
        delay_groups(rays, delay_s(tecu, signal.carrier_hz(sight.sv)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_midnight_moves_the_delay_by_a_step_not_even_that_of_a_month() {
        let truth = NequickIonosphere { model: NequickG { coefficients: [120.0, 0.35, 0.0135] } };
        let user = Geodetic::from_degrees(20.0, -150.0, 100.0);
        let satellite_m = Geodetic::from_degrees(30.0, -160.0, 2.3e7).to_ecef();
        let mut printed: f64 = 0.0;
        for midnight in ["2020-11-29T00:00:00", "2020-12-01T00:00:00"] {
            let midnight = Epoch::parse(midnight).unwrap();
            let at = |s: f64| truth.stec_tecu(user, &satellite_m, midnight.plus_s(s));
            let (mut before, mut largest): (f64, f64) = (at(-1200.0), 0.0);
            for k in -120..=120 {
                let now = at(10.0 * f64::from(k));
                largest = largest.max((now - before).abs());
                before = now;
            }
            let exact = |s: f64| {
                let (month, ut_h) = midnight.plus_s(s).month_and_hour();
                truth.model.stec_tecu(user, Geodetic::from_ecef(&satellite_m), month, ut_h)
            };
            let step = (exact(0.0) - exact(-1e-3)).abs();
            printed = printed.max(step);
            // Ten seconds of a day's way, 40 TECU in six hours, and 1.875 / 120 of the step.
            assert!(largest < 0.03 + 0.016 * step, "{largest} of {step}");
            // Away from midnight it is the printed model, and at its middle half way.
            assert_eq!(at(-601.0), exact(-601.0));
            assert!((at(0.0) - 0.5 * (exact(0.0) + exact(-1e-6))).abs() < 1e-3);
        }
        // The law can fail: the printed model steps where a month begins.
        assert!(printed > 0.5, "{printed}");
    }
}
