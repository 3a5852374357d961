//! Finds pages in soft symbols, normal or inverted, and collects their content.

use std::collections::{BTreeMap, VecDeque};

use super::{
    FNAV, PAGE_SYMBOLS, PAGES_OF_SET, PATTERN, decode_soft, elements, gps_offset, ionosphere, page_type, parameters,
    sent_at, time_of_week,
};
use crate::message::{Parameters, Read, Reader};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Pages in a row that fail where they are expected before they are sought elsewhere.
const FAILURES: u32 = 3;
/// Parameters that change from page to page of the same ephemeris.
const PASSING: [&str; 1] = ["week"];

/// Reads F/NAV.
#[derive(Clone, Debug)]
pub struct FnavReader {
    sv: Sv,
    /// The latest symbols, a page at most; `next` numbers the one to come.
    symbols: VecDeque<f32>,
    next: u64,
    /// Number of the first symbol of some page, and pages that failed since the last one that did not.
    page: Option<u64>,
    failures: u32,
    /// The latest of pages 1 to 4 by their types.
    pages: BTreeMap<u8, Vec<bool>>,
    /// Parameters of the ephemeris that was reported last.
    complete: Option<Parameters>,
}

impl FnavReader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self {
            sv,
            symbols: VecDeque::with_capacity(PAGE_SYMBOLS),
            next: 0,
            page: None,
            failures: 0,
            pages: BTreeMap::new(),
            complete: None,
        }
    }

    /// True if a possible page begins with the pattern, normal or inverted.
    fn has_pattern(&self) -> bool {
        [false, true]
            .into_iter()
            .any(|flip| self.symbols.iter().zip(PATTERN).all(|(soft, bit)| (*soft < 0.0) == (bit ^ flip)))
    }

    /// Takes a page whose check was right.
    fn read(&mut self, page: Vec<bool>, inverted: bool, near: Epoch) -> Vec<Read> {
        let mut news = Vec::new();
        if let Some(of_week_s) = time_of_week(&page) {
            news.push(Read::Unit { symbols: PAGE_SYMBOLS as u64, of_week_s, inverted });
        }
        news.extend(sent_at(&page, near).map(Read::Time));
        let kind = page_type(&page);
        if kind == 1 {
            let all = parameters(&page).unwrap_or_default();
            let raw = |name: &str| all.iter().find(|(other, _)| *other == name).map(|(_, raw)| *raw);
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

    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let own = PAGES_OF_SET.map(|kind| self.pages.get(&kind));
        let [Some(one), Some(two), Some(three), Some(four)] = own else { return };
        let pages = [one, two, three, four];
        let all: Parameters = pages.into_iter().filter_map(parameters).flatten().collect();
        let content = || all.iter().filter(|(name, _)| !PASSING.contains(name)).copied().collect::<Parameters>();
        if self.complete.as_ref() == Some(&content()) {
            return;
        }
        let Some(set) = elements(self.sv, pages, near) else {
            news.extend(self.complete.is_none().then(|| Read::make_no_set("pages 1 to 4")));
            return;
        };
        self.complete = Some(content());
        let rows = NavigationRow::each(self.sv, FNAV.name, u32::from(set.iode), all).collect();
        news.push(Read::Ephemeris(Box::new(set)));
        news.push(Read::Parameters(rows));
    }
}

impl Reader for FnavReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        if self.symbols.len() == PAGE_SYMBOLS {
            self.symbols.pop_front();
        }
        self.symbols.push_back(soft);
        self.next += 1;
        let Some(begin) = self.next.checked_sub(PAGE_SYMBOLS as u64).filter(|_| self.symbols.len() == PAGE_SYMBOLS)
        else {
            return Vec::new();
        };
        let due = self.page.is_some_and(|page| begin.abs_diff(page).is_multiple_of(PAGE_SYMBOLS as u64));
        if (self.page.is_some() && !due) || (self.page.is_none() && !self.has_pattern()) {
            return Vec::new();
        }
        if let Some((page, inverted)) = decode_soft(self.symbols.make_contiguous()) {
            (self.page, self.failures) = (Some(begin), 0);
            return self.read(page, inverted, near);
        }
        if due {
            self.failures += 1;
            if self.failures >= FAILURES {
                self.doubt();
            }
        }
        Vec::new()
    }

    fn skip(&mut self) {
        self.symbols.clear();
        self.doubt();
    }

    fn doubt(&mut self) {
        (self.page, self.failures) = (None, 0);
    }

    fn missing(&self) -> Vec<u8> {
        PAGES_OF_SET.into_iter().filter(|kind| !self.pages.contains_key(kind)).collect()
    }
}
