//! Correlation peaks as tables: the correlation of two waveforms behind means over samples, or behind a
//! front end.
//!
//! Values and slopes are tabulated over offsets and interpolated by cubics. A mean over a sample's interval
//! is a box; polygons behind two boxes have closed forms. Offsets and frequencies count in chips and chip
//! rates. Limits: peaks behind a front end are even.

use std::f64::consts::TAU;

use super::Shape;

/// Intervals of the spectrum's integral in one chip rate.
const INTERVALS: f64 = 96.0;
/// Width of a box that stands for none, in chips.
const LEAST_CHIPS: f64 = 1e-4;

/// Correlation peak, tabulated.
#[derive(Clone, Debug)]
pub struct PeakTable {
    steps_per_chip: f64,
    /// Offset of the first entry in chips; `None` of an even peak, whose entries begin at zero.
    first_chips: Option<f64>,
    /// Value and slope, the slope times the step, at each step of the offset.
    entries: Vec<(f64, f64)>,
}

impl PeakTable {
    /// Table of `at`, which gives value and slope at offsets up to `largest_chips`.
    fn new(
        steps_per_chip: f64,
        (first_chips, largest_chips): (Option<f64>, f64),
        at: impl Fn(f64) -> (f64, f64),
    ) -> Self {
        let begin_chips = first_chips.unwrap_or(0.0);
        let count = ((largest_chips - begin_chips) * steps_per_chip).ceil() as u64;
        let entry = |index: u64| {
            let (value, slope) = at(begin_chips + index as f64 / steps_per_chip);
            (value, slope / steps_per_chip)
        };
        Self { steps_per_chip, first_chips, entries: (0..=count + 1).map(entry).collect() }
    }

    /// Peak of a spectrum of unit area behind a front end of `band` chip rates (two-sided).
    pub fn behind(density: impl Fn(f64) -> f64, band: f64, (steps_per_chip, largest_chips): (f64, f64)) -> Self {
        let intervals = 2 * (0.25 * band * INTERVALS).ceil() as u64;
        let step = 0.5 * band / intervals as f64;
        let spectrum: Vec<(f64, f64)> = (0..=intervals)
            .map(|k| {
                let f = k as f64 * step;
                let simpson = if k == 0 || k == intervals { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
                (TAU * f, 2.0 * step / 3.0 * simpson * density(f))
            })
            .collect();
        Self::new(steps_per_chip, (None, largest_chips), |chips| {
            spectrum.iter().fold((0.0, 0.0), |(value, slope), &(w, weight)| {
                let (sin, cos) = libm::sincos(w * chips);
                (value + weight * cos, slope - weight * w * sin)
            })
        })
    }

    /// Peak of a shape whose waveforms are means over boxes of these widths.
    pub fn boxed(shape: &Shape, widths_chips: [f64; 2], steps_per_chip: f64) -> Self {
        let corners = (shape.chip_s() / shape.step_s()).round() as i32;
        // Beyond a chip, as far as the boxes reach.
        let all = 3 * corners;
        let lags: Vec<f64> = (-all..=all).map(|k| shape.correlation(f64::from(k) * shape.step_s())).collect();
        Self::of_lags(&lags, shape.step_s() / shape.chip_s(), widths_chips, steps_per_chip)
    }

    /// Peak of waveforms that are means over boxes of these widths, from the correlation of the waveforms
    /// themselves: a polygon with corners at whole steps, an odd number of them about zero. The table ends
    /// where what lies beyond the corners would be needed.
    pub fn of_lags(lags: &[f64], step_chips: f64, widths_chips: [f64; 2], steps_per_chip: f64) -> Self {
        let [a, b] = widths_chips.map(|width| 0.5 * width.max(LEAST_CHIPS));
        let (area, half) = (4.0 * a * b, (lags.len() / 2) as f64);
        // The polygon is a sum of |x|/2 at its corners; two boxes make that a second difference of |x|³/12.
        let twice =
            |of: &dyn Fn(f64) -> f64, x: f64| (of(x + a + b) - of(x + a - b) - of(x - a + b) + of(x - a - b)) / area;
        let cube = |x: f64| x.abs() * x * x / 12.0;
        let square = |x: f64| x * x.abs() / 4.0;
        let lag = |k: usize| lags.get(k).copied().unwrap_or(0.0);
        let largest_chips = half * step_chips - a - b;
        Self::new(steps_per_chip, (Some(-largest_chips), largest_chips), |chips| {
            let at = chips / step_chips + half;
            let left = at.max(0.0) as usize;
            let rise = (lag(left + 1) - lag(left)) / step_chips;
            let polygon = (lag(left) + (at - left as f64) * step_chips * rise, rise);
            // Corners within the boxes' reach bend it.
            let reach = (a + b) / step_chips;
            let near = (at - reach).ceil().max(1.0) as usize..=(at + reach).max(0.0) as usize;
            near.fold(polygon, |(value, slope), k| {
                let bend = (lag(k + 1) - 2.0 * lag(k) + lag(k - 1)) / step_chips;
                let x = (at - k as f64) * step_chips;
                // The polygon's own slope at a corner is that to its right.
                let side = if k <= left { 0.5 } else { -0.5 };
                (value + bend * (twice(&cube, x) - side * x), slope + bend * (twice(&square, x) - side))
            })
        })
    }

    /// Value at an offset in chips; zero beyond the table.
    #[inline]
    pub fn value(&self, chips: f64) -> f64 {
        let x = self.first_chips.map_or(chips.abs(), |first_chips| chips - first_chips) * self.steps_per_chip;
        let index = x as usize;
        let u = x - index as f64;
        let Some(&[(a, da), (b, db)]) = self.entries.get(index..).and_then(|rest| rest.first_chunk()) else {
            return 0.0;
        };
        if x < 0.0 {
            return 0.0;
        }
        // Cubic through both values and slopes.
        let c = 3.0 * (b - a) - 2.0 * da - db;
        a + u * (da + u * (c + u * (da + db - 2.0 * (b - a))))
    }

    /// Largest offset of the table, in chips.
    pub fn reach_chips(&self) -> f64 {
        self.first_chips.map_or(self.entries.len() as f64 / self.steps_per_chip, f64::abs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gps::l1ca::L1_CA;
    use crate::signal::synthetic::LONG_BOC;

    #[test]
    fn a_peak_behind_two_boxes_is_its_polygon_averaged_twice() {
        for component in [&L1_CA.components[0], &LONG_BOC.components[0]] {
            let (shape, chip_s) = (component.shape(), 1.0 / component.chip_rate_hz);
            for widths in [[0.39, 0.39], [0.1, 0.02]] {
                let peak = PeakTable::boxed(&shape, widths, 1024.0);
                for chips in [-1.3, -0.2, 0.0, 0.013, 0.2, 0.5, 0.97, 1.1] {
                    const NODES: i32 = 400;
                    let middles =
                        |width: f64| (0..NODES).map(move |k| ((f64::from(k) + 0.5) / f64::from(NODES) - 0.5) * width);
                    let sum: f64 = middles(widths[0])
                        .flat_map(|a| middles(widths[1]).map(move |b| a + b))
                        .map(|off| shape.correlation((chips + off) * chip_s))
                        .sum();
                    let expected = sum / f64::from(NODES * NODES);
                    // The sum's own error at corners is a share 1/400² of a box.
                    assert!((peak.value(chips) - expected).abs() < 5e-6, "{widths:?} {chips}");
                }
            }
        }
    }
}
