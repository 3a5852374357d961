//! A foreign receiver's positions and velocities against what the scene allows a plain receiver.
//!
//! Random errors are those of least squares with equal weights on a plain receiver's ranges. What lasts over
//! a file is less: biases of single satellites, models that differ by a metre, and the ionosphere where no
//! page of it came or the broadcast model errs. A position that is old lies behind along the motion. Limits:
//! a receiver that filters its positions has smaller errors and is held against the same limits.

use std::collections::HashMap;

use super::atmosphere::{Atmosphere, Moved};
use super::plain::{self, Scene};
use super::times::Labels;
use crate::error::JudgeError;
use crate::expect::due::{Due, Expectations};
use crate::expect::quantile::largest;
use crate::judge::foreign::place::{FixError, Places};
use crate::judge::judgement::Bound;
use crate::judge::rules::kind::THEORY;
use crate::judge::verdict::Verdict;
use crate::statistics::{mean, median, percentile, rms};

/// Difference of two models of troposphere and ionosphere on a range, one sigma: a metre at 5 degrees.
const MODEL_M: f64 = 1.0;
/// Dilution up to which positions are judged.
const MOST_PDOP: f64 = 10.0;
/// Age of a position that nobody notices, and that of a filter's.
const AGE_S: f64 = 0.03;
/// Age of a velocity: half a second between positions, and a filter.
const VELOCITY_AGE_S: f64 = 0.5;
/// Speed from which on a course means something.
const SLOWEST_MPS: f64 = 1.0;
/// Differences of course and speed that are not reported: 5 degrees, and as much of the speed.
const COURSE_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Fixes that must be equal to the ones before, of hundred, before they are called frozen.
const REPEATED_PERCENT: f64 = 50.0;
/// Steps of a written latitude from which on positions may repeat.
const COARSE_M: f64 = 0.2;

/// A fix, its horizontal and vertical dilution, and what the atmosphere may add.
struct Judged<'p> {
    row: &'p FixError,
    dilutions: (f64, f64),
    air: Moved,
}

impl Judged<'_> {
    /// Error that the atmosphere may add.
    fn air_m(&self) -> f64 {
        libm::hypot(self.air.horizontal_m, self.air.vertical_m(self.row.up_m))
    }
}

