//! Samples for the tests of the correlators.

/// Whole numbers of 8 bits, even over ±40 about `mean`.
pub fn noise(count: usize, seed: u64, mean: f32) -> Vec<f32> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f32 / 16_777_216.0 * 80.0 - 40.0 + mean).round()
        })
        .collect()
}
