//! Cases 13 to 22: places and skies in which directions degenerate.

use std::f64::consts::{FRAC_PI_2, PI};

use generator::effect::ionosphere::KlobucharIonosphere;
use generator::effect::mapping::Mapping;
use generator::effect::mapping::niell;
use generator::effect::troposphere::{Air, Troposphere, Weather};
use generator::sky;
use generator::stream::{Options, generate_part};
use generator::truth;
use generator::vehicle::Motion;
use gnss::broadcast::{ClockState, OrbitError, State};
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS, look, rotate_earth};
use gnss::gps::l1ca::L1_CA;
use gnss::rinex;
use gnss::satellite::Sv;
use gnss::time::{BDT, Epoch, GLONASST, GPST, GST};
use nalgebra::Vector3;
use receiver::acquire;
use receiver::position::least_squares::{Corrections, Ionosphere, Range, position};
use receiver::position::{NoFix, consistent};
use receiver::source::Block;
use receiver::track::TrackingSettings;

use crate::figures::{CA, NONE, Worst, case};
use crate::run;

const L1_HZ: f64 = 1_575.42e6;

#[test]
fn at_the_poles_every_longitude_is_the_same_place() {
    let the = case(13, "poles", NONE);
    let (mut worst_m, mut worst_rad, mut finite, mut of) = (Worst::default(), Worst::default(), 0, 0);
    for latitude in [-90.0, 90.0, 89.999_999_999, -89.999_999_999] {
        for longitude in [-180.0, -33.0, 0.0, 77.0, 180.0] {
            for height_m in [-400.0, 0.0, 9e3, 2e7] {
                let place = Geodetic::from_degrees(latitude, longitude, height_m);
                let back = Geodetic::from_ecef(&place.to_ecef());
                let at = || format!("{latitude}°, {longitude}°, {height_m} m");
                worst_m.take((back.to_ecef() - place.to_ecef()).norm(), at);
                worst_m.take((back.height_m - height_m).abs(), at);
                worst_rad.take((back.latitude_rad - place.latitude_rad).abs(), at);
                let axes = back.ecef_to_enu();
                let up = look(back, &place.to_ecef(), &(place.to_ecef() * 4.0));
                of += 1;
                finite += usize::from(
                    axes.iter().all(|x| x.is_finite())
                        && (axes.determinant() - 1.0).abs() < 1e-12
                        && up.azimuth_rad.is_finite()
                        && up.elevation_rad > 1.5,
                );
            }
        }
    }
    the.at_most("latitude there and back", worst_rad, 1e-12, "rad");
    the.at_most("position and height there and back", worst_m, 1e-6, "m");
    the.all("local axes finite and right-handed", finite, of);
}

#[test]
fn the_two_names_of_the_antimeridian_are_one_place() {
    let the = case(14, "antimeridian", CA);
    let navigation = rinex::embedded().unwrap();
    let model = navigation.klobuchar.unwrap();
    let (mut worst_m, mut worst_range_m) = (Worst::default(), Worst::default());
    for latitude in [-60.0, 0.0, 10.0, 51.0] {
        for azimuth in [0.1, 1.5, 3.0, 4.7, 6.0] {
            for tow_s in [0.0, 43_199.0, 50_400.0, 302_400.0, 604_799.0] {
                let at = Epoch::from_week(1590, tow_s);
                let towards = Look { azimuth_rad: azimuth, elevation_rad: 0.3 };
                let delay_m = |longitude: f64| {
                    let user = Geodetic::from_degrees(latitude, longitude, 100.0);
                    SPEED_OF_LIGHT_MPS
                        * [
                            model.delay_s(user, towards, at, L1_HZ),
                            KlobucharIonosphere::of_gps(model).delay_s(user, towards, at, L1_HZ),
                        ]
                        .iter()
                        .sum::<f64>()
                };
                worst_m.take((delay_m(180.0) - delay_m(-180.0)).abs(), || {
                    format!("latitude {latitude}°, azimuth {azimuth} rad, {tow_s} s of the week")
                });
            }
        }
    }
    let tables = |longitude: f64| {
        run::text(
            60.0,
            &format!(
                "[motion]\nkind = \"static\"\nlatitude_deg = 10\nlongitude_deg = {longitude}\nheight_m = 10\n\
                 [front_end]\n\
                 sample_rate_hz = 2.6e6\n[power]\n[ionosphere]\nmodel = \"klobuchar\"\n[troposphere]\nmodel \
                 = \"saastamoinen\"\n"
            ),
        )
    };
    let (east, west) = (run::try_scene(&tables(180.0)).unwrap(), run::try_scene(&tables(-180.0)).unwrap());
    for sv in run::in_view(&east) {
        let delay_s = |scene| truth::seen(scene, sv, &L1_CA, east.clock.start).unwrap().unwrap().arrivals[0].delay_s;
        worst_range_m.take((delay_s(&east) - delay_s(&west)).abs() * SPEED_OF_LIGHT_MPS, || sv.to_string());
    }
    the.at_most("ionospheric delay, 180° against −180°", worst_m, 1e-9, "m");
    // Coordinates of 180° and −180° differ by sin π = 1.2e-16 of 6.3e6 m and their rounding.
    the.at_most("pseudorange with atmosphere, the same", worst_range_m, 1e-7, "m");
}

