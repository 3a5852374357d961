//! Finds pages in soft symbols, normal or inverted, and collects the content of their words.

use std::collections::BTreeMap;

use super::redundancy::{REDUNDANT, completed, is_redundant, issue, low_issue};
use super::{
    INAV, PAGE_SYMBOLS, PART_SYMBOLS, PATTERN, REDUCED, WORDS_OF_SET, decode_any, elements, elements_in_short,
    gps_offset, ionosphere, is_alert, parameters, sent_at, time_of_week, word_of, word_type,
};
use crate::bits::number;
use crate::framed::{Content, Framed};
use crate::message::{Message, Read, SentPage, raw_of};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Reader of I/NAV.
pub type InavReader = Framed<InavContent>;

impl InavReader {
    /// Creates a reader of either carrier that has received no symbols.
    pub(super) fn on(message: &'static Message, sv: Sv) -> Self {
        Self::of(InavContent { message, ..InavContent::new(sv) })
    }
}

/// Content of a satellite's pages.
#[derive(Clone, Debug)]
pub struct InavContent {
    sv: Sv,
    /// Message of the reader's carrier.
    message: &'static Message,
    /// The latest words by their types.
    words: BTreeMap<u8, u128>,
    /// The issue of data of the latest of words 1 to 4.
    issue: Option<u32>,
    /// Words of the ephemeris that was reported last.
    complete: Option<[u128; 5]>,
    /// Numbers of the first symbols of the latest page with reduced elements, and of the latest one that said
    /// its time, with that time.
    reduced: Option<u64>,
    timed: Option<(u64, Epoch)>,
    /// Pages that wait for a time, each with the number of its first symbol. `None`: pages are not kept.
    pages: Option<Vec<(u64, [u128; 2])>>,
}

/// Pages that wait for a time at most: two sub-frames, in which the time is sent several times.
const WAITING_PAGES: usize = 30;

impl InavContent {
    /// Takes the word of the page whose first symbol has the number `begin`.
    fn take(&mut self, word: u128, begin: u64, inverted: bool, near: Epoch) -> Vec<Read> {
        let mut news = Vec::new();
        let dated = sent_at(&word, near);
        if let Some(tow_s) = time_of_week(&word).map(i64::from) {
            news.push(Read::Unit { symbols: PAGE_SYMBOLS as u64, of_week_s: tow_s, inverted });
            self.timed = Some((begin, dated.unwrap_or_else(|| near.nearest_tow(tow_s))));
        }
        news.extend(dated.map(Read::Time));
        // Redundancy of an issue before is that of another ephemeris.
        if WORDS_OF_SET.contains(&word_type(&word)) && self.issue.replace(issue(&word)) != Some(issue(&word)) {
            self.words.retain(|_, word| !is_redundant(word));
        }
        self.words.insert(word_type(&word), word);
        if word_type(&word) == 5 {
            let all = parameters(&word).unwrap_or_default();
            let raw = |name: &str| raw_of(&all, name);
            news.extend(ionosphere(&raw).map(Read::Ionosphere));
        }
        match word_type(&word) {
            1..=5 | 17..=20 => self.look_for_set(near, &mut news),
            6 => news.push(Read::Parameters(self.rows(&word, 0))),
            10 => {
                news.push(Read::Parameters(self.rows(&word, 0)));
                news.extend(gps_offset(&word, near).map(Read::AheadOfGps));
            }
            REDUCED => self.reduced = Some(begin),
            _ => {}
        }
        // It says neither its time nor its delays, and is reported again with either.
        if [0, 5, 6, REDUCED].contains(&word_type(&word)) {
            news.extend(self.in_short());
        }
        news
    }

    /// The pages up to the one that began with the symbol `begin`, once a page has said its time.
    fn whole_pages(&mut self, parts: &[Vec<bool>; 2], begin: u64) -> Vec<Read> {
        let Some(waiting) = &mut self.pages else { return Vec::new() };
        if waiting.len() >= WAITING_PAGES {
            waiting.remove(0);
        }
        waiting.push((begin, parts.each_ref().map(|part| number(part))));
        let Some((timed, time)) = self.timed else { return Vec::new() };
        let page = |(first, parts): (u64, [u128; 2])| {
            let after_s = ((first as i64 - timed as i64) as f64 * INAV.symbol_s).round() as i64;
            let symbols = begin - first + PAGE_SYMBOLS as u64;
            Read::Page(SentPage { symbols, start: Epoch::new(time.seconds() + after_s, 0.0), parts })
        };
        waiting.drain(..).map(page).collect()
    }

