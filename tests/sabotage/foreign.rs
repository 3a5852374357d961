//! Files of another receiver, damaged: our own exports, judged by `analyze --truth` as a stranger's.
//!
//! Unsound files must fail by a row that names the fault. Sound ones must fail none: other intervals, other
//! clocks, recordings that end early, values that are rounded.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use analysis::judge::foreign::{Files, judge};
use analysis::judge::verdict::Verdict;

use crate::rinex::{Observations, Sentences};
use crate::run;
use crate::table::normal;

/// Change of a file.
#[derive(Clone, Copy)]
enum Change {
    Rinex(fn(&mut Observations)),
    Nmea(fn(&mut Sentences)),
}

/// A variant of a scene's files.
struct Variant {
    name: &'static str,
    scene: &'static str,
    change: Change,
    /// Row that must fail; none of a sound variant.
    row: Option<&'static str>,
}

const REST: &str = "rest";
const MOTION: &str = "motion";
const TWO: &str = "two systems";
const GALILEO: &str = "galileo";
const URBAN: &str = "urban";

fn unsound(name: &'static str, scene: &'static str, row: &'static str, change: Change) -> Variant {
    Variant { name, scene, change, row: Some(row) }
}

fn sound(name: &'static str, scene: &'static str, change: Change) -> Variant {
    Variant { name, scene, change, row: None }
}

/// Changes the values of the satellite that [`Observations::one`] gives.
fn one(file: &mut Observations, kind: char, of: impl Fn(f64, f64) -> f64) {
    let sv = file.one();
    file.map(kind, |name| name == sv, |t_s, _, value| of(t_s, value));
}

/// Changes the values of all satellites.
fn all(file: &mut Observations, kind: char, of: impl Fn(f64, f64) -> f64) {
    file.map(kind, |_| true, |t_s, _, value| of(t_s, value));
}

/// Adds white noise to the values of all satellites.
fn noisy(file: &mut Observations, kind: char, sigma: f64, stream: u64) {
    let mut index = 0;
    let add = |_: f64, _: &str, value: f64| {
        index += 1;
        value + sigma * normal(index, stream)
    };
    file.map(kind, |_| true, add);
}

/// Gives a satellite's values of a kind the first one for good.
fn freeze(file: &mut Observations, kind: char) {
    let (sv, mut first) = (file.one(), None);
    file.map(kind, |name| name == sv, |_, _, value| *first.get_or_insert(value));
}

fn codes() -> Vec<Variant> {
    use Change::Rinex;
    const MEAN: &str = "pseudorange error of a satellite, mean";
    const SIGMA: &str = "pseudorange sigma over a plain receiver's, largest";
    const OTHER: &str = "pseudoranges of another signal";
    const FROZEN: &str = "values that stay as they were";
    const DRIFT: &str = "code against carrier, drift";
    vec![
        unsound("one code 8 m long", REST, MEAN, Rinex(|file| one(file, 'C', |_, value| value + 8.0))),
        unsound("one code of E1 8 m long", GALILEO, MEAN, Rinex(|file| one(file, 'C', |_, value| value + 8.0))),
        unsound("one code 8 m short in motion", MOTION, MEAN, Rinex(|file| one(file, 'C', |_, value| value - 8.0))),
        unsound(
            "one code 20 m long for ten seconds",
            TWO,
            MEAN,
            Rinex(|file| {
                one(file, 'C', |t_s, value| value + if (15.0..25.0).contains(&t_s) { 20.0 } else { 0.0 });
            }),
        ),
        unsound(
            "one code 300 m long among reflections",
            URBAN,
            OTHER,
            Rinex(|file| {
                one(file, 'C', |_, value| value + 300.0);
            }),
        ),
        unsound("one code that stays", REST, FROZEN, Rinex(|file| freeze(file, 'C'))),
        unsound("code noise of 15 m", MOTION, SIGMA, Rinex(|file| noisy(file, 'C', 15.0, 1))),
        unsound(
            "codes of GPS 300 m long",
            TWO,
            "offset of pseudoranges between signals",
            Rinex(|file| {
                file.map('C', |sv| sv.starts_with('G'), |_, _, value| value + 300.0);
            }),
        ),
        unsound(
            "codes of Galileo 300 m short",
            TWO,
            "offset of pseudoranges between signals",
            Rinex(|file| {
                file.map('C', |sv| sv.starts_with('E'), |_, _, value| value - 300.0);
            }),
        ),
        unsound(
            "one code that leaves its carrier",
            TWO,
            "code against carrier of a satellite, drift",
            Rinex(|file| {
                one(file, 'C', |t_s, value| value + 0.5 * t_s);
            }),
        ),
        unsound(
            "all codes that leave their carriers",
            GALILEO,
            DRIFT,
            Rinex(|file| {
                all(file, 'C', |t_s, value| value + 0.5 * t_s);
            }),
        ),
        unsound(
            "two satellites exchanged",
            REST,
            OTHER,
            Rinex(|file| {
                let longest = file.longest();
                let other = |sv: &str| match sv {
                    _ if sv == longest[0] => longest[1].clone(),
                    _ if sv == longest[1] => longest[0].clone(),
                    _ => sv.to_owned(),
                };
                file.epochs.iter_mut().flat_map(|epoch| &mut epoch.rows).for_each(|row| row.0 = other(&row.0));
            }),
        ),
    ]
}

