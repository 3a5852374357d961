//! Long calls: another thread works without Python's lock, and the caller's looks after signals meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::failure::Failure;

/// Time between looks at signals: an interrupt is answered within it and a batch of samples.
const LOOK: Duration = Duration::from_millis(50);

/// Flag that is set once the caller is interrupted.
pub struct Halt(AtomicBool);

impl Halt {
    /// True if the work is to end.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// An error where the work is to end.
    pub fn check(&self) -> Result<(), Failure> {
        if self.is_set() { Err(Failure::halted()) } else { Ok(()) }
    }
}

/// Does `work` without Python's lock. A signal whose handler raises ends it, and is what is raised then.
pub fn long<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send,
    F: FnOnce(&Halt) -> Result<T, Failure> + Send,
{
    let halt = &Halt(AtomicBool::new(false));
    py.detach(|| {
        thread::scope(|scope| {
            let (held, ended) = mpsc::channel::<()>();
            let worker = thread::Builder::new().spawn_scoped(scope, move || {
                let _held = held;
                work(halt)
            })?;
            let mut raised = None;
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(LOOK) {
                if raised.is_none() {
                    raised = Python::attach(|py| py.check_signals()).err();
                    halt.0.store(raised.is_some(), Ordering::Relaxed);
                }
            }
            let done = worker.join().unwrap_or_else(|_| Err(Failure::bug("a thread panicked")));
            match raised {
                Some(raised) => Err(raised),
                None => Ok(done?),
            }
        })
    })
}
