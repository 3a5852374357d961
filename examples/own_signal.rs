//! A system of one's own: time scale, code, message and signal, from samples to a position and the judge.
//!
//! The satellites are numbered like those of GPS and fly on their orbits with turned nodes. Nothing else of
//! them is built in: their message carries an ephemeris in one frame of six seconds.
//!
//! `cargo run --release --example own_signal` ends with an error if the judge finds a figure beyond its
//! limit.

use std::collections::VecDeque;
use std::error::Error;
use std::sync::Arc;

use gnss_twin::judge::Status;
use gnss_twin::message::{
    Common, FieldError, IonosphereForm, IonosphereModel, Message, Parameters, Read, Reader, Sender, SetFields, SetForm,
};
use gnss_twin::orbit::embedded_navigation;
use gnss_twin::prelude::*;
use gnss_twin::record::NavigationRow;
use gnss_twin::scene::{Catalogue, Senders};
use gnss_twin::settings::{IonosphereChoice, TroposphereChoice};
use gnss_twin::signal::{Carrier, Component, Layer, SecondaryCode, always, register};
use gnss_twin::time::TimeScale;

/// Time of the system: seven seconds behind GPS time.
static OWN_TIME: TimeScale = TimeScale { name: "own time", behind_gpst_s: 7, has_leap_seconds: false };

/// One component in BOC(1,1): a code of 4 ms, and one symbol in each of its periods.
static OWN: Signal = Signal {
    name: "own L1",
    rinex: "1X",
    system: System::Gps,
    time: &OWN_TIME,
    constellation: [1, 32],
    carrier: Carrier::Common(1_575.42e6),
    sent: always,
    minimum_power_dbw: None,
    components: &[Component {
        power_share: 1.0,
        phase_cycles: 0.0,
        chip_rate_hz: 1.023e6,
        code_chips: 4092,
        code: &|number| (1..=32).contains(&number).then(|| code(number)),
        layers: &[Layer::BOC11],
        secondary_code: SecondaryCode::None,
        message: Some(&FRAMES),
    }],
};

/// Chips of a satellite: bits of a generator (xorshift) that its number starts.
fn code(number: u8) -> Vec<i8> {
    let mut state = 0x9e37_79b9 ^ u32::from(number) << 13;
    let mut chip = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        if state & 1 == 0 { 1 } else { -1 }
    };
    (0..4092).map(|_| chip()).collect()
}

/// Frames of six seconds, each with time and ephemeris.
static FRAMES: Message = Message {
    name: "own frames",
    symbol_s: 0.004,
    bit: |_| &[1],
    unit_s: 6,
    decided_after: 0,
    set_s: 6,
    first_s: 0,
    sender: |_| Ok(Box::new(Frames)),
    number: |_| 1,
    timed: &[1],
    dated: &[],
    set: &[1],
    reduced: &[],
    ionosphere: IonosphereForm { model: IonosphereModel::Klobuchar, unit: |_| false, coefficients: |_| None },
    fields: &Fields,
    parameters: |symbols| opened(symbols).map(|(_, parameters)| (true, parameters)),
    reader: |sv| Box::new(FrameReader { sv, symbols: VecDeque::new(), last: None }),
    form: |set| Ephemeris { form: &SETS, ..set.clone() },
    sets: &SETS,
    alert: None,
    rinex: None,
};

/// Clock of these ephemerides: that of the one signal, without group delay.
static SETS: SetForm = SetForm {
    name: "own frames",
    group_delay_s: |_, _| 0.0,
    serves: |signal| signal.carries(&FRAMES),
    given_delay_s: |_| 0.0,
    is_healthy: |set| set.health == 0,
    healthy: |set, _| Some(set.health == 0),
    rinex_sources: None,
};

/// Symbols of a frame; pattern with which it begins; check over what lies between.
const FRAME_SYMBOLS: usize = 1500;
const PATTERN: u64 = 0x1ACF_FC1D;
const WORD: usize = 32;

/// Integers of a frame: name and bits.
const INTEGERS: [(&str, usize); 4] = [("issue", 16), ("health", 16), ("toe_s", 40), ("toc_s", 40)];

