//! Studies of scenes without samples: what they keep is what `run` says at the same level and seed.

use serde_json::Value;

use super::*;

/// A whole sky, and a receiver from a cold start to its first fixes.
const SCENE: &str = include_str!("../../../studies/scenes/starts.toml");

const STUDY: &str = r#"
name = "modelled"
level = "correlations"
scenario = "scene.toml"
keep = [
    "satellites.acquired",
    "position.first_fix_s",
    "position.horizontal_p95_m",
    "observables.pseudorange_rms_m",
    "observables.carrier_rms_cycles",
    "observables.cn0_bias_db",
]
[[axis]]
key = "motion.latitude_deg"
values = [-30, 45]
[[axis]]
key = "receiver.tracking.pll_bandwidth_hz"
values = [10, 18]
"#;
/// First column of figures: case, seed, repetition and two axes are before it.
const FIGURES: usize = 5;
const PATHS: [&str; 6] = [
    "/satellites/acquired",
    "/position/first_fix_s",
    "/position/horizontal_p95_m",
    "/observables/pseudorange_rms_m",
    "/observables/carrier_rms_cycles",
    "/observables/cn0_bias_db",
];

/// A place for a study of the scene with other lines of fidelity.
fn place(study: &str, fidelity: &str) -> tempfile::TempDir {
    let here = workplace(study);
    fs::write(here.path().join("scene.toml"), scene(fidelity)).unwrap();
    here
}

fn scene(fidelity: &str) -> String {
    let short = SCENE.replacen("duration_s = 60", "duration_s = 45", 1);
    let text = short.replacen("[noise]", &format!("[fidelity]\n{fidelity}\n[noise]"), 1);
    assert_ne!(text, short);
    text
}

fn table(here: &Path, directory: &str) -> Vec<csv::StringRecord> {
    csv::Reader::from_path(here.join(directory).join("cases.csv")).unwrap().records().map(Result::unwrap).collect()
}

/// Figures of `run` for a case of the study of a scene with these lines of fidelity.
fn of_run(here: &Path, row: &csv::StringRecord, fidelity: &str) -> [f64; PATHS.len()] {
    let text = scene(fidelity).replacen("latitude_deg = 0", &format!("latitude_deg = {}", &row[3]), 1);
    let text = text + &format!("[receiver.tracking]\npll_bandwidth_hz = {}\n", &row[4]);
    fs::write(here.join("alone.toml"), text).unwrap();
    let arguments = ["run", "alone.toml", "--seed", &row[1], "--out", "alone"];
    let run = Command::new(TWIN).args(arguments).current_dir(here).output().unwrap();
    assert!(run.status.success(), "{}", super::text(&run));
    let summary: Value = serde_json::from_slice(&fs::read(here.join("alone/summary.json")).unwrap()).unwrap();
    fs::remove_dir_all(here.join("alone")).unwrap();
    PATHS.map(|path| summary.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN))
}

/// Holds a case of a study against `run`. JSON's reader rounds to a last place.
fn assert_run(row: &csv::StringRecord, expected: &[f64; PATHS.len()]) {
    for (at, (figure, path)) in expected.iter().zip(PATHS).enumerate() {
        let mine: f64 = row[FIGURES + at].parse().unwrap();
        assert!((mine - figure).abs() <= 1e-14 * figure.abs(), "{path}: {mine} and {figure} in {row:?}");
    }
}

#[test]
fn a_case_at_correlations_is_what_run_says_there_on_any_threads() {
    let here = place(STUDY, "");
    let here = here.path();
    for (name, jobs) in [("one", "1"), ("two", "2")] {
        let said = good(&["plan", "study.toml", "-o", name, "--shards", "2"], here);
        assert!(said.contains("level correlations"), "{said}");
        good(&["run", name, "--jobs", jobs], here);
    }
    assert_eq!(merged(here, "one"), merged(here, "two"));
    good(&["study.toml", "-o", "out", "--report", "none"], here);
    let rows = table(here, "out");
    assert_eq!(rows.len(), 4);
    // Receivers of one scene share its seed and its truth; the second is a run of its own.
    assert_eq!(rows[0][1], rows[1][1]);
    for row in [&rows[1], &rows[2]] {
        assert_run(row, &of_run(here, row, "level = \"correlations\""));
    }
    let report = fs::read_to_string(here.join("out/report.md")).unwrap();
    assert!(report.contains("**Level of correlations**"), "{report}");
}

