//! Almanacs in pages 3 and 4 of subframe 3, and the order in which pages are sent.
//!
//! Source: IS-GPS-800J, 3.5.4.3; for QZSS IS-QZSS-PNT-005, 4.2.2.4. Page 3 has six reduced almanacs, page 4
//! one almanac of medium length; both are those of CNAV ([`super::cnav`]) with eight bits of number. The
//! documents leave the order of the pages open. Two of three frames are page 1, so that an ephemeris is whole
//! after two frames at most; the others go through the almanacs of all satellites of the system that are
//! known. Who knows no satellite sends page 1 alone. In the reduced almanac a geostationary satellite has no
//! node: its angle counts from that of longitude zero at the beginning of the week, as in real pages.

use super::cnav::{CNAV_SETS, L1, L2, L5, reference_axis_m};
use super::{Content, FRAME_S, PAGE};
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element, plain};
use crate::broadcast::Ephemeris;
use crate::earth::GPS_PI;
use crate::gps::lnav::Almanac;
use crate::message::{ALMANAC_STEP_S, Common, almanac_page, almanac_time};
use crate::satellite::System;
use crate::time::Epoch;

const ALMANAC: &str = "3.5.4.3, figures 3.5-4 and 3.5-5";
/// Frames of which one has almanacs, the second of a round that begins with the week.
pub(super) const ROUND: i64 = 3;
/// Packets of page 3.
pub(super) const PACKETS: usize = 6;
/// Pages of almanacs.
pub(super) const REDUCED: f64 = 3.0;
pub(super) const MEDIUM: f64 = 4.0;
/// Eccentricity and inclination (in semicircles) from which almanacs count: of GPS, of the inclined orbits of
/// QZSS and of its geostationary ones.
const OF_GPS: (f64, f64) = (0.0, 0.30);
const OF_QZSS: (f64, f64) = (0.06, 0.25);
const GEOSTATIONARY: (f64, f64) = (0.0, 0.0);
/// Inclination in semicircles that separates inclined from geostationary orbits.
const INCLINED: f64 = 0.1;

/// One satellite in both kinds of almanac; number 0 is a packet without satellite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    /// Elements whose eccentricity and inclination count from those of the satellite's kind of orbit.
    pub elements: Almanac,
    pub delta_a_m: f64,
    /// Node and argument of latitude of the reduced almanac, in radians.
    pub node_rad: f64,
    pub phi0_rad: f64,
}

impl Entry {
    /// Creates a packet without a satellite, whose bits alternate after its number 0 as real ones do.
    pub fn empty() -> Self {
        Self {
            elements: Almanac { health: 5, ..Almanac::default() },
            delta_a_m: -86.0 * 512.0,
            node_rad: -43.0 / 64.0 * GPS_PI,
            phi0_rad: 42.0 / 64.0 * GPS_PI,
        }
    }

    /// Almanac elements of an ephemeris at an almanac's reference time.
    pub fn of(set: &Ephemeris, toa: Epoch) -> Self {
        let inclination_rad = set.mean_at(toa).inclination_rad;
        let is_geostationary = set.sv.system == System::Qzss && inclination_rad < INCLINED * GPS_PI;
        let (eccentricity, semicircles) = match set.sv.system {
            _ if is_geostationary => GEOSTATIONARY,
            System::Qzss => OF_QZSS,
            _ => OF_GPS,
        };
        let of_lnav = Almanac::derive(set, toa);
        let elements = Almanac {
            number: set.sv.prn(),
            eccentricity: of_lnav.eccentricity - eccentricity,
            delta_i_rad: inclination_rad - semicircles * GPS_PI,
            health: unhealthy(set),
            ..of_lnav
        };
        let node_rad = if is_geostationary { 0.0 } else { elements.omega0_rad };
        Self {
            elements,
            delta_a_m: elements.sqrt_a_sqrtm * elements.sqrt_a_sqrtm - reference_axis_m(set.sv),
            node_rad,
            phi0_rad: elements.omega0_rad - node_rad + elements.omega_rad + elements.m0_rad,
        }
    }

    /// True if both almanacs can represent the entry.
    fn fits(&self) -> bool {
        let fields = MEDIUM_PAGE.iter().chain(&PACKET);
        let content = |entry| Content { entries: [entry; PACKETS], ..super::nothing() };
        fields.into_iter().all(|element| element.raw_of(&content(*self)).is_ok())
    }
}

/// Bits of health of L1, L2 and L5, L1 the highest. Only ephemerides of CNAV tell carriers apart.
fn unhealthy(set: &Ephemeris) -> u8 {
    let bit = |carrier: u16| u8::from(set.health & carrier > 0);
    let of_all = if set.is_healthy() { 0 } else { 7 };
    if *set.form == CNAV_SETS { bit(L1) << 2 | bit(L2) << 1 | bit(L5) } else { of_all }
}

/// The almanacs of the satellites of GPS and QZSS, and their reference time.
pub(super) struct Almanacs {
    pub toa: Epoch,
    entries: Vec<(System, Entry)>,
}

impl Almanacs {
    /// Collects the almanacs of the satellites that a scene contains.
    pub fn of(common: &Common) -> Self {
        let toa = almanac_time(common.reference.unwrap_or(Epoch::new(0, 0.0)));
        let own = common.almanac.iter().filter(|set| matches!(set.sv.system, System::Gps | System::Qzss));
        let entries = own.map(|set| (set.sv.system, Entry::of(set, toa))).filter(|(_, entry)| entry.fits());
        Self { toa, entries: entries.collect() }
    }

