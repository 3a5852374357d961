//! A pack's manifest as written, and the scenes of its entries.
//!
//! [`Pack::read`] refuses by file, line and column whatever the readers of manifest, scene, receiver settings
//! and limits refuse, before anything runs. An entry's scene is a file below the pack's directory with the
//! keys of `set` put over it. Limits: whether the values of a scene fit together is known when it is
//! composed.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use toml::de::DeTable;
use toml::{Table as Document, Value};

use super::glob::matches;
use super::keys::{NAME, PACK};
use crate::cli::error::{CliError, shown};
use crate::cli::scenario;
use crate::cli::scenes;
use analysis::judge::limits::Limits;
use generator::scenario::read::{Refusals, Source, Table};
use generator::scenario::{Place, Scenario, ScenarioError, put};
use receiver::settings::Settings;

/// File of a pack's directory that makes it one.
pub const MANIFEST: &str = "pack.toml";

/// A pack: what it is, and its entries.
#[derive(Debug)]
pub struct Pack {
    pub name: String,
    pub title: String,
    pub like: Option<String>,
    pub source: String,
    pub licence: String,
    pub about: Option<String>,
    pub entries: Vec<Entry>,
    pub not_said: Vec<NotSaid>,
}

/// One `[[entry]]` with its scene.
#[derive(Debug)]
pub struct Entry {
    pub name: String,
    pub group: String,
    pub description: String,
    /// Position of the entry's name in the manifest, for messages.
    pub place: Place,
    /// Text of the scene with the entry's keys in it.
    pub text: String,
    pub scenario: Scenario,
    pub settings: Settings,
    pub expectation: Expectation,
    /// Limits of the verdict, and their text.
    pub limits: Option<(Limits, String)>,
}

/// Verdict that an entry should end with.
#[derive(Debug)]
pub enum Expectation {
    /// No figure fails but those that match a pattern, each with the reason.
    Pass(Vec<(String, String)>),
    /// One figure fails at least, for this reason.
    Fail(String),
    /// The matrix records the verdict, for this reason.
    Any(String),
}

/// Test of the source that no scene says.
#[derive(Debug)]
pub struct NotSaid {
    pub name: String,
    pub group: String,
    pub description: String,
    pub reason: String,
}

impl Pack {
    /// Reads the manifest of a directory, and the scenes of its entries.
    ///
    /// # Errors
    /// Everything that is refused, each with its position.
    pub fn read(directory: &Path) -> Result<Self, CliError> {
        let path = directory.join(MANIFEST);
        if !path.exists() {
            let hint = scenes::pack_hint(directory).map_or_else(String::new, |hint| format!(": {hint}"));
            return Err(CliError::input(format!("{}: no such file{hint}", shown(&path))));
        }
        let (origin, text) = scenario::text(&path)?;
        Self::parse(&text, &origin, directory)
            .map_err(|error| scenario::all(error.each().iter().map(ToString::to_string)))
    }

