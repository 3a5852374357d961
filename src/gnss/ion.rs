//! Metadata of recordings as the Institute of Navigation's standard has them: XML beside a file of
//! samples.
//!
//! Source: ION GNSS SDR Metadata Standard, revision 1.0 (2020): lanes of blocks of chunks of lumps of
//! streams, a system's base rate, bands. A stream's 0 Hz is its band's centre less what that was
//! translated to. A format whose quadrature or in-phase part is negated (`IQn`, `InQ`, …) mirrors the
//! spectrum. Limits: one kind of block of one kind of chunk, in which every lump has the same streams;
//! encodings of 1 to 16 bits but for Gray codes, magnitude before sign and floating point. Times are
//! passed over: of the files that there are some have the start as the session's, some as the file's.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};
use thiserror::Error;

use crate::packed::{Components, Encoding, Group, Layout};
use crate::recording::{Blocks, Description, Samples};
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
    let document = Document::parse(text).map_err(|error| IonError::Syntax { name: name.to_owned(), error })?;
    let of = Of { name, ids: ids(document.root_element()) };
    let root = document.root_element();
    let lane = of.only(root, "lane")?;
    let chunk = of.chunk(lane)?;
    let system = of.child(lane, "system")?;
    let base_hz = of.frequency_hz(of.child(system, "freqbase")?)?;
    let file = root.children().find(|node| node.tag_name().name() == "file");
    let dataset = file.and_then(|file| inner(file, "url")).map(|url| url.trim().to_owned());
    let mut streams = of.streams(chunk, base_hz)?;
    for (_, description) in &mut streams {
        description.dataset.clone_from(&dataset);
    }
    Ok(streams)
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

    /// The one child of that name.
    fn only(&self, within: Node<'a, 'i>, name: &'static str) -> Result<Node<'a, 'i>, IonError> {
        let mut all = self.children(within, name);
        let first = all.next().ok_or_else(|| self.missing(name, within))?;
        let more = all.count();
        if more == 0 { Ok(first) } else { Err(self.bad(first, format!("one <{name}>, there are {}", more + 1))) }
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

    /// The lane's one chunk.
    fn chunk(&self, lane: Node<'a, 'i>) -> Result<Chunk<'a, 'i>, IonError> {
        let block = self.only(lane, "block")?;
        let node = self.only(block, "chunk")?;
        let endian = self.word(node, "endian");
        let shift = self
            .children(node, "lump")
            .next()
            .and_then(|lump| self.children(lump, "stream").next().map(|stream| self.word(stream, "shift")));
        let shift = [shift.unwrap_or_default(), self.word(node, "wordshift"), self.word(node, "shift")];
        let right = shift.iter().find(|word| matches!(word.as_str(), "left" | "right" | "l" | "r"));
        let group = Group {
            word_bytes: self.number(node, "sizeword", None)? as usize,
            words: self.number(node, "countwords", None)? as usize,
            big_endian: matches!(endian.as_str(), "big" | "b"),
            lowest_first: right.is_some_and(|word| word.starts_with('r')),
        };
        let framing = self.framing(block, &group)?;
        Ok(Chunk { node, group, framing })
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
        let Chunk { node, group, framing } = chunk;
        let lumps: Vec<Node<'a, 'i>> = self.children(node, "lump").collect();
        let first = *lumps.first().ok_or_else(|| self.missing("lump", node))?;
        let names = |lump| self.children(lump, "stream").map(|node| node.attribute("id")).collect::<Vec<_>>();
        if let Some(other) = lumps.iter().find(|lump| names(**lump) != names(first)) {
            return Err(self.bad(*other, "the streams of the first lump in all lumps"));
        }
        let width = |stream| self.number(stream, "packedbits", None);
        let lump_bits = self.children(first, "stream").map(width).sum::<Result<u32, _>>()?;
        let padded = self.word(node, "padding");
        let used = lump_bits * lumps.len() as u32;
        let room = (8 * group.word_bytes * group.words) as u32;
        let begin = if padded == "head" { room.saturating_sub(used) } else { 0 };
        let (mut streams, mut within) = (Vec::new(), begin);
        for (number, stream) in (1..).zip(self.children(first, "stream")) {
            let packed = width(stream)?;
            let factor = self.number(stream, "ratefactor", None)?;
            let starts = (0..lumps.len() as u32).map(|lump| within + lump * lump_bits);
            let samples = self.samples(stream, group, (factor, packed), starts)?;
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

    /// The samples of a stream: so many in so many bits, from each of `starts` on.
    fn samples(
        &self,
        stream: Node<'a, 'i>,
        group: Group,
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
        let starts = starts.flat_map(|start| (0..factor).map(move |k| start + begin + k * sample_bits));
        let layout = Layout::of_fields(group, (bits, encoding, components), starts);
        layout.map(Samples::Laid).map_err(|error| self.bad(stream, error.to_string()))
    }

    /// The radio frequency at 0 Hz of a stream, and whether its spectrum is mirrored.
    fn tuning(&self, stream: Node<'a, 'i>) -> Result<(f64, bool), IonError> {
        let band = self.child(stream, "band")?;
        let centre_hz = self.frequency_hz(self.child(band, "centerfreq")?)?;
        let at_hz = self.frequency_hz(self.child(band, "translatedfreq")?)?;
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
mod tests {
    use std::io::Read;

    use super::*;
    use crate::recording::Unblocked;
    use crate::samples::Format;

    /// Two streams of 1-bit I and Q in the higher half of a little-endian word, and six samples of a third.
    const TRIPLE: &str = r#"<?xml version="1.0"?>
        <metadata xmlns="http://www.ion.org/standards/sdrwg/schema/metadata.xsd">
          <lane id="three"><system id="S"/><block><cycles>0</cycles><sizeheader>0</sizeheader>
            <chunk><sizeword>2</sizeword><countwords>1</countwords><endian>Little</endian><padding>Tail</padding><lump>
              <stream id="L1"><ratefactor>1</ratefactor><quantization>1</quantization><packedbits>2</packedbits>
                <alignment>Left</alignment><shift>Left</shift><format>IQn</format><encoding>SIGN</encoding>
                <band id="L1"/></stream>
              <stream id="L2"><ratefactor>1</ratefactor><quantization>1</quantization><packedbits>2</packedbits>
                <shift>Left</shift><format>IQ</format><encoding>SIGN</encoding><band id="L2"/></stream>
              <stream id="L5"><ratefactor>6</ratefactor><quantization>1</quantization><packedbits>12</packedbits>
                <shift>Left</shift><format>QI</format><encoding>SIGN</encoding><band id="L5"/></stream>
            </lump></chunk></block></lane>
          <system id="S"><freqbase format="MHz">5.0</freqbase></system>
          <band id="L1"><centerfreq format="GHz">1.57542</centerfreq>
            <translatedfreq format="kHz">-48.75</translatedfreq></band>
          <band id="L2"><centerfreq format="MHz">1227.6</centerfreq><translatedfreq format="kHz">-56.25</translatedfreq>
            <inverted>true</inverted></band>
          <band id="L5"><centerfreq format="MHz">1176.45</centerfreq>
            <translatedfreq format="Hz">121875</translatedfreq></band>
          <file><url>three.dat</url><lane id="three"/></file>
        </metadata>"#;

    fn unpacked(description: &Description, bytes: &[u8]) -> Vec<i8> {
        let (format, layout) = description.samples.clone().unwrap().unpacked().unwrap();
        assert_eq!(format, Format::Ci8);
        let mut out = Vec::new();
        layout.unwrap().unpack(bytes, &mut out);
        out.into_iter().map(|byte| byte as i8).collect()
    }

    #[test]
    fn streams_lie_in_their_bits_and_at_their_frequencies() {
        let streams = parse(TRIPLE, "three.xml").unwrap();
        let names: Vec<&str> = streams.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["L1", "L2", "L5"]);
        let rates: Vec<f64> = streams.iter().map(|(_, one)| one.rate.unwrap().hz()).collect();
        assert_eq!(rates, [5e6, 5e6, 30e6]);
        assert!(streams.iter().all(|(_, one)| one.dataset.as_deref() == Some("three.dat")));
        // 0b10_01_110000000001, its lower byte first.
        let word = [0b0000_0001, 0b1001_1100];
        assert_eq!(unpacked(&streams[0].1, &word), [1, -1]);
        assert_eq!(unpacked(&streams[1].1, &word), [-1, 1]);
        assert_eq!(unpacked(&streams[2].1, &word), [1, 1, -1, -1, -1, -1, -1, -1, -1, -1, 1, -1]);
        let tuned = |k: usize| (streams[k].1.center_hz.unwrap(), streams[k].1.inverted);
        assert_eq!(tuned(0), (1_575.468_75e6, true));
        // Mirrored as it is meant: what is 56.25 kHz below the centre is above 0 Hz by as much.
        assert_eq!(tuned(1), (1_227.543_75e6, true));
        assert_eq!(tuned(2), (1_176.328_125e6, false));
    }

    #[test]
    fn headers_and_footers_of_blocks_are_no_samples() {
        let framed = |cycles: u32| {
            let block = format!("<cycles>{cycles}</cycles><sizeheader>3</sizeheader><sizefooter>1</sizefooter>");
            let text = TRIPLE.replacen("<cycles>0</cycles><sizeheader>0</sizeheader>", &block, 1);
            parse(&text, "three.xml").unwrap().remove(0).1
        };
        // Two words of two bytes a block.
        let blocks = framed(2).blocks.unwrap();
        assert_eq!(blocks, Blocks { header_bytes: 3, sample_bytes: 4, footer_bytes: 1 });
        let file: Vec<u8> = (0..22).collect();
        let mut samples = Vec::new();
        Unblocked::new(blocks, &file[..]).read_to_end(&mut samples).unwrap();
        assert_eq!(samples, [3, 4, 5, 6, 11, 12, 13, 14, 19, 20, 21]);
        let counts = [0, 3, 5, 7, 8, 11, 12, 22].map(|bytes| blocks.samples_among(bytes));
        assert_eq!(counts, [0, 0, 2, 4, 4, 4, 5, 11]);
        // A block without cycles is the whole file.
        let whole = framed(0);
        assert_eq!((whole.header_bytes, whole.trailing_bytes, whole.blocks), (3, 1, None));
    }

    #[test]
    fn what_cannot_be_read_is_refused_by_element() {
        let refused = |from: &str, to: &str| parse(&TRIPLE.replacen(from, to, 1), "three.xml").unwrap_err().to_string();
        for (from, to, words) in [
            ("</metadata>", "", ["not XML", "never closed"]),
            ("<system id=\"S\"><freq", "<system id=\"T\"><freq", ["no <freqbase>", "<system>"]),
            ("SIGN", "OG", ["<encoding> is \"OG\"", "SIGN, SM"]),
            (">IQn<", ">IFQ<", ["<format> is \"IFQ\"", "IF, IQ or QI"]),
            ("<sizeheader>0", "<sizeheader>-2", ["<sizeheader> is \"-2\"", "a whole number"]),
            ("<quantization>1", "<quantization>2", ["<packedbits> is \"2\"", "1 samples of 4"]),
            ("<countwords>1", "<countwords>0", ["<stream>", "no room"]),
            ("format=\"GHz\"", "format=\"lines\"", ["<centerfreq>", "not \"lines\""]),
        ] {
            let text = refused(from, to);
            assert!(text.starts_with("three.xml: ") && words.iter().all(|word| text.contains(word)), "{text}");
        }
    }
}
