//! The page `reports/trade.md`, its tables and its pictures.

use std::fmt::Write;
use std::path::Path;

use analysis::show::plot::canvas::{Axis, BLUE, COLOURS, Chart, GREY, Mark, Series, figure};
use generator::fidelity::{Arithmetic, CodeEdge, Fidelity, Grade, allowed_m, kernel_ns};
use gnss::signal::{SIGNALS, Signal};

use super::machine;
use super::scenes::SceneRow;
use super::signals::{DopplerRow, Interval, JUDGED, PHASES, ROUNDS, SignalRow};

/// A level of a signal at a rate: its cost with both ends, and its error.
struct Rung<'r> {
    name: &'static str,
    row: &'r SignalRow,
    ns: [f64; 3],
}

/// The levels of a signal at a rate, from the rows of its edges.
fn ladder<'r>(rows: &'r [SignalRow], signal: &Signal, rate_msps: f64) -> Vec<Rung<'r>> {
    let of = |&(name, grade): &(&'static str, Grade)| {
        let fidelity = Fidelity::suited(grade, 1e6 * rate_msps, allowed_m(None), &[signal]).unwrap();
        let edge = fidelity.code_edge.name();
        let mut own = rows.iter().filter(|row| row.signal == signal.name && row.sample_rate_msps == rate_msps);
        let row = own.find(|row| row.code_edge == edge)?;
        let Interval { median, low, high } = row.cost(fidelity.carrier);
        let ns = [median, low, high];
        Some(Rung { name, row, ns })
    };
    Grade::NAMES.iter().filter(|(_, grade)| grade.is_sampled()).filter_map(of).collect()
}

