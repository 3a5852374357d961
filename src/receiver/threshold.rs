//! The detection threshold: a sum of K exponential powers under noise alone is chi-square with 2K degrees.

/// Probability that a chi-square variable of `degrees` of freedom exceeds `value`.
///
/// Q(ν + 2) = Q(ν) + xʰ e⁻ˣ / Γ(h + 1) with x = value/2 and h = ν/2, from Q(0) = 0 or Q(1) = erfc √x; summed
/// from the last term down.
pub fn exceedance(value: f64, degrees: u32) -> f64 {
    let x = value / 2.0;
    if x <= 0.0 {
        return 1.0;
    }
    let start = if degrees.is_multiple_of(2) { 0.0 } else { libm::erfc(x.sqrt()) };
    let mut half = f64::from(degrees) / 2.0 - 1.0;
    let mut term = libm::exp(half * libm::log(x) - x - libm::lgamma(half + 1.0));
    let mut total = 0.0;
    while half >= 0.0 {
        total += term;
        term *= half / x;
        half -= 1.0;
    }
    start + total
}

/// The value that a chi-square variable of `degrees` of freedom exceeds with `probability`.
pub fn threshold(probability: f64, degrees: u32) -> f64 {
    let (mut low, mut high) = (0.0, f64::from(degrees) + 10.0);
    while exceedance(high, degrees) > probability {
        high *= 2.0;
    }
    // Halving beyond the resolution of f64.
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if exceedance(middle, degrees) > probability { low = middle } else { high = middle }
    }
    high
}

/// Exceedance probability of one cell such that a search of `cells` has a total of `search`.
pub fn of_one_cell(search: f64, cells: f64) -> f64 {
    -libm::expm1(libm::log1p(-search) / cells)
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    use super::*;

    #[test]
    fn thresholds_are_the_published_ones_and_agree_with_statrs() {
        // Chi-square tables: exceeded with probability 1e-6 at 2, 4 and 20 degrees of freedom.
        for (degrees, printed) in [(2, 27.631), (4, 33.377), (20, 65.421)] {
            assert!((threshold(1e-6, degrees) - printed).abs() < 5e-4);
        }
        for degrees in [1, 2, 3, 7, 20, 200, 2000] {
            for probability in [0.3, 1e-3, 1e-8] {
                let value = threshold(probability, degrees);
                let other = ChiSquared::new(f64::from(degrees)).unwrap().sf(value);
                // statrs promises about ten digits of the incomplete gamma function, less where it is a small
                // tail.
                assert!((other / probability - 1.0).abs() < 1e-6, "{degrees} {probability} {other}");
            }
        }
        assert!((of_one_cell(1e-3, 1e5) - 1.0005e-8).abs() < 1e-12);
    }
}
