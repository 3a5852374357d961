//! Inertial measurements against the motion that they measure and against the errors that were asked for.
//!
//! The scene's constant errors are taken out. What is left is integrated from the true motion on, again every
//! minute, and compared with the truth at its end: only noise may part them. Where the body rests, the Allan
//! deviation of the output is compared with that of the noise. The integration ([`strapdown`], [`window`])
//! shares no code with the generator but the Earth's rotation and its gravitation. Limits: Allan deviations
//! of the first 2^18 rows and up to 500 s; 1/f noise from 1 s on.

pub mod strapdown;
pub mod window;

use std::collections::VecDeque;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::quantile::{largest, mean_squares};
use crate::expect::theory::clock::Deviation;
use crate::expect::theory::inertial::{allan_variance, allan_variances, attitude_sigma_rad, position_sigma_m};
use crate::measure::allan::freedom::{Estimator, degrees_of_freedom};
use crate::read::Run;
use gnss::facts::{InertialFacts, TriadErrors};
use gnss::record::{BodyRow, InertialRow};
use strapdown::{Motion, Strapdown, exponential};
use window::{EASY_TURN_RAD, LENGTH, Window};

/// Time after which the integration begins again.
pub const SPAN_S: f64 = 60.0;
/// Largest error of a position integrated over [`SPAN_S`] without noise, metres.
pub const POSITION_M: f64 = 1e-3;
/// Largest error of such an attitude, radians: 1 g off by so much from the begin on makes 1.8 mm.
pub const ATTITUDE_RAD: f64 = 1e-7;

/// Rows of which Allan deviations are computed, at most.
const MOST_ROWS: usize = 1 << 18;
/// Longest averaging time, and the shortest at which 1/f noise counts, seconds.
const LONGEST_S: f64 = 500.0;
const SHORTEST_FLICKER_S: f64 = 1.0;

/// A figure against its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limited {
    /// The figure where it is nearest to its limit or farthest beyond.
    pub value: f64,
    /// The limit there.
    pub limit: f64,
}

/// The figure alone.
impl Serialize for Limited {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.value)
    }
}

impl Limited {
    /// The one that is nearer to its limit, or farther beyond.
    fn worse(old: Option<Self>, new: Self) -> Option<Self> {
        Some(old.filter(|old| old.value / old.limit >= new.value / new.limit).unwrap_or(new))
    }
}

/// `inertial` in `summary.json`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Number of measurements.
    pub rows: usize,
    /// Largest turn between two of them, radians.
    pub turn_rad: f64,
    /// Error of the position integrated over a minute, metres, and its limit.
    pub position_error_m: Option<Limited>,
    /// Error of the attitude integrated over a minute, radians, and its limit.
    pub attitude_error_rad: Option<Limited>,
    /// Allan deviation of the gyroscopes beyond the one that was asked for, as shares: largest and smallest.
    pub gyro_allan: Option<[Limited; 2]>,
    /// Allan deviation of the accelerometers beyond the one that was asked for, in the same measure.
    pub accelerometer_allan: Option<[Limited; 2]>,
}

impl Figures {
    /// `None` in a scene without inertial sensors.
    ///
    /// # Errors
    /// Tables that cannot be read, or rows that are not one interval apart.
    pub fn of(run: &Run) -> Result<Option<Self>, JudgeError> {
        let (Some(facts), Some(tables)) = (&run.scene.imu, run.inertial()?) else { return Ok(None) };
        let first_s = run.scene.first_sample.unwrap_or(0) as f64 / run.scene.sample_rate_hz;
        let (rows, body) = (&tables.rows, &tables.body);
        Self::of_rows(facts, (first_s, rows.len()), &mut rows.cursor(), &mut body.cursor())
    }

