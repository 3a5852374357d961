//! Growth of the bounds of SBAS corrections while they age, or newer ones are lost.
//!
//! Source: RTCA DO-229D, A.4.5.1 (corrections), A.4.5.2 (ionosphere) and J.2.2. Limits: corrections are not
//! used beyond their time-outs, so that the term of users en route who do (ε_er) is zero.

use gnss::augmentation::accuracy::Ageing;
use gnss::augmentation::{ALARM, Factors};

/// Growth of a bound in metres where no factors of degradation were received (J.2.2).
pub const UNKNOWN_M: f64 = 8.0;

/// Age of a satellite's corrections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Age {
    /// Seconds since the accuracy was stated, and the system's latency.
    pub accuracy_s: f64,
    /// Seconds since the fast correction.
    pub fast_s: f64,
    /// Fast correction before: seconds between both, and issues of it and of the newer one.
    pub before: Option<(f64, u8, u8)>,
    /// Age of the long-term correction.
    pub long_term: LongTermAge,
}

/// Age of a long-term correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LongTermAge {
    /// Seconds since it came, of one without rates.
    Steady(f64),
    /// Seconds since its reference time, of one with rates: negative before it.
    Moving(f64),
}

/// Standard deviation in metres of a corrected range whose own one, multiplied by δUDRE, is `sigma_m`.
pub fn corrected_m(sigma_m: f64, factors: &Factors, ageing: &Ageing, age: &Age) -> f64 {
    let fast_m = 0.5 * ageing.acceleration_mps2 * age.accuracy_s * age.accuracy_s;
    let terms = [fast_m, rate_m(factors, ageing, age), long_term_m(factors, age.long_term)];
    grown_m(sigma_m, &terms, factors.is_squared)
}

/// Standard deviation in metres of a vertical delay that came so many seconds ago.
pub fn delay_m(sigma_m: f64, factors: &Factors, age_s: f64) -> f64 {
    let age_s = age_s.max(0.0);
    let step_m = factors.c_iono_step_m * steps(age_s, factors.i_iono_s);
    grown_m(sigma_m, &[step_m + factors.c_iono_ramp_mps * age_s], factors.is_delay_squared)
}

/// Whole intervals in a time; none if there is no interval.
fn steps(age_s: f64, interval_s: f64) -> f64 {
    if interval_s > 0.0 { (age_s / interval_s).floor() } else { 0.0 }
}

fn grown_m(sigma_m: f64, terms: &[f64], is_squared: bool) -> f64 {
    if is_squared {
        return terms.iter().fold(sigma_m * sigma_m, |sum, term| sum + term * term).sqrt();
    }
    sigma_m + terms.iter().sum::<f64>()
}

/// Error of the rate of fast corrections, ε_rrc (A.4.5.1.2): none where they come in turn.
fn rate_m(factors: &Factors, ageing: &Ageing, age: &Age) -> f64 {
    let Some((between_s, old, new)) = age.before.filter(|(between_s, ..)| *between_s > 0.0) else { return 0.0 };
    if ageing.acceleration_mps2 == 0.0 {
        return 0.0;
    }
    let (acceleration_mps2, interval_s) = (ageing.acceleration_mps2, ageing.interval_s);
    let own_mps = if old != ALARM && new != ALARM {
        if (old + 1) % ALARM == new {
            return 0.0;
        }
        0.25 * acceleration_mps2 * interval_s
    } else {
        let apart_s = (between_s - 0.5 * interval_s).abs();
        if apart_s == 0.0 {
            return 0.0;
        }
        0.5 * acceleration_mps2 * apart_s
    };
    (own_mps + factors.b_rrc_m / between_s) * age.fast_s.max(0.0)
}

