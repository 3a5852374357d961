//! Keys and tags within a verifier: the key of each sub-frame, tags that wait for theirs, and their results.

use super::{Authenticated, FAST_LIMIT_S, Verifier};
use crate::bits::Row;
use crate::chain::{Chain, KeyError, TeslaKey, Trust};
use crate::data::{Words, words_under, zeros};
use crate::fields::{Adkd, NmaHeader, NmaStatus};
use crate::mac::{Tagged, mac, macseq};
use crate::page::SATELLITES;
use crate::report::{Gap, Outcome, Refusal, TagReport};
use crate::subframe::{MACK_BITS, Subframe};
use crate::tables::{Slot, slots};
use crate::time::Gst;

/// Bits that follow a tag: MACSEQ and COP after the first, satellite, kind and COP after the others.
const INFO_BITS: usize = 16;

/// Tags of a sub-frame that wait for their keys.
#[derive(Clone, Debug)]
pub(super) struct Waiting {
    start: Gst,
    sender: u8,
    chain: Chain,
    header: NmaHeader,
    /// MACSEQ and the statements of the flexible slots, if their pages were received.
    sequence: Option<(u64, Vec<u16>)>,
    /// Result of the check of MACSEQ; `None` before it.
    checked: Option<Sequence>,
    delay_bound_s: f64,
    tags: Vec<Tag>,
}

/// Result of MACSEQ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sequence {
    Right,
    Wrong,
    Unknown,
}

/// One tag with the data that it covers.
#[derive(Clone, Debug)]
struct Tag {
    position: u8,
    of: u8,
    adkd: Adkd,
    is_flexible: bool,
    has_data: bool,
    value: u64,
    data: Result<Row, Outcome>,
}

/// Slots of a chain's sub-frame after the first, if its table and lengths fit the section.
fn layout(chain: &Chain, start: Gst) -> Option<&'static [Slot]> {
    let slots = slots(chain.table, start.half())?;
    let fits = (MACK_BITS - 8 * chain.key_bytes) / (chain.tag_bits + INFO_BITS);
    (slots.len() + 1 == fits).then_some(slots)
}

impl Verifier {
    fn trusted(&self, subframe: &Subframe) -> Option<&Trust> {
        self.chains.get(&subframe.nma_header()?.chain())
    }

    /// True if the root of the sub-frame's chain is known.
    pub(super) fn trusts(&self, subframe: &Subframe) -> bool {
        self.trusted(subframe).is_some()
    }

    /// Holds the key of a sub-frame to its chain.
    pub(super) fn take_key(&mut self, subframe: &Subframe) {
        let Some(header) = subframe.nma_header() else { return };
        let Some(trust) = self.chains.get_mut(&header.chain()) else { return };
        let chain = &trust.chain;
        let Some(slots) = layout(chain, subframe.start) else { return };
        let first = (slots.len() + 1) * (chain.tag_bits + INFO_BITS);
        let Some(key) = subframe.mack(first, 8 * chain.key_bytes) else { return };
        match trust.accept(&TeslaKey { start: subframe.start, bytes: key.bytes().to_vec() }) {
            Ok(()) => {
                let is_new = self.proved.insert(subframe.start, header.chain()).is_none();
                self.counts.keys_verified += u64::from(is_new);
            }
            Err(KeyError::Foreign) => self.counts.keys_refused += 1,
            Err(KeyError::BeforeRoot | KeyError::TooFar) => self.counts.keys_not_verifiable += 1,
        }
    }

