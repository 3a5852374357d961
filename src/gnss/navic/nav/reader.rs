//! Finds subframes in soft symbols, normal or inverted, and collects their content.

use std::collections::BTreeMap;

use super::{
    ELECTRONS, PATTERN, PATTERN_SYMBOLS, SPS_NAV, SUBFRAME_SYMBOLS, Subframe, UTC, began_s, coefficients, decode_soft,
    elements, id, message_type, parameters, sent_at,
};
use crate::bits::upright;
use crate::framed::{Content, Framed, Pattern, Reported};
use crate::message::Read;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Pattern of a subframe. With two wrong symbols one of 240 positions looks like it, and the check decides.
const BEGIN: Pattern = Pattern { bits: PATTERN, symbols: PATTERN_SYMBOLS, tolerated: 2 };

/// Reader of NavIC's message.
pub type NavReader = Framed<NavContent>;

/// Content of a satellite's subframes.
#[derive(Clone, Debug)]
pub struct NavContent {
    sv: Sv,
    /// The latest of subframes 1 and 2.
    set: BTreeMap<u8, Subframe>,
    reported: Reported,
}

impl Content for NavContent {
    /// A subframe, and true if its symbols were inverted.
    type Frame = (Subframe, bool);
    const SYMBOLS: usize = SUBFRAME_SYMBOLS;
    const FAILURES: u32 = 3;

    fn new(sv: Sv) -> Self {
        Self { sv, set: BTreeMap::new(), reported: Reported::default() }
    }

    fn may_begin(&self, symbols: &[f32]) -> bool {
        BEGIN.begins(symbols)
    }

    fn decode(&self, symbols: &[f32]) -> Option<Self::Frame> {
        let inverted = BEGIN.is_inverted(symbols);
        Some((decode_soft(&upright(symbols, inverted))?, inverted))
    }

    fn read(&mut self, (subframe, inverted): Self::Frame, _: u64, near: Epoch) -> Vec<Read> {
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
                news.push(Read::parameters(self.sv, &SPS_NAV, 0, parameters(&subframe)));
            }
            (_, UTC) => news.push(Read::parameters(self.sv, &SPS_NAV, 0, parameters(&subframe))),
            _ => {}
        }
        news
    }

    fn missing(&self) -> Vec<u8> {
        [1, 2].into_iter().filter(|number| !self.set.contains_key(number)).collect()
    }
}

impl NavContent {
    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let (Some(one), Some(two)) = (self.set.get(&1), self.set.get(&2)) else { return };
        let all = [parameters(one), parameters(two)].concat();
        let set = || elements(self.sv, one, two, near);
        self.reported.take_whole(SPS_NAV.name, all, (set, "subframes 1 and 2"), news);
    }
}
