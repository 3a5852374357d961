//! The pictures of a run made by hand.

use std::fs;
use std::path::Path;

use super::*;
use crate::hand_made::{Draw, RATE_HZ, detected, oriented, planted, protected};
use crate::judge;
use crate::measure::psd::Psd;
use crate::read::PeakRow;
use crate::show::tables;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;

#[test]
fn every_picture_is_a_png_that_is_not_blank_and_its_numbers_are_in_a_table() {
    let run = planted();
    let mut psd = Psd::new(RATE_HZ as f64, false, 256);
    let mut draw = Draw(9);
    let mut block = || (0..20_000).map(|_| draw.normal() as f32).collect::<Vec<f32>>();
    psd.add(&block(), &block());
    tables::write_psd(&run.path().join("psd.csv"), &psd).unwrap();
    let signal = &L1_CA;
    let at = |number: u8, k: i32| PeakRow {
        sample: 0,
        sv: Sv { system: signal.system, number },
        signal,
        delay_chips: 0.1 * f64::from(k),
        in_phase: 1.0 - 0.1 * f64::from(k.abs()),
        quadrature: 0.0,
    };
    let peaks: Vec<PeakRow> = [3, 7].into_iter().flat_map(|sv| (-9..=9).map(move |k| at(sv, k))).collect();
    tables::write_peaks(&run.path().join("peaks.csv"), &peaks).unwrap();
    protected(run.path());
    detected(run.path());
    oriented(run.path());
    judge(run.path()).unwrap();
    let only_elsewhere = ["multipath", "spoofing", "array"];
    for picture in PICTURES.iter().filter(|picture| !only_elsewhere.contains(&picture.name)) {
        let name = picture.name;
        for numbers in picture.numbers {
            let rows = csv::Reader::from_path(run.path().join(numbers)).unwrap().into_records().count();
            assert!(rows > 5, "{name}: {rows} rows in {numbers}");
        }
        let path = run.path().join(format!("{name}.png"));
        let picture = resvg::tiny_skia::Pixmap::load_png(&path).unwrap();
        let inked = picture.pixels().iter().filter(|p| (p.red(), p.green(), p.blue()) != (255, 255, 255)).count();
        // Axes and title alone ink more than 1 %.
        assert!(inked * 100 > picture.pixels().len(), "{name}: {inked} pixels");
        let coloured = picture.pixels().iter().filter(|p| p.red().abs_diff(p.blue()) > 60).count();
        assert!(coloured > 200, "{name}: {coloured} coloured pixels");
    }
    if let Ok(kept) = std::env::var("GNSS_TWIN_KEEP_PICTURES") {
        for entry in fs::read_dir(run.path()).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                fs::copy(&path, Path::new(&kept).join(path.file_name().unwrap())).unwrap();
            }
        }
    }
}
