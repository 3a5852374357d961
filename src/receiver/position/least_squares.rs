//! Position and clock by iterated weighted least squares, velocity and drift by one linear solution.
//!
//! Model: ρ = |R(Ωτ) r_s(t_e) − r| + b − c Δt_s + I + T with τ the geometric light time (the raw pseudorange
//! would let a clock bias of 11 ms shift the fix by metres). Source: IS-GPS-200N, 20.3.3.4.3.4 and any
//! textbook of estimation. Three coordinates are unknown and one clock for each time scale of the ranges, as
//! systems' times differ by nanoseconds that no signal shows by itself. Lines of sight have unit length: the
//! condition of the normal equations is that of the geometry, and is checked before they are solved. Where
//! the ionosphere's model has an error ([`Ionosphere::Uncertain`]) that error is three more unknowns with a
//! prior; they are eliminated, so that the covariance of the others contains them.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Matrix4, MatrixXx3, Vector3, Vector4};

use crate::position::NoFix;
use crate::position::augmentation::{Grid, model_sigma_m};
use crate::position::ionosphere::{DelayError, Delays};
use gnss::broadcast::{ClockState, State};
use gnss::earth::{EARTH_ROTATION_RADPS, Geodetic, Look, SPEED_OF_LIGHT_MPS, look, rotate_earth};
use gnss::klobuchar::NOMINAL;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::{Epoch, GPST, TimeScale};
use gnss::troposphere;

/// Unknown coordinates; each time scale adds a clock.
pub const COORDINATES: usize = 3;
/// Unknowns of a position by one system.
pub const UNKNOWNS: usize = COORDINATES + 1;
/// Iterations of a solution, from the Earth's centre.
const LARGEST_ITERATIONS: u32 = 8;
/// A step below this ends the iteration.
const CONVERGED_M: f64 = 1e-4;
/// Largest ratio of singular values of the geometry: position errors would be thousands of times range
/// errors.
pub const LARGEST_CONDITION: f64 = 1e4;
/// Corrections of the atmosphere wait until the estimate is near the Earth's surface or above it.
const NEAR_EARTH_M: f64 = 6.2e6;
/// Above this there is no horizon: no mask, and models that are as good in every direction.
pub const SPACE_M: f64 = 1e5;
/// Klobuchar's model describes the whole ionosphere, which ends about here.
pub const IONOSPHERE_TOP_M: f64 = 1e6;

/// A pseudorange and where its satellite was.
#[derive(Clone, Debug)]
pub struct Range {
    /// The satellite.
    pub sv: Sv,
    /// The signal, of two carriers the first.
    pub signal: &'static Signal,
    /// The time against which its clock is counted: of the signal's system, or GPS time where it is brought
    /// to that.
    pub time: &'static TimeScale,
    /// Satellite at emission, in the ECEF axes of that instant.
    pub satellite: State,
    /// Satellite clock as this signal carries it.
    pub clock: ClockState,
    /// GPS time of emission.
    pub emitted: Epoch,
    /// Smoothed code.
    pub pseudorange_m: f64,
    /// Doppler less what the carrier exceeds the code's by.
    pub doppler_hz: f64,
    /// Carrier of the Doppler.
    pub carrier_hz: f64,
    /// Standard deviation of the pseudorange by thermal noise.
    pub noise_m: f64,
    /// Relative weight of the Doppler: carrier power over noise density.
    pub cn0_hz: f64,
    /// True if two carriers were combined, so that the range is free of the ionosphere.
    pub is_combined: bool,
    /// Standard deviation of orbit and clock in metres that an augmentation system states of a range that it
    /// corrects, where it is part of the noise, or of its own satellite.
    pub augmented_m: Option<f64>,
}

/// Knowledge about the ionosphere.
#[derive(Clone, Debug, PartialEq)]
pub enum Ionosphere {
    /// No ionosphere.
    Absent,
    /// The model is right but for what [`Corrections::model_sigma_m`] covers.
    Known(Delays),
    /// The model has an error that is common to all satellites: it is estimated with the position.
    Uncertain(Delays, DelayError),
    /// A grid has it, each delay with a deviation of its own; where it has none, what stands beside it, with
    /// the deviation of a model.
    Grid(Grid, Box<Self>),
}

