use super::*;
use gnss::earth::Geodetic;

const GGA: &str = "$GPGGA,080626.00,2630.7379654,N,08013.9740786,E,1,05,1.0,128.703,M,0.000,M,0.0,*70";
const RMC: &str = "$GPRMC,080626.00,A,2630.7379654,N,08013.9740786,E,0.06,0.00,140230,0.0,E,A*3E";

fn with_sum(body: &str) -> String {
    format!("${body}*{:02X}\r\n", body.bytes().fold(0, |x, b| x ^ b))
}

fn near() -> Epoch {
    Epoch::parse("2010-07-01T08:06:30Z").unwrap()
}

fn utc(text: &str) -> Epoch {
    Epoch::parse(text).unwrap()
}

/// A fix `height` metres above the sea.
fn gga(talker: &str, time: &str, height: &str) -> String {
    with_sum(&format!("{talker}GGA,{time},4800.000,N,01100.000,E,1,08,1.0,{height},M,46.0,M,,"))
}

fn rmc(talker: &str, time: &str, status: &str, knots: &str, date: &str) -> String {
    with_sum(&format!("{talker}RMC,{time},{status},4800.000,N,01100.000,E,{knots},90.0,{date},,,A"))
}

fn labels(text: &str, near: &str) -> Vec<Epoch> {
    read(text.as_bytes(), utc(near)).unwrap().fixes.iter().map(|fix| fix.label).collect()
}

#[test]
fn sentences_of_a_real_receiver_become_a_place_a_velocity_and_a_time() {
    let found = read(format!("{RMC}\r\n{GGA}\r\n").as_bytes(), near()).unwrap();
    let fix = &found.fixes[0];
    let place = Geodetic::from_ecef(&fix.position_m);
    assert!((place.latitude_rad.to_degrees() - (26.0 + 30.737_965_4 / 60.0)).abs() < 1e-12);
    assert!((place.height_m - 128.703).abs() < 1e-8);
    // 2030-02-14 by its own date: 18 leap seconds, the last that are known.
    assert_eq!(fix.label, Epoch::parse("2030-02-14T08:06:44").unwrap());
    assert!((fix.ground_mps_rad.unwrap().0 - 0.06 * 0.514_444_4).abs() < 1e-6);
    assert!(found.dated && (found.resolution_m - 1852e-7).abs() < 1e-12);
    assert_eq!((found.separations_assumed, found.repeated, found.without_fix), (0, 0, 0));
}

#[test]
fn without_a_date_the_day_is_the_nearest_one_and_goes_on_over_midnight() {
    assert_eq!(labels(GGA, "2010-07-01T08:06:30Z"), [Epoch::parse("2010-07-01T08:06:41").unwrap()]);
    let over = [gga("GP", "235959.00", "1"), gga("GP", "000000.00", "1"), gga("GP", "000001.00", "1")].concat();
    let expected = ["2010-07-01T23:59:59Z", "2010-07-02T00:00:00Z", "2010-07-02T00:00:01Z"].map(utc);
    // Whichever side of midnight the truth's middle is on.
    for near in ["2010-07-01T23:59:30Z", "2010-07-02T00:00:30Z"] {
        assert_eq!(labels(&over, near), expected);
    }
    assert!(!read(over.as_bytes(), near()).unwrap().dated);
}

