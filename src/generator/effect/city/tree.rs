//! Tree of boxes over surfaces, so that a ray or a mirror image is held against few of them.
//!
//! Each node bounds positions and normals of its surfaces. It is split at the median of the widest of six
//! directions: three of space, and three of the normal, which count as `turn_m` metres a unit. With 0 it is
//! an ordinary hierarchy of boxes for rays; with more, surfaces that look alike stay together, which finds
//! mirrors.

use nalgebra::Vector3;

/// Surfaces in a leaf.
const LEAF: usize = 2;
/// Nodes that wait while the tree is walked: two a level, and medians make at most 32 levels.
const WAITING: usize = 72;

/// Bounds of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner, in metres.
    pub low_m: Vector3<f64>,
    /// Highest corner, in metres.
    pub high_m: Vector3<f64>,
    /// Unit vector out of the surface.
    pub normal: Vector3<f64>,
}

/// Node of the tree.
#[derive(Clone, Debug)]
pub struct Node {
    /// Lowest corner, in metres.
    pub low_m: Vector3<f64>,
    /// Highest corner, in metres.
    pub high_m: Vector3<f64>,
    /// Middle of the normals, of any length.
    normal: Vector3<f64>,
    /// Largest distance of a normal from the middle.
    spread: f64,
    content: Content,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    Leaf(u32, u32),
    Fork(u32, u32),
}

/// Tree over surfaces.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Tree {
    /// Builds the tree over surfaces, whose numbers are their positions in `all`.
    pub fn new(all: &[Bounds], turn_m: f64) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..all.len() as u32).collect() };
        if !all.is_empty() {
            tree.grow(all, turn_m, 0, all.len());
        }
        tree
    }

    fn grow(&mut self, all: &[Bounds], turn_m: f64, from: usize, to: usize) -> u32 {
        let own: Vec<&Bounds> =
            self.order.get(from..to).unwrap_or_default().iter().filter_map(|k| all.get(*k as usize)).collect();
        let (mut low_m, mut high_m) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let (mut least, mut most) = (low_m, high_m);
        for bounds in &own {
            (low_m, high_m) = (low_m.inf(&bounds.low_m), high_m.sup(&bounds.high_m));
            (least, most) = (least.inf(&bounds.normal), most.sup(&bounds.normal));
        }
        let normal = (least + most) * 0.5;
        let spread = own.iter().map(|bounds| (bounds.normal - normal).norm()).fold(0.0, f64::max);
        let number = self.nodes.len() as u32;
        self.nodes.push(Node { low_m, high_m, normal, spread, content: Content::Leaf(from as u32, to as u32) });
        if to - from <= LEAF {
            return number;
        }
        let sizes = [high_m - low_m, (most - least) * turn_m];
        let widest = (0..6).fold((0, -1.0), |best, axis| {
            let size = sizes[axis / 3][axis % 3];
            if size > best.1 { (axis, size) } else { best }
        });
        let key = |k: &u32| {
            all.get(*k as usize).map_or(0.0, |bounds| match widest.0 {
                axis @ 0..=2 => bounds.low_m[axis] + bounds.high_m[axis],
                axis => bounds.normal[axis - 3],
            })
        };
        let middle = (from + to) / 2;
        if let Some(part) = self.order.get_mut(from..to) {
            part.sort_unstable_by(|a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        }
        let left = self.grow(all, turn_m, from, middle);
        let right = self.grow(all, turn_m, middle, to);
        if let Some(node) = self.nodes.get_mut(number as usize) {
            node.content = Content::Fork(left, right);
        }
        number
    }

    /// Walks the tree: `enters` says whether a node may hold what is sought, and `take` gets the numbers of
    /// the surfaces there until it returns true.
    pub fn walk(&self, mut enters: impl FnMut(&Node) -> bool, mut take: impl FnMut(u32) -> bool) {
        let (mut waiting, mut count) = ([0_u32; WAITING], 1);
        while count > 0 {
            count -= 1;
            let Some(node) = waiting.get(count).and_then(|number| self.nodes.get(*number as usize)) else { continue };
            if !enters(node) {
                continue;
            }
            match node.content {
                Content::Leaf(from, to) => {
                    for surface in self.order.get(from as usize..to as usize).unwrap_or_default() {
                        if take(*surface) {
                            return;
                        }
                    }
                }
                Content::Fork(left, right) => {
                    for next in [right, left] {
                        if let Some(free) = waiting.get_mut(count) {
                            *free = next;
                            count += 1;
                        }
                    }
                }
            }
        }
    }
}

