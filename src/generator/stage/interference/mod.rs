//! Interference: waves that reach the antenna in addition to those of the satellites.
//!
//! An [`Interferer`] is a waveform on a carrier with a power, a time and perhaps a position. It lives in true
//! time and arrives at RF, so the receiver's oscillator shifts it as it shifts satellites. Phases are
//! anchored at every run of 4096 samples and linear within it (a Doppler rate of 1000 Hz/s leaves 3e-4 cycle
//! at 2.6 Msps); where the antenna's motion is pushed, at its ticks too. Power is that at the antenna's port
//! in the waveform's whole band; of matched chips the samples have what their edges keep, as of satellites.
//! Every waveform but noise on the samples' own grid is a function of the time of emission, so stations hear
//! the same one. Limits: no polarisation, no pattern, one straight path.

pub mod arrival;
pub mod period;
mod shared;
mod waveform;

use std::ops::Range;
use std::sync::Arc;

use arrival::{Path, Repetition, Tuning, fraction_turns};
use period::Period;
pub use shared::Shared;
pub use waveform::{ChipEdge, Recorded, Waveform};

use crate::array::Element;
use crate::random::mix;
use crate::stage::{Block, Stage};
use crate::switches::{Source, Switches};
use crate::synth::chips::MARGIN_STEPS;
use crate::synth::isa::{self, Level};
use crate::synth::lanes::Buffers;
use crate::synth::noise::BLOCK_SAMPLES;
use crate::synth::resample::{Interpolator, Position, draw};
use crate::synth::tone::{Modulation, Tone};
use crate::synth::{CODE_ONE, Run};
use crate::vehicle::Trajectory;
use gnss::facts::Interference;
use gnss::record::InterferenceRow;

/// Samples of a run, on an absolute grid.
const RUN: u64 = BLOCK_SAMPLES as u64;

/// Shares of a sample by which a pulse's edge is moved, so that rounding does not decide about a sample on
/// it.
const EDGE_SAMPLES: f64 = 1e-6;

/// Source of interference in a scene.
#[derive(Clone, Debug)]
pub struct Interferer {
    /// Number of the source in the scenario, from 1.
    pub source: u64,
    /// Kind of the source as a scenario writes it.
    pub kind: &'static str,
    /// Waveform of the source.
    pub waveform: Waveform,
    /// Period of a sweep that leaves the samples' band.
    pub period: Option<Arc<Period>>,
    /// Carrier or middle of the band in Hz, as sent.
    pub carrier_hz: f64,
    /// Power over noise density at the antenna in Hz when the scene starts; for pulses, while a pulse is on.
    pub jn0_hz: f64,
    /// Path to the antenna; `None` for a source without a position.
    pub path: Option<Path>,
    /// Samples in which the source is on, at the antenna.
    pub on: Range<u64>,
    /// True time in seconds since the scene's start at which it is switched on, where stations share it.
    pub sent_s: Option<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Receiver's effect on the wave.
    pub tuning: Tuning,
    /// Switches that act while the scene is sent.
    pub switches: Option<Arc<Switches>>,
    /// Channel and coupling of the element of an array that hears it, if they are not ideal.
    pub element: Option<Arc<Element>>,
    /// Waves that the elements of an array share.
    pub shared: Option<Arc<Shared>>,
    /// Description for the plan.
    pub description: String,
}

/// Values that hold over one run.
struct Anchor {
    n: u64,
    /// Samples to its other end.
    length: u64,
    /// Time of the receiver's clock minus the transmission time, at both ends, in seconds.
    behind_s: [f64; 2],
    turns: u64,
    turns_step: u64,
    amplitude: f64,
}

impl Interferer {
    /// Makes the source, which is that of an array's first element without errors, the one that another
    /// element hears: its antenna moves along `antenna`.
    pub fn at_element(&mut self, antenna: Trajectory, tuning: Tuning, element: Option<Arc<Element>>) {
        self.shared = Some(Arc::new(Shared::new(self.clone())));
        if let Some(path) = &mut self.path {
            let first_s = path.first_travel_s();
            path.antenna = antenna;
            self.jn0_hz *= (first_s / path.first_travel_s()).powi(2);
        }
        (self.tuning, self.element) = (tuning, element);
    }

    /// Factor on the power and phase ahead in cycles, at sample `n`, of the element that hears it.
    fn heard(&self, n: u64) -> (f64, f64) {
        let (Some(element), Some(path)) = (&self.element, &self.path) else { return (1.0, 0.0) };
        let t_s = self.tuning.elapsed_s(n);
        element.response(&path.towards(t_s), t_s, self.carrier_hz)
    }

