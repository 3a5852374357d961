//! Ensembles of channels on synthetic signals: cold starts on main and side peaks, and jitter against theory.
//!
//! `GNSS_TWIN_LONG=1` takes all cases; without it a few. Each line of figures is printed (`--nocapture`).

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::stream_tests::{Echo, Random, Stream};
use super::*;
use crate::acquire::{Acquired, AcquisitionSettings, Searcher};
use crate::correlate::correlation;
use crate::lead::lead;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::galileo::e1::E1;
use gnss::record::Event;
use gnss::satellite::Sv;
use gnss::signal::synthetic::{CHANNELS, LONG_BOC, MIXED, MULTIPLEXED, QUADRATURE};
use gnss::signal::{Component, Layer, Layers, Shape, Signal};

fn is_long() -> bool {
    std::env::var_os("GNSS_TWIN_LONG").is_some()
}

fn stream(signal: &'static Signal, number: u8, rate_hz: f64, seed: u64) -> Stream {
    Stream::new(signal.link(Sv { system: signal.system, number }), rate_hz, seed)
}

/// A cold start, and what came of it.
#[derive(Debug)]
#[expect(dead_code, reason = "printed where a start fails")]
struct Start {
    seed: u64,
    cn0_dbhz: f64,
    /// Moved from what the search found by so much.
    off_chips: f64,
    /// Code error where the channel began.
    begin_chips: f64,
    /// Time from the channel's first sample to the last one more than a quarter of a chip off the main peak,
    /// seconds.
    last_off_s: f64,
    /// Times at which the code left the main peak.
    left: u32,
    /// Events of the carrier after the code had come to the main peak, but for the first lock.
    slips: usize,
    lost: bool,
    locked: bool,
    /// Doppler that the search found, and at the end, less the true one.
    doppler_errors_hz: [f64; 2],
    /// True if the secondary code was known at the end.
    known: bool,
    searches: u32,
    /// Events of the carrier, with seconds after the channel's first sample.
    events: Vec<(f64, Event)>,
}

/// Searches after which a start is given up: an echo may have taken half the amplitude.
const MOST_SEARCHES: u32 = 20;

/// Distance of a side peak of BOC(1,1) from the main one.
const SIDE_CHIPS: f64 = 0.5;

/// Searches for a satellite anywhere (`None` if it is not found), puts the channel on the peak of this number
/// (0 is what the search found) and follows it.
fn cold_start(signal: &'static Signal, seed: u64, peak: i32, with_echo: bool, duration_s: f64) -> Option<Start> {
    let mut random = Random(seed);
    let numbers = if std::ptr::eq(signal, &MIXED) { 10.0 } else { 36.0 };
    let mut stream = stream(signal, 1 + random.between(0.0, numbers) as u8, 5.3e6, seed ^ 0x5eed);
    stream.doppler_hz = random.between(-5000.0, 5000.0);
    stream.cn0_dbhz = random.between(35.0, 50.0);
    stream.sent_s = random.between(10.0, 1000.0);
    let component = lead(signal).unwrap();
    if with_echo {
        // Half the amplitude at most, up to a chip later: as walls nearby have it.
        stream.echo = Some(Echo {
            delay_s: random.between(0.1, 1.0) / component.chip_rate_hz,
            amplitude: random.between(0.2, 0.5),
            phase_cycles: random.uniform(),
        });
    }
    let metadata = stream.metadata();
    let mut searcher = Searcher::new(&metadata, &AcquisitionSettings::default()).unwrap();
    let needed = needed_samples(signal, &stream);
    let (mut hit, mut searches) = (None, 0);
    while hit.is_none() {
        if searches == MOST_SEARCHES {
            println!("{} is not found at {:.1} dB-Hz with {:?}", stream.link, stream.cn0_dbhz, stream.echo);
            return None;
        }
        let link = stream.link;
        let block = stream.block(needed);
        hit = searcher.search(&block, &[link]).unwrap()[0].1;
        searches += 1;
    }
    let mut hit: Acquired = hit.unwrap();
    let off_chips = f64::from(peak) * SIDE_CHIPS;
    hit.code_phase_chips = (hit.code_phase_chips + off_chips).rem_euclid(f64::from(component.code_chips));
    if peak != 0 {
        // What a search that had taken the side peak would say.
        hit.cn0_dbhz -= 6.0;
    }
    let begin_chips = stream.code_error_chips(hit.sample, hit.code_phase_chips);
    let mut channel = Channel::start(&hit, &metadata, &TrackingSettings::default());
    let (first, step) = (stream.now(), (0.02 * stream.rate_hz) as u64);
    let mut start = Start {
        seed,
        cn0_dbhz: stream.cn0_dbhz,
        off_chips,
        begin_chips,
        last_off_s: 0.0,
        left: 0,
        slips: 0,
        lost: false,
        locked: false,
        doppler_errors_hz: [hit.doppler_hz - stream.doppler_hz; 2],
        known: false,
        searches,
        events: Vec::new(),
    };
    let mut was_on_main = false;
    let mut report = Report::default();
    for _ in 0..(duration_s / 0.1).ceil() as u32 {
        let begin = stream.now();
        let ticks: Vec<u64> = (0..5).map(|k| begin + k * step).collect();
        let block = stream.block(5 * step as usize);
        report.measurements.clear();
        channel.advance(&block, &ticks, &mut report);
        for m in &report.measurements {
            let error_chips = stream.code_error_chips(m.sample, m.code_fraction * f64::from(component.code_chips));
            let passed_s = (m.sample - first) as f64 / stream.rate_hz;
            // An echo of half the amplitude moves the main peak of BOC(1,1) by less than 0.1 chip.
            if error_chips.abs() > 0.25 {
                start.last_off_s = passed_s;
                start.left += u32::from(was_on_main);
                was_on_main = false;
            } else {
                was_on_main |= error_chips.abs() < 0.15;
            }
            (start.locked, start.known) = (m.locked, m.half_cycle_known);
            start.doppler_errors_hz[1] = m.doppler_hz - stream.doppler_hz;
        }
    }
    let settled = first + ((start.last_off_s + 1.5) * stream.rate_hz) as u64;
    start.slips = report.events.iter().filter(|(n, event)| *n > settled && *event == Event::CycleSlip).count();
    start.lost = channel.is_lost();
    start.events = report.events.iter().map(|(n, event)| ((n - first) as f64 / stream.rate_hz, *event)).collect();
    Some(start)
}

