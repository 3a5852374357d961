//! `baseline`: two scenes 600 m apart, planted faults, and refusals by name.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::{code, stderr, twin};

/// Galileo on two bands and GPS on one, through two front ends of a receiver at rest.
fn scene(name: &str, place: &str, clock_bias_s: f64, seed: u32) -> String {
    format!(
        "name = \"{name}\"\nstart = 2020-11-29T12:50:49\nduration_s = 32\nseed = {seed}\n\
         signals = [\"GPS L1 C/A\", \"Galileo E1\", \"Galileo E5a\"]\n\
         [motion]\nkind = \"static\"\n{place}\n[satellites]\nmask_deg = 10\n[power]\nkind = \"link_budget\"\n\
         [troposphere]\nmodel = \"saastamoinen\"\n[ionosphere]\nmodel = \"nequick_g\"\n\
         [receiver_clock]\nbias_s = {clock_bias_s}\ndrift_sps = 5e-8\n[noise]\n[fidelity]\nlevel = \"correlations\"\n\
         [[front_end]]\nname = \"e1\"\ncenter_hz = 1575.42e6\nsample_rate_hz = 6.5e6\nformat = \"ci8\"\n\
         [[front_end]]\nname = \"e5a\"\ncenter_hz = 1176.45e6\nsample_rate_hz = 21.3e6\nformat = \"ci8\"\n"
    )
}

/// Runs both scenes in a directory.
fn make_runs(here: &Path) {
    let places = [
        ("base", "latitude_deg = 37.605\nlongitude_deg = -0.986\nheight_m = 60", 1.3e-4, 5),
        ("rover", "latitude_deg = 37.609\nlongitude_deg = -0.9815\nheight_m = 72", -2.2e-4, 6),
    ];
    for (name, place, clock_bias_s, seed) in places {
        fs::write(here.join(format!("{name}.toml")), scene(name, place, clock_bias_s, seed)).unwrap();
        let done = twin(&["run", &format!("{name}.toml"), "--out", name, "--quiet"], here);
        assert_eq!(code(&done), 0, "{}", stderr(&done));
    }
}

/// Figures and verdict of a baseline.
fn judged(here: &Path, more: &[&str]) -> Value {
    let done = twin(&[&["baseline", "base", "rover", "--json"], more].concat(), here);
    assert_eq!(code(&done), 0, "{}", stderr(&done));
    serde_json::from_slice(&done.stdout).unwrap()
}

fn status<'a>(result: &'a Value, figure: &str) -> &'a str {
    let rows = result["verdict"].as_array().unwrap();
    rows.iter().find(|row| row["figure"] == figure).unwrap()["status"].as_str().unwrap()
}

/// The rover's observations with the phase of a satellite's first signal moved from an epoch on.
fn moved(text: &str, satellite: &str, first: usize, cycles: f64) -> String {
    let mut epoch = 0;
    let change = |line: &str| {
        epoch += usize::from(line.starts_with('>'));
        let Some(phase) = line.get(19..33).filter(|_| line.starts_with(satellite) && epoch > first) else {
            return format!("{line}\n");
        };
        let phase = phase.trim().parse::<f64>().unwrap() + cycles;
        format!("{}{phase:14.3}{}\n", &line[..19], &line[33..])
    };
    text.lines().map(change).collect()
}

/// Observations without any phase: code, phase, Doppler and strength follow one another.
fn without_phases(text: &str) -> String {
    let mut header = true;
    let line = |line: &str| {
        let is_header = header;
        header &= !line.contains("END OF HEADER");
        if is_header || line.starts_with('>') {
            return format!("{line}\n");
        }
        let kept = |(column, byte): (usize, char)| if column >= 3 && (column - 3) / 16 % 4 == 1 { ' ' } else { byte };
        line.chars().enumerate().map(kept).chain(['\n']).collect()
    };
    text.lines().map(line).collect()
}

