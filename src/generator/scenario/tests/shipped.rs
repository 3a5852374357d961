//! The scenarios that come with the program.

use super::*;

/// The scenarios that come with the program.
const SHIPPED: [(&str, &str); 17] = [
    ("static", include_str!("../../../../scenarios/static.toml")),
    ("moderate", include_str!("../../../../scenarios/moderate.toml")),
    ("high_dynamics", include_str!("../../../../scenarios/high_dynamics.toml")),
    ("noise_free", include_str!("../../../../scenarios/noise_free.toml")),
    ("trajectory_file", include_str!("../../../../scenarios/trajectory_file.toml")),
    ("ionex", include_str!("../../../../scenarios/ionex.toml")),
    ("canyon", include_str!("../../../../scenarios/canyon.toml")),
    ("city", include_str!("../../../../scenarios/city.toml")),
    ("urban", include_str!("../../../../scenarios/urban.toml")),
    ("spinning", include_str!("../../../../scenarios/spinning.toml")),
    ("oscillator", include_str!("../../../../scenarios/oscillator.toml")),
    ("scintillation", include_str!("../../../../scenarios/scintillation.toml")),
    ("front_end", include_str!("../../../../scenarios/front_end.toml")),
    ("jammed", include_str!("../../../../scenarios/jammed.toml")),
    ("spoofed", include_str!("../../../../scenarios/spoofed.toml")),
    ("precise", include_str!("../../../../scenarios/precise.toml")),
    ("satellite_faults", include_str!("../../../../scenarios/satellite_faults.toml")),
];

fn shipped(name: &str) -> crate::scene::Scene {
    let (_, text) = SHIPPED.iter().find(|(n, _)| *n == name).unwrap();
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let (scene, warnings) = Scenario::parse(text, name).unwrap().compose(&directory, &Overrides::default()).unwrap();
    // The one rogue record of that day, and the satellites that say themselves that they are unhealthy.
    assert!(warnings.len() <= 2 && warnings.iter().all(|w| w.contains("left out")), "{name}: {warnings:?}");
    scene
}

#[test]
fn shipped_scenarios_begin_two_seconds_before_a_frame_with_the_ionosphere_s_page() {
    for (name, text) in SHIPPED {
        let scenario = Scenario::parse(text, name).unwrap();
        assert_eq!(scenario.name, name);
        let frame = scenario.start.tow_whole_s() + 2;
        // IS-GPS-200N, 20.3.3.5.1.1 and table 20-V: page 18 of subframe 4, frames counted from the week's
        // start.
        assert_eq!((frame % 30, frame / 30 % 25 + 1), (0, 18), "{name}");
    }
}

#[test]
fn the_shipped_motions_do_what_their_comments_say() {
    let g = 9.806_65;
    let moderate = shipped("moderate").trajectory;
    let extremes = moderate.extremes(90.0);
    assert!(
        (29.0..=30.1).contains(&extremes.speed_mps) && (3.9..4.1).contains(&extremes.acceleration_mps2),
        "{extremes:?}"
    );
    assert!(moderate.at(5.0).velocity_mps.norm() > 8.0);
    let rocket = shipped("high_dynamics").trajectory;
    let extremes = rocket.extremes(110.0);
    assert!(extremes.acceleration_mps2 > 20.0 * g && extremes.speed_mps > 700.0, "{extremes:?}");
    let height_m = |t_s| gnss::earth::Geodetic::from_ecef(&rocket.at(t_s).position_m).height_m;
    assert!(height_m(40.0) < 130.001 && height_m(110.0) > 10_000.0);
    let ride = shipped("trajectory_file").trajectory.extremes(60.0);
    assert!(ride.speed_mps < 4.0 && ride.acceleration_mps2 < 1.0, "{ride:?}");
}

#[test]
fn the_boost_changes_some_satellite_s_doppler_by_about_a_thousand_hertz_a_second() {
    let scene = shipped("high_dynamics");
    let d = 0.01;
    let mut fastest = 0.0_f64;
    for sv in scene.catalogue.satellites() {
        for k in 0..50 {
            let t_s = 40.0 + f64::from(k) * 0.1;
            let range = |t_s: f64| {
                let at = scene.clock.start.plus_s(t_s);
                let found = crate::sky::emission(&scene.catalogue, sv, at, &scene.trajectory.at(t_s));
                found.unwrap().map_or(f64::NAN, |e| e.sight.range_m)
            };
            let bend = (range(t_s + d) - 2.0 * range(t_s) + range(t_s - d)) / (d * d);
            fastest = fastest.max((bend / gnss::gps::l1ca::L1_CA.wavelength_m(Sv::gps(1))).abs());
        }
    }
    assert!((950.0..1150.0).contains(&fastest), "{fastest}");
}

#[test]
fn the_static_scene_sends_its_ionosphere_within_thirty_seconds() {
    use gnss::gps::lnav::{self, Subframe};
    let scene = shipped("static");
    let first_bit = scene.clock.start.plus_s(20.0);
    let ephemeris = scene.catalogue.sent_at(Sv::gps(13), first_bit).unwrap();
    let symbols = scene.messages.of(&lnav::LNAV).unwrap().unit(ephemeris, first_bit).unwrap();
    let subframe = Subframe::decode(&lnav::words(&symbols), 0).unwrap();
    let sent = subframe.klobuchar().unwrap();
    let file = gnss::rinex::embedded().unwrap().klobuchar.unwrap();
    for (sent, file) in sent.alpha.iter().zip(file.alpha) {
        // RINEX 2 prints five significant digits; half a step of the finest field is 2^-31 (IS-GPS-200N,
        // table 20-X).
        assert!((sent - file).abs() <= 4.7e-10, "{sent} {file}");
    }
    // GPS time against UTC as the file's header has it, to half a step of its fields (IS-GPS-200N, table
    // 20-IX).
    let utc = subframe.utc().unwrap();
    assert!((utc.a0_s - -0.838190317154e-8).abs() <= libm::exp2(-31.0), "{utc:?}");
    assert!((utc.a1_sps - -0.213162820728e-13).abs() <= libm::exp2(-51.0), "{utc:?}");
    assert_eq!((utc.tot_s, utc.week, utc.leap_s, utc.leap_after_s), (503_808.0, (566 % 256) as u8, 15, 15));
}
