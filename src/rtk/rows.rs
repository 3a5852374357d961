//! Single differences of an epoch, rover minus base, less their model, with their weights.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::carrier::{Code, chips_hz};
use crate::normal::{Difference, Normal, OF_POSITION};
use crate::pairs::{Pair, Track, modelled};
use crate::site::Site;
use gnss::satellite::System;

/// A track's difference of an epoch, at the approximate position.
#[derive(Clone, Debug)]
pub struct Row {
    /// Satellite and signal.
    pub track: Track,
    /// Length of the carrier's wave, metres.
    pub wavelength_m: f64,
    /// Code less its model, metres.
    pub code_m: f64,
    /// Phase less its model in metres, with what the receivers say of it: broken, half.
    pub phase: Option<(f64, bool, bool)>,
    /// Unit vector from the satellite to the rover.
    pub direction: Vector3<f64>,
    /// Elevation at the rover.
    pub elevation_rad: f64,
    /// Variance of the code, square metres.
    pub code_m2: f64,
    /// Variance of the phase, square metres.
    pub phase_m2: f64,
}

/// Single differences of satellites above a mask. Without one they are those of all satellites.
pub fn rows(pair: &Pair, base: &Site, rover: &Site, mask_rad: Option<f64>) -> Vec<Row> {
    let all = pair.shared.iter().filter_map(|shared| {
        let (of_base_m, ..) = modelled(&shared.emissions[0], base);
        let (of_rover_m, direction, elevation_rad) = modelled(&shared.emissions[1], rover);
        let model_m = of_rover_m - of_base_m;
        let (sv, code) = shared.track;
        let [code_m2, phase_m2] = variances(sv.system, code, elevation_rad, shared.cn0_dbhz);
        let phase = shared.phases.map(|own| {
            let [of_base_m, of_rover_m] = planted!("rtk.rows.sign", own.phase_m, [own.phase_m[1], own.phase_m[0]]);
            (of_rover_m - of_base_m - model_m, own.is_broken, own.is_half)
        });
        mask_rad.is_none_or(|mask_rad| elevation_rad >= mask_rad).then_some(Row {
            track: shared.track,
            wavelength_m: shared.wavelength_m,
            code_m: shared.code_m[1] - shared.code_m[0] - model_m,
            phase,
            direction,
            elevation_rad,
            code_m2,
            phase_m2,
        })
    });
    all.collect()
}

/// Position of the rover by codes alone, to metres, from one that may be thousands of kilometres off; `None`
/// if they do not determine it. Far from the true position an elevation says nothing: a first position has no
/// mask.
pub fn by_codes(pair: &Pair, base: &Site, from_m: Option<Vector3<f64>>, mask_rad: f64) -> Option<Vector3<f64>> {
    let mask_rad = from_m.map(|_| mask_rad);
    settled(from_m.unwrap_or(base.position_m), |rover| {
        let rows = rows(pair, base, rover, mask_rad);
        let of_code = |row: &&Row| difference(row, row.code_m, row.code_m2, None);
        groups(&rows).values().map(|group| group.iter().map(of_code).collect()).collect()
    })
}

/// Position of the base by its own codes alone, as [`by_codes`] finds the rover: the receiver's single
/// position, with the errors of the ionosphere. An error of 20 m turns a baseline by 1e-6 of its length.
pub fn of_base(pair: &Pair, from_m: Option<Vector3<f64>>, mask_rad: f64) -> Option<Vector3<f64>> {
    let mask_rad = from_m.map(|_| mask_rad);
    // Satellites in view stand around the zenith.
    let above_m: Vector3<f64> = pair.shared.iter().map(|shared| shared.emissions[0].position_m).sum();
    let start_m = from_m.or_else(|| above_m.try_normalize(0.0).map(|up| up * EARTH_RADIUS_M))?;
    settled(start_m, |base| {
        let mut groups: BTreeMap<(System, Code), Vec<Difference>> = BTreeMap::new();
        for shared in &pair.shared {
            let (model_m, direction, elevation_rad) = modelled(&shared.emissions[0], base);
            if mask_rad.is_some_and(|mask_rad| elevation_rad < mask_rad) {
                continue;
            }
            let (sv, code) = shared.track;
            let derivatives = (0..OF_POSITION).map(|axis| (axis, direction[axis])).collect();
            let [code_m2, _] = variances(sv.system, code, elevation_rad, shared.cn0_dbhz);
            let misclosure_m = shared.code_m[0] - model_m;
            // Of one receiver.
            let own = Difference { derivatives, misclosure_m, variance_m2: 0.5 * code_m2 };
            groups.entry((sv.system, code)).or_default().push(own);
        }
        groups.into_values().collect()
    })
}

