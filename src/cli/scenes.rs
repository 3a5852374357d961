//! `scenes` and `init`: the scenes and packs that come with the program, and a commented scene to begin with.
//!
//! Scenes are copied with the files that they name and with the schema that their first line names, so that a
//! copy runs and an editor knows its keys wherever it lies. A pack is copied with its own files and the
//! shipped scenes that its manifest names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use include_dir::{Dir, File, include_dir};

use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::pack::MANIFEST;
use crate::cli::scenario;
use crate::cli::schema;
use crate::cli::staging::Staging;
use gnss::place::nearest;

static SHIPPED: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/scenarios");
static PACKS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/packs");
/// The scene of [`init`]. Lines that begin with `#` and a letter or a bracket are TOML to be uncommented.
const COMMENTED: &str = include_str!("../../assets/commented_scene.toml");
/// The name of the schema beside a copy.
const SCHEMA: &str = "scenario.schema.json";
/// Directive with which a scene names its schema.
const DIRECTIVE: &str = "#:schema ";

/// Lists all scenes, or copies some.
pub fn execute(arguments: &args::Scenes) -> Result<(), CliError> {
    if let Some(name) = &arguments.pack {
        return write_all(&arguments.out, pack(name)?, arguments.force);
    }
    let scenes = scenes();
    if arguments.names.is_empty() {
        let width = scenes.keys().map(String::len).max().unwrap_or(0);
        let lines = scenes.iter().map(|(name, file)| format!("{name:width$}  {}\n", about(text(file))));
        let packs = packs();
        let packs = packs.iter().map(|(name, dir)| format!("{name:width$}  {}\n", title(manifest_of(dir))));
        let packs: String = packs.collect();
        return scenario::print(&format!(
            "{}\nPacks (gnss-twin scenes --pack NAME --out DIR copies one):\n{packs}",
            lines.collect::<String>()
        ));
    }
    let mut copies: BTreeMap<PathBuf, Vec<u8>> = BTreeMap::new();
    for wanted in &arguments.names {
        let name = wanted.strip_suffix(".toml").unwrap_or(wanted);
        let Some(scene) = scenes.get(name) else {
            let names: Vec<&str> = scenes.keys().map(String::as_str).collect();
            let hint = nearest(name, &names).map_or(String::new(), |near| format!(" (did you mean {near}?)"));
            return Err(CliError::usage(format!("no scene {wanted:?}{hint}: expected one of {}", names.join(", "))));
        };
        copies.extend(with_its_files(scene));
    }
    write_all(&arguments.out, copies, arguments.force)
}

/// The shipped packs by name.
fn packs() -> BTreeMap<&'static str, &'static Dir<'static>> {
    let name = |dir: &'static Dir<'static>| Some((dir.path().to_str()?, dir));
    PACKS.dirs().filter_map(name).collect()
}

fn manifest_of(dir: &'static Dir<'static>) -> &'static str {
    dir.get_file(dir.path().join(MANIFEST)).map_or("", text)
}

/// The title in a manifest.
fn title(manifest: &str) -> String {
    let table: toml::Table = toml::from_str(manifest).unwrap_or_default();
    table.get("title").and_then(toml::Value::as_str).unwrap_or_default().to_owned()
}

/// Files of a shipped pack: its own, and the shipped scenes that its manifest names and it has not itself.
fn pack(wanted: &str) -> Result<BTreeMap<PathBuf, Vec<u8>>, CliError> {
    let packs = packs();
    let Some(dir) = packs.get(wanted) else {
        let names: Vec<&str> = packs.keys().copied().collect();
        let hint = nearest(wanted, &names).map_or(String::new(), |near| format!(" (did you mean {near}?)"));
        return Err(CliError::usage(format!("no pack {wanted:?}{hint}: expected one of {}", names.join(", "))));
    };
    let manifest = manifest_of(dir);
    let named = |file: &&File<'static>| {
        let name = file.path().file_name().map(|name| name.to_string_lossy().into_owned());
        name.is_some_and(|name| manifest.contains(&format!("scene = \"{name}\"")))
    };
    let mut copies: BTreeMap<PathBuf, Vec<u8>> =
        scenes().values().copied().filter(named).flat_map(with_its_files).collect();
    let own = |file: &'static File<'static>| {
        let is_scene = text(file).starts_with(DIRECTIVE);
        let bytes = if is_scene { with_its_schema(text(file)) } else { file.contents().to_vec() };
        Some((PathBuf::from(file.path().file_name()?), bytes))
    };
    copies.extend(dir.files().filter_map(own));
    copies.entry(SCHEMA.into()).or_insert_with(|| schema::scenario().into());
    Ok(copies)
}

