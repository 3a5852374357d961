//! Verdict of a run: the list of all judgements, each passed, marginal or failed, with its margin.
//!
//! The rules fill in the figures and their limits, and [`super::limits`] fills in a user's limits.

use serde::Serialize;
use serde_json::Value;

use crate::judge::judgement::{Bound, Group, Judgement, MARGINAL_SHARE, Status};

/// Every figure of a run that is judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Every judgement, those of a user first.
    pub rows: Vec<Judgement>,
    /// Number of the first rows that hold a user's limits.
    pub of_user: usize,
    /// Figures that are not judged, each with the reason.
    pub not_judged: Vec<String>,
    /// Group of the next rows.
    group: Group,
}

impl Verdict {
    /// Number of judgements with a status.
    pub fn count(&self, status: Status) -> usize {
        self.rows.iter().filter(|row| row.status == status).count()
    }

    /// Groups in their order, each with how many of its figures passed, are marginal and failed.
    pub fn groups(&self) -> Vec<(Group, [usize; 3])> {
        let mut groups: Vec<Group> = self.rows.iter().map(|row| row.group).collect();
        groups.sort_unstable();
        groups.dedup();
        let of = |group: Group, status: Status| {
            self.rows.iter().filter(|row| row.group == group && row.status == status).count()
        };
        let counts = |group| [Status::Pass, Status::Marginal, Status::Fail].map(|status| of(group, status));
        groups.into_iter().map(|group| (group, counts(group))).collect()
    }

    /// Sets the group of the rows that follow.
    pub(super) fn about(&mut self, group: Group) -> &mut Self {
        self.group = group;
        self
    }

    /// The worst status.
    pub fn status(&self) -> Status {
        self.rows.iter().map(|row| row.status).max().unwrap_or(Status::Pass)
    }

    /// Counts of the judgements in words.
    pub fn in_words(&self) -> String {
        let [pass, marginal, fail] = [Status::Pass, Status::Marginal, Status::Fail].map(|status| self.count(status));
        format!("{pass} passed, {marginal} marginal, {fail} failed")
    }

    /// The user's limits that are broken.
    pub fn broken(&self) -> impl Iterator<Item = &Judgement> {
        self.rows.iter().take(self.of_user).filter(|row| row.status == Status::Fail)
    }

    /// Puts a user's judgements first; they replace what is otherwise judged of the same figures.
    pub fn with_user(mut self, rows: Vec<Judgement>) -> Self {
        self.rows.retain(|row| rows.iter().all(|user| user.path != row.path || row.path.is_none()));
        self.of_user = rows.len();
        self.rows.splice(0..0, rows);
        self
    }

    pub(super) fn judge(
        &mut self,
        figure: &str,
        path: &str,
        value: impl Into<Value>,
        unit: &str,
        bound: Bound,
        source: &str,
    ) {
        let row = Judgement::new(figure, value.into(), unit, bound, MARGINAL_SHARE, source);
        let row = Judgement { group: self.group_of(figure), ..row };
        self.rows.push(if path.is_empty() { row } else { row.at(path) });
    }

    /// Among errors of positions are those of clocks, and figures of what the receiver states of its errors.
    fn group_of(&self, figure: &str) -> Group {
        const STATED: [&str; 4] = ["sigma", "normalised", "formal", "dilutions and condition"];
        match self.group {
            Group::Position if STATED.iter().any(|word| figure.contains(word)) => Group::Sigmas,
            Group::Position if figure.starts_with("clock") => Group::Clock,
            group => group,
        }
    }

    /// Says what was taken out of the figure that was judged last.
    pub(super) fn without(&mut self, what: &str) {
        if let Some(row) = self.rows.last_mut() {
            what.clone_into(&mut row.without);
        }
    }

    /// Says what is behind the row that was judged last.
    pub(super) fn explain(&mut self, why: Vec<String>) {
        if let Some(row) = self.rows.last_mut() {
            row.why = why;
        }
    }

    /// Rows of `verdict.csv`: those that are judged, then what is not, with the reason in place of a limit's
    /// origin.
    pub(crate) fn csv_rows(&self) -> impl Iterator<Item = VerdictRow<'_>> {
        let judged = self.rows.iter().map(|row| VerdictRow {
            figure: &row.figure,
            path: row.path.as_deref().unwrap_or(""),
            value: row.value_text(),
            unit: &row.unit,
            limit: row.bound.to_string(),
            margin_share: row.margin,
            status: Outcome::Judged(row.status),
            source: &row.source,
            why: row.why.join("; "),
        });
        judged.chain(self.not_judged.iter().map(|text| {
            let (figure, source) = text.split_once(": ").unwrap_or((text, ""));
            let (path, value, unit, limit, why) = ("", String::new(), "", String::new(), String::new());
            VerdictRow { figure, path, value, unit, limit, margin_share: None, status: Outcome::NotJudged, source, why }
        }))
    }
}

/// `status` in `verdict.csv`.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Outcome {
    NotJudged,
    #[serde(untagged)]
    Judged(Status),
}

/// One row of `verdict.csv`.
#[derive(Serialize)]
pub(crate) struct VerdictRow<'a> {
    figure: &'a str,
    path: &'a str,
    value: String,
    unit: &'a str,
    limit: String,
    margin_share: Option<f64>,
    status: Outcome,
    source: &'a str,
    why: String,
}
