//! The fast kernel: all rays of a segment at once, 32 samples side by side in plain arrays that the compiler
//! turns into vectors.
//!
//! No fused multiply-add and no intrinsics: each operation is one IEEE rounding, so every instruction set
//! gives the same bits. Samples come in groups of 32, sixteen before and sixteen behind the group's middle.
//! The carrier at the middle, times that at half a sample, one and a half … from it, gives both sides with
//! the same four products: the earlier half is kept backwards until all rays are added. Carrier within 1e-6
//! cycle, no spur above −110 dBc. Chip signs come from one window of the strip per group, by a shift per
//! lane; code phases resolve 2^-27 chip.

use super::angle::{cos_sin, ramp};
use super::chips::window;
use super::chorus::{self, Chord};
use super::waves::Waves;
use super::{CODE_BITS, CODE_ONE, Edge, RUN_SAMPLES, Run};

/// Samples on each side of a group's middle. The same on every instruction set, because rounding depends on
/// it.
pub(super) const HALF: usize = 16;

/// Samples of a group.
pub const GROUP: usize = 2 * HALF;

/// Groups of the longest run.
const GROUPS: usize = RUN_SAMPLES / GROUP;

/// Fractional bits of a lane's code phase; the five above count steps in the window.
pub(super) const LANE_BITS: u32 = 27;
pub(super) const FRACTION: u32 = (1 << LANE_BITS) - 1;

/// Sign of an `f32`.
pub(super) const SIGN: u32 = 1 << 31;

/// A value for each sample of half a group.
pub(super) type Side<T = f32> = [T; HALF];

/// Scratch of the kernel.
#[derive(Default)]
pub struct Buffers {
    voices: Vec<Voice>,
    chords: Vec<Chord>,
    /// Waves on the heap: workers that wait for each other hold many of these.
    waves: Box<Waves>,
}

/// A run made ready: its carrier, and the position of its code in each group.
#[derive(Clone)]
struct Voice {
    carrier: Carrier,
    /// Positions of the lanes, earlier and later half, from the group's first sample on.
    before: [u32; HALF],
    after: [u32; HALF],
    /// Fraction of a step at each group's first sample.
    fraction: [u32; GROUPS],
    /// Code position of the first group, a step early, and the advance from group to group, Q16.48.
    position: u64,
    stride: u64,
    /// Half a sample's share of a step, as bits of the `f32`, in units of a lane's position.
    reach: u32,
}

/// A carrier as two factors.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Carrier {
    /// Cosine and sine at the samples' distances from the middle of a group, ½, 1½, 2½ samples, with
    /// amplitude one.
    pub cos: Side,
    pub sin: Side,
    /// Carrier at the middle of each group.
    pub re: [f32; GROUPS],
    pub im: [f32; GROUPS],
}

impl Default for Carrier {
    fn default() -> Self {
        Self { cos: [0.0; HALF], sin: [0.0; HALF], re: [0.0; GROUPS], im: [0.0; GROUPS] }
    }
}

impl Default for Voice {
    fn default() -> Self {
        let [before, after] = [[0; HALF]; 2];
        Self { carrier: Carrier::default(), before, after, fraction: [0; GROUPS], position: 0, stride: 0, reach: 0 }
    }
}

impl Carrier {
    /// Phases are exact to 2^-32 turn, sines to 2e-7; seven rotations in `f32` lose 4e-7 at most.
    #[inline(always)]
    pub fn anchor(&mut self, run: &Run<'_>, amplitude: f32) {
        let half = run.turns_step >> 1;
        (self.cos, self.sin) = cos_sin(&ramp(half, run.turns_step));
        let middle = run.turns.wrapping_add(run.turns_step.wrapping_mul(HALF as u64 - 1)).wrapping_add(half);
        let stride = run.turns_step.wrapping_mul(GROUP as u64);
        let (mut re, mut im): (Side, Side) = cos_sin(&ramp(middle, stride));
        for k in 0..HALF {
            (re[k], im[k]) = (amplitude * re[k], amplitude * im[k]);
        }
        let ([turn_re], [turn_im]) = cos_sin(&ramp(stride.wrapping_mul(HALF as u64), 0));
        for (out_re, out_im) in self.re.as_chunks_mut().0.iter_mut().zip(self.im.as_chunks_mut().0) {
            (*out_re, *out_im) = (re, im);
            for k in 0..HALF {
                (re[k], im[k]) = (re[k] * turn_re - im[k] * turn_im, re[k] * turn_im + im[k] * turn_re);
            }
        }
    }

