//! RTCM 3, the protocol of reference stations and of many receivers.
//!
//! Source: RTCM 10403.3, 3.5. Multiple Signal Messages (MSM) 4 to 7 of all systems become observations;
//! 1005, 1006, 1033, 1230 and ephemerides become tables; further messages are counted by their numbers.
//! Columns are the standard's numbers of data fields, such as `DF406`, values in their units, scales
//! applied. Times are those of the day or of the week: the week is the one nearest to a time that is known,
//! which ephemerides of Galileo, BeiDou and GLONASS state. [`station`] writes what is read here, by the same
//! lists of fields. Limits: messages 1001 to 1012 and MSM 1 to 3, which hold no whole range, are not
//! decoded.

pub mod ephemeris;
pub mod field;
pub mod msm;
pub mod signals;
pub mod station;

use crate::bits::Bits;
use crate::content::Content;
use crate::observed::{Calendar, Event, Locks};
use gnss::crc::crc24q;

/// Messages that the judge needs.
pub const NEEDED: &str = "MSM4 to MSM7 (1074 to 1137) for observations";

/// Reads a frame.
pub fn read(frame: &[u8], calendar: &mut Calendar, locks: &mut Locks) -> Content {
    let body = frame.get(3..frame.len().saturating_sub(3)).unwrap_or_default();
    let Some(number) = Bits::new(body).unsigned(12) else { return Content::default() };
    let name = name(number);
    let table = match number {
        1005 => field::read("1005", station::place(false), body),
        1006 => field::read("1006", station::place(true), body),
        1033 => field::read("1033", station::EQUIPMENT.iter(), body),
        1230 => field::read("1230", station::BIASES.iter(), body),
        _ if ephemeris::numbers().any(|known| known == number) => {
            let table = ephemeris::read(number, body);
            let set = table.as_ref().and_then(|table| ephemeris::ephemeris(table, calendar.near()));
            if let Some(set) = set.as_ref().filter(|_| calendar.near().is_none()) {
                calendar.learn(set.toe);
            }
            return Content { name, is_known: true, table, event: set.map(|set| Event::Ephemeris(Box::new(set))) };
        }
        _ => {
            let Some(kind) = msm::Kind::of(number) else { return Content { name, ..Content::default() } };
            let read = kind.read(body);
            let event = read.as_ref().map(|message| message.event(calendar, locks));
            return Content { name, is_known: true, table: read.map(|message| message.table), event };
        }
    };
    Content { name, is_known: true, table, event: None }
}

/// Number of a message with the name of what the judge or a user may look for.
fn name(number: u64) -> String {
    let word = match number {
        1019 => " (GPS ephemeris)",
        1020 => " (GLONASS ephemeris)",
        1041 => " (NavIC ephemeris)",
        1042 => " (BeiDou ephemeris)",
        1044 => " (QZSS ephemeris)",
        1045 => " (Galileo F/NAV ephemeris)",
        1046 => " (Galileo I/NAV ephemeris)",
        4072 => " (u-blox)",
        _ => "",
    };
    format!("{number}{word}")
}

/// Frame of a message's bytes, 1023 at most: preamble, length and check (RTCM 10403.3, 4.1).
pub fn framed(body: &[u8]) -> Vec<u8> {
    let length = body.len().min(1023);
    let mut frame = vec![0xd3, (length >> 8) as u8, length as u8];
    frame.extend(body.iter().take(length));
    let checked = planted!("logs.rtcm.check", &frame[..], &frame[3..]);
    let bits = checked.iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1 == 1));
    let check = crc24q(bits);
    frame.extend([(check >> 16) as u8, (check >> 8) as u8, check as u8]);
    frame
}

#[cfg(test)]
#[path = "rtcm/tests.rs"]
mod tests;
