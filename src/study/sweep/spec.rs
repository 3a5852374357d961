//! STUDY.toml as written, every key checked.
//!
//! The base is a scene's file or, at correlator level, the tables `[signal]`, `[motion]`, `[loop]`,
//! `[measure]` and `[receiver]` of the study itself. Axes put their values under any key of the base.

use std::path::{Path, PathBuf};

use toml::Value;
use toml::de::DeTable;

use super::axis::{self, Axis, Grid};
use super::{fixes, keys, model, sampled, words};
use generator::scenario::ScenarioError;
use generator::scenario::read::{Refusals, Source, Table};
use generator::scene::Grade;
use gnss::place::nearest;
use receiver::settings::{Settings, SettingsError};

/// Level of the simulation that a case runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// The receiver's loops on modelled correlations.
    Correlator,
    /// Generator and receiver of a scene at the scene's own level, which makes samples unless the scene says
    /// otherwise.
    Samples,
    /// Generator and receiver of a scene on modelled correlations, whatever level the scene names.
    Correlations,
    /// Generator and navigation of a scene on modelled observations, whatever level the scene names.
    Observations,
}

impl Level {
    /// Levels and their names in a study's text.
    pub(super) const NAMES: [(&'static str, Self); 4] = [
        ("correlator", Self::Correlator),
        ("samples", Self::Samples),
        ("correlations", Self::Correlations),
        ("observations", Self::Observations),
    ];

    /// Name of the level in a study's text.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, level)| *level == self).map_or("", |(name, _)| *name)
    }

    /// Level of fidelity that replaces that of every scene.
    pub(super) fn grade(self) -> Option<Grade> {
        match self {
            Self::Correlator | Self::Samples => None,
            Self::Correlations => Some(Grade::Correlations),
            Self::Observations => Some(Grade::Observations),
        }
    }
}

/// A study as written.
#[derive(Clone, Debug)]
pub struct Study {
    /// Name of the study in errors.
    pub origin: String,
    /// Name of its results.
    pub name: String,
    /// Words above its report.
    pub title: String,
    /// Text at the beginning of the report.
    pub about: String,
    /// Level of its cases.
    pub level: Level,
    /// Seed from which every case's seed follows.
    pub seed: u64,
    /// Axes of the variation.
    pub axes: Vec<Axis>,
    /// Combination of the axes into cases.
    pub grid: Grid,
    /// Tables of the study that make its base, at correlator level.
    pub base: toml::Table,
    /// File of the scene as written; absent at correlator level, and where an axis names the files.
    pub scenario: Option<PathBuf>,
    /// Figures to keep; at correlator level those of theory follow the ones that they predict.
    pub keep: Vec<String>,
    /// Numbers of the axes that keep ensembles apart; `None` where the study asks for no ensemble.
    pub ensemble: Option<Vec<usize>>,
    /// Pictures of its report.
    pub plots: Vec<Plot>,
}

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Kind of the picture.
    pub kind: PlotKind,
    /// Words above it.
    pub title: String,
    /// Axis across.
    pub x: String,
    /// Figure that is drawn.
    pub figure: String,
    /// Name of the figure in the picture, in place of its name in words.
    pub label: Option<String>,
    /// Axis that distinguishes curves.
    pub series: Option<String>,
    /// Axis that distinguishes pictures.
    pub panel: Option<String>,
    /// Values of other axes.
    pub fixed: Vec<(String, Value)>,
    /// True if the horizontal axis is logarithmic.
    pub log_x: bool,
    /// True if the vertical axis is logarithmic.
    pub log_y: bool,
}

/// Form of a figure's plot.
#[derive(Clone, Debug, PartialEq)]
pub enum PlotKind {
    /// The figure over x, a band of 95 % about its mean.
    Curve,
    /// The figure as colour over x and this axis.
    Heat {
        /// The axis upward.
        y: String,
    },
    /// Value on this axis at which the figure crosses a level, over x.
    Crossing {
        /// The axis along which it is sought.
        along: String,
        /// The level.
        level: f64,
    },
}

const BASE: [&str; 5] = ["signal", "motion", "loop", "measure", "receiver"];
/// Largest text of a study.
const MOST_BYTES: usize = 1 << 20;
/// The key under which an axis names scenes.
pub const SCENARIO_KEY: &str = "scenario";

