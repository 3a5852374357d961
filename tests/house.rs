//! The house: the order of rooms, the length of files and comments, the prose of doc comments, and panics, as
//! the sources have them.
//!
//! A room is a file or folder of a crate in `src`. [`ORDER`] lists the rooms of each folder from the ground
//! up, and a room imports only rooms before it. The checks read text: comments, strings and test modules are
//! cut away, then every path that begins with `crate`, `super` or `self` is resolved. Which crate may use
//! which is in their manifests, and the compiler holds it. Limits: a path that a macro builds is not seen,
//! and neither is an item that is used through a value.

#[path = "house/order.rs"]
mod order;
#[path = "house/prose.rs"]
mod prose;
#[path = "house/source.rs"]
mod source;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use order::{EXCEPTIONS, ORDER, arrows};
use prose::Rule;
use source::{Source, code_too_wide, comments_too_wide, lines_of_code, unwraps};

/// Lines of code that a file may have: comments, blank lines and tests not counted.
const MOST_LINES: usize = 400;
/// Files that are longer. The list may only shrink.
const LONG: &[&str] = &[];
/// Columns that a line of comment may have.
const MOST_COLUMNS: usize = 110;
/// Columns that a line of code may have: rustfmt keeps them but for long strings and tables.
const MOST_CODE_COLUMNS: usize = 120;

#[test]
fn a_room_imports_only_rooms_before_it() {
    let sources = Source::all("src");
    assert!(sources.len() > 200, "{} sources found", sources.len());
    let found: BTreeSet<String> = sources.iter().flat_map(|source| arrows(source, ORDER)).collect();
    let known: BTreeSet<String> = EXCEPTIONS.iter().map(|line| (*line).to_owned()).collect();
    let new: Vec<&String> = found.difference(&known).collect();
    assert!(new.is_empty(), "imports against the order of tests/house/order.rs:\n{new:#?}");
    let gone: Vec<&String> = known.difference(&found).collect();
    assert!(gone.is_empty(), "these exceptions are gone; remove them from tests/house/order.rs:\n{gone:#?}");
}

#[test]
fn no_world_depends_on_another() {
    let worlds = ["generator", "receiver", "analysis"];
    for world in worlds {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/{world}/Cargo.toml"));
        let manifest = fs::read_to_string(path).unwrap();
        let named = |other: &str| manifest.contains(&format!("gnss-twin-{other}"));
        assert!(named("gnss"), "{world}: a manifest without the crate that all use");
        let above = worlds.into_iter().filter(|other| *other != world).chain(["twin", "live", "study"]);
        let seen: Vec<&str> = above.filter(|other| named(other)).collect();
        assert!(seen.is_empty(), "src/{world}/Cargo.toml names {seen:?}, also if only for tests");
    }
}

#[test]
fn every_room_is_in_the_table_once() {
    let sources = Source::all("src");
    for (folder, groups) in ORDER {
        let rooms: Vec<&str> = groups.iter().flat_map(|group| group.iter().copied()).collect();
        let once: BTreeSet<&str> = rooms.iter().copied().collect();
        assert_eq!(once.len(), rooms.len(), "{folder}: a room is listed twice");
        let there = source::rooms(&sources, folder);
        let missing: Vec<&String> = there.iter().filter(|room| !once.contains(room.as_str())).collect();
        assert!(missing.is_empty(), "src/{folder}: not in the table of tests/house/order.rs: {missing:?}");
    }
}

#[test]
fn files_of_logic_are_short() {
    let all = Source::all("src");
    let long = |source: &&Source| lines_of_code(&source.code) > MOST_LINES;
    let long: Vec<&str> = all.iter().filter(long).map(|source| source.path.as_str()).collect();
    let new: Vec<_> = long.iter().filter(|path| !LONG.contains(path)).collect();
    assert!(new.is_empty(), "more than {MOST_LINES} lines of code: {new:?}");
    let gone: Vec<_> = LONG.iter().filter(|path| !long.contains(path)).collect();
    assert!(gone.is_empty(), "short by now; remove them from LONG: {gone:?}");
}

