//! Observables at common epochs: what a channel's replica reads, in metres, cycles and hertz.
//!
//! The time sent is an exact count of code periods since the week began and a fraction of one, never one
//! number of seconds. The receiver labels samples with its own clock: as the recording says if that agrees
//! with the satellites to a second, otherwise so that the nearest satellite is about 70 ms away. Satellites
//! whose time of sending is out of line with the others' (a wrong bit edge or code period of another) are
//! left out.

use crate::decode::Decoder;
use crate::track::Measurement;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::Observation;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::{Epoch, Rate, SampleClock, WEEK_S};

/// Travel time to the nearest satellite in a medium orbit that is assumed when the clock is set from
/// satellites alone.
const NEAREST_TRAVEL_S: f64 = 0.070;
/// Additional travel time in seconds from a geosynchronous orbit, at 42 164 km from the Earth's centre
/// instead of 26 560 km.
const FARTHER_S: f64 = 0.052;
/// Semi-major axis between both kinds.
const BETWEEN_M: f64 = 35e6;
/// Largest deviation of a travel time from the median of all, less the time to a medium orbit, near the
/// Earth. Travel times lie between 60 and 95 ms there, and from 119 to 140 ms.
const NEAR_SPREAD_S: f64 = 0.035;
/// Largest deviation for a receiver anywhere. Two satellites differ by 53 200 km at most, the width of their
/// orbits.
const FAR_SPREAD_S: f64 = 0.178;
/// A receiver is far away where this share of all satellites differs by more than from near the Earth: wrong
/// times are single.
const FAR_SHARE: f64 = 1.0 / 3.0;
/// The recording's start time is believed when it is this near.
const BELIEVED_S: f64 = 1.0;

/// One channel at one tick.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// The satellite.
    pub sv: Sv,
    /// The signal.
    pub signal: &'static Signal,
    /// The state of the channel's replica.
    pub measurement: Measurement,
    /// Time of week sent, in the time of the signal's system: whole seconds and a fraction.
    pub sent_of_week: (i64, f64),
    /// Time from the measurement to the observation, in seconds: less than a sample of the front end.
    pub later_s: f64,
}

impl Reading {
    /// Reading of a locked channel whose frame is known; `None` for any other channel.
    pub fn new(sv: Sv, signal: &'static Signal, measurement: &Measurement, decoder: &Decoder) -> Option<Self> {
        if !measurement.locked {
            return None;
        }
        let sent_of_week = decoder.time_of_week(measurement.code_periods, measurement.code_fraction)?;
        Some(Self { sv, signal, measurement: *measurement, sent_of_week, later_s: 0.0 })
    }

    /// Reading carried on to an instant `later_s` seconds later.
    pub fn later(self, later_s: f64) -> Self {
        let carrier_cycles = self.measurement.carrier_cycles - self.measurement.doppler_hz * later_s;
        Self { measurement: Measurement { carrier_cycles, ..self.measurement }, later_s, ..self }
    }

    /// Transmit time less that of another signal of the same system, in seconds of the satellite's clock;
    /// less than half a week.
    pub fn sent_after_s(&self, other: &Self) -> f64 {
        let rate = |reading: &Self| 1.0 + reading.measurement.doppler_hz / reading.signal.carrier_hz(reading.sv);
        let ((whole, fraction), (other_whole, other_fraction)) = (self.sent_of_week, other.sent_of_week);
        let weeks = (whole - other_whole + WEEK_S / 2).rem_euclid(WEEK_S) - WEEK_S / 2;
        weeks as f64 + (fraction - other_fraction) + self.later_s * rate(self) - other.later_s * rate(other)
    }

    /// Additional travel time in seconds over that from a medium orbit.
    fn farther_s(&self) -> f64 {
        if self.sv.orbit_m() > BETWEEN_M { FARTHER_S } else { 0.0 }
    }

