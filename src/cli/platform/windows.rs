//! Systems without FIFOs and without handlers that may write to a socket: Windows.

use std::fs::{File, Metadata};
use std::io::{self, Stdout};
use std::os::windows::io::AsHandle;
use std::thread;

use signal_hook::consts::{SIGINT, SIGTERM};

use crate::cli::platform::LOOK;

/// True if a file is a FIFO: none is.
pub fn is_fifo(_: &Metadata) -> bool {
    false
}

/// Standard output beside the library's own, which looks for ends of lines.
///
/// # Errors
/// Errors of the system: no handle is left.
pub fn own_output(output: &Stdout) -> io::Result<File> {
    output.as_handle().try_clone_to_owned().map(File::from)
}

/// Signals that end the program.
pub fn signals() -> Vec<i32> {
    vec![SIGINT, SIGTERM]
}

/// The result of `work`: a signal that comes meanwhile is not held back.
///
/// # Errors
/// Errors of `work`.
pub fn undisturbed<T>(_: &[i32], work: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    work()
}

/// Nothing that a signal's handler writes to.
pub struct Bell;

/// Wait by looking now and then.
pub struct Ear;

/// Both ends of a wake.
///
/// # Errors
/// None.
pub fn bell() -> io::Result<(Bell, Ear)> {
    Ok((Bell, Ear))
}

impl Bell {
    /// Does nothing: the thread looks by itself.
    ///
    /// # Errors
    /// None.
    pub fn rings_for(&self, _: i32) -> io::Result<()> {
        Ok(())
    }
}

impl Ear {
    /// Waits for a moment.
    pub fn wait(&mut self) {
        thread::sleep(LOOK);
    }
}
