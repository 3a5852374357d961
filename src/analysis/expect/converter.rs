//! Spectrum of Gaussian samples after a converter and an integer format.
//!
//! A staircase Q of Gaussian x has the Hermite series Q(σz) = Σ c_n·He_n(z)/√n!, with c_n = Σ
//! jump·φ(e)·He_(n−1)(e)/√(n!) over its edges e, in σ. The autocorrelation of the output is then Σ c_n²·ρⁿ,
//! with ρ that of the input (Price 1958, Bussgang 1952). The term n = 1 is the signal with the gain c_1/σ.
//! The rest is quantisation noise, with the spectrum of powers of ρ. For complex samples with a circular
//! spectrum ρ is that of one component and of the cross term in turn. Orders beyond 32 count as white.
//! Limits: samples are Gaussian, so that a strong line through a coarse converter is not described.

use num_complex::Complex;
use statrs::function::erf::erf;

use gnss::facts::ConverterSpec;

/// Orders of the series: what is left out has a correlation of ρ³³ at other lags.
const ORDERS: usize = 32;
/// Edges beyond so many σ are passed once in 1e12 samples.
const FAR: f64 = 7.5;

/// Staircase from a component's value to its level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Staircase {
    /// Distance of its edges, LSB before it.
    step_lsb: f64,
    /// Distance of its levels.
    jump: f64,
    /// True if there is an edge at zero.
    rises: bool,
    /// Edges to each side of zero.
    edges: f64,
}

impl Staircase {
    /// Staircase of a converter, if there is one, and of a format with that largest magnitude, for samples of
    /// `sigma_lsb`. `None` where numbers are not rounded.
    pub fn of(adc: Option<&ConverterSpec>, full_scale_lsb: Option<f32>, sigma_lsb: f64) -> Option<Self> {
        let step_lsb =
            adc.map_or(1.0, |adc| adc.step_sigma * if adc.gain_control { sigma_lsb } else { adc.nominal_lsb });
        match (adc.filter(|adc| !adc.whole), full_scale_lsb) {
            // Levels 2k + 1 between edges at whole steps, or k + 1/2 where those are the format's numbers.
            (Some(adc), full) => {
                let edges = ((1_i64 << (adc.bits - 1)) - 1) as f64;
                let jump = if full.is_some_and(|full| full.fract() != 0.0) { 1.0 } else { 2.0 };
                Some(Self { step_lsb, jump, rises: true, edges })
            }
            // The format's own numbers: whole ones, or those between.
            (None, Some(full)) => {
                let full = f64::from(full);
                let rises = full.fract() != 0.0;
                Some(Self { step_lsb, jump: 1.0, rises, edges: full.floor() })
            }
            (None, None) => None,
        }
    }

    /// Edges above zero as multiples of a step, without one at zero.
    fn above(&self) -> impl Iterator<Item = f64> {
        let first = if self.rises { 1.0 } else { 0.5 };
        (0..self.edges as u32).map(move |k| first + f64::from(k))
    }

    /// Gain, and the power that it adds to a component, for Gaussian samples of `sigma_lsb`.
    pub fn gain_and_noise(&self, sigma_lsb: f64) -> (f64, f64) {
        let (terms, square) = self.series(sigma_lsb);
        let product = terms.first().copied().unwrap_or(0.0);
        (product / sigma_lsb, (square - product * product).max(0.0))
    }

    /// c_n from n = 1 on, and the mean square of what comes out.
    fn series(&self, sigma_lsb: f64) -> (Vec<f64>, f64) {
        let step = self.step_lsb / sigma_lsb;
        let bell = |x: f64| libm::exp(-0.5 * x * x) / std::f64::consts::TAU.sqrt();
        let beyond = |x: f64| 0.5 * (1.0 - erf(x / std::f64::consts::SQRT_2));
        let mut terms = vec![0.0; ORDERS];
        let mut add = |edge: f64, weight: f64| {
            // ψ_k = He_k/√k!: ψ_(k+1) = (e·ψ_k − √k·ψ_(k−1))/√(k+1). Odd orders alone are left, twice.
            let (mut before, mut now) = (0.0, 1.0);
            for (order, term) in (1..).zip(terms.iter_mut()) {
                let n = f64::from(order);
                if order % 2 == 1 {
                    *term += weight * bell(edge) * now / n.sqrt();
                }
                (before, now) = (now, (edge * now - (n - 1.0).sqrt() * before) / n.sqrt());
            }
        };
        if self.rises {
            add(0.0, self.jump);
        }
        // The square rises at each edge by the difference of the squares of the levels beside it.
        let mut level = if self.rises { 0.5 * self.jump } else { 0.0 };
        let mut square = level * level;
        for edge in self.above().map(|edge| edge * step).take_while(|edge| *edge < FAR) {
            add(edge, 2.0 * self.jump);
            let next = level + self.jump;
            square += 2.0 * beyond(edge) * (next * next - level * level);
            level = next;
        }
        (terms, square)
    }