    /// Adds `amplitude` times a wave in phase with the carrier over a group, its earlier half backwards.
    #[inline(always)]
    pub fn turn(&self, group: usize, amplitude: f32, [before, after]: &[Side; 2], sums: &mut Sums) {
        let Self { cos, sin, re, im } = self;
        let (Some(re), Some(im)) = (re.get(group), im.get(group)) else { return };
        let (re, im) = (amplitude * re, amplitude * im);
        for k in 0..HALF {
            let (a, b, c, d) = (re * cos[k], im * sin[k], re * sin[k], im * cos[k]);
            sums.i_before[k] += before[k] * (a + b);
            sums.q_before[k] += before[k] * (d - c);
            sums.i_after[k] += after[k] * (a - b);
            sums.q_after[k] += after[k] * (d + c);
        }
    }

    /// Adds `amplitude` times a wave a quarter of a turn ahead of the carrier over a group, its earlier half
    /// backwards.
    #[inline(always)]
    pub fn turn_ahead(&self, group: usize, amplitude: f32, [before, after]: &[Side; 2], sums: &mut Sums) {
        let Self { cos, sin, re, im } = self;
        let (Some(re), Some(im)) = (re.get(group), im.get(group)) else { return };
        let (re, im) = (amplitude * re, amplitude * im);
        for k in 0..HALF {
            let (a, b, c, d) = (re * cos[k], im * sin[k], re * sin[k], im * cos[k]);
            sums.i_before[k] -= before[k] * (d - c);
            sums.q_before[k] += before[k] * (a + b);
            sums.i_after[k] -= after[k] * (d + c);
            sums.q_after[k] += after[k] * (a - b);
        }
    }
}

impl Voice {
    #[inline(always)]
    fn anchor<const AREA: bool>(&mut self, run: &Run<'_>) {
        let unit = (1_u64 << (CODE_BITS - LANE_BITS)) as f64;
        let reach = 0.5 * run.step as f64 / unit;
        // The kernel's area values are ±reach.
        self.carrier.anchor(run, (if AREA { run.amplitude / reach } else { run.amplitude }) as f32);
        self.reach = (reach as f32).to_bits();
        // The area of a sample ends half a step after its instant. One step early, so that each sign's
        // predecessor is in the window.
        let end = if AREA { run.position - run.step / 2 + run.step } else { run.position };
        self.position = end - CODE_ONE;
        self.stride = run.step * GROUP as u64;
        let places: [u32; GROUP] = std::array::from_fn(|k| lane(run.step * k as u64));
        for k in 0..HALF {
            (self.before[k], self.after[k]) = (places[HALF - 1 - k], places[HALF + k]);
        }
        let mut positions: [u64; 8] = std::array::from_fn(|k| self.position + self.stride * k as u64);
        for fractions in self.fraction.as_chunks_mut::<8>().0 {
            for k in 0..8 {
                fractions[k] = lane(positions[k]) & FRACTION;
                positions[k] = positions[k].wrapping_add(self.stride * 8);
            }
        }
    }
}

/// A Q16.48 position as a lane's position.
#[inline(always)]
pub(super) fn lane(position: u64) -> u32 {
    (position >> (CODE_BITS - LANE_BITS)) as u32
}

/// Sums of rays over a group: in-phase and quadrature, the earlier half backwards.
pub(super) struct Sums {
    pub i_before: Side,
    pub q_before: Side,
    pub i_after: Side,
    pub q_after: Side,
}

impl Sums {
    #[inline(always)]
    pub fn new() -> Self {
        let [i_before, q_before, i_after, q_after] = [[0.0; HALF]; 4];
        Self { i_before, q_before, i_after, q_after }
    }

    /// Adds the sums to a group, or to as much of it as exists.
    #[inline(always)]
    pub fn add_to(&self, i: &mut [f32], q: &mut [f32]) {
        let forwards = |before: &Side, after: &Side| -> [f32; GROUP] {
            std::array::from_fn(|k| if k < HALF { before[HALF - 1 - k] } else { after[k - HALF] })
        };
        let sum_i = forwards(&self.i_before, &self.i_after);
        let sum_q = forwards(&self.q_before, &self.q_after);
        if let (Ok(i), Ok(q)) = (<&mut [f32; GROUP]>::try_from(&mut *i), <&mut [f32; GROUP]>::try_from(&mut *q)) {
            for k in 0..GROUP {
                i[k] += sum_i[k];
                q[k] += sum_q[k];
            }
        } else {
            i.iter_mut().zip(sum_i).for_each(|(i, sum)| *i += sum);
            q.iter_mut().zip(sum_q).for_each(|(q, sum)| *q += sum);
        }
    }
}

