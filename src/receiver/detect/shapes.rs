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
//! so the prompt's sign is independent of it, and updates are independent of each other. The mean of n values
//! over its standard deviation is Student's with n − 1 degrees of freedom. The standard deviation is that of
//! the interval itself, so the level of the noise does not matter, and has a part for the error of r.
//!
//! Early less late along the prompt (delta) is what the code loop drives to zero. The sum of n errors of a
//! loop of order 1 is the change of its code over its gain K: n updates have 2(1 − (1 − K)ⁿ)/(n·K·(2 − K)) of
//! the variance of as many independent ones. The same number shows slow changes as a range in `code_carrier`.
//!
//! C/N0 of an interval is (ȳ² − v/n)/(2·v·T) with the variance v of the amplitudes; its logarithm has the
//! variance 4v/(n·ȳ²) + 2/(n − 1). A fall is counted if more than half of the signals show it: the middle one
//! of the normalised falls has the law of an order statistic, and one signal behind an obstacle hardly
//! changes it.
//!
//! Limits: reflections distort a correlation as a spoofer does. A code loop of order 2 has no test of delta.
//! At 35 dB-Hz the noncoherent discriminator leaves the delta some per cent more variance.

use std::collections::VecDeque;

use super::law::normal_of_student;
use crate::track::shape::{Line, Shape};

/// Fewest updates of a tested interval.
const LEAST_UPDATES: f64 = 20.0;

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
    /// Tests an interval against a reference of at least `least` intervals. `loop_hz` is the bandwidth of a
    /// code loop of order 1.
    pub fn test(&self, shape: &Shape, least: usize, loop_hz: Option<f64>) -> Tested {
        if shape.count < LEAST_UPDATES {
            return Tested::default();
        }
        let delta = loop_hz.and_then(|hz| delta(shape, hz));
        let alike = self.reference.iter().filter(|own| own.update_s == shape.update_s);
        if alike.clone().count() < least {
            return Tested { delta, ..Tested::default() };
        }
        let before = alike.fold(Shape::default(), |sum, own| sum.with(own));
        Tested {
            ratio: distortion(shape, &before, 0),
            phase: distortion(shape, &before, 2),
            delta,
            fall: fall(shape, &before),
        }
    }

    /// Makes an interval a part of a reference of `most` intervals.
    pub fn keep(&mut self, shape: Shape, most: usize) {
        if shape.count < LEAST_UPDATES {
            return;
        }
        self.reference.push_back(shape);
        while self.reference.len() > most {
            self.reference.pop_front();
        }
    }
}

/// Mean of a line less `share` of the amplitude, and the variance of one value about it.
fn rest(shape: &Shape, line: &Line, share: f64) -> (f64, f64) {
    let mean = (line.sum - share * shape.amplitude) / shape.count;
    let square = line.square - 2.0 * share * line.product + share * share * shape.square;
    (mean, (square - shape.count * mean * mean) / (shape.count - 1.0))
}

fn distortion(shape: &Shape, before: &Shape, number: usize) -> Option<f64> {
    let (line, old) = (&shape.lines[number], &before.lines[number]);
    let share = old.sum / before.amplitude;
    let ((mean, variance), (_, old_variance)) = (rest(shape, line, share), rest(before, old, share));
    let scaled = shape.amplitude / shape.count / (before.amplitude / before.count);
    let of_mean = variance / shape.count + scaled * scaled * old_variance / before.count;
    (of_mean > 0.0).then(|| normal_of_student(mean / of_mean.sqrt(), shape.count - 1.0))
}

fn delta(shape: &Shape, loop_hz: f64) -> Option<f64> {
    let (mean, variance) = rest(shape, &shape.lines[1], 0.0);
    // Gain of a loop of order 1 whose one-sided noise bandwidth is B: B·T = K/(2(2 − K)).
    let product = loop_hz * shape.update_s;
    let gain = 4.0 * product / (1.0 + 2.0 * product);
    let kept = 1.0 - libm::pow(1.0 - gain, shape.count);
    let of_mean = variance * 2.0 * kept / (shape.count * shape.count * gain * (2.0 - gain));
    (of_mean > 0.0).then(|| normal_of_student(mean / of_mean.sqrt(), shape.count - 1.0))
}

/// Logarithm of C/N0 times a constant, and its variance.
fn strength(shape: &Shape) -> Option<(f64, f64)> {
    let (count, mean) = (shape.count, shape.amplitude / shape.count);
    let variance = (shape.square - count * mean * mean) / (count - 1.0);
    let power = mean * mean - variance / count;
    let spread = 4.0 * variance / (count * mean * mean) + 2.0 / (count - 1.0);
    (power > 0.0 && variance > 0.0).then(|| (libm::log(power / variance), spread))
}

fn fall(shape: &Shape, before: &Shape) -> Option<f64> {
    let ((now, variance), (old, old_variance)) = (strength(shape)?, strength(before)?);
    Some((old - now) / (variance + old_variance).sqrt())
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
                let tested = signal.test(&shape, 5, Some(0.5));
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
        // 3 % of the amplitude at both sides is 0.06 · 15.9 over 0.87/√250: 17 of Student's law, 13.8 normal.
        let ratio = |bend: Complex64| run(1, bend)[0].ratio.unwrap();
        assert!((ratio(Complex64::new(0.03, 0.0)) - 13.8).abs() < 4.0);
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
        // 0.69 over 0.094 in the logarithm.
        assert!((signal.test(&shape, 5, None).fall.unwrap() - 7.3).abs() < 4.0);
        // Too few updates are no test.
        assert_eq!(signal.test(&channel.interval(15.9, 10, Complex64::ZERO), 5, None), Tested::default());
    }
}
