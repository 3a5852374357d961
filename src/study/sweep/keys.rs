//! Every key of STUDY.toml, declared once: see [`generator::scenario::schema`].

use super::spec::Level;
use crate::correlator::signals;
use generator::clock::oscillator::PowerLaw;
use generator::scenario::schema::{
    Key, flag, foreign, integer, number, numbers, table, tables, text, values, word, words,
};

/// Room for any number.
const ANY: f64 = 1e18;

/// The top of a study.
pub const STUDY: &[Key] = &[
    text(
        "name",
        "1 to 64 letters, digits, '-' and '_' (it names a directory)",
        "name of the study and of its directory",
    )
    .required(),
    text("title", "a title", "title of the report").or_else("the name"),
    text("about", "a text", "introduction of the report"),
    word(
        "level",
        || Level::NAMES.map(|(name, _)| name).to_vec(),
        "correlator for loops on modelled correlations; samples for generator and receiver at the scene's \
         `[fidelity]`, which makes samples by default; correlations or observations for scenes at this level",
    )
    .required(),
    integer("seed", 0, i64::MAX as u64, "seed from which the seeds of all cases follow").or(1.0),
    integer("repetitions", 1, 1_000_000, "repetitions of each cell with other noise").or(1.0),
    text(
        "scenario",
        "the path of a scene, relative to the study",
        "base scene at all levels but correlator; an axis may name scenes instead",
    ),
    table("signal", SIGNAL, "Received signal, at level = \"correlator\"."),
    table("motion", MOTION, "Doppler and its changes, at level = \"correlator\"."),
    table("loop", LOOP, "Loop under study, at level = \"correlator\"."),
    table("measure", MEASURE, "Measurement time, at level = \"correlator\"."),
    foreign("receiver", "the receiver's settings, tracking alone", "settings of the loops, at level = \"correlator\""),
    tables("axis", AXIS, "Key and its values."),
    words("keep", "an array of figures", "figures of each case: those of the level, or paths into `summary.json`")
        .required(),
    words("ensemble", "an array of axes", "axes that separate ensembles; other cases are pooled")
        .or_else("no ensemble"),
    tables("plot", PLOT, "Picture."),
];

const SIGNAL: &[Key] = &[
    word("name", || signals().into_iter().map(|signal| signal.name).collect(), "name of the signal")
        .or_else("GPS L1 C/A"),
    word("component", || vec!["leading", "data", "pilot"], "tracked component").or_else("leading"),
    number("cn0_dbhz", 0.0, 80.0, "dB-Hz", "C/N0").or_else("no noise"),
    number("bandwidth_hz", 1e3, 1e9, "Hz", "bandwidth of the front end").or_else("none"),
    word(
        "oscillator",
        || PowerLaw::PRESETS.map(|(name, _)| name).to_vec(),
        "noise of the receiver's oscillator, by name",
    ),
    numbers("power_law", 5, (-1e-12, 1e-12), "", "noise by coefficients 0, 0, h0, h-1, h-2; not with oscillator"),
];

const MOTION: &[Key] = &[
    number("doppler_hz", -1e6, 1e6, "Hz", "initial Doppler").or(0.0),
    number("acceleration_g", -1e4, 1e4, "g", "acceleration after settling").or(0.0),
    number("jerk_g_per_s", -1e5, 1e5, "g/s", "jerk after settling").or(0.0),
    number("jerk_s", 1e-3, 1e6, "s", "duration of the jerk").or_else("to the end"),
];

const LOOP: &[Key] = &[
    word("mode", || vec!["phase", "assisted", "frequency"], "carrier loop").or_else("phase"),
    flag("detectors", "let the receiver's lock detectors drop the signal and correct side peaks"),
    number("start_chips", -1.0, 1.0, "chips", "initial delay error of the code").or(0.0),
];

const MEASURE: &[Key] = &[
    number("settle_s", 0.0, 1e6, "s", "settling time before the measurement").or(5.0),
    number("duration_s", 0.1, 1e7, "s", "duration of the measurement").or(60.0),
];

const AXIS: &[Key] = &[
    text(
        "key",
        "a key of the base, like \"receiver.tracking.pll_bandwidth_hz\" or \"interference[1].js_db\"",
        "varied key",
    )
    .required(),
    values("values", "values, in place of from and to"),
    number("from", -ANY, ANY, "", "first value"),
    number("to", -ANY, ANY, "", "last value"),
    number("step", -ANY, ANY, "", "distance between values; step or count"),
    integer("count", 0, i64::MAX as u64, "number of values"),
    word("spacing", || vec!["linear", "log"], "spacing of count values").or_else("linear"),
    text("zip", "a word that other axes share", "axes with the same word step together"),
    text("label", "words for the plots", "name of the axis in plots").or_else("the key in words"),
];

const PLOT: &[Key] = &[
    word("kind", || vec!["curve", "heat", "crossing"], "kind of picture").or_else("curve"),
    text("title", "a title", "title above the picture").or_else("the figure in words"),
    text("label", "words with the unit", "name of the figure in the picture").or_else("the figure in words"),
    text("x", "one of the axes", "horizontal axis").required(),
    text(
        "y",
        "one of the figures, or of the axes for kind = \"heat\"",
        "figure of a curve, or second axis of a heat map",
    ),
    text("z", "one of the figures", "figure of a heat map or a crossing"),
    text("series", "one of the axes", "axis that distinguishes curves"),
    text("panel", "one of the axes", "axis that distinguishes pictures"),
    text("along", "one of the axes", "axis along which the figure crosses the level"),
    number("level", -ANY, ANY, "", "level of a crossing"),
    flag("log_x", "logarithmic horizontal axis"),
    flag("log_y", "logarithmic vertical axis"),
    foreign("where", "axes and one value of each", "fixed values of the other axes"),
];
