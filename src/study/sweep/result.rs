//! The whole table of a study, and what its repetitions say cell by cell.
//!
//! [`merge`] takes each shard once, in order, and fails if one is missing. [`Results`] is what pictures and
//! reports are made from: axes, figures, and an estimate for each figure of each cell.

use super::ensemble::{Collector, Ensemble};
use super::estimate::Estimate;
use super::model::SNR;
use super::plan::{Column, Plan};
use super::shard::{self, Found};
use super::spec::Study;
use super::{StudyError, axis, unit_of};
use crate::proof::LEAST_SNR;

/// Figures of theory have this before the name of the figure that they predict.
pub const THEORY: &str = "theory.";

/// Every line of data, case by case.
///
/// # Errors
/// [`StudyError::Incomplete`] with what is missing, files that cannot be read.
pub fn merge(plan: &Plan) -> Result<Vec<String>, StudyError> {
    let (mut lines, mut missing) = (Vec::new(), Vec::new());
    for number in 0..plan.shards() {
        match shard::find(plan, number)? {
            Found::Whole(rows) if missing.is_empty() => lines.extend(rows),
            Found::Whole(_) => {}
            Found::Nothing | Found::Bad(_) => missing.push(number),
        }
    }
    if !missing.is_empty() {
        let list = shard::ranges(&missing);
        return Err(StudyError::Incomplete { missing: missing.len(), shards: plan.shards(), list });
    }
    if lines.len() as u64 != plan.manifest.n_cases {
        return Err(StudyError::Bug(format!("{} rows of {} cases", lines.len(), plan.manifest.n_cases)));
    }
    Ok(lines)
}

/// The merged table as CSV.
pub fn table(plan: &Plan, lines: &[String]) -> Vec<u8> {
    let mut text = shard::columns(plan) + "\n";
    for line in lines {
        text += line;
        text.push('\n');
    }
    text.into_bytes()
}

/// A study's outcome.
#[derive(Clone, Debug)]
pub struct Results {
    /// The study.
    pub study: Study,
    /// Kept figures with their units, in the order of [`Cell::estimates`].
    pub figures: Vec<Column>,
    /// Slowest axis first.
    pub cells: Vec<Cell>,
    /// All cases together, by the axes of [`Study::ensemble`]; empty where the study asks for none.
    pub ensembles: Vec<Ensemble>,
}

/// All repetitions of one combination of the axes' values.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Index of the value on each axis.
    pub at: Vec<usize>,
    /// Estimate of each figure; `None` where no case gave one.
    pub estimates: Vec<Option<Estimate>>,
}

