//! Labels of axes as they are drawn, read back from the SVG.

use super::*;

/// A linear congruential generator (Knuth's MMIX).
struct Random(u64);

impl Random {
    /// Uniform between two values.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Ten to a uniform exponent.
    fn power(&mut self, low: f64, high: f64) -> f64 {
        libm::pow(10.0, self.between(low, high))
    }

    fn sign(&mut self) -> f64 {
        if self.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 }
    }

    /// An axis of one of the kinds that pictures have, and of kinds that they might have.
    fn axis(&mut self, kind: u64) -> Axis {
        match kind % 7 {
            // Anywhere, of any length.
            0 => {
                let (middle, span) = (self.sign() * self.power(-12.0, 12.0), self.power(-12.0, 12.0));
                Axis::new("value (m)", (middle - span, middle + span))
            }
            // A short one far from zero.
            1 => {
                let middle = self.sign() * self.power(0.0, 9.0);
                let span = middle.abs() * self.power(-11.0, -2.0);
                Axis::new("value (m)", (middle, middle + span))
            }
            // Errors about zero.
            2 => {
                let reach = self.power(-10.0, 6.0);
                Axis::around("error (m)", [-reach, self.between(0.3, 1.0) * reach].into_iter(), 1e-12)
            }
            // Time from the first point to the end of a run.
            3 => {
                let end_s = self.power(0.0, 6.0);
                Axis::new("time (s)", (end_s * self.between(0.0, 0.95), end_s))
            }
            // Shares and statistics from zero on.
            4 => Axis::new("share (%)", (0.0, self.power(-3.0, 9.0))),
            // Logarithms over a part of a decade, and over many.
            5 => {
                let from = self.between(-15.0, 10.0);
                Axis::new("deviation", (from, from + self.power(-3.0, 0.5))).logarithmic()
            }
            _ => {
                let from = self.between(-250.0, 100.0);
                Axis::new("deviation", (from, from + self.power(0.0, 2.0))).logarithmic()
            }
        }
    }
}

/// A text of an SVG as plotters writes it.
#[derive(Debug)]
struct Written {
    x: f64,
    y: f64,
    anchor: String,
    size: f64,
    turned: bool,
    text: String,
}

fn texts(svg: &str) -> Vec<Written> {
    let one = |part: &str| {
        let (attributes, rest) = part.split_once('>')?;
        let of = |key: &str| Some(attributes.split_once(&format!("{key}=\""))?.1.split_once('"')?.0.to_owned());
        Some(Written {
            x: of(" x")?.parse().ok()?,
            y: of(" y")?.parse().ok()?,
            anchor: of("text-anchor")?,
            size: of("font-size")?.parse().ok()?,
            turned: attributes.contains("rotate"),
            text: rest.split_once("</text>")?.0.trim().to_owned(),
        })
    };
    svg.split("<text").skip(1).filter_map(|part| one(&format!(" {part}"))).collect()
}

/// The first point and the last of a series of two dots.
fn corners(svg: &str) -> [(f64, f64); 2] {
    let path = svg.lines().find(|line| line.starts_with("<path") && line.matches("h0").count() == 2).unwrap();
    let (_, data) = path.split_once(" d=\"").unwrap();
    let points: Vec<(f64, f64)> = data
        .split('M')
        .skip(1)
        .map(|point| {
            let (x, rest) = point.split_once(' ').unwrap();
            (x.parse().unwrap(), rest.split_once('h').unwrap().0.parse().unwrap())
        })
        .collect();
    [points[0], points[1]]
}

/// Pixels from one end of an axis to the other, and its labels with their pixels.
struct Read {
    ends_px: (f64, f64),
    labels: Vec<(f64, String)>,
    words: String,
}

/// Fault of an axis as it was read; `None` if a reader finds the right values on it.
fn fault(axis: &Axis, read: &Read) -> Option<String> {
    if read.labels.len() < 2 {
        return Some(format!("{} ticks", read.labels.len()));
    }
    let offset: f64 = read.words.split_once("counted from ").map_or(0.0, |(_, offset)| offset.parse().unwrap());
    let per_pixel = (axis.to - axis.from) / (read.ends_px.1 - read.ends_px.0);
    // A label, its tick and both ends lie on whole virtual pixels, each half a pixel off at most; offset, sum
    // and ends are doubles.
    let rounding = 4.0 * f64::EPSILON * axis.from.abs().max(axis.to.abs());
    let allowed = 2.0 * per_pixel.abs() + rounding;
    for (at_px, label) in &read.labels {
        let Ok(number) = label.parse::<f64>() else { return Some(format!("{label} is no number")) };
        let value = match axis.scale {
            Scale::Logarithmic => libm::log10(offset + number),
            _ => offset + number,
        };
        let place = axis.from + (at_px - read.ends_px.0) * per_pixel;
        if (value - place).abs().partial_cmp(&allowed).is_none_or(|order| order.is_gt()) {
            return Some(format!("{label} (from {offset}) stands at {place}"));
        }
    }
    let mut distinct: Vec<&String> = read.labels.iter().map(|(_, label)| label).collect();
    distinct.sort();
    distinct.dedup();
    (distinct.len() < read.labels.len()).then(|| "a label stands twice".to_owned())
}

