//! Cases 8 to 12: elements at the edge of being an orbit, sets at the edge of their age, fields at the edge
//! of their bits.

use std::collections::BTreeMap;
use std::io::Read;

use generator::catalogue::Catalogue;
use gnss::bits::Field;
use gnss::broadcast::{Ephemeris, OrbitError, solve_kepler};
use gnss::earth::Geodetic;
use gnss::galileo::cnav;
use gnss::glonass::gnav;
use gnss::gps::l1ca::L1_CA;
use gnss::message::Message;
use gnss::record::Observation;
use gnss::rinex;
use gnss::satellite::Sv;
use gnss::sbas;
use gnss::signal::SIGNALS;
use gnss::time::{Epoch, Rate, SampleClock};
use receiver::position::{CodeNoise, IonosphereChoice, NoFix, PositionSettings, Solver, TroposphereChoice};
use receiver::track::CodeDiscriminator;
use receiver::track::loops::CodeShape;

use crate::figures::{ALL, CA, NONE, Worst, case};
use crate::run;

fn set() -> Ephemeris {
    rinex::embedded().unwrap().ephemerides[0].clone()
}

#[test]
fn a_circle_has_no_perigee_and_needs_none() {
    let the = case(8, "e = 0", NONE);
    let circle = Ephemeris { eccentricity: 0.0, ..set() };
    let (mut worst_m, mut finite) = (Worst::default(), 0);
    for k in 0..200 {
        let at = circle.toe.plus_s(72.0 * f64::from(k) - 7200.0);
        // The perigee may be anywhere on a circle.
        let turn = 0.031 * f64::from(k);
        let other = Ephemeris { omega_rad: circle.omega_rad + turn, m0_rad: circle.m0_rad - turn, ..circle.clone() };
        let (a, b) = (circle.state(at).unwrap(), other.state(at).unwrap());
        let clock = circle.clock_l1(at).unwrap();
        let all = a.position_m.iter().chain(&a.velocity_mps).all(|x| x.is_finite()) && clock.offset_s.is_finite();
        finite += usize::from(all);
        worst_m.take((a.position_m - b.position_m).norm(), || {
            format!("perigee {turn:.3} rad on, toe + {} s", 72 * k - 7200)
        });
    }
    the.all("states finite", finite, 200);
    // Angles up to 2π + 6 are rounded to 8.9e-16 rad, 2.4e-8 m at 2.66e7 m, a few times.
    the.at_most("orbit with the perigee elsewhere on the circle", worst_m, 1e-6, "m");
}

#[test]
fn keplers_equation_is_solved_up_to_the_parabola_and_refused_beyond() {
    let the = case(9, "e = 0.99, 0.9999", NONE);
    for eccentricity in [0.99, 0.9999] {
        let (mut worst_rad, mut solved) = (Worst::default(), 0);
        for k in -20_000..=20_000 {
            // Also dense near the perigee, where the equation is stiff.
            let mean = if k % 2 == 0 { f64::from(k) * 1.57e-4 } else { libm::pow(f64::from(k) * 1e-4, 3.0) * 0.39 };
            let Some(anomaly) = solve_kepler(mean, eccentricity) else { continue };
            solved += 1;
            let residual_rad = (anomaly - eccentricity * libm::sin(anomaly) - mean).abs();
            worst_rad.take(residual_rad, || format!("mean anomaly of {mean:.6} rad"));
        }
        the.all(&format!("e = {eccentricity}: solved in 20 steps"), solved, 40_001);
        the.at_most(&format!("e = {eccentricity}: residual"), worst_rad, 1e-13, "rad");
    }
    let refused = [1.0, 1.5, -0.1, f64::NAN]
        .iter()
        .filter(|e| Ephemeris { eccentricity: **e, ..set() }.state(set().toe).is_err())
        .count();
    the.all("no ellipse: refused by name", refused, 4);
}

#[test]
fn no_semi_major_axis_and_no_reference_time_are_no_orbit() {
    let the = case(10, "√A = 0, toe missing", NONE);
    let bad = [0.0, -5153.0, f64::NAN, f64::INFINITY, 1e9];
    let refused = bad.iter().filter(|a| {
        let error = Ephemeris { sqrt_a_sqrtm: **a, ..set() }.state(set().toe);
        matches!(error, Err(OrbitError::Element { element: "sqrt_a", .. }))
    });
    the.all("√A that is none: refused by name", refused.count(), bad.len());
    let packed = include_bytes!("../../src/gnss/data/brdc1820-2010.n.gz");
    let mut text = String::new();
    flate2::read::MultiGzDecoder::new(&packed[..]).read_to_string(&mut text).unwrap();
    // One record of eight lines behind the header; its fourth line begins with the reference time.
    let header_end = text.find("END OF HEADER").unwrap();
    let body = header_end + text[header_end..].find('\n').unwrap() + 1;
    let mut lines: Vec<String> = text[body..].lines().take(16).map(str::to_owned).collect();
    lines[3].replace_range(3..22, &" ".repeat(19));
    let damaged = format!("{}{}\n", &text[..body], lines.join("\n"));
    let found = rinex::read(damaged.as_bytes(), "damaged").unwrap();
    the.all(
        "record without toe: left out and told, its neighbour kept",
        usize::from(found.ephemerides.len() == 1 && !found.skipped.is_empty()),
        1,
    );
}

