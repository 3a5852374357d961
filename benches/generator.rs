//! The generator's speed and memory against their bars: `cargo bench --bench generator` prints the rows of
//! `reports/performance.md` and, with `-- --write`, writes them there.
//!
//! Every rate is the whole generator (knots, truth, synthesis, rounding and packing) on one thread: processor
//! time of that thread, the median of interleaved runs. The end-to-end rows start the program itself on two
//! threads.

#[path = "shared/machine.rs"]
mod machine;
#[path = "shared/page.rs"]
mod page;

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use analysis::statistics::median;
use generator::scenario::{Overrides, Scenario};
use generator::scene::{Arithmetic, Fidelity, Grade, Scene};
use generator::stream::{Options, generate_with};
use generator::synth::chips::CodeTime;
use generator::synth::isa::{self, Level, add_noise};
use generator::synth::lanes::{Buffers, GROUP};
use generator::synth::noise::{BLOCK_SAMPLES, add_block_exact};
use generator::synth::waveform::plain;
use generator::synth::{CODE_ONE, Edge, Kernel, RUN_SAMPLES, Run};
use generator::transmit::{Scratch, Transmitter};
use generator::truth;
use gnss::gps::l1ca::L1_CA;
use gnss::samples::Format;
use gnss::satellite::Sv;

/// Nothing but a position: effects are added by name.
const BARE: &str = "name = \"bench\"\nstart = 2010-07-01T08:05:58\nseed = 1\n[motion]\nkind = \"static\"\n\
    latitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130\n";
const IONOSPHERE: &str = "[ionosphere]\nmodel = \"klobuchar\"\n";
const TROPOSPHERE: &str = "[troposphere]\nmodel = \"saastamoinen\"\n";
const CLOCK: &str = "[receiver_clock]\nbias_s = 1.3e-4\ndrift_sps = 5e-8\n";
const NOISE: &str = "[noise]\n";

/// Processor time of this thread in seconds, which other programs on the machine disturb less than the clock
/// on the wall; the latter where the system does not report it.
fn busy_s(start: Instant) -> f64 {
    let reported = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let ns = reported.and_then(|text| text.split_whitespace().next().and_then(|x| x.parse::<f64>().ok()));
    ns.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Vector operations of the fast kernel on a group of 32 samples of one satellite with AVX-512, counted in
/// its machine code.
const NEAREST_OPERATIONS: f64 = 26.0;
const AREA_OPERATIONS: f64 = 40.0;

/// Operations of 512 bits that a core begins in a cycle: Zen 4 has four vector pipes of 256 bits, Intel's
/// server cores two of 512.
const OPERATIONS_PER_CYCLE: f64 = 2.0;

/// One thing to time.
struct Case {
    name: String,
    scene: Scene,
}

impl Case {
    fn new(name: &str, tables: &str, grade: Grade, rate_hz: f64, seconds: f64, satellites: usize) -> Self {
        Self::at("08:05:58", name, tables, (grade, rate_hz), seconds, satellites)
    }

    /// A case as in [`Case::new`], from that time of 2010-07-01 on.
    fn at(
        time: &str,
        name: &str,
        tables: &str,
        (grade, rate_hz): (Grade, f64),
        seconds: f64,
        satellites: usize,
    ) -> Self {
        let bare = BARE.replace("08:05:58", time);
        let text = format!("duration_s = {seconds}\n{bare}{tables}[front_end]\nsample_rate_hz = {rate_hz}\n");
        let scenario = Scenario::parse(&text, "bench").unwrap();
        let (mut scene, _) = scenario.compose(Path::new("scenarios"), &Overrides::default()).unwrap();
        scene.fidelity = Fidelity::suited(grade, rate_hz, scene.fidelity.allowed_m, &scene.signals).unwrap();
        let up: Vec<Sv> = scene
            .catalogue
            .satellites()
            .filter(|sv| !scene.excluded.contains(sv) && truth::in_view(&scene, *sv, scene.clock.start).unwrap())
            .collect();
        assert!(up.len() >= satellites, "{} satellites in view", up.len());
        scene.excluded.extend(up.into_iter().skip(satellites));
        Self { name: name.to_owned(), scene }
    }

    /// Seconds for the whole scene.
    fn once(&self) -> f64 {
        let directory = tempfile::tempdir().unwrap();
        let mut writer = truth::Writer::create(directory.path()).unwrap();
        let start = Instant::now();
        let before_s = busy_s(start);
        generate_with(&self.scene, &mut std::io::sink(), &mut writer, &mut |_| (), &Options::default()).unwrap();
        busy_s(start) - before_s
    }
}

/// Median seconds of each case, run in turn on one thread.
fn medians(cases: &[Case], rounds: usize) -> Vec<f64> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut times = vec![Vec::new(); cases.len()];
    for _ in 0..rounds {
        for (times, case) in times.iter_mut().zip(cases) {
            times.push(one.install(|| case.once()));
        }
    }
    times.iter().map(|times| median(times).unwrap()).collect()
}

