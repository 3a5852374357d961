//! The kernels compiled for each instruction set, and the choice at run time.
//!
//! The only file of the generator with `unsafe`: each call enters a function compiled for
//! instructions that [`Level::is_available`] found on this processor.

use super::lanes::{self, Buffers};
use super::{Edge, Run, exact};
use crate::synth::noise;
use crate::synth::resample::{self, Interpolator, Position};
use crate::synth::tone::{self, Tone};
use gnss::samples::Format;

/// Instruction set for which kernels are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Instructions that every processor of the target has.
    Baseline,
    /// 256-bit vectors.
    Avx2,
    /// 512-bit vectors.
    Avx512,
}

impl Level {
    /// All levels from the narrowest vectors to the widest.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// Widest level that this processor has.
    pub fn detect() -> Self {
        Self::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Self::Baseline)
    }

    /// True if this processor can run the level.
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
pub fn accumulate(
    level: Level,
    edge: Edge<'_>,
    rays: &[&[Run<'_>]],
    i: &mut [f32],
    q: &mut [f32],
    buffers: &mut Buffers,
) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { accumulate_avx512(edge, rays, i, q, buffers) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { accumulate_avx2(edge, rays, i, q, buffers) },
        _ => lanes::accumulate(edge, rays, i, q, buffers),
    }
}

/// [`exact::accumulate`] on one instruction set; the baseline where the processor lacks it.
pub fn accumulate_exact(
    level: Level,
    edge: Edge<'_>,
    rays: &[&[Run<'_>]],
    i: &mut [f32],
    q: &mut [f32],
    scratch: &mut exact::Scratch,
) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { exact_avx512(edge, rays, i, q, scratch) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { exact_avx2(edge, rays, i, q, scratch) },
        _ => exact::accumulate(edge, rays, i, q, scratch),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn exact_avx512(edge: Edge<'_>, rays: &[&[Run<'_>]], i: &mut [f32], q: &mut [f32], scratch: &mut exact::Scratch) {
    exact::accumulate(edge, rays, i, q, scratch);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn exact_avx2(edge: Edge<'_>, rays: &[&[Run<'_>]], i: &mut [f32], q: &mut [f32], scratch: &mut exact::Scratch) {
    exact::accumulate(edge, rays, i, q, scratch);
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

/// [`tone::add`] on one instruction set; the baseline where the processor lacks it.
pub fn add_tone(level: Level, tone: &Tone, i: &mut [f32], q: &mut [f32]) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { tone_avx512(tone, i, q) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { tone_avx2(tone, i, q) },
        _ => tone::add(tone, i, q),
    }
}

/// Planar samples to read, and to write.
type Planes<'a> = (&'a [f32], &'a [f32]);
type PlanesMut<'a> = (&'a mut [f32], &'a mut [f32]);

/// [`Interpolator::apply`] on one instruction set; the baseline where the processor lacks it.
pub fn interpolate(level: Level, by: &Interpolator, position: Position, source: Planes<'_>, out: PlanesMut<'_>) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { interpolate_avx512(by, position, source, out) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { interpolate_avx2(by, position, source, out) },
        _ => by.apply(position, source, out),
    }
}

/// [`resample::turn`] on one instruction set; the baseline where the processor lacks it.
pub fn turn(level: Level, wave: Planes<'_>, carrier: (u64, u64), amplitude: f32, (i, q): PlanesMut<'_>) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx512 if level.is_available() => unsafe { turn_avx512(wave, carrier, amplitude, i, q) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has these instructions.
        Level::Avx2 if level.is_available() => unsafe { turn_avx2(wave, carrier, amplitude, i, q) },
        _ => resample::turn(wave, carrier, amplitude, i, q),
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

/// Samples packed at a time, so that what is counted is still in the first-level cache.
const PACKED: usize = 512;

#[inline(always)]
fn pack_lanes(format: Format, i: &[f32], q: &[f32], out: &mut [u8]) -> u64 {
    let mut clipped = 0;
    for ((i, q), out) in i.chunks(PACKED).zip(q.chunks(PACKED)).zip(out.chunks_mut(PACKED * format.bytes())) {
        format.pack_into(i, q, out);
        clipped += format.full_scale_lsb().map_or(0, |full| {
            // `u32` vectorises twice as wide as `u64`.
            let outside = |x: &[f32]| x.iter().map(|x| u32::from(x.abs() > full + 0.5)).sum::<u32>();
            u64::from(outside(i) + if format.is_complex() { outside(q) } else { 0 })
        });
    }
    clipped
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
fn accumulate_avx512(edge: Edge<'_>, rays: &[&[Run<'_>]], i: &mut [f32], q: &mut [f32], buffers: &mut Buffers) {
    lanes::accumulate(edge, rays, i, q, buffers);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn accumulate_avx2(edge: Edge<'_>, rays: &[&[Run<'_>]], i: &mut [f32], q: &mut [f32], buffers: &mut Buffers) {
    lanes::accumulate(edge, rays, i, q, buffers);
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

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn tone_avx512(tone: &Tone, i: &mut [f32], q: &mut [f32]) {
    tone::add(tone, i, q);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn interpolate_avx512(by: &Interpolator, position: Position, source: Planes<'_>, out: PlanesMut<'_>) {
    by.apply(position, source, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn turn_avx512(wave: Planes<'_>, carrier: (u64, u64), amplitude: f32, i: &mut [f32], q: &mut [f32]) {
    resample::turn(wave, carrier, amplitude, i, q);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn tone_avx2(tone: &Tone, i: &mut [f32], q: &mut [f32]) {
    tone::add(tone, i, q);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn interpolate_avx2(by: &Interpolator, position: Position, source: Planes<'_>, out: PlanesMut<'_>) {
    by.apply(position, source, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn turn_avx2(wave: Planes<'_>, carrier: (u64, u64), amplitude: f32, i: &mut [f32], q: &mut [f32]) {
    resample::turn(wave, carrier, amplitude, i, q);
}

#[cfg(test)]
mod tests;
