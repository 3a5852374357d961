//! Cases 5 and 62 to 64: carrier, code and sub-carrier of every signal after a month, and its longest codes
//! where they end.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

use generator::catalogue::Catalogue;
use generator::effect::ionosphere::KlobucharIonosphere;
use generator::scene::Scene;
use generator::sky;
use generator::synth::Edge;
use generator::synth::waveform::Waveform;
use generator::transmit::Transmitter;
use generator::truth;
use generator::vehicle::{Motion, Trajectory};
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::klobuchar::Klobuchar;
use gnss::rinex;
use gnss::satellite::{Sv, System};
use gnss::signal::{Carrier, Component, Layers, SIGNALS, Signal};
use gnss::time::Epoch;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::exact::{CLOCK, Exact, ONE, TURN, signed};
use crate::figures::{self, ALL, Worst, case};
use crate::{run, skies};

pub const RATE_HZ: f64 = 65e6;
pub const IF_HZ: f64 = 4.092e6;
pub const RUN: u64 = 4096;
pub const DAY_S: u64 = 86_400;
const KNOTS: &str = "[fidelity]\nlevel = \"reference\"\ncode_edge = \"nearest\"\ncarrier = \"f64\"\n\
                     knot_tolerance_cycles = 1e-6\n";

/// A scene of one signal whose sample 0 lies `before_s` seconds before the start of its system's sky.
pub fn late(signal: &'static Signal, rate_hz: f64, if_hz: f64, before_s: u64) -> (Scene, u64) {
    let front = skies::front_end(signal, rate_hz, if_hz);
    let mut scene = skies::scene(&[signal], 60.0, &format!("{front}{CLOCK}{KNOTS}"));
    scene.clock.start = Epoch::new(scene.clock.start.seconds() - before_s as i64, 0.0);
    let first = before_s * rate_hz as u64;
    scene.samples += first;
    (scene, first)
}

/// Puts the antenna on the ground below a satellite.
pub fn below(scene: &mut Scene, sv: Sv, at: Epoch) -> bool {
    let Some((state, _)) = scene.catalogue.truth(sv, at).unwrap() else { return false };
    let place = Geodetic { height_m: 100.0, ..Geodetic::from_ecef(&state.position_m) };
    scene.trajectory = Trajectory::fixed(place.to_ecef());
    let motion = Motion::at_rest(place.to_ecef());
    sky::emission(&scene.catalogue, sv, at, &motion).unwrap().is_some()
}

/// Satellites of a scene that send a signal.
pub fn senders(scene: &Scene, signal: &'static Signal) -> Vec<Sv> {
    let sends = |sv: &Sv| scene.signals_of(*sv).any(|own| own == signal);
    scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)).filter(sends).collect()
}

/// The sky of a signal whose satellites divide the band, with a satellite on every channel: those that are
/// missing fly where the first one does.
fn on_every_channel(scene: &mut Scene, signal: &'static Signal) {
    let own = senders(scene, signal);
    let mut channels = BTreeSet::new();
    let set = |sv: Sv| scene.catalogue.sent_at(sv, scene.clock.start).cloned();
    let first = own.iter().find_map(|sv| set(*sv)).unwrap();
    let others = signal.satellites().filter(|sv| !own.contains(sv));
    let sets = own.iter().copied().chain(others).filter(|sv| channels.insert(signal.link(*sv).channel()));
    let sets = sets.map(|sv| gnss::broadcast::Ephemeris { sv, ..set(sv).unwrap_or_else(|| first.clone()) });
    scene.catalogue = Arc::new(Catalogue::new(sets.collect()).0);
}

/// Largest errors of carrier, code, their difference and every sequence of a signal, and how many places were
/// looked at.
#[derive(Default)]
struct Errors {
    carrier: Worst,
    code_m: Worst,
    parted_m: Worst,
    ionosphere_m: Worst,
    sequences_m: Worst,
    places: usize,
    channels: BTreeSet<i8>,
}

