//! The runs of all rays in one segment of samples, gathered before any is made.
//!
//! Kernels are faster with all satellites at hand: sums stay in registers and memory is written once. Runs
//! that share their first and last sample go together; sums of `f32` are in the order of those spans, then in
//! that of arrival.

use std::ops::Range;
use std::sync::Arc;

use super::lanes::Buffers;
use super::pulse::Pulse;
use super::{Kernel, Run, exact, isa};
use crate::fidelity::Arithmetic;

/// Runs, the strips that they read, and scratch of the kernels.
#[derive(Default)]
pub struct Bank {
    bits: Vec<u64>,
    entries: Vec<Entry>,
    buffers: Buffers,
    exact: exact::Scratch,
}

struct Entry {
    /// First sample and end of the run; the segment may end before.
    span: (u64, u64),
    /// Samples of the segment that it makes.
    samples: Range<usize>,
    strip: Range<usize>,
    /// Position among the runs of its ray.
    part: usize,
    /// All but its bits and its pulse.
    run: Run<'static>,
    pulse: Option<Arc<Pulse>>,
}

impl Bank {
    /// Adds a run for `samples` of the segment, part of `span`: `make` appends its signs to the strip that it
    /// is handed and returns everything else but the pulse. `part` is its position among the runs of its ray,
    /// from 0.
    pub fn push(
        &mut self,
        span: (u64, u64),
        part: usize,
        samples: Range<usize>,
        pulse: Option<&Arc<Pulse>>,
        make: impl FnOnce(&mut Vec<u64>) -> Run<'static>,
    ) {
        let begin = self.bits.len();
        let run = make(&mut self.bits);
        self.entries.push(Entry { span, samples, strip: begin..self.bits.len(), part, run, pulse: pulse.cloned() });
    }

    /// Adds the samples of all runs to the planar segment and forgets the runs.
    pub fn render(&mut self, kernel: Kernel<'_>, i: &mut [f32], q: &mut [f32]) {
        self.entries.sort_by_key(|entry| entry.span);
        for entries in self.entries.chunk_by(|a, b| a.span == b.span) {
            let runs: Vec<Run<'_>> = entries
                .iter()
                .map(|Entry { strip, run, pulse, .. }| Run {
                    bits: self.bits.get(strip.clone()).unwrap_or(&[]),
                    pulse: pulse.as_deref(),
                    ..*run
                })
                .collect();
            let Some(samples) = entries.first().map(|entry| entry.samples.clone()) else { continue };
            let (Some(i), Some(q)) = (i.get_mut(samples.clone()), q.get_mut(samples)) else { continue };
            let mut left = runs.as_slice();
            let rays: Vec<&[Run<'_>]> = (entries.chunk_by(|a, b| b.part > 0 && b.run.shares_carrier(&a.run)))
                .filter_map(|ray| left.split_off(..ray.len()))
                .collect();
            let Kernel { edge, arithmetic, level } = kernel;
            match arithmetic {
                Arithmetic::F32 => isa::accumulate(level, edge, &rays, i, q, &mut self.buffers),
                Arithmetic::F64 => isa::accumulate_exact(level, edge, &rays, i, q, &mut self.exact),
            }
        }
        self.entries.clear();
        self.bits.clear();
    }
}