struct Line {
    figure: String,
    value: f64,
    unit: &'static str,
    /// Smallest, or with a minus sign largest, value wanted.
    bar: Option<f64>,
}

impl Line {
    fn new(figure: &str, value: f64, unit: &'static str, bar: Option<f64>) -> Self {
        let line = Self { figure: figure.to_owned(), value, unit, bar };
        println!("{}", line.text().trim_matches('|').replace('|', " | "));
        line
    }

    fn text(&self) -> String {
        let (bar, met) = match self.bar {
            None => (String::new(), ""),
            Some(bar) if bar < 0.0 => (format!("at most {}", -bar), if self.value <= -bar { "yes" } else { "no" }),
            Some(bar) => (format!("at least {bar}"), if self.value >= bar { "yes" } else { "no" }),
        };
        format!("|{}|{:.3}|{}|{bar}|{met}|", self.figure, self.value, self.unit)
    }
}

fn synthesis(lines: &mut Vec<Line>) {
    use Grade::{Balanced, Fast, Reference};
    let table: [(&str, &str, Grade, f64, f64, f64); 7] = [
        ("fast, noise-free, 2.6 Msps, ci8", "", Fast, 2.6e6, 20.0, 3.0),
        ("balanced, noise-free, 2.6 Msps, ci8", "", Balanced, 2.6e6, 20.0, 2.0),
        ("balanced, seeded noise, 2.6 Msps, ci8", NOISE, Balanced, 2.6e6, 20.0, 1.2),
        ("fast, noise-free, 25 Msps, ci8", "", Fast, 25e6, 2.0, 4.0),
        ("balanced, noise-free, 25 Msps, ci8", "", Balanced, 25e6, 2.0, 3.0),
        ("reference, noise-free, 2.6 Msps, ci8", "", Reference, 2.6e6, 3.0, 0.1),
        ("reference, noise-free, 25 Msps, ci8", "", Reference, 25e6, 0.3, 0.1),
    ];
    let cases: Vec<Case> =
        table.iter().map(|(name, tables, grade, rate, s, _)| Case::new(name, tables, *grade, *rate, *s, 11)).collect();
    for ((case, seconds), row) in cases.iter().zip(medians(&cases, 7)).zip(table) {
        let giga = case.scene.samples as f64 * 11.0 / seconds / 1e9;
        lines.push(Line::new(&case.name, giga, "G satellite·samples/s/core", Some(row.5)));
    }
}

/// Galileo E1 with CBOC on data and pilot: satellites count once, not once a component.
fn galileo(lines: &mut Vec<Line>) {
    const SATELLITES: usize = 8;
    let cases = [Grade::Fast, Grade::Balanced].map(|grade| {
        let name = format!("{}, Galileo E1 (CBOC, data and pilot), noise-free, 10 Msps, ci8", grade.name());
        let text = "name = \"bench\"\nstart = 2020-11-29T12:50:30\nduration_s = 2\nsignals = [\"Galileo E1\"]\n\
            [motion]\nkind = \"static\"\nlatitude_deg = 37.605\nlongitude_deg = -0.986\nheight_m = 60\n\
            [front_end]\nsample_rate_hz = 10e6\n";
        let scenario = Scenario::parse(text, "bench").unwrap();
        let (mut scene, _) = scenario.compose(Path::new("scenarios"), &Overrides::default()).unwrap();
        scene.fidelity = Fidelity::suited(grade, 10e6, scene.fidelity.allowed_m, &scene.signals).unwrap();
        let start = scene.clock.start;
        let up = scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv));
        let up: Vec<Sv> = up.filter(|sv| truth::in_view(&scene, *sv, start).unwrap()).collect();
        assert!(up.len() >= SATELLITES, "{} satellites in view", up.len());
        scene.excluded.extend(up.into_iter().skip(SATELLITES));
        Case { name, scene }
    });
    for ((case, seconds), bar) in cases.iter().zip(medians(&cases, 7)).zip([2.0, 1.2]) {
        let giga = case.scene.samples as f64 * SATELLITES as f64 / seconds / 1e9;
        lines.push(Line::new(&case.name, giga, "G satellite·samples/s/core", Some(bar)));
    }
}

