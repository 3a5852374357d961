//! Carrier-smoothed code (R. Hatch, 1982): the code's mean, the carrier's short-term course.
//!
//! The window grows to its limit; a break of the carrier starts it anew. Code and carrier diverge by twice the
//! ionosphere, so with a window of T seconds and an ionosphere changing by İ the bias is about 2 İ T.

use std::collections::BTreeMap;

use crate::gnss::record::Observation;
use crate::gnss::satellite::Sv;

/// A satellite's running mean.
#[derive(Clone, Copy, Debug)]
struct Mean {
    /// Smoothed pseudorange minus carrier, in metres.
    offset_m: f64,
    count: f64,
    locked_s: f64,
}

/// Smoothers of all satellites.
#[derive(Clone, Debug, Default)]
pub struct Smoother {
    means: BTreeMap<(Sv, &'static str), Mean>,
}

/// A smoothed pseudorange, and the number of independent epochs in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    pub pseudorange_m: f64,
    pub epochs: f64,
}

impl Smoother {
    /// Takes an observation in. `window` is the number of epochs at most averaged; `settled` tells whether the code loop
    /// has left its pull-in, before which nothing is averaged.
    pub fn smooth(&mut self, observation: &Observation, window: f64, settled: bool) -> Smoothed {
        let key = (observation.sv, observation.signal.name);
        let carrier_m = observation.carrier_cycles * observation.signal.wavelength_m();
        let offset_m = observation.pseudorange_m - carrier_m;
        let fresh = Mean { offset_m, count: 1.0, locked_s: observation.locked_s };
        let mean = match self.means.get(&key) {
            // A lock that is younger than before is another lock.
            Some(old) if settled && observation.locked_s > old.locked_s => {
                let count = (old.count + 1.0).min(window.max(1.0));
                let offset_m = old.offset_m + (offset_m - old.offset_m) / count;
                Mean { offset_m, count, locked_s: observation.locked_s }
            }
            _ => fresh,
        };
        self.means.insert(key, mean);
        Smoothed { pseudorange_m: mean.offset_m + carrier_m, epochs: mean.count }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::gps::l1ca::L1_CA;

    fn observation(k: u64, code_m: f64, carrier_m: f64, locked_s: f64) -> Observation {
        Observation {
            sample: k,
            sv: Sv::gps(3),
            signal: &L1_CA,
            sent_s: 0,
            sent_fraction_s: 0.0,
            pseudorange_m: code_m,
            carrier_cycles: carrier_m / L1_CA.wavelength_m(),
            doppler_hz: 0.0,
            cn0_dbhz: 45.0,
            locked_s,
        }
    }

    #[test]
    fn alternating_code_errors_vanish_motion_stays_and_a_new_lock_starts_anew() {
        let mut smoother = Smoother::default();
        let mut last = Smoothed { pseudorange_m: 0.0, epochs: 0.0 };
        for k in 0..200_u64 {
            let range_m = 2e7 + 300.0 * k as f64;
            let error_m = if k % 2 == 0 { 1.0 } else { -1.0 };
            last = smoother.smooth(&observation(k, range_m + error_m, range_m - 5e6, 1.0 + k as f64), 1e9, true);
        }
        assert!((last.pseudorange_m - (2e7 + 300.0 * 199.0)).abs() < 1e-6 && last.epochs == 200.0);
        let broken = smoother.smooth(&observation(201, 2.1e7, -9e6, 0.1), 1e9, true);
        assert_eq!((broken.epochs, broken.pseudorange_m), (1.0, 2.1e7));
    }
}
