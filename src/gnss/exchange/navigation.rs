//! Navigation files of ephemerides by the raw parameters of their messages, as they were sent or decoded.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::sync::OnceLock;

use super::offset::offsets;
use super::{Version, calendar, header_line, opening};
use crate::broadcast::{Ephemeris, STRING_3_UNHEALTHY, StateVector, status_of_record};
use crate::ionosphere::{Coefficients, Model};
use crate::message::{Message, Raw, RecordLine, Records};
use crate::record::NavigationRow;
use crate::satellite::{Sv, System};
use crate::signal::{self, Signal};
use crate::time::{BDT, BDT_WEEK, Epoch, TimeScale, UTC};

/// Parameters of an ephemeris, or parameters that are common to all satellites, by name: raw integers, and
/// the sample of the row that said each last.
type Raws = BTreeMap<String, (i64, u64)>;

/// Message, satellite and issue of an ephemeris.
type Sent = (String, Sv, u32);

/// Messages of signals by their names, with their time scales.
fn messages(signals: &[&'static Signal]) -> BTreeMap<&'static str, (&'static Message, &'static TimeScale)> {
    let of = |signal: &&'static Signal| {
        let messages = signal.components.iter().filter_map(|component| component.message);
        messages.map(|message| (message.name, (message, signal.time))).collect::<Vec<_>>()
    };
    signals.iter().flat_map(of).collect()
}

/// True if a parameter is one of those that an ephemeris has, whose issue it bears, be it 0.
pub fn bears_issue(row: &NavigationRow) -> bool {
    static BOUND: OnceLock<BTreeMap<&'static str, BTreeSet<&'static str>>> = OnceLock::new();
    let bound = BOUND.get_or_init(|| {
        let messages = messages(&signal::all());
        messages.into_iter().map(|(name, (own, _))| (name, own.fields.parameters().into_iter().collect())).collect()
    });
    bound.get(row.message.as_str()).is_some_and(|own| own.contains(row.parameter.as_str()))
}

/// Collects parameters as they come; an ephemeris is some kilobytes, however often it is read again.
#[derive(Debug, Default)]
pub struct NavigationSets {
    /// Parameters by message, satellite and issue, and one after the other where an issue came again.
    /// Parameters that belong to no issue are in `common`, the newest only.
    sets: BTreeMap<Sent, Vec<Raws>>,
    common: BTreeMap<String, Raws>,
}

impl NavigationSets {
    /// Takes a parameter.
    pub fn take(&mut self, row: &NavigationRow) {
        self.insert(row);
    }

    /// Takes a parameter; true if it was not known of its set.
    pub fn insert(&mut self, row: &NavigationRow) -> bool {
        let said = (row.raw, row.sample);
        if row.issue == 0 {
            // Those of an issue 0 are of an ephemeris too.
            self.common.entry(row.message.clone()).or_default().insert(row.parameter.clone(), said);
        }
        let again = self.is_issued_again(row);
        let sets = self.sets.entry((row.message.clone(), row.sv, row.issue)).or_default();
        match sets.last() {
            Some(last) if again => {
                // What was sent with it is of the new set, though it be as before.
                let with_it = |(_, (_, sample)): &(&String, &(i64, u64))| *sample == row.sample;
                let begun = last.iter().filter(with_it).map(|(name, said)| (name.clone(), *said)).collect();
                sets.push(begun);
            }
            Some(_) => {}
            None => sets.push(Raws::new()),
        }
        let before = sets.last_mut().and_then(|raws| raws.insert(row.parameter.clone(), said));
        before.is_none_or(|(raw, _)| raw != row.raw)
    }

    /// True if the row begins a new set under an issue that an earlier one had: issues of four bits come
    /// again after hours. It says another value than that one did at another sample.
    pub fn is_issued_again(&self, row: &NavigationRow) -> bool {
        let last = self.sets.get(&(row.message.clone(), row.sv, row.issue)).and_then(|sets| sets.last());
        let before = last.and_then(|raws| raws.get(&row.parameter));
        before.is_some_and(|(raw, sample)| *raw != row.raw && *sample != row.sample) && bears_issue(row)
    }

    /// All complete ephemerides, each once for each message, near a time by which their weeks are resolved;
    /// `signals` are those whose messages were read.
    pub fn ephemerides(&self, signals: &[&'static Signal], near: Epoch) -> Vec<Ephemeris> {
        let messages = messages(signals);
        let mut known = BTreeSet::new();
        let complete = self.each().filter_map(|(sent, turn, raws)| {
            let (message, time) = messages.get(sent.0.as_str())?;
            let raw = |name: &str| self.raw(sent, raws, name);
            let set = message.fields.elements(sent.1, &raw, time.label(near))?.timed(|label| time.instant(label));
            known.insert((sent.1, sent.2, turn, set.form.name)).then_some(set)
        });
        complete.collect()
    }

    /// All sets, those of one issue numbered by their turn.
    fn each(&self) -> impl Iterator<Item = (&Sent, usize, &Raws)> {
        self.sets.iter().flat_map(|(sent, sets)| sets.iter().enumerate().map(move |(turn, raws)| (sent, turn, raws)))
    }

    /// Raw integer of a parameter of an ephemeris. What it needs and bears no issue is found under issue 0:
    /// delays and health of I/NAV's word 5.
    fn raw<'s>(&'s self, (message, sv, _): &Sent, raws: &'s Raws, name: &str) -> Option<i64> {
        let newest = |sets: &'s Vec<Raws>| sets.iter().rev().find_map(|raws| raws.get(name));
        let common = || self.sets.get(&(message.clone(), *sv, 0)).and_then(newest);
        raws.get(name).or_else(common).map(|(raw, _)| *raw)
    }

    /// Writes all complete ephemerides, each once, near a time by which their weeks are resolved; `signals`
    /// are those whose messages were read. Coefficients of the ionosphere, which all satellites of a system
    /// send alike, have in RINEX 4 the first of them that sent a message.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn write(
        &self,
        mut writer: impl Write,
        version: Version,
        signals: &[&'static Signal],
        near: Epoch,
    ) -> io::Result<()> {
        let messages = messages(signals);
        let mut systems: Vec<System> = signals.iter().map(|signal| signal.system).collect();
        systems.sort();
        systems.dedup();
        let mut text = opening(version, "N: GNSS NAV DATA", &systems, near);
        let (mut body, mut described) = (String::new(), BTreeSet::new());
        for (name, (message, _)) in &messages {
            let own = || self.each().filter(|((known, ..), ..)| known == name);
            let (Some(records), Some(((_, sv, _), ..))) = (message.rinex, own().next()) else { continue };
            // Messages of one system that send the same have one record, and one line in a header.
            let form = if version == Version::Four { records.common } else { "" };
            let mut once = |what| described.insert((sv.system, form, what));
            let common = self.common.get(*name);
            // BeiDou's, and those of NavIC on L1, come with the ephemerides.
            let mut raws = common.into_iter().chain(own().map(|(.., raws)| raws));
            let sent = raws.find_map(|raws| {
                let raw = |name: &str| raws.get(name).map(|(raw, _)| *raw);
                Some(((message.ionosphere.coefficients)(&raw)?, region(&raw)))
            });
            // A header of version 3 has no lines for BDGIM, but for BeiDou's older model.
            let sent = sent.filter(|(sent, _)| version == Version::Four || sent.model() != Model::Bdgim);
            let raw = |name: &str| common.and_then(|raws| raws.get(name)).map(|(raw, _)| *raw);
            if let Some(sent) = sent.filter(|_| once("")) {
                match version {
                    Version::Three => text += &ionosphere(sent.0, sv.system),
                    Version::Four => body += &ionosphere_record(records, sent, *sv, near),
                }
            }
            for offset in offsets(&records, sv.system, &raw, near).into_iter().filter(|offset| once(offset.pair)) {
                match version {
                    Version::Three => text += &offset.line(sv.system),
                    Version::Four => body += &offset.record(&records, *sv),
                }
            }
        }
        text += &header_line(&format!("{:6}", near.leap_seconds()), "LEAP SECONDS");
        text += &header_line("", "END OF HEADER");
        text += &body;
        let mut known = BTreeSet::new();
        for (sent, turn, raws) in self.each() {
            let (name, sv, issue) = sent;
            let Some((message, time)) = messages.get(name.as_str()) else { continue };
            let Some(records) = message.rinex else { continue };
            let raw = |name: &str| self.raw(sent, raws, name);
            let set = message.fields.elements(sent.1, &raw, time.label(near));
            let set = set.map(|set| set.timed(|label| time.instant(label)));
            // Version 3 has no records of the newer messages.
            let writes = records.lines.is_none() || version == Version::Four;
            if let Some(set) = set.filter(|set| writes && known.insert((*sv, *issue, turn, set.form.name))) {
                text += &heading(version, records, *sv);
                let own = signals.iter().find(|signal| signal.system == sv.system);
                let channel = own.and_then(|signal| signal.link(*sv).channel());
                text += &match records.lines {
                    Some(lines) => modern_record(&set, |set| lines(set, &raw)),
                    None => record(&set, channel),
                };
            }
        }
        writer.write_all(text.as_bytes()).and_then(|()| writer.flush())
    }
}

/// Lines of a header for the ionosphere's coefficients.
fn ionosphere(sent: Coefficients, system: System) -> String {
    let line = |name: &str, values: [f64; 4]| {
        let values = values.map(|value| format!("{:>12}", exponent(value, 4))).concat();
        header_line(&format!("{name:<5}{values}"), "IONOSPHERIC CORR")
    };
    match sent {
        Coefficients::Klobuchar(model) if system == System::Qzss => {
            line("QZSA", model.alpha) + &line("QZSB", model.beta)
        }
        Coefficients::Klobuchar(model) => line("GPSA", model.alpha) + &line("GPSB", model.beta),
        Coefficients::KlobucharNavic(model) => line("IRNA", model.alpha) + &line("IRNB", model.beta),
        Coefficients::KlobucharBeidou(model) => line("BDSA", model.alpha) + &line("BDSB", model.beta),
        Coefficients::NequickG(model) => {
            let [a, b, c] = model.coefficients;
            line("GAL", [a, b, c, 0.0])
        }
        Coefficients::Bdgim(_) => String::new(),
    }
}

/// The line before an ephemeris: its kind, satellite and message (RINEX 4.02, section 5.4); version 3 has
/// none.
fn heading(version: Version, records: Records, sv: Sv) -> String {
    match version {
        Version::Three => String::new(),
        Version::Four => format!("> EPH {sv} {}\n", (records.set)(sv)),
    }
}

/// Issue and region of coefficients that have them, those of NavIC on L1: western, eastern, southern and
/// northern border in degrees (RINEX 4.02, table A41).
fn region(raw: Raw<'_>) -> Option<[f64; 5]> {
    let degrees = |border: &str| raw(border).map(|steps| 5.0 * steps as f64);
    let issue = raw("iodk")? as f64;
    let [west, east] = [degrees("region_west_5deg")?, degrees("region_east_5deg")?];
    Some([issue, west, east, degrees("region_south_5deg")?, degrees("region_north_5deg")?])
}

/// A message with the ionosphere's coefficients (RINEX 4.02, tables of `ION` records) of a satellite that
/// sent them, its time that of the file.
fn ionosphere_record(
    records: Records,
    (sent, region): (Coefficients, Option<[f64; 5]>),
    sv: Sv,
    near: Epoch,
) -> String {
    // Those of BeiDou are in its own time.
    let [year, month, day, hour, minute, second] = calendar(match sv.system {
        System::BeiDou => BDT.label(near),
        _ => near,
    });
    let mut values = match &sent {
        Coefficients::Klobuchar(model) | Coefficients::KlobucharNavic(model) | Coefficients::KlobucharBeidou(model) => {
            [model.alpha, model.beta].concat()
        }
        // The last one are the flags of storms, of which nothing is said.
        Coefficients::NequickG(model) => [&model.coefficients[..], &[0.0]].concat(),
        Coefficients::Bdgim(model) => model.alpha_tecu.to_vec(),
    };
    let epoch = format!("{year:04} {month:02} {day:02} {hour:02} {minute:02} {second:02}");
    // Three beside the time, then four a line; of those with a region the issue alone beside the time.
    let beside = if region.is_some() { 1 } else { 3 };
    if let Some([issue, borders @ ..]) = region {
        values.insert(0, issue);
        values.extend(borders);
    }
    let mut text = format!("> ION {sv} {}\n    {epoch}", records.common);
    for (place, value) in values.iter().enumerate() {
        if place >= beside && (place - beside).is_multiple_of(4) {
            text += "\n    ";
        }
        text += &format!("{:>19}", exponent(*value, 12));
    }
    text.push('\n');
    text
}

/// A number with an exponent of two digits.
pub(super) fn exponent(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$E}");
    let (mantissa, exponent) = text.split_once('E').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    format!("{mantissa}E{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs())
}

/// An ephemeris that is a state vector: a line with the clock, one of each axis and one with the rest (RINEX
/// 3.05, table A10); times are UTC's.
fn vector_record(set: &Ephemeris, vector: &StateVector, channel: Option<i8>) -> String {
    if set.sv.system == System::Sbas {
        return geostationary_record(set, vector);
    }
    let unhealthy = |bit: u16| f64::from(set.health >> bit & 1);
    let channel = channel.map_or(0.0, f64::from);
    let axis = |of: usize, last: f64| axis_km(vector, of, last);
    let lines = [
        axis(0, unhealthy(2)),
        axis(1, channel),
        axis(2, f64::from(set.aodo)),
        [0.0, set.tgd_s, f64::from(set.ura_index), unhealthy(3) * f64::from(1 << STRING_3_UNHEALTHY)],
    ];
    let [year, month, day, hour, minute, second] = calendar(UTC.label(set.toc));
    let clock = values(&[set.af0_s, set.af1_sps, UTC.label(set.transmitted).tow_s()]);
    let mut text = format!("{} {year:04} {month:02} {day:02} {hour:02} {minute:02} {second:02}{clock}\n", set.sv);
    for line in lines {
        text += &format!("    {}\n", values(&line));
    }
    text
}

/// Position, velocity and acceleration along an axis in kilometres, followed by the last value of their line.
fn axis_km(vector: &StateVector, of: usize, last: f64) -> [f64; 4] {
    let axes = [vector.position_m, vector.velocity_mps, vector.acceleration_mps2];
    let [place, speed, pull] = axes.map(|axis| axis.get(of).map_or(0.0, |metres| 1e-3 * metres));
    [place, speed, pull, last]
}

/// A state vector of an augmentation system (RINEX 3.05, table A16), whose times are those of GPS. Health is
/// that of type 17, which is not read: zero.
fn geostationary_record(set: &Ephemeris, vector: &StateVector) -> String {
    // An index of 15 has no metres.
    let accuracy_m = if set.ura_index == 15 { 32_767.0 } else { ura_m(set.ura_index) };
    let [year, month, day, hour, minute, second] = calendar(set.toc);
    let transmitted_s = set.transmitted.tow_s();
    let mut text = format!("{} {year:04} {month:02} {day:02} {hour:02} {minute:02} {second:02}", set.sv);
    text += &format!("{}\n", values(&[set.af0_s, set.af1_sps, transmitted_s]));
    for (of, last) in [0.0, accuracy_m, f64::from(set.aodo)].into_iter().enumerate() {
        text += &format!("    {}\n", values(&axis_km(vector, of, last)));
    }
    text
}

/// Fields of a record.
fn values(values: &[f64]) -> String {
    values.iter().map(|value| format!("{:>19}", exponent(*value, 12))).collect()
}

/// An ephemeris in a record that version 4 alone has: a line with the clock, and those of its message.
fn modern_record(set: &Ephemeris, lines: impl Fn(&Ephemeris) -> Vec<RecordLine>) -> String {
    // BeiDou's records are in its own time.
    let set = &if set.sv.system == System::BeiDou { set.clone().timed(|at| BDT.label(at)) } else { set.clone() };
    let field = |value: Option<f64>| value.map_or(" ".repeat(19), |value| values(&[value]));
    let body = lines(set).into_iter().map(|line| format!("    {}", line.map(field).concat().trim_end()) + "\n");
    clock_line(set) + &body.collect::<String>()
}

/// The first line: satellite, reference time of the clock, and its polynomial.
fn clock_line(set: &Ephemeris) -> String {
    let [year, month, day, hour, minute, second] = calendar(set.toc);
    let clock = values(&[set.af0_s, set.af1_sps, set.af2_sps2]);
    format!("{} {year:04} {month:02} {day:02} {hour:02} {minute:02} {second:02}{clock}\n", set.sv)
}

/// An ephemeris: a line with the clock, seven with the rest (RINEX 3.05, tables A6, A8, A14 and A18).
fn record(set: &Ephemeris, channel: Option<i8>) -> String {
    if let Some(vector) = &set.vector {
        return vector_record(set, vector, channel);
    }
    // BeiDou's records are in its own time.
    let own_time = set.sv.system == System::BeiDou;
    let set = &if own_time { set.clone().timed(|at| BDT.label(at)) } else { set.clone() };
    let week = if own_time { set.toe.week() - BDT_WEEK } else { set.toe.week() } as f64;
    let fifth = match set.sv.system {
        System::Galileo => [set.idot_radps, set.form.rinex_sources.unwrap_or(0.0), week, 0.0],
        System::Navic | System::BeiDou => [set.idot_radps, 0.0, week, 0.0],
        _ => [set.idot_radps, f64::from(set.l2_codes), week, f64::from(u8::from(set.l2_p_data_off))],
    };
    let sixth = match set.sv.system {
        System::Galileo => [sisa_m(set.ura_index), f64::from(status_of_record(set.health)), set.tgd2_s, set.tgd_s],
        System::Navic => [ura_m(set.ura_index), f64::from(set.health), set.tgd_s, 0.0],
        System::BeiDou => [ura_m(set.ura_index), f64::from(set.health), set.tgd_s, set.tgd2_s],
        _ => [ura_m(set.ura_index), f64::from(set.health), set.tgd_s, f64::from(set.iodc)],
    };
    // Seconds of the week of the reference time, before it too.
    let transmitted_s = set.transmitted.since(set.toe) + set.toe.tow_s();
    let after = match set.long_fit {
        _ if own_time => f64::from(set.iodc),
        _ if set.is_sent_after_reference() => 0.0,
        // The flag itself (RINEX 3.05, table A12).
        long if set.sv.system == System::Qzss => f64::from(u8::from(long)),
        true => 6.0,
        false => 4.0,
    };
    let issue = if own_time { u16::from(set.aodo) } else { set.iode };
    let lines = [
        [f64::from(issue), set.crs_m, set.delta_n_radps, set.m0_rad],
        [set.cuc_rad, set.eccentricity, set.cus_rad, set.sqrt_a_sqrtm],
        [set.toe.tow_s(), set.cic_rad, set.omega0_rad, set.cis_rad],
        [set.i0_rad, set.crc_m, set.omega_rad, set.omega_dot_radps],
        fifth,
        sixth,
        [transmitted_s, after, 0.0, 0.0],
    ];
    let mut text = clock_line(set);
    for line in lines {
        text += &format!("    {}\n", values(&line));
    }
    text
}

/// Metres of a user range accuracy index (IS-GPS-200N, 20.3.3.3.1.3).
fn ura_m(index: u8) -> f64 {
    const NOMINAL_M: [f64; 7] = [2.0, 2.8, 4.0, 5.7, 8.0, 11.3, 16.0];
    match NOMINAL_M.get(usize::from(index)) {
        Some(metres) => *metres,
        None => libm::exp2(f64::from(index.min(15)) - 2.0),
    }
}

/// Metres of a signal-in-space accuracy index; −1 states that there is no prediction (Galileo OS SIS ICD 2.1,
/// table 90).
fn sisa_m(index: u8) -> f64 {
    let index = f64::from(index);
    match index {
        0.0..50.0 => 0.01 * index,
        50.0..75.0 => 0.5 + 0.02 * (index - 50.0),
        75.0..100.0 => 1.0 + 0.04 * (index - 75.0),
        100.0..126.0 => 2.0 + 0.16 * (index - 100.0),
        _ => -1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bdgim::Bdgim;
    use crate::beidou::b1c::B1C;
    use crate::beidou::b2a::B2A;
    use crate::beidou::b2b::B2B;
    use crate::beidou::bcnav1::B_CNAV1;
    use crate::beidou::bcnav2::B_CNAV2;
    use crate::beidou::bcnav3::B_CNAV3;
    use crate::beidou::d1d2::D1_D2;
    use crate::beidou::in_phase::B1I;
    use crate::galileo::e1::E1;
    use crate::galileo::e5::{E5A, E5B};
    use crate::galileo::fnav::FNAV;
    use crate::galileo::inav::{INAV, INAV_E5B};
    use crate::glonass::fdma::{G1, channel};
    use crate::glonass::gnav::GNAV;
    use crate::gps;
    use crate::gps::cnav::CNAV;
    use crate::gps::cnav2::CNAV2;
    use crate::gps::l1c::L1C;
    use crate::gps::l1ca::L1_CA;
    use crate::gps::lnav::{LNAV, UtcData};
    use crate::klobuchar::Klobuchar;
    use crate::message::Common;
    use crate::navic::nav::SPS_NAV;
    use crate::navic::sps::L5;
    use crate::rinex;
    use crate::sbas::message::SBAS;
    use crate::time::{GLONASST, TimePolynomial, WEEK_S};

    const NAVIC: &[u8] = include_bytes!("../../../scenarios/navic_2026-03-09_10h_12h.rnx");
    const QZSS: &[u8] = include_bytes!("../../../scenarios/qzss_2023-03-12_02h_04h.rnx");

    /// True if both values agree to the twelve digits after the first that RINEX keeps.
    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs()
    }

    /// Kilometres of a number of metres as they are printed.
    fn near_km(metres: f64) -> f64 {
        exponent(1e-3 * metres, 12).parse().unwrap()
    }

    /// A file as the crate of that name reads it.
    fn foreign(text: &str) -> ::rinex::prelude::Rinex {
        let read = ::rinex::prelude::Rinex::parse_with_diagnostics(&mut std::io::BufReader::new(text.as_bytes()));
        let (file, left_out) = read.unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert!(left_out.is_empty(), "{left_out:?}\n{text}");
        file
    }

    #[test]
    fn sets_of_every_system_are_read_back_as_they_were_written_here_and_elsewhere() {
        let mut count = BTreeMap::new();
        let day = rinex::embedded().unwrap().ephemerides.into_iter().step_by(17);
        let both = rinex::embedded_two_systems().unwrap().ephemerides;
        let fnav = both.iter().filter(|set| set.sv.system == System::Galileo).map(FNAV.form).collect::<Vec<_>>();
        let navic = rinex::read(NAVIC, "navic").unwrap().ephemerides;
        let qzss = rinex::read(QZSS, "qzss").unwrap().ephemerides;
        let sets = day.chain(both).chain(fnav).chain(navic).chain(qzss);
        for (set, version) in sets.flat_map(|set| [(set.clone(), Version::Three), (set, Version::Four)]) {
            let records = match set.sv.system {
                System::Galileo if set.form.name == FNAV.name => FNAV.rinex,
                System::Galileo => INAV.rinex,
                System::Navic => SPS_NAV.rinex,
                System::BeiDou => D1_D2.rinex,
                System::Glonass => GNAV.rinex,
                System::Sbas => SBAS.rinex,
                _ => LNAV.rinex,
            };
            let title = heading(version, records.unwrap(), set.sv);
            let end = header_line("", "END OF HEADER");
            let text = opening(version, "N: GNSS NAV DATA", &[set.sv.system], set.toe)
                + &end
                + &title
                + &record(&set, channel(set.sv.number).filter(|_| set.vector.is_some()));
            let read = rinex::read(text.as_bytes(), "own").unwrap_or_else(|error| panic!("{error}\n{text}"));
            let [back] = read.ephemerides.as_slice() else { panic!("{:?}\n{text}", read.skipped) };
            assert_eq!(back.form, set.form);
            let whole = |e: &Ephemeris| (e.sv, e.toe, e.toc, e.iode, e.iodc, e.ura_index, e.health, e.long_fit);
            assert_eq!(whole(back), whole(&set), "{text}");
            let values = |e: &Ephemeris| {
                let orbit = [e.sqrt_a_sqrtm, e.eccentricity, e.m0_rad, e.delta_n_radps, e.omega0_rad, e.omega_rad];
                let rates = [e.omega_dot_radps, e.i0_rad, e.idot_radps, e.cuc_rad, e.cus_rad, e.crc_m, e.crs_m];
                let rest = [e.cic_rad, e.cis_rad, e.af0_s, e.af1_sps, e.af2_sps2, e.tgd_s, e.tgd2_s];
                let axes = e.vector.map(|of| [of.position_m, of.velocity_mps, of.acceleration_mps2]);
                let vector = axes.iter().flatten().flat_map(|axis| axis.iter().copied());
                [&orbit[..], &rates, &rest].concat().into_iter().chain(vector).collect::<Vec<f64>>()
            };
            assert!(values(back).iter().zip(values(&set)).all(|(a, b)| near(*a, b)), "{back:?}\n{set:?}");
            // Another program's reader finds the same elements of the same satellite and message.
            let file = foreign(&text);
            let frames: Vec<_> = file.nav_ephemeris_frames_iter().collect();
            let [(key, frame)] = frames.as_slice() else { panic!("{} frames\n{text}", frames.len()) };
            // Its plain form names satellites of augmentation systems.
            assert_eq!(format!("{:x}", key.sv), set.sv.to_string(), "{text}");
            if version == Version::Four {
                assert_eq!(key.msgtype.to_string(), title.trim_end().rsplit(' ').next().unwrap_or(""), "{text}");
            }
            if let Some(vector) = set.vector {
                let place = ["satPosX", "satPosY", "satPosZ"].map(|name| frame.get_orbit_f64(name).unwrap());
                assert_eq!(place, [0, 1, 2].map(|axis| near_km(vector.position_m[axis])), "{text}");
                assert_eq!((frame.clock_bias, frame.clock_drift), (set.af0_s, set.af1_sps), "{text}");
                *count.entry(title).or_insert(0) += 1;
                continue;
            }
            let names = ["sqrta", "e", "m0", "deltaN", "omega0", "omega", "omegaDot", "i0", "idot", "cuc", "cus"];
            let rest = ["crc", "crs", "cic", "cis"];
            let found: Vec<f64> = names.iter().chain(&rest).filter_map(|name| frame.get_orbit_f64(name)).collect();
            let clock = [frame.clock_bias, frame.clock_drift, frame.clock_drift_rate];
            assert_eq!([&found[..], &clock].concat(), values(back)[..18], "{text}");
            *count.entry(title).or_insert(0) += 1;
        }
        let of = |version: &str| count.keys().filter(|title| title.contains(version)).count();
        assert!(count[""] > 100, "{count:?}");
        let per_message = [" LNAV", " INAV", " FNAV", " D1", " D2", " FDMA"].map(of);
        assert!(per_message.iter().all(|satellites| *satellites > 0) && of("> EPH I") > 3, "{count:?}");
        assert_eq!(of("> EPH J"), 4, "{count:?}");
    }

    /// Sends a satellite's message for half of a quarter of an hour. LNAV, the slowest, needs it for its
    /// ionosphere page. The start is a second at which units of every length begin.
    fn send(sets: &mut NavigationSets, (message, signal, set): &(&Message, &Signal, Ephemeris), common: &Common) {
        let sender = (message.sender)(common).unwrap();
        let set = (message.form)(set).timed(|at| signal.time.label(at));
        let begin = set.toe.seconds().div_euclid(4500) * 4500 + message.first_s;
        for start in (0..750).step_by(message.unit_s as usize) {
            let symbols = sender.unit(&set, Epoch::new(begin + start, 0.0)).unwrap();
            let Some((of_set, parameters)) = (message.parameters)(&symbols) else { continue };
            let issue = if of_set { u32::from(set.iode) } else { 0 };
            NavigationRow::each(set.sv, message.name, issue, parameters).for_each(|row| sets.take(&row));
        }
    }

    #[test]
    fn an_issue_that_comes_again_names_another_set_and_neither_is_lost() {
        let both = rinex::embedded_two_systems().unwrap().ephemerides;
        let set = both.iter().find(|set| set.sv.system == System::Gps && set.is_healthy()).unwrap();
        // The later one has the earlier one's orbit, most of its values are those of before.
        for iode in [8, 0] {
            let earlier = Ephemeris { iode, iodc: iode, ..set.clone() };
            let toe = earlier.toe.plus_s(14_400.0);
            let later = Ephemeris { toe, toc: toe, af0_s: earlier.af0_s + 1e-6, ..earlier.clone() };
            let sender = (LNAV.sender)(&Common::default()).unwrap();
            let (mut sets, mut written) = (NavigationSets::default(), NavigationSets::default());
            for (sample, set) in [(1, &earlier), (100_000, &later)] {
                let begin = set.toe.seconds().div_euclid(4500) * 4500;
                for unit in 0..10 {
                    let symbols = sender.unit(set, Epoch::new(begin + 6 * unit, 0.0)).unwrap();
                    let Some((true, parameters)) = (LNAV.parameters)(&symbols) else { continue };
                    let rows = NavigationRow::each(set.sv, LNAV.name, u32::from(iode), parameters);
                    // A file that has each row once for each set, as the receiver writes it, says the same.
                    let rows: Vec<_> = rows.map(|row| NavigationRow { sample: sample + unit as u64, ..row }).collect();
                    let begins = rows.iter().any(|row| sets.is_issued_again(row));
                    let new = |row: &&NavigationRow| sets.insert(row) || begins;
                    rows.iter().filter(new).for_each(|row| written.take(row));
                }
            }
            for sets in [&sets, &written] {
                let found = sets.ephemerides(&[&L1_CA], set.toe);
                let clocks: Vec<(f64, f64)> = found.iter().map(|own| (own.toe.since(set.toe), own.af0_s)).collect();
                let expected = [&earlier, &later].map(|own| (own.toe.since(set.toe), own.af0_s));
                assert_eq!(clocks.len(), 2, "issue {iode}: {clocks:?}");
                for ((at, clock), (own_at, own)) in clocks.iter().zip(expected) {
                    assert!(*at == own_at && (clock - own).abs() < 3e-10, "issue {iode}: {clocks:?}");
                }
            }
        }
    }

    #[test]
    fn records_of_glonass_say_a_frame_of_their_half_hour_and_the_flag_of_string_3_in_its_own_bit() {
        let both = rinex::embedded_two_systems().unwrap().ephemerides;
        let set = both.iter().find(|set| set.vector.is_some() && set.is_healthy()).unwrap();
        for (health, flags) in [(0, 0.0), (0b1000, 4.0)] {
            let (sender, own) = ((GNAV.sender)(&Common::default()).unwrap(), Ephemeris { health, ..set.clone() });
            let own = own.timed(|at| GLONASST.label(at));
            let mut sets = NavigationSets::default();
            let frame = own.toe.seconds();
            for start in (0..10).step_by(2) {
                let symbols = sender.unit(&own, Epoch::new(frame + start, 0.0)).unwrap();
                let (_, parameters) = (GNAV.parameters)(&symbols).unwrap();
                NavigationRow::each(set.sv, GNAV.name, u32::from(own.iode), parameters).for_each(|row| sets.take(&row));
            }
            // Read within the half hour, and long before and after it.
            for (read_s, sent_s) in [(0.0, 0.0), (46.5, 30.0), (-7000.0, -900.0), (7000.0, 870.0)] {
                let mut bytes = Vec::new();
                sets.write(&mut bytes, Version::Three, &[&G1], set.toe.plus_s(read_s)).unwrap();
                let text = String::from_utf8(bytes).unwrap();
                let lines: Vec<&str> = text.lines().rev().take(5).collect();
                let number = |line: &str, from: usize| line[from..from + 19].trim().parse::<f64>().unwrap();
                assert_eq!(number(lines[4], 61), UTC.label(set.toe).tow_s() + sent_s, "{text}");
                assert_eq!((number(lines[0], 61), number(lines[3], 61)), (flags, 0.0), "{text}");
            }
        }
    }

    #[test]
    fn sets_of_newer_messages_are_found_elsewhere_under_their_names() {
        let both = rinex::embedded_two_systems().unwrap().ephemerides;
        let first = |system, least: u8| {
            let mut own = both.iter().filter(|set| set.sv.system == system && set.sv.number >= least);
            own.find(|set| set.is_healthy()).unwrap().clone()
        };
        let [gps, beidou] = [first(System::Gps, 1), first(System::BeiDou, 19)];
        let sent: [(&Message, &'static Signal, Ephemeris, &str, &[&str]); 5] = [
            (&CNAV, &gps::l5::L5, gps.clone(), "CNAV", &["tgd", "iscL1Ca", "iscL5Q5"]),
            (&CNAV2, &L1C, gps, "CNV2", &["tgd", "iscL1Cp", "iscL1Cd"]),
            (&B_CNAV1, &B1C, beidou.clone(), "CNV1", &["tgdB1Cp", "tgdB2ap", "toe", "iode", "iodc"]),
            (&B_CNAV2, &B2A, beidou.clone(), "CNV2", &["tgdB1Cp", "tgdB2ap", "toe", "iode", "iodc"]),
            (&B_CNAV3, &B2B, beidou, "CNV3", &["tgdB2bI", "toe"]),
        ];
        for (message, signal, set, name, own) in sent {
            let mut sets = NavigationSets::default();
            send(&mut sets, &(message, signal, set.clone()), &Common::default());
            let mut bytes = Vec::new();
            sets.write(&mut bytes, Version::Four, &[signal], set.toe).unwrap();
            let text = String::from_utf8(bytes).unwrap();
            let decoded = message.fields.quantised(&(message.form)(&set)).unwrap();
            let file = foreign(&text);
            let frames: Vec<_> = file.nav_ephemeris_frames_iter().collect();
            let [(key, frame)] = frames.as_slice() else { panic!("{} frames\n{text}", frames.len()) };
            assert_eq!((key.sv.to_string(), key.msgtype.to_string()), (set.sv.to_string(), name.to_owned()), "{text}");
            let in_own_time = if set.sv.system == System::BeiDou { BDT.label(decoded.toe) } else { decoded.toe };
            let value = |field: &str| match field {
                "sqrta" => decoded.sqrt_a_sqrtm,
                "adot" => decoded.axis_rate_mps,
                "m0" => decoded.m0_rad,
                "crs" => decoded.crs_m,
                "cis" => decoded.cis_rad,
                "omegaDot" => decoded.omega_dot_radps,
                "idot" => decoded.idot_radps,
                "deltaN0Dot" => decoded.delta_n_rate_radps2,
                "toe" => in_own_time.tow_s(),
                "iode" => f64::from(decoded.iode),
                "iodc" => f64::from(decoded.iodc),
                "tgd" | "tgdB1Cp" | "tgdB2bI" => decoded.tgd_s,
                "tgdB2ap" => decoded.tgd2_s,
                "iscL1Ca" => decoded.isc_s[0],
                "iscL5Q5" => decoded.isc_s[3],
                "iscL1Cp" => decoded.isc_s[4],
                "iscL1Cd" => decoded.isc_s[5],
                other => panic!("{other}"),
            };
            // The seventh line has the predicted accuracies of BeiDou's messages, as files of other
            // converters do. Of the orbit along the track only B-CNAV3 speaks here: B-CNAV2 in messages that
            // are not sent, and B-CNAV1 in page 1, which has the ionosphere.
            let accuracies = text.lines().skip_while(|line| !line.starts_with("> EPH")).nth(7).unwrap();
            let blank = (0..4).map(|place| accuracies.get(4 + 19 * place..23 + 19 * place).map_or("", str::trim));
            let blank = blank.filter(|field| field.is_empty()).count();
            assert!(set.sv.system != System::BeiDou || blank == usize::from(name != "CNV3"), "{text}");
            let all = ["sqrta", "adot", "m0", "crs", "cis", "omegaDot", "idot", "deltaN0Dot"];
            for field in all.iter().chain(own) {
                let found = frame.get_orbit_f64(field).unwrap_or_else(|| panic!("{name}: no {field}\n{text}"));
                let sent = value(field);
                // An angle may be a turn away.
                let turn = if *field == "m0" { std::f64::consts::TAU } else { 0.0 };
                let apart = [-turn, 0.0, turn].map(|turn| (found - sent + turn).abs());
                let least = apart.into_iter().fold(f64::MAX, f64::min);
                assert!(least <= 2e-12 * sent.abs(), "{name} {field}: {found:e} {sent:e}\n{text}");
            }
        }
    }

    #[test]
    fn a_file_of_all_messages_sent_has_each_set_and_each_systems_ionosphere() {
        let both = rinex::embedded_two_systems().unwrap();
        let navic = rinex::read(NAVIC, "navic").unwrap();
        let alpha_beta = |scale: f64| Klobuchar {
            alpha: [1.0, -2.0, 8.0, -16.0].map(|steps: f64| steps * scale * libm::exp2(-27.0)),
            beta: [3.0, -1.0, 4.0, -8.0].map(|steps: f64| steps * scale * libm::exp2(14.0)),
        };
        let toe = both.ephemerides.iter().find(|set| set.sv.system == System::Gps).unwrap().toe;
        let ahead = |steps: f64, rate: f64, of_week_s: i64| TimePolynomial {
            a0_s: steps * libm::exp2(-30.0),
            a1_sps: rate * libm::exp2(-50.0),
            reference: Epoch::new(toe.week() * WEEK_S + of_week_s, 0.0),
        };
        let common = Common {
            klobuchar: Some(alpha_beta(1.0)),
            klobuchar_navic: Some(alpha_beta(2.0)),
            klobuchar_beidou: Some(alpha_beta(4.0)),
            nequick: Some([100.0, 0.25, 0.0625]),
            // On steps of their fields: 36 times 4096 s, and 40 hours.
            utc: UtcData { leap_s: 18, polynomial: Some(ahead(3.0, 64.0, 147_456)), event: None },
            galileo: Some(ahead(-5.0, -16.0, 144_000)),
            ..Common::default()
        };
        let first = |system| {
            let mut sets = both.ephemerides.iter().chain(&navic.ephemerides);
            sets.find(|set| set.sv.system == system && set.is_healthy()).unwrap().clone()
        };
        let d2 = Ephemeris { sv: Sv { system: System::BeiDou, number: 2 }, ..first(System::BeiDou) };
        let sent: [(&Message, &'static Signal, Ephemeris); 7] = [
            (&LNAV, &L1_CA, first(System::Gps)),
            (&INAV, &E1, first(System::Galileo)),
            (&INAV_E5B, &E5B, first(System::Galileo)),
            (&FNAV, &E5A, first(System::Galileo)),
            (&D1_D2, &B1I, first(System::BeiDou)),
            (&D1_D2, &B1I, d2),
            (&SPS_NAV, &L5, first(System::Navic)),
        ];
        let mut sets = NavigationSets::default();
        sent.iter().for_each(|sent| send(&mut sets, sent, &common));
        let signals: Vec<&'static Signal> = sent.iter().map(|(_, signal, _)| *signal).collect();
        for version in [Version::Three, Version::Four] {
            let mut bytes = Vec::new();
            sets.write(&mut bytes, version, &signals, first(System::Gps).toe).unwrap();
            let text = String::from_utf8(bytes).unwrap();
            let ours = rinex::read(text.as_bytes(), "own").unwrap();
            assert!(ours.skipped.is_empty(), "{:?}\n{text}", ours.skipped);
            // A header of version 3 has five digits.
            let digits = if version == Version::Three { 4 } else { 12 };
            let printed = |model: Option<Klobuchar>| {
                let four = |values: [f64; 4]| values.map(|value| exponent(value, digits).parse::<f64>().unwrap());
                model.map(|model| Klobuchar { alpha: four(model.alpha), beta: four(model.beta) })
            };
            assert_eq!(ours.klobuchar, printed(common.klobuchar), "{text}");
            assert_eq!(ours.klobuchar_navic, printed(common.klobuchar_navic), "{text}");
            assert_eq!(
                (ours.klobuchar_beidou, ours.nequick),
                (printed(common.klobuchar_beidou), common.nequick),
                "{text}"
            );
            let shortened = |offset: Option<TimePolynomial>| {
                let shortened = |value, digits| exponent(value, digits).parse::<f64>().unwrap();
                let [a0, a1] = if version == Version::Three { [10, 9] } else { [12, 12] };
                let short = |o: TimePolynomial| (shortened(o.a0_s, a0), shortened(o.a1_sps, a1), o.reference);
                offset.map(short)
            };
            assert_eq!(shortened(ours.utc), shortened(common.utc.polynomial), "{text}");
            assert_eq!(shortened(ours.galileo), shortened(common.galileo), "{text}");
            let file = foreign(&text);
            let records = text.lines().filter(|line| line.get(1..3).is_some_and(|n| n.parse::<u8>().is_ok())).count();
            let satellites: BTreeSet<String> =
                file.nav_ephemeris_frames_iter().map(|(key, _)| key.sv.to_string()).collect();
            assert_eq!((records, satellites.len()), (6, 5), "{text}");
            if version == Version::Four {
                assert_eq!(file.nav_ephemeris_frames_iter().count(), 6, "{text}");
                let models = file.nav_ionosphere_models_iter().map(|(key, model)| {
                    let klobuchar = model.as_klobuchar().map(|found| [found.alpha.1, found.beta.3]);
                    let values = klobuchar.or(model.as_nequick_g().map(|found| [found.a.0, found.a.2]));
                    (format!("{} {}", key.sv.constellation, key.msgtype), values)
                });
                let models: BTreeMap<String, Option<[f64; 2]>> = models.collect();
                let sent = |model| printed(model).map(|model| [model.alpha[1], model.beta[3]]);
                assert_eq!(models.len(), 4, "{models:?}\n{text}");
                assert_eq!(models["GPS (US) LNAV"], sent(common.klobuchar), "{text}");
                assert_eq!(models["IRNSS (IN) LNAV"], sent(common.klobuchar_navic), "{text}");
                assert_eq!(models["BeiDou (CH) D1D2"], sent(common.klobuchar_beidou), "{text}");
                assert_eq!(models["Galileo (EU) IFNV"], Some([100.0, 0.0625]), "{text}");
                let offsets = file.nav_system_time_frames_iter().map(|(key, offset)| {
                    let pair = offset.time_system.clone().unwrap_or_default();
                    (format!("{pair} {} {}", key.msgtype, offset.utc.clone().unwrap_or_default()), offset.polynomial)
                });
                let offsets: BTreeMap<String, (f64, f64, f64)> = offsets.collect();
                let named: Vec<&str> = offsets.keys().map(String::as_str).collect();
                assert_eq!(
                    named,
                    ["GAGP IFNV ", "GAUT IFNV UTCGAL", "GPUT LNAV UTC(USNO)", "IRUT LNAV UTCIRN"],
                    "{text}"
                );
            } else {
                assert_eq!(text.matches("IONOSPHERIC CORR").count(), 7, "{text}");
            }
        }
        assert_eq!("4".parse(), Ok(Version::Four));
        assert!("2.11".parse::<Version>().unwrap_err().to_string().contains("3.05 or 4.02"));
    }

    #[test]
    fn coefficients_of_bdgim_have_one_record_of_version_4_whichever_message_sent_them_and_no_line_of_version_3() {
        let both = rinex::embedded_two_systems().unwrap().ephemerides;
        let mut own = both.iter().filter(|set| set.sv.system == System::BeiDou && set.sv.number >= 19);
        let set = own.find(|set| set.is_healthy()).unwrap().clone();
        let alpha_tecu = [30.875, 0.25, 11.625, 10.375, -12.5, 0.75, -0.125, 3.125, 1.875];
        let klobuchar = Klobuchar { alpha: [libm::exp2(-27.0); 4], beta: [libm::exp2(16.0); 4] };
        let bdgim = Bdgim::given(alpha_tecu);
        let common = Common { bdgim, klobuchar_beidou: Some(klobuchar), ..Common::default() };
        let all: [(&Message, &'static Signal); 4] =
            [(&B_CNAV1, &B1C), (&B_CNAV2, &B2A), (&B_CNAV3, &B2B), (&D1_D2, &B1I)];
        for sent in [&all[..1], &all[1..2], &all[2..3], &all[..]] {
            let mut sets = NavigationSets::default();
            sent.iter().for_each(|(message, signal)| send(&mut sets, &(*message, *signal, set.clone()), &common));
            let signals: Vec<&'static Signal> = sent.iter().map(|(_, signal)| *signal).collect();
            let text = |version| {
                let mut bytes = Vec::new();
                sets.write(&mut bytes, version, &signals, set.toe).unwrap();
                String::from_utf8(bytes).unwrap()
            };
            let four = text(Version::Four);
            assert_eq!(four.matches(&format!("> ION {} CNVX\n", set.sv)).count(), 1, "{four}");
            let file = foreign(&four);
            let models: Vec<_> = file.nav_ionosphere_models_iter().filter_map(|(_, model)| model.as_bdgim()).collect();
            let [model] = models.as_slice() else { panic!("{} models\n{four}", models.len()) };
            let [a, b, c, d, e, f, g, h, i] = alpha_tecu;
            assert_eq!(model.alpha, (a, b, c, d, e, f, g, h, i), "{four}");
            // Ours wants ephemerides of messages that it reads.
            let is_all = sent.len() == all.len();
            if is_all {
                let read = rinex::read(four.as_bytes(), "own").unwrap();
                assert_eq!((read.bdgim, read.klobuchar_beidou.is_some()), (bdgim, true), "{four}");
            }
            // Version 3 has a line of each list of the older model.
            let lines = text(Version::Three).matches("IONOSPHERIC CORR").count();
            assert_eq!(lines, if is_all { 2 } else { 0 });
        }
    }

    #[test]
    fn accuracies_are_those_of_their_index() {
        for index in (0..=125).chain([255]) {
            assert_eq!(crate::galileo::inav::sisa_index(Some(sisa_m(index)).filter(|m| *m >= 0.0)), index);
        }
        assert_eq!([0, 6, 7, 14].map(ura_m), [2.0, 16.0, 32.0, 4096.0]);
    }

    #[test]
    fn numbers_have_an_exponent_of_two_digits() {
        assert_eq!(exponent(-1.5e-10, 12), "-1.500000000000E-10");
        assert_eq!((exponent(0.0, 4), exponent(432_000.0, 12)), ("0.0000E+00".into(), "4.320000000000E+05".into()));
    }
}
