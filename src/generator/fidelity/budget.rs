//! Errors that a scene may have, and the cheapest knobs whose errors stay below them.
//!
//! Errors of codes are the model's root mean square times [`LARGEST_OVER_RMS`], errors of C/N0 are against an
//! ideal filter of the band. Both count for signals in the middle of the band.

use thiserror::Error;

use gnss::signal::{Component, Layers, Shape, Signal};

use super::bias::code_bias_m;
use super::costs::kernel_ns;
use super::{Arithmetic, CodeEdge, Fidelity, Grade, worst};
use crate::low_pass::{CUTOFF_CPS, Response};

/// Bound of a code's error in root mean squares of the model: 4.7 at most over the signals, rates and edges
/// of `reports/trade_signals.csv`, each over up to 256 codes and positions.
pub const LARGEST_OVER_RMS: f64 = 5.0;
/// Tolerances of knots in cycles that are chosen: the least is that of the reference level, beyond the
/// largest a run's parabola has sidebands above −70 dBc.
const KNOTS_CYCLES: [f64; 2] = [1e-6, 4e-4];
/// Points of an integral over a band or a sample.
const POINTS: u32 = 512;

/// Largest errors that a scene may have; infinite where none is stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Error of a code in metres.
    pub code_m: f64,
    /// Error of a carrier in cycles.
    pub carrier_cycles: f64,
    /// Error of a C/N0 in dB, against an ideal filter of the samples' band.
    pub cn0_db: f64,
}

/// A budget that no knobs keep.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{key} = {asked} cannot be promised: at least {least:.2e} for {of} at {rate_msps:.3} Msps")]
pub struct Unmet {
    /// Key of the error.
    pub key: &'static str,
    /// Stated bound.
    pub asked: f64,
    /// Least bound that knobs keep.
    pub least: f64,
    /// Signal whose error it is.
    pub of: String,
    /// Sample rate.
    pub rate_msps: f64,
}

