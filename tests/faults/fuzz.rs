//! Fuzzing of every parser: texts of a kept corpus (`tests/faults/corpus`), bent by seed in bytes, digits,
//! fields, lines and splices.
//!
//! Each is read or refused by a message that begins with the file's name; nothing panics, hangs or takes much
//! memory; what is accepted lies within physical ranges and is the same when it is read again. What was found
//! once stays in the corpus under a name that begins with `found`. Executions in the long run are 1 000 000 a
//! parser, fewer where TOML, the file system or the judge's work on tables takes longer.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use analysis::expect::stated::Stated;
use analysis::judge::limits::Limits;
use analysis::measure::clock::Clock;
use analysis::measure::consistency::Consistency;
use analysis::measure::elevation::Elevations;
use analysis::measure::errors::Errors;
use analysis::measure::jitter::Jitter;
use analysis::measure::slips::Slips;
use analysis::read::Run;
use analysis::read::{nmea, rinex_obs};
use generator::effect::antenna;
use generator::effect::city::facet::{Facet, facets};
use generator::scenario::Scenario;
use generator::vehicle::Trajectory;
use generator::vehicle::file::{Options, read_csv, read_nmea};
use gnss::cityjson;
use gnss::ionex::{Interpolation, Maps};
use gnss::time::Epoch;
use gnss::vienna::MappingGrid;
use gnss::{rinex, sigmf, sp3};
use receiver::settings::Settings;
use study::sweep::plan::{Cut, Plan};
use study::sweep::shard;
use study::sweep::spec::Study;

use crate::damage::Random;
use crate::navigation::{packed, ranges};
use crate::scenes::{LIMITS, SCENES, STUDY};
use crate::sizes::{memory_kib, reset_peak};
use crate::tally::{End, Tally, cases};

const FAMILY: &str = "Fuzzing";
/// Memory in KiB that a parser may take beyond the earlier use: P1's bound.
const ROOM_KIB: u64 = 64 << 10;
/// Executions timed together.
const BATCH: usize = 250;

/// Numbers at which readers of numbers break.
const NUMBERS: [&str; 20] = [
    "0",
    "-0",
    "-1",
    "1",
    "00",
    "99",
    "255",
    "256",
    "65536",
    "2147483648",
    "9223372036854775808",
    "18446744073709551616",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "1D+05",
    "0.1",
    "+",
];

/// Settings of every type.
const SETTINGS: &str = "[acquisition]\ndoppler_max_hz = 5000.0\n[tracking]\npll_order = 3\npll_bandwidth_hz = 18.0\n\
                        replica = \"area\"\n\
                        [position]\nmask_deg = 5\nrequire_ionosphere = true\n[operation]\nsearch_interval_s = 15.0\n\
                        week_reference = \"2024-01-01T00:00:00\"\n";

/// A text of the corpus with one to four changes; `all` are those to splice with.
fn bent(all: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = all[random.below(all.len())].clone();
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            return bytes;
        }
        let at = random.below(bytes.len());
        match random.below(14) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => drop(bytes.remove(at)),
            3 => bytes.insert(at, random.next() as u8),
            4 => bytes.truncate(at),
            5 | 6 => {
                // A digit, from where one stands.
                if let Some(digit) = (at..bytes.len()).find(|i| bytes[*i].is_ascii_digit()) {
                    bytes[digit] = b'0' + random.below(10) as u8;
                }
            }
            7 | 8 => {
                let (from, to) = word(&bytes, at);
                let new = NUMBERS[random.below(NUMBERS.len())];
                bytes.splice(from..to, new.bytes());
            }
            9 => {
                // A field in another's place.
                let (from, to) = word(&bytes, at);
                let (start, end) = word(&bytes, random.below(bytes.len()));
                let other = bytes[start..end].to_vec();
                bytes.splice(from..to, other);
            }
            10..=12 => {
                let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
                let (one, other) = (random.below(lines.len()), random.below(lines.len()));
                match random.below(4) {
                    0 => drop(lines.remove(one)),
                    1 => lines.insert(one, lines[other]),
                    2 => lines.swap(one, other),
                    _ => lines.truncate(one),
                }
                bytes = lines.concat();
            }
            _ => {
                // The head of one text and the tail of another.
                let other = &all[random.below(all.len())];
                if !other.is_empty() {
                    let tail = random.below(other.len());
                    bytes.truncate(at);
                    bytes.extend_from_slice(&other[tail..]);
                }
            }
        }
    }
    bytes
}

