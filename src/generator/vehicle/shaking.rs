//! Effect of acceleration on a crystal: a frequency shift in proportion to the antenna's acceleration.
//!
//! δf / f = k · |a| / g, with a the acceleration in ECEF (gravity is part of the nominal frequency) along the
//! most sensitive axis of the crystal. Typical k: 1e-9 a g for a TCXO, 1e-10 for an OCXO (Filler 1988).
//! Limits: vibration is seen only as far as the motion contains it.

use super::Trajectory;

/// Standard gravity, in m/s².
pub const GRAVITY_MPS2: f64 = 9.806_65;

/// Nodes and weights of Gauss and Legendre's rule with four points on (0, 1).
const RULE: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The phase that a crystal gains under the acceleration of a motion.
#[derive(Clone, Debug)]
pub struct Shaking {
    /// Fractional frequency for 1 m/s².
    pub per_mps2: f64,
    trajectory: Trajectory,
    /// ∫ |a| dt from the scene's start to each knot, in m/s.
    until_mps: Vec<f64>,
    /// ∫ |a| dt from the first knot to the scene's start, in m/s.
    before_mps: f64,
}

impl Shaking {
    /// A crystal with sensitivity `per_g` on an antenna that moves along `trajectory`.
    pub fn new(per_g: f64, trajectory: Trajectory) -> Self {
        let mut sum = 0.0;
        let mut until_mps = Vec::with_capacity(trajectory.knots().len());
        until_mps.push(0.0);
        for pair in trajectory.knots().windows(2) {
            if let [a, b] = pair {
                sum += integral_mps(&trajectory, a.t_s, b.t_s);
                until_mps.push(sum);
            }
        }
        let mut shaking = Self { per_mps2: per_g / GRAVITY_MPS2, trajectory, until_mps, before_mps: 0.0 };
        shaking.before_mps = shaking.sum_mps(0.0);
        shaking
    }

    /// Phase gained from the scene's start to `t_s` true seconds after it, in s.
    pub fn gained_s(&self, t_s: f64) -> f64 {
        self.per_mps2 * (self.sum_mps(t_s) - self.before_mps)
    }

    /// ∫ |a| dt from the first knot, in m/s.
    fn sum_mps(&self, t_s: f64) -> f64 {
        let knots = self.trajectory.knots();
        let left = knots.partition_point(|knot| knot.t_s <= t_s).saturating_sub(1);
        match (knots.get(left), self.until_mps.get(left)) {
            (Some(knot), Some(sum)) => sum + integral_mps(&self.trajectory, knot.t_s, t_s),
            _ => 0.0,
        }
    }
}

/// ∫ |a| dt, with an error far below that of |a| where the acceleration does not vanish in between.
fn integral_mps(trajectory: &Trajectory, from_s: f64, to_s: f64) -> f64 {
    let length_s = to_s - from_s;
    let sum: f64 = RULE.iter().fold(0.0, |sum, (node, weight)| {
        sum + weight * trajectory.at(from_s + node * length_s).acceleration_mps2.norm()
    });
    sum * length_s
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::vehicle::{Knot, Motion};

    #[test]
    fn twenty_g_for_a_second_shift_a_tcxo_by_what_its_sensitivity_says() {
        let acceleration = Vector3::new(20.0 * GRAVITY_MPS2, 0.0, 0.0);
        let knot = |t_s: f64| Knot {
            t_s,
            motion: Motion {
                position_m: Vector3::new(6.4e6, 0.0, 0.0) + acceleration * (0.5 * t_s * t_s),
                velocity_mps: acceleration * t_s,
                acceleration_mps2: acceleration,
            },
        };
        let trajectory = Trajectory::through(vec![knot(-1.0), knot(0.0), knot(2.0)], vec![]).unwrap();
        let shaking = Shaking::new(1e-9, trajectory);
        for t_s in [0.0, 0.3, 1.0, 1.999, 2.5] {
            // 20 g times 1e-9 a g: 2e-8, at L1 31.5 Hz. Rounding of position knots: 1e-9 m of 196 m/s².
            assert!((shaking.gained_s(t_s) - 2e-8 * t_s).abs() < 1e-16, "{t_s}");
        }
    }
}
