//! State of a submitted job in Slurm, from its own programs `sbatch`, `squeue`, `scancel` and `scontrol`.
//!
//! The shards themselves are the only evidence of what is done. Accounting knows neither a task whose node
//! died after its last write, nor one that was preempted and came back (`sacct` shows PREEMPTED). The queue
//! decides only whether waiting is worthwhile.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::cli::error::CliError;
use study::sweep::export::MOST_TASKS;

/// State of a job in a queue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Queued {
    /// Tasks that run or will run by themselves.
    Waiting {
        /// Running now.
        running: usize,
        /// Reason why the first of the others waits, in Slurm's word.
        reason: Option<String>,
    },
    /// Tasks are there, and none will ever run by itself.
    Held(String),
    /// No task is there any more.
    Gone,
    /// The controller does not answer; it may later.
    Silent,
}

/// Reasons with which a task waits for somebody to release it (`squeue(1)`, job reason codes). A controller
/// that died leaves such.
const HELD: [&str; 6] = [
    "JobHeldUser",
    "JobHeldAdmin",
    "launch failed requeued held",
    "job requeued in held state",
    "DependencyNeverSatisfied",
    "BadConstraints",
];

/// Runs one of Slurm's programs; its output, or what it says of why there is none.
fn ask(program: &str, arguments: &[&str]) -> Result<Result<String, String>, CliError> {
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    let output = output.map_err(|error| {
        CliError::passing(format!("cannot run {program}: {error}; expected Slurm's programs in PATH, see study export"))
    })?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    Ok(if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) })
}

/// Tasks that an array may have here: indices stay below `MaxArraySize`.
pub fn most_tasks() -> u32 {
    let asked = ask("scontrol", &["show", "config"]).ok().and_then(Result::ok).unwrap_or_default();
    let named = asked.lines().find_map(|line| line.trim().strip_prefix("MaxArraySize"));
    named.and_then(|rest| rest.trim().trim_start_matches('=').trim().parse().ok()).unwrap_or(MOST_TASKS)
}

/// Hands a script to Slurm; the job's number.
pub fn submit(script: &Path) -> Result<String, CliError> {
    let script = script.to_string_lossy();
    match ask("sbatch", &["--parsable", &script])? {
        // "number" or "number;cluster".
        Ok(text) if text.split(';').next().is_some_and(is_number) => {
            Ok(text.split(';').next().unwrap_or_default().to_owned())
        }
        Ok(text) => Err(CliError::passing(format!("sbatch says {text:?}: expected a job's number"))),
        Err(reason) => Err(CliError::passing(format!("sbatch does not take {script}: {reason}"))),
    }
}

/// True if the text is a job's number.
pub fn is_number(text: &str) -> bool {
    !text.is_empty() && text.len() <= 18 && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// State of a job in the queue.
pub fn look(job: &str) -> Result<Queued, CliError> {
    let answer = ask("squeue", &["--noheader", "--array", "--jobs", job, "--format", "%T|%r"])?;
    Ok(match answer {
        Ok(text) => read(&text),
        // A job that ended some minutes ago is not known any more.
        Err(reason) if reason.contains("Invalid job id") => Queued::Gone,
        Err(_) => Queued::Silent,
    })
}

/// Lines "state|reason", one a task.
fn read(text: &str) -> Queued {
    let tasks: Vec<(&str, &str)> = text.lines().filter_map(|line| line.trim().split_once('|')).collect();
    let is_held = |task: &&(&str, &str)| task.0 == "PENDING" && HELD.contains(&task.1);
    let Some(first) = tasks.first() else { return Queued::Gone };
    if tasks.iter().all(|task| is_held(&task)) {
        return Queued::Held(first.1.to_owned());
    }
    let running = tasks.iter().filter(|task| task.0 != "PENDING").count();
    let reason = tasks.iter().find(|task| task.0 == "PENDING").map(|task| task.1.to_owned());
    Queued::Waiting { running, reason }
}

/// Takes what is left of a job out of the queue. That it is gone already is as good.
pub fn cancel(job: &str) {
    let _ = ask("scancel", &[job]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_queue_is_read_as_slurm_writes_it() {
        assert_eq!(read(""), Queued::Gone);
        assert_eq!(read("RUNNING|None\n"), Queued::Waiting { running: 1, reason: None });
        let mixed = Queued::Waiting { running: 1, reason: Some("Resources".to_owned()) };
        assert_eq!(read("COMPLETING|None\nPENDING|Resources\nPENDING|Priority\n"), mixed);
        // As a controller left it that was killed and started again.
        let held = Queued::Held("launch failed requeued held".to_owned());
        assert_eq!(read("PENDING|launch failed requeued held\nPENDING|JobHeldUser\n"), held);
        let partly = Queued::Waiting { running: 0, reason: Some("JobHeldUser".to_owned()) };
        assert_eq!(read("PENDING|JobHeldUser\nPENDING|Priority\n"), partly);
    }

    #[test]
    fn a_jobs_number_has_digits_alone() {
        assert!(is_number("17") && !is_number("") && !is_number("1 2") && !is_number("--all"));
    }
}
