//! Phase noise of an oscillator: power-law spectra of fractional frequency, S_y(f) = Σ h_a f^a.
//!
//! Definitions and levels: NIST SP 1065, section 3; presets: Winkel 2003, table 2.1 (h2 and h1 are not given
//! there and are zero). The noise is drawn at nodes less than a millisecond apart on a grid of samples and is
//! linear between them, so its upper cut-off is half the rate of nodes. Any segment is a pure function of the
//! seed: coarse nodes are stepped from the beginning, fine ones drawn between them. Limits: flicker reaches
//! down to 1.6e-7 Hz.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::nodes::node_samples;
use crate::random::Stream;
use crate::random::markov::{Process, State, Track};
use gnss::time::Rate;

/// Fine nodes in a coarse cell.
const CELL_NODES: usize = 1024;
/// Coarse cells between states that are kept.
const BLOCK_CELLS: u64 = 256;
/// Blocks and cells that are kept at hand.
const KEPT: usize = 8;
/// Ratio of neighbouring time constants of flicker, and the longest of them.
const FLICKER_RATIO: f64 = 4.0;
const FLICKER_LONGEST_S: f64 = 1e6;

/// Levels of power-law frequency noise, one-sided, in units of S_y(f) = Σ h_a f^a.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PowerLaw {
    /// White phase noise.
    pub h2: f64,
    /// Flicker phase noise.
    pub h1: f64,
    /// White frequency noise.
    pub h0: f64,
    /// Flicker frequency noise.
    pub hm1: f64,
    /// Random-walk frequency noise.
    pub hm2: f64,
}

impl PowerLaw {
    /// Oscillators of Winkel 2003, table 2.1, by the name that a scenario uses.
    pub const PRESETS: [(&str, Self); 8] = [
        ("quartz", Self::of(2e-19, 7e-21, 2e-20)),
        ("tcxo", Self::of(1e-21, 1e-20, 2e-20)),
        ("ocxo1", Self::of(8e-20, 2e-21, 4e-23)),
        ("ocxo2", Self::of(2.51e-26, 2.51e-23, 2.51e-22)),
        ("rubidium1", Self::of(2e-20, 7e-24, 4e-29)),
        ("rubidium2", Self::of(1e-23, 1e-22, 1.3e-26)),
        ("cesium1", Self::of(1e-19, 1e-25, 2e-32)),
        ("cesium2", Self::of(2e-20, 7e-23, 4e-29)),
    ];

    const fn of(h0: f64, hm1: f64, hm2: f64) -> Self {
        Self { h2: 0.0, h1: 0.0, h0, hm1, hm2 }
    }

    /// Returns the coefficients from the highest power of frequency to the lowest.
    pub fn levels(&self) -> [f64; 5] {
        [self.h2, self.h1, self.h0, self.hm1, self.hm2]
    }

    fn processes(&self, node_s: f64) -> Vec<Process> {
        let pi = std::f64::consts::PI;
        let mut processes = Vec::new();
        if self.h0 > 0.0 {
            processes.push(Process::WhiteFrequency { level: 0.5 * self.h0 });
        }
        if self.hm2 > 0.0 {
            processes.push(Process::FrequencyWalk { level: 2.0 * pi * pi * self.hm2 });
        }
        // Σ 4 σ² τ / (1 + (2πfτ)²) over τ in ratio r is σ² / (f ln r).
        let share = libm::log(FLICKER_RATIO);
        let mut tau_s = 0.25 * node_s;
        while tau_s < FLICKER_LONGEST_S {
            if self.hm1 > 0.0 {
                processes.push(Process::Frequency { variance: self.hm1 * share, tau_s });
            }
            if self.h1 > 0.0 {
                processes.push(Process::Phase { variance: self.h1 * share / (4.0 * pi * pi), tau_s });
            }
            tau_s *= FLICKER_RATIO;
        }
        processes
    }
}

