//! SBF, the Septentrio Binary Format.
//!
//! Source: mosaic-X5 reference guide 4.14, 4.1 and 4.2. MeasEpoch (block 4027, revisions 0 and 1, with the
//! sub-blocks of further signals) becomes observations, PVTGeodetic (4007) and PVTCartesian (4006) become
//! positions, ReceiverTime (5914) is a table; further blocks are counted by name or number. Times are weeks
//! and milliseconds by the receiver's clock; a fix's clock bias is taken off. Limits: what MeasExtra adds to
//! observations is not read. No recording of a receiver was at hand: the witness is another program's
//! reading of blocks that tests write.

mod layouts;
mod measured;

use crate::content::Content;
use crate::observed::{Calendar, Event, Fix, Locks, Solution};
use crate::table::{Table, little_endian};
use gnss::earth::Geodetic;
use gnss::time::Epoch;
use layouts::{LAYOUTS, NAMES};
use nalgebra::Vector3;

/// Messages that the judge needs.
pub const NEEDED: &str = "MeasEpoch for observations, or PVTGeodetic or PVTCartesian for positions";
/// Number of MeasEpoch.
const MEAS_EPOCH: u16 = 4027;
/// Floating-point numbers that say that there is none (4.1.5).
const NONE_BELOW: f64 = -1e10;

/// Reads a block.
pub fn read(block: &[u8], calendar: &mut Calendar, locks: &mut Locks) -> Content {
    let number = block.get(4..6).map_or(0, little_endian) as u16 & 0x1fff;
    let body = block.get(8..).unwrap_or_default();
    if number == MEAS_EPOCH {
        let found = measured::read(body);
        let table = found.as_ref().map(|(table, _)| table.clone());
        let event = found.and_then(|(table, values)| {
            let label = label(&table)?;
            calendar.learn(label);
            let mut epoch = crate::observed::ObservedEpoch { label, values };
            // Lock times are whole seconds.
            locks.mark(&mut epoch, true);
            Some(Event::Observations(epoch))
        });
        return Content { name: "MeasEpoch".to_owned(), is_known: true, table, event };
    }
    let Some(layout) = LAYOUTS.iter().find(|layout| layout.key.1 == number) else {
        let mut words = NAMES.split_whitespace();
        let known = words.find(|word| *word == number.to_string()).and_then(|_| words.next());
        return Content { name: known.map_or_else(|| format!("SBF-{number}"), str::to_owned), ..Content::default() };
    };
    let table = layout.read(body);
    let event = table.as_ref().filter(|table| table.name != "ReceiverTime").map(fix);
    if let Some(Event::Fix(fix)) = &event {
        calendar.learn(fix.label);
    }
    Content { name: layout.name.to_owned(), is_known: true, table, event }
}

/// Time of a block by the receiver's clock.
fn label(table: &Table) -> Option<Epoch> {
    let tow_ms = table.integer(0, "TOW").filter(|tow_ms| *tow_ms != 0xffff_ffff)?;
    let week = table.integer(0, "WNc").filter(|week| *week != 0xffff)?;
    Some(Epoch::from_week(u32::try_from(week).ok()?, 1e-3 * tow_ms as f64))
}

fn fix(table: &Table) -> Event {
    let number = |name: &str| table.number(0, name).filter(|value| value.is_finite() && *value > NONE_BELOW);
    let three = |names: [&str; 3]| Some([number(names[0])?, number(names[1])?, number(names[2])?]);
    let kind = table.integer(0, "Type").unwrap_or(0);
    if table.integer(0, "Error") != Some(0) || kind == 0 {
        return Event::NoFix;
    }
    let geodetic = three(["Latitude", "Longitude", "Height"])
        .map(|[latitude_rad, longitude_rad, height_m]| Geodetic { latitude_rad, longitude_rad, height_m }.to_ecef());
    let Some(position_m) = geodetic.or_else(|| three(["X", "Y", "Z"]).map(Vector3::from)) else { return Event::NoFix };
    let Some(label) = label(table) else { return Event::Undated };
    let along = |fixed: [f64; 3]| {
        let enu = Geodetic::from_ecef(&position_m).ecef_to_enu() * Vector3::from(fixed);
        [enu.x, enu.y, enu.z]
    };
    // Accuracies are twice the root mean square (4.2.9), none of 65535.
    let sigma = |name: &str| table.number(0, name).filter(|metres| *metres < 655.35).map(|metres| 0.5 * metres);
    Event::Fix(Fix {
        label: label.plus_s(-1e-3 * number("RxClkBias").unwrap_or(0.0)),
        position_m,
        velocity_enu_mps: three(["Ve", "Vn", "Vu"]).or_else(|| three(["Vx", "Vy", "Vz"]).map(along)),
        solution: match kind {
            2 | 6 => Solution::Differential,
            4 | 7 => Solution::FixedCarrier,
            5 | 8 | 10 => Solution::FloatCarrier,
            _ => Solution::Single,
        },
        satellites: table.integer(0, "NrSV").filter(|count| *count < 255).map_or(0, |count| count as u32),
        horizontal_sigma_m: sigma("HAccuracy"),
        vertical_sigma_m: sigma("VAccuracy"),
        speed_sigma_mps: None,
        time_sigma_s: None,
    })
}

#[cfg(test)]
#[path = "sbf/tests.rs"]
mod tests;
