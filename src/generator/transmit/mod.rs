//! One satellite's signal as the stream needs it: when it is in view, its polynomials, its data.
//!
//! [`Transmitter::prepare`] gathers all of that for a segment of samples; [`Transmitter::arrange`] then lists
//! the runs of any block of the segment and changes nothing, so blocks are made side by side. Everything is
//! decided on absolute grids: view by whole seconds, parts and runs by sample numbers.

mod rays;
mod rising;
mod symbols;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

pub use rays::{CodePhase, RayAt, Rays};
use symbols::{Data, Symbols};

use crate::arrival;
use crate::error::GenerateError;
use crate::fast_phase::FastPhases;
use crate::geometry::{Geometry, Places};
use crate::knots::{Grid, Part, Path};
use crate::presence::Passes;
use crate::scene::Scene;
use crate::sky;
use crate::spoof::Constellation;
use crate::synth::bank::Bank;
use crate::synth::chips::{CodeTime, Spreading};
use crate::synth::pulse::Pulse;
use crate::synth::waveform::{Voice, Waveform};
use crate::synth::{CODE_ONE, Edge, RUN_SAMPLES, Run};
use gnss::broadcast::OrbitError;
use gnss::satellite::Sv;
use gnss::signal::{Carrier, Signal};
use gnss::time::{Epoch, tone_turns};

/// Length of a short polynomial of an orbit at least, where roots are shorter.
const SPAN_S: f64 = 8.0;
/// Breaks of the motion a second from which on nodes are dense: without breaks a curve lasts a second and
/// more.
const DENSE_BREAKS: f64 = 5.0;

/// A sequence of ±1 of a component.
struct Sent {
    /// Number of the component in its signal.
    component: usize,
    spreading: Spreading,
    pulse: Option<Arc<Pulse>>,
    data: Option<Data>,
    /// Factor on the amplitude, for unit mean power of the component's waveform and its share.
    gain: f64,
    /// Carrier phase relative to the signal's, in samples: the other way round in an inverted spectrum.
    turns: u64,
    /// Position among those that are added in one pass, from 0.
    part: usize,
}

/// Puts sequences that are quarters of a turn apart next to each other: one carrier turns all.
fn in_chords(sent: &mut [Sent]) {
    let cross = |sent: &Sent| sent.turns << 2;
    sent.sort_by_key(cross);
    for chord in sent.chunk_by_mut(|a, b| cross(a) == cross(b)) {
        chord.iter_mut().enumerate().for_each(|(part, sent)| sent.part = part);
    }
}

/// A satellite's signal in a scene.
pub struct Transmitter {
    /// Constellation that sends the signal.
    pub from: Arc<Constellation>,
    /// Samples in which that one sends.
    on: Range<u64>,
    /// The satellite.
    pub sv: Sv,
    /// The signal.
    pub signal: &'static Signal,
    /// Geometry that the satellite's other signals share, if it has any.
    pub geometry: Option<Arc<Geometry>>,
    /// Antenna positions for all satellites, if nodes are dense.
    pub places: Option<Arc<Places>>,
    /// The orbit over the running span of roots, where nodes are dense, by the span's number.
    arc: Option<(u64, Option<sky::Arc>)>,
    if_hz: f64,
    /// Phase step of the IF, in 2^-64 turn per sample.
    tone_step: u64,
    sent: Vec<Sent>,
    grid: Grid,
    /// View at the beginning of each second, by its number.
    view: BTreeMap<u64, bool>,
    /// Sample from which the satellite has been in view.
    since: Option<u64>,
    /// Passes in the prepared samples.
    pub passes: Passes,
    roots: BTreeSet<u64>,
    parts: Vec<Part>,
    fast: FastPhases,
    /// Symbols that are sent and were sent.
    pub symbols: Symbols,
    /// True if the satellite was in view in the prepared samples.
    pub seen: bool,
    /// Polynomials made.
    pub knots: u64,
    /// Largest error of the carrier met between their knots, in cycles.
    pub worst_knot_cycles: f64,
}

/// Buffers of one worker.
#[derive(Default)]
pub struct Scratch {
    /// Runs that [`Transmitter::arrange`] has gathered.
    pub bank: Bank,
    anchor: Option<Anchor>,
}

/// Values that satellites share at the first sample of a run. They save 128-bit divisions.
#[derive(Clone, Copy)]
struct Anchor {
    n: u64,
    if_hz: f64,
    /// Whole seconds of the stream.
    second: u64,
    epoch: Epoch,
    tone: u64,
}

