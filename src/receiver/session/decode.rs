//! Decoding of the channels' symbols, and the effects on the session.

use super::step::Counted;
use super::{FrontEnd, Session, Shared, Track};
use crate::authentic::Authentic;
use crate::decode::News;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use gnss::broadcast::Ephemeris;
use gnss::record::{Event, EventRow};
use gnss::satellite::Sv;

impl Session {
    /// Gives the decoders the symbols that ended by a tick of the running block, or all that are left of it.
    /// A measurement at a tick knows no message of later samples, however long the blocks are.
    pub(super) fn decode(&mut self, tick: Option<u64>, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        for front_end in &mut self.front_ends {
            let own = tick.map(|main| {
                let known = front_end.ticks.iter().find(|tick| tick.main == main);
                known.map_or_else(|| front_end.step.own(main), |tick| tick.own)
            });
            front_end.decode(own.unwrap_or(u64::MAX), &mut self.shared, sink)?;
        }
        self.drop_echoes();
        if let Some(authentic) = &mut self.shared.authentic {
            authentic.verify(sink)?;
        }
        Ok(())
    }

    /// Two satellites never send the same orbit: the weaker is the other's cross-correlation.
    fn drop_echoes(&mut self) {
        let ephemerides = &mut self.shared.ephemerides;
        let mut tracks: Vec<&mut Track> =
            self.front_ends.iter_mut().flat_map(|front_end| front_end.tracks.iter_mut()).collect();
        let known: Vec<(usize, Sv, f64, [u64; 5])> = tracks
            .iter()
            .enumerate()
            .filter_map(|(index, track)| {
                let ephemeris = ephemerides.of(track.channel.sv()).first()?;
                Some((index, track.channel.sv(), track.cn0_dbhz, ephemeris.orbit_bits()))
            })
            .collect();
        for (place, a) in known.iter().enumerate() {
            for b in known.iter().skip(place + 1) {
                if a.1 != b.1 && a.3 == b.3 {
                    let weaker = if a.2 < b.2 { a } else { b };
                    ephemerides.remove(weaker.1);
                    if let Some(track) = tracks.get_mut(weaker.0) {
                        track.dropped = true;
                    }
                }
            }
        }
    }
}

impl FrontEnd {
    /// Gives every symbol that ended before the sample `until` to its decoder and takes in what comes out.
    fn decode(&mut self, until: u64, shared: &mut Shared, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let step = self.step;
        let sink = &mut Counted { sink, step, ticks: &[] };
        for track in &mut self.tracks {
            let (near, known) = (shared.near(), shared.known());
            let (mut sv, signal) = (track.channel.sv(), track.channel.signal());
            let Some(decoder) = &mut track.decoder else { continue };
            // A position of verified data alone takes nothing that no tag covers.
            let all_data = !shared.authentic.as_ref().is_some_and(Authentic::is_required);
            known.into_iter().for_each(|known| decoder.know(known));
            let slipped = track.report.events.iter().any(|(_, event)| *event == Event::CycleSlip);
            let mut all = Vec::new();
            let ended = track.report.symbols.partition_point(|symbol| symbol.end <= until);
            for symbol in track.report.symbols.drain(..ended) {
                track.symbols += 1;
                all.extend(decoder.take(&symbol, near).into_iter().map(|news| (symbol.end, news)));
            }
            let progress = shared.progress.entry(sv).or_default();
            progress.symbols |= track.symbols > 0;
            progress.frame |= decoder.is_synchronised();
            if !decoder.is_dated_elsewhere() {
                progress.missing = decoder.missing();
            }
            for (sample, news) in all {
                let event = match news {
                    News::FrameSynchronised => Some(Event::FrameSynchronised),
                    News::Polarity { inverted } => {
                        if !slipped {
                            track.channel.resolve_half_cycle(inverted);
                        }
                        None
                    }
                    News::Contradiction => {
                        shared.refuse(sv, "the time of a unit contradicts that of those before it".to_owned());
                        None
                    }
                    News::Refused(why) => {
                        shared.refuse(sv, why);
                        None
                    }
                    News::Time(time) => {
                        shared.timebase.take_time(time);
                        None
                    }
                    // Of several models the receiver takes one.
                    News::Ionosphere(sent) if shared.ionosphere_model == Some(sent.model()) => {
                        let before = shared.ionosphere.replace(sent);
                        (before != Some(sent)).then_some(Event::IonosphereDecoded)
                    }
                    News::Ionosphere(_) => None,
                    News::Sender(other) => {
                        // Another of those that are alike was found: what follows is of it.
                        shared.rename(sv, other);
                        track.channel.rename(other);
                        sv = other;
                        Some(Event::Identified)
                    }
                    News::Page(page) => {
                        if let Some(authentic) = &mut shared.authentic {
                            authentic.take(sv, step.main(sample), page);
                        }
                        None
                    }
                    News::Parameters(rows) => {
                        sink.take(Record::Navigation(rows))?;
                        None
                    }
                    News::Augmentation { sent, content } => {
                        if all_data {
                            shared.solver.take_augmentation(sv, sent, &content);
                        }
                        None
                    }
                    News::AheadOfGps { scale, ahead } => {
                        if all_data {
                            shared.solver.take_ahead(scale, ahead);
                        }
                        None
                    }
                    News::Reduced { set, with_delays } => {
                        let serves = all_data && shared.solver.take_reduced(*set, with_delays);
                        (serves && shared.ephemerides.of(sv).is_empty()).then_some(Event::ReducedElements)
                    }
                    News::Ephemeris(ephemeris) => {
                        // What was refused on the way to it has done no harm.
                        shared.refused.remove(&sv);
                        let is_sick = |set: &Ephemeris| set.is_healthy_on(signal) == Some(false);
                        let sick = is_sick(&ephemeris);
                        let before = shared.ephemerides.insert(*ephemeris).as_ref().is_some_and(is_sick);
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
