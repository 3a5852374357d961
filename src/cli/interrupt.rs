//! Signals: the first takes outputs in the making away and ends the process, the second ends it at once.
//!
//! Where work has no end of its own, the first one may end it instead ([`ends_work`]), as if its input had
//! ended.
//!
//! A thread of its own waits for them, so that they are noticed whatever the others are at: computing,
//! reading a pipe that stays silent, or drawing.

use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use crate::cli::error::CliError;
use crate::cli::platform::{self, Ear, LOOK};
use analysis::show::staged;

/// Stack size of that thread.
const STACK_BYTES: usize = 1 << 18;

// A signal handler has no other place to write to.
static ENDS_WORK: AtomicBool = AtomicBool::new(false);
static RECEIVED: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Installs the handlers, and the thread that waits for them.
pub fn install() -> Result<(), CliError> {
    handle().map_err(|error| CliError::passing(format!("cannot handle signals: {error}")))
}

fn handle() -> std::io::Result<()> {
    let flag = RECEIVED.get_or_init(Default::default);
    let second = Arc::new(AtomicBool::new(false));
    let (bell, ear) = platform::bell()?;
    let signals = platform::signals();
    // The first of the four takes a signal over: one that came before the last would be lost, or ring no
    // bell.
    platform::undisturbed(&signals, || {
        for &signal in &signals {
            // Order matters: the shutdown sees the flag that an earlier signal has set, and who is woken
            // finds its number.
            signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&second))?;
            signal_hook::flag::register(signal, Arc::clone(&second))?;
            signal_hook::flag::register_usize(signal, Arc::clone(flag), signal as usize)?;
            bell.rings_for(signal)?;
        }
        Ok(())
    })?;
    // A signal that was held back is noticed here: a short work would be done before the thread below wakes.
    if let Some(signal) = received() {
        signal_hook::low_level::exit(128 + signal);
    }
    thread::Builder::new().name("signals".to_owned()).stack_size(STACK_BYTES).spawn(move || wait(ear))?;
    Ok(())
}

/// The signal that came, if one did.
fn received() -> Option<i32> {
    match RECEIVED.get().map_or(0, |received| received.load(Ordering::Relaxed)) {
        0 => None,
        signal => Some(signal as i32),
    }
}

fn wait(mut ear: Ear) {
    let signal = loop {
        ear.wait();
        if let Some(signal) = received() {
            break signal;
        }
    };
    if ENDS_WORK.load(Ordering::Relaxed) {
        return;
    }
    staged::abandon();
    signal_hook::low_level::exit(128 + signal);
}

/// Leaves the first signal from here on to the worker, which looks for it with [`ending`].
pub fn ends_work() {
    ENDS_WORK.store(true, Ordering::Relaxed);
}

/// The signal that is to end the work, if one came since [`ends_work`].
pub fn ending() -> Option<i32> {
    received().filter(|_| ENDS_WORK.load(Ordering::Relaxed))
}

/// Does nothing unless a signal has come: an error may then be its consequence, so that the end is left to
/// that thread.
pub fn give_way() {
    while received().is_some() && ending().is_none() {
        thread::sleep(LOOK);
    }
}
