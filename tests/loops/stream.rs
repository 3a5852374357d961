//! Laws of the stream: the same bytes however the work is cut, and samples that hold what truth says.
#![cfg(feature = "generator")]

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use generator::catalogue::Catalogue;
use generator::clock::ReceiverClock;
use generator::clock::nodes::Nodes;
use generator::effect::link::FixedCn0;
use generator::message::Senders;
use generator::scene::{Arithmetic, CodeEdge, Fidelity, Grade, Scene};
use generator::stream::{Generated, Options, generate_with};
use generator::synth::isa::Level;
use generator::truth;
use generator::vehicle::Trajectory;
use gnss::earth::Geodetic;
use gnss::gps::l1ca::{self, L1_CA};
use gnss::gps::lnav::UtcData;
use gnss::message::Common;
use gnss::record::Observation;
use gnss::rinex;
use gnss::samples::{Format, IfMetadata};
use gnss::time::{Epoch, Rate, SampleClock};

fn scene(rate_hz: f64, duration_s: f64, format: Format, center_hz: f64, inverted: bool) -> Scene {
    let navigation = rinex::embedded().unwrap();
    let start = Epoch::parse("2010-07-01T08:12:30").unwrap();
    let (catalogue, _) = Catalogue::new(navigation.ephemerides);
    let almanac: Vec<_> = catalogue
        .satellites()
        .filter(|sv| catalogue.healthy(*sv, start))
        .filter_map(|sv| catalogue.sent_at(sv, start).cloned())
        .collect();
    let rate = Rate::from_hz(rate_hz).unwrap();
    let utc = UtcData { leap_s: 15, ..UtcData::default() };
    let common = Common { klobuchar: navigation.klobuchar, utc, almanac, reference: Some(start), ..Common::default() };
    Scene {
        name: "test".to_owned(),
        front_end_name: None,
        station: None,
        seed: 5,
        samples: (duration_s * rate_hz) as u64,
        clock: SampleClock { start, rate },
        receiver_clock: ReceiverClock::steady(1.3e-4, 5e-8),
        nodes: Nodes::of(rate),
        metadata: IfMetadata { format, rate, center_hz, inverted, start: Some(start) },
        element: None,
        imu: None,
        trajectory: Trajectory::fixed(Geodetic::from_degrees(26.5, 80.2, 120.0).to_ecef()),
        catalogue: Arc::new(catalogue),
        messages: Arc::new(Senders::new(&common, &[&L1_CA]).unwrap()),
        osnma: None,
        message_faults: Vec::new(),
        satellite_clocks: Arc::default(),
        signals: vec![&L1_CA],
        excluded: Vec::new(),
        mask_rad: 5_f64.to_radians(),
        effects: vec![Box::new(FixedCn0 { cn0_dbhz: 45.0 })],
        scintillation: None,
        playback: None,
        interference: Vec::new(),
        switches: None,
        spoofers: Vec::new(),
        noise: true,
        front_end: Vec::new(),
        noise_lsb: 20.0,
        fidelity: Fidelity { knot_tolerance_cycles: 1e-5, ..Fidelity::of(Grade::Balanced) },
        truth_interval_s: 0.1,
        expect: Default::default(),
        faults: Vec::new(),
    }
}

fn generated(scene: &Scene, directory: &Path, options: &Options) -> (Vec<u8>, Generated) {
    let mut bytes = Vec::new();
    let mut writer = truth::Writer::create(directory).unwrap();
    let done = generate_with(scene, &mut bytes, &mut writer, &mut |_| (), options).unwrap();
    (bytes, done)
}

fn observations(directory: &Path) -> Vec<Observation> {
    csv::Reader::from_path(directory.join("observations.csv")).unwrap().deserialize().map(Result::unwrap).collect()
}

