//! The field tables of the blocks that bound corrections, and of almanacs: positions count from 0, the first
//! bit of a block (RTCA DO-229D, A.4.4.6, A.4.4.12, A.4.4.13 and A.4.4.16). Steps that are no powers of two
//! are counted by their fields.

use crate::augmentation::{Almanacs, Covariances, Factors, Service};
use crate::bits::Kind::{Signed, Unsigned, Whole};
use crate::bits::{Element, Field, element};

const FACTOR_CLAUSE: &str = "A.4.4.6, table A-9";
const ALMANAC_CLAUSE: &str = "A.4.4.12, table A-17";
const SERVICE_CLAUSE: &str = "A.4.4.13, table A-21";
const COVARIANCE_CLAUSE: &str = "A.4.4.16, table A-23";

/// Steps of almanacs in the plane of the equator and across it.
const PLACE_M: [f64; 2] = [2600.0, 26_000.0];
const SPEED_MPS: [f64; 2] = [10.0, 60.0];
/// Seconds of the steps in which an almanac's time counts.
const ALMANAC_STEP_S: f64 = 64.0;

/// Factor of degradation: `factor!(name, first bit, bits, step, part)`.
macro_rules! factor {
    ($name:literal, $first:literal, $bits:literal, $step:literal, $part:ident) => {
        element(
            Field::new($name, &[($first, $bits)], Unsigned, 0, FACTOR_CLAUSE),
            |factors: &Factors| factors.$part / $step,
            |factors, steps| factors.$part = steps * $step,
        )
    };
}

macro_rules! flag {
    ($name:literal, $first:literal, $part:ident) => {
        element(
            Field::new($name, &[($first, 1)], Whole, 0, FACTOR_CLAUSE),
            |factors: &Factors| f64::from(u8::from(factors.$part)),
            |factors, value| factors.$part = value > 0.0,
        )
    };
}

/// Type 10.
#[rustfmt::skip]
pub(super) static FACTORS: [&[Element<Factors>]; 1] = [&[
    factor!("b_rrc_m", 14, 10, 0.002, b_rrc_m),
    factor!("c_ltc_lsb_m", 24, 10, 0.002, c_ltc_lsb_m),
    factor!("c_ltc_v1_mps", 34, 10, 0.000_05, c_ltc_v1_mps),
    factor!("i_ltc_v1_s", 44, 9, 1.0, i_ltc_v1_s),
    factor!("c_ltc_v0_m", 53, 10, 0.002, c_ltc_v0_m),
    factor!("i_ltc_v0_s", 63, 9, 1.0, i_ltc_v0_s),
    factor!("c_geo_lsb_m", 72, 10, 0.000_5, c_geo_lsb_m),
    factor!("c_geo_v_mps", 82, 10, 0.000_05, c_geo_v_mps),
    factor!("i_geo_s", 92, 9, 1.0, i_geo_s),
    factor!("c_er_m", 101, 6, 0.5, c_er_m),
    factor!("c_iono_step_m", 107, 10, 0.001, c_iono_step_m),
    factor!("i_iono_s", 117, 9, 1.0, i_iono_s),
    factor!("c_iono_ramp_mps", 126, 10, 0.000_005, c_iono_ramp_mps),
    flag!("rss_udre", 136, is_squared),
    flag!("rss_iono", 137, is_delay_squared),
    factor!("c_covariance", 138, 7, 0.1, c_covariance),
]];

/// An integer that is kept as such: `count!(name, first bit, bits, kind, clause, type, path of the part)`.
macro_rules! count {
    ($name:expr, $first:expr, $bits:literal, $clause:expr, $kind:ident as $type:ident, $($part:tt)+) => {
        element(
            Field::new($name, &[($first, $bits)], $kind, 0, $clause),
            |of| f64::from(of.$($part)+),
            |of, value| of.$($part)+ = value as $type,
        )
    };
}

macro_rules! almanac {
    ($place:literal, $mark:literal, $first:literal) => {
        [
            count!(concat!("data_", $mark), $first, 2, ALMANAC_CLAUSE, Whole as u8, each[$place].data),
            count!(concat!("number_", $mark), $first + 2, 8, ALMANAC_CLAUSE, Whole as u8, each[$place].number),
            count!(concat!("health_", $mark), $first + 10, 8, ALMANAC_CLAUSE, Whole as u8, each[$place].health),
            almanac!(concat!("x_", $mark, "_2600m"), $first + 18, 15, $place, position_m[0], PLACE_M[0]),
            almanac!(concat!("y_", $mark, "_2600m"), $first + 33, 15, $place, position_m[1], PLACE_M[0]),
            almanac!(concat!("z_", $mark, "_26km"), $first + 48, 9, $place, position_m[2], PLACE_M[1]),
            almanac!(concat!("vx_", $mark, "_10mps"), $first + 57, 3, $place, velocity_mps[0], SPEED_MPS[0]),
            almanac!(concat!("vy_", $mark, "_10mps"), $first + 60, 3, $place, velocity_mps[1], SPEED_MPS[0]),
            almanac!(concat!("vz_", $mark, "_60mps"), $first + 63, 4, $place, velocity_mps[2], SPEED_MPS[1]),
        ]
    };
    ($name:expr, $first:expr, $bits:literal, $place:literal, $part:ident[$axis:literal], $step:expr) => {
        element(
            Field::new($name, &[($first, $bits)], Signed, 0, ALMANAC_CLAUSE),
            |all: &Almanacs| all.each[$place].$part[$axis] / $step,
            |all, steps| all.each[$place].$part[$axis] = steps * $step,
        )
    };
}

