//! The line below which the scene's obstructions hide satellites, for pictures of the sky.

use crate::ray::{Ray, Sight};
use crate::scene::Scene;
use gnss::broadcast::State;
use gnss::earth::{Geodetic, Look};

/// Azimuth and elevation (degrees) below which a direct ray has lost half of its power at the start, if
/// anything in the scene is in the way.
pub(super) fn skyline_deg(scene: &Scene) -> Option<Vec<[f64; 2]>> {
    let in_the_way = || scene.effects.iter().filter(|effect| matches!(effect.name(), "obstruction" | "city"));
    in_the_way().next()?;
    let (sv, signal) = (scene.catalogue.satellites().next()?, scene.signals.first()?);
    let motion = scene.trajectory.composed_for();
    let user = Geodetic::from_ecef(&motion.position_m);
    let blocked = |azimuth_deg: f64, elevation_deg: f64| {
        let look = Look { azimuth_rad: azimuth_deg.to_radians(), elevation_rad: elevation_deg.to_radians() };
        let sight = Sight {
            sv,
            received: scene.clock.start,
            user,
            user_m: motion.position_m,
            user_mps: motion.velocity_mps,
            satellite: State { position_m: motion.position_m, velocity_mps: motion.velocity_mps },
            range_m: 0.0,
            look,
            off_nadir_rad: 0.0,
        };
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 1.0 }];
        in_the_way().for_each(|effect| effect.act(&sight, signal, &mut rays));
        rays.first().is_some_and(|ray| ray.cn0_hz < 0.5)
    };
    // Steps of 2° and 0.5°, which a picture does not resolve further.
    let rows = (0..=180).map(|k| {
        let azimuth_deg = 2.0 * f64::from(k);
        let steps = (0..=180).rev().find(|k| blocked(azimuth_deg % 360.0, 0.5 * f64::from(*k)));
        [azimuth_deg, steps.map_or(0.0, |k| 0.5 * f64::from(k))]
    });
    Some(rows.collect())
}