    fn parse(text: &str, origin: &str, directory: &Path) -> Result<Self, ScenarioError> {
        let source = Source { origin, text };
        let document = DeTable::parse(text).map_err(|error| source.refused(&error))?;
        let root = Table::new(&source, "", 0, document.get_ref(), PACK);
        let mut refusals = Refusals::default();
        root.check(&mut refusals);
        refusals.finish()?;
        // Keys that are put over a scene are any: they are read without positions.
        let whole: Document = toml::from_str(text).map_err(|error| source.refused(&error))?;
        let sets = |number: usize| whole.get("entry")?.get(number)?.get("set").cloned();
        let mut refusals = Refusals::default();
        let common: Vec<(String, String)> = refusals.take(may_fail(&root)).unwrap_or_default();
        let mut entries = Vec::new();
        for (number, table) in root.tables("entry")?.unwrap_or_default().iter().enumerate() {
            let entry = Entry::read(table, sets(number), directory);
            entries.extend(refusals.take(entry.map(|entry| entry.allowed(&common))));
        }
        let not_said = root.tables("not_said")?.unwrap_or_default();
        let not_said: Vec<NotSaid> = not_said.iter().filter_map(|table| refusals.take(NotSaid::read(table))).collect();
        if root.tables("entry")?.is_none_or(|tables| tables.is_empty()) {
            refusals.add(root.bad("entry", "at least one [[entry]]"));
        }
        let mut seen = BTreeSet::new();
        for table in ["entry", "not_said"].into_iter().flat_map(|name| root.tables(name)).flatten().flatten() {
            // Two names that differ in case are one directory on some machines.
            if !seen.insert(table.text("name")?.unwrap_or_default().to_lowercase()) {
                refusals.add(table.bad("name", "each name once"));
            }
        }
        let own = refusals.take(named(&root));
        refusals.finish()?;
        let of = |key: &str| root.text(key).map(|text| text.map(words));
        Ok(Self {
            name: own.unwrap_or_default(),
            title: of("title")?.unwrap_or_default(),
            like: of("like")?,
            source: of("source")?.unwrap_or_default(),
            licence: of("licence")?.unwrap_or_default(),
            about: of("about")?,
            entries,
            not_said,
        })
    }
}

impl Entry {
    fn read(table: &Table<'_>, set: Option<Value>, directory: &Path) -> Result<Self, ScenarioError> {
        let path = below(table, "scene")?;
        let file = directory.join(path);
        let (origin, written) = scenario::text(&file).map_err(|error| {
            let hint = scenes::hint(&file).filter(|_| !file.exists());
            let hint = hint.map_or_else(String::new, |hint| format!(" ({hint})"));
            table.bad("scene", format!("a scene that can be read{hint}: {}", error.message()))
        })?;
        let text = match &set {
            None => written,
            Some(Value::Table(set)) => patched(&written, set).map_err(|reason| table.bad("set", reason))?,
            Some(_) => return Err(table.bad("set", "a table of keys of the scene")),
        };
        // A scene as its file has it is refused by its own lines, one with keys put over it by the entry's.
        let refused = |error: String| match set {
            None => ScenarioError::Toml { place: table.place("scene"), message: format!("scene: {error}") },
            Some(_) => ScenarioError::Toml { place: table.place("set"), message: format!("scene with set: {error}") },
        };
        let scenario = Scenario::parse_in(&text, &origin, file.parent().unwrap_or(directory), false);
        let shown = |error: &ScenarioError| if set.is_none() { error.to_string() } else { error.without_place() };
        let scenario = scenario.map_err(|error| refused(shown(&error)))?;
        let settings = Settings::of_scenario(&text, &origin).map_err(|error| refused(error.to_string()))?;
        Ok(Self {
            name: named(table)?,
            group: words(table.need_text("group")?),
            description: words(table.need_text("description")?),
            place: table.place("name"),
            text,
            scenario,
            settings,
            expectation: Expectation::read(table)?,
            limits: limits(table, directory)?,
        })
    }

    /// The entry with what may fail in every one of the pack.
    fn allowed(mut self, common: &[(String, String)]) -> Self {
        if let Expectation::Pass(own) = &mut self.expectation {
            own.extend_from_slice(common);
        }
        self
    }
}

/// Patterns of figures that may fail, each with its reason.
fn may_fail(table: &Table<'_>) -> Result<Vec<(String, String)>, ScenarioError> {
    let one = |table: &Table<'_>| Ok((table.need_text("figure")?.to_owned(), words(table.need_text("reason")?)));
    table.tables("may_fail")?.unwrap_or_default().iter().map(one).collect()
}

impl Expectation {
    fn read(table: &Table<'_>) -> Result<Self, ScenarioError> {
        let reason = table.text("reason")?.map(words);
        let given = || reason.clone().ok_or_else(|| table.bad("reason", "a text, which this verdict needs"));
        match table.choice("verdict", &[("pass", "pass"), ("fail", "fail"), ("any", "any")])? {
            Some(verdict @ ("fail" | "any")) => {
                if table.has("may_fail") {
                    return Err(table.bad("may_fail", format!("nothing with verdict = {verdict:?}")));
                }
                Ok(if verdict == "fail" { Self::Fail(given()?) } else { Self::Any(given()?) })
            }
            _ => may_fail(table).map(Self::Pass),
        }
    }

