//! Sky as data and as it is drawn: tracks of satellites about the zenith, coloured by their strength.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::show::plot::canvas::{Area, Drawing, FINE, Failure, GREY, WIDTH_PX, anchored};
use crate::show::plot::ticks::{self, Tick};
use gnss::satellite::{Sv, System};

/// Position and size of the sky on its picture.
#[derive(Clone, Copy, Debug)]
pub struct Dome {
    size_px: (i32, i32),
    centre_px: (i32, i32),
    radius_px: i32,
    /// Left end and upper end of the colours' scale.
    scale_px: Option<(i32, i32)>,
}

/// Sky as wide as a page's text.
pub const WIDE: Dome =
    Dome { size_px: (WIDTH_PX as i32, 490), centre_px: (290, 255), radius_px: 195, scale_px: Some((580, 80)) };
/// Sky half as wide, beside another picture.
pub const NARROW: Dome = Dome { size_px: (340, 340), centre_px: (170, 158), radius_px: 108, scale_px: None };

/// A satellite's way over the sky.
#[derive(Clone, Debug)]
pub struct Track {
    pub sv: Sv,
    /// Positions in virtual pixels; successive ones differ.
    pub places: Vec<(i32, i32)>,
    pub cn0_dbhz: Option<f64>,
    pub observed: bool,
}

/// Satellites above the horizon.
#[derive(Clone, Debug)]
pub struct Sky {
    pub dome: Dome,
    pub tracks: Vec<Track>,
    /// Azimuths and elevations of obstructions at the start, degrees.
    pub skyline_deg: Vec<[f64; 2]>,
}

impl Sky {
    /// The sky as a picture.
    ///
    /// # Errors
    /// Errors of the drawing library.
    pub fn draw(&self) -> Result<Drawing, Failure> {
        let (width, height) = self.dome.size_px;
        Drawing::new((width as u32, height as u32), |area| tracked(area, self.dome, &self.tracks, &self.skyline_deg))
    }

    /// Lower and upper end of the scale of C/N0, dB-Hz.
    pub fn scale_dbhz(&self) -> (f64, f64) {
        scale_of(&self.tracks)
    }

    /// Positions of a track about the zenith: east and north, 1 at the horizon.
    pub fn plan<'a>(&'a self, track: &'a Track) -> impl Iterator<Item = (f64, f64)> + 'a {
        let ((x, y), radius) = (self.dome.centre(), f64::from(self.dome.radius_px * FINE));
        track.places.iter().map(move |(a, b)| (f64::from(a - x) / radius, f64::from(y - b) / radius))
    }
}

fn scale_of(tracks: &[Track]) -> (f64, f64) {
    let strengths = || tracks.iter().filter_map(|track| track.cn0_dbhz);
    let low = strengths().fold(f64::INFINITY, f64::min).floor();
    let high = strengths().fold(f64::NEG_INFINITY, f64::max).ceil();
    match low < high {
        true => (low, high),
        // All alike: a decibel on either side.
        false if low.is_finite() => (low - 1.0, high + 1.0),
        false => (30.0, 50.0),
    }
}

fn tracked(area: &Area<'_>, dome: Dome, tracks: &[Track], skyline_deg: &[[f64; 2]]) -> Result<(), Failure> {
    let (low, high) = scale_of(tracks);
    let mut systems: Vec<System> = tracks.iter().map(|track| track.sv.system).collect();
    systems.sort_unstable();
    systems.dedup();
    obstructed(area, dome, skyline_deg)?;
    frame(area, dome)?;
    if let Some(corner_px) = dome.scale_px.filter(|_| tracks.iter().any(|track| track.cn0_dbhz.is_some())) {
        scale(area, corner_px, low, high)?;
    }
    let mut ends = Vec::new();
    for Track { sv, places, cn0_dbhz, observed } in tracks {
        let colour = cn0_dbhz.map_or(GREY, |cn0| shade(cn0, low, high));
        let Some(&end) = places.last() else { continue };
        area.draw(&PathElement::new(places.clone(), colour.stroke_width(3 * FINE as u32)))?;
        let inside = if *observed { colour } else { WHITE };
        dot(area, end, systems.iter().position(|system| *system == sv.system).unwrap_or(0), (inside, colour))?;
        ends.push((*sv, end));
    }
    for ((sv, end), spot) in ends.iter().zip(names(dome, tracks)) {
        if spot.is_far() {
            area.draw(&PathElement::new([*end, spot.middle], GREY.stroke_width(FINE as u32)))?;
            area.draw(&Rectangle::new(spot.corners(), WHITE.filled()))?;
        }
        area.draw(&Text::new(sv.to_string(), spot.middle, anchored(14, HPos::Center, VPos::Center)))?;
    }
    let note = anchored(12, HPos::Left, VPos::Center);
    let shaded = if skyline_deg.is_empty() { "" } else { "; shaded: obstructed at the start" };
    let mut lines = vec![format!("filled: observed by the receiver{shaded}")];
    if systems.len() > 1 {
        let shapes = systems.iter().zip(SHAPES).map(|(system, (shape, _))| format!("{shape}: {system}"));
        lines.push(shapes.collect::<Vec<_>>().join("; "));
    }
    if dome.scale_px.is_none() && tracks.iter().any(|track| track.cn0_dbhz.is_some()) {
        lines.insert(0, format!("C/N0 {low:.0} (dark) to {high:.0} dB-Hz (light)"));
    }
    for (line, above) in lines.into_iter().rev().zip([12, 28, 44]) {
        area.draw(&Text::new(line, (14 * FINE, (dome.size_px.1 - above) * FINE), note.clone()))?;
    }
    Ok(())
}

