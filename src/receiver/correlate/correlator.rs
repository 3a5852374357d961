//! The question that a channel asks, and a search that refines its hits, with its answer from samples.
//!
//! Who asks knows the phases and rates of the oscillators, and wants the sums of a replica's taps over an
//! interval. Who answers is a [`Correlator`]. [`Shown`] answers by multiplication of samples.

use num_complex::Complex64;

use super::sums::Samples;
use super::{Arithmetic, Nco, Replica};

/// An interval of samples, counted from the beginning of the stream, and the oscillators of a replica there.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    /// Oscillators at the first sample.
    pub nco: Nco,
    /// Number of the first sample.
    pub from: u64,
    /// Number of the sample after the last one.
    pub to: u64,
}

/// Source of correlations.
pub trait Correlator {
    /// Number of the first sample about which it can be asked.
    fn first(&self) -> u64;
    /// Number of the sample after the last one about which it can be asked.
    fn end(&self) -> u64;
    /// Number of the first sample at which a new channel can begin.
    fn fresh(&self) -> u64;
    /// Σ x·conj(replica) over an interval with the replica at each of `taps`, in code phase units ahead of
    /// the prompt.
    fn sums<const T: usize>(
        &self,
        interval: &Interval,
        replica: &Replica,
        arithmetic: Arithmetic,
        taps: &[i64; T],
    ) -> [Complex64; T];
    /// Mean power of the samples in an interval.
    fn power(&self, from: u64, to: u64) -> f64;
}

/// Samples that a channel is given, in the forms that were made.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Number of the first sample.
    pub first: u64,
    /// All that are shown, those that were shown before among them.
    pub samples: Samples<'a>,
    /// Number of the first sample that was not shown before.
    pub from: u64,
}

impl<'a> Shown<'a> {
    /// Samples from number `first` on, all of them for the first time.
    pub fn whole(first: u64, samples: Samples<'a>) -> Self {
        Self { first, samples, from: first }
    }

    fn part(&self, from: u64, to: u64) -> Samples<'a> {
        self.samples.part(from.saturating_sub(self.first) as usize, to.saturating_sub(self.first) as usize)
    }
}

impl Correlator for Shown<'_> {
    fn first(&self) -> u64 {
        self.first
    }

    fn end(&self) -> u64 {
        self.first + self.samples.count() as u64
    }

    fn fresh(&self) -> u64 {
        self.from
    }

    #[inline]
    fn sums<const T: usize>(
        &self,
        Interval { nco, from, to }: &Interval,
        replica: &Replica,
        arithmetic: Arithmetic,
        taps: &[i64; T],
    ) -> [Complex64; T] {
        replica.correlate_in(arithmetic, self.part(*from, *to), nco, taps)
    }

    fn power(&self, from: u64, to: u64) -> f64 {
        let samples = self.part(from, to);
        samples.power() / samples.count().max(1) as f64
    }
}
