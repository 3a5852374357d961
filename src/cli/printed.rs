//! Form of a command's printed results: words, one JSON object, or nothing.
//!
//! Warnings and errors go to standard error in any case. Results go to standard output. The object is one
//! line, so that several runs in a row are JSON lines.

use clap::Args;
use serde_json::{Value, json};

use crate::cli::error::CliError;
use crate::cli::scenario;
use analysis::judge::judgement::Status;
use analysis::judge::verdict::Verdict;
use gnss::earth::Geodetic;
use gnss::record::Fix;

/// Flags of a command with results.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Printed {
    /// Print only warnings and errors, and with --json the object
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the results as one JSON object on one line, without progress
    #[arg(long)]
    pub json: bool,
}

impl Printed {
    /// Prints results in words, as an object or not at all.
    pub fn results(self, text: &str, object: impl FnOnce() -> Value) -> Result<(), CliError> {
        match self {
            Self { json: true, .. } => scenario::print(&(object().to_string() + "\n")),
            Self { quiet: true, .. } => Ok(()),
            _ => scenario::print(text),
        }
    }

    /// True if results are printed in words, with progress on a terminal.
    pub fn in_words(self) -> bool {
        !self.quiet && !self.json
    }
}

/// Position and GPS time of the last fix in words: a line to be printed, or nothing without a fix.
pub fn last_fix_line(fix: Option<&Fix>) -> String {
    fix.map_or_else(String::new, |fix| {
        let Geodetic { latitude_rad, longitude_rad, height_m } = Geodetic::from_ecef(&fix.position_m());
        let [latitude_deg, longitude_deg] = [latitude_rad, longitude_rad].map(f64::to_degrees);
        let (north, east) = (if latitude_deg < 0.0 { "S" } else { "N" }, if longitude_deg < 0.0 { "W" } else { "E" });
        let (latitude_deg, longitude_deg, time) = (latitude_deg.abs(), longitude_deg.abs(), fix.time());
        format!(
            "last fix      {latitude_deg:.7}° {north}, {longitude_deg:.7}° {east}, {height_m:.2} m at {time} GPS time\n"
        )
    })
}

/// Position and GPS time of the last fix as an object; null without a fix.
pub fn last_fix(fix: Option<&Fix>) -> Value {
    fix.map_or(Value::Null, |fix| {
        let position = Geodetic::from_ecef(&fix.position_m());
        json!({
            "gps_time": fix.time().to_string(),
            "latitude_deg": position.latitude_rad.to_degrees(),
            "longitude_deg": position.longitude_rad.to_degrees(),
            "height_m": position.height_m,
        })
    })
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
