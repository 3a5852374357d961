//! QZSS: Japan's satellites over the western Pacific, whose signals and messages are those of GPS.
//!
//! Source: IS-QZSS-PNT-005. Codes are those of PRN 193 to 202, the satellites J01 to J10. What differs
//! from GPS is in the tables here: numbers, health, ephemerides of an hour, semi-major axis of the elements,
//! who sends what.

pub mod civil;
pub mod l1c;
pub mod l1ca;
pub mod l2c;
pub mod l5;
pub mod lnav;
mod own;
pub mod satellites;
