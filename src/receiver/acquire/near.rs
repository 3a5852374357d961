//! A search for satellites whose Dopplers are known to some hundred hertz.

use super::grid::Grid;
use super::window::Window;
use super::{AcquireError, Acquired, AcquisitionSettings, Searcher, companion};
use crate::lead::lead;
use crate::source::Stretch;
use gnss::record::AcquisitionRow;
use gnss::signal::Link;

impl Searcher {
    /// Searches the beginning of `stretch` for every one of `near`, within `half_hz` of its Doppler; rows
    /// come in their order. Each is searched for by itself: what others' cross-correlation makes is found
    /// too.
    ///
    /// # Errors
    /// Errors of [`Searcher::search`].
    pub(crate) fn search_near(
        &mut self,
        stretch: &Stretch,
        near: &[(Link, f64)],
        half_hz: f64,
    ) -> Result<Vec<(AcquisitionRow, Option<Acquired>)>, AcquireError> {
        let links: Vec<Link> = near.iter().map(|(link, _)| *link).collect();
        for link in &links {
            self.prepare(*link)?;
        }
        if let Stretch::Modelled(span) = stretch {
            return Ok(self.search_model_near(span, near, half_hz));
        }
        let settings = AcquisitionSettings { doppler_max_hz: half_hz, ..self.settings.clone() };
        let mut results = Vec::with_capacity(near.len());
        for (link, doppler_hz) in near {
            // One after the other: spectra of all of them would be the largest part of a receiver's memory.
            self.codes.trim();
            self.codes.make(&self.grids, [link].into_iter())?;
            let (Some(component), Some(code)) = (lead(link.signal), self.codes.get(link)) else { continue };
            let one = (component, companion(component, link.signal).is_some(), link.carrier_hz());
            let grid = Grid::new(one, &self.metadata, &settings, *doppler_hz, &mut self.planner);
            let Some(grid) = grid else { continue };
            let (have, need) = (stretch.samples() as u64, grid.samples_needed());
            if have < need {
                return Err(AcquireError::TooFewSamples { have, need });
            }
            let window = Window::centred(stretch, need as usize);
            results.extend(self.search_signal(link.signal, &grid, (window, 0.0), (&[(*link, code)], &[])));
        }
        Ok(results)
    }
}
