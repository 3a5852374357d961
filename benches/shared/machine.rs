//! Machine on which figures were measured.

use std::process::Command;

/// Processor, cores, compiler, date and commit.
pub fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name"));
    format!(
        "{}, {} cores; {}; release profile, instruction set chosen at run time; {}; commit {}",
        model.map_or("", |text| text.trim_start_matches(['\t', ' ', ':'])),
        std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        output_of("rustc", &["--version"]),
        output_of("date", &["-u", "+%F"]),
        commit(),
    )
}

/// The commit of the code under measurement, with a plus where files of it differ.
fn commit() -> String {
    let changed = output_of("git", &["status", "--porcelain", "src", "benches", "scenarios"]);
    let mark = if changed.is_empty() { "" } else { "+" };
    format!("{}{mark}", output_of("git", &["rev-parse", "--short=9", "HEAD"]))
}

fn output_of(program: &str, arguments: &[&str]) -> String {
    let found = Command::new(program).args(arguments).output().ok();
    found.map_or_else(String::new, |output| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
