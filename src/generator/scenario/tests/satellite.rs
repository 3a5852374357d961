//! Precise orbits and faults of satellites and messages as written.

use std::path::Path;

use super::*;
use crate::message::{self, MessageFault, Slot};
use gnss::galileo::inav::INAV;
use gnss::message::Read;
use gnss::satellite::System;
use gnss::time::GST;

/// Every key of the tables.
pub(super) const FAULTS: &str = "[orbits]\nsp3 = [\"a.sp3\", \"b.sp3.gz\"]\nantenna_offset_m = 0.7\n\
                                 antenna_offsets_m = { G13 = 1.5 }\n\
    [sbas]\ntest = true\ndo_not_use = [\"G03\"]\ndegradation = true\n\
    [[satellite_fault]]\nkind = \"clock_step\"\nsatellites = [\"G13\"]\nstep_s = 1e-7\non_s = 3\noff_s = 5\n\
    [[satellite_fault]]\nkind = \"clock_ramp\"\nsatellites = [\"G13\"]\ndrift_sps = 1e-9\n\
    [[satellite_fault]]\nkind = \"clock_noise\"\noscillator = \"rubidium1\"\n\
    [[satellite_fault]]\nkind = \"clock_noise\"\npower_law = [0, 0, 1e-22, 0, 0]\n\
    [[satellite_fault]]\nkind = \"orbit\"\nsatellites = [\"G13\"]\nradial_m = 1\nalong_m = 20\ncross_m = 3\non_s = 2\n\
    ramp_s = 60\n\
    [[message_fault]]\nkind = \"bit_errors\"\nsatellites = [\"G13\"]\nrate = 1e-3\non_s = 3\noff_s = 5\n\
    [[message_fault]]\nkind = \"bit\"\nsubframe = 2\nword = 3\nbit = 30\n\
    [[message_fault]]\nkind = \"health\"\nsatellites = [\"G13\"]\nhealth = 63\n\
    [[message_fault]]\nkind = \"parameter\"\nsatellites = [\"G13\"]\nparameter = \"m0_rad\"\nadd = 1e-6\n";

#[test]
fn orbits_and_faults_arrive_as_written() {
    let scenario = parse(&(full() + FAULTS)).unwrap();
    let orbits = scenario.orbits.unwrap();
    assert_eq!(orbits.files, [Path::new("a.sp3"), Path::new("b.sp3.gz")]);
    assert_eq!((orbits.antenna_m, orbits.antennas_m.as_slice()), (0.7, [(Sv::gps(13), 1.5)].as_slice()));
    let satellites = vec![Sv::gps(13)];
    let step = SatelliteFault::Step { satellites: satellites.clone(), step_s: 1e-7, on_s: 3.0, off_s: Some(5.0) };
    assert_eq!(scenario.satellite_faults[0], step);
    let law = PowerLaw { h0: 1e-22, ..PowerLaw::default() };
    assert_eq!(scenario.satellite_faults[3], SatelliteFault::Noise { satellites: None, law });
    let orbit = SatelliteFault::Orbit {
        satellites: satellites.clone(),
        radial_m: 1.0,
        along_m: 20.0,
        cross_m: 3.0,
        growth_s: Some((2.0, 60.0)),
    };
    assert_eq!(scenario.satellite_faults[4], orbit);
    let kinds: Vec<MessageKind> = scenario.message_faults.iter().map(|spec| spec.kind).collect();
    let expected = [
        MessageKind::BitErrors { rate: 1e-3 },
        MessageKind::Bit { subframe: 2, word: 3, bit: 30 },
        MessageKind::Health(63),
        MessageKind::Parameter { name: "m0_rad", add: 1e-6 },
    ];
    assert_eq!(kinds, expected);
    assert!(scenario.message_faults[1].satellites.is_none());
}

