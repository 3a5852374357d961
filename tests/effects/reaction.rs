//! Response of the receiver to the hardware and the channel, against the theory of its own loops.

use std::f64::consts::TAU;
use std::io::Write;

use analysis::expect::theory::oscillator;
use generator::scene::Scene;
use generator::stream::{Options, generate_with};
use generator::truth;
use gnss::satellite::Sv;
use num_complex::Complex64;
use receiver::track::TrackingSettings;
use receiver::track::closed::Mode;
use study::expect::carrier_loop;

use super::single::{scene, track};

const L1_HZ: f64 = 1.575_42e9;

fn sv() -> Sv {
    "G23".parse().unwrap()
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// Standard deviation of carrier errors (truth − replica) in cycles from `from_s` on, and how many there are.
fn carrier_sigma(scene: &Scene, settings: &TrackingSettings, from_s: f64) -> (f64, usize) {
    let (pairs, _kept) = track(scene, settings);
    let from = (from_s * scene.clock.rate.hz()) as u64;
    let settled = pairs.iter().filter(|(truth, _)| truth.sample >= from);
    let errors: Vec<f64> = settled.map(|(truth, seen)| truth.carrier_cycles - seen.carrier_cycles).collect();
    let middle = mean(&errors);
    (mean(&errors.iter().map(|e| (e - middle).powi(2)).collect::<Vec<_>>()).sqrt(), errors.len())
}

#[test]
fn the_oscillator_adds_to_the_phase_loop_what_its_power_law_says() {
    for (name, law, bandwidth_hz) in [("tcxo", oscillator::TCXO, 12.0), ("ocxo2", oscillator::OCXO, 2.5)] {
        let settings = TrackingSettings {
            pll_bandwidth_hz: bandwidth_hz,
            // The search for symbol edges is not what is measured here.
            cn0_threshold_dbhz: 20.0,
            ..TrackingSettings::default()
        };
        let tables = |clock: &str| {
            format!(
                "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[power]\nkind = \"fixed\"\ncn0_dbhz = 65\n\
                 [noise]\n\
                 [truth]\ninterval_s = 0.05\n{clock}"
            )
        };
        let quiet = carrier_sigma(&scene(sv(), 35.0, &tables("")), &settings, 5.0);
        let noisy = scene(sv(), 35.0, &tables(&format!("[receiver_clock]\noscillator = \"{name}\"\n")));
        let noisy = carrier_sigma(&noisy, &settings, 5.0);
        let update_s = 1e-3 * f64::from(settings.integration);
        let system = carrier_loop(&settings, Mode::Phase, update_s).linear();
        let added = oscillator::jitter_discrete_rad(&law, L1_HZ, &system, update_s) / TAU;
        let found = (noisy.0.powi(2) - quiet.0.powi(2)).sqrt();
        // Errors of a loop of B Hz are alike for about 1/(2B): of 30 s, so many are independent, and a
        // deviation of N values scatters by 1/√(2N); four of that. Flicker and walk are inside the loop's
        // band no slower than B.
        let independent = f64::min(noisy.1 as f64, 2.0 * bandwidth_hz * 30.0);
        let scatter = 4.0 / (2.0 * independent).sqrt();
        let ratio = found / added;
        assert!(
            (ratio - 1.0).abs() < scatter,
            "{name}, {bandwidth_hz} Hz: {:.3}° added, {:.3}° expected, ratio {ratio:.3} within {scatter:.3}; thermal \
             {:.3}°",
            360.0 * found,
            360.0 * added,
            360.0 * quiet.0
        );
    }
}

#[test]
fn a_converter_of_few_bits_costs_the_receiver_what_its_levels_cost() {
    let settings = TrackingSettings::default();
    let cn0 = |format: &str, adc: &str| {
        let tables = format!(
            "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"{format}\"\n[power]\nkind = \"fixed\"\ncn0_dbhz = 45\n\
             [noise]\n{adc}"
        );
        let (pairs, _kept) = track(&scene(sv(), 30.0, &tables), &settings);
        let settled = pairs.iter().filter(|(_, seen)| seen.locked_s > 3.0);
        mean(&settled.map(|(_, seen)| seen.cn0_dbhz).collect::<Vec<_>>())
    };
    let exact = cn0("ci16", "");
    // Max 1960; van Vleck & Middleton 1966: 2/π, 0.8825 and 0.9885 of the signal-to-noise ratio are left.
    for (bits, left) in [(1, 2.0 / std::f64::consts::PI), (2, 0.8825), (4, 0.9885)] {
        let lost = exact - cn0("ci8", &format!("[adc]\nbits = {bits}\n"));
        let expected = -10.0 * libm::log10(left);
        // Each estimate scatters, over 27000 prompts at 45 dB-Hz in symbols of 20, by that of the signal's
        // power, (2s + 1/20)/s² with s = 31.6, and that of the noise's, 2·20/19. Of the latter both share
        // what the levels leave. Four deviations are 0.13, 0.08 and 0.04 dB.
        let (s, prompts) = (31.6, 27e3);
        let variance = 2.0 * ((2.0 * s + 0.05) / (s * s) + (1.0 - left) * 40.0 / 19.0) / prompts;
        let bar = 4.0 * variance.sqrt() * 10.0 / std::f64::consts::LN_10;
        assert!((lost - expected).abs() < bar, "{bits} bits: {lost:.3} dB lost, {expected:.3} expected");
    }
}

/// Correlates what is written with itself as it was first written, a piece at a time.
struct Against<'a> {
    reference: Option<&'a [u8]>,
    kept: Vec<u8>,
    at: usize,
    piece: usize,
    sums: Vec<Complex64>,
}

