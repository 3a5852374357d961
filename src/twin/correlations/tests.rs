//! Modelled correlations against those of samples, and a reception by them against one of samples.

use std::collections::BTreeMap;
use std::path::Path;

use generator::Generator;
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::Fix;
use gnss::satellite::{Sv, System};
use gnss::signal::{Component, SIGNALS};
use num_complex::Complex64;
use receiver::correlate::correlator::{Code, Interval, Model};
use receiver::correlate::{Nco, Replica, Wave, chips_to_units};
use receiver::lead::lead;
use receiver::output::Record;
use receiver::settings::Settings;

use super::promise::{HEIGHT, bounds};
use super::*;

/// A scene at rest with the signal, at the rate, of some satellites that send it.
fn at_rest(signal: &Signal, rate_hz: f64, duration_s: f64, rest: &str) -> Scene {
    let file = |name: &str| format!("[navigation]\nfile = \"{name}\"\n");
    let (start, latitude_deg, longitude_deg, file) = match signal.system {
        System::Qzss => ("2023-03-12T01:51:56", 7.3, 134.5, file("qzss_2023-03-12_02h_04h.rnx")),
        System::Gps => ("2026-03-09T10:31:56", 26.5123, 80.2329, file("gps_2026-03-09_10h_12h.rnx")),
        System::Navic => ("2026-03-09T10:31:56", 26.5123, 80.2329, file("navic_2026-03-09_10h_12h.rnx")),
        System::Sbas => ("2026-03-09T10:54:56", 60.0, -90.0, file("gps_sbas_2026-03-09_11h.rnx")),
        _ => ("2020-11-29T12:50:30", 37.605, -0.986, String::new()),
    };
    let text = format!(
        "name = \"one\"\nstart = {start}\nduration_s = {duration_s}\nsignals = [\"{}\"]\n\
         motion = {{ kind = \"static\", latitude_deg = {latitude_deg}, longitude_deg = {longitude_deg}, \
         height_m = 60 }}\n\
         fidelity = {{ code_edge = \"area\", carrier = \"f64\" }}\n\
         front_end = {{ sample_rate_hz = {rate_hz}, format = \"cf32\" }}\n{file}{rest}",
        signal.name
    );
    let files = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios"));
    Scenario::from_toml(&text).unwrap().compose(files, &Overrides::default()).unwrap().0
}

/// First satellite that is received from the beginning on.
fn first(scene: &Scene) -> Sv {
    let mut fronts = Fronts::new(std::slice::from_ref(scene), &mut (), &Options::default()).unwrap();
    fronts.pass(&[0], scene.samples, &|_| true, &mut ()).unwrap();
    let seen = fronts.transmitters().flatten().find(|one| one.rays(scene, scene.samples / 2).is_some());
    seen.unwrap_or_else(|| panic!("{} is not received", scene.signals[0])).link().sv
}

/// Early less late in metres, and the prompt's phase in cycles.
fn errors([early, prompt, late]: [Complex64; 3], turn: Complex64, chip_m: f64) -> (f64, f64) {
    let [early, prompt, late] = [early, prompt, late].map(|sum| sum * turn);
    // The slope of the peak at a quarter of a chip is one a chip of BPSK; less of others, which errs to the
    // safe side by their slope.
    (0.5 * (early.re - late.re) / prompt.re * chip_m, prompt.arg() / std::f64::consts::TAU)
}

/// First sample of the code period after sample `from`, for a code that has come to `share` of its period.
fn next_period(from: u64, share: f64, period_samples: f64) -> u64 {
    from + ((1.0 - share) * period_samples).ceil() as u64
}

/// Samples of a scene.
fn samples(scene: &Scene) -> [Vec<f32>; 2] {
    let mut all: [Vec<f32>; 2] = Default::default();
    for batch in Generator::new(scene).unwrap() {
        let (mut i, mut q) = (Vec::new(), Vec::new());
        scene.metadata.format.unpack(&batch.unwrap().samples, &mut i, &mut q);
        all.iter_mut().zip([i, q]).for_each(|(all, more)| all.extend(more));
    }
    all
}

