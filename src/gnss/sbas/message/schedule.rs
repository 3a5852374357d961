//! Schedule of the correction messages.
//!
//! Of each round of six seconds the first two have types 12 and 9. Then come the fast corrections of all
//! satellites of the mask, as each six seconds at least there is an indicator of their accuracy; of a last
//! part of six satellites or fewer, type 24 has them. The rest of the round takes turns: the masks, the
//! long-term corrections, how corrections age, the grid, integrity, and type 10 where it is sent. While a
//! satellite's alarm is new, the last second of each round states the integrity of all (type 6).
//!
//! The tests hold the longest intervals of RTCA DO-229D, table A-25: 6 s for accuracies, 120 s for the mask
//! and long-term corrections, 300 s for the grid. Limits: where most of more than 26 satellites have rates, a
//! long-term correction comes after three minutes; receivers keep it for four.

use crate::augmentation::accuracy::{DO_NOT_USE, NOT_MONITORED, givei_of};
use crate::augmentation::{
    ALARM, Content, DELAY_SLOTS, Degradation, Delays, FAST_SLOTS, Fast, GridMask, Half, Integrity, Known, LongTerm,
    MASKED, MIXED_SLOTS, Mask, Mixed, Network,
};
use crate::time::Epoch;

/// Seconds of a round, and how many of them are other types' than corrections.
const ROUND_S: i64 = 6;
const TAKEN: usize = 2;
/// Most parts of thirteen that leave a second of each round for the rest.
const PARTS: usize = 3;
/// Rounds in which an alarm is new: it is repeated three times (A.4.4.4).
const NEW_ROUNDS: i64 = 4;
/// Issues of fast corrections that are no alarm, in turn.
const ISSUES: i64 = 3;
/// Issue of the masks: they stay as they are for a whole scene.
const ISSUE: u8 = 0;
/// The largest delay of a point of the grid; one step more states that it is not to be used (A.4.4.10).
const LARGEST_DELAY_M: f64 = 63.75;

/// Block that is sent when its turn comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    Mask,
    LongTerm(usize),
    Degradation,
    Factors,
    GridMask(usize),
    Delays(usize, usize),
    Integrity,
}

/// Satellites of the mask: as many as there are seconds for.
fn masked(network: &dyn Network) -> &[u8] {
    let all = network.numbers();
    all.get(..PARTS * FAST_SLOTS).unwrap_or(all)
}

/// Blocks that take turns, for `halves` half blocks of long-term corrections, two to a block.
fn turns(network: &dyn Network, halves: usize) -> Vec<Turn> {
    let blocks = halves.div_ceil(2);
    let bands = network.bands();
    let delays = (0..).zip(bands).flat_map(|(band, (_, points))| {
        (0..points.len().div_ceil(DELAY_SLOTS)).map(move |part| Turn::Delays(band, part))
    });
    std::iter::once(Turn::Mask)
        .chain((0..blocks).map(Turn::LongTerm))
        .chain((0..bands.len()).map(Turn::GridMask))
        .chain(delays)
        .chain([Turn::Degradation, Turn::Integrity])
        .chain(network.factors().map(|_| Turn::Factors))
        .collect()
}

/// Content that a network sends in the block that begins at `start`; `None` if there is none.
pub(super) fn said(network: &dyn Network, start: Epoch) -> Option<Content> {
    let at = At { network, start, numbers: masked(network) };
    let parts = at.numbers.len().div_ceil(FAST_SLOTS);
    let slot = (start.tow_whole_s().rem_euclid(ROUND_S) as usize).checked_sub(TAKEN)?;
    if slot < parts {
        return Some(at.fast_block(slot));
    }
    if slot + TAKEN + 1 == ROUND_S as usize && (0..parts).any(|part| at.is_new_alarm(part)) {
        return Some(at.integrity());
    }
    let halves = at.halves();
    let turns = turns(network, halves.len());
    let free = ROUND_S as usize - TAKEN - parts;
    let count = at.round() as usize * free + slot - parts;
    match *turns.get(count % turns.len())? {
        Turn::Mask => Some(Content::Mask(Mask { iodp: ISSUE, numbers: at.numbers.to_vec() })),
        Turn::LongTerm(block) => {
            let half = |place: usize| halves.get(2 * block + place).cloned().unwrap_or_else(empty);
            Some(Content::LongTerm(Box::new([0, 1].map(half))))
        }
        Turn::Degradation => Some(at.degradation()),
        Turn::Factors => network.factors().map(|factors| Content::Factors(Box::new(factors))),
        Turn::GridMask(place) => at.grid_mask(place),
        Turn::Delays(place, part) => at.delays(place, part),
        Turn::Integrity => Some(at.integrity()),
    }
}

/// Half a block about no satellite.
fn empty() -> Half {
    Half::Steady { iodp: ISSUE, both: [LongTerm::default(); 2] }
}

