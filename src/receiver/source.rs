//! Samples as the receiver meets them: packed bytes, however they arrive, become blocks of a fixed number of
//! samples.
//!
//! A [`Source`] keeps at most one unfinished block, so that memory stays flat however long the recording is.
//! A sample cut off at the end of the stream is left out and its bytes are counted. Of several front ends
//! each has a [`Queue`]: blocks end where those of the first do, and it keeps what another has not caught up
//! with.

mod kernel;

use std::ops::Range;

use kernel::{fixed, unpack};

use crate::correlate::correlator::Span;
use crate::correlate::fixed::{Fixed, FixedSamples};
use gnss::samples::Format;

/// Consecutive samples; `q` is all zeros for a real recording.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    /// Number of the first sample since the start of the recording.
    pub first: u64,
    /// In-phase samples.
    pub i: &'a [f32],
    /// Quadrature samples.
    pub q: &'a [f32],
}

/// Planar samples of some piece, kept to be filled again.
#[derive(Clone, Debug, Default)]
pub struct Planes {
    /// In-phase samples.
    pub i: Vec<f32>,
    /// Quadrature samples.
    pub q: Vec<f32>,
    /// Room for samples of two blocks.
    packed: Vec<u8>,
}

/// Consecutive samples as they were packed.
#[derive(Clone, Copy, Debug)]
pub struct Packed<'a> {
    /// Number of the first sample since the start of the recording.
    pub first: u64,
    format: Format,
    bytes: &'a [u8],
}

impl<'a> Packed<'a> {
    /// Creates the samples in `bytes`, packed as `format`, of which the first has number `first`.
    pub(crate) fn new(first: u64, format: Format, bytes: &'a [u8]) -> Self {
        Self { first, format, bytes }
    }

    /// Samples as they are packed.
    pub(crate) fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.bytes.len() / self.format.bytes()
    }

    /// Number of the sample after the last one.
    pub fn end(&self) -> u64 {
        self.first + self.samples() as u64
    }

    /// Planes of the samples of `range`, counted from the first one.
    pub fn planes(&self, range: Range<usize>) -> Planes {
        let mut planes = Planes::default();
        self.unpack(range, &mut planes);
        planes
    }

    /// The samples of `range`, counted from the first one and cut to those that are there, unpacked into
    /// `planes`.
    pub fn unpack<'b>(&self, range: Range<usize>, planes: &'b mut Planes) -> Block<'b> {
        let size = self.format.bytes();
        let end = range.end.min(self.samples());
        let start = range.start.min(end);
        let bytes = self.bytes.get(start * size..end * size).unwrap_or_default();
        unpack(self.format, bytes, &mut planes.i, &mut planes.q);
        Block { first: self.first + start as u64, i: &planes.i, q: &planes.q }
    }
}

/// Samples that something looks at more than once: in planes, or as they were packed; or a model in their
/// stead.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stretch<'a> {
    Planes(Block<'a>),
    Packed(Packed<'a>),
    Modelled(Span<'a>),
}

impl Stretch<'_> {
    /// Number of the first sample.
    pub fn first(&self) -> u64 {
        match self {
            Self::Planes(block) => block.first,
            Self::Packed(packed) => packed.first,
            Self::Modelled(span) => span.first,
        }
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        match self {
            Self::Planes(block) => block.i.len(),
            Self::Packed(packed) => packed.samples(),
            Self::Modelled(span) => span.end.saturating_sub(span.first) as usize,
        }
    }

    /// Number of the sample after the last one.
    pub fn end(&self) -> u64 {
        self.first() + self.samples() as u64
    }

    /// The samples as they were packed, if they were.
    pub fn packed(&self) -> Option<&Packed<'_>> {
        if let Self::Packed(packed) = self { Some(packed) } else { None }
    }

    /// Planes of the first `samples` of them, or of as many as there are.
    pub fn planes(&self, samples: usize) -> [Vec<f32>; 2] {
        match self {
            Self::Planes(block) => [block.i, block.q].map(|plane| plane.iter().take(samples).copied().collect()),
            Self::Packed(packed) => {
                let Planes { i, q, .. } = packed.planes(0..samples);
                [i, q]
            }
            Self::Modelled(_) => [Vec::new(), Vec::new()],
        }
    }
}