fn carriers() -> Vec<Variant> {
    use Change::Rinex;
    const SIGN: &str = "sign of the carrier";
    const BREAKS: &str = "undeclared breaks of carriers";
    const DRIFT: &str = "drift of a carrier against the others";
    vec![
        unsound("one carrier's sign", REST, SIGN, Rinex(|file| one(file, 'L', |_, value| -value))),
        unsound("all carriers' signs", GALILEO, SIGN, Rinex(|file| all(file, 'L', |_, value| -value))),
        unsound("carriers' signs among reflections", URBAN, SIGN, Rinex(|file| all(file, 'L', |_, value| -value))),
        unsound("one carrier a thousandth long", REST, DRIFT, Rinex(|file| one(file, 'L', |_, value| 1.001 * value))),
        unsound(
            "one carrier that drifts",
            MOTION,
            DRIFT,
            Rinex(|file| one(file, 'L', |t_s, value| value + 0.05 * t_s)),
        ),
        unsound(
            "half a cycle undeclared",
            TWO,
            BREAKS,
            Rinex(|file| {
                one(file, 'L', |t_s, value| value + if t_s > 20.0 { 0.5 } else { 0.0 });
            }),
        ),
        unsound("one carrier that stays", MOTION, "values that stay as they were", Rinex(|file| freeze(file, 'L'))),
        unsound("every carrier declared broken", REST, "carriers declared broken", Rinex(|file| file.indicate('1'))),
        unsound("carrier noise of 0.15 cycles", TWO, "jitter of a carrier", Rinex(|file| noisy(file, 'L', 0.15, 2))),
    ]
}

