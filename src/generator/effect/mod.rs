//! Effects of nature and hardware on the rays of a satellite, one file for each cause.

pub mod antenna;
pub mod bdgim;
pub mod city;
pub mod ionosphere;
pub mod link;
pub mod mapping;
pub mod multipath;
pub mod nequick;
pub mod obstruction;
pub mod tec;
pub mod transmit;
pub mod troposphere;
pub mod wind_up;
