//! Cases 47 to 52: loops near their limits and locks that are false.

use generator::spoof::Constellation;
use generator::stream::{Options, generate_with};
use generator::truth;
use gnss::gps::l1ca::{self, L1_CA};
use gnss::gps::lnav::{Broadcast, PREAMBLE};
use gnss::rinex;
use gnss::satellite::Sv;
use gnss::time::{Epoch, WEEK_S};
use num_complex::Complex64;
use receiver::correlate::{Edge, Nco, Replica, chips_to_units};
use receiver::decode::{Decoder, News};
use receiver::position::CodeNoise;
use receiver::track::loops::{self, Gains, Rates, bandwidth_time};
use receiver::track::{CodeDiscriminator, Symbol, TrackingSettings};

use crate::figures::{CA, NONE, Worst, case};
use crate::fuzz::Period;
use crate::run;

#[test]
fn sums_over_unknown_bits_lose_what_theory_says_and_two_quadrants_see_no_bit() {
    let the = case(47, "T = 20 ms, bits unsynchronised", CA);
    // Prompts of a code period each from the generator's own signal, by the truth's code and carrier.
    let sv = Sv::gps(23);
    let mut still = run::only(
        run::scene(7.0, "[front_end]\nsample_rate_hz = 1.5e6\nformat = \"cf32\"\n[power]\ncn0_dbhz = 45\n"),
        &[sv],
    );
    still.noise = false;
    let bytes = run::samples(&still);
    let (i, q) = run::planes(&still, &bytes);
    let mut prompts: Vec<f64> = Vec::new();
    let mut near = 0;
    while let Some(period) = Period::after(&still, sv, near).filter(|p| p.first + p.samples < still.samples) {
        prompts.push(period.prompt(&still, sv, &i[period.first as usize..], &q[period.first as usize..]).re);
        near = period.first + period.samples / 2;
    }
    let mean = prompts.iter().map(|x| x.abs()).sum::<f64>() / prompts.len() as f64;
    let power = prompts.windows(20).map(|w| (w.iter().sum::<f64>() / 20.0 / mean).powi(2)).sum::<f64>()
        / (prompts.len() - 19) as f64;
    // Of these bits a share p turns. Then (1 − k/10)² is left for k = 0 … 19 periods, 0.335 on average; half
    // of them turning would leave 0.6675, the −1.76 dB of the textbook.
    let turns = prompts.windows(2).filter(|w| w[0] * w[1] < 0.0).count() as f64 / (prompts.len() as f64 / 20.0);
    let theory_db = 10.0 * libm::log10(1.0 - turns * (1.0 - 0.335));
    assert!((0.4..0.6).contains(&turns), "{turns}");
    the.near("mean loss of 20 ms over unknown bits", (10.0 * libm::log10(power), "G23, 7 s"), theory_db, 0.02, "dB");
    the.near(
        "the same for bits of which half turn",
        (10.0 * libm::log10(1.0 - (1.0 - power) * 0.5 / turns), "G23, 7 s"),
        -1.76,
        0.03,
        "dB",
    );
    let (mut worst, mut jumps) = (Worst::default(), Worst::default());
    for f_hz in [-20.0, -3.0, 0.0, 7.0, 20.0] {
        let before = Complex64::from_polar(1.0, 0.4);
        let after = Complex64::from_polar(-1.0, 0.4 + std::f64::consts::TAU * f_hz * 1e-3);
        worst.take((loops::frequency_two_quadrant(before, after, 1e-3) - f_hz).abs(), || format!("{f_hz} Hz"));
        jumps.take((loops::frequency_four_quadrant(before, after, 1e-3) - f_hz).abs(), || format!("{f_hz} Hz"));
    }
    the.at_most("two-quadrant FLL across a bit edge", worst, 1e-9, "Hz");
    the.near("four-quadrant FLL across a bit edge jumps by 1/(2T)", jumps, 500.0, 1e-9, "Hz");
    // The receiver itself, started in the middle of a bit at the longest integration.
    let scene = run::only(
        run::scene(3.0, "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[noise]\n[power]\ncn0_dbhz = 45\n"),
        &[Sv::gps(23)],
    );
    let settings = TrackingSettings { integration: 20, pll_bandwidth_hz: 10.0, ..Default::default() };
    let bytes = run::samples(&scene);
    let (channel, report) = run::track(&scene, &bytes, &run::hit(&scene, Sv::gps(23), 0.2, 60.0), &settings, 260_000);
    let last = report.measurements.last().unwrap();
    let truth_hz = {
        let at = truth::observe(&scene, &Constellation::authentic(), Sv::gps(23), &L1_CA, last.sample, 0.0);
        at.unwrap().unwrap().0.doppler_hz
    };
    assert!(!channel.is_lost() && last.locked);
    let error_hz = (last.doppler_hz - truth_hz).abs();
    the.at_most("channel with T = 20 ms from 60 Hz off: Doppler", (error_hz, "G23 after 3 s"), 2.0, "Hz");
}

