//! Acquisition on recordings that others made with real antennas.

use gnss::beidou::b1c::{self, B1C};
use gnss::galileo::e1::E1;
use gnss::gps::l1c::{self, L1C};
use gnss::gps::l1ca::L1_CA;
use gnss::qzss;
use gnss::samples::{Format, IfMetadata};
use gnss::satellite::{Sv, System};
use gnss::signal::{Component, Link, Signal};
use gnss::time::Rate;
use receiver::acquire::{Acquired, AcquisitionSettings, Searcher};
use receiver::source::Block;
use receiver::track::{Channel, Report, TrackingSettings};

use num_complex::Complex64;

use super::data::external;

pub fn metadata(format: Format, rate_hz: f64, if_hz: f64) -> IfMetadata {
    let rate = Rate::from_hz(rate_hz).unwrap();
    IfMetadata { format, rate, center_hz: L1_CA.centre_hz() - if_hz, inverted: false, start: None }
}

fn candidates() -> Vec<Link> {
    (1..=32).map(|prn| L1_CA.link(Sv::gps(prn))).collect()
}

fn acquire(metadata: &IfMetadata, i: &[f32], q: &[f32], settings: &AcquisitionSettings) -> Vec<Acquired> {
    let mut searcher = Searcher::new(metadata, settings).unwrap();
    let rows = searcher.search(&Block { first: 0, i, q }, &candidates()).unwrap();
    let found: Vec<Acquired> = rows.iter().filter_map(|(_, hit)| *hit).collect();
    for (row, _) in rows.iter().filter(|(row, _)| row.statistic > row.threshold) {
        println!(
            "{} {} {:9.1} Hz {:7.2} chips {:5.1} dB-Hz  {:.1}/{:.1}",
            row.sv, row.acquired, row.doppler_hz, row.code_phase_chips, row.cn0_dbhz, row.statistic, row.threshold
        );
    }
    found
}

/// The whole recording as planar samples.
pub fn read(name: &str, format: Format) -> Option<(Vec<f32>, Vec<f32>)> {
    let bytes = std::fs::read(external(name)?).unwrap();
    assert!(bytes.len().is_multiple_of(format.bytes()));
    let (mut i, mut q) = (Vec::new(), Vec::new());
    format.unpack(&bytes, &mut i, &mut q);
    Some((i, q))
}

/// Exactly these satellites, each within `tolerance_hz` of the Doppler that another program listed, if it
/// listed one.
fn assert_found(found: &[Acquired], listed: &[(u8, Option<f64>)], tolerance_hz: f64) {
    let mut expected: Vec<u8> = listed.iter().map(|(prn, _)| *prn).collect();
    expected.sort_unstable();
    let prns: Vec<u8> = found.iter().map(|hit| hit.sv.number).collect();
    assert_eq!(prns, expected);
    for (prn, doppler_hz) in listed {
        let hit = found.iter().find(|hit| hit.sv.number == *prn).unwrap();
        if let Some(doppler_hz) = doppler_hz {
            assert!((hit.doppler_hz - doppler_hz).abs() <= tolerance_hz, "{hit:?}, listed at {doppler_hz} Hz");
        }
    }
}

#[test]
fn a_complex_recording_holds_the_satellites_that_others_found_in_it() {
    let Some((i, q)) = read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return };
    let metadata = metadata(Format::Ci8, 4e6, 0.0);
    // The recording holds strong signals of other systems with codes of the same family near 0 Hz, whose
    // cross-correlation crowds the bins at whole kilohertz: the threshold of noise alone brought up to six
    // false satellites a window.
    let windows = [400_000, 800_000, 1_200_000, 1_600_000]
        .map(|start| acquire(&metadata, &i[start..], &q[start..], &AcquisitionSettings::default()));
    let listed = [
        (26, -750.0),
        (31, 250.0),
        (29, 2250.0),
        (16, -2500.0),
        (32, 3250.0),
        (18, -2750.0),
        (4, -3250.0),
        (25, 2750.0),
    ];
    for hit in windows.iter().flatten() {
        assert!(listed.iter().any(|(prn, _)| *prn == hit.sv.number), "not listed: {hit:?}");
    }
    for (prn, doppler_hz) in listed {
        let hits: Vec<&Acquired> = windows.iter().flatten().filter(|hit| hit.sv.number == prn).collect();
        // Two of 35 to 37 dB-Hz have a mean statistic of 170 ± 25 there, where crowded bins ask for up to
        // 138: one window in ten.
        assert!(hits.len() >= 3, "{prn} in {} windows", hits.len());
        // The list is on a grid of 250 Hz.
        assert!(
            hits.iter().all(|hit| (hit.doppler_hz - doppler_hz).abs() <= 130.0),
            "{hits:?}, listed at {doppler_hz}"
        );
    }
}

