//! Keys of a scenario, each declared once: see [`super::schema`].

pub(crate) mod array;
pub(crate) mod hardware;
pub(crate) mod inertial;
pub(crate) mod motion;
pub(crate) mod osnma;
pub(crate) mod satellites;
pub mod signal;
pub(crate) mod spoofing_and_jamming;
pub(crate) mod station;
pub(crate) mod way;

use super::schema::{Key, flag, foreign, integer, number, one_or_more, table, tables, text, texts, time, word, words};
use crate::scene::{Arithmetic, CodeEdge, Grade};
use gnss::facts::{Fixes, Losses, Sizes};
use gnss::signal::{Layers, all};

pub(super) const A_PATH: &str = "a path";
pub(super) const SATELLITES: &str = "an array of satellites like [\"G01\", \"G12\"]";
/// Seconds since the scene's start: 31 days.
pub(super) const LONGEST_S: f64 = 2_678_400.0;

/// Keys at the top of a scenario.
pub const SCENARIO: &[Key] = &[
    text(
        "name",
        "1 to 64 letters, digits, '-' and '_' (it names a directory)",
        "name of the scene and of its results directory",
    )
    .required(),
    time("start", "receiver clock reading at the first sample: GPS time, or UTC with a final Z").required(),
    number("duration_s", 0.01, LONGEST_S, "s", "length of the samples").required(),
    integer("seed", 0, i64::MAX as u64, "seed of all random processes: noise, oscillators, faults").or(1.0),
    words(
        "signals",
        "an array of different signals of this program",
        "transmitted signals. At a leap second GLONASS repeats one second; no available document specifies this",
    )
    .or_else("[\"GPS L1 C/A\"]"),
    texts(
        "signal_file",
        "a path, or an array of paths",
        "files that describe signals of one's own, relative to the scenario and below its directory; \
         `signals` may then name them",
    ),
    table("navigation", NAVIGATION, "Broadcast navigation data. Absent: the embedded files."),
    table("satellites", SATELLITE_CHOICE, "Selection of satellites."),
    table("orbits", satellites::ORBITS, "True orbits and clocks. Absent: the broadcast ones."),
    tables(
        "satellite_fault",
        satellites::SATELLITE_FAULT,
        "Error of a satellite's clock or orbit that its message does not contain.",
    ),
    table(
        "sbas",
        satellites::SBAS,
        "Corrections by SBAS satellites: the differences of true GPS orbits, clocks and ionosphere from the \
         broadcast ones. Absent: none.",
    ),
    table(
        "osnma",
        osnma::OSNMA,
        "Authentication of Galileo's messages on E1-B (OSNMA), signed with test keys by the seed. Absent: zeros in \
         its bits.",
    ),
    tables(
        "message_fault",
        satellites::MESSAGE_FAULT,
        "Fault of a navigation message. It acts after authentication: tags stay those of the true words.",
    ),
    table("motion", motion::MOTION, "Position and motion of the antenna.").required(),
    table(
        "attitude",
        motion::ATTITUDE,
        "Attitude of the body that carries the antenna. Absent: the boresight points up, without wind-up.",
    ),
    table(
        "array",
        array::ARRAY,
        "Antennas on the body of `[attitude]`, each with a front end like the scene's one and a file of its own. \
         Absent: one antenna.",
    ),
    table(
        "imu",
        inertial::IMU,
        "Inertial sensors on the body of `[attitude]`: specific force and angular rate in `truth/imu.csv`. Absent: \
         none.",
    ),
    table("power", satellites::POWER, "Received power of the satellites. Absent: a link budget with its defaults."),
    table("city", way::CITY, "Walls and roofs around the antenna, which obstruct and reflect. Absent: none."),
    tables("multipath", way::MULTIPATH, "Reflected ray; at most 64."),
    table("ionosphere", way::IONOSPHERE, "True ionosphere, and its broadcast parameters. Absent: none."),
    table("troposphere", way::TROPOSPHERE, "Neutral atmosphere. Absent: none."),
    tables("obstruction", way::OBSTRUCTION, "Obstruction of the antenna's sky."),
    table("scintillation", way::SCINTILLATION, "Ionospheric scintillation."),
    table("receiver_clock", hardware::RECEIVER_CLOCK, "Offset of the receiver's clock from GPS time. Absent: zero."),
    table("noise", &[], "Thermal noise. Absent: none."),
    table("playback", hardware::PLAYBACK, "Playback of the satellites' signals by a transmitter with few bits."),
    table("local_oscillator", hardware::LOCAL_OSCILLATOR, "Oscillator of the mixer, separate from the sampling clock."),
    table("filter", hardware::FILTER, "Filter of the front end."),
    table("iq", hardware::IQ, "Imbalance of the I and Q branches, and their DC offsets."),
    table("adc", hardware::ADC, "Converter with fewer bits than the sample format."),
    one_or_more(
        "front_end",
        hardware::FRONT_END,
        "Sampling. Several front ends, each written as [[front_end]], share one antenna and one clock; each has a \
         file of its own. Their local_oscillator, filter, iq and adc tables are then below each [[front_end]].",
    ),
    tables(
        "interference",
        spoofing_and_jamming::INTERFERENCE,
        "Source of interference. Exactly one of `js_db`, `power_dbw`, `eirp_dbw`.",
    ),
    tables("spoofer", spoofing_and_jamming::SPOOFER, "Second constellation, for another position, motion or clock."),
    table(
        "fidelity",
        FIDELITY,
        "Speed against accuracy of the samples; `gnss-twin plan` prints the cost and error of each choice.",
    ),
    table("truth", TRUTH, "Files of the truth."),
    table(
        "expect",
        EXPECT,
        "Expectation of the judge where it differs from what physics alone implies: at least one of `fix`, `losses` \
         and `errors`, with the `reason`.",
    ),
    tables(
        "station",
        station::STATION,
        "Receiver of several under one sky, up to eight. Its tables stand in place of the scene's of that name; of \
         `[power]` single keys do. A scene in which every station has a `[station.motion]` has no `[motion]`.",
    ),
    foreign("receiver", "the receiver's settings", "receiver settings for `run`, as below"),
];