fn dopplers() -> Vec<Variant> {
    use Change::Rinex;
    const MEAN: &str = "Doppler error of a satellite, mean";
    const SIGN: &str = "sign of Doppler";
    const BIAS: &str = "C/N0 bias, magnitude";
    const OTHERS: &str = "C/N0 error of a satellite against the others";
    vec![
        unsound("one Doppler 5 Hz high", REST, MEAN, Rinex(|file| one(file, 'D', |_, value| value + 5.0))),
        unsound("one Doppler 5 Hz high in motion", MOTION, MEAN, Rinex(|file| one(file, 'D', |_, value| value + 5.0))),
        unsound(
            "Dopplers a hundredth high",
            TWO,
            "scale of Doppler, difference from one",
            Rinex(|file| {
                all(file, 'D', |_, value| 1.01 * value);
            }),
        ),
        unsound(
            "Dopplers 50 Hz high",
            REST,
            "Doppler plus the carrier's rate",
            Rinex(|file| {
                all(file, 'D', |_, value| value + 50.0);
            }),
        ),
        unsound("one Doppler that stays", GALILEO, MEAN, Rinex(|file| freeze(file, 'D'))),
        unsound("all Dopplers' signs", REST, SIGN, Rinex(|file| all(file, 'D', |_, value| -value))),
        unsound(
            "Dopplers' signs of Galileo",
            TWO,
            SIGN,
            Rinex(|file| {
                file.map('D', |sv| sv.starts_with('E'), |_, _, value| -value);
            }),
        ),
        unsound("Dopplers' signs among reflections", URBAN, SIGN, Rinex(|file| all(file, 'D', |_, value| -value))),
        unsound("one C/N0 8 dB high", REST, OTHERS, Rinex(|file| one(file, 'S', |_, value| value + 8.0))),
        unsound(
            "one C/N0 8 dB high among reflections",
            URBAN,
            OTHERS,
            Rinex(|file| {
                one(file, 'S', |_, value| value + 8.0);
            }),
        ),
        unsound("one C/N0 of E1 8 dB low", GALILEO, OTHERS, Rinex(|file| one(file, 'S', |_, value| value - 8.0))),
        unsound("all C/N0 8 dB high", MOTION, BIAS, Rinex(|file| all(file, 'S', |_, value| value + 8.0))),
        unsound("one C/N0 that stays", TWO, "values that stay as they were", Rinex(|file| freeze(file, 'S'))),
    ]
}

fn times() -> Vec<Variant> {
    use Change::{Nmea, Rinex};
    const LATE: &str = "time tags of observations, late";
    const LITTLE: &str = "satellites observed too little";
    fn late(file: &mut Observations, by_s: f64) {
        file.epochs.iter_mut().for_each(|epoch| epoch.time_s += by_s);
    }
    fn every_second(file: &mut Observations) {
        let mut index = 0;
        file.epochs.retain(|_| {
            index += 1;
            index % 2 == 0
        });
    }
    const INTERVAL: &str = "interval of epochs against the header's";
    vec![
        unsound("every second epoch gone", REST, INTERVAL, Rinex(every_second)),
        unsound("every second epoch gone in motion", MOTION, INTERVAL, Rinex(every_second)),
        unsound("every second epoch of two systems gone", TWO, INTERVAL, Rinex(every_second)),
        unsound("observations 50 ms late", REST, LATE, Rinex(|file| late(file, 0.05))),
        unsound("observations 50 ms early", MOTION, LATE, Rinex(|file| late(file, -0.05))),
        unsound("observations a second late", TWO, LATE, Rinex(|file| late(file, 1.0))),
        unsound("observations a second late among reflections", URBAN, LATE, Rinex(|file| late(file, 1.0))),
        unsound(
            "half the epochs gone",
            REST,
            LITTLE,
            Rinex(|file| {
                let mut index = 0;
                file.epochs.retain(|_| {
                    index += 1;
                    normal(index, 3) > 0.0
                });
            }),
        ),
        unsound(
            "a third in the middle gone",
            TWO,
            LITTLE,
            Rinex(|file| {
                let third = file.epochs.len() / 3;
                file.epochs.drain(third..2 * third);
            }),
        ),
        unsound(
            "the second half gone",
            MOTION,
            "time without observations at the end",
            Rinex(|file| {
                file.epochs.truncate(file.epochs.len() / 2);
            }),
        ),
        unsound(
            "a satellite gone",
            REST,
            LITTLE,
            Rinex(|file| {
                let sv = file.one();
                file.epochs.iter_mut().for_each(|epoch| epoch.rows.retain(|row| row.0 != sv));
            }),
        ),
        unsound(
            "first fix twelve seconds late",
            REST,
            "time to the first of the positions",
            Nmea(|file| {
                let first_s = file.times_s()[0];
                file.keep(|t_s| t_s >= first_s + 12.0);
            }),
        ),
        unsound(
            "half the positions gone",
            TWO,
            "epochs without a fix",
            Nmea(|file| {
                file.keep(|t_s| normal((10.0 * t_s) as usize, 4) > 0.0);
            }),
        ),
    ]
}

