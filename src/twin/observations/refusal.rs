//! Effects of a scene that modelled observations do not have.

use generator::fidelity::Grade;
use generator::scene::Scene;

use crate::refusal::{self, Refused, edge, several};

/// Refuses the first effect of a scene's front ends that has no model.
///
/// # Errors
/// [`Refused`] with the name of the effect.
pub fn refuse(scenes: &[Scene]) -> Result<(), Refused> {
    refusal::refuse(scenes, Grade::Observations, |scene| {
        let fading = scene.scintillation.as_ref().map(|_| "[scintillation]".to_owned());
        let edge = edge(scene.fidelity.code_edge);
        edge.or(fading).or_else(|| scene.signals.iter().find_map(|one| several(one)))
    })
}