const NAVIGATION: &[Key] = &[
    texts(
        "file",
        "a path, or an array of paths",
        "RINEX navigation files, version 2 to 4, plain or gzip, relative to the scenario and below its directory; \
         together they must cover the scene's time",
    )
    .or_else("embedded: GPS of 2010-07-01; GPS and Galileo of 2020-11-29, 10:10 to 16:00"),
    time(
        "moved_to",
        "day to which the first day of the files is moved: ground tracks and hours stay, messages carry the new week",
    )
    .or_else("the files' own"),
    number("galileo_ahead_ns", -900.0, 900.0, "ns", "offset of Galileo system time ahead of GPS time; it is broadcast")
        .or_else("the navigation file's at the start, or 0"),
];

const SATELLITE_CHOICE: &[Key] = &[
    number(
        "mask_deg",
        -10.0,
        89.0,
        "deg",
        "lowest elevation of computed satellites; above 100 km height the Earth's limb is used instead",
    )
    .or(5.0),
    words("only", SATELLITES, "satellites that are computed, no others; not with exclude").or_else("all"),
    words("exclude", SATELLITES, "excluded satellites"),
    flag("include_unhealthy", "include satellites whose broadcast health is bad"),
];

const FIDELITY: &[Key] = &[
    word("level", || Grade::NAMES.map(|(name, _)| name).to_vec(), "level, which sets every knob").or_else("balanced"),
    word(
        "code_edge",
        || CodeEdge::NAMES.map(|(name, _)| name).to_vec(),
        "treatment of chip edges between samples: nearest folds all power back into the band, area and band_limited \
         lose the power outside it",
    )
    .or_else("the level's, for the rate, motion and noise"),
    word(
        "waveform",
        || Layers::NAMES.map(|(name, _)| name).to_vec(),
        "transmitted layers of a composite waveform such as CBOC: all, or the strongest of each component",
    )
    .or_else("whole"),
    word("carrier", || Arithmetic::NAMES.map(|(name, _)| name).to_vec(), "arithmetic of carrier and code")
        .or_else("the level's"),
    word("noise", || Arithmetic::NAMES.map(|(name, _)| name).to_vec(), "arithmetic of the noise")
        .or_else("the level's"),
    number(
        "knot_tolerance_cycles",
        1e-7,
        0.1,
        "cycles",
        "largest error of the carrier between knots of its polynomials",
    )
    .or_else("the level's"),
    table(
        "budget",
        BUDGET,
        "Largest errors, in place of a level and knobs; at least one of the three. Samples have the cheapest knobs \
         whose errors stay below them. `run` makes no samples where the level correlations has all effects of the \
         scene and stays below them too. `gnss-twin plan` prints the choice, and what cheaper ones would break.",
    ),
];

