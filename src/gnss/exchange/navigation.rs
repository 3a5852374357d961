//! Navigation files of sets by the raw parameters of their messages, as they were sent or decoded.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use super::{calendar, header_line, opening};
use crate::gnss::broadcast::{Ephemeris, status_of_record};
use crate::gnss::ionosphere::Coefficients;
use crate::gnss::message::Message;
use crate::gnss::record::NavigationRow;
use crate::gnss::satellite::{Sv, System};
use crate::gnss::signal::Signal;
use crate::gnss::time::{BDT, Epoch, TimeScale};

/// Continuous GPS week of week 0 of BDT.
const BDT_WEEK: i64 = 1356;

/// The parameters of a set, or of what is common to all, by name.
type Raws = BTreeMap<String, i64>;

/// Collects parameters as they come; a set is some kilobytes, however often it is read again.
#[derive(Debug, Default)]
pub struct NavigationSets {
    /// By message, satellite and issue: where parameters of no issue are newest, they are common.
    sets: BTreeMap<(String, Sv, u32), Raws>,
    common: BTreeMap<String, Raws>,
}

impl NavigationSets {
    /// Takes a parameter.
    pub fn take(&mut self, row: &NavigationRow) {
        let raws = if row.issue == 0 {
            // Those of an issue 0 are of a set too.
            self.common.entry(row.message.clone()).or_default().insert(row.parameter.clone(), row.raw);
            self.sets.entry((row.message.clone(), row.sv, 0)).or_default()
        } else {
            self.sets.entry((row.message.clone(), row.sv, row.issue)).or_default()
        };
        raws.insert(row.parameter.clone(), row.raw);
    }

    /// Writes all whole sets, each once, near a time by which their weeks are resolved; `signals` are those
    /// whose messages were read.
    ///
    /// # Errors
    /// What the writer reports.
    pub fn write(&self, mut writer: impl Write, signals: &[&'static Signal], near: Epoch) -> io::Result<()> {
        let messages: BTreeMap<&str, (&'static Message, &'static TimeScale)> = (signals.iter())
            .flat_map(|signal| signal.components.iter().filter_map(|component| Some((component.message?, signal.time))))
            .map(|(message, time)| (message.name, (message, time)))
            .collect();
        let mut systems: Vec<System> = signals.iter().map(|signal| signal.system).collect();
        systems.sort();
        systems.dedup();
        let mut text = opening("N: GNSS NAV DATA", &systems, near);
        for (name, raws) in &self.common {
            let coefficients = messages
                .get(name.as_str())
                .and_then(|(message, _)| (message.ionosphere.coefficients)(&|name| raws.get(name).copied()));
            text += &coefficients.map_or_else(String::new, ionosphere);
        }
        text += &header_line(&format!("{:6}", near.leap_seconds()), "LEAP SECONDS");
        text += &header_line("", "END OF HEADER");
        let mut known = BTreeSet::new();
        for ((name, sv, issue), raws) in &self.sets {
            let Some((message, time)) = messages.get(name.as_str()) else { continue };
            let set = (message.elements)(*sv, &|name| raws.get(name).copied(), time.label(near));
            let set = set.map(|set| set.timed(|label| time.instant(label)));
            if let Some(set) = set.filter(|set| known.insert((*sv, *issue, set.form.name))) {
                text += &record(&set);
            }
        }
        writer.write_all(text.as_bytes()).and_then(|()| writer.flush())
    }
}

/// Lines of a header for the ionosphere's coefficients.
fn ionosphere(sent: Coefficients) -> String {
    let line = |name: &str, values: [f64; 4]| {
        let values = values.map(|value| format!("{:>12}", exponent(value, 4))).concat();
        header_line(&format!("{name:<5}{values}"), "IONOSPHERIC CORR")
    };
    match sent {
        Coefficients::Klobuchar(model) => line("GPSA", model.alpha) + &line("GPSB", model.beta),
        Coefficients::KlobucharNavic(model) => line("IRNA", model.alpha) + &line("IRNB", model.beta),
        Coefficients::KlobucharBeidou(model) => line("BDSA", model.alpha) + &line("BDSB", model.beta),
        Coefficients::NequickG(model) => {
            let [a, b, c] = model.coefficients;
            line("GAL", [a, b, c, 0.0])
        }
    }
}

/// A number with an exponent of two digits.
fn exponent(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$E}");
    let (mantissa, exponent) = text.split_once('E').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    format!("{mantissa}E{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs())
}

/// A set: a line with the clock, seven with the rest (RINEX 3.05, tables A6, A8, A14 and A18).
fn record(set: &Ephemeris) -> String {
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
    let values =
        |values: &[f64]| values.iter().map(|value| format!("{:>19}", exponent(*value, 12))).collect::<String>();
    let [year, month, day, hour, minute, second] = calendar(set.toc);
    let clock = values(&[set.af0_s, set.af1_sps, set.af2_sps2]);
    let mut text = format!("{} {year:04} {month:02} {day:02} {hour:02} {minute:02} {second:02}{clock}\n", set.sv);
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

/// Metres of a signal-in-space accuracy index; −1 says that there is no prediction (Galileo OS SIS ICD 2.1,
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
    use crate::gnss::galileo::fnav::FNAV;
    use crate::gnss::rinex;

    /// What RINEX rounds to twelve digits after the first.
    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs()
    }

