//! Shape of each signal's correlation, and C/N0 that most signals lose together.
//!
//! Sources: R. E. Phelts, Multicorrelator Techniques for Robust Mitigation of Threats to GPS Signal Quality
//! (Stanford 2001), for ratio and delta; B. M. Ledvina et al., An In-Line Anti-Spoofing Device for Legacy
//! Civil GPS Receivers (ION ITM 2010); O. M. Mubarak and A. G. Dempster, Analysis of early late phase in
//! single-frequency GPS receivers for multipath detection and mitigation, GPS Solutions 14 (2010), for the
//! phase.
//!
//! With the prompt's amplitude y of an update, x is early plus late along the prompt's phase (ratio) or early
//! less late across it (phase). A front end gives x a share r of y, which the reference shows. z = x − r·y
//! has no part of the signal. Its noise is that of early and late without their correlation with the prompt,
//! so the prompt's sign is independent of it, and updates are independent of each other. Correlations with
//! the codes of other satellites are not: they change within seconds to minutes. Therefore the mean of z over
//! an interval is compared with those of the M intervals of the reference. Its difference from their mean
//! over their standard deviation and √(1 + 1/M) is Student's with M − 1 degrees of freedom.
//!
//! C/N0 of an interval of n updates is (ȳ² − v/n)/(2·v·T) with the variance v of the amplitudes; its
//! logarithm is compared with those of the reference in the same way. The middle one of the signals'
//! normalised falls shows what more than half of them share, and one signal behind an obstacle hardly moves
//! it. It is compared with the middle falls of the intervals before, once more in the same way, because
//! signals whose codes meet fall together.
//!
//! Early less late along the prompt (delta) is what the code loop drives to zero. The sum of n errors of a
//! loop of order 1 is the change of its code over its gain K: n updates have 2(1 − (1 − K)ⁿ)/(n·K·(2 − K)) of
//! the variance of as many independent ones, 0.43 of it for a second of a loop of 0.5 Hz. The scatter of the
//! reference has it. Neighbouring intervals share the error at their common end, a correlation of −0.43, so
//! that one alarm in twelve is followed by another: a run of many tests scatters a little more than
//! independent ones, and their mean share is that of the threshold. Slow changes are seen as a range in
//! `code_carrier`.
//!
//! Limits: reflections distort a correlation as a spoofer does. The scatter of the intervals before does not
//! show codes that meet for one or two intervals, which [`super::meeting`] leaves out. Only intervals in
//! which a signal was followed throughout are tested.

use std::collections::VecDeque;

use super::law::among;
use crate::track::shape::Shape;

/// Fewest intervals of a reference.
const LEAST_INTERVALS: usize = 3;
/// Share of an interval that has to have updates for it to be whole.
const WHOLE_SHARE: f64 = 0.9;

/// Statistics of one signal in an interval. Each is standard normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tested {
    /// Early and late together, by the amplitude.
    pub ratio: Option<f64>,
    /// Difference of early and late across the prompt's phase.
    pub phase: Option<f64>,
    /// Difference of early and late along it.
    pub delta: Option<f64>,
    /// Fall of C/N0.
    pub fall: Option<f64>,
}

/// Correlations of one signal: the interval that ended, and those before.
#[derive(Debug, Default)]
pub struct Signal {
    reference: VecDeque<Shape>,
}

impl Signal {
    /// Tests an interval against a reference of at least `least` intervals.
    pub fn test(&self, shape: &Shape, least: usize) -> Tested {
        let alike: Vec<&Shape> = self.reference.iter().filter(|own| own.update_s == shape.update_s).collect();
        if alike.len() < least.max(LEAST_INTERVALS) {
            return Tested::default();
        }
        let [ratio, delta, phase] = [0, 1, 2].map(|number| distortion(shape, &alike, number));
        Tested { ratio, phase, delta, fall: fall(shape, &alike) }
    }

    /// Makes an interval a part of a reference of `most` intervals.
    pub fn keep(&mut self, shape: Shape, most: usize) {
        self.reference.push_back(shape);
        while self.reference.len() > most {
            self.reference.pop_front();
        }
    }
}

/// True if a signal was followed throughout an interval.
pub fn is_whole(shape: &Shape, interval_s: f64) -> bool {
    shape.count * shape.update_s > WHOLE_SHARE * interval_s
}

fn distortion(shape: &Shape, before: &[&Shape], number: usize) -> Option<f64> {
    let (sum, amplitude) = before
        .iter()
        .fold((0.0, 0.0), |(sum, amplitude), own| (sum + own.lines[number].sum, amplitude + own.amplitude));
    let share = sum / amplitude;
    let rest = |own: &Shape| (own.lines[number].sum - share * own.amplitude) / own.count;
    among(rest(shape), &before.iter().map(|own| rest(own)).collect::<Vec<f64>>())
}

/// Logarithm of C/N0 times a constant.
fn strength(shape: &Shape) -> Option<f64> {
    let (count, mean) = (shape.count, shape.amplitude / shape.count);
    let variance = (shape.square - count * mean * mean) / (count - 1.0);
    let power = mean * mean - variance / count;
    (power > 0.0 && variance > 0.0).then(|| libm::log(power / variance))
}

