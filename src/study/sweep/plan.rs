//! A study on disk: `manifest.json`, copies of everything that it needs, and its shards.
//!
//! The manifest says what will be computed; its hash is in every shard. Inputs lie in the directory under
//! their content's hash, so a worker needs the directory and the program only. A plan that is loaded is made
//! again from its inputs and must come out the same, byte by byte: what a manifest says is checked, never
//! believed.

use std::fs;
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use toml::Value;

use super::axis::{Axis, Digit, text_of};
use super::cost::{case_s, shard_size};
use super::model::Model;
use super::sampled::{self, Base};
use super::spec::{Level, Study};
use super::{StudyError, axis, sha256_hex, temporary, unit_of};
use analysis::show::staged::Staged;
use generator::scenario::{Scenario, put};
use generator::scene::Grade;

/// Version of manifest and shards.
const SCHEMA: u32 = 1;
const TOOL: &str = concat!("gnss-twin ", env!("CARGO_PKG_VERSION"));

/// Rule that cuts a study into shards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    /// Shards of about a minute of one core each at most, 50 to 1000 of them.
    Default,
    /// Fixed number of shards.
    Shards(u64),
    /// Time of a shard on one core, in minutes.
    Minutes(f64),
}

/// `manifest.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this format.
    pub schema: u32,
    /// Program and version that made it.
    pub tool: String,
    /// Hash of the program that planned.
    pub build: String,
    /// Name of the study.
    pub name: String,
    /// Level of the cases.
    pub level: String,
    /// Seed from which every case's seed follows.
    pub seed: u64,
    /// Files that the study needs, with their hashes.
    pub inputs: Vec<Input>,
    /// Slowest first; the last case has the last value of each.
    pub axes: Vec<AxisEntry>,
    /// Number of cases.
    pub n_cases: u64,
    /// Cases of a shard; the last one may have fewer.
    pub shard_size: u64,
    /// Columns of the results.
    pub columns: Vec<Column>,
}

/// A file that the study needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Name in the study's text; empty for the study itself.
    pub written: String,
    /// Path relative to the study's directory.
    pub path: String,
    /// Hash of its contents, hexadecimal.
    pub sha256: String,
}

/// Keys that step together, and their values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisEntry {
    /// Keys that change together.
    pub keys: Vec<String>,
    /// A list a key.
    pub values: Vec<Vec<Json>>,
}

/// A column of the result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Heading of the column.
    pub name: String,
    /// Unit of the value.
    pub unit: String,
}

/// A study with its directory.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Directory of the plan.
    pub directory: PathBuf,
    /// The study as described.
    pub study: Study,
    /// Manifest to which the results are bound.
    pub manifest: Manifest,
    /// Hash of the manifest's bytes.
    pub hash: String,
    /// Scenes of a study; none at correlator level.
    pub bases: Vec<Base>,
}

/// Files of a study, at their original paths.
struct Sources {
    files: Vec<(Input, Vec<u8>)>,
    bases: Vec<Base>,
}