/// Carrier and code of all satellites of a signal so many days after sample 0, through an ionosphere where
/// there is one.
fn errors(signal: &'static Signal, days: u64, ionosphere: Option<Klobuchar>) -> Errors {
    let (mut scene, first) = late(signal, RATE_HZ, IF_HZ, days * DAY_S);
    let at = scene.clock.epoch(first);
    if matches!(signal.carrier, Carrier::Channels { .. }) {
        let begun = std::mem::replace(&mut scene.clock.start, at);
        on_every_channel(&mut scene, signal);
        scene.clock.start = begun;
    }
    let most = if matches!(signal.carrier, Carrier::Channels { .. }) || figures::long() { usize::MAX } else { 6 };
    if let Some(model) = ionosphere {
        scene.effects.push(Box::new(KlobucharIonosphere::of_gps(model)));
    }
    let mut errors = Errors::default();
    for sv in senders(&scene, signal).into_iter().take(most) {
        if !below(&mut scene, sv, at) {
            continue;
        }
        let Some(mut transmitter) = Transmitter::new(&scene, sv, signal, Edge::Nearest).unwrap() else { continue };
        let exact = Exact::new(&scene, sv, signal);
        let voices: Vec<_> = (0..signal.components.len())
            .filter_map(|index| Waveform::new(signal.link(sv), index).unwrap())
            .flat_map(|waveform| waveform.voices(Layers::Whole, Edge::Nearest, RATE_HZ).unwrap())
            .collect();
        let error_m = |found: (i64, u128), n: u64, delay: i128, (steps, step_hz): (u32, f64)| {
            let step_mhz = (step_hz * 1e3).round() as i128;
            let found = i128::from(found.0) * (i128::from(steps) << 48) + found.1 as i128;
            let apart = (exact.steps(n, delay, step_mhz) - found) as f64 / ONE;
            apart / step_hz * SPEED_OF_LIGHT_MPS
        };
        for n in (1..4).map(|k| (first / RUN + k * 34_241) * RUN) {
            transmitter.prepare_alone(&scene, n, n + RUN).unwrap();
            if !transmitter.in_view(&scene, n) {
                continue;
            }
            let input = || format!("{signal} of {sv}, sample {n}");
            let (turns, code) = transmitter.phases(&scene, n).unwrap();
            let delay = exact.delay(n);
            // What the air adds, of which the truth's own rays say how much.
            let ray = truth::seen(&scene, sv, signal, scene.clock.epoch(n)).unwrap().unwrap().rays[0];
            let (code_s, carrier_s) = (ray.code_delay_s, ray.carrier_delay_s);
            let sequence = &voices[0].spreading;
            // The first component's phase is not the signal's.
            let own = signal.components[0].phase_cycles + voices[0].phase_cycles;
            let cycles = signed(exact.carrier(n, delay).wrapping_sub(turns)) + own - carrier_s * signal.carrier_hz(sv);
            let cycles = cycles - cycles.round();
            errors.carrier.take(cycles.abs(), input);
            let pace =
                |sequence: &generator::synth::chips::Spreading| (sequence.pace().steps, sequence.pace().step_rate_hz());
            let code_m = error_m((code.period, code.phase()), n, delay, pace(sequence)) - code_s * SPEED_OF_LIGHT_MPS;
            errors.code_m.take(code_m.abs(), input);
            errors.ionosphere_m.take((code_s - carrier_s) * SPEED_OF_LIGHT_MPS, input);
            errors.parted_m.take((code_m - cycles * signal.wavelength_m(sv)).abs(), input);
            for voice in &voices {
                let place = voice.spreading.at(scene.clock.epoch(n), exact.seconds(delay));
                let apart_m = error_m((place.period, place.phase()), n, delay, pace(&voice.spreading));
                errors
                    .sequences_m
                    .take(apart_m.abs(), || format!("{}, {:.3} MHz", input(), pace(&voice.spreading).1 / 1e6));
            }
            errors.places += 1;
            if let Carrier::Channels { channel, .. } = signal.carrier {
                errors.channels.extend(channel(sv.number));
            }
        }
    }
    errors
}