    /// Puts an autocorrelation through it, lag 0 first, and returns the gain. `components` is 1 of real
    /// samples and 2 of complex ones. A constant of that power is beside them, whose line is left out of what
    /// comes out, and what it makes with the samples is not.
    pub fn pass(&self, correlation: &mut [Complex<f64>], components: f64, constant_lsb2: f64) -> f64 {
        let all_lsb2 = correlation.first().map_or(0.0, |first| first.re) + constant_lsb2;
        let sigma_lsb = (all_lsb2 / components).max(1e-300).sqrt();
        let (terms, square) = self.series(sigma_lsb);
        let scale = 1.0 / (components * sigma_lsb * sigma_lsb);
        let all = |x: f64| {
            let (mut power, mut sum) = (x, 0.0);
            for term in terms.iter().step_by(2) {
                sum += term * term * power;
                power *= x * x;
            }
            sum
        };
        let line = all(constant_lsb2 * scale);
        for value in correlation.iter_mut() {
            let (re, im) = ((value.re + constant_lsb2) * scale, value.im * scale);
            *value = Complex::new(all(re) - line, all(im)) * components;
        }
        if let Some(first) = correlation.first_mut() {
            let described: f64 = terms.iter().map(|term| term * term).sum();
            *first += components * (square - described).max(0.0);
        }
        terms.first().copied().unwrap_or(0.0) / sigma_lsb
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adc(bits: u32, step_sigma: f64) -> ConverterSpec {
        ConverterSpec { bits, step_sigma, nominal_lsb: 28.0, gain_control: false, whole: false }
    }

    #[test]
    fn converters_lose_what_the_literature_says() {
        // Correlation loss 10 lg(g²σ²/(g²σ² + d)) (Hegarty 2011): 1.96 dB of one bit, 0.549 of two and 0.166
        // of three at best steps.
        for (bits, step_sigma, loss_db) in [(1, 1.0, 1.961), (2, 0.9957, 0.549), (3, 0.586, 0.166)] {
            let staircase = Staircase::of(Some(&adc(bits, step_sigma)), Some(127.0), 28.0).unwrap();
            let (gain, added) = staircase.gain_and_noise(28.0);
            let kept = gain * gain * 28.0 * 28.0;
            let found = 10.0 * libm::log10((kept + added) / kept);
            assert!((found - loss_db).abs() < 1e-3, "{bits} bits: {found}");
        }
        // Rounding adds 1/12 and has no gain, on whole numbers or between.
        for full in [127.0, 127.5] {
            let (gain, added) = Staircase::of(None, Some(full), 20.0).unwrap().gain_and_noise(20.0);
            assert!((gain - 1.0).abs() < 1e-6 && (added - 1.0 / 12.0).abs() < 1e-4, "{full}: {gain} {added}");
        }
        assert_eq!(Staircase::of(None, None, 1.0), None);
    }

    #[test]
    fn one_bit_makes_the_arcsine_of_a_correlation() {
        // Van Vleck (1943, 1966): 2/π·asin(ρ).
        let staircase = Staircase::of(Some(&adc(1, 1.0)), Some(127.0), 3.0).unwrap();
        let inside = [1.0, 0.6, -0.3, 0.0];
        let mut found: Vec<Complex<f64>> = inside.iter().map(|rho| Complex::new(9.0 * rho, 0.0)).collect();
        let gain = staircase.pass(&mut found, 1.0, 0.0);
        for (rho, found) in inside.iter().zip(&found) {
            let expected = std::f64::consts::FRAC_2_PI * libm::asin(*rho);
            // Orders beyond 32 have 0.6³³.
            assert!((found.re - expected).abs() < 1e-6 && found.im == 0.0, "{rho}: {found} {expected}");
        }
        assert!((gain - std::f64::consts::FRAC_2_PI.sqrt() / 3.0).abs() < 1e-12);
        // Complex: both components, each with its own.
        let mut both = [Complex::new(18.0, 0.0), Complex::new(5.4, -3.6)];
        staircase.pass(&mut both, 2.0, 0.0);
        let of = |rho: f64| 2.0 * std::f64::consts::FRAC_2_PI * libm::asin(rho);
        assert!((both[1] - Complex::new(of(0.3), of(-0.2))).norm() < 1e-6, "{both:?}");
    }
}
