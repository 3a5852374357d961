//! Work of the synthesiser for a scene: knots, memory and speed.

use serde::Serialize;

use crate::arrival;
use crate::error::GenerateError;
use crate::scene::Scene;
use crate::stopwatch::Stopwatch;
use crate::stream::{Options, transmitters};
use crate::synth::{Edge, RUN_SAMPLES};
use crate::transmit::Transmitter;
use crate::truth::observe_by;

/// Roots of each satellite's grid that a plan looks at.
const PLANNED_ROOTS: u64 = 16;
/// Rows of each satellite's truth that a plan makes to time them.
const PLANNED_ROWS: u64 = 4;

/// Figures of the synthesiser that depend on the scene and the machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machinery {
    /// Shortest time between knots of the signal's delay, in seconds.
    pub knot_spacing_s: f64,
    /// Longest time between knots, in seconds.
    pub longest_knot_spacing_s: f64,
    /// Reason for the knot spacing.
    pub knot_reason: String,
    /// Memory of the generator's blocks in bytes, which does not grow with the scene.
    pub block_bytes: u64,
    /// Time in seconds on one core of this machine for all knots of the scene.
    #[serde(skip)]
    pub knots_s: f64,
    /// Time in seconds on one core of this machine for all rows of the truth.
    #[serde(skip)]
    pub truth_s: f64,
}

/// Computes the synthesiser's figures: knots along the scene, memory of a batch, and the time of knots and
/// truth.
///
/// # Errors
/// Errors of orbits.
pub fn machinery(scene: &Scene) -> Result<Machinery, GenerateError> {
    let transmitters = transmitters(scene, Edge::Nearest)?;
    let rate = scene.clock.rate;
    let (mut shortest, mut longest, mut worst_cycles, mut knots_s) = (u64::MAX, 0, 0.0_f64, 0.0);
    for transmitter in &transmitters {
        if !arrival::in_view_from(scene, &transmitter.from, transmitter.sv, scene.clock.start)? {
            continue;
        }
        let size = transmitter.root_samples();
        let roots = scene.samples.div_ceil(size);
        let (watch, each) = (Stopwatch::start(), roots.div_ceil(PLANNED_ROOTS).max(1));
        for root in (0..roots).step_by(each as usize) {
            for part in transmitter.root(scene, root)? {
                shortest = shortest.min(part.end - part.start);
                longest = longest.max(part.end - part.start);
                worst_cycles = worst_cycles.max(part.error_cycles);
            }
        }
        knots_s += watch.elapsed_s() * roots as f64 / roots.div_ceil(each).max(1) as f64;
    }
    let shortest = shortest.min(longest);
    let options = Options::default();
    let batch = u64::from(options.block_runs) * u64::from(options.batch_blocks) * RUN_SAMPLES as u64;
    Ok(Machinery {
        knot_spacing_s: rate.elapsed_s(shortest),
        longest_knot_spacing_s: rate.elapsed_s(longest),
        knot_reason: if longest == 0 {
            "no satellite is in view at the start".to_owned()
        } else {
            format!(
                "the longest on which a cubic stays within {:e} cycles of the motion; {worst_cycles:.1e} met",
                scene.fidelity.knot_tolerance_cycles
            )
        },
        block_bytes: batch.min(scene.samples) * scene.metadata.format.bytes() as u64,
        knots_s,
        truth_s: truth_s(scene, &transmitters)?,
    })
}

/// Time of all rows of the truth on one core, from a few rows of each signal.
fn truth_s(scene: &Scene, transmitters: &[Transmitter]) -> Result<f64, GenerateError> {
    let rows = (scene.clock.rate.elapsed_s(scene.samples) / scene.truth_interval_s).ceil();
    let each = scene.samples.div_ceil(PLANNED_ROWS).max(1);
    let row = |sample: u64| {
        transmitters.iter().try_for_each(|one| {
            if arrival::in_view_from(scene, &one.from, one.sv, scene.clock.epoch(sample))? {
                observe_by(scene, &one.from, (one.sv, one.signal), (sample, 0.0), one.geometry.as_deref())?;
            }
            Ok::<_, GenerateError>(())
        })
    };
    // The first rows of a scene fill its stores and the processor's; they are few among all.
    (0..scene.samples).step_by(each as usize).try_for_each(row)?;
    let (watch, mut made) = (Stopwatch::start(), 0);
    for sample in (0..scene.samples).step_by(each as usize) {
        row(sample)?;
        made += 1;
    }
    Ok(watch.elapsed_s() * rows / f64::from(made.max(1)))
}