/// Phase noise of an oscillator over the samples of a scene.
#[derive(Debug)]
pub struct Oscillator {
    /// Power law of the fractional frequency.
    pub law: PowerLaw,
    cell_s: f64,
    tracks: Vec<Track>,
    /// White phase noise of a node, in seconds: standard deviation and random numbers.
    white_s: f64,
    white: Stream,
    /// Phase and frequency at the beginning, which are taken off.
    begin: State,
    known: Mutex<Known>,
}

/// Random values that have been drawn.
#[derive(Debug, Default)]
struct Known {
    /// States at the beginning of each block of cells.
    blocks: Vec<Vec<State>>,
    /// Phase at the beginnings of a block's cells, by block.
    coarse_s: BTreeMap<u64, Arc<Vec<f64>>>,
    /// Phase in seconds at the nodes of a cell, without the spline through coarse nodes.
    quick_s: BTreeMap<u64, Arc<Vec<f64>>>,
}

impl Oscillator {
    /// Creates the noise of `law` at `rate`, drawn from `stream`.
    pub fn new(law: PowerLaw, rate: Rate, stream: Stream) -> Self {
        let node_samples = node_samples(rate);
        let node_s = rate.elapsed_s(node_samples);
        let tracks: Vec<Track> = (1..)
            .zip(law.processes(node_s))
            .map(|(part, process)| Track::new(process, node_s, CELL_NODES, stream.part(part)))
            .collect();
        let states: Vec<State> = tracks.iter().map(Track::begin).collect();
        let begin = states.iter().fold([0.0, 0.0], |sum, s| [sum[0] + s[0], sum[1] + s[1]]);
        // ∫ h2 / 4π² df up to half the rate of nodes.
        let white_s = (law.h2 / (8.0 * node_s)).sqrt() / std::f64::consts::PI;
        Self {
            law,
            cell_s: node_s * CELL_NODES as f64,
            tracks,
            white_s,
            white: stream.part(0),
            begin,
            known: Mutex::new(Known { blocks: vec![states], ..Known::default() }),
        }
    }

    /// Slow part of the phase in seconds, `elapsed_s` after the first sample, which knots can follow. It is a
    /// spline with continuous slope through the noise at coarse nodes, some 0.8 s apart.
    pub fn slow_s(&self, elapsed_s: f64) -> f64 {
        let place = elapsed_s / self.cell_s;
        // Before the first sample the first piece goes on.
        let cell = place.floor().max(0.0);
        let u = place - cell;
        let [a, b, c, d] = self.spline(cell as u64);
        a + u * (b + u * (c + u * d))
    }

    /// Fast part of the phase in seconds at node number `node`. The sum with [`Self::slow_s`] is the whole
    /// phase.
    pub fn quick_s(&self, node: u64) -> f64 {
        let (cell, index) = (node / CELL_NODES as u64, (node % CELL_NODES as u64) as usize);
        self.cell(cell).get(index).copied().unwrap_or(0.0)
    }

    /// [`Self::quick_s`] at a position between nodes.
    pub fn quick_at_s(&self, place: f64) -> f64 {
        let node = place.floor();
        let (from_s, to_s) = (self.quick_s(node as u64), self.quick_s(node as u64 + 1));
        from_s + (to_s - from_s) * (place - node)
    }

    /// The cubic of a cell, in powers of the fraction of the cell.
    fn spline(&self, cell: u64) -> [f64; 4] {
        let at = |cell: u64| self.coarse_s(cell);
        let (from, to) = (at(cell), at(cell + 1));
        let slope_from = if cell == 0 { to - from } else { 0.5 * (to - at(cell - 1)) };
        let slope_to = 0.5 * (at(cell + 2) - from);
        let rise = to - from;
        [from, slope_from, 3.0 * rise - 2.0 * slope_from - slope_to, slope_from + slope_to - 2.0 * rise]
    }