#[test]
fn in_the_earth_s_centre_ranges_are_orbital_radii() {
    let the = case(15, "geocentre", CA);
    let centre = Geodetic::from_ecef(&Vector3::zeros());
    assert!(centre.latitude_rad.is_finite() && centre.longitude_rad.is_finite() && centre.height_m.is_finite());
    assert!((centre.height_m + 6_356_752.314).abs() < 1e-3);
    let scene = run::scene(60.0, "[front_end]\nsample_rate_hz = 2.6e6\n[power]\n");
    let (mut worst_m, mut checked) = (Worst::default(), 0);
    for sv in scene.catalogue.satellites() {
        let at = scene.clock.start;
        let Some(found) = sky::emission(&scene.catalogue, sv, at, &Motion::at_rest(Vector3::zeros())).unwrap() else {
            continue;
        };
        let (state, _) = scene.catalogue.truth(sv, at.plus_s(-found.travel_s)).unwrap().unwrap();
        worst_m.take((found.sight.range_m - state.position_m.norm()).abs(), || sv.to_string());
        assert!(found.sight.look.elevation_rad.is_finite() && found.sight.off_nadir_rad.is_finite());
        checked += 1;
    }
    assert!(checked > 25);
    the.at_most("range less orbital radius", worst_m, 1e-7, "m");
}

#[test]
fn at_and_below_the_horizon_delays_keep_their_sign_and_the_troposphere_grows_to_twice_the_air_at_most() {
    let the = case(18, "elevation 0, −1, −5°", NONE);
    let user = Geodetic::from_degrees(26.5, 80.2, 100.0);
    let at = Epoch::from_week(1590, 374_400.0);
    let model = rinex::embedded().unwrap().klobuchar.unwrap();
    let air = Troposphere { air: Air::Weather(Weather::STANDARD), mapping: Mapping::Niell };
    let (mut held, mut of) = (0, 0);
    for elevation in [0.0_f64, -1.0, -5.0, -19.79, -19.8, -19.81, -45.0, -90.0] {
        let elevation_rad = elevation.to_radians();
        let (dry, wet) = niell(user, elevation_rad, 180.0);
        let towards = Look { azimuth_rad: 2.0, elevation_rad };
        let slant_m = SPEED_OF_LIGHT_MPS * KlobucharIonosphere::of_gps(model).delay_s(user, towards, at, L1_HZ);
        let printed_m = SPEED_OF_LIGHT_MPS * model.delay_s(user, towards, at, L1_HZ);
        of += 1;
        held += usize::from(
            (10.0..60.0).contains(&dry)
                && (10.0..60.0).contains(&wet)
                && (1.0..100.0).contains(&slant_m)
                && (1.0..100.0).contains(&printed_m),
        );
    }
    the.all("mapping and ionosphere positive and bounded", held, of);
    // Hundredths of a degree from 3° down to −90°. A ray from below the horizon meets the air of the horizon
    // once more at the most, on the other side of its lowest point.
    let delays_m: Vec<f64> =
        (-9000..=300).rev().map(|n| air.delay_m(user, (0.01 * f64::from(n)).to_radians(), at)).collect();
    // Where it rests, roundings of 100 m are left.
    let growing = delays_m.windows(2).filter(|two| two[1] >= two[0] - 1e-12).count();
    the.all("steps downwards in which the troposphere does not shrink", growing, delays_m.len() - 1);
    let mut most = Worst::default();
    for (n, delay_m) in (-9000..=300).rev().zip(delays_m) {
        most.take(delay_m / air.delay_m(user, 0.0, at), || format!("{:.2}°", 0.01 * f64::from(n)));
    }
    the.at_most("troposphere below the horizon over that at it", most, 2.0, "");
}

