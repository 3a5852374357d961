//! Messages of one length, each with a type, coded as one word over GF(64): the common part of B-CNAV2 and
//! B-CNAV3.
//!
//! Source: BDS-SIS-ICD-B2a 1.0 and BDS-SIS-ICD-B2b 1.0, 6.2. A message begins with a preamble and the
//! satellite's number, whose symbols the code leaves as they are. Messages state their second of the week,
//! one type states the week.

use std::cell::Cell;
use std::fmt;
use std::sync::LazyLock;

use super::blocks::Content;
use super::{Accuracies, Tables, accuracies_in, blank, electrons_in, integers_in, sent_at};
use crate::bits::{Field, FieldError, bits_of, read_all, soft, write_all};
use crate::broadcast::Ephemeris;
use crate::crc::{CHECK_BITS, is_checked, with_check};
use crate::fec::frames::Frames;
use crate::fec::ldpc64::Ldpc64;
use crate::framed::Reported;
use crate::message::{Common, Message, Parameters, Read, Reader, Sender, UtcNumbers};
use crate::satellite::Sv;
use crate::time::{BDT, BDT_WEEK, Epoch, WEEK_S};

/// Bits of a check, and of a satellite's number.
const NUMBER_BITS: usize = 6;
/// Least agreement of soft symbols with the preamble and the satellite's number at which a message is tried:
/// 0.89 at an amplitude of √2 standard deviations, near which the codes begin to fail. Of data 22 symbols
/// reach it once in a thousand.
const LEAST_SHARE: f32 = 0.65;
/// Messages in a row that fail where they are expected before they are sought elsewhere.
const FAILURES: u32 = 4;

/// Layout of the messages of one kind.
pub(in crate::beidou) struct Layout {
    pub message: &'static Message,
    /// Preamble of a message, and its number of symbols.
    pub preamble: (u32, usize),
    /// Number of symbols between the preamble and the code word: the satellite's number and reserved ones. It
    /// is zero if the number is in the code word.
    pub plain: usize,
    /// Number of bits of a message with its check.
    pub bits: usize,
    pub code: &'static LazyLock<Ldpc64>,
    /// Field of the satellite's number in the code word, if it is there.
    pub number: Option<Field>,
    pub kind: Field,
    pub second: Field,
    /// Types of the messages in the order of transmission.
    pub order: &'static [u8],
    /// Tables of each message type.
    pub tables: &'static [(u8, &'static Tables)],
    /// Types that make up an ephemeris, beginning with the one that is sent first when an ephemeris is new.
    pub set: &'static [u8],
    /// Fields that distinguish ephemerides, by their names, and the bits of them that do.
    pub issues: &'static [&'static str],
    pub issue_bits: i64,
    /// The number that an ephemeris has by those.
    pub number_of: fn(i64) -> u16,
    /// The ephemeris if its parts belong together.
    pub complete: fn(Ephemeris) -> Option<Ephemeris>,
}

impl Layout {
    /// Symbols of a message.
    const fn symbols(&self) -> usize {
        self.preamble.1 + self.plain + 2 * self.bits
    }

