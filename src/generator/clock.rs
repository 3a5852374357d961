//! stub
pub struct ReceiverClock;