/// The dots of the first system, the second, and so on: one for each that there is. Corners are in eighths of
/// a circle's radius and give about a circle's area; the circle has none.
const SHAPES: [(&str, &[(i32, i32)]); 7] = [
    ("circles", &[]),
    ("squares", &[(-7, -7), (7, -7), (7, 7), (-7, 7)]),
    ("diamonds", &[(0, -10), (10, 0), (0, 10), (-10, 0)]),
    ("triangles", &[(0, -10), (9, 6), (-9, 6)]),
    ("triangles down", &[(0, 10), (9, -6), (-9, -6)]),
    ("bars", &[(-11, -4), (11, -4), (11, 4), (-11, 4)]),
    ("posts", &[(-4, -11), (4, -11), (4, 11), (-4, 11)]),
];

/// A satellite's dot in the shape of its system: colours inside and of its rim.
fn dot(area: &Area<'_>, (x, y): (i32, i32), system: usize, (inside, rim): (RGBColor, RGBColor)) -> Result<(), Failure> {
    let (_, corners) = SHAPES[system % SHAPES.len()];
    if corners.is_empty() {
        area.draw(&Circle::new((x, y), 8 * FINE, inside.filled()))?;
        area.draw(&Circle::new((x, y), 8 * FINE, rim.stroke_width(2 * FINE as u32)))?;
        return Ok(());
    }
    let outline: Vec<(i32, i32)> = corners.iter().map(|(dx, dy)| (x + dx * FINE, y + dy * FINE)).collect();
    area.draw(&Polygon::new(outline.clone(), inside.filled()))?;
    let closed: Vec<(i32, i32)> = outline.iter().chain(outline.first()).copied().collect();
    area.draw(&PathElement::new(closed, rim.stroke_width(2 * FINE as u32)))?;
    Ok(())
}

/// Shades what lies between the horizon and the skyline.
fn obstructed(area: &Area<'_>, dome: Dome, skyline_deg: &[[f64; 2]]) -> Result<(), Failure> {
    let skyline = skyline_deg.iter().map(|[azimuth_deg, elevation_deg]| dome.place(*azimuth_deg, *elevation_deg));
    let rim = skyline_deg.iter().rev().map(|[azimuth_deg, _]| dome.place(*azimuth_deg, 0.0));
    area.draw(&Polygon::new(skyline.chain(rim).collect::<Vec<_>>(), RGBColor(226, 222, 214).filled()))?;
    Ok(())
}

/// Position of a name, in virtual pixels.
#[derive(Clone, Copy, Debug)]
struct Spot {
    middle: (i32, i32),
    dot: (i32, i32),
}

/// Half width and half height of a name, of a dot, and of a point of a track, in pixels.
const NAME_PX: (i32, i32) = (14, 8);
const DOT_PX: (i32, i32) = (9, 9);
const POINT_PX: (i32, i32) = (2, 2);
/// Half width and half height of a word of the compass or of an elevation.
const WORD_PX: (i32, i32) = (15, 8);
/// Positions of a name beside its dot, in the order in which they are tried, and how many times as far.
const SIDES_PX: [(i32, i32); 8] = [(26, 0), (-26, 0), (0, -18), (0, 18), (24, -15), (-24, -15), (24, 15), (-24, 15)];
const RINGS: [i32; 4] = [1, 2, 3, 4];

impl Spot {
    /// True if a line has to lead to the dot.
    fn is_far(self) -> bool {
        let (dx, dy) = (self.middle.0 - self.dot.0, self.middle.1 - self.dot.1);
        dx.abs() > 30 * FINE || dy.abs() > 20 * FINE
    }

