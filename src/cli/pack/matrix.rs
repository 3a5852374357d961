//! The matrix of a pack: one row an entry, as a table, a page for a browser, pages for paper and text.
//!
//! All forms follow from the same rows. No time of the machine is in them, so that two runs of one pack give
//! the same bytes.

use std::path::Path;

use serde_json::{Value, json};

use super::args::Level;
use super::manifest::{Entry, Expectation, NotSaid, Pack};
use super::record::{Figure, Record, Verdict};
use super::{groups, junit};
use crate::cli::error::CliError;
use crate::cli::staging::Staging;
use analysis::show::document::{Cell, Item, Report, Side, Table, Tone};

/// One entry of the matrix.
pub struct Row<'p> {
    pub entry: &'p Entry,
    pub record: Record,
    /// Failed figures that nothing excuses, and those that the pack excuses with its reason.
    pub broken: Vec<Figure>,
    pub excused: Vec<(Figure, &'p str)>,
}

/// The matrix of a pack, or of a part of it.
pub struct Matrix<'p> {
    pub pack: &'p Pack,
    pub rows: Vec<Row<'p>>,
    pub level: Level,
    /// Patterns that chose the entries, where not all ran.
    pub part: Option<&'p [String]>,
}

/// Condition of a row that a chapter lists.
type Holds = fn(&Row<'_>) -> bool;

impl<'p> Row<'p> {
    /// Holds a record against the expectation of its entry.
    pub fn new(entry: &'p Entry, record: Record) -> Self {
        let (mut broken, mut excused) = (Vec::new(), Vec::new());
        for figure in &record.failed {
            match entry.expectation.excuse(&figure.figure, &figure.path) {
                Some(reason) => excused.push((figure.clone(), reason)),
                None => broken.push(figure.clone()),
            }
        }
        Self { entry, record, broken, excused }
    }

    /// True if the entry ended as the pack expects; `None` where nothing ran.
    pub fn is_expected(&self) -> Option<bool> {
        let is_failed = self.record.verdict == Verdict::Fail;
        match (&self.entry.expectation, self.record.verdict) {
            (_, Verdict::NotModelled) => None,
            (Expectation::Fail(_), _) => Some(is_failed),
            (Expectation::Any(_), _) => Some(true),
            (Expectation::Pass(_), _) => Some(self.broken.is_empty()),
        }
    }

    /// Reason of a row that is not plain: a figure that failed, a verdict that did not, a level without
    /// model.
    pub fn why(&self) -> String {
        let figures = |figures: &[Figure]| figures.iter().map(Figure::in_words).collect::<Vec<_>>().join("; ");
        match (&self.entry.expectation, self.is_expected()) {
            (_, None) => self.record.reason.clone(),
            (Expectation::Fail(reason), Some(false)) => format!("no figure failed: {reason}"),
            (_, Some(false)) => figures(&self.broken),
            (_, Some(true)) => {
                let one = |(figure, reason): &(Figure, &str)| format!("{}: {reason}", figure.in_words());
                self.excused.iter().map(one).collect::<Vec<_>>().join("; ")
            }
        }
    }

    fn verdict(&self) -> &'static str {
        match self.record.verdict {
            Verdict::Pass => "pass",
            Verdict::Marginal => "marginal",
            Verdict::Fail => "fail",
            Verdict::NotModelled => "not modelled",
        }
    }

    fn expected(&self) -> &'static str {
        match self.is_expected() {
            Some(true) => "yes",
            Some(false) => "no",
            None => "",
        }
    }

    fn tone(&self) -> Tone {
        match (self.is_expected(), self.record.verdict) {
            (None, _) => Tone::Faint,
            (Some(false), _) => Tone::Bad,
            (Some(true), Verdict::Pass) => Tone::Good,
            (Some(true), _) => Tone::Caution,
        }
    }
}