const BUDGET: &[Key] = &[
    number("code_m", 1e-6, 1e3, "m", "largest error of a code at rest on the sampling grid").or_else("unbounded"),
    number("carrier_cycles", 1e-7, 0.1, "cycles", "largest error of a carrier").or_else("unbounded"),
    number("cn0_db", 1e-4, 20.0, "dB", "largest error of a C/N0, against an ideal filter of the samples' band")
        .or_else("unbounded"),
];

const TRUTH: &[Key] = &[number("interval_s", 0.001, 3600.0, "s", "interval of the rows").or(0.1)];

const EXPECT: &[Key] = &[
    word("fix", fixes, "expected fix").or_else("as the satellites allow"),
    word("losses", losses, "excused losses of lock").or_else("those that the scene explains"),
    words("satellites", SATELLITES, "satellites whose losses are excused; with losses").or_else("all"),
    word("errors", sizes, "bound of the errors: within theory, or any").or_else("bounded"),
    number("position_within_m", 1e-3, 1e7, "m", "largest 3-D position error of any fix, whatever errors allows")
        .or_else("unbounded"),
    text("reason", WHY, "reason, printed in the verdict; required with the other keys"),
    tables("interval", INTERVAL, "Expectation for a part of the scene."),
];

const INTERVAL: &[Key] = &[
    number("from_s", 0.0, LONGEST_S, "s", "begin, since the start of the samples").required(),
    number("to_s", 0.0, LONGEST_S, "s", "end, since the start of the samples").required(),
    word("fix", fixes, "as in [expect]").or_else("as in [expect]"),
    word("losses", losses, "as in [expect]").or_else("as in [expect]"),
    words("satellites", SATELLITES, "satellites whose losses are excused; with losses").or_else("all"),
    word("errors", sizes, "as in [expect]").or_else("as in [expect]"),
    number("position_within_m", 1e-3, 1e7, "m", "as in [expect]").or_else("as in [expect]"),
    text("reason", WHY, "reason, printed in the verdict").required(),
];

const WHY: &str = "a sentence that says why";

fn fixes() -> Vec<&'static str> {
    Fixes::NAMES.iter().map(|(name, _)| *name).collect()
}

fn losses() -> Vec<&'static str> {
    Losses::NAMES.iter().map(|(name, _)| *name).collect()
}

fn sizes() -> Vec<&'static str> {
    Sizes::NAMES.iter().map(|(name, _)| *name).collect()
}

/// The names of the signals that a scenario may hold.
pub(super) fn signals_expected() -> String {
    let known: Vec<String> = all().iter().map(|signal| format!("{:?}", signal.name)).collect();
    format!("an array of different signals out of {}", known.join(", "))
}
