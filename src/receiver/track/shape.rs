//! Shape of a channel's correlation: sums of early, prompt and late over many updates of its loops.
//!
//! Of each update the real part of the prompt, with the sign of its symbol taken off, is the amplitude. Early
//! and late give three lines of numbers beside it: their sum and their difference along the prompt's phase,
//! and their difference across it. A wrong sign at a weak signal turns all numbers alike. Limits: sums hold
//! for one duration of the updates, and begin again when it changes.

use num_complex::Complex64;

/// Combinations of early and late.
pub const LINES: usize = 3;

/// Sums of a line of numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Line {
    /// Sum of the values.
    pub sum: f64,
    /// Sum of their squares.
    pub square: f64,
}

/// Sums of an interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shape {
    /// Updates.
    pub count: f64,
    /// Duration of an update, in seconds.
    pub update_s: f64,
    /// Sum of the amplitudes.
    pub amplitude: f64,
    /// Sum of their squares.
    pub square: f64,
    /// Early plus late, early less late along the prompt's phase, and early less late across it.
    pub lines: [Line; LINES],
}

impl Shape {
    /// Takes the prompt, early and late of an update, all with noise of one variance.
    pub fn add(&mut self, prompt: Complex64, [early, late]: [Complex64; 2], update_s: f64) {
        if update_s != self.update_s {
            *self = Self { update_s, ..Self::default() };
        }
        let sign = if prompt.re < 0.0 { -1.0 } else { 1.0 };
        let amplitude = sign * prompt.re;
        let [sum, difference] = [early + late, early - late].map(|side| side * sign);
        self.count += 1.0;
        self.amplitude += amplitude;
        self.square += amplitude * amplitude;
        for (line, value) in self.lines.iter_mut().zip([sum.re, difference.re, difference.im]) {
            line.sum += value;
            line.square += value * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_change_nothing_and_another_duration_is_another_interval() {
        let of = |sign: f64, k: u32| {
            let at = f64::from(k);
            let early = Complex64::new(sign * 8.0, sign * (0.1 + at));
            (Complex64::new(sign * (10.0 + at), sign * 0.3), [early, Complex64::new(sign * 7.0, sign * 0.2)])
        };
        let (mut plain, mut signed) = (Shape::default(), Shape::default());
        for k in 0..10 {
            let (prompt, sides) = of(1.0, k);
            plain.add(prompt, sides, 4e-3);
            let (prompt, sides) = of(if k % 3 == 0 { -1.0 } else { 1.0 }, k);
            signed.add(prompt, sides, 4e-3);
        }
        assert_eq!(plain, signed);
        assert_eq!((plain.count, plain.amplitude, plain.lines[0].sum), (10.0, 145.0, 150.0));
        let (prompt, sides) = of(1.0, 0);
        plain.add(prompt, sides, 1e-3);
        assert_eq!((plain.count, plain.update_s), (1.0, 1e-3));
    }
}
