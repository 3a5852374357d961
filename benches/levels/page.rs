//! The page `reports/levels.md`, its table and its picture.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use analysis::show::plot::canvas::{Axis, BLUE, Chart, GREY, Mark, ORANGE, Series, figure};
use analysis::statistics::{mean, std};
use serde::Serialize;

use super::compare::{LEVEL, Pair, Tested, exceeding, least_probability, probability, tested};
use super::machine;
use super::runs::{Row, SEEDS_PER_SEED, SITES};

/// Figures of the table of means, with the digits of their values.
const MAIN: [(&str, usize); 7] = [
    ("time to first fix", 1),
    ("pseudorange, sigma", 3),
    ("carrier phase, sigma", 4),
    ("C/N0, mean error", 3),
    ("C/N0, sigma", 3),
    ("horizontal error, 95 %", 3),
    ("Doppler, sigma", 3),
];

/// Standard errors between means that are worth a line.
const FAR: f64 = 3.5;

/// Reasons of differences that are known: what the figure's name begins with, and the reason.
const REASONS: [(&str, &str); 0] = [];

/// Runs of a scene at one level: their number and the processor's seconds for a simulated second.
struct Cost {
    runs: usize,
    ratio: f64,
}

/// A line of `levels.csv`.
#[derive(Serialize)]
struct Line<'p> {
    scene: &'p str,
    figure: &'p str,
    unit: &'p str,
    runs_samples: usize,
    runs_correlations: usize,
    mean_samples: f64,
    mean_correlations: f64,
    sigma_samples: f64,
    sigma_correlations: f64,
    deviate_location: f64,
    deviate_spread: f64,
    differs: bool,
}

/// Writes the page from all runs.
pub fn write(directory: &Path, rows: &[Row]) {
    let pairs = pairs(rows);
    let tested = tested(&pairs);
    let costs = costs(rows);
    let mut text = head(&tested, costs.len());
    cost_table(&mut text, &costs, &tested);
    mean_table(&mut text, &pairs);
    differences(&mut text, &tested);
    means_apart(&mut text, &pairs);
    together(&mut text, &tested);
    text.push_str(
        "\n## What this page does not hold\n\n\
         - Scenes that the level refuses by name.\n\
         - Scenes are shorter here than in `scenarios/`, as the first table says.\n\
         - The spectrum of the samples is not compared: `correlations` has none.\n\
         - Distances from a median of few seeds are short, so deviates of spread lie above the line in the picture. \
         More seeds remove that.\n\
         - Costs belong to this processor. The judge's time is not in them.\n\
         - A difference below the sampling error of these seeds is not found. Fewer seeds than `SITES` has for a scene \
         mean that the command was given less time.\n",
    );
    std::fs::write(directory.join("levels.md"), text).unwrap();
    table(&directory.join("levels.csv"), &tested);
    draw(&directory.join("levels.png"), &costs, &tested);
}

/// Values of every figure of a scene that both levels have in all their runs.
fn pairs(rows: &[Row]) -> Vec<Pair> {
    let mut all: BTreeMap<(usize, &str), Pair> = BTreeMap::new();
    for row in rows {
        let Some(place) = SITES.iter().position(|site| site.name == row.scene) else { continue };
        let pair = all.entry((place, &row.figure)).or_insert_with(|| Pair {
            scene: row.scene.clone(),
            figure: row.figure.clone(),
            unit: row.unit.clone(),
            samples: Vec::new(),
            modelled: Vec::new(),
        });
        if row.level == "samples" { &mut pair.samples } else { &mut pair.modelled }.push(row.value);
    }
    all.into_values().filter(|pair| pair.samples.len() > 1 && pair.modelled.len() > 1 && pair.varies()).collect()
}

/// Costs of the scenes at both levels, in the order of [`SITES`].
fn costs(rows: &[Row]) -> Vec<(&'static str, f64, [Cost; 2])> {
    let of = |name: &str, level: &str| {
        let mut runs: BTreeMap<u64, f64> = BTreeMap::new();
        for row in rows.iter().filter(|row| row.scene == name && row.level == level) {
            runs.insert(row.seed, row.processor_s / row.simulated_s);
        }
        let all: Vec<f64> = runs.into_values().collect();
        Some(Cost { runs: all.len(), ratio: mean(&all)? })
    };
    let both = |name| Some([of(name, "samples")?, of(name, "correlations")?]);
    SITES.iter().filter_map(|site| Some((site.name, site.seconds, both(site.name)?))).collect()
}

