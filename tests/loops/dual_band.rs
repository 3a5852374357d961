//! The shipped scene of two bands through the whole program: positions without ionosphere, and the ionosphere
//! itself, against the truth. A minute of processors: with `GNSS_TWIN_LONG=1`.
#![cfg(all(feature = "generator", feature = "receiver", feature = "analysis"))]

use std::path::Path;
use std::process::Command;

use gnss::earth::Geodetic;
use gnss::record::{Fix, IonosphereModel, TrajectoryRow};

fn rows<T: serde::de::DeserializeOwned>(directory: &Path, name: &str) -> Vec<T> {
    csv::Reader::from_path(directory.join(name)).unwrap().deserialize().map(Result::unwrap).collect()
}

/// Runs a shipped scene: its summary and the horizontal errors of its fixes from both carriers, ascending.
fn run(scene: &str) -> (serde_json::Value, Vec<f64>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let place = tempfile::tempdir().unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
        .current_dir(root)
        .args(["run", scene, "--check", "--out"])
        .arg(place.path().join("run"))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    println!("{text}");
    // Every row of the verdict passes, or the program says so by its code.
    assert!(done.status.success(), "{text}");
    let run = place.path().join("run");
    let summary: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(run.join("summary.json")).unwrap()).unwrap();
    let here: Vec<TrajectoryRow> = rows(&run.join("truth"), "trajectory.csv");
    let here_m = here[0].position_m();
    let to_enu = Geodetic::from_ecef(&here_m).ecef_to_enu();
    let fixes: Vec<Fix> = rows(&run.join("rx"), "fixes.csv");
    let off_m = |fix: &Fix| (to_enu * (fix.position_m() - here_m)).xy().norm();
    let mut combined: Vec<f64> =
        fixes.iter().filter(|fix| fix.ionosphere == IonosphereModel::Combined).map(off_m).collect();
    combined.sort_by(f64::total_cmp);
    (summary, combined)
}

fn figure(summary: &serde_json::Value, path: &str) -> f64 {
    summary.pointer(path).and_then(serde_json::Value::as_f64).unwrap()
}

#[test]
fn two_bands_give_a_place_to_a_metre_and_the_ionosphere_to_decimetres() {
    if !crate::long::is_asked_for() {
        return;
    }
    // Codes of GPS are noisier than those of Galileo, and two satellites have L2C alone: smoothed codes of
    // 0.2 m make f₂²/(f₁² − f₂²)·√2 = 2.2 times as much of it, and nine decimetres at 95 %.
    for (scene, ionosphere_m) in [("scenarios/dual_band.toml", 0.3), ("scenarios/gps_bands.toml", 0.9)] {
        let (summary, off_m) = run(scene);
        assert!(figure(&summary, "/ionosphere/error_p95_m") <= ionosphere_m, "{scene}");
        assert!(figure(&summary, "/ionosphere/true_mean_m") > 3.0, "{scene}");
        assert!(off_m.len() > 200, "{scene}: {}", off_m.len());
        assert!(off_m[off_m.len() * 95 / 100] <= 1.0, "{scene}: {:?}", off_m.last());
    }
}
