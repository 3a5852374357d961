//! Every entry on every instruction set against its slow twin, at all lengths to 130 and all offsets of the
//! planes to 31: heads and tails of vectors, and planes that begin anywhere in one. Written values may not
//! reach beyond the planes.

use super::*;
use crate::synth::band::Filter;
use crate::synth::chips::{CodeTime, MAX_STEP};
use crate::synth::tone::Modulation;
use crate::synth::waveform::{Waveform, plain};
use crate::synth::{CODE_ONE, reference};
use gnss::beidou::b1c::B1C;
use gnss::beidou::b2a::B2A;
use gnss::galileo::e1::E1;
use gnss::gps::l1c::L1C;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;
use gnss::signal::Layers;

/// Longest length, number of offsets, and a plane that holds both.
const LENGTHS: usize = 130;
const OFFSETS: usize = 32;
const PLANE: usize = OFFSETS + LENGTHS + 40;
/// Stands where nothing may be written.
const UNTOUCHED: f32 = 77.0;

/// Runs a kernel on planes of every length and offset on every level; `bits` are the baseline's, `check`
/// compares them with the twin.
fn everywhere(kernel: impl Fn(Level, &mut [f32], &mut [f32]), check: impl Fn(&[f32], &[f32])) {
    for length in 0..=LENGTHS {
        let mut baseline: Option<(Vec<f32>, Vec<f32>)> = None;
        for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
            for offset in 0..OFFSETS {
                let (mut i, mut q) = (vec![UNTOUCHED; PLANE], vec![UNTOUCHED; PLANE]);
                // The quadrature begins elsewhere than the in-phase plane.
                let (at_i, at_q) = (offset..offset + length, OFFSETS - 1 - offset..OFFSETS - 1 - offset + length);
                i[at_i.clone()].fill(0.0);
                q[at_q.clone()].fill(0.0);
                kernel(level, &mut i[at_i.clone()], &mut q[at_q.clone()]);
                for (plane, at) in [(&i, &at_i), (&q, &at_q)] {
                    let outside = plane.iter().enumerate().filter(|(n, _)| !at.contains(n));
                    assert!(outside.into_iter().all(|(_, x)| *x == UNTOUCHED), "{level:?} {length} {offset}");
                }
                let bits = (i[at_i].to_vec(), q[at_q].to_vec());
                match &baseline {
                    Some(first) => assert_eq!(*first, bits, "{level:?} {length} {offset}"),
                    None => {
                        check(&bits.0, &bits.1);
                        baseline = Some(bits);
                    }
                }
            }
        }
    }
}

/// Largest difference of two pairs of planes.
fn difference(a: (&[f32], &[f32]), b: (&[f32], &[f32])) -> f64 {
    let of = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
    of(a.0, b.0).max(of(a.1, b.1))
}

/// Largest difference between two orders of summation. Some sums are rounded to the other side, by a last
/// place of `f32` below one. Responses overshoot one, where the last place is larger, and may differ by
/// 1e-9.
fn exact_bar(edge: Edge<'_>) -> f64 {
    if matches!(edge, Edge::BandLimited(_)) { 1.2e-7 } else { 6.1e-8 }
}

#[test]
fn signals_are_their_twins_at_every_length_and_offset() {
    let filter = Filter::default();
    let spreading = plain(&L1_CA, 11).unwrap();
    for rate_hz in [1.5e6, 2.6e6, 25e6] {
        let step = (1.023e6 / rate_hz * CODE_ONE as f64) as u64;
        let mut bits = Vec::new();
        let from = CodeTime::new(8, 1010 * CODE_ONE + 12_345);
        let position = spreading.strip(from, step, LENGTHS, |period| period % 2 == 1, &mut bits);
        let run = Run {
            bits: &bits,
            position,
            step,
            turns: 0x1234_5678_9abc_def0,
            turns_step: 0x0765_4321_0fed_cba9,
            amplitude: 1.0,
            pulse: None,
        };
        for (edge, bar) in [(Edge::Nearest, 2e-6), (Edge::Area, 2.8e-6), (Edge::BandLimited(&filter), 2e-5)] {
            let twin = |i: &[f32], q: &[f32], bar: f64| {
                let (mut ri, mut rq) = (vec![0.0; i.len()], vec![0.0; q.len()]);
                reference::accumulate(edge, &run, &mut ri, &mut rq);
                assert!(difference((i, q), (&ri, &rq)) < bar, "{edge:.0?} {rate_hz} {}", i.len());
            };
            // Bars of the single-precision kernel are those of tests/kernels.rs.
            everywhere(
                |level, i, q| accumulate(level, edge, &[&[run]], i, q, &mut Buffers::default()),
                |i, q| twin(i, q, bar),
            );
            everywhere(
                |level, i, q| accumulate_exact(level, edge, &[&[run]], i, q, &mut exact::Scratch::default()),
                |i, q| twin(i, q, exact_bar(edge)),
            );
        }
    }
}

