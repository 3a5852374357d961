//! Cases 67 to 69: sixty signals in eight bits, double differences, and users far above their satellites.

use std::collections::BTreeMap;
use std::path::Path;

use generator::scene::Scene;
use generator::spoof::Constellation;
use generator::synth::Edge;
use generator::transmit::Transmitter;
use generator::truth;
use generator::vehicle::Trajectory;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS, rotate_earth};
use gnss::satellite::Sv;
use gnss::signal::{SIGNALS, Signal};
use gnss::time::Epoch;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::codes::{DAY_S, IF_HZ, RATE_HZ, RUN, fitted, late, replica, senders};
use crate::exact::{CLOCK, Exact, signed};
use crate::figures::{ALL, CA, Case, Worst, case};
use crate::{run, skies};

/// Everything around L1 over Bangkok: the shipped full sky, B1I beside it, and all of that once more from a
/// spoofer, two chips away.
fn full(format: &str) -> Scene {
    let tables = format!(
        "name = \"extreme\"\nstart = 2026-03-09T10:52:26\nduration_s = 0.01\nseed = 1\nsignals = [\"GPS L1 C/A\", \
         \"GPS L1C\", \"Galileo E1\", \"BeiDou B1C\", \"BeiDou B1I\", \"QZSS L1 C/A\", \"QZSS L1C\", \"NavIC \
         L1\"]\n[motion]\nkind = \"static\"\nlatitude_deg = 13\nlongitude_deg = 100.5\nheight_m = 60\n[navigation]\n\
         file = \"full_sky_2026-03-09_10h_12h.rnx\"\n[satellites]\nmask_deg = 0\n[power]\ncn0_dbhz = 45\n[front_end]\n\
         center_hz = 1575.42e6\nsample_rate_hz = 36e6\nformat = \"{format}\"\nnoise_lsb = 20\n[fidelity]\nlevel = \
         \"reference\"\ncode_edge = \"nearest\"\n[[spoofer]]\npower_db = 0\nclock_bias_s = 2e-6\n{CLOCK}"
    );
    run::try_scene_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios"), &tables).unwrap()
}

