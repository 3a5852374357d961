//! Arguments of `pack` as written.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use crate::cli::printed::Printed;

#[derive(Args, Debug)]
pub struct Pack {
    #[command(subcommand)]
    pub action: PackAction,
}

#[derive(Debug, Subcommand)]
pub enum PackAction {
    /// Run the entries of a pack, judge each and write one matrix. An interrupted run continues with the same
    /// command
    Run(PackRun),
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin scenes --pack dynamics --out dynamics && gnss-twin pack run dynamics\n  \
                  gnss-twin pack run jammertest --only '1.1.*' --junit junit.xml\n\nExit code: 0 if every entry ends \
                  as the pack expects, 3 if one does not, 65 for a manifest or a scene that is refused"
)]
pub struct PackRun {
    /// Directory of the pack, which holds pack.toml
    pub directory: PathBuf,
    /// Directory for the results: matrix.csv, matrix.html, matrix.pdf, junit.xml, times.csv and a directory
    /// for each entry [default: reports/PACK]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Run entries whose name or GROUP/NAME matches: * stands for any characters, ? for one. May be repeated
    /// [default: all]
    #[arg(long, value_name = "GLOB")]
    pub only: Vec<String>,
    /// Level: samples, as each scene sets it, or correlations, where a model answers in place of samples.
    /// Scenes that it has no model of are skipped and named
    #[arg(long, value_enum, default_value_t)]
    pub level: Level,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Write the JUnit XML to this file too
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Keep truth/ and rx/ of each entry, which `analyze` needs for a report of its own
    #[arg(long)]
    pub keep: bool,
    #[command(flatten)]
    pub printed: Printed,
}

/// Level at which the entries run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Level {
    /// Samples, at the level of fidelity that each scene sets
    #[default]
    Samples,
    /// Modelled correlations
    Correlations,
    /// Modelled observations
    Observations,
}

impl Level {
    /// Name of the level on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Correlations => "correlations",
            Self::Observations => "observations",
        }
    }
}
