//! Every key of a scenario, declared once: see [`super::schema`].

pub(crate) mod hardware;
pub(crate) mod motion;
pub(crate) mod satellites;
pub(crate) mod spoofing_and_jamming;
pub(crate) mod way;

use super::schema::{Key, flag, foreign, integer, number, one_or_more, table, tables, text, texts, time, word, words};
use crate::scene::{Arithmetic, CodeEdge, Grade};
use gnss::facts::{Fixes, Losses, Sizes};
use gnss::signal::{Layers, SIGNALS};

pub(super) const A_PATH: &str = "a path";
pub(super) const SATELLITES: &str = "an array of satellites like [\"G01\", \"G12\"]";
/// Seconds since the scene's start: 31 days.
pub(super) const LONGEST_S: f64 = 2_678_400.0;

/// The top of a scenario.
pub const SCENARIO: &[Key] = &[
    text(
        "name",
        "1 to 64 letters, digits, '-' and '_' (it names a directory)",
        "name of the scene and of its directory of results",
    )
    .required(),
    time("start", "what the receiver's clock reads at the first sample: GPS time, or UTC with a final Z").required(),
    number("duration_s", 0.01, LONGEST_S, "s", "length of the samples").required(),
    integer("seed", 0, i64::MAX as u64, "of everything random: noise, oscillators, faults").or(1.0),
    words(
        "signals",
        "an array of different signals of this program",
        "signals that the satellites send. How GLONASS sends a leap second is not settled by a document at hand: one \
         second is sent twice",
    )
    .or_else("[\"GPS L1 C/A\"]"),
    table("navigation", NAVIGATION, "What the satellites broadcast. Absent: the program's own files."),
    table("satellites", SATELLITE_CHOICE, "Which satellites are computed."),
    table("orbits", satellites::ORBITS, "True orbits and clocks. Absent: those that are broadcast."),
    tables(
        "satellite_fault",
        satellites::SATELLITE_FAULT,
        "What a satellite's clock or orbit does that it does not broadcast.",
    ),
    table(
        "sbas",
        satellites::SBAS,
        "What SBAS satellites say of GPS satellites and of the ionosphere: what of both differs from what GPS \
         broadcasts. Absent: nothing.",
    ),
    tables("message_fault", satellites::MESSAGE_FAULT, "What goes wrong with a navigation message."),
    table("motion", motion::MOTION, "Where the antenna is, and how it moves.").required(),
    table(
        "attitude",
        motion::ATTITUDE,
        "How the body that carries the antenna is turned. Absent: the antenna looks up, no wind-up.",
    ),
    table("power", satellites::POWER, "How strong the satellites are. Absent: a link budget with its defaults."),
    tables("multipath", way::MULTIPATH, "A ray that is reflected; at most 64."),
    table("ionosphere", way::IONOSPHERE, "The true ionosphere, and what is broadcast of it. Absent: none."),
    table("troposphere", way::TROPOSPHERE, "The neutral atmosphere. Absent: none."),
    tables("obstruction", way::OBSTRUCTION, "What obstructs the antenna's sky."),
    table("scintillation", way::SCINTILLATION, "Quick fading in the ionosphere."),
    table(
        "receiver_clock",
        hardware::RECEIVER_CLOCK,
        "How the receiver's clock departs from GPS time. Absent: it does not.",
    ),
    table("noise", &[], "Thermal noise. Absent: none."),
    table("playback", hardware::PLAYBACK, "A transmitter of few bits that plays the satellites' signals."),
    table("local_oscillator", hardware::LOCAL_OSCILLATOR, "The mixer's oscillator, apart from the sampling clock."),
    table("filter", hardware::FILTER, "The front end's filter."),
    table("iq", hardware::IQ, "Imbalance of the two branches, and direct current."),
    table("adc", hardware::ADC, "A converter with fewer bits than the format has."),
    one_or_more(
        "front_end",
        hardware::FRONT_END,
        "Sampling. Several, each written as [[front_end]], listen to one sky by one clock: one file each. The tables \
         of stages (local_oscillator, filter, iq, adc) go below each of them then.",
    ),
    tables(
        "interference",
        spoofing_and_jamming::INTERFERENCE,
        "A source of interference. Exactly one of `js_db`, `power_dbw`, `eirp_dbw`.",
    ),
    tables("spoofer", spoofing_and_jamming::SPOOFER, "A second constellation, for another place, motion or clock."),
    table(
        "fidelity",
        FIDELITY,
        "Speed against accuracy of the samples; `gnss-twin plan` prints what each choice costs and errs.",
    ),
    table("truth", TRUTH, "The truth's files."),
    table(
        "expect",
        EXPECT,
        "What the scene expects of its receiver where physics alone would expect something else; at least one of \
         `fix`, `losses` and `errors`, with the `reason`.",
    ),
    foreign("receiver", "the receiver's settings", "settings of the receiver that `run` uses, as below"),
];

