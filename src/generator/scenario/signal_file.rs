//! Files that describe signals: their keys and values are checked as those of a scenario.

use std::path::Path;

use toml::de::DeTable;

use super::files::{Files, Wanted};
use super::keys::signal::SIGNAL;
use super::read::{Refusals, Source, Table};
use super::{MAX_BYTES, ScenarioError};
use gnss::signal::Signal;
use gnss::signal::described::{DescriptionError, registered};

/// Registers the signals whose files the scenario names.
pub(super) fn read(root: &Table<'_>, origin: &str, files: Files<'_>) -> Result<(), ScenarioError> {
    let mut refusals = Refusals::default();
    for path in root.texts("signal_file")?.unwrap_or_default() {
        refusals.take(file(Wanted { origin, key: "signal_file", path: Path::new(path) }, files));
    }
    refusals.finish()
}

fn file(wanted: Wanted<'_>, files: Files<'_>) -> Result<(), ScenarioError> {
    let bytes = wanted.load(files)?;
    let text = String::from_utf8(bytes).map_err(|_| wanted.refused("is not UTF-8".to_owned()))?;
    described_signal(&text, &files.directory.join(wanted.path).display().to_string()).map(|_| ())
}

/// Registers the signal that a text describes, or returns the one that an equal text has described before.
/// Errors call the text `origin`.
///
/// # Errors
/// All unknown keys and values out of their range, or the first value that does not suit the others; another
/// signal of the same name.
pub fn described_signal(text: &str, origin: &str) -> Result<&'static Signal, ScenarioError> {
    let source = Source { origin, text };
    let document = parsed(&source)?;
    let root = Table::new(&source, "", 0, document.get_ref(), SIGNAL);
    let mut refusals = Refusals::default();
    root.check(&mut refusals);
    refusals.finish()?;
    registered(text).map_err(|error| match error {
        DescriptionError::Toml(message) => ScenarioError::Toml { place: source.place(0), message },
        DescriptionError::Value { path, expected } => refused(&root, &path, &expected),
    })
}

/// The document of a text, or the refusal of one that is too long or no TOML.
pub(super) fn parsed<'t>(source: &Source<'t>) -> Result<toml::Spanned<DeTable<'t>>, ScenarioError> {
    let text = source.text;
    if text.len() > MAX_BYTES {
        let message = format!("{} bytes: expected a text of at most {MAX_BYTES}", text.len());
        return Err(ScenarioError::Toml { place: source.place(0), message });
    }
    DeTable::parse(text).map_err(|error| source.refused(&error))
}

/// Refusal of the value at a path such as `component[2].codes.G01`.
fn refused(root: &Table<'_>, path: &str, expected: &str) -> ScenarioError {
    let mut steps = path.split('.').map(|step| step.split_once('[').map_or((step, None), numbered));
    let (last, _) = steps.next_back().unwrap_or((path, None));
    let mut table = root.clone();
    for (name, number) in steps {
        let below = match number {
            None => table.table(name),
            Some(number) => table.tables(name).map(|all| all.and_then(|all| all.into_iter().nth(number - 1))),
        };
        match below {
            Ok(Some(below)) => table = below,
            _ => return table.bad(name, expected),
        }
    }
    table.bad(last, expected)
}

/// Name of an array and number of its table, from 1.
fn numbered<'p>((name, number): (&'p str, &str)) -> (&'p str, Option<usize>) {
    (name, number.trim_end_matches(']').parse().ok().filter(|number| *number > 0))
}
