//! Test of a carrier loop against a motion, and settings that would follow it.
//!
//! The error of the receiver's own loop is that of its discrete gains. For order 3 it is jerk·T³/K3, but no
//! more than the peak error after a step of the whole swing of acceleration. For order 2 it is
//! acceleration·T²/K2. The loop holds under two conditions. 3σ + θ is within 45° (Kaplan and Hegarty, eq.
//! 5.5, equal to σ + θ/3 within 15°). The lock detector, cos 2θ·e^(−2σ²), stays above its threshold. Limits:
//! σ holds thermal noise alone. Only the phase loop after pull-in is tested, not the search or the frequency
//! loop before it.

use std::f64::consts::TAU;

use analysis::expect::theory::linear::controlled_root;
use analysis::expect::theory::pll;
use receiver::track::TrackingSettings;
use receiver::track::loops::Gains;

/// Motion along a line of sight that the loop has to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Acceleration along the line of sight, in m/s².
    pub acceleration_mps2: f64,
    /// Jerk along the line of sight, in m/s³.
    pub jerk_mps3: f64,
    /// Difference from the least to the largest acceleration, m/s².
    pub swing_mps2: f64,
    /// Radius of a circle that the antenna describes besides, and turns a second.
    pub circle: Option<(f64, f64)>,
    /// C/N0 of the signal, dB-Hz; `None` for no noise.
    pub cn0_dbhz: Option<f64>,
}

/// Response of the loop to a demand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Error that the motion leaves in the phase loop, radians.
    pub stress_rad: f64,
    /// Thermal; 0 where nothing is known of C/N0.
    pub jitter_rad: f64,
    /// The largest stress that the loop bears beside this jitter; negative where jitter alone is too much.
    pub limit_rad: f64,
}

impl Answer {
    /// Margin to the limit, in radians.
    pub fn margin_rad(&self) -> f64 {
        self.limit_rad - self.stress_rad
    }

    /// True if the motion breaks a loop that would hold without it. A signal too weak for the loop at rest is
    /// not a fault of the motion.
    pub fn breaks(&self) -> bool {
        self.margin_rad() < 0.0 && (self.limit_rad > 0.0 || self.stress_rad > pll::LIMIT_RAD)
    }
}

/// Largest bandwidth that [`suggestion`] tries, hertz.
const LARGEST_HZ: u32 = 100;
/// Step between the tried bandwidths, hertz.
const STEP_HZ: u32 = 5;
/// Bandwidth times update time up to which a discrete loop is near the analogue one.
const SUGGESTED_BANDWIDTH_TIME: f64 = 0.1;

/// Response of a loop with `settings` to a demand, for a code of `period_s` on a carrier of `wavelength_m`.
pub fn answer(settings: &TrackingSettings, (period_s, wavelength_m): (f64, f64), demand: &Demand) -> Answer {
    let t_s = period_s * f64::from(settings.integration);
    let gains = Gains::design(settings.pll_order, settings.pll_bandwidth_hz * t_s);
    let swept_m =
        demand.circle.map_or(0.0, |(radius_m, hz)| radius_m * error_gain(settings.pll_order, &gains, hz * t_s));
    let steady_m = if settings.pll_order >= 3 {
        let steady_m = pll::stress_discrete(3, gains.acceleration, t_s, demand.jerk_mps3);
        steady_m.min(demand.swing_mps2 * t_s * t_s * step_peak(gains.acceleration))
    } else {
        pll::stress_discrete(2, gains.rate, t_s, demand.acceleration_mps2)
    };
    // Below its threshold the receiver takes a signal for lost whatever the motion.
    let cn0_dbhz = demand.cn0_dbhz.map(|dbhz| dbhz.max(settings.cn0_threshold_dbhz));
    let jitter_rad =
        cn0_dbhz.map_or(0.0, |dbhz| pll::jitter_rad(settings.pll_bandwidth_hz, t_s, libm::pow(10.0, 0.1 * dbhz)));
    let lock = settings.phase_unlock_threshold * libm::exp(2.0 * jitter_rad * jitter_rad);
    let detector_rad = if lock < 1.0 { 0.5 * libm::acos(lock) } else { -1.0 };
    Answer {
        stress_rad: (steady_m + swept_m) / wavelength_m * TAU,
        jitter_rad,
        limit_rad: (pll::LIMIT_RAD - 3.0 * jitter_rad).min(detector_rad),
    }
}

/// Common root of the loop's characteristic polynomial.
fn root(order: u32, gains: &Gains) -> f64 {
    controlled_root(order, [gains.phase, gains.rate, gains.acceleration])
}

/// Remaining share of a sinusoid that turns `cycles` within an update: |(z−1)/(z−p)|^N on the unit circle.
fn error_gain(order: u32, gains: &Gains, cycles: f64) -> f64 {
    let root = root(order, gains);
    let cos = libm::cos(TAU * cycles);
    let once = ((2.0 - 2.0 * cos) / (1.0 + root * root - 2.0 * root * cos)).sqrt();
    (0..order).fold(1.0, |gain, _| gain * once)
}

