//! Interference and spoofers as written.

use std::path::Path;

use super::super::interference::{Kind, Strength};
use super::*;

#[test]
fn interference_and_spoofers_arrive_as_written() {
    let scenario = parse(&(full() + HOSTILE)).unwrap();
    let kinds: Vec<&str> = scenario.interference.iter().map(|spec| spec.kind.name()).collect();
    assert_eq!(kinds, ["chirp", "sine_fm", "pulse", "noise", "recording", "cw"]);
    assert_eq!(scenario.interference[5].strength, Strength::Radiated { dbw: -20.0, distance_m: Some(500.0) });
    let chirp = &scenario.interference[0];
    assert_eq!(chirp.kind, Kind::Chirp { sweep_hz: -2e6, sweep_s: 1e-5 });
    assert_eq!((chirp.strength, chirp.on_s, chirp.off_s), (Strength::OverSignal { db: 30.0 }, 1.0, Some(2.0)));
    assert_eq!([0, 1].map(|n: usize| scenario.interference[n].center_hz), [1_575.52e6, 1_575.9e6]);
    assert!(scenario.interference[2].place.is_some() && scenario.interference[0].place.is_none());
    let spoofer = &scenario.spoofers[0];
    assert_eq!((spoofer.advantage.start_db, spoofer.advantage.end_db, spoofer.advantage.ramp_s), (-10.0, 6.0, 5.0));
    assert!(spoofer.motion.is_none() && spoofer.drag.is_some_and(|drag| drag.speed_mps == 5.0));
}

#[test]
fn interference_that_contradicts_itself_is_refused_with_its_remedy() {
    let refused = |text: &str| match parse(&format!("{MINIMAL}{STATIC}{text}")) {
        Err(error) => error.to_string(),
        Ok(scenario) => scenario.compose(Path::new("."), &Overrides::default()).err().unwrap().to_string(),
    };
    let fixed = "[power]\ncn0_dbhz = 45\n";
    let cw = |lines: &str| format!("[[interference]]\nkind = \"cw\"\n{lines}\n");
    assert!(refused(&cw("")).contains("exactly one of"));
    let both = refused(&cw("js_db = 3\npower_dbw = -130"));
    assert!(both.contains("interference[1].power_dbw = -130") && both.contains("js_db is given"), "{both}");
    let twice = refused(&cw("js_db = 3\ncenter_hz = 1.57e9\noffset_hz = 0"));
    assert!(twice.contains("interference[1].offset_hz = 0: expected nothing beside center_hz"), "{twice}");
    let far = "eirp_dbw = 3\ndistance_m = 100\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 1130";
    assert!(
        refused(&cw(far)).contains("interference[1].distance_m = 100: expected nothing, because a position is given")
    );
    assert!(refused(&cw("power_dbw = -130\ndistance_m = 100")).contains("expected nothing with power_dbw"));
    let empty = refused(&format!("[satellites]\nmask_deg = 89\n{}", cw("js_db = 3")));
    assert!(empty.contains("number 1 (cw)") && empty.contains("there is none"), "{empty}");
    let radiated = refused(&(fixed.to_owned() + &cw("eirp_dbw = 3\ndistance_m = 100")));
    assert!(radiated.contains("eirp_dbw is in dBW"), "{radiated}");
    assert!(refused(&cw("eirp_dbw = 3")).contains("a position with it"));
    assert!(refused(&(fixed.to_owned() + &cw("power_dbw = -120"))).contains("write js_db instead"));
    assert!(refused(&cw("js_db = 3\non_s = 5\noff_s = 4")).contains("off_s"));
    assert!(refused(&cw("js_db = 3\nsweep_hz = 5")).contains("unknown key 'interference[1].sweep_hz'"));
    let pulse = |lines: &str| format!("{fixed}[[interference]]\nkind = \"pulse\"\njs_db = 3\n{lines}\n");
    assert!(refused(&pulse("width_s = 1e-3\nrate_hz = 900\njitter = 0.2")).contains("the period less the jitter"));
    assert!(refused(&pulse("width_s = 1e-7\nrate_hz = 900")).contains("two samples"));
    assert!(refused("[[spoofer]]\npower_db = 3\nramp_s = 3\n").contains("both or none"));
    let lost = "[[spoofer]]\npower_db = 3\n[spoofer.motion]\nkind = \"rocket\"\n";
    assert!(refused(lost).contains("spoofer[1].motion"));
}

#[test]
fn power_at_the_antenna_and_radiated_power_agree_through_free_space() {
    let of = |lines: &str| {
        let text = format!("{MINIMAL}{STATIC}[[interference]]\nkind = \"cw\"\n{lines}\n");
        let (scene, _) = parse(&text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap();
        10.0 * libm::log10(scene.interference[0].jn0_hz)
    };
    // N0 of the default budget: −204 + 2.5 dBW/Hz, and 2 dB of losses.
    assert!((of("power_dbw = -130") - 69.5).abs() < 1e-9);
    // 1 km straight up, 1575.42 MHz: 20 lg(4π · 1000 / 0.190294) = 96.396 dB.
    let radiated = of("eirp_dbw = -30\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 1130");
    assert!((radiated - (-30.0 - 96.396 + 204.0 - 4.5)).abs() < 1e-3, "{radiated}");
    assert!((of("eirp_dbw = -30\ndistance_m = 1000") - radiated).abs() < 1e-3);
}

#[test]
fn behind_a_link_budget_js_counts_from_the_strongest_satellite_at_the_start() {
    let compose = |lines: &str| {
        let text = format!("{MINIMAL}{STATIC}[[interference]]\nkind = \"cw\"\n{lines}\n");
        parse(&text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap().0
    };
    let scene = compose("js_db = 20\non_s = 4");
    // The same satellites by the truth's own path, which knows nothing of interference.
    let mut found: Vec<(f64, Sv)> = Vec::new();
    for sv in scene.catalogue.satellites() {
        let local = scene.clock.start;
        if crate::truth::in_view(&scene, sv, local).unwrap() {
            let seen = crate::truth::seen(&scene, sv, scene.signals[0], local).unwrap().unwrap();
            found.push((10.0 * libm::log10(seen.rays[0].cn0_hz), sv));
        }
    }
    let most = found.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    assert!(found.len() > 5 && (45.0..53.0).contains(&most.0), "{found:?}");
    let jn0_dbhz = 10.0 * libm::log10(scene.interference[0].jn0_hz);
    assert!((jn0_dbhz - most.0 - 20.0).abs() < 1e-9, "{jn0_dbhz} {most:?}");
    let levels = crate::levels::Levels::new(&scene).unwrap();
    assert!(levels.strongest.is_some_and(|(sv, cn0)| sv == most.1 && (cn0 - most.0).abs() < 1e-9));
    assert!(levels.to_string().contains(&format!("J/S 20.0 dB over {}", most.1)), "{levels}");
}
