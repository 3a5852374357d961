//! Fidelity choices that trade speed for accuracy, each with its measured error and cost.
//!
//! A scene names a level or single knobs ([`Wishes`]); [`choices`] states what was picked and what it is
//! worth: errors of codes by the signals' waveforms ([`code_bias_m`]), costs as multiples that the kernels'
//! bench measures (`cargo bench --bench trade`). Limits: a knob's figure assumes that every other knob is at
//! its best.

mod bias;
mod budget;
mod costs;

use serde::Serialize;

use gnss::facts::Edge;
use gnss::signal::{Component, Layers, Signal};

use bias::{LARGEST_BIAS_M, standing_bias_m};
pub use bias::{LOOP_HZ, allowed_m, code_bias_m, moving_bias_m};
pub use budget::{Budget, LARGEST_OVER_RMS, Promise, Unmet};
pub use costs::kernel_ns;

/// Level of fidelity: a name for a value of every knob, or the errors below which the cheapest are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grade {
    /// Nearest chips, carrier within 1e-3 cycle and spurs below −70 dBc.
    Fast,
    /// The cheapest value of each knob whose error is below the noise of an ordinary scene.
    Balanced,
    /// Reference level with `f64` for every sample, to which the other levels are compared.
    Reference,
    /// The cheapest value of each knob whose errors stay within a budget.
    Budget(Budget),
    /// Correlations from a model in place of samples, whose knobs are those of `balanced` with area edges.
    Correlations,
    /// Observations from theory in place of samples and loops, whose knobs are those of `correlations`.
    Observations,
}

/// Model of a chip edge between samples. C/N0 is at the antenna, before the front end: samples have the share
/// of it that the edge keeps, each component its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeEdge {
    /// The chip at the sample's instant: all power is kept, what lies outside the band folds back.
    Nearest,
    /// The mean of the waveform over the sample's interval: 1 − d/3 is kept of steps that are 1/d ≥ 1 samples
    /// long.
    Area,
    /// The waveform through a linear-phase low-pass filter of half amplitude at 0.40 of the sample rate,
    /// which stops what would fold back.
    BandLimited,
}

/// Arithmetic in which samples are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arithmetic {
    /// Lanes of single precision, anchored again at the 64-bit phase every 4096 samples at least.
    F32,
    /// Each sample by itself in double precision.
    F64,
}

/// Value of every knob, with the level from which they were taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fidelity {
    /// Level from which the knobs were taken.
    pub grade: Grade,
    /// Model of code edges between samples.
    pub code_edge: CodeEdge,
    /// Layers that are transmitted of waveforms with several layers. Every level of fidelity transmits all of
    /// them.
    pub waveform: Layers,
    /// Arithmetic of the carrier phase and the code phase at each sample.
    pub carrier: Arithmetic,
    /// Arithmetic of the thermal noise's radius and angle; the random words are the same for all.
    pub noise: Arithmetic,
    /// Largest error of the carrier between knots, in cycles.
    pub knot_tolerance_cycles: f64,
    /// Error of the code below which `balanced` chooses, in metres.
    pub allowed_m: f64,
}

impl Grade {
    /// Levels and their names in a scenario.
    pub const NAMES: [(&'static str, Self); 5] = [
        ("fast", Self::Fast),
        ("balanced", Self::Balanced),
        ("reference", Self::Reference),
        ("correlations", Self::Correlations),
        ("observations", Self::Observations),
    ];

    /// True if samples are made at this level.
    pub fn is_sampled(self) -> bool {
        !matches!(self, Self::Correlations | Self::Observations)
    }

    /// Name of the level in a scenario; of a budget, the name of its key.
    pub fn name(self) -> &'static str {
        if matches!(self, Self::Budget(_)) { "budget" } else { name_of(&Self::NAMES, self) }
    }
}

