//! Walls and roofs as plane regions bounded by edges.
//!
//! Polygons of one plane that share an edge become one region, so that a wall which a file cuts into
//! triangles has no seam. A region keeps its edges as a list without order: a point is inside where a line
//! from it crosses an odd number of them, which holds for holes and for any orientation. Limits: a polygon
//! that is bent lies in its mean plane; vertices nearer than a millimetre are one.

use std::collections::{BTreeMap, HashMap, HashSet};

use nalgebra::Vector3;

use super::tree::Bounds;
use gnss::cityjson::{Kind, Model};

/// Polygons of less area are left out, in m².
const LEAST_AREA_M2: f64 = 0.01;
/// Polygons belong to one plane where their normals' cosine is nearer to 1 (a milliradian), and their
/// distance is less than this, in metres.
const SAME_TURN: f64 = 5e-7;
const SAME_PLANE_M: f64 = 0.02;

/// Number and normal of a region, if there is one.
pub type Beyond = Option<(u32, Vector3<f64>)>;

/// Edge of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Ends in the coordinates of the plane, in metres.
    ends_m: [[f64; 2]; 2],
    /// Position where the edge begins, in metres.
    from_m: Vector3<f64>,
    /// Unit vector along the edge.
    along: Vector3<f64>,
    /// Length in metres.
    length_m: f64,
    /// Number and normal of the region at the other side of the edge, if there is one.
    pub beyond: Beyond,
}

/// Plane region of a wall or roof.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    /// Unit vector out of the building.
    pub normal: Vector3<f64>,
    /// Distance of the plane from the origin along the normal, in metres.
    pub offset_m: f64,
    /// Bounds of the region.
    pub bounds: Bounds,
    /// Kind of its first polygon.
    pub kind: Kind,
    /// Number of the region, by which edges name it.
    pub region: u32,
    origin_m: Vector3<f64>,
    across: [Vector3<f64>; 2],
    edges: Vec<Edge>,
}

impl Facet {
    /// Height of a position above the plane, in metres; negative behind it.
    pub fn above_m(&self, at_m: &Vector3<f64>) -> f64 {
        self.normal.dot(at_m) - self.offset_m
    }

    /// Mirror image of a position.
    pub fn image_m(&self, at_m: &Vector3<f64>) -> Vector3<f64> {
        at_m - self.normal * (2.0 * self.above_m(at_m))
    }

    /// Coordinates in the plane.
    fn flat_m(&self, at_m: &Vector3<f64>) -> [f64; 2] {
        let from_m = at_m - self.origin_m;
        self.across.map(|axis| axis.dot(&from_m))
    }

    /// True if a point of the plane is inside.
    pub fn holds(&self, at_m: &Vector3<f64>) -> bool {
        self.is_inside(self.flat_m(at_m))
    }

    fn is_inside(&self, [x, y]: [f64; 2]) -> bool {
        let crossed = self.edges.iter().filter(|edge| {
            let [[ax, ay], [bx, by]] = edge.ends_m;
            (ay > y) != (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)
        });
        crossed.count() % 2 == 1
    }

    /// Smallest value of `nu` over the edges for which `counts` is true; infinite without any. It is called
    /// with an edge's distance from the straight line through `from_m` along the unit vector `along`, and
    /// with how far from `from_m` the line is nearest to it, both in metres.
    pub fn nearest(
        &self,
        from_m: &Vector3<f64>,
        along: &Vector3<f64>,
        counts: impl Fn(&Edge) -> bool,
        nu: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let edges = self.edges.iter().filter(|edge| counts(edge));
        let found = edges.map(|edge| {
            let (distance_m, ahead_m) = edge.nearest_m(from_m, along);
            nu(distance_m, ahead_m)
        });
        found.fold(f64::INFINITY, f64::min)
    }

    /// Points of the region on a grid, by which it is seen.
    pub fn samples_m(&self) -> Vec<Vector3<f64>> {
        const STEPS: u32 = 3;
        let ends = self.edges.iter().flat_map(|edge| edge.ends_m);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for end in ends {
            (low, high) = ([low[0].min(end[0]), low[1].min(end[1])], [high[0].max(end[0]), high[1].max(end[1])]);
        }
        let at = |k: u32, axis: usize| low[axis] + (high[axis] - low[axis]) * (f64::from(k) + 0.5) / f64::from(STEPS);
        let grid = (0..STEPS * STEPS).map(|k| [at(k % STEPS, 0), at(k / STEPS, 1)]);
        let inside = grid.filter(|point| self.is_inside(*point));
        inside.map(|[x, y]| self.origin_m + self.across[0] * x + self.across[1] * y).collect()
    }
}