#[test]
fn a_recording_with_a_mirrored_spectrum_shows_it_in_its_code_doppler() {
    // From the list alone the sense of this recording's spectrum cannot be told. Code and carrier Doppler
    // agree (f/1540 chips a second) in one sense only: in the other the code phases found 0.4 s apart
    // contradict it by 2 f/1540 x 0.4 s = 1.7 chips at 3250 Hz.
    let Some((i, q)) = read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return };
    let settings = AcquisitionSettings::default();
    let later = 1_600_000;
    for (inverted, agrees) in [(true, true), (false, false)] {
        let metadata = IfMetadata { inverted, ..metadata(Format::Ci8, 4e6, 0.0) };
        let one = acquire(&metadata, &i, &q, &settings);
        let two = acquire(&metadata, &i[later..], &q[later..], &settings);
        for prn in [16, 32, 29] {
            let of = |hits: &[Acquired]| *hits.iter().find(|hit| hit.sv.number == prn).unwrap();
            let (one, two) = (of(&one), of(&two));
            let passed = 1.023e6 * 0.4 * (1.0 + one.doppler_hz / 1_575.42e6);
            let error = (two.code_phase_chips - one.code_phase_chips - passed + 511.5).rem_euclid(1023.0) - 511.5;
            println!("{prn} inverted {inverted}: {error:.2} chips");
            // Each code phase to about 0.05 chips.
            assert_eq!(error.abs() < 0.25, agrees, "PRN {prn}, inverted {inverted}: {error} chips");
        }
    }
}

#[test]
fn a_real_recording_at_an_if_holds_the_satellites_that_others_found_in_it() {
    let Some((i, q)) = read("if/pocket_l1_2021-11-25_12msps_ri8_if3mhz.bin", Format::Ri8) else { return };
    let metadata = metadata(Format::Ri8, 12e6, 3e6);
    let settings = AcquisitionSettings::default();
    let found = acquire(&metadata, &i, &q, &settings);
    // 24 and 28 are not in the list, which stops at stronger ones. Both are found again below.
    let prns = [13, 20, 5, 15, 11, 30, 29, 2, 18, 24, 28];
    assert_found(&found, &prns.map(|prn| (prn, None)), 0.0);
    let later = 600_000;
    // These two are the weakest: they need more of the recording and a threshold that lets a thousandth of
    // noise through.
    let longer = AcquisitionSettings { noncoherent_sums: 20, false_alarm_probability: 1e-3, ..settings };
    let again = acquire(&metadata, &i[later..], &q[later..], &longer);
    for prn in [24, 28] {
        let of = |hits: &[Acquired]| *hits.iter().find(|hit| hit.sv.number == prn).unwrap();
        let (one, two) = (of(&found), of(&again));
        assert!((one.doppler_hz - two.doppler_hz).abs() < 20.0, "{one:?} {two:?}");
        // 50 code periods later, but for code Doppler.
        let passed = 1023.0 * 50.0 * one.doppler_hz / 1_575.42e6;
        let error = (two.code_phase_chips - one.code_phase_chips - passed + 511.5).rem_euclid(1023.0) - 511.5;
        assert!(error.abs() < 0.5, "{one:?} {two:?}");
    }
}

