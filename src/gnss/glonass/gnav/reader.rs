//! Finds strings in soft symbols, normal or inverted, learns time and sender, and gathers
//! ephemerides.

use std::collections::BTreeMap;

use super::{
    GNAV, GlonassString, MARK, MARK_SYMBOLS, STRING_SYMBOLS, STRINGS, TIME, decode_soft, elements, frame_began, id,
    parameters, slot,
};
use crate::bits::Store;
use crate::framed::{Content, Framed, Pattern, Reported};
use crate::glonass::fdma::channel;
use crate::message::Read;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Time mark of a string. With two wrong symbols one of a million positions looks like it, and the checks
/// decide.
const END: Pattern = Pattern { bits: MARK as u128, symbols: MARK_SYMBOLS, tolerated: 2 };
/// Symbols of a second.
const RATE_HZ: f64 = 100.0;

/// A string and the number of its first symbol.
type Placed = (u64, GlonassString);

/// Reader of the message.
pub type GnavReader = Framed<GnavContent>;

/// Content of a satellite's strings.
#[derive(Clone, Debug)]
pub struct GnavContent {
    sv: Sv,
    /// The latest of strings 1 to 5.
    parts: BTreeMap<u8, Placed>,
    /// The latest string 1 whose frame could be dated, and when that frame began.
    dated: Option<(u64, Epoch)>,
    reported: Reported,
    /// A time that is known to within a year.
    known: Option<Epoch>,
}

/// Symbols of the time mark, which ends a string.
fn mark(symbols: &[f32]) -> &[f32] {
    symbols.get(STRING_SYMBOLS - MARK_SYMBOLS..).unwrap_or_default()
}

impl Content for GnavContent {
    /// A string, and true if its symbols were inverted.
    type Frame = (GlonassString, bool);
    const SYMBOLS: usize = STRING_SYMBOLS;
    const FAILURES: u32 = 3;

    fn new(sv: Sv) -> Self {
        Self { sv, parts: BTreeMap::new(), dated: None, reported: Reported::default(), known: None }
    }

    fn may_begin(&self, symbols: &[f32]) -> bool {
        END.begins(mark(symbols))
    }

    fn decode(&self, symbols: &[f32]) -> Option<Self::Frame> {
        let inverted = END.is_inverted(mark(symbols));
        let inverted = planted!("gnss.glonass.mark", inverted, !inverted);
        Some((decode_soft(symbols)?, inverted))
    }

    fn read(&mut self, (string, inverted): Self::Frame, begin: u64, _: Epoch) -> Vec<Read> {
        let number = id(&string);
        let mut news = Vec::new();
        if let Some(slot) = (number == 4).then(|| slot(&string)).filter(|slot| *slot != self.sv.number) {
            // On a channel that is not its slot's nothing is known of it.
            if channel(slot).is_none() || channel(slot) != channel(self.sv.number) {
                self.forget_positions();
                return vec![Read::names_another("string 4", slot)];
            }
            // What was read under the other name is forgotten: another satellite may have sent it.
            self.sv = Sv { number: slot, ..self.sv };
            self.reported = Reported::default();
            news.push(Read::Sender(self.sv));
        }
        if number <= 5 {
            self.parts.insert(number, (begin, string));
        }
        // Strings of an earlier frame are those of another day, or ephemeris.
        let oldest = begin.saturating_sub(STRINGS * STRING_SYMBOLS as u64);
        self.parts.retain(|_, (placed, _)| *placed >= oldest);
        let start = match self.begun(begin) {
            Some(Ok(start)) => start,
            refused => {
                news.extend(refused.and_then(Result::err).map(Read::Refused));
                return news;
            }
        };
        news.push(Read::Unit { symbols: STRING_SYMBOLS as u64, of_week_s: start.tow_whole_s(), inverted });
        if number == 5 {
            news.push(Read::Time(start));
            news.push(Read::parameters(self.sv, &GNAV, 0, parameters(&string)));
        }
        self.look_for_set((begin, start), &mut news);
        news
    }

    fn know(&mut self, near: Epoch) {
        self.known = Some(near);
    }

    fn forget_positions(&mut self) {
        self.parts.clear();
        self.dated = None;
    }

    fn missing(&self) -> Vec<u8> {
        (1..=5).filter(|number| !self.parts.contains_key(number)).collect()
    }
}

impl GnavContent {
    /// Start time of the string whose first symbol is `begin`, from strings 1, 4 and 5 of the last frame or
    /// the one before. In the first frame of a day, strings 4 and 5 of the frame before it have another date.
    fn begun(&mut self, begin: u64) -> Option<Result<Epoch, String>> {
        let [one, four, five] = [1, 4, 5].map(|number| self.parts.get(&number));
        if let (Some((placed, one)), Some((at_four, four)), Some((at_five, five))) = (one, four, five) {
            let is_first_of_day = TIME.iter().all(|place| one.piece(*place) == 0);
            if !is_first_of_day || (at_four > placed && at_five > placed) {
                match frame_began(one, four, five, self.known) {
                    Ok(frame) => self.dated = Some((*placed, frame)),
                    Err(refused) => return Some(Err(refused)),
                }
            }
        }
        let (placed, frame) = self.dated?;
        let is_recent = begin.saturating_sub(placed) < 2 * STRINGS * STRING_SYMBOLS as u64;
        is_recent.then(|| Ok(frame.plus_s((begin as f64 - placed as f64) / RATE_HZ)))
    }

    fn look_for_set(&mut self, (begin, start): (u64, Epoch), news: &mut Vec<Read>) {
        let [one, two, three, four] = [1, 2, 3, 4].map(|number| self.parts.get(&number));
        let (Some(one), Some(two), Some(three), Some(four)) = (one, two, three, four) else { return };
        let sent = |placed: &Placed| start.plus_s((placed.0 as f64 - begin as f64) / RATE_HZ);
        let set = elements(self.sv, [&one.1, &two.1, &three.1, &four.1], sent(one));
        // Ephemerides change where their half hours end, which belongs to the next: all four were sent
        // before.
        let half_s = 0.5 * set.fit_interval_s();
        let is_of_set = |placed: &Placed| (-half_s..half_s).contains(&sent(placed).since(set.toe));
        if ![one, two, three, four].into_iter().all(is_of_set) {
            return;
        }
        let all = [one, two, three, four].into_iter().flat_map(|(_, string)| parameters(string)).collect();
        self.reported.take(GNAV.name, all, set, news);
    }
}
