//! Tests of every kind of signal against its definition, evaluated slowly and in another way.
//!
//! The definition counts steps since the beginning of the system's time as 128-bit integers, and takes chip,
//! secondary code and pulse from the component's tables. It shares no line with strips, sequences or pairs of
//! them.

use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::Arc;

use num_complex::Complex64;

use crate::catalogue::Catalogue;
use crate::scenario::{Overrides, Scenario};
use crate::scene::{Arithmetic, Scene};
use crate::stream::{GenerateError, Options, generate_part};
use crate::synth::band::{Filter, HALF_WIDTH};
use crate::synth::bank::Bank;
use crate::synth::isa::Level;
use crate::synth::waveform::{Voice, Waveform, WaveformError};
use crate::synth::{CODE_ONE, Edge, Kernel, RUN_SAMPLES, Run, reference};
use crate::truth;
use gnss::broadcast::Ephemeris;
use gnss::galileo::e1::E1;
use gnss::gps::l1ca::L1_CA;
use gnss::rinex;
use gnss::satellite::{Sv, System};
use gnss::signal::synthetic::{CHANNELS, LONG_BOC, MIXED, MULTIPLEXED, QUADRATURE, SYNTHETIC};
use gnss::signal::{Carrier, Component, Layer, Layers, SecondaryCode, Shape, Signal, always};
use gnss::time::{Epoch, TimeScale};

/// Week 1590, whose beginning is that of every code and secondary code.
const WEEK: i64 = 1590 * 604_800;

/// Seven steps of 1.023 MHz and layers of 1, 2 and 3 steps on top of each other, with zeros and a time of its
/// own.
static LAYERED: Signal = Signal {
    name: "three layers",
    rinex: "1X",
    system: System::BeiDou,
    time: &TimeScale { name: "layered", behind_gpst_s: 14, has_leap_seconds: false },
    constellation: [1, 63],
    carrier: Carrier::Common(1_561.098e6),
    sent: always,
    minimum_power_dbw: None,
    components: &[Component {
        power_share: 1.0,
        phase_cycles: 0.1,
        chip_rate_hz: 1.023e6,
        code_chips: 93,
        code: &|number| Some((0..93_u8).map(|k| [1, 0, -1, -1, 1][usize::from((k ^ number) % 5)]).collect()),
        layers: &[
            Layer { weight: 0.5, ..Layer::BPSK },
            Layer { weight: -0.4, phase_cycles: 0.2, ..Layer::BOC11 },
            Layer { weight: 1.1, pulse: &[1, -1, 1], chips: &[true, true, false], ..Layer::BPSK },
        ],
        secondary_code: SecondaryCode::PerSatellite { chips: 7, of: |_| Some(vec![1, 1, 1, -1, -1, 1, -1]) },
        message: None,
    }],
};

pub(super) fn name(edge: Edge<'_>) -> &'static str {
    match edge {
        Edge::Nearest => "nearest",
        Edge::Area => "area",
        Edge::BandLimited(_) => "band_limited",
    }
}

fn every_signal() -> impl Iterator<Item = &'static Signal> {
    SYNTHETIC.into_iter().chain([&L1_CA, &LAYERED])
}

/// A component as its tables define it, on steps that divide all pulses.
pub(super) struct Definition {
    component: &'static Component,
    behind_s: i64,
    per_chip: i128,
    code: Vec<i8>,
    secondary_code: Vec<i8>,
    /// Weight and phase of each layer.
    factors: Vec<Complex64>,
    /// Brings the mean power over time to one.
    scale: f64,
}

impl Definition {
    pub(super) fn new(signal: &'static Signal, index: usize, number: u8) -> Self {
        let component = &signal.components[index];
        let mut definition = Self {
            component,
            behind_s: signal.time.behind_gpst_s,
            per_chip: component.steps_per_chip() as i128,
            code: (component.code)(number).unwrap(),
            secondary_code: component.secondary_code.of(number).unwrap(),
            factors: (component.layers.iter())
                .map(|layer| Complex64::from_polar(layer.weight, TAU * layer.phase_cycles))
                .collect(),
            scale: 1.0,
        };
        let steps = i128::from(component.code_chips) * definition.per_chip;
        let power: f64 = (0..steps).map(|step| definition.step(step).norm_sqr()).sum();
        definition.scale = 1.0 / (power / steps as f64).sqrt();
        definition
    }

