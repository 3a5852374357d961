//! The three loops of a receiver as theory sees them: linear, with the exact bandwidth that the settings ask
//! for.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::closed::{Follower, Response, exact_loop, rates_after_step};
use crate::expect::followed::{Entry, Followed};
use crate::expect::peak::{Code, Peak, raw_chips};
use crate::expect::spectrum::edge_cost_db;
use crate::expect::theory::clock::PowerLaw;
use crate::expect::theory::linear::PhaseLoop;
use crate::expect::theory::{dll, fll, oscillator, pll};
use crate::expect::timeline::Timeline;
use crate::read::Run;
use crate::statistics::Sum;
use crate::waveform::{Edge, Waveform, leading};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::{Component, Link, Signal, sinc_squared};

/// Loop of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Loop {
    /// Code loop.
    Dll,
    /// Phase loop of the carrier.
    Pll,
    /// Frequency loop of the carrier.
    Fll,
}

/// Receiver's settings that the theory needs; the defaults are the receiver's where its file does not name
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Integrators of the phase loop, 1 to 3.
    pub pll_order: u32,
    /// One-sided noise bandwidth of the phase loop, Hz.
    pub pll_bandwidth_hz: f64,
    /// Integrators of the code loop, 1 or 2.
    pub dll_order: u32,
    /// One-sided noise bandwidth of the code loop, Hz.
    pub dll_bandwidth_hz: f64,
    /// Discriminator of the code loop.
    pub dll_discriminator: dll::Discriminator,
    /// Distance of early and late, chips.
    pub spacing_chips: f64,
    /// True if the replica's samples are means over their intervals.
    pub averaged_replica: bool,
}

impl Settings {
    /// Settings that `receiver.json` states; `None` where it names no bandwidths, or a discriminator that has
    /// no theory here.
    pub fn of(run: &Run) -> Option<Self> {
        let number = |key| run.tracking_setting(key);
        let settings = run.receiver.get("settings").unwrap_or(&run.receiver);
        let word = |key| settings.get("tracking").and_then(|tracking| tracking.get(key)?.as_str());
        Some(Self {
            pll_order: number("pll_order")? as u32,
            pll_bandwidth_hz: number("pll_bandwidth_hz")?,
            dll_order: number("dll_order")? as u32,
            dll_bandwidth_hz: number("dll_bandwidth_hz")?,
            dll_discriminator: dll::Discriminator::named(word("dll_discriminator").unwrap_or("early_minus_late"))?,
            spacing_chips: number("spacing_chips")?,
            averaged_replica: word("replica") == Some("area"),
        })
    }

    /// Settings as the receiver fits them to a signal.
    pub(crate) fn fitted(self, followed: &Followed) -> Self {
        Self {
            spacing_chips: followed.spacing_chips.unwrap_or(self.spacing_chips),
            pll_bandwidth_hz: followed.pll_bandwidth_hz.unwrap_or(self.pll_bandwidth_hz),
            dll_bandwidth_hz: followed.dll_bandwidth_hz.unwrap_or(self.dll_bandwidth_hz),
            ..self
        }
    }
}

/// Time of an update of a satellite's loops in the tracking stage: as the receiver says it, or by its
/// settings, which count it in code periods.
pub fn update_s(run: &Run, link: Link) -> Option<f64> {
    let stated = || Some(Entry::of(&run.receiver, link.signal)?.update_s(link));
    let counted = || Some(run.tracking_setting("integration")? * leading(link.signal)?.period_s());
    stated().or_else(counted).or(run.update_s)
}

/// A receiver's phase loop as far as it decides what can be held: noise, with no motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carrier {
    bandwidth_hz: f64,
    update_s: f64,
    /// Power that is followed, over the signal's.
    share: f64,
    /// Standard deviation of the phase that the scene's oscillator causes, radians.
    oscillator_rad: f64,
}

