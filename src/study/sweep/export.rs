//! Scripts that hand the missing shards to an engine. Exactly once is not the engine's matter but the
//! shards'; a script says which exit codes may pass by themselves (75, and deaths by a signal) and are worth
//! another try.

use super::StudyError;
use super::plan::Plan;
use super::shard::ranges;

/// What runs shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// A job array of Slurm.
    Slurm,
    /// GNU parallel, on this machine or those of its `--sshlogin`.
    Parallel,
}

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

/// The script that runs these shards of a plan with the program at `program`.
///
/// # Errors
/// A path that no shell can carry.
pub fn script(plan: &Plan, engine: Engine, program: &str, shards: &[u32]) -> Result<String, StudyError> {
    let directory = plan.directory.to_str().ok_or_else(|| {
        StudyError::input(&plan.directory, "not UTF-8: expected a directory whose name a script can hold")
    })?;
    let (program, directory, name) = (shell_word(program)?, shell_word(directory)?, &plan.study.name);
    Ok(match engine {
        Engine::Slurm => format!(
            "#!/bin/bash\n\
             #SBATCH --job-name={name}\n\
             #SBATCH --array={}\n\
             #SBATCH --cpus-per-task=1\n\
             #SBATCH --requeue\n\
             # Shards that are missing when this is written. Run `study status --missing` afterwards: what an engine \
             loses is\n\
             # submitted again, what it runs twice comes out the same.\n\
             {program} study run {directory} --shard \"$SLURM_ARRAY_TASK_ID\" --jobs \"${{SLURM_CPUS_PER_TASK:-1}}\"\n\
             code=$?\n\
             # 75 and deaths by a signal may pass by themselves; bad data (65) never does.\n\
             if {{ [ \"$code\" -eq 75 ] || [ \"$code\" -gt 128 ]; }} && [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt 3 ]; \
             then\n    scontrol requeue \"${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}\"\n\
             fi\n\
             exit \"$code\"\n",
            ranges(shards)
        ),
        Engine::Parallel => {
            let numbers: Vec<String> = shards.iter().map(u32::to_string).collect();
            format!(
                "#!/bin/bash\n\
                 run_shard() {{\n    \
                 local code\n    \
                 for attempt in 1 2 3; do\n        \
                 {program} study run {directory} --shard \"$1\" --jobs 1\n        \
                 code=$?\n        \
                 # 75 and deaths by a signal may pass by themselves; bad data (65) never does.\n        \
                 [ \"$code\" -eq 75 ] || [ \"$code\" -gt 128 ] || break\n    \
                 done\n    \
                 return \"$code\"\n\
                 }}\n\
                 export -f run_shard\n\
                 parallel run_shard ::: {}\n",
                numbers.join(" ")
            )
        }
    })
}
