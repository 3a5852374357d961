//! Times of the searches, and the channels that a search starts or ends.

use std::collections::BTreeSet;

use super::gap::Watched;
use super::plan::{WIDEN_S, WIDTHS};
use super::predict::Near;
use super::shared::Shared;
use super::step::Counted;
use super::{FrontEnd, Track, WRONG_TIME_FIXES, Window, suited};
use crate::acquire::{
    AcquireError, Acquired, AcquisitionSettings, MOST_DOPPLER_HZ, MOST_SUMS, Searcher, samples_needed,
};
use crate::decode::Decoder;
use crate::lead::lead;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use crate::parting::Line;
use crate::position::least_squares::UNKNOWNS;
use crate::source::{Gathered, Stretch};
use crate::track::shape::Shape;
use crate::track::{Channel, Report};
use gnss::record::{AcquisitionRow, Event, EventRow};
use gnss::satellite::Sv;
use gnss::signal::Link;

/// A satellite that was lost is searched for eagerly so long.
const EAGER_S: f64 = 30.0;
/// A channel that was dropped for what it said is not followed again so long.
const REFUSED_S: f64 = 120.0;
/// First samples of a recording that are kept for a search at its end, if it is a short one: three times as
/// many as the first search of C/A takes, which finds what is 3 dB weaker.
const OPENING_S: f64 = 0.064;
/// Ratio to the samples of the first search that makes another search worthwhile: it finds signals that are 1
/// dB weaker.
const WORTH: f64 = 1.5;
/// Delays closer than this are equal, in chips. A search does not resolve more, and the side peaks of a
/// sub-carrier lie half a chip from the main one.
const SAME_CHIPS: f64 = 0.75;
/// Dopplers closer than this are equal, in cycles of a coherent sum.
const SAME_CYCLES: f64 = 0.5;

/// Level in decibels below a signal at which another code of its family may be mistaken for it. It is three
/// times the root-mean-square cross-correlation of random codes of that length. C/A codes exceed it nowhere.
fn apart_db(hit: &Acquired) -> f64 {
    let chips = lead(hit.signal).map_or(1.0, |component| f64::from(component.code_chips));
    10.0 * libm::log10(chips / 9.0)
}

/// A row for a candidate, and where it was found.
type Found = (AcquisitionRow, Option<Acquired>);

