//! Keys of the receiver's hardware, and of a transmitter that plays signals back.

use crate::clock::oscillator::PowerLaw;
use crate::scenario::schema::{Key, flag, integer, number, numbers, table, text, word, words};

pub(crate) const FRONT_END: &[Key] = &[
    text(
        "name",
        "1 to 64 letters, digits, '-' and '_' (it names files)",
        "name of the front end, which names its files and seeds its noise; required with several front ends",
    ),
    number(
        "center_hz",
        1e9,
        3e9,
        "Hz",
        "radio frequency at 0 Hz of the samples; not with if_hz; required with several front ends",
    )
    .or_else("that of the first signal, less if_hz"),
    words(
        "signals",
        "an array of different signals out of the scene's",
        "received signals; required for real samples with center_hz if the scene has several signals",
    )
    .or_else("those of the scene's that reach into its band"),
    number("sample_rate_hz", 1.1e6, 100e6, "Hz", "sample rate").or(2.6e6),
    number("if_hz", -100e6, 100e6, "Hz", "frequency of the first signal's carrier within the samples").or(0.0),
    flag("spectrum_inverted", "inverted spectrum"),
    text(
        "format",
        "one of ci8, cu8, ci16, cf32, ri8, ri16",
        "sample format: c complex, r real; i signed, u unsigned, f float; bits",
    )
    .or_else("ci8"),
    number("noise_lsb", 0.01, 32_767.0, "LSB", "standard deviation of the noise per component, which sets the gain")
        .or_else("28 (8 bits), 512 (16 bits), 1 (cf32)"),
    table("local_oscillator", LOCAL_OSCILLATOR, "As [local_oscillator], for this front end alone."),
    table("filter", FILTER, "As [filter], for this front end alone."),
    table("iq", IQ, "As [iq], for this front end alone."),
    table("adc", ADC, "As [adc], for this front end alone."),
];

pub(crate) const RECEIVER_CLOCK: &[Key] = &[
    number("bias_s", -1.0, 1.0, "s", "offset ahead of GPS time at the start").or(0.0),
    number("drift_sps", -1e-4, 1e-4, "s/s", "rate of the offset").or(0.0),
    number("ageing_per_day", -1e-5, 1e-5, "a day", "rate of the drift").or(0.0),
    number("sensitivity_per_g", -1e-7, 1e-7, "a g", "drift per g of acceleration").or(0.0),
    word("oscillator", || PowerLaw::PRESETS.map(|(name, _)| name).to_vec(), "noise of an oscillator type"),
    numbers("power_law", 5, (-1e-12, 1e-12), "", "noise by coefficients h2, h1, h0, h-1, h-2; not with oscillator"),
];

pub(crate) const PLAYBACK: &[Key] = &[
    integer("bits", 1, 16, "bits of the transmitter: 1, 2, 3, 4, 8, 12 or 16").required(),
    number("load_sigma", 0.1, 100.0, "", "full scale divided by the standard deviation of the played signal").or(4.0),
    number("attenuation_db", 0.0, 100.0, "dB", "attenuation behind the transmitter").or(0.0),
];

pub(crate) const LOCAL_OSCILLATOR: &[Key] = &[
    number("offset_hz", -1e6, 1e6, "Hz", "frequency offset of carriers; codes are not affected").or(0.0),
    number("phase_noise_rad", 0.0, 3.0, "rad", "standard deviation of the phase noise; with phase_noise_bandwidth_hz"),
    number("phase_noise_bandwidth_hz", 1.0, 1e6, "Hz", "bandwidth of the phase noise"),
];

pub(crate) const FILTER: &[Key] = &[
    word("kind", || vec!["brick_wall", "butterworth"], "shape of the filter").required(),
    integer("order", 1, 10, "order of the low-pass; required with kind = \"butterworth\""),
    number(
        "bandwidth_hz",
        1e5,
        60e6,
        "Hz",
        "two-sided bandwidth around the carrier; for complex samples with center_hz around that frequency",
    )
    .required(),
];

pub(crate) const IQ: &[Key] = &[
    number("gain_db", -6.0, 6.0, "dB", "gain of Q relative to I").or(0.0),
    number("phase_deg", -30.0, 30.0, "deg", "deviation of Q from quadrature").or(0.0),
    number("dc_i_lsb", -32_768.0, 32_767.0, "LSB", "DC offset of I").or(0.0),
    number("dc_q_lsb", -32_768.0, 32_767.0, "LSB", "DC offset of Q").or(0.0),
];

pub(crate) const ADC: &[Key] = &[
    integer("bits", 1, 16, "bits of the converter: 1, 2, 3, 4, 8, 12 or 16, at most those of the format").required(),
    number("step_sigma", 1e-4, 10.0, "", "step divided by the standard deviation of the noise")
        .or_else("the step of least loss"),
    number("agc_window_s", 1e-5, 0.1, "s", "averaging time of an automatic gain control").or_else("a fixed gain"),
];