/// Shipped pack that a directory without a manifest may mean, in words.
pub fn pack_hint(directory: &Path) -> Option<String> {
    let name = directory.file_name()?.to_str()?;
    let packs = packs();
    let names: Vec<&str> = packs.keys().copied().collect();
    let near = if packs.contains_key(name) { name.to_owned() } else { nearest(name, &names)? };
    Some(format!("`gnss-twin scenes --pack {near} --out {near}` copies the pack {near} that comes with the program"))
}

/// Bundled scene that a path without a file may mean, in words: the one of that name, or the most similar
/// one.
pub fn hint(path: &Path) -> Option<String> {
    let scenes = scenes();
    let names: Vec<&str> = scenes.keys().map(String::as_str).collect();
    let file = Path::new(path.file_name()?);
    let name = file.to_str()?.trim_end_matches(".toml");
    // A scene of a directory below is called by both names.
    let last = |whole: &&&str| whole.rsplit('/').next() == Some(name);
    let scene = names.iter().find(last).map(|whole| (*whole).to_owned()).or_else(|| nearest(name, &names))?;
    let own = scene.rsplit('/').next().unwrap_or(&scene);
    let copies = format!("`gnss-twin scenes {scene}` copies it to {own}.toml");
    Some(if own == name {
        format!("the program brings a scene of that name, and {copies}")
    } else {
        format!("did you mean the bundled scene {scene}? {copies}")
    })
}

/// Writes the commented scene, and the schema beside it.
pub fn init(arguments: &args::Init) -> Result<(), CliError> {
    let name = arguments.path.file_name().map(PathBuf::from);
    let name = name.ok_or_else(|| CliError::usage(format!("{}: expected a file", arguments.path.display())))?;
    let directory = arguments.path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let copies = BTreeMap::from([(name, COMMENTED.as_bytes().to_vec()), (SCHEMA.into(), schema::scenario().into())]);
    write_all(directory.unwrap_or(Path::new(".")), copies, arguments.force)
}

/// Writes files into a directory; the schema is the program's own and may be replaced.
fn write_all(directory: &Path, copies: BTreeMap<PathBuf, Vec<u8>>, force: bool) -> Result<(), CliError> {
    let is_there = |name: &&PathBuf| name.as_path() != Path::new(SCHEMA) && directory.join(name).exists();
    if let Some(name) = copies.keys().find(is_there).filter(|_| !force) {
        let path = directory.join(name);
        return Err(CliError::refused_output(format!("{} is there: --force replaces it", path.display())));
    }
    fs::create_dir_all(directory).map_err(|error| CliError::create(directory.display(), &error))?;
    let mut report = String::new();
    for (name, bytes) in copies {
        let path = directory.join(name);
        let staging = Staging::file(&path)?;
        staging.write(&bytes)?;
        staging.commit()?;
        report += &format!("{}\n", path.display());
    }
    scenario::print(&report)
}

/// The shipped scenes by name; `extremes/leo` lies in a directory below.
fn scenes() -> BTreeMap<String, &'static File<'static>> {
    let below = SHIPPED.dirs().flat_map(Dir::files);
    let scene = |file: &'static File<'static>| {
        let is_scene = text(file).lines().any(|line| line.trim_start().starts_with("name"));
        let name = file.path().to_str()?.strip_suffix(".toml").filter(|_| is_scene)?;
        Some((name.to_owned(), file))
    };
    SHIPPED.files().chain(below).filter_map(scene).collect()
}

fn text(file: &'static File<'static>) -> &'static str {
    file.contents_utf8().unwrap_or("")
}

/// The first sentence of the comment that is for people.
fn about(text: &str) -> String {
    let comments = text.lines().map_while(|line| line.strip_prefix('#'));
    let words: Vec<&str> = comments.filter(|line| !line.starts_with(':')).flat_map(str::split_whitespace).collect();
    let last = words.iter().position(|word| word.ends_with('.')).map_or(words.len(), |last| last + 1);
    words.into_iter().take(last).collect::<Vec<_>>().join(" ")
}

