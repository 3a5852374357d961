use super::*;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::gps::l1ca::L1_CA;
use gnss::rinex;
use gnss::signal::synthetic::QUADRATURE;

fn day() -> Vec<Ephemeris> {
    rinex::embedded().unwrap().ephemerides
}

fn week(tow_s: f64) -> Epoch {
    Epoch::from_week(1590, tow_s)
}

#[test]
fn the_rogue_record_of_the_real_day_and_no_other_is_left_out() {
    let (catalogue, warnings) = Catalogue::new(day());
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("G01") && warnings[0].contains("IODE 90"), "{warnings:?}");
    assert_eq!(catalogue.satellites().count(), 32);
    for hour in 0..24 {
        let at = week(345_600.0 + 3600.0 * f64::from(hour) + 600.0);
        let sent = catalogue.sent_at(Sv::gps(1), at).unwrap();
        assert_ne!((sent.iode, sent.health), (90, 0));
        assert!(!catalogue.healthy(Sv::gps(1), at));
    }
}

#[test]
fn signals_of_a_satellite_differ_by_their_group_delays_and_pass_on_as_smoothly_as_the_clock() {
    let (catalogue, _) = Catalogue::new(day());
    for sv in catalogue.satellites() {
        let Some(timeline) = catalogue.satellites.get(&sv) else { continue };
        for pair in timeline.spans.windows(2) {
            let (Some(before), Some(after)) = (pair[0].set, pair[1].set) else { continue };
            let from = pair[1].from;
            // (f_L1/f)² on 1176.45 MHz is (154/115)².
            let ahead_s = |set: usize| timeline.sets[set].tgd_s * (1.0 - 154.0 * 154.0 / (115.0 * 115.0));
            let found_s = |after_s: f64| catalogue.signal_clock_s(sv, from.plus_s(after_s), &QUADRATURE);
            let middle_s = 0.5 * (ahead_s(before) + ahead_s(after));
            for (found_s, expected_s) in
                [(found_s(-400.0), ahead_s(before)), (found_s(0.0), middle_s), (found_s(400.0), ahead_s(after))]
            {
                assert!((found_s - expected_s).abs() < 1e-20, "{sv} {from}: {found_s} for {expected_s}");
            }
            assert_eq!(catalogue.signal_clock_s(sv, from, &L1_CA), 0.0);
        }
    }
}

#[test]
fn with_one_neighbour_only_both_contradicting_sets_go() {
    let pair: Vec<_> =
        day().into_iter().filter(|e| e.sv == Sv::gps(1) && (366_000..375_000).contains(&e.toe.tow_whole_s())).collect();
    let rogue_and_one: Vec<_> = pair.iter().filter(|e| e.toe.tow_whole_s() != 367_184).cloned().collect();
    assert_eq!(rogue_and_one.len(), 2);
    let (catalogue, warnings) = Catalogue::new(rogue_and_one.clone());
    assert_eq!((catalogue.satellites().count(), warnings.len()), (0, 2));
    // Where one of two is no GPS orbit at all, the other stays.
    let mut odd = rogue_and_one;
    odd[0].eccentricity = 0.2;
    let kept = odd[1].clone();
    let (catalogue, warnings) = Catalogue::new(odd);
    assert_eq!(warnings.len(), 1);
    assert_eq!(catalogue.sent_at(kept.sv, kept.toe), Some(&kept));
}

#[test]
fn neither_order_nor_repetition_of_records_matters() {
    let mut shuffled = day();
    shuffled.reverse();
    let half = shuffled.len() / 2;
    shuffled.rotate_left(half / 3);
    shuffled.extend(day());
    let (one, warnings) = Catalogue::new(day());
    let (other, same) = Catalogue::new(shuffled);
    assert_eq!(warnings, same);
    for sv in one.satellites() {
        for quarter in 0..100 {
            let at = week(345_000.0 + 900.0 * f64::from(quarter));
            assert_eq!(one.sent_at(sv, at), other.sent_at(sv, at));
            assert_eq!(one.truth(sv, at).unwrap(), other.truth(sv, at).unwrap());
        }
    }
}

#[test]
fn sets_change_at_the_two_hour_boundary_and_end_with_their_fit_interval() {
    let (catalogue, _) = Catalogue::new(day());
    let sv = Sv::gps(2);
    let toe = |tow_s: f64| catalogue.sent_at(sv, week(tow_s)).map(|set| set.toe.tow_whole_s());
    assert_eq!(toe(374_399.9), Some(374_400));
    assert_eq!(toe(374_400.0), Some(381_600));
    // Nothing is sent before the first ephemeris's window nor after the last one's.
    assert_eq!(toe(345_600.0 - 7200.5), None);
    assert_eq!(toe(345_600.0 + 86_400.0 + 14_400.0), None);
    assert!(catalogue.truth(sv, week(300_000.0)).unwrap().is_none());
    assert!(catalogue.truth(Sv::gps(33), week(374_400.0)).unwrap().is_none());
}

#[test]
fn an_upload_between_boundaries_takes_over_when_it_was_first_received() {
    let (catalogue, _) = Catalogue::new(day());
    // PRN 1: toe 359 984 was first received at 359 160, toe 360 000 had been sent since 352 800.
    let toe = |tow_s: f64| catalogue.sent_at(Sv::gps(1), week(tow_s)).unwrap().toe.tow_whole_s();
    assert_eq!((toe(359_159.0), toe(359_160.0), toe(360_000.0)), (360_000, 359_984, 367_184));
}

#[test]
fn the_truth_is_smooth_across_every_hand_over_of_the_day() {
    let (catalogue, _) = Catalogue::new(day());
    let mut fastest: f64 = 0.0;
    for sv in catalogue.satellites() {
        for k in 0..(80_000 / 20) {
            let at = week(346_000.0 + 20.0 * f64::from(k));
            if !catalogue.healthy(sv, at) {
                continue;
            }
            let get = |dt: f64| catalogue.truth(sv, at.plus_s(dt)).unwrap();
            let (Some((a, ca)), Some((b, cb))) = (get(0.0), get(0.1)) else { continue };
            // Trapezoid rule over 0.1 s: h³/12 |jerk| < 1e-3 / 12 * 2e-4 m/s³ = 2e-8 m, plus
            // rounding: angles to 4e-16 rad at 2.7e7 m, up to five of them at either end.
            let moved = b.position_m - a.position_m - (a.velocity_mps + b.velocity_mps) * 0.05;
            assert!(moved.norm() < 1.2e-7, "{sv} {at}: {moved}");
            let ticked = cb.offset_s - ca.offset_s - (ca.drift + cb.drift) * 0.05;
            assert!(ticked.abs() < 1e-17, "{sv} {at}: {ticked}");
            // Acceleration in the rotating frame: gravity 0.57 plus Coriolis 2 Ω v 0.56 m/s².
            assert!((b.velocity_mps - a.velocity_mps).norm() < 0.1 * 1.2, "{sv} {at}");
            // What the blend adds to the broadcast orbit's own motion.
            let set = catalogue.sent_at(sv, at).unwrap();
            let own = set.state(at).unwrap().velocity_mps;
            let own_clock = set.clock_l1(at).unwrap().drift;
            let line = a.position_m.normalize();
            let extra = line.dot(&(a.velocity_mps - own)) - (ca.drift - own_clock) * SPEED_OF_LIGHT_MPS;
            fastest = fastest.max(extra.abs());
        }
    }
    // 1 mm a tenth of a second.
    assert!(fastest < 0.010, "{fastest} m/s");
}