    fn travel_s(&self, n: u64) -> f64 {
        self.path.as_ref().map_or(0.0, |path| path.travel_s(self.tuning.elapsed_s(n)))
    }

    /// Time of the receiver's clock at sample `n` minus the transmission time of the wave, in seconds.
    fn behind_s(&self, n: u64) -> f64 {
        let (clock, local) = (&self.tuning.clock, self.tuning.clock.epoch(n));
        let late_s = self.element.as_ref().map_or(0.0, |element| element.delay_s);
        local.since(self.tuning.receiver_clock.true_time(clock.start, local)) + self.travel_s(n) + late_s
    }

    /// Power over noise density at sample `n`, while on: falls with the square of the distance.
    fn jn0_at(&self, n: u64) -> f64 {
        let switch = |all: &Arc<Switches>| all.at(Source::Jammer(self.source), all.tick_of(n)).gain;
        let jn0_hz = self.switches.as_ref().map_or(self.jn0_hz, |all| self.jn0_hz * switch(all));
        self.path.as_ref().map_or(jn0_hz, |path| {
            let nearer = path.first_travel_s() / self.travel_s(n);
            jn0_hz * nearer * nearer
        })
    }

    /// Share of its power at the antenna that samples have: chip edges take from a matched one.
    pub fn kept(&self, rate_hz: f64) -> f64 {
        match &self.waveform {
            Waveform::Matched { chips, edge } => edge.edge().power(&[1.0], chips.hz() / rate_hz),
            _ => 1.0,
        }
    }

    /// Describes the waveform, as far as its spectrum needs it.
    pub fn fact(&self) -> Interference {
        match &self.waveform {
            Waveform::Cw => Interference::Cw,
            Waveform::Chirp { sweep_hz, repetition } => {
                Interference::Chirp { width_hz: *sweep_hz, repetition_hz: repetition.hz() }
            }
            Waveform::Fmcw { sweep_hz, repetition } => {
                Interference::Fmcw { width_hz: *sweep_hz, repetition_hz: repetition.hz() }
            }
            Waveform::SineFm { deviation_hz, repetition } => {
                Interference::SineFm { deviation_hz: *deviation_hz, repetition_hz: repetition.hz() }
            }
            Waveform::Pulse { width_s, repetition, jitter } => {
                let repetition_hz = repetition.hz();
                Interference::Pulse { repetition_hz, duty: width_s * repetition_hz, jitter: *jitter }
            }
            Waveform::Matched { chips, .. } => Interference::Matched { repetition_hz: chips.hz() },
            Waveform::White => Interference::Noise { width_hz: self.tuning.clock.rate.hz() },
            Waveform::Noise { width_hz, .. } | Waveform::Emitted { width_hz, .. } => {
                Interference::Noise { width_hz: *width_hz }
            }
            Waveform::Recording { rate, .. } => Interference::Recording { width_hz: rate.hz() },
        }
    }

    /// Duty cycle while the source is on: below one for pulses.
    pub fn duty(&self) -> f64 {
        match &self.waveform {
            Waveform::Pulse { width_s, repetition, .. } => width_s * repetition.hz(),
            _ => 1.0,
        }
    }

    /// Returns the true values at a sample; `None` while the source is off. The power is the mean over a
    /// repetition.
    pub fn row(&self, source: usize, sample: u64) -> Option<InterferenceRow> {
        if !self.on.contains(&sample) || self.jn0_at(sample) <= 0.0 {
            return None;
        }
        let ends = self.span(sample / RUN * RUN, sample);
        let (from, to) = if self.tick_samples().is_some() { (ends.start, ends.end) } else { (sample, sample + RUN) };
        let step = self.tuning.turns_step(self.carrier_hz, self.behind_s(to) - self.behind_s(from), to - from);
        Some(InterferenceRow {
            sample,
            source,
            jn0_dbhz: 10.0 * libm::log10(self.jn0_at(sample) * self.duty()),
            frequency_hz: self.unfolded_hz(step as i64 as f64 / 18_446_744_073_709_551_616.0),
        })
    }

