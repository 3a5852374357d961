//! Power of the tracked satellites' codes in the bins of a spectrum.
//!
//! A segment is hardly longer than a code period of C/A, whose lines lie further apart than a bin. One bin
//! therefore holds more of the satellites' power than the next. Under ten satellites of 46 dB-Hz the bins
//! have 0.35 of the noise from them in the mean, and some bins 0.9, which is 1.4 times the power beside. A
//! spectrum then passes a threshold for even density 12 times as often as meant at 1e-6, and 38 times at
//! 1e-8.
//!
//! Code, phase and Doppler of a channel give its share of every bin exactly, because segments are whole code
//! periods apart. The satellites' phases to one another are random from one segment to the next, so that
//! powers add.
//!
//! Limits: symbols that turn within a segment spread the lines. Only the strongest layer of a pulse is
//! counted, and only signals that are tracked.

use fft::Fft;
use num_complex::Complex;

use crate::correlate::Wave;
use gnss::samples::IfMetadata;
use gnss::signal::Link;

/// A satellite that is followed.
#[derive(Clone, Copy, Debug)]
pub struct Followed {
    /// Satellite and signal of the channel.
    pub link: Link,
    /// C/N0 of the whole signal, in hertz.
    pub cn0_hz: f64,
    /// Positive when approaching.
    pub doppler_hz: f64,
    /// Sample at which a code period has advanced by `chips`.
    pub sample: u64,
    /// Phase of the codes there.
    pub chips: f64,
}

/// Power of the satellites in every bin of windowed segments that begin at `first`, in units of the noise's.
pub(super) fn shares(
    followed: &[Followed],
    (metadata, first): (&IfMetadata, u64),
    (fft, window): (&dyn Fft<f32>, &[f32]),
) -> Vec<f64> {
    let rate_hz = metadata.rate.hz();
    let energy: f64 = window.iter().map(|w| f64::from(w * w)).sum();
    let sense = if metadata.inverted { -1.0 } else { 1.0 };
    let mut shares = vec![0.0; window.len()];
    let mut segment = vec![Complex::default(); window.len()];
    for one in followed {
        let carrier_hz = one.link.carrier_hz();
        for component in one.link.signal.components {
            let side_hz = component.side_hz();
            let doppler_hz = one.doppler_hz * (1.0 + side_hz / carrier_hz);
            let turns = (metadata.if_hz(carrier_hz + side_hz) + sense * doppler_hz) / rate_hz;
            let Some(wave) = Wave::new(component, one.link.sv.number) else { continue };
            let chips_per_sample = component.chip_rate_hz * (1.0 + one.doppler_hz / carrier_hz) / rate_hz;
            let begins = one.chips + (first as f64 - one.sample as f64) * chips_per_sample;
            let length = wave.values.len() as f64;
            for (n, (sample, weight)) in segment.iter_mut().zip(window).enumerate() {
                let chips = begins + (n as f64 + 0.5) * chips_per_sample;
                let step = (chips * wave.steps_per_chip as f64).rem_euclid(length) as usize;
                let value = wave.values.get(step).copied().unwrap_or(0);
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * (turns * n as f64).fract());
                *sample = Complex::new(cos as f32, sin as f32) * (f32::from(value) * weight);
            }
            fft.process(&mut segment);
            let scale = one.cn0_hz * component.power_share / wave.share / rate_hz / energy;
            shares.iter_mut().zip(&segment).for_each(|(sum, x)| *sum += scale * f64::from(x.norm_sqr()));
        }
    }
    shares
}