#[test]
fn one_date_of_rmc_or_of_zda_dates_the_whole_file() {
    let times = ["235958.00", "235959.00", "000000.00", "000001.00"];
    let expected =
        ["2016-02-28T23:59:58Z", "2016-02-28T23:59:59Z", "2016-02-29T00:00:00Z", "2016-02-29T00:00:01Z"].map(utc);
    let dates = [
        (1, rmc("GP", times[1], "A", "1.0", "280216")),
        (2, rmc("GP", times[2], "V", "", "290216")),
        (2, with_sum(&format!("GPZDA,{},29,02,2016,00,00", times[2]))),
        (0, with_sum(&format!("GNZDA,{},28,02,2016,,", times[0]))),
    ];
    for (at, date) in dates {
        for behind in [false, true] {
            let mut all: Vec<String> = times.map(|time| gga("GP", time, "1")).to_vec();
            // A warning takes the fix back, so that this date stands for itself.
            all[at] = if behind { format!("{}{date}", all[at]) } else { format!("{date}{}", all[at]) };
            let mut wanted = expected.to_vec();
            if date.contains(",V,") {
                wanted.remove(at);
            }
            assert_eq!(labels(&all.concat(), "2010-07-01T12:00:00Z"), wanted, "{date}");
        }
    }
    let wrong = with_sum("GPZDA,235958.00,30,02,2016,00,00");
    assert!(read(wrong.as_bytes(), near()).unwrap_err().what.contains("2016-02-30"));
}

#[test]
fn an_epoch_has_one_fix_and_it_is_that_of_all_systems() {
    let time = |second: u32| format!("0806{second:02}.00");
    let both = |second| format!("{}{}", gga("GP", &time(second), "100.0"), gga("GN", &time(second), "200.0"));
    let turned = |second| format!("{}{}", gga("GN", &time(second), "200.0"), gga("GL", &time(second), "100.0"));
    let apart = format!("{}{}", gga("GP", &time(3), "100.0"), gga("GA", "080603.000", "200.0"));
    let found = read(format!("{}{}{apart}", both(1), turned(2)).as_bytes(), near()).unwrap();
    let heights: Vec<f64> =
        found.fixes.iter().map(|fix| Geodetic::from_ecef(&fix.position_m).height_m.round()).collect();
    assert_eq!((heights, found.repeated), (vec![246.0, 246.0, 146.0], 3));
    // One talker twice at one time is a clock that stands.
    let fault = read(format!("{}{}", both(1), both(1)).as_bytes(), near()).unwrap_err();
    assert!((fault.line, fault.what.contains("does not come after")) == (3, true), "{}", fault.what);
}

#[test]
fn velocity_is_rmc_s_or_vtg_s_in_every_order() {
    let time = |second: u32| format!("0806{second:02}.00");
    let vtg = |second: u32| with_sum(&format!("GNVTG,90.00,T,,M,{second}.0,N,,K,A"));
    let speeds = |parts: &dyn Fn(u32) -> String| {
        let text: String = (1..5).map(parts).collect();
        let found = read(text.as_bytes(), near()).unwrap();
        let knots = |fix: &PlaceFix| fix.ground_mps_rad.map(|(mps, _)| (mps * 3600.0 / 1852.0).round() as u32);
        found.fixes.iter().map(knots).collect::<Vec<_>>()
    };
    let place = |second| gga("GN", &time(second), "1");
    let motion = |second: u32, knots: &str| rmc("GN", &time(second), "A", knots, "010710");
    let each = [Some(1), Some(2), Some(3), Some(4)];
    assert_eq!(speeds(&|at| place(at) + &vtg(at)), each);
    assert_eq!(speeds(&|at| vtg(at) + &place(at)), each);
    assert_eq!(speeds(&|at| place(at) + &motion(at, &format!("{at}.0"))), each);
    assert_eq!(speeds(&|at| motion(at, &format!("{at}.0")) + &vtg(99) + &place(at)), each, "RMC has the time");
    assert_eq!(speeds(&|at| motion(at, "") + &vtg(at) + &place(at)), each, "one without a speed");
    // RMC a second late, as 5 Hz receivers write it.
    let late = |at: u32| place(at) + &if at > 1 { motion(at - 1, &format!("{}.0", at - 1)) } else { String::new() };
    assert_eq!(speeds(&late), [Some(1), Some(2), Some(3), None]);
    assert_eq!(speeds(&place), [None; 4]);
}

