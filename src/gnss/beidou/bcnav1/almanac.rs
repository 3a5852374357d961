//! Almanacs in pages 2 and 4 of subframe 3, and the order in which pages are sent.
//!
//! Source: BDS-SIS-ICD-B1C 1.0, 6.2.3, 7.9 (medium) and 7.10 (reduced). Page 2 has four reduced almanacs,
//! page 4 one of medium length; the document leaves the order of the pages open. Where BDGIM's coefficients
//! are known, odd frames of a week are page 1; the other frames go through the almanacs of all satellites
//! that are known. Who knows no satellite sends page 1 alone, or else page 2 without satellites.

use super::{Content, FRAME_S, WITH_ALMANACS, WITH_ELECTRONS, WITH_ONE};
use crate::beidou::bcnav::blank;
use crate::beidou::bcnav::blocks::{self, Of, kind, reference_axis_of_m};
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Field, element, plain};
use crate::broadcast::Ephemeris;
use crate::earth::GPS_PI;
use crate::message::{ALMANAC_STEP_S, Common, almanac_page, almanac_time};
use crate::satellite::{Sv, System};
use crate::time::{BDT, BDT_WEEK, Epoch};

const ALMANAC: &str = "7.9 and 7.10";
/// Satellites of page 2.
pub(in crate::beidou) const PLACES: usize = 4;
/// Inclination from which those of medium and of inclined orbits count, in semicircles.
const INCLINATION_SEMICIRCLES: f64 = 0.30;

/// One satellite in both kinds of almanac; number 0 for an entry without one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::beidou) struct Entry {
    pub number: f64,
    /// Type of the orbit, followed by the almanac's elements and clock terms.
    pub kind: f64,
    pub eccentricity: f64,
    pub delta_i_rad: f64,
    pub sqrt_a_sqrtm: f64,
    pub omega0_rad: f64,
    pub omega_dot_radps: f64,
    pub omega_rad: f64,
    pub m0_rad: f64,
    pub af0_s: f64,
    pub af1_sps: f64,
    /// Health in eight bits: the first is the satellite's, and the last three are those of B1C, B2a and B2b.
    pub health: f64,
    pub delta_a_m: f64,
    /// Argument of latitude, in radians.
    pub phi0_rad: f64,
}

impl Entry {
    /// Almanac elements of an ephemeris at an almanac's reference time, both labelled by BDT.
    fn of(set: &Ephemeris, toa: Epoch) -> Self {
        let mean = set.mean_at(toa);
        let semicircles = if set.sv.is_geostationary() { 0.0 } else { INCLINATION_SEMICIRCLES };
        Self {
            number: f64::from(set.sv.number),
            kind: kind(set.sv),
            eccentricity: set.eccentricity,
            delta_i_rad: mean.inclination_rad - semicircles * GPS_PI,
            sqrt_a_sqrtm: mean.sqrt_a_sqrtm,
            omega0_rad: mean.omega0_rad,
            omega_dot_radps: set.omega_dot_radps,
            omega_rad: set.omega_rad,
            m0_rad: mean.m0_rad,
            af0_s: mean.af0_s,
            af1_sps: set.af1_sps,
            health: if set.is_healthy() { 0.0 } else { 255.0 },
            delta_a_m: mean.sqrt_a_sqrtm * mean.sqrt_a_sqrtm - reference_axis_of_m(kind(set.sv)),
            phi0_rad: set.omega_rad + mean.m0_rad,
        }
    }

    /// True if both almanacs can represent the entry.
    fn fits(&self) -> bool {
        let fields = MEDIUM.iter().chain(&PLACE);
        let content = || blank(Ephemeris::blank(Sv { system: System::BeiDou, number: 1 }, Epoch::new(0, 0.0)));
        fields.into_iter().all(|element| element.raw_of(&Content { entries: [*self; PLACES], ..content() }).is_ok())
    }
}

/// The almanacs of the satellites, and their reference time by BDT.
pub(super) struct Almanacs {
    pub toa: Epoch,
    entries: Vec<Entry>,
}

impl Almanacs {
    /// Collects the almanacs of the satellites that a scene contains.
    pub fn of(common: &Common) -> Self {
        let toa = almanac_time(BDT.label(common.reference.unwrap_or(Epoch::new(0, 0.0))));
        let own = common.almanac.iter().filter(|set| set.sv.system == System::BeiDou);
        let entries = own.map(|set| Entry::of(&set.clone().timed(|at| BDT.label(at)), toa)).filter(Entry::fits);
        Self { toa, entries: entries.collect() }
    }

    /// Number of the page in the frame that begins at `start`, and the satellites in it.
    pub fn page_at(&self, has_electrons: bool, start: Epoch) -> (u8, [Entry; PLACES]) {
        let mut entries = [Entry::default(); PLACES];
        if has_electrons && (self.entries.is_empty() || is_first(start)) {
            return (WITH_ELECTRONS, entries);
        }
        let step_s = if has_electrons { 2 * FRAME_S } else { FRAME_S };
        let (is_reduced, shown) = almanac_page(&self.entries, PLACES, start.seconds().div_euclid(step_s));
        entries.iter_mut().zip(shown).for_each(|(place, entry)| *place = *entry);
        (if is_reduced { WITH_ALMANACS } else { WITH_ONE }, entries)
    }
}

