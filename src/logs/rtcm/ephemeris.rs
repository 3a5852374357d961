//! Ephemerides: messages 1019 (GPS), 1020 (GLONASS), 1041 (NavIC), 1042 (BeiDou), 1044 (QZSS), 1045 and 1046
//! (Galileo F/NAV and I/NAV).
//!
//! Source: RTCM 10403.3, tables 3.5-21, 3.5-22 and those of 3.5.15; the scales are those of the satellites'
//! own messages. A list of fields with the members that they carry is read and written. The week of a
//! message is that of its reference time. Limits: of GLONASS almanac, τ_c and τ_GPS, which ephemerides here
//! do not have, are zero and P1, P3 and M those of a GLONASS-M satellite; NavIC's spare bits are zero.

use super::field::{self, Field, Refused, i, m, reserved, turn, u};
use crate::table::{Table, Value};
use gnss::beidou::d1d2::D1_SETS;
use gnss::broadcast::{Ephemeris, PLAIN, SetForm, StateVector};
use gnss::earth::GPS_PI;
use gnss::galileo::fnav::FNAV_SETS;
use gnss::galileo::inav::INAV_SETS;
use gnss::glonass::fdma::channel;
use gnss::glonass::gnav::GNAV_SETS;
use gnss::gps::lnav::LNAV_SETS;
use gnss::qzss::lnav::LNAV_SETS as QZSS_SETS;
use gnss::satellite::{Sv, System};
use gnss::time::{BDT, BDT_WEEK, Epoch, GLONASST, GPST, TimeScale, WEEK_S};

/// Content of a message: an ephemeris whose times are labels of the system's scale, and what it has beside.
#[derive(Clone, Debug)]
struct Sent {
    set: Ephemeris,
    vector: StateVector,
    week: f64,
    toe_s: f64,
    toc_s: f64,
    /// Four years and the day among them by GLONASS, both from 1.
    four_years: f64,
    day: f64,
}

/// Field with the functions that return and set what it carries.
type Entry = (Field, fn(&Sent) -> f64, fn(&mut Sent, f64));

/// Message with ephemerides.
struct Layout {
    number: u64,
    name: &'static str,
    system: System,
    form: &'static SetForm,
    scale: &'static TimeScale,
    /// Number of the GPS week that is week 0, and weeks that the message distinguishes.
    weeks: [i64; 2],
    fields: &'static [Entry],
}

/// Entry of a member that is kept in the field's unit.
macro_rules! own {
    ($field:expr, $($member:tt)+) => {
        ($field, |sent| sent.$($member)+, |sent, value| sent.$($member)+ = value)
    };
}

/// Angle in radians that messages count as one.
fn semicircle_rad() -> f64 {
    planted!("logs.rtcm.semicircle", GPS_PI, 1.0)
}

/// Entry of an angle, which the field has in semicircles.
macro_rules! angle {
    ($field:expr, $member:ident) => {
        ($field, |sent| sent.set.$member / semicircle_rad(), |sent, value| sent.set.$member = value * semicircle_rad())
    };
}

/// Entry of a whole number of up to 16 bits.
macro_rules! whole {
    ($field:expr, $member:ident, $kind:ty) => {
        ($field, |sent| f64::from(sent.set.$member), |sent, value| sent.set.$member = value as $kind)
    };
}

/// Entry of some bits of the health: the lowest one and a mask.
macro_rules! health {
    ($field:expr, $low:literal, $mask:literal) => {
        (
            $field,
            |sent| f64::from(sent.set.health >> $low & $mask),
            |sent, value| sent.set.health = sent.set.health & !($mask << $low) | (value as u16 & $mask) << $low,
        )
    };
}

/// Entry of a coordinate in kilometres.
macro_rules! kilometres {
    ($field:expr, $vector:ident, $axis:ident) => {
        ($field, |sent| 1e-3 * sent.vector.$vector.$axis, |sent, value| sent.vector.$vector.$axis = 1e3 * value)
    };
}

/// Entry of a number that is the same in every message.
macro_rules! constant {
    ($field:expr, $value:literal) => {
        ($field, |_| $value, |_, _| {})
    };
}

/// Entry of a flag.
macro_rules! flag {
    ($field:expr, $member:ident) => {
        ($field, |sent| f64::from(u8::from(sent.set.$member)), |sent, value| sent.set.$member = value == 1.0)
    };
}

