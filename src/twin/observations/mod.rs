//! Observations in place of samples and loops: the receiver's navigation part on measurements by theory.
//!
//! A channel's code and carrier are those of the satellite's rays at a tick, with errors of the loops'
//! noise in the noise density that the replica meets (`law`), lag behind the oscillator (`oscillator`) and
//! rest where reflections put them (`rays`). Searches (`search`), lock, slips and losses (`channel`) are
//! drawn from C/N0. Symbols are those that satellites send, in noise, and the receiver's own decoders read
//! them (`listening` says when). Limits: front ends without stages ([`refuse`]); loops are linear and in
//! step with the motion; short codes of other satellites are noise.

mod channel;
mod clock;
mod law;
mod listening;
mod oscillator;
mod rays;
mod refusal;
mod search;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use generator::random::Stream;
use generator::scene::Scene;
use generator::stream::{Fronts, GenerateError, Options};
use generator::transmit::Transmitter;
use generator::truth;
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::Link;
use rayon::prelude::*;
use receiver::acquire::samples_needed;
use receiver::output;
use receiver::settings::Settings;
use receiver::{Given, Navigator, ReceiveError};

use channel::{Around, Channel, World};
use clock::Instant;
use law::Law;
use oscillator::OscillatorLoop;
pub use refusal::refuse;

use crate::correlations::Plan;
use crate::{Done, TwinError, settings_for};

/// Length of what is prepared at a time.
const SLAB_S: u64 = 1;
/// Time before a slab about which channels still ask.
const BEFORE_S: f64 = 1.5;

/// Receives a scene by its observations: no sample is made. `progress` gets the number of samples that have
/// been passed.
///
/// # Errors
/// [`Refused`](crate::Refused), and the errors of [`crate::run`].
pub fn run(
    scenes: &[Scene],
    settings: &Settings,
    (truth, records): (&mut (dyn truth::Sink + Send), &mut (dyn output::Sink + Send)),
    progress: &mut dyn FnMut(u64),
) -> Result<Done, TwinError> {
    refuse(scenes)?;
    let Some(first) = scenes.first() else { return Err(GenerateError::NoFrontEnd.into()) };
    let settings = settings_for(scenes, settings);
    let metadata: Vec<IfMetadata> = scenes.iter().map(|scene| scene.metadata.clone()).collect();
    let mut navigator = Navigator::new(&metadata, &settings)?;
    let mut fronts = Fronts::new(scenes, truth, &Options::default())?;
    let plans: Vec<Plan<'_>> = scenes.iter().map(|scene| Plan::new(scene, &settings)).collect();
    let mut model = Model::new((scenes, &plans), &navigator, &fronts)?;
    let rate = first.clock.rate;
    let before = (BEFORE_S * rate.hz()) as u64;
    let (mut slab, mut to) = (0, 0);
    // What was made of the last slab is navigated while the next one is made.
    let mut waiting: Vec<(Instant, Vec<Given>)> = Vec::new();
    while to < first.samples || !waiting.is_empty() {
        let from = to;
        slab += SLAB_S;
        to = rate.first_sample_at(slab, 1).min(first.samples);
        let known = Known { has_fix: navigator.has_fix() };
        let (made, navigated) = rayon::join(
            || -> Result<Vec<(Instant, Vec<Given>)>, TwinError> {
                if from >= first.samples {
                    return Ok(Vec::new());
                }
                let needed: Vec<u64> = scenes.iter().map(|scene| needed(scene, first, from, before)).collect();
                let heard = Instant::new(scenes, 0, from).map(|from| model.heard(&from)).unwrap_or_default();
                fronts.pass(&needed, to, &|link| heard.contains(&link), truth)?;
                Ok(model.make(&fronts, to, &known))
            },
            || -> Result<Vec<(f64, Link)>, ReceiveError> {
                let mut gone = Vec::new();
                for (tick, given) in &mut waiting {
                    let dropped = navigator.take(given, records)?;
                    gone.extend(dropped.into_iter().map(|link| (tick.seconds, link)));
                }
                Ok(gone)
            },
        );
        waiting = made?;
        for (seconds, link) in navigated? {
            model.give_up(link, seconds);
        }
        progress(to);
    }
    let mut generated = fronts.finish(truth)?;
    generated.iter_mut().for_each(|one| one.samples = 0);
    Ok(Done { generated, outcome: navigator.finish(first.samples, records)? })
}