    #[test]
    fn sets_of_both_systems_are_read_back_as_they_were_written() {
        let mut count = [0, 0];
        let sets = rinex::embedded().unwrap().ephemerides.into_iter().step_by(17);
        let both = rinex::embedded_two_systems().unwrap().ephemerides;
        let fnav = both.iter().filter(|set| set.sv.system == System::Galileo).map(FNAV.form).collect::<Vec<_>>();
        for set in sets.chain(both).chain(fnav) {
            let systems = [set.sv.system];
            let header = opening("N: GNSS NAV DATA", &systems, set.toe) + &header_line("", "END OF HEADER");
            let text = header + &record(&set);
            let read = rinex::read(text.as_bytes(), "own").unwrap_or_else(|error| panic!("{error}\n{text}"));
            let [back] = read.ephemerides.as_slice() else { panic!("{:?}\n{text}", read.skipped) };
            assert_eq!(back.form, set.form);
            let whole = |e: &Ephemeris| (e.sv, e.toe, e.toc, e.iode, e.iodc, e.ura_index, e.health, e.long_fit);
            assert_eq!(whole(back), whole(&set), "{text}");
            let values = |e: &Ephemeris| {
                let orbit = [e.sqrt_a_sqrtm, e.eccentricity, e.m0_rad, e.delta_n_radps, e.omega0_rad, e.omega_rad];
                let rates = [e.omega_dot_radps, e.i0_rad, e.idot_radps, e.cuc_rad, e.cus_rad, e.crc_m, e.crs_m];
                let rest = [e.cic_rad, e.cis_rad, e.af0_s, e.af1_sps, e.af2_sps2, e.tgd_s, e.tgd2_s];
                [&orbit[..], &rates, &rest].concat()
            };
            assert!(values(back).iter().zip(values(&set)).all(|(a, b)| near(*a, b)), "{back:?}\n{set:?}");
            count[usize::from(set.sv.system == System::Galileo)] += 1;
        }
        assert!(count.iter().all(|count| *count > 10), "{count:?}");
    }

    #[test]
    fn accuracies_are_those_of_their_index() {
        for index in (0..=125).chain([255]) {
            assert_eq!(crate::gnss::galileo::inav::sisa_index(Some(sisa_m(index)).filter(|m| *m >= 0.0)), index);
        }
        assert_eq!([0, 6, 7, 14].map(ura_m), [2.0, 16.0, 32.0, 4096.0]);
    }

    #[test]
    fn numbers_have_an_exponent_of_two_digits() {
        assert_eq!(exponent(-1.5e-10, 12), "-1.500000000000E-10");
        assert_eq!((exponent(0.0, 4), exponent(432_000.0, 12)), ("0.0000E+00".into(), "4.320000000000E+05".into()));
    }
}