/// The bounds of a run of letters, digits, signs and points about a place.
fn word(bytes: &[u8], at: usize) -> (usize, usize) {
    let inside = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
    let from = bytes[..at].iter().rposition(|byte| !inside(byte)).map_or(0, |end| end + 1);
    let to = bytes[at..].iter().position(|byte| !inside(byte)).map_or(bytes.len(), |length| at + length);
    (from, to.max(from))
}

/// Parser of bytes. It returns an equal number for equal content, or its refusal.
pub type Read<'a> = Box<dyn Fn(&[u8]) -> Result<u64, String> + 'a>;

pub struct Target<'a> {
    pub name: &'static str,
    pub corpus: Vec<Vec<u8>>,
    /// Beginning of the refusals.
    pub prefix: String,
    /// Executions in the long run and in the short one.
    pub runs: (usize, usize),
    pub read: Read<'a>,
}

fn kept(names: &[&str]) -> Vec<Vec<u8>> {
    let directory = corpus();
    let mut found: Vec<Vec<u8>> = names.iter().map(|name| fs::read(directory.join(name)).unwrap()).collect();
    // What was found with files of the same ending.
    let endings: Vec<&str> = names.iter().filter_map(|name| name.rsplit('.').next()).collect();
    let mut others: Vec<PathBuf> = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    others.sort();
    for path in others {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name.starts_with("found") && endings.iter().any(|ending| name.ends_with(ending)) {
            found.push(fs::read(&path).unwrap());
        }
    }
    found
}

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults/corpus")
}

pub fn hashed(what: impl std::fmt::Debug) -> u64 {
    let mut hasher = DefaultHasher::new();
    format!("{what:?}").hash(&mut hasher);
    hasher.finish()
}

fn text(error: impl ToString) -> String {
    error.to_string()
}

/// Checks that a motion is within the region of real bodies, all along.
fn moves(trajectory: &Trajectory) -> Result<u64, String> {
    // A motion that rests at an end is known for ever there; another one only within its span, wherever that
    // lies.
    let (from_s, to_s) = trajectory.span_s();
    let from_s = if from_s.is_finite() { from_s } else { to_s.min(0.0) - 1e3 };
    let to_s = if to_s.is_finite() { to_s } else { from_s + 1e5 };
    for part in [0.0, 0.3, 0.7, 1.0] {
        let motion = trajectory.at(from_s + part * (to_s - from_s));
        let radius_m = motion.position_m.norm();
        if !(1e6..1e10).contains(&radius_m) || !motion.velocity_mps.norm().is_finite() {
            return Err(format!("{motion:?} at {part}"));
        }
    }
    Ok(hashed((from_s, to_s, trajectory.at(from_s))))
}

