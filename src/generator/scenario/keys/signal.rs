//! Keys of a file that describes a signal.

use crate::scenario::schema::{Key, by_satellite, flag, integer, list, number, tables, text, word};
use gnss::signal::SIGNALS;

const BITS: &str = "digits 0 and 1";
const CODE: Key = text("G01", "hexadecimal digits", "code of one satellite, by its name");
const START: Key = text("G01", BITS, "first state of one satellite, by its name");

/// Keys at the top of the file.
pub const SIGNAL: &[Key] = &[
    text(
        "name",
        "1 to 40 letters, digits, blanks and /-+_.(), and not all",
        "name of the signal, which no other signal has",
    )
    .required(),
    text(
        "rinex",
        "a digit and a capital letter, such as 1A",
        "RINEX band and attribute, which no built-in signal of the system has",
    )
    .required(),
    word(
        "like",
        names,
        "built-in signal from which it takes the system with its orbits, the time scale, the satellites that send it, \
         and the message",
    )
    .required(),
    number("carrier_hz", 1e8, 3e10, "Hz", "carrier of all satellites").or_else("that of like"),
    number(
        "minimum_power_dbw",
        -220.0,
        -100.0,
        "dBW",
        "least received power of all components together, for link budgets",
    )
    .or_else("that of like"),
    tables("component", COMPONENT, "Spreading code on the carrier. Power shares add up to 1.").required(),
];

const COMPONENT: &[Key] = &[
    power_share().required(),
    phase_cycles(),
    number("chip_rate_hz", 1e3, 1e8, "Hz", "chips per second").required(),
    integer("code_chips", 1, 1_000_000, "length of the code; its periods divide a symbol of the message").required(),
    by_satellite(
        "codes",
        &CODE,
        "Memory codes: four chips a hexadecimal digit, the first chip highest, 0 as +1; blanks and breaks of lines \
         do not count. Either codes or registers.",
    ),
    tables(
        "register",
        REGISTER,
        "Shift register, at most 4. The chip is the sum modulo 2 of their last stages. All begin again with each code \
         period.",
    ),
    pulse().or_else("[1], which is BPSK"),
    tables(
        "layer",
        LAYER,
        "Pulse of several on each chip, at most 8; not with pulse. The mean power of their sum is 1.",
    ),
    text(
        "secondary_code",
        BITS,
        "secondary code of all satellites, a digit for each code period; with a message it divides a symbol",
    ),
    flag("message", "modulated by the message of like; a pilot is not"),
];

const LAYER: &[Key] = &[power_share().required(), phase_cycles(), pulse().required()];

const REGISTER: &[Key] = &[
    integer("stages", 2, 60, "number of stages; the last one is the output").required(),
    list("taps", 1.0, 60.0, "", "stages whose sum modulo 2 is fed back to stage 1; the last stage is one").required(),
    text("start", BITS, "first state for all satellites, stage 1 first; not with starts").or_else("ones"),
    by_satellite("starts", &START, "First states by satellite, stage 1 first; in one register at least."),
];

const fn power_share() -> Key {
    number("power_share", 1e-6, 1.0, "", "share of the power")
}

const fn phase_cycles() -> Key {
    number("phase_cycles", -1.0, 1.0, "cycles", "phase of the carrier; 0.25 is in quadrature").or(0.0)
}

const fn pulse() -> Key {
    list("pulse", -1.0, 1.0, "", "signs of equal steps of a chip, each -1 or 1: [1, -1] is BOC(n, n)")
}

fn names() -> Vec<&'static str> {
    SIGNALS.iter().map(|signal| signal.name).collect()
}