/// Adds rays to planar samples; `i` and `q` have the same length, which is that of every run, at most
/// [`RUN_SAMPLES`]. The runs of a ray share a carrier ([`Run::shares_carrier`]).
#[inline(always)]
pub fn accumulate(edge: Edge<'_>, rays: &[&[Run<'_>]], i: &mut [f32], q: &mut [f32], buffers: &mut Buffers) {
    let Buffers { chords, waves, .. } = buffers;
    match edge {
        Edge::Nearest => pass::<false>(rays, i, q, buffers),
        Edge::Area => pass::<true>(rays, i, q, buffers),
        Edge::BandLimited(_) => chorus::accumulate_ready(edge, rays, chords, waves, i, q),
    }
}

/// Codes and carriers in one pass, of rays of one run of sparse steps and of others in turn.
#[inline(always)]
fn pass<const AREA: bool>(rays: &[&[Run<'_>]], i: &mut [f32], q: &mut [f32], buffers: &mut Buffers) {
    for rays in rays.chunk_by(|a, b| is_plain(a) == is_plain(b)) {
        if rays.first().is_some_and(|runs| is_plain(runs)) {
            let runs: Vec<Run<'_>> = rays.iter().flat_map(|runs| runs.iter().copied()).collect();
            fused::<AREA>(&runs, &mut buffers.voices, i, q);
        } else {
            chorus::accumulate::<AREA>(rays, &mut buffers.chords, i, q);
        }
    }
}

/// True if a ray is one run of at most one code step per sample.
fn is_plain(runs: &[Run<'_>]) -> bool {
    matches!(runs, [run] if run.step <= CODE_ONE)
}

/// Codes and carriers in one pass, for at most one code step a sample.
#[inline(always)]
fn fused<const AREA: bool>(runs: &[Run<'_>], voices: &mut Vec<Voice>, i: &mut [f32], q: &mut [f32]) {
    if voices.len() < runs.len() {
        voices.resize_with(runs.len(), Voice::default);
    }
    for (run, voice) in runs.iter().zip(&mut *voices) {
        voice.anchor::<AREA>(run);
    }
    for (group, (i, q)) in i.chunks_mut(GROUP).zip(q.chunks_mut(GROUP)).enumerate() {
        let mut sums = Sums::new();
        for (run, voice) in runs.iter().zip(&*voices) {
            add::<AREA>(run.bits, voice, group, &mut sums);
        }
        sums.add_to(i, q);
    }
}

/// Adds one group of a voice.
#[inline(always)]
fn add<const AREA: bool>(bits: &[u64], voice: &Voice, group: usize, sums: &mut Sums) {
    let Carrier { cos, sin, re, im } = &voice.carrier;
    let (Some(re), Some(im), Some(&fraction)) = (re.get(group), im.get(group), voice.fraction.get(group)) else {
        return;
    };
    let signs = window(bits, ((voice.position + voice.stride * group as u64) / CODE_ONE) as usize);
    let now = ((signs << 1) >> 32) as u32;
    let changes = ((signs ^ (signs << 1)) >> 32) as u32;
    for k in 0..HALF {
        let before = chip::<AREA>(fraction.wrapping_add(voice.before[k]), now, changes, voice.reach);
        let after = chip::<AREA>(fraction.wrapping_add(voice.after[k]), now, changes, voice.reach);
        let (a, b, c, d) = (re * cos[k], im * sin[k], re * sin[k], im * cos[k]);
        sums.i_before[k] += times::<AREA>(before, a + b);
        sums.q_before[k] += times::<AREA>(before, d - c);
        sums.i_after[k] += times::<AREA>(after, a - b);
        sums.q_after[k] += times::<AREA>(after, d + c);
    }
}

/// The code at a lane's position: for area edges the mean over the sample in units of 1/`reach`, else the
/// sign alone.
#[inline(always)]
fn chip<const AREA: bool>(place: u32, now: u32, changes: u32, reach: u32) -> f32 {
    let index = place >> LANE_BITS;
    let sign = (now << index) & SIGN;
    if !AREA {
        return f32::from_bits(sign);
    }
    // Behind a change the mean rises from −reach to reach, as far as the edge lies back; elsewhere it is
    // reach already.
    let behind = (place & FRACTION) as i32 as f32;
    let mean = behind + f32::from_bits(((changes << index) & SIGN) | reach);
    let reach = f32::from_bits(reach);
    let mean = if mean < reach { mean } else { reach };
    f32::from_bits(mean.to_bits() ^ sign)
}

/// `chip` times `x`; a chip that is a sign alone turns the sign.
#[inline(always)]
fn times<const AREA: bool>(chip: f32, x: f32) -> f32 {
    if AREA { chip * x } else { f32::from_bits(chip.to_bits() ^ x.to_bits()) }
}
