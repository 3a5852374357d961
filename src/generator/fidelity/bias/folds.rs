//! Code error from the spectral lines of a code and from pairs of its chips.
//!
//! A sample is the waveform behind what an edge stands for: a mean over the sample's interval, a low-pass
//! filter, or nothing at all. What that leaves above half the rate folds back onto the code's own lines. An
//! early-minus-late correlator with spacing d weighs the line at f by `w = 2 sin(πfd)`, less its mean over
//! the spectrum, which the phase of the prompt correlation takes away. With G the spectrum of a chip, H that
//! of the edge and lines `ν + i·Rc` a chip rate Rc apart, fold m of chips that are q apart gives
//!
//! `A(ν) = Σ_i w(f) G*(f) H(f + m·fs) G(f + m·fs)` and `g(q) = ∫ A(ν) e^{2πjνq/Rc} dν / Rc`.
//!
//! Two chips n and n + q of random signs add `g(q) + e^{−2πjq·m·fs/Rc} g(−q)` in either order, so that a code
//! of duration T has the variance `Rc/T · ½ Σ_{q≠0} |g(q) + e^{−2πjq·m·fs/Rc} g(−q)|²`. A chip with itself is
//! no random sign: `g(0)` has no mean as long as chips meet all positions between samples. Where `m·fs` is a
//! whole number of chip rates they do not, and `g(0)` is an error that stands. Both are over the slope `∫
//! w·2πf·H·|G|² df`. Chips of several kinds count by how often they are q apart.
//!
//! Limits: codes whose chips are random, of as many chips as the component has in 20 ms at most; errors far
//! below a chip.

use std::f64::consts::{PI, TAU};

use gnss::signal::{Component, chip_kinds, phasor, sinc};
use num_complex::Complex64;

use crate::fidelity::CodeEdge;
use crate::low_pass::{CUTOFF_CPS, Response};

/// Longest time over which a code's own lines count: a longer code is correlated in pieces.
const LONGEST_S: f64 = 0.02;
/// Lines looked at within half the rate to both sides, about.
const LINES: f64 = 1280.0;
/// Classes of lines, at least and at most.
const CLASSES: [usize; 2] = [16, 320];

/// Band of a component at a sample rate, and the parts of the spectrum that fold into it.
pub(super) struct Folds {
    edge: CodeEdge,
    response: Option<Response>,
    rate_hz: f64,
    chip_hz: f64,
    /// Duration of the code, in seconds.
    code_s: f64,
    /// Waveforms of chips by equal steps.
    kinds: Vec<Vec<Complex64>>,
    /// Kind of each chip, from the beginning of a code on and repeated; `None` for a chip of zero.
    pattern: Vec<Option<usize>>,
    /// Lines within half the rate by their classes, weighed.
    lines: Vec<Vec<Line>>,
    slope: f64,
}

/// A line of the spectrum.
struct Line {
    hz: f64,
    /// Conjugate amplitude for each kind of chips, with the discriminator's weight.
    weighed: Vec<Complex64>,
}

