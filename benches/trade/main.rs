//! Fills `reports/trade.md`, its tables and its pictures: what accuracy costs, for every signal, for whole
//! scenes and for the knobs of both sides. Run alone: `cargo bench --bench trade`; `-- --signals NAME` and
//! `-- --scenes NAME` print rows of some, `-- --dopplers` those of moving codes; `-- --costs FILE` writes the
//! table that `plan` reads, `-- --widths` the page of the widths of samples.
//!
//! Errors of the generator's knobs are measured without noise and without rounding, one satellite at a
//! time, by correlating its samples with those of the `reference` level: prompt, and half a chip apart for
//! the code, whose discriminator is calibrated with a reference moved by 0.02 chip. Costs are medians of
//! interleaved runs.

#[path = "../../tests/common/lines.rs"]
mod lines;
#[path = "../shared/machine.rs"]
mod machine;
mod page;
mod scenes;
mod signals;
mod widths;

use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;

use analysis::show::trade::{self, TradeRow};
use analysis::statistics::{mean, median};
use fft::Planner;
use generator::fidelity::allowed_m;
use generator::ray::{Effect, Ray, Sight};
use generator::scenario::{Overrides, Scenario};
use generator::scene::{Arithmetic, CodeEdge, Fidelity, Grade, Scene};
use generator::stream::{Options, generate_with};
use generator::truth;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use num_complex::Complex;

const CHIP_S: f64 = 1.0 / 1.023e6;
const CHIP_M: f64 = 299_792_458.0 * CHIP_S;

/// Moves the code and leaves the carrier.
struct Moved(f64);

impl Effect for Moved {
    fn name(&self) -> &'static str {
        "moved code"
    }

    fn describe(&self) -> String {
        format!("{} chips", self.0)
    }

    fn act(&self, _: &Sight, _: &Signal, rays: &mut Vec<Ray>) {
        rays.iter_mut().for_each(|ray| ray.code_delay_s += self.0 * CHIP_S);
    }
}

/// Scene, start and duration of a setting's measurement.
#[derive(Clone, Copy)]
struct Site {
    scene: &'static str,
    text: &'static str,
    start: &'static str,
    rate_msps: f64,
    /// Seconds of samples for errors and for time.
    error_s: f64,
    time_s: f64,
    /// Replacements in the text.
    change: (&'static str, &'static str),
    /// Tables after the replacements.
    tables: &'static str,
}

const STATIC: Site = Site {
    scene: "static",
    text: include_str!("../../scenarios/static.toml"),
    start: "2010-07-01T08:05:58",
    rate_msps: 2.6,
    error_s: 3.0,
    time_s: 6.0,
    change: ("", ""),
    tables: "",
};

/// The boost of the rocket, which begins at once and ends with the scene.
const BOOST: Site = Site {
    scene: "boost",
    text: include_str!("../../scenarios/high_dynamics.toml"),
    change: ("ignition_s = 40", "ignition_s = 0.3"),
    ..STATIC
};

fn scene(site: Site, fidelity: Fidelity, seconds: f64, format: &str, noise: bool) -> Scene {
    let mut text = site.text.replace(site.change.0, site.change.1);
    for (key, value) in [
        ("start", site.start.to_owned()),
        ("duration_s", format!("{seconds}")),
        ("sample_rate_hz", format!("{}", site.rate_msps * 1e6)),
        ("format", format!("\"{format}\"")),
    ] {
        let line = text.lines().find(|line| line.starts_with(&format!("{key} = "))).unwrap_or("").to_owned();
        text = text.replace(&line, &format!("{key} = {value}"));
    }
    text.push_str(site.tables);
    let scenario = Scenario::parse(&text, site.scene).unwrap();
    let (mut scene, _) = scenario.compose(Path::new("scenarios"), &Overrides::default()).unwrap();
    (scene.fidelity, scene.noise) = (fidelity, noise);
    scene
}

