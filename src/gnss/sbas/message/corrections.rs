//! The field tables of the blocks of corrections: positions count from 0, the first bit of a block; of half a
//! block of long-term corrections, the first bit of the half (RTCA DO-229D, A.4.4.2 to A.4.4.10). Fields that
//! are there for each satellite of a mask, or each point of a grid, are numbered from 1.

use super::content::{take_word, word};
use crate::augmentation::{Degradation, Delays, Fast, GridMask, Integrity, LongTerm, Mask};
use crate::bits::Kind::{Signed, Unsigned, Whole};
use crate::bits::{Element, Field, element};

const MASK_CLAUSE: &str = "A.4.4.2";
const FAST_CLAUSE: &str = "A.4.4.3, figure A-7";
const INTEGRITY_CLAUSE: &str = "A.4.4.4, figure A-8";
const AGEING_CLAUSE: &str = "A.4.4.5, table A-7";
const LONG_CLAUSE: &str = "A.4.4.7, tables A-10 and A-11";
const MIXED_CLAUSE: &str = "A.4.4.8";
const GRID_CLAUSE: &str = "A.4.4.9, table A-15";
const DELAY_CLAUSE: &str = "A.4.4.10, table A-16";

/// A count that is kept as such: `count!(name, first bit, length, clause, path of the part)`.
macro_rules! count {
    ($name:expr, $first:expr, $length:literal, $clause:expr, $($part:tt)+) => {
        element(
            Field::new($name, &[($first, $length)], Whole, 0, $clause),
            |of| f64::from(of.$($part)+),
            |of, value| of.$($part)+ = value as u8,
        )
    };
}

/// Thirty numbers of a mask: `numbers!(name, part, first number, first bit, bits, clause)`; those beyond the
/// bits are none.
macro_rules! numbers {
    ($name:literal, $part:ident, $number:literal, $first:literal, $bits:literal, $clause:expr) => {
        element(
            Field::new($name, &[($first, $bits)], Whole, 0, $clause),
            |mask| word(&mask.$part, $number) / f64::from(1_u32 << (30 - $bits)),
            |mask, bits| take_word(&mut mask.$part, $number, bits * f64::from(1_u32 << (30 - $bits))),
        )
    };
}

/// Fast corrections: `corrections!(first bit, clause, slots)`.
macro_rules! corrections {
    ($first:literal, $clause:expr, $($slot:literal)*) => {
        [$(element(
            Field::new(concat!("prc_", $slot, "_m"), &[($first + 12 * ($slot - 1), 12)], Signed, -3, $clause),
            |fast: &Fast| fast.correction_m[$slot - 1],
            |fast, value| fast.correction_m[$slot - 1] = value,
        )),*]
    };
}

macro_rules! indicators {
    ($of:ty, $part:ident, $name:literal, $first:literal, $clause:expr, $($slot:literal)*) => {
        [$(element(
            Field::new(concat!($name, "_", $slot), &[($first + 4 * ($slot - 1), 4)], Whole, 0, $clause),
            |of: &$of| f64::from(of.$part[$slot - 1]),
            |of, value| of.$part[$slot - 1] = value as u8,
        )),*]
    };
}

/// The arguments of another macro, then the numbers of the satellites of a mask.
macro_rules! of_all {
    ($each:ident, $($argument:tt)*) => {
        $each!($($argument)* 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32 33
            34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51)
    };
}

/// Type 1.
#[rustfmt::skip]
pub(super) static MASK: [&[Element<Mask>]; 1] = [&[
    numbers!("mask_1_to_30", numbers, 1, 14, 30, MASK_CLAUSE),
    numbers!("mask_31_to_60", numbers, 31, 44, 30, MASK_CLAUSE),
    numbers!("mask_61_to_90", numbers, 61, 74, 30, MASK_CLAUSE),
    numbers!("mask_91_to_120", numbers, 91, 104, 30, MASK_CLAUSE),
    numbers!("mask_121_to_150", numbers, 121, 134, 30, MASK_CLAUSE),
    numbers!("mask_151_to_180", numbers, 151, 164, 30, MASK_CLAUSE),
    numbers!("mask_181_to_210", numbers, 181, 194, 30, MASK_CLAUSE),
    count!("iodp", 224, 2, MASK_CLAUSE, iodp),
]];

