//! Rays among walls: what blocks a ray, and the ways by one or two mirrors.
//!
//! A way by mirrors is found with images: the antenna's image in the last wall, that one's image in the
//! first, and back along the straight line from the satellite. Its excess is the difference of two distances
//! to the satellite, so its rate is that of the geometry. Each edge acts as a knife edge (ITU-R P.526-15,
//! 4.1, equation 31), with ν of Fresnel's zones counted from the antenna along the way: the field behind a
//! wall fades over its edge, and that of a mirror fades as the point of reflection leaves it. Limits: one
//! edge at a time, the one that obstructs most; nothing scatters; a diffracted ray keeps the direct one's
//! delay and phase; the satellite is where it was for the direct ray (300 m more change its range by 1 mm).

use nalgebra::Vector3;
use num_complex::Complex64;

use super::facet::{Edge, Facet};
use super::material::{Field, Material};
use super::tree::{Bounds, Tree};
use crate::effect::ionosphere::smooth;
use crate::effect::obstruction::knife_edge_db;
use gnss::earth::SPEED_OF_LIGHT_MPS;

/// Metres of space that a unit of the normals counts as, in the tree of mirrors.
const TURN_M: f64 = 60.0;
/// ν before an edge from which on nothing is lost: −0.78 with diffraction, −1 without.
const CLEAR_NU: f64 = -1.0;
/// ν beyond a mirror's edge at which its field begins to fade out, and at which nothing is left.
const FADING_NU: [f64; 2] = [1.0, 2.5];
/// Amplitude relative to the direct ray at which an echo is dropped, and from which it is whole: −46 and −40
/// dB.
const FLOOR: [f64; 2] = [0.005, 0.01];
/// Distance from an end of a leg at which a surface does not count, in metres: it is the mirror's own.
const OWN_M: f64 = 1e-6;
/// Ways shorter than this count as this for Fresnel's zones, in wavelengths: nearer the formula does not
/// hold.
const NEAREST_WAVES: f64 = 1.0;
/// Height above a mirror's plane from which on its echo is whole, in wavelengths.
const GRAZING_WAVES: f64 = 2.0;

/// Mirrors of a way: the last one before the antenna, and the one before that, if there are two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mirrors {
    /// Number of the surface that the antenna sees.
    pub last: u32,
    /// Number of the surface that this one sees.
    pub first: Option<u32>,
}

/// Echo of a satellite by mirrors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Length of the way beyond the direct one, in metres.
    pub excess_m: f64,
    /// Field that the mirrors leave of the unobstructed direct ray's, as the antenna receives it, without
    /// edges.
    pub field: Complex64,
    /// Amplitude relative to the unobstructed direct ray: that of the field, less what edges and walls take;
    /// 0 below the floor.
    pub amplitude: f64,
}

/// Signal and antenna for which rays are traced.
#[derive(Clone, Copy, Debug)]
pub struct Carrier {
    /// Wavelength, in metres.
    pub wavelength_m: f64,
    /// Complex permittivity of the walls.
    pub permittivity: Complex64,
    /// Amplitude with which the antenna receives left-hand waves, of right-hand ones.
    pub cross: f64,
}

/// Walls and roofs, with the trees over them.
#[derive(Clone, Debug)]
pub struct Walls {
    facets: Vec<Facet>,
    rays: Tree,
    mirrors: Tree,
    /// True if edges diffract.
    diffraction: bool,
}

/// Straight part of a way.
#[derive(Clone, Copy, Debug)]
struct Leg {
    from_m: Vector3<f64>,
    along: Vector3<f64>,
    length_m: f64,
    /// Length of the way from the antenna to `from_m`.
    behind_m: f64,
    /// Mirrors at its ends.
    own: [Option<u32>; 2],
}

/// Legs of a way, from the antenna on, and its mirrors with the directions of travel before and after them.
struct Way {
    legs: [Option<Leg>; 3],
    /// Bounces from the satellite on.
    bounces: [Option<Bounce>; 2],
    excess_m: f64,
    /// Direction from which the wave reaches the antenna.
    arrives: Vector3<f64>,
}

