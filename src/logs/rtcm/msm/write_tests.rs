use super::*;
use crate::observed::{Calendar, Event, Locks};
use crate::rtcm;

/// Numbers from 0 to 1 in an order that looks like chance.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

const LABEL: (u32, f64) = (2134, 46_258.25);

fn label() -> Epoch {
    Epoch::from_week(LABEL.0, LABEL.1)
}

fn observed(sv: Sv, code: &'static str, range_m: f64) -> Observed {
    let hz = signals::carrier_hz(sv, code, None).unwrap_or(1.5e9);
    Observed {
        sv,
        code,
        pseudorange_m: Some(range_m),
        carrier_cycles: Some(range_m / SPEED_OF_LIGHT_MPS * hz + 1e6),
        doppler_hz: Some(-235.1234 / SPEED_OF_LIGHT_MPS * hz),
        cn0_dbhz: Some(44.44),
        lock_s: Some(12.345),
        lost_lock: false,
        half_cycle_ambiguous: false,
    }
}

fn written(level: u64, epoch: &ObservedEpoch, arcs: &mut BTreeMap<u64, Arcs>) -> (Vec<Vec<u8>>, Vec<Refused>) {
    let (mut all, mut refused) = (Vec::new(), Vec::new());
    for (tens, ..) in signals::SYSTEMS {
        let number = 10 * tens + level;
        let kind = Kind::of(number).unwrap();
        all.extend(drafts(kind, epoch, arcs.entry(number).or_default(), &mut refused));
    }
    let count = all.len();
    (all.iter().enumerate().map(|(place, draft)| draft.write(7, place + 1 < count)).collect(), refused)
}

/// Values of messages, each with its time.
fn read(bodies: &[Vec<u8>], near: Epoch) -> Vec<(Epoch, Observed)> {
    let (mut calendar, mut locks) = (Calendar::new(Some(near)), Locks::default());
    let events = bodies.iter().map(|body| rtcm::read(&rtcm::framed(body), &mut calendar, &mut locks).event);
    let mut found = Vec::new();
    for event in events {
        let Some(Event::Observations(epoch)) = event else { panic!("{event:?}") };
        found.extend(epoch.values.into_iter().map(|value| (epoch.label, value)));
    }
    found
}

fn all_signals() -> Vec<(Sv, &'static str)> {
    let mut all = Vec::new();
    for (_, system, _) in signals::SYSTEMS {
        for bit in 1..=64 {
            let of_it = (1..=32).filter_map(|signal| signals::code(system, signal));
            if let Some(sv) = signals::satellite(system, bit) {
                all.extend(of_it.map(|code| (sv, code)));
            }
        }
    }
    all
}

#[test]
fn every_signal_of_every_satellite_is_read_back_to_half_a_step() {
    let mut chance = Chance(1);
    let all = all_signals();
    let values = all.iter().map(|(sv, code)| {
        let range_m = 2.4e7 + 1e6 * f64::from(sv.number) / 64.0 + 80.0 * chance.next();
        observed(*sv, code, range_m)
    });
    let epoch = ObservedEpoch { label: label(), values: values.collect() };
    // Steps of code and carrier in milliseconds, and of C/N0.
    for (level, code_ms, carrier_ms, power) in [
        (4, 2_f64.powi(-24), 2_f64.powi(-29), 1.0),
        (5, 2_f64.powi(-24), 2_f64.powi(-29), 1.0),
        (6, 2_f64.powi(-29), 2_f64.powi(-31), 0.0625),
        (7, 2_f64.powi(-29), 2_f64.powi(-31), 0.0625),
    ] {
        let (bodies, refused) = written(level, &epoch, &mut BTreeMap::new());
        assert_eq!(refused, []);
        let found = read(&bodies, label());
        assert_eq!(found.len(), all.len());
        for own in &epoch.values {
            let (at, other) = found.iter().find(|(_, other)| (other.sv, other.code) == (own.sv, own.code)).unwrap();
            assert!(at.since(label()).abs() < 1e-9, "{} {at}", own.sv);
            let off_m = other.pseudorange_m.unwrap() - own.pseudorange_m.unwrap();
            assert!(off_m.abs() < 0.501 * code_ms * MS_M, "{level} {} {}: {off_m}", own.sv, own.code);
            let cycles = own.carrier_cycles.unwrap() - other.carrier_cycles.unwrap();
            let wave_m = SPEED_OF_LIGHT_MPS / signals::carrier_hz(own.sv, own.code, None).unwrap();
            assert!((cycles - cycles.round()).abs() * wave_m < 0.501 * carrier_ms * MS_M, "{level} {}", own.sv);
            assert_eq!(other.doppler_hz.is_some(), level % 2 == 1);
            if let Some(hz) = other.doppler_hz {
                assert!((hz - own.doppler_hz.unwrap()).abs() * wave_m < 0.51e-4, "{} {hz}", own.sv);
            }
            assert!((other.cn0_dbhz.unwrap() - 44.44).abs() <= power / 2.0);
            // The largest bound below 12.345 s.
            assert_eq!(other.lock_s, Some(if level < 6 { 8.192 } else { 12.288 }));
        }
    }
}

