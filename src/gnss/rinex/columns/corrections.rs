//! Lines and records about the ionosphere and about one time against another.

use std::collections::BTreeMap;

use super::numbers::{fields, number_of, numbers};
use super::{FIELD, Form, GALILEO, GALILEO_OLD, Group, HEADER_FIELD, Line, Polynomial, UTC};
use crate::bdgim::Bdgim;
use crate::klobuchar::Klobuchar;
use crate::satellite::System;

impl Form {
    /// Klobuchar's coefficients in a record of version 4.
    pub(super) fn ionosphere(&self, group: &[Line<'_>], satellite: &str) -> Result<Group, String> {
        let (first, title) = group.first().copied().unwrap_or_default();
        let refuse = |line: usize, what: String| Err(format!("line {line} ({}): {what}", title.trim_end()));
        let [_, one, two, three] = group else {
            return refuse(first, format!("a record of {} lines: expected 4", group.len()));
        };
        let mut coefficients = Vec::with_capacity(8);
        // The field after the last coefficient is the region, and may be blank.
        for (&(number, line), start, count) in
            [(one, self.margin() + FIELD, 3), (two, self.margin(), 4), (three, self.margin(), 2)]
        {
            if self.cut == Some(number) && !line.trim_end().len().saturating_sub(start).is_multiple_of(FIELD) {
                return refuse(number, "the file ends within a number".to_owned());
            }
            match fields(line, start, FIELD, count) {
                Ok(found) => coefficients.extend(found),
                Err(reason) => return refuse(number, reason),
            }
        }
        let Some(epoch) = self.epoch(one.1.get(self.margin()..self.margin() + FIELD).unwrap_or("")) else {
            return refuse(one.0, "column 5: expected an epoch".to_owned());
        };
        let coefficients: Option<Vec<f64>> = coefficients.into_iter().take(8).collect();
        match coefficients.as_deref() {
            Some(&[a0, a1, a2, a3, b0, b1, b2, b3]) => {
                let found = Klobuchar { alpha: [a0, a1, a2, a3], beta: [b0, b1, b2, b3] };
                let system = match satellite.get(..1) {
                    Some("I") => System::Navic,
                    Some("C") => System::BeiDou,
                    _ => System::Gps,
                };
                Ok(Group::Ionosphere(system, format!("{epoch} {satellite}"), found))
            }
            _ => refuse(one.0, "expected eight coefficients".to_owned()),
        }
    }

    /// BDGIM's coefficients in a record of version 4; where all are zero the record states nothing.
    pub(super) fn bdgim(&self, group: &[Line<'_>], satellite: &str) -> Result<Group, String> {
        let (first, title) = group.first().copied().unwrap_or_default();
        let refuse = |line: usize, what: String| Err(format!("line {line} ({}): {what}", title.trim_end()));
        let [_, one, two, three] = group else {
            return refuse(first, format!("a record of {} lines: expected 4", group.len()));
        };
        let margin = self.margin();
        let mut alpha_tecu = Vec::with_capacity(9);
        for (&(number, line), start, count) in [(one, margin + FIELD, 3), (two, margin, 4), (three, margin, 2)] {
            if self.cut == Some(number) && !line.trim_end().len().saturating_sub(start).is_multiple_of(FIELD) {
                return refuse(number, "the file ends within a number".to_owned());
            }
            match fields(line, start, FIELD, count) {
                Ok(found) => alpha_tecu.extend(found),
                Err(reason) => return refuse(number, reason),
            }
        }
        let Some(epoch) = self.epoch(one.1.get(margin..margin + FIELD).unwrap_or("")) else {
            return refuse(one.0, "column 5: expected an epoch".to_owned());
        };
        let alpha_tecu: Option<Vec<f64>> = alpha_tecu.into_iter().collect();
        let Some(alpha_tecu) = alpha_tecu.and_then(|all| <[f64; 9]>::try_from(all).ok()) else {
            return refuse(one.0, "expected nine coefficients".to_owned());
        };
        if let Err(reason) = possible(&alpha_tecu) {
            return refuse(one.0, reason);
        }
        let given = Bdgim::given(alpha_tecu);
        Ok(given.map_or(Group::Other, |found| Group::Bdgim(format!("{epoch} {satellite}"), found)))
    }

    /// Galileo's effective ionisation in a record of version 4; the flags after it are not read.
    pub(super) fn ionisation(&self, group: &[Line<'_>], satellite: &str) -> Result<Group, String> {
        let (first, title) = group.first().copied().unwrap_or_default();
        let refuse = |line: usize, what: String| Err(format!("line {line} ({}): {what}", title.trim_end()));
        let Some(&(number, line)) = group.get(1).filter(|_| group.len() == 3) else {
            return refuse(first, format!("a record of {} lines: expected 3", group.len()));
        };
        let Some(epoch) = self.epoch(line.get(self.margin()..self.margin() + FIELD).unwrap_or("")) else {
            return refuse(number, "column 5: expected an epoch".to_owned());
        };
        match fields(line, self.margin() + FIELD, FIELD, 3) {
            Ok(found) => match found.as_slice() {
                &[Some(a0), Some(a1), Some(a2)] => Ok(Group::Ionisation(format!("{epoch} {satellite}"), [a0, a1, a2])),
                _ => refuse(number, "expected three coefficients".to_owned()),
            },
            Err(reason) => refuse(number, reason),
        }
    }

    /// GPS time against another in a record of version 4: UTC and Galileo's are wanted.
    pub(super) fn system_time(&self, group: &[Line<'_>], satellite: &str) -> Result<Group, String> {
        let (first, title) = group.first().copied().unwrap_or_default();
        let refuse = |line: usize, what: String| Err(format!("line {line} ({}): {what}", title.trim_end()));
        let [_, when, what] = group else {
            return refuse(first, format!("a record of {} lines: expected 3", group.len()));
        };
        let margin = self.margin();
        let rest = when.1.get(margin + FIELD..).unwrap_or("");
        let kind = rest.split_ascii_whitespace().next().unwrap_or("");
        if ![UTC, GALILEO, GALILEO_OLD].contains(&kind) {
            return Ok(Group::Other);
        }
        if self.cut == Some(what.0) && !what.1.trim_end().len().saturating_sub(margin).is_multiple_of(FIELD) {
            return refuse(what.0, "the file ends within a number".to_owned());
        }
        let Some(epoch) = self.epoch(when.1.get(margin..margin + FIELD).unwrap_or("")) else {
            return refuse(when.0, "column 5: expected an epoch".to_owned());
        };
        // Time of transmission, then the polynomial's coefficients; a quadratic one is CNAV's.
        match fields(what.1, margin, FIELD, 4) {
            Ok(found) => match found.as_slice() {
                &[_, Some(a0_s), Some(a1_sps), _] => {
                    let found = Polynomial { a0_s, a1_sps, tow_s: epoch.tow_s(), week: epoch.week() };
                    let age = format!("{epoch} {satellite}");
                    Ok(if kind == UTC { Group::Utc(age, found) } else { Group::Galileo(age, found) })
                }
                _ => refuse(what.0, "expected two coefficients".to_owned()),
            },
            Err(reason) => refuse(what.0, reason),
        }
    }
}

/// Checks that BDGIM coefficients are in the range of the messages' fields, the fifth below zero and the
/// first above (BDS-SIS-ICD-B1C 1.0, 7.8).
fn possible(alpha_tecu: &[f64]) -> Result<(), String> {
    match alpha_tecu.iter().find(|alpha| !(-31.875..=127.875).contains(*alpha)) {
        Some(alpha) => Err(format!("coefficient of BDGIM {alpha} TECU: expected -31.875 to 127.875")),
        None => Ok(()),
    }
}

/// BDGIM's coefficients in lines BDS1, BDS2 and BDS3 of a header, three in each, by their mark of time.
#[derive(Default)]
pub(super) struct Thirds(BTreeMap<String, [Option<[f64; 3]>; 3]>);

impl Thirds {
    /// Index of the line among the three, if it is one of them.
    fn place(line: &str) -> Option<usize> {
        ["BDS1", "BDS2", "BDS3"].iter().position(|name| line.starts_with(name))
    }

    /// True if the line is one of the three.
    pub(super) fn has(line: &str) -> bool {
        Self::place(line).is_some()
    }

    /// Takes a line: `A4, 1X, 3D12.4`, and a mark of time behind the fourth field.
    pub(super) fn take(&mut self, line: &str) -> Result<(), String> {
        let found = numbers::<3>(line, 5, HEADER_FIELD)?;
        possible(&found)?;
        let mark = line.get(5 + 4 * HEADER_FIELD..5 + 4 * HEADER_FIELD + 2).unwrap_or("").trim().to_owned();
        let own = self.0.entry(mark).or_default();
        if let Some(third) = Self::place(line).and_then(|place| own.get_mut(place)) {
            *third = Some(found);
        }
        Ok(())
    }

    /// The coefficients of the first time of which all three lines are there and not all numbers are zero.
    pub(super) fn first(&self) -> Option<Bdgim> {
        self.0.values().find_map(|own| {
            let [one, two, three] = *own;
            Bdgim::given([one?, two?, three?].concat().try_into().ok()?)
        })
    }
}

/// `3X, 2D19.12, 2I9` of version 2.
pub(super) fn delta_utc(line: &str) -> Result<Polynomial, String> {
    let [a0_s, a1_sps] = numbers::<2>(line, 3, FIELD)?;
    let whole = |from: usize| line.get(from..from + 9).unwrap_or("").trim().parse::<i64>();
    match (whole(41), whole(50)) {
        (Ok(tow_s), Ok(week)) => Ok(Polynomial { a0_s, a1_sps, tow_s: tow_s as f64, week }),
        _ => Err("expected two whole numbers from column 42 on".to_owned()),
    }
}

/// `A4, 1X, D17.10, D16.9, 1X, I6, 1X, I4` of version 3.
pub(super) fn system_time(line: &str) -> Result<Polynomial, String> {
    let number = |from: usize, to: usize| number_of(line.get(from..to).unwrap_or("").trim());
    match (number(5, 22), number(22, 38), number(38, 45), number(45, 50)) {
        (Some(a0_s), Some(a1_sps), Some(tow_s), Some(week)) => {
            Ok(Polynomial { a0_s, a1_sps, tow_s, week: week as i64 })
        }
        _ => Err("expected two coefficients, a time of week and a week from column 6 on".to_owned()),
    }
}

/// Leap-second event from the header line of versions 3 and 4, after the present leap seconds. It has the
/// leap seconds after the change, its week and its day.
pub(super) fn leap_event(line: &str) -> Option<(i64, i64, u8)> {
    let whole = |from: usize| line.get(from..from + 6).and_then(|text| text.trim().parse::<i64>().ok());
    let (after_s, week, day) = (whole(6)?, whole(12)?, whole(18)?);
    (week > 0 && (1..=7).contains(&day)).then_some((after_s, week, day as u8))
}
