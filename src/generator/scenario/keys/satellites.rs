//! Keys of `[orbits]`, `[sbas]`, `[[satellite_fault]]`, `[[message_fault]]` and `[power]`.

use super::{A_PATH, LONGEST_S, SATELLITES};
use crate::clock::oscillator::PowerLaw;
use crate::effect::transmit::Block;
use crate::scenario::schema::{Key, by_satellite, flag, integer, number, numbers, text, texts, word, words};
use gnss::signal::SIGNALS;

const OFFSET: Key = number("G01", -5.0, 5.0, "m", "antenna offset of one satellite, by its name");
const CN0: Key = number("G01", 0.0, 100.0, "dB-Hz", "C/N0 of one satellite, by its name");
const BLOCK: Key = word("G01", blocks, "block of one satellite, by its name");

pub(crate) const ORBITS: &[Key] = &[
    texts(
        "sp3",
        "the path of an SP3 file, or an array of such paths",
        "files of precise orbits and clocks that cover the scene",
    )
    .required(),
    number(
        "antenna_offset_m",
        -5.0,
        5.0,
        "m",
        "offset of the transmit antenna from the centre of mass, towards the Earth",
    )
    .or(0.0),
    by_satellite("antenna_offsets_m", &OFFSET, "Antenna offsets by satellite."),
];

pub(crate) const SBAS: &[Key] = &[
    flag("test", "broadcast test mode: not for safety-of-life use"),
    words("do_not_use", SATELLITES, "GPS satellites flagged as do-not-use, whatever their true state"),
    flag("degradation", "broadcast how corrections degrade (type 10), which protection levels of SBAS need"),
];

const fn on() -> Key {
    number("on_s", 0.0, LONGEST_S, "s", "begin, in true time since the scene's start").or(0.0)
}

const fn off() -> Key {
    number("off_s", 0.0, LONGEST_S, "s", "end, in true time since the scene's start").or_else("never")
}

const CLOCK: &[&str] = &["clock_step", "clock_ramp"];
const ORBIT: &[&str] = &["orbit"];

pub(crate) const SATELLITE_FAULT: &[Key] = &[
    word("kind", || vec!["clock_step", "clock_ramp", "clock_noise", "orbit"], "kind of fault").required(),
    words("satellites", SATELLITES, "affected satellites").required().of(&["clock_step", "clock_ramp", "orbit"]),
    words("satellites", SATELLITES, "affected satellites").or_else("all").of(&["clock_noise"]),
    on().of(CLOCK),
    off().of(CLOCK),
    number(
        "on_s",
        0.0,
        LONGEST_S,
        "s",
        "begin of the growth of the offset, in true time since the scene's start; with ramp_s",
    )
    .or_else("there from the beginning")
    .of(ORBIT),
    number("step_s", -1e-3, 1e-3, "s", "size of the clock step").required().of(&["clock_step"]),
    number("drift_sps", -1e-6, 1e-6, "s/s", "drift of the clock").required().of(&["clock_ramp"]),
    word("oscillator", presets, "clock noise of an oscillator type").of(&["clock_noise"]),
    numbers("power_law", 5, (-1e-12, 1e-12), "", "clock noise by coefficients h2, h1, h0, h-1, h-2")
        .of(&["clock_noise"]),
    number("radial_m", -1e5, 1e5, "m", "offset of the true orbit from the broadcast one, radially outwards")
        .or(0.0)
        .of(ORBIT),
    number("along_m", -1e5, 1e5, "m", "offset of the true orbit along the motion").or(0.0).of(ORBIT),
    number("cross_m", -1e5, 1e5, "m", "offset of the true orbit across the orbital plane").or(0.0).of(ORBIT),
    number("ramp_s", 1.0, 1e6, "s", "time over which the offset grows; with on_s")
        .or_else("there from the beginning")
        .of(ORBIT),
];

/// The parameters of all messages that a fault can change.
pub(crate) fn parameters() -> Vec<&'static str> {
    let messages = SIGNALS.iter().flat_map(|signal| signal.components.iter().filter_map(|c| c.message));
    let mut names: Vec<&'static str> = Vec::new();
    for name in messages.flat_map(|message| message.fields.adjustable()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn presets() -> Vec<&'static str> {
    PowerLaw::PRESETS.map(|(name, _)| name).to_vec()
}

