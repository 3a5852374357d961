//! Table `[city]`: walls and roofs around the antenna.
//!
//! A file with a reference system of [`projection::SUPPORTED`] is where that says; any other file is put at a
//! position of the scenario, its axes east, north and up there.

use std::path::PathBuf;

use nalgebra::Vector3;

use super::files::Files;
use super::parts::Sky;
use super::read::Table;
use super::{Scenario, ScenarioError};
use crate::effect::city::facet::{Facet, facets};
use crate::effect::city::material::{MATERIALS, Material};
use crate::effect::city::search::{Quest, instants};
use crate::effect::city::trace::{Carrier, Walls};
use crate::effect::city::{Axes, City};
use crate::vehicle::Trajectory;
use gnss::cityjson::{self, Model};
use gnss::earth::Geodetic;
use gnss::geoid;
use gnss::place::counted;
use gnss::projection::{self, Reference};
use gnss::satellite::Sv;

/// Most surfaces of a scene, and most ways of a satellite.
const MOST_SURFACES: usize = 500_000;
const MOST_WAYS: usize = 4096;
/// Part of the radius by which positions of the antenna are apart for the choice of surfaces.
const THINNED: f64 = 0.05;

/// Walls and roofs, as a scenario writes them.
#[derive(Clone, Debug, PartialEq)]
pub struct CitySpec {
    /// City model.
    pub file: PathBuf,
    /// Level of detail; absent means the highest of each object.
    pub lod: Option<String>,
    /// Distance from the antenna's way within which surfaces are used, in metres.
    pub radius_m: f64,
    /// Material of walls and roofs.
    pub material: Material,
    /// Largest number of reflections of a ray.
    pub order: u32,
    /// True if edges diffract.
    pub diffraction: bool,
    /// Amplitude with which the antenna receives left-hand waves, of right-hand ones.
    pub cross: f64,
    /// Position of a point of the file; absent means by its reference system.
    pub anchor: Option<Anchor>,
    /// Height above the ellipsoid of the reference system's zero, in metres; absent means as the system has
    /// it.
    pub zero_m: Option<f64>,
}

/// Position of a point of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Coordinates in the file, in metres.
    pub origin_m: [f64; 3],
    /// Position of that point.
    pub position: Geodetic,
}

pub(super) fn city(table: &Table<'_>) -> Result<CitySpec, ScenarioError> {
    let lod = table.text("lod")?;
    if lod.is_some_and(|lod| !lod.chars().all(|c| c.is_ascii_digit() || c == '.')) {
        return Err(table.bad("lod", "a level of detail like \"2.2\", or \"2\" for all of 2"));
    }
    let names = MATERIALS.map(|material| (material.name(), material));
    let listed = table.choice("material", &names)?;
    let material = match (table.number("permittivity")?, table.number("conductivity_spm")?) {
        (Some(permittivity), Some(conductivity_spm)) if listed.is_none() => {
            Material::Given { permittivity, conductivity_spm }
        }
        (Some(_), Some(_)) => return Err(table.bad("permittivity", "no material beside it, or material alone")),
        (Some(_), None) => return Err(table.bad("conductivity_spm", "a number, because permittivity is given")),
        (None, Some(_)) => return Err(table.bad("permittivity", "a number, because conductivity_spm is given")),
        (None, None) => listed.unwrap_or(MATERIALS[0]),
    };
    let height_m = table.number("height_m")?;
    let origin_m = table.numbers::<3>("origin_m")?;
    let anchor = match (table.number("latitude_deg")?, table.number("longitude_deg")?) {
        (Some(latitude_deg), Some(longitude_deg)) => {
            let height_m = height_m
                .ok_or_else(|| table.bad("height_m", "a number, because latitude_deg and longitude_deg are given"))?;
            let position = Geodetic::from_degrees(latitude_deg, longitude_deg, height_m);
            Some(Anchor { origin_m: origin_m.unwrap_or_default(), position })
        }
        (Some(_), None) => return Err(table.bad("longitude_deg", "a number, because latitude_deg is given")),
        (None, Some(_)) => return Err(table.bad("latitude_deg", "a number, because longitude_deg is given")),
        (None, None) if origin_m.is_some() => {
            return Err(table.bad("origin_m", "latitude_deg, longitude_deg and height_m beside it"));
        }
        (None, None) => None,
    };
    Ok(CitySpec {
        file: PathBuf::from(table.need_text("file")?),
        lod: lod.map(str::to_owned),
        radius_m: table.need("radius_m")?,
        material,
        order: table.need_integer("order")? as u32,
        diffraction: table.flag("diffraction")?.unwrap_or(true),
        cross: libm::pow(10.0, -table.need("cross_polar_db")? / 20.0),
        anchor,
        zero_m: height_m.filter(|_| anchor.is_none()),
    })
}

/// Position on the Earth of the vertices of a model.
enum Placed {
    Anchored { axes: Axes, origin_m: Vector3<f64> },
    Projected { reference: Reference, zero_m: Option<f64> },
}

