//! Electrons on the way to each satellite by NeQuick-G, an integral of a tenth of a millisecond each.
//!
//! A content is kept for a second: at the horizon under the strongest Sun, where it changes most, that is 3
//! cm of delay in 43 m.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::least_squares::Range;
use gnss::earth::Geodetic;
use gnss::nequick::NequickG;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Time in seconds after which a content is integrated again.
const KEPT_S: f64 = 1.0;
/// Distance in metres after which a content is integrated again.
const KEPT_M: f64 = 1000.0;

/// The latest contents.
#[derive(Clone, Debug, Default)]
pub struct Electrons {
    model: Option<NequickG>,
    latest: BTreeMap<Sv, Content>,
}

#[derive(Clone, Copy, Debug)]
struct Content {
    emitted: Epoch,
    place_m: Vector3<f64>,
    tecu: f64,
}

impl Electrons {
    /// Contents on the way from the satellites of `ranges` to a position, in TECU.
    pub fn of(&mut self, model: NequickG, ranges: &[Range], place_m: &Vector3<f64>) -> Vec<(Sv, f64)> {
        if self.model.replace(model) != Some(model) {
            self.latest.clear();
        }
        self.latest.retain(|sv, _| ranges.iter().any(|range| range.sv == *sv));
        let user = Geodetic::from_ecef(place_m);
        for range in ranges {
            let fresh = |content: &Content| {
                range.emitted.since(content.emitted).abs() < KEPT_S && (place_m - content.place_m).norm() < KEPT_M
            };
            if !self.latest.get(&range.sv).is_some_and(fresh) {
                // That the Earth turns while the signal travels moves the satellite by a millionth of its
                // way.
                let satellite = Geodetic::from_ecef(&range.satellite.position_m);
                let (month, ut_h) = range.emitted.month_and_hour();
                let tecu = model.stec_tecu(user, satellite, month, ut_h);
                self.latest.insert(range.sv, Content { emitted: range.emitted, place_m: *place_m, tecu });
            }
        }
        self.latest.iter().map(|(sv, content)| (*sv, content.tecu)).collect()
    }
}
