//! Spatial filter: the samples of an array's elements become one stream before correlation.
//!
//! Blocks of `block_ms` are filtered with weights from their own sample covariance (sample-matrix inversion,
//! Reed, Mallett and Brennan 1974; van Trees 2002, chapters 6 and 7). Satellites lie below the noise, so they
//! do not take part in it. Limits: one stream, so one beam for all satellites; weights without taps over
//! time, so waves must be narrow against the array (bandwidth times delay across it); the phase of the beam
//! may change from block to block by what the estimate of the weights scatters.

pub mod attitude;
pub mod compass;
#[cfg(test)]
mod compass_tests;
pub(crate) mod sums;
#[cfg(test)]
mod tests;
pub mod weights;

use std::fmt;

use nalgebra::{DVector, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

use crate::settings::array::{ArraySettings, SpatialFilter};
use crate::source::{Packed, Planes};
use gnss::samples::{Format, IfMetadata};
use weights::{steering, weights};

/// Elements of one array at most.
pub const MOST: usize = 16;

/// Reason for which samples of elements do not become one stream.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ArrayError {
    /// Too few or too many streams.
    #[error("array: {have} streams of samples: expected those of 2 to {MOST} elements")]
    Count {
        /// Streams that there are.
        have: usize,
    },
    /// Streams and lever arms that do not belong together.
    #[error("array.lever_arms_m: positions of {places} elements for {have} streams of samples: expected as many")]
    Places {
        /// Lever arms of the settings.
        places: usize,
        /// Streams that there are.
        have: usize,
    },
    /// Elements that do not sample alike.
    #[error("array: element {number} has other samples than element 1: expected one rate, centre and start")]
    Unlike {
        /// Number of the element, from 1.
        number: usize,
    },
    /// Samples without phase.
    #[error("array: element {number} has samples in {format}, which are real: expected complex ones")]
    Real {
        /// Number of the element, from 1.
        number: usize,
        /// Format of its samples.
        format: Format,
    },
    /// Blocks with fewer samples than their covariance needs.
    #[error("array.block_ms = {block_ms}: {samples} samples for {have} elements: expected two for each at least")]
    Short {
        /// Length of a block in ms.
        block_ms: f64,
        /// Samples in it.
        samples: u64,
        /// Elements.
        have: usize,
    },
    /// A covariance without an inverse.
    #[error(
        "array: the covariance of the {have} elements is singular in the block from sample {sample} on: expected \
         elements with noise of their own (two of them may have the same samples, or one none)"
    )]
    Singular {
        /// First sample of the block.
        sample: u64,
        /// Elements.
        have: usize,
    },
    /// Models instead of samples.
    #[error("array: modelled correlations have no samples to filter: expected samples")]
    Modelled,
}

/// Work of a spatial filter in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Formed {
    /// Weights of the elements.
    pub filter: SpatialFilter,
    /// Elements of the array.
    pub elements: usize,
    /// Blocks that were filtered.
    pub blocks: u64,
    /// Power of the first element over that of the stream, in dB; null without a block.
    pub rejected_db: Option<f64>,
}

impl fmt::Display for Formed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "spatial filter of {} elements over {} blocks", self.elements, self.blocks)?;
        self.rejected_db.map_or(Ok(()), |db| write!(f, ": {db:.1} dB less power than in the first element"))
    }
}

/// Filter of one array.
#[derive(Debug)]
pub struct Former {
    filter: SpatialFilter,
    metadata: IfMetadata,
    elements: usize,
    /// Samples in a block.
    block: u64,
    /// Elements' answer to the wave that keeps its gain.
    kept: DVector<Complex64>,
    /// Loading of the diagonal over the smallest pivot.
    loading: f64,
    /// Weights of the last whole block, for the rest of the samples.
    last: Option<DVector<Complex64>>,
    blocks: u64,
    /// Sums of the blocks' power at the first element and in the stream, in LSB².
    power: [f64; 2],
}

/// Samples of a block and how they came about.
struct Block {
    bytes: Vec<u8>,
    weights: DVector<Complex64>,
    power: [f64; 2],
}