#[test]
fn sixty_signals_in_eight_bits_keep_their_amplitudes_and_phases() {
    let the = case(67, "sixty signals in eight bits", "eight around L1, of five systems");
    const SAMPLES: u64 = 36_000;
    let of = |format: &str| {
        let scene = full(format);
        let bytes = run::part(&scene, 0..SAMPLES, tempfile::tempdir().unwrap().path());
        let (i, q) = run::planes(&scene, &bytes);
        let samples: Vec<Complex64> =
            i.iter().zip(&q).map(|(i, q)| Complex64::new(f64::from(*i), f64::from(*q))).collect();
        (scene, samples)
    };
    let ((scene, exact), (_, rounded)) = (of("cf32"), of("ci8"));
    let links: Vec<(Sv, &'static Signal)> = (run::in_view(&scene).into_iter())
        .flat_map(|sv| scene.signals_of(sv).map(move |signal| (sv, signal)).collect::<Vec<_>>())
        .collect();
    let count = 2.0 * links.len() as f64;
    the.at_least("signals at once", (count, "those in view and a spoofer's of as many"), 60.0, "");
    let largest = exact.iter().map(|x| x.re.abs().max(x.im.abs())).fold(0.0, f64::max);
    the.at_most("largest sum of them without noise", (largest, "in 1 ms"), 127.0, "LSB");
    let amplitude = 20.0 * f64::sqrt(2.0 * libm::pow(10.0, 4.5) / 36e6);
    let found: Vec<[Worst; 2]> = links
        .par_iter()
        .map(|(sv, signal)| {
            let (parts, _) = replica((&scene, *sv, signal), (0, SAMPLES));
            let wave = fitted(signal, &parts, &exact);
            let prompt = |samples: &[Complex64]| {
                let sum: Complex64 = samples.iter().zip(&wave).map(|(sample, wave)| sample * wave.conj()).sum();
                let power: f64 = wave.iter().map(Complex64::norm_sqr).sum();
                sum / (power * amplitude)
            };
            let (exact, moved) = (prompt(&exact), prompt(&rounded) - prompt(&exact));
            let at = format!("{signal} of {sv}");
            // Along what is found of the signal and across it.
            let moved = moved * exact.conj() / exact.norm();
            [(moved.re.abs(), at.clone()), (moved.im.abs(), at)].map(Worst::from)
        })
        .collect();
    let mut worst = <[Worst; 2]>::default();
    for found in found {
        worst.iter_mut().zip(found).for_each(|(worst, found)| worst.merge(found));
    }
    let [along, across] = worst;
    // Rounding is white, 1/12 LSB² in each quadrature, in 36 000 samples of 0.84 LSB: 1.8e-3 of the signal.
    // Of seventy and more in two quadratures the largest is below five deviations.
    let bar = 5.0 * f64::sqrt(1.0 / 12.0 / SAMPLES as f64) / amplitude;
    the.at_most("amplitude moved by rounding to eight bits", along, bar, "of it");
    the.at_most("phase moved by rounding to eight bits", across, bar, "rad");
}

/// Largest deviation of double differences from whole numbers, how many there are, and how many of them keep
/// the whole number that their pair had first.
fn double_differences(of: [&Scene; 2], signal: &'static Signal, step_s: u64) -> (Worst, [usize; 2]) {
    let authentic = Constellation::authentic();
    let rate_hz = of[0].clock.rate.hz() as u64;
    let (mut worst, mut kept) = (Worst::default(), [0; 2]);
    let mut first: BTreeMap<(Sv, Sv), i128> = BTreeMap::new();
    for second in (step_s..DAY_S).step_by(step_s as usize) {
        let n = second * rate_hz;
        // Carrier less the integers' cycles, of one satellite between the two receivers.
        let between = |sv: Sv| {
            let error = |scene: &Scene| {
                let (row, ..) = truth::observe(scene, &authentic, sv, signal, n, 0.0).unwrap()?;
                let exact = Exact::new(scene, sv, signal);
                let (whole, rest) = exact.cycles(exact.delay(n));
                // The whole parts are integers below 2^53: their difference is exact.
                Some((row.carrier_cycles.floor() as i128 - whole, row.carrier_cycles.fract() - rest))
            };
            let (a, b) = (error(of[0])?, error(of[1])?);
            Some((a.0 - b.0, a.1 - b.1))
        };
        let up: Vec<Sv> = senders(of[0], signal)
            .into_iter()
            .filter(|sv| truth::in_view(of[0], *sv, of[0].clock.epoch(n)).unwrap_or(false))
            .collect();
        let Some((reference, a)) = up.first().and_then(|sv| Some((*sv, between(*sv)?))) else { continue };
        for sv in &up[1..] {
            let Some(b) = between(*sv) else { continue };
            let (whole, rest) = (b.0 - a.0, b.1 - a.1);
            let integer = whole + rest.round() as i128;
            worst.take((rest - rest.round()).abs(), || format!("{signal}, {sv} less {reference}, second {second}"));
            kept[0] += usize::from(*first.entry((*sv, reference)).or_insert(integer) == integer);
            kept[1] += 1;
        }
    }
    (worst, kept)
}

/// Two scenes: one without a clock's error, and one ten kilometres away with one.
fn pair(mut make: impl FnMut(&str) -> Scene) -> [Scene; 2] {
    let (base, mut rover) = (make(""), make(CLOCK));
    let place = base.trajectory.at(0.0).position_m;
    let up = Geodetic::from_ecef(&place).ecef_to_enu().transpose();
    rover.trajectory = Trajectory::fixed(place + up * nalgebra::Vector3::new(8e3, 6e3, 0.0));
    [base, rover]
}

#[test]
fn double_differences_are_whole_numbers_all_day() {
    let told = |the: Case, when: &str, (worst, [held, of]): (Worst, [usize; 2])| {
        // Four sums of a delay and a clock, 0.08 s or 2e8 cycles at most, that resolve 3e-8 cycle, and four
        // ranges whose coordinates resolve 7.5e-9 m, 6e-8 cycle of S, on both sides.
        the.at_most(&format!("double differences {when}, off whole numbers"), worst, 5e-7, "cycle");
        the.all(&format!("whole numbers {when} that stay"), held, of);
        assert!(of > 500, "{of}");
    };
    let the = case(68, "double differences over a day", CA);
    let [mut base, mut rover] = pair(|clock| {
        run::scene(60.0, &format!("[front_end]\nsample_rate_hz = 65e6\nformat = \"cf32\"\n[power]\n{clock}"))
    });
    for scene in [&mut base, &mut rover] {
        scene.clock.start = Epoch::parse("2010-07-01T00:00:00").unwrap();
    }
    told(the, "of a day", double_differences([&base, &rover], &gnss::gps::l1ca::L1_CA, 300));
    let of: Vec<_> = SIGNALS
        .par_iter()
        .map(|signal| {
            let front = skies::front_end(signal, RATE_HZ, IF_HZ);
            let mut of = pair(|clock| skies::scene(&[signal], 60.0, &format!("{front}{clock}")));
            for scene in &mut of {
                scene.clock.start = Epoch::new(scene.clock.start.seconds() - DAY_S as i64 / 2, 0.0);
            }
            double_differences([&of[0], &of[1]], signal, 300)
        })
        .collect();
    let (mut worst, mut kept) = (Worst::default(), [0; 2]);
    for (signal, (of, [held, all])) in SIGNALS.iter().zip(of) {
        // A single satellite of NavIC's sky sends on L1.
        assert_eq!(all > 0, signal.name != "NavIC L1", "{signal}");
        worst.merge(of);
        kept = [kept[0] + held, kept[1] + all];
    }
    told(Case { signals: "all 25 but NavIC L1", ..the }, "while the shipped orbits last", (worst, kept));
}

#[test]
fn from_low_orbits_and_from_the_moon_light_takes_its_time_for_every_signal() {
    let the = case(69, "light time to a low orbit and to the Moon", ALL);
    // 400 km above the ground, and the Moon's mean distance, both along the antenna's zenith.
    for (name, distance_m, longest_s, rounding_m) in
        [("low orbit", 6.778e6, 0.118, 8e-9), ("Moon", 3.844e8, 1.14, 6.6e-8)]
    {
        let of: Vec<[Worst; 3]> = SIGNALS
            .par_iter()
            .map(|signal| {
                let (mut scene, first) = late(signal, RATE_HZ, IF_HZ, DAY_S);
                let place = scene.trajectory.at(0.0).position_m;
                scene.trajectory = Trajectory::fixed(place.normalize() * distance_m);
                let at = scene.clock.epoch(first);
                let (mut longest_s, mut apart_m, mut carrier) = (Worst::default(), Worst::default(), Worst::default());
                for sv in senders(&scene, signal) {
                    let Some(seen) = truth::seen(&scene, sv, signal, at).unwrap() else { continue };
                    let input = || format!("{signal} of {sv}");
                    let travel_s = seen.emission.travel_s;
                    let sent = seen.emission.sight.received.plus_s(-travel_s);
                    let (state, _) = scene.catalogue.truth(sv, sent).unwrap().unwrap();
                    let there_m = rotate_earth(&state.position_m, travel_s);
                    let range_m = (there_m - seen.emission.sight.user_m).norm();
                    apart_m.take((range_m - SPEED_OF_LIGHT_MPS * travel_s).abs(), input);
                    longest_s.take(travel_s, input);
                    // Of the carrier one satellite is enough: all are made alike.
                    if !carrier.value().is_nan() || !truth::in_view(&scene, sv, at).unwrap() {
                        continue;
                    }
                    let Some(mut transmitter) = Transmitter::new(&scene, sv, signal, Edge::Nearest).unwrap() else {
                        continue;
                    };
                    let n = (first / RUN + 1) * RUN;
                    transmitter.prepare_alone(&scene, n, n + RUN).unwrap();
                    if let Some((turns, _)) = transmitter.phases(&scene, n) {
                        let exact = Exact::new(&scene, sv, signal);
                        // The first component's phase is some quarters of a turn.
                        let quarters = 4.0 * signed(turns.wrapping_sub(exact.carrier(n, exact.delay(n))));
                        carrier.take((quarters - quarters.round()).abs() / 4.0, input);
                    }
                }
                [longest_s, apart_m, carrier]
            })
            .collect();
        let mut worst = <[Worst; 3]>::default();
        for of in of {
            worst.iter_mut().zip(of).for_each(|(worst, of)| worst.merge(of));
        }
        let [longest, apart_m, carrier] = worst;
        // To a geosynchronous orbit at 4.216e7 m at least.
        the.at_least(&format!("{name}: longest light time"), longest, longest_s, "s");
        // A light time resolves 2.8e-17 s and 2.2e-16 s, 8e-9 and 6.6e-8 m, and coordinates 7.5e-9 m and 6e-8
        // m in each of three; half of each is rounded off, and the equation is solved to one of the first.
        the.at_most(&format!("{name}: light-time equation"), apart_m, 3.0 * rounding_m, "m");
        // Half the knots' tolerance, and such a rounding at the sample and in the nodes around it, in waves
        // of S.
        let bar = 5e-7 + 2.0 * rounding_m / 0.12;
        the.at_most(&format!("{name}: carrier, to integers"), carrier, bar, "cycle");
    }
}
