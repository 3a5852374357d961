//! Planted faults: they let tests prove that each of them is noticed.
//!
//! Present only with the feature `planted`, which the package's own tests turn on; without it `planted!` is
//! its first value and leaves nothing in the program. At most one fault is active in a process: the one named
//! by `VARIABLE`. The list of faults and of what must notice each is in `tests/planted`. Limits: planted
//! where a value is made, never in a sample loop.

/// The value of an expression; while the fault of that name is active, a wrong one.
#[cfg(not(feature = "planted"))]
#[doc(hidden)]
#[macro_export]
macro_rules! planted {
    ($name:literal, $right:expr, $wrong:expr) => {
        $right
    };
}

#[cfg(feature = "planted")]
#[doc(hidden)]
#[macro_export]
macro_rules! planted {
    ($name:literal, $right:expr, $wrong:expr) => {
        if $crate::plant::active($name) { $wrong } else { $right }
    };
}

/// Environment variable with the name of the one fault that is active.
#[cfg(feature = "planted")]
pub const VARIABLE: &str = "GNSS_TWIN_PLANTED";

/// True if the fault of this name is active. The environment is read once per process.
#[cfg(feature = "planted")]
pub fn active(name: &str) -> bool {
    use std::sync::OnceLock;
    static ACTIVE: OnceLock<Option<String>> = OnceLock::new();
    ACTIVE.get_or_init(|| std::env::var(VARIABLE).ok()).as_deref() == Some(name)
}