    /// Frequency in the samples, in Hz, of a carrier with this advance in cycles per sample: that of a sweep
    /// whose middle lies outside of their band is not folded into it.
    fn unfolded_hz(&self, advance_cps: f64) -> f64 {
        let rate_hz = self.tuning.clock.rate.hz();
        let (place_hz, folded_hz) = (self.tuning.place_hz(self.carrier_hz), advance_cps * rate_hz);
        let (low_hz, high_hz) = self.tuning.band_hz();
        match (low_hz..=high_hz).contains(&place_hz) {
            true => folded_hz,
            false => folded_hz + rate_hz * ((place_hz - folded_hz) / rate_hz).round(),
        }
    }

    /// Samples of a tick, where the antenna's motion is pushed and sources are switched.
    fn tick_samples(&self) -> Option<u64> {
        self.switches.as_ref().map(|switches| switches.tick_samples())
    }

    /// Segment around sample `at` of the run from `run` on, in which phases are linear.
    fn span(&self, run: u64, at: u64) -> Range<u64> {
        let whole = run..run + RUN;
        self.tick_samples().map_or(whole.clone(), |tick| {
            let begin = at / tick * tick;
            whole.start.max(begin)..whole.end.min(begin + tick)
        })
    }

    fn anchor(&self, span: Range<u64>) -> Anchor {
        let (n, length) = (span.start, span.end - span.start);
        let behind_s = [self.behind_s(n), self.behind_s(n + length)];
        let tuning = &self.tuning;
        let (turns, turns_step) = (
            tuning.turns(self.carrier_hz, n, behind_s[0]),
            tuning.turns_step(self.carrier_hz, behind_s[1] - behind_s[0], length),
        );
        let jn0_hz = self.jn0_at(n + length / 2);
        if self.element.is_none() {
            let amplitude = tuning.amplitude_lsb(jn0_hz);
            return Anchor { n, length, behind_s, turns, turns_step, amplitude };
        }
        let [(_, first), (power, _), (_, last)] = [n, n + length / 2, n + length].map(|n| self.heard(n));
        let turned = |cycles: f64| fraction_turns(tuning.sign() * cycles);
        Anchor {
            n,
            length,
            behind_s,
            turns: turns.wrapping_add(turned(first)),
            turns_step: turns_step.wrapping_add(turned((last - first) / length as f64)),
            amplitude: tuning.amplitude_lsb(jn0_hz * power),
        }
    }

    /// Position in a repetition at the start of the run, whole and in 2^-64, and its advance per sample.
    fn place(&self, anchor: &Anchor, repetition: Repetition, late_s: f64) -> (i64, u64, i128) {
        let at = |end: usize| {
            let n = anchor.n + anchor.length * end as u64;
            let behind_s = anchor.behind_s.get(end).copied().unwrap_or(0.0);
            repetition.at(self.tuning.clock.rate, n, behind_s + late_s)
        };
        let ((whole, first), (end, last)) = (at(0), at(1));
        let advance = (i128::from(end - whole) << 64) + i128::from(last) - i128::from(first);
        (whole, first, advance / i128::from(anchor.length))
    }

    /// Adds samples `from` to `from + i.len()` of the anchor's segment.
    fn add(&self, level: Level, anchor: &Anchor, from: u64, i: &mut [f32], q: &mut [f32]) {
        match &self.waveform {
            Waveform::Chirp { repetition, .. }
            | Waveform::Fmcw { repetition, .. }
            | Waveform::SineFm { repetition, .. } => match &self.period {
                Some(period) => self.lines(level, anchor, from, (period, *repetition), i, q),
                None => {
                    let modulation = self.waveform.modulation(self.tuning.sign());
                    isa::add_tone(level, &self.tone(anchor, from, modulation, Some(*repetition)), i, q);
                }
            },
            Waveform::Cw => isa::add_tone(level, &self.tone(anchor, from, Modulation::None, None), i, q),
            Waveform::Pulse { width_s, repetition, jitter } => {
                self.pulses(level, anchor, from, (width_s * repetition.hz(), *repetition, *jitter), i, q);
            }
            Waveform::Matched { chips, edge } => self.chips(level, anchor, from, (*chips, edge), i, q),
            Waveform::White => {
                let first = (anchor.n + from) as i64;
                let (wi, wq) = draw(level, self.seed, (first, first + i.len() as i64));
                let (turns, step, amplitude) = anchor.turned(from);
                isa::turn(level, (&wi, &wq), (turns, step), amplitude, (i, q));
            }
            Waveform::Noise { step, by, .. } => {
                let place = u128::from(anchor.n + from) * u128::from(*step);
                let position = Position { whole: (place >> 32) as i64, fraction: place as u32, step: *step };
                let source = draw(level, self.seed, Interpolator::reach(position, i.len()));
                resampled(level, (by, position, source), anchor.turned(from), i, q);
            }
            Waveform::Emitted { rate, by, .. } => {
                let shared = self.shared.as_ref();
                if shared.is_some_and(|shared| shared.add(level, self, (anchor, from), (&mut *i, &mut *q))) {
                    return;
                }
                let position = self.position(anchor, from, *rate, 0.0);
                let source = self.drawn(level, Interpolator::reach(position, i.len()));
                resampled(level, (by, position, source), anchor.turned(from), i, q);
            }
            Waveform::Recording { samples, rate, by, repeat } => {
                // Its first sample is sent when it is switched on.
                let late_s = self.sent_s.unwrap_or_else(|| self.tuning.elapsed_s(self.on.start));
                let position = self.position(anchor, from, *rate, late_s);
                let source = samples.read(Interpolator::reach(position, i.len()), *repeat, self.tuning.inverted);
                resampled(level, (by, position, source), anchor.turned(from), i, q);
            }
        }
    }

