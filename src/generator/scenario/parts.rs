//! Parts of a scene: navigation data, orbits, messages, and the effects of propagation.

use super::files::Files;
use super::{Ionosphere, Scenario, ScenarioError, city, multipath, satellite};
use crate::catalogue::Catalogue;
use crate::effect::obstruction::Obstruction;
use crate::effect::wind_up::WindUp;
use crate::message::Senders;
use crate::ray::Effect;
use crate::vehicle::Trajectory;
use gnss::bdgim::Bdgim;
use gnss::beidou::d1d2::issue;
use gnss::broadcast::Ephemeris;
use gnss::gps::lnav::{LeapEvent, UtcData};
use gnss::ionosphere::NAVIC_HZ;
use gnss::klobuchar::Klobuchar;
use gnss::message::Common;
use gnss::rinex::{self, Navigation};
use gnss::satellite::{Sv, System};
use gnss::signal::Signal;
use gnss::time::{BDT, Epoch, TimePolynomial, WEEK_S};

/// Time in seconds between the announcement of a leap second and its date: about half a year. Satellites send
/// it from then on (IERS, Bulletin C, which appears in January and July).
const ANNOUNCED_S: f64 = 26.0 * WEEK_S as f64;
/// Step of the reference time of UTC's polynomial (IS-GPS-200N, table 20-IX).
const UTC_STEP_S: i64 = 4096;
/// Seconds of a day.
const DAY_S: i64 = 86_400;
/// Warnings of one kind that are listed in full.
const LISTED: usize = 4;

/// Orbits, messages, and who is left out.
pub(super) struct Sky {
    pub catalogue: Catalogue,
    /// Parameters that all satellites send alike.
    pub common: Common,
    pub excluded: Vec<Sv>,
}

/// The navigation files that the scenario names, or the embedded one of the day of `near`. What is not an
/// ephemeris is taken from the file of the scene's day, or else from the nearest that has it, whatever their
/// order in the list.
pub(super) fn navigation(
    scenario: &Scenario,
    near: Epoch,
    Files { directory, overrides }: &Files<'_>,
    warnings: &mut Vec<String>,
) -> Result<Navigation, ScenarioError> {
    let refuse = |e: rinex::NavigationError| scenario.conflict("navigation.file", e.to_string());
    let mut files = if scenario.navigation.is_empty() { vec![embedded(scenario, near)?] } else { Vec::new() };
    for path in &scenario.navigation {
        let bytes = scenario.load("navigation.file", directory, path, overrides)?;
        files.push(rinex::read(&bytes, &path.display().to_string()).map_err(refuse)?);
    }
    if let Some(day) = scenario.moved_to {
        let first = files.iter().filter_map(middle).map(|middle| middle.seconds().div_euclid(DAY_S)).min();
        let days = first.map_or(0, |first| day.seconds().div_euclid(DAY_S) - first);
        files.iter_mut().for_each(|file| move_days(file, days));
    }
    files.sort_by(|a, b| far_s(a, scenario.start).total_cmp(&far_s(b, scenario.start)));
    let mut navigation = Navigation::default();
    for found in files {
        let Navigation {
            ephemerides,
            klobuchar,
            klobuchar_navic,
            klobuchar_beidou,
            bdgim,
            nequick,
            leap_seconds,
            leap_event,
            utc,
            galileo,
            skipped,
        } = found;
        navigation.ephemerides.extend(ephemerides);
        navigation.klobuchar = navigation.klobuchar.or(klobuchar);
        navigation.klobuchar_navic = navigation.klobuchar_navic.or(klobuchar_navic);
        navigation.klobuchar_beidou = navigation.klobuchar_beidou.or(klobuchar_beidou);
        navigation.bdgim = navigation.bdgim.or(bdgim);
        navigation.nequick = navigation.nequick.or(nequick);
        navigation.galileo = navigation.galileo.or(galileo);
        // The number belongs to the change: that of another file may be of after it.
        if navigation.leap_seconds.is_none() {
            (navigation.leap_seconds, navigation.leap_event) = (leap_seconds, leap_event);
        }
        navigation.utc = navigation.utc.or(utc);
        navigation.skipped.extend(skipped);
    }
    summarise(warnings, &navigation.skipped, "records of the navigation file left out");
    // Merged files have more systems than the scene.
    navigation.ephemerides.retain(|set| systems(scenario).any(|system| system == set.sv.system));
    Ok(navigation)
}