impl Carrier {
    /// Carrier of a signal as the receiver states it, or else by its settings.
    pub fn of(
        signal: &Signal,
        entry: Option<&Entry>,
        oscillator: Option<PowerLaw>,
        number: impl Fn(&str, f64) -> f64,
    ) -> Self {
        let counted_s = || number("integration", 4.0) * leading(signal).map_or(1e-3, Component::period_s);
        let update_s = entry.map_or_else(counted_s, |entry| entry.integration_s);
        let bandwidth_hz = entry.map_or_else(|| number("pll_bandwidth_hz", 18.0), |entry| entry.pll_bandwidth_hz);
        let closed = exact_loop(number("pll_order", 3.0) as u32, bandwidth_hz * update_s);
        let oscillator_rad = closed.zip(oscillator).map_or(0.0, |(closed, law)| {
            oscillator::jitter_discrete_rad(&law, signal.centre_hz(), &closed.linear(), update_s)
        });
        let share = entry.map_or(1.0, |entry| entry.share(signal));
        Self { bandwidth_hz, update_s, share, oscillator_rad }
    }

    /// Carrier of a signal in a run, with its oscillator.
    pub fn in_run(run: &Run, signal: &Signal) -> Self {
        let oscillator = run.scene.oscillator.map(|noise| PowerLaw { h: noise.h });
        let number = |key: &str, default| run.tracking_setting(key).unwrap_or(default);
        Self::of(signal, Entry::of(&run.receiver, signal).as_ref(), oscillator, number)
    }

    /// Standard deviation of the phase at the whole signal's C/N0.
    pub fn jitter_rad(&self, cn0_hz: f64) -> f64 {
        libm::hypot(pll::jitter_rad(self.bandwidth_hz, self.update_s, cn0_hz * self.share), self.oscillator_rad)
    }

    /// Standard deviation that the oscillator alone leaves.
    pub fn oscillator_rad(&self) -> f64 {
        self.oscillator_rad
    }

    /// The whole signal's C/N0 at which the phase has that standard deviation; infinite where the oscillator
    /// alone makes as much.
    pub fn least_dbhz(&self, jitter_rad: f64) -> f64 {
        let thermal2 = jitter_rad * jitter_rad - self.oscillator_rad * self.oscillator_rad;
        if thermal2 <= 0.0 {
            return f64::INFINITY;
        }
        pll::cn0_dbhz(thermal2.sqrt(), self.bandwidth_hz, self.update_s) - 10.0 * libm::log10(self.share)
    }
}

/// Frequency in hertz up to which the truth's drift follows the oscillator. A spline over 0.8 s has 80 % of
/// that rate's variance left.
const NODES_HZ: f64 = 0.5;

/// Positions of a satellite's observations in the loops' intervals, counted in intervals from the middle.
///
/// An interval is a number of whole code periods. A position is therefore constant while the range is. In 10
/// ms not every position occurs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Places {
    count: usize,
    sum: f64,
    squares: f64,
}

impl Places {
    /// Adds one by when, after a whole second, it was sent.
    pub fn add(&mut self, sent_fraction_s: f64, update_s: f64) {
        let intervals = sent_fraction_s / update_s;
        let place = intervals - intervals.floor() - 0.5;
        self.count += 1;
        self.sum += place;
        self.squares += place * place;
    }

    /// Mean and mean square; of none those of any position.
    fn means(&self) -> [f64; 2] {
        match self.count {
            0 => [0.0, 1.0 / 12.0],
            count => [self.sum, self.squares].map(|sum| sum / count as f64),
        }
    }
}

/// The three loops of a receiver as theory sees them at one integration time.
pub(crate) struct Theory {
    pub settings: Settings,
    pub update_s: f64,
    pub chip_m: f64,
    carrier_hz: f64,
    /// Power that the replica finds, over the signal's.
    share: f64,
    pll: (PhaseLoop, Response),
    dll: (PhaseLoop, Response),
    /// Gain of the code discriminator, which is one for the waveform it is made for.
    dll_gain: f64,
    /// Correlation peaks of the signal with the replica, and of the noise.
    peaks: (Peak, Peak),
    /// Correlation of the code without any average.
    pub code: Code,
    /// Component that is tracked.
    pub component: &'static Component,
    /// Mean square that another satellite's code may add before the loop, chips²
    /// ([`Beats`](super::beats::Beats)).
    pub beat_chips2: f64,
    oscillator: Option<PowerLaw>,
}

