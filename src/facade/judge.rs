//! Judge of a run: errors against theory, a verdict, tables and pictures.
//!
//! A run is a directory with `truth` and `rx`, as [`crate::twin::Twin::run_in`] and the program write it.
//! [`assess`] reads it and returns the [`Summary`]. [`judge`] also writes tables, pictures and a report, and
//! [`judge_against`] takes limits of one's own.
#![cfg_attr(
    all(feature = "generator", feature = "receiver"),
    doc = r#"
```
use gnss_twin::judge::{Details, JudgeError, Status, Summary, Verdict, assess};
use gnss_twin::prelude::*;

let scenario = Scenario::builder("judged")
    .start(Epoch::parse("2010-07-01T08:06:00")?)
    .duration_s(2.0)
    .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
    .noise()
    .build()?;
let directory = tempfile::tempdir()?;
Twin::new(&scenario)?.run_in(directory.path())?;
let summary: Summary = assess(directory.path(), None)?;
assert_eq!((summary.scene.as_str(), summary.satellites.false_acquired), ("judged", 0));
let Details { verdict, .. } = &summary.details;
let _: &Verdict = verdict;
assert_eq!(verdict.count(Status::Fail), 0, "{}", verdict.in_words());
let missing: Result<Summary, JudgeError> = assess("no such run".as_ref(), None);
assert!(missing.unwrap_err().to_string().contains("no such run"));
# Ok::<(), Box<dyn std::error::Error>>(())
```
"#
)]
//!
//! [`Limits`] are paths into the summary with bounds; each gives a [`Judgement`] with a [`Status`] against
//! its [`Bound`]:
//!
//! ```
//! use gnss_twin::judge::{Bound, Judgement, Limits, Status};
//!
//! let limits = Limits::parse("\"satellites.used\" = { min = 8 }\n", "limits.toml")?;
//! let summary = serde_json::json!({ "satellites": { "used": 5 } });
//! let rows: Vec<Judgement> = limits.judge(&summary);
//! assert!(matches!(rows[0].bound, Bound::Min(least) if least == 8.0));
//! assert_eq!(rows[0].status, Status::Fail);
//! # Ok::<(), gnss_twin::judge::LimitsError>(())
//! ```
//!
//! A misspelt path is a [`LimitsError`] with the nearest right one:
//!
//! ```
//! use gnss_twin::judge::{Limits, LimitsError};
//!
//! let error: LimitsError = Limits::parse("\"satellite.used\" = { min = 8 }\n", "limits.toml").unwrap_err();
//! assert!(error.to_string().contains("nearest path is satellites.used"), "{error}");
//! ```
//!
//! The figures of a [`Summary`] are in [`Satellites`], [`Position`], [`Clock`], [`Observables`],
//! [`Tracking`], [`Navigation`] and for each signal [`BySignal`]. The rows of a [`Verdict`] belong to
//! [`Group`]s.

#[doc(inline)]
pub use ::analysis::judge::judgement::{Bound, Group, Judgement, Status};
#[doc(inline)]
pub use ::analysis::judge::limits::{Limits, LimitsError};
#[doc(inline)]
pub use ::analysis::judge::summary::{
    BySignal, Clock, Details, Navigation, Observables, Position, Satellites, Summary, Tracking,
};
#[doc(inline)]
pub use ::analysis::judge::verdict::Verdict;
#[doc(inline)]
pub use ::analysis::{JudgeError, assess, judge_against};

/// Judges the run in a directory: writes `summary.json`, tables, pictures and the report there and returns
/// the summary.
///
/// # Errors
/// [`JudgeError`] with the file that is missing, is not as expected or cannot be written.
pub fn judge(run: &std::path::Path) -> Result<Summary, JudgeError> {
    ::analysis::judge(run)
}
