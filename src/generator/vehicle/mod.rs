//! stub
pub struct Trajectory;
