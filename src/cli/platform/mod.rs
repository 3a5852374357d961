//! Differences between systems: FIFOs, signals that wake a thread, and a standard output of one's own.
//!
//! Unix has all of it. On Windows a thread looks for signals now and then, and no file is a FIFO.
//! `.ci/long` compiles the program for Windows; nobody has run it there.

#[cfg(unix)]
mod unix;
#[cfg(unix)]
pub use unix::{Ear, bell, is_fifo, own_output, signals};

#[cfg(not(unix))]
mod other;
#[cfg(not(unix))]
pub use other::{Ear, bell, is_fifo, own_output, signals};
