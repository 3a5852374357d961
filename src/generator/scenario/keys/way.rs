//! Keys of what lies between satellites and antenna.

use super::{A_PATH, SATELLITES};
use crate::scenario::schema::{Key, list, number, numbers, text, time, word, words};

const KLOBUCHAR: &[&str] = &["klobuchar"];
const SHELL: &[&str] = &["constant_tec", "ionex"];
const IONEX: &[&str] = &["ionex"];
/// Eight-bit integers times 2^-24 and 2^16 at most (IS-GPS-200N, table 20-X).
const ALPHA: (f64, f64) = (-1e-4, 1e-4);
const BETA: (f64, f64) = (-1e7, 1e7);

/// What word 5 of I/NAV carries at most (Galileo OS SIS ICD, table 65).
const AI: (f64, f64) = (-4.0, 511.75);

/// What the fields of B-CNAV1, B-CNAV2 and B-CNAV3 carry at most, α₅ below zero and α₁ above
/// (BDS-SIS-ICD-B1C 1.0, 7.8).
const BDGIM: (f64, f64) = (-31.875, 127.875);

pub(crate) const IONOSPHERE: &[Key] = &[
    word("model", || vec!["klobuchar", "constant_tec", "ionex", "nequick_g", "bdgim"], "where the electrons are")
        .required(),
    numbers("alpha", 4, ALPHA, "s, by powers of semicircles", "amplitude of the true delay; with beta")
        .or_else("the navigation file's")
        .of(KLOBUCHAR),
    numbers("beta", 4, BETA, "s, by powers of semicircles", "period of the true delay; with alpha")
        .or_else("the navigation file's")
        .of(KLOBUCHAR),
    numbers("ai", 3, AI, "sfu, sfu/deg, sfu/deg^2", "effective ionisation by modified dip")
        .or_else("the navigation file's (GAL)")
        .of(&["nequick_g"]),
    numbers("bdgim_tecu", 9, BDGIM, "TECU", "coefficients of BeiDou's global model, not all zero")
        .or_else("the navigation file's (CNVX)")
        .of(&["bdgim"]),
    number("vtec_tecu", 0.0, 1000.0, "TECU", "vertical content everywhere").required().of(&["constant_tec"]),
    number("shell_km", 100.0, 1000.0, "km", "height of the shell; the default is that of the IGS's maps")
        .or(450.0)
        .of(&["constant_tec"]),
    text("file", A_PATH, "maps of the electron content, IONEX, plain or gzip").required().of(IONEX),
    time("map_start", "instant of the maps that is taken for the scene's start").or_else("the scene's start").of(IONEX),
    word("interpolation", || vec!["bilinear", "bicubic"], "between the maps' points").or_else("bilinear").of(IONEX),
    word("mapping", || vec!["single_layer", "modified_single_layer"], "from vertical to slant")
        .or_else("single_layer")
        .of(SHELL),
    numbers("broadcast_alpha", 4, ALPHA, "as alpha", "what the satellites broadcast; with broadcast_beta")
        .or_else("alpha, or the navigation file's"),
    numbers("broadcast_beta", 4, BETA, "as beta", "what the satellites broadcast; with broadcast_alpha")
        .or_else("beta, or the navigation file's"),
    numbers("broadcast_ai", 3, AI, "as ai", "what Galileo's satellites broadcast")
        .or_else("ai, or the navigation file's"),
    numbers(
        "broadcast_bdgim_tecu",
        9,
        BDGIM,
        "as bdgim_tecu",
        "what BeiDou's satellites of the third generation \
             broadcast; nine zeros: nothing",
    )
    .or_else("bdgim_tecu, or the navigation file's"),
];

pub(crate) const TROPOSPHERE: &[Key] = &[
    word("model", || vec!["saastamoinen"], "zenith delays").required(),
    number("height_m", -500.0, 9_000.0, "m", "where the weather was measured").or(0.0),
    number("pressure_hpa", 1.0, 1100.0, "hPa", "air pressure there").or(1013.25),
    number("temperature_c", -90.0, 60.0, "C", "temperature there").or(15.0),
    number("relative_humidity", 0.0, 1.0, "(a fraction)", "relative humidity there").or(0.5),
    text("gpt3_file", A_PATH, "weather and mapping coefficients by place and day (GPT3), in place of the weather"),
    word("mapping", || vec!["niell", "cosecant", "vmf1", "vmf3"], "from zenith to slant").or_else("niell"),
    text("vmf_file", A_PATH, "coefficients of vmf1 or vmf3, a grid of TU Wien's").or_else("those of gpt3_file"),
];

