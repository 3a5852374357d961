//! Deviations of a clock against another program's.

use std::fs;

use analysis::measure::allan::Deviation;

use super::data::external;

fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace().map(|word| word.parse().unwrap()).collect()
}

/// Lines that are not comments.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty())
}

#[test]
fn deviations_at_every_averaging_time_are_those_of_stable32() {
    let Some(path) = external("ref/allan/PHASE.DAT") else { return };
    let x: Vec<f64> = lines(&fs::read_to_string(path).unwrap()).map(|line| numbers(line)[0]).collect();
    assert_eq!(x.len(), 1001);
    let mut compared = 0;
    for deviation in Deviation::ALL {
        // Stable32 1.53, all τ. There is no table of the overlapping Hadamard deviation.
        if deviation == Deviation::Ohdev {
            continue;
        }
        let Some(table) = external(&format!("ref/allan/phase_dat_{}.txt", deviation.name())) else { return };
        for row in lines(&fs::read_to_string(table).unwrap()) {
            let row = numbers(row);
            let (m, terms, printed) = (row[0] as usize, row[2] as usize, row[5]);
            let estimate = deviation.estimate(&x, 1.0, m).unwrap();
            assert_eq!(estimate.terms, terms, "{deviation:?} {m}");
            // Five digits are printed. One value of 852 lies 1.4e-3 of a unit beyond the half: a time
            // deviation that is 0.788355013 and was printed as 0.78835.
            let unit = libm::pow(10.0, libm::log10(printed).floor() - 4.0);
            let off = (estimate.deviation - printed).abs() / unit;
            assert!(off < 0.502, "{deviation:?} {m}: {} against {printed}", estimate.deviation);
            compared += 1;
        }
    }
    assert_eq!(compared, 852);
}
