//! Ladder of a plan: what each level of fidelity costs a scene, and how far it errs.
//!
//! Times of the levels that make samples are the generator's. Where a model answers in place of samples, the
//! time is that of generator and receiver, from a pilot of the scene's first seconds on one core.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::cli::error::CliError;
use crate::cli::made::failure;
use crate::cli::scenario::{self, Named};
use generator::plan::{Errors, Plan, Rung};
use generator::scenario::Overrides;
use generator::scene::{Grade, Scene};
use generator::stopwatch::Stopwatch;
use receiver::output::{OutputError, Record, Sink};
use receiver::settings::Settings;
use twin::{Refused, TwinError};

/// Lengths of the two pilots in seconds. What a scene costs a second is their difference.
const PILOTS_S: [f64; 2] = [1.0, 4.0];

/// Levels of a scene, from the one with most samples' detail to the one with least.
pub struct Ladder {
    rungs: Vec<Rung>,
    chosen: &'static str,
    /// Reason for which a budget takes samples.
    broken: Option<String>,
}

impl Ladder {
    /// Ladder of a scene, of whose front ends there are plans.
    ///
    /// # Errors
    /// Errors of the scene at a level that it has.
    pub fn new(named: &Named, scenes: &[Scene], plans: &[Plan], overrides: &Overrides) -> Result<Self, CliError> {
        let each = scenes.iter().zip(plans).map(|(scene, plan)| Rung::of_samples(scene, plan));
        let join = |all: Vec<Rung>, more: Vec<Rung>| all.into_iter().zip(more).map(|(a, b)| a.join(b)).collect();
        let mut rungs = each.reduce(join).unwrap_or_default();
        for grade in [Grade::Correlations, Grade::Observations] {
            rungs.push(modelled(grade, named, overrides)?);
        }
        let own = scenes.first().map_or(Grade::Balanced, |scene| scene.fidelity.grade);
        let broken = twin::correlations::broken(scenes).map_err(failure)?;
        let is_kept = matches!(own, Grade::Budget(_)) && broken.is_none();
        Ok(Self { rungs, chosen: if is_kept { Grade::Correlations.name() } else { own.name() }, broken })
    }

    /// Lines of the ladder without times, which differ from run to run.
    pub fn text(&self) -> String {
        let mut out = "ladder       code m   carrier cycle  C/N0 dB  memory MiB\n".to_owned();
        for Rung { level, refused, memory_bytes, errors, .. } in &self.rungs {
            let mark = if *level == self.chosen { "*" } else { " " };
            let _ = match (refused, errors) {
                (Some(refused), _) => writeln!(out, "{mark} {level:12} refused: {refused}"),
                (None, Some(Errors { code_m, carrier_cycles, cn0_db })) => {
                    let mib = memory_bytes.map_or("-".to_owned(), |bytes| format!("{:.1}", bytes as f64 / 1_048_576.0));
                    writeln!(out, "{mark} {level:12} {code_m:7.1e}  {carrier_cycles:13.1e}  {cn0_db:7.2}  {mib:>10}")
                }
                (None, None) => {
                    writeln!(out, "{mark} {level:12} noise by theory, no loops: nothing is promised of an epoch")
                }
            };
        }
        if let Some(broken) = &self.broken {
            let _ = writeln!(out, "  correlations would break the budget: {broken}");
        }
        out
    }

    /// Times of the levels on this machine, in words.
    pub fn speed(&self) -> String {
        let known = self.rungs.iter().filter(|rung| rung.refused.is_none());
        let each: Vec<String> = known.map(|rung| format!("{} {:.1} s", rung.level, rung.time_s)).collect();
        format!(
            "levels on this machine, of one core: {}; correlations and observations with the receiver, others without",
            each.join(", ")
        )
    }

    /// JSON array of the levels.
    pub fn object(&self) -> Value {
        let each = self.rungs.iter().map(|rung| json!({ "rung": rung, "chosen": rung.level == self.chosen }));
        each.collect()
    }
}

/// A level without samples, as `run --level` has it.
fn modelled(grade: Grade, named: &Named, overrides: &Overrides) -> Result<Rung, CliError> {
    let mut named = named.clone();
    let ends = named.scenario.front_ends.iter_mut();
    ends.for_each(|front_end| front_end.fidelity = front_end.fidelity.at(grade));
    let rung = |refused, time_s, errors| Rung { level: grade.name(), refused, time_s, memory_bytes: None, errors };
    let refused = |reason| Ok(rung(Some(reason), 0.0, None));
    // The scene itself was composed before: what is wrong now is the level.
    let (mut scenes, _) = match named.scenario.compose_all(&named.directory, overrides) {
        Ok(composed) => composed,
        Err(error) => return refused(error.to_string()),
    };
    let settings = twin::settings_for(&scenes, &scenario::receiver_settings(&named)?);
    let promise = match grade {
        Grade::Observations => twin::observations::refuse(&scenes).map(|()| None),
        _ => twin::correlations::promise(&scenes),
    };
    let lacks = |lacking: Refused| format!("no model of {}", lacking.effect);
    let promise = match promise {
        Ok(promise) => promise,
        Err(lacking) => return refused(lacks(lacking)),
    };
    match pilots_s(&mut scenes, &settings) {
        Ok(time_s) => Ok(rung(None, time_s, promise.map(Errors::from))),
        Err(TwinError::Refused(lacking)) => refused(lacks(lacking)),
        Err(error) => Err(failure(error).into()),
    }
}