/// The middle one of the reference times of a file's ephemerides, for a day's file begins and ends with a few
/// of its neighbours'.
fn middle(file: &Navigation) -> Option<Epoch> {
    let mut times: Vec<i64> = file.ephemerides.iter().map(|set| set.toe.seconds()).collect();
    times.sort_unstable();
    times.get(times.len() / 2).map(|middle| Epoch::new(*middle, 0.0))
}

/// Time in seconds between a file's data and a time.
fn far_s(file: &Navigation, at: Epoch) -> f64 {
    middle(file).map_or(f64::INFINITY, |middle| at.since(middle).abs())
}

/// Moves a file by whole days. Its leap seconds stay those of its own date.
fn move_days(file: &mut Navigation, days: i64) {
    for set in &mut file.ephemerides {
        *set = set.moved(days);
        if set.sv.system == System::BeiDou {
            // That of BeiDou is a number of the reference time.
            set.iode = issue(BDT.label(set.toe).tow_s());
        }
    }
    let later_s = (days * DAY_S) as f64;
    if let Some(time) = &mut file.galileo {
        time.reference = time.reference.plus_s(later_s);
    }
    if let Some(time) = &mut file.utc {
        // Its reference time counts in steps of the message, of which a day has no whole number.
        let later = time.reference.plus_s(later_s);
        let of_week_s = later.tow_whole_s().div_euclid(UTC_STEP_S) * UTC_STEP_S;
        let reference = Epoch::new(later.week() * WEEK_S + of_week_s, 0.0);
        *time = TimePolynomial { a0_s: time.at_s(reference.plus_s(-later_s)), a1_sps: time.a1_sps, reference };
    }
    (file.leap_seconds, file.leap_event) = (None, None);
}

/// The systems of a scene's signals, each once or more.
fn systems(scenario: &Scenario) -> impl Iterator<Item = System> {
    scenario.signals.iter().map(|signal| signal.system)
}

/// Reason for which a satellite without an ephemeris at the start is not in the scene.
pub(super) fn absence(scenario: &Scenario, sv: Sv) -> String {
    if systems(scenario).any(|system| system == sv.system) {
        "it has no ephemeris at the scene's start".to_owned()
    } else {
        format!("the scene sends no signal of {}", sv.system)
    }
}

/// The embedded file of a day: the one with both systems where it reaches to that time.
fn embedded(scenario: &Scenario, at: Epoch) -> Result<Navigation, ScenarioError> {
    let refuse = |e: rinex::NavigationError| scenario.conflict("navigation.file", e.to_string());
    let second = rinex::embedded_two_systems().map_err(refuse)?;
    let near = |set: &Ephemeris| at.since(set.toe).abs() < 0.5 * set.fit_interval_s();
    if second.ephemerides.iter().any(near) { Ok(second) } else { rinex::embedded().map_err(refuse) }
}