#[test]
fn beyond_the_classic_limits_of_stability_the_discrete_design_keeps_its_bandwidth() {
    let the = case(48, "B·T of 0.36 to 0.60", NONE);
    for order in [1_u32, 2, 3] {
        let (mut worst, mut stable, mut of) = (Worst::default(), 0, 0);
        for product in [0.018, 0.1, 0.36, 0.45, 0.56, 0.60, 1.0] {
            // An order-1 loop has at most 0.5.
            if order == 1 && product > 0.45 {
                continue;
            }
            let gains = Gains::design(order, product);
            // Response of the phase to one unit of error, then none: its energy is twice B·T.
            let (mut phase, mut rates, mut energy) = (0.0_f64, Rates::default(), 0.0_f64);
            let mut mean_before = 0.0_f64;
            for k in 0..20_000 {
                let input = if k == 0 { 1.0 } else { 0.0 };
                // The mean phase of an interval is where it began and half of what the NCO turns in it.
                let mean = phase + 0.5 * rates.mean(1.0);
                energy += mean * mean;
                let begun = rates.mean(1.0);
                let (next, jump) = loops::step(&gains, &rates, input - mean, 1.0);
                phase += begun + jump;
                rates = next;
                mean_before = mean;
            }
            of += 1;
            stable += usize::from(mean_before.abs() < 1e-9);
            worst.take((energy / 2.0 / product - 1.0).abs(), || format!("B·T of {product}"));
        }
        the.all(&format!("order {order}: response dies out"), stable, of);
        the.at_most(&format!("order {order}: bandwidth against the one asked for"), worst, 0.05, "");
    }
    assert!((bandwidth_time(2, 0.613_679) - 0.36).abs() < 1e-5);
    let refused = [0.45, 0.56, 0.60].iter().filter(|product| {
        let settings = TrackingSettings { integration: 20, pll_bandwidth_hz: **product / 0.02, ..Default::default() };
        settings.validate(1e-3).is_err_and(|e| e.to_string().contains("above the limit 0.4 (at most 20 Hz here)"))
    });
    the.all("settings of 0.45, 0.56, 0.60: refused with margin and remedy", refused.count(), 3);
}

#[test]
fn a_correlator_too_narrow_or_too_wide_is_refused_and_its_noise_stays_finite() {
    let the = case(49, "d → 0, d = 2", CA);
    let refused = [0.0, 1e-9, 0.0199, 1.51, 2.0, 2.5, f64::NAN].iter().filter(|d| {
        let settings = TrackingSettings { spacing_chips: **d, ..Default::default() };
        settings.validate(1e-3).is_err_and(|e| e.to_string().contains("spacing_chips"))
    });
    the.all("refused with the range", refused.count(), 7);
    let finite = [0.02, 0.1, 1.0, 1.2, 1.5].iter().filter(|d| {
        let noise = CodeNoise {
            chip_m: 293.0,
            share: 1.0,
            shape: loops::CodeShape::triangle(**d),
            discriminator: CodeDiscriminator::EarlyMinusLate,
            bandwidth_hz: 0.5,
            integration_s: 1e-3,
        };
        let shape = loops::CodeShape::triangle(**d);
        let gain = shape.early_minus_late_gain(1.0);
        [1.0, 1e3, 1e10].iter().all(|cn0| noise.sigma_m(*cn0).is_finite() && noise.sigma_m(*cn0) > 0.0)
            && gain > 0.0
            && gain <= 1.0
    });
    the.all("0.02 to 1.5: jitter and gain finite", finite.count(), 5);
    // A whole channel at d = 1.5.
    let scene = run::only(
        run::scene(2.5, "[front_end]\nsample_rate_hz = 5e6\nformat = \"ci8\"\n[noise]\n[power]\ncn0_dbhz = 50\n"),
        &[Sv::gps(23)],
    );
    let settings = TrackingSettings { spacing_chips: 1.5, ..Default::default() };
    let (_, report) =
        run::track(&scene, &run::samples(&scene), &run::hit(&scene, Sv::gps(23), 0.1, 20.0), &settings, 500_000);
    let last = report.measurements.last().unwrap();
    // σ at 50 dB-Hz, 0.5 Hz, d = 1.5: 0.57 m; three of them.
    the.at_most(
        "d = 1.5: code after 2.5 s at 50 dB-Hz",
        (run::code_error_m(&scene, Sv::gps(23), last.sample, last.code_fraction).abs(), "G23"),
        1.8,
        "m",
    );
}

