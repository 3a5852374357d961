//! stub
pub struct Broadcast;
