//! Finds bits and subframes in the soft values of code periods, normal or inverted, and gathers
//! ephemerides.

use std::collections::{BTreeMap, VecDeque};

use super::{
    D1_D2, D1_PARTS, D1_SYMBOLS, D2_PAGE, D2_PARTS, D2_SYMBOLS, SUBFRAME_BITS, Subframe, UNIT_S, chip, decode, given,
    id, numbered, orbit_of, second, sent_at,
};
use crate::bits::Store;
use crate::message::{Read, Reader};
use crate::satellite::Sv;
use crate::time::{Epoch, WEEK_S};

/// Bits over which the position of their edges is sought: half a second of D1, 0.2 s of D2.
const D1_SOUGHT: u64 = 25;
const D2_SOUGHT: u64 = 100;
/// Share of the best position's energy that any other has at most: of the wrong positions of D1's code the
/// best has a ninth without noise, of D2's half.
const NEXT_SHARE: f64 = 0.7;
/// Subframes in a row that fail where they are expected before bits are searched again.
const FAILURES: u32 = 3;

/// Reads D1 or D2, as the satellite's number states.
#[derive(Clone, Debug)]
pub struct D1D2Reader {
    sv: Sv,
    /// Symbols of a bit.
    per_bit: usize,
    /// The latest symbols, a bit at most; `next` numbers the one to come.
    symbols: VecDeque<f32>,
    next: u64,
    /// Energies of bits by the residue of their last symbol, and how many symbols were taken for them.
    energies: Vec<f64>,
    sought: u64,
    /// The residue of bits' last symbols.
    edge: Option<u64>,
    /// The latest bits, a subframe at most.
    bits: VecDeque<bool>,
    /// Number of the symbol after some subframe, and those that failed since the last one that did not.
    frame: Option<u64>,
    failures: u32,
    /// The latest parts of an ephemeris: subframes of D1, pages of D2.
    parts: BTreeMap<u8, Subframe>,
    complete: Option<Vec<(&'static str, i64)>>,
}

impl D1D2Reader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        let per_bit = if sv.is_geostationary() { D2_SYMBOLS } else { D1_SYMBOLS };
        Self {
            sv,
            per_bit,
            symbols: VecDeque::with_capacity(per_bit),
            next: 0,
            energies: vec![0.0; per_bit],
            sought: 0,
            edge: None,
            bits: VecDeque::with_capacity(SUBFRAME_BITS),
            frame: None,
            failures: 0,
            parts: BTreeMap::new(),
            complete: None,
        }
    }

    fn is_d2(&self) -> bool {
        self.per_bit == D2_SYMBOLS
    }

    /// Parts of an ephemeris.
    fn wanted(&self) -> u8 {
        (if self.is_d2() { D2_PARTS } else { D1_PARTS }) as u8
    }

    /// The latest symbols as one bit: positive for a logical 0.
    fn bit(&self) -> f32 {
        let chips = self.symbols.iter().enumerate();
        chips.map(|(place, soft)| if !self.is_d2() && chip(place) { -soft } else { *soft }).sum()
    }

    /// Looks for the position of bits.
    fn seek(&mut self) {
        let energy = f64::from(self.bit()).powi(2);
        let residue = (self.next - 1) % self.per_bit as u64;
        if let Some(sum) = self.energies.get_mut(residue as usize) {
            *sum += energy;
        }
        self.sought += 1;
        let bits = if self.is_d2() { D2_SOUGHT } else { D1_SOUGHT };
        if self.sought < bits * self.per_bit as u64 {
            return;
        }
        let best = (0_u64..).zip(&self.energies).max_by(|a, b| a.1.total_cmp(b.1));
        let Some((place, most)) = best.map(|(place, most)| (place, *most)) else { return };
        let others = (0_u64..).zip(&self.energies).filter(|(other, _)| *other != place);
        let next = others.fold(0.0_f64, |next, (_, energy)| next.max(*energy));
        if next < NEXT_SHARE * most {
            self.edge = Some(place);
        }
        self.energies.fill(0.0);
        self.sought = 0;
    }

    /// Looks at the newest 300 bits as a subframe.
    fn look(&mut self, near: Epoch) -> Vec<Read> {
        if self.bits.len() < SUBFRAME_BITS {
            return Vec::new();
        }
        let symbols = (SUBFRAME_BITS * self.per_bit) as u64;
        let due = self.frame.map(|frame| self.next.abs_diff(frame).is_multiple_of(symbols));
        if due == Some(false) {
            return Vec::new();
        }
        let sent: Vec<bool> = self.bits.iter().copied().collect();
        let turned: Vec<bool> = sent.iter().map(|bit| !bit).collect();
        let found = decode(&sent).map(|found| (found, false)).or_else(|| Some((decode(&turned)?, true)));
        let Some((subframe, inverted)) = found else {
            self.failures += u32::from(due.is_some());
            if self.failures >= FAILURES {
                self.doubt();
            }
            return Vec::new();
        };
        (self.frame, self.failures) = (Some(self.next), 0);
        self.read(subframe, inverted, near)
    }

    fn read(&mut self, subframe: Subframe, inverted: bool, near: Epoch) -> Vec<Read> {
        // D2 says when its frame began, the first of five subframes.
        let subframes = if self.is_d2() { u64::from(id(&subframe)) } else { 1 };
        let symbols = subframes * (SUBFRAME_BITS * self.per_bit) as u64;
        let early = planted!("gnss.beidou.second_read", 0, 6);
        let of_week_s = (i64::from(second(&subframe)) + early) % WEEK_S;
        let mut news = vec![Read::Unit { symbols, of_week_s, inverted }];
        let part = match (self.is_d2(), id(&subframe)) {
            (true, 1) => subframe.piece(D2_PAGE) as u8,
            (false, number) => number,
            (true, _) => 0,
        };
        if part == 1 {
            news.push(Read::Time(sent_at(&subframe, self.is_d2(), near)));
        }
        if (1..=self.wanted()).contains(&part) {
            self.parts.insert(part, subframe);
            self.look_for_set(near, &mut news);
        }
        news
    }

    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let parts: Vec<Subframe> = self.parts.values().cloned().collect();
        let Some(first) = parts.first().filter(|_| parts.len() == usize::from(self.wanted())) else { return };
        let sent = sent_at(first, self.is_d2(), near);
        let (orbit, content) = orbit_of(self.sv, &parts, sent);
        let klobuchar = orbit.klobuchar;
        let set = numbered(orbit.ephemeris);
        // Equal reference times show that clock and orbit belong together, and else that one frame has both,
        // for ephemerides change between frames.
        let frame_of = |part: &Subframe| i64::from(second(part)) / UNIT_S;
        if set.toe != set.toc && parts.iter().any(|part| frame_of(part) != frame_of(first)) {
            news.extend(self.complete.is_none().then(|| Read::make_no_set("the latest subframes")));
            return;
        }
        // An ephemeris is sent from its reference time on: an older part is of the one before.
        let toe_s = set.toe.tow_whole_s();
        let is_later = |part: &Subframe| {
            let since_s = (i64::from(second(part)) - toe_s + WEEK_S / 2).rem_euclid(WEEK_S) - WEEK_S / 2;
            since_s >= 0
        };
        if !parts.iter().all(is_later) || self.complete.as_ref() == Some(&content) {
            return;
        }
        let rows = Read::parameters(self.sv, &D1_D2, u32::from(set.iode), content.clone());
        news.push(Read::Ephemeris(Box::new(set)));
        news.extend(given(klobuchar).map(Read::Ionosphere));
        news.push(rows);
        self.complete = Some(content);
    }
}

