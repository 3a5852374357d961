use super::*;
use gnss::satellite::Sv;

/// Block of a number with this content behind the header.
fn block(number: u16, body: &[u8]) -> Vec<u8> {
    let rest = body.len().next_multiple_of(4) - body.len();
    let length = (8 + body.len() + rest) as u16;
    let tail = [&number.to_le_bytes()[..], &length.to_le_bytes(), body, &vec![0; rest]].concat();
    [&b"$@"[..], &crate::frames::crc_ccitt(&tail).to_le_bytes(), &tail].concat()
}

fn read_one(block: &[u8]) -> Content {
    read(block, &mut Calendar::default(), &mut Locks::default())
}

/// MeasEpoch of week 2200 with GPS 7 on L1 C/A and L2C, and GLONASS 3 of channel 5.
fn measurements() -> Vec<u8> {
    let mut body = [&345_600_500_u32.to_le_bytes()[..], &2200_u16.to_le_bytes(), &[2, 20, 12, 0, 0, 0]].concat();
    // 23 456 789.012 m, −1234.5678 Hz, 1000.5 cycles less than the range, 45.25 dB-Hz, locked for 300 s.
    let range: u64 = 23_456_789_012;
    let (carrier_high, carrier_low) = (-16_i8, (-1_000_500_i64 + 16 * 65_536) as u16);
    body.extend([1, 0, 7, (range >> 32) as u8]);
    body.extend((range as u32).to_le_bytes());
    body.extend((-12_345_678_i32).to_le_bytes());
    body.extend(carrier_low.to_le_bytes());
    body.extend([carrier_high as u8, 141]);
    body.extend(300_u16.to_le_bytes());
    body.extend([0, 1]);
    // L2C: 3.5 m and 0.25 Hz more, half a cycle ambiguous, no carrier.
    body.extend([3, 200, 120, 0, 0x80, 4]);
    body.extend(3_500_u16.to_le_bytes());
    body.extend(0_u16.to_le_bytes());
    body.extend(2_500_u16.to_le_bytes());
    body.extend([2, 8, 40, (range >> 32) as u8]);
    body.extend((range as u32).to_le_bytes());
    body.extend(i32::MIN.to_le_bytes());
    body.extend([0, 0, 0, 255, 0xff, 0xff, (5 + 8) << 3, 0]);
    body
}

#[test]
fn observations_are_put_together_from_their_parts() {
    let Some(Event::Observations(epoch)) = read_one(&block(4027, &measurements())).event else { panic!("none") };
    assert_eq!(epoch.label, Epoch::from_week(2200, 345_600.5));
    let [one, two, three] = epoch.values.as_slice() else { panic!("{} values", epoch.values.len()) };
    assert_eq!((one.sv, one.code), (Sv::gps(7), "1C"));
    let near = |value: Option<f64>, expected: f64| assert!((value.unwrap() - expected).abs() < 1e-6, "{value:?}");
    near(one.pseudorange_m, 23_456_789.012);
    near(one.doppler_hz, -1_234.567_8);
    near(one.carrier_cycles, 23_456_789.012 / (299_792_458.0 / 1575.42e6) - 1_000.5);
    assert_eq!((one.cn0_dbhz, one.lock_s), (Some(45.25), Some(300.0)));
    assert_eq!((two.sv, two.code, two.carrier_cycles), (Sv::gps(7), "2L", None));
    near(two.pseudorange_m, 23_456_792.512);
    near(two.doppler_hz, -1_234.567_8 * 1227.6 / 1575.42 + 0.25);
    assert_eq!((three.sv.to_string().as_str(), three.code, three.doppler_hz), ("R03", "1C", None));
    near(three.carrier_cycles, 23_456_789.012 / (299_792_458.0 / (1602e6 + 5.0 * 562.5e3)));
    assert_eq!((three.cn0_dbhz, three.lock_s), (None, None));
}

#[test]
fn a_block_that_ends_before_its_signals_is_malformed() {
    let whole = measurements();
    for length in 0..whole.len() - 1 {
        let content = read_one(&[&[0; 4], &4027_u16.to_le_bytes()[..], &[0, 0], &whole[..length]].concat());
        assert!(content.is_known && content.table.is_none(), "{length}");
    }
}

/// PVTGeodetic with a fix at 0.9 rad north, whose clock is 0.2 ms ahead.
fn position(mode: u8, error: u8) -> Vec<u8> {
    let mut body = [&1_000_u32.to_le_bytes()[..], &2200_u16.to_le_bytes(), &[mode, error]].concat();
    [0.9_f64, -0.1, 250.0].iter().for_each(|value| body.extend(value.to_le_bytes()));
    [47.0_f32, 1.5, -2.5, 0.25, 0.0].iter().for_each(|value| body.extend(value.to_le_bytes()));
    body.extend(0.2_f64.to_le_bytes());
    body.extend(0.0_f32.to_le_bytes());
    body.extend([0, 0, 11, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    body.extend([0, 0]);
    body.extend(124_u16.to_le_bytes());
    body.extend(65_535_u16.to_le_bytes());
    body.push(0);
    body
}

#[test]
fn a_position_has_its_clock_taken_off_and_half_of_twice_its_sigma() {
    let Some(Event::Fix(fix)) = read_one(&block(4007, &position(4, 0))).event else { panic!("no fix") };
    assert!((fix.label.since(Epoch::from_week(2200, 0.999_8))).abs() < 1e-9);
    assert_eq!(fix.velocity_enu_mps, Some([-2.5, 1.5, 0.25]));
    assert_eq!((fix.satellites, fix.solution), (11, Solution::FixedCarrier));
    assert_eq!((fix.horizontal_sigma_m, fix.vertical_sigma_m), (Some(0.62), None));
    let place = Geodetic::from_ecef(&fix.position_m);
    assert!((place.latitude_rad - 0.9).abs() < 1e-12 && (place.height_m - 250.0).abs() < 1e-6);
    assert_eq!(read_one(&block(4007, &position(0, 0))).event, Some(Event::NoFix));
    assert_eq!(read_one(&block(4007, &position(1, 3))).event, Some(Event::NoFix));
}

#[test]
fn a_block_is_named_or_numbered() {
    assert_eq!(read_one(&block(4023 | 1 << 13, &[0; 8])).name, "GALRawINAV");
    assert_eq!(read_one(&block(8000, &[0; 8])).name, "SBF-8000");
}
