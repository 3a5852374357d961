//! Decoding of the channels' symbols, tick by tick.

use super::hear::Hearing;
use super::step::Counted;
use super::{FrontEnd, Session, Shared, Track};
use crate::outcome::ReceiveError;
use crate::output::Sink;
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
        for Track { channel, decoder, report, symbols, .. } in &mut self.tracks {
            let Some(decoder) = decoder else { continue };
            shared.hear(Hearing { channel, decoder, report, symbols }, (until, step), sink)?;
        }
        Ok(())
    }
}
