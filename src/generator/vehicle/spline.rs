//! Knots from rows of positions, with or without velocities: splines with continuous acceleration.
//!
//! Positions alone: the natural cubic spline. Positions and velocities: the quintic spline through both whose
//! third derivative is continuous, with none at the ends. Both are tridiagonal systems (de Boor, "A Practical
//! Guide to Splines", chapter IV), solved in time and memory proportional to the rows.

use nalgebra::Vector3;

use super::{Knot, Motion};

/// One row: time, position and perhaps velocity in ECEF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// True time since the scene's start.
    pub t_s: f64,
    /// ECEF position, in metres.
    pub position_m: Vector3<f64>,
    /// Velocity, ECEF; `None` where it is not given.
    pub velocity_mps: Option<Vector3<f64>>,
}

/// One equation: `below * x[i - 1] + middle * x[i] + above * x[i + 1] = right`.
struct Equation {
    below: f64,
    middle: f64,
    above: f64,
    right: Vector3<f64>,
}

/// Gaussian elimination without pivoting, stable for the diagonally dominant systems below.
fn solve(equations: &mut [Equation]) -> Vec<Vector3<f64>> {
    let mut last: Option<(f64, f64, Vector3<f64>)> = None;
    for e in equations.iter_mut() {
        if let Some((middle, above, right)) = last {
            let factor = e.below / middle;
            e.middle -= factor * above;
            e.right -= right * factor;
        }
        last = Some((e.middle, e.above, e.right));
    }
    let mut next = Vector3::zeros();
    let mut solution: Vec<Vector3<f64>> = equations
        .iter()
        .rev()
        .map(|e| {
            next = (e.right - next * e.above) / e.middle;
            next
        })
        .collect();
    solution.reverse();
    solution
}

/// The knots of the spline through `rows`, whose times ascend. Velocities count only if every row has one.
pub fn knots(rows: &[Row]) -> Vec<Knot> {
    let velocities: Option<Vec<Vector3<f64>>> = rows.iter().map(|row| row.velocity_mps).collect();
    let (velocities, accelerations) = match velocities {
        Some(velocities) => {
            let accelerations = smooth_accelerations(rows, &velocities);
            (velocities, accelerations)
        }
        None => natural_cubic(rows),
    };
    rows.iter()
        .zip(velocities.iter().zip(&accelerations))
        .map(|(row, (&velocity_mps, &acceleration_mps2))| Knot {
            t_s: row.t_s,
            motion: Motion { position_m: row.position_m, velocity_mps, acceleration_mps2 },
        })
        .collect()
}

/// Length and mean velocity of each interval.
fn intervals(rows: &[Row]) -> Vec<(f64, Vector3<f64>)> {
    rows.iter()
        .zip(rows.iter().skip(1))
        .map(|(a, b)| (b.t_s - a.t_s, (b.position_m - a.position_m) / (b.t_s - a.t_s)))
        .collect()
}

fn natural_cubic(rows: &[Row]) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let steps = intervals(rows);
    let end = || Equation { below: 0.0, middle: 1.0, above: 0.0, right: Vector3::zeros() };
    let mut equations = vec![end()];
    equations.extend(steps.iter().zip(steps.iter().skip(1)).map(|((h0, d0), (h1, d1))| Equation {
        below: *h0,
        middle: 2.0 * (h0 + h1),
        above: *h1,
        right: (d1 - d0) * 6.0,
    }));
    equations.push(end());
    let bends = solve(&mut equations);
    let pairs = bends.iter().zip(bends.iter().skip(1));
    let mut velocities: Vec<Vector3<f64>> =
        steps.iter().zip(pairs).map(|((h, d), (a, b))| d - (a * 2.0 + b) * (h / 6.0)).collect();
    if let ([.., a, b], Some((h, d))) = (bends.as_slice(), steps.last()) {
        velocities.push(d + (a + b * 2.0) * (h / 6.0));
    }
    (velocities, bends)
}

