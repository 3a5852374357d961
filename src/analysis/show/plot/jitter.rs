//! Distribution of the closed loops' errors, with the rules of thumb for their spread.

use std::f64::consts::TAU;

use crate::error::JudgeError;
use crate::judge::judgement::number;
use crate::judge::summary::{DLL_CHIPS, FLL_HZ, PLL_DEG};
use crate::read::Numbers;
use crate::show::plot::canvas::{Axis, BLUE, COLOURS, Chart, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;

/// The errors of one loop, each satellite about its own mean, and the rule for their σ.
pub(crate) struct Loop {
    pub name: &'static str,
    pub unit: &'static str,
    pub errors: Numbers,
    /// Standard deviation in the summary.
    pub sigma: Option<f64>,
    pub threshold: f64,
}

/// DLL, PLL and FLL, made one after the other.
pub(crate) fn loops<'a>(judged: &'a Judged<'_>) -> impl Iterator<Item = Result<Loop, JudgeError>> + 'a {
    let (limits, tracking) = (&judged.summary.details.thresholds, &judged.summary.tracking);
    let all = [
        ("DLL", "chips", DLL_CHIPS, tracking.dll_sigma_chips, limits.dll_chips),
        ("PLL", "degrees", PLL_DEG, tracking.pll_sigma_deg, limits.pll_deg),
        ("FLL", "Hz", FLL_HZ, tracking.fll_sigma_hz, limits.fll_hz),
    ];
    all.into_iter().map(|(name, unit, of, sigma, threshold)| {
        let mut errors = Numbers::new(judged.errors.signals.directory());
        judged.errors.settled(None, of, |group| {
            let middle = group.mean()?.unwrap_or(0.0);
            group.try_each(|value| errors.push(value - middle))
        })?;
        Ok(Loop { name, unit, errors, sigma, threshold })
    })
}

const BINS: usize = 41;

/// A histogram of a loop's errors: bins of equal width about zero, wide enough for the tails.
pub(crate) struct Histogram {
    pub sigma: f64,
    pub half: f64,
    pub width: f64,
    pub counts: [usize; BINS],
    total: usize,
}

impl Histogram {
    pub fn new(of: &Loop) -> Result<Self, JudgeError> {
        let sigma = of.errors.std()?.map_or(0.0, |(sigma, _)| sigma);
        let tails = (5.0 * sigma).max(1e-9);
        // The threshold is drawn if it is not so far that the histogram would disappear.
        let half = if of.threshold < 2.0 * tails { tails.max(1.15 * of.threshold) } else { tails };
        let width = 2.0 * half / BINS as f64;
        let mut counts = [0; BINS];
        of.errors.each(|value| {
            let bin = ((value + half) / width).floor();
            if let Some(count) = (bin >= 0.0).then(|| counts.get_mut(bin as usize)).flatten() {
                *count += 1;
            }
        })?;
        Ok(Self { sigma, half, width, counts, total: of.errors.len() })
    }

    /// Middle of a bin.
    pub fn middle(&self, bin: usize) -> f64 {
        (bin as f64 + 0.5) * self.width - self.half
    }

    /// Percentage of the errors in a bin.
    pub fn share(&self, bin: usize) -> f64 {
        100.0 * self.counts.get(bin).copied().unwrap_or(0) as f64 / self.total.max(1) as f64
    }

    /// Percentage that a bin about `value` would hold of a normal distribution of the same σ.
    pub fn normal(&self, value: f64) -> f64 {
        let z = value / self.sigma;
        100.0 * self.width / (self.sigma * TAU.sqrt()) * libm::exp(-0.5 * z * z)
    }
}

/// Histograms with the fitted normal curve, ±σ and the threshold.
pub fn jitter(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let charts = loops(judged).map(|one| histogram(&one?)).collect::<Result<Vec<Chart>, JudgeError>>()?;
    let legend = [
        Series::new("replica − truth", BLUE, Mark::Bars(1.0), Vec::new()),
        Series::new("normal", COLOURS[6], Mark::Line, Vec::new()),
        Series::new("±1σ", GREY, Mark::Dash, Vec::new()),
        Series::new("threshold for 1σ", ORANGE, Mark::Line, Vec::new()),
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 270), 3, charts, legend)))
}

/// The loop and its σ in words.
fn titled(of: &Loop) -> String {
    let name = match of.name {
        "DLL" => "Code loop (DLL)",
        "PLL" => "Phase loop (PLL)",
        _ => "Frequency loop (FLL)",
    };
    match of.sigma {
        Some(sigma) => format!("{name}: σ {} {}", number(sigma), of.unit),
        None => format!("{name}: no errors"),
    }
}

fn histogram(of: &Loop) -> Result<Chart, JudgeError> {
    let Loop { unit, threshold, .. } = of;
    let histogram = Histogram::new(of)?;
    let Histogram { sigma, half, width, .. } = histogram;
    let bars: Vec<(f64, f64)> = (0..BINS).map(|bin| (histogram.middle(bin), histogram.share(bin))).collect();
    let curve: Vec<(f64, f64)> = if sigma > 0.0 {
        let steps = (0..=200).map(|step| half * (f64::from(step) / 100.0 - 1.0));
        steps.map(|value| (value, histogram.normal(value))).collect()
    } else {
        Vec::new()
    };
    let top = 1.1 * bars.iter().chain(&curve).map(|point| point.1).fold(1.0, f64::max);
    let mut series =
        vec![Series::new("", BLUE, Mark::Bars(0.92 * width), bars), Series::new("", COLOURS[6], Mark::Line, curve)];
    for sign in [-1.0, 1.0] {
        series.push(Series::new("", GREY, Mark::Dash, vec![(sign * sigma, 0.0), (sign * sigma, top)]));
        if *threshold < half {
            series.push(Series::new("", ORANGE, Mark::Line, vec![(sign * threshold, 0.0), (sign * threshold, top)]));
        }
    }
    // Within the axes the words would lie on bars and lines. Most thresholds are outside of them.
    let x = Axis::new(&format!("error ({unit}); threshold {}", number(*threshold)), (-half, half));
    Ok(Chart::new(titled(of), x, Axis::new("observations (%)", (0.0, top)), series))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_has_the_summary_s_sigma_in_words_with_its_unit_and_a_far_threshold_is_said_below() {
        let directory = tempfile::tempdir().unwrap();
        let of = |threshold: f64| {
            let mut errors = Numbers::new(directory.path());
            (0..400).for_each(|n| errors.push(0.003 * libm::sin(f64::from(n))).unwrap());
            Loop { name: "DLL", unit: "chips", errors, sigma: Some(0.002_986), threshold }
        };
        let below = |chart: &Chart| (chart.x.label.clone(), chart.labels.len());
        let far = histogram(&of(0.083_333_3)).unwrap();
        assert_eq!(far.title, "Code loop (DLL): σ 0.002986 chips");
        assert_eq!(below(&far), ("error (chips); threshold 0.08333".to_owned(), 0));
        let orange = |chart: &Chart| chart.series.iter().filter(|one| one.colour == ORANGE).count();
        assert_eq!(orange(&far), 0);
        let near = histogram(&of(0.008)).unwrap();
        assert_eq!((below(&near), orange(&near)), (("error (chips); threshold 0.008".to_owned(), 0), 2));
    }
}
