//! Clipping of series to their axes: nothing is drawn over titles, labels and other charts.

/// A rectangle in data units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    x: (f64, f64),
    y: (f64, f64),
}

impl Frame {
    /// A frame between the ends of both axes.
    pub fn new(x: (f64, f64), y: (f64, f64)) -> Self {
        Self { x, y }
    }

    /// True if a point lies inside the frame or on its edge.
    pub fn holds(&self, (x, y): (f64, f64)) -> bool {
        (self.x.0..=self.x.1).contains(&x) && (self.y.0..=self.y.1).contains(&y)
    }

    /// The nearest point inside.
    pub fn nearest(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (x.clamp(self.x.0, self.x.1), y.clamp(self.y.0, self.y.1))
    }

    /// Pieces of a line through points, each inside from its first point to its last.
    pub fn pieces(&self, points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
        let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
        for pair in points.windows(2) {
            let &[a, b] = pair else { continue };
            let Some((first, last)) = self.inside(a, b) else { continue };
            match pieces.last_mut() {
                Some(piece) if first == a && piece.last() == Some(&first) => piece.push(last),
                _ => pieces.push(vec![first, last]),
            }
        }
        pieces
    }

    /// The part of a segment that lies inside (Liang and Barsky 1984).
    fn inside(&self, a: (f64, f64), b: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (from, to, (low, high)) in [(a.0, b.0, self.x), (a.1, b.1, self.y)] {
            let along = to - from;
            if along == 0.0 {
                if from < low || from > high {
                    return None;
                }
                continue;
            }
            let (first, last) = ((low - from) / along, (high - from) / along);
            enter = enter.max(first.min(last));
            leave = leave.min(first.max(last));
        }
        let at = |share: f64| self.nearest((a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1)));
        let first = if enter == 0.0 { a } else { at(enter) };
        let last = if leave == 1.0 { b } else { at(leave) };
        (enter <= leave).then_some((first, last))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_cut_where_it_leaves_and_goes_on_where_it_comes_back() {
        let frame = Frame { x: (0.0, 10.0), y: (-1.0, 1.0) };
        let pieces = frame.pieces(&[(0.0, 0.0), (2.0, 0.5), (4.0, 4.5), (6.0, -3.5), (8.0, 0.5), (12.0, 0.5)]);
        let expected = [
            vec![(0.0, 0.0), (2.0, 0.5), (2.25, 1.0)],
            vec![(4.875, 1.0), (5.375, -1.0)],
            vec![(7.25, -1.0), (8.0, 0.5), (10.0, 0.5)],
        ];
        assert_eq!(pieces, expected);
        assert!(frame.pieces(&[(0.0, 2.0), (10.0, 3.0)]).is_empty());
    }
}
