//! Positions of few digits: how much of a motion is their rounding, and the smoothest motion within it.
//!
//! A digit of d metres rounds by up to d/2, d/√12 rms. The natural cubic spline through rows h apart makes of
//! independent errors accelerations six times as large over h² (rms over all frequencies of
//! 6(2 − 2 cos ω)/(4 + 2 cos ω)), √3·d/h² a coordinate: of 18 cm ten times per second 32 m/s².
//!
//! The smoothest motion is Reinsch's (1967, "Smoothing by spline functions"): of all with a given sum of
//! squared distances from the rows the one with the least mean square acceleration, a natural cubic spline
//! (Green and Silverman 1994, "Nonparametric regression and generalized linear models", 2.3). Limits: one
//! tolerance for all coordinates and rows.

use nalgebra::Vector3;

use crate::vehicle::spline::Row;

/// Effect of the positions' rounding on a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Digits {
    /// Value of the last digit, in metres.
    pub step_m: f64,
    /// Time between rows, the mean.
    pub interval_s: f64,
    /// Accelerations that it makes, rms in each coordinate.
    pub acceleration_mps2: f64,
}

impl Digits {
    /// Computes the effect for rows with positions alone, whose last digit is worth `step_m` metres.
    pub(super) fn of(rows: &[Row], step_m: f64) -> Option<Self> {
        let (first, last) = (rows.first()?, rows.last()?);
        let interval_s = (last.t_s - first.t_s) / (rows.len() as f64 - 1.0);
        let is_plain = rows.iter().any(|row| row.velocity_mps.is_none()) && rows.len() > 2;
        let acceleration_mps2 = 3_f64.sqrt() * step_m / (interval_s * interval_s);
        is_plain.then_some(Self { step_m, interval_s, acceleration_mps2 })
    }
}

/// Digits behind the point of a number; those of an exponent are none.
pub(super) fn decimals(text: &str) -> u32 {
    let digits = text.trim().split_once('.').map_or("", |(_, behind)| behind);
    digits.bytes().take_while(u8::is_ascii_digit).count() as u32
}

/// Steps of the search for how smooth: the factor between bounds, 1e24, to 1e-3.
const SEARCHES: u32 = 60;

/// Moves rows, whose times ascend, to the smoothest motion that is `tolerance_m`/√3 from them, rms in each
/// coordinate: as far as rounding by at most the tolerance moves them.
pub(super) fn smooth(rows: &mut [Row], tolerance_m: f64) {
    if rows.len() < 3 {
        return;
    }
    let system = System::of(rows);
    let allowed_m2 = rows.len() as f64 * tolerance_m * tolerance_m;
    let mean_s = system.steps_s.iter().sum::<f64>() / system.steps_s.len() as f64;
    // As stiff as the largest factor allows, a straight line, or in between by the logarithm.
    let (mut least, mut most) = (1e-12_f64, 1e12_f64);
    let factor = |share: f64| share * mean_s * mean_s * mean_s;
    let far_m2 = |moves: &[Vector3<f64>]| moves.iter().fold(0.0, |sum, by| sum + by.norm_squared());
    let mut moves = system.moves_m(factor(most));
    if far_m2(&moves) > allowed_m2 {
        for _ in 0..SEARCHES {
            let middle = (least * most).sqrt();
            moves = system.moves_m(factor(middle));
            if far_m2(&moves) > allowed_m2 { most = middle } else { least = middle }
        }
        moves = system.moves_m(factor(least));
    }
    rows.iter_mut().zip(moves).for_each(|(row, by)| row.position_m -= by);
}

/// The equations of Green and Silverman, (R + αQᵀQ)γ = Qᵀy, by their bands.
struct System {
    steps_s: Vec<f64>,
    /// Qᵀy: changes of the mean velocity at each inner row.
    bends: Vec<Vector3<f64>>,
}

