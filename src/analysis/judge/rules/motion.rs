//! Velocity errors by the antenna's motion: a rate lags by a part of an update, and a change of acceleration
//! causes a transient.
//!
//! Limits: acceleration and jerk are differences of the truth's velocities, at least a truth's interval wide.

use std::cell::RefCell;

use crate::error::JudgeError;
use crate::expect::closed::{exact_loop, natural_radps};
use crate::judge::forecast::ranges::Choices;
use crate::read::Run;
use crate::read::levels::Levels;
use gnss::record::TrajectoryRow;

/// Factor of the lag of a loop (s + ω)³ under jerk J: its rate lags by 3J/ω² and does not overshoot.
const THIRD_ORDER: f64 = 3.0;
/// Factor of the lag of a loop (s + ω)² under acceleration a: its rate lags by 2a/ω and does not overshoot.
const SECOND_ORDER: f64 = 2.0;
/// Share of the rate at which a turning antenna winds up all carriers together by which satellites differ: a
/// tilt of θ makes the rate of one satellite swing by tan θ times the tangent of its angle from the axis, and
/// a fix averages satellites on all sides.
const WIND_UP_SHARE: f64 = 0.1;
/// Rows before an epoch whose motion is still in the loop: half a second at ten a second, several of a loop's
/// time constants.
const ROWS: usize = 5;
/// Velocity error of a receiver at rest by light time, orbit and rounding, m/s: orbits as sent err by 1 mm/s.
const REST_MPS: f64 = 2e-3;

/// Bounds of a run's epochs.
pub(super) struct Motion {
    at: Levels<()>,
}

impl Motion {
    pub fn new(run: &Run, choices: &Choices) -> Result<Self, JudgeError> {
        let loops = &choices.loops;
        let of = |update_s: &f64| {
            let closed = exact_loop(loops.pll_order, loops.pll_bandwidth_hz * update_s)?;
            Some(natural_radps(&closed, loops.pll_order, *update_s))
        };
        // Of several signals the slowest loop.
        let natural_radps = choices.updates_s.values().filter_map(of).fold(f64::INFINITY, f64::min);
        let update_s = choices.updates_s.values().copied().fold(0.0, f64::max);
        let second = if loops.pll_order < 3 { SECOND_ORDER / natural_radps } else { 0.0 };
        let wavelength_m = run.mean_wavelength_m().unwrap_or(0.0);
        let (mut before, mut first_step_s): (Option<TrajectoryRow>, _) = (None, None);
        let (mut samples, mut accelerations) = (Vec::new(), Vec::new());
        run.trajectory.each(|row| {
            samples.push(row.sample);
            if let Some(before) = &before {
                let step_s = row.time().since(before.time()).max(1e-6);
                first_step_s.get_or_insert(step_s);
                accelerations.push((row.velocity_mps() - before.velocity_mps()) / step_s);
            }
            before = Some(row);
        })?;
        let step_s = first_step_s.unwrap_or(0.1);
        let single: Vec<f64> = (samples.iter().enumerate())
            .map(|(index, sample)| {
                let around = accelerations.get(index.saturating_sub(2)..(index + 1).min(accelerations.len()));
                let around = around.unwrap_or(&[]);
                let most = around.iter().map(|a| a.norm()).fold(0.0, f64::max);
                let jerk = around.windows(2).map(|two| (two[1] - two[0]).norm() / step_s).fold(0.0, f64::max);
                let wound_mps = run.common.wound_mps(*sample, wavelength_m);
                most * (update_s + second)
                    + THIRD_ORDER * jerk / (natural_radps * natural_radps)
                    + WIND_UP_SHARE * wound_mps.abs()
            })
            .collect();
        let worst = |index: usize| {
            let around = single.get(index.saturating_sub(ROWS)..(index + 2).min(single.len())).unwrap_or(&[]);
            around.iter().copied().fold(0.0, f64::max)
        };
        drop(accelerations);
        let mut at = Levels::new(run.trajectory.directory());
        for (index, sample) in samples.into_iter().enumerate() {
            at.change(sample, (), |_| REST_MPS + worst(index))?;
        }
        at.close()?;
        Ok(Self { at })
    }

    /// Allowed error besides noise in metres per second, sample by sample.
    pub fn allowed_mps(&self) -> impl Fn(u64) -> f64 + '_ {
        let found = RefCell::new(self.at.finder());
        move |sample| found.borrow_mut().get(sample, ()).unwrap_or(REST_MPS)
    }

    /// Checks that every bound that was looked up could be read.
    pub fn sound(&self) -> Result<(), JudgeError> {
        self.at.sound()
    }
}
