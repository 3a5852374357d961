//! All cases of a study taken together: how its figures are distributed over starts, positions and noises.
//!
//! `ensemble = [axis, …]` names the axes that keep ensembles apart; all others are pooled. One case counts
//! once, however long it is, so that the intervals are those of independent runs. Percentiles are of the
//! cases that have the figure, and how many have it is given beside them.

use super::StudyError;
use super::estimate::Estimate;
use super::publish::{Rows, short};
use super::result::Results;
use super::words;
use analysis::statistics::{median, percentile};

/// Distribution of one figure.
#[derive(Clone, Debug)]
pub struct Spread {
    /// Mean and its 95 % interval, of the cases that have the figure.
    pub estimate: Estimate,
    /// Half of the values are below.
    pub median: f64,
    /// 95 % of the values are below.
    pub p95: f64,
    /// The largest value.
    pub largest: f64,
}

impl Spread {
    /// Distribution of the values; `None` without values.
    pub fn of(values: &[f64]) -> Option<Self> {
        Some(Self {
            estimate: Estimate::of(values)?,
            median: median(values)?,
            p95: percentile(values, 0.95)?,
            largest: values.iter().copied().reduce(f64::max)?,
        })
    }
}

/// Cases that share their values of the axes named.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// Index of the value on each named axis.
    pub at: Vec<usize>,
    /// Cases of the ensemble.
    pub cases: u64,
    /// Distribution of each kept figure.
    pub spreads: Vec<Option<Spread>>,
}

/// Collects cases into their ensembles.
pub struct Collector {
    axes: Vec<usize>,
    figures: usize,
    /// Ensembles in the order of their first cases: values of the axes, cases, and values of each figure.
    found: Vec<(Vec<usize>, u64, Vec<Vec<f64>>)>,
}

impl Collector {
    /// A collector for ensembles that these axes distinguish.
    pub fn new(axes: &[usize], figures: usize) -> Self {
        Self { axes: axes.to_vec(), figures, found: Vec::new() }
    }

    /// Takes a case: its position on all axes, and those figures that it has.
    pub fn take(&mut self, at: &[usize], values: &[Option<f64>]) {
        let key: Vec<usize> = self.axes.iter().filter_map(|&axis| at.get(axis).copied()).collect();
        let index = self.found.iter().position(|(known, ..)| *known == key).unwrap_or_else(|| {
            self.found.push((key, 0, vec![Vec::new(); self.figures]));
            self.found.len() - 1
        });
        let Some((_, cases, lists)) = self.found.get_mut(index) else { return };
        *cases += 1;
        lists.iter_mut().zip(values).for_each(|(list, value)| list.extend(value));
    }

    /// Ensembles that were collected.
    pub fn finish(self) -> Vec<Ensemble> {
        let spreads = |lists: Vec<Vec<f64>>| lists.iter().map(|list| Spread::of(list)).collect();
        self.found.into_iter().map(|(at, cases, lists)| Ensemble { at, cases, spreads: spreads(lists) }).collect()
    }
}

impl Results {
    /// A row a figure and ensemble: values of the axes named, and the distribution.
    fn ensemble_rows(&self, name: impl Fn(&str) -> String, text: impl Fn(f64) -> String) -> Rows {
        let named = || self.study.ensemble.iter().flatten();
        let labels = named().filter_map(|&axis| self.study.axes.get(axis)).map(|axis| axis.label().to_owned());
        let rest = ["figure", "unit", "cases", "with it", "median", "95 %", "largest", "mean", "low", "high"];
        let heads = labels.chain(rest.map(str::to_owned)).collect();
        let mut rows = Vec::new();
        for ensemble in &self.ensembles {
            for (figure, spread) in self.figures.iter().zip(&ensemble.spreads) {
                let axes =
                    named().zip(&ensemble.at).filter_map(|(&axis, &rank)| Some((self.study.axes.get(axis)?, rank)));
                let mut row: Vec<String> = axes.map(|(axis, rank)| axis.words_of(rank)).collect();
                row.extend([name(&figure.name), figure.unit.clone(), ensemble.cases.to_string()]);
                let Some(spread) = spread else {
                    row.extend(["0", "", "", "", "", "", ""].map(str::to_owned));
                    rows.push(row);
                    continue;
                };
                let (low, high) = spread.estimate.interval.unzip();
                let numbers = [
                    Some(spread.median),
                    Some(spread.p95),
                    Some(spread.largest),
                    Some(spread.estimate.mean),
                    low,
                    high,
                ];
                row.push(spread.estimate.count.to_string());
                row.extend(numbers.map(|value| value.map_or_else(String::new, &text)));
                rows.push(row);
            }
        }
        (heads, rows)
    }

    /// The ensembles for a report; none where the study asks for none.
    pub fn ensembles_in_short(&self) -> Option<Rows> {
        self.study.ensemble.as_ref().map(|_| self.ensemble_rows(words::without_unit, short))
    }

    /// The ensembles as CSV; none where the study asks for none.
    ///
    /// # Errors
    /// None that a study can cause.
    pub fn ensemble_table(&self) -> Result<Option<Vec<u8>>, StudyError> {
        if self.study.ensemble.is_none() {
            return Ok(None);
        }
        let bug = |e: csv::Error| StudyError::Bug(e.to_string());
        let (heads, rows) = self.ensemble_rows(str::to_owned, |value| value.to_string());
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(&heads).map_err(bug)?;
        for row in &rows {
            table.write_record(row).map_err(bug)?;
        }
        table.into_inner().map(Some).map_err(|e| StudyError::Bug(e.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_come_together_by_the_named_axes_and_missing_figures_are_not_zero() {
        let mut collector = Collector::new(&[1], 2);
        for (at, values) in [
            ([0, 0], [Some(1.0), None]),
            ([1, 0], [Some(3.0), Some(7.0)]),
            ([2, 0], [Some(2.0), None]),
            ([0, 1], [None, None]),
        ] {
            collector.take(&at, &values);
        }
        let found = collector.finish();
        assert_eq!(found.iter().map(|e| (e.at.clone(), e.cases)).collect::<Vec<_>>(), [(vec![0], 3), (vec![1], 1)]);
        let spread = found[0].spreads[0].as_ref().unwrap();
        assert_eq!((spread.estimate.count, spread.median, spread.largest, spread.estimate.mean), (3, 2.0, 3.0, 2.0));
        assert_eq!(found[0].spreads[1].as_ref().unwrap().estimate.count, 1);
        assert!(found[1].spreads[0].is_none());
    }
}