    /// Phase at the beginning of a cell, white phase noise apart.
    fn coarse_s(&self, cell: u64) -> f64 {
        let (block, index) = (cell / BLOCK_CELLS, (cell % BLOCK_CELLS) as usize);
        let found = self.known.lock().unwrap_or_else(PoisonError::into_inner).coarse_s.get(&block).cloned();
        let coarse = found.unwrap_or_else(|| {
            let mut states = self.block(block);
            let first = block * BLOCK_CELLS;
            let mut coarse = Vec::with_capacity(BLOCK_CELLS as usize);
            for cell in first..first + BLOCK_CELLS {
                let elapsed_s = self.cell_s * cell as f64;
                let sum: f64 = states.iter().fold(0.0, |sum, state| sum + state[0]);
                coarse.push(sum - self.begin[0] - self.begin[1] * elapsed_s);
                self.step(&mut states, cell);
            }
            let coarse = Arc::new(coarse);
            keep(&mut self.known.lock().unwrap_or_else(PoisonError::into_inner).coarse_s, block, &coarse);
            coarse
        });
        coarse.get(index).copied().unwrap_or(0.0)
    }

    /// States at the beginning of a block of cells.
    fn block(&self, block: u64) -> Vec<State> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            let last = known.blocks.len() as u64 - 1;
            if let Some(states) = known.blocks.get(block as usize) {
                return states.clone();
            }
            let Some(mut states) = known.blocks.last().cloned() else { return Vec::new() };
            (last * BLOCK_CELLS..(last + 1) * BLOCK_CELLS).for_each(|cell| self.step(&mut states, cell));
            known.blocks.push(states);
        }
    }

    fn step(&self, states: &mut [State], cell: u64) {
        states.iter_mut().zip(&self.tracks).for_each(|(state, track)| *state = track.next(*state, cell));
    }

    /// Phase residual from the spline, in seconds, at the nodes of a cell.
    fn cell(&self, cell: u64) -> Arc<Vec<f64>> {
        let found = self.known.lock().unwrap_or_else(PoisonError::into_inner).quick_s.get(&cell).cloned();
        found.unwrap_or_else(|| {
            let mut from = self.block(cell / BLOCK_CELLS);
            (cell / BLOCK_CELLS * BLOCK_CELLS..cell).for_each(|cell| self.step(&mut from, cell));
            let mut to = from.clone();
            self.step(&mut to, cell);
            let mut phase_s = vec![0.0; CELL_NODES + 1];
            for ((track, from), to) in self.tracks.iter().zip(from).zip(to) {
                track.path(cell, from, to, &mut phase_s);
            }
            phase_s.truncate(CELL_NODES);
            let [a, b, c, d] = self.spline(cell);
            let first = cell * CELL_NODES as u64;
            for (k, phase_s) in phase_s.iter_mut().enumerate() {
                let u = k as f64 / CELL_NODES as f64;
                let elapsed_s = self.cell_s * (cell as f64 + u);
                let white_s = self.white_s * self.white.normals(first + k as u64).0;
                let spline_s = a + u * (b + u * (c + u * d));
                *phase_s += white_s - self.begin[0] - self.begin[1] * elapsed_s - spline_s;
            }
            let quick = Arc::new(phase_s);
            keep(&mut self.known.lock().unwrap_or_else(PoisonError::into_inner).quick_s, cell, &quick);
            quick
        })
    }
}

/// Keeps `value` at hand, and drops the oldest of too many.
fn keep(kept: &mut BTreeMap<u64, Arc<Vec<f64>>>, key: u64, value: &Arc<Vec<f64>>) {
    kept.insert(key, Arc::clone(value));
    while kept.len() > KEPT {
        // The end that is farther goes, whichever way the requests move.
        let ends = kept.first_key_value().zip(kept.last_key_value()).map(|((first, _), (last, _))| (*first, *last));
        let Some((first, last)) = ends else { return };
        if key.abs_diff(first) >= key.abs_diff(last) {
            kept.pop_first()
        } else {
            kept.pop_last()
        };
    }
}