    /// Noise of the source from its sample `reach.0` to `reach.1`, exclusive.
    fn drawn(&self, level: Level, reach: (i64, i64)) -> (Vec<f32>, Vec<f32>) {
        let (wi, mut wq) = draw(level, self.seed, reach);
        if self.tuning.inverted {
            wq.iter_mut().for_each(|x| *x = -*x);
        }
        (wi, wq)
    }

    /// Position among the source's samples at sample `from` of the run, the first of them sent at `late_s`.
    fn position(&self, anchor: &Anchor, from: u64, rate: Repetition, late_s: f64) -> Position {
        let (whole, first, advance) = self.place(anchor, rate, late_s);
        let place = (i128::from(whole) << 64) + i128::from(first) + advance * i128::from(from);
        Position { whole: (place >> 64) as i64, fraction: (place >> 32) as u32, step: (advance >> 32) as u64 }
    }

    /// Position in a repetition at sample `from` of the run, and its advance per sample, in 2^-64.
    fn phase(&self, anchor: &Anchor, repetition: Repetition, from: u64) -> (u64, u64) {
        let (_, place, step) = self.place(anchor, repetition, 0.0);
        let step = step as u64;
        (place.wrapping_add(step.wrapping_mul(from)), step)
    }

    fn tone(&self, anchor: &Anchor, from: u64, modulation: Modulation, repetition: Option<Repetition>) -> Tone {
        let (place, place_step) = repetition.map_or((0, 0), |repetition| self.phase(anchor, repetition, from));
        let rate_hz = self.tuning.clock.rate.hz();
        let (low_hz, high_hz) = self.tuning.band_hz();
        let carrier_hz = self.tuning.place_hz(self.carrier_hz);
        Tone {
            turns: anchor.turns_at(from),
            turns_step: anchor.turns_step,
            place,
            place_step,
            modulation,
            band_cps: ((low_hz - carrier_hz) / rate_hz, (high_hz - carrier_hz) / rate_hz),
            amplitude: anchor.amplitude as f32,
        }
    }

    /// The lines of a sweep that lie in the samples' band.
    fn lines(
        &self,
        level: Level,
        anchor: &Anchor,
        from: u64,
        (period, repetition): (&Period, Repetition),
        i: &mut [f32],
        q: &mut [f32],
    ) {
        let (place, step) = self.phase(anchor, repetition, from);
        let (by, position, source) = period.read((place, step), i.len());
        let turns = anchor.turns_at(from).wrapping_add(period.turns(place));
        let turned = (turns, anchor.turns_step.wrapping_add(period.turns(step)), anchor.amplitude as f32);
        resampled(level, (by, position, source), turned, i, q);
    }

    /// The carrier wherever a pulse is on: `duty` of a period, late by `jitter` times a random share of it.
    fn pulses(
        &self,
        level: Level,
        anchor: &Anchor,
        from: u64,
        (duty, repetition, jitter): (f64, Repetition, f64),
        i: &mut [f32],
        q: &mut [f32],
    ) {
        let unit = 18_446_744_073_709_551_616.0;
        let (whole, first, advance) = self.place(anchor, repetition, 0.0);
        let (first, advance) = (first as f64 / unit, advance as f64 / unit);
        let end = from + i.len() as u64;
        // Periods, counted from that of the run's start, whose pulse can reach into the run.
        let last = (first + advance * end as f64).floor() as i64;
        for period in -2..=last {
            let late = jitter * random_share(self.seed, whole + period);
            let begin = (period as f64 + late - first) / advance;
            let sample = |at: f64| ((at - EDGE_SAMPLES).ceil().max(from as f64) as u64).min(end);
            let (a, b) = (sample(begin), sample(begin + duty / advance));
            let inside = (a - from) as usize..(b.max(a) - from) as usize;
            if let (Some(i), Some(q)) = (i.get_mut(inside.clone()), q.get_mut(inside)) {
                isa::add_tone(level, &self.tone(anchor, a, Modulation::None, None), i, q);
            }
        }
    }

