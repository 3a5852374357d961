//! Group delays in the records of the messages that came after LNAV and D1, of which nothing else is read.
//!
//! Source: RINEX 4.02, sections 5.4.2 (CNAV), 5.4.3 (CNAV-2) and 5.4.8 to 5.4.10 (B-CNAV1 to 3), for the
//! lines; IS-GPS-705J, 20.3.3.3.1.1, IS-GPS-800J, 3.5.3.9.1, and BDS-SIS-ICD-B1C 1.0, 7.6, for their sum.
//! Delays are named by the code of RINEX to which they belong, T_GD of GPS by that of P(Y) on L1.

use super::{Form, Line};
use crate::broadcast::GPS_CLOCK_CODE;
use crate::satellite::{Sv, System};
use crate::time::{BDT, Epoch};

/// The delays in one record.
pub(in crate::rinex) struct Delays {
    pub sv: Sv,
    /// Reference time of the record's clock.
    pub toc: Epoch,
    /// RINEX code, delay in seconds, and true if the message is that of the signal itself.
    pub all: Vec<(&'static str, f64, bool)>,
}

/// Positions of the delays in a record, by lines and fields that count from 0.
pub(super) struct Layout {
    lines: usize,
    /// The delay from which corrections are taken, where there is one for all.
    common: Option<Place>,
    /// Code, position, position of another delay that is added to it, and whether the message is the signal's
    /// own.
    delays: &'static [(&'static str, Place, Option<Place>, bool)],
}

type Place = (usize, usize);

static CNAV: Layout = Layout {
    lines: 9,
    common: Some((6, 2)),
    delays: &[("2L", (7, 1), None, true), ("5I", (7, 2), None, true), ("5Q", (7, 3), None, true)],
};
static CNAV2: Layout = Layout {
    lines: 10,
    common: Some((6, 2)),
    delays: &[
        ("2L", (7, 1), None, false),
        ("5I", (7, 2), None, false),
        ("5Q", (7, 3), None, false),
        ("1S", (8, 0), None, true),
        ("1L", (8, 1), None, true),
    ],
};
static B_CNAV1: Layout = Layout {
    lines: 10,
    common: None,
    delays: &[("1P", (7, 2), None, true), ("1D", (7, 2), Some((7, 0)), true), ("5P", (7, 3), None, false)],
};
static B_CNAV2: Layout = Layout {
    lines: 10,
    common: None,
    delays: &[("1P", (7, 2), None, false), ("5P", (7, 3), None, true), ("5D", (7, 3), Some((7, 1)), true)],
};
static B_CNAV3: Layout = Layout { lines: 9, common: None, delays: &[("7D", (7, 3), None, true)] };

impl Layout {
    /// The lines of a record after its heading. A line of four blank fields is one of them: predicted
    /// accuracies that a converter does not know. Blank lines of a whole record are not.
    pub(super) fn lines_of<'a, 't>(&self, lines: &'a [Line<'t>], whole: &'a [Line<'t>]) -> &'a [Line<'t>] {
        match whole.get(1..).and_then(|whole| whole.split_at_checked(self.lines)) {
            Some((own, rest)) if lines.len() < self.lines && rest.iter().all(|(_, line)| line.trim().is_empty()) => own,
            _ => lines,
        }
    }
}

/// The layout of a system's message, if it is one of these.
pub(super) fn layout(letter: char, message: &str) -> Option<&'static Layout> {
    match (letter, message) {
        ('G' | 'J', "CNAV") => Some(&CNAV),
        ('G' | 'J', "CNV2") => Some(&CNAV2),
        ('C', "CNV1") => Some(&B_CNAV1),
        ('C', "CNV2") => Some(&B_CNAV2),
        ('C', "CNV3") => Some(&B_CNAV3),
        _ => None,
    }
}

/// The largest delay that a field carries: thirteen bits with a step of 2⁻³⁵ s, twelve with 2⁻³⁴ s; and what
/// GPS sends for a delay that is not available, to the digits of a record.
const LARGEST_S: f64 = 1.192_093e-7;
const NOT_AVAILABLE_S: f64 = -1.192_092e-7;

impl Form {
    /// The delays of a record; a blank field, or one that states so, is not available.
    pub(super) fn delays(&self, record: &[Line<'_>], layout: &Layout) -> Result<Delays, String> {
        let (first, title) = record.first().copied().unwrap_or_default();
        let label: String = title.chars().take(23).collect();
        let refuse = |what: String| Err(format!("line {first} ({}): {what}", label.trim_end()));
        if record.len() != layout.lines {
            return refuse(format!("a record of {} lines: expected {}", record.len(), layout.lines));
        }
        let rows = self.lines(record)?;
        let (sv, toc) = self.head((first, title))?;
        let of = |(row, field): Place| -> Result<Option<f64>, String> {
            let value = rows.get(row).and_then(|row| row.get(field)).copied().flatten();
            match value {
                Some(delay_s) if delay_s.abs() > LARGEST_S => {
                    let what = format!("group delay = {delay_s:e}: expected {:e} to {LARGEST_S:e}", -LARGEST_S);
                    Err(format!("line {} ({}): {what}", first + row, label.trim_end()))
                }
                value => Ok(value.filter(|delay_s| *delay_s > NOT_AVAILABLE_S)),
            }
        };
        let common_s = layout.common.map(of).transpose()?.flatten();
        let mut all: Vec<(&'static str, f64, bool)> = Vec::new();
        if layout.common.is_some() {
            // All delays are differences from this one.
            let Some(common_s) = common_s else { return Ok(Delays { sv, toc, all }) };
            all.push((GPS_CLOCK_CODE, common_s, true));
        }
        for &(code, place, more, is_own) in layout.delays {
            let more_s = match more {
                Some(place) => of(place)?,
                None => Some(0.0),
            };
            if let (Some(own_s), Some(more_s)) = (of(place)?, more_s) {
                let delay_s = common_s.map_or(own_s + more_s, |common_s| common_s - own_s);
                all.push((code, delay_s, is_own));
            }
        }
        let toc = if sv.system == System::BeiDou { BDT.instant(toc) } else { toc };
        Ok(Delays { sv, toc, all })
    }
}