fn places() -> Vec<Variant> {
    use Change::Nmea;
    const HORIZONTAL: &str = "horizontal position error, mean";
    const AGE: &str = "age of positions";
    const VELOCITY: &str = "velocity over ground error, largest";
    const COURSE: &str = "course over ground, error";
    vec![
        unsound("positions 30 m north", REST, HORIZONTAL, Nmea(|file| file.north(|_| 30.0))),
        unsound("positions 30 m south in motion", MOTION, HORIZONTAL, Nmea(|file| file.north(|_| -30.0))),
        unsound("positions 30 m north of E1", GALILEO, HORIZONTAL, Nmea(|file| file.north(|_| 30.0))),
        unsound(
            "positions 30 m north among reflections",
            URBAN,
            "position error that the scene bounds, largest",
            Nmea(|file| {
                file.north(|_| 30.0);
            }),
        ),
        unsound(
            "positions 20 m high",
            REST,
            "vertical position error, mean",
            Nmea(|file| {
                file.number("GGA", 9, |value| value + 20.0);
            }),
        ),
        unsound(
            "positions 20 m low of two systems",
            TWO,
            "vertical position error, mean",
            Nmea(|file| {
                file.number("GGA", 9, |value| value - 20.0);
            }),
        ),
        unsound(
            "positions 20 m high of E1",
            GALILEO,
            "vertical position error, mean",
            Nmea(|file| {
                file.number("GGA", 9, |value| value + 20.0);
            }),
        ),
        unsound(
            "positions 20 m low of E1",
            GALILEO,
            "vertical position error, mean",
            Nmea(|file| {
                file.number("GGA", 9, |value| value - 20.0);
            }),
        ),
        unsound(
            "positions that scatter by 25 m",
            REST,
            "position error, 95 %",
            Nmea(|file| {
                file.north(|index| 25.0 * normal(index, 5));
            }),
        ),
        unsound(
            "positions that stay",
            REST,
            "positions equal to the one before",
            Nmea(|file| {
                let mut first: Option<Vec<String>> = None;
                file.each("GGA", |fields| {
                    let first = first.get_or_insert_with(|| fields.clone());
                    fields[2..6].clone_from_slice(&first[2..6]);
                    fields[9].clone_from(&first[9]);
                });
            }),
        ),
        unsound("positions 0.3 s old", MOTION, AGE, Nmea(|file| file.aged(0.3))),
        unsound("positions a second old", MOTION, AGE, Nmea(|file| file.aged(1.0))),
        unsound("positions 50 ms late", MOTION, AGE, Nmea(|file| file.late(0.05))),
        unsound("positions a second late", MOTION, AGE, Nmea(|file| file.late(1.0))),
        unsound("100 knots at rest", REST, VELOCITY, Nmea(|file| file.number("RMC", 7, |_| 100.0))),
        unsound(
            "speeds in km/h",
            MOTION,
            "speed over ground, error of its scale",
            Nmea(|file| {
                file.number("RMC", 7, |value| 1.852 * value);
            }),
        ),
        unsound(
            "courses a quarter turn off",
            MOTION,
            COURSE,
            Nmea(|file| {
                file.number("RMC", 8, |value| (value + 90.0) % 360.0);
            }),
        ),
        unsound(
            "courses to where it comes from",
            MOTION,
            COURSE,
            Nmea(|file| {
                file.number("RMC", 8, |value| (value + 180.0) % 360.0);
            }),
        ),
    ]
}

