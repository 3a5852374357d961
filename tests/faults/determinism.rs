//! Identical bytes on any threads, in any pieces, on any processor, under any locale, and from two runs at
//! once.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Options, generate_part};
use generator::synth::isa::Level;
use generator::truth;
use receiver::Reception;
use receiver::output::Output;
use receiver::settings::Settings;

use crate::machine::{Bench, Ended, Files, files, left_over, twin};
use crate::tally::{End, Tally, cases, long};

const FAMILY: &str = "A machine that fails";
const DURATION_S: f64 = 0.12;

/// A shipped scene, cut short.
fn scene(name: &str) -> Scene {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let text = fs::read_to_string(directory.join(format!("{name}.toml"))).unwrap();
    let lines = text.lines().map(|line| {
        if line.starts_with("duration_s") { format!("duration_s = {DURATION_S}\n") } else { format!("{line}\n") }
    });
    let scenario = Scenario::parse(&lines.collect::<String>(), name).unwrap();
    scenario.compose(&directory, &Overrides::default()).unwrap().0
}

fn on<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

fn generated(scene: &Scene, part: std::ops::Range<u64>, options: &Options) -> (Vec<u8>, Files) {
    let (place, mut bytes) = (tempfile::tempdir().unwrap(), Vec::new());
    let mut writer = truth::Writer::create(place.path()).unwrap();
    generate_part(scene, part, &mut bytes, &mut writer, &mut |_| (), options).unwrap();
    drop(writer);
    (bytes, files(place.path()))
}

fn received(scene: &Scene, bytes: &[u8], chunk: usize) -> Files {
    let place = tempfile::tempdir().unwrap();
    let mut output = Output::create(place.path()).unwrap();
    let mut reception = Reception::new(&scene.metadata, &Settings::default()).unwrap();
    for piece in bytes.chunks(chunk) {
        reception.take(piece, &mut output).unwrap();
    }
    reception.finish(&mut output).unwrap();
    drop(output);
    files(place.path())
}

fn same<T: PartialEq>(one: &T, other: &T) -> Result<End, String> {
    if one == other { Ok(End::Accepted) } else { Err("other bytes".to_owned()) }
}

#[test]
fn threads_and_pieces_change_no_byte() {
    let names: &[&str] = if long() {
        &["static", "moderate", "jammed", "oscillator", "scintillation", "front_end"]
    } else {
        &["static"]
    };
    let threads: &[usize] = if long() { &[1, 2, 3, 8] } else { &[3] };
    let mut generator = Tally::of_processes(FAMILY, "23. generator: threads and pieces");
    let mut receiver = Tally::of_processes(FAMILY, "23. receiver: threads and pieces");
    for name in names {
        let scene = scene(name);
        let whole = 0..scene.samples;
        let usual = Options::default();
        let (bytes, truth) = on(1, || generated(&scene, whole.clone(), &usual));
        let size = scene.metadata.format.bytes();
        assert!(bytes.len() == scene.samples as usize * size);
        let found = on(1, || received(&scene, &bytes, usize::MAX));
        for &threads in threads {
            // Samples in a batch: 4096, 65536, all; then pieces that are made by themselves.
            for (block_runs, batch_blocks) in [(1, 1), (4, 4), (64, 10_000)] {
                let options = Options { block_runs, batch_blocks, level: Level::detect() };
                generator.case(
                    || format!("{name}, {threads} threads, batches of {block_runs} × {batch_blocks} × 4096"),
                    || {
                        on(threads, || {
                            same(&generated(&scene, whole.clone(), &options), &(bytes.clone(), truth.clone()))
                        })
                    },
                );
            }
            for (length, count, first) in [(1_u64, 5, 4094), (997, 8, 131_000)] {
                generator.case(
                    || format!("{name}, {threads} threads, parts of {length} samples"),
                    || {
                        let make = |n: u64| generated(&scene, first + n * length..first + (n + 1) * length, &usual).0;
                        let parts: Vec<u8> = on(threads, || (0..count).flat_map(make).collect());
                        let (from, to) = (first as usize, (first + count * length) as usize);
                        same(&parts.as_slice(), &&bytes[from * size..to * size])
                    },
                );
            }
            for chunk in if long() { vec![1, 997, 4096, 65_536, usize::MAX] } else { vec![997] } {
                receiver.case(
                    || format!("{name}, {threads} threads, {chunk} bytes at a time"),
                    || on(threads, || same(&received(&scene, &bytes, chunk), &found)),
                );
            }
        }
    }
    let failures: Vec<String> = [generator, receiver].into_iter().filter_map(|tally| tally.close().err()).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn processor_locale_and_clock_change_no_byte() {
    let names: &[&'static str] = if long() {
        &[
            "plan",
            "generate",
            "receive",
            "run",
            "analyze",
            "study run",
            "study merge",
            "study report",
            "study run of samples",
            "pack run",
        ]
    } else {
        &["plan", "generate"]
    };
    let bench = Bench::new(names);
    let mut tally = Tally::of_processes(FAMILY, "24. processor, locale, time zone");
    for task in &bench.tasks {
        for (key, value) in [
            ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA"),
            ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX512F"),
            ("TZ", "Pacific/Chatham"),
            ("LC_ALL", "de_DE.UTF-8"),
            ("LC_ALL", "tr_TR.ISO-8859-9"),
            ("RAYON_NUM_THREADS", "5"),
        ] {
            tally.case(
                || format!("{}, {key}={value}", task.name),
                || {
                    let work = task.workplace();
                    let ended = task.ended(twin(&task.arguments, work.path()).env(key, value).output().unwrap());
                    task.complete(work.path(), &ended).map(|()| End::Accepted)
                },
            );
        }
    }
    tally.finish();
}

#[test]
fn two_runs_of_a_study_at_once_lose_nothing_and_double_nothing() {
    let names: &[&'static str] = if long() { &["study run", "study run of samples"] } else { &["study run"] };
    let bench = Bench::new(names);
    let mut tally = Tally::of_processes(FAMILY, "25. two runs of a study in one directory");
    for task in &bench.tasks {
        let races = if task.name == "study run" { cases(1, 80) } else { 20 };
        for race in 0..races {
            tally.case(
                || format!("{} {race}", task.name),
                || {
                    let work = task.workplace();
                    let start = |_| -> Child {
                        let mut command = twin(&task.arguments, work.path());
                        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
                    };
                    let runners = [0, 1].map(start);
                    for runner in runners {
                        let ended = task.ended(runner.wait_with_output().unwrap());
                        if ended.code != 0 {
                            return Err(format!("exit {}: {}", ended.code, ended.message));
                        }
                    }
                    let left = left_over(&files(work.path()));
                    if !left.is_empty() {
                        return Err(format!("{left:?} stays"));
                    }
                    task.complete(work.path(), &Ended { code: 0, stdout: Vec::new(), message: String::new() })?;
                    Ok(End::Accepted)
                },
            );
        }
    }
    tally.finish();
}
