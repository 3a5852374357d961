//! Studies as a user meets them: the same table however they are cut, killed, doubled or damaged.
#![cfg(feature = "cli")]

mod export;
mod levels;
mod refusal;
mod samples;

use std::fs;
use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use study::sweep::StudyError;
use study::sweep::estimate::Estimate;
use study::sweep::plan::{Cut, Plan};
use study::sweep::shard::{self, Found};

use crate::command::{TWIN, code};

/// A study of modelled correlations: 60 cells, 5 repetitions.
const MODELLED: &str = r#"
name = "modelled"
level = "correlator"
seed = 9
repetitions = 5
keep = ["phase_sigma_deg", "code_sigma_m", "held"]
[measure]
settle_s = 1
duration_s = 8
[[axis]]
key = "receiver.tracking.pll_bandwidth_hz"
values = [5, 10.0, 18]
[[axis]]
key = "signal.cn0_dbhz"
from = 30
to = 48
step = 2
[[axis]]
key = "receiver.tracking.pll_order"
values = [2, 3]
[[plot]]
x = "signal.cn0_dbhz"
y = "phase_sigma_deg"
series = "receiver.tracking.pll_bandwidth_hz"
panel = "receiver.tracking.pll_order"
"#;

fn command(arguments: &[&str], directory: &Path) -> Command {
    let mut command = Command::new(TWIN);
    command.arg("study").args(arguments).current_dir(directory).stdin(Stdio::null()).stdout(Stdio::piped());
    command
}

fn study(arguments: &[&str], directory: &Path) -> Output {
    command(arguments, directory).output().unwrap()
}

fn text(output: &Output) -> String {
    (String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr)).into_owned()
}

fn good(arguments: &[&str], directory: &Path) -> String {
    let output = study(arguments, directory);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output));
    text(&output)
}

/// A directory with `study.toml` in it.
fn workplace(content: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("study.toml"), content).unwrap();
    directory
}

/// The theory knows no motion: a cell under jerk has none, and the cell at rest is compared with its own.
#[test]
fn theory_has_no_value_under_a_jerk() {
    let directory = workplace(
        "name = \"jerk\"\nlevel = \"correlator\"\nrepetitions = 4\nkeep = [\"phase_sigma_deg\"]\n[signal]\ncn0_dbhz = 45\n\
         [measure]\nsettle_s = 1\nduration_s = 20\n[[axis]]\nkey = \"motion.jerk_g_per_s\"\nvalues = [0, 10]\n",
    );
    good(&["study.toml", "--out", "out"], directory.path());
    let cells = fs::read_to_string(directory.path().join("out/cells.csv")).unwrap();
    let column = cells.lines().next().unwrap().split(',').position(|name| name == "theory.phase_sigma_deg").unwrap();
    let theory: Vec<&str> = cells.lines().skip(1).map(|line| line.split(',').nth(column).unwrap()).collect();
    assert!(matches!(theory[..], [at_rest, ""] if !at_rest.is_empty()), "{theory:?}");
    let report = fs::read_to_string(directory.path().join("out/report.md")).unwrap();
    assert!(report.contains("phase jitter, 1 σ (degrees): 1 of 1 cells"), "{report}");
    assert!(!report.contains("\nBeyond:"), "{report}");
}

/// The merged table of a study that nothing disturbs, and how long its run takes.
fn undisturbed(here: &Path) -> (Vec<u8>, Duration) {
    good(&["plan", "study.toml", "-o", "calm", "--shards", "100"], here);
    let start = Instant::now();
    good(&["run", "calm"], here);
    let took = start.elapsed();
    good(&["merge", "calm", "-o", "calm.csv"], here);
    (fs::read(here.join("calm.csv")).unwrap(), took)
}

fn merged(here: &Path, directory: &str) -> Vec<u8> {
    let out = format!("{directory}.csv");
    good(&["merge", directory, "-o", &out], here);
    fs::read(here.join(out)).unwrap()
}

fn shards(here: &Path, directory: &str) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(here.join(directory).join("shards")).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

