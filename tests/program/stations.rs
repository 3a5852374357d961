//! A scene of several stations on the command line: one command makes all of them, and commands that take one
//! say how to choose it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::{code, stderr, twin};

const PAIR: &str = r#"
name = "pair"
start = 2010-07-01T08:00:00
duration_s = 1.5
seed = 3
[noise]
[[station]]
name = "base"
motion = { kind = "static", latitude_deg = 26.5123, longitude_deg = 80.2329, height_m = 130 }
[[station]]
name = "rover"
motion = { kind = "static", latitude_deg = 26.5163, longitude_deg = 80.2369, height_m = 142 }
receiver_clock = { bias_s = -2e-4, drift_sps = -3e-7 }
"#;

/// A directory with `pair.toml` in it.
fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("pair.toml"), PAIR).unwrap();
    directory
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn run_makes_a_directory_of_each_station_and_a_list_of_them() {
    let here = workplace();
    let done = twin(&["run", "pair.toml", "--out", "pair", "--report", "none", "--json"], here.path());
    assert_eq!(code(&done), 0, "{}", stderr(&done));
    let printed: Value = serde_json::from_slice(&done.stdout).unwrap();
    let names: Vec<&str> =
        printed["stations"].as_array().unwrap().iter().map(|one| one["station"].as_str().unwrap()).collect();
    assert_eq!(names, ["base", "rover"]);
    let list = json(&here.path().join("pair/stations.json"));
    // 0.004 degrees of latitude and of longitude in Kanpur: 443 m and 398 m.
    let distance_m = list["stations"][1]["distance_m"].as_f64().unwrap();
    assert!((distance_m - 596.0).abs() < 3.0 && list["stations"][0]["distance_m"] == 0.0, "{list}");
    for name in names {
        let run = here.path().join("pair").join(name);
        assert_eq!(json(&run.join("truth/scene.json"))["name"], format!("pair-{name}"));
        for file in ["rx/observations.csv", "rx/observations.rnx", "summary.json", "verdict.csv", "scenario.toml"] {
            assert!(run.join(file).is_file(), "{name}: {file}");
        }
    }
    // A second run replaces the first, and the directory of all is no run's.
    let again = twin(&["run", "pair.toml", "--out", "pair", "--report", "none", "--quiet"], here.path());
    assert_eq!(code(&again), 0, "{}", stderr(&again));
    let judged = twin(&["analyze", "pair"], here.path());
    assert!(code(&judged) == 65 && stderr(&judged).contains("pair/base, pair/rover"), "{}", stderr(&judged));
    assert_eq!(code(&twin(&["analyze", "pair/rover", "--report", "none"], here.path())), 0);
}

#[test]
fn a_station_alone_is_the_scene_in_its_directory() {
    let here = workplace();
    let run = twin(&["run", "pair.toml", "--station", "rover", "--out", "rover", "--report", "none"], here.path());
    assert_eq!(code(&run), 0, "{}", stderr(&run));
    let made = |scene: &str, station: &[&str], out: &str| {
        let done = twin(&[&["generate", scene, "--out", out, "--samples", "100000"], station].concat(), here.path());
        assert_eq!(code(&done), 0, "{}", stderr(&done));
        fs::read(here.path().join(out)).unwrap()
    };
    let among = made("pair.toml", &["--station", "rover"], "among.sigmf-data");
    assert_eq!(among, made("rover/scenario.toml", &[], "alone.sigmf-data"));
    assert_ne!(among, made("pair.toml", &["--station", "base"], "base.sigmf-data"));
}

#[test]
fn commands_that_take_one_station_name_those_that_there_are() {
    let here = workplace();
    for arguments in [&["generate", "pair.toml", "--out", "x.sigmf-data"][..], &["live", "pair.toml", "--to", "file:x"]]
    {
        let refused = twin(arguments, here.path());
        let message = stderr(&refused);
        let says = message.contains("station: there are 2, base, rover") && message.contains("--station NAME");
        assert!(code(&refused) == 65 && says, "{message}");
    }
    for command in ["run", "plan"] {
        let unknown = twin(&[command, "pair.toml", "--station", "third"], here.path());
        assert!(
            code(&unknown) == 2 && stderr(&unknown).contains("expected one of base, rover"),
            "{}",
            stderr(&unknown)
        );
    }
    let plan = twin(&["plan", "pair.toml", "--json"], here.path());
    let plan: Value = serde_json::from_slice(&plan.stdout).unwrap();
    assert_eq!(plan["stations"].as_array().unwrap().len(), 2, "{plan}");
}
