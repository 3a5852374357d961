//! What edges between samples do to a code: errors of pseudoranges by waveform and sample rate.
//!
//! A sample is the waveform behind what an edge stands for, a mean over the sample's interval or nothing at
//! all, and what that leaves above half the rate folds back as a code of its own. Where a Doppler moves the
//! code over the samples the error moves with it and a loop averages it; a code at rest keeps it.

use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::{Component, Signal, sinc_squared};

use super::CodeEdge;

/// Largest error of a code at rest that `balanced` leaves, whatever the noise.
pub(super) const LARGEST_BIAS_M: f64 = 0.2;
/// Noise bandwidth of the code loop behind which the plan states a moving code's error.
pub(super) const LOOP_HZ: f64 = 0.5;
/// Longest time over which a code's own lines count: a longer code is correlated in pieces.
const LONGEST_S: f64 = 0.02;
/// Rate and spacing of the correlator whose noise hides an error.
const CHIP_HZ: f64 = 1.023e6;

/// Error of a signal's code whose phase is at rest on the sampling grid, root mean square over phases, in
/// metres, of the component for which it is largest.
pub fn code_bias_m(edge: CodeEdge, signal: &Signal, rate_hz: f64) -> f64 {
    let of = |component: &Component| match edge {
        CodeEdge::BandLimited => 1e-4,
        _ => aliased_bias_m(edge, component, rate_hz),
    };
    let everywhere = signal.components.iter().map(of).fold(0.0, f64::max);
    everywhere.max(standing_bias_m(edge, signal, rate_hz))
}

/// The same where a Doppler of the carrier moves the code over the grid, behind a code loop of `LOOP_HZ`: the
/// error repeats with each sample that the code moves by, and a first-order loop of noise bandwidth B passes
/// `1 / √(1 + (2πν / 4B)²)` of it.
pub(super) fn moving_bias_m(edge: CodeEdge, signal: &Signal, rate_hz: f64, doppler_hz: f64) -> f64 {
    let samples_per_s = doppler_hz / signal.centre_hz() * rate_hz;
    code_bias_m(edge, signal, rate_hz) / libm::hypot(1.0, std::f64::consts::TAU * samples_per_s / (4.0 * LOOP_HZ))
}

/// Error of a component's code at rest, root mean square over codes and phases, in metres.
///
/// An early-minus-late correlator of spacing d weighs the frequency f by `w = 2 sin(πfd)`. The code's lines
/// are 1/T apart, T its period, with the powers of the waveform's density `p(f)`, and those that fold back,
/// `p(f + k·fs)` times what the edge leaves of them, have the phases of a random code: they add up by power.
/// `σ² = 1/T ∫ 2w² p(f) Σ_k p(f + k·fs) H²(f + k·fs) df` from zero to half the rate, against the slope `∫ 2w
/// · 2πf · H(f) p(f) df`; H is 1 for nearest edges and sinc(f/fs) for area edges. d is half a step of the
/// strongest layer: half a chip without a sub-carrier. An independent correlator on real codes of C/A found
/// 0.14 m at 2.6 and 0.20 m at 2.048 Msps with area edges, where this gives 0.15 and 0.33: near a multiple of
/// the chip rate it is a bound.
fn aliased_bias_m(edge: CodeEdge, component: &Component, rate_hz: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    const POINTS: u32 = 1500;
    // Zones that fold back behind a mean fall with the fourth power of their number.
    const FOLDS: i32 = 4;
    let shape = component.shape();
    let steps = component.strongest().map_or(1, |layer| layer.pulse.len().max(1));
    let spacing_s = 0.5 / (component.chip_rate_hz * steps as f64);
    let period_s = (f64::from(component.code_chips) / component.chip_rate_hz).min(LONGEST_S);
    // All zones together are the spectrum of the correlation at whole samples.
    let reach = (shape.chip_s() * rate_hz) as i32 + 1;
    let lags: Vec<f64> = (0..=reach).map(|lag| shape.correlation(f64::from(lag) / rate_hz)).collect();
    let zones = |hz: f64| {
        let turn = TAU * hz / rate_hz;
        let sum: f64 = (0..).zip(&lags).skip(1).map(|(lag, value)| value * libm::cos(turn * f64::from(lag))).sum();
        (lags.first().copied().unwrap_or(1.0) + 2.0 * sum) / rate_hz
    };
    let cell_hz = 0.5 * rate_hz / f64::from(POINTS);
    let (mut noise, mut slope) = (0.0, 0.0);
    for point in 0..POINTS {
        let hz = (f64::from(point) + 0.5) * cell_hz;
        let (weight, density) = (2.0 * libm::sin(PI * hz * spacing_s), shape.density(hz));
        let (left, folded) = match edge {
            CodeEdge::Area => {
                let zone = |k: i32| {
                    let hz = hz + f64::from(k) * rate_hz;
                    shape.density(hz) * sinc_squared(hz / rate_hz)
                };
                let folds = (-FOLDS..=FOLDS).filter(|k| *k != 0);
                (sinc_squared(hz / rate_hz).sqrt(), folds.map(zone).sum::<f64>())
            }
            _ => (1.0, zones(hz) - density),
        };
        noise += 2.0 * weight * weight * density * folded.max(0.0) * cell_hz;
        slope += 2.0 * weight * TAU * hz * left * density * cell_hz;
    }
    SPEED_OF_LIGHT_MPS * (noise / period_s).sqrt() / slope
}

