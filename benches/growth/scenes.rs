//! Ladders of whole processes: what the shipped scenes cost when one quantity of theirs grows.

use std::path::Path;

use analysis::statistics::median;

use crate::ladder::{Ladder, Step};
use crate::process::{Spent, remove, spent};

/// Each process runs so often; of the longest one run is enough.
const ROUNDS: usize = 3;
const LONG_S: f64 = 20.0;
/// Satellites of the static scene, the highest first.
const SATELLITES: [&str; 12] = ["G23", "G13", "G03", "G19", "G06", "G07", "G20", "G16", "G32", "G10", "G08", "G28"];
/// Signals about L1 in the order in which they join.
const SIGNALS: [&str; 7] = ["GPS L1 C/A", "Galileo E1", "QZSS L1 C/A", "GPS L1C", "BeiDou B1C", "QZSS L1C", "NavIC L1"];

/// Work of a process with a scene.
#[derive(Clone, Copy)]
enum Work {
    /// Samples into nothing.
    Generate,
    /// Samples from a file.
    Receive,
    /// Generator, receiver, the judge and its pictures.
    Run,
}

/// One value of the quantity, and the scene there.
struct Case {
    x: f64,
    scene: String,
    duration_s: f64,
    /// Files that the scene names, beside it.
    files: Vec<(&'static str, String)>,
}

impl Case {
    fn new(x: f64, scene: String, duration_s: f64) -> Self {
        Self { x, scene, duration_s, files: Vec::new() }
    }
}

/// Ladders to be measured: title, quantity, expectation, and the cases of a work.
struct Plan {
    title: &'static str,
    x: &'static str,
    expected: &'static str,
    work: Work,
    cases: Vec<Case>,
    line_from: Option<f64>,
    is_log: bool,
}

pub fn ladders(room: &Path, is_wanted: &dyn Fn(&str) -> bool) -> Result<Vec<Ladder>, String> {
    let mut ladders = Vec::new();
    for plan in plans()? {
        if !is_wanted(plan.title) {
            continue;
        }
        let mut steps = Vec::new();
        for case in &plan.cases {
            steps.push(step(room, plan.work, case)?);
            eprintln!("{}: {:?}", plan.title, steps.last());
        }
        let (unit, Plan { title, x, expected, line_from, is_log, .. }) = ("s a second of signal", plan);
        ladders.push(Ladder { title: title.to_owned(), x, unit, expected, steps, line_from, is_log });
    }
    Ok(ladders)
}

/// Costs of one case: medians.
fn step(room: &Path, work: Work, case: &Case) -> Result<Step, String> {
    let scene = room.join("scene.toml");
    let write =
        |path: &Path, text: &str| std::fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()));
    write(&scene, &case.scene)?;
    for (name, text) in &case.files {
        write(&room.join(name), text)?;
    }
    let (samples, results) = (room.join("samples.sigmf-data"), room.join("results"));
    let text = |path: &Path| path.display().to_string();
    let (scene, samples_at, results_at) = (text(&scene), text(&samples), text(&results));
    let program = Path::new(env!("CARGO_BIN_EXE_gnss-twin"));
    if let Work::Receive = work {
        remove(&samples)?;
        spent(program, &["generate", &scene, "--allow-outside", "--out", &samples_at])?;
    }
    let mut found: Vec<Spent> = Vec::new();
    while found.len() < ROUNDS && found.last().is_none_or(|last| last.cpu_s < LONG_S) {
        remove(&results)?;
        let arguments: &[&str] = match work {
            Work::Generate => &["generate", &scene, "--allow-outside", "--out", "-", "--threads", "1"],
            Work::Receive => &["receive", &samples_at, "--out", &results_at, "--threads", "1"],
            Work::Run => &["run", &scene, "--allow-outside", "--out", &results_at, "--threads", "1"],
        };
        found.push(spent(program, arguments)?);
    }
    remove(&results)?;
    let cpu_s = median(&found.iter().map(|spent| spent.cpu_s).collect::<Vec<_>>()).unwrap_or(f64::NAN);
    let peak_mib = found.iter().map(|spent| spent.peak_mib).fold(0.0, f64::max);
    Ok(Step { x: case.x, cost: cpu_s / case.duration_s, peak_mib: Some(peak_mib) })
}

