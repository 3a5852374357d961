//! Ticks of the truth: the samples at which truth is recorded, and its content.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::GenerateError;
use super::front::Front;
use crate::scene::{Scene, sources};
use crate::spoof::Constellation;
use crate::switches::Source;
use crate::truth::{self, Record, Sink};
use gnss::broadcast::OrbitError;
use gnss::record::{InterferenceRow, TrajectoryRow};
use gnss::satellite::Sv;

/// The samples at which there is truth.
pub(super) struct Ticks {
    next: u64,
    interval_us: u64,
    /// Sample of the scene from which rows count.
    origin: u64,
}

impl Ticks {
    pub fn new(scene: &Scene, origin: u64) -> Result<Self, GenerateError> {
        if !(1e-6..=1e6).contains(&scene.truth_interval_s) {
            return Err(GenerateError::TruthInterval(scene.truth_interval_s));
        }
        let interval_us = (scene.truth_interval_s * 1e6).round() as u64;
        let (whole, fraction) = scene.clock.rate.elapsed(origin);
        let mut next = (whole as u64 * 1_000_000 + (fraction * 1e6) as u64) / interval_us;
        while scene.clock.rate.first_sample_at(next * interval_us, 1_000_000) < origin {
            next += 1;
        }
        Ok(Self { next, interval_us, origin })
    }

    /// Passes every tick before sample `to` of the first of `fronts` to `truth`. All front ends must have
    /// prepared as much.
    ///
    /// # Errors
    /// Errors of orbits, and of a sink that does not take a record.
    pub fn give(&mut self, fronts: &[Front<'_>], to: u64, truth: &mut dyn Sink) -> Result<(), GenerateError> {
        let Some(scene) = fronts.first().map(|front| front.scene) else { return Ok(()) };
        let origin = self.origin;
        let place = |from: &Constellation, sample: u64| {
            let row = truth::trajectory(scene, from, sample);
            TrajectoryRow { sample: sample - origin, ..row }
        };
        loop {
            let at = Tick::new(fronts, self.next * self.interval_us);
            let sample = at.samples.first().copied().unwrap_or(u64::MAX);
            if sample >= to {
                return Ok(());
            }
            let authentic = Constellation::authentic();
            truth.take(Record::Trajectory(place(&authentic, sample)))?;
            for (observation, sky, rays) in rows(fronts, &authentic, &at, origin)? {
                truth.take(Record::Observation(observation))?;
                truth.take(Record::Sky(sky))?;
                rays.into_iter().try_for_each(|ray| truth.take(Record::Ray(ray)))?;
            }
            for (number, (front, source)) in (1..).zip(sources(fronts.iter().map(|front| front.scene))) {
                let row = at.samples.get(front).and_then(|own| source.row(number, *own));
                let Some(row) = row else { continue };
                truth.take(Record::Interference(InterferenceRow { sample: sample - origin, ..row }))?;
            }
            for spoofer in
                scene.spoofers.iter().filter(|spoofer| spoofer.on(scene.clock, &scene.receiver_clock).contains(&sample))
            {
                let number = spoofer.number;
                if scene
                    .switches
                    .as_ref()
                    .is_some_and(|all| all.at(Source::Spoofer(number), all.tick_of(sample)).gain <= 0.0)
                {
                    continue;
                }
                truth.take(Record::Claim { spoofer: number, place: place(spoofer, sample) })?;
                for (observation, ..) in rows(fronts, spoofer, &at, origin)? {
                    truth.take(Record::Spoofed { spoofer: number, observation })?;
                }
            }
            self.next += 1;
        }
    }
}

/// An instant of the truth: the first sample of each front end that is not before it.
struct Tick {
    samples: Vec<u64>,
}

impl Tick {
    fn new(fronts: &[Front<'_>], time_us: u64) -> Self {
        let sample = |(number, front): (usize, &Front<'_>)| {
            let sample = front.scene.clock.rate.first_sample_at(time_us, 1_000_000);
            // The first front end says where the scene ends.
            if number == 0 { sample } else { sample.min(front.part.end.saturating_sub(1)) }
        };
        Self { samples: fronts.iter().enumerate().map(sample).collect() }
    }
}

/// True values of the signals that a constellation sends. Each signal appears once, even if several front
/// ends receive it.
fn rows(fronts: &[Front<'_>], from: &Constellation, at: &Tick, origin: u64) -> Result<Vec<truth::Truth>, OrbitError> {
    let (Some(first), Some(sample)) = (fronts.first(), at.samples.first().copied()) else { return Ok(Vec::new()) };
    let mut known: BTreeSet<(Sv, &str)> = BTreeSet::new();
    let mut sent = Vec::new();
    for (front, own) in fronts.iter().zip(&at.samples) {
        let of_it = front.transmitters.iter().filter(|t| t.from.number == from.number);
        sent.extend(of_it.filter(|t| known.insert((t.sv, t.signal.name))).map(|t| (t, front.scene, *own)));
    }
    // By satellite, as the signals of one front end are.
    sent.sort_by_key(|(t, ..)| t.sv);
    let found: Result<Vec<_>, _> = sent
        .par_iter()
        .filter(|(t, scene, own)| t.in_view(scene, *own))
        .filter_map(|(t, scene, own)| {
            let (link, at) = ((t.sv, t.signal), (sample, t.in_view_s(scene, *own)));
            truth::observe_by(first.scene, &t.from, link, at, t.geometry.as_deref()).transpose()
        })
        .collect();
    let mut found = found?;
    for (observation, sky, rays) in &mut found {
        observation.sample -= origin;
        sky.sample -= origin;
        rays.iter_mut().for_each(|ray| ray.sample -= origin);
    }
    Ok(found)
}
