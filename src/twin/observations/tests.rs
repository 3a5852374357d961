//! Modelled observations against the truth, their own laws, and a reception by correlations.

use std::collections::BTreeMap;
use std::path::Path;

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use gnss::record::{Event, EventRow, Observation};
use gnss::satellite::Sv;
use receiver::output::Record;

use super::*;
use crate::correlations;

const PLACE: &str = "latitude_deg = 26.5123, longitude_deg = 80.2329, height_m = 130";

fn scene(rest: &str) -> Scene {
    let text = format!("name = \"one\"\nstart = 2010-07-01T08:05:58\n{rest}");
    let text = if text.contains("motion") {
        text
    } else {
        text.replacen("start", &format!("motion = {{ kind = \"static\", {PLACE} }}\nstart"), 1)
    };
    let files = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios"));
    Scenario::from_toml(&text).unwrap().compose(files, &Overrides::default()).unwrap().0
}

/// Records of a scene, and the true observations.
fn received(scene: &Scene, settings: &Settings) -> (Vec<Record>, BTreeMap<(u64, Sv), Observation>, Done) {
    let (mut truth, mut records): (Vec<truth::Record>, Vec<Record>) = (Vec::new(), Vec::new());
    let sinks: (&mut (dyn truth::Sink + Send), &mut (dyn output::Sink + Send)) = (&mut truth, &mut records);
    let done = run(std::slice::from_ref(scene), settings, sinks, &mut |_| ()).unwrap();
    let of = |record: truth::Record| match record {
        truth::Record::Observation(row) => Some(((row.sample, row.sv), row)),
        _ => None,
    };
    (records, truth.into_iter().filter_map(of).collect(), done)
}

fn observations(records: &[Record]) -> impl Iterator<Item = &Observation> {
    records.iter().filter_map(|record| match record {
        Record::Observation(row) => Some(row),
        _ => None,
    })
}

fn events(records: &[Record]) -> impl Iterator<Item = &EventRow> {
    records.iter().filter_map(|record| match record {
        Record::Event(row) => Some(row),
        _ => None,
    })
}

#[test]
fn an_observation_without_noise_is_the_truth_s() {
    let scene = scene(
        "duration_s = 22\nreceiver_clock = { bias_s = 1.3e-4, drift_sps = 5e-8 }\n\
         front_end = { sample_rate_hz = 2.6e6, format = \"cf32\" }\nionosphere = { model = \"klobuchar\" }\n",
    );
    let (records, truth, _) = received(&scene, &Settings::default());
    let mut wholes: BTreeMap<Sv, f64> = BTreeMap::new();
    let mut count = 0;
    for row in observations(&records) {
        let Some(own) = truth.get(&(row.sample, row.sv)) else { continue };
        let code_m = row.pseudorange_m - own.pseudorange_m;
        let cycles = row.carrier_cycles - own.carrier_cycles;
        let whole = *wholes.entry(row.sv).or_insert_with(|| cycles.round());
        assert!(code_m.abs() < 1e-3, "{} at {}: {code_m} m", row.sv, row.sample);
        assert!((cycles - whole).abs() < 1e-4, "{} at {}: {} cycles", row.sv, row.sample, cycles - whole);
        assert!((row.doppler_hz - own.doppler_hz).abs() < 1e-2, "{} {}", row.doppler_hz, own.doppler_hz);
        count += 1;
    }
    assert!(count > 500 && wholes.len() > 10, "{count} of {}", wholes.len());
}

