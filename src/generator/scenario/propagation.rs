//! Propagation between satellites and antenna as written, and the effects that it becomes.

use std::path::{Path, PathBuf};

use super::files::Files;
use super::read::Table;
use super::{Scenario, ScenarioError};
use crate::effect::bdgim::BdgimIonosphere;
use crate::effect::ionosphere::KlobucharIonosphere;
use crate::effect::mapping;
use crate::effect::nequick::NequickIonosphere;
use crate::effect::tec::{Content, EARTH_RADIUS_M, Mapping, Shell, ShellIonosphere};
use crate::effect::troposphere::{Air, Troposphere, Weather};
use crate::ray::Effect;
use gnss::bdgim::Bdgim;
use gnss::ionex::{Interpolation, Maps};
use gnss::ionosphere::NAVIC_HZ;
use gnss::klobuchar::{Klobuchar, L1_HZ};
use gnss::nequick::NequickG;
use gnss::rinex::Navigation;
use gnss::time::Epoch;
use gnss::vienna::{Gpt3, MappingGrid, Vienna};
use gnss::vmf3::Vmf3;

/// True ionosphere, and the ionosphere that the satellites broadcast.
#[derive(Clone, Debug, PartialEq)]
pub struct Ionosphere {
    /// Electrons that delay the signals.
    pub truth: Electrons,
    /// Coefficients that the satellites broadcast; absent means those of `truth`, or else the navigation
    /// file's.
    pub broadcast: Option<Klobuchar>,
    /// Coefficients of NeQuick-G that are sent instead of the true ones or the file's.
    pub broadcast_ai: Option<[f64; 3]>,
    /// Coefficients of BDGIM that are sent instead of the true ones or the file's; nine zeros for none.
    pub broadcast_bdgim_tecu: Option<[f64; 9]>,
}

/// Distribution of the electrons.
#[derive(Clone, Debug, PartialEq)]
pub enum Electrons {
    /// Klobuchar's model with the given coefficients, or those of the navigation file.
    Klobuchar(Option<Klobuchar>),
    /// NeQuick-G with the given coefficients, or those of the navigation file.
    NequickG(Option<[f64; 3]>),
    /// BDGIM with the given coefficients, or those of the navigation file.
    Bdgim(Option<Bdgim>),
    /// Constant vertical content everywhere.
    Constant {
        /// Vertical content, in TECU.
        vtec_tecu: f64,
        /// Shell in which the electrons are assumed.
        shell: Shell,
    },
    /// Maps from a file; `map_start` is the instant of the maps that applies at the scene's start.
    Ionex {
        /// The IONEX file.
        file: PathBuf,
        /// The time in the file at which the scene begins; absent means the scene's own.
        map_start: Option<Epoch>,
        /// Method of interpolation between two maps.
        interpolation: Interpolation,
        /// Growth of the delay towards the horizon.
        mapping: Mapping,
    },
}

