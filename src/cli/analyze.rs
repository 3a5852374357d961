//! `analyze`: judge an existing run again.

use crate::analysis;
use crate::cli::args;
use crate::cli::check;
use crate::cli::error::CliError;
use crate::cli::run::judge_error;
use crate::cli::scenario;

/// Judges the run in a directory, against a user's limits if there are any.
pub fn execute(arguments: &args::Analyze) -> Result<(), CliError> {
    let limits = check::read(arguments.check.as_deref())?;
    let summary = analysis::judge_against(&arguments.run, limits.as_ref()).map_err(judge_error)?;
    scenario::print(&format!("{summary}\nresults in {}\n", arguments.run.display()))?;
    check::enforce(limits.as_ref(), &summary)
}
