//! Axes as written, and the grid of cases that they span.
//!
//! Zipped axes step together and count as one. Case i is mixed radix, slowest first: axes that change the
//! signal in the order written, then repetitions, then axes that only change the receiver; so cases that
//! share a signal are neighbours. Limits: ten million cases, a hundred thousand values an axis.

use std::path::Path;

use toml::Value;

use super::spec::SCENARIO_KEY;
use super::words;
use generator::scenario::read::Table;
use generator::scenario::{Place, ScenarioError};

/// Most cases of a study.
pub const MOST_CASES: u64 = 10_000_000;
/// Most values of an axis.
const MOST_VALUES: usize = 100_000;

/// One axis: a key of the base and the values that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Key of the scene, the settings or the channel that it sets.
    pub key: String,
    /// Values of the axis in order.
    pub values: Vec<Value>,
    /// Axes with the same word step together.
    pub zip: Option<String>,
    /// Label in plots in place of the key.
    pub label: Option<String>,
    /// Position in the file at which the axis is named.
    pub place: Place,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Spacing {
    Linear,
    Log,
}

impl Axis {
    pub(super) fn read(table: &Table<'_>) -> Result<Self, ScenarioError> {
        table.allow_own()?;
        let key = table.need_text("key")?.to_owned();
        let values = match table.values("values")? {
            Some(values) => {
                for other in ["from", "to", "step", "count", "spacing"] {
                    if table.has(other) {
                        return Err(table.bad(other, "nothing beside values"));
                    }
                }
                values
            }
            None => range(table)?,
        };
        let texts: std::collections::BTreeSet<String> = values.iter().map(text_of).collect();
        // Axes that step together may repeat a value where another one changes: the grid checks them as one.
        let zip = table.text("zip")?.map(str::to_owned);
        if (texts.len() < values.len() && zip.is_none()) || values.len() > MOST_VALUES {
            let name = if table.has("values") { "values" } else { "from" };
            return Err(table.bad(name, format!("1 to {MOST_VALUES} values, each but once")));
        }
        Ok(Self { key, values, zip, label: table.text("label")?.map(str::to_owned), place: table.place("key") })
    }

    /// Label in plots and tables.
    pub fn label(&self) -> &str {
        self.label.as_deref().unwrap_or(&self.key)
    }

    /// Text beside the axis of a plot: the words of the study, or the key in words with its unit.
    pub fn words(&self) -> String {
        self.label.clone().unwrap_or_else(|| words::of_key(&self.key))
    }

    /// True if every value is a number.
    pub fn is_of_numbers(&self) -> bool {
        self.values.iter().all(|value| number_of(value).is_some())
    }

    /// Words for the value of this rank in plots. A scene goes by its file's name alone where no other has
    /// the same.
    pub fn words_of(&self, rank: usize) -> String {
        let text = self.values.get(rank).map_or_else(String::new, text_of);
        let stem = |text: &str| Path::new(text).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let mine = stem(&text).filter(|_| self.key == SCENARIO_KEY);
        let namesakes = self.values.iter().filter(|other| stem(&text_of(other)) == mine).count();
        mine.filter(|_| namesakes == 1).unwrap_or(text)
    }
}