pub(super) fn ionosphere(table: &Table<'_>) -> Result<Ionosphere, ScenarioError> {
    let models = [("klobuchar", 0), ("constant_tec", 1), ("ionex", 2), ("nequick_g", 3), ("bdgim", 4)];
    let model = table.need_choice("model", &models)?;
    let broadcast = coefficients(table, "broadcast_alpha", "broadcast_beta")?;
    let mappings = [("single_layer", Mapping::SingleLayer), ("modified_single_layer", Mapping::ModifiedSingleLayer)];
    let mapping = |table: &Table<'_>| Ok(table.choice("mapping", &mappings)?.unwrap_or(Mapping::SingleLayer));
    let truth = match model {
        0 => Electrons::Klobuchar(coefficients(table, "alpha", "beta")?),
        1 => {
            let height_m = table.need("shell_km")? * 1e3;
            let shell = Shell { radius_m: EARTH_RADIUS_M, height_m, mapping: mapping(table)? };
            Electrons::Constant { vtec_tecu: table.need("vtec_tecu")?, shell }
        }
        3 => Electrons::NequickG(table.numbers("ai")?),
        4 => {
            let given = table.numbers("bdgim_tecu")?.map(|alpha_tecu| {
                Bdgim::given(alpha_tecu).ok_or_else(|| table.bad("bdgim_tecu", "nine numbers that are not all zero"))
            });
            Electrons::Bdgim(given.transpose()?)
        }
        _ => {
            let file = table.need_text("file")?;
            let start = table.instant("map_start")?;
            let ways = [("bilinear", Interpolation::Bilinear), ("bicubic", Interpolation::Bicubic)];
            Electrons::Ionex {
                file: PathBuf::from(file),
                map_start: start.map(|s| Epoch::parse(&s).map_err(|e| table.bad("map_start", e))).transpose()?,
                interpolation: table.choice("interpolation", &ways)?.unwrap_or(Interpolation::Bilinear),
                mapping: mapping(table)?,
            }
        }
    };
    let broadcast_ai = table.numbers("broadcast_ai")?;
    Ok(Ionosphere { truth, broadcast, broadcast_ai, broadcast_bdgim_tecu: table.numbers("broadcast_bdgim_tecu")? })
}

/// Klobuchar's coefficients, both lists or none.
fn coefficients(table: &Table<'_>, alpha: &str, beta: &str) -> Result<Option<Klobuchar>, ScenarioError> {
    match (table.numbers(alpha)?, table.numbers(beta)?) {
        (None, None) => Ok(None),
        (Some(alpha), Some(beta)) => Ok(Some(Klobuchar { alpha, beta })),
        (None, _) => Err(table.bad(alpha, format!("four numbers, because {beta} is given"))),
        (_, None) => Err(table.bad(beta, format!("four numbers, because {alpha} is given"))),
    }
}

impl Ionosphere {
    /// Klobuchar coefficients that the satellites broadcast, if the scenario states them.
    pub(super) fn sent(&self) -> Option<Klobuchar> {
        self.broadcast.or(match self.truth {
            Electrons::Klobuchar(given) => given,
            _ => None,
        })
    }

    /// True if Klobuchar's model is the true ionosphere.
    pub(super) fn is_klobuchar(&self) -> bool {
        matches!(self.truth, Electrons::Klobuchar(_))
    }

    /// Coefficients of NeQuick-G that the satellites send, if the scenario states them.
    pub(super) fn sent_nequick(&self) -> Option<[f64; 3]> {
        self.broadcast_ai.or(match self.truth {
            Electrons::NequickG(given) => given,
            _ => None,
        })
    }

    /// Coefficients of BDGIM that the satellites send, if the scenario states them; nine zeros for none.
    pub(super) fn sent_bdgim_tecu(&self) -> Option<[f64; 9]> {
        self.broadcast_bdgim_tecu.or(match self.truth {
            Electrons::Bdgim(given) => given.map(|model| model.alpha_tecu),
            _ => None,
        })
    }

