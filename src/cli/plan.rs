//! `plan`: what a scene will compute, what not, and why; and whether the receiver's carrier loop follows its
//! motion.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::ladder::Ladder;
use crate::cli::run::generator_error;
use crate::cli::scenario::{self, Named};
use generator::dynamics::{LineOfSight, lines_of_sight};
use generator::effect::troposphere::TOP_M;
use generator::plan::{Plan, Together};
use generator::scenario::Overrides;
use generator::scene::Scene;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::place::counted;
use receiver::followed::Followed;
use receiver::position::{IonosphereChoice, PositionSettings, TroposphereChoice};
use receiver::settings::Settings;
use receiver::track::TrackingSettings;
use study::demand::{self, Answer, Demand};

/// Standard gravity, for accelerations in g.
const G_MPS2: f64 = 9.806_65;

/// Prints the plan of a scene, or of each station's.
pub fn execute(arguments: &args::Plan) -> Result<(), CliError> {
    let named = scenario::read(arguments.scenario.as_deref(), arguments.allow_outside)?
        .at_station(arguments.station.as_deref())?;
    let stations = named.each_station()?;
    let (mut texts, mut objects) = (Vec::new(), Vec::new());
    for (name, named) in &stations {
        let (text, mut object) = planned(named, arguments)?;
        match name {
            Some(name) => {
                object["station"] = json!(name);
                texts.push(format!("station    {name}\n{text}"));
            }
            None => texts.push(text),
        }
        objects.push(object);
    }
    arguments.printed.results(&texts.join("\n"), || match objects.as_slice() {
        [object] => object.clone(),
        several => json!({ "stations": several }),
    })
}

/// The plan of a scene in words, and as a JSON object.
fn planned(named: &Named, arguments: &args::Plan) -> Result<(String, Value), CliError> {
    let overrides = Overrides { allow_outside: arguments.allow_outside, ..Overrides::default() };
    let (scenes, warnings) = scenario::compose_all(named, &overrides)?;
    let settings = scenario::receiver_settings(named)?;
    for warning in warnings {
        scenario::warn(&warning);
    }
    uncalled(&scenes, &settings.position).iter().for_each(|warning| scenario::warn(warning));
    let note = |text: &str| {
        if !arguments.printed.quiet {
            scenario::note(text)
        }
    };
    let (mut plans, mut texts, mut objects) = (Vec::new(), Vec::new(), Vec::new());
    for scene in &scenes {
        let plan = Plan::of(scene).map_err(generator_error)?;
        let loops = Loops::new(scene, &settings.tracking)?;
        let of_it = plan.front_end.as_ref().filter(|_| scenes.len() > 1);
        let of_it = of_it.map_or_else(String::new, |name| format!("front end {name}: "));
        loops.warning().iter().for_each(|warning| scenario::warn(&format!("{of_it}{warning}")));
        texts.push(format!("{plan}\n{}", loops.text()));
        objects.push(json!({ "plan": plan, "loops": loops.object() }));
        note(&format!("{of_it}{}", plan.speed()));
        plans.push(plan);
    }
    let mut together = String::new();
    if plans.len() > 1 {
        let all = Together(&plans);
        note(&all.speed());
        together = format!("{all}\n");
    }
    let ladder = Ladder::new(named, &scenes, &plans, &overrides)?;
    note(&ladder.speed());
    texts.push(ladder.text());
    Ok((together + &texts.join("\n"), json!({ "front_ends": objects, "ladder": ladder.object() })))
}

/// Warnings about an atmosphere that the receiver corrects for and that the scene does not have.
fn uncalled(scenes: &[Scene], settings: &PositionSettings) -> Vec<String> {
    let Some(scene) = scenes.first() else { return Vec::new() };
    let lacks = |name: &str| !scene.effects.iter().any(|effect| effect.name() == name);
    let carriers_hz = scenes.iter().flat_map(|scene| &scene.signals).map(|signal| signal.centre_hz());
    let several = carriers_hz.clone().any(|hz| carriers_hz.clone().next() != Some(hz));
    // Two carriers measure that there is none.
    let measured = settings.ionosphere == IonosphereChoice::Combined && several;
    let ionosphere = settings.ionosphere != IonosphereChoice::None && !measured;
    let on_ground = Geodetic::from_ecef(&scene.trajectory.at(0.0).position_m).height_m < TOP_M;
    let troposphere = settings.troposphere != TroposphereChoice::None && on_ground;
    let corrected = [("ionosphere", ionosphere), ("troposphere", troposphere)].into_iter();
    corrected
        .filter(|(name, corrected)| *corrected && lacks(name))
        .map(|(name, _)| {
            format!(
                "the receiver corrects for {} {name} that the scene does not have: give the scene [{name}], or set \
                 [receiver.position] {name} = \"none\"",
                if name == "ionosphere" { "an" } else { "a" }
            )
        })
        .collect()
}

