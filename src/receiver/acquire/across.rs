//! Strong signals of one kind pass for weak ones of another on the same carrier: codes of a millisecond have
//! their lines at whole kilohertz whatever family they are of. Channels of GLONASS share one code, whose
//! lines pass for a satellite of the channels beside.
//!
//! Within a family of codes on one carrier (`family`) the search subtracts what is strong and looks again.
//! What is left between families, or carriers of one signal, is done here, after all of them were searched: a
//! hit 10 dB below one of another family or carrier has to show in samples without that one, and above what
//! its subtraction may leave. A hit is only ever taken away, so the probability of a false alarm stays below
//! the one that is set. Limits: of the other signal the component that was searched for is subtracted, and
//! the one beside it where both were searched for together.

use std::collections::BTreeMap;

use super::window::Window;
use super::{AcquireError, Acquired, Band, Code, Found, Known, Searcher, WEAK_SHARE};
use crate::lead::lead;
use crate::source::Stretch;
use gnss::signal::Link;

/// True if `hit` may be cross-correlation with `other`, a hit of another family or carrier.
fn is_covered(hit: &Acquired, other: &Acquired) -> bool {
    Band::of(hit.link()) != Band::of(other.link()) && other.cn0_dbhz + 10.0 * libm::log10(WEAK_SHARE) > hit.cn0_dbhz
}

