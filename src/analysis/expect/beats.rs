//! Beats: what another satellite's code adds to a code loop while both carriers run alike.
//!
//! Codes of other satellites count as noise ([`super::multiple_access`]) because Dopplers and symbols shuffle
//! them. Where both satellites send the same symbols (pilots, almanac pages, messages with nothing to say)
//! and their Dopplers differ by Δf, a whole number of 1/(code period) apart, the sum of own code times other
//! code is the same in each code period and turns with Δf. It is a random walk of N chips: of amplitude a
//! against the own one, it has the values a·r with a variance of 1/N of each r (Kaplan and Hegarty, 4.3.4:
//! −24 dB of Gold codes of 1023 chips at the worst, −30 dB here as the rms). Between whole chips Λ, the
//! correlation of a chip's waveform, joins the values. Early less late then differ by a·√(D/N) in the rms,
//! D = ∫ (Λ(τ + d/2) − Λ(τ − d/2))² dτ in chips, half of its square in phase with the carrier, and a
//! discriminator of slope 2s makes of that the error
//!
//! ε = a·√(D/(8·N))/s chips, a·d/(2√N) of rectangular chips (D = 2d², s = 1) at small distances d.
//!
//! 1.0 m of chips of 293 m and d = 0.5 with a = 0.4, and the beat is no noise: it is there with the sign of
//! both phases as long as Dopplers and symbols are. The loop follows it as a first-order loop of bandwidth B
//! follows f, 1/(1 + (πf/2B)²) of its square. Limits: whether symbols are equal is not asked, so that this is
//! what a beat may add and not what it must; a code lag that changes by chips within the loop's time, a
//! kilohertz apart, averages it; a pilot whose secondary code is the satellite's own has none.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use crate::error::JudgeError;
use crate::expect::loops::Theory;
use crate::read::Run;
use gnss::signal::{Component, Link, SecondaryCode};

/// Distance in seconds of the times at which carriers are compared.
const NODE_S: f64 = 1.0;
/// Largest number of such times in a run.
const MOST_NODES: f64 = 4096.0;

/// Carriers of all satellites, from time to time.
pub struct Beats {
    step_s: f64,
    tracks: BTreeMap<Link, BTreeMap<u64, Node>>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    doppler_hz: f64,
    cn0_hz: f64,
}

impl Beats {
    /// Beats from the truth of a run.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn new(run: &Run) -> Result<Self, JudgeError> {
        let last = run.trajectory.last().map_or(0, |row| row.sample);
        let step_s = NODE_S.max(run.time_s(last) / MOST_NODES);
        let mut tracks = BTreeMap::new();
        for link in run.truth.keys() {
            let mut nodes = BTreeMap::new();
            run.truth.each(link, |row| {
                let node = Node { doppler_hz: row.doppler_hz, cn0_hz: libm::pow(10.0, row.cn0_dbhz / 10.0) };
                nodes.entry(place(run.time_s(row.sample), step_s)).or_insert(node);
            })?;
            tracks.insert(link, nodes);
        }
        Ok(Self { step_s, tracks })
    }

    /// Mean square of the code error between two times that beats may make in the code loop of a satellite
    /// and a mean over `averaged_s` after it, chips².
    pub fn variance(&self, theory: &Theory, link: Link, span_s: (f64, f64), averaged_s: f64) -> f64 {
        let passed = |beat_hz: f64| passed(beat_hz, theory.settings.dll_bandwidth_hz, averaged_s);
        theory.beat_chips2 * self.power(theory.component, link, span_s, passed)
    }

    /// Power of the codes that beat with a component's, over its own and after a filter, on average.
    fn power(&self, component: &Component, link: Link, (from_s, to_s): (f64, f64), passed: impl Fn(f64) -> f64) -> f64 {
        let Some(own) = self.tracks.get(&link).filter(|_| repeats(component)) else { return 0.0 };
        let others: Vec<(f64, &BTreeMap<u64, Node>)> = (self.tracks.iter())
            .filter(|(other, _)| other.sv != link.sv && other.carrier_hz() == link.carrier_hz())
            .filter_map(|(other, nodes)| Some((like(component, *other)?, nodes)))
            .collect();
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for (at, node) in own.range(place(from_s, self.step_s)..=place(to_s, self.step_s)) {
            count += 1.0;
            for (share, other) in &others {
                let Some(other) = other.get(at) else { continue };
                let beat_hz = folded_hz(other.doppler_hz - node.doppler_hz, component.period_s());
                sum += share * other.cn0_hz / node.cn0_hz * passed(beat_hz);
            }
        }
        sum / count.max(1.0)
    }
}

