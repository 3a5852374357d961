//! Cases 29 to 33: rates, bands and edges of chips.

use std::f64::consts::{PI, TAU};

use gnss_twin::generator::fidelity::Arithmetic;
use gnss_twin::generator::synth::band::Filter;
use gnss_twin::generator::synth::bank::Bank;
use gnss_twin::generator::synth::chips::{CodeTime, Spreading};
use gnss_twin::generator::synth::isa::Level;
use gnss_twin::generator::synth::transmitter::Transmitter;
use gnss_twin::generator::synth::{Edge, Kernel, Run};
use gnss_twin::generator::truth;
use gnss_twin::gnss::gps::l1ca::{self, L1_CA};
use gnss_twin::gnss::satellite::Sv;
use gnss_twin::gnss::time::{Epoch, Rate, tone_turns};
use gnss_twin::receiver::track::TrackingSettings;
use num_complex::Complex64;

use crate::figures::case;
use crate::run;

const CHIP_M: f64 = 299_792_458.0 / 1.023e6;

/// Where the code best matches one period of samples of `edge`, in metres behind the true place, rms over places: the zero
/// of early minus late, half a chip apart, of the continuous correlation below half the rate, by Fourier series.
fn bias_m(rate_khz: usize, edge: Edge<'_>) -> f64 {
    let spreading = Spreading::new(&L1_CA.components[0], 7).unwrap();
    let transform = |x: Vec<f64>| {
        let mut x: Vec<Complex64> = x.into_iter().map(Complex64::from).collect();
        rustfft::FftPlanner::new().plan_fft_forward(x.len()).process(&mut x);
        x
    };
    let chips = transform(l1ca::code(7).unwrap().iter().map(|chip| if *chip { -1.0 } else { 1.0 }).collect());
    let one = 281_474_976_710_656.0;
    let step = (1023.0 / rate_khz as f64 * one) as u64;
    let places = 24;
    let mut sum = 0.0;
    for place in 0..places {
        // Edges meet samples at the same fraction all along the code.
        let start = 11.0 + (f64::from(place) + 0.5) / f64::from(places);
        let mut wave = vec![0.0_f32; rate_khz];
        for (number, i) in wave.chunks_mut(4096).enumerate() {
            let from = start + number as f64 * 4096.0 * 1023.0 / rate_khz as f64;
            let at = CodeTime { period: 0, phase: ((from % 1023.0) * one) as u64 };
            let mut q = vec![0.0_f32; i.len()];
            let mut bank = Bank::default();
            bank.push((0, 4096), 0..i.len(), |bits| {
                let position = spreading.strip(at, step, 4096, |_| false, bits);
                Run { bits: &[], position, step, turns: 0, turns_step: 0, amplitude: 1.0 }
            });
            bank.render(Kernel { edge, arithmetic: Arithmetic::F64, level: Level::detect() }, i, &mut q);
        }
        let wave = transform(wave.into_iter().map(f64::from).collect());
        let cross: Vec<Complex64> = (1..rate_khz.div_ceil(2))
            .map(|k| {
                // The pulse from 0 to 1 chip: sinc, and half a chip of delay; the samples begin at `start`.
                let x = PI * k as f64 / 1023.0;
                let pulse = if k % 1023 == 0 { 0.0 } else { libm::sin(x) / x };
                wave[k]
                    * chips[k % 1023].conj()
                    * pulse
                    * Complex64::from_polar(1.0, TAU * k as f64 * (0.5 - start) / 1023.0)
            })
            .collect();
        let correlation = |delay: f64| {
            let turned = |(k, x): (usize, &Complex64)| {
                (x * Complex64::from_polar(1.0, TAU * (k + 1) as f64 * delay / 1023.0)).re
            };
            cross.iter().enumerate().map(turned).sum::<f64>()
        };
        let (mut low, mut high) = (-0.4, 0.4);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if correlation(middle + 0.25) > correlation(middle - 0.25) { low = middle } else { high = middle }
        }
        sum += (0.5 * (low + high) * CHIP_M).powi(2);
    }
    (sum / f64::from(places)).sqrt()
}

