//! Metadata of recordings as the Institute of Navigation's standard has them: XML beside a file of
//! samples.
//!
//! Source: ION GNSS SDR Metadata Standard, revision 1.0 (2020): lanes of blocks of chunks of lumps of
//! streams, a system's base rate, bands. Bits of a chunk count from the highest of its first word, and with a
//! word shift to the right from the highest of its last word. A lump fills its chunk as often as it fits in,
//! as the standard's own converter has it. A shift to the right of a lump or a stream reverses the order in
//! time, and moves no bits. A stream's 0 Hz is its band's centre less what that was translated to. Of the
//! standard's own samples two name what is at 0 Hz as the centre (JRC, FITWDP): there the centre is no
//! carrier of a signal, and with the translation it is one. A format whose quadrature or in-phase part is
//! negated (`IQn`, `InQ`, …) mirrors the spectrum. Limits: one kind of block of one kind of chunk, in which
//! every lump has the same streams; encodings of 1 to 16 bits but for Gray codes, magnitude before sign and
//! floating point. Times are passed over: of the files that there are some have the start as the session's,
//! some as the file's.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};
use thiserror::Error;

use crate::packed::{Components, Encoding, Group, Layout};
use crate::recording::{Blocks, Description, Samples};
use crate::signal;
use crate::time::Rate;

/// Reason for which a text does not describe readable samples.
#[derive(Debug, Error)]
pub enum IonError {
    /// No XML.
    #[error("{name}: not XML: {error}")]
    Syntax {
        /// Name of the file.
        name: String,
        /// Error of the XML parser.
        error: roxmltree::Error,
    },
    /// An element that is not there.
    #[error("{name}: no <{element}> in <{within}>")]
    Missing {
        /// Name of the file.
        name: String,
        /// The element.
        element: &'static str,
        /// Enclosing element in which it is expected.
        within: String,
    },
    /// Elements of which one is read.
    #[error("{name}: {count} kinds of <{element}> in <{within}>: only files with one are supported")]
    Several {
        /// Name of the file.
        name: String,
        /// The element.
        element: &'static str,
        /// Enclosing element.
        within: String,
        /// Number of them.
        count: usize,
    },
    /// An element whose value cannot be used.
    #[error("{name}: <{element}> is {value:?}: expected {expected}")]
    Value {
        /// Name of the file.
        name: String,
        /// The element.
        element: String,
        /// Text of the element.
        value: String,
        /// Values that are expected.
        expected: String,
    },
}

/// Name of a stream in a file, and its description.
pub type Stream = (String, Description);

/// Parses the streams in the XML text of a metadata file. Errors call the file `name`.
///
/// # Errors
/// [`IonError`] with the file, the element, its value and what was expected.
pub fn parse(text: &str, name: &str) -> Result<Vec<Stream>, IonError> {
    // A declaration has to come first, and not every program writes it so.
    let document =
        Document::parse(text.trim_start()).map_err(|error| IonError::Syntax { name: name.to_owned(), error })?;
    let of = Of { name, ids: ids(document.root_element()) };
    let root = document.root_element();
    let lanes: Vec<Node<'_, '_>> = of.children(root, "lane").collect();
    if lanes.is_empty() {
        return Err(of.missing("lane", root));
    }
    let mut streams = Vec::new();
    for lane in &lanes {
        let chunk = of.chunk(*lane)?;
        let system = of.child(*lane, "system")?;
        let base_hz = of.frequency_hz(of.child(system, "freqbase")?)?;
        let own = |file: &Node<'_, '_>| lanes.len() == 1 || of.is_of_lane(*file, *lane);
        let file = root.children().filter(|node| node.tag_name().name() == "file").find(own);
        let dataset = file.and_then(|file| inner(file, "url")).map(|url| url.trim().to_owned());
        for (name, description) in of.streams(chunk, base_hz)? {
            streams.push((name, Description { dataset: dataset.clone(), ..description }));
        }
    }
    Ok(streams)
}

/// True if a signal has its carrier there, to the hertz.
fn is_carrier(hz: f64) -> bool {
    signal::all().iter().any(|signal| (signal.centre_hz() - hz).abs() < 1.0)
}

/// Bit of a group of words that is number `at` if the last word comes first; one beyond the group stays
/// there.
fn mirrored(at: u32, word_bits: u32, room: u32) -> u32 {
    if at < room { room - (at / word_bits + 1) * word_bits + at % word_bits } else { at }
}