fn targets() -> Vec<Target<'static>> {
    const MANY: (usize, usize) = (1_000_000, 300);
    let options = || Options { start: Epoch::parse("2010-07-01T08:05:58").unwrap(), max_gap_s: 2.0, tolerance_m: None };
    let navigation = |bytes: &[u8]| {
        let found = rinex::read(bytes, "file").map_err(text)?;
        ranges(&found)?;
        Ok(hashed((found.ephemerides.len(), found.ephemerides.first(), found.skipped.len(), found.klobuchar)))
    };
    let observations = |bytes: &[u8]| {
        rinex_obs::read(bytes).map(hashed).map_err(|fault| format!("file: line {}: {}", fault.line, fault.what))
    };
    let simple =
        |name, corpus, read: Read<'static>| Target { name, corpus, prefix: "file".to_owned(), runs: MANY, read };
    let scenes = SCENES.iter().map(|(_, text)| text.as_bytes().to_vec()).collect();
    let packed_corpus = kept(&["v2.10n"]).iter().map(|text| packed(text)).collect();
    vec![
        simple("navigation, RINEX 2", kept(&["v2.10n"]), Box::new(navigation)),
        simple("navigation, RINEX 3", kept(&["v3.rnx"]), Box::new(navigation)),
        simple("navigation, RINEX 4", kept(&["v4.rnx", "v3.rnx"]), Box::new(navigation)),
        simple("navigation, gzip", packed_corpus, Box::new(navigation)),
        simple("observations, RINEX 3", kept(&["obs.rnx"]), Box::new(observations)),
        simple("observations, RINEX 2", kept(&["v2.11o"]), Box::new(observations)),
        simple("observations, compressed", kept(&["obs.crx"]), Box::new(observations)),
        simple(
            "precise orbits, SP3",
            kept(&["orbits.sp3"]),
            Box::new(|bytes| sp3::read(bytes, "file").map(hashed).map_err(text)),
        ),
        simple(
            "electron maps, IONEX",
            kept(&["maps.10i"]),
            Box::new(|bytes| {
                let maps = Maps::read(bytes, "file").map_err(text)?;
                let (first, last) = maps.span();
                for at in [first, first.plus_s(0.4 * last.since(first)), last] {
                    let tecu = maps.vertical_tecu(0.3, -2.0, at, Interpolation::Bilinear);
                    if !(-10.0..=1000.0).contains(&tecu) {
                        return Err(format!("{tecu} TECU at {at}"));
                    }
                }
                Ok(hashed(maps))
            }),
        ),
        simple(
            "mapping grid, VMF3",
            kept(&["vmf3.grd"]),
            Box::new(|bytes| {
                let grid = MappingGrid::read(bytes, "file").map_err(text)?;
                let a = grid.at(0.4, 1.0);
                let fits = [a.hydrostatic, a.wet].iter().all(|a| (1e-6..0.1).contains(a));
                if fits { Ok(hashed(grid)) } else { Err(format!("{a:?}")) }
            }),
        ),
        simple(
            "positions, NMEA",
            kept(&["ride.nmea"]),
            Box::new(|bytes| {
                nmea::read(bytes, Epoch::parse("2010-07-01T08:05:45Z").unwrap())
                    .map(hashed)
                    .map_err(|fault| format!("file: line {}: {}", fault.line, fault.what))
            }),
        ),
        simple(
            "trajectory, NMEA",
            kept(&["ride.nmea"]),
            Box::new(move |bytes| {
                read_nmea(bytes, "file", &options()).map_err(text).and_then(|found| moves(&found.trajectory))
            }),
        ),
        simple(
            "trajectory, CSV",
            kept(&["ride.csv", "ecef.csv"]),
            Box::new(move |bytes| {
                read_csv(bytes, "file", &options()).map_err(text).and_then(|found| moves(&found.trajectory))
            }),
        ),
        simple(
            "antenna, CSV",
            kept(&["antenna.csv"]),
            Box::new(|bytes| antenna::Table::read(bytes, "file").map(hashed).map_err(text)),
        ),
        simple(
            "city model, CityJSON",
            kept(&["street.city.json"]),
            Box::new(|bytes| {
                let model = cityjson::read(bytes, "file", None).map_err(text)?;
                let all = facets(&model, |vertex| nalgebra::Vector3::from(*vertex), |_, _| true);
                let fits = |facet: &Facet| (facet.normal.norm() - 1.0).abs() < 1e-9 && facet.offset_m.is_finite();
                match all.iter().find(|facet| !fits(facet)) {
                    None => Ok(hashed((&model.surfaces, all.len()))),
                    Some(facet) => Err(format!("{facet:?}")),
                }
            }),
        ),
        simple(
            "scenario, TOML",
            scenes,
            Box::new(|bytes| Scenario::parse(&String::from_utf8_lossy(bytes), "file").map(hashed).map_err(text)),
        ),
        simple(
            "receiver's settings, TOML",
            vec![SETTINGS.into()],
            Box::new(|bytes| Settings::parse(&String::from_utf8_lossy(bytes), "file").map(hashed).map_err(text)),
        ),
        simple(
            "limits, TOML",
            vec![LIMITS.into()],
            Box::new(|bytes| Limits::parse(&String::from_utf8_lossy(bytes), "file").map(hashed).map_err(text)),
        ),
        simple(
            "study, TOML",
            vec![STUDY.into()],
            Box::new(|bytes| Study::parse(&String::from_utf8_lossy(bytes), "file").map(hashed).map_err(text)),
        ),
        simple(
            "metadata, SigMF",
            kept(&["meta.json"]),
            Box::new(|bytes| sigmf::parse(&String::from_utf8_lossy(bytes), "file").map(hashed).map_err(text)),
        ),
    ]
}