const NAVIGATION: &[Key] = &[
    texts(
        "file",
        "a path, or an array of paths",
        "RINEX navigation files, version 2 to 4, plain or gzip, relative to the scenario and below its directory; \
         together they have to cover the scene's time",
    )
    .or_else("embedded: GPS of 2010-07-01; GPS and Galileo of 2020-11-29, 10:10 to 16:00"),
    time(
        "moved_to",
        "a day, to which the first day of the files is moved: satellites go over the same ground at the same hour, and \
         messages say the new week",
    )
    .or_else("the files' own"),
    number("galileo_ahead_ns", -900.0, 900.0, "ns", "by which Galileo's time is ahead of GPS time; it is broadcast")
        .or_else("the navigation file's at the start, or 0"),
];

const SATELLITE_CHOICE: &[Key] = &[
    number(
        "mask_deg",
        -10.0,
        89.0,
        "deg",
        "elevation below which satellites are not computed; from 100 km up the Earth's limb takes its place",
    )
    .or(5.0),
    words("exclude", SATELLITES, "satellites that are left out"),
    flag("include_unhealthy", "whether those are computed that say of themselves that they are unhealthy"),
];

const FIDELITY: &[Key] = &[
    word("level", || Grade::NAMES.map(|(name, _)| name).to_vec(), "sets every knob").or_else("balanced"),
    word("code_edge", || CodeEdge::NAMES.map(|(name, _)| name).to_vec(), "how chips' edges fall between samples")
        .or_else("the level's, for the rate, motion and noise"),
    word(
        "waveform",
        || Layers::NAMES.map(|(name, _)| name).to_vec(),
        "what is sent of waveforms of several layers, such as CBOC: all, or of each component the strongest one",
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
];

const TRUTH: &[Key] = &[number("interval_s", 0.001, 3600.0, "s", "spacing of the truth's rows").or(0.1)];

const EXPECT: &[Key] = &[
    word("fix", fixes, "whether there has to be a fix").or_else("as the satellites allow"),
    word("losses", losses, "losses of lock that are excused").or_else("those that the scene explains"),
    words("satellites", SATELLITES, "whose losses; with losses").or_else("all"),
    word("errors", sizes, "whether errors are within what theory expects").or_else("bounded"),
    number("position_within_m", 1e-3, 1e7, "m", "error in space that no fix may exceed, whatever errors says")
        .or_else("unbounded"),
    text("reason", WHY, "why, for the verdict; required with the others"),
    tables("interval", INTERVAL, "The same for a part of the scene."),
];

const INTERVAL: &[Key] = &[
    number("from_s", 0.0, LONGEST_S, "s", "where it begins, since the start of the samples").required(),
    number("to_s", 0.0, LONGEST_S, "s", "where it ends").required(),
    word("fix", fixes, "as in [expect]").or_else("as in [expect]"),
    word("losses", losses, "as in [expect]").or_else("as in [expect]"),
    words("satellites", SATELLITES, "whose losses; with losses").or_else("all"),
    word("errors", sizes, "as in [expect]").or_else("as in [expect]"),
    number("position_within_m", 1e-3, 1e7, "m", "as in [expect]").or_else("as in [expect]"),
    text("reason", WHY, "why, for the verdict").required(),
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
    let known: Vec<String> = SIGNALS.iter().map(|signal| format!("{:?}", signal.name)).collect();
    format!("an array of different signals out of {}", known.join(", "))
}