#[test]
fn faults_that_cannot_be_are_refused_with_their_remedy() {
    let refused = |text: &str| match parse(&format!("{MINIMAL}{STATIC}{text}")) {
        Err(error) => error.to_string(),
        Ok(scenario) => scenario.compose(Path::new("../.."), &Overrides::default()).err().unwrap().to_string(),
    };
    let fault = |lines: &str| format!("[[satellite_fault]]\n{lines}\n");
    let message = |lines: &str| format!("[[message_fault]]\nsatellites = [\"G13\"]\n{lines}\n");
    assert!(refused(&fault("step_s = 1e-7")).contains("clock_step, clock_ramp"));
    assert!(refused(&fault("kind = \"clock_step\"\nstep_s = 1e-7")).contains("an array of satellites"));
    assert!(
        refused(&fault("kind = \"clock_step\"\nsatellites = [\"G13\"]\nstep_s = 1e-7\non_s = 4\noff_s = 3"))
            .contains("off_s")
    );
    assert!(refused(&fault("kind = \"clock_noise\"")).contains("power_law = [h2"));
    assert!(
        refused(&fault("kind = \"clock_noise\"\nstep_s = 1e-7")).contains("unknown key 'satellite_fault[1].step_s'")
    );
    let jump = refused(&fault("kind = \"orbit\"\nsatellites = [\"G13\"]\non_s = 3\nalong_m = 10"));
    assert!(jump.contains("orbits do not jump"), "{jump}");
    assert!(refused(&message("kind = \"bit\"\nsubframe = 6\nword = 1\nbit = 1")).contains("an integer from 1 to 5"));
    assert!(refused(&message("kind = \"health\"\nhealth = 512")).contains("an integer from 0 to 511"));
    let misspelt = refused(&message("kind = \"parameter\"\nparameter = \"m0\"\nadd = 1"));
    assert!(misspelt.contains("did you mean m0_rad?"), "{misspelt}");
    // Half a semicircle of eccentricity does not fit, and the message says what would.
    let large = refused(&message("kind = \"parameter\"\nparameter = \"eccentricity\"\nadd = 1"));
    assert!(large.contains("message_fault") && large.contains("eccentricity") && large.contains("0.49999"), "{large}");
    let all = refused("[[message_fault]]\nkind = \"health\"\nhealth = 63\n");
    assert!(all.contains("an array of satellites"), "{all}");
}

#[test]
fn only_the_named_satellites_are_computed_and_unknown_names_are_warned_of() {
    let base = format!("{MINIMAL}{STATIC}");
    let composed = |table: &str| {
        let scenario = parse(&format!("{base}[satellites]\n{table}\n")).map_err(|error| error.to_string())?;
        scenario.compose(Path::new("."), &Overrides::default()).map_err(|error| error.to_string())
    };
    let (scene, warned) = composed("only = [\"G13\", \"G23\", \"G99\"]").unwrap();
    let left: Vec<Sv> = scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)).collect();
    assert_eq!(left, [Sv::gps(13), Sv::gps(23)]);
    assert!(warned.iter().any(|line| line.contains("satellites.only names G99")), "{warned:?}");
    let both = composed("only = [\"G13\"]\nexclude = [\"G01\"]").err().unwrap();
    assert!(both.contains("satellites.exclude") && both.contains("nothing beside only"), "{both}");
    assert!(composed("only = []").err().unwrap().contains("satellites.only = []: expected at least one satellite"));
}

#[test]
fn orbits_that_do_not_reach_over_the_scene_are_refused_with_their_reach() {
    let witness = "[orbits]\nsp3 = \"data/witness/igs15904.sp3.gz\"\n";
    let composed = |start: &str, tables: &str| {
        let text = replaced(&format!("{MINIMAL}{STATIC}"), "", "start", start) + "\n" + tables;
        let scenario = parse(&text).unwrap();
        scenario.compose(Path::new("../.."), &Overrides::default()).map_err(|e| e.to_string())
    };
    // 00:00 to 23:45 every 15 minutes: five epochs before the one at the start, five after that at the end.
    let early = composed("2010-07-01T01:00:00", witness).err().unwrap();
    assert!(early.contains("2010-07-01T01:15:00") && early.contains("2010-07-01T22:30:00"), "{early}");
    let (scene, warned) = composed("2010-07-01T10:00:00", witness).unwrap();
    // PRN 1 has positions and no clock that day; it is unhealthy by its message, too.
    assert!(scene.excluded.contains(&Sv::gps(1)) && !scene.excluded.contains(&Sv::gps(13)), "{warned:?}");
    let (scene, warned) =
        composed("2010-07-01T10:00:00", &format!("{witness}[satellites]\ninclude_unhealthy = true\n")).unwrap();
    assert!(scene.excluded.contains(&Sv::gps(1)));
    assert!(warned.iter().any(|line| line.contains("without a precise orbit") && line.contains("G01")), "{warned:?}");
    let other = composed("2010-07-01T10:00:00", "[orbits]\nsp3 = \"Cargo.toml\"\n").err().unwrap();
    assert!(other.contains("orbits.sp3") && other.contains("begins with '[package]'"), "{other}");
    let stranger = "[[message_fault]]\nkind = \"health\"\nsatellites = [\"G99\"]\nhealth = 1\n";
    let (_, warned) = composed("2010-07-01T10:00:00", stranger).unwrap();
    assert!(warned.iter().any(|line| line.contains("a fault names G99")), "{warned:?}");
}

