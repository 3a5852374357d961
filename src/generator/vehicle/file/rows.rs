//! Rows of a trajectory: what is believable after the row before, and the spline through all of them.

use nalgebra::Vector3;

use super::smooth::{Digits, smooth};
use super::{Fault, FileError, LEAST_RADIUS_M, MAX_ROWS, Options};
use crate::vehicle::Trajectory;
use crate::vehicle::spline::{self, Row};
use gnss::earth::SPEED_OF_LIGHT_MPS;

/// Fastest motion between rows, in m/s.
const MAX_SPEED_MPS: f64 = 0.1 * SPEED_OF_LIGHT_MPS;
/// Hardest motion, in m/s²: a hundred thousand g, beyond any gun.
const MAX_ACCELERATION_MPS2: f64 = 1e6;

/// Rows before and after the first bent knot among which the wrong one is looked for. From the hardest bend
/// that the largest speed allows, 1e11 m/s2 between rows 1 ms apart, to the limit is a factor 1e5 = 3.7^9:
/// nine rows.
const BEFORE: usize = 2;
const AFTER: usize = 14;

/// Rows as they come in, each checked against the one before.
pub(super) struct Rows {
    rows: Vec<Row>,
    lines: Vec<u32>,
    max_gap_s: f64,
    tolerance_m: Option<f64>,
    /// Value of the last digit of each coordinate in metres, from the row with the most digits.
    steps_m: [f64; 3],
}

impl Rows {
    pub fn new(options: &Options) -> Self {
        let Options { max_gap_s, tolerance_m, .. } = *options;
        Self { rows: Vec::new(), lines: Vec::new(), max_gap_s, tolerance_m, steps_m: [f64::INFINITY; 3] }
    }

    /// Time of the last one, in seconds.
    pub fn last_s(&self) -> Option<f64> {
        self.rows.last().map(|row| row.t_s)
    }

    pub fn push(&mut self, line: u64, row: Row) -> Result<(), Fault> {
        let mut speed_mps = row.velocity_mps.map_or(0.0, |v| v.norm());
        if let Some(before) = self.rows.last() {
            let gap_s = row.t_s - before.t_s;
            if gap_s == 0.0 {
                return Err(Fault::SameTime { t_s: row.t_s });
            } else if gap_s < 0.0 {
                return Err(Fault::Unsorted { t_s: row.t_s, before_s: before.t_s });
            } else if gap_s > self.max_gap_s {
                return Err(Fault::Gap { gap_s, max_gap_s: self.max_gap_s });
            }
            speed_mps = speed_mps.max((row.position_m - before.position_m).norm() / gap_s);
            let radius_m = nearest_m(&before.position_m, &row.position_m);
            if speed_mps <= MAX_SPEED_MPS && radius_m < LEAST_RADIUS_M {
                return Err(Fault::Depth { radius_m });
            }
        }
        if speed_mps > MAX_SPEED_MPS {
            return Err(Fault::Speed { speed_mps });
        }
        if self.rows.len() >= MAX_ROWS {
            return Err(Fault::TooLong);
        }
        self.rows.push(row);
        self.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        Ok(())
    }

    /// Records the value of the last digits of the newest row's coordinates, in metres. Numbers lose trailing
    /// zeros, so the row with the most digits counts.
    pub fn written(&mut self, steps_m: [f64; 3]) {
        self.steps_m.iter_mut().zip(steps_m).for_each(|(least, step_m)| *least = least.min(step_m));
    }

    /// Effect of the rounding on the motion; `None` if the tolerance removes it.
    pub fn digits(&self) -> Option<Digits> {
        let step_m = self.steps_m.iter().fold(0.0, |most: f64, step_m| most.max(*step_m));
        if self.tolerance_m.is_some() { None } else { Digits::of(&self.rows, step_m) }
    }

    /// The spline through the rows, or as near to them as the tolerance states, with a break at each of them.
    pub fn finish(mut self, file: &str) -> Result<Trajectory, FileError> {
        let error = |line, fault| FileError { file: file.to_owned(), line, fault };
        let last = self.lines.last().map_or(1, |line| u64::from(*line));
        let have = self.rows.len();
        let too_few = || error(last, Fault::TooFew { have });
        if have < 2 {
            return Err(too_few());
        }
        if let Some(tolerance_m) = self.tolerance_m {
            if self.rows.iter().all(|row| row.velocity_mps.is_some()) {
                return Err(error(1, Fault::Velocities));
            }
            smooth(&mut self.rows, tolerance_m);
        }
        let knots = spline::knots(&self.rows);
        if let Some(bent) = knots.iter().position(|knot| knot.motion.acceleration_mps2.norm() > MAX_ACCELERATION_MPS2) {
            let (row, acceleration_mps2) = self.culprit(bent);
            let line = self.lines.get(row).map_or(last, |line| u64::from(*line));
            return Err(error(line, Fault::Acceleration { acceleration_mps2 }));
        }
        let breaks_s = self.rows.iter().map(|row| row.t_s).collect();
        Trajectory::through(knots, breaks_s).ok_or_else(too_few)
    }

    /// Row that bends the spline too much from knot `bent` on, with the acceleration.
    ///
    /// One wrong row bends the spline at its neighbours too, each a quarter as hard as the one before: it is
    /// the row without which the rows about it are smooth. Where the motion jumps for good, leaving out a row
    /// beside the jump takes no more than a third of the bend away: then it is the row after the fastest
    /// interval (within two rows of an end the two cannot be distinguished, and the row beside the jump is
    /// named). Of fewer than five rows any could be the wrong one.
    fn culprit(&self, bent: usize) -> (usize, f64) {
        // At the end of the file more of those before it, so that there is something to be smooth.
        let first = bent.saturating_sub(BEFORE).min(self.rows.len().saturating_sub(AFTER));
        let rows = self.rows.get(first..(bent + AFTER).min(self.rows.len())).unwrap_or_default();
        let worst_mps2 = hardest(rows);
        if rows.len() < 5 {
            return (bent, worst_mps2);
        }
        let without = |left_out: usize| {
            let rest = rows.iter().enumerate().filter(|(row, _)| *row != left_out);
            hardest(&rest.map(|(_, row)| *row).collect::<Vec<_>>())
        };
        let smoothest = (0..rows.len()).map(|row| (row, without(row))).min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((row, left_mps2)) = smoothest
            && left_mps2 < 0.25 * worst_mps2
        {
            return (first + row, worst_mps2);
        }
        let speed = |(row, pair): (usize, &[Row])| match pair {
            [a, b] => (row + 1, (b.position_m - a.position_m).norm() / (b.t_s - a.t_s)),
            _ => (row, 0.0),
        };
        let fastest = rows.windows(2).enumerate().map(speed).max_by(|a, b| a.1.total_cmp(&b.1));
        (first + fastest.map_or(0, |(row, _)| row), worst_mps2)
    }
}

/// Least distance of the straight way between two positions from the Earth's centre, in metres.
fn nearest_m(from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let way = to - from;
    let square = way.norm_squared();
    let share = if square > 0.0 { (-from.dot(&way) / square).clamp(0.0, 1.0) } else { 0.0 };
    (from + way * share).norm()
}

/// Hardest acceleration at the knots of the spline through some rows.
fn hardest(rows: &[Row]) -> f64 {
    spline::knots(rows).iter().map(|knot| knot.motion.acceleration_mps2.norm()).fold(0.0, f64::max)
}