    /// The reduced elements, once the time of their page is known.
    fn in_short(&self) -> Option<Read> {
        let (word, begin, (page, time)) = (self.words.get(&REDUCED)?, self.reduced?, self.timed?);
        let symbols = begin as i64 - page as i64;
        let start = Epoch::new(time.seconds() + (symbols as f64 * INAV.symbol_s).round() as i64, 0.0);
        let five = self.words.get(&5);
        let set = Box::new(elements_in_short(self.sv, (word, start), five));
        Some(Read::Reduced { set, with_delays: five.is_some() })
    }

    /// Words 1 to 4 of the latest issue, with those that lack found from redundancy.
    fn four(&self) -> Option<[u128; 4]> {
        let issued = self.issue?;
        let own = WORDS_OF_SET.map(|number| self.words.get(&number).filter(|word| issue(word) == issued));
        if let [Some(one), Some(two), Some(three), Some(four)] = own {
            return Some([*one, *two, *three, *four]);
        }
        let of_issue = |word: &&u128| low_issue(word) == issued & 0b11;
        completed(issued, own, REDUNDANT.map(|number| self.words.get(&number).filter(of_issue)))
    }

    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let (Some([one, two, three, four]), Some(five)) = (self.four(), self.words.get(&5)) else { return };
        let set = [one, two, three, four, *five];
        // Word 5 ends with its own time.
        let content = |set: &[u128; 5]| [set[0], set[1], set[2], set[3], set[4] >> 43];
        if self.complete.is_some_and(|before| content(&before) == content(&set)) {
            return;
        }
        let Some(ephemeris) = elements(self.sv, set.each_ref(), near) else {
            news.extend(self.complete.is_none().then(|| Read::make_no_set("words 1 to 5")));
            return;
        };
        let issue = u32::from(ephemeris.iode);
        let mut rows: Vec<NavigationRow> =
            [one, two, three, four].iter().flat_map(|word| self.rows(word, issue)).collect();
        rows.extend(self.rows(five, 0));
        news.push(Read::Ephemeris(Box::new(ephemeris)));
        news.push(Read::Parameters(rows));
        self.complete = Some(set);
    }

    fn rows(&self, word: &u128, issue: u32) -> Vec<NavigationRow> {
        NavigationRow::each(self.sv, self.message.name, issue, parameters(word).unwrap_or_default()).collect()
    }
}

impl Content for InavContent {
    /// Both parts of a page, and true if their symbols were inverted.
    type Frame = ([Vec<bool>; 2], bool);
    const SYMBOLS: usize = PAGE_SYMBOLS;
    const FAILURES: u32 = 5;

    fn new(sv: Sv) -> Self {
        Self {
            sv,
            message: &INAV,
            words: BTreeMap::new(),
            issue: None,
            complete: None,
            reduced: None,
            timed: None,
            pages: None,
        }
    }

    /// Both parts begin with the pattern, both normal or both inverted.
    fn may_begin(&self, symbols: &[f32]) -> bool {
        let is_one = |place: usize| symbols.get(place).is_some_and(|soft| *soft < 0.0);
        let pattern = |first: usize, flip: bool| {
            PATTERN.iter().enumerate().all(|(place, bit)| is_one(first + place) == (bit ^ flip))
        };
        [false, true].into_iter().any(|flip| pattern(0, flip) && pattern(PART_SYMBOLS, flip))
    }

    fn decode(&self, symbols: &[f32]) -> Option<Self::Frame> {
        decode_any(symbols)
    }

    fn read(&mut self, (parts, inverted): Self::Frame, begin: u64, near: Epoch) -> Vec<Read> {
        if is_alert(&parts) {
            return vec![Read::Refused("a page is an alert page".to_owned())];
        }
        let news = self.take(word_of(&parts), begin, inverted, near);
        let mut all = self.whole_pages(&parts, begin);
        all.extend(news);
        all
    }

    fn keep_pages(&mut self) {
        // E5b has reserved bits where E1-B has authentication (OS SIS ICD 2.1, table 37).
        if self.message == &INAV {
            self.pages = Some(Vec::new());
        }
    }

    fn forget_positions(&mut self) {
        (self.reduced, self.timed) = (None, None);
        self.pages.iter_mut().for_each(Vec::clear);
    }

    fn missing(&self) -> Vec<u8> {
        (1..=5).filter(|number| !self.words.contains_key(number)).collect()
    }
}