    /// Reason for which a failed figure is as expected.
    pub fn excuse(&self, figure: &str, path: &str) -> Option<&str> {
        match self {
            Self::Pass(may_fail) => {
                let fits = |(pattern, _): &&(String, String)| matches(pattern, figure) || matches(pattern, path);
                may_fail.iter().find(fits).map(|(_, reason)| reason.as_str())
            }
            Self::Fail(reason) | Self::Any(reason) => Some(reason),
        }
    }
}

impl NotSaid {
    fn read(table: &Table<'_>) -> Result<Self, ScenarioError> {
        let of = |key: &str| table.need_text(key).map(words);
        let (group, description, reason) = (of("group")?, of("description")?, of("reason")?);
        Ok(Self { name: named(table)?, group, description, reason })
    }
}

fn named(table: &Table<'_>) -> Result<String, ScenarioError> {
    let name = table.need_text("name")?;
    let fits = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let good = name.len() <= 64 && name.chars().all(fits) && !name.starts_with('.');
    if good { Ok(name.to_owned()) } else { Err(table.bad("name", NAME)) }
}

/// A text on one line: it is broken into lines where it suits its file.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A path that stays below the pack's directory.
fn below<'t>(table: &Table<'t>, key: &str) -> Result<&'t Path, ScenarioError> {
    let path = Path::new(table.need_text(key)?);
    let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if inside { Ok(path) } else { Err(table.bad(key, "a path below the pack's directory")) }
}

fn limits(table: &Table<'_>, directory: &Path) -> Result<Option<(Limits, String)>, ScenarioError> {
    if !table.has("limits") {
        return Ok(None);
    }
    let path: PathBuf = directory.join(below(table, "limits")?);
    let (name, text) = scenario::text(&path)
        .map_err(|error| table.bad("limits", format!("a file that can be read: {}", error.message())))?;
    let limits = Limits::parse(&text, &name)
        .map_err(|error| ScenarioError::Toml { place: table.place("limits"), message: format!("limits: {error}") })?;
    Ok(Some((limits, text)))
}

/// A scene's text with keys put over it.
fn patched(text: &str, set: &Document) -> Result<String, String> {
    let refuse = |error: toml::de::Error| format!("keys for a scene that is TOML: {}", error.message());
    let mut document: Document = toml::from_str(text).map_err(refuse)?;
    for (key, value) in set {
        if key.contains(['.', '[']) {
            put(&mut document, key, value).map_err(|reason| format!("keys of the scene: {key}: {reason}"))?;
        } else {
            merge(&mut document, key, value);
        }
    }
    toml::to_string(&document).map_err(|error| error.to_string())
}