/// Samples of a search by the default settings.
fn needed_samples(signal: &'static Signal, stream: &Stream) -> usize {
    let component = lead(signal).unwrap();
    let settings = AcquisitionSettings::default();
    let periods = f64::from(settings.periods(component) * settings.sums(component) + 1);
    ((periods + 1.0) * component.period_s() * stream.rate_hz) as usize
}

/// Runs starts on the main peak and on both side peaks in turn, half of them with an echo. One that the
/// search does not find is no start: another is drawn instead.
fn cold_starts(signal: &'static Signal, starts: u64, duration_s: f64) -> Vec<Start> {
    let one = |run: u64| cold_start(signal, 4000 + run, [0, 1, -1][run as usize % 3], run % 2 == 1, duration_s);
    let mut runs: Vec<Start> = (0..starts).into_par_iter().filter_map(one).collect();
    let missing = starts as usize - runs.len();
    runs.extend((starts..2 * starts).filter_map(one).take(missing));
    runs.sort_by(|a, b| a.last_off_s.total_cmp(&b.last_off_s));
    runs
}

#[test]
fn no_cold_start_holds_a_side_peak_and_none_leaves_the_main_one() {
    // Five seconds are the bar; the few starts of a short run are given one.
    let (starts, duration_s, bar_s) = if is_long() { (200, 5.4, 5.0) } else { (3, 1.5, 1.0) };
    for signal in [&LONG_BOC, &MIXED, &E1] {
        let runs = cold_starts(signal, starts, duration_s);
        let beside: Vec<&Start> = runs.iter().filter(|run| run.begin_chips.abs() > 0.25).collect();
        let late = runs.iter().filter(|run| run.last_off_s > bar_s).count();
        let left: u32 = runs.iter().map(|run| run.left).sum();
        let slips: usize = runs.iter().map(|run| run.slips).sum();
        let lost = runs.iter().filter(|run| run.lost).count();
        let unlocked = runs.iter().filter(|run| !run.locked).count();
        let unknown = runs.iter().filter(|run| !run.known).count();
        let middle_s = beside.get(beside.len() / 2).map_or(0.0, |run| run.last_off_s);
        let last_s = runs.last().map_or(0.0, |run| run.last_off_s);
        println!(
            "{signal}: {} of {starts} starts found, {} on a side peak, moved after {middle_s:.2} s (median) and \
             {last_s:.2} s at most; {late} later than {bar_s} s, {left} left the main peak, {slips} slips, {lost} \
             lost, {unlocked} not in lock and {unknown} without secondary_code at the end, {} searches",
            runs.len(),
            beside.len(),
            runs.iter().map(|run| run.searches).sum::<u32>(),
        );
        for run in runs.iter().filter(|run| run.last_off_s > bar_s || run.left > 0 || !run.locked || !run.known) {
            println!("{run:?}");
        }
        assert_eq!(runs.len() as u64, starts, "{signal}: too few are found");
        assert!(beside.len() >= runs.len() / 2, "{signal}: {} starts on a side peak", beside.len());
        assert_eq!((late, left), (0, 0), "{signal}");
        assert_eq!((slips, lost, unlocked, unknown), (0, 0, 0, 0), "{signal}");
    }
}