impl Searcher {
    /// Takes away hits that do not show without the stronger ones of other families, which are hits too or
    /// `known` before.
    pub(super) fn clear_across(
        &mut self,
        stretch: &Stretch,
        known: &[Acquired],
        results: &mut [Found],
    ) -> Result<(), AcquireError> {
        let hits: Vec<Acquired> = results.iter().filter_map(|(_, hit)| *hit).chain(known.iter().copied()).collect();
        let mut doubted: BTreeMap<Band, Vec<(usize, Acquired)>> = BTreeMap::new();
        for (index, (_, hit)) in results.iter().enumerate() {
            let Some(hit) = hit.filter(|hit| hits.iter().any(|other| is_covered(hit, other))) else { continue };
            doubted.entry(Band::of(hit.link())).or_default().push((index, hit));
        }
        if doubted.is_empty() {
            return Ok(());
        }
        let links: Vec<Link> = hits.iter().map(Acquired::link).collect();
        self.codes.make(&self.grids, links.iter())?;
        let complex = self.metadata.format.is_complex();
        for (band, doubted) in doubted {
            let Some(grid) = self.grids.get(&band) else { continue };
            let (mut window, mut taken) = (Window::centred(stretch, grid.samples_needed() as usize), 0.0);
            let mut others: Vec<&Acquired> =
                hits.iter().filter(|other| doubted.iter().any(|(_, hit)| is_covered(hit, other))).collect();
            others.sort_by(|a, b| b.cn0_dbhz.total_cmp(&a.cn0_dbhz));
            for other in others {
                let its = (self.grids.get(&Band::of(other.link())), self.codes.get(&other.link()), lead(other.signal));
                let (Some(grid), Some(code), Some(component)) = its else { continue };
                let place = grid.refined(other, stretch.first());
                let power = code.subtract(grid, (f64::from(component.code_chips), complex), &place, &mut window);
                // Power of a sum over a period of the code that is searched for.
                let ratio = lead(band.signal).map_or(1.0, |own| own.period_s() / component.period_s());
                taken = f64::max(taken, power * ratio * ratio);
            }
            // Those of its own signal that are beyond doubt are taken out as in the search before.
            let sure = hits.iter().filter(|hit| Band::of(hit.link()) == band);
            let sure = sure.filter(|hit| doubted.iter().all(|(_, other)| other.link() != hit.link()));
            let sure: Vec<Known<'_>> = sure
                .filter_map(|hit| Some((self.codes.get(&hit.link())?, grid.refined(hit, stretch.first()))))
                .collect();
            let codes: Vec<(usize, Link, &Code)> = (doubted.iter())
                .filter_map(|(index, hit)| Some((*index, hit.link(), self.codes.get(&hit.link())?)))
                .collect();
            let sought: Vec<(Link, &Code)> = codes.iter().map(|&(_, link, code)| (link, code)).collect();
            let again = self.search_signal(band.signal, grid, (window, taken), (&sought, &sure));
            for ((index, ..), (row, hit)) in codes.iter().zip(again) {
                // What shows keeps its place: a hit of another place is another hit.
                if let Some(slot) = results.get_mut(*index).filter(|_| hit.is_none()) {
                    *slot = (row, None);
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::tests::{Noise, Sent, metadata, record};
    use super::super::{AcquisitionSettings, samples_needed};
    use super::*;
    use crate::source::Block;
    use gnss::glonass::fdma::G1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::samples::{Format, IfMetadata};
    use gnss::satellite::Sv;
    use gnss::sbas::l1::L1 as SBAS_L1;

    #[test]
    fn what_a_strong_signal_makes_in_codes_of_another_is_taken_away_and_what_is_there_stays() {
        let metadata = metadata(Format::Ci8, 2.6e6, 0.0, false);
        let signals = [&L1_CA, &SBAS_L1].map(|signal| signal.name.to_owned()).to_vec();
        let settings = AcquisitionSettings { signals, ..AcquisitionSettings::default() };
        let strong = Sent { prn: 5, doppler_hz: 1200.0, phase_chips: 300.4, cn0_dbhz: 60.0 };
        // S22, whose code has number 122.
        let there = Sent { prn: 122, doppler_hz: -2300.0, phase_chips: 700.2, cn0_dbhz: 43.0 };
        let samples = samples_needed(&metadata, &settings).unwrap() as usize;
        let recording = record(metadata.clone(), samples, &[strong, there], 11);
        let block = Block { first: 0, i: &recording.i, q: &recording.q };
        let mut searcher = Searcher::new(&metadata, &settings).unwrap();
        let gps = searcher.search(&block, &[L1_CA.link(Sv::gps(5))]).unwrap();
        let known: Vec<Acquired> = gps.into_iter().filter_map(|(_, hit)| hit).collect();
        let links: Vec<Link> = SBAS_L1.satellites().map(|sv| SBAS_L1.link(sv)).collect();
        let mut results = searcher.search(&block, &links).unwrap();

        // Every largest cell as if it had passed.
        for (row, hit) in &mut results {
            let (sv, signal, sample) = (row.sv, row.signal, row.sample);
            let (code_phase_chips, doppler_hz) = (row.code_phase_chips, row.doppler_hz);
            let cn0_dbhz = row.cn0_dbhz.min(45.0);
            *hit = hit.or(Some(Acquired { sv, signal, sample, code_phase_chips, doppler_hz, cn0_dbhz }));
            row.acquired = true;
        }
        let largest = |results: &[Found]| {
            let absent = results.iter().filter(|(row, _)| row.sv.number != 22);
            absent.map(|(row, _)| row.statistic).fold(0.0, f64::max)
        };
        let before = largest(&results);
        searcher.clear_across(&Stretch::Planes(block), &known, &mut results).unwrap();
        let kept: Vec<u8> = results.iter().filter_map(|(_, hit)| hit.map(|hit| hit.sv.number)).collect();
        assert_eq!(kept, [22]);
        assert!(results.iter().all(|(row, hit)| row.acquired == hit.is_some()));
        // C/A codes meet at 21 to 24 dB down: 20 and 2 · 20 ms · 4000 to 8000 Hz, where noise has 60.
        let after = largest(&results);
        println!("largest cell of absent satellites: {before:.1} beside the strong one, {after:.1} without it");
        assert!(before > 2.0 * after, "{before} {after}");

        // Nothing is taken away by satellites of its own signal, or by those that are not 10 dB stronger.
        let mut alone = searcher.search(&block, &links).unwrap();
        let weak: Vec<Acquired> = known.iter().map(|hit| Acquired { cn0_dbhz: 45.0, ..*hit }).collect();
        searcher.clear_across(&Stretch::Planes(block), &weak, &mut alone).unwrap();
        assert!(alone.iter().any(|(row, hit)| row.sv.number == 22 && hit.is_some()));
    }

    /// Samples with GLONASS satellites of these numbers, Dopplers and powers, each carrier with the one code.
    fn channels(metadata: &IfMetadata, samples: usize, sent: &[(Link, f64, f64)]) -> (Vec<f32>, Vec<f32>) {
        let (rate_hz, mut noise) = (metadata.rate.hz(), Noise(5));
        let mut planes: (Vec<f32>, Vec<f32>) =
            (0..samples).map(|_| noise.pair()).map(|(i, q)| (i as f32, q as f32)).unzip();
        for (link, doppler_hz, cn0_dbhz) in sent {
            let component = lead(link.signal).unwrap();
            let code = (component.code)(link.sv.number).unwrap();
            // Both parts have unit variance: twice the power of noise of unit power.
            let amplitude = (2.0 * libm::pow(10.0, cn0_dbhz / 10.0) / rate_hz).sqrt();
            let step = component.chip_rate_hz * (1.0 + doppler_hz / link.carrier_hz()) / rate_hz;
            let turns = (metadata.if_hz(link.carrier_hz()) + doppler_hz) / rate_hz;
            for (n, (i, q)) in planes.0.iter_mut().zip(&mut planes.1).enumerate() {
                let chip = f64::from(code[(97.3 * f64::from(link.sv.number) + n as f64 * step) as usize % code.len()]);
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * (turns * n as f64).fract());
                *i += (amplitude * chip * cos) as f32;
                *q += (amplitude * chip * sin) as f32;
            }
        }
        planes
    }

    /// Channels 5, 6 and −4 by 85 dB-Hz, as samples without noise have them, beside one of 50 dB-Hz.
    #[test]
    fn strong_channels_of_one_code_make_no_satellite_in_the_channels_beside_them() {
        let rate = gnss::time::Rate::from_hz(9e6).unwrap();
        let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: 1602e6, inverted: false, start: None };
        let settings = AcquisitionSettings { signals: vec![G1.name.to_owned()], ..AcquisitionSettings::default() };
        let link =
            |channel: i8| G1.satellites().map(|sv| G1.link(sv)).find(|link| link.channel() == Some(channel)).unwrap();
        let sent = [(5, 1750.0, 85.0), (6, 3118.0, 85.0), (-4, -1220.0, 85.0), (1, -2900.0, 50.0)];
        let sent = sent.map(|(channel, doppler_hz, cn0_dbhz)| (link(channel), doppler_hz, cn0_dbhz));
        let samples = samples_needed(&metadata, &settings).unwrap() as usize;
        let (i, q) = channels(&metadata, samples, &sent);
        let block = Block { first: 0, i: &i, q: &q };
        let mut searcher = Searcher::new(&metadata, &settings).unwrap();
        let mut found = |channels: &[i8]| -> Vec<i8> {
            let links: Vec<Link> = channels.iter().map(|channel| link(*channel)).collect();
            let rows = searcher.search(&block, &links).unwrap();
            rows.iter().filter_map(|(_, hit)| hit.and_then(|hit| hit.link().channel())).collect()
        };
        let all: BTreeSet<i8> = G1.satellites().filter_map(|sv| G1.link(sv).channel()).collect();
        let all: Vec<i8> = all.into_iter().collect();
        assert_eq!(found(&all), [-4, 1, 5, 6]);
        // Alone, the channels beside them show the lines.
        let alone: Vec<i8> = [4, 3, -3, -2].into_iter().flat_map(|channel| found(&[channel])).collect();
        assert!(!alone.is_empty());
    }
}