fn plans() -> Result<Vec<Plan>, String> {
    let shipped = |name: &str| {
        let path = Path::new("scenarios").join(name);
        std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let (open, wide) = (shipped("static.toml")?, shipped("full_sky.toml")?);
    let satellites = |duration_s: f64| -> Vec<Case> {
        let of =
            |count: usize| Case::new(count as f64, with_satellites(&lasting(&open, duration_s), count), duration_s);
        [1, 2, 4, 6, 8, 10, 12].map(of).into()
    };
    let rates = |duration_s: f64| -> Vec<Case> {
        let of = |msps: f64| {
            let rate = format!("sample_rate_hz = {}", msps * 1e6);
            Case::new(msps, lasting(&open, duration_s).replace("sample_rate_hz = 2.6e6", &rate), duration_s)
        };
        [2.6, 5.2, 10.4, 20.8, 41.6].map(of).into()
    };
    let signals = |duration_s: f64| -> Vec<Case> {
        let of = |count: usize| Case::new(count as f64, with_signals(&wide, count, duration_s), duration_s);
        (1..=SIGNALS.len()).map(of).collect()
    };
    let durations = |of: &[f64]| -> Vec<Case> {
        // From midnight, so that the day is all there.
        let day = open.replace("2010-07-01T08:05:58", "2010-07-01T00:00:00");
        of.iter().map(|&duration_s| Case::new(duration_s / 60.0, lasting(&day, duration_s), duration_s)).collect()
    };
    let rays = [0, 1, 2, 4, 8].map(|rays: usize| {
        let one =
            |ray: usize| format!("\n[[multipath]]\nkind = \"given\"\namplitude = 0.1\nexcess_m = {}\n", 10 * (ray + 1));
        let all: String = (0..rays).map(one).collect();
        Case::new(rays as f64, format!("{}{all}", lasting(&open, 20.0)), 20.0)
    });
    let rows = [1, 10, 100, 1000].map(moving);
    let plan =
        |title, x, expected, work, cases| Plan { title, x, expected, work, cases, line_from: Some(0.0), is_log: false };
    Ok(vec![
        plan(
            "generate, satellites",
            "satellites, 2.6 Msps, noise",
            "noise and packing once, then a line",
            Work::Generate,
            satellites(60.0),
        ),
        Plan {
            line_from: Some(4.0),
            ..plan(
                "receive, satellites",
                "satellites, 2.6 Msps",
                "the search and the file once, then a line; without the four of a fix searches for the others go on",
                Work::Receive,
                satellites(60.0),
            )
        },
        plan(
            "generate, rate",
            "Msps, twelve satellites, noise",
            "proportional to the rate",
            Work::Generate,
            rates(10.0),
        ),
        plan(
            "receive, rate",
            "Msps, twelve satellites",
            "proportional, but for the search and the loops",
            Work::Receive,
            rates(10.0),
        ),
        Plan {
            line_from: None,
            ..plan(
                "generate, signals",
                "signals about L1, 25 Msps, 11 to 36 satellites",
                "each with its own satellites and components: a sum, no line",
                Work::Generate,
                signals(4.0),
            )
        },
        Plan {
            line_from: None,
            ..plan(
                "receive, signals",
                "signals about L1, 25 Msps, first 2 s",
                "the first search is nearly all of it, and that of codes of 10 ms (from the fourth on) most",
                Work::Receive,
                signals(2.0),
            )
        },
        plan(
            "generate, rays",
            "reflected rays a satellite",
            "each as much as a satellite",
            Work::Generate,
            rays.into(),
        ),
        Plan {
            is_log: true,
            ..plan(
                "generate, motion",
                "rows of motion a second",
                "seven sights of each satellite a row, once rows are denser than the curves through them: a line",
                Work::Generate,
                rows.into(),
            )
        },
        Plan {
            is_log: true,
            ..plan(
                "generate, duration",
                "minutes, 2.6 Msps",
                "the same for every second, and constant memory",
                Work::Generate,
                durations(&[60.0, 240.0, 960.0, 3600.0, 14_400.0]),
            )
        },
        Plan {
            is_log: true,
            ..plan(
                "run, duration",
                "minutes, 2.6 Msps, judge and pictures",
                "the same for every second but for pictures and the search; memory that of the judge's rows",
                Work::Run,
                durations(&[60.0, 240.0, 960.0, 3600.0]),
            )
        },
    ])
}

fn lasting(scene: &str, duration_s: f64) -> String {
    scene.replace("duration_s = 60", &format!("duration_s = {duration_s}"))
}

fn with_satellites(scene: &str, count: usize) -> String {
    let out: Vec<String> = SATELLITES.iter().skip(count).map(|name| format!("\"{name}\"")).collect();
    scene.replace("mask_deg = 5", &format!("mask_deg = 5\nexclude = [{}]", out.join(", ")))
}

/// The first signals of the full sky, in its band about L1.
fn with_signals(scene: &str, count: usize, duration_s: f64) -> String {
    let names: Vec<String> = SIGNALS.iter().take(count).map(|name| format!("\"{name}\"")).collect();
    let (head, rest) = scene.split_once("signals = [").unwrap_or((scene, "]"));
    let rest = rest.split_once(']').map_or("", |(_, rest)| rest);
    let rest = rest.split("[[front_end]]").next().unwrap_or_default();
    let file = Path::new("scenarios/full_sky_2026-03-09_10h_12h.rnx");
    let whole = std::fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
    let rest = rest.replace("full_sky_2026-03-09_10h_12h.rnx", &whole.display().to_string());
    let front = "[front_end]\ncenter_hz = 1575.42e6\nsample_rate_hz = 25e6\nformat = \"ci8\"\n";
    lasting(&format!("{head}signals = [{}]{rest}{front}", names.join(", ")), duration_s)
}

/// A circle of 40 m once a minute, by so many rows a second.
fn moving(rows_a_second: usize) -> Case {
    const DURATION_S: f64 = 60.0;
    let mut table = String::from("time_s,latitude_deg,longitude_deg,height_m\n");
    for row in 0..=(rows_a_second as f64 * (DURATION_S + 4.0)) as usize {
        let time_s = row as f64 / rows_a_second as f64 - 2.0;
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * time_s / 60.0);
        let (north_deg, east_deg) = (3.6e-4 * sin, 4.0e-4 * cos);
        table += &format!("{time_s},{:.12},{:.12},130\n", 26.5123 + north_deg, 80.2329 + east_deg);
    }
    let scene = "name = \"moving\"\nstart = 2010-07-01T08:05:58\nduration_s = 60\nseed = 1\n\
        [motion]\nkind = \"file\"\nfile = \"growth.csv\"\nmax_gap_s = 1.5\n\
        [satellites]\nmask_deg = 5\n[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n\
        [power]\nkind = \"link_budget\"\n[noise]\n";
    let files = vec![("growth.csv", table)];
    Case { files, ..Case::new(rows_a_second as f64, scene.to_owned(), DURATION_S) }
}