/// Replica of a component, or of the segment of a long code that is sent at share `share` of its period.
fn replica(link: Link, component: &'static Component, share: f64) -> (Replica, Code) {
    let settings = Settings::default().tracking;
    let made = (settings.waveform, settings.replica);
    let code = Code::new(link, component, made);
    let length = lead(link.signal).unwrap().code_chips;
    if component.code_chips == length {
        return (Replica::made(component, link.sv.number, made.0, made.1).unwrap(), code);
    }
    let segments = f64::from(component.code_chips / length);
    let segment = (share * segments) as u64;
    let chips = (component.code)(link.sv.number).unwrap();
    let values = chips.chunks(length as usize).nth(segment as usize).unwrap().to_vec();
    let own = values.iter().filter(|&&chip| chip != 0).count() as f64 / values.len() as f64;
    let wave = Wave { values, steps_per_chip: 1, share: own };
    (Replica::of(wave, made.1).unwrap(), Code { segment: Some(segment), ..code })
}

/// A scene of one signal by samples, and what the model is asked about it.
struct Both<'a> {
    scene: &'a Scene,
    planes: [Vec<f32>; 2],
    model: Correlations<'a>,
    transmitter: &'a Transmitter,
}

impl Both<'_> {
    /// Sums of a code period of a component at early, prompt and late, of samples and of the model; `at` is
    /// the share of the scene before it, and the replica is off by so many chips and hertz.
    fn sums(&self, index: usize, at: f64, (off_chips, off_hz): (f64, f64)) -> [[Complex64; 3]; 2] {
        let Self { scene, planes: [i, q], model, transmitter } = self;
        let (signal, rate_hz) = (transmitter.signal, scene.clock.rate.hz());
        let component = &signal.components[index];
        let rays = transmitter.rays(scene, scene.samples / 2).unwrap();
        let length = f64::from(lead(signal).unwrap().code_chips);
        let period_samples = length / component.chip_rate_hz * rate_hz;
        // Share of the component's own period, and of the replica's.
        let whole = |sample: u64| {
            let delay_s = rays.at(0, sample).unwrap().delay_s;
            transmitter.code_at(scene, index, sample, delay_s).unwrap().share
        };
        let phase = |sample: u64| (whole(sample) * f64::from(component.code_chips) / length).fract();
        let last = (0.99 * scene.samples as f64 / period_samples).floor() - 2.0;
        let earlier = ((at * last).floor() * period_samples) as u64;
        let from = next_period(earlier, phase(earlier), period_samples);
        let to = next_period(from + 9, phase(from + 9), period_samples);
        let [here, there] = [from, to].map(|sample| rays.at(0, sample).unwrap());
        let count = (to - from) as f64;
        let sent_s = count / rate_hz - (there.delay_s - here.delay_s);
        let (turns, step) = transmitter.turns_at(scene, from, &here);
        let gained = (there.carrier_cycles - here.carrier_cycles) / count - off_hz / rate_hz;
        let nco = Nco {
            carrier: turns,
            carrier_step: step.wrapping_sub((gained * 18_446_744_073_709_551_616.0) as i64 as u64),
            code: chips_to_units((phase(from) * length + off_chips).rem_euclid(length)),
            code_step: chips_to_units(sent_s * component.chip_rate_hz / count) as u64,
        };
        let (replica, code) = replica(transmitter.link(), component, whole((from + to) / 2));
        let quarter = chips_to_units(0.25);
        let taps = [quarter, 0, -quarter];
        let part = |plane: &[f32]| plane[from as usize..to as usize].to_vec();
        let sampled = replica.slow(&part(i), &part(q), &nco, &taps);
        let mut modelled = [Complex64::ZERO; 3];
        model.sums(&[Interval { nco, from, to, end: to }], &code, &taps, &mut modelled);
        [sampled, modelled]
    }
}

/// Calls `with` for a scene without noise.
fn with_both(scene: &Scene, sv: Sv, with: &mut dyn FnMut(&Both)) {
    let mut fronts = Fronts::new(std::slice::from_ref(scene), &mut (), &Options::default()).unwrap();
    fronts.pass(&[0], scene.samples, &|_| true, &mut ()).unwrap();
    let transmitters = fronts.transmitters().next().unwrap();
    let plan = Plan::new(scene, &Settings::default());
    let transmitter = transmitters.iter().find(|one| one.sv == sv).unwrap();
    with(&Both { scene, planes: samples(scene), model: plan.over(transmitters, 0), transmitter });
}

