//! What the antenna's motion leaves in a velocity: a rate lags by a part of an update, and a change of acceleration leaves a transient.
//!
//! Limits: acceleration and jerk are differences of the truth's velocities, at least a truth's interval wide.

use std::collections::HashMap;

use crate::analysis::expect::ranges::Choices;
use crate::analysis::load::Run;

/// Bandwidth over natural frequency of loops of the second and third order (Kaplan and Hegarty, table 5.6).
const SECOND_ORDER: f64 = 0.53;
const THIRD_ORDER: f64 = 0.7845;
/// The rate's error in a third-order loop under jerk J is b·J/ω0² with b = 2.4 (Kaplan and Hegarty, table 5.6); its transient overshoots by a
/// quarter.
const TRANSIENT: f64 = 3.0;
/// Rows before an epoch whose motion is still in the loop: half a second at ten a second, several of a loop's time constants.
const ROWS: usize = 5;
/// What light time, orbit and rounding leave in a receiver at rest: orbits as sent err by 1 mm/s.
const REST_MPS: f64 = 2e-3;

/// Bounds of a run's epochs.
pub(super) struct Motion {
    at: HashMap<u64, f64>,
}

impl Motion {
    pub fn new(run: &Run, choices: &Choices) -> Self {
        let ratio = if choices.loops.pll_order >= 3 { THIRD_ORDER } else { SECOND_ORDER };
        let natural_radps = choices.loops.pll_bandwidth_hz / ratio;
        let rows = &run.trajectory;
        let accelerations: Vec<_> = rows
            .windows(2)
            .map(|two| (two[1].velocity_mps() - two[0].velocity_mps()) / two[1].time().since(two[0].time()).max(1e-6))
            .collect();
        let single: Vec<f64> = (0..rows.len())
            .map(|index| {
                let around = accelerations.get(index.saturating_sub(2)..(index + 1).min(accelerations.len()));
                let around = around.unwrap_or(&[]);
                let most = around.iter().map(|a| a.norm()).fold(0.0, f64::max);
                let step_s = rows.get(1).zip(rows.first()).map_or(0.1, |(b, a)| b.time().since(a.time()).max(1e-6));
                let jerk = around.windows(2).map(|two| (two[1] - two[0]).norm() / step_s).fold(0.0, f64::max);
                most * choices.update_s + TRANSIENT * jerk / (natural_radps * natural_radps)
            })
            .collect();
        let worst = |index: usize| {
            let around = single.get(index.saturating_sub(ROWS)..(index + 2).min(single.len())).unwrap_or(&[]);
            around.iter().copied().fold(0.0, f64::max)
        };
        Self { at: rows.iter().enumerate().map(|(index, row)| (row.sample, REST_MPS + worst(index))).collect() }
    }

    /// What may come on top of noise at a sample.
    pub fn allowed_mps(&self, sample: u64) -> f64 {
        self.at.get(&sample).copied().unwrap_or(REST_MPS)
    }
}
