//! Correlations in place of samples: a model of the sums that a correlator gives.
//!
//! Over an interval, each ray of a satellite contributes its amplitude times the mean of R(τ − δ)·e^{j2πφ}:
//! R the correlation of what is sent with the replica, τ the difference of the codes, δ the tap, φ the
//! difference of the carriers. τ is linear over the interval, φ a parabola; the mean is taken by Gauss and
//! Legendre's nodes, of each piece between the edges of the ray's own symbols. Noise has the variance of the
//! thermal noise, of rounding, and of the other signals by their spectra (source: Kaplan and Hegarty,
//! Understanding GPS 2nd ed., 5.3 and 6.2). Components of one satellite's signal correlate as their codes do.
//! Short codes of other satellites are found as they correlate, long ones are white noise. Limits: front ends
//! without stages ([`refuse`]); samples count as infinitely many.

mod crowd;
mod made;
mod noise;
mod ray;
mod refusal;
mod search;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use generator::random::Stream;
use generator::scene::Scene;
use generator::stream::{Fronts, GenerateError, Options};
use generator::transmit::Transmitter;
use generator::truth;
use gnss::samples::{Format, IfMetadata};
use gnss::signal::{Link, Signal};
use num_complex::Complex64;
use receiver::Reception;
use receiver::correlate::correlator::{Cell, Code, Interval, Model, Sought};
use receiver::correlate::units_to_chips;
use receiver::lead::lead;
use receiver::output;
use receiver::settings::Settings;

use crowd::{Course, Crowd, LEAST_LONG_CHIPS};
use made::Made;
use noise::Noise;
use ray::Question;
pub use refusal::{Refused, refuse};

use crate::{Done, TwinError, settings_for};

/// Variance of the rounding to whole numbers.
const ROUNDING: f64 = 1.0 / 12.0;
/// Difference of powers beyond which a cross-correlation of short codes, 24 dB down at most for C/A, is no
/// longer noise.
const NEAR_FAR_DB: f64 = 15.0;
/// Intervals of the integral over a product of spectra.
const INTERVALS: u32 = 400;

/// Receives a scene by its correlations: no sample is made. `progress` gets the number of samples that have
/// been passed.
///
/// # Errors
/// [`Refused`], and the errors of [`crate::run`].
pub fn run(
    scenes: &[Scene],
    settings: &Settings,
    (truth, records): (&mut dyn truth::Sink, &mut dyn output::Sink),
    progress: &mut dyn FnMut(u64),
) -> Result<Done, TwinError> {
    refuse(scenes)?;
    let Some(first) = scenes.first() else { return Err(GenerateError::NoFrontEnd.into()) };
    let settings = settings_for(scenes, settings);
    let metadata: Vec<IfMetadata> = scenes.iter().map(|scene| scene.metadata.clone()).collect();
    let mut reception = Reception::of_several(&metadata, &settings)?;
    let mut fronts = Fronts::new(scenes, truth, &Options::default())?;
    let plans: Vec<Plan> = scenes.iter().map(|scene| Plan::new(scene, &settings)).collect();
    let (mut second, mut to) = (0, 0);
    while to < first.samples {
        to = first.clock.rate.first_sample_at(second + 1, 1).min(first.samples);
        fronts.pass(&reception.needs(), to, truth)?;
        let over = |(plan, transmitters)| Plan::over(plan, transmitters, second);
        let models: Vec<Correlations> = plans.iter().zip(fronts.transmitters()).map(over).collect();
        models.iter().try_for_each(Correlations::refuse_near_and_far)?;
        reception.take_models(&models, (to, to == first.samples), records)?;
        progress(to);
        second += 1;
    }
    Ok(Done { generated: fronts.finish(truth)?, outcome: reception.finish(records)? })
}

/// Everything that does not depend on time.
pub struct Plan<'a> {
    scene: &'a Scene,
    made: Vec<Made>,
    /// Spectral separations of each of [`Self::made`] in seconds, by the number of a signal of the scene and
    /// its carrier's distance in hertz.
    separations_s: Vec<BTreeMap<(usize, i64), f64>>,
    noise: Stream,
}

impl<'a> Plan<'a> {
    /// A plan for a scene that [`refuse`] has let pass, and a receiver with these settings.
    pub fn new(scene: &'a Scene, settings: &Settings) -> Self {
        let made = Made::all(scene, settings);
        let half_hz = 0.5 * scene.clock.rate.hz();
        let carriers = |signal: &'static Signal| signal.satellites().map(|sv| signal.carrier_hz(sv));
        let from_all = |made: &Made| {
            let mut all = BTreeMap::new();
            for (number, signal) in scene.signals.iter().enumerate() {
                for (own_hz, other_hz) in
                    carriers(made.signal).flat_map(|own| carriers(signal).map(move |hz| (own, hz)))
                {
                    let apart_hz = other_hz - own_hz;
                    let entry = all.entry((number, apart_hz.round() as i64));
                    entry.or_insert_with(|| separation_s(made, signal, (apart_hz, half_hz)));
                }
            }
            all
        };
        let separations_s = made.iter().map(from_all).collect();
        Self { scene, made, separations_s, noise: Stream::new(scene.noise_seed(), "correlations") }
    }

