//! Tables `[orbits]`, `[[satellite_fault]]` and `[[message_fault]]` as written, and the faults that they
//! become.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::files::Files;
use super::hardware::power_law;
use super::interference::times;
use super::keys::satellites::parameters;
use super::own_sky::Own;
use super::parts::absence;
use super::read::Table;
use super::{Scenario, ScenarioError, satellite_list};
use crate::catalogue::Catalogue;
use crate::clock::ReceiverClock;
use crate::clock::nodes::{Nodes, node_samples};
use crate::clock::oscillator::{Oscillator, PowerLaw};
use crate::fast_phase::satellite::{Change, ChangeKind, SatelliteClocks};
use crate::message::{FOREVER_S, Kind, MessageFault, spoiled};
use crate::orbit_error::Displacement;
use crate::precise::{Hardware, Orbits};
use crate::random::Stream;
use gnss::message::Message;
use gnss::satellite::{Sv, System};
use gnss::sp3::{self, Precise};

/// True time beyond both ends of the scene for which there must be orbits: light times and the receiver's
/// clock.
const MARGIN_S: f64 = 2.0;

/// `[orbits]`.
#[derive(Clone, Debug, PartialEq)]
pub struct OrbitsSpec {
    /// SP3 files, in order of time.
    pub files: Vec<PathBuf>,
    /// Offset in metres of the antenna from the centre of mass towards the Earth, for all satellites.
    pub antenna_m: f64,
    /// Offset in metres of the antenna from the centre of mass towards the Earth, by satellite.
    pub antennas_m: Vec<(Sv, f64)>,
}

/// Table `[[satellite_fault]]`. Times are true ones since the scene's start.
#[derive(Clone, Debug, PartialEq)]
pub enum SatelliteFault {
    /// A clock that jumps and, at the end, jumps back.
    Step {
        /// The satellites concerned.
        satellites: Vec<Sv>,
        /// Clock offset in seconds, positive ahead.
        step_s: f64,
        /// Start of the fault, in seconds of true time since the scene's start.
        on_s: f64,
        /// End of the fault, in seconds of true time since the scene's start; absent means the end of the
        /// scene.
        off_s: Option<f64>,
    },
    /// Clock drift until the end of the fault; the accumulated offset remains.
    Ramp {
        /// The satellites concerned.
        satellites: Vec<Sv>,
        /// Clock drift in s/s.
        drift: f64,
        /// Start of the fault, in seconds of true time since the scene's start.
        on_s: f64,
        /// End of the fault, in seconds of true time since the scene's start; absent means the end of the
        /// scene.
        off_s: Option<f64>,
    },
    /// A clock that is noisier than it broadcasts.
    Noise {
        /// The satellites concerned; absent means all.
        satellites: Option<Vec<Sv>>,
        /// Power law of the added noise.
        law: PowerLaw,
    },
    /// A true orbit beside the broadcast one.
    Orbit {
        /// The satellites concerned.
        satellites: Vec<Sv>,
        /// Radial displacement in metres, positive outwards.
        radial_m: f64,
        /// Displacement along the inertial motion, in metres.
        along_m: f64,
        /// Displacement along the angular momentum, in metres.
        cross_m: f64,
        /// Start and duration in seconds of the offset's growth; absent means that it exists from the
        /// beginning.
        growth_s: Option<(f64, f64)>,
    },
}

/// One `[[message_fault]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct MessageSpec {
    /// Number of the spoofer whose messages it spoils; 0 for the true satellites.
    pub spoofer: usize,
    /// Satellites with the fault; absent means all.
    pub satellites: Option<Vec<Sv>>,
    /// Start of the fault, in seconds of true time since the scene's start.
    pub on_s: f64,
    /// End of the fault, in seconds of true time since the scene's start; absent means the end of the scene.
    pub off_s: Option<f64>,
    /// Kind of the fault.
    pub kind: MessageKind,
}

/// Kind of a message fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MessageKind {
    /// Symbols that are wrong at random.
    BitErrors {
        /// Probability of a wrong symbol.
        rate: f64,
    },
    /// One symbol of every unit of a kind.
    Bit {
        /// Number of the unit within its frame, from 1.
        subframe: u8,
        /// Word of 30 symbols, from 1.
        word: u8,
        /// Symbol of the word, from 1.
        bit: u8,
    },
    /// The bits of health.
    Health(u16),
    /// A wrong value with right parity.
    Parameter {
        /// Name in the message's table.
        name: &'static str,
        /// Value that is added, in the parameter's unit.
        add: f64,
    },
    /// Alert pages instead of all others.
    Alert,
}

