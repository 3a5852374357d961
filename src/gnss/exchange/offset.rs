//! Offsets of time scales in navigation files: lines of the header of version 3 ("TIME SYSTEM CORR") and
//! `STO` records of version 4.

use super::{calendar, header_line};
use crate::bits::Field;
use crate::exchange::navigation::exponent;
use crate::message::{Raw, Records};
use crate::satellite::{Sv, System};
use crate::time::{BDT, BDT_WEEK, Epoch, WEEK_S};

/// One time scale against another, as a message states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Offset {
    /// RINEX name of the pair of time scales.
    pub pair: &'static str,
    /// Name of the UTC realisation in RINEX 4.
    utc: &'static str,
    /// Constant, rate and its change, in seconds.
    polynomial: [f64; 3],
    /// Reference time, in the own time of the system.
    reference: Epoch,
}

/// Prefix of an offset's parameters, RINEX name of the pair, and name of the UTC realisation.
type Named = (&'static str, &'static str, &'static str);

/// Time offsets that messages of a system contain.
fn named(system: System) -> &'static [Named] {
    match system {
        System::Gps => &[("utc", "GPUT", "UTC(USNO)")],
        System::Galileo => &[("utc", "GAUT", "UTCGAL"), ("ggto", "GAGP", "")],
        System::BeiDou => &[("utc", "BDUT", "UTC(NTSC)")],
        System::Qzss => &[("utc", "QZUT", "UTC(NICT)")],
        System::Navic => &[("utc", "IRUT", "UTCIRN")],
        // In strings of days and in numbers of another message: these are not written.
        System::Glonass | System::Sbas => &[],
    }
}

/// The offsets that the parameters of a message state, near a time by which weeks are resolved.
pub(super) fn offsets(records: &Records, system: System, raw: Raw<'_>, near: Epoch) -> Vec<Offset> {
    let tables = (records.fields)();
    let field = |prefix: &str, rest: &str| -> Option<&'static Field> {
        let own = |field: &&&Field| field.name.strip_prefix(prefix).is_some_and(|name| name == rest);
        tables.iter().flat_map(|(_, fields)| fields).find(own).copied()
    };
    let (near, first_week) = match system {
        System::BeiDou => (BDT.label(near), BDT_WEEK),
        _ => (near, 0),
    };
    let offset = |(prefix, pair, utc): &Named| {
        let value = |rest: &str| field(prefix, rest).and_then(|field| Some(field.value(raw(field.name)?)));
        let seconds = || value("_tot_s").or_else(|| value("_t0_s")).or_else(|| Some(3600.0 * value("_t0_h")?));
        let of_week_s = seconds()? as i64;
        let week = field(prefix, "_week")?;
        let count = 1_i64 << week.bits();
        // The one with these bits that is nearest.
        let sent = value("_week")? as i64 + first_week;
        let nearest = near.week() + (sent - near.week() + count / 2).rem_euclid(count) - count / 2;
        let polynomial = [value("_a0_s")?, value("_a1_sps")?, value("_a2_sps2").unwrap_or(0.0)];
        // All ones in Galileo's say that there is no offset (OS SIS ICD 2.1, 5.1.8): no time of a week.
        let reference = Epoch::new(nearest * WEEK_S + of_week_s, 0.0);
        (of_week_s < WEEK_S).then_some(Offset { pair, utc, polynomial, reference })
    };
    named(system).iter().filter_map(offset).collect()
}

impl Offset {
    /// Header line of a file of version 3 (RINEX 3.05, table A5). Weeks are those that the system counts,
    /// Galileo's as GPS does.
    pub fn line(&self, system: System) -> String {
        let [a0_s, a1_sps, _] = self.polynomial;
        let weeks = if system == System::BeiDou { self.reference.week() - BDT_WEEK } else { self.reference.week() };
        let (a0, a1) = (exponent(a0_s, 10), exponent(a1_sps, 9));
        let text = format!("{} {a0:>17}{a1:>16} {:>6} {weeks:>4}", self.pair, self.reference.tow_whole_s());
        header_line(&text, "TIME SYSTEM CORR")
    }

    /// The record of a file of version 4 of a satellite that sent it (RINEX 4.02, table of `STO` records).
    /// When it was sent is not known, which its zero states as in records of ephemerides.
    pub fn record(&self, records: &Records, sv: Sv) -> String {
        let [year, month, day, hour, minute, second] = calendar(self.reference);
        let epoch = format!("{year:04} {month:02} {day:02} {hour:02} {minute:02} {second:02}");
        let values: String =
            std::iter::once(0.0).chain(self.polynomial).map(|value| format!("{:>19}", exponent(value, 12))).collect();
        let scales = format!("{:<18} {:18} {:<18}", self.pair, "", self.utc);
        format!("> STO {sv} {}\n    {epoch} {}\n    {values}\n", records.common, scales.trim_end())
    }
}
