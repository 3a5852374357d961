//! Keys of the receiver's hardware, and of a transmitter that plays signals back.

use crate::clock::oscillator::PowerLaw;
use crate::scenario::schema::{Key, flag, integer, number, numbers, table, text, word, words};

pub(crate) const FRONT_END: &[Key] = &[
    text(
        "name",
        "1 to 64 letters, digits, '-' and '_' (it names files)",
        "name of the front end: names its files and keys what is random about it; required where there are several",
    ),
    number(
        "center_hz",
        1e9,
        3e9,
        "Hz",
        "the radio frequency at 0 Hz of the samples; not beside if_hz, required where there are several",
    )
    .or_else("that of the first signal, less if_hz"),
    words(
        "signals",
        "an array of different signals out of the scene's",
        "the signals that it is for; of real samples with center_hz required where the scene has several",
    )
    .or_else("those of the scene's that reach into its band"),
    number("sample_rate_hz", 1.1e6, 100e6, "Hz", "sample rate").or(2.6e6),
    number("if_hz", -100e6, 100e6, "Hz", "where the carrier of the first signal appears in the samples").or(0.0),
    flag("spectrum_inverted", "whether frequencies run downwards"),
    text(
        "format",
        "one of ci8, cu8, ci16, cf32, ri8, ri16",
        "of the samples: c complex, r real; signed, unsigned, float; bits",
    )
    .or_else("ci8"),
    number("noise_lsb", 0.01, 32_767.0, "LSB", "deviation of the noise per component: the gain")
        .or_else("28 (8 bits), 512 (16 bits), 1 (cf32)"),
    table("local_oscillator", LOCAL_OSCILLATOR, "As [local_oscillator], of this front end alone."),
    table("filter", FILTER, "As [filter], of this front end alone."),
    table("iq", IQ, "As [iq], of this front end alone."),
    table("adc", ADC, "As [adc], of this front end alone."),
];

pub(crate) const RECEIVER_CLOCK: &[Key] = &[
    number("bias_s", -1.0, 1.0, "s", "ahead of GPS time at the start").or(0.0),
    number("drift_sps", -1e-4, 1e-4, "s/s", "growth of that").or(0.0),
    number("ageing_per_day", -1e-5, 1e-5, "a day", "growth of the drift").or(0.0),
    number("sensitivity_per_g", -1e-7, 1e-7, "a g", "drift for a g of acceleration").or(0.0),
    word("oscillator", || PowerLaw::PRESETS.map(|(name, _)| name).to_vec(), "noise of the oscillator, by name"),
    numbers(
        "power_law",
        5,
        (-1e-12, 1e-12),
        "",
        "noise of the oscillator: h2, h1, h0, h-1, h-2; not beside oscillator",
    ),
];

pub(crate) const PLAYBACK: &[Key] = &[
    integer("bits", 1, 16, "of the transmitter: 1, 2, 3, 4, 8, 12 or 16").required(),
    number("load_sigma", 0.1, 100.0, "", "full scale over the deviation of what is played").or(4.0),
    number("attenuation_db", 0.0, 100.0, "dB", "behind the transmitter").or(0.0),
];

pub(crate) const LOCAL_OSCILLATOR: &[Key] = &[
    number("offset_hz", -1e6, 1e6, "Hz", "by which carriers are off and codes are not").or(0.0),
    number("phase_noise_rad", 0.0, 3.0, "rad", "deviation of its phase; with phase_noise_bandwidth_hz"),
    number("phase_noise_bandwidth_hz", 1.0, 1e6, "Hz", "bandwidth of that noise"),
];

pub(crate) const FILTER: &[Key] = &[
    word("kind", || vec!["brick_wall", "butterworth"], "shape").required(),
    integer("order", 1, 10, "of the low-pass; required with kind = \"butterworth\""),
    number(
        "bandwidth_hz",
        1e5,
        60e6,
        "Hz",
        "both sides of the carrier together; of complex samples with center_hz, both sides of that",
    )
    .required(),
];

pub(crate) const IQ: &[Key] = &[
    number("gain_db", -6.0, 6.0, "dB", "gain of Q over I").or(0.0),
    number("phase_deg", -30.0, 30.0, "deg", "by which Q is not square to I").or(0.0),
    number("dc_i_lsb", -32_768.0, 32_767.0, "LSB", "direct current of I").or(0.0),
    number("dc_q_lsb", -32_768.0, 32_767.0, "LSB", "direct current of Q").or(0.0),
];

pub(crate) const ADC: &[Key] = &[
    integer("bits", 1, 16, "of the converter: 1, 2, 3, 4, 8, 12 or 16, and no more than the format has").required(),
    number("step_sigma", 1e-4, 10.0, "", "step over the noise's deviation").or_else("the step of least loss"),
    number("agc_window_s", 1e-5, 0.1, "s", "time over which a controlled gain measures").or_else("a fixed gain"),
];