#[test]
fn overhead_there_is_no_azimuth_and_in_the_antenna_no_direction() {
    let the = case(19, "satellite at the zenith, and at the antenna", CA);
    let scene = run::scene(
        60.0,
        "[front_end]\nsample_rate_hz = 2.6e6\n[power]\n[troposphere]\nmodel = \"saastamoinen\"\n[ionosphere]\nmodel \
         = \"klobuchar\"\n",
    );
    let (mut finite, mut refused, mut of, mut worst) = (0, 0, 0, Worst::default());
    for sv in scene.catalogue.satellites() {
        let at = scene.clock.start;
        let Some((state, _)) = scene.catalogue.truth(sv, at).unwrap() else { continue };
        // Below the satellite on the ellipsoid, then the same after its signal's flight.
        let under = |m: &Vector3<f64>, height_m: f64| Geodetic { height_m, ..Geodetic::from_ecef(m) }.to_ecef();
        let mut place = under(&state.position_m, 0.0);
        for _ in 0..6 {
            let seen = sky::emission(&scene.catalogue, sv, at, &Motion::at_rest(place)).unwrap().unwrap();
            place = under(&seen.sight.satellite.position_m, 0.0);
        }
        let mut overhead = run::scene(
            60.0,
            "[front_end]\nsample_rate_hz = 2.6e6\n[power]\n[troposphere]\nmodel = \"saastamoinen\"\n[ionosphere]\n\
             model = \"klobuchar\"\n",
        );
        overhead.trajectory = generator::vehicle::Trajectory::fixed(place);
        let seen = truth::seen(&overhead, sv, &L1_CA, at).unwrap().unwrap();
        let towards = seen.emission.sight.look;
        let arrival = seen.arrivals[0];
        of += 1;
        finite += usize::from(
            towards.azimuth_rad.is_finite()
                && arrival.delay_s.is_finite()
                && arrival.carrier_cycles.is_finite()
                && arrival.cn0_hz > 0.0,
        );
        worst.take((FRAC_PI_2 - towards.elevation_rad).abs(), || sv.to_string());
        // In the satellite, to a millimetre.
        let inside = Motion::at_rest(state.position_m + Vector3::new(1e-3, 0.0, 0.0));
        refused +=
            usize::from(matches!(sky::emission(&scene.catalogue, sv, at, &inside), Err(OrbitError::Near { .. })));
    }
    the.all("overhead: everything finite", finite, of);
    the.at_most("overhead: zenith distance", worst, 1e-6, "rad");
    the.all("at the antenna: refused", refused, of);
}

const BARE: Corrections = Corrections { ionosphere: Ionosphere::Absent, troposphere: false, model_sigma_m: 1e-6 };

/// Ranges to satellites in these directions (degrees) from 26.5° N, 80.2° E.
fn ranges(sky: &[(f64, f64)]) -> Vec<Range> {
    let place = Geodetic::from_degrees(26.5, 80.2, 130.0);
    let axes = place.ecef_to_enu().transpose();
    let range = |(&(azimuth, elevation), number): (&(f64, f64), u8)| {
        let (sin_a, cos_a) = libm::sincos(azimuth * PI / 180.0);
        let (sin_e, cos_e) = libm::sincos(elevation * PI / 180.0);
        let distance_m = 2.1e7 + 3e5 * f64::from(number);
        let there = place.to_ecef() + axes * Vector3::new(cos_e * sin_a, cos_e * cos_a, sin_e) * distance_m;
        Range {
            sv: Sv::gps(number),
            signal: &L1_CA,
            time: &GPST,
            satellite: State {
                position_m: rotate_earth(&there, -distance_m / SPEED_OF_LIGHT_MPS),
                velocity_mps: Vector3::zeros(),
            },
            clock: ClockState { offset_s: 0.0, drift: 0.0 },
            emitted: Epoch::from_week(1590, 374_400.0),
            pseudorange_m: distance_m,
            doppler_hz: 0.0,
            carrier_hz: L1_HZ,
            noise_m: 1.0,
            cn0_hz: 1e4,
            is_combined: false,
            augmented_m: None,
        }
    };
    sky.iter().zip(1..).map(range).collect()
}

