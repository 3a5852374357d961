//! Files good and bad, and what is said of them.

use super::*;

fn options() -> Options {
    Options { start: Epoch::parse("2010-07-01T10:00:00").unwrap(), max_gap_s: 2.0, tolerance_m: None }
}

fn csv(text: &str) -> Result<(Trajectory, Vec<String>), FileError> {
    read_csv(text.as_bytes(), "ride.csv", &options()).map(|found| (found.trajectory, found.ignored))
}

const HEADER: &str = "time_s,x_m,y_m,z_m\n";

#[test]
fn rows_come_back_in_any_column_order_and_either_coordinates() {
    let place = Geodetic::from_degrees(26.5, 80.2, 130.0);
    let p = place.to_ecef();
    let ecef = format!("# a ride\n{HEADER}0,{},{},{}\n1.5,{},{},{}\n", p.x, p.y, p.z, p.x + 3.0, p.y, p.z);
    let (trajectory, ignored) = csv(&ecef).unwrap();
    assert!(ignored.is_empty());
    // Rust prints the shortest text that reads back as the same number.
    assert_eq!(trajectory.at(0.0).position_m, p);
    assert_eq!(trajectory.at(1.5).position_m, p + Vector3::new(3.0, 0.0, 0.0));
    assert_eq!(trajectory.breaks_s(), [0.0, 1.5]);
    let geodetic =
        "\u{feff}height_m, speed ,longitude_deg,time_s,latitude_deg\r\n130,9,80.2,0,26.5\r\n130,9,80.2,1,26.5\r\n";
    let (trajectory, ignored) = csv(geodetic).unwrap();
    assert_eq!((trajectory.at(0.0).position_m, ignored), (p, vec!["speed".to_owned()]));
}

#[test]
fn absolute_times_and_velocities_are_used() {
    let start = options().start;
    let p = Geodetic::from_degrees(0.0, 0.0, 0.0).to_ecef();
    let row = |s: i64, north: f64| {
        format!("{},0.25,{},{},{},0,{north},0\n", start.seconds() + s, p.x, p.y, p.z + 2.0 * s as f64)
    };
    let text = format!("gps_s,gps_fraction_s,x_m,y_m,z_m,east_mps,north_mps,up_mps\n{}{}", row(3, 2.0), row(4, 2.0));
    let (trajectory, _) = csv(&text).unwrap();
    assert_eq!(trajectory.span_s(), (3.25, 4.25));
    // North at latitude 0 is z, but for the geodetic latitude of z = 6 m, 1e-6 rad.
    assert!((trajectory.at(3.75).velocity_mps - Vector3::new(0.0, 0.0, 2.0)).norm() < 1e-5);
}

#[test]
fn each_damage_is_refused_at_its_line_with_its_reason() {
    let good = "0,6400000,0,0\n";
    let cases: [(String, u64, &str); 17] = [
        (format!("{HEADER}{good}-1,6400000,0,0\n"), 3, "must ascend"),
        (format!("{HEADER}{good}{good}"), 3, "repeats"),
        (format!("{HEADER}{good}1,NaN,0,0\n"), 3, "x_m = \"NaN\""),
        (format!("{HEADER}{good}1,,0,0\n"), 3, "x_m = \"\""),
        (format!("{HEADER}{good}9,6400000,0,0\n"), 3, "max_gap_s = 2"),
        (format!("{HEADER}{good}1,6400000,40000000,0\n"), 3, "0.1 c"),
        (format!("{HEADER}{good}1,6400000,20000000,0\n2,6400000,0,0\n"), 3, "1e6 m/s2"),
        (format!("{HEADER}{good}1,6400000,0,0,7\n"), 3, "5 fields, but the header names 4"),
        (format!("{HEADER}{good}1,\"6400000,5\",0,0\n"), 3, "x_m = \"6400000,5\""),
        ("time_s;x_m;y_m;z_m\n0;1;2;3\n".to_owned(), 1, "separated by ';'"),
        (format!("{HEADER}{good}"), 2, "at least 2"),
        (HEADER.to_owned(), 1, "at least 2"),
        (String::new(), 1, "time_s, or gps_s"),
        ("time_s,x_m,y_m\n".to_owned(), 1, "latitude_deg,longitude_deg,height_m"),
        ("time_s,time_s,x_m,y_m,z_m\n".to_owned(), 1, "twice"),
        ("time_s,x_m,y_m,z_m,vx_mps\n".to_owned(), 1, "or none"),
        ("time_s,latitude_deg,longitude_deg,height_m\n0,91,0,0\n".to_owned(), 2, "from -90 to 90"),
    ];
    for (text, line, reason) in cases {
        let error = csv(&text).unwrap_err();
        let message = error.to_string();
        assert!(error.line == line && message.contains(reason), "{text:?}: {message}");
        assert!(message.starts_with("ride.csv: line "));
    }
    for (text, reason) in [
        ("$GPGGA,100015.00,2630.0,N,08012.0,E,1,08,1.0,130,M,0,M,,*00\n", "format = \"nmea\""),
        ("[10:00:15.1] $GPRMC,100015.00,A\n", "format = \"nmea\""),
        ("<?xml version=\"1.0\"?>\n<kml>\n", "XML: expected a table of CSV or sentences of NMEA"),
        ("0,26.5,80.2,130\n1,26.5,80.2,130\n", "a header before them that names the columns"),
    ] {
        let message = csv(text).unwrap_err().to_string();
        assert!(message.starts_with("ride.csv: line 1: ") && message.contains(reason), "{text:?}: {message}");
    }
    let error = read_csv(&b"time_s,x_m,y_m,z_m\n0,\xff,0,0\n"[..], "ride.csv", &options()).unwrap_err();
    assert!(matches!(error.fault, Fault::NotText), "{error}");
}