/// The text of a child element.
fn inner<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    node.children().find(|child| child.tag_name().name() == name).and_then(|child| child.text())
}

/// The first element with content of each kind and id, to which others refer.
fn ids<'a, 'i>(root: Node<'a, 'i>) -> BTreeMap<(&'a str, &'a str), Node<'a, 'i>> {
    let mut ids = BTreeMap::new();
    for node in root.descendants().filter(|node| node.is_element() && node.children().any(|child| child.is_element())) {
        if let Some(id) = node.attribute("id") {
            ids.entry((node.tag_name().name(), id)).or_insert(node);
        }
    }
    ids
}

/// A chunk's words, and the blocks of which they are a part.
struct Chunk<'a, 'i> {
    node: Node<'a, 'i>,
    group: Group,
    /// True if its last word comes first.
    reversed: bool,
    framing: Framing,
}

/// Bytes of a file that are not samples: headers and footers.
#[derive(Default)]
struct Framing {
    header_bytes: u64,
    trailing_bytes: u64,
    blocks: Option<Blocks>,
}

/// Document, with the names of its elements.
struct Of<'a, 'i> {
    name: &'a str,
    ids: BTreeMap<(&'a str, &'a str), Node<'a, 'i>>,
}

impl<'a, 'i> Of<'a, 'i> {
    fn missing(&self, element: &'static str, within: Node<'_, '_>) -> IonError {
        IonError::Missing { name: self.name.to_owned(), element, within: within.tag_name().name().to_owned() }
    }

    fn bad(&self, node: Node<'_, '_>, expected: impl Into<String>) -> IonError {
        IonError::Value {
            name: self.name.to_owned(),
            element: node.tag_name().name().to_owned(),
            value: node.text().unwrap_or_default().trim().to_owned(),
            expected: expected.into(),
        }
    }

    /// Children with this name. Each reference is replaced by its target.
    fn children(&self, within: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> + '_ {
        let own = within.children().filter(move |child| child.tag_name().name() == name);
        own.map(move |child| {
            let whole = child.children().any(|inner| inner.is_element());
            let named = child.attribute("id").and_then(|id| self.ids.get(&(name, id)));
            if whole { child } else { named.copied().unwrap_or(child) }
        })
    }

    fn child(&self, within: Node<'a, 'i>, name: &'static str) -> Result<Node<'a, 'i>, IonError> {
        self.children(within, name).next().ok_or_else(|| self.missing(name, within))
    }

    /// True if a file holds a lane.
    fn is_of_lane(&self, file: Node<'_, '_>, lane: Node<'_, '_>) -> bool {
        let mut lanes = file.children().filter(|child| child.tag_name().name() == "lane");
        lanes.any(|child| child.attribute("id") == lane.attribute("id"))
    }

    /// The one child of that name.
    fn only(&self, within: Node<'a, 'i>, name: &'static str) -> Result<Node<'a, 'i>, IonError> {
        let mut all = self.children(within, name);
        let first = all.next().ok_or_else(|| self.missing(name, within))?;
        match all.count() {
            0 => Ok(first),
            more => Err(IonError::Several {
                name: self.name.to_owned(),
                element: name,
                within: within.tag_name().name().to_owned(),
                count: more + 1,
            }),
        }
    }

    /// A number; `usual` where the element is not there.
    fn number(&self, within: Node<'a, 'i>, name: &'static str, usual: Option<u32>) -> Result<u32, IonError> {
        // Names differ in their case between the schema and the files that there are.
        let same = |node: &Node<'_, '_>| node.tag_name().name().eq_ignore_ascii_case(name);
        let Some(node) = within.children().find(same) else {
            return usual.ok_or_else(|| self.missing(name, within));
        };
        let number = node.text().and_then(|text| text.trim().parse().ok());
        number.ok_or_else(|| self.bad(node, "a whole number"))
    }

    /// A word, in lower case; nothing where the element is not there.
    fn word(&self, within: Node<'a, 'i>, name: &str) -> String {
        let same = |node: &Node<'_, '_>| node.tag_name().name().eq_ignore_ascii_case(name);
        let text = within.children().find(same).and_then(|node| node.text());
        text.unwrap_or_default().trim().to_ascii_lowercase()
    }

