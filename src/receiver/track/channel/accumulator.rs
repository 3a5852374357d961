//! The correlations of a channel: the taps of its replica in a code period, and their sums over an
//! integration.

use num_complex::Complex64;

use crate::correlate::ahead::Ahead;
use crate::correlate::correlator::{Code, Coded, Correlator, Interval};
use crate::correlate::{Arithmetic, Nco, Replica, chips_to_units};
use crate::track::TrackingSettings;
use gnss::samples::{Format, IfMetadata};
use gnss::signal::{Component, Link};

/// Periods over which the power of the samples is averaged.
const POWER_PERIODS: f64 = 100.0;
/// The power is measured in one of this many periods.
const POWER_EVERY: u64 = 8;
/// Positions of the code at which the noise is measured, in turn.
const NOISE_PLACES: usize = 16;

/// A code period whose correlations a correlator can give.
pub(super) struct Period<'a, C> {
    pub correlator: &'a C,
    pub arithmetic: Arithmetic,
    /// Number of the period.
    pub number: u64,
    /// Samples of the period, and the oscillators at the first of them.
    pub interval: Interval,
    /// Length of a code period in code phase units.
    pub length: i64,
    /// Code periods from this one on for which the oscillators are expected to keep their steps.
    pub periods: u32,
}

impl<C: Correlator> Period<'_, C> {
    /// Sums of a replica at these taps.
    fn sums<const T: usize>(&self, coded: &Coded, taps: &[i64; T]) -> [Complex64; T] {
        self.correlator.sums(&self.interval, coded, self.arithmetic, taps)
    }

    /// Sums of a replica that is the same in the periods to come, at these taps.
    fn sums_ahead<const T: usize>(&self, ahead: &mut Ahead, coded: &Coded, taps: &[i64; T]) -> [Complex64; T] {
        let asked = (&self.interval, self.length, self.periods);
        ahead.sums(self.correlator, asked, (coded, self.arithmetic), taps)
    }

    /// Sum of a replica without delay.
    pub fn prompt(&self, coded: &Coded) -> Complex64 {
        let [sum] = self.sums(coded, &[0]);
        sum
    }

    /// Sum without delay of a replica that is the same in the periods to come.
    pub fn prompt_ahead(&self, ahead: &mut Ahead, coded: &Coded) -> Complex64 {
        let [sum] = self.sums_ahead(ahead, coded, &[0]);
        sum
    }

    /// The sum of [`Self::prompt`] over the first half of the samples.
    pub fn first_half(&self, coded: &Coded) -> Complex64 {
        let Interval { from, to, .. } = self.interval;
        let half = Interval { to: from + (to - from) / 2, ..self.interval };
        let [sum] = self.correlator.sums(&half, coded, self.arithmetic, &[0]);
        sum
    }

    /// Mean power of the samples.
    fn power(&self) -> f64 {
        self.correlator.power(self.interval.from, self.interval.to)
    }
}

/// Correlations of a code period.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Correlations {
    /// Early, prompt, late, and very early less very late where the discriminator takes them.
    pub sums: [Complex64; 4],
    /// Correlation at a delay where the code does not correlate with itself, if it was requested.
    pub noise: Option<Complex64>,
    /// Correlations on the neighbouring peaks, ahead and behind, of a signal that has them.
    pub sides: Option<[Complex64; 2]>,
}

/// A replica, its taps, and the integration that runs.
#[derive(Clone, Debug)]
pub(super) struct Accumulator {
    pub arithmetic: Arithmetic,
    /// Replica with its code. `None` where the documents assign no code.
    pub coded: Option<Coded>,
    /// Sums of the code periods to come.
    ahead: Ahead,
    /// Mean power of the replica's samples.
    pub replica_power: f64,
    /// Code phases of early, prompt and late.
    pub taps: [i64; 3],
    /// True if the discriminator takes taps twice as far from the prompt as early and late too.
    takes_outer: bool,
    /// Delays at which the code does not correlate with itself.
    noise_taps: Vec<i64>,
    /// Mean power of the samples.
    power: Option<f64>,
    /// Sums of the running integration, as of a code period.
    pub sums: [Complex64; 4],
    /// Code periods of the running integration.
    pub periods: u32,
    /// Sample at which the running integration began.
    pub since: u64,
    /// Prompt of the last code period.
    pub previous: Option<Complex64>,
    /// Prompt sum of the last integration.
    pub previous_sum: Option<Complex64>,
}

impl Accumulator {
    /// Taps of a satellite's code with `settings` fitted to it; `model_power` is the mean power of a replica
    /// all of whose chips are sent.
    pub fn new(
        component: Option<&'static Component>,
        link: Link,
        settings: &TrackingSettings,
        metadata: &IfMetadata,
        model_power: f64,
    ) -> Self {
        let made = (settings.waveform, settings.replica);
        let arithmetic = match (settings.arithmetic, metadata.format) {
            (Arithmetic::F64, _) => Arithmetic::F64,
            (arithmetic, Format::Ci8 | Format::Cu8 | Format::Ri8) => arithmetic,
            (_, Format::Ci16Le | Format::Ri16Le | Format::Cf32Le) => Arithmetic::F32,
        };
        let coded = |component| {
            let replica = Replica::made_in(component, link.sv.number, made, metadata.inverted)?;
            Some(Coded { replica, code: Code::new(link, component, made) })
        };
        let mut coded = component.and_then(coded);
        let chip_rate_hz = component.map_or(1.0, |c| c.chip_rate_hz);
        if arithmetic == Arithmetic::Sums
            && let Some(Coded { replica, .. }) = &mut coded
        {
            replica.prepare(chips_to_units(chip_rate_hz / metadata.rate.hz()).max(1) as u64);
        }
        let half = chips_to_units(0.5 * settings.spacing_chips);
        Self {
            arithmetic,
            replica_power: model_power * coded.as_ref().map_or(1.0, |coded| coded.replica.share()),
            coded,
            ahead: Ahead::default(),
            taps: [half, 0, -half],
            takes_outer: settings.dll_discriminator.widest() > 1.0,
            noise_taps: Vec::new(),
            power: None,
            sums: [Complex64::ZERO; 4],
            periods: 0,
            since: 0,
            previous: None,
            previous_sum: None,
        }
    }

