//! UBX, the binary protocol of u-blox receivers.
//!
//! Source: u-blox F9 HPG 1.32 interface description. `layouts` has the fields of each message; here
//! messages become observations (RXM-RAWX), positions (NAV-PVT) and clock readings (NAV-CLOCK). The whole
//! second of a fix is that of iTOW, its week that of the UTC date: a receiver that does not know the leap
//! seconds yet has a wrong UTC and a right time of week. NAV-HPPOSLLH behind a position adds digits to it.

mod layouts;

use crate::observed::{Calendar, ClockReading, Event, Fix, Locks, Observed, ObservedEpoch, Refinement, Solution};
use crate::table::{Layout, Table};
use gnss::earth::Geodetic;
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;
use layouts::{LAYOUTS, NAMES};

/// Messages that the judge needs: either is enough.
pub const NEEDED: &str = "NAV-PVT for positions or RXM-RAWX for observations";

/// Name of a frame's message, and its table; no table where its layout is not known or does not fit.
pub fn read(frame: &[u8]) -> (String, Option<&'static Layout>, Option<Table>) {
    let (class, id) = (frame.get(2).copied().unwrap_or(0), frame.get(3).copied().unwrap_or(0));
    let payload = frame.get(6..frame.len().saturating_sub(2)).unwrap_or_default();
    let mut known = LAYOUTS.iter().filter(|layout| layout.key == (class, u16::from(id)));
    let layout = match known.next() {
        // SEC-SIG has its version in the first byte.
        Some(first) if payload.first() == Some(&2) => known.next().or(Some(first)),
        first => first,
    };
    match layout {
        Some(layout) => (layout.name.to_owned(), Some(layout), layout.read(payload)),
        None => (name(class, id), None, None),
    }
}

/// Name of a message whose fields are not read.
fn name(class: u8, id: u8) -> String {
    let number = format!("{class:02x}{id:02x}");
    let mut words = NAMES.split_whitespace();
    let known = words.find(|word| *word == number).and_then(|_| words.next());
    known.map_or_else(|| format!("UBX-{class:02X}-{id:02X}"), str::to_owned)
}

/// Content of a table that can be joined with a truth.
pub fn event(table: &Table, calendar: &mut Calendar, locks: &mut Locks) -> Option<Event> {
    match table.name {
        "NAV-PVT" => Some(fix(table, calendar)),
        "NAV-CLOCK" => Some(clock(table, calendar)),
        "NAV-HPPOSLLH" => refinement(table, calendar),
        "RXM-RAWX" => {
            let mut epoch = observations(table)?;
            calendar.learn(epoch.label);
            locks.mark(&mut epoch, false);
            Some(Event::Observations(epoch))
        }
        "NAV-TIMEGPS" => {
            let valid = table.is_set(0, "towValid") && table.is_set(0, "weekValid");
            let week = table.integer(0, "week").and_then(|week| u32::try_from(week).ok()).filter(|_| valid)?;
            calendar.learn(Epoch::from_week(week, table.number(0, "iTOW")? * 1e-3));
            None
        }
        _ => None,
    }
}

fn fix(table: &Table, calendar: &mut Calendar) -> Event {
    let number = |name: &str| table.number(0, name);
    let metres = |name: &str| number(name).map(|millimetres| millimetres * 1e-3);
    // Fix types: 2D, 3D, and with dead reckoning beside satellites.
    let has_fix = table.is_set(0, "gnssFixOk") && matches!(table.integer(0, "fixType"), Some(2..=4));
    let place = number("lat").zip(number("lon")).zip(metres("height"));
    let Some(((latitude_deg, longitude_deg), height_m)) = place.filter(|_| has_fix && !table.is_set(0, "invalidLlh"))
    else {
        return Event::NoFix;
    };
    let Some(label) = label(table, calendar) else { return Event::Undated };
    calendar.learn(label);
    let velocity = metres("velE").zip(metres("velN")).zip(metres("velD"));
    Event::Fix(Fix {
        label,
        position_m: Geodetic::from_degrees(latitude_deg, longitude_deg, height_m).to_ecef(),
        velocity_enu_mps: velocity.map(|((east, north), down)| [east, north, -down]),
        solution: solution(table),
        satellites: table.integer(0, "numSV").and_then(|count| u32::try_from(count).ok()).unwrap_or(0),
        horizontal_sigma_m: metres("hAcc"),
        vertical_sigma_m: metres("vAcc"),
        speed_sigma_mps: metres("sAcc"),
        time_sigma_s: number("tAcc").map(|nanoseconds| nanoseconds * 1e-9),
    })
}

/// Kind of a position's solution.
fn solution(table: &Table) -> Solution {
    match table.integer(0, "carrSoln") {
        Some(2) => Solution::FixedCarrier,
        Some(1) => Solution::FloatCarrier,
        _ if table.is_set(0, "diffSoln") => Solution::Differential,
        _ => Solution::Single,
    }
}

/// GPS time of a fix: week by the date, second by iTOW, fraction by the date's nanoseconds.
fn label(table: &Table, calendar: &Calendar) -> Option<Epoch> {
    let tow_ms = table.integer(0, "iTOW")?;
    if !(table.is_set(0, "validDate") && table.is_set(0, "validTime")) {
        return calendar.at_ms(tow_ms);
    }
    let part = |name: &str| table.integer(0, name);
    let [year, month, day] = [part("year")?, part("month")?, part("day")?];
    let [hour, minute, second] = [part("hour")?, part("min")?, part("sec")?];
    let text = format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z");
    let dated = Epoch::parse(&text).ok()?.plus_s(table.number(0, "nano")? * 1e-9);
    let counted = Calendar::new(Some(dated)).at_ms(tow_ms)?;
    Some(dated.plus_s(counted.since(dated).round()))
}

