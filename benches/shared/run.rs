//! Run of a scene of text, as the judge reads it.

use std::path::Path;

use analysis::read::Run;
use generator::scenario::{Overrides, Scenario};
use receiver::output::Output;
use receiver::settings::Settings;
use tempfile::TempDir;

/// Generates and receives a scene: the run, and the directory of its files.
pub fn run_of_scene(text: &str, name: &str) -> (Run, TempDir) {
    let scenario = Scenario::parse(text, name).unwrap();
    let (scenes, _) = scenario.compose_all(Path::new("."), &Overrides::default()).unwrap();
    let settings = Settings::of_scenario(text, name).unwrap();
    let here = tempfile::tempdir().unwrap();
    let [truth_path, rx_path] = ["truth", "rx"].map(|name| here.path().join(name));
    [&truth_path, &rx_path].into_iter().for_each(|path| std::fs::create_dir(path).unwrap());
    let mut truth = generator::truth::Writer::create(&truth_path).unwrap();
    let mut output = Output::create(&rx_path).unwrap();
    twin::run(&scenes, &settings, &mut truth, &mut output).unwrap();
    drop((truth, output));
    (Run::read_parts(here.path(), &truth_path, &rx_path).unwrap(), here)
}
