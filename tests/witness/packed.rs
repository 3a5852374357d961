//! Samples of a few bits as makers of front ends print them, and recordings of them that others made.

use gnss::gps::l1ca::L1_CA;
use gnss::packed::{Components, Encoding, Interleaved, Layout};
use gnss::recording::Description;
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::time::Rate;
use gnss::{ion, signal::Link};
use receiver::acquire::{Acquired, AcquisitionSettings, Searcher};
use receiver::source::Block;

use super::data::external;

const REAL: Interleaved = Interleaved {
    bits: 2,
    encoding: Encoding::TwosComplement,
    components: Components::Real,
    lowest_first: true,
    word_bytes: 1,
    big_endian: false,
    channels: 1,
    channel: 1,
};

fn values(of: Interleaved, bytes: &[u8]) -> Vec<i8> {
    let mut out = Vec::new();
    Layout::interleaved(&of).unwrap().unpack(bytes, &mut out);
    out.into_iter().map(|byte| byte as i8).collect()
}

/// MAX2769 data sheet, "Output Data Format": two bits of sign and magnitude, unsigned and two's complement
/// for 3, 1, −1 and −3. The order of samples and of I and Q is that of the two recordings below.
#[test]
fn codes_and_their_positions_are_those_that_makers_print() {
    for (encoding, codes) in [
        (Encoding::SignMagnitude, [0b01, 0b00, 0b10, 0b11]),
        (Encoding::Offset, [0b11, 0b10, 0b01, 0b00]),
        (Encoding::TwosComplement, [0b01, 0b00, 0b11, 0b10]),
    ] {
        // The first sample lies in the lowest bits.
        let byte = codes.iter().rev().fold(0, |byte, code| byte << 2 | code);
        assert_eq!(values(Interleaved { encoding, ..REAL }, &[byte]), [3, 1, -1, -3], "{encoding}");
    }
    // From the highest bit of a little-endian word: I and Q of L1, of L2, and six times of L5.
    let signs = Interleaved { bits: 1, encoding: Encoding::Sign, components: Components::Iq, ..REAL };
    let first = Interleaved { lowest_first: false, word_bytes: 2, channels: 8, ..signs };
    assert_eq!(values(first, &[0x00, 0b1000_0000]), [1, -1]);
    assert_eq!(values(Interleaved { channel: 2, ..first }, &[0x00, 0b0001_0000]), [-1, 1]);
}

/// The metadata of a recorder with one oscillator for two bands, whose quadrature part is negated: both bands
/// have the frequency of that oscillator at 0 Hz.
#[test]
fn bands_of_one_oscillator_have_its_frequency_at_zero() {
    let stream = |id: &str, centre: &str, at: &str| {
        format!(
            "<stream id=\"{id}\"><ratefactor>1</ratefactor><quantization>8</quantization><packedbits>16</packedbits>\
             <format>IQn</format><encoding>TC</encoding><band id=\"{id}\"><centerfreq format=\"MHz\">{centre}\
             </centerfreq><translatedfreq format=\"MHz\">{at}</translatedfreq></band></stream>"
        )
    };
    let text = format!(
        "<metadata><lane id=\"a\"><system id=\"s\"/><block><cycles>1</cycles><chunk><sizeword>2</sizeword>\
         <countwords>2</countwords><lump>{}{}</lump></chunk></block></lane><system id=\"s\">\
         <freqbase format=\"MHz\">62.000000</freqbase></system></metadata>",
        stream("L1", "1575.420000", "7.420000"),
        stream("B1", "1561.098000", "-6.902000"),
    );
    let streams = ion::parse(&text, "two.xml").unwrap();
    for (_, stream) in &streams {
        assert_eq!((stream.center_hz, stream.inverted), (Some(1_568.0e6), true));
        assert_eq!(stream.rate, Rate::from_hz(62e6));
    }
    assert_eq!(streams.len(), 2);
}

/// The satellites of `candidates` that `milliseconds` of a recording hold.
fn found(name: &str, of: Description, milliseconds: usize, candidates: &[u8]) -> Option<Vec<Acquired>> {
    let bytes = std::fs::read(external(name)?).unwrap();
    let (format, layout) = of.samples.unwrap().unpacked().unwrap();
    let rate = of.rate.unwrap();
    let (mut packed, mut i, mut q) = (Vec::new(), Vec::new(), Vec::new());
    layout.unwrap().unpack(&bytes, &mut packed);
    format.unpack(&packed, &mut i, &mut q);
    let samples = (rate.hz() * 1e-3) as usize * milliseconds;
    let (i, q) = (&i[..samples], &q[..samples]);
    let center_hz = of.center_hz.unwrap();
    let metadata = IfMetadata { format, rate, center_hz, inverted: of.inverted, start: None };
    // 12 ms are two sums of 4 ms over every code phase, and the lead of one.
    let settings = AcquisitionSettings { coherent_periods: 4, noncoherent_sums: 2, ..Default::default() };
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let links: Vec<Link> = candidates.iter().map(|prn| L1_CA.link(Sv::gps(*prn))).collect();
    let rows = searcher.search(&Block { first: 0, i, q }, &links).unwrap();
    Some(rows.into_iter().filter_map(|(_, hit)| hit).collect())
}

