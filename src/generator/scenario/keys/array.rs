//! Keys of `[array]`.

use crate::scenario::schema::{Key, list, number, numbers, tables, text};

/// Description of an element's name.
pub(crate) const NAME: &str = "1 to 64 letters, digits, '-' and '_' (it names files)";

pub(crate) const ARRAY: &[Key] = &[
    tables("element", ELEMENT, "Antenna of the array with a front end of its own; 1 to 16.").required(),
    list(
        "coupling_db",
        -200.0,
        20.0,
        "dB",
        "mutual coupling of the antennas: size of the wave of element j in element k, row k after row; with \
         coupling_deg",
    )
    .or_else("no coupling"),
    list("coupling_deg", -360.0, 360.0, "deg", "phases of coupling_db").or_else("no coupling"),
];

const ELEMENT: &[Key] = &[
    text("name", NAME, "name of the element, which names its files and seeds its noise").or_else("e1, e2 …"),
    numbers("lever_arm_m", 3, (-1e3, 1e3), "m", "vector from the antenna of [attitude] to it: forward, right, down")
        .required(),
    number("gain_db", -40.0, 40.0, "dB", "error of its gain, noise and all").or(0.0),
    number("phase_deg", -360.0, 360.0, "deg", "error of its phase: ahead of the others").or(0.0),
    number("delay_ns", -100.0, 100.0, "ns", "error of its delay, of code and carrier").or(0.0),
];