impl Edge {
    /// Distance of the edge from a straight line, and how far along the line that is.
    fn nearest_m(&self, from_m: &Vector3<f64>, along: &Vector3<f64>) -> (f64, f64) {
        let to_m = self.from_m - from_m;
        let slant = self.along.dot(along);
        // The square of the distance from the line is a parabola along the edge.
        let best_m = (slant * to_m.dot(along) - to_m.dot(&self.along)) / (1.0 - slant * slant).max(1e-12);
        let point_m = to_m + self.along * best_m.clamp(0.0, self.length_m);
        let ahead_m = point_m.dot(along);
        ((point_m - along * ahead_m).norm(), ahead_m)
    }

    /// True if the edge bounds what a ray along `along` sees: its two regions do not face the ray alike.
    pub fn is_outline(&self, normal: &Vector3<f64>, along: &Vector3<f64>) -> bool {
        self.beyond.is_none_or(|(_, beyond)| (normal.dot(along) > 0.0) != (beyond.dot(along) > 0.0))
    }
}

/// Polygon of the file in local coordinates.
struct Polygon {
    /// Directed edges between welded vertices.
    edges: Vec<[u32; 2]>,
    /// Twice its area along the normal.
    area: Vector3<f64>,
    middle_m: Vector3<f64>,
    kind: Kind,
}

/// Walls and roofs of a model, in metres east, north and up; `local` gives the position of a vertex, and
/// `keeps` chooses polygons by their lowest and highest corner.
pub fn facets(
    model: &Model,
    local: impl Fn(&[f64; 3]) -> Vector3<f64>,
    keeps: impl Fn(&Vector3<f64>, &Vector3<f64>) -> bool,
) -> Vec<Facet> {
    let (numbers, vertices) = welded(model, local);
    // A polygon that a file has twice would reflect twice.
    let mut known: HashSet<Vec<u32>> = HashSet::new();
    let mut is_new = |rings: &[Vec<u32>]| {
        let mut ring = rings.first().cloned().unwrap_or_default();
        let least = ring.iter().enumerate().min_by_key(|(_, vertex)| **vertex).map_or(0, |(at, _)| at);
        ring.rotate_left(least);
        known.insert(ring)
    };
    let polygons: Vec<Polygon> = model
        .surfaces
        .iter()
        .filter_map(|surface| {
            let rings: Vec<Vec<u32>> = surface.rings.iter().map(|ring| renumbered(ring, &numbers)).collect();
            is_new(&rings).then(|| polygon(&rings, &vertices, surface.kind, &keeps)).flatten()
        })
        .collect();
    let mut owners: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
    for (number, polygon) in polygons.iter().enumerate() {
        for edge in &polygon.edges {
            owners.entry(*edge).or_default().push(number as u32);
        }
    }
    let groups = grouped(&polygons, &owners);
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (number, group) in groups.iter().enumerate() {
        members.entry(*group).or_default().push(number as u32);
    }
    let normals: HashMap<u32, Vector3<f64>> = members
        .iter()
        .map(|(group, all)| {
            let areas = all.iter().filter_map(|k| polygons.get(*k as usize)).map(|polygon| polygon.area);
            (*group, areas.sum::<Vector3<f64>>().normalize())
        })
        .collect();
    let group_of = |polygon: u32| groups.get(polygon as usize).copied().unwrap_or(polygon);
    let region = |(group, all): (&u32, &Vec<u32>)| {
        let own: Vec<&Polygon> = all.iter().filter_map(|k| polygons.get(*k as usize)).collect();
        let normal = *normals.get(group)?;
        let edges: Vec<([u32; 2], Beyond)> = own
            .iter()
            .flat_map(|polygon| &polygon.edges)
            .filter_map(|&[a, b]| {
                let others = owners.get(&[b, a]).map_or(&[][..], Vec::as_slice);
                // Two polygons of the region meet there.
                if others.iter().any(|other| group_of(*other) == *group) {
                    return None;
                }
                let beyond = others.first().map(|other| group_of(*other));
                let beyond = beyond.and_then(|group| Some((group, *normals.get(&group)?)));
                Some(([a, b], beyond))
            })
            .collect();
        facet(&edges, &vertices, normal, (own.first()?.kind, *group))
    };
    members.iter().filter_map(region).collect()
}

