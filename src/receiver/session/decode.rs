//! What the channels' symbols say, and what follows from it for the session.

use super::Session;
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::record::{Event, EventRow};
use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;
use crate::receiver::decode::News;
use crate::receiver::output::{Record, Sink};
use crate::receiver::run::ReceiveError;

impl Session {
    /// Gives every symbol to its decoder and takes in what comes out; `end` is the sample after those that
    /// were followed.
    pub(super) fn decode(&mut self, end: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        for index in 0..self.tracks.len() {
            let near = self.near();
            let Some(track) = self.tracks.get_mut(index) else { continue };
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            let Some(decoder) = &mut track.decoder else { continue };
            let slipped = track.report.events.iter().any(|(_, event)| *event == Event::CycleSlip);
            // The last tick, or where the block ends that had none.
            let sample = track.report.measurements.last().map_or(end.saturating_sub(1), |last| last.sample);
            let mut all = Vec::new();
            for symbol in &track.report.symbols {
                track.symbols += 1;
                all.extend(decoder.take(symbol, near));
            }
            let progress = self.progress.entry(sv).or_default();
            progress.symbols |= track.symbols > 0;
            progress.frame |= decoder.is_synchronised();
            progress.missing = decoder.missing();
            for news in all {
                let event = match news {
                    News::FrameSynchronised => Some(Event::FrameSynchronised),
                    News::Polarity { inverted } => {
                        if !slipped {
                            track.channel.resolve_half_cycle(inverted);
                        }
                        None
                    }
                    News::Contradiction => None,
                    News::Time(time) => {
                        self.timebase.hear(time);
                        None
                    }
                    News::Klobuchar(klobuchar) => {
                        let before = self.klobuchar.replace(klobuchar);
                        (before != Some(klobuchar)).then_some(Event::IonosphereDecoded)
                    }
                    News::Parameters(rows) => {
                        sink.take(Record::Navigation(rows))?;
                        None
                    }
                    News::Ephemeris(ephemeris) => {
                        let sick = ephemeris.health != 0;
                        let before = self.ephemerides.insert(sv, *ephemeris).is_some_and(|set| set.health != 0);
                        sink.take(Record::Event(EventRow { sample, sv, signal, event: Event::EphemerisComplete }))?;
                        match (before, sick) {
                            (false, true) => Some(Event::Unhealthy),
                            (true, false) => Some(Event::Healthy),
                            _ => None,
                        }
                    }
                };
                if let Some(event) = event {
                    sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
                }
            }
        }
        self.drop_echoes();
        Ok(())
    }

    /// The time near which weeks are resolved.
    fn near(&self) -> Epoch {
        self.timebase.clock().map(|clock| clock.start).or(self.metadata.start).unwrap_or(self.week_reference)
    }

    /// Two satellites never send the same orbit: the weaker is the other's cross-correlation.
    fn drop_echoes(&mut self) {
        let content = |e: &Ephemeris| {
            [e.sqrt_a_sqrtm, e.m0_rad, e.omega0_rad, e.omega_rad, e.eccentricity, e.af0_s].map(f64::to_bits)
        };
        let known: Vec<(usize, Sv, f64, [u64; 6])> = self
            .tracks
            .iter()
            .enumerate()
            .filter_map(|(index, track)| {
                let ephemeris = self.ephemerides.get(&track.channel.sv())?;
                Some((index, track.channel.sv(), track.cn0_dbhz, content(ephemeris)))
            })
            .collect();
        for (place, a) in known.iter().enumerate() {
            for b in known.iter().skip(place + 1) {
                if a.1 != b.1 && a.3 == b.3 {
                    let weaker = if a.2 < b.2 { a } else { b };
                    self.ephemerides.remove(&weaker.1);
                    if let Some(track) = self.tracks.get_mut(weaker.0) {
                        track.dropped = true;
                    }
                }
            }
        }
    }
}
