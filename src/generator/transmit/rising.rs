//! Start of a satellite's view, for a stream that begins late in a scene.
//!
//! Views are decided second by second, and a satellite may have been up for hours before the first sample of
//! a stream. A satellite well above the mask has been there for some time, because nothing moves faster than
//! its bound: so the search leaps back as far as the elevation allows, and ends in single seconds.

use crate::presence::Presence;
use crate::ray::Sight;
use crate::scene::Scene;
use crate::spoof::Constellation;
use gnss::earth::SEMI_MAJOR_AXIS_M;
use gnss::satellite::Sv;

/// Satellites in the Earth's axes are slower: 3.9 km/s the fastest, and a quarter more for a fault's own.
const SATELLITE_MPS: f64 = 5000.0;
/// Longest leap in seconds, over which ranges change little.
const LEAP_S: f64 = 600.0;
/// Largest change of an elevation by lever arms and orbit errors of a satellite, in radians: 200 m at 20 000
/// km.
const SLACK_RAD: f64 = 1e-5;

/// Time before a sight for which a satellite was certainly in view.
pub(super) struct Leap {
    /// Largest speed of the antenna; `None` where it is not known.
    user_mps: Option<f64>,
    mask_rad: f64,
}

impl Leap {
    /// Creates the bound for the antenna of a scene, as a constellation assumes it to move, until `until_s`
    /// after the start.
    pub fn new(scene: &Scene, from: &Constellation, until_s: f64) -> Self {
        // From space satellites are seen below the horizon, but never hidden above it.
        Self { user_mps: from.fastest_mps(&scene.trajectory, until_s), mask_rad: scene.mask_rad.max(0.0) }
    }

    /// Whole seconds before that of `sight` in which the satellite was in view too, if it was sent.
    pub fn seconds(&self, sight: &Sight) -> u64 {
        let Some(user_mps) = self.user_mps else { return 0 };
        let nearest_m = sight.range_m - LEAP_S * (SATELLITE_MPS + user_mps);
        let margin_rad = sight.look.elevation_rad - self.mask_rad - SLACK_RAD;
        if nearest_m <= 0.0 || margin_rad <= 0.0 {
            return 0;
        }
        // The line of sight turns by what moves across it, and the vertical with the position below.
        let rate_radps = (SATELLITE_MPS + user_mps) / nearest_m + user_mps / (0.99 * SEMI_MAJOR_AXIS_M);
        (margin_rad / rate_radps).min(LEAP_S) as u64
    }
}

/// The first of the whole seconds before `second` in which `sv` was in view without a break; `None` if it was
/// not in view in the last of them.
///
/// # Errors
/// Errors of `presence`, which states where the satellite is at a second.
pub(super) fn rising<E>(
    scene: &Scene,
    (from, sv): (&Constellation, Sv),
    second: u64,
    mut presence: impl FnMut(u64) -> Result<Presence, E>,
) -> Result<Option<u64>, E> {
    let leap = Leap::new(scene, from, scene.clock.rate.elapsed_s(scene.clock.rate.first_sample_at(second, 1)));
    let time = |second: u64| {
        let reading = scene.clock.epoch(scene.clock.rate.first_sample_at(second, 1));
        from.replayed(scene.receiver_clock.true_time(scene.clock.start, reading))
    };
    let mut since = None;
    let mut next = second.checked_sub(1);
    while let Some(second) = next {
        let Presence::InView(emission) = presence(second)? else { break };
        // Its clock may have lengthened a leap by less than a second.
        let earliest = second.saturating_sub(leap.seconds(&emission.sight).saturating_sub(1));
        let sent = earliest < second && scene.catalogue_of(from).sent_throughout(sv, time(earliest), time(second));
        let reached = if sent { earliest } else { second };
        since = Some(reached);
        next = reached.checked_sub(1);
    }
    Ok(since)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::arrival;
    use crate::scenario::{Overrides, Scenario};

    /// A day of the embedded file at 1.1 Msps.
    fn day(motion: &str, mask_deg: f64) -> Scene {
        let text = format!(
            "name = \"day\"\nstart = 2010-07-01T00:00:00\nduration_s = 86400\nmotion = {{ {motion} }}\n\
             satellites = {{ mask_deg = {mask_deg} }}\nfront_end = {{ sample_rate_hz = 1.1e6, format = \"ci8\" }}\n\
             receiver_clock = {{ bias_s = 0.01, drift_sps = 1e-6 }}\n"
        );
        Scenario::parse(&text, "day").unwrap().compose(Path::new("."), &Overrides::default()).unwrap().0
    }

    const REST: &str = "kind = \"static\", latitude_deg = 26.5123, longitude_deg = 80.2329, height_m = 130";
    const ORBIT: &str = "kind = \"orbit\", semi_major_axis_m = 7e6, eccentricity = 0, \
                         inclination_deg = 50, node_longitude_deg = 10";

    /// Checks every satellite against a look at each second; looks taken, and seconds that they stand for.
    fn looks(scene: &Scene, seconds: &[u64]) -> (u64, u64) {
        let from = Constellation::authentic();
        let (mut looks, mut lasting_s) = (0, 0);
        for sv in scene.catalogue.satellites() {
            let presence = |second: u64| {
                let local = scene.clock.epoch(scene.clock.rate.first_sample_at(second, 1));
                arrival::presence_from(scene, &from, sv, local)
            };
            for second in seconds.iter().copied() {
                let up = |second: &u64| presence(*second).unwrap().end().is_none();
                let slow = (0..second).rev().take_while(up).last();
                let counted = |second| {
                    looks += 1;
                    presence(second)
                };
                assert_eq!(rising(scene, (&from, sv), second, counted).unwrap(), slow, "{sv} before {second} s");
                lasting_s += slow.map_or(0, |since| second - since);
            }
        }
        (looks, lasting_s)
    }

    #[test]
    fn a_rise_is_found_as_by_single_seconds_in_a_few_looks_however_late_the_stream_begins() {
        let (taken, lasting_s) = looks(&day(REST, 5.0), &[1, 100, 45_000, 82_800]);
        // A dozen satellites three hours up at two of the seconds, a hundred looks each at most.
        assert!(lasting_s > 200_000, "{lasting_s}");
        assert!(taken * 100 < lasting_s, "{taken} looks for {lasting_s} s");
        let (taken, lasting_s) = looks(&day(REST, -3.0), &[30_000]);
        assert!(taken < lasting_s, "{taken} looks for {lasting_s} s");
    }

    #[test]
    fn a_rise_seen_from_orbit_is_that_of_single_seconds_too() {
        let (taken, lasting_s) = looks(&day(ORBIT, 0.0), &[5_000, 20_000]);
        assert!(taken <= lasting_s + 64, "{taken} looks for {lasting_s} s");
    }
}
