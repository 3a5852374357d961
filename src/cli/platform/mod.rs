//! Differences between systems: FIFOs, signals that wake a thread, and a standard output of one's own.
//!
//! Unix has all of it. On Windows a thread looks for signals now and then, and no file is a FIFO.
//! `.ci/long` compiles the program for Windows; nobody has run it there.

use std::time::Duration;

#[cfg(unix)]
mod unix;
#[cfg(unix)]
pub use unix::{Ear, bell, is_fifo, own_output, signals, undisturbed};

#[cfg(windows)]
mod windows;
#[cfg(windows)]
pub use windows::{Ear, bell, is_fifo, own_output, signals, undisturbed};

#[cfg(not(any(unix, windows)))]
compile_error!("the program runs on Unix and Windows; the library alone compiles with --no-default-features");

/// Polling interval of a thread that waits for what cannot wake it.
pub const LOOK: Duration = Duration::from_millis(50);
