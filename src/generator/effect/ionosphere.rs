//! Klobuchar's model as the true ionosphere: a group delay of the code, and an equal advance of the carrier.
//!
//! Klobuchar's model (IS-GPS-200N, 20.3.3.5.2.5) taken for true, so that a receiver that applies the
//! broadcast coefficients removes it. As printed the model steps by 2 % of its bulge (6 to 20 cm) where the
//! cosine series ends, which nature does not: here the bulge fades to zero over the last
//! [`FADE_RAD`] of its phase, and where local time wraps at midnight inside a bulge longer than 40 h, one
//! day passes into the next over [`MIDNIGHT_S`]. Elsewhere the delay is the printed one to the last bit.
//! Limits: where the bulge ends the fade differs from the printed delay by up to 0.16 m. The printed model's
//! shell is a sphere on which the user's geodetic latitude replaces the geocentric one, which moves the
//! delay by up to 0.13 m. The model is meant for users below the ionosphere; it is applied in full below 350
//! km, fades to zero at 1000 km and is absent above.

use crate::ray::{Effect, Ray, Sight};
use gnss::earth::{Geodetic, Look};
use gnss::klobuchar::{Bulge, DAY_S, Klobuchar, L1_HZ, NIGHT_S, SERIES_END_RAD, cosine_series};
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Phase over which the bulge fades: 0.03 rad is 6 min at the shortest period. The delay then differs from
/// the printed one by less than 3 % of the bulge's amplitude, little more than the step itself.
pub const FADE_RAD: f64 = 0.03;
/// Duration in seconds of the transition from one day's bulge to the next, at local midnight.
pub const MIDNIGHT_S: f64 = 1200.0;
/// Heights between which the delay fades, in metres.
const SHELL_M: f64 = 350e3;
const TOP_M: f64 = 1000e3;

/// Klobuchar's ionosphere with smooth edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KlobucharIonosphere {
    /// The model's eight coefficients.
    pub model: Klobuchar,
    /// Carrier frequency in Hz on which the coefficients give the delay: L1, or L5 of NavIC.
    pub defined_hz: f64,
}

impl KlobucharIonosphere {
    /// Creates the effect from GPS coefficients.
    pub fn of_gps(model: Klobuchar) -> Self {
        Self { model, defined_hz: L1_HZ }
    }

    /// Group delay in seconds on `carrier_hz` from `user` towards `look` at GPS time `at`. It is twice
    /// continuously differentiable in time, except where the printed model's limits on φ, AMP and PER act.
    pub fn delay_s(&self, user: Geodetic, look: Look, at: Epoch, carrier_hz: f64) -> f64 {
        let bulge = self.model.bulge(user, look, at);
        let scale = self.defined_hz / carrier_hz;
        bulge.obliquity * (NIGHT_S + day_s(&bulge)) * scale * scale * share_above(user.height_m)
    }
}

/// Applies the effect of electrons to every ray: the code is delayed by a group delay in seconds, the carrier
/// is advanced by as much.
pub(super) fn delay_groups(rays: &mut [Ray], delay_s: f64) {
    for ray in rays {
        ray.code_delay_s += planted!("generator.ionosphere.code", delay_s, 0.9 * delay_s);
        ray.carrier_delay_s -= planted!("generator.ionosphere.carrier_sign", delay_s, -delay_s);
    }
}

impl Effect for KlobucharIonosphere {
    fn name(&self) -> &'static str {
        "ionosphere"
    }

    fn describe(&self) -> String {
        "Klobuchar's model: code delayed, carrier advanced".to_owned()
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        delay_groups(rays, self.delay_s(sight.user, sight.look, sight.received, signal.carrier_hz(sight.sv)));
    }
}

/// Fraction of the ionosphere above a height in metres, from 1 on the ground to 0 at its top.
pub(crate) fn share_above(height_m: f64) -> f64 {
    1.0 - smooth((height_m - SHELL_M) / (TOP_M - SHELL_M))
}

/// The bulge at its local time, with the neighbouring day's mixed in around midnight.
fn day_s(bulge: &Bulge) -> f64 {
    let (local_s, half_s) = (bulge.local_s, MIDNIGHT_S / 2.0);
    let at = |local_s: f64| faded(&Bulge { local_s, ..*bulge });
    if local_s < half_s {
        let new = smooth((local_s + half_s) / MIDNIGHT_S);
        at(local_s) * new + at(local_s + DAY_S) * (1.0 - new)
    } else if local_s > DAY_S - half_s {
        let new = smooth((local_s - DAY_S + half_s) / MIDNIGHT_S);
        at(local_s - DAY_S) * new + at(local_s) * (1.0 - new)
    } else {
        at(local_s)
    }
}

