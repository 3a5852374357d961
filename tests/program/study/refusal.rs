//! Refused studies, with their exit codes and messages.

use super::*;

/// The study with one text for another must be refused with these words and leave nothing behind.
fn refused(from: &str, to: &str, words: &[&str]) {
    let changed = MODELLED.replace(from, to);
    assert_ne!(changed, MODELLED, "{from}");
    let here = workplace(&changed);
    let output = study(&["plan", "study.toml", "-o", "out"], here.path());
    assert_eq!(code(&output), 65, "{to}: {}", text(&output));
    for word in words {
        assert!(text(&output).contains(word), "{to}: {word:?} is not in {}", text(&output));
    }
    assert!(!here.path().join("out").exists(), "{to}");
}

#[test]
fn a_bad_study_is_refused_with_place_key_and_remedy() {
    refused("repetitions", "repetitons", &["study.toml:5:1", "repetitons", "did you mean 'repetitions'"]);
    refused("\"phase_sigma_deg\"", "\"phase_sgma_deg\"", &["study.toml:6:8", "did you mean phase_sigma_deg"]);
    refused("repetitions = 5", "repetitions = 0", &["repetitions = 0", "1 to 1000000"]);
    refused("duration_s = 8", "duration_s = -8", &["study.toml:9:14", "measure.duration_s = -8", "0.1"]);
    // An axis by its place in the study.
    refused("receiver.tracking.pll_order", "receiver.tracking.pll_oder", &["study.toml:19:7", "pll_oder", "pll_order"]);
    refused("signal.cn0_dbhz", "signal.cn_dbhz", &["study.toml:14:7", "did you mean 'cn0_dbhz'"]);
    refused("values = [2, 3]", "values = [2, 4]", &["receiver.tracking.pll_order = 4", "2 or 3"]);
    refused("values = [2, 3]", "values = [2, 2.0]", &["each but once"]);
    refused("values = [2, 3]", "values = []", &["at least one"]);
    refused("step = 2", "step = -2", &["step", "from 30 to 48"]);
    refused("step = 2", "count = 3\nspacing = \"lgo\"", &["log"]);
    refused("key = \"signal.cn0_dbhz\"", "key = \"seed\"", &["repetitions vary the seed"]);
    refused("[measure]", "scenario = \"x.toml\"\n[measure]", &["which has no scene"]);
    // With updates every 4 ms.
    refused("18]", "18, 120]", &["receiver.tracking.pll_bandwidth_hz = 120", "at most 100 Hz"]);
    refused("repetitions = 5", "repetitions = 1000000", &["cases", "10000000"]);
    refused("panel = ", "#panel = ", &["a use of axis receiver.tracking.pll_order"]);
    refused(
        "series = \"receiver.tracking.pll_b",
        "series = \"receiver.tracking.dll_b",
        &["series", "pll_bandwidth_hz"],
    );
}

#[test]
fn zipped_axes_step_together() {
    let zipped = MODELLED.replace("values = [2, 3]", "values = [2, 3, 3.0]");
    let here = workplace(&zipped);
    assert_eq!(code(&study(&["plan", "study.toml", "-o", "out"], here.path())), 65, "the same value twice");
    let zipped = MODELLED
        .replace("values = [2, 3]", "values = [1, 2, 4]\nzip = \"pair\"")
        .replace("pll_order", "integration")
        .replace("values = [5, 10.0, 18]", "values = [5, 10.0, 18]\nzip = \"pair\"")
        .replace("panel = \"receiver.tracking.integration\"", "");
    let here = workplace(&zipped);
    let planned = good(&["plan", "study.toml", "-o", "out"], here.path());
    assert!(planned.contains("150 cases (30 cells, 5 repetitions)"), "{planned}");
    let manifest = fs::read_to_string(here.path().join("out/manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    assert_eq!(manifest["n_cases"], 150);
    assert_eq!(manifest["axes"].as_array().unwrap().len(), 3);
    let unequal = zipped.replace("[1, 2, 4]", "[1, 2]");
    fs::write(here.path().join("unequal.toml"), unequal).unwrap();
    let output = study(&["plan", "unequal.toml", "-o", "no"], here.path());
    assert_eq!(code(&output), 65);
    assert!(text(&output).contains("as the other axis of zip"), "{}", text(&output));
}

#[test]
fn exit_codes_tell_what_is_worth_another_try() {
    let here = workplace(MODELLED);
    let here = here.path();
    assert_eq!(code(&study(&[], here)), 2);
    assert_eq!(code(&study(&["plan", "study.toml"], here)), 2);
    assert_eq!(code(&study(&["absent.toml"], here)), 65);
    assert_eq!(code(&study(&["status", "absent"], here)), 65);
    good(&["plan", "study.toml", "-o", "out", "--shards", "10"], here);
    // The same plan again changes nothing; another one is refused.
    good(&["plan", "study.toml", "-o", "out", "--shards", "10"], here);
    let other = study(&["plan", "study.toml", "-o", "out", "--shards", "9"], here);
    assert_eq!(code(&other), 73, "{}", text(&other));
    assert!(text(&other).contains("cut into other shards") && text(&other).contains("--fresh"), "{}", text(&other));
    assert_eq!(code(&study(&["run", "out", "--shard", "10"], here)), 2);
    assert_eq!(code(&study(&["run", "out", "--shard", "first"], here)), 2);
    assert_eq!(code(&study(&["report", "out"], here)), 3);
    fs::create_dir(here.join("mine")).unwrap();
    fs::write(here.join("mine/thesis.tex"), "years of work").unwrap();
    for arguments in [&["plan", "study.toml", "-o", "mine"][..], &["study.toml", "-o", "mine", "--fresh"]] {
        assert_eq!(code(&study(arguments, here)), 73);
    }
    assert_eq!(fs::read_to_string(here.join("mine/thesis.tex")).unwrap(), "years of work");
}

#[test]
fn a_manifest_is_checked_and_never_believed() {
    let here = workplace(MODELLED);
    let here = here.path();
    good(&["plan", "study.toml", "-o", "out"], here);
    let path = here.join("out/manifest.json");
    let manifest = fs::read_to_string(&path).unwrap();
    for (from, to, word) in [
        ("\"n_cases\": 300", "\"n_cases\": 200", "does not follow from its inputs"),
        ("\"path\": \"inputs/study.toml\"", "\"path\": \"../study.toml\"", "below the study's directory"),
        ("\"path\": \"inputs/study.toml\"", "\"path\": \"/etc/passwd\"", "below the study's directory"),
        ("\"schema\": 1", "\"schema\": 2", "schema 2"),
        ("\"seed\": 9", "\"seed\": 9, \"command\": \"rm\"", "unknown field"),
        ("\"sha256\": \"", "\"sha256\": \"0", "it has been changed"),
        ("{", "", "manifest"),
    ] {
        let changed = manifest.replacen(from, to, 1);
        assert_ne!(changed, manifest, "{from}");
        fs::write(&path, changed).unwrap();
        let output = study(&["run", "out"], here);
        assert_eq!(code(&output), 65, "{to}: {}", text(&output));
        assert!(text(&output).contains(word), "{to}: {}", text(&output));
    }
    fs::write(&path, &manifest).unwrap();
    fs::write(here.join("out/inputs/study.toml"), MODELLED.replace("seed = 9", "seed = 8")).unwrap();
    assert_eq!(code(&study(&["run", "out"], here)), 65);
}