#[test]
fn comments_are_wrapped() {
    let mut wide = Vec::new();
    for folder in ["src", "tests", "benches", "examples", "fuzz", "python"] {
        for (path, text) in source::files(folder) {
            wide.extend(comments_too_wide(&text, MOST_COLUMNS).into_iter().map(|line| format!("{path}:{line}")));
        }
    }
    assert!(wide.is_empty(), "{} comments beyond {MOST_COLUMNS} columns:\n{}", wide.len(), wide.join("\n"));
}

#[test]
fn doc_comments_begin_with_their_noun() {
    hold(Rule::Noun);
}

#[test]
fn doc_comments_do_not_continue_another() {
    hold(Rule::Sentence);
}

#[test]
fn doc_comments_use_the_words_of_the_field() {
    hold(Rule::Word);
}

#[test]
fn the_program_speaks_in_the_words_of_the_field() {
    let all = Source::all("src");
    let is_test = |path: &str| !all.iter().any(|source| source.path == path);
    let sources = source::files("src").into_iter().filter(|(path, _)| !is_test(path));
    keep(Rule::Word, sources.map(|(path, text)| (path, prose::messages(&text))));
}

#[test]
fn documents_use_the_words_of_the_field() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "REFERENCE.md"]
        .map(|page| (page.to_owned(), fs::read_to_string(root.join(page)).unwrap()));
    let book = source::files_of("book/src", "md");
    assert!(book.len() > 20, "{} pages of the book found", book.len());
    let reports = source::files_of("reports", "md");
    // A package of the crate comes without them.
    let is_repository = root.join("reports/evidence.csv").exists();
    assert!(reports.len() > 20 || !is_repository, "{} pages of reports found", reports.len());
    let scenes = ["scenarios", "studies"].into_iter().flat_map(|folder| source::files_of(folder, "toml"));
    let documents = pages.into_iter().chain(book).chain(reports).chain(scenes);
    keep(Rule::Word, documents.map(|(path, text)| (path, prose::paragraphs(&text))));
}

/// Panics where a doc comment or a docstring of the Python module breaks a rule.
fn hold(rule: Rule) {
    let sources = ["src", "python", "benches", "examples", "fuzz"].into_iter().flat_map(source::files);
    let stubs = source::files_of("python", "pyi").into_iter().chain(source::files_of("python", "py"));
    let docs = sources.map(|(path, text)| (path, prose::docs(&text)));
    keep(rule, docs.chain(stubs.map(|(path, text)| (path, prose::docstrings(&text)))));
}

/// Panics where a text of a file breaks a rule.
fn keep(rule: Rule, files: impl Iterator<Item = (String, Vec<prose::Doc>)>) {
    let mut found = Vec::new();
    for (path, docs) in files {
        for doc in docs {
            let faults = prose::faults(&path, &doc, rule).into_iter();
            found.extend(faults.map(|fault| format!("{path}:{}: {fault}", doc.line)));
        }
    }
    assert!(found.is_empty(), "{} texts against {rule:?} of prose.rs:\n{}", found.len(), found.join("\n"));
}

#[test]
fn lines_of_code_fit_the_columns() {
    let mut wide = Vec::new();
    for folder in ["src", "benches", "examples", "python"] {
        for (path, text) in source::files(folder) {
            wide.extend(code_too_wide(&text, MOST_CODE_COLUMNS).into_iter().map(|line| format!("{path}:{line}")));
        }
    }
    assert!(wide.is_empty(), "{} lines beyond {MOST_CODE_COLUMNS} columns:\n{}", wide.len(), wide.join("\n"));
}

#[test]
fn nothing_is_unwrapped_outside_tests() {
    let all = Source::all("src");
    let found: Vec<String> = all
        .iter()
        .flat_map(|source| unwraps(&source.code).into_iter().map(|at| format!("{}:{at}", source.path)))
        .collect();
    assert!(found.is_empty(), "unwrap() outside tests: {found:?}");
}