/// Largest errors of a choice of knobs or of a level, with the signals that have them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise<'s> {
    /// Error of a code in metres.
    pub code_m: (&'s Signal, f64),
    /// Error of a carrier in cycles.
    pub carrier_cycles: f64,
    /// Error of a C/N0 in dB, against an ideal filter of the samples' band.
    pub cn0_db: (&'s Signal, f64),
}

impl<'s> Promise<'s> {
    /// Promise of knobs for `signals` at a sample rate; `None` without signals.
    pub fn of(knobs: &Fidelity, rate_hz: f64, signals: &[&'s Signal]) -> Option<Self> {
        let Fidelity { code_edge, waveform, carrier, knot_tolerance_cycles, .. } = *knobs;
        let (by, rms_m) = worst(signals, |signal| code_bias_m(code_edge, signal, rate_hz))?;
        Some(Self {
            code_m: (by, LARGEST_OVER_RMS * rms_m),
            carrier_cycles: carrier.error_cycles() + knot_tolerance_cycles,
            cn0_db: worst(signals, |signal| off_db(code_edge, waveform, signal, rate_hz))?,
        })
    }
}

/// Values of the knobs, with their errors and their cost.
struct Candidate<'s> {
    code_edge: CodeEdge,
    carrier: Arithmetic,
    waveform: Layers,
    promise: Promise<'s>,
    ns: f64,
}

impl Budget {
    /// Cheapest knobs for `signals` at a sample rate.
    ///
    /// # Errors
    /// [`Unmet`], for the first of code, C/N0 and carrier that no knobs keep.
    pub fn cheapest(self, rate_hz: f64, signals: &[&Signal]) -> Result<Fidelity, Unmet> {
        let candidates = candidates(rate_hz, signals);
        let fidelity = |code_edge, carrier, waveform| Fidelity {
            code_edge,
            carrier,
            waveform,
            knot_tolerance_cycles: three_digits(self.carrier_cycles - carrier.error_cycles()).min(KNOTS_CYCLES[1]),
            allowed_m: self.code_m,
            ..Fidelity::of(Grade::Budget(self))
        };
        if candidates.is_empty() {
            return Ok(fidelity(CodeEdge::Nearest, Arithmetic::F32, Layers::Whole));
        }
        let kept = candidates.iter().find(|one| self.broken(&one.promise).is_none());
        kept.map(|one| fidelity(one.code_edge, one.carrier, one.waveform))
            .ok_or_else(|| self.unmet(&candidates, rate_hz))
    }

    /// First error of a promise that is beyond the budget, in words.
    pub fn broken(self, promise: &Promise<'_>) -> Option<String> {
        let Promise { code_m, carrier_cycles, cn0_db } = *promise;
        let beyond = |(signal, error): (&Signal, f64), bound: f64, what: &str, unit: &str| {
            (error > bound).then(|| format!("{what} of {signal} up to {error:.2e} {unit} off"))
        };
        beyond(code_m, self.code_m, "code", "m").or_else(|| beyond(cn0_db, self.cn0_db, "C/N0", "dB")).or_else(|| {
            (carrier_cycles > self.carrier_cycles).then(|| format!("carrier up to {carrier_cycles:.2e} cycle off"))
        })
    }

    fn unmet(self, candidates: &[Candidate<'_>], rate_hz: f64) -> Unmet {
        let unmet = |key, asked, (of, least): (String, f64)| Unmet { key, asked, least, of, rate_msps: 1e-6 * rate_hz };
        let least = |error: fn(&Candidate<'_>) -> f64, within: &dyn Fn(&&Candidate<'_>) -> bool| {
            candidates.iter().filter(within).min_by(|a, b| error(a).total_cmp(&error(b)))
        };
        let code = least(|one| one.promise.code_m.1, &|_| true).map(|one| one.promise.code_m);
        if let Some((signal, least)) = code.filter(|(_, least)| *least > self.code_m) {
            return unmet("code_m", self.code_m, (signal.to_string(), least));
        }
        let kept = |one: &&Candidate<'_>| one.promise.code_m.1 <= self.code_m;
        let cn0 = least(|one| one.promise.cn0_db.1, &kept).map(|one| one.promise.cn0_db);
        if let Some((signal, least)) = cn0.filter(|(_, least)| *least > self.cn0_db) {
            return unmet("cn0_db", self.cn0_db, (signal.to_string(), least));
        }
        let least_cycles = Arithmetic::F64.error_cycles() + KNOTS_CYCLES[0];
        unmet("carrier_cycles", self.carrier_cycles, ("any signal".to_owned(), least_cycles))
    }

    /// Cheaper knobs than `chosen` with what each of them would break, cheapest first.
    pub fn cheaper(self, chosen: &Fidelity, rate_hz: f64, signals: &[&Signal]) -> Vec<String> {
        let mut told: Vec<String> = Vec::new();
        for one in candidates(rate_hz, signals) {
            let Some(broken) = self.broken(&one.promise) else { break };
            let Candidate { code_edge, carrier, waveform, .. } = one;
            let mut knobs = vec![format!("code_edge {}", code_edge.name())];
            knobs.extend((carrier != chosen.carrier).then(|| format!("carrier {}", carrier.name())));
            knobs.extend((waveform != chosen.waveform).then(|| format!("waveform {}", waveform.name())));
            // What breaks the same with a further knob says nothing new.
            if !told.iter().any(|line| line.ends_with(&broken)) {
                told.push(format!("{}: {broken}", knobs.join(", ")));
            }
        }
        told
    }
}

/// The value below `value` with three digits, or `value` where it has no digits.
fn three_digits(value: f64) -> f64 {
    // Rounding adds half a unit of the third digit at most.
    format!("{:.2e}", 0.995 * value).parse().unwrap_or(value)
}

/// Knobs for `signals` at a sample rate, cheapest first.
fn candidates<'s>(rate_hz: f64, signals: &[&'s Signal]) -> Vec<Candidate<'s>> {
    let mut all = Vec::new();
    for (_, code_edge) in CodeEdge::NAMES {
        for (_, waveform) in Layers::NAMES {
            let knobs = Fidelity { code_edge, waveform, ..Fidelity::of(Grade::Balanced) };
            let Some(promise) = Promise::of(&knobs, rate_hz, signals) else { continue };
            let layered = signals.iter().flat_map(|signal| signal.components).any(|one| one.layers.len() > 1);
            if waveform == Layers::Strongest && !layered {
                continue;
            }
            for (_, carrier) in Arithmetic::NAMES {
                let ns = signals.iter().map(|signal| {
                    share_made(signal, waveform)
                        * kernel_ns(signal, rate_hz, code_edge, carrier).unwrap_or(f64::INFINITY)
                });
                // Knots cost nothing a sample, so a budget takes the finest that it needs.
                let promise = Promise { carrier_cycles: carrier.error_cycles() + KNOTS_CYCLES[0], ..promise };
                all.push(Candidate { code_edge, carrier, waveform, promise, ns: ns.sum() });
            }
        }
    }
    all.sort_by(|a, b| a.ns.total_cmp(&b.ns));
    all
}

/// Share of a signal's sequences that are made of these layers.
fn share_made(signal: &Signal, layers: Layers) -> f64 {
    let made = |layers| signal.components.iter().map(|one| one.made_with(layers).len()).sum::<usize>().max(1) as f64;
    made(layers) / made(Layers::Whole)
}

/// Difference in dB, without its sign, of a signal's power in the samples from that behind an ideal filter of
/// the band.
fn off_db(edge: CodeEdge, layers: Layers, signal: &Signal, rate_hz: f64) -> f64 {
    let sum =
        |of: &dyn Fn(&Component) -> f64| signal.components.iter().map(|one| one.power_share * of(one)).sum::<f64>();
    let sent = sum(&|one| {
        let shape = one.shape_of(layers);
        shape.correlation(0.0) / one.shape().correlation(0.0) * kept(edge, &shape, rate_hz)
    });
    (10.0 * libm::log10(sent / sum(&|one| within(&one.shape(), rate_hz, |_| 1.0)))).abs()
}