/// Type 17.
pub(super) static ALMANACS: [&[Element<Almanacs>]; 4] = [
    &almanac!(0, "1", 14),
    &almanac!(1, "2", 81),
    &almanac!(2, "3", 148),
    &[element(
        Field::new("time_64s", &[(215, 11)], Whole, 0, ALMANAC_CLAUSE),
        |all| all.second_of_day / ALMANAC_STEP_S,
        |all, steps| all.second_of_day = steps * ALMANAC_STEP_S,
    )],
];

macro_rules! region {
    ($place:literal, $mark:literal, $first:literal) => {
        [
            region!(concat!("north_", $mark, "_1_deg"), $first, 8, $place, first_deg[0]),
            region!(concat!("east_", $mark, "_1_deg"), $first + 8, 9, $place, first_deg[1]),
            region!(concat!("north_", $mark, "_2_deg"), $first + 17, 8, $place, second_deg[0]),
            region!(concat!("east_", $mark, "_2_deg"), $first + 25, 9, $place, second_deg[1]),
            element(
                Field::new(concat!("shape_", $mark), &[($first + 34, 1)], Whole, 0, SERVICE_CLAUSE),
                |service: &Service| f64::from(u8::from(service.regions[$place].is_square)),
                |service, value| service.regions[$place].is_square = value > 0.0,
            ),
        ]
    };
    ($name:expr, $first:expr, $bits:literal, $place:literal, $part:ident[$axis:literal]) => {
        element(
            Field::new($name, &[($first, $bits)], Signed, 0, SERVICE_CLAUSE),
            |service: &Service| service.regions[$place].$part[$axis],
            |service, value| service.regions[$place].$part[$axis] = value,
        )
    };
}

/// Type 27.
pub(super) static SERVICE: [&[Element<Service>]; 6] = [
    &[
        count!("iods", 14, 3, SERVICE_CLAUSE, Whole as u8, iods),
        count!("messages", 17, 3, SERVICE_CLAUSE, Whole as u8, messages),
        count!("message", 20, 3, SERVICE_CLAUSE, Whole as u8, message),
        count!("regions", 23, 3, SERVICE_CLAUSE, Whole as u8, count),
        count!("priority", 26, 2, SERVICE_CLAUSE, Whole as u8, priority),
        count!("delta_udrei_inside", 28, 4, SERVICE_CLAUSE, Whole as u8, inside),
        count!("delta_udrei_outside", 32, 4, SERVICE_CLAUSE, Whole as u8, outside),
    ],
    &region!(0, "1", 36),
    &region!(1, "2", 71),
    &region!(2, "3", 106),
    &region!(3, "4", 141),
    &region!(4, "5", 176),
];

macro_rules! covariance {
    ($place:literal, $mark:literal, $first:literal) => {
        [
            count!(concat!("mask_place_", $mark), $first, 6, COVARIANCE_CLAUSE, Whole as u8, both[$place].place),
            count!(concat!("exponent_", $mark), $first + 6, 3, COVARIANCE_CLAUSE, Whole as u8, both[$place].exponent),
            covariance!(concat!("e11_", $mark), $first + 9, 9, $place, Whole as u16, diagonal[0]),
            covariance!(concat!("e22_", $mark), $first + 18, 9, $place, Whole as u16, diagonal[1]),
            covariance!(concat!("e33_", $mark), $first + 27, 9, $place, Whole as u16, diagonal[2]),
            covariance!(concat!("e44_", $mark), $first + 36, 9, $place, Whole as u16, diagonal[3]),
            covariance!(concat!("e12_", $mark), $first + 45, 10, $place, Signed as i16, above[0]),
            covariance!(concat!("e13_", $mark), $first + 55, 10, $place, Signed as i16, above[1]),
            covariance!(concat!("e14_", $mark), $first + 65, 10, $place, Signed as i16, above[2]),
            covariance!(concat!("e23_", $mark), $first + 75, 10, $place, Signed as i16, above[3]),
            covariance!(concat!("e24_", $mark), $first + 85, 10, $place, Signed as i16, above[4]),
            covariance!(concat!("e34_", $mark), $first + 95, 10, $place, Signed as i16, above[5]),
        ]
    };
    ($name:expr, $first:expr, $bits:literal, $place:literal, $kind:ident as $type:ident, $part:ident[$one:literal]) => {
        count!($name, $first, $bits, COVARIANCE_CLAUSE, $kind as $type, both[$place].$part[$one])
    };
}

/// Type 28.
pub(super) static COVARIANCES: [&[Element<Covariances>]; 3] = [
    &[count!("iodp", 14, 2, COVARIANCE_CLAUSE, Whole as u8, iodp)],
    &covariance!(0, "1", 16),
    &covariance!(1, "2", 121),
];

/// The fields of each type of block.
pub(super) fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    fn all<T>(tables: &'static [&'static [Element<T>]]) -> Vec<&'static Field> {
        tables.iter().flat_map(|table| table.iter().map(|element| &element.field)).collect()
    }
    vec![
        ("type 10", all(&FACTORS)),
        ("type 17", all(&ALMANACS)),
        ("type 27", all(&SERVICE)),
        ("type 28", all(&COVARIANCES)),
    ]
}