    /// Puts the tags of a sub-frame with those that wait, with the words of the sub-frames before it.
    pub(super) fn wait(&mut self, subframe: &Subframe, words: &Words) {
        let trusted = subframe.nma_header().zip(self.trusted(subframe));
        let Some((header, chain)) = trusted.map(|(header, trust)| (header, trust.chain.clone())) else { return };
        let Some(slots) = layout(&chain, subframe.start) else {
            self.counts.subframes_unreadable += 1;
            return;
        };
        let width = chain.tag_bits + INFO_BITS;
        let info = |slot: usize| subframe.mack_value(slot * width + chain.tag_bits, INFO_BITS).map(|info| info as u16);
        let flexible = (1..).zip(slots).filter(|(_, slot)| **slot == Slot::Flexible).map(|(at, _)| info(at));
        let sequence = info(0).map(|first| u64::from(first >> 4)).zip(flexible.collect());
        let mut tags = Vec::new();
        for slot in 0..=slots.len() {
            let Some((value, info)) = subframe.mack_value(slot * width, chain.tag_bits).zip(info(slot)) else {
                continue;
            };
            let (of, adkd) = match slot {
                0 => (subframe.sender, Adkd::Ephemeris),
                _ => ((info >> 8) as u8, Adkd::of((info >> 4 & 15) as u8)),
            };
            let (cop, rule) = ((info & 15) as u8, slot.checked_sub(1).map_or(Slot::Flexible, |at| slots[at]));
            let fits = match rule {
                Slot::Flexible => true,
                Slot::Fixed(kind, is_own) => kind == adkd && (!is_own || of == subframe.sender),
            };
            let data = match (fits, cop) {
                (false, _) => Err(Outcome::Refused(Refusal::Slot)),
                _ if !SATELLITES.contains(&of) => Err(Outcome::NotVerifiable(Gap::ReservedField)),
                (_, 0) => zeros(adkd).ok_or(Outcome::NotVerifiable(Gap::ReservedField)),
                _ if matches!(adkd, Adkd::Reserved(_)) => Err(Outcome::NotVerifiable(Gap::ReservedField)),
                _ => {
                    let covered = words.covered(of, adkd, subframe.start, cop);
                    covered.map_err(|gap| Outcome::NotVerifiable(gap.into()))
                }
            };
            let is_flexible = slot > 0 && rule == Slot::Flexible;
            tags.push(Tag { position: slot as u8 + 1, of, adkd, is_flexible, has_data: cop != 0, value, data });
        }
        self.waiting.push(Waiting {
            start: subframe.start,
            sender: subframe.sender,
            chain,
            header,
            sequence,
            checked: None,
            delay_bound_s: subframe.delay_bound_s,
            tags,
        });
    }

    /// Gives the results of tags whose key is proved.
    pub(super) fn settle(&mut self) {
        let mut still = Vec::new();
        for mut waiting in std::mem::take(&mut self.waiting) {
            let trust = self.chains.get(&waiting.chain.id).filter(|trust| trust.chain == waiting.chain);
            if trust.is_none() {
                self.report_all(&waiting, Gap::ChainGone);
                continue;
            }
            // A tag has the key that is sent so much later, of the chain that is in force then.
            let key_at = |after: i64| {
                let sent = waiting.start.later(after);
                let chain = self.proved.get(&sent).copied().unwrap_or(waiting.chain.id);
                self.chains.get(&chain)?.key_at(sent).ok()
            };
            let [fast, slow] = [Adkd::Ephemeris, Adkd::SlowMac].map(|kind| key_at(kind.key_after()));
            if let (None, Some(key)) = (waiting.checked, &fast) {
                waiting.checked = Some(waiting.check_sequence(key));
            }
            let mut left = Vec::new();
            for tag in std::mem::take(&mut waiting.tags) {
                let key = if tag.adkd == Adkd::SlowMac { &slow } else { &fast };
                let Some(key) = key else {
                    left.push(tag);
                    continue;
                };
                let outcome = waiting.outcome(&tag, key);
                self.report(&waiting, &tag, outcome);
            }
            if !left.is_empty() {
                still.push(Waiting { tags: left, ..waiting });
            }
        }
        self.waiting = still;
    }