/// Accelerations that make the third derivative of the quintic pieces continuous.
///
/// On an interval h with mean velocity d the piece has p‴ = (60 (d − v₀) − 24 (v₁ − v₀))/h² + (3 a₁ − 9 a₀)/h
/// at its left end, and the mirror image of it at its right end.
fn smooth_accelerations(rows: &[Row], velocities: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    struct Piece {
        h: f64,
        left: Vector3<f64>,
        right: Vector3<f64>,
    }
    let pieces: Vec<Piece> = intervals(rows)
        .iter()
        .zip(velocities.iter().zip(velocities.iter().skip(1)))
        .map(|(&(h, d), (v0, v1))| Piece {
            h,
            left: ((d - v0) * 60.0 - (v1 - v0) * 24.0) / (h * h),
            right: ((d - v1) * 60.0 + (v1 - v0) * 24.0) / (h * h),
        })
        .collect();
    let mut equations = Vec::with_capacity(rows.len());
    equations.extend(pieces.first().map(|p| Equation {
        below: 0.0,
        middle: 9.0 / p.h,
        above: -3.0 / p.h,
        right: p.left,
    }));
    equations.extend(pieces.iter().zip(pieces.iter().skip(1)).map(|(a, b)| Equation {
        below: -3.0 / a.h,
        middle: 9.0 / a.h + 9.0 / b.h,
        above: -3.0 / b.h,
        right: b.left - a.right,
    }));
    equations.extend(pieces.last().map(|p| Equation {
        below: -3.0 / p.h,
        middle: 9.0 / p.h,
        above: 0.0,
        right: -p.right,
    }));
    solve(&mut equations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::Trajectory;

    /// A circle of 100 m flown at 20 m/s, sampled every `h` seconds with uneven steps.
    fn circle(h: f64, with_velocity: bool) -> Vec<Row> {
        (0..200)
            .map(|k| {
                let t_s = f64::from(k) * h + 0.2 * h * f64::from(k % 3);
                let (sin, cos) = libm::sincos(0.2 * t_s);
                Row {
                    t_s,
                    position_m: Vector3::new(6.4e6 + 100.0 * cos, 100.0 * sin, 0.0),
                    velocity_mps: with_velocity.then(|| Vector3::new(-20.0 * sin, 20.0 * cos, 0.0)),
                }
            })
            .collect()
    }

    #[test]
    fn splines_converge_to_a_circle_at_their_order_and_pass_every_row() {
        for (with_velocity, bound_m) in [
            // Away from natural ends: 5/384 h⁴ p⁗ = 0.013·1.2⁴·0.16 = 4.3e-3 m for steps up to 1.2 s.
            (false, 5e-3),
            // Hermite h⁶/46080·p⁽⁶⁾ = 1.2⁶·6.4e-3/46080 = 4e-7, and an acceleration error of a·O((ωh)⁴)/100
            // in h²/32.
            (true, 5e-5),
        ] {
            let rows = circle(1.0, with_velocity);
            let trajectory = Trajectory::through(knots(&rows), vec![]).unwrap();
            for row in &rows {
                assert_eq!(trajectory.at(row.t_s).position_m, row.position_m);
            }
            let mut worst = 0.0_f64;
            for k in 2_000..18_000 {
                let t_s = f64::from(k) * 0.01;
                let (sin, cos) = libm::sincos(0.2 * t_s);
                let want = Vector3::new(6.4e6 + 100.0 * cos, 100.0 * sin, 0.0);
                worst = worst.max((trajectory.at(t_s).position_m - want).norm());
            }
            assert!(worst < bound_m && worst > 0.0, "{with_velocity} {worst}");
        }
    }

    #[test]
    fn third_derivatives_join_when_velocities_are_given() {
        let trajectory = Trajectory::through(knots(&circle(1.0, true)), vec![]).unwrap();
        let d = 1e-4;
        for knot in trajectory.knots().iter().skip(1).take(198) {
            let a = |t_s| trajectory.at(t_s).acceleration_mps2;
            let (before, here, after) = (a(knot.t_s - d), a(knot.t_s), a(knot.t_s + d));
            // Slopes of 0.8 m/s³; the second difference holds p⁗·d = 1.6e-5 and rounding of 2e-8/d.
            assert!(((after - here) - (here - before)).norm() / d < 1e-3, "{}", knot.t_s);
        }
    }

    #[test]
    fn two_rows_are_a_straight_line() {
        let rows =
            [0.0, 2.0].map(|t_s| Row { t_s, position_m: Vector3::new(6.4e6, 3.0 * t_s, 0.0), velocity_mps: None });
        let trajectory = Trajectory::through(knots(&rows), vec![]).unwrap();
        assert_eq!(trajectory.at(0.5).position_m.y, 1.5);
        assert_eq!(trajectory.at(0.5).acceleration_mps2, Vector3::zeros());
    }
}
