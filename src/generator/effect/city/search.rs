//! Search of the ways by mirrors that come about while the antenna moves.
//!
//! At each instant the tree of mirrors gives the surfaces whose normal halves the angle between a satellite
//! and the way back; for two mirrors, those that do so for the antenna's image in each surface that the
//! antenna sees. Instants are so near that the antenna moves half a metre at most. Limits: a way is found if
//! it is above the floor at one of the instants; a surface counts as seen if one of nine points of it is.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::trace::{Carrier, Mirrors, Walls};
use super::{Axes, Way};
use crate::catalogue::Catalogue;
use crate::sky::emission;
use crate::vehicle::Trajectory;
use gnss::broadcast::OrbitError;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Largest step between instants, in metres and in seconds; the shortest in seconds.
const STEP_M: f64 = 0.5;
const STEP_S: f64 = 5.0;
const SHORTEST_S: f64 = 0.01;

/// Way at an instant, with the phase of its field in cycles and its amplitude.
pub type Found = (Mirrors, f64, f64);

/// Instants from the scene's start to `end_s` between which the antenna moves half a metre at most.
pub fn instants(trajectory: &Trajectory, end_s: f64) -> Vec<f64> {
    let (mut t_s, mut found) = (0.0, vec![0.0]);
    while t_s < end_s {
        let here_m = trajectory.at(t_s).position_m;
        let far = |t_s: f64| (trajectory.at(t_s).position_m - here_m).norm() > STEP_M;
        let mut step_s = STEP_S;
        while step_s > SHORTEST_S && [1.0, 0.75, 0.5, 0.25].iter().any(|share| far(t_s + share * step_s)) {
            step_s *= 0.5;
        }
        t_s = (t_s + step_s).min(end_s);
        found.push(t_s);
    }
    found
}

/// Ways of one satellite at one instant, above the floor, with the phase and the amplitude of their field.
pub fn ways_now(
    walls: &Walls,
    order: u32,
    seen: &[u32],
    (antenna_m, satellite_m): (&Vector3<f64>, &Vector3<f64>),
    carrier: &Carrier,
    tested: &mut impl FnMut(u32),
) -> Vec<Found> {
    let sky = (satellite_m - antenna_m).normalize();
    let mut candidates = Vec::new();
    walls.each_mirror(antenna_m, &sky, &mut |last| candidates.push(Mirrors { last, first: None }));
    if order > 1 {
        for last in seen {
            let Some(facet) = walls.facets().get(*last as usize) else { continue };
            let image_m = facet.image_m(antenna_m);
            walls.each_mirror(&image_m, &sky, &mut |first| {
                if first != *last {
                    candidates.push(Mirrors { last: *last, first: Some(first) });
                }
            });
        }
    }
    let mut found = Vec::new();
    for mirrors in candidates {
        mirrors.surfaces().for_each(&mut *tested);
        let echo = walls.echo(mirrors, antenna_m, satellite_m, carrier, tested);
        if let Some(echo) = echo.filter(|echo| echo.amplitude > 0.0) {
            found.push((mirrors, libm::atan2(echo.field.im, echo.field.re) / TAU, echo.amplitude));
        }
    }
    found
}

/// Surfaces that the antenna sees: it is before their plane, and one of their points is not hidden.
pub fn seen_from(walls: &Walls, antenna_m: &Vector3<f64>) -> Vec<u32> {
    let is_seen = |number: u32| {
        let facet = walls.facets().get(number as usize).filter(|facet| facet.above_m(antenna_m) > 0.0);
        let Some(samples) = facet.map(super::facet::Facet::samples_m) else { return false };
        // A sliver between the points of the grid may be seen.
        samples.is_empty() || samples.iter().any(|at_m| walls.sees(antenna_m, at_m, Some(number)))
    };
    (0..walls.facets().len() as u32).filter(|number| is_seen(*number)).collect()
}

/// Scene as far as the search needs it.
pub struct Quest<'a> {
    /// Walls and roofs.
    pub walls: &'a Walls,
    /// Axes of the walls.
    pub axes: Axes,
    /// Largest number of mirrors, 1 or 2.
    pub order: u32,
    /// Carrier for which ways are found: the longest wavelength of the scene.
    pub carrier: Carrier,
    /// Orbits and clocks.
    pub catalogue: &'a Catalogue,
    /// Satellites whose ways are sought.
    pub satellites: &'a [Sv],
    /// Motion of the antenna.
    pub trajectory: &'a Trajectory,
    /// Start of the scene.
    pub start: Epoch,
}

impl Quest<'_> {
    /// Finds the ways of all satellites up to `end_s` after the start.
    ///
    /// # Errors
    /// Errors of the orbits.
    pub fn ways(&self, end_s: f64) -> Result<BTreeMap<Sv, Vec<Way>>, OrbitError> {
        let instants = instants(self.trajectory, end_s);
        let found: Result<Vec<_>, OrbitError> = instants.par_iter().map(|t_s| self.at(*t_s)).collect();
        let mut all: BTreeMap<Sv, BTreeMap<Mirrors, (Way, f64)>> = BTreeMap::new();
        for (t_s, ways) in instants.iter().zip(found?) {
            for (sv, (mirrors, phase_cycles, amplitude)) in ways {
                let new = (Way { mirrors, life_s: [*t_s; 2], phase_cycles }, amplitude);
                let (way, strongest) = all.entry(sv).or_default().entry(mirrors).or_insert(new);
                way.life_s[1] = *t_s;
                if amplitude > *strongest {
                    (way.phase_cycles, *strongest) = (phase_cycles, amplitude);
                }
            }
        }
        let lists = all.into_iter().map(|(sv, ways)| (sv, ways.into_values().map(|(way, _)| way).collect()));
        Ok(lists.collect())
    }

    /// Ways of all satellites at an instant.
    fn at(&self, t_s: f64) -> Result<Vec<(Sv, Found)>, OrbitError> {
        let motion = self.trajectory.at(t_s);
        let antenna_m = self.axes.local_m(&motion.position_m);
        let seen = if self.order > 1 { seen_from(self.walls, &antenna_m) } else { Vec::new() };
        let mut found = Vec::new();
        for sv in self.satellites {
            let Some(emission) = emission(self.catalogue, *sv, self.start.plus_s(t_s), &motion)? else { continue };
            if emission.sight.look.elevation_rad < 0.0 {
                continue;
            }
            let satellite_m = self.axes.local_m(&emission.sight.satellite.position_m);
            let ends = (&antenna_m, &satellite_m);
            let ways = ways_now(self.walls, self.order, &seen, ends, &self.carrier, &mut |_| ());
            found.extend(ways.into_iter().map(|way| (*sv, way)));
        }
        Ok(found)
    }
}

impl Mirrors {
    /// Numbers of the surfaces, the antenna's first.
    pub fn surfaces(&self) -> impl Iterator<Item = u32> {
        std::iter::once(self.last).chain(self.first)
    }
}
