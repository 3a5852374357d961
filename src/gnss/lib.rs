//! Interface documents and standards of satellite navigation: what they define, and nothing else.
//!
//! No truth and no opinions live here. Both generator and receiver use these modules, so an
//! error in them would cancel in a closed loop: everything here is tested against something
//! that this project did not write (`tests/witness`).
//!
//! ```
//! use gnss::gps::l1ca::L1_CA;
//! use gnss::satellite::Sv;
//! use gnss::{rinex, time::Epoch};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // The code of PRN 7, and where its satellite was by what it broadcast.
//! let code = L1_CA.code(7).ok_or("no code")?;
//! assert_eq!(code.iter().map(|&chip| i32::from(chip)).sum::<i32>(), -1);
//! let at = Epoch::parse("2010-07-01T08:00:00")?;
//! let sets = rinex::embedded()?.ephemerides;
//! let near = sets.iter().find(|set| set.sv == Sv::gps(7) && at.since(set.toe).abs() < 7200.0);
//! let radius_m = near.ok_or("no ephemeris")?.state(at)?.position_m.norm();
//! assert!((26.0e6..27.2e6).contains(&radius_m));
//! # Ok(())
//! # }
//! ```
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

#[macro_use]
pub mod plant;

pub mod augmentation;
pub mod bdgim;
pub mod beidou;
pub mod bits;
pub mod broadcast;
pub mod cityjson;
pub mod crc;
pub mod discriminator;
pub mod earth;
pub mod exchange;
pub mod facts;
pub mod fec;
pub mod framed;
pub mod galileo;
pub mod geoid;
pub mod glonass;
pub mod gps;
pub mod gravity;
pub mod inflate;
pub mod ion;
pub mod ionex;
pub mod ionosphere;
pub mod klobuchar;
pub mod message;
pub mod navic;
pub mod nequick;
pub mod nmea;
pub mod packed;
pub mod place;
pub mod projection;
pub mod qzss;
pub mod record;
pub mod recording;
pub mod renamed;
pub mod rinex;
pub mod samples;
pub mod satellite;
pub mod sbas;
mod set_tables;
pub mod sigmf;
pub mod signal;
pub mod sp3;
pub mod time;
pub mod troposphere;
pub mod vienna;
pub mod vmf3;
pub mod weil;