#[test]
fn satellites_on_a_cone_or_in_a_plane_give_no_position_but_their_condition() {
    let the = case(20, "satellites on a cone", NONE);
    let cone = |opening: f64| (0..6).map(|k| (60.0 * f64::from(k), opening)).collect::<Vec<_>>();
    let plane: Vec<(f64, f64)> =
        (1..7).map(|k| (if k < 4 { 40.0 } else { 220.0 }, 25.0 * f64::from(1 + (k - 1) % 3))).collect();
    let (mut refused, mut least) = (0, Worst::least());
    let skies = [
        ("cone of 10°", cone(10.0)),
        ("cone of 45°", cone(45.0)),
        ("cone of 80°", cone(80.0)),
        ("plane", plane),
        ("one direction", vec![(10.0, 40.0); 5]),
    ];
    for (name, sky) in skies {
        if let Err(NoFix::Singular { condition }) = position(&ranges(&sky), Vector3::zeros(), &BARE) {
            refused += 1;
            least.take(condition, || name.to_owned());
        }
    }
    the.all("singular, never a position", refused, 5);
    the.at_least("condition that the refusal names, the least of them", least, 1e4, "");
    // A cone that is none by a hundredth of a degree: within what f64 can tell, beyond what ranges can.
    let mut almost = cone(45.0);
    almost[0].1 += 0.01;
    let found = position(&ranges(&almost), Vector3::zeros(), &BARE);
    the.all("0.01° off the cone: singular too", usize::from(matches!(found, Err(NoFix::Singular { .. }))), 1);
}

#[test]
fn too_few_satellites_are_said_to_be_and_four_prove_nothing() {
    let the = case(21, "n = 0, 1, 3, 4", NONE);
    let sky = [(20.0, 75.0), (65.0, 42.0), (190.0, 33.0), (300.0, 25.0)];
    let few = [0, 1, 3].iter().filter(|n| {
        matches!(position(&ranges(&sky[..**n]), Vector3::zeros(), &BARE), Err(NoFix::TooFew { have, need: 4 }) if have == **n)
    });
    the.all("0, 1, 3: told how many are needed", few.count(), 3);
    // A fault of 1 km on one of four moves the fix and cannot show: no freedom is left, and none excluded.
    let mut faulty = ranges(&sky);
    faulty[2].pseudorange_m += 1000.0;
    let (kept, solution, excluded) = consistent(faulty, Vector3::zeros(), &BARE, 1e-3).unwrap();
    the.all("4: a position, nobody excluded", usize::from(kept.len() == 4 && excluded.is_empty()), 1);
    the.at_most(
        "4: sum of squared residuals with a fault of 1 km",
        (solution.chi_square, "the third of four"),
        1e-6,
        "",
    );
}

