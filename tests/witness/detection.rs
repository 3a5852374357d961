//! Thresholds of the detectors by printed tables of the normal distribution and of Student's.

use receiver::detect::law::{among, two_sided};

/// Abramowitz and Stegun, table 26.5: the modulus that a standard normal value exceeds.
#[test]
fn thresholds_are_those_that_tables_print_for_both_sides() {
    for (probability, printed) in [(0.05, 1.959_96), (0.01, 2.575_83), (1e-3, 3.290_53), (1e-4, 3.890_59)] {
        assert!((two_sided(probability) - printed).abs() < 1e-5, "{probability}: {}", two_sided(probability));
    }
}

/// Table 26.10: with five degrees of freedom Student's value is beyond 4.032 once in a hundred, a normal one
/// beyond 2.576. The normal value of the law that the receiver takes is right to 0.02 of itself.
#[test]
fn a_number_among_six_others_is_beyond_the_normal_bound_where_the_printed_one_of_student_is() {
    let others = [41.0, 39.0, 41.0, 39.0, 41.0, 39.0];
    // Their variance is 6/5, and that of the difference from their mean 7/6 of it.
    let bound = 4.032 * (1.2_f64 * 7.0 / 6.0).sqrt();
    for sign in [-1.0, 1.0] {
        let found = sign * among(40.0 + sign * bound, &others).unwrap();
        assert!((found / 2.575_83 - 1.0).abs() < 0.02, "{found}");
    }
}