    fn corners(self) -> [(i32, i32); 2] {
        let (x, y) = self.middle;
        let (dx, dy) = (NAME_PX.0 * FINE, NAME_PX.1 * FINE);
        [(x - dx, y - dy), (x + dx, y + dy)]
    }

    /// Distance in virtual pixels to something of a half width and a half height; negative where they
    /// overlap.
    fn clearance(self, (x, y): (i32, i32), half_px: (i32, i32)) -> i32 {
        let across = (self.middle.0 - x).abs() - (NAME_PX.0 + half_px.0) * FINE;
        let along = (self.middle.1 - y).abs() - (NAME_PX.1 + half_px.1) * FINE;
        across.max(along)
    }
}

/// Positions of the names of tracks that have one: within the picture, clear of the compass' words, dots,
/// tracks and each other, or as clear as can be.
fn names(dome: Dome, tracks: &[Track]) -> Vec<Spot> {
    let dots: Vec<(i32, i32)> = tracks.iter().filter_map(|track| track.places.last().copied()).collect();
    let points = || tracks.iter().flat_map(|track| track.places.iter().copied());
    let words: Vec<(i32, i32)> = dome.words().map(|(_, middle)| middle).collect();
    let mut spots: Vec<Spot> = Vec::with_capacity(dots.len());
    for &dot in &dots {
        let clearance = |spot: &Spot| {
            let from_names = spots.iter().map(|other| spot.clearance(other.middle, NAME_PX));
            let from_dots = dots.iter().map(|other| spot.clearance(*other, DOT_PX));
            let from_points = points().map(|point| spot.clearance(point, POINT_PX));
            let from_words = words.iter().map(|word| spot.clearance(*word, WORD_PX));
            let from_edge = std::iter::once(dome.room(spot.corners()));
            from_names.chain(from_dots).chain(from_points).chain(from_words).chain(from_edge).min().unwrap_or(0)
        };
        let at =
            |far: i32, (dx, dy): (i32, i32)| Spot { middle: (dot.0 + far * dx * FINE, dot.1 + far * dy * FINE), dot };
        let sides = || RINGS.iter().flat_map(|far| SIDES_PX.map(|side| at(*far, side)));
        let free = sides().find(|spot| clearance(spot) >= 0);
        let Some(spot) = free.or_else(|| sides().max_by_key(clearance)) else { continue };
        spots.push(spot);
    }
    spots
}

impl Dome {
    /// Zenith, in virtual pixels.
    fn centre(self) -> (i32, i32) {
        (self.centre_px.0 * FINE, self.centre_px.1 * FINE)
    }

    /// Words around the horizon and at the circles of elevation, with their middles in virtual pixels.
    fn words(self) -> impl Iterator<Item = (String, (i32, i32))> {
        // Names stand so many pixels beyond the horizon.
        let outside_deg = -90.0 * 17.0 / f64::from(self.radius_px);
        let compass = (0..360).step_by(30).map(move |azimuth_deg| {
            let name = match azimuth_deg {
                0 => "N".to_owned(),
                90 => "E".to_owned(),
                180 => "S".to_owned(),
                270 => "W".to_owned(),
                other => format!("{other}°"),
            };
            (name, self.place(f64::from(azimuth_deg), outside_deg))
        });
        let circles = [30, 60].into_iter().map(move |elevation_deg| {
            let (x, y) = self.place(0.0, f64::from(elevation_deg));
            (format!("{elevation_deg}°"), (x + 16 * FINE, y - 9 * FINE))
        });
        compass.chain(circles)
    }

    /// Distance from a rectangle to the picture's edge in virtual pixels; negative beyond it.
    fn room(self, [(left, top), (right, bottom)]: [(i32, i32); 2]) -> i32 {
        let (width, height) = (self.size_px.0 * FINE, self.size_px.1 * FINE);
        left.min(top).min(width - right).min(height - bottom)
    }

    /// Direction in virtual pixels.
    pub fn place(self, azimuth_deg: f64, elevation_deg: f64) -> (i32, i32) {
        let (sin, cos) = libm::sincos(azimuth_deg.to_radians());
        let distance = f64::from(self.radius_px * FINE) * (90.0 - elevation_deg) / 90.0;
        let (x, y) = self.centre();
        (x + (distance * sin) as i32, y - (distance * cos) as i32)
    }
}

/// Colour of a strength.
pub fn shade(cn0_dbhz: f64, low: f64, high: f64) -> RGBColor {
    // The palest yellow end of the map is left out: it cannot be seen on white.
    ViridisRGB.get_color_normalized((cn0_dbhz - low) / (high - low) * 0.92, 0.0, 1.0)
}