fn head(tested: &[Tested<'_>], scenes: usize) -> String {
    let differing: usize = tested.iter().map(|one| one.differs.iter().filter(|is| **is).count()).sum();
    let least = tested.iter().map(|one| least_probability(one.pair)).fold(0.0, f64::max);
    let needed = LEVEL / (2.0 * tested.len() as f64);
    let power = if least > needed {
        format!(
            "\n**Too few seeds:** the smallest probability that every single test can have is {least:.0e}, and Holm's \
             procedure asks for {needed:.0e}. With these seeds differences show in the means and in the sums over \
             scenes below alone.\n"
        )
    } else {
        String::new()
    };
    format!(
        "# Levels of the twin: samples and correlations\n\n\
         Every scene runs with the same receiver and the same judge at both levels. `cargo bench --bench levels` makes \
         this page, its table and its picture.\n\n\
         {}.\n\n\
         The level `samples` has the seeds 1, 2, 3 and so on, the level `correlations` {SEEDS_PER_SEED} other seeds \
         for each of them. A figure of the verdict has a distribution at each level. Two rank tests compare both: of \
         the values (location), and of their distances from the level's median (spread). All tests together have a \
         probability of {:.0} % to find a difference where there is none (Holm). Figures that are equal in all runs, \
         or that differ by rounding alone, are not tested.\n\n\
         **{scenes} scenes, {} figures, {} tests: {differing} differences.**\n{power}\n\
         ![Cost and agreement of the levels](levels.png)\n",
        machine::machine(),
        100.0 * LEVEL,
        tested.len(),
        2 * tested.len(),
    )
}

fn cost_table(text: &mut String, costs: &[(&str, f64, [Cost; 2])], tested: &[Tested<'_>]) {
    text.push_str(
        "\n## Cost\n\nProcessor time of generator and receiver for a simulated second, mean over the seeds.\n\n\
         | scene | simulated (s) | seeds | samples (s) | correlations (s) | ratio | figures | differences |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for (name, seconds, [samples, modelled]) in costs {
        let own = || tested.iter().filter(|one| one.pair.scene == *name);
        let differing: usize = own().map(|one| one.differs.iter().filter(|is| **is).count()).sum();
        let _ = writeln!(
            text,
            "| `{name}` | {seconds} | {}, {} | {:.4} | {:.4} | {:.1} | {} | {differing} |",
            samples.runs,
            modelled.runs,
            samples.ratio,
            modelled.ratio,
            samples.ratio / modelled.ratio,
            own().count()
        );
    }
}

fn mean_table(text: &mut String, pairs: &[Pair]) {
    text.push_str(
        "\n## Main figures\n\nMeans over the seeds with their standard errors: samples, then correlations.\n\n",
    );
    let _ = writeln!(text, "| scene | {} |", MAIN.map(|(name, _)| name).join(" | "));
    let _ = writeln!(text, "| --- |{}", " --- |".repeat(MAIN.len()));
    let shown = |all: &[f64], digits: usize| {
        let error = std(all).unwrap_or(0.0) / (all.len() as f64).sqrt();
        format!("{:.digits$} ± {error:.digits$}", mean(all).unwrap_or(f64::NAN))
    };
    for site in &SITES {
        let own: Vec<&Pair> = pairs.iter().filter(|pair| pair.scene == site.name).collect();
        if own.is_empty() {
            continue;
        }
        let cell = |(name, digits): (&str, usize)| {
            let found = own.iter().find(|pair| pair.figure == name);
            found.map_or_else(
                || "equal".to_owned(),
                |pair| format!("{}, {}", shown(&pair.samples, digits), shown(&pair.modelled, digits)),
            )
        };
        let _ = writeln!(text, "| `{}` | {} |", site.name, MAIN.map(cell).join(" | "));
    }
}

/// A number with three significant digits.
fn short(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e4).contains(&size) => {
            let digits = (2 - libm::log10(size).floor() as i32).max(0) as usize;
            format!("{x:.digits$}")
        }
        _ => format!("{x:.2e}"),
    }
}

