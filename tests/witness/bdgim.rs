//! BDGIM against the program of its authors, its fields against printed places, and its harmonics against a
//! map of the ionosphere.

use std::collections::BTreeSet;

use gnss::bdgim::{self, Bdgim, Pierce, UnderSun, forecast_tecu, interval};
use gnss::beidou::bcnav1::{self, B_CNAV1};
use gnss::beidou::bcnav2::{self, B_CNAV2};
use gnss::beidou::bcnav3::{self, B_CNAV3};
use gnss::bits::number;
use gnss::broadcast::Ephemeris;
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::ionex::{Interpolation, Maps};
use gnss::ionosphere::{Coefficients, Model};
use gnss::message::{Common, Message, Read};
use gnss::nequick::NequickG;
use gnss::rinex;
use gnss::time::{BDT, Epoch};
use nalgebra::{DMatrix, DVector};

use super::bcnav1::{sets, soft};
use super::orbit::outside;

/// Day and hour, user, look, nine coefficients; pierce point, sum of the harmonics, vertical and slant
/// content as functions of the authors' program give them.
const AUTHORS: &str = include_str!("../../data/witness/bdgim.csv");

/// Coefficients that satellites broadcast in the first hours of 2026-03-09 and of 2023-03-12.
const SENT_2026: [f64; 9] = [30.875, 0.25, 11.625, 10.375, -12.5, 0.75, 0.0, 3.125, 1.875];
const SENT_2023: [f64; 9] = [35.5, 2.0, 12.0, 13.375, -17.25, 1.125, 1.0, 3.0, 0.375];

fn vertical_tecu(model: &Bdgim, pierce: &Pierce, at: Epoch) -> f64 {
    model.vertical_tecu(&pierce.under_sun(at), &forecast_tecu(interval(at).0))
}

#[test]
fn positions_and_contents_are_those_of_the_authors_program() {
    let (mut rows, mut raised) = (0, 0);
    for line in AUTHORS.lines().skip(1) {
        let column: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let day = format!("{:04}-{:02}-{:02}T00:00:00", column[0], column[1], column[2]);
        let at = BDT.instant(Epoch::parse(&day).unwrap().plus_s(3600.0 * column[3]));
        let user = Geodetic::from_degrees(column[4], column[5], 0.0);
        let look = Look { elevation_rad: column[6].to_radians(), azimuth_rad: column[7].to_radians() };
        let model = Bdgim { alpha_tecu: column[8..17].try_into().unwrap() };
        let pierce = Pierce::new(user, look);
        let turn = (pierce.longitude_rad.to_degrees() - column[18] + 180.0).rem_euclid(360.0) - 180.0;
        // Nine digits after the point, and the rounding of an arc sine.
        assert!(
            (pierce.latitude_rad.to_degrees() - column[17]).abs() < 2e-9 && turn.abs() < 2e-9,
            "{line}: {pierce:?}"
        );
        let place = pierce.under_sun(at);
        let series = model.series_tecu(&place, &forecast_tecu(interval(at).0));
        let vertical = vertical_tecu(&model, &pierce, at);
        // Their day is one double, to 3.6e-12 of it: 2.3e-11 rad of the Sun's longitude, along which the
        // content changes by 200 TECU in a radian at most, and 7e-11 rad of the shortest period's phase;
        // three times as much along the line of sight.
        assert!(
            (series - column[19]).abs() < 1e-8 && (vertical - column[20]).abs() < 1e-8,
            "{line}: {series} {vertical}"
        );
        assert!((pierce.obliquity * vertical - column[21]).abs() < 3e-8, "{line}: {}", pierce.obliquity * vertical);
        // The delay follows by the document's factor.
        let delay_m = model.delay_s(user, look, at, 1_176.45e6) * SPEED_OF_LIGHT_MPS;
        let factor_m = 40.28e16 / (1_176.45e6 * 1_176.45e6);
        assert!((delay_m - factor_m * column[21]).abs() < 1e-8, "{line}: {delay_m}");
        rows += 1;
        raised += usize::from(column[19] != column[20]);
    }
    assert_eq!((rows, raised), (108, 6));
}