#[test]
fn bytes_and_truth_depend_neither_on_threads_nor_on_the_cut_nor_on_the_instruction_set() {
    let directory = tempfile::tempdir().unwrap();
    for code_edge in [CodeEdge::Nearest, CodeEdge::Area, CodeEdge::BandLimited] {
        let mut scene = scene(2.6e6, 0.25, Format::Ci8, 1_575.42e6, false);
        scene.fidelity.code_edge = code_edge;
        let cases = [
            (1, 8, 16, Level::detect()),
            (2, 1, 3, Level::detect()),
            (3, 5, 1, Level::Baseline),
            (2, 32, 64, Level::Avx2),
        ];
        let mut first = None;
        for (threads, block_runs, batch_blocks, level) in cases {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let options = Options { block_runs, batch_blocks, level };
            let (bytes, _) = pool.install(|| generated(&scene, directory.path(), &options));
            assert_eq!(bytes.len(), 650_000 * 2);
            let files = ["observations.csv", "sky.csv", "trajectory.csv", "navigation.csv", "scene.json"]
                .map(|name| std::fs::read(directory.path().join(name)).unwrap());
            let (expected, expected_files) = first.get_or_insert((bytes.clone(), files.clone()));
            assert!(bytes == *expected, "{code_edge:?} {threads} {block_runs}");
            assert!(files == *expected_files);
        }
    }
}

/// Samples of the scene at a level, each from −full scale to full scale of `f32`.
fn at_level(fidelity: Fidelity, rate_hz: f64, noise: bool) -> Vec<f32> {
    let directory = tempfile::tempdir().unwrap();
    let mut scene = scene(rate_hz, 0.2, Format::Cf32Le, 1_575.42e6, false);
    (scene.fidelity, scene.noise, scene.noise_lsb) = (fidelity, noise, 1.0);
    let (bytes, _) = generated(&scene, directory.path(), &Options::default());
    bytes.chunks_exact(4).map(|x| f32::from_le_bytes([x[0], x[1], x[2], x[3]])).collect()
}

#[test]
fn levels_keep_to_the_reference_within_their_bounds() {
    let reference = Fidelity::of(Grade::Reference);
    let distance = |fidelity: Fidelity, base: &[f32]| {
        let samples = at_level(fidelity, 2.6e6, false);
        let squares = |x: &mut dyn Iterator<Item = f32>| x.map(|x| f64::from(x).powi(2)).sum::<f64>();
        let error = squares(&mut samples.iter().zip(base).map(|(a, b)| a - b));
        error / squares(&mut base.iter().copied())
    };
    let edges = |grade: Grade| Fidelity { code_edge: Fidelity::of(grade).code_edge, ..reference };
    for grade in [Grade::Fast, Grade::Balanced, Grade::Reference] {
        // Against its own edges in f64 a level differs by its carrier: a phase error of `tolerance` cycles
        // moves a sample by 2π of it, single precision by 2e-5; nearest chips fall on the other side of an
        // edge once in 2^27/0.4 samples.
        let base = at_level(edges(grade), 2.6e6, false);
        let bound = std::f64::consts::TAU * Fidelity::of(grade).knot_tolerance_cycles + 2e-5;
        let error = distance(Fidelity::of(grade), &base).sqrt();
        assert!(error < bound, "{grade:?}: {error} of {bound}");
    }
    // A chip changes half the time; nearest edges put a step up to half a sample away: about a sixth of the
    // power of the changes' samples. Area edges stay closer to the band-limited waveform than nearest ones
    // do.
    let base = at_level(reference, 2.6e6, false);
    let [fast, balanced] = [Grade::Fast, Grade::Balanced].map(|grade| distance(Fidelity::of(grade), &base));
    assert!(balanced < fast && fast < 0.25 && balanced > 1e-4, "{fast} {balanced}");
}

#[test]
fn the_noise_in_double_precision_is_the_same_noise() {
    let fidelity = Fidelity::of(Grade::Balanced);
    let single = at_level(fidelity, 2.6e6, true);
    let double = at_level(Fidelity { noise: Arithmetic::F64, ..fidelity }, 2.6e6, true);
    // Logarithm and sines within 3e-7 each, of a radius up to 6.8, and the rounding of a sum of that size.
    let worst = single.iter().zip(&double).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst > 0.0 && worst < 1e-5, "{worst}");
}

/// Correlation of one code period of samples, from `first`, with a carrier of `frequency_hz` and the code
/// sampled at `chips` for sample `first`, by definition.
fn correlate(i: &[f32], q: &[f32], rate_hz: f64, code: &[bool], chips: f64, chip_hz: f64, frequency_hz: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (n, (i, q)) in i.iter().zip(q).enumerate() {
        let t = n as f64 / rate_hz;
        let (sin, cos) = libm::sincos(-TAU * frequency_hz * t);
        let chip = (chips + chip_hz * t).rem_euclid(1023.0) as usize;
        let sign = if code[chip] { -1.0 } else { 1.0 };
        re += sign * (f64::from(*i) * cos - f64::from(*q) * sin);
        im += sign * (f64::from(*i) * sin + f64::from(*q) * cos);
    }
    libm::hypot(re, im) / i.len() as f64
}

