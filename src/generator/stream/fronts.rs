//! Several front ends at once: the samples of each, and one common truth.
//!
//! Slices of time are made one after the other, of every front end the samples that lie in them. The bytes of
//! a front end are those that it has alone, since each keeps to the grid of its own samples. The truth counts
//! samples of the first front end. Limits: whole scenes, no parts of them.

use std::collections::BTreeSet;
use std::io;

use super::front::{Front, share_geometry};
use super::ticks::Ticks;
use super::{GenerateError, Generated, Options, end};
use crate::geometry::is_shared;
use crate::scene::Scene;
use crate::synth::RUN_SAMPLES;
use crate::transmit::Transmitter;
use crate::truth::Sink;
use gnss::record::PassRow;
use gnss::signal::Link;
use gnss::time::Rate;

/// Streams of the front ends of a scene.
pub struct Fronts<'a> {
    fronts: Vec<Front<'a>>,
    ticks: Ticks,
    /// Length of a slice, in samples of the first front end.
    slice: u64,
}

/// Truth of signals that were prepared, which waits for its sink.
pub struct Due<'f, 'a> {
    fronts: &'f [Front<'a>],
    ticks: &'f mut Ticks,
    to: u64,
}

impl Due<'_, '_> {
    /// Passes the true values to `truth`.
    ///
    /// # Errors
    /// [`GenerateError`] of orbits, and of a sink that does not take the truth.
    pub fn give(self, truth: &mut dyn Sink) -> Result<(), GenerateError> {
        self.ticks.give(self.fronts, self.to, truth)
    }
}

/// Samples of one front end at which a slice ends.
struct Ends {
    prepared: u64,
    rendered: u64,
}

impl<'a> Fronts<'a> {
    /// Creates the streams of `scenes`, which were composed from one scenario, and passes their facts to
    /// `truth`.
    ///
    /// # Errors
    /// A rate that signals cannot have, a sink that does not take the truth.
    pub fn new(scenes: &'a [Scene], truth: &mut dyn Sink, options: &Options) -> Result<Self, GenerateError> {
        let fronts: Result<Vec<Front<'a>>, _> =
            scenes.iter().map(|scene| Front::new(scene, 0..scene.samples, options)).collect();
        let (mut fronts, Some(first)) = (fronts?, scenes.first()) else { return Err(GenerateError::NoFrontEnd) };
        if scenes.iter().all(|scene| is_shared(first, scene)) {
            share_geometry(&mut fronts);
        }
        truth.begin(scenes, &(0..first.samples))?;
        // The shortest batch bounds the memory; a slice with less than a block would render its lead again
        // and again.
        let seconds = |front: &Front<'_>, samples: u64| samples as f64 / front.scene.clock.rate.hz();
        let batch_s = fronts.iter().fold(f64::INFINITY, |least, front| least.min(seconds(front, front.batch)));
        let slice_s = fronts.iter().fold(batch_s, |most, front| most.max(seconds(front, front.block)));
        let slice = ((slice_s * first.clock.rate.hz()) as u64).next_multiple_of(RUN_SAMPLES as u64);
        Ok(Self { ticks: Ticks::new(first, 0)?, fronts, slice })
    }

    /// Number of samples of the first front end that were made so far.
    pub fn samples(&self) -> u64 {
        self.fronts.first().map_or(0, Front::samples)
    }

    /// Makes the next slice of time. It passes the bytes of each front end, by its number, to `sink`, and the
    /// true values to `truth`. Returns `false` after the last sample.
    ///
    /// # Errors
    /// [`GenerateError`] of orbits, messages and truth, and what `sink` meets.
    pub fn next(
        &mut self,
        truth: &mut dyn Sink,
        packed: &mut Vec<u8>,
        sink: &mut dyn FnMut(usize, &[u8]) -> io::Result<()>,
    ) -> Result<bool, GenerateError> {
        self.fronts.iter().try_for_each(|front| front.scene.has_samples())?;
        let Some(ends) = self.ends() else { return Ok(false) };
        for (front, end) in self.fronts.iter_mut().zip(&ends) {
            front.prepare(end.prepared)?;
        }
        if let Some(end) = ends.first() {
            self.ticks.give(&self.fronts, end.rendered, truth)?;
        }
        for (number, (front, Ends { rendered: to, .. })) in self.fronts.iter_mut().zip(ends).enumerate() {
            while front.is_before(to) {
                front.render(front.batch_end().min(to), packed);
                sink(number, packed)?;
            }
        }
        Ok(true)
    }

