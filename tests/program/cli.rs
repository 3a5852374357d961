//! The program as a user meets it: exit codes, messages, and outputs that are whole or absent.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::command::{SHORT, TWIN, code, stderr, twin};

/// A directory with `short.toml` in it.
fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("short.toml"), SHORT).unwrap();
    directory
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn usage_errors_exit_with_two() {
    let here = workplace();
    fs::write(here.path().join("raw.bin"), [0; 16]).unwrap();
    for arguments in
        [&["fly"][..], &["run", "--speed"], &["receive", "raw.bin", "--out", "x"], &["generate", "short.toml"]]
    {
        assert_eq!(code(&twin(arguments, here.path())), 2, "{arguments:?}");
    }
    assert_eq!(code(&twin(&["--help"], here.path())), 0);
    // A file that is not there is said before flags that are not.
    let missing = twin(&["receive", "nosuch.bin", "--out", "x"], here.path());
    assert_eq!(code(&missing), 65);
    assert!(stderr(&missing).contains("nosuch.bin: No such file"), "{}", stderr(&missing));
    // A flag of other programs, and a bundled scene by its name, are told with what was meant.
    let other = twin(&["receive", "x.bin", "--sample-rate", "2.6e6", "--out", "x"], here.path());
    assert!(code(&other) == 2 && stderr(&other).contains("'--rate-hz'"), "{}", stderr(&other));
    for (scene, meant) in
        [("static", "`gnss-twin scenes static` copies it"), ("statc.toml", "did you mean the bundled")]
    {
        let absent = twin(&["run", scene], here.path());
        assert!(code(&absent) == 65 && stderr(&absent).contains(meant), "{}", stderr(&absent));
    }
}

