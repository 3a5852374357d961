//! The receiver's clock: how far its reading is from GPS time.
//!
//! Model: reading − true time = bias + drift × (true time − start), the first two terms of a clock
//! polynomial. Noise of an oscillator is not modelled. Instants stay [`Epoch`]s, so that nothing is
//! lost to the size of a number of seconds.

use crate::gnss::time::Epoch;

/// A clock that is `bias_s` ahead of GPS time at the scene's start and gains `drift` seconds a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverClock {
    /// Reading minus true time at the start.
    pub bias_s: f64,
    /// Gain, in seconds a second.
    pub drift: f64,
}

impl ReceiverClock {
    /// A clock that reads GPS time.
    pub const PERFECT: Self = Self { bias_s: 0.0, drift: 0.0 };

    /// Reading minus true time, `t_s` true seconds after the start.
    pub fn bias_at(&self, t_s: f64) -> f64 {
        self.bias_s + self.drift * t_s
    }

    /// True GPS time when the clock reads `local`: the t that solves t + bias + drift·(t − start) = local.
    ///
    /// Error below 2e-16 s plus 1e-16 of the correction.
    pub fn true_time(&self, start: Epoch, local: Epoch) -> Epoch {
        local.plus_s(-self.offset_at_reading_s(start, local))
    }

    /// True seconds since `start` when the clock reads `local`; resolves 1e-16 of its size.
    pub fn true_elapsed_s(&self, start: Epoch, local: Epoch) -> f64 {
        local.since(start) - self.offset_at_reading_s(start, local)
    }

    /// What the clock reads at GPS time `at`.
    pub fn reading(&self, start: Epoch, at: Epoch) -> Epoch {
        at.plus_s(self.bias_at(at.since(start)))
    }

    /// Reading minus true time when the clock reads `local`. With x = local − start, the elapsed true time is
    /// (x − bias)/(1 + drift) = x − (bias + drift·x)/(1 + drift): the correction is small, so its rounding is too.
    fn offset_at_reading_s(&self, start: Epoch, local: Epoch) -> f64 {
        (self.bias_s + self.drift * local.since(start)) / (1.0 + self.drift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn true_time_of_a_reading_is_the_inverse_of_the_reading_after_a_day() {
        let start = Epoch::from_week(1590, 280_800.0);
        for (bias_s, drift) in [(0.0, 0.0), (1.3e-4, 5e-8), (-0.011_148_9, -2e-6), (0.3, 1e-5)] {
            let clock = ReceiverClock { bias_s, drift };
            for t_s in [0.0, 1.0 / 3.0, 59.999, 86_400.123_456_789] {
                let truth = start.plus_s(t_s);
                let local = clock.reading(start, truth);
                // Two additions to a fraction (1.1e-16 each) and the correction's own rounding: |bias + drift t|
                // is below 1.2 s here, half an ulp 1.1e-16, twice; x is rounded to 1.5e-11 s and enters times drift.
                let tolerance_s = 5e-16 + 3e-11 * drift.abs();
                assert!(clock.true_time(start, local).since(truth).abs() <= tolerance_s, "{bias_s} {drift} {t_s}");
                // One f64 of 86 400 s has half an ulp of 7e-12 s.
                assert!((clock.true_elapsed_s(start, local) - t_s).abs() < 3e-11);
                assert!((local.since(truth) - clock.bias_at(t_s)).abs() < 3e-16 + 3e-11 * drift.abs());
            }
        }
    }

    #[test]
    fn a_perfect_clock_changes_no_bit() {
        let start = Epoch::from_week(1590, 0.1);
        let local = Epoch::from_week(1590, 12_345.678);
        assert_eq!(ReceiverClock::PERFECT.true_time(start, local), local);
    }
}
