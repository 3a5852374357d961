//! Delay of a code by a front end's filter, as an early-minus-late loop measures it.
//!
//! A filter with a non-linear phase spreads the correlation unevenly. The loop settles where early and late
//! are equally strong, R(τ − d/2)² = R(τ + d/2)². R is the transform of the code's spectrum times the
//! responses of the sampler, of the replica's samples and of the sampled filter ([`Response`]), which repeats
//! with the sample rate. Aliases have passed the filter at their frequency in the samples, and the replica's
//! samples alias in the same way. For a Butterworth filter just wider than the main lobe the delay exceeds
//! the one in the middle of its band by metres. Limits: the code lies in the middle of the filter. The
//! replica has all layers.

use num_complex::Complex64;

use crate::response::Response;
use crate::waveform::{Sampler, Waveform};
use gnss::discriminator::CodeDiscriminator;
use gnss::facts::{FilterShape, FilterSpec};
use gnss::signal::phasor;

/// Steps of the integral over half the band of the samples: 5 kHz at 10 Msps, far below what a response or a
/// lag of a chip turns in.
const STEPS: u32 = 1000;

/// Cross-spectrum of a code's samples and a replica's, in lines.
struct Lines {
    step_hz: f64,
    rate_hz: f64,
    /// The filter's response at each line within the band.
    gains: Vec<Complex64>,
    /// Densities that alias to each line, from the lowest alias on.
    densities: Vec<Vec<f64>>,
    lowest: i32,
}

impl Lines {
    fn new(filter: &FilterSpec, code: &Waveform, [sampler, replica]: [&Sampler; 2]) -> Self {
        let rate_hz = sampler.rate_hz();
        let step_hz = 0.5 * rate_hz / f64::from(STEPS);
        let within = || (0..STEPS).map(|k| (f64::from(k) + 0.5) * step_hz);
        let density = |hz: f64| {
            let met = code.density(hz) * sampler.amplitude(hz) * replica.amplitude(hz);
            met * code.chip_rate_hz()
        };
        let folded = |within_hz: f64| sampler.aliases().map(|k| density(within_hz + f64::from(k) * rate_hz)).collect();
        let response = Response::of(filter, rate_hz);
        let delayed = |hz: f64| response.gain(hz) * phasor(-std::f64::consts::TAU * hz * filter.group_delay_s);
        Self {
            step_hz,
            rate_hz,
            gains: within().map(delayed).collect(),
            densities: within().map(folded).collect(),
            lowest: *sampler.aliases().start(),
        }
    }

    /// Correlation at a delay. The response is that of a real filter about the middle, so one side says all.
    fn correlation(&self, delay_s: f64) -> f64 {
        let turn = |hz: f64| phasor(std::f64::consts::TAU * hz * delay_s);
        let (step, between, mut line) = (turn(self.step_hz), turn(self.rate_hz), turn(0.5 * self.step_hz));
        let lowest = turn(f64::from(self.lowest) * self.rate_hz);
        let mut sum = 0.0;
        for (gain, densities) in self.gains.iter().zip(&self.densities) {
            let start = (Complex64::ZERO, lowest);
            let (folded, _) =
                densities.iter().fold(start, |(sum, phase), density| (sum + phase * density, phase * between));
            sum += (gain * line * folded).re;
            line *= step;
        }
        sum
    }
}