/// Kinds of damage from above on other scenes.
fn elsewhere() -> Vec<Variant> {
    use Change::{Nmea, Rinex};
    fn noisy(file: &mut Observations, kind: char, sigma: f64) {
        let mut index = 0;
        file.map(
            kind,
            |_| true,
            |_, _, value| {
                index += 1;
                value + sigma * normal(index, 7)
            },
        );
    }
    fn without_one(file: &mut Observations) {
        let sv = file.one();
        file.epochs.iter_mut().for_each(|epoch| epoch.rows.retain(|row| row.0 != sv));
    }
    fn late(file: &mut Observations, by_s: f64) {
        file.epochs.iter_mut().for_each(|epoch| epoch.time_s += by_s);
    }
    fn late_first(file: &mut Sentences) {
        let first_s = file.times_s()[0];
        file.keep(|t_s| t_s >= first_s + 12.0);
    }
    const CODE: &str = "pseudorange error of a satellite, mean";
    const DOPPLER: &str = "Doppler error of a satellite, mean";
    const FROZEN: &str = "values that stay as they were";
    const STRENGTH: &str = "C/N0 error of a satellite against the others";
    const LATE: &str = "time tags of observations, late";
    const LITTLE: &str = "satellites observed too little";
    let kinds: Vec<(&'static str, &[&'static str], &'static str, Change)> = vec![
        ("one code eight metres long", &[TWO, MOTION], CODE, Rinex(|file| one(file, 'C', |_, value| value + 8.0))),
        (
            "one code eight metres short",
            &[REST, TWO, GALILEO],
            CODE,
            Rinex(|file| one(file, 'C', |_, value| value - 8.0)),
        ),
        ("one code that stays", &[TWO, GALILEO], FROZEN, Rinex(|file| freeze(file, 'C'))),
        (
            "one code 300 m long",
            &[REST, TWO, GALILEO],
            "pseudoranges of another signal",
            Rinex(|file| one(file, 'C', |_, value| value + 300.0)),
        ),
        (
            "code noise of 15 m",
            &[REST, TWO],
            "pseudorange sigma over a plain receiver's, largest",
            Rinex(|file| noisy(file, 'C', 15.0)),
        ),
        ("one carrier's sign", &[MOTION, TWO], "sign of the carrier", Rinex(|file| one(file, 'L', |_, value| -value))),
        (
            "half a cycle undeclared",
            &[REST, GALILEO],
            "undeclared breaks of carriers",
            Rinex(|file| one(file, 'L', |t_s, value| value + if t_s > 15.0 { 0.5 } else { 0.0 })),
        ),
        ("carrier noise of 0.15 cycles", &[REST, GALILEO], "jitter of a carrier", Rinex(|file| noisy(file, 'L', 0.15))),
        (
            "every carrier declared broken",
            &[TWO, GALILEO],
            "carriers declared broken",
            Rinex(|file| file.indicate('1')),
        ),
        ("one Doppler five hertz high", &[TWO, GALILEO], DOPPLER, Rinex(|file| one(file, 'D', |_, value| value + 5.0))),
        ("one Doppler five hertz low", &[REST, MOTION], DOPPLER, Rinex(|file| one(file, 'D', |_, value| value - 5.0))),
        ("all Dopplers' signs", &[MOTION, GALILEO], "sign of Doppler", Rinex(|file| all(file, 'D', |_, value| -value))),
        (
            "Dopplers 50 Hz high",
            &[TWO, GALILEO],
            "Doppler plus the carrier's rate",
            Rinex(|file| all(file, 'D', |_, value| value + 50.0)),
        ),
        ("one C/N0 8 dB low", &[REST, MOTION, TWO], STRENGTH, Rinex(|file| one(file, 'S', |_, value| value - 8.0))),
        (
            "all C/N0 8 dB high",
            &[REST, TWO, GALILEO],
            "C/N0 bias, magnitude",
            Rinex(|file| all(file, 'S', |_, value| value + 8.0)),
        ),
        ("observations 50 ms late", &[TWO, GALILEO], LATE, Rinex(|file| late(file, 0.05))),
        ("observations a second late", &[REST, MOTION, GALILEO], LATE, Rinex(|file| late(file, 1.0))),
        ("a satellite gone", &[MOTION, TWO, GALILEO], LITTLE, Rinex(without_one)),
        ("first fix twelve seconds late", &[MOTION, TWO], "time to the first of the positions", Nmea(late_first)),
        (
            "half the positions gone",
            &[REST, MOTION],
            "epochs without a fix",
            Nmea(|file| file.keep(|t_s| normal((10.0 * t_s) as usize, 8) > 0.0)),
        ),
        ("positions 30 m north", &[TWO], "horizontal position error, mean", Nmea(|file| file.north(|_| 30.0))),
        (
            "positions that scatter by 25 m",
            &[MOTION, TWO],
            "position error, 95 %",
            Nmea(|file| file.north(|index| 25.0 * normal(index, 9))),
        ),
    ];
    let each = |(name, scenes, row, change): (&'static str, &[&'static str], &'static str, Change)| {
        scenes.iter().map(|&scene| unsound(name, scene, row, change)).collect::<Vec<_>>()
    };
    kinds.into_iter().flat_map(each).collect()
}