#[test]
fn where_the_rate_meets_the_chips_nearest_edges_are_metres_off_and_band_limited_ones_are_not() {
    let the = case(29, "fs = k · 1.023 MHz at zero Doppler");
    let filter = Filter::new(0.45);
    for rate_khz in [2046, 4092, 10_230] {
        let name = |edge: &str| format!("{:.3} Msps, {edge} edges: rms over places", rate_khz as f64 / 1e3);
        // All edges move by one part of a sample, uniform over it: rms 1/√12 of a sample.
        let sample_m = 299_792.458 / rate_khz as f64;
        the.near(&name("nearest"), bias_m(rate_khz, Edge::Nearest), sample_m / 12.0_f64.sqrt(), 0.05 * sample_m, "m");
        the.at_most(&name("band-limited"), bias_m(rate_khz, Edge::BandLimited(&filter)), 0.1, "m");
    }
    let told = |edge: &str| {
        let text = run::text(
            10.0,
            &format!("{}[front_end]\nsample_rate_hz = 4.092e6\n[power]\ncn0_dbhz = 45\n{edge}", run::PLACE),
        );
        run::try_scene(&text).unwrap().fidelity.code_edge
    };
    use gnss_twin::generator::scene::CodeEdge;
    the.all("balanced chooses edges for it by itself", usize::from(told("") != CodeEdge::Nearest), 1);
}

#[test]
fn on_a_boundary_of_chips_the_index_is_inside_and_to_the_right() {
    let the = case(30, "code phase on a boundary");
    let spreading = Spreading::new(&L1_CA.components[0], 1).unwrap();
    let (mut held, mut of) = (0, 0);
    for second in [0_i64, 1, 604_799, 604_800, 1_000_000_000, 4_000_000_000] {
        for chip in 0..1023 {
            for nudge in [-1e-16, 0.0, 1e-16] {
                // Thousandths of a second hold whole periods; chips at multiples of 1/1.023e6 s are rounded.
                let at = Epoch::new(second, f64::from(chip) / 1.023e6 + nudge + 0.004);
                let place = spreading.at(at, 0.0);
                of += 1;
                held += usize::from(place.phase < 1023 << 48);
            }
        }
        let exact = spreading.at(Epoch::new(second, 0.0), 0.0);
        of += 1;
        held += usize::from(exact.phase == 0 && exact.period == second * 1000);
    }
    the.all("places in 0 ≤ phase < 1023, whole seconds at 0", held, of);
}

#[test]
fn rates_that_do_not_fit_the_code_keep_its_phase() {
    let the = case(31, "fs = 1.1, 4.0009, 100 Msps");
    let mut worst = 0.0_f64;
    for rate_hz in [1.1e6, 2.048e6, 4.0009e6, 100e6] {
        let scene = run::scene(
            600.0,
            &format!(
                "[front_end]\nsample_rate_hz = {rate_hz:e}\nformat = \"cf32\"\n[power]\ncn0_dbhz = 45\n[fidelity]\n\
                 knot_tolerance_cycles = 1e-6\n"
            ),
        );
        let sv = run::in_view(&scene)[0];
        let mut transmitter = Transmitter::new(&scene, sv, &L1_CA, Edge::Nearest).unwrap().unwrap();
        let first = (540.0 * rate_hz) as u64;
        transmitter.prepare(&scene, first, first + (rate_hz as u64)).unwrap();
        for k in 0..997 {
            let n = first + k * (rate_hz as u64) / 1000;
            let (_, place) = transmitter.phases(&scene, n).unwrap();
            let seen = truth::seen(&scene, sv, &L1_CA, scene.clock.epoch(n)).unwrap().unwrap();
            let sent = scene.clock.epoch(n).plus_s(-seen.arrivals[0].delay_s);
            // Integers where they can be: milliseconds are whole periods.
            let of_period = (sent.fraction() * 1e3).fract() * 1023.0;
            let apart = (of_period - place.phase as f64 / 281_474_976_710_656.0) / 1023.0;
            worst = worst.max((apart - apart.round()).abs() * 1023.0);
        }
    }
    // Knots of 1e-6 cycle are 6.5e-10 chip, the place itself resolves 1e-10.
    the.at_most("code after 9 min against the delay", worst, 1e-9, "chip");
    let rate = Rate::from_hz(4.0009e6).unwrap();
    let lengths: std::collections::BTreeSet<u64> =
        (0..5000).map(|ms| rate.first_sample_at(ms + 1, 1000) - rate.first_sample_at(ms, 1000)).collect();
    the.all("4.0009 Msps: epochs of 4000 or 4001 samples", usize::from(lengths.into_iter().eq([4000, 4001])), 1);
}

