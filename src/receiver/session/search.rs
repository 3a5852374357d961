//! When satellites are searched for, which channels a search starts, and which channels end.

use std::collections::BTreeSet;

use super::gap::Watched;
use super::predict::Near;
use super::shared::Shared;
use super::step::Counted;
use super::{FrontEnd, Track, WRONG_TIME_FIXES, Window, suited};
use crate::acquire::{AcquireError, Acquired, Searcher};
use crate::decode::Decoder;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use crate::parting::Line;
use crate::source::{Gathered, Packed};
use crate::track::{Channel, Report};
use gnss::record::{AcquisitionRow, Event, EventRow};
use gnss::satellite::Sv;
use gnss::signal::Link;

/// A satellite that was lost is searched for eagerly so long.
const EAGER_S: f64 = 30.0;
/// A channel that was dropped for what it said is not followed again so long.
const REFUSED_S: f64 = 120.0;

impl FrontEnd {
    /// Collects samples while a search is due, searches when there are enough, starts channels.
    pub(super) fn search(
        &mut self,
        block: &Packed,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let end = block.end();
        if self.signals.is_empty() {
            return Ok(());
        }
        if self.window.is_none() {
            let Some(near) = self.due(block, shared)? else { return Ok(()) };
            self.window = Some(Window { samples: Gathered::from(block), near });
        }
        let Some(window) = &mut self.window else { return Ok(()) };
        if !window.samples.take(block, self.needed as usize) {
            return Ok(());
        }
        let Some(window) = self.window.take() else { return Ok(()) };
        self.refused.retain(|_, until| *until > end);
        if let Some((near, half_hz)) = &window.near {
            let results = self.searcher.search_near(&window.stretch(), near, *half_hz)?;
            self.note_missed(&results, end, shared);
            let (believed, doubted) = self.believed(results);
            if doubted {
                self.next_search = self.next_search.min(end);
            }
            return self.start_channels(believed, block.first, shared, sink);
        }
        // Satellites that are followed are searched for too, or taken out of the samples: without that their
        // cross-correlation would pass for others.
        let known = self.known(shared);
        let mut sought = suited::distinct(&self.candidates);
        // The first search shows all that there is.
        sought.retain(|link| !self.searched || !Self::is_led(*link, shared));
        let is_followed = |link: &Link| self.tracks.iter().any(|track| track.channel.link().is_alike(*link));
        if !sought.iter().all(is_followed) {
            sought.retain(|link| !known.iter().any(|one| one.link().is_alike(*link)));
            let results = self.searcher.search_stretch(&window.stretch(), &sought, &known)?;
            self.look(&results, end, shared);
            self.start_channels(results, block.first, shared, sink)?;
        }
        self.searched = true;
        self.widen(shared);
        self.plan_search(end);
        if self.follow_sky(shared) {
            self.next_search = end;
        }
        Ok(())
    }

    /// Where the satellites are that are followed beyond doubt; none before there was a fix, while searches
    /// may still say that the samples are not what they seem, and none while codes are not where they were
    /// to be.
    fn known(&self, shared: &Shared) -> Vec<Acquired> {
        let trusted = shared.fixes > 0 && !self.gap.is_busy();
        let settled = self.tracks.iter().filter(|track| trusted && track.channel.is_settled());
        let place = |track: &Track| {
            let (link, phases) = (track.channel.link(), track.channel.phases());
            Acquired {
                sv: link.sv,
                signal: link.signal,
                sample: phases.sample,
                code_phase_chips: phases.chips,
                doppler_hz: track.channel.doppler_hz(),
                cn0_dbhz: track.cn0_dbhz,
            }
        };
        settled.map(place).collect()
    }

    /// Whether a search begins with this block: one for all, or one for the satellites that are foreseen.
    fn due(&mut self, block: &Packed, shared: &Shared) -> Result<Option<Option<Near>>, AcquireError> {
        if block.end() > self.next_search {
            self.aim(self.sweep(shared))?;
            return Ok(Some(None));
        }
        if block.end() <= self.next_foreseen {
            return Ok(None);
        }
        self.next_foreseen = block.end() + self.foreseen_wait();
        let near = self.foreseen(block.first, shared);
        Ok((!near.0.is_empty()).then_some(Some(near)))
    }

