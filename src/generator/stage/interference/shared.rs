//! Wave of one source that all elements of an array hear, made once.
//!
//! Elements of an array are so close that a wave at one is the wave at the first of them, a little earlier or
//! later: its value and its slope there are made once a run and kept. What is kept is what would be made
//! again, so an element has the same bytes alone. Limits: noise that is drawn over the time of emission; up
//! to [`FARTHEST`] of a sample of the source, where the second derivative is 93 dB below the wave. Beyond,
//! an element makes the wave itself.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::{Anchor, Interferer, RUN, Waveform};
use crate::synth::isa::{self, Level};
use crate::synth::resample::{Interpolator, Position};

/// Samples of the source between elements at most: the interpolator's step.
const FARTHEST: f64 = 1.0 / 256.0;
/// Distance in source samples over which the slope is taken, in 2^-32.
const SLOPE: u64 = 1 << 24;
/// Runs that are kept: 64 KB each.
const KEPT: usize = 256;

/// Unit wave over one run at the first element, and its slope per sample of the source.
#[derive(Debug)]
struct Wave {
    i: Vec<f32>,
    q: Vec<f32>,
    slope_i: Vec<f32>,
    slope_q: Vec<f32>,
}

/// Source as the first element hears it, and the runs of its wave that are kept.
#[derive(Debug)]
pub struct Shared {
    first: Interferer,
    known: Mutex<BTreeMap<u64, Arc<Wave>>>,
}

impl Shared {
    /// Creates the waves of the source `first` at the first element.
    pub(super) fn new(first: Interferer) -> Self {
        Self { first: Interferer { shared: None, ..first }, known: Mutex::default() }
    }

    /// Adds the wave at the element that hears `own`, from sample `from` of a run on; false where the element
    /// has to make it itself.
    pub(super) fn add(
        &self,
        level: Level,
        own: &Interferer,
        (anchor, from): (&Anchor, u64),
        (i, q): (&mut [f32], &mut [f32]),
    ) -> bool {
        let Waveform::Emitted { rate, .. } = &self.first.waveform else { return false };
        if anchor.length != RUN {
            return false;
        }
        let known = self.first.anchor(anchor.n..anchor.n + RUN);
        let late = |end: usize| anchor.behind_s.get(end).zip(known.behind_s.get(end)).map(|(own, first)| own - first);
        let (Some(first_s), Some(last_s)) = (late(0), late(1)) else { return false };
        let [first, last] = [first_s, last_s].map(|late_s| -late_s * rate.hz());
        if first.abs().max(last.abs()) > FARTHEST || own.seed != self.first.seed {
            return false;
        }
        let wave = self.wave(level, &known);
        let inside = from as usize..from as usize + i.len();
        let planes = [&wave.i, &wave.q, &wave.slope_i, &wave.slope_q].map(|plane| plane.get(inside.clone()));
        let [Some(wi), Some(wq), Some(si), Some(sq)] = planes else { return false };
        let step = ((last - first) / RUN as f64) as f32;
        let begin = first as f32 + step * from as f32;
        let moved = |wave: &[f32], slope: &[f32]| -> Vec<f32> {
            let each = wave.iter().zip(slope).enumerate();
            each.map(|(k, (wave, slope))| wave + (begin + step * k as f32) * slope).collect()
        };
        let (turns, turns_step, amplitude) = anchor.turned(from);
        isa::turn(level, (&moved(wi, si), &moved(wq, sq)), (turns, turns_step), amplitude, (i, q));
        true
    }

    /// Wave over the run of `anchor`.
    fn wave(&self, level: Level, anchor: &Anchor) -> Arc<Wave> {
        let lock = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = lock().get(&anchor.n) {
            return Arc::clone(found);
        }
        let made = Arc::new(self.made(level, anchor));
        let mut known = lock();
        known.insert(anchor.n, Arc::clone(&made));
        while known.len() > KEPT {
            known.pop_first();
        }
        made
    }

    fn made(&self, level: Level, anchor: &Anchor) -> Wave {
        let samples = RUN as usize;
        let [mut i, mut q, mut slope_i, mut slope_q] = [(); 4].map(|()| vec![0.0_f32; samples]);
        let Waveform::Emitted { rate, by, .. } = &self.first.waveform else { return Wave { i, q, slope_i, slope_q } };
        let here = self.first.position(anchor, 0, *rate, 0.0);
        let later = u64::from(here.fraction) + SLOPE;
        let later = Position { whole: here.whole + (later >> 32) as i64, fraction: later as u32, ..here };
        let (begin, end) = (Interpolator::reach(here, samples).0, Interpolator::reach(later, samples).1);
        let (si, sq) = self.first.drawn(level, (begin, end));
        let skip = (later.whole - here.whole) as usize;
        isa::interpolate(level, by, here, (&si, &sq), (&mut i, &mut q));
        let from = (si.get(skip..).unwrap_or_default(), sq.get(skip..).unwrap_or_default());
        isa::interpolate(level, by, later, from, (&mut slope_i, &mut slope_q));
        let scale = (4_294_967_296.0 / SLOPE as f64) as f32;
        for (slope, wave) in [(&mut slope_i, &i), (&mut slope_q, &q)] {
            slope.iter_mut().zip(wave).for_each(|(slope, wave)| *slope = (*slope - wave) * scale);
        }
        Wave { i, q, slope_i, slope_q }
    }
}
