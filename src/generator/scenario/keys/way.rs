//! Keys of propagation between satellites and antenna.

use super::{A_PATH, SATELLITES};
use crate::effect::city::material::{MATERIALS, Material};
use crate::scenario::schema::{Key, flag, integer, list, number, numbers, text, time, word, words};

const KLOBUCHAR: &[&str] = &["klobuchar"];
const SHELL: &[&str] = &["constant_tec", "ionex"];
const IONEX: &[&str] = &["ionex"];
/// Eight-bit integers times 2^-24 and 2^16 at most (IS-GPS-200N, table 20-X).
const ALPHA: (f64, f64) = (-1e-4, 1e-4);
const BETA: (f64, f64) = (-1e7, 1e7);

/// Range of the coefficients that word 5 of I/NAV can carry (Galileo OS SIS ICD, table 65).
const AI: (f64, f64) = (-4.0, 511.75);

/// Range of the coefficients that B-CNAV1, B-CNAV2 and B-CNAV3 can carry, α₅ below zero and α₁ above
/// (BDS-SIS-ICD-B1C 1.0, 7.8).
const BDGIM: (f64, f64) = (-31.875, 127.875);

pub(crate) const IONOSPHERE: &[Key] = &[
    word("model", || vec!["klobuchar", "constant_tec", "ionex", "nequick_g", "bdgim"], "model of the electron content")
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
    number("vtec_tecu", 0.0, 1000.0, "TECU", "vertical electron content everywhere").required().of(&["constant_tec"]),
    number("shell_km", 100.0, 1000.0, "km", "height of the shell; the default is that of IGS maps")
        .or(450.0)
        .of(&["constant_tec"]),
    text("file", A_PATH, "maps of the electron content, IONEX, plain or gzip").required().of(IONEX),
    time("map_start", "time in the maps that corresponds to the scene's start").or_else("the scene's start").of(IONEX),
    word("interpolation", || vec!["bilinear", "bicubic"], "interpolation between the grid points")
        .or_else("bilinear")
        .of(IONEX),
    word("mapping", || vec!["single_layer", "modified_single_layer"], "mapping from vertical to slant delay")
        .or_else("single_layer")
        .of(SHELL),
    numbers("broadcast_alpha", 4, ALPHA, "as alpha", "broadcast alpha; with broadcast_beta")
        .or_else("alpha, or the navigation file's"),
    numbers("broadcast_beta", 4, BETA, "as beta", "broadcast beta; with broadcast_alpha")
        .or_else("beta, or the navigation file's"),
    numbers("broadcast_ai", 3, AI, "as ai", "coefficients that Galileo broadcasts")
        .or_else("ai, or the navigation file's"),
    numbers(
        "broadcast_bdgim_tecu",
        9,
        BDGIM,
        "as bdgim_tecu",
        "coefficients that BeiDou-3 broadcasts; nine zeros mean none",
    )
    .or_else("bdgim_tecu, or the navigation file's"),
];

pub(crate) const TROPOSPHERE: &[Key] = &[
    word("model", || vec!["saastamoinen"], "model of the zenith delays").required(),
    number("height_m", -500.0, 9_000.0, "m", "height of the weather measurement").or(0.0),
    number("pressure_hpa", 1.0, 1100.0, "hPa", "air pressure at height_m").or(1013.25),
    number("temperature_c", -90.0, 60.0, "C", "air temperature at height_m").or(15.0),
    number("relative_humidity", 0.0, 1.0, "(a fraction)", "relative humidity at height_m").or(0.5),
    text(
        "gpt3_file",
        A_PATH,
        "GPT3 grid: weather and mapping coefficients by position and day, in place of the weather keys",
    ),
    word("mapping", || vec!["niell", "cosecant", "vmf1", "vmf3"], "mapping function from zenith to slant delay")
        .or_else("niell"),
    text("vmf_file", A_PATH, "coefficients for vmf1 or vmf3, a grid file of TU Wien").or_else("those of gpt3_file"),
];

const GIVEN: &[&str] = &["given"];
const WALL: &[&str] = &["wall"];
const PLANES: &[&str] = &["ground", "wall"];

pub(crate) const MULTIPATH: &[Key] = &[
    word("kind", || vec!["given", "ground", "wall"], "kind of reflector").required(),
    // Where the direct ray goes through a wall or leaves, its echo may be the stronger; planes reflect no
    // more than they get.
    number("amplitude", 0.0, 10.0, "(of the direct ray's)", "amplitude of the reflected ray").required().of(GIVEN),
    number("amplitude", 0.0, 1.0, "(of the direct ray's)", "amplitude of the reflected ray").required().of(PLANES),
    // A surface turns the field round unless the scenario says otherwise.
    number("phase_deg", -360.0, 360.0, "deg", "carrier phase shift at the reflection").or(0.0).of(GIVEN),
    number("phase_deg", -360.0, 360.0, "deg", "carrier phase shift at the reflection").or(180.0).of(PLANES),
    words(
        "satellites",
        "an array of satellites like [\"G01\", \"G12\"], or absent for all",
        "satellites whose signals are reflected",
    )
    .or_else("all"),
    number("excess_m", 0.0, 1e5, "m", "excess path length over the direct ray at the scene's start")
        .required()
        .of(GIVEN),
    number("rate_mps", -1e3, 1e3, "m/s", "rate of the excess path length").or(0.0).of(GIVEN),
    number("height_m", 0.0, 1e4, "m", "height of the antenna above the ground").required().of(&["ground"]),
    number("azimuth_deg", -360.0, 360.0, "deg", "azimuth of the wall").required().of(WALL),
    number("distance_m", 0.01, 1e4, "m", "distance to the wall at the scene's start").required().of(WALL),
];

