//! Finds frames in soft symbols, normal or inverted, and collects their content.
//!
//! Where a frame begins shows in the code words of number and time, which is right by chance at times: the
//! check of subframe 2 decides.

use super::{B_CNAV1, Frame, SYMBOLS, SYMBOLS_1, beside_in, decode, elements, likely_time, of_set_in};
use crate::beidou::bcnav::{Accuracies, accuracies_in, electrons_in};
use crate::framed::{Content, Framed, Reported};
use crate::message::{Parameters, Read};
use crate::satellite::Sv;
use crate::time::Epoch;

/// Least agreement of 72 symbols with a time at which a frame is tried. Symbols with an amplitude of √2
/// standard deviations, near which the codes begin to fail, agree by 0.89 ± 0.05. The best of all times among
/// data symbols agrees by less than half.
const LEAST_SHARE: f32 = 0.65;

/// Reader of B-CNAV1.
pub type BCnav1Reader = Framed<BCnav1Content>;

/// Content of a satellite's frames.
#[derive(Clone, Debug)]
pub struct BCnav1Content {
    sv: Sv,
    reported: Reported,
    /// The coefficients of the ionosphere that were reported last, and of which issue.
    electrons: Option<(u32, Parameters)>,
    accuracies: Accuracies,
}

impl Content for BCnav1Content {
    type Frame = Frame;
    const SYMBOLS: usize = SYMBOLS;

    fn new(sv: Sv) -> Self {
        Self { sv, reported: Reported::default(), electrons: None, accuracies: Accuracies::default() }
    }

    fn may_begin(&self, symbols: &[f32]) -> bool {
        symbols.get(..SYMBOLS_1).is_some_and(|first| likely_time(self.sv.number, first).1.abs() > LEAST_SHARE)
    }

    fn decode(&self, symbols: &[f32]) -> Option<Frame> {
        decode(self.sv.number, symbols)
    }

    fn read(&mut self, frame: Frame, _: u64, near: Epoch) -> Vec<Read> {
        let sent = frame.sent_at(near);
        let unit = Read::Unit { symbols: SYMBOLS as u64, of_week_s: frame.of_week_s(), inverted: frame.0.inverted };
        let mut news = vec![unit, Read::Time(sent)];
        let Some(beside) = &frame.0.three else { return news };
        let all = of_set_in(&frame.0.two, beside);
        let set = elements(self.sv, &frame.0.two, beside, sent);
        // A frame is of one ephemeris, and what it says besides bears its issue.
        let issue = u32::from(set.iode);
        let beside = beside_in(beside);
        let accuracies = self.accuracies.take(issue, &accuracies_in(&beside));
        news.extend(accuracies.map(|raws| Read::parameters(self.sv, &B_CNAV1, issue, raws)));
        if let Some((coefficients, raws)) = electrons_in(&beside) {
            news.push(Read::Ionosphere(coefficients));
            let own = Some((issue, raws));
            if self.electrons != own {
                news.extend(own.iter().map(|(issue, raws)| Read::parameters(self.sv, &B_CNAV1, *issue, raws.clone())));
                self.electrons = own;
            }
        }
        self.reported.take(B_CNAV1.name, all, set, &mut news);
        news
    }

    fn missing(&self) -> Vec<u8> {
        self.reported.missing()
    }
}