#[test]
fn records_do_not_depend_on_the_number_of_threads() {
    let scene = scene("duration_s = 25\nnoise = {}\n");
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (records, _, _) = pool.install(|| received(&scene, &Settings::default()));
        format!("{records:?}")
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn errors_of_code_and_carrier_have_the_deviations_of_their_loops() {
    let scene = scene("duration_s = 620\nnoise = {}\npower = { cn0_dbhz = 42 }\ntruth = { interval_s = 1 }\n");
    let mut settings = Settings::default();
    (settings.operation.measurement_interval_ms, settings.operation.tracking_interval_ms) = (1000, 1000);
    settings.tracking.dll_bandwidth_hz = 1.0;
    let (records, truth, _) = received(&scene, &settings);
    let plan = Plan::new(&scene, &settings_for(std::slice::from_ref(&scene), &settings));
    let law = Law::new((&scene, &plan, 0), scene.signals[0], &settings, 1.0).unwrap();
    let (mut code, mut carrier, mut count) = (0.0, 0.0, 0.0);
    let mut wholes: BTreeMap<Sv, f64> = BTreeMap::new();
    for row in observations(&records) {
        let Some(own) = truth.get(&(row.sample, row.sv)) else { continue };
        let cycles = row.carrier_cycles - own.carrier_cycles;
        let whole = *wholes.entry(row.sv).or_insert_with(|| cycles.round());
        code += (row.pseudorange_m - own.pseudorange_m).powi(2);
        carrier += (cycles - whole).powi(2);
        count += 1.0;
    }
    // The other satellites take a tenth of a decibel.
    let cn0_hz = libm::pow(10.0, 4.2) / 1.03;
    let (code_m, carrier_cycles) = (f64::sqrt(code / count), f64::sqrt(carrier / count));
    let theory_m = law.code.sigma_m(cn0_hz);
    let theory_cycles = law.carrier_variance(cn0_hz).0.sqrt() / std::f64::consts::TAU;
    // Six thousand rows know a deviation to one per cent; a second holds four time constants of the code.
    assert!(count > 5000.0, "{count}");
    assert!((code_m / theory_m - 1.0).abs() < 0.05, "{code_m} m for {theory_m}");
    assert!((carrier_cycles / theory_cycles - 1.0).abs() < 0.05, "{carrier_cycles} cycles for {theory_cycles}");
}

#[test]
fn the_first_fix_comes_within_a_second_of_that_by_correlations() {
    let scene = scene(
        "duration_s = 30\nnoise = {}\npower = { kind = \"link_budget\" }\n\
         receiver_clock = { bias_s = 1.3e-4, drift_sps = 5e-8 }\nfront_end = { sample_rate_hz = 2.6e6 }\n",
    );
    let settings = Settings::default();
    let (_, _, own) = received(&scene, &settings);
    let mut records: Vec<Record> = Vec::new();
    let sinks: (&mut (dyn truth::Sink + Send), &mut (dyn output::Sink + Send)) = (&mut (), &mut records);
    let other = correlations::run(std::slice::from_ref(&scene), &settings, sinks, &mut |_| ()).unwrap();
    let (own, other) = (own.outcome, other.outcome);
    let [own_s, other_s] = [&own, &other].map(|outcome| outcome.first_fix_s.unwrap());
    assert!((own_s - other_s).abs() <= 1.0, "{own_s} s and {other_s} s");
    assert_eq!((own.acquired.len(), own.losses), (other.acquired.len(), 0));
}

#[test]
fn an_occluded_satellite_is_lost_and_comes_back() {
    // A wall to the north for as long as the walk passes it.
    let scene = scene(
        "duration_s = 75\nnoise = {}\npower = { cn0_dbhz = 45 }\nsatellites = { mask_deg = 5 }\n\
         [motion]\nkind = \"waypoints\"\nacceleration_mps2 = 2\njerk_mps3 = 2\n\
         [[motion.point]]\nlatitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130\nspeed_mps = 0\n\
         hold_s = 30\n\
         [[motion.point]]\nlatitude_deg = 26.5165\nlongitude_deg = 80.2329\nheight_m = 130\nspeed_mps = 8\n\
         [[obstruction]]\nkind = \"building\"\neast_m = [4, 30]\nnorth_m = [40, 140]\ntop_m = 60\n",
    );
    let (records, _, done) = received(&scene, &Settings::default());
    let rate_hz = scene.clock.rate.hz();
    let lost: Vec<&EventRow> = events(&records).filter(|row| row.event == Event::LossOfLock).collect();
    assert!(!lost.is_empty() && lost.len() == done.outcome.losses as usize);
    let again = |loss: &EventRow| {
        let found =
            events(&records).find(|row| row.sv == loss.sv && row.event == Event::Acquired && row.sample > loss.sample);
        found.map(|row| (row.sample - loss.sample) as f64 / rate_hz)
    };
    let back: Vec<f64> = lost.iter().filter_map(|loss| again(loss)).collect();
    assert!(!back.is_empty(), "{lost:?}");
    // Nothing is measured of a satellite between.
    for (loss, back_s) in lost.iter().zip(&back) {
        let until = loss.sample + (back_s * rate_hz) as u64;
        let between = |row: &&Observation| row.sv == loss.sv && row.sample > loss.sample && row.sample < until;
        assert_eq!(observations(&records).find(between).map(|row| row.sample), None, "{}", loss.sv);
    }
}

#[test]
fn what_has_no_model_is_refused_by_name() {
    let refused = |rest: &str| {
        let mut scene = scene(&format!("duration_s = 1\nnoise = {{}}\n{rest}"));
        scene.fidelity.grade = generator::fidelity::Grade::Observations;
        refuse(std::slice::from_ref(&scene)).unwrap_err().to_string()
    };
    for (rest, name) in [
        ("[[interference]]\nkind = \"cw\"\njs_db = 20\n", "[[interference]]"),
        ("[scintillation]\ns4 = 0.5\ndecorrelation_s = 1\n", "[scintillation]"),
    ] {
        let text = refused(rest);
        assert!(text.contains(name) && text.contains("level = \"observations\""), "{text}");
    }
}

#[test]
fn an_oscillator_leaves_the_errors_in_the_loops_that_it_leaves_in_those_by_correlations() {
    let scene = scene(
        "duration_s = 60\nreceiver_clock = { oscillator = \"tcxo\" }\nsatellites = { mask_deg = 40 }\n\
         front_end = { sample_rate_hz = 2.6e6, format = \"cf32\" }\n",
    );
    let settings = Settings::default();
    let (own, truth, _) = received(&scene, &settings);
    let mut other: Vec<Record> = Vec::new();
    let sinks: (&mut (dyn truth::Sink + Send), &mut (dyn output::Sink + Send)) = (&mut (), &mut other);
    correlations::run(std::slice::from_ref(&scene), &settings, sinks, &mut |_| ()).unwrap();
    let errors = |records: &[Record]| -> BTreeMap<u64, (f64, f64)> {
        let error = |row: &Observation| {
            let own = truth.get(&(row.sample, row.sv))?;
            Some((row.sample, (row.carrier_cycles - own.carrier_cycles, row.doppler_hz - own.doppler_hz)))
        };
        // From lock on, and less the whole number.
        let rows: BTreeMap<_, _> = observations(records).filter_map(error).skip(20).collect();
        let whole = rows.values().next().map_or(0.0, |(cycles, _)| (2.0 * cycles).round() / 2.0);
        rows.into_iter().map(|(sample, (cycles, hz))| (sample, (cycles - whole, hz))).collect()
    };
    let (own, other) = (errors(&own), errors(&other));
    let pairs: Vec<[f64; 4]> = (own.iter())
        .filter_map(|(sample, (cycles, hz))| other.get(sample).map(|other| [*cycles, other.0, *hz, other.1]))
        .collect();
    assert!(pairs.len() > 250, "{} of {} and {}", pairs.len(), own.len(), other.len());
    let rms =
        |of: fn(&[f64; 4]) -> f64| (pairs.iter().map(|pair| of(pair).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt();
    let cycles = [rms(|pair| pair[0]), rms(|pair| pair[1]), rms(|pair| pair[0] - pair[1])];
    let hz = [rms(|pair| pair[2]), rms(|pair| pair[3]), rms(|pair| pair[2] - pair[3])];
    // Both loops see the same noise, and the other's begin at the symbols of each satellite: errors of four
    // satellites there are 0.0072 to 0.0086 cycles, of 0.0003 to 0.0008 without the oscillator.
    for [own, other, apart] in [cycles, hz] {
        assert!(other > 0.0 && (own / other - 1.0).abs() < 0.12, "{own} for {other}");
        assert!(apart < 0.5 * other, "{apart} of {other}");
    }
}
