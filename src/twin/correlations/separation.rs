//! Power of another satellite's long code in the correlations with a replica.
//!
//! A sum of N samples of the product of two random codes has the variance N·Σ R(k)·R'(k)·cos(2πkΔf/fs) over
//! all lags of k samples, R and R' the correlations of the sampled waveforms with themselves, Δf the
//! distance of the carriers. That holds whatever is sent beyond half the rate fs: it folds back, as nothing
//! is filtered. R and R' are averages over the positions of chips between samples, and over the difference of
//! both codes, which moves by chips in a second (Kaplan and Hegarty, Understanding GPS 2nd ed., 6.2, has the
//! spectral form). Limits: random codes; rates at which chips rest on the samples have their own value for
//! each difference of the codes.

use std::f64::consts::TAU;

use generator::fidelity::CodeEdge;
use generator::scene::Scene;
use gnss::signal::{PeakTable, Signal};

use super::made::STEPS_PER_CHIP;

/// A signal as it is sampled.
pub(super) struct Sampled {
    /// Share of the power, chips a second, and correlation with itself of each component.
    components: Vec<(f64, f64, PeakTable)>,
}

impl Sampled {
    /// A signal of a scene.
    pub fn new(signal: &Signal, scene: &Scene) -> Self {
        let component = |one: &gnss::signal::Component| {
            let sample = one.chip_rate_hz / scene.clock.rate.hz();
            let width = if scene.fidelity.code_edge == CodeEdge::Area { sample } else { 0.0 };
            let shape = one.shape_of(scene.fidelity.waveform);
            (one.power_share, one.chip_rate_hz, PeakTable::boxed(&shape, [width; 2], STEPS_PER_CHIP))
        };
        Self { components: signal.components.iter().map(component).collect() }
    }

    /// Share of the signal's power that its samples have.
    pub fn power(&self) -> f64 {
        self.components.iter().map(|(share, _, own)| share * own.value(0.0)).sum()
    }

    /// Spectral separation in seconds from a replica of `chip_rate_hz`, whose correlation with itself is
    /// `own`, for a carrier that is `apart_hz` higher, at `rate_hz`.
    pub fn separation_s(&self, (own, chip_rate_hz): (&PeakTable, f64), apart_hz: f64, rate_hz: f64) -> f64 {
        let one = |(share, other_hz, other): &(f64, f64, PeakTable)| {
            let product = |k: u32| {
                let lag_s = f64::from(k) / rate_hz;
                own.value(lag_s * chip_rate_hz) * other.value(lag_s * other_hz) * libm::cos(TAU * apart_hz * lag_s)
            };
            let reach_s = (own.reach_chips() / chip_rate_hz).min(other.reach_chips() / other_hz);
            let sum: f64 = (1..=(reach_s * rate_hz) as u32).map(product).sum();
            share * (product(0) + 2.0 * sum)
        };
        self.components.iter().map(one).sum::<f64>() / (own.value(0.0) * rate_hz)
    }
}

#[cfg(test)]
mod tests {
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::{Component, Layer};

    use super::*;

    fn peak(layers: &[Layer], component: &Component, width: f64) -> PeakTable {
        let shape = gnss::signal::Shape::between(layers, layers, component.chip_rate_hz);
        PeakTable::boxed(&shape, [width; 2], STEPS_PER_CHIP)
    }

    /// Separation of one layer of a component as a replica from another component, both means over so many
    /// samples.
    fn separation_s(
        (own, made): (&Component, &[Layer]),
        other: &Component,
        (apart_hz, rate_hz): (f64, f64),
        samples: f64,
    ) -> f64 {
        let width = |component: &Component| samples * component.chip_rate_hz / rate_hz;
        let sent = peak(other.layers, other, width(other));
        let sampled = Sampled { components: vec![(1.0, other.chip_rate_hz, sent)] };
        sampled.separation_s((&peak(made, own, width(own)), own.chip_rate_hz), apart_hz, rate_hz)
    }

