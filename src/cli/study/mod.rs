//! `study`: plan, run, look at, merge and hand out studies; with a study alone, all of it on this machine.

pub mod args;
mod engine;
mod queue;

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::cli::error::CliError;
use crate::cli::progress::Progress;
use crate::cli::run::{generator_error, judge_error, output_error, receiver_error};
use crate::cli::scenario;
use crate::cli::staging::Staging;
use analysis::show::document::Forms;
use study::sweep::engine::{Status, run as run_shards, status as status_of};
use study::sweep::plan::{Cut, Plan};
use study::sweep::result::{self, Results};
use study::sweep::spec::Level;
use study::sweep::{StudyError, publish, sha256_of_file, shard};

/// Does what is asked of a study.
pub fn execute(arguments: &args::Study) -> Result<(), CliError> {
    match (&arguments.action, &arguments.study) {
        (Some(args::StudyAction::Plan(arguments)), _) => plan(arguments),
        (Some(args::StudyAction::Run(arguments)), _) => run(arguments),
        (Some(args::StudyAction::Status(arguments)), _) => status(arguments),
        (Some(args::StudyAction::Merge(arguments)), _) => merge(arguments),
        (Some(args::StudyAction::Report(arguments)), _) => {
            report(&load(&arguments.directory)?, arguments.report.forms())
        }
        (Some(args::StudyAction::Export(arguments)), _) => engine::export(arguments),
        (Some(args::StudyAction::Submit(arguments)), _) => engine::submit(arguments),
        (None, Some(study)) => whole(study, arguments),
        (None, None) => {
            Err(CliError::usage("expected a study, or plan, run, status, merge, report, export or submit; see --help"))
        }
    }
}

/// Plans, runs and reports; again after a kill, it goes on where it was.
fn whole(study: &Path, arguments: &args::Study) -> Result<(), CliError> {
    scenario::use_threads(arguments.jobs)?;
    let directory = match &arguments.out {
        Some(directory) => directory.clone(),
        None => {
            let stem = study.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            PathBuf::from("reports").join(scenario::file_name(&stem))
        }
    };
    if arguments.fresh {
        clear(&directory)?;
    }
    let plan = Plan::create(study, &directory, Cut::Default, &build()?).map_err(study_error)?;
    compute(&plan, &missing(&plan)?)?;
    report(&plan, arguments.report.forms())
}

fn plan(arguments: &args::StudyPlan) -> Result<(), CliError> {
    let cut = match (arguments.shards, arguments.shard_minutes) {
        (Some(shards), _) => Cut::Shards(shards),
        (None, Some(minutes)) if minutes > 0.0 && minutes.is_finite() => Cut::Minutes(minutes),
        (None, Some(minutes)) => {
            return Err(CliError::usage(format!("--shard-minutes {minutes}: expected more than 0")));
        }
        (None, None) => Cut::Default,
    };
    if arguments.fresh {
        clear(&arguments.out)?;
    }
    let plan = Plan::create(&arguments.study, &arguments.out, cut, &build()?).map_err(study_error)?;
    scenario::print(&format!("{}\nplanned in {}\n", summary(&plan), arguments.out.display()))
}

/// A study in a few words.
fn summary(plan: &Plan) -> String {
    let grid = &plan.study.grid;
    let level = match plan.study.level {
        Level::Correlator => "correlator level: loops on modelled correlations",
        Level::Samples if plan.is_sampled() => "sample level: generator and receiver",
        Level::Samples => "levels of the scenes: generator and receiver",
        Level::Correlations => "level correlations: generator and receiver, no samples",
        Level::Observations => "level observations: generator and navigation, no samples",
    };
    let shares = plan.study.level != Level::Correlator && grid.sharing() > 1;
    let shared = if shares { format!("; {} cases share each signal", grid.sharing()) } else { String::new() };
    format!(
        "{} · {level}\n{} cases ({} cells, {} repetitions) in {} shards of {}{shared}",
        plan.study.name,
        grid.cases(),
        grid.cells(),
        grid.repetitions,
        plan.shards(),
        plan.manifest.shard_size,
    )
}

fn run(arguments: &args::StudyRun) -> Result<(), CliError> {
    scenario::use_threads(arguments.jobs)?;
    let plan = load(&arguments.directory)?;
    if !plan.is_of(&build()?) {
        scenario::warn("planned by another build of this program: shards of both are merged if their bytes agree");
    }
    let shards = match (arguments.shard, arguments.part) {
        (None, None) => missing(&plan)?,
        (None, Some(part)) => {
            let wanted: Result<Vec<Vec<u32>>, CliError> =
                part.shards(plan.shards()).map(|number| wanted(&plan, number)).collect();
            wanted?.concat()
        }
        (Some(args::Shard::Auto), _) => wanted(&plan, own_number()?)?,
        (Some(args::Shard::Number(number)), _) => wanted(&plan, number)?,
    };
    compute(&plan, &shards)
}

/// The shard, unless it is there.
fn wanted(plan: &Plan, number: u32) -> Result<Vec<u32>, CliError> {
    if number >= plan.shards() {
        return Err(study_error(StudyError::NoSuchShard { shard: number, last: plan.shards().saturating_sub(1) }));
    }
    let whole = matches!(shard::find(plan, number).map_err(study_error)?, shard::Found::Whole(_));
    Ok(if whole { Vec::new() } else { vec![number] })
}

