//! `osnma verify`: authentication of a recording of I/NAV pages, tag by tag.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::json;

use crate::cli::error::CliError;
use crate::cli::osnma::args::Verify;
use crate::cli::osnma::pages::{anchor, read};
use crate::cli::osnma::summary::Summary;
use crate::cli::run::output_error;
use crate::cli::staging::Staging;
use osnma::bits::hex;
use osnma::keys::Anchor;
use osnma::report::TagReport;
use osnma::verifier::{Settings, Verifier};
use receiver::output::{STORED_ROOT, TagTable};

/// Verifies the recording, writes the tags if a directory is named, and prints the summary.
pub fn execute(arguments: &Verify) -> Result<(), CliError> {
    let anchor = anchor(arguments)?;
    let start = match &anchor {
        Anchor::Tree(_) => "cold",
        Anchor::Key(_) => "warm",
        Anchor::Root(..) => "hot",
    };
    let pages = read(&arguments.pages)?;
    // A directory that cannot be made is told before the work.
    let staging = arguments.out.as_deref().map(Staging::directory).transpose()?;
    let settings = Settings { time_uncertainty_s: arguments.time_uncertainty_s, tag_bits: arguments.tag_bits };
    let mut verifier = Verifier::new(anchor, settings).map_err(CliError::input)?;
    let mut reports = Vec::new();
    for page in &pages {
        reports.extend(verifier.page(page, page.start.seconds() as f64 + arguments.clock_offset_s));
    }
    reports.extend(verifier.finish());
    let summary = Summary::new(&pages, start, &verifier);
    let mut text = summary.text();
    if let (Some(staging), Some(out)) = (staging, &arguments.out) {
        write(&staging, &reports, &summary, verifier.stored_root().as_deref())?;
        staging.commit()?;
        let _ = writeln!(text, "results in {}", out.display());
    }
    let failure = summary.failure();
    arguments.printed.results(&text, || {
        let mut object = summary.object();
        object["results"] = json!(arguments.out);
        object["failure"] = json!(failure);
        object
    })?;
    failure.map_or(Ok(()), |failure| Err(CliError::check(failure)))
}

/// Writes the table, the summary and the root key of a hot start.
fn write(staging: &Staging, reports: &[TagReport], summary: &Summary<'_>, root: Option<&[u8]>) -> Result<(), CliError> {
    let put = |name: &str, text: String| -> Result<(), CliError> {
        let path = staging.path().join(name);
        fs::write(&path, text).map_err(|error| CliError::output(Path::new(name).display(), &error))
    };
    let mut table = TagTable::create(staging.path()).map_err(output_error)?;
    reports.iter().try_for_each(|report| table.write(&report.row())).map_err(output_error)?;
    table.flush().map_err(output_error)?;
    put("osnma.json", format!("{:#}\n", summary.object()))?;
    root.map_or(Ok(()), |root| put(STORED_ROOT, hex(root) + "\n"))
}