/// Runs a target's cases; seeds count from 0.
pub fn run(target: &Target) -> Result<(), String> {
    let mut tally = Tally::new(FAMILY, format!("8. {}", target.name));
    for (number, base) in target.corpus.iter().enumerate() {
        let found = number > 0 && target.corpus.len() > 1;
        tally.case(
            || format!("{}: text {number} of the corpus, as it is", target.name),
            || match (target.read)(base) {
                Ok(_) => Ok(End::Accepted),
                Err(message) if found && message.starts_with(&target.prefix) => Ok(End::Refused),
                Err(message) => Err(message),
            },
        );
    }
    let before_kib = reset_peak();
    let total = cases(target.runs.1, target.runs.0);
    for first in (0..total).step_by(BATCH) {
        let count = BATCH.min(total - first);
        tally.batch(count, &format!("{}, seed", target.name), first, |seed| {
            let mut random = Random::new(seed as u64 ^ 0xf00d);
            let bytes = bent(&target.corpus, &mut random);
            match (target.read)(&bytes) {
                // A sixteenth of them once more.
                Ok(once) if seed % 16 == 0 && (target.read)(&bytes) != Ok(once) => {
                    Err("read twice, and not the same".to_owned())
                }
                Ok(_) => Ok(End::Accepted),
                Err(message) if message.starts_with(&target.prefix) => Ok(End::Refused),
                Err(message) => Err(message),
            }
        });
    }
    let taken_kib = memory_kib("VmHWM").saturating_sub(before_kib);
    tally.case(
        || format!("{}: memory", target.name),
        || {
            if taken_kib <= ROOM_KIB {
                Ok(End::Accepted)
            } else {
                Err(format!("{taken_kib} KiB, expected at most {ROOM_KIB}"))
            }
        },
    );
    tally.close()
}

#[test]
fn whatever_stands_in_a_file_its_parser_ends_well() {
    let failures: Vec<String> = targets().iter().filter_map(|target| run(target).err()).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// A place for files that are written over and over: in memory, where there is such a place.
fn workplace() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() { tempfile::tempdir_in(memory).unwrap() } else { tempfile::tempdir().unwrap() }
}

