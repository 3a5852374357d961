//! Detection in noise: false alarms and detections of K summed correlations.
//!
//! The statistic is Σ|S|²/σ² with σ² the noise of one component: χ² of 2K degrees without a signal,
//! non-central with λ = 2K·T·C/N0·L with one, L being the loss by code and frequency offset. Source: Kay,
//! Fundamentals of Statistical Signal Processing II, 2.2; the generalised Marcum function as a Poisson
//! mixture (Shnidman 1989).

/// Probability that χ² of 2·`pairs` degrees exceeds `threshold`: e^(−V/2)·Σ (V/2)^i/i!.
pub fn false_alarm(threshold: f64, pairs: u32) -> f64 {
    let half = 0.5 * threshold.max(0.0);
    (0..pairs).map(|i| poisson(half, f64::from(i))).sum()
}

/// Threshold whose false-alarm probability per cell is `probability`, by bisection.
pub fn threshold(probability: f64, pairs: u32) -> f64 {
    let (mut low, mut high) = (0.0, 4.0 * f64::from(pairs) - 8.0 * libm::log(probability) + 8.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if false_alarm(middle, pairs) > probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Probability of an alarm somewhere in so many independent cells.
pub fn false_alarm_anywhere(cell: f64, cells: f64) -> f64 {
    -libm::expm1(cells * libm::log1p(-cell))
}

/// Probability that non-central χ² of 2·`pairs` degrees and parameter `lambda` exceeds `threshold`.
pub fn detection(threshold: f64, pairs: u32, lambda: f64) -> f64 {
    let mean = 0.5 * lambda.max(0.0);
    // 12 deviations about the Poisson mean leave out less than 1e-15; the further terms of small means too.
    let spread = 12.0 * mean.sqrt() + 40.0;
    let first = (mean - spread).max(0.0).floor();
    let mut exceeds = false_alarm(threshold, pairs + first as u32);
    let mut sum = 0.0;
    for j in first as u32..=(mean + spread) as u32 {
        sum += poisson(mean, f64::from(j)) * exceeds;
        exceeds += poisson(0.5 * threshold, f64::from(pairs + j));
    }
    sum.min(1.0)
}

/// λ of `pairs` correlations of `t_s` each, `loss` being the share of power that offsets leave.
pub fn noncentrality(pairs: u32, t_s: f64, cn0_hz: f64, loss: f64) -> f64 {
    2.0 * f64::from(pairs) * t_s * cn0_hz * loss
}

/// C/N0 in dB-Hz at which a signal without offsets is detected with `probability`, by bisection from 0 to 100
/// dB-Hz.
pub fn cn0_dbhz(probability: f64, threshold: f64, pairs: u32, t_s: f64) -> f64 {
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let cn0_hz = libm::pow(10.0, middle / 10.0);
        let reached = detection(threshold, pairs, noncentrality(pairs, t_s, cn0_hz, 1.0)) >= probability;
        if reached { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Power left by a frequency offset over one integration: sinc²(Δf·T).
pub fn frequency_loss(offset_hz: f64, t_s: f64) -> f64 {
    let x = std::f64::consts::PI * offset_hz * t_s;
    if x == 0.0 {
        return 1.0;
    }
    let sinc = libm::sin(x) / x;
    sinc * sinc
}

/// e^−mean·mean^k/k!, in logarithms so that neither power nor factorial overflows.
fn poisson(mean: f64, k: f64) -> f64 {
    if mean <= 0.0 {
        return if k == 0.0 { 1.0 } else { 0.0 };
    }
    libm::exp(k * libm::log(mean) - mean - libm::lgamma(k + 1.0))
}