/// Levels that another one beats: it errs less and costs less, with intervals of cost that do not meet.
fn dominated(ladder: &[Rung<'_>]) -> Vec<&'static str> {
    let beats =
        |better: &Rung<'_>, rung: &Rung<'_>| better.ns[2] < rung.ns[1] && better.row.code_rms_m < rung.row.code_rms_m;
    let beaten = |rung: &&Rung<'_>| ladder.iter().any(|better| beats(better, rung));
    ladder.iter().filter(beaten).map(|rung| rung.name).collect()
}

/// The lowest measured rate that holds both main lobes, or the highest one.
fn usual_msps(rows: &[SignalRow], signal: &Signal) -> Option<f64> {
    let steps = |c: &gnss::signal::Component| c.strongest().map_or(1, |layer| layer.pulse.len()) as f64;
    let wanted = signal.components.iter().map(|c| 2.001e-6 * c.chip_rate_hz * steps(c)).fold(0.0, f64::max);
    let rates = || rows.iter().filter(|row| row.signal == signal.name).map(|row| row.sample_rate_msps);
    rates().find(|rate| *rate >= wanted).or_else(|| rates().next_back())
}

fn metres(m: f64) -> String {
    match m.abs() {
        x if x >= 1.0 => format!("{m:.1}"),
        x if x >= 0.01 => format!("{m:.3}"),
        _ => format!("{m:.1e}"),
    }
}

fn maybe(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(String::new, |value| format!("{:.digits$}", value + 0.0))
}

/// Ratio of two costs over all rows: least, median, greatest with its input.
fn multiples(rows: &[SignalRow], of: impl Fn(&SignalRow) -> Option<f64>) -> String {
    let mut all: Vec<(f64, String)> = rows
        .iter()
        .filter_map(|row| Some((of(row)?, format!("{} at {} Msps", row.signal, row.sample_rate_msps))))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(first), Some(last)) = (all.first(), all.last()) else { return String::new() };
    format!("{:.1} ({}) | {:.1} | {:.1} ({})", first.0, first.1, all[all.len() / 2].0, last.0, last.1)
}

fn signals(text: &mut String, rows: &[SignalRow], dopplers: &[DopplerRow]) {
    let (mut ladders, mut held, mut beaten) = (0, 0, Vec::new());
    let mut table = String::new();
    for signal in SIGNALS {
        let rates: Vec<f64> = rows
            .iter()
            .filter(|r| r.signal == signal.name && r.code_edge == "area")
            .map(|r| r.sample_rate_msps)
            .collect();
        let Some(usual) = usual_msps(rows, signal) else { continue };
        for rate in &rates {
            let holds = *rate >= usual;
            (ladders, held) = (ladders + 1, held + i32::from(holds));
            let levels = dominated(&ladder(rows, signal, *rate)).into_iter();
            beaten.extend(levels.map(|level| (format!("{level} of {} at {rate} Msps", signal.name), holds)));
        }
        let cells: Vec<String> = ladder(rows, signal, usual)
            .iter()
            .map(|rung| {
                let edge = if rung.name == "balanced" {
                    format!(" {}", rung.row.code_edge.replace("band_limited", "band"))
                } else {
                    String::new()
                };
                format!(
                    "{:.2} ({:.2}–{:.2}){edge} | {}",
                    rung.ns[0],
                    rung.ns[1],
                    rung.ns[2],
                    metres(rung.row.code_rms_m)
                )
            })
            .collect();
        let _ = writeln!(table, "| {} | {usual} | {} |", signal.name, cells.join(" | "));
    }
    let _ = writeln!(
        text,
        "\n## Signals\n\n\
         ![Work and precision](trade_signals.png)\n\n\
         Cost is the time of one core for one sample of one satellite in the kernels, code strips included: median of \
         {ROUNDS} \
         interleaved runs of six satellites, with the 95 % interval of the median by ranks. The error is that of the \
         code at rest on the sampling grid, root mean square over {} to {} satellites, or all, and {} to {} phases, \
         of the \
         component that errs most. Its truth is not the `reference` level but the spectral lines of the code, computed \
         from chips and waveform alone (`tests/common/lines.rs`). The table has each signal at the \
         lowest measured rate \
         that holds its main lobes; [trade_signals.csv](trade_signals.csv) has all {} rows, with the largest error \
         of each and the input that makes it.\n\n\
         | signal | Msps | `fast` (ns) | error (m) | \
         `balanced` (ns), edge | error (m) | `reference` (ns) | error (m) |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n{table}",
        JUDGED[0],
        JUDGED[1],
        PHASES[0],
        PHASES[1],
        rows.len()
    );
    let _ = writeln!(
        text,
        "A level is dominated where another one errs less and costs less, and the two intervals of cost do not \
         meet. Of {ladders} \
         ladders (signal and rate), {} have a dominated level{}{}. Of the {held} at rates that hold the signal's main \
         lobes, {} have one.",
        beaten.len(),
        if beaten.is_empty() { "" } else { ": " },
        beaten.iter().map(|(level, _)| level.as_str()).collect::<Vec<_>>().join("; "),
        beaten.iter().filter(|(_, holds)| *holds).count()
    );
    text.push_str("\n### Error over sample rate\n\n![Error over sample rate](trade_rates.png)\n");
    self::dopplers(text, dopplers);
    let _ = writeln!(
        text,
        "\n### Largest errors\n\n| edge | error (m) | signal | Msps | input |\n| --- | --- | --- | --- | --- |"
    );
    for edge in ["nearest", "area", "band_limited"] {
        let own = rows.iter().filter(|row| row.code_edge == edge);
        if let Some(row) = own.max_by(|a, b| a.code_largest_m.abs().total_cmp(&b.code_largest_m.abs())) {
            let _ = writeln!(
                text,
                "| {edge} | {} | {} | {} | {} |",
                metres(row.code_largest_m),
                row.signal,
                row.sample_rate_msps,
                row.largest_at
            );
        }
    }
    models(text, rows);
}

/// Adds the comparison of `plan`'s statements with the measurements.
fn models(text: &mut String, rows: &[SignalRow]) {
    text.push_str(
        "\n### What `plan` states against what is measured\n\n\
         `balanced` and `plan` read one error model (`code_bias_m`). The ratio is stated over measured; below 0.9 the \
         model is optimistic by more than 10 %. The model is for random codes. What n real ones measure scatters as χ² \
         of 2n degrees, since the error of one code is a wave over its phase: for 8 codes by a third, for 32 by a \
         sixth \
         (95 %). \"Surely\" counts the rows whose whole interval lies there. Rates that are too low cut main lobes \
         off.\n\n\
         | edge | rates | rows | median ratio | lowest | highest | within 25 % | surely not | optimistic by more \
         than 10 % \
         | surely |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    let holds = |row: &SignalRow| {
        let signal = SIGNALS.into_iter().find(|signal| signal.name == row.signal);
        signal.and_then(|signal| usual_msps(rows, signal)).is_some_and(|usual| row.sample_rate_msps >= usual)
    };
    for (edge, high) in ["nearest", "area", "band_limited"].into_iter().flat_map(|edge| [(edge, true), (edge, false)]) {
        let mut own: Vec<&SignalRow> = rows.iter().filter(|row| row.code_edge == edge && holds(row) == high).collect();
        own.sort_by(|a, b| a.ratio().total_cmp(&b.ratio()));
        let (Some(first), Some(last)) = (own.first(), own.last()) else { continue };
        let count = |test: &dyn Fn(&SignalRow) -> bool| own.iter().filter(|row| test(row)).count();
        let named = |row: &SignalRow| format!("{:.2} ({} at {} Msps)", row.ratio(), row.signal, row.sample_rate_msps);
        let _ = writeln!(
            text,
            "| {edge} | {} | {} | {:.2} | {} | {} | {} | {} | {} | {} |",
            if high { "hold the lobes" } else { "too low" },
            own.len(),
            own[own.len() / 2].ratio(),
            named(first),
            named(last),
            count(&|row| (0.75..=1.25).contains(&row.ratio())),
            count(&|row| row.ratio_of_many()[1] < 0.75 || row.ratio_of_many()[0] > 1.25),
            count(&|row| row.ratio() < 0.9),
            count(&|row| row.ratio_of_many()[1] < 0.9)
        );
    }
    text.push_str(
        "\n`plan` reads costs from `src/generator/fidelity/costs.csv`, the measurement of one processor, which \
         `-- --costs FILE` makes again. Here they are over what this run measured.\n\n\
         | edge, arithmetic | least | median | greatest |\n| --- | --- | --- | --- |\n",
    );
    for (name, edge) in CodeEdge::NAMES {
        for (arithmetic_name, arithmetic) in Arithmetic::NAMES {
            let of = |row: &SignalRow| {
                let signal = SIGNALS.into_iter().find(|signal| signal.name == row.signal)?;
                let stated = kernel_ns(signal, 1e6 * row.sample_rate_msps, edge, arithmetic)?;
                (row.code_edge == name).then(|| stated / row.cost(arithmetic).median)
            };
            let _ = writeln!(text, "| {name}, {arithmetic_name} | {} |", multiples(rows, of));
        }
    }
}

/// Curves of a code's error over Doppler behind a loop, measured and stated.
fn dopplers(text: &mut String, rows: &[DopplerRow]) {
    text.push_str(
        "\n### Error over Doppler\n\n\
         A Doppler moves the code over the samples; a first-order code loop of 0.5 Hz follows the error of each code \
         period for 8 s. Root mean square over four satellites and the last 6 s, and what `plan` states.\n\n\
         | signal | Msps | edge | Doppler (Hz) | measured (m) | stated (m) |\n| --- | --- | --- | --- | --- | --- |\n",
    );
    for row in rows {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            row.signal,
            row.sample_rate_msps,
            row.code_edge,
            row.doppler_hz,
            metres(row.code_rms_m),
            metres(row.stated_m)
        );
    }
}

