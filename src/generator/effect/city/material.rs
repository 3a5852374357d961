//! Reflection at a wall of a building material, with its polarisation.
//!
//! Source: ITU-R P.2040-3: its table 3 (permittivity a·f^b and conductivity c·f^d by material), the complex
//! permittivity ε' − j σ/(ω ε₀), and Fresnel's coefficients of both polarisations. The field is carried as a
//! vector, so that a wave that two walls reflect has the polarisation of both. Limits: a wall is smooth, of
//! one material, and thick enough that nothing returns from its back.

use nalgebra::Vector3;
use num_complex::Complex64;

/// Vacuum's permittivity ε₀, in F/m.
const VACUUM_FPM: f64 = 8.854_187_812_8e-12;
/// Half of the square root of two: a circular wave has it in each of two directions.
const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Material of walls and roofs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Material of the table, with its a, b, c and d.
    Listed {
        /// Name as a scenario writes it.
        name: &'static str,
        /// Relative permittivity a·f^b, f in GHz.
        permittivity: [f64; 2],
        /// Conductivity c·f^d in S/m, f in GHz.
        conductivity: [f64; 2],
    },
    /// Relative permittivity and conductivity on all carriers.
    Given {
        /// Relative permittivity, its real part.
        permittivity: f64,
        /// Conductivity in S/m.
        conductivity_spm: f64,
    },
}

const fn listed(name: &'static str, permittivity: [f64; 2], conductivity: [f64; 2]) -> Material {
    Material::Listed { name, permittivity, conductivity }
}

/// Materials of ITU-R P.2040-3, table 3, that stand for walls, roofs and the ground between 1 and 3 GHz.
pub const MATERIALS: [Material; 8] = [
    listed("concrete", [5.24, 0.0], [0.0462, 0.7822]),
    listed("brick", [3.91, 0.0], [0.0238, 0.16]),
    listed("glass", [6.31, 0.0], [0.0036, 1.3394]),
    listed("wood", [1.99, 0.0], [0.0047, 1.0718]),
    listed("plywood", [2.71, 0.0], [0.33, 0.0]),
    listed("marble", [7.074, 0.0], [0.0055, 0.9262]),
    listed("plasterboard", [2.73, 0.0], [0.0085, 0.9395]),
    listed("metal", [1.0, 0.0], [1e7, 0.0]),
];

impl Material {
    /// Name as a scenario writes it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Listed { name, .. } => name,
            Self::Given { .. } => "material of the scenario",
        }
    }

    /// Complex relative permittivity on a carrier, for fields that grow as e^(jωt).
    pub fn permittivity(&self, carrier_hz: f64) -> Complex64 {
        let (real, conductivity_spm) = match *self {
            Self::Listed { permittivity: [a, b], conductivity: [c, d], .. } => {
                let ghz = carrier_hz * 1e-9;
                (a * libm::pow(ghz, b), c * libm::pow(ghz, d))
            }
            Self::Given { permittivity, conductivity_spm } => (permittivity, conductivity_spm),
        };
        Complex64::new(real, -conductivity_spm / (std::f64::consts::TAU * carrier_hz * VACUUM_FPM))
    }
}

/// Fresnel's coefficients of the electric field across the plane of incidence and in it, by the cosine of the
/// angle from the wall's normal.
pub fn fresnel(permittivity: Complex64, cosine: f64) -> [Complex64; 2] {
    let inside = root(permittivity - (1.0 - cosine * cosine));
    let (across, along) = (Complex64::from(cosine), permittivity * cosine);
    [(across - inside) / (across + inside), (along - inside) / (along + inside)]
}

/// Square root with a positive real part, by square roots alone: the same on every machine.
fn root(z: Complex64) -> Complex64 {
    let size = libm::hypot(z.re, z.im);
    let re = (0.5 * (size + z.re)).max(0.0).sqrt();
    let im = (0.5 * (size - z.re)).max(0.0).sqrt();
    Complex64::new(re, if z.im < 0.0 { -im } else { im })
}

