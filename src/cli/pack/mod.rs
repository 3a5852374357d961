//! `pack run`: entries of a pack in parallel, each in a directory of its own, and one matrix of their
//! verdicts.
//!
//! Every manifest, scene and file is checked before anything runs. Entries are independent, and each runs on
//! threads of its own, so that results do not depend on how many there are. A second run takes finished
//! entries ([`record`]) and computes the others; the matrix follows from the records alone. Two runs into one
//! directory exclude each other by a lock.

pub mod args;
mod glob;
mod junit;
pub mod keys;
mod manifest;
mod matrix;
mod record;

use std::collections::BTreeSet;
use std::env;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::json;

use crate::cli::error::CliError;
use crate::cli::progress::Progress;
use crate::cli::scenario;
use crate::cli::staging::Staging;
use analysis::show::staged::remove;
use args::{PackAction, PackRun};
pub use manifest::MANIFEST;
use manifest::{Entry, Pack};
use matrix::{Matrix, Row};
use record::Record;
use study::sweep::sha256_of_file;

/// Memory that is set aside for an entry at work: a scene of one band takes less.
const ENTRY_BYTES: u64 = 1 << 30;
/// File that marks a directory of results.
const MARK: &str = "pack.json";

/// Does what is asked of a pack.
pub fn execute(arguments: &args::Pack) -> Result<(), CliError> {
    match &arguments.action {
        PackAction::Run(arguments) => run(arguments),
    }
}

/// One entry that has been looked at.
struct Case<'p> {
    entry: &'p Entry,
    digest: String,
    directory: PathBuf,
    /// Samples of its first front end.
    samples: u64,
    record: Option<Record>,
    wall_s: Option<f64>,
}

fn run(arguments: &PackRun) -> Result<(), CliError> {
    let threads = match arguments.threads {
        Some(threads) => usize::from(threads),
        None => thread::available_parallelism().map_or(1, usize::from),
    };
    scenario::use_threads(arguments.threads)?;
    let pack = Pack::read(&arguments.directory)?;
    let chosen = chosen(&pack, &arguments.only)?;
    let usual = || PathBuf::from("reports").join(scenario::file_name(&pack.name));
    let out = arguments.out.clone().unwrap_or_else(usual);
    let build = format!("{} {}", env!("CARGO_PKG_VERSION"), build()?);
    let look = |entry: &&'_ Entry| {
        let (scenes, _) = record::composed(entry, arguments.level)?;
        let digest = record::digest(entry, arguments.level, arguments.keep, &build)?;
        Ok((digest, scenes.first().map_or(0, |scene| scene.samples)))
    };
    let looked: Vec<(String, u64)> = chosen.par_iter().map(look).collect::<Result<_, CliError>>()?;
    let _lock = begin(&out, &pack)?;
    let entries_in = out.join("entries");
    fs::create_dir_all(&entries_in).map_err(|error| CliError::create(entries_in.display(), &error))?;
    sweep(&entries_in)?;
    let case = |(entry, (digest, samples)): (_, (String, u64))| {
        let entry: &Entry = entry;
        let directory = entries_in.join(&entry.name);
        let record = record::finished(&directory, &digest);
        Case { entry, digest, directory, samples, record, wall_s: None }
    };
    let mut cases: Vec<Case<'_>> = chosen.iter().copied().zip(looked).map(case).collect();
    let begun = Instant::now();
    let missing = cases.iter().filter(|case| case.record.is_none()).count();
    compute(&mut cases, threads, arguments, &pack.name)?;
    let whole_s = begun.elapsed().as_secs_f64();

    let rows = cases.iter().filter_map(|case| Some(Row::new(case.entry, case.record.clone()?)));
    let rows: Vec<Row<'_>> = rows.collect();
    let part = (chosen.len() < pack.entries.len()).then_some(arguments.only.as_slice());
    let matrix = Matrix { pack: &pack, rows, level: arguments.level, part };
    matrix.write(&out)?;
    times(&out, &cases)?;
    if let Some(path) = &arguments.junit {
        let staging = Staging::file(path)?;
        staging.write(junit::xml(&matrix).as_bytes())?;
        staging.commit()?;
    }
    let made = format!("{missing} of {} entries computed in {whole_s:.1} s", cases.len());
    let text = format!("{}{made}\nresults in {}\n", matrix.in_words(), out.display());
    arguments.printed.results(
        &text,
        || json!({ "results": out, "pack": pack.name, "computed": missing, "matrix": matrix.object() }),
    )?;
    match matrix.unexpected() {
        0 => Ok(()),
        1 => Err(CliError::check(format!("1 of {} entries does not end as expected", matrix.rows.len()))),
        many => Err(CliError::check(format!("{many} of {} entries do not end as expected", matrix.rows.len()))),
    }
}