    fn frequency_hz(&self, node: Node<'a, 'i>) -> Result<f64, IonError> {
        let unit = node.attribute("format").or(node.attribute("units")).unwrap_or("Hz");
        let scale = match unit.to_ascii_lowercase().as_str() {
            "hz" => 1.0,
            "khz" => 1e3,
            "mhz" => 1e6,
            "ghz" => 1e9,
            _ => return Err(self.bad(node, format!("Hz, kHz, MHz or GHz, not {unit:?}"))),
        };
        let value: Option<f64> =
            node.text().and_then(|text| text.trim().parse().ok()).filter(|hz: &f64| hz.is_finite());
        // A thousandth of a hertz is more than a decimal of gigahertz has.
        let hz = value.ok_or_else(|| self.bad(node, "a frequency"))? * scale;
        Ok((hz * 1e3).round() * 1e-3)
    }

    /// True if a shift is to the right.
    fn is_right(&self, within: Node<'a, 'i>, name: &str) -> bool {
        matches!(self.word(within, name).as_str(), "right" | "r")
    }

    /// The lane's one chunk.
    fn chunk(&self, lane: Node<'a, 'i>) -> Result<Chunk<'a, 'i>, IonError> {
        let block = self.only(lane, "block")?;
        let node = self.only(block, "chunk")?;
        let endian = self.word(node, "endian");
        let group = Group {
            word_bytes: self.number(node, "sizeword", None)? as usize,
            words: self.number(node, "countwords", None)? as usize,
            big_endian: matches!(endian.as_str(), "big" | "b"),
            lowest_first: false,
        };
        let framing = self.framing(block, &group)?;
        Ok(Chunk { node, group, reversed: self.is_right(node, "wordshift"), framing })
    }

    /// Headers and footers of a block of so many cycles of its chunk. One of no cycles is the whole file.
    fn framing(&self, block: Node<'a, 'i>, group: &Group) -> Result<Framing, IonError> {
        let size = |name| self.number(block, name, Some(0)).map(u64::from);
        let (header_bytes, footer_bytes, cycles) = (size("sizeheader")?, size("sizefooter")?, size("cycles")?);
        let sample_bytes = cycles * (group.word_bytes * group.words) as u64;
        Ok(match (header_bytes + footer_bytes, sample_bytes) {
            (0, _) => Framing::default(),
            (_, 0) => Framing { header_bytes, trailing_bytes: footer_bytes, blocks: None },
            _ => Framing { blocks: Some(Blocks { header_bytes, sample_bytes, footer_bytes }), ..Framing::default() },
        })
    }

    /// The streams of a chunk whose words are sampled at a multiple of a base rate.
    fn streams(&self, chunk: Chunk<'a, 'i>, base_hz: f64) -> Result<Vec<Stream>, IonError> {
        let Chunk { node, group, reversed, framing } = chunk;
        let lumps: Vec<Node<'a, 'i>> = self.children(node, "lump").collect();
        let first = *lumps.first().ok_or_else(|| self.missing("lump", node))?;
        let names = |lump| self.children(lump, "stream").map(|node| node.attribute("id")).collect::<Vec<_>>();
        if let Some(other) = lumps.iter().find(|lump| names(**lump) != names(first)) {
            return Err(self.bad(*other, "the streams of the first lump in all lumps"));
        }
        let width = |stream| self.number(stream, "packedbits", None);
        let lump_bits = self.children(first, "stream").map(width).sum::<Result<u32, _>>()?;
        let room = (8 * group.word_bytes * group.words) as u32;
        // One lump is repeated as often as there is room.
        let count = if lumps.len() == 1 { room.checked_div(lump_bits).unwrap_or(0) } else { lumps.len() as u32 };
        let padded = matches!(self.word(node, "padding").as_str(), "head" | "h");
        let begin = if padded { room.saturating_sub(lump_bits * count) } else { 0 };
        let reversed_lumps = self.is_right(first, "shift");
        let (mut streams, mut within) = (Vec::new(), begin);
        for (number, stream) in (1..).zip(self.children(first, "stream")) {
            let packed = width(stream)?;
            let factor = self.number(stream, "ratefactor", None)?;
            let lump = |lump| if reversed_lumps { count - 1 - lump } else { lump };
            let starts = (0..count).map(|number| within + lump(number) * lump_bits);
            let samples = self.samples(stream, (group, reversed), (factor, packed), starts)?;
            within += packed;
            let rate = Rate::from_hz(base_hz * f64::from(factor));
            let (center_hz, inverted) = self.tuning(stream)?;
            let id = stream.attribute("id").map_or_else(|| number.to_string(), str::to_owned);
            let rate = Some(rate.ok_or_else(|| self.bad(stream, "a rate above 0 and below 1e12 Hz"))?);
            let description = Description {
                samples: Some(samples),
                rate,
                center_hz: Some(center_hz),
                inverted,
                header_bytes: framing.header_bytes,
                trailing_bytes: framing.trailing_bytes,
                blocks: framing.blocks,
                ..Default::default()
            };
            streams.push((id, description));
        }
        Ok(streams)
    }