fn reason(figure: &str) -> &'static str {
    REASONS.iter().find(|(begin, _)| figure.starts_with(begin)).map_or("not known", |(_, reason)| reason)
}

fn differences(text: &mut String, tested: &[Tested<'_>]) {
    text.push_str("\n## Differences\n\n");
    let own: Vec<&Tested<'_>> = tested.iter().filter(|one| one.differs.contains(&true)).collect();
    if own.is_empty() {
        text.push_str("No test of a single scene's figure finds one.\n");
        return;
    }
    text.push_str(
        "| scene | figure | unit | samples | correlations | difference | what differs | deviates | reason |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for Tested { pair, deviates, differs } in own {
        let (apart, error) = pair.apart();
        let what: Vec<&str> =
            ["location", "spread"].into_iter().zip(differs).filter(|(_, is)| **is).map(|(name, _)| name).collect();
        let shown = |all: &[f64]| format!("{} ± {}", short(mean(all).unwrap_or(0.0)), short(std(all).unwrap_or(0.0)));
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} | {} | {} ± {} | {} | {:.1}, {:.1} | {} |",
            pair.scene,
            pair.figure,
            pair.unit,
            shown(&pair.samples),
            shown(&pair.modelled),
            short(apart),
            short(error),
            what.join(", "),
            deviates[0],
            deviates[1],
            reason(&pair.figure)
        );
    }
    text.push_str("\nValues are means with the spread of single runs; a difference has its standard error.\n");
}

/// Main figures whose means are far apart, which few seeds show before ranks do.
fn means_apart(text: &mut String, pairs: &[Pair]) {
    let _ = writeln!(
        text,
        "\n### Means of main figures that are more than {FAR} standard errors apart\n\n\
         They are no tests: of a few seeds a standard error is itself uncertain.\n\n\
         | scene | figure | unit | correlations less samples |\n| --- | --- | --- | --- |"
    );
    for pair in pairs.iter().filter(|pair| MAIN.iter().any(|(name, _)| *name == pair.figure)) {
        let (apart, error) = pair.apart();
        if apart.abs() > FAR * error {
            let Pair { scene, figure, unit, .. } = pair;
            let _ = writeln!(text, "| `{scene}` | {figure} | {unit} | {} ± {} |", short(apart), short(error));
        }
    }
}