/// Real numbers of a frame, each as the 64 bits of an `f64`.
type Real = (&'static str, fn(&mut Ephemeris) -> &mut f64);
const REALS: [Real; 18] = [
    ("sqrt_a_sqrtm", |set| &mut set.sqrt_a_sqrtm),
    ("eccentricity", |set| &mut set.eccentricity),
    ("m0_rad", |set| &mut set.m0_rad),
    ("delta_n_radps", |set| &mut set.delta_n_radps),
    ("omega0_rad", |set| &mut set.omega0_rad),
    ("omega_dot_radps", |set| &mut set.omega_dot_radps),
    ("omega_rad", |set| &mut set.omega_rad),
    ("i0_rad", |set| &mut set.i0_rad),
    ("idot_radps", |set| &mut set.idot_radps),
    ("cuc_rad", |set| &mut set.cuc_rad),
    ("cus_rad", |set| &mut set.cus_rad),
    ("crc_m", |set| &mut set.crc_m),
    ("crs_m", |set| &mut set.crs_m),
    ("cic_rad", |set| &mut set.cic_rad),
    ("cis_rad", |set| &mut set.cis_rad),
    ("af0_s", |set| &mut set.af0_s),
    ("af1_sps", |set| &mut set.af1_sps),
    ("af2_sps2", |set| &mut set.af2_sps2),
];

/// Makes the frames of all satellites.
struct Frames;

impl Sender for Frames {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        if start.fraction() != 0.0 || start.seconds() % FRAMES.unit_s != 0 {
            let expected = "a multiple of six seconds";
            return Err(FieldError::Start { message: FRAMES.name, start_s: start.tow_s(), expected });
        }
        let mut set = ephemeris.clone();
        let integers = [i64::from(set.iode), i64::from(set.health), set.toe.seconds(), set.toc.seconds()];
        let mut frame = Vec::with_capacity(FRAME_SYMBOLS);
        push(&mut frame, PATTERN, WORD);
        push(&mut frame, start.seconds() as u64, 40);
        INTEGERS.iter().zip(integers).for_each(|((_, bits), value)| push(&mut frame, value as u64, *bits));
        REALS.iter().for_each(|(_, real)| push(&mut frame, real(&mut set).to_bits(), 64));
        let check = check(&frame[WORD..]);
        push(&mut frame, check, WORD);
        frame.resize(FRAME_SYMBOLS, false);
        Ok(frame)
    }
}

fn push(frame: &mut Vec<bool>, value: u64, bits: usize) {
    frame.extend((0..bits).rev().map(|bit| value >> bit & 1 == 1));
}

/// Remainder by the polynomial of CRC-32.
fn check(bits: &[bool]) -> u64 {
    let step = |register: u32, bit: &bool| {
        let shifted = register << 1;
        if (register >> 31 == 1) == *bit { shifted } else { shifted ^ 0x04C1_1DB7 }
    };
    u64::from(bits.iter().fold(u32::MAX, step))
}

/// Time at which a frame began, and its parameters; `None` where pattern or check are wrong.
fn opened(frame: &[bool]) -> Option<(Epoch, Parameters)> {
    let mut at = 0;
    let mut take = |bits: usize| {
        let piece = frame.get(at..at + bits)?;
        at += bits;
        Some(piece.iter().fold(0_u64, |value, bit| value << 1 | u64::from(*bit)))
    };
    if take(WORD)? != PATTERN {
        return None;
    }
    let start = Epoch::new(take(40)? as i64, 0.0);
    let names = INTEGERS.into_iter().chain(REALS.map(|(name, _)| (name, 64)));
    let parameters: Parameters = names.map(|(name, bits)| Some((name, take(bits)? as i64))).collect::<Option<_>>()?;
    let stated = take(WORD)?;
    (check(frame.get(WORD..at - WORD)?) == stated).then_some((start, parameters))
}

/// Fields of ephemerides; no fault changes one.
struct Fields;

