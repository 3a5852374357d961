//! A program's processor time and its largest memory.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Ticks a second of `/proc/self/stat`, whatever the machine.
const TICKS: f64 = 100.0;
/// Time between two readings of the memory.
const LOOK: Duration = Duration::from_millis(2);

/// Resources that a process used.
#[derive(Clone, Copy, Debug)]
pub struct Spent {
    /// Processor time, the kernel's share in.
    pub cpu_s: f64,
    /// Largest resident set.
    pub peak_mib: f64,
}

/// Runs a program with these arguments; of `receive` a recording without a fix is none to complain about.
///
/// # Errors
/// In words, where it cannot run or fails.
pub fn spent(program: &Path, arguments: &[&str]) -> Result<Spent, String> {
    let before = of_children_s()?;
    let mut child = Command::new(program)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|error| format!("{}: {error}", program.display()))?;
    let status_file = format!("/proc/{}/status", child.id());
    let mut peak_kib = 0.0_f64;
    let status = loop {
        let looked = std::fs::read_to_string(&status_file).unwrap_or_default();
        let seen = looked.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = seen.and_then(|text| text.trim().trim_end_matches("kB").trim().parse().ok());
        peak_kib = peak_kib.max(kib.unwrap_or(0.0));
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) => std::thread::sleep(LOOK),
            Err(error) => return Err(format!("{}: {error}", program.display())),
        }
    };
    if !matches!(status.code(), Some(0 | 3)) {
        return Err(format!("{} {}: {status}", program.display(), arguments.join(" ")));
    }
    Ok(Spent { cpu_s: of_children_s()? - before, peak_mib: peak_kib / 1024.0 })
}

/// Processor time of all children so far, user's and kernel's.
fn of_children_s() -> Result<f64, String> {
    let stat = std::fs::read_to_string("/proc/self/stat").map_err(|error| format!("/proc/self/stat: {error}"))?;
    // Fields are counted behind the program's name, which may hold anything.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |at: usize| fields.get(at).and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN);
    Ok((ticks(13) + ticks(14)) / TICKS)
}

/// Takes a result or a recording of before away, and what stands beside it.
///
/// # Errors
/// In words, where it does not go.
pub fn remove(path: &Path) -> Result<(), String> {
    let all: [PathBuf; 3] = [path.to_owned(), path.with_extension("sigmf-meta"), path.with_extension("truth")];
    for path in all.iter().filter(|path| path.exists()) {
        let gone = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
        gone.map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}
