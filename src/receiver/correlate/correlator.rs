//! The question that a channel asks, and its answer from samples or from a model.
//!
//! A channel knows the phases and rates of its oscillators, and asks for the sums of a replica's taps over an
//! interval. Whoever answers is a [`Correlator`]. [`Shown`] answers by multiplication of samples, [`Span`]
//! asks a [`Model`], which computes what such a multiplication gives. A model answers several code periods at
//! once for less: the oscillators keep their steps until the next update of the loops ([`super::ahead`]).

use num_complex::Complex64;

use super::sums::Samples;
use super::{Arithmetic, Edge, Nco, Replica};
use gnss::signal::{Component, Layers, Link};

/// Code of a replica, and the way in which the replica is made.
#[derive(Clone, Copy, Debug)]
pub struct Code {
    /// Satellite and signal.
    pub link: Link,
    /// Component of the signal.
    pub component: &'static Component,
    /// Index of the segment of a long code, if the replica is one.
    pub segment: Option<u64>,
    /// Layers of the component that the replica has.
    pub waveform: Layers,
    /// Rule that assigns chips to samples.
    pub edge: Edge,
}

impl Code {
    /// Whole code of a component, in a waveform with an edge rule.
    pub fn new(link: Link, component: &'static Component, (waveform, edge): (Layers, Edge)) -> Self {
        Self { link, component, segment: None, waveform, edge }
    }
}

/// Replica with its code.
#[derive(Clone, Debug)]
pub struct Coded {
    /// Replica.
    pub replica: Replica,
    /// Code of the replica.
    pub code: Code,
}

/// An interval of samples, counted from the beginning of the stream, and the oscillators of a replica there.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    /// Oscillators at the first sample.
    pub nco: Nco,
    /// Number of the first sample.
    pub from: u64,
    /// Number of the sample after the last one.
    pub to: u64,
    /// Number of the sample after the last one of the code period of which the interval is a part.
    pub end: u64,
}

/// Source of correlations.
pub trait Correlator {
    /// Number of the first sample about which it can be asked.
    fn first(&self) -> u64;
    /// Number of the sample after the last one about which it can be asked.
    fn end(&self) -> u64;
    /// Number of the first sample at which a new channel can begin.
    fn fresh(&self) -> u64;
    /// Number of the sample up to which code periods are better asked about together; zero where one by one
    /// costs the same.
    fn together(&self) -> u64;
    /// Σ x·conj(replica) over an interval with the replica at each of `taps`, in code phase units ahead of
    /// the prompt.
    fn sums<const T: usize>(
        &self,
        interval: &Interval,
        coded: &Coded,
        arithmetic: Arithmetic,
        taps: &[i64; T],
    ) -> [Complex64; T] {
        let mut sums = [[Complex64::ZERO; T]];
        self.sums_of(std::slice::from_ref(interval), coded, arithmetic, taps, &mut sums);
        sums[0]
    }
    /// [`Self::sums`] of each of several intervals that follow one another with the same steps of the
    /// oscillators, as many as `sums` are.
    fn sums_of<const T: usize>(
        &self,
        intervals: &[Interval],
        coded: &Coded,
        arithmetic: Arithmetic,
        taps: &[i64; T],
        sums: &mut [[Complex64; T]],
    );
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

    fn together(&self) -> u64 {
        0
    }

    #[inline]
    fn sums_of<const T: usize>(
        &self,
        intervals: &[Interval],
        coded: &Coded,
        arithmetic: Arithmetic,
        taps: &[i64; T],
        sums: &mut [[Complex64; T]],
    ) {
        for (Interval { nco, from, to, .. }, sums) in intervals.iter().zip(sums) {
            *sums = coded.replica.correlate_in(arithmetic, self.part(*from, *to), nco, taps);
        }
    }

    fn power(&self, from: u64, to: u64) -> f64 {
        let samples = self.part(from, to);
        samples.power() / samples.count().max(1) as f64
    }
}

/// Model of correlations, in place of samples. Its answers depend on the question alone.
pub trait Model: Sync {
    /// Number of the sample after the last one for which the model is made.
    fn end(&self) -> u64;
    /// Adds the sums of a replica over intervals, as [`Correlator::sums_of`] gives them: for each interval
    /// one for each tap.
    fn sums(&self, intervals: &[Interval], code: &Code, taps: &[i64], sums: &mut [Complex64]);
    /// Mean power of the samples in an interval.
    fn power(&self, from: u64, to: u64) -> f64;
    /// Largest cell of a search.
    fn search(&self, sought: &Sought) -> Cell;
}

impl std::fmt::Debug for dyn Model + '_ {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Model")
    }
}

/// Search for one satellite's signal.
#[derive(Clone, Copy, Debug)]
pub struct Sought<'a> {
    /// Code that leads the signal.
    pub code: Code,
    /// Code beside it whose powers are added, if there is one.
    pub beside: Option<Code>,
    /// Number of the first sample.
    pub first: u64,
    /// First sample of each coherent sum, counted from the first one.
    pub begins: &'a [f64],
    /// Samples of a coherent sum.
    pub samples: f64,
    /// Dopplers, in hertz, at equal steps.
    pub dopplers_hz: &'a [f64],
    /// Distance of delays, in chips. There is another cell between any two.
    pub lag_chips: f64,
    /// Independent cells of a Doppler.
    pub cells: usize,
}

/// Largest cell of a search.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Sum of powers, in units in which noise alone is chi-square with two degrees of freedom a power.
    pub statistic: f64,
    /// Doppler of the cell, in hertz.
    pub doppler_hz: f64,
    /// Code phase of the cell at the first sample, in chips.
    pub code_phase_chips: f64,
}

/// Interval of samples for which a model answers.
#[derive(Clone, Copy, Debug)]
pub struct Span<'a> {
    /// Number of the first sample that is new.
    pub first: u64,
    /// Number of the sample after the last one.
    pub end: u64,
    /// Model.
    pub model: &'a dyn Model,
}

impl Correlator for Span<'_> {
    fn first(&self) -> u64 {
        0
    }

    fn end(&self) -> u64 {
        self.end
    }

    fn fresh(&self) -> u64 {
        self.first
    }

    fn together(&self) -> u64 {
        self.model.end()
    }

    fn sums_of<const T: usize>(
        &self,
        intervals: &[Interval],
        coded: &Coded,
        _: Arithmetic,
        taps: &[i64; T],
        sums: &mut [[Complex64; T]],
    ) {
        sums.fill([Complex64::ZERO; T]);
        self.model.sums(intervals, &coded.code, taps, sums.as_flattened_mut());
    }

    fn power(&self, from: u64, to: u64) -> f64 {
        self.model.power(from, to)
    }
}
