use super::*;
use gnss::gps::l1ca::L1_CA;
use gnss::gps::lnav::{Broadcast, LNAV};
use gnss::rinex;

/// A real ephemeris moved to be sent around `start`.
fn ephemeris(start: Epoch) -> Ephemeris {
    let day = rinex::embedded().unwrap();
    let mut set = day.ephemerides.into_iter().find(|set| set.health == 0 && set.sv == Sv::gps(5)).unwrap();
    let hour = Epoch::new(start.seconds().div_euclid(7200) * 7200, 0.0);
    (set.toe, set.toc, set.transmitted) = (hour, hour, hour);
    set
}

/// Bits of subframes from `start` on, a multiple of 6 s.
fn bits(start: Epoch, set: &Ephemeris, subframes: i64) -> Vec<bool> {
    let klobuchar = rinex::embedded().unwrap().klobuchar;
    let broadcast = Broadcast::new(klobuchar, 15, std::slice::from_ref(set), start).unwrap();
    let words = (0..subframes).flat_map(|k| broadcast.subframe(set, Epoch::new(start.seconds() + 6 * k, 0.0)).unwrap());
    words.flat_map(|word| (0..30).rev().map(move |bit| word >> bit & 1 == 1)).collect()
}

fn feed(decoder: &mut Decoder, bits: &[bool], first_period: u64, near: Epoch) -> Vec<(usize, News)> {
    let mut all = Vec::new();
    for (k, bit) in bits.iter().enumerate() {
        let soft = if *bit { -9.0 } else { 9.0 };
        let symbol = Symbol { first_period: first_period + 20 * k as u64, end: 0, soft };
        all.extend(decoder.take(&symbol, near).into_iter().map(|news| (k, news)));
    }
    all
}

fn start() -> Epoch {
    // The beginning of a frame.
    Epoch::parse("2010-07-01T08:06:00").unwrap()
}

#[test]
fn a_message_either_way_up_gives_the_time_of_every_period_and_the_ephemeris_that_was_sent() {
    let set = ephemeris(start());
    for inverted in [false, true] {
        // Begins in the middle of a subframe.
        let sent: Vec<bool> = bits(start(), &set, 10).into_iter().skip(137).map(|bit| bit != inverted).collect();
        let mut decoder = Decoder::new(&L1_CA, set.sv).unwrap();
        let news = feed(&mut decoder, &sent, 777, start());
        assert!(news.iter().any(|(_, n)| *n == News::Polarity { inverted }));
        assert!(!news.iter().any(|(_, n)| *n == News::Polarity { inverted: !inverted }));
        let decoded = news.iter().find_map(|(_, n)| if let News::Ephemeris(e) = n { Some(e) } else { None }).unwrap();
        let expected = LNAV.fields.quantised(&set).unwrap();
        assert_eq!(decoded.sqrt_a_sqrtm, expected.sqrt_a_sqrtm);
        assert_eq!((decoded.toe, decoded.m0_rad, decoded.af0_s), (expected.toe, expected.m0_rad, expected.af0_s));
        // Period 777 began 137 bits of 20 ms after the frame.
        let (whole, fraction) = decoder.time_of_week(777, 0.25).unwrap();
        assert_eq!(whole, start().tow_whole_s() + 2);
        assert!((fraction - 0.740_25).abs() < 1e-15);
        assert!(decoder.missing().is_empty());
    }
}

#[test]
fn from_any_bit_of_the_frame_on_the_ephemeris_is_whole_as_soon_as_its_three_subframes_have_come() {
    let set = ephemeris(start());
    let sent = bits(start(), &set, 15);
    for first in (0..1500).step_by(13) {
        let mut decoder = Decoder::new(&L1_CA, set.sv).unwrap();
        let news = feed(&mut decoder, &sent[first..], 40, start());
        let (last, _) = news.iter().find(|(_, n)| matches!(n, News::Ephemeris(_))).unwrap();
        // Subframes 1 to 3 begin 0, 300 and 600 bits into a frame of 1500. Each is read the first time that
        // it and the two bits before it, which its parity needs, come whole.
        let end = |begin: usize| (begin..).step_by(1500).find(|begin| *begin >= first + 2).unwrap() + 300;
        let expected = [0, 300, 600].map(end).into_iter().max().unwrap() - first;
        assert_eq!(last + 1, expected, "from bit {first}");
        assert!(expected <= 1802, "36 s and two bits: {expected}");
    }
}

