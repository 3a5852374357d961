//! Instants, sample rates and the time scales of satellite systems.
//!
//! An [`Epoch`] is an instant as whole GPS seconds and a fraction, because one `f64` of GPS seconds resolves
//! only 71 m of range:
//!
//! ```
//! use gnss_twin::time::Epoch;
//!
//! let start = Epoch::parse("2010-07-01T08:06:00")?;
//! let later = start.plus_s(1e-9);
//! assert!((later.since(start) - 1e-9).abs() < 1e-15);
//! assert_eq!(start.week(), 1590);
//! # Ok::<(), gnss_twin::time::TimeError>(())
//! ```
//!
//! Text that ends in `Z` is UTC:
//!
//! ```
//! use gnss_twin::time::{Epoch, TimeError};
//!
//! let gps = Epoch::parse("2010-07-01T08:06:15")?;
//! assert_eq!(Epoch::parse("2010-07-01T08:06:00Z")?, gps);
//! assert!(matches!(Epoch::parse("noon"), Err(TimeError { .. })));
//! # Ok::<(), TimeError>(())
//! ```
//!
//! A [`Rate`] is an exact fraction, and a [`SampleClock`] numbers samples from an instant on:
//!
//! ```
//! use gnss_twin::time::{Epoch, Rate, SampleClock};
//!
//! let rate = Rate::from_hz(2.6e6).ok_or("no rate")?;
//! let clock = SampleClock { start: Epoch::parse("2010-07-01T08:06:00")?, rate };
//! // A day of samples, without an error that grows.
//! let day = 86_400 * 2_600_000;
//! assert_eq!(clock.epoch(day).since(clock.start), 86_400.0);
//! assert_eq!(rate.first_sample_at(1, 1000), 2600);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`TimeScale`] is the clock by which a system's satellites date their messages: [`GPST`], [`GST`],
//! [`BDT`], [`GLONASST`]. [`UTC`] is here too.
//!
//! ```
//! use gnss_twin::time::{BDT, Epoch, GLONASST, GPST, GST, TimeScale, UTC};
//!
//! let at = Epoch::parse("2020-11-29T12:00:00")?;
//! assert_eq!([&GPST, &GST, &BDT, &UTC].map(|scale| scale.behind_s(at)), [0, 0, 14, 18]);
//! // GLONASS time is UTC and three hours.
//! assert_eq!(GLONASST.behind_s(at), 18 - 3 * 3600);
//! static OWN: TimeScale = TimeScale { name: "own", behind_gpst_s: 3, has_leap_seconds: false };
//! assert_eq!(OWN.instant(OWN.label(at)), at);
//! # Ok::<(), gnss_twin::time::TimeError>(())
//! ```

#[doc(inline)]
pub use ::gnss::time::{BDT, Epoch, GLONASST, GPST, GST, Rate, SampleClock, TimeError, TimeScale, UTC};
