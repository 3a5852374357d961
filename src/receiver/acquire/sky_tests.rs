//! Searches of whole skies: what is found of satellites that are there, and what of those that are not.
//!
//! `GNSS_TWIN_LONG=1` searches thirty times as many skies. Each line of figures is printed (`--nocapture`).

use std::f64::consts::TAU;

use super::tests::{Noise, Recording, Sent, all, difference_chips, metadata, record};
use super::*;
use gnss::samples::Format;

/// Counts of the searches of many skies.
#[derive(Debug, Default)]
struct Count {
    skies: u32,
    there: u32,
    found: u32,
    /// Satellites at positions where nobody sends.
    false_ones: u32,
}

fn skies(short: u64) -> std::ops::Range<u64> {
    0..if is_long() { 30 * short } else { short }
}

fn is_long() -> bool {
    std::env::var_os("GNSS_TWIN_LONG").is_some()
}

/// Satellites of different PRN, of these C/N0, anywhere in Doppler, code phase and message.
fn satellites(random: &mut Noise, cn0_dbhz: &[f64]) -> Vec<Sent> {
    let mut prns: Vec<u8> = (1..=32).collect();
    (cn0_dbhz.iter())
        .map(|&cn0_dbhz| {
            let prn = prns.swap_remove((random.uniform() * prns.len() as f64) as usize);
            let doppler_hz = 4500.0 * (2.0 * random.uniform() - 1.0);
            Sent { prn, doppler_hz, phase_chips: 20.0 * 1023.0 * random.uniform(), cn0_dbhz }
        })
        .collect()
}

/// Eight bits at a deviation of ten, as a front end gives them.
fn quantised(mut recording: Recording) -> Recording {
    let gain = 14.0;
    for x in recording.i.iter_mut().chain(&mut recording.q) {
        *x = (*x * gain).round().clamp(-127.0, 127.0);
    }
    recording
}

fn count(searcher: &mut Searcher, recording: &Recording, sent: &[Sent], counted: &[Sent], total: &mut Count) {
    let block = Block { first: 0, i: &recording.i, q: &recording.q };
    let right = |hit: &Acquired, sent: &[Sent]| {
        sent.iter().any(|sent| {
            hit.sv.number == sent.prn && difference_chips(hit.code_phase_chips, sent.phase_chips).abs() < 1.0
        })
    };
    total.skies += 1;
    total.there += counted.len() as u32;
    for (row, hit) in searcher.search(&block, &all()).unwrap() {
        let Some(hit) = hit else { continue };
        total.found += u32::from(right(&hit, counted));
        if !right(&hit, sent) {
            total.false_ones += 1;
            println!(
                "nobody sends {} at {:.1} chips and {:.0} Hz: {:.1} dB-Hz, {:.2} of its threshold",
                hit.sv,
                hit.code_phase_chips,
                hit.doppler_hz,
                hit.cn0_dbhz,
                row.statistic / row.threshold
            );
        }
    }
}

fn searcher(settings: &AcquisitionSettings) -> (IfMetadata, usize, Searcher) {
    let metadata = metadata(Format::Ci8, 2.6e6, 0.0, false);
    let samples = samples_needed(&metadata, settings).unwrap() as usize;
    let searcher = Searcher::new(&metadata, settings).unwrap();
    (metadata, samples, searcher)
}

