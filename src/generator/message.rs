//! What goes wrong with the navigation message between the uploaded data and the antenna.
//!
//! Wrong content (bad health, wrong parameters) is sent with right parity and the old issue of data; wrong
//! bits are flipped in what was encoded, so that parity tells them. Times are those of sending, to the
//! subframe for content and to the bit for bits. Limits: GPS LNAV; the almanac's health stays that of the
//! scene's start.

use std::ops::Range;

use crate::generator::random::Stream;
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::gps::lnav::{Broadcast, FieldError, SUBFRAME_S, adjust};
use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;

/// Bits of a subframe and of a word, and the time of one (IS-GPS-200N, 20.3.2).
const SUBFRAME_BITS: u64 = 300;
const WORD_BITS: u64 = 30;
const BIT_S: f64 = 0.02;

/// One fault of the messages of some satellites.
#[derive(Clone, Debug, PartialEq)]
pub struct MessageFault {
    /// `None` for all.
    pub satellites: Option<Vec<Sv>>,
    /// When it is sent.
    pub on: Range<Epoch>,
    pub kind: Kind,
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Each bit by itself, with a probability.
    BitErrors { rate: f64, stream: Stream },
    /// One bit, counted from 1, of every subframe with this number.
    Bit { subframe: u8, word: u8, bit: u8 },
    /// The six bits of health (IS-GPS-200N, 20.3.3.3.1.4).
    Health(u8),
    /// A parameter of subframes 1 to 3 by its name in the message's table, wrong by `add` in its unit.
    Parameter { name: &'static str, add: f64 },
}

/// The words of a subframe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// As encoded, every parity right …
    pub encoded: [u32; 10],
    /// … and as they left the antenna.
    pub words: [u32; 10],
}

impl MessageFault {
    fn concerns(&self, sv: Sv) -> bool {
        self.satellites.as_ref().is_none_or(|list| list.contains(&sv))
    }

    /// What it makes of the content of a subframe sent at `start`.
    fn spoil(&self, ephemeris: &mut Ephemeris, start: Epoch) {
        if !self.on.contains(&start) {
            return;
        }
        match self.kind {
            Kind::Health(health) => ephemeris.health = health,
            Kind::Parameter { name, add } => {
                adjust(ephemeris, name, add);
            }
            Kind::BitErrors { .. } | Kind::Bit { .. } => {}
        }
    }

    /// Whether it flips bit `bit` (0..300) of the subframe with number `id` sent at `start`.
    fn flips(&self, sv: Sv, start: Epoch, id: u64, bit: u64) -> bool {
        if !self.on.contains(&start.plus_s(BIT_S * bit as f64)) {
            return false;
        }
        match self.kind {
            Kind::BitErrors { rate, stream } => {
                let index = start.seconds().div_euclid(SUBFRAME_S) as u64 * SUBFRAME_BITS + bit;
                let word = stream.satellite(sv).word(index);
                // 53 bits of it are a number in [0, 1).
                ((word >> 11) as f64) < rate * 9_007_199_254_740_992.0
            }
            Kind::Bit { subframe, word, bit: number } => {
                let place = u64::from(word - 1) * WORD_BITS + u64::from(number - 1);
                id == u64::from(subframe) && bit == place
            }
            Kind::Health(_) | Kind::Parameter { .. } => false,
        }
    }
}

/// The set that `sv` sends at `start` under `faults`, where they spoil it.
pub fn spoiled(faults: &[MessageFault], sv: Sv, ephemeris: &Ephemeris, start: Epoch) -> Option<Ephemeris> {
    let mut changed = ephemeris.clone();
    faults.iter().filter(|fault| fault.concerns(sv)).for_each(|fault| fault.spoil(&mut changed, start));
    (changed != *ephemeris).then_some(changed)
}

/// The subframe that `sv` sends at `start` under `faults`.
///
/// # Errors
/// A value that the message cannot carry.
pub fn subframe(
    faults: &[MessageFault],
    broadcast: &Broadcast,
    sv: Sv,
    ephemeris: &Ephemeris,
    start: Epoch,
) -> Result<Sent, FieldError> {
    let spoiled = spoiled(faults, sv, ephemeris, start);
    let encoded = broadcast.subframe(spoiled.as_ref().unwrap_or(ephemeris), start)?;
    let mut words = encoded;
    let id = (start.tow_whole_s() / SUBFRAME_S % 5 + 1) as u64;
    for fault in faults.iter().filter(|fault| fault.concerns(sv)) {
        for (word, first) in words.iter_mut().zip((0_u64..).step_by(WORD_BITS as usize)) {
            for bit in (0..WORD_BITS).filter(|bit| fault.flips(sv, start, id, first + bit)) {
                *word ^= 1 << (WORD_BITS - 1 - bit);
            }
        }
    }
    Ok(Sent { encoded, words })
}

impl MessageFault {
    /// What it does, for the plan; times in seconds since `start`.
    pub fn describe(&self, start: Epoch) -> String {
        let who = self
            .satellites
            .as_ref()
            .map_or("all satellites".to_owned(), |list| list.iter().map(Sv::to_string).collect::<Vec<_>>().join(" "));
        let what = match &self.kind {
            Kind::BitErrors { rate, .. } => format!("bits wrong with a probability of {rate:e}"),
            Kind::Bit { subframe, word, bit } => format!("bit {bit} of word {word} of subframe {subframe} flipped"),
            Kind::Health(health) => format!("health = {health}"),
            Kind::Parameter { name, add } => format!("{name} wrong by {add:e}"),
        };
        let from_s = self.on.start.since(start);
        let until_s = self.on.end.since(start);
        let until = if until_s < FOREVER_S { format!(" to {until_s} s") } else { String::new() };
        format!("{who}: {what} from {from_s} s{until}")
    }
}

/// A time beyond every scene.
pub const FOREVER_S: f64 = 1e9;
