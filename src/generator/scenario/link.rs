//! Signal power as written: a link budget, or fixed ratios.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::read::Table;
use super::{Overrides, Scenario, ScenarioError};
use crate::effect::antenna::{self, Antenna, Pattern};
use crate::effect::link::{FixedCn0, LinkBudget};
use crate::effect::transmit::{self, Block};
use crate::ray::{Effect, Ray, Sight};
use crate::vehicle::Trajectory;
use gnss::gps::l1ca::L1_CA;
use gnss::place::counted;
use gnss::satellite::Sv;
use gnss::signal::Signal;

/// Power of the satellites' signals.
#[derive(Clone, Debug, PartialEq)]
pub enum Power {
    /// One C/N0 for all satellites except those listed.
    Fixed {
        /// C/N0 at the antenna of all satellites without a value of their own, in dB-Hz.
        cn0_dbhz: f64,
        /// Satellites with a C/N0 of their own, in dB-Hz.
        satellites: Vec<(Sv, f64)>,
    },
    /// Power by a link budget from range, elevation and antennas.
    LinkBudget {
        /// The satellites' transmit patterns.
        transmit: Transmit,
        /// Power that a satellite radiates at least, in dBW.
        transmit_dbw: f64,
        /// Satellites whose block the scene names.
        blocks: Vec<(Sv, Block)>,
        /// The antenna.
        antenna: AntennaSpec,
        /// Noise figure of the receiver, in dB.
        noise_figure_db: f64,
        /// Losses between antenna and receiver, in dB.
        loss_db: f64,
    },
}

/// Transmit antennas of the satellites that a scene does not name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmit {
    /// Antenna of one block for all satellites.
    Block(Block),
    /// Antennas of the satellites that were in orbit at the scene's date.
    Constellation,
}

/// Receiving antenna, whose file is not yet read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AntennaSpec {
    /// Antenna with equal gain in every direction.
    Isotropic,
    /// A patch antenna.
    Patch,
    /// Crossed dipoles.
    Turnstile,
    /// A table of gain and phase.
    Table(PathBuf),
}

impl Power {
    /// The largest C/N0 to expect. A table of gains is taken for a dish's.
    pub(super) fn strongest_dbhz(&self) -> f64 {
        match self {
            Self::LinkBudget { transmit, transmit_dbw, blocks, antenna, noise_figure_db, loss_db } => {
                let peak_dbic = match antenna {
                    AntennaSpec::Isotropic => 0.0,
                    AntennaSpec::Patch | AntennaSpec::Turnstile => 5.0,
                    AntennaSpec::Table(_) => 20.0,
                };
                let budget = LinkBudget {
                    transmit_dbw: *transmit_dbw,
                    block: match transmit {
                        Transmit::Block(block) => *block,
                        Transmit::Constellation => Block::Typical,
                    },
                    blocks: blocks.clone(),
                    noise_figure_db: *noise_figure_db,
                    extra_loss_db: *loss_db,
                    ..LinkBudget::default()
                };
                budget.strongest_dbhz(peak_dbic, L1_CA.centre_hz())
            }
            Self::Fixed { cn0_dbhz, satellites } => satellites.iter().fold(*cn0_dbhz, |most, (_, x)| most.max(*x)),
        }
    }

    /// The effect that gives rays their power, on a body that moves along `trajectory`.
    pub(super) fn effect(
        &self,
        scenario: &Scenario,
        trajectory: &Trajectory,
        directory: &Path,
        overrides: &Overrides,
    ) -> Result<Box<dyn Effect>, ScenarioError> {
        match self {
            Self::LinkBudget { transmit, transmit_dbw, blocks, antenna, noise_figure_db, loss_db } => {
                if let Some(signal) = scenario.signals.iter().find(|signal| signal.minimum_power_dbw.is_none()) {
                    let reason = format!(
                        "\"link_budget\" with {signal}: no least power on the ground is known of it; write cn0_dbhz \
                         instead"
                    );
                    return Err(scenario.conflict("power.kind", reason));
                }
                let (block, flying) = match transmit {
                    Transmit::Block(block) => (*block, Vec::new()),
                    Transmit::Constellation => (Block::Typical, constellation(scenario)?),
                };
                let body = trajectory.attitude().map(|_| (scenario.start, Arc::new(trajectory.clone())));
                Ok(Box::new(LinkBudget {
                    transmit_dbw: *transmit_dbw,
                    block,
                    blocks: [blocks.as_slice(), &flying].concat(),
                    antenna: Antenna { pattern: pattern(antenna, scenario, directory, overrides)?, body },
                    noise_figure_db: *noise_figure_db,
                    extra_loss_db: *loss_db,
                    ..LinkBudget::default()
                }))
            }
            Self::Fixed { cn0_dbhz, satellites } => {
                let default = FixedCn0 { cn0_dbhz: *cn0_dbhz };
                if satellites.is_empty() {
                    return Ok(Box::new(default));
                }
                let satellites = satellites.iter().map(|&(sv, cn0_dbhz)| (sv, FixedCn0 { cn0_dbhz })).collect();
                Ok(Box::new(ListedCn0 { default, satellites }))
            }
        }
    }
}