/// Adds a block of noise.
type Add<'a> = &'a dyn Fn(u64, &mut [f32], &mut [f32]);

fn normals(lines: &mut Vec<Line>) {
    let (mut i, mut q) = (vec![0.0; BLOCK_SAMPLES], vec![0.0; BLOCK_SAMPLES]);
    let mut rate = |blocks: u64, add: Add<'_>| {
        let once = |_| {
            let start = Instant::now();
            let before_s = busy_s(start);
            (0..blocks).for_each(|block| add(block, &mut i, &mut q));
            (2 * blocks) as f64 * BLOCK_SAMPLES as f64 / (busy_s(start) - before_s) / 1e6
        };
        median(&(0..9).map(once).collect::<Vec<_>>()).unwrap()
    };
    let single = rate(20_000, &|block, i, q| add_noise(Level::detect(), 1, block, 1.0, i, q));
    let double = rate(1000, &|block, i, q| add_block_exact(1, block, 1.0, i, q));
    lines.push(Line::new("Gaussian noise", single, "M normals/s/core", Some(400.0)));
    lines.push(Line::new("Gaussian noise in f64", double, "M normals/s/core", None));
}

/// Packing and unpacking, a run at a time.
fn formats(lines: &mut Vec<Line>) {
    let i: Vec<f32> = (0..RUN_SAMPLES).map(|n| (n % 255) as f32 - 127.0).collect();
    let q: Vec<f32> = i.iter().rev().copied().collect();
    for format in [Format::Ci8, Format::Ci16Le] {
        let mut bytes = vec![0; RUN_SAMPLES * format.bytes()];
        let (mut back_i, mut back_q) = (Vec::new(), Vec::new());
        let packing = nanoseconds(|| {
            isa::pack(Level::detect(), format, black_box(&i), black_box(&q), &mut bytes);
        });
        let unpacking = nanoseconds(|| format.unpack(black_box(&bytes), &mut back_i, &mut back_q));
        for (what, ns) in [("packing", packing), ("unpacking", unpacking)] {
            let giga = RUN_SAMPLES as f64 / ns;
            lines.push(Line::new(&format!("{what} {format}, in cache"), giga, "G samples/s/core", None));
        }
    }
}

/// Median time of one call, in ns. A turn lasts about 0.1 s: the system reports processor time in steps of
/// milliseconds.
fn nanoseconds(mut call: impl FnMut()) -> f64 {
    (0..200).for_each(|_| call());
    let start = Instant::now();
    (0..200).for_each(|_| call());
    let calls = (20.0 / start.elapsed().as_secs_f64()) as usize + 1;
    let mut turn = |_| {
        let start = Instant::now();
        let before_s = busy_s(start);
        (0..calls).for_each(|_| call());
        (busy_s(start) - before_s) / calls as f64 * 1e9
    };
    median(&(0..9).map(&mut turn).collect::<Vec<_>>()).unwrap()
}

/// Profile of the time of a satellite's sample at 2.6 Msps, and the least time that the processor's
/// arithmetic allows.
fn profile() -> Vec<Line> {
    const SATELLITES: usize = 11;
    let level = Level::detect();
    let samples = (SATELLITES * RUN_SAMPLES) as f64;
    // Each line of xorshift is a shift and an exclusive or that wait for each other: six cycles a step.
    let mut x = 1_u64;
    let chain_ns = nanoseconds(|| {
        for _ in 0..1000 {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
        }
        black_box(x);
    });
    let clock_ghz = 6000.0 / chain_ns;
    let mut lines = vec![Line::new("clock, from a chain of six cycles", clock_ghz, "GHz", None)];
    let mut case = Case::new("", "", Grade::Balanced, 2.6e6, 1.0, SATELLITES);
    for (name, grade, edge, operations) in [
        ("nearest edges", Grade::Fast, Edge::Nearest, NEAREST_OPERATIONS),
        ("area edges", Grade::Balanced, Edge::Area, AREA_OPERATIONS),
    ] {
        case.scene.fidelity = Fidelity::of(grade);
        let mut transmitters: Vec<Transmitter> = (case.scene.catalogue.satellites())
            .filter(|sv| !case.scene.excluded.contains(sv))
            .filter_map(|sv| Transmitter::new(&case.scene, sv, &L1_CA, edge).unwrap())
            .collect();
        transmitters.iter_mut().for_each(|t| t.prepare(&case.scene, 0, RUN_SAMPLES as u64).unwrap());
        let mut scratch = Scratch::default();
        let (mut i, mut q) = (vec![0.0; RUN_SAMPLES], vec![0.0; RUN_SAMPLES]);
        let kernel = Kernel { edge, arithmetic: Arithmetic::F32, level };
        let both_ns = nanoseconds(|| {
            transmitters.iter().for_each(|t| t.arrange(&case.scene, 0, RUN_SAMPLES, &mut scratch));
            scratch.bank.render(kernel, &mut i, &mut q);
        });
        let mut bits = Vec::new();
        let step = (1.023 / 2.6 * CODE_ONE as f64) as u64;
        let spreading = plain(&L1_CA, 11).unwrap();
        let position = spreading.strip(CodeTime::new(0, 0), step, RUN_SAMPLES, |_| false, &mut bits);
        let run = Run {
            bits: &bits,
            position,
            step,
            turns: 1 << 60,
            turns_step: 0x0765_4321_0fed_cba9,
            amplitude: 0.3,
            pulse: None,
        };
        let mut buffers = Buffers::default();
        let kernel_ns = nanoseconds(|| {
            isa::accumulate(level, edge, black_box(&[&[run][..]; SATELLITES]), &mut i, &mut q, &mut buffers);
        });
        let unit = "ns a sample and satellite";
        lines.push(Line::new(&format!("{name}: gathering runs"), (both_ns - kernel_ns) / samples, unit, None));
        lines.push(Line::new(&format!("{name}: kernel"), kernel_ns / samples, unit, None));
        if level == Level::Avx512 {
            let limit_ns = operations / OPERATIONS_PER_CYCLE / GROUP as f64 / clock_ghz;
            lines.push(Line::new(&format!("{name}: limit of the kernel's arithmetic"), limit_ns, unit, None));
        }
    }
    lines
}