/// True if the frame that begins at `start` is always page 1 when ionosphere coefficients are known.
pub(super) fn is_first(start: Epoch) -> bool {
    start.seconds().div_euclid(FRAME_S).rem_euclid(2) == 1
}

/// Predicted accuracies of pages 2 and 4.
static ACCURACIES: [Of; 4] = blocks::accuracies::<15>();
pub(super) static OF_ACCURACIES: [&[Of]; 1] = [&ACCURACIES];
/// Reference week and time of page 2.
#[rustfmt::skip]
static TIME: [Of; 2] = [
    element(Field::new("almanac_week", &[(37, 13)], Whole, 0, ALMANAC),
        |c| (c.toa.week() - BDT_WEEK).rem_euclid(8192) as f64, |_, _| {}),
    element(Field::new("toa_4096s", &[(50, 8)], Whole, 0, ALMANAC),
        |c| c.toa.tow_s() / ALMANAC_STEP_S as f64, |_, _| {}),
];

/// One satellite of page 2.
#[rustfmt::skip]
const fn place<const PLACE: usize, const AT: u16>() -> [Of; 6] {
    [
        element(Field::new("almanac_prn", const { &[(AT, 6)] }, Whole, 0, ALMANAC),
            |c| c.entries[PLACE].number, |c, v| c.entries[PLACE].number = v),
        element(Field::new("almanac_orbit_kind", const { &[(AT + 6, 2)] }, Whole, 0, ALMANAC),
            |c| c.entries[PLACE].kind, |c, v| c.entries[PLACE].kind = v),
        element(Field::new("almanac_delta_a_m", const { &[(AT + 8, 8)] }, Signed, 9, ALMANAC),
            |c| c.entries[PLACE].delta_a_m, |c, v| c.entries[PLACE].delta_a_m = v),
        element(Field::new("almanac_omega0_rad", const { &[(AT + 16, 7)] }, Turn, -6, ALMANAC),
            |c| c.entries[PLACE].omega0_rad, |c, v| c.entries[PLACE].omega0_rad = v),
        element(Field::new("almanac_phi0_rad", const { &[(AT + 23, 7)] }, Turn, -6, ALMANAC),
            |c| c.entries[PLACE].phi0_rad, |c, v| c.entries[PLACE].phi0_rad = v),
        element(Field::new("almanac_health", const { &[(AT + 30, 8)] }, Whole, 0, ALMANAC),
            |c| c.entries[PLACE].health, |c, v| c.entries[PLACE].health = v),
    ]
}

static PLACE: [Of; 6] = place::<0, 58>();
static PLACE_2: [Of; 6] = place::<1, 96>();
static PLACE_3: [Of; 6] = place::<2, 134>();
static PLACE_4: [Of; 6] = place::<3, 172>();

/// The satellite of page 4.
#[rustfmt::skip]
static MEDIUM: [Of; 14] = [
    plain!("almanac_prn", [(37, 6)], Whole, 0, ALMANAC, entries[0].number),
    plain!("almanac_orbit_kind", [(43, 2)], Whole, 0, ALMANAC, entries[0].kind),
    element(Field::new("almanac_week", &[(45, 13)], Whole, 0, ALMANAC),
        |c| (c.toa.week() - BDT_WEEK).rem_euclid(8192) as f64, |_, _| {}),
    element(Field::new("toa_4096s", &[(58, 8)], Whole, 0, ALMANAC),
        |c| c.toa.tow_s() / ALMANAC_STEP_S as f64, |_, _| {}),
    plain!("almanac_eccentricity", [(66, 11)], Unsigned, -16, ALMANAC, entries[0].eccentricity),
    plain!("almanac_delta_i_rad", [(77, 11)], Semicircles, -14, ALMANAC, entries[0].delta_i_rad),
    plain!("almanac_sqrt_a_sqrtm", [(88, 17)], Unsigned, -4, ALMANAC, entries[0].sqrt_a_sqrtm),
    plain!("almanac_omega0_rad", [(105, 16)], Turn, -15, ALMANAC, entries[0].omega0_rad),
    plain!("almanac_omega_dot_radps", [(121, 11)], Semicircles, -33, ALMANAC, entries[0].omega_dot_radps),
    plain!("almanac_omega_rad", [(132, 16)], Turn, -15, ALMANAC, entries[0].omega_rad),
    plain!("almanac_m0_rad", [(148, 16)], Turn, -15, ALMANAC, entries[0].m0_rad),
    plain!("almanac_af0_s", [(164, 11)], Signed, -20, ALMANAC, entries[0].af0_s),
    plain!("almanac_af1_sps", [(175, 10)], Signed, -37, ALMANAC, entries[0].af1_sps),
    plain!("almanac_health", [(185, 8)], Whole, 0, ALMANAC, entries[0].health),
];

/// The tables of pages 2 and 4 after their headers.
pub(super) static OF_REDUCED: [&[Of]; 6] = [&ACCURACIES, &TIME, &PLACE, &PLACE_2, &PLACE_3, &PLACE_4];
pub(super) static OF_MEDIUM: [&[Of]; 2] = [&ACCURACIES, &MEDIUM];