/// `from`, `to` and either `step` or `count`; both ends belong to it.
fn range(table: &Table<'_>) -> Result<Vec<Value>, ScenarioError> {
    let (from, to) = (table.need("from")?, table.need("to")?);
    let spacing = table.choice("spacing", &[("linear", Spacing::Linear), ("log", Spacing::Log)])?;
    let step = table.number("step")?;
    let count = table.integer("count")?;
    let numbers: Vec<f64> = match (step, count) {
        (Some(step), None) if spacing != Some(Spacing::Log) => {
            let steps = (to - from) / step;
            if !(0.0..MOST_VALUES as f64).contains(&steps) {
                return Err(table.bad("step", format!("a step from {from} to {to} in at most {MOST_VALUES} values")));
            }
            // What rounding leaves of the last step still belongs to the range.
            (0..=(steps + 1e-9).floor() as u64).map(|k| from + k as f64 * step).collect()
        }
        (None, Some(count)) if (2..=MOST_VALUES as u64).contains(&count) => {
            let part = |k: u64| k as f64 / (count - 1) as f64;
            match spacing.unwrap_or(Spacing::Linear) {
                Spacing::Linear => (0..count).map(|k| from + (to - from) * part(k)).collect(),
                Spacing::Log if from > 0.0 && to > 0.0 => {
                    let (low, high) = (libm::log(from), libm::log(to));
                    (0..count).map(|k| libm::exp(low + (high - low) * part(k))).collect()
                }
                Spacing::Log => return Err(table.bad("from", "positive ends for spacing = \"log\"")),
            }
        }
        (None, None) => return Err(table.bad("values", "values = [...], or from and to with step or count")),
        (Some(_), _) => return Err(table.bad("step", "either step (linear) or count")),
        (None, Some(_)) => return Err(table.bad("count", format!("2 to {MOST_VALUES}"))),
    };
    let whole = numbers.iter().all(|x| x.fract() == 0.0 && x.abs() < 9e15);
    let value = |x: f64| if whole { Value::Integer(x as i64) } else { Value::Float(rounded(x)) };
    Ok(numbers.into_iter().map(value).collect())
}