/// Entry of the satellite's number.
const fn number(width: usize, column: &'static str) -> Entry {
    (u(width, column), |sent| f64::from(sent.set.sv.number), |sent, value| sent.set.sv.number = value as u8)
}

#[rustfmt::skip]
const GPS: [Entry; 30] = [
    number(6, "DF009"), own!(u(10, "DF076"), week), whole!(u(4, "DF077"), ura_index, u8),
    whole!(u(2, "DF078"), l2_codes, u8), angle!(i(14, "DF079").halved(43), idot_radps),
    whole!(u(8, "DF071"), iode, u16), own!(u(16, "DF081").times(16.0), toc_s),
    own!(i(8, "DF082").halved(55), set.af2_sps2), own!(i(16, "DF083").halved(43), set.af1_sps),
    own!(i(22, "DF084").halved(31), set.af0_s), whole!(u(10, "DF085"), iodc, u16),
    own!(i(16, "DF086").halved(5), set.crs_m), angle!(i(16, "DF087").halved(43), delta_n_radps),
    angle!(turn("DF088"), m0_rad), own!(i(16, "DF089").halved(29), set.cuc_rad),
    own!(u(32, "DF090").halved(33), set.eccentricity), own!(i(16, "DF091").halved(29), set.cus_rad),
    own!(u(32, "DF092").halved(19), set.sqrt_a_sqrtm), own!(u(16, "DF093").times(16.0), toe_s),
    own!(i(16, "DF094").halved(29), set.cic_rad), angle!(turn("DF095"), omega0_rad),
    own!(i(16, "DF096").halved(29), set.cis_rad), angle!(turn("DF097"), i0_rad),
    own!(i(16, "DF098").halved(5), set.crc_m), angle!(turn("DF099"), omega_rad),
    angle!(i(24, "DF100").halved(43), omega_dot_radps), own!(i(8, "DF101").halved(31), set.tgd_s),
    health!(u(6, "DF102"), 0, 0b11_1111), flag!(u(1, "DF103"), l2_p_data_off), flag!(u(1, "DF137"), long_fit),
];

#[rustfmt::skip]
const QZSS: [Entry; 29] = [
    number(4, "DF429"), own!(u(16, "DF430").times(16.0), toc_s), own!(i(8, "DF431").halved(55), set.af2_sps2),
    own!(i(16, "DF432").halved(43), set.af1_sps), own!(i(22, "DF433").halved(31), set.af0_s),
    whole!(u(8, "DF434"), iode, u16), own!(i(16, "DF435").halved(5), set.crs_m),
    angle!(i(16, "DF436").halved(43), delta_n_radps), angle!(turn("DF437"), m0_rad),
    own!(i(16, "DF438").halved(29), set.cuc_rad), own!(u(32, "DF439").halved(33), set.eccentricity),
    own!(i(16, "DF440").halved(29), set.cus_rad), own!(u(32, "DF441").halved(19), set.sqrt_a_sqrtm),
    own!(u(16, "DF442").times(16.0), toe_s), own!(i(16, "DF443").halved(29), set.cic_rad),
    angle!(turn("DF444"), omega0_rad), own!(i(16, "DF445").halved(29), set.cis_rad), angle!(turn("DF446"), i0_rad),
    own!(i(16, "DF447").halved(5), set.crc_m), angle!(turn("DF448"), omega_rad),
    angle!(i(24, "DF449").halved(43), omega_dot_radps), angle!(i(14, "DF450").halved(43), idot_radps),
    whole!(u(2, "DF451"), l2_codes, u8), own!(u(10, "DF452"), week), whole!(u(4, "DF453"), ura_index, u8),
    health!(u(6, "DF454"), 0, 0b11_1111), own!(i(8, "DF455").halved(31), set.tgd_s), whole!(u(10, "DF456"), iodc, u16),
    flag!(u(1, "DF457"), long_fit),
];

