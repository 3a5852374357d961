//! Stations of a scenario: what each has, what is refused, and the text of one alone.

use super::*;

const SCENE: &str = "name = \"pair\"\nstart = 2010-07-01T10:00:00\nduration_s = 1\nseed = 5\n\
    [receiver_clock]\nbias_s = 1e-5\n[power]\nkind = \"link_budget\"\nloss_db = 1\nnoise_figure_db = 2\n[noise]\n";
const BASE: &str = "[[station]]\nname = \"base\"\n[station.motion]\nkind = \"static\"\nlatitude_deg = 26.5\n\
    longitude_deg = 80.2\nheight_m = 130\n";
const ROVER: &str = "[[station]]\nname = \"rover\"\n[station.motion]\nkind = \"static\"\nlatitude_deg = 26.505\n\
    longitude_deg = 80.2\nheight_m = 131\n[station.receiver_clock]\nbias_s = -2e-5\n[station.power]\n\
    noise_figure_db = 4\n";

fn pair() -> String {
    format!("{SCENE}{BASE}{ROVER}")
}

fn refused(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

#[test]
fn a_station_has_its_own_tables_and_else_those_of_the_scene() {
    let whole = parse(&pair()).unwrap();
    assert_eq!(whole.station_names(), ["base", "rover"]);
    let [base, rover] = whole.each_station() else { panic!("{:?}", whole.stations) };
    assert_eq!(base.receiver_clock, ClockSpec { bias_s: 1e-5, ..ClockSpec::default() });
    assert_eq!(rover.receiver_clock, ClockSpec { bias_s: -2e-5, ..ClockSpec::default() });
    assert_ne!(base.motion, rover.motion);
    // Of power the station has a key of its own, and the others of the scene.
    let of = |scenario: &Scenario| match scenario.power {
        Power::LinkBudget { noise_figure_db, loss_db, .. } => (noise_figure_db, loss_db),
        Power::Fixed { .. } => (0.0, 0.0),
    };
    assert_eq!((of(base), of(rover)), ((2.0, 1.0), (4.0, 1.0)));
    assert_eq!((base.seed, rover.seed, base.noise), (5, 5, true));
}

#[test]
fn the_text_of_one_station_is_its_scenario_among_several() {
    let whole = parse(&pair()).unwrap();
    for name in ["base", "rover"] {
        let alone = parse(&text_of_station(&pair(), name).unwrap()).unwrap();
        assert_eq!(alone, whole.with_station(name).unwrap(), "{name}");
        // Its own text is that of the text of one.
        assert_eq!(alone.each_station(), std::slice::from_ref(&alone));
    }
    assert!(text_of_station(&pair(), "third").is_none() && text_of_station(SCENE, "base").is_none());
}

#[test]
fn several_stations_are_not_composed_as_one_scene() {
    let whole = parse(&pair()).unwrap();
    let error = whole.compose_all(Path::new("."), &Overrides::default()).err().unwrap().to_string();
    assert!(error.contains("station: there are 2, base, rover: expected one here"), "{error}");
    let error = whole.with_station("bse").unwrap_err().to_string();
    assert!(error.contains("none is called \"bse\": base, rover"), "{error}");
}

#[test]
fn what_stations_cannot_have_is_refused_at_its_place() {
    let place = "[motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n";
    for (text, part) in [
        (pair().replace("\"rover\"", "\"Base\""), "station[2].name = \"Base\": expected a name that no other station"),
        (pair().replace("\"rover\"", "\"the rover\""), "expected 1 to 32 letters"),
        (pair().replace("name = \"rover\"\n", ""), "station[2].name = absent"),
        (format!("{SCENE}[[station]]\nname = \"base\"\n"), "motion = absent: expected [station.motion]"),
        (format!("{SCENE}{place}{BASE}{ROVER}"), "because every [[station]] has its own motion"),
        (format!("{}[[spoofer]]\npower_db = 3\n", pair()), "expected nothing beside [[station]]: it has no position"),
        (format!("{}[sbas]\n", pair()), "its network lies around one antenna"),
        (pair().replace("noise_figure_db = 4", "transmit_dbw = 4"), "unknown key 'station[2].power.transmit_dbw'"),
        (pair().replace("height_m = 131", "height_m = 1e9"), "height_m = 1e9: expected a number"),
        (format!("station = []\n{SCENE}"), "expected"),
    ] {
        let error = refused(&text);
        assert!(error.contains(part), "{part}: {error}");
    }
    let nine: String = (1..=9).map(|n| BASE.replace("base", &format!("s{n}"))).collect();
    assert!(refused(&format!("{SCENE}{nine}")).contains("expected 1 to 8 stations, not 9"));
    // The scene's motion is that of a station without one.
    let shared = parse(&format!("{SCENE}{place}[[station]]\nname = \"base\"\n{ROVER}")).unwrap();
    assert_eq!(shared.each_station()[0].motion, parse(&pair()).unwrap().each_station()[0].motion);
}

#[test]
fn an_emitter_without_a_position_or_a_power_of_its_own_is_refused() {
    let composed = |source: &str| {
        let scenario = parse(&format!("{}[[interference]]\nkind = \"cw\"\n{source}", pair())).unwrap();
        let rover = scenario.with_station("rover").unwrap();
        rover.compose_all(Path::new("."), &Overrides::default()).map(|_| ()).map_err(|e| e.to_string())
    };
    let place = "latitude_deg = 26.51\nlongitude_deg = 80.2\nheight_m = 140\n";
    let error = composed("js_db = 20\n").unwrap_err();
    assert!(error.starts_with("scene.toml, station rover: interference: number 1 (cw): stations hear it"), "{error}");
    let error = composed(&format!("js_db = 20\n{place}")).unwrap_err();
    assert!(error.contains("js_db is the power at one antenna: write eirp_dbw"), "{error}");
    composed(&format!("eirp_dbw = -20\n{place}")).unwrap();
}