    /// Searches a recording that ended before the first search had all the samples that it asks for: by fewer
    /// sums, and by sums of one code period where there is no room for another. A signal for which there is
    /// no room at all is left out.
    pub(super) fn search_rest(&mut self, shared: &mut Shared, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let sink = &mut Counted { sink, step: self.step, ticks: &[] };
        let Some(window) = self.window.take().filter(|_| !self.searched) else { return Ok(()) };
        let packed = window.samples.packed();
        let have = packed.samples() as u64;
        let mut searcher = Searcher::fitted(&self.metadata, &self.settings.acquisition, have)?;
        let mut sought = Vec::new();
        for link in suited::distinct(&self.candidates) {
            sought.extend(searcher.has_room(link.signal)?.then_some(link));
        }
        if sought.is_empty() && !self.candidates.is_empty() {
            return Ok(());
        }
        let results = searcher.search_stretch(&window.stretch(), &sought, &[])?;
        self.start_channels(results, packed.first, shared, sink)?;
        self.searched = true;
        Ok(())
    }

    /// Records what a search came to, and starts channels on what it found.
    fn start_channels(
        &mut self,
        results: Vec<(AcquisitionRow, Option<Acquired>)>,
        since: u64,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let followed: BTreeSet<Link> = self.tracks.iter().map(|track| track.channel.link()).collect();
        for (row, hit) in results {
            let sv = self.likeliest(row.link(), shared);
            let (row, hit) = (AcquisitionRow { sv, ..row }, hit.map(|hit| Acquired { sv, ..hit }));
            let key = row.link();
            // What is alike cannot be told apart by a search.
            let is_followed = followed.iter().any(|other| other.is_alike(key));
            if is_followed || self.refused.contains_key(&key) {
                continue;
            }
            if shared.strongest.is_none_or(|(_, best, threshold)| row.statistic * threshold > best * row.threshold) {
                shared.strongest = Some((row.sv, row.statistic, row.threshold));
            }
            // Of later searches only what was found says anything new.
            if row.acquired || !self.searched {
                sink.take(Record::Acquisition(row.clone()))?;
            }
            let Some(hit) = hit else { continue };
            shared.acquired.insert(hit.sv);
            self.lost.remove(&key);
            shared.progress.entry(hit.sv).or_default();
            sink.take(Record::Event(EventRow {
                sample: hit.sample,
                sv: hit.sv,
                signal: hit.signal,
                event: Event::Acquired,
            }))?;
            let mut channel = Channel::start(&hit, &self.metadata, &self.settings.tracking);
            channel.set_carrier_offset(self.offset.hz());
            self.tracks.push(Track {
                channel,
                line: Line::default(),
                watched: Watched::default(),
                decoder: Decoder::new(hit.signal, hit.sv),
                report: Report::default(),
                since,
                cn0_dbhz: hit.cn0_dbhz,
                found_dbhz: hit.cn0_dbhz,
                found_hz: hit.doppler_hz,
                symbols: 0,
                wrong_time: 0,
                dropped: false,
            });
        }
        self.tracks.sort_by_key(|track| track.channel.link());
        Ok(())
    }

    /// Whose signal it is that was found, of satellites that a search cannot tell apart: of one whose
    /// elements are known, or else, until its message says more, of the one that was searched for.
    fn likeliest(&self, found: Link, shared: &Shared) -> Sv {
        let is_known = |link: &&Link| !shared.ephemerides.of(link.sv).is_empty();
        let alike = |link: &&Link| found.channel().is_some() && link.is_alike(found);
        if is_known(&&found) {
            return found.sv;
        }
        self.candidates.iter().filter(alike).find(is_known).map_or(found.sv, |link| link.sv)
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
    pub(super) fn retire(&mut self, now: u64, shared: &mut Shared, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let limit = self.samples(self.settings.operation.frame_limit_s);
        let refused = now + self.samples(REFUSED_S);
        let mut gone = false;
        let mut kept = Vec::with_capacity(self.tracks.len());
        for track in std::mem::take(&mut self.tracks) {
            let link = track.channel.link();
            let Link { sv, signal } = link;
            let synchronised = track.decoder.as_ref().is_some_and(Decoder::has_units);
            let fruitless = !synchronised && now > track.since + limit;
            self.missed.remove(&link);
            if track.channel.is_lost() {
                self.lost.insert(link, now);
            } else if track.dropped || fruitless {
                let event = Event::LossOfLock;
                sink.take(Record::Event(EventRow { sample: now.saturating_sub(1), sv, signal, event }))?;
                // A wrong time may come right when the satellite is acquired anew; an echo does not.
                if track.wrong_time < WRONG_TIME_FIXES {
                    self.refused.insert(link, refused);
                }
                self.lost.insert(link, now);
            } else {
                kept.push(track);
                continue;
            }
            gone = true;
            shared.losses += 1;
        }
        self.tracks = kept;
        if gone && self.window.is_none() {
            let soon = now + self.samples(self.settings.operation.reacquisition_interval_s).max(1);
            self.next_search = self.next_search.min(soon);
            self.next_foreseen = self.next_foreseen.min(now + self.foreseen_wait());
        }
        Ok(())
    }
}