/// Arranges the ephemerides and checks that they reach over the scene, which lasts `end_s`.
pub(super) fn sky(
    scenario: &Scenario,
    navigation: &Navigation,
    files: &Files<'_>,
    end_s: f64,
    warnings: &mut Vec<String>,
) -> Result<Sky, ScenarioError> {
    let (sets, astray): (Vec<&Ephemeris>, Vec<_>) =
        navigation.ephemerides.iter().partition(|set| unsendable(scenario, set).is_none());
    let astray: Vec<String> = astray.into_iter().filter_map(|set| unsendable(scenario, set)).collect();
    summarise(warnings, &astray, "ephemerides left out");
    let (mut catalogue, rogues) = Catalogue::new(sets.into_iter().cloned().collect());
    summarise(warnings, &rogues, "ephemerides left out");
    let (start, end) = (scenario.start, scenario.start.plus_s(end_s));
    let sends = |system: System, at| {
        catalogue.satellites().any(|sv| sv.system == system && catalogue.sent_at(sv, at).is_some())
    };
    let mut silent: Vec<System> = systems(scenario).filter(|s| !sends(*s, start) || !sends(*s, end)).collect();
    silent.dedup();
    for &system in &silent {
        let reason = outside(&catalogue, system, scenario, end);
        if systems(scenario).all(|other| silent.contains(&other)) {
            return Err(scenario.conflict("start", reason));
        }
        warnings.push(format!("no satellite sends signals of {system}: {reason}"));
    }
    let ahead = galileo_ahead(scenario, navigation);
    catalogue.set_time_offset(System::Galileo, ahead.map_or(0.0, |offset| offset.at_s(start)));
    let only = scenario.only.as_deref();
    for (key, named) in [("only", only.unwrap_or_default()), ("exclude", &scenario.excluded)] {
        for sv in named.iter().filter(|sv| catalogue.sent_at(**sv, start).is_none()) {
            warnings.push(format!("satellites.{key} names {sv}: {}", absence(scenario, *sv)));
        }
    }
    let mut excluded = scenario.excluded.clone();
    excluded.extend(catalogue.satellites().filter(|sv| only.is_some_and(|only| !only.contains(sv))));
    if !scenario.include_unhealthy {
        let computed = catalogue.satellites().filter(|sv| !excluded.contains(sv));
        let sick: Vec<Sv> = computed.filter(|sv| catalogue.is_sick(*sv, start, &scenario.signals)).collect();
        if !sick.is_empty() {
            let names: Vec<String> = sick.iter().map(Sv::to_string).collect();
            warnings.push(format!("unhealthy by their own message and left out: {}", names.join(", ")));
        }
        excluded.extend(sick);
    }
    if let Some(orbits) = &scenario.orbits {
        if scenario.moved_to.is_some() {
            let reason = "with [orbits]: expected one of them, because precise orbits are those of their own day";
            return Err(scenario.conflict("navigation.moved_to", reason.to_owned()));
        }
        let missing = orbits.follow(scenario, files, &mut catalogue, end_s)?;
        let missing = missing.into_iter().filter(|sv| catalogue.sent_at(*sv, start).is_some());
        let missing: Vec<Sv> = missing.filter(|sv| !excluded.contains(sv)).collect();
        if !missing.is_empty() {
            let names: Vec<String> = missing.iter().map(Sv::to_string).collect();
            warnings
                .push(format!("without a precise orbit and clock over the scene and left out: {}", names.join(", ")));
        }
        excluded.extend(missing);
    }
    // The program's own files are of a version without them.
    if !scenario.navigation.is_empty() {
        warnings.extend(scenario.signals.iter().filter_map(|signal| without_delays(&catalogue, signal, start)));
    }
    catalogue.depart(satellite::departures(scenario));
    warnings.extend(satellite::strangers(scenario, &catalogue));
    excluded.sort();
    excluded.dedup();
    let almanac: Vec<Ephemeris> = catalogue
        .satellites()
        .filter(|sv| catalogue.healthy(*sv, start))
        .filter_map(|sv| catalogue.sent_at(sv, start).cloned())
        .collect();
    let common = common(scenario, navigation, almanac);
    Ok(Sky { catalogue, common, excluded })
}

/// Reason for which a message of the scene cannot carry an ephemeris; `None` if all can.
fn unsendable(scenario: &Scenario, set: &Ephemeris) -> Option<String> {
    let own = scenario.signals.iter().filter(|signal| signal.system == set.sv.system);
    let mut sent = own.flat_map(|signal| signal.components.iter().filter_map(|c| Some((signal.time, c.message?))));
    sent.find_map(|(time, message)| {
        let form = (message.form)(set);
        // Messages count reference times by their system's clock, those that round them by GPS time.
        let labelled = form.clone().timed(|at| time.label(at));
        let error = message.fields.quantised(&form).err().and(message.fields.quantised(&labelled).err())?;
        Some(format!("{}: left out the ephemeris of {}: {} cannot carry it: {error}", set.sv, set.toe, message.name))
    })
}

