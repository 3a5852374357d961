//! The program in a child process.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Path of the program.
pub const TWIN: &str = env!("CARGO_BIN_EXE_gnss-twin");

/// A static scene of two seconds that needs nothing but the program.
pub const SHORT: &str = r#"
name = "short"
start = "2010-07-01T08:00:00"
duration_s = 2
seed = 1
[motion]
kind = "static"
latitude_deg = 26.5123
longitude_deg = 80.2329
height_m = 130.0
[front_end]
sample_rate_hz = 2.6e6
format = "ci8"
[power]
cn0_dbhz = 45.0
[noise]
"#;

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
