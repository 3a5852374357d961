//! Augmentation systems (WAAS, EGNOS, MSAS, GAGAN and others): signals of geostationary satellites on L1.

pub mod l1;
pub mod message;