/// Corrections and weights of ranges.
#[derive(Clone, Debug)]
pub struct Corrections {
    /// The ionosphere's model.
    pub ionosphere: Ionosphere,
    /// True if a troposphere is corrected.
    pub troposphere: bool,
    /// Standard deviation of the models at the zenith; grows with one over the sine of the elevation.
    pub model_sigma_m: f64,
}

/// A position and clock.
#[derive(Clone, Debug)]
pub struct Solution {
    /// ECEF position.
    pub position_m: Vector3<f64>,
    /// The time scales of the ranges, GPS time first, with the receiver's clock minus each, without the whole
    /// seconds, in metres.
    pub clocks: Vec<(&'static TimeScale, f64)>,
    /// Index of each range's clock among the clocks.
    pub clock_of: Vec<usize>,
    /// Residual of each range in metres: measured minus computed.
    pub residuals_m: Vec<f64>,
    /// Standard deviation of each range.
    pub sigmas_m: Vec<f64>,
    /// Unit vector to each satellite.
    pub sights: Vec<Vector3<f64>>,
    /// Elevation of each satellite.
    pub elevations_rad: Vec<f64>,
    /// Effect on each range, in metres, of one prior deviation of each of the ionosphere's common errors.
    pub commons_m: Vec<Vector3<f64>>,
    /// Covariance of ECEF coordinates and clocks, in m².
    pub covariance: DMatrix<f64>,
    /// Covariance for unit variances: squares of the dilutions of precision.
    pub dilution: DMatrix<f64>,
    /// Ratio of the extreme singular values of the geometry.
    pub condition: f64,
    /// Weighted sum of squared residuals, the ionosphere's estimated error over its prior deviation among
    /// them: its degrees of freedom are [`freedom`] either way.
    pub chi_square: f64,
    /// Estimated errors of the ionosphere's model in their prior deviations (level, gain northwards,
    /// eastwards); 0 where the model is right.
    pub ionosphere_error: Vector3<f64>,
    /// Iterations made.
    pub iterations: u32,
}

impl Solution {
    /// Offset of the receiver's clock from the first time scale without the whole seconds, in metres.
    pub fn clock_m(&self) -> f64 {
        self.clocks.first().map_or(0.0, |clock| clock.1)
    }

    /// Derivatives of a range by coordinates and clocks.
    pub fn row(&self, index: usize) -> Option<DVector<f64>> {
        Some(row(self.sights.get(index)?, *self.clock_of.get(index)?, self.clocks.len()))
    }
}

/// Different time scales of some ranges, GPS time first, then by name.
pub fn scales(ranges: &[Range]) -> Vec<&'static TimeScale> {
    let mut scales: Vec<&'static TimeScale> = Vec::new();
    for range in ranges {
        if !scales.contains(&range.time) {
            scales.push(range.time);
        }
    }
    scales.sort_by_key(|scale| (**scale != GPST, scale.name));
    scales
}

/// Ranges beyond the unknowns that they have to give; negative where they are too few.
pub fn freedom(ranges: &[Range]) -> isize {
    ranges.len() as isize - (COORDINATES + scales(ranges).len()) as isize
}

/// Dilution of precision of the coordinates at a position near the Earth, by the ranges whose satellites
/// stand above a mask; `None` where these give no position. The satellites' positions are taken as they are:
/// light times turn a direction by 1e-5 at most.
pub fn dilution(ranges: &[Range], place_m: &Vector3<f64>, mask_rad: f64) -> Option<f64> {
    let user = Geodetic::from_ecef(place_m);
    let is_above = |range: &&Range| look(user, place_m, &range.satellite.position_m).elevation_rad >= mask_rad;
    let seen: Vec<Range> = ranges.iter().filter(is_above).cloned().collect();
    let scales = scales(&seen);
    let unknowns = COORDINATES + scales.len();
    let normal = seen.iter().fold(DMatrix::zeros(unknowns, unknowns), |mut normal, range| {
        let clock = scales.iter().position(|scale| *scale == range.time).unwrap_or(0);
        let row = row(&(range.satellite.position_m - place_m).normalize(), clock, scales.len());
        normal.ger(1.0, &row, &row, 1.0);
        normal
    });
    condition(&normal).ok()?;
    let cofactors = Cholesky::new(normal)?.inverse();
    Some(cofactors.diagonal().rows(0, COORDINATES).sum().sqrt())
}

