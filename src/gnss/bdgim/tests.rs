//! Laws of the model; its figures are in `tests/witness/bdgim.rs`.

use super::*;

const DAY: Bdgim = Bdgim { alpha_tecu: [30.875, 0.25, 11.625, 10.375, -12.5, 0.75, 0.0, 3.125, 1.875] };

/// Every harmonic at a position by degree, order and whether it is a sine's.
fn all(place: &UnderSun) -> Vec<f64> {
    let found = place.harmonics();
    (0..=DEGREE).flat_map(|n| (0..=ORDER.min(n)).flat_map(move |m| (0..2).map(move |k| found[n][m][k]))).collect()
}

#[test]
fn harmonics_are_orthogonal_over_the_sphere_and_have_a_mean_square_of_one() {
    // Products have degree 10 and order 6 at most: the Gauss-Legendre rule of six nodes in the sine
    // of the latitude (Abramowitz and Stegun, table 25.4) and twelve longitudes integrate them without an
    // error.
    let half = [
        (0.238_619_186_083_197, 0.467_913_934_572_691),
        (0.661_209_386_466_265, 0.360_761_573_048_139),
        (0.932_469_514_203_152, 0.171_324_492_379_170),
    ];
    let rule = half.iter().flat_map(|(x, weight)| [(*x, *weight), (-*x, *weight)]);
    let count = all(&UnderSun { sin_latitude: 0.0, longitude_rad: 0.0 }).len();
    let mut sums = vec![vec![0.0; count]; count];
    for (sin_latitude, weight) in rule {
        for k in 0..12 {
            let own = all(&UnderSun { sin_latitude, longitude_rad: f64::from(k) * TAU / 12.0 });
            for (row, a) in sums.iter_mut().zip(&own) {
                row.iter_mut().zip(&own).for_each(|(sum, b)| *sum += weight * a * b / 24.0);
            }
        }
    }
    for (i, row) in sums.iter().enumerate() {
        for (k, sum) in row.iter().enumerate() {
            // A sine of order 0 is nothing. The rule has fifteen digits.
            let expected = if i == k && *sum > 0.5 { 1.0 } else { 0.0 };
            assert!((sum - expected).abs() < 1e-12, "{i} {k}: {sum}");
        }
    }
    // 6 + 5 + 4 + 3 degrees of order 0 to 3, all but order 0 twice.
    let ones = sums.iter().enumerate().filter(|(i, row)| row[*i] > 0.5).count();
    assert_eq!(ones, 6 + 2 * (5 + 4 + 3));
}

#[test]
fn poles_horizon_and_antimeridian_give_finite_delays_and_the_same_place_the_same() {
    let at = Epoch::parse("2026-03-09T13:00:00").unwrap();
    for latitude in [-90.0, -80.27, 80.27, 90.0] {
        for elevation_rad in [-1.0, 0.0, 0.5, PI / 2.0] {
            let user = Geodetic::from_degrees(latitude, -72.58, 0.0);
            let delay_s = DAY.delay_s(user, Look { azimuth_rad: 1.0, elevation_rad }, at, 1575.42e6);
            // At least α₁/8 = 3.9 TECU, at most 200 of them three times over.
            assert!((2e-9..4e-7).contains(&delay_s), "{latitude} {elevation_rad}: {delay_s}");
        }
    }
    let look = Look { azimuth_rad: 2.0, elevation_rad: 0.3 };
    let of = |longitude| DAY.delay_s(Geodetic::from_degrees(10.0, longitude, 0.0), look, at, 1575.42e6);
    assert!((of(180.0) - of(-180.0)).abs() < 1e-20);
    // Below the horizon it is that of the horizon.
    let low =
        |elevation_rad| DAY.delay_s(Geodetic::from_degrees(10.0, 0.0, 0.0), Look { elevation_rad, ..look }, at, 1e9);
    assert_eq!(low(-0.2), low(0.0));
}

#[test]
fn intervals_begin_at_even_hours_of_bdt() {
    let at = |text: &str, s: f64| BDT.instant(Epoch::parse(text).unwrap().plus_s(s));
    // MJD 59158 is 2020-11-05.
    assert_eq!(interval(at("2020-11-05T00:00:00", 0.0)), (59_158 * 12, 0.0));
    assert_eq!(interval(at("2020-11-05T17:00:00", 0.25)), (59_158 * 12 + 8, 3600.25));
    assert_eq!(interval(at("2020-11-05T02:00:00", -0.5)), (59_158 * 12, 7199.5));
}

#[test]
fn nine_zeros_are_no_coefficients_and_the_least_content_is_a_share_of_the_mean() {
    assert_eq!(Bdgim::given([0.0; 9]), None);
    assert_eq!(Bdgim::given(DAY.alpha_tecu), Some(DAY));
    let least = |mean: f64| Bdgim { alpha_tecu: [mean, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] }.least_tecu();
    assert_eq!([36.0, 24.0, 15.0, 8.0].map(least), [3.6, 3.0, 2.5, 2.0]);
}

#[test]
fn the_delay_grows_with_the_square_of_the_wavelength() {
    // Of 1 TECU on 1 GHz 0.4028 m.
    assert!((delay_s(1.0, 1e9) * SPEED_OF_LIGHT_MPS - 0.4028).abs() < 1e-15);
    assert!((delay_s(7.0, 1176.45e6) / delay_s(7.0, 1575.42e6) - (154.0_f64 / 115.0).powi(2)).abs() < 1e-12);
}