#[test]
fn more_cells_than_a_mask_holds_make_several_messages_and_the_last_one_says_so() {
    let epoch = ObservedEpoch {
        label: label(),
        values: all_signals().into_iter().map(|(sv, code)| observed(sv, code, 2.2e7)).collect(),
    };
    let (bodies, _) = written(7, &epoch, &mut BTreeMap::new());
    let flags: Vec<bool> = bodies.iter().map(|body| body[6] >> 1 & 1 == 1).collect();
    let (last, others) = flags.split_last().unwrap();
    assert!(!last && others.iter().all(|more| *more), "{flags:?}");
    assert!(bodies.iter().all(|body| body.len() <= 1023));
    // 32 satellites of 15 signals: 4 of them in a message.
    assert_eq!(bodies.iter().filter(|body| body[..2] == [0x43, 0x50]).count(), 8);
}

#[test]
fn a_label_between_milliseconds_moves_code_and_carrier_alike() {
    for offset_s in [-4.9e-4, -2e-8, 3.3e-4] {
        let at = label().plus_s(offset_s);
        let own = observed(Sv::gps(7), "1C", 2.2e7);
        let epoch = ObservedEpoch { label: at, values: vec![own.clone()] };
        let (bodies, _) = written(7, &epoch, &mut BTreeMap::new());
        let (time, other) = read(&bodies, at).remove(0);
        assert!(time.since(label()).abs() < 1e-9);
        let moved_m = other.pseudorange_m.unwrap() - own.pseudorange_m.unwrap();
        assert!((moved_m + offset_s * SPEED_OF_LIGHT_MPS).abs() < 1e-3, "{moved_m}");
        let cycles = other.carrier_cycles.unwrap() - own.carrier_cycles.unwrap() + offset_s * 1_575.42e6;
        assert!((cycles - cycles.round()).abs() < 1e-3, "{cycles}");
    }
}