    /// Number of the page of a system's satellites in the frame that begins at `start`, and the satellites in
    /// it.
    pub fn page_at(&self, system: System, start: Epoch) -> (f64, [Entry; PACKETS]) {
        let mut entries = [Entry::empty(); PACKETS];
        let own: Vec<Entry> = self.entries.iter().filter(|(other, _)| *other == system).map(|(_, own)| *own).collect();
        if own.is_empty() || is_first(start) {
            return (PAGE, entries);
        }
        let (is_reduced, shown) = almanac_page(&own, PACKETS, start.seconds().div_euclid(ROUND * FRAME_S));
        entries.iter_mut().zip(shown).for_each(|(place, entry)| *place = *entry);
        (if is_reduced { REDUCED } else { MEDIUM }, entries)
    }
}

/// True if the frame that begins at `start` is always page 1.
pub(super) fn is_first(start: Epoch) -> bool {
    start.seconds().div_euclid(FRAME_S).rem_euclid(ROUND) != 1
}

type Of = Element<Content>;

/// Reference week and time.
#[rustfmt::skip]
pub(super) static TIME: [Of; 2] = [
    element(Field::new("almanac_week", &[(14, 13)], Whole, 0, ALMANAC),
        |c| c.toa.week().rem_euclid(8192) as f64, |_, _| {}),
    element(Field::new("toa_4096s", &[(27, 8)], Whole, 0, ALMANAC),
        |c| c.toa.tow_s() / ALMANAC_STEP_S as f64, |_, _| {}),
];

/// The packet of one satellite.
#[rustfmt::skip]
const fn packet<const PLACE: usize, const AT: u16>() -> [Of; 5] {
    [
        element(Field::new("almanac_prn", const { &[(AT, 8)] }, Whole, 0, ALMANAC),
            |c| f64::from(c.entries[PLACE].elements.number), |c, v| c.entries[PLACE].elements.number = v as u8),
        element(Field::new("almanac_delta_a_m", const { &[(AT + 8, 8)] }, Signed, 9, ALMANAC),
            |c| c.entries[PLACE].delta_a_m, |c, v| c.entries[PLACE].delta_a_m = v),
        element(Field::new("almanac_omega0_rad", const { &[(AT + 16, 7)] }, Turn, -6, ALMANAC),
            |c| c.entries[PLACE].node_rad, |c, v| c.entries[PLACE].node_rad = v),
        element(Field::new("almanac_phi0_rad", const { &[(AT + 23, 7)] }, Turn, -6, ALMANAC),
            |c| c.entries[PLACE].phi0_rad, |c, v| c.entries[PLACE].phi0_rad = v),
        element(Field::new("almanac_health", const { &[(AT + 30, 3)] }, Whole, 0, ALMANAC),
            |c| f64::from(c.entries[PLACE].elements.health), |c, v| c.entries[PLACE].elements.health = v as u8),
    ]
}

static PACKET: [Of; 5] = packet::<0, 35>();
static PACKET_2: [Of; 5] = packet::<1, 68>();
static PACKET_3: [Of; 5] = packet::<2, 101>();
static PACKET_4: [Of; 5] = packet::<3, 134>();
static PACKET_5: [Of; 5] = packet::<4, 167>();
static PACKET_6: [Of; 5] = packet::<5, 200>();

/// The almanac of page 4.
#[rustfmt::skip]
static MEDIUM_PAGE: [Of; 11] = [
    element(Field::new("almanac_prn", &[(35, 8)], Whole, 0, ALMANAC),
        |c| f64::from(c.entries[0].elements.number), |c, v| c.entries[0].elements.number = v as u8),
    element(Field::new("almanac_health", &[(43, 3)], Whole, 0, ALMANAC),
        |c| f64::from(c.entries[0].elements.health), |c, v| c.entries[0].elements.health = v as u8),
    plain!("almanac_eccentricity", [(46, 11)], Unsigned, -16, ALMANAC, entries[0].elements.eccentricity),
    plain!("almanac_delta_i_rad", [(57, 11)], Semicircles, -14, ALMANAC, entries[0].elements.delta_i_rad),
    plain!("almanac_omega_dot_radps", [(68, 11)], Semicircles, -33, ALMANAC, entries[0].elements.omega_dot_radps),
    plain!("almanac_sqrt_a_sqrtm", [(79, 17)], Unsigned, -4, ALMANAC, entries[0].elements.sqrt_a_sqrtm),
    plain!("almanac_omega0_rad", [(96, 16)], Turn, -15, ALMANAC, entries[0].elements.omega0_rad),
    plain!("almanac_omega_rad", [(112, 16)], Turn, -15, ALMANAC, entries[0].elements.omega_rad),
    plain!("almanac_m0_rad", [(128, 16)], Turn, -15, ALMANAC, entries[0].elements.m0_rad),
    plain!("almanac_af0_s", [(144, 11)], Signed, -20, ALMANAC, entries[0].elements.af0_s),
    plain!("almanac_af1_sps", [(155, 10)], Signed, -37, ALMANAC, entries[0].elements.af1_sps),
];

/// The tables of pages 3 and 4 after their headers.
pub(super) static OF_REDUCED: [&[Of]; 7] = [&TIME, &PACKET, &PACKET_2, &PACKET_3, &PACKET_4, &PACKET_5, &PACKET_6];
pub(super) static OF_MEDIUM: [&[Of]; 2] = [&TIME, &MEDIUM_PAGE];