#[test]
fn two_receivers_600_m_apart_are_fixed_at_the_first_epoch_of_two_bands_and_faults_are_named() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    make_runs(here);

    let whole = judged(here, &["--out", "baseline"]);
    let figures = &whole["figures"];
    let number = |name: &str| figures[name].as_f64().unwrap_or(f64::INFINITY);
    assert!((number("length_m") - 595.0).abs() < 10.0, "{figures}");
    assert_eq!(number("first_fix_two_bands_s"), 0.0, "{figures}");
    assert!(number("horizontal_rms_m") <= 0.003 && number("up_rms_m") <= 0.006, "{figures}");
    assert_eq!((number("wrong_fixes"), number("integers_wrong"), number("slips")), (0.0, 0.0, 0.0), "{figures}");
    assert!(number("integers_right") > 1000.0 && number("fix_rate") == 1.0, "{figures}");
    let rows = fs::read_to_string(here.join("baseline/baseline.csv")).unwrap();
    assert_eq!(rows.lines().count(), 1 + figures["epochs"].as_u64().unwrap() as usize);
    assert!(fs::read_to_string(here.join("baseline/verdict.csv")).unwrap().contains("horizontal error, rms"));

    let resting = judged(here, &["--static"]);
    assert_eq!(resting["figures"]["wrong_fixes"], 0, "{resting}");
    assert!(resting["figures"]["up_rms_m"].as_f64().unwrap() <= 0.006, "{resting}");

    // By the base's own codes: a base that is 10 m off turns 0.6 km by 0.3 mm.
    let moving = judged(here, &["--moving-base"]);
    assert_eq!(moving["figures"]["wrong_fixes"], 0, "{moving}");
    assert!(moving["figures"]["horizontal_rms_m"].as_f64().unwrap() <= 0.003, "{moving}");
    assert!(moving["figures"]["base_off_m"].as_f64().unwrap() > 0.1, "{moving}");
    assert_eq!(status(&moving, "base off its true position"), "pass", "{moving}");
    let both = ["baseline", "base", "rover", "--moving-base", "--base-position", "37.6056,-0.986,60"];
    assert_eq!(code(&twin(&both, here)), 2);

    // 67 m to the north.
    let wrong = judged(here, &["--base-position", "37.6056,-0.986,60"]);
    assert_eq!(status(&wrong, "base off its true position"), "fail", "{wrong}");
    assert_eq!(status(&wrong, "base off its own fixes"), "fail", "{wrong}");
    let refused = twin(&["baseline", "base", "rover", "--base-position", "37.6056,-0.986,60", "--check"], here);
    assert_eq!(code(&refused), 3, "{}", stderr(&refused));

    let path = here.join("rover/rx/observations.rnx");
    let sound = fs::read_to_string(&path).unwrap();
    fs::write(&path, moved(&sound, "E27", 0, 0.5)).unwrap();
    let half = judged(here, &[]);
    assert_eq!(half["figures"]["not_whole"], serde_json::json!(["E27 1C"]), "{half}");
    assert_eq!(half["figures"]["wrong_fixes"], 0, "{half}");
    assert_eq!(status(&half, "ambiguities that are not whole"), "fail");
    fs::write(&path, moved(&sound, "E27", 100, 0.5)).unwrap();
    let slipped = judged(here, &[]);
    assert_eq!((&slipped["figures"]["slips"], &slipped["figures"]["wrong_fixes"]), (&1.into(), &0.into()), "{slipped}");
    fs::write(&path, moved(&sound, "E27", 100, 3.0)).unwrap();
    let slipped = judged(here, &[]);
    assert_eq!((&slipped["figures"]["slips"], &slipped["figures"]["wrong_fixes"]), (&1.into(), &0.into()), "{slipped}");

    // Nothing excuses that no phase was observed: neither at the usual doubt of the ionosphere nor at any
    // other.
    fs::write(&path, without_phases(&sound)).unwrap();
    for more in [[].as_slice(), &["--ionosphere-ppm", "1000"]] {
        let codes = judged(here, more);
        assert_eq!((&codes["figures"]["fixed"], &codes["not_judged"]), (&0.into(), &Value::Null), "{codes}");
        assert_eq!(status(&codes, "time to the first fix"), "fail", "{codes}");
    }

    for (text, arguments, expected) in [
        (
            sound.replace("> 2020 11 29", "> 2021 11 29"),
            ["--mask-deg", "10"],
            "no common epochs: the base observes from 2020-11-29",
        ),
        (sound.clone(), ["--signals", "R1C"], "no common satellites"),
        (sound.split("> 2020").next().unwrap().to_owned(), ["--mask-deg", "10"], "the rover has no fix"),
        (sound.replace("> 2020 11 29 12 51", "> 2020 13 29 12 51"), ["--mask-deg", "10"], "observations.rnx: line "),
    ] {
        fs::write(&path, text).unwrap();
        let refused = twin(&[["baseline", "base", "rover"].as_slice(), &arguments].concat(), here);
        assert_eq!(code(&refused), 65, "{expected}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(expected), "{expected}: {}", stderr(&refused));
    }
    let missing = twin(&["baseline", "base", "nowhere"], here);
    assert_eq!(code(&missing), 65, "{}", stderr(&missing));
    let odd = twin(&["baseline", "base", "rover", "--signals", "X1C"], here);
    assert_eq!(code(&odd), 2, "{}", stderr(&odd));
}