impl Scratch {
    fn anchor(&mut self, scene: &Scene, if_hz: f64, n: u64) -> Anchor {
        match self.anchor {
            Some(anchor) if anchor.n == n && anchor.if_hz == if_hz => anchor,
            _ => {
                let tone = tone_turns(if_hz, scene.clock.rate, n);
                let second = scene.clock.rate.elapsed(n).0 as u64;
                *self.anchor.insert(Anchor { n, if_hz, second, epoch: scene.clock.epoch(n), tone })
            }
        }
    }
}

impl Transmitter {
    /// A true satellite's signal; `None` if the signal's documents assign `sv` no code or no carrier.
    ///
    /// # Errors
    /// [`GenerateError::Waveform`] if a sample would span more than 15 code steps, or a code is none.
    pub fn new(scene: &Scene, sv: Sv, signal: &'static Signal, edge: Edge<'_>) -> Result<Option<Self>, GenerateError> {
        Self::of(scene, Arc::new(Constellation::authentic()), sv, signal, edge)
    }

    /// The signal that a constellation sends as `sv`.
    ///
    /// # Errors
    /// Errors of [`Transmitter::new`].
    pub fn of(
        scene: &Scene,
        from: Arc<Constellation>,
        sv: Sv,
        signal: &'static Signal,
        edge: Edge<'_>,
    ) -> Result<Option<Self>, GenerateError> {
        let rate_hz = scene.clock.rate.hz();
        if matches!(signal.carrier, Carrier::Channels { channel, .. } if channel(sv.number).is_none()) {
            return Ok(None);
        }
        let (mut sent, symbols) = (Vec::new(), Symbols::new(signal));
        for (index, component) in signal.components.iter().enumerate() {
            let Some(waveform) = Waveform::new(signal.link(sv), index)? else { return Ok(None) };
            for Voice { spreading, amplitude, phase_cycles, pulse } in
                waveform.voices(scene.fidelity.waveform, edge, rate_hz)?
            {
                let cycles = component.phase_cycles + phase_cycles;
                sent.push(Sent {
                    component: index,
                    spreading,
                    pulse,
                    data: symbols.of(component),
                    gain: component.power_share.sqrt() * amplitude,
                    turns: turns(if scene.metadata.inverted { -cycles } else { cycles }),
                    part: sent.len(),
                });
            }
        }
        if signal.sides_hz() > 0.0 {
            in_chords(&mut sent);
        }
        let carrier_hz = signal.carrier_hz(sv);
        let if_hz = scene.metadata.if_hz(carrier_hz);
        let reading_s = |t_s: &f64| scene.receiver_clock.reading_elapsed_s(scene.clock.start, *t_s);
        let breaks = from.breaks_s(&scene.trajectory);
        let breaks = breaks.iter().map(|t_s| (reading_s(t_s) * rate_hz).ceil().max(0.0) as u64).collect();
        let grid = Grid::new(scene.clock.rate, breaks, scene.fidelity.knot_tolerance_cycles, carrier_hz)
            .with_roots_of(scene.trajectory.tick_samples());
        Ok(Some(Self {
            on: from.on(scene.clock, &scene.receiver_clock),
            from,
            sv,
            signal,
            geometry: None,
            places: None,
            arc: None,
            if_hz,
            tone_step: tone_turns(if_hz, scene.clock.rate, 1),
            sent,
            grid,
            view: BTreeMap::new(),
            since: None,
            passes: Passes::default(),
            roots: BTreeSet::new(),
            parts: Vec::new(),
            fast: FastPhases::default(),
            symbols,
            seen: false,
            knots: 0,
            worst_knot_cycles: 0.0,
        }))
    }

    /// The polynomials of one root part of the grid.
    ///
    /// # Errors
    /// Errors of orbits.
    pub fn root(&self, scene: &Scene, root: u64) -> Result<Vec<Part>, GenerateError> {
        let span = self.span(scene, root);
        let made = match &self.arc {
            Some((known, _)) if Some(*known) == span => None,
            _ => span.map(|span| self.orbit(scene, span)).transpose()?,
        };
        let arc = match (&made, &self.arc) {
            (Some(arc), _) => arc.as_ref(),
            (None, Some((_, arc))) => arc.as_ref().filter(|_| span.is_some()),
            (None, None) => None,
        };
        // A root is a tick where anything can be switched.
        let switched = scene.switched(self.from.number, self.sv, root * self.root_samples());
        let carrier_hz = self.signal.carrier_hz(self.sv);
        let observe = |n: u64| {
            let local = scene.clock.epoch(n);
            let seen = match arc {
                Some(arc) => arrival::seen_on(scene, &self.from, arc, self.signal, local, self.places.as_deref()),
                None => arrival::seen_by(scene, &self.from, (self.sv, self.signal), local, self.geometry.as_deref()),
            };
            let act = |arrival| switched.act(arrival, carrier_hz, n as f64, scene.clock.rate);
            seen.map(|seen| seen.map(|seen| seen.arrivals.into_iter().map(act).collect()))
        };
        Ok(self.grid.root(root, &observe)?)
    }

