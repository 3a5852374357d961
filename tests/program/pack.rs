//! Packs: a matrix that follows from the pack alone, whatever interrupts the run, and refusals by line.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::command::{SHORT, TWIN, code, stderr, twin};

/// The short scene, a second longer and with the usual seed.
fn scene() -> String {
    SHORT.replace("duration_s = 2\nseed = 1", "duration_s = 3")
}

/// Three entries, one of which a limit breaks, and a test that is not said.
const PACK: &str = r#"
name = "small"
title = "A <small> pack"
source = "this test"
licence = "MIT"
[[entry]]
name = "plain"
group = "one & two"
description = "the scene as it is"
scene = "short.toml"
[[entry]]
name = "weak"
group = "one & two"
description = "at 38 dB-Hz"
scene = "short.toml"
set = { power.cn0_dbhz = 38, seed = 2 }
[[entry]]
name = "strict"
group = "limits"
description = "a limit that no receiver keeps"
scene = "short.toml"
set.seed = 3
limits = "limits.toml"
[[not_said]]
name = "moving"
group = "limits"
description = "a moving jammer"
reason = "an emitter has one position"
"#;

/// A directory with the pack in `small/`.
fn workplace() -> tempfile::TempDir {
    let here = tempfile::tempdir().unwrap();
    let pack = here.path().join("small");
    fs::create_dir(&pack).unwrap();
    fs::write(pack.join("pack.toml"), PACK).unwrap();
    fs::write(pack.join("short.toml"), scene()).unwrap();
    fs::write(pack.join("limits.toml"), "\"satellites.used\" = { min = 40 }\n").unwrap();
    here
}