/// Expected performance of a channel on a signal.
struct Theory {
    code_chips: f64,
    carrier_cycles: f64,
    update_s: f64,
    /// Over how long code and carrier remember: sums of squares of their autocorrelations.
    memory_s: [f64; 2],
}

impl Theory {
    /// Theory for the leading component of a signal of `cn0_dbhz`, with settings fitted to it.
    fn new(component: &Component, settings: &TrackingSettings, rate_hz: f64, cn0_dbhz: f64) -> Self {
        let made = match settings.waveform {
            Layers::Strongest => vec![Layer { weight: 1.0, ..*component.strongest().unwrap() }],
            Layers::Whole => component.layers.to_vec(),
        };
        let chips_per_sample = component.chip_rate_hz / rate_hz;
        let at = |sent: &[Layer], chips: f64| {
            let shape = Shape::between(sent, &made, component.chip_rate_hz);
            correlation(&shape, settings.replica, chips_per_sample, chips)
        };
        let half = 0.5 * settings.spacing_chips;
        let ((peak, _), (side, slope)) = (at(component.layers, 0.0), at(component.layers, half));
        let ((power, _), (common, _)) = (at(&made, 0.0), at(&made, settings.spacing_chips));
        let (height, slope, common) = (side / peak, slope / peak, common / power);
        // What the replica finds of the power, in the noise that it lets through.
        let found_hz = libm::pow(10.0, 0.1 * cn0_dbhz) * component.power_share * peak * peak / power;
        let group = if component.message.is_none() { (0.02 / component.period_s()).round() as u32 } else { 20 };
        let periods = (1..=settings.integration).rev().find(|n| group.max(1).is_multiple_of(*n)).unwrap();
        let update_s = component.period_s() * f64::from(periods);
        let snr = found_hz * update_s;
        // Betz and Kolodziejski 2009 (non-coherent early minus late) with their integrals as correlations.
        let raw = (1.0 - common) / (4.0 * snr * slope * slope) * (1.0 + (1.0 + common) / (2.0 * snr * height * height));
        let code_chips = (2.0 * settings.dll_bandwidth_hz * update_s * raw).sqrt();
        // Kaplan and Hegarty, eq. 5.6: thermal noise of an arctangent.
        let raw = 1.0 / (2.0 * snr) * (1.0 + 1.0 / (2.0 * snr));
        let bandwidth_time = settings.pll_bandwidth_hz * update_s;
        let carrier = Response::of(settings.pll_order, bandwidth_time);
        let variance = raw * (2.0 * bandwidth_time + carrier.within);
        let code = Response::of(settings.dll_order, settings.dll_bandwidth_hz * update_s);
        let memory_s = [code, carrier].map(|response| response.memory * update_s);
        Self { code_chips, carrier_cycles: variance.sqrt() / TAU, update_s, memory_s }
    }
}

/// Response of a loop to unit noise of its discriminator.
struct Response {
    /// Variance that a phase which runs at the loop's rate adds at any time within updates: x² of the rate in
    /// phase an update, 1/12 in the mean.
    within: f64,
    /// Sum of the squares of the phase's autocorrelation over all lags, in updates.
    memory: f64,
}

impl Response {
    fn of(order: u32, bandwidth_time: f64) -> Self {
        // Bandwidths times times are 0.01 and more here: nothing is left after so many updates.
        const UPDATES: usize = 2000;
        let gains = loops::Gains::design(order, bandwidth_time);
        let [mut phase, mut rate, mut acceleration, mut ran_squared] = [0.0_f64; 4];
        let mut phases = Vec::new();
        for k in 0..UPDATES {
            let ran = rate + 0.5 * acceleration;
            ran_squared += ran * ran;
            phases.push(phase);
            let error = f64::from(u32::from(k == 0)) - phase;
            acceleration += gains.acceleration * error;
            rate += gains.rate * error + acceleration;
            phase += gains.phase * error + rate;
        }
        let at = |lag: usize| phases.iter().zip(&phases[lag..]).map(|(a, b)| a * b).sum::<f64>();
        let variance = at(0);
        let memory = 1.0 + 2.0 * (1..UPDATES).map(|lag| (at(lag) / variance) * (at(lag) / variance)).sum::<f64>();
        Self { within: ran_squared / 12.0, memory }
    }
}