    /// Roots whose orbit is one short polynomial.
    fn roots_of_span(&self, scene: &Scene) -> u64 {
        ((SPAN_S * scene.clock.rate.hz()) as u64 / self.root_samples()).max(1)
    }

    /// The span of a root, where nodes are dense: a spinning antenna needs thousands a second, pushed motion
    /// seven a tick, and a file of motion seven a row.
    fn span(&self, scene: &Scene, root: u64) -> Option<u64> {
        let dense = scene.trajectory.spins()
            || scene.trajectory.grown().is_some()
            || scene.trajectory.breaks_a_second() > DENSE_BREAKS;
        dense.then(|| root / self.roots_of_span(scene))
    }

    /// The orbit over a span.
    fn orbit(&self, scene: &Scene, span: u64) -> Result<Option<sky::Arc>, OrbitError> {
        let samples = self.roots_of_span(scene) * self.root_samples();
        let [from, to] = [span, span + 1].map(|span| self.from.replayed(scene.clock.epoch(span * samples)));
        let arc = sky::Arc::through(scene.catalogue_of(&self.from), self.sv, from, to)?;
        // Where the motion begins, which a replay knows as well.
        let first_m = scene.trajectory.composed_for().position_m;
        Ok(arc.map(|arc| if scene.trajectory.grown().is_some() { arc.near(&first_m) } else { arc }))
    }

    /// Samples of a root part.
    pub fn root_samples(&self) -> u64 {
        self.grid.root_samples()
    }

    /// Prepares the data for samples `from..to`, and drops earlier data.
    ///
    /// # Errors
    /// Errors of orbits and messages.
    pub fn prepare(&mut self, scene: &Scene, from: u64, to: u64) -> Result<(), GenerateError> {
        self.prepare_heard(scene, (from, to), true)
    }

    /// [`Transmitter::prepare`], without messages where they are not heard.
    ///
    /// # Errors
    /// Errors of [`Transmitter::prepare`].
    pub fn prepare_heard(
        &mut self,
        scene: &Scene,
        (from, to): (u64, u64),
        is_heard: bool,
    ) -> Result<(), GenerateError> {
        let first = scene.clock.rate.elapsed(from).0 as u64;
        if self.view.is_empty() && first > 0 {
            let sample = |second| scene.clock.rate.first_sample_at(second, 1);
            let presence =
                |second| arrival::presence_from(scene, &self.from, self.sv, scene.clock.epoch(sample(second)));
            self.since = rising::rising(scene, (&self.from, self.sv), first, presence)?.map(sample);
        }
        self.prepare_rays(scene, from, to)?;
        if is_heard { self.prepare_messages(scene, from, to) } else { Ok(()) }
    }

    /// [`Transmitter::prepare`] for samples alone: how long the satellite has been in view is not sought.
    ///
    /// # Errors
    /// Errors of [`Transmitter::prepare`].
    pub fn prepare_alone(&mut self, scene: &Scene, from: u64, to: u64) -> Result<(), GenerateError> {
        self.prepare_rays(scene, from, to)?;
        self.prepare_messages(scene, from, to)
    }