/// Types 2 to 5, and 0.
pub(super) static FAST: [&[Element<Fast>]; 3] = [
    &[count!("iodf", 14, 2, FAST_CLAUSE, iodf), count!("iodp", 16, 2, FAST_CLAUSE, iodp)],
    &corrections!(18, FAST_CLAUSE, 1 2 3 4 5 6 7 8 9 10 11 12 13),
    &indicators!(Fast, udrei, "udrei", 174, FAST_CLAUSE, 1 2 3 4 5 6 7 8 9 10 11 12 13),
];

/// Type 6.
pub(super) static INTEGRITY: [&[Element<Integrity>]; 2] = [
    &[
        count!("iodf_of_2", 14, 2, INTEGRITY_CLAUSE, iodf[0]),
        count!("iodf_of_3", 16, 2, INTEGRITY_CLAUSE, iodf[1]),
        count!("iodf_of_4", 18, 2, INTEGRITY_CLAUSE, iodf[2]),
        count!("iodf_of_5", 20, 2, INTEGRITY_CLAUSE, iodf[3]),
    ],
    &of_all!(indicators, Integrity, udrei, "udrei", 22, INTEGRITY_CLAUSE,),
];

/// Type 7.
pub(super) static AGEING: [&[Element<Degradation>]; 2] = [
    &[count!("latency_s", 14, 4, AGEING_CLAUSE, latency_s), count!("iodp", 18, 2, AGEING_CLAUSE, iodp)],
    &of_all!(indicators, Degradation, indicators, "degradation", 22, AGEING_CLAUSE,),
];

/// The fast half of type 24.
pub(super) static MIXED: [&[Element<Fast>]; 3] = [
    &[
        count!("iodp", 110, 2, MIXED_CLAUSE, iodp),
        count!("part", 112, 2, MIXED_CLAUSE, part),
        count!("iodf", 114, 2, MIXED_CLAUSE, iodf),
    ],
    &corrections!(14, MIXED_CLAUSE, 1 2 3 4 5 6),
    &indicators!(Fast, udrei, "udrei", 86, MIXED_CLAUSE, 1 2 3 4 5 6),
];

/// Flag for rates in half a block of long-term corrections.
pub(super) const VELOCITY_CODE: Field = Field::new("velocity_code", &[(0, 1)], Whole, 0, LONG_CLAUSE);

/// A half and the issue of the mask.
type Of<T> = Element<(u8, T)>;

macro_rules! steady {
    ($which:literal, $first:literal, $mark:literal) => {
        [
            count!(concat!("mask_place_", $mark), $first, 6, LONG_CLAUSE, 1[$which].place),
            count!(concat!("iode_", $mark), $first + 6, 8, LONG_CLAUSE, 1[$which].iode),
            steady!($which, concat!("dx_", $mark, "_m"), $first + 14, 0),
            steady!($which, concat!("dy_", $mark, "_m"), $first + 23, 1),
            steady!($which, concat!("dz_", $mark, "_m"), $first + 32, 2),
            element(
                Field::new(concat!("daf0_", $mark, "_s"), &[($first + 41, 10)], Signed, -31, LONG_CLAUSE),
                |half: &(u8, [LongTerm; 2])| half.1[$which].af0_s,
                |half, value| half.1[$which].af0_s = value,
            ),
        ]
    };
    ($which:literal, $name:expr, $first:expr, $axis:literal) => {
        element(
            Field::new($name, &[($first, 9)], Signed, -3, LONG_CLAUSE),
            |half: &(u8, [LongTerm; 2])| half.1[$which].place_m[$axis],
            |half, value| half.1[$which].place_m[$axis] = value,
        )
    };
}

/// Half of type 24 or 25 with velocity code 0.
pub(super) static HALF_STEADY: [&[Of<[LongTerm; 2]>]; 3] =
    [&steady!(0, 1, "1"), &steady!(1, 52, "2"), &[count!("iodp", 103, 2, LONG_CLAUSE, 0)]];

