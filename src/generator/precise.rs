//! True orbits and clocks from precise products: a polynomial through the tabulated positions, a line between
//! clocks.
//!
//! A position is the polynomial of degree 11 through the twelve epochs around it, in ECEF. Neighbouring
//! polynomials meet at an epoch of the table, so the position is continuous; velocity is the polynomial's
//! own. Tables are every 15 minutes and the quickest term of a GPS orbit in these axes with any size has ω =
//! 2n + Ω = 3.6e-4 rad/s (the eccentricity's, some 2e5 m), of which twelve nodes 900 s apart miss (ω h)¹² ·
//! (1 · 3 · … · 11)² / (2¹² · 12!) or 17 µm; the printed digit, 1 mm, counts 1.5 times. Of a satellite's
//! clock nothing smooth is known between epochs: a line, which real clocks of 2010 leave by 0.09 m rms in the
//! middle of half an hour.
//!
//! Added to what the table has: relativity's periodic term, −2 r·v/c² (IS-GPS-200N, 20.3.3.3.3.1); T_GD as
//! that satellite broadcasts it at the scene's start, because the products' clocks like the broadcast ones
//! belong to the combination of P1 and P2; the antenna below the centre of mass. Limits: the antenna is on
//! the line to the Earth's centre; the products' time scale is a few nanoseconds off GPS time, alike for all
//! satellites; their axes are those of WGS 84 to centimetres.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use gnss::broadcast::{ClockState, State};
use gnss::earth::{EARTH_ROTATION_RADPS, GPS_MU_M3PS2, SPEED_OF_LIGHT_MPS};
use gnss::place::counted;
use gnss::satellite::Sv;
use gnss::sp3::{Precise, Sample};
use gnss::time::Epoch;

/// Number of epochs for the interpolation of a position; half of them lie before it.
pub const NODES: usize = 12;
const HALF: usize = NODES / 2;
/// Epochs of a table at most: more than a year every 15 minutes.
const MOST_EPOCHS: i64 = 50_000;

/// Satellite parameters that the orbit table does not contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// Group delay of L1 C/A against the combination that clocks belong to, in seconds.
    pub tgd_s: f64,
    /// Distance in metres of the antenna's phase centre from the centre of mass, towards the Earth.
    pub antenna_m: f64,
}

#[derive(Clone, Debug)]
struct Track {
    nodes: Vec<Option<Sample>>,
    hardware: Hardware,
}

/// Orbits and clocks on a uniform grid of epochs.
#[derive(Clone, Debug)]
pub struct Orbits {
    first_s: i64,
    step_s: i64,
    satellites: BTreeMap<Sv, Track>,
}

impl Orbits {
    /// Creates the orbits of those satellites of `precise` that `hardware` knows. `None` with fewer than
    /// twelve epochs between first and last, or more than 50 000.
    pub fn new(precise: &Precise, hardware: impl Fn(Sv) -> Option<Hardware>) -> Option<Self> {
        let mut epochs: Vec<i64> = precise.satellites.values().flat_map(BTreeMap::keys).copied().collect();
        epochs.sort_unstable();
        epochs.dedup();
        let (first_s, last_s) = (*epochs.first()?, *epochs.last()?);
        let step_s = epochs.windows(2).filter_map(|pair| Some(pair.last()? - pair.first()?)).min()?;
        let count = (last_s - first_s) / step_s + 1;
        let count = usize::try_from(count).ok().filter(|_| (NODES as i64..=MOST_EPOCHS).contains(&count))?;
        let track = |(sv, samples): (&Sv, &BTreeMap<i64, Sample>)| {
            let at = |index: usize| samples.get(&(first_s + step_s * index as i64)).copied();
            Some((*sv, Track { nodes: (0..count).map(at).collect(), hardware: hardware(*sv)? }))
        };
        Some(Self { first_s, step_s, satellites: precise.satellites.iter().filter_map(track).collect() })
    }

    /// First and last instant with enough epochs on both sides; the second may lie before the first.
    pub fn reach(&self) -> (Epoch, Epoch) {
        let count = self.satellites.values().map(|track| track.nodes.len()).max().unwrap_or(0) as i64;
        let at = |index: i64| Epoch::new(self.first_s + self.step_s * index, 0.0);
        (at(HALF as i64 - 1), at(count - HALF as i64))
    }

