//! Logs of real receivers in the binary protocols in which they leave the device; RTCM 3 in both directions.
//!
//! [`frames`] finds frames of UBX, RTCM 3, SBF and NMEA in a stream of bytes, damaged and mixed as it may
//! be. [`table`] reads the fields of a message by its layout, [`ubx`], [`rtcm`] and [`sbf`] know messages.
//! [`log`] puts them together: messages with their tables, and what of them can be joined with a truth. All
//! of them read a stream once with the memory of one message. [`rtcm::station`] writes the stream of a
//! reference station, and [`ntrip`] has the words by which casters and clients hand it on.
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any
//! version.

#[macro_use(planted)]
extern crate gnss;

pub mod bits;
pub mod content;
pub mod contents;
pub mod frames;
pub mod log;
pub mod ntrip;
pub mod observed;
pub mod rtcm;
pub mod sbf;
pub mod table;
pub mod ubx;
