//! Collects the content of blocks found in soft symbols ([`Running`]): the second of the week by type 12, and
//! from it on by counting, the satellite's position by type 9, and the content about others from then on.

use super::{BITS, OF_PLACE, OF_SET, OF_TIME, RATE_HZ, SBAS, TIME, is_block, type_of};
use crate::augmentation::Content;
use crate::bits::integers;
use crate::fec::running::Running;
use crate::framed::Reported;
use crate::message::{Read, Reader, raw_of};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::{Epoch, WEEK_S};

/// Reads the message.
#[derive(Clone, Debug)]
pub struct SbasReader {
    sv: Sv,
    code: Running,
    /// The latest block of type 12: number of its first symbol, and when it began.
    time: Option<(u64, Epoch)>,
    /// The latest block of type 9 likewise.
    place: Option<(u64, Vec<bool>)>,
    reported: Reported,
}

impl SbasReader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self { sv, code: Running::new(BITS, is_block), time: None, place: None, reported: Reported::default() }
    }

    /// Start time of the block whose first symbol is `begin`.
    fn begun(&self, begin: u64) -> Option<Epoch> {
        let (timed, at) = self.time?;
        Some(at.plus_s((begin as f64 - timed as f64) / RATE_HZ))
    }

    /// The time that a block of type 12 states it began at, its week near `near`.
    fn said(bits: &Vec<bool>, near: Epoch) -> Option<Epoch> {
        let all = integers(&TIME, bits);
        let (tow_s, week) = (raw_of(&all, "tow_s")?, raw_of(&all, "week")?);
        let tow_s = planted!("gnss.sbas.tow", tow_s, tow_s - 1);
        (tow_s < WEEK_S).then(|| Epoch::new(near.nearest_week(week, 1024) * WEEK_S + tow_s, 0.0))
    }

    /// Reports the content of a block, if its time is known. A correction without a time is of no use.
    fn look_for_content(&self, kind: u8, begin: u64, bits: &Vec<bool>, news: &mut Vec<Read>) {
        let (Some(sent), Some(content)) = (self.begun(begin), Content::read(kind, bits)) else { return };
        news.push(Read::Augmentation(sent, Box::new(content)));
        let rows: Vec<NavigationRow> = NavigationRow::each(self.sv, SBAS.name, 0, Content::raw(kind, bits)).collect();
        if !rows.is_empty() {
            news.push(Read::Parameters(rows));
        }
    }

    fn look_for_set(&mut self, news: &mut Vec<Read>) {
        let Some((begin, bits)) = &self.place else { return };
        let Some(sent) = self.begun(*begin) else { return };
        let set = OF_SET.decoded(self.sv, [bits], sent);
        self.reported.take(SBAS.name, integers(&super::GEO, bits), set, news);
    }
}

impl Reader for SbasReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let Some(found) = self.code.take(soft) else { return Vec::new() };
        let begin = self.code.next() - found.symbols;
        let mut news = Vec::new();
        match type_of(&found.bits) {
            OF_TIME => {
                if let Some(at) = Self::said(&found.bits, near) {
                    self.time = Some((begin, at));
                    news.push(Read::Time(at));
                } else {
                    news.push(Read::Refused(format!("the time of week in message {OF_TIME} is beyond the week")));
                }
            }
            OF_PLACE => self.place = Some((begin, found.bits)),
            kind => self.look_for_content(kind, begin, &found.bits, &mut news),
        }
        if let Some(at) = self.begun(begin) {
            let (symbols, inverted) = (found.symbols, found.inverted);
            news.insert(0, Read::Unit { symbols, of_week_s: at.tow_whole_s(), inverted });
        }
        self.look_for_set(&mut news);
        news
    }

    fn skip(&mut self) {
        self.code.skip();
        (self.time, self.place) = (None, None);
    }

    fn doubt(&mut self) {
        self.code.doubt();
        (self.time, self.place) = (None, None);
    }

    fn missing(&self) -> Vec<u8> {
        let parts = [(OF_TIME, self.time.is_none()), (OF_PLACE, self.place.is_none())];
        parts.into_iter().filter(|(_, lacks)| *lacks).map(|(number, _)| number).collect()
    }
}
