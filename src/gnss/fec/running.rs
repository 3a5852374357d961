//! Finds messages of one length in soft symbols of the convolutional code, which runs on from one to the
//! next, normal or inverted.
//!
//! Both polynomials have an odd number of taps, so that inverted symbols are inverted bits. A message
//! is decoded once the code's memory after it is there too.

use std::collections::VecDeque;

use super::convolutional::Convolutional;

/// Symbols before and after a message by which its first and last bits are as sure as the others: some
/// constraint lengths.
pub const MARGIN: usize = 80;
/// Messages in a row that fail where they are expected before they are sought elsewhere.
const FAILURES: u32 = 4;
const CODE: Convolutional = Convolutional { second_inverted: false };

/// Looks for messages.
#[derive(Clone, Debug)]
pub struct Running {
    /// Bits of a message, and whether so many are one.
    bits: usize,
    is_message: fn(&[bool]) -> bool,
    /// The latest symbols, a message with margins at most; `next` numbers the one to come.
    symbols: VecDeque<f32>,
    next: u64,
    /// Number of the first symbol of some message, and messages that failed since the last one that did not.
    frame: Option<u64>,
    failures: u32,
}

/// Message that was found, with its position and sign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Bits of the message as sent.
    pub bits: Vec<bool>,
    /// True if the symbols were inverted.
    pub inverted: bool,
    /// Number of symbols from the message's first to the newest, both counted.
    pub symbols: u64,
}

impl Running {
    /// Creates a decoder without symbols. `is_message` decides by preamble and check.
    pub fn new(bits: usize, is_message: fn(&[bool]) -> bool) -> Self {
        Self { bits, is_message, symbols: VecDeque::new(), next: 0, frame: None, failures: 0 }
    }

    /// Number of the symbol to come.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Takes the next symbol: the message that it completes, if any.
    pub fn take(&mut self, soft: f32) -> Option<Found> {
        let window = MARGIN + 2 * self.bits + MARGIN;
        if self.symbols.len() == window {
            self.symbols.pop_front();
        }
        self.symbols.push_back(soft);
        self.next += 1;
        if self.symbols.len() < window {
            return None;
        }
        let begin = self.next - window as u64;
        if let Some(frame) = self.frame {
            let first = begin + MARGIN as u64;
            // The message that was found has been read.
            if first <= frame || !(first - frame).is_multiple_of(2 * self.bits as u64) {
                return None;
            }
            if let Some((bits, inverted)) = self.decode() {
                self.failures = 0;
                return Some(Found { bits, inverted, symbols: self.next - first });
            }
            self.failures += 1;
            if self.failures >= FAILURES {
                self.doubt();
            }
            return None;
        }
        // Every position comes by within the margins.
        if !self.next.is_multiple_of(MARGIN as u64) {
            return None;
        }
        let (place, bits, inverted) = self.search()?;
        let first = begin + place as u64;
        (self.frame, self.failures) = (Some(first), 0);
        Some(Found { bits, inverted, symbols: self.next - first })
    }

    /// Informs the search that symbols are missing before the next one.
    pub fn skip(&mut self) {
        self.symbols.clear();
        self.doubt();
    }

    /// Restarts the search for the beginning of messages.
    pub fn doubt(&mut self) {
        (self.frame, self.failures) = (None, 0);
    }

    /// Finds a possible start of a message in the window. The window is decoded for both ways of pairing
    /// symbols.
    fn search(&mut self) -> Option<(usize, Vec<bool>, bool)> {
        let soft = self.symbols.make_contiguous();
        for offset in 0..2 {
            let bits = CODE.decode_open(soft.get(offset..)?);
            for (first, own) in bits.windows(self.bits).enumerate() {
                if let Some((message, inverted)) = either_way_up(own, self.is_message) {
                    return Some((offset + 2 * first, message, inverted));
                }
            }
        }
        None
    }

    /// The message that begins after the margin.
    fn decode(&mut self) -> Option<(Vec<bool>, bool)> {
        let bits = CODE.decode_open(self.symbols.make_contiguous());
        either_way_up(bits.get(MARGIN / 2..MARGIN / 2 + self.bits)?, self.is_message)
    }
}

/// Bits as they were sent and whether they are inverted, if they are a message.
fn either_way_up(bits: &[bool], is_message: fn(&[bool]) -> bool) -> Option<(Vec<bool>, bool)> {
    if is_message(bits) {
        return Some((bits.to_vec(), false));
    }
    let flipped: Vec<bool> = bits.iter().map(|bit| !bit).collect();
    is_message(&flipped).then_some((flipped, true))
}