/// Electric field of a wave as a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field([Complex64; 3]);

impl Field {
    /// Right-hand circular field of unit power that arrives from direction `from` at a level antenna.
    pub fn right(from: &Vector3<f64>) -> Self {
        let [x, y] = dipoles(from);
        // Its sense is that of a screw along the direction of travel, −from, and x × y = from.
        Self([0, 1, 2].map(|axis| Complex64::new(HALF * x[axis], HALF * y[axis])))
    }

    /// Component along a direction.
    fn along(&self, axis: &Vector3<f64>) -> Complex64 {
        self.0[0] * axis.x + self.0[1] * axis.y + self.0[2] * axis.z
    }

    /// Field behind a reflection at a wall: `travel` and `onward` are the directions of travel before and
    /// after it, `normal` that of the wall against the wave.
    pub fn reflected(
        &self,
        permittivity: Complex64,
        normal: &Vector3<f64>,
        travel: &Vector3<f64>,
        onward: &Vector3<f64>,
    ) -> Self {
        let across = normal.cross(travel);
        let across = if across.norm() > 1e-9 { across.normalize() } else { any_across(normal) };
        let [first, second] = fresnel(permittivity, -normal.dot(travel));
        let perpendicular = self.along(&across) * first;
        let parallel = self.along(&across.cross(travel)) * second;
        let parallel_axis = across.cross(onward);
        Self([0, 1, 2].map(|axis| perpendicular * across[axis] + parallel * parallel_axis[axis]))
    }

    /// Right-hand and left-hand circular parts at a level antenna that the wave reaches from direction
    /// `from`.
    pub fn circular(&self, from: &Vector3<f64>) -> [Complex64; 2] {
        let [x, y] = dipoles(from).map(|axis| self.along(&axis) * HALF);
        let j = Complex64::i();
        [x - j * y, x + j * y]
    }
}

/// East and north, turned with the zenith into a direction by the shortest way: the dipoles that a level
/// antenna of circular polarisation has for that direction. Straight below there is no such way, and the
/// vectors turn.
fn dipoles(from: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let middle = Vector3::z() + from;
    let scale = 1.0 / (1.0 + from.z).max(1e-9);
    [Vector3::x() - middle * (from.x * scale), Vector3::y() - middle * (from.y * scale)]
}

