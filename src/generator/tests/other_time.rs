//! Signals of a spoofer that claims another time, beside those of a scene of its own at that time.

use std::collections::BTreeSet;
use std::path::Path;

use crate::message::{self, Slot};
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use crate::spoof::Constellation;
use crate::synth::Edge;
use crate::synth::chips::CodeTime;
use crate::transmit::Transmitter;
use crate::truth;
use gnss::gps::l1ca::L1_CA;
use gnss::gps::lnav::LNAV;
use gnss::record::NavigationRow;
use gnss::satellite::Sv;
use gnss::time::GPST;

const RATE_HZ: u64 = 4_000_000;

fn scene(start: &str, more: &str) -> Scene {
    let text = format!(
        "name = \"x\"\nstart = {start}\nduration_s = 60\n\
         motion = {{ kind = \"static\", latitude_deg = 26.5, longitude_deg = 80.2, height_m = 130 }}\n\
         receiver_clock = {{ bias_s = 1e-4, drift_sps = 1e-7 }}\nfront_end = {{ sample_rate_hz = {RATE_HZ} }}\n\
         {more}"
    );
    Scenario::parse(&text, "x").unwrap().compose(Path::new("."), &Overrides::default()).unwrap().0
}

fn spoofed(keys: &str) -> Scene {
    scene("2010-07-01T10:00:00", &format!("[[spoofer]]\npower_db = 3\n{keys}\n"))
}

/// Parameters with the seconds at which their sets were due.
type Parameters = BTreeSet<(u32, NavigationRow)>;

/// Phases of the carrier and of the code at some samples, and the parameters sent in the first 40 s.
fn sent(scene: &Scene, from: &Constellation, sv: Sv) -> (Vec<(u64, CodeTime)>, Parameters) {
    let from = std::sync::Arc::new(from.clone());
    let mut transmitter = Transmitter::of(scene, from, sv, &L1_CA, Edge::Nearest).unwrap().unwrap();
    let mut phases = Vec::new();
    for second in 0..40 {
        let first = second * RATE_HZ;
        transmitter.prepare_alone(scene, first, first + RATE_HZ).unwrap();
        phases.extend([0, RATE_HZ / 3].iter().filter_map(|more| transmitter.phases(scene, first + more)));
    }
    (phases, transmitter.symbols.navigation)
}

#[test]
fn a_spoofer_of_another_time_sends_what_the_satellites_of_a_scene_that_starts_then_send() {
    // 10064 days.
    let years = "time_offset_s = 869529600\nnavigation_moved_to = 2038-01-19";
    for (keys, start, moved) in [
        ("time_offset_s = 7200", "2010-07-01T12:00:00", ""),
        ("time_offset_s = -900", "2010-07-01T09:45:00", ""),
        (years, "2038-01-19T10:00:00", "[navigation]\nmoved_to = 2038-01-19\n"),
    ] {
        let (mine, theirs) = (spoofed(keys), scene(start, moved));
        let (spoofer, authentic) = (&mine.spoofers[0], Constellation::authentic());
        let ahead_s = theirs.clock.start.since(mine.clock.start);
        let mut seen = 0;
        for sv in mine.satellites_of(spoofer) {
            if !truth::in_view(&theirs, sv, theirs.clock.start).unwrap() {
                continue;
            }
            let sample = 7 * RATE_HZ;
            let (own, ..) = truth::observe(&mine, spoofer, sv, &L1_CA, sample, 0.0).unwrap().unwrap();
            let (then, ..) = truth::observe(&theirs, &authentic, sv, &L1_CA, sample, 0.0).unwrap().unwrap();
            // The time of sending is that of the other scene; the receiver's own clock is not.
            assert_eq!((own.sent_s, own.sent_fraction_s), (then.sent_s, then.sent_fraction_s), "{keys} {sv}");
            assert_eq!((own.carrier_cycles, own.doppler_hz), (then.carrier_cycles, then.doppler_hz), "{keys} {sv}");
            let later_m = then.pseudorange_m - own.pseudorange_m;
            assert!(
                (later_m / gnss::earth::SPEED_OF_LIGHT_MPS - ahead_s).abs() <= 1e-15 * ahead_s.abs(),
                "{keys} {sv}"
            );
            let [(here, messages), (there, same)] = [sent(&mine, spoofer, sv), sent(&theirs, &authentic, sv)];
            assert!(messages == same && here.len() == there.len() && here.len() == 80, "{keys} {sv}");
            for ((carrier, code), (other, of_other)) in here.into_iter().zip(there) {
                // Knots lie elsewhere, for a spoofer is switched on.
                let turns = carrier.wrapping_sub(other) as i64 as f64 / 18_446_744_073_709_551_616.0;
                assert!(turns.abs() < 2.0 * mine.fidelity.knot_tolerance_cycles, "{keys} {sv}: {turns}");
                let steps = code.steps() - of_other.steps();
                assert!(code.period == of_other.period && steps.abs() < 1e-6, "{keys} {sv}: {steps}");
            }
            seen += 1;
        }
        assert!(seen > 5, "{keys}: {seen}");
        let [claimed, row] = [truth::trajectory(&mine, spoofer, 5), truth::trajectory(&theirs, &authentic, 5)];
        assert_eq!((claimed.gps_s, claimed.gps_fraction_s), (row.gps_s, row.gps_fraction_s));
        assert!((row.clock_bias_s - claimed.clock_bias_s - ahead_s).abs() <= 1e-15 * ahead_s.abs());
    }
}

