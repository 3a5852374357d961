//! Levels of fidelity for a scene, each with its time, memory and largest errors.
//!
//! Errors of samples are those that a budget is held against ([`Promise`]). The time of a level is the
//! plan's, with the kernels' costs of this level in place of the chosen one's ([`kernel_ns`]). Limits: the
//! ratio of two costs is that of the processor that measured them.

use serde::Serialize;

use super::Plan;
use crate::fidelity::{Fidelity, Grade, Promise, kernel_ns, noise_ns};
use crate::scene::Scene;

/// Level of fidelity as a choice for a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rung {
    /// Name of the level.
    pub level: &'static str,
    /// Reason for which the scene does not have it.
    pub refused: Option<String>,
    /// Processor time of this machine in seconds.
    #[serde(skip)]
    pub time_s: f64,
    /// Memory of blocks of samples and of the motion in bytes, where samples are made.
    pub memory_bytes: Option<u64>,
    /// Largest errors.
    pub errors: Option<Errors>,
}

/// Largest errors of a level for the worst of a scene's signals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Error of a code in metres.
    pub code_m: f64,
    /// Error of a carrier in cycles.
    pub carrier_cycles: f64,
    /// Error of a C/N0 in dB, against an ideal filter of the samples' band.
    pub cn0_db: f64,
}

impl From<Promise<'_>> for Errors {
    fn from(promise: Promise<'_>) -> Self {
        let Promise { code_m: (_, code_m), carrier_cycles, cn0_db: (_, cn0_db) } = promise;
        Self { code_m, carrier_cycles, cn0_db }
    }
}

impl Rung {
    /// The levels that make samples, and a scene's budget beside them.
    pub fn of_samples(scene: &Scene, plan: &Plan) -> Vec<Self> {
        let own = Some(scene.fidelity.grade).filter(|grade| matches!(grade, Grade::Budget(_)));
        let all = [Grade::Fast, Grade::Balanced, Grade::Reference].into_iter().chain(own);
        all.map(|grade| Self::new(grade, scene, plan)).collect()
    }

    fn new(grade: Grade, scene: &Scene, plan: &Plan) -> Self {
        let Fidelity { allowed_m, .. } = scene.fidelity;
        let rate_hz = scene.clock.rate.hz();
        let suited = Fidelity::suited(grade, rate_hz, allowed_m, &scene.signals);
        let refused = suited.as_ref().err().map(ToString::to_string);
        let knobs = suited.unwrap_or(scene.fidelity);
        let links = || plan.satellites.iter().flat_map(|row| scene.signals_of(row.sv));
        let sample_ns = |knobs: &Fidelity| {
            let of = |signal| kernel_ns(signal, rate_hz, knobs.code_edge, knobs.carrier).unwrap_or(0.0);
            links().map(of).sum::<f64>() + if scene.noise { noise_ns(knobs.noise) } else { 0.0 }
        };
        let own_ns = sample_ns(&scene.fidelity);
        let dearer = if own_ns > 0.0 { sample_ns(&knobs) / own_ns } else { 1.0 };
        let samples_s = 1e-9 * plan.sample_ns * scene.samples as f64;
        Self {
            level: grade.name(),
            refused,
            time_s: plan.time_s + samples_s * (dearer - 1.0),
            memory_bytes: Some(plan.memory_bytes),
            errors: Promise::of(&knobs, rate_hz, &scene.signals).map(Errors::from),
        }
    }

    /// Level of several front ends: the sum of times and memories, and the worst errors.
    pub fn join(self, other: Self) -> Self {
        let worst = |a: Errors, b: Errors| Errors {
            code_m: a.code_m.max(b.code_m),
            carrier_cycles: a.carrier_cycles.max(b.carrier_cycles),
            cn0_db: a.cn0_db.max(b.cn0_db),
        };
        Self {
            refused: self.refused.or(other.refused),
            time_s: self.time_s + other.time_s,
            memory_bytes: self.memory_bytes.zip(other.memory_bytes).map(|(a, b)| a + b),
            errors: self.errors.zip(other.errors).map(|(a, b)| worst(a, b)).or(self.errors).or(other.errors),
            ..self
        }
    }
}