fn scenes(text: &mut String, rows: &[SceneRow]) {
    text.push_str(
        "\n## Whole scenes\n\n\
         ![Scenes](trade_scenes.png)\n\n\
         Costs are processor seconds of all threads for one simulated second, tables included: first the generator \
         alone, with the ratio of what `plan` states to it, then a run of both less that. They are medians of the \
         runs, and the CSV file has both ends. Runs \
         differ by their seed, and every setting has the same seeds, so that positions of two settings are paired. The \
         position is that of every fix of all runs against the truth, with the least and the greatest of the \
         runs. C/N0 loss is what the scene makes, other satellites counted as noise, less what the \
         receiver measures. \"Between signals\" is the largest difference of the mean code errors of two signals; a \
         user who combines two bands without ionosphere sees about 2.6 times as much. `full_sky` is too short for a \
         position.\n\n",
    );
    let head = "| setting | generator (s/s) | `plan` over it | receiver (s/s) | fixes | \
                position rms (runs) / 95 % (m) | \
                pseudoranges (m, rms) | \
                C/N0 loss (dB) | between signals (m) | ionosphere-free (m) |\n\
                | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    let mut last = "";
    for row in rows {
        if row.scene != last {
            let _ = write!(text, "\n### `{}`, {} s, runs: {}\n\n{head}", row.scene, row.simulated_s, row.runs);
            last = &row.scene;
        }
        let _ = writeln!(
            text,
            "| `{}` | {:.3} | {:.2} | {:.3} | {:.0} | {}{} / {} | {} | {} | {} | {} |",
            row.setting,
            row.generator_s,
            row.planned_s / row.generator_s,
            row.receiver_s,
            row.fixes,
            maybe(row.position_rms_m, 3),
            row.position_low_m.zip(row.position_high_m).map_or_else(String::new, |(a, b)| format!(" ({a:.3}–{b:.3})")),
            maybe(row.position_p95_m, 3),
            maybe(row.pseudorange_rms_m, 3),
            maybe(row.cn0_loss_db, 2),
            maybe(row.between_signals_m, 3),
            maybe(row.ionosphere_free_m, 3),
        );
    }
}