/// Figures whose differences add up over the scenes.
fn together(text: &mut String, tested: &[Tested<'_>]) {
    let mut all: BTreeMap<&str, Vec<&Tested<'_>>> = BTreeMap::new();
    tested.iter().for_each(|one| all.entry(&one.pair.figure).or_default().push(one));
    let all: Vec<(&str, Vec<&Tested<'_>>)> = all.into_iter().filter(|(_, own)| own.len() > 1).collect();
    let sum = |own: &[&Tested<'_>]| own.iter().map(|one| one.deviates[0]).sum::<f64>() / (own.len() as f64).sqrt();
    let deviates: Vec<f64> = all.iter().map(|(_, own)| sum(own)).collect();
    let probabilities: Vec<f64> = deviates.iter().copied().map(probability).collect();
    text.push_str(
        "\n## All scenes together\n\nA difference too small for one scene's seeds adds up over scenes. The deviates of \
         location of a figure have a sum over the scenes, whose own deviate is held to 1 % in the family of all \
         figures (Holm).\n\n",
    );
    let found = exceeding(&probabilities);
    if found.is_empty() {
        let _ = writeln!(text, "None of {} figures differs.", all.len());
        return;
    }
    text.push_str(
        "| figure | unit | scenes | deviate | probability | least and largest mean difference | reason |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for number in found {
        let (name, own) = &all[number];
        let apart = || own.iter().map(|one| one.pair.apart().0);
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {:.1} | {:.0e} | {} to {} | {} |",
            own[0].pair.unit,
            own.len(),
            deviates[number],
            probabilities[number],
            short(apart().fold(f64::MAX, f64::min)),
            short(apart().fold(f64::MIN, f64::max)),
            reason(name)
        );
    }
}

fn table(path: &Path, tested: &[Tested<'_>]) {
    let mut file = csv::Writer::from_path(path).unwrap();
    let round = |value: f64| format!("{value:.5e}").parse::<f64>().unwrap_or(value);
    for Tested { pair, deviates, differs } in tested {
        let line = Line {
            scene: &pair.scene,
            figure: &pair.figure,
            unit: &pair.unit,
            runs_samples: pair.samples.len(),
            runs_correlations: pair.modelled.len(),
            mean_samples: round(mean(&pair.samples).unwrap_or(f64::NAN)),
            mean_correlations: round(mean(&pair.modelled).unwrap_or(f64::NAN)),
            sigma_samples: round(std(&pair.samples).unwrap_or(0.0)),
            sigma_correlations: round(std(&pair.modelled).unwrap_or(0.0)),
            deviate_location: round(deviates[0]),
            deviate_spread: round(deviates[1]),
            differs: differs.contains(&true),
        };
        file.serialize(line).unwrap();
    }
    file.flush().unwrap();
}

/// Costs of the scenes, and deviates of the tests against those of a normal law.
fn draw(path: &Path, costs: &[(&str, f64, [Cost; 2])], tested: &[Tested<'_>]) {
    let of = |level: usize| -> Vec<(f64, f64)> {
        let point = |(place, (_, _, both)): (usize, &(&str, f64, [Cost; 2]))| {
            (libm::log10(both[level].ratio), (costs.len() - place) as f64)
        };
        costs.iter().enumerate().map(point).collect()
    };
    let names = costs.iter().enumerate().map(|(place, (name, ..))| ((costs.len() - place) as f64, (*name).to_owned()));
    let ends = || [0, 1].into_iter().flat_map(of).map(|(x, _)| x);
    let x = Axis::around("processor time for a simulated second (s)", ends(), 0.5).logarithmic();
    let y = Axis::new("", (0.0, costs.len() as f64 + 1.0)).named(names.collect());
    let series = [("samples", GREY, 0), ("correlations", BLUE, 1)];
    let cost = series.map(|(name, colour, level)| Series::new(name, colour, Mark::Balls, of(level)));
    let cost = Chart::new("cost", x, y, cost.into());
    let quantiles = |which: usize| {
        let mut all: Vec<f64> = tested.iter().map(|one| one.deviates[which]).collect();
        all.sort_by(f64::total_cmp);
        let count = all.len() as f64;
        all.into_iter().enumerate().map(|(k, found)| (normal_quantile((k as f64 + 0.5) / count), found)).collect()
    };
    let line = vec![(-4.0, -4.0), (4.0, 4.0)];
    let shown = [("location", BLUE, quantiles(0)), ("spread", ORANGE, quantiles(1))];
    let mut agreement = vec![Series::new("equal distributions", GREY, Mark::Line, line)];
    agreement.extend(shown.map(|(name, colour, points)| Series::new(name, colour, Mark::Dots, points)));
    let found = || tested.iter().flat_map(|one| one.deviates);
    let y = Axis::around("deviate of a test, found", found().chain([-4.0, 4.0]), 1.0);
    let x = Axis::new("deviate of a test, expected of equal distributions", (-4.0, 4.0));
    let agreement = Chart::new("agreement", x, y, agreement);
    let legend = [
        Series::new("samples", GREY, Mark::Balls, Vec::new()),
        Series::new("correlations", BLUE, Mark::Balls, Vec::new()),
        Series::new("equal distributions", GREY, Mark::Line, Vec::new()),
        Series::new("location", BLUE, Mark::Dots, Vec::new()),
        Series::new("spread", ORANGE, Mark::Dots, Vec::new()),
    ];
    figure(path, (1280, 560), 2, &[cost, agreement], &legend).unwrap();
}

/// Value that a standard normal number stays below with this probability, by bisection.
fn normal_quantile(probability: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let below = 0.5 * libm::erfc(-middle * std::f64::consts::FRAC_1_SQRT_2);
        if below < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
