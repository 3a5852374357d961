//! Effects of a scene that the models in place of samples do not have.

use generator::fidelity::{CodeEdge, Grade};
use generator::scene::Scene;
use gnss::samples::Format;
use gnss::signal::Signal;
use receiver::lead::lead;
use thiserror::Error;

/// Least noise in LSB: from there on rounding adds noise of 1/12 LSB² to within exp(−2π²), 3e-9.
const LEAST_LSB: f32 = 1.0;
/// Noise that clips less than 5e-4 of its values, in deviations.
const CLIPPED_SIGMAS: f32 = 3.5;

/// Effect for which a level without samples has no model.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "[fidelity] level = \"{level}\" has no model of {effect}: leave it out, or take the level \"balanced\" \
     ([fidelity] level, run --level), which makes samples"
)]
pub struct Refused {
    /// Name of the level.
    pub level: &'static str,
    /// Name of the effect, with the key of a scenario that has it.
    pub effect: String,
}

/// Refuses the first effect of a scene's front ends that has no model at a level: those that no level without
/// samples has, and then what `own` names.
pub(crate) fn refuse(scenes: &[Scene], grade: Grade, own: fn(&Scene) -> Option<String>) -> Result<(), Refused> {
    let levels = || scenes.iter().map(|scene| scene.fidelity.grade);
    let mixed = levels().zip(levels().skip(1)).any(|(one, next)| one != next);
    let mixed = mixed.then(|| "front ends with different [fidelity] levels".to_owned());
    let each = scenes.iter().filter_map(|scene| refused(scene).or_else(|| own(scene)));
    let level = grade.name();
    mixed.into_iter().chain(each).try_for_each(|effect| Err(Refused { level, effect }))
}

/// The first effect of a front end that only samples have, by its name.
fn refused(scene: &Scene) -> Option<String> {
    let format = scene.metadata.format;
    let stage = scene.front_end.first().map(|stage| format!("[{}]", stage.name()));
    let real = || format!("real samples (front_end.format = \"{}\")", format.name());
    let array = scene.element.as_ref().map(|_| "[array]".to_owned());
    let jammer = scene.interference.first().map(|_| "[[interference]]".to_owned());
    None.or_else(|| scene.playback.as_ref().map(|_| "[playback]".to_owned()))
        .or(array)
        .or(jammer)
        .or_else(|| scene.spoofers.first().map(|_| "[[spoofer]]".to_owned()))
        .or_else(|| scene.switches.as_ref().map(|_| "motion that is pushed while the scene runs".to_owned()))
        .or(stage)
        .or_else(|| (!format.is_complex()).then(real))
        .or_else(|| quantisation(scene))
        .or_else(|| scene.metadata.inverted.then(|| "front_end.spectrum_inverted".to_owned()))
}

/// Signal of which more than the component that is searched for is followed, with the reason.
pub(crate) fn several(signal: &'static Signal) -> Option<String> {
    if signal.sides_hz() > 0.0 {
        return Some(format!("{signal} (signals), both sidebands of which are followed"));
    }
    let longest = signal.components.iter().map(|one| one.code_chips).max();
    (lead(signal).map(|lead| lead.code_chips) != longest)
        .then(|| format!("{signal} (signals), the pilot of which has a code longer than is searched for"))
}

/// Whole numbers whose rounding is no noise of its own, or that clip.
fn quantisation(scene: &Scene) -> Option<String> {
    let largest = match scene.metadata.format {
        Format::Cf32Le => return None,
        Format::Ci16Le | Format::Ri16Le => 32_767.0,
        Format::Ci8 | Format::Cu8 | Format::Ri8 => 127.0,
    };
    if !scene.noise {
        let name = scene.metadata.format.name();
        return Some(format!("whole numbers (front_end.format = \"{name}\") without [noise]"));
    }
    let fits = scene.noise_lsb >= LEAST_LSB && scene.noise_lsb * CLIPPED_SIGMAS <= largest;
    let name = scene.metadata.format.name();
    (!fits).then(|| format!("front_end.noise_lsb = {} with front_end.format = \"{name}\"", scene.noise_lsb))
}

/// Model of chip edges that only samples have.
pub(crate) fn edge(edge: CodeEdge) -> Option<String> {
    match edge {
        CodeEdge::Nearest | CodeEdge::Area => None,
        CodeEdge::BandLimited => Some("fidelity.code_edge = \"band_limited\"".to_owned()),
    }
}