#[test]
fn five_satellites_of_two_systems_are_enough_and_of_four_are_not() {
    let the = case(70, "five satellites of two and of four systems", NONE);
    let sky = [(20.0, 75.0), (65.0, 42.0), (190.0, 33.0), (300.0, 25.0), (250.0, 60.0), (110.0, 15.0), (350.0, 50.0)];
    let place = Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef();
    // Each with its system's own clock, 0, 1, 2 and 3 km ahead.
    let scales = [&GPST, &GST, &BDT, &GLONASST];
    let seen = |of: &[usize]| {
        let mut seen = ranges(&sky[..of.len()]);
        for (range, system) in seen.iter_mut().zip(of) {
            range.time = scales[*system];
            range.pseudorange_m += 1e3 * *system as f64;
        }
        seen
    };
    let (mut worst_m, mut moved) = (Worst::default(), Worst::default());
    let split = [[0, 0, 0, 0, 1], [0, 0, 0, 1, 1], [0, 0, 1, 1, 1], [0, 1, 1, 1, 1], [2, 3, 2, 3, 2]];
    for of in split {
        let ranges = seen(&of);
        let found = position(&ranges, Vector3::zeros(), &BARE).unwrap();
        let at = || format!("systems {of:?}");
        worst_m.take((found.position_m - place).norm(), at);
        for (scale, clock_m) in &found.clocks {
            let system = scales.iter().position(|own| own == scale).unwrap();
            worst_m.take((clock_m - 1e3 * system as f64).abs(), at);
        }
        // A millimetre on any of them, against the largest dilution: no freedom is left to hide it.
        for faulty in 0..5 {
            let mut ranges = ranges.clone();
            ranges[faulty].pseudorange_m += 1e-3;
            let other = position(&ranges, place, &BARE).unwrap();
            let clocks: f64 = other.clocks.iter().zip(&found.clocks).map(|(a, b)| (a.1 - b.1).powi(2)).sum();
            let moved_m = ((other.position_m - found.position_m).norm_squared() + clocks).sqrt();
            let most = found.dilution.symmetric_eigenvalues().max().sqrt();
            moved.take(moved_m / (1e-3 * most), || format!("{}, range {}", at(), faulty + 1));
        }
    }
    // Coordinates of 2.7e7 m resolve 3.7e-9 m, ranges as much, times a dilution of some tens.
    the.at_most("two systems: position and clocks of exact ranges", worst_m, 1e-6, "m");
    // One, and that 1e-6 m in 1e-3 m.
    the.at_most("two systems: error by 1 mm over the largest dilution", moved, 1.001, "");
    // A satellite that is its system's only one says nothing but its clock.
    let four = position(&seen(&[0, 0, 0, 0]), place, &BARE).unwrap();
    let mut far = seen(&[0, 0, 0, 0, 1]);
    far[4].pseudorange_m += 1e6;
    let apart_m = (position(&far, place, &BARE).unwrap().position_m - four.position_m).norm();
    the.at_most(
        "a system's only satellite, 1000 km off: moves the position",
        (apart_m, "systems [0, 0, 0, 0, 1]"),
        1e-6,
        "m",
    );
    // 3 + 4 unknowns.
    let few = [&[0, 1, 2, 3, 0][..], &[0, 0, 1, 2, 3], &[0, 1, 2, 3, 0, 1]].into_iter().filter(|of| {
        let found = position(&seen(of), place, &BARE);
        matches!(found, Err(NoFix::TooFew { have, need: 7 }) if have == of.len())
    });
    the.all("four systems, five and six satellites: told that seven are needed", few.count(), 3);
    let seven = position(&seen(&[0, 0, 0, 0, 1, 2, 3]), place, &BARE).unwrap();
    the.at_most("four systems, seven satellites", ((seven.position_m - place).norm(), "4 + 1 + 1 + 1"), 1e-6, "m");
}

#[test]
fn of_two_signals_of_one_satellite_the_stronger_is_found() {
    let the = case(22, "one PRN twice", CA);
    // A direct ray and its echo two chips behind, 8 dB below it and 8 dB above; a spoofer 10 dB above the
    // truth.
    let front = "[front_end]\nsample_rate_hz = 4e6\nformat = \"ci16\"\n[noise]\n[power]\ncn0_dbhz = 45\n";
    let sv = Sv::gps(23);
    let found_m = |tables: &str| {
        let scene = run::only(run::scene(2.0, &format!("{front}{tables}")), &[sv]);
        let bytes = run::samples(&scene);
        let (i, q) = run::planes(&scene, &bytes);
        let block = Block { first: 0, i: &i, q: &q };
        let rows = acquire::search(&scene.metadata, &block, &[L1_CA.link(sv)], &Default::default()).unwrap();
        let hit = rows[0].1.expect("found");
        let (channel, report) = run::track(&scene, &bytes, &hit, &TrackingSettings::default(), 400_000);
        let last = report.measurements.last().unwrap();
        assert!(!channel.is_lost() && last.locked);
        let tracked_m = run::code_error_m(&scene, sv, last.sample, last.code_fraction);
        [run::code_error_m(&scene, sv, 0, hit.code_phase_chips / 1023.0), tracked_m]
    };
    // The search is right to a seventh of a chip. The loop's noise is 0.6 m at 45 dB-Hz and 0.5 Hz, 1 m where
    // pull-in ends, and the other ray is more than a chip and a half away: three sigma.
    let told = |name: &str, [found_m, tracked_m]: [f64; 2], theory_m: f64| {
        the.near(&format!("{name}: code found, off the true one"), (found_m, "G23"), theory_m, 40.0, "m");
        the.near(&format!("{name}: code tracked for 2 s"), (tracked_m, "G23"), theory_m, 3.0, "m");
    };
    let echo = |amplitude: f64| {
        format!("[[multipath]]\nkind = \"given\"\nexcess_m = 600\namplitude = {amplitude}\nphase_deg = 90\n")
    };
    told("echo 8 dB below", found_m(&echo(0.4)), 0.0);
    told("echo 8 dB above", found_m(&echo(2.5)), 600.0);
    // The spoofer's clock is 2 µs ahead: 600 m nearer.
    told("spoofer 10 dB above", found_m("[[spoofer]]\npower_db = 10\nclock_bias_s = 2e-6\n"), -599.6);
}