#[test]
fn an_open_sky_brings_no_false_satellites() {
    let (metadata, samples, mut searcher) = searcher(&AcquisitionSettings::default());
    let mut total = Count::default();
    // Skies that brought false satellites where columns of before a subtraction were not filled again; the
    // long run has them too.
    let once_false: &[u64] = if is_long() { &[] } else { &[94, 147, 162, 177, 266, 283, 336] };
    for seed in skies(12).chain(once_false.iter().copied()) {
        let mut random = Noise(7000 + seed);
        let count_of_them = 8 + (random.uniform() * 5.0) as usize;
        let cn0_dbhz: Vec<f64> = (0..count_of_them).map(|_| 35.0 + 17.0 * random.uniform()).collect();
        let sent = satellites(&mut random, &cn0_dbhz);
        let certain: Vec<Sent> = sent.iter().copied().filter(|sent| sent.cn0_dbhz > 38.5).collect();
        let recording = quantised(record(metadata.clone(), samples, &sent, seed));
        count(&mut searcher, &recording, &sent, &certain, &mut total);
    }
    println!("open sky: {total:?}");
    // One in a thousand searches, and three deviations of so many; 38 dB-Hz is found with a probability above
    // 0.99.
    let expected = f64::from(total.skies) / 1000.0;
    assert!(f64::from(total.false_ones) <= expected + 3.0 * expected.sqrt(), "{total:?}");
    assert!(f64::from(total.found) >= 0.97 * f64::from(total.there), "{total:?}");
}

#[test]
fn what_may_be_cross_correlation_is_judged_by_all_codes_and_most_sums_are_not_made() {
    let (metadata, samples, mut searcher) = searcher(&AcquisitionSettings::default());
    let (mut passed, mut shares) = (0, Vec::new());
    for seed in skies(4) {
        let mut random = Noise(1200 + seed);
        let cn0_dbhz: Vec<f64> = (0..10).map(|_| 36.0 + 16.0 * random.uniform()).collect();
        let recording = quantised(record(metadata.clone(), samples, &satellites(&mut random, &cn0_dbhz), seed));
        let block = Block { first: 0, i: &recording.i, q: &recording.q };
        // Makes the spectra too.
        searcher.search(&block, &all()).unwrap();
        let window = Window::centred(&Stretch::Planes(block), samples);
        let grid = searcher.grids.values().next().unwrap();
        let spectra: Vec<_> = searcher.codes.values().map(Code::spectra).collect();
        let peaks = grid.search(&window.block(), &spectra, None, &Rooms::default());
        assert_eq!(grid.unjudged(&peaks), 0);
        passed += peaks.of.iter().filter(|peak| peak.statistic > peak.threshold).count();
        shares.push(grid.share_made(&peaks));
    }
    println!("{passed} passed, of all sums {shares:.2?}");
    assert!(passed > 6 * shares.len());
    // Noise leaves 0.53.
    assert!(shares.iter().all(|share| (0.53..0.8).contains(share)), "{shares:?}");
}

#[test]
fn strong_signals_that_are_no_candidates_bring_no_false_satellites() {
    // Codes of the same family at 52, 51 and 50 dB-Hz, near a Doppler of zero: satellites of QZSS or of SBAS
    // look like this.
    let (metadata, samples, mut searcher) = searcher(&AcquisitionSettings::default());
    let (mut total, mut noise_alone) = (Count::default(), 0);
    for seed in skies(6) {
        let mut random = Noise(100 + seed);
        let candidates = satellites(&mut random, &[47.0, 46.0, 45.0, 45.0, 44.0, 43.0, 42.0, 41.0]);
        let others = [(34, 52.0), (35, 51.0), (36, 50.0)].map(|(prn, cn0_dbhz)| Sent {
            prn,
            doppler_hz: 60.0 * random.uniform() - 30.0,
            phase_chips: 20.0 * 1023.0 * random.uniform(),
            cn0_dbhz,
        });
        let sent = [&candidates[..], &others].concat();
        let recording = quantised(record(metadata.clone(), samples, &sent, seed));
        count(&mut searcher, &recording, &candidates, &candidates, &mut total);
        // Above the threshold of noise there are many.
        let window = Window::centred(&Stretch::Planes(Block { first: 0, i: &recording.i, q: &recording.q }), samples);
        let grid = searcher.grids.values().next().unwrap();
        let spectra: Vec<_> = searcher.codes.values().map(Code::spectra).collect();
        let peaks = grid.search(&window.block(), &spectra, None, &Rooms::default());
        noise_alone += peaks.of.iter().filter(|peak| peak.statistic > grid.threshold()).count() as u32;
    }
    println!("others' signals: {total:?}, {noise_alone} above the threshold of noise");
    assert!(noise_alone > total.there + total.skies, "{noise_alone}: the test would show nothing");
    assert!(f64::from(total.false_ones) <= 0.01 * f64::from(total.skies), "{total:?}");
    assert!(f64::from(total.found) >= 0.9 * f64::from(total.there), "{total:?}");
}

