//! Content of logs that all protocols share: observations, fixes and clock offsets.

use std::collections::BTreeMap;

use gnss::broadcast::Ephemeris;
use gnss::satellite::Sv;
use gnss::time::Epoch;
use nalgebra::Vector3;

/// Observables of one satellite's signal at one epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct Observed {
    /// Satellite.
    pub sv: Sv,
    /// RINEX band and attribute of the signal, such as `1C`.
    pub code: &'static str,
    /// Pseudorange, metres.
    pub pseudorange_m: Option<f64>,
    /// Carrier, cycles.
    pub carrier_cycles: Option<f64>,
    /// Doppler, Hz; positive where the satellite comes nearer.
    pub doppler_hz: Option<f64>,
    /// C/N0, dB-Hz.
    pub cn0_dbhz: Option<f64>,
    /// Time in seconds for which the carrier has been locked without a break, or a bound below it.
    pub lock_s: Option<f64>,
    /// True if the carrier's count is broken since the signal's epoch before.
    pub lost_lock: bool,
    /// True if half a cycle may be missing.
    pub half_cycle_ambiguous: bool,
}

/// Observations of one epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservedEpoch {
    /// Time label of the receiver, in GPS time.
    pub label: Epoch,
    /// Values in the order of the message.
    pub values: Vec<Observed>,
}

/// Kind of a position's solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solution {
    /// Position by the satellites alone.
    #[default]
    Single,
    /// Position with corrections to codes.
    Differential,
    /// Position by carriers whose ambiguities are real numbers.
    FloatCarrier,
    /// Position by carriers whose ambiguities are whole numbers.
    FixedCarrier,
}

impl Solution {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Differential => "differential",
            Self::FloatCarrier => "float",
            Self::FixedCarrier => "fixed",
        }
    }
}

/// Reported position.
#[derive(Clone, Debug, PartialEq)]
pub struct Fix {
    /// Time label of the receiver, in GPS time.
    pub label: Epoch,
    /// Position, Earth-fixed, metres.
    pub position_m: Vector3<f64>,
    /// Velocity east, north and up, m/s.
    pub velocity_enu_mps: Option<[f64; 3]>,
    /// Kind of the solution.
    pub solution: Solution,
    /// Satellites used.
    pub satellites: u32,
    /// Reported accuracy of the horizontal position, metres.
    pub horizontal_sigma_m: Option<f64>,
    /// Reported accuracy of the height, metres.
    pub vertical_sigma_m: Option<f64>,
    /// Reported accuracy of the speed, m/s.
    pub speed_sigma_mps: Option<f64>,
    /// Reported accuracy of the time, seconds.
    pub time_sigma_s: Option<f64>,
}

/// Offset of the receiver's clock in a message of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockReading {
    /// Time of the navigation epoch, in GPS time.
    pub label: Epoch,
    /// Clock bias with the sign of the receiver's protocol, seconds.
    pub bias_s: f64,
    /// Rate of the bias, seconds a second.
    pub drift: f64,
}

/// Further digits of the position of a fix, in a message of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Time of the fix to the millisecond, in GPS time.
    pub label: Epoch,
    /// Position, Earth-fixed, metres.
    pub position_m: Vector3<f64>,
}

/// Part of a log that can be joined with a truth.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Observations of an epoch.
    Observations(ObservedEpoch),
    /// Position.
    Fix(Fix),
    /// Further digits of the position before.
    Refinement(Refinement),
    /// Epoch whose message says that there is no fix.
    NoFix,
    /// Offset of the receiver's clock.
    Clock(ClockReading),
    /// Ephemeris of a satellite.
    Ephemeris(Box<Ephemeris>),
    /// Message whose week cannot be known: neither the log before it nor the caller names a date.
    Undated,
}

/// Lock times of every signal at its last epoch.
#[derive(Debug, Default)]
pub struct Locks {
    before: BTreeMap<(Sv, &'static str), (Epoch, f64)>,
}

impl Locks {
    /// Marks values whose lock began after their signal's epoch before. A lock time that is a bound below the
    /// true one says so only where it falls.
    pub fn mark(&mut self, epoch: &mut ObservedEpoch, is_bound: bool) {
        for value in &mut epoch.values {
            let Some(lock_s) = value.lock_s else { continue };
            let now = (epoch.label, lock_s);
            if let Some((before, before_s)) = self.before.insert((value.sv, value.code), now) {
                // Labels and lock times are rounded to milliseconds; counts of u-blox end at 64.5 s.
                let since_s = epoch.label.since(before).min(64.0);
                let is_short = !is_bound && lock_s < since_s - 2e-3;
                value.lost_lock = lock_s < before_s || is_short;
            }
        }
    }
}

/// Week of messages that have a time of week alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct Calendar {
    near: Option<Epoch>,
}

impl Calendar {
    /// Calendar that knows a time near the log's, if the caller does.
    pub fn new(near: Option<Epoch>) -> Self {
        Self { near }
    }

    /// Learns a time with its week.
    pub fn learn(&mut self, at: Epoch) {
        self.near = Some(at);
    }

    /// Last time that was learnt.
    pub fn near(&self) -> Option<Epoch> {
        self.near
    }

    /// Instant nearest to the last known time with this time of week in milliseconds.
    pub fn at_ms(&self, tow_ms: i64) -> Option<Epoch> {
        let near = self.near?;
        Some(near.nearest_tow(tow_ms.div_euclid(1000)).plus_s(tow_ms.rem_euclid(1000) as f64 * 1e-3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(locks: &mut Locks, t_s: f64, lock_s: f64, is_bound: bool) -> bool {
        let value = Observed {
            sv: Sv::gps(1),
            code: "1C",
            pseudorange_m: None,
            carrier_cycles: None,
            doppler_hz: None,
            cn0_dbhz: None,
            lock_s: Some(lock_s),
            lost_lock: false,
            half_cycle_ambiguous: false,
        };
        let mut epoch = ObservedEpoch { label: Epoch::from_week(2000, t_s), values: vec![value] };
        locks.mark(&mut epoch, is_bound);
        epoch.values[0].lost_lock
    }

    #[test]
    fn a_lock_younger_than_the_time_since_the_epoch_before_is_a_new_one() {
        let mut locks = Locks::default();
        let seen = [(0.0, 0.5), (1.0, 1.5), (2.0, 64.5), (3.0, 64.5), (6.0, 0.3), (7.0, 0.9)];
        assert_eq!(
            seen.map(|(t_s, lock_s)| lost(&mut locks, t_s, lock_s, false)),
            [false, false, false, false, true, true]
        );
        let mut locks = Locks::default();
        let seen = [(0.0, 0.032), (1.0, 0.032), (2.0, 1.024), (3.0, 0.512)];
        assert_eq!(seen.map(|(t_s, lock_s)| lost(&mut locks, t_s, lock_s, true)), [false, false, false, true]);
    }

    #[test]
    fn a_time_of_week_falls_into_the_nearest_week() {
        let calendar = Calendar::new(Some(Epoch::from_week(2000, 604_799.0)));
        assert_eq!(calendar.at_ms(500), Some(Epoch::from_week(2001, 0.5)));
        assert_eq!(calendar.at_ms(604_798_000), Some(Epoch::from_week(2000, 604_798.0)));
        assert_eq!(Calendar::default().at_ms(0), None);
    }
}