impl Folds {
    pub(super) fn new(edge: CodeEdge, component: &Component, rate_hz: f64) -> Self {
        let chip_hz = component.chip_rate_hz;
        let (kinds, layered) = chip_kinds(component.layers);
        // Codes that take turns have zeros at every second position.
        let code = (1..=u8::MAX).find_map(component.code).unwrap_or_default();
        let sent = |chip: usize| code.get(chip).is_none_or(|sign| *sign != 0);
        let kind = |chip: usize| layered.get(chip % layered.len()).copied().filter(|_| sent(chip));
        // What a filter lets fold back lies in a few per cent of the band.
        let finer = if edge == CodeEdge::BandLimited { 2 } else { 1 };
        let [least, most] = CLASSES.map(|classes| finer * classes);
        let classes = ((finer as f64 * LINES * chip_hz / rate_hz) as usize).clamp(least, most);
        let mut folds = Self {
            edge,
            response: (edge == CodeEdge::BandLimited).then(|| Response::new(CUTOFF_CPS)),
            rate_hz,
            chip_hz,
            code_s: component.period_s().min(LONGEST_S),
            kinds,
            pattern: (0..2 * layered.len()).map(kind).collect(),
            lines: Vec::new(),
            slope: 1.0,
        };
        // Half a step of the waveform apart.
        let spacing_s = 0.5 / (chip_hz * component.steps_per_chip() as f64);
        let weight = |hz: f64| 2.0 * libm::sin(PI * hz * spacing_s);
        let inside: Vec<Vec<f64>> = (0..classes)
            .map(|class| {
                let class_hz = (class as f64 + 0.5) / classes as f64 * chip_hz;
                let [first, last] = [-0.5, 0.5].map(|end| ((end * rate_hz - class_hz) / chip_hz).ceil() as i32);
                (first..last).map(|k| class_hz + f64::from(k) * chip_hz).collect()
            })
            .collect();
        let over = |figure: &dyn Fn(f64) -> f64| -> f64 {
            let left = |hz: &f64| folds.edge(*hz) * folds.density(*hz) * figure(*hz);
            chip_hz * inside.iter().flatten().map(left).sum::<f64>() / classes as f64
        };
        let centre = over(&weight) / over(&|_| 1.0);
        folds.slope = over(&|hz| (weight(hz) - centre) * TAU * hz);
        let line = |hz: f64| {
            let of = |kind| folds.spectrum(kind, hz).conj() * (weight(hz) - centre);
            Line { hz, weighed: (0..folds.kinds.len()).map(of).collect() }
        };
        folds.lines = inside.into_iter().map(|class| class.into_iter().map(line).collect()).collect();
        folds
    }

    /// Error of the code, root mean square over codes and phases, in seconds.
    pub(super) fn code_s(&self) -> f64 {
        // Those of either sign add the same.
        let near_s2: f64 = self.folds().map(|fold| 2.0 * self.fold_s2(fold)).sum();
        (near_s2 + self.far_s2()).sqrt()
    }

    /// Variance in s² that standing folds beyond the computed ones add. Only the model of the nearest chip
    /// has them. With q positions in turn, the code is known to a sample in q, uniformly distributed.
    fn far_s2(&self) -> f64 {
        let last = self.folds().last().unwrap_or(0);
        let chips = (self.code_s * self.chip_hz) as i32;
        let far = (last + 1..=chips).find(|fold| self.edge == CodeEdge::Nearest && self.stands(*fold));
        far.map_or(0.0, |places| (f64::from(places) * self.rate_hz).powi(-2) / 12.0)
    }

    /// True if one of the folds coincides with the code: chips meet the same positions again before the code
    /// ends.
    pub(super) fn stand(&self) -> bool {
        self.folds().any(|fold| self.stands(fold))
    }

    fn stands(&self, fold: i32) -> bool {
        let chips = f64::from(fold) * self.rate_hz / self.chip_hz;
        (chips - chips.round()).abs() * self.code_s * self.chip_hz < 1.0
    }

    /// Folds that matter: the error that an edge model leaves falls with their number.
    fn folds(&self) -> impl Iterator<Item = i32> + use<> {
        let last = match self.edge {
            CodeEdge::Nearest => 32,
            CodeEdge::Area => 6,
            CodeEdge::BandLimited => 2,
        };
        1..=last
    }

