//! Effects and stages: each against its closed form or its published figures, through the samples.
#![cfg(all(feature = "generator", feature = "receiver", feature = "analysis"))]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

mod array;
mod detection;
mod front_end;
mod interference;
mod issues;
mod laws;
mod link;
mod multipath;
mod oscillator;
mod propagation;
mod reaction;
mod satellite;
mod separation;
mod single;
mod spoofing;

/// Runs a scene with the program in a directory of its own.
fn ran(scene: &Path) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_gnss-twin");
    let output = Command::new(program).arg("run").arg(scene).current_dir(directory.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    directory
}

/// Runs a shipped scene: directory of its results, and their summary.
fn ran_shipped(name: &str) -> (TempDir, PathBuf, Value) {
    let directory = ran(&Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/{name}.toml")));
    let run = directory.path().join("reports").join(name);
    let summary = serde_json::from_slice(&std::fs::read(run.join("summary.json")).unwrap()).unwrap();
    (directory, run, summary)
}
