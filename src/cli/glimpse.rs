//! Glimpse of the samples of a run: those after one instant of the truth, for the correlation peaks.
//!
//! The instant is the last one before the middle of the scene, or before its last 40 ms. It depends neither
//! on threads nor on how the samples come.

use std::ops::Range;

use analysis::measure::peaks::{GLIMPSE_S, Glimpse};
use analysis::read::PeakRow;
use generator::scene::Scene;
use generator::truth::{self, Record, TruthError};
use gnss::facts::{self, StageSpec};
use gnss::record::Observation;

/// Instant of the truth whose observations are kept.
pub struct Moment {
    time_us: u64,
    /// Sample of the instant in the first front end.
    sample: u64,
    observations: Vec<Observation>,
}

impl Moment {
    /// The instant for a scene; its first front end of several.
    pub fn of(scene: &Scene) -> Self {
        let duration_s = scene.clock.rate.elapsed_s(scene.samples);
        let latest_us = (1e6 * (0.5 * duration_s).min(duration_s - GLIMPSE_S)).max(0.0) as u64;
        let interval_us = ((scene.truth_interval_s * 1e6).round() as u64).max(1);
        let time_us = latest_us - latest_us % interval_us;
        Self { time_us, sample: first_sample(scene, time_us), observations: Vec::new() }
    }

    /// Samples of a front end after the instant.
    pub fn samples(&self, scene: &Scene) -> Range<u64> {
        let first = first_sample(scene, self.time_us);
        first..first + (GLIMPSE_S * scene.clock.rate.hz()) as u64
    }

    /// Peaks of a front end's signals in those samples, as bytes: of those that no front end before had.
    pub fn peaks(&mut self, first: &Scene, scene: &Scene, bytes: &[u8]) -> Vec<PeakRow> {
        let stages: Vec<StageSpec> = scene.front_end.iter().filter_map(|stage| stage.spec()).collect();
        let delay_s: f64 = facts::filters(&stages).map(|filter| filter.group_delay_s).sum();
        let since_s = scene.clock.rate.elapsed_s(first_sample(scene, self.time_us));
        let offset_hz = facts::oscillator_offset_hz(&stages);
        let (mut i, mut q) = (Vec::new(), Vec::new());
        scene.metadata.format.unpack(bytes, &mut i, &mut q);
        let glimpse = Glimpse {
            metadata: scene.metadata.clone(),
            doppler_hz: if scene.metadata.inverted { -offset_hz } else { offset_hz },
            later_s: since_s - first.clock.rate.elapsed_s(self.sample) - delay_s,
            i,
            q,
        };
        let (own, rest) =
            std::mem::take(&mut self.observations).into_iter().partition(|row| scene.signals.contains(&row.signal));
        self.observations = rest;
        glimpse.peaks(&own)
    }
}

fn first_sample(scene: &Scene, time_us: u64) -> u64 {
    scene.clock.rate.first_sample_at(time_us, 1_000_000)
}

impl truth::Sink for Moment {
    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        match record {
            Record::Observation(row) if row.sample == self.sample => self.observations.push(row),
            _ => {}
        }
        Ok(())
    }
}
