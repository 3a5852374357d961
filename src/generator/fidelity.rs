//! Choices that trade speed for accuracy, each with the error and the cost that were measured for it.
//!
//! A scene names a level or single knobs; [`choices`] says what was picked and what it is worth. The figures
//! are those of `reports/trade.csv` (`cargo bench --bench trade` fills it), rounded up; costs are one core of
//! the machine named there. Limits: a knob's figure assumes that every other knob is at its best.

use serde::Serialize;

use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::facts::Edge;
use gnss::signal::{Component, Layers, Signal};

/// Rate of the code that the figures were measured with.
const CHIP_HZ: f64 = 1.023e6;

/// A name for a value of every knob.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grade {
    /// Nearest chips, carrier within 1e-3 cycle and spurs below −70 dBc.
    Fast,
    /// The cheapest value of each knob whose error is below the noise of an ordinary scene.
    Balanced,
    /// `f64` for every sample: what the others are measured against.
    Reference,
}

/// How a chip's edge falls between samples. Each keeps the mean power of the waveform at one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeEdge {
    /// The chip at the sample's instant.
    Nearest,
    /// The mean of the waveform over the sample's interval.
    Area,
    /// The waveform through a linear-phase low-pass filter just below half the sample rate.
    BandLimited,
}

/// How samples are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arithmetic {
    /// Lanes of single precision, anchored again at the 64-bit phase every 4096 samples at least.
    F32,
    /// Each sample by itself in double precision.
    F64,
}

/// Every knob, with the level that they were taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fidelity {
    /// The level that it was chosen by.
    pub grade: Grade,
    /// How code edges fall between samples.
    pub code_edge: CodeEdge,
    /// What of waveforms of several layers is sent. Every level sends all of them.
    pub waveform: Layers,
    /// Of the carrier and the code's place, sample by sample.
    pub carrier: Arithmetic,
    /// Of the thermal noise's radius and angle; the random words are the same.
    pub noise: Arithmetic,
    /// Largest error of the carrier between knots.
    pub knot_tolerance_cycles: f64,
    /// Error of the code below which `balanced` chooses.
    pub allowed_m: f64,
}