    /// Random chips through the kernel of spreading codes.
    fn chips(
        &self,
        level: Level,
        anchor: &Anchor,
        from: u64,
        (chips, edge): (Repetition, &ChipEdge),
        i: &mut [f32],
        q: &mut [f32],
    ) {
        let (whole, first, advance) = self.place(anchor, chips, 0.0);
        let place = (i128::from(whole) << 64) + i128::from(first) + advance * i128::from(from);
        let step = (advance >> 16) as u64;
        let chip = (place >> 64) as i64;
        let start = (chip - MARGIN_STEPS as i64).div_euclid(64);
        let span = (step * i.len() as u64 / CODE_ONE) as i64 + 2 * MARGIN_STEPS as i64 + 2;
        let bits: Vec<u64> = (start..=start + span / 64 + 2).map(|word| mix(self.seed ^ mix(word as u64))).collect();
        let edge = edge.edge();
        let run = Run {
            bits: &bits,
            position: (chip - start * 64) as u64 * CODE_ONE + ((place as u64) >> 16),
            step,
            turns: anchor.turns_at(from),
            turns_step: anchor.turns_step,
            amplitude: anchor.amplitude,
            pulse: None,
        };
        isa::accumulate(level, edge, &[&[run]], i, q, &mut Buffers::default());
    }
}

impl Anchor {
    /// Carrier's phase at sample `from` of the run, in 2^-64 turn.
    fn turns_at(&self, from: u64) -> u64 {
        self.turns.wrapping_add(self.turns_step.wrapping_mul(from))
    }

    /// Carrier's phase at sample `from` of the run, its advance per sample and the amplitude.
    fn turned(&self, from: u64) -> (u64, u64, f32) {
        (self.turns_at(from), self.turns_step, self.amplitude as f32)
    }
}

/// Adds a source at another rate, turned by a carrier.
fn resampled(
    level: Level,
    (by, position, source): (&Interpolator, Position, (Vec<f32>, Vec<f32>)),
    (turns, step, amplitude): (u64, u64, f32),
    i: &mut [f32],
    q: &mut [f32],
) {
    let (mut wi, mut wq) = (vec![0.0; i.len()], vec![0.0; q.len()]);
    isa::interpolate(level, by, position, (&source.0, &source.1), (&mut wi, &mut wq));
    isa::turn(level, (&wi, &wq), (turns, step), amplitude, (i, q));
}

/// A share in [0, 1) that belongs to a number.
fn random_share(seed: u64, number: i64) -> f64 {
    (mix(seed ^ mix(number as u64)) >> 11) as f64 / 9_007_199_254_740_992.0
}

impl Stage for Interferer {
    fn name(&self) -> &'static str {
        "interference"
    }

    fn describe(&self) -> String {
        self.description.clone()
    }

    fn act(&self, block: &mut Block<'_>) {
        let pieces = block.i.chunks_mut(BLOCK_SAMPLES).zip(block.q.chunks_mut(BLOCK_SAMPLES));
        for (number, (i, q)) in (0_u64..).zip(pieces) {
            let n = block.start + number * RUN;
            let last = n + i.len() as u64;
            let mut at = n;
            while at < last {
                let span = self.span(n, at);
                let begin = self.on.start.clamp(at, span.end.min(last)) - n;
                let end = self.on.end.clamp(at, span.end.min(last)) - n;
                let inside = begin as usize..end as usize;
                if let (false, Some(i), Some(q)) = (begin >= end, i.get_mut(inside.clone()), q.get_mut(inside)) {
                    let (from, anchor) = (n + begin - span.start, self.anchor(span.clone()));
                    if anchor.amplitude > 0.0 || self.switches.is_none() {
                        self.add(block.level, &anchor, from, i, q);
                    }
                }
                at = span.end;
            }
        }
    }
}