/// A signal sampled at four times the rate behind two poles at 1.7 MHz, of which every fourth sample is kept.
/// The filter passes little more than the main lobe, and not evenly.
fn filtered(samples: usize, sent: &[Sent], seed: u64) -> Recording {
    let fine = record(metadata(Format::Ci8, 4.0 * 2.6e6, 0.0, false), 4 * samples, sent, seed);
    let behind = |x: &[f32]| {
        let (mut one, mut two) = (0.0, 0.0);
        let pass = |x: &f32| {
            one += 0.65 * (x - one);
            two += 0.65 * (one - two);
            2.0 * two
        };
        x.iter().map(pass).skip(3).step_by(4).collect()
    };
    Recording { metadata: metadata(Format::Ci8, 2.6e6, 0.0, false), i: behind(&fine.i), q: behind(&fine.q) }
}

/// Searches skies with ten satellites and another so much above them, of samples that are `made` of what is
/// sent and a seed.
fn far_below(cn0_dbhz: f64, skies: &[(f64, &[u64])], made: impl Fn(&[Sent], u64) -> Recording) {
    let (_, _, mut searcher) = searcher(&AcquisitionSettings::default());
    for &(ratio_db, seeds) in skies {
        let mut total = Count::default();
        for &seed in seeds {
            let sent = satellites(&mut Noise(300 + seed), &[&[cn0_dbhz + ratio_db][..], &[cn0_dbhz; 10]].concat());
            let recording = quantised(made(&sent, seed));
            count(&mut searcher, &recording, &sent, &sent[1..], &mut total);
        }
        println!("{ratio_db} dB: {total:?}");
        if ratio_db <= 35.0 {
            assert!(f64::from(total.found) >= 0.95 * f64::from(total.there), "{ratio_db} dB: {total:?}");
        }
        // Seldom enough at any ratio: of 21 satellites that are not there.
        assert!(total.false_ones <= total.skies / 50, "{ratio_db} dB: {total:?}");
    }
}

#[test]
fn satellites_far_below_another_are_found_behind_a_filter() {
    let (_, samples, _) = searcher(&AcquisitionSettings::default());
    let short: &[(f64, &[u64])] = &[(25.0, &[0]), (35.0, &[1])];
    let every: Vec<u64> = skies(1).collect();
    let long = [20.0, 25.0, 30.0, 35.0, 40.0].map(|ratio_db| (ratio_db, &every[..]));
    far_below(43.0, if is_long() { &long } else { short }, |sent, seed| filtered(samples, sent, seed));
}

#[test]
fn satellites_far_below_another_are_found() {
    let (metadata, samples, _) = searcher(&AcquisitionSettings::default());
    // With skies in which a Doppler's side lobe was chosen by thresholds that cannot be compared.
    let short: &[(f64, &[u64])] =
        &[(10.0, &[56]), (15.0, &[18, 22, 65]), (20.0, &[0, 1, 2]), (25.0, &[0, 1, 2]), (35.0, &[0])];
    let every: Vec<u64> = skies(3).collect();
    let long = [10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0].map(|ratio_db| (ratio_db, &every[..]));
    far_below(42.0, if is_long() { &long } else { short }, |sent, seed| record(metadata.clone(), samples, sent, seed));
}