pub(super) fn orbits(table: &Table<'_>) -> Result<OrbitsSpec, ScenarioError> {
    let expected = "the path of an SP3 file, or an array of such paths";
    let files = table.texts("sp3")?.filter(|files| !files.is_empty());
    let mut antennas_m = Vec::new();
    if let Some(each) = table.table("antenna_offsets_m")? {
        for name in each.names() {
            let sv = name.parse().map_err(|e| each.bad(name, e))?;
            antennas_m.push((sv, each.need(name)?));
        }
    }
    Ok(OrbitsSpec {
        files: files.ok_or_else(|| table.bad("sp3", expected))?.iter().map(PathBuf::from).collect(),
        antenna_m: table.need("antenna_offset_m")?,
        antennas_m,
    })
}

/// The satellites that a fault must name.
fn named(table: &Table<'_>) -> Result<Vec<Sv>, ScenarioError> {
    satellite_list(table, "satellites")?
        .filter(|list| !list.is_empty())
        .ok_or_else(|| table.bad("satellites", "an array of satellites like [\"G01\", \"G12\"]"))
}

/// The satellites that a fault may name; all, if it names none.
fn some(table: &Table<'_>) -> Result<Option<Vec<Sv>>, ScenarioError> {
    if table.has("satellites") { named(table).map(Some) } else { Ok(None) }
}

pub(super) fn satellite_fault(table: &Table<'_>) -> Result<SatelliteFault, ScenarioError> {
    let kinds = [("clock_step", 0), ("clock_ramp", 1), ("clock_noise", 2), ("orbit", 3)];
    match table.need_choice("kind", &kinds)? {
        0 => {
            let (on_s, off_s) = times(table)?;
            let step_s = table.need("step_s")?;
            Ok(SatelliteFault::Step { satellites: named(table)?, step_s, on_s, off_s })
        }
        1 => {
            let (on_s, off_s) = times(table)?;
            let drift = table.need("drift_sps")?;
            Ok(SatelliteFault::Ramp { satellites: named(table)?, drift, on_s, off_s })
        }
        2 => {
            let law = power_law(table)?;
            let expected = "the oscillator by name, or power_law = [h2, h1, h0, h-1, h-2]";
            let law = law.ok_or_else(|| table.bad("oscillator", expected))?;
            Ok(SatelliteFault::Noise { satellites: some(table)?, law })
        }
        _ => {
            let axis = |key: &str| table.need(key);
            let times = (table.number("on_s")?, table.number("ramp_s")?);
            let growth_s = match times {
                (None, None) => None,
                (Some(on_s), Some(ramp_s)) => Some((on_s, ramp_s)),
                (Some(_), None) => {
                    return Err(
                        table.bad("ramp_s", "the time that it takes, because on_s is given and orbits do not jump")
                    );
                }
                (None, Some(_)) => {
                    return Err(table.bad("on_s", "the time at which it begins, because ramp_s is given"));
                }
            };
            Ok(SatelliteFault::Orbit {
                satellites: named(table)?,
                radial_m: axis("radial_m")?,
                along_m: axis("along_m")?,
                cross_m: axis("cross_m")?,
                growth_s,
            })
        }
    }
}

