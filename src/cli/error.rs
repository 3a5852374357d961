//! Errors that end the program, and their exit codes.
//!
//! 0 done · 2 usage · 3 a check failed or a result is incomplete · 65 input data is bad · 70 internal error ·
//! 73 output cannot be created · 74 read or write failed · 75 temporary failure, try again · 129, 130, 141,
//! 143 by signal.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;

/// An end that is not success: one message and its exit code.
#[derive(Debug)]
pub struct CliError {
    code: u8,
    message: String,
}

impl CliError {
    /// The arguments do not fit together.
    pub fn usage(message: impl Display) -> Self {
        Self { code: 2, message: message.to_string() }
    }

    /// A limit that the user set is broken.
    pub fn check(message: impl Display) -> Self {
        Self { code: 3, message: message.to_string() }
    }

    /// A result is not complete yet.
    pub fn incomplete(message: impl Display) -> Self {
        Self { code: 3, message: message.to_string() }
    }

    /// Input data is bad; trying again will not help.
    pub fn input(message: impl Display) -> Self {
        Self { code: 65, message: message.to_string() }
    }

    /// A file could not be read.
    pub fn read(what: impl Display, error: &io::Error) -> Self {
        let code = match error.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::IsADirectory | io::ErrorKind::InvalidData => 65,
            _ if passing(error) => 75,
            _ => 74,
        };
        Self { code, message: format!("cannot read {what}: {error}") }
    }

    /// An output could not be created.
    pub fn create(what: impl Display, error: &io::Error) -> Self {
        Self { code: if passing(error) { 75 } else { 73 }, message: format!("cannot create {what}: {error}") }
    }

    /// An output exists and is not ours to replace, or has no directory.
    pub fn refused_output(message: impl Display) -> Self {
        Self { code: 73, message: message.to_string() }
    }

    /// A write failed; a closed pipe ends quietly.
    pub fn output(what: impl Display, error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self { code: 141, message: String::new() },
            _ => Self { code: if passing(error) { 75 } else { 74 }, message: format!("cannot write {what}: {error}") },
        }
    }

    /// The machine lacks something now that it may have later.
    pub fn passing(message: impl Display) -> Self {
        Self { code: 75, message: message.to_string() }
    }

    /// Error of a sender that broke off; the data that came is kept.
    pub fn broken(message: impl Display) -> Self {
        Self { code: 74, message: message.to_string() }
    }

    /// A signal ended the work, whose results are whole as far as it came.
    pub fn signal(number: i32) -> Self {
        Self { code: 128_u8.saturating_add(number.clamp(0, 127) as u8), message: String::new() }
    }

    /// Something that cannot happen.
    pub fn bug(message: impl Display) -> Self {
        Self { code: 70, message: format!("internal error, please report it: {message}") }
    }

    /// The exit code of this end.
    pub fn exit_code(&self) -> u8 {
        self.code
    }

    /// Message of this end, without the word that it is printed after.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// End whose message begins with its position.
    pub fn at(self, place: &str) -> Self {
        let message = if self.message.is_empty() { self.message } else { format!("{place}: {}", self.message) };
        Self { message, ..self }
    }

    /// Prints the message on standard error, control characters escaped; a failure to do so is silent.
    pub fn print(&self) {
        if self.message.is_empty() {
            return;
        }
        let _ = writeln!(io::stderr(), "error: {}", escaped(&self.message));
    }
}

/// A text whose control characters, but for line feeds, cannot reach the terminal.
pub fn escaped(text: &str) -> String {
    let escape = |c: char| c.is_control() && c != '\n';
    text.chars().map(|c| if escape(c) { c.escape_default().to_string() } else { c.to_string() }).collect()
}

/// A path as messages show it: on one line, its control characters escaped.
pub fn shown(path: &Path) -> String {
    escaped(&path.display().to_string()).replace('\n', "\\n")
}

/// True if an I/O error may disappear with time, with more room, or on another machine. Examples are a disk
/// that fails, and a file server that does not answer or has replaced a file.
fn passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::StorageFull
            | io::ErrorKind::QuotaExceeded
            | io::ErrorKind::FileTooLarge
            | io::ErrorKind::WouldBlock
            | io::ErrorKind::Interrupted
            | io::ErrorKind::OutOfMemory
            | io::ErrorKind::TimedOut
            | io::ErrorKind::StaleNetworkFileHandle
    ) || matches!(error.raw_os_error(), Some(5 | 23 | 24)) // EIO, ENFILE, EMFILE
}
