//! `reference`: every key that a file of the program may hold, from the declarations that its readers use.

use std::fmt::Write as _;

use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::pack::keys::PACK;
use crate::cli::scenario;
use analysis::judge::judgement::MARGINAL_SHARE;
use analysis::judge::schema;
use generator::scenario::keys::SCENARIO;
use generator::scenario::keys::signal::SIGNAL;
use generator::scenario::schema::{Listed, tables_of};
use gnss::place::nearest;
use receiver::settings::reference as receiver;
use study::sweep::keys::STUDY;

/// One section of the reference.
struct Section {
    /// Name of the section on the command line.
    name: String,
    text: String,
}

/// Prints the whole reference, or one table of it.
pub fn execute(arguments: &args::Reference) -> Result<(), CliError> {
    let Some(wanted) = &arguments.table else { return scenario::print(&whole()) };
    let wanted = wanted.trim_matches(['[', ']']);
    let sections: Vec<Section> = chapters().into_iter().flat_map(|(_, sections)| sections).collect();
    if let Some(section) = sections.iter().find(|section| section.name == wanted) {
        return scenario::print(&section.text);
    }
    let names: Vec<&str> = sections.iter().map(|section| section.name.as_str()).collect();
    let hint = nearest(wanted, &names).map_or(String::new(), |near| format!(" (did you mean {near}?)"));
    Err(CliError::usage(format!("no table {wanted:?}{hint}: expected one of {}", names.join(", "))))
}

/// The whole reference: what `REFERENCE.md` holds.
pub fn whole() -> String {
    let mut out =
        "# Reference of all keys\n\nMade by `gnss-twin reference > REFERENCE.md` from the declarations that the \
                   readers use; a test holds this file to them. `gnss-twin reference TABLE` prints one table.\n\n"
            .to_owned();
    for (title, sections) in chapters() {
        let _ = write!(out, "## {title}\n\n");
        sections.iter().for_each(|section| out += &section.text);
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

fn chapters() -> [(&'static str, Vec<Section>); 6] {
    let top = "At the top of the file. Paths are relative to the scenario and stay below its directory.";
    let study =
        "At the top of the file. At level = \"samples\" an axis may take any key of the scene or of the receiver.";
    let signal = "At the top of a file that `signal_file` of a scenario, or `receive --signal-file`, names.";
    [
        ("Scenario", declared(tables_of(SCENARIO, "", top), "scenario", "")),
        ("Signal file", declared(tables_of(SIGNAL, "", signal), "signal", "signal.")),
        ("Receiver settings", of_receiver()),
        ("Study", declared(tables_of(STUDY, "", study), "study", "study.")),
        ("Pack", declared(tables_of(PACK, "", "At the top of a pack's pack.toml."), "pack", "pack.")),
        ("Limits (`--check`)", vec![Section { name: "limits".to_owned(), text: limits() }]),
    ]
}

fn declared(tables: Vec<Listed>, top: &str, above: &str) -> Vec<Section> {
    let name = |table: &Listed| match table.path.as_str() {
        "" => top.to_owned(),
        path => format!("{above}{path}"),
    };
    tables.iter().map(|table| Section { name: name(table), text: table.markdown(3) }).collect()
}

/// Sections of the receiver's keys: in a scenario below `[receiver]`, in a file of settings at the top.
fn of_receiver() -> Vec<Section> {
    let section = |(table, keys): (String, Vec<receiver::Described>)| {
        let mut text = format!(
            "### `[receiver.{table}]`\n\nIn a scenario; in the settings of `receive` it is `[{table}]`.\n\n\
             | key | value | if absent | meaning |\n| --- | --- | --- | --- |\n"
        );
        for receiver::Described { name, default, expected, meaning } in keys {
            let _ = writeln!(text, "| `{name}` | {expected} | {default} | {meaning} |");
        }
        text.push('\n');
        Section { name: format!("receiver.{table}"), text }
    };
    receiver::tables().into_iter().map(section).collect()
}

fn limits() -> String {
    let mut text = format!(
        "Keys are paths into `summary.json`, as `\"position.horizontal_p95_m\" = {{ max = 1.5 }}`; a bound is `min`, \
         `max`, both, or `equals`. Besides them `marginal_share` (a number from 0 to below 1, {MARGINAL_SHARE} if \
         absent): what is left of a limit below this share of it is marginal.\n\n| path | unit | meaning |\n| --- | \
         --- | --- |\n"
    );
    for leaf in schema::leaves() {
        let _ = writeln!(text, "| `{}` | {} | {} |", leaf.path, leaf.unit, leaf.meaning.replace('|', "\\|"));
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_in_the_repository_is_what_the_command_prints() {
        let file = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/REFERENCE.md")).unwrap_or_default();
        let printed = whole();
        let differs = file.lines().zip(printed.lines()).find(|(one, other)| one != other);
        assert!(file == printed, "run `gnss-twin reference > REFERENCE.md`; first difference: {differs:?}");
    }

    #[test]
    fn every_key_of_the_receiver_has_a_range_and_a_meaning() {
        for (table, keys) in receiver::tables() {
            assert!(!keys.is_empty(), "{table}");
            for key in keys {
                assert!(!key.meaning.is_empty() && !key.expected.is_empty(), "{table}: {key:?}");
            }
        }
    }

    #[test]
    fn every_declared_key_has_a_meaning_and_stands_in_the_reference() {
        let text = whole();
        for table in [SCENARIO, SIGNAL, STUDY, PACK].into_iter().flat_map(|keys| tables_of(keys, "", "x")) {
            assert!(!table.meaning.is_empty(), "{}", table.path);
            for key in table.keys {
                assert!(!key.meaning.is_empty(), "{}.{}", table.path, key.name);
                assert!(text.contains(&format!("| `{}` |", key.name)), "{}.{}", table.path, key.name);
            }
        }
    }
}
