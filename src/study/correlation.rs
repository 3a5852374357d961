//! The shape of a correlation peak: the triangle of unlimited bandwidth, or that of a rectangular front end.
//!
//! Behind a filter the peak is R(τ) = ∫S(f)·cos(2πfτ) df over the band with S = sinc²(f), and the noise of
//! taps correlates by R(τ)/R(0); the power outside, 1−R(0), is lost. Tabulated with its slope and
//! interpolated by cubics.

use crate::receiver::track::loops::CodeShape;

/// R and R' over positive offsets in chips.
#[derive(Clone, Debug, PartialEq)]
pub enum Correlation {
    /// 1−|τ|.
    Triangle,
    /// Behind a front end of `band` chip rates: values and slopes (times the step) at multiples of the table's step.
    BandLimited { band: f64, table: Vec<(f64, f64)> },
}

/// Steps a chip: a cubic then errs by less than 1e-7 for bands to 20 chip rates.
const STEPS_PER_CHIP: f64 = 128.0;
/// Chips beyond which nothing is tabulated: no loop holds there.
const LARGEST_CHIPS: f64 = 3.0;
/// Intervals of the spectrum's integral in one chip rate.
const INTERVALS: f64 = 96.0;

impl Correlation {
    /// Behind a front end of `band` chip rates (two-sided), rectangular chips.
    pub fn band_limited(band: f64) -> Self {
        let intervals = 2 * (0.25 * band * INTERVALS).ceil() as u64;
        let step = 0.5 * band / intervals as f64;
        let spectrum: Vec<(f64, f64)> = (0..=intervals)
            .map(|k| {
                let f = k as f64 * step;
                let x = std::f64::consts::PI * f;
                let root = if k == 0 { 1.0 } else { libm::sin(x) / x };
                let simpson = if k == 0 || k == intervals { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
                (std::f64::consts::TAU * f, 2.0 * step / 3.0 * simpson * root * root)
            })
            .collect();
        let at = |index: u64| {
            let chips = index as f64 / STEPS_PER_CHIP;
            spectrum.iter().fold((0.0, 0.0), |(value, slope), &(w, weight)| {
                let (sin, cos) = libm::sincos(w * chips);
                (value + weight * cos, slope - weight * w * sin / STEPS_PER_CHIP)
            })
        };
        Self::BandLimited { band, table: (0..=(LARGEST_CHIPS * STEPS_PER_CHIP) as u64).map(at).collect() }
    }

    /// R at an offset in chips.
    #[inline]
    pub fn value(&self, chips: f64) -> f64 {
        match self {
            Self::Triangle => (1.0 - chips.abs()).max(0.0),
            Self::BandLimited { table, .. } => {
                let x = chips.abs() * STEPS_PER_CHIP;
                let (index, u) = (x.floor(), x - x.floor());
                let Some(&[(a, da), (b, db)]) = table.get(index as usize..).and_then(|rest| rest.first_chunk()) else {
                    return 0.0;
                };
                // Cubic through both values and slopes.
                let c = 3.0 * (b - a) - 2.0 * da - db;
                a + u * (da + u * (c + u * (da + db - 2.0 * (b - a))))
            }
        }
    }

    /// What a receiver that knows the peak's shape takes for a spacing of `d` chips.
    pub fn code_shape(&self, d: f64) -> CodeShape {
        match self {
            Self::Triangle => CodeShape::triangle(d),
            Self::BandLimited { .. } => {
                let (peak, half, h) = (self.value(0.0), 0.5 * d, 0.5 / STEPS_PER_CHIP);
                let slope = (self.value(half - h) - self.value(half + h)) / (2.0 * h);
                CodeShape { value: self.value(half) / peak, slope: slope / peak, common: self.value(d) / peak }
            }
        }
    }
}
