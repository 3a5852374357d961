//! The shape of a correlation peak: that of the code's pulses, or that behind a rectangular front end.
//!
//! Behind a filter the peak is R(τ) = ∫S(f)·cos(2πfτ) df over the band, S the code's spectrum, and the noise
//! of taps correlates by R(τ)/R(0); the power outside, 1−R(0), is lost. Tabulated with its slope and
//! interpolated by cubics. Offsets and frequencies count in chips and chip rates.

use analysis::expect::theory::dll::{BandIntegrals, Discriminator, Taps, raw_on_chips};
use analysis::waveform::Waveform;
use gnss::signal::{Component, Layers, PeakTable, sinc_squared};
use receiver::lead::shapes;
use receiver::track::TrackingSettings;
use receiver::track::loops::CodeShape;

/// R and R' over positive offsets in chips.
#[derive(Clone, Debug)]
pub enum Correlation {
    /// 1−|τ|, of rectangular chips without a front end.
    Triangle,
    /// Autocorrelation of other pulses, without a front end.
    Pulses(Waveform),
    /// Cross-correlation of a component with a replica that has one of its layers, and autocorrelation of
    /// that replica, without a front end.
    Replica {
        /// Cross-correlation of the component with the replica.
        found: Waveform,
        /// The replica with itself.
        own: Waveform,
    },
    /// Correlation behind a front end of `band` chip rates.
    BandLimited {
        /// Bandwidth of the front end, chip rates.
        band: f64,
        /// Values of the peak.
        table: PeakTable,
        /// Waveform of the code; `None` of an ideal one.
        code: Option<Waveform>,
    },
}

/// Steps a chip: a cubic then errs by less than 1e-7 for bands to 20 chip rates.
const STEPS_PER_CHIP: f64 = 128.0;
/// Chips beyond which nothing is tabulated: no loop locks there.
const LARGEST_CHIPS: f64 = 3.0;

impl Correlation {
    /// Correlation of a component with the replica that this receiver makes of it, without a front end.
    pub fn of_component(component: &Component, made: Layers) -> Self {
        let rate_hz = component.chip_rate_hz;
        match shapes(component, made) {
            Some([found, own]) if component.layers.len() > 1 && made == Layers::Strongest => {
                Self::Replica { found: Waveform::of_shape(found, rate_hz), own: Waveform::of_shape(own, rate_hz) }
            }
            _ => Self::of(Waveform::of_shape(component.shape(), rate_hz), None),
        }
    }

    /// Correlation of a signal behind a front end of `band_hz` (two-sided, in hertz), if there is one.
    pub fn of(code: Waveform, band_hz: Option<f64>) -> Self {
        let (step_s, chip_s) = code.scales_s();
        match band_hz {
            Some(band_hz) => Self::behind(Some(&code), band_hz / code.chip_rate_hz()),
            None if step_s == chip_s => Self::Triangle,
            None => Self::Pulses(code),
        }
    }

    /// Correlation of rectangular chips behind a front end of `band` chip rates (two-sided).
    pub fn band_limited(band: f64) -> Self {
        Self::behind(None, band)
    }

    fn behind(code: Option<&Waveform>, band: f64) -> Self {
        let table = PeakTable::behind(|f| density(code, f), band, (STEPS_PER_CHIP, LARGEST_CHIPS));
        Self::BandLimited { band, table, code: code.cloned() }
    }

    /// R at an offset in chips.
    #[inline]
    pub fn value(&self, chips: f64) -> f64 {
        match self {
            Self::Triangle => (1.0 - chips.abs()).max(0.0),
            Self::Pulses(code) | Self::Replica { found: code, .. } => code.correlation(chips / code.chip_rate_hz()),
            Self::BandLimited { table, .. } => table.value(chips),
        }
    }

    /// Correlation of the noise of taps so many chips apart.
    pub fn noise(&self, chips: f64) -> f64 {
        match self {
            Self::Replica { own, .. } => own.correlation(chips / own.chip_rate_hz()) / own.correlation(0.0),
            _ => self.value(chips) / self.value(0.0),
        }
    }

    /// Power of the noise of a tap, over that of a replica of unit power before the front end.
    pub fn noise_power(&self) -> f64 {
        match self {
            Self::Replica { own, .. } => own.correlation(0.0),
            _ => self.value(0.0),
        }
    }

    /// Power that a tap finds over the noise in it, over that of the component: what the front end passes, or
    /// the replica has.
    pub fn efficiency(&self) -> f64 {
        let peak = self.value(0.0);
        peak * peak / self.noise_power()
    }

    /// Shape of the peak that a receiver with exact knowledge of it assumes.
    pub fn code_shape(&self, settings: &TrackingSettings) -> CodeShape {
        let (discriminator, d) = (settings.dll_discriminator, settings.spacing_chips);
        match self {
            Self::Triangle if discriminator.pairs().len() == 1 => CodeShape::triangle(d),
            _ => CodeShape::of(discriminator, d, |x| (self.value(x), -self.fall(x)), |x| self.noise(x)),
        }
    }

    /// Standard deviation of one discriminator value in chips, for a C/N0 before the front end; `None` for
    /// the dot products behind one.
    pub fn raw_chips(&self, discriminator: Discriminator, d: f64, t_s: f64, cn0_hz: f64) -> Option<f64> {
        match self {
            Self::Triangle => Some(analysis::expect::theory::dll::raw_chips(discriminator, d, t_s, cn0_hz)),
            Self::Pulses(_) | Self::Replica { .. } => {
                Some(raw_on_chips(discriminator, self.taps(discriminator, d), t_s * cn0_hz * self.efficiency()))
            }
            Self::BandLimited { band, code, .. } => BandIntegrals::of(|f| density(code.as_ref(), f), d, *band)
                .jitter_chips(discriminator, 0.5 / t_s, t_s, cn0_hz),
        }
    }

    fn taps(&self, discriminator: Discriminator, d: f64) -> Taps {
        let peak = self.value(0.0);
        Taps::of(discriminator, d, |x| [self.value(x), self.fall(x)].map(|value| value / peak), |x| self.noise(x))
    }

    /// Minus the slope at an offset in chips.
    fn fall(&self, chips: f64) -> f64 {
        let h = 0.5 / STEPS_PER_CHIP;
        (self.value(chips - h) - self.value(chips + h)) / (2.0 * h)
    }
}

/// A code's spectrum at a frequency in chip rates, of unit area; that of rectangular chips without a code.
fn density(code: Option<&Waveform>, f: f64) -> f64 {
    code.map_or_else(|| sinc_squared(f), |code| code.density(f * code.chip_rate_hz()) * code.chip_rate_hz())
}