    /// The effect, with its file read; `navigation` states what the scenario does not, `end_s` is the scene's
    /// end.
    pub(super) fn effect(
        &self,
        scenario: &Scenario,
        files: &Files<'_>,
        navigation: &Navigation,
        end_s: f64,
    ) -> Result<Box<dyn Effect>, ScenarioError> {
        match &self.truth {
            Electrons::Klobuchar(given) => {
                let of_gps = given.or(navigation.klobuchar).map(|model| (model, L1_HZ));
                let found = of_gps.or_else(|| navigation.klobuchar_navic.map(|model| (model, NAVIC_HZ)));
                let (model, defined_hz) = found.ok_or_else(|| {
                    let reason = "the navigation file has no Klobuchar coefficients: write alpha and beta here, name \
                                  a file that has them, or remove [ionosphere]";
                    scenario.conflict("ionosphere", reason.to_owned())
                })?;
                Ok(Box::new(KlobucharIonosphere { model, defined_hz }))
            }
            Electrons::NequickG(given) => {
                let coefficients = given.or(navigation.nequick).ok_or_else(|| {
                    let reason = "the navigation file has no coefficients of NeQuick-G (GAL): write ai here, name a \
                                  file that has them, or choose another model";
                    scenario.conflict("ionosphere", reason.to_owned())
                })?;
                Ok(Box::new(NequickIonosphere { model: NequickG { coefficients } }))
            }
            Electrons::Bdgim(given) => {
                let model = given.or(navigation.bdgim).ok_or_else(|| {
                    let reason = "the navigation file has no coefficients of BDGIM (ION records CNVX of BeiDou): write \
                                  bdgim_tecu here, name a file that has them, or choose another model";
                    scenario.conflict("ionosphere", reason.to_owned())
                })?;
                Ok(Box::new(BdgimIonosphere { model }))
            }
            Electrons::Constant { vtec_tecu, shell } => {
                Ok(Box::new(ShellIonosphere { content: Content::Constant(*vtec_tecu), shell: *shell }))
            }
            Electrons::Ionex { file, map_start, interpolation, mapping } => {
                let bytes = scenario.load("ionosphere.file", files.directory, file, files.overrides)?;
                let maps = Maps::read(&bytes, &file.display().to_string())
                    .map_err(|e| scenario.conflict("ionosphere.file", e.to_string()))?;
                let from = map_start.unwrap_or(scenario.start);
                let (first, last) = maps.span();
                if from.since(first) < 0.0 || last.since(from.plus_s(end_s)) < 0.0 {
                    let until = from.plus_s(end_s);
                    let reason = format!(
                        "the maps are of {first} to {last}, the scene needs {from} to {until}: name the maps of that \
                         day, or say with ionosphere.map_start which instant of theirs applies at the scene's start"
                    );
                    return Err(scenario.conflict("ionosphere.file", reason));
                }
                let shell = Shell { radius_m: maps.radius_m, height_m: maps.height_m, mapping: *mapping };
                let later_s = from.since(scenario.start);
                let content = Content::Maps { maps: Box::new(maps), later_s, interpolation: *interpolation };
                Ok(Box::new(ShellIonosphere { content, shell }))
            }
        }
    }
}

/// Neutral atmosphere as written.
#[derive(Clone, Debug, PartialEq)]
pub struct NeutralAtmosphere {
    /// Weather at the ground.
    pub weather: Weather,
    /// File of GPT3, for the weather, and for a mapping function that needs coefficients.
    pub gpt3_file: Option<PathBuf>,
    /// Growth of the delay towards the horizon.
    pub mapping: MappingKind,
}

/// Mapping function that the scenario selects.
#[derive(Clone, Debug, PartialEq)]
pub enum MappingKind {
    /// One over the sine of the elevation.
    Cosecant,
    /// Niell's functions.
    Niell,
    /// Vienna mapping functions, with coefficients a from this grid, or from GPT3.
    Vienna(Vienna, Option<PathBuf>),
}