impl Reader for D1D2Reader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        if self.symbols.len() == self.per_bit {
            self.symbols.pop_front();
        }
        self.symbols.push_back(soft);
        self.next += 1;
        if self.symbols.len() < self.per_bit {
            return Vec::new();
        }
        let Some(edge) = self.edge else {
            self.seek();
            return Vec::new();
        };
        if (self.next - 1) % self.per_bit as u64 != edge {
            return Vec::new();
        }
        if self.bits.len() == SUBFRAME_BITS {
            self.bits.pop_front();
        }
        self.bits.push_back(self.bit() < 0.0);
        self.look(near)
    }

    fn skip(&mut self) {
        self.symbols.clear();
        self.bits.clear();
        self.doubt();
    }

    fn doubt(&mut self) {
        (self.frame, self.failures, self.edge, self.sought) = (None, 0, None, 0);
        self.energies.fill(0.0);
        self.bits.clear();
    }

    fn missing(&self) -> Vec<u8> {
        (1..=self.wanted()).filter(|part| !self.parts.contains_key(part)).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::beidou::d1d2::D1_D2;
    use crate::broadcast::Ephemeris;
    use crate::message::{Common, Read};
    use crate::rinex;
    use crate::time::{BDT, Epoch};

    /// Records of C06 of 2026-03-09 as a merged broadcast file has them (BRD400DLR of that day; facts): an
    /// ephemeris with an orbit an hour after its clock, and the ephemeris of that later hour.
    const RECORDS: &str = "     4.02           NAVIGATION DATA     M                   RINEX VERSION / TYPE
                                                            END OF HEADER
> EPH C06 D1
C06 2026 03 09 10 00 00-5.743734072894e-05-2.088729189609e-11-1.355252715607e-18
     3.000000000000e+00-1.409218750000e+02 1.514348792991e-09 9.606621144502e-01
    -4.454515874386e-06 5.344783887267e-03 1.278659328818e-05 6.493863193512e+03
     1.260000000000e+05 1.532025635242e-07-3.182743444897e-02 1.429580152035e-07
     9.484289784224e-01-1.596562500000e+02-2.480283272977e+00-1.989368579472e-09
    -3.828730910582e-10 0.000000000000e+00 1.053000000000e+03 0.000000000000e+00
     2.000000000000e+00 0.000000000000e+00 8.400000000000e-09-1.400000000000e-09
     1.259700000000e+05 2.000000000000e+00
";
    const LATER: &str = "\
> EPH C06 D1
C06 2026 03 09 11 00 00-5.751254502684e-05-2.089706185870e-11-1.355252715607e-18
     4.000000000000e+00-1.409218750000e+02 1.514348792991e-09 9.606621144502e-01
    -4.454515874386e-06 5.344783887267e-03 1.278659328818e-05 6.493863193512e+03
     1.260000000000e+05 1.532025635242e-07-3.182743444897e-02 1.429580152035e-07
     9.484289784224e-01-1.596562500000e+02-2.480283272977e+00-1.989368579472e-09
    -3.828730910582e-10 0.000000000000e+00 1.053000000000e+03 0.000000000000e+00
     2.000000000000e+00 0.000000000000e+00 8.400000000000e-09-1.400000000000e-09
     1.260000000000e+05 2.000000000000e+00
";

    /// Ephemerides decoded from frames. Each frame has its start, in seconds after the first reference time,
    /// and its ephemeris.
    fn read(frames: &[(i64, &Ephemeris)]) -> Vec<Ephemeris> {
        let first = frames[0].1;
        let (sender, mut reader) = ((D1_D2.sender)(&Common::default()).unwrap(), (D1_D2.reader)(first.sv));
        let mut sets = Vec::new();
        for (late_s, set) in frames {
            let own = (*set).clone().timed(|at| BDT.label(at));
            let start = BDT.label(first.toe).plus_s(*late_s as f64);
            for symbol in sender.unit(&own, start).unwrap() {
                let news = reader.take(if symbol { -1.0 } else { 1.0 }, start);
                sets.extend(news.into_iter().filter_map(|read| match read {
                    Read::Ephemeris(set) => Some(set.timed(|label| BDT.instant(label))),
                    _ => None,
                }));
            }
        }
        sets
    }

    #[test]
    fn a_set_whose_clock_is_older_than_its_orbit_is_kept_sent_and_read_where_one_frame_has_both() {
        let file = rinex::read(RECORDS.as_bytes(), "C06").unwrap();
        assert!(file.skipped.is_empty(), "{:?}", file.skipped);
        let [set] = file.ephemerides.as_slice() else { panic!("{file:?}") };
        let label = |at: Epoch| BDT.label(at).tow_s();
        assert_eq!((label(set.toc), label(set.toe)), (122_400.0, 126_000.0));
        // Where bits begin is found in the first half second, so that the first frame lacks its first
        // subframe.
        let sets = read(&[(0, set), (30, set)]);
        let [back] = sets.as_slice() else { panic!("{sets:?}") };
        assert_eq!((back.toc, back.toe), (set.toc, set.toe));
        assert!((back.af0_s - set.af0_s).abs() < 1e-15 && (back.m0_rad - set.m0_rad).abs() < 1e-11);
        // Two ephemerides that follow one another are not joined: the first frame has the orbit, the next one
        // the clock.
        let whole = Ephemeris { toc: set.toe, ..set.clone() };
        assert!(read(&[(0, &whole), (30, set)]).iter().all(|back| back.toc == set.toc));
        // Beside the ephemeris of that hour the record is one that a converter joined.
        let file = rinex::read(format!("{RECORDS}{LATER}").as_bytes(), "C06").unwrap();
        assert_eq!(file.ephemerides.iter().map(|set| label(set.toc)).collect::<Vec<_>>(), [126_000.0]);
        assert!(file.skipped[0].contains("with an older clock"), "{:?}", file.skipped);
        // A clock of another day is none of the orbit's.
        let astray = RECORDS.replace("2026 03 09 10 00 00", "2026 03 08 10 00 00");
        let error = rinex::read(astray.as_bytes(), "C06").unwrap_err().to_string();
        assert!(error.contains("expected within 4 h of the record's epoch"), "{error}");
    }
}
