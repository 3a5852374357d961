//! Front ends as a list: what each needs, what it cannot have, and what it becomes.

use super::*;

const WIDE: &str = "[[front_end]]\nname = \"wide\"\ncenter_hz = 1575.42e6\nsample_rate_hz = 10e6\n";
const NARROW: &str = "[[front_end]]\nname = \"narrow\"\ncenter_hz = 1575.9e6\nsample_rate_hz = 4e6\n";

fn of(tables: &str) -> Result<Scenario, String> {
    parse(&format!("{MINIMAL}{STATIC}{tables}")).map_err(|e| e.to_string())
}

fn composed(tables: &str) -> Result<(Vec<crate::scene::Scene>, Vec<String>), String> {
    of(tables)?.compose_all(Path::new("scenarios"), &Overrides::default()).map_err(|e| e.to_string())
}

#[test]
fn one_table_of_a_list_is_the_table_by_itself() {
    let keys = "sample_rate_hz = 4e6\nif_hz = 1e5\n[front_end.filter]\nkind = \"brick_wall\"\nbandwidth_hz = 2e6\n";
    assert_eq!(of(&format!("[[front_end]]\n{keys}")), of(&format!("[front_end]\n{keys}")));
    // Stages at the top are those of the one front end.
    let top = keys.replace("front_end.", "");
    assert_eq!(of(&format!("[front_end]\n{top}")), of(&format!("[front_end]\n{keys}")));
}

#[test]
fn every_front_end_of_a_list_becomes_the_scene_that_it_is_alone() {
    let filter = "[front_end.filter]\nkind = \"brick_wall\"\nbandwidth_hz = 2.4e6\n";
    let both = of(&format!("{WIDE}{NARROW}{filter}[noise]\n")).unwrap();
    assert_eq!(both.front_end_names(), ["wide", "narrow"]);
    let (scenes, _) = both.compose_all(Path::new("scenarios"), &Overrides::default()).unwrap();
    let facts = |number: usize| {
        let scene: &crate::scene::Scene = &scenes[number];
        (scene.metadata.center_hz, scene.clock.rate.hz(), scene.samples, scene.front_end.len())
    };
    assert_eq!((facts(0), facts(1)), ((1575.42e6, 10e6, 100_000_000, 0), (1575.9e6, 4e6, 40_000_000, 1)));
    assert!(std::sync::Arc::ptr_eq(&scenes[0].catalogue, &scenes[1].catalogue));
    for (number, name) in ["wide", "narrow"].into_iter().enumerate() {
        let (alone, _) =
            both.with_front_end(name).unwrap().compose(Path::new("scenarios"), &Overrides::default()).unwrap();
        assert_eq!((&alone.metadata, alone.noise_seed()), (&scenes[number].metadata, scenes[number].noise_seed()));
        assert_eq!((alone.samples, alone.nodes), (scenes[number].samples, scenes[number].nodes));
    }
    assert_ne!(scenes[0].noise_seed(), scenes[1].noise_seed());
    let error = both.compose(Path::new("scenarios"), &Overrides::default()).err().unwrap().to_string();
    assert!(error.contains("front_end: there are 2, wide, narrow: expected one"), "{error}");
    let error = both.with_front_end("broad").unwrap_err().to_string();
    assert!(error.contains("front_end.name") && error.contains("\"broad\": wide, narrow"), "{error}");
}

