//! Strong signals of one kind pass for weak ones of another on the same carrier: codes of a millisecond have
//! their lines at whole kilohertz whatever family they are of.
//!
//! Within a signal the search subtracts what is strong and looks again. What is left between signals is done
//! here, after all of them were searched: a hit 10 dB below one of another signal has to show in samples
//! without that one. A hit is only ever taken away, so the probability of a false alarm stays below the one
//! that is set. Limits: of the other signal the component that was searched for is subtracted, and the one
//! beside it where both were searched for together.

use std::collections::BTreeMap;

use super::window::Window;
use super::{AcquireError, Acquired, Band, Code, Known, Searcher, WEAK_SHARE};
use crate::gnss::record::AcquisitionRow;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Link;
use crate::receiver::lead::lead;
use crate::receiver::source::Block;

/// A row for a candidate, and where it was found.
type Found = (AcquisitionRow, Option<Acquired>);

/// Whether `hit` may be nothing but cross-correlation with `other`, of another signal.
fn is_covered(hit: &Acquired, other: &Acquired) -> bool {
    hit.signal != other.signal && other.cn0_dbhz + 10.0 * libm::log10(WEAK_SHARE) > hit.cn0_dbhz
}

impl Searcher {
    /// Takes away hits that do not show without the stronger ones of other signals, which are hits too or
    /// `known` before.
    pub(super) fn clear_across(
        &mut self,
        block: &Block,
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
            let mut window = Window::centred(block, grid.samples_needed() as usize);
            let mut others: Vec<&Acquired> =
                hits.iter().filter(|other| doubted.iter().any(|(_, hit)| is_covered(hit, other))).collect();
            others.sort_by(|a, b| b.cn0_dbhz.total_cmp(&a.cn0_dbhz));
            for other in others {
                let its = (self.grids.get(&Band::of(other.link())), self.codes.get(&other.link()), lead(other.signal));
                let (Some(grid), Some(code), Some(component)) = its else { continue };
                let place = grid.refined(other, block.first);
                code.subtract(grid, (f64::from(component.code_chips), complex), &place, &mut window);
            }
            // Those of its own signal that are beyond doubt are taken out as in the search before.
            let sure = hits.iter().filter(|hit| Band::of(hit.link()) == band);
            let sure = sure.filter(|hit| doubted.iter().all(|(_, other)| other.sv != hit.sv));
            let sure: Vec<Known<'_>> =
                sure.filter_map(|hit| Some((self.codes.get(&hit.link())?, grid.refined(hit, block.first)))).collect();
            let codes: Vec<(usize, Sv, &Code)> = (doubted.iter())
                .filter_map(|(index, hit)| Some((*index, hit.sv, self.codes.get(&hit.link())?)))
                .collect();
            let sought: Vec<(Sv, &Code)> = codes.iter().map(|&(_, sv, code)| (sv, code)).collect();
            let again = self.search_signal(band.signal, grid, window, (&sought, &sure));
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
