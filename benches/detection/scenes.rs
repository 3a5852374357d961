//! Scenes of the cases: clean ones of six kinds, spoofers and jammers.
//!
//! Spoofers are like those of scenarios of TEXBAT (T. E. Humphreys, J. A. Bhatti, D. P. Shepard and K. D.
//! Wesson, The Texas Spoofing Test Battery, ION GNSS 2012; ds7: T. E. Humphreys, TEXBAT Data Sets 7 and 8,
//! 2016) in power and kind of push. Limits: they are no recordings; a spoofer's carrier follows its claimed
//! range, so the modes with a locked frequency have none like them; a push of time begins with the spoofer.

use crate::drawn::{Random, Start};
use gnss::satellite::Sv;

const SCENE: &str = include_str!("scene.toml");
const LIGHT_MPS: f64 = 299_792_458.0;
/// C/N0 of all satellites where a jammer's power is relative to it.
const CN0_DBHZ: f64 = 45.0;
/// Begin of an attack.
pub const ON_S: f64 = 50.0;
/// Duration of scenes.
const CLEAN_S: f64 = 240.0;
const ROCKET_S: f64 = 200.0;
const JAMMED_S: f64 = 70.0;
const SPOOFED_S: f64 = 95.0;
/// Share of the time in which a pulsed jammer sends.
const DUTY: f64 = 1e-5 * 1100.0;

/// Kind of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Static,
    TwoSystems,
    Multipath,
    Scintillation,
    Dynamics,
    Oscillator,
    /// Power against the true signals, and final speed of a push of time.
    TimePush(f64, f64),
    /// Power against the true signals, and final speed of a push of position.
    PositionPush(f64, f64),
    /// Push of position that begins 20 dB weaker, with the phases of the true signals.
    PhaseAligned,
    Meaconing,
    Cw(f64),
    Chirp(f64),
    Noise(f64),
    Pulses(f64),
}

/// A kind with its name.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub name: &'static str,
    pub kind: Kind,
}

const fn case(name: &'static str, kind: Kind) -> Case {
    Case { name, kind }
}

/// Scenes without an attack; the first has a plain sky.
pub const CLEAN: [Case; 6] = [
    case("static", Kind::Static),
    case("two systems", Kind::TwoSystems),
    case("urban multipath", Kind::Multipath),
    case("scintillation", Kind::Scintillation),
    case("high dynamics", Kind::Dynamics),
    case("cheap oscillator", Kind::Oscillator),
];

/// Spoofers, and then jammers of mean J/S in dB.
pub const ATTACKS: [Case; 21] = [
    case("like ds2: time push, +10 dB", Kind::TimePush(10.0, 3.0)),
    case("like ds3: time push, +1.3 dB", Kind::TimePush(1.3, 3.0)),
    case("like ds4: position push, +0.4 dB", Kind::PositionPush(0.4, 3.0)),
    case("like ds7: phase aligned, +1.3 dB", Kind::PhaseAligned),
    case("meaconing, +6 dB", Kind::Meaconing),
    case("CW, J/S 0 dB", Kind::Cw(0.0)),
    case("CW, J/S 10 dB", Kind::Cw(10.0)),
    case("CW, J/S 20 dB", Kind::Cw(20.0)),
    case("CW, J/S 30 dB", Kind::Cw(30.0)),
    case("chirp, J/S 0 dB", Kind::Chirp(0.0)),
    case("chirp, J/S 10 dB", Kind::Chirp(10.0)),
    case("chirp, J/S 20 dB", Kind::Chirp(20.0)),
    case("chirp, J/S 30 dB", Kind::Chirp(30.0)),
    case("band noise, J/S 0 dB", Kind::Noise(0.0)),
    case("band noise, J/S 10 dB", Kind::Noise(10.0)),
    case("band noise, J/S 20 dB", Kind::Noise(20.0)),
    case("band noise, J/S 30 dB", Kind::Noise(30.0)),
    case("pulses, J/S 0 dB", Kind::Pulses(0.0)),
    case("pulses, J/S 10 dB", Kind::Pulses(10.0)),
    case("pulses, J/S 20 dB", Kind::Pulses(20.0)),
    case("pulses, J/S 30 dB", Kind::Pulses(30.0)),
];

