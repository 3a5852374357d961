//! Weak pilots under a secondary code, whose prompts have signs that nobody knows when the phase loop begins.

use rayon::prelude::*;

use super::stream_tests::{Random, Stream};
use super::*;
use crate::acquire::Acquired;
use gnss::gps::l1ca::L1_CA;
use gnss::record::Event;
use gnss::satellite::Sv;
use gnss::signal::synthetic::QUADRATURE;
use gnss::signal::{Component, Signal};

/// A code of 1 ms under a secondary code of a satellite's own, at a tenth of the rate that others with such
/// a secondary code have.
static PILOT: Signal = Signal {
    name: "synthetic pilot",
    components: &[Component {
        secondary_code: QUADRATURE.components[1].secondary_code,
        message: None,
        ..L1_CA.components[0]
    }],
    ..L1_CA
};

/// The first second and a half of a channel that begins where a search may have left it.
fn start(seed: u64, cn0_dbhz: f64) -> (Vec<Event>, bool) {
    let mut random = Random(seed);
    let link = PILOT.link(Sv::gps(1 + random.between(0.0, 31.0) as u8));
    let mut stream = Stream::new(link, 2.6e6, seed ^ 0x5eed);
    stream.doppler_hz = random.between(-4000.0, 4000.0);
    stream.cn0_dbhz = cn0_dbhz;
    stream.sent_s = random.between(10.0, 1000.0);
    let hit = Acquired {
        sv: link.sv,
        signal: &PILOT,
        sample: 0,
        code_phase_chips: (stream.chips(0.0) + random.between(-0.25, 0.25)).rem_euclid(1023.0),
        doppler_hz: stream.doppler_hz + random.between(-60.0, 60.0),
        cn0_dbhz,
    };
    let mut channel = Channel::start(&hit, &stream.metadata(), &TrackingSettings::default());
    let mut report = Report::default();
    for _ in 0..15 {
        let block = stream.block(260_000);
        channel.advance(&block, &[], &mut report);
    }
    (report.events.iter().map(|(_, event)| *event).collect(), channel.is_tracking() && !channel.is_lost())
}

#[test]
fn a_weak_pilot_under_an_secondary_code_that_has_locked_stays_locked() {
    let starts = 80;
    for cn0_dbhz in [33.0, 35.0] {
        let all: Vec<(Vec<Event>, bool)> = (0..starts).into_par_iter().map(|run| start(7000 + run, cn0_dbhz)).collect();
        let had = |wanted: Event| all.iter().filter(|(events, _)| events.contains(&wanted)).count();
        let counts = [Event::PhaseLocked, Event::CycleSlip, Event::LossOfLock].map(had);
        let tracking = all.iter().filter(|(_, is_tracking)| *is_tracking).count();
        println!("{cn0_dbhz} dB-Hz: locked, slipped and lost {counts:?} of {starts}, {tracking} track at the end");
        assert_eq!(counts, [starts as usize, 0, 0], "{cn0_dbhz} dB-Hz");
        // A wrong place of the secondary code is ruled out after a second and a half in most.
        assert!(tracking as u64 > starts - starts / 10, "{cn0_dbhz} dB-Hz: {tracking}");
    }
}
