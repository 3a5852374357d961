//! Frames of three subframes: a time in a code of few words, then two blocks of bits that are coded at rate
//! one half and interleaved together.
//!
//! Source: IS-GPS-800J, 3.2.3 (CNAV-2 of L1C); NavIC SPS ICD for L1 1.0, which has the same frame with
//! matrices of its own and a time of nine bits in one code word. The sign of inverted frames: inverted words
//! of CNAV-2 are words of another time, and the checks of the blocks decide; those of NavIC are
//! none.

use std::ops::RangeInclusive;
use std::sync::LazyLock;

use super::interleaver::Interleaver;
use super::ldpc::Ldpc;
use super::register::RegisterCode;
use crate::bits::{number, upright};

/// Least agreement of the symbols of a time with the most likely one at which a frame is tried. Symbols with
/// an amplitude of √2 standard deviations, near which the codes begin to fail, agree by 0.89 ± 0.05. The best
/// of all times among data symbols agrees by about half.
const LEAST_SHARE: f32 = 0.65;

/// A form of frames.
pub struct Subframes {
    /// Code of the time.
    pub time: RegisterCode,
    /// True if the time has one more bit, the highest, which is sent before the code word and added to it.
    pub has_high_bit: bool,
    /// Range of the times that occur.
    pub times: RangeInclusive<u32>,
    /// Code of the first block, and its bits with their check.
    pub two: (&'static LazyLock<Ldpc>, usize),
    /// Code of the second block, and its bits with their check.
    pub three: (&'static LazyLock<Ldpc>, usize),
    /// Interleaver of both blocks.
    pub interleaver: Interleaver,
    /// Function that returns true if the check of a block is right.
    pub is_right: fn(&[bool]) -> bool,
}

/// Decoded frame in which the check of the first block is right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blocks {
    /// The time.
    pub time: u32,
    /// True if the symbols were inverted.
    pub inverted: bool,
    /// Bits of the first block with their check.
    pub two: Vec<bool>,
    /// Bits of the second block with their check; `None` if the check fails.
    pub three: Option<Vec<bool>>,
}

impl Blocks {
    /// Week that the first block states in its first thirteen bits.
    pub fn week(&self) -> i64 {
        number(self.two.get(..13).unwrap_or_default()) as i64
    }

    /// Interval of the week, hours or two of them, that the first block states after it.
    pub fn interval(&self) -> i64 {
        number(self.two.get(13..21).unwrap_or_default()) as i64
    }
}

impl Subframes {
    /// Symbols of the time.
    pub fn time_symbols(&self) -> usize {
        self.time.symbols + usize::from(self.has_high_bit)
    }

    /// Encodes a time to symbols.
    pub fn time_word(&self, time: u32) -> Vec<bool> {
        if !self.has_high_bit {
            return self.time.encode(time).collect();
        }
        let high = time >> self.time.stages & 1 == 1;
        let low = time & ((1 << self.time.stages) - 1);
        std::iter::once(high).chain(self.time.encode(low).map(|one| one ^ high)).collect()
    }

    /// Encodes a frame from a time and from bits with their checks, without interleaving.
    pub fn coded(&self, time: u32, two: &[bool], three: &[bool]) -> Vec<bool> {
        let blocks = self.two.0.encode(two).into_iter().chain(self.three.0.encode(three));
        self.time_word(time).into_iter().chain(blocks).collect()
    }

    /// Interleaves the symbols of a frame for transmission.
    pub fn interleaved(&self, coded: &[bool]) -> Vec<bool> {
        let (first, rest) = coded.split_at(self.time_symbols().min(coded.len()));
        first.iter().copied().chain(self.interleaver.interleave(rest)).collect()
    }

    /// Most likely times of soft symbols, each with true if they are inverted, and their agreement, 0 to 1.
    pub fn likely_times(&self, soft: &[f32]) -> (Vec<(u32, bool)>, f32) {
        let own = soft.get(..self.time_symbols()).unwrap_or(soft);
        let all: f32 = own.iter().map(|value| value.abs()).sum();
        let best = |sums: &mut dyn Iterator<Item = (u32, f32)>| {
            sums.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or((0, 0.0))
        };
        let (sum, found) = if self.has_high_bit {
            let (first, rest) = own.split_first().unwrap_or((&0.0, &[]));
            let words = 0..1 << self.time.stages;
            let (low, sum) = best(&mut words.map(|low| (low, first + self.time.correlation(low, rest))));
            let upright = low | u32::from(sum < 0.0) << self.time.stages;
            (sum, vec![(upright, false), (upright ^ 1 << self.time.stages, true)])
        } else {
            let (time, sum) = best(&mut self.times.clone().map(|time| (time, self.time.correlation(time, own))));
            (sum, vec![(time, sum < 0.0)])
        };
        let known = found.into_iter().filter(|(time, _)| self.times.contains(time)).collect();
        (known, sum.abs() / all.max(f32::MIN_POSITIVE))
    }

    /// True if a frame may begin with these soft symbols, normal or inverted.
    pub fn may_begin(&self, soft: &[f32]) -> bool {
        self.likely_times(soft).1 > LEAST_SHARE
    }

    /// The frame in soft symbols, positive for a logical 0, normal or inverted; `None` where its checks fail.
    pub fn decode(&self, soft: &[f32]) -> Option<Blocks> {
        let (first, rest) = soft.split_at_checked(self.time_symbols())?;
        let (times, _) = self.likely_times(first);
        let rest = self.interleaver.deinterleave(rest);
        times.into_iter().find_map(|(time, inverted)| {
            let own = upright(&rest, inverted);
            let (two, three) = own.split_at_checked(2 * self.two.1)?;
            let of = |code: &Ldpc, soft| code.decode(soft).filter(|bits| (self.is_right)(bits));
            let two = of(self.two.0, two)?;
            Some(Blocks { time, inverted, two, three: of(self.three.0, three) })
        })
    }
}