/// Each of `listed` near the Doppler that another program found, and none of the others.
fn assert_listed(found: &[Acquired], listed: &[(u8, f64)], tolerance_hz: f64) {
    for hit in found {
        assert!(listed.iter().any(|(prn, _)| *prn == hit.sv.number), "not listed: {hit:?}");
    }
    for (prn, doppler_hz) in listed {
        let hit = found.iter().find(|hit| hit.sv.number == *prn).unwrap_or_else(|| panic!("{prn} not found"));
        assert!((hit.doppler_hz - doppler_hz).abs() <= tolerance_hz, "{hit:?}, listed at {doppler_hz} Hz");
    }
}

#[test]
fn a_real_two_bit_recording_holds_the_satellites_that_others_found_in_it() {
    let of = Description {
        samples: Some(gnss::recording::Samples::Interleaved(REAL)),
        rate: Rate::from_hz(20e6),
        center_hz: Some(L1_CA.centre_hz() - 5_000_446.0),
        ..Description::default()
    };
    // The strongest of the list, and five that are in no list.
    let candidates = [3, 1, 17, 23, 11, 6, 9, 2, 5, 8, 10, 13];
    let Some(found) = found("if-signals/ifen_e1_2016-01-19_20msps_r2bit.bin", of, 14, &candidates) else { return };
    let strong = [(3, 500.0), (1, -1500.0), (17, 1000.0), (23, 3500.0), (11, -2500.0)];
    let found: Vec<Acquired> = found.into_iter().filter(|hit| ![6, 9].contains(&hit.sv.number)).collect();
    // The list is on a grid of 500 Hz by sums of a millisecond: 50 Hz from the middle between two bins their
    // powers differ by less than 0.8 dB (sinc squared at 0.2 and 0.3), and noise chooses.
    assert_listed(&found, &strong, 300.0);
}

/// Facts of the file as its makers and the manifest of the recording have them, in the standard's elements:
/// in a word of 0.2 µs from its highest bit on a sample of L1, one of L2 and six of L5.
pub const HANOI: &str = r#"<metadata><lane id="m"><system id="f"/><block><cycles>0</cycles><chunk>
    <sizeword>2</sizeword><countwords>1</countwords><endian>Little</endian><lump>
    <stream id="L1"><ratefactor>1</ratefactor><quantization>1</quantization><packedbits>2</packedbits><shift>Left</shift>
      <format>IQn</format><encoding>SIGN</encoding><band id="L1"><centerfreq format="GHz">1.57542</centerfreq>
      <translatedfreq format="kHz">-48.75</translatedfreq></band></stream>
    <stream id="L2"><ratefactor>1</ratefactor><quantization>1</quantization><packedbits>2</packedbits><shift>Left</shift>
      <format>IQn</format><encoding>SIGN</encoding><band id="L2"><centerfreq format="MHz">1227.6</centerfreq>
      <translatedfreq format="kHz">-56.25</translatedfreq></band></stream>
    <stream id="L5"><ratefactor>6</ratefactor><quantization>1</quantization><packedbits>12</packedbits><shift>Left</shift>
      <format>IQn</format><encoding>SIGN</encoding><band id="L5"><centerfreq format="MHz">1176.45</centerfreq>
      <translatedfreq format="kHz">121.875</translatedfreq></band></stream></lump></chunk></block></lane>
    <system id="f"><freqbase format="MHz">5.0</freqbase></system></metadata>"#;

#[test]
fn a_one_bit_recording_of_three_bands_holds_the_satellites_that_others_found_in_it() {
    let (_, of) = ion::parse(HANOI, "hanoi.xml").unwrap().into_iter().next().unwrap();
    let candidates = [30, 1, 7, 11, 28, 2, 5, 8, 10, 13, 20, 25];
    let file = "if-signals/jrc_hanoi_2015-04-08_l1_l2_l5_1bit.bin";
    let Some(found) = found(file, of, 14, &candidates) else { return };
    // The list is on a grid of 250 Hz.
    assert_listed(&found, &[(30, 500.0), (1, -1000.0), (7, -1750.0), (11, -2250.0), (28, 2000.0)], 130.0);
}
