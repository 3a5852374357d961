//! Front-end stages as written: filter, mixer, balance and converter, and the playback before them.

use super::ScenarioError;
use super::front_end::{FrontEnd, Tuned};
use super::read::Table;
use crate::random::Stream;
use crate::scene::folded_hz;
use crate::stage::Stage;
use crate::stage::converter::Converter;
use crate::stage::filter::{Filter, Shape};
use crate::stage::mixer::{Balance, Oscillator, PhaseNoise};
use crate::synth::RUN_SAMPLES;
use gnss::samples::Format;

/// A filter as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSpec {
    pub shape: Shape,
    pub bandwidth_hz: f64,
}

/// Local oscillator as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OscillatorSpec {
    pub offset_hz: f64,
    /// Standard deviation in rad and bandwidth in Hz of the phase noise.
    pub noise: Option<(f64, f64)>,
}

/// A converter as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConverterSpec {
    pub bits: u32,
    pub step_sigma: f64,
    pub agc_window_s: Option<f64>,
}

/// A playback as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaybackSpec {
    pub bits: u32,
    /// Full scale relative to the standard deviation of the signals that are played.
    pub load_sigma: f64,
    pub attenuation_db: f64,
}

/// Stages between the antenna's connector and the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stages {
    pub oscillator: Option<OscillatorSpec>,
    pub filter: Option<FilterSpec>,
    pub balance: Option<Balance>,
    pub converter: Option<ConverterSpec>,
}

pub(super) fn filter(table: &Table<'_>) -> Result<FilterSpec, ScenarioError> {
    let order = table.integer("order")?;
    let butterworth = table.need_choice("kind", &[("brick_wall", false), ("butterworth", true)])?;
    let shape = match (butterworth, order) {
        (false, None) => Shape::BrickWall,
        (true, Some(order)) => Shape::Butterworth { order: order as u32 },
        (true, None) => return Err(table.bad("order", "an integer from 1 to 10 for kind = \"butterworth\"")),
        (false, Some(_)) => return Err(table.bad("order", "no order for kind = \"brick_wall\"")),
    };
    Ok(FilterSpec { shape, bandwidth_hz: table.need("bandwidth_hz")? })
}

pub(super) fn local_oscillator(table: &Table<'_>) -> Result<OscillatorSpec, ScenarioError> {
    let rms = table.number("phase_noise_rad")?;
    let bandwidth = table.number("phase_noise_bandwidth_hz")?;
    let noise = match (rms, bandwidth) {
        (None, None) => None,
        (Some(rms), Some(bandwidth)) => Some((rms, bandwidth)),
        (Some(_), None) => {
            return Err(table.bad("phase_noise_bandwidth_hz", "a number, because phase_noise_rad is given"));
        }
        (None, Some(_)) => {
            return Err(table.bad("phase_noise_rad", "a number, because phase_noise_bandwidth_hz is given"));
        }
    };
    Ok(OscillatorSpec { offset_hz: table.need("offset_hz")?, noise })
}

pub(super) fn balance(table: &Table<'_>, format: Format) -> Result<Balance, ScenarioError> {
    for key in ["gain_db", "phase_deg", "dc_q_lsb"] {
        if !format.is_complex() && table.has(key) {
            return Err(table.bad(key, format!("nothing, because front_end.format = {format} has no Q")));
        }
    }
    let gain_db = table.need("gain_db")?;
    Ok(Balance {
        gain: libm::expm1(gain_db * std::f64::consts::LN_10 / 20.0),
        phase_rad: table.need("phase_deg")?.to_radians(),
        dc_i_lsb: table.need("dc_i_lsb")? as f32,
        dc_q_lsb: table.need("dc_q_lsb")? as f32,
    })
}

/// Bits that levels of a format have.
fn room(format: Format) -> u32 {
    match format {
        Format::Ci8 | Format::Cu8 | Format::Ri8 => 8,
        Format::Ci16Le | Format::Ri16Le | Format::Cf32Le => 16,
    }
}

fn bits(table: &Table<'_>, key: &str, format: Format) -> Result<u32, ScenarioError> {
    let most = room(format);
    let expected = format!("one of 1, 2, 3, 4, 8, 12, 16, and at most {most} for front_end.format = {format}");
    match table.integer(key)? {
        Some(bits @ (1 | 2 | 3 | 4 | 8 | 12 | 16)) if bits <= u64::from(most) => Ok(bits as u32),
        _ => Err(table.bad(key, expected)),
    }
}

pub(super) fn converter(table: &Table<'_>, format: Format) -> Result<ConverterSpec, ScenarioError> {
    let bits = bits(table, "bits", format)?;
    Ok(ConverterSpec {
        bits,
        step_sigma: table.number("step_sigma")?.unwrap_or_else(|| Converter::best_step_sigma(bits)),
        agc_window_s: table.number("agc_window_s")?,
    })
}

pub(super) fn playback(table: &Table<'_>) -> Result<PlaybackSpec, ScenarioError> {
    Ok(PlaybackSpec {
        bits: bits(table, "bits", Format::Ci16Le)?,
        load_sigma: table.need("load_sigma")?,
        attenuation_db: table.need("attenuation_db")?,
    })
}

impl Stages {
    /// The front end's stages in the order of the hardware. `sigma_lsb` is the thermal noise's deviation, and
    /// `if_hz` where the carrier of its first signal lies.
    ///
    /// # Errors
    /// A filter that cannot be made, in words.
    pub(super) fn in_order(
        &self,
        front_end: &FrontEnd,
        (format, if_hz): (Format, f64),
        seed: u64,
        sigma_lsb: f32,
    ) -> Result<Vec<Box<dyn Stage>>, String> {
        let rate = front_end.rate;
        let mut stages: Vec<Box<dyn Stage>> = Vec::new();
        if let Some(spec) = self.oscillator {
            let stream = Stream::new(seed, "local oscillator");
            let stream = front_end.name.as_ref().map_or(stream, |name| stream.named(name));
            let noise = spec.noise.map(|(rms_rad, hz)| PhaseNoise::new(rms_rad, hz, rate, stream));
            stages.push(Box::new(Oscillator::new(spec.offset_hz, noise, rate)));
        }
        if let Some(FilterSpec { shape, bandwidth_hz }) = self.filter {
            let middle_hz = match front_end.tuned {
                Tuned::Centre { .. } if format.is_complex() => 0.0,
                Tuned::Centre { .. } => if_hz,
                Tuned::If { if_hz } => if_hz,
            };
            let if_hz = folded_hz(middle_hz, rate.hz());
            let filter = Filter::new(shape, bandwidth_hz, rate.hz(), if_hz, !format.is_complex());
            stages.push(Box::new(filter.map_err(|e| e.to_string())?));
        }
        if let Some(balance) = self.balance {
            stages.push(Box::new(balance));
        }
        if let Some(spec) = self.converter {
            let runs = |window_s: f64| (window_s * rate.hz() / RUN_SAMPLES as f64).ceil() as u32;
            // The width that passes the filter is what the converter sees of the noise.
            let passed = self.filter.map_or(1.0, |filter| (filter.bandwidth_hz / rate.hz()).min(1.0).sqrt());
            stages.push(Box::new(Converter {
                bits: spec.bits,
                step_sigma: spec.step_sigma,
                window_runs: spec.agc_window_s.map(runs),
                nominal_lsb: sigma_lsb * passed as f32,
                whole: spec.bits == room(format),
                level_lsb: if format == Format::Cu8 { 0.5 } else { 1.0 },
            }));
        }
        Ok(stages)
    }
}