/// Test with the largest permitted steps per sample, so that the last ones of a run lie in the upper half of
/// 16 bits.
#[test]
fn the_longest_runs_are_their_twins_to_the_last_sample() {
    const SAMPLES: usize = 4096;
    let filter = Filter::default();
    let spreading = plain(&L1_CA, 11).unwrap();
    let step = (MAX_STEP * CODE_ONE as f64) as u64 - 12_345;
    let mut bits = Vec::new();
    let from = CodeTime::new(8, 1010 * CODE_ONE + 12_345);
    let position = spreading.strip(from, step, SAMPLES, |period| period % 2 == 1, &mut bits);
    let run = Run { bits: &bits, position, step, turns: 1 << 61, turns_step: 0, amplitude: 1.0, pulse: None };
    // Bars as above; over fifteen steps a sample a mean is smaller and its error with it.
    for (edge, bar) in [(Edge::Nearest, 2e-6), (Edge::Area, 2.8e-6), (Edge::BandLimited(&filter), 2e-5)] {
        let plane = || vec![0.0; SAMPLES];
        let ((mut ri, mut rq), (mut i, mut q)) = ((plane(), plane()), (plane(), plane()));
        reference::accumulate(edge, &run, &mut ri, &mut rq);
        accumulate(Level::Baseline, edge, &[&[run]], &mut i, &mut q, &mut Buffers::default());
        assert!(difference((&i, &q), (&ri, &rq)) < bar, "{edge:.0?}");
        let (mut i, mut q) = (plane(), plane());
        accumulate_exact(Level::Baseline, edge, &[&[run]], &mut i, &mut q, &mut exact::Scratch::default());
        assert!(difference((&i, &q), (&ri, &rq)) < exact_bar(edge), "{edge:.0?}");
    }
}

