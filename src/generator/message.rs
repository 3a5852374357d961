//! Messages that satellites send, and the faults between the uploaded data and the antenna.
//!
//! Wrong content (bad health, wrong parameters) is sent with a right check and the old issue of data; wrong
//! symbols are flipped in what was encoded, so that the check shows them. Times are those of sending, to the
//! unit (subframe, page) for content and to the symbol for symbols. Limits: the almanac's health stays that
//! of the scene's start.

use std::ops::Range;

use crate::random::Stream;
use gnss::bits::FieldError;
use gnss::broadcast::Ephemeris;
use gnss::message::{Common, Message, Sender};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::{Epoch, TimeScale};

/// Bits of a word by which a fault gives a bit's position (IS-GPS-200N, 20.3.2).
const WORD_BITS: u64 = 30;

/// Encoders of a scene's messages, by form of message.
pub struct Senders {
    all: Vec<(&'static Message, Box<dyn Sender>)>,
    /// Encoders of spoofers that do not repeat the true messages, by their number.
    spoofed: Vec<(usize, Self)>,
}

impl Senders {
    /// Creates the encoders for the messages of some signals. They send `common` besides each satellite's own
    /// elements.
    ///
    /// # Errors
    /// A value that a message cannot carry.
    pub fn new(common: &Common, signals: &[&'static Signal]) -> Result<Self, FieldError> {
        let mut all: Vec<(&'static Message, Box<dyn Sender>)> = Vec::new();
        let messages = signals.iter().flat_map(|signal| signal.components.iter().filter_map(|c| c.message));
        for message in messages {
            if all.iter().all(|(known, _)| *known != message) {
                all.push((message, (message.sender)(common)?));
            }
        }
        Ok(Self { all, spoofed: Vec::new() })
    }

    /// Adds the encoders of a spoofer by its number.
    pub fn put_spoofed(&mut self, number: usize, own: Self) {
        self.spoofed.push((number, own));
    }

    /// Encoders of a constellation by its number: those of the true satellites, or its own.
    pub fn of_constellation(&self, number: usize) -> &Self {
        self.spoofed.iter().find(|(own, _)| *own == number).map_or(self, |(_, own)| own)
    }

    /// Returns the encoder of a message; `None` if no signal of the scene has it.
    pub fn of(&self, message: &Message) -> Option<&dyn Sender> {
        self.all.iter().find(|(known, _)| *known == message).map(|(_, sender)| sender.as_ref())
    }
}

/// Fault in the messages of some satellites.
#[derive(Clone, Debug, PartialEq)]
pub struct MessageFault {
    /// Number of the constellation whose messages it spoils: 0 for the true satellites.
    pub constellation: usize,
    /// `None` for all.
    pub satellites: Option<Vec<Sv>>,
    /// Interval of transmission in which the fault acts.
    pub on: Range<Epoch>,
    /// Kind of the fault.
    pub kind: Kind,
}

/// Kind of a message fault.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Each symbol by itself, with a probability.
    BitErrors {
        /// Probability of a wrong symbol.
        rate: f64,
        /// Source of the random numbers.
        stream: Stream,
    },
    /// One symbol of every unit with this number, by a word of 30 of them and its position in it, both
    /// counted from 1.
    Bit {
        /// Number of the unit within its frame, from 1.
        subframe: u8,
        /// Word of 30 symbols, from 1.
        word: u8,
        /// Symbol of the word, from 1.
        bit: u8,
    },
    /// The bits of health ([`Ephemeris::health`]).
    Health(u16),
    /// A parameter of an ephemeris by its name in the message's table, wrong by `add` in its unit.
    Parameter {
        /// Name in the message's table.
        name: &'static str,
        /// Value that is added, in the parameter's unit.
        add: f64,
    },
    /// Every unit is an alert page, its check right.
    Alert,
}

impl Kind {
    /// Reason for which the fault cannot occur in a message; `None` if it can.
    pub fn foreign(&self, message: &Message) -> Option<String> {
        match self {
            Self::Parameter { name, .. } if !message.fields.adjustable().contains(name) => {
                let names = message.fields.adjustable().join(", ");
                Some(format!("{} has no parameter {name}: expected one of {names}", message.name))
            }
            Self::Alert if message.alert.is_none() => Some(format!("{} has no alert pages", message.name)),
            _ => None,
        }
    }
}

/// Symbols of a unit, before and after faults.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sent {
    /// Symbols as encoded, with correct checks.
    pub encoded: Vec<bool>,
    /// Symbols as they left the antenna.
    pub symbols: Vec<bool>,
    /// Other units that the redundancy of this one restores.
    pub restored: Vec<Vec<bool>>,
}

/// Unit that a satellite sends, identified by form of message, clock and number.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// Form of message.
    pub message: &'static Message,
    /// Time scale of the sender's clock.
    pub time: &'static TimeScale,
    /// Number of the unit since the beginning of the clock's scale.
    pub unit: i64,
}

impl Slot {
    /// Start time of the unit.
    pub fn start(&self) -> Epoch {
        self.time.instant(self.message.unit_start(self.unit))
    }