/// Any unit vector across a direction.
fn any_across(axis: &Vector3<f64>) -> Vector3<f64> {
    let other = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    axis.cross(&other).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    const L1_HZ: f64 = 1_575.42e6;

    #[test]
    fn materials_have_the_recommendation_s_constants_on_l1() {
        // Permittivity and conductivity by hand from table 3: σ = 0.0462 · 1.57542^0.7822 = 0.06592 S/m for
        // concrete; the imaginary part is 17.98 σ / f, f in GHz.
        let concrete = MATERIALS[0].permittivity(L1_HZ);
        assert!(
            (concrete.re - 5.24).abs() < 1e-9 && (concrete.im + 17.98 * 0.06592 / 1.57542).abs() < 2e-3,
            "{concrete}"
        );
        let given = Material::Given { permittivity: 4.0, conductivity_spm: 0.01 }.permittivity(L1_HZ);
        assert!((given.im + 17.98 * 0.01 / 1.57542).abs() < 1e-4, "{given}");
        let names: std::collections::BTreeSet<&str> = MATERIALS.iter().map(Material::name).collect();
        assert_eq!(names.len(), MATERIALS.len());
    }

    #[test]
    fn coefficients_are_those_of_optics() {
        // Glass of index 1.5 without loss: (1 − 1.5)/(1 + 1.5) straight on, none at Brewster's angle, −1 at
        // grazing.
        let glass = Complex64::from(2.25);
        let [perpendicular, parallel] = fresnel(glass, 1.0);
        assert!((perpendicular.re + 0.2).abs() < 1e-12 && (parallel.re - 0.2).abs() < 1e-12);
        let brewster = 1.0 / (1.0_f64 + 2.25).sqrt();
        assert!(fresnel(glass, brewster)[1].norm() < 1e-12);
        for found in fresnel(glass, 1e-9) {
            assert!((found + 1.0).norm() < 1e-6, "{found}");
        }
        // A good conductor turns the field across the plane round and keeps the other.
        let [perpendicular, parallel] = fresnel(MATERIALS[7].permittivity(L1_HZ), 0.5);
        assert!((perpendicular + 1.0).norm() < 1e-3 && (parallel - 1.0).norm() < 1e-3);
    }

    /// Co- and cross-polar parts behind one wall.
    fn one_wall(permittivity: Complex64, normal: Vector3<f64>, from: Vector3<f64>) -> ([Complex64; 2], f64) {
        let travel = -from;
        let onward = travel - normal * (2.0 * normal.dot(&travel));
        let field = Field::right(&from).reflected(permittivity, &normal, &travel, &onward);
        (field.circular(&-onward), -normal.dot(&travel))
    }

    #[test]
    fn one_wall_gives_half_the_sum_and_half_the_difference_of_both_polarisations() {
        let concrete = MATERIALS[0].permittivity(L1_HZ);
        for (normal, from) in [
            (Vector3::new(-1.0, 0.0, 0.0), Vector3::new(-0.6, 0.48, 0.64)),
            (Vector3::new(0.6, 0.8, 0.0), Vector3::new(0.8, 0.0, 0.6)),
            (Vector3::new(0.0, 0.6, 0.8), Vector3::new(0.1, 0.3, 0.9).normalize()),
        ] {
            let ([co, cross], cosine) = one_wall(concrete, normal, from);
            let [perpendicular, parallel] = fresnel(concrete, cosine);
            assert!((co.norm() - 0.5 * (perpendicular + parallel).norm()).abs() < 1e-12, "{co}");
            assert!((cross.norm() - 0.5 * (perpendicular - parallel).norm()).abs() < 1e-12, "{cross}");
        }
    }

    #[test]
    fn a_conductor_turns_the_sense_round_and_two_of_them_turn_it_back() {
        let metal = Complex64::new(1.0, -1e9);
        let ([co, cross], _) = one_wall(metal, Vector3::new(-1.0, 0.0, 0.0), Vector3::new(-0.6, 0.0, 0.8));
        assert!(co.norm() < 1e-3 && (cross.norm() - 1.0).abs() < 1e-3, "{co} {cross}");
        // A corner of two walls, straight back to where it came from.
        let from = Vector3::new(-0.6, -0.48, 0.64);
        let (east, north) = (Vector3::new(-1.0, 0.0, 0.0), Vector3::new(0.0, -1.0, 0.0));
        let travel = -from;
        let between = travel - east * (2.0 * east.dot(&travel));
        let onward = between - north * (2.0 * north.dot(&between));
        let field =
            Field::right(&from).reflected(metal, &east, &travel, &between).reflected(metal, &north, &between, &onward);
        let [co, cross] = field.circular(&-onward);
        assert!((co.norm() - 1.0).abs() < 1e-3 && cross.norm() < 1e-3, "{co} {cross}");
    }

    #[test]
    fn the_direct_wave_is_right_handed_and_of_phase_zero_from_everywhere() {
        for from in
            [Vector3::z(), Vector3::new(0.6, 0.0, 0.8), Vector3::new(-0.48, 0.6, 0.64), Vector3::new(0.8, -0.6, 0.0)]
        {
            let [co, cross] = Field::right(&from).circular(&from);
            assert!((co - 1.0).norm() < 1e-12 && cross.norm() < 1e-12, "{co} {cross}");
        }
    }
}
