use super::*;
use crate::table::Value;

fn read_one(frame: &[u8]) -> Table {
    read(frame).2.unwrap()
}

/// NAV-PVT with a fix at 2024-03-01 12:00:00 UTC less 250 µs, which is 18 s later in GPS time.
fn position(valid: u8, flags: u8) -> Vec<u8> {
    let mut payload = vec![0; 92];
    // Friday noon and 18 s, in milliseconds of the week.
    payload[..4].copy_from_slice(&(475_218_000_u32).to_le_bytes());
    payload[4..11].copy_from_slice(&[0xe8, 0x07, 3, 1, 12, 0, 0]);
    payload[11] = valid;
    payload[16..20].copy_from_slice(&(-250_000_i32).to_le_bytes());
    (payload[20], payload[21], payload[23]) = (3, flags, 9);
    payload[24..28].copy_from_slice(&(-1_234_567_i32).to_le_bytes());
    payload[28..32].copy_from_slice(&(515_000_000_i32).to_le_bytes());
    payload[32..36].copy_from_slice(&(45_678_i32).to_le_bytes());
    payload[40..44].copy_from_slice(&(1_250_u32).to_le_bytes());
    for (at, value) in [(48, 1_000_i32), (52, -2_000), (56, 500)] {
        payload[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    frame(0x01, 0x07, &payload)
}

fn event_of(frame: &[u8], near: Option<Epoch>) -> Event {
    event(&read_one(frame), &mut Calendar::new(near), &mut Locks::default()).unwrap()
}

#[test]
fn a_position_is_read_to_its_last_digit() {
    let Event::Fix(fix) = event_of(&position(7, 0x83), None) else { panic!("no fix") };
    let expected = Geodetic::from_degrees(51.5, -0.123_456_7, 45.678).to_ecef();
    assert!((fix.position_m - expected).norm() < 1e-6);
    assert_eq!(fix.velocity_enu_mps, Some([-2.0, 1.0, -0.5]));
    assert_eq!((fix.satellites, fix.horizontal_sigma_m), (9, Some(1.25)));
    assert_eq!(fix.solution, Solution::FixedCarrier);
    let noon = Epoch::parse("2024-03-01T12:00:18").unwrap();
    assert!((fix.label.since(noon) + 250e-6).abs() < 1e-9);
}

#[test]
fn the_whole_second_is_that_of_the_time_of_week_where_utc_is_off_by_leap_seconds() {
    let mut payload = position(7, 1);
    // The receiver took 15 leap seconds for 18: its UTC is 3 s late.
    payload[6 + 10] = 3;
    let body = payload[6..payload.len() - 2].to_vec();
    let Event::Fix(fix) = event_of(&frame(0x01, 0x07, &body), None) else { panic!("no fix") };
    assert!((fix.label.since(Epoch::parse("2024-03-01T12:00:18").unwrap()) + 250e-6).abs() < 1e-9);
}

#[test]
fn a_fix_without_a_date_takes_the_week_that_is_known() {
    assert_eq!(event_of(&position(0, 1), None), Event::Undated);
    let Event::Fix(fix) = event_of(&position(0, 1), Epoch::parse("2024-03-02T09:00:00").ok()) else { panic!("no fix") };
    assert_eq!(fix.label, Epoch::parse("2024-03-01T12:00:18").unwrap());
}

#[test]
fn a_position_that_the_receiver_takes_back_is_no_fix() {
    assert_eq!(event_of(&position(7, 0), None), Event::NoFix);
    let mut payload = position(7, 1);
    payload[6 + 20] = 5;
    let body = payload[6..payload.len() - 2].to_vec();
    assert_eq!(event_of(&frame(0x01, 0x07, &body), None), Event::NoFix);
}

#[test]
fn further_digits_belong_to_the_position_of_their_time() {
    let mut payload = vec![0; 36];
    payload[4..8].copy_from_slice(&(475_218_000_u32).to_le_bytes());
    payload[8..12].copy_from_slice(&(-1_234_567_i32).to_le_bytes());
    payload[12..16].copy_from_slice(&(515_000_000_i32).to_le_bytes());
    payload[16..20].copy_from_slice(&(45_678_i32).to_le_bytes());
    payload[24..27].copy_from_slice(&[-42_i8 as u8, 7, 3]);
    let near = Epoch::parse("2024-03-01T00:00:00").ok();
    let Event::Refinement(found) = event_of(&frame(0x01, 0x14, &payload), near) else { panic!("none") };
    assert_eq!(found.label, Epoch::parse("2024-03-01T12:00:18").unwrap());
    let expected = Geodetic::from_degrees(51.500_000_007, -0.123_456_742, 45.678_3).to_ecef();
    assert!((found.position_m - expected).norm() < 1e-6);
    payload[3] = 1;
    let table = read_one(&frame(0x01, 0x14, &payload));
    assert_eq!(event(&table, &mut Calendar::new(near), &mut Locks::default()), None);
}

#[test]
fn an_older_and_shorter_message_leaves_cells_empty() {
    let whole = position(7, 1);
    let table = read_one(&frame(0x01, 0x07, &whole[6..6 + 84]));
    assert_eq!(table.number(0, "pDOP"), Some(0.0));
    assert_eq!(table.get(0, "headVeh"), &Value::Absent);
}

#[test]
fn an_unknown_message_has_its_number_and_a_known_one_its_name() {
    assert_eq!(read(&frame(0x0a, 0x04, &[])).0, "MON-VER");
    assert_eq!(read(&frame(0xf1, 0x2a, &[])).0, "UBX-F1-2A");
}

#[test]
fn signals_have_the_names_that_rinex_gives_them() {
    let named = |gnss, number, id| signal(gnss, number, id).map(|(sv, code)| format!("{sv} {code}"));
    assert_eq!(named(0, 7, 3).as_deref(), Some("G07 2L"));
    assert_eq!(named(1, 133, 0).as_deref(), Some("S33 1C"));
    assert_eq!(named(2, 36, 4).as_deref(), Some("E36 5Q"));
    assert_eq!(named(3, 45, 7).as_deref(), Some("C45 5P"));
    // A GLONASS satellite whose slot is not known yet, and a system that RINEX does not have.
    assert_eq!([named(6, 255, 0), named(4, 1, 0), named(0, 7, 99)], [None, None, None]);
}

#[test]
fn layouts_have_names_of_columns_that_differ() {
    for layout in LAYOUTS {
        let Some(table) = layout.read(&[0; 600]) else { panic!("{}", layout.name) };
        let mut names = table.columns.clone();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), table.columns.len(), "{}", layout.name);
        assert_eq!(table.rows[0].len(), table.columns.len(), "{}", layout.name);
    }
}
