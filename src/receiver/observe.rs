//! Measurements of channels become observations: times sent, pseudoranges, carriers.
//!
//! The time sent is an integer count of code periods since a decoded instant and the fraction of the running
//! period; it never passes through one floating-point number of seconds.

use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::record::Observation;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;
use crate::gnss::time::{Epoch, SampleClock, WEEK_S};
use crate::receiver::decode::TimeTag;
use crate::receiver::track::Measurement;

/// Light time that the receiver's clock is set with when nothing else is known.
const TYPICAL_LIGHT_TIME_S: f64 = 0.070;
/// A start time that disagrees with the satellites by more is not believed.
const LARGEST_START_ERROR_S: f64 = 1.0;

/// When the signal at a measurement was sent, by the satellite's clock; `near` tells the week.
pub fn sent(measurement: &Measurement, tag: TimeTag, signal: &Signal, near: Epoch) -> Option<Epoch> {
    let component = signal.components.first()?;
    // Chips since the tagged period, in integers: a second is a whole number of chips for every signal.
    let chips = (measurement.code_periods as i64 - tag.period as i64) * i64::from(component.code_chips);
    let rate = component.chip_rate_hz as i64;
    let (seconds, rest) = (chips.div_euclid(rate), chips.rem_euclid(rate));
    let fraction = (rest as f64 + measurement.code_fraction * f64::from(component.code_chips)) / component.chip_rate_hz;
    let second_of_week = tag.second_of_week + seconds;
    let week = (near.seconds() - second_of_week + WEEK_S / 2).div_euclid(WEEK_S);
    Some(Epoch::new(week * WEEK_S + second_of_week, fraction))
}

/// The receiver's clock: what it reads at each sample.
///
/// It starts at the recording's own start time if the satellites agree with that to a second, and is else set
/// so that the first satellites decoded are 70 ms away, to the millisecond.
pub fn set_clock(described: SampleClock, known: bool, sample: u64, sent: &[Epoch]) -> Option<SampleClock> {
    let nearest = sent.iter().copied().reduce(|a, b| if a.since(b) > 0.0 { a } else { b })?;
    let light_time_s = described.epoch(sample).since(nearest);
    if known && (light_time_s - TYPICAL_LIGHT_TIME_S).abs() < LARGEST_START_ERROR_S {
        return Some(described);
    }
    let shift_ms = ((TYPICAL_LIGHT_TIME_S - light_time_s) * 1000.0).round();
    Some(SampleClock { start: described.start.plus_s(shift_ms / 1000.0), rate: described.rate })
}

/// The observation that a measurement makes when the receiver's clock reads `reading`.
pub fn observation(
    measurement: &Measurement,
    sv: Sv,
    signal: &'static Signal,
    sent: Epoch,
    reading: Epoch,
) -> Observation {
    Observation {
        sample: measurement.sample,
        sv,
        signal,
        sent_s: sent.seconds(),
        sent_fraction_s: sent.fraction(),
        pseudorange_m: reading.since(sent) * SPEED_OF_LIGHT_MPS,
        carrier_cycles: measurement.carrier_cycles,
        doppler_hz: measurement.doppler_hz,
        cn0_dbhz: measurement.cn0_dbhz,
        locked_s: measurement.locked_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::gps::l1ca::L1_CA;
    use crate::gnss::time::Rate;

    fn measurement(code_periods: u64, code_fraction: f64) -> Measurement {
        Measurement {
            sample: 0,
            code_periods,
            code_fraction,
            carrier_cycles: 0.0,
            half_cycle_known: true,
            doppler_hz: 0.0,
            cn0_dbhz: 45.0,
            locked_s: 10.0,
            locked: true,
        }
    }

    #[test]
    fn time_sent_counts_periods_over_the_week_s_end() {
        let tag = TimeTag { period: 500, second_of_week: WEEK_S - 6 };
        let near = Epoch::new(1590 * WEEK_S + 3, 0.0);
        let time = sent(&measurement(500 + 6_001, 0.25), tag, &L1_CA, near).unwrap();
        assert_eq!(time.seconds(), 1590 * WEEK_S);
        // 1.25 ms to the ulp of a millisecond.
        assert!((time.fraction() - 1.25e-3).abs() < 2.2e-19 * 2.0);
        let before = sent(&measurement(499, 0.5), tag, &L1_CA, near).unwrap();
        assert!((before.since(Epoch::new(1590 * WEEK_S - 6, 0.0)) + 0.5e-3).abs() < 2e-16);
    }

    #[test]
    fn the_clock_is_the_recording_s_if_satellites_agree_and_else_set_to_seventy_milliseconds() {
        let rate = Rate::from_hz(1e6).unwrap();
        let start = Epoch::new(1_000_000_000, 0.25);
        let described = SampleClock { start, rate };
        let sent = [start.plus_s(1.0 - 0.080), start.plus_s(1.0 - 0.068)];
        assert_eq!(set_clock(described, true, 1_000_000, &sent), Some(described));
        let far = sent.map(|epoch| epoch.plus_s(3600.0));
        let set = set_clock(described, true, 1_000_000, &far).unwrap();
        assert!((set.epoch(1_000_000).since(far[1]) - 0.070).abs() < 0.5e-3);
        assert_eq!(set_clock(described, true, 0, &[]), None);
    }
}
