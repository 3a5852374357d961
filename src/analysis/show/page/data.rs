//! Pictures as JSON for the page's script.
//!
//! `figures` are charts or a sky, `arrays` are the numbers, each series of them once. An array is base 64 of
//! 32-bit floats (`f`) or of 16-bit integers `k` (`q`), whose values are `low + k·step`; both little-endian.

use std::collections::HashMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use plotters::style::RGBColor;
use serde_json::{Value, json};

use crate::show::plot::chart::{Axis, Chart, Mark, Scale, Series, Shape};
use crate::show::plot::dome::{Sky, Track, shade};
use crate::show::plot::sketch::{Figure, Sketch};

/// Largest step of 16-bit values, as part of an axis: a plot may be magnified twenty times before it shows.
const MOST_STEP: f64 = 1.0 / 20_000.0;
/// Colours of a scale of C/N0.
const SHADES: u32 = 24;

/// Figures of a page and their numbers.
#[derive(Default)]
pub(super) struct Data {
    figures: Vec<Value>,
    arrays: Vec<Value>,
    /// Indices of the arrays by their text.
    known: HashMap<String, usize>,
}

impl Data {
    /// Adds a figure; its index.
    pub fn add(&mut self, figure: &Figure) -> usize {
        let value = match &figure.sketch {
            Sketch::Charts { columns, charts, legend, .. } => json!({
                "name": figure.name,
                "columns": columns,
                "legend": legend.iter().map(look).collect::<Vec<_>>(),
                "charts": charts.iter().map(|chart| self.chart(chart)).collect::<Vec<_>>(),
            }),
            Sketch::Sky(sky) => json!({ "name": figure.name, "sky": self.sky(sky) }),
        };
        self.figures.push(value);
        self.figures.len() - 1
    }

    /// JSON of all figures.
    pub fn json(self) -> String {
        json!({ "figures": self.figures, "arrays": self.arrays }).to_string()
    }

    fn chart(&mut self, chart: &Chart) -> Value {
        let series: Vec<Value> = chart.series.iter().map(|series| self.series(chart, series)).collect();
        let labels: Vec<Value> = chart.labels.iter().map(|((x, y), text, up)| json!([x, y, text, up])).collect();
        json!({
            "title": chart.title,
            "x": axis(&chart.x),
            "y": axis(&chart.y),
            "equal": chart.equal,
            "labels": labels,
            "series": series,
        })
    }

    fn series(&mut self, chart: &Chart, series: &Series) -> Value {
        let finite = || series.points.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        let x: Vec<f64> = finite().map(|point| point.0).collect();
        let y: Vec<f64> = finite().map(|point| point.1).collect();
        let mut value = look(series);
        // Times are shared by many series, and are exact to a part of their own size.
        value["x"] = json!(self.floats(&x));
        value["y"] = json!(self.quantised(&y, (chart.y.to - chart.y.from) * MOST_STEP));
        value
    }

    fn sky(&mut self, sky: &Sky) -> Value {
        let (low, high) = sky.scale_dbhz();
        let tracks: Vec<Value> = sky.tracks.iter().map(|track| self.track(sky, track)).collect();
        let scale: Vec<String> = (0..=SHADES)
            .map(|n| colour(shade(low + (high - low) * f64::from(n) / f64::from(SHADES), low, high)))
            .collect();
        json!({ "low": low, "high": high, "scale": scale, "skyline": sky.skyline_deg, "tracks": tracks })
    }

    fn track(&mut self, sky: &Sky, track: &Track) -> Value {
        let (low, high) = sky.scale_dbhz();
        let (x, y): (Vec<f64>, Vec<f64>) = sky.plan(track).unzip();
        json!({
            "sv": track.sv.to_string(),
            "system": track.sv.system.to_string(),
            "cn0": track.cn0_dbhz,
            "observed": track.observed,
            "colour": track.cn0_dbhz.map(|cn0| colour(shade(cn0, low, high))),
            "x": self.floats(&x),
            "y": self.floats(&y),
        })
    }

    fn floats(&mut self, values: &[f64]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
        self.array(json!({ "f": STANDARD.encode(&bytes) }))
    }

    /// 16-bit integers where their step is no larger than `most`.
    fn quantised(&mut self, values: &[f64], most: f64) -> usize {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let step = (high - low) / f64::from(u16::MAX);
        if !step.is_finite() || step > most {
            return self.floats(values);
        }
        let number = |value: &f64| if step > 0.0 { ((value - low) / step).round() as u16 } else { 0 };
        let bytes: Vec<u8> = values.iter().flat_map(|value| number(value).to_le_bytes()).collect();
        self.array(json!({ "q": STANDARD.encode(&bytes), "low": low, "step": step }))
    }

    fn array(&mut self, value: Value) -> usize {
        let next = self.arrays.len();
        let place = *self.known.entry(value.to_string()).or_insert(next);
        if place == next {
            self.arrays.push(value);
        }
        place
    }
}

fn axis(axis: &Axis) -> Value {
    let mut value = json!({ "label": axis.label, "from": axis.from, "to": axis.to });
    match &axis.scale {
        Scale::Linear => {}
        Scale::Logarithmic => value["log"] = json!(true),
        Scale::Named(names) => value["names"] = json!(names),
    }
    value
}

/// Name, colour and mark of a series.
fn look(series: &Series) -> Value {
    json!({ "name": series.name, "colour": colour(series.colour), "mark": mark(series.mark) })
}

fn colour(RGBColor(red, green, blue): RGBColor) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// A mark by its kind, with sizes in pixels or data units.
fn mark(mark: Mark) -> Value {
    match mark {
        Mark::Line => json!({ "line": [] }),
        Mark::Dash => json!({ "line": [7, 5] }),
        Mark::Dashes(on_px, off_px) => json!({ "line": [on_px, off_px] }),
        Mark::Dots => json!({ "dot": 1.5 }),
        Mark::Balls => json!({ "dot": 4 }),
        Mark::Rings => json!({ "ring": 1.8 }),
        Mark::Small(shape) => json!({ "size": 2.25, "shape": outline(shape) }),
        Mark::Large(shape) => json!({ "size": 4.5, "shape": outline(shape) }),
        Mark::Cross => json!({ "cross": 7 }),
        Mark::Bars(width) => json!({ "bars": width }),
        Mark::Band => json!({ "band": true }),
        Mark::Tile(width, height) => json!({ "tile": [width, height] }),
    }
}

/// Corners in eighths of the mark's radius.
fn outline(shape: Shape) -> Value {
    match shape {
        Shape::Filled(corners) => json!({ "fill": corners }),
        Shape::Hollow(corners) => json!({ "outline": corners }),
        Shape::Strokes(strokes) => json!({ "strokes": strokes }),
    }
}
