//! Observables at common epochs: what a channel's replica reads, in metres, cycles and hertz.
//!
//! The time sent is an exact count of code periods since the week began and a fraction of one, never one number of seconds.
//! The receiver labels samples with its own clock: as the recording says if that agrees with the satellites
//! to a second, otherwise so that the nearest satellite is about 70 ms away. Satellites whose time of sending is out of line
//! with the others' (a wrong bit edge or code period of another) are left out.

use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::record::Observation;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;
use crate::gnss::time::{Epoch, Rate, SampleClock, WEEK_S};
use crate::receiver::decode::Decoder;
use crate::receiver::track::Measurement;

/// Travel time to the nearest satellite that is assumed when the clock is set from satellites alone.
const NEAREST_TRAVEL_S: f64 = 0.070;
/// From near the Earth, travel times lie between 60 and 95 ms.
const LARGEST_SPREAD_S: f64 = 0.035;
/// The recording's start time is believed when it is this near.
const BELIEVED_S: f64 = 1.0;

/// One channel at one tick.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    pub sv: Sv,
    pub signal: &'static Signal,
    pub measurement: Measurement,
    /// Time of week sent: whole seconds and a fraction.
    pub sent_of_week: (i64, f64),
}

impl Reading {
    /// What a locked channel with a known frame reads.
    pub fn new(sv: Sv, signal: &'static Signal, measurement: &Measurement, decoder: &Decoder) -> Option<Self> {
        if !measurement.locked {
            return None;
        }
        let sent_of_week = decoder.time_of_week(measurement.code_periods, measurement.code_fraction)?;
        Some(Self { sv, signal, measurement: *measurement, sent_of_week })
    }

    /// The time sent, in the week that brings it nearest to `near`.
    fn sent(&self, near: Epoch) -> Epoch {
        let (whole, fraction) = self.sent_of_week;
        let ahead = whole - near.tow_whole_s();
        let weeks = if ahead > WEEK_S / 2 {
            -1
        } else if ahead < -WEEK_S / 2 {
            1
        } else {
            0
        };
        Epoch::new((near.week() + weeks) * WEEK_S + whole, fraction)
    }
}

/// An observation, and whether its carrier is known to the half cycle.
#[derive(Clone, Debug)]
pub struct Observed {
    pub observation: Observation,
    pub half_cycle_known: bool,
}

/// The receiver's own clock.
#[derive(Clone, Debug)]
pub struct Timebase {
    rate: Rate,
    stated: Option<Epoch>,
    clock: Option<SampleClock>,
    heard: Option<Epoch>,
}

impl Timebase {
    /// A clock that has read nothing but the recording's metadata.
    pub fn new(rate: Rate, stated: Option<Epoch>) -> Self {
        Self { rate, stated, clock: None, heard: None }
    }

    /// What labels samples, once it is set.
    pub fn clock(&self) -> Option<SampleClock> {
        self.clock
    }

    /// Takes a time that a satellite's message says, right within half a week.
    pub fn hear(&mut self, time: Epoch) {
        self.heard.get_or_insert(time);
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
        let typical_s = median(travels.iter().map(|travel| travel.1).collect());
        readings
            .iter()
            .zip(travels)
            .filter(|(_, (_, travel_s))| (travel_s - typical_s).abs() <= LARGEST_SPREAD_S)
            .map(|(reading, (sent, travel_s))| Observed {
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
        let Some(near) = self.heard else { return };
        let sent = readings.iter().map(|reading| reading.sent(near));
        let Some(latest) = sent.reduce(|latest, sent| if sent > latest { sent } else { latest }) else { return };
        // Whole milliseconds, so that the label is a clock that a person could have set.
        let milliseconds = ((latest.fraction() + NEAREST_TRAVEL_S) * 1e3).round();
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