    /// The time sent, in the week that brings it nearest to `near`.
    fn sent(&self, near: Epoch) -> Epoch {
        let (whole, fraction) = self.sent_of_week;
        let label = self.signal.time.label(near).nearest_tow(whole);
        let rate = 1.0 + self.measurement.doppler_hz / self.signal.carrier_hz(self.sv);
        self.signal.time.instant(Epoch::new(label.seconds(), fraction + self.later_s * rate))
    }
}

/// An observation, and whether its carrier is known to the half cycle.
#[derive(Clone, Debug)]
pub struct Observed {
    /// The row as it is written.
    pub observation: Observation,
    /// True if the carrier's half cycle is resolved.
    pub half_cycle_known: bool,
}

/// The receiver's own clock.
#[derive(Clone, Debug)]
pub struct Timebase {
    rate: Rate,
    stated: Option<Epoch>,
    clock: Option<SampleClock>,
    stated_by_message: Option<Epoch>,
}

impl Timebase {
    /// A clock that has read nothing but the recording's metadata.
    pub fn new(rate: Rate, stated: Option<Epoch>) -> Self {
        Self { rate, stated, clock: None, stated_by_message: None }
    }

    /// Clock that dates samples, once it is set.
    pub fn clock(&self) -> Option<SampleClock> {
        self.clock
    }

    /// Takes a time that a satellite's message states, right within half a week.
    pub fn take_time(&mut self, time: Epoch) {
        self.stated_by_message.get_or_insert(time);
    }

    /// Takes a gap of `samples` missing samples before those that come now, or a repetition if negative.
    /// Samples then no longer measure time. The clock's reading at the samples that come is corrected by
    /// another start.
    pub fn step(&mut self, samples: i64) {
        let (whole, fraction) = self.rate.elapsed(samples.unsigned_abs());
        let sign = samples.signum();
        let later =
            |start: Epoch| Epoch::new(start.seconds() + sign * whole, start.fraction() + sign as f64 * fraction);
        self.stated = self.stated.map(later);
        self.clock = self.clock.map(|clock| SampleClock { start: later(clock.start), ..clock });
    }

    /// Observations of these readings, which belong to one sample; none while the clock cannot be set.
    pub fn observe(&mut self, sample: u64, readings: &[Reading]) -> Vec<Observed> {
        if self.clock.is_none() {
            self.set(sample, readings);
        }
        let Some(clock) = self.clock else { return Vec::new() };
        let label = clock.epoch(sample);
        let travels: Vec<(Epoch, f64)> = readings
            .iter()
            .map(|reading| {
                let sent = reading.sent(label);
                (sent, label.since(sent))
            })
            .collect();
        let usual_s: Vec<f64> =
            travels.iter().zip(readings).map(|((_, travel_s), reading)| travel_s - reading.farther_s()).collect();
        let typical_s = median(usual_s.clone());
        let within = |limit_s: f64| move |usual_s: &&f64| (**usual_s - typical_s).abs() <= limit_s;
        let beyond = travels.len() - usual_s.iter().filter(within(NEAR_SPREAD_S)).count();
        let is_far = beyond as f64 > FAR_SHARE * travels.len() as f64 && beyond > 1;
        let limit_s = if is_far { FAR_SPREAD_S } else { NEAR_SPREAD_S };
        readings
            .iter()
            .zip(travels)
            .zip(&usual_s)
            .filter(|(_, usual_s)| (*usual_s - typical_s).abs() <= limit_s)
            .map(|((reading, (sent, travel_s)), _)| Observed {
                observation: Observation {
                    sample,
                    sv: reading.sv,
                    signal: reading.signal,
                    sent_s: sent.seconds(),
                    sent_fraction_s: sent.fraction(),
                    pseudorange_m: SPEED_OF_LIGHT_MPS * travel_s,
                    carrier_cycles: reading.measurement.carrier_cycles,
                    doppler_hz: reading.measurement.doppler_hz,
                    cn0_dbhz: reading.measurement.cn0_dbhz,
                    locked_s: reading.measurement.locked_s,
                },
                half_cycle_known: reading.measurement.half_cycle_known,
            })
            .collect()
    }

