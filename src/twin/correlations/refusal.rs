//! Effects of a scene that modelled correlations do not have.

use generator::fidelity::Grade;
use generator::scene::Scene;
use gnss::signal::{Layer, Signal};

use crate::refusal::{self, Refused, several};

/// Refuses the first effect of a scene's front ends that has no model.
///
/// # Errors
/// [`Refused`] with the name of the effect.
pub fn refuse(scenes: &[Scene]) -> Result<(), Refused> {
    refusal::refuse(scenes, Grade::Correlations, |scene| scene.signals.iter().find_map(|one| signal(one)))
}

/// Signal whose correlations the model does not have, with the reason.
pub(super) fn signal(signal: &'static Signal) -> Option<String> {
    let differ = |a: &Layer, b: &Layer| ((a.phase_cycles - b.phase_cycles) % 0.5).abs() > 0.0;
    let is_mixed = |layers: &[Layer]| {
        layers.iter().any(|layer| !layer.chips.is_empty()) || layers.windows(2).any(|pair| differ(&pair[0], &pair[1]))
    };
    // Sums of samples differ by 3 and 5 cm.
    let mixed = || signal.components.iter().any(|one| is_mixed(one.layers));
    several(signal)
        .or_else(|| mixed().then(|| format!("{signal} (signals), whose pulses take turns or are in quadrature")))
}