#[test]
fn folded_and_mirrored_bands_give_the_doppler_its_sign() {
    let the = case(32, "real IF, folded, mirrored");
    let sv = Sv::gps(23);
    let settings = TrackingSettings::default();
    let (mut held, mut of) = (0, 0);
    // IF within the band, and upside down there; what the samples of a carrier above half the rate, or above all of it, hold.
    for (made_hz, inverted, told_hz, told_inverted) in [
        (1.3e6, false, 1.3e6, false),
        (1.3e6, true, 1.3e6, true),
        (1.3e6, false, 6.5e6, false),
        (1.3e6, true, 3.9e6, false),
        (1.3e6, false, 3.9e6, true),
    ] {
        let tables = format!(
            "[front_end]\nsample_rate_hz = 5.2e6\nif_hz = {made_hz}\nspectrum_inverted = {inverted}\nformat = \"ri8\"\n[noise]\n\
             [power]\ncn0_dbhz = 50\n"
        );
        let mut scene = run::only(run::scene(2.0, &tables), &[sv]);
        let bytes = run::samples(&scene);
        let truth_hz = run::hit(&scene, sv, 0.0, 0.0).doppler_hz;
        let hit = run::hit(&scene, sv, 0.2, 20.0);
        let sense = if told_inverted { -1.0 } else { 1.0 };
        scene.metadata.center_hz = L1_CA.carrier_hz - sense * told_hz;
        scene.metadata.inverted = told_inverted;
        assert!((scene.metadata.if_hz(&L1_CA).abs() - told_hz).abs() < 1e-3);
        let (channel, report) = run::track(&scene, &bytes, &hit, &settings, 520_000);
        let last = report.measurements.last().unwrap();
        of += 1;
        held += usize::from(
            !channel.is_lost()
                && last.locked
                && (last.doppler_hz - truth_hz).abs() < 5.0
                && run::code_error_m(&scene, sv, last.sample, last.code_fraction).abs() < 10.0,
        );
    }
    the.all("locked with Doppler, its sign and code right", held, of);
    let text =
        run::text(10.0, &format!("{}[front_end]\nsample_rate_hz = 5.2e6\nformat = \"ri8\"\n[power]\n", run::PLACE));
    let beyond = run::text(
        10.0,
        &format!("{}[front_end]\nsample_rate_hz = 5.2e6\nif_hz = 6.5e6\nformat = \"ri8\"\n[power]\n", run::PLACE),
    );
    the.all(
        "scene that would fold: refused with the limit",
        usize::from(run::try_scene(&beyond).is_err_and(|e| e.contains("2600000 Hz"))),
        1,
    );
    the.all(
        "real samples at no IF: refused",
        usize::from(run::try_scene(&text).is_err_and(|e| e.contains("front_end.if_hz"))),
        1,
    );
}

#[test]
fn a_quarter_of_the_rate_is_exactly_four_samples() {
    let the = case(33, "f_IF = fs/4");
    let (mut exact, mut of) = (0, 0);
    for rate_hz in [2.6e6, 4e6, 16.368e6, 50e6] {
        let rate = Rate::from_hz(rate_hz).unwrap();
        for n in (0..4000).chain((1 << 40)..(1 << 40) + 4000) {
            of += 1;
            exact += usize::from(tone_turns(rate_hz / 4.0, rate, n) == (n % 4) << 62);
        }
    }
    the.all("phase is a multiple of a quarter turn, to the last bit", exact, of);
    // The signal there against f64: the reference's arithmetic, sample by sample.
    let made = |level: &str| {
        let tables = format!(
            "[front_end]\nsample_rate_hz = 10.4e6\nif_hz = 2.6e6\nformat = \"cf32\"\n[power]\ncn0_dbhz = 45\n[fidelity]\n\
             level = \"reference\"\ncarrier = \"{level}\"\n"
        );
        let scene = run::only(run::scene(0.02, &tables), &[Sv::gps(23)]);
        run::planes(&scene, &run::samples(&scene))
    };
    let ((i, q), (a, b)) = (made("f32"), made("f64"));
    let amplitude = i.iter().zip(&q).map(|(i, q)| i.hypot(*q)).fold(0.0, f32::max);
    let worst = i.iter().zip(&a).chain(q.iter().zip(&b)).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max);
    // Within a run the carrier of single precision is 1e-6 cycle off, 6.3e-6 rad, and rounded to 6e-8.
    the.at_most("fast against f64, of the amplitude", f64::from(worst / amplitude), 1e-5, "");
}
