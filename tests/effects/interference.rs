//! Waveforms against the closed forms of their spectra, and the laws of stages.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use analysis::measure::psd::Psd;
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stage::{Block, Stage};
use generator::stream::{Options, generate_with};
use generator::synth::isa::Level;
use generator::truth;
use generator::vehicle::{Knot, Motion, Trajectory};
use gnss::earth::Geodetic;
use gnss::samples::Format;
use nalgebra::Vector3;

/// A scene with that interference; `more` adds to `[front_end]`.
fn scene_in(directory: &Path, rate_hz: f64, more: &str, interference: &str) -> (Scene, Vec<String>) {
    let text = format!(
        "name = \"jammed\"\nstart = 2010-07-01T08:12:30\nduration_s = 2\nseed = 11\n\
         [motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 120\n\
         [power]\ncn0_dbhz = 45\n[noise]\n[front_end]\nsample_rate_hz = {rate_hz}\nformat = \"cf32\"\n{more}\n\
         {interference}"
    );
    Scenario::parse(&text, "jammed.toml").unwrap().compose(directory, &Overrides::default()).unwrap()
}

pub(super) fn scene(rate_hz: f64, interference: &str) -> Scene {
    scene_in(Path::new("."), rate_hz, "", &format!("[[interference]]\n{interference}\n")).0
}

/// Samples of the first source alone from `start` on, in units of its amplitude.
pub(super) fn alone(scene: &Scene, start: u64, samples: usize) -> Vec<(f64, f64)> {
    let (mut i, mut q) = (vec![0.0_f32; samples], vec![0.0_f32; samples]);
    for (k, (i, q)) in (0_u64..).zip(i.chunks_mut(1 << 15).zip(q.chunks_mut(1 << 15))) {
        let mut block = Block { start: start + (k << 15), i, q, lead: 0, tail: 0, clipped: 0, level: Level::detect() };
        scene.interference[0].act(&mut block);
    }
    let source = &scene.interference[0];
    let unit = 1.0 / source.tuning.amplitude_lsb(source.jn0_hz);
    i.iter().zip(&q).map(|(i, q)| (f64::from(*i) * unit, f64::from(*q) * unit)).collect()
}