/// Largest error of a loop of order 3 with last gain (1−p)³ after a step of acceleration, over step·T²: its
/// error's transfer function ((z−1)/(z−p))³ leaves ½·(C(n+1, 2)·p^(n−1) + C(n, 2)·p^(n−2)) at update n. In
/// continuous time it is 2e⁻²/ω². No acceleration within a swing as wide as the step leaves more, because
/// that of a jerk's impulse has one sign.
fn step_peak(last_gain: f64) -> f64 {
    let p = controlled_root(3, [0.0, 0.0, last_gain]);
    // The peak comes at two time constants.
    let updates = (4.0 / (1.0 - p).max(1e-6)) as u32 + 4;
    let (mut most, mut power) = (0.0_f64, 1.0);
    for n in 1..=updates {
        let n = f64::from(n);
        // Here p^(n−1); over p once more for the second term.
        let error = 0.25 * n * ((n + 1.0) * power + if n > 1.0 { (n - 1.0) * power / p.max(1e-12) } else { 0.0 });
        most = most.max(error);
        power *= p;
    }
    most
}

/// Settings close to `settings` that follow every demand which a loop at rest would hold, with a stress of
/// 15° at most; order, bandwidth and integration differ where they must. `None` if none up to 100 Hz does.
pub fn suggestion(settings: &TrackingSettings, signal: (f64, f64), demands: &[Demand]) -> Option<TrackingSettings> {
    let (least, orders) =
        ((settings.pll_bandwidth_hz / f64::from(STEP_HZ)).floor() as u32 + 1, [settings.pll_order, 3]);
    for pll_order in orders {
        for pll_bandwidth_hz in (least..=LARGEST_HZ / STEP_HZ).map(|k| f64::from(k * STEP_HZ)) {
            let fits = |count: &&u32| pll_bandwidth_hz * f64::from(**count) * signal.0 <= SUGGESTED_BANDWIDTH_TIME;
            let counts = [20, 10, 5, 4, 2, 1];
            let integration = counts.iter().filter(|count| **count <= settings.integration).find(fits).copied();
            let new = TrackingSettings {
                pll_order,
                pll_bandwidth_hz,
                integration: integration.unwrap_or(1),
                ..settings.clone()
            };
            let holds = |demand: &Demand| {
                let answer = answer(&new, signal, demand);
                !answer.breaks() && answer.stress_rad <= pll::THRESHOLD_RAD
            };
            if new.validate(signal.0).is_ok() && demands.iter().all(holds) {
                return Some(new);
            }
        }
    }
    None
}