    /// The samples of a stream: so many in so many bits, from each of `starts` on, in a group of words or in
    /// the reverse of one.
    fn samples(
        &self,
        stream: Node<'a, 'i>,
        (group, reversed): (Group, bool),
        (factor, packed): (u32, u32),
        starts: impl Iterator<Item = u32>,
    ) -> Result<Samples, IonError> {
        let components = match self.word(stream, "format").replace('n', "").as_str() {
            "if" => Components::Real,
            "iq" => Components::Iq,
            "qi" => Components::Qi,
            _ => return Err(self.bad(self.child(stream, "format")?, "IF, IQ or QI, each letter with n or without")),
        };
        let bits = self.number(stream, "quantization", None)?;
        let encoding = match self.word(stream, "encoding").as_str() {
            "sign" => Encoding::Sign,
            // Adjusted codes have their values in the middle of the steps, as all of few bits have them here.
            "sm" | "sma" => Encoding::SignMagnitude,
            "tc" | "tca" => Encoding::TwosComplement,
            "ob" | "oba" => Encoding::Offset,
            _ => return Err(self.bad(self.child(stream, "encoding")?, "SIGN, SM, SMA, TC, TCA, OB or OBA")),
        };
        let sample_bits = bits * if components == Components::Real { 1 } else { 2 };
        let filled = sample_bits.checked_mul(factor).filter(|bits| *bits > 0);
        let Some(filled) = filled.filter(|filled| *filled <= packed) else {
            let expected = format!("bits for {factor} samples of {sample_bits}");
            return Err(self.bad(self.child(stream, "packedbits")?, expected));
        };
        let left = packed - filled;
        let begin = if self.word(stream, "alignment") == "right" { left } else { 0 };
        let right = self.is_right(stream, "shift");
        let place = move |k| if right { factor - 1 - k } else { k };
        let starts = starts.flat_map(|start| (0..factor).map(move |k| start + begin + place(k) * sample_bits));
        let word_bits = 8 * group.word_bytes as u32;
        let room = word_bits * group.words as u32;
        let starts: Vec<u32> =
            if reversed { starts.map(|at| mirrored(at, word_bits, room)).collect() } else { starts.collect() };
        // In words that are reversed the rest of a sample would not be in the next one of the file.
        if reversed && starts.iter().any(|at| at % word_bits + sample_bits > word_bits) {
            return Err(self.bad(stream, "every sample within one word, as <wordshift> reverses the words"));
        }
        let layout = Layout::of_fields(group, (bits, encoding, components), starts.into_iter());
        layout.map(Samples::Laid).map_err(|error| self.bad(stream, error.to_string()))
    }

    /// The radio frequency at 0 Hz of a stream, and whether its spectrum is mirrored.
    fn tuning(&self, stream: Node<'a, 'i>) -> Result<(f64, bool), IonError> {
        let band = self.child(stream, "band")?;
        let named_hz = self.frequency_hz(self.child(band, "centerfreq")?)?;
        let at_hz = self.frequency_hz(self.child(band, "translatedfreq")?)?;
        let centre_hz = if !is_carrier(named_hz) && is_carrier(named_hz + at_hz) { named_hz + at_hz } else { named_hz };
        let format = self.word(stream, "format");
        let negated = planted!("gnss.ion.negated", format != "ifn" && format.matches('n').count() == 1, false);
        // Frequencies are those of the stream as it is meant; what is read has the opposite part's sign.
        let read_hz = if negated { -at_hz } else { at_hz };
        let inverted = negated != matches!(self.word(band, "inverted").as_str(), "true" | "1");
        let center_hz = if inverted { centre_hz + read_hz } else { centre_hz - read_hz };
        Ok((center_hz, inverted))
    }
}

#[cfg(test)]
mod tests;