/// Samples of a whole scene, in LSB.
pub(super) fn generated(scene: &Scene) -> Vec<(f64, f64)> {
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    generate_with(scene, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap();
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Format::Cf32Le.unpack(&bytes, &mut i, &mut q);
    i.iter().zip(&q).map(|(i, q)| (f64::from(*i), f64::from(*q))).collect()
}

/// Power of the component that turns `cycles` times over all the samples.
fn line(samples: &[(f64, f64)], cycles: i64) -> f64 {
    let n = samples.len() as i64;
    let (mut re, mut im) = (0.0, 0.0);
    for (k, (i, q)) in (0_i64..).zip(samples) {
        let (sin, cos) = libm::sincos(TAU * (k * cycles).rem_euclid(n) as f64 / n as f64);
        re += i * cos + q * sin;
        im += q * cos - i * sin;
    }
    (re * re + im * im) / (n * n) as f64
}

/// Fresnel's C(x) + jS(x): power series below 3.5 (terms up to e^19, 2e-8 lost), auxiliary functions above
/// (Abramowitz and Stegun 7.3.9, 7.3.27; the first terms left out are 3e-6 of 1/πx).
fn fresnel(x: f64) -> (f64, f64) {
    let z = x.abs();
    let a = 0.5 * PI * z * z;
    let (c, s) = if z < 3.5 {
        let (mut c, mut s, mut term) = (0.0, 0.0, z);
        for k in 0..120 {
            let share = term / f64::from(2 * k + 1);
            match k % 4 {
                0 => c += share,
                1 => s += share,
                2 => c -= share,
                _ => s -= share,
            }
            term *= a / f64::from(k + 1);
        }
        (c, s)
    } else {
        let u = 1.0 / (2.0 * a).powi(2);
        let f = (1.0 - 3.0 * u + 105.0 * u * u - 10_395.0 * u * u * u) / (PI * z);
        let g = (1.0 - 15.0 * u + 945.0 * u * u) / (PI * PI * z.powi(3));
        let (sin, cos) = libm::sincos(a);
        (0.5 + f * sin - g * cos, 0.5 - f * cos - g * sin)
    };
    (c.copysign(x), s.copysign(x))
}

/// ∫₀¹ exp(j2π(m(u² − u)/2 − au)) du by Fresnel integrals.
fn sweep(m: f64, a: f64) -> (f64, f64) {
    let middle = 0.5 + a / m;
    let scale = (2.0 * m).sqrt();
    let (upper, lower) = (fresnel(scale * (1.0 - middle)), fresnel(-scale * middle));
    let (re, im) = ((upper.0 - lower.0) / scale, (upper.1 - lower.1) / scale);
    let (sin, cos) = libm::sincos(-PI * m * middle * middle);
    (re * cos - im * sin, re * sin + im * cos)
}

#[test]
fn a_cw_keeps_its_phase_over_a_month_and_is_one_line() {
    let scene = scene(50e6, "kind = \"cw\"\noffset_hz = 1234567.891\njs_db = 40");
    let start = 30 * 86_400 * 50_000_000_u64 / 4096 * 4096;
    let samples = alone(&scene, start, 4096);
    for (k, (i, q)) in (0_u64..).zip(&samples) {
        // 1 234 567.891 Hz at 50 Msps in integers: thousandths of a cycle by 5e10.
        let turns = (u128::from(start + k) * 1_234_567_891 % 50_000_000_000) as f64 / 5e10;
        let (sin, cos) = libm::sincos(TAU * turns);
        // Sines within 3e-7, the sum in f32 6e-8, amplitude rounded to 6e-8.
        assert!((i - cos).abs() < 6e-7 && (q - sin).abs() < 6e-7, "{k}");
    }
}

#[test]
fn a_chirp_and_an_fmcw_have_the_lines_of_fresnel_s_integrals() {
    // Sweeps of 1 MHz in 8 us: 8 cycles of reach; lines 125 (62.5) kHz apart, 160 (320) samples a period.
    let chirp = alone(&scene(20e6, "kind = \"chirp\"\nsweep_hz = 1e6\nsweep_s = 8e-6\njs_db = 20"), 0, 3200);
    let fmcw = alone(&scene(20e6, "kind = \"fmcw\"\nsweep_hz = 1e6\nsweep_s = 8e-6\njs_db = 20"), 0, 3200);
    let mut total = 0.0;
    for k in -14..=14_i64 {
        let (re, im) = sweep(8.0, k as f64);
        let expected = re * re + im * im;
        let found = line(&chirp, 20 * k);
        total += found;
        // Lines beyond ±10 MHz, 8/(2π·80²) in amplitude, fold onto these: 2e-4 · 2 · 0.35.
        assert!((found - expected).abs() < 1.5e-4, "chirp line {k}: {found} {expected}");
        // Up, then down: the second half is the conjugate of the first one's mirror, half a period later.
        let (up, mirror) = (sweep(8.0, 0.5 * k as f64), sweep(8.0, -0.5 * k as f64));
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        let expected = (0.5 * (up.0 + sign * mirror.0)).powi(2) + (0.5 * (up.1 - sign * mirror.1)).powi(2);
        let found = line(&fmcw, 10 * k);
        assert!((found - expected).abs() < 1.5e-4, "fmcw line {k}: {found} {expected}");
    }
    assert!((total - 1.0).abs() < 0.01, "{total}");
}

#[test]
fn a_sweep_that_leaves_the_band_has_its_lines_inside_and_nothing_else() {
    // 40 MHz in 8 us about 25 MHz above the centre of 20 MHz: it enters the band and leaves it in 1 us.
    let scene = scene(20e6, "kind = \"chirp\"\noffset_hz = 25e6\nsweep_hz = 40e6\nsweep_s = 8e-6\njs_db = 20");
    let row = scene.interference[0].row(1, 0).unwrap();
    assert!((row.frequency_hz - 25e6).abs() < 1e-2, "{row:?}");
    let samples = alone(&scene, 0, 3200);
    let mut total = 0.0;
    for k in -80..80_i64 {
        let (re, im) = sweep(320.0, (k - 200) as f64);
        let (found, expected) = (line(&samples, 20 * k), re * re + im * im);
        total += expected;
        // Of 1/320 an interpolator with 80 dB in its stop band leaves 6e-7.
        assert!((found - expected).abs() < 2e-6, "line {k}: {found} {expected}");
    }
    let power = samples.iter().map(|(i, q)| i * i + q * q).sum::<f64>() / 3200.0;
    assert!((power / total - 1.0).abs() < 1e-3 && (0.1..0.15).contains(&total), "{power} {total}");
}

/// Bessel function of the first kind by its power series.
fn bessel(order: i32, x: f64) -> f64 {
    let mut term = (1..=order).fold(1.0, |product, k| product * 0.5 * x / f64::from(k));
    let mut sum = 0.0;
    for k in 1..60 {
        sum += term;
        term *= -0.25 * x * x / f64::from(k * (k + order));
    }
    sum
}

#[test]
fn sinusoidal_fm_has_the_lines_of_bessel_s_functions() {
    // Abramowitz and Stegun, table 9.1: J0(5), J1(5).
    assert!((bessel(0, 5.0) + 0.177_596_771_3).abs() < 1e-9 && (bessel(1, 5.0) + 0.327_579_137_6).abs() < 1e-9);
    // Index 5 at 10 kHz: 400 samples a period.
    let samples = alone(&scene(4e6, "kind = \"sine_fm\"\ndeviation_hz = 5e4\nrate_hz = 1e4\njs_db = 20"), 0, 4000);
    for k in -9..=9 {
        let expected = bessel(i32::abs(k), 5.0).powi(2);
        let found = line(&samples, 10 * i64::from(k));
        // Sines within 3e-7, times the index.
        assert!((found - expected).abs() < 5e-6, "{k}: {found} {expected}");
    }
}

#[test]
fn a_pulse_train_has_the_lines_of_a_sampled_rectangle_and_jitter_takes_them_away() {
    let pulses = |jitter: f64| {
        let text = format!("kind = \"pulse\"\nwidth_s = 1e-5\nrate_hz = 1e4\njitter = {jitter}\njs_db = 20");
        alone(&scene(10e6, &text), 0, 1_000_000)
    };
    let regular = pulses(0.0);
    assert_eq!(regular.iter().filter(|(i, q)| (*i, *q) != (0.0, 0.0)).count(), 100_000);
    for k in [0_i64, 1, 2, 5, 9, 10, 11, 25, 43] {
        // 100 of 1000 samples: the geometric sum.
        let (x, y) = (PI * k as f64 * 0.1, PI * k as f64 / 1000.0);
        let expected = if k == 0 { 0.01 } else { (libm::sin(x) / (1000.0 * libm::sin(y))).powi(2) };
        let found = line(&regular, 1000 * k);
        assert!((found - expected).abs() < 1e-8, "{k}: {found} {expected}");
    }
    // Late by a uniform share of 0.8 of a period: a line k keeps sinc²(0.8k); what is left of 1000 random
    // phases adds 1/1000 of the rest, exponentially distributed: 12 times that is passed with 6e-6.
    let jittered = pulses(0.8);
    for k in [1_i64, 2, 3] {
        let whole = line(&regular, 1000 * k);
        let kept = (libm::sin(0.8 * PI * k as f64) / (0.8 * PI * k as f64)).powi(2);
        let found = line(&jittered, 1000 * k);
        let scatter = 2.0 * (whole * kept * whole / 1000.0 * 12.0).sqrt() + 12.0 * whole / 1000.0;
        assert!((found - whole * kept).abs() < scatter, "{k}: {found} of {}", whole * kept);
    }
}

/// Density (per hertz, unit power) by Welch's method in bins of rate/256.
fn density(samples: &[(f64, f64)], rate_hz: f64) -> Vec<(f64, f64)> {
    let mut psd = Psd::new(rate_hz, false, 256);
    let (i, q): (Vec<f32>, Vec<f32>) = samples.iter().map(|(i, q)| (*i as f32, *q as f32)).unzip();
    psd.add(&i, &q);
    psd.density().unwrap()
}

#[test]
fn band_limited_noise_is_flat_inside_its_band_and_absent_outside() {
    let rate_hz = 10e6;
    let samples =
        alone(&scene(rate_hz, "kind = \"noise\"\nbandwidth_hz = 2e6\noffset_hz = 1.5e6\njs_db = 20"), 0, 1 << 20);
    let power = samples.iter().map(|(i, q)| i * i + q * q).sum::<f64>() / samples.len() as f64;
    // 2^20 · 2/10 independent samples: 0.2 % standard deviation, five of them.
    assert!((power - 1.0).abs() < 0.011, "{power}");
    for (f_hz, found) in density(&samples, rate_hz) {
        let from = (f_hz - 1.5e6).abs() / 1e6;
        let db = 10.0 * libm::log10(found * 2e6);
        // 8190 half-overlapping segments count as 7700 (Hann): 0.05 dB a bin; five of them. The filter's
        // slope is ±0.09 of an edge, a bin 0.04, the window's main lobe two bins.
        if from < 0.8 {
            assert!(db.abs() < 0.25, "{f_hz}: {db}");
        } else if from > 1.2 {
            assert!(db < -60.0, "{f_hz}: {db}");
        }
    }
}

#[test]
fn a_matched_waveform_has_the_spectrum_of_chips() {
    let rate_hz = 10e6;
    let (scene, _) = scene_in(
        Path::new("."),
        rate_hz,
        "[fidelity]\nlevel = \"fast\"",
        "[[interference]]\nkind = \"matched\"\njs_db = 20\n",
    );
    let samples = alone(&scene, 0, 1 << 21);
    for (f_hz, found) in density(&samples, rate_hz) {
        let sinc = |x: f64| if x == 0.0 { 1.0 } else { libm::sin(PI * x) / (PI * x) };
        let expected: f64 = (-60..=60).map(|k| sinc((f_hz + f64::from(k) * rate_hz) / 1.023e6).powi(2) / 1.023e6).sum();
        let db = 10.0 * libm::log10(found / expected);
        // 0.036 dB a bin, seven of them; near the nulls the window (two bins of 39 kHz) fills them.
        if expected * 1.023e6 > 0.05 {
            assert!(db.abs() < 0.35, "{f_hz}: {db}");
        }
    }
}

#[test]
fn a_recording_at_the_samples_own_rate_comes_back_and_repeats() {
    let room = tempfile::tempdir().unwrap();
    // A tone of 1/20 cycle a sample, 200 samples: whole periods.
    let tone = |k: usize| libm::sincos(TAU * k as f64 / 20.0);
    let bytes: Vec<u8> = (0..200)
        .flat_map(|k| [(100.0 * tone(k).1) as f32, (100.0 * tone(k).0) as f32])
        .flat_map(f32::to_le_bytes)
        .collect();
    std::fs::write(room.path().join("tone.cf32"), bytes).unwrap();
    for (rate_hz, file_hz) in [(4e6, 4e6), (4e6, 2e6), (4e6, 5e6)] {
        let text = format!(
            "[[interference]]\nkind = \"recording\"\nfile = \"tone.cf32\"\nformat = \"cf32\"\nsample_rate_hz = \
             {file_hz}\njs_db = 20\n"
        );
        let (scene, _) = scene_in(room.path(), rate_hz, "", &text);
        let samples = alone(&scene, 0, 20_000);
        for (k, (i, q)) in samples.iter().enumerate() {
            let (sin, cos) = libm::sincos(TAU * k as f64 * file_hz / rate_hz / 20.0);
            // The pass band's ripple of an 80 dB window, and the interpolation between 256 phases: 2e-4 and
            // 2e-5.
            assert!((i - cos).abs() < 1e-3 && (q - sin).abs() < 1e-3, "{file_hz} {k}: {i} {cos}");
        }
    }
}

#[test]
fn interference_keeps_the_laws_of_stages() {
    let text = "[[interference]]\nkind = \"chirp\"\nsweep_hz = 1e6\nsweep_s = 3.3e-5\njs_db = 30\non_s = 0.01\noff_s \
                = 0.05\n\
        [[interference]]\nkind = \"pulse\"\nwidth_s = 2e-5\nrate_hz = 3e3\njitter = 0.5\njs_db = 40\n\
        [[interference]]\nkind = \"noise\"\nbandwidth_hz = 1e5\noffset_hz = 3e5\njs_db = 20\n\
        [[interference]]\nkind = \"matched\"\njs_db = 90\noffset_hz = 1000\n\
        [[interference]]\nkind = \"cw\"\njs_db = 25\nlatitude_deg = 26.51\nlongitude_deg = 80.2\nheight_m = 500\n\
        [receiver_clock]\nbias_s = 1e-3\ndrift_sps = 1e-6\n";
    let with = |text: &str, cut: Options| {
        let (mut scene, _) = scene_in(Path::new("."), 2.6e6, "", text);
        scene.samples = 260_000;
        let directory = tempfile::tempdir().unwrap();
        let mut bytes = Vec::new();
        let mut writer = truth::Writer::create(directory.path()).unwrap();
        generate_with(&scene, &mut bytes, &mut writer, &mut |_| (), &cut).unwrap();
        bytes
    };
    let whole = with(text, Options::default());
    for (block_runs, batch_blocks, level) in [(1, 1, Level::detect()), (3, 5, Level::Baseline), (7, 2, Level::Avx2)] {
        assert!(with(text, Options { block_runs, batch_blocks, level }) == whole, "{block_runs} {level:?}");
    }
    // A billion times the signal's power stays finite and can be packed.
    assert!(whole.chunks_exact(4).all(|x| f32::from_le_bytes([x[0], x[1], x[2], x[3]]).is_finite()));
    // What is switched off, or has no power, is not there.
    let absent = with("", Options::default());
    assert!(with("[[interference]]\nkind = \"cw\"\njs_db = 50\non_s = 10\n", Options::default()) == absent);
    let (mut silent, _) = scene_in(Path::new("."), 2.6e6, "", "[[interference]]\nkind = \"cw\"\njs_db = 0\n");
    silent.samples = 260_000;
    silent.interference[0].jn0_hz = 0.0;
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    generate_with(&silent, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap();
    assert!(bytes == absent);
}

#[test]
fn a_mirrored_spectrum_holds_the_conjugate_of_every_waveform() {
    for keys in [
        "kind = \"cw\"",
        "kind = \"chirp\"\nsweep_hz = 1e6\nsweep_s = 3.3e-5",
        "kind = \"fmcw\"\nsweep_hz = 1e6\nsweep_s = 3.3e-5",
        "kind = \"sine_fm\"\ndeviation_hz = 4e5\nrate_hz = 3e3",
        "kind = \"pulse\"\nwidth_s = 2e-5\nrate_hz = 3e3\njitter = 0.5",
        "kind = \"matched\"",
    ] {
        let text =
            format!("[[interference]]\n{keys}\noffset_hz = 2e5\njs_db = 20\n[receiver_clock]\ndrift_sps = 1e-6\n");
        let [upright, mirrored] = ["", "spectrum_inverted = true"].map(|more| {
            let (scene, _) = scene_in(Path::new("."), 4e6, more, &text);
            alone(&scene, 0, 40_000)
        });
        assert!(upright.iter().any(|(i, _)| *i != 0.0), "{keys}");
        for (k, (a, b)) in upright.iter().zip(&mirrored).enumerate() {
            // Sines within 3e-7 on both sides; 2^-32 turn of either phase.
            assert!((a.0 - b.0).abs() < 1e-6 && (a.1 + b.1).abs() < 1e-6, "{keys} {k}: {a:?} {b:?}");
        }
    }
}

#[test]
fn ninety_decibels_saturate_symmetrically_and_never_wrap() {
    let text = "[[interference]]\nkind = \"noise\"\nbandwidth_hz = 2e6\njs_db = 90\n";
    let (mut scene, _) = scene_in(Path::new("."), 2.6e6, "noise_lsb = 28", text);
    scene.samples = 100_000;
    let whole = generated(&scene);
    scene.metadata.format = Format::Ci8;
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let done = generate_with(&scene, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap();
    let packed = bytes.chunks_exact(2).map(|x| (f64::from(x[0] as i8), f64::from(x[1] as i8)));
    for ((i, q), (packed_i, packed_q)) in whole.iter().zip(packed) {
        for (sample, packed) in [(*i, packed_i), (*q, packed_q)] {
            assert_eq!(packed, sample.round_ties_even().clamp(-127.0, 127.0));
        }
    }
    // J/N is 71 dB in the band: a component of 1e5 LSB rms is within full scale once in a thousand.
    assert!(done.clipped > 198_000, "{}", done.clipped);
}

#[test]
fn a_pulse_that_lasts_a_period_is_a_tone() {
    let pulse =
        alone(&scene(10e6, "kind = \"pulse\"\nwidth_s = 1e-4\nrate_hz = 1e4\noffset_hz = 1e5\njs_db = 20"), 0, 100_000);
    let tone = alone(&scene(10e6, "kind = \"cw\"\noffset_hz = 1e5\njs_db = 20"), 0, 100_000);
    assert!(pulse == tone);
}

#[test]
fn an_emitter_at_a_place_weakens_with_distance_and_shifts_with_the_receiver_s_oscillator() {
    let text = "[[interference]]\nkind = \"cw\"\noffset_hz = 1e5\njs_db = 25\nlatitude_deg = 26.5\nlongitude_deg = \
                80.2\nheight_m = 1120\n";
    let (mut scene, _) = scene_in(Path::new("."), 2.6e6, "", text);
    let row = scene.interference[0].row(1, 0).unwrap();
    assert!((row.jn0_dbhz - 70.0).abs() < 1e-9 && (row.frequency_hz - 1e5).abs() < 1e-3, "{row:?}");
    // A clock that gains 1e-6 sees all radio frequencies 1e-6 lower.
    scene.interference[0].tuning.receiver_clock.drift = 1e-6;
    let shifted = scene.interference[0].row(1, 2_600_000).unwrap().frequency_hz;
    // Of the carrier at RF, by 1/(1 + 1e-6).
    assert!((shifted - 1e5 + 1_575.52).abs() < 0.01, "{shifted}");
    // A receiver that climbs towards it at 100 m/s: after 5 s of 10 half the distance and 6.02 dB; Doppler
    // v/λ.
    let at = |height_m: f64| Geodetic::from_degrees(26.5, 80.2, height_m).to_ecef();
    let velocity_mps = (at(1120.0) - at(120.0)) / 10.0;
    let knot = |t_s: f64| Knot {
        t_s,
        motion: Motion {
            position_m: at(120.0) + velocity_mps * t_s,
            velocity_mps,
            acceleration_mps2: Vector3::zeros(),
        },
    };
    scene.interference[0].tuning.receiver_clock.drift = 0.0;
    scene.interference[0].path.as_mut().unwrap().antenna =
        Trajectory::through(vec![knot(0.0), knot(10.0)], vec![]).unwrap();
    let row = scene.interference[0].row(1, 5 * 2_600_000).unwrap();
    assert!((row.jn0_dbhz - 70.0 - 20.0 * libm::log10(2.0)).abs() < 1e-3, "{row:?}");
    // The Earth's turn during 3 us moves the emitter by 1.5 mm: 1e-6 of the distance.
    assert!((row.frequency_hz - 1e5 - 100.0 * 1_575.52e6 / 299_792_458.0).abs() < 0.01, "{row:?}");
}

#[test]
fn what_lies_outside_the_band_is_told_and_not_computed() {
    let composed = |text: &str| scene_in(Path::new("."), 2.6e6, "", text);
    let (scene, warnings) = composed("[[interference]]\nkind = \"cw\"\noffset_hz = 2e6\njs_db = 60\n");
    assert!(scene.interference.is_empty() && warnings.iter().any(|w| w.contains("not computed")), "{warnings:?}");
    let (scene, warnings) =
        composed("[[interference]]\nkind = \"chirp\"\nsweep_hz = 10e6\nsweep_s = 1e-3\njs_db = 60\n");
    assert!(warnings.iter().any(|w| w.contains("the rest is silent")), "{warnings:?}");
    // 2.6 of 10 MHz, with Fresnel's ripple at the edges: √(1 ms/10 MHz) of 0.26 ms.
    let samples = alone(&scene, 0, 260_000);
    let power = samples.iter().map(|(i, q)| i * i + q * q).sum::<f64>() / 260_000.0;
    assert!((power / 0.26 - 1.0).abs() < 0.02, "{power}");
    // Noise of 26 MHz leaves a tenth of its power in 2.6 MHz.
    let (scene, _) = composed("[[interference]]\nkind = \"noise\"\nbandwidth_hz = 26e6\njs_db = 60\n");
    assert!((10.0 * libm::log10(scene.interference[0].jn0_hz) - 95.0).abs() < 1e-9);
}
