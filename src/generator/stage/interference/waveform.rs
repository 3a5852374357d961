//! Waveforms of interference, as a scene states them.

use std::sync::Arc;

use super::arrival::Repetition;
use crate::synth::Edge;
use crate::synth::band::Filter;
use crate::synth::resample::Interpolator;
use crate::synth::tone::Modulation;

/// Model of the chip edges of a matched waveform between samples.
#[derive(Clone, Debug)]
pub enum ChipEdge {
    /// Edge at the nearest sample.
    Nearest,
    /// Share of the sample's area on either side of the edge.
    Area,
    /// Through a low-pass filter.
    BandLimited(Arc<Filter>),
}

impl ChipEdge {
    pub(super) fn edge(&self) -> Edge<'_> {
        match self {
            Self::Nearest => Edge::Nearest,
            Self::Area => Edge::Area,
            Self::BandLimited(filter) => Edge::BandLimited(filter),
        }
    }
}

/// Waveform of an interferer.
#[derive(Clone, Debug)]
pub enum Waveform {
    /// A continuous wave.
    Cw,
    /// Linear sweep over `sweep_hz` (downwards if negative), from the start again at once.
    Chirp {
        /// Width of the sweep, in Hz.
        sweep_hz: f64,
        /// Rate of the repetition.
        repetition: Repetition,
    },
    /// Linear up and down; a repetition is both.
    Fmcw {
        /// Width of the sweep, in Hz.
        sweep_hz: f64,
        /// Rate of the repetition.
        repetition: Repetition,
    },
    /// Frequency that follows a cosine.
    SineFm {
        /// Largest deviation from the carrier, in Hz.
        deviation_hz: f64,
        /// Rate of the repetition.
        repetition: Repetition,
    },
    /// A carrier that is on for `width_s`; each pulse comes late by up to `jitter` of a period, at random.
    Pulse {
        /// Length of a pulse, in seconds.
        width_s: f64,
        /// Rate of the repetition.
        repetition: Repetition,
        /// Largest delay of a pulse, as a share of the period.
        jitter: f64,
    },
    /// Random chips, so that the spectrum is that of a code.
    Matched {
        /// Rate of the chips.
        chips: Repetition,
        /// Model of the chip edges between samples.
        edge: ChipEdge,
    },
    /// Gaussian noise over the samples' whole band.
    White,
    /// Gaussian noise of a band; `step` source samples per sample, in 2^-32.
    Noise {
        /// Width of the band, in Hz.
        width_hz: f64,
        /// Source samples per sample, in 2^-32.
        step: u64,
        /// Interpolator from the source's samples to the scene's.
        by: Interpolator,
    },
    /// Gaussian noise of a band, drawn over the time of emission: every receiver hears the same.
    Emitted {
        /// Width of the part of the band that the samples hold, in Hz.
        width_hz: f64,
        /// Rate of the source's samples.
        rate: Repetition,
        /// Interpolator from the source's samples to the scene's.
        by: Interpolator,
    },
    /// Recorded samples of unit mean power.
    Recording {
        /// The samples of the file.
        samples: Arc<Recorded>,
        /// Rate of the source's samples.
        rate: Repetition,
        /// Interpolator from the source's samples to the scene's.
        by: Interpolator,
        /// True if the samples restart at their end.
        repeat: bool,
    },
}

impl Waveform {
    /// Modulation of a sweep in samples, where `sign` is −1 if their spectrum is mirrored; that of a carrier
    /// for any other waveform.
    pub fn modulation(&self, sign: f64) -> Modulation {
        match self {
            Self::Chirp { sweep_hz, repetition } => Modulation::Sawtooth { cycles: sign * sweep_hz / repetition.hz() },
            Self::Fmcw { sweep_hz, repetition } => {
                Modulation::Triangle { cycles: 0.5 * sign * sweep_hz / repetition.hz() }
            }
            Self::SineFm { deviation_hz, repetition } => {
                Modulation::Sine { cycles: sign * deviation_hz / (std::f64::consts::TAU * repetition.hz()) }
            }
            _ => Modulation::None,
        }
    }

    /// Rate of the repetition of a sweep; `None` for any other waveform.
    pub fn sweeps_at(&self) -> Option<Repetition> {
        match self {
            Self::Chirp { repetition, .. } | Self::Fmcw { repetition, .. } | Self::SineFm { repetition, .. } => {
                Some(*repetition)
            }
            _ => None,
        }
    }
}

/// Planar samples of a file, or of a period.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// I components.
    pub i: Vec<f32>,
    /// Quadrature components.
    pub q: Vec<f32>,
}

impl Recorded {
    /// Samples `first` to `last` (exclusive): again from the start where the file ends, or silence.
    pub(super) fn read(&self, (first, last): (i64, i64), repeat: bool, inverted: bool) -> (Vec<f32>, Vec<f32>) {
        let sign = if inverted { -1.0 } else { 1.0 };
        let of = |plane: &[f32], sign: f32| -> Vec<f32> {
            let count = (last - first).max(0) as usize;
            if repeat && !plane.is_empty() {
                let mut found = Vec::with_capacity(count);
                let mut at = first.rem_euclid(plane.len() as i64) as usize;
                while found.len() < count {
                    let end = plane.len().min(at + count - found.len());
                    found.extend(plane.get(at..end).unwrap_or_default().iter().map(|x| sign * x));
                    at = 0;
                }
                return found;
            }
            let sample = |k: i64| usize::try_from(k).ok().and_then(|k| plane.get(k)).copied().unwrap_or(0.0);
            (first..last).map(|k| sign * sample(k)).collect()
        };
        (of(&self.i, 1.0), of(&self.q, sign))
    }
}
