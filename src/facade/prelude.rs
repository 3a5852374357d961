//! Names that most programs use: `use gnss_twin::prelude::*;`.
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! let munich = Geodetic::from_degrees(48.1, 11.6, 520.0);
//! assert!((munich.to_ecef().norm() - 6.37e6).abs() < 20e3);
//! assert_eq!("G07".parse(), Ok(Sv::gps(7)));
//! ```

#[doc(no_inline)]
pub use super::orbit::{Ephemeris, Geodetic, Vector3};
#[doc(no_inline)]
pub use super::record::{Fix, Observation};
#[doc(no_inline)]
pub use super::samples::{Complex, Format, IfMetadata};
#[doc(no_inline)]
pub use super::satellite::{Sv, System};
#[doc(no_inline)]
pub use super::signal::Signal;
#[doc(no_inline)]
pub use super::time::{Epoch, Rate};

#[cfg(feature = "generator")]
#[doc(no_inline)]
pub use super::{
    effect::Effect,
    generator::{Batch, Generator},
    scene::{Scenario, Scene},
    truth,
};

#[cfg(feature = "receiver")]
#[doc(no_inline)]
pub use super::{
    receiver::{Outcome, Receiver, Record},
    settings::Settings,
};

#[cfg(feature = "analysis")]
#[doc(no_inline)]
pub use super::judge::{Limits, Status, Summary, judge};

#[cfg(all(feature = "generator", feature = "receiver"))]
#[doc(no_inline)]
pub use super::twin::{Run, Twin};