fn row(sight: &Vector3<f64>, clock: usize, clocks: usize) -> DVector<f64> {
    let mut row = DVector::zeros(COORDINATES + clocks);
    row.fixed_rows_mut::<COORDINATES>(0).copy_from(&-sight);
    if let Some(slot) = row.get_mut(COORDINATES + clock) {
        *slot = 1.0;
    }
    row
}

/// An estimate on the way to a solution.
struct Estimate {
    position_m: Vector3<f64>,
    clocks_m: DVector<f64>,
}

/// One range at an estimate: computed value and derivative.
struct Line {
    computed_m: f64,
    row: DVector<f64>,
    sight: Vector3<f64>,
    sigma_m: f64,
    elevation_rad: f64,
    /// Effect on the range, in metres, of one prior deviation of each of the ionosphere's common errors.
    common_m: Vector3<f64>,
}

/// The errors of the ionosphere's model: z of prior mean 0 and unit variance.
struct Common {
    /// Σ w a fᵀ over the ranges: a the derivatives of a range, f its derivatives by z.
    coupling: MatrixXx3<f64>,
    /// Inverse of Σ w f fᵀ and the prior's weight, 1.
    inverse: Matrix3<f64>,
    /// Σ w f v.
    right: Vector3<f64>,
}

impl Common {
    fn of(ranges: &[Range], lines: &[Line]) -> Self {
        let unknowns = lines.first().map_or(0, |line| line.row.len());
        let (mut coupling, mut weight, mut right) = (MatrixXx3::zeros(unknowns), Matrix3::identity(), Vector3::zeros());
        for (range, line) in ranges.iter().zip(lines) {
            let weighted = line.common_m / (line.sigma_m * line.sigma_m);
            coupling += &line.row * weighted.transpose();
            weight += weighted * line.common_m.transpose();
            right += (range.pseudorange_m - line.computed_m) * weighted;
        }
        // The prior alone makes it positive.
        let inverse = Cholesky::new(weight).map_or_else(Matrix3::identity, |factor| factor.inverse());
        Self { coupling, inverse, right }
    }
}

fn line(range: &Range, clock: usize, at: &Estimate, corrections: &Corrections, day: f64) -> Line {
    let position_m = &at.position_m;
    let clock_m = at.clocks_m.get(clock).copied().unwrap_or(0.0);
    // Light time and rotation: the correction of the second pass is below a micrometre.
    let mut seen_m = range.satellite.position_m;
    for _ in 0..3 {
        let travel_s = (seen_m - position_m).norm() / SPEED_OF_LIGHT_MPS;
        seen_m = rotate_earth(&range.satellite.position_m, planted!("receiver.position.earth_rotation", travel_s, 0.0));
    }
    let distance_m = (seen_m - position_m).norm();
    let sight = (seen_m - position_m) / distance_m;
    let sent_s = planted!("receiver.position.clock_sign", range.clock.offset_s, -range.clock.offset_s);
    let mut computed_m = distance_m + clock_m - SPEED_OF_LIGHT_MPS * sent_s;
    let mut variance = range.noise_m * range.noise_m;
    let mut elevation_rad = std::f64::consts::FRAC_PI_2;
    let mut common_m = Vector3::zeros();
    if position_m.norm() > NEAR_EARTH_M {
        let user = Geodetic::from_ecef(position_m);
        let direction = look(user, position_m, &seen_m);
        elevation_rad = direction.elevation_rad;
        let sine = libm::sin(elevation_rad);
        let received = range.emitted.plus_s(distance_m / SPEED_OF_LIGHT_MPS);
        let dry = if corrections.troposphere { troposphere::delay_m(user, sine, day) } else { 0.0 };
        let dry = planted!("receiver.position.troposphere", dry, 1.02 * dry);
        computed_m += dry;
        let air = electrons(range, &corrections.ionosphere, user, direction, received);
        computed_m += air.delay_m;
        variance += air.own_m * air.own_m;
        common_m = air.common_m;
        let slant = if user.height_m < SPACE_M { sine.max(0.05) } else { 1.0 };
        let slant = planted!("receiver.position.model_sigma", slant, 1.0);
        let model_m = corrections.model_sigma_m / slant;
        variance += model_m * model_m;
    }
    Line {
        computed_m,
        row: row(&sight, clock, at.clocks_m.len()),
        sight,
        sigma_m: variance.sqrt(),
        elevation_rad,
        common_m,
    }
}