/// The checks themselves, on sources in which the fault is planted.
mod planted {
    use super::*;

    const TABLE: &[(&str, &[&[&str]])] = &[
        ("gnss", &[&["time"], &["orbit"], &["record"]]),
        ("receiver", &[&["format"], &["acquire", "track"]]),
        ("receiver/track", &[&["lock"], &["loops"]]),
    ];

    fn arrows_of(path: &str, text: &str) -> Vec<String> {
        arrows(&Source::new(path, text), TABLE)
    }

    #[test]
    fn an_import_upward_is_found_however_it_is_written() {
        let upward = ["gnss/time: gnss/record"];
        for text in [
            "use crate::record::Fix;",
            "use super::record::Fix;",
            "use super::{orbit::{self, Kepler}, record::Fix};",
            "pub use crate::{\n    record,\n};",
            "fn f() -> crate::record::Fix { super::record::fix(\"}\") }",
            "mod inner { use super::super::record::Fix; }",
        ] {
            let found = arrows_of("src/gnss/time.rs", text);
            assert!(found.iter().any(|arrow| arrow == upward[0]), "{text}: {found:?}");
        }
        assert_eq!(arrows_of("src/gnss/time/leap.rs", "use super::super::record;"), upward);
        let inside = arrows_of("src/receiver/track/lock.rs", "use crate::track::loops::Pll;");
        assert_eq!(inside, ["receiver/track/lock: receiver/track/loops"]);
    }

    #[test]
    fn an_import_of_a_neighbour_of_the_same_level_or_of_the_root_is_found() {
        let neighbour = arrows_of("src/receiver/acquire/search.rs", "use crate::track::Channel;");
        assert_eq!(neighbour, ["receiver/acquire: receiver/track"]);
        assert_eq!(arrows_of("src/gnss/record.rs", "use crate::Epoch;"), ["gnss/record: gnss/Epoch"]);
    }

    #[test]
    fn an_import_downward_and_words_that_are_no_import_are_none() {
        for text in [
            "use crate::time::Epoch;",
            "use super::time;",
            "// use crate::record::Fix;",
            "/// [`crate::record::Fix`]",
            "const TEXT: &str = \"crate::record::Fix\";",
            "const RAW: &str = r#\"\"crate::record::Fix\"#;",
            "const QUOTE: char = '\"'; // crate::record::Fix",
            "#[cfg(test)]\nmod tests {\n    use crate::record::Fix;\n}\n",
            "use std::fmt;",
        ] {
            let found = arrows_of("src/gnss/orbit.rs", text);
            assert!(found.is_empty(), "{text}: {found:?}");
        }
        assert!(arrows_of("src/gnss/lib.rs", "pub use record::Fix;\nuse crate::orbit;").is_empty());
        assert!(
            arrows_of("src/receiver/track/loops.rs", "use gnss::record::Fix;\nuse super::super::format;").is_empty()
        );
    }

    #[test]
    fn code_after_a_test_module_is_still_read() {
        let text = "#[cfg(test)]\nmod tests {\n    fn f() { let _ = \"}\"; }\n}\nuse super::record;\n";
        assert_eq!(arrows_of("src/gnss/time.rs", text), ["gnss/time: gnss/record"]);
    }

    #[test]
    fn wide_comments_and_wide_lines_of_code_are_found_apart() {
        let columns = |count: usize| "é".repeat(count);
        let text = format!("    // {}\n/// {}\nlet x = \"{}\";\n", columns(103), columns(107), columns(200));
        assert_eq!(comments_too_wide(&text, 110), [2]);
        assert_eq!(code_too_wide(&text, 120), [3]);
        assert_eq!(comments_too_wide(&format!("//! <https://{}>", columns(120)), 110), Vec::<usize>::new());
    }

    #[test]
    fn lines_of_code_are_counted_without_comments_blanks_and_tests() {
        let source = Source::new(
            "src/a.rs",
            "//! Doc.\n\nfn f() {}\n// no\nfn g() {}\n#[cfg(test)]\nmod tests {\n fn h() {}\n}\n",
        );
        assert_eq!(lines_of_code(&source.code), 2);
    }

