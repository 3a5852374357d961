//! The field tables of B-CNAV1: positions count from 0, the first bit of a subframe (BDS-SIS-ICD-B1C 1.0,
//! figures 6-5 to 6-9, tables 7-2 to 7-7).

use super::almanac::{OF_MEDIUM, OF_REDUCED};
use crate::beidou::bcnav::blocks::{self, Of};
use crate::beidou::bcnav::{self, Tables};
use crate::bits::Kind::{Signed, Whole};
use crate::bits::{Field, element, plain};

const TIME: &str = "7.3";
const DELAYS: &str = "7.6, table 7-7";
const HEALTH: &str = "7.14 to 7.17";

/// The beginning of subframe 2.
static BEGIN: [Of; 4] = [
    blocks::week::<0>(),
    element(Field::new("how_1h", &[(13, 8)], Whole, 0, TIME), |c| (c.sent.tow_whole_s() / 3600) as f64, |_, _| {}),
    blocks::iodc::<21>(),
    blocks::iode::<31>(),
];
static FIRST_HALF: [Of; 9] = blocks::first_half::<39>();
static SECOND_HALF: [Of; 10] = blocks::second_half::<242>();
static CLOCK: [Of; 4] = blocks::clock::<464>();
static DELAY: [Of; 4] = [
    plain!("tgd_b2ap_s", [(533, 12)], Signed, -34, DELAYS, set.tgd2_s),
    plain!("isc_b1cd_s", [(545, 12)], Signed, -34, DELAYS, set.isc_s[0]),
    plain!("tgd_b1cp_s", [(557, 12)], Signed, -34, DELAYS, set.tgd_s),
    plain!("reserved", [(569, 7)], Whole, 0, DELAYS, reserved),
];
/// Fields with which all pages of subframe 3 begin.
static HEADER: [Of; 4] = [
    plain!("page", [(0, 6)], Whole, 0, HEALTH, page),
    blocks::health::<6>(),
    blocks::flags::<8>(),
    blocks::sismai::<11>(),
];

/// Field that only page 1 has after the header.
static ALONG: [Of; 1] = [blocks::accuracy_along::<15>()];
static ACCURACIES: [Of; 4] = blocks::accuracies::<20>();
static ELECTRONS: [Of; 9] = blocks::electrons::<42>();
static UTC: [Of; 9] = blocks::utc::<116>();

/// Fields of subframe 2, all of which belong to the ephemeris.
pub(super) static TWO: &Tables = &[&BEGIN, &FIRST_HALF, &SECOND_HALF, &CLOCK, &DELAY];
pub(super) static THREE: &Tables = &[&HEADER];
pub(super) static SET: &Tables = &[&BEGIN, &FIRST_HALF, &SECOND_HALF, &CLOCK, &DELAY, &HEADER];

/// Fields of page 1 of subframe 3 that do not belong to the ephemeris.
pub(super) static BESIDE: &Tables = &[&ALONG, &ACCURACIES, &ELECTRONS, &UTC];

/// Lists every field by the subframe that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    bcnav::fields(&[
        ("subframe 2", TWO),
        ("subframe 3", THREE),
        ("subframe 3, page 1", BESIDE),
        ("subframe 3, page 2", &OF_REDUCED),
        ("subframe 3, page 4", &OF_MEDIUM),
    ])
}