/// Delay of a filter's code at a loop of that discriminator and spacing, for what makes the samples and the
/// replica's; the one that the filter states where its shape does not bend.
pub fn code_delay_s(
    filter: &FilterSpec,
    code: &Waveform,
    samplers: [&Sampler; 2],
    (discriminator, spacing_chips): (CodeDiscriminator, f64),
) -> f64 {
    let middle_s = filter.group_delay_s;
    let FilterShape::Butterworth { .. } = filter.shape else { return middle_s };
    let lines = Lines::new(filter, code, samplers);
    let half_s = 0.5 * spacing_chips / code.chip_rate_hz();
    let late_wins = |at_s: f64| {
        let less_early =
            |side_s: f64| libm::fabs(lines.correlation(at_s + side_s)) - libm::fabs(lines.correlation(at_s - side_s));
        discriminator.pairs().iter().map(|(apart, weight)| weight * less_early(apart * half_s)).sum::<f64>() > 0.0
    };
    let about_s = code.reach_s().min(1.0 / code.chip_rate_hz());
    let (mut low_s, mut high_s) = (middle_s - about_s, middle_s + about_s);
    // To 1e-16 s of a microsecond.
    for _ in 0..34 {
        let at_s = 0.5 * (low_s + high_s);
        if late_wins(at_s) { low_s = at_s } else { high_s = at_s }
    }
    0.5 * (low_s + high_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waveform::Edge;
    use gnss::gps::l1ca::L1_CA;

    /// Delay of C/A in metres behind a Butterworth filter of order 4, `more` samples later than the analogue
    /// one, at half a chip.
    fn delay_m(bandwidth_hz: f64, rate_hz: f64, more: f64, edge: Edge) -> f64 {
        let filter = FilterSpec {
            shape: FilterShape::Butterworth { order: 4 },
            bandwidth_hz,
            group_delay_s: 2.613_126 / (std::f64::consts::PI * bandwidth_hz) + more / rate_hz,
            middle_hz: None,
        };
        let [samples, replica] = [edge, Edge::Area].map(|edge| Sampler::new(edge, rate_hz));
        299_792_458.0
            * code_delay_s(
                &filter,
                &Waveform::of(&L1_CA).unwrap(),
                [&samples, &replica],
                (CodeDiscriminator::EarlyMinusLate, 0.5),
            )
    }

    #[test]
    fn a_wide_filter_delays_a_code_by_its_delay_in_the_middle_and_a_narrow_one_by_more() {
        // 2.6131/(πB) is 12.47 m.
        let wide_m = delay_m(20e6, 50e6, 0.0, Edge::Area);
        assert!((wide_m - 12.47).abs() < 0.5, "{wide_m}");
        // At 2.4 MHz the middle alone has 103.9 m.
        let narrow_m = delay_m(2.4e6, 4e6, 0.0, Edge::Area);
        assert!(narrow_m > 104.9, "{narrow_m}");
    }

    /// Delay by the filter's taps, as a second way to the result. Each tap shifts the correlation of the
    /// samples with the replica's. That correlation is the triangle of the chips, averaged over an interval
    /// once for the replica and once more for samples that are means.
    fn tapped_m(bandwidth_hz: f64, rate_hz: f64, more: f64, edge: Edge) -> f64 {
        let chip_hz = 1.023e6;
        let poles = [5.0, 7.0, 9.0, 11.0].map(|eighths| phasor(std::f64::consts::PI * eighths / 8.0));
        // The transform of the response within the samples' band, by midpoints.
        let tap = |k: i32| -> f64 {
            let line = |n: u32| {
                let cycles = (f64::from(n) + 0.5) / 4000.0 - 0.5;
                let s = Complex64::new(0.0, 2.0 * cycles * rate_hz / bandwidth_hz);
                let gain: Complex64 = poles.iter().map(|pole| 1.0 / (s - pole)).product();
                (gain * phasor(std::f64::consts::TAU * cycles * (f64::from(k) - more))).re
            };
            (0..4000).map(line).sum::<f64>() / 4000.0
        };
        let taps: Vec<f64> = (-20..40).map(tap).collect();
        let width = chip_hz / rate_hz;
        let averaged = |x: f64| match edge {
            // Integrals of |x|/2, over the intervals that they belong to.
            Edge::Area => {
                let cube = |x: f64| x.abs().powi(3) / 12.0;
                (cube(x + width) - 2.0 * cube(x) + cube(x - width)) / (width * width)
            }
            _ => {
                let square = |x: f64| x * x.abs() / 4.0;
                (square(x + 0.5 * width) - square(x - 0.5 * width)) / width
            }
        };
        let triangle = |x: f64| averaged(x + 1.0) - 2.0 * averaged(x) + averaged(x - 1.0);
        let found = |chips: f64| -> f64 {
            taps.iter().enumerate().map(|(k, tap)| tap * triangle((k as f64 - 20.0) * width - chips)).sum::<f64>().abs()
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if found(middle + 0.25) > found(middle - 0.25) { low = middle } else { high = middle }
        }
        299_792_458.0 / chip_hz * low
    }

    #[test]
    fn at_a_low_rate_a_code_is_delayed_as_the_filter_s_taps_delay_it() {
        let (area, nearest) = (Edge::Area, Edge::Nearest);
        for (rate_hz, more, edge) in
            [(2.6e6, 0.0, area), (2.6e6, 0.3, nearest), (4e6, 0.7, area), (4e6, 0.0, nearest), (2.6e6, 0.3, area)]
        {
            let (found_m, tapped_m) = (delay_m(2.2e6, rate_hz, more, edge), tapped_m(2.2e6, rate_hz, more, edge));
            println!("{edge:?} {rate_hz}: {found_m:.4} {tapped_m:.4}");
            // Aliases that are left out have 1e-5 of the density between them, of a chip of 293 m.
            assert!((found_m - tapped_m).abs() < 0.01, "{edge:?} {rate_hz}: {found_m} {tapped_m}");
        }
    }
}