impl Node {
    /// True if a segment from `from_m` along the unit vector `along`, `length_m` long, passes the node within
    /// `margin_m`.
    pub fn meets(&self, from_m: &Vector3<f64>, along: &Vector3<f64>, length_m: f64, margin_m: f64) -> bool {
        let (mut enter_m, mut leave_m) = (0.0_f64, length_m);
        for axis in 0..3 {
            let (low_m, high_m) =
                (self.low_m[axis] - margin_m - from_m[axis], self.high_m[axis] + margin_m - from_m[axis]);
            if along[axis].abs() < 1e-12 {
                if low_m > 0.0 || high_m < 0.0 {
                    return false;
                }
                continue;
            }
            let (a_m, b_m) = (low_m / along[axis], high_m / along[axis]);
            enter_m = enter_m.max(a_m.min(b_m));
            leave_m = leave_m.min(a_m.max(b_m));
        }
        enter_m <= leave_m
    }

    /// Distance of the farthest point of the node at most, from a position.
    pub fn farthest_m(&self, from_m: &Vector3<f64>) -> f64 {
        let (middle_m, half_m) = ((self.low_m + self.high_m) * 0.5, (self.high_m - self.low_m) * 0.5);
        (middle_m - from_m).norm() + half_m.norm()
    }

    /// False if no surface of the node can mirror a wave from the direction `sky` (a unit vector) to `at_m`.
    ///
    /// A mirror's normal halves the angle between the sky and the way back, s − u with u from the antenna to
    /// the mirror. Over the node u stays within δ of that to its middle, and so the normal within √2·δ/|s −
    /// u|.
    pub fn may_mirror(&self, at_m: &Vector3<f64>, sky: &Vector3<f64>) -> bool {
        let (middle_m, half_m) = ((self.low_m + self.high_m) * 0.5, ((self.high_m - self.low_m) * 0.5).norm());
        let there_m = middle_m - at_m;
        let distance_m = there_m.norm();
        if distance_m <= half_m {
            return true;
        }
        let turned = std::f64::consts::SQRT_2 * half_m / distance_m;
        let halved = sky - there_m / distance_m;
        let size = halved.norm();
        if size <= turned {
            return true;
        }
        let off = (halved / size - self.normal).norm();
        // A satellite is not at infinity, and planes are of coordinates in millimetres.
        off <= self.spread + std::f64::consts::SQRT_2 * turned / size + 2e-3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of a size about a grid, whose normals take four directions in turn.
    fn boxes(count: usize) -> Vec<Bounds> {
        let directions = [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()];
        (0..count)
            .map(|k| {
                let low_m = Vector3::new(10.0 * (k % 30) as f64, 10.0 * (k / 30) as f64, 0.0);
                Bounds { low_m, high_m: low_m + Vector3::new(4.0, 4.0, 10.0), normal: directions[k % 4] }
            })
            .collect()
    }

    #[test]
    fn every_surface_is_found_once() {
        for (count, turn_m) in [(0, 0.0), (1, 0.0), (2, 40.0), (3, 0.0), (1000, 0.0), (1000, 40.0)] {
            let tree = Tree::new(&boxes(count), turn_m);
            let mut found = Vec::new();
            tree.walk(
                |_| true,
                |k| {
                    found.push(k);
                    false
                },
            );
            found.sort_unstable();
            assert_eq!(found, (0..count as u32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn no_box_that_a_segment_meets_is_missed() {
        let all = boxes(400);
        let tree = Tree::new(&all, 0.0);
        for k in 0..200 {
            let turn = 0.37 * f64::from(k);
            let (sin, cos) = libm::sincos(turn);
            let from_m = Vector3::new(150.0 + 20.0 * cos, 60.0 - 30.0 * sin, 1.5);
            let along = Vector3::new(sin, cos, 0.1 * f64::from(k % 5)).normalize();
            let mut found = Vec::new();
            tree.walk(
                |node| node.meets(&from_m, &along, 120.0, 0.5),
                |k| {
                    found.push(k);
                    false
                },
            );
            for (number, bounds) in all.iter().enumerate() {
                let inside = |t_m: f64| {
                    let p = from_m + along * t_m;
                    (0..3).all(|axis| p[axis] >= bounds.low_m[axis] && p[axis] <= bounds.high_m[axis])
                };
                let is_met = (0..1200).any(|t| inside(0.1 * f64::from(t)));
                assert!(!is_met || found.contains(&(number as u32)), "{number} from {from_m}");
            }
        }
    }
}