    /// Gives up sub-frames of a time that wait for a root, and tags that wait for a key.
    pub(super) fn give_up(&mut self, is_over: impl Fn(Gst) -> bool) {
        let before = self.unrooted.len();
        self.unrooted.retain(|(subframe, _)| !is_over(subframe.start));
        self.counts.subframes_without_root += (before - self.unrooted.len()) as u64;
        let waiting = std::mem::take(&mut self.waiting);
        let (over, still): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|waiting| is_over(waiting.start));
        self.waiting = still;
        over.iter().for_each(|waiting| self.report_all(waiting, Gap::NoKey));
    }

    fn report_all(&mut self, waiting: &Waiting, gap: Gap) {
        for tag in &waiting.tags {
            self.report(waiting, tag, Outcome::NotVerifiable(gap));
        }
    }

    /// Counts a result, and adds a right tag to the strength of its data.
    fn report(&mut self, waiting: &Waiting, tag: &Tag, outcome: Outcome) {
        let mut outcome = outcome;
        if matches!(outcome, Outcome::Authentic | Outcome::NoData) {
            self.status = Some(waiting.header.status());
            let is_usable = matches!(self.status, Some(NmaStatus::Test | NmaStatus::Operational));
            if self.alert || !is_usable {
                outcome = Outcome::NotVerifiable(Gap::DoNotUse);
            }
        }
        if let (Outcome::Authentic, Ok(data)) = (outcome, &tag.data) {
            self.strengthen(tag, data, waiting);
        }
        let Waiting { start: sent, sender, .. } = *waiting;
        let Tag { of, adkd, position, .. } = *tag;
        self.reports.push(TagReport { sent, sender, of, adkd, position, outcome });
        *self.counts.tags.entry((adkd, outcome)).or_default() += 1;
    }

    fn strengthen(&mut self, tag: &Tag, data: &Row, waiting: &Waiting) {
        let bits = waiting.chain.tag_bits;
        let enough = self.settings.tag_bits;
        let held = self.strength.entry((tag.of, tag.adkd == Adkd::Timing)).or_default();
        if held.0 != *data {
            *held = (data.clone(), 0);
        }
        let before = held.1;
        held.1 = before.saturating_add(bits as u32);
        if held.1 < enough {
            return;
        }
        if before < enough {
            self.counts.authentic_data += 1;
            let words = (tag.adkd != Adkd::Timing).then(|| words_under(data, waiting.start)).flatten();
            let sent = waiting.start;
            self.authentic.extend(words.map(|words| Authenticated { satellite: tag.of, words, sent }));
        }
        let end = self.now.map(|now| now.later(1));
        self.first_authentic = self.first_authentic.or(end);
        self.last_authentic = end;
    }
}

impl Waiting {
    fn check_sequence(&self, key: &TeslaKey) -> Sequence {
        let Some((value, flexible)) = &self.sequence else { return Sequence::Unknown };
        let own = macseq(self.chain.mac, &key.bytes, self.sender, self.start, flexible);
        if own == Some(*value) { Sequence::Right } else { Sequence::Wrong }
    }

    /// Result of a tag whose key is proved.
    fn outcome(&self, tag: &Tag, key: &TeslaKey) -> Outcome {
        // MACSEQ has the fast key, whatever the tag's.
        let is_fast = planted!("osnma.tags.time", self.delay_bound_s < FAST_LIMIT_S, true);
        if !is_fast && (tag.adkd != Adkd::SlowMac || tag.is_flexible) {
            return Outcome::NotVerifiable(Gap::Time);
        }
        match (is_fast, self.checked) {
            (true, Some(Sequence::Wrong)) => return Outcome::Refused(Refusal::Macseq),
            (true, Some(Sequence::Right)) => {}
            _ if tag.is_flexible => return Outcome::NotVerifiable(Gap::NoMacseq),
            _ => {}
        }
        let data = match &tag.data {
            Ok(data) => data,
            Err(outcome) => return *outcome,
        };
        let Self { start, sender, .. } = *self;
        let status = self.header.status_bits();
        let tagged = Tagged { of: tag.of, sender, start, position: tag.position, status };
        let own = mac(self.chain.mac, &key.bytes, &tagged.message(data), self.chain.tag_bits);
        match (own == Some(tag.value), tag.has_data) {
            (true, true) => Outcome::Authentic,
            (true, false) => Outcome::NoData,
            (false, _) => Outcome::Refused(Refusal::Tag),
        }
    }
}
