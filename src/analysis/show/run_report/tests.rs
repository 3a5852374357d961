//! The report of a run made by hand.

use std::fs;

use crate::hand_made::planted;
use crate::hand_made::{PLANTED, Planted, write_estimate};
use crate::show::document::Forms;
use crate::{judge, judge_into};

#[test]
fn the_report_of_a_run_is_the_same_twice_and_has_its_fonts_and_pages() {
    let run = planted();
    fs::write(run.path().join("scenario.toml"), "name = \"planted\"\n").unwrap();
    let report = || {
        judge(run.path()).unwrap();
        fs::read(run.path().join("report.pdf")).unwrap()
    };
    let pdf = report();
    assert!(pdf.starts_with(b"%PDF-") && pdf == report());
    let count = |what: &[u8]| pdf.windows(what.len()).filter(|window| window == &what).count();
    assert!(count(b"/MediaBox") > 5 && count(b"/FontFile2") == 3);
    assert!(pdf.len() < 5_000_000, "{} bytes", pdf.len());
}

#[test]
fn a_form_that_is_not_asked_for_is_removed_unless_another_program_made_it() {
    let run = planted();
    let [pdf, html] = ["report.pdf", "report.html"].map(|name| run.path().join(name));
    let judged = |pdf: bool, html: bool| judge_into(run.path(), None, Forms { pdf, html }).map(drop).unwrap();
    judged(true, true);
    assert!(pdf.exists() && html.exists());
    judged(false, true);
    assert!(!pdf.exists() && html.exists());
    judged(true, false);
    assert!(pdf.exists() && !html.exists());
    fs::write(&html, "<p>notes of my own</p>").unwrap();
    judged(false, false);
    assert!(!pdf.exists() && html.exists());
}

#[test]
fn tables_without_rows_have_the_header_of_those_with_rows() {
    let header = |run: &std::path::Path, name: &str| {
        fs::read_to_string(run.join(name)).unwrap().lines().next().unwrap_or_default().to_owned()
    };
    let (full, bare) = (planted(), planted());
    write_estimate(bare.path(), &Planted { fixes: false, ..PLANTED });
    let none = planted();
    for (name, rows) in [("observations.csv", 1), ("fixes.csv", 1), ("tracking.csv", 1), ("events.csv", 1)] {
        let path = none.path().join("rx").join(name);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.lines().take(rows).map(|line| format!("{line}\n")).collect::<String>()).unwrap();
    }
    for run in [&full, &bare, &none] {
        judge_into(run.path(), None, Forms { pdf: false, html: false }).unwrap();
    }
    let tables = ["clock", "allan", "consistency", "position", "satellites", "elevation", "jitter", "errors", "slips"];
    for name in tables.map(|name| format!("{name}.csv")) {
        let expected = header(full.path(), &name);
        assert!(expected.contains(','), "{name}");
        for run in [&bare, &none] {
            assert_eq!(header(run.path(), &name), expected, "{name}");
        }
    }
}