#[test]
fn data_upside_down_are_the_same_data() {
    let the = case(50, "half-cycle lock", CA);
    let set = &rinex::embedded().unwrap().ephemerides[0];
    let broadcast = Broadcast::new(None, 15, &[], set.toe).unwrap();
    let start = set.toe.seconds() - 3600;
    let mut bits = Vec::new();
    for subframe in 0..10_i64 {
        for word in broadcast.subframe(set, Epoch::new(start + 6 * subframe, 0.0)).unwrap() {
            bits.extend((0..30).rev().map(|bit| word >> bit & 1 == 1));
        }
    }
    assert_eq!(bits[..8].iter().fold(0, |word, bit| word << 1 | u32::from(*bit)), PREAMBLE);
    let read = |upside_down: bool, from: usize| {
        let mut decoder = Decoder::new(&L1_CA, set.sv).unwrap();
        let mut found = Vec::new();
        for (k, bit) in bits.iter().enumerate().skip(from) {
            let soft = if *bit != upside_down { -9.0 } else { 9.0 };
            let symbol = Symbol { first_period: 20 * k as u64, end: 0, soft };
            found.extend(decoder.take(&symbol, Epoch::new(start, 0.0)));
        }
        let time = decoder.time_of_week(20 * 2000, 0.0);
        (
            format!("{:?}", found.iter().filter(|news| matches!(news, News::Ephemeris { .. })).collect::<Vec<_>>()),
            time,
            found.len(),
        )
    };
    let (mut held, mut of) = (0, 0);
    for from in [0, 1, 17, 299, 300] {
        let (upright, inverted) = (read(false, from), read(true, from));
        of += 1;
        let tow = (start + 40).rem_euclid(WEEK_S);
        held += usize::from(
            upright.0 == inverted.0 && upright.1 == inverted.1 && upright.1 == Some((tow, 0.0)) && upright.2 > 5,
        );
    }
    the.all("ephemeris and time alike both ways up (preambles 8B and 74)", held, of);
}

#[test]
fn away_from_the_peak_a_channel_comes_back_or_gives_up() {
    let the = case(51, "false lock half a chip and a chip off", CA);
    let sv = Sv::gps(23);
    let scene = run::only(
        run::scene(8.0, "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[noise]\n[power]\ncn0_dbhz = 45\n"),
        &[sv],
    );
    let bytes = run::samples(&scene);
    let (mut held, mut of, mut worst_m) = (0, 0, Worst::default());
    for chips in [-1.1, -1.0, -0.75, -0.5, 0.5, 0.75, 1.0, 1.1, 3.3, -511.5] {
        let (channel, report) =
            run::track(&scene, &bytes, &run::hit(&scene, sv, chips, 30.0), &TrackingSettings::default(), 260_000);
        let last = report.measurements.iter().rev().find(|m| m.locked);
        let late = last.filter(|m| m.sample > 18_000_000);
        let error_m = late.map(|m| run::code_error_m(&scene, sv, m.sample, m.code_fraction).abs());
        of += 1;
        // Lost, never locked, or on the peak: the tail of 2.5 Hz from 1.1 chips leaves centimetres after 7 s.
        held += usize::from(channel.is_lost() || error_m.is_none_or(|m| m < 5.0));
        if let Some(error_m) = error_m.filter(|_| !channel.is_lost()) {
            worst_m.take(error_m, || format!("started {chips} chips off"));
        }
    }
    the.all("on the peak, or told", held, of);
    the.at_most("code of those locked after 7 s", worst_m, 5.0, "m");
    // Between the peak and the lobes of the code there is nothing as high: −23.9 dB.
    let replica = Replica::new(l1ca::code(23).unwrap(), Edge::Nearest).unwrap();
    let code = l1ca::code(23).unwrap();
    let i: Vec<f32> = code.iter().map(|chip| if *chip { -1.0 } else { 1.0 }).collect();
    let mut highest_db = Worst::default();
    for lag in 1..1023 {
        let nco = Nco {
            carrier: 0,
            carrier_step: 0,
            code: chips_to_units(f64::from(lag) + 0.5),
            code_step: chips_to_units(1.0) as u64,
        };
        let lobe = replica.slow(&i, &vec![0.0; 1023], &nco, &[0])[0].norm() / 1023.0;
        highest_db.take(20.0 * libm::log10(lobe), || format!("lag of {lag} chips"));
    }
    the.near("highest lobe of the code beside its peak", highest_db, -23.94, 0.01, "dB");
}

#[test]
fn threads_change_no_byte() {
    let the = case(52, "determinism", CA);
    let tables = "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[noise]\n[power]\n[receiver_clock]\n\
                  oscillator = \"tcxo\"\n\
        [scintillation]\ns4 = 0.5\nsigma_phi_rad = 0.3\ndecorrelation_s = 0.5\n";
    let scene = run::scene(0.4, tables);
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let directory = tempfile::tempdir().unwrap();
        let mut writer = truth::Writer::create(directory.path()).unwrap();
        let mut bytes = Vec::new();
        pool.install(|| generate_with(&scene, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap());
        bytes
    };
    let one = make(1);
    the.all("1, 2, 3, 7 threads: same bytes", [2, 3, 7].iter().filter(|threads| make(**threads) == one).count() + 1, 4);
}