#[test]
fn a_plain_correlation_finds_every_satellite_where_truth_says() {
    let directory = tempfile::tempdir().unwrap();
    for (rate_hz, format, center_hz, inverted) in [
        (2.6e6, Format::Ci8, 1_575.42e6, false),
        (4e6, Format::Ci16Le, 1_575.0e6, true),
        (12e6, Format::Ri8, 1_572.42e6, false),
    ] {
        let scene = scene(rate_hz, 0.31, format, center_hz, inverted);
        let (bytes, done) = generated(&scene, directory.path(), &Options::default());
        let (mut i, mut q) = (Vec::new(), Vec::new());
        format.unpack(&bytes, &mut i, &mut q);
        let rows: Vec<_> = observations(directory.path()).into_iter().filter(|row| row.sample > 0).collect();
        assert!(done.satellites.len() >= 7 && rows.len() == 3 * done.satellites.len());
        for row in &rows {
            let code = l1ca::code(row.sv.number).unwrap();
            // From sent time: chips in the second, then to the next start of a code period (no data edge
            // inside).
            let chips = row.sent_fraction_s * 1.023e6;
            let chip_hz = 1.023e6 * (1.0 + row.doppler_hz / 1_575.42e6);
            let skip = ((1023.0 - chips.rem_euclid(1023.0)) / chip_hz * rate_hz).ceil();
            let from = row.sample as usize + skip as usize;
            let span = from..from + (rate_hz * 1e-3) as usize;
            let chips = chips + skip / rate_hz * chip_hz;
            let sign = if inverted { -1.0 } else { 1.0 };
            let frequency_hz = scene.metadata.if_hz(row.link().carrier_hz()) + sign * row.doppler_hz;
            let at = |dc: f64, df: f64| {
                correlate(&i[span.clone()], &q[span.clone()], rate_hz, &code, chips + dc, chip_hz, frequency_hz + df)
            };
            let peak = at(0.0, 0.0);
            // 45 dB-Hz over 1 ms is 15 dB: an amplitude of 5.6 noise standard deviations.
            for (dc, df) in [(0.7, 0.0), (-0.7, 0.0), (0.0, 800.0), (0.0, -800.0), (300.3, 0.0)] {
                assert!(peak > at(dc, df), "{} {} {dc} {df}", row.sv, row.sample);
            }
        }
    }
}

#[test]
fn without_satellites_the_noise_has_its_set_power_and_without_noise_the_signal_has_its_own() {
    let directory = tempfile::tempdir().unwrap();
    for (format, share) in [(Format::Cf32Le, 2.0), (Format::Ri16Le, 1.0)] {
        let center_hz = if format.is_complex() { 1_575.42e6 } else { 1_574.42e6 };
        let mut scene = scene(4e6, 0.2, format, center_hz, false);
        scene.noise_lsb = 1000.0;
        let power = |scene: &Scene| {
            let (bytes, _) = generated(scene, directory.path(), &Options::default());
            let (mut i, mut q) = (Vec::new(), Vec::new());
            format.unpack(&bytes, &mut i, &mut q);
            i.iter().zip(&q).map(|(i, q)| f64::from(*i).powi(2) + f64::from(*q).powi(2)).sum::<f64>() / i.len() as f64
        };
        let all: Vec<_> = scene.catalogue.satellites().collect();
        let one = *all.iter().find(|sv| truth::in_view(&scene, **sv, scene.clock.start).unwrap()).unwrap();
        scene.excluded = all.clone();
        // 800 000 samples: the variance of the mean square is 2/n, five sigma 0.8 %.
        assert!((power(&scene) / (share * 1e6) - 1.0).abs() < 0.008);
        scene.noise = false;
        scene.excluded.retain(|sv| *sv != one);
        // C over N0 fs, where N0 fs is the complex noise power (twice the real one).
        // A real carrier of amplitude sqrt(2C) has power C as well.
        // C/N0 is at the antenna: edges of area keep 1 − d/3 of it, d chips a sample.
        let expected = libm::pow(10.0, 4.5) / 4e6 * 2e6 * (1.0 - 1.023e6 / 4e6 / 3.0);
        let measured = power(&scene);
        assert!((measured / expected - 1.0).abs() < 0.01, "{format} {measured} {expected}");
    }
}

