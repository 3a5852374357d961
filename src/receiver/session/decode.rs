//! What the channels' symbols say, and what follows from it for the session.

use super::step::Counted;
use super::{FrontEnd, Session, Shared, Track};
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::record::{Event, EventRow};
use crate::gnss::satellite::Sv;
use crate::receiver::decode::News;
use crate::receiver::outcome::ReceiveError;
use crate::receiver::output::{Record, Sink};
use crate::receiver::source::Packed;

impl Session {
    /// Gives the symbols of all front ends, which were followed through `blocks`, to their decoders.
    pub(super) fn decode(&mut self, blocks: &[Packed], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        for (front_end, block) in self.front_ends.iter_mut().zip(blocks) {
            front_end.decode(block.end(), &mut self.shared, sink)?;
        }
        self.drop_echoes();
        Ok(())
    }

    /// Two satellites never send the same orbit: the weaker is the other's cross-correlation.
    fn drop_echoes(&mut self) {
        let content = |e: &Ephemeris| {
            [e.sqrt_a_sqrtm, e.m0_rad, e.omega0_rad, e.omega_rad, e.eccentricity, e.af0_s].map(f64::to_bits)
        };
        let ephemerides = &mut self.shared.ephemerides;
        let mut tracks: Vec<&mut Track> =
            self.front_ends.iter_mut().flat_map(|front_end| front_end.tracks.iter_mut()).collect();
        let known: Vec<(usize, Sv, f64, [u64; 6])> = tracks
            .iter()
            .enumerate()
            .filter_map(|(index, track)| {
                let ephemeris = ephemerides.get(&track.channel.sv())?;
                Some((index, track.channel.sv(), track.cn0_dbhz, content(ephemeris)))
            })
            .collect();
        for (place, a) in known.iter().enumerate() {
            for b in known.iter().skip(place + 1) {
                if a.1 != b.1 && a.3 == b.3 {
                    let weaker = if a.2 < b.2 { a } else { b };
                    ephemerides.remove(&weaker.1);
                    if let Some(track) = tracks.get_mut(weaker.0) {
                        track.dropped = true;
                    }
                }
            }
        }
    }
}

impl FrontEnd {
    /// Gives every symbol to its decoder and takes in what comes out; `end` is the sample after those that
    /// were followed.
    fn decode(&mut self, end: u64, shared: &mut Shared, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let sink = &mut Counted { sink, step: self.step, ticks: &[] };
        for track in &mut self.tracks {
            let near = shared.near();
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
            let progress = shared.progress.entry(sv).or_default();
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
                        shared.timebase.take_time(time);
                        None
                    }
                    News::Klobuchar(klobuchar) => {
                        let before = shared.klobuchar.replace(klobuchar);
                        (before != Some(klobuchar)).then_some(Event::IonosphereDecoded)
                    }
                    News::Parameters(rows) => {
                        sink.take(Record::Navigation(rows))?;
                        None
                    }
                    News::AheadOfGps { scale, ahead } => {
                        shared.solver.take_ahead(scale, ahead);
                        None
                    }
                    News::Reduced { set, with_delays } => {
                        let serves = shared.solver.take_reduced(*set, with_delays);
                        (serves && !shared.ephemerides.contains_key(&sv)).then_some(Event::ReducedElements)
                    }
                    News::Ephemeris(ephemeris) => {
                        let sick = !ephemeris.is_healthy();
                        let before = shared.ephemerides.insert(sv, *ephemeris).is_some_and(|set| !set.is_healthy());
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
        Ok(())
    }
}
