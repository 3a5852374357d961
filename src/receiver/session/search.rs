//! When satellites are searched for, which channels a search starts, and which channels end.

use std::collections::BTreeSet;

use super::{Session, Track, WRONG_TIME_FIXES, Window};
use crate::gnss::record::{Event, EventRow};
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;
use crate::receiver::decode::Decoder;
use crate::receiver::output::Output;
use crate::receiver::parting::Line;
use crate::receiver::run::ReceiveError;
use crate::receiver::source::{Block, Packed, Planes};
use crate::receiver::track::{Channel, Report};

/// A satellite that was lost is searched for eagerly so long.
const EAGER_S: f64 = 30.0;
/// A channel that was dropped for what it said is not followed again so long.
const REFUSED_S: f64 = 120.0;
/// A C/A code shows 21 dB down in another's correlator; what is this much weaker than the strongest is not followed when
/// it was found beside tracked satellites. A search cannot tell it from an echo.
const ECHO_DB: f64 = 20.0;

impl Session {
    /// Collects samples while a search is due, searches when there are enough, starts channels.
    pub(super) fn search(&mut self, block: &Packed, output: &mut Output) -> Result<(), ReceiveError> {
        let end = block.end();
        if self.window.is_none() {
            if end <= self.next_search {
                return Ok(());
            }
            self.aim(self.sweep())?;
            self.window = Some(Window { first: block.first, samples: Planes::default() });
        }
        let Some(window) = &mut self.window else { return Ok(()) };
        let missing = (self.needed as usize).saturating_sub(window.samples.i.len());
        let mut planes = Planes::default();
        let samples = block.unpack(0..missing, &mut planes);
        window.samples.i.extend_from_slice(samples.i);
        window.samples.q.extend_from_slice(samples.q);
        if (window.samples.i.len() as u64) < self.needed {
            return Ok(());
        }
        let Some(window) = self.window.take() else { return Ok(()) };
        self.refused.retain(|_, until| *until > end);
        let followed: BTreeSet<(&'static Signal, Sv)> =
            self.tracks.iter().map(|track| (track.channel.signal(), track.channel.sv())).collect();
        // Satellites that are followed are searched for too: without them their cross-correlation
        // would pass for others.
        let all_found = self.candidates.iter().all(|candidate| followed.contains(candidate));
        if !all_found {
            let strongest_dbhz = self.tracks.iter().map(|track| track.cn0_dbhz).fold(f64::NEG_INFINITY, f64::max);
            let searched = Block { first: window.first, i: &window.samples.i, q: &window.samples.q };
            let results = self.searcher.search(&searched, &self.candidates)?;
            self.look(&results, end);
            for (mut row, hit) in results {
                row.acquired &= hit.is_some_and(|hit| hit.cn0_dbhz > strongest_dbhz - ECHO_DB);
                let key = (row.signal, row.sv);
                if followed.contains(&key) || self.refused.contains_key(&key) {
                    continue;
                }
                if self.strongest.is_none_or(|(_, best, _)| row.statistic > best) {
                    self.strongest = Some((row.sv, row.statistic, row.threshold));
                }
                // Of later searches only what was found says anything new.
                if row.acquired || !self.searched {
                    output.acquisition(&row)?;
                }
                let Some(hit) = hit.filter(|hit| hit.cn0_dbhz > strongest_dbhz - ECHO_DB) else { continue };
                self.acquired.insert(hit.sv);
                self.lost.remove(&key);
                self.progress.entry(hit.sv).or_default();
                output.event(&EventRow {
                    sample: hit.sample,
                    sv: hit.sv,
                    signal: hit.signal,
                    event: Event::Acquired,
                })?;
                let mut channel = Channel::start(&hit, &self.metadata, &self.settings.tracking);
                channel.set_carrier_offset(self.offset.hz());
                self.tracks.push(Track {
                    channel,
                    line: Line::default(),
                    decoder: Decoder::new(hit.signal, hit.sv),
                    report: Report::default(),
                    since: block.first,
                    cn0_dbhz: hit.cn0_dbhz,
                    symbols: 0,
                    wrong_time: 0,
                    dropped: false,
                });
            }
            self.tracks.sort_by_key(|track| (track.channel.signal(), track.channel.sv()));
        }
        self.searched = true;
        self.widen();
        self.plan_search(end);
        Ok(())
    }

    fn plan_search(&mut self, now: u64) {
        let eager = self.samples(EAGER_S);
        self.lost.retain(|_, since| now < *since + eager);
        let operation = &self.settings.operation;
        let wait_s =
            if self.lost.is_empty() { operation.search_interval_s } else { operation.reacquisition_interval_s };
        self.next_search = now + self.samples(wait_s).max(1);
    }

    /// Takes away channels that lost their signal, say what cannot be, or lead nowhere.
    pub(super) fn retire(&mut self, now: u64, output: &mut Output) -> Result<(), ReceiveError> {
        let limit = self.samples(self.settings.operation.frame_limit_s);
        let refused = now + self.samples(REFUSED_S);
        let mut gone = false;
        let mut kept = Vec::with_capacity(self.tracks.len());
        for track in std::mem::take(&mut self.tracks) {
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            let synchronised = track.decoder.as_ref().is_some_and(Decoder::is_synchronised);
            let fruitless = !synchronised && now > track.since + limit;
            if track.channel.is_lost() {
                self.lost.insert((signal, sv), now);
            } else if track.dropped || fruitless {
                let event = Event::LossOfLock;
                output.event(&EventRow { sample: now.saturating_sub(1), sv, signal, event })?;
                // A wrong time may come right when the satellite is acquired anew; an echo does not.
                if track.wrong_time < WRONG_TIME_FIXES {
                    self.refused.insert((signal, sv), refused);
                }
                self.lost.insert((signal, sv), now);
            } else {
                kept.push(track);
                continue;
            }
            gone = true;
            self.losses += 1;
        }
        self.tracks = kept;
        if gone && self.window.is_none() {
            let soon = now + self.samples(self.settings.operation.reacquisition_interval_s).max(1);
            self.next_search = self.next_search.min(soon);
        }
        Ok(())
    }
}