fn sounds() -> Vec<Variant> {
    use Change::{Nmea, Rinex};
    fn every(file: &mut Observations, seconds: f64) {
        let whole = |t_s: f64| ((t_s / seconds).round() * seconds - t_s).abs() < 1e-6;
        file.epochs.retain(|epoch| whole(epoch.time_s));
        file.state_interval(seconds);
    }
    fn set(t_s: f64) -> f64 {
        // 20 ppm, set by whole milliseconds.
        20e-6 * t_s - 1e-3 * (20e-6 * t_s / 1e-3).round()
    }
    let mut all_scenes: Vec<Variant> =
        [REST, MOTION, TWO, GALILEO, URBAN].map(|scene| sound("as written", scene, Rinex(|_| {}))).into();
    all_scenes.extend([
        sound("an epoch a second", REST, Rinex(|file| every(file, 1.0))),
        sound("an epoch in ten seconds", TWO, Rinex(|file| every(file, 10.0))),
        sound("an epoch in thirty seconds", MOTION, Rinex(|file| every(file, 30.0))),
        sound(
            "observations that end five seconds early",
            REST,
            Rinex(|file| {
                let end_s = file.epochs[0].time_s + file.span_s() - 5.0;
                file.epochs.retain(|epoch| epoch.time_s <= end_s);
            }),
        ),
        sound(
            "positions that end four seconds early",
            TWO,
            Nmea(|file| {
                let end_s = file.times_s().last().unwrap() - 4.0;
                file.keep(|t_s| t_s <= end_s);
            }),
        ),
        sound("a position a second", MOTION, Nmea(|file| file.keep(|t_s| (t_s - t_s.round()).abs() < 1e-3))),
        sound("a clock of 2 ppm", REST, Rinex(|file| file.by_clock(|t_s| 2e-6 * t_s, |t_s| 2e-6 * t_s, 2e-6))),
        sound(
            "a clock of 2 ppm in motion",
            MOTION,
            Rinex(|file| {
                file.by_clock(|t_s| 2e-6 * t_s, |t_s| 2e-6 * t_s, 2e-6);
            }),
        ),
        sound("a clock 5 ms ahead", GALILEO, Rinex(|file| file.by_clock(|_| 5e-3, |_| 5e-3, 0.0))),
        sound("a clock set by milliseconds", TWO, Rinex(|file| file.by_clock(set, set, 20e-6))),
        sound(
            "a clock of codes alone set by milliseconds",
            REST,
            Rinex(|file| {
                file.by_clock(set, |t_s| 20e-6 * t_s, 20e-6);
            }),
        ),
        sound("C/N0 in whole decibels", MOTION, Rinex(|file| all(file, 'S', |_, value| value.round()))),
        sound("code noise of a metre", GALILEO, Rinex(|file| noisy(file, 'C', 1.0, 6))),
        sound("positions a metre north", REST, Nmea(|file| file.north(|_| 1.0))),
    ]);
    all_scenes
}