    /// The tables of a type; none of one that is not read.
    fn of_type(&self, kind: u8) -> &'static Tables {
        self.tables.iter().find(|(own, _)| *own == kind).map_or(&[], |(_, tables)| *tables)
    }

    /// A field of a type by its names.
    fn field(&self, kind: u8, names: &[&str]) -> Option<&'static Field> {
        let mut all = self.of_type(kind).iter().flat_map(|table| table.iter()).map(|element| &element.field);
        all.find(|field| names.contains(&field.name))
    }

    /// Issue that distinguishes one ephemeris from another; `None` for messages that do not state it.
    fn issue(&self, bits: &Vec<bool>) -> Option<i64> {
        self.field(self.type_of(bits), self.issues).map(|field| field.read(bits) & self.issue_bits)
    }

    /// Type of the message that begins at a time.
    pub fn type_at(&self, start: Epoch) -> u8 {
        let turn = start.tow_whole_s().div_euclid(self.message.unit_s);
        let place = turn.rem_euclid(self.order.len() as i64) as usize;
        self.order.get(place).copied().unwrap_or_default()
    }

    /// The symbols of the preamble and of a satellite's number.
    fn first(&self, number: u8) -> impl Iterator<Item = bool> {
        let preamble = planted!("gnss.bcnav.preamble", self.preamble.0, self.preamble.0 ^ 8);
        bits_of(u128::from(preamble), self.preamble.1).chain(bits_of(u128::from(number), NUMBER_BITS))
    }

    /// Encodes a satellite's message of `bits` to symbols.
    pub fn encode(&self, number: u8, bits: &[bool]) -> Vec<bool> {
        let first = self.first(number).chain(std::iter::repeat(false)).take(self.preamble.1 + self.plain);
        first.chain(self.code.encode(bits)).collect()
    }

    /// The bits of a message in its soft symbols, and whether they are inverted; `None` where its check
    /// fails.
    pub fn decode(&self, soft: &[f32]) -> Option<(Vec<bool>, bool)> {
        let (_, word) = soft.split_at_checked(self.preamble.1 + self.plain)?;
        let preamble = bits_of(u128::from(self.preamble.0), self.preamble.1);
        let inverted = share(preamble, soft) < 0.0;
        let own: Vec<f32> = word.iter().map(|value| if inverted { -value } else { *value }).collect();
        let bits = self.code.decode(&own).filter(|bits| is_checked(bits))?;
        Some((bits, inverted))
    }

    /// The satellite's number in a message that was decoded. Where the code does not protect it, a wrong
    /// symbol of it costs the message.
    fn said_number(&self, soft: &[f32], bits: &Vec<bool>, inverted: bool) -> i64 {
        let plain = || {
            let own = soft.iter().skip(self.preamble.1).take(NUMBER_BITS);
            own.fold(0, |all, value| all << 1 | i64::from((*value < 0.0) ^ inverted))
        };
        self.number.as_ref().map_or_else(plain, |field| field.read(bits))
    }

    /// Decodes the parameters from a message's symbols.
    pub fn opened(&self, symbols: &[bool]) -> Option<(bool, Parameters)> {
        let (bits, _) = self.decode(&soft(symbols))?;
        let found = integers_in(self.of_type(self.type_of(&bits)), &bits);
        (!found.is_empty()).then_some((true, found))
    }

    /// Type of a message, as it states it.
    fn type_of(&self, bits: &Vec<bool>) -> u8 {
        self.kind.read(bits) as u8
    }

    /// Second of the week of BDT at which a message began.
    fn begun_s(&self, bits: &Vec<bool>) -> i64 {
        (self.second.read(bits) - planted!("gnss.bcnav.second", 0, 1)) * self.message.unit_s
    }

    /// Start time of a message that states the week; `None` for other messages.
    fn sent_at(&self, bits: &Vec<bool>, near: Epoch) -> Option<Epoch> {
        let week = self.field(self.type_of(bits), &["week"])?.read(bits);
        Some(sent_at(week, self.begun_s(bits), near))
    }
}

/// Agreement of soft symbols with given bits, −1 to 1. It is negative if the symbols are inverted.
fn share(bits: impl Iterator<Item = bool>, soft: &[f32]) -> f32 {
    let (mut sum, mut all) = (0.0, f32::MIN_POSITIVE);
    for (one, value) in bits.zip(soft) {
        sum += if one { -value } else { *value };
        all += value.abs();
    }
    sum / all
}

/// Makes the messages of satellites.
pub(in crate::beidou) struct Messages {
    pub layout: &'static Layout,
    pub common: Common,
}

impl Sender for Messages {
    fn unit(&self, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        let layout = self.layout;
        layout.message.check_start(start, "the beginning of a message")?;
        let kind = layout.type_at(start);
        let utc = UtcNumbers::of(&self.common, start, &BDT, (BDT_WEEK, 0));
        let alpha_tecu = self.common.bdgim.map_or([0.0; 9], |model| model.alpha_tecu);
        let content = Content { sent: start, utc, alpha_tecu, ..blank(set.clone()) };
        let mut bits = vec![false; layout.bits - CHECK_BITS];
        if let Some(field) = &layout.number {
            field.write(&mut bits, i64::from(set.sv.number));
        }
        layout.kind.write(&mut bits, i64::from(kind));
        layout.second.write(&mut bits, start.tow_whole_s() / layout.message.unit_s);
        layout.of_type(kind).iter().try_for_each(|table| write_all(table, &content, &mut bits))?;
        Ok(layout.encode(set.sv.number, &with_check(bits)))
    }
}

/// A message of an ephemeris.
#[derive(Clone)]
struct Part {
    kind: u8,
    bits: Vec<bool>,
    /// Issue of the ephemeris, as far as known.
    issue: Option<i64>,
    begun_s: i64,
}

/// Reads the messages of one satellite.
#[derive(Clone)]
pub(in crate::beidou) struct TypedReader {
    layout: &'static Layout,
    sv: Sv,
    frames: Frames,
    /// The latest messages of an ephemeris, the newest last.
    parts: Vec<Part>,
    reported: Reported,
    accuracies: Accuracies,
}

impl TypedReader {
    /// Creates a reader that has received no symbols.
    pub fn new(layout: &'static Layout, sv: Sv) -> Self {
        let frames = Frames::new(layout.symbols(), FAILURES);
        let (reported, accuracies) = (Reported::default(), Accuracies::default());
        Self { layout, sv, frames, parts: Vec::new(), reported, accuracies }
    }