/// New number of each vertex, vertices at one position sharing one, and their positions.
fn welded(model: &Model, local: impl Fn(&[f64; 3]) -> Vector3<f64>) -> (Vec<u32>, Vec<Vector3<f64>>) {
    let mut known: HashMap<[i64; 3], u32> = HashMap::new();
    let mut vertices = Vec::new();
    let numbers = model.vertices_m.iter().map(|vertex| {
        *known.entry(vertex.map(|x| (x * 1e3).round() as i64)).or_insert_with(|| {
            vertices.push(local(vertex));
            vertices.len() as u32 - 1
        })
    });
    (numbers.collect(), vertices)
}

fn renumbered(ring: &[u32], numbers: &[u32]) -> Vec<u32> {
    let mut new: Vec<u32> = ring.iter().filter_map(|vertex| numbers.get(*vertex as usize).copied()).collect();
    new.dedup();
    while new.len() > 1 && new.first() == new.last() {
        new.pop();
    }
    new
}

fn polygon(
    rings: &[Vec<u32>],
    vertices: &[Vector3<f64>],
    kind: Kind,
    keeps: impl Fn(&Vector3<f64>, &Vector3<f64>) -> bool,
) -> Option<Polygon> {
    let outer: Vec<Vector3<f64>> = rings.first()?.iter().filter_map(|k| vertices.get(*k as usize).copied()).collect();
    let first = *outer.first()?;
    let (low_m, high_m) = outer.iter().fold((first, first), |(low, high), at| (low.inf(at), high.sup(at)));
    // Newell's normal: the sum of the triangles from the first corner, exact for a plane polygon of any
    // shape.
    let area = outer.windows(2).fold(Vector3::zeros(), |sum: Vector3<f64>, pair| match pair {
        [a, b] => sum + (a - first).cross(&(b - first)),
        _ => sum,
    });
    if !(area.norm() > 2.0 * LEAST_AREA_M2 && keeps(&low_m, &high_m)) {
        return None;
    }
    let edges = rings.iter().filter(|ring| ring.len() >= 3).flat_map(|ring| {
        let next = ring.iter().cycle().skip(1);
        ring.iter().zip(next).map(|(a, b)| [*a, *b])
    });
    let middle_m = outer.iter().sum::<Vector3<f64>>() / outer.len() as f64;
    Some(Polygon { edges: edges.collect(), area, middle_m, kind })
}

/// Number of the first polygon of each polygon's region.
fn grouped(polygons: &[Polygon], owners: &HashMap<[u32; 2], Vec<u32>>) -> Vec<u32> {
    fn root(parents: &mut [u32], mut at: u32) -> u32 {
        while let Some(parent) = parents.get(at as usize).copied().filter(|parent| *parent != at) {
            at = parent;
        }
        at
    }
    let mut parents: Vec<u32> = (0..polygons.len() as u32).collect();
    for (number, one) in (0..).zip(polygons) {
        for &[a, b] in &one.edges {
            for other in owners.get(&[b, a]).into_iter().flatten() {
                let Some(neighbour) = polygons.get(*other as usize) else { continue };
                let (mine, theirs) = (one.area.normalize(), neighbour.area.normalize());
                let off_m = mine.dot(&(neighbour.middle_m - one.middle_m)).abs();
                if mine.dot(&theirs) > 1.0 - SAME_TURN && off_m < SAME_PLANE_M {
                    let (a, b) = (root(&mut parents, number), root(&mut parents, *other));
                    if let Some(parent) = parents.get_mut(a.max(b) as usize) {
                        *parent = a.min(b);
                    }
                }
            }
        }
    }
    (0..polygons.len() as u32).map(|number| root(&mut parents, number)).collect()
}

