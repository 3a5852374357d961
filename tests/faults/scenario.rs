//! Scenarios: each line of each scene that comes with the program, mistyped and given bad values.

use std::path::{Path, PathBuf};

use gnss_twin::generator::scenario::{Overrides, Scenario, ScenarioError};

use crate::tally::{End, Tally, cases};

const FAMILY: &str = "Scenarios";

fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

/// The scenes that come with the program.
fn scenes() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for directory in [directory(), directory().join("extremes")] {
        for entry in std::fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "toml") && path.file_stem().is_some_and(|name| name != "limits") {
                found.push((path.clone(), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

/// Number of the line, table, key and value of each setting that stands on a line of its own.
fn settings(text: &str) -> Vec<(usize, String, String, String)> {
    let mut table = String::new();
    let mut found = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split(" #").next().unwrap().trim();
        if line.starts_with('[') {
            table = line.trim_matches(['[', ']']).to_owned();
        } else if let Some((key, value)) = line.split_once('=')
            && !line.starts_with('#')
            && !value.trim().ends_with('[')
        {
            found.push((number, table.clone(), key.trim().to_owned(), value.trim().to_owned()));
        }
    }
    found
}

fn with_line(text: &str, number: usize, line: &str) -> String {
    text.lines().enumerate().map(|(at, old)| if at == number { line } else { old }).collect::<Vec<_>>().join("\n")
}

fn place_of(error: &ScenarioError) -> Option<usize> {
    match error {
        ScenarioError::Toml { place, .. }
        | ScenarioError::UnknownKey { place, .. }
        | ScenarioError::Value { place, .. } => Some(place.line),
        _ => None,
    }
}

#[test]
fn a_mistyped_key_of_any_scene_is_refused_at_its_line_with_the_right_key() {
    let mut tally = Tally::new(FAMILY, "9. mistyped keys");
    let mut count = 0;
    for (path, text) in scenes() {
        let file = path.display().to_string();
        for (number, table, key, value) in settings(&text) {
            count += 1;
            if table.starts_with("receiver") && !table.starts_with("receiver_")
                || count % cases(5, 1) != 0
                || key.len() < 4
            {
                continue;
            }
            let middle = key.len() / 2;
            for typo in [format!("{}{}", &key[..middle], &key[middle + 1..]), format!("{key}{}", &key[key.len() - 1..])]
            {
                let text = with_line(&text, number, &format!("{typo} = {value}"));
                tally.case(
                    || format!("{file}: {table}.{typo}"),
                    || match Scenario::parse(&text, "scene") {
                        Err(error @ ScenarioError::UnknownKey { .. }) if place_of(&error) == Some(number + 1) => {
                            let message = error.to_string();
                            let named = message.contains(&typo) && message.contains(&format!("did you mean '{key}'"));
                            if named { Ok(End::Refused) } else { Err(message) }
                        }
                        other => Err(format!("{:?}", other.map(|scene| scene.name))),
                    },
                );
            }
        }
    }
    tally.finish();
}

/// Values that no number may have, or that few may: see [`legal`].
const VALUES: [&str; 10] = ["-7", "0", "-0.0", "inf", "-inf", "nan", "1e308", "true", "\"5 m\"", "[1979-05-27]"];

#[test]
fn a_bad_value_of_any_key_of_any_scene_is_refused_at_its_line_with_key_and_range() {
    let mut tally = Tally::new(FAMILY, "10. bad values");
    let mut count = 0;
    for (path, text) in scenes() {
        let file = path.display().to_string();
        for (number, table, key, value) in settings(&text) {
            if table.starts_with("receiver") && !table.starts_with("receiver_") {
                continue;
            }
            for bad in VALUES {
                count += 1;
                if count % cases(7, 1) != 0 {
                    continue;
                }
                let text = with_line(&text, number, &format!("{key} = {bad}"));
                tally.case(
                    || format!("{file}: {table}.{key} = {bad}, was {value}"),
                    || match Scenario::parse(&text, "scene") {
                        Err(error) => {
                            let message = error.to_string();
                            let placed = place_of(&error).is_none_or(|line| line == number + 1);
                            let last = key.rsplit('.').next().unwrap_or(&key).trim_matches('"');
                            let said =
                                message.starts_with("scene") && message.contains(last) && message.contains("expected");
                            // What only contradicts another key names either.
                            let conflict = matches!(error, ScenarioError::Conflict { .. });
                            if placed && said || conflict { Ok(End::Refused) } else { Err(message) }
                        }
                        Ok(scene) if legal(bad, &value) => {
                            // A legal value may still not fit the rest; it may not bring the program down.
                            if count % cases(50, 5) == 0 {
                                let _ = scene.compose(path.parent().unwrap(), &Overrides::default());
                            }
                            Ok(End::Accepted)
                        }
                        Ok(_) => Err("accepted".to_owned()),
                    },
                );
            }
        }
    }
    tally.finish();
}

/// Whether a value of this kind can stand where `was` stood: 0 and small negative numbers in place of a number, a text in place
/// of a path, a truth value in place of another.
fn legal(bad: &str, was: &str) -> bool {
    let number = was.parse::<f64>().is_ok();
    match bad {
        "-7" | "0" | "-0.0" => number,
        "true" => was == "true" || was == "false",
        "\"5 m\"" => was.starts_with('"') && was.contains('.'),
        _ => false,
    }
}

#[test]
fn values_that_contradict_each_other_are_refused_with_the_number_that_decides() {
    let base = "name = \"x\"\nstart = 2010-07-01T08:05:58\nduration_s = 10\n[motion]\nkind = \"static\"\n\
                latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[power]\ncn0_dbhz = 45\n[noise]\n";
    let long_scene = base.replace("duration_s = 10", "duration_s = 2.6e6");
    let table: [(&str, String, &str); 12] = [
        ("an IF beyond the band", format!("{base}[front_end]\nsample_rate_hz = 4e6\nif_hz = 3e6\n"), "2000000"),
        ("a real format at 0 Hz", format!("{base}[front_end]\nformat = \"ri8\"\n"), "is real"),
        ("more bits than the format", format!("{base}[adc]\nbits = 12\n"), "at most 8"),
        ("1e14 samples", format!("{long_scene}[front_end]\nsample_rate_hz = 5e7\nformat = \"ci8\"\n"), "at most 1e14"),
        ("no satellite in view", format!("{base}[satellites]\nmask_deg = 89\n"), ""),
        ("a scene before its data", base.replace("2010-07-01", "2010-05-01"), ""),
        ("a scene after its data", base.replace("2010-07-01", "2031-07-01"), ""),
        ("half of Klobuchar", format!("{base}[ionosphere]\nmodel = \"klobuchar\"\nalpha = [0, 0, 0, 0]\n"), "beta"),
        (
            "a wall at the antenna",
            format!("{base}[[multipath]]\nkind = \"wall\"\namplitude = 0.5\nazimuth_deg = 3\n"),
            "distance_m",
        ),
        ("a file outside", format!("{base}[navigation]\nfile = \"../../etc/passwd\"\n"), "navigation"),
        ("an absolute file", format!("{base}[navigation]\nfile = \"/etc/passwd\"\n"), "outside"),
        ("a file that is a directory", format!("{base}[navigation]\nfile = \"extremes\"\n"), "not a file"),
    ];
    let mut tally = Tally::new(FAMILY, "11. contradictions and paths");
    for (name, text, part) in &table {
        tally.case(
            || (*name).to_owned(),
            || {
                let composed = Scenario::parse(text, "scene")
                    .and_then(|scene| scene.compose(&directory(), &Overrides::default()).map(|(_, warnings)| warnings));
                match composed {
                    Err(error) if error.to_string().contains(part) && error.to_string().starts_with("scene") => {
                        Ok(End::Refused)
                    }
                    Ok(warnings) if part.is_empty() && !warnings.is_empty() => Ok(End::Reported),
                    other => Err(format!("{other:?}").chars().take(300).collect()),
                }
            },
        );
    }
    tally.finish();
}
