//! What nature and hardware do to the rays of a satellite, one file a cause.

pub mod ionosphere;
pub mod link;
pub mod troposphere;
