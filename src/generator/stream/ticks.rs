//! When truth is written, and what of it.

use rayon::prelude::*;

use super::GenerateError;
use crate::generator::scene::Scene;
use crate::generator::spoof::Constellation;
use crate::generator::synth::transmitter::Transmitter;
use crate::generator::truth;
use crate::gnss::broadcast::OrbitError;
use crate::gnss::record::TrajectoryRow;

/// The samples at which truth is written.
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

    /// Writes every tick before sample `to`.
    pub fn write(
        &mut self,
        scene: &Scene,
        transmitters: &[Transmitter],
        to: u64,
        truth: &mut truth::Writer,
    ) -> Result<(), GenerateError> {
        let origin = self.origin;
        let rows = |from: &Constellation, sample: u64| -> Result<Vec<truth::Truth>, OrbitError> {
            let found: Result<Vec<_>, _> = transmitters
                .par_iter()
                .filter(|t| t.from.number == from.number && t.in_view(scene, sample))
                .filter_map(|t| {
                    truth::observe(scene, &t.from, t.sv, t.signal, sample, t.in_view_s(scene, sample)).transpose()
                })
                .collect();
            let mut found = found?;
            for (observation, sky, rays) in &mut found {
                observation.sample -= origin;
                sky.sample -= origin;
                rays.iter_mut().for_each(|ray| ray.sample -= origin);
            }
            Ok(found)
        };
        let place = |from: &Constellation, sample: u64| {
            let row = truth::trajectory(scene, from, sample);
            TrajectoryRow { sample: sample - origin, ..row }
        };
        loop {
            let sample = scene.clock.rate.first_sample_at(self.next * self.interval_us, 1_000_000);
            if sample >= to {
                return Ok(());
            }
            let authentic = Constellation::authentic();
            truth.epoch(&place(&authentic, sample), &rows(&authentic, sample)?)?;
            truth.interference(scene, sample, origin)?;
            for spoofer in scene.spoofers.iter().filter(|spoofer| spoofer.on(scene).contains(&sample)) {
                truth.claim(spoofer, &place(spoofer, sample), &rows(spoofer, sample)?)?;
            }
            self.next += 1;
        }
    }
}
