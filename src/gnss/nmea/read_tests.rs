use super::*;

/// Two receivers' own sentences: one that gives heights above the ellipsoid, and u-blox's.
const GGA: &str = "$GPGGA,080626.00,2630.7379654,N,08013.9740786,E,1,05,1.0,128.703,M,0.000,M,0.0,*70";
const RMC: &str = "$GPRMC,080626.00,A,2630.7379654,N,08013.9740786,E,0.06,0.00,140230,0.0,E,A*3E";
/// u-blox 8 receiver description, examples of GGA, VTG and ZDA.
const UBLOX: [&str; 3] = [
    "$GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,*5B",
    "$GPVTG,77.52,T,,M,0.004,N,0.008,K,A*06",
    "$GPZDA,082710.00,16,09,2002,00,00*64",
];

fn parse(text: &str) -> Read<Option<Sentence<'_>>> {
    Sentence::of(&["GGA", "RMC", "VTG", "ZDA"], text.as_bytes())
}

fn with_sum(body: &str) -> String {
    format!("${body}*{:02X}", body.bytes().fold(0, |x, b| x ^ b))
}

#[test]
fn printed_sentences_are_read() {
    let sentence = parse(UBLOX[0]).unwrap().unwrap();
    let gga = sentence.gga().unwrap().unwrap();
    assert_eq!((sentence.talker, gga.time, gga.satellites, gga.decimals), ("GP", "092725.00", 8, 5));
    let place = Geodetic::from_ecef(&gga.position_m());
    assert!((place.latitude_rad.to_degrees() - (47.0 + 17.113_99 / 60.0)).abs() < 1e-9);
    assert!((place.longitude_rad.to_degrees() - (8.0 + 33.915_9 / 60.0)).abs() < 1e-9);
    assert!((place.height_m - 547.6).abs() < 1e-6, "altitude and separation");
    let (speed_mps, course_rad) = parse(UBLOX[1]).unwrap().unwrap().vtg().unwrap().unwrap();
    assert!((speed_mps * 3.6 - 0.004 * 1.852).abs() < 1e-9 && (course_rad.to_degrees() - 77.52).abs() < 1e-9);
    assert_eq!(parse(UBLOX[2]).unwrap().unwrap().zda(), Ok(Some(("082710.00", [2002, 9, 16]))));
    let rmc = parse(RMC).unwrap().unwrap().rmc().unwrap().unwrap();
    assert_eq!((rmc.time, rmc.valid, rmc.date), ("080626.00", true, Some([2030, 2, 14])));
    assert!((rmc.speed_mps.unwrap() - 0.06 * 0.514_444_4).abs() < 1e-6 && rmc.course_rad == Some(0.0));
}

/// Geoid separation over Zürich: 47.30 m above the ellipsoid by WW15MGH; the receiver's own model has 48.0 m.
#[test]
fn a_separation_that_is_missing_is_that_of_egm96_and_a_zero_is_none() {
    let height = |separation: &str| {
        let body = UBLOX[0][1..].split('*').next().unwrap().replace(",48.0,", &format!(",{separation},"));
        let text = with_sum(&body);
        Geodetic::from_ecef(&parse(&text).unwrap().unwrap().gga().unwrap().unwrap().position_m()).height_m
    };
    assert!((height("") - 499.6 - 47.30).abs() < 2.0, "{}", height(""));
    assert!((height("0.0") - 499.6).abs() < 1e-6);
}

#[test]
fn a_checksum_is_optional_in_either_case_and_never_wrong() {
    let bare = GGA.split('*').next().unwrap();
    let whole = parse(GGA).unwrap().unwrap().gga().unwrap();
    assert_eq!(parse(bare).unwrap().unwrap().gga().unwrap(), whole);
    assert_eq!(parse(&format!("{RMC}\r\n").replace("*3E", "*3e")).unwrap(), parse(RMC).unwrap());
    for sum in ["*71", "*7", "*+0", "*", "*7x"] {
        let error = parse(&GGA.replace("*70", sum)).unwrap_err().to_string();
        assert!(error.contains("checksum is wrong") && error.ends_with("expected 70"), "{error}");
    }
    // One that is cut off anywhere is known by its missing fields.
    for length in "$GPGGA".len()..bare.rfind(',').unwrap() {
        assert!(parse(&bare[..length]).unwrap().unwrap().gga().is_err(), "{}", &bare[..length]);
    }
}

#[test]
fn sentences_stand_anywhere_in_a_line() {
    let line = format!("08:06:26 \u{fffd}$GPGGA,0806{GGA}{RMC}\r");
    let found: Vec<&[u8]> = sentences(line.as_bytes()).collect();
    assert_eq!(found, [GGA.as_bytes(), format!("{RMC}\r").as_bytes()]);
    assert_eq!(sentences(b"no sentence").count(), 0);
    for other in ["$GPGSV,1,1,00*79", "$PUBX,00", "$", "$GP", "!AIVDM,1", "$GPGGX,*00"] {
        assert_eq!(parse(other), Ok(None), "{other}");
    }
}

#[test]
fn empty_fields_say_nothing_and_wrong_ones_are_named() {
    for none in ["GNGGA,,,,,,0,00,99.99,,,,,,", "GNGGA,080626.00,,,,,,,,,,,,,"] {
        assert_eq!(parse(&with_sum(none)).unwrap().unwrap().gga(), Ok(None));
    }
    let warned = with_sum("GNRMC,080626.00,V,,,,,,,010710,,,N");
    let warned = parse(&warned).unwrap().unwrap().rmc().unwrap().unwrap();
    assert_eq!(
        (warned.valid, warned.date, warned.place_deg, warned.speed_mps),
        (false, Some([2010, 7, 1]), None, None)
    );
    assert_eq!(parse(&with_sum("GNRMC,,V,,,,,,,,,,N")).unwrap().unwrap().rmc(), Ok(None));
    assert_eq!(parse(&with_sum("GNZDA,,,,,00,00")).unwrap().unwrap().zda(), Ok(None));
    let broken = |from: &str, to: &str| {
        let body = GGA[1..].split('*').next().unwrap().replace(from, to);
        parse(&with_sum(&body)).unwrap().unwrap().gga().unwrap_err().to_string()
    };
    for (from, to, words) in [
        ("2630.73", "2690.73", "latitude '2690.7379654,N': expected ddmm.mm and N or S"),
        (",E,1", ",Q,1", "longitude '08013.9740786,Q'"),
        ("128.703", "x", "height 'x': expected a number"),
        ("0.000", "1e999", "geoid separation '1e999'"),
        ("080626.00", "240626.00", "time '240626.00': expected hhmmss.ss"),
        ("080626.00", "8:06", "time '8:06'"),
        (",128.703,M,0.000,M,0.0,", "", "9 fields: expected at least 12 of GGA"),
    ] {
        let found = broken(from, to);
        assert!(found.starts_with(words), "{found}");
    }
    let rmc = with_sum("GPRMC,080626.00,A,2630.0,N,08013.0,E,0.1,0.0,1407,,");
    assert!(parse(&rmc).unwrap().unwrap().rmc().unwrap_err().to_string().starts_with("date '1407': expected ddmmyy"));
    let rmc = with_sum("GPRMC,080626.00,A,2630.0,N,08013.0,E,-1,0.0,140710,,");
    assert!(parse(&rmc).unwrap().unwrap().rmc().unwrap_err().to_string().starts_with("speed '-1'"));
}
