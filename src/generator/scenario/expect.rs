//! Table `[expect]`: expectations about a receiver, where they differ from those by physics alone.

use super::read::Table;
use super::{Scenario, ScenarioError, satellite_list};
use crate::scenario::{MessageKind, SatelliteFault};
use gnss::facts::{Expect, Fault, FaultKind, Fixes, Interval, Losses, Sizes, Terms};

pub(super) fn expect(table: &Table<'_>, duration_s: f64) -> Result<Expect, ScenarioError> {
    let intervals = table.tables("interval")?.unwrap_or_default();
    let intervals = intervals.iter().map(|table| interval(table, duration_s)).collect::<Result<Vec<_>, _>>()?;
    let says = SAYS.iter().any(|key| table.has(key));
    if !says && (intervals.is_empty() || table.has("reason") || table.has("satellites")) {
        return Err(table.bad("fix", NOTHING));
    }
    Ok(Expect { whole: if says { Some(terms(table)?) } else { None }, intervals })
}

/// Keys of which one at least states what is expected.
const SAYS: [&str; 4] = ["fix", "losses", "errors", "position_within_m"];
const NOTHING: &str = "at least one of fix, losses, errors and position_within_m";

fn interval(table: &Table<'_>, duration_s: f64) -> Result<Interval, ScenarioError> {
    let from_s = table.need("from_s")?;
    let to_s = table.need("to_s")?;
    if from_s >= duration_s {
        return Err(table.bad("from_s", format!("less than duration_s = {duration_s}")));
    }
    if to_s <= from_s {
        return Err(table.bad("to_s", format!("more than from_s = {from_s}")));
    }
    if !SAYS.iter().any(|key| table.has(key)) {
        return Err(table.bad("fix", NOTHING));
    }
    Ok(Interval { from_s, to_s, terms: terms(table)? })
}

fn terms(table: &Table<'_>) -> Result<Terms, ScenarioError> {
    let terms = Terms {
        fix: table.choice("fix", &Fixes::NAMES)?,
        losses: table.choice("losses", &Losses::NAMES)?,
        satellites: satellite_list(table, "satellites")?,
        errors: table.choice("errors", &Sizes::NAMES)?,
        position_within_m: table.number("position_within_m")?,
        reason: table.need_text("reason")?.to_owned(),
    };
    if terms.satellites.is_some() && terms.losses.is_none() {
        return Err(table.bad("satellites", "losses beside it: it names the satellites that losses is about"));
    }
    Ok(terms)
}

impl Scenario {
    /// Lists the faults of satellites and messages in the form that the judge needs.
    pub(super) fn faults(&self) -> Vec<Fault> {
        let fault = |kind: FaultKind, satellites: Option<&[_]>, from_s, to_s| Fault {
            kind,
            satellites: satellites.map(<[_]>::to_vec),
            from_s,
            to_s,
        };
        let of_satellite = |one: &SatelliteFault| match one {
            SatelliteFault::Step { satellites, on_s, off_s, .. } => {
                fault(FaultKind::ClockStep, Some(satellites), *on_s, *off_s)
            }
            SatelliteFault::Ramp { satellites, on_s, off_s, .. } => {
                fault(FaultKind::ClockRamp, Some(satellites), *on_s, *off_s)
            }
            SatelliteFault::Noise { satellites, .. } => fault(FaultKind::ClockNoise, satellites.as_deref(), 0.0, None),
            SatelliteFault::Orbit { satellites, growth_s, .. } => {
                fault(FaultKind::Orbit, Some(satellites), growth_s.map_or(0.0, |(on_s, _)| on_s), None)
            }
        };
        let of_message = |one: &super::MessageSpec| {
            let kind = match one.kind {
                MessageKind::BitErrors { .. } => FaultKind::BitErrors,
                MessageKind::Bit { .. } => FaultKind::Bit,
                MessageKind::Health(_) => FaultKind::Health,
                MessageKind::Parameter { .. } => FaultKind::Parameter,
                MessageKind::Alert => FaultKind::Alert,
            };
            fault(kind, one.satellites.as_deref(), one.on_s, one.off_s)
        };
        let satellites = self.satellite_faults.iter().map(of_satellite);
        satellites.chain(self.message_faults.iter().filter(|one| one.spoofer == 0).map(of_message)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::satellite::Sv;

    const SCENE: &str = "name = \"x\"\nstart = 2010-07-01T10:00:00\nduration_s = 60\n[motion]\nkind = \"static\"\n\
                         latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n";

    fn read(text: &str) -> Result<Expect, String> {
        Scenario::parse(&format!("{SCENE}{text}"), "s.toml").map(|s| s.expect).map_err(|e| e.to_string())
    }

    #[test]
    fn a_scene_says_what_it_expects_over_all_and_by_interval() {
        let found = read(
            "[expect]\nfix = \"none\"\nreason = \"one satellite\"\n[[expect.interval]]\nfrom_s = 10\nto_s = 20\n\
             losses = \"any\"\nsatellites = [\"G07\"]\nerrors = \"any\"\nposition_within_m = 40\nreason = \"jammer\"\n",
        )
        .unwrap();
        let whole = found.whole.clone().unwrap();
        assert_eq!((whole.fix, whole.losses, whole.reason.as_str()), (Some(Fixes::None), None, "one satellite"));
        assert_eq!(found.losses(Sv::gps(7), 15.0), Some(Losses::Any));
        assert_eq!((found.losses(Sv::gps(8), 15.0), found.bounded(15.0), found.bounded(25.0)), (None, false, true));
        let within = [15.0, 25.0].map(|t_s| found.position_within_m(t_s).map(|(_, bound_m)| bound_m));
        assert_eq!(within, [Some(40.0), None]);
        assert!(read("").unwrap().is_empty());
    }

    #[test]
    fn what_an_expectation_cannot_mean_is_refused_by_name() {
        let interval = "[[expect.interval]]\nfix = \"any\"\nreason = \"x\"\n";
        for (text, expected) in [
            ("[expect]\nfix = \"none\"\n".to_owned(), "expect.reason = absent: expected a sentence"),
            ("[expect]\nfix = \"maybe\"\nreason = \"x\"\n".to_owned(), "one of required, none, any"),
            ("[expect]\nreason = \"x\"\n".to_owned(), "at least one of fix, losses, errors and position_within_m"),
            ("[expect]\n".to_owned(), "at least one of fix, losses, errors and position_within_m"),
            ("[expect]\nfixes = \"none\"\n".to_owned(), "did you mean 'fix'"),
            (format!("{interval}from_s = 20\nto_s = 10\n"), "more than from_s = 20"),
            (format!("{interval}from_s = 60\nto_s = 70\n"), "less than duration_s = 60"),
            (format!("{interval}to_s = 70\n"), "expect.interval[1].from_s"),
            (format!("{interval}from_s = 1\nto_s = 2\nsatellites = [\"G01\"]\n"), "losses beside it"),
        ] {
            let error = read(&text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
