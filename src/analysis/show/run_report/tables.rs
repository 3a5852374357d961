//! The tables of a run's report.

use crate::error::JudgeError;
use crate::judge::judgement::number;
use crate::measure::errors::Link;
use crate::read::Numbers;
use crate::show::document::{Report, Side, Table};
use crate::show::plot::Judged;
use crate::statistics::{Spread, Sum};
use gnss::record::{Event, EventRow};

/// Most rows of the table of events.
const MOST_EVENTS: usize = 30;

/// Adds accuracy, loops, satellites, clock and events.
pub(super) fn add(report: &mut Report, judged: &Judged<'_>) -> Result<(), JudgeError> {
    report.heading("Accuracy");
    accuracy(report, judged);
    protection(report, judged);
    detection(report, judged);
    signals(report, judged);
    loops(report, judged);
    satellites(report, judged)?;
    clock(report, judged);
    events(report, judged);
    Ok(())
}

fn shown(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), number)
}

fn fixed(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
}

fn accuracy(report: &mut Report, judged: &Judged<'_>) {
    let columns = [
        ("error", Side::Left),
        ("unit", Side::Left),
        ("mean", Side::Right),
        ("σ", Side::Right),
        ("95 %", Side::Right),
        ("values", Side::Right),
    ];
    let mut table = Table::new(
        "Errors against the truth: mean, standard deviation, and 95th percentile of the magnitude. Of the \
         pseudorange the part common to all satellites of an epoch is removed, of the carrier a constant from each \
         arc.",
        columns,
    );
    let details = &judged.summary.details;
    let mut row = |name: &str, unit: &str, spread: Option<Spread>| {
        let of = |value: fn(Spread) -> f64| fixed(spread.map(value), 4);
        let count = spread.map_or_else(|| "0".to_owned(), |spread| spread.count.to_string());
        table.row([name.to_owned(), unit.to_owned(), of(|s| s.mean), of(|s| s.sigma), of(|s| s.p95), count]);
    };
    row("pseudorange", "m", details.pseudorange_m);
    row("carrier phase", "cycles", details.carrier_cycles);
    row("Doppler", "Hz", details.doppler_hz);
    row("C/N0, measured minus expected", "dB", details.cn0_db);
    row("position east", "m", details.east_m);
    row("position north", "m", details.north_m);
    row("position up", "m", details.up_m);
    row("clock, as a distance", "m", details.clock_m);
    row("velocity, magnitude", "m/s", details.velocity_mps);
    report.table(table);
}

/// Adds availability, continuity and the regions of the Stanford diagrams, of a receiver with levels.
fn protection(report: &mut Report, judged: &Judged<'_>) {
    let Some(found) = &judged.summary.protection else { return };
    let columns = [
        ("axis", Side::Left),
        ("mean level (m)", Side::Right),
        ("limit (m)", Side::Right),
        ("nominal", Side::Right),
        ("misleading", Side::Right),
        ("hazardous", Side::Right),
        ("unavailable", Side::Right),
        ("and misleading", Side::Right),
        ("largest error over level", Side::Right),
    ];
    let mut table = Table::new(
        format!(
            "Protection levels ({}): {} % of {} fixes available, {} interruptions, {} of the windows of 15 s \
             without one. Fixes by the regions of the Stanford diagram.",
            found.method.as_deref().unwrap_or("of an unnamed method"),
            fixed(Some(100.0 * found.available_share), 2),
            found.fixes,
            found.interruptions,
            found.continuity.map_or_else(|| "no whole one".to_owned(), |share| format!("{} %", number(100.0 * share))),
        ),
        columns,
    );
    for (name, diagram) in [("horizontal", &found.horizontal), ("vertical", &found.vertical)] {
        let Some(of) = diagram else { continue };
        table.row([
            name.to_owned(),
            fixed(Some(of.level_mean_m), 2),
            shown(of.alert_limit_m),
            of.nominal.to_string(),
            of.misleading.to_string(),
            of.hazardous.to_string(),
            of.unavailable.to_string(),
            of.unavailable_misleading.to_string(),
            fixed(Some(of.ratio_max), 3),
        ]);
    }
    report.table(table);
}