const GIVEN: &[&str] = &["given"];
const WALL: &[&str] = &["wall"];
const PLANES: &[&str] = &["ground", "wall"];

pub(crate) const MULTIPATH: &[Key] = &[
    word("kind", || vec!["given", "ground", "wall"], "where it is reflected").required(),
    // Where the direct ray goes through a wall or leaves, its echo may be the stronger; planes reflect no
    // more than they get.
    number("amplitude", 0.0, 10.0, "(of the direct ray's)", "of the reflected ray").required().of(GIVEN),
    number("amplitude", 0.0, 1.0, "(of the direct ray's)", "of the reflected ray").required().of(PLANES),
    // A surface turns the field round unless the scenario says otherwise.
    number("phase_deg", -360.0, 360.0, "deg", "turn of the carrier at the reflection").or(0.0).of(GIVEN),
    number("phase_deg", -360.0, 360.0, "deg", "turn of the carrier at the reflection").or(180.0).of(PLANES),
    words("satellites", "an array of satellites like [\"G01\", \"G12\"], or absent for all", "whose ray it is")
        .or_else("all"),
    number("excess_m", 0.0, 1e5, "m", "longer than the direct path by this at the start").required().of(GIVEN),
    number("rate_mps", -1e3, 1e3, "m/s", "growth of that").or(0.0).of(GIVEN),
    number("height_m", 0.0, 1e4, "m", "antenna above the ground").required().of(&["ground"]),
    number("azimuth_deg", -360.0, 360.0, "deg", "direction to the wall").required().of(WALL),
    number("distance_m", 0.01, 1e4, "m", "to the wall at the start").required().of(WALL),
];

const HORIZON: &[&str] = &["horizon"];
const SECTOR: &[&str] = &["sector"];
const BUILDING: &[&str] = &["building"];

pub(crate) const OBSTRUCTION: &[Key] = &[
    word("kind", || vec!["horizon", "sector", "building"], "its shape").required(),
    list("azimuth_deg", 0.0, 360.0, "deg", "points of the horizon, ascending").required().of(HORIZON),
    list("elevation_deg", -10.0, 90.0, "deg", "its elevation at these").required().of(HORIZON),
    number("from_deg", -360.0, 360.0, "deg", "azimuth at which the sector begins, clockwise").required().of(SECTOR),
    number("to_deg", -360.0, 360.0, "deg", "where it ends").required().of(SECTOR),
    number("roof_deg", -10.0, 90.0, "deg", "elevation up to which it blocks").required().of(SECTOR),
    numbers("east_m", 2, (-1e4, 1e4), "m", "west and east side, from where the motion starts").required().of(BUILDING),
    numbers("north_m", 2, (-1e4, 1e4), "m", "south and north side").required().of(BUILDING),
    number("top_m", -1e4, 1e4, "m", "top above the antenna's start").required().of(BUILDING),
    // From ν = −1 to 1, 2·sqrt(λd/2), behind a skyline 1.2 km away.
    number("edge_deg", 0.01, 45.0, "deg", "width of the edge over which the ray is lost")
        .or(1.0)
        .of(&["horizon", "sector"]),
    number("loss_db", 0.0, 100.0, "dB", "loss behind it").or_else("all is lost"),
];

pub(crate) const SCINTILLATION: &[Key] = &[
    number("s4", 0.0, 1.0, "", "index of the amplitude's fading on 1575.42 MHz; on others as f^-1.5, up to 1")
        .required(),
    number("sigma_phi_rad", 0.0, 3.0, "rad", "spread of the phase on 1575.42 MHz; on others as 1/f")
        .or_else("what comes with s4"),
    number("decorrelation_s", 0.05, 30.0, "s", "time after which fading is another").required(),
    words("satellites", SATELLITES, "whose signals").or_else("all"),
];