#[test]
fn four_milliseconds_of_floats_with_a_local_oscillator_far_off() {
    let Some((i, q)) = read("if/cttc_l1_2012-07-26_4msps_cf32.bin", Format::Cf32Le) else { return };
    // 4 ms leave room for one sum of 3 ms, with every code phase.
    let settings = AcquisitionSettings {
        doppler_max_hz: 12_500.0,
        coherent_periods: 3,
        noncoherent_sums: 1,
        ..Default::default()
    };
    let found = acquire(&metadata(Format::Cf32Le, 4e6, 0.0), &i, &q, &settings);
    let listed = [(29, Some(9750.0)), (25, Some(9000.0)), (12, Some(7250.0)), (2, Some(8000.0)), (31, None)];
    assert_found(&found, &listed, 150.0);
}

/// Standard base64 without padding checks.
fn base64(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let (mut bits, mut count) = (0_u32, 0);
    for c in text.bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => continue,
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    bytes
}

#[test]
fn one_bit_snapshots_hold_only_satellites_that_were_up() {
    let Some(path) = external("if/snappergps_w00.json") else { return };
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let metadata = metadata(Format::Ri8, 4.092e6, 4.092e6);
    let settings = AcquisitionSettings { coherent_periods: 1, ..Default::default() };
    let mut times_found = [0; 33];
    for snapshot in 0..10 {
        let bytes = base64(json["snapshots"][snapshot]["data"].as_str().unwrap());
        // The first sample is the lowest bit; 1 is a negative sample.
        let bit = |byte: &u8, n: u32| if byte >> n & 1 == 1 { -1.0 } else { 1.0 };
        let i: Vec<f32> = bytes.iter().flat_map(|byte| (0..8).map(move |n| bit(byte, n))).collect();
        for hit in acquire(&metadata, &i, &vec![0.0; i.len()], &settings) {
            times_found[usize::from(hit.sv.number)] += 1;
        }
    }
    println!("{times_found:?}");
    // PRN 18 is not in the list but found twice, three snapshots apart, at the same Doppler and a code phase
    // that fits.
    assert!(
        (1..33).all(|prn| times_found[prn] == 0 || [5, 7, 13, 14, 15, 18, 20, 30].contains(&prn)),
        "{times_found:?}"
    );
    assert!([5, 7, 13, 20, 30].iter().all(|&prn| times_found[prn] >= 5), "{times_found:?}");
}

/// Beginning of a pilot's secondary code in a recording of inverted spectrum, and the lead of its best
/// position over the next. The pilot is found by its own code and secondary code. The time is in seconds
/// after the first sample, modulo 18.
pub fn secondary_code_begins_s(
    hit: &Acquired,
    [i, q]: [&[f32]; 2],
    rate_hz: f64,
    [code, secondary_code]: [&[i8]; 2],
) -> (f64, f64) {
    let period_s = 0.01;
    let chips_a_sample = 1.023e6 * (1.0 + hit.doppler_hz / 1_575.42e6) / rate_hz;
    let mut prompts = vec![Complex64::default(); (i.len() as f64 / (period_s * rate_hz)) as usize];
    for (n, (&i, &q)) in i.iter().zip(q).enumerate() {
        let half_chips = (2.0 * (hit.code_phase_chips + n as f64 * chips_a_sample)) as usize;
        let (period, chip) = (half_chips / (2 * code.len()), half_chips / 2 % code.len());
        // BOC(1,1): every second half of a chip has the other sign.
        let sign = if half_chips % 2 == 1 { -f64::from(code[chip]) } else { f64::from(code[chip]) };
        let (sin, cos) = libm::sincos(-std::f64::consts::TAU * (hit.doppler_hz * n as f64 / rate_hz).fract());
        let taken = Complex64::new(f64::from(i), -f64::from(q)) * Complex64::new(cos, sin) * sign;
        prompts.iter_mut().skip(period).take(1).for_each(|prompt| *prompt += taken);
    }
    // The search knows the Doppler to some hertz, half a second needs it to one.
    let turned = |half_hz: i32| {
        let turn = |k: usize| libm::sincos(-std::f64::consts::PI * f64::from(half_hz) * period_s * k as f64);
        prompts.iter().enumerate().map(|(k, own)| own * Complex64::new(turn(k).1, turn(k).0)).collect::<Vec<_>>()
    };
    let turns: Vec<Vec<Complex64>> = (-60..=60).map(turned).collect();
    let sum = |own: &Vec<Complex64>, first: usize| {
        // The first period began before the recording.
        let rest = own.iter().enumerate().skip(1);
        rest.map(|(k, prompt)| prompt * f64::from(secondary_code[(first + k) % secondary_code.len()]))
            .sum::<Complex64>()
            .norm()
    };
    let best = |first: usize| turns.iter().map(|own| sum(own, first)).fold(0.0, f64::max);
    let mut places: Vec<(f64, usize)> = (0..secondary_code.len()).map(|first| (best(first), first)).collect();
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    let begun_s = hit.code_phase_chips / (chips_a_sample * rate_hz) + places[0].1 as f64 * period_s;
    ((-begun_s).rem_euclid(18.0), places[0].0 / places[1].0)
}