/// Names of the satellites without a group delay of a signal in a record of its own message; `None` if all
/// have one.
fn without_delays(catalogue: &Catalogue, signal: &Signal, at: Epoch) -> Option<String> {
    let sends = |sv: &Sv| sv.system == signal.system && (signal.sent)(sv.number, at);
    let sets: Vec<&Ephemeris> =
        catalogue.satellites().filter(sends).filter_map(|sv| catalogue.sent_at(sv, at)).collect();
    let without: Vec<String> = sets.iter().filter(|set| !set.serves(signal)).map(|set| set.sv.to_string()).collect();
    let message = signal.components.iter().find_map(|component| component.message)?.name;
    let who = match without.len() {
        0 => return None,
        count if count == sets.len() => "any satellite".to_owned(),
        _ => without.join(", "),
    };
    let form = sets.first()?.form.name;
    Some(format!(
        "{}: the navigation file has no record of {message} of {who}: the group delay of {form} stands for its own, as \
         1/f^2",
        signal.name
    ))
}

/// Galileo's time against GPS time: as the scene gives it, or else as the file does.
fn galileo_ahead(scenario: &Scenario, navigation: &Navigation) -> Option<TimePolynomial> {
    let given = scenario.galileo_ahead_s.map(|a0_s| TimePolynomial { a0_s, a1_sps: 0.0, reference: scenario.start });
    given.or(navigation.galileo)
}

/// GPS time against UTC as the file has it; the whole seconds and their change as this program knows them,
/// where the file does not.
pub(super) fn utc(scenario: &Scenario, navigation: &Navigation) -> UtcData {
    let now_s = scenario.start.leap_seconds();
    let leap_s = navigation.leap_seconds.unwrap_or(now_s);
    // A file of before a change still has the number of then, and such a message says when it changed.
    let from = scenario.start.plus_s(if leap_s < now_s { -ANNOUNCED_S } else { 0.0 });
    let event = navigation.leap_event.or_else(|| LeapEvent::first(from, scenario.start.plus_s(ANNOUNCED_S)));
    UtcData { leap_s, polynomial: navigation.utc, event }
}

/// Ionosphere and time parameters that satellites send: those of the scenario, or those of the file.
fn common(scenario: &Scenario, navigation: &Navigation, almanac: Vec<Ephemeris>) -> Common {
    let given = scenario.ionosphere.as_ref().and_then(Ionosphere::sent);
    Common {
        klobuchar: given.or(navigation.klobuchar),
        klobuchar_navic: klobuchar_navic(scenario, navigation),
        klobuchar_beidou: navigation.klobuchar_beidou,
        bdgim: bdgim(scenario, navigation),
        nequick: scenario.ionosphere.as_ref().and_then(Ionosphere::sent_nequick).or(navigation.nequick),
        utc: utc(scenario, navigation),
        galileo: galileo_ahead(scenario, navigation),
        almanac,
        reference: Some(scenario.start),
        network: None,
        authentication: None,
    }
}

/// Creates the encoders of the satellites' messages.
pub(super) fn messages(
    scenario: &Scenario,
    common: &Common,
    spoofed: &[(usize, Common)],
) -> Result<Senders, ScenarioError> {
    let scene = scenario.ionosphere.as_ref();
    let is_given = scene.is_some_and(|own| own.sent().is_some() || own.sent_bdgim_tecu().is_some());
    let key = if is_given { "ionosphere" } else { "navigation.file" };
    let senders = |common: &Common| {
        Senders::new(common, &scenario.signals)
            .map_err(|e| scenario.conflict(key, format!("the navigation message cannot carry it: {e}")))
    };
    let mut all = senders(common)?;
    for (number, common) in spoofed {
        all.put_spoofed(*number, senders(common)?);
    }
    Ok(all)
}

/// BDGIM coefficients that BeiDou's satellites of the third generation send: those of the scene, or those of
/// the file.
fn bdgim(scenario: &Scenario, navigation: &Navigation) -> Option<Bdgim> {
    let given = scenario.ionosphere.as_ref().and_then(Ionosphere::sent_bdgim_tecu);
    given.map_or(navigation.bdgim, Bdgim::given)
}

