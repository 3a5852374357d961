//! BDGIM as the true ionosphere: a group delay of the code, and an equal advance of the carrier.
//!
//! The coefficients of the model's forecast change every two hours, at once, by up to a few TECU. Nature does
//! not: here one interval passes into the next over [`MIDNIGHT_S`]. Limits: where the model's least content
//! begins its delay has a bend; above the shell the delay fades as in [`super::ionosphere`].

use crate::effect::ionosphere::{MIDNIGHT_S, delay_groups, share_above, smooth};
use crate::ray::{Effect, Ray, Sight};
use gnss::bdgim::{Bdgim, INTERVAL_S, Pierce, delay_s, forecast_tecu, interval};
use gnss::earth::{Geodetic, Look};
use gnss::signal::Signal;
use gnss::time::Epoch;

/// BDGIM with smooth transitions between its intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BdgimIonosphere {
    /// The model's coefficients.
    pub model: Bdgim,
}

impl BdgimIonosphere {
    /// Electrons along the line from `user` towards `look` at GPS time `at`, in TECU.
    pub fn stec_tecu(&self, user: Geodetic, look: Look, at: Epoch) -> f64 {
        let pierce = Pierce::new(user, look);
        let place = pierce.under_sun(at);
        let of = |interval: i64| self.model.vertical_tecu(&place, &forecast_tecu(interval));
        let (own, since_s) = interval(at);
        let half_s = 0.5 * MIDNIGHT_S;
        let mixed = |before: i64, after_s: f64| {
            let new = smooth((after_s + half_s) / MIDNIGHT_S);
            of(before) * (1.0 - new) + of(before + 1) * new
        };
        let left_s = INTERVAL_S as f64 - since_s;
        let vertical_tecu = if since_s < half_s {
            mixed(own - 1, since_s)
        } else if left_s < half_s {
            mixed(own, -left_s)
        } else {
            of(own)
        };
        pierce.obliquity * vertical_tecu * share_above(user.height_m)
    }
}

impl Effect for BdgimIonosphere {
    fn name(&self) -> &'static str {
        "ionosphere"
    }

    fn describe(&self) -> String {
        "BDGIM: code delayed, carrier advanced".to_owned()
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let tecu = self.stec_tecu(sight.user, sight.look, sight.received);
        delay_groups(rays, delay_s(tecu, signal.carrier_hz(sight.sv)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::time::BDT;

    #[test]
    fn no_even_hour_moves_the_content_by_a_step() {
        let model = Bdgim { alpha_tecu: [35.5, 2.0, 12.0, 13.375, -17.25, 1.125, 1.0, 3.0, 0.375] };
        let truth = BdgimIonosphere { model };
        let look = Look { azimuth_rad: 1.0, elevation_rad: 0.5 };
        let mut printed: f64 = 0.0;
        for (latitude, longitude) in [(10.0, 100.0), (-25.0, -60.0), (55.0, 10.0)] {
            let user = Geodetic::from_degrees(latitude, longitude, 50.0);
            for hour in (0..24).step_by(2) {
                let even = BDT.instant(Epoch::parse("2023-03-12T00:00:00").unwrap().plus_s(3600.0 * f64::from(hour)));
                let at = |s: f64| truth.stec_tecu(user, look, even.plus_s(s));
                let pierce = Pierce::new(user, look);
                let exact = |s: f64| {
                    let forecast = forecast_tecu(interval(even.plus_s(s)).0);
                    pierce.obliquity * model.vertical_tecu(&pierce.under_sun(even.plus_s(s)), &forecast)
                };
                let step = (exact(0.0) - exact(-1e-3)).abs();
                printed = printed.max(step);
                let (mut before, mut largest): (f64, f64) = (at(-900.0), 0.0);
                for k in -89..=90 {
                    let now = at(10.0 * f64::from(k));
                    largest = largest.max((now - before).abs());
                    before = now;
                }
                // Ten seconds of a day's way, at most 60 TECU in an hour, and 1.875 / 120 of the step.
                assert!(largest < 0.17 + 0.016 * step, "{latitude} {hour}: {largest} of {step}");
                // Away from the ends it is the printed model, and at its middle half way.
                assert_eq!(at(-601.0), exact(-601.0));
                assert_eq!(at(601.0), exact(601.0));
                assert!((at(0.0) - 0.5 * (exact(0.0) + exact(-1e-6))).abs() < 1e-3);
            }
        }
        // The law can fail: the printed model steps.
        assert!(printed > 0.5, "{printed}");
    }
}