impl Kind {
    /// Kind of the jammer and its mean J/S.
    pub fn jammer(self) -> Option<(&'static str, f64)> {
        match self {
            Self::Cw(js_db) => Some(("CW", js_db)),
            Self::Chirp(js_db) => Some(("chirp", js_db)),
            Self::Noise(js_db) => Some(("band noise", js_db)),
            Self::Pulses(js_db) => Some(("pulses", js_db)),
            _ => None,
        }
    }

    /// True for a scene of [`CLEAN`].
    pub fn is_clean(self) -> bool {
        CLEAN.iter().any(|case| case.kind == self)
    }

    /// A time and a position for which there are messages.
    pub fn start(self, random: &mut Random) -> Start {
        if self == Self::TwoSystems { Start::near_cartagena(random) } else { Start::anywhere(random) }
    }
}

/// Scene of a case with `seed` at a start, where these satellites are in view.
pub fn scene(kind: Kind, seed: u64, start: &Start, random: &mut Random, in_view: &[Sv]) -> String {
    let place @ [latitude_deg, longitude_deg] = start.place_deg;
    let at_rest = rest(place);
    // That of the street, of the rocket or of a push.
    let azimuth_deg = random.between(0.0, 360.0).round();
    let more = more(kind, random, place, azimuth_deg, in_view);
    let (level, power) = match kind.is_clean() {
        true => ("correlations", "kind = \"link_budget\"".to_owned()),
        false => ("balanced", format!("kind = \"fixed\"\ncn0_dbhz = {CN0_DBHZ}")),
    };
    let (motion, duration_s) = match kind {
        Kind::Multipath => (walk(place, azimuth_deg), CLEAN_S),
        Kind::Dynamics => {
            let rocket = format!(
                "kind = \"rocket\"\nlatitude_deg = {latitude_deg}\nlongitude_deg = {longitude_deg}\nheight_m = 130\n\
                 azimuth_deg = {azimuth_deg}\nelevation_deg = 80\nignition_s = 60\nthrust_mps2 = 225\nburn_s = 5\n\
                 jerk_mps3 = 196\ndrag_m2pkg = 4e-5\ngravity = \"j2\""
            );
            (rocket, ROCKET_S)
        }
        _ if kind.is_clean() => (at_rest, CLEAN_S),
        _ if kind.jammer().is_some() => (at_rest, JAMMED_S),
        _ => (at_rest, SPOOFED_S),
    };
    let clock = match kind {
        Kind::Oscillator => "drift_sps = 5e-7\nageing_per_day = 1e-8\noscillator = \"tcxo\"",
        _ => "drift_sps = 5e-8",
    };
    let (signals, rate_hz) = match kind {
        Kind::TwoSystems => ("signals = [\"GPS L1 C/A\", \"Galileo E1\"]", "6.5e6"),
        _ => ("", "2.6e6"),
    };
    let text = SCENE
        .replace("%start%", &start.time)
        .replace("%duration_s%", &duration_s.to_string())
        .replace("%seed%", &seed.to_string())
        .replace("%signals%", signals)
        .replace("%level%", level)
        .replace("%motion%", &motion)
        .replace("%sample_rate_hz%", rate_hz)
        .replace("%power%", &power)
        .replace("%clock%", clock);
    text + &more
}

fn rest([latitude_deg, longitude_deg]: [f64; 2]) -> String {
    format!("kind = \"static\"\nlatitude_deg = {latitude_deg}\nlongitude_deg = {longitude_deg}\nheight_m = 130")
}

/// A pedestrian who stands for 40 s and then walks along an azimuth.
fn walk([latitude_deg, longitude_deg]: [f64; 2], azimuth_deg: f64) -> String {
    let (sine, cosine) = libm::sincos(azimuth_deg.to_radians());
    let per_deg_m = 111_200.0;
    let north_deg = 350.0 * cosine / per_deg_m;
    let east_deg = 350.0 * sine / per_deg_m / libm::cos(latitude_deg.to_radians());
    let point = |deg: [f64; 2], more: &str| {
        let [latitude_deg, longitude_deg] = deg.map(|deg| format!("{deg:.7}"));
        format!(
            "\n[[motion.point]]\nlatitude_deg = {latitude_deg}\nlongitude_deg = {longitude_deg}\nheight_m = 130\n\
             {more}\n"
        )
    };
    let begin = point([latitude_deg, longitude_deg], "speed_mps = 0\nhold_s = 40");
    let end = point([latitude_deg + north_deg, longitude_deg + east_deg], "speed_mps = 1.5");
    format!("kind = \"waypoints\"\nacceleration_mps2 = 0.5\njerk_mps3 = 0.5\n{begin}{end}")
}