/// Klobuchar coefficients that NavIC's satellites send: those of the file, or GPS's model. GPS's model is
/// used if it is the scene's, or if the file has none of NavIC.
fn klobuchar_navic(scenario: &Scenario, navigation: &Navigation) -> Option<Klobuchar> {
    let scene = scenario.ionosphere.as_ref();
    let of_gps = scene.and_then(Ionosphere::sent);
    let is_of_gps = of_gps.is_some() || scene.is_some_and(Ionosphere::is_klobuchar) && navigation.klobuchar.is_some();
    let own = navigation.klobuchar_navic.filter(|_| !is_of_gps);
    own.or(of_gps.or(navigation.klobuchar).map(|model| model.bulge_on(NAVIC_HZ)))
}

/// Text of the reason for which no ephemeris fits. It has the time of the scene at which none is sent, and
/// the nearest intervals in which some are.
fn outside(catalogue: &Catalogue, system: System, scenario: &Scenario, end: Epoch) -> String {
    let spans = catalogue.sending(system);
    let is_within = |at: Epoch| spans.iter().any(|(from, until)| *from <= at && at < *until);
    let (what, at) = if is_within(scenario.start) { ("end", end) } else { ("start", scenario.start) };
    let before = spans.iter().rev().find(|(_, until)| *until <= at);
    let after = spans.iter().find(|(_, until)| *until > at);
    let near = before.into_iter().chain(after).map(|(from, until)| format!("{from} to {until}")).collect::<Vec<_>>();
    let expected = match near.as_slice() {
        [] => return format!("the navigation file has no ephemeris of {system}: expected one of that system"),
        near => near.join(" or "),
    };
    format!(
        "no {system} ephemeris of the navigation file fits at {at}, the {what} of the scene of {} s: expected a scene \
         within {expected}",
        scenario.duration_s
    )
}

/// Adds a list to the warnings: the first few entries, and the number of the others.
fn summarise(warnings: &mut Vec<String>, list: &[String], what: &str) {
    if list.len() <= LISTED {
        warnings.extend_from_slice(list);
    } else {
        let first = list.iter().take(LISTED - 1).cloned().collect::<Vec<_>>().join("; ");
        warnings.push(format!("{} {what}: {first}; …", list.len()));
    }
}

/// The effects in the order in which they act: ionosphere, troposphere, wind-up, strength, echoes of all
/// that, then what obstructs the direct ray.
pub(super) fn effects(
    scenario: &Scenario,
    files: &Files<'_>,
    navigation: &Navigation,
    (sky, trajectory): (&Sky, &Trajectory),
    end_s: f64,
) -> Result<Vec<Box<dyn Effect>>, ScenarioError> {
    let mut effects: Vec<Box<dyn Effect>> = Vec::new();
    if let Some(ionosphere) = &scenario.ionosphere {
        effects.push(ionosphere.effect(scenario, files, navigation, end_s)?);
    }
    if let Some(troposphere) = &scenario.troposphere {
        effects.push(troposphere.effect(scenario, files)?);
    }
    let wind_up = WindUp::new(scenario.start, trajectory.clone(), &sky.catalogue)
        .map_err(|e| scenario.conflict("navigation.file", e.to_string()))?;
    if let Some(wind_up) = wind_up {
        effects.push(Box::new(wind_up));
    }
    effects.push(scenario.power.effect(scenario, trajectory, files.directory, files.overrides)?);
    if let Some(spec) = &scenario.city {
        effects.push(Box::new(city::effect(spec, scenario, files, (sky, trajectory), end_s)?));
    }
    if !scenario.multipath.is_empty() {
        effects.push(Box::new(multipath::effect(scenario, trajectory)?));
    }
    if !scenario.obstacles.is_empty() {
        effects.push(Box::new(Obstruction::new(scenario.obstacles.clone(), trajectory.at(0.0).position_m)));
    }
    Ok(effects)
}