/// Position with the further digits of NAV-HPPOSLLH: 1e-9 degrees and 0.1 mm.
fn refinement(table: &Table, calendar: &Calendar) -> Option<Event> {
    let sum = |name: &str, digits: &str| Some(table.number(0, name)? + table.number(0, digits)?);
    let label = table.integer(0, "iTOW").and_then(|tow_ms| calendar.at_ms(tow_ms));
    let label = label.filter(|_| table.integer(0, "invalidLlh") == Some(0))?;
    let (latitude_deg, longitude_deg) = (sum("lat", "latHp")?, sum("lon", "lonHp")?);
    let height_m = 1e-3 * sum("height", "heightHp")?;
    let position_m = Geodetic::from_degrees(latitude_deg, longitude_deg, height_m).to_ecef();
    Some(Event::Refinement(Refinement { label, position_m }))
}

fn clock(table: &Table, calendar: &Calendar) -> Event {
    let label = table.integer(0, "iTOW").and_then(|tow_ms| calendar.at_ms(tow_ms));
    let Some(label) = label else { return Event::Undated };
    let [bias_ns, drift_ns] = ["clkB", "clkD"].map(|name| table.number(0, name).unwrap_or(0.0));
    Event::Clock(ClockReading { label, bias_s: bias_ns * 1e-9, drift: drift_ns * 1e-9 })
}

fn observations(table: &Table) -> Option<ObservedEpoch> {
    let week = table.integer(0, "week").and_then(|week| u32::try_from(week).ok())?;
    let tow_s = table.number(0, "rcvTow").filter(|tow_s| tow_s.is_finite() && tow_s.abs() < 1e6)?;
    let label = Epoch::from_week(week, tow_s);
    let values = (0..table.rows.len()).filter_map(|row| observed(table, row)).collect();
    Some(ObservedEpoch { label, values })
}

fn observed(table: &Table, row: usize) -> Option<Observed> {
    let integer = |name: &str| table.integer(row, name);
    let (sv, code) = signal(integer("gnssId")?, integer("svId")?, integer("sigId")?)?;
    let valid =
        |value: &str, flag: &str| table.number(row, value).filter(|value| value.is_finite() && table.is_set(row, flag));
    let carrier_cycles = valid("cpMes", "cpValid");
    Some(Observed {
        sv,
        code,
        pseudorange_m: valid("prMes", "prValid"),
        carrier_cycles,
        doppler_hz: table.number(row, "doMes").filter(|value| value.is_finite()),
        cn0_dbhz: table.number(row, "cno").filter(|value| *value > 0.0),
        lock_s: table.number(row, "locktime").map(|milliseconds| milliseconds * 1e-3),
        lost_lock: false,
        half_cycle_ambiguous: carrier_cycles.is_some() && !table.is_set(row, "halfCyc"),
    })
}

/// Satellite and RINEX code of u-blox's numbers (1.5.2 and 1.5.4); none for those that RINEX has no name for.
fn signal(gnss: i64, number: i64, signal: i64) -> Option<(Sv, &'static str)> {
    let (system, first, last, codes): (_, _, _, &[(i64, &str)]) = match gnss {
        0 => (System::Gps, 1, 32, &[(0, "1C"), (3, "2L"), (4, "2S"), (6, "5I"), (7, "5Q")]),
        1 => (System::Sbas, 120, 158, &[(0, "1C")]),
        2 => (System::Galileo, 1, 36, GALILEO),
        3 => (System::BeiDou, 1, 63, BEIDOU),
        5 => (System::Qzss, 1, 10, QZSS),
        6 => (System::Glonass, 1, 32, &[(0, "1C"), (2, "2C")]),
        7 => (System::Navic, 1, 14, &[(0, "5A")]),
        _ => return None,
    };
    let code = codes.iter().find(|(known, _)| *known == signal)?.1;
    let number = (first..=last).contains(&number).then_some(number)?;
    // RINEX numbers satellites of SBAS from 100 less (RINEX 4.02, table 2).
    let number = if system == System::Sbas { number - 100 } else { number };
    Some((Sv { system, number: u8::try_from(number).ok()? }, code))
}

const GALILEO: &[(i64, &str)] =
    &[(0, "1C"), (1, "1B"), (3, "5I"), (4, "5Q"), (5, "7I"), (6, "7Q"), (8, "6B"), (9, "6C"), (10, "6A")];
const BEIDOU: &[(i64, &str)] =
    &[(0, "2I"), (1, "2I"), (2, "7I"), (3, "7I"), (4, "6I"), (5, "1P"), (6, "1D"), (7, "5P"), (8, "5D"), (10, "6I")];
const QZSS: &[(i64, &str)] = &[(0, "1C"), (1, "1Z"), (4, "2S"), (5, "2L"), (8, "5I"), (9, "5Q"), (12, "1E")];

/// Sum of a frame's parts, for tests that write frames.
#[cfg(test)]
pub fn frame(class: u8, id: u8, payload: &[u8]) -> Vec<u8> {
    let length = (payload.len() as u16).to_le_bytes();
    let body: Vec<u8> = [class, id, length[0], length[1]].iter().chain(payload).copied().collect();
    let check = crate::frames::fletcher(&body);
    [&[0xb5, 0x62], body.as_slice(), &check].concat()
}

#[cfg(test)]
#[path = "ubx/tests.rs"]
mod tests;