/// Entries whose names match one of the patterns; all without a pattern.
fn chosen<'p>(pack: &'p Pack, only: &[String]) -> Result<Vec<&'p Entry>, CliError> {
    let fits = |entry: &&Entry| {
        let whole = format!("{}/{}", entry.group, entry.name);
        only.is_empty()
            || only.iter().any(|pattern| glob::matches(pattern, &entry.name) || glob::matches(pattern, &whole))
    };
    let chosen: Vec<&Entry> = pack.entries.iter().filter(fits).collect();
    if !chosen.is_empty() {
        return Ok(chosen);
    }
    let names: Vec<&str> = pack.entries.iter().take(20).map(|entry| entry.name.as_str()).collect();
    let more = if pack.entries.len() > names.len() { ", …" } else { "" };
    let only = only.join(", ");
    Err(CliError::usage(format!("--only {only}: expected a pattern of {}{more}", names.join(", "))))
}

/// Hash of this program: another build computes again.
fn build() -> Result<String, CliError> {
    let hash = env::current_exe().and_then(|path| sha256_of_file(&path));
    hash.map_err(|error| CliError::read("the program itself", &error))
}

/// Makes or takes over a directory of results of this pack, and locks it until the handle is dropped.
fn begin(out: &Path, pack: &Pack) -> Result<Option<File>, CliError> {
    let error = |error: std::io::Error| CliError::create(out.display(), &error);
    let mark = out.join(MARK);
    let foreign = |what: &str| {
        CliError::refused_output(format!("{} {what}: name another directory with --out, or remove it", out.display()))
    };
    let is_empty = match fs::read_dir(out) {
        // What a killed run was making there is none of the user's.
        Ok(mut entries) => entries.all(|entry| entry.is_ok_and(|entry| entry.file_name() == ".pack.json.part")),
        Err(missing) if missing.kind() == std::io::ErrorKind::NotFound => true,
        Err(other) => return Err(error(other)),
    };
    if !is_empty && !mark.is_file() {
        return Err(foreign("exists and holds no results of a pack"));
    }
    fs::create_dir_all(out).map_err(error)?;
    // A directory that cannot be opened or locked has no second run that this one could see.
    let lock = File::open(out).ok();
    if lock.as_ref().is_some_and(|lock| matches!(lock.try_lock(), Err(TryLockError::WouldBlock))) {
        return Err(CliError::passing(format!("{}: another pack run is at work there", out.display())));
    }
    let own = format!("{}\n", json!({ "pack": pack.name }));
    if !mark.is_file() {
        let staging = Staging::file(&mark)?;
        staging.write(own.as_bytes())?;
        staging.commit()?;
    }
    let found = fs::read_to_string(&mark).map_err(|error| CliError::read(mark.display(), &error))?;
    if found == own { Ok(lock) } else { Err(foreign("holds results of another pack")) }
}

/// Removes what a killed run was making.
fn sweep(directory: &Path) -> Result<(), CliError> {
    let failed = |error: std::io::Error| CliError::read(directory.display(), &error);
    for entry in fs::read_dir(directory).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        if entry.file_name().to_string_lossy().starts_with('.') {
            remove(&entry.path()).map_err(|error| CliError::output(entry.path().display(), &error))?;
        }
    }
    Ok(())
}

