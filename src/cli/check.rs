//! `--check`: a user's limits, and the end when one is broken.

use std::path::Path;

use crate::analysis::limits::Limits;
use crate::analysis::summary::Summary;
use crate::analysis::verdict::Judgement;
use crate::cli::error::CliError;
use crate::cli::scenario;

/// Reads a file of limits.
pub fn read(path: Option<&Path>) -> Result<Option<Limits>, CliError> {
    let Some(path) = path else { return Ok(None) };
    let (name, text) = scenario::text(path)?;
    Limits::parse(&text, &name).map(Some).map_err(CliError::input)
}

/// Prints what broke a limit and by how much; exit code 3 if anything did.
pub fn enforce(limits: Option<&Limits>, summary: &Summary) -> Result<(), CliError> {
    let Some(limits) = limits else { return Ok(()) };
    let verdict = &summary.details.verdict;
    let broken: Vec<&Judgement> = verdict.broken().collect();
    let all = verdict.of_user;
    if broken.is_empty() {
        return scenario::print(&format!("all {all} limits of {} hold\n", limits.name));
    }
    let path_width = broken.iter().map(|row| row.figure.len()).max().unwrap_or(0).max("figure".len());
    let mut table = format!("{:<path_width$}  {:>12}  {:>12}  {}\n", "figure", "value", "limit", "by how much");
    for row in &broken {
        let (value, limit, margin) = (row.value_text(), row.bound.to_string(), row.margin_text());
        table += &format!("{:<path_width$}  {value:>12}  {limit:>12}  {margin}\n", row.figure);
    }
    scenario::print(&table)?;
    Err(CliError::check(format!("{} of {all} limits of {} are broken", broken.len(), limits.name)))
}
