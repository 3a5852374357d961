//! Protection levels by SBAS in a closed loop: a satellite that leaves its corrections is detected and
//! withdrawn.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

const RATE_HZ: f64 = 2.6e6;
/// Step of the satellite's clock.
const STEP_S: f64 = 75.0;
/// Time to alert of APV-II and Category I (ICAO annex 10, volume I, table 3.7.2.4-1).
const TO_ALERT_S: f64 = 6.0;

type Row = BTreeMap<String, String>;

/// Rows of a run's protection levels, with their times, and its summary.
fn levels(more: &[&str]) -> (Vec<(f64, Row)>, Value) {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("run");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/sbas_integrity.toml");
    let run = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
        .args(["run".as_ref(), scene.as_os_str(), "--check".as_ref(), "--out".as_ref(), out.as_os_str()])
        .args(more)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let rows = csv::Reader::from_path(out.join("rx/integrity.csv")).unwrap().into_deserialize();
    let timed = |row: Row| (row["sample"].parse::<f64>().unwrap() / RATE_HZ, row);
    let summary = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    (rows.map(|row| timed(row.unwrap())).collect(), summary)
}

#[test]
fn a_satellite_beyond_its_corrections_is_detected_at_once_and_withdrawn_within_six_seconds_at_both_levels() {
    for more in [&[][..], &["--level", "correlations"][..]] {
        let (rows, summary) = levels(more);
        let first = |fits: &dyn Fn(f64, &Row) -> bool| rows.iter().find(|(time_s, row)| fits(*time_s, row)).unwrap();
        // Type 10 comes after a round of all messages; until then each satellite has 8 m more.
        let (bounded_s, bounded) = first(&|_, row| !row["vpl_m"].is_empty());
        let (open_s, open) = first(&|_, row| row["available"] == "true");
        assert!(*bounded_s < 40.0 && *open_s > *bounded_s && *open_s < 60.0, "{bounded_s} {open_s}");
        assert!(bounded["vpl_m"].parse::<f64>().unwrap() > 35.0 && open["vpl_m"].parse::<f64>().unwrap() < 10.0);
        let (found_s, found) = first(&|time_s, row| time_s > STEP_S && row["detected"] == "true");
        assert!(found_s - STEP_S < 1.0 && found["excluded"] == "G31", "{found_s} {found:?}");
        let (gone_s, gone) = first(&|time_s, row| time_s > *found_s && row["detected"] == "false");
        assert!(gone_s - STEP_S < TO_ALERT_S + 1.0, "{gone_s}");
        assert_eq!((gone["satellites"].as_str(), gone["excluded"].as_str()), ("10", ""));
        // Nothing is found afterwards, and the approach goes on.
        assert!(rows.iter().all(|(time_s, row)| time_s < gone_s || row["detected"] == "false"));
        assert!(rows.iter().all(|(time_s, row)| time_s < open_s || row["available"] == "true"));
        for pointer in ["/protection/horizontal/ratio_max", "/protection/vertical/ratio_max"] {
            assert!(summary.pointer(pointer).and_then(Value::as_f64).unwrap() < 1.0, "{pointer}");
        }
    }
}