fn fall(shape: &Shape, before: &[&Shape]) -> Option<f64> {
    let others: Vec<f64> = before.iter().filter_map(|own| strength(own)).collect();
    if others.len() < before.len() {
        return None;
    }
    Some(-among(strength(shape)?, &others)?)
}

#[cfg(test)]
mod tests {
    use super::super::random::Normal;
    use super::*;
    use num_complex::Complex64;

    /// Correlations on a triangle of unlimited bandwidth, early and late half a chip apart, and a code loop
    /// of order 1.
    struct Channel {
        normal: Normal,
        error_chips: f64,
        gain: f64,
    }

    impl Channel {
        /// Updates of an interval; early and late have `bend` of the amplitude more.
        fn interval(&mut self, amplitude: f64, updates: u32, bend: Complex64) -> Shape {
            let mut shape = Shape::default();
            for k in 0..updates {
                // Noise of a triangle: 0.75 of early and late is the prompt's, and 0.5 is in common.
                let mut noise = || Complex64::new(self.normal.draw(), self.normal.draw());
                let (prompt, own, other) = (noise(), noise(), noise());
                let (a, b) = (0.75 * prompt, 0.4375_f64.sqrt());
                // The rest of both is −0.0625 of 0.4375 in common.
                let r = -0.0625 / 0.4375;
                let (early, late) = (a + b * own, a + b * (r * own + (1.0_f64 - r * r).sqrt() * other));
                let at = |chips: f64| amplitude * (1.0 - chips.abs());
                let sign = if k % 7 < 3 { -1.0 } else { 1.0 };
                let early = early + at(0.25 - self.error_chips) + amplitude * bend;
                let late = late + at(0.25 + self.error_chips) + amplitude * bend;
                self.error_chips -= self.gain * (early - late).re / (2.0 * amplitude);
                let prompt = prompt + amplitude * (1.0 - 0.5 * self.error_chips * self.error_chips);
                shape.add(sign * prompt, [sign * early, sign * late], 4e-3);
            }
            shape
        }
    }

    /// Statistics of intervals of a second at 45 dB-Hz.
    fn run(intervals: usize, bend: Complex64) -> Vec<Tested> {
        // B = 0.5 Hz at 4 ms.
        let mut channel = Channel { normal: Normal::new(5), error_chips: 0.0, gain: 0.008 / 1.004 };
        let amplitude = (2.0 * 4e-3 * libm::pow(10.0, 4.5)).sqrt();
        let mut signal = Signal::default();
        channel.interval(amplitude, 2000, Complex64::ZERO);
        for _ in 0..20 {
            signal.keep(channel.interval(amplitude, 250, Complex64::ZERO), 20);
        }
        (0..intervals)
            .map(|_| {
                let shape = channel.interval(amplitude, 250, bend);
                let tested = signal.test(&shape, 5);
                signal.keep(shape, 20);
                tested
            })
            .collect()
    }

    #[test]
    fn statistics_of_an_undistorted_correlation_are_standard_normal() {
        let all = run(4000, Complex64::ZERO);
        type Of = fn(&Tested) -> Option<f64>;
        let each: [(&str, Of); 4] =
            [("ratio", |t| t.ratio), ("phase", |t| t.phase), ("delta", |t| t.delta), ("fall", |t| t.fall)];
        for (name, of) in each {
            let values: Vec<f64> = all.iter().filter_map(of).collect();
            assert_eq!(values.len(), all.len());
            let mean = values.iter().sum::<f64>() / 4000.0;
            let variance = values.iter().map(|x| x * x).sum::<f64>() / 4000.0;
            // 4000 values know the mean to 0.016 and the variance to 0.022; four of these. A reference is
            // shared.
            assert!(mean.abs() < 0.1 && (variance - 1.0).abs() < 0.09, "{name}: {mean} {variance}");
            let beyond = values.iter().filter(|x| x.abs() > 2.576).count();
            assert!((20..=65).contains(&beyond), "{name}: {beyond} of 40");
        }
    }

    #[test]
    fn a_second_peak_in_phase_moves_the_ratio_and_one_across_leaves_it() {
        // 3 % of the amplitude at both sides is 0.06 · 15.9 over 0.87/√250: 17 of Student's law, 7.3 normal.
        let ratio = |bend: Complex64| run(1, bend)[0].ratio.unwrap();
        assert!((ratio(Complex64::new(0.03, 0.0)) - 7.3).abs() < 1.5);
        assert!(ratio(Complex64::new(0.0, 0.03)).abs() < 4.0);
    }

    #[test]
    fn a_loss_of_three_decibels_is_a_fall() {
        let mut channel = Channel { normal: Normal::new(9), error_chips: 0.0, gain: 0.008 };
        let mut signal = Signal::default();
        for _ in 0..20 {
            signal.keep(channel.interval(15.9, 250, Complex64::ZERO), 20);
        }
        let shape = channel.interval(15.9 * libm::pow(10.0, -0.15), 250, Complex64::ZERO);
        // 0.69 over 0.094 in the logarithm, 7.3 of Student's law, is 5.1 normal.
        assert!((signal.test(&shape, 5).fall.unwrap() - 5.1).abs() < 1.5);
        // Half of an interval is none, and a reference of two is none.
        assert!(is_whole(&shape, 1.0) && !is_whole(&shape, 2.0));
        assert_eq!(signal.test(&shape, 21), Tested::default());
    }
}
