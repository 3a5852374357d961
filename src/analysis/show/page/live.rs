//! Page of a run while it goes on: the plots of a report, empty at first, and a script that fills them.
//!
//! The script connects to the server that the page came from, and to nothing else.

use plotters::style::RGBColor;

use crate::show::document::{Item, Report};
use crate::show::plot::chart::{Axis, BLUE, Chart, GREEN, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::dome::{NARROW, Sky};
use crate::show::plot::drawing::Failure;
use crate::show::plot::sketch::{Figure, Sketch};

/// Receives frames and draws them.
pub(super) const SCRIPT: &str = include_str!("../../assets/live.js");

/// Words of a live page.
#[derive(Clone, Debug, Default)]
pub struct Words {
    /// Name of the scene or of the source.
    pub title: String,
    /// Content of the page in a sentence.
    pub subtitle: String,
    /// Words and names of the sources that events switch, like `power` and `G05`; none without events.
    pub sources: Vec<(String, String)>,
    /// Origin of the receiver's rows.
    pub receiver: String,
}

/// Live page and the content security policy that its server sends.
#[derive(Clone, Debug)]
pub struct LivePage {
    /// HTML of the page.
    pub html: String,
    /// Content security policy.
    pub policy: String,
}

/// The page with these words.
///
/// # Errors
/// Errors of the drawing library.
pub fn compose(words: &Words) -> Result<LivePage, Failure> {
    let mut report = Report::new(&words.title, &words.subtitle, "live");
    let sky = Sky { dome: NARROW, tracks: Vec::new(), skyline_deg: Vec::new() };
    report.add(Item::Pair(Box::new([Figure::new("sky", Sketch::Sky(sky), "")?, map()?])));
    report.heading("Strengths").figure(strengths()?);
    report.heading("Spectrum").figure(spectrum()?);
    report.heading("Receiver").text(&words.receiver).figure(loops()?);
    report.heading("Stream").figure(stream()?);
    let sources = words.sources.iter().map(|(word, name)| (name.clone(), word.clone())).collect();
    report.heading("Events").add(Item::Facts(sources));
    Ok(report.live())
}

/// Charts of one figure with one legend.
fn figure(
    name: &str,
    columns: usize,
    charts: Vec<Chart>,
    legend: Vec<Series>,
    caption: &str,
) -> Result<Figure, Failure> {
    Figure::new(name, Sketch::of((WIDTH_PX, 300), columns, charts, legend), caption)
}

/// A series without points.
fn empty(name: &str, colour: RGBColor, mark: Mark) -> Series {
    Series::new(name, colour, mark, Vec::new())
}

fn map() -> Result<Figure, Failure> {
    let series = vec![
        empty("true track", BLUE, Mark::Line),
        empty("fixes", ORANGE, Mark::Balls),
        empty("true position", GREEN, Mark::Cross),
    ];
    let (x, y) = (Axis::new("east (m)", (-10.0, 10.0)), Axis::new("north (m)", (-10.0, 10.0)));
    let mut chart = Chart::new("Map: fixes and true position", x, y, series.clone());
    chart.equal = true;
    figure("map", 1, vec![chart], series, "")
}

fn strengths() -> Result<Figure, Failure> {
    let series = vec![empty("true", BLUE, Mark::Bars(0.8)), empty("receiver", ORANGE, Mark::Balls)];
    let x = Axis::new("satellite, in order of its signals", (0.0, 1.0)).named(vec![(0.5, "–".to_owned())]);
    let y = Axis::new("C/N0 (dB-Hz)", (0.0, 60.0));
    let chart = Chart::new("Carrier power over noise density", x, y, series.clone());
    figure("strengths", 1, vec![chart], series, "C/N0 of each signal: true, and as the receiver measures it.")
}

fn spectrum() -> Result<Figure, Failure> {
    let series = vec![empty("density", BLUE, Mark::Line)];
    let x = Axis::new("frequency in the samples (MHz)", (-1.0, 1.0));
    let chart = Chart::new("Spectrum of the samples sent", x, Axis::new("density (dB LSB²/Hz)", (-60.0, 0.0)), series);
    let caption =
        "Spectrum of up to 8192 samples, five times a second. Below it are the earlier spectra, the newest on top.";
    figure("spectrum", 1, vec![chart], Vec::new(), caption)
}

fn loops() -> Result<Figure, Failure> {
    let reach = Axis::new("quadrature (noise σ)", (-10.0, 10.0));
    let x = Axis::new("in phase (noise σ)", (-10.0, 10.0));
    let mut prompt = Chart::new("Prompt correlator", x, reach, vec![empty("prompt", BLUE, Mark::Dots)]);
    prompt.equal = true;
    let ahead = Axis::new("replica ahead of prompt (chips)", (-0.5, 0.5));
    let magnitude = Axis::new("magnitude (noise σ)", (0.0, 10.0));
    let one = [empty("mean of the last rows", ORANGE, Mark::Line), empty("last row", BLUE, Mark::Balls)];
    let taps = Chart::new("Correlation taps: late, prompt, early", ahead, magnitude, one.to_vec());
    let over_time = |title: &str, label: &str, colour| {
        let series = vec![empty("", colour, Mark::Dots)];
        Chart::new(title, Axis::new("time (s)", (0.0, 1.0)), Axis::new(label, (-1.0, 1.0)), series)
    };
    let charts = vec![
        prompt,
        taps,
        over_time("Carrier phase discriminator", "phase (cycles)", ORANGE),
        over_time("Code discriminator", "code (chips)", GREEN),
        over_time("Carrier frequency discriminator", "frequency (Hz)", BLUE),
    ];
    let caption = "Correlators and discriminators of the chosen channel: the last row of each frame. Records of the \
                   prompt alone show no taps.";
    figure("loops", 2, charts, one.to_vec(), caption)
}

fn stream() -> Result<Figure, Failure> {
    let over_time = |title: &str, label: &str, series: &[Series]| {
        Chart::new(title, Axis::new("time (s)", (0.0, 1.0)), Axis::new(label, (0.0, 10.0)), series.to_vec())
    };
    let ages = [empty("median age", BLUE, Mark::Line), empty("99 % age", ORANGE, Mark::Dash)];
    let counts = [empty("underruns", ORANGE, Mark::Line), empty("stalls", GREEN, Mark::Dash)];
    let charts = vec![
        over_time("Latency: age of a state when its first sample leaves", "age (ms)", &ages),
        over_time("Underruns and stalls so far", "number", &counts),
    ];
    figure("stream", 2, charts, [ages, counts].concat(), "")
}
