//! Broadcast orbits, navigation files and positions on the Earth.
//!
//! A navigation file in RINEX becomes [`Ephemeris`] values. A day of GPS lies within the library:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::orbit::{State, embedded_navigation};
//!
//! let at = Epoch::parse("2010-07-01T08:00:00")?;
//! let day = embedded_navigation()?;
//! let near = |set: &&Ephemeris| set.sv == Sv::gps(7) && at.since(set.toe).abs() < 7200.0;
//! let set = day.ephemerides.iter().find(near).ok_or("no ephemeris")?;
//! let State { position_m, velocity_mps } = set.state(at)?;
//! assert!((26.0e6..27.2e6).contains(&position_m.norm()));
//! assert!((2.5e3..4.5e3).contains(&velocity_mps.norm()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The clock of a satellite is a [`ClockState`]; without a near reference time it is an [`OrbitError`] or far
//! from the truth:
//!
//! ```
//! use gnss_twin::orbit::{ClockState, embedded_navigation};
//!
//! let set = &embedded_navigation()?.ephemerides[0];
//! let ClockState { offset_s, drift } = set.clock(set.toc)?;
//! assert!(offset_s.abs() < 1e-3 && drift.abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Files of one's own are read from their bytes, compressed or not, and refused by name:
//!
//! ```
//! use gnss_twin::orbit::{Navigation, NavigationError, read_navigation};
//!
//! let read: Result<Navigation, NavigationError> = read_navigation(b"no navigation", "day.rnx");
//! assert!(read.unwrap_err().to_string().contains("day.rnx"));
//! ```
//!
//! Positions are ECEF in metres, as [`Vector3`] of nalgebra; [`Geodetic`] has latitude, longitude and height.
//! [`look`] gives the direction to a satellite as a [`Look`]:
//!
//! ```
//! use gnss_twin::orbit::{Geodetic, Look, SPEED_OF_LIGHT_MPS, Vector3, look};
//!
//! let here = Geodetic::from_degrees(0.0, 0.0, 0.0);
//! let satellite_m = Vector3::new(26.56e6, 0.0, 0.0);
//! let Look { elevation_rad, .. } = look(here, &here.to_ecef(), &satellite_m);
//! assert!((elevation_rad.to_degrees() - 90.0).abs() < 1e-6);
//! let travel_s = (satellite_m - here.to_ecef()).norm() / SPEED_OF_LIGHT_MPS;
//! assert!((travel_s - 0.0673).abs() < 1e-4);
//! ```

#[doc(inline)]
pub use ::gnss::broadcast::{ClockState, Ephemeris, OrbitError, State};
#[doc(inline)]
pub use ::gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS, look};
#[doc(inline)]
pub use ::gnss::rinex::{Navigation, NavigationError, embedded as embedded_navigation, read as read_navigation};
#[doc(no_inline)]
pub use nalgebra::Vector3;
