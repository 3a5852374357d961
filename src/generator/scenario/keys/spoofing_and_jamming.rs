//! Keys of `[[interference]]` and `[[spoofer]]`.

use super::motion::{MOTION, PLACE_IF_ANY};
use super::{A_PATH, LONGEST_S, SATELLITES};
use crate::scenario::schema::{Key, flag, number, table, text, word, words};

const SWEEP: &[&str] = &["chirp", "fmcw"];
const FM: &[&str] = &["sine_fm"];
const PULSE: &[&str] = &["pulse"];
const RECORDING: &[&str] = &["recording"];

pub(crate) fn kinds() -> Vec<&'static str> {
    vec!["cw", "chirp", "fmcw", "sine_fm", "pulse", "matched", "noise", "recording"]
}

pub(crate) const INTERFERENCE: &[Key] = &[
    word("kind", kinds, "what it sends").required(),
    number("offset_hz", -1e9, 1e9, "Hz", "its middle from GPS L1").or(0.0),
    number(
        "js_db",
        -100.0,
        120.0,
        "dB",
        "power over the satellites' at the antenna's port, when the scene starts: over power.cn0_dbhz, or with a \
         link budget over the C/N0 of the satellite that is the strongest in view then (its direct ray; `gnss-twin \
         plan` names it)",
    ),
    number("power_dbw", -250.0, 0.0, "dBW", "power at the antenna's port; needs a link budget"),
    number(
        "eirp_dbw",
        -200.0,
        60.0,
        "dBW",
        "power that it radiates from its place, or from distance_m; needs a link budget",
    ),
    number("distance_m", 1.0, 1e9, "m", "how far away it stays, in place of a place: free-space loss without Doppler")
        .or_else("from its place"),
    number("on_s", 0.0, LONGEST_S, "s", "true time since the scene's start at which it begins").or(0.0),
    number("off_s", 0.0, LONGEST_S, "s", "when it ends").or_else("never"),
    PLACE_IF_ANY[0],
    PLACE_IF_ANY[1],
    PLACE_IF_ANY[2],
    number("sweep_hz", -1e8, 1e8, "Hz", "width of the sweep, negative downwards").required().of(SWEEP),
    number("sweep_s", 1e-6, 10.0, "s", "time of a sweep").required().of(SWEEP),
    number("deviation_hz", 0.0, 5e7, "Hz", "frequency deviation").required().of(FM),
    number("rate_hz", 0.01, 1e6, "Hz", "modulations or pulses a second").required().of(&["sine_fm", "pulse"]),
    number("width_s", 1e-8, 10.0, "s", "length of a pulse").required().of(PULSE),
    number("jitter", 0.0, 1.0, "of a period", "by which pulses are late at most").or(0.0).of(PULSE),
    number("bandwidth_hz", 100.0, 1e9, "Hz", "width of the noise").required().of(&["noise"]),
    text("file", A_PATH, "a recording").required().of(RECORDING),
    text("format", "one of ci8, cu8, ci16, cf32", "of the recording").required().of(RECORDING),
    number("sample_rate_hz", 1e3, 1e8, "Hz", "of the recording").required().of(RECORDING),
    flag("repeat", "whether the recording begins again at its end").or_else("true").of(RECORDING),
];

pub(crate) const SPOOFER: &[Key] = &[
    number("power_db", -60.0, 80.0, "dB", "over the true signals").required(),
    number("power_start_db", -60.0, 80.0, "dB", "that at its beginning; with ramp_s").or_else("power_db"),
    number("ramp_s", 0.1, 1e5, "s", "time in which the power grows"),
    number("on_s", 0.0, LONGEST_S, "s", "true time since the scene's start at which it begins").or(0.0),
    number("off_s", 0.0, LONGEST_S, "s", "when it ends").or_else("never"),
    words("satellites", SATELLITES, "which satellites it imitates").or_else("all"),
    number("clock_bias_s", -1.0, 1.0, "s", "its clock ahead of GPS time").or(0.0),
    number("clock_drift_sps", -1e-5, 1e-5, "s/s", "growth of that").or(0.0),
    table("motion", MOTION, "The motion that it claims, as `[motion]`. Absent: the antenna's own."),
    table("drag", DRAG, "How it draws the claimed place off the antenna's."),
];

pub(crate) const DRAG: &[Key] = &[
    number("start_s", 0.0, LONGEST_S, "s", "when it begins").required(),
    number("azimuth_deg", -360.0, 360.0, "deg", "whither").required(),
    number("elevation_deg", -90.0, 90.0, "deg", "whither").or(0.0),
    number("speed_mps", 0.001, 1e4, "m/s", "how fast").required(),
    number("acceleration_mps2", 0.001, 1e4, "m/s2", "how soon it is that fast").or(1.0),
];
