//! Samples as the receiver meets them: blocks of planar `f32` with the number of their first sample.

/// Consecutive samples; `q` is all zeros for a real recording.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    /// Number of the first sample since the start of the recording.
    pub first: u64,
    pub i: &'a [f32],
    pub q: &'a [f32],
}
