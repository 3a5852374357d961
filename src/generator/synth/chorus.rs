//! All sequences of one ray in one pass: components and layers that share a carrier.
//!
//! Data and pilot of CBOC are four sequences on one carrier, half a turn apart at most; those of QMBOC and of
//! data and pilot in quadrature are a quarter apart. Waves in phase are added first, so are those in
//! quadrature, and both are turned by one carrier. Sequences that step together (*a layer*) share their
//! positions and, for area edges, the shares of a sample that its steps have. Each half of a group begins its
//! window again, so that a sample may span two steps: BOC(6,1) from 6.4 Msps on. Longer ones are read sample
//! by sample ([`super::dense`]), and waves behind a filter come ready ([`super::waves`]). Accuracy and order
//! of operations are those of [`super::lanes`]: the same bits on every instruction set.

use super::chips::window;
use super::lanes::{Carrier, FRACTION, GROUP, HALF, LANE_BITS, SIGN, Side, Sums, lane};
use super::waves::{TILE, Waves};
use super::{CODE_BITS, CODE_ONE, Edge, Run, dense};

/// Most steps per sample that are read from a window for each half of a group, which then spans 30 of its 32,
/// two of which an area looks back.
const DENSEST: u64 = 29 * CODE_ONE / 15;
const DENSER: u64 = DENSEST + 1;

/// The sequences of a ray made ready.
#[derive(Default)]
pub(super) struct Chord {
    /// Carrier of the first sequence.
    carrier: Carrier,
    /// Layers in phase with the carrier, and layers a quarter of a turn ahead.
    in_phase: Vec<Layer>,
    quadrature: Vec<Layer>,
}

/// Sequences that step together.
struct Layer {
    /// Positions of the lanes from the first sample of half a group on, and the same backwards.
    ahead: Side<u32>,
    behind: Side<u32>,
    /// Code position of the first half group, early by the steps that an area looks back, and the advance
    /// from half group to half group, Q16.48.
    position: u64,
    stride: u64,
    density: Density,
    /// A sample's span, or half of it where it is not dense, in units of a lane's position.
    span: f32,
    /// Number of each sequence's run, and its amplitude.
    voices: Vec<(usize, f32)>,
    step: u64,
    begins: u64,
}

/// Number of steps in a sample.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Density {
    /// One at most.
    Sparse,
    /// Two at most, so that half a group's are in a window of 32.
    Dense,
    /// More.
    Densest,
}