#[test]
fn a_position_is_as_good_as_its_condition_says_or_refused_with_it() {
    let the = case(58, "conditioning told", CA);
    let (mut refused, mut of) = (0, 0);
    let (mut least_refused, mut most_solved, mut worst) = (Worst::least(), Worst::default(), Worst::default());
    for step in 0..60 {
        // From a cone to a fair sky: satellite after satellite leaves the common elevation.
        let off_deg = libm::pow(10.0, -5.0 + 0.1 * f64::from(step));
        let at = || format!("{off_deg:.1e}° off the cone");
        let sky: Vec<(f64, f64)> =
            (0..6).map(|k| (60.0 * f64::from(k), 45.0 - off_deg.min(40.0) * f64::from(k % 3) / 2.0)).collect();
        let mut seen = ranges(&sky);
        let place = Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef();
        // A millimetre on one range.
        seen[1].pseudorange_m += 1e-3;
        of += 1;
        match position(&seen, place, &BARE) {
            Err(NoFix::Singular { condition }) => {
                refused += 1;
                least_refused.take(condition, at);
            }
            Err(other) => panic!("{other}"),
            Ok(solution) => {
                let values = solution.dilution.symmetric_eigenvalues();
                most_solved.take((values.max() / values.min()).sqrt(), at);
                // A range moves the solution by no more than the dilution's square root, its largest singular
                // value.
                let moved_m = ((solution.position_m - place).norm_squared() + solution.clock_m().powi(2)).sqrt();
                worst.take(moved_m / (1e-3 * values.max().sqrt()), at);
            }
        }
    }
    assert!(refused > 5 && refused < of - 5, "{refused} of {of}");
    the.at_least("condition of those refused", least_refused, 1e4, "");
    the.at_most("condition of those solved", most_solved, 1e4, "");
    // One, and the 1e-7 m of the reference in 1e-3 m.
    the.at_most("error by 1 mm over the largest dilution", worst, 1.001, "");
    // Loops near their limit tell what is left of it, and knots what they leave of the scene's tolerance.
    let near = TrackingSettings { integration: 20, pll_bandwidth_hz: 18.0, ..Default::default() };
    near.validate(1e-3).unwrap();
    let pll = near.margins(1e-3)[0];
    the.near("18 Hz and 20 ms: bandwidth times update time told", (pll.bandwidth_time, "the PLL"), 0.36, 1e-12, "");
    the.near("18 Hz and 20 ms: share of the limit told to be left", (pll.margin_share, "the PLL"), 0.1, 1e-9, "");
    let scene = run::scene(1.0, "[front_end]\nsample_rate_hz = 2.6e6\n[power]\n");
    let directory = tempfile::tempdir().unwrap();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let made =
        generate_part(&scene, 0..100_000, &mut std::io::sink(), &mut writer, &mut |_| (), &Options::default()).unwrap();
    let left = 100.0 * (1.0 - made.worst_knot_cycles / made.knot_tolerance_cycles);
    let told = made.to_string().contains(&format!("{left:.0} % below what the scene allows, 1e-4"));
    the.all("knots' error told with the scene's tolerance", usize::from(told && (0.0..100.0).contains(&left)), 1);
}
