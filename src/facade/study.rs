//! Studies: sweeps of a scene's or a receiver's keys, with theory beside what was measured.
//!
//! A [`Study`] is a text like those in `studies/`. It runs on samples or, thousands of times faster, on
//! modelled correlations: its [`Level`]:
//!
//! ```
//! use gnss_twin::study::{Level, Study};
//!
//! let text = r#"
//!     name = "jitter"
//!     level = "correlator"
//!     repetitions = 8
//!     keep = ["phase_sigma_deg"]
//!
//!     [[axis]]
//!     key = "receiver.tracking.pll_bandwidth_hz"
//!     values = [5, 10, 18]
//! "#;
//! let study = Study::parse(text, "jitter.toml")?;
//! assert_eq!((study.level, study.axes.len()), (Level::Correlator, 1));
//! assert!(Study::parse(&text.replace("repetitions", "repetition"), "jitter.toml").is_err());
//! # Ok::<(), gnss_twin::scene::ScenarioError>(())
//! ```
//!
//! [`sweep`] plans a study in a directory, runs what is missing there and returns the [`Results`]. Each
//! [`Cell`] has an [`Estimate`] of each figure that the study keeps:
//!
//! ```
//! use gnss_twin::study::{Cell, Estimate, Results, StudyError, sweep};
//!
//! let there = tempfile::tempdir()?;
//! let file = there.path().join("jitter.toml");
//! let text = r#"
//!     name = "jitter"
//!     level = "correlator"
//!     repetitions = 4
//!     keep = ["phase_sigma_deg"]
//!     measure = { settle_s = 1, duration_s = 5 }
//!
//!     [[axis]]
//!     key = "signal.cn0_dbhz"
//!     values = [35, 50]
//! "#;
//! std::fs::write(&file, text)?;
//! let results: Results = sweep(&file, &there.path().join("plan"))?;
//! let figure = results.figure("phase_sigma_deg").ok_or("no figure")?;
//! let mean = |cell: &Cell| cell.estimates[figure].map_or(f64::NAN, |estimate: Estimate| estimate.mean);
//! let [weak, strong] = [&results.cells[0], &results.cells[1]].map(mean);
//! assert!(weak > 3.0 * strong && strong > 0.0, "{weak} and {strong} degrees");
//! let missing: Result<Results, StudyError> = sweep(&there.path().join("none.toml"), there.path());
//! assert!(missing.is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Plan`] holds what other machines need: [`Plan::create`] and [`Plan::load`] with a [`Cut`], then
//! [`run`] with the numbers of shards, [`status`] for what is missing, [`merge`] at the end.
//!
//! ```
//! use gnss_twin::study::{Cut, Plan, Ran, Results, Status, merge, run, status};
//!
//! let there = tempfile::tempdir()?;
//! let file = there.path().join("slips.toml");
//! let text = "name = \"slips\"\nlevel = \"correlator\"\nrepetitions = 4\nkeep = [\"slips_per_hour\"]\n\
//!             measure = { settle_s = 1, duration_s = 2 }\n\
//!             [[axis]]\nkey = \"signal.cn0_dbhz\"\nvalues = [45]\n";
//! std::fs::write(&file, text)?;
//! let plan = Plan::create(&file, &there.path().join("plan"), Cut::Shards(2), "own program")?;
//! let first: Ran = run(&plan, &[0], &|_| ())?;
//! let left: Status = status(&plan)?;
//! assert_eq!((first.cases, left.missing.as_slice()), (2, [1].as_slice()));
//! run(&plan, &left.missing, &|_| ())?;
//! assert_eq!(Results::new(&plan, &merge(&plan)?)?.cells.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::Path;

#[doc(inline)]
pub use ::study::sweep::StudyError;
#[doc(inline)]
pub use ::study::sweep::engine::{Ran, Status, run, status};
#[doc(inline)]
pub use ::study::sweep::estimate::Estimate;
#[doc(inline)]
pub use ::study::sweep::plan::{Cut, Plan};
#[doc(inline)]
pub use ::study::sweep::result::{Cell, Results, merge};
#[doc(inline)]
pub use ::study::sweep::spec::{Level, Study};

/// Plans the study of a file in a directory, runs on all cores what is missing there, and condenses the
/// repetitions. A directory that holds the finished study is read and not run again.
///
/// # Errors
/// A study that is refused, a directory that holds something else, a case that fails.
pub fn sweep(study: &Path, directory: &Path) -> Result<Results, StudyError> {
    let plan = Plan::create(study, directory, Cut::Default, concat!("library ", env!("CARGO_PKG_VERSION")))?;
    run(&plan, &status(&plan)?.missing, &|_| ())?;
    Results::new(&plan, &merge(&plan)?)
}
