//! Rays that reach the antenna, their line of sight, and the effects that act on them.

use nalgebra::Vector3;

use gnss::broadcast::State;
use gnss::earth::{Geodetic, Look};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Height in metres from which the Earth hides satellites instead of the elevation mask.
pub const SPACE_M: f64 = 100e3;

/// Geometry between one satellite and the antenna at one instant of reception.
#[derive(Clone, Debug)]
pub struct Sight {
    /// The satellite.
    pub sv: Sv,
    /// True GPS time of reception.
    pub received: Epoch,
    /// Position of the antenna, in the ECEF axes of `received`.
    pub user: Geodetic,
    /// Antenna, ECEF.
    pub user_m: Vector3<f64>,
    /// Velocity of the antenna in ECEF, in m/s.
    pub user_mps: Vector3<f64>,
    /// State of the satellite at emission, in the ECEF axes of `received`.
    pub satellite: State,
    /// Geometric range between the two, in metres.
    pub range_m: f64,
    /// Azimuth and elevation of the satellite at the antenna.
    pub look: Look,
    /// Angle at the satellite between the Earth's centre and the antenna, in radians.
    pub off_nadir_rad: f64,
}

/// Path from the satellite to the antenna.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Additional delay of the code along the path, in seconds, beyond the geometric delay.
    pub code_delay_s: f64,
    /// Additional delay of the carrier along the path, in seconds, beyond the geometric delay.
    pub carrier_delay_s: f64,
    /// Carrier phase that is not due to a delay (wind-up, reflection), in cycles.
    pub phase_cycles: f64,
    /// Carrier power over noise density of the whole signal, all components together, linear (Hz).
    pub cn0_hz: f64,
}

/// An effect that several front ends share.
impl<E: Effect + ?Sized> Effect for std::sync::Arc<E> {
    fn name(&self) -> &'static str {
        self.as_ref().name()
    }

    fn describe(&self) -> String {
        self.as_ref().describe()
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        self.as_ref().act(sight, signal, rays);
    }
}

/// Effect of nature or hardware on the rays of a satellite.
///
/// Laws: an effect of zero strength gives the same bits as its absence; the result depends on the
/// arguments alone; effects commute, or the scene fixes their order.
pub trait Effect: Send + Sync {
    /// Name as a scenario writes it.
    fn name(&self) -> &'static str;
    /// Describes the effect for the plan.
    fn describe(&self) -> String;
    /// Acts on every ray of `signal` along `sight`, or adds rays.
    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>);
}
