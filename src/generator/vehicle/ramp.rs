//! A change of one quantity whose rate rises, holds and falls linearly: what keeps jerk finite.

/// A change by [`Ramp::delta`]: the rate grows from 0 over `ramp_s`, holds for `hold_s` and falls back to 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Rate while it holds, with the sign of the change.
    pub rate: f64,
    /// Time in which it grows, and in which it falls.
    pub ramp_s: f64,
    /// Time in which it is whole.
    pub hold_s: f64,
}

impl Ramp {
    /// The quickest change by `delta` whose rate stays within `max_rate` and whose rate's slope is at most
    /// `max_slope` (both positive).
    pub fn quickest(delta: f64, max_rate: f64, max_slope: f64) -> Self {
        let size = delta.abs();
        let ramp_s = max_rate / max_slope;
        if size >= max_rate * ramp_s {
            Self { rate: max_rate.copysign(delta), ramp_s, hold_s: size / max_rate - ramp_s }
        } else {
            let peak = (size * max_slope).sqrt();
            Self { rate: peak.copysign(delta), ramp_s: peak / max_slope, hold_s: 0.0 }
        }
    }

    /// Duration of the change, in seconds.
    pub fn duration_s(&self) -> f64 {
        2.0 * self.ramp_s + self.hold_s
    }

    /// The whole change.
    pub fn delta(&self) -> f64 {
        self.rate * (self.ramp_s + self.hold_s)
    }

    /// Instants, from the beginning of the change, at which the rate's slope jumps; ascending and distinct.
    pub fn corners_s(&self) -> Vec<f64> {
        let mut corners = vec![0.0, self.ramp_s, self.ramp_s + self.hold_s, self.duration_s()];
        corners.dedup_by(|b, a| *b <= *a);
        corners
    }

    /// Change after `t_s`, and its rate per second.
    pub fn at(&self, t_s: f64) -> (f64, f64) {
        let left_s = self.duration_s() - t_s;
        if t_s <= 0.0 {
            (0.0, 0.0)
        } else if left_s <= 0.0 {
            (self.delta(), 0.0)
        } else if t_s < self.ramp_s {
            let rate = self.rate * (t_s / self.ramp_s);
            (0.5 * rate * t_s, rate)
        } else if left_s < self.ramp_s {
            let rate = self.rate * (left_s / self.ramp_s);
            (self.delta() - 0.5 * rate * left_s, rate)
        } else {
            (self.rate * (t_s - 0.5 * self.ramp_s), self.rate)
        }
    }

    /// Integral of the change over time, from its beginning to `t_s` within the change.
    pub fn integral(&self, t_s: f64) -> f64 {
        let third = |t: f64| self.rate * t * t * t / (6.0 * self.ramp_s);
        let held = |t: f64| {
            let s = t - self.ramp_s;
            third(self.ramp_s) + self.rate * (0.5 * self.ramp_s * s + 0.5 * s * s)
        };
        let left_s = self.duration_s() - t_s;
        if self.ramp_s == 0.0 || t_s <= 0.0 {
            0.0
        } else if t_s <= self.ramp_s {
            third(t_s)
        } else if left_s >= self.ramp_s {
            held(t_s)
        } else {
            // The change is antisymmetric about its middle: its integral is delta·(t − half) +
            // integral(left).
            self.delta() * (t_s - 0.5 * self.duration_s()) + third(left_s.max(0.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_respects_its_limits_and_arrives() {
        for (delta, rate, slope) in [(25.0, 2.5, 1.5), (-1.0, 3.0, 0.5), (1e-6, 1.0, 1.0), (-90.0, 0.1, 0.2)] {
            let ramp = Ramp::quickest(delta, rate, slope);
            assert!((ramp.delta() - delta).abs() < 1e-13 * delta.abs() && ramp.rate.abs() <= rate);
            // ramp_s = rate/slope is one division: two roundings.
            assert!(ramp.rate.abs() / ramp.ramp_s <= slope * (1.0 + 1e-15));
            let end = ramp.at(ramp.duration_s());
            assert!((end.0 - delta).abs() < 1e-12 * delta.abs() && end.1 == 0.0);
            // Trapezoids over 20 000 steps: the integral's error is duration·h²/12 times the largest slope,
            // 1e-8 of it.
            let n = 20_000;
            let h = ramp.duration_s() / f64::from(n);
            let (mut sum, mut integral) = (0.0, 0.0);
            for k in 0..n {
                let (a, b) = (ramp.at(f64::from(k) * h), ramp.at(f64::from(k + 1) * h));
                sum += 0.5 * h * (a.1 + b.1);
                integral += 0.5 * h * (a.0 + b.0);
                let t_s = f64::from(k + 1) * h;
                let size = delta.abs() * ramp.duration_s();
                assert!((integral - ramp.integral(t_s)).abs() < 1e-8 * size, "{delta} {t_s}");
                // Each of four kinks of the rate within a trapezoid costs at most slope·h²/8.
                assert!((sum - b.0).abs() < 0.5 * slope * h * h + 1e-12 * delta.abs());
            }
        }
    }
}
