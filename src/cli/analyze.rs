//! `analyze`: judge an existing run again.

use crate::analysis;
use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::run::judge_error;
use crate::cli::scenario;

/// Judges the run in a directory.
pub fn execute(arguments: &args::Analyze) -> Result<(), CliError> {
    let summary = analysis::judge(&arguments.run).map_err(judge_error)?;
    scenario::print(&format!("{summary}\nresults in {}\n", arguments.run.display()))
}
