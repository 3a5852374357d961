//! Identity of a satellite: system and number, written as in RINEX.
//!
//! ```
//! use gnss_twin::satellite::{Sv, SvError, System};
//!
//! let sv: Sv = "E05".parse()?;
//! assert_eq!((sv.system, sv.number, sv.to_string()), (System::Galileo, 5, "E05".to_owned()));
//! assert!(matches!("five".parse::<Sv>(), Err(SvError { .. })));
//! # Ok::<(), SvError>(())
//! ```

#[doc(inline)]
pub use ::gnss::satellite::{Sv, SvError, System};
