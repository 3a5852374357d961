//! Errors that modelled correlations keep, and whether they are within a scene's budget.
//!
//! The bounds are those that tests hold against samples without noise, component by component. Chip edges
//! take from C/N0 here as they do in samples. Limits: short codes of powers that differ by much are refused
//! while a scene runs, so a budget takes samples where their powers change in ways that a few instants do not
//! show.

use generator::fidelity::{Fidelity, Promise};
use generator::scene::{Grade, Scene};
use generator::spoof::Constellation;
use generator::stream::GenerateError;
use generator::truth;
use gnss::signal::Signal;

use super::{NEAR_FAR_DB, Refused, is_short, refuse};
use crate::TwinError;

/// Bound of the height of a correlation, as a share of it.
pub(super) const HEIGHT: f64 = 5e-3;
/// Instants of a scene at which powers are compared.
const INSTANTS: u64 = 24;

/// Bounds of a code in metres and of a carrier in cycles.
pub(super) fn bounds(signal: &Signal) -> (f64, f64) {
    let has_steps = signal.components.iter().any(|one| one.steps_per_chip() > 1);
    match (has_steps, signal.components.len()) {
        (true, _) => (2e-2, 2e-4),
        (false, 1) => (1e-3, 1e-4),
        // Components of one satellite in each other's correlations, 40 Hz beside the carrier.
        (false, _) => (8e-3, 1.7e-4),
    }
}

/// Knobs of a scene at this level: its own, and for a budget edges of area in place of those that samples
/// would need, since a model has no positions between samples.
pub fn knobs(scene: &Scene) -> Fidelity {
    let knot_tolerance_cycles = scene.fidelity.knot_tolerance_cycles;
    match scene.fidelity.grade {
        Grade::Budget(_) => Fidelity { knot_tolerance_cycles, ..Fidelity::of(Grade::Correlations) },
        _ => scene.fidelity,
    }
}

/// Largest errors at this level for the front ends of a scene. `None` without signals.
///
/// # Errors
/// [`Refused`], with an effect that has no model.
pub fn promise(scenes: &[Scene]) -> Result<Option<Promise<'static>>, Refused> {
    refuse(scenes)?;
    let of = |scene: &Scene| {
        let knobs = knobs(scene);
        let sampled = Promise::of(&knobs, scene.clock.rate.hz(), &scene.signals)?;
        let worst = |of: fn(&Signal) -> f64| {
            let all = scene.signals.iter().map(|signal| (*signal, of(signal)));
            all.max_by(|(_, a), (_, b)| a.total_cmp(b))
        };
        let (signal, cn0_db) = sampled.cn0_db;
        Some(Promise {
            code_m: worst(|signal| bounds(signal).0)?,
            carrier_cycles: knobs.knot_tolerance_cycles + worst(|signal| bounds(signal).1)?.1,
            cn0_db: (signal, cn0_db + 20.0 * libm::log10(1.0 + HEIGHT)),
        })
    };
    let larger = |a: (&'static Signal, f64), b: (&'static Signal, f64)| if a.1 < b.1 { b } else { a };
    let join = |a: Promise<'static>, b: Promise<'static>| Promise {
        code_m: larger(a.code_m, b.code_m),
        carrier_cycles: a.carrier_cycles.max(b.carrier_cycles),
        cn0_db: larger(a.cn0_db, b.cn0_db),
    };
    Ok(scenes.iter().filter_map(of).reduce(join))
}

/// Reason for which a scene with a budget takes samples; `None` where this level keeps it, and for a scene
/// without a budget.
///
/// # Errors
/// Errors of orbits.
pub fn broken(scenes: &[Scene]) -> Result<Option<String>, TwinError> {
    let budget = scenes.first().and_then(|scene| match scene.fidelity.grade {
        Grade::Budget(budget) => Some(budget),
        _ => None,
    });
    let Some(budget) = budget else { return Ok(None) };
    match promise(scenes) {
        Err(Refused { effect, .. }) => Ok(Some(format!("no model of {effect}"))),
        Ok(None) => Ok(Some("no signals".to_owned())),
        Ok(Some(promise)) => match budget.broken(&promise) {
            Some(broken) => Ok(Some(broken)),
            None => near_and_far(scenes),
        },
    }
}

/// Powers of short codes that differ by too much, or may.
fn near_and_far(scenes: &[Scene]) -> Result<Option<String>, TwinError> {
    for scene in scenes {
        for signal in scene.signals.iter().copied().filter(|signal| is_short(signal)) {
            let changes = ["obstruction", "city", "multipath"];
            let changing = scene.effects.iter().map(|effect| effect.name()).find(|name| changes.contains(name));
            if let Some(name) = changing.or(scene.scintillation.as_ref().map(|_| "scintillation")) {
                return Ok(Some(format!("powers of {signal} that [{name}] may part by {NEAR_FAR_DB} dB")));
            }
            for sample in (0..scene.samples).step_by((scene.samples / INSTANTS).max(1) as usize) {
                let (mut least, mut most) = (f64::MAX, f64::MIN);
                let local = scene.clock.epoch(sample);
                for sv in scene.senders().filter(|sv| scene.signals_of(*sv).any(|one| one == signal)) {
                    if !truth::in_view(scene, sv, local).map_err(GenerateError::from)? {
                        continue;
                    }
                    let seen = truth::observe(scene, &Constellation::authentic(), sv, signal, sample, 0.0);
                    if let Some((row, ..)) = seen.map_err(GenerateError::from)? {
                        (least, most) = (least.min(row.cn0_dbhz), most.max(row.cn0_dbhz));
                    }
                }
                // A decibel for what happens between the instants.
                if most - least > NEAR_FAR_DB - 1.0 {
                    return Ok(Some(format!("powers of {signal} that are {:.1} dB apart", most - least)));
                }
            }
        }
    }
    Ok(None)
}
