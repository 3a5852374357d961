//! Rows of truth and receiver: one type for each table.
//!
//! A row counts samples, and its fields are named with their units. [`Fix`] and [`Observation`] have their
//! time and position as values:
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! let row = "sample,sv,signal,sent_s,sent_fraction_s,pseudorange_m,carrier_cycles,doppler_hz,cn0_dbhz,\
//!            locked_s\n\
//!            2600000,G07,GPS L1 C/A,962006399,0.93,20985472.1,1.5,-1200.0,45.0,0.9\n";
//! let mut rows = csv::Reader::from_reader(row.as_bytes());
//! let observation: Observation = rows.deserialize().next().ok_or("no row")??;
//! assert_eq!((observation.sv, observation.signal.name), (Sv::gps(7), "GPS L1 C/A"));
//! assert_eq!(observation.sent(), Epoch::new(962_006_399, 0.93));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The receiver's rows are [`AcquisitionRow`], [`TrackingRow`], [`EventRow`] with its [`Event`],
//! [`NavigationRow`], [`ClockRow`], [`SightRow`], [`IonosphereRow`] and [`LineRow`]. The truth's rows are
//! [`TrajectoryRow`], [`SkyRow`], [`RayRow`], [`InterferenceRow`] and [`PassRow`]. Tables that the program
//! wrote are read back as these types:
//!
//! ```
//! use gnss_twin::record::{Event, EventRow};
//!
//! let table = "sample,sv,signal,event\n5200000,G07,GPS L1 C/A,loss_of_lock\n";
//! let mut reader = csv::Reader::from_reader(table.as_bytes());
//! let rows: Result<Vec<EventRow>, csv::Error> = reader.deserialize().collect();
//! assert_eq!(rows?[0].event, Event::LossOfLock);
//! # Ok::<(), csv::Error>(())
//! ```

#[doc(inline)]
pub use ::gnss::record::{
    AcquisitionRow, ClockRow, Event, EventRow, Fix, InterferenceRow, IonosphereRow, LineRow, NavigationRow,
    Observation, PassRow, RayRow, SightRow, SkyRow, TrackingRow, TrajectoryRow,
};