impl Results {
    /// Condenses the lines of [`merge`].
    ///
    /// # Errors
    /// A line that is not as this plan writes it.
    pub fn new(plan: &Plan, lines: &[String]) -> Result<Self, StudyError> {
        let study = plan.study.clone();
        let (grid, skipped) = (&study.grid, 3 + study.axes.len());
        let mut values: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); study.keep.len()]; grid.cells() as usize];
        let mut together = study.ensemble.as_ref().map(|axes| Collector::new(axes, study.keep.len()));
        let text = lines.join("\n");
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
        for (case, record) in (0_u64..).zip(reader.records()) {
            let record = record.map_err(|e| StudyError::input(&plan.directory, e.to_string()))?;
            let Some(cell) = values.get_mut(grid.cell_of(case) as usize) else { continue };
            let number = |field: &str| {
                let wrong = || StudyError::input(&plan.directory, format!("case {case}: {field:?} is no number"));
                if field.is_empty() { Ok(None) } else { field.parse::<f64>().map(Some).map_err(|_| wrong()) }
            };
            let row: Vec<Option<f64>> = record.iter().skip(skipped).map(number).collect::<Result<_, _>>()?;
            cell.iter_mut().zip(&row).for_each(|(list, value)| list.extend(value));
            if let Some(together) = &mut together {
                together.take(&grid.case(case).at, &row);
            }
        }
        let figure = |name: &String| Column { name: name.clone(), unit: unit_of(name).to_owned() };
        let figures = study.keep.iter().map(figure).collect();
        let cells = (0_u64..)
            .zip(values)
            .map(|(cell, lists)| Cell {
                at: grid.case(grid.first_of(cell)).at,
                estimates: lists.iter().map(|list| Estimate::of(list)).collect(),
            })
            .collect();
        let ensembles = together.map(Collector::finish).unwrap_or_default();
        Ok(Self { study, figures, cells, ensembles })
    }

    /// The number of a figure.
    pub fn figure(&self, name: &str) -> Option<usize> {
        self.figures.iter().position(|figure| figure.name == name)
    }

    /// The number of an axis.
    pub fn axis(&self, key: &str) -> Option<usize> {
        self.study.axes.iter().position(|axis| axis.key == key)
    }

    /// The text of a cell's value on an axis.
    pub fn value_text(&self, cell: &Cell, axis: usize) -> String {
        self.value(cell, axis).map_or_else(String::new, axis::text_of)
    }

    /// Label of a cell's value on an axis, for plots and reports.
    pub fn words(&self, cell: &Cell, axis: usize) -> String {
        let rank = cell.at.get(axis).copied();
        rank.zip(self.study.axes.get(axis)).map_or_else(String::new, |(rank, axis)| axis.words_of(rank))
    }

    /// A cell's value on an axis.
    pub fn value(&self, cell: &Cell, axis: usize) -> Option<&toml::Value> {
        self.study.axes.get(axis)?.values.get(*cell.at.get(axis)?)
    }

    /// Cells as CSV: values, and mean with the ends of its 95 % interval; a figure of theory has no interval.
    pub fn table(&self) -> Result<Vec<u8>, StudyError> {
        let bug = |e: csv::Error| StudyError::Bug(e.to_string());
        let mut table = csv::Writer::from_writer(Vec::new());
        let mut header: Vec<String> = self.study.axes.iter().map(|axis| axis.key.clone()).collect();
        for figure in &self.figures {
            header.push(figure.name.clone());
            if !figure.name.starts_with(THEORY) {
                header.extend(["low", "high", "count"].map(|end| format!("{}.{end}", figure.name)));
            }
        }
        table.write_record(&header).map_err(bug)?;
        for cell in &self.cells {
            let mut row: Vec<String> = (0..self.study.axes.len()).map(|axis| self.value_text(cell, axis)).collect();
            for (figure, estimate) in self.figures.iter().zip(&cell.estimates) {
                let interval = estimate.and_then(|estimate| estimate.interval);
                let text = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
                row.push(text(estimate.map(|estimate| estimate.mean)));
                if !figure.name.starts_with(THEORY) {
                    row.push(text(interval.map(|(low, _)| low)));
                    row.push(text(interval.map(|(_, high)| high)));
                    row.push(estimate.map_or(0, |estimate| estimate.count).to_string());
                }
            }
            table.write_record(&row).map_err(bug)?;
        }
        table.into_inner().map_err(|e| StudyError::Bug(e.to_string()))
    }

    /// Agreement of measurement and theory for each figure that theory predicts in some cell.
    pub fn agreement(&self) -> Vec<Agreement> {
        let snr = self.figure(SNR);
        let pair = |(number, figure): (usize, &Column)| {
            let theory = self.figure(&format!("{THEORY}{}", figure.name))?;
            let cells = self.cells.iter().enumerate().filter_map(|(index, cell)| {
                let (found, expected) = ((*cell.estimates.get(number)?)?, (*cell.estimates.get(theory)?)?);
                let ratio = found.mean / expected.mean;
                let half = found.relative_half().unwrap_or(0.0);
                let snr = snr.and_then(|snr| (*cell.estimates.get(snr)?).map(|estimate| estimate.mean));
                Some(Compared { cell: index, ratio, bar: BAR.max(half), snr })
            });
            Some(Agreement { figure: number, cells: cells.collect() }).filter(|agreement| !agreement.cells.is_empty())
        };
        self.figures.iter().enumerate().filter_map(pair).collect()
    }
}

/// Difference from theory that is allowed, where the measurement's own 95 % interval is not wider.
pub const BAR: f64 = 0.05;

/// A figure beside its theory.
#[derive(Clone, Debug)]
pub struct Agreement {
    /// Index of the figure.
    pub figure: usize,
    /// Every cell that has a theory.
    pub cells: Vec<Compared>,
}

/// One cell of it.
#[derive(Clone, Copy, Debug)]
pub struct Compared {
    /// Index of the cell.
    pub cell: usize,
    /// Measured over predicted.
    pub ratio: f64,
    /// Largest deviation that is allowed, relative.
    pub bar: f64,
    /// T·C/N0.
    pub snr: Option<f64>,
}

impl Compared {
    /// True if theory must hold here.
    pub fn in_region(&self) -> bool {
        self.snr.is_none_or(|snr| snr >= LEAST_SNR)
    }

    /// True if the ratio is one within its bar.
    pub fn holds(&self) -> bool {
        (self.ratio - 1.0).abs() <= self.bar
    }
}