/// The carrier loop of the scene's settings on every line of sight.
struct Loops<'s> {
    settings: &'s TrackingSettings,
    /// Period of the code, and wavelength of the carrier.
    signal: (f64, f64),
    /// Times of an update, the least of them where satellites differ.
    updates_s: (f64, Option<f64>),
    rows: Vec<(LineOfSight, Demand, Answer)>,
}

impl<'s> Loops<'s> {
    fn new(scene: &Scene, settings: &'s TrackingSettings) -> Result<Self, CliError> {
        let first = scene.signals.first();
        let period_s =
            first.and_then(|signal| signal.components.first()).map_or(1e-3, |component| component.period_s());
        let signal = (period_s, first.map_or(f64::INFINITY, |signal| SPEED_OF_LIGHT_MPS / signal.centre_hz()));
        let row = |line: LineOfSight| {
            let LineOfSight { acceleration_mps2, jerk_mps3, swing_mps2, cn0_dbhz, .. } = line;
            let circle = scene.trajectory.circle();
            let demand = Demand { acceleration_mps2, jerk_mps3, swing_mps2, circle, cn0_dbhz };
            (line, demand, demand::answer(settings, signal, &demand))
        };
        let lines = lines_of_sight(scene).map_err(CliError::input)?;
        let all = Settings { tracking: settings.clone(), ..Settings::default() };
        let updates_s = first.and_then(|signal| Followed::of(signal, &all)).map_or_else(
            || (period_s * f64::from(settings.integration), None),
            |followed| (followed.integration_s, followed.least_integration_s),
        );
        Ok(Self { settings, signal, updates_s, rows: lines.into_iter().map(row).collect() })
    }

    /// The one with the least left of its limit, but for those that are too weak at rest.
    fn tightest(&self) -> Option<&(LineOfSight, Demand, Answer)> {
        let strong = self.rows.iter().filter(|row| row.2.limit_rad > 0.0 || row.2.breaks());
        strong.min_by(|a, b| a.2.margin_rad().total_cmp(&b.2.margin_rad()))
    }

    fn text(&self) -> String {
        let TrackingSettings { pll_order, pll_bandwidth_hz, .. } = self.settings;
        let (update_s, least_s) = self.updates_s;
        let least = least_s.map_or_else(String::new, |s| format!(" ({} ms where bits are shorter)", 1e3 * s));
        let update = format!("{} ms{least}", 1e3 * update_s);
        let mut out = format!("loops      carrier, order {pll_order}, {pll_bandwidth_hz} Hz, {update}: ");
        let Some((line, _, answer)) = self.tightest() else {
            return out + "no satellite that it would follow at rest\n";
        };
        let (sv, margin_deg) = (line.sv, answer.margin_rad().to_degrees());
        let _ = writeln!(
            out,
            "a margin of {margin_deg:.1} deg on {sv}, stress against what noise leaves of 45 deg and lock"
        );
        out += "  sv      m/s2       g      Hz/s      m/s3     g/s     Hz/s2  stress deg  limit deg\n";
        for (line, _, answer) in &self.rows {
            let (a, j, wavelength_m) = (line.acceleration_mps2, line.jerk_mps3, self.signal.1);
            let _ = writeln!(
                out,
                "  {}  {a:8.2}  {:6.2}  {:8.1}  {j:8.2}  {:6.2}  {:8.1}  {:10.1}  {:9.1}",
                line.sv,
                a / G_MPS2,
                a / wavelength_m,
                j / G_MPS2,
                j / wavelength_m,
                answer.stress_rad.to_degrees(),
                answer.limit_rad.to_degrees()
            );
        }
        out
    }

    /// JSON object with the demand, the stress and its limit for each line of sight.
    fn object(&self) -> Value {
        let row = |(line, _, answer): &(LineOfSight, Demand, Answer)| {
            json!({
                "line_of_sight": line,
                "stress_deg": answer.stress_rad.to_degrees(),
                "limit_deg": answer.limit_rad.to_degrees(),
                "breaks": answer.breaks(),
            })
        };
        self.rows.iter().map(row).collect()
    }

