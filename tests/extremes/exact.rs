//! Carrier and code of one satellite's signal in 128-bit integers, by the definition of both.
//!
//! Everything that grows with time is whole: sample numbers, seconds since a scale began, the receiver's
//! clock. Only the light time and the satellite's own clock, which stay small, come as `f64`.

use generator::scene::Scene;
use generator::sky;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;

use crate::scales;

pub const TURN: f64 = 18_446_744_073_709_551_616.0;
/// Parts of a code step.
pub const ONE: f64 = 281_474_976_710_656.0;
/// Units in a sample's duration.
const SAMPLE: i128 = 100_000_000_000;
/// Receiver clock of the scenes here: 1.3e-4 s ahead, 5e-8 s/s fast.
pub const CLOCK: &str = "[receiver_clock]\nbias_s = 1.3e-4\ndrift_sps = 5e-8\n";
const BIAS: (i128, i128) = (13, 100_000);
const FAST: (i128, i128) = (100_000_005, 100_000_000);

/// A satellite's signal in a scene with that clock or a perfect one, of a whole rate and centre in hertz.
pub struct Exact<'a> {
    scene: &'a Scene,
    sv: Sv,
    signal: &'static Signal,
    rate_hz: i128,
    carrier_hz: i128,
    if_hz: i128,
}

fn whole(hz: f64) -> i128 {
    assert_eq!(hz.fract(), 0.0, "{hz}");
    hz as i128
}

/// A fraction of turns modulo one in 2^-64, of a denominator below 2^64.
fn turns(numerator: i128, denominator: i128) -> u64 {
    let rest = numerator.rem_euclid(denominator) as u128;
    ((rest << 64) / denominator as u128) as u64
}

/// Cycles nearest to zero.
pub fn signed(turns: u64) -> f64 {
    turns as i64 as f64 / TURN
}

impl<'a> Exact<'a> {
    pub fn new(scene: &'a Scene, sv: Sv, signal: &'static Signal) -> Self {
        assert_eq!(scene.clock.start.fraction(), 0.0);
        let carrier_hz = signal.carrier_hz(sv);
        let (rate_hz, if_hz) = (whole(scene.clock.rate.hz()), whole(scene.metadata.if_hz(carrier_hz)));
        Self { scene, sv, signal, rate_hz, carrier_hz: whole(carrier_hz), if_hz }
    }

    /// Units in a second.
    fn second(&self) -> i128 {
        self.rate_hz * SAMPLE
    }

    /// Difference between the receiver's reading of sample `n` and the satellite's clock at transmission, in
    /// units.
    pub fn delay(&self, n: u64) -> i128 {
        let (second, elapsed) = (self.second(), i128::from(n) * SAMPLE);
        let perfect = self.scene.receiver_clock.bias_s == 0.0;
        let true_elapsed = if perfect { elapsed } else { (elapsed - second * BIAS.0 / BIAS.1) * FAST.1 / FAST.0 };
        let fraction = true_elapsed.rem_euclid(second) as f64 / second as f64;
        let received = Epoch::new(self.scene.clock.start.seconds() + true_elapsed.div_euclid(second) as i64, fraction);
        let motion = self.scene.trajectory.at(0.0);
        let emission = sky::emission(&self.scene.catalogue, self.sv, received, &motion).unwrap().unwrap();
        let sent = received.plus_s(-emission.travel_s);
        let clock_s = emission.satellite_clock_s + self.scene.catalogue.signal_clock_s(self.sv, sent, self.signal);
        elapsed - true_elapsed + ((emission.travel_s - clock_s) * second as f64) as i128
    }

    /// Cycles of that many units, whole ones and the rest.
    pub fn cycles(&self, units: i128) -> (i128, f64) {
        let cycles = units * self.carrier_hz;
        (cycles.div_euclid(self.second()), cycles.rem_euclid(self.second()) as f64 / self.second() as f64)
    }

    /// Units of a delay in seconds.
    pub fn units(&self, delay_s: f64) -> i128 {
        (delay_s * self.second() as f64) as i128
    }

    /// Seconds of a number of units.
    pub fn seconds(&self, units: i128) -> f64 {
        units as f64 / self.second() as f64
    }

    /// Carrier at sample `n` with that delay, in 2^-64 turn.
    pub fn carrier(&self, n: u64, delay: i128) -> u64 {
        turns(i128::from(n) * self.if_hz, self.rate_hz).wrapping_sub(turns(delay * self.carrier_hz, self.second()))
    }

    /// Steps of a code since 1980-01-06 in its system's calendar at sample `n` with that delay, in 2^-48 step
    /// of `step_mhz` thousandths of them a second.
    pub fn steps(&self, n: u64, delay: i128, step_mhz: i128) -> i128 {
        let start = scales::reads(self.signal.system, i128::from(self.scene.clock.start.seconds()));
        let second = self.second();
        let sent = i128::from(n) * SAMPLE - delay;
        let (seconds, rest) = (start + sent.div_euclid(second), sent.rem_euclid(second) * step_mhz);
        let denominator = 1000 * second;
        // No leap second falls into a scene here.
        ((seconds * step_mhz) << 48) / 1000 + ((rest / denominator) << 48) + ((rest % denominator) << 48) / denominator
    }
}