impl System {
    fn of(rows: &[Row]) -> Self {
        let steps_s: Vec<f64> = rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).collect();
        let speeds =
            rows.windows(2).map(|pair| (pair[1].position_m - pair[0].position_m) / (pair[1].t_s - pair[0].t_s));
        let speeds: Vec<Vector3<f64>> = speeds.collect();
        let bends = speeds.windows(2).map(|pair| pair[1] - pair[0]).collect();
        Self { steps_s, bends }
    }

    /// Distance of each row from the spline of a factor, in metres: αQγ.
    fn moves_m(&self, alpha_s3: f64) -> Vec<Vector3<f64>> {
        let rates: Vec<[f64; 3]> = self
            .steps_s
            .windows(2)
            .map(|pair| [1.0 / pair[0], -1.0 / pair[0] - 1.0 / pair[1], 1.0 / pair[1]])
            .collect();
        // LDLᵀ of a matrix of five bands, with two before each row at hand.
        let count = rates.len();
        let (mut pivots, mut near, mut far) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        let mut right = self.bends.clone();
        for i in 0..count {
            let [a, b, c] = rates[i];
            let (next, after) = (rates.get(i + 1), rates.get(i + 2));
            let diagonal = (self.steps_s[i] + self.steps_s[i + 1]) / 3.0 + alpha_s3 * (a * a + b * b + c * c);
            let one = next.map_or(0.0, |n| self.steps_s[i + 1] / 6.0 + alpha_s3 * (b * n[0] + c * n[1]));
            let two = after.map_or(0.0, |n| alpha_s3 * c * n[0]);
            let (mut pivot, mut one) = (diagonal, one);
            if i > 0 {
                pivot -= near[i - 1] * near[i - 1] * pivots[i - 1];
                one -= near[i - 1] * far[i - 1] * pivots[i - 1];
                let before = right[i - 1];
                right[i] -= before * near[i - 1];
            }
            if i > 1 {
                pivot -= far[i - 2] * far[i - 2] * pivots[i - 2];
                let before = right[i - 2];
                right[i] -= before * far[i - 2];
            }
            (pivots[i], near[i], far[i]) = (pivot, one / pivot, two / pivot);
        }
        for i in (0..count).rev() {
            let mut value = right[i] / pivots[i];
            if i + 1 < count {
                value -= right[i + 1] * near[i];
            }
            if i + 2 < count {
                value -= right[i + 2] * far[i];
            }
            right[i] = value;
        }
        let mut moves = vec![Vector3::zeros(); count + 2];
        for (i, (bend, [a, b, c])) in right.iter().zip(rates).enumerate() {
            for (place, rate) in [(i, a), (i + 1, b), (i + 2, c)] {
                moves[place] += bend * (alpha_s3 * rate);
            }
        }
        moves
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::spline;

    /// A circle of 300 m at 15 m/s, 0.75 m/s², ten times per second, its coordinates to `step_m`.
    fn ride(step_m: f64) -> Vec<Row> {
        let rounded = |x: f64| if step_m > 0.0 { (x / step_m).round() * step_m } else { x };
        (0..600)
            .map(|k| {
                let t_s = 0.1 * f64::from(k);
                let (sin, cos) = libm::sincos(0.05 * t_s);
                let place = Vector3::new(6.4e6 + 300.0 * cos, 300.0 * sin, 7.0 * t_s);
                Row { t_s, position_m: place.map(rounded), velocity_mps: None }
            })
            .collect()
    }

    fn accelerations(rows: &[Row]) -> (f64, f64) {
        let knots = spline::knots(rows);
        let wrong = knots.iter().map(|knot| {
            let (sin, cos) = libm::sincos(0.05 * knot.t_s);
            (knot.motion.acceleration_mps2 - Vector3::new(-0.75 * cos, -0.75 * sin, 0.0)).norm_squared()
        });
        let all: Vec<f64> = wrong.collect();
        let inner = &all[30..570];
        let rms = (inner.iter().sum::<f64>() / inner.len() as f64).sqrt();
        (rms, inner.iter().fold(0.0_f64, |most, square| most.max(square.sqrt())))
    }

    #[test]
    fn digits_make_the_accelerations_that_are_said_and_the_smoothest_motion_within_them_has_few() {
        let step_m = 0.185;
        let mut rows = ride(step_m);
        let digits = Digits::of(&rows, step_m).unwrap();
        let (rms, _) = accelerations(&rows);
        // Three coordinates, each of √3·0.185/0.01 = 32 m/s²; errors of neighbours are not quite independent.
        assert!((rms / (3_f64.sqrt() * digits.acceleration_mps2) - 1.0).abs() < 0.2, "{rms} {digits:?}");
        smooth(&mut rows, 0.5 * step_m);
        let (after, most) = accelerations(&rows);
        assert!(after < 0.1 && most < 0.4, "{after} {most}");
        let far = rows.iter().zip(ride(step_m)).map(|(row, was)| (row.position_m - was.position_m).norm_squared());
        let rms_m = (far.sum::<f64>() / (3.0 * 600.0)).sqrt();
        assert!((rms_m / (0.5 * step_m / 3_f64.sqrt()) - 1.0).abs() < 0.01, "{rms_m}");
        // Nearer to the true way than the rows were.
        let off = |rows: &[Row]| {
            let square =
                rows.iter().zip(ride(0.0)).map(|(row, real)| (row.position_m - real.position_m).norm_squared());
            (square.sum::<f64>() / 600.0).sqrt()
        };
        assert!(off(&rows) < 0.5 * off(&ride(step_m)), "{} {}", off(&rows), off(&ride(step_m)));
    }

    #[test]
    fn a_straight_way_and_two_rows_stay_and_a_large_tolerance_leaves_a_line() {
        let line = |k: f64| Row { t_s: k, position_m: Vector3::new(6.4e6, 3.0 * k, -k), velocity_mps: None };
        let mut two = vec![line(0.0), line(1.0)];
        smooth(&mut two, 10.0);
        assert_eq!(two, [line(0.0), line(1.0)]);
        let mut rows: Vec<Row> = (0..20).map(|k| line(f64::from(k))).collect();
        rows[7].position_m.x += 1.0;
        smooth(&mut rows, 5.0);
        // Regression through the rows: no bend is left but for what the largest factor leaves, 1e-12.
        let bends = spline::knots(&rows).iter().map(|knot| knot.motion.acceleration_mps2.norm()).fold(0.0, f64::max);
        assert!(bends < 1e-8, "{bends}");
        assert_eq!([decimals("12"), decimals("-12.3400"), decimals(" 1.5e-3 ")], [0, 4, 1]);
    }
}
