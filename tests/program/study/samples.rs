//! Studies on samples: what they keep is what a run says, and what theory says.

use serde_json::Value;

use super::*;

/// One satellite and thermal noise.
const SCENE: &str = include_str!("../../../studies/scenes/one_satellite.toml");

const STUDY: &str = r#"
name = "sampled"
level = "samples"
scenario = "scenes/one.toml"
keep = [
    "tracking.pll_sigma_deg",
    "theory.tracking.pll_sigma_deg",
    "tracking.dll_sigma_chips",
    "theory.tracking.dll_sigma_chips",
    "acquisition.detected_share",
    "acquisition.false",
]
[[axis]]
key = "power.cn0_dbhz"
values = [41, 46.0]
[[axis]]
key = "receiver.tracking.pll_bandwidth_hz"
values = [10, 18]
"#;

/// A place for studies on samples.
fn laboratory() -> tempfile::TempDir {
    let here = workplace(STUDY);
    fs::create_dir(here.path().join("scenes")).unwrap();
    fs::write(here.path().join("scenes/one.toml"), SCENE.replace("duration_s = 45", "duration_s = 30")).unwrap();
    here
}

fn cases(here: &Path, directory: &str) -> Vec<csv::StringRecord> {
    csv::Reader::from_path(here.join(directory).join("cases.csv")).unwrap().records().map(Result::unwrap).collect()
}

#[test]
fn a_case_is_what_run_would_say_and_agrees_with_theory() {
    let here = laboratory();
    let here = here.path();
    good(&["study.toml", "-o", "out"], here);
    let rows = cases(here, "out");
    assert_eq!(rows.len(), 4);
    // Columns: case, seed, repetition, C/N0, bandwidth, phase, its theory, code, its theory, detected, false.
    let number = |row: &csv::StringRecord, column: usize| row[column].parse::<f64>().unwrap();
    for (row, case) in rows.iter().zip(0..) {
        assert_eq!((number(row, 0), number(row, 9), number(row, 10)), (f64::from(case), 1.0, 0.0), "{row:?}");
        // Some 15 s past frame and pull-in: loops of 10 and 18 Hz, read every 50 ms, give at least 250
        // independent errors, so their spread is known to 1/√(2·250) = 4.5 %; three of that. The code's 120
        // (4·2 Hz·15 s): 6.5 %.
        let ratio = number(row, 5) / number(row, 6);
        println!("phase {ratio:.3}, code {:.3}: {row:?}", number(row, 7) / number(row, 8));
        assert!((ratio - 1.0).abs() < 0.135, "{ratio}: {row:?}");
        assert!((number(row, 7) / number(row, 8) - 1.0).abs() < 0.195, "{row:?}");
    }
    // Receivers of one signal share a seed; each is the receiver of `run` on that seed's scene.
    assert_eq!(rows[2][1], rows[3][1]);
    assert_ne!(rows[2][1], rows[0][1]);
    let row = &rows[3];
    let scene = fs::read_to_string(here.join("scenes/one.toml")).unwrap();
    let scene = scene.replace("cn0_dbhz = 45", &format!("cn0_dbhz = {}", &row[3]))
        + &format!("pll_bandwidth_hz = {}\n", &row[4]);
    fs::write(here.join("alone.toml"), scene).unwrap();
    let run =
        Command::new(TWIN).args(["run", "alone.toml", "--seed", &row[1], "--out", "alone"]).current_dir(here).output();
    let run = run.unwrap();
    assert!(run.status.success(), "{}", text(&run));
    let summary: Value = serde_json::from_slice(&fs::read(here.join("alone/summary.json")).unwrap()).unwrap();
    for (key, column) in [("pll_sigma_deg", 5), ("dll_sigma_chips", 7)] {
        // JSON's reader rounds to a last place.
        let ratio = summary["tracking"][key].as_f64().unwrap() / number(row, column);
        assert!((ratio - 1.0).abs() < 1e-14, "{key}: {ratio}");
    }
}

#[test]
fn a_scene_s_own_refusals_come_with_the_axis_that_caused_them() {
    let here = laboratory();
    let refused = |from: &str, to: &str, words: &[&str]| {
        fs::write(here.path().join("bad.toml"), STUDY.replacen(from, to, 1)).unwrap();
        let output = study(&["plan", "bad.toml", "-o", "bad"], here.path());
        assert_eq!(code(&output), 65, "{}", text(&output));
        for word in words {
            assert!(text(&output).contains(word), "{word:?} is not in {}", text(&output));
        }
    };
    refused("power.cn0_dbhz", "power.cn0_dbh", &["bad.toml:14:7", "did you mean 'cn0_dbhz'"]);
    refused("[41, 46.0]", "[41, 460]", &["axis power.cn0_dbhz = 460", "expected"]);
    refused("pll_bandwidth_hz", "pll_bandwith_hz", &["bad.toml:17:7", "pll_bandwidth_hz"]);
    refused("scenes/one.toml", "scenes/none.toml", &["scenes/none.toml"]);
    refused("\"tracking.pll_sigma_deg", "\"tracking.pll_sigma", &["did you mean tracking.pll_sigma_deg"]);
    refused("power.cn0_dbhz", "power.cn0_dbhz.x", &["cn0_dbhz is no table"]);
}

#[test]
fn every_figure_that_a_study_may_keep_is_one_of_the_summary() {
    let here = laboratory();
    fs::write(here.path().join("short.toml"), SCENE.replace("duration_s = 45", "duration_s = 2")).unwrap();
    let run = Command::new(TWIN).args(["run", "short.toml", "--out", "run"]).current_dir(here.path()).output().unwrap();
    assert!(run.status.success(), "{}", text(&run));
    let summary: Value = serde_json::from_slice(&fs::read(here.path().join("run/summary.json")).unwrap()).unwrap();
    for name in study::sweep::sampled::FIGURES {
        let own = ["acquisition.", "theory.", "spoofing."].iter().any(|start| name.starts_with(start));
        // Lists are null in a run without fixes.
        let path = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
        assert!(own || summary.pointer(&format!("/{}", path.replace('.', "/"))).is_some(), "{name}");
    }
}

#[test]
fn a_scene_of_another_system_is_searched_for_its_own_signals() {
    // One satellite of Galileo; the receiver's settings name no signal.
    let scene = include_str!("../../../studies/scenes/boost_galileo.toml");
    let (scene, _) = scene.split_once("[receiver.acquisition]").unwrap();
    let here = workplace(
        "name = \"own\"\nlevel = \"samples\"\nscenario = \"one.toml\"\nkeep = [\"satellites.acquired\"]\n\
         [[axis]]\nkey = \"power.cn0_dbhz\"\nvalues = [45]\n",
    );
    fs::write(here.path().join("one.toml"), scene.replace("duration_s = 16", "duration_s = 9.5")).unwrap();
    good(&["study.toml", "-o", "out"], here.path());
    let rows = cases(here.path(), "out");
    assert_eq!(rows[0].iter().next_back(), Some("1"), "{rows:?}");
}
