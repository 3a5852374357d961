//! Protection levels of ARAIM and SBAS by what documents print: a worked example, and factors with their
//! formula.

use nalgebra::{DMatrix, DVector};
use receiver::position::protection::geometry::Geometry;
use receiver::position::protection::{IntegritySettings, araim, sbas};

/// East, north, up, constellation, C_int and C_acc in m² of each satellite: ARAIM Reference Airborne
/// Algorithm Description Document 3.1, appendix D, equations 79 to 84.
const SKY: [(f64, f64, f64, usize, f64, f64); 10] = [
    (0.0225, 0.9951, -0.0966, 0, 3.2899, 2.9774),
    (0.6750, -0.6900, -0.2612, 0, 1.2792, 0.9667),
    (0.0723, -0.6601, -0.7477, 0, 0.7901, 0.4776),
    (-0.9398, 0.2553, -0.2269, 0, 1.4430, 1.1305),
    (-0.5907, -0.7539, -0.2877, 0, 1.1847, 0.8722),
    (-0.3236, -0.0354, -0.9455, 1, 0.7737, 0.4612),
    (-0.6748, 0.4356, -0.5957, 1, 0.8233, 0.5108),
    (0.0938, -0.7004, -0.7075, 1, 0.7962, 0.4837),
    (0.5571, 0.3088, -0.7709, 1, 0.7871, 0.4746),
    (0.6622, 0.6958, -0.2780, 1, 1.2166, 0.9041),
];

/// The printed sky with clocks of so many constellations.
fn geometry(clocks: usize) -> Geometry {
    let diagonal = |values: [f64; 10]| DMatrix::from_diagonal(&DVector::from_column_slice(&values));
    let (integrity, accuracy) = (diagonal(SKY.map(|one| one.4)), diagonal(SKY.map(|one| one.5)));
    let clock_of = |row: usize| 3 + SKY[row].3.min(clocks - 1);
    Geometry {
        rows: DMatrix::from_fn(10, 3 + clocks, |row, column| match column {
            0 => SKY[row].0,
            1 => SKY[row].1,
            2 => SKY[row].2,
            clock => f64::from(u8::from(clock_of(row) == clock)),
        }),
        satellites: (0..10).collect(),
        constellations: (0..10).map(|row| clock_of(row) - 3).collect(),
        weighting: integrity.clone(),
        integrity,
        accuracy,
        biases_m: vec![0.5; 10],
        residuals_m: DVector::zeros(10),
    }
}

/// Appendix D prints VPL 18.3 m, HPL 13.45 m, σ_v,acc 1.3694 m and EMT 7.2998 m, the last of a geometry with
/// more decimals than are printed.
#[test]
fn the_worked_example_of_araim_has_its_printed_levels() {
    let budget = IntegritySettings {
        phmi_vertical: 9.8e-8,
        phmi_horizontal: 2e-9,
        false_alarm_vertical: 3.9e-6,
        false_alarm_horizontal: 9e-8,
        p_threshold: 8e-8,
        p_emt: 1e-5,
        p_sat: 1e-5,
        p_const: 1e-4,
        ..IntegritySettings::default()
    };
    let found = araim::levels(&geometry(2), &budget).unwrap();
    let near = |name: &str, value: Option<f64>, printed: f64, digit: f64| {
        let value = value.unwrap();
        assert!((value - printed).abs() <= 0.5 * digit, "{name} {value}, printed {printed}");
    };
    near("VPL", found.vpl_m, 18.3, 0.1);
    near("HPL", found.hpl_m, 13.45, 0.01);
    near("accuracy", found.sigma_v_acc_m, 1.3694, 1e-4);
    near("EMT", found.emt_m, 7.2998, 2e-4);
}

/// RTCA DO-229D, J.1 and J.2.1: D = (GᵀWG)⁻¹, VPL = 5.33·√D_up, and on an approach
/// HPL = 6.0·√((D_e + D_n)/2 + √(((D_e − D_n)/2)² + D_en²)), else 6.18 times that root and no vertical level.
#[test]
fn levels_of_sbas_are_the_printed_factors_times_the_printed_axes() {
    let sky = geometry(1);
    let mut normal = DMatrix::<f64>::zeros(4, 4);
    for (east, north, up, _, variance_m2, _) in SKY {
        let row = DVector::from_column_slice(&[east, north, up, 1.0]);
        normal += &row * row.transpose() / variance_m2;
    }
    let d = normal.try_inverse().unwrap();
    let half = 0.5 * (d[(0, 0)] - d[(1, 1)]);
    let root = 0.5 * (d[(0, 0)] + d[(1, 1)]) + (half * half + d[(0, 1)] * d[(0, 1)]).sqrt();
    let near = |value: Option<f64>, expected: f64| {
        let value = value.unwrap();
        assert!((value / expected - 1.0).abs() < 1e-9, "{value}, by the formula {expected}");
    };
    let approach = sbas::levels(&sky, true).unwrap();
    near(approach.vpl_m, 5.33 * d[(2, 2)].sqrt());
    near(approach.hpl_m, 6.0 * root.sqrt());
    let en_route = sbas::levels(&sky, false).unwrap();
    near(en_route.hpl_m, 6.18 * root.sqrt());
    assert_eq!(en_route.vpl_m, None);
}