/// Fields of Galileo between the accuracy and the group delays.
macro_rules! galileo {
    ($accuracy:literal, $($last:expr),+) => { [
        number(6, "DF252"), own!(u(12, "DF289"), week), whole!(u(10, "DF290"), iode, u16),
        whole!(u(8, $accuracy), ura_index, u8), angle!(i(14, "DF292").halved(43), idot_radps),
        own!(u(14, "DF293").times(60.0), toc_s), own!(i(6, "DF294").halved(59), set.af2_sps2),
        own!(i(21, "DF295").halved(46), set.af1_sps), own!(i(31, "DF296").halved(34), set.af0_s),
        own!(i(16, "DF297").halved(5), set.crs_m), angle!(i(16, "DF298").halved(43), delta_n_radps),
        angle!(turn("DF299"), m0_rad), own!(i(16, "DF300").halved(29), set.cuc_rad),
        own!(u(32, "DF301").halved(33), set.eccentricity), own!(i(16, "DF302").halved(29), set.cus_rad),
        own!(u(32, "DF303").halved(19), set.sqrt_a_sqrtm), own!(u(14, "DF304").times(60.0), toe_s),
        own!(i(16, "DF305").halved(29), set.cic_rad), angle!(turn("DF306"), omega0_rad),
        own!(i(16, "DF307").halved(29), set.cis_rad), angle!(turn("DF308"), i0_rad),
        own!(i(16, "DF309").halved(5), set.crc_m), angle!(turn("DF310"), omega_rad),
        angle!(i(24, "DF311").halved(43), omega_dot_radps), own!(i(10, "DF312").halved(32), set.tgd2_s),
        $($last),+
    ] };
}

// Status: validity of E1-B in bit 0 and health above it, then those of E5b and E5a.
const GALILEO_FNAV: [Entry; 28] =
    galileo!["DF291", health!(u(2, "DF314"), 7, 0b11), health!(u(1, "DF315"), 6, 0b1), constant!(reserved(7), 0.0)];
const GALILEO_INAV: [Entry; 31] = galileo![
    "DF286",
    own!(i(10, "DF313").halved(32), set.tgd_s),
    health!(u(2, "DF316"), 4, 0b11),
    health!(u(1, "DF317"), 3, 0b1),
    health!(u(2, "DF287"), 1, 0b11),
    health!(u(1, "DF288"), 0, 0b1),
    constant!(reserved(2), 0.0)
];

/// Delays of BeiDou are in units of 0.1 ns.
#[rustfmt::skip]
const BEIDOU: [Entry; 28] = [
    number(6, "DF488"), own!(u(13, "DF489"), week), whole!(u(4, "DF490"), ura_index, u8),
    angle!(i(14, "DF491").halved(43), idot_radps), whole!(u(5, "DF492"), aodo, u8),
    own!(u(17, "DF493").times(8.0), toc_s), own!(i(11, "DF494").halved(66), set.af2_sps2),
    own!(i(22, "DF495").halved(50), set.af1_sps), own!(i(24, "DF496").halved(33), set.af0_s),
    whole!(u(5, "DF497"), iodc, u16), own!(i(18, "DF498").halved(6), set.crs_m),
    angle!(i(16, "DF499").halved(43), delta_n_radps), angle!(turn("DF500"), m0_rad),
    own!(i(18, "DF501").halved(31), set.cuc_rad), own!(u(32, "DF502").halved(33), set.eccentricity),
    own!(i(18, "DF503").halved(31), set.cus_rad), own!(u(32, "DF504").halved(19), set.sqrt_a_sqrtm),
    own!(u(17, "DF505").times(8.0), toe_s), own!(i(18, "DF506").halved(31), set.cic_rad),
    angle!(turn("DF507"), omega0_rad), own!(i(18, "DF508").halved(31), set.cis_rad), angle!(turn("DF509"), i0_rad),
    own!(i(18, "DF510").halved(6), set.crc_m), angle!(turn("DF511"), omega_rad),
    angle!(i(24, "DF512").halved(43), omega_dot_radps),
    (i(10, "DF513").over(10.0), |sent| 1e9 * sent.set.tgd_s, |sent, value| sent.set.tgd_s = 1e-9 * value),
    (i(10, "DF514").over(10.0), |sent| 1e9 * sent.set.tgd2_s, |sent, value| sent.set.tgd2_s = 1e-9 * value),
    health!(u(1, "DF515"), 0, 0b1),
];