impl Study {
    /// Reads a study; `origin` names it in errors.
    ///
    /// # Errors
    /// The first key or value that is not as expected, with its position.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        let source = Source { origin, text };
        let refuse = |at: usize, message: String| ScenarioError::Toml { place: source.place(at), message };
        if text.len() > MOST_BYTES {
            return Err(refuse(0, format!("{} bytes: expected a study of at most {MOST_BYTES}", text.len())));
        }
        let toml = |e: toml::de::Error| refuse(e.span().map_or(0, |span| span.start), e.message().to_owned());
        let document = DeTable::parse(text).map_err(toml)?;
        let root = Table::new(&source, "", 0, document.get_ref(), keys::STUDY);
        root.allow_own()?;
        let level = root.need_choice("level", &Level::NAMES)?;
        let axes: Vec<Axis> =
            root.tables("axis")?.unwrap_or_default().iter().map(Axis::read).collect::<Result<_, _>>()?;
        unlike(&root, level, &axes)?;
        let scenario = scenario(&root, level, &axes)?;
        let base = base(&root, (text, origin), level).map_err(|e| match e {
            Ok(refused) => refused,
            Err(e) => toml(*e),
        })?;
        let repetitions = root.need_integer("repetitions")?;
        let signal = |key: &str| match level {
            Level::Correlator => model::changes_signal(key),
            _ => sampled::changes_signal(key),
        };
        let grid = Grid::new(&axes, repetitions, signal).map_err(|(number, reason)| ScenarioError::Toml {
            place: axes.get(number).map_or_else(|| root.place("axis"), |axis| axis.place.clone()),
            message: reason,
        })?;
        let keep = keep(&root, level)?;
        let ensemble = ensemble(&root, &axes)?;
        let plots = root.tables("plot")?.unwrap_or_default();
        let plots = plots.iter().map(|table| plot(table, &axes, &grid, &keep)).collect::<Result<_, _>>()?;
        let name = name(&root)?;
        Ok(Self {
            origin: origin.to_owned(),
            title: root.text("title")?.map_or_else(|| name.clone(), str::to_owned),
            about: root.text("about")?.unwrap_or_default().trim().to_owned(),
            name,
            level,
            seed: root.need_integer("seed")?,
            axes,
            grid,
            base,
            scenario,
            keep,
            ensemble,
            plots,
        })
    }

    /// The values of a case, axis by axis.
    pub fn values<'s>(&'s self, case: &axis::Case) -> Vec<(&'s Axis, &'s Value)> {
        let at = |(axis, index): (&'s Axis, &usize)| axis.values.get(*index).map(|value| (axis, value));
        self.axes.iter().zip(&case.at).filter_map(at).collect()
    }

    /// Values of a case in words.
    pub fn values_text(&self, case: &axis::Case) -> String {
        let words: Vec<String> =
            self.values(case).iter().map(|(axis, value)| format!("{} = {}", axis.key, axis::text_of(value))).collect();
        words.join(", ")
    }

    /// The scene of a case as the study writes it; none at correlator level.
    pub fn scenario_of<'s>(&'s self, case: &axis::Case) -> Option<&'s Path> {
        let named = self.values(case).into_iter().find(|(axis, _)| axis.key == SCENARIO_KEY);
        match named {
            Some((_, Value::String(path))) => Some(Path::new(path)),
            _ => self.scenario.as_deref(),
        }
    }

    /// Every scene that the study names.
    pub fn scenarios(&self) -> Vec<&Path> {
        let named = self.axes.iter().filter(|axis| axis.key == SCENARIO_KEY).flat_map(|axis| &axis.values);
        let named = named.filter_map(|value| value.as_str().map(Path::new));
        self.scenario.as_deref().into_iter().chain(named).collect()
    }

    /// The seed of a case: a hash of the study's seed, the scene's name, the values that change the signal,
    /// by name, and the repetition. Cases that differ in the receiver or in the fidelity alone have the same
    /// seed, and another axis of the receiver or other values of an axis change no case's seed.
    pub fn seed_of(&self, case: &axis::Case, scene: &str) -> u64 {
        let acts = |key: &str| match self.level {
            Level::Correlator => model::changes_signal(key),
            _ => sampled::changes_world(key) && key != SCENARIO_KEY,
        };
        let mut named: Vec<String> = self
            .values(case)
            .iter()
            .filter(|(axis, _)| acts(&axis.key))
            .map(|(axis, value)| format!("{}={}", axis.key, axis::text_of(value)))
            .collect();
        named.sort();
        let text = format!("{}|{scene}|{}|{}", self.seed, named.join("|"), case.repetition);
        let digits = super::sha256_hex(text.as_bytes());
        // 63 bits: a scene's seed is a TOML integer.
        digits.get(..16).and_then(|hex| u64::from_str_radix(hex, 16).ok()).unwrap_or(0) >> 1
    }
}

fn name(root: &Table<'_>) -> Result<String, ScenarioError> {
    let expected = "1 to 64 letters, digits, '-' and '_' (it names a directory)";
    let name = root.need_text("name")?;
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.len() <= 64 && name.chars().all(fits) { Ok(name.to_owned()) } else { Err(root.bad("name", expected)) }
}