    /// Judges a number of measurements that are one interval apart, of sensors that were switched on
    /// `first_s` before the first, against the true motion, of which the first row is where they begin.
    ///
    /// # Errors
    /// Errors of the rows.
    pub fn of_rows<E>(
        facts: &InertialFacts,
        (first_s, count): (f64, usize),
        rows: &mut dyn Iterator<Item = Result<InertialRow, E>>,
        body: &mut dyn Iterator<Item = Result<BodyRow, E>>,
    ) -> Result<Option<Self>, E> {
        let Some(begin) = body.next().transpose()? else { return Ok(None) };
        let mut spans = Spans::new(facts, begin, (first_s, count));
        let mut noises = [Phases::new(&facts.gyro), Phases::new(&facts.accelerometer)];
        let mut ahead = VecDeque::new();
        let mut due = body.next().transpose()?;
        let window = Window::new(LENGTH.min(count));
        let mut first = 0;
        for number in 0..count {
            let begin = number.saturating_sub(LENGTH / 2).min(count.saturating_sub(LENGTH));
            while first < begin {
                ahead.pop_front();
                first += 1;
            }
            while ahead.len() < LENGTH {
                let Some(row) = rows.next().transpose()? else { break };
                let cleared = without_constants(facts, &row);
                noises.iter_mut().zip(cleared).for_each(|(phases, value)| phases.add(value, facts));
                ahead.push_back((row, cleared));
            }
            let place = number - begin;
            let [rate, force] = [0, 1].map(|kind| window.smooth(place, ahead.iter().map(|(_, means)| &means[kind])));
            let Some((row, means)) = ahead.get(place) else { break };
            spans.advance(means, &rate, &force);
            if let Some(true_body) = due.filter(|body| (body.time().since(row.time())).abs() < 0.5 / facts.rate_hz) {
                due = body.next().transpose()?;
                spans.compare(&true_body, due.is_none());
            }
        }
        let [gyro_allan, accelerometer_allan] = noises.map(|phases| phases.excesses(facts));
        Ok(Some(Self { gyro_allan, accelerometer_allan, ..spans.figures }))
    }
}

/// Angular rate and specific force without the constant errors that the scene states.
fn without_constants(facts: &InertialFacts, row: &InertialRow) -> [Vector3<f64>; 2] {
    let cleared = |errors: &TriadErrors, measured: Vector3<f64>| {
        let gain = Vector3::from(errors.scale_factor).add_scalar(1.0);
        let of_sensors = (measured - Vector3::from(errors.bias)).component_div(&gain);
        exponential(&Vector3::from(errors.misalignment_rad)) * of_sensors
    };
    let force = cleared(&facts.accelerometer, row.force_mps2());
    let by_force = Vector3::from(facts.g_sensitivity_radps_per_mps2).component_mul(&force);
    [cleared(&facts.gyro, row.rate_radps() - by_force), force]
}

fn motion(row: &BodyRow) -> Motion {
    let attitude = UnitQuaternion::new_normalize(Quaternion::new(row.qw, row.qx, row.qy, row.qz));
    Motion { position_m: row.position_m(), velocity_mps: row.velocity_mps(), attitude }
}

/// Angle of a rotation, 0 to π.
fn angle_rad(rotation: &UnitQuaternion<f64>) -> f64 {
    2.0 * libm::atan2(rotation.imag().norm(), rotation.w.abs())
}

/// Integrations of a minute each.
struct Spans<'a> {
    facts: &'a InertialFacts,
    integrated: Strapdown,
    /// Intervals since the span's begin, and since the first row.
    intervals: u64,
    all: u64,
    /// Age of the sensors at the first row, in seconds.
    first_s: f64,
    force_mps2: f64,
    /// Spans that the rows can make.
    count: usize,
    figures: Figures,
}

impl<'a> Spans<'a> {
    fn new(facts: &'a InertialFacts, begin: BodyRow, (first_s, rows): (f64, usize)) -> Self {
        Self {
            facts,
            integrated: Strapdown::new(motion(&begin)),
            intervals: 0,
            all: 0,
            first_s,
            force_mps2: 0.0,
            count: (rows as f64 / facts.rate_hz / SPAN_S) as usize + 1,
            figures: Figures { rows, ..Figures::default() },
        }
    }

    fn advance(&mut self, [rate, force]: &[Vector3<f64>; 2], rates: &window::Smooth, forces: &window::Smooth) {
        let interval_s = 1.0 / self.facts.rate_hz;
        self.figures.turn_rad = self.figures.turn_rad.max(rate.norm() * interval_s);
        self.force_mps2 = self.force_mps2.max(force.norm());
        self.integrated.advance(interval_s, rates, forces);
        (self.intervals, self.all) = (self.intervals + 1, self.all + 1);
    }