#[rustfmt::skip]
const NAVIC: [Entry; 30] = [
    number(6, "DF516"), own!(u(10, "DF517"), week), own!(i(22, "DF518").halved(31), set.af0_s),
    own!(i(16, "DF519").halved(43), set.af1_sps), own!(i(8, "DF520").halved(55), set.af2_sps2),
    whole!(u(4, "DF521"), ura_index, u8), own!(u(16, "DF522").times(16.0), toc_s),
    own!(i(8, "DF523").halved(31), set.tgd_s), angle!(i(22, "DF524").halved(41), delta_n_radps),
    whole!(u(8, "DF525"), iode, u16), constant!(u(10, "DF526"), 0.0), health!(u(1, "DF527"), 1, 0b1),
    health!(u(1, "DF528"), 0, 0b1), own!(i(15, "DF529").halved(28), set.cuc_rad),
    own!(i(15, "DF530").halved(28), set.cus_rad), own!(i(15, "DF531").halved(28), set.cic_rad),
    own!(i(15, "DF532").halved(28), set.cis_rad), own!(i(15, "DF533").halved(4), set.crc_m),
    own!(i(15, "DF534").halved(4), set.crs_m), angle!(i(14, "DF535").halved(43), idot_radps),
    angle!(turn("DF536"), m0_rad), own!(u(16, "DF537").times(16.0), toe_s),
    own!(u(32, "DF538").halved(33), set.eccentricity), own!(u(32, "DF539").halved(19), set.sqrt_a_sqrtm),
    angle!(turn("DF540"), omega0_rad), angle!(turn("DF541"), omega_rad),
    angle!(i(22, "DF542").halved(41), omega_dot_radps), angle!(turn("DF543"), i0_rad),
    constant!(u(2, "DF544"), 0.0), constant!(u(2, "DF545"), 0.0),
];

/// Quarter of an hour in seconds, and half a minute.
const QUARTER_S: i64 = 900;
const HALF_MINUTE_S: i64 = 30;
const DAY_S: i64 = 86_400;
/// Days of four years (GLONASS ICD L1, L2 5.1, 4.4).
const FOUR_YEARS: i64 = 1461;
/// Days from the beginning of GPS time to that of the four years of number 1, 1996-01-01.
const FIRST_YEARS: i64 = 5839;

/// Frame's beginning as DF107 has it: hours, minutes and half minutes of the day (5, 6 and 1 bits).
fn frame_time(sent: &Sent) -> f64 {
    let halves = sent.set.transmitted.seconds().rem_euclid(DAY_S) / HALF_MINUTE_S;
    (halves / 120 * 128 + halves / 2 % 60 * 2 + halves % 2) as f64
}

fn set_frame_time(sent: &mut Sent, value: f64) {
    let code = value as i64;
    let of_day = code / 128 * 3600 + code / 2 % 64 * 60 + code % 2 * HALF_MINUTE_S;
    sent.set.transmitted = Epoch::new(of_day, 0.0);
}

/// Health: the first bit of B is bit 2, the flag l is bit 3. Almanacs are not sent.
#[rustfmt::skip]
const GLONASS: [Entry; 36] = [
    number(6, "DF038"),
    (u(5, "DF040"), |sent| channel(sent.set.sv.number).map_or(f64::NAN, |own| f64::from(own) + 7.0), |_, _| {}),
    constant!(u(1, "DF104"), 0.0), constant!(u(1, "DF105"), 0.0), constant!(u(2, "DF106"), 1.0),
    (u(12, "DF107"), frame_time, set_frame_time), health!(u(1, "DF108"), 2, 0b1),
    (u(1, "DF109"), |sent| f64::from(sent.set.iode % 2), |_, _| {}), whole!(u(7, "DF110"), iode, u16),
    kilometres!(m(24, "DF111").halved(20), velocity_mps, x), kilometres!(m(27, "DF112").halved(11), position_m, x),
    kilometres!(m(5, "DF113").halved(30), acceleration_mps2, x),
    kilometres!(m(24, "DF114").halved(20), velocity_mps, y), kilometres!(m(27, "DF115").halved(11), position_m, y),
    kilometres!(m(5, "DF116").halved(30), acceleration_mps2, y),
    kilometres!(m(24, "DF117").halved(20), velocity_mps, z), kilometres!(m(27, "DF118").halved(11), position_m, z),
    kilometres!(m(5, "DF119").halved(30), acceleration_mps2, z),
    constant!(u(1, "DF120"), 1.0), own!(m(11, "DF121").halved(40), set.af1_sps), constant!(u(2, "DF122"), 0.0),
    health!(u(1, "DF123"), 3, 0b1),
    (m(22, "DF124").halved(30), |sent| -sent.set.af0_s, |sent, value| sent.set.af0_s = -value),
    own!(m(5, "DF125").halved(30), set.tgd_s), whole!(u(5, "DF126"), aodo, u8), constant!(u(1, "DF127"), 0.0),
    whole!(u(4, "DF128"), ura_index, u8), own!(u(11, "DF129"), day), constant!(u(2, "DF130"), 1.0),
    constant!(u(1, "DF131"), 1.0), constant!(u(11, "DF132"), 0.0), constant!(m(32, "DF133").halved(31), 0.0),
    own!(u(5, "DF134"), four_years), constant!(m(22, "DF135").halved(30), 0.0), health!(u(1, "DF136"), 3, 0b1),
    constant!(reserved(7), 0.0),
];