impl Verdict {
    /// Errors of positions against those of a plain receiver's least squares.
    pub(super) fn places(
        &mut self,
        scene: &Scene<'_>,
        places: &Places,
        labels: &Labels,
        expected: &Expectations,
    ) -> Result<(), JudgeError> {
        let dues: HashMap<u64, &Due> = expected.epochs.iter().map(|due| (due.sample, due)).collect();
        let plain = expected.satellites.iter().filter_map(|(link, one)| plain::code_m(link, one.usual_dbhz));
        let Some(plain_m) = median(&plain.collect::<Vec<_>>()) else { return Ok(()) };
        // What lasts, and all.
        let lasting_m = libm::hypot(libm::hypot(scene.usual_edges_m(), MODEL_M), scene.reach_m());
        let range_m = libm::hypot(plain_m, lasting_m);
        let mut air = Atmosphere::of(scene.run)?;
        let judged = |row: &FixError| scene.is_bounded(row.label_s) && !scene.is_faulty(row.label_s);
        let mut rows = Vec::new();
        for row in places.rows.iter().filter(|row| judged(row)) {
            let Some(sample) = labels.sample_at(row.label_s) else { continue };
            let Some(due) = dues.get(&sample).filter(|due| due.pdop() <= MOST_PDOP) else { continue };
            let air = air.moves_m(sample)?;
            rows.push(Judged { row, dilutions: due.dilutions(), air });
        }
        if rows.is_empty() {
            let why = "none where satellites are placed well and the scene lets noise and reflections decide";
            self.not_judged.push(format!("errors of positions: {why}"));
            return Ok(());
        }
        let source = format!(
            "a plain receiver's ranges ({range_m:.1} m: loop noise, code edges, a metre between models, reflections), \
             the dilution of the satellites that must be used, and the ionosphere that no page corrects"
        );
        self.lasting(&rows, lasting_m, &source);
        let all: Vec<f64> = rows.iter().map(|one| one.row.length_m()).collect();
        let limit = |one: &Judged<'_>, factor: f64| {
            let pdop = libm::hypot(one.dilutions.0, one.dilutions.1);
            factor * THEORY * pdop * range_m + one.air_m()
        };
        let limits: Vec<f64> = rows.iter().map(|one| limit(one, largest(3, 20))).collect();
        if let (Some(value), Some(limit)) = (percentile(&all, 0.95), percentile(&limits, 0.95)) {
            self.judge("position error, 95 %", "position.error_3d_p95_m", value, "m", Bound::Max(limit), &source);
            let left_out = places.rows.len() - rows.len();
            if left_out > 0 {
                self.without(&format!(
                    "{left_out} of {} positions, where geometry, signals or the scene bound no error",
                    places.rows.len()
                ));
            }
        }
        let factor = largest(3, rows.len());
        let over = |one: &Judged<'_>| one.row.length_m() / limit(one, factor);
        if let Some(worst) = rows.iter().max_by(|a, b| over(a).total_cmp(&over(b))) {
            let source = format!("{source}; at {:.1} s, nearest to its limit or farthest beyond", worst.row.label_s);
            let bound = Bound::Max(limit(worst, factor));
            self.judge("position error, largest", "", worst.row.length_m(), "m", bound, &source);
        }
        self.age(&rows, places, lasting_m);
        self.velocities(&rows, scene);
        Ok(())
    }

    /// Means of the errors: what noise does not excuse.
    fn lasting(&mut self, rows: &[Judged<'_>], lasting_m: f64, source: &str) {
        let of = |of: &dyn Fn(&Judged<'_>) -> f64| mean(&rows.iter().map(of).collect::<Vec<_>>()).unwrap_or(0.0);
        let (east_m, north_m, up_m) = (of(&|one| one.row.east_m), of(&|one| one.row.north_m), of(&|one| one.row.up_m));
        let horizontal =
            largest(2, 1) * THEORY * of(&|one| one.dilutions.0) * lasting_m + of(&|one| one.air.horizontal_m);
        let vertical =
            largest(1, 1) * THEORY * of(&|one| one.dilutions.1) * lasting_m + of(&|one| one.air.vertical_m(up_m));
        for (figure, value, limit) in [
            ("horizontal position error, mean", libm::hypot(east_m, north_m), horizontal),
            ("vertical position error, mean", up_m.abs(), vertical),
        ] {
            self.judge(figure, "", value, "m", Bound::Max(limit), source);
            self.explain(vec![format!("{east_m:+.2} m east, {north_m:+.2} m north, {up_m:+.2} m up")]);
        }
    }

    /// Judges the time labels of the positions.
    fn age(&mut self, rows: &[Judged<'_>], places: &Places, lasting_m: f64) {
        let speeds: Vec<f64> = rows.iter().map(|one| one.row.true_velocity_enu_mps.norm()).collect();
        let Some(speed_mps) = rms(&speeds).filter(|speed_mps| *speed_mps > SLOWEST_MPS) else {
            self.not_judged.push("age of positions: the antenna is at rest".to_owned());
            return;
        };
        let dilution = mean(&rows.iter().map(|one| one.dilutions.0).collect::<Vec<_>>()).unwrap_or(1.0);
        let theory_s = THEORY * dilution * lasting_m / speed_mps;
        let along = |one: &Judged<'_>| {
            let velocity = one.row.true_velocity_enu_mps;
            (one.row.east_m * velocity.x + one.row.north_m * velocity.y, velocity.xy().norm_squared())
        };
        let sums = rows.iter().map(along).fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        let plain = (-sums.0 / sums.1, theory_s);
        // A motion that turns or changes its speed tells age from a lasting error.
        let (late_s, sigma_s) = match places.changing_s {
            Some(found) if 2.0 * found.sigma < theory_s => (found.value, 2.0 * found.sigma),
            _ => plain,
        };
        let limit = AGE_S + largest(1, 1) * sigma_s;
        let source = "errors along the motion: 30 ms, and what lasting errors or, where the motion changes, the \
                      scatter of the errors make of it";
        let path = "position.time_tag_offset_s";
        self.judge("age of positions", path, late_s.abs(), "s", Bound::Max(limit), source);
    }

    /// Speed and course over ground.
    fn velocities(&mut self, rows: &[Judged<'_>], scene: &Scene<'_>) {
        let with: Vec<(&Judged<'_>, f64)> = rows
            .iter()
            .filter_map(|one| Some((one, libm::hypot(one.row.velocity_east_mps?, one.row.velocity_north_mps?))))
            .collect();
        let wavelength_m = scene.run.mean_wavelength_m().unwrap_or(0.2);
        let sigma_mps = |one: &Judged<'_>| THEORY * one.dilutions.0 * wavelength_m * plain::doppler_hz();
        // What a velocity that is old by half a second misses.
        let aged = |index: usize| {
            let around = with.get(index.saturating_sub(1)..(index + 2).min(with.len())).unwrap_or(&[]);
            let rates = around.windows(2).map(|two| {
                let (from, to) = (&two[0].0.row, &two[1].0.row);
                let change = to.true_velocity_enu_mps - from.true_velocity_enu_mps;
                change.norm() / (to.label_s - from.label_s).max(1e-3)
            });
            VELOCITY_AGE_S * rates.fold(0.0, f64::max)
        };
        let factor = largest(2, with.len());
        let limits: Vec<f64> = with
            .iter()
            .enumerate()
            .map(|(index, (one, _))| factor * sigma_mps(one) + aged(index) + scene.mirrors_mps())
            .collect();
        let worst = with.iter().zip(&limits).max_by(|a, b| (a.0.1 / a.1).total_cmp(&(b.0.1 / b.1)));
        if let Some(((one, value), limit)) = worst {
            let source = format!(
                "a plain receiver's Dopplers (1.4 Hz), dilution, half a second of acceleration and mirrors; at {:.1} \
                 s, nearest to its limit or farthest beyond",
                one.row.label_s
            );
            self.judge("velocity over ground error, largest", "", *value, "m/s", Bound::Max(*limit), &source);
        }
        // Of the true velocity what is reported, as a complex factor: its angle is the course's error.
        let (mut product, mut squares, mut noise) = ((0.0, 0.0), 0.0, 0.0);
        for (index, (one, _)) in with.iter().enumerate() {
            let truth = one.row.true_velocity_enu_mps;
            let east = one.row.velocity_east_mps.unwrap_or(0.0) + truth.x;
            let north = one.row.velocity_north_mps.unwrap_or(0.0) + truth.y;
            product.0 += truth.x * east + truth.y * north;
            product.1 += truth.x * north - truth.y * east;
            squares += truth.xy().norm_squared();
            let sigma = sigma_mps(one) + aged(index) + scene.mirrors_mps();
            noise += truth.xy().norm_squared() * sigma * sigma;
        }
        let count = with.len().max(1) as f64;
        if squares <= SLOWEST_MPS * SLOWEST_MPS * count {
            return;
        }
        // Errors of velocities that follow each other are taken for half as many.
        let sigma = (2.0 * noise).sqrt() / squares;
        let limit = COURSE_RAD + largest(1, 1) * sigma;
        let source = "the true course and speed: 5 degrees, and a plain receiver's Dopplers";
        let angle = libm::atan2(product.1, product.0).abs();
        self.judge("course over ground, error", "", angle.to_degrees(), "°", Bound::Max(limit.to_degrees()), source);
        let scale = (libm::hypot(product.0, product.1) / squares - 1.0).abs();
        self.judge("speed over ground, error of its scale", "", scale, "of 1", Bound::Max(limit), source);
    }

    /// Positions that repeat the ones before to the last digit.
    pub(super) fn repeated(&mut self, places: &Places, scene: &Scene<'_>) {
        if places.resolution_m > COARSE_M || places.rows.len() < 10 || !scene.run.scene.noise {
            return;
        }
        let percent = 100.0 * places.repeated as f64 / (places.rows.len() - 1) as f64;
        let source = "noise moves every position by more than its last digit";
        self.judge("positions equal to the one before", "", percent, "%", Bound::Max(REPEATED_PERCENT), source);
    }
}
