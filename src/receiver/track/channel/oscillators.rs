//! The numerically controlled oscillators of a channel, carrier and code, at the beginning of a code period.

use crate::acquire::Acquired;
use crate::correlate::{Nco, TURN, chips_to_units, units_to_chips};
use crate::parting::Phases;
use crate::track::loops::Rates;
use gnss::samples::IfMetadata;
use gnss::time::{Rate, tone_turns};

/// Phases of code and carrier at the first sample of the running code period, and their steps.
#[derive(Clone, Debug)]
pub(super) struct Oscillators {
    pub rate: Rate,
    /// Nominal intermediate frequency, in hertz.
    if_hz: f64,
    /// Turns a sample at the nominal IF, in 2⁻⁶⁴ turns.
    if_step: u64,
    /// Sense of Doppler in the samples: +1, or −1 where the spectrum is inverted.
    pub sense: f64,
    chip_rate_hz: f64,
    /// Frequency of the carrier by whose Doppler the code is aided, in hertz.
    aid_hz: f64,
    /// Length of a code period in code phase units.
    pub length: i64,
    /// Excess of the carrier's Doppler over the code's now, in hertz.
    pub offset_hz: f64,
    /// Excess from the next code period on, in hertz.
    pub next_offset_hz: f64,
    /// Sample at which the running code period begins.
    pub first: u64,
    /// Number of the running code period.
    pub period: u64,
    pub code: i64,
    pub code_step: i64,
    /// Carrier without the nominal IF, in 2⁻⁶⁴ turns, never wrapped.
    pub carrier: i128,
    pub carrier_step: i128,
    /// Rates, time to the next update and offset for which the steps are set.
    set_for: Option<([Rates; 2], f64, f64)>,
}

impl Oscillators {
    /// Oscillators at rest, for what the search found and a code of `chip_rate_hz` with periods of `length`.
    pub fn new(hit: &Acquired, metadata: &IfMetadata, chip_rate_hz: f64, length: i64) -> Self {
        let carrier_hz = hit.link().carrier_hz();
        let if_hz = metadata.if_hz(carrier_hz);
        Self {
            rate: metadata.rate,
            if_hz,
            if_step: tone_turns(if_hz, metadata.rate, 1),
            sense: if metadata.inverted { -1.0 } else { 1.0 },
            chip_rate_hz,
            aid_hz: planted!("receiver.nco.channel", carrier_hz, hit.signal.centre_hz()),
            length,
            offset_hz: 0.0,
            next_offset_hz: 0.0,
            first: 0,
            period: 0,
            code: 0,
            code_step: 0,
            carrier: 0,
            carrier_step: 0,
            set_for: None,
        }
    }

    /// Carries the code phase of a hit to the first sample that the channel sees.
    pub fn begin(&mut self, first: u64, hit: &Acquired) {
        let samples = i128::from(first) - i128::from(hit.sample);
        let moved = samples * i128::from(self.code_step) + i128::from(chips_to_units(hit.code_phase_chips));
        self.code = moved.rem_euclid(i128::from(self.length)) as i64;
        self.first = first;
    }

    /// The oscillators at the running period's first sample.
    pub fn nco(&self) -> Nco {
        Nco {
            carrier: tone_turns(self.if_hz, self.rate, self.first).wrapping_add(self.carrier as u64),
            carrier_step: self.if_step.wrapping_add(self.carrier_step as u64),
            code: self.code,
            code_step: self.code_step as u64,
        }
    }

    /// The oscillators at `sample` with the code moved by `chips` and the carrier at `carrier_hz` from phase
    /// zero.
    pub fn predicted(&self, sample: u64, chips: f64, carrier_hz: f64) -> Nco {
        let code = self.code_at(sample) + i128::from(chips_to_units(chips));
        Nco {
            carrier: 0,
            carrier_step: self.if_step.wrapping_add(self.turns(carrier_hz) as u64),
            code: code.rem_euclid(i128::from(self.length)) as i64,
            code_step: self.code_step as u64,
        }
    }

    /// First sample of the next code period.
    pub fn next(&self) -> u64 {
        let left = self.length - self.code;
        self.first + (left.max(1) as u64).div_ceil(self.code_step.max(1) as u64)
    }

    /// Code phase at `sample`, counted from the beginning of the running period.
    pub fn code_at(&self, sample: u64) -> i128 {
        i128::from(self.code) + self.samples_to(sample) * i128::from(self.code_step)
    }

    /// Samples from the beginning of the running period to `sample`.
    pub fn samples_to(&self, sample: u64) -> i128 {
        i128::from(sample) - i128::from(self.first)
    }

    /// Seconds from `sample` to the beginning of the running period.
    pub fn since_s(&self, sample: u64) -> f64 {
        self.first.saturating_sub(sample) as f64 / self.rate.hz()
    }

    /// Phases that the replica has counted at the beginning of the running code period.
    pub fn phases(&self) -> Phases {
        let carrier = if self.sense < 0.0 { -self.carrier } else { self.carrier };
        Phases { sample: self.first, periods: self.period, chips: units_to_chips(self.code), carrier }
    }

    /// Sets the steps to the rates of the loops, whose next update is `update_s` away.
    pub fn set_steps(&mut self, carrier: &Rates, code: &Rates, update_s: f64) {
        let rates = Some(([*carrier, *code], update_s, self.offset_hz));
        if self.set_for == rates {
            return;
        }
        self.set_for = rates;
        let offset_hz = carrier.mean(update_s);
        self.carrier_step = self.turns(offset_hz);
        let aid_hz = (self.sense * offset_hz - self.offset_hz) * self.chip_rate_hz / self.aid_hz;
        let aid_hz = planted!("receiver.nco.carrier_aid", aid_hz, -aid_hz);
        let code_hz = self.chip_rate_hz + aid_hz + code.mean(update_s);
        self.code_step = chips_to_units(code_hz / self.rate.hz()).max(1);
    }

    /// Takes over the next offset between carrier and code. Gives what the code's aid then brings more, in
    /// chips a second.
    pub fn take_offset(&mut self) -> Option<f64> {
        let less_hz = self.offset_hz - self.next_offset_hz;
        self.offset_hz = self.next_offset_hz;
        (less_hz != 0.0).then(|| less_hz * self.chip_rate_hz / self.aid_hz)
    }

    /// The oscillators run on to `next`. Gives the number of samples that pass.
    pub fn pass(&mut self, next: u64) -> u64 {
        let samples = next.saturating_sub(self.first);
        self.carrier += self.carrier_step * i128::from(samples);
        self.code += (i128::from(self.code_step) * i128::from(samples)) as i64;
        self.first = next;
        samples
    }

    /// Begins the next code period.
    pub fn end_period(&mut self) {
        self.code -= self.length;
        self.period += 1;
    }

    /// Turns the carrier at once.
    pub fn turn(&mut self, cycles: f64) {
        self.carrier += (cycles * TURN) as i128;
    }

    /// Moves the code at once, to another code period where it comes to lie in one.
    pub fn shift(&mut self, chips: f64) {
        let code = self.code + chips_to_units(chips);
        self.code = code.rem_euclid(self.length);
        self.count(i128::from(code.div_euclid(self.length)));
    }

    /// Adds code periods to their count.
    pub fn count(&mut self, periods: i128) {
        self.period = (i128::from(self.period) + periods).max(0) as u64;
    }

    /// Step of a carrier in 2⁻⁶⁴ turns a sample.
    fn turns(&self, hz: f64) -> i128 {
        (hz / self.rate.hz() * TURN) as i128
    }
}
