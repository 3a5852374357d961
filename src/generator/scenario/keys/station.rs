//! Keys of `[[station]]`.

use super::hardware::{ADC, FILTER, FRONT_END, IQ, LOCAL_OSCILLATOR, RECEIVER_CLOCK};
use super::motion::{ATTITUDE, MOTION};
use super::satellites::RECEIVED;
use super::way::{MULTIPATH, OBSTRUCTION};
use crate::scenario::schema::{Key, one_or_more, table, tables, text};

/// Description of a station's name.
pub(crate) const NAME: &str = "1 to 32 letters, digits, '-' and '_' (it names a directory)";

pub(crate) const STATION: &[Key] = &[
    text("name", NAME, "name of the station, which names its directory and seeds its noise, clock and scintillation")
        .required(),
    table("motion", MOTION, "Position and motion of its antenna.").or_else("the scene's"),
    table("attitude", ATTITUDE, "Attitude of the body that carries its antenna.").or_else("the scene's"),
    table("power", RECEIVED, "Keys of [power] that differ at the station, one by one."),
    tables("multipath", MULTIPATH, "Reflected ray; at most 64.").or_else("the scene's"),
    tables("obstruction", OBSTRUCTION, "Obstruction of its antenna's sky.").or_else("the scene's"),
    table("receiver_clock", RECEIVER_CLOCK, "Offset of its clock from GPS time.").or_else("the scene's"),
    table("local_oscillator", LOCAL_OSCILLATOR, "Oscillator of its mixer.").or_else("the scene's"),
    table("filter", FILTER, "Filter of its front end.").or_else("the scene's"),
    table("iq", IQ, "Imbalance of its I and Q branches, and their DC offsets.").or_else("the scene's"),
    table("adc", ADC, "Converter of its front end.").or_else("the scene's"),
    one_or_more("front_end", FRONT_END, "Sampling of the station, by one front end or several.").or_else("the scene's"),
    table("expect", super::EXPECT, "Expectation of the judge about its receiver.").or_else("the scene's"),
];