impl Theory {
    /// `None` where a loop of these settings, as the receiver fits them to the signal, cannot follow it: no
    /// such loop is stable, or early and late lie beyond the correlation's main peak.
    pub fn new(run: &Run, settings: Settings, link: &Link, update_s: f64) -> Option<Self> {
        let followed = Followed::of(run, link.signal)?;
        let settings = settings.fitted(&followed);
        let chip_rate_hz = followed.found.chip_rate_hz();
        let code = Code::found(&followed);
        let outermost = if settings.dll_discriminator == dll::Discriminator::DoubleDelta { 1.0 } else { 0.5 };
        if outermost * settings.spacing_chips >= code.reach_chips {
            return None;
        }
        let pll = exact_loop(settings.pll_order, settings.pll_bandwidth_hz * update_s)?;
        let made_for = exact_loop(settings.dll_order, settings.dll_bandwidth_hz * update_s)?;
        let width_chips = chip_rate_hz / run.rate_hz(link.signal);
        let of_replica = u32::from(settings.averaged_replica);
        let of_signal = u32::from(run.scene.code_edge == Edge::Area);
        // What the sampler's means leave of a sub-carrier, whose tone in the replica has none.
        let side_hz = followed.sides.map_or(0.0, |tone| tone.side_hz(chip_rate_hz));
        let left = if of_signal > 0 { sinc_squared(side_hz / run.rate_hz(link.signal)).sqrt() } else { 1.0 };
        let peak = |waveform: &Waveform| {
            Peak::new(waveform, width_chips, of_replica + of_signal).between(followed.sides).times(left)
        };
        let (found, assumed) = (peak(&followed.found), peak(&followed.assumed));
        let own = Peak::new(&followed.own, width_chips, 2 * of_replica).between(followed.sides);
        let steepness = |peak: &Peak| peak.steepness(settings.dll_discriminator, settings.spacing_chips);
        let dll_gain = steepness(&found) / steepness(&assumed);
        let dll = PhaseLoop { gains: made_for.gains.map(|gain| dll_gain * gain), ..made_for };
        // Of the component's power at the antenna.
        let efficiency = found.value(0.0) * found.value(0.0) / own.value(0.0);
        let efficiency = if run.scene.code_edge == Edge::BandLimited {
            // What a filter leaves of layers is no average's.
            let (nominal, own) = (followed.assumed.correlation(0.0), followed.own.correlation(0.0));
            nominal * nominal / own * libm::pow(10.0, -0.1 * edge_cost_db(run, link.signal))
        } else {
            efficiency
        };
        Some(Self {
            settings,
            update_s,
            chip_m: SPEED_OF_LIGHT_MPS / chip_rate_hz,
            carrier_hz: link.carrier_hz(),
            share: followed.share * efficiency,
            pll: (pll, Response::of(&pll)),
            dll: (dll, Response::of(&dll)),
            dll_gain,
            peaks: (found, own),
            beat_chips2: code.stray_chips2(settings.dll_discriminator, settings.spacing_chips)
                / f64::from(followed.component.code_chips),
            code,
            component: followed.component,
            oscillator: run.scene.oscillator.map(|noise| PowerLaw { h: noise.h }),
        })
    }

    /// Standard deviation of the code that the loop gives, by thermal noise, metres.
    pub fn code_noise_m(&self, cn0_hz: f64) -> f64 {
        self.chip_m * self.noise(Loop::Dll, cn0_hz, &Places::default()).1
    }

    /// Energy of what the replica finds in an update over the noise density, at the whole signal's C/N0.
    pub fn snr(&self, cn0_hz: f64) -> f64 {
        self.update_s * cn0_hz * self.share
    }

    /// Raw and thermal sigma, in the loop's unit, at the whole signal's C/N0, of observations at some
    /// positions in the intervals.
    pub fn noise(&self, which: Loop, cn0_hz: f64, places: &Places) -> (f64, f64) {
        let (update_s, snr) = (self.update_s, self.snr(cn0_hz));
        let phase_rad = pll::raw_rad(update_s, cn0_hz * self.share);
        let (loop_, code) = (&self.pll.1, &self.dll.1);
        match which {
            Loop::Dll => {
                let raw = raw_chips(self.settings.dll_discriminator, &self.peaks, self.settings.spacing_chips, snr);
                (self.dll_gain * raw * code.put_out.sqrt(), raw * code.phase.sqrt())
            }
            // In an interval the phase runs at the loop's rate.
            Loop::Pll => {
                let [mean, square] = places.means();
                let variance = loop_.phase + 2.0 * mean * loop_.cross + square * loop_.rate;
                ((phase_rad * loop_.put_out.sqrt()).to_degrees(), (phase_rad * variance.max(0.0).sqrt()).to_degrees())
            }
            Loop::Fll => {
                let hertz = phase_rad / (TAU * update_s);
                (hertz * loop_.difference.sqrt(), hertz * loop_.rate.sqrt())
            }
        }
    }