/// Samples that come piece by piece, kept as they are packed.
#[derive(Clone, Debug)]
pub(crate) struct Gathered {
    first: u64,
    format: Format,
    bytes: Vec<u8>,
}

impl Gathered {
    /// A collection that begins with a block, still empty.
    pub fn from(block: &Stretch) -> Self {
        let format = block.packed().map_or(Format::Cf32Le, |block| block.format);
        Self { first: block.first(), format, bytes: Vec::new() }
    }

    /// Takes samples of the next block until there are `samples` of them; says whether there are. A model
    /// has those of before too.
    pub fn take(&mut self, block: &Stretch, samples: usize) -> bool {
        let Some(block) = block.packed() else { return block.end() >= self.first + samples as u64 };
        let size = self.format.bytes();
        let missing = (samples * size).saturating_sub(self.bytes.len()).min(block.bytes.len());
        // Most searches want a few blocks.
        self.bytes.reserve_exact(missing);
        self.bytes.extend_from_slice(&block.bytes[..missing]);
        self.bytes.len() >= samples * size
    }

    /// The first `samples` of those that were gathered, the last of them in `block`.
    pub fn stretch<'a>(&'a self, block: &Stretch<'a>, samples: u64) -> Stretch<'a> {
        match block {
            Stretch::Modelled(span) => {
                Stretch::Modelled(Span { first: self.first, end: self.first + samples, ..*span })
            }
            Stretch::Planes(_) | Stretch::Packed(_) => Stretch::Packed(self.packed()),
        }
    }

    /// Number of the first sample.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Samples gathered so far.
    pub fn packed(&self) -> Packed<'_> {
        Packed { first: self.first, format: self.format, bytes: &self.bytes }
    }
}

/// The last samples of a stream, packed, so that a block can be shown with those before it.
#[derive(Debug, Default)]
pub struct Lookback {
    first: u64,
    bytes: Vec<u8>,
}

impl Lookback {
    /// The first sample that can be shown with `block`.
    pub fn first(&self, block: &Packed) -> u64 {
        if self.is_before(block) { self.first } else { block.first }
    }

    /// The samples from number `from`, one that is kept or of the block, up to `to`, one of the block,
    /// unpacked into `planes`.
    pub fn unpack<'a>(&self, block: &Packed, (from, to): (u64, u64), planes: &'a mut Planes) -> Block<'a> {
        let end = to.saturating_sub(block.first) as usize;
        let kept = self.kept(block, from);
        if kept.is_empty() {
            return block.unpack(from.saturating_sub(block.first) as usize..end, planes);
        }
        let mut packed = std::mem::take(&mut planes.packed);
        packed.clear();
        packed.extend_from_slice(kept);
        packed.extend_from_slice(block.bytes.get(..end * block.format.bytes()).unwrap_or(block.bytes));
        unpack(block.format, &packed, &mut planes.i, &mut planes.q);
        planes.packed = packed;
        Block { first: from, i: &planes.i, q: &planes.q }
    }

    /// Samples from `from` up to `to` as fixed-point numbers, for formats of 8 bits. Other formats give none.
    pub fn fixed<'a>(&self, block: &Packed, (from, to): (u64, u64), room: &'a mut FixedSamples) -> Fixed<'a> {
        let size = block.format.bytes();
        let kept = self.kept(block, from);
        let start = from.saturating_sub(block.first) as usize * size;
        let end = to.saturating_sub(block.first) as usize * size;
        let bytes = block.bytes.get(start..end.min(block.bytes.len())).unwrap_or_default();
        room.clear();
        for bytes in [kept, bytes] {
            let [i, q] = room.more(bytes.len() / size);
            fixed(block.format, bytes, i, q);
        }
        room.samples()
    }

    /// Keeps the samples from number `from` on, up to the block's end.
    pub fn keep(&mut self, block: &Packed, from: u64) {
        let from = from.clamp(self.first(block), block.end());
        let before = self.bytes.len() - self.kept(block, from).len();
        self.bytes.drain(..before);
        let start = from.saturating_sub(block.first) as usize * block.format.bytes();
        self.bytes.extend_from_slice(block.bytes.get(start..).unwrap_or_default());
        self.first = from;
    }

    fn is_before(&self, block: &Packed) -> bool {
        self.first + (self.bytes.len() / block.format.bytes()) as u64 == block.first
    }

    /// Bytes of the kept samples from number `from` on, if the block comes next.
    fn kept(&self, block: &Packed, from: u64) -> &[u8] {
        let start = from.saturating_sub(self.first) as usize * block.format.bytes();
        if self.is_before(block) { self.bytes.get(start..).unwrap_or_default() } else { &[] }
    }
}

