//! Arrival of an emitter's wave in the samples: clock, path, tuning and repetition.
//!
//! Sample n is taken when the receiver's clock reads n/rate after its start; what it holds was sent
//! `behind_s` before that time (the clock's error plus the time on the way). Phases are the exact phase of
//! sample n as integers, less frequency times `behind_s`, so neither a long scene nor a drifting clock loses
//! a digit. Limits: emitters do not move.

use nalgebra::Vector3;

use crate::clock::ReceiverClock;
use crate::vehicle::Trajectory;
use gnss::earth::{SPEED_OF_LIGHT_MPS, rotate_earth};
use gnss::samples::IfMetadata;
use gnss::signal::Signal;
use gnss::time::{Rate, SampleClock, tone_turns};

/// Receiver's effect on any wave between its antenna and its samples.
#[derive(Clone, Debug)]
pub struct Tuning {
    /// Sample numbers as times of the receiver's clock.
    pub clock: SampleClock,
    /// Receiver's clock, with its offset from GPS time.
    pub receiver_clock: ReceiverClock,
    /// Radio frequency in Hz that appears at 0 Hz in the samples.
    pub center_hz: f64,
    /// True if the spectrum is mirrored.
    pub inverted: bool,
    /// True if only the I plane is sent on.
    pub real: bool,
    /// Lower end in Hz of the band of real samples: 0, or a multiple of half the rate for a higher zone.
    pub low_hz: f64,
    /// Standard deviation of the thermal noise per component, in LSB: the gain.
    pub noise_lsb: f64,
}

impl Tuning {
    /// Creates the tuning of a receiver with samples as in `metadata`, at times `clock` of `receiver_clock`.
    /// Real samples are those of the zone in which most of `signals` lie. `noise_lsb` is the gain.
    pub fn new(
        metadata: &IfMetadata,
        (clock, receiver_clock): (SampleClock, &ReceiverClock),
        signals: &[&Signal],
        noise_lsb: f64,
    ) -> Self {
        let half_hz = 0.5 * clock.rate.hz();
        Self {
            clock,
            receiver_clock: receiver_clock.clone(),
            center_hz: metadata.center_hz,
            inverted: metadata.inverted,
            real: !metadata.format.is_complex(),
            low_hz: zone_of(metadata, signals, half_hz) * half_hz,
            noise_lsb,
        }
    }

    /// Sign of frequencies: −1 if the spectrum is mirrored.
    pub fn sign(&self) -> f64 {
        if self.inverted { -1.0 } else { 1.0 }
    }

    /// Frequency in the samples of a radio frequency without Doppler, in Hz.
    pub fn place_hz(&self, carrier_hz: f64) -> f64 {
        self.sign() * (carrier_hz - self.center_hz)
    }

    /// Lowest and highest frequency in Hz that the samples can contain.
    pub fn band_hz(&self) -> (f64, f64) {
        let half_hz = 0.5 * self.clock.rate.hz();
        if self.real { (self.low_hz, self.low_hz + half_hz) } else { (-half_hz, half_hz) }
    }

    /// Peak amplitude in LSB of a carrier with this power over noise density.
    pub fn amplitude_lsb(&self, jn0_hz: f64) -> f64 {
        let real = if self.real { std::f64::consts::SQRT_2 } else { 1.0 };
        real * (2.0 * jn0_hz.max(0.0) / self.clock.rate.hz()).sqrt() * self.noise_lsb
    }

    /// True seconds since the scene's start at sample `n`.
    pub fn elapsed_s(&self, n: u64) -> f64 {
        self.receiver_clock.true_elapsed_s(self.clock.start, self.clock.epoch(n))
    }

    /// Number of the first sample at or after a true time.
    pub fn sample_at(&self, t_s: f64) -> u64 {
        let reading_s = self.receiver_clock.reading_elapsed_s(self.clock.start, t_s);
        (reading_s * self.clock.rate.hz()).ceil().max(0.0) as u64
    }

    /// Phase at sample `n`, in 2^-64 turn, of a carrier that was sent `behind_s` before.
    pub fn turns(&self, carrier_hz: f64, n: u64, behind_s: f64) -> u64 {
        let tone = tone_turns(carrier_hz - self.center_hz, self.clock.rate, n);
        let turns = tone.wrapping_sub(fraction_turns(carrier_hz * behind_s));
        if self.inverted { turns.wrapping_neg() } else { turns }
    }

    /// Phase advance per sample in 2^-64 turn, while `behind_s` changes by `change_s` over `samples`.
    pub fn turns_step(&self, carrier_hz: f64, change_s: f64, samples: u64) -> u64 {
        let tone = tone_turns(carrier_hz - self.center_hz, self.clock.rate, 1);
        let step = tone.wrapping_sub(fraction_turns(carrier_hz * change_s / samples as f64));
        if self.inverted { step.wrapping_neg() } else { step }
    }
}

/// The zone of width `half_hz` in which most of the signals' carriers lie, counted from 0 Hz; of equals the
/// first signal's.
fn zone_of(metadata: &IfMetadata, signals: &[&Signal], half_hz: f64) -> f64 {
    let carriers = signals.iter().flat_map(|signal| <[f64; 2]>::from(signal.carriers_hz()));
    let zones: Vec<f64> = carriers.map(|hz| (metadata.if_hz(hz) / half_hz).floor()).collect();
    let votes = |zone: &f64| zones.iter().filter(|other| *other == zone).count();
    // The last of equals is the first in reverse.
    zones.iter().rev().max_by_key(|zone| votes(zone)).copied().unwrap_or(0.0)
}

