//! Samples of 8 bits as fixed-point numbers of 16: what the fast correlators take, made of the packed bytes
//! at once.

use super::kernel::{self, Level};
use super::rows;

/// Bits behind the point.
pub const POINT_BITS: u32 = 4;

/// Consecutive samples in 2⁻⁴ of their last bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed<'a> {
    pub(super) i: &'a [i16],
    pub(super) q: &'a [i16],
}

impl<'a> Fixed<'a> {
    /// Number of the samples.
    pub(super) fn count(&self) -> usize {
        self.i.len()
    }

    /// The samples from `from` to `to`.
    pub(super) fn part(&self, from: usize, to: usize) -> Option<Self> {
        Some(Self { i: self.i.get(from..to)?, q: self.q.get(from..to)? })
    }

    /// Samples in floating point, as in-phase and quadrature planes.
    pub(super) fn planes(&self) -> [Vec<f32>; 2] {
        let scale = 1.0 / (1_u32 << POINT_BITS) as f32;
        [self.i, self.q].map(|plane| plane.iter().map(|&x| f32::from(x) * scale).collect())
    }

    /// Σ |x|², exact.
    pub(super) fn power(&self) -> f64 {
        let unit = f64::from(1_u32 << POINT_BITS);
        kernel::fixed_power(Level::best(), self.i, self.q) / (unit * unit)
    }
}

/// Room for such samples, which only grows.
#[derive(Clone, Debug, Default)]
pub struct FixedSamples {
    i: Vec<i16>,
    q: Vec<i16>,
    count: usize,
}

impl FixedSamples {
    /// Samples of 8 bits: within ±127.5, in steps of a half or more.
    pub fn of(&mut self, i: &[f32], q: &[f32]) -> Fixed<'_> {
        let samples = i.len().min(q.len());
        self.count = 0;
        let planes = self.more(samples);
        for (fixed, plane) in planes.into_iter().zip([i, q]) {
            rows::kernel::fixed(Level::best(), &plane[..samples], fixed);
        }
        self.samples()
    }

    /// Leaves all samples out.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Room for so many more, which are to be filled in.
    pub fn more(&mut self, samples: usize) -> [&mut [i16]; 2] {
        let before = self.count;
        self.count += samples;
        [&mut self.i, &mut self.q].map(|plane| {
            if plane.len() < before + samples {
                plane.resize(before + samples, 0);
            }
            &mut plane[before..before + samples]
        })
    }

    /// The samples.
    pub fn samples(&self) -> Fixed<'_> {
        Fixed { i: &self.i[..self.count], q: &self.q[..self.count] }
    }
}