#[test]
fn killed_at_twenty_random_moments_no_case_is_lost_and_none_doubled() {
    let here = workplace(MODELLED);
    let here = here.path();
    let (calm, took) = undisturbed(here);
    assert_eq!(String::from_utf8_lossy(&calm).lines().count(), 301);
    let (mut killed, mut rounds) = (0_u32, 0_u32);
    while killed < 20 {
        // A study that ended before its next kill makes room for another one.
        let name = format!("shot{rounds}");
        good(&["plan", "study.toml", "-o", &name, "--shards", "100"], here);
        while killed < 20 {
            let mut child = command(&["run", &name, "--jobs", "2"], here).spawn().unwrap();
            let share = RandomState::new().hash_one(killed) as f64 / u64::MAX as f64;
            std::thread::sleep(took.mul_f64(share));
            child.kill().unwrap();
            let ended = child.wait().unwrap().code();
            let status = study(&["status", &name], here);
            assert!([0, 3].contains(&code(&status)), "{}", text(&status));
            if ended.is_some() {
                break;
            }
            killed += 1;
        }
        good(&["run", &name], here);
        assert_eq!(merged(here, &name), calm);
        // What the dead left behind is gone.
        assert_eq!(shards(here, &name).len(), 50);
        assert!(!here.join(&name).join("scratch").exists());
        rounds += 1;
        assert!(rounds < 50, "{killed} kills in {rounds} studies");
    }
    println!("20 kills in {rounds} studies, a run takes {:.2} s", took.as_secs_f64());
}

#[test]
fn however_it_is_cut_and_on_any_threads_the_table_is_the_same() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 6"));
    let mut tables = Vec::new();
    for (name, shards, jobs) in [("one", "1", "1"), ("seven", "7", "3"), ("most", "100000", "2")] {
        good(&["plan", "study.toml", "-o", name, "--shards", shards], here.path());
        good(&["run", name, "--jobs", jobs], here.path());
        tables.push(merged(here.path(), name));
    }
    good(&["study.toml", "-o", "whole"], here.path());
    tables.push(fs::read(here.path().join("whole/cases.csv")).unwrap());
    assert!(tables.windows(2).all(|pair| pair[0] == pair[1]));
    for file in ["cells.csv", "report.md", "modelled.png", "modelled.svg"] {
        assert!(fs::metadata(here.path().join("whole").join(file)).unwrap().len() > 500, "{file}");
    }
    // Without fused multiply-add and vectors of 256 bits too.
    good(&["plan", "study.toml", "-o", "plain"], here.path());
    let run =
        command(&["run", "plain"], here.path()).env("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA").output();
    assert!(run.unwrap().status.success());
    assert_eq!(merged(here.path(), "plain"), tables[0]);
}

#[test]
fn two_runs_in_one_directory_give_the_table_of_one() {
    let here = workplace(MODELLED);
    let (calm, _) = undisturbed(here.path());
    good(&["plan", "study.toml", "-o", "race", "--shards", "100"], here.path());
    let runners: Vec<Child> =
        (0..2).map(|_| command(&["run", "race", "--jobs", "1"], here.path()).spawn().unwrap()).collect();
    for runner in runners {
        let output = runner.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", text(&output));
    }
    assert_eq!(merged(here.path(), "race"), calm);
    assert_eq!(shards(here.path(), "race").len(), 50);
}

#[test]
fn damaged_and_foreign_shards_are_seen_set_aside_and_computed_again() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 6"));
    let here = here.path();
    for name in ["good", "hurt"] {
        good(&["plan", "study.toml", "-o", name, "--shards", "10"], here);
        good(&["run", name], here);
    }
    fs::write(here.join("other.toml"), MODELLED.replace("step = 2", "step = 6").replace("seed = 9", "seed = 10"))
        .unwrap();
    good(&["plan", "other.toml", "-o", "other", "--shards", "10"], here);
    good(&["run", "other"], here);
    let (hurt, other) = (shards(here, "hurt"), shards(here, "other"));
    let content = fs::read_to_string(&hurt[1]).unwrap();
    // Cut at every place of its last line and at some others; one bit changed; that of another plan; another
    // shard.
    let end = content.len() - 90;
    for length in (0..end).step_by(97).chain(end..content.len()) {
        fs::write(&hurt[1], &content[..length]).unwrap();
        let plan = Plan::load(&here.join("hurt")).unwrap();
        assert!(matches!(shard::find(&plan, 1).unwrap(), Found::Bad(_)), "{length}");
    }
    let mut bytes = fs::read(&hurt[2]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&hurt[2], bytes).unwrap();
    fs::copy(&other[3], &hurt[3]).unwrap();
    fs::copy(&hurt[5], &hurt[4]).unwrap();
    fs::remove_file(&hurt[7]).unwrap();
    let status = study(&["status", "hurt", "--missing"], here);
    assert_eq!((code(&status), String::from_utf8_lossy(&status.stdout).trim()), (3, "1-4,7"));
    let merge = study(&["merge", "hurt", "-o", "no.csv"], here);
    assert_eq!(code(&merge), 3, "{}", text(&merge));
    assert!(text(&merge).contains("1-4,7") && !here.join("no.csv").exists());
    good(&["run", "hurt", "--shard", "2"], here);
    good(&["run", "hurt"], here);
    assert_eq!(merged(here, "hurt"), merged(here, "good"));
    let set_aside = shards(here, "hurt").iter().filter(|path| path.extension().is_some_and(|e| e == "bad")).count();
    assert_eq!(set_aside, 4);
}

