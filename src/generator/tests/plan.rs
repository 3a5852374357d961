//! The plans of the shipped scenes.

use std::fs;
use std::path::{Path, PathBuf};

use crate::levels::Levels;
use crate::plan::*;
use crate::scenario::{Overrides, Scenario};
use gnss::record::PassEnd;
use gnss::satellite::Sv;

fn plan(text: &str) -> Plan {
    let scenario = Scenario::parse(text, "plan").unwrap();
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let (scene, _) = scenario.compose(&directory, &Overrides::default()).unwrap();
    let machinery = Machinery {
        knot_spacing_s: 0.5,
        longest_knot_spacing_s: 0.5,
        knot_reason: "a test".to_owned(),
        block_bytes: 1 << 20,
        knots_s: 0.5,
        truth_s: 0.25,
    };
    Plan::new(&scene, machinery, Levels::new(&scene).unwrap()).unwrap()
}

#[test]
fn the_static_scene_has_the_satellites_that_its_comment_promises() {
    let plan = plan(include_str!("../../../scenarios/static.toml"));
    let names: Vec<String> = plan.satellites.iter().map(|s| s.sv.to_string()).collect();
    // Found independently from the same file by a short script.
    let expected = ["G23", "G13", "G03", "G19", "G06", "G07", "G20", "G16", "G32", "G10", "G08", "G28"];
    assert_eq!(names.len(), expected.len(), "{plan}");
    assert!(expected.iter().all(|sv| names.iter().any(|n| n == sv)), "{plan}");
    let (highest, lowest) = (&plan.satellites[0], &plan.satellites[11]);
    assert!((highest.elevation_deg - 82.0).abs() < 0.6 && highest.sv == Sv::gps(23), "{plan}");
    assert!((6.5..7.5).contains(&lowest.elevation_deg), "{plan}");
    assert!(plan.satellites.iter().all(|s| s.appears.is_none() && s.leaves.is_none()), "{plan}");
    assert_eq!((plan.samples, plan.bytes), (156_000_000, 312_000_000));
    // What was measured, for all samples, knots and rows: of one signal of twelve satellites.
    let expected_s = 156e6 * 1e-9 * plan.sample_ns + plan.machinery.knots_s + plan.machinery.truth_s;
    assert!((plan.time_s / expected_s - 1.0).abs() < 1e-9 && plan.sample_ns > 0.0 && plan.speed_mps == 0.0);
    assert!((plan.sample_ns / plan.signal_sample_ns / 12.0 - 1.0).abs() < 1e-9);
    // The link budget's reach from 5 degrees to the zenith.
    assert!(plan.satellites.iter().all(|s| s.cn0_dbhz.is_some_and(|x| (37.0..52.0).contains(&x))), "{plan}");
}

#[test]
fn a_satellite_without_a_signal_of_the_scene_is_no_satellite_of_the_plan() {
    // No satellite of 2010 sends L1C.
    let bare = include_str!("../../../scenarios/static.toml");
    let text = bare.replacen("[motion]", "signals = [\"GPS L1C\"]\n[motion]", 1);
    let (civil, whole) = (plan(&text), plan(bare));
    assert!(civil.satellites.is_empty() && whole.silent.is_empty(), "{civil}");
    let mut in_view: Vec<Sv> = whole.satellites.iter().map(|satellite| satellite.sv).collect();
    in_view.sort();
    assert_eq!(civil.silent, in_view);
    let scenario = Scenario::parse(&text, "plan").unwrap();
    let (scene, warnings) = scenario.compose(Path::new("."), &Overrides::default()).unwrap();
    assert!(crate::dynamics::lines_of_sight(&scene).unwrap().is_empty());
    assert!(warnings.iter().any(|warning| warning.starts_with("0 satellites that send")), "{warnings:?}");
}

#[test]
fn every_figure_of_the_plan_of_a_shipped_scene_is_a_number_or_said_to_be_unknown() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let files =
        |folder: &Path| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect::<Vec<PathBuf>>();
    let all = [files(&root), files(&root.join("extremes"))].concat();
    let is_scene = |path: &&PathBuf| {
        path.extension().is_some_and(|end| end == "toml") && fs::read_to_string(path).unwrap().contains("motion]")
    };
    let scenes: Vec<&PathBuf> = all.iter().filter(is_scene).collect();
    assert!(scenes.len() > 40, "{scenes:?}");
    for path in scenes {
        let mut scenes = Vec::new();
        for mut scenario in Scenario::open(path).unwrap().each_station().to_vec() {
            scenario.duration_s = scenario.duration_s.min(0.1);
            scenes.extend(scenario.compose_all(path.parent().unwrap(), &Overrides::default()).unwrap().0);
        }
        for scene in scenes {
            let text = Plan::of(&scene).unwrap().to_string();
            let odd = text.split(|c: char| !c.is_alphanumeric()).find(|word| ["NaN", "inf"].contains(word));
            assert!(odd.is_none() && !text.contains("\n1 satellites"), "{}: {text}", path.display());
            let signal = scene.signals.iter().any(|signal| signal.name == "own L1 BOC");
            assert_eq!(text.contains("unknown: not measured"), signal, "{text}");
        }
    }
}

#[test]
fn what_is_absent_is_named_with_the_table_that_would_bring_it() {
    let text = plan(include_str!("../../../scenarios/noise_free.toml")).to_string();
    let (_, absent) = text.split_once("not computed").unwrap();
    for word in ["no [ionosphere]", "no [troposphere]", "no [noise]", "quantiser"] {
        assert!(absent.contains(word), "{text}");
    }
}

#[test]
fn every_knob_is_named_with_its_choice_its_error_and_its_cost() {
    let bare = include_str!("../../../scenarios/static.toml");
    let balanced = plan(bare).to_string();
    assert!(balanced.contains("fidelity balanced"), "{balanced}");
    for knob in ["code_edge", "carrier", "knot_tolerance_cycles", "noise"] {
        let line = balanced.lines().find(|line| line.trim_start().starts_with(knob)).expect(knob);
        assert!(!line.contains("(own)"), "{line}");
    }
    let reference = plan(&format!("{bare}[fidelity]\nlevel = \"reference\"\ncode_edge = \"area\"\n"));
    let text = reference.to_string();
    assert!(text.contains("area (own)") && text.contains("fidelity reference"), "{text}");
    // Without noise there is nothing for its knob to do.
    let free = plan(include_str!("../../../scenarios/noise_free.toml"));
    assert!(free.knobs.iter().all(|choice| choice.knob != "noise"));
}

#[test]
fn satellites_that_rise_and_set_are_told_apart() {
    let day = include_str!("../../../scenarios/noise_free.toml").replace("duration_s = 60", "duration_s = 14400");
    let plan = plan(&day);
    assert!(
        plan.satellites.iter().any(|s| matches!(s.appears, Some((_, PassEnd::Mask))))
            && plan.satellites.iter().any(|s| matches!(s.leaves, Some((_, PassEnd::Mask))))
    );
    // 11 satellites on average in view, each for some five hours: more than 12 and fewer than all in four
    // hours.
    assert!((13..=28).contains(&plan.satellites.len()), "{plan}");
}