    /// Model over the segment for which signals are prepared; powers are those at the beginning of a
    /// `second`.
    pub fn over(&'a self, transmitters: &'a [Transmitter], second: u64) -> Correlations<'a> {
        let sample = self.scene.clock.rate.first_sample_at(second, 1);
        let cn0_hz = |one: &Transmitter| one.rays(self.scene, sample).map_or(0.0, |rays| rays.cn0_hz(sample));
        let cn0_hz: Vec<f64> = transmitters.iter().map(cn0_hz).collect();
        let rounding = if self.scene.metadata.format == Format::Cf32Le { 0.0 } else { ROUNDING };
        let floor = if self.scene.noise { self.thermal() + rounding } else { 0.0 };
        let power = 2.0 * floor + 2.0 * self.thermal() * cn0_hz.iter().sum::<f64>() / self.scene.clock.rate.hz();
        let span = (sample, self.scene.clock.rate.first_sample_at(second + 1, 1).min(self.scene.samples));
        let crowds = transmitters.iter().map(|_| OnceLock::new()).collect();
        let courses = OnceLock::new();
        let places = |link: Link| {
            let is = |(place, one): (usize, &Transmitter)| is_of(one, link).then_some(place);
            transmitters.iter().enumerate().filter_map(is).collect()
        };
        let alike = transmitters.iter().map(|one| places(one.link())).collect();
        let variances = Vec::new();
        let mut model =
            Correlations { plan: self, transmitters, span, cn0_hz, power, floor, variances, alike, crowds, courses };
        let variance = |one: &Transmitter, number: usize, made: &Made| {
            if made.signal == one.signal { model.variance(number, one.link()) } else { [0.0; 2] }
        };
        let all = |one| self.made.iter().enumerate().map(|(number, made)| variance(one, number, made)).collect();
        model.variances = transmitters.iter().map(all).collect();
        model
    }

    /// Variance of the thermal noise of a sample, per component.
    fn thermal(&self) -> f64 {
        f64::from(self.scene.noise_lsb) * f64::from(self.scene.noise_lsb)
    }

    /// Spectral separation of a replica for a link from another link's signal, in seconds.
    fn separation_s(&self, made: usize, own: Link, other: Link) -> f64 {
        let place = self.scene.signals.iter().position(|one| *one == other.signal);
        let apart_hz = (other.carrier_hz() - own.carrier_hz()).round() as i64;
        let found = place.zip(self.separations_s.get(made)).and_then(|(place, all)| all.get(&(place, apart_hz)));
        found.copied().unwrap_or(0.0)
    }
}

/// Spectral separation of a replica from a signal whose carrier is `apart_hz` higher, within ±`half_hz`.
fn separation_s(made: &Made, signal: &Signal, (apart_hz, half_hz): (f64, f64)) -> f64 {
    let own = made.component.shape();
    let step_hz = 2.0 * half_hz / f64::from(INTERVALS);
    let shapes: Vec<_> = signal.components.iter().map(|one| (one.power_share, one.shape())).collect();
    let product = |hz: f64| {
        let sent = shapes.iter().map(|(share, shape)| share * shape.density(hz - apart_hz));
        own.density(hz) * sent.sum::<f64>()
    };
    step_hz * (0..INTERVALS).map(|k| product((f64::from(k) + 0.5) * step_hz - half_hz)).sum::<f64>()
}

/// Model of the correlations over a segment of time.
pub struct Correlations<'a> {
    plan: &'a Plan<'a>,
    transmitters: &'a [Transmitter],
    /// First sample of the second, and the one after its last.
    span: (u64, u64),
    /// C/N0 of each of [`Self::transmitters`].
    cn0_hz: Vec<f64>,
    /// Mean power of the samples.
    power: f64,
    /// Variance of thermal noise and rounding in a sample, per component.
    floor: f64,
    /// Variances of the noise of a sample, per component, for each transmitter's own replicas: with all other
    /// satellites as noise, and without those of [`Self::crowds`].
    variances: Vec<Vec<[f64; 2]>>,
    /// Transmitters that a receiver cannot tell from each of [`Self::transmitters`], by their indices.
    alike: Vec<Vec<usize>>,
    /// Other satellites in the correlations of each transmitter's short code.
    crowds: Vec<OnceLock<Option<Crowd>>>,
    /// Courses of the transmitters with short codes.
    courses: OnceLock<Vec<Option<Arc<Course>>>>,
}