impl Matrix<'_> {
    /// Number of entries that did not end as expected.
    pub fn unexpected(&self) -> usize {
        self.rows.iter().filter(|row| row.is_expected() == Some(false)).count()
    }

    /// Number of entries of which the level has no model.
    pub fn not_modelled(&self) -> usize {
        self.rows.iter().filter(|row| row.is_expected().is_none()).count()
    }

    /// Tests of the source that no scene says; none where only a part ran.
    pub fn not_said(&self) -> &[NotSaid] {
        if self.part.is_some() { &[] } else { &self.pack.not_said }
    }

    /// Writes `matrix.csv`, `matrix.html`, `matrix.pdf` and `junit.xml`.
    ///
    /// # Errors
    /// A file that cannot be made or written.
    pub fn write(&self, out: &Path) -> Result<(), CliError> {
        let write = |name: &str, bytes: &[u8]| {
            let staging = Staging::file(&out.join(name))?;
            staging.write(bytes)?;
            staging.commit()
        };
        write("matrix.csv", &self.csv()?)?;
        write("junit.xml", junit::xml(self).as_bytes())?;
        let report = self.report();
        write("matrix.html", report.html().as_bytes())?;
        #[cfg(feature = "pdf")]
        write("matrix.pdf", &report.pdf().map_err(CliError::bug)?)?;
        Ok(())
    }

    fn csv(&self) -> Result<Vec<u8>, CliError> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let columns = "group,entry,verdict,expected,horizontal_p95_m,fixes_percent,first_fix_s,worst_figure,\
                       worst_value,worst_unit,worst_limit,passed,marginal,failed,reason";
        table.write_record(columns.split(',')).map_err(CliError::bug)?;
        for row in &self.rows {
            let record = &row.record;
            let text = |text: &Option<String>| text.clone().unwrap_or_default();
            let worst = |of: fn(&Figure) -> &String| record.worst.as_ref().map_or_else(String::new, |w| of(w).clone());
            let cells = [
                row.entry.group.clone(),
                row.entry.name.clone(),
                row.verdict().to_owned(),
                row.expected().to_owned(),
                text(&record.horizontal_p95_m),
                text(&record.fixes_percent),
                text(&record.first_fix_s),
                worst(|figure| &figure.figure),
                worst(|figure| &figure.value),
                worst(|figure| &figure.unit),
                worst(|figure| &figure.limit),
                record.passed.to_string(),
                record.marginal.to_string(),
                record.failed.len().to_string(),
                row.why(),
            ];
            table.write_record(cells).map_err(CliError::bug)?;
        }
        for test in self.not_said() {
            let blank = [""; 11];
            let cells = [test.group.as_str(), &test.name, "not said"].into_iter().chain(blank).chain([&*test.reason]);
            table.write_record(cells).map_err(CliError::bug)?;
        }
        table.into_inner().map_err(CliError::bug)
    }

    /// The matrix in one line: how many entries ended as expected, and what did not run.
    pub fn in_short(&self) -> String {
        let (all, unexpected, not_modelled) = (self.rows.len(), self.unexpected(), self.not_modelled());
        let mut text = format!("{} of {all} entries as expected", all - unexpected - not_modelled);
        if not_modelled > 0 {
            text += &format!(", {not_modelled} without a model at level {}", self.level.name());
        }
        match (self.part, self.not_said().len()) {
            (Some(part), _) => text += &format!("; part of the pack: --only {}", part.join(" ")),
            (None, 0) => {}
            (None, 1) => text += "; 1 test of the source is not said",
            (None, many) => text += &format!("; {many} tests of the source are not said"),
        }
        text
    }

    /// The matrix for a terminal.
    pub fn in_words(&self) -> String {
        let width = self.rows.iter().map(|row| row.entry.name.chars().count()).max().unwrap_or(0).max("entry".len());
        let mut text = format!("{} · {}\n", self.pack.title, self.in_short());
        text += &format!(
            "\n{:<width$}  {:<12}  {:<8}  {:>8}  {:>6}  {:>7}  {}\n",
            "entry", "verdict", "expected", "95 % (m)", "fixes", "first", "worst figure"
        );
        for row in &self.rows {
            let record = &row.record;
            let number = |text: &Option<String>| text.clone().unwrap_or_else(|| "–".to_owned());
            let share = record.fixes_percent.as_ref().map_or_else(|| "–".to_owned(), |share| format!("{share}%"));
            let first = record.first_fix_s.as_ref().map_or_else(|| "–".to_owned(), |first| format!("{first} s"));
            let worst = record.worst.as_ref().map_or_else(|| record.reason.clone(), Figure::in_words);
            let line = format!(
                "{:<width$}  {:<12}  {:<8}  {:>8}  {share:>6}  {first:>7}  {worst}",
                row.entry.name,
                row.verdict(),
                row.expected(),
                number(&record.horizontal_p95_m),
            );
            text += &format!("{line}\n");
        }
        text
    }

    /// The matrix as an object, for `--json`.
    pub fn object(&self) -> Value {
        let row = |row: &Row<'_>| {
            json!({
                "group": row.entry.group, "entry": row.entry.name, "verdict": row.verdict(),
                "expected": row.is_expected(), "horizontal_p95_m": row.record.horizontal_p95_m,
                "fixes_percent": row.record.fixes_percent, "first_fix_s": row.record.first_fix_s,
                "worst": row.record.worst, "failed": row.record.failed, "reason": row.why(),
            })
        };
        json!({
            "entries": self.rows.iter().map(row).collect::<Vec<_>>(),
            "not_said": self.not_said().len(), "unexpected": self.unexpected(),
        })
    }

    fn report(&self) -> Report {
        let pack = self.pack;
        let mut report = Report::new(&pack.title, pack.about.as_deref().unwrap_or_default(), &pack.name);
        let tone = if self.unexpected() > 0 { Tone::Bad } else { Tone::Good };
        report.add(Item::Banner(self.in_short(), tone));
        let mut facts = vec![
            ("source".to_owned(), pack.source.clone()),
            ("licence".to_owned(), pack.licence.clone()),
            ("level".to_owned(), self.level.name().to_owned()),
            ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ];
        facts.extend(pack.like.iter().map(|like| ("like".to_owned(), like.clone())));
        report.add(Item::Facts(facts));
        report.text(
            "95 %: horizontal error that 95 % of the fixes stay below. Fixes: share of the epochs from the first fix \
             to the end that have one. Worst: figure of the verdict with the least margin to its limit, of the failed \
             ones if there are any. Every figure is in entries/NAME/verdict.csv.",
        );
        report.heading("Matrix");
        for group in groups(self.rows.iter().map(|row| row.entry.group.as_str())) {
            report.table(self.table(group));
        }
        self.reasons(&mut report);
        report
    }

    fn table(&self, group: &str) -> Table {
        let columns = [
            ("entry", Side::Left),
            ("verdict", Side::Left),
            ("expected", Side::Left),
            ("95 % (m)", Side::Right),
            ("fixes (%)", Side::Right),
            ("first fix (s)", Side::Right),
            ("worst figure", Side::Left),
        ];
        let mut table = Table::new(group, columns);
        for row in self.rows.iter().filter(|row| row.entry.group == group) {
            let record = &row.record;
            let number = |text: &Option<String>| Cell::from(text.clone().unwrap_or_else(|| "–".to_owned()));
            let worst = record.worst.as_ref().map_or_else(|| record.reason.clone(), Figure::in_words);
            table.row([
                Cell::from(row.entry.name.clone()),
                Cell::toned(row.verdict(), row.tone()),
                Cell::toned(row.expected(), row.tone()),
                number(&record.horizontal_p95_m),
                number(&record.fixes_percent),
                number(&record.first_fix_s),
                Cell::from(worst),
            ]);
        }
        table
    }

    /// Chapters of what is not as expected, what is excused, what did not run, and what each entry is.
    fn reasons(&self, report: &mut Report) {
        let columns = || [("entry", Side::Left), ("description", Side::Left), ("reason", Side::Left)];
        let chapters: [(&str, &str, Holds); 3] = [
            ("Not as expected", "Entries that did not end as the pack expects", |row| row.is_expected() == Some(false)),
            ("Excused", "Failed figures that the pack excuses", |row| {
                row.is_expected() == Some(true) && !row.excused.is_empty()
            }),
            ("Without a model", "Entries of which the level has no model", |row| row.is_expected().is_none()),
        ];
        for (title, caption, holds) in chapters {
            let mut table = Table::new(caption, columns());
            for row in self.rows.iter().filter(|row| holds(row)) {
                table.row([row.entry.name.clone(), row.entry.description.clone(), row.why()]);
            }
            if !table.rows.is_empty() {
                report.heading(title).table(table);
            }
        }
        if !self.not_said().is_empty() {
            let mut table = Table::new("Tests of the source that no scene says", columns());
            for test in self.not_said() {
                table.row([test.name.clone(), format!("{}: {}", test.group, test.description), test.reason.clone()]);
            }
            report.heading("Not said").table(table);
        }
        let mut table = Table::new("Entries", [("entry", Side::Left), ("description", Side::Left)]);
        self.rows.iter().for_each(|row| table.row([row.entry.name.clone(), row.entry.description.clone()]));
        report.heading("Entries").table(table);
    }
}