#[test]
fn whole_cycles_stay_while_a_carrier_is_locked_and_change_when_it_slips_or_drifts_too_far() {
    let mut arcs = BTreeMap::new();
    let mut run = |second: u32, ahead_m: f64, lock_s: f64, lost_lock: bool| {
        let mut own = observed(Sv::gps(7), "1C", 2.2e7);
        own.carrier_cycles = Some((2.2e7 + ahead_m) / SPEED_OF_LIGHT_MPS * 1_575.42e6);
        (own.lock_s, own.lost_lock) = (Some(lock_s), lost_lock);
        let at = label().plus_s(f64::from(second));
        let (bodies, _) = written(7, &ObservedEpoch { label: at, values: vec![own.clone()] }, &mut arcs);
        let other = read(&bodies, at).remove(0).1;
        ((own.carrier_cycles.unwrap() - other.carrier_cycles.unwrap()).round(), other.lock_s.unwrap())
    };
    let (first, _) = run(0, 10.0, 5.0, false);
    let (second, lock_s) = run(1, 1000.0, 6.0, false);
    assert_eq!((second, lock_s), (first, 5.888));
    // Beyond 1171 m the lock begins again.
    let (third, lock_s) = run(2, 1400.0, 7.0, false);
    assert!(third > first && lock_s == 0.0);
    let (fourth, lock_s) = run(3, 1400.0, 8.0, false);
    assert_eq!((fourth, lock_s), (third, 0.992));
    // A lock that is younger than the epoch before, and one that is said to be lost.
    assert_eq!(run(4, 5.0, 0.5, false), (0.0 + (5.0 / SPEED_OF_LIGHT_MPS * 1_575.42e6_f64).round(), 0.496));
    let before = run(5, 5.0, 1.5, false).0;
    assert_ne!(run(6, 800.0, 2.5, true).0, before);
}

#[test]
fn any_record_gives_a_message_that_is_read_or_a_reason_by_name() {
    let mut chance = Chance(3);
    let special = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e-9, 1e300, 7.6e7, 7.65e7, 64.0, 100.0];
    let systems = gnss::satellite::System::LETTERS;
    let codes = ["1C", "2L", "5Q", "7D", "9A", "XX", "", "1P", "5A", "6I"];
    for round in 0..4000 {
        let mut any = |scale: f64| -> Option<f64> {
            match (8.0 * chance.next()) as usize {
                0 => None,
                1 => special.get((chance.next() * special.len() as f64) as usize).copied(),
                _ => Some(scale * chance.next()),
            }
        };
        let count = (40.0 * any(1.0).filter(|one| (0.0..1.0).contains(one)).unwrap_or(0.5)) as usize;
        let mut values = Vec::new();
        for _ in 0..count {
            let pick = |value: Option<f64>, of: usize| (value.unwrap_or(0.0).clamp(0.0, 0.999) * of as f64) as usize;
            let sv = Sv { system: systems[pick(any(1.0), 7)].0, number: pick(any(1.0), 70) as u8 };
            let code = codes[pick(any(1.0), codes.len())];
            values.push(Observed {
                sv,
                code,
                pseudorange_m: any(8e7),
                carrier_cycles: any(4e8),
                doppler_hz: any(1e5),
                cn0_dbhz: any(70.0),
                lock_s: any(1e4),
                lost_lock: any(1.0) > Some(0.5),
                half_cycle_ambiguous: any(1.0) > Some(0.5),
            });
        }
        let epoch = ObservedEpoch { label: label().plus_s(0.1 * f64::from(round)), values };
        let level = 4 + u64::from(round as u32 % 4);
        let (bodies, refused) = written(level, &epoch, &mut BTreeMap::new());
        let found = if bodies.is_empty() { Vec::new() } else { read(&bodies, epoch.label) };
        for (_, other) in &found {
            assert!(epoch.values.iter().any(|own| (own.sv, own.code) == (other.sv, other.code)));
            assert!(other.pseudorange_m.is_none_or(|metres| (-1e3..7.7e7).contains(&metres)));
        }
        assert!(refused.iter().all(|reason| reason.to_string().contains(": ")), "{refused:?}");
        assert!(epoch.values.is_empty() || !found.is_empty() || !refused.is_empty());
    }
}

#[test]
fn indicators_are_the_largest_whose_bound_is_not_above() {
    for (number, most) in [(1074, 15), (1077, 704)] {
        let kind = Kind::of(number).unwrap();
        for indicator in 0..=most {
            let lock_s = 1e-3 * kind.lock_ms(indicator) as f64;
            assert_eq!(kind.indicator(lock_s), indicator, "{number}");
            assert_eq!(kind.indicator((lock_s - 1e-3).max(0.0)), (indicator - 1).max(0), "{number}");
        }
        assert_eq!(kind.indicator(1e12), most);
    }
}