#[test]
fn what_several_front_ends_cannot_have_is_refused_with_the_cure() {
    let playback = "[playback]\nbits = 8\n";
    let adc = "[adc]\nbits = 2\n";
    let many: String = (0..17).map(|k| WIDE.replace("wide", &format!("f{k}"))).collect();
    for (tables, words) in [
        ("front_end = []\n".to_owned(), ["front_end = []", "at least one"]),
        (WIDE.replace("name = \"wide\"\n", "") + NARROW, ["front_end[1].name = absent", "several front ends"]),
        (WIDE.replace("wide", "a/b"), ["front_end[1].name = \"a/b\"", "it names files"]),
        (format!("{WIDE}{}", NARROW.replace("narrow", "Wide")), ["front_end[2].name = \"Wide\"", "no other front end"]),
        (WIDE.replace("center_hz = 1575.42e6\n", "") + NARROW, ["front_end[1].center_hz = absent", "radio frequency"]),
        (format!("{WIDE}if_hz = 0\n"), ["front_end[1].if_hz = 0", "nothing beside center_hz"]),
        (format!("{WIDE}{NARROW}{adc}"), ["adc = ", "[front_end.adc] below the [[front_end]]"]),
        (format!("{WIDE}{NARROW}{playback}"), ["playback = ", "one front end"]),
        (format!("{WIDE}{}{adc}", adc.replace("adc", "front_end.adc")), ["adc = ", "nothing beside [front_end.adc]"]),
        (format!("{WIDE}signals = [\"GPS L9\"]\n"), ["front_end[1].signals", "GPS L1 C/A"]),
        (many, ["front_end = ", "at most 16 front ends, not 17"]),
        ("front_end = 3\n".to_owned(), ["front_end = 3", "a table, or an array of tables"]),
    ] {
        // A key at the top comes before all tables.
        let (top, below) = if tables.starts_with('[') { ("", tables.as_str()) } else { (tables.as_str(), "") };
        let error = parse(&format!("{MINIMAL}{top}{STATIC}{below}")).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)) && error.starts_with("scene.toml:"), "{tables}: {error}");
    }
}

#[test]
fn a_band_without_its_signals_is_refused_by_the_front_ends_name() {
    let far = WIDE.replace("1575.42e6", "1176.45e6");
    let error = composed(&format!("{far}{NARROW}")).err().unwrap();
    assert!(error.contains("front_end.center_hz") && error.contains("front end wide: 1176450000 Hz"), "{error}");
    let error = composed(&format!("{far}signals = [\"GPS L1 C/A\"]\n{NARROW}")).err().unwrap();
    assert!(error.contains("front_end.signals: front end wide: GPS L1 C/A"), "{error}");
    // Real samples: 2 MHz above 0, in the first zone; at 0 Hz the band would lie over itself.
    let real = |center_hz: &str| {
        let own = NARROW.replace("1575.9e6", center_hz).replace("4e6", "9e6");
        composed(&format!("{WIDE}{own}format = \"ri8\"\n"))
    };
    assert_eq!(real("1573.42e6").unwrap().0[1].signals, real("1573.42e6").unwrap().0[0].signals);
    let error = real("1575.42e6").err().unwrap();
    assert!(error.contains("front end narrow") && error.contains("is real"), "{error}");
}

#[test]
fn warnings_say_whose_they_are() {
    let narrow = NARROW.replace("4e6", "2.6e6");
    let warned = composed(&format!("{WIDE}{narrow}")).unwrap().1;
    assert!(warned.iter().any(|w| w.starts_with("front end narrow: ") && w.contains("fold over")), "{warned:?}");
    assert!(!warned.iter().any(|w| w.starts_with("front end wide: ")), "{warned:?}");
    let source = "[[interference]]\nkind = \"cw\"\njs_db = 10\noffset_hz = 3e6\n[power]\ncn0_dbhz = 45\n";
    // One front end receives it: nothing is left out.
    let (scenes, warned) = composed(&format!("{WIDE}{narrow}{source}")).unwrap();
    assert_eq!((scenes[0].interference.len(), scenes[1].interference.len()), (1, 0));
    assert!(!warned.iter().any(|w| w.contains("outside")), "{warned:?}");
    let (_, warned) = composed(&format!("{WIDE}{narrow}{}", source.replace("3e6", "30e6"))).unwrap();
    assert_eq!(warned.iter().filter(|w| w.contains("number 1 (cw) lies outside")).count(), 1, "{warned:?}");
}