#[test]
fn satellites_of_a_small_family_are_found_at_their_doppler_though_they_share_it() {
    // Fourteen codes, as NavIC has. The cells of six satellites at one Doppler raise its threshold.
    let (metadata, samples, mut searcher) = searcher(&AcquisitionSettings::default());
    let family: Vec<Link> = (1..=14).map(|prn| gnss::gps::l1ca::L1_CA.link(Sv::gps(prn))).collect();
    let (mut there, mut found, mut beside) = (0, 0, 0);
    for seed in skies(8) {
        let mut random = Noise(300 + seed);
        let mut one = |k: u8| {
            let (doppler_hz, phase_chips) = (240.0 * random.uniform() - 120.0, 20.0 * 1023.0 * random.uniform());
            Sent { prn: 2 * k + 1, doppler_hz, phase_chips, cn0_dbhz: 39.0 }
        };
        let sent: Vec<Sent> = (0..6).map(&mut one).collect();
        let recording = quantised(record(metadata.clone(), samples, &sent, seed));
        let block = Block { first: 0, i: &recording.i, q: &recording.q };
        there += sent.len();
        for hit in searcher.search(&block, &family).unwrap().into_iter().filter_map(|(_, hit)| hit) {
            let own = sent.iter().find(|sent| sent.prn == hit.sv.number);
            let near = |own: &&Sent| difference_chips(hit.code_phase_chips, own.phase_chips).abs() < 1.0;
            let Some(own) = own.filter(near) else { continue };
            found += 1;
            // A step of the search.
            beside += usize::from((hit.doppler_hz - own.doppler_hz).abs() > 250.0);
        }
    }
    println!("{there} there, {found} found, {beside} beside their Doppler");
    assert_eq!(beside, 0);
    assert!(found >= there / 2, "{found} of {there}: the test would show nothing");
}

#[test]
fn beside_satellites_that_are_known_weak_ones_are_found_and_none_that_is_not_there() {
    let (metadata, samples, mut searcher) = searcher(&AcquisitionSettings::default());
    let (mut total, mut blind) = (Count::default(), 0);
    for seed in skies(4) {
        let mut random = Noise(900 + seed);
        let sent = satellites(&mut random, &[64.0, 60.0, 57.0, 52.0, 42.0, 41.0, 41.0, 40.0]);
        let recording = quantised(record(metadata.clone(), samples, &sent, seed));
        let block = Block { first: 0, i: &recording.i, q: &recording.q };
        // As a channel knows them a while before the block: to 0.02 chip and 2 Hz.
        let known: Vec<Acquired> = (sent[..4].iter())
            .map(|sent| Acquired {
                sv: Sv::gps(sent.prn),
                signal: &gnss::gps::l1ca::L1_CA,
                sample: 0,
                code_phase_chips: sent.phase_chips.rem_euclid(1023.0) + 0.02,
                doppler_hz: sent.doppler_hz + 2.0,
                cn0_dbhz: sent.cn0_dbhz,
            })
            .collect();
        let sought: Vec<Link> = all().into_iter().filter(|link| known.iter().all(|one| one.link() != *link)).collect();
        let mut hits = |known: &[Acquired]| -> Vec<Acquired> {
            searcher.search_beside(&block, &sought, known).unwrap().into_iter().filter_map(|(_, hit)| hit).collect()
        };
        let right = |hit: &Acquired| {
            let near = |sent: &Sent| difference_chips(hit.code_phase_chips, sent.phase_chips).abs() < 1.0;
            sent[4..].iter().any(|sent| hit.sv.number == sent.prn && near(sent))
        };
        let found = hits(&known);
        total.skies += 1;
        total.there += 4;
        total.found += found.iter().filter(|hit| right(hit)).count() as u32;
        total.false_ones += found.iter().filter(|hit| !right(hit)).count() as u32;
        blind += hits(&[]).iter().filter(|hit| right(hit)).count() as u32;
    }
    println!("beside the known: {total:?}; without that {blind}");
    assert_eq!(total.false_ones, 0, "{total:?}");
    assert!(f64::from(total.found) >= 0.95 * f64::from(total.there), "{total:?}");
    assert!(blind < total.found / 2, "{blind}: the test would show nothing");
}