/// Data and pilot with all layers, as runs of one ray: of Galileo E1 on one line, of BeiDou B1C and B2a at
/// right angles, of GPS L1C with layers that take turns as one.
#[test]
fn rays_of_several_runs_are_the_sums_of_their_twins_at_every_length_and_offset() {
    let filter = Filter::default();
    let signals = [(&E1, 11, 4), (&B1C, 27, 3), (&B2A, 27, 2), (&L1C, 14, 2)];
    // A sample spans up to 2.5, 1.93, 1.23 and 0.49 steps of BOC(6,1).
    for ((signal, number, count), rate_hz) in
        signals.into_iter().flat_map(|of| [5e6, 6.4e6, 10e6, 25e6].map(|r| (of, r)))
    {
        let link = signal.link(Sv { system: signal.system, number });
        for (edge, bar) in [(Edge::Nearest, 2e-6), (Edge::Area, 2.8e-6), (Edge::BandLimited(&filter), 2e-6)] {
            let (mut strips, mut runs) = (Vec::new(), Vec::new());
            for (index, component) in signal.components.iter().enumerate() {
                for voice in Waveform::new(link, index).unwrap().unwrap().voices(Layers::Whole, edge, rate_hz).unwrap()
                {
                    let (pace, mut bits) = (voice.spreading.pace(), Vec::new());
                    let step = (pace.step_rate_hz() / rate_hz * CODE_ONE as f64) as u64;
                    // The last steps of a period, or of as much of one as 64 bits count.
                    let last = u64::from(pace.steps).min(65_000);
                    let from = CodeTime::new(8, last * CODE_ONE - 5 * step / 3);
                    let position = voice.spreading.strip(from, step, LENGTHS, |period| period % 3 == 1, &mut bits);
                    let quarters = (4.0 * (component.phase_cycles + voice.phase_cycles)).rem_euclid(4.0);
                    assert_eq!(quarters.fract(), 0.0);
                    let turns = 0x1234_5678_9abc_def0_u64.wrapping_add((quarters as u64) << 62);
                    runs.push((position, step, turns, 0.5_f64.sqrt() * voice.amplitude, voice.pulse));
                    strips.push(bits);
                }
            }
            let runs: Vec<Run<'_>> = (runs.iter().zip(&strips))
                .map(|((position, step, turns, amplitude, pulse), bits)| Run {
                    bits,
                    position: *position,
                    step: *step,
                    turns: *turns,
                    turns_step: 0x0765_4321_0fed_cba9,
                    amplitude: *amplitude,
                    pulse: pulse.as_deref(),
                })
                .collect();
            // Behind the filter the layers of a component are one sequence of chips with a pulse.
            let is_filtered = matches!(edge, Edge::BandLimited(_));
            let count = if signal.name == E1.name && is_filtered { 2 } else { count };
            assert_eq!(runs.len(), count, "{}", signal.name);
            let some = &runs[1..count.min(3)];
            let amplitude: f64 = runs.iter().chain(some).map(|run| run.amplitude).sum();
            let (mut ri, mut rq) = (vec![0.0; LENGTHS], vec![0.0; LENGTHS]);
            for run in runs.iter().chain(some) {
                reference::accumulate(edge, run, &mut ri, &mut rq);
            }
            let check = |i: &[f32], q: &[f32], bar: f64| {
                let error = difference((i, q), (&ri[..i.len()], &rq[..q.len()]));
                assert!(error < bar, "{} {edge:.0?} {rate_hz} {}: {error}", signal.name, i.len());
            };
            // The bar of one run of amplitude one, for all amplitudes together.
            everywhere(
                |level, i, q| accumulate(level, edge, &[&runs, some], i, q, &mut Buffers::default()),
                |i, q| check(i, q, amplitude * bar),
            );
            // The definition sums runs in single precision: half a last place of numbers below four for each,
            // and one for all. A pulse has corners, 6e-7 of its edges.
            let roundings = (runs.len() + some.len() + 1) as f64;
            let corners = if is_filtered { 6e-7 * amplitude } else { 0.0 };
            everywhere(
                |level, i, q| accumulate_exact(level, edge, &[&runs, some], i, q, &mut exact::Scratch::default()),
                |i, q| check(i, q, roundings * 1.2e-7 + corners),
            );
        }
    }
}

#[test]
fn tones_are_their_twins_at_every_length_and_offset() {
    let tone = Tone {
        turns: 0x1234_5678_9abc_def0,
        turns_step: 0x0f0f_1111_2222_3333,
        place: 0,
        place_step: 0,
        modulation: Modulation::None,
        band_cps: (-1.0, 1.0),
        amplitude: 1.0,
    };
    everywhere(
        |level, i, q| add_tone(level, &tone, i, q),
        |i, q| {
            for (n, (i, q)) in (0_u64..).zip(i.iter().zip(q)) {
                let turns = tone.turns.wrapping_add(tone.turns_step.wrapping_mul(n));
                let (sin, cos) = libm::sincos(crate::synth::radians(turns));
                // Sines of 3e-7 and an angle of 2⁻³² turn.
                assert!((f64::from(*i) - cos).abs().max((f64::from(*q) - sin).abs()) < 4e-7);
            }
        },
    );
}

