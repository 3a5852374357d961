//! Figures of a run's fixes that an ensemble of independent runs needs: one number a run.
//!
//! Fixes before and after the ionosphere's parameters are judged apart, at the first fix and at the last of
//! each kind: fixes of one run remember each other, those of different runs do not. The message's timetable
//! says when a receiver that has locked can have an ephemeris (IS-GPS-200N, 20.3.3: subframes of 6 s, 1 to 3
//! once in 30 s).

use nalgebra::Vector3;

use analysis::error::JudgeError;
use analysis::measure::consistency::Consistency;
use analysis::measure::errors::Errors;
use analysis::read::Run;
use analysis::statistics::percentile;
use gnss::record::{Fix, IonosphereModel};

/// Figures of the fixes that a study may keep. `nees` is that of a single fix. For a consistent receiver its
/// mean over independent runs is 3 with a variance of 6 over their number.
pub const FIGURES: &[&str] = &[
    "message.ready_s",
    "message.in_time",
    "first.horizontal_m",
    "first.vertical_m",
    "first.nees",
    "nominal.fixes",
    "nominal.horizontal_p95_m",
    "nominal.vertical_p95_m",
    "nominal.last_nees",
    "broadcast.fixes",
    "broadcast.horizontal_p95_m",
    "broadcast.vertical_p95_m",
    "broadcast.velocity_p95_mps",
    "broadcast.last_nees",
    "broadcast.step_m",
    "broadcast.step_sigmas",
    "tracking.slips_per_hour",
];

/// Time to search, lock and find the symbols that a cold start is granted.
const LOCK_S: f64 = 4.0;
/// Nearest and farthest satellite in seconds of travel.
const TRAVEL_S: [f64; 2] = [0.066, 0.092];
/// Time between measurements, in seconds.
const STEP_S: f64 = 0.1;
const SUBFRAME_S: f64 = 6.0;
const FRAME_S: f64 = 30.0;

/// A fix with its error.
struct Judged {
    fix: Fix,
    enu_m: Vector3<f64>,
    speed_error_mps: f64,
    nees: Option<f64>,
}

/// The fixes of a run.
pub struct Fixes<'r> {
    run: &'r Run,
    slips: usize,
    rows: Vec<Judged>,
}

impl<'r> Fixes<'r> {
    /// Joins fixes with their errors.
    ///
    /// # Errors
    /// [`JudgeError`] where rows cannot be read or put away.
    pub fn of(run: &'r Run, errors: &Errors) -> Result<Self, JudgeError> {
        let consistency = Consistency::measure(run, errors)?;
        let (mut fixes, mut nees, mut rows) = (run.fixes.finder()?, consistency.rows.finder()?, Vec::new());
        errors.positions.each(|error| {
            let Some(fix) = fixes.get(error.sample) else { return };
            rows.push(Judged {
                fix,
                enu_m: error.enu_m,
                speed_error_mps: error.velocity_enu_mps.norm(),
                nees: nees.get(error.sample).map(|row| row.nees),
            });
        })?;
        consistency.rows.sound()?;
        run.sound()?;
        errors.sound()?;
        Ok(Self { run, slips: errors.cycle_slips, rows })
    }

    fn with(&self, model: IonosphereModel) -> impl DoubleEndedIterator<Item = &Judged> {
        // What is broadcast, of whichever model.
        let of = |used| match used {
            IonosphereModel::NequickG | IonosphereModel::Bdgim => IonosphereModel::Broadcast,
            other => other,
        };
        self.rows.iter().filter(move |row| of(row.fix.ionosphere) == model)
    }

    fn p95(&self, model: IonosphereModel, of: impl Fn(&Judged) -> f64) -> Option<f64> {
        percentile(&self.with(model).map(of).collect::<Vec<_>>(), 0.95)
    }

    /// Step from the last fix before the ionosphere's parameters to the first one after.
    fn step(&self) -> Option<(Vector3<f64>, &Fix)> {
        let before = self.with(IonosphereModel::Nominal).next_back()?;
        let after = self.with(IonosphereModel::Broadcast).next()?;
        Some((after.enu_m - before.enu_m, &before.fix))
    }

    /// Time in seconds at which the last of subframes 1 to 3 has come from all satellites, of those that
    /// begin [`LOCK_S`] after the start or later.
    fn ready_s(&self) -> Option<f64> {
        let first = self.run.trajectory.first()?;
        // Of the week's 20 160 frames each begins at a multiple of 30 s of GPS time, which 1980's seconds are
        // too.
        let lock_s = first.time().seconds().rem_euclid(FRAME_S as i64) as f64 + first.time().fraction() + LOCK_S;
        let end_s = |number: f64| {
            let begin_s = SUBFRAME_S * number;
            let waited = ((lock_s - TRAVEL_S[0] - begin_s) / FRAME_S).ceil().max(0.0);
            begin_s + waited * FRAME_S + SUBFRAME_S + TRAVEL_S[1] + STEP_S
        };
        let whole_s = [0.0, 1.0, 2.0].map(end_s).into_iter().fold(0.0, f64::max);
        Some(whole_s - (lock_s - LOCK_S))
    }

    /// A figure of [`FIGURES`] by its name.
    pub fn figure(&self, name: &str) -> Option<f64> {
        let flat = |row: &Judged| libm::hypot(row.enu_m.x, row.enu_m.y);
        let up = |row: &Judged| row.enu_m.z.abs();
        let first = self.rows.first();
        let last_nees = |model| self.with(model).next_back().and_then(|row| row.nees);
        use IonosphereModel::{Broadcast, Nominal};
        match name {
            "message.ready_s" => self.ready_s(),
            "message.in_time" => {
                let fix_s = first.map_or(f64::INFINITY, |row| self.run.time_s(row.fix.sample));
                self.ready_s().map(|ready_s| f64::from(u8::from(fix_s <= ready_s)))
            }
            "first.horizontal_m" => first.map(flat),
            "first.vertical_m" => first.map(up),
            "first.nees" => first.and_then(|row| row.nees),
            "nominal.fixes" => Some(self.with(Nominal).count() as f64),
            "nominal.horizontal_p95_m" => self.p95(Nominal, flat),
            "nominal.vertical_p95_m" => self.p95(Nominal, up),
            "nominal.last_nees" => last_nees(Nominal),
            "broadcast.fixes" => Some(self.with(Broadcast).count() as f64),
            "broadcast.horizontal_p95_m" => self.p95(Broadcast, flat),
            "broadcast.vertical_p95_m" => self.p95(Broadcast, up),
            "broadcast.velocity_p95_mps" => self.p95(Broadcast, |row| row.speed_error_mps),
            "broadcast.last_nees" => last_nees(Broadcast),
            "broadcast.step_m" => self.step().map(|(step_m, _)| step_m.norm()),
            "broadcast.step_sigmas" => self.step().map(|(step_m, fix)| {
                let variance = |a: f64| a * a;
                let stated = variance(fix.sigma_east_m) + variance(fix.sigma_north_m) + variance(fix.sigma_up_m);
                step_m.norm() / stated.sqrt()
            }),
            "tracking.slips_per_hour" => Some(self.slips as f64 * 3600.0 / self.run.scene.duration_s),
            _ => None,
        }
    }
}