/// Number rounded to 12 digits, so that 0.1 + 2 × 0.1 is 0.3.
fn rounded(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

/// A value in one way of writing, whatever its type in TOML: 45 and 45.0 are the same.
pub fn text_of(value: &Value) -> String {
    match value {
        Value::Integer(x) => x.to_string(),
        Value::Float(x) => x.to_string(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A value as a number, if it is one.
pub fn number_of(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(x) => Some(*x as f64),
        Value::Float(x) => Some(*x),
        _ => None,
    }
}

/// Axes that step together.
#[derive(Clone, Debug, PartialEq)]
pub struct Digit {
    /// Numbers of the axes in the study's list.
    pub axes: Vec<usize>,
    /// Number of values.
    pub length: usize,
}

/// All cases of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Slowest first.
    pub signal: Vec<Digit>,
    /// Cases with equal values and seeds of their own.
    pub repetitions: u64,
    /// Axes of the receiver's settings: cases that differ in them alone share samples.
    pub receiver: Vec<Digit>,
}

/// Position of a case in the grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// Counted from 0 over the whole study.
    pub number: u64,
    /// Number of the repetition, from 0.
    pub repetition: u64,
    /// Index of the value on each axis of the study.
    pub at: Vec<usize>,
}

fn product(digits: &[Digit]) -> Option<u64> {
    digits.iter().try_fold(1_u64, |product, digit| product.checked_mul(digit.length as u64))
}

impl Grid {
    /// The grid of `axes`; `changes_signal` says which keys do more than change the receiver.
    ///
    /// # Errors
    /// Axes that are zipped though they differ in length, too many cases; with the number of the axis.
    pub fn new(
        axes: &[Axis],
        repetitions: u64,
        changes_signal: impl Fn(&str) -> bool,
    ) -> Result<Self, (usize, String)> {
        let mut digits: Vec<Digit> = Vec::new();
        for (number, axis) in axes.iter().enumerate() {
            let same = |digit: &&mut Digit| {
                axis.zip.is_some() && digit.axes.iter().any(|&other| axes.get(other).is_some_and(|a| a.zip == axis.zip))
            };
            match digits.iter_mut().find(same) {
                Some(digit) if digit.length != axis.values.len() => {
                    let word = axis.zip.as_deref().unwrap_or_default();
                    let reason = format!(
                        "{} values: expected {}, as the other axis of zip = {word:?}",
                        axis.values.len(),
                        digit.length
                    );
                    return Err((number, reason));
                }
                Some(digit) => digit.axes.push(number),
                None => digits.push(Digit { axes: vec![number], length: axis.values.len() }),
            }
        }
        for digit in &digits {
            let members = || digit.axes.iter().filter_map(|&number| axes.get(number));
            let step =
                |index: usize| members().filter_map(|axis| axis.values.get(index)).map(text_of).collect::<Vec<_>>();
            let steps: std::collections::BTreeSet<Vec<String>> = (0..digit.length).map(step).collect();
            if let (true, Some(&number)) = (steps.len() < digit.length, digit.axes.first()) {
                return Err((
                    number,
                    "two steps with the same values on all zipped axes: expected each but once".to_owned(),
                ));
            }
        }
        let acts = |digit: &Digit| digit.axes.iter().filter_map(|&n| axes.get(n)).any(|axis| changes_signal(&axis.key));
        let (signal, receiver): (Vec<Digit>, Vec<Digit>) = digits.into_iter().partition(acts);
        let grid = Self { signal, repetitions, receiver };
        let cases = || product(&grid.signal)?.checked_mul(product(&grid.receiver)?)?.checked_mul(repetitions);
        match cases() {
            Some(1..=MOST_CASES) => Ok(grid),
            Some(count) => Err((0, format!("{count} cases: expected 1 to {MOST_CASES}"))),
            None => Err((0, format!("more than {} cases: expected 1 to {MOST_CASES}", u64::MAX))),
        }
    }

    /// Number of cases.
    pub fn cases(&self) -> u64 {
        self.groups() * self.sharing()
    }

    /// Cases that share a signal: neighbours from a multiple of this on.
    pub fn sharing(&self) -> u64 {
        product(&self.receiver).unwrap_or(1)
    }

    /// Different signals, repetitions counted.
    pub fn groups(&self) -> u64 {
        product(&self.signal).unwrap_or(1) * self.repetitions
    }

    /// Cells: cases but for repetitions.
    pub fn cells(&self) -> u64 {
        product(&self.signal).unwrap_or(1) * self.sharing()
    }

    /// Position of a case on the axes.
    pub fn case(&self, number: u64) -> Case {
        let group = number / self.sharing();
        let (signal, repetition) = (group / self.repetitions, group % self.repetitions);
        let count = self.signal.iter().chain(&self.receiver).map(|digit| digit.axes.len()).sum();
        let mut at = vec![0; count];
        for (digits, mut rest) in [(&self.signal, signal), (&self.receiver, number % self.sharing())] {
            for digit in digits.iter().rev() {
                let index = (rest % digit.length as u64) as usize;
                rest /= digit.length as u64;
                for &axis in &digit.axes {
                    if let Some(slot) = at.get_mut(axis) {
                        *slot = index;
                    }
                }
            }
        }
        Case { number, repetition, at }
    }

    /// The cell that a case repeats.
    pub fn cell_of(&self, number: u64) -> u64 {
        number / self.sharing() / self.repetitions * self.sharing() + number % self.sharing()
    }

    /// The first case of a cell.
    pub fn first_of(&self, cell: u64) -> u64 {
        cell / self.sharing() * self.repetitions * self.sharing() + cell % self.sharing()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_go_by_their_names_unless_two_have_the_same() {
        let axis = |key: &str, values: &[&str]| Axis {
            key: key.to_owned(),
            values: values.iter().map(|text| Value::String((*text).to_owned())).collect(),
            zip: None,
            label: None,
            place: Place { origin: "study.toml".to_owned(), line: 1, column: 1 },
        };
        let words = |axis: &Axis| (0..axis.values.len()).map(|rank| axis.words_of(rank)).collect::<Vec<_>>();
        let scenes = axis(SCENARIO_KEY, &["../scenarios/static.toml", "a/ride.toml", "b/ride.toml"]);
        assert_eq!(words(&scenes), ["static", "a/ride.toml", "b/ride.toml"]);
        assert_eq!(words(&axis("receiver.tracking.arithmetic", &["f32.x", "f64"])), ["f32.x", "f64"]);
    }
}