/// Adds rays to planar samples, as [`super::lanes::accumulate`] does those of a run of sparse steps.
#[inline(always)]
pub(super) fn accumulate<const AREA: bool>(rays: &[&[Run<'_>]], chords: &mut Vec<Chord>, i: &mut [f32], q: &mut [f32]) {
    if chords.len() < rays.len() {
        chords.resize_with(rays.len(), Chord::default);
    }
    for (chord, runs) in chords.iter_mut().zip(rays) {
        chord.anchor::<AREA>(runs);
    }
    for (group, (i, q)) in i.chunks_mut(GROUP).zip(q.chunks_mut(GROUP)).enumerate() {
        let mut sums = Sums::new();
        for (chord, runs) in chords.iter().zip(rays) {
            chord.add::<AREA>(runs, group, &mut sums);
        }
        sums.add_to(i, q);
    }
}

/// Adds rays whose waves come in `f64`, a tile at a time.
#[inline(always)]
pub(super) fn accumulate_ready(
    edge: Edge<'_>,
    rays: &[&[Run<'_>]],
    chords: &mut Vec<Chord>,
    waves: &mut Waves,
    i: &mut [f32],
    q: &mut [f32],
) {
    if chords.len() < rays.len() {
        chords.resize_with(rays.len(), Chord::default);
    }
    for (Chord { carrier, .. }, runs) in chords.iter_mut().zip(rays) {
        if let Some(first) = runs.first() {
            carrier.anchor(first, 1.0);
        }
    }
    for (tile, (i, q)) in i.chunks_mut(TILE).zip(q.chunks_mut(TILE)).enumerate() {
        for (Chord { carrier, .. }, runs) in chords.iter().zip(rays) {
            waves.make(edge, runs, tile);
            let amplitude = waves.amplitude() as f32;
            let in_phase = waves.in_phase().as_chunks::<GROUP>().0;
            let quadrature = waves.quadrature().map_or(&[][..], |wave| wave.as_chunks::<GROUP>().0);
            let groups = (tile * TILE / GROUP..).zip(i.chunks_mut(GROUP).zip(q.chunks_mut(GROUP)));
            for ((group, (i, q)), (number, wave)) in groups.zip(in_phase.iter().enumerate()) {
                let mut sums = Sums::new();
                carrier.turn(group, amplitude, &sides(wave), &mut sums);
                if let Some(wave) = quadrature.get(number) {
                    carrier.turn_ahead(group, amplitude, &sides(wave), &mut sums);
                }
                sums.add_to(i, q);
            }
        }
    }
}

/// A group's values as two sides.
#[inline(always)]
fn sides<T: Copy + Into<f64>>(wave: &[T; GROUP]) -> [Side; 2] {
    let [mut before, mut after] = [[0.0; HALF]; 2];
    for k in 0..HALF {
        (before[k], after[k]) = (wave[HALF - 1 - k].into() as f32, wave[HALF + k].into() as f32);
    }
    [before, after]
}

impl Chord {
    #[inline(always)]
    fn anchor<const AREA: bool>(&mut self, runs: &[Run<'_>]) {
        let Some(first) = runs.first() else { return };
        self.carrier.anchor(first, 1.0);
        self.in_phase.clear();
        self.quadrature.clear();
        for (number, run) in runs.iter().enumerate() {
            let quarters = run.quarters_ahead(first);
            let layers = if quarters % 2 == 0 { &mut self.in_phase } else { &mut self.quadrature };
            let amplitude = if quarters < 2 { run.amplitude } else { -run.amplitude };
            let known = layers.iter_mut().find(|layer| layer.step == run.step && layer.begins == run.position);
            match known {
                Some(layer) => layer.voices.push((number, layer.scaled::<AREA>(amplitude))),
                None => {
                    let mut layer = Layer::new::<AREA>(run);
                    layer.voices.push((number, layer.scaled::<AREA>(amplitude)));
                    layers.push(layer);
                }
            }
        }
    }

    /// Adds one group.
    #[inline(always)]
    fn add<const AREA: bool>(&self, runs: &[Run<'_>], group: usize, sums: &mut Sums) {
        self.carrier.turn(group, 1.0, &waves::<AREA>(&self.in_phase, runs, group), sums);
        if !self.quadrature.is_empty() {
            self.carrier.turn_ahead(group, 1.0, &waves::<AREA>(&self.quadrature, runs, group), sums);
        }
    }
}

/// The sum of layers over a group, its earlier half backwards.
#[inline(always)]
fn waves<const AREA: bool>(layers: &[Layer], runs: &[Run<'_>], group: usize) -> [Side; 2] {
    let [mut before, mut after] = [[0.0; HALF]; 2];
    for layer in layers {
        layer.add::<AREA>(runs, group as u64, &mut before, &mut after);
    }
    [before, after]
}

impl Layer {
    #[inline(always)]
    fn new<const AREA: bool>(run: &Run<'_>) -> Self {
        let unit = (1_u64 << (CODE_BITS - LANE_BITS)) as f64;
        let density = match run.step {
            DENSER.. => Density::Densest,
            ..=CODE_ONE => Density::Sparse,
            _ => Density::Dense,
        };
        let span = run.step as f64 / unit * if density == Density::Dense { 1.0 } else { 0.5 };
        // The area of a sample ends half a step after its instant.
        let position = match (AREA, density) {
            (false, _) | (true, Density::Densest) => run.position,
            (true, Density::Sparse) => run.position - run.step / 2 + run.step - CODE_ONE,
            (true, Density::Dense) => run.position - run.step / 2 + run.step - 2 * CODE_ONE,
        };
        let ahead: Side<u32> = std::array::from_fn(|k| lane(run.step * k as u64));
        Self {
            ahead,
            behind: std::array::from_fn(|k| ahead[HALF - 1 - k]),
            position,
            stride: run.step * HALF as u64,
            density,
            span: span as f32,
            voices: Vec::with_capacity(4),
            step: run.step,
            begins: run.position,
        }
    }

    /// Area values from windows are ±`span`.
    #[inline(always)]
    fn scaled<const AREA: bool>(&self, amplitude: f64) -> f32 {
        let in_spans = AREA && self.density != Density::Densest;
        (if in_spans { amplitude / f64::from(self.span) } else { amplitude }) as f32
    }

    /// Adds the layer's wave over a group, its earlier half backwards.
    #[inline(always)]
    fn add<const AREA: bool>(&self, runs: &[Run<'_>], group: u64, before: &mut Side, after: &mut Side) {
        if self.density == Density::Densest {
            return self.add_densest::<AREA>(runs, group, before, after);
        }
        let (pairs, rest) = self.voices.as_chunks::<2>();
        for voices in pairs {
            self.add_some::<AREA, 2>(runs, voices, group, before, after);
        }
        for &voice in rest {
            self.add_some::<AREA, 1>(runs, &[voice], group, before, after);
        }
    }

    /// Adds sequences whose samples are read from windows of their own.
    #[inline(always)]
    fn add_densest<const AREA: bool>(&self, runs: &[Run<'_>], group: u64, before: &mut Side, after: &mut Side) {
        let position = self.position + 2 * self.stride * group;
        for (number, amplitude) in &self.voices {
            let Some(run) = runs.get(*number) else { continue };
            let mut wave = [0.0_f32; GROUP];
            if AREA {
                dense::means(run, position, &mut wave, |mean| mean as f32);
            } else {
                dense::signs(run, position, &mut wave, |signs| turned(1.0, (signs >> 32) as u32));
            }
            let [own_before, own_after] = sides(&wave);
            for k in 0..HALF {
                before[k] += amplitude * own_before[k];
                after[k] += amplitude * own_after[k];
            }
        }
    }

    #[inline(always)]
    fn add_some<const AREA: bool, const V: usize>(
        &self,
        runs: &[Run<'_>],
        voices: &[(usize, f32); V],
        group: u64,
        before: &mut Side,
        after: &mut Side,
    ) {
        let early = self.position + 2 * self.stride * group;
        let late = early + self.stride;
        let index = (early / CODE_ONE) as usize;
        let signs = voices.map(|(number, _)| runs.get(number).map_or(0, |run| window(run.bits, index)));
        // At most 29 of 64 steps have passed.
        let passed = (late / CODE_ONE - early / CODE_ONE) as u32;
        let later = signs.map(|signs| ((signs << passed) >> 32) as u32);
        let amplitudes = voices.map(|(_, amplitude)| amplitude);
        let signs = signs.map(|signs| (signs >> 32) as u32);
        let sides = [(early, signs, &self.behind, before), (late, later, &self.ahead, after)];
        for (position, signs, places, wave) in sides {
            let fraction = lane(position) & FRACTION;
            match (AREA, self.density) {
                (false, _) => each(fraction, places, wave, |place| nearest(&signs, &amplitudes, place)),
                (true, Density::Sparse) => {
                    each(fraction, places, wave, |place| sparse(&signs, &amplitudes, self.span, place));
                }
                (true, _) => each(fraction, places, wave, |place| of_two(&signs, &amplitudes, self.span, place)),
            }
        }
    }
}

/// Adds the values of a sequence at every lane's position.
#[inline(always)]
fn each(fraction: u32, places: &Side<u32>, wave: &mut Side, value: impl Fn(u32) -> f32) {
    for k in 0..HALF {
        wave[k] += value(fraction.wrapping_add(places[k]));
    }
}

/// `x` with its sign turned where the first bit is set.
#[inline(always)]
fn turned(x: f32, bits: u32) -> f32 {
    f32::from_bits(x.to_bits() ^ (bits & SIGN))
}

#[inline(always)]
fn nearest<const V: usize>(signs: &[u32; V], amplitudes: &[f32; V], place: u32) -> f32 {
    let value = |v: usize| turned(amplitudes[v], signs[v] << (place >> LANE_BITS));
    (1..V).fold(value(0), |sum, v| sum + value(v))
}

/// Mean of the signs in one sample. Behind a change it rises from −`span` to `span`, as far as the edge lies
/// back; elsewhere it is `span`.
#[inline(always)]
fn sparse<const V: usize>(signs: &[u32; V], amplitudes: &[f32; V], span: f32, place: u32) -> f32 {
    let behind = (place & FRACTION) as i32 as f32;
    let value = |v: usize| {
        let earlier = signs[v] << (place >> LANE_BITS);
        let now = earlier << 1;
        let mean = behind + turned(span, earlier ^ now);
        amplitudes[v] * turned(if mean < span { mean } else { span }, now)
    };
    (1..V).fold(value(0), |sum, v| sum + value(v))
}

/// A sample ends within a step and holds as much of it as lies behind its beginning, of the step before as
/// much as is left or all of it, and the rest of the one before that.
#[inline(always)]
fn of_two<const V: usize>(signs: &[u32; V], amplitudes: &[f32; V], span: f32, place: u32) -> f32 {
    const STEP: f32 = (1_u32 << LANE_BITS) as f32;
    let behind = (place & FRACTION) as i32 as f32;
    let rest = span - behind;
    let whole = if rest < STEP { rest } else { STEP };
    let left = rest - whole;
    let value = |v: usize| {
        let first = signs[v] << (place >> LANE_BITS);
        amplitudes[v] * (turned(left, first) + turned(whole, first << 1) + turned(behind, first << 2))
    };
    (1..V).fold(value(0), |sum, v| sum + value(v))
}