/// Share of a waveform's power that samples have behind an edge.
fn kept(edge: CodeEdge, shape: &Shape, rate_hz: f64) -> f64 {
    match edge {
        CodeEdge::Nearest => 1.0,
        // The mean over a sample has the correlation of a triangle.
        CodeEdge::Area => {
            let triangle = |k: u32| {
                let share = (f64::from(k) + 0.5) / f64::from(POINTS);
                2.0 * (1.0 - share) * shape.correlation(share / rate_hz)
            };
            (0..POINTS).map(triangle).sum::<f64>() / f64::from(POINTS) / shape.correlation(0.0)
        }
        CodeEdge::BandLimited => {
            let response = Response::new(CUTOFF_CPS);
            within(shape, rate_hz, |cps| response.at(cps) * response.at(cps))
        }
    }
}

/// Share of a waveform's power within half the sample rate, weighed by a function of the frequency in cycles
/// per sample.
fn within(shape: &Shape, rate_hz: f64, weight: impl Fn(f64) -> f64) -> f64 {
    let at = |k: u32| {
        let cps = 0.5 * (f64::from(k) + 0.5) / f64::from(POINTS);
        weight(cps) * shape.density(cps * rate_hz)
    };
    rate_hz * (0..POINTS).map(at).sum::<f64>() / f64::from(POINTS) / shape.correlation(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::SIGNALS;

    const NONE: Budget = Budget { code_m: f64::INFINITY, carrier_cycles: f64::INFINITY, cn0_db: f64::INFINITY };

    #[test]
    fn a_smaller_budget_takes_dearer_knobs_and_never_breaks_itself() {
        let dearer = |signal: &Signal, rate_hz: f64, chosen: &Fidelity| {
            kernel_ns(signal, rate_hz, chosen.code_edge, chosen.carrier).unwrap() * share_made(signal, chosen.waveform)
        };
        for signal in SIGNALS {
            for rate_hz in [4.1e6, 12.5e6, 25e6] {
                let mut last_ns = 0.0;
                for code_m in [1e3, 3.0, 0.3, 0.03, 3e-3, 3e-4] {
                    let Ok(chosen) = (Budget { code_m, ..NONE }).cheapest(rate_hz, &[signal]) else { break };
                    let ns = dearer(signal, rate_hz, &chosen);
                    assert!(ns >= last_ns, "{signal} {rate_hz} {code_m}: {chosen:?}");
                    assert!(LARGEST_OVER_RMS * code_bias_m(chosen.code_edge, signal, rate_hz) <= code_m);
                    last_ns = ns;
                }
            }
        }
    }

    #[test]
    fn each_error_has_its_knob_and_what_none_keeps_is_refused_with_the_least() {
        let of = |budget: Budget| budget.cheapest(6.5e6, &[&L1_CA, &E1]);
        let free = of(NONE).unwrap();
        assert_eq!(
            (free.code_edge, free.waveform, free.carrier),
            (CodeEdge::Nearest, Layers::Strongest, Arithmetic::F32)
        );
        assert_eq!(free.knot_tolerance_cycles, 4e-4);
        // Area edges err by 0.015 m rms, the nearest chip by 0.4 m.
        assert_eq!(of(Budget { code_m: 0.1, ..NONE }).unwrap().code_edge, CodeEdge::Area);
        assert_eq!(of(Budget { cn0_db: 0.25, ..NONE }).unwrap().code_edge, CodeEdge::BandLimited);
        let fine = of(Budget { carrier_cycles: 1.5e-6, ..NONE }).unwrap();
        assert_eq!(fine.carrier, Arithmetic::F64);
        assert!((1e-6..1.5e-6).contains(&fine.knot_tolerance_cycles), "{fine:?}");
        // Three digits, and never above.
        assert_eq!([9.9e-5, 1.0001e-4].map(three_digits), [9.85e-5, 9.95e-5]);
        for (budget, key) in [
            (Budget { code_m: 1e-6, ..NONE }, "code_m"),
            (Budget { cn0_db: 1e-4, ..NONE }, "cn0_db"),
            (Budget { carrier_cycles: 1e-7, ..NONE }, "carrier_cycles"),
        ] {
            let unmet = of(budget).unwrap_err();
            let least = 1.01 * unmet.least;
            let met = match key {
                "code_m" => Budget { code_m: least, ..NONE },
                "cn0_db" => Budget { cn0_db: least, ..NONE },
                _ => Budget { carrier_cycles: least, ..NONE },
            };
            assert!(unmet.key == key && of(met).is_ok(), "{unmet}");
        }
    }

    #[test]
    fn powers_are_those_of_the_waveforms() {
        // BPSK within 4.1 MHz holds 94.9 % (sinc² integrated), a mean over a quarter of a chip keeps 1 − d/3.
        let shape = L1_CA.components[0].shape();
        assert!((within(&shape, 4.092e6, |_| 1.0) - 0.9499).abs() < 1e-3);
        assert!((kept(CodeEdge::Area, &shape, 4.092e6) - (1.0 - 0.25 / 3.0)).abs() < 1e-4);
    }
}
