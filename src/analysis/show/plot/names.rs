//! Positions of the names of points in a chart: beside their points, off each other, inside of the axes.

/// Distance from a point to a name at its side, and between two names, in virtual pixels.
const BESIDE: i32 = 36;
const APART: i32 = 4;

/// Name of a point, in virtual pixels.
pub(super) struct Name {
    /// The point.
    pub at: (i32, i32),
    /// Height above the point at which the name is wanted; below it if negative.
    pub above: i32,
    /// Width and height of the text.
    pub size: (i32, i32),
}

/// A rectangle: left, top, right, bottom.
type Rectangle = [i32; 4];

impl Name {
    /// Left end and middle height of the text in the order in which they are tried: as wanted, at the left of
    /// that, on the other side of the point, beside it, and farther away.
    fn positions(&self) -> impl Iterator<Item = (i32, i32)> {
        let ((x, y), (width, height), above) = (self.at, self.size, self.above);
        let left = x - width + 8;
        let near = [(x - 8, y - above), (left, y - above), (x - 8, y + above), (left, y + above)];
        let beside = [(x + BESIDE, y), (x - BESIDE - width, y)];
        let step = (height + APART) * above.signum();
        let far = (1..16).flat_map(move |k| {
            [x - 8, left].into_iter().flat_map(move |x| [(x, y - above - k * step), (x, y + above + k * step)])
        });
        near.into_iter().chain(beside).chain(far)
    }

    fn covered(&self, (x, y): (i32, i32)) -> Rectangle {
        let (width, height) = self.size;
        [x, y - height / 2, x + width, y + height / 2]
    }
}

/// Left end and middle height of each name, so that no two overlap; `corners` are the upper left and lower
/// right ends of the axes. A name that finds no room stands where it is wanted.
pub(super) fn apart(names: &[Name], corners: [(i32, i32); 2]) -> Vec<(i32, i32)> {
    let [(from, top), (to, bottom)] = corners;
    let mut taken: Vec<Rectangle> = Vec::new();
    let mut found = Vec::new();
    for name in names {
        let free = |at: &(i32, i32)| {
            let own = name.covered(*at);
            own[1] >= top && own[3] <= bottom && !taken.iter().any(|one| meet(one, &own))
        };
        let within = |(x, y): (i32, i32)| (x.clamp(from, from.max(to - name.size.0)), y);
        let at = name.positions().map(within).find(free).or_else(|| name.positions().next()).unwrap_or(name.at);
        taken.push(name.covered(at));
        found.push(at);
    }
    found
}

/// True if two rectangles are less than [`APART`] from each other.
fn meet(a: &Rectangle, b: &Rectangle) -> bool {
    a[0] < b[2] + APART && b[0] < a[2] + APART && a[1] < b[3] + APART && b[1] < a[3] + APART
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_close_points_stand_apart_and_inside_of_the_axes() {
        let name = |x: i32, y: i32, above: i32| Name { at: (x, y), above, size: (240, 44) };
        // Six points within a name's width of each other, at an edge and at a corner.
        let corners = [(0, 0), (2000, 1200)];
        for (x, y) in [(1000, 600), (1990, 600), (10, 10), (1990, 1190)] {
            let names: Vec<Name> = (0..6).map(|k| name(x - 2 * k, y + k, if k % 2 == 0 { 44 } else { -44 })).collect();
            let boxes: Vec<Rectangle> = names.iter().zip(apart(&names, corners)).map(|(n, at)| n.covered(at)).collect();
            for (number, own) in boxes.iter().enumerate() {
                assert!(own[0] >= 0 && own[2] <= 2000 && own[1] >= 0 && own[3] <= 1200, "{own:?}");
                assert!(boxes.iter().skip(number + 1).all(|other| !meet(own, other)), "{x} {y}: {boxes:?}");
            }
        }
    }

    #[test]
    fn a_name_alone_stands_where_it_is_wanted() {
        let names = [Name { at: (500, 500), above: 44, size: (240, 44) }];
        assert_eq!(apart(&names, [(0, 0), (2000, 1200)]), [(492, 456)]);
    }
}