fn run_of(scene: &str) -> &'static Path {
    match scene {
        REST => run::at_rest(),
        MOTION => run::in_motion(),
        TWO => run::two_systems(),
        GALILEO => run::galileo(),
        _ => run::urban(),
    }
}

/// Rows that fail of a variant.
fn failed(variant: &Variant) -> Result<Vec<String>, String> {
    let directory = tempfile::tempdir().unwrap();
    let run = run_of(variant.scene);
    let [observations, positions] = ["observations.rnx", "fixes.nmea"].map(|name| run.join("rx").join(name));
    let mut files = Files { rinex_obs: Some(observations.clone()), nmea: Some(positions.clone()) };
    match variant.change {
        Change::Rinex(change) => {
            let mut file = Observations::read(&fs::read_to_string(&observations).unwrap());
            change(&mut file);
            let path = directory.path().join("damaged.rnx");
            fs::write(&path, file.write()).unwrap();
            files.rinex_obs = Some(path);
        }
        Change::Nmea(change) => {
            let mut file = Sentences::read(&fs::read_to_string(&positions).unwrap());
            change(&mut file);
            let path = directory.path().join("damaged.nmea");
            fs::write(&path, file.write()).unwrap();
            files.nmea = Some(path);
        }
    }
    let judgement = judge(&run.join("truth"), &files).map_err(|error| error.to_string())?;
    let rows = Verdict::of_foreign(&judgement).map_err(|error| error.to_string())?.rows;
    let text = |row: analysis::judge::judgement::Judgement| {
        (row.figure.clone(), format!("{} = {} {}, {}", row.figure, row.value_text(), row.unit, row.bound))
    };
    let failed = rows.into_iter().filter(|row| row.status.word() == "FAIL").map(text);
    Ok(failed.map(|(figure, text)| if variant.row == Some(figure.as_str()) { figure } else { text }).collect())
}

/// Fault of a variant's judgement, if there is one.
fn wrong(variant: &Variant) -> Option<String> {
    let found = match (failed(variant), variant.row) {
        (Err(error), _) => error,
        (Ok(rows), None) if rows.is_empty() => return None,
        (Ok(rows), Some(row)) if rows.iter().any(|failed| failed == row) => return None,
        (Ok(rows), _) => format!("fails by [{}]", rows.join("; ")),
    };
    let expected = variant.row.map_or("no row".to_owned(), |row| format!("\"{row}\""));
    Some(format!("{}, {}: {found}, expected {expected}", variant.name, variant.scene))
}

#[test]
fn another_receiver_s_files_fail_by_the_row_that_names_the_fault_and_sound_ones_by_none() {
    let mut variants: Vec<Variant> =
        [codes(), carriers(), dopplers(), times(), places(), elsewhere(), sounds()].into_iter().flatten().collect();
    let names: BTreeSet<String> = variants.iter().map(|one| format!("{}, {}", one.name, one.scene)).collect();
    assert_eq!(names.len(), variants.len(), "two variants bear one name");
    assert!(variants.iter().filter(|variant| variant.row.is_some()).count() >= 100);
    // Every second one at rest and in motion each day, all with `GNSS_TWIN_LONG`.
    if std::env::var_os("GNSS_TWIN_LONG").is_none() {
        let mut number = 0..;
        variants.retain(|variant| [REST, MOTION].contains(&variant.scene));
        variants.retain(|_| number.next().is_some_and(|n: usize| n.is_multiple_of(2)));
    }
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, std::num::NonZero::get) {
            scope.spawn(|| {
                while let Some(variant) = variants.get(next.fetch_add(1, Ordering::Relaxed)) {
                    found.lock().unwrap().extend(wrong(variant));
                }
            });
        }
    });
    let found = found.into_inner().unwrap();
    assert!(found.is_empty(), "{} of {}:\n{}", found.len(), variants.len(), found.join("\n"));
}