#[derive(Clone, Copy)]
struct Bounce {
    surface: u32,
    at_m: Vector3<f64>,
    left_m: f64,
    travel: Vector3<f64>,
    onward: Vector3<f64>,
}

impl Carrier {
    /// Carrier of a frequency among walls of a material.
    pub fn new(carrier_hz: f64, material: &Material, cross: f64) -> Self {
        let wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz;
        Self { wavelength_m, permittivity: material.permittivity(carrier_hz), cross }
    }

    /// Fresnel's parameter ν of an edge `aside_m` from a ray, at `distance_m` along the way from the antenna.
    fn nu(&self, aside_m: f64, distance_m: f64) -> f64 {
        let distance_m = distance_m.max(NEAREST_WAVES * self.wavelength_m);
        aside_m * (2.0 / (self.wavelength_m * distance_m)).sqrt()
    }
}

impl Walls {
    /// Builds the trees over surfaces.
    pub fn new(facets: Vec<Facet>, diffraction: bool) -> Self {
        let bounds: Vec<Bounds> = facets.iter().map(|facet| facet.bounds).collect();
        let (rays, mirrors) = (Tree::new(&bounds, 0.0), Tree::new(&bounds, TURN_M));
        Self { facets, rays, mirrors, diffraction }
    }

    /// Surfaces by their numbers.
    pub fn facets(&self) -> &[Facet] {
        &self.facets
    }

    fn facet(&self, number: u32) -> Option<&Facet> {
        self.facets.get(number as usize)
    }

    /// Share of the amplitude that passes an edge, by its ν: positive in its shadow.
    fn passed(&self, nu: f64) -> f64 {
        if self.diffraction { libm::pow(10.0, -knife_edge_db(nu) / 20.0) } else { 1.0 - smooth(nu - CLEAR_NU) }
    }

    /// Share of a mirror's field where the ray is `nu` inside its edge.
    fn mirrored(&self, nu: f64) -> f64 {
        let [from, to] = FADING_NU;
        self.passed(-nu) * (1.0 - smooth((-nu - from) / (to - from)))
    }

    /// Share of the amplitude of the direct ray that reaches `antenna_m` from `satellite_m`.
    pub fn direct(&self, antenna_m: &Vector3<f64>, satellite_m: &Vector3<f64>, carrier: &Carrier) -> f64 {
        let way_m = satellite_m - antenna_m;
        let length_m = way_m.norm();
        let leg = Leg { from_m: *antenna_m, along: way_m / length_m, length_m, behind_m: 0.0, own: [None; 2] };
        self.open(&leg, carrier, &mut |_| ())
    }

    /// Share of the amplitude that passes along a leg; `tested` is told each surface that is held against it.
    fn open(&self, leg: &Leg, carrier: &Carrier, tested: &mut impl FnMut(u32)) -> f64 {
        let mut worst = f64::NEG_INFINITY;
        let enters = |node: &super::tree::Node| {
            let farthest_m = leg.behind_m + node.farthest_m(&leg.from_m);
            let margin_m = -CLEAR_NU * (0.5 * carrier.wavelength_m * farthest_m).sqrt();
            node.meets(&leg.from_m, &leg.along, leg.length_m, margin_m)
        };
        self.rays.walk(enters, |number| {
            tested(number);
            if let Some(nu) = self.shadow_nu(leg, number, carrier) {
                worst = worst.max(nu);
            }
            false
        });
        self.passed(worst)
    }

    /// ν of the shadow of a surface on a leg: positive within it. `None` of a mirror at an end of the leg,
    /// whose edges count where it reflects.
    fn shadow_nu(&self, leg: &Leg, number: u32, carrier: &Carrier) -> Option<f64> {
        if leg.own.contains(&Some(number)) {
            return None;
        }
        let facet = self.facet(number)?;
        let regions = leg.own.map(|own| own.and_then(|own| self.facet(own)).map(|mirror| mirror.region));
        let counts = |edge: &Edge| {
            let is_mirror_s = edge.beyond.is_some_and(|(region, _)| regions.contains(&Some(region)));
            !is_mirror_s && edge.is_outline(&facet.normal, &leg.along)
        };
        // An edge beside or behind the leg's ends is none.
        let nu = |aside_m: f64, ahead_m: f64| match ahead_m > 0.0 && ahead_m < leg.length_m {
            true => carrier.nu(aside_m, leg.behind_m + ahead_m),
            false => f64::INFINITY,
        };
        let nearest = facet.nearest(&leg.from_m, &leg.along, counts, nu);
        Some(if self.crosses(number, &leg.from_m, &leg.along, leg.length_m) { nearest } else { -nearest })
    }