#[test]
fn whatever_stands_in_a_study_s_directory_or_a_run_s_tables_is_read_or_refused() {
    let here = workplace();
    fs::write(here.path().join("study.toml"), STUDY).unwrap();
    let planned = here.path().join("planned");
    let plan = Plan::create(&here.path().join("study.toml"), &planned, Cut::Shards(2), "build").unwrap();
    let manifest = fs::read(planned.join("manifest.json")).unwrap();
    let figures = plan.manifest.columns.len() - 3 - plan.study.axes.len();
    let rows: Vec<Vec<Option<f64>>> = plan.cases(0).map(|case| vec![Some(0.5 + case as f64); figures]).collect();
    let whole = shard::render(&plan, 0, &rows);
    let place = shard::path(&plan, 0);
    let lines = {
        fs::write(&place, &whole).unwrap();
        shard::find(&plan, 0).unwrap()
    };
    assert!(matches!(lines, shard::Found::Whole(_)));
    let tables = here.path().join("run");
    copy(&corpus().join("run"), &tables);
    let mut targets = vec![
        Target {
            name: "manifest of a study",
            corpus: vec![manifest.clone()],
            prefix: planned.display().to_string(),
            runs: (1_000_000, 200),
            read: Box::new(|bytes| {
                fs::write(planned.join("manifest.json"), bytes).unwrap();
                match Plan::load(&planned) {
                    // A manifest is what follows from its inputs, byte by byte, or refused.
                    Ok(_) if bytes == manifest => Ok(0),
                    Ok(again)
                        if again.manifest.shard_size != plan.manifest.shard_size
                            || again.manifest.build != plan.manifest.build =>
                    {
                        Ok(1)
                    }
                    Ok(_) => {
                        let at = bytes.iter().zip(&manifest).take_while(|(new, old)| new == old).count();
                        let near = |text: &[u8]| {
                            let end = text.len().min(at + 30);
                            String::from_utf8_lossy(&text[at.saturating_sub(30).min(end)..end]).into_owned()
                        };
                        Err(format!("another manifest passes: {:?} for {:?}", near(bytes), near(&manifest)))
                    }
                    Err(error) => Err(text(error).trim_start_matches("cannot read ").to_owned()),
                }
            }),
        },
        Target {
            name: "shard of a study",
            corpus: vec![whole.clone()],
            prefix: "bad: ".to_owned(),
            runs: (1_000_000, 300),
            read: Box::new(|bytes| {
                fs::write(&place, bytes).unwrap();
                match shard::find(&plan, 0).map_err(text)? {
                    shard::Found::Whole(found) if shard::Found::Whole(found.clone()) == lines => Ok(0),
                    shard::Found::Whole(_) => Err("another shard passes".to_owned()),
                    shard::Found::Bad(reason) => Err(format!("bad: {reason}")),
                    shard::Found::Nothing => Err("nothing".to_owned()),
                }
            }),
        },
    ];
    for (name, file) in [
        ("table: true observations", "truth/observations.csv"),
        ("table: sky", "truth/sky.csv"),
        ("table: true trajectory", "truth/trajectory.csv"),
        ("table: facts of the scene", "truth/scene.json"),
        ("table: observations", "rx/observations.csv"),
        ("table: fixes", "rx/fixes.csv"),
        ("table: tracking", "rx/tracking.csv"),
        ("table: events", "rx/events.csv"),
        ("table: the receiver's own account", "rx/receiver.json"),
    ] {
        let (path, tables) = (tables.join(file), tables.clone());
        let base = fs::read(&path).unwrap();
        let good = base.clone();
        targets.push(Target {
            name,
            corpus: vec![base],
            prefix: "refused: ".to_owned(),
            runs: (4_000, 40),
            read: Box::new(move |bytes| {
                fs::write(&path, bytes).unwrap();
                let judged = judge(&tables);
                fs::write(&path, &good).unwrap();
                judged
            }),
        });
    }
    let failures: Vec<String> = targets.iter().filter_map(|target| run(target).err()).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Reads a run's tables and measures them, pictures left out.
fn judge(run: &Path) -> Result<u64, String> {
    let refused = |error: analysis::JudgeError| format!("refused: {error}");
    let read = Run::read(run).map_err(refused)?;
    let errors = Errors::measure(&read).map_err(refused)?;
    let clock = Clock::measure(&read, &errors).map_err(refused)?;
    let consistency = Consistency::measure(&read, &errors);
    let slips = Slips::find(&read, &errors).map_err(refused)?;
    let stated = Stated::of(&read);
    let jitter = Jitter::measure(&read, &errors, &stated).map_err(refused)?;
    let _ = (clock, consistency, jitter, Elevations::measure(&read, &errors, &stated).map_err(refused)?);
    Ok(hashed(slips.causes()))
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).unwrap();
        }
    }
}