/// Phase of one component of 1.023 Mchip/s against another in a recording of inverted spectrum, in cycles
/// modulo half a cycle, and the ratio of their powers behind replicas of their first layers. Neither bits nor
/// secondary codes have to be known. The codes begin together.
fn apart(hit: &Acquired, [i, q]: [&[f32]; 2], rate_hz: f64, two: [&Component; 2]) -> (f64, f64) {
    let codes = two.map(|component| (component.code)(hit.sv.number).unwrap());
    let length = codes[0].len().max(codes[1].len());
    let chips_a_sample = 1.023e6 * (1.0 + hit.doppler_hz / 1_575.42e6) / rate_hz;
    let periods = i.len() as f64 * 1.023e6 / (length as f64 * rate_hz);
    let mut prompts = vec![([Complex64::default(); 2], 0.0); periods as usize];
    for (n, (&i, &q)) in i.iter().zip(q).enumerate() {
        let half_chips = (2.0 * (hit.code_phase_chips + n as f64 * chips_a_sample)) as usize;
        let (sin, cos) = libm::sincos(-std::f64::consts::TAU * (hit.doppler_hz * n as f64 / rate_hz).fract());
        let taken = Complex64::new(f64::from(i), -f64::from(q)) * Complex64::new(cos, sin);
        for (sums, energy) in prompts.iter_mut().skip(half_chips / 2 / length).take(1) {
            for ((sum, component), code) in sums.iter_mut().zip(two).zip(&codes) {
                let pulse = component.layers[0].pulse;
                let sign = code[half_chips / 2 % code.len()] * pulse[half_chips % 2 * pulse.len() / 2];
                *sum += taken * f64::from(sign);
            }
            *energy += taken.norm_sqr();
        }
    }
    // Both turn alike with what the search does not know of the Doppler, and a bit's end takes length alone.
    let product: Complex64 = prompts.iter().map(|([one, other], _)| (one * other.conj()).powi(2)).sum();
    let power = |at: usize| prompts.iter().map(|(sums, noise)| sums[at].norm_sqr() - noise).sum::<f64>();
    ((product.arg() / (2.0 * std::f64::consts::TAU)).rem_euclid(0.5), power(0) / power(1))
}