    /// True if no surface lies across the straight line between two positions, mirrors of `own` apart.
    pub fn sees(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>, own: Option<u32>) -> bool {
        let way_m = to_m - from_m;
        let length_m = way_m.norm();
        let along = way_m / length_m;
        let mut is_open = true;
        self.rays.walk(
            |node| node.meets(from_m, &along, length_m, 0.0),
            |number| {
                is_open = own == Some(number) || !self.crosses(number, from_m, &along, length_m);
                !is_open
            },
        );
        is_open
    }

    fn crosses(&self, number: u32, from_m: &Vector3<f64>, along: &Vector3<f64>, length_m: f64) -> bool {
        self.facet(number).is_some_and(|facet| {
            let ahead_m = -facet.above_m(from_m) / facet.normal.dot(along);
            ahead_m > OWN_M && ahead_m < length_m - OWN_M && facet.holds(&(from_m + along * ahead_m))
        })
    }

    /// Calls `found` for each surface that may mirror a wave from the direction `sky` to `at_m`.
    pub fn each_mirror(&self, at_m: &Vector3<f64>, sky: &Vector3<f64>, found: &mut impl FnMut(u32)) {
        self.mirrors.walk(
            |node| node.may_mirror(at_m, sky),
            |number| {
                found(number);
                false
            },
        );
    }

    /// Length of a way beyond the direct one, in metres; `None` if a number is of no surface.
    ///
    /// It is that of the images wherever the mirrors' planes lie, so that it is smooth beyond the life of an
    /// echo.
    pub fn excess_m(&self, mirrors: Mirrors, antenna_m: &Vector3<f64>, satellite_m: &Vector3<f64>) -> Option<f64> {
        let mut image_m = self.facet(mirrors.last)?.image_m(antenna_m);
        if let Some(first) = mirrors.first {
            image_m = self.facet(first)?.image_m(&image_m);
        }
        // |S − I| − |S − A| as the difference of the squares over the sum, which cancels nothing.
        let (direct_m, mirrored_m) = (satellite_m - antenna_m, satellite_m - image_m);
        let squares = (antenna_m - image_m).dot(&(direct_m + mirrored_m));
        Some(squares / (direct_m.norm() + mirrored_m.norm()))
    }

    /// The way by mirrors, if the satellite and the antenna are before all of them; whether the points of
    /// reflection lie on them is not asked here.
    fn way(&self, mirrors: Mirrors, antenna_m: &Vector3<f64>, satellite_m: &Vector3<f64>) -> Option<Way> {
        let excess_m = self.excess_m(mirrors, antenna_m, satellite_m)?;
        let last = self.facet(mirrors.last)?;
        let height_m = Some(last.above_m(antenna_m)).filter(|height_m| *height_m > 0.0)?;
        let image_m = last.image_m(antenna_m);
        // Where the line from a source to an image crosses the mirror between them.
        let crossing = |source_m: &Vector3<f64>, source_above_m: f64, image_m: &Vector3<f64>, below_m: f64| {
            (source_above_m > 0.0).then(|| image_m + (source_m - image_m) * (below_m / (below_m + source_above_m)))
        };
        let Some(number) = mirrors.first else {
            let at_m = crossing(satellite_m, last.above_m(satellite_m), &image_m, height_m)?;
            let (near, far) =
                (Leg::new(antenna_m, &at_m, 0.0), Leg::new(&at_m, satellite_m, (at_m - antenna_m).norm()));
            let (near, far) = (near.with([None, Some(mirrors.last)]), far.with([Some(mirrors.last), None]));
            let bounce =
                Bounce { surface: mirrors.last, at_m, left_m: near.length_m, travel: -far.along, onward: -near.along };
            let (legs, bounces) = ([Some(near), Some(far), None], [Some(bounce), None]);
            return Some(Way { legs, bounces, excess_m, arrives: near.along });
        };
        let first = self.facet(number)?;
        let image_above_m = Some(first.above_m(&image_m)).filter(|height_m| *height_m > 0.0)?;
        let second_m = first.image_m(&image_m);
        let far_m = crossing(satellite_m, first.above_m(satellite_m), &second_m, image_above_m)?;
        let near_m = crossing(&far_m, last.above_m(&far_m), &image_m, height_m)?;
        let near = Leg::new(antenna_m, &near_m, 0.0).with([None, Some(mirrors.last)]);
        let middle = Leg::new(&near_m, &far_m, near.length_m).with([Some(mirrors.last), Some(number)]);
        let far = Leg::new(&far_m, satellite_m, near.length_m + middle.length_m).with([Some(number), None]);
        let bounces = [
            Bounce { surface: number, at_m: far_m, left_m: far.behind_m, travel: -far.along, onward: -middle.along },
            Bounce {
                surface: mirrors.last,
                at_m: near_m,
                left_m: near.length_m,
                travel: -middle.along,
                onward: -near.along,
            },
        ];
        Some(Way {
            legs: [Some(near), Some(middle), Some(far)],
            bounces: bounces.map(Some),
            excess_m,
            arrives: near.along,
        })
    }

