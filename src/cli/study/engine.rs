//! `study export` and `study submit`: handing a plan to an engine, and seeing it through.
//!
//! What the engine loses is found by looking at the shards' files and handed out again. A submission leaves
//! its script and its job's number in `submit/`: started again, it waits for a job that is still there before
//! it hands out another one.

use std::env;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::args;
use super::queue::{self, Queued};
use super::{load, study_error};
use crate::cli::error::CliError;
use crate::cli::progress::Progress;
use crate::cli::scenario;
use crate::cli::staging::Staging;
use study::sweep::engine::{Status, status};
use study::sweep::export::{self, Engine, Terms};
use study::sweep::plan::Plan;
use study::sweep::shard;

/// Arrays of GNU parallel have no size of their own; a script has a line a task.
const MOST_LINES: u32 = 100_000;
/// Least time between two inspections of the shards.
const LOOK: Duration = Duration::from_secs(1);
/// Least ratio of that time to the duration of an inspection.
const REST: u32 = 10;
/// A file system of several machines may show a file some seconds after it was made.
const SETTLES: Duration = Duration::from_secs(3);

/// Prints the script.
pub fn export(arguments: &args::StudyExport) -> Result<(), CliError> {
    let plan = absolute(&arguments.directory)?;
    let missing = looked(&plan)?.missing;
    if missing.is_empty() {
        return Err(CliError::input(format!("{}: no shard is missing", arguments.directory.display())));
    }
    scenario::print(&script(&plan, arguments.engine, &missing, &arguments.terms)?)
}

/// The plan, by a path that holds where the script runs, which is not where it is written.
fn absolute(directory: &Path) -> Result<Plan, CliError> {
    let mut plan = load(directory)?;
    plan.directory = fs::canonicalize(&plan.directory).map_err(|error| CliError::read(directory.display(), &error))?;
    Ok(plan)
}

fn script(plan: &Plan, engine: args::Engine, missing: &[u32], terms: &args::Terms) -> Result<String, CliError> {
    let program = env::current_exe().map_err(|error| CliError::read("the program's own path", &error))?;
    let program = program.to_str().ok_or_else(|| CliError::input("the program's own path is not UTF-8"))?;
    let (engine, most) = match engine {
        args::Engine::Slurm => (Engine::Slurm, queue::most_tasks()),
        args::Engine::Parallel => (Engine::Parallel, MOST_LINES),
    };
    let terms = Terms {
        tasks: terms.tasks,
        at_once: terms.at_once,
        minutes: terms.minutes,
        directives: terms.directives.clone(),
    };
    if engine == Engine::Slurm {
        // Slurm makes no directory for logs.
        let logs = plan.directory.join("log");
        fs::create_dir_all(&logs).map_err(|error| CliError::create(logs.display(), &error))?;
    }
    export::script(plan, engine, program, missing, most, &terms).map_err(study_error)
}

/// Status of the shards. A file that its server has just replaced is read a second time.
fn looked(plan: &Plan) -> Result<Status, CliError> {
    status(plan).or_else(|_| status(plan)).map_err(study_error)
}

/// Hands out what is missing, waits, and again.
pub fn submit(arguments: &args::StudySubmit) -> Result<(), CliError> {
    let plan = absolute(&arguments.directory)?;
    let start = Instant::now();
    let progress = Progress::new(&format!("study {}", plan.study.name), Some(plan.manifest.n_cases), true);
    let mut missing = left(&plan, &looked(&plan)?.missing, &progress)?;
    if arguments.engine == args::Engine::Slurm {
        missing = resume(&plan, missing, &progress)?;
    }
    let mut rounds = 0;
    while !missing.is_empty() && rounds < arguments.rounds {
        rounds += 1;
        let path = plan.directory.join("submit").join(format!("round-{rounds}.sh"));
        keep(&path, script(&plan, arguments.engine, &missing, &arguments.terms)?.as_bytes())?;
        match arguments.engine {
            args::Engine::Slurm => {
                let job = queue::submit(&path)?;
                keep(&plan.directory.join("submit").join("job"), job.as_bytes())?;
                scenario::note(&format!("round {rounds}: job {job} of Slurm, {} shards", missing.len()));
                missing = follow(&plan, &job, missing, &progress)?;
            }
            args::Engine::Parallel => missing = parallel(&plan, &path, missing, &progress)?,
        }
        // What was whole at one look may have been damaged since.
        if missing.is_empty() {
            missing = looked(&plan)?.missing;
        }
    }
    drop(progress);
    let summary = format!(
        "{}: {} of {} shards are whole after {rounds} rounds, {:.1} s\n",
        plan.study.name,
        plan.shards() as usize - missing.len(),
        plan.shards(),
        start.elapsed().as_secs_f64()
    );
    scenario::print(&summary)?;
    if missing.is_empty() {
        return Ok(());
    }
    Err(CliError::incomplete(format!(
        "missing: {}; what tasks wrote is in {}; the same command goes on",
        shard::ranges(&missing),
        plan.directory.join("log").display()
    )))
}