/// Knowledge of a network at a time.
struct At<'n> {
    network: &'n dyn Network,
    start: Epoch,
    numbers: &'n [u8],
}

impl At<'_> {
    fn round(&self) -> i64 {
        self.start.seconds().div_euclid(ROUND_S)
    }

    fn known(&self, place: usize) -> Option<Known> {
        self.numbers.get(place).map(|number| self.network.satellite(*number, self.start))
    }

    /// True if a satellite in a part of the mask became unusable within the last rounds.
    fn is_new_alarm(&self, part: usize) -> bool {
        let before = self.start.plus_s(-(NEW_ROUNDS * ROUND_S) as f64);
        let own = self.numbers.iter().skip(part * FAST_SLOTS).take(FAST_SLOTS);
        let out = |number: u8, at: Epoch| self.network.satellite(number, at).udrei == DO_NOT_USE;
        own.copied().any(|number| out(number, self.start) && !out(number, before))
    }

    fn iodf(&self, part: usize) -> u8 {
        if self.is_new_alarm(part) { ALARM } else { self.round().rem_euclid(ISSUES) as u8 }
    }

    fn fast(&self, part: usize) -> Fast {
        let mut fast = Fast { iodf: self.iodf(part), iodp: ISSUE, ..Fast::unmonitored(part as u8) };
        let slots = fast.correction_m.iter_mut().zip(&mut fast.udrei);
        for ((correction_m, udrei), place) in slots.zip(part * FAST_SLOTS..) {
            if let Some(known) = self.known(place) {
                (*correction_m, *udrei) = (known.correction_m, known.udrei);
            }
        }
        fast
    }

    fn fast_block(&self, part: usize) -> Content {
        let fast = self.fast(part);
        let own = self.numbers.len() - part * FAST_SLOTS;
        if self.network.is_test() && part == 0 {
            return Content::Fast(Fast { is_test: true, ..fast });
        }
        if own > MIXED_SLOTS {
            return Content::Fast(fast);
        }
        let halves = self.halves();
        let half = halves.get(self.round() as usize % halves.len().max(1)).cloned().unwrap_or_else(empty);
        Content::Mixed(Box::new(Mixed { fast, half }))
    }

    /// Long-term corrections of all satellites that are in use: two in a half, or one where it has rates.
    fn halves(&self) -> Vec<Half> {
        let of = |place: usize| {
            let known = self.known(place).filter(|known| known.udrei < NOT_MONITORED)?;
            Some((known.is_moving, LongTerm { place: place as u8 + 1, ..known.long_term }))
        };
        let all = (0..self.numbers.len()).filter_map(of);
        let (moving, steady): (Vec<_>, Vec<_>) = all.partition(|(is_moving, _)| *is_moving);
        let steady: Vec<LongTerm> = steady.into_iter().map(|(_, one)| one).collect();
        let two = |pair: &[LongTerm]| {
            let both = [0, 1].map(|place: usize| pair.get(place).copied().unwrap_or_default());
            Half::Steady { iodp: ISSUE, both }
        };
        let single = moving.into_iter().map(|(_, one)| Half::Moving { iodp: ISSUE, one });
        steady.chunks(2).map(two).chain(single).collect()
    }

    fn integrity(&self) -> Content {
        let udrei = std::array::from_fn(|place| self.known(place).map_or(NOT_MONITORED, |known| known.udrei));
        let iodf = std::array::from_fn(|part| self.iodf(part));
        Content::Integrity(Box::new(Integrity { iodf, udrei }))
    }

    fn degradation(&self) -> Content {
        let of = |place| self.known(place).map_or(0, |known| known.degradation);
        let indicators: [u8; MASKED] = std::array::from_fn(of);
        Content::Degradation(Box::new(Degradation { latency_s: 0, iodp: ISSUE, indicators }))
    }

    fn grid_mask(&self, place: usize) -> Option<Content> {
        let bands = self.network.bands();
        let (band, points) = bands.get(place)?;
        let mask = GridMask { bands: bands.len() as u8, band: *band, iodi: ISSUE, points: points.clone() };
        Some(Content::GridMask(mask))
    }

    fn delays(&self, place: usize, part: usize) -> Option<Content> {
        let (band, points) = self.network.bands().get(place)?;
        let mut delays = Delays { band: *band, part: part as u8, iodi: ISSUE, ..Delays::default() };
        delays.givei = [DO_NOT_USE; DELAY_SLOTS];
        let slots = delays.vertical_m.iter_mut().zip(&mut delays.givei);
        for ((vertical_m, givei), point) in slots.zip(points.iter().skip(part * DELAY_SLOTS)) {
            let known = self.network.vertical_m(*band, *point, self.start);
            if let Some((delay_m, bound_m)) = known.filter(|(delay_m, _)| (0.0..LARGEST_DELAY_M).contains(delay_m)) {
                (*vertical_m, *givei) = (delay_m, givei_of(bound_m));
            }
        }
        Some(Content::Delays(Box::new(delays)))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// Network with satellites of these numbers, two of which have rates, and grid points of two bands.
    #[derive(Debug)]
    struct Made {
        numbers: Vec<u8>,
        bands: Vec<(u8, Vec<u8>)>,
        alarm: Option<(u8, Epoch)>,
    }

    impl Network for Made {
        fn is_test(&self) -> bool {
            false
        }

        fn numbers(&self) -> &[u8] {
            &self.numbers
        }

        fn satellite(&self, number: u8, at: Epoch) -> Known {
            let out = self.alarm.is_some_and(|(own, from)| own == number && at.since(from) >= 0.0);
            let long_term =
                LongTerm { iode: number, place_m: [0.125 * f64::from(number), 0.0, -1.0], ..LongTerm::default() };
            Known {
                correction_m: f64::from(number),
                udrei: if out { DO_NOT_USE } else { 0 },
                degradation: 0,
                long_term,
                is_moving: number == 5 || number == 6,
            }
        }

        fn bands(&self) -> &[(u8, Vec<u8>)] {
            &self.bands
        }

        fn vertical_m(&self, _: u8, point: u8, _: Epoch) -> Option<(f64, f64)> {
            Some((f64::from(point) * 0.125, 0.5))
        }
    }

    fn made(count: u8) -> Made {
        let bands = vec![(1, (1..=40).collect()), (2, (7..=50).collect())];
        Made { numbers: (1..=count).collect(), bands, alarm: None }
    }

    /// The longest intervals of table A-25, over a quarter of an hour, for any constellation of GPS.
    #[test]
    fn no_correction_comes_later_than_the_standard_allows() {
        let begin = Epoch::from_week(2409, 100_000.0);
        for count in [1, 6, 7, 13, 14, 19, 26, 31, 32] {
            let network = made(count);
            let mut last: BTreeMap<String, i64> = BTreeMap::new();
            let mut worst: BTreeMap<String, i64> = BTreeMap::new();
            let mut note = |what: String, second: i64| {
                let since = second - last.insert(what.clone(), second).unwrap_or(0);
                let slot = worst.entry(what).or_default();
                *slot = since.max(*slot);
            };
            for second in 0..900 {
                let start = begin.plus_s(f64::from(second as i32));
                let Some(content) = said(&network, start) else { continue };
                let halves = match &content {
                    Content::Mixed(mixed) => vec![mixed.half.clone()],
                    Content::LongTerm(halves) => halves.to_vec(),
                    _ => Vec::new(),
                };
                for one in halves.iter().flat_map(Half::each) {
                    note(format!("120 of G{:02}", one.place), second);
                }
                let fast = match &content {
                    Content::Fast(fast) => Some(fast),
                    Content::Mixed(mixed) => Some(&mixed.fast),
                    _ => None,
                };
                if let Some(fast) = fast {
                    note(format!("6 part {}", fast.part), second);
                }
                match content {
                    Content::Mask(_) => note("120 mask".to_owned(), second),
                    Content::Degradation(_) => note("120 degradation".to_owned(), second),
                    Content::GridMask(mask) => note(format!("300 band {}", mask.band), second),
                    Content::Delays(delays) => note(format!("300 {} {}", delays.band, delays.part), second),
                    _ => {}
                }
            }
            let count = usize::from(count);
            let kinds = count + count.div_ceil(FAST_SLOTS) + 2 + 2 + 6;
            assert_eq!(worst.len(), kinds, "{count}: {worst:?}");
            for (what, since_s) in worst {
                let allowed_s: i64 = what.split(' ').next().unwrap().parse().unwrap();
                assert!(since_s <= allowed_s, "{count}: {what} after {since_s} s");
            }
        }
    }

    #[test]
    fn an_alarm_is_said_within_six_seconds_and_four_times_and_its_issue_is_three() {
        let from = Epoch::from_week(2409, 100_003.0);
        let network = Made { alarm: Some((7, from)), ..made(9) };
        let mut said_at = Vec::new();
        for second in 0..60 {
            let start = from.plus_s(f64::from(second));
            match said(&network, start) {
                Some(Content::Fast(fast)) => {
                    assert_eq!(fast.udrei[6], DO_NOT_USE);
                    assert_eq!(fast.iodf == ALARM, second < 24, "{second}");
                    said_at.push(second);
                }
                Some(Content::Integrity(integrity)) => {
                    assert_eq!((integrity.udrei[6], integrity.udrei[5]), (DO_NOT_USE, 0));
                    assert_eq!(integrity.iodf[0] == ALARM, second < 24, "{second}");
                    said_at.push(second);
                }
                _ => {}
            }
        }
        assert!(said_at[0] <= 6 && said_at.iter().filter(|at| **at < 24).count() >= 4, "{said_at:?}");
    }
}
