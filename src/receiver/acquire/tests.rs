use std::f64::consts::TAU;

use statrs::distribution::{ContinuousCDF, Normal};

use super::*;
use gnss::gps::l1ca::{self, L1_CA};
use gnss::samples::Format;
use gnss::time::Rate;

/// Uniform numbers from a 64-bit mixing function (splitmix64), pairs of Gaussian ones by Box and Muller.
pub(crate) struct Noise(pub u64);

impl Noise {
    pub(super) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn pair(&mut self) -> (f64, f64) {
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        let (sin, cos) = libm::sincos(TAU * self.uniform());
        (radius * cos, radius * sin)
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Sent {
    pub prn: u8,
    pub doppler_hz: f64,
    pub phase_chips: f64,
    pub cn0_dbhz: f64,
}

pub(crate) struct Recording {
    pub metadata: IfMetadata,
    pub i: Vec<f32>,
    pub q: Vec<f32>,
}

/// Samples with noise of variance one (complex E|n|² = 1, real E n² = 1) and chips taken at sample instants.
pub(crate) fn record(metadata: IfMetadata, samples: usize, sent: &[Sent], seed: u64) -> Recording {
    let rate_hz = metadata.rate.hz();
    let real = !metadata.format.is_complex();
    let mut noise = Noise(seed);
    let (mut i, mut q) = (vec![0.0_f64; samples], vec![0.0_f64; samples]);
    for n in 0..samples {
        let (a, b) = noise.pair();
        (i[n], q[n]) = if real { (a, 0.0) } else { (a * 0.5_f64.sqrt(), b * 0.5_f64.sqrt()) };
    }
    for s in sent {
        let code = l1ca::code(s.prn).unwrap();
        // Complex: C/(N0 fs). Real: x = sqrt(2C) cos with E n² = N0 fs / 2, so 2C = 4 C/N0 / fs.
        let carrier_to_noise = libm::pow(10.0, s.cn0_dbhz / 10.0) / rate_hz;
        let amplitude = if real { (4.0 * carrier_to_noise).sqrt() } else { carrier_to_noise.sqrt() };
        let sign = if metadata.inverted { -1.0 } else { 1.0 };
        let frequency = (metadata.if_hz(L1_CA.centre_hz()) + sign * s.doppler_hz) / rate_hz;
        let step = 1.023e6 * (1.0 + s.doppler_hz / 1_575.42e6) / rate_hz;
        for n in 0..samples {
            let phase = s.phase_chips + n as f64 * step;
            let chip = if code[phase.floor() as usize % 1023] { -amplitude } else { amplitude };
            // A data bit turns every 20 periods, the first after 7.
            let bit = if ((phase / 1023.0 + 13.0) / 20.0) as u64 % 2 == 1 { -1.0 } else { 1.0 };
            let (sin, cos) = libm::sincos(TAU * (frequency * n as f64 + 0.3));
            i[n] += bit * chip * cos;
            if !real {
                q[n] += bit * chip * sin;
            }
        }
    }
    let single = |x: Vec<f64>| x.into_iter().map(|x| x as f32).collect();
    Recording { metadata, i: single(i), q: single(q) }
}

pub(crate) fn metadata(format: Format, rate_hz: f64, if_hz: f64, inverted: bool) -> IfMetadata {
    let offset_hz = if inverted { if_hz } else { -if_hz };
    let rate = Rate::from_hz(rate_hz).unwrap();
    IfMetadata { format, rate, center_hz: L1_CA.centre_hz() + offset_hz, inverted, start: None }
}

pub(crate) fn all() -> Vec<Link> {
    (1..=32).map(|prn| L1_CA.link(Sv::gps(prn))).collect()
}

fn run(
    recording: &Recording,
    candidates: &[Link],
    settings: &AcquisitionSettings,
) -> Vec<(AcquisitionRow, Option<Acquired>)> {
    let block = Block { first: 1000, i: &recording.i, q: &recording.q };
    search(&recording.metadata, &block, candidates, settings).unwrap()
}

pub(crate) fn difference_chips(a: f64, b: f64) -> f64 {
    (a - b + 511.5).rem_euclid(1023.0) - 511.5
}

#[test]
fn code_phase_doppler_and_cn0_are_found_at_any_rate_if_and_sense() {
    let sent = [
        Sent { prn: 5, doppler_hz: 1234.5, phase_chips: 100.37, cn0_dbhz: 46.0 },
        Sent { prn: 17, doppler_hz: -4871.0, phase_chips: 1022.9, cn0_dbhz: 42.0 },
        Sent { prn: 32, doppler_hz: 125.0, phase_chips: 0.05, cn0_dbhz: 50.0 },
    ];
    for (format, rate_hz, if_hz, inverted) in [
        (Format::Ci8, 2.6e6, 0.0, false),
        (Format::Ci8, 4.092e6, 38_400.0, true),
        (Format::Ci8, 2.048e6, -2500.0, false),
        (Format::Ri8, 6.864_123e6, 1.7e6, false),
        (Format::Ri8, 5.456e6, 1.364e6, true),
    ] {
        let metadata = metadata(format, rate_hz, if_hz, inverted);
        let settings = AcquisitionSettings::default();
        let samples = samples_needed(&metadata, &settings).unwrap() as usize;
        let rows = run(&record(metadata, samples, &sent, 7), &all(), &settings);
        let found: Vec<Acquired> = rows.iter().filter_map(|(_, hit)| *hit).collect();
        assert_eq!(found.iter().map(|f| f.sv.number).collect::<Vec<_>>(), [5, 17, 32], "{rate_hz}");
        for (found, sent) in found.iter().zip(&sent) {
            let case = format!("{rate_hz} Hz: {found:?}");
            // Frequency of a tone in noise over 20 ms: σ = √6/(2π T √(C/N0 T)) = 1.1 Hz at 42 dB-Hz, some
            // more for squaring.
            assert!((found.doppler_hz - sent.doppler_hz).abs() < 6.0, "{case}");
            // Early minus late at half a chip over 20 ms: σ = √(1/(4 C/N0 T)) = 0.028 chips at 42 dB-Hz;
            // chips taken at sample instants shift edges by up to a tenth of a chip more where the rate is
            // near twice the chip rate.
            assert_eq!(found.sample, 1000);
            assert!(difference_chips(found.code_phase_chips, sent.phase_chips).abs() < 0.15, "{case}");
            // 1/√20 periods + 1/√320 noise sums at 15.8 a period: 0.5 dB; correlation of instants with means:
            // up to 1.2 dB.
            let error_db = found.cn0_dbhz - sent.cn0_dbhz;
            assert!((-2.0..1.2).contains(&error_db), "{case}");
        }
    }
}

#[test]
fn a_strong_satellite_does_not_bring_others_by_cross_correlation() {
    // 57 dB-Hz less 21.1 dB is 36 dB-Hz, above the 33 dB-Hz that the search detects.
    let strong = Sent { prn: 3, doppler_hz: 730.0, phase_chips: 400.3, cn0_dbhz: 57.0 };
    let weak = Sent { prn: 19, doppler_hz: 1790.0, phase_chips: 77.7, cn0_dbhz: 43.0 };
    let settings = AcquisitionSettings::default();
    let metadata = metadata(Format::Ci8, 2.6e6, 0.0, false);
    let samples = samples_needed(&metadata, &settings).unwrap() as usize;
    for sent in [vec![strong], vec![strong, weak]] {
        let recording = record(metadata.clone(), samples, &sent, 3);
        let expected: Vec<u8> = sent.iter().map(|s| s.prn).collect();
        let found: Vec<u8> = run(&recording, &all(), &settings).iter().filter_map(|r| Some(r.1?.sv.number)).collect();
        assert_eq!(found, expected);
        // Without the second look others pass.
        let mut searcher = Searcher::new(&metadata, &settings).unwrap();
        for link in all() {
            searcher.prepare(link).unwrap();
        }
        searcher.codes.make(&searcher.grids, all().iter()).unwrap();
        let grid = searcher.grids.values().next().unwrap();
        let spectra: Vec<_> = searcher.codes.values().map(Code::spectra).collect();
        let peaks =
            grid.search(&Block { first: 0, i: &recording.i, q: &recording.q }, &spectra, None, &Rooms::default());
        assert!(peaks.of.iter().filter(|peak| peak.statistic > grid.threshold()).count() > sent.len());
    }
}

#[test]
fn of_satellites_that_share_a_code_the_first_is_acquired() {
    let sent = [Sent { prn: 34, doppler_hz: 0.0, phase_chips: 10.0, cn0_dbhz: 45.0 }];
    let settings = AcquisitionSettings { doppler_max_hz: 500.0, ..Default::default() };
    let recording = record(metadata(Format::Ci8, 2.6e6, 0.0, false), 60_000, &sent, 1);
    // IS-GPS-200N, table 3-Ia: PRN 34 and 37 have the same code.
    let rows = run(&recording, &[L1_CA.link(Sv::gps(34)), L1_CA.link(Sv::gps(37))], &settings);
    assert_eq!(rows.iter().map(|(row, _)| row.acquired).collect::<Vec<_>>(), [true, false]);
}

#[test]
fn a_constant_offset_is_not_a_satellite() {
    let metadata = metadata(Format::Ci8, 2.6e6, 0.0, false);
    let mut recording = record(metadata, 60_000, &[], 11);
    recording.i.iter_mut().for_each(|i| *i += 0.5);
    let rows = run(&recording, &all(), &AcquisitionSettings::default());
    assert!(rows.iter().all(|(row, _)| !row.acquired));
}

#[test]
fn false_alarms_come_as_often_as_designed() {
    // Designed at 2 and 10 %, so that a count is worth something; 1120 searches each.
    for (format, sums, periods, probability, distinct) in [
        (Format::Ci8, 2, 1, 0.02, 1.0),
        (Format::Ci8, 4, 2, 0.1, 1.0),
        // Of five Dopplers two are images of two others and show the same.
        (Format::Ri8, 3, 1, 0.1, 0.6),
    ] {
        // The real recording has its IF at the rate, so that Doppler zero meets its own image.
        let if_hz = if format.is_complex() { 0.0 } else { 2.6e6 };
        let metadata = metadata(format, 2.6e6, if_hz, false);
        let settings = AcquisitionSettings {
            doppler_max_hz: 1000.0,
            coherent_periods: periods,
            noncoherent_sums: sums,
            false_alarm_probability: probability,
            ..Default::default()
        };
        let samples = samples_needed(&metadata, &settings).unwrap() as usize;
        let mut searcher = Searcher::new(&metadata, &settings).unwrap();
        let (mut searches, mut alarms) = (0, 0);
        for seed in 0..35 {
            let recording = record(metadata.clone(), samples, &[], 1000 + seed);
            let rows = searcher.search(&Block { first: 0, i: &recording.i, q: &recording.q }, &all()).unwrap();
            searches += rows.len();
            alarms += rows.iter().filter(|(row, _)| row.acquired).count();
        }
        let (n, probability) = (searches as f64, distinct * probability);
        let two_sided_95 = Normal::new(0.0, 1.0).unwrap().inverse_cdf(0.975);
        let half_width = two_sided_95 * (probability * (1.0 - probability) / n).sqrt();
        let rate = alarms as f64 / n;
        println!("{format} {sums} x {periods}: {rate:.4} measured, {probability} ± {half_width:.4} designed");
        assert!((rate - probability).abs() < half_width, "{alarms} of {searches}, designed {probability}");
    }
}

/// Probability that a noncentral chi-square variable exceeds `value`: Poisson mixture of central ones.
fn detection_probability(value: f64, degrees: u32, noncentrality: f64) -> f64 {
    let half = noncentrality / 2.0;
    (0..400)
        .map(|j| {
            let weight = libm::exp(f64::from(j) * libm::log(half) - half - libm::lgamma(f64::from(j) + 1.0));
            weight * crate::threshold::exceedance(value, degrees + 2 * j)
        })
        .sum()
}

#[test]
fn detections_come_as_often_as_theory_says() {
    // Two samples a chip, Doppler on the grid and code phase on a cell: no loss, for the data bit turns where
    // the seventh dwell of one period ends but for a quarter of a chip.
    let metadata = metadata(Format::Ci8, 2.046e6, 0.0, false);
    let settings = AcquisitionSettings {
        doppler_max_hz: 500.0,
        coherent_periods: 1,
        noncoherent_sums: 10,
        false_alarm_probability: 1e-3,
        ..Default::default()
    };
    let samples = samples_needed(&metadata, &settings).unwrap() as usize;
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    for cn0_dbhz in [33.5, 35.0] {
        let (mut found, trials) = (0, 300);
        let mut limit = 0.0;
        for seed in 0..trials {
            // A replica's sample represents the middle of half a chip.
            let sent = Sent { prn: 9, doppler_hz: 0.0, phase_chips: 0.25, cn0_dbhz };
            let recording = record(metadata.clone(), samples, &[sent], 5000 + seed);
            let block = Block { first: 0, i: &recording.i, q: &recording.q };
            let rows = searcher.search(&block, &[L1_CA.link(Sv::gps(9))]).unwrap();
            limit = rows[0].0.threshold;
            let here = rows[0].1.is_some_and(|hit| difference_chips(hit.code_phase_chips, 0.25).abs() < 1.0);
            found += u32::from(here);
        }
        let noncentrality = 2.0 * 10.0 * libm::pow(10.0, cn0_dbhz / 10.0) * 1e-3;
        let theory = detection_probability(limit, 20, noncentrality);
        let measured = f64::from(found) / trials as f64;
        // Three standard deviations, and 0.01 for neighbouring cells and the estimated noise floor.
        let bar = 3.0 * (theory * (1.0 - theory) / trials as f64).sqrt() + 0.01;
        println!("{cn0_dbhz} dB-Hz: {measured:.3} measured, {theory:.3} ± {bar:.3} by theory");
        assert!((measured - theory).abs() < bar, "{cn0_dbhz} dB-Hz: {measured} measured, {theory} by theory");
    }
}

#[test]
fn the_code_phase_of_weak_signals_scatters_as_theory_says() {
    let metadata = metadata(Format::Ci8, 5.0e6, 0.0, false);
    let (sums, cn0_dbhz) = (16, 35.0);
    let settings = AcquisitionSettings {
        doppler_max_hz: 500.0,
        coherent_periods: 1,
        noncoherent_sums: sums,
        false_alarm_probability: 1e-3,
        ..Default::default()
    };
    let samples = samples_needed(&metadata, &settings).unwrap() as usize;
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let mut place = Noise(41);
    let errors: Vec<f64> = (0..200)
        .filter_map(|seed| {
            let phase_chips = 1023.0 * place.uniform();
            let sent = Sent { prn: 9, doppler_hz: 100.0, phase_chips, cn0_dbhz };
            let recording = record(metadata.clone(), samples, &[sent], 3000 + seed);
            let block = Block { first: 0, i: &recording.i, q: &recording.q };
            let hit = searcher.search(&block, &[L1_CA.link(Sv::gps(9))]).unwrap()[0].1?;
            Some(difference_chips(hit.code_phase_chips, phase_chips)).filter(|error| error.abs() < 1.0)
        })
        .collect();
    assert!(errors.len() > 150, "{}", errors.len());
    // Half a chip to either side the value is a half, and the slope one. There a period has a ratio s of
    // signal to noise of a quarter of the prompt's; its power scatters by √(1 + 2s), and a chip parts the two
    // by 8·s.
    let s = 0.25 * libm::pow(10.0, cn0_dbhz / 10.0) * 1e-3;
    let theory = ((1.0 + 2.0 * s) / f64::from(sums)).sqrt() * 2.0_f64.sqrt() / (8.0 * s);
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    // Three standard deviations of the rms of so many values.
    let bar = 3.0 / (2.0 * errors.len() as f64).sqrt();
    println!("{rms:.4} chips found, {theory:.4} by theory, {} values", errors.len());
    assert!((rms / theory - 1.0).abs() < bar, "{rms} chips, {theory} by theory");
}

#[test]
fn the_default_search_finds_38_dbhz_whatever_the_phase_and_doppler() {
    let metadata = metadata(Format::Ci8, 2.6e6, 0.0, false);
    let settings = AcquisitionSettings { doppler_max_hz: 1000.0, ..Default::default() };
    let samples = samples_needed(&metadata, &settings).unwrap() as usize;
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let mut place = Noise(99);
    let mut missed = 0;
    for seed in 0..100 {
        let (doppler_hz, phase_chips) = (900.0 * (2.0 * place.uniform() - 1.0), 1023.0 * place.uniform());
        let sent = Sent { prn: 21, doppler_hz, phase_chips, cn0_dbhz: 38.0 };
        let recording = record(metadata.clone(), samples, &[sent], 9000 + seed);
        let block = Block { first: 0, i: &recording.i, q: &recording.q };
        let hit = searcher.search(&block, &[L1_CA.link(Sv::gps(21))]).unwrap()[0].1;
        let right = hit.is_some_and(|hit| difference_chips(hit.code_phase_chips, phase_chips).abs() < 0.5);
        missed += u32::from(!right);
    }
    // Of 100 at 0.99, more than 4 are missed once in 290 times.
    assert!(missed <= 4, "{missed} of 100 missed");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let sent = [Sent { prn: 5, doppler_hz: 1234.5, phase_chips: 100.37, cn0_dbhz: 46.0 }];
    let settings = AcquisitionSettings { doppler_max_hz: 2000.0, ..Default::default() };
    let recording = record(metadata(Format::Ci8, 2.6e6, 0.0, false), 60_000, &sent, 7);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        format!("{:?}", pool.install(|| run(&recording, &all(), &settings)))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn what_cannot_be_searched_is_an_error() {
    let good = metadata(Format::Ci8, 2.6e6, 0.0, false);
    let settings = AcquisitionSettings::default();
    let block = Block { first: 0, i: &[0.0; 100], q: &[0.0; 100] };
    let one = [L1_CA.link(Sv::gps(1))];
    let error = search(&good, &block, &one, &settings).unwrap_err();
    assert!(matches!(error, AcquireError::TooFewSamples { have: 100, .. }), "{error}");
    let slow = metadata(Format::Ci8, 1e6, 0.0, false);
    assert!(matches!(search(&slow, &block, &one, &settings), Err(AcquireError::RateTooLow { .. })));
    let far = metadata(Format::Ci8, 2.6e6, 2e6, false);
    assert!(matches!(search(&far, &block, &one, &settings), Err(AcquireError::OutOfBand { .. })));
    let none = [L1_CA.link(Sv::gps(99))];
    assert!(matches!(search(&good, &block, &none, &settings), Err(AcquireError::NoCode { .. })));
    let uneven = Block { q: &[0.0; 99], ..block };
    assert!(matches!(search(&good, &uneven, &one, &settings), Err(AcquireError::Uneven { .. })));
    for bad in [f64::NAN, -1.0, 1e9] {
        let settings = AcquisitionSettings { doppler_max_hz: bad, ..Default::default() };
        let error = samples_needed(&good, &settings).unwrap_err().to_string();
        assert!(error.contains("acquisition.doppler_max_hz") && error.contains("0 to 1e6"), "{error}");
    }
    // Silence has no noise to compare with: nothing is found.
    let silence = vec![0.0; 60_000];
    let rows = search(&good, &Block { first: 0, i: &silence, q: &silence }, &one, &settings).unwrap();
    assert!(!rows[0].0.acquired && rows[0].0.statistic == 0.0);
}

#[test]
fn a_spectrum_that_dopplers_share_is_that_of_each_by_itself() {
    for (rate_hz, if_hz, inverted) in [(2.6e6, 0.0, false), (5.456_321e6, 38_412.0, true), (4e6, -7001.0, false)] {
        let rate = Rate::from_hz(rate_hz).unwrap();
        let center_hz = L1_CA.centre_hz() - if_hz;
        let metadata = IfMetadata { format: Format::Ci8, rate, center_hz, inverted, start: None };
        let settings = AcquisitionSettings::default();
        let one = (lead(&L1_CA).unwrap(), false, L1_CA.centre_hz());
        let grid = grid::Grid::new(one, &metadata, &settings, 0.0, &mut fft::Planner::<f32>::new()).unwrap();
        let Recording { i, q, .. } = record(metadata, grid.samples_needed() as usize, &[], 4);
        let block = Block { first: 0, i: &i, q: &q };
        let shifted = shifted::Shifted::new(&grid, &block, 1.0).unwrap();
        for (bin, &doppler_hz) in grid.dopplers_hz.iter().enumerate() {
            for period in [0, 1, 19] {
                let slow = grid.spectrum_of_period(&block, doppler_hz, period);
                let mut fast = vec![num_complex::Complex::default(); slow.len()];
                shifted.add_period(&grid, bin, period, &mut fast);
                let energy: f32 = slow.iter().map(|x| x.norm_sqr()).sum();
                let error: f32 = fast.iter().zip(&slow).map(|(a, b)| (a - b).norm_sqr()).sum();
                // A sample of different cuts, twice its share; 0.008 bin turns by 0.025 at a period's ends.
                let bound = 2.5 / grid.period_samples as f32 + 2.2e-4;
                assert!(error < bound * energy, "{rate_hz} {doppler_hz} {period}: {}", error / energy);
            }
        }
    }
}

#[test]
fn a_sign_that_turns_every_period_leaves_the_doppler_where_it_is() {
    let signal = Signal::find("BeiDou B1I").unwrap();
    let settings = AcquisitionSettings { signals: vec![signal.name.to_owned()], ..Default::default() };
    let rate_hz = 4.1e6;
    let metadata = IfMetadata { center_hz: signal.centre_hz(), ..metadata(Format::Ci8, rate_hz, 0.0, false) };
    let samples = samples_needed(&metadata, &settings).unwrap() as usize + 1000;
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let mut random = Noise(35);
    let mut found = 0;
    for number in (6..=58).step_by(2) {
        let link = signal.link(Sv { system: signal.system, number });
        let code = signal.code(number).unwrap();
        let (doppler_hz, start_chips) = (9000.0 * (random.uniform() - 0.5), 2046.0 * random.uniform());
        let signs: Vec<f64> = (0..40).map(|_| (random.uniform() - 0.5).signum()).collect();
        let amplitude = (libm::pow(10.0, 4.0) / rate_hz).sqrt();
        let step = 2.046e6 * (1.0 + doppler_hz / signal.centre_hz()) / rate_hz;
        let mut recording = record(metadata.clone(), samples, &[], u64::from(number));
        for (n, (i, q)) in recording.i.iter_mut().zip(&mut recording.q).enumerate() {
            let chips = start_chips + n as f64 * step;
            let chip = f64::from(code[chips as usize % 2046]) * signs[chips as usize / 2046];
            let (sin, cos) = libm::sincos(TAU * (doppler_hz / rate_hz * n as f64));
            *i += (amplitude * chip * cos) as f32;
            *q += (amplitude * chip * sin) as f32;
        }
        let block = Block { first: 0, i: &recording.i, q: &recording.q };
        let [(_, Some(hit))] = &searcher.search(&block, &[link]).unwrap()[..] else { continue };
        found += 1;
        // Neighbours by the squares' ambiguity are 500 Hz away.
        assert!((hit.doppler_hz - doppler_hz).abs() < 10.0, "{number} {doppler_hz} {}", hit.doppler_hz);
    }
    assert!(found > 24, "{found}");
}
