//! The ionosphere as two carriers of a satellite show it: by the difference of their codes, which the
//! difference of their carriers smooths.
//!
//! P₂ − P₁ is I₁·(f₁²/f₂² − 1) but for group delays of the satellite, which its message says, and of the
//! receiver's bands, which nothing says (IS-GPS-200N, 20.3.3.3.3.3). Nothing but noise and reflections parts
//! both differences, so that they are averaged for much longer than a range. Limits: the receiver's bands,
//! alike for all satellites of the same signals; terms of higher order.

use super::combination::{Used, paired};
use super::{Sets, Solver};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::gps::l1ca::L1_CA;
use gnss::record::{IonosphereRow, Observation};

/// Window of the smoothing. Reflections pass in minutes; ten of them leave of a code's noise a fortieth.
pub(super) const WINDOW_S: f64 = 600.0;

impl Solver {
    /// The ionosphere of each satellite with two bands whose message says what their delays are.
    pub(super) fn measured_ionosphere(&mut self, observations: &[Observation], sets: &Sets) -> Vec<IonosphereRow> {
        let used = paired(observations);
        let mut one = |used: &Used<'_>| {
            let Used::Combined(pair) = used else { return None };
            let smoothed = self.dispersion.smooth_dispersion(pair);
            let sv = pair.first.sv;
            let set = sets.serving(sv, &[pair.first.signal, pair.second.signal])?;
            let delay_s = |row: &Observation| set.group_delay_s(row.signal);
            let apart_m = SPEED_OF_LIGHT_MPS * (delay_s(pair.second) - delay_s(pair.first));
            let apart_m = planted!("receiver.position.dispersion_delay", apart_m, -apart_m);
            let ((first_m, _), (second_m, _)) = (self.noise(pair.first)?, self.noise(pair.second)?);
            let ratio = pair.first.signal.carrier_hz(sv) / L1_CA.carrier_hz(sv);
            let on_l1 = planted!("receiver.position.dispersion_square", ratio * ratio, ratio);
            let sigma_m = pair.dispersed(libm::hypot(first_m, second_m)).abs() * smoothed.variance_ratio.sqrt();
            Some(IonosphereRow {
                sample: pair.first.sample,
                sv,
                delay_m: on_l1 * (smoothed.pseudorange_m - pair.dispersed(apart_m)),
                sigma_m: on_l1 * planted!("receiver.position.dispersion_sigma", 1.0, 0.5) * sigma_m,
            })
        };
        used.iter().filter_map(&mut one).collect()
    }
}