/// Runs the program on a scene: times real time of generator and receiver together (pictures apart), and the
/// most memory that it took, in MiB.
fn run(program: &Path, text: &str) -> Option<(f64, f64)> {
    let directory = tempfile::tempdir().ok()?;
    let scenario = directory.path().join("scene.toml");
    std::fs::write(&scenario, text).ok()?;
    let out = directory.path().join("out");
    let status = Command::new(program)
        .args(["run".as_ref(), scenario.as_os_str(), "--out".as_ref(), out.as_os_str()])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .status()
        .ok()?;
    let speed = std::fs::read_to_string(out.join("speed.json")).ok().filter(|_| status.success())?;
    let speed: serde_json::Value = serde_json::from_str(&speed).ok()?;
    Some((speed["run_x_real_time"].as_f64()?, speed["peak_memory_mib"].as_f64()?))
}

fn whole(lines: &mut Vec<Line>) {
    let program = Path::new("target/release/gnss-twin");
    if !program.exists() {
        println!("{} is not there: rows of the whole run left out", program.display());
        return;
    }
    let minute = std::fs::read_to_string("scenarios/static.toml").unwrap();
    let found: Vec<(f64, f64)> = (0..3).filter_map(|_| run(program, &minute)).collect();
    let of = |pick: fn(&(f64, f64)) -> f64| median(&found.iter().map(pick).collect::<Vec<_>>());
    if let (Some(realtime), Some(memory)) = (of(|x| x.0), of(|x| x.1)) {
        lines.push(Line::new("run, static scene, 60 s, two cores", realtime, "× real time", Some(40.0)));
        lines.push(Line::new("memory of that run", memory, "MiB", Some(-200.0)));
    }
    if let Some((realtime, memory)) = run(program, &minute.replace("duration_s = 60", "duration_s = 600")) {
        lines.push(Line::new("run, static scene, 600 s, two cores", realtime, "× real time", None));
        lines.push(Line::new("memory of that run (600 s)", memory, "MiB", Some(-200.0)));
    }
}

/// A source of interference as strong as a satellite with link budget.
fn jammer(kind: &str, keys: &str) -> String {
    format!("[[interference]]\nkind = \"{kind}\"\npower_dbw = -130\n{keys}")
}