/// Refuses keys that occur twice, or that are the study's own matter.
fn unlike(root: &Table<'_>, level: Level, axes: &[Axis]) -> Result<(), ScenarioError> {
    let is_chosen = |key: &str| level.grade().is_some() && sampled::changes_level(key);
    for (number, axis) in axes.iter().enumerate() {
        let message = if axes.iter().take(number).any(|other| other.key == axis.key) {
            format!("axis {}: expected each key but once", axis.key)
        } else if ["seed", "name"].contains(&axis.key.as_str()) {
            format!("axis {}: expected a key of the base; repetitions vary the seed", axis.key)
        } else if is_chosen(&axis.key) {
            format!("axis {}: expected level = \"samples\", at which a scene's [fidelity] is heard", axis.key)
        } else {
            continue;
        };
        return Err(ScenarioError::Toml { place: axis.place.clone(), message });
    }
    if axes.is_empty() && root.has("axis") { Err(root.bad("axis", "an array of tables, [[axis]]")) } else { Ok(()) }
}

fn scenario(root: &Table<'_>, level: Level, axes: &[Axis]) -> Result<Option<PathBuf>, ScenarioError> {
    let written = root.text(SCENARIO_KEY)?;
    let axis = axes.iter().find(|axis| axis.key == SCENARIO_KEY);
    match (level, written, axis) {
        (Level::Correlator, None, None) => Ok(None),
        (Level::Correlator, ..) => Err(root.bad(SCENARIO_KEY, "nothing at level = \"correlator\", which has no scene")),
        (_, Some(_), Some(_)) => Err(root.bad(SCENARIO_KEY, "nothing beside the axis \"scenario\"")),
        (_, None, None) => Err(root.bad(SCENARIO_KEY, "the path of a scene, relative to the study")),
        (_, written, None) => Ok(written.map(PathBuf::from)),
        (_, None, Some(axis)) if axis.values.iter().all(Value::is_str) => Ok(None),
        (_, None, Some(axis)) => {
            let message = "axis scenario: expected paths of scenes, relative to the study".to_owned();
            Err(ScenarioError::Toml { place: axis.place.clone(), message })
        }
    }
}

/// Error of a receiver's setting as one of a study.
fn conflict(error: &SettingsError) -> ScenarioError {
    let whole = error.to_string();
    let reason = whole.strip_prefix(&format!("{}: ", error.place())).unwrap_or(&whole).to_owned();
    ScenarioError::Conflict { origin: error.place().to_owned(), key: "receiver", reason }
}

/// The tables of the base, at correlator level.
fn base(
    root: &Table<'_>,
    (text, origin): (&str, &str),
    level: Level,
) -> Result<toml::Table, Result<ScenarioError, Box<toml::de::Error>>> {
    if level != Level::Correlator {
        let written = BASE.iter().find(|name| root.has(name));
        let expected = format!("nothing at level = \"{}\": the scene's file holds it", level.name());
        return written.map_or_else(|| Ok(toml::Table::new()), |name| Err(Ok(root.bad(name, expected))));
    }
    let mut whole: toml::Table = toml::from_str(text).map_err(|e| Err(Box::new(e)))?;
    let mut refusals = Refusals::default();
    if let Err(error) = Settings::of_scenario(text, origin) {
        error.each().iter().map(conflict).for_each(|error| refusals.add(error));
    }
    refusals.finish().map_err(Ok)?;
    whole.retain(|key, _| BASE.contains(&key));
    // As written and in its place, so that errors of the base itself carry theirs.
    model::Model::read(root).map_err(Ok)?;
    Ok(whole)
}

fn keep(root: &Table<'_>, level: Level) -> Result<Vec<String>, ScenarioError> {
    let known: Vec<&str> = match level {
        Level::Correlator => model::FIGURES.iter().map(|figure| figure.name).collect(),
        _ => [sampled::FIGURES, fixes::FIGURES].concat(),
    };
    let expected = "an array of figures";
    let written = root.words("keep", expected)?.ok_or_else(|| root.bad("keep", expected))?;
    let mut keep: Vec<String> = Vec::new();
    for word in written {
        if !known.contains(&word) {
            let hint = nearest(word, &known).map_or(String::new(), |near| format!(" (did you mean {near}?)"));
            return Err(root.bad("keep", format!("figures out of {}; {word:?} is none{hint}", known.join(", "))));
        }
        // In a scene theory is for scenes of thermal noise alone, so a study has to ask for it.
        let theory = (level == Level::Correlator).then(|| format!("theory.{word}"));
        for name in [Some(word.to_owned()), theory].into_iter().flatten() {
            if known.contains(&name.as_str()) && !keep.contains(&name) {
                keep.push(name);
            }
        }
    }
    if keep.iter().any(|name| name.starts_with("theory.")) && !keep.iter().any(|name| name == model::SNR) {
        keep.push(model::SNR.to_owned());
    }
    if keep.is_empty() { Err(root.bad("keep", "at least one figure")) } else { Ok(keep) }
}

