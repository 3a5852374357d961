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
    assert!(matches!(format, Format::Ci8 | Format::Ri8), "{format}");
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

/// The bands of the standard's own samples: centre, translated and format as their files have them, and
/// where the manifest of the recordings, or the other band, has the carrier.
#[test]
fn a_centre_that_is_already_at_0_hz_is_not_translated_again() {
    let tuned = |centre: &str, translated: &str, format: &str| {
        let text = TRIPLE
            .replacen(r#"<centerfreq format="GHz">1.57542</centerfreq>"#, centre, 1)
            .replacen(r#"<translatedfreq format="kHz">-48.75</translatedfreq>"#, translated, 1)
            .replacen("<format>IQn<", &format!("<format>{format}<"), 1);
        let (_, stream) = parse(&text, "three.xml").unwrap().remove(0);
        (stream.center_hz.unwrap(), stream.inverted)
    };
    let ghz = |value: &str| format!(r#"<centerfreq format="GHz">{value}</centerfreq>"#);
    let khz = |value: &str| format!(r#"<translatedfreq format="kHz">{value}</translatedfreq>"#);
    // JRC: I - jQ has L1 at -48.75 kHz; both ways to write it are one tuning.
    assert_eq!(tuned(&ghz("1.575468750"), &khz("-48.750"), "IQn"), (1_575.468_75e6, true));
    assert_eq!(tuned(&ghz("1.57542"), &khz("-48.75"), "IQn"), (1_575.468_75e6, true));
    // FITWDP: both parts are negated, which turns and does not mirror.
    assert_eq!(tuned(&ghz("1.575"), &khz("420.0"), "InQn"), (1_575e6, false));
    assert_eq!(tuned(&ghz("1.176"), &khz("450.0"), "InQn"), (1_176e6, false));
    // TRIGR, SJTU's second band: a carrier that is translated, by a local oscillator at 1568 MHz there.
    assert_eq!(tuned(&ghz("1.57542"), &khz("13680"), "IF"), (1_561.74e6, false));
    assert_eq!(tuned(&ghz("1.561098"), &khz("-6902"), "IQ"), (1_568e6, false));
    // No carrier either way: as the standard says.
    assert_eq!(tuned(&ghz("1.5"), &khz("100"), "IQ"), (1_499.9e6, false));
}

/// Bits and lumps of two of the standard's own samples: of four streams in turn (TRIGR), whose converter's
/// output has eight samples a word, the earliest in the lowest bits; and in a whole word of two (FITWDP).
#[test]
fn a_lump_fills_its_chunk_and_shifts_to_the_right_reverse_time_alone() {
    let stream = |id: &str, format: &str, bits: u32| {
        format!(
            r#"<stream id="{id}"><ratefactor>1</ratefactor><quantization>1</quantization><packedbits>{bits}</packedbits>
               <shift>Right</shift><format>{format}</format><encoding>SIGN</encoding><band id="L1"><centerfreq
               format="Hz">1.57542e9</centerfreq><translatedfreq format="Hz">1.368e7</translatedfreq></band></stream>"#
        )
    };
    let parsed = |word: &str, shift: &str, streams: &str| {
        let text = format!(
            r#"<metadata><lane id="a"><system><freqbase>56320000</freqbase></system><block><cycles>9</cycles><chunk>
               {word}<endian>L</endian><padding>Tail</padding><wordshift>R</wordshift><lump>
               <shift>{shift}</shift>{streams}</lump></chunk></block></lane></metadata>"#
        );
        parse(&text, "four.tgx").unwrap()
    };
    let four: String = ["3", "2", "1", "0"].map(|id| stream(id, "IF", 1)).concat();
    let streams = parsed("<sizeword>4</sizeword><countwords>1</countwords>", "Right", &four);
    // The word 0x8421_1248: its lowest four bits, 1000, are the first samples of the four streams.
    let word = 0x8421_1248_u32.to_le_bytes();
    for (place, (name, description)) in streams.iter().enumerate() {
        // Streams 3 to 0 from the highest of four bits on, nibbles 8, 4, 2, 1, 1, 2, 4, 8 in time.
        let expected = [8, 4, 2, 1, 1, 2, 4, 8].map(|nibble| 2 * ((nibble >> (3 - place)) & 1) - 1);
        assert_eq!(unpacked(description, &word), expected.map(|value: i32| value as i8), "stream {name}");
    }
    let two = [stream("L1", "InQn", 2), stream("L5", "InQn", 2)].concat();
    let streams = parsed("<sizeword>2</sizeword><countwords>1</countwords>", "Left", &two);
    // 10 01, 11 00, 01 10, 00 11 from the highest bit on.
    let word = 0b1001_1100_0110_0011_u16.to_le_bytes();
    assert_eq!(unpacked(&streams[0].1, &word), [1, -1, 1, 1, -1, 1, -1, -1]);
    assert_eq!(unpacked(&streams[1].1, &word), [-1, 1, -1, -1, 1, -1, 1, 1]);
}

#[test]
fn lanes_of_several_files_have_their_own_streams_and_samples() {
    let lane = |name: &str, rate: &str| {
        format!(
            r#"<lane id="{name}"><system id="S"/><block><cycles>0</cycles><chunk><sizeword>1</sizeword>
               <countwords>1</countwords><lump><stream id="{name}-L1"><ratefactor>{rate}</ratefactor>
               <quantization>2</quantization><packedbits>8</packedbits><format>IF</format><encoding>TCA</encoding>
               <band id="L1"/></stream></lump></chunk></block></lane>"#
        )
    };
    let text = format!(
        r#"{}<?xml version="1.0"?><metadata><system id="S"><freqbase format="MHz">5</freqbase></system>
           <band id="L1"><centerfreq format="Hz">1575420000.0</centerfreq>
           <translatedfreq format="Hz">5000445.88565834</translatedfreq></band>
           <file><lane id="B"/><url>b.stream</url></file><file><lane id="A"/><url>a.stream</url></file>{}{}
           </metadata>"#,
        "\t",
        lane("A", "4"),
        lane("B", "2")
    );
    let streams = parse(&text, "two.smfx").unwrap();
    let of = |k: usize| (streams[k].0.as_str(), streams[k].1.dataset.as_deref(), streams[k].1.rate.unwrap().hz());
    assert_eq!(of(0), ("A-L1", Some("a.stream"), 20e6));
    assert_eq!(of(1), ("B-L1", Some("b.stream"), 10e6));
}

/// Two-bit real samples, four a byte from the lowest bits on, in a group of five bytes of which the last
/// comes first (IFEN): the file's order is that of single bytes.
#[test]
fn words_and_samples_that_are_both_reversed_lie_in_the_order_of_the_file() {
    let text = |bytes: u32| {
        format!(
            r#"<metadata><lane id="a"><system><freqbase format="MHz">5</freqbase></system><block><cycles>0</cycles>
               <chunk><sizeword>1</sizeword><countwords>{bytes}</countwords><wordshift>Right</wordshift><lump><stream>
               <ratefactor>{}</ratefactor><quantization>2</quantization><packedbits>{}</packedbits><shift>Right</shift>
               <format>IF</format><encoding>TCA</encoding><band><centerfreq>1191795000</centerfreq><translatedfreq
               format="Hz">74999467.5946236</translatedfreq></band></stream></lump></chunk></block></lane></metadata>"#,
            4 * bytes,
            8 * bytes
        )
    };
    let samples = |bytes| {
        let (_, description) = parse(&text(bytes), "one.smfx").unwrap().remove(0);
        unpacked(&description, &[0b1110_0100, 0x1b, 0x00, 0xff, 0x72])
    };
    assert_eq!(samples(5), samples(1));
    // 00, 01, 10 and 11 from the lowest bits on.
    assert_eq!(samples(5)[..4], [1, 3, -3, -1]);
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
        ("</block>", "</block><block/>", ["2 kinds of <block> in <lane>", "one"]),
        ("</chunk>", "</chunk><chunk/>", ["2 kinds of <chunk> in <block>", "one"]),
    ] {
        let text = refused(from, to);
        assert!(text.starts_with("three.xml: ") && words.iter().all(|word| text.contains(word)), "{text}");
    }
}