/// Time of one core for scenes at a level without samples, from two pilots. The scenes are shorter then.
fn pilots_s(scenes: &mut [Scene], settings: &Settings) -> Result<f64, TwinError> {
    let ends: Vec<u64> = scenes.iter().map(|scene| scene.samples).collect();
    let duration_s = scenes.first().map_or(0.0, |scene| scene.clock.rate.elapsed_s(scene.samples));
    let mut pilot_s = |length_s: f64| {
        for (scene, end) in scenes.iter_mut().zip(&ends) {
            scene.samples = ((length_s * scene.clock.rate.hz()) as u64).min(*end);
        }
        on_one_core_s(|| twin::run(scenes, settings, &mut (), &mut Nowhere))
    };
    let [short_s, long_s] = PILOTS_S.map(|length_s| length_s.min(duration_s));
    let (first_s, both_s) = (pilot_s(short_s)?, pilot_s(long_s)?);
    let second_s = if long_s > short_s { (both_s - first_s) / (long_s - short_s) } else { 0.0 };
    Ok(both_s + second_s.max(0.0) * (duration_s - long_s))
}

/// Processor time of work that may share itself among threads, on one.
fn on_one_core_s<T>(work: impl FnOnce() -> Result<T, TwinError> + Send) -> Result<f64, TwinError> {
    let timed = || {
        let watch = Stopwatch::start();
        work().map(|_| watch.elapsed_s())
    };
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(timed),
        Err(_) => timed(),
    }
}

/// Sink that keeps nothing.
struct Nowhere;

impl Sink for Nowhere {
    fn take(&mut self, _: Record) -> Result<(), OutputError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use generator::scenario::Scenario;

    fn ladder(text: &str) -> Ladder {
        let scenario = Scenario::parse(text, "ladder").unwrap();
        let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let named = Named { scenario, text: text.to_owned(), name: "ladder".to_owned(), directory };
        let overrides = Overrides::default();
        let (scenes, _) = scenario::compose_all(&named, &overrides).unwrap();
        let plans: Vec<Plan> = scenes.iter().map(|scene| Plan::of(scene).unwrap()).collect();
        Ladder::new(&named, &scenes, &plans, &overrides).unwrap()
    }

    /// C/A at 2.6 Msps: errors of codes fall from the nearest chip to the band-limited one (1.15 m,
    /// 0.12 m and 0.4 mm rms, as another language has them), and samples take more time the less they err.
    #[test]
    fn a_dearer_level_errs_less_and_the_scene_s_own_is_marked() {
        let ladder = ladder(&include_str!("../../scenarios/static.toml").replace("duration_s = 60", "duration_s = 5"));
        let names: Vec<&str> = ladder.rungs.iter().map(|rung| rung.level).collect();
        assert_eq!(names, ["fast", "balanced", "reference", "correlations", "observations"]);
        let code_m = |at: usize| ladder.rungs[at].errors.unwrap().code_m / 5.0;
        for (at, expected_m) in [(0, 1.15), (1, 0.122), (2, 4.273e-4)] {
            assert!((code_m(at) / expected_m - 1.0).abs() < 0.15, "{at}: {}", code_m(at));
        }
        assert!(ladder.rungs[..3].is_sorted_by(|a, b| a.time_s < b.time_s), "{:?}", ladder.rungs);
        assert!(ladder.rungs[3..].iter().all(|rung| rung.time_s > 0.0 && rung.refused.is_none()));
        let text = ladder.text();
        assert!(text.contains("* balanced") && !text.contains("would break"), "{text}");
        assert_eq!(ladder.object()[1]["chosen"], true);
    }

    #[test]
    fn a_level_without_an_effect_of_the_scene_says_which_and_a_budget_what_it_would_break() {
        let jammed = ladder(include_str!("../../scenarios/jammed.toml"));
        assert!(jammed.text().contains("correlations refused: no model of [[interference]]"), "{}", jammed.text());
        let budget = |errors: &str| {
            let fidelity = format!("[fidelity]\nbudget = {{ {errors} }}\n[front_end]");
            ladder(&include_str!("../../scenarios/static.toml").replacen("[front_end]", &fidelity, 1)).text()
        };
        let loose = budget("code_m = 1.0, carrier_cycles = 1e-3");
        assert!(loose.contains("* correlations") && loose.contains("  budget "), "{loose}");
        let tight = budget("code_m = 1.0, carrier_cycles = 5e-5");
        assert!(
            tight.contains("* budget") && tight.contains("correlations would break the budget: carrier"),
            "{tight}"
        );
    }
}