/// First sample of a front end about which channels ask in a slab that begins at sample `from` of the first.
fn needed(scene: &Scene, first: &Scene, from: u64, before: u64) -> u64 {
    let (count, seconds) = first.clock.rate.ratio();
    scene.clock.rate.first_sample_at(from.saturating_sub(before) * seconds, count)
}

/// Facts that the receiver's navigation knew before a slab.
struct Known {
    has_fix: bool,
}

/// Channels of a receiver by theory.
struct Model<'a> {
    scenes: &'a [Scene],
    plans: &'a [Plan<'a>],
    settings: Settings,
    laws: Vec<Law>,
    /// Loops on the oscillator, and that of each law.
    oscillators: Vec<OscillatorLoop>,
    oscillator_of: Vec<Option<usize>>,
    channels: Vec<Channel>,
    /// Time of the first search of each front end.
    first_search_s: Vec<f64>,
    interval_ms: u64,
    number: u64,
}

impl<'a> Model<'a> {
    fn new(
        (scenes, plans): (&'a [Scene], &'a [Plan<'a>]),
        navigator: &Navigator,
        fronts: &Fronts<'_>,
    ) -> Result<Self, ReceiveError> {
        let settings = navigator.settings().clone();
        let operation = &settings.operation;
        let step_ms = u64::from(operation.tracking_interval_ms).max(1);
        let interval_ms = u64::from(operation.measurement_interval_ms) / step_ms * step_ms;
        let tick_s = 1e-3 * interval_ms as f64;
        let (mut laws, mut channels, mut first_search_s) = (Vec::new(), Vec::new(), Vec::new());
        let (mut oscillators, mut oscillator_of): (Vec<OscillatorLoop>, Vec<_>) = (Vec::new(), Vec::new());
        for (front, ((scene, transmitters), signals)) in
            scenes.iter().zip(fronts.transmitters()).zip(navigator.assigned()).enumerate()
        {
            let mut own = settings.acquisition.clone();
            own.signals = signals.iter().map(|signal| signal.name.to_owned()).collect();
            let needed = samples_needed(&scene.metadata, &own)?;
            let search_s = scene.clock.rate.elapsed_s(needed);
            first_search_s.push(search_s);
            let Some(plan) = plans.get(front) else { continue };
            for signal in signals {
                let number = laws.len();
                let Some(law) = Law::new((scene, plan, front), signal, &settings, tick_s) else { continue };
                let (gains, update_s) = (law.gains, law.code.integration_s);
                let known = oscillators.iter().position(|one| one.is_of(scene, &gains, update_s));
                oscillator_of.push(known.or_else(|| {
                    oscillators.push(OscillatorLoop::new(scene, gains, update_s)?);
                    Some(oscillators.len() - 1)
                }));
                laws.push(law);
                let stream = Stream::new(scene.noise_seed(), "observations");
                let of_it = transmitters.iter().enumerate().filter(|(_, one)| one.signal == *signal);
                channels.extend(of_it.map(|(place, one)| Channel::new(one.link(), (number, place), stream, search_s)));
            }
        }
        channels.sort_by_key(|channel| channel.link);
        let number = 0;
        Ok(Self {
            scenes,
            plans,
            settings,
            laws,
            oscillators,
            oscillator_of,
            channels,
            first_search_s,
            interval_ms,
            number,
        })
    }

    /// Leaves a link alone whose message leads nowhere.
    fn give_up(&mut self, link: Link, now_s: f64) {
        let channel = self.channels.iter_mut().find(|channel| channel.link == link);
        channel.into_iter().for_each(|channel| channel.give_up(now_s));
    }

    /// Links whose messages may be asked for in what begins at an instant.
    fn heard(&mut self, from: &Instant) -> BTreeSet<Link> {
        let Self { scenes, laws, channels, .. } = self;
        let is_heard = |channel: &mut &mut Channel| {
            let scene = laws.get(channel.law).and_then(|law| scenes.get(law.front));
            scene.is_some_and(|scene| channel.hears(scene, from))
        };
        channels.iter_mut().filter_map(|mut channel| is_heard(&mut channel).then_some(channel.link)).collect()
    }

    /// Ticks before a sample of the first front end, from the last one on.
    fn ticks(&mut self, to: u64) -> Vec<Instant> {
        let mut ticks = Vec::new();
        let Some(rate) = self.scenes.first().map(|scene| scene.clock.rate) else { return ticks };
        loop {
            let sample = rate.first_sample_at(self.number * self.interval_ms, 1000);
            if sample >= to {
                return ticks;
            }
            ticks.extend(Instant::new(self.scenes, self.number, sample));
            self.number += 1;
        }
    }

    /// Reports of all channels at the ticks before a sample, which have been prepared.
    fn make(&mut self, fronts: &Fronts<'_>, to: u64, known: &Known) -> Vec<(Instant, Vec<Given>)> {
        let ticks = self.ticks(to);
        let transmitters: Vec<&[Transmitter]> = fronts.transmitters().collect();
        if let Some(first) = ticks.first() {
            self.load(&transmitters, first);
        }
        if let Some(last) = ticks.last() {
            self.oscillators.iter_mut().for_each(|one| one.run(last.seconds, SLAB_S as f64 + BEFORE_S));
        }
        let followed: BTreeSet<(Sv, &str)> = self
            .channels
            .iter()
            .filter(|one| one.is_followed())
            .map(|one| (one.link.sv, one.link.signal.name))
            .collect();
        let Self { scenes, settings, laws, oscillators, oscillator_of, channels, first_search_s, .. } = self;
        let rate_hz = scenes.first().map_or(1.0, |scene| scene.clock.rate.hz());
        let one = |channel: &mut Channel| -> Option<Vec<Given>> {
            let link = channel.link;
            let law = laws.get(channel.law)?;
            let transmitter = transmitters.get(law.front)?.get(channel.transmitter)?;
            let is_led = followed.iter().any(|(sv, name)| *sv == link.sv && *name != link.signal.name);
            let around = Around { has_fix: known.has_fix, is_led };
            let first_search_s = first_search_s.get(law.front).copied().unwrap_or(0.0);
            let scene = scenes.get(law.front)?;
            let oscillator = oscillator_of.get(channel.law).copied().flatten().and_then(|place| oscillators.get(place));
            let world = World { scene, settings, law, transmitter, oscillator, first_search_s, rate_hz };
            let follow = |tick: &Instant| {
                let at = |seconds: f64| {
                    let sample = tick.sample_at(seconds);
                    Instant::new(scenes, tick.number, sample).unwrap_or_else(|| tick.clone())
                };
                channel.follow(&world, around, tick, &at)
            };
            Some(ticks.iter().map(follow).collect())
        };
        let of_links: Vec<Vec<Given>> = channels.par_iter_mut().filter_map(one).collect();
        let mut made: Vec<(Instant, Vec<Given>)> = ticks.into_iter().map(|tick| (tick, Vec::new())).collect();
        for of_link in of_links {
            for ((_, given), one) in made.iter_mut().zip(of_link) {
                if one.found.is_some() || !(one.report.events.is_empty() && one.report.measurements.is_empty()) {
                    given.push(one);
                }
            }
        }
        made
    }

    /// Lets every channel know the noise density that its replica meets.
    fn load(&mut self, transmitters: &[&[Transmitter]], at: &Instant) {
        // What is sent, by front end, with the sum of each kind.
        let mut sent: Vec<Vec<(Link, f64)>> = Vec::new();
        for (front, (scene, transmitters)) in self.scenes.iter().zip(transmitters).enumerate() {
            let own = at.own(front).map_or(0, |(own, _)| own);
            let cn0 = |one: &Transmitter| Some((one.link(), one.rays(scene, own)?.cn0_hz(own)));
            let mut sums: Vec<(Link, f64)> = Vec::new();
            for (link, hz) in transmitters.iter().filter_map(cn0) {
                let is_same = |(other, _): &&mut (Link, f64)| {
                    other.signal == link.signal && other.carrier_hz() == link.carrier_hz()
                };
                match sums.iter_mut().find(is_same) {
                    Some((_, sum)) => *sum += hz,
                    None => sums.push((link, hz)),
                }
            }
            sent.push(sums);
        }
        for channel in &mut self.channels {
            let link = channel.link;
            let Some(law) = self.laws.get(channel.law) else { continue };
            let (Some(plan), Some(sums)) = (self.plans.get(law.front), sent.get(law.front)) else { continue };
            let own = transmitters.get(law.front).and_then(|all| all.get(channel.transmitter));
            let (Some(own), Some(scene)) = (own, self.scenes.get(law.front)) else { continue };
            let sample = at.own(law.front).map_or(0, |(own, _)| own);
            let own_hz = own.rays(scene, sample).map_or(0.0, |rays| rays.cn0_hz(sample));
            let others: Vec<(Link, f64)> = (sums.iter())
                .map(|(other, hz)| {
                    let is_own = other.signal == link.signal && other.carrier_hz() == link.carrier_hz();
                    (*other, if is_own { (hz - own_hz).max(0.0) } else { *hz })
                })
                .collect();
            channel.density = plan.density(law.made, link, &others);
        }
    }
}