    /// Sigma that the scene's oscillator leaves, in the loop's unit.
    pub fn oscillator(&self, which: Loop) -> f64 {
        match (which, &self.oscillator) {
            (Loop::Pll, Some(law)) => {
                oscillator::jitter_discrete_rad(law, self.carrier_hz, &self.pll.0.linear(), self.update_s).to_degrees()
            }
            _ => 0.0,
        }
    }

    /// Sigma in hertz of the phase loop's rate against the drift that the truth states, which follows nodes
    /// 0.8 s apart.
    ///
    /// White frequency noise adds h₀·T/2·f² cycles² to the phase in each interval, which the rate follows as
    /// it follows steps: that gives the bandwidth of the rate. Flicker and random walk, h₋₁/f + h₋₂/f², count
    /// between the nodes and there.
    pub fn oscillator_rate_hz(&self) -> f64 {
        let Some(law) = &self.oscillator else { return 0.0 };
        let [_, _, white, flicker, walk] = law.h;
        let bandwidth_hz = 0.5 * self.pll.1.rate_after_steps / self.update_s;
        let band = (bandwidth_hz / NODES_HZ).max(1.0);
        let variance = white * bandwidth_hz + flicker * libm::log(band) + walk * (1.0 - 1.0 / band) / NODES_HZ;
        variance.sqrt() * self.carrier_hz
    }

    /// Rates of the phase loop, from update to update, after a unit step of the phase, per second.
    pub fn rates_after_step_per_s(&self) -> Vec<f64> {
        rates_after_step(&self.pll.0).into_iter().map(|rate| rate / self.update_s).collect()
    }

    /// Density h₀ of the white frequency noise of the scene's oscillator, 1/Hz.
    pub fn white_frequency_noise(&self) -> f64 {
        self.oscillator.map_or(0.0, |law| law.h[2])
    }

    /// Threshold of jitter alone, and limit of 3σ and stress.
    pub fn limits(&self, which: Loop) -> (f64, f64) {
        let d = self.settings.spacing_chips;
        match which {
            Loop::Dll => {
                // Early or late beyond the main peak ends the discriminator's range before half the spacing
                // does.
                let range = (0.5 * d).min(self.code.reach_chips - 0.5 * d);
                (dll::threshold_chips(2.0 * range), range)
            }
            Loop::Pll => (pll::THRESHOLD_RAD.to_degrees(), pll::LIMIT_RAD.to_degrees()),
            Loop::Fll => (fll::threshold_hz(self.update_s), 0.25 / self.update_s),
        }
    }
}

/// Error of a loop without noise, in its unit.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stress {
    sum: Sum,
    pub max: f64,
}

impl Stress {
    fn add(&mut self, error: f64) {
        self.sum.add(error);
        self.max = self.max.max(error.abs());
    }

    /// Root mean square.
    pub fn rms(&self) -> f64 {
        self.sum.rms().unwrap_or(0.0)
    }
}

/// Stresses of a satellite's three loops over the times from `from_s` to `to_s`.
#[derive(Default)]
pub(crate) struct Stresses {
    of: BTreeMap<Loop, Stress>,
}

/// Longest segment that is followed interval by interval.
const MOST_UPDATES: usize = 4_000_000;