/// Samples of one satellite, its code moved by so many chips.
fn samples(site: Site, fidelity: Fidelity, sv: Sv, chips: f64) -> Vec<Complex<f32>> {
    let mut scene = scene(site, fidelity, site.error_s, "cf32", false);
    scene.excluded = scene.catalogue.satellites().filter(|other| *other != sv).collect();
    if chips != 0.0 {
        scene.effects.push(Box::new(Moved(chips)));
    }
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    generate_with(&scene, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap();
    let component = |x: &[u8]| f32::from_le_bytes([x[0], x[1], x[2], x[3]]);
    bytes.chunks_exact(8).map(|x| Complex::new(component(&x[..4]), component(&x[4..]))).collect()
}

/// Correlations by milliseconds.
fn correlate(a: &[Complex<f32>], b: &[Complex<f32>], length: usize) -> Vec<Complex<f64>> {
    let wide = |x: &Complex<f32>| Complex::new(f64::from(x.re), f64::from(x.im));
    let sum = |(a, b): (&[Complex<f32>], &[Complex<f32>])| a.iter().zip(b).map(|(a, b)| wide(a) * wide(b).conj()).sum();
    a.chunks_exact(length).zip(b.chunks_exact(length)).map(sum).collect()
}

/// Sums of twenty.
fn pieces(z: &[Complex<f64>]) -> Vec<Complex<f64>> {
    z.chunks_exact(20).map(|z| z.iter().sum()).collect()
}

/// Reference replicas of one satellite.
struct Replicas {
    sv: Sv,
    prompt: Vec<Complex<f32>>,
    early: Vec<Complex<f32>>,
    late: Vec<Complex<f32>>,
    power: f64,
    /// The discriminator of the reference itself, by pieces, and its slope a chip.
    zero: Vec<f64>,
    slope: f64,
}

impl Replicas {
    fn new(site: Site, sv: Sv) -> Self {
        let reference = Fidelity::of(Grade::Reference);
        let [prompt, early, late] = [0.0, -0.25, 0.25].map(|chips| samples(site, reference, sv, chips));
        let power = prompt.iter().map(|x| f64::from(x.norm_sqr())).sum();
        let mut replicas = Self { sv, prompt, early, late, power, zero: Vec::new(), slope: 1.0 };
        replicas.zero = replicas.discriminator(&replicas.prompt, site);
        let moved = replicas.discriminator(&samples(site, reference, sv, 0.02), site);
        let steps: Vec<f64> = moved.iter().zip(&replicas.zero).map(|(a, b)| (a - b) / 0.02).collect();
        replicas.slope = mean(&steps).unwrap();
        replicas
    }

    fn discriminator(&self, samples: &[Complex<f32>], site: Site) -> Vec<f64> {
        let length = (site.rate_msps * 1e3) as usize;
        let against = |replica: &[Complex<f32>]| pieces(&correlate(samples, replica, length));
        let prompts = against(&self.prompt);
        let both = against(&self.early).into_iter().zip(against(&self.late));
        both.zip(prompts).map(|((e, l), p)| ((l - e) * p.conj()).re / p.norm_sqr()).collect()
    }
}

#[derive(Default)]
struct Errors {
    mean_m: f64,
    sigma_m: f64,
    max_m: f64,
    carrier_cycles: f64,
    doppler_hz: f64,
    spur_dbc: f64,
    loss_db: f64,
}

fn errors(site: Site, fidelity: Fidelity, all: &[Replicas]) -> Errors {
    let mut worst = Errors { spur_dbc: -300.0, ..Errors::default() };
    let mut variances = Vec::new();
    let mut losses = Vec::new();
    let length = (site.rate_msps * 1e3) as usize;
    for replicas in all {
        let tested = samples(site, fidelity, replicas.sv, 0.0);
        let z = correlate(&tested, &replicas.prompt, length);
        let code: Vec<f64> = replicas
            .discriminator(&tested, site)
            .iter()
            .zip(&replicas.zero)
            .map(|(d, zero)| (d - zero) / replicas.slope * CHIP_M)
            .collect();
        let middle = mean(&code).unwrap();
        worst.mean_m = worst.mean_m.max(middle.abs());
        variances.extend(code.iter().map(|x| (x - middle).powi(2)));
        worst.max_m = code.iter().fold(worst.max_m, |w, x| w.max(x.abs()));
        worst.carrier_cycles = z.iter().fold(worst.carrier_cycles, |w, z| w.max(z.arg().abs() / TAU));
        for pair in pieces(&z).windows(2) {
            worst.doppler_hz = worst.doppler_hz.max((pair[1] * pair[0].conj()).arg().abs() / TAU / 0.02);
        }
        let amplitude = z.iter().map(|z| z.norm()).sum::<f64>() / replicas.power;
        losses.push(-20.0 * libm::log10(amplitude));
        // The carrier alone: against the same edges in f64, where the code is not near zero.
        let exact = Fidelity { code_edge: fidelity.code_edge, ..Fidelity::of(Grade::Reference) };
        let base = samples(site, exact, replicas.sv, 0.0);
        worst.spur_dbc = worst.spur_dbc.max(spur_dbc(&tested, &base));
    }
    worst.sigma_m = mean(&variances).unwrap().sqrt();
    worst.loss_db = mean(&losses).unwrap();
    worst
}

/// The strongest line of `tested / base` beside the one at zero, by a Blackman-Harris window.
fn spur_dbc(tested: &[Complex<f32>], base: &[Complex<f32>]) -> f64 {
    const LENGTH: usize = 1 << 20;
    let amplitude = (base.iter().map(|x| f64::from(x.norm_sqr())).sum::<f64>() / base.len() as f64).sqrt();
    let mut last = Complex::new(1.0, 0.0);
    let mut buffer: Vec<Complex<f64>> = tested
        .iter()
        .zip(base)
        .take(LENGTH)
        .enumerate()
        .map(|(n, (t, b))| {
            let (t, b) =
                (Complex::new(f64::from(t.re), f64::from(t.im)), Complex::new(f64::from(b.re), f64::from(b.im)));
            // Near an edge the waveform passes through zero and says nothing of the carrier.
            if b.norm() > 0.5 * amplitude {
                last = t / b;
            }
            let x = TAU * n as f64 / LENGTH as f64;
            let [a, b, c] = [1.0, 2.0, 3.0].map(|k| libm::cos(k * x));
            let window = 0.358_75 - 0.488_29 * a + 0.141_28 * b - 0.011_68 * c;
            last * window
        })
        .collect();
    buffer.resize(LENGTH, Complex::new(0.0, 0.0));
    Planner::<f64>::new().plan_fft_forward(LENGTH).process(&mut buffer);
    let carrier = buffer[0].norm();
    let spur = buffer[8..LENGTH - 8].iter().map(|x| x.norm()).fold(0.0, f64::max);
    20.0 * libm::log10((spur / carrier).max(1e-15))
}

/// Processor time of this thread in seconds, which other programs on the machine disturb less than the clock
/// on the wall; the latter where the system does not report it.
fn busy_s(start: Instant) -> f64 {
    let reported = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let ns = reported.and_then(|text| text.split_whitespace().next().and_then(|x| x.parse::<f64>().ok()));
    ns.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Time of the whole generator for one sample of one satellite.
fn once_ns(site: Site, fidelity: Fidelity) -> f64 {
    let scene = scene(site, fidelity, site.time_s, "ci8", false);
    let directory = tempfile::tempdir().unwrap();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let start = Instant::now();
    let before_s = busy_s(start);
    let done = generate_with(&scene, &mut std::io::sink(), &mut writer, &mut |_| (), &Options::default()).unwrap();
    (busy_s(start) - before_s) * 1e9 / (done.samples as f64 * done.satellites.len() as f64)
}

/// The levels, then every edge in both arithmetics that no level takes.
fn settings(rate_msps: f64) -> Vec<(String, Fidelity)> {
    let mut found: Vec<(String, Fidelity)> = Grade::NAMES
        .iter()
        .filter(|(_, grade)| grade.is_sampled())
        .map(|(name, grade)| {
            ((*name).to_owned(), Fidelity::suited(*grade, rate_msps * 1e6, allowed_m(None), &[&L1_CA]).unwrap())
        })
        .collect();
    for (carrier_name, carrier) in Arithmetic::NAMES {
        for (edge_name, code_edge) in CodeEdge::NAMES {
            if !found.iter().any(|(_, f)| f.carrier == carrier && f.code_edge == code_edge) {
                let grade = if carrier == Arithmetic::F32 { Grade::Balanced } else { Grade::Reference };
                found.push((
                    format!("{edge_name}, {carrier_name}"),
                    Fidelity { carrier, code_edge, ..Fidelity::of(grade) },
                ));
            }
        }
    }
    found
}

/// Band-limited edges with knots of every tolerance.
fn tolerances() -> Vec<(String, Fidelity)> {
    let base = Fidelity { code_edge: CodeEdge::BandLimited, ..Fidelity::of(Grade::Balanced) };
    let mut found: Vec<(String, Fidelity)> = [1e-2, 1e-3, 4e-4, 1e-4, 1e-5, 1e-6]
        .into_iter()
        .map(|tolerance| (format!("knots {tolerance:e}"), Fidelity { knot_tolerance_cycles: tolerance, ..base }))
        .collect();
    found.push(("reference".to_owned(), Fidelity::of(Grade::Reference)));
    found
}

fn measure(site: Site, settings: &[(String, Fidelity)], rounds: usize, count: usize, rows: &mut Vec<TradeRow>) {
    let mut times = vec![Vec::new(); settings.len()];
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for _ in 0..rounds {
        for (times, (_, fidelity)) in times.iter_mut().zip(settings) {
            times.push(one.install(|| once_ns(site, *fidelity)));
        }
    }
    let first = scene(site, Fidelity::of(Grade::Reference), 1.0, "cf32", false);
    let up: Vec<Sv> = first
        .catalogue
        .satellites()
        .filter(|sv| !first.excluded.contains(sv) && truth::in_view(&first, *sv, first.clock.start).unwrap())
        .collect();
    // From all over the sky: their Doppler differs.
    let replicas: Vec<Replicas> =
        up.iter().step_by((up.len() / count).max(1)).take(count).map(|sv| Replicas::new(site, *sv)).collect();
    for ((name, fidelity), times) in settings.iter().zip(times) {
        let found = errors(site, *fidelity, &replicas);
        let row = TradeRow {
            scene: site.scene.to_owned(),
            sample_rate_msps: site.rate_msps,
            setting: name.clone(),
            code_edge: fidelity.code_edge.name().to_owned(),
            carrier: fidelity.carrier.name().to_owned(),
            knot_tolerance_cycles: fidelity.knot_tolerance_cycles,
            ns: median(&times).unwrap(),
            pseudorange_mean_m: found.mean_m,
            pseudorange_sigma_m: found.sigma_m,
            pseudorange_max_m: found.max_m,
            carrier_cycles: found.carrier_cycles,
            doppler_hz: found.doppler_hz,
            spur_dbc: found.spur_dbc,
            cn0_loss_db: found.loss_db,
        };
        println!("{} {} Msps | {row}", row.scene, row.sample_rate_msps);
        rows.push(row);
    }
}

fn knobs(reports: &Path) -> String {
    let mut rows = Vec::new();
    measure(STATIC, &settings(STATIC.rate_msps), 3, 3, &mut rows);
    measure(BOOST, &tolerances(), 3, 3, &mut rows);
    trade::write(reports, &rows).unwrap();
    let text = "\n## Knobs of the generator, GPS L1 C/A\n\n\
        ![Pareto front](trade.png)\n\n\
        Each row is one setting of `[fidelity]`. Errors are against the `reference` level, without noise and rounding, \
        over pieces of 20 ms (carrier: 1 ms) of three satellites: the mean is the largest of a satellite, σ is about \
        the means, the last is the largest. ns are the whole generator's for a sample of a satellite with truth and \
        rounding to 8 bits, medians of three interleaved runs. Settings that no other beats in cost and pseudorange \
        error are on the front. Widths of samples and qualities of noise have [a page of their own](widths.md).\n";
    format!("{text}{}", trade::tables(&rows))
}

/// The argument after a word, where the word is there.
fn asked(word: &str) -> Option<String> {
    let all: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let at = all.iter().position(|argument| argument == word)?;
    Some(all.get(at + 1).cloned().unwrap_or_default())
}

fn main() {
    let reports = Path::new("reports");
    if asked("--widths").is_some() {
        return trade::write_widths(reports, &widths::measure(), &format!("{}.", machine::machine())).unwrap();
    }
    if let Some(name) = asked("--signals") {
        return drop(signals::measure(&name));
    }
    if let Some(path) = asked("--costs") {
        return page::write_costs(Path::new(&path), &signals::measure(""));
    }
    if asked("--dopplers").is_some() {
        return drop(signals::dopplers());
    }
    if let Some(name) = asked("--scenes") {
        return drop(scenes::measure(&name));
    }
    let found = signals::measure("");
    let knobs = knobs(reports);
    page::write(reports, &found, &signals::dopplers(), &scenes::measure(""), &knobs);
}