#[test]
fn after_a_month_at_65_msps_every_signal_has_its_carrier_its_codes_and_its_sub_carriers() {
    let the = case(5, "a day, and thirty", ALL);
    let fdma = case(62, "GLONASS channels −7 to +6 after thirty days", "GLONASS G1, G2");
    let band = case(63, "S band after thirty days", "NavIC S");
    for days in [1, 30] {
        let of: Vec<(&Signal, Errors)> =
            SIGNALS.par_iter().map(|signal| (*signal, errors(signal, days, None))).collect();
        let (mut carrier, mut code_m, mut sequences_m) = (Worst::default(), Worst::default(), Worst::default());
        let mut looked = 0;
        for (signal, errors) in of {
            looked += usize::from(errors.places >= 3);
            assert!(errors.places > 0, "{signal}");
            if days == 30 && signal.system == System::Glonass {
                fdma.at_most(&format!("{signal}: carrier"), errors.carrier.clone(), 1e-6, "cycle");
                // Twelve of the fourteen are assigned, the outermost among them (GLONASS constellation
                // status).
                let assigned = [-7, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6];
                let looked = assigned.iter().filter(|channel| errors.channels.contains(channel)).count();
                fdma.all(&format!("{signal}: assigned channels looked at"), looked, assigned.len());
            }
            if days == 30 && signal.name == "NavIC S" {
                band.at_most("carrier", errors.carrier.clone(), 1e-6, "cycle");
            }
            carrier.merge(errors.carrier);
            code_m.merge(errors.code_m);
            sequences_m.merge(errors.sequences_m);
        }
        // Half the knots' tolerance, 5e-7 cycle, and the floor of `f64`: coordinates of an orbit at 4.2e7 m
        // resolve 7.5e-9 m, 6e-8 cycle of S, and the sum of a delay and a month's drift, 0.2 s or 5e8 cycles,
        // 6e-8; a few of each on both sides.
        the.at_most(&format!("carrier after {days} d, to integers"), carrier, 1e-6, "cycle");
        // The same knots are 2.6e-7 m at the longest wave; a fraction of a second resolves 1.1e-16 s and so
        // does the delay, 3.3e-8 m each, three times.
        the.at_most(&format!("code after {days} d, whole periods and all"), code_m, 4e-7, "m");
        // No knots here: the fraction of a second, the delay and their difference, and the step's own 2^-48.
        let figure = format!("every sequence after {days} d: codes, BOC, CBOC, TMBOC, AltBOC's eighths");
        the.at_most(&figure, sequences_m, 1e-7, "m");
        the.all(&format!("signals with three phases and more after {days} d"), looked, SIGNALS.len());
    }
    let model = rinex::embedded().unwrap().klobuchar;
    let of: Vec<Errors> = SIGNALS.par_iter().map(|signal| errors(signal, 1, model)).collect();
    let (mut parted_m, mut least_m) = (Worst::default(), Worst::least());
    for errors in of {
        parted_m.merge(errors.parted_m);
        least_m.merge(errors.ionosphere_m);
    }
    // Of code and carrier the errors above; the range is the same in both.
    the.at_most("code and carrier after 1 d parted by other than 2I", parted_m, 4e-7, "m");
    // A hundred thousand of these errors: were it left out, it would show.
    the.at_least("least 2I of a signal", least_m, 0.5, "m");
}

/// A component's wave at a place of its code, by its tables alone, in units of its mean power.
struct Definition {
    component: &'static Component,
    code: Vec<i8>,
    secondary_code: Vec<i8>,
    /// Factor of the amplitude.
    gain: f64,
}

impl Definition {
    fn of(component: &'static Component, number: u8) -> Self {
        let code = (component.code)(number).unwrap();
        let secondary_code = component.secondary_code.of(number).unwrap();
        let mut wave = Self { component, code, secondary_code, gain: 1.0 };
        let steps = component.steps_per_chip();
        let places = wave.code.len() * steps;
        let power = (0..places).map(|step| wave.within((step as f64 + 0.5) / steps as f64).norm_sqr()).sum::<f64>();
        wave.gain = (component.power_share * places as f64 / power).sqrt();
        wave
    }