/// Cost of each effect when it enters.
fn required(lines: &mut Vec<Line>) {
    let scenes = [
        ("bare", String::new()),
        ("+ ionosphere", IONOSPHERE.to_owned()),
        ("+ troposphere", format!("{IONOSPHERE}{TROPOSPHERE}")),
        ("+ receiver clock", format!("{IONOSPHERE}{TROPOSPHERE}{CLOCK}")),
        ("+ noise", format!("{IONOSPHERE}{TROPOSPHERE}{CLOCK}{NOISE}")),
        ("mask 60 deg, two satellites above it", "[satellites]\nmask_deg = 60\n".to_owned()),
        ("bare + a tone", jammer("cw", "")),
        ("bare + a chirp", jammer("chirp", "sweep_hz = 2e6\nsweep_s = 1e-5\n")),
        ("bare + sinusoidal FM", jammer("sine_fm", "deviation_hz = 1e6\nrate_hz = 1e4\n")),
        ("bare + a matched jammer", jammer("matched", "")),
        ("bare + noise of 1 MHz", jammer("noise", "bandwidth_hz = 1e6\n")),
    ];
    let mut cases: Vec<Case> = scenes
        .iter()
        .map(|(name, tables)| {
            let satellites = if name.starts_with("mask") { 2 } else { 11 };
            Case::new(name, tables, Grade::Balanced, 2.6e6, 10.0, satellites)
        })
        .collect();
    for satellites in [1, 2, 4, 8] {
        cases.push(Case::new(
            &format!("{satellites} of the satellites, bare"),
            "",
            Grade::Balanced,
            2.6e6,
            10.0,
            satellites,
        ));
    }
    for rate_msps in [5.2, 10.4, 20.8] {
        cases.push(Case::new(&format!("bare at {rate_msps} Msps"), "", Grade::Balanced, rate_msps * 1e6, 10.0, 11));
    }
    for seconds in [20.0, 40.0, 80.0] {
        cases.push(Case::new(&format!("bare for {seconds} s"), "", Grade::Balanced, 2.6e6, seconds, 11));
    }
    for (case, seconds) in cases.iter().zip(medians(&cases, 5)) {
        let ns = seconds * 1e9 / case.scene.samples as f64;
        lines.push(Line::new(&case.name, ns, "ns a sample, all satellites", None));
    }
}

/// Knots and messages of a minute at the beginning of a day, late in it, and at its end. Broadcast sets
/// change on even hours: in the last minute the orbit passes from one set to the next, so each evaluation is
/// two and the curve takes shorter polynomials; the first minute of the file has no set before, and 23:00 is
/// as far from a change as can be.
fn day(lines: &mut Vec<Line>) {
    let scene = Case::at("00:00:00", "day", "", (Grade::Balanced, 2.6e6), 86_400.0, 9).scene;
    let satellites: Vec<Sv> = scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)).collect();
    let stretch = 2600 * 60_000_u64;
    let minutes = [
        ("first minute of a day", 0),
        ("minute after 23:00", 2_600_000 * 3600 * 23),
        ("last minute of a day, sets changing", scene.samples - stretch),
    ];
    let mut times = minutes.map(|_| Vec::new());
    for _ in 0..5 {
        for (times, (_, from)) in times.iter_mut().zip(minutes) {
            let from = from / RUN_SAMPLES as u64 * RUN_SAMPLES as u64;
            let (mut count, mut seconds) = (0.0, 0.0);
            for sv in &satellites {
                let mut transmitter = Transmitter::new(&scene, *sv, scene.signals[0], Edge::Area).unwrap().unwrap();
                let start = Instant::now();
                transmitter.prepare(&scene, from, from + stretch).unwrap();
                if transmitter.in_view(&scene, from) {
                    (count, seconds) = (count + 1.0, seconds + start.elapsed().as_secs_f64());
                }
            }
            times.push(seconds / count * 1e3);
        }
    }
    for ((name, _), times) in minutes.iter().zip(times) {
        let name = format!("{name}: knots and messages of a satellite");
        lines.push(Line::new(&name, median(&times).unwrap(), "ms", None));
    }
}

/// Puts the figures into `reports/performance.md`.
fn publish(lines: &[Line], split: usize, profile: &[Line]) {
    const HEAD: &str = "|figure|value|unit|bar|met|\n|---|---|---|---|---|\n";
    let mut text = format!("{} ({:?}).\n\n{HEAD}", machine::machine(), Level::detect());
    for (index, line) in lines.iter().enumerate() {
        if index == split {
            let _ = write!(text, "\n### Only what the scene requires\n\n{HEAD}");
        }
        let _ = writeln!(text, "{}", line.text());
    }
    let mut shares = "|figure|value|unit|\n|---|---|---|\n".to_owned();
    for line in profile {
        let _ = writeln!(shares, "|{}|{:.3}|{}|", line.figure, line.value, line.unit);
    }
    for (mark, text) in [("generator", text), ("profile", shares)] {
        page::put(mark, &text).expect("the page and its marks");
    }
}

fn main() {
    let mut lines = Vec::new();
    let profile = profile();
    synthesis(&mut lines);
    galileo(&mut lines);
    normals(&mut lines);
    formats(&mut lines);
    whole(&mut lines);
    let split = lines.len();
    required(&mut lines);
    day(&mut lines);
    if std::env::args().any(|argument| argument == "--write") {
        publish(&lines, split, &profile);
    }
}