/// Parameters of a constellation's messages of a satellite over 750 s, by name.
fn parameters(scene: &Scene, constellation: usize, sv: Sv, name: &str) -> BTreeSet<i64> {
    let sender = scene.messages.of_constellation(constellation).of(&LNAV).unwrap();
    let faults: Vec<_> = scene.message_faults.iter().filter(|f| f.constellation == constellation).cloned().collect();
    let first = LNAV.unit_at(scene.clock.start.seconds());
    let units = (first..first + 125).filter_map(|unit| {
        let slot = Slot { message: &LNAV, time: &GPST, unit };
        let set = scene.catalogue.sent_at(sv, slot.start())?;
        Some(message::unit(&faults, sender, [set, set], &slot).unwrap())
    });
    let rows = units.filter_map(|sent| (LNAV.parameters)(&sent.symbols));
    let rows = rows.flat_map(|(_, parameters)| NavigationRow::each(sv, LNAV.name, 0, parameters).collect::<Vec<_>>());
    rows.filter(|row| row.parameter == name).map(|row| row.raw).collect()
}

#[test]
fn a_spoofer_states_leap_seconds_and_faults_of_its_own_and_leaves_the_true_messages() {
    let fault = "[[message_fault]]\nkind = \"parameter\"\nspoofer = 1\nsatellites = [\"G13\"]\nparameter = \
                 \"eccentricity\"\nadd = 0.25\n";
    let scene = spoofed(&format!("leap_seconds = -127\n{fault}"));
    let one = |constellation, name| {
        let found = parameters(&scene, constellation, Sv::gps(13), name);
        assert_eq!(found.len(), 1, "{name}: {found:?}");
        found.first().copied().unwrap()
    };
    assert_eq!(["utc_leap_s", "utc_leap_after_s"].map(|name| one(1, name)), [-127, -127]);
    assert_eq!(one(0, "utc_leap_s"), 15);
    // A quarter, by 2^-33 each.
    assert_eq!(one(1, "eccentricity") - one(0, "eccentricity"), 1 << 31);
}

#[test]
fn a_claimed_time_without_data_or_with_a_fraction_is_refused_with_the_cure() {
    let refused = |keys: &str| {
        let text = format!(
            "name = \"x\"\nstart = 2010-07-01T10:00:00\nduration_s = 60\nfront_end = {{ sample_rate_hz = 4e6 }}\n\
             motion = {{ kind = \"static\", latitude_deg = 26.5, longitude_deg = 80.2, height_m = 130 }}\n\
             [[spoofer]]\npower_db = 3\n{keys}\n"
        );
        let scenario = Scenario::parse(&text, "x");
        let composed = scenario.and_then(|s| s.compose(Path::new("."), &Overrides::default()));
        composed.err().unwrap().to_string()
    };
    assert!(refused("time_offset_s = 0.5").contains("a whole number of seconds"));
    assert!(refused("leap_seconds = 1.5").contains("a whole number of seconds"));
    assert!(refused("time_offset_s = 60\nreplay_s = 3").contains("because replay_s is given"));
    let far = refused("time_offset_s = 63072000");
    assert!(far.contains("spoofer.time_offset_s") && far.contains("navigation_moved_to"), "{far}");
    assert!(refused("navigation = \"none.rnx\"").contains("none.rnx"));
    let stranger = refused("[[message_fault]]\nkind = \"bit_errors\"\nspoofer = 2\nrate = 0.1");
    assert!(stranger.contains("message_fault.spoofer") && stranger.contains("one of the 1"), "{stranger}");
}