    /// Ends the span at a row of the truth, if it is long enough or the row is the last one.
    fn compare(&mut self, truth: &BodyRow, is_last: bool) {
        let seconds = |intervals: u64| intervals as f64 / self.facts.rate_hz;
        let (time_s, age_s) = (seconds(self.intervals), self.first_s + seconds(self.all));
        if time_s < SPAN_S && !is_last {
            return;
        }
        let (found, truth) = (self.integrated.motion(), motion(truth));
        let factor = largest(3, self.count);
        let position = Limited {
            value: (found.position_m - truth.position_m).norm(),
            limit: POSITION_M * (self.figures.turn_rad / EASY_TURN_RAD).max(1.0).powi(2)
                + factor * position_sigma_m(self.facts, time_s, age_s, self.force_mps2),
        };
        let attitude = Limited {
            value: angle_rad(&(found.attitude.inverse() * truth.attitude)),
            limit: ATTITUDE_RAD + factor * attitude_sigma_rad(self.facts, time_s, age_s),
        };
        let figures = &mut self.figures;
        figures.position_error_m = Limited::worse(figures.position_error_m, position);
        figures.attitude_error_rad = Limited::worse(figures.attitude_error_rad, attitude);
        self.integrated = Strapdown::new(truth);
        (self.intervals, self.force_mps2) = (0, 0.0);
    }
}

/// Integrals of three sensors' outputs.
struct Phases {
    errors: TriadErrors,
    axes: [Vec<f64>; 3],
}

impl Phases {
    fn new(errors: &TriadErrors) -> Self {
        Self { errors: *errors, axes: [vec![0.0], vec![0.0], vec![0.0]] }
    }

    fn add(&mut self, value: Vector3<f64>, facts: &InertialFacts) {
        if !facts.is_still || !self.errors.is_noisy() {
            return;
        }
        for (axis, value) in self.axes.iter_mut().zip(value.iter()).filter(|(axis, _)| axis.len() <= MOST_ROWS) {
            axis.push(axis.last().unwrap_or(&0.0) + value / facts.rate_hz);
        }
    }

    /// Allan deviations beyond those of the noise as shares, largest and smallest against their limits;
    /// `None` without noise, or where the body moves.
    fn excesses(&self, facts: &InertialFacts) -> Option<[Limited; 2]> {
        let (tau0_s, count) = (1.0 / facts.rate_hz, self.axes[0].len());
        let steps: Vec<usize> = (0..usize::BITS)
            .map(|power| 1 << power)
            .take_while(|m| 8 * m < count && *m as f64 * tau0_s <= LONGEST_S)
            .filter(|m| self.is_asked(*m as f64 * tau0_s))
            .collect();
        let mut worst: [Option<Limited>; 2] = [None, None];
        for &m in &steps {
            let tau_s = m as f64 * tau0_s;
            let squares: Option<f64> = self
                .axes
                .iter()
                .map(|axis| Deviation::Oadev.estimate(axis, tau0_s, m).map(|found| found.deviation * found.deviation))
                .sum();
            let (Some(squares), Some(freedom)) = (squares, self.freedom(m, count)) else { continue };
            let excess = (squares / 3.0 / allan_variance(&self.errors, tau_s)).sqrt() - 1.0;
            let (low, high) = mean_squares(3.0 * freedom, steps.len());
            for (worst, limit) in worst.iter_mut().zip([high, low]) {
                *worst = Limited::worse(*worst, Limited { value: excess, limit: limit.sqrt() - 1.0 });
            }
        }
        let [most, least] = worst;
        Some([most?, least?])
    }

    /// True unless 1/f noise shows at an averaging time too short for it.
    fn is_asked(&self, tau_s: f64) -> bool {
        let [white, flicker, walk] = allan_variances(&self.errors, tau_s);
        tau_s >= SHORTEST_FLICKER_S || flicker <= 0.01 * (white + walk)
    }

    /// The fewest degrees of freedom that any of the noises leaves an axis.
    fn freedom(&self, m: usize, count: usize) -> Option<f64> {
        let estimator = Estimator { order: 2, modified: false, overlapped: true };
        let present = allan_variances(&self.errors, 1.0).into_iter().zip([0, -1, -2]).filter(|(part, _)| *part > 0.0);
        let each = present.filter_map(|(_, alpha)| degrees_of_freedom(estimator, alpha, m, count));
        each.min_by(f64::total_cmp)
    }
}