/// Cuts packed samples of one format into blocks.
#[derive(Debug)]
pub struct Source {
    format: Format,
    block_bytes: usize,
    /// The beginning of a block, or a whole one that has been given out.
    kept: Vec<u8>,
    samples: u64,
}

impl Source {
    /// Blocks of `block_samples`, at least one, of samples in `format`.
    pub fn new(format: Format, block_samples: usize) -> Self {
        Self { format, block_bytes: block_samples.max(1) * format.bytes(), kept: Vec::new(), samples: 0 }
    }

    /// The next whole block of what was kept and of `bytes`, which moves on; `None` when they hold no more.
    pub fn next<'a, 'b: 'a>(&'a mut self, bytes: &mut &'b [u8]) -> Option<Packed<'a>> {
        if self.kept.len() == self.block_bytes {
            self.kept.clear();
        }
        let Some((head, rest)) = bytes.split_at_checked(self.block_bytes - self.kept.len()) else {
            self.kept.extend_from_slice(bytes);
            *bytes = &[];
            return None;
        };
        *bytes = rest;
        let first = self.samples;
        self.samples += (self.block_bytes / self.format.bytes()) as u64;
        if self.kept.is_empty() {
            return Some(Packed { first, format: self.format, bytes: head });
        }
        self.kept.extend_from_slice(head);
        Some(Packed { first, format: self.format, bytes: &self.kept })
    }

    /// Remainder at the end of the stream: the whole samples of a block that was not filled, if there are
    /// any, and the bytes of an incomplete sample. Such bytes usually mean a wrong format.
    pub fn rest(&mut self) -> (Option<Packed<'_>>, usize) {
        if self.kept.len() == self.block_bytes {
            self.kept.clear();
        }
        let (whole, cut_bytes) = (self.kept.len() / self.format.bytes(), self.kept.len() % self.format.bytes());
        let first = self.samples;
        self.samples += whole as u64;
        let bytes = self.kept.get(..whole * self.format.bytes()).unwrap_or_default();
        ((whole > 0).then_some(Packed { first, format: self.format, bytes }), cut_bytes)
    }

    /// Bytes of a block.
    pub fn block_bytes(&self) -> usize {
        self.block_bytes
    }

    /// Samples of a block.
    pub fn block_samples(&self) -> u64 {
        (self.block_bytes / self.format.bytes()).max(1) as u64
    }

    /// Samples given out so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }
}

/// Packed samples of one front end among several, of which blocks are taken that end at given samples.
#[derive(Debug)]
pub struct Queue {
    format: Format,
    bytes: Vec<u8>,
    /// Bytes at the front that were taken.
    taken: usize,
    samples: u64,
}

impl Queue {
    /// Samples in `format`, none so far.
    pub fn new(format: Format) -> Self {
        Self { format, bytes: Vec::new(), taken: 0, samples: 0 }
    }

