//! Codes that meet: two satellites whose carriers differ by whole lines of their codes.
//!
//! A code of a period of 1 ms has lines 1 kHz apart. Where the Dopplers of two satellites differ by a whole
//! number of them, one despreads a part of the other, and an interval of T seconds sees it within about 1/T.
//! The part comes and goes as fast as the Dopplers change, so that the intervals before do not show its
//! scatter. Measured in nine static scenes of 600 s with twelve satellites of L1 C/A and intervals of 1 s:
//! within 2/T 38 of 4857 tests of correlations raised alarms at 1e-3, and beyond it 184 of 185 976, as
//! stated. Limits: signals with secondary codes, or of longer codes, have weaker lines closer together, and
//! are never said to meet. A satellite that no channel follows is not known.

use std::collections::{BTreeMap, BTreeSet};

use gnss::signal::{Link, SecondaryCode};

/// Distance from a line, in 1/T, up to which codes meet.
const NEAR: f64 = 2.0;
/// Longest period of a code whose lines count, in seconds, a hundredth added for rounding.
const LONGEST_PERIOD_S: f64 = 1.01e-3;

/// Distance of the lines of a signal, in Hz; `None` where they are weak.
fn lines_hz(link: Link) -> Option<f64> {
    let is_strong = |period_s: f64| period_s < LONGEST_PERIOD_S;
    let first = link.signal.components.first()?;
    let is_plain = matches!(first.secondary_code, SecondaryCode::None) && is_strong(first.period_s());
    is_plain.then(|| 1.0 / first.period_s())
}

/// Links that meet another one in an interval; each has its Doppler at the interval's two ends.
pub fn meeting(dopplers_hz: &BTreeMap<Link, [f64; 2]>, interval_s: f64) -> BTreeSet<Link> {
    let with_lines = |(link, hz): (&Link, &[f64; 2])| Some((*link, lines_hz(*link)?, *hz));
    let all: Vec<(Link, f64, [f64; 2])> = dopplers_hz.iter().filter_map(with_lines).collect();
    let mut found = BTreeSet::new();
    for (place, (one, lines_hz, own_hz)) in all.iter().enumerate() {
        for (other, other_lines_hz, other_hz) in &all[..place] {
            if one.carrier_hz() != other.carrier_hz() || lines_hz != other_lines_hz {
                continue;
            }
            // Lines between the ends of the interval count as those near one of them.
            let apart = [0, 1].map(|end| (own_hz[end] - other_hz[end]) / lines_hz);
            let near = NEAR / (interval_s * lines_hz);
            let (low, high) = (apart[0].min(apart[1]) - near, apart[0].max(apart[1]) + near);
            if low.ceil() <= high {
                found.extend([*one, *other]);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::Sv;

    fn met(dopplers_hz: &[[f64; 2]], interval_s: f64) -> Vec<u8> {
        let links = (1..).map(|number| L1_CA.link(Sv::gps(number)));
        let all = links.zip(dopplers_hz.iter().copied()).collect();
        meeting(&all, interval_s).into_iter().map(|link| link.sv.number).collect()
    }

    #[test]
    fn codes_meet_within_two_hertz_of_whole_kilohertz() {
        let steady = |hz: [f64; 3]| met(&hz.map(|hz| [hz; 2]), 1.0);
        assert_eq!(steady([100.0, 2101.9, 3500.0]), [1, 2]);
        assert_eq!(steady([100.0, -1899.0, 98.1]), [1, 2, 3]);
        assert!(steady([100.0, 2102.1, 3500.0]).is_empty());
        // A tenth of the time sees ten times as wide.
        assert_eq!(met(&[[100.0; 2], [2119.0; 2]], 0.1), [1, 2]);
    }

    #[test]
    fn a_line_that_is_passed_within_an_interval_is_met() {
        assert_eq!(met(&[[0.0, 0.0], [995.0, 1006.0]], 10.0), [1, 2]);
        assert!(met(&[[0.0, 0.0], [1001.0, 1006.0]], 10.0).is_empty());
    }

    #[test]
    fn one_satellite_alone_and_signals_of_longer_codes_meet_none() {
        assert!(met(&[[100.0; 2]], 1.0).is_empty());
        let both = [11, 12].map(|number| (E1.link(Sv { system: E1.system, number }), [50.0; 2]));
        assert!(meeting(&both.into(), 1.0).is_empty());
    }
}
