//! Sub-frames of a provider for the data that satellites send, each computed once.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6.5.1. A tag covers the data that stood at the end of the sub-frame
//! before its own, whoever sees their satellite. Words of two issues, and those of a satellite without an
//! ephemeris, are stated as no data (COP 0). Limits: COP counts 15 sub-frames at most; the last 24
//! sub-frames are kept.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use super::{Fields, Provider, Words};
use crate::bits::{Row, leading};
use crate::data;
use crate::fields::Adkd;
use crate::page::PAGES;
use crate::time::Gst;

/// Largest count of the field COP.
const MOST_COP: u8 = 15;
/// Sub-frames that are kept.
const KEPT: usize = 24;

/// Data that satellites send, whoever sees them.
pub trait Broadcast: fmt::Debug + Send + Sync {
    /// Words of each satellite by number, in the sub-frame that begins at a time.
    fn words(&self, start: Gst) -> BTreeMap<u8, Words>;
}

/// Data at the end of a sub-frame by satellite: ephemeris, and timing parameters.
type Rows = BTreeMap<u8, [Option<Row>; 2]>;

/// Values of the newest sub-frames that were asked for.
#[derive(Debug)]
struct Memo<T> {
    held: VecDeque<(Gst, Arc<T>)>,
}

impl<T> Memo<T> {
    fn new() -> Self {
        Self { held: VecDeque::new() }
    }

    fn get(&self, start: Gst) -> Option<Arc<T>> {
        self.held.iter().find(|(own, _)| *own == start).map(|(_, value)| Arc::clone(value))
    }

    fn put(&mut self, start: Gst, value: &Arc<T>) {
        if self.held.len() >= KEPT {
            self.held.pop_front();
        }
        self.held.push_back((start, Arc::clone(value)));
    }
}

#[derive(Debug)]
struct Memos {
    words: Memo<BTreeMap<u8, Words>>,
    rows: Memo<Rows>,
    fields: Memo<BTreeMap<u8, Fields>>,
}

/// Authentication of a constellation's messages.
#[derive(Debug)]
pub struct Transmission {
    provider: Provider,
    data: Box<dyn Broadcast>,
    memos: Mutex<Memos>,
}

impl Transmission {
    /// Creates the authentication of data by a provider.
    pub fn new(provider: Provider, data: Box<dyn Broadcast>) -> Self {
        let memos = Memos { words: Memo::new(), rows: Memo::new(), fields: Memo::new() };
        Self { provider, data, memos: Mutex::new(memos) }
    }

    /// Provider of the keys.
    pub fn provider(&self) -> &Provider {
        &self.provider
    }

    /// Bits of a satellite's page that begins at a time: 40, zeros where it does not authenticate.
    pub fn page(&self, satellite: u8, start: Gst) -> u64 {
        if self.provider.settings().without.contains(&satellite) {
            return 0;
        }
        let subframe = start.subframe();
        let index = (start.since_s(subframe) / 2) as usize;
        let mut memos = self.memos.lock().unwrap_or_else(PoisonError::into_inner);
        let fields = memos.fields.get(subframe).unwrap_or_else(|| {
            let fields = Arc::new(self.fields(&mut memos, subframe));
            memos.fields.put(subframe, &fields);
            fields
        });
        fields.get(&satellite).and_then(|fields| fields.get(index)).copied().unwrap_or_default()
    }

    fn words(&self, memos: &mut Memos, start: Gst) -> Arc<BTreeMap<u8, Words>> {
        memos.words.get(start).unwrap_or_else(|| {
            let words = Arc::new(self.data.words(start));
            memos.words.put(start, &words);
            words
        })
    }

    /// Data at the end of a sub-frame.
    fn rows(&self, memos: &mut Memos, start: Gst) -> Arc<Rows> {
        if let Some(rows) = memos.rows.get(start) {
            return rows;
        }
        // Word 10 is sent in every other sub-frame.
        let mut held = data::Words::default();
        for at in [start.later(-1), start] {
            self.words(memos, at).iter().for_each(|(&satellite, words)| held.put(satellite, at, words));
        }
        let sent = self.words(memos, start);
        let row = |satellite: u8, kind: Adkd, cop: u8| held.covered(satellite, kind, start.later(1), cop).ok();
        let all = |&satellite: &u8| [row(satellite, Adkd::Ephemeris, 1), row(satellite, Adkd::Timing, 2)];
        let rows: Arc<Rows> = Arc::new(sent.keys().map(|satellite| (*satellite, all(satellite))).collect());
        memos.rows.put(start, &rows);
        rows
    }

    /// Fields of all satellites that send in a sub-frame.
    fn fields(&self, memos: &mut Memos, start: Gst) -> BTreeMap<u8, Fields> {
        let before: Vec<Arc<Rows>> =
            (1..=i64::from(MOST_COP)).map(|back| self.rows(memos, start.later(-back))).collect();
        let Some(newest) = before.first() else { return BTreeMap::new() };
        let covered = |satellite: u8, adkd: Adkd| {
            let row = newest.get(&satellite)?[position(adkd)].as_ref()?;
            let same =
                |rows: &&Arc<Rows>| rows.get(&satellite).is_some_and(|both| both[position(adkd)].as_ref() == Some(row));
            let cop = before.iter().take_while(same).count();
            Some((row, cop as u8))
        };
        let others: Vec<u8> = newest.keys().copied().collect();
        let sent = self.words(memos, start);
        let without = &self.provider.settings().without;
        let senders = sent.keys().copied().filter(|sender| !without.contains(sender));
        senders.filter_map(|sender| Some((sender, self.field(sender, start, &others, &covered)?))).collect()
    }

    fn field<'a>(
        &self,
        sender: u8,
        start: Gst,
        others: &[u8],
        covered: &(dyn Fn(u8, Adkd) -> Option<(&'a Row, u8)> + 'a),
    ) -> Option<Fields> {
        let mack = self.provider.mack(sender, start, others, covered)?;
        let hkroot = self.provider.hkroot(sender, start);
        let mut fields = [0; PAGES];
        for ((field, byte), section) in fields.iter_mut().zip(hkroot).zip(mack.bytes().chunks_exact(4)) {
            *field = u64::from(byte) << 32 | leading(section, 32);
        }
        Some(fields)
    }
}

/// Position of a kind of data among a satellite's rows.
fn position(adkd: Adkd) -> usize {
    usize::from(adkd == Adkd::Timing)
}
