//! The report of a run made by hand.

use std::fs;

use crate::hand_made::planted;
use crate::judge;

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