/// The number that an engine gives to this task.
fn own_number() -> Result<u32, CliError> {
    const NAMES: [&str; 4] = ["SLURM_ARRAY_TASK_ID", "PBS_ARRAY_INDEX", "HQ_TASK_ID", "SGE_TASK_ID"];
    let found = NAMES.iter().find_map(|name| env::var(name).ok().map(|value| (name, value)));
    let Some((name, value)) = found else {
        return Err(CliError::usage(format!("--shard auto: none of {} is set", NAMES.join(", "))));
    };
    value.parse().map_err(|_| CliError::usage(format!("--shard auto: {name} = {value:?}: expected a number")))
}

fn missing(plan: &Plan) -> Result<Vec<u32>, CliError> {
    let Status { missing, bad, .. } = status_of(plan).map_err(study_error)?;
    for (number, reason) in bad {
        scenario::warn(&format!("{}: {reason}: computed again", shard::path(plan, number).display()));
    }
    Ok(missing)
}

/// Runs shards, with a bar that shows the time left.
fn compute(plan: &Plan, shards: &[u32]) -> Result<(), CliError> {
    let cases = shards.iter().map(|&number| plan.cases(number)).map(|cases| cases.end - cases.start).sum();
    let start = Instant::now();
    let progress = Progress::new(&format!("study {}", plan.study.name), Some(cases), true);
    let ran = run_shards(plan, shards, &|done| progress.set(done));
    drop(progress);
    let ran = ran.map_err(study_error)?;
    scenario::print(&format!(
        "{}: {} cases in {} of {} shards computed in {:.1} s\n",
        plan.study.name,
        ran.cases,
        ran.shards,
        plan.shards(),
        start.elapsed().as_secs_f64(),
    ))
}

fn status(arguments: &args::StudyStatus) -> Result<(), CliError> {
    let plan = load(&arguments.directory)?;
    let Status { whole, missing, bad } = status_of(&plan).map_err(study_error)?;
    let list = shard::ranges(&missing);
    if arguments.missing {
        scenario::print(&format!("{list}\n"))?;
    } else {
        let cases: u64 = whole.iter().map(|&number| plan.cases(number)).map(|cases| cases.end - cases.start).sum();
        let mut text = format!(
            "{}\n{} of {} shards are whole: {cases} of {} cases\n",
            summary(&plan),
            whole.len(),
            plan.shards(),
            plan.manifest.n_cases
        );
        for (number, reason) in bad {
            text += &format!("shard {number} is damaged: {reason}\n");
        }
        if !missing.is_empty() {
            text += &format!("missing: {list}\n");
        }
        scenario::print(&text)?;
    }
    if missing.is_empty() { Ok(()) } else { Err(CliError::incomplete("")) }
}

fn merge(arguments: &args::StudyMerge) -> Result<(), CliError> {
    let plan = load(&arguments.directory)?;
    let lines = result::merge(&plan).map_err(study_error)?;
    let table = result::table(&plan, &lines);
    if arguments.out.extension().is_some_and(|extension| extension == "parquet") {
        write_parquet(&table, &arguments.out)?;
    } else {
        let staging = Staging::file(&arguments.out)?;
        staging.write(&table)?;
        staging.commit()?;
    }
    scenario::print(&format!("{} cases in {}\n", lines.len(), arguments.out.display()))
}

#[cfg(feature = "parquet")]
fn write_parquet(table: &[u8], target: &Path) -> Result<(), CliError> {
    crate::cli::parquet::write_bytes(table, target).map(drop)
}

#[cfg(not(feature = "parquet"))]
fn write_parquet(_: &[u8], _: &Path) -> Result<(), CliError> {
    Err(crate::cli::no_parquet())
}

fn report(plan: &Plan, forms: Forms) -> Result<(), CliError> {
    let lines = result::merge(plan).map_err(study_error)?;
    let results = Results::new(plan, &lines).map_err(study_error)?;
    publish::write(plan, &lines, &results, forms).map_err(study_error)?;
    let text = publish::in_short(&results);
    scenario::print(&format!("{text}report in {}\n", plan.directory.join("report.md").display()))
}

fn load(directory: &Path) -> Result<Plan, CliError> {
    Plan::load(directory).map_err(study_error)
}

/// Removes a study's directory, and nothing else.
fn clear(directory: &Path) -> Result<(), CliError> {
    if directory.join("manifest.json").is_file() {
        fs::remove_dir_all(directory).map_err(|error| CliError::create(directory.display(), &error))?;
    }
    Ok(())
}

/// A hash of this program.
fn build() -> Result<String, CliError> {
    let hash = env::current_exe().and_then(|path| sha256_of_file(&path));
    Ok(hash.map_err(|error| CliError::read("the program itself", &error))?.chars().take(16).collect())
}

/// The exit that a study's failure means.
fn study_error(error: StudyError) -> CliError {
    match error {
        StudyError::Read { path, source } => CliError::read(path.display(), &source),
        StudyError::Create { path, source } => CliError::create(path.display(), &source),
        StudyError::Write { path, source } => CliError::output(path.display(), &source),
        StudyError::Occupied { .. } => CliError::refused_output(error),
        StudyError::Incomplete { .. } => CliError::incomplete(error),
        StudyError::NoSuchShard { .. } => CliError::usage(error),
        StudyError::Generate(error) => generator_error(error),
        StudyError::Receive(error) => receiver_error(error),
        StudyError::Output(error) => output_error(error),
        StudyError::Judge(error) => judge_error(error),
        StudyError::Bug(message) => CliError::bug(message),
        StudyError::Stopped => CliError::bug("stopped without a reason"),
        StudyError::Text(error) => scenario::scenario_error(error),
        StudyError::Axis { .. }
        | StudyError::Case { .. }
        | StudyError::Input { .. }
        | StudyError::NotReproducible { .. } => CliError::input(error),
    }
}