impl Placed {
    fn new(spec: &CitySpec, model: &Model, scenario: &Scenario) -> Result<Self, ScenarioError> {
        if let Some(Anchor { origin_m, position }) = spec.anchor {
            return Ok(Self::Anchored { axes: Axes::at(position.to_ecef()), origin_m: Vector3::from(origin_m) });
        }
        let refuse = |reason: String| Err(scenario.conflict("city.file", reason));
        let Some(name) = &model.reference else {
            return refuse(format!(
                "{}: the file has no metadata.referenceSystem: expected latitude_deg, longitude_deg and height_m of \
                 origin_m in [city]",
                spec.file.display()
            ));
        };
        match Reference::code_of(name).and_then(Reference::of_code) {
            Some(reference) => Ok(Self::Projected { reference, zero_m: spec.zero_m }),
            None => refuse(format!(
                "{}: metadata.referenceSystem = {name:?}: expected {}, or latitude_deg, longitude_deg and height_m of \
                 origin_m in [city]",
                spec.file.display(),
                projection::SUPPORTED
            )),
        }
    }

    fn ecef_m(&self, vertex: &[f64; 3]) -> Vector3<f64> {
        match self {
            Self::Anchored { axes, origin_m } => axes.ecef_m(&(Vector3::from(*vertex) - origin_m)),
            Self::Projected { reference, zero_m } => {
                let [east_m, north_m, up_m] = *vertex;
                let on_ground = reference.geodetic(east_m, north_m, 0.0);
                let geoid_m = || match reference.levelled {
                    true => geoid::separation_m(on_ground.latitude_rad, on_ground.longitude_rad),
                    false => 0.0,
                };
                Geodetic { height_m: up_m + zero_m.unwrap_or_else(geoid_m), ..on_ground }.to_ecef()
            }
        }
    }
}

/// The effect: the file is read, surfaces are chosen, and ways by mirrors are sought.
pub(super) fn effect(
    spec: &CitySpec,
    scenario: &Scenario,
    files: &Files<'_>,
    (sky, trajectory): (&Sky, &Trajectory),
    end_s: f64,
) -> Result<City, ScenarioError> {
    if trajectory.grown().is_some() {
        let reason = "the motion is pushed while the scene is sent, and ways by mirrors are sought beforehand: \
                      expected a motion that the scenario states";
        return Err(scenario.conflict("city", reason.to_owned()));
    }
    let bytes = scenario.load("city.file", files.directory, &spec.file, files.overrides)?;
    let model = cityjson::read(&bytes, &spec.file.display().to_string(), spec.lod.as_deref())
        .map_err(|e| scenario.conflict("city.file", e.to_string()))?;
    let placed = Placed::new(spec, &model, scenario)?;
    let axes = Axes::at(trajectory.at(0.0).position_m);
    let facets = near(spec, scenario, (&model, &placed), (axes, trajectory), end_s)?;
    let walls = Walls::new(facets, spec.diffraction);
    let satellites: Vec<Sv> = sky
        .catalogue
        .satellites()
        .filter(|sv| !sky.excluded.contains(sv) && scenario.signals.iter().any(|signal| signal.system == sv.system))
        .collect();
    // The longest wavelength has the widest zones.
    let lowest_hz = scenario.signals.iter().fold(f64::INFINITY, |least, signal| least.min(signal.centre_hz()));
    let quest = Quest {
        walls: &walls,
        axes,
        order: spec.order,
        carrier: Carrier::new(lowest_hz, &spec.material, spec.cross),
        catalogue: &sky.catalogue,
        satellites: if spec.order == 0 { &[] } else { &satellites },
        trajectory,
        start: scenario.start,
    };
    let ways = quest.ways(end_s).map_err(|e| scenario.conflict("navigation.file", e.to_string()))?;
    if let Some((sv, all)) = ways.iter().find(|(_, all)| all.len() > MOST_WAYS) {
        let reason = format!(
            "{sv} has {} in this scene: expected at most {MOST_WAYS}; shorten the scene, or lessen radius_m or order",
            counted(all.len(), "echo path")
        );
        return Err(scenario.conflict("city", reason));
    }
    let (material, cross, start) = (spec.material, spec.cross, scenario.start);
    Ok(City { walls, material, cross, axes, start, ways })
}

/// Surfaces within the radius of the antenna's way.
fn near(
    spec: &CitySpec,
    scenario: &Scenario,
    (model, placed): (&Model, &Placed),
    (axes, trajectory): (Axes, &Trajectory),
    end_s: f64,
) -> Result<Vec<Facet>, ScenarioError> {
    let mut way_m: Vec<Vector3<f64>> = Vec::new();
    for t_s in instants(trajectory, end_s) {
        let here_m = axes.local_m(&trajectory.at(t_s).position_m);
        if way_m.last().is_none_or(|last| (here_m - last).norm() > THINNED * spec.radius_m) {
            way_m.push(here_m);
        }
    }
    let local = |vertex: &[f64; 3]| axes.local_m(&placed.ecef_m(vertex));
    let is_near = |low_m: &Vector3<f64>, high_m: &Vector3<f64>| {
        way_m.iter().any(|at_m| (low_m - at_m).sup(&(at_m - high_m)).sup(&Vector3::zeros()).norm() <= spec.radius_m)
    };
    let found = facets(model, local, is_near);
    if found.is_empty() {
        let first_m = way_m.first().copied().unwrap_or_default();
        let away_m =
            model.vertices_m.iter().map(|vertex| (local(vertex) - first_m).norm()).fold(f64::INFINITY, f64::min);
        let reason = format!(
            "{}: no wall or roof within radius_m = {} m of the antenna: the nearest vertex is {away_m:.0} m from its \
             first position",
            spec.file.display(),
            spec.radius_m
        );
        return Err(scenario.conflict("city.file", reason));
    }
    if found.len() > MOST_SURFACES {
        let reason = format!("{} surfaces: expected at most {MOST_SURFACES}", found.len());
        return Err(scenario.conflict("city.radius_m", reason));
    }
    Ok(found)
}