fn merge(document: &mut Document, key: &str, value: &Value) {
    match (document.get_mut(key), value) {
        (Some(Value::Table(old)), Value::Table(new)) => new.iter().for_each(|(key, value)| merge(old, key, value)),
        _ => drop(document.insert(key.to_owned(), value.clone())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "name = \"s\"\nstart = 2010-07-01T08:06:00\nduration_s = 1\n[noise]\n[motion]\nkind = \
                         \"static\"\nlatitude_deg = 48\nlongitude_deg = 11\nheight_m = 520\n";
    const TOP: &str = "name = \"p\"\ntitle = \"T\"\nsource = \"s\"\nlicence = \"MIT\"\n";
    const ENTRY: &str = "[[entry]]\nname = \"a\"\ngroup = \"g\"\ndescription = \"d\"\nscene = \"s.toml\"\n";

    fn read(manifest: &str) -> Result<Pack, String> {
        let here = tempfile::tempdir().unwrap();
        std::fs::write(here.path().join("s.toml"), SCENE).unwrap();
        std::fs::write(here.path().join(MANIFEST), manifest).unwrap();
        let prefix = format!("{}/", here.path().display());
        Pack::read(here.path()).map_err(|error| error.message().replace(&prefix, ""))
    }

    #[test]
    fn keys_of_an_entry_are_put_over_those_of_its_scene() {
        let set = "[entry.set]\nduration_s = 2.5\n[entry.set.motion]\nheight_m = 7\n[[entry.set.interference]]\n\
                   kind = \"cw\"\njs_db = 3\n";
        let pack = read(&format!("{TOP}{ENTRY}{set}")).unwrap();
        let document: Document = toml::from_str(&pack.entries[0].text).unwrap();
        assert_eq!(document["duration_s"].as_float(), Some(2.5));
        assert_eq!(document["motion"]["height_m"].as_integer(), Some(7));
        assert_eq!(document["motion"]["latitude_deg"].as_integer(), Some(48));
        assert_eq!(document["interference"][0]["js_db"].as_integer(), Some(3));
        assert_eq!(read(&format!("{TOP}{ENTRY}")).unwrap().entries[0].text, SCENE);
    }

    #[test]
    fn what_is_wrong_is_refused_with_file_line_and_expectation() {
        let entry = |line: &str| format!("{TOP}{ENTRY}{line}\n");
        let cases = [
            (TOP.to_owned(), "pack.toml:1:1: entry = absent: expected an array of tables"),
            (entry("grup = 1"), "pack.toml:10:1: unknown key 'entry[1].grup': did you mean 'group'?"),
            (entry("verdict = \"good\""), "pack.toml:10:11: entry[1].verdict = \"good\": expected one of pass, fail"),
            (entry("verdict = \"fail\""), "entry[1].reason = absent: expected a text, which this verdict needs"),
            (
                entry("limits = \"../l.toml\""),
                "pack.toml:10:10: entry[1].limits = \"../l.toml\": expected a path below",
            ),
            (
                entry("limits = \"l.toml\""),
                "entry[1].limits = \"l.toml\": expected a file that can be read: cannot read",
            ),
            (entry("[entry.set]\nduration_s = -1"), "scene with set: duration_s = -1"),
            (entry("[entry.set]\n\"interference[2].js_db\" = 1"), "interference[2].js_db: interference is no array"),
            (entry("[[entry.may_fail]]\nfigure = \"x\""), "entry[1].may_fail[1].reason = absent: expected a text"),
            (format!("{TOP}{ENTRY}{ENTRY}"), "pack.toml:11:8: entry[2].name = \"a\": expected each name once"),
            (format!("{TOP}{}", ENTRY.replace("s.toml", "q.toml")), "scene = \"q.toml\": expected a scene that can be"),
            (
                format!("{TOP}{}", ENTRY.replace("\"a\"", "\"a/b\"")),
                "entry[1].name = \"a/b\": expected 1 to 64 letters",
            ),
            (format!("{TOP}= 1"), "pack.toml:5:1: "),
        ];
        for (manifest, expected) in cases {
            let message = read(&manifest).unwrap_err();
            assert!(message.contains(expected), "{message}\n{expected}");
        }
    }

    #[test]
    fn only_named_figures_are_excused() {
        let may = "[[entry.may_fail]]\nfigure = \"horizontal*\"\nreason = \"r\"\n";
        let pack = read(&format!("{TOP}{ENTRY}{may}")).unwrap();
        let expectation = &pack.entries[0].expectation;
        assert_eq!(expectation.excuse("horizontal error", ""), Some("r"));
        assert_eq!(expectation.excuse("vertical error", "position.vertical_p95_m"), None);
        let pack = read(&format!("{TOP}{ENTRY}[[may_fail]]\nfigure = \"position.*\"\nreason = \"all\"\n")).unwrap();
        let expectation = &pack.entries[0].expectation;
        assert_eq!(expectation.excuse("vertical error", "position.vertical_p95_m"), Some("all"));
    }
}