/// Adds false alarms, detections and delays of the detectors, of a receiver that has them.
fn detection(report: &mut Report, judged: &Judged<'_>) {
    let Some(found) = &judged.summary.detection else { return };
    let columns = [
        ("detector", Side::Left),
        ("clean tests", Side::Right),
        ("false alarms", Side::Right),
        ("share", Side::Right),
        ("95 % interval", Side::Right),
        ("an hour", Side::Right),
        ("attacked tests", Side::Right),
        ("detected share", Side::Right),
        ("attacks detected", Side::Right),
        ("after (s)", Side::Right),
        ("ROC area", Side::Right),
    ];
    let mut table = Table::new(
        format!(
            "Detection of jamming and spoofing: stated probability of a false alarm {} a test of {} s; {} s without an \
             attack, {} attacks, {} of them detected.",
            shown(found.stated_false_alarm),
            shown(found.interval_s),
            number(found.clean_s),
            found.attacks,
            found.attacks_detected,
        ),
        columns,
    );
    for (name, of) in &found.detectors {
        let ends = of.false_alarm_low.zip(of.false_alarm_high);
        table.row([
            (*name).to_owned(),
            of.clean_tests.to_string(),
            of.false_alarms.to_string(),
            shown(of.false_alarm_share),
            ends.map_or_else(String::new, |(low, high)| format!("{} to {}", number(low), number(high))),
            fixed(of.false_alarms_per_hour, 1),
            of.attacked_tests.to_string(),
            fixed(of.detection_share, 3),
            of.attacks_detected.to_string(),
            fixed(of.time_to_detect_s, 1),
            fixed(of.roc_area, 3),
        ]);
    }
    report.table(table);
}

/// Adds a table with the results of each signal, if there are several.
fn signals(report: &mut Report, judged: &Judged<'_>) {
    if judged.summary.signals.len() < 2 {
        return;
    }
    let columns = [
        ("signal", Side::Left),
        ("satellites", Side::Right),
        ("pseudorange (m)", Side::Right),
        ("carrier (cycles)", Side::Right),
        ("Doppler (Hz)", Side::Right),
        ("C/N0, mean (dB)", Side::Right),
        ("DLL σ (chips)", Side::Right),
        ("PLL σ (°)", Side::Right),
        ("losses", Side::Right),
    ];
    let mut table = Table::new(
        "By signal: root mean square errors of its observations, what its C/N0 was measured beyond the expected one, \
         deviation of its loops' errors, and losses of lock. Pseudoranges are against the mean of their own system.",
        columns,
    );
    for (name, signal) in &judged.summary.signals {
        let (errors, loops) = (&signal.observables, &signal.tracking);
        table.row([
            (*name).to_owned(),
            signal.satellites.to_string(),
            fixed(errors.pseudorange_rms_m, 3),
            fixed(errors.carrier_rms_cycles, 4),
            fixed(errors.doppler_rms_hz, 3),
            fixed(errors.cn0_bias_db, 2),
            fixed(loops.dll_sigma_chips, 4),
            fixed(loops.pll_sigma_deg, 2),
            loops.losses_of_lock.to_string(),
        ]);
    }
    report.table(table);
}

fn loops(report: &mut Report, judged: &Judged<'_>) {
    let columns = [
        ("loop", Side::Left),
        ("unit", Side::Left),
        ("σ", Side::Right),
        ("threshold", Side::Right),
        ("share of it", Side::Right),
    ];
    let mut table = Table::new(
        "Loops: standard deviation of replica minus truth, each satellite about its mean and without the pull-in, \
         against the rules of thumb d/6, 15° and 1/(12T).",
        columns,
    );
    let (tracking, limits) = (&judged.summary.tracking, &judged.summary.details.thresholds);
    for (name, unit, sigma, limit) in [
        ("code (DLL)", "chips", tracking.dll_sigma_chips, limits.dll_chips),
        ("phase (PLL)", "degrees", tracking.pll_sigma_deg, limits.pll_deg),
        ("frequency (FLL)", "Hz", tracking.fll_sigma_hz, limits.fll_hz),
    ] {
        let share = sigma.map_or_else(|| "–".to_owned(), |sigma| format!("{:.0} %", 100.0 * sigma / limit));
        table.row([name.to_owned(), unit.to_owned(), shown(sigma), number(limit), share]);
    }
    report.table(table);
}