    /// The replica.
    pub fn replica(&self) -> Option<&Replica> {
        self.coded.as_ref().map(|coded| &coded.replica)
    }

    /// Length of a code period in code phase units; one without a code.
    pub fn length(&self) -> i64 {
        self.replica().map_or(1, Replica::period)
    }

    /// The first integration begins at sample `first`.
    pub fn begin(&mut self, first: u64) {
        self.since = first;
        self.noise_taps = self.replica().map_or(Vec::new(), |replica| replica.quiet_taps(NOISE_PLACES));
    }

    /// True if running sums of the samples are used at these steps of the oscillators.
    pub fn takes_sums(&self, nco: &Nco) -> bool {
        self.arithmetic == Arithmetic::Sums && self.replica().is_some_and(|replica| replica.takes_sums(nco))
    }

    /// True if samples in 16 bits are used at these steps of the oscillators.
    pub fn takes_fixed(&self, nco: &Nco) -> bool {
        self.arithmetic == Arithmetic::Sums && self.replica().is_some_and(|replica| replica.takes_fixed(nco))
    }

    /// The tap at which the noise of code period `number` is measured.
    pub fn quiet_tap(&self, number: u64) -> Option<i64> {
        self.noise_taps.get(number as usize % self.noise_taps.len().max(1)).copied()
    }

    /// All taps of a code period in one pass: early, prompt and late, and those that are asked for.
    pub fn correlate<C: Correlator>(
        &mut self,
        period: &Period<C>,
        quiet: Option<i64>,
        sides: Option<[i64; 2]>,
    ) -> Correlations {
        let Some(coded) = &self.coded else { return Correlations::default() };
        let [e, p, l] = self.taps;
        // Taps that are asked for follow early, prompt and late in this order.
        let outer = self.takes_outer.then_some([2 * e, 2 * l]);
        let read = |found: &[Complex64]| {
            let (three, rest) = found.split_at(3);
            let mut rest = rest.iter().copied();
            let noise = quiet.and_then(|_| rest.next());
            let outer = outer.and_then(|_| Some(rest.next()? - rest.next()?));
            let sides = sides.and_then(|_| Some([rest.next()?, rest.next()?]));
            let mut sums = [Complex64::ZERO; 4];
            sums.iter_mut().zip(three.iter().copied().chain(outer)).for_each(|(sum, tap)| *sum = tap);
            Correlations { sums, noise, sides }
        };
        let ahead = &mut self.ahead;
        match (quiet, outer, sides) {
            (None, None, None) => read(&period.sums_ahead(ahead, coded, &[e, p, l])),
            (Some(q), None, None) => read(&period.sums(coded, &[e, p, l, q])),
            (None, None, Some([a, b])) => read(&period.sums_ahead(ahead, coded, &[e, p, l, a, b])),
            (Some(q), None, Some([a, b])) => read(&period.sums(coded, &[e, p, l, q, a, b])),
            (None, Some([x, y]), None) => read(&period.sums_ahead(ahead, coded, &[e, p, l, x, y])),
            (Some(q), Some([x, y]), None) => read(&period.sums(coded, &[e, p, l, q, x, y])),
            (None, Some([x, y]), Some([a, b])) => read(&period.sums_ahead(ahead, coded, &[e, p, l, x, y, a, b])),
            (Some(q), Some([x, y]), Some([a, b])) => read(&period.sums(coded, &[e, p, l, q, x, y, a, b])),
        }
    }

    /// Factor that brings the noise of a code period's correlations to unit variance a component. The power
    /// of the samples is measured at times, and in none that is not `whole`.
    pub fn scale<C: Correlator>(&mut self, period: &Period<C>, whole: bool) -> f64 {
        if whole && (self.power.is_none() || period.number.is_multiple_of(POWER_EVERY)) {
            let power = period.power();
            self.power =
                Some(self.power.map_or(power, |mean| mean + (power - mean) * POWER_EVERY as f64 / POWER_PERIODS));
        }
        let mean = self.power.unwrap_or_default();
        let count = period.interval.to - period.interval.from;
        // Noise of a correlation, per component: half the samples' power (real samples too) times the
        // replica's energy.
        let deviation = (0.5 * mean * count as f64 * self.replica_power).sqrt();
        if deviation > 0.0 { 1.0 / deviation } else { 0.0 }
    }

    /// Adds the correlations of a code period.
    pub fn add(&mut self, taps: [Complex64; 4]) {
        self.sums.iter_mut().zip(taps).for_each(|(sum, tap)| *sum += tap);
        self.periods += 1;
    }

    /// Begins an integration at sample `since`.
    pub fn clear(&mut self, since: u64) {
        (self.sums, self.periods, self.since) = ([Complex64::ZERO; 4], 0, since);
    }

    /// Forgets the prompts before.
    pub fn forget(&mut self) {
        (self.previous, self.previous_sum) = (None, None);
    }
}