    /// Prepares view and polynomials.
    fn prepare_rays(&mut self, scene: &Scene, from: u64, to: u64) -> Result<(), GenerateError> {
        let rate = scene.clock.rate;
        let (first, last) = (rate.elapsed(from).0 as u64, rate.elapsed(to.saturating_sub(1)).0 as u64);
        self.view = self.view.split_off(&first);
        for second in first..=last {
            if !self.view.contains_key(&second) {
                let sample = rate.first_sample_at(second, 1);
                let presence = arrival::presence_from(scene, &self.from, self.sv, scene.clock.epoch(sample))?;
                let up = self.passes.look(sample, &presence);
                self.since = if up { self.since.or(Some(sample)) } else { None };
                self.view.insert(second, up);
            }
        }
        self.parts.retain(|part| part.end > from);
        if to <= self.on.start || from >= self.on.end {
            return Ok(());
        }
        if !self.view.values().any(|up| *up) {
            return Ok(());
        }
        self.seen = true;
        let size = self.grid.root_samples();
        self.roots = self.roots.split_off(&(from / size));
        for root in from / size..=to.saturating_sub(1) / size {
            if self.roots.insert(root) {
                let span = self.span(scene, root);
                if let Some(span) = span.filter(|span| self.arc.as_ref().is_none_or(|(known, _)| known != span)) {
                    self.arc = Some((span, self.orbit(scene, span)?));
                }
                let parts = self.root(scene, root)?;
                self.knots += parts.len() as u64;
                self.worst_knot_cycles = parts.iter().fold(self.worst_knot_cycles, |w, p| w.max(p.error_cycles));
                self.parts.extend(parts);
            }
        }
        self.fast.prepare(scene.fast_phases(), self.from.fading(self.sv), self.signal.carrier_hz(self.sv), from, to);
        Ok(())
    }

    fn prepare_messages(&mut self, scene: &Scene, from: u64, to: u64) -> Result<(), GenerateError> {
        let is_sent = to > self.on.start && from < self.on.end && self.view.values().any(|up| *up);
        if self.symbols.is_empty() || !is_sent {
            return Ok(());
        }
        let delays = self
            .parts
            .iter()
            .filter(|part| part.start < to)
            .flat_map(|part| part.paths.iter().flat_map(|path| [path.delay.at(0.0), path.delay.at(1.0)]));
        let (least, most) = delays.fold((f64::MAX, f64::MIN), |(a, b), d| (a.min(d), b.max(d)));
        if least > most {
            return Ok(());
        }
        // Margins of strips are code periods at most; a tenth of a second holds them.
        let (first, last) = (self.epoch(scene, from).plus_s(-most - 0.1), self.epoch(scene, to).plus_s(-least + 0.1));
        self.symbols.prepare(scene, &self.from, (self.sv, self.signal), [first, last], self.epoch(scene, from))
    }

    /// Time of a sample from which the delays of its signals count.
    fn epoch(&self, scene: &Scene, sample: u64) -> Epoch {
        self.from.ahead(scene.clock.epoch(sample))
    }

    /// True if the satellite is sent and in view at a sample of the prepared segment.
    pub fn in_view(&self, scene: &Scene, sample: u64) -> bool {
        self.on.contains(&sample)
            && self.view.get(&(scene.clock.rate.elapsed(sample).0 as u64)).copied().unwrap_or(false)
    }

    /// Seconds that the satellite has been in view at a sample.
    pub fn in_view_s(&self, scene: &Scene, sample: u64) -> f64 {
        self.since.map_or(0.0, |since| scene.clock.rate.elapsed_s(sample.saturating_sub(since)))
    }

    /// Phases that a run beginning at sample `n` of the prepared segment has there: the carrier of the first
    /// ray and sequence in 2^-64 turn, and its code. `None` where the satellite does not arrive.
    pub fn phases(&self, scene: &Scene, n: u64) -> Option<(u64, CodeTime)> {
        let part = self.parts.iter().find(|part| (part.start..part.end).contains(&n))?;
        let (path, sent, u) = (part.paths.first()?, self.sent.first()?, part.fraction(n));
        let tone = (tone_turns(self.if_hz, scene.clock.rate, n), self.tone_step);
        let [moved, _] = self.fast.ends(n, n);
        let rho_cycles = path.carrier.at(u) + moved.carrier_cycles;
        let (turns, _) = carrier(scene.metadata.inverted, tone, rho_cycles, 0.0);
        let code = sent.spreading.at(self.epoch(scene, n), path.delay.at(u) + moved.delay_s);
        Some((turns.wrapping_add(sent.turns), code))
    }

    /// Gathers the runs of `samples` samples from `start` on, a multiple of 4096, in the bank of `scratch`.
    pub fn arrange(&self, scene: &Scene, start: u64, samples: usize, scratch: &mut Scratch) {
        let end = start + samples as u64;
        let first = self.parts.partition_point(|part| part.end <= start);
        for part in self.parts.iter().skip(first).take_while(|part| part.start < end) {
            for path in &part.paths {
                let run_samples = self.fast.run_samples().map_or(path.run_samples, |r| r.min(path.run_samples));
                let mut n = start.max(part.start);
                while n < end.min(part.end) {
                    let whole = ((n / run_samples + 1) * run_samples).min(part.end);
                    let whole = self.fast.until(n).map_or(whole, |node| node.min(whole));
                    let anchor = scratch.anchor(scene, self.if_hz, n);
                    if self.on.contains(&n) && self.view.get(&anchor.second) == Some(&true) {
                        let samples = (n - start) as usize..(whole.min(end) - start) as usize;
                        self.run(scene, (part, path), anchor, whole, samples, &mut scratch.bank);
                    }
                    n = whole;
                }
            }
        }
    }