fn satellites(report: &mut Report, judged: &Judged<'_>) -> Result<(), JudgeError> {
    let columns = [
        ("satellite", Side::Left),
        ("elevation (°)", Side::Right),
        ("C/N0 (dB-Hz)", Side::Right),
        ("expected", Side::Right),
        ("measured", Side::Right),
        ("code mean, σ (m)", Side::Right),
        ("carrier σ (cycles)", Side::Right),
        ("Doppler σ (Hz)", Side::Right),
        ("losses", Side::Right),
        ("values", Side::Right),
    ];
    let mut table = Table::new(
        "By satellite: mean elevation; mean C/N0 at the antenna, expected and measured; errors of its observations, \
         the clock's included.",
        columns,
    );
    for link in judged.errors.signals.keys() {
        let [mut elevation, mut truth, mut expected, mut measured] = [Sum::default(); 4];
        judged.run.seen(link.sv, |row| elevation.add(row.elevation_deg))?;
        let [mut code, mut carrier, mut doppler] =
            std::array::from_fn(|_| Numbers::new(judged.errors.signals.directory()));
        for row in judged.errors.signals.cursor(link) {
            let row = row?;
            truth.add(row.cn0_true_dbhz);
            expected.add(judged.summary.details.stated.expected_dbhz(link, row.cn0_effective_dbhz));
            measured.add(row.cn0_dbhz);
            code.push(row.code_m)?;
            carrier.push(row.carrier_cycles)?;
            doppler.push(row.doppler_hz)?;
        }
        let std = |numbers: &Numbers| Ok::<_, JudgeError>(numbers.std()?.map(|(sigma, _)| sigma));
        table.row([
            judged.run.name(link),
            fixed(elevation.mean(), 1),
            fixed(truth.mean(), 1),
            fixed(expected.mean(), 1),
            fixed(measured.mean(), 1),
            format!("{}\u{a0}/\u{a0}{}", fixed(code.mean()?, 2), fixed(std(&code)?, 2)),
            fixed(std(&carrier)?, 4),
            fixed(std(&doppler)?, 3),
            losses(judged, &link).to_string(),
            code.len().to_string(),
        ]);
    }
    report.table(table);
    Ok(())
}

fn losses(judged: &Judged<'_>, Link { sv, signal }: &Link) -> usize {
    let of = |row: &&EventRow| row.sv == *sv && row.signal == *signal && row.event == Event::LossOfLock;
    judged.run.events.iter().filter(of).count()
}

fn clock(report: &mut Report, judged: &Judged<'_>) {
    let clock = &judged.summary.clock;
    if clock.fixes == 0 {
        return;
    }
    let columns = [("clock", Side::Left), ("unit", Side::Left), ("found", Side::Right), ("true", Side::Right)];
    let mut table = Table::new(
        format!(
            "The receiver's clock over {} fixes without a gap; deviations at an averaging time of 1 s.",
            clock.fixes
        ),
        columns,
    );
    let mut row = |name: &str, unit: &str, found: Option<f64>, truth: Option<f64>| {
        table.row([name.to_owned(), unit.to_owned(), shown(found), shown(truth)]);
    };
    row("error of the bias, mean", "s", clock.bias_mean_s, None);
    row("error of the bias, σ without its straight line", "s", clock.bias_sigma_s, None);
    row("drift", "s/s", clock.drift, clock.true_drift);
    row("Allan deviation", "1", clock.oadev_1s, clock.true_oadev_1s);
    row("modified Allan deviation", "1", clock.mdev_1s, None);
    row("Hadamard deviation", "1", clock.ohdev_1s, None);
    row("time deviation", "s", clock.tdev_1s_s, None);
    report.table(table);
}

fn events(report: &mut Report, judged: &Judged<'_>) {
    let rows: Vec<&EventRow> =
        judged.run.events.iter().filter(|row| matches!(row.event, Event::LossOfLock | Event::CycleSlip)).collect();
    if rows.is_empty() {
        return;
    }
    let caption = match rows.len() {
        all if all > MOST_EVENTS => {
            format!("Losses of lock and declared cycle slips, the first {MOST_EVENTS} of {all}.")
        }
        _ => "Losses of lock and declared cycle slips.".to_owned(),
    };
    let mut table = Table::new(caption, [("time (s)", Side::Right), ("satellite", Side::Left), ("event", Side::Left)]);
    for row in rows.into_iter().take(MOST_EVENTS) {
        let event = if row.event == Event::LossOfLock { "loss of lock" } else { "cycle slip" };
        table.row([format!("{:.3}", judged.run.time_s(row.sample)), row.sv.to_string(), event.to_owned()]);
    }
    report.table(table);
}
