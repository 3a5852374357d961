//! Finds subframes in soft symbols, normal or inverted, and collects their content.

use std::collections::{BTreeMap, VecDeque};

use super::{
    ELECTRONS, PATTERN, PATTERN_SYMBOLS, SPS_NAV, SUBFRAME_SYMBOLS, Subframe, UTC, began_s, coefficients, decode_soft,
    elements, id, message_type, parameters, sent_at,
};
use crate::bits::bits_of;
use crate::message::{Read, Reader};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Subframes in a row that fail where they are expected before they are sought elsewhere.
const FAILURES: u32 = 3;
/// Symbols of the pattern that may be wrong: one of 240 positions looks like it then, and the check decides.
const TOLERATED: usize = 2;

/// Reads NavIC's message.
#[derive(Clone, Debug)]
pub struct NavReader {
    sv: Sv,
    /// The latest symbols, a subframe at most; `next` numbers the one to come.
    symbols: VecDeque<f32>,
    next: u64,
    /// Number of the first symbol of some subframe, and those that failed since the last one that did not.
    frame: Option<u64>,
    failures: u32,
    /// The latest of subframes 1 and 2.
    set: BTreeMap<u8, Subframe>,
    /// Parameters of the ephemeris that was reported last, without the transmission times.
    complete: Option<Vec<(&'static str, i64)>>,
}

impl NavReader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self {
            sv,
            symbols: VecDeque::with_capacity(SUBFRAME_SYMBOLS),
            next: 0,
            frame: None,
            failures: 0,
            set: BTreeMap::new(),
            complete: None,
        }
    }

    /// Number of symbols that agree with the synchronisation pattern.
    fn alike(&self) -> usize {
        let pattern = bits_of(u128::from(PATTERN), PATTERN_SYMBOLS);
        self.symbols.iter().zip(pattern).filter(|(soft, one)| (**soft < 0.0) == *one).count()
    }

    /// Takes a subframe whose newest symbol is the last.
    fn read(&mut self, subframe: Subframe, inverted: bool, near: Epoch) -> Vec<Read> {
        let mut news = Vec::new();
        if let Some(of_week_s) = began_s(&subframe) {
            news.push(Read::Unit { symbols: SUBFRAME_SYMBOLS as u64, of_week_s, inverted });
        } else {
            news.push(Read::Refused("the count of the time of week is beyond the week".to_owned()));
        }
        match (id(&subframe), message_type(&subframe)) {
            (1, _) => {
                news.extend(sent_at(&subframe, near).map(Read::Time));
                self.set.insert(1, subframe);
                self.look_for_set(near, &mut news);
            }
            (2, _) => {
                self.set.insert(2, subframe);
                self.look_for_set(near, &mut news);
            }
            (_, ELECTRONS) => {
                news.push(Read::Ionosphere(coefficients(&subframe)));
                news.push(Read::Parameters(self.rows(0, parameters(&subframe))));
            }
            (_, UTC) => news.push(Read::Parameters(self.rows(0, parameters(&subframe)))),
            _ => {}
        }
        news
    }

    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let (Some(one), Some(two)) = (self.set.get(&1), self.set.get(&2)) else { return };
        let Some(set) = elements(self.sv, one, two, near) else {
            news.extend(self.complete.is_none().then(|| Read::make_no_set("subframes 1 and 2")));
            return;
        };
        let content: Vec<(&'static str, i64)> = [parameters(one), parameters(two)].concat();
        if self.complete.as_ref() == Some(&content) {
            return;
        }
        let rows = self.rows(u32::from(set.iode), content.clone());
        news.push(Read::Ephemeris(Box::new(set)));
        news.push(Read::Parameters(rows));
        self.complete = Some(content);
    }

    fn rows(&self, issue: u32, parameters: Vec<(&'static str, i64)>) -> Vec<NavigationRow> {
        NavigationRow::each(self.sv, SPS_NAV.name, issue, parameters).collect()
    }
}

impl Reader for NavReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        if self.symbols.len() == SUBFRAME_SYMBOLS {
            self.symbols.pop_front();
        }
        self.symbols.push_back(soft);
        self.next += 1;
        let Some(begin) =
            self.next.checked_sub(SUBFRAME_SYMBOLS as u64).filter(|_| self.symbols.len() == SUBFRAME_SYMBOLS)
        else {
            return Vec::new();
        };
        let due = self.frame.map(|frame| begin.abs_diff(frame).is_multiple_of(SUBFRAME_SYMBOLS as u64));
        if due == Some(false) {
            return Vec::new();
        }
        let alike = self.alike();
        if due.is_none() && (TOLERATED + 1..PATTERN_SYMBOLS - TOLERATED).contains(&alike) {
            return Vec::new();
        }
        let inverted = alike < PATTERN_SYMBOLS / 2;
        let upright: Vec<f32> = self.symbols.iter().map(|soft| if inverted { -soft } else { *soft }).collect();
        match decode_soft(&upright) {
            Some(subframe) => {
                (self.frame, self.failures) = (Some(begin), 0);
                self.read(subframe, inverted, near)
            }
            None => {
                self.failures += u32::from(due.is_some());
                if self.failures >= FAILURES {
                    self.doubt();
                }
                Vec::new()
            }
        }
    }

    fn skip(&mut self) {
        self.symbols.clear();
        self.doubt();
    }

    fn doubt(&mut self) {
        (self.frame, self.failures) = (None, 0);
    }

    fn missing(&self) -> Vec<u8> {
        [1, 2].into_iter().filter(|number| !self.set.contains_key(number)).collect()
    }
}
