//! The kernels compiled for each instruction set, and the choice at run time.
//!
//! The only file of the generator with `unsafe`: each call enters a function compiled for
//! instructions that [`Level::is_available`] found on this processor.

use super::{Edge, Run, exact, lanes};
use crate::generator::stage::noise;
use crate::gnss::samples::Format;

/// An instruction set for which kernels are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// What every processor of the target has.
    Baseline,
    Avx2,
    Avx512,
}

impl Level {
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// The widest that this processor has.
    pub fn detect() -> Self {
        Self::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Self::Baseline)
    }

    /// Whether this processor can run it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }
}

/// [`lanes::accumulate`] on one instruction set; the baseline where the processor lacks it.
pub fn accumulate(level: Level, edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<f32>) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { accumulate_avx512(edge, run, i, q, wave) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { accumulate_avx2(edge, run, i, q, wave) },
        _ => lanes::accumulate(edge, run, i, q, wave),
    }
}

/// [`exact::accumulate`] on one instruction set; the baseline where the processor lacks it.
pub fn accumulate_exact(
    level: Level,
    edge: Edge<'_>,
    run: &Run<'_>,
    i: &mut [f32],
    q: &mut [f32],
    wave: &mut Vec<f64>,
) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { exact_avx512(edge, run, i, q, wave) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { exact_avx2(edge, run, i, q, wave) },
        _ => exact::accumulate(edge, run, i, q, wave),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn exact_avx512(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<f64>) {
    exact::accumulate(edge, run, i, q, wave);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn exact_avx2(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<f64>) {
    exact::accumulate(edge, run, i, q, wave);
}

/// [`noise::add_block`] on one instruction set; the baseline where the processor lacks it.
pub fn add_noise(level: Level, seed: u64, block: u64, sigma: f32, i: &mut [f32], q: &mut [f32]) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { noise_avx512(seed, block, sigma, i, q) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { noise_avx2(seed, block, sigma, i, q) },
        _ => noise::add_block(seed, block, sigma, i, q),
    }
}

/// Rounds and packs samples into `out`, and counts the components that `format` cannot hold.
pub fn pack(level: Level, format: Format, i: &[f32], q: &[f32], out: &mut [u8]) -> u64 {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { pack_avx512(format, i, q, out) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { pack_avx2(format, i, q, out) },
        _ => pack_lanes(format, i, q, out),
    }
}

#[inline(always)]
fn pack_lanes(format: Format, i: &[f32], q: &[f32], out: &mut [u8]) -> u64 {
    format.pack_into(i, q, out);
    format.full_scale_lsb().map_or(0, |full| {
        // `u32` vectorises twice as wide; a slice of samples in memory is far shorter than 2^32.
        let outside = |x: &[f32]| u64::from(x.iter().map(|x| u32::from(x.abs() > full + 0.5)).sum::<u32>());
        outside(i) + if format.is_complex() { outside(q) } else { 0 }
    })
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn pack_avx512(format: Format, i: &[f32], q: &[f32], out: &mut [u8]) -> u64 {
    pack_lanes(format, i, q, out)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn pack_avx2(format: Format, i: &[f32], q: &[f32], out: &mut [u8]) -> u64 {
    pack_lanes(format, i, q, out)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn accumulate_avx512(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<f32>) {
    lanes::accumulate(edge, run, i, q, wave);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn accumulate_avx2(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<f32>) {
    lanes::accumulate(edge, run, i, q, wave);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn noise_avx512(seed: u64, block: u64, sigma: f32, i: &mut [f32], q: &mut [f32]) {
    noise::add_block(seed, block, sigma, i, q);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn noise_avx2(seed: u64, block: u64, sigma: f32, i: &mut [f32], q: &mut [f32]) {
    noise::add_block(seed, block, sigma, i, q);
}
