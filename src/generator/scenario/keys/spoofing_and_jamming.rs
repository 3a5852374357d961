//! Keys of `[[interference]]` and `[[spoofer]]`.

use super::motion::{MOTION, PLACE, PLACE_IF_ANY};
use super::{A_PATH, LONGEST_S, SATELLITES};
use crate::scenario::osnma::spoofed_names;
use crate::scenario::schema::{Key, flag, number, table, text, texts, time, word, words};

const SWEEP: &[&str] = &["chirp", "fmcw"];
const FM: &[&str] = &["sine_fm"];
const PULSE: &[&str] = &["pulse"];
const RECORDING: &[&str] = &["recording"];

pub(crate) fn kinds() -> Vec<&'static str> {
    vec!["cw", "chirp", "fmcw", "sine_fm", "pulse", "matched", "noise", "recording"]
}

pub(crate) const INTERFERENCE: &[Key] = &[
    word("kind", kinds, "waveform of the interference").required(),
    number("center_hz", 1e9, 3e9, "Hz", "radio frequency of its centre; not with offset_hz")
        .or_else("that of GPS L1, plus offset_hz"),
    number("offset_hz", -1e9, 1e9, "Hz", "offset of its centre from GPS L1").or(0.0),
    number(
        "js_db",
        -100.0,
        120.0,
        "dB",
        "power relative to a satellite at the antenna port, at the scene's start: relative to power.cn0_dbhz, or \
         with a link budget relative to the direct ray of the strongest satellite in view (`gnss-twin plan` names \
         it)",
    ),
    number("power_dbw", -250.0, 0.0, "dBW", "power at the antenna port; needs a link budget"),
    number("eirp_dbw", -200.0, 60.0, "dBW", "radiated power at its position, or at distance_m; needs a link budget"),
    number("distance_m", 1.0, 1e9, "m", "constant distance in place of a position: free-space loss without Doppler")
        .or_else("from its position"),
    number("on_s", 0.0, LONGEST_S, "s", "begin, in true time since the scene's start").or(0.0),
    number("off_s", 0.0, LONGEST_S, "s", "end, in true time since the scene's start").or_else("never"),
    PLACE_IF_ANY[0],
    PLACE_IF_ANY[1],
    PLACE_IF_ANY[2],
    number("sweep_hz", -1e8, 1e8, "Hz", "width of the sweep; negative for a downward sweep").required().of(SWEEP),
    number("sweep_s", 1e-6, 10.0, "s", "duration of a sweep").required().of(SWEEP),
    number("deviation_hz", 0.0, 5e7, "Hz", "frequency deviation").required().of(FM),
    number("rate_hz", 0.01, 1e6, "Hz", "modulation or pulse rate").required().of(&["sine_fm", "pulse"]),
    number("width_s", 1e-8, 10.0, "s", "duration of a pulse").required().of(PULSE),
    number("jitter", 0.0, 1.0, "of a period", "largest random delay of a pulse").or(0.0).of(PULSE),
    number("bandwidth_hz", 100.0, 1e9, "Hz", "bandwidth of the noise").required().of(&["noise"]),
    text("file", A_PATH, "recording to play").required().of(RECORDING),
    text("format", "one of ci8, cu8, ci16, cf32", "sample format of the recording").required().of(RECORDING),
    number("sample_rate_hz", 1e3, 1e8, "Hz", "sample rate of the recording").required().of(RECORDING),
    flag("repeat", "repeat the recording from its start when it ends").or_else("true").of(RECORDING),
];

pub(crate) const SPOOFER: &[Key] = &[
    number("power_db", -60.0, 80.0, "dB", "power relative to the true signals").required(),
    number("power_start_db", -60.0, 80.0, "dB", "relative power at its begin; with ramp_s").or_else("power_db"),
    number("ramp_s", 0.1, 1e5, "s", "time over which the power grows"),
    number("on_s", 0.0, LONGEST_S, "s", "begin, in true time since the scene's start").or(0.0),
    number("off_s", 0.0, LONGEST_S, "s", "end, in true time since the scene's start").or_else("never"),
    words("satellites", SATELLITES, "imitated satellites").or_else("all"),
    number("clock_bias_s", -1.0, 1.0, "s", "offset of its clock ahead of GPS time").or(0.0),
    number("clock_drift_sps", -1e-5, 1e-5, "s/s", "rate of the clock offset").or(0.0),
    number(
        "replay_s",
        0.0,
        1800.0,
        "s",
        "delay of a replay: its time and its messages are those of so much earlier, at the claimed position",
    )
    .or(0.0),
    number(
        "time_offset_s",
        -1e9,
        1e9,
        "s",
        "time that its signals claim ahead of GPS time, in whole seconds: orbits, messages and code phases are those \
         of that time; not with replay_s",
    )
    .or(0.0),
    texts(
        "navigation",
        "a path, or an array of paths",
        "its own RINEX navigation files: orbits, clocks, health and messages; they must cover the claimed time",
    )
    .or_else("the scene's"),
    time(
        "navigation_moved_to",
        "day to which the first day of its files is moved, as navigation.moved_to; for claimed times without data",
    )
    .or_else("that of the scene's files"),
    number(
        "leap_seconds",
        -128.0,
        127.0,
        "s",
        "GPS time minus UTC that its messages state, a whole number, before and after their last or next leap second",
    )
    .or_else("the true number at the claimed time"),
    word(
        "osnma",
        spoofed_names,
        "authentication in its messages: the true bits, zeros, or bits that it signs by keys of its own; with [osnma]",
    )
    .or_else("true"),
    table("motion", MOTION, "Claimed motion, as `[motion]`. Absent: the antenna's own."),
    table("drag", DRAG, "Drag of the claimed position away from the antenna's."),
    table(
        "transmitter",
        &PLACE,
        "Position from which all its signals come, for the elements of an array. The first element receives what is \
         claimed, the others by their positions.",
    ),
];

pub(crate) const DRAG: &[Key] = &[
    number("start_s", 0.0, LONGEST_S, "s", "begin of the drag, in true time since the scene's start").required(),
    number("azimuth_deg", -360.0, 360.0, "deg", "azimuth of the drag").required(),
    number("elevation_deg", -90.0, 90.0, "deg", "elevation of the drag").or(0.0),
    number("speed_mps", 0.001, 1e4, "m/s", "final speed of the drag").required(),
    number("acceleration_mps2", 0.001, 1e4, "m/s2", "acceleration of the drag up to speed_mps").or(1.0),
];