    /// Warning about motions that the loop does not follow, with settings that would.
    fn warning(&self) -> Option<String> {
        let broken = self.rows.iter().filter(|(_, _, answer)| answer.breaks());
        let count = broken.clone().count();
        let (line, _, answer) = broken.max_by(|a, b| a.2.stress_rad.total_cmp(&b.2.stress_rad))?;
        let demands: Vec<Demand> = self.rows.iter().map(|(_, demand, _)| *demand).collect();
        let remedy = match demand::suggestion(self.settings, self.signal, &demands) {
            Some(new) => format!("[receiver.tracking] {} would", demand::keys(self.settings, &new)),
            None => "no bandwidth up to 100 Hz does".to_owned(),
        };
        Some(format!(
            "the carrier loop does not follow the motion on {count} of {}: {} accelerates by up to \
             {:.1} g, {:.1} g/s (at {:.1} s), a stress of {:.1} deg where {:.1} deg are left: expect cycle slips or \
             a lost lock; {remedy}",
            counted(self.rows.len(), "satellite"),
            line.sv,
            line.acceleration_mps2 / G_MPS2,
            line.jerk_mps3 / G_MPS2,
            line.jerk_s,
            answer.stress_rad.to_degrees(),
            answer.limit_rad.to_degrees()
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use generator::scenario::Scenario;
    use receiver::settings::Settings;

    fn warning(text: &str, settings: Option<TrackingSettings>) -> Option<String> {
        let scenario = Scenario::parse(text, "plan").unwrap();
        let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let (scene, _) = scenario.compose(&directory, &Overrides::default()).unwrap();
        let own = Settings::of_scenario(text, "plan").unwrap().tracking;
        let settings = settings.unwrap_or(own);
        let loops = Loops::new(&scene, &settings).unwrap();
        assert!(loops.text().starts_with("loops      carrier, order 3, ") && loops.rows.len() > 7, "{}", loops.text());
        loops.warning()
    }

    #[test]
    fn the_rocket_passes_with_its_own_settings_and_is_warned_of_with_the_defaults() {
        let rocket = include_str!("../../scenarios/high_dynamics.toml");
        assert_eq!(warning(rocket, None), None);
        let warned = warning(rocket, Some(TrackingSettings::default())).unwrap();
        assert!(warned.contains("[receiver.tracking] pll_bandwidth_hz = 35, integration = 2 would"), "{warned}");
        assert!(warned.contains("20.") && warned.contains("expect cycle slips"), "{warned}");
    }

    #[test]
    fn an_atmosphere_that_only_the_receiver_has_is_warned_of() {
        let bare = include_str!("../../scenarios/noise_free.toml");
        let warned = |text: &str| {
            let scenario = Scenario::parse(text, "plan").unwrap();
            let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
            let (scenes, _) = scenario.compose_all(&directory, &Overrides::default()).unwrap();
            uncalled(&scenes, &Settings::of_scenario(text, "plan").unwrap().position)
        };
        assert!(warned(bare).is_empty());
        let two = warned(&bare.replace("ionosphere = \"none\"", "").replace("troposphere = \"none\"", ""));
        assert_eq!(two.len(), 2, "{two:?}");
        assert!(
            two[0].contains("corrects for an ionosphere that the scene does not have: give the scene [ionosphere]")
        );
        assert!(two[1].ends_with("or set [receiver.position] troposphere = \"none\""), "{two:?}");
        // A scene with both is not warned of, nor one in space of the troposphere.
        assert!(warned(include_str!("../../scenarios/static.toml")).is_empty());
        let high = warned(include_str!("../../scenarios/extremes/geo.toml"));
        assert!(high.len() == 1 && high[0].contains("an ionosphere"), "{high:?}");
    }

    #[test]
    fn a_place_at_rest_and_a_ride_are_followed_by_the_defaults() {
        for text in [include_str!("../../scenarios/static.toml"), include_str!("../../scenarios/moderate.toml")] {
            assert_eq!(warning(text, Some(TrackingSettings::default())), None);
        }
        // A spin of 5 mm is no jerk of 1200 g/s, and a street's shadows are no motion.
        for text in [include_str!("../../scenarios/spinning.toml"), include_str!("../../scenarios/canyon.toml")] {
            assert_eq!(warning(text, None), None);
        }
    }
}
