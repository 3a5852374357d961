//! A scene as meant: validated, in SI units, with everything that it needs loaded.

use std::sync::Arc;

use crate::generator::catalogue::Catalogue;
use crate::generator::clock::ReceiverClock;
pub use crate::generator::fidelity::{Arithmetic, CodeEdge, Fidelity, Grade};
use crate::generator::ray::Effect;
use crate::generator::vehicle::Trajectory;
use crate::gnss::gps::lnav::Broadcast;
use crate::gnss::samples::IfMetadata;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;
use crate::gnss::time::SampleClock;

/// Everything that the generator computes, and nothing that it does not.
pub struct Scene {
    pub name: String,
    pub seed: u64,
    /// Number of samples.
    pub samples: u64,
    /// The receiver's clock reading at sample 0, and its sample rate.
    pub clock: SampleClock,
    /// How the receiver's clock departs from GPS time.
    pub receiver_clock: ReceiverClock,
    pub metadata: IfMetadata,
    /// Antenna motion over true time since `clock.start`.
    pub trajectory: Trajectory,
    /// Orbits and clocks as they are (in this program: smooth hand-over between broadcast sets).
    pub catalogue: Arc<Catalogue>,
    /// What the satellites send besides their own ephemeris.
    pub broadcast: Arc<Broadcast>,
    pub signals: Vec<&'static Signal>,
    /// Satellites that the scene leaves out.
    pub excluded: Vec<Sv>,
    /// Satellites below this elevation are not computed.
    pub mask_rad: f64,
    pub effects: Vec<Box<dyn Effect>>,
    /// Thermal noise; absent means none.
    pub noise: bool,
    /// Standard deviation of the noise per component, in LSB of the sample format (the gain). Without
    /// noise the same gain scales the signals: a ray has amplitude `sqrt(cn0_hz / rate) * sqrt(2) * noise_lsb`.
    pub noise_lsb: f32,
    pub fidelity: Fidelity,
    /// Spacing of truth records.
    pub truth_interval_s: f64,
}