impl Plan {
    /// Plans the study at `path` into `directory`; `build` is the program's hash. Doing so again changes
    /// nothing.
    ///
    /// # Errors
    /// A study or scene that its reader refuses, a directory that holds another plan, files that cannot be
    /// written.
    pub fn create(path: &Path, directory: &Path, cut: Cut, build: &str) -> Result<Self, StudyError> {
        let (study, sources) = gather(path)?;
        check(&study, &sources.bases)?;
        let shard_size = shard_size(&study, &sources.bases, cut);
        let inputs = sources.files.iter().map(|(input, _)| input.clone()).collect();
        let manifest = manifest(&study, inputs, shard_size, build);
        let bytes = bytes_of(&manifest)?;
        let target = directory.join("manifest.json");
        match fs::read(&target) {
            Ok(there) if there == bytes => {}
            Ok(there) => return Err(occupied(directory, &there, &manifest)),
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                return Err(StudyError::Read { path: target, source });
            }
            Err(_) if holds_something(directory) => {
                let reason = "is not empty and holds no plan: name another directory".to_owned();
                return Err(StudyError::Occupied { path: directory.to_owned(), reason });
            }
            Err(_) => {
                for (input, content) in &sources.files {
                    write(&directory.join(&input.path), content)?;
                }
                let shards = directory.join("shards");
                fs::create_dir_all(&shards).map_err(|source| StudyError::Create { path: shards, source })?;
                // Last: a directory with a manifest has everything else.
                write(&target, &bytes)?;
            }
        }
        Self::load(directory)
    }

    /// Reads a planned study and checks all of it.
    ///
    /// # Errors
    /// No plan, one of another version, inputs that have changed.
    pub fn load(directory: &Path) -> Result<Self, StudyError> {
        let path = directory.join("manifest.json");
        let bytes = read(&path)?;
        let refuse = |reason: String| StudyError::input(&path, reason);
        let manifest: Manifest = serde_json::from_slice(&bytes)
            .map_err(|e| refuse(format!("{e}: expected a manifest of {TOOL}; plan the study again")))?;
        if (manifest.schema, manifest.tool.as_str()) != (SCHEMA, TOOL) {
            let reason = format!(
                "planned by {} (schema {}): this is {TOOL} (schema {SCHEMA}); plan the study again in another \
                 directory",
                manifest.tool, manifest.schema
            );
            return Err(refuse(reason));
        }
        for input in &manifest.inputs {
            let below = Path::new(&input.path).components().all(|part| matches!(part, Component::Normal(_)));
            if !below {
                return Err(refuse(format!("input {:?}: expected a path below the study's directory", input.path)));
            }
            let path = directory.join(&input.path);
            let found = sha256_hex(&read(&path)?);
            if found != input.sha256 {
                let reason = format!("its SHA-256 is {found}, planned {}: it has been changed", input.sha256);
                return Err(StudyError::input(&path, reason));
            }
        }
        let study_input = manifest.inputs.iter().find(|input| input.written.is_empty());
        let study_input = study_input.ok_or_else(|| refuse("the study itself is not among the inputs".to_owned()))?;
        let study = parse(&directory.join(&study_input.path))?;
        let mut bases = Vec::new();
        for written in study.scenarios() {
            let named = written.to_string_lossy();
            let input = manifest.inputs.iter().find(|input| input.written == named);
            let input = input.ok_or_else(|| refuse(format!("the scene {named:?} is not among the inputs")))?;
            let path = directory.join(&input.path);
            let text = String::from_utf8(read(&path)?).map_err(|_| StudyError::input(&path, "not UTF-8"))?;
            bases.push(base(written, &path, &text)?);
        }
        let again = self::manifest(&study, manifest.inputs.clone(), manifest.shard_size, &manifest.build);
        if bytes_of(&again)? != bytes {
            return Err(refuse(
                "does not follow from its inputs: it has been changed; plan the study again".to_owned(),
            ));
        }
        Ok(Self { directory: directory.to_owned(), study, manifest, hash: sha256_hex(&bytes), bases })
    }

    /// Number of shards.
    pub fn shards(&self) -> u32 {
        self.manifest.n_cases.div_ceil(self.manifest.shard_size.max(1)) as u32
    }

    /// Cases of a shard.
    pub fn cases(&self, shard: u32) -> std::ops::Range<u64> {
        let first = u64::from(shard) * self.manifest.shard_size;
        first.min(self.manifest.n_cases)..(first + self.manifest.shard_size).min(self.manifest.n_cases)
    }

    /// Seconds of one core that a shard takes, roughly.
    pub fn shard_s(&self) -> f64 {
        self.manifest.shard_size as f64 * case_s(&self.study, &self.bases)
    }

    /// True if the study runs scenes that all make samples.
    pub fn is_sampled(&self) -> bool {
        let makes = |grade: &Grade| grade.is_sampled() && !matches!(grade, Grade::Budget(_));
        let mut grades = self.bases.iter().flat_map(|base| &base.grades);
        let varied = self.study.axes.iter().any(|axis| sampled::changes_level(&axis.key));
        self.study.level == Level::Samples && grades.all(makes) && !varied
    }

    /// The scene of a case; `None` at correlator level.
    pub fn base(&self, case: &axis::Case) -> Option<&Base> {
        let written = self.study.scenario_of(case)?;
        self.bases.iter().find(|base| base.written == written)
    }

    /// Directory of the shards.
    pub fn shard_directory(&self) -> PathBuf {
        self.directory.join("shards")
    }

    /// True if the program of this build made the plan.
    pub fn is_of(&self, build: &str) -> bool {
        self.manifest.build == build
    }
}

fn manifest(study: &Study, inputs: Vec<Input>, shard_size: u64, build: &str) -> Manifest {
    let entry = |digit: &Digit| {
        let axes = || digit.axes.iter().filter_map(|&number| study.axes.get(number));
        AxisEntry {
            keys: axes().map(|axis| axis.key.clone()).collect(),
            values: axes().map(|axis| axis.values.iter().map(json_of).collect()).collect(),
        }
    };
    let repetition = AxisEntry {
        keys: vec!["repetition".to_owned()],
        values: vec![(0..study.grid.repetitions).map(Json::from).collect()],
    };
    let axes = study.grid.signal.iter().map(entry);
    let axes = axes.chain(std::iter::once(repetition)).chain(study.grid.receiver.iter().map(entry)).collect();
    let keys = study.axes.iter().map(|axis| axis.key.as_str());
    let names = ["case", "seed", "repetition"].into_iter().chain(keys).chain(study.keep.iter().map(String::as_str));
    Manifest {
        schema: SCHEMA,
        tool: TOOL.to_owned(),
        build: build.to_owned(),
        name: study.name.clone(),
        level: study.level.name().to_owned(),
        seed: study.seed,
        inputs,
        axes,
        n_cases: study.grid.cases(),
        shard_size,
        columns: names.map(|name| Column { name: name.to_owned(), unit: unit_of(name).to_owned() }).collect(),
    }
}

