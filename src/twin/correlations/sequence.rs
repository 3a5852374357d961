//! Codes as sequences of chips of a few kinds, and their correlation.
//!
//! The correlation of two sequences at a lag of whole steps is a sum over pairs of kinds: the product of the
//! chips that meet, times that of the steps of their waveforms. So it takes a pass over the chips for each
//! lag of whole chips, however many steps a chip has and however long the code is of which the replica is a
//! segment.

use gnss::signal::{Layer, chip_kinds};
use num_complex::Complex64;

/// Chips of a code from one of them on, with the waveforms that layers give them.
pub(super) struct Sequence<'a> {
    code: &'a [i8],
    /// Number of the first chip.
    first: usize,
    /// Kinds of chips, each as its waveform in equal steps.
    kinds: Vec<Vec<Complex64>>,
    /// Kind of each chip of the code, repeated.
    pattern: Vec<usize>,
}

impl<'a> Sequence<'a> {
    pub fn new(code: &'a [i8], first: usize, layers: &[Layer]) -> Self {
        let (kinds, pattern) = chip_kinds(layers);
        Self { code, first, kinds, pattern }
    }

    /// Steps of a chip.
    pub fn steps(&self) -> usize {
        self.kinds.first().map_or(1, Vec::len)
    }

    /// Value and kind of the chip that many after the first one, where the code repeats.
    fn chip(&self, after: i64) -> (i64, usize) {
        let number = (self.first as i64 + after).rem_euclid(self.code.len().max(1) as i64) as usize;
        let kind = self.pattern.get(number % self.pattern.len().max(1));
        (self.code.get(number).copied().unwrap_or_default().into(), kind.copied().unwrap_or_default())
    }

    /// Mean of this sequence's steps times the conjugate ones of `local`, over `length` chips from the first
    /// ones on, where this one is late by −`reach` to `reach` chips in steps of `1/per_chip`.
    pub fn correlate(&self, local: &Self, length: usize, (reach, per_chip): (usize, usize)) -> Vec<Complex64> {
        let (lags, count) = (reach as i64, self.kinds.len());
        let around: Vec<(i64, usize)> = (-lags..length as i64 + lags).map(|after| self.chip(after)).collect();
        let mut products = vec![vec![0_i64; count * local.kinds.len()]; 2 * reach + 1];
        for (number, window) in around.windows(2 * reach + 1).take(length).enumerate() {
            let (own, kind) = local.chip(number as i64);
            for (products, (chip, other)) in products.iter_mut().zip(window) {
                if let Some(product) = products.get_mut(kind * count + other) {
                    *product += own * chip;
                }
            }
        }
        let step = |sequence: &Self, kind: usize, at: usize| {
            let wave = sequence.kinds.get(kind);
            wave.and_then(|wave| wave.get(at * wave.len() / per_chip)).copied().unwrap_or_default()
        };
        let (turn, scale) = (per_chip as i64, 1.0 / (length * per_chip) as f64);
        let at = |lag: i64| {
            let mut sum = Complex64::ZERO;
            for own in 0..turn {
                let (whole, other) = ((own + lag).div_euclid(turn) + lags, (own + lag).rem_euclid(turn));
                for (pair, product) in products.get(whole as usize).into_iter().flatten().enumerate() {
                    let (kind, incoming) = (pair / count, pair % count);
                    let steps = step(self, incoming, other as usize) * step(local, kind, own as usize).conj();
                    sum += steps * *product as f64;
                }
            }
            sum * scale
        };
        (-lags * turn..=lags * turn).map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use gnss::galileo::e1::E1;
    use gnss::gps::l1c::L1C;
    use gnss::gps::l2c::L2C;
    use gnss::signal::Signal;

    use super::*;

    /// All steps of a code, one after the other.
    fn written_out(sequence: &Sequence, per_chip: usize) -> Vec<Complex64> {
        let chip = |number: usize| {
            let (value, kind) = sequence.chip(number as i64 - sequence.first as i64);
            let wave = &sequence.kinds[kind];
            (0..per_chip).map(move |step| wave[step * wave.len() / per_chip] * value as f64)
        };
        (0..sequence.code.len()).flat_map(chip).collect()
    }

    /// Sums over the steps themselves, for pilots and data in each other's correlations: of pulses that take
    /// turns (L1C), of sub-carriers (E1), and of a segment in the middle of a long code (L2 CL).
    #[test]
    fn sums_over_kinds_are_those_over_steps() {
        let pairs: [(&Signal, usize, usize); 4] = [(&L1C, 1, 1), (&L1C, 1, 0), (&E1, 1, 0), (&L2C, 1, 0)];
        for (signal, own, other) in pairs {
            let [local, sent] = [own, other].map(|index| &signal.components[index]);
            let codes = [local, sent].map(|component| (component.code)(7).unwrap());
            let length = codes[0].len().min(codes[1].len());
            let first = codes[0].len() / length / 2 * length;
            let replica = Sequence::new(&codes[0], first, local.layers);
            let incoming = Sequence::new(&codes[1], if codes[1].len() > length { first } else { 0 }, sent.layers);
            let per_chip = gnss::signal::least_common_multiple(replica.steps(), incoming.steps());
            let found = incoming.correlate(&replica, length, (3, per_chip));
            let [a, b] = [&incoming, &replica].map(|sequence| written_out(sequence, per_chip));
            let sum = |lag: i64| {
                let at = |all: &[Complex64], first: usize, step: i64| {
                    all[((first * per_chip) as i64 + step).rem_euclid(all.len() as i64) as usize]
                };
                let pair = |step: i64| at(&a, incoming.first, step + lag) * at(&b, first, step).conj();
                let steps = (length * per_chip) as i64;
                (0..steps).map(pair).sum::<Complex64>() / steps as f64
            };
            for (place, lag) in (0..found.len()).zip(-3 * per_chip as i64..).step_by(5) {
                assert!((found[place] - sum(lag)).norm() < 1e-9, "{signal} {own} {other} {lag}");
            }
        }
    }
}
