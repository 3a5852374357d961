//! `--check`: a user's limits or the verdict's own, and the end when one is broken.

use std::path::PathBuf;

use crate::cli::error::CliError;
use crate::cli::printed::Printed;
use crate::cli::scenario;
use analysis::judge::judgement::{Judgement, Status};
use analysis::judge::limits::Limits;
use analysis::judge::schema::Figures;
use analysis::judge::verdict::Verdict;

/// Conditions under which the program ends with 0.
pub enum Gate {
    /// Nothing: the verdict is printed.
    Open,
    /// Every limit of the verdict itself.
    Verdict,
    /// A user's limits.
    Limits(Limits),
}

impl Gate {
    /// Reads `--check` as written: absent, alone, or with a file of limits for those figures.
    pub fn read(argument: Option<&Option<PathBuf>>, figures: &'static Figures) -> Result<Self, CliError> {
        let path = match argument {
            None => return Ok(Self::Open),
            Some(None) => return Ok(Self::Verdict),
            Some(Some(path)) => path,
        };
        let (name, text) = scenario::text(path)?;
        Limits::parse_for(figures, &text, &name).map(Self::Limits).map_err(CliError::input)
    }

    /// The user's limits, if there are any.
    pub fn limits(&self) -> Option<&Limits> {
        if let Self::Limits(limits) = self { Some(limits) } else { None }
    }

    /// Prints what broke a limit and by how much, if results are printed in words; exit code 3 if anything
    /// did.
    pub fn enforce(&self, verdict: &Verdict, printed: Printed) -> Result<(), CliError> {
        let (broken, all, whose): (Vec<&Judgement>, usize, String) = match self {
            Self::Open => return Ok(()),
            Self::Verdict => {
                let failed = verdict.rows.iter().filter(|row| row.status == Status::Fail).collect();
                (failed, verdict.rows.len(), "the verdict".to_owned())
            }
            Self::Limits(limits) => (verdict.broken().collect(), verdict.of_user, limits.name.clone()),
        };
        if broken.is_empty() {
            let text = format!("all {all} limits of {whose} hold\n");
            return if printed.in_words() { scenario::print(&text) } else { Ok(()) };
        }
        if printed.in_words() {
            scenario::print(&table(&broken))?;
        }
        Err(CliError::check(format!("{} of {all} limits of {whose} are broken", broken.len())))
    }
}

fn table(broken: &[&Judgement]) -> String {
    let width = broken.iter().map(|row| row.figure.chars().count()).max().unwrap_or(0).max("figure".len());
    let mut table = format!("{:<width$}  {:>12}  {:>12}  {}\n", "figure", "value", "limit", "by how much");
    for row in broken {
        let (value, limit, margin) = (row.value_text(), row.bound.to_string(), row.margin_text());
        table += &format!("{:<width$}  {value:>12}  {limit:>12}  {margin}\n", row.figure);
    }
    table
}
