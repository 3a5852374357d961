//! Form of a command's printed results: words, one JSON object, or nothing.
//!
//! Warnings and errors go to standard error in any case. Results go to standard output. The object is one
//! line, so that several runs in a row are JSON lines.

use clap::Args;
use serde_json::{Value, json};

use crate::analysis::judge::judgement::Status;
use crate::analysis::judge::verdict::Verdict;
use crate::cli::error::CliError;
use crate::cli::scenario;

/// Flags of a command with results.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Printed {
    /// Print only warnings and errors
    #[arg(long, short, conflicts_with = "json")]
    pub quiet: bool,
    /// Print the results as one JSON object on one line, without progress
    #[arg(long)]
    pub json: bool,
}

impl Printed {
    /// Prints results in words, as an object or not at all.
    pub fn results(self, text: &str, object: impl FnOnce() -> Value) -> Result<(), CliError> {
        match self {
            Self { quiet: true, .. } => Ok(()),
            Self { json: true, .. } => scenario::print(&(object().to_string() + "\n")),
            _ => scenario::print(text),
        }
    }

    /// True if results are printed in words, with progress on a terminal.
    pub fn in_words(self) -> bool {
        !self.quiet && !self.json
    }
}

/// A verdict: how many figures have which status, each of those that fail, and what is not judged.
pub fn verdict(verdict: &Verdict) -> Value {
    let count = |status| verdict.count(status);
    let failed = verdict.rows.iter().filter(|row| row.status == Status::Fail);
    let failed = failed.map(|row| json!({ "figure": row.figure, "value": row.value, "limit": row.bound.to_string() }));
    json!({
        "status": verdict.status(),
        "pass": count(Status::Pass),
        "marginal": count(Status::Marginal),
        "fail": count(Status::Fail),
        "failed": failed.collect::<Vec<_>>(),
        "not_judged": verdict.not_judged,
    })
}
