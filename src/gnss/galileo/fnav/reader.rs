//! Finds pages in soft symbols, normal or inverted, and collects their content.

use std::collections::BTreeMap;

use super::{
    FNAV, PAGE_SYMBOLS, PAGES_OF_SET, PATTERN, decode_soft, elements, gps_offset, ionosphere, page_type, parameters,
    sent_at, time_of_week,
};
use crate::framed::{Content, Framed, Pattern, Reported};
use crate::message::{Parameters, Read, raw_of};
use crate::satellite::Sv;
use crate::time::Epoch;

/// Pattern of a page.
const BEGIN: Pattern = Pattern { bits: PATTERN.0, symbols: PATTERN.1, tolerated: 0 };
/// Parameters that change from page to page of the same ephemeris.
const PASSING: [&str; 1] = ["week"];

/// Reader of F/NAV.
pub type FnavReader = Framed<FnavContent>;

/// Content of a satellite's pages.
#[derive(Clone, Debug)]
pub struct FnavContent {
    sv: Sv,
    /// The latest of pages 1 to 4 by their types.
    pages: BTreeMap<u8, Vec<bool>>,
    reported: Reported,
}

impl FnavContent {
    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let own = PAGES_OF_SET.map(|kind| self.pages.get(&kind));
        let [Some(one), Some(two), Some(three), Some(four)] = own else { return };
        let pages = [one, two, three, four];
        let all: Parameters = pages.into_iter().filter_map(parameters).flatten().collect();
        let set = || elements(self.sv, pages, near);
        self.reported.take_whole(FNAV.name, all, (set, "pages 1 to 4"), news);
    }
}

impl Content for FnavContent {
    /// A page, and true if its symbols were inverted.
    type Frame = (Vec<bool>, bool);
    const SYMBOLS: usize = PAGE_SYMBOLS;
    const FAILURES: u32 = 3;

    fn new(sv: Sv) -> Self {
        Self { sv, pages: BTreeMap::new(), reported: Reported::without(&PASSING) }
    }

    fn may_begin(&self, symbols: &[f32]) -> bool {
        BEGIN.begins(symbols)
    }

    fn decode(&self, symbols: &[f32]) -> Option<Self::Frame> {
        decode_soft(symbols)
    }

    fn read(&mut self, (page, inverted): Self::Frame, _: u64, near: Epoch) -> Vec<Read> {
        let mut news = Vec::new();
        if let Some(of_week_s) = time_of_week(&page) {
            news.push(Read::Unit { symbols: PAGE_SYMBOLS as u64, of_week_s, inverted });
        }
        news.extend(sent_at(&page, near).map(Read::Time));
        let kind = page_type(&page);
        if kind == 1 {
            let all = parameters(&page).unwrap_or_default();
            let raw = |name: &str| raw_of(&all, name);
            news.extend(ionosphere(&raw).map(Read::Ionosphere));
        }
        if kind == 4 {
            news.extend(gps_offset(&page, near).map(Read::AheadOfGps));
        }
        if PAGES_OF_SET.contains(&kind) {
            self.pages.insert(kind, page);
            self.look_for_set(near, &mut news);
        }
        news
    }

    fn missing(&self) -> Vec<u8> {
        PAGES_OF_SET.into_iter().filter(|kind| !self.pages.contains_key(kind)).collect()
    }
}