#[test]
fn the_authors_own_example_comes_out_but_for_what_the_document_has_otherwise() {
    let model = Bdgim {
        alpha_tecu: [
            13.826_420_69,
            -1.780_046_16,
            5.172,
            3.130_309_4,
            -4.589_613_29,
            0.324_838_67,
            -0.078_023_83,
            1.243_125_9,
            0.377_636_27,
        ],
    };
    let at = BDT.instant(Epoch::parse("2020-11-05T17:00:00").unwrap());
    // The pierce point of their program: on the line between two given points, at a distance of 6778.137 km
    // from the Earth's centre.
    let pierce = Pierce {
        latitude_rad: 36.314_836_035_f64.to_radians(),
        longitude_rad: 119.905_336_093_f64.to_radians(),
        obliquity: 1.525_650_965,
    };
    let vertical = vertical_tecu(&model, &pierce, at);
    // A place to 1e-9°, 200 TECU in a radian.
    assert!((vertical - 5.818_458_961).abs() < 1e-8, "{vertical}");
    // Their delay of B1C in metres, by their mapping and their factor.
    let theirs_m = pierce.obliquity * 40.3e16 / (1_575.42e6 * 1_575.42e6) * vertical;
    assert!((theirs_m - 1.441_370_073).abs() < 1e-8, "{theirs_m}");
    // The document's: a factor less by 5e-4, and at this elevation a mapping greater by 1.9 % (1.554639 by
    // their geocentric angle); the pierce point of a geodetic latitude is 0.1° off.
    let here = nalgebra::Vector3::new(-2159945.3149, 4383237.1901, 4085412.3177);
    let there = nalgebra::Vector3::new(-34342443.2642, 24456393.0586, 12949.4754);
    let user = Geodetic::from_ecef(&here);
    let look = gnss::earth::look(user, &here, &there);
    let ours_m = model.delay_s(user, look, at, 1_575.42e6) * SPEED_OF_LIGHT_MPS;
    println!("{ours_m:.4} m, the authors' program {theirs_m:.4} m");
    assert!((ours_m / theirs_m - 1.0185).abs() < 5e-3, "{ours_m} {theirs_m}");
}

/// A message, and where the first of the coefficients' bits is in its unit.
const MESSAGES: [(&Message, u8, usize); 3] = [(&B_CNAV1, 0, 42), (&B_CNAV2, 30, 145), (&B_CNAV3, 30, 124)];

/// The bits of the part of a unit that has the coefficients; `None` of another type of message.
fn bits(message: &Message, kind: u8, sv: u8, symbols: &[bool]) -> Option<Vec<bool>> {
    let soft: Vec<f32> = soft(symbols, false).collect();
    let typed = |bits: Vec<bool>, place: usize| (number(&bits[place..place + 6]) == u128::from(kind)).then_some(bits);
    match message.name {
        "B-CNAV1" => bcnav1::decode(sv, &soft)?.0.three,
        "B-CNAV2" => typed(bcnav2::decode(&soft)?.0, 6),
        _ => typed(bcnav3::decode(&soft)?.0, 0),
    }
}

/// The units of a message that a satellite sends in twelve seconds or a frame, from its reference time on.
fn units(message: &Message, set: &Ephemeris, common: &Common) -> Vec<Vec<bool>> {
    let sender = (message.sender)(common).unwrap();
    let carried = (message.form)(set).timed(|at| BDT.label(at));
    let begin = carried.toe.seconds().div_euclid(36) * 36;
    let starts = (0..message.set_s.max(message.unit_s)).step_by(message.unit_s as usize);
    starts.map(|s| sender.unit(&carried, Epoch::new(begin + s, 0.0)).unwrap()).collect()
}

/// Content that a reader finds in units.
fn read(message: &Message, set: &Ephemeris, units: &[Vec<bool>]) -> Vec<Read> {
    let mut reader = (message.reader)(set.sv);
    let near = BDT.label(set.toe);
    units
        .iter()
        .flat_map(|unit| soft(unit, true).collect::<Vec<f32>>())
        .flat_map(|one| reader.take(one, near))
        .collect()
}