    /// The wave so many chips into a code period, without secondary code.
    fn within(&self, chips: f64) -> Complex64 {
        let index = chips as usize;
        let layer = |layer: &gnss::signal::Layer| {
            let step = ((chips - index as f64) * layer.pulse.len() as f64) as usize;
            let sign = f64::from(layer.pulse[step] * i8::from(layer.covers(index)));
            Complex64::from_polar(layer.weight * sign, TAU * layer.phase_cycles)
        };
        f64::from(self.code[index]) * self.component.layers.iter().map(layer).sum::<Complex64>()
    }

    /// The wave so many chips since 1980-01-06 of its system's calendar.
    fn at(&self, whole: i128, rest: f64) -> Complex64 {
        let whole = whole + rest.floor() as i128;
        let length = self.code.len() as i128;
        let secondary_code =
            self.secondary_code[whole.div_euclid(length).rem_euclid(self.secondary_code.len() as i128) as usize];
        let chips = whole.rem_euclid(length) as f64 + rest.rem_euclid(1.0);
        self.gain
            * f64::from(secondary_code)
            * Complex64::from_polar(1.0, TAU * self.component.phase_cycles)
            * self.within(chips)
    }
}

/// Samples on either side of the end of a code: half a millisecond, no code is shorter.
const HALF: u64 = 32_500;

/// Replicas of a signal's components in samples from `first` on, carrier included, without data and of unit
/// power. The flags are true where an edge of chips is nearer to a sample than two computations agree on.
pub fn replica(
    (scene, sv, signal): (&Scene, Sv, &'static Signal),
    (first, samples): (u64, u64),
) -> (Vec<Vec<Complex64>>, Vec<bool>) {
    let exact = Exact::new(scene, sv, signal);
    let rate_hz = scene.clock.rate.hz();
    // The delay as a quadratic through three samples: a satellite's jerk moves it by 1e-18 s.
    let delays = [0, samples / 2, samples].map(|k| exact.delay(first + k));
    let [a, b, c] = delays.map(|delay| exact.seconds(delay - delays[0]));
    let moved_s = |u: f64| u * (4.0 * b - 3.0 * a - c) + u * u * (2.0 * a - 4.0 * b + 2.0 * c);
    let waves: Vec<Definition> = signal.components.iter().map(|c| Definition::of(c, sv.number)).collect();
    let starts: Vec<(i128, f64)> = (signal.components.iter())
        .map(|c| exact.steps(first, delays[0], (c.chip_rate_hz * 1e3).round() as i128))
        .map(|steps| (steps >> 48, (steps & ((1 << 48) - 1)) as f64 / ONE))
        .collect();
    let turns = exact.carrier(first, delays[0]) as f64 / TURN;
    let (carrier_hz, if_hz) = (signal.carrier_hz(sv), scene.metadata.if_hz(signal.carrier_hz(sv)));
    let mut near_edge = Vec::new();
    let mut parts: Vec<Vec<Complex64>> = vec![Vec::new(); waves.len()];
    for k in 0..samples {
        let moved_s = moved_s(k as f64 / samples as f64);
        let sent_s = k as f64 / rate_hz - moved_s;
        let cycles = turns + (k as f64 * if_hz / rate_hz).fract() - moved_s * carrier_hz;
        let carrier = Complex64::from_polar(1.0, TAU * cycles.fract());
        let mut is_near = false;
        for ((wave, (whole, rest)), part) in waves.iter().zip(&starts).zip(&mut parts) {
            let chips = rest + sent_s * wave.component.chip_rate_hz;
            part.push(carrier * wave.at(*whole, chips));
            let steps = chips * wave.component.steps_per_chip() as f64;
            is_near |= (steps - steps.round()).abs() < 1e-6;
        }
        near_edge.push(is_near);
    }
    (parts, near_edge)
}

/// The sum of components with the signs of their symbols that fit the samples best.
pub fn fitted(signal: &Signal, parts: &[Vec<Complex64>], samples: &[Complex64]) -> Vec<Complex64> {
    let mut sum = vec![Complex64::ZERO; samples.len()];
    for (component, part) in signal.components.iter().zip(parts) {
        let fit: f64 = samples.iter().zip(part).map(|(sample, part)| (sample * part.conj()).re).sum();
        let sign = if component.message.is_some() { fit.signum() } else { 1.0 };
        sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += sign * part);
    }
    sum
}