/// A scene by its file's name, the files that it names and the schema.
fn with_its_files(scene: &'static File<'static>) -> Vec<(PathBuf, Vec<u8>)> {
    let name = |path: &Path| path.file_name().map(PathBuf::from).unwrap_or_default();
    let beside = scene.path().parent().and_then(|parent| SHIPPED.get_dir(parent)).map_or(&SHIPPED, |found| found);
    let named = beside.files().filter(|file| file.path() != scene.path()).filter(|file| {
        let quoted = format!("\"{}\"", name(file.path()).display());
        text(scene).contains(&quoted)
    });
    let mut copies: Vec<_> = named.map(|file| (name(file.path()), file.contents().to_vec())).collect();
    copies.push((name(scene.path()), with_its_schema(text(scene))));
    copies.push((SCHEMA.into(), schema::scenario().into()));
    copies
}

/// A scene whose first line names the schema beside it.
fn with_its_schema(text: &str) -> Vec<u8> {
    let own = text.lines().map(|line| match line.starts_with(DIRECTIVE) {
        true => format!("{DIRECTIVE}{SCHEMA}\n"),
        false => format!("{line}\n"),
    });
    own.collect::<String>().into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use generator::scenario::Scenario;

    fn copied(names: &[&str], directory: &Path) -> Result<(), CliError> {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        execute(&args::Scenes { names, pack: None, out: directory.to_owned(), force: false })
    }

    #[test]
    fn every_scene_says_what_it_is_and_names_its_schema() {
        let scenes = scenes();
        assert!(scenes.len() > 20 && scenes.contains_key("extremes/leo") && !scenes.contains_key("limits"));
        for (name, file) in scenes {
            assert!(!about(text(file)).is_empty(), "{name}");
            let up = if name.contains('/') { "../.." } else { ".." };
            let first = text(file).lines().next().unwrap();
            assert_eq!(first, format!("{DIRECTIVE}{up}/assets/{SCHEMA}"), "{name}");
        }
    }

    #[test]
    fn copies_come_with_the_files_that_they_name_and_are_not_written_over() {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().join("mine");
        copied(&["ionex", "precise.toml", "extremes/leo", "trajectory_file"], &out).unwrap();
        let mut found: Vec<_> = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        found.sort();
        let expected = [
            "igrg3380.10i.gz",
            "igs15904_05h_12h.sp3.gz",
            "ionex.toml",
            "leo.toml",
            "precise.toml",
            "ride.csv",
            SCHEMA,
            "trajectory_file.toml",
        ];
        assert_eq!(found, expected);
        for scene in ["ionex.toml", "leo.toml", "precise.toml", "trajectory_file.toml"] {
            let text = fs::read_to_string(out.join(scene)).unwrap();
            assert!(text.starts_with("#:schema scenario.schema.json\n") && Scenario::parse(&text, scene).is_ok());
        }
        let again = copied(&["ionex"], &out).unwrap_err();
        assert!(format!("{again:?}").contains("--force"), "{again:?}");
        let unknown = copied(&["jamed"], &out).unwrap_err();
        assert!(format!("{unknown:?}").contains("did you mean jammed?"), "{unknown:?}");
    }

    #[test]
    fn a_path_without_a_file_is_told_with_the_bundled_scene_that_was_meant() {
        let of = |path: &str| hint(Path::new(path));
        let own = "the program brings a scene of that name, and `gnss-twin scenes static` copies it to static.toml";
        assert_eq!((of("static").as_deref(), of("scenarios/static.toml").as_deref()), (Some(own), Some(own)));
        let near = of("scenarios/statc.toml").unwrap();
        assert!(near.starts_with("did you mean the bundled scene static? `gnss-twin scenes static` copies"), "{near}");
        assert!(of("mine/leo.toml").unwrap().contains("`gnss-twin scenes extremes/leo` copies it to leo.toml"));
        assert_eq!((of("xyzzy.toml"), of("")), (None, None));
    }

    #[test]
    fn the_commented_scene_is_one_with_its_comments_and_without() {
        assert!(Scenario::parse(COMMENTED, "commented").is_ok());
        let switched = |line: &str| {
            let rest = line.strip_prefix('#').filter(|rest| rest.starts_with(|c: char| c.is_alphabetic() || c == '['));
            rest.unwrap_or(line).to_owned() + "\n"
        };
        let whole: String = COMMENTED.lines().map(switched).collect();
        assert_ne!(whole, COMMENTED);
        if let Err(error) = Scenario::parse(&whole, "uncommented") {
            panic!("{error}\n{whole}");
        }
    }
}