#[test]
fn a_way_through_the_earth_is_refused_at_the_row_where_it_ends() {
    let error = csv(&format!("{HEADER}0,6400000,0,0\n1,6400000,10,0\n3,-6400000,10,0\n")).unwrap_err();
    assert!(error.line == 4 && matches!(error.fault, Fault::Depth { radius_m } if radius_m < 11.0), "{error}");
    assert!(csv(&format!("{HEADER}0,6400000,0,0\n1,6400000,900000,0\n")).is_ok());
}

#[test]
fn a_row_that_jumps_is_named_and_not_its_neighbours() {
    // A walk at 1 m/s and 10 Hz, with and without velocities.
    let walk = |velocities: bool, wrong: &dyn Fn(i32) -> (f64, f64)| {
        let mut text =
            if velocities { "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n".to_owned() } else { HEADER.to_owned() };
        for k in 0..60 {
            let (jump_m, jump_mps) = wrong(k);
            let t_s = 0.1 * f64::from(k);
            text += &format!("{t_s},6400000,{},0", t_s + jump_m);
            text += &if velocities { format!(",0,{},0\n", 1.0 + jump_mps) } else { "\n".to_owned() };
        }
        csv(&text).map(|_| ()).map_err(|error| (error.line, matches!(error.fault, Fault::Acceleration { .. })))
    };
    for row in 0..60 {
        // The header is line 1.
        let line = row as u64 + 2;
        for jump_m in [2e4, 1e5, 1e6, 2.9e6] {
            let one = walk(false, &|k| (if k == row { jump_m } else { 0.0 }, 0.0));
            assert_eq!(one, Err((line, true)), "row {row} alone by {jump_m} m");
            let one = walk(true, &|k| (if k == row { jump_m } else { 0.0 }, 0.0));
            assert_eq!(one, Err((line, true)), "row {row} alone by {jump_m} m, with velocities");
            // With less than three rows on either side of it, a jump is as well a wrong row beside it.
            if (3..58).contains(&row) {
                let rest = walk(false, &|k| (if k >= row { jump_m } else { 0.0 }, 0.0));
                assert_eq!(rest, Err((line, true)), "from row {row} on by {jump_m} m");
            }
        }
        let velocity = walk(true, &|k| (0.0, if k == row { 1e6 } else { 0.0 }));
        assert_eq!(velocity, Err((line, true)), "the velocity of row {row}");
    }
}

