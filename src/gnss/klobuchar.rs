//! The broadcast ionosphere: Klobuchar's eight coefficients and the user algorithm.
//!
//! Source: IS-GPS-200N, 20.3.3.5.2.5 and figure 20-4. It removes about half of the true delay.

use crate::gnss::earth::{Geodetic, Look};
use crate::gnss::time::Epoch;

/// The eight broadcast coefficients, in the document's units (seconds and powers of semicircles).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Klobuchar {
    pub alpha: [f64; 4],
    pub beta: [f64; 4],
}

impl Klobuchar {
    /// Group delay on a carrier of `carrier_hz`, in seconds, seen from `user` towards `look` at GPS time `at`.
    pub fn delay_s(&self, user: Geodetic, look: Look, at: Epoch, carrier_hz: f64) -> f64 {
        let _ = (user, look, at, carrier_hz);
        todo!()
    }
}
