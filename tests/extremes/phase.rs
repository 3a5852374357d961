//! Cases 5 to 7: integer phases over hours and weeks, against integers and geometry evaluated here.
//!
//! The scene is at 1575.42 MHz = 1540 · 1.023 MHz, so carrier cycles of code time are whole numbers of 2^-48
//! chip, and what the local oscillator and the receiver's clock add is a fraction of integers. Only the range
//! needs `f64`.

use gnss_twin::generator::effect::ionosphere::KlobucharIonosphere;
use gnss_twin::generator::scene::{CodeEdge, Scene};
use gnss_twin::generator::sky;
use gnss_twin::generator::synth::Edge;
use gnss_twin::generator::transmit::Transmitter;
use gnss_twin::generator::truth;
use gnss_twin::gnss::gps::l1ca::L1_CA;
use gnss_twin::gnss::rinex;
use gnss_twin::gnss::satellite::Sv;
use gnss_twin::gnss::time::Epoch;

use crate::figures::{CA, Worst, case};
use crate::run;

const CASE: crate::figures::Case = case(5, "a day, and thirty", CA);

/// Centre of the band: the IF is 4.092 MHz.
const CENTER_HZ: f64 = 1_571.328e6;
const RUN: u64 = 4096;

/// A static scene with a clock that is 1.3e-4 s ahead and 5e-8 fast.
fn scene(rate_hz: f64, duration_s: f64) -> Scene {
    let if_hz = 1_575.42e6 - CENTER_HZ;
    let tables = format!(
        "[front_end]\nsample_rate_hz = {rate_hz:e}\nif_hz = {if_hz}\nformat = \"cf32\"\n[receiver_clock]\nbias_s = \
         1.3e-4\n\
         drift_sps = 5e-8\n[power]\ncn0_dbhz = 45\n[fidelity]\nknot_tolerance_cycles = 1e-5\n"
    );
    run::scene(duration_s, &tables)
}
const TURN: f64 = 18_446_744_073_709_551_616.0;

fn transmitter(scene: &Scene, sv: Sv) -> Transmitter {
    Transmitter::new(scene, sv, &L1_CA, Edge::Nearest).unwrap().unwrap()
}

/// `numerator / denominator` modulo one, in 2^-64 turn.
fn turns(numerator: u128, denominator: u128) -> u64 {
    (((numerator % denominator) << 64) / denominator) as u64
}

/// Cycles nearest to zero.
fn signed(turns: u64) -> f64 {
    turns as i64 as f64 / TURN
}

#[test]
fn code_and_carrier_stay_together_for_an_hour_and_the_ionosphere_parts_them_by_twice_its_delay() {
    let mut scene = scene(25e6, 3600.0);
    let all: Vec<Sv> = scene.catalogue.satellites().collect();
    let sv = all.into_iter().find(|sv| truth::in_view(&scene, *sv, scene.clock.start).unwrap()).unwrap();
    for ionosphere in [false, true] {
        if ionosphere {
            let model = rinex::embedded().unwrap().klobuchar.unwrap();
            scene.effects.push(Box::new(KlobucharIonosphere::of_gps(model)));
        }
        let mut transmitter = transmitter(&scene, sv);
        let (mut worst, mut checked) = (Worst::default(), 0);
        // Some 300 runs, at all places of their knots.
        for first in (0..scene.samples).step_by(73_211 * RUN as usize) {
            transmitter.prepare(&scene, first, first + RUN).unwrap();
            let (carrier, code) = transmitter.phases(&scene, first).unwrap();
            // Pseudorange of the code in cycles: carrier · (reading − time sent). The start is a whole
            // second, n/25e6 readings are n · 1575.42/25 cycles, a code period is 1540 · 1023 of them and a
            // chip 1540.
            let reading = turns(u128::from(first) * 157_542, 2500);
            let sent = turns(1540 * code.phase(), 1 << 48);
            let tone = turns(u128::from(first) * 4092, 25_000);
            let parted = signed(reading.wrapping_sub(sent).wrapping_sub(tone).wrapping_add(carrier));
            let seen = truth::seen(&scene, sv, &L1_CA, scene.clock.epoch(first)).unwrap().unwrap();
            let ray = seen.rays[0];
            let expected = (ray.code_delay_s - ray.carrier_delay_s) * L1_CA.centre_hz();
            let error = parted - expected;
            worst.take((error - error.round()).abs(), || format!("{sv}, sample {first}"));
            checked += 1;
        }
        let figure = if ionosphere { "parted by other than 2I" } else { "code less carrier" };
        CASE.at_most(figure, worst, 1.1e-5, "cycle");
        // 0.1 mm is 5.3e-4 cycle; what remains is the place of the code, 1e-10 chip or 1.5e-7 cycle, and two
        // knots' errors of 5e-6 cycle at most.
        assert!(checked > 250, "{checked}");
    }
}