/// Position at which the equations of codes settle, from one that may be thousands of kilometres off.
fn settled(from_m: Vector3<f64>, equations: impl Fn(&Site) -> Vec<Vec<Difference>>) -> Option<Vector3<f64>> {
    let mut position_m = from_m;
    for _ in 0..MOST_STEPS {
        let mut normal = Normal::new(OF_POSITION);
        equations(&Site::new(position_m)).iter().for_each(|group| normal.add_group(group));
        let (step, _) = normal.solve(&[0, 1, 2])?;
        position_m += step.fixed_rows::<3>(0);
        // An error of a metre moves a direction by 5e-8 rad, and a double difference by less than that.
        if step.norm() < 1.0 {
            return Some(position_m);
        }
    }
    None
}

/// Mean radius of the Earth, from which steps to a first position begin.
const EARTH_RADIUS_M: f64 = 6.371e6;

/// Steps to the approximate position, of which the first may be thousands of kilometres.
const MOST_STEPS: usize = 12;

/// Deviation of the code of 1.023 million chips a second at 45 dB-Hz, metres: a loop of 1 Hz with a quarter
/// of a chip between early and late. It grows with the noise's amplitude and with the length of a chip.
const CODE_M: f64 = 0.5;
const CODE_CHIPS_HZ: f64 = 1.023e6;
const CODE_CN0_DBHZ: f64 = 45.0;
/// Deviation of a code that no C/N0 tells, at the zenith, metres.
const CODE_FLOOR_M: f64 = 0.1;
/// Deviation of a phase, and what low elevations add to it, metres.
const PHASE_M: [f64; 2] = [0.001, 0.002];
/// C/N0 at the horizon where a file states none, and what the zenith has more, dB-Hz.
const USUAL_DBHZ: [f64; 2] = [35.0, 12.0];
/// Least sine of an elevation in a weight.
const LEAST_SINE: f64 = 0.05;

/// Variances of a single difference of codes and of phases, square metres.
pub fn variances(system: System, code: Code, elevation_rad: f64, cn0_dbhz: Option<f64>) -> [f64; 2] {
    let sine = libm::sin(elevation_rad).max(LEAST_SINE);
    let cn0_dbhz = cn0_dbhz.unwrap_or(USUAL_DBHZ[0] + USUAL_DBHZ[1] * sine);
    let noise = libm::pow(10.0, (CODE_CN0_DBHZ - cn0_dbhz) / 20.0);
    let code_m = libm::hypot(CODE_M * noise * CODE_CHIPS_HZ / chips_hz(system, code), CODE_FLOOR_M / sine);
    let phase_m = libm::hypot(PHASE_M[0], PHASE_M[1] / sine);
    // Of two receivers.
    [2.0 * code_m * code_m, 2.0 * phase_m * phase_m]
}

/// Rows of each system and signal, which share a clock.
pub fn groups(rows: &[Row]) -> BTreeMap<(System, Code), Vec<&Row>> {
    let mut groups: BTreeMap<(System, Code), Vec<&Row>> = BTreeMap::new();
    for row in rows {
        groups.entry((row.track.0.system, row.track.1)).or_default().push(row);
    }
    groups
}

/// Equation of a value of a row, with the unknown of its ambiguity.
pub fn difference(row: &Row, misclosure_m: f64, variance_m2: f64, ambiguity: Option<usize>) -> Difference {
    let mut derivatives: Vec<(usize, f64)> = (0..OF_POSITION).map(|axis| (axis, row.direction[axis])).collect();
    derivatives.extend(ambiguity.map(|index| (index, row.wavelength_m)));
    Difference { derivatives, misclosure_m, variance_m2 }
}