fn faded(bulge: &Bulge) -> f64 {
    let phase_rad = bulge.phase_rad();
    if phase_rad.abs() >= SERIES_END_RAD {
        return 0.0;
    }
    let left = smooth((SERIES_END_RAD - phase_rad.abs()) / FADE_RAD);
    bulge.amplitude_s * cosine_series(phase_rad) * left
}

/// Quintic from 0 to 1 over [0, 1], flat outside.
pub(crate) fn smooth(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::earth::SPEED_OF_LIGHT_MPS;

    const PRINTED: Klobuchar =
        Klobuchar { alpha: [1.118e-8, -7.451e-9, -5.961e-8, 1.192e-7], beta: [1.167e5, -2.294e5, -1.311e5, 1.049e6] };

    fn printed_and_true_m(model: Klobuchar, latitude: f64, tow_s: f64) -> (f64, f64) {
        let user = Geodetic::from_degrees(latitude, 0.0, 100.0);
        let look = Look { azimuth_rad: 1.0, elevation_rad: 0.3 };
        let at = Epoch::from_week(1590, tow_s);
        (
            model.delay_s(user, look, at, L1_HZ) * SPEED_OF_LIGHT_MPS,
            KlobucharIonosphere::of_gps(model).delay_s(user, look, at, L1_HZ) * SPEED_OF_LIGHT_MPS,
        )
    }

    #[test]
    fn no_time_of_day_moves_the_delay_by_a_step() {
        let long = Klobuchar { beta: [2e5, 0.0, 0.0, 0.0], ..PRINTED };
        for (model, latitude) in [(PRINTED, 10.0), (PRINTED, 50.0), (long, 10.0)] {
            let mut largest_step: f64 = 0.0;
            let mut printed_step: f64 = 0.0;
            let mut before = printed_and_true_m(model, latitude, 0.0);
            for k in 1..86_400 {
                let now = printed_and_true_m(model, latitude, f64::from(k));
                printed_step = printed_step.max((now.0 - before.0).abs());
                largest_step = largest_step.max((now.1 - before.1).abs());
                before = now;
            }
            // A bulge of 20 m with a period of 20 h moves by 2 mm/s at most; its fade adds
            // 0.05 * 20 m * 1.875 / 340 s, midnight of the long one 1.875 * 4 m / 1200 s.
            assert!(largest_step < 9e-3, "{latitude}: {largest_step}");
            // The law can fail: the printed model does step.
            assert!(printed_step > 0.03, "{latitude}: {printed_step}");
        }
    }

    #[test]
    fn away_from_its_edges_the_delay_is_the_printed_one() {
        let mut same = 0;
        for k in 0..1440 {
            let (printed, smoothed) = printed_and_true_m(PRINTED, 26.5, 60.0 * f64::from(k));
            // The largest of the series times 1 − fade is 2.5 %, of a bulge below 10 m.
            assert!((printed - smoothed).abs() < 0.3, "{k}");
            same += usize::from(printed == smoothed);
        }
        // Two fades of 0.03 rad at periods up to 1.2e5 s are 19 min.
        assert!((1440 - 24..1440).contains(&same), "{same}");
    }

    #[test]
    fn code_is_delayed_by_what_the_carrier_is_advanced() {
        let effect = KlobucharIonosphere::of_gps(PRINTED);
        let sight = crate::effect::link::tests::sight(30.0, 0.0);
        let mut rays = vec![Ray { code_delay_s: 1.0, carrier_delay_s: 1.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        effect.act(&sight, &gnss::gps::l1ca::L1_CA, &mut rays);
        assert!(rays[0].code_delay_s > 1.0 && rays[0].code_delay_s + rays[0].carrier_delay_s == 2.0);
        let high = crate::effect::link::tests::sight(30.0, 1.1e6);
        let mut above = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        effect.act(&high, &gnss::gps::l1ca::L1_CA, &mut above);
        assert_eq!(above[0].code_delay_s, 0.0);
    }
}