const EDGES: [(&str, usize); 3] = [("nearest", 1), ("area", 0), ("band_limited", 2)];

const FAMILIES: [&str; 6] = ["GPS L1 C/A", "Galileo E1", "GPS L5", "GPS L1C", "Galileo E5", "GLONASS G1"];

fn log_chart(title: &str, x: (&str, &[f64]), y: (&str, &[f64]), series: Vec<Series>) -> Chart {
    let logs = |values: &[f64]| values.iter().map(|value| libm::log10(*value)).collect::<Vec<_>>();
    let x = Axis::around(x.0, logs(x.1).into_iter(), 0.6).logarithmic();
    let y = Axis::around(y.0, logs(y.1).into_iter(), 0.6).logarithmic();
    Chart::new(title, x, y, series)
}

fn draw_signals(directory: &Path, rows: &[SignalRow]) {
    let (mut work, mut rates) = (Vec::new(), Vec::new());
    for family in FAMILIES {
        let own: Vec<&SignalRow> = rows.iter().filter(|row| row.signal == family).collect();
        if own.is_empty() {
            continue;
        }
        let errors: Vec<f64> = own.iter().map(|row| row.code_rms_m).collect();
        let log = libm::log10;
        let of = |edge: &str, x: &dyn Fn(&SignalRow) -> f64| -> Vec<(f64, f64)> {
            own.iter().filter(|row| row.code_edge == edge).map(|row| (log(x(row)), log(row.code_rms_m))).collect()
        };
        let mut series: Vec<Series> = EDGES
            .iter()
            .map(|(edge, colour)| Series::new(*edge, COLOURS[*colour], Mark::Balls, of(edge, &|r| r.f32_ns)))
            .collect();
        series.push(Series::new("band_limited, f64", GREY, Mark::Cross, of("band_limited", &|r| r.f64_ns)));
        let costs: Vec<f64> = own.iter().flat_map(|row| [row.f32_ns, row.f64_ns]).collect();
        let y = ("code error (m, rms)", errors.as_slice());
        work.push(log_chart(family, ("time for a sample of a satellite (ns)", &costs), y, series));
        let series = EDGES.iter().flat_map(|(edge, colour)| {
            let points = of(edge, &|row| row.sample_rate_msps);
            [
                Series::new(*edge, COLOURS[*colour], Mark::Line, points.clone()),
                Series::new(*edge, COLOURS[*colour], Mark::Balls, points),
            ]
        });
        let at: Vec<f64> = own.iter().map(|row| row.sample_rate_msps).collect();
        rates.push(log_chart(family, ("sample rate (Msps)", &at), y, series.collect()));
    }
    let mut legend: Vec<Series> =
        EDGES.iter().map(|(edge, colour)| Series::new(*edge, COLOURS[*colour], Mark::Balls, Vec::new())).collect();
    figure(&directory.join("trade_rates.png"), (1280, 1160), 2, &rates, &legend).unwrap();
    legend.push(Series::new("band_limited, f64", GREY, Mark::Cross, Vec::new()));
    figure(&directory.join("trade_signals.png"), (1280, 1160), 2, &work, &legend).unwrap();
}