#[test]
fn a_day_into_the_stream_the_carrier_is_where_the_equation_says() {
    use generator::synth::{Edge, Kernel};
    use generator::transmit::{Scratch, Transmitter};
    let mut scene = scene(25e6, 90_000.0, Format::Cf32Le, 1_571.328e6, false);
    scene.clock.start = Epoch::parse("2010-06-30T23:50:00").unwrap();
    scene.fidelity.code_edge = CodeEdge::Nearest;
    let first = 86_400 * 25_000_000 / 4096 * 4096;
    let mut checked = 0;
    let satellites: Vec<_> = scene.catalogue.satellites().collect();
    for sv in satellites {
        let mut transmitter = Transmitter::new(&scene, sv, &L1_CA, Edge::Nearest).unwrap().unwrap();
        transmitter.prepare(&scene, first, first + 4096).unwrap();
        if !transmitter.in_view(&scene, first) {
            continue;
        }
        let (mut i, mut q) = (vec![0.0; 4096], vec![0.0; 4096]);
        let kernel = Kernel { edge: Edge::Nearest, arithmetic: Arithmetic::F32, level: Level::detect() };
        let mut scratch = Scratch::default();
        transmitter.arrange(&scene, first, 4096, &mut scratch);
        scratch.bank.render(kernel, &mut i, &mut q);
        for k in (0..4096).step_by(13) {
            let n = first + k as u64;
            // The IF is 4.092 MHz: n · 4092 / 25000 turns, in integers.
            let tone = (u128::from(n) * 4092 % 25_000) as f64 / 25_000.0;
            let seen = truth::seen(&scene, sv, &L1_CA, scene.clock.epoch(n)).unwrap().unwrap();
            let expected = tone - seen.arrivals[0].carrier_cycles;
            let error = libm::atan2(f64::from(q[k]), f64::from(i[k])) / TAU - expected;
            // The sign of code and data leaves half a cycle open.
            let error = 2.0 * error;
            assert!((error - error.round()).abs() < 2e-4, "{sv} {k} {error}");
        }
        checked += 1;
    }
    assert!(checked >= 5, "{checked}");
}

#[test]
fn the_data_bits_in_the_samples_are_the_message_and_navigation_rows_are_its_parameters() {
    use gnss::gps::lnav::Subframe;
    use gnss::record::NavigationRow;
    let directory = tempfile::tempdir().unwrap();
    let rate_hz = 2.046e6;
    let mut scene = scene(rate_hz, 14.0, Format::Ci8, 1_575.42e6, false);
    scene.effects = vec![Box::new(FixedCn0 { cn0_dbhz: 55.0 })];
    let all: Vec<_> = scene.catalogue.satellites().collect();
    let sv = *all.iter().find(|sv| truth::in_view(&scene, **sv, scene.clock.start).unwrap()).unwrap();
    scene.excluded = all.into_iter().filter(|other| *other != sv).collect();
    let (bytes, _) = generated(&scene, directory.path(), &Options::default());
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Format::Ci8.unpack(&bytes, &mut i, &mut q);
    // The first subframe that begins inside the samples, found through the truth's own delay at each bit.
    let delay_s = |n: u64| {
        let seen = truth::seen(&scene, sv, &L1_CA, scene.clock.epoch(n)).unwrap().unwrap();
        (seen.arrivals[0].delay_s, seen.arrivals[0].carrier_cycles)
    };
    let start = Epoch::new((scene.clock.start.seconds() / 6 + 1) * 6, 0.0);
    let code = l1ca::code(sv.number).unwrap();
    let mut words = [0_u32; 10];
    for bit in 0..300 {
        // Middle of the bit's first 19 whole code periods; phase by the carrier of truth.
        let begin = start.plus_s(f64::from(bit) * 0.02).since(scene.clock.start);
        let near = ((begin + 0.075) * rate_hz) as u64;
        let first = ((begin + delay_s(near).0) * rate_hz).ceil() as u64;
        let (here, carrier) = delay_s(first);
        let (_, after) = delay_s(first + 38_874);
        let mut sum = 0.0;
        for n in 0..38_874_u64 {
            let k = (first + n) as usize;
            let turns = carrier + (after - carrier) * n as f64 / 38_874.0;
            let (sin, cos) = libm::sincos(TAU * turns.fract());
            let sent = first as f64 / rate_hz - here - begin + n as f64 / rate_hz;
            let sign = if code[((sent * 1.023e6).max(0.0) as usize) % 1023] { -1.0 } else { 1.0 };
            sum += sign * (f64::from(i[k]) * cos - f64::from(q[k]) * sin);
        }
        words[bit as usize / 30] = words[bit as usize / 30] << 1 | u32::from(sum < 0.0);
    }
    let subframe = Subframe::decode(&words, 0).unwrap();
    assert_eq!(i64::from(subframe.tow_count), start.tow_whole_s() / 6 + 1);
    let rows: Vec<NavigationRow> = csv::Reader::from_path(directory.path().join("navigation.csv"))
        .unwrap()
        .deserialize()
        .map(Result::unwrap)
        .collect();
    assert!(rows.windows(2).all(|pair| pair[0] < pair[1]) && !rows.is_empty());
    for (parameter, raw) in subframe.parameters().into_iter().filter(|_| subframe.id <= 3) {
        assert!(rows.iter().any(|row| row.parameter == parameter && row.raw == raw), "{parameter}");
    }
}

