use super::*;
use gnss::galileo::fnav::FNAV;
use gnss::rinex;

const NAVIC: &[u8] = include_bytes!("../../../scenarios/navic_2026-03-09_10h_12h.rnx");
const QZSS: &[u8] = include_bytes!("../../../scenarios/qzss_2023-03-12_02h_04h.rnx");

fn sets() -> Vec<Ephemeris> {
    let both = rinex::embedded_two_systems().unwrap().ephemerides;
    let fnav = both
        .iter()
        .filter(|set| set.sv.system == System::Galileo)
        .map(|set| FNAV.fields.quantised(&(FNAV.form)(set)).unwrap());
    let fnav: Vec<Ephemeris> = fnav.collect();
    let more = [NAVIC, QZSS].into_iter().flat_map(|file| rinex::read(file, "shipped").unwrap().ephemerides);
    let old = rinex::embedded().unwrap().ephemerides.into_iter().step_by(17);
    both.into_iter().chain(fnav).chain(more).chain(old).filter(|set| set.sv.system != System::Sbas).collect()
}

fn read_back(body: &[u8], near: Option<Epoch>) -> Ephemeris {
    let number = u64::from(body[0]) << 4 | u64::from(body[1]) >> 4;
    ephemeris(&read(number, body).unwrap(), near).unwrap()
}

#[test]
fn an_ephemeris_of_every_message_is_read_back_with_its_orbit_and_clock() {
    let mut seen = Vec::new();
    for set in sets() {
        let body = write(&set).unwrap_or_else(|reason| panic!("{} {}: {reason}", set.sv, set.toe));
        let read = read_back(&body, Some(set.toe.plus_s(3600.0)));
        seen.push(number_of(&set).unwrap());
        assert_eq!((read.sv, read.toe, read.toc), (set.sv, set.toe, set.toc));
        assert_eq!((read.iode, read.iodc, read.ura_index), (set.iode, set.iodc, set.ura_index), "{}", set.sv);
        assert_eq!((read.health, read.aodo), (set.health, if set.sv.system == System::Gps { 0 } else { set.aodo }));
        for minutes in [-10.0, 0.0, 12.0] {
            let at = set.toe.plus_s(60.0 * minutes);
            let (own, other) = (set.state_and_clock_l1(at).unwrap(), read.state_and_clock_l1(at).unwrap());
            // Thirteen digits in the file: of three angles and of the axis, 42 000 km times 1.6e-12 each.
            assert!((own.0.position_m - other.0.position_m).norm() < 3e-4, "{} {minutes}", set.sv);
            assert!((own.1.offset_s - other.1.offset_s).abs() < 1e-15, "{} {minutes}", set.sv);
        }
        // What a message holds is written again with the same bits, but for delays that it does not have.
        assert_eq!(write(&read).unwrap(), body, "{}", set.sv);
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen, numbers().collect::<Vec<_>>());
}

#[test]
fn messages_of_galileo_beidou_and_glonass_state_their_date() {
    for set in sets() {
        let body = write(&set).unwrap();
        let number = number_of(&set).unwrap();
        let read = ephemeris(&super::read(number, &body).unwrap(), None).map(|set| set.toe);
        let is_dated = matches!(set.sv.system, System::Galileo | System::BeiDou | System::Glonass);
        assert_eq!(read, is_dated.then_some(set.toe), "{}", set.sv);
    }
}

#[test]
fn what_a_message_does_not_hold_is_refused_by_its_field() {
    let set = sets().into_iter().find(|set| set.sv.system == System::Gps).unwrap();
    let refused = |set: Ephemeris| write(&set).unwrap_err().to_string();
    let far = refused(Ephemeris { af0_s: 2e-3, ..set.clone() });
    assert!(far.starts_with("DF084 = 0.002 does not fit the message: expected -0.0009765625 to "), "{far}");
    assert!(refused(Ephemeris { eccentricity: f64::NAN, ..set.clone() }).starts_with("DF090 = NaN"));
    let sbas = Sv { system: System::Sbas, number: 20 };
    let told = refused(Ephemeris::blank(sbas, set.toe));
    assert_eq!(told, "S20: no RTCM message has ephemerides of ");
    let slot = Sv { system: System::Glonass, number: 25 };
    assert!(refused(Ephemeris::blank(slot, set.toe)).starts_with("DF040 = NaN"));
}

#[test]
fn any_bits_are_an_ephemeris_or_none() {
    let mut state = 7_u64;
    for round in 0..20_000 {
        let body: Vec<u8> = (0..65)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 56) as u8
            })
            .collect();
        let number = numbers().nth(round % 7).unwrap();
        let table = read(number, &body).unwrap();
        let near = (round % 2 == 0).then(|| Epoch::from_week(2200, 0.0));
        if let Some(set) = ephemeris(&table, near) {
            // Written again where the fields hold it; numbers of satellites may be anything.
            let _ = write(&set);
        }
    }
}