fn frame(area: &Area<'_>, dome: Dome) -> Result<(), Failure> {
    let title = anchored(15, HPos::Center, VPos::Center);
    let centre = dome.centre();
    area.draw(&Text::new("Satellites above the horizon", (centre.0, 16 * FINE), title))?;
    let line = RGBColor(205, 205, 205).stroke_width(FINE as u32);
    for elevation_deg in [0.0, 30.0, 60.0_f64] {
        let (_, y) = dome.place(0.0, elevation_deg);
        area.draw(&Circle::new(centre, centre.1 - y, line))?;
    }
    for azimuth_deg in (0..360).step_by(30) {
        area.draw(&PathElement::new([centre, dome.place(f64::from(azimuth_deg), 0.0)], line))?;
    }
    for (place, (word, middle)) in dome.words().enumerate() {
        let style = anchored(if place < 12 { 13 } else { 12 }, HPos::Center, VPos::Center);
        let style = if place < 12 { style } else { style.color(&GREY) };
        area.draw(&Text::new(word, middle, style))?;
    }
    Ok(())
}

/// The colours of C/N0 with their ends.
fn scale(area: &Area<'_>, (left_px, top_px): (i32, i32), low: f64, high: f64) -> Result<(), Failure> {
    let (left, top, width, height) = (left_px * FINE, top_px * FINE, 18 * FINE, 2 * FINE);
    let steps = 150;
    for step in 0..steps {
        let cn0 = high - (high - low) * f64::from(step) / f64::from(steps);
        let corner = (left, top + step * height);
        let opposite = (left + width, top + (step + 1) * height + 1);
        area.draw(&Rectangle::new([corner, opposite], shade(cn0, low, high).filled()))?;
    }
    for Tick { at, label } in ticks::linear(low, high, 6).ticks {
        let down = f64::from(steps * height) * (high - at) / (high - low);
        let at = (left + width + 6 * FINE, top + down.round() as i32);
        area.draw(&Text::new(label, at, anchored(12, HPos::Left, VPos::Center)))?;
    }
    let style = anchored(12, HPos::Center, VPos::Bottom);
    area.draw(&Text::new("C/N0 (dB-Hz)", (left + 14 * FINE, top - 10 * FINE), style))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::Draw;

    /// Skies of thirteen satellites with three pairs of neighbours whose dots overlap, on both pictures.
    #[test]
    fn names_overlap_neither_each_other_nor_the_words_of_the_compass() {
        let mut draw = Draw(3);
        for turn in 0..200 {
            let dome = [WIDE, NARROW][turn % 2];
            // From the zenith to the horizon, many near it.
            let mut place = || dome.place(360.0 * draw.normal(), (30.0 * draw.normal()).abs().min(90.0));
            let mut ends: Vec<(i32, i32)> = (0..10).map(|_| place()).collect();
            ends.extend_from_within(..3);
            ends.iter_mut().skip(10).for_each(|end| end.0 += 6 * FINE);
            let track = |end: &(i32, i32)| Track {
                sv: Sv::gps(1),
                places: vec![(end.0 - 3 * FINE, end.1), *end],
                cn0_dbhz: None,
                observed: true,
            };
            let tracks: Vec<Track> = ends.iter().map(track).collect();
            let spots = names(dome, &tracks);
            assert_eq!(spots.len(), ends.len());
            for (at, spot) in spots.iter().enumerate() {
                for other in &spots[..at] {
                    assert!(spot.clearance(other.middle, NAME_PX) >= 0, "{spot:?} {other:?}");
                }
                for (word, middle) in dome.words() {
                    assert!(spot.clearance(middle, WORD_PX) >= 0, "{spot:?} on {word}");
                }
                assert!(dome.room(spot.corners()) >= 0, "{spot:?} is cut");
            }
        }
    }

    #[test]
    fn a_satellite_at_an_end_of_the_compass_leaves_its_word_alone() {
        for azimuth_deg in [0.0, 90.0, 180.0, 240.0, 270.0] {
            let places = vec![NARROW.place(azimuth_deg, 12.0), NARROW.place(azimuth_deg, 3.0)];
            let track = Track { sv: Sv::gps(7), places, cn0_dbhz: None, observed: true };
            let spots = names(NARROW, &[track]);
            assert!(NARROW.words().all(|(_, middle)| spots[0].clearance(middle, WORD_PX) >= 0), "{azimuth_deg}");
        }
    }

    #[test]
    fn the_scale_of_equal_strengths_is_about_them() {
        let track = |cn0_dbhz| Track { sv: Sv::gps(7), places: Vec::new(), cn0_dbhz, observed: true };
        assert_eq!(scale_of(&[track(Some(45.0)), track(Some(45.0))]), (44.0, 46.0));
        assert_eq!(scale_of(&[track(Some(44.2)), track(Some(46.9))]), (44.0, 47.0));
    }
}