/// The axes that keep ensembles apart.
fn ensemble(root: &Table<'_>, axes: &[Axis]) -> Result<Option<Vec<usize>>, ScenarioError> {
    let expected = "an array of axes by their keys; [] pools all cases";
    let Some(words) = root.words("ensemble", expected)? else { return Ok(None) };
    let number = |word: &&str| {
        let found = axes.iter().position(|axis| axis.key == **word);
        found.ok_or_else(|| root.bad("ensemble", format!("{expected}; {word:?} is none")))
    };
    words.iter().map(number).collect::<Result<_, _>>().map(Some)
}

#[derive(Clone, Copy)]
enum Kind {
    Curve,
    Heat,
    Crossing,
}

fn plot(table: &Table<'_>, axes: &[Axis], grid: &Grid, keep: &[String]) -> Result<Plot, ScenarioError> {
    table.allow_own()?;
    let kinds = [("curve", Kind::Curve), ("heat", Kind::Heat), ("crossing", Kind::Crossing)];
    let kind = table.choice("kind", &kinds)?.unwrap_or(Kind::Curve);
    let keys: Vec<&str> = axes.iter().map(|axis| axis.key.as_str()).collect();
    let figures: Vec<&str> = keep.iter().map(String::as_str).collect();
    let one_of = |name: &str, known: &[&str]| -> Result<Option<String>, ScenarioError> {
        let expected = format!("one of {}", known.join(", "));
        let Some(word) = table.text(name)? else { return Ok(None) };
        let hint = nearest(word, known).map_or(String::new(), |near| format!(" (did you mean {near}?)"));
        if known.contains(&word) { Ok(Some(word.to_owned())) } else { Err(table.bad(name, expected + &hint)) }
    };
    let needed = |name: &str, known: &[&str]| {
        one_of(name, known)?.ok_or_else(|| table.bad(name, format!("one of {}", known.join(", "))))
    };
    let x = needed("x", &keys)?;
    let (kind, figure) = match kind {
        Kind::Curve => (PlotKind::Curve, needed("y", &figures)?),
        Kind::Heat => (PlotKind::Heat { y: needed("y", &keys)? }, needed("z", &figures)?),
        Kind::Crossing => {
            let level = table.need("level")?;
            (PlotKind::Crossing { along: needed("along", &keys)?, level }, needed("z", &figures)?)
        }
    };
    let mut fixed = Vec::new();
    if let Some(named) = table.table("where")? {
        named.allow(&keys)?;
        for key in named.names() {
            let value = named.value(key).filter(|value| {
                let axis = axes.iter().find(|axis| axis.key == key);
                axis.is_some_and(|axis| axis.values.iter().any(|known| axis::text_of(known) == axis::text_of(value)))
            });
            fixed.push((key.to_owned(), value.ok_or_else(|| named.bad(key, "one of the axis's values"))?));
        }
    }
    let label = table.text("label")?;
    let plot = Plot {
        title: table
            .text("title")?
            .map_or_else(|| label.unwrap_or(&words::of_figure(&figure)).to_owned(), str::to_owned),
        label: label.map(str::to_owned),
        kind,
        x,
        figure,
        series: one_of("series", &keys)?,
        panel: one_of("panel", &keys)?,
        fixed,
        log_x: table.flag("log_x")?.unwrap_or(false),
        log_y: table.flag("log_y")?.unwrap_or(false),
    };
    // Each axis, or one that is zipped with it, must have its position: else several cells would fall on one
    // point.
    let mut placed: Vec<&str> = vec![&plot.x];
    placed.extend(plot.series.iter().chain(&plot.panel).map(String::as_str));
    placed.extend(plot.fixed.iter().map(|(key, _)| key.as_str()));
    match &plot.kind {
        PlotKind::Heat { y } => placed.push(y),
        PlotKind::Crossing { along, .. } => placed.push(along),
        PlotKind::Curve => {}
    }
    for digit in grid.signal.iter().chain(&grid.receiver) {
        let names: Vec<&str> = digit.axes.iter().filter_map(|&n| keys.get(n)).copied().collect();
        if digit.length > 1 && !names.iter().any(|name| placed.contains(name)) {
            let expected = format!("a use of axis {} too: in x, series, panel or where", names.join(" and "));
            return Err(table.bad("x", expected));
        }
    }
    Ok(plot)
}