/// Delay by the ionosphere, and deviations of it: common to all satellites, and this one's own.
#[derive(Default)]
struct Air {
    delay_m: f64,
    common_m: Vector3<f64>,
    own_m: f64,
}

fn electrons(range: &Range, ionosphere: &Ionosphere, user: Geodetic, direction: Look, received: Epoch) -> Air {
    if range.is_combined {
        return Air::default();
    }
    match ionosphere {
        Ionosphere::Absent => Air::default(),
        Ionosphere::Known(delays) => {
            let delay_s = delays.delay_s(range, user, direction, received);
            let delay_s = planted!("receiver.position.ionosphere", delay_s, 0.9 * delay_s);
            Air { delay_m: SPEED_OF_LIGHT_MPS * delay_s, ..Air::default() }
        }
        // Above all electrons there is no error of them.
        Ionosphere::Uncertain(_, _) if user.height_m > IONOSPHERE_TOP_M => Air::default(),
        Ionosphere::Uncertain(delays, error) => {
            let delay_s = delays.delay_s(range, user, direction, received);
            let obliquity = NOMINAL.bulge(user, direction, received).obliquity;
            let (common_m, own_m) = error.slant_m(delay_s, obliquity, direction);
            Air { delay_m: SPEED_OF_LIGHT_MPS * delay_s, common_m, own_m }
        }
        Ionosphere::Grid(grid, otherwise) => {
            let on_ground = user.height_m < SPACE_M;
            match grid.slant_m(user, direction, range.carrier_hz).filter(|_| on_ground) {
                Some((delay_m, own_m)) => Air { delay_m, own_m, ..Air::default() },
                None => {
                    let air = electrons(range, otherwise, user, direction, received);
                    let own_m = libm::hypot(air.own_m, model_sigma_m(air.delay_m, user, direction));
                    Air { own_m, ..air }
                }
            }
        }
    }
}

/// Solves for position and clocks from a first estimate, which may be the Earth's centre.
///
/// # Errors
/// Fewer ranges than unknowns, a geometry that gives no position, or no convergence.
pub fn position(ranges: &[Range], start_m: Vector3<f64>, corrections: &Corrections) -> Result<Solution, NoFix> {
    let scales = scales(ranges);
    let need = (COORDINATES + scales.len()).max(UNKNOWNS);
    if ranges.len() < need {
        return Err(NoFix::TooFew { have: ranges.len(), need });
    }
    let clock = |range: &Range| scales.iter().position(|scale| *scale == range.time).unwrap_or(0);
    let clock_of: Vec<usize> =
        ranges.iter().map(|range| planted!("receiver.position.own_clock", clock(range), 0)).collect();
    let day = ranges.first().map_or(1.0, |range| range.emitted.day_of_year());
    let lines = |at: &Estimate| -> Vec<Line> {
        ranges.iter().zip(&clock_of).map(|(range, &clock)| line(range, clock, at, corrections, day)).collect()
    };
    // Clocks enter linearly; starting near them only keeps the first residuals small.
    let mut at = Estimate { position_m: start_m, clocks_m: DVector::zeros(scales.len()) };
    let mut step_m = f64::INFINITY;
    for iteration in 1..=LARGEST_ITERATIONS {
        let lines_here = lines(&at);
        let mut plain = DMatrix::zeros(need, need);
        let mut normal = DMatrix::zeros(need, need);
        let mut right = DVector::zeros(need);
        for (range, line) in ranges.iter().zip(&lines_here) {
            let weight = 1.0 / (line.sigma_m * line.sigma_m);
            let weight = planted!("receiver.position.weight", weight, line.sigma_m * line.sigma_m);
            plain.ger(1.0, &line.row, &line.row, 1.0);
            normal.ger(weight, &line.row, &line.row, 1.0);
            right.axpy(weight * (range.pseudorange_m - line.computed_m), &line.row, 1.0);
        }
        let condition = condition(&plain)?;
        let common = Common::of(ranges, &lines_here);
        let eliminated = &common.coupling * common.inverse;
        normal -= &eliminated * common.coupling.transpose();
        right -= &eliminated * common.right;
        let solver = Cholesky::new(normal).ok_or(NoFix::Singular { condition: f64::INFINITY })?;
        let step = solver.solve(&right);
        at.position_m += step.fixed_rows::<COORDINATES>(0);
        at.clocks_m += step.rows(COORDINATES, scales.len());
        step_m = step.norm();
        if !step_m.is_finite() {
            break;
        }
        if step_m < CONVERGED_M {
            let dilution = Cholesky::new(plain).ok_or(NoFix::Singular { condition: f64::INFINITY })?.inverse();
            let lines = lines(&at);
            let common = Common::of(ranges, &lines);
            let ionosphere_error = common.inverse * common.right;
            let residual = |(range, line): (&Range, &Line)| {
                range.pseudorange_m - line.computed_m - ionosphere_error.dot(&line.common_m)
            };
            let residuals_m: Vec<f64> = ranges.iter().zip(&lines).map(residual).collect();
            let squares = residuals_m.iter().zip(&lines).map(|(v, line)| (v / line.sigma_m) * (v / line.sigma_m));
            let chi_square = squares.sum::<f64>() + ionosphere_error.norm_squared();
            return Ok(Solution {
                position_m: at.position_m,
                clocks: scales.into_iter().zip(at.clocks_m.iter().copied()).collect(),
                clock_of,
                residuals_m,
                sigmas_m: lines.iter().map(|line| line.sigma_m).collect(),
                sights: lines.iter().map(|line| line.sight).collect(),
                elevations_rad: lines.iter().map(|line| line.elevation_rad).collect(),
                commons_m: lines.iter().map(|line| line.common_m).collect(),
                covariance: solver.inverse(),
                dilution,
                condition,
                chi_square,
                ionosphere_error,
                iterations: iteration,
            });
        }
    }
    Err(NoFix::Diverged { iterations: LARGEST_ITERATIONS, step_m })
}