    /// Contribution of a fold to the variance of the delay, in s².
    fn fold_s2(&self, fold: i32) -> f64 {
        let turn = f64::from(fold) * self.rate_hz / self.chip_hz;
        let kinds = self.kinds.len();
        let pairs = |one| (0..kinds).map(move |other| [one, other]);
        let apart: Vec<Vec<Vec<Complex64>>> =
            (0..kinds).map(|one| pairs(one).map(|pair| self.apart(pair, fold)).collect()).collect();
        let at = |[one, other]: [usize; 2], chips: i32| -> Complex64 {
            let place = chips.rem_euclid(self.lines.len() as i32) as usize;
            let found = apart.get(one).and_then(|of| of.get(other)?.get(place)).copied().unwrap_or_default();
            // Half a turn of the middles of classes for each round of their number.
            if chips < 0 { -found } else { found }
        };
        let own: Complex64 = (0..kinds).map(|one| at([one, one], 0) * self.share([one, one], 0)).sum();
        let mut variance = 0.0;
        let reach = self.lines.len() as i32 / 2;
        for [one, other] in (0..kinds).flat_map(pairs) {
            for chips in (1 - reach..reach).filter(|chips| *chips != 0) {
                let swapped = phasor(-TAU * (turn * f64::from(chips)).fract());
                let pair = at([one, other], chips) + swapped * at([other, one], -chips);
                variance += 0.5 * self.share([one, other], chips) * pair.norm_sqr();
            }
        }
        let standing = if self.stands(fold) { own.norm_sqr() } else { 0.0 };
        (self.chip_hz / self.slope).powi(2) * (standing + variance / (self.chip_hz * self.code_s))
    }

    /// Share of the chips for which a chip of one kind follows one of another at a distance of `chips`.
    fn share(&self, [one, other]: [usize; 2], chips: i32) -> f64 {
        let count = self.pattern.len();
        let is = |at: usize, kind: usize| self.pattern.get(at % count).is_some_and(|own| *own == Some(kind));
        let ahead = chips.rem_euclid(count as i32) as usize;
        (0..count).filter(|&at| is(at, other) && is(at + ahead, one)).count() as f64 / count as f64
    }

    /// Contribution of chips of one kind and folded chips of another, by their distance in chips. It contains
    /// the part that a discriminator measures, which is its own mirror image.
    fn apart(&self, [kind, folded]: [usize; 2], fold: i32) -> Vec<Complex64> {
        let sum = |lines: &Vec<Line>, moved_hz: f64| -> Complex64 {
            let of = |line: &Line| {
                let hz = line.hz + moved_hz;
                let weighed = line.weighed.get(kind).copied().unwrap_or_default();
                weighed * self.spectrum(folded, hz) * self.edge(hz)
            };
            lines.iter().map(of).sum()
        };
        let moved_hz = f64::from(fold) * self.rate_hz;
        let mirrored = self.lines.iter().rev();
        let both = self.lines.iter().zip(mirrored);
        let read = |(own, mirror)| (sum(own, moved_hz) - sum(mirror, -moved_hz).conj()) * 0.5;
        let by_class: Vec<Complex64> = both.map(read).collect();
        let count = by_class.len() as f64;
        let of_chips = |chips: usize| {
            // Classes are the middles of their parts.
            let [turn, mut at] = [1.0, 0.5].map(|part| phasor(TAU * part * chips as f64 / count));
            let mut sum = Complex64::ZERO;
            for value in &by_class {
                sum += value * at;
                at *= turn;
            }
            sum / count
        };
        (0..by_class.len()).map(of_chips).collect()
    }

    /// Amplitude that the edge model leaves of a line.
    fn edge(&self, hz: f64) -> f64 {
        match (self.edge, &self.response) {
            (CodeEdge::Area, _) => sinc(hz / self.rate_hz),
            (_, Some(response)) => response.at(hz / self.rate_hz),
            _ => 1.0,
        }
    }

    /// Spectrum of a kind of chips: a chip's energy over its duration.
    fn spectrum(&self, kind: usize, hz: f64) -> Complex64 {
        let Some(steps) = self.kinds.get(kind) else { return Complex64::ZERO };
        let step_s = 1.0 / (self.chip_hz * steps.len() as f64);
        let (sin, cos) = libm::sincos(-TAU * hz * step_s);
        let (turn, mut at) = (Complex64::new(cos, sin), Complex64::new(1.0, 0.0));
        let mut sum = Complex64::ZERO;
        for step in steps {
            sum += step * at;
            at *= turn;
        }
        sum * (self.chip_hz.sqrt() * step_s * sinc(hz * step_s))
    }

    fn density(&self, hz: f64) -> f64 {
        (0..self.kinds.len()).map(|kind| self.share([kind, kind], 0) * self.spectrum(kind, hz).norm_sqr()).sum()
    }
}