#[test]
fn the_frame_is_found_in_inverted_bits_of_which_one_in_a_hundred_is_wrong() {
    let set = ephemeris(start());
    let (mut found, mut late) = (0, 0);
    for seed in 0..20_u64 {
        let mut state = seed * 7919 + 1;
        let sent: Vec<bool> = bits(start(), &set, 20)
            .into_iter()
            .map(|bit| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                bit == (state >> 33).is_multiple_of(100)
            })
            .collect();
        let mut decoder = Decoder::new(&L1_CA, set.sv).unwrap();
        let news = feed(&mut decoder, &sent, 40, start());
        if decoder.is_synchronised() {
            found += 1;
            assert_eq!(decoder.time_of_week(40, 0.0), Some((start().tow_whole_s(), 0.0)), "seed {seed}");
            assert!(!news.iter().any(|(_, n)| matches!(n, News::Polarity { inverted: false } | News::Contradiction)));
        } else {
            late += 1;
        }
    }
    // A header of 62 bits is whole with 0.54, and two of them within four subframes nearly always among
    // twenty.
    assert!(found >= 19, "{found} found, {late} not");
}

#[test]
fn noise_is_never_a_frame() {
    let mut decoder = Decoder::new(&L1_CA, Sv::gps(5)).unwrap();
    let mut state = 5_u64;
    let random: Vec<bool> = (0..200_000)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 63 == 1
        })
        .collect();
    assert!(feed(&mut decoder, &random, 0, start()).is_empty());
}

#[test]
fn time_runs_on_across_the_end_of_the_week() {
    let late = Epoch::from_week(1590, 604_800.0 - 12.0);
    let set = ephemeris(late);
    let mut decoder = Decoder::new(&L1_CA, set.sv).unwrap();
    feed(&mut decoder, &bits(late, &set, 5), 0, late);
    assert_eq!(decoder.time_of_week(11_999, 0.5).map(|t| t.0), Some(604_799));
    assert_eq!(decoder.time_of_week(12_000, 0.0), Some((0, 0.0)));
}

#[test]
fn after_lost_symbols_the_frame_is_found_again_and_the_new_polarity_told() {
    let set = ephemeris(start());
    let sent = bits(start(), &set, 6);
    let mut decoder = Decoder::new(&L1_CA, set.sv).unwrap();
    feed(&mut decoder, &sent[..700], 0, start());
    // 100 bits are missing; the rest comes upside down.
    let rest: Vec<bool> = sent[800..].iter().map(|bit| !bit).collect();
    let news = feed(&mut decoder, &rest, 16_000, start());
    assert!(news.iter().any(|(_, n)| *n == News::Polarity { inverted: true }));
    assert!(!news.iter().any(|(_, n)| *n == News::Contradiction));
    assert_eq!(decoder.time_of_week(16_000, 0.0), Some((start().tow_whole_s() + 16, 0.0)));
}

#[test]
fn a_channel_that_skipped_a_millisecond_contradicts_itself_and_starts_anew() {
    let set = ephemeris(start());
    let sent = bits(start(), &set, 8);
    let mut decoder = Decoder::new(&L1_CA, set.sv).unwrap();
    feed(&mut decoder, &sent[..700], 0, start());
    let news = feed(&mut decoder, &sent[700..], 14_001, start());
    assert!(news.iter().any(|(_, n)| *n == News::Contradiction));
    assert_eq!(decoder.time_of_week(14_001, 0.0), Some((start().tow_whole_s() + 14, 0.0)));
}
