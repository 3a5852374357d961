//! Arguments of `study` as written.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Subcommand, ValueEnum};

use crate::cli::args::ReportForm;
use study::sweep::export::Directive;
use study::sweep::part::Part;

#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  gnss-twin study studies/pll_jitter.toml\n  gnss-twin study plan \
                  studies/pll_jitter.toml -o big && gnss-twin study export slurm big | sbatch"
)]
pub struct Study {
    #[command(subcommand)]
    pub action: Option<StudyAction>,
    /// Study to plan, run and report on this machine. An interrupted study continues with the same command
    pub study: Option<PathBuf>,
    /// Directory of the study [default: reports/STUDY]
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Report to write
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    pub report: ReportForm,
    /// Discard results of an earlier plan in that directory
    #[arg(long)]
    pub fresh: bool,
}

#[derive(Debug, Subcommand)]
pub enum StudyAction {
    /// Write a study's manifest and copies of its inputs into a directory
    Plan(StudyPlan),
    /// Compute missing shards: all of them, or one
    Run(StudyRun),
    /// Report which shards are complete; exit with code 3 if one is missing
    Status(StudyStatus),
    /// Merge all shards into one table, in the order of the cases
    Merge(StudyMerge),
    /// Write tables, pictures and report.md into the study's directory
    Report(StudyReport),
    /// Print a script that runs the missing shards under an engine
    Export(StudyExport),
    /// Run the missing shards under an engine, wait, and repeat with those still missing
    Submit(StudySubmit),
}

#[derive(Args, Debug)]
pub struct StudyPlan {
    /// Study to plan
    pub study: PathBuf,
    /// Directory of the study
    #[arg(long, short, value_name = "DIR")]
    pub out: PathBuf,
    /// Number of shards [default: 50 to 1000, of at most a minute each]
    #[arg(long, value_name = "N", conflicts_with = "shard_minutes")]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub shards: Option<u64>,
    /// Approximate length of a shard, in minutes of one core
    #[arg(long, value_name = "M")]
    pub shard_minutes: Option<f64>,
    /// Discard results of an earlier plan in that directory
    #[arg(long)]
    pub fresh: bool,
}

#[derive(Args, Debug)]
pub struct StudyRun {
    /// Directory of the study
    pub directory: PathBuf,
    /// Number of a shard, or auto for the number that the engine gives to this task [default: all missing]
    #[arg(long, value_name = "K")]
    pub shard: Option<Shard>,
    /// Missing shards of part K of N of the plan; K counts from 0
    #[arg(long, value_name = "K/N", conflicts_with = "shard")]
    pub part: Option<Part>,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
}

/// Shard to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shard {
    Auto,
    Number(u32),
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        if word == "auto" {
            return Ok(Self::Auto);
        }
        word.parse().map(Self::Number).map_err(|_| "expected a number or auto".to_owned())
    }
}

#[derive(Args, Debug)]
pub struct StudyStatus {
    /// Directory of the study
    pub directory: PathBuf,
    /// Print only the numbers of the missing shards, as a job array takes them
    #[arg(long)]
    pub missing: bool,
}

#[derive(Args, Debug)]
pub struct StudyMerge {
    /// Directory of the study
    pub directory: PathBuf,
    /// File for the table: .csv or .parquet
    #[arg(long, short, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Args, Debug)]
pub struct StudyReport {
    /// Directory of the study
    pub directory: PathBuf,
    /// Report to write
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    pub report: ReportForm,
}

#[derive(Args, Debug)]
pub struct StudyExport {
    pub engine: Engine,
    /// Directory of the study
    pub directory: PathBuf,
    #[command(flatten)]
    pub terms: Terms,
}

#[derive(Args, Debug)]
pub struct StudySubmit {
    /// Directory of the study
    pub directory: PathBuf,
    /// Engine that runs the shards
    #[arg(long, value_name = "ENGINE")]
    pub engine: Engine,
    /// Rounds of submission, each with the shards still missing
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    #[command(flatten)]
    pub terms: Terms,
}

/// Demands of a site on an engine's tasks.
#[derive(Args, Debug)]
pub struct Terms {
    /// Number of tasks, among which the shards are divided [default: one per shard, up to the array limit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub tasks: Option<u32>,
    /// Number of tasks that may run at a time
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub at_once: Option<u32>,
    /// Slurm: time limit of a task in minutes [default: 5 plus three times the planned time]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=525_600))]
    pub minutes: Option<u32>,
    /// Slurm: further option of sbatch, such as --directive=--partition=long; may be given several times
    #[arg(long = "directive", value_name = "OPTION", allow_hyphen_values = true)]
    pub directives: Vec<Directive>,
}

/// Engine that runs shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// A job array of Slurm
    Slurm,
    /// GNU parallel
    Parallel,
}