/// Message of a system; `weeks` are the GPS week that is week 0 and the weeks that it distinguishes.
const fn layout(
    (number, name): (u64, &'static str),
    system: System,
    form: &'static SetForm,
    scale: &'static TimeScale,
    weeks: [i64; 2],
    fields: &'static [Entry],
) -> Layout {
    Layout { number, name, system, form, scale, weeks, fields }
}

static LAYOUTS: [Layout; 7] = [
    layout((1019, "1019"), System::Gps, &LNAV_SETS, &GPST, [0, 1024], &GPS),
    layout((1020, "1020"), System::Glonass, &GNAV_SETS, &GLONASST, [0, 0], &GLONASS),
    layout((1041, "1041"), System::Navic, &PLAIN, &GPST, [1024, 1024], &NAVIC),
    layout((1042, "1042"), System::BeiDou, &D1_SETS, &BDT, [BDT_WEEK, 8192], &BEIDOU),
    layout((1044, "1044"), System::Qzss, &QZSS_SETS, &GPST, [0, 1024], &QZSS),
    layout((1045, "1045"), System::Galileo, &FNAV_SETS, &GPST, [1024, 4096], &GALILEO_FNAV),
    layout((1046, "1046"), System::Galileo, &INAV_SETS, &GPST, [1024, 4096], &GALILEO_INAV),
];

/// First field of every message.
const NUMBER: Field = u(12, "DF002");

/// Numbers of the messages with ephemerides.
pub fn numbers() -> impl Iterator<Item = u64> {
    LAYOUTS.iter().map(|layout| layout.number)
}

/// System of a message with ephemerides.
pub fn system_of(number: u64) -> Option<System> {
    LAYOUTS.iter().find(|layout| layout.number == number).map(|layout| layout.system)
}

/// Number of the message that has an ephemeris.
///
/// # Errors
/// [`Refused::Ephemeris`] where there is none.
pub fn number_of(set: &Ephemeris) -> Result<u64, Refused> {
    layout_of(set).map(|layout| layout.number)
}

fn layout_of(set: &Ephemeris) -> Result<&'static Layout, Refused> {
    // An ephemeris of no message in particular is that of the system's first one.
    let fits = |layout: &&Layout| layout.system == set.sv.system && (layout.form == set.form || *set.form == PLAIN);
    LAYOUTS.iter().find(fits).ok_or(Refused::Ephemeris { sv: set.sv, message: set.form.name })
}

/// Bytes of the message that has an ephemeris.
///
/// # Errors
/// An ephemeris of another message, or one that its fields do not hold.
pub fn write(set: &Ephemeris) -> Result<Vec<u8>, Refused> {
    let layout = layout_of(set)?;
    let labelled = set.clone().timed(|at| layout.scale.label(at));
    let days = labelled.toe.seconds().div_euclid(DAY_S) - FIRST_YEARS;
    let [zero, count] = layout.weeks;
    let sent = Sent {
        vector: labelled.vector.unwrap_or_default(),
        week: (labelled.toe.week() - zero).rem_euclid(count.max(1)) as f64,
        toe_s: labelled.toe.tow_s(),
        toc_s: labelled.toc.tow_s(),
        four_years: (days.div_euclid(FOUR_YEARS) + 1) as f64,
        day: (days.rem_euclid(FOUR_YEARS) + 1) as f64,
        set: labelled,
    };
    let entry = |column| layout.fields.iter().find(|(field, ..)| field.column == column);
    let value = |column| match entry(column) {
        Some((_, get, _)) => Value::Real(get(&sent)),
        None => Value::Integer(layout.number as i64),
    };
    field::write(fields(layout), value)
}