/// Observations of a sky at `at`, as a receiver would have them, from the sets' own orbits.
fn observations(sets: &BTreeMap<Sv, Ephemeris>, place: Geodetic, at: Epoch) -> Vec<Observation> {
    let here = place.to_ecef();
    let seen = |set: &Ephemeris| {
        let range_m = (set.state(at.plus_s(-0.075)).ok()?.position_m - here).norm();
        let sent = at.plus_s(-range_m / 299_792_458.0);
        Some(Observation {
            sample: 0,
            sv: set.sv,
            signal: &L1_CA,
            sent_s: sent.seconds(),
            sent_fraction_s: sent.fraction(),
            pseudorange_m: range_m,
            carrier_cycles: 0.0,
            doppler_hz: 0.0,
            cn0_dbhz: 45.0,
            locked_s: 1.0,
        })
    };
    sets.values().filter_map(seen).collect()
}

#[test]
fn an_old_set_is_sent_by_no_satellite_and_used_by_no_receiver() {
    let the = case(11, "ephemeris age", CA);
    let own = Ephemeris { long_fit: false, ..set() };
    let (catalogue, _) = Catalogue::new(vec![own.clone()]);
    let at = |age_s: f64| catalogue.sent_at(own.sv, own.toe.plus_s(age_s)).is_some();
    let edges = [(-7200.0, true), (-7200.1, false), (7199.9, true), (7200.0, false), (14_400.0, false)];
    the.all("sent from toe − 2 h to toe + 2 h and no longer", edges.iter().filter(|(s, on)| at(*s) == *on).count(), 5);
    let scene = run::try_scene(
        &run::text(60.0, &format!("{}[front_end]\nsample_rate_hz = 2.6e6\n[power]\ncn0_dbhz = 45\n", run::PLACE))
            .replace("2010-07-01T08:05:58", "2010-07-03T08:05:58"),
    );
    the.all(
        "scene two days after its file: refused with the file's span",
        usize::from(scene.is_err_and(|e| e.contains("navigation"))),
        1,
    );
    // A receiver keeps a set ten minutes longer, for want of a newer one.
    let sets = rinex::embedded().unwrap().ephemerides;
    let toe = Epoch::parse("2010-07-01T08:00:00").unwrap();
    let sets: BTreeMap<Sv, Ephemeris> = sets
        .into_iter()
        .filter(|set| set.toe == toe && set.health == 0 && !set.long_fit)
        .map(|set| (set.sv, set))
        .collect();
    let settings = PositionSettings {
        ionosphere: IonosphereChoice::None,
        troposphere: TroposphereChoice::None,
        ..PositionSettings::default()
    };
    let rate = Rate::from_hz(1e6).unwrap();
    let noise = CodeNoise {
        chip_m: 293.05,
        share: 1.0,
        shape: CodeShape::triangle(0.5),
        discriminator: CodeDiscriminator::EarlyMinusLate,
        bandwidth_hz: 0.5,
        integration_s: 0.004,
    };
    let refused = [7_801.0, 14_400.0, 90_000.0].iter().filter(|age_s| {
        let at = toe.plus_s(**age_s);
        let seen = observations(&sets, Geodetic::from_degrees(26.5, 80.2, 130.0), at);
        assert!(seen.len() > 20);
        let found = Solver::new(&settings, vec![(&L1_CA, noise)], rate).solve(
            0,
            SampleClock { start: at, rate },
            &seen,
            &sets.values().cloned().collect(),
            None,
        );
        matches!(found, Err(NoFix::TooFew { have: 0, .. }))
    });
    the.all("fix with sets older than 2 h 10 min: refused", refused.count(), 3);
}

#[test]
fn every_field_holds_its_extremes_exactly() {
    let the = case(12, "message fields' extremes", ALL);
    let mut messages: BTreeMap<&str, &Message> = BTreeMap::new();
    let components = SIGNALS.iter().flat_map(|signal| signal.components);
    messages.extend(components.filter_map(|component| component.message).map(|message| (message.name, message)));
    let (mut held, mut of, mut least) = (0, 0, usize::MAX);
    for (name, message) in &messages {
        // Those that RINEX has otherwise have their tables elsewhere.
        let fields: Vec<&Field> = match *name {
            "GNAV" => gnav::tables().into_iter().flat_map(|(_, table)| table).collect(),
            "C/NAV" => cnav::tables().into_iter().flat_map(|(_, table)| table).collect(),
            "SBAS" => sbas::message::tables().into_iter().flat_map(|(_, table)| table).collect(),
            _ => message.rinex.map(|records| (records.fields)()).unwrap().into_iter().flat_map(|(_, t)| t).collect(),
        };
        least = least.min(fields.len());
        for field in fields {
            let (low, high) = field.range();
            for raw in [low, low + 1, -1, 0, 1, high - 1, high].into_iter().filter(|raw| (low..=high).contains(raw)) {
                // D2 has the most, ten subframes of 300 bits.
                let mut data = vec![raw & 1 == 0; 3000];
                field.write(&mut data, raw);
                of += 1;
                held += usize::from(field.read(&data) == raw && field.raw(field.value(raw)) == Ok(raw));
            }
        }
    }
    let figure = format!("fields of {} messages: written, read, scaled and scaled back", messages.len());
    the.all(&figure, held, of);
    assert!(messages.len() == 20 && least > 5, "{} {least}", messages.len());
}