    /// Keeps the next bytes, cut anywhere.
    pub fn push(&mut self, bytes: &[u8]) {
        // Moved are at most as many bytes as were taken since the last time.
        if self.taken > self.bytes.len() / 2 {
            self.bytes.drain(..self.taken);
            self.taken = 0;
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// Number of the sample after the last whole one that is kept.
    pub fn end(&self) -> u64 {
        self.samples + ((self.bytes.len() - self.taken) / self.format.bytes()) as u64
    }

    /// Number of the first sample that was not taken.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The samples before `end` that were not taken, as far as they are there.
    pub fn block(&self, end: u64) -> Packed<'_> {
        let count = end.min(self.end()).saturating_sub(self.samples) as usize;
        let bytes = self.bytes.get(self.taken..self.taken + count * self.format.bytes()).unwrap_or_default();
        Packed { first: self.samples, format: self.format, bytes }
    }

    /// Takes the samples before `end`.
    pub fn take(&mut self, end: u64) {
        let count = end.min(self.end()).saturating_sub(self.samples);
        self.samples += count;
        self.taken += count as usize * self.format.bytes();
    }

    /// Bytes of a sample that the end of the stream cut off.
    pub fn cut_bytes(&self) -> usize {
        (self.bytes.len() - self.taken) % self.format.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_that_were_gathered_piece_by_piece_are_those_of_the_planes() {
        for (format, _) in Format::NAMES {
            let size = format.bytes();
            let bytes: Vec<u8> = (0..100 * size as u32).map(|n| (n * 37 % 251) as u8).collect();
            let mut all = Planes::default();
            format.unpack(&bytes, &mut all.i, &mut all.q);
            for (piece, samples) in [(1, 40), (7, 40), (40, 40), (64, 40), (33, 100)] {
                let mut gathered: Option<Gathered> = None;
                let mut first = 500;
                for bytes in bytes.chunks(piece * size) {
                    let block = Packed { first, format, bytes };
                    let end = block.end() as usize - 500;
                    let block = Stretch::Packed(block);
                    let is_whole = gathered.get_or_insert_with(|| Gathered::from(&block)).take(&block, samples);
                    assert_eq!(is_whole, end >= samples, "{format} {piece} {end}");
                    first = block.end();
                }
                let gathered = gathered.unwrap();
                let packed = Stretch::Packed(gathered.packed());
                let planes = Stretch::Planes(Block { first: 500, i: &all.i[..samples], q: &all.q[..samples] });
                for stretch in [packed, planes] {
                    assert_eq!((stretch.first(), stretch.samples()), (500, samples), "{format} {piece}");
                    for part in [0, 1, samples - 1, samples, samples + 5] {
                        let [i, q] = stretch.planes(part);
                        let part = part.min(samples);
                        assert_eq!((&i[..], &q[..]), (&all.i[..part], &all.q[..part]), "{format} {piece} {part}");
                    }
                }
            }
        }
    }

    #[test]
    fn blocks_do_not_depend_on_how_the_bytes_arrive() {
        for (format, _) in Format::NAMES {
            let bytes: Vec<u8> = (0..1003_u32).map(|n| (n * 37 % 251) as u8).collect();
            let mut all = Planes::default();
            format.unpack(&bytes, &mut all.i, &mut all.q);
            for piece in [1, 3, 56, 57, 400, 1003] {
                let mut source = Source::new(format, 7);
                let (mut i, mut q, mut planes) = (Vec::new(), Vec::new(), Planes::default());
                let mut take = |packed: Packed, whole: bool| {
                    assert_eq!(packed.first, i.len() as u64);
                    assert!(packed.samples() == 7 || !whole && (1..7).contains(&packed.samples()));
                    let block = packed.unpack(0..usize::MAX, &mut planes);
                    i.extend_from_slice(block.i);
                    q.extend_from_slice(block.q);
                };
                for mut bytes in bytes.chunks(piece) {
                    while let Some(packed) = source.next(&mut bytes) {
                        take(packed, true);
                    }
                    assert!(bytes.is_empty());
                }
                let (rest, cut_bytes) = source.rest();
                rest.into_iter().for_each(|packed| take(packed, false));
                assert_eq!((&i, &q), (&all.i, &all.q), "{format} {piece}");
                assert_eq!((source.samples(), cut_bytes), (i.len() as u64, 1003 % format.bytes()), "{format}");
            }
        }
    }

    #[test]
    fn a_part_of_a_block_is_numbered_from_the_recording_s_first_sample() {
        let bytes: Vec<u8> = (0..40).collect();
        let mut source = Source::new(Format::Ci8, 10);
        let mut rest = &bytes[..];
        let _ = source.next(&mut rest);
        let packed = source.next(&mut rest).unwrap();
        let mut planes = Planes::default();
        let part = packed.unpack(8..20, &mut planes);
        assert_eq!((part.first, part.i, part.q), (18, &[36.0, 38.0][..], &[37.0, 39.0][..]));
        assert_eq!((packed.first, packed.end()), (10, 20));
    }

    #[test]
    fn samples_that_are_kept_are_shown_with_the_next_block() {
        let bytes: Vec<u8> = (0..120).collect();
        let packed = |from: usize, to: usize| Packed {
            first: from as u64,
            format: Format::Ci8,
            bytes: &bytes[2 * from..2 * to],
        };
        let (mut lookback, mut planes) = (Lookback::default(), Planes::default());
        // From where each block's end is kept, and where the next one is shown from.
        for (block, from) in [((0, 20), 20), ((20, 40), 37), ((40, 42), 38), ((42, 60), 41)] {
            let block = packed(block.0, block.1);
            let first = lookback.first(&block);
            for shown in first..=block.end() {
                let samples = lookback.unpack(&block, (shown, block.end()), &mut planes);
                let expected: Vec<f32> = (shown..block.end()).map(|n| 2.0 * n as f32).collect();
                assert_eq!((samples.first, samples.i), (shown, &expected[..]), "{first} {shown}");
                let (mut room, mut other) = (FixedSamples::default(), FixedSamples::default());
                let fixed = lookback.fixed(&block, (shown, block.end()), &mut room);
                assert_eq!(fixed, other.of(samples.i, samples.q), "{first} {shown}");
            }
            lookback.keep(&block, from);
            assert_eq!((lookback.first, lookback.bytes.len() as u64), (from, 2 * (block.end() - from)));
        }
        // A block that does not follow is shown alone.
        let later = packed(60, 60);
        assert_eq!(lookback.first(&Packed { first: 70, ..later }), 70);
    }

    #[test]
    fn a_queue_gives_the_samples_before_any_end_as_far_as_it_has_them() {
        let bytes: Vec<u8> = (0..101).collect();
        let mut planes = Planes::default();
        for piece in [1, 2, 7, 101] {
            let (mut queue, mut seen) = (Queue::new(Format::Ci8), Vec::new());
            let mut ends = [3, 3, 20, 21, 44].into_iter().peekable();
            for bytes in bytes.chunks(piece) {
                queue.push(bytes);
                while let Some(end) = ends.next_if(|end| *end <= queue.end()) {
                    let block = queue.block(end);
                    assert_eq!((block.first, block.end()), (seen.len() as u64, end));
                    seen.extend_from_slice(block.unpack(0..usize::MAX, &mut planes).i);
                    queue.take(end);
                }
            }
            // What is left is cut to what is there: 50 samples and half of one.
            assert_eq!((queue.samples(), queue.block(1000).end(), queue.cut_bytes()), (44, 50, 1));
            assert!(seen.iter().enumerate().all(|(k, i)| *i == 2.0 * k as f32), "{piece}");
        }
    }
}