macro_rules! moving {
    ($name:literal, $first:literal, $bits:literal, $power:literal, $($part:tt)+) => {
        element(
            Field::new($name, &[($first, $bits)], Signed, $power, LONG_CLAUSE),
            |half: &(u8, LongTerm)| half.1.$($part)+,
            |half, value| half.1.$($part)+ = value,
        )
    };
}

/// Half of type 24 or 25 with velocity code 1.
#[rustfmt::skip]
pub(super) static HALF_MOVING: [&[Of<LongTerm>]; 1] = [&[
    count!("mask_place", 1, 6, LONG_CLAUSE, 1.place),
    count!("iode", 7, 8, LONG_CLAUSE, 1.iode),
    moving!("dx_m", 15, 11, -3, place_m[0]),
    moving!("dy_m", 26, 11, -3, place_m[1]),
    moving!("dz_m", 37, 11, -3, place_m[2]),
    moving!("daf0_s", 48, 11, -31, af0_s),
    moving!("dvx_mps", 59, 8, -11, velocity_mps[0]),
    moving!("dvy_mps", 67, 8, -11, velocity_mps[1]),
    moving!("dvz_mps", 75, 8, -11, velocity_mps[2]),
    moving!("daf1_sps", 83, 8, -39, af1_sps),
    element(
        Field::new("t0_s", &[(91, 13)], Whole, 4, LONG_CLAUSE),
        |half| half.1.second_of_day,
        |half, value| half.1.second_of_day = value,
    ),
    count!("iodp", 104, 2, LONG_CLAUSE, 0),
]];

/// Type 18.
#[rustfmt::skip]
pub(super) static GRID_MASK: [&[Element<GridMask>]; 1] = [&[
    count!("bands", 14, 4, GRID_CLAUSE, bands),
    count!("band", 18, 4, GRID_CLAUSE, band),
    count!("iodi", 22, 2, GRID_CLAUSE, iodi),
    numbers!("points_1_to_30", points, 1, 24, 30, GRID_CLAUSE),
    numbers!("points_31_to_60", points, 31, 54, 30, GRID_CLAUSE),
    numbers!("points_61_to_90", points, 61, 84, 30, GRID_CLAUSE),
    numbers!("points_91_to_120", points, 91, 114, 30, GRID_CLAUSE),
    numbers!("points_121_to_150", points, 121, 144, 30, GRID_CLAUSE),
    numbers!("points_151_to_180", points, 151, 174, 30, GRID_CLAUSE),
    numbers!("points_181_to_201", points, 181, 204, 21, GRID_CLAUSE),
]];

macro_rules! delays {
    ($($slot:literal)*) => {
        [$(element(
            Field::new(concat!("delay_", $slot, "_m"), &[(22 + 13 * ($slot - 1), 9)], Unsigned, -3, DELAY_CLAUSE),
            |delays: &Delays| delays.vertical_m[$slot - 1],
            |delays, value| delays.vertical_m[$slot - 1] = value,
        )),*]
    };
}

macro_rules! givei {
    ($($slot:literal)*) => {
        [$(count!(concat!("givei_", $slot), 31 + 13 * ($slot - 1), 4, DELAY_CLAUSE, givei[$slot - 1])),*]
    };
}

/// Type 26.
pub(super) static DELAYS: [&[Element<Delays>]; 3] = [
    &[
        count!("band", 14, 4, DELAY_CLAUSE, band),
        count!("block", 18, 4, DELAY_CLAUSE, part),
        count!("iodi", 217, 2, DELAY_CLAUSE, iodi),
    ],
    &delays!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15),
    &givei!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15),
];

/// The fields of each type of block.
pub(super) fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    fn all<T>(tables: &'static [&'static [Element<T>]]) -> Vec<&'static Field> {
        tables.iter().flat_map(|table| table.iter().map(|element| &element.field)).collect()
    }
    vec![
        ("type 1", all(&MASK)),
        ("types 0 and 2 to 5", all(&FAST)),
        ("type 6", all(&INTEGRITY)),
        ("type 7", all(&AGEING)),
        ("type 18", all(&GRID_MASK)),
        ("type 24, first half", all(&MIXED)),
        ("types 24 and 25, half with velocity code 0", all(&HALF_STEADY)),
        ("types 24 and 25, half with velocity code 1", all(&HALF_MOVING)),
        ("type 26", all(&DELAYS)),
    ]
}