    /// Gathers one run of every sequence: from the anchor to `end`, as far as `samples` reach.
    fn run(
        &self,
        scene: &Scene,
        (part, path): (&Part, &Path),
        anchor: Anchor,
        end: u64,
        samples: Range<usize>,
        bank: &mut Bank,
    ) {
        let length = (end - anchor.n) as f64;
        let (u, v) = (part.fraction(anchor.n), part.fraction(end));
        let [first, last] = self.fast.ends(anchor.n, end);
        let cn0_hz = path.cn0_hz.at(0.5 * (u + v));
        let rho_cycles = path.carrier.at(u) + first.carrier_cycles;
        let rho_cycles = planted!("generator.synth.carrier_phase", rho_cycles, rho_cycles + 0.1);
        let gained_cycles = path.carrier.change(u, v) + (last.carrier_cycles - first.carrier_cycles);
        let tone = (anchor.tone, self.tone_step);
        let carrier = carrier(scene.metadata.inverted, tone, rho_cycles, gained_cycles / length);
        let real = if scene.metadata.format.is_complex() { 1.0 } else { std::f64::consts::SQRT_2 };
        let rate_hz = scene.clock.rate.hz();
        let gain = 0.5 * (first.gain + last.gain);
        let epoch = self.from.ahead(anchor.epoch);
        let real = planted!("generator.synth.amplitude", real, 1.06 * real);
        let amplitude = real * gain * (2.0 * cn0_hz.max(0.0) / rate_hz).sqrt() * f64::from(scene.noise_lsb);
        for sent in &self.sent {
            let sent_s = length / rate_hz - path.delay.change(u, v) - (last.delay_s - first.delay_s);
            let sent_s = planted!("generator.synth.code_rate", sent_s, sent_s * (1.0 + 2e-5));
            let step = (sent_s * sent.spreading.pace().step_rate_hz() / length * CODE_ONE as f64) as u64;
            let delay_s = path.delay.at(u) + first.delay_s;
            let delay_s = planted!("generator.synth.delay", delay_s, delay_s * (1.0 + 2e-7));
            let delay_s =
                planted!("generator.synth.code_phase", delay_s, delay_s + 2e-9 * f64::from(self.sv.number % 3));
            let at = sent.spreading.at(epoch, delay_s);
            // Periods of a strip follow each other, and most share a symbol.
            let (mut negative, mut until) = (false, i64::MIN);
            let negative = |period| {
                if period >= until {
                    (negative, until) = self.symbols.negative(sent.data, period);
                }
                negative
            };
            bank.push((anchor.n, end), sent.part, samples.clone(), sent.pulse.as_ref(), |bits| Run {
                bits: &[],
                position: sent.spreading.strip(at, step, samples.len(), negative, bits),
                step,
                turns: carrier.0.wrapping_add(sent.turns),
                turns_step: carrier.1,
                amplitude: amplitude * sent.gain,
                pulse: None,
            });
        }
    }
}

/// Carrier phase at the start of a run and its step, in 2^-64 turn: `if_hz · n / rate − s · rho_phi / lambda`
/// with s = −1 in an inverted spectrum. `tone` is the first term, and its step.
fn carrier(inverted: bool, tone: (u64, u64), rho_cycles: f64, step_cycles: f64) -> (u64, u64) {
    let (at, step) = (turns(rho_cycles), turns(step_cycles));
    if planted!("generator.synth.doppler_sign", inverted, !inverted) {
        (tone.0.wrapping_add(at), tone.1.wrapping_add(step))
    } else {
        (tone.0.wrapping_sub(at), tone.1.wrapping_sub(step))
    }
}

/// Cycles modulo one, in 2^-64 turn.
fn turns(cycles: f64) -> u64 {
    ((cycles - cycles.floor()) * 18_446_744_073_709_551_616.0) as u64
}

const _: () = assert!(RUN_SAMPLES == crate::synth::noise::BLOCK_SAMPLES);