/// Squares of deviations from a channel's own mean.
#[derive(Clone, Copy, Debug, Default)]
struct Scatter {
    code: f64,
    carrier: f64,
    values: f64,
}

/// Follows a signal for `duration_s` after it has settled.
fn follow(sent: Sent, settings: &TrackingSettings, duration_s: f64) -> Scatter {
    let Sent { signal, rate_hz, cn0_dbhz, seed } = sent;
    let mut random = Random(seed);
    let mut stream = stream(signal, 1 + random.between(0.0, 10.0) as u8, rate_hz, seed ^ 0xfade);
    stream.doppler_hz = random.between(-3000.0, 3000.0);
    stream.sent_s = random.between(10.0, 1000.0);
    stream.cn0_dbhz = cn0_dbhz;
    let component = lead(signal).unwrap();
    let hit = Acquired {
        sv: stream.link.sv,
        signal,
        sample: 0,
        code_phase_chips: stream.chips(0.0).rem_euclid(f64::from(component.code_chips)),
        doppler_hz: stream.doppler_hz + 2.0,
        cn0_dbhz,
    };
    let mut channel = Channel::start(&hit, &stream.metadata(), settings);
    // Not in step with any code period.
    let step = 0.007_31 * rate_hz;
    let (block, mut tick) = ((0.1 * rate_hz) as usize, 0.0);
    let (mut report, mut code, mut carrier) = (Report::default(), Vec::new(), Vec::new());
    while (stream.now() as f64) < (duration_s + settle_s(component)) * rate_hz {
        let end = (stream.now() + block as u64) as f64;
        let mut ticks = Vec::new();
        while tick < end {
            ticks.push(tick as u64);
            tick += step;
        }
        report.measurements.clear();
        channel.advance(&stream.block(block), &ticks, &mut report);
        for m in report.measurements.iter().filter(|m| m.sample as f64 > settle_s(component) * rate_hz) {
            assert!(m.locked, "{signal} {seed}: {:?}", report.events);
            code.push(stream.code_error_chips(m.sample, m.code_fraction * f64::from(component.code_chips)));
            let error = -m.carrier_cycles - stream.cycles(m.sample as f64 / rate_hz);
            carrier.push(error - (2.0 * error).round() / 2.0);
        }
    }
    let scatter = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>()
    };
    // Half cycles wrap where the mean is near a quarter: from the first value on.
    let first = carrier[0];
    let carrier: Vec<f64> = carrier.iter().map(|x| x - first - (2.0 * (x - first)).round() / 2.0).collect();
    Scatter { code: scatter(&code), carrier: scatter(&carrier), values: code.len() as f64 }
}

/// Time in seconds after which a channel has settled. The carrier was locked for its first hundred prompts,
/// symbols and secondary code are known, and the pull-in has decayed.
fn settle_s(component: &Component) -> f64 {
    0.8 + 115.0 * component.period_s()
}

/// A signal in noise, as samples.
#[derive(Clone, Copy, Debug)]
struct Sent {
    signal: &'static Signal,
    rate_hz: f64,
    cn0_dbhz: f64,
    /// Seed of the noise, and of all other random values.
    seed: u64,
}

/// Jitter measured on a signal, and the value that theory expects.
struct Jitter {
    /// Signal and settings of the measurement.
    case: String,
    update_s: f64,
    code_m: f64,
    carrier_cycles: f64,
    /// Ratios of code and carrier jitter to theory.
    ratios: [f64; 2],
    /// Standard deviations of these ratios.
    spreads: [f64; 2],
}

fn jitter(case: String, sent: Sent, settings: &TrackingSettings, channels: u64, duration_s: f64) -> Jitter {
    let component = lead(sent.signal).unwrap();
    let fitted = settings.fitted(component);
    let theory = Theory::new(component, &fitted, sent.rate_hz, sent.cn0_dbhz);
    let one = |run: u64| follow(Sent { seed: sent.seed + run, ..sent }, settings, duration_s);
    let runs: Vec<Scatter> = (0..channels).into_par_iter().map(one).collect();
    let values: f64 = runs.iter().map(|run| run.values).sum();
    let code_chips = (runs.iter().map(|run| run.code).sum::<f64>() / values).sqrt();
    let carrier_cycles = (runs.iter().map(|run| run.carrier).sum::<f64>() / values).sqrt();
    // The mean of each channel takes 1/(2Bt) of the variance. A variance that is measured over a time
    // scatters by √(2·memory/time) of itself, its root by half as much.
    let bandwidths_hz = [fitted.dll_bandwidth_hz, fitted.pll_bandwidth_hz];
    let [left_code, left_carrier] = bandwidths_hz.map(|hz| (1.0 - 0.5 / (hz * duration_s)).sqrt());
    Jitter {
        case,
        update_s: theory.update_s,
        code_m: code_chips * SPEED_OF_LIGHT_MPS / component.chip_rate_hz,
        carrier_cycles,
        ratios: [code_chips / (theory.code_chips * left_code), carrier_cycles / (theory.carrier_cycles * left_carrier)],
        spreads: theory.memory_s.map(|memory_s| (0.5 * memory_s / (channels as f64 * duration_s)).sqrt()),
    }
}

