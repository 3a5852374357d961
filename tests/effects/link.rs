//! Strength, antenna and attitude, through samples and the receiver.

use generator::ray::{Effect, Ray, Sight};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;
use receiver::track::TrackingSettings;

use super::single::{scene, track};

/// A satellite that is 10 dB stronger for two seconds and fades to its strength over the third, so that the
/// pull-in, whose threshold lies near 31 dB-Hz, is no part of what is measured.
struct Beginning {
    start: Epoch,
}

impl Effect for Beginning {
    fn name(&self) -> &'static str {
        "beginning"
    }

    fn describe(&self) -> String {
        "10 dB more for two seconds".to_owned()
    }

    fn act(&self, sight: &Sight, _signal: &Signal, rays: &mut Vec<Ray>) {
        let more = (3.0 - sight.received.since(self.start)).clamp(0.0, 1.0);
        rays.iter_mut().for_each(|ray| ray.cn0_hz *= libm::pow(10.0, more));
    }
}

/// Mean difference between measured and true C/N0 after six seconds, less what means over samples at 2.6 Msps
/// leave of a BPSK signal, 1 − d/3 of d = 0.393 chips; and the true one.
fn cn0_error_db(tables: &str, settings: &TrackingSettings) -> (f64, f64) {
    let mut scene = scene(Sv::gps(23), 16.0, tables);
    scene.effects.push(Box::new(Beginning { start: scene.clock.start }));
    let (pairs, _directory) = track(&scene, settings);
    let late: Vec<_> = pairs.iter().filter(|(truth, _)| truth.sample > 6 * 2_600_000).collect();
    assert!(late.len() > 80, "{} measurements", late.len());
    let sum: f64 = late.iter().map(|(truth, m)| m.cn0_dbhz - truth.cn0_dbhz).sum();
    let edges_db = 10.0 * libm::log10(1.0 - 1.023 / 2.6 / 3.0);
    (sum / late.len() as f64 - edges_db, late[0].0.cn0_dbhz)
}

#[test]
fn the_receiver_s_carrier_to_noise_ratio_is_the_budget_s_from_30_to_55_dbhz() {
    // Weak signals need a narrow loop: 10 Hz at 30 dB-Hz jitter by 0.1 rad.
    let settings = TrackingSettings {
        pll_bandwidth_hz: 10.0,
        integration: 10,
        fll_bandwidth_hz: 3.0,
        ..TrackingSettings::default()
    };
    let mut worst = 0.0_f64;
    for loss_db in [-7.0, -3.0, 2.0, 7.0, 12.0, 16.0, 18.0] {
        let tables = format!("[power]\nkind = \"link_budget\"\nloss_db = {loss_db}\n[noise]\n");
        let (error_db, cn0_dbhz) = cn0_error_db(&tables, &settings);
        println!("{cn0_dbhz:.2} dB-Hz: {error_db:+.3} dB");
        worst = worst.max(error_db.abs());
        assert!((30.0..57.0).contains(&cn0_dbhz));
        // A second's estimate has 0.23 dB rms and −0.1 dB of bias at 30 dB-Hz; ten of them 0.08.
        assert!(error_db.abs() < 0.3, "{cn0_dbhz}: {error_db}");
    }
}

#[test]
fn a_spinning_antenna_is_followed_and_counted_turn_by_turn() {
    let spin_hz = 100.0;
    let tables = format!(
        "[attitude]\nkind = \"fixed\"\nyaw_deg = 125\npitch_deg = 80\nspin_hz = {spin_hz}\nboresight = [1, 0, -0.2]\n\
         [power]\ncn0_dbhz = 50\n"
    );
    let settings = TrackingSettings { pll_bandwidth_hz: 60.0, integration: 1, ..TrackingSettings::default() };
    let (pairs, _directory) = track(&scene(Sv::gps(23), 4.0, &tables), &settings);
    let ((early, first), (late, last)) = (&pairs[pairs.len() / 2], &pairs[pairs.len() - 1]);
    let measured = last.carrier_cycles - first.carrier_cycles;
    let truth = late.carrier_cycles - early.carrier_cycles;
    // Turns between instants a whole number of spins apart; the loop lags by the same at both.
    assert!((measured - truth).abs() < 0.05, "{measured} {truth}");
    let still = tables.replace("spin_hz = 100", "spin_hz = 0");
    let (unspun, _directory) = track(&scene(Sv::gps(23), 4.0, &still), &settings);
    let find = |sample: u64| unspun.iter().find(|(truth, _)| truth.sample == sample).unwrap().0.carrier_cycles;
    let turns = truth - (find(late.sample) - find(early.sample));
    let elapsed_s = (late.sample - early.sample) as f64 / 2.6e6;
    // The satellite stands near the nose: the carrier runs ahead by a cycle a turn. It moves 1e-4 rad a
    // second.
    assert!((turns + spin_hz * elapsed_s).abs() < 1e-2, "{turns} in {elapsed_s} s");
}