#[test]
fn a_shard_that_comes_out_differently_is_refused_and_the_first_stays() {
    let here = workplace(MODELLED);
    let build = "0123456789abcdef";
    let place = here.path().join("twice");
    let plan = Plan::create(&here.path().join("study.toml"), &place, Cut::Shards(100), build).unwrap();
    let rows = |value: f64| vec![vec![Some(value), None, Some(1.0)]; 6];
    let (one, two) = (shard::render(&plan, 0, &rows(1.5)), shard::render(&plan, 0, &rows(1.25)));
    shard::commit(&plan, 0, &one).unwrap();
    shard::commit(&plan, 0, &one).unwrap();
    assert!(matches!(shard::commit(&plan, 0, &two), Err(StudyError::NotReproducible { .. })));
    assert_eq!(fs::read(shard::path(&plan, 0)).unwrap(), one);
    let Found::Whole(lines) = shard::find(&plan, 0).unwrap() else { panic!("not whole") };
    assert_eq!(lines.len(), 6);
    assert!(lines[0].ends_with(",1.5,,1"), "{}", lines[0]);
}

#[test]
fn another_value_of_the_receiver_s_axis_leaves_the_other_cases_as_they_were() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 6"));
    good(&["study.toml", "-o", "few"], here.path());
    let more = MODELLED.replace("step = 2", "step = 6").replace("[5, 10.0, 18]", "[3, 5, 18.0, 10]");
    fs::write(here.path().join("more.toml"), more).unwrap();
    good(&["more.toml", "-o", "more"], here.path());
    let rows = |name: &str| -> Vec<String> {
        let table = fs::read_to_string(here.path().join(name).join("cases.csv")).unwrap();
        // All but the case's number.
        let mut rows: Vec<String> =
            table.lines().skip(1).map(|line| line.split_once(',').unwrap().1.to_owned()).collect();
        rows.sort();
        rows
    };
    let (few, more) = (rows("few"), rows("more"));
    assert_eq!((few.len(), more.len()), (120, 160));
    assert!(few.iter().all(|row| more.binary_search(row).is_ok()));
    // One seed for all that hear the same.
    let seeds: std::collections::BTreeSet<&str> = few.iter().map(|row| row.split(',').next().unwrap()).collect();
    assert_eq!(seeds.len(), 4 * 5);
}

#[test]
fn intervals_are_those_of_the_handbooks() {
    // Mean 3, s² = 2.5: 2.776·√(2.5/5) = 1.963.
    let estimate = Estimate::of(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
    let (low, high) = estimate.interval.unwrap();
    assert_eq!((estimate.count, estimate.mean), (5, 3.0));
    assert!((high - 4.963).abs() < 1e-3 && (low - 1.037).abs() < 1e-3, "{low} {high}");
    // Wilson, 9 of 10: 0.596 to 0.982; 10 of 10: 0.722 to 1.
    let mut hits = vec![1.0; 10];
    assert!((Estimate::of(&hits).unwrap().interval.unwrap().0 - 0.7225).abs() < 1e-3);
    hits[3] = 0.0;
    let (low, high) = Estimate::of(&hits).unwrap().interval.unwrap();
    assert!((low - 0.5958).abs() < 1e-3 && (high - 0.9821).abs() < 1e-3, "{low} {high}");
    // 41 values of ±1 about 0: t for 40 degrees of freedom is 2.021.
    let values: Vec<f64> = (-20..=20).map(f64::from).collect();
    let spread = (values.iter().map(|x| x * x).sum::<f64>() / 40.0 / 41.0).sqrt();
    let (_, high) = Estimate::of(&values).unwrap().interval.unwrap();
    assert!((high / spread - 2.021).abs() < 6e-4, "{}", high / spread);
    assert_eq!((Estimate::of(&[]), Estimate::of(&[2.0]).unwrap().interval), (None, None));
}