fn draw_scenes(directory: &Path, rows: &[SceneRow]) {
    let mut charts = Vec::new();
    let mut names: Vec<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    names.dedup();
    let levels = ["fast", "balanced", "reference"];
    for name in names {
        let own: Vec<&SceneRow> = rows.iter().filter(|row| row.scene == name).collect();
        let positions = own.iter().all(|row| row.position_rms_m.is_some());
        let error = |row: &SceneRow| if positions { row.position_rms_m } else { row.pseudorange_rms_m };
        let place = |row: &&SceneRow| Some((libm::log10(row.total_s()), libm::log10(error(row)?)));
        let is_level = |row: &&SceneRow| levels.contains(&row.setting.as_str());
        let of = |level: bool| {
            own.iter().copied().filter(|row| is_level(row) == level).filter_map(|row| place(&row)).collect()
        };
        let series = vec![
            Series::new("one knob changed", GREY, Mark::Rings, of(false)),
            Series::new("level", BLUE, Mark::Balls, of(true)),
        ];
        let costs: Vec<f64> = own.iter().map(|row| row.total_s()).collect();
        let errors: Vec<f64> = own.iter().filter_map(|row| error(row)).collect();
        let y = if positions { "position error (m, rms)" } else { "pseudorange error (m, rms)" };
        let mut chart = log_chart(name, ("processor time for a simulated second (s)", &costs), (y, &errors), series);
        let labelled = own.iter().copied().filter(is_level);
        chart.labels = labelled.filter_map(|row| Some((place(&row)?, row.setting.clone(), 12))).collect();
        charts.push(chart);
    }
    let legend = [
        Series::new("level", BLUE, Mark::Balls, Vec::new()),
        Series::new("one knob changed", GREY, Mark::Rings, Vec::new()),
    ];
    let height = 60 + 370 * charts.len().div_ceil(2) as u32;
    figure(&directory.join("trade_scenes.png"), (1280, height), 2, &charts, &legend).unwrap();
}

fn table<T: serde::Serialize>(path: &Path, rows: &[T]) {
    let mut file = csv::Writer::from_path(path).unwrap();
    rows.iter().for_each(|row| file.serialize(row).unwrap());
    file.flush().unwrap();
}

/// Writes the file that `plan` reads: nanoseconds of each edge in both arithmetics.
pub fn write_costs(path: &Path, rows: &[SignalRow]) {
    let mut text = String::from("signal,sample_rate_msps");
    for (edge, _) in CodeEdge::NAMES {
        for (arithmetic, _) in Arithmetic::NAMES {
            let _ = write!(text, ",{edge}_{arithmetic}_ns");
        }
    }
    // Rows of a signal and rate follow each other, an edge each.
    for own in rows.chunk_by(|a, b| a.signal == b.signal && a.sample_rate_msps == b.sample_rate_msps) {
        let Some(first) = own.first() else { continue };
        let _ = write!(text, "\n{},{}", first.signal, first.sample_rate_msps);
        for row in own {
            let _ = write!(text, ",{:.3},{:.3}", row.f32_ns, row.f64_ns);
        }
    }
    std::fs::write(path, text + "\n").unwrap();
}

/// Writes all of it; `knobs` is a section of its own.
pub fn write(
    directory: &Path,
    signal_rows: &[SignalRow],
    doppler_rows: &[DopplerRow],
    scene_rows: &[SceneRow],
    knobs: &str,
) {
    let mut text = format!(
        "# Speed against accuracy\n\n\
         What users pay for accuracy: processor time against errors, for every signal, for whole scenes and for the \
         knobs of both sides. `cargo bench --bench trade` makes this page, its tables and its pictures.\n\n\
         {}.\n",
        machine::machine()
    );
    signals(&mut text, signal_rows, doppler_rows);
    scenes(&mut text, scene_rows);
    text.push_str(knobs);
    text.push_str(
        "\n## What this page does not hold\n\n\
         - There is no curve of errors over the taps of a channel. [performance.md](performance.md) has their cost.\n\
         - Components whose code lasts longer than 20 ms (L2 CL) are timed and not judged.\n\
         - Two or three seeds show how much positions differ from run to run. They are too few for an interval.\n\
         - Costs belong to this processor and its instruction set.\n\
         - The receiver's cost is a difference: where the generator takes ten times as much, it is known to a tenth of \
         the generator's at best.\n\
         - Single knobs are changed on `static` and `two_systems` alone.\n",
    );
    std::fs::write(directory.join("trade.md"), text).unwrap();
    table(&directory.join("trade_signals.csv"), signal_rows);
    table(&directory.join("trade_scenes.csv"), scene_rows);
    draw_signals(directory, signal_rows);
    draw_scenes(directory, scene_rows);
}