/// Checks the signals that `receive` searches for. The flag selects them, and an unknown name is refused as
/// the flag's. Without either the samples' band decides: GLONASS G1 where GPS is far away.
#[test]
fn signals_are_those_of_the_flag_or_of_the_band() {
    let here = workplace();
    fs::write(here.path().join("a.ci8"), vec![0; 1_000_000]).unwrap();
    let received = |more: &[&str]| {
        let usual = ["receive", "a.ci8", "--format", "ci8", "--rate-hz", "6.6e6", "--out", "out"];
        twin(&[&usual[..], more].concat(), here.path())
    };
    let wrong = received(&["--signals", "GPS L9"]);
    assert_eq!(code(&wrong), 2, "{}", stderr(&wrong));
    assert!(stderr(&wrong).contains("--signals") && stderr(&wrong).contains("GPS L9"), "{}", stderr(&wrong));
    let searched = |output: &Output| {
        let summary: serde_json::Value =
            serde_json::from_slice(&fs::read(here.path().join("out/receiver.json")).unwrap()).unwrap();
        assert_eq!(code(output), 3, "{}", stderr(output));
        summary["settings"]["acquisition"]["signals"].to_string()
    };
    assert_eq!(searched(&received(&["--signals", "Galileo E1, GPS L1 C/A"])), r#"["Galileo E1","GPS L1 C/A"]"#);
    assert_eq!(searched(&received(&["--if-hz=-26.58e6"])), r#"["GLONASS G1"]"#);
    assert_eq!(searched(&received(&[])), r#"["GPS L1 C/A"]"#);
    let all = searched(&received(&["--signals", "all", "--if-hz=-26.58e6"]));
    assert_eq!(all, r#"["GLONASS G1"]"#);
}

/// Real samples have no signal about 0 Hz: without an intermediate frequency a carrier of another band would
/// be taken for the one that is meant.
#[test]
fn real_samples_need_their_intermediate_frequency() {
    let here = workplace();
    fs::write(here.path().join("real.bin"), vec![0; 100_000]).unwrap();
    let usual = ["receive", "real.bin", "--format", "ri8", "--rate-hz", "12e6", "--out", "out"];
    let without = twin(&usual, here.path());
    assert_eq!(code(&without), 2, "{}", stderr(&without));
    assert!(stderr(&without).contains("--if-hz or --center-hz is needed"), "{}", stderr(&without));
    let with = twin(&[&usual[..], &["--if-hz", "3e6"]].concat(), here.path());
    assert_eq!(code(&with), 3, "{}", stderr(&with));
    let help = String::from_utf8_lossy(&twin(&["receive", "--help"], here.path()).stdout).into_owned();
    for part in ["2 for a refused command line", "GPS L1 (1575.42 MHz) within", "positive if"] {
        assert!(help.split_whitespace().collect::<Vec<_>>().join(" ").contains(part), "{part}: {help}");
    }
}

/// A band that holds a signal without time of its own is searched for it, and the reason why there is no
/// position is said.
#[test]
fn a_signal_that_others_would_have_to_date_is_searched_for_alone() {
    let here = workplace();
    fs::write(here.path().join("e6.ci8"), vec![0; 3_000_000]).unwrap();
    let flags = ["--format", "ci8", "--rate-hz", "12e6", "--if-hz", "296.67e6", "--out", "out"];
    let output = twin(&[&["receive", "e6.ci8"][..], &flags].concat(), here.path());
    let text = stderr(&output);
    assert_eq!(code(&output), 3, "{text}");
    assert!(text.contains("searching for Galileo E6") && text.contains("says neither time nor orbit"), "{text}");
    assert!(!text.contains("no known signal"), "{text}");
}

/// Metadata of ION's standard are found beside the file of samples, and of its blocks the headers and footers
/// are left out.
#[test]
fn blocks_of_a_file_beside_ions_metadata_are_read_without_their_headers() {
    let here = workplace();
    let metadata = "<metadata><lane id=\"l\"><system id=\"s\"/><block><cycles>1000</cycles>
        <sizeheader>64</sizeheader><sizefooter>8</sizefooter><chunk><sizeword>1</sizeword><countwords>2</countwords>
        <lump><stream id=\"L1\"><ratefactor>1</ratefactor><quantization>8</quantization>
        <packedbits>16</packedbits><shift>Left</shift><format>IQ</format><encoding>TC</encoding><band id=\"b\"/>
        </stream></lump></chunk></block></lane><system id=\"s\"><freqbase format=\"MHz\">4</freqbase></system>
        <band id=\"b\"><centerfreq format=\"MHz\">1575.42</centerfreq>
        <translatedfreq format=\"Hz\">0</translatedfreq></band>
        <file><url>flight.usb</url><lane id=\"l\"/></file></metadata>";
    fs::write(here.path().join("flight.usbx"), metadata).unwrap();
    // Forty blocks, and 100 samples of one more.
    let block = [vec![0x7f; 64], vec![1; 2000], vec![0x7f; 8]].concat();
    fs::write(here.path().join("flight.usb"), [block.repeat(40), block[..64 + 200].to_vec()].concat()).unwrap();
    for file in ["flight.usb", "flight.usbx"] {
        let output = twin(&["receive", file, "--out", "out"], here.path());
        assert_eq!(code(&output), 3, "{}", stderr(&output));
        let summary: serde_json::Value =
            serde_json::from_slice(&fs::read(here.path().join("out/receiver.json")).unwrap()).unwrap();
        assert_eq!((summary["samples"].as_u64(), summary["cut_bytes"].as_u64()), (Some(40_100), Some(0)), "{file}");
        let _ = fs::remove_dir_all(here.path().join("out"));
    }
}

#[test]
fn a_misspelt_key_is_named_with_its_place_and_the_nearest_right_one() {
    let here = workplace();
    fs::write(here.path().join("typo.toml"), SHORT.replace("sample_rate_hz", "sampel_rate_hz")).unwrap();
    let output = twin(&["plan", "typo.toml"], here.path());
    assert_eq!(code(&output), 65);
    let message = stderr(&output);
    for part in ["typo.toml", "sampel_rate_hz", "sample_rate_hz"] {
        assert!(message.contains(part), "{message}");
    }
    fs::write(here.path().join("typo.toml"), format!("{SHORT}[receiver.trackng]\npll_order = 2\n")).unwrap();
    let output = twin(&["run", "typo.toml"], here.path());
    assert_eq!(code(&output), 65);
    let message = stderr(&output);
    for part in ["typo.toml", "trackng", "tracking"] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn a_bad_value_is_named_with_its_key_and_its_range() {
    let here = workplace();
    fs::write(here.path().join("bad.toml"), SHORT.replace("duration_s = 2", "duration_s = -2")).unwrap();
    let output = twin(&["run", "bad.toml"], here.path());
    assert_eq!(code(&output), 65);
    let message = stderr(&output);
    assert!(message.contains("duration_s") && message.contains("-2") && message.contains("bad.toml"), "{message}");
    assert_eq!(names(here.path()), ["bad.toml", "short.toml"], "nothing may be written");
}

#[test]
fn missing_or_foreign_inputs_are_bad_data() {
    let here = workplace();
    fs::create_dir(here.path().join("empty")).unwrap();
    fs::write(here.path().join("noise.toml"), [0xff, 0xfe, 0x00]).unwrap();
    for arguments in [
        &["run", "absent.toml"][..],
        &["plan", "noise.toml"],
        &["plan", "empty"],
        &["analyze", "empty"],
        &["receive", "absent.bin", "--out", "x", "--format", "ci8", "--rate-hz", "4e6"],
    ] {
        let output = twin(arguments, here.path());
        assert_eq!(code(&output), 65, "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).lines().count() <= 4, "{}", stderr(&output));
    }
}

#[test]
fn a_directory_that_is_not_a_run_is_never_replaced() {
    let here = workplace();
    fs::create_dir(here.path().join("mine")).unwrap();
    fs::write(here.path().join("mine/thesis.tex"), "years of work").unwrap();
    let output = twin(&["run", "short.toml", "--out", "mine"], here.path());
    assert_eq!(code(&output), 73, "{}", stderr(&output));
    assert_eq!(fs::read_to_string(here.path().join("mine/thesis.tex")).unwrap(), "years of work");
}

#[test]
fn the_same_scene_and_seed_give_the_same_bytes_on_any_threads_and_processor() {
    let here = workplace();
    let mut runs = Vec::new();
    for (name, threads, tunables) in
        [("a", "1", ""), ("b", "2", ""), ("c", "3", "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA")]
    {
        let output = Command::new(TWIN)
            .args(["run", "short.toml", "--keep-if", "--threads", threads, "--out", name])
            .env("GLIBC_TUNABLES", tunables)
            .current_dir(here.path())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        let files = [
            "if.sigmf-data",
            "if.sigmf-meta",
            "truth/observations.csv",
            "truth/trajectory.csv",
            "rx/acquisition.csv",
            "rx/tracking.csv",
            "rx/events.csv",
            "rx/interference.csv",
            "peaks.csv",
        ];
        runs.push(files.map(|file| fs::read(here.path().join(name).join(file)).unwrap()));
    }
    assert!(runs[0][0].len() == 2 * 2 * 2_600_000);
    assert!(runs[0] == runs[1] && runs[0] == runs[2]);
    let other = twin(&["run", "short.toml", "--keep-if", "--seed", "2", "--out", "d"], here.path());
    assert!(other.status.success());
    assert!(fs::read(here.path().join("d/if.sigmf-data")).unwrap() != runs[0][0]);
}

#[test]
fn broken_limits_exit_with_three_and_say_by_how_much_and_unusable_ones_stop_before_the_run() {
    let here = workplace();
    let limits = |name: &str, text: &str| fs::write(here.path().join(name), text).unwrap();
    limits("good.toml", "\"satellites.false_acquired\" = { max = 0 }\n[tracking]\nlosses_of_lock = { equals = 0 }\n");
    limits("broken.toml", "\"satellites.acquired\" = { max = 2 }\n\"position.horizontal_p95_m\" = { max = 1.5 }\n");
    limits("typo.toml", "\"position.horizontal_95_m\" = { max = 1.5 }\n");
    for (name, expected) in [("typo.toml", 65), ("absent.toml", 65)] {
        let output = twin(&["run", "short.toml", "--out", "run", "--check", name], here.path());
        assert_eq!(code(&output), expected, "{}", stderr(&output));
        assert!(!here.path().join("run").exists(), "limits are read before the run");
    }
    let typo = twin(&["analyze", "run", "--check", "typo.toml"], here.path());
    let message = stderr(&typo);
    assert!(message.contains("position.horizontal_95_m") && message.contains("position.horizontal_p95_m"), "{message}");

    let output = twin(&["run", "short.toml", "--out", "run", "--check", "good.toml"], here.path());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("all 2 limits of good.toml hold"));
    assert_eq!(fs::read_to_string(here.path().join("run/scenario.toml")).unwrap(), SHORT);
    let report = fs::read(here.path().join("run/report.pdf")).unwrap();
    assert!(report.starts_with(b"%PDF-"));
    let page = fs::read(here.path().join("run/report.html")).unwrap();
    assert!(page.starts_with(b"<!DOCTYPE html>") && page.ends_with(b"</html>\n"));

    let output = twin(&["analyze", "run", "--check", "broken.toml"], here.path());
    assert_eq!(code(&output), 3);
    let (text, message) = (String::from_utf8_lossy(&output.stdout).into_owned(), stderr(&output));
    for part in ["satellites.acquired", "≤ 2", "% beyond", "position.horizontal_p95_m", "no figure"] {
        assert!(text.contains(part), "{part} not in\n{text}");
    }
    assert!(message.contains("2 of 2 limits of broken.toml are broken"), "{message}");

    // Alone, it holds the verdict's own limits: this scene's codes are sound; a satellite that is taken away
    // is missed.
    let sound = twin(&["analyze", "run", "--check"], here.path());
    assert_eq!(code(&sound), 0, "{}", String::from_utf8_lossy(&sound.stdout));
    assert!(String::from_utf8_lossy(&sound.stdout).contains("limits of the verdict hold"));
    let found = here.path().join("run/rx/acquisition.csv");
    let kept: Vec<String> =
        fs::read_to_string(&found).unwrap().lines().filter(|row| !row.contains(",G23,")).map(str::to_owned).collect();
    fs::write(&found, kept.join("\n") + "\n").unwrap();
    let damaged = twin(&["analyze", "run", "--check"], here.path());
    assert_eq!(code(&damaged), 3);
    let text = String::from_utf8_lossy(&damaged.stdout).into_owned();
    assert!(text.contains("satellites in view never acquired") && text.contains("G23: 45.0 dB-Hz"), "{text}");
    assert!(fs::read(here.path().join("run/report.pdf")).unwrap() != report, "the limits are in the report");
    assert!(fs::read(here.path().join("run/report.html")).unwrap() != page, "the limits are in the page");

    // A report is written in the forms that are asked for, and what is there of others stays.
    for (form, written) in [("pdf", [true, false]), ("html", [false, true]), ("none", [false; 2]), ("both", [true; 2])]
    {
        let names = ["run/report.pdf", "run/report.html"].map(|name| here.path().join(name));
        names.iter().for_each(|path| drop(fs::remove_file(path)));
        let output = twin(&["analyze", "run", "--report", form], here.path());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert_eq!(names.map(|path| path.exists()), written, "{form}");
    }
}

#[test]
fn generate_and_receive_are_the_same_as_run() {
    let here = workplace();
    assert!(twin(&["run", "short.toml", "--keep-if", "--out", "run"], here.path()).status.success());
    let generated = twin(&["generate", "short.toml", "--out", "short.sigmf-data"], here.path());
    assert!(generated.status.success(), "{}", stderr(&generated));
    let received = twin(&["receive", "short.sigmf-meta", "--out", "rx"], here.path());
    // Results without a fix are not complete.
    assert_eq!(code(&received), 3, "{}", stderr(&received));
    assert!(stderr(&received).contains("no fix in 2.0 s: no frame"), "{}", stderr(&received));
    for (one, two) in [
        ("run/if.sigmf-data", "short.sigmf-data"),
        ("run/truth/sky.csv", "short.truth/sky.csv"),
        ("run/rx/tracking.csv", "rx/tracking.csv"),
    ] {
        assert!(fs::read(here.path().join(one)).unwrap() == fs::read(here.path().join(two)).unwrap(), "{one} {two}");
    }
    // Two seconds hold no whole subframe: the receiver says so.
    let text = String::from_utf8_lossy(&received.stdout).into_owned();
    assert!(text.contains("no frame") && text.contains("a unit of LNAV on GPS L1 C/A lasts 6 s"), "{text}");
}

#[test]
fn a_sought_part_is_that_part_of_the_whole_and_one_outside_is_refused() {
    let here = workplace();
    let generate =
        |out: &str, more: &[&str]| twin(&[&["generate", "short.toml", "--out", out], more].concat(), here.path());
    assert!(generate("whole.sigmf-data", &[]).status.success());
    let found = generate("part.sigmf-data", &["--seek", "2600001", "--samples", "50000"]);
    assert!(found.status.success(), "{}", stderr(&found));
    let read = |name: &str| fs::read(here.path().join(name)).unwrap();
    assert!(read("part.sigmf-data") == read("whole.sigmf-data")[2 * 2_600_001..2 * 2_650_001]);
    // A second and a sample after the start, by the receiver's clock: the metadata say so, and the truth
    // counts from there.
    let meta = String::from_utf8(read("part.sigmf-meta")).unwrap();
    assert!(meta.contains("2010-07-01T07:59:46.000000"), "{meta}");
    let scene = String::from_utf8(read("part.truth/scene.json")).unwrap();
    assert!(scene.contains("\"first_sample\": 2600001") && scene.contains("\"samples\": 50000"), "{scene}");
    for outside in [&["--seek", "5200000"][..], &["--seek", "5199999", "--samples", "2"], &["--samples", "0"]] {
        let output = generate("none.sigmf-data", outside);
        assert_eq!(code(&output), 2, "{outside:?}");
        assert!(stderr(&output).contains("0 to 5199999"), "{}", stderr(&output));
    }
    assert!(!here.path().join("none.sigmf-data").exists());
}

#[test]
fn a_recording_without_satellites_ends_with_the_strongest_peak_and_what_to_check() {
    let here = workplace();
    // A fixed multiplicative sequence: noise enough, and the same everywhere.
    let mut state = 1_u64;
    let noise: Vec<u8> = (0..4_000_000)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 56) as i8 / 4) as u8
        })
        .collect();
    fs::write(here.path().join("noise.bin"), noise).unwrap();
    let output = twin(&["receive", "noise.bin", "--out", "rx", "--format", "ci8", "--rate-hz", "4e6"], here.path());
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in ["threshold", "rate", "format"] {
        assert!(text.contains(part), "{text}");
    }
}

/// The satellites that `acquisition.csv` below a directory says were acquired.
fn acquired(results: &Path) -> Vec<String> {
    let text = fs::read_to_string(results.join("acquisition.csv")).unwrap();
    let rows = text.lines().filter(|row| row.split(',').nth(3) == Some("true"));
    rows.map(|row| row.split(',').nth(1).unwrap().to_owned()).collect()
}

/// A fifth of a second in two bits: whole bytes, packed by flags and by metadata, as one of two channels, in
/// a data set of another name with a header, and in an archive that another program wrote. All are the same
/// samples.
#[test]
fn packed_samples_channels_headers_and_archives_are_received_as_what_they_hold() {
    let here = workplace();
    fs::write(here.path().join("short.toml"), SHORT.replace("duration_s = 2", "duration_s = 0.2")).unwrap();
    assert_eq!(code(&twin(&["generate", "short.toml", "--out", "short.sigmf-data"], here.path())), 0);
    let write = |name: &str, bytes: &[u8]| fs::write(here.path().join(name), bytes).unwrap();
    let fine: Vec<i8> =
        fs::read(here.path().join("short.sigmf-data")).unwrap().into_iter().map(|byte| byte as i8).collect();
    // Magnitudes above the scatter are 3, those below 1.
    let power = fine.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>() / fine.len() as f64;
    let large = |value: i8| f64::from(value).powi(2) > power;
    let coarse: Vec<i8> =
        fine.iter().map(|value| if large(*value) { 3 } else { 1 } * if *value < 0 { -1 } else { 1 }).collect();
    let bytes: Vec<u8> = coarse.iter().map(|value| *value as u8).collect();
    write("whole.bin", &bytes);
    let code_of = |value: &i8| u8::from(value.abs() == 3) | u8::from(*value < 0) << 1;
    let byte = |four: &[i8]| four.iter().rev().fold(0, |byte, value| byte << 2 | code_of(value));
    let packed: Vec<u8> = coarse.chunks(4).map(byte).collect();
    write("packed.bin", &packed);
    write("named.sigmf-data", &packed);
    let metadata = |keys: &str, first: &str| {
        format!(
            r#"{{"global": {{"core:version": "1.2.0", "core:sample_rate": 2600000, {keys}}},
                "captures": [{{"core:sample_start": 0, "core:frequency": 1575420000{first}}}], "annotations": []}}"#
        )
    };
    let own = r#""core:datatype": "ru8", "gnss_twin:bits": 2, "gnss_twin:encoding": "sign-magnitude",
        "gnss_twin:bit_order": "lsb", "core:extensions": [{"name": "gnss_twin", "version": "0.1.0", "optional": false}]"#;
    write("named.sigmf-meta", metadata(own, "").as_bytes());
    let other: Vec<u8> = bytes.chunks(2).flat_map(|pair| [7, 9, pair[0], pair[1]]).collect();
    write("two.bin", &other);
    let headed: Vec<u8> = b"sixteen bytes...".iter().chain(&bytes).chain(b"end").copied().collect();
    write("headed.dat", &headed);
    let keys = r#""core:datatype": "ci8", "core:dataset": "headed.dat", "core:trailing_bytes": 3"#;
    write("headed.sigmf-meta", metadata(keys, r#", "core:header_bytes": 16"#).as_bytes());
    fs::create_dir(here.path().join("kept")).unwrap();
    write("kept/kept.sigmf-data", &bytes);
    write("kept/kept.sigmf-meta", metadata(r#""core:datatype": "ci8""#, "").as_bytes());
    let tar = ["--format=ustar", "-cf", "kept.sigmf", "kept"];
    assert!(Command::new("tar").args(tar).current_dir(here.path()).status().unwrap().success());

    let raw = ["--rate-hz", "2.6e6"];
    let bits = ["--bits", "2", "--encoding", "sign-magnitude", "--lowest-first"];
    let ways: [(&str, Vec<&str>); 6] = [
        ("whole.bin", [&["--format", "ci8"][..], &raw].concat()),
        ("packed.bin", [&bits[..], &raw].concat()),
        ("named.sigmf-meta", vec![]),
        ("two.bin", [&["--format", "ci8", "--channels", "2", "--channel", "2"][..], &raw].concat()),
        ("headed.sigmf-meta", vec![]),
        ("kept.sigmf", vec![]),
    ];
    let mut found = Vec::new();
    for (number, (file, flags)) in ways.iter().enumerate() {
        let out = format!("rx{number}");
        let received = twin(&[&["receive", file, "--out", &out][..], flags].concat(), here.path());
        // Satellites, and no fix in so short a time.
        assert_eq!(code(&received), 3, "{file}: {}", stderr(&received));
        let table = |name| fs::read(here.path().join(&out).join(name)).unwrap();
        found.push((table("acquisition.csv"), table("tracking.csv")));
        assert!(acquired(&here.path().join(&out)).len() >= 6, "{file}");
        assert_eq!(found[number], found[0], "{file}");
    }
    for (arguments, words) in [
        (
            &["receive", "two.bin", "--format", "ci8", "--channels", "2", "--rate-hz", "2.6e6", "--out", "x"][..],
            "--channel 1 to 2",
        ),
        (&["receive", "packed.bin", "--bits", "5", "--rate-hz", "2.6e6", "--out", "x"], "5 bits a value"),
        (&["receive", "packed.bin", "--bits", "2", "--format", "ci8", "--out", "x"], "cannot be used with"),
    ] {
        let refused = twin(arguments, here.path());
        assert_eq!(code(&refused), 2, "{}", stderr(&refused));
        assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    }
}

#[test]
fn a_recording_without_a_sample_is_bad_input_and_leaves_nothing() {
    let here = workplace();
    for (bytes, format) in [(0, "ci8"), (1, "ci8"), (7, "cf32")] {
        fs::write(here.path().join("raw.bin"), vec![1; bytes]).unwrap();
        let output = twin(&["receive", "raw.bin", "--out", "rx", "--format", format, "--rate-hz", "4e6"], here.path());
        assert_eq!(code(&output), 65, "{}", stderr(&output));
        assert!(stderr(&output).contains("raw.bin: no whole sample"), "{}", stderr(&output));
        assert!(!here.path().join("rx").exists());
    }
}

#[test]
fn ten_milliseconds_are_searched_and_reported_in_milliseconds() {
    let here = workplace();
    assert!(
        twin(&["generate", "short.toml", "--out", "s.sigmf-data", "--samples", "26000"], here.path()).status.success()
    );
    let output = twin(&["receive", "s.sigmf-data", "--out", "rx"], here.path());
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("10.0 ms received") && text.contains("there are 10.0 ms"), "{text}");
    // Four sums of 2 ms find 45 dB-Hz (256 on average against 56) in all but the worst place of code, Doppler
    // and data bit.
    let sky = fs::read_to_string(here.path().join("s.truth/sky.csv")).unwrap();
    let found = acquired(&here.path().join("rx"));
    assert!(found.len() >= 8 && found.iter().all(|sv| sky.contains(sv)), "{found:?}");
    // Less than two code periods.
    assert!(
        twin(&["generate", "short.toml", "--out", "t.sigmf-data", "--samples", "5000"], here.path()).status.success()
    );
    let output = twin(&["receive", "t.sigmf-data", "--out", "rx"], here.path());
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(stderr(&output).contains("no fix in 1.9 ms: nothing was searched: 5000 samples"), "{}", stderr(&output));
}

#[test]
fn without_a_start_time_the_era_of_the_week_is_said_with_the_flag_that_sets_it() {
    let here = workplace();
    // Subframe 1 with the week begins two seconds after this start.
    let text = SHORT.replace("08:00:00", "08:05:58").replace("duration_s = 2", "duration_s = 18");
    fs::write(here.path().join("week.toml"), text).unwrap();
    assert!(twin(&["generate", "week.toml", "--out", "week.sigmf-data"], here.path()).status.success());
    fs::rename(here.path().join("week.sigmf-data"), here.path().join("raw.bin")).unwrap();
    let receive = ["receive", "raw.bin", "--out", "rx", "--format", "ci8", "--rate-hz", "2.6e6"];
    let output = twin(&receive, here.path());
    for part in ["weeks modulo 1024", "week_reference = \"2024-01-01T00:00:00\"", "--start", "2030-02-14T"] {
        assert!(stderr(&output).contains(part), "{part}: {}", stderr(&output));
    }
    let output = twin(&[&receive[..], &["--start", "2010-07-01T08:05:58"]].concat(), here.path());
    assert!(!stderr(&output).contains("1024"), "{}", stderr(&output));
}

#[test]
fn a_file_outside_the_scenario_s_directory_is_read_when_that_is_allowed() {
    let here = workplace();
    fs::create_dir(here.path().join("scenes")).unwrap();
    let motion = "kind = \"static\"\nlatitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130.0\n";
    assert!(SHORT.contains(motion));
    let text = SHORT.replace(motion, "kind = \"file\"\nfile = \"../ride.csv\"\n");
    fs::write(here.path().join("scenes/ride.toml"), text).unwrap();
    let row = |t: f64| format!("{t},968890.7,5628546.7,2830022.4\n");
    let ride = format!("time_s,x_m,y_m,z_m\n{}{}{}", row(0.0), row(2.0), row(4.0));
    fs::write(here.path().join("ride.csv"), ride).unwrap();
    let refused = twin(&["plan", "scenes/ride.toml"], here.path());
    assert_eq!(code(&refused), 65);
    assert!(stderr(&refused).contains("--allow-outside"), "{}", stderr(&refused));
    for command in [
        &["plan", "scenes/ride.toml"][..],
        &["generate", "scenes/ride.toml", "--out", "s.sigmf-data", "--samples", "10"],
    ] {
        let allowed = twin(&[command, &["--allow-outside"]].concat(), here.path());
        assert!(allowed.status.success(), "{command:?}: {}", stderr(&allowed));
    }
    assert!(twin(&["run", "--help"], here.path()).stdout.windows(15).any(|text| text == b"--allow-outside"));
}

#[test]
fn a_full_disk_and_a_closed_pipe_end_in_their_exit_codes_without_a_panic() {
    let here = workplace();
    let full = Command::new(TWIN)
        .args(["plan", "short.toml"])
        .current_dir(here.path())
        .stdout(fs::OpenOptions::new().write(true).open("/dev/full").unwrap())
        .output()
        .unwrap();
    assert_eq!(code(&full), 75, "{}", stderr(&full));
    let closed = Command::new("sh")
        .args(["-c", &format!("{{ sleep 0.2; '{TWIN}' plan short.toml; echo $? >status; }} | true")])
        .current_dir(here.path())
        .output()
        .unwrap();
    assert!(!stderr(&closed).contains("panicked"), "{}", stderr(&closed));
    assert_eq!(fs::read_to_string(here.path().join("status")).unwrap().trim(), "141");
}

#[test]
fn an_interrupted_run_leaves_nothing_and_says_which_signal() {
    let here = workplace();
    fs::write(here.path().join("long.toml"), SHORT.replace("duration_s = 2", "duration_s = 600")).unwrap();
    for (signal, expected) in [("INT", 130), ("TERM", 143)] {
        let mut child = Command::new(TWIN)
            .args(["run", "long.toml", "--out", "long"])
            .current_dir(here.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(1500));
        let kill = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        assert_eq!(child.wait().unwrap().code(), Some(expected), "{signal}");
        assert_eq!(names(here.path()), ["long.toml", "short.toml"], "{signal}");
    }
}

/// The one object on standard output of a command that succeeds.
fn object(arguments: &[&str], directory: &Path) -> serde_json::Value {
    let output = twin(arguments, directory);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn results_are_words_or_one_object_or_nothing_as_the_flags_say() {
    let here = workplace();
    let at = here.path();
    let plan = object(&["plan", "short.toml", "--json"], at);
    let in_view = plan["front_ends"][0]["plan"]["satellites"].as_array().unwrap().len();
    assert!(in_view > 6 && plan["front_ends"][0]["loops"].as_array().unwrap().len() == in_view, "{plan}");
    let made = object(&["generate", "short.toml", "--out", "if.sigmf-data", "--json"], at);
    assert_eq!((&made["made"][0]["samples"], &made["samples"]), (&5_200_000.into(), &"if.sigmf-data".into()));
    assert_eq!(made["made"][0]["satellites"].as_array().unwrap().len(), in_view, "{made}");
    assert!(at.join(made["truth"].as_str().unwrap()).join("scene.json").exists());
    let run = object(&["run", "short.toml", "--out", "run", "--json"], at);
    let summary: serde_json::Value = serde_json::from_slice(&fs::read(at.join("run/summary.json")).unwrap()).unwrap();
    assert_eq!((&run["summary"], &run["results"]), (&summary, &"run".into()));
    let count = |verdict: &serde_json::Value| {
        ["pass", "marginal", "fail"].map(|key| verdict[key].as_u64().unwrap()).iter().sum::<u64>()
    };
    let table = fs::read_to_string(at.join("run/verdict.csv")).unwrap();
    let not_judged = run["verdict"]["not_judged"].as_array().unwrap();
    assert_eq!(count(&run["verdict"]) + not_judged.len() as u64, table.lines().count() as u64 - 1, "{run}");
    assert!(!not_judged.is_empty() && summary["not_judged"] == run["verdict"]["not_judged"], "{run}");
    assert_eq!(run["verdict"]["fail"], run["verdict"]["failed"].as_array().unwrap().len(), "{run}");
    let again = object(&["analyze", "run", "--json"], at);
    assert_eq!((&again["verdict"], &again["summary"]["position"]), (&run["verdict"], &summary["position"]));
    // Two seconds give no fix: exit code 3 and its reason, results none the less.
    let received = twin(&["receive", "if.sigmf-data", "--out", "rx", "--json"], at);
    assert_eq!(code(&received), 3, "{}", stderr(&received));
    let received: serde_json::Value = serde_json::from_slice(&received.stdout).unwrap();
    let written: serde_json::Value = serde_json::from_slice(&fs::read(at.join("rx/receiver.json")).unwrap()).unwrap();
    assert_eq!(received["receiver"], written);
    // The same, and nothing is said.
    for arguments in [
        &["plan", "short.toml", "-q"][..],
        &["generate", "short.toml", "--out", "if.sigmf-data", "--quiet"],
        &["run", "short.toml", "--out", "run", "--quiet"],
        &["analyze", "run", "--quiet"],
    ] {
        let output = twin(arguments, at);
        assert_eq!((code(&output), output.stdout.len()), (0, 0), "{arguments:?}: {}", stderr(&output));
        let told = stderr(&output);
        assert!(told.lines().all(|line| line.starts_with("warning: ")), "{arguments:?}: {told}");
    }
    let quiet = twin(&["receive", "if.sigmf-data", "--out", "rx", "--quiet"], at);
    assert_eq!((code(&quiet), quiet.stdout.len()), (3, 0));
    assert_eq!(stderr(&quiet).lines().count(), 1, "{}", stderr(&quiet));
    // An object is a result that a script asked for: it is printed, and nothing else is.
    let both = twin(&["plan", "short.toml", "--quiet", "--json"], at);
    assert_eq!((code(&both), stderr(&both).contains("this machine")), (0, false), "{}", stderr(&both));
    assert!(stderr(&twin(&["plan", "short.toml"], at)).contains("this machine needs about "));
    assert!(serde_json::from_slice::<serde_json::Value>(&both.stdout).unwrap()["front_ends"].is_array());
    for arguments in [
        &["generate", "short.toml", "--out", "-", "--json"][..],
        &["receive", "if.sigmf-data", "--out", "x", "--nmea", "-", "--json"],
    ] {
        assert_eq!(code(&twin(arguments, at)), 2, "{arguments:?}");
    }
}

#[test]
fn forms_of_other_programs_lie_in_the_truth_if_they_are_asked_for() {
    let here = workplace();
    let at = here.path();
    let scene = SHORT.replace("duration_s = 2", "duration_s = 1");
    fs::write(at.join("short.toml"), scene).unwrap();
    let generate =
        |more: &[&str]| twin(&[&["generate", "short.toml", "--out", "if.sigmf-data"][..], more].concat(), at);
    assert_eq!(code(&generate(&[])), 0);
    let tables = names(&at.join("if.truth"));
    let all = generate(&["--rinex=4.02", "--nmea", "--maps"]);
    assert_eq!(code(&all), 0, "{}", stderr(&all));
    let more: Vec<String> = names(&at.join("if.truth")).into_iter().filter(|name| !tables.contains(name)).collect();
    let expected = ["navigation.rnx", "observations.rnx", "trajectory.gpx", "trajectory.kml", "trajectory.nmea"]
        .map(str::to_owned);
    assert_eq!(more, expected);
    let text = |name: &str| fs::read_to_string(at.join("if.truth").join(name)).unwrap();
    let version = |name| text(name).lines().next().unwrap().trim_start()[..4].to_owned();
    assert_eq!((version("observations.rnx"), version("navigation.rnx")), ("4.02".to_owned(), "4.02".to_owned()));
    assert_eq!(
        (text("trajectory.nmea").matches("GGA").count(), text("trajectory.gpx").matches("<trkpt").count()),
        (10, 1)
    );
    for (more, words) in
        [(&["--rinex=2.11"][..], "expected 3.05 or 4.02"), (&["--out", "-", "--maps"], "--maps lies in the truth")]
    {
        let refused = twin(
            &[&["generate", "short.toml"][..], more, &["--out", "x"][..if more.len() == 1 { 2 } else { 0 }]].concat(),
            at,
        );
        assert_eq!(code(&refused), 2);
        assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    }
}

#[test]
fn packed_samples_are_opened_by_what_is_written_beside_them_and_are_those_of_whole_bytes() {
    let here = workplace();
    let at = here.path();
    let with = |bits: u32| format!("{}[adc]\nbits = {bits}\n", SHORT.replace("duration_s = 2", "duration_s = 0.1"));
    for (bits, flags) in [
        (1, &["--encoding", "negative-sign"][..]),
        (2, &["--encoding", "sign-magnitude", "--qi", "--lowest-first"]),
        (4, &["--word-bytes", "4", "--big-endian"]),
    ] {
        fs::write(at.join("few.toml"), with(bits)).unwrap();
        let generate = |out: &str, more: &[&str]| {
            let made = twin(&[&["generate", "few.toml", "--out", out][..], more].concat(), at);
            assert_eq!(code(&made), 0, "{more:?}: {}", stderr(&made));
            let _ = fs::remove_dir_all(at.join(format!("rx-{out}")));
            let received = twin(&["receive", out, "--out", &format!("rx-{out}")], at);
            assert_eq!(code(&received), 3, "{}", stderr(&received));
        };
        let text = bits.to_string();
        generate("whole.sigmf-data", &[]);
        generate("packed.sigmf-data", &[&["--bits", &text][..], flags].concat());
        let bytes = |name: &str| fs::metadata(at.join(name)).unwrap().len();
        assert_eq!(bytes("whole.sigmf-data") * u64::from(bits), 8 * bytes("packed.sigmf-data"));
        for table in ["acquisition.csv", "tracking.csv"] {
            let of = |name: &str| fs::read(at.join(format!("rx-{name}.sigmf-data")).join(table)).unwrap();
            assert!(of("whole") == of("packed"), "{bits} bits: {table}");
        }
    }
    // Four bits are there now.
    for (arguments, words) in [
        (&["--bits", "2"][..], "the scene's converter has 4 bits: expected a table adc with bits = 2"),
        (
            &["--bits", "4", "--samples", "3", "--word-bytes", "4"],
            "3 samples are no multiple of the 4 that fill a word",
        ),
        (&["--bits", "4", "--pocketsdr"], "--pocketsdr and --bits"),
        (&["--bits", "5"], "5 bits a value"),
        (&["--bits", "4", "--format", "ci8"], "cannot be used with"),
    ] {
        let refused = twin(&[&["generate", "few.toml", "--out", "no.sigmf-data"][..], arguments].concat(), at);
        assert_eq!(code(&refused), 2, "{arguments:?}");
        assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    }
    let tagged = twin(&["generate", "few.toml", "--out", "if.sigmf-data", "--pocketsdr"], at);
    assert_eq!(code(&tagged), 0, "{}", stderr(&tagged));
    let tag = fs::read_to_string(at.join("if.sigmf-data.tag")).unwrap();
    assert!(tag.contains("FMT  = CS8\nF_S  = 2.6\nF_LO = 1575.42\nIQ   = 2\n"), "{tag}");
}