    /// Takes a message that ends with the newest symbol.
    fn read(&mut self, bits: Vec<bool>, inverted: bool, near: Epoch) -> Vec<Read> {
        let layout = self.layout;
        let of_week_s = layout.begun_s(&bits);
        let mut news = vec![Read::Unit { symbols: layout.symbols() as u64, of_week_s, inverted }];
        news.extend(layout.sent_at(&bits, near).map(Read::Time));
        let all = integers_in(layout.of_type(layout.type_of(&bits)), &bits);
        let sv = self.sv;
        let rows = |issue: u16, raws| Read::parameters(sv, layout.message, issue.into(), raws);
        let issue = layout.issue(&bits).map(layout.number_of);
        if let Some((coefficients, raws)) = electrons_in(&all) {
            news.push(Read::Ionosphere(coefficients));
            news.extend(issue.map(|issue| rows(issue, raws)));
        }
        // Those in messages of an ephemeris are reported with it.
        let beside = !layout.set.contains(&layout.type_of(&bits));
        if let Some(issue) = issue.filter(|_| beside) {
            let accuracies = self.accuracies.take(issue.into(), &accuracies_in(&all));
            news.extend(accuracies.map(|raws| rows(issue, raws)));
        }
        self.keep(bits, of_week_s);
        self.look_for_set(near, &mut news);
        news
    }

    /// Keeps a message of an ephemeris. One that does not state of which is of the same as the one right
    /// before it, or as the one right after it, if no ephemeris begins with that.
    fn keep(&mut self, bits: Vec<bool>, begun_s: i64) {
        let layout = self.layout;
        let kind = layout.type_of(&bits);
        let said = layout.issue(&bits);
        let is_before = |part: &Part| {
            let since_s = (begun_s - part.begun_s).rem_euclid(WEEK_S);
            planted!("gnss.bcnav.issue", since_s == layout.message.unit_s, true)
        };
        let before = self.parts.last_mut().filter(|part| is_before(part));
        let issue = said.or(before.as_ref().and_then(|part| part.issue));
        if let Some(part) = before.filter(|part| part.issue.is_none() && layout.set.first() != Some(&kind)) {
            part.issue = said;
        }
        if layout.set.contains(&kind) {
            self.parts.retain(|part| part.kind != kind);
            self.parts.push(Part { kind, bits, issue, begun_s });
        }
    }

    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let Some((set, all)) = self.found(near) else { return };
        self.reported.take(self.layout.message.name, all, set, news);
    }

    /// The ephemeris in the latest messages, with its parameters.
    fn found(&self, near: Epoch) -> Option<(Ephemeris, Parameters)> {
        let layout = self.layout;
        let of = |kind: &u8| self.parts.iter().find(|part| part.kind == *kind);
        let parts: Vec<&Part> = layout.set.iter().map(of).collect::<Option<_>>()?;
        let issue = parts.first()?.issue?;
        if parts.iter().any(|part| part.issue != Some(issue)) {
            return None;
        }
        let sent = parts.iter().find_map(|part| layout.sent_at(&part.bits, near))?;
        let mut content = blank(Ephemeris { form: layout.message.sets, ..Ephemeris::blank(self.sv, sent) });
        let own = layout.message.fields.parameters();
        let mut all = Parameters::new();
        for Part { kind, bits, .. } in parts {
            let tables = layout.of_type(*kind);
            tables.iter().for_each(|table| read_all(table, bits, &mut content));
            let found = integers_in(tables, bits);
            // Coefficients of the ionosphere and predicted accuracies bear the issue of their message.
            let electrons = electrons_in(&found).map(|(_, electrons)| electrons).unwrap_or_default();
            let beside: Parameters = electrons.into_iter().chain(accuracies_in(&found)).collect();
            for (name, raw) in found.into_iter().filter(|(name, _)| own.contains(name)).chain(beside) {
                all.retain(|(other, _)| *other != name);
                all.push((name, raw));
            }
        }
        Some(((layout.complete)(content.set)?, all))
    }
}

impl Reader for TypedReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let (layout, number) = (self.layout, self.sv.number);
        let may_begin = |symbols: &[f32]| share(layout.first(number), symbols).abs() > LEAST_SHARE;
        let another = Cell::new(None);
        let own = |symbols: &[f32]| {
            let (bits, inverted) = layout.decode(symbols)?;
            let named = layout.said_number(symbols, &bits, inverted);
            another.set(Some(named).filter(|named| *named != i64::from(number)));
            another.get().is_none().then_some((bits, inverted))
        };
        match (self.frames.take(soft, may_begin, own), another.get()) {
            (Some(((bits, inverted), _)), _) => self.read(bits, inverted, near),
            (None, another) => another.map(|another| Read::names_another("a message", another)).into_iter().collect(),
        }
    }

    fn skip(&mut self) {
        self.frames.skip();
    }

    fn doubt(&mut self) {
        self.frames.doubt();
    }

    fn missing(&self) -> Vec<u8> {
        let has = |kind: &&u8| self.parts.iter().any(|part| part.kind == **kind);
        self.layout.set.iter().filter(|kind| !has(kind)).copied().collect()
    }
}

impl fmt::Debug for TypedReader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.layout.message.name, self.sv)
    }
}
