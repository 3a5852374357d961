//! Scripts that hand the missing shards to an engine. Exactly once is not the engine's matter but the
//! shards'; a script says which exit codes may pass by themselves (75, and deaths by a signal) and are worth
//! another try.
//!
//! A task runs one [`Part`] of the plan, what is missing of it. Facts of Slurm: `sbatch(1)`, 22.05.

use std::fmt::Write as _;
use std::str::FromStr;

use super::StudyError;
use super::part::Part;
use super::plan::Plan;
use super::shard::ranges;

/// Engine that runs shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// A job array of Slurm.
    Slurm,
    /// GNU parallel, on this machine or those of its `--sshlogin`.
    Parallel,
}

/// Requirements of a site on a script.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Terms {
    /// Tasks that share the plan's shards; absent for one a shard, as far as `most_tasks` allows.
    pub tasks: Option<u32>,
    /// Tasks that may run at a time.
    pub at_once: Option<u32>,
    /// Time limit of a task in minutes; absent for one that follows from the plan.
    pub minutes: Option<u32>,
    /// Further directives for Slurm.
    pub directives: Vec<Directive>,
}

/// An option of `sbatch` on one line: `--partition=long`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Directive(String);

impl FromStr for Directive {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.starts_with("--") && !text.contains(|c: char| c.is_control()) {
            return Ok(Self(text.to_owned()));
        }
        Err("expected an option of sbatch on one line: --partition=long".to_owned())
    }
}

/// Tasks of an array where its site says nothing else: Slurm's `MaxArraySize` is 1001 by default, indices up
/// to 1000.
pub const MOST_TASKS: u32 = 1001;
/// Ratio of a task's time limit to the plan's expectation.
const PATIENCE: f64 = 3.0;
/// Additional time of a task to start, minutes.
const START_MINUTES: f64 = 5.0;

/// Text that a POSIX shell takes for one word, whatever it holds.
///
/// # Errors
/// A zero byte, which no argument can carry.
pub fn shell_word(text: &str) -> Result<String, StudyError> {
    if text.contains('\0') {
        return Err(StudyError::Bug(format!("{text:?} cannot be an argument: it holds a zero byte")));
    }
    Ok(format!("'{}'", text.replace('\'', "'\\''")))
}

/// The script that runs these shards of a plan with the program at `program`, in at most `most_tasks` tasks.
///
/// # Errors
/// A path that no shell can carry.
pub fn script(
    plan: &Plan,
    engine: Engine,
    program: &str,
    shards: &[u32],
    most_tasks: u32,
    terms: &Terms,
) -> Result<String, StudyError> {
    let directory = plan.directory.to_str().ok_or_else(|| {
        StudyError::input(&plan.directory, "not UTF-8: expected a directory whose name a script can hold")
    })?;
    let tasks = terms.tasks.unwrap_or(plan.shards()).clamp(1, most_tasks.max(1)).min(plan.shards().max(1));
    let numbers = Part::holding(shards, plan.shards(), tasks);
    let (program, word) = (shell_word(program)?, shell_word(directory)?);
    Ok(match engine {
        Engine::Slurm => {
            let head = directives(plan, directory, &numbers, tasks, terms);
            slurm(&head, &format!("{program} study run {word}"), tasks)
        }
        Engine::Parallel => parallel(&format!("{program} study run {word}"), &numbers, tasks, terms.at_once),
    })
}

/// Lines that Slurm reads before the script runs.
fn directives(plan: &Plan, directory: &str, numbers: &[u32], tasks: u32, terms: &Terms) -> String {
    let at_once = terms.at_once.map(|limit| format!("%{limit}")).unwrap_or_default();
    let minutes = terms.minutes.unwrap_or_else(|| minutes_of(plan, tasks));
    let mut head = format!(
        "#SBATCH --job-name={}\n\
         #SBATCH --array={}{at_once}\n\
         #SBATCH --cpus-per-task=1\n\
         #SBATCH --time={minutes}\n\
         #SBATCH --requeue\n\
         #SBATCH --open-mode=append\n",
        plan.study.name,
        ranges(numbers),
    );
    if let Some(logs) = logs(directory) {
        let _ = writeln!(head, "#SBATCH --output=\"{logs}/%A_%a\"");
    }
    for Directive(option) in &terms.directives {
        let _ = writeln!(head, "#SBATCH {option}");
    }
    head
}

/// Directory of the logs in Slurm's notation. `None` where the path has a backslash or a control character: a
/// backslash ends Slurm's reading of `%A`, a line break its line. The site then chooses the directory.
fn logs(directory: &str) -> Option<String> {
    let fits = !directory.contains(|c: char| c == '\\' || c.is_control());
    fits.then(|| format!("{}/log", directory.replace('"', "\\\"").replace('%', "%%")))
}

/// A limit for a task: several times what the plan expects of its shards on one core.
fn minutes_of(plan: &Plan, tasks: u32) -> u32 {
    let shards = f64::from(plan.shards().div_ceil(tasks.max(1)));
    let minutes = START_MINUTES + PATIENCE * shards * plan.shard_s() / 60.0;
    minutes.ceil().clamp(1.0, f64::from(u32::MAX)) as u32
}

fn slurm(head: &str, run: &str, tasks: u32) -> String {
    format!(
        "#!/bin/bash\n\
         {head}\
         # Parts of the plan in which a shard is missing when this is written. `study status` says what is \
         missing afterwards:\n\
         # what an engine loses is submitted again, what it runs twice comes out the same.\n\
         {run} --part \"$SLURM_ARRAY_TASK_ID/{tasks}\" --jobs \"${{SLURM_CPUS_PER_TASK:-1}}\"\n\
         code=$?\n\
         # 75 and deaths by a signal may pass by themselves; bad data (65) never does.\n\
         if {{ [ \"$code\" -eq 75 ] || [ \"$code\" -gt 128 ]; }} && [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt 3 ]; \
         then\n    scontrol requeue \"${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}\"\n\
         fi\n\
         exit \"$code\"\n"
    )
}

fn parallel(run: &str, numbers: &[u32], tasks: u32, at_once: Option<u32>) -> String {
    let jobs = at_once.map(|limit| format!(" --jobs {limit}")).unwrap_or_default();
    let numbers: Vec<String> = numbers.iter().map(u32::to_string).collect();
    format!(
        "#!/bin/bash\n\
         run_part() {{\n    \
         local code\n    \
         for attempt in 1 2 3; do\n        \
         {run} --part \"$1/{tasks}\" --jobs 1\n        \
         code=$?\n        \
         # 75 and deaths by a signal may pass by themselves; bad data (65) never does.\n        \
         [ \"$code\" -eq 75 ] || [ \"$code\" -gt 128 ] || break\n    \
         done\n    \
         return \"$code\"\n\
         }}\n\
         export -f run_part\n\
         # A line a task; as input, since arguments have a largest length.\n\
         parallel{jobs} --env run_part run_part <<'TASKS'\n\
         {}\n\
         TASKS\n",
        numbers.join("\n")
    )
}
