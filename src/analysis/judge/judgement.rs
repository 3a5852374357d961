//! One figure against one bound: its status, what is left of the limit, and both in words.

use serde::Serialize;
use serde_json::Value;

/// Share of a limit below which what is left of it is marginal.
pub const MARGINAL_SHARE: f64 = 0.1;

/// Bound of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Bound {
    /// The figure must not be larger.
    Max(f64),
    /// The figure must not be smaller.
    Min(f64),
    /// The figure must be this.
    Equals(Value),
}

impl std::fmt::Display for Bound {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Max(limit) => write!(f, "≤ {}", number(*limit)),
            Self::Min(limit) => write!(f, "≥ {}", number(*limit)),
            Self::Equals(value) => write!(f, "= {}", shown(value)),
        }
    }
}

/// Status of a figure against its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Figure within its limit.
    Pass,
    /// Figure within its limit, by less than the marginal share of it.
    Marginal,
    /// Figure beyond its limit, or missing.
    Fail,
}

impl Status {
    /// Status in one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Marginal => "marginal",
            Self::Fail => "FAIL",
        }
    }
}

/// Group of figures, which has one line in a report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// Limits of a user's file.
    #[default]
    Limits,
    /// Satellites found and observed, fixes that are due.
    Availability,
    /// Loops, observables and cycle slips.
    Tracking,
    /// Navigation messages and false acquisitions.
    Messages,
    /// Position and velocity.
    Position,
    /// The receiver's clock.
    Clock,
    /// Sigmas that the receiver states.
    Sigmas,
    /// Protection levels that the receiver states.
    Protection,
    /// Level and spectrum of the samples.
    Samples,
    /// Interference and spoofing.
    Interference,
    /// Attitude by the elements of an array.
    Attitude,
    /// Inertial measurements.
    Inertial,
    /// Completeness and agreement of the tables.
    Tables,
}

impl Group {
    /// Name of the group in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Limits => "limits of the file",
            Self::Availability => "satellites and availability",
            Self::Tracking => "tracking and observables",
            Self::Messages => "acquisition and messages",
            Self::Position => "position and velocity",
            Self::Clock => "clock",
            Self::Sigmas => "stated sigmas",
            Self::Protection => "protection levels",
            Self::Samples => "samples",
            Self::Interference => "interference and spoofing",
            Self::Attitude => "attitude",
            Self::Inertial => "inertial measurements",
            Self::Tables => "consistency of the tables",
        }
    }
}

/// One figure judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Name of the figure in words, or its path in `summary.json` where a user named it so.
    pub figure: String,
    /// Path of the figure in `summary.json`, if it has one.
    pub path: Option<String>,
    /// Null where the run has no such figure.
    pub value: Value,
    /// Unit of the value.
    pub unit: String,
    /// Bound that the value is compared with.
    pub bound: Bound,
    /// Margin to the limit as a share of it, negative beyond it; `None` where the limit is zero or no number.
    pub margin: Option<f64>,
    /// Status of the figure.
    pub status: Status,
    /// Group of figures that it belongs to.
    pub group: Group,
    /// Origin of the limit.
    pub source: String,
    /// Evidence behind the figure: satellites and times, hints.
    pub why: Vec<String>,
    /// Part that is taken out of the measured figure before it is judged; empty where the figure itself is
    /// judged.
    pub without: String,
}

/// Margin, relative to the limit, beyond which a figure of it says nothing.
const FAR: f64 = 10.0;

impl Judgement {
    /// Holds a value against a bound; a value that is missing or not finite fails.
    pub fn new(figure: &str, value: Value, unit: &str, bound: Bound, marginal_share: f64, source: &str) -> Self {
        let measured = value.as_f64().filter(|number| number.is_finite());
        let left = |limit: f64, left: f64| (limit != 0.0).then(|| left / limit.abs());
        let (holds, margin) = match (&bound, measured) {
            (Bound::Max(limit), Some(measured)) => (
                measured <= planted!("analysis.verdict.limit", *limit, 100.0 * limit + 1.0),
                left(*limit, limit - measured),
            ),
            (Bound::Min(limit), Some(measured)) => (measured >= *limit, left(*limit, measured - limit)),
            (Bound::Equals(expected), _) => (same(&value, expected), None),
            (_, None) => (false, None),
        };
        let near = margin.is_some_and(|margin| margin < marginal_share);
        let status = match (holds, near) {
            (false, _) => Status::Fail,
            (true, true) => Status::Marginal,
            (true, false) => Status::Pass,
        };
        let (figure, unit, source) = (figure.to_owned(), unit.to_owned(), source.to_owned());
        let group = Group::default();
        Self {
            figure,
            path: None,
            value,
            unit,
            bound,
            margin,
            status,
            group,
            source,
            why: Vec::new(),
            without: String::new(),
        }
    }

