//! The waves of a ray in `f64`, a tile of samples at a time: its sequences with their amplitudes, those in
//! phase with the first and those in quadrature to it, before a carrier turns them.
//!
//! Values of a sequence are those of [`super::reference`]: to the last bit with nearest and area edges, and
//! as [`super::responses`] and [`super::pulse`] state behind a filter.

use super::chips::window;
use super::pulse::Pulses;
use super::responses::{self, Responses};
use super::{CODE_ONE, Edge, Run, dense};

pub(super) use super::responses::TILE;

/// Samples side by side.
const BLOCK: usize = 8;

/// A value for each sample of a tile.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Wave([f64; TILE]);

/// Waves of a ray, and scratch.
#[derive(Clone, Debug, Default)]
pub(super) struct Waves {
    in_phase: Wave,
    quadrature: Wave,
    has_quadrature: bool,
    /// Factor of both waves.
    amplitude: f64,
    own: Wave,
    responses: Responses,
    pulses: Pulses,
}

impl Default for Wave {
    fn default() -> Self {
        Self([0.0; TILE])
    }
}

impl Waves {
    /// Makes the waves of a ray's runs over the tile of that number.
    #[inline(always)]
    pub fn make(&mut self, edge: Edge<'_>, runs: &[Run<'_>], tile: usize) {
        let Some(first) = runs.first() else { return };
        let from = |run: &Run<'_>| run.position + run.step * (tile * TILE) as u64;
        if let ([run], true) = (runs, first.pulse.is_none()) {
            (self.amplitude, self.has_quadrature) = (run.amplitude, false);
            let of_tile = Run { position: from(run), ..*run };
            return waveform(edge, &of_tile, &mut self.in_phase.0, &mut self.responses);
        }
        self.amplitude = 1.0;
        let Self { in_phase, quadrature, has_quadrature, own, responses, pulses, .. } = self;
        *has_quadrature = runs.iter().any(|run| run.quarters_ahead(first) % 2 == 1);
        in_phase.0.fill(0.0);
        if *has_quadrature {
            quadrature.0.fill(0.0);
        }
        for (number, run) in runs.iter().enumerate() {
            let quarters = run.quarters_ahead(first);
            let sum = if quarters % 2 == 0 { &mut in_phase.0 } else { &mut quadrature.0 };
            let amplitude = |run: &Run<'_>| run.amplitude * if run.quarters_ahead(first) < 2 { 1.0 } else { -1.0 };
            let of_tile = Run { position: from(run), ..*run };
            if let (Edge::BandLimited(_), Some(pulse)) = (edge, run.pulse) {
                // The first of those whose pulses are alike and at the same positions brings all of them.
                let alike =
                    |other: &&Run<'_>| other.quarters_ahead(first) % 2 == quarters % 2 && other.pulses_with(run);
                if !runs.iter().take(number).any(|other| alike(&other)) {
                    let all = runs.iter().filter(alike).map(|run| (run.bits, amplitude(run)));
                    pulses.add(pulse, &of_tile, all, sum);
                }
                continue;
            }
            waveform(edge, &of_tile, &mut own.0, responses);
            let amplitude = amplitude(run);
            for (sum, own) in sum.iter_mut().zip(&own.0) {
                *sum += amplitude * own;
            }
        }
    }

    /// The factor of both waves.
    #[inline(always)]
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }

    /// Wave in phase with the first run.
    #[inline(always)]
    pub fn in_phase(&self) -> &[f64; TILE] {
        &self.in_phase.0
    }

    /// Wave a quarter of a turn ahead of the first run, if there is one.
    #[inline(always)]
    pub fn quadrature(&self) -> Option<&[f64; TILE]> {
        self.has_quadrature.then_some(&self.quadrature.0)
    }
}

/// Writes the code at each sample of a tile, of which the run's first is the first.
#[inline(always)]
fn waveform(edge: Edge<'_>, run: &Run<'_>, wave: &mut [f64; TILE], responses: &mut Responses) {
    match edge {
        Edge::Nearest => dense::signs(run, run.position, wave, |signs| signed(1.0, signs)),
        Edge::Area if run.step <= CODE_ONE => {
            for (first, block) in (0..).step_by(BLOCK).zip(wave.as_chunks_mut().0) {
                *block = area(run, first);
            }
        }
        Edge::Area => dense::means(run, run.position, wave, |mean| mean),
        Edge::BandLimited(filter) => responses::waveform(filter, run, wave, responses),
    }
}

/// The code's mean over the samples of a block, of one step at most each.
#[inline(always)]
fn area(run: &Run<'_>, first: u64) -> [f64; BLOCK] {
    let position = run.position + run.step * first - run.step / 2;
    let signs = window(run.bits, (position / CODE_ONE) as usize);
    let changes = signs ^ signs << 1;
    let scale = -2.0 / run.step as f64;
    let mut block = [0.0; BLOCK];
    for (value, k) in block.iter_mut().zip(0..) {
        let from = position % CODE_ONE + run.step * k;
        let behind = (from % CODE_ONE + run.step).saturating_sub(CODE_ONE) as i64 as f64;
        let changed = ((changes << (from / CODE_ONE)) as i64 >> 63) as u64;
        let mean = 1.0 + scale * f64::from_bits(behind.to_bits() & changed);
        *value = signed(mean, signs << (from / CODE_ONE));
    }
    block
}

/// A value with its sign turned by the first of `signs`.
#[inline(always)]
fn signed(value: f64, signs: u64) -> f64 {
    f64::from_bits(value.to_bits() ^ (signs & 1 << 63))
}
