//! Hatch's filter on a satellite's code: bias by code-carrier divergence, and the remaining noise.
//!
//! Written from the settings, not from the receiver's code. The weight of a new code value falls from one to
//! interval over window, and a break of lock or a gap begins again. Noise of a first-order code loop is
//! correlated as exp(−4Bt). Its variance is propagated with its covariance (`smoothing_s` and
//! `dll_bandwidth_hz`). Limits: loops of other orders have other correlations.

/// A gap longer than this breaks the carrier.
const LONGEST_GAP_S: f64 = 1.05;

/// One satellite's filter.
#[derive(Clone, Copy, Debug)]
pub struct Smoothing {
    window_s: f64,
    bandwidth_hz: f64,
    state: Option<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    time_s: f64,
    locked_s: f64,
    age_s: f64,
    value_m: f64,
    variance: f64,
    covariance: f64,
}

/// Output of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    /// Smoothed difference of code and carrier.
    pub value_m: f64,
    /// Variance of its noise over that of one code value.
    pub variance_ratio: f64,
    /// Memory of the filter in seconds: twice the mean age of the values that it holds.
    pub memory_s: f64,
}

impl Smoothing {
    /// A filter of `window_s` (0 for none) over code loops of `bandwidth_hz`.
    pub fn new(window_s: f64, bandwidth_hz: f64) -> Self {
        Self { window_s, bandwidth_hz, state: None }
    }

    /// Takes the difference of code and carrier at a time.
    pub fn take(&mut self, time_s: f64, locked_s: f64, value_m: f64) -> Smoothed {
        let fresh = State { time_s, locked_s, age_s: 0.0, value_m, variance: 1.0, covariance: 1.0 };
        let next = self.state.and_then(|old| self.step(&old, &fresh)).unwrap_or(fresh);
        self.state = Some(next);
        let memory_s = (1.0 / (2.0 * self.bandwidth_hz)).max(next.age_s.min(2.0 * self.window_s));
        Smoothed { value_m: next.value_m, variance_ratio: next.variance, memory_s }
    }

    fn step(&self, old: &State, new: &State) -> Option<State> {
        let passed_s = new.time_s - old.time_s;
        let whole = passed_s > 0.0 && passed_s <= LONGEST_GAP_S && new.locked_s > old.locked_s;
        if !whole || self.window_s <= 0.0 {
            return None;
        }
        let age_s = old.age_s + passed_s;
        let weight = (passed_s / (age_s + passed_s).min(self.window_s)).min(1.0);
        let rest = 1.0 - weight;
        let carried = libm::exp(-4.0 * self.bandwidth_hz * passed_s) * old.covariance;
        Some(State {
            age_s,
            value_m: old.value_m + weight * (new.value_m - old.value_m),
            variance: weight * weight + rest * rest * old.variance + 2.0 * weight * rest * carried,
            covariance: weight + rest * carried,
            ..*new
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_lags_by_the_window_and_a_break_begins_anew() {
        let mut filter = Smoothing::new(10.0, 0.5);
        let mut last = filter.take(0.0, 1.0, 0.0);
        for k in 1..3000 {
            let t_s = 0.1 * f64::from(k);
            last = filter.take(t_s, 1.0 + t_s, 2e-3 * t_s);
        }
        // An exponential window of 100 steps lags by 99 of them: 9.9 s of 2 mm/s behind 299.9 s.
        assert!((last.value_m - (0.5998 - 0.0198)).abs() < 1e-5, "{last:?}");
        // Noise correlated over 1/(4B) = 0.5 s, averaged with an exponential window of 10 s: 0.5/10 of the
        // variance at 10 % or so.
        assert!((last.variance_ratio - 0.05).abs() < 0.005, "{last:?}");
        let fresh = filter.take(300.0, 0.2, 7.0);
        assert_eq!((fresh.value_m, fresh.variance_ratio), (7.0, 1.0));
    }
}
