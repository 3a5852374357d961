//! The ionosphere that two bands show, satellite by satellite, against the truth and theory
//! ([`crate::judge::forecast::dispersion`]).

use nalgebra::Vector3;

use super::kind::{Kind, Value};
use super::values::Bounded;
use crate::error::JudgeError;
use crate::judge::forecast::dispersion::{Dispersion, expected};
use crate::judge::forecast::ranges::Scene;
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::measure::errors::Errors;
use crate::read::Table;
use crate::read::spill_store::{SpillRow, Words};
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;

/// Half a step of a broadcast group delay, 2⁻³² s: that of E1 and E5a is as much in the measured ionosphere.
const STEPS_M: f64 = 0.035;
/// Share of the measurements that may lack a row, in percent.
const LACKING_PERCENT: f64 = 1.0;

/// A measurement's error beside theory.
#[derive(Clone, Copy)]
struct Case {
    time_s: f64,
    error_m: f64,
    sigma_m: f64,
    allowed_m: f64,
}

impl SpillRow<()> for Case {
    const WORDS: usize = 4;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.time_s, self.error_m, self.sigma_m, self.allowed_m].map(f64::to_bits));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let [time_s, error_m, sigma_m, allowed_m] = std::array::from_fn(|_| words.number());
        Self { time_s, error_m, sigma_m, allowed_m }
    }
}

/// Measurements of a run's rows.
struct Measured {
    cases: Table<Case>,
    satellites: usize,
    due: u64,
    lacking: u64,
    first_lacking: Option<(Sv, f64)>,
    ends: Option<(f64, f64)>,
}

impl Verdict {
    /// Errors, sigmas and rows of the measured ionosphere.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub(super) fn dispersion(
        &mut self,
        scene: &Scene<'_>,
        errors: &Errors,
        bounded: &Bounded<'_>,
    ) -> Result<(), JudgeError> {
        let run = scene.run;
        if run.rays.keys().next().is_some() || !run.claimed.is_empty() {
            if !run.ionosphere.is_empty() {
                self.not_judged.push("ionosphere by two bands: the scene has reflections or a spoofer".to_owned());
            }
            return Ok(());
        }
        let mut found = Measured {
            cases: Table::new(run.ionosphere.directory()),
            satellites: 0,
            due: 0,
            lacking: 0,
            first_lacking: None,
            ends: None,
        };
        let mut satellites: Vec<Sv> = errors.signals.keys().map(|link| link.sv).collect();
        satellites.dedup();
        for sv in satellites {
            found.satellite(scene, errors, bounded, sv)?;
        }
        if found.due == 0 {
            return Ok(());
        }
        let percent = 100.0 * found.lacking as f64 / found.due as f64;
        let figure = "measurements of the ionosphere by two bands that are missing";
        let source = "both bands are observed, and the fix has the satellite's message";
        self.judge(figure, "", percent, "%", Bound::Max(LACKING_PERCENT), source);
        let first = found.first_lacking.map(|(sv, time_s)| format!("the first of {sv} at {time_s:.1} s"));
        self.explain(first.into_iter().collect());
        let value = |case: &Case| {
            let error = Vector3::new(case.error_m, 0.0, 0.0);
            Some(Value { time_s: case.time_s, error, sigma: case.sigma_m, allowed: case.allowed_m })
        };
        let kind = Kind {
            name: "ionosphere by two bands,",
            path: "ionosphere.error_p95_m",
            unit: "m",
            axes: 1,
            // Errors last longer than most runs: each satellite counts once.
            independent: found.satellites.max(1) as f64,
            must_scatter: false,
            without: String::new(),
            of: &value,
        };
        self.kind(&kind, &found.cases)?;
        if let Some(ends) = found.ends {
            self.sigma_ends("ionosphere by two bands,", ends);
        }
        Ok(())
    }
}

impl Measured {
    fn satellite(
        &mut self,
        scene: &Scene<'_>,
        errors: &Errors,
        bounded: &Bounded<'_>,
        sv: Sv,
    ) -> Result<(), JudgeError> {
        let run = scene.run;
        let (mut rows, mut sky, mut fixes) = (run.ionosphere.finder(sv)?, run.seen_at(sv)?, run.fixes.finder()?);
        let before = self.cases.len();
        expected(scene, errors, sv, |one: Dispersion| {
            let is_due =
                fixes.get(one.sample).is_some() && one.links.iter().all(|link| scene.heard.usable(*link, one.sample));
            self.due += u64::from(is_due);
            let Some(row) = rows.get(one.sample) else {
                if is_due {
                    self.lacking += 1;
                    self.first_lacking.get_or_insert((sv, one.time_s));
                }
                return Ok(());
            };
            if one.steady {
                let ratio = row.sigma_m / one.sigma_m;
                let (low, high) = self.ends.unwrap_or((ratio, ratio));
                self.ends = Some((low.min(ratio), high.max(ratio)));
            }
            let Some(sky) = sky.as_mut().and_then(|sky| sky.get(one.sample)) else { return Ok(()) };
            if !bounded.holds(one.time_s) {
                return Ok(());
            }
            let ratio = sky.link().carrier_hz() / L1_CA.carrier_hz(sv);
            let error_m = row.delay_m - ratio * ratio * sky.ionosphere_m;
            let allowed_m = STEPS_M + one.allowed_m;
            self.cases.push(Case { time_s: one.time_s, error_m, sigma_m: one.sigma_m, allowed_m })
        })?;
        self.satellites += usize::from(self.cases.len() > before);
        Ok(())
    }
}