/// Tables that a case adds.
fn more(kind: Kind, random: &mut Random, place: [f64; 2], azimuth_deg: f64, in_view: &[Sv]) -> String {
    match kind {
        Kind::Static | Kind::TwoSystems | Kind::Oscillator => String::new(),
        Kind::Dynamics => "[receiver.tracking]\npll_bandwidth_hz = 35\nintegration = 2\n".to_owned(),
        Kind::Multipath => {
            let mut wall = |azimuth_deg: f64, amplitude: f64| {
                let (azimuth_deg, distance_m) = (azimuth_deg % 360.0, random.between(8.0, 30.0));
                format!(
                    "[[multipath]]\nkind = \"wall\"\nazimuth_deg = {azimuth_deg}\ndistance_m = {distance_m:.2}\n\
                     amplitude = {amplitude}\n\n"
                )
            };
            let walls = wall(azimuth_deg + 90.0, 0.4) + &wall(azimuth_deg + 270.0, 0.3);
            walls + "[[multipath]]\nkind = \"ground\"\nheight_m = 1.6\namplitude = 0.25\n"
        }
        Kind::Scintillation => {
            let mut left = in_view.to_vec();
            let own: Vec<String> =
                (0..4).filter_map(|_| random.take(&mut left)).map(|sv| format!("\"{sv}\"")).collect();
            format!("[scintillation]\ns4 = 0.7\ndecorrelation_s = 0.8\nsatellites = [{}]\n", own.join(", "))
        }
        Kind::TimePush(power_db, speed_mps) => {
            let drift = speed_mps / LIGHT_MPS;
            let bias_s = -drift * ON_S;
            format!(
                "[[spoofer]]\non_s = {ON_S}\npower_db = {power_db}\nclock_bias_s = {bias_s:e}\n\
                 clock_drift_sps = {drift:e}\n"
            )
        }
        Kind::PositionPush(power_db, speed_mps) => {
            format!(
                "[[spoofer]]\non_s = {ON_S}\npower_db = {power_db}\n\n[spoofer.drag]\nstart_s = {}\n\
                 azimuth_deg = {azimuth_deg}\nspeed_mps = {speed_mps}\nacceleration_mps2 = 0.5\n",
                ON_S + 5.0
            )
        }
        Kind::PhaseAligned => {
            format!(
                "[[spoofer]]\non_s = {ON_S}\npower_start_db = -20\npower_db = 1.3\nramp_s = 10\n\n[spoofer.drag]\n\
                 start_s = {}\nazimuth_deg = {azimuth_deg}\nspeed_mps = 1\nacceleration_mps2 = 0.1\n",
                ON_S + 10.0
            )
        }
        Kind::Meaconing => {
            // Noise of the meaconer's front end is amplified as its signals are.
            let late_s = random.between(100.0, 300.0) / LIGHT_MPS;
            let moved = [place[0] + random.between(-1e-3, 1e-3), place[1]];
            format!(
                "[[spoofer]]\non_s = {ON_S}\npower_db = 6\nclock_bias_s = {:e}\n\n[spoofer.motion]\n{}\n\n{}",
                -late_s,
                rest(moved),
                jammer("noise", "bandwidth_hz = 2.046e6\n", 10.0 * libm::log10(2.046e6) - CN0_DBHZ + 6.0)
            )
        }
        Kind::Cw(js_db) => jammer("cw", &format!("offset_hz = {}\n", random.between(-4e5, 4e5).round()), js_db),
        Kind::Chirp(js_db) => {
            let sweep_s = random.between(2e-5, 5e-4);
            jammer("chirp", &format!("sweep_hz = 2e6\nsweep_s = {sweep_s:.4e}\n"), js_db)
        }
        Kind::Noise(js_db) => jammer("noise", "bandwidth_hz = 2.046e6\n", js_db),
        // The power of a pulse is that while it is on.
        Kind::Pulses(js_db) => {
            jammer("pulse", "width_s = 1e-5\nrate_hz = 1100\njitter = 0.5\n", js_db - 10.0 * libm::log10(DUTY))
        }
    }
}

fn jammer(kind: &str, keys: &str, js_db: f64) -> String {
    format!("[[interference]]\nkind = \"{kind}\"\n{keys}js_db = {js_db:.2}\non_s = {ON_S}\n")
}