/// Error of a long-term correction, ε_ltc (A.4.5.1.3).
fn long_term_m(factors: &Factors, age: LongTermAge) -> f64 {
    match age {
        LongTermAge::Steady(age_s) => factors.c_ltc_v0_m * steps(age_s.max(0.0), factors.i_ltc_v0_s),
        LongTermAge::Moving(since_s) if (0.0..=factors.i_ltc_v1_s).contains(&since_s) => 0.0,
        LongTermAge::Moving(since_s) => {
            factors.c_ltc_lsb_m + factors.c_ltc_v1_mps * (-since_s).max(since_s - factors.i_ltc_v1_s).max(0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::augmentation::accuracy::ageing_of;

    const FACTORS: Factors = Factors {
        b_rrc_m: 0.15,
        c_ltc_lsb_m: 0.15,
        c_ltc_v1_mps: 0.0005,
        i_ltc_v1_s: 120.0,
        c_ltc_v0_m: 0.15,
        i_ltc_v0_s: 120.0,
        c_geo_lsb_m: 0.0,
        c_geo_v_mps: 0.0,
        i_geo_s: 0.0,
        c_er_m: 0.0,
        c_iono_step_m: 0.02,
        i_iono_s: 300.0,
        c_iono_ramp_mps: 0.0,
        is_squared: true,
        is_delay_squared: false,
        c_covariance: 0.0,
    };

    fn fresh() -> Age {
        Age { accuracy_s: 0.0, fast_s: 4.0, before: Some((6.0, 0, 1)), long_term: LongTermAge::Steady(60.0) }
    }

    #[test]
    fn corrections_that_come_in_turn_have_the_bound_of_their_indicator_alone() {
        let ageing = ageing_of(8);
        assert_eq!(corrected_m(0.5, &FACTORS, &ageing, &fresh()), 0.5);
        let later = Age { accuracy_s: 10.0, ..fresh() };
        // 0.0006 m/s² over ten seconds.
        assert!((corrected_m(0.5, &FACTORS, &ageing, &later) - libm::hypot(0.5, 0.03)).abs() < 1e-12);
        let added = Factors { is_squared: false, ..FACTORS };
        assert!((corrected_m(0.5, &added, &ageing, &later) - 0.53).abs() < 1e-12);
    }

    #[test]
    fn a_fast_correction_that_was_lost_costs_the_error_of_the_rate() {
        let ageing = ageing_of(8);
        let lost = Age { before: Some((12.0, 0, 2)), ..fresh() };
        let expected_m = (0.25 * 0.0006 * 21.0 + 0.15 / 12.0) * 4.0;
        assert!((corrected_m(0.5, &FACTORS, &ageing, &lost) - libm::hypot(0.5, expected_m)).abs() < 1e-12);
        // After an alarm the time between both counts.
        let alarm = Age { before: Some((6.0, 2, ALARM)), ..fresh() };
        let expected_m = (0.5 * 0.0006 * 4.5 + 0.15 / 6.0) * 4.0;
        assert!((corrected_m(0.5, &FACTORS, &ageing, &alarm) - libm::hypot(0.5, expected_m)).abs() < 1e-12);
        // Without ageing no rate is used.
        assert_eq!(corrected_m(0.5, &FACTORS, &ageing_of(0), &lost), 0.5);
    }

    #[test]
    fn long_term_corrections_and_delays_grow_beyond_the_time_of_the_next_one() {
        let of = |long_term| {
            corrected_m(0.0, &Factors { is_squared: false, ..FACTORS }, &ageing_of(0), &Age { long_term, ..fresh() })
        };
        assert_eq!([119.0, 120.0, 240.0].map(|age_s| of(LongTermAge::Steady(age_s))), [0.0, 0.15, 0.3]);
        assert_eq!(of(LongTermAge::Moving(0.0)), 0.0);
        assert!((of(LongTermAge::Moving(160.0)) - 0.17).abs() < 1e-12);
        assert!((of(LongTermAge::Moving(-20.0)) - 0.16).abs() < 1e-12);
        assert_eq!([299.0, 300.0].map(|age_s| delay_m(1.0, &FACTORS, age_s)), [1.0, 1.02]);
        assert_eq!(delay_m(1.0, &Factors { i_iono_s: 0.0, ..FACTORS }, 500.0), 1.0);
    }
}