impl Grade {
    /// Every level and its name in a scenario.
    pub const NAMES: [(&'static str, Self); 3] =
        [("fast", Self::Fast), ("balanced", Self::Balanced), ("reference", Self::Reference)];

    /// Its name in a scenario.
    pub fn name(self) -> &'static str {
        name_of(&Self::NAMES, self)
    }
}

impl CodeEdge {
    /// Every edge and its name in a scenario.
    pub const NAMES: [(&'static str, Self); 3] =
        [("nearest", Self::Nearest), ("area", Self::Area), ("band_limited", Self::BandLimited)];

    /// Its name in a scenario.
    pub fn name(self) -> &'static str {
        name_of(&Self::NAMES, self)
    }

    /// As the scene's facts state it.
    pub fn fact(self) -> Edge {
        match self {
            Self::Nearest => Edge::Nearest,
            Self::Area => Edge::Area,
            Self::BandLimited => Edge::BandLimited,
        }
    }
}

impl Arithmetic {
    /// Both and their names in a scenario.
    pub const NAMES: [(&'static str, Self); 2] = [("f32", Self::F32), ("f64", Self::F64)];

    /// Its name in a scenario.
    pub fn name(self) -> &'static str {
        name_of(&Self::NAMES, self)
    }
}

fn name_of<T: PartialEq>(names: &[(&'static str, T)], value: T) -> &'static str {
    names.iter().find(|(_, known)| *known == value).map_or("", |(name, _)| *name)
}

impl Fidelity {
    /// The knobs of a level.
    pub const fn of(grade: Grade) -> Self {
        match grade {
            // Half the tolerance is the secant's within a run, a parabola of that height A (cycles) that
            // repeats with the runs: its first sideband is 2π·A·2/π², −72 dBc for A = 2e-4.
            Grade::Fast => Self {
                grade,
                code_edge: CodeEdge::Nearest,
                waveform: Layers::Whole,
                carrier: Arithmetic::F32,
                noise: Arithmetic::F32,
                knot_tolerance_cycles: 4e-4,
                allowed_m: LARGEST_BIAS_M,
            },
            // 1e-4 cycle is 19 µm: a carrier loop at 50 dB-Hz has forty times that.
            Grade::Balanced => Self {
                grade,
                code_edge: CodeEdge::Area,
                waveform: Layers::Whole,
                carrier: Arithmetic::F32,
                noise: Arithmetic::F32,
                knot_tolerance_cycles: 1e-4,
                allowed_m: LARGEST_BIAS_M,
            },
            // Finer knots would only follow the rounding of 1.3e8 cycles in f64 (1.5e-8 for each operation).
            Grade::Reference => Self {
                grade,
                code_edge: CodeEdge::BandLimited,
                waveform: Layers::Whole,
                carrier: Arithmetic::F64,
                noise: Arithmetic::F64,
                knot_tolerance_cycles: 1e-6,
                allowed_m: LARGEST_BIAS_M,
            },
        }
    }

    /// Measured time for one sample of one satellite, in ns on one core, everything that the generator does
    /// included.
    pub fn satellite_sample_ns(&self, rate_hz: f64) -> f64 {
        // Edges come once in so many samples: what a filter's response costs falls with the rate.
        let dense = rate_hz >= 8e6;
        match (self.carrier, self.code_edge, dense) {
            (Arithmetic::F32, CodeEdge::Nearest, _) => 0.3,
            (Arithmetic::F32, CodeEdge::Area, _) => 0.4,
            (Arithmetic::F32, CodeEdge::BandLimited, false) => 3.4,
            (Arithmetic::F32, CodeEdge::BandLimited, true) => 1.5,
            (Arithmetic::F64, CodeEdge::Nearest, _) => 0.8,
            (Arithmetic::F64, CodeEdge::Area, _) => 0.95,
            (Arithmetic::F64, CodeEdge::BandLimited, false) => 1.6,
            (Arithmetic::F64, CodeEdge::BandLimited, true) => 0.7,
        }
    }

    /// The knobs of a level for samples at `rate_hz`: `balanced` takes the cheapest edges whose code error is
    /// below `allowed_m`, for which see [`allowed_m`], and never nearest ones, whose spurs are those of
    /// `fast`.
    pub fn suited(grade: Grade, rate_hz: f64, allowed_m: f64) -> Self {
        let level = Self { allowed_m, ..Self::of(grade) };
        if grade != Grade::Balanced {
            return level;
        }
        CodeEdge::NAMES
            .into_iter()
            .map(|(_, code_edge)| Self { code_edge, ..level })
            .filter(|fidelity| fidelity.code_edge != CodeEdge::Nearest && fidelity.code_bias_m(rate_hz) < allowed_m)
            .min_by(|a, b| a.satellite_sample_ns(rate_hz).total_cmp(&b.satellite_sample_ns(rate_hz)))
            .unwrap_or(Self { code_edge: CodeEdge::BandLimited, ..level })
    }

    /// Error of a code whose phase is at rest on the sampling grid, root mean square over phases, in
    /// metres: measured, and for area edges computed.
    pub fn code_bias_m(&self, rate_hz: f64) -> f64 {
        let near = |at: [(f64, f64); 3]| {
            at.into_iter().rev().find(|(from_hz, _)| rate_hz >= *from_hz).map_or(at[0].1, |(_, bias_m)| bias_m)
        };
        let everywhere = match self.code_edge {
            CodeEdge::Nearest => near([(0.0, 1.1), (8e6, 0.3), (20e6, 0.1)]),
            CodeEdge::Area => aliased_bias_m(rate_hz),
            CodeEdge::BandLimited => 1e-4,
        };
        everywhere.max(standing_bias_m(self.code_edge, rate_hz))
    }

    /// The same where a Doppler moves the code over the grid, behind a code loop of `LOOP_HZ`: the error
    /// repeats with each sample that the code moves by, and a first-order loop of noise bandwidth B passes `1
    /// / √(1 + (2πν / 4B)²)` of it.
    pub fn moving_bias_m(&self, rate_hz: f64, doppler_hz: f64) -> f64 {
        let samples_per_s = doppler_hz / CARRIER_CYCLES_PER_CHIP * rate_hz / CHIP_HZ;
        self.code_bias_m(rate_hz) / libm::hypot(1.0, std::f64::consts::TAU * samples_per_s / (4.0 * LOOP_HZ))
    }
}

impl Fidelity {
    /// What to warn of edges that leave the code metres off at a rate where chips meet the same places of
    /// every sample.
    pub fn warning(&self, rate_hz: f64) -> Option<String> {
        let bias_m = standing_bias_m(self.code_edge, rate_hz);
        (bias_m > self.allowed_m).then(|| {
            format!(
                "fidelity.code_edge = {} at {:.3} Msps: chips meet the same places between samples, and the code of \
                 a satellite without Doppler is {bias_m:.1} m off, rms; \"band_limited\" or another rate avoids it",
                self.code_edge.name(),
                1e-6 * rate_hz
            )
        })
    }
}

/// Largest error of a code at rest that `balanced` leaves, whatever the noise.
const LARGEST_BIAS_M: f64 = 0.2;
/// Cycles of L1 in a chip: how much slower the code moves than the carrier.
const CARRIER_CYCLES_PER_CHIP: f64 = 1540.0;
/// Noise bandwidth of the code loop behind which the plan states a moving code's error.
const LOOP_HZ: f64 = 0.5;

/// Error of a code at rest with area edges, root mean square over codes and phases, in metres.
///
/// A mean over the sample's interval is a filter sinc(f/fs) before sampling, and what it leaves above half
/// the rate folds back as a code of its own. An ideal early-minus-late correlator (half a chip) weighs line m
/// of the code, m kHz, by `w = 2 sin(πmd/1023)`; with lines of power `p(m) = sinc²(m/1023)/1023` and the
/// phases of a random code the folded lines add up by power: `σ² = Σ 2w² p(m) Σ_k p(m+kN) sinc²(m/N+k)`,
/// against the slope `Σ 2w · 2πm/1023 · sinc(m/N) p(m)`, m below N/2 and N = fs/1 kHz. 0.15 m at 2.6 Msps and
/// 0.02 m at 10; an independent correlator on real codes found 0.14 m at 2.6 and 0.20 m at 2.048 Msps, where
/// this gives 0.33: near a multiple of the chip rate it is a bound.
fn aliased_bias_m(rate_hz: f64) -> f64 {
    const LINES: f64 = 1023.0;
    const SPACING_CHIPS: f64 = 0.5;
    use std::f64::consts::PI;
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { libm::sin(PI * x) / (PI * x) };
    let power = |m: f64| sinc(m / LINES) * sinc(m / LINES) / LINES;
    let per_line = rate_hz / CHIP_HZ * LINES;
    let (mut noise, mut slope, mut m) = (0.0, 0.0, 1.0);
    while m < 0.5 * per_line {
        let weight = 2.0 * libm::sin(PI * m * SPACING_CHIPS / LINES);
        let folded = (-FOLDS..=FOLDS).filter(|k| *k != 0).map(|k| {
            let line = m + f64::from(k) * per_line;
            power(line) * sinc(line / per_line) * sinc(line / per_line)
        });
        noise += 2.0 * weight * weight * power(m) * folded.sum::<f64>();
        slope += 2.0 * weight * 2.0 * PI * m / LINES * sinc(m / per_line) * power(m);
        m += 1.0;
    }
    SPEED_OF_LIGHT_MPS / CHIP_HZ * noise.sqrt() / slope
}

/// Zones of the rate that fold back; their power falls with the fourth power of their number.
const FOLDS: i32 = 4;

/// Error of the code that a scene's own noise hides, in metres: that of a delay loop on its strongest signal,
/// 0.2 m at most.
///
/// Thermal noise of a loop of bandwidth B with correlators d chips apart is √(B·d / (2·C/N0)) chips where
/// T·C/N0 is far above one (Kaplan & Hegarty, equation 5.23, first branch). With 1 Hz and half a chip it is
/// 0.2 m at 57 dB-Hz: above what any GPS signal reaches on the ground (52 dB-Hz, 0.37 m), so that only
/// signals set stronger than nature's ask for less. Without noise nothing hides an error, and the 0.2 m apply
/// by themselves.
pub fn allowed_m(cn0_dbhz: Option<f64>) -> f64 {
    const BANDWIDTH_HZ: f64 = 1.0;
    const SPACING_CHIPS: f64 = 0.5;
    cn0_dbhz.map_or(LARGEST_BIAS_M, |cn0_dbhz| {
        let cn0_hz = libm::pow(10.0, 0.1 * cn0_dbhz);
        let noise_m = SPEED_OF_LIGHT_MPS / CHIP_HZ * (BANDWIDTH_HZ * SPACING_CHIPS / (2.0 * cn0_hz)).sqrt();
        noise_m.min(LARGEST_BIAS_M)
    })
}

/// Error where every chip meets the same few places between samples, root mean square, in metres.
///
/// With `q` places in turn, nearest edges know the code to a sample in `q` (uniform: over √12); for area
/// edges it falls with the square, from 1.6 m measured at 4.092 Msps.
fn standing_bias_m(edge: CodeEdge, rate_hz: f64) -> f64 {
    // Places drift apart within a code period of 1023 chips when the ratio misses by more than this.
    let meets = |q: u32| {
        let samples = f64::from(q) * rate_hz / CHIP_HZ;
        (samples - samples.round()).abs() < 1.0 / 1023.0
    };
    let Some(q) = (1..=32).find(|q| meets(*q)) else { return 0.0 };
    let finest_hz = f64::from(q) * rate_hz;
    match edge {
        CodeEdge::Nearest => SPEED_OF_LIGHT_MPS / finest_hz / 12_f64.sqrt(),
        CodeEdge::Area => 1.6 * (4.092e6 / finest_hz).powi(2),
        CodeEdge::BandLimited => 0.0,
    }
}

/// One knob as a plan shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// Its key in `[fidelity]`.
    pub knob: &'static str,
    /// What was chosen.
    pub value: String,
    /// Whether the level would have chosen another value.
    pub own: bool,
    /// What it does to the samples, and for how much.
    pub error: String,
    /// Its time a sample on one core.
    pub cost: String,
}

/// What was chosen for each knob at a sample rate, the error to expect of it and its cost; of the noise's
/// arithmetic where there is `noise`, and of the waveform where one of the `signals` has several layers.
pub fn choices(chosen: Fidelity, rate_hz: f64, noise: bool, signals: &[&Signal]) -> Vec<Choice> {
    let level = Fidelity::suited(chosen.grade, rate_hz, chosen.allowed_m);
    let at_area = |carrier| Fidelity { carrier, code_edge: CodeEdge::Area, ..chosen }.satellite_sample_ns(rate_hz);
    let carrier_ns = at_area(chosen.carrier) - at_area(Arithmetic::F32);
    let edge_ns = chosen.satellite_sample_ns(rate_hz) - carrier_ns;
    let mut found = vec![
        Choice {
            knob: "code_edge",
            value: chosen.code_edge.name().to_owned(),
            own: chosen.code_edge != level.code_edge,
            error: format!(
                "pseudorange {:.1e} m rms at {:.3} Msps where the code is at rest, {:.1e} m at 1 kHz of Doppler \
                 behind a loop of {LOOP_HZ} Hz (balanced: below {:.1e} m)",
                chosen.code_bias_m(rate_hz),
                1e-6 * rate_hz,
                chosen.moving_bias_m(rate_hz, 1000.0),
                chosen.allowed_m
            ),
            cost: format!("{edge_ns:.2} ns"),
        },
        Choice {
            knob: "carrier",
            value: chosen.carrier.name().to_owned(),
            own: chosen.carrier != level.carrier,
            error: match chosen.carrier {
                Arithmetic::F32 => "carrier 1e-6 cycle".to_owned(),
                Arithmetic::F64 => "carrier 1e-10 cycle".to_owned(),
            },
            cost: format!("{carrier_ns:.2} ns"),
        },
        Choice {
            knob: "knot_tolerance_cycles",
            value: format!("{:e}", chosen.knot_tolerance_cycles),
            own: chosen.knot_tolerance_cycles != level.knot_tolerance_cycles,
            error: format!("carrier {:e} cycle at most", chosen.knot_tolerance_cycles),
            cost: "none per sample".to_owned(),
        },
    ];
    found.extend(layers_choice(chosen, level, signals));
    if noise {
        let (error, ns) = match chosen.noise {
            Arithmetic::F32 => ("3e-7 of its size", 1.3),
            Arithmetic::F64 => ("1e-16 of its size", 20.0),
        };
        found.push(Choice {
            knob: "noise",
            value: chosen.noise.name().to_owned(),
            own: chosen.noise != level.noise,
            error: error.to_owned(),
            cost: format!("{ns:.1} ns, satellites or not"),
        });
    }
    found
}

/// Of a component with several layers, the power that is left out and how many fewer sequences are made.
fn layers_choice(chosen: Fidelity, level: Fidelity, signals: &[&Signal]) -> Option<Choice> {
    let components = || signals.iter().flat_map(|signal| signal.components).filter(|one| one.layers.len() > 1);
    let missing_db = |component: &Component| {
        let power = |layers| component.shape_of(layers).correlation(0.0);
        10.0 * libm::log10(power(Layers::Whole) / power(chosen.waveform))
    };
    let most_db = components().map(missing_db).reduce(f64::max)?;
    let count = |layers| components().map(|component| component.made_with(layers).len()).sum::<usize>();
    Some(Choice {
        knob: "waveform",
        value: chosen.waveform.name().to_owned(),
        own: chosen.waveform != level.waveform,
        error: match chosen.waveform {
            Layers::Whole => "none: every layer is sent".to_owned(),
            Layers::Strongest => format!(
                "{most_db:.2} dB less power for a replica of the whole waveform, and only the strongest layer's slope; \
                 nothing for a replica of that layer"
            ),
        },
        cost: format!("{} of {} layers", count(chosen.waveform), count(Layers::Whole)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_edges_err_by_what_folds_back_and_less_as_the_code_moves() {
        // The same sum in another language; and figures of an independent correlator on real codes, 0.14 and
        // 0.02 m, within what five codes scatter about the mean of all.
        for (rate_hz, expected_m) in [(2.048e6, 0.3273), (2.6e6, 0.1515), (5e6, 0.0563), (10e6, 0.0202), (25e6, 0.0038)]
        {
            assert!((aliased_bias_m(rate_hz) - expected_m).abs() < 6e-5, "{rate_hz}: {}", aliased_bias_m(rate_hz));
        }
        assert!((aliased_bias_m(2.6e6) / 0.14 - 1.0).abs() < 0.15);
        let area = Fidelity::of(Grade::Balanced);
        assert_eq!(area.moving_bias_m(2.6e6, 0.0), area.code_bias_m(2.6e6));
        // 1 kHz: 0.649 chips or 1.65 samples a second, against a corner of 2 rad/s.
        let share = area.moving_bias_m(2.6e6, 1000.0) / area.code_bias_m(2.6e6);
        assert!((share - 0.1895).abs() < 1e-3, "{share}");
        // Near twice the chip rate area edges are not good enough.
        assert_eq!(Fidelity::suited(Grade::Balanced, 2.048e6, LARGEST_BIAS_M).code_edge, CodeEdge::BandLimited);
    }

    #[test]
    fn balanced_keeps_its_promise_where_the_rate_meets_the_chips() {
        let suited = |grade: Grade, rate_hz: f64| Fidelity::suited(grade, rate_hz, LARGEST_BIAS_M);
        for rate_hz in [2.046e6, 4.092e6, 5.115e6, 10.23e6, 2.5575e6] {
            assert_eq!(suited(Grade::Balanced, rate_hz).code_edge, CodeEdge::BandLimited, "{rate_hz}");
        }
        for rate_hz in [2.6e6, 4e6, 10e6, 12e6, 25e6, 50e6] {
            assert_eq!(suited(Grade::Balanced, rate_hz).code_edge, CodeEdge::Area, "{rate_hz}");
        }
        for rate_hz in [2.046e6, 2.6e6, 4.092e6, 10e6, 20.46e6] {
            assert!(suited(Grade::Balanced, rate_hz).code_bias_m(rate_hz) < LARGEST_BIAS_M, "{rate_hz}");
            assert_eq!(suited(Grade::Fast, rate_hz).code_edge, CodeEdge::Nearest);
        }
    }

    #[test]
    fn signals_stronger_than_nature_s_ask_for_better_edges() {
        // σ = 293.05 m · √(0.25 / 10^(x/10)): 0.46 m at 50 dB-Hz, hidden under the cap, and 0.2 m at 57.3
        // dB-Hz.
        assert_eq!((allowed_m(None), allowed_m(Some(50.0))), (0.2, 0.2));
        assert!((allowed_m(Some(70.0)) - 0.046_335).abs() < 1e-6);
        let edge = |rate_hz: f64, cn0_dbhz: f64| {
            Fidelity::suited(Grade::Balanced, rate_hz, allowed_m(Some(cn0_dbhz))).code_edge
        };
        // 0.164 m and 0.103 m against the 0.15 m of area edges.
        assert_eq!((edge(2.6e6, 59.0), edge(2.6e6, 63.0)), (CodeEdge::Area, CodeEdge::BandLimited));
        // 4.6 mm and 2.6 mm against 3.8 mm.
        assert_eq!((edge(25e6, 90.0), edge(25e6, 95.0)), (CodeEdge::Area, CodeEdge::BandLimited));
    }
}