/// Every file below a directory but `times.csv`, which holds times of the machine.
fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(root: &Path, path: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(path).unwrap().map(Result::unwrap) {
            if entry.file_type().unwrap().is_dir() {
                walk(root, &entry.path(), found);
            } else {
                let name = entry.path().strip_prefix(root).unwrap().display().to_string();
                found.insert(name, fs::read(entry.path()).unwrap());
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(root, root, &mut found);
    found.remove("times.csv");
    found
}

/// Names of the files whose bytes differ, or that are on one side alone.
fn differences(one: &BTreeMap<String, Vec<u8>>, other: &BTreeMap<String, Vec<u8>>) -> Vec<String> {
    let names = one.keys().chain(other.keys());
    let mut differ: Vec<String> = names.filter(|name| one.get(*name) != other.get(*name)).cloned().collect();
    differ.dedup();
    differ
}

#[test]
fn a_matrix_has_each_entry_once_as_expected_or_not_and_the_exit_code_says_so() {
    let here = workplace();
    let ended = twin(&["pack", "run", "small", "--out", "out", "--junit", "ci.xml"], here.path());
    assert_eq!(code(&ended), 3, "{}", stderr(&ended));
    assert!(stderr(&ended).contains("1 of 3 entries does not end as expected"), "{}", stderr(&ended));
    let out = here.path().join("out");
    let mut table = csv::Reader::from_path(out.join("matrix.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let cells = |at: usize| rows.iter().map(|row| row[at].to_owned()).collect::<Vec<_>>();
    assert_eq!(cells(1), ["plain", "weak", "strict", "moving"]);
    assert_eq!(cells(3), ["yes", "yes", "no", ""]);
    assert!(rows[2][14].contains("satellites.used"), "{:?}", rows[2]);
    assert_eq!((&rows[3][2], &rows[3][14]), ("not said", "an emitter has one position"));
    for file in ["matrix.html", "matrix.pdf", "times.csv", "entries/plain/verdict.csv", "entries/plain/summary.json"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    assert!(!out.join("entries/plain/truth").exists());
    let xml = fs::read_to_string(here.path().join("ci.xml")).unwrap();
    assert_eq!(xml, fs::read_to_string(out.join("junit.xml")).unwrap());
    junit(&xml);

    // An expectation is none of the computation: the limit's figure is excused, and nothing runs again.
    let excused = PACK.replace(
        "limits = \"limits.toml\"\n",
        "limits = \"limits.toml\"\n[[entry.may_fail]]\nfigure = \"satellites.*\"\nreason = \"no sky has 40\"\n",
    );
    fs::write(here.path().join("small/pack.toml"), excused).unwrap();
    let again = twin(&["pack", "run", "small", "--out", "out", "--json"], here.path());
    assert_eq!(code(&again), 0, "{}", stderr(&again));
    let object: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!((&object["computed"], &object["matrix"]["unexpected"]), (&0.into(), &0.into()));
    // A part of the pack, by the entry's name or its group's.
    let part = twin(&["pack", "run", "small", "--out", "out", "--only", "one*/*", "--json"], here.path());
    let object: serde_json::Value = serde_json::from_slice(&part.stdout).unwrap();
    assert_eq!(object["matrix"]["entries"].as_array().map(Vec::len), Some(2));
}

/// Well-formed elements, and counts that are those of their children.
fn junit(xml: &str) {
    let document = roxmltree::Document::parse(xml).unwrap();
    let root = document.root_element();
    assert_eq!((root.tag_name().name(), root.attribute("name")), ("testsuites", Some("small")));
    let counts = |node: roxmltree::Node<'_, '_>| {
        ["tests", "failures", "errors", "skipped"].map(|name| node.attribute(name).unwrap().parse::<usize>().unwrap())
    };
    assert_eq!(counts(root), [4, 1, 0, 1]);
    let found = |node: roxmltree::Node<'_, '_>, tag: &str| node.descendants().filter(|n| n.has_tag_name(tag)).count();
    let suites: Vec<_> = root.children().filter(roxmltree::Node::is_element).collect();
    assert_eq!(
        suites.iter().map(|suite| suite.attribute("name").unwrap()).collect::<Vec<_>>(),
        ["one & two", "limits"]
    );
    for suite in suites {
        let cases = ["testcase", "failure", "error", "skipped"].map(|tag| found(suite, tag));
        assert_eq!(counts(suite), cases, "{:?}", suite.attribute("name"));
    }
}

#[test]
fn threads_change_no_byte_and_a_killed_run_goes_on_to_the_same_bytes() {
    let here = workplace();
    let run = |out: &str, threads: &str| {
        let ended = twin(&["pack", "run", "small", "--out", out, "--threads", threads, "--keep"], here.path());
        assert_eq!(code(&ended), 3, "{}", stderr(&ended));
        files(&here.path().join(out))
    };
    let whole = run("one", "1");
    assert!(whole.len() > 20, "{:?}", whole.keys());
    assert_eq!(differences(&whole, &run("two", "2")), [""; 0]);

    let arguments = ["pack", "run", "small", "--out", "three", "--threads", "1", "--keep"];
    let mut child = Command::new(TWIN).args(arguments).current_dir(here.path()).stdout(Stdio::null()).spawn().unwrap();
    // One entry is whole by then and another is being made.
    let (entries, begun) = (here.path().join("three/entries"), Instant::now());
    let has = |name: &str| entries.join(name).exists();
    while !(has("plain") && (has(".weak.part") || has("weak"))) {
        assert!(begun.elapsed() < Duration::from_secs(120), "no entry was finished");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let made = fs::metadata(entries.join("plain/entry.json")).unwrap().modified().unwrap();
    assert_eq!(differences(&whole, &run("three", "1")), [""; 0]);
    // The finished entry is the one that was there.
    assert_eq!(fs::metadata(entries.join("plain/entry.json")).unwrap().modified().unwrap(), made);

    // Another scene under the same name is computed again, and its record has other bytes.
    fs::write(here.path().join("small/short.toml"), scene().replace("45.0", "44.0")).unwrap();
    let other = run("three", "1");
    assert!(differences(&whole, &other).contains(&"entries/plain/entry.json".to_owned()));
}

#[test]
fn what_is_no_pack_is_refused_before_anything_runs() {
    let here = workplace();
    let refused = |arguments: &[&str], expected: i32, part: &str| {
        let ended = twin(&[&["pack", "run"], arguments].concat(), here.path());
        let message = stderr(&ended);
        assert!(code(&ended) == expected && message.contains(part), "{arguments:?}: {}: {message}", code(&ended));
    };
    refused(&["nosuch"], 65, "nosuch/pack.toml: no such file");
    refused(&["dynamic"], 65, "`gnss-twin scenes --pack dynamics --out dynamics` copies the pack");
    refused(&["small", "--only", "x*"], 2, "--only x*: expected a pattern of plain, weak, strict");
    fs::create_dir(here.path().join("mine")).unwrap();
    fs::write(here.path().join("mine/thesis"), "").unwrap();
    refused(&["small", "--out", "mine"], 73, "mine exists and holds no results of a pack");
    fs::create_dir(here.path().join("other")).unwrap();
    fs::write(here.path().join("other/pack.json"), "{\"pack\":\"large\"}\n").unwrap();
    refused(&["small", "--out", "other"], 73, "other holds results of another pack");
    let manifest = |text: &str| fs::write(here.path().join("small/pack.toml"), text).unwrap();
    let cases = [
        (PACK.replace("licence", "license"), "small/pack.toml:5:1: unknown key 'license': did you mean 'licence'?"),
        (PACK.replace("38, seed", "380, seed"), "small/pack.toml:16:"),
        (PACK.replace("\"short.toml\"\nset.seed", "\"shrt.toml\"\nset.seed"), "small/pack.toml:21:"),
        (PACK.replace("\"weak\"", "\"plain\""), "entry[2].name = \"plain\": expected each name once"),
        // Values that only do not fit together.
        (PACK.replace("set.seed = 3", "set.duration_s = 1e5"), "small/pack.toml:18:8: strict: "),
    ];
    for (text, part) in cases {
        manifest(&text);
        refused(&["small", "--out", "out"], 65, part);
    }
    manifest(PACK);
    fs::write(here.path().join("small/limits.toml"), "\"satellites.usd\" = { min = 4 }\n").unwrap();
    refused(&["small", "--out", "out"], 65, "limits: ");
    assert!(!here.path().join("out").exists());
}

#[test]
fn shipped_packs_are_copied_with_their_files_and_read() {
    let here = tempfile::tempdir().unwrap();
    let listed = twin(&["scenes"], here.path());
    let listed = String::from_utf8(listed.stdout).unwrap();
    let (_, packs) = listed.split_once("\nPacks (").unwrap();
    let names: Vec<&str> = packs.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.contains(&"dynamics"), "{listed}");
    for name in names {
        let copied = twin(&["scenes", "--pack", name, "--out", name], here.path());
        assert_eq!(code(&copied), 0, "{}", stderr(&copied));
        // Every scene is read before the pattern is looked at.
        let read = twin(&["pack", "run", name, "--only", "no such entry"], here.path());
        assert_eq!(code(&read), 2, "{name}: {}", stderr(&read));
    }
    let unknown = twin(&["scenes", "--pack", "dynamic"], here.path());
    assert!(code(&unknown) == 2 && stderr(&unknown).contains("did you mean dynamics?"), "{}", stderr(&unknown));
}