pub(super) fn message_fault(table: &Table<'_>) -> Result<MessageSpec, ScenarioError> {
    let kinds = [("bit_errors", 0), ("bit", 1), ("health", 2), ("parameter", 3), ("alert", 4)];
    let kind = table.need_choice("kind", &kinds)?;
    let count = |key: &str| table.need_integer(key).map(|value| value as u8);
    let (on_s, off_s) = times(table)?;
    let satellites = some(table)?;
    let kind = match kind {
        0 => MessageKind::BitErrors { rate: table.need("rate")? },
        1 => {
            let (subframe, word) = (count("subframe")?, count("word")?);
            MessageKind::Bit { subframe, word, bit: count("bit")? }
        }
        2 => {
            named(table)?;
            MessageKind::Health(table.need_integer("health")? as u16)
        }
        4 => {
            named(table)?;
            MessageKind::Alert
        }
        _ => {
            named(table)?;
            let names: Vec<(&str, &'static str)> = parameters().into_iter().map(|name| (name, name)).collect();
            let name = table.need_choice("parameter", &names)?;
            MessageKind::Parameter { name, add: table.need("add")? }
        }
    };
    let spoofer = table.integer("spoofer")?.unwrap_or(0) as usize;
    Ok(MessageSpec { spoofer, satellites, on_s, off_s, kind })
}

impl OrbitsSpec {
    /// Lets `catalogue` follow the files' orbits, and reports which of its satellites they do not hold over
    /// the scene, which lasts to `end_s`.
    pub(super) fn follow(
        &self,
        scenario: &Scenario,
        files: &Files<'_>,
        catalogue: &mut Catalogue,
        end_s: f64,
    ) -> Result<Vec<Sv>, ScenarioError> {
        let refuse = |reason: String| scenario.conflict("orbits.sp3", reason);
        let mut precise = Precise::default();
        for path in &self.files {
            let bytes = scenario.load("orbits.sp3", files.directory, path, files.overrides)?;
            precise.extend(sp3::read(&bytes, &path.display().to_string()).map_err(|e| refuse(e.to_string()))?);
        }
        let hardware = |sv: Sv| {
            let own = self.antennas_m.iter().find(|(named, _)| *named == sv).map(|(_, offset_m)| *offset_m);
            let set = catalogue.sent_at(sv, scenario.start)?;
            // The products' clocks of Galileo belong to the combination of E1 and E5a.
            let tgd_s = if sv.system == System::Galileo { set.tgd2_s } else { set.tgd_s };
            Some(Hardware { tgd_s, antenna_m: own.unwrap_or(self.antenna_m) })
        };
        let orbits = Orbits::new(&precise, hardware)
            .ok_or_else(|| refuse("expected 12 to 50000 epochs between the first and the last".to_owned()))?;
        let (from, to) = (scenario.start.plus_s(-MARGIN_S), scenario.start.plus_s(end_s + MARGIN_S));
        let (held, missing): (Vec<Sv>, Vec<Sv>) = catalogue.satellites().partition(|sv| orbits.covers(*sv, from, to));
        if held.is_empty() {
            let (first, last) = orbits.reach();
            let (begin, end) = precise.span().unwrap_or((first, last));
            return Err(refuse(format!(
                "epochs from {begin} to {end} give orbits from {first} to {last} (six epochs on either side), the \
                 scene needs {from} to {to}: name the files of its days, the neighbouring day's too near midnight"
            )));
        }
        catalogue.follow(orbits);
        Ok(missing)
    }
}

/// Displacements of the true orbits that faults cause; those of zero size are left out.
pub(super) fn departures(scenario: &Scenario) -> Vec<Displacement> {
    let departure = |fault: &SatelliteFault| match fault {
        SatelliteFault::Orbit { satellites, radial_m, along_m, cross_m, growth_s } => {
            let growth = growth_s.map(|(on_s, ramp_s)| (scenario.start.plus_s(on_s), ramp_s));
            let felt = (*radial_m, *along_m, *cross_m) != (0.0, 0.0, 0.0);
            felt.then(|| Displacement {
                satellites: satellites.clone(),
                radial_m: *radial_m,
                along_m: *along_m,
                cross_m: *cross_m,
                growth,
            })
        }
        _ => None,
    };
    scenario.satellite_faults.iter().filter_map(departure).collect()
}

/// Clock errors that faults cause; those of zero size are left out. `catalogue` knows who there is.
pub(super) fn clocks(
    scenario: &Scenario,
    catalogue: &Catalogue,
    receiver_clock: &ReceiverClock,
    seed: u64,
    nodes: Nodes,
) -> SatelliteClocks {
    // Stations have clocks and rates of their own: what all of them see is drawn over the true time.
    let shared = scenario.station.is_some().then(Nodes::common);
    let (rate, drawn_at) = (nodes.rate(), shared.unwrap_or(nodes).rate());
    let mut clocks = SatelliteClocks { shared, ..SatelliteClocks::default() };
    let node = |t_s: f64| {
        let sample = receiver_clock.reading_elapsed_s(scenario.start, t_s) * rate.hz();
        (sample / node_samples(rate) as f64).ceil().max(0.0) as u64
    };
    let names = |list: &[Sv]| list.iter().map(Sv::to_string).collect::<Vec<_>>().join(" ");
    for (number, fault) in (1_u64..).zip(&scenario.satellite_faults) {
        let (satellites, kind, on_s, off_s, text) = match fault {
            SatelliteFault::Step { satellites, step_s, on_s, off_s } if *step_s != 0.0 => {
                let text = format!("clock steps by {step_s:e} s");
                (satellites, ChangeKind::Step { step_s: *step_s }, *on_s, *off_s, text)
            }
            SatelliteFault::Ramp { satellites, drift, on_s, off_s } if *drift != 0.0 => {
                let text = format!("clock drifts by {drift:e} s/s");
                (satellites, ChangeKind::Ramp { drift: *drift }, *on_s, *off_s, text)
            }
            SatelliteFault::Noise { satellites, law } => {
                let stream = Stream::new(seed, "satellite clock").part(number);
                let all: Vec<Sv> = satellites.clone().unwrap_or_else(|| catalogue.satellites().collect());
                for sv in &all {
                    let oscillator = Oscillator::new(*law, drawn_at, stream.satellite(*sv));
                    clocks.clocks.entry(*sv).or_default().noise.push(oscillator);
                }
                let who = satellites.as_ref().map_or("all satellites".to_owned(), |list| names(list));
                clocks.descriptions.push(format!("{who}: clock noise h = {:?}", law.levels()));
                continue;
            }
            _ => continue,
        };
        let change = Change { from_node: node(on_s), until_node: off_s.map_or(u64::MAX, node), kind };
        for sv in satellites {
            clocks.clocks.entry(*sv).or_default().changes.push(change);
        }
        let until = off_s.map_or(String::new(), |off_s| format!(" to {off_s} s"));
        clocks.descriptions.push(format!("{}: {text} from {on_s} s{until}", names(satellites)));
    }
    clocks
}

/// Faults of messages, each tested on the message at its start. Faults of zero size are left out.
pub(super) fn message_faults(
    scenario: &Scenario,
    catalogue: &Catalogue,
    own: &[Own],
    seed: u64,
) -> Result<Vec<MessageFault>, ScenarioError> {
    let mut faults = Vec::new();
    for (number, spec) in (1_u64..).zip(&scenario.message_faults) {
        let (catalogue, start) = match spec.spoofer.checked_sub(1).map(|index| scenario.spoofers.get(index)) {
            None => (catalogue, scenario.start),
            Some(Some(spoofer)) => {
                let sky = own.iter().find(|own| own.number == spec.spoofer).and_then(|own| own.sky.as_ref());
                let start = scenario.start.plus_s(spoofer.ahead_s as f64 - spoofer.replay_s);
                (sky.map_or(catalogue, |sky| &sky.catalogue), start)
            }
            Some(None) => {
                let known = scenario.spoofers.len();
                let reason = format!("number {number}: {}: expected one of the {known} [[spoofer]]", spec.spoofer);
                return Err(scenario.conflict("message_fault.spoofer", reason));
            }
        };
        let at = |t_s: f64| start.plus_s(t_s);
        let kind = match spec.kind {
            MessageKind::BitErrors { rate: 0.0 } => continue,
            MessageKind::BitErrors { rate } => {
                Kind::BitErrors { rate, stream: Stream::new(seed, "message").part(number) }
            }
            MessageKind::Bit { subframe, word, bit } => Kind::Bit { subframe, word, bit },
            MessageKind::Health(health) => Kind::Health(health),
            MessageKind::Parameter { add: 0.0, .. } => continue,
            MessageKind::Parameter { name, add } => Kind::Parameter { name, add },
            MessageKind::Alert => Kind::Alert,
        };
        let fault = MessageFault {
            constellation: spec.spoofer,
            satellites: spec.satellites.clone(),
            on: at(spec.on_s)..at(spec.off_s.unwrap_or(FOREVER_S)),
            kind,
        };
        for sv in spec.satellites.iter().flatten() {
            let sent = catalogue.sent_at(*sv, fault.on.start);
            let own = scenario.signals.iter().filter(|signal| signal.system == sv.system);
            let all: Vec<&'static Message> =
                own.flat_map(|signal| signal.components.iter().filter_map(|component| component.message)).collect();
            // Of several messages those are spoiled that can be.
            let reasons: Vec<Option<String>> = all.iter().map(|message| fault.kind.foreign(message)).collect();
            if let (true, Some(reason)) = (reasons.iter().all(Option::is_some), reasons.iter().flatten().next()) {
                return Err(scenario.conflict("message_fault", format!("number {number}, {sv}: {reason}")));
            }
            for message in all {
                let only = std::slice::from_ref(&fault);
                let wrong = sent.and_then(|set| spoiled(only, message, *sv, set, fault.on.start));
                if let Some(Err(error)) = wrong.map(|set| message.fields.quantised(&set)) {
                    let reason = format!("number {number}, {sv}: {error}");
                    return Err(scenario.conflict("message_fault", reason));
                }
            }
        }
        faults.push(fault);
    }
    Ok(faults)
}

/// Satellites that faults name and that have no message at the scene's start.
pub(super) fn strangers(scenario: &Scenario, catalogue: &Catalogue) -> Vec<String> {
    let of_satellites = scenario.satellite_faults.iter().filter_map(|fault| match fault {
        SatelliteFault::Step { satellites, .. }
        | SatelliteFault::Ramp { satellites, .. }
        | SatelliteFault::Orbit { satellites, .. } => Some(satellites),
        SatelliteFault::Noise { satellites, .. } => satellites.as_ref(),
    });
    let of_messages = scenario.message_faults.iter().filter(|fault| fault.spoofer == 0);
    let of_messages = of_messages.filter_map(|fault| fault.satellites.as_ref());
    let named: BTreeSet<Sv> = of_satellites.chain(of_messages).flatten().copied().collect();
    let unknown = named.into_iter().filter(|sv| catalogue.sent_at(*sv, scenario.start).is_none());
    unknown.map(|sv| format!("a fault names {sv}: {}", absence(scenario, sv))).collect()
}