#[test]
fn a_written_truth_flies_again_as_it_was() {
    use crate::vehicle::rocket::Rocket;
    use gnss::record::TrajectoryRow;
    let g = 9.806_65;
    let rocket = Rocket {
        pad: Geodetic::from_degrees(26.5, 80.2, 130.0),
        azimuth_rad: 1.0,
        elevation_rad: 1.4,
        ignition_s: 1.0,
        thrust_mps2: 22.0 * g,
        burn_s: 4.0,
        jerk_mps3: 20.0 * g,
        drag_m2pkg: 4e-5,
        oblate: true,
    };
    let flight = rocket.trajectory(12.0).unwrap();
    let mut writer = csv::Writer::from_writer(Vec::new());
    for k in 0..=100_u64 {
        let (at, m) = (options().start.plus_s(k as f64 * 0.1), flight.at(k as f64 * 0.1));
        let (p, v) = (m.position_m, m.velocity_mps);
        let row = TrajectoryRow {
            sample: k,
            gps_s: at.seconds(),
            gps_fraction_s: at.fraction(),
            x_m: p.x,
            y_m: p.y,
            z_m: p.z,
            vx_mps: v.x,
            vy_mps: v.y,
            vz_mps: v.z,
            clock_bias_s: 0.0,
            clock_drift: 0.0,
        };
        writer.serialize(row).unwrap();
    }
    let text = writer.into_inner().unwrap();
    let found = read_csv(text.as_slice(), "trajectory.csv", &options()).unwrap();
    let (again, ignored) = (found.trajectory, found.ignored);
    assert_eq!(ignored, ["sample", "clock_bias_s", "clock_drift"]);
    for k in 0..1_000 {
        let t_s = f64::from(k) * 0.01;
        let (a, b) = (flight.at(t_s), again.at(t_s));
        // A corner of the thrust between rows: half the slope's jump J = 196 m/s3 over h = 0.1 s. Hermite's
        // error for a jump of the third derivative is at most J h³/192 with exact accelerations; those of the
        // spline are off by less than J h/8, which weighs h²/32 more: 1.0e-3 m + 0.8e-3 m.
        assert!((a.position_m - b.position_m).norm() < 2e-3, "{t_s}");
        assert!((a.velocity_mps - b.velocity_mps).norm() < 0.1, "{t_s}");
    }
}

fn sentence(body: &str) -> String {
    format!("${body}*{:02X}\r\n", body.bytes().fold(0, |x, b| x ^ b))
}

#[test]
fn gga_gives_ellipsoidal_height_and_crosses_midnight() {
    let start = Epoch::parse("2010-07-01T23:59:59Z").unwrap();
    let options = Options { start, max_gap_s: 2.0, tolerance_m: None };
    let rmc = sentence("GPRMC,235958.50,A,2630.0,N,08012.0,E,0,0,010710,,");
    let text = [
        rmc,
        sentence("GPGGA,235959.50,0030.0000,N,00012.0000,E,1,08,0.9,100.0,M,-30.0,M,,"),
        sentence("GPGGA,000000.00,,,,,0,00,,,M,,M,,"),
        sentence("GNGGA,000000.50,0030.0000,S,00012.0000,W,1,08,0.9,100.0,M,-30.0,M,,"),
    ];
    let text = text.concat();
    // Over equator and meridian in 1 s: 1.2e5 m/s, and two rows make no acceleration.
    let found = read_nmea(text.as_bytes(), "ride.nmea", &options).unwrap();
    let trajectory = found.trajectory;
    assert_eq!((trajectory.span_s(), found.without_fix, found.separations_assumed), ((0.5, 1.5), 1, 0));
    let (first, last) = (trajectory.at(0.5).position_m, trajectory.at(1.5).position_m);
    assert!((first - Geodetic::from_degrees(0.5, 0.2, 70.0).to_ecef()).norm() < 1e-8);
    assert!((last - Geodetic::from_degrees(-0.5, -0.2, 70.0).to_ecef()).norm() < 1e-8);
}

/// Sea level over Munich is 45.96 m above the ellipsoid by EGM96's node at 48° N 11° E (WW15MGH: 45.956 m).
#[test]
fn a_height_without_a_separation_is_above_the_sea_and_a_second_talker_is_no_second_fix() {
    let start = Epoch::parse("2010-07-01T10:00:00Z").unwrap();
    let gga = |talker: &str, second: u32| {
        sentence(&format!("{talker}GGA,10000{second},4800.0,N,01100.00{second},E,1,08,0.9,500.0,M,,M,,"))
    };
    let text = format!("log 1: {}{}{}{}", gga("GP", 0), gga("GN", 0), gga("GP", 1), gga("GN", 1));
    let found = read_nmea(text.as_bytes(), "ride.nmea", &Options { start, max_gap_s: 2.0, tolerance_m: None }).unwrap();
    assert_eq!((found.trajectory.span_s(), found.separations_assumed), ((0.0, 1.0), 2));
    let expected_m = Geodetic::from_degrees(48.0, 11.0, 500.0 + 45.956).to_ecef();
    assert!((found.trajectory.at(0.0).position_m - expected_m).norm() < 0.01);
    let twice = format!("{}{}", gga("GP", 0), gga("GP", 0));
    assert!(read_nmea(twice.as_bytes(), "ride.nmea", &options()).is_err());
}

#[test]
fn what_a_logger_puts_before_a_sentence_is_passed_over() {
    let body = |second: u32| sentence(&format!("GPGGA,1000{second:02},2630.0,N,08012.0,E,1,08,0.9,100.0,M,-30.0,M,,"));
    let plain = format!("{}{}", body(0), body(1));
    let stamped = format!("2010-07-01 10:00:00.123 {}[1277978401.2] {}\n", body(0), body(1));
    let [one, other] =
        [plain, stamped].map(|text| read_nmea(text.as_bytes(), "ride.log", &options()).unwrap().trajectory);
    assert_eq!((one.span_s(), one.at(-14.5)), (other.span_s(), other.at(-14.5)));
}