pub(super) fn troposphere(table: &Table<'_>) -> Result<NeutralAtmosphere, ScenarioError> {
    table.need_choice("model", &[("saastamoinen", ())])?;
    let path = |key: &str| Ok(table.text(key)?.map(PathBuf::from));
    let (gpt3_file, vmf_file) = (path("gpt3_file")?, path("vmf_file")?);
    let standard = Weather::STANDARD;
    let celsius = table.number("temperature_c")?;
    let weather = Weather {
        height_m: table.need("height_m")?,
        pressure_hpa: table.need("pressure_hpa")?,
        temperature_k: celsius.map_or(standard.temperature_k, |c| c + 273.15),
        relative_humidity: table.need("relative_humidity")?,
    };
    if gpt3_file.is_some() && weather != standard {
        return Err(table.bad("gpt3_file", "no weather of the scene beside it, because it brings its own"));
    }
    let names = [("niell", 0), ("cosecant", 1), ("vmf1", 2), ("vmf3", 3)];
    let mapping = match (table.choice("mapping", &names)?.unwrap_or(0), vmf_file) {
        (2 | 3, None) if gpt3_file.is_none() => {
            let expected =
                "vmf_file or gpt3_file beside it, which hold vmf1's and vmf3's coefficients, or niell or cosecant";
            return Err(table.bad("mapping", expected));
        }
        (2, file) => MappingKind::Vienna(Vienna::Vmf1, file),
        (3, file) => MappingKind::Vienna(Vienna::Vmf3, file),
        (_, Some(_)) => return Err(table.bad("vmf_file", "mapping = \"vmf1\" or \"vmf3\" beside it")),
        (1, None) => MappingKind::Cosecant,
        (_, None) => MappingKind::Niell,
    };
    Ok(NeutralAtmosphere { weather, gpt3_file, mapping })
}

impl NeutralAtmosphere {
    /// The effect, with its files read.
    pub(super) fn effect(&self, scenario: &Scenario, files: &Files<'_>) -> Result<Box<dyn Effect>, ScenarioError> {
        let gpt3 = match &self.gpt3_file {
            None => None,
            Some(path) => {
                let key = "troposphere.gpt3_file";
                let bytes = scenario.load(key, files.directory, path, files.overrides)?;
                let read = Gpt3::read(&bytes, &path.display().to_string());
                Some(read.map_err(|e| scenario.conflict(key, e.to_string()))?)
            }
        };
        let mapping = match &self.mapping {
            MappingKind::Cosecant => mapping::Mapping::Cosecant,
            MappingKind::Niell => mapping::Mapping::Niell,
            MappingKind::Vienna(kind, file) => {
                let a = match (file, &gpt3) {
                    (Some(path), _) => mapping::Coefficients::Grid(Box::new(grid(path, *kind, scenario, files)?)),
                    (None, Some(gpt3)) => mapping::Coefficients::Gpt3(Box::new(gpt3.clone())),
                    (None, None) => {
                        let reason = "vmf1 and vmf3 need vmf_file or gpt3_file, which hold their coefficients";
                        return Err(scenario.conflict("troposphere.mapping", reason.to_owned()));
                    }
                };
                match kind {
                    Vienna::Vmf1 => mapping::Mapping::Vmf1(a),
                    Vienna::Vmf3 => {
                        let own = Vmf3::embedded();
                        let own = own.map_err(|e| scenario.conflict("troposphere.mapping", e.to_string()))?;
                        mapping::Mapping::Vmf3(a, Box::new(own))
                    }
                }
            }
        };
        let air = gpt3.map_or(Air::Weather(self.weather), |gpt3| Air::Gpt3(Box::new(gpt3)));
        Ok(Box::new(Troposphere { air, mapping }))
    }
}

/// Coefficients a off a file, which must not be VMF1's if VMF3 is wanted.
fn grid(path: &Path, wanted: Vienna, scenario: &Scenario, files: &Files<'_>) -> Result<MappingGrid, ScenarioError> {
    let key = "troposphere.vmf_file";
    let bytes = scenario.load(key, files.directory, path, files.overrides)?;
    let read = MappingGrid::read(&bytes, &path.display().to_string());
    let grid = read.map_err(|e| scenario.conflict(key, e.to_string()))?;
    if (wanted, grid.fitted_with) == (Vienna::Vmf3, Some(Vienna::Vmf1)) {
        let reason = "the file's heading says that its coefficients are VMF1's, which do not go with VMF3's others: \
                      name a VMF3 file, or write mapping = \"vmf1\"";
        return Err(scenario.conflict(key, reason.to_owned()));
    }
    Ok(grid)
}