    /// The step that many after the beginning of the system's time.
    fn step(&self, number: i128) -> Complex64 {
        let (chip, within) = (number.div_euclid(self.per_chip), number.rem_euclid(self.per_chip));
        let length = self.code.len() as i128;
        let (period, index) = (chip.div_euclid(length), chip.rem_euclid(length) as usize);
        let sign =
            self.code[index] * self.secondary_code[period.rem_euclid(self.secondary_code.len() as i128) as usize];
        let layers = self.component.layers.iter().zip(&self.factors);
        let layers = layers.filter(|(layer, _)| layer.chips.is_empty() || layer.chips[index % layer.chips.len()]);
        let layers = layers.map(|(layer, factor)| {
            factor * f64::from(layer.pulse[(within * layer.pulse.len() as i128 / self.per_chip) as usize])
        });
        layers.sum::<Complex64>() * f64::from(sign) * self.scale
    }

    /// Whole steps and a fraction at the time `at` of a satellite's clock, in GPS time.
    fn place(&self, at: Epoch) -> (i128, f64) {
        let thousandths = (self.component.chip_rate_hz * 1000.0).round() as i128 * self.per_chip;
        let whole = i128::from(at.seconds() - self.behind_s) * thousandths;
        let steps = at.fraction() * thousandths as f64 / 1000.0;
        let rest = whole.rem_euclid(1000) as f64 / 1000.0 + steps;
        (whole.div_euclid(1000) + rest.floor() as i128, rest - rest.floor())
    }

    /// Steps per second.
    fn rate_hz(&self) -> f64 {
        self.component.chip_rate_hz * self.per_chip as f64
    }

    /// The sample that `edge` makes at `at`, before its gain, and the distance of the next edge in steps.
    pub(super) fn sample(&self, edge: Edge<'_>, at: Epoch, rate_hz: f64) -> (Complex64, f64) {
        let (step, fraction) = self.place(at);
        let per_sample = self.rate_hz() / rate_hz;
        let value = match edge {
            Edge::Nearest => self.step(step),
            Edge::Area => {
                // The share of each step in the sample's interval.
                let (from, to) = (fraction - 0.5 * per_sample, fraction + 0.5 * per_sample);
                let shares = (from.floor() as i64..=to.floor() as i64).map(|k| {
                    let share = (to.min((k + 1) as f64) - from.max(k as f64)) / per_sample;
                    self.step(step + i128::from(k)) * share
                });
                shares.sum()
            }
            Edge::BandLimited(filter) => {
                // Each step through the filter: its response to the beginning less that to the end.
                let reach = (HALF_WIDTH as f64 * per_sample).ceil() as i64 + 1;
                let response = |k: i64| filter.step((fraction - k as f64) / per_sample);
                (-reach..=reach).map(|k| self.step(step + i128::from(k)) * (response(k) - response(k + 1))).sum()
            }
        };
        (value, fraction.min(1.0 - fraction))
    }
}

/// A waveform's sequences behind an edge, and the gain that they have.
fn voices(waveform: &Waveform, edge: Edge<'_>, rate_hz: f64) -> (Vec<Voice>, f64) {
    (waveform.voices(Layers::Whole, edge, rate_hz).unwrap(), 1.0 / waveform.power(Edge::Nearest, rate_hz).sqrt())
}

/// The sequences' sum at `samples` instants `1 / rate_hz` apart from `start` on, without gain.
fn rendered(
    (voices, gain): &(Vec<Voice>, f64),
    edge: Edge<'_>,
    start: Epoch,
    rate_hz: f64,
    samples: usize,
) -> Vec<Complex64> {
    let mut sum = vec![Complex64::ZERO; samples];
    for Voice { spreading, amplitude, phase_cycles, pulse } in voices {
        let step = (spreading.pace().step_rate_hz() / rate_hz * CODE_ONE as f64) as u64;
        let mut bits = Vec::new();
        let position = spreading.strip(spreading.at(start, 0.0), step, samples, |_| false, &mut bits);
        let pulse = pulse.as_deref();
        let run = Run { bits: &bits, position, step, turns: 0, turns_step: 0, amplitude: 1.0, pulse };
        let factor = Complex64::from_polar(amplitude / gain, TAU * phase_cycles);
        for (n, sum) in sum.iter_mut().enumerate() {
            *sum += factor * reference::waveform(edge, &run, position + step * n as u64);
        }
    }
    sum
}

