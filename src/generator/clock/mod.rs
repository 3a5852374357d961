//! The receiver's clock: its offset from GPS time.
//!
//! Clock minus true time = bias + drift · t + ageing · t² / 2, t being true time since the start, plus what
//! the antenna's acceleration does to the crystal and the oscillator's own noise ([`Oscillator`]). It moves
//! sampling instants and down-conversion alike, as one oscillator behind both does. Instants stay [`Epoch`]s,
//! so that nothing is lost to the size of a number of seconds. Limits: of the noise, what is quicker than a
//! second is known at [`nodes`], moves phases alone and is not in the instants here.

pub mod nodes;
pub mod oscillator;

use std::sync::Arc;

use crate::vehicle::shaking::Shaking;
use gnss::time::Epoch;
use oscillator::Oscillator;

/// A clock that is `bias_s` ahead of GPS time at the scene's start and gains `drift` seconds per second.
#[derive(Clone, Debug)]
pub struct ReceiverClock {
    /// Clock minus true time at the start, in seconds.
    pub bias_s: f64,
    /// Gain at the start, in seconds per second.
    pub drift: f64,
    /// Growth of the drift per second, in 1/s.
    pub ageing_per_s: f64,
    /// Frequency shift by the acceleration of the antenna.
    pub shaking: Option<Arc<Shaking>>,
    /// Noise of the oscillator.
    pub oscillator: Option<Arc<Oscillator>>,
}

impl ReceiverClock {
    /// Creates a clock of constant drift.
    pub const fn steady(bias_s: f64, drift: f64) -> Self {
        Self { bias_s, drift, ageing_per_s: 0.0, shaking: None, oscillator: None }
    }

    /// True GPS time at the time `local` of the clock: the t that solves t + offset(t) = local.
    ///
    /// Error below 2e-16 s plus 1e-16 of the correction.
    pub fn true_time(&self, start: Epoch, local: Epoch) -> Epoch {
        local.plus_s(-self.offset_at_reading_s(start, local))
    }

    /// True seconds since `start` at the time `local` of the clock; resolves 1e-16 of its size.
    pub fn true_elapsed_s(&self, start: Epoch, local: Epoch) -> f64 {
        local.since(start) - self.offset_at_reading_s(start, local)
    }

    /// Seconds of the clock since the start, `true_s` true seconds after the start; the inverse of
    /// [`Self::true_elapsed_s`] to a nanosecond.
    pub fn reading_elapsed_s(&self, start: Epoch, true_s: f64) -> f64 {
        let first = true_s + self.bias_s + self.drift * true_s;
        // The offset changes by less than 1e-4 of what the clock's time does.
        let second = true_s + self.offset_at_reading_s(start, start.plus_s(first));
        true_s + self.offset_at_reading_s(start, start.plus_s(second))
    }

    /// Clock minus true time in seconds at the time `local` of the clock, without fast noise. With x = local
    /// − start, the elapsed true time is (x − bias)/(1 + drift) = x − (bias + drift·x)/(1 + drift): the
    /// correction is small, so its rounding is too. Ageing and shaking are taken at that time: their own size
    /// times themselves, below 1e-15 s, is left out.
    pub fn offset_at_reading_s(&self, start: Epoch, local: Epoch) -> f64 {
        let elapsed_s = local.since(start);
        let drift = planted!("generator.clock.drift", self.drift, 1.05 * self.drift);
        let mut offset_s = (self.bias_s + drift * elapsed_s) / (1.0 + drift);
        if self.ageing_per_s != 0.0 || self.shaking.is_some() {
            let true_s = elapsed_s - offset_s;
            offset_s += 0.5 * self.ageing_per_s * true_s * true_s;
            offset_s += self.shaking.as_ref().map_or(0.0, |shaking| shaking.gained_s(true_s));
        }
        offset_s + self.oscillator.as_ref().map_or(0.0, |oscillator| oscillator.slow_s(elapsed_s))
    }

    /// Drift in s/s at the time `local` of the clock: over 20 ms around it, if it is
    /// not steady.
    pub fn drift_at_reading(&self, start: Epoch, local: Epoch) -> f64 {
        if self.ageing_per_s == 0.0 && self.shaking.is_none() && self.oscillator.is_none() {
            return self.drift;
        }
        let at = |dt_s: f64| self.offset_at_reading_s(start, local.plus_s(dt_s));
        (at(0.01) - at(-0.01)) / 0.02
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn true_time_of_a_reading_is_the_inverse_of_the_reading_after_a_day() {
        let start = Epoch::from_week(1590, 280_800.0);
        for (bias_s, drift) in [(0.0, 0.0), (1.3e-4, 5e-8), (-0.011_148_9, -2e-6), (0.3, 1e-5)] {
            let clock = ReceiverClock::steady(bias_s, drift);
            for t_s in [0.0, 1.0 / 3.0, 59.999, 86_400.123_456_789] {
                let truth = start.plus_s(t_s);
                let local = truth.plus_s(bias_s + drift * t_s);
                // Two additions to a fraction (1.1e-16 each) and the correction's own rounding: |bias + drift
                // t| is below 1.2 s here, half an ulp 1.1e-16, twice; x is rounded to 1.5e-11 s and enters
                // times drift.
                let tolerance_s = 5e-16 + 3e-11 * drift.abs();
                assert!(clock.true_time(start, local).since(truth).abs() <= tolerance_s, "{bias_s} {drift} {t_s}");
                // One f64 of 86 400 s has half an ulp of 7e-12 s.
                assert!((clock.true_elapsed_s(start, local) - t_s).abs() < 3e-11);
                assert!((local.since(truth) - (bias_s + drift * t_s)).abs() < 3e-16 + 3e-11 * drift.abs());
            }
        }
    }

    #[test]
    fn a_perfect_clock_changes_no_bit() {
        let start = Epoch::from_week(1590, 0.1);
        let local = Epoch::from_week(1590, 12_345.678);
        assert_eq!(ReceiverClock::steady(0.0, 0.0).true_time(start, local), local);
    }
}
