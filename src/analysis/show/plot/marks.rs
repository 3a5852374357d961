//! Colours and marks of numbered series: no two of a picture look alike.

use plotters::style::RGBColor;

/// Colours that colour-blind people distinguish (Okabe and Ito 2008), without its yellow, too pale on white.
pub const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];
/// The first colour, of estimates.
pub const BLUE: RGBColor = COLOURS[0];
/// The second colour, of limits and of what is to be noticed.
pub const ORANGE: RGBColor = COLOURS[1];
/// The third colour, of the truth and of theory.
pub const GREEN: RGBColor = COLOURS[2];
/// Colour of the background's elements.
pub const GREY: RGBColor = RGBColor(120, 120, 120);
pub(super) const LIGHT: RGBColor = RGBColor(225, 225, 225);

/// Form in which a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// A solid line through the points.
    Line,
    /// A thin dashed line.
    Dash,
    /// A thin line of dashes so many pixels long and so many apart.
    Dashes(i32, i32),
    /// Small filled dots.
    Dots,
    /// Hollow dots.
    Rings,
    /// Small marks of that shape.
    Small(Shape),
    /// A larger cross.
    Cross,
    /// Larger dots.
    Balls,
    /// Larger marks of that shape.
    Large(Shape),
    /// Bars from zero, of that width in data units.
    Bars(f64),
    /// The area inside the points, pale.
    Band,
    /// Filled rectangles about the points, of that width and height in data units.
    Tile(f64, f64),
}

/// Outline of a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A filled polygon with these corners, in eighths of its radius.
    Filled(&'static [(i32, i32)]),
    /// Outline of a polygon.
    Hollow(&'static [(i32, i32)]),
    /// Strokes from each pair of these points to the other.
    Strokes(&'static [[(i32, i32); 2]]),
}

const SQUARE: &[(i32, i32)] = &[(-7, -7), (7, -7), (7, 7), (-7, 7)];
const TRIANGLE: &[(i32, i32)] = &[(0, -10), (9, 6), (-9, 6)];
const DIAMOND: &[(i32, i32)] = &[(0, -11), (9, 0), (0, 11), (-9, 0)];
const WEDGE: &[(i32, i32)] = &[(0, 10), (9, -6), (-9, -6)];

/// Shapes of numbered marks after the filled and the hollow disc.
const SHAPES: [Shape; 10] = [
    Shape::Filled(SQUARE),
    Shape::Strokes(&[[(-8, -8), (8, 8)], [(-8, 8), (8, -8)]]),
    Shape::Filled(TRIANGLE),
    Shape::Hollow(SQUARE),
    Shape::Strokes(&[[(-10, 0), (10, 0)], [(0, -10), (0, 10)]]),
    Shape::Filled(DIAMOND),
    Shape::Hollow(TRIANGLE),
    Shape::Filled(WEDGE),
    Shape::Hollow(DIAMOND),
    Shape::Hollow(WEDGE),
];

/// Patterns of numbered lines.
const PATTERNS: [Mark; 5] = [Mark::Line, Mark::Dash, Mark::Dashes(2, 3), Mark::Dashes(16, 4), Mark::Dashes(4, 10)];

/// The colour of a numbered series, paler each time that colours and marks begin again.
fn colour(index: usize, marks: usize) -> RGBColor {
    let RGBColor(r, g, b) = COLOURS[index % COLOURS.len()];
    let cycle = (index / (COLOURS.len() * marks)) as i32;
    // Towards a grey that none of the colours is.
    let share = libm::pow(0.62, f64::from(cycle));
    let mixed = |value: u8| (150.0 + (f64::from(value) - 150.0) * share).round() as u8;
    if cycle == 0 { RGBColor(r, g, b) } else { RGBColor(mixed(r), mixed(g), mixed(b)) }
}

/// Colour and small mark of a numbered series: colours first, then the same colours in another shape.
pub(super) fn numbered(index: usize) -> (RGBColor, Mark) {
    let mark = match (index / COLOURS.len()) % (SHAPES.len() + 2) {
        0 => Mark::Dots,
        1 => Mark::Rings,
        shape => Mark::Small(SHAPES[shape - 2]),
    };
    (colour(index, SHAPES.len() + 2), mark)
}

/// Colour and large mark of a numbered series.
pub(super) fn large(index: usize) -> (RGBColor, Mark) {
    let mark = match (index / COLOURS.len()) % (SHAPES.len() + 1) {
        0 => Mark::Balls,
        shape => Mark::Large(SHAPES[shape - 1]),
    };
    (colour(index, SHAPES.len() + 1), mark)
}

/// Colour and pattern of a numbered line.
pub(super) fn lined(index: usize) -> (RGBColor, Mark) {
    (colour(index, PATTERNS.len()), PATTERNS[(index / COLOURS.len()) % PATTERNS.len()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_of_two_hundred_series_look_alike() {
        for of in [numbered, large, lined] {
            let mut seen: Vec<(RGBColor, Mark)> = Vec::new();
            for index in 0..200 {
                let look = of(index);
                assert!(!seen.contains(&look), "number {index} looks like one before it");
                seen.push(look);
            }
        }
    }

    #[test]
    fn no_small_mark_is_paler_than_its_background() {
        // Luminance by ITU-R BT.601; white has 255.
        let luminance = |RGBColor(r, g, b)| 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
        assert!((0..200).all(|index| luminance(numbered(index).0) < 185.0));
    }
}