#[test]
fn a_warning_takes_a_fix_back_and_empty_fields_are_none() {
    let text = [
        with_sum("GNGGA,,,,,,0,00,99.99,,,,,,"),
        with_sum("GNRMC,,V,,,,,,,,,,N"),
        gga("GN", "080601.00", "1") + &rmc("GN", "080601.00", "V", "", "010710"),
        gga("GN", "080602.00", "1") + &rmc("GN", "080602.00", "A", "0.5", "010710"),
    ];
    let found = read(text.concat().as_bytes(), near()).unwrap();
    assert_eq!((found.fixes.len(), found.without_fix), (1, 2));
    assert_eq!(found.fixes[0].label, utc("2010-07-01T08:06:02Z"));
}

#[test]
fn logs_are_read_as_they_are_recorded() {
    // Bytes of another protocol, a logger's stamps, one sentence without a checksum, lower case, a cut end.
    let [bare, lower] = [gga("GP", "080602.00", "1"), gga("GP", "080603.00", "1")];
    let (bare, lower) = (bare.split('*').next().unwrap(), lower.to_lowercase().replace("$gpgga", "$GPGGA"));
    let lower = lower.replace(",n,", ",N,").replace(",e,", ",E,").replace(",m,", ",M,");
    let mut log = b"\xb5\x62\x01\x07\xff".to_vec();
    log.extend(format!("2010-07-01 {}{bare}\n{lower}", gga("GP", "080601.00", "1")).bytes());
    for end in ["", "$GPGGA,080604.00,4800.0", "$GPG", "$GPRMC,080604.00,A,4800.000,N*3"] {
        let mut text = log.clone();
        text.extend(end.bytes());
        assert_eq!(read(&text, near()).unwrap().fixes.len(), 3, "{end}");
    }
    // The same in the middle of a file is damage.
    log.extend(b"$GPGGA,080604.00,4800.0\n$GPTXT\n");
    assert_eq!(read(&log, near()).unwrap_err().line, 4);
}

#[test]
fn each_damage_is_refused_at_its_line() {
    let broken = |from: &str, to: &str| {
        let body = GGA.trim_start_matches('$').split('*').next().unwrap().replace(from, to);
        format!("{RMC}\n{}", with_sum(&body))
    };
    let cases = [
        (GGA.replace("*70", "*71"), 1, "checksum is wrong: '71', expected 70"),
        (GGA.replace("*70", "*7x"), 1, "checksum is wrong"),
        (format!("{}\n", GGA.replace(",0.0,*70", "")), 1, "13 fields: expected at least 15 of GGA without a checksum"),
        (broken("2630.73", "2690.73"), 2, "latitude '2690.7379654,N'"),
        (broken(",E,1", ",Q,1"), 2, "longitude"),
        (broken("128.703", "x"), 2, "height 'x'"),
        (broken("080626.00", "250626.00"), 2, "time '250626.00'"),
        (broken("080626.00", "8:06"), 2, "time '8:06'"),
        (broken(",E,1,", ",E,0,"), 2, "no GGA sentence with a fix (1 without one)"),
        (with_sum("GPGLL,4800.0,N,01100.0,E,080626.00,A,A"), 1, "expected GGA, which alone has the height"),
        (format!("{GGA}\n{GGA}\n"), 2, "does not come after"),
        (gga("GP", "080602.00", "1") + &gga("GP", "080601.00", "1"), 2, "time 080601.00 does not come after"),
        (rmc("GP", "080601.00", "A", "1", "311310"), 1, "2010-13-31"),
        (String::new(), 1, "no GGA sentence"),
    ];
    for (text, line, words) in cases {
        let fault = read(text.as_bytes(), near()).unwrap_err();
        assert_eq!(fault.line, line, "{text}: {}", fault.what);
        assert!(fault.what.contains(words), "{text}: {}", fault.what);
    }
    let mut bytes = b"$GPGGA,".to_vec();
    bytes.extend([0xff, b'\n']);
    assert_eq!(read(&bytes, near()).unwrap_err().what, "not ASCII text");
}
