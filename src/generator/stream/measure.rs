//! Segments of samples that are made to be measured.

use std::ops::Range;

use super::block::{Worker, edge, first_run, pack, run_begin, satellites};
use super::front::{lengths, transmitters};
use super::{GenerateError, Options};
use crate::scene::{CodeEdge, Scene};
use crate::stage::Block;
use crate::stopwatch::Stopwatch;
use crate::synth::band::Filter;
use crate::synth::isa::Level;
use crate::synth::waveform::Waveform;
use crate::synth::{Edge, Kernel};
use gnss::signal::{Component, Signal};

/// Statistics of a segment of the scene's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stretch {
    /// Number of components: two per sample, or one of real samples.
    pub components: u64,
    /// Sum of the squared components before a converter or the format rounds them, in LSB² of the scene's
    /// gain.
    pub square_lsb2: f64,
    /// Number of components that were clipped.
    pub clipped: u64,
    /// Processor time in seconds for a sample that is sent, with its share of the samples that stages look
    /// back at, which a stream makes twice.
    pub sample_s: f64,
}

/// Share of each signal's power at the antenna that a scene's chip edges keep in the samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Kept(Vec<(&'static Signal, f64)>);

impl Kept {
    /// Shares of a scene's signals, each by its first satellite; the codes of C/A differ by 0.05 dB.
    pub fn of(scene: &Scene) -> Self {
        let filter = limiting(scene);
        let (edge, rate_hz) = (edge(scene, filter.as_ref()), scene.clock.rate.hz());
        let all = scene.signals.iter().map(|&signal| (signal, kept(signal, edge, rate_hz).unwrap_or(1.0)));
        Self(all.collect())
    }

    /// Share that is kept of a signal, 0 to 1.
    pub fn share(&self, signal: &Signal) -> f64 {
        self.0.iter().find(|(own, _)| own.name == signal.name).map_or(1.0, |(_, share)| *share)
    }

    /// Names of the signals with what edges take of them, in dB.
    pub fn losses_db(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.0.iter().map(|(signal, share)| (signal.name, -10.0 * libm::log10(*share)))
    }
}

/// Each component keeps its own share; `None` where no satellite has a code.
fn kept(signal: &'static Signal, edge: Edge<'_>, rate_hz: f64) -> Option<f64> {
    let sv = signal.satellites().next()?;
    let component = |(index, component): (usize, &Component)| {
        let waveform = Waveform::new(signal.link(sv), index).ok()??;
        Some(component.power_share * waveform.kept(edge, rate_hz))
    };
    signal.components.iter().enumerate().map(component).sum()
}

/// The filter of a scene's band-limited edges.
fn limiting(scene: &Scene) -> Option<Filter> {
    (scene.fidelity.code_edge == CodeEdge::BandLimited).then(|| Filter::new(scene.cutoff_cps()))
}

/// Makes the samples of `stretches`, which ascend, as the stream does, and measures them.
///
/// # Errors
/// Errors of [`super::Stream::next`].
pub(crate) fn measured(scene: &Scene, stretches: &[Range<u64>]) -> Result<Vec<Stretch>, GenerateError> {
    scene.has_samples()?;
    let filter = limiting(scene);
    let edge = edge(scene, filter.as_ref());
    let mut transmitters = transmitters(scene, edge)?;
    let kernel = Kernel { edge, arithmetic: scene.fidelity.carrier, level: Level::detect() };
    let (memory, format) = (scene.memory_samples(), scene.metadata.format);
    let (lead, block_samples) = lengths(scene, &Options::default());
    let made_share = 1.0 + lead as f64 / block_samples as f64;
    let (mut worker, mut bytes) = (Worker::default(), Vec::new());
    let mut found = Vec::new();
    for stretch in stretches {
        let needed = run_begin(stretch.start).saturating_sub(lead);
        let made = stretch.end.max(first_run(scene, needed, lead));
        // On this thread alone: a plan has to work where no other can be started.
        transmitters.iter_mut().try_for_each(|t| t.prepare_alone(scene, needed, made))?;
        let samples = (stretch.end - stretch.start) as usize;
        let watch = Stopwatch::start();
        let mut block = satellites(scene, &transmitters, kernel, (stretch.start, samples, memory), &mut worker);
        let sent = block.lead..block.lead + samples;
        let square = |block: &Block<'_>| {
            let of = |plane: &[f32]| {
                plane.get(sent.clone()).unwrap_or(&[]).iter().fold(0.0, |sum, x| sum + f64::from(*x) * f64::from(*x))
            };
            of(block.i) + if format.is_complex() { of(block.q) } else { 0.0 }
        };
        let mut before_lsb2 = None;
        scene.stages(|stage| {
            if stage.full_scale_lsb(1.0).is_some() {
                before_lsb2 = Some(square(&block));
            }
            stage.act(&mut block);
        });
        bytes.resize(samples * format.bytes(), 0);
        let square_lsb2 = before_lsb2.unwrap_or_else(|| square(&block));
        let clipped = block.clipped + pack(&block, samples, format, &mut bytes);
        found.push(Stretch {
            components: if format.is_complex() { 2 } else { 1 } * samples as u64,
            square_lsb2,
            clipped,
            sample_s: made_share * watch.elapsed_s() / block.i.len().max(1) as f64,
        });
    }
    Ok(found)
}
