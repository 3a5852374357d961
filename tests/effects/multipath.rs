//! Reflected rays against the theory of code multipath, through samples and the receiver's code loop.

use generator::effect::multipath::{Detour, Echo, Multipath};
use gnss::record::{RayRow, SkyRow};
use gnss::satellite::Sv;
use nalgebra::Vector3;
use receiver::correlate::Edge;
use receiver::track::{CodeDiscriminator, TrackingSettings};

use super::single::{code_error_m, rows, samples, scene, track};

const CHIP_M: f64 = 293.052_256_1;
const WAVELENGTH_M: f64 = 0.190_293_672_8;
/// The satellite near the zenith of static.toml.
const SV: u8 = 23;

/// Error of an early-late loop with one echo of amplitude `a` (negative in anti-phase) after `delay` chips,
/// unlimited bandwidth and spacing `d`: the zero of |E| − |L| on the sides of two triangles (van Nee 1993;
/// Braasch 1996).
fn envelope_chips(a: f64, delay: f64, d: f64) -> f64 {
    if delay <= 0.5 * (1.0 + a) * d {
        a * delay / (1.0 + a)
    } else if delay <= 1.0 - 0.5 * d + 0.5 * a * d {
        0.5 * a * d
    } else if delay <= 1.0 + 0.5 * d {
        a * (1.0 + 0.5 * d - delay) / (2.0 - a)
    } else {
        0.0
    }
}

/// Error of a double delta loop with one echo: the zero of the sum of two pairs on the sides of two
/// triangles. Of the inner pair early less late is 2x, d and 1 − x + d/2, of the outer one 2x, 2d and 1 − x +
/// d (McGraw and Braasch 1999).
fn double_delta_chips(a: f64, delay: f64, d: f64) -> f64 {
    if delay <= 0.5 * (1.0 + a) * d {
        a * delay / (1.0 + a)
    } else if delay <= d {
        a * (d - delay) / (1.0 - a)
    } else if delay <= 1.0 - d {
        0.0
    } else if delay <= 1.0 - 0.5 * d + 0.25 * a * d {
        a * (delay - 1.0 + d) / (2.0 + a)
    } else if delay <= 1.0 + 0.5 * d - 0.25 * a * d {
        a * (1.0 - delay) / (2.0 - a)
    } else if delay <= 1.0 + d {
        -a * (1.0 + d - delay) / (2.0 + a)
    } else {
        0.0
    }
}

#[test]
fn the_code_loop_s_error_keeps_to_the_envelope_of_theory() {
    let mut worst = 0.0_f64;
    let early_late = [1.0, 0.5, 0.1].map(|spacing_chips| (CodeDiscriminator::EarlyMinusLate, spacing_chips));
    for (dll_discriminator, spacing_chips) in early_late.into_iter().chain([(CodeDiscriminator::DoubleDelta, 0.4)]) {
        for (phase_deg, a) in [(0.0, 0.5), (180.0, -0.5)] {
            for delay in [0.02, 0.3, 0.7, 1.0] {
                // Whole cycles of excess, so that the phase at the antenna is that of the reflection.
                let excess_m = (delay * CHIP_M / WAVELENGTH_M).round() * WAVELENGTH_M;
                let tables = format!(
                    "[front_end]\nsample_rate_hz = 11.7e6\nformat = \"cf32\"\n[power]\ncn0_dbhz = 50\n\
                     [fidelity]\ncode_edge = \"nearest\"\n\
                     [[multipath]]\nkind = \"given\"\nexcess_m = {excess_m}\namplitude = 0.5\nphase_deg = {phase_deg}\n"
                );
                let settings = TrackingSettings {
                    dll_discriminator,
                    spacing_chips,
                    replica: Edge::Nearest,
                    dll_bandwidth_hz: 5.0,
                    dll_pull_in_bandwidth_hz: 10.0,
                    integration: 1,
                    ..TrackingSettings::default()
                };
                let (pairs, _directory) = track(&scene(Sv::gps(SV), 1.6, &tables), &settings);
                let late: Vec<f64> = pairs.iter().rev().take(4).map(|(truth, m)| code_error_m(truth, m)).collect();
                assert_eq!(late.len(), 4, "not locked");
                let mean_m = late.iter().sum::<f64>() / 4.0;
                let envelope = if dll_discriminator == CodeDiscriminator::DoubleDelta {
                    double_delta_chips
                } else {
                    envelope_chips
                };
                let expected_m = envelope(a, excess_m / CHIP_M, spacing_chips) * CHIP_M;
                // Chips sampled at 11.44 a chip put an edge within 1.1 m by a sample, of which the 512 edges
                // of a period leave 1.1/√512 = 0.05 m; the loop has had at least ten of its time constants
                // (0.05 s).
                worst = worst.max((mean_m - expected_m).abs());
                assert!(
                    (mean_m - expected_m).abs() < 0.3,
                    "{spacing_chips} {phase_deg} {delay}: {mean_m} {expected_m}"
                );
            }
        }
    }
    println!("worst departure from the envelope {worst:.3} m");
}

