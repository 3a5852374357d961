//! Files that describe signals: each error has its line.

use super::*;

const FILE: &str = "name = \"filed\"\nrinex = \"1D\"\nlike = \"GPS L1 C/A\"\ncarrier_hz = 1.5e9\n[[component]]\n\
    power_share = 1\nchip_rate_hz = 1e6\ncode_chips = 1000\npulse = [1, -1]\nmessage = true\n[component.codes]\n";

/// A good file: a code of 1000 chips for two satellites.
fn good() -> String {
    format!("{FILE}G01 = \"{}\"\nG02 = \"{}\"\n", "0123456789".repeat(25), "abcde".repeat(50))
}

/// The scenario with the text in `own.signal`, or its refusal with the directory left out.
fn with_file(text: &str, line: &str) -> Result<Scenario, String> {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("own.signal"), text).unwrap();
    let scene = format!("{line}\n{MINIMAL}{STATIC}");
    Scenario::parse_in(&scene, "scene.toml", directory.path(), false)
        .map_err(|error| error.to_string().replace(&format!("{}/", directory.path().display()), ""))
}

#[test]
fn a_scene_names_the_signal_of_its_file_and_what_it_takes_from_another_is_that_one_s() {
    let line = "signal_file = \"own.signal\"\nsignals = [\"filed\"]";
    let [signal] = with_file(&good(), line).unwrap().signals[..] else { panic!() };
    assert_eq!((signal.name, signal.system, signal.centre_hz()), ("filed", L1_CA.system, 1.5e9));
    assert_eq!(signal.minimum_power_dbw, L1_CA.minimum_power_dbw);
    assert!(signal.satellites().map(|sv| sv.number).eq([1, 2]));
    // Read again, also in an array, it is the same one.
    let line = "signal_file = [\"own.signal\", \"own.signal\"]\nsignals = [\"filed\", \"GPS L1 C/A\"]";
    assert!(std::ptr::eq(with_file(&good(), line).unwrap().signals[0], signal));
    let changed = with_file(&good().replace("1.5e9", "1.4e9"), line).unwrap_err();
    assert_eq!(changed, "own.signal:1:8: name = \"filed\": expected a name that no other signal has");
}

#[test]
fn every_fault_of_a_file_is_refused_at_its_place() {
    let line = "signal_file = \"own.signal\"\nsignals = [\"faulty\"]";
    let good = || good().replace("filed", "faulty");
    for (from, to, refusals) in [
        (
            "power_share = 1\n",
            "power_share = 1\noverlay = \"01\"\n",
            vec!["unknown key 'component[1].overlay': it is called 'secondary_code' now; known here: "],
        ),
        ("rinex", "rinx", vec!["own.signal:2:1: unknown key 'rinx': did you mean 'rinex'?"]),
        (
            "GPS L1 C/A",
            "GPS L1C/A",
            vec!["own.signal:3:8: like = \"GPS L1C/A\": expected one of", "did you mean GPS L1"],
        ),
        ("1.5e9", "1.5e7", vec!["own.signal:4:14: carrier_hz = 1.5e7: expected a number from 1e8 to 3e10 Hz"]),
        (
            "power_share = 1\nchip_rate_hz = 1e6",
            "power_share = 2\nchiprate_hz = 1e6",
            vec![
                "own.signal:6:15: component[1].power_share = 2",
                "own.signal:7:1: unknown key 'component[1].chiprate_hz'",
            ],
        ),
        ("[1, -1]", "[1, 0]", vec!["own.signal:9:9: component[1].pulse = [1, 0]: expected 1 to 64 steps of -1 or 1"]),
        (
            "code_chips = 1000",
            "code_chips = 500",
            vec!["own.signal:12:7: component[1].codes.G01", "125 hexadecimal digits"],
        ),
        ("abcde", "abcdg", vec!["own.signal:13:7: component[1].codes.G02 = ", "expected 250 hexadecimal digits"]),
        ("G02", "E02", vec!["component[1].codes = ", "expected satellites like G01 as keys, not \"E02\""]),
        ("name", "= 1\nname", vec!["own.signal:1:1: "]),
    ] {
        let text = good().replacen(from, to, if from == "abcde" { usize::MAX } else { 1 });
        let error = with_file(&text, line).unwrap_err();
        assert!(refusals.iter().all(|refusal| error.contains(refusal)), "{from} as {to}: {error}");
        // The scene's own line would be unknown only because of the file.
        assert!(!error.contains("scene.toml"), "{error}");
    }
    let missing = with_file(&good(), "signal_file = \"other.signal\"").unwrap_err();
    assert!(missing.starts_with("scene.toml: signal_file = \"other.signal\": cannot be read"), "{missing}");
    let outside = with_file(&good(), "signal_file = \"/dev/null\"").unwrap_err();
    assert!(outside.contains("lies outside the scenario's directory"), "{outside}");
}