pub(crate) const MESSAGE_FAULT: &[Key] = &[
    word("kind", || vec!["bit_errors", "bit", "health", "parameter", "alert"], "kind of fault").required(),
    words("satellites", SATELLITES, "affected satellites").or_else("all").of(&["bit_errors", "bit"]),
    words("satellites", SATELLITES, "affected satellites").required().of(&["health", "parameter", "alert"]),
    on(),
    off(),
    integer("spoofer", 1, 99, "number of the [[spoofer]] whose messages it spoils; times are true time, too")
        .or_else("the true satellites"),
    number("rate", 0.0, 0.5, "(a probability)", "error probability of each bit").required().of(&["bit_errors"]),
    integer("subframe", 1, 5, "number of the subframe").required().of(&["bit"]),
    integer("word", 1, 10, "number of the word in the subframe").required().of(&["bit"]),
    integer("bit", 1, 30, "number of the inverted bit in the word").required().of(&["bit"]),
    integer("health", 0, 511, "broadcast health bits: six for GPS; for Galileo three each for E1-B, E5b and E5a")
        .required()
        .of(&["health"]),
    word("parameter", parameters, "affected parameter").required().of(&["parameter"]),
    number("add", -1e6, 1e6, "in the parameter's unit", "error added to the parameter").required().of(&["parameter"]),
];

const FIXED: &[&str] = &["fixed"];
const BUDGET: &[&str] = &["link_budget"];

const CN0_OF_ALL: Key = number(
    "cn0_dbhz",
    0.0,
    100.0,
    "dB-Hz",
    "C/N0 of all satellites at the antenna; chip edges and filters reduce it in the samples",
);
const CN0_OF_EACH: Key = by_satellite("satellites", &CN0, "C/N0 by satellite, with kind = \"fixed\".").of(FIXED);
const ANTENNA: Key = word("antenna", || vec!["isotropic", "patch", "turnstile", "table"], "receive antenna").of(BUDGET);
const ANTENNA_FILE: Key =
    text("antenna_file", A_PATH, "gain and phase by direction, for antenna = \"table\"").of(BUDGET);
const NOISE_FIGURE: Key = number("noise_figure_db", 0.0, 30.0, "dB", "noise figure of the receiver").of(BUDGET);
const LOSS: Key = number("loss_db", -20.0, 60.0, "dB", "additional loss").of(BUDGET);

pub(crate) const POWER: &[Key] = &[
    word(
        "kind",
        || vec!["fixed", "link_budget"],
        "equal C/N0 for all satellites, or a link budget by range, elevation and antennas",
    )
    .or_else("fixed if cn0_dbhz is there, else link_budget"),
    CN0_OF_ALL.required().of(FIXED),
    CN0_OF_EACH,
    word("transmit", transmits, "transmit antenna patterns: one block for all satellites, or the blocks of that date")
        .or_else("typical")
        .of(BUDGET),
    number("transmit_dbw", -10.0, 40.0, "dBW", "power fed into the transmit antennas").or(14.3).of(BUDGET),
    by_satellite("blocks", &BLOCK, "Blocks by satellite, with kind = \"link_budget\".").of(BUDGET),
    ANTENNA.or_else("patch"),
    ANTENNA_FILE,
    NOISE_FIGURE.or(2.5),
    LOSS.or(0.0),
];

/// Keys of `[power]` that concern the receiver, and that a station may have of its own.
pub(crate) const RECEIVED: &[Key] = &[
    CN0_OF_ALL.or_else("the scene's"),
    CN0_OF_EACH,
    ANTENNA.or_else("the scene's"),
    ANTENNA_FILE,
    NOISE_FIGURE.or_else("the scene's"),
    LOSS.or_else("the scene's"),
];

fn blocks() -> Vec<&'static str> {
    Block::NAMES.map(|(name, _)| name).to_vec()
}

fn transmits() -> Vec<&'static str> {
    [blocks(), vec!["constellation"]].concat()
}