impl Write for Against<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let Some(reference) = self.reference else {
            self.kept.extend_from_slice(bytes);
            return Ok(bytes.len());
        };
        let value = |x: &[u8]| Complex64::new(f64::from(x[0].cast_signed()), f64::from(x[1].cast_signed()));
        for x in bytes.chunks_exact(2) {
            let index = self.at / self.piece;
            self.sums.resize(index + 1, Complex64::default());
            self.sums[index] += value(x) * value(&reference[2 * self.at..2 * self.at + 2]).conj();
            self.at += 1;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn scintillation_is_found_again_in_the_samples() {
    const SECONDS: f64 = 120.0;
    const RATE_HZ: f64 = 1.5e6;
    // Small enough an S4 for the phase to stay near zero: it need not be unwrapped.
    for (s4, sigma_phi_rad) in [(0.4, 0.6), (0.6, 0.8)] {
        let made = |tables: &str, reference: Option<&[u8]>| {
            let text = format!("[front_end]\nsample_rate_hz = {RATE_HZ}\nformat = \"ci8\"\n{tables}");
            let mut scene = scene(sv(), SECONDS, &text);
            scene.excluded = scene.catalogue.satellites().filter(|other| *other != sv()).collect();
            let directory = tempfile::tempdir().unwrap();
            let mut writer = truth::Writer::create(directory.path()).unwrap();
            let piece = (0.01 * RATE_HZ) as usize;
            let mut sink = Against { reference, kept: Vec::new(), at: 0, piece, sums: Vec::new() };
            generate_with(&scene, &mut sink, &mut writer, &mut |_| (), &Options::default()).unwrap();
            (sink.kept, sink.sums)
        };
        let (plain, _) = made("", None);
        let table = format!("[scintillation]\ns4 = {s4}\nsigma_phi_rad = {sigma_phi_rad}\ndecorrelation_s = 0.1\n");
        let (_, fades) = made(&table, Some(&plain));
        let power: Vec<f64> = fades.iter().map(Complex64::norm_sqr).collect();
        let middle = mean(&power);
        let spread = mean(&power.iter().map(|p| (p - middle).powi(2)).collect::<Vec<_>>()).sqrt();
        let mut last = 0.0;
        let phase: Vec<f64> = (fades.iter())
            .map(|z| {
                last += libm::remainder(z.arg() - last, TAU);
                last
            })
            .collect();
        let origin = mean(&phase);
        let turned = mean(&phase.iter().map(|p| libm::remainder(p - origin, TAU).powi(2)).collect::<Vec<_>>()).sqrt();
        let found = spread / middle;
        // 600 decorrelation times each way; a spread of 600 values scatters by 2.9 %: 10 % are more than
        // three sigma.
        assert!((found / s4 - 1.0).abs() < 0.1, "S4 {found:.3}, set {s4}");
        assert!((turned / sigma_phi_rad - 1.0).abs() < 0.1, "phase {turned:.3} rad, set {sigma_phi_rad}");
    }
}