#[test]
fn damaged_gga_is_refused_with_its_reason() {
    let good = sentence("GPGGA,100000,2630.0,N,08012.0,E,1,08,0.9,100.0,M,-30.0,M,,");
    for (text, reason) in [
        (good.replace("2630.0", "2631.0"), "checksum is wrong"),
        (good.split(",M,-30.0").next().unwrap().to_owned(), "expected at least 15 of GGA without a checksum"),
        (sentence("GPGGA,100000,2630.0,N,08012.0,E,1,08,0.9,100.0,M,low,M,,"), "geoid"),
        (sentence("GPGGA,250000,2630.0,N,08012.0,E,1,08,0.9,100.0,M,-30.0,M,,"), "hhmmss"),
        (sentence("GPGGA,100000,9930.0,N,08012.0,E,1,08,0.9,100.0,M,-30.0,M,,"), "latitude '9930.0,N'"),
        (sentence("GPGGA,100000,2630.0,N"), "at least 12"),
        ("nothing here\n".to_owned(), "no sentence of NMEA: expected GGA"),
        (sentence("GPRMC,100000,A,2630.0,N,08012.0,E,1.0,60.0,010710,,"), "RMC sentences, which have no height"),
        (sentence("GPGGA,100000,2630.0,N,08012.0,E,0,08,0.9,100.0,M,-30.0,M,,"), "no GGA sentence with a fix"),
        (sentence("GPGSV,1,1,00"), "no GGA sentence: expected"),
    ] {
        let error = read_nmea(text.as_bytes(), "ride.nmea", &options()).unwrap_err().to_string();
        assert!(error.contains(reason), "{text}: {error}");
    }
}

proptest::proptest! {
    #[test]
    fn no_bytes_make_the_readers_panic(bytes: Vec<u8>, rows in "[-0-9.,e\\n]{0,80}", tail in "[0-9A-Z.,*]{0,60}") {
        let _ = read_csv(bytes.as_slice(), "any", &options());
        let _ = read_nmea(bytes.as_slice(), "any", &options());
        let _ = csv(&format!("{HEADER}{rows}"));
        let _ = read_nmea(format!("$GPGGA,{tail}").as_bytes(), "any", &options());
        let _ = read_nmea(sentence(&format!("GPGGA,{tail}")).as_bytes(), "any", &options());
    }
}

#[test]
fn the_worth_of_the_last_digit_is_read_and_a_tolerance_smooths_what_it_makes() {
    // Ten times a second: 1e-6° are 0.11 m, √3·0.11/0.01 = 19 m/s2.
    let rows = |decimals: usize| -> String {
        let place = |k: u32| {
            format!("{:.1},{:.*},80,130.00\n", 0.1 * f64::from(k), decimals, 26.5 + 1e-6 * 1.37 * f64::from(k))
        };
        format!("time_s,latitude_deg,longitude_deg,height_m\n{}", (0..200).map(place).collect::<String>())
    };
    // Longitudes that are written as "80" may be that to a degree, which no other row says better.
    let text = |decimals| rows(decimals).replace(",80,", ",80.000000,");
    let read =
        |text: &str, tolerance_m| read_csv(text.as_bytes(), "ride.csv", &Options { tolerance_m, ..options() }).unwrap();
    let hardest = |found: &CsvTrajectory| {
        let knots = found.trajectory.knots();
        knots.iter().map(|knot| knot.motion.acceleration_mps2.norm()).fold(0.0, f64::max)
    };
    let rough = read(&text(6), None);
    let digits = rough.digits.unwrap();
    assert!((digits.step_m - 0.1112).abs() < 1e-4 && (digits.interval_s - 0.1).abs() < 1e-12, "{digits:?}");
    assert!((digits.acceleration_mps2 - 19.3).abs() < 0.1 && hardest(&rough) > 10.0, "{digits:?} {}", hardest(&rough));
    let smoothed = read(&text(6), Some(0.5 * digits.step_m));
    assert!(smoothed.digits.is_none() && hardest(&smoothed) < 0.2, "{}", hardest(&smoothed));
    let with_velocity = "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n0,6400000,0,0,1,0,0\n1,6400001,0,0,1,0,0\n";
    let error = read_csv(with_velocity.as_bytes(), "v.csv", &Options { tolerance_m: Some(1.0), ..options() });
    assert!(error.unwrap_err().to_string().contains("tolerance_m"));
}