fn constellation(scenario: &Scenario) -> Result<Vec<(Sv, Block)>, ScenarioError> {
    transmit::constellation(scenario.start).ok_or_else(|| {
        let reason = format!(
            "\"constellation\" at {}: the blocks are known here from 2010-05-28 to 2011-07-16; name them in \
             [power.blocks] (G05 = \"IIR-M\") or let transmit be one for all",
            scenario.start
        );
        scenario.conflict("power.transmit", reason)
    })
}

fn pattern(
    antenna: &AntennaSpec,
    scenario: &Scenario,
    directory: &Path,
    overrides: &Overrides,
) -> Result<Pattern, ScenarioError> {
    Ok(match antenna {
        AntennaSpec::Isotropic => Pattern::Isotropic,
        AntennaSpec::Patch => Pattern::Patch,
        AntennaSpec::Turnstile => Pattern::Turnstile,
        AntennaSpec::Table(path) => {
            let bytes = scenario.load("power.antenna_file", directory, path, overrides)?;
            let table = antenna::Table::read(bytes.as_slice(), &path.display().to_string());
            let table = table.map_err(|e| scenario.conflict("power.antenna_file", e.to_string()))?;
            Pattern::Table(Arc::new(table))
        }
    })
}

pub(super) fn power(table: Option<&Table<'_>>) -> Result<Power, ScenarioError> {
    let ordinary = LinkBudget::default();
    let Some(table) = table else {
        return Ok(Power::LinkBudget {
            transmit: Transmit::Block(ordinary.block),
            transmit_dbw: ordinary.transmit_dbw,
            blocks: Vec::new(),
            antenna: AntennaSpec::Patch,
            noise_figure_db: ordinary.noise_figure_db,
            loss_db: ordinary.extra_loss_db,
        });
    };
    let fixed = match table.choice("kind", &[("fixed", true), ("link_budget", false)])? {
        Some(fixed) => fixed,
        None => table.has("cn0_dbhz"),
    };
    if fixed {
        let table = table.of_kind("fixed");
        table.allow_own()?;
        let cn0_dbhz = table.need("cn0_dbhz")?;
        let mut satellites = Vec::new();
        if let Some(each) = table.table("satellites")? {
            for name in each.names() {
                let sv = name.parse().map_err(|e| each.bad(name, e))?;
                satellites.push((sv, each.need(name)?));
            }
        }
        return Ok(Power::Fixed { cn0_dbhz, satellites });
    }
    let table = &table.of_kind("link_budget");
    table.allow_own()?;
    let mut blocks = Vec::new();
    if let Some(each) = table.table("blocks")? {
        for name in each.names() {
            let sv = name.parse().map_err(|e| each.bad(name, e))?;
            blocks.extend(each.choice(name, &Block::NAMES)?.map(|block| (sv, block)));
        }
    }
    let [typical, iia, iir, iirm] = Block::NAMES.map(|(name, block)| (name, Transmit::Block(block)));
    let transmits = [typical, iia, iir, iirm, ("constellation", Transmit::Constellation)];
    Ok(Power::LinkBudget {
        transmit: table.choice("transmit", &transmits)?.unwrap_or(Transmit::Block(ordinary.block)),
        transmit_dbw: table.need("transmit_dbw")?,
        blocks,
        antenna: antenna_spec(table)?,
        noise_figure_db: table.need("noise_figure_db")?,
        loss_db: table.need("loss_db")?,
    })
}

fn antenna_spec(table: &Table<'_>) -> Result<AntennaSpec, ScenarioError> {
    #[derive(Clone, Copy, PartialEq)]
    enum Kind {
        Isotropic,
        Patch,
        Turnstile,
        Table,
    }
    let kinds = [
        ("isotropic", Kind::Isotropic),
        ("patch", Kind::Patch),
        ("turnstile", Kind::Turnstile),
        ("table", Kind::Table),
    ];
    let kind = table.choice("antenna", &kinds)?.unwrap_or(Kind::Patch);
    let file = table.text("antenna_file")?;
    Ok(match (kind, file) {
        (Kind::Table, Some(file)) => AntennaSpec::Table(PathBuf::from(file)),
        (Kind::Table, None) => return Err(table.bad("antenna_file", "a path, because antenna = \"table\"")),
        (_, Some(_)) => return Err(table.bad("antenna_file", "absent, unless antenna = \"table\"")),
        (Kind::Isotropic, None) => AntennaSpec::Isotropic,
        (Kind::Patch, None) => AntennaSpec::Patch,
        (Kind::Turnstile, None) => AntennaSpec::Turnstile,
    })
}

/// C/N0 by a list of satellites, and one value for all others.
struct ListedCn0 {
    default: FixedCn0,
    satellites: Vec<(Sv, FixedCn0)>,
}

impl Effect for ListedCn0 {
    fn name(&self) -> &'static str {
        self.default.name()
    }

    fn describe(&self) -> String {
        let named = counted(self.satellites.len(), "satellite");
        format!("{} dB-Hz, {named} by name", self.default.cn0_dbhz)
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let listed = self.satellites.iter().find(|(sv, _)| *sv == sight.sv).map(|(_, fixed)| fixed);
        listed.unwrap_or(&self.default).act(sight, signal, rays);
    }
}
