//! Search for frames of one length in a stream of soft symbols. The first symbols show a possible start, and
//! the checks decide.

use std::collections::VecDeque;

/// Looks for frames.
#[derive(Clone, Debug)]
pub struct Frames {
    length: usize,
    /// Frames in a row that fail where they are expected before they are sought elsewhere.
    most_failures: u32,
    /// The latest symbols, a frame at most; `next` numbers the one to come.
    symbols: VecDeque<f32>,
    next: u64,
    /// Number of the first symbol of some frame, and frames that failed since the last one that did not.
    frame: Option<u64>,
    failures: u32,
}

impl Frames {
    /// Creates the state for frames of `length` symbols, which are sought elsewhere after `most_failures` in
    /// a row.
    pub fn new(length: usize, most_failures: u32) -> Self {
        let symbols = VecDeque::with_capacity(length);
        Self { length, most_failures, symbols, next: 0, frame: None, failures: 0 }
    }

    /// True if the positions of frames are known.
    pub fn are_known(&self) -> bool {
        self.frame.is_some()
    }

    /// Takes the next symbol. Returns the frame that ends with it and the number of its first symbol. Until
    /// one is known `may_begin` states of every position whether `decode` is worth its time.
    pub fn take<F>(
        &mut self,
        soft: f32,
        may_begin: impl Fn(&[f32]) -> bool,
        decode: impl Fn(&[f32]) -> Option<F>,
    ) -> Option<(F, u64)> {
        if self.symbols.len() == self.length {
            self.symbols.pop_front();
        }
        self.symbols.push_back(soft);
        self.next += 1;
        if self.symbols.len() < self.length {
            return None;
        }
        let begin = self.next - self.length as u64;
        let symbols = self.symbols.make_contiguous();
        let due = match self.frame {
            Some(frame) => (begin - frame).is_multiple_of(self.length as u64),
            None => may_begin(symbols),
        };
        if !due {
            return None;
        }
        let found = decode(symbols);
        if found.is_some() {
            (self.frame, self.failures) = (Some(begin), 0);
        } else {
            self.failures += 1;
            if self.failures >= self.most_failures {
                self.doubt();
            }
        }
        Some((found?, begin))
    }

    /// Informs the search that symbols are missing before the next one.
    pub fn skip(&mut self) {
        self.symbols.clear();
        self.doubt();
    }

    /// Restarts the search for the beginning of frames.
    pub fn doubt(&mut self) {
        (self.frame, self.failures) = (None, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_found_at_every_place_followed_where_they_were_and_sought_anew_after_four_failures() {
        // A frame is 1, 0, 0; its check is that the last is 0.
        let mut frames = Frames::new(3, 4);
        let mut take = |soft: f32| frames.take(soft, |own| own[0] == 1.0, |own| (own[2] == 0.0).then(|| own.to_vec()));
        type Found = Option<(Vec<f32>, u64)>;
        // Numbers of first symbols, counted from the first of all.
        let begins = |takes: &mut dyn FnMut(f32) -> Found, symbols: &[f32]| -> Vec<u64> {
            symbols.iter().filter_map(|soft| takes(*soft)).map(|(_, begin)| begin).collect()
        };
        assert_eq!(begins(&mut take, &[5.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0, 0.0]), [1, 4, 7]);
        // Four of the positions where one is due fail; then 1, 2, 0 is found a position later.
        let moved = [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 1.0, 2.0, 0.0];
        assert_eq!(begins(&mut take, &moved), [23]);
        frames.skip();
        let mut take = |soft: f32| frames.take(soft, |own| own[0] == 1.0, |own| (own[2] == 0.0).then(|| own.to_vec()));
        assert_eq!(begins(&mut take, &[0.0, 0.0, 1.0, 3.0, 0.0]), [28]);
    }
}