fn json_of(value: &Value) -> Json {
    match value {
        Value::Integer(x) => Json::from(*x),
        Value::Float(x) => Json::from(*x),
        Value::Boolean(x) => Json::from(*x),
        other => Json::from(text_of(other)),
    }
}

fn bytes_of(manifest: &Manifest) -> Result<Vec<u8>, StudyError> {
    let mut bytes = serde_json::to_vec_pretty(manifest).map_err(|e| StudyError::Bug(e.to_string()))?;
    bytes.push(b'\n');
    Ok(bytes)
}

fn occupied(directory: &Path, there: &[u8], wanted: &Manifest) -> StudyError {
    let reason = match serde_json::from_slice::<Manifest>(there) {
        Ok(other) if Manifest { build: wanted.build.clone(), ..other.clone() } == *wanted => {
            "holds this study, planned by another build of the program"
        }
        Ok(other) if Manifest { shard_size: wanted.shard_size, ..other.clone() } == *wanted => {
            "holds this study, cut into other shards"
        }
        Ok(_) => "holds another study, or this one before it was changed",
        Err(_) => "holds a manifest that cannot be read",
    };
    let reason = format!("{reason}: name another directory, or start afresh with --fresh");
    StudyError::Occupied { path: directory.to_owned(), reason }
}

fn holds_something(directory: &Path) -> bool {
    // A plan that was killed before its manifest was written has left inputs and temporaries only.
    temporary::sweep(directory);
    let ours = |name: &std::ffi::OsStr| {
        name == "inputs" || name == "shards" || name.to_string_lossy().starts_with(temporary::PREFIX)
    };
    fs::read_dir(directory).is_ok_and(|entries| entries.flatten().any(|entry| !ours(&entry.file_name())))
}

pub(super) fn read(path: &Path) -> Result<Vec<u8>, StudyError> {
    fs::read(path).map_err(|source| StudyError::Read { path: path.to_owned(), source })
}

/// Writes a file that is whole or not there, with the directories above it.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), StudyError> {
    let parent = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(parent).map_err(|source| StudyError::Create { path: parent.to_owned(), source })?;
    // What a run that was killed at this left.
    temporary::sweep(parent);
    let written = Staged::file(parent.join(temporary::name())).and_then(|(making, mut file)| {
        file.write_all(bytes)?;
        file.sync_all()?;
        making.finish(path)
    });
    written.map_err(|source| StudyError::Write { path: path.to_owned(), source })
}

fn parse(path: &Path) -> Result<Study, StudyError> {
    let text = String::from_utf8(read(path)?).map_err(|_| StudyError::input(path, "not UTF-8"))?;
    Ok(Study::parse(&text, &path.display().to_string())?)
}

fn base(written: &Path, path: &Path, text: &str) -> Result<Base, StudyError> {
    // As it is first, so that its own errors have their position.
    let directory = path.parent().unwrap_or(Path::new(".")).to_owned();
    let scenario = Scenario::parse_in(text, &path.display().to_string(), &directory, false)?;
    let document = text.parse().map_err(|e: toml::de::Error| StudyError::input(path, e.message()))?;
    let grades = scenario.front_ends.iter().map(|front_end| front_end.fidelity.grade).collect();
    Ok(Base { written: written.to_owned(), directory, name: scenario.name, document, grades })
}

/// The study and all files that it needs, from where its author has them.
fn gather(path: &Path) -> Result<(Study, Sources), StudyError> {
    let study = parse(path)?;
    let input = |written: &str, path: String, content: Vec<u8>| {
        let input = Input { written: written.to_owned(), path, sha256: sha256_hex(&content) };
        (input, content)
    };
    let mut files = vec![input("", "inputs/study.toml".to_owned(), read(path)?)];
    let home = path.parent().unwrap_or(Path::new("."));
    let mut bases = Vec::new();
    for written in study.scenarios() {
        let path = home.join(written);
        let bytes = read(&path)?;
        let text = String::from_utf8(bytes.clone()).map_err(|_| StudyError::input(&path, "not UTF-8"))?;
        let base = base(written, &path, &text)?;
        // Scenes of one content share their directory; what they refer to lies beside them as at home.
        let directory = format!("inputs/{}", sha256_hex(&bytes).get(..16).unwrap_or_default());
        files.push(input(&written.to_string_lossy(), format!("{directory}/scene.toml"), bytes));
        for named in named_files(&study, &base) {
            let inside = named.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
            // Others the scene's own reader refuses.
            if inside && let Ok(content) = fs::read(base.directory.join(&named)) {
                let target = format!("{directory}/{}", named.to_string_lossy());
                if !files.iter().any(|(input, _)| input.path == target) {
                    files.push(input(&format!("{}: {}", written.display(), named.display()), target, content));
                }
            }
        }
        bases.push(base);
    }
    Ok((study, Sources { files, bases }))
}