/// Ratio of the extreme singular values of the geometry, refused from [`LARGEST_CONDITION`] on.
fn condition(plain: &DMatrix<f64>) -> Result<f64, NoFix> {
    let values = plain.symmetric_eigenvalues();
    let (low, high) = (values.min(), values.max());
    let condition = if low > 0.0 { (high / low).sqrt() } else { f64::INFINITY };
    if condition < LARGEST_CONDITION { Ok(condition) } else { Err(NoFix::Singular { condition }) }
}

/// Velocity in ECEF and clock drift from Dopplers, at a solved position.
///
/// With q = 1 + f_D/f the received rate, g = q (1 + n·v_s/c) / (1 + satellite drift) and inertial velocities,
/// (1 + drift) g = 1 + n·v_u/c exactly: linear in the unknowns. Rates of the atmosphere are left out (mm/s).
///
/// # Errors
/// Errors of the position's geometry.
pub fn velocity(ranges: &[Range], solution: &Solution) -> Result<(Vector3<f64>, f64), NoFix> {
    let spin = Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS);
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for (range, sight) in ranges.iter().zip(&solution.sights) {
        let frame_mps = spin.cross(&range.satellite.position_m);
        let inertial_mps =
            range.satellite.velocity_mps + planted!("receiver.velocity.frame", frame_mps, Vector3::zeros());
        let mut travel_s = 0.0;
        for _ in 0..3 {
            let seen_m = rotate_earth(&range.satellite.position_m, travel_s);
            travel_s = (seen_m - solution.position_m).norm() / SPEED_OF_LIGHT_MPS;
        }
        let along_mps = sight.dot(&rotate_earth(&inertial_mps, travel_s));
        let received = 1.0 + range.doppler_hz / range.carrier_hz;
        let rate = received * (1.0 + along_mps / SPEED_OF_LIGHT_MPS)
            / (1.0 + planted!("receiver.velocity.satellite_drift", range.clock.drift, 1e-9));
        // The fourth unknown is c times the drift.
        let row = Vector4::new(sight.x, sight.y, sight.z, -rate);
        normal += range.cn0_hz * row * row.transpose();
        right += range.cn0_hz * SPEED_OF_LIGHT_MPS * (rate - 1.0) * row;
    }
    let solver = Cholesky::new(normal).ok_or(NoFix::Singular { condition: f64::INFINITY })?;
    let found = solver.solve(&right);
    let inertial_mps = Vector3::new(found.x, found.y, found.z);
    Ok((
        inertial_mps - spin.cross(&solution.position_m),
        planted!("receiver.velocity.drift_sign", found.w, -found.w) / SPEED_OF_LIGHT_MPS,
    ))
}
