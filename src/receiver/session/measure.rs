//! Observations and a fix at one tick.

use super::{Session, WRONG_TIME_FIXES};
use crate::gnss::record::Observation;
use crate::receiver::observe::Reading;
use crate::receiver::output::{Record, Sink};
use crate::receiver::run::ReceiveError;

/// Residuals beyond this are no noise: the channel has the wrong time.
const WRONG_TIME_M: f64 = 10_000.0;

impl Session {
    /// Observes and solves at one tick.
    pub(super) fn measure(&mut self, tick: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let readings: Vec<Reading> = self
            .tracks
            .iter()
            .filter(|track| !track.dropped)
            .filter_map(|track| {
                let measurement = track.report.measurements.iter().find(|measurement| measurement.sample == tick)?;
                Reading::new(track.channel.sv(), track.channel.signal(), measurement, track.decoder.as_ref()?)
            })
            .collect();
        let observed = self.timebase.observe(tick, &readings);
        for one in observed.iter().filter(|one| one.half_cycle_known) {
            sink.take(Record::Observation(one.observation.clone()))?;
        }
        let Some(clock) = self.timebase.clock() else { return Ok(()) };
        let observations: Vec<Observation> = observed.into_iter().map(|one| one.observation).collect();
        match self.solver.solve(tick, clock, &observations, &self.ephemerides, self.klobuchar) {
            Ok(solved) => {
                if self.clock_jumped(&solved.fix, sink)? {
                    return Ok(());
                }
                sink.take(Record::Fix(solved.fix.clone()))?;
                sink.take(Record::Clocks(solved.clocks))?;
                let condition = solved.fix.condition;
                self.worst_condition = Some(self.worst_condition.map_or(condition, |worst| worst.max(condition)));
                self.fixes += 1;
                self.clock_drift = Some(solved.fix.clock_drift);
                let at_s = self.metadata.rate.elapsed_s(tick);
                self.first_fix_s.get_or_insert(at_s);
                self.used.extend(solved.used);
                for track in &mut self.tracks {
                    let sv = track.channel.sv();
                    let wrong = solved.excluded.iter().any(|(out, miss_m)| *out == sv && miss_m.abs() > WRONG_TIME_M);
                    track.wrong_time = if wrong { track.wrong_time + 1 } else { 0 };
                    track.dropped |= track.wrong_time >= WRONG_TIME_FIXES;
                }
            }
            Err(reason) => self.reason = Some(reason),
        }
        Ok(())
    }
}