    /// Origin of the limit, and what is taken out of the figure.
    pub fn origin(&self) -> String {
        if self.without.is_empty() { self.source.clone() } else { format!("{}; without {}", self.source, self.without) }
    }

    pub(super) fn at(mut self, path: &str) -> Self {
        self.path = Some(path.to_owned());
        self
    }

    /// The value in words.
    pub fn value_text(&self) -> String {
        shown(&self.value)
    }

    /// Margin to the limit in words, within it or beyond.
    pub fn margin_text(&self) -> String {
        match (self.margin, &self.bound, self.value.as_f64()) {
            _ if self.value.is_null() => "no figure".to_owned(),
            (Some(margin), ..) if margin >= FAR => format!("over {:.0} % left", 100.0 * FAR),
            (Some(margin), ..) if margin >= 0.0 => format!("{:.0} % left", 100.0 * margin),
            (Some(margin), ..) => format!("{:.0} % beyond", -100.0 * margin),
            (None, Bound::Max(limit) | Bound::Min(limit), Some(value)) if value != *limit => {
                format!("{} beyond", number((value - limit).abs()))
            }
            _ => String::new(),
        }
    }
}

/// Equal, numbers as numbers: 1 and 1.0 are the same.
fn same(value: &Value, expected: &Value) -> bool {
    match (value.as_f64(), expected.as_f64()) {
        (Some(value), Some(expected)) => value == expected,
        _ => value == expected,
    }
}

/// A value in words.
pub(crate) fn shown(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Number(one) => one.as_f64().map_or_else(|| one.to_string(), number),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Four significant digits, no trailing zeros.
pub(crate) fn number(value: f64) -> String {
    digits(value, 4)
}

/// Number in words with `digits` significant digits, without trailing zeros.
pub(crate) fn digits(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { value.to_string() };
    }
    let magnitude = libm::floor(libm::log10(value.abs())) as i32;
    if !(-4..=6).contains(&magnitude) {
        return format!("{value:.*e}", (digits - 1).max(0) as usize);
    }
    if value.fract() == 0.0 {
        return format!("{value:.0}");
    }
    let text = format!("{value:.*}", (digits - 1 - magnitude).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(value: impl Into<Value>, bound: Bound) -> (Status, Option<f64>) {
        let row = Judgement::new("x", value.into(), "m", bound, MARGINAL_SHARE, "test");
        (row.status, row.margin)
    }

    #[test]
    fn a_figure_passes_is_marginal_within_a_tenth_of_its_limit_and_fails_beyond() {
        assert_eq!(status(1.0, Bound::Max(2.0)), (Status::Pass, Some(0.5)));
        assert_eq!(status(1.9, Bound::Max(2.0)).0, Status::Marginal);
        assert_eq!(status(2.0, Bound::Max(2.0)), (Status::Marginal, Some(0.0)));
        assert_eq!(status(3.0, Bound::Max(2.0)), (Status::Fail, Some(-0.5)));
        assert_eq!(status(12, Bound::Min(8.0)), (Status::Pass, Some(0.5)));
        assert_eq!(status(8.5, Bound::Min(8.0)).0, Status::Marginal);
        assert_eq!(status(7, Bound::Min(8.0)).0, Status::Fail);
        assert_eq!(status(-3.0, Bound::Max(-2.0)), (Status::Pass, Some(0.5)));
    }

    #[test]
    fn a_count_that_must_be_zero_passes_or_fails_and_a_missing_figure_fails() {
        assert_eq!(status(0, Bound::Max(0.0)), (Status::Pass, None));
        assert_eq!(status(1, Bound::Max(0.0)), (Status::Fail, None));
        assert_eq!(status(Value::Null, Bound::Max(5.0)).0, Status::Fail);
        assert_eq!(status(f64::NAN, Bound::Min(0.0)).0, Status::Fail);
        assert_eq!(status("balanced", Bound::Equals("balanced".into())).0, Status::Pass);
        assert_eq!(status(1, Bound::Equals(1.0.into())).0, Status::Pass);
        let missing = Judgement::new("x", Value::Null, "m", Bound::Max(1.0), 0.1, "test");
        assert_eq!(missing.margin_text(), "no figure");
    }

    #[test]
    fn a_margin_of_many_limits_is_not_written_as_a_figure() {
        let text = |value: f64| Judgement::new("x", value.into(), "s", Bound::Min(2.0), 0.1, "test").margin_text();
        assert_eq!(
            [1.0, 2.5, 21.9, 22.0, 2e4].map(text),
            ["50 % beyond", "25 % left", "995 % left", "over 1000 % left", "over 1000 % left"]
        );
    }

    #[test]
    fn numbers_have_four_digits() {
        let texts = [0.0, 15.0, 2.259_712, 0.083_333_3, 40.0, 1.2e-9, 26.1, 123_456.7].map(number);
        assert_eq!(texts, ["0", "15", "2.26", "0.08333", "40", "1.200e-9", "26.1", "123457"]);
    }
}