#[test]
fn a_front_end_puts_l1_where_the_scenario_says() {
    for (inverted, center_hz) in [(false, 1_574.42e6), (true, 1_576.42e6)] {
        let text = replaced(&full(), "front_end", "spectrum_inverted", &inverted.to_string());
        let text = text.replace("[navigation]\nfile = \"brdc.10n\"\ngalileo_ahead_ns = 3\n", "");
        let text = text.replace("antenna = \"table\"\nantenna_file = \"gain.csv\"\n", "antenna = \"patch\"\n");
        let (before, city) = text.split_once("[city]").unwrap();
        let text = format!("{before}[filter]{}", city.split_once("[filter]").unwrap().1);
        let (scene, warnings) = parse(&text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap();
        assert_eq!(scene.metadata.center_hz, center_hz);
        assert_eq!(scene.metadata.if_hz(scene.signals[0].centre_hz()), 1e6);
        // 1 MHz less 1.023 MHz is below zero in a real signal.
        assert!(warnings.iter().any(|w| w.contains("fold")), "{warnings:?}");
        assert_eq!((scene.samples, scene.noise_lsb), (40_000_000, 3.0));
    }
}

#[test]
fn a_signal_outside_the_band_is_refused_where_it_is_the_only_one() {
    let place = |if_hz: f64, format: Format| {
        let mut scenario = parse(&format!("{MINIMAL}{STATIC}[front_end]\nsample_rate_hz = 2.6e6\n")).unwrap();
        // No text comes here: the parser keeps the IF of the one signal that there is below half the rate.
        let front_end = &mut scenario.front_ends[0];
        (front_end.tuned, front_end.format) = (Tuned::If { if_hz }, format);
        let (_, warnings) = scenario.compose(Path::new("."), &Overrides::default()).map_err(|e| e.to_string())?;
        Ok::<_, String>(warnings)
    };
    // The band ends at 1.3 MHz and half the main lobe is 1.023 MHz wide.
    for if_hz in [2.33e6, -2.33e6, 9e6] {
        let error = place(if_hz, Format::Ci8).unwrap_err();
        assert!(error.contains("front_end.if_hz") && error.contains("-1.300 to 1.300 MHz"), "{error}");
    }
    for if_hz in [2.31e6, -2.31e6] {
        assert!(place(if_hz, Format::Ci8).unwrap().iter().any(|w| w.contains("fold over")));
    }
    // Real samples of an IF beyond half the rate: bandpass sampling.
    assert!(place(9e6, Format::Ri8).is_ok());
}

#[test]
fn noise_and_strong_signals_decide_how_good_balanced_edges_are() {
    let edge = |tables: &str| {
        let scenario = parse(&format!("{MINIMAL}{STATIC}{tables}")).unwrap();
        scenario.front_ends[0].fidelity.suited(2.6e6, &[&L1_CA]).unwrap().code_edge
    };
    assert_eq!(edge("[noise]\n"), CodeEdge::Area);
    assert_eq!(edge("[power]\ncn0_dbhz = 80\n"), CodeEdge::Area);
    assert_eq!(edge("[noise]\n[power]\ncn0_dbhz = 80\n"), CodeEdge::BandLimited);
    assert_eq!(edge("[noise]\n[power]\ncn0_dbhz = 45\n[power.satellites]\nG13 = 80\n"), CodeEdge::BandLimited);
}

#[test]
fn a_budget_that_a_front_end_cannot_keep_is_refused_with_the_least() {
    let refused = composed(&format!("{WIDE}{NARROW}[noise]\n[fidelity]\nbudget = {{ code_m = 1e-6 }}\n"));
    let error = refused.map(|_| ()).unwrap_err();
    assert!(error.contains("fidelity.budget") && error.contains("front end wide"), "{error}");
    assert!(
        error.contains("code_m = 0.000001 cannot be promised: at least") && error.contains("10.000 Msps"),
        "{error}"
    );
}

#[test]
fn overrides_replace_what_the_scenario_says_and_are_checked_like_it() {
    let scenario = parse(&format!("{MINIMAL}{STATIC}")).unwrap();
    let compose = |overrides: Overrides| scenario.compose(Path::new("."), &overrides);
    let (scene, _) = compose(Overrides { seed: Some(9), format: Some(Format::Cf32Le), allow_outside: false }).unwrap();
    assert_eq!((scene.seed, scene.metadata.format, scene.noise_lsb), (9, Format::Cf32Le, 1.0));
    let error = compose(Overrides { format: Some(Format::Ri8), ..Overrides::default() }).err().unwrap().to_string();
    assert!(error.contains("front_end.if_hz: 0 Hz with the real format ri8"), "{error}");
}