impl SetFields for Fields {
    fn parameters(&self) -> Vec<&'static str> {
        vec!["issue"]
    }

    fn elements(&self, sv: Sv, raw: &dyn Fn(&str) -> Option<i64>, _: Epoch) -> Option<Ephemeris> {
        let time = |name| raw(name).map(|seconds| Epoch::new(seconds, 0.0));
        let mut set = Ephemeris { form: &SETS, toc: time("toc_s")?, ..Ephemeris::blank(sv, time("toe_s")?) };
        set.iode = raw("issue")? as u16;
        set.iodc = set.iode;
        set.health = raw("health")? as u16;
        for (name, real) in REALS {
            *real(&mut set) = f64::from_bits(raw(name)? as u64);
        }
        Some(set)
    }
}

/// Finds frames in soft symbols.
#[derive(Debug)]
struct FrameReader {
    sv: Sv,
    /// Newest symbols, a frame at most.
    symbols: VecDeque<f32>,
    /// Parameters that were reported last.
    last: Option<Parameters>,
}

impl Reader for FrameReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        self.symbols.push_back(soft);
        if self.symbols.len() > FRAME_SYMBOLS {
            self.symbols.pop_front();
        }
        let hard = |inverted: bool| self.symbols.iter().map(|soft| (*soft < 0.0) != inverted).collect::<Vec<bool>>();
        let found = [false, true].into_iter().find_map(|inverted| Some((inverted, opened(&hard(inverted))?)));
        let Some((inverted, (start, parameters))) = found else { return Vec::new() };
        let (symbols, of_week_s) = (FRAME_SYMBOLS as u64, start.tow_whole_s());
        let mut news = vec![Read::Unit { symbols, of_week_s, inverted }, Read::Time(start)];
        if self.last.as_ref() != Some(&parameters) {
            let raw = |wanted: &str| parameters.iter().find(|(name, _)| *name == wanted).map(|(_, raw)| *raw);
            if let Some(set) = Fields.elements(self.sv, &raw, near) {
                let issue = u32::from(set.iode);
                news.push(Read::Ephemeris(Box::new(set)));
                let rows = NavigationRow::each(self.sv, FRAMES.name, issue, parameters.clone());
                news.push(Read::Parameters(rows.collect()));
            }
            self.last = Some(parameters);
        }
        news
    }

    fn skip(&mut self) {
        self.symbols.clear();
    }

    fn doubt(&mut self) {}

    fn missing(&self) -> Vec<u8> {
        if self.last.is_some() { Vec::new() } else { vec![1] }
    }
}

/// A satellite of the system: a GPS orbit with its node turned, dated in the system's time.
fn satellite(set: &Ephemeris) -> Ephemeris {
    Ephemeris {
        sv: Sv { system: OWN.system, number: set.sv.number },
        form: &SETS,
        omega0_rad: set.omega0_rad + 0.4,
        iodc: set.iode,
        tgd_s: 0.0,
        ..set.clone().timed(|label| OWN_TIME.instant(label))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    register(&OWN)?;
    let scenario = Scenario::builder("own_signal")
        .start(Epoch::parse("2010-07-01T08:05:58")?)
        .duration_s(30.0)
        .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
        .signals(&[&OWN])
        .sample_rate_hz(5e6)
        .cn0_dbhz(45.0)
        .noise()
        .build()?;
    let mut settings = Settings::default();
    // The scene has no atmosphere.
    settings.position.ionosphere = IonosphereChoice::None;
    settings.position.troposphere = TroposphereChoice::None;
    let mut twin = Twin::new(&scenario)?.with_settings(settings);
    let (catalogue, _) = Catalogue::new(embedded_navigation()?.ephemerides.iter().map(satellite).collect());
    let catalogue = Arc::new(catalogue);
    for scene in twin.scenes_mut() {
        scene.catalogue = Arc::clone(&catalogue);
        scene.messages = Arc::new(Senders::new(&Common::default(), &scene.signals)?);
    }
    let (run, summary) = twin.run_judged(None)?;
    println!("{}\n{}\n{summary}", run.generated[0], run.outcome);
    let failed: Vec<&str> = summary.details.verdict.broken().map(|row| row.figure.as_str()).collect();
    if run.fixes().count() == 0 || summary.details.verdict.status() == Status::Fail {
        return Err(format!("{} fixes, beyond their limits: {failed:?}", run.fixes().count()).into());
    }
    Ok(())
}