#[test]
fn a_ground_reflection_fades_with_the_period_of_its_geometry() {
    let height_m = 30.0;
    let tables = format!(
        "[front_end]\nsample_rate_hz = 2.6e6\n[power]\ncn0_dbhz = 50\n[noise]\n\
         [[multipath]]\nkind = \"ground\"\nheight_m = {height_m}\namplitude = 0.5\n"
    );
    // G28 stands low, where elevation counts most and the excess is a small part of a chip.
    let settings = TrackingSettings { cn0_average_s: 0.5, ..TrackingSettings::default() };
    let (pairs, directory) = track(&scene(Sv::gps(28), 60.0, &tables), &settings);
    let sky: Vec<SkyRow> = rows(directory.path(), "sky.csv");
    let rays: Vec<RayRow> = rows(directory.path(), "rays.csv");
    let expected: Vec<(u64, f64, f64)> = sky
        .iter()
        .map(|row| {
            // The image of the antenna in the ground, and a field turned round.
            let excess_m = 2.0 * height_m * libm::sin(row.elevation_deg.to_radians());
            let cycles = 0.5 - excess_m / WAVELENGTH_M;
            (row.sample, excess_m, cycles - cycles.floor())
        })
        .collect();
    for ((sample, excess_m, cycles), ray) in expected.iter().zip(&rays) {
        assert_eq!((*sample, ray.ray, ray.amplitude_ratio), (ray.sample, 1, 0.5));
        let miss = ray.phase_cycles - cycles;
        // Degrees are printed in full; the wavelength above has ten digits: 7 m of 2e-11.
        assert!((ray.excess_m - excess_m).abs() < 1e-6 && (miss - miss.round()).abs() < 1e-5, "{ray:?} {cycles}");
    }
    // Power of the sum where the code loop (0.5 chip) puts its prompt; the estimate lags by its mean of 0.5
    // s.
    let (mut sum, mut count, mut least, mut most) = (0.0, 0, f64::MAX, f64::MIN);
    // Means over samples leave 1 − d/3 of C/A, −0.61 dB.
    let direct_dbhz = 50.0 + 10.0 * libm::log10(1.0 - 1.023 / 2.6 / 3.0);
    for (truth, measured) in pairs.iter().filter(|(truth, _)| truth.sample > 5 * 2_600_000) {
        let (_, excess_m, cycles) = expected.iter().find(|row| row.0 == truth.sample).unwrap();
        let (delay, phase) = (excess_m / CHIP_M, std::f64::consts::TAU * cycles);
        let at = |code: f64| {
            let [direct, echo] = [code, code - delay].map(|x| (1.0 - x.abs()).max(0.0));
            let (re, im) = (direct + 0.5 * echo * libm::cos(phase), 0.5 * echo * libm::sin(phase));
            re * re + im * im
        };
        let (mut low, mut high) = (-0.2, 0.2);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            let early_is_stronger = at(middle - 0.25) > at(middle + 0.25);
            if early_is_stronger { high = middle } else { low = middle }
        }
        let expected_dbhz = direct_dbhz + 10.0 * libm::log10(at(0.5 * (low + high)));
        let miss = measured.cn0_dbhz - expected_dbhz;
        (sum, count) = (sum + miss, count + 1);
        (least, most) = (least.min(measured.cn0_dbhz), most.max(measured.cn0_dbhz));
        // 0.14 dB rms of a second's estimate at 40 dB-Hz and more, 0.2 of half a second's, five sigma; half a
        // second of lag at 20 s a fade and 9.5 dB of swing is at most 0.5 dB more where the fade is deepest.
        assert!(miss.abs() < 1.5, "{miss} at {}", truth.sample);
    }
    let mean_db = sum / f64::from(count);
    println!("C/N0 against the closed form: mean {mean_db:.2} dB, from {least:.1} to {most:.1} dB-Hz");
    assert!(mean_db.abs() < 0.3, "{mean_db}");
    // 20 lg 1.5 = 3.5 dB up and 20 lg 0.5 = 6.0 dB down, less the echo's lost correlation.
    assert!(most > direct_dbhz + 2.5 && least < direct_dbhz - 4.5, "{least} {most}");
}

#[test]
fn an_echo_of_no_amplitude_changes_no_bit() {
    let directory = tempfile::tempdir().unwrap();
    let mut plain = scene(Sv::gps(SV), 0.3, "[power]\ncn0_dbhz = 45\n");
    let without = samples(&plain, directory.path());
    plain.effects.push(Box::new(Multipath {
        echoes: vec![Echo {
            detour: Detour::Given { excess_m: 20.0, rate_mps: 3.0 },
            amplitude: 0.0,
            phase_cycles: 0.1,
            satellites: Vec::new(),
        }],
        start: plain.clock.start,
        origin_m: Vector3::new(1.0, 0.0, 0.0),
    }));
    assert!(samples(&plain, directory.path()) == without);
}
