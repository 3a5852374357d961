//! The first page's banner, figures and reasons, on verdicts made by hand.

use serde_json::json;

use super::*;
use crate::judge::judgement::{Bound, MARGINAL_SHARE};

fn row(figure: &str, path: &str, value: impl Into<Value>, unit: &str, limit: f64) -> Judgement {
    let row = Judgement::new(figure, value.into(), unit, Bound::Max(limit), MARGINAL_SHARE, "theory");
    Judgement { path: Some(path.to_owned()).filter(|path| !path.is_empty()), ..row }
}

fn verdict(rows: Vec<Judgement>) -> Verdict {
    Verdict::default().with_user(rows)
}

/// Cells of the only table, its titles first, and the text of the notes.
fn told(report: &Report) -> (Vec<Vec<String>>, String) {
    let (mut lines, mut notes) = (Vec::new(), String::new());
    for item in &report.items {
        match item {
            Item::Table(table) => {
                lines.push(table.columns.iter().map(|(title, _)| title.clone()).collect());
                lines.extend(table.rows.iter().map(|cells| cells.iter().map(|cell| cell.text.clone()).collect()));
            }
            Item::Note(text) | Item::Subheading(text) => notes += text,
            _ => {}
        }
    }
    (lines, notes)
}

fn shown_figures(rows: Vec<Judgement>, summary: &Value) -> (Vec<Vec<String>>, String) {
    let mut report = Report::new("", "", "");
    figures(&mut report, &verdict(rows), summary, &FIGURES, &schema::SUMMARY);
    told(&report)
}

#[test]
fn a_figure_is_what_was_measured_and_what_is_judged_of_it_stands_beside_it() {
    // The spoofed scene: fixes go with the spoofer, and only those before it are judged.
    let summary = json!({
        "position": {
            "first_fix_s": 31.5, "horizontal_p95_m": 173.02, "vertical_p95_m": 1.25, "velocity_p95_mps": null
        },
        "tracking": { "cycle_slips": 3 },
    });
    let mut horizontal = row("horizontal error, 95 %", "position.horizontal_p95_m", 0.2502, "m", 0.7);
    horizontal.without = "40 of 47 fixes, whose errors may have any size".to_owned();
    let mut slips = row("unexpected cycle slips", "tracking.cycle_slips", 0, "", 0.0);
    slips.without = "3 with a reason: fade".to_owned();
    let rows = vec![horizontal, row("vertical error, 95 %", "position.vertical_p95_m", 1.25, "m", 2.0), slips];
    let (lines, notes) = shown_figures(rows.clone(), &summary);
    let expected = [
        ["figure", "measured", "judged", "limit", "verdict"],
        ["time to first fix", "31.5 s", "–", "–", "not judged"],
        ["horizontal error, 95 %", "173 m", "0.2502 m", "≤ 0.7 m", "pass"],
        ["vertical error, 95 %", "1.25 m", "1.25 m", "≤ 2 m", "pass"],
        ["velocity error, 95 %", "none", "–", "–", "not judged"],
        ["epochs without a fix", "–", "–", "–", "not judged"],
        ["cycle slips", "3", "0", "≤ 0", "pass"],
    ];
    assert_eq!(lines, expected);
    assert!(notes.contains("horizontal error, 95 % without 40 of 47 fixes") && notes.contains("slips without 3 with"));
    assert!(!notes.contains("vertical"), "{notes}");
    // Nothing is taken out: one column says it.
    let summary = json!({ "position": { "vertical_p95_m": 1.25 } });
    let (lines, notes) = shown_figures(vec![rows[1].clone()], &summary);
    assert_eq!(lines[3], ["vertical error, 95 %", "1.25 m", "≤ 2 m", "pass"]);
    assert_eq!((lines[0].len(), notes.as_str()), (4, ""));
}

#[test]
fn of_several_parts_of_a_run_the_worst_is_shown_under_its_name() {
    let parts = vec![
        row("epochs without a fix, 0 to 50 s", "", 0, "%", 2.0),
        row("epochs without a fix, 50 to 60 s", "", 40, "%", 2.0),
        row("epochs without a fix that its own observations allow", "", 90, "%", 2.0),
    ];
    let (lines, _) = shown_figures(parts, &json!({}));
    assert_eq!(lines[5], ["epochs without a fix, 50 to 60 s", "40 %", "≤ 2 %", "FAIL"]);
    // A limit of the user's file has the path alone.
    let (lines, _) =
        shown_figures(vec![row("position.first_fix_s", "position.first_fix_s", 31.5, "s", 40.0)], &json!({}));
    assert_eq!(lines[1], ["time to first fix", "31.5 s", "≤ 40 s", "pass"]);
}

#[test]
fn marginal_figures_stand_below_failed_ones_with_what_is_left() {
    let mut late = row("time to first fix", "", 50.0, "s", 40.0);
    late.why = vec!["none before 50 s".to_owned()];
    let rows = vec![row("code bias", "", 0.95, "m", 1.0), row("clock", "", 0.1, "m", 1.0), late];
    let mut report = Report::new("", "", "");
    failures(&mut report, &verdict(rows.clone()));
    let (lines, heading) = told(&report);
    assert_eq!(heading, "What failed or is marginal, and why");
    assert_eq!(lines[1], ["time to first fix", "50 s", "≤ 40 s", "failed", "25 % beyond; none before 50 s"]);
    assert_eq!(lines[2], ["code bias", "0.95 m", "≤ 1 m", "marginal", "5 % left; theory"]);
    assert_eq!(lines.len(), 3);
    let mut report = Report::new("", "", "");
    failures(&mut report, &verdict(vec![rows[1].clone()]));
    assert!(report.items.is_empty());
}

#[test]
fn the_banner_counts_what_was_judged_and_is_not_green_without_a_position() {
    let of = |rows: Vec<Judgement>, lacking: Option<&str>| {
        let mut report = Report::new("", "", "");
        banner(&mut report, &verdict(rows), lacking);
        match report.items.pop() {
            Some(Item::Banner(words, tone)) => (words, tone),
            other => panic!("{other:?}"),
        }
    };
    let [good, near, bad] = [0.1, 0.95, 2.0].map(|value| row("x", "", value, "m", 1.0));
    assert_eq!(of(vec![good.clone(); 2], None), ("Passed: 2 of 2 judged figures".to_owned(), Tone::Good));
    let lacking = Some("no fix in 10 s, position not judged");
    let (words, tone) = of(vec![good.clone(); 43], lacking);
    assert_eq!(words, "Passed: 43 of 43 judged figures; no fix in 10 s, position not judged");
    assert_ne!(tone, Tone::Good);
    let (words, tone) = of(vec![good.clone(), near.clone()], None);
    assert_eq!(
        (words.as_str(), tone),
        ("Passed, in part marginally: 2 of 2 judged figures, 1 marginal", Tone::Caution)
    );
    let (words, tone) = of(vec![good, near, bad], lacking);
    assert!(words.starts_with("Failed: 1 of 3 judged figures, and 1 marginal; no fix"), "{words}");
    assert_eq!(tone, Tone::Bad);
}
