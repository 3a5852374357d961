//! Unix.

use std::fs::{File, Metadata};
use std::io::{self, Read, Stdout};
use std::os::fd::AsFd;
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::UnixStream;
use std::thread;

use nix::sys::signal::{SigSet, SigmaskHow, Signal};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::cli::platform::LOOK;

/// True if a file is a FIFO.
pub fn is_fifo(about: &Metadata) -> bool {
    about.file_type().is_fifo()
}

/// Standard output beside the library's own, which looks for ends of lines.
///
/// # Errors
/// Errors of the system: no descriptor is left.
pub fn own_output(output: &Stdout) -> io::Result<File> {
    output.as_fd().try_clone_to_owned().map(File::from)
}

/// Signals that end the program. A program that was started to outlive the terminal (`nohup`) ignores
/// hang-ups, and goes on doing so.
pub fn signals() -> Vec<i32> {
    let hang_up = (!is_detached()).then_some(SIGHUP);
    [SIGINT, SIGTERM].into_iter().chain(hang_up).collect()
}

fn is_detached() -> bool {
    // Linux reports it there (proc(5)), bit 0 for signal 1; elsewhere it is taken not to be.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

/// The result of `work`, which no signal of `numbers` interrupts: those that come meanwhile are delivered
/// after it. The calling thread alone holds them back, so no other one may have begun.
///
/// # Errors
/// Errors of the system, or of `work`.
pub fn undisturbed<T>(numbers: &[i32], work: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    let held = numbers.iter().map(|number| Signal::try_from(*number)).collect::<Result<SigSet, _>>()?;
    let before = held.thread_swap_mask(SigmaskHow::SIG_BLOCK)?;
    let done = work();
    before.thread_set_mask()?;
    done
}

/// End that a signal's handler writes to.
pub struct Bell(UnixStream);

/// End at which a thread waits for signals.
pub struct Ear(UnixStream);

/// Both ends of a wake.
///
/// # Errors
/// Errors of the system.
pub fn bell() -> io::Result<(Bell, Ear)> {
    UnixStream::pair().map(|(writer, reader)| (Bell(writer), Ear(reader)))
}

impl Bell {
    /// Lets a signal wake the thread that waits.
    ///
    /// # Errors
    /// Errors of the system.
    pub fn rings_for(&self, signal: i32) -> io::Result<()> {
        signal_hook::low_level::pipe::register(signal, self.0.try_clone()?).map(|_| ())
    }
}

impl Ear {
    /// Waits for a signal, or a moment: what woke the thread is to be looked up.
    pub fn wait(&mut self) {
        // What is read says nothing; a wait that fails becomes a look now and then.
        if !matches!(self.0.read(&mut [0]), Ok(1)) {
            thread::sleep(LOOK);
        }
    }
}