    #[test]
    fn an_unwrap_is_found_where_it_is_code() {
        let text = "fn f() { x.unwrap(); }\n// .unwrap()\nfn g() { y\n  .unwrap (); \".unwrap()\"; z.unwrap_or(1) }\n";
        assert_eq!(unwraps(&Source::new("src/a.rs", text).code), [1, 4]);
    }

    #[test]
    fn a_word_that_is_not_ours_is_found_in_strings_and_documents() {
        let source = "fn f() { say(\"it goes \\\n    anew\", \"{place} {of_it}\", r#\"a place\"#, \"place\"); }\n// \"a place\"\n\
                      #[cfg(test)]\nmod tests { const A: &str = \"a place\"; }\n";
        let found = |docs: Vec<prose::Doc>| -> Vec<(usize, usize)> {
            docs.iter().map(|doc| (doc.line, prose::faults("src/a.rs", doc, Rule::Word).len())).collect()
        };
        assert_eq!(found(prose::messages(source)), [(1, 1), (2, 0), (2, 1)]);
        let page = "# Head\n\nIt goes\nanew.\n```console\n$ anew\n```\n\nThe key `place`.\n";
        let faults: usize = found(prose::paragraphs(page)).iter().map(|(_, faults)| faults).sum();
        assert_eq!(faults, 1);
        assert_eq!(found(prose::paragraphs(page))[1], (3, 1));
    }

    fn faults_of(text: &str, rule: Rule) -> Vec<String> {
        prose::docs(text).iter().flat_map(|doc| prose::faults("src/a.rs", doc, rule)).collect()
    }

    #[test]
    fn an_opening_that_is_no_noun_is_found_at_the_beginning_alone() {
        for text in [
            "/// Of the orbit.\nx: f64,",
            "    /// … and its rate.",
            "//! What it does.\n//!\n",
            "/// The same.",
            "/// Reads it.\n///\n/// # Errors\n/// Those of the reader.",
        ] {
            assert_eq!(faults_of(text, Rule::Noun).len(), 1, "{text}");
        }
        for text in [
            "// Of no item.",
            "/// Rate\n/// of the clock.",
            "/// Offset of it.",
            "/// Thatch.",
            "/// As-is.",
            "//// Of",
            "/// Reads it.\n///\n/// # Errors\n/// Errors of the reader.",
        ] {
            assert!(faults_of(text, Rule::Noun).is_empty(), "{text}");
        }
        let stub = "def f(self):\n    \"\"\"What it does.\"\"\"\n    \"\"\"Rate of the clock.\"\"\"\n";
        let docs = prose::docstrings(stub);
        let faults: Vec<usize> = docs.iter().map(|doc| prose::faults("a.pyi", doc, Rule::Noun).len()).collect();
        assert_eq!(faults, [1, 0]);
        assert_eq!(faults_of("/// In metres.\nx: f64,\n/// From north.\ny: f64,", Rule::Sentence), ["'In'", "'From'"]);
    }

    #[test]
    fn a_word_that_is_not_ours_is_found_across_lines_but_not_in_code() {
        assert_eq!(faults_of("/// Symbols upside\n/// down.", Rule::Word), ["'upside down': inverted"]);
        assert_eq!(faults_of("/// Clocks that departed.", Rule::Word), ["'depart*': differ, error"]);
        let doc = &prose::docs("/// Chips of an overlay.")[0];
        assert_eq!(prose::faults("src/gnss/l1ca.rs", doc, Rule::Word), ["'overlay*': secondary code"]);
        assert!(prose::faults("src/gnss/l1c.rs", doc, Rule::Word).is_empty());
        for text in ["/// The key `place`.", "/// A unit in the last place.", "/// Placed at rest.", "// A place."] {
            assert!(faults_of(text, Rule::Word).is_empty(), "{text}");
        }
    }
}
