//! A front end as the judge knows it from the scene's facts, one of several or the only one.

use crate::expect::welch::Looks;
use crate::read::Run;
use crate::response::Response;
use crate::waveform::Sampler;
use gnss::facts::{BalanceSpec, FilterSpec, StageSpec, converter, filters};
use gnss::samples::Format;
use gnss::signal::Signal;

/// Facts of a front end.
#[derive(Clone, Debug)]
pub struct FrontEnd<'r> {
    /// Name of the front end, if there are several.
    pub name: Option<&'r str>,
    /// Number of samples.
    pub samples: u64,
    /// Samples a second.
    pub rate_hz: f64,
    /// Radio frequency that appears at 0 Hz in the samples, in Hz.
    pub center_hz: Option<f64>,
    /// True if the samples' spectrum is inverted.
    pub inverted: bool,
    /// Format of the samples, where it is known.
    pub format: Option<Format>,
    /// Sampler of the waveforms.
    pub sampler: Sampler,
    /// Deviation of the noise per component, LSB, where the truth states it.
    pub noise_lsb: Option<f64>,
    /// Stages of the front end, in order.
    pub stages: &'r [StageSpec],
    signals: Option<&'r [String]>,
}

impl<'r> FrontEnd<'r> {
    /// Front end by its index among several, 0 for a single one.
    pub fn of(run: &'r Run, place: usize) -> Self {
        let (scene, sampler) = (&run.scene, run.sampler(place));
        match scene.front_ends.get(place) {
            Some(own) => Self {
                name: own.name.as_deref(),
                samples: own.samples,
                rate_hz: own.sample_rate_hz,
                center_hz: Some(own.center_hz),
                inverted: own.inverted,
                format: own.format.parse().ok(),
                sampler,
                noise_lsb: Some(own.noise_lsb),
                stages: &own.front_end,
                signals: Some(&own.signals),
            },
            None => Self {
                name: None,
                samples: scene.samples,
                rate_hz: scene.sample_rate_hz,
                center_hz: scene.center_hz,
                inverted: scene.inverted,
                format: scene.format.parse().ok(),
                sampler,
                noise_lsb: scene.noise_lsb,
                stages: &scene.front_end,
                signals: None,
            },
        }
    }

    /// True if a signal is in the samples.
    pub fn has(&self, signal: &Signal) -> bool {
        self.signals.is_none_or(|signals| signals.iter().any(|name| name == signal.name))
    }

    /// True if samples have one component.
    pub fn is_real(&self) -> bool {
        self.format.is_some_and(|format| !format.is_complex())
    }

    /// Frequency in the samples of a radio frequency, in Hz.
    pub fn place_hz(&self, on_air_hz: f64) -> f64 {
        let offset_hz = on_air_hz - self.center_hz.unwrap_or(on_air_hz);
        if self.inverted { -offset_hz } else { offset_hz }
    }

    /// True if the converter has levels of its own instead of the format's.
    pub fn is_coarse(&self) -> bool {
        converter(self.stages).is_some_and(|converter| !converter.whole)
    }

    /// True if the level behind the front end is that of the truth. The truth has the image of mixers out of
    /// balance, but not their gain, which gain control removes again.
    pub fn keeps_level(&self) -> bool {
        let unbalanced = self.balance().is_some_and(|balance| balance.image_db.is_some());
        !unbalanced || converter(self.stages).is_some_and(|converter| converter.gain_control)
    }

    /// True if samples of that power, LSB², have fewer than so many deviations of a component to the end of
    /// their format.
    pub fn clips(&self, power_lsb2: f64, deviations: f64) -> bool {
        let components = if self.is_real() { 1.0 } else { 2.0 };
        let full_scale_lsb = self.format.and_then(Format::full_scale_lsb);
        full_scale_lsb.is_some_and(|full| f64::from(full) < deviations * (power_lsb2 / components).sqrt())
            && !self.is_coarse()
    }

    /// Balance of its mixers, where it is stated.
    pub fn balance(&self) -> Option<&BalanceSpec> {
        self.stages.iter().find_map(|stage| if let StageSpec::Iq(balance) = stage { Some(balance) } else { None })
    }

    /// The samples that its spectrum is estimated from.
    pub fn looks(&self, run: &Run) -> Looks {
        Looks::at(self.samples, self.rate_hz, !run.scene.interference.is_empty())
    }
}

impl FrontEnd<'_> {
    /// Filter of the front end, about the carrier of its first signal if the truth does not state the middle.
    pub fn filter_at(&self, first_hz: f64) -> Option<Placed> {
        let filter: &FilterSpec = filters(self.stages).next()?;
        let middle_hz = filter.middle_hz.unwrap_or_else(|| self.place_hz(first_hz));
        Some(Placed { response: Response::of(filter, self.rate_hz), middle_hz, real: self.is_real() })
    }
}

/// A filter about a frequency in the samples, of real ones about both.
#[derive(Clone, Debug)]
pub struct Placed {
    response: Response,
    middle_hz: f64,
    real: bool,
}

impl Placed {
    /// Amplitude at a frequency in the samples.
    pub fn amplitude(&self, f_hz: f64) -> f64 {
        let upper = self.response.gain(f_hz - self.middle_hz);
        if self.real && self.middle_hz != 0.0 {
            // Each side reaches over to the other one.
            (upper + self.response.gain(f_hz + self.middle_hz)).norm()
        } else {
            upper.norm()
        }
    }

    /// Power response at a frequency in the samples: the square of the amplitude.
    pub fn power(&self, f_hz: f64) -> f64 {
        let amplitude = self.amplitude(f_hz);
        amplitude * amplitude
    }
}
