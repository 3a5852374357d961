//! C/N0 is at the antenna: what samples have of each component is what chip edges, or a filter, leave of it.
//!
//! One satellite without noise is taken apart into its components by least squares: each by its definition,
//! evaluated slowly, behind the same edges. Expected is the integral of the spectrum of the printed pulses
//! under the response that the documentation states of each edge; neither knows what the generator makes of a
//! component's gain.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::signals::{Definition, name, samples, scene};
use crate::scene::Scene;
use crate::stage::filter::{Filter as FrontEndFilter, Shape};
use crate::synth::Edge;
use crate::synth::band::Filter;
use crate::truth;
use gnss::galileo::e1::E1;
use gnss::gps::l1c::L1C;
use gnss::gps::l5::L5;
use gnss::satellite::Sv;
use gnss::signal::{Signal, always};

const RATE_HZ: f64 = 4.1e6;
const CN0_DBHZ: f64 = 45.0;

/// Square waves of a chip in a spectrum: half cycles and amplitude of each that shares its chips.
type Waves = &'static [(u32, f64)];

/// A signal's components as their documents print them: chip rate, share of the power, and what chips are, by
/// the share of the chips that are so.
struct Printed {
    signal: &'static Signal,
    chip_rate_hz: f64,
    components: [(f64, &'static [(f64, Waves)]); 2],
}

/// √(10/11) and √(1/11), Galileo OS SIS ICD 2.1, 2.3.3.
const STRONG: f64 = 0.953_462_589_245_592_3;
const WEAK: f64 = 0.301_511_344_577_763_6;

/// L1C as if every satellite of the scene sent it.
static SENT_L1C: Signal = Signal { sent: always, ..L1C };
/// L5 as if every satellite of the scene sent it.
static SENT_L5: Signal = Signal { sent: always, ..L5 };

const PRINTED: [Printed; 3] = [
    Printed {
        signal: &E1,
        chip_rate_hz: 1.023e6,
        // CBOC(6,1,1/11): the weak wave is added to the data's and subtracted from the pilot's.
        components: [(0.5, &[(1.0, &[(2, STRONG), (12, WEAK)])]), (0.5, &[(1.0, &[(2, STRONG), (12, -WEAK)])])],
    },
    Printed {
        signal: &SENT_L1C,
        chip_rate_hz: 1.023e6,
        // IS-GPS-800J, 3.2.1.6 and 3.3: three quarters on the pilot, TMBOC with four chips of 33
        // BOC(6,1); the data are BOC(1,1).
        components: [(0.75, &[(29.0 / 33.0, &[(2, 1.0)]), (4.0 / 33.0, &[(12, 1.0)])]), (0.25, &[(1.0, &[(2, 1.0)])])],
    },
    Printed {
        signal: &SENT_L5,
        chip_rate_hz: 10.23e6,
        components: [(0.5, &[(1.0, &[(1, 1.0)])]), (0.5, &[(1.0, &[(1, 1.0)])])],
    },
];

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-12 { 1.0 } else { libm::sin(PI * x) / (PI * x) }
}

/// Power density of random chips, each a sum of square waves, per hertz: |P(f)|²/T of the pulse.
fn density(chips: &[(f64, Waves)], chip_rate_hz: f64, hz: f64) -> f64 {
    let x = hz / chip_rate_hz;
    let wave = |half_cycles: u32| {
        let n = f64::from(half_cycles);
        let step = |k: u32| {
            let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            Complex64::from_polar(sign * sinc(x / n) / n, -TAU * x * (f64::from(k) + 0.5) / n)
        };
        (0..half_cycles).map(step).sum::<Complex64>()
    };
    let pulse = |waves: Waves| waves.iter().map(|(n, weight)| wave(*n) * weight).sum::<Complex64>().norm_sqr();
    chips.iter().map(|(share, waves)| share * pulse(waves)).sum::<f64>() / chip_rate_hz
}

/// Amplitude that an edge leaves of a frequency, as documented: all, the mean over a sample, or a sinc cut
/// off at 0.40 cycles a sample under a Kaiser window of ±8 samples with β = 5.65.
fn left(edge: Edge<'_>, cps: f64) -> f64 {
    match edge {
        Edge::Nearest => 1.0,
        Edge::Area => sinc(cps),
        Edge::BandLimited(_) => {
            let bessel = |y: f64| {
                (1..40)
                    .fold((1.0, 1.0), |(sum, term): (f64, f64), k| {
                        let term = term * y * y / 4.0 / f64::from(k * k);
                        (sum + term, term)
                    })
                    .0
            };
            let taps = (-256..=256).map(|k| {
                let x = f64::from(k) / 32.0;
                let tap = sinc(0.8 * x) * bessel(5.65 * (1.0 - x * x / 64.0).max(0.0).sqrt());
                (tap, tap * libm::cos(TAU * cps * x))
            });
            let (all, of) = taps.fold((0.0, 0.0), |(all, of), (tap, part)| (all + tap, of + part));
            of / all
        }
    }
}

/// Integral over frequency up to 60 MHz on either side, beyond which BOC(6,1) has 1 % of its power; steps of
/// 20 kHz are a fiftieth of a chip rate.
fn integral(of: impl Fn(f64) -> f64) -> f64 {
    (0..3000).map(|k| 2.0 * 2e4 * of((f64::from(k) + 0.5) * 2e4)).sum()
}

/// A scene with one satellite of a signal, without noise.
fn alone(signal: &'static Signal, edge: Edge<'_>, rate_hz: f64) -> (Scene, Sv) {
    let mut scene = scene(signal, name(edge), rate_hz);
    let up = |sv: &Sv| truth::in_view(&scene, *sv, scene.clock.epoch(0)).unwrap();
    let sv = scene.catalogue.satellites().find(up).unwrap();
    scene.excluded = scene.catalogue.satellites().filter(|other| *other != sv).collect();
    (scene, sv)
}

/// Amplitude of each component in samples over that of a C/N0 of one hertz, by replicas of unit power before
/// their edges, and the mean power of these behind them. Samples come `late` samples behind the antenna.
fn found(scene: &Scene, (signal, sv): (&'static Signal, Sv), edge: Edge<'_>, late: f64) -> [(f64, f64); 2] {
    let rate_hz = scene.clock.rate.hz();
    let part = (0.02 * rate_hz) as u64..(0.042 * rate_hz) as u64;
    let (found, _) = samples(scene, part.clone());
    let definitions = [0, 1].map(|index| Definition::new(signal, index, sv.number));
    let if_hz = scene.metadata.if_hz(signal.carrier_hz(sv));
    let unit = (2.0 / rate_hz).sqrt() * f64::from(scene.noise_lsb);
    // Within a millisecond of the satellite's time no symbol ends.
    let mut normal = [[Complex64::ZERO; 2]; 2];
    let mut right = [Complex64::ZERO; 2];
    let (mut millisecond, mut count) = (None, 0.0);
    let (mut amplitudes, mut powers, mut solved) = ([0.0; 2], [0.0; 2], 0.0);
    for (k, sample) in found.into_iter().enumerate() {
        let n = part.start + k as u64;
        let reading = scene.clock.epoch(n).plus_s(-late / rate_hz);
        let arrival = truth::seen(scene, sv, signal, reading).unwrap().unwrap().arrivals[0];
        let sent = reading.plus_s(-arrival.delay_s);
        let of = 1e3 * sent.fraction();
        // Away from its ends, which filters of eight samples, or of 0.1 ms, reach over.
        if !(0.15..0.85).contains(&of.fract()) {
            continue;
        }
        if millisecond.is_some_and(|old| old != of as i64) && count > 0.0 {
            let [[a, b], [c, d]] = normal;
            let determinant = a * d - b * c;
            let solution = [(right[0] * d - right[1] * b) / determinant, (right[1] * a - right[0] * c) / determinant];
            for (index, value) in solution.into_iter().enumerate() {
                amplitudes[index] += value.norm() / unit;
                powers[index] += normal[index][index].re / count;
            }
            (normal, right, count, solved) = ([[Complex64::ZERO; 2]; 2], [Complex64::ZERO; 2], 0.0, solved + 1.0);
        }
        millisecond = Some(of as i64);
        let cycles = if_hz * (n as f64 - late) / rate_hz - arrival.carrier_cycles;
        let carrier = Complex64::from_polar(1.0, TAU * cycles.fract());
        let replicas = [0, 1].map(|index| {
            let turn = Complex64::from_polar(1.0, TAU * signal.components[index].phase_cycles);
            definitions[index].sample(edge, sent, rate_hz).0 * carrier * turn
        });
        for (row, one) in replicas.iter().enumerate() {
            right[row] += one.conj() * sample;
            (0..2).for_each(|column| normal[row][column] += one.conj() * replicas[column]);
        }
        count += 1.0;
    }
    assert!(solved > 15.0);
    [0, 1].map(|index| (amplitudes[index] / solved, powers[index] / solved))
}

#[test]
fn samples_have_of_each_component_s_power_at_the_antenna_what_edges_leave_of_its_printed_spectrum() {
    let filter = Filter::default();
    for Printed { signal, chip_rate_hz, components } in PRINTED {
        for edge in [Edge::Nearest, Edge::Area, Edge::BandLimited(&filter)] {
            let (scene, sv) = alone(signal, edge, RATE_HZ);
            let found = found(&scene, (signal, sv), edge, 0.0);
            for (index, ((share, chips), (amplitude, power))) in components.into_iter().zip(found).enumerate() {
                // Component and replica are the same but for arithmetic.
                let sent_dbhz = 10.0 * libm::log10(share) + CN0_DBHZ;
                let of_replica_db = 20.0 * libm::log10(amplitude) - sent_dbhz;
                assert!(of_replica_db.abs() < 2e-3, "{signal} {index} {}: {of_replica_db}", name(edge));
                let expected = match edge {
                    // What lies outside folds back.
                    Edge::Nearest => 1.0,
                    _ => integral(|hz| {
                        let amplitude = left(edge, hz / RATE_HZ);
                        density(chips, chip_rate_hz, hz) * amplitude * amplitude
                    }),
                };
                let found_db = of_replica_db + 10.0 * libm::log10(power);
                let expected_db = 10.0 * libm::log10(expected);
                println!("{signal} {index} {}: {found_db:.3} dB, by its spectrum {expected_db:.3}", name(edge));
                // 4092 chips at least depart from random ones by 1.6 % in a lag, 0.07 dB; and the tail. Where
                // a sample is the mean of d > 1 chips, seven tenths of a code period are 7161/d independent
                // values, whose mean square scatters by √(2d/7161), 0.11 dB: three of them.
                let chips = chip_rate_hz / RATE_HZ;
                let scatter_db = 10.0 * libm::log10(1.0 + (2.0 * chips / 7161.0).sqrt());
                let allowed_db = if chips < 1.0 { 0.1 } else { 3.0 * scatter_db };
                assert!((found_db - expected_db).abs() < allowed_db, "{signal} {index}: {found_db} {expected_db}");
            }
        }
    }
}

#[test]
fn a_filter_of_that_width_takes_as_much_of_each_component_as_its_printed_spectrum_has_outside() {
    const WIDE_HZ: f64 = 26.123e6;
    for Printed { signal, chip_rate_hz, components } in PRINTED {
        let (mut scene, sv) = alone(signal, Edge::Area, WIDE_HZ);
        let if_hz = scene.metadata.if_hz(signal.carrier_hz(sv));
        let filter = FrontEndFilter::new(Shape::BrickWall, RATE_HZ, WIDE_HZ, if_hz, false).unwrap();
        let late = filter.group_delay_s * WIDE_HZ;
        scene.front_end.push(Box::new(filter));
        let found = found(&scene, (signal, sv), Edge::Nearest, late);
        for (index, ((share, chips), (amplitude, _))) in components.into_iter().zip(found).enumerate() {
            let passed = |hz: f64| {
                let within_hz = hz - WIDE_HZ * (hz / WIDE_HZ).round();
                if within_hz.abs() < 0.5 * RATE_HZ { 1.0 } else { 0.0 }
            };
            // A replica of instants finds what the mean over samples leaves in the filter's band.
            let density = |hz: f64| density(chips, chip_rate_hz, hz) * passed(hz);
            let expected = integral(|hz| density(hz) * sinc(hz / WIDE_HZ));
            let found_db = 20.0 * libm::log10(amplitude) - 10.0 * libm::log10(share) - CN0_DBHZ;
            let expected_db = 20.0 * libm::log10(expected);
            // Less the noise that passes for such a replica.
            let cn0_dbhz = CN0_DBHZ + found_db - 10.0 * libm::log10(integral(density));
            println!(
                "{signal} {index}: {found_db:.3} dB by a wide replica, expected {expected_db:.3}; {cn0_dbhz:.2} dB-Hz"
            );
            // As above, and the other component through its correlation behind the filter.
            assert!((found_db - expected_db).abs() < 0.15, "{signal} {index}: {found_db} {expected_db}");
        }
    }
}