impl CodeEdge {
    /// Edge models and their names in a scenario.
    pub const NAMES: [(&'static str, Self); 3] =
        [("nearest", Self::Nearest), ("area", Self::Area), ("band_limited", Self::BandLimited)];

    /// Name of the edge model in a scenario.
    pub fn name(self) -> &'static str {
        name_of(&Self::NAMES, self)
    }

    /// Edge model in the form of the scene's facts.
    pub fn fact(self) -> Edge {
        match self {
            Self::Nearest => Edge::Nearest,
            Self::Area => Edge::Area,
            Self::BandLimited => Edge::BandLimited,
        }
    }
}

impl Arithmetic {
    /// Arithmetics and their names in a scenario.
    pub const NAMES: [(&'static str, Self); 2] = [("f32", Self::F32), ("f64", Self::F64)];

    /// Name of the arithmetic in a scenario.
    pub fn name(self) -> &'static str {
        name_of(&Self::NAMES, self)
    }

    /// Error of the carrier in cycles that this arithmetic makes.
    pub fn error_cycles(self) -> f64 {
        match self {
            Self::F32 => 1e-6,
            Self::F64 => 1e-10,
        }
    }
}

fn name_of<T: PartialEq>(names: &[(&'static str, T)], value: T) -> &'static str {
    names.iter().find(|(_, known)| *known == value).map_or("", |(name, _)| *name)
}

impl Fidelity {
    /// Returns the knobs of a level.
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
            // 1e-4 cycle is 19 µm: a carrier loop at 50 dB-Hz has forty times that. A budget sets what it
            // needs.
            Grade::Balanced | Grade::Budget(_) | Grade::Correlations | Grade::Observations => Self {
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

    /// Returns the knobs of a level for `signals` at `rate_hz`. `balanced` takes area edges if the code error
    /// of every signal is below `allowed_m` (see [`allowed_m`]), because they cost less than band-limited
    /// ones at every rate. Otherwise it takes band-limited edges in `f64`: single precision saves nothing
    /// there, because the edges take the time. It never takes nearest edges, whose spurs are those of `fast`.
    ///
    /// # Errors
    /// A budget that no knobs keep.
    pub fn suited(grade: Grade, rate_hz: f64, allowed_m: f64, signals: &[&Signal]) -> Result<Self, Unmet> {
        if let Grade::Budget(budget) = grade {
            return budget.cheapest(rate_hz, signals);
        }
        let level = Self { allowed_m, ..Self::of(grade) };
        let too_much = |signal: &&Signal| code_bias_m(level.code_edge, signal, rate_hz) >= allowed_m;
        if grade == Grade::Balanced && signals.iter().any(too_much) {
            return Ok(Self { code_edge: CodeEdge::BandLimited, carrier: Arithmetic::F64, ..level });
        }
        Ok(level)
    }

    /// Warning text for edges that bias the code of one of the `signals` by metres. It occurs at rates that
    /// are commensurate with the chip rate.
    pub fn warning(&self, rate_hz: f64, signals: &[&Signal]) -> Option<String> {
        let (signal, bias_m) = worst(signals, |signal| standing_bias_m(self.code_edge, signal, rate_hz))?;
        (bias_m > self.allowed_m).then(|| {
            format!(
                "fidelity.code_edge = {} at {:.3} Msps: chips of {signal} meet the same phases between samples, and \
                 the code of a satellite without Doppler is {bias_m:.1} m off, rms; \"band_limited\" or another rate \
                 avoids it",
                self.code_edge.name(),
                1e-6 * rate_hz
            )
        })
    }
}

/// The signal of the largest figure, and that.
fn worst<'s>(signals: &[&'s Signal], figure: impl Fn(&Signal) -> f64) -> Option<(&'s Signal, f64)> {
    signals.iter().map(|signal| (*signal, figure(signal))).max_by(|(_, a), (_, b)| a.total_cmp(b))
}

/// Fidelity settings of a scene: a level, and knobs of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wishes {
    /// The level.
    pub grade: Grade,
    /// Edge model that replaces the level's.
    pub code_edge: Option<CodeEdge>,
    /// Layers that replace the level's.
    pub waveform: Option<Layers>,
    /// Carrier arithmetic that replaces the level's.
    pub carrier: Option<Arithmetic>,
    /// Noise arithmetic that replaces the level's.
    pub noise: Option<Arithmetic>,
    /// Knot tolerance in cycles that replaces the level's.
    pub knot_tolerance_cycles: Option<f64>,
    /// Error of the code below which `balanced` chooses, in metres.
    pub allowed_m: f64,
}

impl Wishes {
    /// Creates the settings of a level without own knobs.
    pub fn of(grade: Grade, allowed_m: f64) -> Self {
        Self {
            grade,
            code_edge: None,
            waveform: None,
            carrier: None,
            noise: None,
            knot_tolerance_cycles: None,
            allowed_m,
        }
    }

    /// Returns these settings with another level.
    pub fn at(self, grade: Grade) -> Self {
        Self { grade, ..self }
    }

    /// Returns the knobs for `signals` at `rate_hz`.
    ///
    /// # Errors
    /// A budget that no knobs keep.
    pub fn suited(&self, rate_hz: f64, signals: &[&Signal]) -> Result<Fidelity, Unmet> {
        let level = Fidelity::suited(self.grade, rate_hz, self.allowed_m, signals)?;
        Ok(Fidelity {
            code_edge: self.code_edge.unwrap_or(level.code_edge),
            waveform: self.waveform.unwrap_or(level.waveform),
            carrier: self.carrier.unwrap_or(level.carrier),
            noise: self.noise.unwrap_or(level.noise),
            knot_tolerance_cycles: self.knot_tolerance_cycles.unwrap_or(level.knot_tolerance_cycles),
            ..level
        })
    }
}

/// Choice of one knob as a plan shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// Key of the knob in `[fidelity]`.
    pub knob: &'static str,
    /// Chosen value.
    pub value: String,
    /// True if the level would choose another value.
    pub own: bool,
    /// Effect on the samples, with its size.
    pub error: String,
    /// Time per sample on one core.
    pub cost: String,
}

/// Lists the value of each knob at a sample rate, with its expected error and its cost. The noise arithmetic
/// is listed if there is `noise`. The waveform is listed if one of the `signals` has several layers.
pub fn choices(chosen: Fidelity, rate_hz: f64, noise: bool, signals: &[&Signal]) -> Vec<Choice> {
    let level = Fidelity::suited(chosen.grade, rate_hz, chosen.allowed_m, signals).unwrap_or(chosen);
    let edge = chosen.code_edge;
    let bias = worst(signals, |signal| code_bias_m(edge, signal, rate_hz));
    let mut found = vec![
        Choice {
            knob: "code_edge",
            value: edge.name().to_owned(),
            own: edge != level.code_edge,
            error: bias.map_or_else(String::new, |(signal, bias_m)| {
                format!(
                    "pseudorange of {signal} {bias_m:.1e} m rms at {:.3} Msps where the code is at rest, {:.1e} m at 1 \
                     kHz of Doppler behind a loop of {LOOP_HZ} Hz ({}: below {:.1e} m)",
                    1e-6 * rate_hz,
                    moving_bias_m(edge, signal, rate_hz, 1000.0),
                    if matches!(chosen.grade, Grade::Budget(_)) { "budget" } else { "balanced" },
                    chosen.allowed_m
                )
            }),
            cost: match edge {
                CodeEdge::Nearest => "the least".to_owned(),
                edge => multiple([edge, CodeEdge::Nearest], [chosen.carrier; 2], "nearest", rate_hz, signals),
            },
        },
        Choice {
            knob: "carrier",
            value: chosen.carrier.name().to_owned(),
            own: chosen.carrier != level.carrier,
            error: format!("carrier {:e} cycle", chosen.carrier.error_cycles()),
            cost: match chosen.carrier {
                Arithmetic::F32 => "the least".to_owned(),
                double => multiple([edge; 2], [double, Arithmetic::F32], "f32", rate_hz, signals),
            },
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
        let error = match chosen.noise {
            Arithmetic::F32 => "3e-7 of its size",
            Arithmetic::F64 => "1e-16 of its size",
        };
        found.push(Choice {
            knob: "noise",
            value: chosen.noise.name().to_owned(),
            own: chosen.noise != level.noise,
            error: error.to_owned(),
            cost: format!("{:.1} ns, satellites or not", noise_ns(chosen.noise)),
        });
    }
    found
}

/// Time in ns on one core for the noise of a sample.
pub fn noise_ns(arithmetic: Arithmetic) -> f64 {
    match arithmetic {
        Arithmetic::F32 => 1.3,
        Arithmetic::F64 => 20.0,
    }
}

/// Ratio of the kernels' time per sample with one value of a knob to that with another, over all signals
/// whose cost was measured. Without any the cost is unknown.
fn multiple(
    edges: [CodeEdge; 2],
    arithmetics: [Arithmetic; 2],
    other: &str,
    rate_hz: f64,
    signals: &[&Signal],
) -> String {
    let all_ns = |at: usize| {
        let of = |signal: &&Signal| kernel_ns(signal, rate_hz, *edges.get(at)?, *arithmetics.get(at)?);
        signals.iter().filter_map(of).sum::<f64>()
    };
    let ratio = all_ns(0) / all_ns(1);
    if ratio.is_finite() { format!("{ratio:.1} x {other}") } else { "unknown: not measured".to_owned() }
}

/// Knob of the layers: the power that is left out of a component, and the ratio by which fewer sequences are
/// made.
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
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::gps::l5::L5;

    #[test]
    fn balanced_keeps_its_promise_where_the_rate_meets_the_chips() {
        let largest_m = allowed_m(None);
        let suited = |grade, rate_hz, signal| Fidelity::suited(grade, rate_hz, largest_m, &[signal]).unwrap().code_edge;
        for rate_hz in [2.046e6, 4.092e6, 5.115e6, 2.5575e6] {
            assert_eq!(suited(Grade::Balanced, rate_hz, &L1_CA), CodeEdge::BandLimited, "{rate_hz}");
        }
        // At 10.23 Msps the chips of C/A meet ten positions: 0.045 m.
        for rate_hz in [2.6e6, 4e6, 10e6, 10.23e6, 12e6, 25e6, 50e6] {
            assert_eq!(suited(Grade::Balanced, rate_hz, &L1_CA), CodeEdge::Area, "{rate_hz}");
        }
        for rate_hz in [2.046e6, 2.6e6, 4.092e6, 10e6, 20.46e6] {
            for signal in [&L1_CA, &E1] {
                let edge = suited(Grade::Balanced, rate_hz, signal);
                assert!(code_bias_m(edge, signal, rate_hz) < largest_m, "{signal} {rate_hz}");
                assert_eq!(suited(Grade::Fast, rate_hz, signal), CodeEdge::Nearest);
            }
        }
        // Chips of L5 are a tenth as long, and meet other rates.
        assert_eq!(suited(Grade::Balanced, 20.46e6, &L5), CodeEdge::BandLimited);
        assert_eq!(suited(Grade::Balanced, 25e6, &L5), CodeEdge::Area);
        // Of several signals the worst counts.
        let both = Fidelity::suited(Grade::Balanced, 20.46e6, largest_m, &[&L1_CA, &L5]).unwrap();
        assert_eq!(both.code_edge, CodeEdge::BandLimited);
    }

    #[test]
    fn signals_stronger_than_nature_s_ask_for_better_edges() {
        let edge = |rate_hz: f64, cn0_dbhz: f64| {
            Fidelity::suited(Grade::Balanced, rate_hz, allowed_m(Some(cn0_dbhz)), &[&L1_CA]).unwrap().code_edge
        };
        // 0.164 m and 0.103 m against the 0.14 m of area edges.
        assert_eq!((edge(2.6e6, 59.0), edge(2.6e6, 63.0)), (CodeEdge::Area, CodeEdge::BandLimited));
        // 4.6 mm and 1.3 mm against 1.5 mm.
        assert_eq!((edge(25e6, 90.0), edge(25e6, 101.0)), (CodeEdge::Area, CodeEdge::BandLimited));
    }
}
