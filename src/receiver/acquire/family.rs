//! Families of codes: what is searched for together.
//!
//! GPS and QZSS send codes of one family on one carrier. What a strong signal makes in codes of the other
//! system it makes in those of its own, so both are candidates of one search: the strong ones of either are
//! subtracted for both, and the codes of both show where other signals raise the cells of all.
//!
//! A hit of a search for few codes has no such sample. The search is made again then, for all satellites of
//! the family.

use gnss::signal::{self, Component, Layer, Link, Signal};

use super::multiple_access::LEAST_CODES;
use super::{can_hold_carrier, companion};
use crate::lead::lead;
use gnss::samples::IfMetadata;

/// Key of the candidates that share a grid: family, and carrier offset in hertz from the middle of its band.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Band {
    /// The first registered signal of the family.
    pub signal: &'static Signal,
    offset_hz: i64,
}

impl Band {
    pub fn of(link: Link) -> Self {
        let offset_hz = (link.carrier_hz() - link.signal.centre_hz()).round() as i64;
        let first = signal::all().into_iter().find(|other| are_one_family(other, link.signal));
        Self { signal: first.unwrap_or(link.signal), offset_hz }
    }

    /// Satellites beside `candidates` whose codes are of the family, where those of this band are too few for
    /// a sample; none where they are many.
    pub fn others(self, candidates: &[Link], metadata: &IfMetadata) -> Vec<Link> {
        let own: Vec<Link> = candidates.iter().copied().filter(|link| Self::of(*link) == self).collect();
        if own.len() >= LEAST_CODES {
            return Vec::new();
        }
        let all = signal::all().into_iter().filter(|other| are_one_family(other, self.signal));
        all.flat_map(|signal| signal.satellites().map(move |sv| signal.link(sv)))
            .filter(|link| link.is_of_constellation() && Self::of(*link) == self && can_hold_carrier(metadata, *link))
            .filter(|link| own.iter().all(|one| !one.is_alike(*link)))
            .collect()
    }
}

/// True if one grid serves the codes of both signals: they have one carrier, one length, one shape of chips,
/// and signs that turn after as many periods.
fn are_one_family(a: &'static Signal, b: &'static Signal) -> bool {
    if a == b {
        return true;
    }
    let waveform = |layer: &Layer| (layer.weight, layer.phase_cycles, layer.pulse, layer.chips);
    let same = |one: &'static Component, other: &'static Component| {
        let numbers = |c: &Component| (c.code_chips, c.secondary_code.periods(), c.periods_per_symbol());
        let is_pair = |component, signal| companion(component, signal).is_some();
        numbers(one) == numbers(other)
            && one.chip_rate_hz == other.chip_rate_hz
            && one.message.is_some() == other.message.is_some()
            && one.layers.len() == other.layers.len()
            && one.layers.iter().map(waveform).eq(other.layers.iter().map(waveform))
            && is_pair(one, a) == is_pair(other, b)
    };
    a.centre_hz() == b.centre_hz() && lead(a).zip(lead(b)).is_some_and(|(one, other)| same(one, other))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{self, Sent, record};
    use super::super::{AcquisitionSettings, Searcher, samples_needed};
    use super::*;
    use crate::source::Block;
    use gnss::samples::Format;

    #[test]
    fn gps_and_qzss_are_one_family_on_every_carrier() {
        let family = |name: &str| -> Vec<&str> {
            let one = Signal::find(name).unwrap();
            signal::all().into_iter().filter(|other| are_one_family(other, one)).map(|other| other.name).collect()
        };
        for name in ["L1 C/A", "L1C", "L2C", "L5"] {
            let both = [format!("GPS {name}"), format!("QZSS {name}")];
            assert!(both.iter().all(|name| family(name) == both), "{both:?}: {:?}", family(&both[0]));
        }
        for alone in ["SBAS L1", "Galileo E1", "BeiDou B1C", "NavIC L5", "GLONASS G1"] {
            assert_eq!(family(alone), [alone]);
        }
    }

    /// Five satellites of GPS at one Doppler make lines 21 to 24 dB down, and several together more: in
    /// 60 ms some 600 where noise has 60, and a threshold of 170.
    #[test]
    fn a_search_for_a_small_system_finds_nothing_that_a_large_one_of_its_family_makes() {
        let metadata = tests::metadata(Format::Ci8, 2.6e6, 0.0, false);
        let settings = AcquisitionSettings { noncoherent_sums: 30, ..AcquisitionSettings::default() };
        let gps = (1..=5_u8).map(|number| {
            let place = f64::from(number);
            let (doppler_hz, phase_chips) = (1000.0 * place - 3000.0, 190.3 * place);
            Sent { prn: 4 * number, doppler_hz, phase_chips, cn0_dbhz: 58.0 }
        });
        // J02, whose code has number 194.
        let there = Sent { prn: 194, doppler_hz: 250.0, phase_chips: 700.2, cn0_dbhz: 45.0 };
        let sent: Vec<Sent> = gps.chain([there]).collect();
        let samples = samples_needed(&metadata, &settings).unwrap() as usize;
        let recording = record(metadata.clone(), samples, &sent, 13);
        let block = Block { first: 0, i: &recording.i, q: &recording.q };
        let small = Signal::find("QZSS L1 C/A").unwrap();
        let large = Signal::find("GPS L1 C/A").unwrap();
        for both in [false, true] {
            let signals = if both { vec![small, large] } else { vec![small] };
            let links: Vec<Link> =
                signals.iter().flat_map(|signal| signal.satellites().map(|sv| signal.link(sv))).collect();
            let rows = Searcher::new(&metadata, &settings).unwrap().search(&block, &links).unwrap();
            let found = rows.iter().filter_map(|(row, hit)| hit.map(|_| row.sv.to_string()));
            let found: Vec<String> = found.collect();
            let expected = if both { vec!["J02", "G04", "G08", "G12", "G16", "G20"] } else { vec!["J02"] };
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn few_codes_get_others_of_their_family_and_none_gets_its_own() {
        let metadata = tests::metadata(Format::Ci8, 2.6e6, 0.0, false);
        let of = |name: &str, numbers: std::ops::RangeInclusive<u8>| -> Vec<Link> {
            let signal = Signal::find(name).unwrap();
            signal.satellites().filter(|sv| numbers.contains(&sv.number)).map(|sv| signal.link(sv)).collect()
        };
        let few = of("QZSS L1 C/A", 1..=10);
        let others = Band::of(few[0]).others(&few, &metadata);
        assert_eq!(others, of("GPS L1 C/A", 1..=32));
        assert!(others.iter().all(|link| Band::of(*link) == Band::of(few[0])));
        let many = of("GPS L1 C/A", 1..=32);
        assert!(Band::of(many[0]).others(&many, &metadata).is_empty());
        // A channel of GLONASS has the one code.
        let channel =
            Signal::find("GLONASS G1").map(|signal| signal.link(signal.satellites().next().unwrap())).unwrap();
        assert!(Band::of(channel).others(&[channel], &metadata).is_empty());
    }
}