/// A job that an earlier submission has left in the queue comes first.
fn resume(plan: &Plan, missing: Vec<u32>, progress: &Progress) -> Result<Vec<u32>, CliError> {
    let job = fs::read_to_string(plan.directory.join("submit").join("job")).unwrap_or_default();
    let job = job.trim();
    if missing.is_empty() || !queue::is_number(job) || queue::look(job)? == Queued::Gone {
        return Ok(missing);
    }
    scenario::note(&format!("job {job} of an earlier submission is still there: waiting for it"));
    follow(plan, job, missing, progress)
}

/// Waits until a job has made what is missing or will not; what is missing then.
fn follow(plan: &Plan, job: &str, mut missing: Vec<u32>, progress: &Progress) -> Result<Vec<u32>, CliError> {
    let mut said = String::new();
    loop {
        let begun = Instant::now();
        missing = left(plan, &missing, progress)?;
        if missing.is_empty() {
            // What is left of it has nothing to do, and may be held for good after its controller died.
            queue::cancel(job);
            return Ok(missing);
        }
        match queue::look(job)? {
            Queued::Gone => {
                thread::sleep(SETTLES);
                return left(plan, &missing, progress);
            }
            Queued::Held(reason) => {
                scenario::warn(&format!(
                    "job {job}: Slurm holds what is left of it ({reason}): taken out of the queue"
                ));
                queue::cancel(job);
                thread::sleep(SETTLES);
                return left(plan, &missing, progress);
            }
            Queued::Waiting { running: 0, reason: Some(reason) } => {
                say(&mut said, &format!("job {job} waits: {reason}"))
            }
            Queued::Silent => say(&mut said, "Slurm's controller does not answer: waiting for it"),
            Queued::Waiting { .. } => said.clear(),
        }
        thread::sleep(LOOK.max(begun.elapsed() * REST));
    }
}

/// Says something once.
fn say(said: &mut String, text: &str) {
    if said != text {
        scenario::note(text);
        text.clone_into(said);
    }
}

/// Runs the script here; what is missing when it has ended.
fn parallel(plan: &Plan, script: &Path, mut missing: Vec<u32>, progress: &Progress) -> Result<Vec<u32>, CliError> {
    let mut child = Command::new("bash")
        .arg(script)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .map_err(|error| CliError::passing(format!("cannot run bash {}: {error}", script.display())))?;
    loop {
        let begun = Instant::now();
        let ended = child.try_wait().map_err(|error| CliError::passing(format!("cannot wait for bash: {error}")))?;
        missing = left(plan, &missing, progress)?;
        if let Some(status) = ended {
            if status.code() == Some(127) {
                return Err(CliError::passing("bash cannot run parallel: expected GNU parallel in PATH"));
            }
            return Ok(missing);
        }
        thread::sleep(LOOK.max(begun.elapsed() * REST));
    }
}

/// Missing shards that are still missing. Complete ones are not read again.
fn left(plan: &Plan, missing: &[u32], progress: &Progress) -> Result<Vec<u32>, CliError> {
    let is_whole = |number: u32| -> Result<bool, CliError> {
        let found = shard::find(plan, number).or_else(|_| shard::find(plan, number));
        Ok(matches!(found.map_err(study_error)?, shard::Found::Whole(_)))
    };
    let mut rest = Vec::new();
    for number in missing {
        if !is_whole(*number)? {
            rest.push(*number);
        }
    }
    let cases = |number: &u32| {
        let cases = plan.cases(*number);
        cases.end - cases.start
    };
    progress.set(plan.manifest.n_cases - rest.iter().map(cases).sum::<u64>());
    Ok(rest)
}

/// Writes a file of a submission, with the directory above it.
fn keep(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).map_err(|error| CliError::create(parent.display(), &error))?;
    }
    let staging = Staging::file(path)?;
    staging.write(bytes)?;
    staging.commit()
}
