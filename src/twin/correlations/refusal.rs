//! Effects of a scene that modelled correlations do not have.

use generator::fidelity::Grade;
use generator::scene::Scene;
use gnss::signal::Signal;

use super::promise::knobs;
use crate::refusal::{self, Refused};

/// Refuses the first effect of a scene's front ends that has no model.
///
/// # Errors
/// [`Refused`] with the name of the effect.
pub fn refuse(scenes: &[Scene]) -> Result<(), Refused> {
    let own = |scene: &Scene| {
        refusal::edge(knobs(scene).code_edge).or_else(|| scene.signals.iter().find_map(|one| signal(one)))
    };
    refusal::refuse(scenes, Grade::Correlations, own)
}

/// Signal whose correlations the model does not have, with the reason.
pub(super) fn signal(signal: &'static Signal) -> Option<String> {
    (signal.sides_hz() > 0.0).then(|| format!("{signal} (signals), both sidebands of which are followed"))
}