/// Entries that may be at work at a time: one a thread, as memory allows.
fn lanes(threads: usize, missing: usize) -> usize {
    let memory = fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let available = memory.lines().find_map(|line| line.strip_prefix("MemAvailable:"));
    let kib = available.and_then(|rest| rest.split_whitespace().next()).and_then(|kib| kib.parse::<u64>().ok());
    let fit = kib.map_or(usize::MAX, |kib| (kib * 1024 / ENTRY_BYTES) as usize);
    threads.min(missing).min(fit).max(1)
}

/// Runs the cases that have no record yet; shows progress on a terminal.
fn compute(cases: &mut [Case<'_>], threads: usize, arguments: &PackRun, name: &str) -> Result<(), CliError> {
    let mut missing: Vec<&mut Case<'_>> = cases.iter_mut().filter(|case| case.record.is_none()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let samples = missing.iter().map(|case| case.samples).sum();
    let lanes = lanes(threads, missing.len());
    let progress = Progress::new(&format!("pack {name}"), Some(samples), arguments.printed.in_words());
    let (next, done, failed) = (AtomicUsize::new(0), AtomicU64::new(0), AtomicBool::new(false));
    let slots: Vec<Mutex<&mut Case<'_>>> = missing.iter_mut().map(|case| Mutex::new(&mut **case)).collect();
    let reason: Mutex<Option<CliError>> = Mutex::new(None);
    let work = || {
        while let Some(slot) = slots.get(next.fetch_add(1, Ordering::Relaxed)) {
            let Ok(mut case) = slot.lock() else { return };
            if failed.load(Ordering::Relaxed) {
                return;
            }
            let (begun, told) = (Instant::now(), AtomicU64::new(0));
            let tell = |samples: u64| {
                let more = samples.saturating_sub(told.swap(samples, Ordering::Relaxed));
                progress.set(done.fetch_add(more, Ordering::Relaxed) + more);
            };
            let how = (arguments.level, arguments.keep);
            match record::run(case.entry, how, (&case.digest, &case.directory), &tell) {
                Ok(record) => {
                    case.record = Some(record);
                    case.wall_s = Some(begun.elapsed().as_secs_f64());
                }
                Err(error) => {
                    failed.store(true, Ordering::Relaxed);
                    if let Ok(mut reason) = reason.lock() {
                        reason.get_or_insert(error);
                    }
                }
            }
        }
    };
    let pools: Vec<rayon::ThreadPool> = (0..lanes).map(|_| pool((threads / lanes).max(1))).collect::<Result<_, _>>()?;
    let work = &work;
    thread::scope(|scope| {
        for pool in &pools {
            let begun = thread::Builder::new().spawn_scoped(scope, move || pool.install(work));
            begun.map_err(|error| CliError::passing(format!("cannot start threads: {error}")))?;
        }
        Ok::<(), CliError>(())
    })?;
    match reason.into_inner() {
        Ok(None) => Ok(()),
        Ok(Some(error)) => Err(error),
        Err(_) => Err(CliError::bug("a worker panicked")),
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| CliError::passing(format!("cannot start threads: {error}")))
}

/// Writes `times.csv`: wall times of the entries that ran now, and none of those that were there.
fn times(out: &Path, cases: &[Case<'_>]) -> Result<(), CliError> {
    let line = |case: &Case<'_>| {
        let wall_s = case.wall_s.map_or_else(String::new, |wall_s| format!("{wall_s:.2}"));
        format!("{},{wall_s}\n", case.entry.name)
    };
    let text: String = cases.iter().map(line).collect();
    let staging = Staging::file(&out.join("times.csv"))?;
    staging.write(format!("entry,wall_s\n{text}").as_bytes())?;
    staging.commit()
}

/// Names in the order of their first occurrence.
fn groups<'r>(names: impl Iterator<Item = &'r str>) -> Vec<&'r str> {
    let mut seen = BTreeSet::new();
    names.filter(|name| seen.insert(*name)).collect()
}