#[test]
fn a_strong_tone_brings_no_satellites_and_hides_none() {
    let (metadata, samples, mut searcher) = searcher(&AcquisitionSettings::default());
    for jn0_dbhz in [50.0, 56.0, 75.0, 90.0] {
        let mut total = Count::default();
        for seed in skies(2) {
            let mut random = Noise(500 + seed);
            let sent = satellites(&mut random, &[48.0, 47.0, 46.0, 45.0, 44.0, 43.0, 42.0, 41.0]);
            let mut recording = record(metadata.clone(), samples, &sent, seed);
            let amplitude = (libm::pow(10.0, jn0_dbhz / 10.0) / 2.6e6).sqrt();
            let cycles = 0.4 * (random.uniform() - 0.5);
            // Within the quantiser's range.
            let gain = 1.0 / (1.0 + amplitude / 5.0);
            for (n, (i, q)) in recording.i.iter_mut().zip(&mut recording.q).enumerate() {
                let (sin, cos) = libm::sincos(TAU * (cycles * n as f64).fract());
                *i = (gain * (f64::from(*i) + amplitude * cos)) as f32;
                *q = (gain * (f64::from(*q) + amplitude * sin)) as f32;
            }
            count(&mut searcher, &quantised(recording), &sent, &sent, &mut total);
        }
        println!("J/N0 {jn0_dbhz} dB-Hz: {total:?}");
        assert_eq!(total.false_ones, 0, "J/N0 {jn0_dbhz} dB-Hz: {total:?}");
        assert!(f64::from(total.found) >= 0.95 * f64::from(total.there), "J/N0 {jn0_dbhz} dB-Hz: {total:?}");
    }
}

#[test]
fn a_short_recording_is_searched_by_as_many_sums_as_it_has_room_for() {
    let (metadata, whole, _) = searcher(&AcquisitionSettings::default());
    let defaults = AcquisitionSettings::default();
    let mut random = Noise(77);
    let sent = satellites(&mut random, &[50.0, 49.0, 48.0, 47.0, 46.0, 45.0]);
    let recording = quantised(record(metadata.clone(), whole, &sent, 4));
    // 20 ms have room for nine sums of 2 ms, 4.2 ms for one of 3 ms, 3.2 ms for one of 2 ms, 2.1 ms for one
    // of 1 ms. One code period's sum of
    // noise exceeds 2 ln(1 / P) of 64 449 cells, 49.8: it finds 50 dB-Hz (a mean of 200), and half of those
    // of 44 dB-Hz.
    for (ms, coherent, sums, least) in
        [(20.0, 2, 9, 6), (10.0, 2, 4, 6), (5.2, 2, 2, 5), (4.2, 3, 1, 4), (3.2, 2, 1, 3), (2.1, 1, 1, 1)]
    {
        let have = (2600.0 * ms) as usize;
        let settings = shortened(&metadata, &defaults, have as u64).unwrap().unwrap();
        assert_eq!((settings.coherent_periods, settings.noncoherent_sums), (coherent, sums), "{ms} ms");
        assert!(samples_needed(&metadata, &settings).unwrap() <= have as u64);
        let part =
            Recording { metadata: metadata.clone(), i: recording.i[..have].to_vec(), q: recording.q[..have].to_vec() };
        let mut total = Count::default();
        count(&mut Searcher::new(&metadata, &settings).unwrap(), &part, &sent, &sent, &mut total);
        println!("{ms} ms: {total:?}");
        assert!(total.found >= least && total.false_ones == 0, "{ms} ms: {total:?}");
    }
    assert_eq!(shortened(&metadata, &defaults, 5199).unwrap(), None);
    assert_eq!(shortened(&metadata, &defaults, 1 << 20).unwrap(), Some(defaults.clone()));
    assert!((5200..5210).contains(&least_samples(&metadata, &defaults).unwrap()));
}