impl Correlations<'_> {
    /// Way in which a code is made, and variances of the noise in a sample that its correlations have, per
    /// component: with all other satellites as noise, and without those that are summed by themselves.
    fn made(&self, code: &Code) -> Option<(&Made, [f64; 2])> {
        let number = self.plan.made.iter().position(|made| made.is(code))?;
        let known = self.place(code.link).and_then(|place| self.variances.get(place)?.get(number).copied());
        Some((self.plan.made.get(number)?, known.unwrap_or_else(|| self.variance(number, code.link))))
    }

    /// Index of a link among the transmitters, or of one that a receiver cannot tell from it.
    fn place(&self, link: Link) -> Option<usize> {
        let own = self.transmitters.iter().position(|one| one.sv == link.sv && one.signal == link.signal);
        own.or_else(|| self.transmitters.iter().position(|one| is_of(one, link)))
    }

    /// Variances of the noise of a sample, per component, for a replica of a link: of all but what the link
    /// itself sends, and of these without short codes on its carrier.
    fn variance(&self, made: usize, link: Link) -> [f64; 2] {
        if self.floor <= 0.0 {
            return [0.0; 2];
        }
        let others = || self.transmitters.iter().zip(&self.cn0_hz).filter(|(one, _)| !is_of(one, link));
        let load = |one: &Transmitter, hz: &f64| hz * self.plan.separation_s(made, link, one.link());
        let all = others().map(|(one, hz)| load(one, hz)).sum::<f64>();
        let white = others().filter(|(one, _)| !crowd::is_alike(link, one.link())).map(|(one, hz)| load(one, hz));
        [all, white.sum::<f64>()].map(|load| self.floor + self.plan.thermal() * load)
    }

    /// Other satellites in the correlations of a link's short code.
    fn crowd(&self, link: Link) -> Option<&Crowd> {
        let place = self.place(link)?;
        let course = |one| Course::new(self.plan.scene, one, self.span).map(Arc::new);
        let courses = || self.courses.get_or_init(|| self.transmitters.iter().map(course).collect());
        let make = || Crowd::new(self.transmitters, place, courses());
        self.crowds.get(place)?.get_or_init(make).as_ref()
    }

    /// Refuses satellites whose short codes a receiver finds in each other's correlations.
    fn refuse_near_and_far(&self) -> Result<(), Refused> {
        let is_short = |signal: &'static Signal| lead(signal).is_some_and(|lead| lead.code_chips < LEAST_LONG_CHIPS);
        for signal in self.plan.scene.signals.iter().copied().filter(|one| is_short(one)) {
            let of = self.transmitters.iter().zip(&self.cn0_hz).filter(|(one, hz)| one.signal == signal && **hz > 0.0);
            let (least, most) = of.fold((f64::MAX, 0.0), |(least, most), (_, hz)| (hz.min(least), hz.max(most)));
            let apart_db = 10.0 * libm::log10(most / least);
            if most > 0.0 && apart_db > NEAR_FAR_DB {
                let effect = format!("{signal} of satellites whose powers are {apart_db:.1} dB apart");
                return Err(Refused { effect });
            }
        }
        Ok(())
    }

    /// Signals that a receiver cannot tell from a link.
    fn alike(&self, link: Link) -> impl Iterator<Item = &Transmitter> {
        let places = self.place(link).and_then(|place| self.alike.get(place));
        places.into_iter().flatten().filter_map(|place| self.transmitters.get(*place))
    }

    /// Adds the expected sums at taps in chips.
    fn expect(&self, question: &Question, taps: &[f64], sums: &mut [Complex64]) {
        for transmitter in self.alike(question.code.link) {
            question.add(self.plan.scene, transmitter, taps, sums);
        }
    }

    fn stream(&self, code: &Code, made: &Made) -> Stream {
        let stream = self.plan.noise.satellite(code.link.sv).named(made.signal.name).part(made.index as u64);
        code.segment.map_or(stream, |segment| stream.part(segment))
    }
}

/// True if a receiver cannot tell what is sent from a link.
fn is_of(transmitter: &Transmitter, link: Link) -> bool {
    // Only carriers by channels are shared.
    let may_be = transmitter.sv == link.sv || link.channel().is_some();
    may_be && transmitter.signal == link.signal && transmitter.link().is_alike(link)
}

impl Model for Correlations<'_> {
    fn sums(&self, interval: &Interval, code: &Code, taps: &[i64], sums: &mut [Complex64]) {
        let Some((made, [all, white])) = self.made(code) else { return };
        let mut chips = [0.0; 8];
        chips.iter_mut().zip(taps).for_each(|(chips, units)| *chips = units_to_chips(*units));
        let taps = &chips[..taps.len().min(8)];
        let question = Question { interval: *interval, code, made };
        self.expect(&question, taps, sums);
        if let Some(crowd) = self.crowd(code.link) {
            crowd.add(interval, made, taps, sums);
        }
        if white <= 0.0 {
            return;
        }
        let whole = interval.end.saturating_sub(interval.from) as f64;
        let share = interval.to.saturating_sub(interval.from) as f64 / whole;
        let stream = self.stream(code, made).part(interval.from).part(interval.end);
        let scales = [white, all].map(|variance| (variance * whole * made.share * made.own.value(0.0)).sqrt());
        Noise { stream, own: &made.own }.add(taps, share, scales, sums);
    }

    fn power(&self, _: u64, _: u64) -> f64 {
        self.power
    }

    fn search(&self, sought: &Sought) -> Cell {
        search::search(self, sought)
    }
}