#[test]
fn the_shipped_scenes_keep_to_their_knot_tolerance() {
    use generator::scenario::{Overrides, Scenario};
    let directory = tempfile::tempdir().unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    for name in ["static", "moderate", "high_dynamics"] {
        let text = std::fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap();
        let (scene, _) = Scenario::parse(&text, name).unwrap().compose(&folder, &Overrides::default()).unwrap();
        let mut writer = truth::Writer::create(directory.path()).unwrap();
        let done = generate_with(&scene, &mut std::io::sink(), &mut writer, &mut |_| (), &Options::default()).unwrap();
        assert!(done.worst_knot_cycles <= scene.fidelity.knot_tolerance_cycles, "{name}: {}", done.worst_knot_cycles);
    }
}

#[test]
fn an_error_of_the_output_stops_the_stream_and_is_told() {
    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::Error::from(std::io::ErrorKind::StorageFull))
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let directory = tempfile::tempdir().unwrap();
    let scene = scene(2.6e6, 0.1, Format::Ci8, 1_575.42e6, false);
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let result = generate_with(&scene, &mut Full, &mut writer, &mut |_| (), &Options::default());
    assert!(matches!(result, Err(generator::GenerateError::Write(_))));
}

#[test]
fn a_satellite_that_rises_appears_at_a_whole_second_in_samples_and_in_truth_alike() {
    let directory = tempfile::tempdir().unwrap();
    let mut scene = scene(2.6e6, 4.0, Format::Cf32Le, 1_575.42e6, false);
    scene.noise = false;
    let elevation = |sv, sample| {
        let seen = truth::seen(&scene, sv, &L1_CA, scene.clock.epoch(sample)).unwrap()?;
        Some(seen.emission.sight.look.elevation_rad)
    };
    let all: Vec<_> = scene.catalogue.satellites().collect();
    let rising = |sv: &_| elevation(*sv, 0).zip(elevation(*sv, scene.samples)).is_some_and(|(a, b)| a > 0.2 && b > a);
    let sv = *all.iter().find(|sv| rising(sv)).unwrap();
    // The mask is crossed 1.5 s into the scene: in view from second 2.
    let mask_rad = elevation(sv, 3_900_000).unwrap();
    scene.mask_rad = mask_rad;
    scene.excluded = all.into_iter().filter(|other| *other != sv).collect();
    let (bytes, done) = generated(&scene, directory.path(), &Options::default());
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Format::Cf32Le.unpack(&bytes, &mut i, &mut q);
    let first = i.iter().zip(&q).position(|(i, q)| *i != 0.0 || *q != 0.0).unwrap();
    // Runs are 4096 samples at most, and each begins in or out of view.
    assert!((5_200_000..5_200_000 + 4096).contains(&first), "{first}");
    let rows = observations(directory.path());
    assert_eq!((rows[0].sample, rows[0].locked_s, rows.len()), (5_200_000, 0.0, 20));
    assert_eq!(done.satellites, [sv]);
}