fn facet(
    edges: &[([u32; 2], Beyond)],
    vertices: &[Vector3<f64>],
    normal: Vector3<f64>,
    (kind, region): (Kind, u32),
) -> Option<Facet> {
    let at = |k: u32| vertices.get(k as usize).copied();
    let corners: Vec<Vector3<f64>> = edges.iter().filter_map(|([a, _], _)| at(*a)).collect();
    let origin_m = *corners.first()?;
    // Mean over the corners, counted from one of them.
    let mean_m = corners.iter().map(|corner| normal.dot(&(corner - origin_m))).sum::<f64>() / corners.len() as f64;
    let origin_m = origin_m + normal * mean_m;
    let level = Vector3::z().cross(&normal);
    let first = if level.norm() > 1e-6 { level.normalize() } else { Vector3::x() };
    let across = [first, normal.cross(&first)];
    let flat_m = |point: &Vector3<f64>| across.map(|axis: Vector3<f64>| axis.dot(&(point - origin_m)));
    let (low_m, high_m) =
        corners.iter().fold((corners[0], corners[0]), |(low, high), corner| (low.inf(corner), high.sup(corner)));
    let edges = edges.iter().filter_map(|([a, b], beyond)| {
        let (from, to) = (at(*a)?, at(*b)?);
        let length_m = (to - from).norm();
        let along = (to - from) / length_m;
        Some(Edge { ends_m: [flat_m(&from), flat_m(&to)], from_m: from, along, length_m, beyond: *beyond })
    });
    let edges = edges.collect();
    let bounds = Bounds { low_m, high_m, normal };
    Some(Facet { normal, offset_m: normal.dot(&origin_m), bounds, kind, region, origin_m, across, edges })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::cityjson;

    /// A wall of 10 m by 6 m that faces south, cut into triangles, and a house of 4 m beside it.
    const WALL: &str = r#"{"type":"CityJSON","version":"1.1","transform":{"scale":[1,1,1],"translate":[0,0,0]},
        "CityObjects":{"w":{"type":"Building","geometry":[{"type":"MultiSurface","lod":"1",
        "boundaries":[[[0,1,2]],[[0,2,3]],[[3,2,4,5]]]}]}},
        "vertices":[[0,0,0],[10,0,0],[10,0,6],[0,0,6],[10,5,6],[0,5,6]]}"#;

    fn all() -> Vec<Facet> {
        facets(&cityjson::read(WALL.as_bytes(), "w", None).unwrap(), |v| Vector3::from(*v), |_, _| true)
    }

    fn nearest_m(facet: &Facet, from_m: Vector3<f64>, along: Vector3<f64>) -> f64 {
        facet.nearest(&from_m, &along, |_| true, |distance_m, _| distance_m)
    }

    #[test]
    fn triangles_of_a_wall_become_one_region_without_a_seam() {
        let all = all();
        assert_eq!(all.len(), 2);
        let wall = &all[0];
        assert_eq!((wall.normal, wall.edges.len()), (-Vector3::y(), 4));
        assert!(wall.offset_m.abs() < 1e-12);
        // On the cut between the triangles, 3 m from the top and bottom.
        let depth_m = nearest_m(wall, Vector3::new(5.0, 0.0, 3.0), Vector3::y());
        assert!((depth_m - 3.0).abs() < 1e-12, "{depth_m}");
        let outside_m = nearest_m(wall, Vector3::new(-3.0, 0.0, 10.0), Vector3::y());
        assert!((outside_m - 5.0).abs() < 1e-12, "{outside_m}");
        assert!(wall.holds(&Vector3::new(5.0, 0.0, 3.0)) && !wall.holds(&Vector3::new(-3.0, 0.0, 10.0)));
    }

    #[test]
    fn a_slanting_ray_is_nearer_to_an_edge_than_its_crossing() {
        let wall = &all()[0];
        // 45° from above: the top edge is 1 m up in the plane, and √½ m from the ray.
        let along = Vector3::new(0.0, 1.0, 1.0).normalize();
        let depth_m = nearest_m(wall, Vector3::new(5.0, 0.0, 5.0), along);
        assert!((depth_m - 0.5_f64.sqrt()).abs() < 1e-12, "{depth_m}");
        // From 7 m before the crossing it is nearest 7 m and √½ on: the edge is above the crossing.
        let ahead_m = wall.nearest(
            &(Vector3::new(5.0, 0.0, 5.0) - along * 7.0),
            &along,
            |_| true,
            |distance_m, ahead_m| {
                if distance_m < 1.0 { ahead_m } else { f64::INFINITY }
            },
        );
        assert!((ahead_m - 7.0 - 0.5_f64.sqrt()).abs() < 1e-12, "{ahead_m}");
    }

    #[test]
    fn an_edge_between_two_faces_that_a_ray_enters_is_no_outline() {
        let wall = &all()[0];
        let roof =
            wall.edges.iter().find(|edge| edge.beyond.is_some_and(|(_, normal)| normal == Vector3::z())).unwrap();
        // From below the roof is behind the wall's top; from above both are entered.
        assert!(roof.is_outline(&wall.normal, &Vector3::new(0.0, 0.8, 0.6)));
        assert!(!roof.is_outline(&wall.normal, &Vector3::new(0.0, 0.8, -0.6)));
        assert_eq!(wall.edges.iter().filter(|edge| edge.beyond.is_none()).count(), 3);
    }

    #[test]
    fn samples_lie_inside() {
        for facet in all() {
            let samples = facet.samples_m();
            assert_eq!(samples.len(), 9);
            assert!(samples.iter().all(|at| facet.holds(at) && facet.above_m(at).abs() < 1e-9));
        }
    }
}