/// Carrier at sample `n` in 2^-64 turn: `IF · n / rate − carrier · (reading − true time + light time −
/// satellite clock)`, the first two terms in integers of 1e-18 s.
fn carrier(scene: &Scene, sv: Sv, n: u64) -> u64 {
    // 50 Msps: 2e10 units a sample. The clock of the scene: 1.3e-4 s ahead, 5e-8 s/s fast.
    let (elapsed, bias) = (u128::from(n) * 20_000_000_000, 130_000_000_000_000);
    let true_elapsed = (elapsed - bias) * 100_000_000 / 100_000_005;
    let ahead = elapsed - true_elapsed;
    let tone = turns(u128::from(n) * 4092, 50_000);
    let clocks = turns(ahead * 1_575_420_000, 1_000_000_000_000_000_000);
    let whole = (true_elapsed / 1_000_000_000_000_000_000) as i64;
    let fraction = (true_elapsed % 1_000_000_000_000_000_000) as f64 * 1e-18;
    assert_eq!(scene.clock.start.fraction(), 0.0);
    let received = Epoch::new(scene.clock.start.seconds() + whole, fraction);
    let motion = scene.trajectory.at(0.0);
    let emission = sky::emission(&scene.catalogue, sv, received, &motion).unwrap().unwrap();
    let geometry = (emission.travel_s - emission.satellite_clock_s) * 1_575.42e6;
    let geometry = ((geometry - geometry.floor()) * TURN) as u64;
    tone.wrapping_sub(clocks).wrapping_sub(geometry)
}

#[test]
fn after_a_day_and_after_thirty_days_at_50_msps_the_carrier_is_within_a_millionth_of_a_cycle() {
    for days in [1, 30] {
        // Sample 0 lies so many days before the morning of 2010-07-01, of which there are orbits.
        let mut scene = scene(50e6, 1.0);
        let morning = Epoch::parse("2010-07-01T09:00:00").unwrap();
        scene.clock.start = Epoch::new(morning.seconds() - days * 86_400, 0.0);
        scene.fidelity.code_edge = CodeEdge::Nearest;
        scene.fidelity.knot_tolerance_cycles = 1e-6;
        let first = days as u64 * 86_400 * 50_000_000 / RUN * RUN;
        scene.samples = first + (1 << 32);
        let satellites: Vec<Sv> = scene.catalogue.satellites().collect();
        let (mut worst, mut checked) = (Worst::default(), 0);
        for sv in satellites {
            let mut transmitter = transmitter(&scene, sv);
            for n in (0..40).map(|k| first + k * 4243 * RUN) {
                transmitter.prepare(&scene, n, n + RUN).unwrap();
                if !transmitter.in_view(&scene, n) {
                    continue;
                }
                let (turns, _) = transmitter.phases(&scene, n).unwrap();
                worst.take(signed(turns.wrapping_sub(carrier(&scene, sv, n))).abs(), || format!("{sv}, sample {n}"));
                checked += 1;
            }
        }
        // Half the knots' tolerance, and the floor of `f64`: coordinates of 2.6e7 m resolve 3.7e-9 m or 2e-8
        // cycle, the sum of a delay and a month's drift, 4e8 cycles, 6e-8, a few of each on both sides.
        CASE.at_most(&format!("carrier after {days} d at 50 Msps, to integers"), worst, 1e-6, "cycle");
        assert!(checked > 200, "{checked}");
    }
}

#[test]
fn at_sample_two_to_the_fortieth_a_stream_from_nearby_and_a_seek_have_the_same_phases() {
    let mut scene = scene(50e6, 1.0);
    // 2^40 samples are 6 h 6 min 30 s.
    scene.clock.start = Epoch::parse("2010-07-01T03:00:00").unwrap();
    let first = 1_u64 << 40;
    scene.samples = first + (1 << 32);
    let satellites: Vec<Sv> = scene.catalogue.satellites().collect();
    let (mut same, mut checked) = (0, 0);
    for sv in satellites {
        let mut streamed = transmitter(&scene, sv);
        // From 21 s before, across a boundary of the grid, in batches of 0.1 s.
        for from in (first - (1 << 30)..first + RUN).step_by(1200 * RUN as usize) {
            streamed.prepare(&scene, from, from + 1200 * RUN).unwrap();
        }
        let mut sought = transmitter(&scene, sv);
        sought.prepare(&scene, first, first + 8 * RUN).unwrap();
        for n in (0..8).map(|k| first + k * RUN) {
            assert_eq!(streamed.in_view(&scene, n), sought.in_view(&scene, n));
            if sought.in_view(&scene, n) {
                same += usize::from(streamed.phases(&scene, n) == sought.phases(&scene, n));
                assert!(sought.phases(&scene, n).is_some());
                checked += 1;
            }
        }
    }
    assert!(checked >= 40, "{checked}");
    case(6, "start at any sample", CA).all("phases at sample 2^40, sought against streamed", same, checked);
}