    /// Time at which the ephemeris of the unit is selected.
    pub fn set_chosen(&self) -> Epoch {
        self.time.instant(self.message.unit_start(self.message.unit_of_set(self.unit)))
    }
}

impl MessageFault {
    fn concerns(&self, sv: Sv) -> bool {
        self.satellites.as_ref().is_none_or(|list| list.contains(&sv))
    }

    /// Applies the fault to the content of a subframe that is sent at `start`.
    fn spoil(&self, message: &Message, ephemeris: &mut Ephemeris, start: Epoch) {
        if !self.on.contains(&start) {
            return;
        }
        match self.kind {
            Kind::Health(health) => ephemeris.health = health,
            Kind::Parameter { name, add } => {
                message.fields.adjust(ephemeris, name, add);
            }
            Kind::BitErrors { .. } | Kind::Bit { .. } | Kind::Alert => {}
        }
    }

    /// True if the fault inverts this symbol of a unit, counted from 0.
    fn flips(&self, sv: Sv, slot: &Slot, symbol: u64) -> bool {
        let message = slot.message;
        if !self.on.contains(&slot.start().plus_s(message.symbol_s * symbol as f64)) {
            return false;
        }
        match self.kind {
            Kind::BitErrors { rate, stream } => {
                let index = slot.unit as u64 * message.unit_symbols() as u64 + symbol;
                let word = stream.satellite(sv).word(index);
                // 53 bits of it are a number in [0, 1).
                ((word >> 11) as f64) < rate * 9_007_199_254_740_992.0
            }
            Kind::Bit { subframe, word, bit } => {
                let place = u64::from(word - 1) * WORD_BITS + u64::from(bit - 1);
                (message.number)(message.unit_start(slot.unit)) == subframe && symbol == place
            }
            Kind::Health(_) | Kind::Parameter { .. } | Kind::Alert => false,
        }
    }
}

/// The ephemeris that `sv` sends as `message` at `start` under `faults`, where they spoil it, in that form.
pub fn spoiled(
    faults: &[MessageFault],
    message: &Message,
    sv: Sv,
    ephemeris: &Ephemeris,
    start: Epoch,
) -> Option<Ephemeris> {
    let set = (message.form)(ephemeris);
    let mut changed = set.clone();
    let own = faults.iter().filter(|fault| fault.concerns(sv));
    own.for_each(|fault| fault.spoil(message, &mut changed, start));
    (changed != set).then_some(changed)
}

/// The unit of a slot that a satellite sends under `faults`: the ephemerides are that of the unit before and
/// its own.
///
/// # Errors
/// A value that the message cannot carry.
pub fn unit(
    faults: &[MessageFault],
    sender: &dyn Sender,
    [before, ephemeris]: [&Ephemeris; 2],
    slot: &Slot,
) -> Result<Sent, FieldError> {
    let Slot { message, time, unit } = *slot;
    let sv = ephemeris.sv;
    let sent = |set: &Ephemeris, slot: &Slot| {
        let changed = spoiled(faults, message, sv, set, slot.start()).unwrap_or_else(|| (message.form)(set));
        changed.timed(|at| time.label(at))
    };
    let before = sent(before, &Slot { unit: unit - 1, ..*slot });
    let (set, start) = (sent(ephemeris, slot), message.unit_start(unit));
    let encoded = sender.unit_after(&before, &set, start)?;
    let restored = sender.restored(&set, start)?;
    let is_alert = |fault: &MessageFault| fault.kind == Kind::Alert && fault.on.contains(&slot.start());
    let alert = faults.iter().any(|fault| fault.concerns(sv) && is_alert(fault));
    let encoded = if alert { message.alert.and_then(|of| of(&encoded)).unwrap_or(encoded) } else { encoded };
    let mut symbols = encoded.clone();
    for fault in faults.iter().filter(|fault| fault.concerns(sv)) {
        for (number, symbol) in (0..).zip(symbols.iter_mut()) {
            *symbol ^= fault.flips(sv, slot, number);
        }
    }
    Ok(Sent { encoded, symbols, restored })
}

impl MessageFault {
    /// Describes the fault for the plan; times are in seconds since `start`.
    pub fn describe(&self, start: Epoch) -> String {
        let who = self
            .satellites
            .as_ref()
            .map_or("all satellites".to_owned(), |list| list.iter().map(Sv::to_string).collect::<Vec<_>>().join(" "));
        let what = match &self.kind {
            Kind::BitErrors { rate, .. } => format!("bits wrong with a probability of {rate:e}"),
            Kind::Bit { subframe, word, bit } => format!("bit {bit} of word {word} of subframe {subframe} flipped"),
            Kind::Health(health) => format!("health = {health}"),
            Kind::Alert => "alert pages".to_owned(),
            Kind::Parameter { name, add } => format!("{name} wrong by {add:e}"),
        };
        let from_s = self.on.start.since(start);
        let until_s = self.on.end.since(start);
        let until = if until_s < FOREVER_S { format!(" to {until_s} s") } else { String::new() };
        let whose = if self.constellation == 0 { String::new() } else { format!("spoofer {}, ", self.constellation) };
        format!("{whose}{who}: {what} from {from_s} s{until}")
    }
}

/// Time in seconds beyond every scene.
pub const FOREVER_S: f64 = 1e9;