impl Former {
    /// Creates the filter for streams with `metadata`, in the order of the elements.
    ///
    /// # Errors
    /// Streams that are not those of one array, blocks too short for it.
    pub fn new(metadata: &[IfMetadata], settings: &ArraySettings) -> Result<Self, ArrayError> {
        let have = metadata.len();
        let (Some(first), 2..=MOST) = (metadata.first(), have) else { return Err(ArrayError::Count { have }) };
        let places = settings.lever_arms_m.len();
        if places != have && (places > 0 || settings.filter == SpatialFilter::Mvdr) {
            return Err(ArrayError::Places { places, have });
        }
        for (number, own) in (1..).zip(metadata) {
            if !own.format.is_complex() {
                return Err(ArrayError::Real { number, format: own.format });
            }
            let like = IfMetadata { format: first.format, ..own.clone() };
            if like != *first {
                return Err(ArrayError::Unlike { number });
            }
        }
        let block = (settings.block_ms * 1e-3 * first.rate.hz()).round().max(1.0) as u64;
        if block < 2 * have as u64 {
            return Err(ArrayError::Short { block_ms: settings.block_ms, samples: block, have });
        }
        let kept = match settings.filter {
            SpatialFilter::None | SpatialFilter::PowerInversion => {
                DVector::from_fn(have, |k, _| if k == 0 { Complex64::ONE } else { Complex64::ZERO })
            }
            SpatialFilter::Mvdr => {
                let (azimuth, elevation) = (settings.azimuth_deg.to_radians(), settings.elevation_deg.to_radians());
                let ((sin_a, cos_a), (sin_e, cos_e)) = (libm::sincos(azimuth), libm::sincos(elevation));
                let towards = Vector3::new(cos_e * cos_a, cos_e * sin_a, -sin_e);
                let kept = steering(&settings.lever_arms_m, &towards, first.center_hz);
                if first.inverted { kept.map(|x| x.conj()) } else { kept }
            }
        };
        // One element passes as it came; several become numbers between whole ones.
        let format = if settings.filter == SpatialFilter::None { first.format } else { Format::Cf32Le };
        Ok(Self {
            filter: settings.filter,
            metadata: IfMetadata { format, ..first.clone() },
            elements: have,
            block,
            kept,
            loading: libm::pow(10.0, settings.loading_db / 10.0),
            last: None,
            blocks: 0,
            power: [0.0; 2],
        })
    }

    /// Metadata of the stream.
    pub fn metadata(&self) -> &IfMetadata {
        &self.metadata
    }

    /// Samples of a block, which begin at multiples of it.
    pub fn block_samples(&self) -> u64 {
        self.block
    }

    /// Fills `bytes` with the stream over `inputs`, the same samples of each element. Samples after the last
    /// whole block have its weights.
    ///
    /// # Errors
    /// [`ArrayError::Singular`].
    pub fn form(&mut self, inputs: &[Packed<'_>], bytes: &mut Vec<u8>) -> Result<(), ArrayError> {
        bytes.clear();
        let Some(first) = inputs.first() else { return Ok(()) };
        if self.filter == SpatialFilter::None {
            bytes.extend_from_slice(first.bytes());
            return Ok(());
        }
        let (block, samples) = (self.block as usize, first.samples());
        let whole: Result<Vec<Block>, ArrayError> =
            (0..samples / block).into_par_iter().map(|number| self.whole(inputs, number * block)).collect();
        for Block { bytes: own, weights, power } in whole? {
            bytes.extend_from_slice(&own);
            self.last = Some(weights);
            self.blocks += 1;
            self.power.iter_mut().zip(power).for_each(|(sum, own)| *sum += own);
        }
        let rest = samples % block;
        if rest > 0 {
            let planes = planes(inputs, samples - rest, rest);
            // Less than a block of all: the first element alone.
            let weights = self.last.as_ref().unwrap_or(&self.kept);
            bytes.extend_from_slice(&sums::formed(&planes, weights));
        }
        Ok(())
    }

    fn whole(&self, inputs: &[Packed<'_>], from: usize) -> Result<Block, ArrayError> {
        let planes = planes(inputs, from, self.block as usize);
        let covariance = sums::covariance(&planes);
        let sample = inputs.first().map_or(0, |first| first.first) + from as u64;
        if covariance.iter().all(|x| *x == Complex64::ZERO) {
            // Silence stays silence.
            let weights = self.kept.clone();
            return Ok(Block { bytes: sums::formed(&planes, &weights), weights, power: [0.0; 2] });
        }
        let singular = ArrayError::Singular { sample, have: self.elements };
        let weights = weights(&covariance, &self.kept, self.loading).ok_or(singular)?;
        let power = [covariance[(0, 0)].re, weights.dotc(&(&covariance * &weights)).re];
        Ok(Block { bytes: sums::formed(&planes, &weights), weights, power })
    }

    /// Work so far.
    pub fn formed(&self) -> Formed {
        let [first, stream] = self.power;
        let rejected_db = (stream > 0.0).then(|| 10.0 * libm::log10(first / stream));
        Formed { filter: self.filter, elements: self.elements, blocks: self.blocks, rejected_db }
    }
}

/// Planes of samples `from` to `from + samples` of each input.
fn planes(inputs: &[Packed<'_>], from: usize, samples: usize) -> Vec<Planes> {
    inputs.iter().map(|input| input.planes(from..from + samples)).collect()
}