    /// Prepares the signals of each front end from its sample of `needed` on, up to sample `to` of the first
    /// one, and passes the true values before it to `truth`. Earlier signals are dropped, and no samples are
    /// made. Messages are prepared of links that are `heard`.
    ///
    /// # Errors
    /// [`GenerateError`] of orbits, messages and truth.
    pub fn pass(
        &mut self,
        needed: &[u64],
        to: u64,
        heard: &(dyn Fn(Link) -> bool + Sync),
        truth: &mut dyn Sink,
    ) -> Result<(), GenerateError> {
        self.prepare(needed, to, heard)?;
        self.prepared(to).1.give(truth)
    }

    /// [`Self::pass`] without the truth, which [`Self::prepared`] gives.
    ///
    /// # Errors
    /// [`GenerateError`] of orbits and messages.
    pub fn prepare(
        &mut self,
        needed: &[u64],
        to: u64,
        heard: &(dyn Fn(Link) -> bool + Sync),
    ) -> Result<(), GenerateError> {
        let Some((count, seconds)) = self.fronts.first().map(|first| first.scene.clock.rate.ratio()) else {
            return Ok(());
        };
        for (number, (front, needed)) in self.fronts.iter_mut().zip(needed).enumerate() {
            // Instants of the truth before `to` have their sample in every front end.
            let own = if number == 0 { to } else { front.scene.clock.rate.first_sample_at(to * seconds, count) + 1 };
            front.pass(*needed, own.min(front.part.end), heard)?;
        }
        Ok(())
    }

    /// Signals of each front end that were prepared, and the truth that is due before sample `to` of the
    /// first one.
    pub fn prepared(&mut self, to: u64) -> (Vec<&[Transmitter]>, Due<'_, 'a>) {
        let Self { fronts, ticks, .. } = self;
        let transmitters = fronts.iter().map(|front| front.transmitters.as_slice()).collect();
        (transmitters, Due { fronts, ticks, to })
    }

    /// Signals of each front end that were prepared.
    pub fn transmitters(&self) -> impl Iterator<Item = &[Transmitter]> {
        self.fronts.iter().map(|front| front.transmitters.as_slice())
    }

    /// End of the next slice for every front end; `None` if nothing is left.
    fn ends(&self) -> Option<Vec<Ends>> {
        let first = self.fronts.first()?;
        let to = first.end_after(self.slice);
        let (count, seconds) = first.scene.clock.rate.ratio();
        let end = |(number, front): (usize, &Front<'_>)| {
            if number == 0 || to >= first.part.end {
                let to = if number == 0 { to } else { front.part.end };
                return Ends { prepared: to, rendered: to };
            }
            // Rendered are whole runs, so that no front end gets ahead of the truth; prepared is a sample
            // more than the slice holds, so that every instant of the truth in it has its sample.
            let at = front.scene.clock.rate.first_sample_at(to * seconds, count).min(front.part.end);
            let rendered = at / RUN_SAMPLES as u64 * RUN_SAMPLES as u64;
            Ends { prepared: (at + 1).min(front.part.end), rendered }
        };
        let ends: Vec<Ends> = self.fronts.iter().enumerate().map(end).collect();
        first.is_before(to).then_some(ends)
    }

    /// Passes the remaining truth to `truth`, and returns the summary of each front end.
    ///
    /// # Errors
    /// A sink that does not take the truth.
    pub fn finish(mut self, truth: &mut dyn Sink) -> Result<Vec<Generated>, GenerateError> {
        let mut navigation = BTreeSet::new();
        self.fronts.iter_mut().for_each(|front| navigation.append(&mut front.navigation()));
        let rate = self.fronts.first().map_or(Rate::MEGAHERTZ, |first| first.scene.clock.rate);
        end(truth, rate, navigation, self.passes())?;
        Ok(self.fronts.iter().map(Front::done).collect())
    }

    /// Passes of the satellites, by the numbers of the first front end's samples: each satellite once.
    fn passes(&self) -> BTreeSet<PassRow> {
        let (mut rows, mut known) = (BTreeSet::new(), BTreeSet::new());
        let Some(first) = self.fronts.first() else { return rows };
        for front in &self.fronts {
            let rate = front.scene.clock.rate;
            // Views begin and end with seconds, or with the scene.
            let counted = |sample: u64| match sample {
                end if end == front.part.end => first.part.end,
                sample => first.scene.clock.rate.first_sample_at(rate.elapsed(sample).0 as u64, 1),
            };
            let new: Vec<PassRow> = front.passes().filter(|row| !known.contains(&row.sv)).collect();
            known.extend(new.iter().map(|row| row.sv));
            rows.extend(new.into_iter().map(|row| PassRow {
                sample: counted(row.sample),
                until_sample: counted(row.until_sample),
                ..row
            }));
        }
        rows
    }
}