/// Files that a scene refers to: keys `file` and `…_file`, its own and those of the axes.
fn named_files(study: &Study, base: &Base) -> Vec<PathBuf> {
    fn is_file(key: &str) -> bool {
        key == "file" || key.ends_with("_file") || key.ends_with(".file")
    }
    fn walk(value: &Value, found: &mut Vec<PathBuf>) {
        match value {
            Value::Table(table) => table.iter().for_each(|(key, value)| match value {
                Value::String(path) if is_file(key) => found.push(PathBuf::from(path)),
                Value::Array(paths) if is_file(key) => {
                    found.extend(paths.iter().filter_map(Value::as_str).map(PathBuf::from));
                }
                other => walk(other, found),
            }),
            Value::Array(items) => items.iter().for_each(|item| walk(item, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    walk(&Value::Table(base.document.clone()), &mut found);
    let axes = study.axes.iter().filter(|axis| is_file(&axis.key)).flat_map(|axis| &axis.values);
    found.extend(axes.filter_map(|value| value.as_str().map(PathBuf::from)));
    found
}

/// Signals that are composed to see whether their files are there; the rest differ in numbers that were read.
const MOST_COMPOSED: u64 = 64;

/// Refuses what a run would refuse later: cell by cell, naming the axis where one value is to blame.
fn check(study: &Study, bases: &[Base]) -> Result<(), StudyError> {
    let grid = &study.grid;
    let signals = grid.groups() / grid.repetitions;
    let every = signals.div_ceil(MOST_COMPOSED) * grid.sharing();
    for cell in 0..grid.cells() {
        let case = grid.case(grid.first_of(cell));
        let values = study.values(&case);
        let Err(reason) = together(study, bases, &case, cell.is_multiple_of(every)) else { continue };
        let blamed = values.iter().find_map(|(axis, value)| {
            let reason = bad_alone(study, bases, axis, value)?;
            let (place, key) = (axis.place.clone(), axis.key.clone());
            Some(StudyError::Axis { place, key, value: text_of(value), reason })
        });
        return Err(blamed.unwrap_or_else(|| StudyError::Case {
            origin: study.origin.clone(),
            case: case.number,
            values: study.values_text(&case),
            reason,
        }));
    }
    Ok(())
}

/// Reason why one value of one axis is refused in the base by itself.
fn bad_alone(study: &Study, bases: &[Base], axis: &Axis, value: &Value) -> Option<String> {
    let read = |base| {
        let document = sampled::patched(base, &[(axis, value)])?;
        sampled::read(study.level, base, &document)
    };
    match study.level {
        Level::Correlator => modelled(study, &[(axis, value)]).err(),
        _ => bases.iter().find_map(|base| read(base).err()),
    }
}

/// Reads the base with all values of a case, and composes its scene if that is asked for.
fn together(study: &Study, bases: &[Base], case: &axis::Case, compose: bool) -> Result<(), String> {
    let values = study.values(case);
    match study.level {
        Level::Correlator => modelled(study, &values).map(|_| ()),
        level => {
            let base = bases.iter().find(|base| Some(base.written.as_path()) == study.scenario_of(case));
            let base = base.ok_or("the study names no scene")?;
            let (scenario, _) = sampled::read(level, base, &sampled::patched(base, &values)?)?;
            if compose { sampled::composed(&scenario, base, None).map(|_| ()) } else { Ok(()) }
        }
    }
}

/// The model of a case.
pub(super) fn modelled(study: &Study, values: &[(&Axis, &Value)]) -> Result<Model, String> {
    let mut document = study.base.clone();
    for (axis, value) in values {
        let table = axis.key.split('.').next().unwrap_or_default();
        if !["signal", "motion", "loop", "measure", "receiver"].contains(&table) {
            return Err(format!(
                "{table:?} is no table of this level: expected signal, motion, loop, measure or receiver"
            ));
        }
        put(&mut document, &axis.key, value)?;
    }
    Model::of(&document, "model").map_err(|e| e.without_place())
}