#[test]
fn waves_are_interpolated_and_turned_as_their_twins_do_at_every_length_and_offset() {
    let interpolator = Interpolator::new(0.4, true);
    let position = Position { whole: 0, fraction: 0x8123_4567, step: 0x0_b000_0001 };
    let (first, last) = Interpolator::reach(position, LENGTHS);
    let source = resample::draw(Level::Baseline, 5, (first, last));
    let whole = {
        let (mut i, mut q) = (vec![0.0; LENGTHS], vec![0.0; LENGTHS]);
        interpolator.apply(position, (&source.0, &source.1), (&mut i, &mut q));
        (i, q)
    };
    assert!(whole.0.iter().chain(&whole.1).all(|x| *x != 0.0));
    everywhere(
        |level, i, q| interpolate(level, &interpolator, position, (&source.0, &source.1), (i, q)),
        |i, q| assert_eq!((i, q), (&whole.0[..i.len()], &whole.1[..q.len()])),
    );
    let carrier = (0xfedc_ba98_7654_3210, 0x0123_4567_89ab_cdef_u64);
    everywhere(
        |level, i, q| {
            let wave = (&source.0[7..7 + i.len()], &source.1[3..3 + q.len()]);
            turn(level, wave, carrier, 0.5, (i, q));
        },
        |i, q| {
            for (n, (i, q)) in i.iter().zip(q).enumerate() {
                let turns = carrier.0.wrapping_add(carrier.1.wrapping_mul(n as u64));
                let (sin, cos) = libm::sincos(crate::synth::radians(turns));
                let (wi, wq) = (f64::from(source.0[7 + n]), f64::from(source.1[3 + n]));
                let (re, im) = (0.5 * (wi * cos - wq * sin), 0.5 * (wi * sin + wq * cos));
                // Five deviations of the wave at most, times the sines' 3e-7 and three roundings of 6e-8.
                assert!((f64::from(*i) - re).abs().max((f64::from(*q) - im).abs()) < 5.0 * 5e-7, "{n}");
            }
        },
    );
}

#[test]
fn samples_are_packed_as_the_twin_does_at_every_length_and_offset() {
    // Halves, both ends of every range, and what is beyond them.
    let value = |n: usize| {
        [0.5, -1.5, 126.5, 127.51, -127.6, 128.0, 40_000.0, -3e5, 32_767.5, -0.0][n % 10] * (1.0 + (n / 10) as f32)
    };
    let plane: Vec<f32> = (0..PLANE).map(value).collect();
    for (format, _) in Format::NAMES {
        for length in 0..=LENGTHS {
            for offset in 0..OFFSETS {
                let (i, q) = (&plane[offset..offset + length], &plane[OFFSETS - offset..OFFSETS - offset + length]);
                let (expected, outside) = packed(format, i, q);
                for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
                    let mut out = vec![0xa5; offset + length * format.bytes() + 9];
                    let end = offset + length * format.bytes();
                    let clipped = pack(level, format, i, q, &mut out[offset..end]);
                    assert_eq!(
                        (&out[offset..end], clipped),
                        (expected.as_slice(), outside),
                        "{format:?} {level:?} {length}"
                    );
                    assert!(
                        out[..offset].iter().chain(&out[end..]).all(|byte| *byte == 0xa5),
                        "{format:?} {level:?} {length}"
                    );
                }
            }
        }
    }
}

/// The obvious packing: rounded half to even in `f64`, held at full scale, and the number of components
/// beyond it.
fn packed(format: Format, i: &[f32], q: &[f32]) -> (Vec<u8>, u64) {
    let (mut bytes, mut outside) = (Vec::new(), 0);
    let planes: &[&[f32]] = if format.is_complex() { &[i, q] } else { &[i] };
    for n in 0..i.len() {
        for plane in planes {
            let x = f64::from(plane[n]);
            let full = match format {
                Format::Cf32Le => {
                    bytes.extend(plane[n].to_le_bytes());
                    continue;
                }
                Format::Cu8 => 127.5,
                Format::Ci8 | Format::Ri8 => 127.0,
                Format::Ci16Le | Format::Ri16Le => 32_767.0,
            };
            outside += u64::from(x.abs() > full + 0.5);
            let held = x.clamp(-full, full);
            match format {
                Format::Cu8 => bytes.push((held + 127.5).round_ties_even() as u8),
                Format::Ci8 | Format::Ri8 => bytes.push(held.round_ties_even() as i8 as u8),
                _ => bytes.extend((held.round_ties_even() as i16).to_le_bytes()),
            }
        }
    }
    (bytes, outside)
}
