//! ROC curves of statistics over their thresholds.

/// Shares of clean and of attacked tests that are at least as high as each value that there is, from the
/// highest down, and the area below them.
pub fn curve(clean: &[f32], attacked: &[f32]) -> Option<(Vec<(f64, f64)>, f64)> {
    if clean.is_empty() || attacked.is_empty() {
        return None;
    }
    let mut all: Vec<(f32, bool)> = Vec::with_capacity(clean.len() + attacked.len());
    all.extend(clean.iter().map(|ratio| (*ratio, false)));
    all.extend(attacked.iter().map(|ratio| (*ratio, true)));
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut points, mut area, mut above) = (vec![(0.0, 0.0)], 0.0, [0_usize; 2]);
    let mut last = (0.0, 0.0);
    for alike in all.chunk_by(|a, b| a.0 == b.0) {
        alike.iter().for_each(|(_, is_attacked)| above[usize::from(*is_attacked)] += 1);
        let point = (above[0] as f64 / clean.len() as f64, above[1] as f64 / attacked.len() as f64);
        area += (point.0 - last.0) * 0.5 * (point.1 + last.1);
        last = point;
        points.push(point);
    }
    Some((points, area))
}