    fn set(&mut self, sample: u64, readings: &[Reading]) {
        if readings.is_empty() {
            return;
        }
        if let Some(start) = self.stated {
            let clock = SampleClock { start, rate: self.rate };
            let label = clock.epoch(sample);
            let travel_s = median(readings.iter().map(|reading| label.since(reading.sent(label))).collect());
            if (travel_s - NEAREST_TRAVEL_S).abs() < BELIEVED_S {
                self.clock = Some(clock);
                return;
            }
        }
        let Some(near) = self.stated_by_message else { return };
        let sent = readings.iter().map(|reading| (reading.sent(near), reading.farther_s()));
        let latest = sent.reduce(|latest, next| if next.0 > latest.0 { next } else { latest });
        let Some((latest, farther_s)) = latest else { return };
        // Whole milliseconds, so that the label is a clock that a person could have set.
        let milliseconds = ((latest.fraction() + NEAREST_TRAVEL_S + farther_s) * 1e3).round();
        let label = Epoch::new(latest.seconds(), milliseconds * 1e-3);
        let (whole, fraction) = self.rate.elapsed(sample);
        let start = Epoch::new(label.seconds() - whole, label.fraction() - fraction);
        self.clock = Some(SampleClock { start, rate: self.rate });
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;

    fn reading(prn: u8, of_week: (i64, f64)) -> Reading {
        let measurement = Measurement {
            sample: 0,
            code_periods: 0,
            code_fraction: 0.0,
            carrier_cycles: 0.0,
            half_cycle_known: true,
            doppler_hz: 0.0,
            cn0_dbhz: 45.0,
            locked_s: 1.0,
            locked: true,
        };
        Reading { sv: Sv::gps(prn), signal: &L1_CA, measurement, sent_of_week: of_week, later_s: 0.0 }
    }

    fn rate() -> Rate {
        Rate::from_hz(2.6e6).unwrap()
    }

    #[test]
    fn a_stated_start_is_believed_within_a_second_and_not_beyond() {
        let start = Epoch::from_week(1590, 1000.0);
        let sent = [reading(1, (999, 0.93)), reading(2, (999, 0.925))];
        let mut near = Timebase::new(rate(), Some(start));
        assert_eq!(near.observe(0, &sent).len(), 2);
        assert_eq!(near.clock().unwrap().start, start);
        let mut far = Timebase::new(rate(), Some(start.plus_s(-5.0)));
        assert!(far.observe(0, &sent).is_empty());
        far.take_time(Epoch::from_week(1590, 960.0));
        // 70 ms to the nearest satellite, in whole milliseconds.
        assert_eq!(far.observe(0, &sent).len(), 2);
        assert!(far.clock().unwrap().start.since(start).abs() < 1e-15);
    }

    #[test]
    fn pseudoranges_are_continuous_across_the_end_of_the_week() {
        let start = Epoch::from_week(1590, 604_799.5);
        let mut clock = Timebase::new(rate(), Some(start));
        let before = clock.observe(0, &[reading(1, (604_799, 0.425))]);
        // Half a second and 20 ms later: one second into the new week less what the travel takes.
        let after = clock.observe(1_352_000, &[reading(1, (604_799, 0.945))]);
        let later = clock.observe(1_560_000, &[reading(1, (0, 0.025))]);
        for observed in [&before, &after, &later] {
            // A tick of the last place of a half second is 1e-16 s, that is 3e-8 m.
            assert!((observed[0].observation.pseudorange_m - 0.075 * SPEED_OF_LIGHT_MPS).abs() < 1e-6);
        }
        assert_eq!(later[0].observation.sent().week(), 1591);
    }

    #[test]
    fn a_satellite_out_of_line_with_the_others_is_left_out() {
        let mut clock = Timebase::new(rate(), Some(Epoch::from_week(1590, 1000.0)));
        let sent =
            [reading(1, (999, 0.93)), reading(2, (999, 0.925)), reading(3, (999, 0.92)), reading(4, (999, 0.86))];
        let used: Vec<u8> = clock.observe(0, &sent).iter().map(|one| one.observation.sv.number).collect();
        assert_eq!(used, vec![1, 2, 3]);
    }
}