/// Cycles modulo one, in 2^-64 turn.
pub(super) fn fraction_turns(cycles: f64) -> u64 {
    ((cycles - cycles.floor()) * 18_446_744_073_709_551_616.0) as u64
}

/// An emitter at a position, and the antenna that receives it.
#[derive(Clone, Debug)]
pub struct Path {
    /// ECEF position of the emitter, in metres.
    pub emitter_m: Vector3<f64>,
    /// Motion of the antenna.
    pub antenna: Trajectory,
}

impl Path {
    /// Travel time in seconds of the wave that arrives `t_s` true seconds after the scene's start, on a
    /// straight line in vacuum.
    pub fn travel_s(&self, t_s: f64) -> f64 {
        self.travel_to_s(&self.antenna.at(t_s).position_m)
    }

    /// Unit vector in ECEF from the antenna towards the emitter `t_s` true seconds after the scene's start.
    pub fn towards(&self, t_s: f64) -> Vector3<f64> {
        let antenna_m = self.antenna.at(t_s).position_m;
        let direct_s = (self.emitter_m - antenna_m).norm() / SPEED_OF_LIGHT_MPS;
        (rotate_earth(&self.emitter_m, direct_s) - antenna_m).normalize()
    }

    /// Travel time in seconds when the scene starts.
    pub fn first_travel_s(&self) -> f64 {
        self.travel_to_s(&self.antenna.composed_for().position_m)
    }

    fn travel_to_s(&self, antenna_m: &Vector3<f64>) -> f64 {
        let direct_s = (self.emitter_m - antenna_m).norm() / SPEED_OF_LIGHT_MPS;
        // The Earth turns under the wave: a second pass is 1e-6 of the first one's correction.
        (rotate_earth(&self.emitter_m, direct_s) - antenna_m).norm() / SPEED_OF_LIGHT_MPS
    }
}

/// Rate of a repetition: an exact fraction of integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repetition {
    count: u64,
    seconds: u64,
}

impl Repetition {
    /// Creates the rate of one repetition in `period_s`, to the picosecond.
    pub fn every_s(period_s: f64) -> Self {
        Self { count: 1_000_000_000_000, seconds: (period_s * 1e12).round().max(1.0) as u64 }
    }

    /// `hz` times per second, to the millihertz.
    pub fn of_hz(hz: f64) -> Self {
        Self { count: (hz * 1e3).round().max(1.0) as u64, seconds: 1000 }
    }

    /// Times a second.
    pub fn hz(self) -> f64 {
        self.count as f64 / self.seconds as f64
    }

    /// Whole periods, and the phase in 2^-64 period, at sample `n`, of a wave that was sent `behind_s`
    /// before.
    pub fn at(self, rate: Rate, n: u64, behind_s: f64) -> (i64, u64) {
        let (whole, fraction) = rate.turns(n, self.count, self.seconds);
        let behind = behind_s * self.hz();
        let (phase, borrowed) = fraction.overflowing_sub(fraction_turns(behind));
        (whole - behind.floor() as i64 - i64::from(borrowed), phase)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repetitions_are_counted_exactly_after_a_month() {
        let rate = Rate::from_hz(50e6).unwrap();
        let n = 30 * 86_400 * 50_000_000;
        // 12.5 us is 625 samples.
        let sweep = Repetition::every_s(12.5e-6);
        assert_eq!(sweep.at(rate, n, 0.0), (30 * 86_400 * 80_000, 0));
        assert_eq!(sweep.at(rate, n + 125, 0.0).1 >> 32, (0.2 * 4_294_967_296.0) as u64);
        assert_eq!(Repetition::of_hz(80_000.0).at(rate, n + 624, 0.0).0, 30 * 86_400 * 80_000);
        // A quarter period behind the first sample: three quarters into the one before.
        assert_eq!(sweep.at(rate, 0, 3.125e-6).0, -1);
        assert!((sweep.at(rate, 0, 3.125e-6).1 as f64 / 2_f64.powi(64) - 0.75).abs() < 1e-15);
    }

    #[test]
    fn a_carrier_follows_the_clock_and_the_mirror() {
        let mut tuning = Tuning {
            clock: SampleClock { start: gnss::time::Epoch::new(0, 0.0), rate: Rate::from_hz(4e6).unwrap() },
            receiver_clock: ReceiverClock::steady(0.0, 0.0),
            center_hz: 1_575.42e6,
            inverted: false,
            real: false,
            low_hz: 0.0,
            noise_lsb: 1.0,
        };
        // 1 MHz above the centre: a quarter turn a sample; half a period late: half a turn less at RF 1576.42
        // MHz.
        let carrier_hz = 1_576.42e6;
        assert_eq!(tuning.turns(carrier_hz, 5, 0.0), 1 << 62);
        let half = tuning.turns(carrier_hz, 5, 0.5 / carrier_hz);
        assert!((half as f64 / 2_f64.powi(64) - 0.75).abs() < 1e-12);
        tuning.inverted = true;
        assert_eq!(tuning.turns(carrier_hz, 5, 0.0), 3 << 62);
        assert_eq!(tuning.place_hz(carrier_hz), -1e6);
    }
}