/// Every component of every signal that the level takes, beside the others of its satellite. Sums of samples
/// weigh the code's transitions, some 500 in a period, by their positions between samples: that leaves 0.4
/// mm, and a share 1e-3 of the code's error. Loops without noise stay within decimetres. A change of the
/// symbol at the first sample would weigh half a sample, 3 mm, so periods are taken elsewhere.
fn code_and_carrier_are_those_of_samples(is_in: fn(&Signal) -> bool, most: (f64, f64)) {
    let mut missed = Vec::new();
    let taken = |signal: &&'static Signal| refusal::signal(signal).is_none() && is_in(signal);
    for signal in SIGNALS.into_iter().filter(taken) {
        let has_steps = signal.components.iter().any(|one| one.steps_per_chip() > 1);
        let rate_hz = match (signal.components[0].chip_rate_hz < 3e6, has_steps) {
            (true, true) => 88.7e6,
            (true, false) => 43.7e6,
            (false, _) => 61.3e6,
        };
        // A symbol that changes at the first sample of a period, as each of L2C may, weighs up to half a
        // sample.
        let is_long = signal.components.iter().any(|one| one.code_chips > lead(signal).unwrap().code_chips);
        let most = if is_long { bounds(signal) } else { most };
        // A budget is held against nothing smaller.
        let (bound_m, bound_cycles) = bounds(signal);
        assert!(most.0 <= bound_m && most.1 <= bound_cycles, "{signal}");
        let sv = first(&at_rest(signal, rate_hz, 0.02, ""));
        let period_s = lead(signal).unwrap().period_s();
        let only = format!("[satellites]\nonly = [\"{sv}\"]\n");
        let scene = at_rest(signal, rate_hz, 0.02 + 9.0 * period_s.min(0.011), &only);
        with_both(&scene, sv, &mut |both| {
            for (index, component) in signal.components.iter().enumerate() {
                let chip_m = SPEED_OF_LIGHT_MPS / component.chip_rate_hz;
                for (at, off_chips, off_hz) in [(0.0, 0.0, 0.0), (0.5, 0.0005, 3.0), (1.0, -0.0005, -40.0)] {
                    // Cross-correlation counts as constant in a period: 7 mm and 1.7e-4 cycle at 40 Hz.
                    let most_hz = if signal.components.len() > 1 { 3.0 } else { 40.0 };
                    let off_hz = f64::clamp(off_hz, -most_hz, most_hz) * (1e-3 / period_s).min(1.0);
                    let [sampled, modelled] = both.sums(index, at, (off_chips, off_hz));
                    let turn = modelled[1].conj() / modelled[1].norm();
                    let (code_m, cycles) = errors(sampled, turn, chip_m);
                    let (own_m, own_cycles) = errors(modelled, turn, chip_m);
                    let height = sampled[1].norm() / modelled[1].norm();
                    let apart = (code_m - own_m, cycles - own_cycles, height - 1.0);
                    let place = format!("{signal} {index} {at}: {own_m:.4} m, apart {apart:?}");
                    println!("{place}");
                    if !(apart.0.abs() < most.0 && apart.1.abs() < most.1 && apart.2.abs() < HEIGHT) {
                        missed.push(place);
                    }
                }
            }
        });
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn without_noise_rectangular_chips_give_code_and_carrier_of_samples_within_1_mm_and_1e_4_cycle() {
    let is_rectangular = |signal: &Signal| signal.components.iter().all(|one| one.steps_per_chip() == 1);
    code_and_carrier_are_those_of_samples(is_rectangular, (1e-3, 1e-4));
}

/// BOC(6,1) has seven samples in a step here, so that transitions weigh more than those of chips. At half the
/// rate samples differ by up to 3 cm (GPS L1C, BeiDou B1C), which is theirs: the model has no rate.
#[test]
fn without_noise_sub_carriers_give_code_and_carrier_of_samples_within_2_cm_and_2e_4_cycle() {
    let has_steps = |signal: &Signal| signal.components.iter().any(|one| one.steps_per_chip() > 1);
    code_and_carrier_are_those_of_samples(has_steps, (2e-2, 2e-4));
}

/// Two walls. Reflections of other satellites have half of their amplitude and more, up to a chip later.
const WALLS: &str = "[[multipath]]\nkind = \"wall\"\nazimuth_deg = 80\ndistance_m = 120\namplitude = 0.7\n\
                     [[multipath]]\nkind = \"wall\"\nazimuth_deg = 260\ndistance_m = 30\namplitude = 0.6\n";

/// Ten satellites make a tenth of a prompt, and their reflections nearly as much. What is left of it are
/// positions of transitions between samples, and a change of the Doppler within the second. Of C/A 0.5 % of
/// the prompt are left; without the phases of reflections it would be 2.5 %.
#[test]
fn without_noise_other_satellites_are_found_in_a_short_code_as_in_samples_within_a_fiftieth() {
    for (name, rest, most) in [("GPS L1 C/A", "", 0.02), ("BeiDou B1I", "", 0.02), ("GPS L1 C/A", WALLS, 0.01)] {
        let signal = Signal::find(name).unwrap();
        let scene = at_rest(signal, 43.7e6, 0.03, rest);
        let sv = first(&scene);
        with_both(&scene, sv, &mut |both| {
            for at in [0.0, 0.3, 0.6, 1.0] {
                let [sampled, modelled] = both.sums(0, at, (0.1, 20.0));
                for (sampled, modelled) in sampled.iter().zip(modelled) {
                    let apart = (sampled - modelled).norm() / sampled.norm();
                    println!("{name} {at} {apart:.1e}");
                    assert!(apart < most, "{name} {at}: {sampled} and {modelled}");
                }
            }
        });
    }
}

/// Code periods one after another from a sample on, with the steps of the oscillators that the first ray has
/// there, off by so many chips and hertz.
fn following(scene: &Scene, transmitter: &Transmitter, first: u64, (off_chips, off_hz): (f64, f64)) -> Vec<Interval> {
    let rate_hz = scene.clock.rate.hz();
    let component = lead(transmitter.signal).unwrap();
    let rays = transmitter.rays(scene, first).unwrap();
    let (length, count) = (f64::from(component.code_chips), (rate_hz * 1e-3).round() as u64);
    let [here, there] = [first, first + count].map(|sample| rays.at(0, sample).unwrap());
    let share = transmitter.code_at(scene, 0, first, here.delay_s).unwrap().share;
    let sent_s = count as f64 / rate_hz - (there.delay_s - here.delay_s);
    let (carrier, step) = transmitter.turns_at(scene, first, &here);
    let gained = (there.carrier_cycles - here.carrier_cycles) / count as f64 - off_hz / rate_hz;
    let (mut code, period) = (chips_to_units(share * length + off_chips), chips_to_units(length));
    let code_step = chips_to_units(sent_s * component.chip_rate_hz / count as f64);
    let carrier_step = step.wrapping_sub((gained * 18_446_744_073_709_551_616.0) as i64 as u64);
    let (mut from, mut all) = (first, Vec::new());
    for _ in 0..41 {
        let to = from + ((period - code) as u64).div_ceil(code_step as u64);
        let carrier = carrier.wrapping_add(carrier_step.wrapping_mul(from - first));
        let nco = Nco { carrier, carrier_step, code, code_step: code_step as u64 };
        all.push(Interval { nco, from, to, end: to });
        code += code_step * (to - from) as i64 - period;
        from = to;
    }
    // The first one is a part of a period.
    all.split_off(1)
}

/// Noise is the same to the bit. A line misses the corner of the prompt by 1.3e-4 of the height. Other
/// satellites are looked up at positions of 1/128 chip. The code of C/A moves by half of one in four periods,
/// that of B1I by one and a third, and rounding adds one. From one lag to the next a sum of n chips changes
/// by √(2/n) of the other's amplitude rms: 4.4 % and 3.1 %. Ten satellites of like amplitude move the sum by
/// √10·0.044/128 = 1.1e-3 rms where one position is met at all, and by 1.5e-3 where two are; three of those
/// are the bound of B1I. Ten code periods have edges of symbols in them, whichever ten.
#[test]
fn code_periods_that_are_answered_together_have_the_sums_of_each_alone() {
    for (name, rest, most) in [
        ("GPS L1 C/A", "[noise]\n", 3.3e-3),
        ("GPS L1 C/A", WALLS, 3.3e-3),
        ("BeiDou B1I", "", 5e-3),
        ("GPS L5", "[noise]\n", 2e-4),
    ] {
        let signal = Signal::find(name).unwrap();
        let scene = at_rest(signal, 25e6, 0.2, rest);
        let sv = first(&scene);
        let mut fronts = Fronts::new(std::slice::from_ref(&scene), &mut (), &Options::default()).unwrap();
        fronts.pass(&[0], scene.samples, &|_| true, &mut ()).unwrap();
        let transmitters = fronts.transmitters().next().unwrap();
        let plan = Plan::new(&scene, &Settings::default());
        let transmitter = transmitters.iter().find(|one| one.sv == sv).unwrap();
        let model = plan.over(transmitters, 0);
        let settings = Settings::default().tracking;
        let code = Code::new(transmitter.link(), lead(signal).unwrap(), (settings.waveform, settings.replica));
        let quarter = chips_to_units(0.25);
        let taps = [quarter, 0, -quarter];
        for (off_chips, off_hz) in [(0.0, 0.0), (0.03, 12.0), (-0.2, -40.0)] {
            let intervals = following(&scene, transmitter, 250_000, (off_chips, off_hz));
            for together in intervals.chunks(10) {
                let mut sums = vec![Complex64::ZERO; 3 * together.len()];
                model.sums(together, &code, &taps, &mut sums);
                for (sums, interval) in sums.chunks(3).zip(together) {
                    let mut alone = [Complex64::ZERO; 3];
                    model.sums(std::slice::from_ref(interval), &code, &taps, &mut alone);
                    let height = alone[1].norm();
                    for (one, other) in sums.iter().zip(alone) {
                        assert!((one - other).norm() < most * height, "{name} {off_hz}: {one} and {other}");
                    }
                }
            }
        }
    }
}

fn kanpur(duration_s: f64, rest: &str) -> Scene {
    let text = format!(
        "name = \"static\"\nstart = 2010-07-01T08:05:58\nduration_s = {duration_s}\nseed = 1\nnoise = {{}}\n\
         motion = {{ kind = \"static\", latitude_deg = 26.5123, longitude_deg = 80.2329, height_m = 130 }}\n\
         receiver_clock = {{ bias_s = 1.3e-4, drift_sps = 5e-8 }}\n{rest}"
    );
    Scenario::from_toml(&text).unwrap().scene().unwrap()
}

/// C/N0 of each satellite in dB-Hz, and deviation of its code discriminator, from 30 s on.
fn levels(records: &[Record], scene: &Scene) -> BTreeMap<Sv, (f64, f64)> {
    let late = (30.0 * scene.clock.rate.hz()) as u64;
    let mut sums: BTreeMap<Sv, [f64; 3]> = BTreeMap::new();
    for record in records {
        let Record::Tracking(row) = record else { continue };
        if row.sample > late {
            let sum = sums.entry(row.sv).or_default();
            let code = row.dll_discriminator_chips;
            sum.iter_mut().zip([1.0, row.cn0_dbhz, code * code]).for_each(|(sum, one)| *sum += one);
        }
    }
    sums.into_iter().map(|(sv, [n, cn0, square])| (sv, (cn0 / n, (square / n).sqrt()))).collect()
}

fn fixes(records: &[Record]) -> Vec<&Fix> {
    records.iter().filter_map(|record| if let Record::Fix(fix) = record { Some(fix) } else { None }).collect()
}

#[test]
fn a_reception_by_correlations_finds_the_satellites_strengths_noise_and_positions_of_one_of_samples() {
    let scene = kanpur(44.0, "");
    let scenes = std::slice::from_ref(&scene);
    let settings = Settings::default();
    let (mut sampled, mut modelled): (Vec<Record>, Vec<Record>) = (Vec::new(), Vec::new());
    let begin = std::time::Instant::now();
    let by_samples = crate::run(scenes, &settings, &mut (), &mut sampled).unwrap();
    let samples_s = begin.elapsed().as_secs_f64();
    let by_model = run(scenes, &settings, (&mut (), &mut modelled), &mut |_| ()).unwrap();
    println!("samples {samples_s:.2} s, correlations {:.2} s", begin.elapsed().as_secs_f64() - samples_s);
    println!("{}\n{}", by_samples.outcome, by_model.outcome);
    assert_eq!(by_samples.outcome.acquired, by_model.outcome.acquired);
    assert_eq!(by_samples.outcome.used, by_model.outcome.used);
    assert_eq!(by_samples.generated[0].satellites, by_model.generated[0].satellites);
    assert_eq!((by_samples.generated[0].samples, by_model.generated[0].samples), (scene.samples, 0));
    let [all, own] = [&sampled, &modelled].map(|records| levels(records, &scene));
    for (sv, (cn0_dbhz, chips)) in &all {
        let (own_dbhz, own_chips) = own[sv];
        println!("{sv} {cn0_dbhz:.2} {own_dbhz:.2} dB-Hz, {chips:.4} {own_chips:.4} chips");
    }
    for (sv, (cn0_dbhz, chips)) in &all {
        let (own_dbhz, own_chips) = own[sv];
        // 280 independent values of a discriminator: 4 % each, four deviations of the difference.
        assert!((cn0_dbhz - own_dbhz).abs() < 0.5 && (own_chips / chips - 1.0).abs() < 0.25, "{sv}");
    }
    let [all, own] = [&sampled, &modelled].map(|records| fixes(records));
    assert!(!all.is_empty() && all.len().abs_diff(own.len()) <= 1, "{} and {}", all.len(), own.len());
    let (a, b) = (all[all.len() - 1], own[own.len() - 1]);
    let apart_m = ((a.x_m - b.x_m).powi(2) + (a.y_m - b.y_m).powi(2) + (a.z_m - b.z_m).powi(2)).sqrt();
    println!("apart {apart_m:.2} m, first fix {:?} {:?}", by_samples.outcome.first_fix_s, by_model.outcome.first_fix_s);
    // Each within its own noise, half a metre horizontally and a metre in height.
    assert!(apart_m < 5.0, "{apart_m}");
}

#[test]
fn the_same_records_come_at_any_number_of_threads() {
    let scene = kanpur(3.0, "");
    let one = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut records: Vec<Record> = Vec::new();
        let scenes = std::slice::from_ref(&scene);
        pool.install(|| run(scenes, &Settings::default(), (&mut (), &mut records), &mut |_| ())).unwrap();
        format!("{records:?}")
    };
    assert_eq!(one(1), one(3));
}

#[test]
fn an_effect_without_a_model_is_refused_by_name() {
    let refused = |rest: &str| refuse(&[kanpur(1.0, rest)]).map(|_| ()).unwrap_err().to_string();
    assert!(refused("[front_end]\nsample_rate_hz = 2.6e6\nif_hz = 6e5\nformat = \"ri8\"\n").contains("ri8"));
    assert!(refused("[fidelity]\ncode_edge = \"band_limited\"\n").contains("band_limited"));
    let filtered = refused("[filter]\nkind = \"brick_wall\"\nbandwidth_hz = 2.2e6\n");
    assert!(filtered.contains("[filter]") && filtered.contains("run --level"), "{filtered}");
    let jammer = "[[interference]]\nkind = \"cw\"\njs_db = 20\noffset_hz = 1e5\n";
    assert!(refused(jammer).contains("[[interference]]"));
    assert!(refuse(&[kanpur(1.0, ""), kanpur(1.0, "[fidelity]\ncode_edge = \"band_limited\"\n")]).is_err());
    assert!(refuse(&[kanpur(1.0, "")]).is_ok());
}

/// A scene with a budget that this level keeps is not sampled; one that it does not keep says which error, or
/// which effect, is why.
#[test]
fn a_budget_takes_this_level_where_its_errors_and_effects_allow_it() {
    let reason = |rest: &str, budget: &str| {
        broken(&[kanpur(1.0, &format!("{rest}[fidelity]\nbudget = {{ {budget} }}\n"))]).unwrap()
    };
    assert_eq!(reason("", "code_m = 3.0, carrier_cycles = 1e-3, cn0_db = 0.5"), None);
    // Samples would need band-limited edges, a model does not.
    assert_eq!(reason("", "code_m = 0.06, carrier_cycles = 1e-3"), None);
    let jammer = "[[interference]]\nkind = \"noise\"\nbandwidth_hz = 1e5\njs_db = 20\n";
    for (rest, budget, why) in [
        ("", "code_m = 3.0, carrier_cycles = 1e-4", "carrier up to"),
        ("", "cn0_db = 0.1", "C/N0 of GPS L1 C/A"),
        (jammer, "code_m = 3.0", "[[interference]]"),
        ("[scintillation]\ns4 = 0.5\ndecorrelation_s = 1\n", "code_m = 3.0", "[scintillation]"),
        ("[power]\ncn0_dbhz = 50\nsatellites = { G03 = 30 }\n", "code_m = 3.0", "dB apart"),
    ] {
        let found = reason(rest, budget).unwrap_or_default();
        assert!(found.contains(why), "{rest} {budget}: {found}");
    }
    assert_eq!(broken(&[kanpur(1.0, "")]).unwrap(), None);
}