/// 30 km below the edge of a storm the success rate of all integers stays low where the ionosphere is said as
/// it is, and no fix is due; below the maps of a quiet day the same receivers are fixed. One who expects a
/// quiet day in the storm is promised a fix, which the residuals refuse.
#[test]
fn fixes_are_lost_in_a_storm_as_their_success_rate_says() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    assert_eq!(code(&twin(&["scenes", "rtk_ionosphere"], here)), 0);
    let scene = here.join("rtk_ionosphere.toml");
    let storm = fs::read_to_string(&scene).unwrap();
    let map = "file = \"storm_front.25i.gz\"\n";
    let quiet = storm.replace(map, "file = \"igrg3380.10i.gz\"\nmap_start = 2010-12-04T04:51:56\n");
    assert_ne!(storm, quiet);
    fs::write(here.join("quiet.toml"), quiet).unwrap();
    let shipped = format!("{}/scenarios/igrg3380.10i.gz", env!("CARGO_MANIFEST_DIR"));
    fs::copy(shipped, here.join("igrg3380.10i.gz")).unwrap();
    for (scene, run) in [("rtk_ionosphere.toml", "storm"), ("quiet.toml", "quiet")] {
        let arguments = ["run", scene, "--level", "correlations", "--out", run, "--report", "none", "--quiet"];
        let done = twin(&arguments, here);
        assert_eq!(code(&done), 0, "{}", stderr(&done));
    }
    let found = |run: &str, ppm: &str| -> Value {
        let [base, rover] = ["base", "rover"].map(|station| format!("{run}/{station}"));
        let done = twin(&["baseline", &base, &rover, "--ionosphere-ppm", ppm, "--json"], here);
        assert_eq!(code(&done), 0, "{}", stderr(&done));
        serde_json::from_slice(&done.stdout).unwrap()
    };
    let failed = |result: &Value| {
        let rows = result["verdict"].as_array().unwrap();
        let failed: Vec<String> =
            rows.iter().filter(|row| row["status"] == "fail").map(|row| row["figure"].to_string()).collect();
        failed
    };
    let number = |result: &Value, name: &str| result["figures"][name].as_f64().unwrap_or(f64::NAN);

    let lost = found("storm", "20");
    assert!(number(&lost, "epochs") > 300.0 && number(&lost, "fixed") == 0.0, "{lost}");
    assert!(number(&lost, "most_success_rate") < 0.9 && number(&lost, "wrong_fixes") == 0.0, "{lost}");
    assert!(lost["not_judged"].as_str().unwrap().contains("success rate of all integers"), "{lost}");
    assert_eq!(failed(&lost), Vec::<String>::new(), "{lost}");

    let promised = found("storm", "1");
    assert!(number(&promised, "most_success_rate") > 0.999 && number(&promised, "fixed") == 0.0, "{promised}");
    assert!(failed(&promised).iter().any(|figure| figure.contains("epochs fixed of those that may be")), "{promised}");

    let fixed = found("quiet", "1");
    assert!(number(&fixed, "fixed") > 100.0 && number(&fixed, "wrong_fixes") == 0.0, "{fixed}");
    assert!(fixed["not_judged"].is_null() && failed(&fixed).is_empty(), "{fixed}");
}