    /// Echo by mirrors; `None` where antenna or satellite are behind one of them.
    pub fn echo(
        &self,
        mirrors: Mirrors,
        antenna_m: &Vector3<f64>,
        satellite_m: &Vector3<f64>,
        carrier: &Carrier,
        tested: &mut impl FnMut(u32),
    ) -> Option<Echo> {
        let way = self.way(mirrors, antenna_m, satellite_m)?;
        let from_sky = way.bounces.iter().flatten().next().map(|bounce| -bounce.travel)?;
        let mut field = Field::right(&from_sky);
        for bounce in way.bounces.iter().flatten() {
            let normal = self.facet(bounce.surface)?.normal;
            field = field.reflected(carrier.permittivity, &normal, &bounce.travel, &bounce.onward);
        }
        let [right, left] = field.circular(&way.arrives);
        let field = right + left * carrier.cross;
        let amplitude = field.norm() * self.share(&way, carrier, tested);
        let whole = smooth((amplitude - FLOOR[0]) / (FLOOR[1] - FLOOR[0]));
        Some(Echo { excess_m: way.excess_m, field, amplitude: amplitude * whole })
    }

    /// Share of the amplitude that the mirrors' edges and the walls beside the way leave; 0 below the floor.
    fn share(&self, way: &Way, carrier: &Carrier, tested: &mut impl FnMut(u32)) -> f64 {
        let mut share = 1.0;
        for bounce in way.bounces.iter().flatten() {
            let Some(facet) = self.facet(bounce.surface) else { return 0.0 };
            let nu = |distance_m: f64, ahead_m: f64| carrier.nu(distance_m, bounce.left_m - ahead_m);
            let nearest = facet.nearest(&bounce.at_m, &bounce.onward, |_| true, nu);
            // Height of what is mirrored above the mirror's plane, behind which there is no echo.
            let height_m = bounce.left_m * bounce.onward.dot(&facet.normal);
            share *= smooth(height_m / (GRAZING_WAVES * carrier.wavelength_m));
            share *= self.mirrored(if facet.holds(&bounce.at_m) { nearest } else { -nearest });
            if share < FLOOR[0] {
                return 0.0;
            }
        }
        for leg in way.legs.iter().flatten() {
            share *= self.open(leg, carrier, tested);
            if share < FLOOR[0] {
                return 0.0;
            }
        }
        share
    }
}

impl Leg {
    fn new(from_m: &Vector3<f64>, to_m: &Vector3<f64>, behind_m: f64) -> Self {
        let way_m = to_m - from_m;
        let length_m = way_m.norm();
        Self { from_m: *from_m, along: way_m / length_m.max(OWN_M), length_m, behind_m, own: [None; 2] }
    }

    fn with(self, own: [Option<u32>; 2]) -> Self {
        Self { own, ..self }
    }
}

#[cfg(test)]
mod tests;