/// Searches half a second of an antenna's recording for satellites of signals about L1, and holds the phase
/// between two components of each against the program's.
fn held(
    signals: &[(&'static Signal, &[u8])],
    other: impl Fn(&'static Signal) -> &'static Component,
) -> Vec<(Sv, f64, f64)> {
    let Some((i, q)) = read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return Vec::new() };
    let metadata = IfMetadata { inverted: true, ..metadata(Format::Ci8, 4e6, 0.0) };
    let settings = AcquisitionSettings { doppler_max_hz: 4000.0, ..AcquisitionSettings::default() };
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let mut found = Vec::new();
    for (signal, numbers) in signals {
        let links: Vec<Link> =
            numbers.iter().map(|&number| signal.link(Sv { system: signal.system, number })).collect();
        let rows = searcher.search(&Block { first: 0, i: &i, q: &q }, &links).unwrap();
        let hits: Vec<Acquired> = rows.into_iter().filter_map(|(_, hit)| hit).collect();
        assert!(hits.len() + 1 >= numbers.len(), "{}: {hits:?}", signal.name);
        for hit in hits {
            let two = [&signal.components[0], other(signal)];
            let (cycles, ratio) = apart(&hit, [&i, &q], 4e6, two);
            let off = cycles - (two[0].phase_cycles - two[1].phase_cycles);
            let power = |component: &Component| {
                let layer = component.layers[0];
                let on = layer.chips.iter().filter(|on| **on).count() as f64 / layer.chips.len() as f64;
                component.power_share * (layer.weight * if layer.chips.is_empty() { 1.0 } else { on }).powi(2)
            };
            let expected = power(two[0]) / power(two[1]);
            println!("{} {}: {cycles:.3} cycles, power {ratio:.3} of {expected:.3}", signal.name, hit.sv);
            assert!((off - 0.5 * (2.0 * off).round()).abs() < 0.025, "{} {}: {cycles}", signal.name, hit.sv);
            found.push((hit.sv, ratio, expected));
        }
    }
    found
}

/// IS-GPS-200N, 3.3.1.5.1, allows 100 mrad, 0.016 cycles, of quadrature; half a second of the weakest, 40
/// dB-Hz in both signals, has 0.003 cycles of noise.
#[test]
fn l1c_of_gps_and_qzss_has_the_phase_against_l1_ca_that_an_antenna_recorded() {
    let civil = |signal: &'static Signal| if signal.system == System::Gps { &L1_CA } else { &qzss::l1ca::L1_CA };
    held(&[(&L1C, &[4, 18]), (&qzss::l1c::L1C, &[2, 3, 7])], |signal| &civil(signal).components[0]);
}

/// Data of 34 dB-Hz, the weakest, have 0.004 cycles and 4 % of noise in half a second.
#[test]
fn data_and_pilot_have_the_phase_and_the_powers_of_one_against_the_other_that_an_antenna_recorded() {
    let signals: [(&'static Signal, &[u8]); 4] =
        [(&E1, &[7, 15, 27, 30]), (&B1C, &[30, 36, 45]), (&L1C, &[4, 18]), (&qzss::l1c::L1C, &[2, 3, 7])];
    for (sv, ratio, expected) in held(&signals, |signal| &signal.components[1]) {
        assert!((ratio / expected - 1.0).abs() < 0.2, "{sv}: {ratio} of {expected}");
    }
}

/// Difference of two times modulo 18 s, as near to zero as possible.
pub fn after_s(one_s: f64, other_s: f64) -> f64 {
    (one_s - other_s + 9.0).rem_euclid(18.0) - 9.0
}

/// Pilots of L1C, which others found in it: G18 at −2700 Hz and G4 at −3250 Hz, of those of Block III that
/// day.
#[test]
fn a_recording_holds_the_pilots_of_l1c_that_others_found_in_it_where_l1_ca_is_and_their_secondary_codes_in_step() {
    let Some((i, q)) = read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return };
    let metadata = IfMetadata { inverted: true, ..metadata(Format::Ci8, 4e6, 0.0) };
    let settings = AcquisitionSettings { doppler_max_hz: 4000.0, ..AcquisitionSettings::default() };
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let block = Block { first: 0, i: &i, q: &q };
    let links: Vec<Link> = [4, 14, 18, 23].map(|prn| L1C.link(Sv::gps(prn))).to_vec();
    let rows = searcher.search(&block, &links).unwrap();
    let hits: Vec<Acquired> = rows.into_iter().filter_map(|(_, hit)| hit).collect();
    assert_eq!(hits.iter().map(|hit| hit.sv.number).collect::<Vec<_>>(), [4, 18], "{hits:?}");
    let civil = acquire(&metadata, &i, &q, &AcquisitionSettings::default());
    let mut begins_s = Vec::new();
    for (hit, doppler_hz) in hits.iter().zip([3250.0, 2700.0]) {
        println!("{} {:.1} Hz {:.2} chips {:.1} dB-Hz", hit.sv, hit.doppler_hz, hit.code_phase_chips, hit.cn0_dbhz);
        // The list is on a grid of 50 Hz, and of the inverted spectrum.
        assert!((hit.doppler_hz - doppler_hz).abs() < 60.0, "{hit:?}");
        if let Some(ca) = civil.iter().find(|ca| ca.sv == hit.sv) {
            let apart = (hit.code_phase_chips - ca.code_phase_chips + 511.5).rem_euclid(1023.0) - 511.5;
            // Both to a tenth of a chip; both signals leave together.
            assert!(apart.abs() < 0.3, "{hit:?} {ca:?}");
        }
        let number = hit.sv.number;
        let chips = [l1c::code(l1c::Code::Pilot, number).unwrap(), l1c::secondary_code(number).unwrap()];
        let (begun_s, lead) = secondary_code_begins_s(hit, [&i, &q], 4e6, [&chips[0], &chips[1]]);
        println!("{}: its secondary code begins {begun_s:.4} s after the first sample, better by {lead:.2}", hit.sv);
        // 49 prompts agree; the best of 1800 places and 121 frequencies by chance reaches half of that.
        assert!(lead > 1.5, "{lead}");
        begins_s.push(begun_s);
    }
    // Secondary codes of all satellites begin together; to reach the ground they take 67 to 87 ms. By chance:
    // one in
    // 450.
    assert!(after_s(begins_s[0], begins_s[1]).abs() < 0.02, "{begins_s:?}");
}

/// Pilots of B1C, which others found in it: C30, C36 and C45, of those that sent it that day.
#[test]
fn a_recording_holds_the_pilots_of_b1c_that_others_found_in_it_and_their_secondary_codes_begin_by_bdt() {
    let Some((i, q)) = read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return };
    let metadata = IfMetadata { inverted: true, ..metadata(Format::Ci8, 4e6, 0.0) };
    let settings = AcquisitionSettings { doppler_max_hz: 3000.0, ..AcquisitionSettings::default() };
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let mut links = [30, 36, 45, 20].map(|number| B1C.link(Sv { system: System::BeiDou, number })).to_vec();
    links.push(L1C.link(Sv::gps(18)));
    let rows = searcher.search(&Block { first: 0, i: &i, q: &q }, &links).unwrap();
    let hits: Vec<Acquired> = rows.into_iter().filter_map(|(_, hit)| hit).collect();
    hits.iter().for_each(|hit| println!("{} {:.1} Hz {:.1} dB-Hz", hit.sv, hit.doppler_hz, hit.cn0_dbhz));
    assert_eq!(hits.iter().map(|hit| hit.sv.number).collect::<Vec<_>>(), [30, 36, 45, 18], "{hits:?}");
    // The list has that of C30 alone, on a grid of 50 Hz, and of the inverted spectrum.
    assert!((hits[0].doppler_hz - 600.0).abs() < 60.0, "{:?}", hits[0]);
    let begins_s: Vec<f64> = hits
        .iter()
        .map(|hit| {
            let number = hit.sv.number;
            let chips = match hit.sv.system {
                System::Gps => [l1c::code(l1c::Code::Pilot, number), l1c::secondary_code(number)],
                _ => [b1c::code(b1c::Code::Pilot, number), b1c::secondary_code(number)],
            };
            let [code, secondary_code] = chips.map(Option::unwrap);
            let (begun_s, lead) = secondary_code_begins_s(hit, [&i, &q], 4e6, [&code, &secondary_code]);
            println!(
                "{}: its secondary code begins {begun_s:.4} s after the first sample, better by {lead:.2}",
                hit.sv
            );
            assert!(lead > 1.5, "{lead}");
            begun_s
        })
        .collect();
    // Those of B1C begin together and 14 s after those of L1C, as BDT is 14 s behind GPS time. Medium orbits
    // are 72 to 92 ms away, those of GPS 67 to 87 ms.
    for begun_s in &begins_s[..3] {
        assert!(after_s(*begun_s, begins_s[0]).abs() < 0.02, "{begins_s:?}");
        assert!(after_s(*begun_s, begins_s[3] + 14.0).abs() < 0.025, "{begins_s:?}");
    }
}

#[test]
fn half_a_second_of_real_signal_tracks_with_steady_power_and_bit_edges_twenty_milliseconds_apart() {
    let Some((i, q)) = read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return };
    let metadata = IfMetadata { inverted: true, ..metadata(Format::Ci8, 4e6, 0.0) };
    let found = acquire(&metadata, &i, &q, &AcquisitionSettings::default());
    // A symbol search takes longer than this recording; the loops before it work on single code periods.
    let settings = TrackingSettings { fll_pull_in_s: 0.1, ..TrackingSettings::default() };
    for (prn, cn0_dbhz) in [(26, 47.6), (31, 47.2)] {
        let hit = found.iter().find(|hit| hit.sv.number == prn).unwrap();
        let mut channel = Channel::start(hit, &metadata, &settings);
        let mut report = Report::default();
        // In the middle of each millisecond: between two prompts, whatever the code phase.
        let ticks: Vec<u64> = (0..(i.len() as u64 / 4000)).map(|k| 4000 * k + 2000).collect();
        channel.advance(&Block { first: 0, i: &i, q: &q }, &ticks, &mut report);
        assert!(!channel.is_lost(), "PRN {prn}: {:?}", report.events);
        let rows = &report.rows[250..];
        assert!(rows.len() > 240, "{}", rows.len());

        // Signal to noise of a 1 ms prompt at 47 dB-Hz is 20 dB: its magnitude wanders by a tenth, so a mean
        // of 240 by 1 %, and the halves of the segment agree to 5 %.
        let magnitude = |rows: &[gnss::record::TrackingRow]| {
            rows.iter().map(|row| libm::hypot(row.prompt_i, row.prompt_q)).sum::<f64>() / rows.len() as f64
        };
        let (first, second) = rows.split_at(rows.len() / 2);
        let ratio = magnitude(first) / magnitude(second);
        assert!((ratio - 1.0).abs() < 0.05, "PRN {prn}: {ratio}");
        // The in-phase prompts hold the signal, the quadrature ones its noise and what phase jitter leaks.
        // Estimates by other programs differ by a decibel and a half.
        let quadrature = rows.iter().map(|row| row.prompt_q * row.prompt_q).sum::<f64>() / rows.len() as f64;
        let in_phase = rows.iter().map(|row| row.prompt_i.abs()).sum::<f64>() / rows.len() as f64;
        let measured = 10.0 * libm::log10(in_phase * in_phase / (2.0 * 1e-3 * quadrature));
        assert!((measured - cn0_dbhz).abs() < 2.0, "PRN {prn}: {measured} dB-Hz");
        assert!(rows.last().unwrap().phase_lock > 0.9);

        let edges: Vec<usize> =
            (1..rows.len()).filter(|&k| (rows[k].prompt_i > 0.0) != (rows[k - 1].prompt_i > 0.0)).collect();
        println!("PRN {prn}: {measured:.1} dB-Hz, halves {ratio:.3}, edges at {edges:?} ms");
        assert!(edges.len() >= 3, "{edges:?}");
        assert!(edges.iter().all(|edge| edge % 20 == edges[0] % 20), "PRN {prn}: {edges:?}");
    }
}

/// Searches for Galileo E1 alone: data and pilot for as long as `settings` say.
fn acquire_e1(metadata: &IfMetadata, i: &[f32], q: &[f32], settings: &AcquisitionSettings) -> Vec<Acquired> {
    let settings = AcquisitionSettings { signals: vec![E1.name.to_owned()], ..settings.clone() };
    let mut searcher = Searcher::new(metadata, &settings).unwrap();
    let candidates: Vec<Link> =
        E1.satellites().map(|sv| E1.link(sv)).filter(|link| link.is_of_constellation()).collect();
    let rows = searcher.search(&Block { first: 0, i, q }, &candidates).unwrap();
    for (row, _) in rows.iter().filter(|(row, _)| row.statistic > 0.8 * row.threshold) {
        println!(
            "{} {} {:9.1} Hz {:7.2} chips {:5.1} dB-Hz  {:.1}/{:.1}",
            row.sv, row.acquired, row.doppler_hz, row.code_phase_chips, row.cn0_dbhz, row.statistic, row.threshold
        );
    }
    rows.iter().filter_map(|(_, hit)| *hit).collect()
}

#[test]
fn a_recording_holds_the_galileo_satellites_that_others_found_in_it() {
    let Some((i, q)) = read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return };
    let metadata = IfMetadata { inverted: true, ..metadata(Format::Ci8, 4e6, 0.0) };
    let settings = AcquisitionSettings { coherent_periods: 4, noncoherent_sums: 25, ..AcquisitionSettings::default() };
    let found = acquire_e1(&metadata, &i, &q, &settings);
    // Number 19 is not in the list, which ends at stronger ones: 36 dB-Hz, 20 % above its threshold.
    let listed = [27, 30, 7, 15, 21, 20, 19];
    let numbers: Vec<u8> = found.iter().map(|hit| hit.sv.number).collect();
    assert!(numbers.iter().all(|number| listed.contains(number)), "{numbers:?}");
    assert_eq!(numbers.len(), listed.len(), "{numbers:?}");
}