fn place(time_s: f64, step_s: f64) -> u64 {
    (time_s / step_s).max(0.0) as u64
}

/// True if the chips are equal in each period, apart from the symbols.
fn repeats(component: &Component) -> bool {
    !matches!(component.secondary_code, SecondaryCode::PerSatellite { .. })
}

/// Power that a satellite puts into codes of a component's kind, over what that component has of its own
/// signal.
fn like(component: &Component, other: Link) -> Option<f64> {
    let alike = |one: &&Component| {
        one.chip_rate_hz == component.chip_rate_hz && one.code_chips == component.code_chips && repeats(one)
    };
    let share: f64 = other.signal.components.iter().filter(alike).map(|one| one.power_share).sum();
    (share > 0.0).then_some(share / component.power_share)
}

/// Rotation of a difference of carriers from one code period to the next, as a frequency in hertz.
fn folded_hz(apart_hz: f64, period_s: f64) -> f64 {
    let turns = apart_hz * period_s;
    (turns - turns.round()) / period_s
}

/// Share of a beat's square that a loop and a mean after it let through.
fn passed(beat_hz: f64, bandwidth_hz: f64, averaged_s: f64) -> f64 {
    let (in_loop, in_mean) = (PI * beat_hz / (2.0 * bandwidth_hz), PI * beat_hz * averaged_s);
    1.0 / ((1.0 + in_loop * in_loop) * (1.0 + in_mean * in_mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1c::L1C;
    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::Sv;

    #[test]
    fn a_loop_passes_of_a_beat_what_a_first_order_loop_of_its_bandwidth_passes() {
        // Steps of 1 ms of x' = 4B·(input − x), whose noise bandwidth is B.
        for (bandwidth_hz, beat_hz) in [(0.5, 0.9), (0.5, 0.05), (2.0, 3.0)] {
            let (mut x, mut squares) = (0.0, 0.0);
            for k in 0..200_000 {
                let input = libm::sin(2.0 * PI * beat_hz * 1e-3 * f64::from(k));
                x += 4.0 * bandwidth_hz * 1e-3 * (input - x);
                squares += if k < 100_000 { 0.0 } else { x * x / 1e5 };
            }
            let found = passed(beat_hz, bandwidth_hz, 0.0);
            assert!((found / (2.0 * squares) - 1.0).abs() < 0.02, "{bandwidth_hz} {beat_hz}: {found} {squares}");
        }
        assert!(passed(0.9, 0.5, 30.0) < 1e-3 && passed(0.001, 0.5, 30.0) > 0.98);
    }

    #[test]
    fn codes_beat_whose_carriers_are_whole_kilohertz_apart_and_none_under_secondary_codes_of_their_own() {
        let beats = |signal: &'static gnss::signal::Signal, apart_hz: f64| {
            let track = |doppler_hz: f64, cn0_hz: f64| (0..10).map(|k| (k, Node { doppler_hz, cn0_hz })).collect();
            let (one, other) = (signal.link(Sv::gps(3)), signal.link(Sv::gps(7)));
            let tracks = [(one, track(-700.0, 1e4)), (other, track(-700.0 + apart_hz, 4e4))].into();
            let own = |component: &&Component| !repeats(component);
            let component = signal.components.iter().find(own).unwrap_or(&signal.components[0]);
            let all = Beats { step_s: 1.0, tracks };
            [one, other].map(|link| all.power(component, link, (0.0, 9.5), |hz| passed(hz, 0.5, 0.0)))
        };
        let half = passed(0.3, 0.5, 0.0);
        for apart_hz in [0.3, 1999.7] {
            let [weak, strong] = beats(&L1_CA, apart_hz);
            assert!((weak - 4.0 * half).abs() < 1e-6 && (strong - 0.25 * half).abs() < 1e-6, "{weak} {strong}");
        }
        // Half a kilohertz apart signs change from one period to the next.
        assert!(beats(&L1_CA, 500.0)[0] < 1e-5);
        assert_eq!(beats(&L1C, 0.3), [0.0; 2]);
    }
}
