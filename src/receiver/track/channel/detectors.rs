//! The detectors of a channel: strength and lock of the carrier, and false locks of carrier and code.

use num_complex::Complex64;

use crate::acquire::Acquired;
use crate::lead::followed_db;
use crate::track::TrackingSettings;
use crate::track::cn0::Cn0;
use crate::track::halves::Halves;
use crate::track::lock::{LockState, is_weak};
use crate::track::side::SidePeaks;
use gnss::signal::Component;

/// Detectors that every stage of a channel has.
#[derive(Clone, Debug)]
pub(super) struct Detectors {
    pub cn0: Cn0,
    /// C/N0 of the whole signal that the search estimated, in dB-Hz.
    found_dbhz: f64,
    /// C/N0 of what is followed over that of the whole signal.
    pub followed_db: f64,
    least_cn0_hz: f64,
    pub lock: LockState,
    /// Rotation of the carrier within code periods.
    pub halves: Halves,
    /// True if no false lock was seen since the last pull-in.
    pub is_true: bool,
    pub side_peaks: Option<SidePeaks>,
}

impl Detectors {
    pub fn new(component: Option<&'static Component>, hit: &Acquired, settings: &TrackingSettings, cn0: Cn0) -> Self {
        let waveform = settings.waveform;
        Self {
            cn0,
            found_dbhz: hit.cn0_dbhz,
            followed_db: component.map_or(0.0, |c| followed_db(c, waveform)),
            least_cn0_hz: settings.least_cn0_hz(),
            lock: LockState::default(),
            halves: Halves::default(),
            is_true: false,
            side_peaks: component.and_then(|c| SidePeaks::new(c, waveform)),
        }
    }

    /// The best estimate of C/N0: what the search found until there is one.
    pub fn cn0_hz(&self) -> f64 {
        self.cn0.hz().unwrap_or_else(|| libm::pow(10.0, (self.found_dbhz + self.followed_db) / 10.0))
    }

    /// C/N0 of the whole signal in dB-Hz.
    pub fn cn0_dbhz(&self) -> f64 {
        10.0 * libm::log10(self.cn0_hz()) - self.followed_db
    }

    /// True if C/N0 is below the least one.
    pub fn is_weak(&self) -> bool {
        is_weak(self.cn0.hz(), self.least_cn0_hz)
    }

    /// Power of a prompt's noise: two for white noise.
    pub fn noise(&self) -> f64 {
        self.cn0.noise().unwrap_or(2.0)
    }

    /// A prompt with noise of unit variance a component, whatever the front end makes of its spectrum.
    pub fn whitened(&self, prompt: Complex64) -> Complex64 {
        let noise = self.noise();
        if noise > 0.0 { prompt * (2.0 / noise).sqrt() } else { prompt }
    }

    /// Forgets what was seen within code periods.
    pub fn forget_halves(&mut self) {
        (self.halves, self.is_true) = (Halves::default(), false);
    }
}