#[test]
fn coefficients_have_their_positions_signs_and_steps_in_all_three_messages() {
    // Eighths of a TECU in fields of 10 and 8 bits, of which the second and the last four have a sign; the
    // fifth has none and is taken below zero (BDS-SIS-ICD-B1C 1.0, 7.8; figures of B2a's and B2b's messages
    // 30).
    let expected: [i64; 9] = [247, 2, 93, 83, 100, 6, -3, 25, 15];
    let alpha_tecu = [30.875, 0.25, 11.625, 10.375, -12.5, 0.75, -0.375, 3.125, 1.875];
    let model = Bdgim { alpha_tecu };
    let all = sets();
    let set = all.iter().find(|set| set.sv.number > 20).unwrap();
    let common = Common { bdgim: Some(model), ..Common::default() };
    for (message, kind, first) in MESSAGES {
        assert_eq!(message.ionosphere.model, Model::Bdgim);
        let units = units(message, set, &common);
        let own: Vec<Vec<bool>> = units.iter().filter_map(|unit| bits(message, kind, set.sv.number, unit)).collect();
        assert!(!own.is_empty());
        for bits in own {
            if kind == 0 {
                assert_eq!(number(&bits[..6]), 1, "page of subframe 3");
            }
            let mut place = first;
            for (index, (expected, length)) in expected.iter().zip([10, 8, 8, 8, 8, 8, 8, 8, 8]).enumerate() {
                let raw = number(&bits[place..place + length]) as i64;
                let raw = if [1, 5, 6, 7, 8].contains(&index) && raw >= 128 { raw - 256 } else { raw };
                assert_eq!(raw, *expected, "{} alpha_{}", message.name, index + 1);
                place += length;
            }
        }
        let news = read(message, set, &units);
        let found: Vec<&Coefficients> = news
            .iter()
            .filter_map(|read| if let Read::Ionosphere(found) = read { Some(found) } else { None })
            .collect();
        assert!(!found.is_empty() && found.iter().all(|found| **found == Coefficients::Bdgim(model)), "{found:?}");
        // They are told when they are read, and with the set.
        let rows = news.iter().filter_map(|read| if let Read::Parameters(rows) = read { Some(rows) } else { None });
        let rows: BTreeSet<_> = rows.flatten().filter(|row| row.parameter.starts_with("alpha_")).collect();
        assert_eq!(rows.len(), 9, "{rows:?}");
        let raw = |name: &str| rows.iter().find(|row| row.parameter == name).map(|row| row.raw);
        assert_eq!((message.ionosphere.coefficients)(&raw), Some(Coefficients::Bdgim(model)));
        // Whole sets are read whether there are coefficients or not, and nine zeros are none.
        let none = read(message, set, &self::units(message, set, &Common::default()));
        for news in [&news, &none] {
            let set = news.iter().find_map(|read| if let Read::Ephemeris(set) = read { Some(set) } else { None });
            assert!(set.is_some(), "{}", message.name);
        }
        assert!(!none.iter().any(|read| matches!(read, Read::Ionosphere(_))), "{}", message.name);
        // What the fields cannot carry is refused by its name.
        for (place, wrong, name) in
            [(0, 128.0, "alpha_1_tecu"), (4, 0.25, "alpha_5_tecu"), (8, -16.125, "alpha_9_tecu")]
        {
            let mut alpha_tecu = alpha_tecu;
            alpha_tecu[place] = wrong;
            let common = Common { bdgim: Some(Bdgim { alpha_tecu }), ..Common::default() };
            let error = (message.sender)(&common).err().unwrap().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}

#[test]
fn records_of_two_days_are_whole_steps_of_the_fields_and_come_back_from_all_messages() {
    for (name, first) in [
        ("nav/BRD400DLR_S_20230710000_01D_MN.rnx.gz", SENT_2023),
        ("multi-gnss/BRD400DLR_S_20260680000_01D_MN.rnx.gz", SENT_2026),
    ] {
        let Some(bytes) = outside(name) else { return };
        let navigation = rinex::read(&bytes, name).unwrap();
        let model = navigation.bdgim.unwrap();
        assert_eq!(model.alpha_tecu, first);
        assert!(!navigation.skipped.iter().any(|reason| reason.contains("CNVX")), "{:?}", navigation.skipped);
        let all = sets();
        for (message, ..) in MESSAGES {
            let common = Common { bdgim: Some(model), ..Common::default() };
            let news = read(message, &all[0], &units(message, &all[0], &common));
            assert!(news.contains(&Read::Ionosphere(Coefficients::Bdgim(model))), "{}", message.name);
        }
    }
}

/// Places every 15° of longitude and, to 75°, 7.5° of latitude, with the cosine of their latitude.
fn grid() -> impl Iterator<Item = (f64, f64, f64)> {
    (-10..=10).flat_map(|row| {
        let latitude_rad = (7.5 * f64::from(row)).to_radians();
        let longitudes = (-12..12).map(move |column| (15.0 * f64::from(column)).to_radians());
        longitudes.map(move |longitude_rad| (latitude_rad, longitude_rad, libm::cos(latitude_rad)))
    })
}

fn above(latitude_rad: f64, longitude_rad: f64) -> Pierce {
    Pierce { latitude_rad, longitude_rad, obliquity: 1.0 }
}

/// Root mean square over the Earth's surface of what nine fitted coefficients leave of the map at `hours`,
/// with the forecast or without; and that of the map.
fn left_tecu(maps: &Maps, hours: &[f64], forecast: bool, bend: impl Fn(UnderSun) -> UnderSun) -> (f64, f64) {
    let (day, _) = maps.span();
    let mut rows: Vec<([f64; 9], f64, f64)> = Vec::new();
    for hour in hours {
        let at = day.plus_s(3600.0 * hour);
        let all = forecast_tecu(interval(at).0).map(|beta| if forecast { beta } else { 0.0 });
        for (latitude_rad, longitude_rad, weight) in grid() {
            let place = bend(above(latitude_rad, longitude_rad).under_sun(at));
            let own = |alpha_tecu: [f64; 9], beta: &[f64; 17]| Bdgim { alpha_tecu }.series_tecu(&place, beta);
            let unit = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
            let harmonics = std::array::from_fn(|k| own(unit(k), &[0.0; 17]));
            let map = maps.vertical_tecu(latitude_rad, longitude_rad, at, Interpolation::Bilinear);
            rows.push((harmonics, map - own([0.0; 9], &all), weight));
        }
    }
    let matrix = DMatrix::from_fn(rows.len(), 9, |row, column| rows[row].0[column] * rows[row].2.sqrt());
    let right = DVector::from_fn(rows.len(), |row, _| rows[row].1 * rows[row].2.sqrt());
    let fitted = matrix.clone().svd(true, true).solve(&right, 1e-12).unwrap();
    let weights: f64 = rows.iter().map(|row| row.2).sum();
    println!("fitted {:.2?}", fitted.as_slice());
    ((right.clone() - matrix * fitted).norm() / weights.sqrt(), right.norm() / weights.sqrt())
}

#[test]
fn nine_coefficients_describe_a_map_of_the_ionosphere_where_sun_and_pole_are_right() {
    let bytes = include_bytes!("../../scenarios/igrg3380.10i.gz");
    let maps = Maps::read(bytes, "igrg3380.10i.gz").unwrap();
    let hours: Vec<f64> = (0..12).map(|k| 2.0 * f64::from(k) + 1.0).collect();
    let (right, map) = left_tecu(&maps, &hours, true, |place| place);
    let (alone, _) = left_tecu(&maps, &hours, false, |place| place);
    let (turned, _) = left_tecu(&maps, &hours, true, |place| UnderSun { longitude_rad: -place.longitude_rad, ..place });
    let (south, _) = left_tecu(&maps, &hours, true, |place| UnderSun { sin_latitude: -place.sin_latitude, ..place });
    println!("rms left {right:.2} TECU of {map:.2}; without forecast {alone:.2}, turned {turned:.2}, south {south:.2}");
    // Broadcast coefficients are to leave 30 % of the delay at most, and fitted ones leave less. The forecast
    // takes a fifth and more of what nine coefficients without it leave, its mirror images add to that.
    assert!(right < 0.3 * map, "{right} {map}");
    assert!([alone, turned, south].iter().all(|wrong| right < 0.8 * wrong), "{right} {alone} {turned} {south}");
}

#[test]
fn the_content_of_two_days_is_that_of_galileo_s_model_of_the_same_days() {
    for (text, alpha_tecu, coefficients) in [
        ("2023-03-12T", SENT_2023, [160.75, 0.371_093_75, 9.063_720_703_125e-3]),
        ("2026-03-09T", SENT_2026, [144.25, -1.171_875e-2, -3.662_109_375e-4]),
    ] {
        let (model, other) = (Bdgim { alpha_tecu }, NequickG { coefficients });
        let mut sums = [0.0; 6];
        for hour in [1, 7, 13, 19] {
            let at = Epoch::parse(&format!("{text}{hour:02}:00:00")).unwrap();
            let (month, ut_h) = at.month_and_hour();
            for (latitude_rad, longitude_rad, weight) in grid().step_by(3) {
                let user = Geodetic { latitude_rad, longitude_rad, height_m: 0.0 };
                let satellite = Geodetic { height_m: 2.02e7, ..user };
                let [one, two] = [
                    vertical_tecu(&model, &above(latitude_rad, longitude_rad), at),
                    other.stec_tecu(user, satellite, month, ut_h),
                ];
                let products = [1.0, one, two, one * one, two * two, one * two];
                sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += weight * product);
            }
        }
        let [all, one, two, squares, others, both] = sums;
        let (mean, mean_2) = (one / all, two / all);
        let [variance, variance_2] = [squares / all - mean * mean, others / all - mean_2 * mean_2];
        let correlation = (both / all - mean * mean_2) / (variance * variance_2).sqrt();
        let apart = (squares / all + others / all - 2.0 * both / all).sqrt();
        println!("{text} means {mean:.1} and {mean_2:.1} TECU, rms apart {apart:.1}, correlation {correlation:.3}");
        // Either is to remove 70 % of the delay (rms): apart by at most √2 times 0.3 of the rms content.
        assert!(correlation > 0.8 && apart < 0.42 * (squares / all).sqrt(), "{text}: {correlation} {apart}");
    }
    assert_eq!(bdgim::INTERVAL_S, 7200);
}