/// Error of the code that a scene's own noise hides, in metres: that of a delay loop on its strongest signal,
/// 0.2 m at most.
///
/// Thermal noise of a loop of bandwidth B with correlators d chips apart is √(B·d / (2·C/N0)) chips where
/// T·C/N0 is far above one (Kaplan & Hegarty, equation 5.23, first branch). With 1 Hz and half a chip of
/// 1.023 MHz it is 0.2 m at 57 dB-Hz: above what any GPS signal reaches on the ground (52 dB-Hz, 0.37 m), so
/// that only signals set stronger than nature's ask for less. Without noise nothing hides an error, and the
/// 0.2 m apply by themselves.
pub fn allowed_m(cn0_dbhz: Option<f64>) -> f64 {
    const BANDWIDTH_HZ: f64 = 1.0;
    const SPACING_CHIPS: f64 = 0.5;
    cn0_dbhz.map_or(LARGEST_BIAS_M, |cn0_dbhz| {
        let cn0_hz = libm::pow(10.0, 0.1 * cn0_dbhz);
        let noise_m = SPEED_OF_LIGHT_MPS / CHIP_HZ * (BANDWIDTH_HZ * SPACING_CHIPS / (2.0 * cn0_hz)).sqrt();
        noise_m.min(LARGEST_BIAS_M)
    })
}

/// Error where every chip of a signal meets the same few places between samples, root mean square, in metres.
///
/// With `q` places in turn, nearest edges know the code to a sample in `q` (uniform: over √12); for area
/// edges it falls with the square, from 1.6 m measured with C/A at 4.092 Msps, and with the chip.
pub(super) fn standing_bias_m(edge: CodeEdge, signal: &Signal, rate_hz: f64) -> f64 {
    let of = |component: &Component| {
        let chip_hz = component.chip_rate_hz;
        // Places drift apart within a code period when the ratio misses by more than this.
        let meets = |q: u32| {
            let samples = f64::from(q) * rate_hz / chip_hz;
            (samples - samples.round()).abs() < 1.0 / f64::from(component.code_chips)
        };
        let Some(q) = (1..=32).find(|q| meets(*q)) else { return 0.0 };
        let finest_hz = f64::from(q) * rate_hz;
        match edge {
            CodeEdge::Nearest => SPEED_OF_LIGHT_MPS / finest_hz / 12_f64.sqrt(),
            CodeEdge::Area => 1.6 * (4.0 * chip_hz / finest_hz).powi(2) * 1.023e6 / chip_hz,
            CodeEdge::BandLimited => 0.0,
        }
    };
    signal.components.iter().map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;

    #[test]
    fn area_edges_err_by_what_folds_back_and_less_as_the_code_moves() {
        let component = &L1_CA.components[0];
        // The sum over the lines of C/A in another language, whose integral this is; and figures of an
        // independent correlator on real codes, 0.14 and 0.02 m, within what five codes scatter about the
        // mean of all.
        for (rate_hz, expected_m) in [(2.048e6, 0.3273), (2.6e6, 0.1515), (5e6, 0.0563), (10e6, 0.0202), (25e6, 0.0038)]
        {
            let found_m = aliased_bias_m(CodeEdge::Area, component, rate_hz);
            assert!((found_m / expected_m - 1.0).abs() < 0.01, "{rate_hz}: {found_m}");
        }
        // Nearest edges at 10 Msps: 0.1895 m measured by correlation (`reports/trade.csv`).
        let nearest_m = aliased_bias_m(CodeEdge::Nearest, component, 10e6);
        assert!((nearest_m / 0.1895 - 1.0).abs() < 0.1, "{nearest_m}");
        let still_m = code_bias_m(CodeEdge::Area, &L1_CA, 2.6e6);
        assert_eq!(moving_bias_m(CodeEdge::Area, &L1_CA, 2.6e6, 0.0), still_m);
        // 1 kHz: 0.649 chips or 1.65 samples a second, against a corner of 2 rad/s.
        let share = moving_bias_m(CodeEdge::Area, &L1_CA, 2.6e6, 1000.0) / still_m;
        assert!((share - 0.1895).abs() < 1e-3, "{share}");
    }

    #[test]
    fn what_noise_hides_falls_with_its_root() {
        // σ = 293.05 m · √(0.25 / 10^(x/10)): 0.46 m at 50 dB-Hz, hidden under the cap, and 0.2 m at 57.3
        // dB-Hz.
        assert_eq!((allowed_m(None), allowed_m(Some(50.0))), (0.2, 0.2));
        assert!((allowed_m(Some(70.0)) - 0.046_335).abs() < 1e-6);
    }
}
