//! A search to which a model answers.
//!
//! The model gives the largest cell of a satellite's search; threshold and refinement are those of a search
//! in samples. Limits: Dopplers are not left early, and cross-correlation between codes is the model's
//! affair.

use rayon::prelude::*;

use super::codes::{SEARCHED, coded};
use super::grid::Grid;
use super::refine::{Refined, refine};
use super::{AcquireError, Acquired, AcquisitionSettings, Band, Finding, Searcher, companion};
use crate::correlate::correlator::{Cell, Code, Sought, Span};
use crate::lead::{followed_db, lead};
use gnss::record::AcquisitionRow;
use gnss::signal::{Layers, Link};

impl Searcher {
    /// Searches for every candidate by itself; rows come in the order of the candidates.
    pub(super) fn search_model(
        &mut self,
        span: &Span,
        candidates: &[Link],
    ) -> Result<Vec<(AcquisitionRow, Option<Acquired>)>, AcquireError> {
        candidates.iter().try_for_each(|link| self.prepare(*link))?;
        let grids = &self.grids;
        let one = |link: &Link| look(grids.get(&Band::of(*link))?, span, *link);
        Ok(candidates.par_iter().filter_map(one).collect())
    }

    /// Searches for every one of `near`, within `half_hz` of its Doppler.
    pub(super) fn search_model_near(
        &mut self,
        span: &Span,
        near: &[(Link, f64)],
        half_hz: f64,
    ) -> Vec<(AcquisitionRow, Option<Acquired>)> {
        let settings = AcquisitionSettings { doppler_max_hz: half_hz, ..self.settings.clone() };
        let one = |(link, doppler_hz): &(Link, f64)| {
            let component = lead(link.signal)?;
            let one = (component, companion(component, link.signal).is_some(), link.carrier_hz());
            look(&Grid::new(one, &self.metadata, &settings, *doppler_hz, &mut self.planner)?, span, *link)
        };
        near.iter().filter_map(one).collect()
    }
}

/// The largest cell of a satellite, refined where it exceeds its threshold.
fn look(grid: &Grid, span: &Span, link: Link) -> Option<(AcquisitionRow, Option<Acquired>)> {
    let component = lead(link.signal)?;
    let begins: Vec<f64> = grid.dwells.begins().iter().map(|period| period * grid.period_samples).collect();
    let sought = Sought {
        code: Code::new(link, component, SEARCHED),
        beside: companion(component, link.signal).map(|beside| Code::new(link, beside, SEARCHED)),
        first: span.first,
        begins: &begins,
        samples: f64::from(grid.coherent_periods) * grid.period_samples,
        dopplers_hz: &grid.dopplers_hz,
        lag_chips: grid.lag_samples * grid.chips_per_sample,
        cells: grid.cells,
    };
    let Cell { statistic, doppler_hz, code_phase_chips } = span.model.search(&sought);
    let excess = statistic / (2.0 * f64::from(grid.sums)) - 1.0;
    let coherent_s = component.period_s() * f64::from(grid.coherent_periods);
    let coarse =
        Refined { code_phase_chips, doppler_hz, cn0_hz: excess.max(f64::MIN_POSITIVE) / coherent_s, power: 0.0 };
    let threshold = grid.law.threshold;
    let coded = if statistic > threshold { coded(link, component) } else { None };
    let hit = coded.map(|coded| refine(grid, span, component, &coded, coarse, grid.periods as usize));
    let of = (link, followed_db(component, Layers::Strongest));
    let finding = Finding { statistic, threshold, coarse, hit };
    Some(finding.report(of, span.first, f64::from(component.code_chips)))
}