/// Both axes of a chart of that size, as they are drawn.
fn read_back(x: &Axis, y: &Axis, size: (u32, u32)) -> [Read; 2] {
    let ends = vec![(x.from, y.from), (x.to, y.to)];
    let chart = Chart::new("", x.clone(), y.clone(), vec![Series::new("", BLUE, Mark::Balls, ends)]);
    let svg = compose(size, 1, &[chart], &[]).unwrap().svg;
    let [(left, bottom), (right, top)] = corners(&svg);
    let fine = f64::from(FINE);
    let all = texts(&svg);
    let under = |text: &&Written| text.anchor == "middle" && text.y == bottom + 8.0 * fine;
    let beside = |text: &&Written| text.anchor == "end" && text.x == left - 8.0 * fine;
    let words = |turned: bool, label: &str| {
        let is_words = |text: &&Written| text.turned == turned && text.text.starts_with(label);
        all.iter().find(is_words).map(|text| text.text.clone()).unwrap()
    };
    let across: Vec<&Written> = all.iter().filter(under).collect();
    // Widths of DejaVu Sans in parts of its size.
    let advance = |c: char| match c {
        '.' => 0.3178,
        '-' => 0.361,
        'e' => 0.615,
        _ => 0.636,
    };
    let half = |text: &Written| 0.5 * text.size * text.text.chars().map(advance).sum::<f64>();
    for pair in across.windows(2) {
        assert!(pair[0].x + half(pair[0]) < pair[1].x - half(pair[1]), "{pair:?} overlap");
    }
    let last = across.last().unwrap();
    assert!(last.x + half(last) <= f64::from(size.0) * fine, "{last:?} is cut");
    [
        Read {
            ends_px: (left, right),
            labels: across.iter().map(|text| (text.x, text.text.clone())).collect(),
            words: words(false, &x.label),
        },
        Read {
            ends_px: (bottom, top),
            labels: all.iter().filter(beside).map(|text| (text.y, text.text.clone())).collect(),
            words: words(true, &y.label),
        },
    ]
}

#[test]
fn a_reader_finds_the_right_values_on_ten_thousand_axes_with_two_ticks_at_least() {
    let mut random = Random(50);
    let mut faults = Vec::new();
    for round in 0..5000_u64 {
        let axes = [random.axis(round), random.axis(round / 7)];
        let size = (random.between(220.0, 680.0) as u32, random.between(130.0, 500.0) as u32);
        for (axis, read) in axes.iter().zip(read_back(&axes[0], &axes[1], size)) {
            faults.extend(fault(axis, &read).map(|fault| format!("{axis:?} of {size:?}: {fault}")));
        }
    }
    assert!(faults.is_empty(), "{} of 10 000 axes: {:#?}", faults.len(), &faults[..faults.len().min(5)]);
}

#[test]
fn a_wrong_label_and_a_lonely_one_are_faults() {
    let axis = Axis::new("error (m)", (-0.0958, 0.0958));
    let at = |value: f64| 1000.0 * (value + 0.0958) / 0.1916;
    let read = |labels: &[(f64, &str)]| Read {
        ends_px: (0.0, 1000.0),
        labels: labels.iter().map(|(value, label)| (at(*value), (*label).to_owned())).collect(),
        words: axis.label.clone(),
    };
    assert_eq!(fault(&axis, &read(&[(-0.05, "-0.05"), (0.0, "0.00"), (0.05, "0.05")])), None);
    assert!(fault(&axis, &read(&[(-0.05, "-0.1"), (0.0, "0.0"), (0.05, "0.1")])).is_some());
    assert!(fault(&axis, &read(&[(0.0, "0.0")])).is_some());
    let twice = fault(&axis, &read(&[(0.0, "0.0"), (0.0001, "0.0")]));
    assert_eq!(twice.as_deref(), Some("a label stands twice"));
}

#[test]
fn lines_and_marks_end_at_the_axes() {
    let axis = || Axis::new("m", (0.0, 1.0));
    let far = vec![(0.5, 0.5), (0.5, 40.0), (-30.0, 0.5)];
    let look = |mark| Series::new("far", ORANGE, mark, far.clone());
    let draw = |mark| {
        let chart = Chart::new("", axis(), axis(), vec![look(mark)]);
        compose((300, 200), 1, &[chart], &[]).unwrap().svg
    };
    let inside = |svg: &str| {
        let numbers = |line: &str| -> Vec<f64> {
            let data = line.split_once("points=\"").or_else(|| line.split_once(" d=\"")).map_or("", |(_, data)| data);
            let words = data.split(['"', ',', ' ', 'M', 'Z']).filter(|word| !word.is_empty());
            words.map_while(|word| word.parse().ok()).collect()
        };
        let orange = svg.lines().filter(|line| line.contains("#D55E00")).flat_map(numbers).collect::<Vec<f64>>();
        !orange.is_empty() && orange.iter().all(|value| (0.0..=1200.0).contains(value))
    };
    for mark in [Mark::Line, Mark::Dash, Mark::Band] {
        assert!(inside(&draw(mark)), "{mark:?}");
    }
    assert_eq!(draw(Mark::Balls).matches("<circle").count(), 1);
}

#[test]
fn empty_axes_say_so() {
    let axis = || Axis::new("m", (0.0, 1.0));
    let svg = compose((300, 200), 1, &[Chart::new("", axis(), axis(), Vec::new())], &[]).unwrap().svg;
    assert!(svg.contains("no data"));
    let with = vec![Series::new("", BLUE, Mark::Dots, vec![(0.5, 0.5)])];
    let full = compose((300, 200), 1, &[Chart::new("", axis(), axis(), with)], &[]).unwrap().svg;
    // Numbers of axes of nothing would be a size.
    assert!(full.matches("<text").count() > svg.matches("<text").count());
}
