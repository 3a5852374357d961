//! Several front ends as a user meets them: what is written, what each command takes, and what it refuses.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use analysis::read::PeakRow;
use gnss::sigmf;
use gnss::signal::Link;
use study::sweep::sha512_hex;

/// A static scene of two seconds at two rates.
const TWO: &str = r#"
name = "two"
start = "2010-07-01T08:00:00"
duration_s = 2
seed = 1
[motion]
kind = "static"
latitude_deg = 26.5123
longitude_deg = 80.2329
height_m = 130.0
[power]
cn0_dbhz = 45.0
[noise]
[[front_end]]
name = "wide"
center_hz = 1575.42e6
sample_rate_hz = 4e6
[[front_end]]
name = "narrow"
center_hz = 1575.32e6
sample_rate_hz = 2.6e6
[front_end.adc]
bits = 2
agc_window_s = 0.005
"#;

fn twin(arguments: &[&str], directory: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gnss-twin"));
    command.args(arguments).current_dir(directory).stdin(Stdio::null()).output().unwrap()
}

fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("two.toml"), TWO).unwrap();
    directory
}

/// The standard output of a command that succeeds.
fn done(arguments: &[&str], directory: &Path) -> String {
    let output = twin(arguments, directory);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A refusal with that exit code, which says every one of `words` and writes nothing.
fn refused(arguments: &[&str], directory: &Path, code: i32, words: &[&str]) {
    let names = || fs::read_dir(directory).unwrap().count();
    let before = names();
    let output = twin(arguments, directory);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
    assert!(words.iter().all(|word| text.contains(word)), "{arguments:?}: {text}");
    assert_eq!(names(), before, "{arguments:?}");
}

#[test]
fn every_front_end_has_its_files_which_are_those_that_it_has_alone() {
    let here = workplace();
    let text = done(&["generate", "two.toml", "--out", "both", "--threads", "2"], here.path());
    assert!(text.contains("wide: 8000000 samples") && text.contains("narrow: 5200000 samples"), "{text}");
    let both = here.path().join("both");
    let mut names: Vec<String> =
        fs::read_dir(&both).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let expected = [
        "narrow.sigmf-data",
        "narrow.sigmf-meta",
        "truth",
        "two.sigmf-collection",
        "wide.sigmf-data",
        "wide.sigmf-meta",
    ];
    assert_eq!(names, expected);
    let collection = fs::read_to_string(both.join("two.sigmf-collection")).unwrap();
    assert_eq!(sigmf::parse_collection(&collection, "x").unwrap(), ["wide", "narrow"]);
    for (name, center_hz) in [("wide", 1575.42e6), ("narrow", 1575.32e6)] {
        let out = format!("{name}.sigmf-data");
        done(&["generate", "two.toml", "--front-end", name, "--out", &out], here.path());
        let read = |path: &Path| fs::read(path).unwrap();
        assert!(read(&here.path().join(&out)) == read(&both.join(&out)), "{name}");
        let meta = read(&both.join(format!("{name}.sigmf-meta")));
        assert!(collection.contains(&sha512_hex(&meta)), "{name}");
        let meta = sigmf::parse(&String::from_utf8(meta).unwrap(), name).unwrap();
        assert_eq!(meta.center_hz, center_hz);
    }
    // Of one signal in two front ends the truth has one row; by the samples of the first, it is that one's
    // own.
    let rows = |path: &str| fs::read_to_string(here.path().join(path)).unwrap();
    assert_eq!(rows("both/truth/observations.csv"), rows("wide.truth/observations.csv"));

    // A collection is one reception; what is said of one recording's samples is refused.
    let collection = "both/two.sigmf-collection";
    refused(
        &["receive", collection, "--format", "ci8", "--out", "rx"],
        here.path(),
        2,
        &["--format", "2 recordings", "both/wide.sigmf-meta, both/narrow.sigmf-meta"],
    );
    let output = twin(&["receive", collection, "--out", "rx"], here.path());
    // Two seconds are too short for a fix.
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let outcome = fs::read_to_string(here.path().join("rx/receiver.json")).unwrap();
    let outcome: serde_json::Value = serde_json::from_str(&outcome).unwrap();
    assert_eq!(outcome["samples"], 8_000_000);
    assert_eq!(outcome["front_ends"][0]["signals"][0], "GPS L1 C/A");
    assert_eq!(outcome["front_ends"][1]["sample_rate_hz"], 2.6e6);
    assert_eq!(outcome["front_ends"][1]["signals"].as_array().unwrap().len(), 0);
    assert!(outcome["warnings"][0].as_str().unwrap().starts_with("front end 2"), "{outcome}");
    assert!(outcome["acquired"].as_array().unwrap().len() >= 6, "{outcome}");
}

#[test]
fn a_run_receives_all_front_ends_or_the_one_that_is_chosen() {
    let here = workplace();
    let text = done(&["run", "two.toml", "--keep-if", "--out", "both"], here.path());
    assert!(text.matches("made ").count() == 2, "{text}");
    for name in ["wide.sigmf-data", "wide.sigmf-meta", "narrow.sigmf-data", "psd.csv", "psd-narrow.csv", "summary.json"]
    {
        assert!(here.path().join("both").join(name).exists(), "{name}");
    }
    // Of the signal in both the first one's samples have the peaks.
    let peaks: Vec<PeakRow> =
        csv::Reader::from_path(here.path().join("both/peaks.csv")).unwrap().deserialize().map(Result::unwrap).collect();
    let link = |row: &PeakRow| Link { sv: row.sv, signal: row.signal };
    let links: BTreeSet<Link> = peaks.iter().map(link).collect();
    assert!(links.len() >= 6 && peaks.len() == 121 * links.len(), "{} rows of {links:?}", peaks.len());
    assert!(peaks.iter().all(|row| row.in_phase.abs() <= 1.0 && row.quadrature.abs() <= 1.0));
    for one in links {
        let own = peaks.iter().filter(|row| link(row) == one);
        let top = own.max_by(|a, b| a.in_phase.total_cmp(&b.in_phase)).unwrap();
        // A tenth of a chip away a peak that samples of a quarter of a chip round is 0.1²/0.25 = 0.04 lower.
        // Noise of 45 dB-Hz over 40 ms has σ = 0.02, of which two delays so near differ by 0.02·√0.2 = 0.009.
        assert!(top.delay_chips.abs() <= 0.1, "{top:?}");
    }
    // The spectrum of each is judged.
    let verdict = fs::read_to_string(here.path().join("both/verdict.csv")).unwrap();
    for name in ["wide", "narrow"] {
        let row = verdict.lines().find(|row| row.starts_with(&format!("level of the samples of {name} ")));
        assert!(row.is_some_and(|row| row.contains("pass")), "{name}: {verdict}");
    }
    // What an ideal receiver of both would write is judged against their common truth.
    let ideal = ["analyze", "--truth", "both/truth", "--rinex-obs", "both/truth/observations.rnx", "--out", "judged"];
    let text = done(&ideal, here.path());
    assert!(text.contains(", 0 outliers") && text.contains("pseudorange* rms (m)            0.000"), "{text}");
    refused(&["run", "two.toml", "--front-end", "broad"], here.path(), 2, &["broad", "wide, narrow"]);
    done(&["run", "two.toml", "--front-end", "narrow", "--keep-if", "--out", "run"], here.path());
    done(&["generate", "two.toml", "--front-end", "narrow", "--out", "narrow.sigmf-data"], here.path());
    let read = |path: &str| fs::read(here.path().join(path)).unwrap();
    assert!(read("run/if.sigmf-data") == read("narrow.sigmf-data"));
    let scene = String::from_utf8(read("run/truth/scene.json")).unwrap();
    assert!(scene.contains("\"front_end_name\": \"narrow\"") && !scene.contains("front_ends"), "{scene}");
}

#[test]
fn what_counts_one_front_ends_samples_or_names_one_file_is_refused_for_several() {
    let here = workplace();
    let generate = |more: &[&str], words: &[&str]| {
        refused(&[&["generate", "two.toml"], more].concat(), here.path(), 2, words);
    };
    generate(&["--out", "x", "--seek", "5"], &["--seek", "wide, narrow", "--front-end NAME"]);
    generate(&["--out", "x", "--samples", "5"], &["--samples", "--front-end NAME"]);
    generate(&["--out", "x.sigmf-data"], &["x.sigmf-data", "name a directory", "--front-end NAME"]);
}

#[test]
fn the_plan_shows_every_front_end() {
    let here = workplace();
    let text = done(&["plan", "two.toml"], here.path());
    assert!(text.starts_with("2 front ends that share a clock\n"), "{text}");
    for line in [
        "front end  wide",
        "front end  narrow",
        "4.000000 Msps, complex ci8, centred on 1575.420000 MHz: 15.3 MiB, GPS L1 C/A",
        "2.600000 Msps, complex ci8, centred on 1575.320000 MHz: 9.9 MiB, GPS L1 C/A",
        "together   25.2 MiB of samples",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    // The stages of each are in its own part.
    let (wide, narrow) = text.split_once("front end  narrow").unwrap();
    assert!(!wide.contains("2 bits, step") && narrow.contains("2 bits, step"), "{text}");
}

#[test]
fn a_filter_delays_carriers_with_codes_whatever_their_doppler() {
    let here = workplace();
    let (shared, _) = TWO.split_once("[[front_end]]").unwrap();
    let shared = shared.replace("duration_s = 2", "duration_s = 24");
    // Both delay by more than ten microseconds, in which 3 kHz turn by 0.03 cycle.
    for (name, kind) in [("wall", "\"brick_wall\""), ("butter", "\"butterworth\"\norder = 4")] {
        let filter = format!("[front_end]\nsample_rate_hz = 2.6e6\n[filter]\nkind = {kind}\nbandwidth_hz = 2.2e6\n");
        fs::write(here.path().join("filtered.toml"), format!("{shared}{filter}")).unwrap();
        done(&["run", "filtered.toml", "--out", name], here.path());
        let verdict = fs::read_to_string(here.path().join(name).join("verdict.csv")).unwrap();
        let row = verdict.lines().find(|row| row.starts_with("carrier bias,"));
        assert!(row.is_some_and(|row| row.contains(",pass,")), "{name}: {row:?}");
        let scene = fs::read_to_string(here.path().join(name).join("truth/scene.json")).unwrap();
        let scene: serde_json::Value = serde_json::from_str(&scene).unwrap();
        let stages = scene["front_end"].as_array().unwrap();
        let delay_s = stages.iter().filter_map(|stage| stage["group_delay_s"].as_f64()).sum::<f64>();
        assert!(delay_s > 1e-5, "{name}: {delay_s}");
    }
}