/// Settings whose code loop is eight times as wide as the default one: it has as many more independent
/// values.
fn wide() -> TrackingSettings {
    TrackingSettings { dll_bandwidth_hz: 4.0, dll_pull_in_s: 0.5, ..TrackingSettings::default() }
}

/// Prints every case, and compares it with theory.
fn is_that_of_theory(found: &[Jitter]) {
    for Jitter { case, update_s, code_m, carrier_cycles, ratios, spreads } in found {
        println!(
            "{case}: updates of {:.0} ms; code {code_m:.4} m, {:.3} ± {:.3} of theory; carrier {:.3}°, {:.3} ± \
             {:.3} of theory",
            1e3 * update_s,
            ratios[0],
            spreads[0],
            360.0 * carrier_cycles,
            ratios[1],
            spreads[1],
        );
    }
    for Jitter { case, ratios, spreads, .. } in found {
        for (ratio, spread) in ratios.iter().zip(spreads) {
            // Five per cent, or four deviations of a run that is too short to show them.
            assert!((ratio - 1.0).abs() < f64::max(0.05, 4.0 * spread), "{case}: {ratios:?}");
        }
    }
}

#[test]
fn jitter_of_code_and_carrier_is_that_of_theory() {
    let (channels, duration_s) = if is_long() { (16, 10.0) } else { (1, 2.0) };
    let cases: [(&'static Signal, f64, Layers); 7] = [
        (&LONG_BOC, 5.3e6, Layers::Strongest),
        (&QUADRATURE, 12.3e6, Layers::Strongest),
        (&CHANNELS, 2.6e6, Layers::Strongest),
        (&MULTIPLEXED, 2.6e6, Layers::Strongest),
        (&MIXED, 5.3e6, Layers::Strongest),
        (&E1, 6.5e6, Layers::Strongest),
        (&E1, 13.1e6, Layers::Whole),
    ];
    let one = |(signal, rate_hz, waveform): (&'static Signal, f64, Layers)| {
        let settings = TrackingSettings { waveform, ..wide() };
        let sent = Sent { signal, rate_hz, cn0_dbhz: 45.0, seed: 9000 };
        jitter(signal.name.to_owned(), sent, &settings, channels, duration_s)
    };
    let found: Vec<Jitter> = cases.into_par_iter().map(one).collect();
    is_that_of_theory(&found);
}

#[test]
fn jitter_of_a_cboc_pilot_is_that_of_theory_for_every_bandwidth_and_spacing() {
    let (channels, duration_s) = if is_long() { (16, 10.0) } else { (1, 1.5) };
    let mut cases = Vec::new();
    for cn0_dbhz in [45.0, 50.0] {
        for [dll_bandwidth_hz, pll_bandwidth_hz] in [[2.0, 8.0], [3.0, 12.0], [4.0, 18.0]] {
            for spacing_chips in [0.6, 1.0] {
                let settings = TrackingSettings { dll_bandwidth_hz, pll_bandwidth_hz, spacing_chips, ..wide() };
                cases.push((cn0_dbhz, settings));
            }
        }
    }
    let one = |(index, (cn0_dbhz, settings)): (usize, (f64, TrackingSettings))| {
        let TrackingSettings { dll_bandwidth_hz, pll_bandwidth_hz, spacing_chips, .. } = settings;
        let case = format!("{cn0_dbhz} dB-Hz, {dll_bandwidth_hz} and {pll_bandwidth_hz} Hz, spacing {spacing_chips}");
        let sent = Sent { signal: &E1, rate_hz: 6.5e6, cn0_dbhz, seed: 10_000 + 100 * index as u64 };
        jitter(case, sent, &settings, channels, duration_s)
    };
    let found: Vec<Jitter> = cases.into_par_iter().enumerate().map(one).collect();
    is_that_of_theory(&found);
}
