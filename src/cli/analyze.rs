//! `analyze`: judge an existing run again, or another receiver by its files.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::cli::args;
use crate::cli::check::Gate;
use crate::cli::error::CliError;
use crate::cli::logs as log_tables;
use crate::cli::printed;
use crate::cli::run::judge_error;
use crate::cli::scenario;
use crate::cli::stations;
use analysis::judge::foreign::{self, Files};
use analysis::judge::schema::SUMMARY;
use analysis::judge::verdict::Verdict;
use analysis::logged;
use analysis::show;
use gnss::renamed::{self, Class};

/// Judges the run in a directory, against a user's limits if there are any, or a receiver against a truth.
pub fn execute(arguments: &args::Analyze) -> Result<(), CliError> {
    scenario::use_threads(None)?;
    if let Some(truth) = &arguments.truth {
        return another_receiver(truth, arguments);
    }
    let Some(run) = &arguments.run else {
        return Err(CliError::usage("analyze: expected a run's directory, or --truth"));
    };
    stations::refuse_several(run)?;
    let gate = Gate::read(arguments.check.as_ref(), &SUMMARY)?;
    earlier_files(run).iter().for_each(|warning| scenario::warn(warning));
    let summary = analysis::judge_into(run, gate.limits(), arguments.report.forms()).map_err(judge_error)?;
    let verdict = &summary.details.verdict;
    arguments.printed.results(
        &format!("{summary}\nresults in {}\n", run.display()),
        || json!({ "results": run, "summary": summary, "verdict": printed::verdict(verdict) }),
    )?;
    gate.enforce(verdict, arguments.printed)
}

/// Warnings about files of results that an earlier version wrote under other names.
fn earlier_files(run: &Path) -> Vec<String> {
    let files = renamed::NAMES.iter().filter(|(class, earlier, _)| *class == Class::File && run.join(earlier).exists());
    let warning = |(_, earlier, now): &(Class, &str, &str)| {
        format!("{}: an earlier version wrote it; it is called {now} now", run.join(earlier).display())
    };
    files.map(warning).collect()
}

fn another_receiver(truth: &Path, arguments: &args::Analyze) -> Result<(), CliError> {
    let files = Files { rinex_obs: arguments.files.rinex_obs.clone(), nmea: arguments.files.nmea.clone() };
    let gate = Gate::read(arguments.check.as_ref(), &foreign::FIGURES)?;
    let asked = arguments.log_as.map(args::LogProtocol::protocol);
    let logged = arguments.files.log.as_ref().map(|log| logged::judge(truth, log, asked, &files)).transpose();
    let (judgement, log) = match logged.map_err(judge_error)? {
        Some(logged) => {
            (logged.judgement, Some((logged.protocol, logged.contents, logged.without_fix, logged.reported)))
        }
        None => (foreign::judge(truth, &files).map_err(judge_error)?, None),
    };
    let mut verdict = Verdict::of_foreign(&judgement).map_err(judge_error)?;
    if let Some(limits) = gate.limits() {
        let figures = serde_json::to_value(&judgement.summary).unwrap_or_default();
        verdict = verdict.with_user(limits.judge(&figures));
    }
    let out = arguments.out.clone().unwrap_or_else(|| {
        let name = format!("{}-foreign", scenario::file_name(&judgement.summary.scene));
        PathBuf::from("reports").join(name)
    });
    std::fs::create_dir_all(&out).map_err(|error| CliError::create(out.display(), &error))?;
    show::foreign::write(&judgement, &verdict, &out, arguments.report.forms()).map_err(judge_error)?;
    let (mut words, mut object) = (String::new(), Value::Null);
    if let Some((protocol, contents, without_fix, reported)) = &log {
        words = format!("log of {}\n{contents}", protocol.name());
        if *without_fix > 0 {
            words += &format!("{:<14}{without_fix} epochs\n", "without fix");
        }
        if let Some(reported) = reported {
            reported.write(&out).map_err(judge_error)?;
            words += &reported.to_string();
        }
        words.push('\n');
        object = log_tables::object(contents);
        object["judged"] = json!(protocol.name());
        object["without_fix"] = json!(without_fix);
        object["reported"] = json!(reported);
        let path = out.join("foreign_log.json");
        std::fs::write(&path, format!("{object:#}\n")).map_err(|error| CliError::output(path.display(), &error))?;
    }
    let text = format!("{words}{}\n{verdict}\nresults in {}\n", judgement.summary, out.display());
    arguments.printed.results(&text, || {
        let summary = &judgement.summary;
        let mut whole = json!({ "results": out, "summary": summary, "verdict": printed::verdict(&verdict) });
        if !object.is_null() {
            whole["log"] = object;
        }
        whole
    })?;
    gate.enforce(&verdict, arguments.printed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_an_earlier_version_is_told_with_its_name_now() {
        let run = tempfile::tempdir().unwrap();
        std::fs::write(run.path().join("consistency.csv"), "").unwrap();
        assert!(earlier_files(run.path()).is_empty());
        std::fs::write(run.path().join("honesty.csv"), "").unwrap();
        let told = earlier_files(run.path());
        assert!(
            told.len() == 1
                && told[0].ends_with(
                    "honesty.csv: an earlier version wrote it; it is called \
                                                     consistency.csv now"
                ),
            "{told:?}"
        );
    }
}
