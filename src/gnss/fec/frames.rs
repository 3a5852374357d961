//! Search for frames of one length in a stream of soft symbols. The first symbols show a possible start, and
//! the checks decide.

use std::collections::VecDeque;

/// Frames in a row that fail where they are expected before they are sought elsewhere.
const FAILURES: u32 = 4;

/// Looks for frames.
#[derive(Clone, Debug)]
pub struct Frames {
    length: usize,
    /// The latest symbols, a frame at most; `next` numbers the one to come.
    symbols: VecDeque<f32>,
    next: u64,
    /// Number of the first symbol of some frame, and frames that failed since the last one that did not.
    frame: Option<u64>,
    failures: u32,
}

impl Frames {
    /// Creates the state for frames of `length` symbols.
    pub fn new(length: usize) -> Self {
        Self { length, symbols: VecDeque::with_capacity(length), next: 0, frame: None, failures: 0 }
    }

    /// Takes the next symbol; gives the frame that ends with it. Until one is known `may_begin` states of
    /// every position whether `decode` is worth its time.
    pub fn take<F>(
        &mut self,
        soft: f32,
        may_begin: impl Fn(&[f32]) -> bool,
        decode: impl Fn(&[f32]) -> Option<F>,
    ) -> Option<F> {
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
            if self.failures >= FAILURES {
                self.doubt();
            }
        }
        found
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
        let mut frames = Frames::new(3);
        let mut take = |soft: f32| frames.take(soft, |own| own[0] == 1.0, |own| (own[2] == 0.0).then(|| own.to_vec()));
        let ends = |takes: &mut dyn FnMut(f32) -> Option<Vec<f32>>, symbols: &[f32]| -> Vec<usize> {
            symbols.iter().enumerate().filter_map(|(at, soft)| takes(*soft).map(|_| at)).collect()
        };
        assert_eq!(ends(&mut take, &[5.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0, 0.0]), [3, 6, 9]);
        // Four of the positions where one is due fail; then 1, 2, 0 is found a position later.
        let moved = [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 1.0, 2.0, 0.0];
        assert_eq!(ends(&mut take, &moved), [15]);
        frames.skip();
        let mut take = |soft: f32| frames.take(soft, |own| own[0] == 1.0, |own| (own[2] == 0.0).then(|| own.to_vec()));
        assert_eq!(ends(&mut take, &[0.0, 0.0, 1.0, 3.0, 0.0]), [4]);
    }
}
