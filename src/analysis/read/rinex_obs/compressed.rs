//! Records of Hatanaka's scheme, versions 1.0 (RINEX 2) and 3.0 (RINEX 3), made plain again.
//!
//! Source: Hatanaka 2008, "A compression format and tools for GNSS observation data", Bulletin of the GSI
//! 55. An epoch line and a satellite's indicators are written as what differs from the line before, in which
//! `&` is a blank; a value is written as a difference of up to the fifth order of thousandths, `m&value`
//! beginning again. Differences are undone by the kernels of the `rinex` crate.

use std::collections::BTreeMap;

use rinex::hatanaka::{NumDiff, TextDiff};

use gnss::satellite::Sv;

/// Highest order of a difference.
const ORDERS: usize = 5;
/// Digits of a value, its sign and point among them.
const DIGITS: usize = 14;

/// State from which later lines are differences.
pub(super) struct Restorer {
    /// The first character of an epoch line: as it is plain, and where it begins again.
    first: [char; 2],
    epoch: Option<TextDiff>,
    indicators: BTreeMap<Sv, TextDiff>,
    values: BTreeMap<(Sv, usize), NumDiff<ORDERS>>,
}

impl Restorer {
    pub fn new(is_second: bool) -> Self {
        let first = if is_second { [' ', '&'] } else { ['>', '>'] };
        Self { first, epoch: None, indicators: BTreeMap::new(), values: BTreeMap::new() }
    }

    /// An epoch line, with all satellites behind it.
    pub fn epoch(&mut self, line: &str) -> Result<String, String> {
        let [plain, anew] = self.first;
        let rest = line.get(1..).unwrap_or("");
        if line.starts_with(anew) {
            self.epoch = Some(TextDiff::new(rest));
            return Ok(format!("{plain}{rest}"));
        }
        let Some(before) = self.epoch.as_mut().filter(|_| line.starts_with(' ')) else {
            let shown: String = line.chars().take(40).collect();
            return Err(format!("'{shown}': expected an epoch line, which begins with '{anew}' or continues one"));
        };
        Ok(format!("{plain}{}", before.decompress(rest)))
    }

    /// Forgets the satellites that an epoch does not have: they begin again when they come back.
    pub fn keep(&mut self, satellites: &[Sv]) {
        self.indicators.retain(|sv, _| satellites.contains(sv));
        self.values.retain(|(sv, _), _| satellites.contains(sv));
    }

    /// A satellite's values and indicators, in columns of 16.
    pub fn satellite(&mut self, sv: Sv, count: usize, line: &str) -> Result<String, String> {
        let mut fields = line.splitn(count + 1, ' ');
        let mut found = Vec::with_capacity(count);
        for index in 0..count {
            let value = self.value((sv, index), fields.next().unwrap_or(""));
            found.push(value.map_err(|what| format!("satellite {sv}, value {}: {what}", index + 1))?);
        }
        let before = self.indicators.entry(sv).or_default();
        let indicators = before.decompress(fields.next().unwrap_or("").trim_end());
        let mut text = String::new();
        for (index, value) in found.iter().enumerate() {
            let own = indicators.get(2 * index..(2 * index + 2).min(indicators.len())).unwrap_or("");
            match value {
                Some(value) => text += &format!("{value:>DIGITS$}{own:2}"),
                None => text += &format!("{:width$}", "", width = DIGITS + 2),
            }
        }
        Ok(text)
    }

    /// A value in words; none where it is missing, which ends its differences.
    fn value(&mut self, key: (Sv, usize), field: &str) -> Result<Option<String>, String> {
        if field.is_empty() {
            self.values.remove(&key);
            return Ok(None);
        }
        let (order, digits) = field.split_once('&').map_or((None, field), |(order, digits)| (Some(order), digits));
        let number = digits.parse::<i64>().map_err(|_| format!("'{field}': expected a whole number"))?;
        let thousandths = match (order, self.values.get_mut(&key)) {
            (Some(order), _) => {
                let level = order.parse::<usize>().ok().filter(|level| *level <= ORDERS);
                let level = level.ok_or_else(|| format!("order '{order}': expected 0 to {ORDERS}"))?;
                self.values.insert(key, NumDiff::new(number, level));
                number
            }
            (None, Some(before)) => before.decompress(number).map_err(|error| format!("'{field}': {error}"))?,
            (None, None) => return Err(format!("'{field}': expected m&value, since no value comes before")),
        };
        let (sign, size) = (if thousandths < 0 { "-" } else { "" }, thousandths.unsigned_abs());
        let text = format!("{sign}{}.{:03}", size / 1000, size % 1000);
        if text.len() > DIGITS {
            return Err(format!("{text} has {} characters: expected at most {DIGITS}", text.len()));
        }
        Ok(Some(text))
    }
}
