//! Signals: the first asks the work to stop and clean up, the second ends the process at once.

use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::cli::error::CliError;

// A signal handler has no other place to write to.
static RECEIVED: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Installs the handlers.
pub fn install() -> Result<(), CliError> {
    let received = RECEIVED.get_or_init(Default::default);
    let second = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        // Order matters: the shutdown sees the flag that an earlier signal has set.
        signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&second))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&second)))
            .and_then(|_| signal_hook::flag::register_usize(signal, Arc::clone(received), signal as usize))
            .map_err(|error| CliError::passing(format!("cannot handle signals: {error}")))?;
    }
    Ok(())
}

/// The error of the signal that came, if one did.
pub fn pending() -> Option<CliError> {
    match RECEIVED.get().map_or(0, |received| received.load(Ordering::Relaxed)) {
        0 => None,
        signal => Some(CliError::signal(signal as i32)),
    }
}