fn fields(layout: &'static Layout) -> impl Iterator<Item = &'static Field> {
    std::iter::once(&NUMBER).chain(layout.fields.iter().map(|(field, ..)| field))
}

/// Fields of a message with an ephemeris, by its number; none where it has another or ends too early.
pub fn read(number: u64, body: &[u8]) -> Option<Table> {
    let layout = LAYOUTS.iter().find(|layout| layout.number == number)?;
    field::read(layout.name, fields(layout), body)
}

/// Ephemeris of a message's fields. `near` resolves the week; without it that of GPS, QZSS and NavIC is not
/// known. None where a satellite's number is zero or beyond its system.
pub fn ephemeris(table: &Table, near: Option<Epoch>) -> Option<Ephemeris> {
    let layout = LAYOUTS.iter().find(|layout| layout.name == table.name)?;
    let sv = Sv { system: layout.system, number: 0 };
    let blank = Ephemeris { form: layout.form, ..Ephemeris::blank(sv, Epoch::new(0, 0.0)) };
    let mut sent = Sent {
        set: blank,
        vector: StateVector::default(),
        week: 0.0,
        toe_s: 0.0,
        toc_s: 0.0,
        four_years: 0.0,
        day: 0.0,
    };
    for (field, _, set) in layout.fields.iter().filter(|(field, ..)| !field.column.is_empty()) {
        set(&mut sent, table.number(0, field.column)?);
    }
    if sent.set.sv.number == 0 {
        return None;
    }
    if layout.system == System::Glonass { glonass(sent) } else { keplerian(layout, sent, near) }
}

fn keplerian(layout: &Layout, sent: Sent, near: Option<Epoch>) -> Option<Ephemeris> {
    let [zero, count] = layout.weeks;
    // A message with thousands of weeks needs no other time: the middle one of them is this century's.
    let middle = (count > 1024).then(|| Epoch::new((zero + count / 2) * WEEK_S, 0.0));
    let near = layout.scale.label(near.or(middle)?);
    let week = near.nearest_week(sent.week as i64 + zero, count);
    let mut toe = Epoch::new(week * WEEK_S + sent.toe_s as i64, 0.0);
    // A week of sending, as some senders have it, may be the one before.
    if middle.is_none() && toe.since(near).abs() > WEEK_S as f64 / 2.0 && toe.since(near).abs() < 2.0 * WEEK_S as f64 {
        toe = near.nearest_tow(sent.toe_s as i64);
    }
    let toc = toe.nearest_tow(sent.toc_s as i64);
    let set = Ephemeris { toe, toc, transmitted: toe, ..sent.set };
    let iode = match layout.system {
        System::BeiDou => gnss::beidou::d1d2::issue(toe.tow_s()),
        _ => set.iode,
    };
    let iodc = if matches!(layout.system, System::Galileo | System::Navic) { iode } else { set.iodc };
    Some(Ephemeris { iode, iodc, ..set }.timed(|label| layout.scale.instant(label)))
}

fn glonass(sent: Sent) -> Option<Ephemeris> {
    let days = FIRST_YEARS + (sent.four_years as i64 - 1) * FOUR_YEARS + sent.day as i64 - 1;
    let quarter = i64::from(sent.set.iode);
    let toe = Epoch::new(days * DAY_S + quarter * QUARTER_S, 0.0);
    let late_s = (sent.set.transmitted.seconds() - quarter * QUARTER_S + DAY_S / 2).rem_euclid(DAY_S) - DAY_S / 2;
    let transmitted = Epoch::new(toe.seconds() + late_s, 0.0);
    let set = Ephemeris { toe, toc: toe, transmitted, iodc: sent.set.iode, vector: Some(sent.vector), ..sent.set };
    (sent.four_years > 0.0 && sent.day > 0.0).then(|| set.timed(|label| GLONASST.instant(label)))
}

#[cfg(test)]
#[path = "ephemeris_tests.rs"]
mod tests;