    #[test]
    fn rectangular_chips_at_a_high_rate_have_two_thirds_of_a_chip() {
        let chips = &L1_CA.components[0];
        for samples in [0.0, 1.0] {
            let found_s = separation_s((chips, chips.layers), chips, (0.0, 1e9), samples);
            // The sum of a squared triangle errs by 1e-6, a sample's mean by 1e-3.
            assert!((found_s * 1.5 * 1.023e6 - 1.0).abs() < 2e-3, "{found_s}");
        }
        // One chip rate apart: ∫ sinc²(x)·sinc²(x − 1) dx = 1/π².
        let found_s = separation_s((chips, chips.layers), chips, (1.023e6, 1e9), 0.0);
        assert!((found_s * 1.023e6 * std::f64::consts::PI.powi(2) - 1.0).abs() < 2e-3, "{found_s}");
    }

    /// Numbers without order.
    struct Numbers(u64);

    impl Numbers {
        fn bits(&mut self) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 ^ (self.0 >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11
        }

        fn share(&mut self) -> f64 {
            self.bits() as f64 / 9_007_199_254_740_992.0
        }
    }

    /// Samples of a random code, each the mean over so many of them, from a random position in a chip on.
    fn sampled(layers: &[Layer], chips_per_sample: f64, samples: f64, count: usize, numbers: &mut Numbers) -> Vec<f64> {
        let begin = 2.0 + numbers.share();
        let chips = (begin + chips_per_sample * count as f64) as usize + 4;
        let code: Vec<f64> = (0..chips).map(|_| if numbers.bits() & 1 == 0 { 1.0 } else { -1.0 }).collect();
        let pulse = |share: f64| {
            let of = |layer: &Layer| layer.weight * f64::from(layer.pulse[(share * layer.pulse.len() as f64) as usize]);
            layers.iter().map(of).sum::<f64>()
        };
        const STEPS: usize = 12;
        // Integral of the waveform up to each twelfth of a chip.
        let mut integral = vec![0.0];
        for (number, chip) in (0..chips * STEPS).map(|k| (k, code[k / STEPS])) {
            let value = chip * pulse(((number % STEPS) as f64 + 0.5) / STEPS as f64);
            integral.push(integral[number] + value / STEPS as f64);
        }
        let until = |at: f64| {
            let step = at * STEPS as f64;
            let left = step as usize;
            integral[left] + (step - left as f64) * (integral[left + 1] - integral[left])
        };
        let width = if samples > 0.0 { samples * chips_per_sample } else { 1e-6 };
        let mean = |at: f64| (until(at + 0.5 * width) - until(at - 0.5 * width)) / width;
        (0..count).map(|k| mean(begin + chips_per_sample * k as f64)).collect()
    }

    #[test]
    fn sums_of_random_codes_have_the_variance_of_the_separation() {
        const SAMPLES: usize = 500;
        const SUMS: usize = 12_000;
        let (chips, data) = (&L1_CA.components[0], &E1.components[0]);
        let strongest = std::slice::from_ref(data.strongest().unwrap());
        let mut numbers = Numbers(1);
        for (own, other, apart_hz) in [
            ((chips, chips.layers), chips, 0.0),
            ((chips, chips.layers), chips, 0.5625e6),
            ((data, strongest), data, 0.0),
            ((data, strongest), chips, 0.0),
        ] {
            for (rate_hz, samples) in [(2.6e6, 1.0), (4.1e6, 1.0), (6.5e6, 1.0), (6.5e6, 0.0)] {
                let per_sample = 1.023e6 / rate_hz;
                let (mut sums, mut energy) = (0.0, 0.0);
                for _ in 0..SUMS {
                    let local = sampled(own.1, per_sample, samples, SAMPLES, &mut numbers);
                    let sent = sampled(other.layers, per_sample, samples, SAMPLES, &mut numbers);
                    let (mut re, mut im) = (0.0, 0.0);
                    for (k, (local, sent)) in local.iter().zip(&sent).enumerate() {
                        let (sin, cos) = libm::sincos(TAU * apart_hz * k as f64 / rate_hz);
                        (re, im) = (re + local * sent * cos, im + local * sent * sin);
                        energy += local * local;
                    }
                    sums += re * re + im * im;
                }
                let brute_s = sums / (energy * rate_hz);
                let found_s = separation_s(own, other, (apart_hz, rate_hz), samples);
                println!("{apart_hz} {rate_hz} {samples}: {brute_s:e} {found_s:e}");
                // √(2/12000) is 1.3 %; lags of two samples at the ends of 500 are missing, 0.4 %.
                assert!((found_s / brute_s - 1.0).abs() < 0.055, "{rate_hz} {samples}: {brute_s} {found_s}");
            }
        }
    }
}
