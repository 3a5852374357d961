//! `run` of a scene with several stations: each has a run's directory below one, and `stations.json` lists
//! them.
//!
//! Stations run one after the other, so memory is that of one; all scenes are composed before the first run.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::cli::args;
use crate::cli::check::Gate;
use crate::cli::error::CliError;
use crate::cli::printed;
use crate::cli::run::{Case, Done, write_json};
use crate::cli::scenario::Named;
use crate::cli::staging::Staging;

/// File that lists the stations of a run.
pub const LIST: &str = "stations.json";

/// Runs the scenes of stations into directories of their names below `target`.
pub fn run(
    stations: Vec<(Option<String>, Named)>,
    arguments: &args::Run,
    gate: &Gate,
    target: &Path,
) -> Result<(), CliError> {
    let scene = stations.first().map_or_else(String::new, |(_, named)| named.scenario.name.clone());
    let mut cases = Vec::with_capacity(stations.len());
    for (name, named) in stations {
        let name = name.unwrap_or_default();
        let case = Case::new(named, arguments).map_err(|error| error.at(&name))?;
        cases.push((name, case));
    }
    let staging = Staging::directory(target)?;
    let mut all: Vec<(&str, Done)> = Vec::with_capacity(cases.len());
    for (name, case) in &cases {
        let run = staging.path().join(name);
        fs::create_dir(&run).map_err(|error| CliError::create(target.join(name).display(), &error))?;
        let done = case.make(&run, arguments, gate).map_err(|error| error.at(name))?;
        all.push((name, done));
    }
    let first_m = cases.first().map(|(_, case)| start_m(case));
    let row = |((name, case), (_, done)): (&(String, Case), &(&str, Done))| {
        let own_m = start_m(case);
        let distance_m = first_m.map(|first_m| (own_m - first_m).norm());
        json!({
            "name": name,
            "scene": case.name(),
            "start_ecef_m": [own_m.x, own_m.y, own_m.z],
            "distance_m": distance_m,
            "verdict": printed::verdict(done.verdict()),
        })
    };
    let rows: Vec<Value> = cases.iter().zip(&all).map(row).collect();
    write_json(&staging.path().join(LIST), &json!({ "scene": scene, "stations": rows }))?;
    staging.commit()?;

    let mut text = String::new();
    for (name, done) in &all {
        done.warn();
        text += &format!("station {name}\n{}\n", done.text());
    }
    text += &format!("results in {}, one directory for each station\n", target.display());
    arguments.printed.results(&text, || {
        let each = |(name, done): &(&str, Done)| {
            let mut object = done.object(&target.join(name));
            object["station"] = json!(name);
            object
        };
        json!({ "results": target, "stations": all.iter().map(each).collect::<Vec<Value>>() })
    })?;
    // Every station is held to the limits before the first that breaks one ends the program.
    let held = all.iter().map(|(name, done)| gate.enforce(done.verdict(), arguments.printed).map_err(|e| e.at(name)));
    held.collect::<Vec<_>>().into_iter().collect()
}

/// ECEF position of the station's antenna when the scene starts, in metres.
fn start_m(case: &Case) -> nalgebra::Vector3<f64> {
    case.scenes.first().map_or_else(nalgebra::Vector3::zeros, |scene| scene.trajectory.at(0.0).position_m)
}

/// Refuses the directory of several stations where that of one run is expected.
pub fn refuse_several(run: &Path) -> Result<(), CliError> {
    let Ok(text) = fs::read_to_string(run.join(LIST)) else { return Ok(()) };
    let list: Value = serde_json::from_str(&text).unwrap_or_default();
    let names = list["stations"].as_array().into_iter().flatten().filter_map(|station| station["name"].as_str());
    let names: Vec<String> = names.map(|name| run.join(name).display().to_string()).collect();
    let (run, names) = (run.display(), names.join(", "));
    Err(CliError::input(format!("{run}: the runs of several stations: expected the directory of one, {names}")))
}