/// The faults of a scene of both systems, and what its satellite sends under them in the page of word 1.
fn of_galileo(fault: &str) -> Result<(Vec<bool>, Vec<bool>), String> {
    let scene =
        "name = \"x\"\nstart = 2020-11-29T12:50:30\nduration_s = 60\nsignals = [\"GPS L1 C/A\", \"Galileo E1\"]\n";
    let text = format!("{scene}{STATIC}\n[[message_fault]]\n{fault}\n");
    let scenario = parse(&text).map_err(|e| e.to_string())?;
    let (scene, _) = scenario.compose(Path::new("../.."), &Overrides::default()).map_err(|e| e.to_string())?;
    let sv = Sv { system: System::Galileo, number: 12 };
    let set = scene.catalogue.sent_at(sv, scene.clock.start).unwrap();
    let sender = scene.messages.of(&INAV).unwrap();
    // 12:50:51.
    let unit = INAV.unit_at(scene.clock.start.seconds() + 21);
    let slot = Slot { message: &INAV, time: &GST, unit };
    let sent = |faults: &[MessageFault]| message::unit(faults, sender, [set; 2], &slot).unwrap().symbols;
    Ok((sent(&[]), sent(&scene.message_faults)))
}

#[test]
fn a_parameter_is_wrong_in_the_message_that_has_it_and_refused_by_name_in_another() {
    let raw = |symbols: &[bool], name: &str| {
        let (_, all) = (INAV.parameters)(symbols).unwrap();
        all.into_iter().find(|(found, _)| *found == name).unwrap().1
    };
    let (plain, wrong) =
        of_galileo("kind = \"parameter\"\nsatellites = [\"E12\"]\nparameter = \"m0_rad\"\nadd = 1e-6").unwrap();
    // 1e-6 rad are 683.6 steps of π·2^-31.
    assert!([683, 684].contains(&(raw(&wrong, "m0_rad") - raw(&plain, "m0_rad"))));
    assert_eq!(raw(&wrong, "eccentricity"), raw(&plain, "eccentricity"));
    let refused = |satellite: &str, parameter: &str| {
        let lines =
            format!("kind = \"parameter\"\nsatellites = [\"{satellite}\"]\nparameter = \"{parameter}\"\nadd = 1e-9");
        of_galileo(&lines).err().unwrap()
    };
    let inav = refused("E12", "tgd_s");
    assert!(inav.contains("E12: I/NAV has no parameter tgd_s") && inav.contains("bgd_e1_e5b_s"), "{inav}");
    let lnav = refused("G05", "bgd_e1_e5b_s");
    assert!(lnav.contains("G05: LNAV has no parameter bgd_e1_e5b_s") && lnav.contains("tgd_s"), "{lnav}");
    // Nothing may pretend to be another satellite or issue.
    assert!(refused("E12", "svid").contains("parameter"));
}

#[test]
fn alert_pages_say_nothing_and_keep_their_place() {
    let (plain, alert) = of_galileo("kind = \"alert\"\nsatellites = [\"E12\"]").unwrap();
    assert!((INAV.parameters)(&plain).is_some() && (INAV.parameters)(&alert).is_none());
    // Both parts have the pattern, and the tail of coded zeros at their end.
    assert_eq!((&alert[..10], &alert[250..260]), (&plain[..10], &plain[250..260]));
    let mut reader = (INAV.reader)(Sv { system: System::Galileo, number: 12 });
    let near = Epoch::parse("2020-11-29T12:50:30").unwrap();
    let mut take = |symbols: &[bool]| -> usize {
        let news = symbols.iter().flat_map(|&one| reader.take(if one { -1.0 } else { 1.0 }, near));
        news.filter(|read| !matches!(read, Read::Refused(_))).count()
    };
    let (_, other) = of_galileo("kind = \"alert\"\nsatellites = [\"E11\"]").unwrap();
    assert_eq!(other, plain);
    take(&plain);
    // More than the reader lets fail where it expects pages.
    assert_eq!((0..8).map(|_| take(&alert)).sum::<usize>(), 0);
    let refused = of_galileo("kind = \"alert\"\nsatellites = [\"G05\"]").err().unwrap();
    assert!(refused.contains("G05: LNAV has no alert pages"), "{refused}");
}