    /// Describes the orbits for the plan.
    pub fn describe(&self) -> String {
        let lowered: Vec<f64> = self.satellites.values().map(|track| track.hardware.antenna_m).collect();
        let antenna = match lowered.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x))) {
            (0.0, 0.0) => "antennas at the centres of mass".to_owned(),
            (least, most) if least == most => format!("antennas {least} m below the centres of mass"),
            (least, most) => format!("antennas {least} to {most} m below the centres of mass"),
        };
        let satellites = counted(self.satellites.len(), "satellite");
        format!("precise orbits and clocks of {satellites} every {} s, {antenna}", self.step_s)
    }

    /// True if positions and clocks exist for all times from `from` to `to`.
    pub fn covers(&self, sv: Sv, from: Epoch, to: Epoch) -> bool {
        let Some(track) = self.satellites.get(&sv) else { return false };
        let index = |at: Epoch| (at.seconds() - self.first_s).div_euclid(self.step_s);
        (index(from)..=index(to)).all(|cell| window(track, cell).is_some())
    }

    /// True orbit of the antenna (in the ECEF axes of `at`) and L1 C/A clock, T_GD included, at GPS time
    /// `at`.
    pub fn truth(&self, sv: Sv, at: Epoch) -> Option<(State, ClockState)> {
        let track = self.satellites.get(&sv)?;
        let cell = (at.seconds() - self.first_s).div_euclid(self.step_s);
        let nodes = window(track, cell)?;
        let step_s = self.step_s as f64;
        let u = at.since(Epoch::new(self.first_s + cell * self.step_s, 0.0)) / step_s;
        let (mut position_m, mut velocity_mps) = (Vector3::zeros(), Vector3::zeros());
        for (node, (weight, slope)) in nodes.iter().zip(weights(u)) {
            let node_m = node.as_ref()?.position_m;
            position_m += node_m * weight;
            velocity_mps += node_m * (slope / step_s);
        }
        let [from_s, to_s] = clocks(nodes)?;
        let light2 = SPEED_OF_LIGHT_MPS * SPEED_OF_LIGHT_MPS;
        let inertial_mps = velocity_mps + Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS).cross(&position_m);
        let radius_m = position_m.norm();
        // d(r·v)/dt is v² − μ/r; the Earth's flatness leaves 1e-4 of μ/r, 3e-14 of frequency.
        let bend_m2ps2 = inertial_mps.norm_squared() - GPS_MU_M3PS2 / radius_m;
        let along_m2ps = position_m.dot(&velocity_mps);
        let clock = ClockState {
            offset_s: from_s + (to_s - from_s) * u - 2.0 * along_m2ps / light2 - track.hardware.tgd_s,
            drift: (to_s - from_s) / step_s - 2.0 * bend_m2ps2 / light2,
        };
        let share = track.hardware.antenna_m / radius_m;
        let state = State {
            position_m: position_m * (1.0 - share),
            velocity_mps: velocity_mps * (1.0 - share) + position_m * (share * along_m2ps / (radius_m * radius_m)),
        };
        Some((state, clock))
    }
}

/// The nodes around cell `cell` of the table, if they are all there with nothing broken among them, and the
/// cell's clocks.
fn window(track: &Track, cell: i64) -> Option<&[Option<Sample>]> {
    let first = usize::try_from(cell).ok()?.checked_sub(HALF - 1)?;
    let nodes = track.nodes.get(first..first + NODES)?;
    let whole = nodes.iter().enumerate().all(|(k, node)| node.is_some_and(|node| k == 0 || !node.broken));
    (whole && clocks(nodes).is_some()).then_some(nodes)
}

/// Clocks at both ends of the middle cell.
fn clocks(nodes: &[Option<Sample>]) -> Option<[f64; 2]> {
    let at = |index: usize| nodes.get(index)?.as_ref()?.clock_s;
    Some([at(HALF - 1)?, at(HALF)?])
}

/// Weights of the nodes and of their derivative at `u` of the middle cell (Lagrange).
fn weights(u: f64) -> [(f64, f64); NODES] {
    let x = u + (HALF - 1) as f64;
    // Products of the distances to the nodes before and after each, with their derivatives.
    let mut before = [(1.0, 0.0); NODES + 1];
    let mut after = [(1.0, 0.0); NODES + 1];
    for k in 0..NODES {
        let (value, slope) = before[k];
        before[k + 1] = (value * (x - k as f64), slope * (x - k as f64) + value);
        let back = NODES - 1 - k;
        let (value, slope) = after[back + 1];
        after[back] = (value * (x - back as f64), slope * (x - back as f64) + value);
    }
    let mut out = [(0.0, 0.0); NODES];
    // (−1)^(11−k) k! (11−k)!, by its ratio from node to node.
    let mut scale = -(1..NODES).map(|k| k as f64).product::<f64>();
    for (k, weight) in out.iter_mut().enumerate() {
        let ((p, dp), (s, ds)) = (before[k], after[k + 1]);
        *weight = (p * s / scale, (dp * s + p * ds) / scale);
        scale *= -((k + 1) as f64) / (NODES - 1 - k).max(1) as f64;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_reproduce_every_polynomial_that_they_are_made_for() {
        for u in [0.0, 0.125, 0.5, 0.99, 1.0] {
            for power in 0..NODES as i32 {
                let (mut value, mut slope) = (0.0, 0.0);
                for (k, (weight, derivative)) in weights(u).into_iter().enumerate() {
                    let node = (k as f64 - 5.0) / 6.0;
                    value += weight * node.powi(power);
                    slope += derivative * node.powi(power);
                }
                let x = u / 6.0;
                let expected = if power == 0 { 0.0 } else { f64::from(power) / 6.0 * x.powi(power - 1) };
                // Twelve terms of weights up to 1.3, slopes up to 3, nodes within one.
                assert!((value - x.powi(power)).abs() < 1e-14, "{u} {power}");
                assert!((slope - expected).abs() < 1e-13, "{u} {power}");
            }
        }
    }
}