/// The keys in which `new` differs from `old`, as a settings file writes them.
pub fn keys(old: &TrackingSettings, new: &TrackingSettings) -> String {
    let mut found = Vec::new();
    if old.pll_order != new.pll_order {
        found.push(format!("pll_order = {}", new.pll_order));
    }
    if old.pll_bandwidth_hz != new.pll_bandwidth_hz {
        found.push(format!("pll_bandwidth_hz = {}", new.pll_bandwidth_hz));
    }
    if old.integration != new.integration {
        found.push(format!("integration = {}", new.integration));
    }
    found.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const G_MPS2: f64 = 9.806_65;
    const L1: (f64, f64) = (1e-3, 0.190_293_672_798_365);

    fn boost(jerk_mps3: f64, cn0_dbhz: f64) -> Demand {
        Demand { acceleration_mps2: 210.0, jerk_mps3, swing_mps2: 230.0, circle: None, cn0_dbhz: Some(cn0_dbhz) }
    }

    #[test]
    fn stress_is_that_of_the_loop_s_own_roots() {
        // B·T = 0.018 asks for three roots at 0.982936 (from the impulse response of the error's transfer
        // function): 9.80665 m/s³ / 0.190294 m · (1e-3 / 0.017064)³ · 360 = 3.734°.
        let settings = TrackingSettings { integration: 1, ..Default::default() };
        let found = answer(&settings, L1, &boost(G_MPS2, 45.0));
        assert!((found.stress_rad.to_degrees() - 3.734).abs() < 1e-3, "{found:?}");
        // σ² = 18/10^4.5 · (1 + 1/(2 · 1e-3 · 10^4.5)) = 5.7819e-4: 1.3777°.
        assert!((found.jitter_rad.to_degrees() - 1.3777).abs() < 1e-3, "{found:?}");
        // The detector: ½ acos(0.4 · e^(2 · 5.7819e-4)) = 33.197°, below 45° − 4.13°.
        assert!((found.limit_rad.to_degrees() - 33.197).abs() < 2e-2, "{found:?}");
        // Order 2, two roots at 0.971925: 1 m/s² / 0.190294 m · (1e-3 / 0.028075)² · 360 = 2.400°.
        let second = TrackingSettings { pll_order: 2, ..settings };
        let found = answer(&second, L1, &Demand { acceleration_mps2: 1.0, ..boost(0.0, 45.0) });
        assert!((found.stress_rad.to_degrees() - 2.400).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_jerk_too_short_to_settle_counts_as_a_step_of_acceleration() {
        // A gun: 1e6 m/s³ for 0.1 ms is a step of 100 m/s². 35 Hz and 1 ms: three roots at 0.967502, a peak
        // of 49.288°; a jerk that lasts would leave six million degrees.
        let settings = TrackingSettings { pll_bandwidth_hz: 35.0, integration: 1, ..Default::default() };
        let gun = Demand { acceleration_mps2: 100.0, jerk_mps3: 1e6, swing_mps2: 100.0, circle: None, cn0_dbhz: None };
        let found_deg = answer(&settings, L1, &gun).stress_rad.to_degrees();
        assert!((found_deg - 49.288).abs() < 1e-2, "{found_deg}");
        // The sum over updates against the loop's own recursion: error e of a phase ½·t², e' = three roots at
        // p.
        let p = 0.95_f64;
        let k = 0.05_f64 * 0.05 * 0.05;
        let (mut e, mut most) = ([0.0_f64; 3], 0.0_f64);
        let phase = |n: i32| if n > 0 { 0.5 * f64::from(n * n) } else { 0.0 };
        for n in 1..200 {
            let third = phase(n) - 3.0 * phase(n - 1) + 3.0 * phase(n - 2) - phase(n - 3);
            let new = third + 3.0 * p * e[0] - 3.0 * p * p * e[1] + p * p * p * e[2];
            e = [new, e[0], e[1]];
            most = most.max(new);
        }
        assert!((step_peak(k) / most - 1.0).abs() < 1e-9, "{} {most}", step_peak(k));
    }

    #[test]
    fn a_boost_of_20_g_per_second_breaks_the_defaults_and_gets_35_hz_and_2_ms() {
        let demand = boost(196.0, 48.0);
        let defaults = TrackingSettings::default();
        let found = answer(&defaults, L1, &demand);
        // 18 Hz and 4 ms: 90.4°; 35 Hz and 2 ms: 12.2° (30 Hz and 2 ms: 18.7°).
        assert!(found.breaks() && (found.stress_rad.to_degrees() - 90.425).abs() < 0.01, "{found:?}");
        let new = suggestion(&defaults, L1, &[demand]).unwrap();
        assert_eq!(keys(&defaults, &new), "pll_bandwidth_hz = 35, integration = 2");
        let held = answer(&new, L1, &demand);
        assert!(!held.breaks() && (held.stress_rad.to_degrees() - 12.216).abs() < 0.01, "{held:?}");
        // Nothing to 100 Hz follows 1000 g/s that lasts; a rest asks for nothing.
        let gun = Demand { jerk_mps3: 1000.0 * G_MPS2, swing_mps2: 1e5, ..demand };
        assert_eq!(suggestion(&defaults, L1, &[gun]), None);
        // A signal as weak as 25 dB-Hz leaves 3σ of 48° at rest, which is no fault of the motion; a weaker
        // one is lost anyway.
        let rest = |dbhz: f64| {
            let demand = Demand { acceleration_mps2: 0.18, jerk_mps3: 0.0, swing_mps2: 0.01, ..boost(0.0, dbhz) };
            answer(&defaults, L1, &demand)
        };
        assert!(!rest(25.0).breaks() && rest(25.0).limit_rad < 0.0 && rest(-100.0) == rest(25.0), "{:?}", rest(25.0));
    }

    #[test]
    fn an_antenna_that_circles_faster_than_the_loop_leaves_no_more_than_its_circle() {
        // 5 mm are 9.459°; at 21.3 Hz their jerk of 12 km/s³ would leave 322° if it lasted. 45 Hz and 1 ms:
        // roots at 0.958713, |z − 1| = 0.133732, |z − p| = 0.137297, and the third power of their ratio
        // leaves 8.741°.
        let settings = TrackingSettings { pll_bandwidth_hz: 45.0, integration: 1, ..Default::default() };
        let circling = Demand { circle: Some((0.005, 21.3)), ..boost(0.0, 50.0) };
        let found_deg = answer(&settings, L1, &circling).stress_rad.to_degrees();
        assert!((found_deg - 8.741).abs() < 1e-3, "{found_deg}");
    }

    #[test]
    fn a_loop_of_order_2_is_raised_to_3_where_no_bandwidth_follows_the_acceleration() {
        let second = TrackingSettings { pll_order: 2, ..Default::default() };
        // 300 m/s² leave 29° at 100 Hz and 1 ms.
        let demand = Demand { acceleration_mps2: 300.0, jerk_mps3: 20.0, swing_mps2: 300.0, ..boost(20.0, 50.0) };
        let new = suggestion(&second, L1, &[demand]).unwrap();
        assert_eq!(new.pll_order, 3);
        assert!(keys(&second, &new).starts_with("pll_order = 3, pll_bandwidth_hz = "));
    }
}
