//! The program in a child process.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Path of the program.
pub const TWIN: &str = env!("CARGO_BIN_EXE_gnss-twin");

/// Output of the program with these arguments, run in a directory.
pub fn twin(arguments: &[&str], directory: &Path) -> Output {
    Command::new(TWIN).args(arguments).current_dir(directory).stdin(Stdio::null()).output().unwrap()
}

/// Messages of the program.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Exit code, or −1 after a signal.
pub fn code(output: &Output) -> i32 {
    output.status.code().unwrap_or(-1)
}