/// Names of the materials of walls.
fn materials() -> Vec<&'static str> {
    MATERIALS.iter().map(Material::name).collect()
}

pub(crate) const CITY: &[Key] = &[
    text("file", A_PATH, "walls and roofs, CityJSON 1.0, 1.1 or 2.0").required(),
    text("lod", "a level of detail like \"2.2\", or \"2\" for all of 2", "level of detail that is used")
        .or_else("the highest of each object"),
    number("radius_m", 1.0, 5_000.0, "m", "distance from the antenna's way within which surfaces are used").or(300.0),
    word("material", materials, "material of walls and roofs, with the constants of ITU-R P.2040-3")
        .or_else("concrete"),
    number("permittivity", 1.0, 100.0, "", "relative permittivity, in place of material; with conductivity_spm"),
    number("conductivity_spm", 0.0, 1e8, "S/m", "conductivity, in place of material; with permittivity"),
    integer("order", 0, 2, "largest number of reflections of a ray; 0: walls obstruct and do not reflect").or(1.0),
    flag("diffraction", "diffraction at edges (ITU-R P.526); false: a ray that is not clear of an edge fades out")
        .or_else("true"),
    number("cross_polar_db", 0.0, 100.0, "dB", "attenuation by the antenna of left-hand circular waves").or(10.0),
    number("latitude_deg", -90.0, 90.0, "deg", "latitude of origin_m, with longitude_deg and height_m")
        .or_else("by the file's reference system"),
    number("longitude_deg", -180.0, 180.0, "deg", "longitude of origin_m, with latitude_deg and height_m")
        .or_else("by the file's reference system"),
    number("height_m", -1e4, 1e4, "m", "height above the ellipsoid of origin_m, or of the reference system's zero")
        .or_else("of zero: the geoid's, where the system counts from the sea"),
    numbers("origin_m", 3, (-1e8, 1e8), "m", "coordinates in the file of the point at latitude_deg and longitude_deg")
        .or_else("[0, 0, 0]"),
];

const HORIZON: &[&str] = &["horizon"];
const SECTOR: &[&str] = &["sector"];
const BUILDING: &[&str] = &["building"];

pub(crate) const OBSTRUCTION: &[Key] = &[
    word("kind", || vec!["horizon", "sector", "building"], "shape of the obstruction").required(),
    list("azimuth_deg", 0.0, 360.0, "deg", "azimuths of the points of the horizon, ascending").required().of(HORIZON),
    list("elevation_deg", -10.0, 90.0, "deg", "elevations of the points of the horizon").required().of(HORIZON),
    number("from_deg", -360.0, 360.0, "deg", "first azimuth of the sector, clockwise").required().of(SECTOR),
    number("to_deg", -360.0, 360.0, "deg", "last azimuth of the sector").required().of(SECTOR),
    number("roof_deg", -10.0, 90.0, "deg", "elevation of the roof").required().of(SECTOR),
    numbers("east_m", 2, (-1e4, 1e4), "m", "east coordinates of the west and east sides, from the start of the motion")
        .required()
        .of(BUILDING),
    numbers(
        "north_m",
        2,
        (-1e4, 1e4),
        "m",
        "north coordinates of the south and north sides, from the start of the motion",
    )
    .required()
    .of(BUILDING),
    number("top_m", -1e4, 1e4, "m", "height of the top above the start of the motion").required().of(BUILDING),
    // From ν = −1 to 1, 2·sqrt(λd/2), behind a skyline 1.2 km away.
    number("edge_deg", 0.01, 45.0, "deg", "width of the edge over which the ray fades")
        .or(1.0)
        .of(&["horizon", "sector"]),
    number("loss_db", 0.0, 100.0, "dB", "loss behind the obstruction").or_else("all is lost"),
];

pub(crate) const SCINTILLATION: &[Key] = &[
    number(
        "s4",
        0.0,
        1.0,
        "",
        "amplitude scintillation index S4 on 1575.42 MHz; it scales with f^-1.5 to other carriers, up to 1",
    )
    .required(),
    number(
        "sigma_phi_rad",
        0.0,
        3.0,
        "rad",
        "standard deviation of the phase on 1575.42 MHz; it scales with 1/f to other carriers",
    )
    .or_else("what comes with s4"),
    number("decorrelation_s", 0.05, 30.0, "s", "decorrelation time of the fading").required(),
    words("satellites", SATELLITES, "affected satellites").or_else("all"),
];
