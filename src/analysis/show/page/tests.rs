//! Laws of the page, on a report whose words come from an enemy.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

use super::encode::escaped;
use super::{SCRIPT, STYLE, hash};
use crate::show::document::{Cell, Item, Report, Side, Table, Tone};
use crate::show::plot::canvas::{Axis, BLUE, Chart, Mark, Series, WIDTH_PX};
use crate::show::plot::sketch::{Figure, Sketch};

const ENEMY: &str = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&\"'";

fn figure(points: Vec<(f64, f64)>) -> Figure {
    let series = vec![Series::new(ENEMY, BLUE, Mark::Line, points)];
    let axis = |label: &str, to| Axis::new(label, (0.0, to));
    let chart = Chart::new(ENEMY, axis("time (s)", 10.0), axis(ENEMY, 1.0), series.clone());
    Figure::new("waves", Sketch::charts((WIDTH_PX, 300), 1, [chart], series), ENEMY).unwrap()
}

fn hostile() -> Report {
    let mut report = Report::new(ENEMY, ENEMY, ENEMY);
    report.add(Item::Banner(ENEMY.to_owned(), Tone::Bad)).add(Item::Facts(vec![(ENEMY.to_owned(), ENEMY.to_owned())]));
    let mut table = Table::new(ENEMY, [(ENEMY, Side::Left)]);
    table.row([Cell::toned(ENEMY, Tone::Bad)]);
    table.groups.push(ENEMY.to_owned());
    report.table(table);
    report.heading("Figures").figure(figure((0..100).map(|n| (f64::from(n) / 10.0, 0.5)).collect()));
    report.heading(ENEMY).text(ENEMY).subheading(ENEMY).add(Item::Note(ENEMY.to_owned()));
    report.add(Item::Listing(ENEMY.to_owned()));
    report
}

#[test]
fn nothing_from_a_file_is_markup_or_script() {
    let page = hostile().html();
    // Without the page's own script and style, no character of markup is left but the program's own.
    let own = page.replace(SCRIPT, "").replace(STYLE, "");
    assert_eq!(own.matches("<script").count(), 2);
    assert!(!own.contains("<img") && !own.contains("alert(1)</") && !own.contains("<script>alert"));
    for tag in own.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').unwrap();
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        // Outside quotes are names of elements and attributes.
        assert!(tag.split('"').step_by(2).all(|names| !names.contains("onerror") && !names.contains("src")), "{tag}");
    }
    assert_eq!(escaped(ENEMY).matches(['<', '>', '"', '\'']).count(), 0);
    assert_eq!(escaped("a\u{0}b\u{1b}\n"), "a\u{fffd}b\u{fffd}\n");
}

#[test]
fn the_policy_names_the_script_and_the_style_of_the_page_and_nothing_else() {
    let page = hostile().html();
    let (_, policy) = page.split_once("Content-Security-Policy\" content=\"").unwrap();
    let (policy, _) = policy.split_once('"').unwrap();
    let expected = format!(
        "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; base-uri 'none'; form-action 'none'",
        hash(SCRIPT),
        hash(STYLE)
    );
    assert_eq!(policy, expected);
    // `printf abc | openssl dgst -sha256 -binary | base64`.
    assert_eq!(hash("abc"), "ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=");
    for forbidden in ["http://", "https://", "fetch(", "XMLHttpRequest", "eval(", "innerHTML", "style=", "onclick="] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn the_same_report_gives_the_same_page_with_the_figures_points_in_it() {
    let page = hostile().html();
    assert_eq!(page, hostile().html());
    let (_, json) = page.split_once("id=\"data\">").unwrap();
    let (json, _) = json.split_once("</script>").unwrap();
    let data: Value = serde_json::from_str(json).unwrap();
    let chart = &data["figures"][0]["charts"][0];
    assert_eq!(chart["title"], ENEMY);
    let series = &chart["series"][0];
    let array = |key: &str| &data["arrays"][series[key].as_u64().unwrap() as usize];
    // 100 floats of four bytes, and 100 equal values as integers of two.
    assert_eq!(array("x")["f"].as_str().unwrap().len(), 400_usize.div_ceil(3) * 4);
    assert_eq!(array("y")["q"].as_str().unwrap().len(), 200_usize.div_ceil(3) * 4);
    assert_eq!((array("y")["low"].as_f64(), array("y")["step"].as_f64()), (Some(0.5), Some(0.0)));
}

#[test]
fn values_far_beyond_their_axis_keep_the_axis_resolution() {
    // A step of 1e6/65535 = 15 would hide all of an axis from 0 to 1: floats are taken.
    let far = figure(vec![(0.0, 0.25), (1.0, 1e6), (2.0, 0.5)]);
    let mut report = Report::new("far", "", "");
    report.heading("Figures").figure(far);
    let page = report.html();
    assert!(
        page.contains(&STANDARD.encode([0.25_f32, 1e6, 0.5].iter().flat_map(|y| y.to_le_bytes()).collect::<Vec<_>>()))
    );
}