#[test]
fn a_scene_s_own_level_is_heard_and_may_be_varied() {
    let study = STUDY.replacen("level = \"correlations\"", "level = \"samples\"", 1).replacen("[-30, 45]", "[45]", 1);
    let here = place(&study, "level = \"correlations\"");
    let here = here.path();
    good(&["study.toml", "-o", "own", "--report", "none"], here);
    let own = table(here, "own");
    assert_run(&own[0], &of_run(here, &own[0], "level = \"correlations\""));
    // The receivers' axis becomes one of levels: the seed is that of the case before, and the scene's own
    // level is that of the axis.
    let levels = study.replacen("receiver.tracking.pll_bandwidth_hz", "fidelity.level", 1);
    let levels = levels.replacen("[10, 18]", "[\"balanced\", \"correlations\", \"observations\"]", 1);
    fs::write(here.join("levels.toml"), levels).unwrap();
    good(&["levels.toml", "-o", "levels", "--report", "none"], here);
    let rows = table(here, "levels");
    assert!(rows.iter().all(|row| row[1] == own[0][1]), "{rows:?}");
    let number = |row: &csv::StringRecord, at: usize| row[FIGURES + at].parse::<f64>().unwrap();
    for other in &rows[1..] {
        assert_eq!(number(other, 0), number(&rows[0], 0), "satellites: {rows:?}");
        // Ten satellites for ten seconds and more of code loops of 2 Hz (4·2 Hz·10 s·10 = 800 independent
        // errors): each rms is known to 1/√(2·800) = 2.5 %; ten of that.
        assert!((number(other, 3) / number(&rows[0], 3) - 1.0).abs() < 0.25, "pseudoranges: {rows:?}");
        assert_ne!(other[FIGURES + 3], rows[0][FIGURES + 3]);
    }
    // The level of the study goes before that of the scene.
    let modelled = study.replacen("level = \"samples\"", "level = \"observations\"", 1);
    fs::write(here.join("observed.toml"), modelled.replacen("[10, 18]", "[18]", 1)).unwrap();
    good(&["observed.toml", "-o", "observed", "--report", "none"], here);
    let figures = |row: &csv::StringRecord| row.iter().skip(FIGURES).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(figures(&table(here, "observed")[0]), figures(&rows[2]));
}

#[test]
fn a_budget_chooses_in_a_study_what_it_chooses_in_a_run() {
    let study = STUDY.replacen("level = \"correlations\"", "level = \"samples\"", 1).replacen("[-30, 45]", "[45]", 1);
    // The loose one is kept by correlations; 5e-5 cycle is not (`plan`).
    for (code_m, carrier_cycles) in [(1.0, 1e-3), (1.0, 5e-5)] {
        let budget = format!("budget = {{ code_m = {code_m}, carrier_cycles = {carrier_cycles} }}");
        let here = place(&study, &budget);
        good(&["study.toml", "-o", "out", "--report", "none"], here.path());
        let row = &table(here.path(), "out")[0];
        assert_run(row, &of_run(here.path(), row, &budget));
        let chosen = fs::read_to_string(here.path().join("alone.toml")).unwrap();
        assert!(chosen.contains(&budget), "{chosen}");
    }
}

#[test]
fn a_resumed_study_notices_another_level() {
    let study = STUDY.replacen("level = \"correlations\"", "level = \"samples\"", 1);
    let here = place(&study, "level = \"correlations\"");
    let here = here.path();
    good(&["plan", "study.toml", "-o", "out"], here);
    good(&["plan", "study.toml", "-o", "out"], here);
    let refused = |words: &str| {
        let output = super::study(&["plan", "study.toml", "-o", "out"], here);
        assert!(!output.status.success() && text(&output).contains(words), "{}", text(&output));
    };
    fs::write(here.join("scene.toml"), scene("level = \"observations\"")).unwrap();
    refused("holds another study, or this one before it was changed");
    fs::write(here.join("scene.toml"), scene("level = \"correlations\"")).unwrap();
    good(&["plan", "study.toml", "-o", "out"], here);
    fs::write(here.join("study.toml"), STUDY).unwrap();
    refused("holds another study, or this one before it was changed");
}

#[test]
fn an_effect_without_a_model_is_named_before_anything_runs() {
    let jammer = "[[interference]]\nkind = \"cw\"\njs_db = 20\n";
    let refused = |study: &str, scene: &str, words: &[&str]| {
        let here = workplace(study);
        fs::write(here.path().join("scene.toml"), scene).unwrap();
        let output = super::study(&["plan", "study.toml", "-o", "out"], here.path());
        assert_eq!(code(&output), 65, "{}", text(&output));
        for word in words {
            assert!(text(&output).contains(word), "{word:?} is not in {}", text(&output));
        }
        assert!(!here.path().join("out/manifest.json").exists());
    };
    let jammed = scene("") + jammer;
    refused(STUDY, &jammed, &["level = \"correlations\" has no model of [[interference]]", "case 0"]);
    let observed = STUDY.replacen("\"correlations\"", "\"observations\"", 1);
    refused(&observed, &jammed, &["level = \"observations\" has no model of [[interference]]"]);
    // One value of an axis is to blame.
    let varied = STUDY.replacen("motion.latitude_deg", "fidelity.code_edge", 1);
    let varied = varied.replacen("[-30, 45]", "[\"area\", \"band_limited\"]", 1);
    refused(&varied, &scene(""), &["no model of fidelity.code_edge = \"band_limited\"", "case 2"]);
    // The study's level leaves nothing for an axis of levels.
    let twice = STUDY.replacen("motion.latitude_deg", "fidelity.level", 1);
    let twice = twice.replacen("[-30, 45]", "[\"balanced\", \"correlations\"]", 1);
    refused(&twice, &scene(""), &["axis fidelity.level", "level = \"samples\""]);
    refused(&STUDY.replacen("\"correlations\"", "\"correlation\"", 1), &scene(""), &["did you mean", "correlations"]);
}