#[test]
fn every_component_is_its_definition_with_every_edge() {
    let filter = Filter::default();
    for signal in every_signal() {
        for (index, number) in (0..signal.components.len()).flat_map(|index| [1, 7, 10].map(|n| (index, n))) {
            let definition = Definition::new(signal, index, number);
            let sv = Sv { system: signal.system, number };
            let waveform = Waveform::new(signal.link(sv), index).unwrap().unwrap();
            let behind_s = signal.time.behind_gpst_s;
            for rate_hz in [2.6e6, 26.123e6] {
                let power = waveform.power(Edge::Nearest, rate_hz) * definition.scale * definition.scale;
                assert!((power - 1.0).abs() < 1e-12, "{signal} {index}: {power}");
                let edges = [Edge::Nearest, Edge::Area, Edge::BandLimited(&filter)];
                let edges = edges.map(|edge| (edge, voices(&waveform, edge, rate_hz)));
                // Across the beginning of a week, of periods of 4 ms, 0.1 s, 1.5 s and 18 s, and away from
                // any.
                for (seconds, after_s) in [(0, 0.0), (3, 0.3), (18, 0.0), (1, 0.5), (374_400, 0.004), (7, 0.123_456_7)]
                {
                    let at = |n: f64| Epoch::new(WEEK + seconds + behind_s, after_s + (n - 60.3) / rate_hz);
                    for (edge, voices) in &edges {
                        let edge = *edge;
                        let found = rendered(voices, edge, at(0.0), rate_hz, 140);
                        let scale = definition.scale;
                        for (n, found) in found.into_iter().enumerate() {
                            let (expected, next) = definition.sample(edge, at(n as f64), rate_hz);
                            // A position is rounded to 1e-16 s or 3e-9 steps on both sides; on an edge either
                            // is right.
                            let allowed = match edge {
                                Edge::Nearest if next < 1e-7 => continue,
                                Edge::Nearest => 1e-12,
                                // Steps of up to 2.2, twice 3e-9 late or early, over 0.02 of a step in a
                                // sample.
                                _ => 1e-6,
                            };
                            let error = (found * scale - expected).norm();
                            assert!(error < allowed, "{signal} {index} {number} {} {rate_hz} {n}: {error}", name(edge));
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn the_strongest_layer_alone_is_sent_as_it_is_in_the_whole() {
    // Galileo OS SIS ICD 2.1, 2.3.3: √(10/11) of BOC(1,1), and √(1/11) of BOC(6,1) beside it.
    let [strong, weak] = [10.0_f64, 1.0].map(|power| (power / 11.0).sqrt());
    let (sv, start) = (Sv { system: E1.system, number: 11 }, Epoch::new(WEEK + 1000, 0.123_456));
    for index in 0..E1.components.len() {
        let waveform = Waveform::new(E1.link(sv), index).unwrap().unwrap();
        for rate_hz in [6.5e6, 26.123e6] {
            let gain = 1.0 / waveform.power(Edge::Nearest, rate_hz).sqrt();
            let [whole, alone] = [Layers::Whole, Layers::Strongest].map(|layers| {
                let voices = waveform.voices(layers, Edge::Nearest, rate_hz).unwrap();
                rendered(&(voices, gain), Edge::Nearest, start, rate_hz, 3000)
            });
            for (whole, alone) in whole.into_iter().zip(alone) {
                assert!((alone.norm() - strong).abs() < 1e-12, "{index}: {alone}");
                assert!(((whole - alone).norm() - weak).abs() < 1e-12, "{index}: {whole} and {alone}");
            }
        }
    }
}

/// Samples of a component as kernels make them, with its gain, in runs that begin `apart_s` apart.
fn stretches(waveform: &Waveform, kernel: Kernel<'_>, rate_hz: f64, count: u32, apart_s: f64) -> Vec<Vec<Complex64>> {
    let voices = waveform.voices(Layers::Whole, kernel.edge, rate_hz).unwrap();
    let mut bank = Bank::default();
    let stretch = |k: u32| {
        let at = Epoch::new(WEEK + 1000, 0.0).plus_s(f64::from(k) * apart_s);
        for (part, Voice { spreading, amplitude, phase_cycles, pulse }) in voices.iter().enumerate() {
            let step = (spreading.pace().step_rate_hz() / rate_hz * CODE_ONE as f64) as u64;
            bank.push((0, RUN_SAMPLES as u64), part, 0..RUN_SAMPLES, pulse.as_ref(), |bits| Run {
                bits: &[],
                position: spreading.strip(spreading.at(at, 0.0), step, RUN_SAMPLES, |_| false, bits),
                step,
                turns: (phase_cycles.rem_euclid(1.0) * 18_446_744_073_709_551_616.0) as u64,
                turns_step: 0,
                amplitude: *amplitude,
                pulse: None,
            });
        }
        let (mut i, mut q) = (vec![0.0; RUN_SAMPLES], vec![0.0; RUN_SAMPLES]);
        bank.render(kernel, &mut i, &mut q);
        i.iter().zip(&q).map(|(i, q)| Complex64::new(f64::from(*i), f64::from(*q))).collect()
    };
    (0..count).map(stretch).collect()
}

fn kernel(edge: Edge<'_>) -> Kernel<'_> {
    Kernel { edge, arithmetic: Arithmetic::F32, level: Level::detect() }
}

#[test]
fn every_component_has_the_mean_power_that_its_edges_keep() {
    let filter = Filter::default();
    for signal in every_signal() {
        for index in 0..signal.components.len() {
            let waveform = Waveform::new(signal.link(Sv { system: signal.system, number: 5 }), index).unwrap().unwrap();
            for (rate_hz, edge) in [2.6e6, 26.123e6]
                .into_iter()
                .flat_map(|rate_hz| [Edge::Nearest, Edge::Area, Edge::BandLimited(&filter)].map(|edge| (rate_hz, edge)))
            {
                let made = stretches(&waveform, kernel(edge), rate_hz, 100, 7.31e-3);
                let power: f64 = made.iter().flatten().map(Complex64::norm_sqr).sum();
                let mean = power / (made.len() * RUN_SAMPLES) as f64;
                // 16 000 chips at least, each of which leaves at most its own power in edges or a zero: 5
                // sigma.
                let allowed = match edge {
                    Edge::Nearest => 0.02,
                    _ => 0.04,
                };
                let kept = waveform.kept(edge, rate_hz);
                assert!((mean / kept - 1.0).abs() < allowed, "{signal} {index} {} {rate_hz}: {mean}", name(edge));
            }
        }
    }
}

/// Mean power of unit samples at a frequency: the density folded into the band behind the mean over a sample.
fn folded_density(shape: &Shape, hz: f64, rate_hz: f64) -> f64 {
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { libm::sin(PI * x) / (PI * x) };
    let fold = |k: i32| {
        let hz = hz + f64::from(k) * rate_hz;
        shape.density(hz) * sinc(hz / rate_hz) * sinc(hz / rate_hz)
    };
    rate_hz * (-8..=8).map(fold).sum::<f64>()
}

#[test]
fn the_spectrum_of_samples_is_that_of_the_component() {
    const RATE_HZ: f64 = 26.123e6;
    const BANDS: u32 = 10;
    const LINES: u32 = 12;
    const WINDOW: usize = 2048;
    const STRETCHES: u32 = 120;
    for signal in SYNTHETIC.into_iter().chain([&L1_CA]) {
        for (index, component) in signal.components.iter().enumerate() {
            let waveform = Waveform::new(signal.link(Sv { system: signal.system, number: 3 }), index).unwrap().unwrap();
            let made = stretches(&waveform, kernel(Edge::Area), RATE_HZ, STRETCHES, 7.317_31e-3);
            // Of one side of a sub-carrier the shape is the mean of this side and the other.
            let sides: &[f64] = if component.tone().is_some() { &[1.0, -1.0] } else { &[1.0] };
            let (shape, width_hz) = (component.shape(), 0.8e6 * (component.chip_rate_hz / 1.023e6).min(1.0));
            for band in 0..BANDS {
                let (mut found, mut expected) = (0.0, 0.0);
                for line in 0..LINES {
                    let hz = width_hz * (f64::from(band) + (f64::from(line) + 0.37) / f64::from(LINES));
                    expected += folded_density(&shape, hz, RATE_HZ) / f64::from(LINES);
                    let windows = || made.iter().filter_map(|samples| samples.get(..WINDOW));
                    for (side, window) in sides.iter().flat_map(|side| windows().map(move |window| (side, window))) {
                        let turn = Complex64::from_polar(1.0, -TAU * side * hz / RATE_HZ);
                        let mut phasor = Complex64::ONE;
                        let mut sum = Complex64::ZERO;
                        for sample in window {
                            sum += sample * phasor;
                            phasor *= turn;
                        }
                        let windows = f64::from(LINES * STRETCHES) * sides.len() as f64;
                        found += sum.norm_sqr() / WINDOW as f64 / windows;
                    }
                }
                // Independent values of a line: one a segment, as far as the code does not repeat; lines
                // nearer to each other than one over the window's length are one. Each scatters as much as it
                // has: 5 sigma.
                let window_s = WINDOW as f64 / RATE_HZ;
                let times = f64::from(STRETCHES).min(component.period_s() / window_s);
                let lines = f64::from(LINES).min(width_hz * window_s);
                // A finite window spreads a chip's length over its own of the strongest density, at nulls
                // too.
                let spread =
                    shape.chip_s() / window_s * folded_density(&shape, 0.4 / shape.step_s(), RATE_HZ).max(expected);
                let allowed = 5.0 / (times * lines).sqrt() * expected + spread;
                let error = (found - expected).abs();
                assert!(error < allowed, "{signal} {index}, band {band}: {found} for {expected} ± {allowed}");
            }
        }
    }
}

#[test]
fn composites_have_the_envelope_that_their_components_give() {
    // Two at right angles, and two in turn: constant. Two in line: the sum or the difference of their
    // amplitudes.
    let (large, small) = (0.75_f64.sqrt(), 0.25_f64.sqrt());
    let line = [0.0, 2.0_f64.sqrt()];
    let mixed = [large - small, large + small];
    for (signal, envelopes) in [
        (&QUADRATURE, [1.0, 1.0]),
        (&MULTIPLEXED, [1.0, 1.0]),
        (&CHANNELS, [1.0, 1.0]),
        (&LONG_BOC, line),
        (&MIXED, mixed),
    ] {
        let mut sum = vec![Complex64::ZERO; 3000];
        for (index, component) in signal.components.iter().enumerate() {
            let waveform = Waveform::new(signal.link(Sv { system: signal.system, number: 2 }), index).unwrap().unwrap();
            let gain = (component.power_share / waveform.power(Edge::Nearest, 26.123e6)).sqrt();
            let factor = Complex64::from_polar(gain, TAU * component.phase_cycles);
            let voices = voices(&waveform, Edge::Nearest, 26.123e6);
            let made = rendered(&voices, Edge::Nearest, Epoch::new(WEEK, 0.25), 26.123e6, sum.len());
            sum.iter_mut().zip(made).for_each(|(sum, value)| *sum += factor * value);
        }
        for envelope in envelopes {
            assert!(sum.iter().any(|value| (value.norm() - envelope).abs() < 1e-12), "{signal} {envelope}");
        }
        let known = |value: &Complex64| envelopes.iter().any(|envelope| (value.norm() - envelope).abs() < 1e-12);
        assert!(sum.iter().all(known), "{signal}");
    }
}

#[test]
fn what_cannot_be_rendered_is_refused_by_name() {
    let sv = Sv { system: System::Qzss, number: 3 };
    let mixed = Waveform::new(MIXED.link(sv), 0).unwrap().unwrap();
    let refused = mixed.voices(Layers::Whole, Edge::Area, 0.8e6).unwrap_err();
    // Layer 2 of component 1 has 12.276e6 steps a second, a fifteenth of which is 818 400.
    assert_eq!(
        refused,
        WaveformError::Rate {
            signal: "synthetic E",
            component: 1,
            layer: 2,
            steps_hz: 12.276e6,
            rate_hz: 0.8e6,
            least_hz: 818_400.0
        }
    );
    assert!(refused.to_string().contains("at least 818400 samples a second"), "{refused}");
    assert!(mixed.voices(Layers::Whole, Edge::Area, 0.8184e6).is_ok());
    static SHORT: Signal = Signal {
        name: "short",
        components: &[Component { code: &|_| Some(vec![1; 5]), code_chips: 6, ..TEMPLATE }],
        ..L1_CA
    };
    static OFF_GRID: Signal =
        Signal { name: "off grid", components: &[Component { chip_rate_hz: 1.023e6 / 7.0, ..TEMPLATE }], ..L1_CA };
    static TWO: Signal = Signal {
        name: "two",
        components: &[Component { secondary_code: SecondaryCode::Shared(&[1, 0]), ..TEMPLATE }],
        ..L1_CA
    };
    const TEMPLATE: Component = Component {
        power_share: 1.0,
        phase_cycles: 0.0,
        chip_rate_hz: 1.023e6,
        code_chips: 5,
        code: &|number| (number < 9).then(|| vec![1, -1, 0, 1, 1]),
        layers: &[Layer::BPSK],
        secondary_code: SecondaryCode::None,
        message: None,
    };
    let error = |signal: &'static Signal| match Waveform::new(signal.link(Sv::gps(4)), 0) {
        Ok(found) => found.unwrap().voices(Layers::Whole, Edge::Nearest, 3e6).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    };
    assert_eq!(error(&SHORT), "short, component 1, code of G04: 5 chips: expected 6, not all zero");
    assert_eq!(error(&TWO), "two, component 1, secondary code of G04: a chip of 0: expected -1 or 1");
    assert!(error(&OFF_GRID).starts_with("off grid, component 1, code of G04: 5 steps at 146142.857"));
    // No code is no error.
    assert!(Waveform::new(TWO.link(Sv::gps(9)), 0).unwrap().is_none());
}

/// The GPS satellites of the embedded file as those of a signal's system, as many as it has.
fn catalogue(signal: &'static Signal) -> Catalogue {
    let [first, last] = signal.constellation;
    let numbered = |set: Ephemeris| {
        let sv = Sv { system: signal.system, ..set.sv };
        (first..=last.min(32)).contains(&sv.number).then_some(Ephemeris { sv, ..set })
    };
    Catalogue::new(rinex::embedded().unwrap().ephemerides.into_iter().filter_map(numbered).collect()).0
}

/// A scene with that signal alone in the middle of its band.
pub(super) fn scene(signal: &'static Signal, edge: &str, rate_hz: f64) -> Scene {
    let text = format!(
        "name = \"signals\"\nstart = 2010-07-01T08:12:30\nseed = 3\nduration_s = 0.1\n[motion]\nkind = \"static\"\n\
         latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[front_end]\nsample_rate_hz = {rate_hz:e}\n\
         format = \"cf32\"\n[power]\ncn0_dbhz = 45\n[fidelity]\nlevel = \"reference\"\ncode_edge = \"{edge}\"\n"
    );
    let scenario = Scenario::parse(&text, "signals").unwrap();
    let (mut scene, _) = scenario.compose(Path::new("scenarios"), &Overrides::default()).unwrap();
    scene.catalogue = Arc::new(catalogue(signal));
    scene.excluded.clear();
    scene.signals = vec![signal];
    scene.metadata.center_hz = signal.centre_hz() - 0.1e6;
    scene.receiver_clock = crate::clock::ReceiverClock::steady(2e-5, 1e-7);
    scene
}

/// The samples of a part of a scene, and the satellites that it reports.
pub(super) fn samples(scene: &Scene, part: std::ops::Range<u64>) -> (Vec<Complex64>, Vec<Sv>) {
    let directory = tempfile::tempdir().unwrap();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let mut bytes = Vec::new();
    let done = generate_part(scene, part, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap();
    let (mut i, mut q) = (Vec::new(), Vec::new());
    scene.metadata.format.unpack(&bytes, &mut i, &mut q);
    (i.iter().zip(&q).map(|(i, q)| Complex64::new(f64::from(*i), f64::from(*q))).collect(), done.satellites)
}

#[test]
fn a_scene_is_the_sum_of_its_satellites_definitions() {
    const RATE_HZ: f64 = 26.123e6;
    let filter = Filter::default();
    for signal in SYNTHETIC {
        for edge in [Edge::Nearest, Edge::Area, Edge::BandLimited(&filter)] {
            let scene = scene(signal, name(edge), RATE_HZ);
            // What arrives there was sent around a whole second, where secondary codes and codes of 0.1 s
            // begin.
            let part = (0.063 * RATE_HZ) as u64..(0.088 * RATE_HZ) as u64;
            let (found, reported) = samples(&scene, part.clone());
            let up: Vec<Sv> = scene
                .catalogue
                .satellites()
                .filter(|sv| truth::in_view(&scene, *sv, scene.clock.epoch(part.start)).unwrap())
                .collect();
            assert!(up.len() >= 3 && reported == up, "{signal}: {reported:?} of {up:?}");
            let definitions: Vec<Vec<(Definition, f64)>> = up
                .iter()
                .map(|sv| {
                    let components = signal.components.iter().enumerate();
                    components
                        .map(|(index, component)| {
                            let definition = Definition::new(signal, index, sv.number);
                            (definition, component.power_share.sqrt())
                        })
                        .collect()
                })
                .collect();
            let mut compared = 0;
            for k in (0..found.len()).step_by(1999) {
                let n = part.start + k as u64;
                let reading = scene.clock.epoch(n);
                let (mut sum, mut nearest, mut amplitude) = (Complex64::ZERO, 1.0_f64, 0.0);
                for (sv, components) in up.iter().zip(&definitions) {
                    let seen = truth::seen(&scene, *sv, signal, reading).unwrap().unwrap();
                    let arrival = seen.arrivals[0];
                    let if_hz = scene.metadata.if_hz(signal.carrier_hz(*sv));
                    let cycles = if_hz * n as f64 / RATE_HZ - arrival.carrier_cycles;
                    amplitude = (2.0 * arrival.cn0_hz / RATE_HZ).sqrt() * f64::from(scene.noise_lsb);
                    for ((definition, gain), component) in components.iter().zip(signal.components) {
                        let sent = reading.plus_s(-arrival.delay_s);
                        let (value, next) = definition.sample(edge, sent, RATE_HZ);
                        nearest = nearest.min(next);
                        let phase = TAU * (cycles.fract() + component.phase_cycles);
                        sum += value * Complex64::from_polar(gain * amplitude, phase);
                    }
                }
                // On an edge of a satellite either value is right; the position is known to 1e-6 step.
                if matches!(edge, Edge::Nearest) && nearest < 1e-5 {
                    continue;
                }
                // Ten satellites, each with its carrier within half of 1e-6 cycle of the knots and 1e-7 of
                // this sum, its code within 1e-7 step of an edge that counts 50 samples a step, and one
                // rounding to f32.
                let error = (found[k] - sum).norm() / amplitude;
                assert!(error < 1e-4, "{signal} {} {n}: {error}", name(edge));
                compared += 1;
            }
            assert!(compared > 300, "{signal}: {compared}");
        }
    }
}

#[test]
fn signals_of_one_satellite_arrive_apart_by_their_group_delays_alone() {
    let scene = scene(&QUADRATURE, "area", 26.123e6);
    let at = scene.clock.epoch(0);
    let sv = Sv::gps(23);
    let delay_s = |signal| truth::seen(&scene, sv, signal, at).unwrap().unwrap().arrivals[0].delay_s;
    let set = scene.catalogue.sent_at(sv, at).unwrap();
    let apart_s = set.group_delay_s(&QUADRATURE) - set.group_delay_s(&L1_CA);
    assert!(apart_s.abs() > 1e-9);
    // Two delays of 0.08 s, each rounded to 1.4e-17 s.
    assert!((delay_s(&QUADRATURE) - delay_s(&L1_CA) - apart_s).abs() < 3e-17);
}

#[test]
fn a_rate_that_a_scene_cannot_have_is_refused_with_the_rate_that_it_could() {
    static FASTER: Signal = Signal {
        name: "faster",
        components: &[Component {
            power_share: 1.0,
            phase_cycles: 0.0,
            chip_rate_hz: 10.23e6,
            code_chips: 10_230,
            code: &|_| Some(vec![1; 10_230]),
            layers: &[Layer::BOC11],
            secondary_code: SecondaryCode::None,
            message: None,
        }],
        ..QUADRATURE
    };
    let scene = scene(&FASTER, "area", 1.1e6);
    let directory = tempfile::tempdir().unwrap();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let done = generate_part(&scene, 0..100, &mut Vec::new(), &mut writer, &mut |_| (), &Options::default());
    let Err(GenerateError::Waveform(error)) = done else { panic!("{done:?}") };
    let expected = "faster, component 1, layer 1: 20460000 steps a second at 1100000 samples a second: expected at \
                    least 1364000 samples a second";
    assert_eq!(error.to_string(), expected);
}