/// Two bits a sample, real, four in a byte from the low bits on, at 20 Msps and an IF of 5 000 446 Hz.
pub fn two_bits(name: &str) -> Option<Vec<f32>> {
    let bytes = std::fs::read(external(name)?).unwrap();
    let value = |pair: u8| [1.0, 3.0, -3.0, -1.0][usize::from(pair & 3)];
    Some(bytes.iter().flat_map(|byte| (0..4).map(move |place| value(byte >> (2 * place)))).collect())
}

#[test]
fn a_recording_of_2016_holds_four_galileo_satellites_where_another_program_found_them() {
    let Some(i) = two_bits("if-signals/ifen_e1_2016-01-19_20msps_r2bit.bin") else { return };
    let q = vec![0.0; i.len()];
    let metadata = metadata(Format::Ri8, 20e6, 5_000_446.0);
    let settings = AcquisitionSettings {
        coherent_periods: 4,
        noncoherent_sums: 9,
        doppler_max_hz: 2500.0, // all that are listed; a search at 20 Msps takes its time
        ..AcquisitionSettings::default()
    };
    let found = acquire_e1(&metadata, &i, &q, &settings);
    // Doppler to a grid of 125 Hz and the delay in chips of the first sample, of E1-C.
    let listed = [(12, -1000.0, 3530.9), (19, -250.0, 943.2), (11, 1625.0, 905.0), (30, -500.0, 3968.8)];
    // The list has the four strongest: number 20 is weaker than three of them, at 1.7 times its threshold.
    let numbers: Vec<u8> = found.iter().map(|hit| hit.sv.number).collect();
    let known = |number: &u8| *number == 20 || listed.iter().any(|(known, ..)| known == number);
    assert!(numbers.iter().all(known), "{numbers:?}");
    for (number, doppler_hz, delay_chips) in listed {
        let Some(hit) = found.iter().find(|hit| hit.sv.number == number) else { continue };
        assert!((hit.doppler_hz - doppler_hz).abs() < 100.0, "{hit:?}, listed at {doppler_hz} Hz");
        let apart = |sign: f64| libm::remainder(sign * hit.code_phase_chips - delay_chips, 4092.0).abs();
        assert!(apart(1.0).min(apart(-1.0)) < 0.3, "{hit:?}, listed at {delay_chips} chips");
    }
    assert_eq!(numbers.len(), 5, "{numbers:?}");
}
