//! Every key of pack.toml, declared once: see [`generator::scenario::schema`].

use generator::scenario::schema::{Key, foreign, tables, text, word};

/// Permitted names of a pack and of an entry, which name directories.
pub const NAME: &str = "1 to 64 letters, digits, '-', '_' and '.', and no '.' at the beginning";

/// The top of a pack's manifest.
pub const PACK: &[Key] = &[
    text("name", NAME, "name of the pack and of its directory of results").required(),
    text("title", "a title", "title of the matrix").required(),
    text("like", "a text", "suite that the pack is made after, and what differs from it").or_else("none"),
    text("source", "a text", "origin of the scenes and of their numbers").required(),
    text("licence", "a text", "licence of the pack and of its data").required(),
    text("about", "a text", "introduction of the matrix").or_else("none"),
    tables("entry", ENTRY, "Scene of the pack, and the verdict that is expected of it.").required(),
    tables("may_fail", MAY_FAIL, "Figure of the verdict that may fail in every entry with verdict = \"pass\"."),
    tables("not_said", NOT_SAID, "Test of the source that no scene can say; the matrix lists it."),
];

/// One `[[entry]]`.
const ENTRY: &[Key] = &[
    text("name", NAME, "name of the entry and of its directory of results").required(),
    text("group", "a title", "group of the entry in the matrix").required(),
    text("description", "a text", "description of the entry").required(),
    text("scene", "the path of a scene, below the pack's directory", "scene of the entry").required(),
    foreign(
        "set",
        "a table of keys of the scene",
        "keys that replace those of the scene: tables are merged, values and arrays replaced; a quoted key like \
         \"interference[1].js_db\" sets one entry of an array",
    )
    .or_else("the scene as it is"),
    word(
        "verdict",
        || vec!["pass", "fail", "any"],
        "expected verdict: pass for no failed figure, fail for one at least, any for a matrix that only records",
    )
    .or_else("pass"),
    text("reason", "a text", "reason of the expectation; required with verdict = \"fail\" or \"any\""),
    tables("may_fail", MAY_FAIL, "Figure of the verdict that may fail where verdict = \"pass\"."),
    text("limits", "the path of a file of limits, below the pack's directory", "limits of `analyze --check`")
        .or_else("the verdict's own"),
];

/// One `[[entry.may_fail]]`.
const MAY_FAIL: &[Key] = &[
    text("figure", "a figure of verdict.csv, or a pattern with * and ?", "figure or path of the verdict").required(),
    text("reason", "a text", "reason for which it may fail").required(),
];

/// One `[[not_said]]`.
const NOT_SAID: &[Key] = &[
    text("name", NAME, "name of the test in its source").required(),
    text("group", "a title", "group of the test in the matrix").required(),
    text("description", "a text", "description of the test").required(),
    text("reason", "a text", "reason for which no scene says it").required(),
];
