//! Array of a scene as the judge gets it.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use num_complex::Complex64;

use crate::array::Element;
use crate::scene::Scene;
use crate::stage::interference::Interferer;
use gnss::earth::Geodetic;
use gnss::facts::ArrayFacts;

/// Facts of the array whose elements `scenes` are, with its sources in their order; `None` if they are none.
pub(super) fn facts(scenes: &[Scene], sources: &[(usize, &Interferer)]) -> Option<ArrayFacts> {
    let first = scenes.first().filter(|_| scenes.len() > 1)?;
    let elements: Option<Vec<&Element>> = scenes.iter().map(|scene| scene.element.as_deref()).collect();
    let elements = elements?;
    let body = &elements.first()?.body;
    let enu = Geodetic::from_ecef(&first.trajectory.at(0.0).position_m).ecef_to_enu();
    let axes = body.orientation(0.0)?.axes();
    let local = |axis: Vector3<f64>| <[f64; 3]>::from(enu * axis);
    let row = |element: &&Element| {
        let ahead_cycles = element.phase_cycles - first.metadata.center_hz * element.delay_s;
        let (sin, cos) = libm::sincos(TAU * (ahead_cycles - ahead_cycles.floor()));
        let channel = Complex64::new(cos, sin) * element.gain;
        let own = |j: usize| match element.coupling.get(j) {
            Some(factor) => *factor,
            None if j == element.number => Complex64::ONE,
            None => Complex64::ZERO,
        };
        let row = (0..elements.len()).map(|j| channel * own(j)).map(|x| [x.re, x.im]);
        row.collect::<Vec<_>>()
    };
    let towards = sources.iter().map(|(_, source)| source.path.as_ref().map(|path| local(path.towards(0.0))));
    Some(ArrayFacts {
        lever_arms_m: elements.first()?.lever_arms_m.iter().map(|arm| (*arm).into()).collect(),
        axes: [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| local(axes * axis)),
        is_still: scenes.iter().all(|scene| scene.trajectory.is_static()),
        mixing: elements.iter().flat_map(row).collect(),
        gains: elements.iter().map(|element| element.gain).collect(),
        towards: towards.collect::<Option<Vec<_>>>()?,
    })
}