/// Departure of samples around the end of a component's longest code from the definition, of the amplitude.
fn departure(scene: &Scene, sv: Sv, signal: &'static Signal, ending: usize) -> Worst {
    let exact = Exact::new(scene, sv, signal);
    let component = &signal.components[ending];
    let chip_mhz = (component.chip_rate_hz * 1e3).round() as i128;
    let length = i128::from(component.code_chips) * i128::from(component.secondary_code.periods());
    // The first end after sample 2^40, found by its own motion.
    let mut n = 1_u64 << 40;
    let end = ((exact.steps(n, exact.delay(n), chip_mhz) >> 48).div_euclid(length) + 1) * length;
    for _ in 0..6 {
        let left = (end << 48) - exact.steps(n, exact.delay(n), chip_mhz);
        n = (n as i128 + (left as f64 / ONE / component.chip_rate_hz * RATE_HZ).ceil() as i128) as u64;
    }
    let first = n - HALF;
    let bytes = run::part(scene, first..n + HALF, tempfile::tempdir().unwrap().path());
    let (i, q) = run::planes(scene, &bytes);
    let amplitude = f64::from(scene.noise_lsb) * f64::sqrt(2.0 * 1e6 / RATE_HZ);
    let samples: Vec<Complex64> =
        i.iter().zip(&q).map(|(i, q)| Complex64::new(f64::from(*i), f64::from(*q)) / amplitude).collect();
    let (parts, near_edge) = replica((scene, sv, signal), (first, 2 * HALF));
    let mut worst = Worst::default();
    // A symbol may change where the code ends.
    for side in [0..HALF as usize, HALF as usize..2 * HALF as usize] {
        let own: Vec<Vec<Complex64>> = parts.iter().map(|part| part[side.clone()].to_vec()).collect();
        let due = fitted(signal, &own, &samples[side.clone()]);
        for (k, due) in side.zip(due).filter(|(k, _)| !near_edge[*k]) {
            let at = || {
                let seconds = length as f64 / component.chip_rate_hz;
                format!("{signal} of {sv}, code of {seconds:.3} s, sample {}", first + k as u64)
            };
            worst.take((samples[k] - due).norm(), at);
        }
    }
    worst
}

#[test]
fn where_the_longest_codes_end_after_two_to_the_fortieth_samples_every_sample_is_the_definition_s() {
    let the = case(64, "ends of long and secondary codes after sample 2^40", ALL);
    // 2^40 samples of 65 Msps are 4 h 42 min.
    let of: Vec<(usize, Worst)> = SIGNALS
        .par_iter()
        .map(|signal| {
            let (scene, _) = late(signal, RATE_HZ, IF_HZ, 16_916);
            let at = scene.clock.epoch(1 << 40);
            let up = senders(&scene, signal).into_iter();
            let sv = up.into_iter().find(|sv| truth::in_view(&scene, *sv, at).unwrap()).unwrap();
            let scene = run::only(scene, &[sv]);
            let mut lengths = BTreeSet::new();
            let (mut ends, mut worst) = (0, Worst::default());
            for (index, component) in signal.components.iter().enumerate() {
                let periods = u64::from(component.code_chips) * u64::from(component.secondary_code.periods());
                if lengths.insert((periods, component.chip_rate_hz.to_bits())) {
                    ends += 1;
                    worst.merge(departure(&scene, sv, signal, index));
                }
            }
            (ends, worst)
        })
        .collect();
    let mut worst = Worst::default();
    let ends: usize = of.iter().map(|(ends, _)| ends).sum();
    of.into_iter().for_each(|(_, of)| worst.merge(of));
    // Knots of 1e-6 cycle turn a sample by 6.3e-6 of itself; a wrong sign anywhere is 1 and more.
    the.at_most(&format!("largest error of a sample around {ends} ends, of the amplitude"), worst, 1e-5, "");
}