impl Stresses {
    pub fn new(theory: &Theory, timeline: &Timeline, link: &Link, (from_s, to_s): (f64, f64)) -> Self {
        let mut found = Self::default();
        let t_s = theory.update_s;
        let count = (((to_s - from_s) / t_s).max(0.0) as usize).min(MOST_UPDATES);
        let Some(origin) = timeline.state(link, from_s) else { return found };
        let begin = || (Follower::new(&theory.pll.0, t_s), Follower::new(&theory.dll.0, t_s));
        let (mut pll, mut dll) = begin();
        for k in 0..count {
            // The middle of an interval is taken for its mean.
            let Some(state) = timeline.state(link, from_s + (k as f64 + 0.5) * t_s) else {
                (pll, dll) = begin();
                continue;
            };
            let range_m = state.range_m - origin.range_m;
            let carrier_cycles = state.carrier_cycles - origin.carrier_cycles;
            let errors = pll.errors(carrier_cycles);
            found.add(Loop::Pll, errors.map(|[cycles, _]| 360.0 * cycles));
            // The Doppler given out is the loop's rate, without the part that only steers the phase.
            found.add(Loop::Fll, errors.map(|[_, cycles]| cycles / t_s));
            // The carrier aids the code: only what parts them is left.
            found.add(Loop::Dll, dll.error((range_m - carrier_cycles * link.wavelength_m()) / theory.chip_m));
        }
        found
    }

    fn add(&mut self, which: Loop, error: Option<f64>) {
        if let Some(error) = error {
            self.of.entry(which).or_default().add(error);
        }
    }

    /// Stress of one loop.
    pub fn of(&self, which: Loop) -> Stress {
        self.of.get(&which).copied().unwrap_or_default()
    }
}

/// Errors in degrees that the true motion leaves in the phase loop of a satellite, with their times since
/// sample 0: those of them at times that `wanted` selects.
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read.
pub fn motion_error_deg(
    run: &Run,
    link: Link,
    (settings, update_s): (Settings, f64),
    wanted: impl Fn(f64) -> bool,
) -> Result<Vec<(f64, f64)>, JudgeError> {
    let settings = Followed::of(run, link.signal).map_or(settings, |followed| settings.fitted(&followed));
    let (Some(timeline), Some(closed)) =
        (Timeline::of(run, link)?, exact_loop(settings.pll_order, settings.pll_bandwidth_hz * update_s))
    else {
        return Ok(Vec::new());
    };
    let origin_s = run.trajectory.first().map_or(0.0, |row| row.time().since(timeline.origin) - run.time_s(row.sample));
    let skip_s = (1.0 / update_s).trunc() * update_s;
    let mut series = Vec::new();
    for (from_s, to_s) in timeline.stretches_s().remove(&link).unwrap_or_default() {
        let count = (((to_s - from_s) / update_s).max(0.0) as usize).min(MOST_UPDATES);
        let start = timeline.state(&link, from_s).map_or(0.0, |state| state.carrier_cycles);
        let at = |k: usize| from_s + (k as f64 + 0.5) * update_s;
        let mut follower = Follower::new(&closed, update_s);
        let phases = (0..count).map_while(|k| Some(timeline.state(&link, at(k))?.carrier_cycles - start));
        let errors = phases.filter_map(|phase| follower.error(phase)).enumerate();
        let errors = errors.map(|(k, error)| (at(k) + skip_s - origin_s, 360.0 * error));
        series.extend(errors.filter(|(at_s, _)| wanted(*at_s)));
    }
    Ok(series)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expect::closed::step;

    #[test]
    fn the_phase_at_a_place_of_an_interval_varies_as_the_loop_runs_there() {
        let mut places = Places::default();
        assert_eq!(places.means(), [0.0, 1.0 / 12.0]);
        places.add(0.0275, 0.01);
        assert!((places.means()[0] - 0.25).abs() < 1e-9 && (places.means()[1] - 0.0625).abs() < 1e-9);
        // Bandwidth times time of 18 Hz and 10 ms: one value of noise, and what it moves until it is
        // forgotten.
        let closed = exact_loop(3, 0.18).unwrap();
        let (mut state, mut ends) = (step(&closed.gains, [0.0; 3], 1.0), [0.0; 2]);
        for _ in 0..1000 {
            let ran = state[1] + 0.5 * state[2];
            for (end, place) in ends.iter_mut().zip([-0.5, 0.5]) {
                *end += (state[0] + place * ran) * (state[0] + place * ran);
            }
            state = step(&closed.gains, state, -state[0]);
        }
        let Response { phase, rate, cross, .. } = Response::of(&closed);
        for (end, place) in ends.into_iter().zip([-0.5, 0.5]) {
            let expected = phase + 2.0 * place * cross + place * place * rate;
            assert!((end / expected - 1.0).abs() < 1e-9, "{place}: {end}, {expected}");
        }
        assert!(ends[1] > 1.1 * ends[0], "{ends:?}");
    }
}