impl FrontEnd {
    /// Collects samples while a search is due, searches when there are enough, starts channels.
    pub(super) fn search(
        &mut self,
        block: &Stretch,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let end = block.end();
        if self.signals.is_empty() {
            return Ok(());
        }
        let opening = self.samples(OPENING_S);
        if block.first() < opening && block.packed().is_some() {
            self.opening.get_or_insert_with(|| Gathered::from(block)).take(block, opening as usize);
        } else if block.first() > self.samples(WIDEN_S) {
            self.opening = None;
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
        let stretch = window.samples.stretch(block, self.needed);
        self.refused.retain(|_, until| *until > end);
        if let Some((near, half_hz)) = &window.near {
            let results = self.searcher.search_near(&stretch, near, *half_hz)?;
            self.note_missed(&results, end, shared);
            let (believed, doubted) = self.believed(results);
            if doubted {
                self.next_search = self.next_search.min(end);
            }
            return self.start_channels(believed, block.first(), shared, sink);
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
            let results = self.searcher.search_stretch(&stretch, &sought, &known)?;
            self.look(&results, end, shared);
            self.start_channels(results, block.first(), shared, sink)?;
        }
        self.searched = true;
        self.widen(shared);
        self.plan_search(end);
        if self.follow_sky(shared) {
            self.next_search = end;
        }
        Ok(())
    }

    /// Satellites whose tracking is beyond doubt, with their code phases and Dopplers. There are none before
    /// a fix, while searches may still show that the samples are not as described, and while codes are not at
    /// their expected positions.
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

    /// Search that begins with this block, if any: one for all, or one for predicted satellites.
    fn due(&mut self, block: &Stretch, shared: &Shared) -> Result<Option<Option<Near>>, AcquireError> {
        if block.end() > self.next_search {
            self.aim(self.sweep(shared))?;
            return Ok(Some(None));
        }
        if block.end() <= self.next_foreseen {
            return Ok(None);
        }
        self.next_foreseen = block.end() + self.foreseen_wait();
        let near = self.foreseen(block.first(), shared);
        Ok((!near.0.is_empty()).then_some(Some(near)))
    }

    /// Searches the first samples of a recording that ended before a second search was due, all that there
    /// are up to [`OPENING_S`]: once as any recording's, where there was no search yet, and then by as many
    /// sums as there is room for, beside what was found and where the next search would have looked. Ranges
    /// get wider while there are too few satellites for a fix. These are four searches at most, where an hour
    /// has 240, so that each has the false alarm probability of the first one.
    ///
    /// A signal for which there is no room is left out: there are sums of one code period where two do not
    /// fit.
    pub(super) fn search_rest(
        &mut self,
        samples: u64,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let sink = &mut Counted { sink, step: self.step, ticks: &[] };
        self.watch(None, sink)?;
        let Some(opening) = self.opening.take().filter(|_| samples < self.samples(WIDEN_S)) else { return Ok(()) };
        // What a search waits for that no samples come for any more may be longer.
        let opening = match self.window.take() {
            Some(window) if !self.searched => window.samples,
            _ => opening,
        };
        if !self.searched && !self.search_opening((&opening, 1.0), shared, sink)? {
            return Ok(());
        }
        self.searched = true;
        self.follow_sky(shared);
        for width in WIDTHS {
            if width > 1.0 && self.tracks.len() >= UNKNOWNS {
                break;
            }
            self.search_opening((&opening, width), shared, sink)?;
        }
        // What a wider range found may be the middle of a sky of which it cut the rest.
        if self.follow_sky(shared) {
            self.search_opening((&opening, 1.0), shared, sink)?;
        }
        Ok(())
    }

    /// One of these searches; whether there is room for any signal.
    fn search_opening(
        &mut self,
        (opening, width): (&Gathered, f64),
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<bool, ReceiveError> {
        let packed = opening.packed();
        let have = packed.samples() as u64;
        let usual = &self.settings.acquisition;
        let (mut settings, mut centre_hz, mut is_elsewhere) = (usual.clone(), 0.0, !self.searched);
        if self.searched {
            let sweep = self.sweep(shared);
            centre_hz = sweep.centre_hz;
            settings.doppler_max_hz = (width * sweep.half_hz).min(MOST_DOPPLER_HZ);
            settings.noncoherent_sums = MOST_SUMS;
            is_elsewhere = width > 1.0 || sweep.half_hz > usual.doppler_max_hz;
        }
        let mut searcher = Searcher::fitted(&self.metadata, &settings, centre_hz, have)?;
        let known: Vec<Acquired> = self.opened.clone();
        let mut sought = Vec::new();
        for link in suited::distinct(&self.candidates) {
            let is_known = known.iter().any(|one| one.link().is_alike(link));
            let alone = AcquisitionSettings { signals: vec![link.signal.name.to_owned()], ..usual.clone() };
            // Where nothing else is new, what has hardly more sums is not found either.
            let seen = samples_needed(&self.metadata, &alone)?;
            let is_new = is_elsewhere || have as f64 > WORTH * seen as f64;
            sought.extend((is_new && !is_known && searcher.has_room(link.signal)?).then_some(link));
        }
        if sought.is_empty() && !self.candidates.is_empty() {
            return Ok(false);
        }
        let mut results = searcher.search_stretch(&Stretch::Packed(packed), &sought, &known)?;
        for (row, found) in &mut results {
            let Some(hit) = *found else { continue };
            // What is left of a strong signal that was taken out lies no higher than it would in another
            // code.
            let others = known.iter().filter(|one| one.link().carrier_hz() == hit.link().carrier_hz());
            let strongest_dbhz = others.map(|one| one.cn0_dbhz).fold(f64::NEG_INFINITY, f64::max);
            if hit.cn0_dbhz < strongest_dbhz - apart_db(&hit) {
                (row.acquired, *found) = (false, None);
            }
        }
        self.start_channels(results, packed.first, shared, sink)?;
        Ok(true)
    }

    /// Records what a search came to, and starts channels on what it found.
    fn start_channels(
        &mut self,
        results: Vec<Found>,
        since: u64,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let followed: BTreeSet<Link> = self.tracks.iter().map(|track| track.channel.link()).collect();
        let results = self.single(results);
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
            if self.opening.as_ref().is_some_and(|opening| opening.packed().first == hit.sample) || !self.searched {
                self.opened.push(hit);
            }
            let mut channel = Channel::start(&hit, &self.metadata, &self.settings.tracking);
            channel.set_carrier_offset(self.offset.hz());
            self.tracks.push(Track {
                channel,
                line: Line::default(),
                watched: Watched::default(),
                decoder: shared.decoder(hit.signal, hit.sv),
                report: Report { shape: shared.detection.as_ref().map(|_| Shape::default()), ..Report::default() },
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

    /// Results without hits at the delay and Doppler of a stronger one of their signal. One received code can
    /// look like another of its family.
    fn single(&mut self, mut results: Vec<Found>) -> Vec<Found> {
        let hits: Vec<Acquired> = results.iter().filter_map(|(_, hit)| *hit).collect();
        for (row, found) in &mut results {
            let Some(hit) = *found else { continue };
            let is_same = |other: &&Acquired| other.cn0_dbhz > hit.cn0_dbhz && self.are_at_one_place(other, &hit);
            if let Some(stronger) = hits.iter().find(is_same) {
                self.doubles.insert(hit.link(), stronger.link());
                (row.acquired, *found) = (false, None);
            }
        }
        results
    }

    /// True if two hits of one signal and carrier have equal delays and Dopplers.
    fn are_at_one_place(&self, a: &Acquired, b: &Acquired) -> bool {
        let Some(component) = lead(a.signal).filter(|_| a.signal == b.signal) else { return false };
        let length = f64::from(component.code_chips);
        let chips = (a.code_phase_chips - b.code_phase_chips + 0.5 * length).rem_euclid(length) - 0.5 * length;
        let sum_s = component.period_s() * f64::from(self.settings.acquisition.periods(component));
        a.link().carrier_hz() == b.link().carrier_hz()
            && chips.abs() < SAME_CHIPS
            && (a.doppler_hz - b.doppler_hz).abs() * sum_s < SAME_CYCLES
    }

    /// Satellite of a found signal, among satellites that a search cannot tell apart. It is one whose
    /// elements are known. Otherwise it is the one that was searched for, until its message says more.
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
                // A wrong time may come right when the satellite is acquired again; an echo does not.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acquire::tests::{Sent, metadata, record};
    use crate::receive;
    use crate::session::Session;
    use crate::settings::Settings;
    use gnss::beidou::b1c::B1C;
    use gnss::beidou::in_phase::B2I;
    use gnss::gps::l1ca::L1_CA;
    use gnss::samples::Format;
    use gnss::satellite::System;

    #[test]
    fn a_short_recording_is_searched_to_its_end_and_beyond_the_usual_dopplers() {
        let metadata = metadata(Format::Ci8, 2.6e6, 0.0, false);
        let sent = |prn, doppler_hz, cn0_dbhz| Sent { prn, doppler_hz, phase_chips: 37.3 * f64::from(prn), cn0_dbhz };
        // A sky whose middle is far from zero, one of it beyond 5 kHz, and two whose powers of 20 ms are
        // below the threshold: 20 + 2 · 20 ms · 2000 Hz, less two decibels, is 71, where 95 are asked for.
        let sky = [
            sent(3, 300.0, 46.0),
            sent(7, -1750.0, 45.0),
            sent(11, -4300.0, 44.0),
            sent(19, -6424.0, 43.0),
            sent(22, -800.0, 33.0),
            sent(30, -2600.0, 33.0),
        ];
        let recording = record(metadata.clone(), 286_000, &sky, 5);
        let byte = |x: f32| (24.0 * x).round().clamp(-127.0, 127.0) as i8 as u8;
        let bytes: Vec<u8> = recording.i.iter().zip(&recording.q).flat_map(|(i, q)| [byte(*i), byte(*q)]).collect();
        let found = |bytes: &[u8]| -> Vec<u8> {
            let mut records: Vec<Record> = Vec::new();
            let outcome = receive(&metadata, bytes, &Settings::default(), &mut records, &mut |_| ()).unwrap();
            outcome.acquired.iter().map(|sv| sv.number).collect()
        };
        assert_eq!(found(&bytes), [3, 7, 11, 19, 22, 30]);
        // As many samples as the first search takes hold the strong ones alone, now with those far off.
        assert_eq!(found(&bytes[..2 * 56_000]), [3, 7, 11, 19]);
    }

    #[test]
    fn of_hits_at_one_delay_and_doppler_the_strongest_stays_and_the_others_are_named() {
        let metadata =
            gnss::samples::IfMetadata { center_hz: B1C.centre_hz(), ..metadata(Format::Ci8, 4e6, 0.0, false) };
        let mut settings = Settings::default();
        settings.acquisition.signals = vec![B1C.name.to_owned()];
        let mut session = Session::new(&[metadata], &settings).unwrap();
        let front_end = session.front_ends.first_mut().unwrap();
        let found = |number, code_phase_chips, doppler_hz, cn0_dbhz| {
            let (sv, signal) = (Sv { system: System::BeiDou, number }, &B1C);
            let hit = Acquired { sv, signal, sample: 0, code_phase_chips, doppler_hz, cn0_dbhz };
            let (statistic, threshold, acquired) = (300.0, 100.0, true);
            let row = AcquisitionRow {
                sample: 0,
                sv,
                signal,
                acquired,
                statistic,
                threshold,
                doppler_hz,
                code_phase_chips,
                cn0_dbhz,
            };
            (row, Some(hit))
        };
        let kept = front_end.single(vec![
            found(47, 10_229.9, 1003.0, 36.0),
            found(34, 0.2, 1000.0, 45.0),
            // Another delay, and another Doppler.
            found(35, 2.2, 1000.0, 40.0),
            found(36, 0.2, 1100.0, 40.0),
        ]);
        let numbers: Vec<u8> = kept.iter().filter_map(|(_, hit)| hit.map(|hit| hit.sv.number)).collect();
        assert_eq!(numbers, [34, 35, 36]);
        assert!(kept.iter().all(|(row, hit)| row.acquired == hit.is_some()));
        let text = session.warnings().join("; ");
        assert!(text.contains("C47 BeiDou B1C was found at the delay and Doppler of C34"), "{text}");
    }

    #[test]
    fn numbers_that_send_no_such_signal_are_searched_for_on_request_alone() {
        let numbers = |signal: &'static gnss::signal::Signal, reserved_codes: bool| -> Vec<u8> {
            let own = metadata(Format::Ci8, 4e6, 0.0, false);
            let own = gnss::samples::IfMetadata { center_hz: signal.centre_hz(), ..own };
            let mut settings = Settings::default();
            settings.acquisition.signals = vec![signal.name.to_owned()];
            settings.acquisition.reserved_codes = reserved_codes;
            suited::candidates(&own, &settings.acquisition).iter().map(|link| link.sv.number).collect()
        };
        assert!(numbers(&B1C, false).into_iter().eq(19..=50));
        assert!(numbers(&B1C, true).into_iter().eq(1..=63));
        assert!(numbers(&B2I, false).into_iter().eq(1..=18));
        assert!(numbers(&L1_CA, false).into_iter().eq(1..=32));
    }
}
