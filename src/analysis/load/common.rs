//! What all satellites' signals have in common in the samples beside the receiver's clock, as the truth knows it.
//!
//! A front end's filter delays every code by its group delay; a local oscillator off its frequency shifts
//! every carrier; an antenna that turns winds up every carrier. A receiver that measures them is right: they
//! are part of the truth. The first two are facts of the scene, the third is what the truth's carriers do
//! beside its pseudoranges on average. Limits: the mean of carrier less pseudorange holds twice the
//! ionosphere's rate too, millimetres a second.

use std::collections::HashMap;

use super::{SceneFacts, delay};
use crate::analysis::errors::Link;
use crate::gnss::record::Observation;
use crate::gnss::signal::SIGNALS;

/// What the ionosphere may make of a carrier less its pseudorange, metres a second.
const LEAST_WOUND_MPS: f64 = 0.02;

/// Delay of every code in the front end; of the first signal where there are several.
fn code_delay_s(scene: &SceneFacts, spacing_chips: f64) -> f64 {
    let component = SIGNALS.first().and_then(|signal| signal.components.first());
    let chip_rate_hz = component.map_or(1.0, |component| component.chip_rate_hz);
    let of = |stage| delay::code_delay_s(stage, chip_rate_hz, scene.sample_rate_hz, spacing_chips);
    scene.front_end.iter().filter_map(of).sum()
}

/// The common part.
#[derive(Clone, Debug, Default)]
pub struct Common {
    /// Delay of every code.
    pub code_delay_s: f64,
    /// By how much every Doppler is higher.
    pub doppler_hz: f64,
    last: HashMap<Link, (u64, f64)>,
    /// Sum and number, by epoch, of what each satellite's carrier gained on its pseudorange since the epoch
    /// before, in metres a sample.
    gains: HashMap<u64, (f64, u32)>,
    rate_hz: f64,
}

impl Common {
    /// From a scene's facts, for a code loop of that spacing.
    pub(super) fn of(scene: &SceneFacts, spacing_chips: f64) -> Self {
        let sum =
            |of: fn(&crate::analysis::spectrum::Stage) -> Option<f64>| scene.front_end.iter().filter_map(of).sum();
        let offset_hz: f64 = sum(|stage| stage.offset_hz);
        Self {
            code_delay_s: code_delay_s(scene, spacing_chips),
            doppler_hz: if scene.inverted { -offset_hz } else { offset_hz },
            rate_hz: scene.sample_rate_hz,
            ..Self::default()
        }
    }

    /// The same for a loop of another spacing.
    pub(super) fn set_spacing(&mut self, scene: &SceneFacts, spacing_chips: f64) {
        self.code_delay_s = code_delay_s(scene, spacing_chips);
    }

    /// Counts a row of the truth in.
    pub(super) fn add(&mut self, row: &Observation) {
        let apart_m = row.carrier_cycles * row.signal.wavelength_m(row.sv) - row.pseudorange_m;
        let before = self.last.insert(row.link(), (row.sample, apart_m));
        if let Some((sample, before_m)) = before.filter(|(sample, _)| row.sample > *sample) {
            let (sum, count) = self.gains.entry(row.sample).or_default();
            (*sum, *count) = (*sum + (apart_m - before_m) / (row.sample - sample) as f64, *count + 1);
        }
    }

    /// Carrier that an oscillator's offset takes from every satellite until a sample, in cycles (carriers
    /// grow with range).
    pub fn carrier_cycles(&self, sample: u64) -> f64 {
        -self.doppler_hz * sample as f64 / self.rate_hz
    }

    /// Rate at which carriers gain on pseudoranges at a sample, wind-up and oscillator together: metres a
    /// second that a clock solved from Dopplers drifts more than the clock does.
    pub fn drift_mps(&self, sample: u64, wavelength_m: f64) -> f64 {
        let both = self.gains.get(&sample).map_or(0.0, |(sum, count)| sum / f64::from(*count) * self.rate_hz);
        both - self.doppler_hz * wavelength_m
    }

    /// The part of it that an antenna's turning makes: a millimetre a second and less is the ionosphere's.
    pub fn wound_mps(&self, sample: u64, wavelength_m: f64) -> f64 {
        let wound = self.drift_mps(sample, wavelength_m) + self.doppler_hz * wavelength_m;
        if wound.abs() > LEAST_WOUND_MPS { wound } else { 0.0 }
    }
}
