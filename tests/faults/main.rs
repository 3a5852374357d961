//! Damaged input, and a machine that fails: each case ends in the right result or in a refusal that says why.
//!
//! `cargo test --test faults` takes a sample of the cases; with `GNSS_TWIN_LONG=1` it takes them all, and
//! writes the table of `reports/robustness.md` where `GNSS_TWIN_WRITE_ROBUSTNESS` names a file. Damage is
//! drawn from a seeded generator: a case that fails is the same in the next run.

mod bounds;
mod damage;
mod determinism;
mod files;
mod fuzz;
mod legal;
#[path = "../common/long.rs"]
mod long;
mod machine;
mod memory;
mod mounts;
mod navigation;
mod pipes;
mod program;
mod scenario;
mod scenes;
mod signals;
mod sizes;
mod streams;
mod sweep;
mod tally;
